#include "mdl_power.h"

mdl_real mdl_exp2(mdl_real x)
{
    mdl_real_bits scale;
    mdl_real f, y;
    int n;
    x = x < MDL_C(-120.0) ? MDL_C(-120.0) : x;
    x = x > MDL_C(120.0) ? MDL_C(120.0) : x;
    n = (int)(x < MDL_C(0.0) ? x - MDL_C(0.5) : x + MDL_C(0.5));
    /* Taylor's series of e^f; |f| <= ln(2) / 2, the first omitted term is 5e-9. */
    f = (x - (mdl_real)n) * MDL_C(0.69314718055994531);
    y = MDL_C(1.0) / MDL_C(5040.0);
    y = y * f + MDL_C(1.0) / MDL_C(720.0);
    y = y * f + MDL_C(1.0) / MDL_C(120.0);
    y = y * f + MDL_C(1.0) / MDL_C(24.0);
    y = y * f + MDL_C(1.0) / MDL_C(6.0);
    y = y * f + MDL_C(0.5);
    y = y * f + MDL_C(1.0);
    y = y * f + MDL_C(1.0);
    scale.bits = (mdl_key)(n + MDL_EXPONENT_BIAS) << MDL_MANTISSA_LENGTH;
    return y * scale.real;
}

mdl_real mdl_log2(mdl_real x)
{
    mdl_real_bits m;
    mdl_real t, t2;
    int n;
    m.real = x;
    n = (int)(m.bits >> MDL_MANTISSA_LENGTH) - MDL_EXPONENT_BIAS;
    /* The exponent becomes 0: 1 <= m < 2. */
    m.bits &= ((mdl_key)1 << MDL_MANTISSA_LENGTH) - 1;
    m.bits |= (mdl_key)MDL_EXPONENT_BIAS << MDL_MANTISSA_LENGTH;
    if (m.real > MDL_C(1.41421356)) {
        m.real *= MDL_C(0.5);
        n += 1;
    }
    /* log2 m = 2 / ln 2 * artanh t, t = (m - 1) / (m + 1), |t| < 0.172. */
    t = (m.real - MDL_C(1.0)) / (m.real + MDL_C(1.0));
    t2 = t * t;
    t *= MDL_C(2.8853900817779268) *
         (MDL_C(1.0) + t2 * (MDL_C(1.0) / MDL_C(3.0) +
                             t2 * (MDL_C(0.2) + t2 * (MDL_C(1.0) / MDL_C(7.0) + t2 / MDL_C(9.0)))));
    return (mdl_real)n + t;
}

mdl_real mdl_power(mdl_real x, mdl_real p)
{
    if (x < MDL_C(8.7e-19)) {
        return MDL_C(0.0);
    }
    return mdl_exp2(p * mdl_log2(x));
}

mdl_real mdl_softplus(mdl_real x)
{
    if (x > MDL_C(20.0)) {
        return x;
    }
    return MDL_C(0.69314718055994531) *
           mdl_log2(MDL_C(1.0) + mdl_exp2(x * MDL_C(1.4426950408889634)));
}
