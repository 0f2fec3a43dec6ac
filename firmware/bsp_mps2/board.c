/*
 * The HAL contracts on an emulated Cortex-M4F (qemu-system-arm -M mps2-an386). Before the run the
 * codes of the drive voltage are loaded from codes.bin (uint16_t each); after it dac.bin (the DAC's
 * codes) and pin.vcd (the timing pin) are written.
 *
 * Time is counted in instructions, as `-icount shift=10,sleep=off` counts them: SysTick ticks every
 * 40 ns and an instruction takes 1024 ns of virtual time, which is 128 / 5 ticks. For the sample
 * rate and the VCD file an instruction stands for one cycle of a nominal 100 MHz, 10 ns.
 */
#include "mdl_adc.h"
#include "mdl_board.h"
#include "mdl_clock.h"
#include "mdl_dac.h"
#include "mdl_pin.h"
#include "semihosting.h"

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

#define NOMINAL_HZ 100000000u
#define TICKS(instructions) ((uint32_t)((uint64_t)(instructions)*128u / 5u))
#define INSTRUCTIONS(ticks) ((uint32_t)((ticks)*5u / 128u))

enum {
    SYST_STOP = 4,       /* processor clock */
    SYST_RUN = 7,        /* processor clock, interrupt, enabled */
    SYST_FLAG = 1 << 16, /* has counted to 0 since it was last read */
    PERIOD_MAX = 0x1000000,
    SAMPLES_MAX = 300000, /* times 10 000 instructions still fit in 32 bits */
    LINE_MAX = 16
};

/** A moment: periods of SysTick, and what it had still to count. */
typedef struct {
    uint32_t period;
    uint32_t left;
} moment;

__attribute__((section(".record"))) static uint16_t codes[SAMPLES_MAX];
__attribute__((section(".record"))) static uint16_t dac[SAMPLES_MAX];
__attribute__((section(".record"))) static moment rises[SAMPLES_MAX];
__attribute__((section(".record"))) static moment falls[SAMPLES_MAX];
static char text[4096];
static uint32_t text_length;
static uint32_t samples, served, written;
static uint32_t period_ticks, periods;
static uint16_t overrun;

void sample_tick(void);

/* Counts the end of a period when the flag is seen; that takes one look per period. */
static moment now(void)
{
    moment m;
    m.left = SYST_CVR;
    if ((SYST_CSR & SYST_FLAG) != 0) {
        m.left = SYST_CVR;
        periods++;
    }
    m.period = periods;
    return m;
}

mdl_hal_status mdl_board_init(void)
{
    int32_t bytes = semihosting_load("codes.bin", codes, sizeof codes);
    samples = bytes > 0 ? (uint32_t)bytes / 2u : 0;
    return samples > 0 ? MDL_HAL_OK : MDL_HAL_ERR_SELF_TEST;
}

void mdl_pin_init(void)
{
}

void mdl_pin_up(void)
{
    rises[served] = now();
}

void mdl_pin_down(void)
{
    uint32_t before = periods;
    falls[served] = now();
    overrun = periods != before;
}

mdl_hal_status mdl_dac_init(void)
{
    return MDL_HAL_OK;
}

mdl_hal_status mdl_dac_write(uint16_t code)
{
    dac[written++] = code;
    return MDL_HAL_OK;
}

mdl_hal_status mdl_adc_init(void)
{
    return MDL_HAL_OK;
}

mdl_hal_status mdl_adc_read(uint16_t *drive_code, uint16_t *sensor_code)
{
    *drive_code = codes[served];
    *sensor_code = 0;
    return MDL_HAL_OK;
}

mdl_hal_status mdl_clock_init(uint32_t rate_hz)
{
    period_ticks = TICKS(NOMINAL_HZ / rate_hz);
    if (period_ticks < 2u || period_ticks > PERIOD_MAX) {
        return MDL_HAL_ERR_PARAMETER;
    }
    SYST_CSR = SYST_STOP;
    SYST_RVR = period_ticks - 1u;
    SYST_CVR = 0;
    return MDL_HAL_OK;
}

void mdl_clock_start(void)
{
    SYST_CSR = SYST_RUN;
}

mdl_hal_status mdl_clock_acknowledge(void)
{
    served++;
    if (served == samples) {
        SYST_CSR = SYST_STOP;
    }
    return overrun ? MDL_HAL_OVERRUN : MDL_HAL_OK;
}

/* The interrupt of SysTick, see startup.c. */
void sample_tick(void)
{
    if (served < samples) {
        mdl_on_sample();
    }
}

static int write_text(int32_t file)
{
    int32_t failed = semihosting_write(file, text, text_length);
    text_length = 0;
    return failed == 0;
}

static void put_text(const char *more)
{
    while (*more != '\0') {
        text[text_length++] = *more++;
    }
}

static void put_edge(moment m, const char *level)
{
    char digits[LINE_MAX];
    uint32_t at = INSTRUCTIONS((uint64_t)m.period * period_ticks + (period_ticks - 1u - m.left));
    uint32_t i = LINE_MAX - 1u;
    digits[i] = '\0';
    do {
        digits[--i] = (char)('0' + at % 10u);
        at /= 10u;
    } while (at > 0);
    put_text("#");
    put_text(digits + i);
    put_text(level);
}

static int write_vcd(void)
{
    int32_t file = semihosting_create("pin.vcd");
    int good = file >= 0;
    uint32_t i;
    put_text("$comment Emulated Cortex-M4F: one unit of time is one instruction. $end\n"
             "$timescale 10 ns $end\n$scope module mps2 $end\n$var wire 1 ! timing_pin $end\n"
             "$upscope $end\n$enddefinitions $end\n#0\n0!\n");
    for (i = 0; i < served && good; i++) {
        put_edge(rises[i], "\n1!\n");
        put_edge(falls[i], "\n0!\n");
        if (text_length > sizeof text - 64u) {
            good = write_text(file);
        }
    }
    return good && write_text(file) && semihosting_close(file) == 0;
}

static int write_dac(void)
{
    int32_t file = semihosting_create("dac.bin");
    return semihosting_write(file, dac, written * sizeof dac[0]) == 0 &&
           semihosting_close(file) == 0;
}

uint16_t mdl_board_idle(void)
{
    if (served < samples) {
        __asm__ volatile("wfi");
        return 1;
    }
    if (!write_vcd() || !write_dac()) {
        semihosting_print("pin.vcd or dac.bin cannot be written\n");
        semihosting_exit(1);
    }
    return 0;
}
