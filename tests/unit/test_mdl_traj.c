/*
 * The trajectory, with f0 = x^2 um on [0, 8] volts unless a test says otherwise. By eq. (6) an
 * ascending curve from (a, y_a) is then y_a + (x - a)^2 and a descending one from (b, y_b) is
 * y_b - (b - x)^2. All values are small multiples of powers of two: no build rounds them.
 */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_major.h"
#include "mdl_shape.h"
#include "mdl_traj.h"

#include <string.h>

static mdl_tp_side left, right;
static mdl_major major;
static mdl_traj traj;

/* Steps to x and expects y, the turning points then held, and the status. */
#define STEP(x, y, count, status)                                                                  \
    do {                                                                                           \
        mdl_real got;                                                                              \
        ASSERT_STATUS(status, mdl_traj_step(&traj, (mdl_real)(x), &got));                          \
        ASSERT_REAL(y, got);                                                                       \
        TEST_ASSERT_EQUAL_UINT32(count, mdl_traj_turning_points(&traj));                           \
    } while (0)

static void use_polynomial(mdl_real range, mdl_real margin, const mdl_real *c, uint16_t degree)
{
    ASSERT_STATUS(MDL_OK, mdl_major_init_polynomial(&major, range, c, degree));
    ASSERT_STATUS(MDL_OK, mdl_traj_init(&traj, &major, &left, &right, margin));
}

static void use_square(mdl_real margin)
{
    const mdl_real c[] = {MDL_C(0.0), MDL_C(0.0), MDL_C(1.0)};
    use_polynomial(MDL_C(8.0), margin, c, 2);
}

void setUp(void)
{
    use_square(MDL_C(0.0));
}

void tearDown(void)
{
}

/* 0 -> 4 -> 1 -> 3 -> 2: two right and two left turning points, and A_0. */
static void nest(void)
{
    STEP(4.0, 16.0, 1, MDL_OK);
    STEP(1.0, 7.0, 2, MDL_OK);  /* 16 - 3^2 */
    STEP(3.0, 11.0, 3, MDL_OK); /* 7 + 2^2 */
    STEP(2.0, 10.0, 4, MDL_OK); /* 11 - 1^2 */
}

void test_init_starts_at_rest_with_A0(void)
{
    TEST_ASSERT_EQUAL_UINT32(1, mdl_traj_turning_points(&traj));
    STEP(0.0, 0.0, 1, MDL_OK);
}

void test_init_refuses_bad_margins_and_changes_nothing(void)
{
    mdl_traj before = traj;
    int i;
    for (i = 0; i < 3; i++) {
        ASSERT_STATUS(MDL_ERR_NOT_FINITE,
                      mdl_traj_init(&traj, &major, &left, &right, mdl_test_not_finite(i)));
    }
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_traj_init(&traj, &major, &left, &right, MDL_C(-0.5)));
    TEST_ASSERT_EQUAL_MEMORY(&before, &traj, sizeof traj);
}

void test_init_refuses_a_curve_that_overflows_within_the_margin(void)
{
    mdl_traj before = traj;
    const mdl_real huge = MDL_TEST_EPSILON < 1e-12 ? (mdl_real)1e200 : MDL_C(1e20);
    ASSERT_STATUS(MDL_ERR_PARAMETER, mdl_traj_init(&traj, &major, &left, &right, huge));
    TEST_ASSERT_EQUAL_MEMORY(&before, &traj, sizeof traj);
}

void test_first_sample_above_the_minimum_lies_on_f0(void)
{
    STEP(3.0, 9.0, 1, MDL_OK);
    STEP(2.0, 8.0, 2, MDL_OK); /* turned at (3, 9) */
}

void test_equation_6_on_every_curve_of_a_nested_path(void)
{
    nest();
    STEP(2.5, 10.25, 5, MDL_OK);    /* from A4 (2, 10): + 0.5^2 */
    STEP(2.25, 10.1875, 6, MDL_OK); /* from A5 (2.5, 10.25): - 0.25^2 */
}

