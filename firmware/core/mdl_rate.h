/**
 * @file mdl_rate.h
 * @brief Rate dependence: loops that widen with the rate of the input, in five forms.
 *
 * With g(v) = (|v| + v_0)^p - v_0^p, v the filtered velocity of the input over a reference:
 * Damping: y += c g(v) sgn(v), with v_0 = 0 the m-th-power velocity damping of Yang et al. 2015,
 * eq. (6).
 * Threshold: every operator switches later by c g volts, as with the dynamic thresholds that
 * Yang et al. compare with. For plays and relays alike this is the trajectory behind a play
 * operator of that half width; the operator without a threshold, weight f0'(0), stays as it is.
 * Widening: every threshold grows by its share c g (mdl_plays.h).
 * Swelling: what the trajectory deviates from a straight line through the middle of the major loop
 * grows by its share c g. The line is steeper by the share `lean` than the chord: with 0 the ends
 * stay; with the slope at which f0 ends the deviation is a sum of stop operators, and these grow.
 * Relaxing: the operators are viscous (mdl_plays.h), without g.
 * For threshold, widening and swelling v is the filtered velocity, or the filtered speed, which
 * does not fall to 0 where the input turns. With v_0 > 0 and a small p the law goes as the
 * logarithm of 1 + |v| / v_0.
 */
#ifndef MDL_RATE_H
#define MDL_RATE_H

#include "mdl_lag.h"
#include "mdl_plays.h"

/** Parameters; computed by the tools for the sample time. */
typedef struct {
    mdl_lag_params filter;    /**< of the velocity, and of the speed */
    mdl_real v_scale;         /**< filtered deviation to v, 1 / volts, negative */
    mdl_real power;           /**< p, 0 < p <= 4 */
    mdl_real v_knee;          /**< v_0, >= 0 */
    mdl_real at_knee;         /**< v_0^p */
    mdl_real damping_um;      /**< c of the damping, um */
    mdl_real widening;        /**< c of the widening, no unit, >= 0 */
    mdl_real threshold_volts; /**< c of the threshold, volts, >= 0 */
    mdl_real swelling;        /**< c of the swelling, no unit, >= 0 */
    mdl_real lean;            /**< of the swelling's line, no unit */
    uint16_t of_speed;        /**< 1: all but the damping go with the filtered speed */
    mdl_relax_params relax;   /**< decay 0: none; not beside a widening */
} mdl_rate_params;

/** |v|^p sgn(v), Yang et al. 2015, eq. (6) with c = 1; v and 0 < p <= 4 as mdl_power takes them. */
mdl_real mdl_rate_signed_power(mdl_real v, mdl_real power);

/**
 * g(v) sgn(v) after a change of the input by rise_volts in this sample.
 * @param rise_volts  for the speed: its size
 */
mdl_real mdl_rate_law(mdl_lag *state, const mdl_rate_params *params, mdl_real rise_volts);

#endif
