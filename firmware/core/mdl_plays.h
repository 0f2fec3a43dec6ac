/**
 * @file mdl_plays.h
 * @brief Play operators with the weights of f0 that grow or relax with the rate: how far the
 *        displacement is held back.
 *
 * f0 of Madelung's rules is the major curve of play operators, Cao & Li 2019, eqs. (16)-(17):
 * f0(x) = f0(0) + w_0 x + sum w_i max(0, x - 2 r_i). Here there are two sets of them. In one the
 * half widths stay r_i. In the other they are r_i (1 + grow), the dynamic thresholds of
 * rate-dependent Prandtl-Ishlinskii models; or the operators are viscous: with o the distance from
 * where a plain one would be, o' = -o / tau or o' = -k o^2. The difference of the two sums is what
 * this takes from the displacement, so that what few operators lack of f0 drops out.
 */
#ifndef MDL_PLAYS_H
#define MDL_PLAYS_H

#include "mdl_major.h"

/** Operators made from a major curve: their half widths are evenly spaced. */
typedef struct {
    mdl_real half_volts[MDL_PLAYS_MAX]; /**< r_i */
    mdl_real weight[MDL_PLAYS_MAX];     /**< w_i, um / volts */
} mdl_plays_params;

/** How viscous operators follow in one sample; linear, or by the square of the distance. */
typedef struct {
    mdl_real decay; /**< e^(-h / tau), what is left of a distance; 1: square; 0: none */
    mdl_real early; /**< linear: tau / h - decay / (1 - decay), 0 to 1/2, see mdl_plays_relax */
    mdl_real pull;  /**< square: k h, 1 / volts, > 0, o / (1 + pull o) is left; linear: 0 */
} mdl_relax_params;

/** State: where the operators of both sets are, volts. */
typedef struct {
    mdl_real still_volts[MDL_PLAYS_MAX];
    mdl_real grown_volts[MDL_PLAYS_MAX];
} mdl_plays;

/** Half widths and weights from f0; its shape, if it has one, is left out. */
void mdl_plays_make(mdl_plays_params *params, const mdl_major *major);

/** At rest at x = 0, to which the input has come down from the whole range. */
void mdl_plays_reset(mdl_plays *plays, const mdl_plays_params *params);

/**
 * One sample.
 * @param x_volts  input, finite
 * @param grow     share by which the thresholds have grown, >= 0
 * @return displacement held back, um
 */
mdl_real mdl_plays_step(mdl_plays *plays, const mdl_plays_params *params, mdl_real x_volts,
                        mdl_real grow);

/**
 * The same with viscous operators, which do not grow. They follow the input a part of the sample
 * earlier, such that behind a steady input their distance is what the equation says.
 * @param rise_volts  x_volts less the input before
 */
mdl_real mdl_plays_relax(mdl_plays *plays, const mdl_plays_params *params, mdl_real x_volts,
                         mdl_real rise_volts, const mdl_relax_params *relax);

#endif
