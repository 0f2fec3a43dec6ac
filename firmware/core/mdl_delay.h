/**
 * @file mdl_delay.h
 * @brief A pure delay of any length, by third-order Lagrange interpolation between samples.
 */
#ifndef MDL_DELAY_H
#define MDL_DELAY_H

#include "mdl_config.h"
#include "mdl_real.h"

/** Computed by the tools from the delay in samples. */
typedef struct {
    uint16_t whole;     /**< newest sample used, samples back; whole + 3 < MDL_DELAY_MAX */
    mdl_real weight[4]; /**< of the samples whole, whole + 1, ... back; their sum is 1 */
} mdl_delay_params;

/** The last samples, as a ring. */
typedef struct {
    mdl_real ring[MDL_DELAY_MAX];
    uint16_t newest;
} mdl_delay;

/** At rest at value. */
void mdl_delay_reset(mdl_delay *delay, mdl_real value);

/** One sample in, one out. */
mdl_real mdl_delay_step(mdl_delay *delay, const mdl_delay_params *params, mdl_real value);

#endif
