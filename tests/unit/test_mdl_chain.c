/*
 * The signal path. Blocks are tested on f0 = 1 + x um, [0, 8] volts from u_min = -2: a straight
 * line has no hysteresis, so that what a block does is seen alone. The chain as a whole is tested
 * on f0 = x^2.
 */
#include "unity.h"

#include "mdl_test.h"

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
#include "mdl_pi.h"
#include "mdl_plays.h"
#include "mdl_power.h"
#include "mdl_rate.h"
#include "mdl_shape.h"
#include "mdl_traj.h"
#include "mdl_yang.h"

#include <string.h>

static mdl_tp_side left, right;
static mdl_chain_params params;
static mdl_chain chain;

static void use(const mdl_real *c, uint16_t degree, uint16_t blocks)
{
    memset(&params, 0, sizeof params);
    params.u_min_volts = MDL_C(-2.0);
    params.margin_volts = MDL_C(4.0);
    params.blocks = blocks;
    ASSERT_STATUS(MDL_OK, mdl_major_init_polynomial(&params.major, MDL_C(8.0), c, degree));
}

static void use_line(uint16_t blocks)
{
    const mdl_real c[] = {MDL_C(1.0), MDL_C(1.0)};
    use(c, 1, blocks);
}

/* Every block, with numbers that leave their traces for some samples. */
static void use_everything(void)
{
    const mdl_real c[] = {MDL_C(0.0), MDL_C(0.0), MDL_C(1.0)};
    const mdl_lag_params slow = {MDL_C(0.125), MDL_C(0.75)};
    const mdl_mode_params mode = {{{MDL_C(-0.5), MDL_C(0.5)}, {MDL_C(-0.5), MDL_C(-0.75)}},
                                  {MDL_C(-0.5), MDL_C(0.25)},
                                  MDL_C(1.0)};
    uint16_t i;
    use(c, 2, 0x1FFu | MDL_BLOCK_BOUC | MDL_BLOCK_ENVELOPE | MDL_BLOCK_BEHIND);
    params.substeps = 3;
    params.smooth = MDL_C(0.75);
    params.rest_free = 1;
    params.saturation.low_volts = MDL_C(-2.0);
    params.saturation.high_volts = MDL_C(5.0);
    params.saturation.knee_volts = MDL_C(0.25);
    params.slew.rise_volts = MDL_C(0.75);
    params.slew.fall_volts = MDL_C(0.5);
    params.lag = slow;
    params.load_lean = MDL_C(0.5);
    params.load_slope.decay = MDL_C(0.0625);
    params.load_slope.ramp = MDL_C(-0.125);
    params.load_bend.decay = MDL_C(-0.03125);
    params.load_bend.ramp = MDL_C(0.0625);
    params.behind = slow;
    params.rate.filter = slow;
    params.rate.v_scale = MDL_C(-1.0);
    params.rate.power = MDL_C(0.5);
    params.rate.v_knee = MDL_C(4.0);
    params.rate.at_knee = MDL_C(2.0);
    params.rate.damping_um = MDL_C(0.125);
    params.rate.widening = MDL_C(0.5);
    params.rate.threshold_volts = MDL_C(0.25);
    params.rate.swelling = MDL_C(0.125);
    params.rate.lean = MDL_C(0.25);
    params.rate.of_speed = 1;
    params.envelope.per_volt = MDL_C(0.125);
    params.envelope.rise_volts = MDL_C(0.5);
    params.envelope.rise_skew = MDL_C(0.25);
    params.envelope.fall_volts = MDL_C(0.25);
    params.envelope.fall_skew = MDL_C(-0.5);
    params.envelope.follow = MDL_C(0.5);
    params.bouc.size_um = MDL_C(-0.5);
    params.bouc.per_volt = MDL_C(0.25);
    params.bouc.power = MDL_C(1.0);
    params.creep_count = 2;
    params.mode_count = 2;
    for (i = 0; i < 2u; i++) {
        params.creep[i].lag = slow;
        params.creep[i].gain = MDL_C(0.03125);
        params.mode[i] = mode;
    }
    params.dead_band_um = MDL_C(0.25);
    params.spread = MDL_C(0.5);
    params.spring_share = MDL_C(0.25);
    params.delay.whole = 2;
    params.delay.weight[0] = MDL_C(0.75);
    params.delay.weight[1] = MDL_C(0.25);
    params.gain = MDL_C(1.5);
    params.offset_um = MDL_C(0.5);
}

/* Viscous operators in the place of the widening. */
static void use_everything_viscous(mdl_real decay, mdl_real pull)
{
    use_everything();
    params.rate.widening = MDL_C(0.0);
    params.rate.of_speed = 0;
    params.rate.relax.decay = decay;
    params.rate.relax.early = pull > MDL_C(0.0) ? MDL_C(0.0) : MDL_C(0.4375);
    params.rate.relax.pull = pull;
}

static void start(void)
{
    ASSERT_STATUS(MDL_OK, mdl_chain_init(&chain, &params, &left, &right));
}

/* Steps to u and expects y and the status. */
#define STEP(u, y, status)                                                                         \
    do {                                                                                           \
        mdl_real got;                                                                              \
        ASSERT_STATUS(status, mdl_chain_step(&chain, (mdl_real)(u), &got));                        \
        ASSERT_REAL(y, got);                                                                       \
    } while (0)

void setUp(void)
{
    use_line(0);
    start();
}

void tearDown(void)
{
}

void test_the_baseline_is_the_trajectory_over_u_minus_u_min(void)
{
    const mdl_real c[] = {MDL_C(0.0), MDL_C(0.0), MDL_C(1.0)};
    use(c, 2, 0);
    start();
    STEP(2.0, 16.0, MDL_OK);
    STEP(-1.0, 7.0, MDL_OK); /* 16 - 3^2 */
    STEP(7.0, 81.0, MDL_EXTRAPOLATED);
    STEP(mdl_test_not_finite(0), 81.0, MDL_ERR_NOT_FINITE);
    mdl_chain_reset(&chain);
    STEP(-1.0, 1.0, MDL_OK);
}

void test_init_refuses_parameters_that_are_not_finite(void)
{
    static mdl_chain_params bad;
    mdl_chain before = chain;
    int i;
    for (i = 0; i < 3; i++) {
        bad = params;
        bad.u_min_volts = mdl_test_not_finite(i);
        ASSERT_STATUS(MDL_ERR_NOT_FINITE, mdl_chain_init(&chain, &bad, &left, &right));
        bad = params;
        bad.margin_volts = mdl_test_not_finite(i);
        ASSERT_STATUS(MDL_ERR_NOT_FINITE, mdl_chain_init(&chain, &bad, &left, &right));
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &chain, sizeof chain);
}

void test_init_refuses_parameters_out_of_range(void)
{
    static mdl_chain_params bad;
    mdl_chain before = chain;
    bad = params;
    bad.substeps = 65;
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &bad, &left, &right));
    bad = params;
    bad.margin_volts = MDL_C(-1.0);
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &bad, &left, &right));
    bad = params;
    bad.creep_count = MDL_CREEP_MODES_MAX + 1;
    ASSERT_STATUS(MDL_ERR_CAPACITY, mdl_chain_init(&chain, &bad, &left, &right));
    bad = params;
    bad.mode_count = MDL_MODES_MAX + 1;
    ASSERT_STATUS(MDL_ERR_CAPACITY, mdl_chain_init(&chain, &bad, &left, &right));
    bad = params;
    bad.delay.whole = MDL_DELAY_MAX - 3;
    ASSERT_STATUS(MDL_ERR_CAPACITY, mdl_chain_init(&chain, &bad, &left, &right));
    TEST_ASSERT_EQUAL_MEMORY(&before, &chain, sizeof chain);
}

