/* The set-up of the F28335 on the fake register file: what is written, in which order, under which
 * rules, and what happens when a part of the chip does not answer. */
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

#include "mdl_adc.h"
#include "mdl_board.h"
#include "mdl_clock.h"
#include "mdl_dac.h"

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

typedef struct {
    const char *name;
    uint32_t value;
} step;

void setUp(void)
{
    fake_reset();
}

void tearDown(void)
{
}

/* The events up to the start of the trigger that are not reads of status; runs of the interrupt
 * table's arrays as one step. */
static uint32_t written(step *steps, uint32_t capacity)
{
    uint32_t i;
    uint32_t n = 0;
    for (i = 0; i < fake.logged && n < capacity; i++) {
        const fake_event *e = &fake.log[i];
        if (e->kind == FAKE_READ) {
            continue;
        }
        if (n >= 1 && strncmp(e->name, "PIE", 3) == 0 && strcmp(e->name, steps[n - 1].name) == 0) {
            continue;
        }
        if (n >= 2 && strncmp(e->name, "PIEI", 4) == 0 && strcmp(e->name, steps[n - 2].name) == 0) {
            continue;
        }
        steps[n].name = e->name;
        steps[n].value = e->value;
        n++;
        if (strcmp(e->name, "PCLKCR0") == 0 && (e->value & 4u) != 0) {
            break;
        }
    }
    return n;
}

/* The values are those of TI's examples or of the manual, as literals: not made by the macros that
 * the firmware uses. */
static const step expected[] = {
    {"interrupts off", 0},
    {"EALLOW", 1},
    {"WDCR", 0x0068},
    {"EDIS", 0},
    {"copy", 0},
    {"EALLOW", 1},
    {"FOPT", 0x0001},
    {"FBANKWAIT", 0x0505},
    {"FOTPWAIT", 0x0008},
    {"FSTDBYWAIT", 0x01FF},
    {"FACTIVEWAIT", 0x01FF},
    {"EDIS", 0},
    {"wait", 1},
    {"EALLOW", 1},
    {"PLLSTS", 0x0040},
    {"PLLCR", 0x000A},
    {"EDIS", 0},
    {"EALLOW", 1},
    {"PLLSTS", 0x0000},
    {"PLLSTS", 0x0100},
    {"EDIS", 0},
    {"EALLOW", 1},
    {"HISPCP", 0x0003},
    {"LOSPCP", 0x0002},
    {"PCLKCR0", 0x0108},
    {"PCLKCR1", 0x0001},
    {"PCLKCR3", 0x2000},
    {"EDIS", 0},
    {"PIECTRL", 0x0000},
    {"IER", 0x0000},
    {"IFR", 0x0000},
    {"PIEIER", 0x0000},
    {"PIEIFR", 0x0000},
    {"EALLOW", 1},
    {"PIEVECT", 0},
    {"EDIS", 0},
    {"PIECTRL", 0x0001},
    {"GPBCLEAR", 0x00000001},
    {"EALLOW", 1},
    {"GPBMUX1", 0x00000000},
    {"GPBDIR", 0x00000001},
    {"EDIS", 0},
    {"SPICCR", 0x000F},
    {"SPICTL", 0x000E},
    {"SPIBRR", 0x0003},
    {"SPIFFTX", 0xA000},
    {"SPIPRI", 0x0010},
    {"SPICCR", 0x008F},
    {"EALLOW", 1},
    {"GPAMUX2", 0x00000051},
    {"EDIS", 0},
    {"SPITXBUF", 0x3000},
    {"EALLOW", 1},
    {"ADC_cal", 0},
    {"EDIS", 0},
    {"ADCTRL3", 0x00E0},
    {"wait", 750000},
    {"ADCTRL1", 0x0300},
    {"ADCMAXCONV", 0x0001},
    {"ADCCHSELSEQ1", 0x0010},
    {"ADCTRL2", 0x4000},
    {"ADCST", 0x0010},
    {"ADCTRL2", 0x2000},
    {"ADCTRL2", 0x4000},
    {"ADCST", 0x0010},
    {"TBCTL", 0x0000},
    {"TBPRD", 14999},
    {"TBCTR", 0},
    {"ETSEL", 0x0A00},
    {"ETPS", 0x0100},
    {"ETCLR", 0x0004},
    {"ADCTRL2", 0x0900},
    {"PIEIER", 0x0020},
    {"PIEACK", 0x0001},
    {"IER", 0x0001},
    {"interrupts on", 1},
    {"EALLOW", 1},
    {"PCLKCR0", 0x010C},
};

void test_the_set_up_writes_exactly_this_and_starts_the_trigger_last(void)
{
    static step steps[200];
    const uint32_t n = sizeof expected / sizeof expected[0];
    uint32_t got;
    uint32_t i;
    TEST_ASSERT_EQUAL_INT(0, run_samples(0));
    got = written(steps, 200);
    for (i = 0; i < n && i < got; i++) {
        TEST_ASSERT_EQUAL_STRING(expected[i].name, steps[i].name);
        TEST_ASSERT_EQUAL_HEX32(expected[i].value, steps[i].value);
    }
    TEST_ASSERT_EQUAL_UINT32(n, got);
    ASSERT_NO_VIOLATION();
}

