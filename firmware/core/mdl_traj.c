#include "mdl_traj.h"

/*
 * The same rules hold for every input; for speed, three ways lead through a step.
 *
 * The short way is for inputs in the identified range when f0 is a polynomial of degree 3 or less
 * without a shape. In the range reals are +0 or more and are compared as their bits. `upper` and
 * `lower` hold the innermost turning points of both sides, or the end of the range: an input
 * between them stays on its curve, or turns. All others, whatever is the matter with them, reach
 * or pass a limit and are sorted out behind it. `leave` is for any other f0, and is the same but
 * for the evaluation. The long way is for inputs outside the range, and as long as the point
 * before or a turning point lies there: the limits are then set so that every input passes them.
 */

/* Bits of mdl_traj.curve. */
#define FALLING 1u /* on a descending curve (TP_flag of the paper) */
#define GENERAL 2u /* f0 is not of the kind that the short way is for */

static uint16_t is_falling(const mdl_traj *traj)
{
    return traj->curve & FALLING;
}

/* Right turning points held; left: as many, and one more if rising. */
static uint_fast16_t pairs_of(const mdl_traj *traj)
{
    return (uint_fast16_t)(traj->right - traj->rights->tp);
}

static uint_fast16_t lefts_of(const mdl_traj *traj)
{
    return pairs_of(traj) + 1u - is_falling(traj);
}

MDL_INLINE void set_pairs(mdl_traj *traj, uint_fast16_t pairs, uint16_t falling)
{
    traj->left = traj->lefts->tp + pairs;
    traj->right = traj->rights->tp + pairs;
    traj->curve = (uint16_t)((traj->curve & GENERAL) | falling);
}

MDL_INLINE mdl_status put(mdl_traj *traj, mdl_real *y_um, mdl_real y)
{
    traj->last.y_um = y;
    *y_um = y;
    return MDL_OK;
}

/*
 * Records (x_1, y_1) as a turning point when the input has changed its direction, eq. (10). It is
 * a right one if x - x_1 < 0 (printed as x - x_2 < 0).
 */
MDL_INLINE void turn_up(mdl_traj *traj, uint16_t curve)
{
    mdl_tp *left = traj->left;
    left->x = traj->last.x;
    left->y_um = traj->last.y_um;
    traj->curve = curve;
}

MDL_INLINE void turn_down(mdl_traj *traj, uint16_t curve)
{
    mdl_tp *right = traj->right;
    right->x = traj->last.x;
    right->y_um = traj->last.y_um;
    traj->right = right + 1;
    traj->left++;
    traj->curve = curve;
}

/* No further left turning point can be held, then no right one either. */
MDL_INLINE int is_full(const mdl_traj *traj)
{
    return traj->left == traj->left_end;
}

/* Output on the current curve at `last`, eq. (6), for any f0 and input. */
MDL_APART mdl_status general_rising(mdl_traj *traj, mdl_real *y_um)
{
    const mdl_tp *start = traj->left;
    mdl_real rise = mdl_major_swing(traj->major, start->x.real, traj->last.x.real);
    return put(traj, y_um, start->y_um + rise);
}

MDL_APART mdl_status general_falling(mdl_traj *traj, mdl_real *y_um)
{
    const mdl_tp *start = traj->right - 1;
    mdl_real fall = mdl_major_swing(traj->major, traj->last.x.real, start->x.real);
    return put(traj, y_um, start->y_um - fall);
}

/* f0(d) - f0(0) on the short way, the same to the bit as mdl_major_swing. */
MDL_INLINE mdl_real cubic(const mdl_traj *traj, mdl_real d)
{
    return ((traj->c[2] * d + traj->c[1]) * d + traj->c[0]) * d;
}

/*
 * Output on the current curve, eq. (6), on the short way. As printed, the intervals and the
 * arguments of even and odd k have changed places: an ascending curve (k even) starts at a left
 * turning point A_k and holds for x_Ak < x < x_A(k-1), a descending one (k odd) at a right one for
 * x_A(k-1) < x < x_Ak; so has eq. (5). The mirror behind both is eq. (1) with A_1 where A_0' is
 * printed. x_A0 = 0.
 */
