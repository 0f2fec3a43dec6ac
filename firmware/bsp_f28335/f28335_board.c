#include "f28335.h"
#include "mdl_board.h"
#include "mdl_pin.h"

void f28335_wait_us(uint16_t us)
{
    uint32_t turns;
    /* A turn takes one clock at least, so this is never too short. */
    for (turns = (uint32_t)(us * (F28335_SYSCLK_HZ / 1000000uL)); turns > 0; turns--) {
        MDL_NOP();
    }
}

#ifdef __TMS320C28XX__
#pragma CODE_SECTION(f28335_time_flash, ".TI.ramfunc")

void f28335_copy(uint16_t *to, const uint16_t *from, uint32_t words)
{
    if (to == from) {
        return; /* the RAM image */
    }
    for (; words > 0; words--) {
        *to++ = *from++;
    }
}
#endif

void f28335_time_flash(void)
{
    MDL_EALLOW();
    MDL_WRITE(FOPT, MDL_MASK(FOPT, ENPIPE));
    MDL_WRITE(FBANKWAIT, MDL_PUT(FBANKWAIT, PAGEWAIT, 5) | MDL_PUT(FBANKWAIT, RANDWAIT, 5));
    MDL_WRITE(FOTPWAIT, MDL_PUT(FOTPWAIT, OTPWAIT, 8));
    MDL_WRITE(FSTDBYWAIT, MDL_MASK(FSTDBYWAIT, STDBYWAIT));
    MDL_WRITE(FACTIVEWAIT, MDL_MASK(FACTIVEWAIT, ACTIVEWAIT));
    MDL_EDIS();
    MDL_FLUSH_PIPELINE(); /* the writes must have arrived before the flash is read again */
}

/** f28335_start.asm has stopped it already; a debugger may have entered at c_int00. */
static void stop_watchdog(void)
{
    MDL_EALLOW();
    MDL_WRITE(WDCR, 0x0068); /* WDDIS, and the check bits 101 without which the chip is reset */
    MDL_EDIS();
}

static mdl_hal_status lock_pll(void)
{
    uint32_t polls;
    MDL_EALLOW();
    MDL_WRITE(PLLSTS, MDL_MASK(PLLSTS, MCLKOFF)); /* DIVSEL 0: required while PLLCR changes */
    MDL_WRITE(PLLCR, MDL_PUT(PLLCR, DIV, F28335_PLL_MULTIPLIER));
    MDL_EDIS();
    for (polls = F28335_PLL_POLLS; polls > 0; polls--) {
        if ((MDL_READ(PLLSTS) & MDL_MASK(PLLSTS, PLLLOCKS)) != 0) {
            MDL_EALLOW();
            MDL_WRITE(PLLSTS, 0);
            MDL_WRITE(PLLSTS, MDL_PUT(PLLSTS, DIVSEL, 2));
            MDL_EDIS();
            return MDL_HAL_OK;
        }
    }
    return MDL_HAL_ERR_TIMEOUT;
}

/** Clocks of what is used, of nothing else. TBCLKSYNC stays 0 until mdl_clock_start. */
static void clock_peripherals(void)
{
    MDL_EALLOW();
    MDL_WRITE(HISPCP, MDL_PUT(HISPCP, HSPCLK, 3)); /* 25 MHz, the most that the ADC takes */
    MDL_WRITE(LOSPCP, MDL_PUT(LOSPCP, LSPCLK, 2)); /* 37.5 MHz */
    MDL_WRITE(PCLKCR0, MDL_MASK(PCLKCR0, ADCENCLK) | MDL_MASK(PCLKCR0, SPIAENCLK));
    MDL_WRITE(PCLKCR1, MDL_MASK(PCLKCR1, EPWM1ENCLK));
#ifdef F28335_DAC_XINTF
    MDL_WRITE(PCLKCR3, MDL_MASK(PCLKCR3, GPIOINENCLK) | MDL_MASK(PCLKCR3, XINTFENCLK));
#else
    MDL_WRITE(PCLKCR3, MDL_MASK(PCLKCR3, GPIOINENCLK));
#endif
    MDL_EDIS();
}

static void fill_interrupt_table(void)
{
    uint16_t i;
    MDL_WRITE(PIECTRL, 0);
    MDL_WRITE_IER(0);
    MDL_WRITE_IFR(0);
    for (i = 0; i < f28335_items_PIEIER; i++) {
        MDL_WRITE_ITEM(PIEIER, i, 0);
        MDL_WRITE_ITEM(PIEIFR, i, 0);
    }
    MDL_EALLOW();
    for (i = 0; i < f28335_items_PIEVECT; i++) {
        MDL_SET_VECTOR(i, f28335_on_unexpected);
    }
    MDL_SET_VECTOR(F28335_ADCINT_VECTOR, f28335_on_adc);
    MDL_EDIS();
    MDL_WRITE(PIECTRL, MDL_MASK(PIECTRL, ENPIE));
}

mdl_hal_status mdl_board_init(void)
{
    mdl_hal_status status;
    MDL_DISABLE_INTERRUPTS();
    stop_watchdog();
    MDL_COPY_RAM_FUNCTIONS();
    f28335_time_flash(); /* before the clock rises: the reset value of the wait states is larger */
    if ((MDL_READ(PLLSTS) & MDL_MASK(PLLSTS, MCLKSTS)) != 0) {
        return MDL_HAL_ERR_SELF_TEST; /* no crystal: the PLL runs free in limp mode */
    }
    status = lock_pll();
    if (status == MDL_HAL_OK) {
        clock_peripherals();
        fill_interrupt_table();
    }
    return status;
}

/**
 * A trigger that no interrupt follows means that the ADC hangs. Then the sample is served from
 * here: that counts the fault and resets the sequencer.
 */
uint16_t mdl_board_idle(void)
{
    uint16_t polls;
    for (polls = F28335_STALL_POLLS; polls > 0; polls--) {
        if ((MDL_READ(ETFLG) & MDL_MASK(ETFLG, SOCA)) == 0) {
            return MDL_FOR_EVER();
        }
    }
    MDL_DISABLE_INTERRUPTS();
    if ((MDL_READ(ETFLG) & MDL_MASK(ETFLG, SOCA)) != 0) {
        f28335_serve();
    }
    MDL_ENABLE_INTERRUPTS();
    return MDL_FOR_EVER();
}

MDL_INTERRUPT void f28335_on_unexpected(void)
{
    MDL_WRITE(ETSEL, 0);
    mdl_pin_down();
    while (MDL_FOR_EVER()) {
        MDL_NOP();
    }
}
