/**
 * @file cao2019.h
 * @brief The algorithm of the paper's flowchart (Cao & Li 2019, figure 2), for comparison only.
 *
 * As printed: reals are compared as reals, every sample runs inequality (10) with its
 * multiplication and a binary search with left, right and mid, f0 is a Horner loop of run-time
 * degree, and f0(x_A0) is cached. Corrected: the misprints of S3 and of eqs. (6), (12), (13), see
 * mdl_traj.c. Decided as in mdl_traj.h: an equal input has surpassed, and at the minimum the
 * memory is empty. x_A0 is 0 and is not added. No check of the input: 0 <= x <= range on codes.
 */
#ifndef CAO2019_H
#define CAO2019_H

#include "mdl_config.h"
#include "mdl_real.h"

/** Turning points of one side in the order of their making. The caller owns them. */
typedef struct {
    mdl_real X[MDL_N_U / 2L]; /**< volts */
    mdl_real Y[MDL_N_U / 2L]; /**< um */
} cao2019_points;

/** State, named as in the paper. */
typedef struct {
    const mdl_real *c; /**< f0, um / volts^k in ascending powers */
    uint16_t n;        /**< degree of f0 */
    uint16_t tp_flag;  /**< 0: the latest turning point is a left one, 1: a right one */
    uint16_t index;    /**< position of the current turning point, from 1; 0: none */
    mdl_real f0_xA0;   /**< um */
    mdl_real x1;       /**< volts */
    mdl_real y1;       /**< um */
    mdl_real x2;       /**< volts */
    cao2019_points *ltp;
    cao2019_points *rtp;
} cao2019;

/** S0: at rest at x_A0 = 0. c holds n + 1 coefficients in ascending powers. */
void cao2019_init(cao2019 *s, const mdl_real *c, uint16_t n, cao2019_points *ltp,
                  cao2019_points *rtp);

/** S1 to S10: one sample, x in volts above the minimum; gives y in um. Returns 0. */
uint16_t cao2019_step(cao2019 *s, mdl_real x, mdl_real *y);

/** Left plus right turning points now held. */
uint16_t cao2019_turning_points(const cao2019 *s);

#endif
