/* ePWM1 counts up and starts a conversion at each period; the ADC interrupts at its end. */
#include "f28335.h"
#include "mdl_clock.h"

#define COUNT_UP 0
#define ON_PERIOD 2
#define LISTEN (MDL_MASK(ADCTRL2, EPWM_SOCA_SEQ1) | MDL_MASK(ADCTRL2, INT_ENA_SEQ1))

/** Timer counts per sample, to the nearest. */
static uint32_t counts(uint32_t rate_hz, uint16_t halvings)
{
    uint32_t scaled = rate_hz << halvings;
    return (uint32_t)((F28335_SYSCLK_HZ + scaled / 2u) / scaled);
}

mdl_hal_status mdl_clock_init(uint32_t rate_hz)
{
    uint16_t halvings = 0;
    if (rate_hz < F28335_RATE_HZ_MIN || rate_hz > F28335_RATE_HZ_MAX) {
        return MDL_HAL_ERR_PARAMETER;
    }
    while (counts(rate_hz, halvings) > 65536uL) {
        halvings++;
    }
    MDL_WRITE(TBCTL, MDL_PUT(TBCTL, CTRMODE, COUNT_UP) | MDL_PUT(TBCTL, HSPCLKDIV, 0) |
                         MDL_PUT(TBCTL, CLKDIV, halvings));
    MDL_WRITE(TBPRD, counts(rate_hz, halvings) - 1u);
    MDL_WRITE(TBCTR, 0);
    MDL_WRITE(ETSEL, MDL_MASK(ETSEL, SOCAEN) | MDL_PUT(ETSEL, SOCASEL, ON_PERIOD));
    MDL_WRITE(ETPS, MDL_PUT(ETPS, SOCAPRD, 1));
    MDL_WRITE(ETCLR, MDL_MASK(ETCLR, SOCA));
    return MDL_HAL_OK;
}

void mdl_clock_start(void)
{
    MDL_WRITE(ADCTRL2, LISTEN);
    MDL_WRITE_ITEM(PIEIER, 0, F28335_ADCINT_BIT);
    MDL_WRITE(PIEACK, MDL_MASK(PIEACK, ACK1));
    MDL_WRITE_IER(1);
    MDL_ENABLE_INTERRUPTS();
    MDL_EALLOW();
    MDL_WRITE(PCLKCR0, MDL_READ(PCLKCR0) | MDL_MASK(PCLKCR0, TBCLKSYNC));
    MDL_EDIS();
}

/**
 * The trigger's flag tells whether the next sample instant has passed: f28335_serve cleared it,
 * the hardware sets it at each trigger. It is read after the sequencer's reset, which aborts a
 * conversion that has begun, and cleared then: this trigger is accounted for.
 */
mdl_hal_status mdl_clock_acknowledge(void)
{
    uint16_t late;
    MDL_WRITE(ADCTRL2, LISTEN | MDL_MASK(ADCTRL2, RST_SEQ1));
    MDL_WRITE(ADCST, MDL_MASK(ADCST, INT_SEQ1_CLR));
    late = MDL_READ(ETFLG) & MDL_MASK(ETFLG, SOCA);
    if (late != 0) {
        MDL_WRITE(ETCLR, MDL_MASK(ETCLR, SOCA));
    }
    MDL_WRITE(PIEACK, MDL_MASK(PIEACK, ACK1)); /* |= would acknowledge every group */
    return late != 0 ? MDL_HAL_OVERRUN : MDL_HAL_OK;
}

void f28335_serve(void)
{
    MDL_WRITE(ETCLR, MDL_MASK(ETCLR, SOCA));
    mdl_on_sample();
}

MDL_INTERRUPT void f28335_on_adc(void)
{
    f28335_serve();
}
