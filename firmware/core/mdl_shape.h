/**
 * @file mdl_shape.h
 * @brief Loops that are not centrally symmetric (asymmetry), or whose minor loops do not have the
 *        shape that f0 dictates (non-Masing).
 *
 * A branch between two turning points is described by its swing s = b - a and its middle
 * m = (a + b) / 2. Madelung's rules with central symmetry let the displacement depend on s alone:
 * f0(s). Any Preisach density adds terms in m; here s'^j m'^k with s' = s / range and
 * m' = 2 m / range - 1. Odd k break the central symmetry, even k leave the major loop symmetric
 * and change minor loops. Loops stay closed and are wiped out as before. (The Everett function of
 * Mayergoyz, Phys. Rev. Lett. 56, 1518 (1986), as a polynomial.)
 *
 * In a Preisach model the shape of a branch does not depend on the loop that it belongs to. Besides
 * these terms, a minor loop of swing D may be wider than the rules make it: what its branches
 * deviate from the chord between its turning points grows by the share (l_0 + l_1 D') (1 - D'),
 * D' = D / range. Loops stay closed, and the major loop is as it was.
 */
#ifndef MDL_SHAPE_H
#define MDL_SHAPE_H

#include "mdl_config.h"
#include "mdl_real.h"
#include "mdl_status.h"

/** Largest power of the middle and of the swing. Memory: 16 reals. */
#define MDL_SHAPE_ORDER 4

/** Coefficients of the additional terms. */
typedef struct {
    mdl_real per_range;                           /**< 1 / range, 1 / volts */
    mdl_real g[MDL_SHAPE_ORDER][MDL_SHAPE_ORDER]; /**< um, g[k-1][j-1] of s'^j m'^k */
    mdl_real loop[2];                             /**< l_0 and l_1, no unit */
} mdl_shape;

/** Additional displacement, in um, of a swing from a to b volts: sum g[k-1][j-1] s'^j m'^k. */
mdl_real mdl_shape_swing(const mdl_shape *shape, mdl_real a_volts, mdl_real b_volts);

/** Share by which a minor loop of a swing D > 0, in volts, is wider; 0 from the range on. */
mdl_real mdl_shape_widening(const mdl_shape *shape, mdl_real swing_volts);

#endif
