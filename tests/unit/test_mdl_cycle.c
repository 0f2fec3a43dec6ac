/*
 * Period and amplitude from turning points, on parabolas and straight lines, whose vertices are
 * exact, and on a sine.
 */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_cycle.h"

static mdl_cycle cycle;

static int step(double v)
{
    return mdl_cycle_step(&cycle, MDL_C(0.25), (mdl_real)v);
}

void setUp(void)
{
    mdl_cycle_start(&cycle, MDL_C(0.0));
}

void tearDown(void)
{
}

void test_a_turn_counts_when_the_input_came_back_by_more_than_the_dead_band(void)
{
    TEST_ASSERT_FALSE(step(1.0));
    TEST_ASSERT_FALSE(step(2.0));
    TEST_ASSERT_FALSE(step(1.75));
    TEST_ASSERT_TRUE(step(1.5));
    ASSERT_REAL(1.0, cycle.amplitude_volts);
}

void test_one_half_period_is_doubled_and_two_are_added(void)
{
    const double v[] = {1.0, 2.0, 1.0, 0.0, -1.0, -2.0, -1.0};
    uint16_t turns = 0;
    uint16_t i;
    for (i = 0; i < 7u; i++) {
        turns = (uint16_t)(turns + step(v[i]));
        if (i == 2u) {
            ASSERT_REAL(4.0, cycle.period);
        }
    }
    /* Peaks at 2 and 6 samples: 2 + 4. */
    TEST_ASSERT_EQUAL_UINT16(2, turns);
    ASSERT_REAL(6.0, cycle.period);
    ASSERT_REAL(2.0, cycle.amplitude_volts);
}

void test_a_vertex_between_samples_is_found(void)
{
    /* -(t - 2.25)^2 at t = 0, 1, 2, 3: from -5.0625 on; peak at 2.25. */
    const double at = 2.25;
    int t;
    mdl_cycle_start(&cycle, (mdl_real)(-at * at));
    for (t = 1; t <= 3; t++) {
        TEST_ASSERT_EQUAL_INT(t == 3, step(-(t - at) * (t - at)));
    }
    ASSERT_REAL(4.5, cycle.period);
}

void test_what_stays_within_the_dead_band_does_not_turn(void)
{
    int i;
    for (i = 0; i < 100; i++) {
        TEST_ASSERT_FALSE(step(i % 2 == 0 ? 0.25 : -0.25));
    }
    TEST_ASSERT_FALSE(step(-4.0));
    for (i = 0; i < 100; i++) {
        TEST_ASSERT_FALSE(step(i % 2 == 0 ? -3.75 : -4.0));
    }
    ASSERT_REAL(0.0, cycle.period);
}

void test_turns_in_successive_samples_are_a_period_of_two(void)
{
    int i;
    for (i = 0; i < 10; i++) {
        (void)step(i % 2 == 0 ? 4.0 : -4.0);
    }
    ASSERT_REAL(2.0, cycle.period);
    ASSERT_REAL(4.0, cycle.amplitude_volts);
}

void test_a_plateau_counts_from_its_first_sample_on_both_sides(void)
{
    const double up[] = {1.0, 2.0, 3.0, 3.0, 3.0, 2.0, 1.0};
    const double down[] = {0.0, -1.0, -1.0, -1.0, 0.0};
    uint16_t i, round;
    for (round = 0; round < 3u; round++) {
        for (i = 0; i < 7u; i++) {
            (void)step(up[i]);
        }
        for (i = 0; i < 5u; i++) {
            (void)step(down[i]);
        }
    }
    ASSERT_REAL(12.0, cycle.period);
}

void test_a_sine_of_a_broken_number_of_samples(void)
{
    const double period = 33.3333;
    int t;
    for (t = 0; t < 400; t++) {
        (void)step(50.0 * sin(6.283185307179586 * t / period));
    }
    TEST_ASSERT_DOUBLE_WITHIN(2e-3 * period, period, (double)cycle.period);
    TEST_ASSERT_DOUBLE_WITHIN(0.005 * 50.0, 50.0, (double)cycle.amplitude_volts);
}

void test_a_long_rest_does_not_break_it(void)
{
    (void)step(4.0);
    cycle.since_turn = MDL_C(8388607.0);
    (void)step(4.0);
    (void)step(4.0);
    ASSERT_REAL(8388608.0, cycle.since_turn);
    TEST_ASSERT_TRUE(step(0.0));
    ASSERT_REAL(2.0, cycle.amplitude_volts);
}
