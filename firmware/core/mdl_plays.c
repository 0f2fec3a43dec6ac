#include "mdl_plays.h"

#include "mdl_power.h"

#include <string.h>

void mdl_plays_make(mdl_plays_params *params, const mdl_major *major)
{
    mdl_real step = major->range_volts / (mdl_real)(MDL_PLAYS_MAX + 1);
    mdl_real left = major->at_zero_um;
    mdl_real middle = mdl_major_eval(major, step);
    uint16_t i;
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        mdl_real x = step * (mdl_real)(i + 1u);
        mdl_real right = mdl_major_eval(major, x + step);
        params->half_volts[i] = MDL_C(0.5) * x;
        params->weight[i] = ((right - middle) - (middle - left)) / step;
        left = middle;
        middle = right;
    }
}

void mdl_plays_reset(mdl_plays *plays, const mdl_plays_params *params)
{
    memcpy(plays->still_volts, params->half_volts, sizeof plays->still_volts);
    memcpy(plays->grown_volts, params->half_volts, sizeof plays->grown_volts);
}

MDL_INLINE mdl_real play(mdl_real at, mdl_real x, mdl_real half)
{
    mdl_real low = x - half;
    mdl_real high = x + half;
    at = at > low ? at : low;
    return at < high ? at : high;
}

/* Four sums side by side: a PC computes several at once. */
static mdl_real sum_of(const mdl_real *held)
{
    mdl_real sum[4] = {MDL_C(0.0), MDL_C(0.0), MDL_C(0.0), MDL_C(0.0)};
    uint16_t i;
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        sum[i % 4u] += held[i];
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

mdl_real mdl_plays_step(mdl_plays *plays, const mdl_plays_params *params, mdl_real x_volts,
                        mdl_real grow)
{
    mdl_real held[MDL_PLAYS_MAX];
    mdl_real scale = MDL_C(1.0) + grow;
    uint16_t i;
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        mdl_real half = params->half_volts[i];
        mdl_real still = play(plays->still_volts[i], x_volts, half);
        mdl_real grown = play(plays->grown_volts[i], x_volts, half * scale);
        plays->still_volts[i] = still;
        plays->grown_volts[i] = grown;
        held[i] = params->weight[i] * (still - grown);
    }
    return sum_of(held);
}

/* The part of a sample by which viscous operators follow the input earlier. */
static mdl_real early(const mdl_relax_params *relax, mdl_real rise_volts)
{
    mdl_real d = mdl_size(rise_volts);
    mdl_real o2, o;
    if (!(relax->pull > MDL_C(0.0)) || d == MDL_C(0.0)) {
        return relax->early;
    }
    o2 = d / relax->pull; /* of a steady input: k o^2 = d / h */
    o = mdl_power(o2, MDL_C(0.5)) + mdl_power(o2 + MDL_C(0.25) * d * d, MDL_C(0.5));
    return o > MDL_C(0.0) ? MDL_C(0.5) - MDL_C(0.25) * d / o : MDL_C(0.5); /* roots end at 0 */
}

mdl_real mdl_plays_relax(mdl_plays *plays, const mdl_plays_params *params, mdl_real x_volts,
                         mdl_real rise_volts, const mdl_relax_params *relax)
{
    mdl_real at = x_volts - early(relax, rise_volts) * rise_volts;
    mdl_real held[MDL_PLAYS_MAX];
    uint16_t i;
    for (i = 0; i < MDL_PLAYS_MAX; i++) {
        mdl_real half = params->half_volts[i];
        mdl_real still = play(plays->still_volts[i], x_volts, half);
        mdl_real wanted = play(plays->grown_volts[i], at, half);
        mdl_real over = plays->grown_volts[i] - wanted;
        mdl_real size = mdl_size(over);
        mdl_real grown = wanted + over * relax->decay / (MDL_C(1.0) + relax->pull * size);
        plays->still_volts[i] = still;
        plays->grown_volts[i] = grown;
        held[i] = params->weight[i] * (still - grown);
    }
    return sum_of(held);
}
