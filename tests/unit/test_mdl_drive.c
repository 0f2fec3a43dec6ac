/* Saturation and slew limit. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_drive.h"
#include "mdl_power.h"

static const mdl_saturation_params hard = {MDL_C(100.0), MDL_C(-20.0), MDL_C(0.0), MDL_C(0.0), 0u};
static const mdl_saturation_params soft = {MDL_C(100.0), MDL_C(-20.0), MDL_C(0.5), MDL_C(0.0), 0u};

/* A knee that begins at 98 and at -18 volts. */
static mdl_saturation_params rounded;

/* Volts near 100, and the error of mdl_softplus, or of the rounded knee's power, times the knee. */
#define ASSERT_SOFT(expected, actual)                                                              \
    TEST_ASSERT_DOUBLE_WITHIN(160.0 * MDL_TEST_EPSILON + 4e-8, expected, (double)(actual))

/* Volts below 160, and the errors of powers of two and logarithms, for a knee of 1 V. */
#define ASSERT_SETTLED(expected, actual)                                                           \
    TEST_ASSERT_DOUBLE_WITHIN(160.0 * MDL_TEST_EPSILON + 4e-7, expected, (double)(actual))

void setUp(void)
{
    const mdl_saturation_params p = {MDL_C(100.0), MDL_C(-20.0), MDL_C(2.0), MDL_C(1.0), 0u};
    rounded = p;
}

void tearDown(void)
{
}

void test_hard_saturation(void)
{
    ASSERT_REAL(100.0, mdl_saturation(&hard, MDL_C(100.5)));
    ASSERT_REAL(100.0, mdl_saturation(&hard, MDL_C(100.0)));
    ASSERT_REAL(99.5, mdl_saturation(&hard, MDL_C(99.5)));
    ASSERT_REAL(-20.0, mdl_saturation(&hard, MDL_C(-20.0)));
    ASSERT_REAL(-20.0, mdl_saturation(&hard, MDL_C(-1e30)));
}

void test_the_soft_knee_deviates_by_knee_ln_2_at_the_limits(void)
{
    ASSERT_SOFT(100.0 - 0.5 * log(2.0), mdl_saturation(&soft, MDL_C(100.0)));
    ASSERT_SOFT(-20.0 + 0.5 * log(2.0), mdl_saturation(&soft, MDL_C(-20.0)));
}

void test_the_soft_knee_along_its_length(void)
{
    int i;
    for (i = -60; i <= 60; i++) {
        double t = i / 4.0; /* knees from the limit */
        ASSERT_SOFT(100.0 + 0.5 * (t - log1p(exp(t))),
                    mdl_saturation(&soft, (mdl_real)(100.0 + 0.5 * t)));
    }
}

void test_the_soft_knee_is_not_felt_far_inside(void)
{
    ASSERT_REAL(40.0, mdl_saturation(&soft, MDL_C(40.0)));
}

void test_far_outside_the_soft_knee_the_limit_is_reached(void)
{
    ASSERT_SOFT(100.0, mdl_saturation(&soft, MDL_C(150.0)));
    ASSERT_SOFT(100.0, mdl_saturation(&soft, MDL_C(1e30)));
    ASSERT_SOFT(100.0, mdl_saturation(&soft, MDL_C(3e38)));
    ASSERT_SOFT(-20.0, mdl_saturation(&soft, MDL_C(-3e38)));
}

void test_the_rounded_knee_begins_one_width_before_the_limits(void)
{
    ASSERT_REAL(98.0, mdl_saturation(&rounded, MDL_C(98.0)));
    ASSERT_REAL(97.75, mdl_saturation(&rounded, MDL_C(97.75)));
    ASSERT_REAL(40.0, mdl_saturation(&rounded, MDL_C(40.0)));
    ASSERT_REAL(-18.0, mdl_saturation(&rounded, MDL_C(-18.0)));
    TEST_ASSERT_TRUE(mdl_saturation(&rounded, MDL_C(98.25)) < MDL_C(98.25));
    TEST_ASSERT_TRUE(mdl_saturation(&rounded, MDL_C(-18.25)) > MDL_C(-18.25));
}

void test_one_width_into_the_rounded_knee_of_power_1_the_drive_has_followed_by_half(void)
{
    ASSERT_REAL(99.0, mdl_saturation(&rounded, MDL_C(100.0)));
    ASSERT_REAL(-19.0, mdl_saturation(&rounded, MDL_C(-20.0)));
}

void test_the_rounded_knee_along_its_length(void)
{
    const mdl_real powers[] = {MDL_C(1.0), MDL_C(1.5), MDL_C(2.0),
                               MDL_C(2.5), MDL_C(4.0), MDL_C(32.0)};
    uint16_t k;
    int i;
    for (k = 0; k < 6u; k++) {
        double p = (double)powers[k];
        rounded.knee_power = powers[k];
        for (i = 1; i <= 320; i++) {
            double e = i / 16.0; /* widths from where the knee begins */
            double slowed = 2.0 * e / pow(1.0 + pow(e, p), 1.0 / p);
            ASSERT_SOFT(98.0 + slowed, mdl_saturation(&rounded, (mdl_real)(98.0 + 2.0 * e)));
            ASSERT_SOFT(-18.0 - slowed, mdl_saturation(&rounded, (mdl_real)(-18.0 - 2.0 * e)));
        }
    }
}

