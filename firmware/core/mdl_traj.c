#include "mdl_traj.h"

/*
 * How many of the turning points of one side are not surpassed: eqs. (12) and (13), read with
 * their misprints corrected. The curve is that of D_f(k-1) where D_fk is printed. (12) rests on
 * the chain x_A0 < x_A2 < ... < x_Am < x; (13) holds for x_A(k-2) < x <= x_Ak, and its last row
 * is D_f1. The newest two are tried first, because an input seldom surpasses more; the binary
 * search of the others is without branches but its loop.
 */
static uint16_t not_surpassed(const mdl_key *ascending, uint16_t count, mdl_key x)
{
    const mdl_key *base = ascending;
    uint16_t length;
    if (count == 0 || ascending[count - 1] < x) {
        return count;
    }
    if (count == 1 || ascending[count - 2] < x) {
        return (uint16_t)(count - 1u);
    }
    for (length = (uint16_t)(count - 2u); length > 0;) {
        uint16_t half = (uint16_t)((length + 1u) / 2u);
        base += base[half - 1] < x ? half : 0;
        length = (uint16_t)(length - half);
    }
    return (uint16_t)(base - ascending);
}

/*
 * Records (x_1, y_1) as a turning point when the input has changed its direction, eq. (10), and
 * enters the new curve. The point is a right one if x - x_1 < 0 (printed as x - x_2 < 0).
 */
static mdl_status enter_curve(mdl_traj *traj, mdl_key x)
{
    uint16_t n = traj->pairs;
    uint16_t falling = x < traj->last_x;
    if (falling == traj->falling) {
        return MDL_OK;
    }
    if (n < MDL_TP_CAPACITY) {
        if (falling) {
            traj->right->x[n] = ~traj->last_x;
            traj->right->y_um[n] = traj->last_y_um;
            traj->pairs = (uint16_t)(n + 1u);
        } else {
            traj->left->x[n] = traj->last_x;
            traj->left->y_um[n] = traj->last_y_um;
        }
    } else if (~x > traj->right->x[n - 1]) {
        /* Only a falling trajectory can hold N_u / 2 pairs: it moves to and fro on its curve. */
        return MDL_MEMORY_FULL;
    }
    traj->falling = falling;
    return MDL_OK;
}

/*
 * Output on the current curve, eq. (6). As printed, the intervals and the arguments of even and
 * odd k have changed places: an ascending curve (k even) starts at a left turning point A_k and
 * holds for x_Ak < x < x_A(k-1), a descending one (k odd) at a right one for x_A(k-1) < x < x_Ak;
 * so has eq. (5). The mirror behind both is eq. (1) with A_1 where A_0' is printed. x_A0 = 0.
 */
static mdl_real output(const mdl_traj *traj, mdl_real x)
{
    const mdl_major *major = traj->major;
    uint16_t n = traj->pairs;
    if (!traj->falling) {
        return traj->left->y_um[n] + mdl_major_swing(major, mdl_real_of(traj->left->x[n]), x);
    }
    if (n > 0) {
        n = (uint16_t)(n - 1u);
        return traj->right->y_um[n] - mdl_major_swing(major, x, mdl_real_of(~traj->right->x[n]));
    }
    /* At or below the minimum: the descending curve that starts at the end of the range. */
    return traj->f0_min_um - (mdl_major_swing(major, x, major->range_volts) - traj->full_swing_um);
}

/* Says where x lies with respect to the identified range, and clamps it at the margin. */
static mdl_status limit(const mdl_traj *traj, mdl_real *x)
{
    mdl_real low = -traj->margin_volts;
    mdl_real high = traj->major->range_volts + traj->margin_volts;
    if (*x < low) {
        *x = low + MDL_C(0.0);
        return MDL_CLAMPED;
    }
    if (*x > high) {
        *x = high;
        return MDL_CLAMPED;
    }
    return MDL_EXTRAPOLATED;
}

mdl_status mdl_traj_init(mdl_traj *traj, const mdl_major *major, mdl_tp_side *left,
                         mdl_tp_side *right, mdl_real margin_volts)
{
    if (!mdl_is_finite(margin_volts)) {
        return MDL_ERR_NOT_FINITE;
    }
    if (margin_volts < MDL_C(0.0) ||
        !mdl_is_finite(mdl_major_swing(major, -margin_volts, major->range_volts + margin_volts))) {
        return MDL_ERR_PARAMETER;
    }
    traj->major = major;
    traj->left = left;
    traj->right = right;
    traj->margin_volts = margin_volts;
    traj->range_key = mdl_key_of(major->range_volts);
    traj->f0_min_um = major->at_zero_um;
    traj->full_swing_um = mdl_major_swing(major, MDL_C(0.0), major->range_volts);
    mdl_traj_reset(traj);
    return MDL_OK;
}

void mdl_traj_reset(mdl_traj *traj)
{
    traj->left->x[0] = 0;
    traj->left->y_um[0] = traj->f0_min_um;
    traj->last_x = 0;
    traj->last_y_um = traj->f0_min_um;
    traj->falling = 0;
    traj->pairs = 0;
}

