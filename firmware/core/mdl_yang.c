#include "mdl_yang.h"

#include "mdl_rate.h"

#define TWO_PI MDL_C(6.2831853071795865)
#define M_MAX MDL_C(4.0)
#define M_PLACES 32u

static mdl_real polynomial(const mdl_real *b, mdl_real f)
{
    return ((b[3] * f + b[2]) * f + b[1]) * f + b[0];
}

/* A polynomial of eq. (13), held above the highest identified frequency. */
static mdl_real held(const mdl_yang_params *p, const mdl_real *b, mdl_real hz)
{
    return polynomial(b, hz < p->hz_max ? hz : p->hz_max);
}

static mdl_status check_finite(const mdl_yang_params *p)
{
    const mdl_real one[] = {p->low_volts, p->high_volts,   p->margin_volts,    p->center_um,
                            p->hz_max,    p->hz,           p->amplitude_volts, p->turn_volts,
                            p->rate_hz,   p->filter.decay, p->filter.ramp,     p->v_scale,
                            p->widen_s};
    return mdl_all_finite(one, sizeof one / sizeof one[0]) &&
                   mdl_all_finite(p->k, MDL_YANG_TERMS) &&
                   mdl_all_finite(p->c_um, MDL_YANG_TERMS) &&
                   mdl_all_finite(p->m, MDL_YANG_TERMS) && mdl_all_finite(p->lambda, p->harmonics)
               ? MDL_OK
               : MDL_ERR_NOT_FINITE;
}

/* m of every frequency that can come: the given one, or any that can be found. */
static int powers_are_in_range(const mdl_yang_params *p)
{
    uint16_t i;
    for (i = 0; i <= M_PLACES; i++) {
        mdl_real at = p->hz_max * (mdl_real)i / (mdl_real)M_PLACES;
        mdl_real m = held(p, p->m, p->hz > MDL_C(0.0) ? p->hz : at);
        if (!(m > MDL_C(0.0)) || !(m <= M_MAX)) {
            return 0;
        }
    }
    return 1;
}

mdl_status mdl_yang_check(const mdl_yang_params *params)
{
    const mdl_yang_params *p = params;
    mdl_status status = mdl_pi_check(&p->pi);
    if (status != MDL_OK) {
        return status;
    }
    if (p->harmonics > MDL_HARMONICS_MAX) {
        return MDL_ERR_CAPACITY;
    }
    status = check_finite(p);
    if (status != MDL_OK) {
        return status;
    }
    if (p->harmonics < 1u || !(p->high_volts > p->low_volts) || p->margin_volts < MDL_C(0.0) ||
        !(p->hz_max > MDL_C(0.0)) || p->hz < MDL_C(0.0) || p->amplitude_volts < MDL_C(0.0) ||
        !(p->turn_volts > MDL_C(0.0)) || !(p->rate_hz > MDL_C(0.0)) || !(p->v_scale < MDL_C(0.0)) ||
        p->widen_s < MDL_C(0.0)) {
        return MDL_ERR_PARAMETER;
    }
    return powers_are_in_range(p) ? MDL_OK : MDL_ERR_PARAMETER;
}

/* K, C, m and Q for the frequency and amplitude that are given or have been found. */
static void tune(mdl_yang *yang, const mdl_yang_params *p)
{
    mdl_real hz = p->hz > MDL_C(0.0) ? p->hz : p->rate_hz / yang->cycle.period;
    mdl_real amplitude =
        p->amplitude_volts > MDL_C(0.0) ? p->amplitude_volts : yang->cycle.amplitude_volts;
    uint16_t i;
    yang->k_above_1 = MDL_C(-1.0);
    yang->c_um = MDL_C(0.0);
    for (i = 0; i < p->harmonics; i++) {
        mdl_real at = hz * (mdl_real)(i + 1u);
        yang->k_above_1 += p->lambda[i] * held(p, p->k, at);
        yang->c_um += p->lambda[i] * held(p, p->c_um, at);
    }
    yang->m = held(p, p->m, hz);
    yang->per_q = MDL_C(1.0) / (TWO_PI * hz * amplitude);
    yang->beyond = hz * (mdl_real)p->harmonics > p->hz_max ? MDL_C(1.0) : MDL_C(0.0);
}

/* Displacement at u, which is in range. */
static mdl_real displacement(mdl_yang *yang, const mdl_yang_params *p, mdl_real u)
{
    mdl_real v = mdl_lag_step(&yang->velocity, &p->filter, u - yang->last_volts) * p->v_scale;
    mdl_real y = mdl_pi_step(&yang->pi, &p->pi, u, p->widen_s * mdl_size(v));
    yang->last_volts = u;
    y += yang->k_above_1 * (y - p->center_um);
    return y + yang->c_um * mdl_rate_signed_power(v * yang->per_q, yang->m);
}

/* Outside the margin its edge is used. */
static mdl_real limited(const mdl_yang_params *p, mdl_real u, int *status)
{
    mdl_real low = p->low_volts - p->margin_volts;
    mdl_real high = p->high_volts + p->margin_volts;
    *status = u < p->low_volts || u > p->high_volts ? MDL_EXTRAPOLATED : MDL_OK;
    if (u < low || u > high) {
        *status = MDL_CLAMPED;
        return u < low ? low : high;
    }
    return u;
}

mdl_status mdl_yang_start(mdl_yang *yang, const mdl_yang_params *params, mdl_real u_volts,
                          mdl_real *y_um)
{
    int status;
    mdl_real u = limited(params, u_volts, &status);
    mdl_pi_reset(&yang->pi);
    mdl_lag_reset(&yang->velocity);
    mdl_cycle_start(&yang->cycle, u);
    yang->last_volts = u;
    yang->k_above_1 = MDL_C(0.0);
    yang->c_um = MDL_C(0.0);
    yang->m = MDL_C(1.0);
    yang->per_q = MDL_C(0.0);
    yang->beyond = MDL_C(0.0);
    if (params->hz > MDL_C(0.0) && params->amplitude_volts > MDL_C(0.0)) {
        tune(yang, params);
    }
    yang->y_um = displacement(yang, params, u);
    *y_um = yang->y_um;
    return (mdl_status)status;
}

mdl_status mdl_yang_step(mdl_yang *yang, const mdl_yang_params *params, mdl_real u_volts,
                         mdl_real *y_um)
{
    int status;
    mdl_real u;
    *y_um = yang->y_um;
    if (!mdl_is_finite(u_volts)) {
        return MDL_ERR_NOT_FINITE;
    }
    u = limited(params, u_volts, &status);
    if (mdl_cycle_step(&yang->cycle, params->turn_volts, u)) {
        tune(yang, params);
    }
    yang->y_um = displacement(yang, params, u);
    *y_um = yang->y_um;
    if (yang->beyond != MDL_C(0.0)) {
        status |= MDL_EXTRAPOLATED;
    }
    return (mdl_status)status;
}
