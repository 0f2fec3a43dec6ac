#include "mdl_app.h"
#include "mdl_adc.h"
#include "mdl_clock.h"
#include "mdl_dac.h"
#include "mdl_pin.h"

static mdl_status check_scales(const mdl_app_params *p)
{
    if (!mdl_is_finite(p->u_zero_volts) || !mdl_is_finite(p->volts_per_code) ||
        !mdl_is_finite(p->y_zero_um) || !mdl_is_finite(p->codes_per_um)) {
        return MDL_ERR_NOT_FINITE;
    }
    if (!(p->volts_per_code > MDL_C(0.0)) || !(p->codes_per_um > MDL_C(0.0)) || p->rate_hz == 0) {
        return MDL_ERR_PARAMETER;
    }
    return MDL_OK;
}

static void clear_record(mdl_app_record *record)
{
    uint16_t i;
    for (i = 0; i < MDL_RECORD_LENGTH; i++) {
        record->drive_code[i] = 0;
        record->sensor_code[i] = 0;
        record->dac_code[i] = 0;
    }
    record->next = 0;
}

mdl_status mdl_app_init(mdl_app *app, const mdl_app_params *params, mdl_tp_side *left,
                        mdl_tp_side *right, mdl_app_record *record)
{
    const mdl_app_counters none = {0, 0, 0, 0, 0, 0, 0, 0, 0};
    app->params = params;
    app->record = record;
    app->counters = none;
    app->y_um = MDL_C(0.0);
    clear_record(record);
    app->status = check_scales(params);
    if (app->status == MDL_OK) {
        app->status = mdl_chain_init(&app->chain, &params->chain, left, right);
    }
    return app->status;
}

mdl_real mdl_app_volts(const mdl_app_params *params, uint16_t code)
{
    return params->u_zero_volts + (mdl_real)code * params->volts_per_code;
}

uint16_t mdl_app_dac_code(const mdl_app_params *params, mdl_real y_um, uint16_t *clamped)
{
    mdl_real code = (y_um - params->y_zero_um) * params->codes_per_um + MDL_C(0.5);
    /* Compared before the conversion: a value that does not fit in 16 bits converts to anything. */
    *clamped = 1;
    if (!(code >= MDL_C(0.0))) {
        return 0;
    }
    if (code >= (mdl_real)(MDL_CODE_MAX + 1u)) {
        return MDL_CODE_MAX;
    }
    *clamped = 0;
    return (uint16_t)code;
}

static void count_status(mdl_app_counters *counters, mdl_status status)
{
    if (status == MDL_OK) {
        return;
    }
    if (status < 0) {
        counters->refused++;
        return;
    }
    counters->extrapolated += ((uint16_t)status & MDL_EXTRAPOLATED) != 0 ? 1u : 0u;
    counters->clamped += ((uint16_t)status & MDL_CLAMPED) != 0 ? 1u : 0u;
    counters->memory_full += ((uint16_t)status & MDL_MEMORY_FULL) != 0 ? 1u : 0u;
}

static void remember(mdl_app_record *record, uint16_t drive, uint16_t sensor, uint16_t dac)
{
    uint16_t i = record->next;
    record->drive_code[i] = drive;
    record->sensor_code[i] = sensor;
    record->dac_code[i] = dac;
    record->next = i + 1u < MDL_RECORD_LENGTH ? (uint16_t)(i + 1u) : 0;
}

static void serve_sample(mdl_app *app)
{
    uint16_t drive;
    uint16_t sensor;
    uint16_t dac;
    uint16_t clamped;
    if (mdl_adc_read(&drive, &sensor) != MDL_HAL_OK) {
        app->counters.adc_faults++;
        return;
    }
    app->status = mdl_chain_step(&app->chain, mdl_app_volts(app->params, drive), &app->y_um);
    dac = mdl_app_dac_code(app->params, app->y_um, &clamped);
    if (mdl_dac_write(dac) != MDL_HAL_OK) {
        app->counters.dac_faults++;
    }
    app->counters.dac_clamped += clamped;
    count_status(&app->counters, app->status);
    remember(app->record, drive, sensor, dac);
}

void mdl_app_isr(mdl_app *app)
{
    mdl_pin_up();
    serve_sample(app);
    mdl_pin_down();
    app->counters.cycles++;
    if (mdl_clock_acknowledge() == MDL_HAL_OVERRUN) {
        app->counters.overruns++;
    }
}
