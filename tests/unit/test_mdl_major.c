/* The major ascending curve: polynomial, broken line, play operators. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_major.h"
#include "mdl_shape.h"

#include <string.h>

static mdl_major major, before;
static mdl_real ones[MDL_DEGREE_MAX + 2];

void setUp(void)
{
    uint16_t k;
    for (k = 0; k < MDL_DEGREE_MAX + 2; k++) {
        ones[k] = MDL_C(1.0);
    }
    memset(&major, 0x55, sizeof major);
    before = major;
}

void tearDown(void)
{
}

/* A refused call leaves the curve as it was. */
#define REFUSED(status, call)                                                                      \
    do {                                                                                           \
        ASSERT_STATUS(status, call);                                                               \
        TEST_ASSERT_EQUAL_MEMORY(&before, &major, sizeof major);                                   \
    } while (0)

void test_horner_for_every_degree(void)
{
    /* 1 + x + ... + x^n is 2^(n+1) - 1 at 2, 2 - 2^-n at 1/2, 1 or 0 at -1, and 1 at 0. */
    uint16_t n;
    for (n = 0; n <= MDL_DEGREE_MAX; n++) {
        ASSERT_STATUS(MDL_OK, mdl_major_init_polynomial(&major, MDL_C(2.0), ones, n));
        ASSERT_REAL((2ul << n) - 1ul, mdl_major_eval(&major, MDL_C(2.0)));
        ASSERT_REAL(2.0 - 1.0 / (double)(1ul << n), mdl_major_eval(&major, MDL_C(0.5)));
        ASSERT_REAL(n % 2u ? 0.0 : 1.0, mdl_major_eval(&major, MDL_C(-1.0)));
        ASSERT_REAL(1.0, mdl_major_eval(&major, MDL_C(0.0)));
        ASSERT_REAL(1.0, major.at_zero_um);
        ASSERT_REAL(2.0, major.range_volts);
    }
}

void test_the_curve_of_the_paper(void)
{
    /* Eq. (20) at 40 V, by hand: 0.58517 + 3.45776 + 1.91184 - 0.3960064. */
    const mdl_real c[] = {MDL_C(5.8517e-1), MDL_C(8.6444e-2), MDL_C(1.1949e-3), MDL_C(-6.1876e-6)};
    ASSERT_STATUS(MDL_OK, mdl_major_init_polynomial(&major, MDL_C(40.0), c, 3));
    ASSERT_NEAR(5.5587636, mdl_major_eval(&major, MDL_C(40.0)), 1.0);
}

void test_polynomials_that_are_refused(void)
{
    mdl_real c[MDL_DEGREE_MAX + 1];
    uint16_t k;
    int i;
    REFUSED(MDL_ERR_PARAMETER,
            mdl_major_init_polynomial(&major, MDL_C(2.0), ones, MDL_DEGREE_MAX + 1));
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_polynomial(&major, MDL_C(0.0), ones, 2));
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_polynomial(&major, MDL_C(-1.0), ones, 2));
    for (i = 0; i < 3; i++) {
        REFUSED(MDL_ERR_NOT_FINITE,
                mdl_major_init_polynomial(&major, mdl_test_not_finite(i), ones, 2));
        for (k = 0; k <= MDL_DEGREE_MAX; k++) {
            memcpy(c, ones, sizeof c);
            c[k] = mdl_test_not_finite(i);
            REFUSED(MDL_ERR_NOT_FINITE,
                    mdl_major_init_polynomial(&major, MDL_C(2.0), c, MDL_DEGREE_MAX));
        }
    }
}

void test_a_broken_line_passes_through_its_breakpoints(void)
{
    const mdl_real x[] = {-MDL_C(0.0), MDL_C(1.0), MDL_C(3.0), MDL_C(4.0)};
    const mdl_real y[] = {MDL_C(2.0), MDL_C(2.5), MDL_C(5.5), MDL_C(5.5)};
    uint16_t i;
    ASSERT_STATUS(MDL_OK, mdl_major_init_breakpoints(&major, x, y, 4));
    for (i = 0; i < 4u; i++) {
        ASSERT_REAL(y[i], mdl_major_eval(&major, x[i]));
    }
    ASSERT_REAL(2.25, mdl_major_eval(&major, MDL_C(0.5)));
    ASSERT_REAL(4.0, mdl_major_eval(&major, MDL_C(2.0)));
    ASSERT_REAL(4.0, major.range_volts);
    ASSERT_REAL(2.0, major.at_zero_um);
}

