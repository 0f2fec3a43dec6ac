/* The whole program of the F28335 on the fake register file. Included, so that the test sees what
 * main.c keeps to itself. */

#include "f28335.h"
#include "fake_f28335.h"
#include "unity.h"

int firmware_main(void);
#define main firmware_main
#include "main.c"
#undef main

#define PERIOD 15000u /* clocks at 10 kHz */

/* Runs the program from reset for n samples and half a period; the faults are set before. */
static inline int run_samples(uint32_t n)
{
    fake.run_clocks = (uint64_t)n * PERIOD + PERIOD / 2u;
    return firmware_main();
}

/* Fails with the first rule of the silicon that was broken. */
#define ASSERT_NO_VIOLATION()                                                                      \
    TEST_ASSERT_EQUAL_STRING("none", fake.violation == NULL ? "none" : fake.violation)
