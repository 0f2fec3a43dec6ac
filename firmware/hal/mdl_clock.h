/**
 * @file mdl_clock.h
 * @brief Contract of the sample clock: it starts the conversions, and the board calls
 *        mdl_on_sample from its interrupt when the codes of a sample are ready.
 */
#ifndef MDL_CLOCK_H
#define MDL_CLOCK_H

#include "mdl_hal.h"
#include "mdl_sample.h"

/**
 * Sets the sample rate; the clock does not run yet. main calls it once, after mdl_adc_init.
 * @param rate_hz  samples per second, Hz, above 0; the nearest whole period of the board's timer
 *                 is used
 * @return MDL_HAL_OK; MDL_HAL_ERR_PARAMETER for a rate that the timer cannot give
 */
mdl_hal_status mdl_clock_init(uint32_t rate_hz);

/** Enables the interrupt and, last of all, the trigger. main calls it once, after all set-up. */
void mdl_clock_start(void);

/**
 * Re-arms the interrupt. The interrupt loop calls it once per sample, as its last action.
 * @return MDL_HAL_OK; MDL_HAL_OVERRUN when the next sample instant had already passed
 */
mdl_hal_status mdl_clock_acknowledge(void);

#endif
