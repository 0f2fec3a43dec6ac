#include "mdl_bouc.h"

#include "mdl_power.h"

static mdl_real slope(const mdl_bouc_params *params, mdl_real z, int rises)
{
    mdl_real size = z < MDL_C(0.0) ? -z : z;
    mdl_real against = (z < MDL_C(0.0)) == rises ? MDL_C(-1.0) : MDL_C(1.0);
    return MDL_C(1.0) - mdl_power(size, params->power) * (params->asymmetry + against);
}

mdl_real mdl_bouc_step(mdl_bouc *bouc, const mdl_bouc_params *params, mdl_real x_volts)
{
    mdl_real way = (x_volts - bouc->x_volts) * params->per_volt;
    mdl_real steps = (way < MDL_C(0.0) ? -way : way) * MDL_C(16.0);
    uint16_t count = steps < (mdl_real)MDL_BOUC_STEPS_MAX ? (uint16_t)((uint16_t)steps + 1u)
                                                          : MDL_BOUC_STEPS_MAX;
    mdl_real step = way / (mdl_real)count;
    int rises = way > MDL_C(0.0);
    mdl_real z = bouc->z;
    uint16_t i;
    for (i = 0; i < count; i++) {
        mdl_real middle = z + MDL_C(0.5) * step * slope(params, z, rises);
        z += step * slope(params, middle, rises);
    }
    bouc->x_volts = x_volts;
    bouc->z = z;
    return params->size_um * (z - bouc->rest);
}
