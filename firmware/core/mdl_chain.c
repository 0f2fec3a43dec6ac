#include "mdl_chain.h"

#include <string.h>

#include "mdl_power.h"

#define SUBSTEPS_MAX 64u

static int acts(const mdl_chain *chain, uint16_t block)
{
    return (chain->params->blocks & block) != 0;
}

#define COUNT(array) ((uint16_t)(sizeof(array) / sizeof(array)[0]))

static mdl_status judge(const mdl_real *v, uint16_t count, int are_in_range)
{
    if (!mdl_all_finite(v, count)) {
        return MDL_ERR_NOT_FINITE;
    }
    return are_in_range ? MDL_OK : MDL_ERR_PARAMETER;
}

static mdl_status check_saturation(const mdl_saturation_params *p)
{
    const mdl_real v[] = {p->high_volts, p->low_volts, p->knee_volts, p->knee_power};
    int is_apart =
        p->knee_volts > MDL_C(0.0) && p->knee_volts <= MDL_C(0.5) * (p->high_volts - p->low_volts);
    int is_power = p->knee_power >= MDL_C(1.0) && p->knee_power <= MDL_C(32.0) && !p->parabolic;
    return judge(v, COUNT(v),
                 p->low_volts < p->high_volts && p->knee_volts >= MDL_C(0.0) &&
                     p->parabolic <= 1u && (!p->parabolic || is_apart) &&
                     (p->knee_power == MDL_C(0.0) || (is_power && is_apart)));
}

static mdl_status check_slew(const mdl_slew_params *p)
{
    const mdl_real v[] = {p->rise_volts, p->fall_volts, p->knee_volts, p->decay, p->early};
    return judge(v, COUNT(v),
                 p->rise_volts > MDL_C(0.0) && p->fall_volts > MDL_C(0.0) &&
                     p->knee_volts >= MDL_C(0.0) && p->decay >= MDL_C(0.0) &&
                     p->decay <= MDL_C(1.0) && p->early >= MDL_C(0.0) && p->early <= MDL_C(1.0));
}

/* Outside its range a lag may not settle. */
static mdl_status check_lag(const mdl_lag_params *p)
{
    const mdl_real v[] = {p->decay, p->ramp};
    return judge(v, COUNT(v),
                 p->decay >= MDL_C(0.0) && p->decay <= MDL_C(1.0) && p->ramp >= MDL_C(0.0) &&
                     p->ramp <= MDL_C(1.0));
}

static mdl_status check_load(const mdl_chain_params *p)
{
    const mdl_real v[] = {p->load_lean, p->load_slope.decay, p->load_slope.ramp, p->load_bend.decay,
                          p->load_bend.ramp};
    uint16_t i;
    mdl_status status = check_lag(&p->lag);
    for (i = 0; status == MDL_OK && i < COUNT(v); i++) {
        status = judge(v + i, 1, mdl_size(v[i]) <= (i == 0 ? MDL_C(0.5) : MDL_C(4.0)));
    }
    return status;
}

static mdl_status check_relax(const mdl_relax_params *p)
{
    const mdl_real v[] = {p->decay, p->early, p->pull};
    return judge(v, COUNT(v),
                 p->decay >= MDL_C(0.0) && p->decay <= MDL_C(1.0) && p->early >= MDL_C(0.0) &&
                     p->early <= MDL_C(0.5) && p->pull >= MDL_C(0.0) &&
                     (p->decay == MDL_C(1.0)) == (p->pull > MDL_C(0.0)));
}

