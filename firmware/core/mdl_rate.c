#include "mdl_rate.h"

#include "mdl_power.h"

/* Half way between the two branches of the major loop at x, um. */
static mdl_real middle(const mdl_major *major, mdl_real x)
{
    mdl_real range = major->range_volts;
    return major->at_zero_um + MDL_C(0.5) * (mdl_major_swing(major, MDL_C(0.0), x) +
                                             mdl_major_swing(major, MDL_C(0.0), range) -
                                             mdl_major_swing(major, x, range));
}

mdl_real mdl_rate_signed_power(mdl_real v, mdl_real power)
{
    mdl_real size = mdl_power(v < MDL_C(0.0) ? -v : v, power);
    return v < MDL_C(0.0) ? -size : size;
}

mdl_real mdl_rate_power(mdl_lag *state, const mdl_rate_params *params, mdl_real rise_volts)
{
    mdl_real v = mdl_lag_step(state, &params->filter, rise_volts) * params->v_scale;
    return mdl_rate_signed_power(v, params->power);
}

mdl_real mdl_rate_added(const mdl_rate_params *params, const mdl_major *major, mdl_real s,
                        mdl_real x_volts, mdl_real y_um)
{
    mdl_real added = params->damping_um * s;
    if (params->widening != MDL_C(0.0)) {
        mdl_real size = s < MDL_C(0.0) ? -s : s;
        added += params->widening * size * (y_um - middle(major, x_volts));
    }
    return added;
}
