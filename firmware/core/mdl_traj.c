#include "mdl_traj.h"

#include <string.h>

/*
 * A step jumps to the part for its curve, ascending or descending, and its kind of f0: one for
 * every degree, and one for any other. That part does all that is common; for what is seldom it
 * ends with a further jump, with the same parameters.
 *
 * Reals from +0 on are compared as their bits. An input between the limits of both sides stays on
 * its curve, or turns. The limits are the innermost turning points of both sides or, where there is
 * none, the ends of the identified range: whatever else is the matter with an input, it reaches a
 * limit and is sorted out behind it. While the point before or a turning point lies outside the
 * range, the limits are such that every input reaches one.
 *
 * Both directions share their code: `down` is a constant in what is inlined.
 */

MDL_INLINE int reaches(mdl_key x, mdl_key limit, uint16_t down)
{
    return down ? x <= limit : x >= limit;
}

/* Whether the real of these bits lies from +0 to below end; those of negative ones are large. */
MDL_INLINE int is_below(mdl_key x, mdl_key end)
{
    return (mdl_ukey)x < (mdl_ukey)end;
}

/* TP_flag of the paper: 1 on a descending curve, else 0. */
static uint16_t is_falling(const mdl_traj *traj)
{
    return traj->step == traj->part.step[1];
}

static uint_fast16_t held(const mdl_tp_stack *side)
{
    return (uint_fast16_t)(side->end - side->tp);
}

/* ---- the output ---- */

#define ANY (MDL_DEGREE_UNROLLED + 1u)

/*
 * How far a branch has come when its loop is wider than the rules make it (mdl_shape.h): gained is
 * what it has gained by them. It must end in the turning point at which its loop began, whatever
 * the branch that came from there has gained.
 */
static mdl_real widened(const mdl_traj *traj, mdl_real x, mdl_real gained, uint16_t down)
{
    const mdl_tp *from = (down ? &traj->right : &traj->left)->end - 1;
    const mdl_tp *to = (down ? &traj->left : &traj->right)->end - 1;
    const mdl_tp *low = down ? to : from;
    const mdl_tp *high = down ? from : to;
    mdl_real whole = high->x.real - low->x.real;
    mdl_real part = mdl_size(x - from->x.real) / whole;
    mdl_real more = MDL_C(1.0) + mdl_shape_widening(traj->major->shape, whole);
    mdl_real by_rules = mdl_major_swing(traj->major, low->x.real, high->x.real);
    return more * gained + part * (high->y_um - low->y_um - more * by_rules);
}

static int has_wider_loops(const mdl_major *major)
{
    return major->shape != 0 &&
           (major->shape->loop[0] != MDL_C(0.0) || major->shape->loop[1] != MDL_C(0.0));
}

/*
 * Output at x on the current curve, eq. (6). As printed, the intervals and the arguments of even
 * and odd k have changed places: an ascending curve (k even) starts at a left turning point A_k and
 * holds for x_Ak < x < x_A(k-1), a descending one (k odd) at a right one for x_A(k-1) < x < x_Ak;
 * so has eq. (5). The mirror behind both is eq. (1) with A_1 where A_0' is printed. x_A0 = 0.
 *
 * Inside the range the limit on its side is where the curve starts. An outer step, whose limits are
 * none, uses the part for ANY f0, which gives the same to the bit.
 */
MDL_INLINE mdl_status put(mdl_traj *traj, mdl_real x, mdl_real *y_um, uint16_t down,
                          uint16_t degree)
{
    const mdl_tp_stack *from = down ? &traj->right : &traj->left;
    const mdl_tp_stack *to = down ? &traj->left : &traj->right;
    mdl_real start, y;
    traj->last.x.real = x;
    if (degree == ANY) {
        start = from->end[-1].x.real;
        y = mdl_major_swing(traj->major, down ? x : start, down ? start : x);
        if (has_wider_loops(traj->major) && to->end > to->tp) {
            y = widened(traj, x, y, down);
        }
    } else {
        start = from->limit.real;
        y = mdl_major_horner(traj->c, degree, down ? start - x : x - start);
    }
    y = down ? from->end[-1].y_um - y : from->end[-1].y_um + y;
    traj->last.y_um = y;
    *y_um = y;
    return MDL_OK;
}

/* macro(name, degree) for every kind of f0. */
#define EVERY(macro)                                                                               \
    macro(0, 0) macro(1, 1) macro(2, 2) macro(3, 3) macro(4, 4) macro(5, 5) macro(6, 6)            \
        macro(7, 7) macro(any, ANY)

