/*
 * Linked into a third image of the firmware with --wrap=mdl_chain_step: the paper's algorithm in
 * the predictor's place, for its time on the pin. For the baseline on a polynomial, from rest.
 */
#include "cao2019.h"
#include "mdl_params.h"

static cao2019_points ltp, rtp;
static cao2019 state;

mdl_status __wrap_mdl_chain_step(mdl_chain *chain, mdl_real u_volts, mdl_real *y_um);

mdl_status __wrap_mdl_chain_step(mdl_chain *chain, mdl_real u_volts, mdl_real *y_um)
{
    (void)chain;
    if (state.c == 0) {
        const mdl_major *major = &mdl_params.chain.major;
        cao2019_init(&state, major->c, major->degree, &ltp, &rtp);
    }
    (void)cao2019_step(&state, u_volts - mdl_params.chain.u_min_volts, y_um);
    return MDL_OK;
}
