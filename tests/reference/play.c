#include "play.h"

static const mdl_real weight[PLAY_OPERATORS] = {
    MDL_C(0.0789), MDL_C(0.2268), MDL_C(0.1928), MDL_C(0.2019), MDL_C(0.1995),
    MDL_C(0.2001), MDL_C(0.2000), MDL_C(0.2000), MDL_C(0.1999), MDL_C(0.2005)};
static const mdl_real threshold[PLAY_OPERATORS] = {MDL_C(0.0), MDL_C(0.1), MDL_C(0.2), MDL_C(0.3),
                                                   MDL_C(0.4), MDL_C(0.5), MDL_C(0.6), MDL_C(0.7),
                                                   MDL_C(0.8), MDL_C(0.9)};

uint16_t play_step(play *s, mdl_real x, mdl_real *y)
{
    mdl_real sum = MDL_C(0.0);
    uint16_t i;
    for (i = 0; i < PLAY_OPERATORS; i++) {
        mdl_real h = s->h[i];
        h = x < h ? x : h;
        h = x - threshold[i] > h ? x - threshold[i] : h;
        s->h[i] = h;
        sum += weight[i] * h;
    }
    *y = sum;
    return 0;
}