void test_a_broken_line_is_continued_at_both_ends(void)
{
    const mdl_real x[] = {MDL_C(0.0), MDL_C(1.0), MDL_C(2.0)};
    const mdl_real y[] = {MDL_C(1.0), MDL_C(2.0), MDL_C(5.0)};
    ASSERT_STATUS(MDL_OK, mdl_major_init_breakpoints(&major, x, y, 3));
    ASSERT_REAL(0.0, mdl_major_eval(&major, MDL_C(-1.0)));
    ASSERT_REAL(8.0, mdl_major_eval(&major, MDL_C(3.0)));
}

void test_the_segment_is_found_for_every_number_of_breakpoints(void)
{
    /* Through (k, k (k + 1) / 2): half way between k and k + 1 it is (k + 1)^2 / 2. */
    mdl_real x[MDL_BREAKPOINTS_MAX], y[MDL_BREAKPOINTS_MAX];
    uint16_t n, k;
    for (k = 0; k < MDL_BREAKPOINTS_MAX; k++) {
        x[k] = (mdl_real)k;
        y[k] = (mdl_real)(k * (k + 1)) * MDL_C(0.5);
    }
    for (n = 2; n <= MDL_BREAKPOINTS_MAX; n++) {
        ASSERT_STATUS(MDL_OK, mdl_major_init_breakpoints(&major, x, y, n));
        for (k = 0; k < n - 1; k++) {
            ASSERT_REAL((k + 1) * (k + 1) * 0.5, mdl_major_eval(&major, x[k] + MDL_C(0.5)));
        }
    }
}

void test_breakpoints_that_are_refused(void)
{
    mdl_real x[] = {MDL_C(0.0), MDL_C(1.0), MDL_C(2.0)};
    mdl_real y[] = {MDL_C(0.0), MDL_C(1.0), MDL_C(2.0)};
    const mdl_real huge = MDL_TEST_EPSILON < 1e-12 ? (mdl_real)1.5e308 : MDL_C(3e38);
    uint16_t k;
    int i;
    REFUSED(MDL_ERR_CAPACITY, mdl_major_init_breakpoints(&major, x, y, MDL_BREAKPOINTS_MAX + 1));
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_breakpoints(&major, x, y, 1));
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_breakpoints(&major, x, y, 0));
    for (i = 0; i < 3; i++) {
        for (k = 0; k < 3u; k++) {
            mdl_real old = x[k];
            x[k] = mdl_test_not_finite(i);
            REFUSED(MDL_ERR_NOT_FINITE, mdl_major_init_breakpoints(&major, x, y, 3));
            x[k] = old;
            old = y[k];
            y[k] = mdl_test_not_finite(i);
            REFUSED(MDL_ERR_NOT_FINITE, mdl_major_init_breakpoints(&major, x, y, 3));
            y[k] = old;
        }
    }
    x[0] = MDL_C(0.5);
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_breakpoints(&major, x, y, 3));
    x[0] = MDL_C(0.0);
    x[1] = MDL_C(2.0);
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_breakpoints(&major, x, y, 3));
    x[1] = MDL_C(1.0);
    y[1] = -huge;
    y[2] = huge; /* 2 * huge is no number */
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_breakpoints(&major, x, y, 3));
}

void test_play_operators_give_equations_16_and_17(void)
{
    /* f(x) = 0.5 x + 0.25 max(0, x - 1) + 2 max(0, x - 3) */
    const mdl_real w[] = {MDL_C(0.5), MDL_C(0.25), MDL_C(2.0)};
    const mdl_real r[] = {MDL_C(0.0), MDL_C(1.0), MDL_C(3.0)};
    ASSERT_STATUS(MDL_OK, mdl_major_init_play(&major, MDL_C(4.0), w, r, 3));
    ASSERT_REAL(0.0, mdl_major_eval(&major, MDL_C(0.0)));
    ASSERT_REAL(0.25, mdl_major_eval(&major, MDL_C(0.5)));
    ASSERT_REAL(0.5, mdl_major_eval(&major, MDL_C(1.0)));
    ASSERT_REAL(1.25, mdl_major_eval(&major, MDL_C(2.0)));
    ASSERT_REAL(2.0, mdl_major_eval(&major, MDL_C(3.0)));
    ASSERT_REAL(4.75, mdl_major_eval(&major, MDL_C(4.0)));
    ASSERT_REAL(7.5, mdl_major_eval(&major, MDL_C(5.0)));
    ASSERT_REAL(4.0, major.range_volts);
    ASSERT_REAL(0.0, major.at_zero_um);
}

