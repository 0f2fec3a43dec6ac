/* Time per sample on the PC: host FILE, a record of reals; prints ns of ours, reference, play. */
#define _POSIX_C_SOURCE 199309L
#include "cao2019.h"
#include "mdl_traj.h"
#include "model.h"
#include "play.h"

#include <stdio.h>
#include <time.h>

enum { SAMPLES = 1000000, REPEATS = 41 };

static mdl_real x[SAMPLES], y[SAMPLES];
static mdl_tp_side left, right;
static cao2019_points ltp, rtp;

static void run_ours(uint32_t n)
{
    mdl_major major;
    mdl_traj traj;
    uint32_t i;
    (void)mdl_major_init_polynomial(&major, model_range_volts, model_f0, MODEL_DEGREE);
    (void)mdl_traj_init(&traj, &major, &left, &right, model_margin_volts);
    for (i = 0; i < n; i++) {
        (void)mdl_traj_step(&traj, x[i], &y[i]);
    }
}

static void run_reference(uint32_t n)
{
    cao2019 s;
    uint32_t i;
    cao2019_init(&s, model_f0, MODEL_DEGREE, &ltp, &rtp);
    for (i = 0; i < n; i++) {
        (void)cao2019_step(&s, x[i], &y[i]);
    }
}

static void run_play(uint32_t n)
{
    play s = {{0.0f}};
    uint32_t i;
    for (i = 0; i < n; i++) {
        (void)play_step(&s, x[i], &y[i]);
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
    FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    uint32_t n = file != NULL ? (uint32_t)fread(x, sizeof x[0], SAMPLES, file) : 0;
    if (n == 0) {
        fprintf(stderr, "usage: host FILE\n");
        return 2;
    }
    printf("%.2f %.2f %.2f\n", nanoseconds(run_ours, n), nanoseconds(run_reference, n),
           nanoseconds(run_play, n));
    return 0;
}
