#include "batch.h"

#include <stdlib.h>

struct batch {
    mdl_chain_params params;
    mdl_chain chain;
    mdl_tp_side left;
    mdl_tp_side right;
};

static batch *finish(batch *b, mdl_status made, mdl_real u_min_volts, mdl_real margin_volts,
                     int32_t *status)
{
    if (made == MDL_OK) {
        b->params.u_min_volts = u_min_volts;
        b->params.margin_volts = margin_volts;
        made = mdl_chain_init(&b->chain, &b->params, &b->left, &b->right);
    }
    *status = made;
    if (made != MDL_OK) {
        free(b);
        return NULL;
    }
    return b;
}

batch *batch_new_polynomial(mdl_real u_min_volts, mdl_real range_volts, mdl_real margin_volts,
                            const mdl_real *c, uint16_t degree, int32_t *status)
{
    batch *b = malloc(sizeof *b);
    if (b == NULL) {
        *status = MDL_ERR_CAPACITY;
        return NULL;
    }
    return finish(b, mdl_major_init_polynomial(&b->params.major, range_volts, c, degree),
                  u_min_volts, margin_volts, status);
}

batch *batch_new_breakpoints(mdl_real u_min_volts, mdl_real margin_volts, const mdl_real *x_volts,
                             const mdl_real *y_um, uint16_t count, int32_t *status)
{
    batch *b = malloc(sizeof *b);
    if (b == NULL) {
        *status = MDL_ERR_CAPACITY;
        return NULL;
    }
    return finish(b, mdl_major_init_breakpoints(&b->params.major, x_volts, y_um, count),
                  u_min_volts, margin_volts, status);
}

void batch_free(batch *b)
{
    free(b);
}

void batch_reset(batch *b)
{
    mdl_chain_reset(&b->chain);
}

void batch_run(batch *b, const mdl_real *u_volts, mdl_real *y_um, int32_t *status,
               uint32_t *turning_points, size_t n)
{
    size_t i;
    for (i = 0; i < n; i++) {
        int32_t s = mdl_chain_step(&b->chain, u_volts[i], &y_um[i]);
        if (status != NULL) {
            status[i] = s;
        }
        if (turning_points != NULL) {
            turning_points[i] = mdl_traj_turning_points(&b->chain.traj);
        }
    }
}

uint32_t batch_saved_length(const batch *b)
{
    return mdl_traj_saved_length(&b->chain.traj);
}

int32_t batch_save(const batch *b, mdl_real *saved, uint32_t capacity)
{
    return mdl_traj_save(&b->chain.traj, saved, capacity);
}

int32_t batch_resume(batch *b, const mdl_real *saved, uint32_t length)
{
    return mdl_traj_resume(&b->chain.traj, saved, length);
}

uint32_t batch_n_u(void)
{
    return MDL_N_U;
}
