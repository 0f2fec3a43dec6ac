/* clang-format off */
/* Written by `madelung export`; do not edit. Reals are floats, exact in nine digits.
 * For 10000 samples a second, whatever the rate of the records was;
 * for another rate: `madelung export model.json --rate HZ -o FOLDER`
 * model: {"kind": "madelung", "u_min_V": 0.0, "u_max_V": 40.0, "source": "Cao & Li, Sensors 2019, 19, 352, eq. (20)"}
 */
#include "mdl_params.h"

#ifdef __TMS320C28XX__
#pragma DATA_SECTION(mdl_params, "mdl_params") /* the F28335 copies it to RAM */
#endif

const mdl_app_params mdl_params = {
    .chain = {
        .u_min_volts = 0.0f,
        .margin_volts = 6.0f,
        .major = {
            .kind = MDL_POLYNOMIAL,
            .degree = 3u,
            .range_volts = 40.0f,
            .at_zero_um = 0.585169971f,
            .c = {0.585169971f, 0.0864439979f, 0.00119490002f, -6.18759987e-06f}
        }
    },
    .rate_hz = 10000u,
    .u_zero_volts = 0.0f,
    .volts_per_code = 0.00976801012f,
    .y_zero_um = 0.585169971f,
    .codes_per_um = 823.348328f
};