/* Of every block: what is not finite, and what is out of range; switched off, nothing is asked. */
void test_init_refuses_what_no_block_can_run_with(void)
{
    static mdl_chain_params good;
    mdl_chain before;
    mdl_real *reals[] = {&params.saturation.low_volts,
                         &params.saturation.high_volts,
                         &params.saturation.knee_volts,
                         &params.saturation.knee_power,
                         &params.slew.rise_volts,
                         &params.slew.fall_volts,
                         &params.slew.knee_volts,
                         &params.slew.decay,
                         &params.slew.early,
                         &params.lag.decay,
                         &params.lag.ramp,
                         &params.load_lean,
                         &params.load_slope.decay,
                         &params.load_slope.ramp,
                         &params.load_bend.decay,
                         &params.load_bend.ramp,
                         &params.behind.decay,
                         &params.behind.ramp,
                         &params.rate.filter.decay,
                         &params.rate.v_scale,
                         &params.rate.power,
                         &params.rate.v_knee,
                         &params.rate.at_knee,
                         &params.rate.damping_um,
                         &params.rate.widening,
                         &params.rate.threshold_volts,
                         &params.rate.swelling,
                         &params.rate.lean,
                         &params.rate.relax.decay,
                         &params.rate.relax.early,
                         &params.rate.relax.pull,
                         &params.envelope.per_volt,
                         &params.envelope.rise_volts,
                         &params.envelope.rise_skew,
                         &params.envelope.fall_volts,
                         &params.envelope.fall_skew,
                         &params.envelope.follow,
                         &params.bouc.size_um,
                         &params.bouc.per_volt,
                         &params.bouc.power,
                         &params.bouc.gamma,
                         &params.creep[1].lag.ramp,
                         &params.creep[1].gain,
                         &params.mode[1].phi[1][0],
                         &params.mode[0].gamma[1],
                         &params.mode[1].share,
                         &params.dead_band_um,
                         &params.spread,
                         &params.spring_share,
                         &params.delay.weight[3],
                         &params.gain,
                         &params.offset_um};
    const struct {
        mdl_real *real;
        mdl_real value;
    } bad[] = {{&params.saturation.low_volts, MDL_C(5.0)},
               {&params.saturation.knee_volts, MDL_C(-0.5)},
               {&params.saturation.knee_power, MDL_C(-1.0)},
               {&params.saturation.knee_power, MDL_C(0.5)},
               {&params.saturation.knee_power, MDL_C(32.5)},
               {&params.envelope.per_volt, MDL_C(0.0)},
               {&params.envelope.per_volt, MDL_C(-0.125)},
               {&params.envelope.rise_volts, MDL_C(-0.5)},
               {&params.envelope.rise_skew, MDL_C(-1.5)},
               {&params.envelope.rise_skew, MDL_C(1.5)},
               {&params.envelope.fall_volts, MDL_C(-0.5)},
               {&params.envelope.fall_skew, MDL_C(-1.5)},
               {&params.envelope.fall_skew, MDL_C(1.5)},
               {&params.envelope.follow, MDL_C(-0.5)},
               {&params.envelope.follow, MDL_C(1.5)},
               {&params.bouc.per_volt, MDL_C(-0.5)},
               {&params.bouc.power, MDL_C(0.5)},
               {&params.bouc.power, MDL_C(4.5)},
               {&params.bouc.gamma, MDL_C(-1.0)},
               {&params.bouc.gamma, MDL_C(1.5)},
               {&params.slew.rise_volts, MDL_C(0.0)},
               {&params.slew.fall_volts, MDL_C(0.0)},
               {&params.slew.fall_volts, MDL_C(-0.5)},
               {&params.slew.knee_volts, MDL_C(-0.5)},
               {&params.slew.decay, MDL_C(-0.5)},
               {&params.slew.decay, MDL_C(1.5)},
               {&params.slew.early, MDL_C(-0.5)},
               {&params.slew.early, MDL_C(1.5)},
               {&params.lag.decay, MDL_C(-0.5)},
               {&params.lag.decay, MDL_C(1.5)},
               {&params.lag.ramp, MDL_C(-0.5)},
               {&params.lag.ramp, MDL_C(1.5)},
               {&params.load_lean, MDL_C(-1.0)},
               {&params.load_lean, MDL_C(1.0)},
               {&params.load_slope.decay, MDL_C(-4.5)},
               {&params.load_slope.ramp, MDL_C(4.5)},
               {&params.load_bend.decay, MDL_C(4.5)},
               {&params.load_bend.ramp, MDL_C(-4.5)},
               {&params.behind.decay, MDL_C(1.5)},
               {&params.behind.ramp, MDL_C(-0.5)},
               {&params.rate.filter.ramp, MDL_C(1.5)},
               {&params.rate.power, MDL_C(0.0)},
               {&params.rate.power, MDL_C(4.5)},
               {&params.rate.v_knee, MDL_C(-0.5)},
               {&params.rate.widening, MDL_C(-0.5)},
               {&params.rate.threshold_volts, MDL_C(-0.5)},
               {&params.rate.swelling, MDL_C(-0.5)},
               {&params.creep[0].lag.decay, MDL_C(2.0)},
               {&params.dead_band_um, MDL_C(-0.5)},
               {&params.spread, MDL_C(-0.5)},
               {&params.spread, MDL_C(1.5)},
               {&params.spring_share, MDL_C(-0.5)},
               {&params.spring_share, MDL_C(1.5)}};
    uint16_t k;
    int i;
    use_everything();
    start();
    good = params;
    before = chain;
    for (k = 0; k < sizeof reals / sizeof reals[0]; k++) {
        for (i = 0; i < 3; i++) {
            *reals[k] = mdl_test_not_finite(i);
            ASSERT_STATUS(MDL_ERR_NOT_FINITE, mdl_chain_init(&chain, &params, &left, &right));
            params = good;
        }
    }
    for (k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        *bad[k].real = bad[k].value;
        ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &params, &left, &right));
        TEST_ASSERT_EQUAL_MEMORY(&before, &chain, sizeof chain);
        params.blocks = 0;
        ASSERT_STATUS(MDL_OK, mdl_chain_init(&chain, &params, &left, &right));
        params = good;
        start();
    }
}

void test_a_huge_command_is_limited_before_the_blocks(void)
{
    const mdl_real huge = MDL_TEST_EPSILON < 1e-12 ? (mdl_real)1e308 : MDL_C(3e38);
    uint16_t i;
    use_line(MDL_BLOCK_LAG | MDL_BLOCK_CREEP);
    params.substeps = 2;
    params.lag.decay = MDL_C(0.5);
    params.lag.ramp = MDL_C(0.5);
    start();
    STEP(6.0, 9.0, MDL_OK);
    for (i = 0; i < 4u; i++) {
        mdl_real y;
        TEST_ASSERT_TRUE(mdl_chain_step(&chain, i % 2u ? -huge : huge, &y) & MDL_CLAMPED);
        TEST_ASSERT_TRUE(y >= MDL_C(-3.0) && y <= MDL_C(13.0)); /* f0 within the margin, 4 volts */
    }
}

void test_a_rounded_knee_has_a_width_and_ends_before_the_middle(void)
{
    use_line(MDL_BLOCK_SATURATION);
    params.saturation.low_volts = MDL_C(-2.0);
    params.saturation.high_volts = MDL_C(4.0);
    params.saturation.knee_power = MDL_C(2.0);
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &params, &left, &right));
    params.saturation.knee_volts = MDL_C(3.125);
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &params, &left, &right));
    params.saturation.knee_volts = MDL_C(3.0);
    start();
    params.saturation.knee_volts = MDL_C(3.125);
    params.saturation.knee_power = MDL_C(0.0);
    start();
}

void test_a_parabolic_knee_ends_before_the_middle_and_has_no_power(void)
{
    use_line(MDL_BLOCK_SATURATION);
    params.saturation.low_volts = MDL_C(-2.0);
    params.saturation.high_volts = MDL_C(4.0);
    params.saturation.parabolic = 1u;
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &params, &left, &right));
    params.saturation.knee_volts = MDL_C(3.125);
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &params, &left, &right));
    params.saturation.knee_volts = MDL_C(3.0);
    start();
    params.saturation.knee_power = MDL_C(2.0);
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &params, &left, &right));
    params.saturation.knee_power = MDL_C(0.0);
    params.saturation.parabolic = 2u;
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &params, &left, &right));
}

void test_viscous_operators_follow_one_law_and_do_not_grow(void)
{
    const struct {
        mdl_relax_params relax;
        mdl_real widening;
        mdl_status status;
    } cases[] = {{{MDL_C(0.5), MDL_C(0.25), MDL_C(0.0)}, MDL_C(0.0), MDL_OK},
                 {{MDL_C(0.5), MDL_C(0.5), MDL_C(0.0)}, MDL_C(0.0), MDL_OK},
                 {{MDL_C(1.0), MDL_C(0.0), MDL_C(8.0)}, MDL_C(0.0), MDL_OK},
                 {{MDL_C(0.0), MDL_C(0.0), MDL_C(0.0)}, MDL_C(0.25), MDL_OK},
                 {{MDL_C(-0.5), MDL_C(0.25), MDL_C(0.0)}, MDL_C(0.0), MDL_ERR_PARAMETER},
                 {{MDL_C(1.5), MDL_C(0.25), MDL_C(0.0)}, MDL_C(0.0), MDL_ERR_PARAMETER},
                 {{MDL_C(0.5), MDL_C(-0.25), MDL_C(0.0)}, MDL_C(0.0), MDL_ERR_PARAMETER},
                 {{MDL_C(0.5), MDL_C(0.75), MDL_C(0.0)}, MDL_C(0.0), MDL_ERR_PARAMETER},
                 {{MDL_C(0.5), MDL_C(0.25), MDL_C(-0.5)}, MDL_C(0.0), MDL_ERR_PARAMETER},
                 {{MDL_C(0.5), MDL_C(0.25), MDL_C(0.5)}, MDL_C(0.0), MDL_ERR_PARAMETER},
                 {{MDL_C(0.0), MDL_C(0.0), MDL_C(0.5)}, MDL_C(0.0), MDL_ERR_PARAMETER},
                 {{MDL_C(1.0), MDL_C(0.0), MDL_C(0.0)}, MDL_C(0.0), MDL_ERR_PARAMETER},
                 {{MDL_C(1.0), MDL_C(0.0), MDL_C(-8.0)}, MDL_C(0.0), MDL_ERR_PARAMETER},
                 {{MDL_C(0.5), MDL_C(0.25), MDL_C(0.0)}, MDL_C(0.25), MDL_ERR_PARAMETER},
                 {{MDL_C(1.0), MDL_C(0.0), MDL_C(8.0)}, MDL_C(0.25), MDL_ERR_PARAMETER}};
    uint16_t k;
    use_line(MDL_BLOCK_RATE);
    params.rate.power = MDL_C(1.0);
    for (k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        params.rate.relax = cases[k].relax;
        params.rate.widening = cases[k].widening;
        ASSERT_STATUS(cases[k].status, mdl_chain_init(&chain, &params, &left, &right));
    }
}

