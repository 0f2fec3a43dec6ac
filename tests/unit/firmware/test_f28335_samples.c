/* The F28335's interrupt on the fake register file: what one sample does, a long run against the
 * chain, and every fault that the counters promise to count. */
#include "board_run.inc"

#include "fake_f28335.h"
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

#include <stdlib.h>
#include <string.h>

/* clang-format off */
TEST_SOURCE_FILE("f28335_adc.c")
TEST_SOURCE_FILE("f28335_board.c")
TEST_SOURCE_FILE("f28335_clock.c")
TEST_SOURCE_FILE("f28335_dac_spi.c")
TEST_SOURCE_FILE("f28335_dac_xintf.c")
TEST_SOURCE_FILE("f28335_pin.c")
/* clang-format on */

#define COMMAND 0x3000u

static mdl_tp_side other_left, other_right;

/* A zigzag of decreasing, then increasing amplitude, as in Fig. 12 of the paper. */
static uint16_t zigzag(uint32_t i)
{
    uint32_t leg = i / 40u;
    uint32_t turn = leg % 24u;
    uint32_t inset = (turn < 12u ? turn : 24u - turn) * 160u;
    uint32_t swing = 4095u - 2u * inset;
    uint32_t at = swing * (i % 40u) / 39u;
    return (uint16_t)(leg % 2u == 0 ? inset + at : 4095u - inset - at);
}

static uint16_t flipped(uint32_t i)
{
    return (uint16_t)(4095u - zigzag(i));
}

void setUp(void)
{
    fake_reset();
    fake.drive = zigzag;
    fake.sensor = flipped;
    memset(&app, 0xA5, sizeof app); /* COFF start-up does not clear memory */
    memset(&left, 0xA5, sizeof left);
    memset(&right, 0xA5, sizeof right);
    memset(&record, 0xA5, sizeof record);
}

void tearDown(void)
{
}

static uint32_t first_event_after(const char *name)
{
    uint32_t i;
    uint32_t found = 0;
    for (i = 0; i < fake.logged; i++) {
        found =
            strcmp(fake.log[i].name, name) == 0 && fake.log[i].kind == FAKE_WRITE ? i + 1u : found;
    }
    return found;
}

/* Every access of one sample, in order. */
void test_one_sample_does_exactly_this(void)
{
    static const struct {
        fake_kind kind;
        const char *name;
        uint32_t value;
    } steps[] = {
        {FAKE_WRITE, "ETCLR", 0x0004},     {FAKE_WRITE, "GPBSET", 0x0001},
        {FAKE_READ, "ADCST", 0x0001},      {FAKE_READ, "ADCMIRROR0", 0},
        {FAKE_READ, "ADCMIRROR1", 0},      {FAKE_READ, "SPISTS", 0x0000},
        {FAKE_WRITE, "SPITXBUF", COMMAND}, {FAKE_WRITE, "GPBCLEAR", 0x0001},
        {FAKE_WRITE, "ADCTRL2", 0x4900},   {FAKE_WRITE, "ADCST", 0x0010},
        {FAKE_READ, "ETFLG", 0x0000},      {FAKE_WRITE, "PIEACK", 0x0001},
    };
    const uint32_t n = sizeof steps / sizeof steps[0];
    uint32_t start;
    uint32_t i;
    fake.run_clocks = PERIOD + 1000u;
    TEST_ASSERT_EQUAL_INT(0, firmware_main());
    TEST_ASSERT_EQUAL_UINT32(1, fake.interrupts);
    for (start = fake.logged; start > 0; start--) {
        if (strcmp(fake.log[start - 1u].name, "ETCLR") == 0) {
            break;
        }
    }
    TEST_ASSERT_TRUE(start > first_event_after("PCLKCR0"));
    for (i = 0; i < n; i++) {
        const fake_event *e = &fake.log[start - 1u + i];
        TEST_ASSERT_EQUAL_STRING(steps[i].name, e->name);
        TEST_ASSERT_EQUAL_INT(steps[i].kind, e->kind);
        if (strncmp(e->name, "ADCMIRROR", 9) == 0) {
            TEST_ASSERT_EQUAL_HEX32(i == 3 ? zigzag(1) : flipped(1), e->value);
        } else if (strcmp(e->name, "SPITXBUF") == 0) {
            TEST_ASSERT_EQUAL_HEX32(COMMAND | record.dac_code[0], e->value);
        } else {
            TEST_ASSERT_EQUAL_HEX32(steps[i].value, e->value);
        }
    }
    ASSERT_NO_VIOLATION();
}

