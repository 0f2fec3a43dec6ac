/**
 * @file bouc_wen.h
 * @brief The hysteresis of Bouc and Wen, for a stage whose minor loops keep no memory of turns.
 *
 * dz/dx = 1 - |z|^power (gamma + beta sgn(z dx)), Wen 1976, J. Eng. Mech. Div. 102, 249, in the
 * form that needs no time. Its major loop is centrally symmetric. It does not obey Madelung's
 * rules: minor loops do not close, and a branch depends on z where it begins.
 *
 * stage.py hands this file to cffi; lines that start with # are left out there.
 */
#ifndef HOST_SIM_BOUC_WEN_H
#define HOST_SIM_BOUC_WEN_H

#include <stddef.h>

/**
 * Runs n inputs from the present state.
 * @param x      input, in any unit
 * @param power  >= 1; beta + gamma > 0, beta > 0, all per unit of x
 * @param state  the input before the first, and z there; both are brought up to date
 * @param z      output, n values, in the unit of x
 */
void bouc_wen_run(const double *x, size_t n, double power, double beta, double gamma, double *state,
                  double *z);

#endif
