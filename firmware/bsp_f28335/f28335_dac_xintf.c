/* A 12-bit DAC as one word of the external bus. The bus does not answer: no fault can be seen. */
#include "f28335.h"
#include "mdl_dac.h"

#ifdef F28335_DAC_XINTF

#define JOIN2(a, b) a##b
#define JOIN(a, b) JOIN2(a, b)
#define ZONE_TIMING JOIN(XTIMING, F28335_XINTF_ZONE)
#define WRITE(name, value) MDL_WRITE(name, value) /* name is expanded first */

/** Ones from the lowest bit of the first pin to the highest bit of the last pin of a register. */
#define PINS(name, first, last)                                                                    \
    ((MDL_MASK(name, last) | (MDL_PUT(name, last, 1) - 1u)) & ~(MDL_PUT(name, first, 1) - 1u))

static void claim_pins(void)
{
    MDL_WRITE(GPAMUX2, MDL_READ(GPAMUX2) | PINS(GPAMUX2, GPIO28, GPIO31));
    MDL_WRITE(GPBMUX1, MDL_READ(GPBMUX1) | PINS(GPBMUX1, GPIO34, GPIO47));
    MDL_WRITE(GPCMUX1, PINS(GPCMUX1, GPIO64, GPIO79));
    MDL_WRITE(GPCMUX2, MDL_READ(GPCMUX2) | PINS(GPCMUX2, GPIO80, GPIO87));
}

/** The slowest timing, and no look at XREADY: a missing board cannot hang the processor. */
static void set_up_bus(void)
{
    MDL_WRITE(XINTCNF2, MDL_PUT(XINTCNF2, XTIMCLK, 1) | MDL_MASK(XINTCNF2, CLKOFF) |
                            MDL_PUT(XINTCNF2, WRBUFF, 0));
    WRITE(ZONE_TIMING, MDL_MASK(XTIMING0, XWRLEAD) | MDL_MASK(XTIMING0, XWRACTIVE) |
                           MDL_MASK(XTIMING0, XWRTRAIL) | MDL_MASK(XTIMING0, XRDLEAD) |
                           MDL_MASK(XTIMING0, XRDACTIVE) | MDL_MASK(XTIMING0, XRDTRAIL) |
                           MDL_MASK(XTIMING0, X2TIMING) | MDL_MASK(XTIMING0, XSIZE));
}

mdl_hal_status mdl_dac_init(void)
{
    MDL_EALLOW();
    set_up_bus();
    claim_pins();
    MDL_EDIS();
    return mdl_dac_write(0);
}

mdl_hal_status mdl_dac_write(uint16_t code)
{
    MDL_WRITE_BUS(F28335_XINTF_ADDRESS, code);
    return MDL_HAL_OK;
}

#else

typedef uint16_t f28335_dac_is_on_the_spi; /* C99 wants a declaration */

#endif
