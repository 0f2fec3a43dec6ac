/**
 * @file batch.h
 * @brief The core as the Python package calls it: opaque handles, whole records per call.
 *
 * core.py hands this file to cffi; lines that start with # are left out there. Compiled twice,
 * as libmdl_f32.so (mdl_real is float) and libmdl_f64.so (double).
 */
#ifndef MDL_BATCH_H
#define MDL_BATCH_H

#include <stddef.h>

#include "mdl_chain.h"

typedef struct batch batch;

/** A predictor with a polynomial f0 (um / volts^k, ascending), or NULL with *status set. */
batch *batch_new_polynomial(mdl_real u_min_volts, mdl_real range_volts, mdl_real margin_volts,
                            const mdl_real *c, uint16_t degree, int32_t *status);

/** A predictor with a piecewise-linear f0 through (x volts, y um), or NULL with *status set. */
batch *batch_new_breakpoints(mdl_real u_min_volts, mdl_real margin_volts, const mdl_real *x_volts,
                             const mdl_real *y_um, uint16_t count, int32_t *status);

/** Frees what batch_new_... gave. */
void batch_free(batch *b);

/** Another polynomial f0 for the same range, um / volts^k, ascending; 0 or a negative status. */
int32_t batch_set_polynomial(batch *b, const mdl_real *c, uint16_t degree);

/** Terms of mdl_shape, um: 16 values, g[k-1][j-1] row by row; NULL takes them away;
 * and the two values of loop. */
void batch_set_shape(batch *b, const mdl_real *g, const mdl_real *loop);

/** Switches every block off. */
void batch_clear_blocks(batch *b);

/** Each sets a block's parameters (see mdl_chain_params) and switches it on. */
void batch_set_substeps(batch *b, uint16_t substeps, mdl_real smooth);
void batch_set_saturation(batch *b, mdl_real high_volts, mdl_real low_volts, mdl_real knee_volts,
                          mdl_real knee_power, uint16_t parabolic, uint16_t rest_free);
void batch_set_slew(batch *b, mdl_real rise_volts, mdl_real fall_volts, mdl_real knee_volts,
                    mdl_real decay, mdl_real early);
void batch_set_lag(batch *b, mdl_real decay, mdl_real ramp, mdl_real lean, mdl_real decay_slope,
                   mdl_real ramp_slope, mdl_real decay_bend, mdl_real ramp_bend);
void batch_set_behind(batch *b, mdl_real decay, mdl_real ramp);
void batch_set_rate(batch *b, mdl_real decay, mdl_real ramp, mdl_real v_scale, mdl_real power,
                    mdl_real v_knee, mdl_real at_knee, mdl_real damping_um, mdl_real widening,
                    mdl_real threshold_volts, mdl_real swelling, mdl_real lean, uint16_t of_speed,
                    mdl_real relax_decay, mdl_real relax_early, mdl_real relax_pull);
void batch_set_envelope(batch *b, mdl_real per_volt, mdl_real rise_volts, mdl_real rise_skew,
                        mdl_real fall_volts, mdl_real fall_skew, mdl_real follow);
void batch_set_bouc(batch *b, mdl_real size_um, mdl_real per_volt, mdl_real power, mdl_real gamma);
int32_t batch_set_creep(batch *b, uint16_t count, const mdl_real *decay, const mdl_real *ramp,
                        const mdl_real *gain);
int32_t batch_set_modes(batch *b, uint16_t count, const mdl_real *phi, const mdl_real *gamma,
                        const mdl_real *share);
void batch_set_backlash(batch *b, mdl_real dead_band_um, mdl_real spread, mdl_real spring_share);
int32_t batch_set_delay(batch *b, uint16_t whole, const mdl_real *weight);
void batch_set_gain(batch *b, mdl_real gain, mdl_real offset_um);

/**
 * The model of Yang et al. in the trajectory's place; 0 or a negative status.
 * @param threshold_volts, weight  count values each
 * @param terms   coefficients of k, of c and of m, four each, ascending powers of Hz
 * @param lambda  harmonics values
 * @param values  16 values, in the order of mdl_pi_params and mdl_yang_params: cubic, linear,
 *                at_zero_um; low, high and margin in volts, center_um, hz_max, hz, amplitude_volts,
 *                turn_volts, rate_hz, decay, ramp, v_scale, widen_s
 */
int32_t batch_set_yang(batch *b, uint16_t count, uint16_t two_side, const mdl_real *threshold_volts,
                       const mdl_real *weight, const mdl_real *terms, uint16_t harmonics,
                       const mdl_real *lambda, const mdl_real *values);

/** Back to rest at u_min. */
void batch_reset(batch *b);

/** Leads the hysteresis alone through n commands (mdl_chain_lead): what was before a record. */
void batch_history(batch *b, const mdl_real *u_volts, size_t n);

/**
 * Runs n samples: u in volts to y in um. status and turning_points hold n values each or are
 * NULL. A refused sample repeats the last y and the run goes on.
 */
void batch_run(batch *b, const mdl_real *u_volts, mdl_real *y_um, int32_t *status,
               uint32_t *turning_points, size_t n);

/** Reals that batch_save writes. */
uint32_t batch_saved_length(const batch *b);

/** See mdl_chain_save and mdl_chain_resume. */
int32_t batch_save(const batch *b, mdl_real *saved, uint32_t capacity);
int32_t batch_resume(batch *b, const mdl_real *saved, uint32_t length);

/** N_u of this build. */
uint32_t batch_n_u(void);

#endif
