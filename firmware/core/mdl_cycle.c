#include "mdl_cycle.h"

/* Beyond this count of samples a float can no longer add one. */
#define LONGEST MDL_C(8388608.0)

void mdl_cycle_start(mdl_cycle *cycle, mdl_real v_volts)
{
    cycle->direction = MDL_C(0.0);
    cycle->turn_volts = v_volts;
    cycle->extreme_volts = v_volts;
    cycle->before_volts = v_volts;
    cycle->after_volts = v_volts;
    cycle->last_volts = v_volts;
    cycle->since_turn = MDL_C(0.0);
    cycle->extreme_at = MDL_C(0.0);
    cycle->half = MDL_C(0.0);
    cycle->period = MDL_C(0.0);
    cycle->amplitude_volts = MDL_C(0.0);
}

static void set_extreme(mdl_cycle *cycle, mdl_real v)
{
    cycle->extreme_volts = v;
    cycle->before_volts = cycle->last_volts;
    cycle->extreme_at = cycle->since_turn;
}

/* The extreme was a turn; now the input goes the other way. */
static void turn(mdl_cycle *cycle, mdl_real v)
{
    mdl_real bend = cycle->before_volts - MDL_C(2.0) * cycle->extreme_volts + cycle->after_volts;
    mdl_real skew = cycle->before_volts - cycle->after_volts;
    mdl_real vertex = bend != MDL_C(0.0) ? MDL_C(0.5) * skew / bend : MDL_C(0.0);
    mdl_real at = cycle->extreme_at + vertex;
    mdl_real half = at > MDL_C(1.0) ? at : MDL_C(1.0);
    mdl_real swing = cycle->extreme_volts - cycle->turn_volts;
    cycle->period = half + (cycle->half > MDL_C(0.0) ? cycle->half : half);
    cycle->half = half;
    cycle->amplitude_volts = MDL_C(0.5) * mdl_size(swing);
    cycle->turn_volts = cycle->extreme_volts;
    cycle->since_turn -= at;
    cycle->direction = -cycle->direction;
    set_extreme(cycle, v);
}

int mdl_cycle_step(mdl_cycle *cycle, mdl_real dead_band_volts, mdl_real v_volts)
{
    mdl_real away = v_volts - cycle->turn_volts;
    mdl_real ahead;
    int turned = 0;
    if (cycle->direction == MDL_C(0.0)) {
        cycle->direction = away > dead_band_volts    ? MDL_C(1.0)
                           : away < -dead_band_volts ? MDL_C(-1.0)
                                                     : MDL_C(0.0);
    }
    ahead = cycle->direction * (v_volts - cycle->extreme_volts);
    if (cycle->since_turn < LONGEST) {
        cycle->since_turn += MDL_C(1.0);
    }
    if (cycle->since_turn == cycle->extreme_at + MDL_C(1.0)) {
        cycle->after_volts = v_volts;
    }
    if (ahead > MDL_C(0.0)) {
        set_extreme(cycle, v_volts);
    } else if (-ahead > dead_band_volts) {
        turn(cycle, v_volts);
        turned = 1;
    }
    cycle->last_volts = v_volts;
    return turned;
}
