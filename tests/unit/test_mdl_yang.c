/*
 * The model of Yang et al. The velocity's filter passes the rise of one sample on as -rise, and
 * v_scale = -1: v' is the rise a sample. Most numbers are powers of two.
 */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_cycle.h"
#include "mdl_lag.h"
#include "mdl_major.h"
#include "mdl_pi.h"
#include "mdl_power.h"
#include "mdl_rate.h"
#include "mdl_shape.h"
#include "mdl_yang.h"

#include <string.h>

#define PI_2 6.283185307179586

static mdl_yang_params params;
static mdl_yang yang;

/* y_RI = v + F_1 + F_2 / 2, thresholds 1 and 3, on 0 to 8 volts. */
void setUp(void)
{
    memset(&params, 0, sizeof params);
    params.pi.count = 2;
    params.pi.threshold_volts[0] = MDL_C(1.0);
    params.pi.threshold_volts[1] = MDL_C(3.0);
    params.pi.weight[0] = MDL_C(1.0);
    params.pi.weight[1] = MDL_C(0.5);
    params.pi.linear = MDL_C(1.0);
    params.high_volts = MDL_C(8.0);
    params.margin_volts = MDL_C(1.0);
    params.k[0] = MDL_C(1.0);
    params.m[0] = MDL_C(1.0);
    params.hz_max = MDL_C(1024.0);
    params.harmonics = 1;
    params.lambda[0] = MDL_C(1.0);
    params.turn_volts = MDL_C(0.5);
    params.rate_hz = MDL_C(64.0);
    params.filter.decay = MDL_C(1.0);
    params.filter.ramp = MDL_C(1.0);
    params.v_scale = MDL_C(-1.0);
}

void tearDown(void)
{
}

static mdl_real begin(double u)
{
    mdl_real y = MDL_C(-99.0);
    ASSERT_STATUS(MDL_OK, mdl_yang_check(&params));
    ASSERT_STATUS(MDL_OK, mdl_yang_start(&yang, &params, (mdl_real)u, &y));
    return y;
}

static mdl_real step(double u)
{
    mdl_real y = MDL_C(-99.0);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, mdl_yang_step(&yang, &params, (mdl_real)u, &y));
    return y;
}

/* Frequency 1 / (2 pi) and amplitude 1 are given: Q = 1 but for a rounding. */
static void give_q_of_one(void)
{
    params.hz = (mdl_real)(1.0 / PI_2);
    params.amplitude_volts = MDL_C(1.0);
}

void test_with_k_1_and_c_0_it_is_eq_4_to_the_bit(void)
{
    mdl_pi pi;
    int i;
    give_q_of_one();
    params.center_um = MDL_C(3.3);
    params.pi.cubic = MDL_C(-0.013);
    params.pi.weight[0] = MDL_C(0.19);
    mdl_pi_reset(&pi);
    ASSERT_REAL(mdl_pi_step(&pi, &params.pi, MDL_C(4.0), MDL_C(0.0)), begin(4.0));
    for (i = 1; i < 300; i++) {
        double u = 4.0 + 3.9 * sin(0.3 * i) * cos(0.017 * i);
        ASSERT_REAL(mdl_pi_step(&pi, &params.pi, (mdl_real)u, MDL_C(0.0)), step(u));
    }
}

void test_k_scales_about_the_center(void)
{
    give_q_of_one();
    params.k[0] = MDL_C(0.5);
    /* v = 4: 4 + 3 + 0.5 */
    ASSERT_REAL(3.75, begin(4.0));
    params.center_um = MDL_C(2.5);
    ASSERT_REAL(2.5 + 0.5 * 5.0, begin(4.0));
}

void test_damping_is_c_v_over_q_to_the_m_with_the_sign_of_v(void)
{
    give_q_of_one();
    params.c_um[0] = MDL_C(0.25);
    params.m[0] = MDL_C(0.5);
    ASSERT_REAL(7.5, begin(4.0));
    ASSERT_NEAR(7.5, step(4.0), 8.0); /* at rest nothing is added */
    TEST_ASSERT_DOUBLE_WITHIN(4e-6, 18.0, (double)step(8.0));
    TEST_ASSERT_DOUBLE_WITHIN(4e-6, 9.5, (double)step(4.0));
}

