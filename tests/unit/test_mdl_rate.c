/*
 * The law of the rate. The filter passes the rise of one sample on as -rise, so that v = 2 rise.
 * Powers of two are exact.
 */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_lag.h"
#include "mdl_power.h"
#include "mdl_rate.h"

#ifdef MDL_REAL_DOUBLE
#define LAW_ERROR 2e-8
#else
#define LAW_ERROR 2e-6
#endif

static mdl_lag state;
static mdl_rate_params params;

static mdl_real law(mdl_real rise)
{
    return mdl_rate_law(&state, &params, rise);
}

static void use(mdl_real power, mdl_real v_knee, mdl_real at_knee)
{
    params.power = power;
    params.v_knee = v_knee;
    params.at_knee = at_knee;
    mdl_lag_reset(&state);
}

void setUp(void)
{
    const mdl_rate_params none = {{MDL_C(1.0), MDL_C(1.0)},
                                  MDL_C(-2.0),
                                  MDL_C(2.0),
                                  MDL_C(0.0),
                                  MDL_C(0.0),
                                  MDL_C(0.0),
                                  MDL_C(0.0),
                                  MDL_C(0.0),
                                  MDL_C(0.0),
                                  MDL_C(0.0),
                                  0,
                                  {MDL_C(0.0), MDL_C(0.0), MDL_C(0.0)}};
    params = none;
    mdl_lag_reset(&state);
}

void tearDown(void)
{
}

void test_signed_power(void)
{
    ASSERT_REAL(16.0, mdl_rate_signed_power(MDL_C(4.0), MDL_C(2.0)));
    ASSERT_REAL(-2.0, mdl_rate_signed_power(MDL_C(-4.0), MDL_C(0.5)));
    ASSERT_REAL(0.0, mdl_rate_signed_power(MDL_C(0.0), MDL_C(0.5)));
}

void test_without_a_knee_the_law_is_v_to_the_p_with_the_sign_of_v(void)
{
    ASSERT_REAL(16.0, law(MDL_C(2.0)));
    ASSERT_REAL(-16.0, law(MDL_C(-2.0)));
    use(MDL_C(0.5), MDL_C(0.0), MDL_C(0.0));
    ASSERT_REAL(2.0, law(MDL_C(2.0)));
    ASSERT_REAL(0.0, law(MDL_C(0.0)));
}

void test_with_a_knee_the_law_is_shifted_to_it_and_to_0_at_rest(void)
{
    use(MDL_C(0.5), MDL_C(4.0), MDL_C(2.0));
    ASSERT_REAL(2.0, law(MDL_C(6.0))); /* sqrt(12 + 4) - 2 */
    ASSERT_REAL(-2.0, law(MDL_C(-6.0)));
    ASSERT_REAL(0.0, law(MDL_C(0.0)));
    use(MDL_C(2.0), MDL_C(2.0), MDL_C(4.0));
    ASSERT_REAL(12.0, law(MDL_C(1.0))); /* 4^2 - 4 */
    ASSERT_REAL(-12.0, law(MDL_C(-1.0)));
}

void test_the_law_along_a_knee(void)
{
    /* The error of the power, of its size. */
    const mdl_real powers[] = {MDL_C(0.125), MDL_C(0.5), MDL_C(0.75), MDL_C(1.5)};
    const mdl_real knees[] = {MDL_C(0.0078125), MDL_C(0.375), MDL_C(3.0)};
    uint16_t i, k;
    double rise;
    for (i = 0; i < 4u; i++) {
        for (k = 0; k < 3u; k++) {
            double p = (double)powers[i];
            double knee = (double)knees[k];
            use(powers[i], knees[k], (mdl_real)pow(knee, p));
            for (rise = 0.0009765625; rise < 10.0; rise *= 1.5) {
                double v = 2.0 * (double)(mdl_real)rise;
                double size = pow(v + knee, p);
                double expected = size - pow(knee, p);
                TEST_ASSERT_DOUBLE_WITHIN(LAW_ERROR * size, expected, (double)law((mdl_real)rise));
                TEST_ASSERT_DOUBLE_WITHIN(LAW_ERROR * size, -expected,
                                          (double)law(-(mdl_real)rise));
            }
        }
    }
}

void test_a_small_power_with_a_knee_goes_as_a_logarithm(void)
{
    /* ((v + v_0)^p - v_0^p) / p, v_0 = 1: from v = 3 to 15 as much as from 0 to 3. */
    double at_3, at_15;
    use(MDL_C(0.0078125), MDL_C(1.0), MDL_C(1.0));
    at_3 = (double)law(MDL_C(1.5));
    at_15 = (double)law(MDL_C(7.5));
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 2.0, at_15 / at_3);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, log(4.0), at_3 * 128.0);
}

void test_a_speed_gives_no_negative_law(void)
{
    /* At rest, whatever the roundings of the power and of at_knee are. */
    double knee, p;
    for (p = 0.1; p < 4.0; p += 0.3) {
        for (knee = 1e-25; knee < 100.0; knee *= 3.7) {
            double at_knee = pow((double)(mdl_real)knee, (double)(mdl_real)p);
            use((mdl_real)p, (mdl_real)knee, (mdl_real)at_knee);
            TEST_ASSERT_TRUE(law(MDL_C(0.0)) >= MDL_C(0.0));
        }
    }
}

void test_the_velocity_is_filtered(void)
{
    /* decay 1/2: e = -1, then -1/2: v = 2, then 1. */
    params.filter.decay = MDL_C(0.5);
    params.power = MDL_C(1.0);
    ASSERT_REAL(2.0, law(MDL_C(1.0)));
    ASSERT_REAL(1.0, law(MDL_C(0.0)));
    ASSERT_REAL(-2.0, law(MDL_C(-1.25)));
}