static mdl_status check_rate(const mdl_rate_params *p)
{
    const mdl_real v[] = {p->v_scale,  p->power,           p->v_knee,   p->at_knee, p->damping_um,
                          p->widening, p->threshold_volts, p->swelling, p->lean};
    mdl_status status = check_lag(&p->filter);
    if (status == MDL_OK) {
        status = check_relax(&p->relax);
    }
    return status != MDL_OK
               ? status
               : judge(v, COUNT(v),
                       p->power > MDL_C(0.0) && p->power <= MDL_C(4.0) && p->v_knee >= MDL_C(0.0) &&
                           p->widening >= MDL_C(0.0) && p->threshold_volts >= MDL_C(0.0) &&
                           p->swelling >= MDL_C(0.0) &&
                           (p->widening == MDL_C(0.0) || p->relax.decay == MDL_C(0.0)));
}

static mdl_status check_envelope(const mdl_envelope_params *p)
{
    const mdl_real v[] = {p->per_volt,   p->rise_volts, p->rise_skew,
                          p->fall_volts, p->fall_skew,  p->follow};
    return judge(v, COUNT(v),
                 p->per_volt > MDL_C(0.0) && p->rise_volts >= MDL_C(0.0) &&
                     mdl_size(p->rise_skew) <= MDL_C(1.0) && p->fall_volts >= MDL_C(0.0) &&
                     mdl_size(p->fall_skew) <= MDL_C(1.0) && p->follow >= MDL_C(0.0) &&
                     p->follow <= MDL_C(1.0));
}

static mdl_status check_bouc(const mdl_bouc_params *p)
{
    const mdl_real v[] = {p->size_um, p->per_volt, p->power, p->gamma};
    return judge(v, COUNT(v),
                 p->per_volt >= MDL_C(0.0) && p->power >= MDL_C(1.0) && p->power <= MDL_C(4.0) &&
                     p->gamma >= MDL_C(-0.9) && p->gamma <= MDL_C(1.0));
}

static mdl_status check_creep(const mdl_chain_params *p)
{
    mdl_status status = MDL_OK;
    uint16_t i;
    for (i = 0; status == MDL_OK && i < p->creep_count; i++) {
        status = mdl_is_finite(p->creep[i].gain) ? check_lag(&p->creep[i].lag) : MDL_ERR_NOT_FINITE;
    }
    return status;
}

static mdl_status check_modes(const mdl_chain_params *p)
{
    mdl_status status = MDL_OK;
    uint16_t i;
    for (i = 0; status == MDL_OK && i < p->mode_count; i++) {
        const mdl_mode_params *m = &p->mode[i];
        const mdl_real v[] = {m->phi[0][0], m->phi[0][1], m->phi[1][0], m->phi[1][1],
                              m->gamma[0],  m->gamma[1],  m->share};
        status = judge(v, COUNT(v), 1);
    }
    return status;
}

static mdl_status check_backlash(const mdl_chain_params *p)
{
    const mdl_real v[] = {p->dead_band_um, p->spread, p->spring_share};
    return judge(v, COUNT(v),
                 p->dead_band_um >= MDL_C(0.0) && p->spread >= MDL_C(0.0) &&
                     p->spread <= MDL_C(1.0) && p->spring_share >= MDL_C(0.0) &&
                     p->spring_share <= MDL_C(1.0));
}

static mdl_status check_yang(const mdl_chain_params *p)
{
    return p->yang != 0 ? mdl_yang_check(p->yang) : MDL_ERR_PARAMETER;
}

