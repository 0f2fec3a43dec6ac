/**
 * @file mdl_pi.h
 * @brief The asymmetric Prandtl-Ishlinskii model, rate-independent: Yang et al. 2015, eqs. (2),
 * (4).
 *
 * y = y_0 + a1 v^3 + a2 v + sum p_i F_i[v], with one-side play operators
 * F(t) = max(v - r, min(v, F(t - 1))), or two-side ones, max(v - r, min(v + r, F(t - 1))). Before
 * the first sample F = 0. y_0, which the paper does not have, is the zero of the sensor.
 */
#ifndef MDL_PI_H
#define MDL_PI_H

#include "mdl_config.h"
#include "mdl_real.h"
#include "mdl_status.h"

/** Parameters; constant data. */
typedef struct {
    uint16_t count;                          /**< N, play operators, 0 to MDL_PLAYS_MAX */
    uint16_t two_side;                       /**< 0: one-side operators, 1: two-side */
    mdl_real threshold_volts[MDL_PLAYS_MAX]; /**< r_i, >= 0, strictly ascending */
    mdl_real weight[MDL_PLAYS_MAX];          /**< p_i, um / volts */
    mdl_real cubic;                          /**< a1, um / volts^3 */
    mdl_real linear;                         /**< a2, um / volts */
    mdl_real at_zero_um;                     /**< y_0 */
} mdl_pi_params;

/** State: what every operator gave last, volts; all zero before the first sample. */
typedef struct {
    mdl_real play_volts[MDL_PLAYS_MAX];
} mdl_pi;

/** MDL_OK; MDL_ERR_CAPACITY, MDL_ERR_NOT_FINITE; MDL_ERR_PARAMETER: thresholds, or the switch. */
mdl_status mdl_pi_check(const mdl_pi_params *params);

/** Before the first sample, at 0 volts. */
void mdl_pi_reset(mdl_pi *pi);

/**
 * One sample, eq. (4).
 * @param v_volts       input, finite
 * @param widen_volts   added to every threshold, >= 0: the dynamic thresholds that the paper
 *                      compares with
 * @return displacement, um
 */
mdl_real mdl_pi_step(mdl_pi *pi, const mdl_pi_params *params, mdl_real v_volts,
                     mdl_real widen_volts);

#endif
