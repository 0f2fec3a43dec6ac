#include "fake_hal.h"

#include "mdl_adc.h"
#include "mdl_clock.h"
#include "mdl_dac.h"
#include "mdl_pin.h"

#include <string.h>

fake_hal_state hal;

void fake_hal_reset(void)
{
    memset(&hal, 0, sizeof hal);
}

static void note(const char *call)
{
    if (strlen(hal.calls) + strlen(call) < sizeof hal.calls) {
        strcat(hal.calls, call);
    }
}

void mdl_pin_up(void)
{
    note("up ");
}

void mdl_pin_down(void)
{
    note("down ");
}

mdl_hal_status mdl_adc_read(uint16_t *drive_code, uint16_t *sensor_code)
{
    note("adc ");
    if (hal.adc == MDL_HAL_OK) {
        *drive_code = hal.drive_code;
        *sensor_code = hal.sensor_code;
    }
    return hal.adc;
}

mdl_hal_status mdl_dac_write(uint16_t code)
{
    note("dac ");
    if (hal.dac == MDL_HAL_OK) {
        hal.dac_code = code;
    }
    return hal.dac;
}

mdl_hal_status mdl_clock_acknowledge(void)
{
    note("ack ");
    return hal.clock;
}
