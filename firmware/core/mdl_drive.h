/**
 * @file mdl_drive.h
 * @brief What an amplifier does to the commanded voltage: saturation, slew limit.
 */
#ifndef MDL_DRIVE_H
#define MDL_DRIVE_H

#include "mdl_real.h"

/** Where and how softly the drive clips. */
typedef struct {
    mdl_real high_volts;
    mdl_real low_volts;  /**< below high_volts */
    mdl_real knee_volts; /**< width of the soft knee, 0: hard */
} mdl_saturation_params;

/**
 * Clipped voltage. Hard: u limited to [low, high]. Soft: u - knee ln(1 + exp((u - high) / knee))
 * and its mirror at the lower end; the deviation at the limit itself is knee * ln 2.
 */
mdl_real mdl_saturation(const mdl_saturation_params *params, mdl_real u_volts);

/** The voltage that a slew-limited drive reaches from last_volts towards u in one step. */
mdl_real mdl_slew(mdl_real step_volts, mdl_real last_volts, mdl_real u_volts);

#endif
