/* Cortex-M4F: input.bin and output.bin through semihosting, the pin on the instruction clock. */
#include "board.h"
#include "semihosting.h"

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

enum { SYST_MASK = 0xFFFFFF, SYST_RUN = 5, STACK_WORDS = 64 };
static const uint32_t paint = 0xA5A5A5A5u;

typedef struct {
    uint32_t y_bits;
    uint32_t status_and_count;
    uint32_t ticks;
    uint32_t stack_bytes;
} row;

__attribute__((section(".record"))) static uint32_t input[1000000];
__attribute__((section(".record"))) static row output[700000];
static uint32_t words, read_words, rows;
static uint32_t rise, fall, untouched;
static volatile uint32_t *painted;

void board_open(void)
{
    int32_t bytes = semihosting_load("input.bin", input, sizeof input);
    if (bytes < 0) {
        semihosting_print("input.bin cannot be read\n");
        semihosting_exit(1);
    }
    words = (uint32_t)bytes / 4u;
    SYST_RVR = SYST_MASK;
    SYST_CVR = 0;
    SYST_CSR = SYST_RUN;
}

uint16_t board_read(uint32_t *word)
{
    if (read_words == words) {
        return 0;
    }
    *word = input[read_words++];
    return 1;
}

void board_pin_high(void)
{
    uint32_t i;
    __asm__ volatile("mov %0, sp" : "=r"(painted));
    painted -= STACK_WORDS;
    for (i = 0; i < STACK_WORDS; i++) {
        painted[i] = paint;
    }
    rise = SYST_CVR;
}

void board_pin_low(void)
{
    fall = SYST_CVR;
    for (untouched = 0; untouched < STACK_WORDS && painted[untouched] == paint;) {
        untouched++;
    }
}

void board_write(uint32_t y_bits, uint32_t status_and_count)
{
    output[rows].y_bits = y_bits;
    output[rows].status_and_count = status_and_count;
    output[rows].ticks = (rise - fall) & SYST_MASK; /* counts down */
    output[rows].stack_bytes = 4u * (STACK_WORDS - untouched);
    rows++;
}

void board_close(void)
{
    int32_t file = semihosting_create("output.bin");
    if (semihosting_write(file, output, rows * sizeof output[0]) != 0 ||
        semihosting_close(file) != 0) {
        semihosting_print("output.bin cannot be written\n");
        semihosting_exit(1);
    }
}
