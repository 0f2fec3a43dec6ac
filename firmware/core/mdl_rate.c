#include "mdl_rate.h"

#include "mdl_power.h"

mdl_real mdl_rate_signed_power(mdl_real v, mdl_real power)
{
    mdl_real size = mdl_power(mdl_size(v), power);
    return v < MDL_C(0.0) ? -size : size;
}

mdl_real mdl_rate_law(mdl_lag *state, const mdl_rate_params *params, mdl_real rise_volts)
{
    mdl_real v = mdl_lag_step(state, &params->filter, rise_volts) * params->v_scale;
    mdl_real size = mdl_size(v);
    size = mdl_power(size + params->v_knee, params->power) - params->at_knee;
    size = size > MDL_C(0.0) ? size : MDL_C(0.0); /* the power and at_knee are rounded */
    return v < MDL_C(0.0) ? -size : size;
}
