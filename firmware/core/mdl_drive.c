#include "mdl_drive.h"

#include "mdl_power.h"

static mdl_real clamp(mdl_real v, mdl_real low, mdl_real high)
{
    if (v < low) {
        return low;
    }
    return v > high ? high : v;
}

mdl_real mdl_saturation(const mdl_saturation_params *params, mdl_real u_volts)
{
    mdl_real knee = params->knee_volts;
    mdl_real per_knee;
    if (!(knee > MDL_C(0.0))) {
        return clamp(u_volts, params->low_volts, params->high_volts);
    }
    /* 20 knees away the result is the limit itself; without this a huge command would overflow. */
    u_volts = clamp(u_volts, params->low_volts - MDL_C(20.0) * knee,
                    params->high_volts + MDL_C(20.0) * knee);
    per_knee = MDL_C(1.0) / knee;
    return u_volts + knee * (mdl_softplus((params->low_volts - u_volts) * per_knee) -
                             mdl_softplus((u_volts - params->high_volts) * per_knee));
}

mdl_real mdl_slew(mdl_real step_volts, mdl_real last_volts, mdl_real u_volts)
{
    return last_volts + clamp(u_volts - last_volts, -step_volts, step_volts);
}
