/* Time per sample on the PC: host FILE DEGREE; FILE is a record of volts as floats. Prints ns of
 * ours, the paper's and the ten play operators. */
#define _POSIX_C_SOURCE 199309L
#include "cao2019.h"
#include "mdl_traj.h"
#include "model.h"
#include "play.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { SAMPLES = 1000000, REPEATS = 41 };

static mdl_real volts[SAMPLES], um[SAMPLES];
static mdl_tp_side left, right;
static cao2019_points ltp, rtp;
static uint16_t degree;

static void run_ours(uint32_t n)
{
    mdl_major major;
    mdl_traj traj;
    uint32_t i;
    (void)mdl_major_init_polynomial(&major, model_range_volts, model_f0, degree);
    (void)mdl_traj_init(&traj, &major, &left, &right, model_margin_volts);
    for (i = 0; i < n; i++) {
        (void)mdl_traj_step(&traj, volts[i], &um[i]);
    }
}

static void run_reference(uint32_t n)
{
    cao2019 s;
    uint32_t i;
    cao2019_init(&s, model_f0, degree, &ltp, &rtp);
    for (i = 0; i < n; i++) {
        (void)cao2019_step(&s, volts[i], &um[i]);
    }
}

static void run_play(uint32_t n)
{
    play s = {{0.0f}};
    uint32_t i;
    for (i = 0; i < n; i++) {
        (void)play_step(&s, volts[i] / model_range_volts, &um[i]);
    }
}

/* The least of many runs: what other processes do can only add. */
static double nanoseconds(void (*run)(uint32_t), uint32_t n)
{
    double least = 1e30;
    uint16_t k;
    for (k = 0; k < REPEATS; k++) {
        struct timespec from, to;
        double ns;
        (void)clock_gettime(CLOCK_MONOTONIC, &from);
        run(n);
        (void)clock_gettime(CLOCK_MONOTONIC, &to);
        ns = (double)(to.tv_sec - from.tv_sec) * 1e9 + (double)(to.tv_nsec - from.tv_nsec);
        least = ns < least ? ns : least;
    }
    return least / (double)n;
}

int main(int argc, char **argv)
{
    FILE *file = argc == 3 ? fopen(argv[1], "rb") : NULL;
    uint32_t n = file != NULL ? (uint32_t)fread(volts, sizeof volts[0], SAMPLES, file) : 0;
    degree = argc == 3 ? (uint16_t)strtoul(argv[2], NULL, 10) : 0;
    if (n == 0 || degree > MODEL_DEGREE_MAX) {
        fprintf(stderr, "usage: host FILE DEGREE\n");
        return 2;
    }
    printf("%.2f %.2f %.2f\n", nanoseconds(run_ours, n), nanoseconds(run_reference, n),
           nanoseconds(run_play, n));
    return 0;
}