void test_equation_6_with_constant_and_linear_terms(void)
{
    /* f0 = 2 + 3 x + x^2; a swing s moves y by 3 s + s^2. */
    const mdl_real c[] = {MDL_C(2.0), MDL_C(3.0), MDL_C(1.0)};
    use_polynomial(MDL_C(8.0), MDL_C(0.0), c, 2);
    STEP(0.0, 2.0, 1, MDL_OK);
    STEP(4.0, 30.0, 1, MDL_OK);
    STEP(1.0, 12.0, 2, MDL_OK); /* 30 - 18 */
    STEP(3.0, 22.0, 3, MDL_OK); /* 12 + 10 */
    STEP(0.0, 2.0, 0, MDL_OK);
}

void test_equation_6_of_degree_7(void)
{
    /* f0 = x^7: 2^7 up, then 1 back: 128 - 1, then 0.5 up: 127 + 2^-7. */
    const mdl_real c[] = {MDL_C(0.0), MDL_C(0.0), MDL_C(0.0), MDL_C(0.0),
                          MDL_C(0.0), MDL_C(0.0), MDL_C(0.0), MDL_C(1.0)};
    use_polynomial(MDL_C(2.0), MDL_C(0.0), c, 7);
    STEP(2.0, 128.0, 1, MDL_OK);
    STEP(1.0, 127.0, 2, MDL_OK);
    STEP(1.5, 127.0078125, 3, MDL_OK);
}

/*
 * f0 = 3 + x + x^2 + ... of every degree, on curves of length 1, 1/2 and 1/4, and on that of length
 * 3/4 and the first one again after two loops, and all, have been wiped out.
 */
void test_equation_6_of_every_degree(void)
{
    mdl_real y, c[MDL_DEGREE_MAX + 1];
    uint16_t k, degree;
    for (k = 0; k <= MDL_DEGREE_MAX; k++) {
        c[k] = MDL_C(1.0);
    }
    c[0] = MDL_C(3.0);
    for (degree = 0; degree <= MDL_DEGREE_MAX; degree++) {
        double half = 0.0, quarter = 0.0, most = 0.0; /* f0 - f0(0) at 1/2, 1/4 and 3/4 */
        for (k = 1; k <= degree; k++) {
            half += ldexp(1.0, -k);
            quarter += ldexp(1.0, -2 * k);
            most += pow(0.75, k);
        }
        use_polynomial(MDL_C(2.0), MDL_C(0.0), c, degree);
        STEP(1.0, 3.0 + degree, 1, MDL_OK);
        STEP(0.5, 3.0 + degree - half, 2, MDL_OK);
        STEP(0.75, 3.0 + degree - half + quarter, 3, MDL_OK);
        ASSERT_STATUS(MDL_OK, mdl_traj_step(&traj, MDL_C(0.625), &y));
        ASSERT_STATUS(MDL_OK, mdl_traj_step(&traj, MDL_C(0.6875), &y));
        STEP(0.25, 3.0 + degree - most, 2, MDL_OK);
        STEP(1.0, 3.0 + degree, 1, MDL_OK);
    }
}

void test_a_surpassed_right_turning_point_is_wiped_out_with_its_loop(void)
{
    nest();
    STEP(3.5, 13.25, 3, MDL_OK); /* on the curve of A2 (1, 7): 7 + 2.5^2 */
    STEP(5.0, 25.0, 1, MDL_OK);  /* on f0 */
}

void test_a_surpassed_left_turning_point_is_wiped_out_with_its_loop(void)
{
    nest();
    STEP(0.5, 3.75, 2, MDL_OK); /* on the curve of A1 (4, 16): 16 - 3.5^2 */
}

void test_input_equal_to_a_right_turning_point_surpasses_it(void)
{
    nest();
    STEP(3.0, 11.0, 3, MDL_OK);  /* A3 and A4 are gone, both curves meet in (3, 11) */
    STEP(2.5, 10.75, 4, MDL_OK); /* a new A3 lies at (3, 11) */
    STEP(4.0, 16.0, 1, MDL_OK);
}

void test_input_equal_to_a_left_turning_point_surpasses_it(void)
{
    nest();
    STEP(1.0, 7.0, 2, MDL_OK);
    STEP(2.0, 8.0, 3, MDL_OK); /* a new A2 lies at (1, 7) */
}

void test_return_to_the_minimum_empties_the_memory(void)
{
    nest();
    STEP(0.0, 0.0, 0, MDL_OK);
    STEP(0.0, 0.0, 0, MDL_OK);
    STEP(2.0, 4.0, 1, MDL_OK); /* the minimum is the new A0 */
}

