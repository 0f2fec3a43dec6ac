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
    mdl_real knee_power; /**< p of a knee that begins one width before the limit, 1 to 32; 0: none.
                          * With one the width is > 0, and the knees of both ends do not meet */
    uint16_t parabolic;  /**< 1: the knee is a parabola, and knees do not meet; then no power */
} mdl_saturation_params;

/**
 * How far a slew-limited drive moves in one step. With a knee both ways are equal: an input stage
 * that saturates, dv/dt = S tanh((u - v) / knee). Computed by the tools for the step h.
 */
typedef struct {
    mdl_real rise_volts; /**< S h, > 0 */
    mdl_real fall_volts; /**< S h of falling commands, > 0 */
    mdl_real knee_volts; /**< how far the drive lags where its rate saturates, 0: hard */
    mdl_real decay;      /**< exp(-S h / knee) of a small lag, 0 to 1 */
    mdl_real early;      /**< 1 / (1 - decay) - knee / (S h): share of a step's rise that the lag
                          * has from its beginning on, 0.5 to 1 */
} mdl_slew_params;

/**
 * Clipped voltage. Hard: u limited to [low, high]. Soft, without a power: u - knee ln(1 +
 * exp((u - high) / knee)) and its mirror at the lower end; the deviation at the limit itself is
 * knee * ln 2. With a power p: as it is up to high - knee, from there on by knee * e /
 * (1 + e^p)^(1/p), e in knees, and its mirror; p = 2 is the algebraic knee, p = 1 near an
 * exponential one, between 2 and 3 near a tanh. A parabola goes from one knee before the limit,
 * where it rises with the command, to one behind it, where it is flat: the deviation at the limit
 * is knee / 4.
 */
mdl_real mdl_saturation(const mdl_saturation_params *params, mdl_real u_volts);

/**
 * The voltage that a slew-limited drive reaches in one step.
 * @param last_volts  of the drive, at the beginning
 * @param u_volts     of the command, at the end
 * @param rise_volts  of the command in this step, which it makes evenly; for the knee
 */
mdl_real mdl_slew(const mdl_slew_params *params, mdl_real last_volts, mdl_real u_volts,
                  mdl_real rise_volts);

#endif
