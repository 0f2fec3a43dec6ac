/* Powers without libm, within the errors that mdl_power.h states; libm in double is the judge. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_power.h"

#ifdef MDL_REAL_DOUBLE
#define EXP2_ERROR 8e-9
#define LOG2_ERROR 1.1e-9
#define SOFTPLUS_ERROR 3e-9
#else
#define EXP2_ERROR 2e-7
#define LOG2_ERROR 2e-7
#define SOFTPLUS_ERROR 2e-7
#endif

void setUp(void)
{
}

void tearDown(void)
{
}

void test_exp2_of_whole_numbers_is_exact(void)
{
    int n;
    for (n = -120; n <= 120; n++) {
        ASSERT_REAL(exp2(n), mdl_exp2((mdl_real)n));
    }
}

void test_exp2_between(void)
{
    int i;
    for (i = -12000; i <= 12000; i++) {
        mdl_real x = (mdl_real)i / MDL_C(100.0);
        double expected = exp2((double)x);
        TEST_ASSERT_DOUBLE_WITHIN(EXP2_ERROR * expected, expected, (double)mdl_exp2(x));
    }
}

void test_exp2_is_limited(void)
{
    ASSERT_REAL(exp2(120.0), mdl_exp2(MDL_C(120.5)));
    ASSERT_REAL(exp2(120.0), mdl_exp2(MDL_C(1e30)));
    ASSERT_REAL(exp2(-120.0), mdl_exp2(MDL_C(-1e30)));
}

void test_log2_of_powers_of_two_is_exact(void)
{
    int n;
    for (n = -120; n <= 120; n++) {
        ASSERT_REAL(n, mdl_log2((mdl_real)exp2(n)));
    }
}

void test_log2_near_1(void)
{
    int i;
    for (i = 500; i <= 2000; i++) {
        mdl_real x = (mdl_real)i / MDL_C(1000.0);
        TEST_ASSERT_DOUBLE_WITHIN(LOG2_ERROR, log2((double)x), (double)mdl_log2(x));
    }
}

void test_log2_far_from_1_rounds_its_result(void)
{
    double x;
    for (x = 1e-30; x < 1e30; x *= 1.37) {
        double expected = log2((double)(mdl_real)x);
        TEST_ASSERT_DOUBLE_WITHIN(LOG2_ERROR + MDL_TEST_EPSILON * fabs(expected), expected,
                                  (double)mdl_log2((mdl_real)x));
    }
}

void test_power_of_powers_of_two_is_exact(void)
{
    ASSERT_REAL(8.0, mdl_power(MDL_C(4.0), MDL_C(1.5)));
    ASSERT_REAL(0.0625, mdl_power(MDL_C(0.25), MDL_C(2.0)));
    ASSERT_REAL(1.0, mdl_power(MDL_C(1.0), MDL_C(0.3)));
}

void test_power_of_almost_nothing_is_zero(void)
{
    ASSERT_REAL(0.0, mdl_power(MDL_C(0.0), MDL_C(0.5)));
    ASSERT_REAL(0.0, mdl_power(MDL_C(8.6e-19), MDL_C(0.5)));
    TEST_ASSERT_TRUE(mdl_power(MDL_C(8.8e-19), MDL_C(0.5)) > MDL_C(9e-10));
}

void test_power_between(void)
{
    /* The error of the logarithm is multiplied by p ln 2, that of exp2 is added. */
    double x, p;
    for (p = 0.25; p <= 4.0; p += 0.25) {
        for (x = 1e-6; x < 1e6; x *= 1.7) {
            mdl_real rounded = (mdl_real)x;
            double expected = pow((double)rounded, p);
            double size = fabs(log2(x));
            double error = EXP2_ERROR + 0.7 * p * (LOG2_ERROR + 2.0 * MDL_TEST_EPSILON * size);
            TEST_ASSERT_DOUBLE_WITHIN(error * expected, expected,
                                      (double)mdl_power(rounded, (mdl_real)p));
        }
    }
}

void test_softplus(void)
{
    int i;
    for (i = -3000; i <= 3000; i++) {
        mdl_real x = (mdl_real)i / MDL_C(100.0);
        double expected = log1p(exp((double)x));
        TEST_ASSERT_DOUBLE_WITHIN(SOFTPLUS_ERROR * (1.0 + expected), expected,
                                  (double)mdl_softplus(x));
    }
    ASSERT_REAL(MDL_C(1e30), mdl_softplus(MDL_C(1e30)));
    ASSERT_REAL(0.0, mdl_softplus(MDL_C(-1e30)));
}