void test_parameters_of_a_block_that_is_off_are_not_used(void)
{
    use_everything();
    params.blocks = MDL_BLOCK_GAIN;
    params.saturation.low_volts = mdl_test_not_finite(0);
    params.slew.fall_volts = mdl_test_not_finite(0);
    params.rate.at_knee = mdl_test_not_finite(0);
    params.rate.widening = mdl_test_not_finite(0);
    params.envelope.rise_volts = mdl_test_not_finite(0);
    params.spring_share = mdl_test_not_finite(0);
    start();
    STEP(2.0, 1.5 * 16.0 + 0.5, MDL_OK);
    STEP(3.0, 1.5 * 25.0 + 0.5, MDL_OK);
}

void test_init_takes_parameters_at_their_limits(void)
{
    params.substeps = 64;
    params.creep_count = MDL_CREEP_MODES_MAX;
    params.mode_count = MDL_MODES_MAX;
    params.delay.whole = MDL_DELAY_MAX - 4;
    start();
}

void test_saturation(void)
{
    use_line(MDL_BLOCK_SATURATION);
    params.saturation.low_volts = MDL_C(-1.0);
    params.saturation.high_volts = MDL_C(3.0);
    start();
    STEP(5.0, 6.0, MDL_OK); /* 1 + (3 + 2) */
    STEP(-2.0, 2.0, MDL_OK);
    STEP(0.5, 3.5, MDL_OK);
}

void test_saturation_with_a_rounded_knee(void)
{
    use_line(MDL_BLOCK_SATURATION);
    params.saturation.low_volts = MDL_C(-2.0);
    params.saturation.high_volts = MDL_C(4.0);
    params.saturation.knee_volts = MDL_C(2.0);
    params.saturation.knee_power = MDL_C(1.0);
    start();
    STEP(1.0, 4.0, MDL_OK);
    STEP(4.0, 6.0, MDL_OK);  /* 1 + (3 + 2) */
    STEP(-2.0, 2.0, MDL_OK); /* 1 + (-1 + 2) */
}

static const mdl_real square[] = {MDL_C(0.0), MDL_C(0.0), MDL_C(1.0)};

/* On f0 = x^2, with a drive of x = 1 to 5. */
static void use_clipped_square(void)
{
    use(square, 2, MDL_BLOCK_SATURATION);
    params.saturation.low_volts = MDL_C(-1.0);
    params.saturation.high_volts = MDL_C(3.0);
}

void test_behind_a_saturation_the_hysteresis_rests_where_it_has_been_led(void)
{
    /* At x = 1, on the curve that came down from x = 5: 25 - 4^2. */
    use_clipped_square();
    start();
    STEP(-2.0, 9.0, MDL_OK);
    STEP(0.0, 10.0, MDL_OK); /* x = 2, one volt above */
    STEP(6.0, 25.0, MDL_OK); /* x = 5: the loop is closed, on the curve from 25 downwards again */
    STEP(1.0, 21.0, MDL_OK);
    STEP(-2.0, 9.0, MDL_OK);
    mdl_chain_reset(&chain);
    STEP(1.0, 13.0, MDL_OK); /* x = 3, 2 above where it rests */
}

void test_between_samples_a_smooth_command_bends_on(void)
{
    /* A slew limit of one volt a substep lags behind what the command does between samples. */
    use_line(MDL_BLOCK_SLEW);
    params.substeps = 2;
    params.smooth = MDL_C(1.0);
    params.slew.rise_volts = MDL_C(1.0);
    params.slew.fall_volts = MDL_C(1.0);
    start();
    STEP(-2.0, 1.0, MDL_OK);
    STEP(-1.75, 1.25, MDL_OK);
    STEP(-1.0, 2.0, MDL_OK);   /* rises by 1/4, 3/4, 2: bends by 1/2, 5/4 */
    STEP(1.0, 3.9375, MDL_OK); /* at -1 + 1 - 1/16, then a volt on */
    params.smooth = MDL_C(0.0);
    start();
    STEP(-2.0, 1.0, MDL_OK);
    STEP(-1.75, 1.25, MDL_OK);
    STEP(-1.0, 2.0, MDL_OK);
    STEP(1.0, 4.0, MDL_OK); /* linear: just within the limit */
}

void test_a_smooth_command_turns_between_samples_but_not_beyond_the_range(void)
{
    const double u[] = {-2.0, 1.0, 3.0, 4.0, 4.0, 3.0, 1.0, -2.0}; /* bends by 1 in every sample */
    mdl_real y = MDL_C(0.0);
    uint16_t i;
    use_line(MDL_BLOCK_BACKLASH); /* which keeps the highest that it has seen */
    params.dead_band_um = MDL_C(20.0);
    params.substeps = 2;
    params.smooth = MDL_C(1.0);
    start();
    for (i = 0; i < 8; i++) {
        TEST_ASSERT_EQUAL(MDL_OK, mdl_chain_step(&chain, (mdl_real)u[i], &y));
    }
    ASSERT_REAL(-2.875, y); /* 10 below what it was at 4 + 1/8, between both samples of 4 */
    params.u_min_volts = MDL_C(-4.0); /* the range ends at 4 */
    start();
    for (i = 0; i < 8; i++) {
        TEST_ASSERT_EQUAL(MDL_OK, mdl_chain_step(&chain, (mdl_real)u[i], &y));
    }
    ASSERT_REAL(-1.0, y);
}

void test_a_command_is_smooth_to_a_share(void)
{
    const struct {
        mdl_real smooth;
        mdl_status status;
    } cases[] = {{MDL_C(0.0), MDL_OK},
                 {MDL_C(1.0), MDL_OK},
                 {MDL_C(-0.5), MDL_ERR_PARAMETER},
                 {MDL_C(1.5), MDL_ERR_PARAMETER},
                 {(mdl_real)NAN, MDL_ERR_NOT_FINITE}};
    uint16_t i;
    use_line(MDL_BLOCK_LAG);
    for (i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        params.smooth = cases[i].smooth;
        ASSERT_STATUS(cases[i].status, mdl_chain_init(&chain, &params, &left, &right));
    }
}

void test_what_rests_free_of_a_saturation_has_been_at_u_min(void)
{
    use_clipped_square();
    params.rest_free = 1;
    start();
    STEP(-2.0, 1.0, MDL_OK); /* x = 1, on f0 */
    STEP(0.0, 4.0, MDL_OK);
    STEP(6.0, 25.0, MDL_OK);
    STEP(-2.0, 9.0, MDL_OK); /* from now on as if it had not: 25 - 4^2 */
    STEP(0.0, 10.0, MDL_OK);
    mdl_chain_reset(&chain);
    STEP(1.0, 9.0, MDL_OK); /* x = 3 */
}

void test_a_saturation_beyond_the_range_leaves_the_rest_as_it_is(void)
{
    use(square, 2, MDL_BLOCK_SATURATION);
    params.saturation.low_volts = MDL_C(-3.0);
    params.saturation.high_volts = MDL_C(7.0);
    start();
    STEP(-2.0, 0.0, MDL_OK);
    STEP(1.0, 9.0, MDL_OK);
    STEP(6.0, 64.0, MDL_OK);
}

void test_lead_is_the_history_of_the_hysteresis(void)
{
    use(square, 2, MDL_BLOCK_GAIN);
    params.gain = MDL_C(1.0);
    start();
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(5.0)));
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(-1.0)));
    STEP(1.0, 17.0, MDL_OK); /* 49 - 6^2 at x = 1, 2^2 above it */
    STEP(5.0, 49.0, MDL_OK);
    STEP(4.0, 48.0, MDL_OK);
}

void test_lead_says_what_a_step_says(void)
{
    start();
    ASSERT_STATUS(MDL_EXTRAPOLATED, mdl_chain_lead(&chain, MDL_C(7.0)));
    ASSERT_STATUS(MDL_EXTRAPOLATED | MDL_CLAMPED, mdl_chain_lead(&chain, MDL_C(1e6)));
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(2.0)));
}

void test_the_saturation_acts_on_the_history(void)
{
    use_clipped_square();
    start();
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(6.0)));
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(0.0)));
    STEP(0.0, 16.0, MDL_OK); /* at x = 2, down from 5: 25 - 3^2 */
    STEP(1.0, 17.0, MDL_OK);
}

static void history_leaves_everything_at_rest(void)
{
    mdl_real first, y;
    uint16_t i;
    start();
    (void)mdl_chain_lead(&chain, MDL_C(4.5));
    (void)mdl_chain_lead(&chain, MDL_C(0.5));
    (void)mdl_chain_lead(&chain, MDL_C(3.0));
    ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(1.0), &first));
    for (i = 0; i < 20u; i++) {
        ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(1.0), &y));
        ASSERT_REAL(first, y);
    }
}

