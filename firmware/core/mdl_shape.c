#include "mdl_shape.h"

mdl_real mdl_shape_swing(const mdl_shape *shape, mdl_real a_volts, mdl_real b_volts)
{
    mdl_real s = (b_volts - a_volts) * shape->per_range;
    mdl_real m = (a_volts + b_volts) * shape->per_range - MDL_C(1.0);
    mdl_real sum = MDL_C(0.0);
    int k, j;
    for (k = MDL_SHAPE_ORDER - 1; k >= 0; k--) {
        mdl_real row = MDL_C(0.0);
        for (j = MDL_SHAPE_ORDER - 1; j >= 0; j--) {
            row = (row + shape->g[k][j]) * s;
        }
        sum = (sum + row) * m;
    }
    return sum;
}

mdl_real mdl_shape_widening(const mdl_shape *shape, mdl_real swing_volts)
{
    mdl_real d = swing_volts * shape->per_range;
    return d < MDL_C(1.0) ? (shape->loop[0] + shape->loop[1] * d) * (MDL_C(1.0) - d) : MDL_C(0.0);
}
