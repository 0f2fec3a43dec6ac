/* SEQ1 converts ADCINA0 (drive voltage) and ADCINA1 (displacement sensor), one after the other. */
#include "f28335.h"
#include "mdl_adc.h"

static mdl_hal_status wait_for_conversion(void)
{
    uint16_t polls;
    for (polls = F28335_ADC_POLLS; polls > 0; polls--) {
        if ((MDL_READ(ADCST) & MDL_MASK(ADCST, INT_SEQ1)) != 0) {
            return MDL_HAL_OK;
        }
    }
    return MDL_HAL_ERR_TIMEOUT;
}

static void rewind_sequencer(void)
{
    MDL_WRITE(ADCTRL2, MDL_MASK(ADCTRL2, RST_SEQ1));
    MDL_WRITE(ADCST, MDL_MASK(ADCST, INT_SEQ1_CLR));
}

mdl_hal_status mdl_adc_init(void)
{
    mdl_hal_status status;
    /* The boot ROM calibrates; a debugger that starts the program at its entry bypasses it. */
    MDL_EALLOW();
    MDL_CALIBRATE_ADC();
    MDL_EDIS();
    MDL_WRITE(ADCTRL3, MDL_MASK(ADCTRL3, ADCBGRFDN) | MDL_MASK(ADCTRL3, ADCPWDN));
    f28335_wait_us(5000);
    MDL_WRITE(ADCTRL1, MDL_PUT(ADCTRL1, ACQ_PS, F28335_ADC_WINDOW));
    MDL_WRITE(ADCMAXCONV, MDL_PUT(ADCMAXCONV, MAX_CONV1, 1)); /* conversions minus 1 */
    MDL_WRITE(ADCCHSELSEQ1, MDL_PUT(ADCCHSELSEQ1, CONV00, 0) | MDL_PUT(ADCCHSELSEQ1, CONV01, 1));
    rewind_sequencer();
    MDL_WRITE(ADCTRL2, MDL_MASK(ADCTRL2, SOC_SEQ1)); /* self-test: one conversion by software */
    status = wait_for_conversion();
    rewind_sequencer();
    return status == MDL_HAL_OK ? MDL_HAL_OK : MDL_HAL_ERR_SELF_TEST;
}

mdl_hal_status mdl_adc_read(uint16_t *drive_code, uint16_t *sensor_code)
{
    mdl_hal_status status = wait_for_conversion();
    if (status == MDL_HAL_OK) {
        /* The mirror holds the codes right-justified. */
        *drive_code = MDL_READ(ADCMIRROR0);
        *sensor_code = MDL_READ(ADCMIRROR1);
    }
    return status;
}