void test_parameters_are_polynomials_of_the_frequency(void)
{
    params.hz = MDL_C(2.0);
    params.amplitude_volts = MDL_C(1.0);
    params.k[0] = MDL_C(1.0);
    params.k[1] = MDL_C(0.5);
    params.k[2] = MDL_C(0.25);
    params.k[3] = MDL_C(0.125); /* 1 + 1 + 1 + 1 */
    ASSERT_REAL(4.0 * 7.5, begin(4.0));
    params.hz_max = MDL_C(1.0); /* 1.875 */
    ASSERT_REAL(1.875 * 7.5, begin(4.0));
}

void test_harmonics_are_weighted_as_eq_14_says(void)
{
    mdl_real y;
    params.hz = MDL_C(1.0);
    params.amplitude_volts = (mdl_real)(1.0 / PI_2);
    params.harmonics = 3;
    params.lambda[0] = MDL_C(1.25);
    params.lambda[2] = MDL_C(-0.25);
    params.k[0] = MDL_C(0.0);
    params.k[1] = MDL_C(1.0); /* k(f) = f: 1.25 - 0.75 */
    ASSERT_REAL(0.5 * 7.5, begin(4.0));
    params.hz_max = MDL_C(2.0); /* 1.25 - 0.25 * 2 */
    ASSERT_REAL(0.75 * 7.5, begin(4.0));
    ASSERT_STATUS(MDL_EXTRAPOLATED, mdl_yang_step(&yang, &params, MDL_C(4.0), &y));
    params.k[1] = MDL_C(0.0);
    params.c_um[0] = MDL_C(1.0);
    params.c_um[1] = MDL_C(1.0); /* c(f) = 1 + f: 1.25 * 2 - 0.25 * 3; Q = 1, v' = 1 */
    (void)begin(4.0);
    TEST_ASSERT_DOUBLE_WITHIN(4e-6, 1.75, (double)step(5.0));
}

/* Triangle of amplitude 2 about 4 and a period of 16 samples: 4 Hz. */
static double triangle(int i)
{
    int at = i % 16;
    return 2.0 + 0.5 * (at < 8 ? at : 16 - at);
}

void test_frequency_and_amplitude_are_found_from_the_turning_points(void)
{
    mdl_real q;
    mdl_real y = MDL_C(0.0);
    int i;
    params.c_um[0] = MDL_C(-1.0);
    params.k[0] = MDL_C(0.0);
    params.k[1] = MDL_C(0.25); /* 1 at 4 Hz */
    (void)begin(triangle(0));
    for (i = 1; i < 9; i++) {
        TEST_ASSERT_FALSE(yang.cycle.period > MDL_C(0.0));
        y = step(triangle(i));
    }
    ASSERT_REAL(6.0 + 5.0 + 1.5, y); /* still the rate-independent model */
    for (i = 9; i < 64; i++) {
        y = step(triangle(i));
    }
    q = (mdl_real)(PI_2 * 4.0 * 2.0);
    ASSERT_REAL(16.0, yang.cycle.period);
    ASSERT_REAL(2.0, yang.cycle.amplitude_volts);
    /* Falling to 2.5 by 0.5: 2.5 + 2.5 + 2.5 / 2. */
    TEST_ASSERT_DOUBLE_WITHIN(4e-6, 2.5 + 2.5 + 1.25 + 0.5 / (double)q, (double)y);
}

void test_only_what_is_not_given_is_found(void)
{
    int i;
    params.hz = MDL_C(2.0);
    params.k[0] = MDL_C(0.5);
    ASSERT_REAL(3.5, begin(triangle(0)) + MDL_C(0.5)); /* amplitude not known: y_RI */
    for (i = 1; i < 64; i++) {
        (void)step(triangle(i));
    }
    ASSERT_NEAR(1.0 / (PI_2 * 2.0 * 2.0), (double)yang.per_q, 1.0);
}

void test_dynamic_thresholds_grow_with_the_velocity(void)
{
    params.widen_s = MDL_C(0.25);
    (void)begin(4.0);
    /* From 4 to 6: thresholds 1.5 and 3.5. */
    ASSERT_REAL(6.0 + 4.5 + 1.25, step(6.0));
    /* To 5: 1.25 and 3.25; the operators stay. */
    ASSERT_REAL(5.0 + 4.5 + 1.25, step(5.0));
}

