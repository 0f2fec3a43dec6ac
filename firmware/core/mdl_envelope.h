/**
 * @file mdl_envelope.h
 * @brief A generalised play in front of the trajectory: rising and falling commands act through
 *        different input functions, so that the major loop is not centrally symmetric.
 *
 * w = max(x - r(x), min(x + f(x), w before)), with r, f = size * 4 z (1 - z) (1 + skew (2 z - 1)),
 * z = x / range from 0 to 1 (Al Janaideh, Rakheja & Su 2009, with envelopes that meet at the ends
 * of the range).
 */
#ifndef MDL_ENVELOPE_H
#define MDL_ENVELOPE_H

#include "mdl_real.h"

/** Parameters; constant data. */
typedef struct {
    mdl_real per_volt;   /**< 1 / range, > 0 */
    mdl_real rise_volts; /**< how far w lags behind a rising command in the middle, >= 0 */
    mdl_real rise_skew;  /**< -1 to 1 */
    mdl_real fall_volts; /**< likewise behind a falling one, >= 0 */
    mdl_real fall_skew;  /**< -1 to 1 */
    mdl_real follow;     /**< share of the operator without a threshold that does not lag, 0 to 1 */
} mdl_envelope_params;

/** One sample: where w was, and the input now, V above u_min, to where w is. */
mdl_real mdl_envelope_step(const mdl_envelope_params *params, mdl_real last_volts,
                           mdl_real x_volts);

#endif
