/**
 * @file hysteresis.h
 * @brief The hysteresis of the simulated actuator. Its own physics: nothing here knows
 * firmware/core.
 *
 * Two kinds. A Preisach grid of relays: relay (i, j), j <= i, switches up while the input rises
 * through cell i and down while it falls through cell j; within the cell it ramps, so that the
 * output is continuous. And Maxwell elasto-slides: springs in parallel, each drawn by the input
 * and held by a slider with Coulomb friction.
 *
 * stage.py hands this file to cffi; lines that start with # are left out there.
 */
#ifndef HOST_SIM_HYSTERESIS_H
#define HOST_SIM_HYSTERESIS_H

#include <stddef.h>

typedef struct hysteresis hysteresis;

/**
 * A grid of levels x levels relays over cells of equal width, all relays down.
 * @param low_volts   lower edge of cell 0
 * @param cell_volts  width of a cell, > 0
 * @param weight_um   what relay (i, j) adds when up: weight_um[i * levels + j]; j > i is not used
 * @param slope       reversible part, um / volts
 * @return NULL when memory is short
 */
hysteresis *hysteresis_new_relays(double low_volts, double cell_volts, size_t levels,
                                  const double *weight_um, double slope);

/**
 * Elasto-slides with their sliders at 0 volts.
 * @param reach_volts  half width: how far the input moves a spring until its slider gives way
 * @param stiffness    um / volts that each spring holds back
 * @param slope        um / volts without the springs
 * @return NULL when memory is short
 */
hysteresis *hysteresis_new_slides(size_t count, const double *reach_volts, const double *stiffness,
                                  double slope);

/** Frees what hysteresis_new_... gave. */
void hysteresis_free(hysteresis *h);

/**
 * Runs n samples from the present state: input in volts to displacement in um. Cost per sample:
 * the relays of the cells that the input passes, or every slide.
 * @param widen_volts  per sample, >= 0: relays and sliders switch that much later in both
 *                     directions; NULL for none
 */
void hysteresis_run(hysteresis *h, const double *volts, const double *widen_volts, double *um,
                    size_t n);

#endif
