/**
 * @file fake_f28335.h
 * @brief A fake register file of the F28335 with as much of ePWM1, ADC, SPI-A, PIE and PLL behind
 *        it as the firmware uses, and with faults to switch on.
 *
 * It logs every access and keeps the rules that silicon enforces in silence: what it would ignore
 * or get wrong (a protected register without EALLOW, a peripheral without clock, an ADC used
 * before its power-up time) is a violation that a test can see.
 */
#ifndef FAKE_F28335_H
#define FAKE_F28335_H

#include <stdint.h>

/** What may go wrong; all zero: a healthy board. Counts start at 1. */
typedef struct {
    uint32_t dead_after;      /**< accesses; then reads give dead_value, writes are lost */
    uint16_t dead_value;      /**< 0 or 0xFFFF */
    uint32_t adc_stuck_from;  /**< this conversion and all later ones never end */
    uint32_t adc_stuck_only;  /**< this conversion never ends; later ones do */
    uint32_t dac_stuck_from;  /**< this word and all later ones never leave the SPI */
    uint32_t pll_never_locks; /**< 1: so it is */
    uint32_t crystal_missing; /**< 1: the PLL runs in limp mode */
} fake_faults;

typedef enum {
    FAKE_READ,
    FAKE_WRITE,
    FAKE_EALLOW, /**< value 1 or 0 */
    FAKE_INTERRUPTS,
    FAKE_IER,
    FAKE_IFR,
    FAKE_WAIT, /**< value: NOPs in a row */
    FAKE_CALIBRATION,
    FAKE_COPY,
    FAKE_BUS /**< a write to the external bus */
} fake_kind;

/** One entry of the log; repeated reads with the same value are one entry. */
typedef struct {
    fake_kind kind;
    uint32_t address;
    uint32_t value;
    const char *name; /**< of the register, or of the kind */
} fake_event;

/* Smaller where the sources are only checked, for a compiler with 16-bit addresses. */
#ifndef FAKE_LOG_LENGTH
#ifndef FAKE_LOG_LENGTH
#define FAKE_LOG_LENGTH 4096
#endif
#ifndef FAKE_DAC_LENGTH
#define FAKE_DAC_LENGTH 8192
#endif
#endif

/** The board, for tests to read, and to write where it says so. */
typedef struct {
    fake_faults faults;             /**< in */
    uint16_t (*drive)(uint32_t i);  /**< in: code of channel 0 after trigger i, or NULL: 0 */
    uint16_t (*sensor)(uint32_t i); /**< in: code of channel 1, likewise */
    uint64_t run_clocks;            /**< in: from the first trigger until the run is over */
    uint32_t compute_clocks;        /**< in: what the computation of one sample takes */
    uint64_t clock;                 /**< processor clocks since reset */
    uint64_t started;               /**< clock when the trigger began to run, 0: it does not */
    uint32_t accesses_of_set_up;    /**< accesses until then */
    uint32_t accesses;              /**< reads and writes of registers */
    uint32_t triggers, conversions, interrupts; /**< conversions that began */
    uint16_t pin;                               /**< level of GPIO32; 2 before it is an output */
    uint64_t pin_high_clocks, pin_edges;
    uint16_t dac_word[FAKE_DAC_LENGTH]; /**< words that have left, SPI or bus */
    uint32_t dac_words;
    uint32_t violations;
    const char *violation;           /**< the first one */
    fake_event log[FAKE_LOG_LENGTH]; /**< the first events */
    uint32_t logged;                 /**< events in the log; it does not grow when full */
} fake_board;

extern fake_board fake;

/** Reset state of the chip, no faults, empty log. */
void fake_reset(void);

/** Word at an address without side effect or log entry. */
uint32_t fake_peek(uint32_t address, uint32_t width);

/** Lets time pass as if the processor did nothing. */
void fake_spend(uint32_t clocks);

/* What f28335_io.h calls. */
uint32_t fake_read(uint32_t address, uint32_t width);
void fake_write(uint32_t address, uint32_t width, uint32_t value);
void fake_write_bus(uint32_t address, uint32_t value);
void fake_set_vector(uint32_t slot, void (*function)(void));
void fake_write_ier(uint32_t value);
void fake_write_ifr(uint32_t value);
void fake_eallow(uint16_t on);
void fake_interrupts(uint16_t on);
void fake_nop(void);
void fake_calibrate_adc(void);
void fake_copy_ram_functions(void);
uint16_t fake_keeps_running(void);

#endif
