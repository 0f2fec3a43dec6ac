/**
 * @file mdl_dac.h
 * @brief Contract of the analogue output that carries the predicted displacement.
 */
#ifndef MDL_DAC_H
#define MDL_DAC_H

#include "mdl_hal.h"

/**
 * Configures the output. main calls it once, after mdl_board_init.
 * @return MDL_HAL_OK, MDL_HAL_ERR_SELF_TEST
 */
mdl_hal_status mdl_dac_init(void);

/**
 * Sends one code. The interrupt loop calls it once per sample that was converted. Waits a bounded
 * time if the code before is still on its way; on timeout the output keeps its old code.
 * @param code  0 to MDL_CODE_MAX
 * @return MDL_HAL_OK, MDL_HAL_ERR_TIMEOUT
 */
mdl_hal_status mdl_dac_write(uint16_t code);

#endif
