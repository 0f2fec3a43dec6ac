/**
 * @file mdl_lag.h
 * @brief One real pole, 1 / (1 + tau s), exact for an input that is linear between samples.
 *
 * The state is the deviation e = output - input, so that a slow pole does not drown in the
 * rounding of a large output. With a = exp(-h / tau):
 * e[n+1] = a e[n] - (tau / h) (1 - a) (u[n+1] - u[n]). Used for the amplifier's lag, for the modes
 * of the creep ladder and for the filtered velocity. Where it turns between two samples:
 * mdl_chain.c.
 */
#ifndef MDL_LAG_H
#define MDL_LAG_H

#include "mdl_real.h"

/** Computed by the tools, in double, from tau and the sample time h. */
typedef struct {
    mdl_real decay; /**< 1 - a, 0 to 1 */
    mdl_real ramp;  /**< (tau / h) (1 - a), 0 to 1 */
} mdl_lag_params;

/** State: deviation, and what the last additions to it have rounded away. */
typedef struct {
    mdl_real e;
    mdl_real lost;
} mdl_lag;

/** At rest: the output equals the input. */
void mdl_lag_reset(mdl_lag *lag);

/**
 * One sample. The sum is compensated: a pole of 600 s at 10 kHz decays by 2e-7 of e a sample,
 * which plain float would lose.
 * @param rise  input now less input before, any unit
 * @return e, output less input, same unit
 */
mdl_real mdl_lag_step(mdl_lag *lag, const mdl_lag_params *params, mdl_real rise);

#endif
