#include "batch.h"

#include <stdlib.h>
#include <string.h>

struct batch {
    mdl_chain_params params;
    mdl_chain chain;
    mdl_shape shape;
    mdl_yang_params yang;
    mdl_tp_side left;
    mdl_tp_side right;
};

static batch *finish(batch *b, mdl_status made, mdl_real u_min_volts, mdl_real margin_volts,
                     int32_t *status)
{
    if (made == MDL_OK) {
        batch_clear_blocks(b);
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

int32_t batch_set_polynomial(batch *b, const mdl_real *c, uint16_t degree)
{
    const mdl_shape *shape = b->params.major.shape;
    mdl_status status =
        mdl_major_init_polynomial(&b->params.major, b->params.major.range_volts, c, degree);
    b->params.major.shape = shape;
    return status == MDL_OK ? mdl_chain_init(&b->chain, &b->params, &b->left, &b->right) : status;
}

void batch_set_shape(batch *b, const mdl_real *g, const mdl_real *loop)
{
    b->params.major.shape = g != NULL ? &b->shape : NULL;
    b->shape.per_range = MDL_C(1.0) / b->params.major.range_volts;
    if (g != NULL) {
        memcpy(b->shape.g, g, sizeof b->shape.g);
        memcpy(b->shape.loop, loop, sizeof b->shape.loop);
    }
    mdl_chain_init(&b->chain, &b->params, &b->left, &b->right);
}

static void switch_on(batch *b, uint16_t block)
{
    b->params.blocks = (uint16_t)(b->params.blocks | block);
}

void batch_clear_blocks(batch *b)
{
    b->params.blocks = 0;
    b->params.substeps = 1;
    b->params.smooth = MDL_C(0.0);
    b->params.rest_free = 0;
    b->params.creep_count = 0;
    b->params.mode_count = 0;
    b->params.delay.whole = 0;
    b->params.spread = MDL_C(0.0);
    b->params.spring_share = MDL_C(0.0);
}

void batch_set_substeps(batch *b, uint16_t substeps, mdl_real smooth)
{
    b->params.substeps = substeps;
    b->params.smooth = smooth;
}

void batch_set_saturation(batch *b, mdl_real high_volts, mdl_real low_volts, mdl_real knee_volts,
                          mdl_real knee_power, uint16_t parabolic, uint16_t rest_free)
{
    b->params.saturation =
        (mdl_saturation_params){high_volts, low_volts, knee_volts, knee_power, parabolic};
    b->params.rest_free = rest_free;
    switch_on(b, MDL_BLOCK_SATURATION);
}

void batch_set_slew(batch *b, mdl_real rise_volts, mdl_real fall_volts, mdl_real knee_volts,
                    mdl_real decay, mdl_real early)
{
    b->params.slew = (mdl_slew_params){rise_volts, fall_volts, knee_volts, decay, early};
    switch_on(b, MDL_BLOCK_SLEW);
}

void batch_set_lag(batch *b, mdl_real decay, mdl_real ramp, mdl_real lean, mdl_real decay_slope,
                   mdl_real ramp_slope, mdl_real decay_bend, mdl_real ramp_bend)
{
    b->params.lag = (mdl_lag_params){decay, ramp};
    b->params.load_lean = lean;
    b->params.load_slope = (mdl_lag_params){decay_slope, ramp_slope};
    b->params.load_bend = (mdl_lag_params){decay_bend, ramp_bend};
    switch_on(b, MDL_BLOCK_LAG);
}

void batch_set_behind(batch *b, mdl_real decay, mdl_real ramp)
{
    b->params.behind = (mdl_lag_params){decay, ramp};
    switch_on(b, MDL_BLOCK_BEHIND);
}

void batch_set_rate(batch *b, mdl_real decay, mdl_real ramp, mdl_real v_scale, mdl_real power,
                    mdl_real v_knee, mdl_real at_knee, mdl_real damping_um, mdl_real widening,
                    mdl_real threshold_volts, mdl_real swelling, mdl_real lean, uint16_t of_speed,
                    mdl_real relax_decay, mdl_real relax_early, mdl_real relax_pull)
{
    b->params.rate = (mdl_rate_params){
        {decay, ramp}, v_scale,    power,    v_knee,
        at_knee,       damping_um, widening, threshold_volts,
        swelling,      lean,       of_speed, {relax_decay, relax_early, relax_pull}};
    switch_on(b, MDL_BLOCK_RATE);
}

void batch_set_envelope(batch *b, mdl_real per_volt, mdl_real rise_volts, mdl_real rise_skew,
                        mdl_real fall_volts, mdl_real fall_skew, mdl_real follow)
{
    b->params.envelope =
        (mdl_envelope_params){per_volt, rise_volts, rise_skew, fall_volts, fall_skew, follow};
    switch_on(b, MDL_BLOCK_ENVELOPE);
}

void batch_set_bouc(batch *b, mdl_real size_um, mdl_real per_volt, mdl_real power, mdl_real gamma)
{
    b->params.bouc = (mdl_bouc_params){size_um, per_volt, power, gamma};
    switch_on(b, MDL_BLOCK_BOUC);
}

int32_t batch_set_creep(batch *b, uint16_t count, const mdl_real *decay, const mdl_real *ramp,
                        const mdl_real *gain)
{
    uint16_t i;
    if (count > MDL_CREEP_MODES_MAX) {
        return MDL_ERR_CAPACITY;
    }
    b->params.creep_count = count;
    for (i = 0; i < count; i++) {
        b->params.creep[i] = (mdl_creep_mode){{decay[i], ramp[i]}, gain[i]};
    }
    switch_on(b, MDL_BLOCK_CREEP);
    return MDL_OK;
}

int32_t batch_set_modes(batch *b, uint16_t count, const mdl_real *phi, const mdl_real *gamma,
                        const mdl_real *share)
{
    uint16_t i;
    if (count > MDL_MODES_MAX) {
        return MDL_ERR_CAPACITY;
    }
    b->params.mode_count = count;
    for (i = 0; i < count; i++) {
        memcpy(b->params.mode[i].phi, phi + 4u * i, sizeof b->params.mode[i].phi);
        memcpy(b->params.mode[i].gamma, gamma + 2u * i, sizeof b->params.mode[i].gamma);
        b->params.mode[i].share = share[i];
    }
    switch_on(b, MDL_BLOCK_MODES);
    return MDL_OK;
}

void batch_set_backlash(batch *b, mdl_real dead_band_um, mdl_real spread, mdl_real spring_share)
{
    b->params.dead_band_um = dead_band_um;
    b->params.spread = spread;
    b->params.spring_share = spring_share;
    switch_on(b, MDL_BLOCK_BACKLASH);
}

int32_t batch_set_delay(batch *b, uint16_t whole, const mdl_real *weight)
{
    if (whole > MDL_DELAY_MAX - 4) {
        return MDL_ERR_CAPACITY;
    }
    b->params.delay.whole = whole;
    memcpy(b->params.delay.weight, weight, sizeof b->params.delay.weight);
    switch_on(b, MDL_BLOCK_DELAY);
    return MDL_OK;
}

void batch_set_gain(batch *b, mdl_real gain, mdl_real offset_um)
{
    b->params.gain = gain;
    b->params.offset_um = offset_um;
    switch_on(b, MDL_BLOCK_GAIN);
}

static void copy_terms(mdl_yang_params *yang, const mdl_real *terms)
{
    memcpy(yang->k, terms, sizeof yang->k);
    memcpy(yang->c_um, terms + MDL_YANG_TERMS, sizeof yang->c_um);
    memcpy(yang->m, terms + 2 * MDL_YANG_TERMS, sizeof yang->m);
}

int32_t batch_set_yang(batch *b, uint16_t count, uint16_t two_side, const mdl_real *threshold_volts,
                       const mdl_real *weight, const mdl_real *terms, uint16_t harmonics,
                       const mdl_real *lambda, const mdl_real *values)
{
    mdl_yang_params *yang = &b->yang;
    mdl_real *const to[] = {
        &yang->pi.cubic,     &yang->pi.linear,       &yang->pi.at_zero_um, &yang->low_volts,
        &yang->high_volts,   &yang->margin_volts,    &yang->center_um,     &yang->hz_max,
        &yang->hz,           &yang->amplitude_volts, &yang->turn_volts,    &yang->rate_hz,
        &yang->filter.decay, &yang->filter.ramp,     &yang->v_scale,       &yang->widen_s};
    size_t i;
    if (count > MDL_PLAYS_MAX || harmonics > MDL_HARMONICS_MAX) {
        return MDL_ERR_CAPACITY;
    }
    yang->pi.count = count;
    yang->pi.two_side = two_side;
    memcpy(yang->pi.threshold_volts, threshold_volts, count * sizeof(mdl_real));
    memcpy(yang->pi.weight, weight, count * sizeof(mdl_real));
    copy_terms(yang, terms);
    yang->harmonics = harmonics;
    memcpy(yang->lambda, lambda, harmonics * sizeof(mdl_real));
    for (i = 0; i < sizeof to / sizeof to[0]; i++) {
        *to[i] = values[i];
    }
    b->params.yang = yang;
    switch_on(b, MDL_BLOCK_YANG);
    return mdl_chain_init(&b->chain, &b->params, &b->left, &b->right);
}

void batch_history(batch *b, const mdl_real *u_volts, size_t n)
{
    size_t i;
    for (i = 0; i < n; i++) {
        (void)mdl_chain_lead(&b->chain, u_volts[i]);
    }
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
    return mdl_chain_saved_length(&b->chain);
}

int32_t batch_save(const batch *b, mdl_real *saved, uint32_t capacity)
{
    return mdl_chain_save(&b->chain, saved, capacity);
}

int32_t batch_resume(batch *b, const mdl_real *saved, uint32_t length)
{
    return mdl_chain_resume(&b->chain, saved, length);
}

uint32_t batch_n_u(void)
{
    return MDL_N_U;
}