MDL_INLINE mdl_status put_rising(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    mdl_real rise;
    traj->last.x = x;
    rise = cubic(traj, x.real - traj->left->x.real);
    return put(traj, y_um, traj->left->y_um + rise);
}

MDL_INLINE mdl_status put_falling(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    const mdl_tp *start = traj->right - 1;
    mdl_real fall;
    traj->last.x = x;
    fall = cubic(traj, start->x.real - x.real);
    return put(traj, y_um, start->y_um - fall);
}

/* Whether x has not surpassed a left (ascending) or right (descending) turning point. */
MDL_INLINE int is_inside(mdl_key tp, mdl_key x, int descending)
{
    return descending ? tp > x : tp < x;
}

/* A step of the search: base[step] exists; base, and all before it, are not surpassed. */
#define HALVE(step)                                                                                \
    if (is_inside(base[step].x.bits, x, descending)) {                                             \
        base += (step);                                                                            \
    }

/*
 * How many turning points of one side are not surpassed: eqs. (12) and (13), read with their
 * misprints corrected. The curve is that of D_f(k-1) where D_fk is printed. (12) rests on the
 * chain x_A0 < x_A2 < ... < x_Am < x; (13) holds for x_A(k-2) < x <= x_Ak, and its last row is
 * D_f1. The newest two are known to be surpassed, unless there are fewer. The third is tried
 * first, because an input seldom surpasses more. The binary search of the others is unrolled and
 * without branches: first a part whose length is a power of two, then halves of it.
 */
MDL_INLINE uint_fast16_t not_surpassed(const mdl_tp *tp, uint_fast16_t count, mdl_key x,
                                       int descending)
{
    const mdl_tp *base = tp;
    uint_fast16_t power = MDL_TP_CAPACITY / 2u;
    if (count < 3u || !is_inside(tp[0].x.bits, x, descending)) {
        return 0;
    }
    count -= 3u;
    if (is_inside(tp[count].x.bits, x, descending)) {
        return count + 1u;
    }
    while (power > count) {
        power /= 2u;
    }
    if (is_inside(tp[count - power].x.bits, x, descending)) {
        base += count - power;
    }
    switch (power) {
#if MDL_N_U > 4096
    case 16384:
        HALVE(8192)
        /* fall through */
    case 8192:
        HALVE(4096)
        /* fall through */
    case 4096:
        HALVE(2048)
        /* fall through */
    case 2048:
        HALVE(1024)
        /* fall through */
#endif
        /* fall through */
    case 1024:
        HALVE(512)
        /* fall through */
    case 512:
        HALVE(256)
        /* fall through */
    case 256:
        HALVE(128)
        /* fall through */
    case 128:
        HALVE(64)
        /* fall through */
    case 64:
        HALVE(32)
        /* fall through */
    case 32:
        HALVE(16)
        /* fall through */
    case 16:
        HALVE(8)
        /* fall through */
    case 8:
        HALVE(4)
        /* fall through */
    case 4:
        HALVE(2)
        /* fall through */
    case 2:
        HALVE(1)
        /* fall through */
    default:
        return (uint_fast16_t)(base - tp) + 1u;
    }
}

/*
 * Wipes out one pair, if that is all to be done when x reaches the upper limit: the innermost right
 * turning point with the left one after it, which may not have been recorded yet. 0: something
 * else is to be done. Beyond the floor there is a second right turning point, and the short way
 * is open.
 */
MDL_INLINE int drop_rising(mdl_traj *traj, mdl_key x)
{
    mdl_tp *right = traj->right;
    if (right <= traj->right_floor || x >= right[-2].x.bits) {
        return 0;
    }
    traj->upper = right[-2].x.bits;
    traj->right = right - 1;
    traj->left--;
    if (traj->curve == 0) {
        traj->lower = traj->left->x.bits;
    }
    traj->curve = 0;
    return 1;
}

