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

/** Back to rest at u_min. */
void batch_reset(batch *b);

/**
 * Runs n samples: u in volts to y in um. status and turning_points hold n values each or are
 * NULL. A refused sample repeats the last y and the run goes on.
 */
void batch_run(batch *b, const mdl_real *u_volts, mdl_real *y_um, int32_t *status,
               uint32_t *turning_points, size_t n);

/** Reals that batch_save writes. */
uint32_t batch_saved_length(const batch *b);

/** See mdl_traj_save and mdl_traj_resume. */
int32_t batch_save(const batch *b, mdl_real *saved, uint32_t capacity);
int32_t batch_resume(batch *b, const mdl_real *saved, uint32_t length);

/** N_u of this build. */
uint32_t batch_n_u(void);

#endif