void test_history_leaves_every_dynamic_state_at_rest(void)
{
    use_everything();
    history_leaves_everything_at_rest();
    use_everything_viscous(MDL_C(0.5), MDL_C(0.0));
    history_leaves_everything_at_rest();
    use_everything_viscous(MDL_C(1.0), MDL_C(0.5));
    history_leaves_everything_at_rest();
}

void test_lead_refuses_what_is_not_finite_and_changes_nothing(void)
{
    mdl_chain before;
    int i;
    use(square, 2, MDL_BLOCK_RATE);
    params.rate.power = MDL_C(1.0);
    params.rate.widening = MDL_C(0.25);
    start();
    (void)mdl_chain_lead(&chain, MDL_C(3.0));
    before = chain;
    for (i = 0; i < 3; i++) {
        ASSERT_STATUS(MDL_ERR_NOT_FINITE, mdl_chain_lead(&chain, mdl_test_not_finite(i)));
        TEST_ASSERT_EQUAL_MEMORY(&before, &chain, sizeof chain);
    }
}

void test_slew_limit_per_substep(void)
{
    use_line(MDL_BLOCK_SLEW);
    params.slew.rise_volts = MDL_C(1.0);
    params.slew.fall_volts = MDL_C(0.5);
    params.substeps = 2;
    start();
    STEP(0.0, 3.0, MDL_OK); /* the first sample is in equilibrium */
    STEP(5.0, 5.0, MDL_OK); /* two steps of 1 V */
    STEP(5.0, 7.0, MDL_OK);
    STEP(5.0, 8.0, MDL_OK);
    STEP(4.0, 7.0, MDL_OK); /* two of 0.5 V */
    STEP(0.0, 6.0, MDL_OK); /* also here: it falls by less than it rises */
}

void test_amplifier_lag(void)
{
    use_line(MDL_BLOCK_LAG);
    params.lag.decay = MDL_C(0.75);
    params.lag.ramp = MDL_C(0.5);
    start();
    STEP(0.0, 3.0, MDL_OK);
    STEP(4.0, 5.0, MDL_OK);   /* e = -2 */
    STEP(4.0, 6.5, MDL_OK);   /* e = -1/2 */
    STEP(4.0, 6.875, MDL_OK); /* e = -1/8 */
}

/* Where its output meets the falling command, ln 2 / 4 into the step: at x = 3.3069, not at 3. */
void test_a_lag_turns_between_two_samples(void)
{
    const double turn = 4.0 - log(2.0);
    mdl_real y;
    use(square, 2, MDL_BLOCK_LAG);
    params.lag.decay = MDL_C(1.0);
    params.lag.ramp = MDL_C(0.25);
    start();
    STEP(-2.0, 0.0, MDL_OK);
    STEP(2.0, 9.0, MDL_OK);                                         /* e = -1 */
    ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(-2.0), &y)); /* e = 1 */
    TEST_ASSERT_DOUBLE_WITHIN(64.0 * MDL_TEST_EPSILON + 1e-6,
                              turn * turn - (turn - 1.0) * (turn - 1.0), (double)y);
    ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(-2.0), &y)); /* at the command, no turn */
    TEST_ASSERT_DOUBLE_WITHIN(64.0 * MDL_TEST_EPSILON + 1e-6, 0.0, (double)y);
}

/* The same far from the end of the lag: a third of the step is gone when they meet. */
void test_a_slow_lag_turns_between_two_samples(void)
{
    const double a = 0.984375; /* exp(-h / tau) */
    double ramp = (a - 1.0) / log(a);
    double e = -2.0 * ramp;
    double now = a * e + 6.0 * ramp;
    double x = (1.0 - a) * e / (now - e);
    double turn = 6.0 + e * (1.0 + x) * log1p(x) / x; /* above u_min */
    double end = now;
    mdl_real y;
    use(square, 2, MDL_BLOCK_LAG);
    params.lag.decay = MDL_C(0.015625);
    params.lag.ramp = (mdl_real)ramp;
    start();
    STEP(2.0, 16.0, MDL_OK);
    ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(4.0), &y));
    ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(-2.0), &y));
    TEST_ASSERT_DOUBLE_WITHIN(256.0 * MDL_TEST_EPSILON, turn * turn - (turn - end) * (turn - end),
                              (double)y);
    TEST_ASSERT_TRUE(turn > end && turn > 6.0 + e);
}

void test_a_pole_behind_the_hysteresis_does_not_hold_its_turns_back(void)
{
    use(square, 2, MDL_BLOCK_BEHIND);
    params.behind.decay = MDL_C(0.75);
    params.behind.ramp = MDL_C(0.5);
    start();
    STEP(-2.0, 0.0, MDL_OK);
    STEP(0.0, 2.0, MDL_OK);    /* 4; e = -2 */
    STEP(0.0, 3.5, MDL_OK);    /* e = -1/2 */
    STEP(-2.0, 1.875, MDL_OK); /* back at 0 without it: it has turned at 4; e = -1/8 + 2 */
    STEP(-2.0, 0.46875, MDL_OK);
}

void test_the_lag_follows_what_the_slew_limit_lets_through(void)
{
    use_line(MDL_BLOCK_SLEW | MDL_BLOCK_LAG);
    params.slew.rise_volts = MDL_C(2.0);
    params.slew.fall_volts = MDL_C(2.0);
    params.lag.decay = MDL_C(0.75);
    params.lag.ramp = MDL_C(0.5);
    start();
    STEP(0.0, 3.0, MDL_OK);
    STEP(4.0, 4.0, MDL_OK);  /* 2 V, e = -1 */
    STEP(4.0, 5.75, MDL_OK); /* 4 V, e = -1/4 - 1 */
}

/* v is the rise of a sample: none is kept of the one before. */
static void use_rise_as_velocity(mdl_real power)
{
    params.rate.filter.decay = MDL_C(1.0);
    params.rate.filter.ramp = MDL_C(1.0);
    params.rate.v_scale = MDL_C(-1.0);
    params.rate.power = power;
}

void test_damping_is_added_behind_the_trajectory(void)
{
    use_line(MDL_BLOCK_RATE);
    use_rise_as_velocity(MDL_C(2.0));
    params.rate.damping_um = MDL_C(0.5);
    start();
    STEP(0.0, 3.0, MDL_OK);
    STEP(2.0, 7.0, MDL_OK); /* 5 + 0.5 * 2^2 */
    STEP(2.0, 5.0, MDL_OK);
    STEP(1.0, 3.5, MDL_OK); /* 4 - 0.5 * 1 */
}

void test_damping_by_a_law_with_a_knee(void)
{
    use_line(MDL_BLOCK_RATE);
    use_rise_as_velocity(MDL_C(0.5));
    params.rate.v_knee = MDL_C(1.0);
    params.rate.at_knee = MDL_C(1.0);
    params.rate.damping_um = MDL_C(0.5);
    start();
    STEP(0.0, 3.0, MDL_OK);
    STEP(3.0, 6.5, MDL_OK); /* 6 + 0.5 * (sqrt(3 + 1) - 1) */
    STEP(3.0, 6.0, MDL_OK);
    STEP(0.0, 2.5, MDL_OK);
}

/* v is half of the rise, and of what is left of it before. */
static void use_half_of_the_velocity(void)
{
    params.rate.filter.decay = MDL_C(0.5);
    params.rate.filter.ramp = MDL_C(0.5);
    params.rate.v_scale = MDL_C(-1.0);
    params.rate.power = MDL_C(1.0);
}

void test_damping_takes_the_signed_velocity(void)
{
    use_line(MDL_BLOCK_RATE);
    use_half_of_the_velocity();
    params.rate.damping_um = MDL_C(0.5);
    start();
    STEP(-2.0, 1.0, MDL_OK);
    STEP(2.0, 6.0, MDL_OK);  /* v = 2 */
    STEP(2.0, 5.5, MDL_OK);  /* v = 1 */
    STEP(0.0, 2.75, MDL_OK); /* v = 1/2 - 1 */
}

static void use_thresholds(uint16_t of_speed)
{
    use(square, 2, MDL_BLOCK_RATE);
    use_half_of_the_velocity();
    params.rate.threshold_volts = MDL_C(0.25);
    params.rate.of_speed = of_speed;
    start();
}

void test_thresholds_can_take_the_speed(void)
{
    use_thresholds(1);
    STEP(-2.0, 0.0, MDL_OK);
    STEP(2.0, 12.25, MDL_OK);   /* a speed of 2: half a volt behind x = 4 */
    STEP(2.0, 14.0625, MDL_OK); /* a speed of 1: a quarter */
    /* A speed of 1/2 + 1/2, where the velocity is 0: a quarter of a volt above x = 3. */
    STEP(1.0, 14.0625 - 0.5 * 0.5, MDL_OK);
}

void test_thresholds_can_take_the_size_of_the_velocity(void)
{
    use_thresholds(0);
    STEP(-2.0, 0.0, MDL_OK);
    STEP(2.0, 12.25, MDL_OK); /* as with the speed until the input turns */
    STEP(2.0, 14.0625, MDL_OK);
    STEP(1.0, 14.0625 - 0.75 * 0.75, MDL_OK);   /* no velocity, at x = 3 */
    STEP(0.0, 14.0625 - 1.625 * 1.625, MDL_OK); /* -1/2: an eighth of a volt above x = 2 */
}

/* What the chain's play operators hold back, on f0 = x^2, of x after a sample with this growth. */
static mdl_plays_params plays_of_f0;
static mdl_plays plays;

