/**
 * @file mdl_backlash.h
 * @brief Dead band between the actuator and the sensor's target: a play operator on the
 *        displacement (the two-side form of Cao & Li 2019, eq. (15), recursing on itself, where
 *        the sum y_PI is printed). Of a rough contact the gap is not everywhere equally wide: the
 *        target then goes with the mean of plays whose widths lie evenly about the dead band.
 */
#ifndef MDL_BACKLASH_H
#define MDL_BACKLASH_H

#include "mdl_real.h"

/** Engaged in the rising sense at y_um: the target is half a dead band behind. */
mdl_real mdl_backlash_start(mdl_real dead_band_um, mdl_real y_um);

/** One sample: where the target was, and the actuator now, to where the target is. um. */
mdl_real mdl_backlash_step(mdl_real dead_band_um, mdl_real last_um, mdl_real y_um);

#define MDL_BACKLASH_PARTS 8u

/** Where the parts of a contact are, um; of an even one the first alone. Reals only. */
typedef struct {
    mdl_real target_um[MDL_BACKLASH_PARTS];
} mdl_contact;

/**
 * Every part engaged in the rising sense at y_um.
 * @param spread  share of the dead band by which the parts' widths differ from it at most, 0 to 1
 * @return where the target is, um
 */
mdl_real mdl_contact_start(mdl_contact *contact, mdl_real dead_band_um, mdl_real spread,
                           mdl_real y_um);

/** One sample; as mdl_contact_start. */
mdl_real mdl_contact_step(mdl_contact *contact, mdl_real dead_band_um, mdl_real spread,
                          mdl_real y_um);

#endif
