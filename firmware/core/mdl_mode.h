/**
 * @file mdl_mode.h
 * @brief One flexure mode, w^2 / (s^2 + 2 zeta w s + w^2), exact for an input that is linear
 *        between samples.
 *
 * States: deviation e = output - input and q = (velocity of the output) / w, both in the input's
 * unit: e' = w q - u', q' = -w e - 2 zeta w q. Only increments of the input enter.
 */
#ifndef MDL_MODE_H
#define MDL_MODE_H

#include "mdl_real.h"

/** Computed by the tools, in double: Phi = exp(A h) less the unit matrix, and the input column. */
typedef struct {
    mdl_real phi[2][2]; /**< Phi - I, so that slow modes keep their digits */
    mdl_real gamma[2];  /**< response to a rise of 1 within one sample */
    mdl_real share;     /**< share of the mode in the static displacement, 1 for a single mode */
} mdl_mode_params;

/** State, see above. */
typedef struct {
    mdl_real e;
    mdl_real q;
} mdl_mode;

/** At rest. */
void mdl_mode_reset(mdl_mode *mode);

/** One sample: rise of the input to share * (output - input), same unit. */
mdl_real mdl_mode_step(mdl_mode *mode, const mdl_mode_params *params, mdl_real rise);

#endif
