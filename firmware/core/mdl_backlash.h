/**
 * @file mdl_backlash.h
 * @brief Dead band between the actuator and the sensor's target: a play operator on the
 *        displacement (the two-side form of Cao & Li 2019, eq. (15), recursing on itself, where
 *        the sum y_PI is printed).
 */
#ifndef MDL_BACKLASH_H
#define MDL_BACKLASH_H

#include "mdl_real.h"

/** Engaged in the rising sense at y_um: the target is half a dead band behind. */
mdl_real mdl_backlash_start(mdl_real dead_band_um, mdl_real y_um);

/** One sample: where the target was, and the actuator now, to where the target is. um. */
mdl_real mdl_backlash_step(mdl_real dead_band_um, mdl_real last_um, mdl_real y_um);

#endif
