/*
 * Play operators with the weights of f0 on a range that puts their thresholds 2 r at whole volts:
 * 1, 2, ... Whole f0 and growths of quarters are exact in every build.
 */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_major.h"
#include "mdl_plays.h"
#include "mdl_shape.h"

#include <string.h>

#define RANGE (MDL_PLAYS_MAX + 1)

/* A square's operators all have the weight 2. */
#define WEIGHTS (2.0 * MDL_PLAYS_MAX)

#ifdef MDL_REAL_DOUBLE
#define POWER_ERROR 2e-8
#else
#define POWER_ERROR 2e-6
#endif

static mdl_major major;
static mdl_plays_params params;
static mdl_plays plays;

static void use(const mdl_real *c, uint16_t degree)
{
    ASSERT_STATUS(MDL_OK, mdl_major_init_polynomial(&major, (mdl_real)RANGE, c, degree));
    mdl_plays_make(&params, &major);
    mdl_plays_reset(&plays, &params);
}

static void use_cubic(void)
{
    const mdl_real c[] = {MDL_C(3.0), MDL_C(2.0), MDL_C(-4.0), MDL_C(1.0)};
    use(c, 3);
}

static mdl_real step(mdl_real x, mdl_real grow)
{
    return mdl_plays_step(&plays, &params, x, grow);
}

static double weight(uint16_t i)
{
    return (double)params.weight[i];
}

static double half(uint16_t i)
{
    return (i + 1) / 2.0;
}

/* An input within and around the range, in quarters. */
static mdl_real wave(uint16_t i)
{
    return (mdl_real)((i * 61u) % 151u) * MDL_C(0.25) - MDL_C(2.0);
}

void setUp(void)
{
    const mdl_real square[] = {MDL_C(5.0), MDL_C(7.0), MDL_C(1.0)};
    use(square, 2);
}

void tearDown(void)
{
}

void test_half_widths_are_evenly_spaced_within_the_range(void)
{
    uint16_t i;
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        ASSERT_REAL(half(i), params.half_volts[i]);
    }
}

void test_a_square_has_equal_weights(void)
{
    uint16_t i;
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        ASSERT_REAL(2.0, params.weight[i]);
    }
}

/* f0(0) + w_0 x + sum w_i max(0, x - 2 r_i) */
static double sum_of_operators(int x)
{
    double first = (double)mdl_major_eval(&major, MDL_C(1.0)) - (double)major.at_zero_um;
    double y = (double)major.at_zero_um + first * x;
    uint16_t i;
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        y += weight(i) * fmax(0.0, x - 2.0 * half(i));
    }
    return y;
}

void test_the_weights_reproduce_f0_at_the_thresholds(void)
{
    int x;
    use_cubic();
    for (x = 0; x <= RANGE; x++) {
        ASSERT_REAL(3.0 + x * (2.0 + x * (-4.0 + x)), sum_of_operators(x));
    }
}

void test_the_weights_reproduce_a_broken_line(void)
{
    const mdl_real x[] = {MDL_C(0.0), MDL_C(3.0), MDL_C(4.0), (mdl_real)RANGE};
    const mdl_real y[] = {MDL_C(1.0), MDL_C(7.0), MDL_C(8.0), MDL_C(8.0)};
    uint16_t i;
    ASSERT_STATUS(MDL_OK, mdl_major_init_breakpoints(&major, x, y, 4));
    mdl_plays_make(&params, &major);
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        ASSERT_REAL(i == 2u || i == 3u ? -1.0 : 0.0, params.weight[i]);
    }
    ASSERT_REAL(8.0, sum_of_operators(RANGE));
}

void test_the_shape_is_left_out(void)
{
    const mdl_shape shape = {
        MDL_C(0.03125), {{MDL_C(2.0), MDL_C(4.0)}, {MDL_C(1.0)}}, {MDL_C(0.0)}};
    mdl_plays_params before = params;
    major.shape = &shape;
    mdl_plays_make(&params, &major);
    TEST_ASSERT_EQUAL_MEMORY(&before, &params, sizeof params);
}

void test_a_straight_line_holds_nothing(void)
{
    const mdl_real line[] = {MDL_C(1.0), MDL_C(2.0)};
    const mdl_real constant[] = {MDL_C(1.0)};
    uint16_t i;
    use(line, 1);
    for (i = 0; i < 100u; i++) {
        ASSERT_REAL(0.0, step(wave(i), MDL_C(0.75)));
    }
    use(constant, 0);
    ASSERT_REAL(0.0, step(MDL_C(9.0), MDL_C(0.75)));
}

void test_without_growth_nothing_is_held(void)
{
    uint16_t i;
    use_cubic();
    for (i = 0; i < 200u; i++) {
        ASSERT_REAL(0.0, step(wave(i), MDL_C(0.0)));
    }
}

