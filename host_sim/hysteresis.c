#include "hysteresis.h"

#include <math.h>
#include <stdlib.h>

struct hysteresis {
    double slope;
    double sum_um;     /* relays: what those that are up add */
    double rise_volts; /* relays: all are as high as a rise to here makes them */
    double fall_volts; /* relays: all are as low as a fall to here makes them */
    double low_volts;
    double cell_volts;
    size_t levels;  /* 0 for slides */
    size_t count;   /* slides */
    double *weight; /* of relays; stiffness of slides */
    double *state;  /* of relays, 0 down to 1 up; sliders' positions in volts */
    double *reach;  /* slides only */
};

/* fmin and fmax without their care for NaN, which costs a call each. */
static inline double lower(double a, double b)
{
    return a < b ? a : b;
}

static inline double higher(double a, double b)
{
    return a > b ? a : b;
}

static hysteresis *new_elements(size_t n, const double *weight, const double *reach, double slope)
{
    hysteresis *h = calloc(1, sizeof *h);
    size_t i;
    if (h == NULL) {
        return NULL;
    }
    h->weight = malloc(n * sizeof *h->weight);
    h->state = calloc(n, sizeof *h->state);
    h->reach = malloc(n * sizeof *h->reach);
    if (h->weight == NULL || h->state == NULL || h->reach == NULL) {
        hysteresis_free(h);
        return NULL;
    }
    for (i = 0; i < n; i++) {
        h->weight[i] = weight[i];
        h->reach[i] = reach == NULL ? 0.0 : reach[i];
    }
    h->slope = slope;
    return h;
}

hysteresis *hysteresis_new_relays(double low_volts, double cell_volts, size_t levels,
                                  const double *weight_um, double slope)
{
    hysteresis *h = new_elements(levels * levels, weight_um, NULL, slope);
    if (h != NULL) {
        h->levels = levels;
        h->low_volts = low_volts;
        h->cell_volts = cell_volts;
        h->rise_volts = low_volts;
        h->fall_volts = low_volts;
    }
    return h;
}

hysteresis *hysteresis_new_slides(size_t count, const double *reach_volts, const double *stiffness,
                                  double slope)
{
    hysteresis *h = new_elements(count, stiffness, reach_volts, slope);
    if (h != NULL) {
        h->count = count;
    }
    return h;
}

void hysteresis_free(hysteresis *h)
{
    if (h != NULL) {
        free(h->weight);
        free(h->state);
        free(h->reach);
        free(h);
    }
}

/* How far through cell k the input is, 0 to 1. */
static double passed(const hysteresis *h, size_t k, double volts)
{
    double share = (volts - h->low_volts) / h->cell_volts - (double)k;
    return lower(higher(share, 0.0), 1.0);
}

static size_t cell_of(const hysteresis *h, double volts)
{
    double k = floor((volts - h->low_volts) / h->cell_volts);
    return (size_t)lower(higher(k, 0.0), (double)(h->levels - 1));
}

/* Only relays of the cells between the last and the present rise can have moved up. */
static void relays_rise(hysteresis *h, double volts)
{
    size_t i, j, last = cell_of(h, volts);
    for (i = cell_of(h, h->rise_volts); i <= last; i++) {
        double up = passed(h, i, volts);
        const double *weight = h->weight + i * h->levels;
        double *state = h->state + i * h->levels;
        double sum = 0.0;
        for (j = 0; j <= i; j++) {
            double moved = higher(up - state[j], 0.0);
            sum += weight[j] * moved;
            state[j] += moved;
        }
        h->sum_um += sum;
    }
}

/* Row by row, as the memory lies; relays of the cells above the input's own go down altogether. */
static void relays_fall(hysteresis *h, double volts)
{
    size_t i, j, first = cell_of(h, volts), last = cell_of(h, h->fall_volts);
    double own = passed(h, first, volts);
    for (i = first; i < h->levels; i++) {
        const double *weight = h->weight + i * h->levels;
        double *state = h->state + i * h->levels;
        double up = own, sum = 0.0;
        for (j = first; j <= last && j <= i; j++) {
            double moved = lower(up - state[j], 0.0);
            sum += weight[j] * moved;
            state[j] += moved;
            up = 0.0;
        }
        h->sum_um += sum;
    }
}

static double relays_step(hysteresis *h, double volts, double widen_volts)
{
    double rise = volts - widen_volts, fall = volts + widen_volts;
    if (rise > h->rise_volts) {
        relays_rise(h, rise);
    }
    h->rise_volts = rise;
    if (fall < h->fall_volts) {
        relays_fall(h, fall);
    }
    h->fall_volts = fall;
    return h->slope * volts + h->sum_um;
}

static double slides_step(hysteresis *h, double volts, double widen_volts)
{
    double um = h->slope * volts;
    size_t i;
    for (i = 0; i < h->count; i++) {
        double reach = h->reach[i] + widen_volts;
        h->state[i] = lower(higher(h->state[i], volts - reach), volts + reach);
        um -= h->weight[i] * (volts - h->state[i]);
    }
    return um;
}

void hysteresis_run(hysteresis *h, const double *volts, const double *widen_volts, double *um,
                    size_t n)
{
    size_t k;
    for (k = 0; k < n; k++) {
        double widen = widen_volts == NULL ? 0.0 : widen_volts[k];
        um[k] = h->levels > 0 ? relays_step(h, volts[k], widen) : slides_step(h, volts[k], widen);
    }
}