static mdl_real held(mdl_real x, mdl_real grow)
{
    return mdl_plays_step(&plays, &plays_of_f0, x, grow);
}

static void use_widening(mdl_real widening)
{
    use(square, 2, MDL_BLOCK_RATE);
    params.rate.widening = widening;
    mdl_plays_make(&plays_of_f0, &params.major);
    mdl_plays_reset(&plays, &plays_of_f0);
}

void test_widening_can_make_the_thresholds_grow_with_the_speed(void)
{
    mdl_real first, turned;
    use_widening(MDL_C(0.25));
    use_half_of_the_velocity();
    params.rate.of_speed = 1;
    start();
    STEP(-1.0, MDL_C(1.0) - held(MDL_C(1.0), MDL_C(0.0)), MDL_OK);
    first = held(MDL_C(5.0), MDL_C(0.5)); /* a speed of 2 */
    TEST_ASSERT_TRUE(first > MDL_C(0.0));
    STEP(3.0, MDL_C(25.0) - first, MDL_OK);
    turned = held(MDL_C(3.0), MDL_C(0.5)); /* of 1 + 1, where the velocity is 0 */
    TEST_ASSERT_TRUE(turned < first);
    STEP(1.0, MDL_C(21.0) - turned, MDL_OK);
}

void test_widening_can_make_the_thresholds_grow_with_the_velocity(void)
{
    use_widening(MDL_C(0.25));
    use_half_of_the_velocity();
    start();
    STEP(-1.0, MDL_C(1.0) - held(MDL_C(1.0), MDL_C(0.0)), MDL_OK);
    STEP(3.0, MDL_C(25.0) - held(MDL_C(5.0), MDL_C(0.5)), MDL_OK);  /* a velocity of 2 */
    STEP(1.0, MDL_C(21.0) - held(MDL_C(3.0), MDL_C(0.0)), MDL_OK);  /* 1 - 1 */
    STEP(-1.0, MDL_C(9.0) - held(MDL_C(1.0), MDL_C(0.25)), MDL_OK); /* -1 */
}

void test_widening_after_a_history(void)
{
    use_widening(MDL_C(0.25));
    use_rise_as_velocity(MDL_C(1.0));
    start();
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(5.0)));
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(0.0)));
    (void)held(MDL_C(7.0), MDL_C(0.0));
    (void)held(MDL_C(2.0), MDL_C(0.0));
    STEP(0.0, MDL_C(24.0) - held(MDL_C(2.0), MDL_C(0.0)), MDL_OK); /* 49 - 5^2 */
    STEP(2.0, MDL_C(28.0) - held(MDL_C(4.0), MDL_C(0.5)), MDL_OK); /* 2^2 above */
    STEP(0.0, MDL_C(24.0) - held(MDL_C(2.0), MDL_C(0.5)), MDL_OK);
}

void test_widening_behind_raised_thresholds(void)
{
    use_widening(MDL_C(0.125));
    use_rise_as_velocity(MDL_C(1.0));
    params.rate.threshold_volts = MDL_C(0.25);
    start();
    STEP(-2.0, -held(MDL_C(0.0), MDL_C(0.0)), MDL_OK);
    STEP(2.0, MDL_C(9.0) - held(MDL_C(3.0), MDL_C(0.5)), MDL_OK); /* a rise of 4: one volt held */
    STEP(2.0, MDL_C(16.0) - held(MDL_C(4.0), MDL_C(0.0)), MDL_OK);
}

void test_a_reset_takes_the_growth_back(void)
{
    use_widening(MDL_C(0.25));
    use_half_of_the_velocity();
    params.rate.of_speed = 1;
    start();
    STEP(-2.0, -held(MDL_C(0.0), MDL_C(0.0)), MDL_OK);
    STEP(2.0, MDL_C(16.0) - held(MDL_C(4.0), MDL_C(0.5)), MDL_OK);
    mdl_chain_reset(&chain);
    mdl_plays_reset(&plays, &plays_of_f0);
    STEP(0.0, MDL_C(4.0) - held(MDL_C(2.0), MDL_C(0.0)), MDL_OK);
    STEP(0.0, MDL_C(4.0) - held(MDL_C(2.0), MDL_C(0.0)), MDL_OK); /* no speed is left */
}

/* The same of viscous operators, for a rise of x to where it is. */
static mdl_real lagged(mdl_real x, mdl_real rise)
{
    return mdl_plays_relax(&plays, &plays_of_f0, x, rise, &params.rate.relax);
}

static void use_relaxing(uint16_t by_square)
{
    use_widening(MDL_C(0.0));
    params.rate.power = MDL_C(1.0);
    params.rate.relax.decay = by_square ? MDL_C(1.0) : MDL_C(0.5);
    params.rate.relax.early = by_square ? MDL_C(0.0) : MDL_C(0.4375);
    params.rate.relax.pull = by_square ? MDL_C(0.25) : MDL_C(0.0);
}

void test_viscous_operators_hold_the_displacement_back(void)
{
    uint16_t by_square, i;
    for (by_square = 0; by_square < 2u; by_square++) {
        mdl_real first, last;
        use_relaxing(by_square);
        start();
        STEP(-1.0, MDL_C(1.0) - held(MDL_C(1.0), MDL_C(0.0)), MDL_OK); /* at rest */
        first = lagged(MDL_C(5.0), MDL_C(4.0));
        TEST_ASSERT_TRUE(first > MDL_C(1.0));
        STEP(3.0, MDL_C(25.0) - first, MDL_OK);
        last = lagged(MDL_C(5.0), MDL_C(0.0));
        TEST_ASSERT_TRUE(last > MDL_C(0.0) && last < first);
        STEP(3.0, MDL_C(25.0) - last, MDL_OK);
        STEP(1.0, MDL_C(21.0) - lagged(MDL_C(3.0), MDL_C(-2.0)), MDL_OK);
        for (i = 0; i < 20u; i++) {
            STEP(-2.0, -lagged(MDL_C(0.0), i == 0 ? MDL_C(-3.0) : MDL_C(0.0)), MDL_OK);
        }
    }
}

void test_viscous_operators_follow_in_substeps(void)
{
    use_relaxing(0);
    params.substeps = 2;
    start();
    STEP(-2.0, 0.0, MDL_OK);
    (void)lagged(MDL_C(2.0), MDL_C(2.0));
    STEP(2.0, MDL_C(16.0) - lagged(MDL_C(4.0), MDL_C(2.0)), MDL_OK);
}

void test_viscous_operators_are_at_rest_behind_a_history(void)
{
    use_relaxing(0);
    start();
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(5.0)));
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(0.0)));
    STEP(0.0, 24.0, MDL_OK); /* 49 - 5^2 */
    (void)held(MDL_C(7.0), MDL_C(0.0));
    (void)held(MDL_C(2.0), MDL_C(0.0));
    STEP(0.0, MDL_C(24.0) - lagged(MDL_C(2.0), MDL_C(0.0)), MDL_OK);
    STEP(2.0, MDL_C(28.0) - lagged(MDL_C(4.0), MDL_C(2.0)), MDL_OK);
}

void test_damping_beside_viscous_operators(void)
{
    use_relaxing(0);
    use_rise_as_velocity(MDL_C(2.0));
    params.rate.damping_um = MDL_C(0.5);
    start();
    STEP(-2.0, 0.0, MDL_OK);
    STEP(2.0, MDL_C(24.0) - lagged(MDL_C(4.0), MDL_C(4.0)), MDL_OK); /* 16 + 0.5 * 4^2 */
    STEP(2.0, MDL_C(16.0) - lagged(MDL_C(4.0), MDL_C(0.0)), MDL_OK);
}

void test_viscous_operators_behind_raised_thresholds(void)
{
    use_relaxing(0);
    use_rise_as_velocity(MDL_C(1.0));
    params.rate.threshold_volts = MDL_C(0.25);
    start();
    STEP(-2.0, 0.0, MDL_OK);
    STEP(2.0, MDL_C(9.0) - lagged(MDL_C(3.0), MDL_C(3.0)), MDL_OK); /* a volt held of a rise of 4 */
    STEP(1.0, MDL_C(9.0) - lagged(MDL_C(3.0), MDL_C(0.0)), MDL_OK); /* x = 3 is in the play */
}

void test_a_reset_takes_back_how_far_viscous_operators_are_behind(void)
{
    use_relaxing(1);
    start();
    STEP(-2.0, 0.0, MDL_OK);
    STEP(2.0, MDL_C(16.0) - lagged(MDL_C(4.0), MDL_C(4.0)), MDL_OK);
    mdl_chain_reset(&chain);
    STEP(0.0, 4.0, MDL_OK);
    STEP(0.0, 4.0, MDL_OK);
}

void test_the_part_by_bouc_and_wen_is_added(void)
{
    /* At rest behind a swing over the whole range, and nothing is added there. */
    mdl_real up, again;
    use_line(MDL_BLOCK_BOUC);
    params.bouc.size_um = MDL_C(-2.0);
    params.bouc.per_volt = MDL_C(1.0);
    params.bouc.power = MDL_C(1.0);
    start();
    STEP(-2.0, 1.0, MDL_OK);
    ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(6.0), &up));
    /* z from -1 to 1, but for e^-8. */
    TEST_ASSERT_DOUBLE_WITHIN(5e-3, 9.0 - 4.0, (double)up);
    (void)mdl_chain_step(&chain, MDL_C(-2.0), &again);
    TEST_ASSERT_DOUBLE_WITHIN(5e-3, 1.0, (double)again);
}