void test_a_constant_growth_on_a_fresh_rising_branch(void)
{
    const double grows[] = {0.25, 0.5, 1.0, 3.0};
    uint16_t g, i;
    int x;
    use_cubic();
    for (g = 0; g < 4u; g++) {
        mdl_plays_reset(&plays, &params);
        for (x = 0; x <= RANGE; x++) {
            double expected = 0.0;
            for (i = 0; i < MDL_PLAYS_MAX; i++) {
                expected += weight(i) * (fmax(0.0, x - 2.0 * half(i)) -
                                         fmax(0.0, x - half(i) * (2.0 + grows[g])));
            }
            ASSERT_REAL(expected, step((mdl_real)x, (mdl_real)grows[g]));
        }
    }
}

void test_a_constant_growth_on_a_falling_branch_holds_it_up(void)
{
    /* From the end of the range, where the still operators are at x - r, the grown ones at most. */
    const double grow = 0.5;
    uint16_t i;
    int x;
    (void)step((mdl_real)RANGE, (mdl_real)grow);
    for (x = RANGE; x >= 0; x--) {
        double expected = 0.0;
        for (i = 0; i < MDL_PLAYS_MAX; i++) {
            double r = half(i);
            double top = fmax(r, RANGE - r * (1.0 + grow));
            expected += weight(i) * (fmin(RANGE - r, x + r) - fmin(top, x + r * (1.0 + grow)));
        }
        ASSERT_REAL(expected, step((mdl_real)x, (mdl_real)grow));
    }
    TEST_ASSERT_TRUE(step(MDL_C(0.0), (mdl_real)grow) < MDL_C(0.0));
}

void test_any_input_with_any_growth_is_a_sum_of_plays(void)
{
    double still[MDL_PLAYS_MAX], grown[MDL_PLAYS_MAX];
    uint16_t i, k;
    use_cubic();
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        still[i] = grown[i] = half(i);
    }
    for (k = 0; k < 300u; k++) {
        double x = (double)wave(k);
        double grow = (k * 7u % 13u) * 0.25;
        double expected = 0.0;
        for (i = 0; i < MDL_PLAYS_MAX; i++) {
            double wide = half(i) * (1.0 + grow);
            still[i] = fmin(fmax(still[i], x - half(i)), x + half(i));
            grown[i] = fmin(fmax(grown[i], x - wide), x + wide);
            expected += weight(i) * (still[i] - grown[i]);
        }
        ASSERT_REAL(expected, step((mdl_real)x, (mdl_real)grow));
    }
}

void test_where_the_growth_ends_the_grown_operators_catch_up(void)
{
    TEST_ASSERT_TRUE(step(MDL_C(20.0), MDL_C(0.5)) > MDL_C(0.0));
    ASSERT_REAL(0.0, step(MDL_C(20.0), MDL_C(0.0)));
    ASSERT_REAL(0.0, step(MDL_C(10.0), MDL_C(0.0)));
}

void test_reset_is_the_rest_after_the_whole_range(void)
{
    mdl_plays fresh = plays;
    (void)step((mdl_real)RANGE, MDL_C(0.0));
    (void)step(MDL_C(0.0), MDL_C(0.0));
    TEST_ASSERT_EQUAL_MEMORY(&fresh, &plays, sizeof plays);
    (void)step(MDL_C(17.0), MDL_C(0.75));
    (void)step(MDL_C(-3.0), MDL_C(0.5));
    mdl_plays_reset(&plays, &params);
    TEST_ASSERT_EQUAL_MEMORY(&fresh, &plays, sizeof plays);
}

void test_a_huge_growth_stops_the_grown_operators(void)
{
    /* All of what the still ones move: sum 2 max(0, x - 2 r) = x (x - 1). */
    ASSERT_REAL(20.0 * 19.0, step(MDL_C(20.0), MDL_C(1048576.0)));
    ASSERT_REAL(0.0, step(MDL_C(0.0), MDL_C(1048576.0)));
}

/* ---- viscous operators ---- */

/* Linear, half of a distance is left: tau is 1 / ln 2 = 1.44 samples. */
#define TAU 1.4426950408889634
static const mdl_relax_params linear = {MDL_C(0.5), MDL_C(0.4426950408889634), MDL_C(0.0)};

static mdl_real relax(const mdl_relax_params *by, mdl_real x, mdl_real rise)
{
    return mdl_plays_relax(&plays, &params, x, rise, by);
}

static mdl_relax_params by_square(mdl_real pull)
{
    const mdl_relax_params made = {MDL_C(1.0), MDL_C(0.0), pull};
    return made;
}

/* On a ramp from one x to another, far from which all operators are pulled: what is held last. */
static mdl_real along(const mdl_relax_params *by, mdl_real from, mdl_real to, mdl_real rise)
{
    mdl_real last = MDL_C(0.0);
    mdl_real x = from;
    while (x != to) {
        x += rise;
        last = relax(by, x, rise);
    }
    return last;
}

