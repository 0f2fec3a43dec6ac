#include "path.h"

#include <math.h>

void path_slew(double *volts, size_t n, double rise_volts, double fall_volts)
{
    size_t k;
    for (k = 1; k < n; k++) {
        double wish = volts[k] - volts[k - 1];
        volts[k] = volts[k - 1] + fmin(fmax(wish, -fall_volts), rise_volts);
    }
}

/* One Runge-Kutta step of x' = rate (u - x) while u goes from before to after. */
static double lag_step(double x, double rate, double before, double after)
{
    double middle = 0.5 * (before + after);
    double k1 = rate * (before - x);
    double k2 = rate * (middle - x - 0.5 * k1);
    double k3 = rate * (middle - x - 0.5 * k2);
    double k4 = rate * (after - x - k3);
    return x + (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0;
}

void path_lag(double *signal, size_t n, double rate)
{
    double x = signal[0], before = signal[0];
    size_t k;
    for (k = 1; k < n; k++) {
        double after = signal[k];
        x = lag_step(x, rate, before, after);
        signal[k] = x;
        before = after;
    }
}

void path_charge(double *volts, size_t n, double rate, double droop, double low_volts,
                 double range_volts)
{
    double x = volts[0], before = volts[0];
    size_t k;
    for (k = 1; k < n; k++) {
        double after = volts[k];
        double load = 1.0 + droop * ((x - low_volts) / range_volts - 0.5);
        x = lag_step(x, rate / load, before, after);
        volts[k] = x;
        before = after;
    }
}

void path_creep(const double *h, double *moved, size_t n, double tau_samples, double gain)
{
    /* The middle of a step stands for it: time constants are many steps long. */
    double forget = -expm1(-1.0 / tau_samples), x = h[0];
    size_t k;
    moved[0] += gain * x;
    for (k = 1; k < n; k++) {
        x += forget * (0.5 * (h[k - 1] + h[k]) - x);
        moved[k] += gain * x;
    }
}

typedef struct {
    double x;
    double v;
} moving;

static moving force(moving at, double rate, double zeta, double signal)
{
    moving slope;
    slope.x = at.v;
    slope.v = rate * rate * (signal - at.x) - 2.0 * zeta * rate * at.v;
    return slope;
}

static moving ahead(moving at, moving slope, double steps)
{
    at.x += steps * slope.x;
    at.v += steps * slope.v;
    return at;
}

static moving mode_step(moving at, double rate, double zeta, double before, double after)
{
    double middle = 0.5 * (before + after);
    moving k1 = force(at, rate, zeta, before);
    moving k2 = force(ahead(at, k1, 0.5), rate, zeta, middle);
    moving k3 = force(ahead(at, k2, 0.5), rate, zeta, middle);
    moving k4 = force(ahead(at, k3, 1.0), rate, zeta, after);
    at.x += (k1.x + 2.0 * k2.x + 2.0 * k3.x + k4.x) / 6.0;
    at.v += (k1.v + 2.0 * k2.v + 2.0 * k3.v + k4.v) / 6.0;
    return at;
}

void path_mode(const double *h, double *moved, size_t n, double rate, double zeta, double share)
{
    moving at = {h[0], 0.0};
    size_t k;
    for (k = 1; k < n; k++) {
        at = mode_step(at, rate, zeta, h[k - 1], h[k]);
        moved[k] += share * (at.x - h[k]);
    }
}

void path_backlash(double *um, size_t n, double band_um)
{
    /* The gap lies above a pusher that goes up, so the target stays where it is while the pusher
     * goes down by less than the gap. */
    double target = um[0];
    size_t k;
    for (k = 0; k < n; k++) {
        if (um[k] > target) {
            target = um[k];
        } else if (um[k] + band_um < target) {
            target = um[k] + band_um;
        }
        um[k] = target;
    }
}
