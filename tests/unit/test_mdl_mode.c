/* One flexure mode, against its recursion and the closed form of an undamped mode. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_mode.h"

static mdl_mode mode;

void setUp(void)
{
    mdl_mode_reset(&mode);
}

void tearDown(void)
{
}

void test_the_recursion(void)
{
    const mdl_mode_params params = {{{MDL_C(-0.5), MDL_C(0.25)}, {MDL_C(-0.25), MDL_C(-0.75)}},
                                    {MDL_C(-2.0), MDL_C(1.0)},
                                    MDL_C(0.5)};
    ASSERT_REAL(0.0, mdl_mode_step(&mode, &params, MDL_C(0.0)));
    ASSERT_REAL(-4.0, mdl_mode_step(&mode, &params, MDL_C(4.0))); /* e = -8, q = 4 */
    ASSERT_REAL(-8.0, mode.e);
    ASSERT_REAL(4.0, mode.q);
    ASSERT_REAL(-1.5, mdl_mode_step(&mode, &params, MDL_C(0.0))); /* e = -8 + 4 + 1 */
    ASSERT_REAL(3.0, mode.q);                                     /* 4 + 2 - 3 */
    mdl_mode_reset(&mode);
    ASSERT_REAL(0.0, mode.e);
    ASSERT_REAL(0.0, mode.q);
}

void test_an_undamped_mode_swings_about_a_ramp(void)
{
    /* e' = w q - 1, q' = -w e: e = -sin(w t) / w, q = (1 - cos(w t)) / w. w = 3 / s, h = 0.1 s. */
    const double w = 3.0, h = 0.1;
    const double c = cos(w * h), s = sin(w * h);
    mdl_mode_params params;
    int n;
    params.phi[0][0] = (mdl_real)(c - 1.0);
    params.phi[0][1] = (mdl_real)s;
    params.phi[1][0] = (mdl_real)-s;
    params.phi[1][1] = (mdl_real)(c - 1.0);
    params.gamma[0] = (mdl_real)(-s / (w * h));
    params.gamma[1] = (mdl_real)((1.0 - c) / (w * h));
    params.share = MDL_C(1.0);
    for (n = 1; n <= 100; n++) {
        ASSERT_NEAR(-sin(n * w * h) / w, mdl_mode_step(&mode, &params, (mdl_real)h), 1.0);
        ASSERT_NEAR((1.0 - cos(n * w * h)) / w, mode.q, 1.0);
    }
}
