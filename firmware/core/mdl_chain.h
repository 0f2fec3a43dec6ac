/**
 * @file mdl_chain.h
 * @brief The signal path from the commanded voltage to the displacement: what firmware and tools
 *        call.
 *
 * u -> saturation -> slew limit -> amplifier lag -> envelopes -> trajectory (+ asymmetry,
 * non-Masing, Bouc-Wen, rate dependence) -> creep -> pole behind -> flexure modes -> backlash ->
 * delay -> gain, offset -> y
 *
 * In the trajectory's place the model of Yang et al. may stand, which has its own rate dependence.
 *
 * The baseline predictor is the trajectory alone. Every other block is switched on by its bit. The
 * delay belongs to the input box; as it commutes with every box behind it, it acts on the
 * displacement, where interpolation does not blur turning points.
 *
 * At rest the drive has been at what it makes of u_max, and then of u_min: behind a saturation the
 * hysteresis has not seen more, unless it rests free of the limits (it came to u_min by another
 * drive, or discharged). A start from an unknown history is made by leading it through that
 * history, or by resuming a state.
 */
#ifndef MDL_CHAIN_H
#define MDL_CHAIN_H

#include "mdl_backlash.h"
#include "mdl_bouc.h"
#include "mdl_delay.h"
#include "mdl_drive.h"
#include "mdl_envelope.h"
#include "mdl_mode.h"
#include "mdl_plays.h"
#include "mdl_rate.h"
#include "mdl_traj.h"
#include "mdl_yang.h"

/** Bits of mdl_chain_params.blocks. */
#define MDL_BLOCK_SATURATION 1u
#define MDL_BLOCK_SLEW 2u
#define MDL_BLOCK_LAG 4u
#define MDL_BLOCK_RATE 8u
#define MDL_BLOCK_CREEP 16u
#define MDL_BLOCK_MODES 32u
#define MDL_BLOCK_BACKLASH 64u
#define MDL_BLOCK_DELAY 128u
#define MDL_BLOCK_GAIN 256u
#define MDL_BLOCK_BOUC 1024u     /**< beside the trajectory */
#define MDL_BLOCK_ENVELOPE 2048u /**< in front of the trajectory */
#define MDL_BLOCK_YANG 512u      /**< in the trajectory's and the rate dependence's place */
#define MDL_BLOCK_BEHIND 4096u   /**< a pole behind the hysteresis */

/** One mode of the creep ladder: gain * 1 / (1 + tau s). */
typedef struct {
    mdl_lag_params lag;
    mdl_real gain; /**< share of the displacement */
} mdl_creep_mode;

/** Parameters of a predictor for one sample time; constant data, for instance generated. */
typedef struct {
    mdl_real u_min_volts;  /**< command at x = 0 */
    mdl_real margin_volts; /**< see mdl_traj_init */
    mdl_major major;
    uint16_t blocks;   /**< MDL_BLOCK_... that act; 0: the baseline */
    uint16_t substeps; /**< 1 to 64; 0 means 1 */
    mdl_real smooth; /**< the command between samples, 0 to 1: 0 linear, 1 a parabola that bends as
                      * in the samples before, straight where these bend another way or not at
                      * all. It may turn between samples, within the range; acts in substeps */
    mdl_saturation_params saturation;
    uint16_t rest_free; /**< 1: what rests has been at u_max and u_min themselves, as if nothing had
                         * clipped; all that follows, a history too, is clipped */
    mdl_slew_params slew; /**< per substep */
    mdl_lag_params lag;   /**< the trajectory is led to its turns between samples, too */
    mdl_real load_lean;   /**< share by which the lag's time constant is larger at u_max than in the
                           * middle, and smaller at u_min, as of a load whose capacitance grows with
                           * the voltage; -0.5 to 0.5, 0: none. Between, the lag is a parabola in w,
                           * the rise of 1 / (time constant) as a share: off by 0.01 of 1 at 0.4 */
    mdl_lag_params load_slope; /**< its terms of w, -4 to 4 */
    mdl_lag_params load_bend;  /**< and of w^2, -4 to 4 */
    mdl_envelope_params envelope;
    mdl_rate_params rate;
    mdl_bouc_params bouc;
    uint16_t creep_count;
    mdl_creep_mode creep[MDL_CREEP_MODES_MAX];
    mdl_lag_params behind; /**< of an overdamped stage, or a sensor's filter */
    uint16_t mode_count;
    mdl_mode_params mode[MDL_MODES_MAX];
    mdl_real dead_band_um;  /**< full width */
    mdl_real spread;        /**< of a rough contact's widths, see mdl_contact_start; 0: even */
    mdl_real spring_share;  /**< of the displacement that a spring carries across the gap, 0 to 1 */
    mdl_delay_params delay; /**< in substeps */
    mdl_real gain;
    mdl_real offset_um;
    const mdl_yang_params *yang; /**< for substeps; or NULL without its bit */
} mdl_chain_params;

