/* The alternative DAC on the external bus; built once for each zone. */
#include "board_run.inc"

#include "fake_f28335.h"
#include "mdl_app.h"
#include "mdl_backlash.h"
#include "mdl_bouc.h"
#include "mdl_chain.h"
#include "mdl_cycle.h"
#include "mdl_delay.h"
#include "mdl_drive.h"
#include "mdl_envelope.h"
#include "mdl_lag.h"
#include "mdl_major.h"
#include "mdl_mode.h"
#include "mdl_params.h"
#include "mdl_pi.h"
#include "mdl_plays.h"
#include "mdl_power.h"
#include "mdl_rate.h"
#include "mdl_shape.h"
#include "mdl_traj.h"
#include "mdl_yang.h"

#include <string.h>

/* clang-format off */
TEST_SOURCE_FILE("f28335_adc.c")
TEST_SOURCE_FILE("f28335_board.c")
TEST_SOURCE_FILE("f28335_clock.c")
TEST_SOURCE_FILE("f28335_dac_spi.c")
TEST_SOURCE_FILE("f28335_dac_xintf.c")
TEST_SOURCE_FILE("f28335_pin.c")
/* clang-format on */

void setUp(void)
{
    fake_reset();
}

void tearDown(void)
{
}

void test_codes_go_to_the_first_address_of_the_zone(void)
{
    const uint32_t address = F28335_XINTF_ZONE == 0   ? 0x004000
                             : F28335_XINTF_ZONE == 6 ? 0x100000
                                                      : 0x200000;
    uint32_t i;
    uint32_t words = 0;
    TEST_ASSERT_EQUAL_INT(0, run_samples(5));
    for (i = 0; i < fake.logged; i++) {
        if (fake.log[i].kind == FAKE_BUS) {
            TEST_ASSERT_EQUAL_HEX32(address, fake.log[i].address);
            TEST_ASSERT_EQUAL_HEX32(0, fake.log[i].value);
            words++;
        }
    }
    TEST_ASSERT_EQUAL_UINT32(6, words);
    TEST_ASSERT_EQUAL_UINT32(5, app.counters.cycles);
    ASSERT_NO_VIOLATION();
}

/* XREADY is not looked at (bit 14 is 0), width 16 bits (bits 17:16 are 11), slowest timing. */
void test_the_bus_is_set_up_before_its_pins_and_the_timing_pin_stays_a_pin(void)
{
    const uint32_t timing = F28335_XINTF_ZONE == 0   ? 0x0B20
                            : F28335_XINTF_ZONE == 6 ? 0x0B2C
                                                     : 0x0B2E;
    (void)run_samples(1);
    TEST_ASSERT_EQUAL_HEX32(0x00433FFF, fake_peek(timing, 32));
    TEST_ASSERT_EQUAL_HEX32(0x00010008, fake_peek(0x0B34, 32));
    TEST_ASSERT_EQUAL_HEX32(0xFF000000, fake_peek(0x6F88, 32)); /* GPIO28-31 */
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFF0, fake_peek(0x6F96, 32)); /* GPIO34-47, not 32 and 33 */
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFF, fake_peek(0x6FA6, 32)); /* GPIO64-79 */
    TEST_ASSERT_EQUAL_HEX32(0x0000FFFF, fake_peek(0x6FA8, 32)); /* GPIO80-87 */
    TEST_ASSERT_EQUAL_HEX16(0x3000, fake_peek(0x7020, 16));     /* clocks of bus and pins */
    TEST_ASSERT_EQUAL_UINT32(2, fake.pin_edges);
}
