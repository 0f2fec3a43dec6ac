/**
 * @file mdl_major.h
 * @brief f0, the major ascending curve: displacement in um over x = u - u_min in volts.
 *
 * Either a polynomial (Cao & Li 2019, eq. (9)) or piecewise linear, as the major curve of a
 * Prandtl-Ishlinskii model is (eqs. (16)-(17)).
 */
#ifndef MDL_MAJOR_H
#define MDL_MAJOR_H

#include "mdl_shape.h"

typedef enum { MDL_POLYNOMIAL = 0, MDL_PIECEWISE_LINEAR = 1 } mdl_major_kind;

/** A major ascending curve. Made by one of the init functions, then constant. */
typedef struct {
    mdl_major_kind kind;
    uint16_t degree;                       /**< polynomial: 0 to MDL_DEGREE_MAX */
    uint16_t count;                        /**< piecewise linear: breakpoints, 2 or more */
    mdl_real range_volts;                  /**< identified range: x in [0, range], range > 0 */
    mdl_real at_zero_um;                   /**< f0(0) */
    const mdl_shape *shape;                /**< departure from symmetry or from Masing, or NULL */
    mdl_real c[MDL_DEGREE_MAX + 1];        /**< um / volts^k, ascending powers */
    mdl_real x_volts[MDL_BREAKPOINTS_MAX]; /**< breakpoints, ascending, the first is 0 */
    mdl_real y_um[MDL_BREAKPOINTS_MAX];    /**< f0 at the breakpoints */
    mdl_real slope[MDL_BREAKPOINTS_MAX];   /**< um / volts right of each breakpoint */
} mdl_major;

/**
 * Sets f0 to a polynomial, eq. (9).
 * @param c  degree + 1 coefficients in ascending powers of x, um / volts^k, finite
 * @return MDL_OK; MDL_ERR_PARAMETER for a degree above MDL_DEGREE_MAX or a range that is not
 *         positive; MDL_ERR_NOT_FINITE
 */
mdl_status mdl_major_init_polynomial(mdl_major *major, mdl_real range_volts, const mdl_real *c,
                                     uint16_t degree);

/**
 * Sets f0 to the broken line through (x_volts[i], y_um[i]); the last slope is continued beyond.
 * @param count  2 to MDL_BREAKPOINTS_MAX; x_volts[0] = 0, strictly ascending; the last x is the
 *               identified range
 * @return MDL_OK; MDL_ERR_PARAMETER, also for a slope that overflows; MDL_ERR_CAPACITY,
 *         MDL_ERR_NOT_FINITE
 */
mdl_status mdl_major_init_breakpoints(mdl_major *major, const mdl_real *x_volts,
                                      const mdl_real *y_um, uint16_t count);

/**
 * Sets f0 to the major curve of a Prandtl-Ishlinskii model with one-side play operators,
 * eqs. (16)-(17): f(x) = sum w_i max(0, x - r_i).
 * @param weight     um / volts, count of them
 * @param threshold  volts, threshold[0] = 0, strictly ascending, all below range_volts
 * @param count      1 to MDL_BREAKPOINTS_MAX
 * @return MDL_OK, MDL_ERR_PARAMETER, MDL_ERR_CAPACITY, MDL_ERR_NOT_FINITE
 */
mdl_status mdl_major_init_play(mdl_major *major, mdl_real range_volts, const mdl_real *weight,
                               const mdl_real *threshold, uint16_t count);

/**
 * f0(x) - f0(0) of a polynomial of degree 1 to MDL_DEGREE_MAX; 0 of degree 0. Horner, eq. (9),
 * unrolled up to MDL_DEGREE_UNROLLED: one jump, then a multiplication and an addition per power.
 * Without c[0] there is nothing to take away again.
 */
MDL_INLINE mdl_real mdl_major_horner(const mdl_real *c, uint16_t degree, mdl_real x_volts)
{
    mdl_real y = c[degree];
#if MDL_DEGREE_MAX > MDL_DEGREE_UNROLLED
    while (degree > MDL_DEGREE_UNROLLED) {
        y = y * x_volts + c[--degree];
    }
#endif
    switch (degree) {
    case 7:
        y = y * x_volts + c[6]; /* fall through */
    case 6:
        y = y * x_volts + c[5]; /* fall through */
    case 5:
        y = y * x_volts + c[4]; /* fall through */
    case 4:
        y = y * x_volts + c[3]; /* fall through */
    case 3:
        y = y * x_volts + c[2]; /* fall through */
    case 2:
        y = y * x_volts + c[1]; /* fall through */
    case 1:
        return y * x_volts;
    default:
        return MDL_C(0.0);
    }
}

/**
 * f0(x) in um; Horner for polynomials. x in volts may lie outside [0, range]: the polynomial, the
 * first or the last segment is continued. x must be finite.
 */
mdl_real mdl_major_eval(const mdl_major *major, mdl_real x_volts);

/**
 * Displacement, in um, of a swing from a to b volts on a fresh branch: the ascending branch that
 * starts at a gains it at b, the descending one that starts at b loses it at a. For the symmetric
 * hysteresis it is f0(b - a) - f0(0), eq. (6); a shape adds its terms. a and b must be finite.
 */
mdl_real mdl_major_swing(const mdl_major *major, mdl_real a_volts, mdl_real b_volts);

/** f0'(0), um / volts: the weight of the play operator with threshold 0, eq. (16). */
mdl_real mdl_major_first_slope(const mdl_major *major);

#endif
