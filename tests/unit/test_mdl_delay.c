/* The delay's ring and its interpolation. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_delay.h"

static mdl_delay delay;

void setUp(void)
{
    mdl_delay_reset(&delay, MDL_C(-3.0));
}

void tearDown(void)
{
}

/* Whole samples: the input comes out that many samples later, the value at rest before. */
static void delays_by(uint16_t whole)
{
    mdl_delay_params params = {0, {MDL_C(1.0), MDL_C(0.0), MDL_C(0.0), MDL_C(0.0)}};
    uint16_t i;
    params.whole = whole;
    mdl_delay_reset(&delay, MDL_C(-3.0));
    for (i = 0; i < 3u * MDL_DELAY_MAX; i++) {
        ASSERT_REAL(i < whole ? -3.0 : (double)i - (double)whole,
                    mdl_delay_step(&delay, &params, (mdl_real)i));
    }
}

void test_whole_samples_up_to_the_longest(void)
{
    uint16_t whole;
    for (whole = 0; whole <= MDL_DELAY_MAX - 4; whole++) {
        delays_by(whole);
    }
}

void test_each_weight_belongs_to_its_sample(void)
{
    mdl_delay_params params = {1, {MDL_C(1.0), MDL_C(10.0), MDL_C(100.0), MDL_C(1000.0)}};
    uint16_t i;
    for (i = 1; i <= 4u; i++) {
        (void)mdl_delay_step(&delay, &params, (mdl_real)i);
    }
    ASSERT_REAL(4 + 30 + 200 + 1000, mdl_delay_step(&delay, &params, MDL_C(5.0)));
}

void test_third_order_lagrange_is_exact_for_a_cubic(void)
{
    /* 1.5 samples: the weights of the middle of four are (-1, 9, 9, -1) / 16. */
    mdl_delay_params params = {0, {MDL_C(-0.0625), MDL_C(0.5625), MDL_C(0.5625), MDL_C(-0.0625)}};
    int i;
    for (i = 0; i < 40; i++) {
        mdl_real y = mdl_delay_step(&delay, &params, (mdl_real)(i * i * i));
        if (i >= 3) {
            ASSERT_REAL((i - 1.5) * (i - 1.5) * (i - 1.5), y);
        }
    }
}
