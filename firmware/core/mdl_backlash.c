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

static uint16_t parts(mdl_real spread)
{
    return spread > MDL_C(0.0) ? (uint16_t)MDL_BACKLASH_PARTS : 1u;
}

/* Width of a part: the middle of its share of what the widths span. */
static mdl_real width(mdl_real dead_band_um, mdl_real spread, uint16_t i)
{
    mdl_real off = (mdl_real)(2u * i + 1u) / (mdl_real)MDL_BACKLASH_PARTS - MDL_C(1.0);
    return spread > MDL_C(0.0) ? dead_band_um * (MDL_C(1.0) + spread * off) : dead_band_um;
}

static mdl_real mean(const mdl_contact *contact, uint16_t n)
{
    mdl_real sum = MDL_C(0.0);
    uint16_t i;
    for (i = 0; i < n; i++) {
        sum += contact->target_um[i];
    }
    return sum / (mdl_real)n;
}

mdl_real mdl_contact_start(mdl_contact *contact, mdl_real dead_band_um, mdl_real spread,
                           mdl_real y_um)
{
    uint16_t n = parts(spread);
    uint16_t i;
    for (i = 0; i < n; i++) {
        contact->target_um[i] = mdl_backlash_start(width(dead_band_um, spread, i), y_um);
    }
    return mean(contact, n);
}

mdl_real mdl_contact_step(mdl_contact *contact, mdl_real dead_band_um, mdl_real spread,
                          mdl_real y_um)
{
    uint16_t n = parts(spread);
    uint16_t i;
    for (i = 0; i < n; i++) {
        mdl_real *at = &contact->target_um[i];
        *at = mdl_backlash_step(width(dead_band_um, spread, i), *at, y_um);
    }
    return mean(contact, n);
}
