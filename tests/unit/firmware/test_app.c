/* The interrupt loop on a fake HAL, with the parameters of the paper, eq. (20). */
#include "unity.h"

#include "fake_hal.h"
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

#include <math.h>
#include <string.h>

static mdl_tp_side left, right, left2, right2;
static mdl_app_record record;
static mdl_app app;

/* Memory as COFF start-up leaves it: whatever was there. */
static void poison(void)
{
    memset(&left, 0xA5, sizeof left);
    memset(&right, 0xA5, sizeof right);
    memset(&record, 0xA5, sizeof record);
    memset(&app, 0xA5, sizeof app);
}

static void start(const mdl_app_params *params)
{
    poison();
    TEST_ASSERT_EQUAL_INT(MDL_OK, mdl_app_init(&app, params, &left, &right, &record));
}

static void sample(uint16_t code)
{
    hal.drive_code = code;
    hal.sensor_code = (uint16_t)(4095u - code);
    mdl_app_isr(&app);
}

static float bits_apart(float a, float b)
{
    return a == b ? 0.0f : fabsf(a - b);
}

void setUp(void)
{
    fake_hal_reset();
    start(&mdl_params);
}

void tearDown(void)
{
}

void test_a_sample_raises_the_pin_reads_writes_lowers_it_and_acknowledges_in_this_order(void)
{
    sample(100);
    TEST_ASSERT_EQUAL_STRING("up adc dac down ack ", hal.calls);
}

void test_without_a_conversion_nothing_is_written_and_the_state_stays(void)
{
    mdl_chain before;
    sample(2000);
    before = app.chain;
    hal.adc = MDL_HAL_ERR_TIMEOUT;
    hal.calls[0] = '\0';
    sample(3000);
    TEST_ASSERT_EQUAL_STRING("up adc down ack ", hal.calls);
    TEST_ASSERT_EQUAL_MEMORY(&before, &app.chain, sizeof before);
    TEST_ASSERT_EQUAL_UINT32(1, app.counters.adc_faults);
    TEST_ASSERT_EQUAL_UINT32(2, app.counters.cycles);
    TEST_ASSERT_EQUAL_UINT16(1, record.next);
}

void test_a_busy_dac_is_counted_and_the_prediction_goes_on(void)
{
    hal.dac = MDL_HAL_ERR_TIMEOUT;
    sample(1000);
    hal.dac = MDL_HAL_OK;
    sample(2000);
    TEST_ASSERT_EQUAL_UINT32(1, app.counters.dac_faults);
    TEST_ASSERT_EQUAL_UINT16(record.dac_code[1], hal.dac_code);
    TEST_ASSERT_EQUAL_UINT16(2, record.next);
}

void test_overruns_are_counted(void)
{
    hal.clock = MDL_HAL_OVERRUN;
    sample(1);
    sample(2);
    hal.clock = MDL_HAL_OK;
    sample(3);
    TEST_ASSERT_EQUAL_UINT32(2, app.counters.overruns);
    TEST_ASSERT_EQUAL_UINT32(3, app.counters.cycles);
}

void test_every_code_gives_what_the_chain_gives_and_none_leaves_the_identified_range(void)
{
    mdl_chain chain;
    uint16_t i;
    TEST_ASSERT_EQUAL_INT(MDL_OK, mdl_chain_init(&chain, &mdl_params.chain, &left2, &right2));
    for (i = 0; i <= MDL_CODE_MAX; i++) {
        uint16_t code = (uint16_t)((i * 2731u) & MDL_CODE_MAX); /* odd factor: a permutation */
        mdl_real y;
        (void)mdl_chain_step(&chain, mdl_app_volts(&mdl_params, code), &y);
        sample(code);
        TEST_ASSERT_TRUE(bits_apart(y, app.y_um) == 0.0f);
    }
    TEST_ASSERT_EQUAL_UINT32(0, app.counters.extrapolated);
    TEST_ASSERT_EQUAL_UINT32(0, app.counters.clamped);
    TEST_ASSERT_EQUAL_UINT32(0, app.counters.memory_full);
    TEST_ASSERT_EQUAL_UINT32(0, app.counters.refused);
    TEST_ASSERT_EQUAL_UINT32(4096, app.counters.cycles);
}

void test_the_ends_of_the_codes_are_the_ends_of_the_range(void)
{
    TEST_ASSERT_EQUAL_FLOAT(0.0f, mdl_app_volts(&mdl_params, 0));
    TEST_ASSERT_FLOAT_WITHIN(1e-5f, 40.0f, mdl_app_volts(&mdl_params, MDL_CODE_MAX));
    TEST_ASSERT_TRUE(mdl_app_volts(&mdl_params, MDL_CODE_MAX) <= 40.0f);
}

