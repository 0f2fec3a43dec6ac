/*
 * Compares f28335_regs.h with TI's headers, which a PC compiler reads as well: types come from
 * here, addresses of the structures from ti_bases.h, which compare.py takes from TI's linker
 * command file. TI's structures are laid out in 16-bit words, PC addresses count bytes.
 */
#include <stdint.h>
#include <stdio.h>

#define DSP28_DATA_TYPES
typedef int16_t int16;
typedef int32_t int32;
typedef uint16_t Uint16;
typedef uint32_t Uint32;
typedef float float32;
typedef double float64;
#define interrupt
#define __interrupt
#define cregister
#include "DSP2833x_Device.h"
#include "DSP2833x_GlobalVariableDefs.c"
#include "f28335_io.h"
#include "ti_bases.h"

static unsigned compared;
static unsigned differences;

static void same(const char *what, const char *name, unsigned long ours, unsigned long theirs)
{
    compared++;
    if (ours != theirs) {
        differences++;
        printf("%s of %s: 0x%lX here, 0x%lX in TI's headers\n", what, name, ours, theirs);
    }
}

/* Word address of a member of one of TI's structures; a vector is two words, a PC's pointer more.
 */
#define WORDS(structure, member)                                                                   \
    (unsigned long)((const volatile char *)&structure.member - (const volatile char *)&structure)
#define ADDRESS(structure, member) (base_##structure + WORDS(structure, member) / 2u)

#define COMPARE(name, address, width, access, structure, member)                                   \
    same("address", #name, address, ADDRESS(structure, member));                                   \
    same("width", #name, width, 8u * sizeof structure.member);

#define COMPARE_ARRAY(name, address, width, stride, items, access, structure, first, last)         \
    if (sizeof structure.first == sizeof(void *)) {                                                \
        unsigned long slots = WORDS(structure, last) / sizeof(void *);                             \
        same("address", #name, address, base_##structure);                                         \
        same("items", #name, items, slots + 1u);                                                   \
    } else {                                                                                       \
        same("address", #name, address, ADDRESS(structure, first));                                \
        same("last item", #name, address + stride * (items - 1), ADDRESS(structure, last));        \
        same("width", #name, width, 8u * sizeof structure.first);                                  \
    }

#define COMPARE_FIELD(name, field, lsb, bits, structure, member)                                   \
    structure.member.all = 0;                                                                      \
    structure.member.bit.field = (Uint16)~0;                                                       \
    same("mask of " #field, #name, MDL_MASK(name, field), structure.member.all);

int main(void)
{
    F28335_REGISTERS(COMPARE)
    F28335_ARRAYS(COMPARE_ARRAY)
    F28335_FIELDS(COMPARE_FIELD)
    same("vector", "ADCINT", F28335_ADCINT_VECTOR, WORDS(PieVectTable, ADCINT) / sizeof(void *));
    PieCtrlRegs.PIEIER1.all = 0;
    PieCtrlRegs.PIEIER1.bit.INTx6 = 1;
    same("bit", "ADCINT", F28335_ADCINT_BIT, PieCtrlRegs.PIEIER1.all);
    same("address", "ADC_cal", F28335_ADC_CAL, base_ADC_CAL);
    printf("%u values compared with TI's headers, %u differ\n", compared, differences);
    return differences != 0;
}
