/**
 * @file mdl_real.h
 * @brief The number type of the core, and the comparison of reals through their bit patterns.
 *
 * The firmware computes in float. The PC builds the same sources a second time with
 * MDL_REAL_DOUBLE for fits and references. Literals are written MDL_C(1.0).
 */
#ifndef MDL_REAL_H
#define MDL_REAL_H

#include <stdint.h>

#ifdef MDL_REAL_DOUBLE
typedef double mdl_real;
typedef int64_t mdl_key;
typedef uint64_t mdl_ukey;
#define MDL_C(x) (x)
#define MDL_KEY_MAX INT64_C(0x7FFFFFFFFFFFFFFF)
#define MDL_EXPONENT_BITS INT64_C(0x7FF0000000000000)
#define MDL_MANTISSA_LENGTH 52
#define MDL_EXPONENT_BIAS 1023
#else
typedef float mdl_real;
typedef int32_t mdl_key;
typedef uint32_t mdl_ukey;
#define MDL_C(x) (x##f)
#define MDL_KEY_MAX INT32_C(0x7FFFFFFF)
#define MDL_EXPONENT_BITS INT32_C(0x7F800000)
#define MDL_MANTISSA_LENGTH 23
#define MDL_EXPONENT_BIAS 127
#endif

/** A real and its bits. Reading the other member is defined in C99 (6.5.2.3, note 82). */
typedef union {
    mdl_real real;
    mdl_key bits;
} mdl_real_bits;

/** |v|. */
static inline mdl_real mdl_size(mdl_real v)
{
    return v < MDL_C(0.0) ? -v : v;
}

/** v, no lower than low and no higher than high. */
static inline mdl_real mdl_limited(mdl_real v, mdl_real low, mdl_real high)
{
    return v < low ? low : (v > high ? high : v);
}

/** The bits of v as a signed integer. */
static inline mdl_key mdl_bits(mdl_real v)
{
    mdl_real_bits b;
    b.real = v;
    return b.bits;
}

/**
 * An integer that sorts as the reals do. For v >= +0 it is the bit pattern itself; for negative
 * v the magnitude bits are inverted. The caller makes -0 a +0 first (v + 0). Range: all finite v.
 */
static inline mdl_key mdl_key_of(mdl_real v)
{
    mdl_key bits = mdl_bits(v);
    return bits >= 0 ? bits : bits ^ MDL_KEY_MAX;
}

/** Inverse of mdl_key_of. */
static inline mdl_real mdl_real_of(mdl_key key)
{
    mdl_real_bits b;
    b.bits = key >= 0 ? key : key ^ MDL_KEY_MAX;
    return b.real;
}

/**
 * 1 when v is neither NaN nor infinite, tested by its exponent bits: FPU32 takes NaN for infinity,
 * and compilers may fold x != x.
 */
static inline int mdl_is_finite(mdl_real v)
{
    return (mdl_bits(v) & MDL_EXPONENT_BITS) != MDL_EXPONENT_BITS;
}

/** 1 when all of count reals are finite. */
static inline int mdl_all_finite(const mdl_real *v, uint16_t count)
{
    uint16_t i;
    for (i = 0; i < count; i++) {
        if (!mdl_is_finite(v[i])) {
            return 0;
        }
    }
    return 1;
}

#endif
