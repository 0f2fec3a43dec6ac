/**
 * @file mdl_cycle.h
 * @brief Period and amplitude of an input from its turning points: half period and swing.
 *
 * A turn counts when the input has come back from its extreme by a dead band, so that noise and
 * quantisation do not turn. Its place between samples is the vertex of the parabola through the
 * extreme and its neighbours. The period is the sum of the last two halves, where two have been
 * seen: an extreme that is seen early, as a flat one is, is seen early on both sides.
 */
#ifndef MDL_CYCLE_H
#define MDL_CYCLE_H

#include "mdl_real.h"

/** State; reals only. Times are in samples. */
typedef struct {
    mdl_real direction;       /**< 1 rising, -1 falling, 0 not known yet */
    mdl_real turn_volts;      /**< input at the last turn; the first sample is taken for one */
    mdl_real extreme_volts;   /**< farthest since then */
    mdl_real before_volts;    /**< input one sample before the extreme */
    mdl_real after_volts;     /**< and one after it */
    mdl_real last_volts;      /**< input one sample ago */
    mdl_real since_turn;      /**< from the last turn to now */
    mdl_real extreme_at;      /**< from the last turn to the extreme */
    mdl_real half;            /**< last half period; 0: no turn yet */
    mdl_real period;          /**< found period; 0: no turn yet */
    mdl_real amplitude_volts; /**< half the last swing */
} mdl_cycle;

/** The first sample. */
void mdl_cycle_start(mdl_cycle *cycle, mdl_real v_volts);

/**
 * One more sample.
 * @param dead_band_volts  > 0
 * @return 1 when a turn was found, which sets period (2 or more) and amplitude_volts (above half
 *         the dead band); else 0
 */
int mdl_cycle_step(mdl_cycle *cycle, mdl_real dead_band_volts, mdl_real v_volts);

#endif
