/**
 * @file mdl_app_config.h
 * @brief Compile-time knobs of the application. The sample rate, the scaling of both converters
 *        and the model are parameters: mdl_params.h, written by `madelung export`.
 */
#ifndef MDL_APP_CONFIG_H
#define MDL_APP_CONFIG_H

#include "mdl_config.h"

/**
 * Samples that the record holds. Unit: samples. Limit: 1 to 16384. Memory: 3 words of 16 bits
 * each. A larger record takes RAM that code or stack could use; 1024 are 0.1 s at 10 kHz.
 */
#ifndef MDL_RECORD_LENGTH
#define MDL_RECORD_LENGTH 1024
#endif

MDL_STATIC_ASSERT(MDL_RECORD_LENGTH >= 1 && MDL_RECORD_LENGTH <= 16384, record_length_in_range);

#endif