void test_the_dac_code_is_rounded_to_nearest_and_clamped(void)
{
    mdl_app_params p = mdl_params;
    uint16_t clamped;
    p.y_zero_um = -1.0f;
    p.codes_per_um = 1024.0f;
#define EXPECT(code, was_clamped, y)                                                               \
    TEST_ASSERT_EQUAL_UINT16(code, mdl_app_dac_code(&p, y, &clamped));                             \
    TEST_ASSERT_EQUAL_UINT16(was_clamped, clamped)
    EXPECT(0, 0, -1.0f);
    EXPECT(0, 0, -1.0f + 0.49f / 1024.0f);
    EXPECT(1, 0, -1.0f + 0.51f / 1024.0f);
    EXPECT(1024, 0, 0.0f);
    EXPECT(4095, 0, -1.0f + 4095.0f / 1024.0f);
    EXPECT(4095, 0, -1.0f + 4095.4f / 1024.0f);
    EXPECT(0, 1, -1.0f - 0.6f / 1024.0f);
    EXPECT(4095, 1, -1.0f + 4095.6f / 1024.0f);
    EXPECT(0, 1, -1e30f);
    EXPECT(4095, 1, 1e30f);
#undef EXPECT
}

void test_a_wider_input_is_extrapolated_then_clamped_and_both_are_counted(void)
{
    mdl_app_params p = mdl_params;
    p.volts_per_code = 60.0f / 4095.0f; /* the margin ends at 46 V */
    p.u_zero_volts = -10.0f;            /* -10 .. 50 V */
    start(&p);
    sample(0);    /* -10 V: beyond the margin of -6 V */
    sample(400);  /* -4.1 V */
    sample(2000); /* 19.3 V */
    sample(3600); /* 42.7 V */
    sample(4095); /* 50 V */
    TEST_ASSERT_EQUAL_UINT32(2, app.counters.clamped);
    TEST_ASSERT_EQUAL_UINT32(2, app.counters.extrapolated);
    TEST_ASSERT_TRUE(app.counters.dac_clamped >= 3);
    TEST_ASSERT_EQUAL_INT(MDL_CLAMPED, app.status);
}

void test_the_record_is_a_ring_of_both_inputs_and_the_output(void)
{
    uint16_t i;
    for (i = 0; i < MDL_RECORD_LENGTH + 2; i++) {
        sample((uint16_t)(i & MDL_CODE_MAX));
    }
    TEST_ASSERT_EQUAL_UINT16(2, record.next);
    TEST_ASSERT_EQUAL_UINT16(MDL_RECORD_LENGTH + 1, record.drive_code[1]);
    TEST_ASSERT_EQUAL_UINT16(4095 - (MDL_RECORD_LENGTH + 1), record.sensor_code[1]);
    TEST_ASSERT_EQUAL_UINT16(hal.dac_code, record.dac_code[1]);
    TEST_ASSERT_EQUAL_UINT16(2, record.drive_code[2]);
}

void test_the_sensor_does_not_touch_the_prediction(void)
{
    uint16_t i;
    static uint16_t first[500];
    for (i = 0; i < 500; i++) {
        hal.drive_code = (uint16_t)((i * 997u) & MDL_CODE_MAX);
        hal.sensor_code = 0;
        mdl_app_isr(&app);
        first[i] = hal.dac_code;
    }
    start(&mdl_params);
    for (i = 0; i < 500; i++) {
        hal.drive_code = (uint16_t)((i * 997u) & MDL_CODE_MAX);
        hal.sensor_code = (uint16_t)(i * 8u);
        mdl_app_isr(&app);
        TEST_ASSERT_EQUAL_UINT16(first[i], hal.dac_code);
    }
}

void test_parameters_that_make_no_sense_are_refused(void)
{
    const float bad[] = {0.0f, -1.0f};
    uint16_t i;
    mdl_app_params p;
    for (i = 0; i < 2; i++) {
        p = mdl_params;
        p.volts_per_code = bad[i];
        TEST_ASSERT_EQUAL_INT(MDL_ERR_PARAMETER, mdl_app_init(&app, &p, &left, &right, &record));
        p = mdl_params;
        p.codes_per_um = bad[i];
        TEST_ASSERT_EQUAL_INT(MDL_ERR_PARAMETER, mdl_app_init(&app, &p, &left, &right, &record));
    }
    p = mdl_params;
    p.rate_hz = 0;
    TEST_ASSERT_EQUAL_INT(MDL_ERR_PARAMETER, mdl_app_init(&app, &p, &left, &right, &record));
    p = mdl_params;
    p.u_zero_volts = NAN;
    TEST_ASSERT_EQUAL_INT(MDL_ERR_NOT_FINITE, mdl_app_init(&app, &p, &left, &right, &record));
    p = mdl_params;
    p.codes_per_um = INFINITY;
    TEST_ASSERT_EQUAL_INT(MDL_ERR_NOT_FINITE, mdl_app_init(&app, &p, &left, &right, &record));
    p = mdl_params;
    p.chain.u_min_volts = NAN;
    TEST_ASSERT_EQUAL_INT(MDL_ERR_NOT_FINITE, mdl_app_init(&app, &p, &left, &right, &record));
}