void test_the_acknowledge_register_is_never_read_and_pins_change_by_set_and_clear_only(void)
{
    uint32_t i;
    (void)run_samples(20);
    for (i = 0; i < fake.logged; i++) {
        const fake_event *e = &fake.log[i];
        if (e->kind == FAKE_READ) {
            TEST_ASSERT_TRUE(strcmp(e->name, "PIEACK") != 0);
            TEST_ASSERT_TRUE(strncmp(e->name, "GPBSET", 6) != 0);
            TEST_ASSERT_TRUE(strncmp(e->name, "GPBCLEAR", 8) != 0);
        }
        TEST_ASSERT_TRUE(e->address < 0x6FC0 || e->address > 0x6FDF || e->address == 0x6FCA ||
                         e->address == 0x6FCC); /* of the pin data only these */
        if (strcmp(e->name, "PIEACK") == 0) {
            TEST_ASSERT_EQUAL_HEX32(1, e->value);
        }
    }
    ASSERT_NO_VIOLATION();
}

static void expect_words_of_the_chain(uint32_t samples)
{
    mdl_chain chain;
    uint32_t i;
    TEST_ASSERT_EQUAL_INT(MDL_OK,
                          mdl_chain_init(&chain, &mdl_params.chain, &other_left, &other_right));
    TEST_ASSERT_EQUAL_UINT32(samples + 1u, fake.dac_words);
    for (i = 1; i <= samples; i++) {
        mdl_real y;
        uint16_t clamped;
        (void)mdl_chain_step(&chain, mdl_app_volts(&mdl_params, zigzag(i)), &y);
        TEST_ASSERT_EQUAL_HEX16(COMMAND | mdl_app_dac_code(&mdl_params, y, &clamped),
                                fake.dac_word[i]);
    }
}

void test_a_thousand_samples_come_out_as_the_chain_computes_them(void)
{
    const uint32_t n = 1000;
    uint32_t i;
    TEST_ASSERT_EQUAL_INT(0, run_samples(n));
    TEST_ASSERT_EQUAL_UINT32(n, fake.triggers);
    TEST_ASSERT_EQUAL_UINT32(n, app.counters.cycles);
    TEST_ASSERT_EQUAL_UINT32(n, fake.interrupts);
    TEST_ASSERT_EQUAL_UINT32(2 * n, fake.pin_edges);
    TEST_ASSERT_EQUAL_UINT32(0, app.counters.overruns + app.counters.adc_faults +
                                    app.counters.dac_faults + app.counters.extrapolated);
    for (i = 0; i < n && i < MDL_RECORD_LENGTH; i++) {
        TEST_ASSERT_EQUAL_UINT16(zigzag(i + 1u), record.drive_code[i]);
        TEST_ASSERT_EQUAL_UINT16(flipped(i + 1u), record.sensor_code[i]);
    }
    expect_words_of_the_chain(n);
    ASSERT_NO_VIOLATION();
}

void test_a_computation_that_outlasts_the_period_is_counted_as_an_overrun_each_time(void)
{
    fake.compute_clocks = PERIOD + 100u;
    (void)run_samples(20);
    TEST_ASSERT_TRUE(app.counters.cycles >= 9 && app.counters.cycles <= 10);
    TEST_ASSERT_EQUAL_UINT32(app.counters.cycles, app.counters.overruns);
    TEST_ASSERT_EQUAL_UINT32(0, app.counters.adc_faults);
    TEST_ASSERT_EQUAL_UINT32(app.counters.cycles, fake.interrupts);
    ASSERT_NO_VIOLATION();
}