#define PUT(kind, degree)                                                                          \
    static mdl_status rise_##kind(mdl_traj *traj, mdl_real x, mdl_real *y_um)                      \
    {                                                                                              \
        return put(traj, x, y_um, 0, degree);                                                      \
    }                                                                                              \
    static mdl_status fall_##kind(mdl_traj *traj, mdl_real x, mdl_real *y_um)                      \
    {                                                                                              \
        return put(traj, x, y_um, 1, degree);                                                      \
    }

EVERY(PUT)

static mdl_status at_minimum(mdl_traj *traj, mdl_real x, mdl_real *y_um)
{
    *y_um = traj->f0_min_um;
    traj->last.x.real = x;
    traj->last.y_um = *y_um;
    return MDL_OK;
}

/* ---- inputs outside the identified range, and what follows them; a full memory ---- */

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

static void set_limits(mdl_traj *traj)
{
    mdl_tp_stack *left = &traj->left;
    mdl_tp_stack *right = &traj->right;
    mdl_key end = traj->range_end;
    if (is_below(traj->last.x.bits, end) && (held(left) == 0 || is_below(left->tp->x.bits, end)) &&
        (held(right) == 0 || is_below(right->tp->x.bits, end))) {
        traj->open_end = end;
        left->floor = left->tp + 1;
        right->floor = right->tp + 1;
        left->limit.bits = held(left) > 0 ? left->end[-1].x.bits : 0;
        right->limit.bits = held(right) > 0 ? right->end[-1].x.bits : end;
    } else {
        traj->open_end = 0;
        left->floor = left->tp + MDL_TP_CAPACITY;
        right->floor = right->tp + MDL_TP_CAPACITY;
        left->limit.bits = MDL_KEY_MAX;
        right->limit.bits = ~MDL_KEY_MAX;
    }
}

/* How many turning points of a side x has not surpassed, for reals of any sign. */
static uint_fast16_t count_inside(const mdl_tp_stack *side, mdl_key x, uint16_t down)
{
    uint_fast16_t low = 0;
    uint_fast16_t count = held(side);
    while (count > 0) {
        uint_fast16_t half = count / 2u;
        if (reaches(x, mdl_key_of(side->tp[low + half].x.real), down)) {
            count = half;
        } else {
            low += half + 1u;
            count -= half + 1u;
        }
    }
    return low;
}

/* Records (x_1, y_1) as a turning point, from which the next curve starts. */
MDL_INLINE void record(mdl_traj *traj, uint16_t down)
{
    mdl_tp_stack *from = down ? &traj->right : &traj->left;
    mdl_tp *end = from->end;
    end->y_um = traj->last.y_um;
    end->x = traj->last.x;
    from->limit = end->x;
    from->end = end + 1;
    traj->step = traj->part.step[down];
}

static void keep_pairs(mdl_traj *traj, uint_fast16_t pairs, uint16_t falling)
{
    traj->right.end = traj->right.tp + pairs;
    traj->left.end = traj->left.tp + pairs + 1u - falling;
    traj->step = traj->part.step[falling];
}

MDL_INLINE int is_full(const mdl_traj *traj)
{
    return traj->left.end == traj->left.tp + MDL_TP_CAPACITY;
}

static mdl_status outer_rise(mdl_traj *traj, mdl_real x, mdl_real *y_um)
{
    uint_fast16_t n = count_inside(&traj->right, mdl_key_of(x), 0);
    mdl_status status = MDL_OK;
    if (n < held(&traj->right)) {
        keep_pairs(traj, n, 0);
    } else if (is_falling(traj) && is_full(traj)) {
        status = MDL_MEMORY_FULL; /* to and fro on the descending curve */
    } else if (is_falling(traj)) {
        record(traj, 0);
    }
    (void)(is_falling(traj) ? fall_any : rise_any)(traj, x, y_um);
    return status;
}

static void outer_fall(mdl_traj *traj, mdl_real x, mdl_real *y_um)
{
    uint_fast16_t n = count_inside(&traj->left, mdl_key_of(x), 1);
    if (n < held(&traj->left) || n == 0) {
        keep_pairs(traj, n, 1);
    } else if (!is_falling(traj)) {
        record(traj, 1);
    }
    if (n > 0) {
        (void)fall_any(traj, x, y_um);
    } else {
        /* At or below the minimum: the descending curve that starts at the end of the range. */
        mdl_real fall = mdl_major_swing(traj->major, x, traj->major->range_volts);
        traj->last.x.real = x;
        traj->last.y_um = *y_um = traj->f0_min_um - (fall - traj->full_swing_um);
    }
}

