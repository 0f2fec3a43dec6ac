/* F28335, started from flash. Lengths in 16-bit words.
 *
 * Of the end of sector A only the two words of BEGIN are used. 0x33FF80 to 0x33FFF5 stay as they
 * are for the code security module; 0x33FFF8 to 0x33FFFF are its passwords: whatever is written
 * there can lock the chip for good.
 */
MEMORY
{
    RAMM0  : origin = 0x000050, length = 0x0003B0 /* below lies the boot ROM's stack */
    RAMM1  : origin = 0x000400, length = 0x000400
    RAML03 : origin = 0x008000, length = 0x004000
    RAML45 : origin = 0x00C000, length = 0x002000
    RAML67 : origin = 0x00E000, length = 0x002000
    FLASHA : origin = 0x338000, length = 0x007F80
    BEGIN  : origin = 0x33FFF6, length = 0x000002
    RESET  : origin = 0x3FFFC0, length = 0x000002
}

SECTIONS
{
    codestart   : > BEGIN
    .text       : > FLASHA
    .cinit      : > FLASHA
    .pinit      : > FLASHA
    .switch     : > FLASHA
    .econst     : > FLASHA

    /* What an interrupt runs and reads: without the wait states of the flash. */
    .TI.ramfunc : { *(.TI.ramfunc) *(mdl_params) } LOAD = FLASHA, RUN = RAML03,
                  LOAD_START(_mdl_ram_load), RUN_START(_mdl_ram_run), LOAD_SIZE(_mdl_ram_size)

    mdl_left    : > RAML45
    mdl_right   : > RAML67
    mdl_record  : > RAML03
    .ebss       : > RAML03
    .stack      : > RAMM1

    .reset      : > RESET, TYPE = DSECT /* the boot ROM has its own */
}
