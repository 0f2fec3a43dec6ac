/**
 * @file mdl_board.h
 * @brief Contract of the processor: clock, memory timing, interrupt table, and the idle loop.
 */
#ifndef MDL_BOARD_H
#define MDL_BOARD_H

#include "mdl_hal.h"

/**
 * Brings the processor to its operating state: watchdog, clock, memory timing, interrupt vectors.
 * Interrupts stay disabled. main calls it first, once.
 * @return MDL_HAL_OK, MDL_HAL_ERR_TIMEOUT (a clock did not lock), MDL_HAL_ERR_SELF_TEST
 */
mdl_hal_status mdl_board_init(void);

/**
 * What the processor does between samples. main calls it in a loop after the set-up.
 * @return 1 to be called again; 0 when the run is over (emulated and simulated boards only)
 */
uint16_t mdl_board_idle(void);

#endif
