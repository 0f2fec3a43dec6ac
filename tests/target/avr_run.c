/*
 * Runs target.c's AVR image: avr_run IMAGE.elf <input >output. Input: 32-bit words. Output per
 * sample: the two words that the image writes, the cycles and the bytes of stack between the
 * rising and the falling edge of the pin. 64 KB of RAM stand for the 16 KB that the part has.
 */
#include <sim_avr.h>
#include <sim_elf.h>
#include <sim_io.h>

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GPIOR0 = 0x3E, GPIOR1 = 0x4A, GPIOR2 = 0x4B, SPL = 0x5D, PAINT = 0xA5, DEPTH = 1024 };

static avr_cycle_count_t rise;
static uint16_t rise_sp;
static uint32_t measured[2]; /* cycles, bytes of stack */
static int next = EOF;
static unsigned written;

static uint8_t read_byte(avr_t *avr, avr_io_addr_t address, void *param)
{
    int byte = next;
    (void)avr, (void)address, (void)param;
    next = getchar();
    return (uint8_t)byte;
}

static uint8_t read_more(avr_t *avr, avr_io_addr_t address, void *param)
{
    (void)avr, (void)address, (void)param;
    return next != EOF;
}

static void write_byte(avr_t *avr, avr_io_addr_t address, uint8_t byte, void *param)
{
    (void)avr, (void)address, (void)param;
    putchar(byte);
    if (++written % 8 == 0) {
        fwrite(measured, sizeof measured, 1, stdout);
    }
}

static void write_pin(avr_t *avr, avr_io_addr_t address, uint8_t level, void *param)
{
    (void)address, (void)param;
    if (level) {
        rise_sp = (uint16_t)(avr->data[SPL] | avr->data[SPL + 1] << 8);
        memset(avr->data + rise_sp + 1 - DEPTH, PAINT, DEPTH);
        rise = avr->cycle;
    } else {
        uint32_t unused = 0;
        measured[0] = (uint32_t)(avr->cycle - rise);
        while (unused < DEPTH && avr->data[rise_sp + 1 - DEPTH + unused] == PAINT) {
            unused++;
        }
        measured[1] = DEPTH - unused;
    }
}

/* simavr writes its remarks to stdout. */
static void log_errors(avr_t *avr, const int level, const char *format, va_list arguments)
{
    (void)avr;
    if (level <= LOG_ERROR) {
        vfprintf(stderr, format, arguments);
    }
}

int main(int argc, char **argv)
{
    elf_firmware_t image = {0};
    avr_t *avr = avr_make_mcu_by_name("atmega1284p");
    int state;
    avr_global_logger_set(log_errors);
    if (argc != 2 || avr == NULL || elf_read_firmware(argv[1], &image) != 0) {
        fprintf(stderr, "usage: avr_run IMAGE.elf <input >output\n");
        return 2;
    }
    avr->ramend = 0xffff;
    avr_init(avr);
    avr_load_firmware(avr, &image);
    avr_register_io_read(avr, GPIOR0, read_byte, NULL);
    avr_register_io_read(avr, GPIOR1, read_more, NULL);
    avr_register_io_write(avr, GPIOR1, write_byte, NULL);
    avr_register_io_write(avr, GPIOR2, write_pin, NULL);
    next = getchar();
    do {
        state = avr_run(avr);
    } while (state != cpu_Done && state != cpu_Crashed);
    return state == cpu_Done && fflush(stdout) == 0 ? 0 : 1;
}
