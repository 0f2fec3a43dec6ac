/**
 * @file f28335_io.h
 * @brief Access to the registers by name: MDL_READ(ADCST), MDL_WRITE(TBPRD, 14999).
 *
 * On the DSP an access is one volatile load or store. With MDL_FAKE_REGISTERS it is a call of the
 * fake register file (host_sim/board), which logs it; so the same sources run in the unit tests.
 */
#ifndef F28335_IO_H
#define F28335_IO_H

#include <stdint.h>

#include "f28335_regs.h"

#define F28335_TYPE(name, address, width, access, structure, member)                               \
    typedef uint##width##_t f28335_type_##name;
#define F28335_ADDRESS(name, address, width, access, structure, member) f28335_at_##name = address,
#define F28335_ARRAY_TYPE(name, address, width, stride, items, access, structure, first, last)     \
    typedef uint##width##_t f28335_type_##name;
#define F28335_ARRAY_ADDRESS(name, address, width, stride, items, access, structure, first, last)  \
    f28335_at_##name = address, f28335_stride_##name = stride, f28335_items_##name = items,
#define F28335_PLACE(name, field, lsb, bits, structure, member)                                    \
    f28335_lsb_##name##_##field = lsb, f28335_bits_##name##_##field = bits,

F28335_REGISTERS(F28335_TYPE)
F28335_ARRAYS(F28335_ARRAY_TYPE)
enum { F28335_REGISTERS(F28335_ADDRESS) F28335_ARRAYS(F28335_ARRAY_ADDRESS) f28335_end_of_map };
enum { F28335_FIELDS(F28335_PLACE) f28335_end_of_fields };

/** value, in the place of the field. */
#define MDL_PUT(name, field, value)                                                                \
    ((f28335_type_##name)((f28335_type_##name)(value) << f28335_lsb_##name##_##field))

/** Ones in the place of the field. */
#define MDL_MASK(name, field)                                                                      \
    MDL_PUT(name, field, (f28335_type_##name)(1ul << f28335_bits_##name##_##field) - 1u)

#ifdef MDL_FAKE_REGISTERS

#include "fake_f28335.h"

#define MDL_READ(name)                                                                             \
    ((f28335_type_##name)fake_read(f28335_at_##name, 8u * sizeof(f28335_type_##name)))
#define MDL_WRITE(name, value)                                                                     \
    fake_write(f28335_at_##name, 8u * sizeof(f28335_type_##name), (f28335_type_##name)(value))
#define MDL_WRITE_ITEM(name, i, value)                                                             \
    fake_write((uint32_t)(f28335_at_##name + f28335_stride_##name * (i)),                          \
               8u * sizeof(f28335_type_##name), (f28335_type_##name)(value))
#define MDL_SET_VECTOR(i, function) fake_set_vector(i, function)
#define MDL_WRITE_BUS(address, value) fake_write_bus(address, value)
#define MDL_WRITE_IER(value) fake_write_ier(value)
#define MDL_WRITE_IFR(value) fake_write_ifr(value)
#define MDL_EALLOW() fake_eallow(1)
#define MDL_EDIS() fake_eallow(0)
#define MDL_DISABLE_INTERRUPTS() fake_interrupts(0)
#define MDL_ENABLE_INTERRUPTS() fake_interrupts(1)
#define MDL_NOP() fake_nop()
#define MDL_FLUSH_PIPELINE() fake_nop()
#define MDL_CALIBRATE_ADC() fake_calibrate_adc()
#define MDL_COPY_RAM_FUNCTIONS() fake_copy_ram_functions()
#define MDL_FOR_EVER() fake_keeps_running()
#define MDL_INTERRUPT

#else

extern __cregister volatile unsigned int IER;
extern __cregister volatile unsigned int IFR;
extern uint16_t mdl_ram_load[];
extern uint16_t mdl_ram_run[];
extern uint16_t mdl_ram_size[]; /* its address is the number of words */
void f28335_copy(uint16_t *to, const uint16_t *from, uint32_t words);

#define MDL_READ(name) (*(volatile f28335_type_##name *)f28335_at_##name)
#define MDL_WRITE(name, value)                                                                     \
    (*(volatile f28335_type_##name *)f28335_at_##name = (f28335_type_##name)(value))
#define MDL_WRITE_ITEM(name, i, value)                                                             \
    (*(volatile f28335_type_##name *)(f28335_at_##name + f28335_stride_##name * (i)) =             \
         (f28335_type_##name)(value))
#define MDL_SET_VECTOR(i, function) MDL_WRITE_ITEM(PIEVECT, i, (uint32_t)(function))
#define MDL_WRITE_BUS(address, value) (*(volatile uint16_t *)(address) = (value))
#define MDL_WRITE_IER(value) (IER = (value))
#define MDL_WRITE_IFR(value) (IFR = (value))
#define MDL_EALLOW() __asm(" EALLOW")
#define MDL_EDIS() __asm(" EDIS")
#define MDL_DISABLE_INTERRUPTS() __asm(" SETC INTM")
#define MDL_ENABLE_INTERRUPTS() __asm(" CLRC INTM")
#define MDL_NOP() __asm(" NOP")
#define MDL_FLUSH_PIPELINE() __asm(" RPT #7 || NOP")
#define MDL_CALIBRATE_ADC() ((void (*)(void))F28335_ADC_CAL)()
#define MDL_COPY_RAM_FUNCTIONS() f28335_copy(mdl_ram_run, mdl_ram_load, (uint32_t)mdl_ram_size)
#define MDL_FOR_EVER() 1
#define MDL_INTERRUPT __interrupt

#endif

#endif