/* The first of the blocks that act whose parameters are not in their documented range says why. */
static mdl_status check_blocks(const mdl_chain_params *p)
{
    const mdl_real sensor[] = {p->gain, p->offset_um};
    mdl_status status = MDL_OK;
#define CHECK(block, checked)                                                                      \
    if (status == MDL_OK && (p->blocks & (block)) != 0) {                                          \
        status = checked;                                                                          \
    }
    CHECK(MDL_BLOCK_SATURATION, check_saturation(&p->saturation))
    CHECK(MDL_BLOCK_SLEW, check_slew(&p->slew))
    CHECK(MDL_BLOCK_LAG, check_load(p))
    CHECK(MDL_BLOCK_ENVELOPE, check_envelope(&p->envelope))
    CHECK(MDL_BLOCK_RATE, check_rate(&p->rate))
    CHECK(MDL_BLOCK_BOUC, check_bouc(&p->bouc))
    CHECK(MDL_BLOCK_YANG, check_yang(p))
    CHECK(MDL_BLOCK_CREEP, check_creep(p))
    CHECK(MDL_BLOCK_BEHIND, check_lag(&p->behind))
    CHECK(MDL_BLOCK_MODES, check_modes(p))
    CHECK(MDL_BLOCK_BACKLASH, check_backlash(p))
    CHECK(MDL_BLOCK_DELAY, judge(p->delay.weight, COUNT(p->delay.weight), 1))
    CHECK(MDL_BLOCK_GAIN, judge(sensor, COUNT(sensor), 1))
#undef CHECK
    return status;
}

static mdl_status check(const mdl_chain_params *p)
{
    if (!mdl_is_finite(p->u_min_volts) || !mdl_is_finite(p->smooth)) {
        return MDL_ERR_NOT_FINITE;
    }
    if (p->substeps > SUBSTEPS_MAX || !(p->smooth >= MDL_C(0.0) && p->smooth <= MDL_C(1.0))) {
        return MDL_ERR_PARAMETER;
    }
    if (p->creep_count > MDL_CREEP_MODES_MAX || p->mode_count > MDL_MODES_MAX ||
        p->delay.whole > MDL_DELAY_MAX - 4) {
        return MDL_ERR_CAPACITY;
    }
    return check_blocks(p);
}

mdl_status mdl_chain_init(mdl_chain *chain, const mdl_chain_params *params, mdl_tp_side *left,
                          mdl_tp_side *right)
{
    mdl_status status = check(params);
    if (status == MDL_OK) {
        status = mdl_traj_init(&chain->traj, &params->major, left, right, params->margin_volts);
    }
    if (status == MDL_OK) {
        chain->params = params;
        mdl_plays_make(&chain->plays, &params->major);
        mdl_chain_reset(chain);
    }
    return status;
}

static mdl_real saturated(const mdl_chain *chain, mdl_real u)
{
    return acts(chain, MDL_BLOCK_SATURATION) ? mdl_saturation(&chain->params->saturation, u) : u;
}

/*
 * The command, limited to where the hysteresis is extrapolated to: the blocks before it, which are
 * linear, would pass on a huge one for long, or overflow.
 */
static mdl_status limit(const mdl_chain *chain, mdl_real *u_volts)
{
    const mdl_chain_params *p = chain->params;
    mdl_real low = p->u_min_volts - p->margin_volts;
    mdl_real high = p->u_min_volts + (p->major.range_volts + p->margin_volts);
    if (acts(chain, MDL_BLOCK_YANG)) {
        low = p->yang->low_volts - p->yang->margin_volts;
        high = p->yang->high_volts + p->yang->margin_volts;
    }
    if (*u_volts >= low && *u_volts <= high) {
        return MDL_OK;
    }
    *u_volts = *u_volts < low ? low : high;
    return MDL_CLAMPED;
}

/* What the part by Bouc and Wen adds, um. */
static mdl_real bouc(mdl_chain *chain, mdl_real x)
{
    return acts(chain, MDL_BLOCK_BOUC) ? mdl_bouc_step(&chain->at.bouc, &chain->params->bouc, x)
                                       : MDL_C(0.0);
}

/*
 * What the envelopes leave of a drive x above u_min. The operator without a threshold, whose weight
 * is f0'(0), may follow all the same: by how much, um.
 */
static mdl_real enveloped(mdl_chain *chain, mdl_real x, mdl_real *follows_um)
{
    const mdl_chain_params *p = chain->params;
    mdl_real w = x;
    if (acts(chain, MDL_BLOCK_ENVELOPE)) {
        w = mdl_envelope_step(&p->envelope, chain->at.enveloped_volts, x);
        *follows_um = p->envelope.follow * mdl_major_first_slope(&p->major) * (x - w);
    }
    chain->at.enveloped_volts = w;
    return w;
}

