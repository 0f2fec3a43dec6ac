/**
 * @file f28335.h
 * @brief What the files of this board share. The application sees only firmware/hal.
 */
#ifndef F28335_H
#define F28335_H

#include "f28335_config.h"
#include "f28335_io.h"

/** Waits at least us microseconds (0 to 65535) at 150 MHz, longer below. For the set-up only. */
void f28335_wait_us(uint16_t us);

/** Flash pipeline and wait states. Must not run from flash: its section is copied to RAM. */
void f28335_time_flash(void);

/** Interrupt at the end of each conversion. */
MDL_INTERRUPT void f28335_on_adc(void);

/** Every other interrupt: stops the trigger, lets the timing pin fall, and stays there. */
MDL_INTERRUPT void f28335_on_unexpected(void);

/** Serves one sample. */
void f28335_serve(void);

#endif
