/** @file main.c
 *  @brief Fixes the order of the set-up and owns the one instance of all state.
 */
#include "mdl_adc.h"
#include "mdl_app.h"
#include "mdl_board.h"
#include "mdl_clock.h"
#include "mdl_dac.h"
#include "mdl_params.h"
#include "mdl_pin.h"

/* Sections of their own: the linker fills L4-L5 and L6-L7 of the F28335 with left and right, and
 * has the interrupt run from RAM. */
#ifdef __TMS320C28XX__
#pragma DATA_SECTION(left, "mdl_left")
#pragma DATA_SECTION(right, "mdl_right")
#pragma DATA_SECTION(record, "mdl_record")
#pragma CODE_SECTION(mdl_on_sample, ".TI.ramfunc")
#endif
static mdl_tp_side left;
static mdl_tp_side right;
static mdl_app_record record;
static mdl_app app;

void mdl_on_sample(void)
{
    mdl_app_isr(&app);
}

/** The outputs are defined before anything can fail later; the clock starts when all else is. */
static int set_up(void)
{
    if (mdl_board_init() != MDL_HAL_OK) {
        return 0;
    }
    mdl_pin_init();
    if (mdl_dac_init() != MDL_HAL_OK || mdl_adc_init() != MDL_HAL_OK) {
        return 0;
    }
    if (mdl_app_init(&app, &mdl_params, &left, &right, &record) != MDL_OK) {
        return 0;
    }
    if (mdl_clock_init(mdl_params.rate_hz) != MDL_HAL_OK) {
        return 0;
    }
    mdl_clock_start();
    return 1;
}

int main(void)
{
    if (!set_up()) {
        return 1; /* the clock does not run: no sample, no output, timing pin low */
    }
    while (mdl_board_idle() != 0) {
    }
    return 0;
}