/* The hysteresis alone, at rest, to a drive x above u_min. */
static mdl_status lead(mdl_chain *chain, mdl_real x, mdl_real *y)
{
    mdl_real follows_um = MDL_C(0.0);
    mdl_real w = enveloped(chain, x, &follows_um);
    mdl_status status = mdl_traj_step(&chain->traj, w, y);
    if (acts(chain, MDL_BLOCK_RATE)) { /* else nobody reads them */
        (void)mdl_plays_step(&chain->at.plays, &chain->plays, w, MDL_C(0.0));
    }
    *y += follows_um + bouc(chain, x);
    return status;
}

mdl_status mdl_chain_lead(mdl_chain *chain, mdl_real u_volts)
{
    int status;
    mdl_real y;
    if (!mdl_is_finite(u_volts - chain->params->u_min_volts)) {
        return MDL_ERR_NOT_FINITE;
    }
    status = limit(chain, &u_volts);
    status |= lead(chain, saturated(chain, u_volts) - chain->params->u_min_volts, &y);
    return (mdl_status)status;
}

/* Where the drive was at a command before it came to rest, above u_min. */
static mdl_real rested(const mdl_chain *chain, mdl_real u)
{
    const mdl_chain_params *p = chain->params;
    return (p->rest_free ? u : saturated(chain, u)) - p->u_min_volts;
}

void mdl_chain_reset(mdl_chain *chain)
{
    const mdl_chain_params *p = chain->params;
    mdl_real y;
    mdl_traj_reset(&chain->traj);
    memset(&chain->at, 0, sizeof chain->at);
    mdl_plays_reset(&chain->at.plays, &chain->plays);
    chain->at.delayed_um = p->major.at_zero_um;
    mdl_delay_reset(&chain->delay, MDL_C(0.0));
    chain->started = 0;
    if (acts(chain, MDL_BLOCK_SATURATION) || acts(chain, MDL_BLOCK_BOUC)) {
        (void)lead(chain, rested(chain, p->u_min_volts + p->major.range_volts), &y);
        (void)lead(chain, rested(chain, p->u_min_volts), &y);
        chain->at.bouc.rest = chain->at.bouc.z;
    }
}

/* Creep box: the displacement, and its share that follows slowly. */
static mdl_real creep(mdl_chain *chain, mdl_real y)
{
    const mdl_chain_params *p = chain->params;
    mdl_real rise = y - chain->at.hysteresis_um;
    mdl_real slow = MDL_C(0.0);
    uint16_t i;
    chain->at.hysteresis_um = y;
    for (i = 0; i < p->creep_count; i++) {
        mdl_real e = mdl_lag_step(&chain->at.creep[i], &p->creep[i].lag, rise);
        slow += p->creep[i].gain * (y - p->major.at_zero_um + e);
    }
    return y + slow;
}

/* Behind the gap: what its play leaves, and what a spring carries across of y. */
static mdl_real across(const mdl_chain *chain, mdl_real target_um, mdl_real y)
{
    return target_um + chain->params->spring_share * (y - target_um);
}

