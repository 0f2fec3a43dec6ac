/**
 * @file mdl_rate.h
 * @brief Rate dependence: loops that widen with the rate of the input, in two forms.
 *
 * Damping: y += c |v|^p sgn(v), the m-th-power velocity damping of Yang et al. 2015, eq. (6).
 * Widening: y += c |v|^p (y - middle), which scales the hysteretic part, as plays do whose
 * thresholds grow with the rate. v is the filtered velocity of the input over a reference.
 */
#ifndef MDL_RATE_H
#define MDL_RATE_H

#include "mdl_lag.h"
#include "mdl_major.h"

/** Parameters; computed by the tools for the sample time. */
typedef struct {
    mdl_lag_params filter; /**< of the velocity */
    mdl_real v_scale;      /**< filtered deviation to v, 1 / volts, negative */
    mdl_real power;        /**< p, 0 < p <= 4 */
    mdl_real damping_um;   /**< c of the damping, um */
    mdl_real widening;     /**< c of the widening, no unit */
} mdl_rate_params;

/** Displacement, um, that the rate adds; x in volts, rise its change in this sample. */
mdl_real mdl_rate_step(mdl_lag *state, const mdl_rate_params *params, const mdl_major *major,
                       mdl_real x_volts, mdl_real rise_volts, mdl_real y_um);

#endif
