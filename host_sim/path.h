/**
 * @file path.h
 * @brief What stands before and behind the hysteresis of the simulated actuator: slew limit, lag,
 *        creep, flexure modes, backlash. All but creep and modes change a signal in place.
 *
 * The caller steps finely (20 samples or more in the period of the fastest pole), so that plain
 * integration will do: nothing here is discretised as the predictor of firmware/core is. Every
 * state starts in equilibrium with the first sample.
 *
 * stage.py hands this file to cffi; lines that start with # are left out there.
 */
#ifndef HOST_SIM_PATH_H
#define HOST_SIM_PATH_H

#include <stddef.h>

/** Changes by at most rise_volts upwards and fall_volts downwards a sample. */
void path_slew(double *volts, size_t n, double rise_volts, double fall_volts);

/** One pole, x' = rate (u - x), by Runge-Kutta; rate in 1 / sample, below 2. */
void path_lag(double *signal, size_t n, double rate);

/**
 * A resistance into a capacitance that grows with the voltage: the pole of path_lag, whose rate
 * is divided by 1 + droop ((x - low_volts) / range_volts - 1/2).
 * @param droop  capacitance at the upper end over that at the lower, less 1, about; 0 to 1
 */
void path_charge(double *volts, size_t n, double rate, double droop, double low_volts,
                 double range_volts);

/**
 * What one creeping element adds: moved += gain x, x' = (h - x) / tau, driven by h.
 * @param tau_samples  time constant in samples, above 1
 */
void path_creep(const double *h, double *moved, size_t n, double tau_samples, double gain);

/**
 * What one flexure mode adds: moved += share (x - h), x'' + 2 zeta w x' + w^2 x = w^2 h, by
 * Runge-Kutta. Several modes act side by side on the same h.
 * @param rate  w in rad / sample, below 1
 */
void path_mode(const double *h, double *moved, size_t n, double rate, double zeta, double share);

/** A pusher within a gap of band_um, at first against its rising side: y rests until it is pushed.
 */
void path_backlash(double *um, size_t n, double band_um);

#endif