void test_one_play_operator_is_a_straight_line(void)
{
    const mdl_real w[] = {MDL_C(0.5)};
    const mdl_real r[] = {MDL_C(0.0)};
    ASSERT_STATUS(MDL_OK, mdl_major_init_play(&major, MDL_C(4.0), w, r, 1));
    ASSERT_REAL(1.5, mdl_major_eval(&major, MDL_C(3.0)));
}

void test_play_operators_that_are_refused(void)
{
    mdl_real w[] = {MDL_C(1.0), MDL_C(1.0)};
    mdl_real r[] = {MDL_C(0.0), MDL_C(1.0)};
    int i;
    REFUSED(MDL_ERR_CAPACITY,
            mdl_major_init_play(&major, MDL_C(2.0), w, r, MDL_BREAKPOINTS_MAX + 1));
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_play(&major, MDL_C(2.0), w, r, 0));
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_play(&major, MDL_C(1.0), w, r, 2));
    for (i = 0; i < 3; i++) {
        REFUSED(MDL_ERR_NOT_FINITE, mdl_major_init_play(&major, mdl_test_not_finite(i), w, r, 2));
        w[1] = mdl_test_not_finite(i);
        REFUSED(MDL_ERR_NOT_FINITE, mdl_major_init_play(&major, MDL_C(2.0), w, r, 2));
        w[1] = MDL_C(1.0);
        r[1] = mdl_test_not_finite(i);
        REFUSED(MDL_ERR_NOT_FINITE, mdl_major_init_play(&major, MDL_C(2.0), w, r, 2));
        r[1] = MDL_C(1.0);
    }
    r[0] = MDL_C(0.5);
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_play(&major, MDL_C(2.0), w, r, 2));
    r[0] = MDL_C(0.0);
    r[1] = MDL_C(0.0);
    REFUSED(MDL_ERR_PARAMETER, mdl_major_init_play(&major, MDL_C(2.0), w, r, 2));
}

void test_a_swing_depends_on_its_length_unless_a_shape_says_otherwise(void)
{
    /* f0 = 1 + x + x^2: a swing of 1.5 gives 1.5 + 2.25, wherever it lies. */
    mdl_shape shape = {MDL_C(0.25), {{MDL_C(8.0)}}, {MDL_C(0.0)}};
    ASSERT_STATUS(MDL_OK, mdl_major_init_polynomial(&major, MDL_C(4.0), ones, 2));
    ASSERT_REAL(3.75, mdl_major_swing(&major, MDL_C(0.0), MDL_C(1.5)));
    ASSERT_REAL(3.75, mdl_major_swing(&major, MDL_C(2.0), MDL_C(3.5)));
    major.shape = &shape; /* + 8 s' m' = 8 * 3/8 * (5.5/4 - 1) */
    ASSERT_REAL(4.875, mdl_major_swing(&major, MDL_C(2.0), MDL_C(3.5)));
}

void test_the_first_slope_is_the_weight_of_the_operator_without_threshold(void)
{
    const mdl_real w[] = {MDL_C(0.5), MDL_C(0.25)};
    const mdl_real r[] = {MDL_C(0.0), MDL_C(1.0)};
    ASSERT_STATUS(MDL_OK, mdl_major_init_play(&major, MDL_C(2.0), w, r, 2));
    ASSERT_REAL(0.5, mdl_major_first_slope(&major));
    ASSERT_STATUS(MDL_OK, mdl_major_init_polynomial(&major, MDL_C(2.0), ones, 2));
    ASSERT_REAL(1.0, mdl_major_first_slope(&major));
}
