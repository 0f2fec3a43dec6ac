#include "cao2019.h"

/* Eq. (9), Horner. */
static mdl_real f0(const cao2019 *s, mdl_real x)
{
    mdl_real y = s->c[s->n];
    uint16_t i;
    for (i = s->n; i > 0; i--) {
        y = y * x + s->c[i - 1];
    }
    return y;
}

void cao2019_init(cao2019 *s, const mdl_real *c, uint16_t n, cao2019_points *ltp,
                  cao2019_points *rtp)
{
    s->c = c;
    s->n = n;
    s->ltp = ltp;
    s->rtp = rtp;
    s->f0_xA0 = f0(s, MDL_C(0.0));
    s->ltp->X[0] = MDL_C(0.0);
    s->ltp->Y[0] = s->f0_xA0;
    s->index = 1;
    s->tp_flag = 0;
    s->x1 = MDL_C(0.0);
    s->y1 = s->f0_xA0;
    s->x2 = MDL_C(0.0);
}

/* S2 to S4: records the previous point if it is a turning point, inequality (10). */
static void identify(cao2019 *s, mdl_real x)
{
    if ((x - s->x1) * (s->x1 - s->x2) < MDL_C(0.0)) {
        if (x - s->x1 > MDL_C(0.0)) {
            s->ltp->X[s->index] = s->x1;
            s->ltp->Y[s->index] = s->y1;
            s->index++;
            s->tp_flag = 0;
        } else {
            s->rtp->X[s->index - 1] = s->x1;
            s->rtp->Y[s->index - 1] = s->y1;
            s->tp_flag = 1;
        }
    }
}

/* S5 to S7: the last turning point of the other side that x has not surpassed, eqs. (12), (13). */
static void search(cao2019 *s, mdl_real x)
{
    uint16_t left = 0;
    uint16_t right, mid;
    if (s->tp_flag == 0) {
        right = (uint16_t)(s->index - 1u);
        while (left < right) {
            mid = (uint16_t)((left + right) / 2u);
            if (x < s->rtp->X[mid]) {
                left = (uint16_t)(mid + 1u);
            } else {
                right = mid;
            }
        }
        s->index = (uint16_t)(right + 1u);
    } else {
        right = s->index;
        while (left < right) {
            mid = (uint16_t)((left + right) / 2u);
            if (x > s->ltp->X[mid]) {
                left = (uint16_t)(mid + 1u);
            } else {
                right = mid;
            }
        }
        s->index = right;
    }
}

/* S8, S9: eq. (6). */
static mdl_real output(const cao2019 *s, mdl_real x)
{
    if (s->tp_flag == 0) {
        return s->ltp->Y[s->index - 1] - s->f0_xA0 + f0(s, x - s->ltp->X[s->index - 1]);
    }
    if (s->index == 0) {
        return s->f0_xA0;
    }
    return s->rtp->Y[s->index - 1] + s->f0_xA0 - f0(s, s->rtp->X[s->index - 1] - x);
}

uint16_t cao2019_step(cao2019 *s, mdl_real x, mdl_real *y)
{
    identify(s, x);
    search(s, x);
    *y = output(s, x);
    if (x != s->x1) { /* S10: equal inputs say nothing about the direction */
        s->x2 = s->x1;
        s->x1 = x;
        s->y1 = *y;
    }
    return 0;
}

uint16_t cao2019_turning_points(const cao2019 *s)
{
    return (uint16_t)(2u * s->index - (s->tp_flag == 0 ? 1u : 0u));
}