/* On x = 0 to 8: in the middle 1 V behind a rise, half a volt behind a fall. */
static void use_envelopes(const mdl_real *c, uint16_t degree, uint16_t more)
{
    use(c, degree, (uint16_t)(MDL_BLOCK_ENVELOPE | more));
    params.envelope.per_volt = MDL_C(0.125);
    params.envelope.rise_volts = MDL_C(1.0);
    params.envelope.fall_volts = MDL_C(0.5);
}

void test_envelopes_act_in_front_of_the_trajectory(void)
{
    use_envelopes(square, 2, 0);
    start();
    STEP(-2.0, 0.0, MDL_OK);
    STEP(2.0, 9.0, MDL_OK);                  /* 3^2 at x = 4 */
    STEP(6.0, 64.0, MDL_OK);                 /* both end where the range does */
    STEP(2.0, 64.0 - 3.5 * 3.5, MDL_OK);     /* 4.5 at x = 4, down from 8 */
    STEP(2.5, 64.0 - 3.5 * 3.5, MDL_OK);     /* between the envelopes */
    STEP(0.0, 64.0 - 5.625 * 5.625, MDL_OK); /* 2 + 3/8 at x = 2 */
    STEP(7.0, 81.0, MDL_EXTRAPOLATED);       /* beyond the range the command passes */
    STEP(2.0, 81.0 - 4.5 * 4.5, MDL_OK);     /* 4.5, down from 9 */
}

void test_the_first_sample_comes_up_the_rising_envelope(void)
{
    use_envelopes(square, 2, 0);
    start();
    STEP(2.0, 9.0, MDL_OK);
    STEP(2.0, 9.0, MDL_OK);
    STEP(1.5, 9.0, MDL_OK); /* between the envelopes */
}

void test_a_reset_takes_the_envelopes_to_rest(void)
{
    use_envelopes(square, 2, 0);
    start();
    STEP(6.0, 64.0, MDL_OK);
    STEP(2.0, 51.75, MDL_OK);
    mdl_chain_reset(&chain);
    STEP(2.0, 9.0, MDL_OK);
}

void test_the_envelopes_act_on_the_history(void)
{
    use_envelopes(square, 2, 0);
    start();
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(6.0)));
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(2.0)));
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(3.0))); /* between the envelopes */
    STEP(2.5, 51.75, MDL_OK);                                  /* 64 - 3.5^2 */
    STEP(0.0, 64.0 - 5.625 * 5.625, MDL_OK);
}

void test_one_sample_in_substeps_comes_to_the_same_behind_envelopes(void)
{
    use_envelopes(square, 2, 0);
    params.substeps = 8;
    start();
    STEP(-2.0, 0.0, MDL_OK);
    STEP(2.0, 9.0, MDL_OK);
    STEP(6.0, 64.0, MDL_OK);
    STEP(2.0, 51.75, MDL_OK);
}

void test_the_operator_without_a_threshold_may_follow_all_the_same(void)
{
    /* Its weight is 2 um / V of f0 = (1 + x)^2; on a line it is all there is. */
    const mdl_real c[] = {MDL_C(1.0), MDL_C(2.0), MDL_C(1.0)};
    use_envelopes(c, 2, 0);
    params.envelope.follow = MDL_C(1.0);
    start();
    STEP(2.0, 16.0 + 2.0, MDL_OK); /* 3, and the volt that it lags behind */
    params.envelope.follow = MDL_C(0.25);
    start();
    STEP(2.0, 16.0 + 0.5, MDL_OK);
    STEP(6.0, 81.0, MDL_OK);
    STEP(2.0, 81.0 - (4.5 * 4.5 - 1.0) - 0.25, MDL_OK); /* half a volt ahead of a fall */
    use_envelopes(c, 1, 0);
    params.envelope.follow = MDL_C(1.0);
    start();
    STEP(2.0, 9.0, MDL_OK);
    STEP(1.5, 8.0, MDL_OK);
    STEP(0.5, 6.0, MDL_OK);
    STEP(-2.0, 1.0, MDL_OK);
}

void test_the_operator_without_a_threshold_follows_on_the_history_too(void)
{
    const mdl_real c[] = {MDL_C(1.0), MDL_C(1.0)};
    use_envelopes(c, 1, 0);
    params.envelope.follow = MDL_C(0.5);
    start();
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(6.0)));
    STEP(2.0, 5.0 + 0.25, MDL_OK); /* 4.5 at x = 4 */
    STEP(2.25, 5.0 + 0.375, MDL_OK);
}

void test_envelopes_take_parameters_at_their_limits(void)
{
    uint16_t i;
    for (i = 0; i < 2u; i++) {
        mdl_real end = i == 0 ? MDL_C(-1.0) : MDL_C(1.0);
        use_envelopes(square, 2, 0);
        params.envelope.rise_skew = end;
        params.envelope.fall_skew = -end;
        params.envelope.follow = (mdl_real)i;
        start();
        params.envelope.rise_volts = MDL_C(0.0);
        params.envelope.fall_volts = MDL_C(0.0);
        start();
        STEP(2.0, 16.0, MDL_OK);
    }
}

void test_behind_a_saturation_the_envelopes_rest_where_they_have_been_led(void)
{
    /*
     * The drive is x = 1 to 5. Up to 5 the operators get 5 - 15/16, and down to 1 they get 1 +
     * 7/32: there the envelopes do not end.
     */
    const double top = 4.0625 * 4.0625;
    const double rest = top - 2.84375 * 2.84375;
    use_clipped_square();
    params.blocks |= MDL_BLOCK_ENVELOPE;
    params.envelope.per_volt = MDL_C(0.125);
    params.envelope.rise_volts = MDL_C(1.0);
    params.envelope.fall_volts = MDL_C(0.5);
    start();
    STEP(-2.0, rest, MDL_OK);
    STEP(-0.25, rest, MDL_OK);                   /* between the envelopes */
    STEP(0.0, rest + 0.03125 * 0.03125, MDL_OK); /* 1.25 at x = 2 */
    STEP(6.0, top, MDL_OK);
    STEP(1.0, top - 0.59375 * 0.59375, MDL_OK); /* 3 + 15/32 at x = 3 */
    STEP(-2.0, rest, MDL_OK);                   /* every swing ends where the first one did */
    mdl_chain_reset(&chain);
    STEP(-2.0, rest, MDL_OK);
}

void test_raised_thresholds_grip_behind_the_envelopes(void)
{
    use_envelopes(square, 2, MDL_BLOCK_RATE);
    use_rise_as_velocity(MDL_C(1.0));
    params.rate.threshold_volts = MDL_C(0.25);
    start();
    STEP(-2.0, 0.0, MDL_OK);
    STEP(2.0, 4.0, MDL_OK); /* a rise of 4: one volt held of 3 */
    STEP(2.0, 9.0, MDL_OK); /* at rest the play has no width */
}

void test_behind_a_history_raised_thresholds_rest_where_the_envelopes_are(void)
{
    use_envelopes(square, 2, MDL_BLOCK_RATE);
    use_rise_as_velocity(MDL_C(1.0));
    params.rate.threshold_volts = MDL_C(0.25);
    start();
    ASSERT_STATUS(MDL_OK, mdl_chain_lead(&chain, MDL_C(6.0)));
    STEP(2.0, 51.75, MDL_OK); /* 4.5 at x = 4: 64 - 3.5^2 */
    STEP(2.5, 51.75, MDL_OK); /* there still, also for a play of 1/8 V */
}

void test_damping_takes_the_rate_of_the_command_between_the_envelopes(void)
{
    use_envelopes(square, 2, MDL_BLOCK_RATE);
    use_rise_as_velocity(MDL_C(1.0));
    params.rate.damping_um = MDL_C(0.5);
    start();
    STEP(2.0, 9.0, MDL_OK);
    STEP(1.5, 9.0 - 0.25, MDL_OK); /* nothing moves, but for the damping of a fall of 1/2 */
}

void test_the_part_by_bouc_and_wen_takes_the_command_beside_the_envelopes(void)
{
    const mdl_real c[] = {MDL_C(1.0), MDL_C(1.0)};
    const mdl_real behind[] = {MDL_C(-1.0), MDL_C(-0.5), MDL_C(0.375)}; /* w - x */
    const mdl_real u[] = {MDL_C(2.0), MDL_C(1.5), MDL_C(0.0)};
    mdl_real alone[3];
    uint16_t both, i;
    for (both = 0; both < 2u; both++) {
        use_envelopes(c, 1, MDL_BLOCK_BOUC);
        params.bouc.size_um = MDL_C(-2.0);
        params.bouc.per_volt = MDL_C(0.25);
        params.bouc.power = MDL_C(1.0);
        params.envelope.rise_volts *= (mdl_real)both;
        params.envelope.fall_volts *= (mdl_real)both;
        start();
        for (i = 0; i < 3u; i++) {
            mdl_real y;
            ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, u[i], &y));
            if (both == 0) {
                alone[i] = y;
            } else {
                ASSERT_NEAR(alone[i] + behind[i], y, 8.0);
            }
        }
    }
}

