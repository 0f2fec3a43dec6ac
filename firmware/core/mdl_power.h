/**
 * @file mdl_power.h
 * @brief 2^x, log2 x, |x|^p and a soft knee without libm, so that every target computes the same
 *        bits.
 */
#ifndef MDL_POWER_H
#define MDL_POWER_H

#include "mdl_real.h"

#define MDL_LN_2 MDL_C(0.693147180559945309)

/** 2^x, relative error below 2e-7 in float, 8e-9 in double. x is limited to [-120, 120]. */
mdl_real mdl_exp2(mdl_real x);

/**
 * log2 x for normal x > 0, absolute error below 2e-7 in float, 1.1e-9 in double from 1/2 to 2;
 * elsewhere the rounding of the result is added.
 */
mdl_real mdl_log2(mdl_real x);

/**
 * x^p for x >= 0 (0 where x is below 2^-60) and 0 < p <= 32, x^p below 2^120. Relative error: p
 * times that of log2, and that of exp2.
 */
mdl_real mdl_power(mdl_real x, mdl_real p);

/** ln(1 + e^x); absolute error below (1 + result) times 2e-7 in float, 3e-9 in double. */
mdl_real mdl_softplus(mdl_real x);

#endif
