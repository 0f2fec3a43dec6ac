/**
 * @file mdl_yang.h
 * @brief The modified Prandtl-Ishlinskii model of Yang, Li, Gu & Zhu, "A Modified
 * Prandtl-Ishlinskii Model for Rate-dependent Hysteresis Nonlinearity Using mth-power Velocity
 * Damping Mechanism", 2015.
 *
 * y = y_RI + (K - 1) (y_RI - y_c) + C |v' / Q|^m sgn(v'), Q = 2 pi f A, with y_RI of mdl_pi.h,
 * eqs. (4), (8) to (10). K = sum lambda_i k(i f), C = sum lambda_i c(i f), eq. (14): the weights
 * are one 1 for a sine, and those of eq. (16) for a triangle. k, c and m are polynomials in f, eq.
 * (13). The velocity v' is filtered by one pole, exact for an input linear between samples.
 *
 * Decided here, where the paper is silent:
 * - y_c is the displacement about which k scales: 0 in the paper. With its k of 0.4 at 1500 Hz the
 *   mean displacement would shrink as the swing does, which no actuator's does.
 * - Under triangles m = m(f) and Q = 2 pi f A with the fundamental f.
 * - f and A are given, or found from the last turning points. Until the first turn the model is the
 *   rate-independent one.
 * - Above hz_max the polynomials keep the value that they have there (MDL_EXTRAPOLATED).
 * - Inputs outside the identified range, and NaN, are treated as mdl_traj.h does.
 */
#ifndef MDL_YANG_H
#define MDL_YANG_H

#include "mdl_cycle.h"
#include "mdl_lag.h"
#include "mdl_pi.h"

/** Coefficients of a polynomial of eq. (13), ascending powers of Hz. */
#define MDL_YANG_TERMS 4

/** Parameters for one sample time; constant data. */
typedef struct {
    mdl_pi_params pi;
    mdl_real low_volts;    /**< identified range */
    mdl_real high_volts;   /**< above low_volts */
    mdl_real margin_volts; /**< extrapolated at most this far, >= 0 */
    mdl_real center_um;    /**< y_c */
    mdl_real k[MDL_YANG_TERMS];
    mdl_real c_um[MDL_YANG_TERMS];      /**< a negative c, a lag, is normal */
    mdl_real m[MDL_YANG_TERMS];         /**< 0 < m(f) <= 4 for every f that can come */
    mdl_real hz_max;                    /**< highest identified frequency, > 0 */
    uint16_t harmonics;                 /**< M, 1 to MDL_HARMONICS_MAX */
    mdl_real lambda[MDL_HARMONICS_MAX]; /**< eq. (16) */
    mdl_real hz;                        /**< f of the excitation, 0: found on line */
    mdl_real amplitude_volts;           /**< A, 0: found on line */
    mdl_real turn_volts;                /**< dead band of mdl_cycle.h, > 0 */
    mdl_real rate_hz;                   /**< samples a second, > 0 */
    mdl_lag_params filter;              /**< of the velocity */
    mdl_real v_scale;                   /**< the filter's deviation to v', 1 / s, negative */
    mdl_real widen_s; /**< thresholds grow by widen_s |v'|, >= 0: the rival's beta; else 0 */
} mdl_yang_params;

/** State; reals only. The caller owns it. */
typedef struct {
    mdl_pi pi;
    mdl_lag velocity;
    mdl_cycle cycle;
    mdl_real last_volts;
    mdl_real y_um;      /**< last displacement */
    mdl_real k_above_1; /**< K - 1 now */
    mdl_real c_um;      /**< C now */
    mdl_real m;         /**< now */
    mdl_real per_q;     /**< 1 / Q now, s / volts */
    mdl_real beyond;    /**< 1: a harmonic lies above hz_max; else 0 */
} mdl_yang;

/**
 * Checks the parameters.
 * @return MDL_OK, MDL_ERR_CAPACITY, MDL_ERR_NOT_FINITE, MDL_ERR_PARAMETER: one is out of its range
 *         (m is looked at in 33 places from 0 to hz_max where f is found on line)
 */
mdl_status mdl_yang_check(const mdl_yang_params *params);

/**
 * The first sample: u_volts, finite, was reached from 0 volts without a turn. Returns as
 * mdl_yang_step does.
 */
mdl_status mdl_yang_start(mdl_yang *yang, const mdl_yang_params *params, mdl_real u_volts,
                          mdl_real *y_um);

/**
 * One more sample.
 * @param u_volts  command, finite
 * @return MDL_OK, or the bits MDL_EXTRAPOLATED, MDL_CLAMPED; MDL_ERR_NOT_FINITE: nothing was
 *         changed, y_um is the last displacement
 */
mdl_status mdl_yang_step(mdl_yang *yang, const mdl_yang_params *params, mdl_real u_volts,
                         mdl_real *y_um);

#endif
