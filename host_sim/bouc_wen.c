#include "bouc_wen.h"

#include <math.h>

/* Of 1 / (beta + gamma), within which z changes much. */
#define STEP_SHARE 1e-3

static double slope(double z, double power, double beta, double gamma, double sign)
{
    double against = z * sign < 0.0 ? -beta : beta;
    return 1.0 - pow(fabs(z), power) * (gamma + against);
}

void bouc_wen_run(const double *x, size_t n, double power, double beta, double gamma, double *state,
                  double *z)
{
    size_t k, i;
    for (k = 0; k < n; k++) {
        double way = x[k] - state[0], now = state[1];
        double sign = way < 0.0 ? -1.0 : 1.0;
        size_t steps = 1 + (size_t)(fabs(way) * (beta + fabs(gamma)) / STEP_SHARE);
        double step = way / (double)steps;
        for (i = 0; i < steps; i++) {
            double middle = now + 0.5 * step * slope(now, power, beta, gamma, sign);
            now += step * slope(middle, power, beta, gamma, sign);
        }
        state[0] = x[k];
        state[1] = now;
        z[k] = now;
    }
}
