/* The AVR's side of avr_run.c, which answers on the general-purpose I/O registers. */
#include "board.h"

#include <avr/io.h>
#include <avr/interrupt.h>
#include <avr/sleep.h>

void board_open(void)
{
}

uint16_t board_read(uint32_t *word)
{
    if (GPIOR1 == 0) {
        return 0;
    }
    *word = GPIOR0;
    *word |= (uint32_t)GPIOR0 << 8;
    *word |= (uint32_t)GPIOR0 << 16;
    *word |= (uint32_t)GPIOR0 << 24;
    return 1;
}

void board_pin_high(void)
{
    GPIOR2 = 1;
}

void board_pin_low(void)
{
    GPIOR2 = 0;
}

static void write_word(uint32_t word)
{
    GPIOR1 = (unsigned char)word;
    GPIOR1 = (unsigned char)(word >> 8);
    GPIOR1 = (unsigned char)(word >> 16);
    GPIOR1 = (unsigned char)(word >> 24);
}

void board_write(uint32_t y_bits, uint32_t status_and_count)
{
    write_word(y_bits);
    write_word(status_and_count);
}

/* Sleep without interrupts ends the emulation. */
void board_close(void)
{
    cli();
    sleep_enable();
    sleep_cpu();
}