void test_minus_zero_is_the_minimum(void)
{
    STEP(-MDL_C(0.0), 0.0, 1, MDL_OK);
    nest();
    STEP(-MDL_C(0.0), 0.0, 0, MDL_OK);
    STEP(0.0, 0.0, 0, MDL_OK);
}

void test_equal_successive_inputs_leave_the_state_alone(void)
{
    mdl_traj before;
    nest();
    before = traj;
    STEP(2.0, 10.0, 4, MDL_OK);
    STEP(2.0, 10.0, 4, MDL_OK);
    TEST_ASSERT_EQUAL_MEMORY(&before, &traj, sizeof traj);
    STEP(2.5, 10.25, 5, MDL_OK);
}

void test_a_pause_on_the_way_is_no_turning_point(void)
{
    STEP(2.0, 4.0, 1, MDL_OK);
    STEP(2.0, 4.0, 1, MDL_OK);
    STEP(3.0, 9.0, 1, MDL_OK);
    STEP(2.0, 8.0, 2, MDL_OK);
    STEP(2.0, 8.0, 2, MDL_OK);
    STEP(1.0, 5.0, 2, MDL_OK); /* 9 - 2^2 */
}

void test_nan_and_infinity_are_refused_and_change_nothing(void)
{
    static mdl_tp_side left_before, right_before;
    mdl_traj before;
    int i;
    use_square(MDL_C(1.0));
    nest();
    before = traj;
    left_before = left;
    right_before = right;
    for (i = 0; i < 3; i++) {
        STEP(mdl_test_not_finite(i), 10.0, 4, MDL_ERR_NOT_FINITE);
    }
    STEP(-mdl_test_not_finite(0), 10.0, 4, MDL_ERR_NOT_FINITE);
    TEST_ASSERT_EQUAL_MEMORY(&before, &traj, sizeof traj);
    TEST_ASSERT_EQUAL_MEMORY(&left_before, &left, sizeof left);
    TEST_ASSERT_EQUAL_MEMORY(&right_before, &right, sizeof right);
}

void test_the_ends_of_the_range_are_inside_it(void)
{
    STEP(8.0, 64.0, 1, MDL_OK);
    STEP(0.0, 0.0, 0, MDL_OK);
}

void test_margin_0_clamps_to_the_range(void)
{
    STEP(9.0, 64.0, 1, MDL_CLAMPED);
    STEP(100.0, 64.0, 1, MDL_CLAMPED); /* no movement */
    STEP(6.0, 60.0, 2, MDL_OK);        /* turned at the end of the range */
    STEP(-0.5, 0.0, 0, MDL_CLAMPED);
    STEP(1.0, 1.0, 1, MDL_OK);
}

void test_margin_0_at_rest_stays_at_rest(void)
{
    STEP(-3.0, 0.0, 1, MDL_CLAMPED);
    STEP(1.0, 1.0, 1, MDL_OK);
}

void test_above_the_range_f0_is_continued_up_to_the_margin(void)
{
    use_square(MDL_C(1.0));
    STEP(8.5, 72.25, 1, MDL_EXTRAPOLATED);
    STEP(9.0, 81.0, 1, MDL_EXTRAPOLATED);
    STEP(9.5, 81.0, 1, MDL_CLAMPED);
    STEP(9.0, 81.0, 1, MDL_EXTRAPOLATED); /* no movement, but outside still */
    STEP(7.0, 77.0, 2, MDL_OK);           /* turned at (9, 81) */
}

void test_below_the_minimum_the_mirror_of_f0_is_continued(void)
{
    /* The descending curve from (8, 64): 64 - (8 - x)^2. */
    use_square(MDL_C(1.0));
    STEP(-0.5, -8.25, 0, MDL_EXTRAPOLATED);
    STEP(-1.0, -17.0, 0, MDL_EXTRAPOLATED);
    STEP(-1.5, -17.0, 0, MDL_CLAMPED);
    STEP(-0.5, -16.75, 1, MDL_EXTRAPOLATED); /* a new A0 at (-1, -17) */
    STEP(3.0, -1.0, 1, MDL_OK);              /* -17 + 4^2 */
    STEP(0.0, -10.0, 2, MDL_OK);             /* -1 - 3^2: not yet back at A0 */
    STEP(-1.0, -17.0, 0, MDL_EXTRAPOLATED);
}

