// loop_hold.c: faults that the loop must not work with, and how it stops for a person (6.3, human supervisor).
//
// After each step the measurements are checked: age, arms, the clock. The first fault raises an alarm. The loop then
// stops all arms, tells its listeners why in one sentence, and waits for a person; without one it ends as
// OM_RETRACT_HELD. Jaws that close or open complete their motion, so that the loop knows what it holds.
#include <math.h>
#include <stdarg.h>
#include <string.h>

#include "loop/loop_state.h"

void om__loop_alarm(OmLoop* loop, OmHold hold, const char* format, ...) {
    if (loop->alarm != OM_HOLD_NONE) return;
    loop->alarm = hold;
    va_list list;
    va_start(list, format);
    vsnprintf(loop->alarm_text, sizeof loop->alarm_text, format, list);
    va_end(list);
}

// ---- checks -------------------------------------------------------------------------------------------------

static void check_clock(OmLoop* loop, double now) {
    loop->standing = now > loop->belief.clock_last ? 0 : loop->standing + loop->task.time_step;
    loop->belief.clock_last = now;
    if (loop->belief.max_age > 0 && loop->standing > loop->belief.max_age)
        om__loop_alarm(loop, OM_HOLD_STALE,
                       "nothing new was measured for %.2f s: the world's clock stands still",
                       loop->standing);
}

static void check_arms(OmLoop* loop, const OmObservation* obs) {
    if (obs->narm < loop->act.narm)
        om__loop_alarm(loop, OM_HOLD_TOOL, "%d of %d arms are measured", obs->narm, loop->act.narm);
    for (int a = 0; a < loop->act.narm && a < obs->narm; ++a) {
        const double age = obs->time - obs->arm[a].time;
        if (!om_is_finite3(obs->arm[a].tip.p))
            om__loop_alarm(loop, OM_HOLD_TOOL, "the tip of PSM%d is not measured", a + 1);
        else if (age > loop->belief.max_age)
            om__loop_alarm(loop, OM_HOLD_TOOL, "PSM%d was last measured %.2f s ago", a + 1, age);
    }
}

static void check_lag(OmLoop* loop) {
    if (loop->max_lag <= 0) return;
    const double now = om_clock_now();
    if (!loop->has_lag_origin) loop->lag_origin = now - loop->act.time;
    loop->has_lag_origin = true;
    const double lag = now - loop->lag_origin - loop->act.time;
    if (lag > loop->max_lag)
        om__loop_alarm(loop, OM_HOLD_LATE, "the twin is %.2f s behind real time", lag);
}

void om__loop_check_observation(OmLoop* loop, const OmObservation* obs, bool has_picture) {
    check_lag(loop);
    check_clock(loop, obs->time);
    if (loop->belief.max_age <= 0) return;
    check_arms(loop, obs);
    if (has_picture && loop->look_age > loop->belief.max_age)
        om__loop_alarm(loop, OM_HOLD_STALE, "the endoscope's picture is %.2f s old",
                       loop->look_age);
}

// ---- the hold ---------------------------------------------------------------------------------------------------

static void end_held(OmLoop* loop, const char* reason) {
    OmRetractResult* r = &loop->result;
    om__loop_go(loop, STAGE_ENDED);
    r->outcome = OM_RETRACT_HELD;
    snprintf(r->reason, sizeof r->reason,
             "stopped for a person after %d actions and %.1f s: %.160s", r->naction, loop->act.time,
             reason);
}

OmStatus om__loop_check_hold(OmLoop* loop) {
    if (loop->alarm == OM_HOLD_NONE) return OM_OK;
    const OmHold hold = loop->alarm;
    loop->alarm = OM_HOLD_NONE;
    if (loop->stage == STAGE_ENDED || loop->stage == STAGE_HOLD) return OM_OK;
    om__act_stop(&loop->act);
    loop->hold = loop->result.hold = hold;
    ++loop->result.nhold;
    snprintf(loop->hold_text, sizeof loop->hold_text, "%s", loop->alarm_text);
    const bool continues = loop->is_attended && om__loop_moves_jaw(loop);
    if (loop->stage == STAGE_ACTION && !continues) {
        OM_TRY(om__loop_break_action(loop, OM_ACTION_HELD));
        loop->held_stage = STAGE_PLAN;
    } else {
        loop->held_stage = loop->stage;
    }
    om__loop_go(loop, STAGE_HOLD);
    OM_TRY(om__loop_notify_hold(loop, hold, loop->alarm_text));
    if (!loop->is_attended) end_held(loop, loop->alarm_text);
    return OM_OK;
}

// The person has seen to the cause: what was measured before does not count any more.
OmStatus om__loop_end_hold(OmLoop* loop) {
    loop->belief.warn.is_overruled = loop->hold == OM_HOLD_WARNING;
    loop->hold = OM_HOLD_NONE;
    om__loop_go(loop, loop->held_stage);
    loop->standing = 0;
    loop->has_lag_origin = false;
    loop->belief.nfailed = 0;
    bool is_in_motion = loop->stage == STAGE_ACTION && loop->act.action.nwait == 0;
    return is_in_motion ? om__motion_resume(&loop->act) : OM_OK;
}