/** State of the blocks between the command and the delay; reals only, saved as they are. */
typedef struct {
    mdl_real u_volts;       /**< command */
    mdl_real rise_volts;    /**< of the command in the last sample */
    mdl_real bend_volts;    /**< change of that from the sample before */
    mdl_real clipped_volts; /**< before the slew limit */
    mdl_real slewed_volts;  /**< behind the slew limit */
    mdl_real drive_volts;   /**< behind the input box */
    mdl_lag lag;
    mdl_lag velocity;
    mdl_lag speed;
    mdl_real enveloped_volts; /**< behind the envelopes, less u_min */
    mdl_real gripped_volts;   /**< behind the play of the rate block, less u_min */
    mdl_plays plays;
    mdl_bouc bouc;
    mdl_yang yang;
    mdl_real hysteresis_um;
    mdl_lag creep[MDL_CREEP_MODES_MAX];
    mdl_real crept_um;
    mdl_lag behind;
    mdl_real settled_um; /**< behind that pole */
    mdl_mode mode[MDL_MODES_MAX];
    mdl_contact contact; /**< where the gap's plays leave the target, without the spring */
    mdl_real delayed_um; /**< behind the delay */
} mdl_chain_blocks;

/** State of a predictor. The caller owns it, the parameters and both sides of the memory. */
typedef struct {
    const mdl_chain_params *params;
    mdl_traj traj;
    mdl_plays_params plays; /**< of f0 */
    uint16_t started;       /**< 0: the next sample sets every dynamic state to equilibrium */
    mdl_chain_blocks at;
    mdl_delay delay;
} mdl_chain;

/**
 * Checks the parameters and puts the chain to rest at u_min.
 * @return MDL_OK, MDL_ERR_PARAMETER, MDL_ERR_CAPACITY, MDL_ERR_NOT_FINITE
 */
mdl_status mdl_chain_init(mdl_chain *chain, const mdl_chain_params *params, mdl_tp_side *left,
                          mdl_tp_side *right);

/** Back to rest; the first sample then finds every dynamic state in equilibrium. */
void mdl_chain_reset(mdl_chain *chain);

/**
 * At rest, before the first sample: leads the hysteresis alone to a command, V, as part of its
 * history. The saturation acts on the way.
 * @return as mdl_chain_step with blocks
 */
mdl_status mdl_chain_lead(mdl_chain *chain, mdl_real u_volts);

/**
 * One sample: command in volts to displacement in um.
 * @return as mdl_traj_step; the statuses of substeps are combined. With blocks, a command
 *         beyond the margin is limited to its edge before the first one (MDL_CLAMPED).
 *         MDL_ERR_NOT_FINITE: nothing was changed, y_um is the last displacement again, before
 *         the first sample that at rest
 */
mdl_status mdl_chain_step(mdl_chain *chain, mdl_real u_volts, mdl_real *y_um);

/** Reals that mdl_chain_save will write. */
uint32_t mdl_chain_saved_length(const mdl_chain *chain);

/** Writes the whole state as reals. MDL_ERR_CAPACITY when capacity (in reals) is too small. */
mdl_status mdl_chain_save(const mdl_chain *chain, mdl_real *saved, uint32_t capacity);

/** Continues from a state that a chain of the same build and parameters has saved; else as before.
 */
mdl_status mdl_chain_resume(mdl_chain *chain, const mdl_real *saved, uint32_t length);

#endif
