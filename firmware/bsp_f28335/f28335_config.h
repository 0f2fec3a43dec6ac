/**
 * @file f28335_config.h
 * @brief Knobs of the F28335 board: default, unit, limit. Override with -D.
 */
#ifndef F28335_CONFIG_H
#define F28335_CONFIG_H

#include "mdl_config.h"

/** Crystal, Hz. The flash wait states and the ADC's divider are those of 150 MHz. */
#define F28335_CRYSTAL_HZ 30000000uL
/** PLL multiplier; the divider behind it is 2. */
#define F28335_PLL_MULTIPLIER 10u
/** Processor clock, Hz. */
#define F28335_SYSCLK_HZ (F28335_CRYSTAL_HZ * F28335_PLL_MULTIPLIER / 2u)

/** Sample rate, Hz: at 1 in 2^7 the 16-bit timer reaches down to 18 Hz; both conversions and the
 *  computation must fit into a period. */
#define F28335_RATE_HZ_MIN 18uL
#define F28335_RATE_HZ_MAX 200000uL

/** Length of the ADC's sampling window minus 1, ADC clocks of 40 ns. Limit: 0 to 15. A source
 *  with a higher resistance needs a longer window. */
#ifndef F28335_ADC_WINDOW
#define F28335_ADC_WINDOW 3u
#endif

/* Bounded waits, in polls of a few processor clocks each. Limit: 1 to 65535, the PLL's 2^32. */
#define F28335_PLL_POLLS 200000uL /**< the PLL locks within 131072 crystal clocks (manual) */
#ifndef F28335_ADC_POLLS
#define F28335_ADC_POLLS 500u /**< two conversions take about 100 clocks (manual) */
#endif
#ifndef F28335_DAC_POLLS
#define F28335_DAC_POLLS 1000u /**< one word on the SPI takes 16 / 9.375 MHz = 256 clocks */
#endif
#ifndef F28335_STALL_POLLS
#define F28335_STALL_POLLS 1000u /**< a trigger older than this got no conversion */
#endif

/*
 * The DAC stands on the AD/DA board, by SPI-A: one 16-bit word per code, COMMAND | code << SHIFT.
 * The defaults are the word and the clock mode of a Microchip MCP4921 (manual).
 */
#ifndef F28335_DAC_COMMAND
#define F28335_DAC_COMMAND 0x3000u
#endif
#ifndef F28335_DAC_SHIFT
#define F28335_DAC_SHIFT 0
#endif
/** 1: the clock idles high. */
#ifndef F28335_SPI_POLARITY
#define F28335_SPI_POLARITY 0u
#endif
/** 1: data change half a clock before the first edge. */
#ifndef F28335_SPI_PHASE
#define F28335_SPI_PHASE 1u
#endif
/** Bit rate: 37.5 MHz / (divider + 1). Limit: 3 to 127. */
#ifndef F28335_SPI_DIVIDER
#define F28335_SPI_DIVIDER 3u
#endif

/*
 * -DF28335_DAC_XINTF: the DAC is a 16-bit word on the external bus instead; takes GPIO28-31,
 * 34-47 and 64-87 away. Its zone is 0, 6 or 7, its address may lie anywhere in that zone.
 */
#ifndef F28335_XINTF_ZONE
#define F28335_XINTF_ZONE 0
#endif
#ifndef F28335_XINTF_ADDRESS
#define F28335_XINTF_ADDRESS                                                                       \
    (F28335_XINTF_ZONE == 0 ? 0x4000L : F28335_XINTF_ZONE == 6 ? 0x100000L : 0x200000L)
#endif

MDL_STATIC_ASSERT(F28335_SYSCLK_HZ == 150000000uL, wait_states_are_those_of_150_mhz);
MDL_STATIC_ASSERT(F28335_ADC_WINDOW <= 15u, adc_window_in_range);
MDL_STATIC_ASSERT(F28335_SPI_DIVIDER >= 3u && F28335_SPI_DIVIDER <= 127u, spi_divider_in_range);
MDL_STATIC_ASSERT(F28335_DAC_SHIFT >= 0 && F28335_DAC_SHIFT <= 4, dac_shift_in_range);
MDL_STATIC_ASSERT((F28335_DAC_COMMAND & (0xFFFu << F28335_DAC_SHIFT)) == 0, dac_word_has_room);
MDL_STATIC_ASSERT(F28335_XINTF_ZONE == 0 || F28335_XINTF_ZONE == 6 || F28335_XINTF_ZONE == 7,
                  xintf_zone_exists);

#endif