void test_linear_operators_are_tau_behind_a_steady_input(void)
{
    const mdl_real rises[] = {MDL_C(0.0625), MDL_C(0.25), MDL_C(2.0)};
    uint16_t i;
    for (i = 0; i < 3u; i++) {
        double behind = WEIGHTS * TAU * (double)rises[i];
        mdl_plays_reset(&plays, &params);
        ASSERT_NEAR(behind, along(&linear, MDL_C(0.0), MDL_C(128.0), rises[i]), 128.0 * WEIGHTS);
        ASSERT_NEAR(-behind, along(&linear, MDL_C(128.0), MDL_C(0.0), -rises[i]), 128.0 * WEIGHTS);
    }
}

void test_linear_operators_follow_a_new_velocity_as_a_pole_does(void)
{
    /* Downwards from the rest all are pulled at once: tau v (1 - e^(-t / tau)). */
    int n;
    for (n = 1; n <= 20; n++) {
        double behind = TAU * 0.25 * (1.0 - pow(0.5, n));
        ASSERT_NEAR(-WEIGHTS * behind, relax(&linear, (mdl_real)(-0.25 * n), MDL_C(-0.25)),
                    16.0 * WEIGHTS);
    }
}

void test_square_operators_are_a_root_behind_a_steady_input(void)
{
    /* sqrt(v / k), with d = v h and a pull of k h. */
    const mdl_real rises[] = {MDL_C(0.015625), MDL_C(0.25), MDL_C(2.0)};
    const mdl_real pulls[] = {MDL_C(0.0625), MDL_C(1.0), MDL_C(8.0)};
    uint16_t i, k;
    for (i = 0; i < 3u; i++) {
        for (k = 0; k < 3u; k++) {
            const mdl_relax_params by = by_square(pulls[k]);
            double behind = WEIGHTS * sqrt((double)rises[i] / (double)pulls[k]);
            double error = POWER_ERROR * behind + 16.0 * MDL_TEST_EPSILON * 128.0 * WEIGHTS;
            mdl_real up, down;
            mdl_plays_reset(&plays, &params);
            up = along(&by, MDL_C(0.0), MDL_C(128.0), rises[i]);
            down = along(&by, MDL_C(128.0), MDL_C(0.0), -rises[i]);
            TEST_ASSERT_DOUBLE_WITHIN(error, behind, (double)up);
            TEST_ASSERT_DOUBLE_WITHIN(error, -behind, (double)down);
        }
    }
}

void test_square_operators_take_the_least_of_rises(void)
{
    /* Also where the root of its distance is 0. */
    const mdl_real rises[] = {MDL_C(1e-37), MDL_C(-1e-30), MDL_C(1e-21), MDL_C(-1e-18)};
    const mdl_real pulls[] = {MDL_C(0.0625), MDL_C(1024.0), MDL_C(1e10)};
    uint16_t i, k;
    for (i = 0; i < 4u; i++) {
        for (k = 0; k < 3u; k++) {
            const mdl_relax_params by = by_square(pulls[k]);
            mdl_real still;
            mdl_plays_reset(&plays, &params);
            still = relax(&by, MDL_C(20.0), MDL_C(0.0));
            mdl_plays_reset(&plays, &params);
            ASSERT_REAL(still, relax(&by, MDL_C(20.0), rises[i]));
        }
    }
}

/* The square's operators a whole range behind: sum 2 (RANGE - x), x = 1, 2, ... */
#define WHOLE ((double)RANGE * MDL_PLAYS_MAX)

void test_at_rest_linear_operators_relax_to_the_plain_ones(void)
{
    int n;
    for (n = 1; n <= 10; n++) {
        ASSERT_REAL(WHOLE * pow(0.5, n), relax(&linear, (mdl_real)RANGE, MDL_C(0.0)));
    }
    for (n = 0; n < 60; n++) {
        (void)relax(&linear, (mdl_real)RANGE, MDL_C(0.0));
    }
    ASSERT_NEAR(0.0, relax(&linear, (mdl_real)RANGE, MDL_C(0.0)), RANGE);
    ASSERT_NEAR(0.0, step((mdl_real)RANGE, MDL_C(0.0)), RANGE);
}

void test_at_rest_square_operators_relax_as_one_over_time(void)
{
    /* 1 / o grows by the pull every sample. */
    const mdl_relax_params by = by_square(MDL_C(0.125));
    int n, x;
    for (n = 1; n <= 100; n++) {
        double expected = 0.0;
        for (x = 1; x < RANGE; x++) {
            double o = RANGE - x;
            expected += 2.0 * o / (1.0 + 0.125 * n * o);
        }
        ASSERT_NEAR(expected, relax(&by, (mdl_real)RANGE, MDL_C(0.0)), WHOLE);
    }
}

void test_viscous_operators_of_a_straight_line_hold_nothing(void)
{
    const mdl_real line[] = {MDL_C(1.0), MDL_C(2.0)};
    mdl_real last = MDL_C(0.0);
    uint16_t i;
    use(line, 1);
    for (i = 0; i < 100u; i++) {
        ASSERT_REAL(0.0, relax(&linear, wave(i), wave(i) - last));
        last = wave(i);
    }
}