void test_the_descent_goes_on_below_the_minimum_without_a_step(void)
{
    use_square(MDL_C(1.0));
    nest();
    STEP(-0.25, -4.0625, 0, MDL_EXTRAPOLATED); /* 64 - 8.25^2 */
    STEP(0.0, -4.0, 1, MDL_OK);                /* -4.0625 + 0.25^2 */
}

void test_reset_after_a_minimum_below_zero(void)
{
    use_square(MDL_C(1.0));
    STEP(-1.0, -17.0, 0, MDL_EXTRAPOLATED);
    STEP(2.0, -8.0, 1, MDL_OK);
    mdl_traj_reset(&traj);
    STEP(0.0, 0.0, 1, MDL_OK);
    nest();
}

/* n inner loops 0 -> 2n+1 -> 1 -> 2n -> 2 ... -> n+1 -> n; then one jump outward to each depth. */
void test_a_jump_wipes_out_as_many_loops_as_it_surpasses(void)
{
    const mdl_real line[] = {MDL_C(0.0), MDL_C(1.0)};
    const uint16_t n = 37;
    uint16_t i, target;
    for (target = 0; target <= 2u * n + 2u; target++) {
        /* The input comes from n + 0.5, falling: targets up to n lie below, the others above. */
        uint32_t held;
        mdl_real y;
        use_polynomial(MDL_C(128.0), MDL_C(0.0), line, 1);
        for (i = 0; i < n; i++) {
            STEP(2 * n + 1 - i, 2 * n + 1 - i, 2u * i + 1u, MDL_OK);
            STEP(i + 1, i + 1, 2u * (i + 1u), MDL_OK);
        }
        STEP(n + 0.75, n + 0.75, 2u * n + 1u, MDL_OK);
        STEP(n + 0.5, n + 0.5, 2u * n + 2u, MDL_OK);
        /* Below: lefts 0 .. target - 1 are held, each with its right one. Above: one right for */
        /* each of 2n+1 .. target + 1, and one left more. */
        held = target <= n ? 2u * target : 2u * (target <= 2u * n ? 2u * n + 1u - target : 0u) + 1u;
        ASSERT_STATUS(MDL_OK, mdl_traj_step(&traj, (mdl_real)target, &y));
        ASSERT_REAL(target, y);
        TEST_ASSERT_EQUAL_UINT32(held, mdl_traj_turning_points(&traj));
    }
}

/*
 * f0 is a broken line: slope 1/2 up to 1/2, 1 up to N_u / 2, then 3. So f0(1/4) = 1/8,
 * f0(1/2) = 1/4, f0(L) = L - 1/4 for 1 <= L <= N_u / 2, f0(L) - f0(L - 1) = 3 above.
 */
static void use_broken_line(void)
{
    const mdl_real n = (mdl_real)MDL_N_U;
    const mdl_real x[] = {MDL_C(0.0), MDL_C(0.5), MDL_C(0.5) * n, n};
    const mdl_real y[] = {MDL_C(0.0), MDL_C(0.25), MDL_C(0.5) * n - MDL_C(0.25),
                          MDL_C(2.0) * n - MDL_C(0.25)};
    ASSERT_STATUS(MDL_OK, mdl_major_init_breakpoints(&major, x, y, 4));
    ASSERT_STATUS(MDL_OK, mdl_traj_init(&traj, &major, &left, &right, MDL_C(0.0)));
}

/*
 * From rest at 0 to m, 1, m - 1, 2, ...: m moves of length m, m - 1, ..., 1, each inside the one
 * before, which visit every whole number. After k moves A0 and k - 1 turning points are held.
 * Returns the last y = f0(m) - f0(m - 1) + f0(m - 2) - ...
 */
static mdl_real nest_all(uint32_t m)
{
    mdl_real y = MDL_C(0.0);
    uint32_t k;
    for (k = 1; k <= m; k++) {
        mdl_real x = (mdl_real)(k % 2u ? m - k / 2u : k / 2u);
        ASSERT_STATUS(MDL_OK, mdl_traj_step(&traj, x, &y));
        TEST_ASSERT_EQUAL_UINT32(k, mdl_traj_turning_points(&traj));
    }
    return y;
}

