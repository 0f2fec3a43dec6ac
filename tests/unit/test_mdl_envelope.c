/*
 * The envelopes of a generalised play, on a range of 8 volts: in the middle w lags 1 V behind a
 * rising command, and half a volt behind a falling one.
 */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_envelope.h"

static mdl_envelope_params params;
static mdl_real w;

static mdl_real step(mdl_real x)
{
    w = mdl_envelope_step(&params, w, x);
    return w;
}

void setUp(void)
{
    const mdl_envelope_params plain = {MDL_C(0.125), MDL_C(1.0), MDL_C(0.0),
                                       MDL_C(0.5),   MDL_C(0.0), MDL_C(0.0)};
    params = plain;
    w = MDL_C(0.0);
}

void tearDown(void)
{
}

void test_a_rising_command_is_followed_along_the_rising_envelope(void)
{
    ASSERT_REAL(1.25, step(MDL_C(2.0))); /* 3/4 of a volt behind: a parabola */
    ASSERT_REAL(3.0, step(MDL_C(4.0)));
    ASSERT_REAL(5.25, step(MDL_C(6.0)));
}

void test_a_falling_command_is_followed_along_the_falling_envelope(void)
{
    (void)step(MDL_C(8.0));
    ASSERT_REAL(6.375, step(MDL_C(6.0)));
    ASSERT_REAL(4.5, step(MDL_C(4.0)));
    ASSERT_REAL(2.375, step(MDL_C(2.0)));
}

void test_between_the_envelopes_nothing_moves(void)
{
    (void)step(MDL_C(4.0));
    ASSERT_REAL(3.0, step(MDL_C(3.5)));
    ASSERT_REAL(3.0, step(MDL_C(4.0))); /* at the edge */
    ASSERT_REAL(3.0, step(MDL_C(2.75)));
    ASSERT_REAL(3.0, step(MDL_C(3.75)));
    TEST_ASSERT_TRUE(step(MDL_C(2.0)) < MDL_C(3.0)); /* the gap is 1.5 V wide at most */
}

/* A loop over x = 2 to 6 from the left, then all that repeats of it. */
void test_minor_loops_close_at_once(void)
{
    int i;
    (void)step(MDL_C(6.0));
    for (i = 0; i < 3; i++) {
        ASSERT_REAL(2.375, step(MDL_C(2.0)));
        ASSERT_REAL(5.25, step(MDL_C(6.0)));
    }
}

void test_one_jump_and_many_steps_come_to_the_same(void)
{
    int i;
    for (i = 1; i <= 64; i++) {
        (void)step((mdl_real)i * MDL_C(0.0625));
    }
    ASSERT_REAL(3.0, w);
    for (i = 63; i >= 16; i--) {
        (void)step((mdl_real)i * MDL_C(0.0625));
    }
    ASSERT_REAL(1.21875, w); /* 1 + 7/32 */
}

void test_both_envelopes_end_where_the_range_does(void)
{
    /* Whatever was before: what is there is the command. */
    (void)step(MDL_C(4.0));
    ASSERT_REAL(8.0, step(MDL_C(8.0)));
    (void)step(MDL_C(4.0));
    ASSERT_REAL(0.0, step(MDL_C(0.0)));
}

void test_beyond_the_range_the_command_passes(void)
{
    const mdl_real outside[] = {MDL_C(9.5), MDL_C(8.0), MDL_C(12.0), MDL_C(-0.5), MDL_C(-3.0)};
    uint16_t i;
    for (i = 0; i < sizeof outside / sizeof outside[0]; i++) {
        ASSERT_REAL(outside[i], step(outside[i]));
    }
    ASSERT_REAL(3.0, step(MDL_C(4.0))); /* back in the range, from below */
    (void)step(MDL_C(9.5));
    ASSERT_REAL(4.5, step(MDL_C(4.0)));
}

void test_a_skew_moves_the_lag_to_one_half_of_the_range(void)
{
    /* The middle keeps its lag, and two places as far from it together theirs. */
    params.rise_skew = MDL_C(1.0);
    ASSERT_REAL(2.0 - 0.375, step(MDL_C(2.0)));
    ASSERT_REAL(3.0, step(MDL_C(4.0)));
    ASSERT_REAL(6.0 - 1.125, step(MDL_C(6.0)));
    params.fall_skew = MDL_C(-0.5);
    (void)step(MDL_C(8.0));
    ASSERT_REAL(6.0 + 0.28125, step(MDL_C(6.0)));
    ASSERT_REAL(4.5, step(MDL_C(4.0)));
    ASSERT_REAL(2.0 + 0.46875, step(MDL_C(2.0)));
}

