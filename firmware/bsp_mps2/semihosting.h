/**
 * @file semihosting.h
 * @brief Files of the PC that runs the emulator (Arm semihosting, BKPT 0xAB).
 *
 * For before and after the run: the virtual clock stands still during a call.
 */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

/**
 * Reads up to capacity bytes of the file into data.
 * @return bytes read, or -1 when the file cannot be opened or read, or is longer
 */
int32_t semihosting_load(const char *name, void *data, uint32_t capacity);

/** Opens a file for writing. @return a handle, or -1 */
int32_t semihosting_create(const char *name);

/** Appends length bytes. @return 0, or -1 when not all were written */
int32_t semihosting_write(int32_t handle, const void *data, uint32_t length);

/** Closes a file. @return 0 or -1 */
int32_t semihosting_close(int32_t handle);

/** Prints a line on the PC's terminal. */
void semihosting_print(const char *text);

/** Ends the emulation with this exit code. Does not return. */
void semihosting_exit(uint32_t code);

#endif
