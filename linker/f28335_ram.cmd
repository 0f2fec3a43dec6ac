/* F28335, loaded into RAM by a debugger and started at its entry, or booted from RAM ("boot to
 * SARAM"). Lengths in 16-bit words. */
MEMORY
{
    BEGIN  : origin = 0x000000, length = 0x000002
    RAMM0  : origin = 0x000050, length = 0x0003B0 /* below lies the boot ROM's stack */
    RAMM1  : origin = 0x000400, length = 0x000400
    RAML03 : origin = 0x008000, length = 0x004000
    RAML45 : origin = 0x00C000, length = 0x002000
    RAML67 : origin = 0x00E000, length = 0x002000
    RESET  : origin = 0x3FFFC0, length = 0x000002
}

SECTIONS
{
    codestart   : > BEGIN
    .text       : > RAML03
    .cinit      : > RAML03
    .pinit      : > RAML03
    .switch     : > RAML03
    .econst     : > RAML03

    /* Loaded where it runs: mdl_board_init then copies nothing. */
    .TI.ramfunc : { *(.TI.ramfunc) *(mdl_params) } > RAML03,
                  LOAD_START(_mdl_ram_load), RUN_START(_mdl_ram_run), LOAD_SIZE(_mdl_ram_size)

    mdl_left    : > RAML45
    mdl_right   : > RAML67
    mdl_record  : > RAML03
    .ebss       : > RAML03
    .stack      : > RAMM1

    .reset      : > RESET, TYPE = DSECT /* the boot ROM has its own */
}