void test_a_computation_that_just_fits_is_no_overrun(void)
{
    fake.compute_clocks = PERIOD - 300u;
    (void)run_samples(20);
    TEST_ASSERT_EQUAL_UINT32(20, app.counters.cycles);
    TEST_ASSERT_EQUAL_UINT32(0, app.counters.overruns);
    ASSERT_NO_VIOLATION();
}

/* From its n-th conversion on the ADC never ends one, for every n (1 is the self-test's). */
void test_an_adc_that_hangs_for_good_is_counted_and_the_output_stays(void)
{
    uint32_t n;
    const uint32_t samples = 12;
    for (n = 2; n <= samples + 1u; n++) {
        setUp();
        fake.faults.adc_stuck_from = n;
        TEST_ASSERT_EQUAL_INT(0, run_samples(samples));
        TEST_ASSERT_EQUAL_UINT32(samples - (n - 2u), app.counters.adc_faults);
        TEST_ASSERT_EQUAL_UINT32(samples, app.counters.cycles);
        TEST_ASSERT_EQUAL_UINT32(0, app.counters.overruns);
        expect_words_of_the_chain(n - 2u);
        TEST_ASSERT_EQUAL_UINT16(0, fake.pin);
        ASSERT_NO_VIOLATION();
    }
}

void test_an_adc_that_hangs_once_loses_one_sample(void)
{
    uint32_t n;
    const uint32_t samples = 12;
    for (n = 2; n <= samples + 1u; n++) {
        setUp();
        fake.faults.adc_stuck_only = n;
        TEST_ASSERT_EQUAL_INT(0, run_samples(samples));
        TEST_ASSERT_EQUAL_UINT32(1, app.counters.adc_faults);
        TEST_ASSERT_EQUAL_UINT32(samples, app.counters.cycles);
        TEST_ASSERT_EQUAL_UINT32(samples - 1u, fake.interrupts);
        TEST_ASSERT_EQUAL_UINT32(samples, fake.dac_words); /* with the self-test's */
        ASSERT_NO_VIOLATION();
    }
}

/* From its n-th word on the SPI never sends one, for every n (1 is the self-test's). The n-th
 * word is in the shifter and one more in the buffer before the flag says that it is full. */
void test_a_dac_that_hangs_is_counted_and_the_prediction_goes_on(void)
{
    uint32_t n;
    const uint32_t samples = 12;
    for (n = 2; n <= samples + 1u; n++) {
        uint32_t lost = samples + 1u - n;
        setUp();
        fake.faults.dac_stuck_from = n;
        TEST_ASSERT_EQUAL_INT(0, run_samples(samples));
        TEST_ASSERT_EQUAL_UINT32(lost > 0 ? lost - 1u : 0, app.counters.dac_faults);
        TEST_ASSERT_EQUAL_UINT32(samples, app.counters.cycles);
        TEST_ASSERT_EQUAL_UINT16(zigzag(samples), record.drive_code[samples - 1u]);
        TEST_ASSERT_EQUAL_UINT32(n - 1u, fake.dac_words);
        ASSERT_NO_VIOLATION();
    }
}

/* All registers dead from the n-th access on while samples run, for every n. */
void test_a_chip_that_dies_while_running_never_hangs_the_program(void)
{
    uint32_t first;
    uint32_t last;
    uint32_t n;
    (void)run_samples(0);
    first = fake.accesses_of_set_up;
    setUp();
    (void)run_samples(2);
    last = fake.accesses;
    for (n = first; n <= last; n++) {
        setUp();
        fake.faults.dead_after = n;
        fake.faults.dead_value = n % 2u == 0 ? 0x0000 : 0xFFFF;
        TEST_ASSERT_EQUAL_INT(0, run_samples(2));
        TEST_ASSERT_TRUE(fake.clock < fake.started + 5u * PERIOD);
    }
}

void test_an_unexpected_interrupt_stops_the_trigger_and_lowers_the_pin(void)
{
    uint32_t triggers;
    (void)run_samples(3);
    triggers = fake.triggers;
    mdl_pin_up();
    fake.run_clocks += 10u * PERIOD;
    f28335_on_unexpected();
    TEST_ASSERT_EQUAL_UINT16(0, fake.pin);
    TEST_ASSERT_EQUAL_UINT32(triggers, fake.triggers);
}
