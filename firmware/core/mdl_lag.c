#include "mdl_lag.h"

void mdl_lag_reset(mdl_lag *lag)
{
    lag->e = MDL_C(0.0);
    lag->lost = MDL_C(0.0);
}

mdl_real mdl_lag_step(mdl_lag *lag, const mdl_lag_params *params, mdl_real rise)
{
    mdl_real change = lag->lost - (params->decay * lag->e + params->ramp * rise);
    mdl_real e = lag->e + change;
    lag->lost = change - (e - lag->e);
    lag->e = e;
    return e;
}
