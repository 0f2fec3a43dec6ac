/*
 * The order of calls, with CMock in strict order: of one sample, and of main's set-up. For Ceedling
 * alone, which writes the mocks; `make test` checks the same with the fake HAL and on the fake
 * register file (tests/unit/firmware).
 */
#include "unity.h"

#include "mock_mdl_adc.h"
#include "mock_mdl_board.h"
#include "mock_mdl_clock.h"
#include "mock_mdl_dac.h"
#include "mock_mdl_pin.h"

#include "mdl_app.h"
#include "mdl_backlash.h"
#include "mdl_bouc.h"
#include "mdl_chain.h"
#include "mdl_cycle.h"
#include "mdl_delay.h"
#include "mdl_drive.h"
#include "mdl_envelope.h"
#include "mdl_lag.h"
#include "mdl_major.h"
#include "mdl_mode.h"
#include "mdl_params.h"
#include "mdl_pi.h"
#include "mdl_plays.h"
#include "mdl_power.h"
#include "mdl_rate.h"
#include "mdl_shape.h"
#include "mdl_traj.h"
#include "mdl_yang.h"

int firmware_main(void);
#define main firmware_main
#include "main.c"
#undef main

void setUp(void)
{
    mdl_app_init(&app, &mdl_params, &left, &right, &record);
}

void tearDown(void)
{
}

static void expect_conversion(uint16_t *drive, uint16_t *sensor)
{
    mdl_adc_read_ExpectAndReturn(NULL, NULL, MDL_HAL_OK);
    mdl_adc_read_IgnoreArg_drive_code();
    mdl_adc_read_IgnoreArg_sensor_code();
    mdl_adc_read_ReturnThruPtr_drive_code(drive);
    mdl_adc_read_ReturnThruPtr_sensor_code(sensor);
}

void test_a_sample_raises_the_pin_converts_writes_lowers_the_pin_and_acknowledges_last(void)
{
    uint16_t drive = 0;
    uint16_t sensor = 7;
    mdl_pin_up_Expect();
    expect_conversion(&drive, &sensor);
    mdl_dac_write_ExpectAndReturn(0, MDL_HAL_OK);
    mdl_pin_down_Expect();
    mdl_clock_acknowledge_ExpectAndReturn(MDL_HAL_OK);
    mdl_on_sample();
    TEST_ASSERT_EQUAL_UINT32(1, app.counters.cycles);
    TEST_ASSERT_EQUAL_UINT16(7, record.sensor_code[0]);
}

void test_full_scale_comes_out_as_full_scale(void)
{
    uint16_t drive = MDL_CODE_MAX;
    uint16_t sensor = 0;
    mdl_pin_up_Expect();
    expect_conversion(&drive, &sensor);
    mdl_dac_write_ExpectAndReturn(MDL_CODE_MAX, MDL_HAL_OK);
    mdl_pin_down_Expect();
    mdl_clock_acknowledge_ExpectAndReturn(MDL_HAL_OK);
    mdl_on_sample();
}

void test_without_a_conversion_the_dac_is_left_alone_and_the_sample_still_ends(void)
{
    mdl_pin_up_Expect();
    mdl_adc_read_ExpectAndReturn(NULL, NULL, MDL_HAL_ERR_TIMEOUT);
    mdl_adc_read_IgnoreArg_drive_code();
    mdl_adc_read_IgnoreArg_sensor_code();
    mdl_pin_down_Expect();
    mdl_clock_acknowledge_ExpectAndReturn(MDL_HAL_OVERRUN);
    mdl_on_sample();
    TEST_ASSERT_EQUAL_UINT32(1, app.counters.adc_faults);
    TEST_ASSERT_EQUAL_UINT32(1, app.counters.overruns);
}

/* Expects the first n steps of the set-up, the n-th of which fails when fails is 1. */
static void expect_set_up(int n, int fails)
{
    mdl_hal_status last = fails ? MDL_HAL_ERR_SELF_TEST : MDL_HAL_OK;
    mdl_board_init_ExpectAndReturn(n == 1 ? last : MDL_HAL_OK);
    if (n >= 2) {
        mdl_pin_init_Expect();
        mdl_dac_init_ExpectAndReturn(n == 2 ? last : MDL_HAL_OK);
    }
    if (n >= 3) {
        mdl_adc_init_ExpectAndReturn(n == 3 ? last : MDL_HAL_OK);
    }
    if (n >= 4) {
        mdl_clock_init_ExpectAndReturn(10000, n == 4 ? last : MDL_HAL_OK);
    }
}

void test_main_starts_the_clock_last_then_idles_until_the_run_is_over(void)
{
    expect_set_up(4, 0);
    mdl_clock_start_Expect();
    mdl_board_idle_ExpectAndReturn(1);
    mdl_board_idle_ExpectAndReturn(1);
    mdl_board_idle_ExpectAndReturn(0);
    TEST_ASSERT_EQUAL_INT(0, firmware_main());
}

void test_main_ends_at_the_first_step_that_fails_and_never_starts_the_clock(void)
{
    int n;
    for (n = 1; n <= 4; n++) {
        expect_set_up(n, 1);
        TEST_ASSERT_EQUAL_INT(1, firmware_main());
    }
}
