/* Additional terms of a swing, g[k-1][j-1] s'^j m'^k, on a range of 8 volts. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_shape.h"

void setUp(void)
{
}

void tearDown(void)
{
}

void test_each_coefficient_weighs_its_own_term(void)
{
    /* From 3 to 7: s' = 1/2, m' = 10/8 - 1 = 1/4. */
    uint16_t j, k;
    for (k = 0; k < MDL_SHAPE_ORDER; k++) {
        for (j = 0; j < MDL_SHAPE_ORDER; j++) {
            mdl_shape shape = {MDL_C(0.125), {{MDL_C(0.0)}}, {MDL_C(0.0)}};
            shape.g[k][j] = MDL_C(3.0);
            ASSERT_REAL(3.0 * pow(0.5, j + 1) * pow(0.25, k + 1),
                        mdl_shape_swing(&shape, MDL_C(3.0), MDL_C(7.0)));
        }
    }
}

void test_terms_are_added(void)
{
    /* From 0 to 2: s' = 1/4, m' = -3/4: 2 * 1/4 * -3/4 + 4 * 1/16 * 9/16. */
    mdl_shape shape = {MDL_C(0.125), {{MDL_C(2.0)}, {MDL_C(0.0), MDL_C(4.0)}}, {MDL_C(0.0)}};
    ASSERT_REAL(-0.375 + 0.140625, mdl_shape_swing(&shape, MDL_C(0.0), MDL_C(2.0)));
}

void test_nothing_is_added_to_the_major_loop_or_to_no_swing(void)
{
    mdl_shape shape = {MDL_C(0.125), {{MDL_C(2.0), MDL_C(5.0)}, {MDL_C(3.0)}}, {MDL_C(0.0)}};
    ASSERT_REAL(0.0, mdl_shape_swing(&shape, MDL_C(0.0), MDL_C(8.0)));
    ASSERT_REAL(0.0, mdl_shape_swing(&shape, MDL_C(3.0), MDL_C(3.0)));
}

void test_the_share_by_which_a_minor_loop_is_wider(void)
{
    const mdl_shape shape = {MDL_C(0.125), {{MDL_C(0.0)}}, {MDL_C(0.5), MDL_C(2.0)}};
    ASSERT_REAL(0.75, mdl_shape_widening(&shape, MDL_C(2.0))); /* (0.5 + 2 * 1/4) 3/4 */
    ASSERT_REAL(0.0, mdl_shape_widening(&shape, MDL_C(8.0)));
    ASSERT_REAL(0.0, mdl_shape_widening(&shape, MDL_C(9.0)));
}
