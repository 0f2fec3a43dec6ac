#include "mdl_drive.h"

#include "mdl_power.h"

static mdl_real clamp(mdl_real v, mdl_real low, mdl_real high)
{
    if (v < low) {
        return low;
    }
    return v > high ? high : v;
}

/* How far the drive follows beyond where its knee begins; excess >= 0, in volts. */
static mdl_real followed(const mdl_saturation_params *params, mdl_real excess)
{
    mdl_real e = excess / params->knee_volts;
    mdl_real p = params->knee_power;
    mdl_real bits = e > MDL_C(1.0) ? p * mdl_log2(e) : MDL_C(0.0);
    if (bits > MDL_C(30.0)) {
        return params->knee_volts; /* the limit, to all digits; further e^p would overflow */
    }
    return excess * mdl_exp2(-mdl_log2(MDL_C(1.0) + mdl_power(e, p)) / p);
}

static mdl_real rounded(const mdl_saturation_params *params, mdl_real u)
{
    mdl_real top = params->high_volts - params->knee_volts;
    mdl_real bottom = params->low_volts + params->knee_volts;
    if (u > top) {
        return top + followed(params, u - top);
    }
    return u < bottom ? bottom - followed(params, bottom - u) : u;
}

mdl_real mdl_saturation(const mdl_saturation_params *params, mdl_real u_volts)
{
    mdl_real knee = params->knee_volts;
    mdl_real per_knee;
    if (!(knee > MDL_C(0.0))) {
        return clamp(u_volts, params->low_volts, params->high_volts);
    }
    if (params->knee_power > MDL_C(0.0)) {
        return rounded(params, u_volts);
    }
    /* 20 knees away the result is the limit itself; without this a huge command would overflow. */
    u_volts = clamp(u_volts, params->low_volts - MDL_C(20.0) * knee,
                    params->high_volts + MDL_C(20.0) * knee);
    per_knee = MDL_C(1.0) / knee;
    return u_volts + knee * (mdl_softplus((params->low_volts - u_volts) * per_knee) -
                             mdl_softplus((u_volts - params->high_volts) * per_knee));
}

mdl_real mdl_slew(const mdl_slew_params *params, mdl_real last_volts, mdl_real u_volts)
{
    return last_volts + clamp(u_volts - last_volts, -params->fall_volts, params->rise_volts);
}
