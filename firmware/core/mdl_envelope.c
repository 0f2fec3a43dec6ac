#include "mdl_envelope.h"

/* How far w may lag behind x at z = x / range; 0 beyond the range. */
static mdl_real reach(mdl_real volts, mdl_real skew, mdl_real z)
{
    if (z <= MDL_C(0.0) || z >= MDL_C(1.0)) {
        return MDL_C(0.0);
    }
    return MDL_C(4.0) * volts * z * (MDL_C(1.0) - z) *
           (MDL_C(1.0) + skew * (MDL_C(2.0) * z - MDL_C(1.0)));
}

mdl_real mdl_envelope_step(const mdl_envelope_params *params, mdl_real last_volts, mdl_real x_volts)
{
    mdl_real z = x_volts * params->per_volt;
    mdl_real low = x_volts - reach(params->rise_volts, params->rise_skew, z);
    mdl_real high = x_volts + reach(params->fall_volts, params->fall_skew, z);
    if (last_volts < low) {
        return low;
    }
    return last_volts > high ? high : last_volts;
}
