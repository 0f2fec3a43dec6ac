#include "mdl_backlash.h"

mdl_real mdl_backlash_start(mdl_real dead_band_um, mdl_real y_um)
{
    return y_um - MDL_C(0.5) * dead_band_um;
}

mdl_real mdl_backlash_step(mdl_real dead_band_um, mdl_real last_um, mdl_real y_um)
{
    mdl_real low = y_um - MDL_C(0.5) * dead_band_um;
    mdl_real high = y_um + MDL_C(0.5) * dead_band_um;
    if (last_um < low) {
        return low;
    }
    return last_um > high ? high : last_um;
}