/* The same downwards: a left turning point with the right one after it, recorded or not. */
MDL_INLINE int drop_falling(mdl_traj *traj, mdl_key x)
{
    mdl_tp *left = traj->left;
    const mdl_tp *floor = traj->left_floor;
    if (traj->curve != 0) {
        floor++;
    }
    if (left <= floor) {
        return 0;
    }
    if (traj->curve != 0) {
        left--;
    }
    if (x <= left[-1].x.bits) {
        return 0;
    }
    if (traj->curve != 0) {
        traj->upper = traj->right[-2].x.bits;
        traj->right--;
        traj->left = left;
    }
    traj->lower = left[-1].x.bits;
    traj->curve = FALLING;
    return 1;
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

/* Whether x lies from +0 to below end; bits of negative reals are large unsigned numbers. */
static int is_below(mdl_real_bits x, mdl_key end)
{
    return (mdl_ukey)x.bits < (mdl_ukey)end;
}

static int is_all_in_range(const mdl_traj *traj)
{
    mdl_key end = traj->range_end;
    return is_below(traj->last.x, end) &&
           (pairs_of(traj) == 0 || is_below(traj->rights->tp[0].x, end)) &&
           (lefts_of(traj) == 0 || is_below(traj->lefts->tp[0].x, end));
}

/* The limits after a step on the long way. */
static void set_limits(mdl_traj *traj)
{
    uint_fast16_t n = pairs_of(traj);
    traj->short_end = 0;
    traj->left_floor = traj->left_end - 1;
    traj->right_floor = traj->rights->tp + MDL_TP_CAPACITY;
    traj->upper = ~MDL_KEY_MAX;
    traj->lower = MDL_KEY_MAX;
    if (!is_all_in_range(traj)) {
        return;
    }
    traj->upper = n > 0 ? traj->right[-1].x.bits : traj->range_end;
    traj->lower = 0; /* of the empty memory, at the minimum */
    if (!is_falling(traj)) {
        traj->lower = traj->left->x.bits;
    } else if (n > 0) {
        traj->lower = traj->left[-1].x.bits;
    }
    if ((traj->curve & GENERAL) == 0) {
        traj->short_end = traj->range_end;
        traj->left_floor = traj->lefts->tp;
        traj->right_floor = traj->rights->tp + 1;
    }
}

/* How many turning points of a side x has not surpassed, for reals of any sign. */
static uint_fast16_t count_inside(const mdl_tp *tp, uint_fast16_t count, mdl_key x, int descending)
{
    uint_fast16_t low = 0;
    while (count > 0) {
        uint_fast16_t half = count / 2u;
        if (is_inside(mdl_key_of(tp[low + half].x.real), x, descending)) {
            low += half + 1u;
            count -= half + 1u;
        } else {
            count = half;
        }
    }
    return low;
}

/* An ascending curve starts, unless the memory is full: then the trajectory moves to and fro. */
static mdl_status turn_or_not(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    if (is_full(traj)) {
        traj->last.x = x;
        (void)general_falling(traj, y_um);
        return MDL_MEMORY_FULL;
    }
    traj->lower = traj->last.x.bits;
    turn_up(traj, traj->curve & GENERAL);
    traj->last.x = x;
    return general_rising(traj, y_um);
}

static mdl_status long_rise(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    uint_fast16_t n = count_inside(traj->rights->tp, pairs_of(traj), mdl_key_of(x.real), 1);
    if (n < pairs_of(traj)) {
        set_pairs(traj, n, 0);
    } else if (is_falling(traj)) {
        return turn_or_not(traj, y_um, x);
    }
    traj->last.x = x;
    return general_rising(traj, y_um);
}

static mdl_status long_fall(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    uint_fast16_t lefts = lefts_of(traj);
    uint_fast16_t n = count_inside(traj->lefts->tp, lefts, mdl_key_of(x.real), 0);
    if (n == lefts && !is_falling(traj)) {
        turn_down(traj, traj->curve | FALLING);
    } else {
        set_pairs(traj, n, 1);
    }
    traj->last.x = x;
    if (n == 0) {
        /* At or below the minimum: the descending curve that starts at the end of the range. */
        mdl_real fall = mdl_major_swing(traj->major, x.real, traj->major->range_volts);
        return put(traj, y_um, traj->f0_min_um - (fall - traj->full_swing_um));
    }
    return general_falling(traj, y_um);
}

MDL_APART mdl_status long_step(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    unsigned status = MDL_OK;
    mdl_key key, last;
    *y_um = traj->last.y_um;
    x.real += MDL_C(0.0); /* -0 becomes +0, whose key is 0 */
    if (!mdl_is_finite(x.real)) {
        return MDL_ERR_NOT_FINITE;
    }
    if (x.real < MDL_C(0.0) || x.real > traj->major->range_volts) {
        status = (unsigned)limit(traj, &x.real);
    }
    key = mdl_key_of(x.real);
    last = mdl_key_of(traj->last.x.real);
    if (key > last) {
        status |= (unsigned)long_rise(traj, y_um, x);
    } else if (key < last) {
        status |= (unsigned)long_fall(traj, y_um, x);
    }
    set_limits(traj);
    return (mdl_status)status;
}

/* Wipes out what an input in the range has surpassed; the innermost that is left is the CTP. */
MDL_INLINE void wipe_up(mdl_traj *traj, mdl_key x, int general)
{
    uint_fast16_t n = pairs_of(traj);
    if (general && n > 1u && x < traj->right[-2].x.bits) {
        n--;
    } else {
        n = not_surpassed(traj->rights->tp, n, x, 1);
    }
    set_pairs(traj, n, 0);
    traj->upper = n > 0 ? traj->right[-1].x.bits : traj->range_end;
    traj->lower = traj->left->x.bits;
}

/* The same downwards. 0: at the minimum all is wiped out. */
MDL_INLINE uint_fast16_t wipe_down(mdl_traj *traj, mdl_key x, int general)
{
    uint_fast16_t n = lefts_of(traj);
    if (general && n > 1u && x > traj->lefts->tp[n - 2u].x.bits) {
        n--;
    } else {
        n = not_surpassed(traj->lefts->tp, n, x, 0);
    }
    set_pairs(traj, n, FALLING);
    traj->upper = n > 0 ? traj->right[-1].x.bits : traj->range_end;
    traj->lower = n > 0 ? traj->left[-1].x.bits : 0;
    return n;
}

MDL_APART mdl_status surpass_general(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    uint_fast16_t n;
    if (x.bits > traj->last.x.bits) {
        wipe_up(traj, x.bits, 1);
        traj->last.x = x;
        return general_rising(traj, y_um);
    }
    n = wipe_down(traj, x.bits, 1);
    traj->last.x = x;
    return n > 0 ? general_falling(traj, y_um) : put(traj, y_um, traj->f0_min_um);
}

/* Beyond a limit, and not for the short way. */
MDL_APART mdl_status leave(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    if (traj->upper > 0 && is_below(x, traj->range_end)) {
        return surpass_general(traj, y_um, x);
    }
    return long_step(traj, y_um, x);
}

/* Beyond the upper limit. */
MDL_APART mdl_status surpass_up(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    if (!is_below(x, traj->short_end)) {
        return leave(traj, y_um, x);
    }
    wipe_up(traj, x.bits, 0);
    return put_rising(traj, y_um, x);
}

/* Beyond the lower limit. */
MDL_APART mdl_status surpass_down(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    if (!is_below(x, traj->short_end)) {
        return leave(traj, y_um, x);
    }
    if (wipe_down(traj, x.bits, 0) == 0) {
        traj->last.x = x;
        return put(traj, y_um, traj->f0_min_um);
    }
    return put_falling(traj, y_um, x);
}

/* Between the limits, but f0 is another one, or the memory is full. */
MDL_APART mdl_status go_up(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    if (is_falling(traj)) {
        return turn_or_not(traj, y_um, x);
    }
    traj->last.x = x;
    return general_rising(traj, y_um);
}

MDL_APART mdl_status go_down(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    if (!is_falling(traj)) {
        traj->upper = traj->last.x.bits;
        turn_down(traj, GENERAL | FALLING);
    }
    traj->last.x = x;
    return general_falling(traj, y_um);
}

/* The same input again. */
MDL_APART mdl_status stay(mdl_traj *traj, mdl_real *y_um, mdl_real_bits x)
{
    if (traj->upper < 0) {
        return long_step(traj, y_um, x);
    }
    *y_um = traj->last.y_um;
    return MDL_OK;
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
    traj->lefts = left;
    traj->rights = right;
    traj->left_end = left->tp + MDL_TP_CAPACITY;
    traj->margin_volts = margin_volts;
    traj->range_end = mdl_key_of(major->range_volts) + 1;
    traj->curve = GENERAL;
    if (major->kind == MDL_POLYNOMIAL && major->degree <= 3 && major->shape == 0) {
        uint16_t k;
        traj->curve = 0;
        for (k = 0; k < 3; k++) {
            traj->c[k] = major->c[k + 1];
        }
    }
    traj->f0_min_um = major->at_zero_um;
    traj->full_swing_um = mdl_major_swing(major, MDL_C(0.0), major->range_volts);
    mdl_traj_reset(traj);
    return MDL_OK;
}

void mdl_traj_reset(mdl_traj *traj)
{
    traj->last.x.real = MDL_C(0.0);
    traj->last.y_um = traj->f0_min_um;
    traj->lefts->tp[0] = traj->last;
    set_pairs(traj, 0, 0);
    set_limits(traj);
}

mdl_status mdl_traj_step(mdl_traj *traj, mdl_real x_volts, mdl_real *y_um)
{
    mdl_real_bits x;
    mdl_key last = traj->last.x.bits;
    x.real = x_volts;
    if (x.bits > last) {
        if (x.bits >= traj->upper) {
            if (!drop_rising(traj, x.bits)) {
                return surpass_up(traj, y_um, x);
            }
        } else if (traj->curve != 0) {
            if (traj->curve != FALLING || is_full(traj)) {
                return go_up(traj, y_um, x);
            }
            traj->lower = last;
            turn_up(traj, 0);
        }
        return put_rising(traj, y_um, x);
    }
    if (x.bits != last) {
        if (x.bits <= traj->lower) {
            if (!drop_falling(traj, x.bits)) {
                return surpass_down(traj, y_um, x);
            }
        } else if (traj->curve != FALLING) {
            if (traj->curve != 0) {
                return go_down(traj, y_um, x);
            }
            traj->upper = last;
            turn_down(traj, FALLING);
        }
        return put_falling(traj, y_um, x);
    }
    return stay(traj, y_um, x);
}

uint32_t mdl_traj_turning_points(const mdl_traj *traj)
{
    return (uint32_t)pairs_of(traj) + (uint32_t)lefts_of(traj);
}

uint32_t mdl_traj_saved_length(const mdl_traj *traj)
{
    return 4u + 2u * mdl_traj_turning_points(traj);
}

static mdl_real *save_points(mdl_real *saved, const mdl_tp *tp, uint_fast16_t count)
{
    for (; count > 0; count--, tp++) {
        *saved++ = tp->x.real;
        *saved++ = tp->y_um;
    }
    return saved;
}

mdl_status mdl_traj_save(const mdl_traj *traj, mdl_real *saved, uint32_t capacity)
{
    if (capacity < mdl_traj_saved_length(traj)) {
        return MDL_ERR_CAPACITY;
    }
    *saved++ = (mdl_real)pairs_of(traj);
    *saved++ = (mdl_real)is_falling(traj);
    *saved++ = traj->last.x.real;
    *saved++ = traj->last.y_um;
    saved = save_points(saved, traj->lefts->tp, lefts_of(traj));
    (void)save_points(saved, traj->rights->tp, pairs_of(traj));
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
    lefts = (uint16_t)(rights + (saved[1] == MDL_C(0.0) ? 1u : 0u));
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

static const mdl_real *resume_points(mdl_tp *tp, const mdl_real *saved, uint_fast16_t count)
{
    for (; count > 0; count--, tp++) {
        tp->x.real = *saved++ + MDL_C(0.0);
        tp->y_um = *saved++;
    }
    return saved;
}

mdl_status mdl_traj_resume(mdl_traj *traj, const mdl_real *saved, uint32_t length)
{
    mdl_status status = check_saved(traj, saved, length);
    if (status != MDL_OK) {
        return status;
    }
    set_pairs(traj, (uint_fast16_t)saved[0], (uint16_t)saved[1]);
    traj->last.x.real = saved[2] + MDL_C(0.0);
    traj->last.y_um = saved[3];
    saved = resume_points(traj->lefts->tp, saved + 4, lefts_of(traj));
    (void)resume_points(traj->rights->tp, saved, pairs_of(traj));
    set_limits(traj);
    return MDL_OK;
}