/* Every dynamic state in equilibrium at u, which was reached from u_min without a turn. */
static mdl_status start(mdl_chain *chain, mdl_real u)
{
    const mdl_chain_params *p = chain->params;
    uint16_t i;
    mdl_status status;
    mdl_real v = saturated(chain, u);
    mdl_real y = MDL_C(0.0);
    status = acts(chain, MDL_BLOCK_YANG) ? mdl_yang_start(&chain->at.yang, p->yang, v, &y)
                                         : lead(chain, v - p->u_min_volts, &y);
    chain->at.u_volts = u;
    chain->at.clipped_volts = v;
    chain->at.slewed_volts = v;
    chain->at.drive_volts = v;
    chain->at.gripped_volts = chain->at.enveloped_volts;
    chain->at.hysteresis_um = y;
    mdl_lag_reset(&chain->at.lag);
    mdl_lag_reset(&chain->at.velocity);
    mdl_lag_reset(&chain->at.speed);
    for (i = 0; i < MDL_CREEP_MODES_MAX; i++) {
        mdl_lag_reset(&chain->at.creep[i]);
    }
    y = acts(chain, MDL_BLOCK_CREEP) ? creep(chain, y) : y;
    chain->at.crept_um = y;
    mdl_lag_reset(&chain->at.behind);
    chain->at.settled_um = y;
    for (i = 0; i < MDL_MODES_MAX; i++) {
        mdl_mode_reset(&chain->at.mode[i]);
    }
    if (acts(chain, MDL_BLOCK_BACKLASH)) {
        y = across(chain, mdl_contact_start(&chain->at.contact, p->dead_band_um, p->spread, y), y);
    }
    mdl_delay_reset(&chain->delay, y);
    chain->at.delayed_um = y;
    chain->started = 1;
    return status;
}

/* The amplifier's lag at a voltage of the drive. */
static mdl_lag_params loaded(const mdl_chain *chain, mdl_real v)
{
    const mdl_chain_params *p = chain->params;
    mdl_lag_params now = p->lag;
    if (p->load_lean != MDL_C(0.0)) {
        mdl_real x = v - p->u_min_volts;
        mdl_real z = MDL_C(2.0) * x / p->major.range_volts - MDL_C(1.0);
        mdl_real more = p->load_lean * mdl_limited(z, MDL_C(-1.0), MDL_C(1.0));
        mdl_real w = -more / (MDL_C(1.0) + more);
        now.decay += w * (p->load_slope.decay + w * p->load_bend.decay);
        now.ramp += w * (p->load_slope.ramp + w * p->load_bend.ramp);
        now.decay =
            mdl_limited(now.decay, MDL_C(0.0), MDL_C(1.0)); /* where rounding leaves its range */
        now.ramp = mdl_limited(now.ramp, MDL_C(0.0), MDL_C(1.0));
    }
    return now;
}

/*
 * (1 + x) ln(1 + x) / x - 1 for x in [-1, 0]. A series near 0, where the logarithm of what is near
 * 1 has no digits left.
 */
static mdl_real past(mdl_real x)
{
    mdl_real rest = MDL_C(1.0) + x;
    if (x > MDL_C(-0.03)) {
        mdl_real tail = MDL_C(0.05) - x / MDL_C(30.0);
        tail = MDL_C(1.0) / MDL_C(6.0) - x * (MDL_C(1.0) / MDL_C(12.0) - x * tail);
        return x * (MDL_C(0.5) - x * tail);
    }
    return rest > MDL_C(0.0) ? rest * MDL_LN_2 * mdl_log2(rest) / x - MDL_C(1.0) : MDL_C(-1.0);
}

/*
 * Where the lag's output meets the command, which moves evenly from one voltage to another, it
 * turns: a turning point between the samples, which the trajectory is led to. With e = output -
 * command and a = exp(-h / tau) this is tau ln((e[1] - e[0]) / (e[1] - a e[0])) into the step, and
 * e[0] past(x) beyond the output before it, x = (1 - a) e[0] / (e[1] - e[0]).
 */
static mdl_status lead_to_turn(mdl_chain *chain, const mdl_lag_params *lag, mdl_real e,
                               mdl_real from, mdl_real to)
{
    mdl_real now = chain->at.lag.e;
    if (e * now < MDL_C(0.0) &&
        !acts(chain, MDL_BLOCK_RATE | MDL_BLOCK_YANG)) { /* these step in time, by substeps */
        mdl_real v = from + e + e * past(lag->decay * e / (now - e));
        if ((v - from - e) * (v - to - now) > MDL_C(0.0)) { /* beyond both ends of the step */
            mdl_real y;
            return lead(chain, v - chain->params->u_min_volts, &y);
        }
    }
    return MDL_OK;
}