void test_a_full_skew_leaves_one_end_almost_without_a_lag(void)
{
    /* 4 z (1 - z) V without it; with it the lag is less by 2 z. */
    const double z = 0.0078125;
    params.rise_skew = MDL_C(1.0);
    ASSERT_NEAR(8.0 * z - 8.0 * z * z * (1.0 - z), step(MDL_C(0.0625)), 1.0);
}

/* The command seen from the top, with the envelopes exchanged and their skews turned about. */
void test_mirrored_envelopes_answer_a_mirrored_command_with_the_mirror_image(void)
{
    const mdl_envelope_params one = {MDL_C(0.125), MDL_C(1.0), MDL_C(0.5),
                                     MDL_C(0.5),   MDL_C(1.0), MDL_C(0.0)};
    const mdl_envelope_params other = {MDL_C(0.125), MDL_C(0.5),  MDL_C(-1.0),
                                       MDL_C(1.0),   MDL_C(-0.5), MDL_C(0.0)};
    const mdl_real x[] = {MDL_C(6.0), MDL_C(3.0), MDL_C(5.0), MDL_C(1.5), MDL_C(7.0)};
    mdl_real at = MDL_C(0.0);
    mdl_real mirrored = MDL_C(8.0);
    uint16_t i;
    for (i = 0; i < sizeof x / sizeof x[0]; i++) {
        at = mdl_envelope_step(&one, at, x[i]);
        mirrored = mdl_envelope_step(&other, mirrored, MDL_C(8.0) - x[i]);
        ASSERT_NEAR(MDL_C(8.0) - at, mirrored, 8.0);
    }
}

void test_unequal_envelopes_break_the_central_symmetry_of_the_major_loop(void)
{
    /* Of a symmetric one the two branches lie equally far from the line in the middle. */
    mdl_real up = MDL_C(4.0) - step(MDL_C(4.0));
    mdl_real down;
    (void)step(MDL_C(8.0));
    down = step(MDL_C(4.0)) - MDL_C(4.0);
    ASSERT_REAL(0.5, up - down);
}

void test_the_lag_is_in_volts_whatever_the_range(void)
{
    params.per_volt = MDL_C(0.0625);
    ASSERT_REAL(7.0, step(MDL_C(8.0)));
    ASSERT_REAL(16.0, step(MDL_C(16.0)));
    ASSERT_REAL(8.5, step(MDL_C(8.0)));
}

void test_envelopes_without_a_size_let_everything_pass(void)
{
    const mdl_real x[] = {MDL_C(5.0), MDL_C(2.0), MDL_C(2.0), MDL_C(7.5), MDL_C(0.0), MDL_C(-1.0)};
    uint16_t i;
    params.rise_volts = MDL_C(0.0);
    params.rise_skew = MDL_C(1.0);
    params.fall_volts = MDL_C(0.0);
    params.fall_skew = MDL_C(-1.0);
    for (i = 0; i < sizeof x / sizeof x[0]; i++) {
        ASSERT_REAL(x[i], step(x[i]));
    }
}

void test_one_envelope_alone_lags_in_its_sense_only(void)
{
    params.fall_volts = MDL_C(0.0);
    ASSERT_REAL(3.0, step(MDL_C(4.0)));
    ASSERT_REAL(3.0, step(MDL_C(3.5)));
    ASSERT_REAL(2.5, step(MDL_C(2.5))); /* as soon as the command is below */
    params.fall_volts = MDL_C(0.5);
    params.rise_volts = MDL_C(0.0);
    (void)step(MDL_C(0.0));
    ASSERT_REAL(5.0, step(MDL_C(5.0)));
    ASSERT_REAL(4.5, step(MDL_C(4.0)));
    ASSERT_REAL(4.5, step(MDL_C(4.25)));
    ASSERT_REAL(4.75, step(MDL_C(4.75)));
}

void test_what_follows_is_left_to_the_caller(void)
{
    params.follow = MDL_C(1.0);
    ASSERT_REAL(3.0, step(MDL_C(4.0)));
}
