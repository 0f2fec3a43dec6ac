/**
 * @file board.h
 * @brief What target.c needs of the machine that it runs on: AVR, Cortex-M4F or PC.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

/** Opens the input; words are 32 bits. */
void board_open(void);

/** The next word of the input; 0 when there is none left. */
uint16_t board_read(uint32_t *word);

/** The timing pin: between high and low the machine counts instructions, cycles or ns. */
void board_pin_high(void);
void board_pin_low(void);

/** Writes two words of results; the machine adds the cost and the stack depth of the sample. */
void board_write(uint32_t y_bits, uint32_t status_and_count);

/** Closes the output and ends the program. */
void board_close(void);

#endif