mdl_status mdl_traj_step(mdl_traj *traj, mdl_real x_volts, mdl_real *y_um)
{
    unsigned status = MDL_OK;
    mdl_real x = x_volts + MDL_C(0.0); /* -0 becomes +0, whose key is 0 */
    mdl_key key = mdl_key_of(x);
    if (key < 0 || key > traj->range_key) {
        if (!mdl_is_finite(x)) {
            *y_um = traj->last_y_um;
            return MDL_ERR_NOT_FINITE;
        }
        status = (unsigned)limit(traj, &x);
        key = mdl_key_of(x);
    }
    if (key != traj->last_x) {
        status |= (unsigned)enter_curve(traj, key);
        /* What is surpassed is wiped out; the innermost that is left determines the curve (CTP). */
        traj->pairs = traj->falling ? not_surpassed(traj->left->x, traj->pairs, key)
                                    : not_surpassed(traj->right->x, traj->pairs, ~key);
        traj->last_x = key;
        traj->last_y_um = output(traj, x);
    }
    *y_um = traj->last_y_um;
    return (mdl_status)status;
}

uint32_t mdl_traj_turning_points(const mdl_traj *traj)
{
    return 2u * (uint32_t)traj->pairs + (traj->falling ? 0u : 1u);
}

uint32_t mdl_traj_saved_length(const mdl_traj *traj)
{
    return 4u + 2u * mdl_traj_turning_points(traj);
}

/* Left turning points held. */
static uint16_t lefts_of(uint16_t pairs, uint16_t falling)
{
    return (uint16_t)(pairs + (falling ? 0u : 1u));
}

mdl_status mdl_traj_save(const mdl_traj *traj, mdl_real *saved, uint32_t capacity)
{
    uint16_t lefts = lefts_of(traj->pairs, traj->falling);
    uint16_t i;
    if (capacity < mdl_traj_saved_length(traj)) {
        return MDL_ERR_CAPACITY;
    }
    *saved++ = (mdl_real)traj->pairs;
    *saved++ = (mdl_real)traj->falling;
    *saved++ = mdl_real_of(traj->last_x);
    *saved++ = traj->last_y_um;
    for (i = 0; i < lefts; i++) {
        *saved++ = mdl_real_of(traj->left->x[i]);
        *saved++ = traj->left->y_um[i];
    }
    for (i = 0; i < traj->pairs; i++) {
        *saved++ = mdl_real_of(~traj->right->x[i]);
        *saved++ = traj->right->y_um[i];
    }
    return MDL_OK;
}

/* Whether count points (x, y) ascend (sign 1) or descend (-1) strictly towards x, which they hold.
 */
static int is_chain(const mdl_real *points, uint16_t count, mdl_real sign, mdl_real x)
{
    uint16_t i;
    for (i = 1; i < count; i++) {
        if (!(sign * points[2u * i] > sign * points[2u * (i - 1u)])) {
            return 0;
        }
    }
    return count == 0 || sign * points[2u * (count - 1u)] <= sign * x;
}

static void put_point(mdl_tp_side *side, uint16_t i, const mdl_real *point, mdl_key flip)
{
    side->x[i] = mdl_key_of(point[0] + MDL_C(0.0)) ^ flip;
    side->y_um[i] = point[1];
}

/*
 * Whether the outermost points lie where the model can have put them, given the first left and the
 * first right one or, where there is none, the present input: A_0 at or below the minimum, and
 * nothing beyond the margin.
 */
static int is_within(const mdl_traj *traj, mdl_real first_left, mdl_real first_right)
{
    return first_left <= MDL_C(0.0) && first_left >= -traj->margin_volts &&
           first_right <= traj->major->range_volts + traj->margin_volts;
}

/* Whether length reals are a state that save can have written for this model and capacity. */
static mdl_status check_saved(const mdl_traj *traj, const mdl_real *saved, uint32_t length)
{
    const mdl_real *points;
    uint32_t k;
    uint16_t lefts, rights;
    if (length < 4u) {
        return MDL_ERR_STATE;
    }
    for (k = 0; k < length; k++) {
        if (!mdl_is_finite(saved[k])) {
            return MDL_ERR_NOT_FINITE;
        }
    }
    if (saved[0] < MDL_C(0.0) || (saved[1] != MDL_C(0.0) && saved[1] != MDL_C(1.0))) {
        return MDL_ERR_STATE;
    }
    if (saved[0] + MDL_C(1.0) - saved[1] > (mdl_real)MDL_TP_CAPACITY) {
        return MDL_ERR_CAPACITY;
    }
    rights = (uint16_t)saved[0];
    lefts = lefts_of(rights, (uint16_t)saved[1]);
    points = saved + 4;
    k = 2u * (uint32_t)lefts; /* where the right points start */
    if ((mdl_real)rights != saved[0] || length != 4u + k + 2u * (uint32_t)rights ||
        !is_chain(points, lefts, MDL_C(1.0), saved[2]) ||
        !is_chain(points + k, rights, MDL_C(-1.0), saved[2]) ||
        !is_within(traj, lefts > 0 ? points[0] : saved[2], rights > 0 ? points[k] : saved[2])) {
        return MDL_ERR_STATE;
    }
    return MDL_OK;
}

mdl_status mdl_traj_resume(mdl_traj *traj, const mdl_real *saved, uint32_t length)
{
    uint16_t lefts, i;
    mdl_status status = check_saved(traj, saved, length);
    if (status != MDL_OK) {
        return status;
    }
    traj->pairs = (uint16_t)saved[0];
    traj->falling = (uint16_t)saved[1];
    traj->last_x = mdl_key_of(saved[2] + MDL_C(0.0));
    traj->last_y_um = saved[3];
    lefts = lefts_of(traj->pairs, traj->falling);
    for (saved += 4, i = 0; i < lefts; i++, saved += 2) {
        put_point(traj->left, i, saved, 0);
    }
    for (i = 0; i < traj->pairs; i++, saved += 2) {
        put_point(traj->right, i, saved, ~(mdl_key)0);
    }
    return MDL_OK;
}