void test_all_codes_nested_fit_when_the_lowest_is_the_minimum(void)
{
    /* Codes 0 to N_u - 1. A quarter of the lengths N_u - 1, N_u - 3, ... give 3 each, as many give
     * 1, but the last, f0(1), only 3/4. */
    use_broken_line();
    ASSERT_REAL((double)MDL_N_U - 0.25, nest_all(MDL_N_U - 1));
    STEP(0.0, 0.0, 0, MDL_OK);
}

void test_all_codes_nested_fill_the_memory_exactly_when_all_lie_above_the_minimum(void)
{
    /* Codes 1 to N_u; A0 = 0 is not one of them. Lengths N_u, ..., 1 give N_u / 4 times 3 + 1. */
    use_broken_line();
    ASSERT_REAL(MDL_N_U, nest_all(MDL_N_U));
    /* Every further code surpasses something. */
    STEP(MDL_N_U / 2 + 1, (double)MDL_N_U + 0.75, (uint32_t)(MDL_N_U - 1), MDL_OK);
    STEP(1.0, 3.0, 2, MDL_OK); /* f0(N_u) - f0(N_u - 1) */
}

void test_off_the_grid_a_full_memory_says_so_and_resumes_recording(void)
{
    const double n = (double)MDL_N_U;
    const double h = (double)MDL_N_U / 2.0;
    const uint32_t full = MDL_N_U;
    use_broken_line();
    ASSERT_REAL(n, nest_all(MDL_N_U));
    /* Innermost curve, from (h + 1, n + 3/4) downward: n + 3/4 - f0(h + 1 - x), to and fro. */
    STEP(h + 0.5, n + 0.5, full, MDL_MEMORY_FULL);
    STEP(h + 0.75, n + 0.625, full, MDL_MEMORY_FULL);
    STEP(h + 0.25, n + 0.25, full, MDL_OK);
    STEP(h + 0.5, n + 0.5, full, MDL_MEMORY_FULL);
    /* Its start is surpassed: the ascending curve from (h - 1, n - 1), n - 1 + f0(x - h + 1). */
    STEP(h + 1.0, n + 0.75, full - 1u, MDL_OK);
    STEP(h + 0.5, n + 0.5, full, MDL_OK);
    STEP(h + 1.5, n + 1.25, full - 1u, MDL_OK);
    STEP(h + 1.25, n + 1.125, full, MDL_OK); /* recorded again: (h + 3/2, n + 5/4) */
    STEP(h + 1.375, n + 1.1875, full, MDL_MEMORY_FULL);
    STEP(0.0, 0.0, 0, MDL_OK);
}

void test_a_full_memory_is_left_downward_too(void)
{
    const double n = (double)MDL_N_U;
    const double h = (double)MDL_N_U / 2.0;
    use_broken_line();
    (void)nest_all(MDL_N_U);
    STEP(h + 0.5, n + 0.5, (uint32_t)MDL_N_U, MDL_MEMORY_FULL);
    /* Left (h - 1, n - 1) is surpassed: on the curve from (h + 2, n + 7/4), less f0(3.5) = 3.25. */
    STEP(h - 1.5, n - 1.5, (uint32_t)(MDL_N_U - 2), MDL_OK);
    STEP(h - 1.25, n - 1.375, (uint32_t)(MDL_N_U - 1), MDL_OK);
}

/* One-side play operators, eq. (15) recursing on each H_i, and their sum. */
static mdl_real play_model(mdl_real *h, const mdl_real *w, const mdl_real *r, int count, mdl_real x)
{
    mdl_real sum = MDL_C(0.0);
    int i;
    for (i = 0; i < count; i++) {
        mdl_real upper = x < h[i] ? x : h[i];
        h[i] = x - r[i] > upper ? x - r[i] : upper;
        sum += w[i] * h[i];
    }
    return sum;
}