void test_every_vector_is_filled_and_only_the_adc_interrupt_is_enabled(void)
{
    uint32_t i;
    uint32_t vectors = 0;
    uint32_t adc = 0;
    (void)run_samples(0);
    for (i = 0; i < fake.logged; i++) {
        if (strcmp(fake.log[i].name, "PIEVECT") == 0) {
            vectors++;
            adc += fake.log[i].address == 0x0D4A;
        }
    }
    TEST_ASSERT_EQUAL_UINT32(129, vectors);
    TEST_ASSERT_EQUAL_UINT32(2, adc); /* the default first, then ours */
    for (i = 0; i < 12; i++) {
        TEST_ASSERT_EQUAL_HEX32(i == 0 ? 0x20 : 0, fake_peek(0x0CE2 + 2 * i, 16));
    }
}

void test_the_output_is_zero_before_the_first_sample(void)
{
    (void)run_samples(0);
    TEST_ASSERT_EQUAL_UINT32(1, fake.dac_words);
    TEST_ASSERT_EQUAL_HEX16(0x3000, fake.dac_word[0]);
    TEST_ASSERT_EQUAL_UINT16(0, fake.pin);
}

static void expect_refusal(mdl_hal_status expected_status, mdl_hal_status status)
{
    TEST_ASSERT_EQUAL_INT(expected_status, status);
    fake_reset();
}

void test_a_part_that_does_not_answer_ends_the_set_up_with_an_error(void)
{
    fake.faults.pll_never_locks = 1;
    expect_refusal(MDL_HAL_ERR_TIMEOUT, mdl_board_init());
    fake.faults.crystal_missing = 1;
    expect_refusal(MDL_HAL_ERR_SELF_TEST, mdl_board_init());
    fake.faults.adc_stuck_from = 1;
    TEST_ASSERT_EQUAL_INT(MDL_HAL_OK, mdl_board_init());
    expect_refusal(MDL_HAL_ERR_SELF_TEST, mdl_adc_init());
    fake.faults.dac_stuck_from = 1;
    TEST_ASSERT_EQUAL_INT(MDL_HAL_OK, mdl_board_init());
    expect_refusal(MDL_HAL_ERR_SELF_TEST, mdl_dac_init());
}

void test_after_an_error_the_trigger_never_starts(void)
{
    uint16_t i;
    for (i = 0; i < 4; i++) {
        fake_reset();
        fake.faults.pll_never_locks = i == 0;
        fake.faults.crystal_missing = i == 1;
        fake.faults.adc_stuck_from = i == 2;
        fake.faults.dac_stuck_from = i == 3;
        TEST_ASSERT_EQUAL_INT(1, run_samples(3));
        TEST_ASSERT_EQUAL_UINT32(0, fake.triggers);
        TEST_ASSERT_EQUAL_UINT32(0, fake_peek(0x701C, 16) & 4u);
        ASSERT_NO_VIOLATION();
    }
}

/* A chip that dies after its n-th access, for every n of the set-up, reading all zeros or all ones
 * from then on: the program ends in bounded time and the trigger does not run. */
void test_a_chip_that_dies_at_any_access_never_hangs_the_set_up(void)
{
    uint32_t accesses;
    uint32_t n;
    (void)run_samples(0);
    accesses = fake.accesses_of_set_up;
    for (n = 1; n < accesses; n++) {
        fake_reset();
        fake.faults.dead_after = n;
        fake.faults.dead_value = n % 2u == 0 ? 0x0000 : 0xFFFF;
        (void)run_samples(0);
        TEST_ASSERT_EQUAL_UINT32(0, fake.triggers);
        TEST_ASSERT_TRUE(fake.clock < 10000000u);
    }
}

void test_the_timer_gives_each_rate_to_the_nearest_count(void)
{
    const uint32_t rates[] = {18,   20,   50,    100,   1000,   2288,
                              2289, 9999, 10000, 44100, 100000, 200000};
    uint16_t i;
    TEST_ASSERT_EQUAL_INT(MDL_HAL_OK, mdl_board_init());
    for (i = 0; i < sizeof rates / sizeof rates[0]; i++) {
        double counts;
        double scale;
        TEST_ASSERT_EQUAL_INT(MDL_HAL_OK, mdl_clock_init(rates[i]));
        scale = (double)(1u << ((fake_peek(0x6800, 16) >> 10) & 7u));
        counts = fake_peek(0x6805, 16) + 1.0;
        TEST_ASSERT_DOUBLE_WITHIN(0.5, 150e6 / (rates[i] * scale), counts);
        TEST_ASSERT_TRUE(scale == 1.0 || 150e6 / (rates[i] * scale / 2.0) > 65536.0);
    }
    ASSERT_NO_VIOLATION();
}

void test_a_rate_that_the_timer_cannot_give_is_refused_and_writes_nothing(void)
{
    uint32_t before;
    TEST_ASSERT_EQUAL_INT(MDL_HAL_OK, mdl_board_init());
    before = fake.accesses;
    TEST_ASSERT_EQUAL_INT(MDL_HAL_ERR_PARAMETER, mdl_clock_init(0));
    TEST_ASSERT_EQUAL_INT(MDL_HAL_ERR_PARAMETER, mdl_clock_init(17));
    TEST_ASSERT_EQUAL_INT(MDL_HAL_ERR_PARAMETER, mdl_clock_init(200001));
    TEST_ASSERT_EQUAL_UINT32(before, fake.accesses);
}