void test_outside_the_range_it_extrapolates_and_clamps(void)
{
    mdl_real y;
    (void)begin(4.0);
    ASSERT_STATUS(MDL_EXTRAPOLATED, mdl_yang_step(&yang, &params, MDL_C(9.0), &y));
    ASSERT_REAL(9.0 + 8.0 + 3.0, y);
    ASSERT_STATUS(MDL_CLAMPED, mdl_yang_step(&yang, &params, MDL_C(20.0), &y));
    ASSERT_REAL(9.0 + 8.0 + 3.0, y);
    ASSERT_STATUS(MDL_EXTRAPOLATED, mdl_yang_step(&yang, &params, MDL_C(-1.0), &y));
    ASSERT_REAL(-1.0 - 1.0 - 0.5, y);
    ASSERT_STATUS(MDL_CLAMPED, mdl_yang_step(&yang, &params, MDL_C(-2.0), &y));
    ASSERT_REAL(-1.0 - 1.0 - 0.5, y);
}

void test_not_finite_input_is_refused_and_changes_nothing(void)
{
    mdl_yang before;
    mdl_real last;
    int i;
    (void)begin(4.0);
    last = step(5.0);
    before = yang;
    for (i = 0; i < 3; i++) {
        mdl_real y = MDL_C(-99.0);
        ASSERT_STATUS(MDL_ERR_NOT_FINITE,
                      mdl_yang_step(&yang, &params, mdl_test_not_finite(i), &y));
        ASSERT_REAL(last, y);
        TEST_ASSERT_EQUAL_MEMORY(&before, &yang, sizeof yang);
    }
}

static void assert_refused(mdl_status status)
{
    ASSERT_STATUS(status, mdl_yang_check(&params));
    setUp();
    ASSERT_STATUS(MDL_OK, mdl_yang_check(&params));
}

void test_bad_parameters_are_refused(void)
{
    params.pi.threshold_volts[1] = MDL_C(1.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.harmonics = 0;
    assert_refused(MDL_ERR_PARAMETER);
    params.harmonics = MDL_HARMONICS_MAX + 1;
    assert_refused(MDL_ERR_CAPACITY);
    params.high_volts = MDL_C(0.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.margin_volts = MDL_C(-1.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.hz_max = MDL_C(0.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.hz = MDL_C(-1.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.amplitude_volts = MDL_C(-1.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.turn_volts = MDL_C(0.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.rate_hz = MDL_C(0.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.v_scale = MDL_C(0.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.widen_s = MDL_C(-1.0);
    assert_refused(MDL_ERR_PARAMETER);
}

void test_powers_out_of_range_are_refused(void)
{
    params.m[0] = MDL_C(0.0);
    assert_refused(MDL_ERR_PARAMETER);
    params.m[0] = MDL_C(-0.5);
    assert_refused(MDL_ERR_PARAMETER);
    params.m[0] = MDL_C(4.5);
    assert_refused(MDL_ERR_PARAMETER);
    params.m[1] = MDL_C(-0.001); /* below 0 from 1000 Hz on, which may be found on line */
    assert_refused(MDL_ERR_PARAMETER);
    params.m[1] = MDL_C(-0.001);
    params.hz = MDL_C(500.0);
    ASSERT_STATUS(MDL_OK, mdl_yang_check(&params));
}

void test_parameters_that_are_not_finite_are_refused(void)
{
    mdl_real *const one[] = {&params.low_volts, &params.center_um,   &params.k[3],
                             &params.c_um[2],   &params.m[1],        &params.lambda[0],
                             &params.hz,        &params.widen_s,     &params.rate_hz,
                             &params.v_scale,   &params.pi.weight[1]};
    uint16_t k;
    int i;
    for (k = 0; k < sizeof one / sizeof one[0]; k++) {
        for (i = 0; i < 3; i++) {
            *one[k] = mdl_test_not_finite(i);
            assert_refused(MDL_ERR_NOT_FINITE);
        }
    }
}
