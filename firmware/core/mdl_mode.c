#include "mdl_mode.h"

void mdl_mode_reset(mdl_mode *mode)
{
    mode->e = MDL_C(0.0);
    mode->q = MDL_C(0.0);
}

mdl_real mdl_mode_step(mdl_mode *mode, const mdl_mode_params *params, mdl_real rise)
{
    mdl_real e = mode->e;
    mdl_real q = mode->q;
    mode->e = e + (params->phi[0][0] * e + params->phi[0][1] * q + params->gamma[0] * rise);
    mode->q = q + (params->phi[1][0] * e + params->phi[1][1] * q + params->gamma[1] * rise);
    return params->share * mode->e;
}