void test_creep_follows_with_its_share(void)
{
    /* Two modes of 1/4 and 1/8 of the displacement above f0(0). */
    use_line(MDL_BLOCK_CREEP);
    params.creep_count = 2;
    params.creep[0].lag.decay = MDL_C(0.5);
    params.creep[0].lag.ramp = MDL_C(1.0);
    params.creep[0].gain = MDL_C(0.25);
    params.creep[1].lag.decay = MDL_C(0.0);
    params.creep[1].lag.ramp = MDL_C(1.0);
    params.creep[1].gain = MDL_C(0.125);
    start();
    STEP(2.0, 6.5, MDL_OK);  /* in equilibrium: 5 + 3/8 * 4 */
    STEP(-2.0, 2.5, MDL_OK); /* 1 + 3/8 * 4: the fall of 4 has yet to be followed */
    STEP(-2.0, 2.0, MDL_OK); /* half of the first mode has */
    STEP(-2.0, 1.75, MDL_OK);
}

void test_flexure_modes_are_moved_by_what_a_pole_before_them_lets_through(void)
{
    const mdl_mode_params mode = {{{MDL_C(-0.5), MDL_C(0.0)}, {MDL_C(0.0), MDL_C(0.0)}},
                                  {MDL_C(-1.0), MDL_C(0.0)},
                                  MDL_C(1.0)};
    use_line(MDL_BLOCK_BEHIND | MDL_BLOCK_MODES);
    params.behind.decay = MDL_C(0.75);
    params.behind.ramp = MDL_C(0.5);
    params.mode_count = 1;
    params.mode[0] = mode;
    start();
    STEP(0.0, 3.0, MDL_OK);
    STEP(4.0, 3.0, MDL_OK); /* 5 - 2 */
    STEP(4.0, 4.0, MDL_OK); /* 6.5 - 2 / 2 - 1.5 */
}

void test_flexure_modes_are_added(void)
{
    const mdl_mode_params mode = {{{MDL_C(-0.5), MDL_C(0.0)}, {MDL_C(0.0), MDL_C(0.0)}},
                                  {MDL_C(-1.0), MDL_C(0.0)},
                                  MDL_C(0.5)};
    use_line(MDL_BLOCK_MODES);
    params.mode_count = 2;
    params.mode[0] = mode;
    params.mode[1] = mode;
    params.mode[1].share = MDL_C(0.25);
    start();
    STEP(0.0, 3.0, MDL_OK);
    STEP(4.0, 4.0, MDL_OK); /* 7 - 4 * 3/4 */
    STEP(4.0, 5.5, MDL_OK); /* e is halved */
}

void test_backlash(void)
{
    use_line(MDL_BLOCK_BACKLASH);
    params.dead_band_um = MDL_C(2.0);
    start();
    STEP(4.0, 6.0, MDL_OK); /* 7, half a dead band behind */
    STEP(2.0, 6.0, MDL_OK);
    STEP(1.0, 5.0, MDL_OK); /* 4, pulled */
}

void test_a_rough_contact_lets_go_part_by_part(void)
{
    use_line(MDL_BLOCK_BACKLASH);
    params.dead_band_um = MDL_C(2.0);
    params.spread = MDL_C(1.0); /* widths 0.25, 0.75, ... 3.75 */
    start();
    STEP(4.0, 6.0, MDL_OK);     /* 7, in the mean half a dead band behind */
    STEP(3.5, 5.96875, MDL_OK); /* 6.5: the narrowest went along by 0.25 */
    STEP(1.0, 4.875, MDL_OK);   /* 4: all but the two widest did */
}

void test_a_spring_carries_a_share_across_the_gap(void)
{
    use_line(MDL_BLOCK_BACKLASH);
    params.dead_band_um = MDL_C(2.0);
    params.spring_share = MDL_C(0.25);
    start();
    STEP(4.0, 6.25, MDL_OK); /* 7, of which the play leaves 6 */
    STEP(2.0, 5.75, MDL_OK); /* 5, and still 6 */
    STEP(1.0, 4.75, MDL_OK); /* 4, and 5 */
    params.spring_share = MDL_C(1.0);
    start();
    STEP(4.0, 7.0, MDL_OK);
    STEP(2.0, 5.0, MDL_OK);
}

void test_delay_in_substeps(void)
{
    use_line(MDL_BLOCK_DELAY);
    params.substeps = 4;
    params.delay.whole = 1;
    params.delay.weight[0] = MDL_C(0.5);
    params.delay.weight[1] = MDL_C(0.5);
    start();
    STEP(0.0, 3.0, MDL_OK); /* at rest there before */
    STEP(4.0, 5.5, MDL_OK); /* 3, 4, 5, 6, 7: between the last two but one */
    STEP(4.0, 7.0, MDL_OK);
    STEP(0.0, 4.5, MDL_OK);
}

void test_rate_can_raise_the_thresholds(void)
{
    const mdl_real c[] = {MDL_C(1.0), MDL_C(2.0), MDL_C(1.0)};
    use(c, 2, MDL_BLOCK_RATE);
    use_rise_as_velocity(MDL_C(1.0));
    params.rate.threshold_volts = MDL_C(0.25);
    start();
    STEP(-2.0, 1.0, MDL_OK);
    STEP(2.0, 18.0, MDL_OK); /* a rise of 4: f0(3) = 16, and f0'(0) = 2 times the volt held */
    STEP(2.0, 25.0, MDL_OK); /* at rest the play has no width */
}

void test_gain_about_f0_of_zero_and_offset(void)
{
    use_line(MDL_BLOCK_GAIN);
    params.gain = MDL_C(1.5);
    params.offset_um = MDL_C(0.25);
    start();
    STEP(-2.0, 1.25, MDL_OK);
    STEP(2.0, 7.25, MDL_OK); /* 1 + 1.5 * 4 + 0.25 */
}

void test_statuses_of_substeps_are_combined(void)
{
    use_line(MDL_BLOCK_GAIN);
    params.gain = MDL_C(1.0);
    params.substeps = 4;
    start();
    STEP(10.5, 13.0, MDL_EXTRAPOLATED | MDL_CLAMPED); /* at the edge of the margin */
    STEP(2.5, 5.5, MDL_EXTRAPOLATED);                 /* by way of 8.125, 6.25, 4.375 */
    STEP(2.5, 5.5, MDL_OK);
    STEP(10.5, 13.0, MDL_EXTRAPOLATED | MDL_CLAMPED);
}

static void first_sample_finds_everything_in_equilibrium(void)
{
    mdl_real first, y;
    uint16_t i;
    params.saturation.knee_volts = MDL_C(0.0);
    params.envelope.rise_volts = MDL_C(0.0);
    params.envelope.fall_volts = MDL_C(0.0);
    params.bouc.size_um = MDL_C(0.0);
    start();
    ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(2.0), &first));
    /* 16, creep 2/32 of it, half a dead band less the spring's share; gain and offset. */
    ASSERT_REAL(1.5 * (16.0 + 1.0 - 0.75 * 0.125) + 0.5, first);
    for (i = 0; i < 20u; i++) {
        ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(2.0), &y));
        ASSERT_REAL(first, y);
    }
}

void test_the_first_sample_finds_everything_in_equilibrium(void)
{
    use_everything();
    first_sample_finds_everything_in_equilibrium();
    use_everything_viscous(MDL_C(0.5), MDL_C(0.0));
    first_sample_finds_everything_in_equilibrium();
    use_everything_viscous(MDL_C(1.0), MDL_C(0.5));
    first_sample_finds_everything_in_equilibrium();
}

void test_what_is_not_finite_is_refused_and_changes_nothing(void)
{
    mdl_chain before;
    mdl_real y, last;
    int i;
    use_everything();
    start();
    STEP(mdl_test_not_finite(0), 0.5, MDL_ERR_NOT_FINITE); /* at rest: f0(0), and the offset */
    ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(2.0), &y));
    ASSERT_STATUS(MDL_OK, mdl_chain_step(&chain, MDL_C(1.0), &y));
    last = y;
    before = chain;
    for (i = 0; i < 3; i++) {
        STEP(mdl_test_not_finite(i), last, MDL_ERR_NOT_FINITE);
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &chain, sizeof chain);
}

void test_a_command_whose_distance_from_u_min_overflows_is_refused(void)
{
    const mdl_real huge = MDL_TEST_EPSILON < 1e-12 ? (mdl_real)1.5e308 : MDL_C(3e38);
    mdl_chain before;
    use_everything();
    params.u_min_volts = -huge;
    start();
    before = chain;
    STEP(huge, 0.5, MDL_ERR_NOT_FINITE); /* at rest */
    TEST_ASSERT_EQUAL_MEMORY(&before, &chain, sizeof chain);
}

/* ---- saving and resuming ---- */

#define SAVED_MAX (2048 + MDL_DELAY_MAX)
static mdl_real saved[SAVED_MAX];

static mdl_real wave(uint16_t i)
{
    return (mdl_real)((i * 37u) % 61u) * MDL_C(0.125) - MDL_C(2.0);
}

