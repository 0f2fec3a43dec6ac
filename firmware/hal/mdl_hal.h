/**
 * @file mdl_hal.h
 * @brief What the functions of a board return. The contracts are in the other headers of this
 *        folder; a board (bsp_...) implements all of them.
 */
#ifndef MDL_HAL_H
#define MDL_HAL_H

#include <stdint.h>

/** Largest code of the converters; they have 12 bits. */
#define MDL_CODE_MAX 4095u

typedef enum {
    MDL_HAL_OK = 0,
    MDL_HAL_OVERRUN = 1,        /**< the next sample was due before this one was done */
    MDL_HAL_ERR_TIMEOUT = -1,   /**< the peripheral did not answer in a bounded number of polls */
    MDL_HAL_ERR_PARAMETER = -2, /**< an argument is out of its documented range */
    MDL_HAL_ERR_SELF_TEST = -3  /**< the set-up did not have the effect that it should have */
} mdl_hal_status;

#endif
