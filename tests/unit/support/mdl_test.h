/**
 * @file mdl_test.h
 * @brief Comparison of reals for the tests, in the float and in the double build.
 */
#ifndef MDL_TEST_H
#define MDL_TEST_H

#include "unity.h"

#include "mdl_real.h"

#include <float.h>
#include <math.h>

#ifdef MDL_REAL_DOUBLE
#define MDL_TEST_EPSILON DBL_EPSILON
#else
#define MDL_TEST_EPSILON ((double)FLT_EPSILON)
#endif

/** Equal; for values that both builds hold exactly, which most tests are made of. */
#define ASSERT_REAL(expected, actual)                                                              \
    TEST_ASSERT_DOUBLE_WITHIN(0.0, (double)(expected), (double)(actual))

/** Equal but for some roundings of numbers of the given size. */
#define ASSERT_NEAR(expected, actual, size)                                                        \
    TEST_ASSERT_DOUBLE_WITHIN(16.0 * MDL_TEST_EPSILON * (double)(size), (double)(expected),        \
                              (double)(actual))

/** Asserts the status of a call: 0 is MDL_OK. */
#define ASSERT_STATUS(expected, actual) TEST_ASSERT_EQUAL_INT((int)(expected), (int)(actual))

/** NaN and both infinities, one after the other, for i = 0, 1, 2. */
static inline mdl_real mdl_test_not_finite(int i)
{
    return i == 0 ? (mdl_real)NAN : (i == 1 ? (mdl_real)INFINITY : -(mdl_real)INFINITY);
}

#endif