void test_the_play_model_is_reproduced(void)
{
    const mdl_real w[] = {MDL_C(0.25), MDL_C(0.5), MDL_C(1.0), MDL_C(0.125)};
    const mdl_real r[] = {MDL_C(0.0), MDL_C(0.5), MDL_C(1.25), MDL_C(3.0)};
    const double path[] = {0.0, 0.25, 2.0,  1.0, 1.5, 1.25, 1.375, 1.0, 4.0,  0.5,  3.5, 3.5,
                           1.0, 3.0,  1.75, 2.0, 0.0, 3.25, 2.875, 3.0, 0.25, 0.75, 8.0, 0.0};
    mdl_real h[] = {MDL_C(0.0), MDL_C(0.0), MDL_C(0.0), MDL_C(0.0)};
    mdl_real y;
    uint16_t i;
    ASSERT_STATUS(MDL_OK, mdl_major_init_play(&major, MDL_C(8.0), w, r, 4));
    ASSERT_STATUS(MDL_OK, mdl_traj_init(&traj, &major, &left, &right, MDL_C(0.0)));
    for (i = 0; i < sizeof path / sizeof path[0]; i++) {
        mdl_real x = (mdl_real)path[i];
        ASSERT_STATUS(MDL_OK, mdl_traj_step(&traj, x, &y));
        ASSERT_REAL(play_model(h, w, r, 4, x), y);
    }
}

void test_a_shape_adds_its_terms_and_loops_still_close(void)
{
    /* s'^1 m'^1 with 16 um: a swing from a to b adds 16 (b - a) / 8 ((a + b) / 8 - 1). */
    mdl_shape shape = {MDL_C(0.125), {{MDL_C(16.0)}}, {MDL_C(0.0)}};
    major.shape = &shape;
    ASSERT_STATUS(MDL_OK, mdl_traj_init(&traj, &major, &left, &right, MDL_C(1.0)));
    STEP(4.0, 12.0, 1, MDL_OK);              /* 16 + 8 * (1/2 - 1) */
    STEP(2.0, 9.0, 2, MDL_OK);               /* 12 - (4 + 4 * (3/4 - 1)) */
    STEP(4.0, 12.0, 1, MDL_OK);              /* 9 + (4 - 1) */
    STEP(8.0, 64.0, 1, MDL_OK);              /* 64 + 16 * 0 */
    STEP(0.0, 0.0, 0, MDL_OK);               /* the loop closes */
    STEP(-1.0, -14.75, 0, MDL_EXTRAPOLATED); /* 64 - (81 + 18 * (7/8 - 1)) */
}

void test_minor_loops_of_another_width_close_where_they_began(void)
{
    /* f0 = x^2 on 8 V, wider by (1 - D / 8) / 2: by 1/4 for D = 4, by 3/8 for D = 2. */
    mdl_shape shape = {MDL_C(0.125), {{MDL_C(0.0)}}, {MDL_C(0.5), MDL_C(0.0)}};
    major.shape = &shape;
    ASSERT_STATUS(MDL_OK, mdl_traj_init(&traj, &major, &left, &right, MDL_C(1.0)));
    STEP(4.0, 16.0, 1, MDL_OK);
    STEP(2.0, 13.0, 2, MDL_OK);   /* 16 less 5/4 * 4 + 1/2 (16 - 5/4 * 16) */
    STEP(3.0, 13.125, 3, MDL_OK); /* 13 and 11/8 + 1/2 (3 - 11/8 * 4) */
    STEP(4.0, 16.0, 1, MDL_OK);
    STEP(8.0, 64.0, 1, MDL_OK);
    STEP(4.0, 48.0, 2, MDL_OK); /* the major loop is as it was */
    STEP(0.0, 0.0, 0, MDL_OK);
}

/* ---- saving and resuming ---- */

#define SAVED_MAX 64
static mdl_real saved[SAVED_MAX];

static uint32_t save_nest(void)
{
    nest();
    ASSERT_STATUS(MDL_OK, mdl_traj_save(&traj, saved, SAVED_MAX));
    return mdl_traj_saved_length(&traj);
}

void test_save_writes_the_documented_layout_and_no_more(void)
{
    const double layout[] = {2, 1, 2, 10, 0, 0, 1, 7, 4, 16, 3, 11};
    uint16_t i;
    saved[12] = MDL_C(-7.0);
    TEST_ASSERT_EQUAL_UINT32(12, save_nest());
    for (i = 0; i < 12u; i++) {
        ASSERT_REAL(layout[i], saved[i]);
    }
    ASSERT_REAL(-7.0, saved[12]);
}

