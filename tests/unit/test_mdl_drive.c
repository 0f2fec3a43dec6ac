/* Saturation and slew limit. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_drive.h"
#include "mdl_power.h"

static const mdl_saturation_params hard = {MDL_C(100.0), MDL_C(-20.0), MDL_C(0.0)};
static const mdl_saturation_params soft = {MDL_C(100.0), MDL_C(-20.0), MDL_C(0.5)};

/* Volts near 100, and the error of mdl_softplus times the knee. */
#define ASSERT_SOFT(expected, actual)                                                              \
    TEST_ASSERT_DOUBLE_WITHIN(160.0 * MDL_TEST_EPSILON + 4e-8, expected, (double)(actual))

void setUp(void)
{
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

void test_the_slew_limit(void)
{
    ASSERT_REAL(5.5, mdl_slew(MDL_C(0.5), MDL_C(5.0), MDL_C(9.0)));
    ASSERT_REAL(4.5, mdl_slew(MDL_C(0.5), MDL_C(5.0), MDL_C(1.0)));
    ASSERT_REAL(5.25, mdl_slew(MDL_C(0.5), MDL_C(5.0), MDL_C(5.25)));
    ASSERT_REAL(5.0, mdl_slew(MDL_C(0.0), MDL_C(5.0), MDL_C(9.0)));
}
