#include "mdl_delay.h"

void mdl_delay_reset(mdl_delay *delay, mdl_real value)
{
    uint16_t i;
    for (i = 0; i < MDL_DELAY_MAX; i++) {
        delay->ring[i] = value;
    }
    delay->newest = 0;
}

mdl_real mdl_delay_step(mdl_delay *delay, const mdl_delay_params *params, mdl_real value)
{
    mdl_real sum = MDL_C(0.0);
    uint16_t at = (uint16_t)(delay->newest + 1u);
    uint16_t i;
    at = at < MDL_DELAY_MAX ? at : 0;
    delay->newest = at;
    delay->ring[at] = value;
    at = (uint16_t)(at + (at < params->whole ? MDL_DELAY_MAX : 0) - params->whole);
    for (i = 0; i < 4u; i++) {
        sum += params->weight[i] * delay->ring[at];
        at = (uint16_t)((at > 0 ? at : MDL_DELAY_MAX) - 1u);
    }
    return sum;
}