void test_save_refuses_a_short_array_and_leaves_it_alone(void)
{
    mdl_real shorter[12] = {MDL_C(5.0)};
    nest();
    ASSERT_STATUS(MDL_ERR_CAPACITY, mdl_traj_save(&traj, shorter, 11));
    ASSERT_REAL(5.0, shorter[0]);
    ASSERT_STATUS(MDL_OK, mdl_traj_save(&traj, shorter, 12));
}

void test_a_resumed_state_goes_on_as_the_saved_one(void)
{
    uint32_t length = save_nest();
    STEP(3.5, 13.25, 3, MDL_OK);
    mdl_traj_reset(&traj);
    STEP(6.0, 36.0, 1, MDL_OK);
    ASSERT_STATUS(MDL_OK, mdl_traj_resume(&traj, saved, length));
    TEST_ASSERT_EQUAL_UINT32(4, mdl_traj_turning_points(&traj));
    STEP(2.0, 10.0, 4, MDL_OK);
    STEP(3.5, 13.25, 3, MDL_OK);
    STEP(1.5, 9.25, 4, MDL_OK); /* from (3.5, 13.25): - 2^2 */
}

void test_every_kind_of_state_is_saved_and_resumed(void)
{
    const double path[] = {0.0, 3.0, 2.0, 2.5, 2.25, 4.0, 0.0, -0.5, -0.25, 5.0, 8.5, 7.0, -1.0};
    mdl_real before[SAVED_MAX], y;
    uint32_t length, i;
    use_square(MDL_C(1.0));
    for (i = 0; i < sizeof path / sizeof path[0]; i++) {
        (void)mdl_traj_step(&traj, (mdl_real)path[i], &y);
        length = mdl_traj_saved_length(&traj);
        ASSERT_STATUS(MDL_OK, mdl_traj_save(&traj, before, SAVED_MAX));
        mdl_traj_reset(&traj);
        ASSERT_STATUS(MDL_OK, mdl_traj_resume(&traj, before, length));
        ASSERT_STATUS(MDL_OK, mdl_traj_save(&traj, saved, SAVED_MAX));
        TEST_ASSERT_EQUAL_UINT32(length, mdl_traj_saved_length(&traj));
        TEST_ASSERT_EQUAL_MEMORY(before, saved, length * sizeof saved[0]);
    }
}

void test_a_full_memory_is_saved_and_resumed(void)
{
    static mdl_real all[4 + 2 * MDL_N_U];
    const double n = (double)MDL_N_U;
    const double h = (double)MDL_N_U / 2.0;
    use_broken_line();
    (void)nest_all(MDL_N_U);
    STEP(h + 0.5, n + 0.5, (uint32_t)MDL_N_U, MDL_MEMORY_FULL);
    TEST_ASSERT_EQUAL_UINT32(4 + 2 * MDL_N_U, mdl_traj_saved_length(&traj));
    ASSERT_STATUS(MDL_OK, mdl_traj_save(&traj, all, 4 + 2 * MDL_N_U));
    mdl_traj_reset(&traj);
    ASSERT_STATUS(MDL_OK, mdl_traj_resume(&traj, all, 4 + 2 * MDL_N_U));
    STEP(h + 0.75, n + 0.625, (uint32_t)MDL_N_U, MDL_MEMORY_FULL);
    STEP(h + 1.0, n + 0.75, (uint32_t)(MDL_N_U - 1), MDL_OK);
    /* One turning point more than the arrays hold: as from a model with a larger memory. */
    all[0] += MDL_C(1.0);
    ASSERT_STATUS(MDL_ERR_CAPACITY, mdl_traj_resume(&traj, all, 4 + 2 * MDL_N_U));
    all[0] = (mdl_real)MDL_TP_CAPACITY;
    all[1] = MDL_C(0.0);
    ASSERT_STATUS(MDL_ERR_CAPACITY, mdl_traj_resume(&traj, all, 4 + 2 * MDL_N_U));
}

void test_resume_takes_minus_zero_as_zero(void)
{
    uint32_t length = save_nest();
    saved[4] = -MDL_C(0.0);
    ASSERT_STATUS(MDL_OK, mdl_traj_resume(&traj, saved, length));
    STEP(0.0, 0.0, 0, MDL_OK);
    ASSERT_STATUS(MDL_OK, mdl_traj_save(&traj, saved, SAVED_MAX));
    saved[2] = -MDL_C(0.0);
    ASSERT_STATUS(MDL_OK, mdl_traj_resume(&traj, saved, 4));
    STEP(0.0, 0.0, 0, MDL_OK);
    STEP(1.0, 1.0, 1, MDL_OK);
}

