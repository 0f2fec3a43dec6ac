#include "mdl_pi.h"

mdl_status mdl_pi_check(const mdl_pi_params *params)
{
    mdl_real below = MDL_C(-1.0);
    uint16_t i;
    if (params->count > MDL_PLAYS_MAX) {
        return MDL_ERR_CAPACITY;
    }
    for (i = 0; i < params->count; i++) {
        if (!mdl_is_finite(params->threshold_volts[i]) || !mdl_is_finite(params->weight[i])) {
            return MDL_ERR_NOT_FINITE;
        }
    }
    if (!mdl_is_finite(params->cubic) || !mdl_is_finite(params->linear) ||
        !mdl_is_finite(params->at_zero_um)) {
        return MDL_ERR_NOT_FINITE;
    }
    for (i = 0; i < params->count; i++) {
        mdl_real r = params->threshold_volts[i];
        if (r < MDL_C(0.0) || !(r > below)) {
            return MDL_ERR_PARAMETER;
        }
        below = r;
    }
    return params->two_side <= 1u ? MDL_OK : MDL_ERR_PARAMETER;
}

void mdl_pi_reset(mdl_pi *pi)
{
    uint16_t i;
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        pi->play_volts[i] = MDL_C(0.0);
    }
}

mdl_real mdl_pi_step(mdl_pi *pi, const mdl_pi_params *params, mdl_real v_volts,
                     mdl_real widen_volts)
{
    mdl_real y =
        params->at_zero_um + (params->cubic * v_volts * v_volts + params->linear) * v_volts;
    uint16_t i;
    for (i = 0; i < params->count; i++) {
        mdl_real r = params->threshold_volts[i] + widen_volts;
        mdl_real low = v_volts - r;
        mdl_real high = params->two_side != 0 ? v_volts + r : v_volts;
        mdl_real f = pi->play_volts[i];
        f = f < high ? f : high;
        f = f > low ? f : low;
        pi->play_volts[i] = f;
        y += params->weight[i] * f;
    }
    return y;
}
