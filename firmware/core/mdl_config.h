/**
 * @file mdl_config.h
 * @brief Every compile-time knob of the core: default, unit, limit, and what a larger value costs.
 */
#ifndef MDL_CONFIG_H
#define MDL_CONFIG_H

/**
 * N_u, the number of different input values of the converter (Cao & Li 2019, section 2.2).
 * Unit: codes. Limit: 2^8 to 2^16, a power of two. Memory: 8 * N_u bytes in float.
 */
#ifndef MDL_N_U
#define MDL_N_U 4096
#endif

/** Up to this degree Horner is unrolled, with a part of the trajectory's step for each degree. */
#define MDL_DEGREE_UNROLLED 7

/**
 * Largest degree of the polynomial f0, eq. (9). Limit: 7 to 15. Memory: 8 bytes for each above 7,
 * and a slower step where f0 has one. In float more than 7 lose digits; fits in double use 15.
 */
#ifndef MDL_DEGREE_MAX
#define MDL_DEGREE_MAX MDL_DEGREE_UNROLLED
#endif

/** Most breakpoints of a piecewise-linear f0, eq. (16). Limit: 2 to 255. Memory: 12 bytes each. */
#ifndef MDL_BREAKPOINTS_MAX
#define MDL_BREAKPOINTS_MAX 64
#endif

/** Most modes of the creep ladder. Limit: 1 to 32. Memory: 20 bytes each. */
#ifndef MDL_CREEP_MODES_MAX
#define MDL_CREEP_MODES_MAX 12
#endif

/** Most flexure modes. Limit: 1 to 4. Memory: 36 bytes each. */
#ifndef MDL_MODES_MAX
#define MDL_MODES_MAX 2
#endif

/** Most play operators of the Prandtl-Ishlinskii model. Limit: 1 to 255. Memory: 12 bytes each. */
#ifndef MDL_PLAYS_MAX
#define MDL_PLAYS_MAX 32
#endif

/** Most harmonics of an excitation of the model of Yang et al. Limit: 1 to 255. Memory: 4 bytes
 * each. */
#ifndef MDL_HARMONICS_MAX
#define MDL_HARMONICS_MAX 9
#endif

/** Longest delay. Unit: substeps of a sample. Limit: 4 to 32767. Memory: 4 bytes each. */
#ifndef MDL_DELAY_MAX
#define MDL_DELAY_MAX 64
#endif

/** Most steps of a sample of Bouc and Wen's equation. Limit: 16 to 32767. Costs time alone. */
#ifndef MDL_BOUC_STEPS_MAX
#define MDL_BOUC_STEPS_MAX 2048
#endif

/**
 * A function that is compiled into its callers, and one that never is: what runs on every sample
 * stays together, and saves no registers for what seldom runs. Where the compiler has no such
 * attribute, its own choice costs time only.
 */
#ifdef __GNUC__
#define MDL_INLINE static inline __attribute__((always_inline))
#define MDL_APART static __attribute__((noinline))
#else
#define MDL_INLINE static inline
#define MDL_APART static
#endif

/** Fails to compile when the condition is false; C99 has no static assert. */
#define MDL_STATIC_ASSERT(condition, name) typedef char mdl_assert_##name[(condition) ? 1 : -1]

MDL_STATIC_ASSERT(MDL_N_U >= 256 && MDL_N_U <= 65536L, n_u_is_in_range);
MDL_STATIC_ASSERT((MDL_N_U & (MDL_N_U - 1L)) == 0, n_u_is_a_power_of_two);
MDL_STATIC_ASSERT(MDL_DEGREE_MAX >= MDL_DEGREE_UNROLLED && MDL_DEGREE_MAX <= 15, degree_in_range);
MDL_STATIC_ASSERT(MDL_BREAKPOINTS_MAX >= 2 && MDL_BREAKPOINTS_MAX <= 255, breakpoints_in_range);

MDL_STATIC_ASSERT(MDL_CREEP_MODES_MAX >= 1 && MDL_CREEP_MODES_MAX <= 32, creep_modes_in_range);
MDL_STATIC_ASSERT(MDL_MODES_MAX >= 1 && MDL_MODES_MAX <= 4, modes_in_range);
MDL_STATIC_ASSERT(MDL_PLAYS_MAX >= 1 && MDL_PLAYS_MAX <= 255, plays_in_range);
MDL_STATIC_ASSERT(MDL_HARMONICS_MAX >= 1 && MDL_HARMONICS_MAX <= 255, harmonics_in_range);
MDL_STATIC_ASSERT(MDL_BOUC_STEPS_MAX >= 16 && MDL_BOUC_STEPS_MAX <= 32767, bouc_steps_in_range);
MDL_STATIC_ASSERT(MDL_DELAY_MAX >= 4 && MDL_DELAY_MAX <= 32767, delay_in_range);

#endif