/* Input box: saturation, slew limit, amplifier lag. */
static mdl_status drive(mdl_chain *chain, mdl_real u, mdl_real *driven_volts)
{
    const mdl_chain_params *p = chain->params;
    mdl_status status = MDL_OK;
    mdl_real v = saturated(chain, u);
    mdl_real before = chain->at.slewed_volts;
    mdl_real e = chain->at.lag.e;
    if (acts(chain, MDL_BLOCK_SLEW)) {
        mdl_real rise = v - chain->at.clipped_volts;
        chain->at.clipped_volts = v;
        v = mdl_slew(&p->slew, before, v, rise);
    }
    chain->at.slewed_volts = v;
    if (acts(chain, MDL_BLOCK_LAG)) {
        mdl_lag_params lag = loaded(chain, chain->at.drive_volts);
        if (p->load_lean != MDL_C(0.0)) { /* as it is in the middle of the step */
            mdl_lag trial = chain->at.lag;
            mdl_real then = v + mdl_lag_step(&trial, &lag, v - before);
            lag = loaded(chain, MDL_C(0.5) * (chain->at.drive_volts + then));
        }
        (void)mdl_lag_step(&chain->at.lag, &lag, v - before);
        status = lead_to_turn(chain, &lag, e, before, v);
        v += chain->at.lag.e;
    }
    *driven_volts = v;
    return status;
}

/*
 * The trajectory with rate dependence: what each of its forms that act does to x and y. The drive
 * has moved by drive_rise, of which the envelopes have let x pass by rise.
 */
static mdl_status with_rate(mdl_chain *chain, mdl_real x, mdl_real drive_rise, mdl_real rise,
                            mdl_real *y)
{
    const mdl_chain_params *p = chain->params;
    mdl_real s = mdl_rate_law(&chain->at.velocity, &p->rate, drive_rise);
    mdl_real g = p->rate.of_speed ? mdl_rate_law(&chain->at.speed, &p->rate, mdl_size(drive_rise))
                                  : mdl_size(s);
    mdl_real held = MDL_C(0.0);
    mdl_real grown = MDL_C(0.0);
    mdl_status status;
    if (p->rate.threshold_volts > MDL_C(0.0) || p->rate.widening > MDL_C(0.0)) {
        mdl_real width = MDL_C(2.0) * p->rate.threshold_volts * g;
        held = x - mdl_backlash_step(width, chain->at.gripped_volts, x);
        x -= held;
        rise = x - chain->at.gripped_volts; /* of what the operators get */
        chain->at.gripped_volts = x;
        if (p->rate.widening > MDL_C(0.0)) {
            grown = mdl_plays_step(&chain->at.plays, &chain->plays, x, p->rate.widening * g);
        }
    }
    if (p->rate.relax.decay > MDL_C(0.0)) {
        grown = mdl_plays_relax(&chain->at.plays, &chain->plays, x, rise, &p->rate.relax);
    }
    status = mdl_traj_step(&chain->traj, x, y);
    if (p->rate.swelling > MDL_C(0.0)) {
        mdl_real middle = MDL_C(0.5) * p->major.range_volts;
        mdl_real slope = chain->traj.full_swing_um / p->major.range_volts;
        mdl_real line =
            p->major.at_zero_um + slope * (middle + (MDL_C(1.0) + p->rate.lean) * (x - middle));
        *y += p->rate.swelling * g * (*y - line);
    }
    /* The operator without a threshold, whose weight is f0'(0), follows all the same. */
    *y += mdl_major_first_slope(&p->major) * held - grown;
    *y += p->rate.damping_um * s;
    return status;
}