MDL_APART mdl_status outer_step(mdl_traj *traj, mdl_real x, mdl_real *y_um)
{
    unsigned status = MDL_OK;
    mdl_key key, last;
    *y_um = traj->last.y_um;
    x += MDL_C(0.0); /* -0 becomes +0, whose key is 0 */
    if (!mdl_is_finite(x)) {
        return MDL_ERR_NOT_FINITE;
    }
    if (x < MDL_C(0.0) || x > traj->major->range_volts) {
        status = (unsigned)limit(traj, &x);
    }
    key = mdl_key_of(x);
    last = mdl_key_of(traj->last.x.real);
    if (key > last) {
        status |= (unsigned)outer_rise(traj, x, y_um);
    } else if (key < last) {
        outer_fall(traj, x, y_um);
    }
    set_limits(traj);
    return (mdl_status)status;
}

/* ---- inputs in the range ---- */

/* A step of the search: all before base are not surpassed. */
#define HALVE(step)                                                                                \
    if (!reaches(x, base[(step)-1].x.bits, down)) {                                                \
        base += (step);                                                                            \
    }

/*
 * One past the last turning point of a side that x has not surpassed: eqs. (12) and (13), read with
 * their misprints corrected. The curve is that of D_f(k-1) where D_fk is printed. (12) rests on the
 * chain x_A0 < x_A2 < ... < x_Am < x; (13) holds for x_A(k-2) < x <= x_Ak, and its last row is
 * D_f1. The newest two are known to be surpassed, unless there are fewer. The third is tried
 * first, because an input seldom surpasses more. The binary search of the others is unrolled and
 * without branches: first a part whose length is a power of two, then halves of it.
 */
MDL_INLINE mdl_tp *search(const mdl_tp_stack *side, mdl_key x, uint16_t down)
{
    mdl_tp *base = side->tp;
    uint_fast16_t count = held(side);
    uint_fast16_t power;
    if (count < 3u) {
        return base;
    }
    if (!reaches(x, side->end[-3].x.bits, down)) {
        return side->end - 2;
    }
    count -= 2u;
    power = count < 32u ? 16u : MDL_TP_CAPACITY / 2u;
    while (power > count) {
        power /= 2u;
    }
    if (!reaches(x, base[power - 1u].x.bits, down)) {
        base = side->end - 1 - power;
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
        return base;
    }
}

/* Wipes out what x has surpassed; the innermost turning points that are left are the limits. */
MDL_INLINE void wipe_out(mdl_traj *traj, mdl_key x, uint16_t down)
{
    mdl_tp_stack *from = down ? &traj->right : &traj->left;
    mdl_tp_stack *to = down ? &traj->left : &traj->right;
    mdl_tp *end = search(to, x, down);
    traj->step = traj->part.step[down];
    to->end = end;
    to->limit.bits = end > to->tp ? end[-1].x.bits : down ? 0 : traj->range_end;
    end = from->tp + (end - to->tp) + (down ? 0 : 1);
    from->end = end;
    from->limit.bits = !down || end > from->tp ? end[-1].x.bits : traj->range_end;
}

MDL_APART mdl_status wipe_up(mdl_traj *traj, mdl_real_bits x, mdl_real *y_um)
{
    if (!is_below(x.bits, traj->open_end)) {
        return outer_step(traj, x.real, y_um);
    }
    wipe_out(traj, x.bits, 0);
    return traj->part.put[0](traj, x.real, y_um);
}

MDL_APART mdl_status wipe_down(mdl_traj *traj, mdl_real_bits x, mdl_real *y_um)
{
    if (!is_below(x.bits, traj->open_end)) {
        return outer_step(traj, x.real, y_um);
    }
    wipe_out(traj, x.bits, 1);
    return (traj->left.end > traj->left.tp ? traj->part.put[1] : at_minimum)(traj, x.real, y_um);
}

/*
 * x reaches the limit of the side that it moves to. Seldom more is surpassed than the innermost
 * pair: the point there and the one after it, which is not recorded yet if it is (x_1, y_1). Only
 * this is done here; 0: something else is to be done.
 */
MDL_INLINE int surpass(mdl_traj *traj, mdl_key x, uint16_t down, uint16_t falling)
{
    mdl_tp_stack *from = down ? &traj->right : &traj->left;
    mdl_tp_stack *to = down ? &traj->left : &traj->right;
    mdl_tp *end = to->end;
    if (end <= to->floor || reaches(x, end[-2].x.bits, down)) {
        return 0;
    }
    to->limit.bits = end[-2].x.bits;
    to->end = end - 1;
    if (falling == down) {
        end = from->end - 1;
        from->limit.bits = end[-1].x.bits;
        from->end = end;
    } else {
        traj->step = traj->part.step[down];
    }
    return 1;
}

