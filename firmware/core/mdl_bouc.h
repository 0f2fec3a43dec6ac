/**
 * @file mdl_bouc.h
 * @brief A part of the hysteresis by Bouc and Wen, whose minor loops do not obey Madelung's rules.
 *
 * y += c (z - z at rest), dz/dw = 1 - |z|^n (gamma + sgn(dw z)), w = u / reach (Wen 1976, with beta
 * normalised to 1). A minor loop does not close and wanders to the middle as it is repeated.
 */
#ifndef MDL_BOUC_H
#define MDL_BOUC_H

#include "mdl_config.h"
#include "mdl_real.h"

/** Parameters; constant data. */
typedef struct {
    mdl_real size_um;  /**< c, um */
    mdl_real per_volt; /**< 1 / reach, 1 / volts, >= 0 */
    mdl_real power;    /**< n, 1 to 4 */
    mdl_real gamma;    /**< gamma, -0.9 to 1: loading against unloading */
} mdl_bouc_params;

/** State. */
typedef struct {
    mdl_real x_volts; /**< input before */
    mdl_real z;
    mdl_real rest; /**< z at rest */
} mdl_bouc;

/**
 * One sample: the input moves to x_volts, in steps of at most 1/16 of the reach, up to
 * MDL_BOUC_STEPS_MAX of them: a jump takes time in proportion. By n = 1 the midpoint rule is then
 * off by 2e-4 of z at most, by 6e-4 where z changes its sign.
 * @return what is added to the displacement, um
 */
mdl_real mdl_bouc_step(mdl_bouc *bouc, const mdl_bouc_params *params, mdl_real x_volts);

#endif
