/* One pole, against its step-by-step recursion and the closed form of its response. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_lag.h"

static mdl_lag lag;

void setUp(void)
{
    mdl_lag_reset(&lag);
}

void tearDown(void)
{
}

void test_the_recursion(void)
{
    /* a = 1/4: e[n+1] = e[n] / 4 - (1/2) rise */
    const mdl_lag_params params = {MDL_C(0.75), MDL_C(0.5)};
    ASSERT_REAL(0.0, mdl_lag_step(&lag, &params, MDL_C(0.0)));
    ASSERT_REAL(-4.0, mdl_lag_step(&lag, &params, MDL_C(8.0)));
    ASSERT_REAL(-1.0, mdl_lag_step(&lag, &params, MDL_C(0.0)));
    ASSERT_REAL(0.75, mdl_lag_step(&lag, &params, MDL_C(-2.0)));
    mdl_lag_reset(&lag);
    ASSERT_REAL(0.0, mdl_lag_step(&lag, &params, MDL_C(0.0)));
}

void test_a_ramp_is_followed_tau_behind(void)
{
    /* u = t: y = t - tau (1 - exp(-t / tau)). tau = 0.25 s, h = 0.125 s. */
    const double tau = 0.25, h = 0.125;
    mdl_lag_params params;
    int n;
    params.decay = (mdl_real)(1.0 - exp(-h / tau));
    params.ramp = (mdl_real)(tau / h * (1.0 - exp(-h / tau)));
    for (n = 1; n <= 100; n++) {
        ASSERT_NEAR(-tau * (1.0 - exp(-n * h / tau)), mdl_lag_step(&lag, &params, (mdl_real)h),
                    tau);
    }
}

void test_a_slow_pole_keeps_its_digits(void)
{
    /* 2^20 samples of a pole that loses 2^-30 a sample: (1 - 2^-30)^(2^20); plain float would stay.
     */
    const mdl_lag_params params = {MDL_C(1.0) / MDL_C(1073741824.0), MDL_C(1.0)};
    uint32_t n;
    (void)mdl_lag_step(&lag, &params, MDL_C(-1.0));
    for (n = 0; n < 1048576ul; n++) {
        (void)mdl_lag_step(&lag, &params, MDL_C(0.0));
    }
    ASSERT_NEAR(exp(1048576.0 * log1p(-1.0 / 1073741824.0)), lag.e, 1.0);
}
