/*
 * Runs one algorithm over a record of reals, with the timing pin high around each step. The first
 * word of the input is the algorithm; ours and the paper's take the degree of model.h's f0 as a
 * second word, the whole chain the blocks that act, and above 16 bits which of the paths of
 * params.py it runs. Then come volts as the bits of floats.
 */
#include "board.h"
#include "cao2019.h"
#include "mdl_params.h"
#include "mdl_traj.h"
#include "model.h"
#include "play.h"

/* Beside mdl_params, which is linked: other paths' parameters, which are named alike. */
#define mdl_params viscous_params
#include "viscous/mdl_params.c"
#undef mdl_params
#define mdl_params by_square_params
#include "by_square/mdl_params.c"
#undef mdl_params

enum { OURS = 0, REFERENCE = 1, PLAY = 2, NOTHING = 3, CHAIN = 4 };

#define CHAIN_SHAPE UINT32_C(0x8000) /* beside the bits MDL_BLOCK_... */

/* One algorithm runs at a time: the memories share their place. */
static union {
    mdl_tp_side ours;
    cao2019_points reference;
} left, right;
static mdl_major major;
static mdl_traj traj;
static cao2019 reference;
static play ten;
static mdl_chain_params params;
static mdl_chain chain;

static void write_result(mdl_real y, uint16_t status, uint16_t count)
{
    board_write((uint32_t)mdl_bits(y), (uint32_t)status | (uint32_t)count << 16);
}

static void run_ours(void)
{
    mdl_real_bits x;
    mdl_real y = 0.0f;
    uint32_t word = 0;
    (void)board_read(&word);
    (void)mdl_major_init_polynomial(&major, model_range_volts, model_f0, (uint16_t)word);
    (void)mdl_traj_init(&traj, &major, &left.ours, &right.ours, model_margin_volts);
    while (board_read(&word)) {
        mdl_status status;
        x.bits = (mdl_key)word;
        board_pin_high();
        status = mdl_traj_step(&traj, x.real, &y);
        board_pin_low();
        write_result(y, (uint16_t)status, (uint16_t)mdl_traj_turning_points(&traj));
    }
}

static void run_reference(void)
{
    mdl_real_bits x;
    mdl_real y = 0.0f;
    uint32_t word = 0;
    (void)board_read(&word);
    cao2019_init(&reference, model_f0, (uint16_t)word, &left.reference, &right.reference);
    while (board_read(&word)) {
        uint16_t status;
        x.bits = (mdl_key)word;
        board_pin_high();
        status = cao2019_step(&reference, x.real, &y);
        board_pin_low();
        write_result(y, status, cao2019_turning_points(&reference));
    }
}

static void run_play(void)
{
    mdl_real_bits x;
    mdl_real y = 0.0f;
    uint32_t word;
    while (board_read(&word)) {
        uint16_t status;
        x.bits = (mdl_key)word;
        board_pin_high();
        status = play_step(&ten, x.real, &y);
        board_pin_low();
        write_result(y, status, 0);
    }
}

static void run_chain(void)
{
    mdl_real_bits u;
    mdl_real y = 0.0f;
    uint32_t word = 0;
    const mdl_app_params *const paths[] = {&mdl_params, &viscous_params, &by_square_params};
    (void)board_read(&word);
    params = paths[word >> 16]->chain;
    params.blocks = (uint16_t)(word & ~CHAIN_SHAPE);
    if ((word & CHAIN_SHAPE) == 0) {
        params.major.shape = 0;
    }
    (void)mdl_chain_init(&chain, &params, &left.ours, &right.ours);
    while (board_read(&word)) {
        mdl_status status;
        u.bits = (mdl_key)word;
        board_pin_high();
        status = mdl_chain_step(&chain, u.real, &y);
        board_pin_low();
        write_result(y, (uint16_t)status, (uint16_t)mdl_traj_turning_points(&chain.traj));
    }
}

/* The cost of the pin itself. */
static void run_nothing(void)
{
    uint32_t word;
    while (board_read(&word)) {
        board_pin_high();
        board_pin_low();
        write_result(0.0f, 0, 0);
    }
}

int main(void)
{
    uint32_t algorithm = NOTHING;
    board_open();
    (void)board_read(&algorithm);
    switch (algorithm) {
    case OURS:
        run_ours();
        break;
    case REFERENCE:
        run_reference();
        break;
    case PLAY:
        run_play();
        break;
    case CHAIN:
        run_chain();
        break;
    default:
        run_nothing();
    }
    board_close();
    return 0;
}