static mdl_real run(uint16_t from, uint16_t to)
{
    mdl_real y = MDL_C(0.0);
    uint16_t i;
    for (i = from; i < to; i++) {
        TEST_ASSERT_TRUE(mdl_chain_step(&chain, wave(i), &y) >= 0);
    }
    return y;
}

static void two_halves_equal_one_whole(uint16_t every)
{
    uint16_t i;
    for (i = 0; i < 100u; i = (uint16_t)(i + every)) {
        mdl_real whole;
        uint32_t length;
        start();
        (void)run(0, i);
        length = mdl_chain_saved_length(&chain);
        ASSERT_STATUS(MDL_OK, mdl_chain_save(&chain, saved, SAVED_MAX));
        whole = run(i, 120);
        mdl_chain_reset(&chain);
        (void)run(50, 70);
        ASSERT_STATUS(MDL_OK, mdl_chain_resume(&chain, saved, length));
        ASSERT_REAL(whole, run(i, 120));
    }
}

void test_two_halves_equal_one_whole(void)
{
    use_everything();
    two_halves_equal_one_whole(1);
}

void test_where_the_envelopes_are_is_saved(void)
{
    uint32_t length;
    use_envelopes(square, 2, 0);
    start();
    STEP(6.0, 64.0, MDL_OK);
    STEP(2.0, 51.75, MDL_OK);
    length = mdl_chain_saved_length(&chain);
    ASSERT_STATUS(MDL_OK, mdl_chain_save(&chain, saved, SAVED_MAX));
    mdl_chain_reset(&chain);
    ASSERT_STATUS(MDL_OK, mdl_chain_resume(&chain, saved, length));
    STEP(2.5, 51.75, MDL_OK); /* still between the envelopes, on the curve down from 64 */
}

void test_two_halves_equal_one_whole_with_viscous_operators(void)
{
    use_everything_viscous(MDL_C(0.875), MDL_C(0.0));
    two_halves_equal_one_whole(7);
    use_everything_viscous(MDL_C(1.0), MDL_C(0.125));
    two_halves_equal_one_whole(7);
}

void test_save_refuses_a_short_array_and_leaves_it_alone(void)
{
    uint32_t length, k;
    use_everything();
    start();
    (void)run(0, 10);
    length = mdl_chain_saved_length(&chain);
    for (k = 0; k <= length; k++) {
        saved[k] = MDL_C(-77.0);
    }
    for (k = 0; k < length; k++) {
        ASSERT_STATUS(MDL_ERR_CAPACITY, mdl_chain_save(&chain, saved, k));
    }
    ASSERT_REAL(-77.0, saved[0]);
    ASSERT_STATUS(MDL_OK, mdl_chain_save(&chain, saved, length));
    ASSERT_REAL(-77.0, saved[length]);
}

/* A saved state with one number changed, or cut, is refused; the chain is as before. */
static void resume_refuses(mdl_status status, uint32_t index, mdl_real value, uint32_t less)
{
    mdl_chain before;
    mdl_real old;
    use_everything();
    start();
    (void)run(0, 10);
    before = chain;
    ASSERT_STATUS(MDL_OK, mdl_chain_save(&chain, saved, SAVED_MAX));
    old = saved[index];
    saved[index] = value;
    ASSERT_STATUS(status, mdl_chain_resume(&chain, saved, mdl_chain_saved_length(&chain) - less));
    TEST_ASSERT_EQUAL_MEMORY(&before, &chain, sizeof chain);
    saved[index] = old;
    ASSERT_STATUS(MDL_OK, mdl_chain_resume(&chain, saved, mdl_chain_saved_length(&chain)));
}

void test_resume_refuses_what_is_not_finite(void)
{
    uint32_t k;
    use_everything();
    start();
    (void)run(0, 10);
    for (k = 0; k < mdl_chain_saved_length(&chain); k++) {
        resume_refuses(MDL_ERR_NOT_FINITE, k, mdl_test_not_finite((int)(k % 3u)), 0);
    }
}

void test_resume_refuses_what_save_cannot_write(void)
{
    resume_refuses(MDL_ERR_STATE, 0, MDL_C(0.5), 0);
    resume_refuses(MDL_ERR_STATE, 0, MDL_C(2.0), 0);
    resume_refuses(MDL_ERR_STATE, 1, MDL_C(-1.0), 0);
    resume_refuses(MDL_ERR_STATE, 1, MDL_C(0.5), 0);
    resume_refuses(MDL_ERR_STATE, 1, (mdl_real)MDL_DELAY_MAX, 0);
    resume_refuses(MDL_ERR_STATE, 1, MDL_C(1e9), 0);
}

void test_resume_refuses_wrong_lengths(void)
{
    uint32_t length, k;
    use_everything();
    start();
    (void)run(0, 10);
    length = mdl_chain_saved_length(&chain);
    ASSERT_STATUS(MDL_OK, mdl_chain_save(&chain, saved, SAVED_MAX));
    for (k = 0; k < length; k++) {
        ASSERT_STATUS(MDL_ERR_STATE, mdl_chain_resume(&chain, saved, k));
    }
    ASSERT_STATUS(MDL_ERR_STATE, mdl_chain_resume(&chain, saved, length + 1u));
}

/* Operators of a play model, with a frequency that is found on line. */
static mdl_yang_params yang_params;

static void use_yang(uint16_t more)
{
    use_line((uint16_t)(MDL_BLOCK_YANG | more));
    memset(&yang_params, 0, sizeof yang_params);
    yang_params.pi.count = 1;
    yang_params.pi.threshold_volts[0] = MDL_C(1.5);
    yang_params.pi.weight[0] = MDL_C(0.5);
    yang_params.pi.linear = MDL_C(1.0);
    yang_params.low_volts = MDL_C(-2.0);
    yang_params.high_volts = MDL_C(6.0);
    yang_params.k[0] = MDL_C(0.75);
    yang_params.c_um[1] = MDL_C(-0.125);
    yang_params.m[0] = MDL_C(0.75);
    yang_params.hz_max = MDL_C(64.0);
    yang_params.harmonics = 1;
    yang_params.lambda[0] = MDL_C(1.0);
    yang_params.turn_volts = MDL_C(0.25);
    yang_params.rate_hz = MDL_C(64.0);
    yang_params.filter.decay = MDL_C(0.5);
    yang_params.filter.ramp = MDL_C(0.75);
    yang_params.v_scale = MDL_C(-64.0);
    params.yang = &yang_params;
}

void test_the_model_of_yang_stands_in_the_trajectorys_place(void)
{
    mdl_yang yang;
    mdl_real y;
    uint16_t i;
    use_yang(0);
    start();
    ASSERT_STATUS(MDL_OK, mdl_yang_start(&yang, &yang_params, wave(0), &y));
    STEP(wave(0), y, MDL_OK);
    for (i = 1; i < 60u; i++) {
        ASSERT_STATUS(MDL_OK, mdl_yang_step(&yang, &yang_params, wave(i), &y));
        STEP(wave(i), y, MDL_OK);
    }
    TEST_ASSERT_TRUE(yang.cycle.period > MDL_C(0.0));
}

void test_blocks_act_around_the_model_of_yang(void)
{
    use_yang(MDL_BLOCK_SATURATION | MDL_BLOCK_GAIN);
    params.saturation.low_volts = MDL_C(-2.0);
    params.saturation.high_volts = MDL_C(4.0);
    params.gain = MDL_C(2.0);
    start();
    /* 4 + 2.5 / 2, about f0(0) = 1 */
    STEP(6.0, 2.0 * (5.25 - 1.0) + 1.0, MDL_OK);
}

void test_the_state_of_the_model_of_yang_is_saved(void)
{
    mdl_real whole, half;
    use_yang(MDL_BLOCK_CREEP);
    start();
    whole = run(0, 100);
    start();
    (void)run(0, 47);
    ASSERT_STATUS(MDL_OK, mdl_chain_save(&chain, saved, SAVED_MAX));
    start();
    (void)run(3, 20);
    ASSERT_STATUS(MDL_OK, mdl_chain_resume(&chain, saved, mdl_chain_saved_length(&chain)));
    half = run(47, 100);
    ASSERT_REAL(whole, half);
}

void test_bad_parameters_of_the_model_of_yang_are_refused(void)
{
    use_yang(0);
    yang_params.m[0] = MDL_C(0.0);
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &params, &left, &right));
    params.yang = 0;
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_chain_init(&chain, &params, &left, &right));
    params.blocks = 0;
    ASSERT_STATUS(MDL_OK, mdl_chain_init(&chain, &params, &left, &right));
}

void test_viscous_operators_follow_what_the_envelopes_leave(void)
{
    uint16_t by_square;
    for (by_square = 0; by_square < 2u; by_square++) {
        use_relaxing(by_square);
        params.blocks |= MDL_BLOCK_ENVELOPE;
        params.envelope.per_volt = MDL_C(0.125);
        params.envelope.rise_volts = MDL_C(1.0);
        params.envelope.fall_volts = MDL_C(0.5);
        start();
        STEP(-2.0, 0.0, MDL_OK);
        STEP(2.0, MDL_C(9.0) - lagged(MDL_C(3.0), MDL_C(3.0)), MDL_OK);
        STEP(1.5, MDL_C(9.0) - lagged(MDL_C(3.0), MDL_C(0.0)), MDL_OK); /* between the envelopes */
    }
}
