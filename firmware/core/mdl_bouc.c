#include "mdl_bouc.h"

#include "mdl_power.h"

#define STEPS_PER_REACH MDL_C(16.0)

static mdl_real slope(const mdl_bouc_params *params, mdl_real z, int rises)
{
    mdl_real size = mdl_size(z);
    mdl_real against = (z < MDL_C(0.0)) == rises ? MDL_C(-1.0) : MDL_C(1.0);
    return MDL_C(1.0) - mdl_power(size, params->power) * (params->gamma + against);
}

mdl_real mdl_bouc_step(mdl_bouc *bouc, const mdl_bouc_params *params, mdl_real x_volts)
{
    mdl_real way = (x_volts - bouc->x_volts) * params->per_volt * STEPS_PER_REACH;
    int rises = way > MDL_C(0.0);
    mdl_real size = rises ? way : -way;
    mdl_real z = bouc->z;
    mdl_real step;
    uint16_t i, count;
    if (size > (mdl_real)(MDL_BOUC_STEPS_MAX - 1)) {
        size = (mdl_real)(MDL_BOUC_STEPS_MAX - 1); /* after so many reaches z is at its limit */
    }
    count = (uint16_t)((uint16_t)size + 1u);
    step = size / ((mdl_real)count * STEPS_PER_REACH);
    step = rises ? step : -step;
    for (i = 0; i < count; i++) {
        mdl_real middle = z + MDL_C(0.5) * step * slope(params, z, rises);
        z += step * slope(params, middle, rises);
    }
    bouc->x_volts = x_volts;
    bouc->z = z;
    return params->size_um * (z - bouc->rest);
}
