#include "mdl_drive.h"

#include "mdl_power.h"

/* How far the drive follows beyond where its knee begins; excess >= 0, in volts. */
static mdl_real followed(const mdl_saturation_params *params, mdl_real excess)
{
    mdl_real e = excess / params->knee_volts;
    mdl_real p = params->knee_power;
    mdl_real bits;
    if (params->parabolic) {
        return e < MDL_C(2.0) ? excess * (MDL_C(1.0) - MDL_C(0.25) * e) : params->knee_volts;
    }
    bits = e > MDL_C(1.0) ? p * mdl_log2(e) : MDL_C(0.0);
    if (bits > MDL_C(30.0)) {
        return params->knee_volts; /* the limit, to all digits; further e^p would overflow */
    }
    return excess * mdl_exp2(-mdl_log2(MDL_C(1.0) + mdl_power(e, p)) / p);
}

static mdl_real rounded(const mdl_saturation_params *params, mdl_real u)
{
    mdl_real top = params->high_volts - params->knee_volts;
    mdl_real bottom = params->low_volts + params->knee_volts;
    if (u > top) {
        return top + followed(params, u - top);
    }
    return u < bottom ? bottom - followed(params, bottom - u) : u;
}

mdl_real mdl_saturation(const mdl_saturation_params *params, mdl_real u_volts)
{
    mdl_real knee = params->knee_volts;
    mdl_real per_knee;
    if (!(knee > MDL_C(0.0))) {
        return mdl_limited(u_volts, params->low_volts, params->high_volts);
    }
    if (params->knee_power > MDL_C(0.0) || params->parabolic) {
        return rounded(params, u_volts);
    }
    /* 20 knees away the result is the limit itself; without this a huge command would overflow. */
    u_volts = mdl_limited(u_volts, params->low_volts - MDL_C(20.0) * knee,
                          params->high_volts + MDL_C(20.0) * knee);
    per_knee = MDL_C(1.0) / knee;
    return u_volts + knee * (mdl_softplus((params->low_volts - u_volts) * per_knee) -
                             mdl_softplus((u_volts - params->high_volts) * per_knee));
}

#define LOG2_E MDL_C(1.44269504088896341)
#define SMALL MDL_C(0.25)
#define LARGE MDL_C(20.0)

/*
 * What is left of a lag of e knees, >= 0, while the command rests: asinh(decay * sinh(e)). A series
 * where it is small, for the digits; a straight line where the rate is the limit's.
 */
static mdl_real settled(const mdl_slew_params *params, mdl_real e)
{
    mdl_real a = params->decay;
    mdl_real gone = params->rise_volts / params->knee_volts;
    mdl_real y;
    if (e < SMALL) {
        return a * e * (MDL_C(1.0) + (MDL_C(1.0) - a * a) * e * e / MDL_C(6.0));
    }
    if (e - gone > LARGE) {
        return e - gone;
    }
    y = MDL_C(0.5) * (mdl_exp2((e - gone) * LOG2_E) - mdl_exp2((-e - gone) * LOG2_E));
    return MDL_LN_2 * mdl_log2(y + mdl_power(y * y + MDL_C(1.0), MDL_C(0.5)));
}

mdl_real mdl_slew(const mdl_slew_params *params, mdl_real last_volts, mdl_real u_volts,
                  mdl_real rise_volts)
{
    mdl_real lag, left;
    if (!(params->knee_volts > MDL_C(0.0))) {
        return last_volts +
               mdl_limited(u_volts - last_volts, -params->fall_volts, params->rise_volts);
    }
    /* What the command rises by late does not settle in this step. */
    lag = u_volts - last_volts - (MDL_C(1.0) - params->early) * rise_volts;
    left = params->knee_volts * settled(params, mdl_size(lag) / params->knee_volts);
    return last_volts + (lag < MDL_C(0.0) ? lag + left : lag - left);
}