/* Hysteresis box: trajectory and rate dependence, or the model of Yang et al. */
static mdl_status hysteresis(mdl_chain *chain, mdl_real v, mdl_real *y)
{
    const mdl_chain_params *p = chain->params;
    mdl_real x = v - p->u_min_volts;
    mdl_real rise = v - chain->at.drive_volts;
    mdl_real follows_um = MDL_C(0.0);
    mdl_real before = chain->at.enveloped_volts;
    mdl_real w;
    mdl_status status;
    chain->at.drive_volts = v;
    if (acts(chain, MDL_BLOCK_YANG)) {
        return mdl_yang_step(&chain->at.yang, p->yang, v, y);
    }
    w = enveloped(chain, x, &follows_um);
    status = acts(chain, MDL_BLOCK_RATE) ? with_rate(chain, w, rise, w - before, y)
                                         : mdl_traj_step(&chain->traj, w, y);
    *y += follows_um + bouc(chain, x);
    return status;
}

/*
 * Mechanics box: the pole behind the hysteresis, flexure modes, backlash. The delay, which
 * commutes, comes last.
 */
static void mechanics(mdl_chain *chain, mdl_real y)
{
    const mdl_chain_params *p = chain->params;
    mdl_real rise = y - chain->at.crept_um;
    chain->at.crept_um = y;
    if (acts(chain, MDL_BLOCK_BEHIND)) {
        y += mdl_lag_step(&chain->at.behind, &p->behind, rise);
        rise = y - chain->at.settled_um;
        chain->at.settled_um = y;
    }
    if (acts(chain, MDL_BLOCK_MODES)) {
        uint16_t i;
        for (i = 0; i < p->mode_count; i++) {
            y += mdl_mode_step(&chain->at.mode[i], &p->mode[i], rise);
        }
    }
    if (acts(chain, MDL_BLOCK_BACKLASH)) {
        y = across(chain, mdl_contact_step(&chain->at.contact, p->dead_band_um, p->spread, y), y);
    }
    chain->at.delayed_um =
        acts(chain, MDL_BLOCK_DELAY) ? mdl_delay_step(&chain->delay, &p->delay, y) : y;
}

static mdl_status substep(mdl_chain *chain, mdl_real u)
{
    mdl_real y = MDL_C(0.0);
    mdl_real v;
    int status = drive(chain, u, &v);
    status |= hysteresis(chain, v, &y);
    mechanics(chain, acts(chain, MDL_BLOCK_CREEP) ? creep(chain, y) : y);
    return (mdl_status)status;
}

/* Sensor: what the measured displacement is now. */
static mdl_real measured(const mdl_chain *chain)
{
    const mdl_chain_params *p = chain->params;
    mdl_real y = chain->at.delayed_um;
    if (acts(chain, MDL_BLOCK_GAIN)) {
        y = p->gain * (y - p->major.at_zero_um) + p->major.at_zero_um + p->offset_um;
    }
    return y;
}

/* Half the bend of the command in this sample: as in the one before, if that was less. */
static mdl_real bend_on(mdl_real turn, mdl_real before)
{
    if ((turn < MDL_C(0.0)) != (before < MDL_C(0.0))) {
        return MDL_C(0.0);
    }
    return MDL_C(0.5) * (mdl_size(turn) < mdl_size(before) ? turn : before);
}

/* Between two samples, a command beyond the range as the farther one of them is, but not more. */
static mdl_real within(const mdl_chain *chain, mdl_real u, mdl_real from, mdl_real to)
{
    mdl_real low = chain->params->u_min_volts;
    mdl_real high = low + chain->params->major.range_volts;
    low = from < low ? from : low;
    low = to < low ? to : low;
    high = from > high ? from : high;
    high = to > high ? to : high;
    return mdl_limited(u, low, high);
}

