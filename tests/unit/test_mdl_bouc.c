/* The part by Bouc and Wen: against solutions that can be written down, n = 1. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_bouc.h"
#include "mdl_power.h"

#include <string.h>

static mdl_bouc state;
static mdl_bouc_params params;

/* Of the midpoint rule with steps of 1/16, also across z = 0, where the slope has a kink. */
#define ASSERT_CLOSE(expected, actual) TEST_ASSERT_DOUBLE_WITHIN(6e-4, expected, (double)(actual))

static mdl_real step(double x)
{
    return mdl_bouc_step(&state, &params, (mdl_real)x);
}

void setUp(void)
{
    const mdl_bouc_params plain = {MDL_C(1.0), MDL_C(0.5), MDL_C(1.0), MDL_C(0.0)};
    params = plain;
    memset(&state, 0, sizeof state);
}

void tearDown(void)
{
}

void test_a_rise_approaches_its_limit(void)
{
    /* dz/dw = 1 - z. */
    ASSERT_CLOSE(1.0 - exp(-1.5), step(3.0));
    ASSERT_CLOSE(1.0 - exp(-4.0), step(8.0));
}

void test_one_jump_and_many_steps_come_to_the_same(void)
{
    mdl_real y = MDL_C(0.0);
    int i;
    for (i = 1; i <= 96; i++) {
        y = step(8.0 * i / 96.0);
    }
    ASSERT_CLOSE(1.0 - exp(-4.0), y);
}

void test_a_turn_starts_with_twice_the_slope_of_rest(void)
{
    /* Behind a rise to z0: dz/dw = 1 + z with dw < 0 until z = 0, then 1 - |z|. */
    double z0 = 1.0 - exp(-4.0);
    double to_zero = log(1.0 + z0);
    (void)step(8.0);
    ASSERT_CLOSE((1.0 + z0) * exp(-0.25) - 1.0, step(7.5));
    ASSERT_CLOSE(-(1.0 - exp(-(1.0 - to_zero))), step(6.0));
}

void test_gamma_tells_loading_from_unloading(void)
{
    double z0 = (1.0 - exp(-1.5 * 4.0)) / 1.5;
    params.gamma = MDL_C(0.5);
    ASSERT_CLOSE(z0, step(8.0));                                  /* dz/dw = 1 - 1.5 z */
    ASSERT_CLOSE((2.0 + z0) * exp(-0.5 * 0.25) - 2.0, step(7.5)); /* 1 + z / 2 */
}

void test_a_power_of_two(void)
{
    params.power = MDL_C(2.0);
    ASSERT_CLOSE(tanh(1.0), step(2.0)); /* dz/dw = 1 - z^2 */
}

void test_size_and_rest(void)
{
    params.size_um = MDL_C(-4.0);
    state.rest = MDL_C(-0.5);
    TEST_ASSERT_DOUBLE_WITHIN(2e-3, -4.0 * (1.0 - exp(-1.5) + 0.5), (double)step(3.0));
}

void test_the_same_input_again_changes_nothing(void)
{
    mdl_real y = step(3.0);
    mdl_real z = state.z;
    ASSERT_REAL(y, step(3.0));
    ASSERT_REAL(z, state.z);
}

void test_without_a_reach_it_does_nothing(void)
{
    params.per_volt = MDL_C(0.0);
    ASSERT_REAL(0.0, step(8.0));
}

void test_a_jump_takes_so_many_steps_at_most(void)
{
    params.per_volt = MDL_C(1e6);
    ASSERT_CLOSE(1.0, step(1.5));
    ASSERT_CLOSE(-1.0, step(-1.5));
    TEST_ASSERT_TRUE(state.x_volts == MDL_C(-1.5));
}

void test_loops_wander_to_the_middle(void)
{
    /* What Madelung's rules forbid: repeated minor loops do not close. */
    mdl_real first, last;
    int i;
    (void)step(8.0);
    (void)step(7.0);
    first = step(8.0);
    for (i = 0; i < 20; i++) {
        (void)step(7.0);
        last = step(8.0);
    }
    TEST_ASSERT_TRUE(first - last > MDL_C(0.1));
}