/* The same input again. */
static mdl_status stay(mdl_traj *traj, mdl_real x, mdl_real *y_um)
{
    if (traj->open_end == 0) {
        return outer_step(traj, x, y_um);
    }
    *y_um = traj->last.y_um;
    return MDL_OK;
}

/*
 * A step from a curve. An input that moves against the curve has changed its direction, eq. (10):
 * (x_1, y_1) is a right turning point if x - x_1 < 0 (printed as x - x_2 < 0).
 */
MDL_INLINE mdl_status step(mdl_traj *traj, mdl_real x_volts, mdl_real *y_um, uint16_t falling,
                           uint16_t degree)
{
    mdl_real_bits x;
    mdl_key last = traj->last.x.bits;
    x.real = x_volts;
    if (x.bits > last) {
        if (x.bits >= traj->right.limit.bits) {
            if (!surpass(traj, x.bits, 0, falling)) {
                return wipe_up(traj, x, y_um);
            }
        } else if (falling) {
            if (is_full(traj)) {
                return outer_step(traj, x_volts, y_um);
            }
            record(traj, 0);
        }
        return put(traj, x_volts, y_um, 0, degree);
    }
    if (x.bits == last) {
        return stay(traj, x_volts, y_um);
    }
    if (x.bits <= traj->left.limit.bits) {
        if (!surpass(traj, x.bits, 1, falling)) {
            return wipe_down(traj, x, y_um);
        }
    } else if (!falling) {
        record(traj, 1);
    }
    return put(traj, x_volts, y_um, 1, degree);
}

#define STEP(kind, degree)                                                                         \
    static mdl_status rising_##kind(mdl_traj *traj, mdl_real x, mdl_real *y_um)                    \
    {                                                                                              \
        return step(traj, x, y_um, 0, degree);                                                     \
    }                                                                                              \
    static mdl_status falling_##kind(mdl_traj *traj, mdl_real x, mdl_real *y_um)                   \
    {                                                                                              \
        return step(traj, x, y_um, 1, degree);                                                     \
    }

#define PARTS(kind, degree) {{rising_##kind, falling_##kind}, {rise_##kind, fall_##kind}},

EVERY(STEP)

static const mdl_traj_parts parts_of[] = {EVERY(PARTS)};

mdl_status mdl_traj_step(mdl_traj *traj, mdl_real x_volts, mdl_real *y_um)
{
    return traj->step(traj, x_volts, y_um);
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
    traj->left.tp = left->tp;
    traj->right.tp = right->tp;
    traj->margin_volts = margin_volts;
    traj->range_end = mdl_key_of(major->range_volts) + 1;
    traj->part = parts_of[major->kind == MDL_POLYNOMIAL && major->shape == 0 &&
                                  major->degree <= MDL_DEGREE_UNROLLED
                              ? major->degree
                              : ANY];
    memcpy(traj->c, major->c, sizeof traj->c);
    traj->f0_min_um = major->at_zero_um;
    traj->full_swing_um = mdl_major_swing(major, MDL_C(0.0), major->range_volts);
    mdl_traj_reset(traj);
    return MDL_OK;
}

void mdl_traj_reset(mdl_traj *traj)
{
    traj->last.x.real = MDL_C(0.0);
    traj->last.y_um = traj->f0_min_um;
    *traj->left.tp = traj->last;
    keep_pairs(traj, 0, 0);
    set_limits(traj);
}

uint32_t mdl_traj_turning_points(const mdl_traj *traj)
{
    return (uint32_t)held(&traj->right) + (uint32_t)held(&traj->left);
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
    *saved++ = (mdl_real)held(&traj->right);
    *saved++ = (mdl_real)is_falling(traj);
    *saved++ = traj->last.x.real;
    *saved++ = traj->last.y_um;
    saved = save_points(saved, traj->left.tp, held(&traj->left));
    (void)save_points(saved, traj->right.tp, held(&traj->right));
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
    keep_pairs(traj, (uint_fast16_t)saved[0], (uint16_t)saved[1]);
    traj->last.x.real = saved[2] + MDL_C(0.0);
    traj->last.y_um = saved[3];
    saved = resume_points(traj->left.tp, saved + 4, held(&traj->left));
    (void)resume_points(traj->right.tp, saved, held(&traj->right));
    set_limits(traj);
    return MDL_OK;
}
