/* The timing pin is GPIO32: SPI-A, McBSP-A and XINTF leave it free. */
#include "f28335.h"
#include "mdl_pin.h"

void mdl_pin_init(void)
{
    mdl_pin_down(); /* before it becomes an output, so that no pulse appears */
    MDL_EALLOW();
    MDL_WRITE(GPBMUX1, MDL_READ(GPBMUX1) & ~MDL_MASK(GPBMUX1, GPIO32));
    MDL_WRITE(GPBDIR, MDL_READ(GPBDIR) | MDL_MASK(GPBDIR, GPIO32));
    MDL_EDIS();
}

void mdl_pin_up(void)
{
    MDL_WRITE(GPBSET, MDL_MASK(GPBSET, GPIO32));
}

void mdl_pin_down(void)
{
    MDL_WRITE(GPBCLEAR, MDL_MASK(GPBCLEAR, GPIO32));
}
