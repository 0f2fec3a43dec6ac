/**
 * @file mdl_chain.h
 * @brief The signal path from the commanded voltage to the displacement.
 *
 * command u -> [input] -> hysteresis -> [creep] -> [mechanics] -> [sensor] -> y. The baseline
 * predictor is the hysteresis box alone. This is what the firmware and the tools call.
 */
#ifndef MDL_CHAIN_H
#define MDL_CHAIN_H

#include "mdl_traj.h"

/** Parameters of a predictor; constant data, for instance of a generated header. */
typedef struct {
    mdl_real u_min_volts;  /**< command at x = 0 */
    mdl_real margin_volts; /**< see mdl_traj_init */
    mdl_major major;
} mdl_chain_params;

/** State of a predictor. The caller owns it, the parameters and both sides of the memory. */
typedef struct {
    const mdl_chain_params *params;
    mdl_traj traj;
} mdl_chain;

/**
 * @return MDL_OK, MDL_ERR_PARAMETER, MDL_ERR_NOT_FINITE
 */
mdl_status mdl_chain_init(mdl_chain *chain, const mdl_chain_params *params, mdl_tp_side *left,
                          mdl_tp_side *right);

/** Back to rest at u_min. */
void mdl_chain_reset(mdl_chain *chain);

/**
 * One sample: command in volts to displacement in um.
 * @return as mdl_traj_step
 */
mdl_status mdl_chain_step(mdl_chain *chain, mdl_real u_volts, mdl_real *y_um);

#endif
