/**
 * @file fake_hal.h
 * @brief A HAL that does what a test says and notes the order of the calls.
 */
#ifndef FAKE_HAL_H
#define FAKE_HAL_H

#include "mdl_hal.h"

typedef struct {
    uint16_t drive_code, sensor_code; /**< in: what the next conversion gives */
    mdl_hal_status adc, dac, clock;   /**< in: what the calls return */
    uint16_t dac_code;                /**< the last one written */
    char calls[64];                   /**< one letter per call: u adc-read dac-write d ack */
} fake_hal_state;

extern fake_hal_state hal;

/** All calls succeed, none was made. */
void fake_hal_reset(void);

#endif