void test_far_outside_the_rounded_knee_the_limit_is_reached(void)
{
    const mdl_real far[] = {MDL_C(1e10), MDL_C(1e30), MDL_C(3e38)};
    const mdl_real powers[] = {MDL_C(1.0), MDL_C(2.0), MDL_C(32.0)};
    uint16_t i, k;
    for (k = 0; k < 3u; k++) {
        rounded.knee_power = powers[k];
        for (i = 0; i < 3u; i++) {
            ASSERT_SOFT(100.0, mdl_saturation(&rounded, far[i]));
            ASSERT_SOFT(-20.0, mdl_saturation(&rounded, -far[i]));
        }
    }
}

/* y = x - x^2 / (4 w), x from where the knee begins. */
void test_the_parabolic_knee_along_its_length(void)
{
    int i;
    rounded.knee_power = MDL_C(0.0);
    rounded.parabolic = 1u;
    for (i = -16; i <= 96; i++) {
        double x = i / 16.0; /* volts */
        double slowed = x < 0.0 ? x : x < 4.0 ? x - x * x / 8.0 : 2.0;
        ASSERT_REAL(98.0 + slowed, mdl_saturation(&rounded, (mdl_real)(98.0 + x)));
        ASSERT_REAL(-18.0 - slowed, mdl_saturation(&rounded, (mdl_real)(-18.0 - x)));
    }
    ASSERT_REAL(100.0, mdl_saturation(&rounded, MDL_C(3e38)));
    ASSERT_REAL(-20.0, mdl_saturation(&rounded, MDL_C(-3e38)));
    ASSERT_REAL(40.0, mdl_saturation(&rounded, MDL_C(40.0)));
}

void test_a_power_without_a_width_is_hard(void)
{
    rounded.knee_volts = MDL_C(0.0);
    ASSERT_REAL(99.5, mdl_saturation(&rounded, MDL_C(99.5)));
    ASSERT_REAL(100.0, mdl_saturation(&rounded, MDL_C(100.5)));
}

void test_the_slew_limit(void)
{
    const mdl_slew_params even = {MDL_C(0.5), MDL_C(0.5), MDL_C(0.0), MDL_C(0.0), MDL_C(0.0)};
    ASSERT_REAL(5.5, mdl_slew(&even, MDL_C(5.0), MDL_C(9.0), MDL_C(0.0)));
    ASSERT_REAL(4.5, mdl_slew(&even, MDL_C(5.0), MDL_C(1.0), MDL_C(0.0)));
    ASSERT_REAL(5.25, mdl_slew(&even, MDL_C(5.0), MDL_C(5.25), MDL_C(0.0)));
}

/* A lag of e knees becomes asinh(decay * sinh(e)) while the command rests. */
void test_a_slew_limit_with_a_knee(void)
{
    const mdl_real half = MDL_C(0.693147180559945309); /* ln 2: S h over a knee of 1 V */
    const mdl_slew_params soft = {half, half, MDL_C(1.0), MDL_C(0.5), MDL_C(0.557304959111036593)};
    /* sinh(ln 4) = 15/8; its half, 15/16, is the sinh of 0.8364818... */
    ASSERT_SETTLED(
        5.0 - 0.8364818689255533,
        mdl_slew(&soft, MDL_C(5.0) - MDL_C(1.38629436111989062), MDL_C(5.0), MDL_C(0.0)));
    ASSERT_SETTLED(
        5.0 + 0.8364818689255533,
        mdl_slew(&soft, MDL_C(5.0) + MDL_C(1.38629436111989062), MDL_C(5.0), MDL_C(0.0)));
    ASSERT_SETTLED(5.0 - 0.0005, mdl_slew(&soft, MDL_C(4.999), MDL_C(5.0), MDL_C(0.0)));
    ASSERT_SETTLED(0.693147181, mdl_slew(&soft, MDL_C(0.0), MDL_C(90.0), MDL_C(0.0)));
    ASSERT_SETTLED(-0.693147181, mdl_slew(&soft, MDL_C(0.0), MDL_C(-90.0), MDL_C(0.0)));
    /* A command that has risen evenly and slowly: the lag of one pole. */
    ASSERT_SETTLED(0.001 * (1.0 - 0.5 / 0.693147181),
                   mdl_slew(&soft, MDL_C(0.0), MDL_C(0.001), MDL_C(0.001)));
}

void test_a_slew_limit_may_differ_for_falling_commands(void)
{
    const mdl_slew_params uneven = {MDL_C(0.5), MDL_C(0.125), MDL_C(0.0), MDL_C(0.0), MDL_C(0.0)};
    ASSERT_REAL(5.5, mdl_slew(&uneven, MDL_C(5.0), MDL_C(9.0), MDL_C(0.0)));
    ASSERT_REAL(4.875, mdl_slew(&uneven, MDL_C(5.0), MDL_C(1.0), MDL_C(0.0)));
    ASSERT_REAL(5.25, mdl_slew(&uneven, MDL_C(5.0), MDL_C(5.25), MDL_C(0.0)));
    ASSERT_REAL(4.9375, mdl_slew(&uneven, MDL_C(5.0), MDL_C(4.9375), MDL_C(0.0)));
}
