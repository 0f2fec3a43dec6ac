/* A dead band of 2 um. */
#include "unity.h"

#include "mdl_test.h"

#include "mdl_backlash.h"

static const mdl_real band = MDL_C(2.0);

void setUp(void)
{
}

void tearDown(void)
{
}

void test_the_target_starts_half_a_dead_band_behind(void)
{
    ASSERT_REAL(4.0, mdl_backlash_start(band, MDL_C(5.0)));
}

void test_the_target_is_pushed_stays_and_is_pulled(void)
{
    mdl_real target = mdl_backlash_start(band, MDL_C(5.0));
    target = mdl_backlash_step(band, target, MDL_C(8.0));
    ASSERT_REAL(7.0, target);
    target = mdl_backlash_step(band, target, MDL_C(6.5));
    ASSERT_REAL(7.0, target); /* within the band */
    target = mdl_backlash_step(band, target, MDL_C(6.0));
    ASSERT_REAL(7.0, target); /* at its edge */
    target = mdl_backlash_step(band, target, MDL_C(3.0));
    ASSERT_REAL(4.0, target);
    target = mdl_backlash_step(band, target, MDL_C(5.0));
    ASSERT_REAL(4.0, target);
}

void test_no_dead_band_follows(void)
{
    ASSERT_REAL(3.0, mdl_backlash_step(MDL_C(0.0), MDL_C(1.0), MDL_C(3.0)));
    ASSERT_REAL(0.5, mdl_backlash_step(MDL_C(0.0), MDL_C(1.0), MDL_C(0.5)));
}
