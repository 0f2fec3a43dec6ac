/* Reals compared through their bits. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_real.h"

void setUp(void)
{
}

void tearDown(void)
{
}

#ifdef MDL_REAL_DOUBLE
static const mdl_real ascending[] = {-DBL_MAX,    -3.0,    -1.0, -0.5, -DBL_MIN, -DBL_MIN / 4, 0.0,
                                     DBL_MIN / 4, DBL_MIN, 0.5,  1.0,  3.0,      DBL_MAX};
#else
static const mdl_real ascending[] = {-FLT_MAX,     -3.0f, -1.0f,       -0.5f,   -FLT_MIN,
                                     -FLT_MIN / 4, 0.0f,  FLT_MIN / 4, FLT_MIN, 0.5f,
                                     1.0f,         3.0f,  FLT_MAX};
#endif
#define COUNT (sizeof ascending / sizeof ascending[0])

void test_keys_sort_as_reals_do(void)
{
    uint16_t i;
    for (i = 1; i < COUNT; i++) {
        TEST_ASSERT_TRUE(mdl_key_of(ascending[i - 1]) < mdl_key_of(ascending[i]));
    }
}

void test_complements_of_keys_sort_in_the_reverse(void)
{
    uint16_t i;
    for (i = 1; i < COUNT; i++) {
        TEST_ASSERT_TRUE(~mdl_key_of(ascending[i - 1]) > ~mdl_key_of(ascending[i]));
    }
}

void test_the_key_gives_the_real_back(void)
{
    uint16_t i;
    for (i = 0; i < COUNT; i++) {
        ASSERT_REAL(ascending[i], mdl_real_of(mdl_key_of(ascending[i])));
    }
}

void test_the_key_of_zero_is_zero(void)
{
    TEST_ASSERT_TRUE(mdl_key_of(MDL_C(0.0)) == 0);
    TEST_ASSERT_TRUE(mdl_key_of(-MDL_C(0.0) + MDL_C(0.0)) == 0);
}

void test_bits_are_those_of_ieee_754(void)
{
#ifdef MDL_REAL_DOUBLE
    TEST_ASSERT_TRUE(mdl_bits(1.0) == INT64_C(0x3FF0000000000000));
#else
    TEST_ASSERT_TRUE(mdl_bits(1.0f) == INT32_C(0x3F800000));
#endif
}

void test_nan_and_infinities_are_not_finite(void)
{
    int i;
    for (i = 0; i < 3; i++) {
        TEST_ASSERT_FALSE(mdl_is_finite(mdl_test_not_finite(i)));
        TEST_ASSERT_FALSE(mdl_is_finite(-mdl_test_not_finite(i)));
    }
}

void test_all_others_are_finite(void)
{
    uint16_t i;
    for (i = 0; i < COUNT; i++) {
        TEST_ASSERT_TRUE(mdl_is_finite(ascending[i]));
    }
    TEST_ASSERT_TRUE(mdl_is_finite(-MDL_C(0.0)));
}
