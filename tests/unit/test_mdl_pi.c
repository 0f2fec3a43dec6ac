/*
 * Play operators and the asymmetric Prandtl-Ishlinskii model. Quarters are exact in every build.
 */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_pi.h"

static mdl_pi_params params;
static mdl_pi pi;

/* One operator of threshold r and weight 1. */
static void use_one(mdl_real r, uint16_t two_side)
{
    const mdl_pi_params none = {0, 0, {0}, {0}, MDL_C(0.0), MDL_C(0.0), MDL_C(0.0)};
    params = none;
    params.count = 1;
    params.two_side = two_side;
    params.threshold_volts[0] = r;
    params.weight[0] = MDL_C(1.0);
    mdl_pi_reset(&pi);
}

static mdl_real step(mdl_real v)
{
    return mdl_pi_step(&pi, &params, v, MDL_C(0.0));
}

void setUp(void)
{
    use_one(MDL_C(1.0), 0);
}

void tearDown(void)
{
}

void test_one_side_operator_is_eq_2(void)
{
    const mdl_real v[] = {MDL_C(0.5), MDL_C(3.0), MDL_C(2.5), MDL_C(1.5), MDL_C(2.0), MDL_C(3.25)};
    const mdl_real f[] = {MDL_C(0.0), MDL_C(2.0), MDL_C(2.0), MDL_C(1.5), MDL_C(1.5), MDL_C(2.25)};
    uint16_t i;
    for (i = 0; i < 6u; i++) {
        ASSERT_REAL(f[i], step(v[i]));
    }
}

void test_first_sample_is_eq_2_at_zero(void)
{
    /* max(v - r, min(v, 0)) */
    ASSERT_REAL(2.0, step(MDL_C(3.0)));
    mdl_pi_reset(&pi);
    ASSERT_REAL(-0.5, step(MDL_C(-0.5)));
    mdl_pi_reset(&pi);
    ASSERT_REAL(0.0, step(MDL_C(0.75)));
}

void test_two_side_operator_also_lets_the_input_rise_above_it(void)
{
    use_one(MDL_C(1.0), 1);
    ASSERT_REAL(2.0, step(MDL_C(3.0)));
    ASSERT_REAL(2.0, step(MDL_C(1.0)));
    ASSERT_REAL(1.5, step(MDL_C(0.5)));
    ASSERT_REAL(-1.0, step(MDL_C(-2.0)));
    ASSERT_REAL(-1.0, step(MDL_C(0.0)));
}

void test_the_model_is_eq_4(void)
{
    params.count = 2;
    params.threshold_volts[1] = MDL_C(2.0);
    params.weight[0] = MDL_C(0.5);
    params.weight[1] = MDL_C(0.25);
    params.cubic = MDL_C(-0.125);
    params.linear = MDL_C(2.0);
    params.at_zero_um = MDL_C(16.0);
    /* v = 4: operators 3 and 2; v = 3: they stay. */
    ASSERT_REAL(16.0 - 8.0 + 8.0 + 1.5 + 0.5, step(MDL_C(4.0)));
    ASSERT_REAL(16.0 - 3.375 + 6.0 + 1.5 + 0.5, step(MDL_C(3.0)));
}

void test_every_threshold_grows_by_the_widening(void)
{
    ASSERT_REAL(1.5, mdl_pi_step(&pi, &params, MDL_C(3.0), MDL_C(0.5)));
    ASSERT_REAL(2.0, mdl_pi_step(&pi, &params, MDL_C(3.0), MDL_C(0.0)));
}

void test_the_last_of_all_operators_works(void)
{
    uint16_t i;
    params.count = MDL_PLAYS_MAX;
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        params.threshold_volts[i] = (mdl_real)i;
        params.weight[i] = MDL_C(0.0);
    }
    params.weight[MDL_PLAYS_MAX - 1] = MDL_C(2.0);
    ASSERT_STATUS(MDL_OK, mdl_pi_check(&params));
    ASSERT_REAL(6.0, step((mdl_real)(MDL_PLAYS_MAX + 2)));
}

void test_bad_parameters_are_refused(void)
{
    int i;
    ASSERT_STATUS(MDL_OK, mdl_pi_check(&params));
    params.two_side = 2;
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_pi_check(&params));
    use_one(MDL_C(-0.5), 0);
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_pi_check(&params));
    use_one(MDL_C(0.0), 0);
    ASSERT_STATUS(MDL_OK, mdl_pi_check(&params));
    params.count = 2; /* the second threshold is 0 too */
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_pi_check(&params));
    params.count = MDL_PLAYS_MAX + 1;
    ASSERT_STATUS(MDL_ERR_CAPACITY, mdl_pi_check(&params));
    for (i = 0; i < 3; i++) {
        use_one(mdl_test_not_finite(i), 0);
        ASSERT_STATUS(MDL_ERR_NOT_FINITE, mdl_pi_check(&params));
        use_one(MDL_C(1.0), 0);
        params.weight[0] = mdl_test_not_finite(i);
        ASSERT_STATUS(MDL_ERR_NOT_FINITE, mdl_pi_check(&params));
        use_one(MDL_C(1.0), 0);
        params.linear = mdl_test_not_finite(i);
        ASSERT_STATUS(MDL_ERR_NOT_FINITE, mdl_pi_check(&params));
    }
}
