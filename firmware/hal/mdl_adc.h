/**
 * @file mdl_adc.h
 * @brief Contract of the analogue inputs. Channel 0 is the drive voltage, channel 1 the
 *        displacement sensor. The sensor is recorded, never fed back: the prediction is open loop.
 */
#ifndef MDL_ADC_H
#define MDL_ADC_H

#include "mdl_hal.h"

/**
 * Powers and configures both channels; the sample clock will start the conversions. main calls it
 * once, after mdl_board_init and before mdl_clock_init.
 * @return MDL_HAL_OK, MDL_HAL_ERR_SELF_TEST
 */
mdl_hal_status mdl_adc_init(void);

/**
 * The two codes of this sample instant. The interrupt loop calls it once per sample. Waits a
 * bounded time if the conversion still runs.
 * @param drive_code   0 to MDL_CODE_MAX; untouched on error
 * @param sensor_code  0 to MDL_CODE_MAX; untouched on error
 * @return MDL_HAL_OK, MDL_HAL_ERR_TIMEOUT
 */
mdl_hal_status mdl_adc_read(uint16_t *drive_code, uint16_t *sensor_code);

#endif
