/**
 * @file mdl_app.h
 * @brief The interrupt loop: ADC code -> volts -> predictor -> DAC code, with counters.
 */
#ifndef MDL_APP_H
#define MDL_APP_H

#include "mdl_app_config.h"
#include "mdl_chain.h"
#include "mdl_hal.h"

/** Constant parameters: the predictor, both converters, the rate. `madelung export` writes them. */
typedef struct {
    mdl_chain_params chain;
    uint32_t rate_hz;        /**< sample rate, Hz; the chain is discretised for it */
    mdl_real u_zero_volts;   /**< drive voltage at ADC code 0 */
    mdl_real volts_per_code; /**< (u at code 4095 - u at code 0) / 4095, > 0 */
    mdl_real y_zero_um;      /**< displacement that DAC code 0 stands for */
    mdl_real codes_per_um;   /**< 4095 / (y at code 4095 - y at code 0), > 0 */
} mdl_app_params;

/** The last MDL_RECORD_LENGTH samples, a ring, for the debugger. */
typedef struct {
    uint16_t drive_code[MDL_RECORD_LENGTH];
    uint16_t sensor_code[MDL_RECORD_LENGTH]; /**< recorded, never fed back */
    uint16_t dac_code[MDL_RECORD_LENGTH];
    uint16_t next; /**< where the next sample goes: the oldest one, once the ring is full */
} mdl_app_record;

/** How often something happened since mdl_app_init. They wrap at 2^32. */
typedef struct {
    uint32_t cycles;       /**< interrupts served */
    uint32_t overruns;     /**< the next sample instant passed before the cycle was done */
    uint32_t extrapolated; /**< drive voltage outside the identified range */
    uint32_t clamped;      /**< drive voltage beyond the extrapolation margin */
    uint32_t memory_full;  /**< a turning point was not recorded */
    uint32_t refused;      /**< the predictor returned an error; the last displacement was kept */
    uint32_t dac_clamped;  /**< displacement outside the range of the DAC */
    uint32_t adc_faults;   /**< no conversion: the cycle did nothing else */
    uint32_t dac_faults;   /**< a code was not sent: the output kept its old one */
} mdl_app_counters;

/** State of the application. All fields may be read at any time, by a debugger for instance. */
typedef struct {
    const mdl_app_params *params;
    mdl_app_record *record;
    mdl_chain chain;
    mdl_app_counters counters;
    mdl_status status; /**< of the last step of the predictor */
    mdl_real y_um;     /**< last prediction, um */
} mdl_app;

/**
 * Ties the application to its parameters and memory: at rest at u_min, counters and record empty.
 * Relies on nothing that start-up code does: TI's COFF start-up does not clear memory.
 * @return MDL_OK; MDL_ERR_PARAMETER (also for a scale that is not positive); MDL_ERR_NOT_FINITE
 */
mdl_status mdl_app_init(mdl_app *app, const mdl_app_params *params, mdl_tp_side *left,
                        mdl_tp_side *right, mdl_app_record *record);

/** Drive voltage of an ADC code (0 to MDL_CODE_MAX), volts. */
mdl_real mdl_app_volts(const mdl_app_params *params, uint16_t code);

/**
 * DAC code, rounded to nearest, of a displacement in um, clamped to 0 .. MDL_CODE_MAX.
 * @param clamped  set to 1 when it was clamped by more than half a code, else to 0
 */
uint16_t mdl_app_dac_code(const mdl_app_params *params, mdl_real y_um, uint16_t *clamped);

/**
 * One sample, from mdl_on_sample: pin up, ADC, predictor, DAC, record, pin down, acknowledge.
 * Without a conversion the predictor is not stepped and the DAC keeps its code.
 */
void mdl_app_isr(mdl_app *app);

#endif
