/**
 * @file mdl_sample.h
 * @brief What the board calls. Everything else in this folder is what the application calls.
 */
#ifndef MDL_SAMPLE_H
#define MDL_SAMPLE_H

/** One sample. Defined by the application (main.c), called by the board's interrupt. */
void mdl_on_sample(void);

#endif
