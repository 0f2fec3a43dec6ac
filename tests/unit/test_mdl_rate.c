/*
 * Rate dependence on f0 = x^2 um, [0, 8] volts. The filter passes the rise of one sample on as
 * -rise, so that v = 2 rise. Powers of two are exact.
 */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_lag.h"
#include "mdl_major.h"
#include "mdl_power.h"
#include "mdl_rate.h"
#include "mdl_shape.h"

static mdl_major major;
static mdl_lag state;
static mdl_rate_params params;

/* What the rate adds to y at x, after a rise of the input. */
static mdl_real added(mdl_real x, mdl_real rise, mdl_real y)
{
    return mdl_rate_added(&params, &major, mdl_rate_power(&state, &params, rise), x, y);
}

void setUp(void)
{
    const mdl_real c[] = {MDL_C(0.0), MDL_C(0.0), MDL_C(1.0)};
    const mdl_rate_params none = {
        {MDL_C(1.0), MDL_C(1.0)}, MDL_C(-2.0), MDL_C(2.0), MDL_C(0.0), MDL_C(0.0), MDL_C(0.0)};
    params = none;
    (void)mdl_major_init_polynomial(&major, MDL_C(8.0), c, 2);
    mdl_lag_reset(&state);
}

void tearDown(void)
{
}

void test_damping_is_c_v_to_the_p_with_the_sign_of_v(void)
{
    params.damping_um = MDL_C(0.5);
    /* |v| = 4: 0.5 * 16 */
    ASSERT_REAL(8.0, added(MDL_C(3.0), MDL_C(2.0), MDL_C(9.0)));
    ASSERT_REAL(-8.0, added(MDL_C(1.0), MDL_C(-2.0), MDL_C(5.0)));
    params.power = MDL_C(0.5);
    ASSERT_REAL(1.0, added(MDL_C(3.0), MDL_C(2.0), MDL_C(9.0)));
}

void test_widening_scales_the_distance_from_the_middle_of_the_major_loop(void)
{
    /* The branches x^2 and 64 - (8 - x)^2 have their middle at 8 x. */
    params.widening = MDL_C(0.25);
    /* y = 16 at x = 4 is 16 below it; |v|^p = 4. */
    ASSERT_REAL(-16.0, added(MDL_C(4.0), MDL_C(1.0), MDL_C(16.0)));
    /* y = 48, on the descending branch, is 16 above. */
    ASSERT_REAL(16.0, added(MDL_C(4.0), MDL_C(-1.0), MDL_C(48.0)));
}

void test_both_forms_add(void)
{
    params.damping_um = MDL_C(0.5);
    params.widening = MDL_C(0.25);
    ASSERT_REAL(-14.0, added(MDL_C(4.0), MDL_C(1.0), MDL_C(16.0)));
}

void test_at_rest_nothing_is_added(void)
{
    params.damping_um = MDL_C(0.5);
    params.widening = MDL_C(0.25);
    ASSERT_REAL(0.0, added(MDL_C(4.0), MDL_C(0.0), MDL_C(16.0)));
}

void test_the_velocity_is_filtered(void)
{
    /* decay 1/2: e = -1, then -1/2: v = 2, then 1. */
    params.filter.decay = MDL_C(0.5);
    params.power = MDL_C(1.0);
    params.damping_um = MDL_C(1.0);
    ASSERT_REAL(2.0, added(MDL_C(1.0), MDL_C(1.0), MDL_C(1.0)));
    ASSERT_REAL(1.0, added(MDL_C(1.0), MDL_C(0.0), MDL_C(1.0)));
}
