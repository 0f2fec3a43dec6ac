/**
 * @file mdl_rate.h
 * @brief Rate dependence: loops that widen with the rate of the input, in three forms.
 *
 * With s = |v|^p sgn(v), v the filtered velocity of the input over a reference:
 * Damping: y += c s, the m-th-power velocity damping of Yang et al. 2015, eq. (6).
 * Widening: y += c |s| (y - middle), which scales the hysteretic part.
 * Threshold: every operator switches later by c |s| volts, as with the dynamic thresholds that
 * Yang et al. compare with. For plays and relays alike this is the trajectory behind a play
 * operator of that half width; the operator without a threshold, weight f0'(0), stays as it is.
 */
#ifndef MDL_RATE_H
#define MDL_RATE_H

#include "mdl_lag.h"
#include "mdl_major.h"

/** Parameters; computed by the tools for the sample time. */
typedef struct {
    mdl_lag_params filter;    /**< of the velocity */
    mdl_real v_scale;         /**< filtered deviation to v, 1 / volts, negative */
    mdl_real power;           /**< p, 0 < p <= 4 */
    mdl_real damping_um;      /**< c of the damping, um */
    mdl_real widening;        /**< c of the widening, no unit */
    mdl_real threshold_volts; /**< c of the threshold, volts, >= 0 */
} mdl_rate_params;

/** |v|^p sgn(v), Yang et al. 2015, eq. (6) with c = 1; v and 0 < p <= 4 as mdl_power takes them. */
mdl_real mdl_rate_signed_power(mdl_real v, mdl_real power);

/** s = |v|^p sgn(v) after a change of the input by rise_volts in this sample. */
mdl_real mdl_rate_power(mdl_lag *state, const mdl_rate_params *params, mdl_real rise_volts);

/** Displacement, um, that damping and widening add to y_um at x_volts. */
mdl_real mdl_rate_added(const mdl_rate_params *params, const mdl_major *major, mdl_real s,
                        mdl_real x_volts, mdl_real y_um);

#endif
