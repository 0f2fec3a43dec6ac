/**
 * @file mdl_pin.h
 * @brief Contract of the timing pin: high while a sample is computed, for a scope or a logic
 *        analyser (Cao & Li 2019, section 4, measures computation time so).
 */
#ifndef MDL_PIN_H
#define MDL_PIN_H

/** Makes the pin an output and low. main calls it once, after mdl_board_init. */
void mdl_pin_init(void);

/** High. First thing of the interrupt loop. */
void mdl_pin_up(void);

/** Low. The interrupt loop calls it when the sample is done, in every case. */
void mdl_pin_down(void);

#endif
