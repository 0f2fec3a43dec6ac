/**
 * @file play.h
 * @brief A Prandtl-Ishlinskii model of ten one-side play operators (Cao & Li 2019, eq. (15) and
 *        table 1), for comparison of speed only.
 *
 * Corrected: each operator remembers its own last output, where y_PI is printed.
 */
#ifndef PLAY_H
#define PLAY_H

#include "mdl_real.h"

#define PLAY_OPERATORS 10

/** Last outputs of the operators; all zeros at rest at x = 0. */
typedef struct {
    mdl_real h[PLAY_OPERATORS];
} play;

/** One sample, x from 0 to 1; gives y from 0 to 1. Returns 0. */
uint16_t play_step(play *s, mdl_real x, mdl_real *y);

#endif
