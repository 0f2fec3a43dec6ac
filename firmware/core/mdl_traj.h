/**
 * @file mdl_traj.h
 * @brief The trajectory of a symmetric, rate-independent hysteresis, constructed from Madelung's
 *        rules (Cao & Li, Sensors 2019, 19, 352).
 *
 * Input x = u - u_min in volts, output y in um. The trajectory starts at A_0 = (0, f0(0)) and
 * rises on the major ascending curve f0. Turning points are left (A_0, A_2, ...) or right (A_1,
 * A_3, ...); the chain x_A0 < x_A2 < ... < x < ... < x_A3 < x_A1 is kept in sorted arrays.
 *
 * Decided here, where the paper is silent:
 * - A first sample above the minimum was reached from it without a turn: y = f0(x).
 * - An input equal to a stored turning point has surpassed it. Both curves meet there.
 * - At the minimum every turning point is wiped out and the memory is empty (count 0). When the
 *   input rises again, the minimum is the new A_0 (count 1), as after a reset.
 * - Outside [0, range], up to the margin, the major loop is continued on both sides: f0 above, its
 *   central mirror below (MDL_EXTRAPOLATED). Beyond the margin the margin's edge is used
 *   (MDL_CLAMPED). Below the minimum the memory is empty; where the input turns there, a new A_0
 *   lies. A margin of 0 clamps to the identified range.
 * - NaN and infinity are refused and leave the state untouched.
 * - Equal successive inputs leave the state alone.
 *
 * The memory cannot overflow on code inputs. All stored abscissae and the present input are
 * different codes: left ones strictly ascend, right ones strictly descend, and every left one
 * lies below every right one, because a turning point is recorded only inside the innermost pair.
 * There are N_u codes, so l + r <= N_u. Turning points come in turn, so l is r or r + 1. Hence
 * l <= N_u / 2 and r <= N_u / 2. Off the code grid the arrays can fill: then a further turning
 * point is not recorded, the trajectory moves to and fro on the innermost curve (MDL_MEMORY_FULL),
 * and recording resumes when an outer turning point has been surpassed.
 */
#ifndef MDL_TRAJ_H
#define MDL_TRAJ_H

#include "mdl_major.h"

/** Left, and right, turning points that can be held: N_u / 2. */
#define MDL_TP_CAPACITY ((uint16_t)(MDL_N_U / 2L))

/** A point of the trajectory. */
typedef struct {
    mdl_real_bits x; /**< volts */
    mdl_real y_um;   /**< um */
} mdl_tp;

/**
 * The turning points of one side, the outermost first: left ones ascend strictly, right ones
 * descend. On the F28335 with N_u = 4096 a left and a right side together fill L4-L7 exactly.
 */
typedef struct {
    mdl_tp tp[MDL_N_U / 2L];
} mdl_tp_side;

MDL_STATIC_ASSERT(sizeof(mdl_tp_side) == MDL_N_U * sizeof(mdl_real), side_has_no_holes);

/** The turning points held on one side, the innermost on top. */
typedef struct {
    mdl_real_bits limit; /**< an input that reaches it leaves the innermost loop, see mdl_traj.c */
    mdl_tp *end;         /**< one past the innermost */
    const mdl_tp *floor; /**< beyond it, the innermost can be dropped without a search */
    mdl_tp *tp;          /**< the outermost, the caller's memory */
} mdl_tp_stack;

typedef struct mdl_traj mdl_traj;

/** A part of a step: from here to x in volts, gives y in um. */
typedef mdl_status (*mdl_traj_part)(mdl_traj *traj, mdl_real x_volts, mdl_real *y_um);

/** The parts for one kind of f0, for an ascending [0] and for a descending [1] curve. */
typedef struct {
    mdl_traj_part step[2]; /**< a whole step from such a curve */
    mdl_traj_part put[2];  /**< the output on such a curve */
} mdl_traj_parts;

/**
 * State of a trajectory. The caller owns it, both sides of the memory and the major curve. What
 * every sample needs comes first.
 */
struct mdl_traj {
    mdl_tp last;                    /**< (x_1, y_1) of eq. (10), the point before */
    mdl_tp_stack left;              /**< one more than right ones if rising, else as many */
    mdl_tp_stack right;             /**< right turning points */
    mdl_traj_part step;             /**< one of part.step: tells which curve it is on */
    mdl_traj_parts part;            /**< for this kind of f0 */
    mdl_real c[MDL_DEGREE_MAX + 1]; /**< f0's coefficients, if it is a polynomial */
    mdl_key open_end;               /**< inputs from 0 to below this are compared as bits */
    mdl_key range_end;              /**< the least key above the identified range */
    const mdl_major *major;
    mdl_real f0_min_um;     /**< f0(x_A0) */
    mdl_real full_swing_um; /**< from the minimum to the end of the identified range */
    mdl_real margin_volts;  /**< extrapolated at most this far, >= 0 */
};

/**
 * Ties a trajectory to its curve and memory, and resets it.
 * @param margin_volts  how far beyond [0, range] f0 is extrapolated, volts, >= 0
 * @return MDL_OK; MDL_ERR_PARAMETER for a negative margin, or one within which f0 overflows;
 *         MDL_ERR_NOT_FINITE
 */
mdl_status mdl_traj_init(mdl_traj *traj, const mdl_major *major, mdl_tp_side *left,
                         mdl_tp_side *right, mdl_real margin_volts);

/** Back to A_0: at the minimum, about to rise, one turning point. */
void mdl_traj_reset(mdl_traj *traj);

/**
 * One sample.
 * @param x_volts  u - u_min, finite
 * @param y_um     displacement, eq. (6); on error the last one again
 * @return MDL_OK, or the bits MDL_EXTRAPOLATED, MDL_CLAMPED, MDL_MEMORY_FULL; MDL_ERR_NOT_FINITE
 */
mdl_status mdl_traj_step(mdl_traj *traj, mdl_real x_volts, mdl_real *y_um);

/** Left plus right turning points now held: 0 to N_u. */
uint32_t mdl_traj_turning_points(const mdl_traj *traj);

/** Reals that mdl_traj_save will write: 4 + 2 per turning point. */
uint32_t mdl_traj_saved_length(const mdl_traj *traj);

/**
 * Writes the state as reals: pairs, falling, last x, last y, then x and y (volts, um) of the left
 * and of the right turning points, outermost first.
 * @return MDL_OK; MDL_ERR_CAPACITY when capacity (in reals) is below mdl_traj_saved_length
 */
mdl_status mdl_traj_save(const mdl_traj *traj, mdl_real *saved, uint32_t capacity);

/**
 * Continues from a saved state of the same model. The next step gives what it would have given.
 * @return MDL_OK; MDL_ERR_NOT_FINITE, MDL_ERR_CAPACITY, MDL_ERR_STATE (not a chain of nested
 *         turning points between the margins, from an A_0 at or below the minimum): the trajectory
 *         is as before
 */
mdl_status mdl_traj_resume(mdl_traj *traj, const mdl_real *saved, uint32_t length);

#endif
