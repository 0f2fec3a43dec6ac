#include "mdl_chain.h"

mdl_status mdl_chain_init(mdl_chain *chain, const mdl_chain_params *params, mdl_tp_side *left,
                          mdl_tp_side *right)
{
    if (!mdl_is_finite(params->u_min_volts)) {
        return MDL_ERR_NOT_FINITE;
    }
    chain->params = params;
    return mdl_traj_init(&chain->traj, &params->major, left, right, params->margin_volts);
}

void mdl_chain_reset(mdl_chain *chain)
{
    mdl_traj_reset(&chain->traj);
}

mdl_status mdl_chain_step(mdl_chain *chain, mdl_real u_volts, mdl_real *y_um)
{
    return mdl_traj_step(&chain->traj, u_volts - chain->params->u_min_volts, y_um);
}
