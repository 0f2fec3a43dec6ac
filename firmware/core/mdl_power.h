/**
 * @file mdl_power.h
 * @brief 2^x, log2 x, |x|^p and a soft knee without libm, so that every target computes the same
 *        bits.
 */
#ifndef MDL_POWER_H
#define MDL_POWER_H

#include "mdl_real.h"

/** 2^x, relative error below 2e-7 in float, 3e-9 in double. x is limited to [-120, 120]. */
mdl_real mdl_exp2(mdl_real x);

/** log2 x for normal x > 0, absolute error below 2e-7 (float), 1e-9 (double) near 1. */
mdl_real mdl_log2(mdl_real x);

/** x^p for x >= 0 (0 where x is below 2^-60) and 0 < p <= 4. */
mdl_real mdl_power(mdl_real x, mdl_real p);

/** ln(1 + e^x): 0 far left, x far right, smooth between. */
mdl_real mdl_softplus(mdl_real x);

#endif