mdl_status mdl_chain_step(mdl_chain *chain, mdl_real u_volts, mdl_real *y_um)
{
    const mdl_chain_params *p = chain->params;
    int status;
    if (p->blocks == 0) {
        return mdl_traj_step(&chain->traj, u_volts - p->u_min_volts, y_um);
    }
    if (!mdl_is_finite(u_volts - p->u_min_volts)) {
        *y_um = measured(chain);
        return MDL_ERR_NOT_FINITE;
    }
    status = limit(chain, &u_volts);
    if (!chain->started) {
        status |= start(chain, u_volts);
    } else {
        uint16_t n = p->substeps > 1u ? p->substeps : 1u;
        mdl_real from = chain->at.u_volts;
        mdl_real rise = u_volts - from;
        mdl_real turn = rise - chain->at.rise_volts;
        mdl_real bend = p->smooth * bend_on(turn, chain->at.bend_volts);
        mdl_real step = MDL_C(1.0) / (mdl_real)n;
        uint16_t i;
        for (i = 1; i < n; i++) {
            mdl_real f = step * (mdl_real)i;
            mdl_real u = from + f * (rise - bend * (MDL_C(1.0) - f));
            if (bend != MDL_C(0.0)) { /* a straight way does not leave the range */
                u = within(chain, u, from, u_volts);
            }
            status |= substep(chain, u);
        }
        status |= substep(chain, u_volts);
        chain->at.u_volts = u_volts;
        chain->at.rise_volts = rise;
        chain->at.bend_volts = turn;
    }
    *y_um = measured(chain);
    return (mdl_status)status;
}

/* Reals in front of the saved trajectory: started, position in the ring, blocks, ring. */
#define BLOCK_REALS ((uint32_t)(sizeof(mdl_chain_blocks) / sizeof(mdl_real)))
#define OWN_REALS (2u + BLOCK_REALS + MDL_DELAY_MAX)

MDL_STATIC_ASSERT(sizeof(mdl_chain_blocks) % sizeof(mdl_real) == 0, blocks_are_reals);

uint32_t mdl_chain_saved_length(const mdl_chain *chain)
{
    return OWN_REALS + mdl_traj_saved_length(&chain->traj);
}

mdl_status mdl_chain_save(const mdl_chain *chain, mdl_real *saved, uint32_t capacity)
{
    if (capacity < mdl_chain_saved_length(chain)) {
        return MDL_ERR_CAPACITY;
    }
    saved[0] = (mdl_real)chain->started;
    saved[1] = (mdl_real)chain->delay.newest;
    memcpy(saved + 2, &chain->at, sizeof chain->at);
    memcpy(saved + 2 + BLOCK_REALS, chain->delay.ring, sizeof chain->delay.ring);
    return mdl_traj_save(&chain->traj, saved + OWN_REALS, capacity - OWN_REALS);
}

mdl_status mdl_chain_resume(mdl_chain *chain, const mdl_real *saved, uint32_t length)
{
    mdl_status status;
    uint32_t i;
    if (length < OWN_REALS) {
        return MDL_ERR_STATE;
    }
    for (i = 0; i < OWN_REALS; i++) {
        if (!mdl_is_finite(saved[i])) {
            return MDL_ERR_NOT_FINITE;
        }
    }
    if ((saved[0] != MDL_C(0.0) && saved[0] != MDL_C(1.0)) || saved[1] < MDL_C(0.0) ||
        saved[1] >= (mdl_real)MDL_DELAY_MAX || saved[1] != (mdl_real)(uint16_t)saved[1]) {
        return MDL_ERR_STATE;
    }
    status = mdl_traj_resume(&chain->traj, saved + OWN_REALS, length - OWN_REALS);
    if (status == MDL_OK) {
        chain->started = (uint16_t)saved[0];
        chain->delay.newest = (uint16_t)saved[1];
        memcpy(&chain->at, saved + 2, sizeof chain->at);
        memcpy(chain->delay.ring, saved + 2 + BLOCK_REALS, sizeof chain->delay.ring);
    }
    return status;
}
