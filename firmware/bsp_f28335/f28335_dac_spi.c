/* A 12-bit DAC on SPI-A: GPIO16 data, GPIO18 clock, GPIO19 select. */
#include "f28335.h"
#include "mdl_dac.h"

#ifndef F28335_DAC_XINTF

static mdl_hal_status wait_while(uint16_t mask, uint16_t value)
{
    uint16_t polls;
    for (polls = F28335_DAC_POLLS; polls > 0; polls--) {
        if ((MDL_READ(SPISTS) & mask) != value) {
            return MDL_HAL_OK;
        }
    }
    return MDL_HAL_ERR_TIMEOUT;
}

static void send(uint16_t code)
{
    MDL_WRITE(SPITXBUF, F28335_DAC_COMMAND | (code << F28335_DAC_SHIFT));
}

static void claim_pins(void)
{
    uint32_t pins =
        MDL_MASK(GPAMUX2, GPIO16) | MDL_MASK(GPAMUX2, GPIO18) | MDL_MASK(GPAMUX2, GPIO19);
    uint32_t spi =
        MDL_PUT(GPAMUX2, GPIO16, 1) | MDL_PUT(GPAMUX2, GPIO18, 1) | MDL_PUT(GPAMUX2, GPIO19, 1);
    MDL_EALLOW();
    MDL_WRITE(GPAMUX2, (MDL_READ(GPAMUX2) & ~pins) | spi);
    MDL_EDIS();
}

static void set_up_spi(void)
{
    uint16_t mode =
        MDL_PUT(SPICCR, SPICHAR, 15) | MDL_PUT(SPICCR, CLKPOLARITY, F28335_SPI_POLARITY);
    MDL_WRITE(SPICCR, mode); /* held in reset while it is set up */
    MDL_WRITE(SPICTL, MDL_MASK(SPICTL, MASTER_SLAVE) | MDL_MASK(SPICTL, TALK) |
                          MDL_PUT(SPICTL, CLK_PHASE, F28335_SPI_PHASE));
    MDL_WRITE(SPIBRR, F28335_SPI_DIVIDER);
    MDL_WRITE(SPIFFTX, MDL_MASK(SPIFFTX, SPIRST) | MDL_MASK(SPIFFTX, TXFIFO)); /* no FIFO */
    MDL_WRITE(SPIPRI, MDL_MASK(SPIPRI, FREE)); /* a breakpoint does not cut a word in two */
    MDL_WRITE(SPICCR, mode | MDL_MASK(SPICCR, SPISWRESET));
}

mdl_hal_status mdl_dac_init(void)
{
    mdl_hal_status status;
    set_up_spi();
    claim_pins();
    send(0);
    status = wait_while(MDL_MASK(SPISTS, INT_FLAG), 0); /* self-test: the word leaves */
    (void)MDL_READ(SPIRXBUF);                           /* clears the flag */
    return status == MDL_HAL_OK ? MDL_HAL_OK : MDL_HAL_ERR_SELF_TEST;
}

mdl_hal_status mdl_dac_write(uint16_t code)
{
    mdl_hal_status status =
        wait_while(MDL_MASK(SPISTS, BUFFULL_FLAG), MDL_MASK(SPISTS, BUFFULL_FLAG));
    if (status == MDL_HAL_OK) {
        send(code);
    }
    return status;
}

#else

typedef uint16_t f28335_dac_is_on_the_bus; /* C99 wants a declaration */

#endif