/* What save wrote for the nest, with one number changed, is refused and the state is as before. */
static void refuse(mdl_status status, uint32_t index, mdl_real value)
{
    mdl_traj before;
    uint32_t length = save_nest();
    before = traj;
    saved[index] = value;
    ASSERT_STATUS(status, mdl_traj_resume(&traj, saved, length));
    TEST_ASSERT_EQUAL_MEMORY(&before, &traj, sizeof traj);
    STEP(3.5, 13.25, 3, MDL_OK);
    mdl_traj_reset(&traj);
}

void test_resume_refuses_what_is_not_finite(void)
{
    uint32_t k;
    int i;
    for (k = 0; k < 12u; k++) {
        for (i = 0; i < 3; i++) {
            refuse(MDL_ERR_NOT_FINITE, k, mdl_test_not_finite(i));
        }
    }
}

void test_resume_refuses_wrong_lengths(void)
{
    uint32_t length;
    uint32_t k = save_nest();
    for (length = 0; length <= SAVED_MAX; length++) {
        ASSERT_STATUS(length == k ? MDL_OK : MDL_ERR_STATE, mdl_traj_resume(&traj, saved, length));
    }
}

void test_resume_refuses_counts_that_save_cannot_write(void)
{
    refuse(MDL_ERR_STATE, 0, MDL_C(-1.0));
    refuse(MDL_ERR_STATE, 0, MDL_C(2.5));
    refuse(MDL_ERR_STATE, 0, MDL_C(1.0));
    refuse(MDL_ERR_CAPACITY, 0, MDL_C(1e9));
    refuse(MDL_ERR_STATE, 1, MDL_C(0.0));
    refuse(MDL_ERR_STATE, 1, MDL_C(0.5));
    refuse(MDL_ERR_STATE, 1, MDL_C(-1.0));
    refuse(MDL_ERR_STATE, 1, MDL_C(2.0));
}

void test_resume_refuses_turning_points_that_are_not_nested(void)
{
    refuse(MDL_ERR_STATE, 6, MDL_C(0.0));  /* A2 at A0 */
    refuse(MDL_ERR_STATE, 6, MDL_C(-0.5)); /* A2 below A0 */
    refuse(MDL_ERR_STATE, 6, MDL_C(2.5));  /* A2 above x = 2 */
    refuse(MDL_ERR_STATE, 10, MDL_C(4.0)); /* A3 at A1 */
    refuse(MDL_ERR_STATE, 10, MDL_C(5.0)); /* A3 above A1 */
    refuse(MDL_ERR_STATE, 10, MDL_C(1.5)); /* A3 below x */
    refuse(MDL_ERR_STATE, 2, MDL_C(0.5));  /* x below A2 */
    refuse(MDL_ERR_STATE, 2, MDL_C(3.5));  /* x above A3 */
}

void test_resume_refuses_states_outside_of_the_model(void)
{
    const mdl_real alone[] = {MDL_C(0.0), MDL_C(1.0), MDL_C(0.5), MDL_C(0.25)};
    const mdl_real too_high[] = {MDL_C(0.0), MDL_C(0.0), MDL_C(8.5),
                                 MDL_C(1.0), MDL_C(0.0), MDL_C(0.0)};
    refuse(MDL_ERR_STATE, 4, MDL_C(0.5));  /* A0 above the minimum */
    refuse(MDL_ERR_STATE, 4, MDL_C(-0.5)); /* A0 beyond the margin, 0 */
    refuse(MDL_ERR_STATE, 8, MDL_C(8.5));  /* A1 beyond the margin */
    /* Falling above the minimum on a curve without a start. */
    ASSERT_STATUS(MDL_ERR_STATE, mdl_traj_resume(&traj, alone, 4));
    /* Rising on f0 beyond the margin. */
    ASSERT_STATUS(MDL_ERR_STATE, mdl_traj_resume(&traj, too_high, 6));
    STEP(2.0, 4.0, 1, MDL_OK);
}
