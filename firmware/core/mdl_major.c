#include "mdl_major.h"

static int starts_at_zero_and_ascends(const mdl_real *x, uint16_t count)
{
    uint16_t i;
    if (mdl_key_of(x[0] + MDL_C(0.0)) != 0) {
        return 0;
    }
    for (i = 1; i < count; i++) {
        if (!(x[i] > x[i - 1])) {
            return 0;
        }
    }
    return 1;
}

/* A tiny step in x, or huge values, would give a slope of infinity, and NaN at the breakpoint. */
static int slopes_are_finite(const mdl_real *x, const mdl_real *y, uint16_t count)
{
    uint16_t i;
    for (i = 1; i < count; i++) {
        if (!mdl_is_finite((y[i] - y[i - 1]) / (x[i] - x[i - 1]))) {
            return 0;
        }
    }
    return 1;
}

mdl_status mdl_major_init_polynomial(mdl_major *major, mdl_real range_volts, const mdl_real *c,
                                     uint16_t degree)
{
    uint16_t k;
    if (degree > MDL_DEGREE_MAX) {
        return MDL_ERR_PARAMETER;
    }
    if (!mdl_is_finite(range_volts) || !mdl_all_finite(c, (uint16_t)(degree + 1u))) {
        return MDL_ERR_NOT_FINITE;
    }
    if (!(range_volts > MDL_C(0.0))) {
        return MDL_ERR_PARAMETER;
    }
    major->kind = MDL_POLYNOMIAL;
    major->range_volts = range_volts;
    major->shape = 0;
    major->degree = degree;
    major->count = 0;
    for (k = 0; k <= MDL_DEGREE_MAX; k++) {
        major->c[k] = k <= degree ? c[k] : MDL_C(0.0);
    }
    major->at_zero_um = c[0];
    return MDL_OK;
}

mdl_status mdl_major_init_breakpoints(mdl_major *major, const mdl_real *x_volts,
                                      const mdl_real *y_um, uint16_t count)
{
    uint16_t i;
    if (count > MDL_BREAKPOINTS_MAX) {
        return MDL_ERR_CAPACITY;
    }
    if (count < 2) {
        return MDL_ERR_PARAMETER;
    }
    if (!mdl_all_finite(x_volts, count) || !mdl_all_finite(y_um, count)) {
        return MDL_ERR_NOT_FINITE;
    }
    if (!starts_at_zero_and_ascends(x_volts, count) || !slopes_are_finite(x_volts, y_um, count)) {
        return MDL_ERR_PARAMETER;
    }
    major->kind = MDL_PIECEWISE_LINEAR;
    major->degree = 0;
    major->count = count;
    major->range_volts = x_volts[count - 1];
    major->at_zero_um = y_um[0];
    major->shape = 0;
    for (i = 0; i < count; i++) {
        uint16_t left = i + 1u < count ? i : (uint16_t)(count - 2u);
        major->x_volts[i] = x_volts[i];
        major->y_um[i] = y_um[i];
        major->slope[i] = (y_um[left + 1] - y_um[left]) / (x_volts[left + 1] - x_volts[left]);
    }
    return MDL_OK;
}

mdl_status mdl_major_init_play(mdl_major *major, mdl_real range_volts, const mdl_real *weight,
                               const mdl_real *threshold, uint16_t count)
{
    uint16_t i;
    mdl_real slope = MDL_C(0.0);
    mdl_real y = MDL_C(0.0);
    if (count > MDL_BREAKPOINTS_MAX) {
        return MDL_ERR_CAPACITY;
    }
    if (count < 1) {
        return MDL_ERR_PARAMETER;
    }
    if (!mdl_is_finite(range_volts) || !mdl_all_finite(weight, count) ||
        !mdl_all_finite(threshold, count)) {
        return MDL_ERR_NOT_FINITE;
    }
    if (!starts_at_zero_and_ascends(threshold, count) || !(range_volts > threshold[count - 1])) {
        return MDL_ERR_PARAMETER;
    }
    major->kind = MDL_PIECEWISE_LINEAR;
    major->degree = 0;
    major->count = count;
    major->range_volts = range_volts;
    major->at_zero_um = MDL_C(0.0);
    major->shape = 0;
    for (i = 0; i < count; i++) {
        if (i > 0) {
            y += slope * (threshold[i] - threshold[i - 1]);
        }
        slope += weight[i];
        major->x_volts[i] = threshold[i];
        major->y_um[i] = y;
        major->slope[i] = slope;
    }
    return MDL_OK;
}

static mdl_real eval_piecewise_linear(const mdl_major *major, mdl_real x)
{
    uint16_t low = 0; /* the last breakpoint at or left of x, or the first one */
    uint16_t step = major->count;
    while (step > 1) {
        uint16_t half = (uint16_t)(step / 2u);
        if (x >= major->x_volts[low + half]) {
            low = (uint16_t)(low + half);
        }
        step = (uint16_t)(step - half);
    }
    return major->y_um[low] + major->slope[low] * (x - major->x_volts[low]);
}

mdl_real mdl_major_eval(const mdl_major *major, mdl_real x_volts)
{
    return major->kind == MDL_POLYNOMIAL
               ? mdl_major_horner(major->c, major->degree, x_volts) + major->c[0]
               : eval_piecewise_linear(major, x_volts);
}

mdl_real mdl_major_swing(const mdl_major *major, mdl_real a_volts, mdl_real b_volts)
{
    mdl_real d = b_volts - a_volts;
    mdl_real swing = major->kind == MDL_POLYNOMIAL
                         ? mdl_major_horner(major->c, major->degree, d)
                         : eval_piecewise_linear(major, d) - major->at_zero_um;
    if (major->shape != 0) {
        swing += mdl_shape_swing(major->shape, a_volts, b_volts);
    }
    return swing;
}

mdl_real mdl_major_first_slope(const mdl_major *major)
{
    return major->kind == MDL_POLYNOMIAL ? major->c[1] : major->slope[0];
}
