// loop_decide.c: FRAS and DEFRAS (6.4, 6.5.1) as a state machine: sense, plan, act, until the ROI is exposed. Its
// drawing is in loop_stage.c.
//
// One tick is one step of world and twin, then a decision: stages that need no time follow each other, until a stage
// needs the next tick.
#include <string.h>

#include "base/base_grow.h"
#include "belief/belief_updater.h"
#include "loop/loop_state.h"

// ---- the end ----------------------------------------------------------------------------------------------

// A ROI in view before any action: the scene is no task, and the arms exposed nothing.
static void end_in_view(OmLoop* loop) {
    OmRetractResult* r = &loop->result;
    om__loop_go(loop, STAGE_ENDED);
    r->outcome = OM_RETRACT_IN_VIEW;
    int n = snprintf(r->reason, sizeof r->reason,
                     "nothing to do: %.0f %% of the ROI is in view before any action",
                     100 * loop->act.visibility);
    size_t left = sizeof r->reason - (size_t)n;
    if (r->has_slid)
        snprintf(
            r->reason + n, left,
            "; the tissue slid off by %.0f mm while it settled: attach more of it, or elsewhere",
            1e3 * fmax(r->twin.shift, r->truth.shift));
    else
        snprintf(r->reason + n, left, "; move the ROI further under the tissue");
}

static void end_exposed(OmLoop* loop) {
    OmRetractResult* r = &loop->result;
    om__loop_go(loop, STAGE_ENDED);
    r->outcome = OM_RETRACT_EXPOSED;
    r->is_exposed = true;
    snprintf(r->reason, sizeof r->reason, "%.0f %% of the ROI exposed after %d actions in %.1f s",
             100 * loop->act.visibility, r->naction, loop->act.time);
}

static void end_given_up(OmLoop* loop) {
    OmRetractResult* r = &loop->result;
    om__loop_go(loop, STAGE_ENDED);
    r->outcome = OM_RETRACT_GAVE_UP;
    snprintf(r->reason, sizeof r->reason, "gave up after %d actions with %.0f %% of the ROI seen",
             r->naction, 100 * loop->act.visibility);
}

static void end_without_plan(OmLoop* loop) {
    OmRetractResult* r = &loop->result;
    om__loop_go(loop, STAGE_ENDED);
    r->outcome = OM_RETRACT_NO_PLAN;
    snprintf(
        r->reason, sizeof r->reason,
        "no plan is left after %d actions: every grasping point was tried, is attached or is out of "
        "reach",
        r->naction);
}

static void end_stopped(OmLoop* loop, OmRetractOutcome outcome) {
    OmRetractResult* r = &loop->result;
    om__loop_go(loop, STAGE_ENDED);
    r->outcome = outcome;
    snprintf(r->reason, sizeof r->reason, "%s after %d actions and %.1f s",
             om_retract_outcome_text(outcome), r->naction, loop->act.time);
}

// ---- planning -------------------------------------------------------------------------------------------

// The plan before the operation is the first one, unless something has become known that speaks against it.
static bool may_follow_preplan(const OmLoop* loop) {
    const OmPreplan* p = loop->preplan;
    if (!p || p->chosen < 0 || loop->result.nplan > 0) return false;
    const OmSituation* s = &loop->belief.situation;
    const OmPreplanPoint* point = &p->point[p->chosen];
    return !s->is_fixed[p->chosen] && !(s->tried[p->chosen] & OM_TRIED_GRASP) &&
           !s->is_forbidden[p->chosen] && s->reachable[p->chosen] >> point->arm & 1;
}

static void count_ahead(OmLoop* loop) {
    loop->result.twin.nahead = loop->ahead_count.npoint;
    loop->result.twin.nahead_step = loop->ahead_count.nstep;
}

static OmStatus look_ahead(OmLoop* loop) {
    const OmStatus status =
        om__ahead_run(loop->ahead, &loop->belief, loop->planner, &loop->ahead_count);
    count_ahead(loop);
    return status;
}

OmStatus om__loop_plan(OmLoop* loop) {
    OM_TRY(om__cloud_look(&loop->act, -1));
    om__sense_fluents(&loop->belief, &loop->belief.situation);
    loop->is_preplan = may_follow_preplan(loop);
    OmStatus status = OM_OK;
    if (loop->is_preplan)
        om_preplan_make_plan(loop->preplan, &loop->plan);
    else
        status = look_ahead(loop);
    if (!loop->is_preplan && status >= 0)
        status = om_planner_solve(loop->planner, &loop->belief.situation, &loop->plan);
    if (status < 0) return status;
    OmRetractResult* r = &loop->result;
    OM_GROW(loop->plan_ms, r->nplan, loop->plan_capacity, 16);
    loop->plan_ms[r->nplan++] = 1e3 * (loop->plan.ground_time + loop->plan.solve_time);
    OM_TRY(om__loop_notify_plan(loop));
    return status;
}

static OmStatus decide_plan(OmLoop* loop) {
    if (loop->result.naction >= loop->task.max_actions) {
        end_given_up(loop);
        return OM_OK;
    }
    OmStatus status = om__loop_plan(loop);
    OM_TRY(status);
    bool is_empty = status == OM_UNSAT || loop->plan.naction == 0;
    loop->belief.wants_plan = false;
    if (is_empty && loop->belief.npostponed > 0) {
        loop->belief.attempt_distance *= 0.5;  // allow attempts that are closer together
    } else if (status == OM_TIMEOUT && is_empty) {
        om__loop_alarm(loop, OM_HOLD_PLANNER, "the planner found no plan within its budget");
        OM_TRY(om__loop_check_hold(loop));
    } else if (is_empty) {
        bool is_changed;
        OM_TRY(om__doubt_free(&loop->belief, &is_changed));
        if (!is_changed) end_without_plan(loop);
    } else {
        loop->action_index = loop->act.ncontinued = 0;
        om__loop_go(loop, loop->needs_approval ? STAGE_CONSENT : STAGE_NEXT_ACTION);
    }
    return OM_OK;
}

// ---- actions --------------------------------------------------------------------------------------------

// A pull that has ended and raised the tip by less than half of its way will raise it no further: the arm measures
// itself elsewhere than it steers, by its error of calibration. Without this an arm 2 mm below the height limit pulls
// for ever, and creeps.
static bool has_no_rise(const OmLoop* loop) {
    const Action* a = &loop->act.action;
    const double made = loop->act.arm[a->plan.arm].lift - a->lift;
    return a->outcome == OM_ACTION_DONE && made < 0.5 * a->rise;
}

// Set the fluents `tried` after an attempt that exposed nothing.
static void update_tried(OmLoop* loop) {
    const OmPlanAction* action = &loop->act.action.plan;
    OmActionOutcome outcome = loop->act.action.outcome;
    if (action->block < 0) return;
    loop->belief.exposure[action->block].is_known = false;  // the world has answered
    uint8_t* tried = &loop->belief.tried[action->block];
    bool is_gone = outcome == OM_ACTION_FORCE || outcome == OM_ACTION_UNREACHED;
    if (action->verb == OM_PLAN_MOVE_ROI)
        *tried |= OM_TRIED_MOVE_ROI;
    else if (action->verb == OM_PLAN_MOVE_AWAY)
        *tried |= OM_TRIED_MOVE_AWAY;
    else if (is_gone)
        *tried |= OM_TRIED_GRASP;
    if (outcome == OM_ACTION_FORCE) *tried |= OM_TRIED_GRASP;
    if (action->verb == OM_PLAN_PULL && (outcome == OM_ACTION_UNREACHED || has_no_rise(loop)))
        loop->act.arm[action->arm].is_at_top = true;
    int folds = OM_TRIED_MOVE_ROI | OM_TRIED_MOVE_AWAY;
    if ((*tried & folds) == folds) *tried |= OM_TRIED_GRASP;
    if (outcome == OM_ACTION_FORCE || (*tried & folds) == folds)
        loop->belief.is_exhausted[action->block] = true;
}

static OmStatus note_action(OmLoop* loop) {
    OmRetractResult* r = &loop->result;
    const OmPlanAction* action = &loop->act.action.plan;
    OM_GROW(r->action, r->naction, loop->action_capacity, 32);
    r->action[r->naction++] =
        (OmRetractAction){.verb = action->verb,
                          .arm = action->arm,
                          .block = action->block,
                          .begin = loop->action_begin,
                          .end = loop->act.time,
                          .outcome = loop->act.action.outcome,
                          .visibility = loop->act.visibility,
                          .force_max = loop->has_forces ? loop->force_action : (double)NAN,
                          .force_world_max = loop->truth ? loop->force_world_action : (double)NAN,
                          .is_replanned = loop->action_index == 0 && loop->act.ncontinued == 0,
                          .plan = r->nplan - 1,
                          .turn = loop->act.action.turn};
    return om__loop_notify_action_end(loop);
}

bool om__loop_moves_jaw(const OmLoop* loop) {
    const OmPlanVerb verb = loop->act.action.plan.verb;
    return loop->stage == STAGE_ACTION && (verb == OM_PLAN_GRASP || verb == OM_PLAN_RELEASE);
}

OmStatus om__loop_drop_plan(OmLoop* loop, OmActionOutcome outcome) {
    const bool is_held = loop->stage == STAGE_HOLD;
    if (loop->stage == STAGE_ACTION && !om__loop_moves_jaw(loop)) {
        om__act_stop(&loop->act);
        OM_TRY(om__loop_break_action(loop, outcome));
        om__loop_go(loop, STAGE_PLAN);
        return OM_OK;
    }
    const Stage stage = is_held ? loop->held_stage : loop->stage;
    const bool is_between = stage == STAGE_NEXT_ACTION || stage == STAGE_CONSENT;
    if (is_between && is_held) loop->held_stage = STAGE_PLAN;
    if (is_between && !is_held) om__loop_go(loop, STAGE_PLAN);
    loop->belief.wants_plan = !is_between && stage != STAGE_PLAN;
    return OM_OK;
}

OmStatus om__loop_break_action(OmLoop* loop, OmActionOutcome outcome) {
    OmPlanVerb verb = loop->act.action.plan.verb;
    loop->act.action.outcome = outcome;
    if (verb == OM_PLAN_REACH) loop->act.arm[loop->act.action.plan.arm].at = -1;
    return note_action(loop);
}

// The arms stop and keep their tissue; the unfinished action is recorded.
OmStatus om__loop_stop(OmLoop* loop, OmRetractOutcome outcome) {
    om__act_stop(&loop->act);
    OmStatus status = OM_OK;
    if (loop->stage == STAGE_ACTION) {
        status = om__loop_break_action(loop, OM_ACTION_ABORTED);
    }
    end_stopped(loop, outcome);
    return status;
}

static void begin_verification(OmLoop* loop) {
    om__loop_go(loop, STAGE_VERIFY);
    loop->verify_begin = loop->visible_since = loop->act.time;
}

// An action that does not end as planned ends the plan.
static void leave_action(OmLoop* loop) {
    OmActionOutcome outcome = loop->act.action.outcome;
    if (loop->belief.is_exposed) {
        end_exposed(loop);
        return;
    }
    bool is_last = loop->action_index + 1 == loop->plan.naction;
    bool is_broken = outcome != OM_ACTION_DONE && outcome != OM_ACTION_EXPOSED;
    if ((is_last || is_broken) && outcome != OM_ACTION_WARNED) update_tried(loop);
    bool is_over = loop->result.naction >= loop->task.max_actions;
    bool is_new = is_last || is_broken || is_over || loop->belief.wants_plan ||
                  om__look_is_outdated(&loop->belief);
    loop->belief.wants_plan = false;
    om__loop_go(loop, is_new ? STAGE_PLAN : STAGE_NEXT_ACTION);
    loop->act.ncontinued = 0;
    ++loop->action_index;
}

static void conclude_action(OmLoop* loop, bool* needs_tick) {
    *needs_tick = loop->act.visibility >= loop->task.visibility;
    if (*needs_tick)
        begin_verification(loop);
    else
        leave_action(loop);
}

// After an action, or a step after it: the next one.
static void take_step(OmLoop* loop, AfterStep step, bool* needs_tick) {
    *needs_tick = false;
    switch (step) {
    case AFTER_LOOK:
        om__loop_go(loop, STAGE_LOOK);
        loop->belief.look_begin = loop->act.time;
        return;
    case AFTER_LEARN:
        om__loop_go(loop, STAGE_LEARN);
        om__warn_begin_learning(&loop->belief);
        return;
    case AFTER_GO: conclude_action(loop, needs_tick); return;
    }
}

static AfterStep next_step(const OmLoop* loop, AfterStep done) {
    const int next = loop->action_index + 1;
    return om__warn_after(&loop->belief,
                          next < loop->plan.naction ? &loop->plan.action[next] : NULL, done);
}

static OmStatus end_action(OmLoop* loop, bool* needs_tick) {
    const AfterStep step = next_step(loop, AFTER_GO);
    OM_TRY(note_action(loop));
    take_step(loop, step, needs_tick);
    return OM_OK;
}

static OmStatus begin_action(OmLoop* loop, bool* needs_tick) {
    bool is_done;
    om__loop_go(loop, STAGE_ACTION);
    loop->action_begin = loop->act.time;
    loop->act.margin = loop->task.visibility_margin * (1 + loop->act.ncontinued);
    OM_TRY(om__loop_notify_action_begin(loop));
    loop->force_action = loop->force_world_action = 0;
    loop->belief.warning_action = loop->belief.warn.state;
    OM_TRY(om__action_begin(&loop->act, &loop->plan.action[loop->action_index], &is_done));
    *needs_tick = !is_done;
    return is_done ? end_action(loop, needs_tick) : OM_OK;
}

// ---- stages ---------------------------------------------------------------------------------------------

// The ROI must stay visible while the arms keep still. If it closes, the motion is continued with a larger margin.
// Time counts by the exposure of the pictures: a picture taken before the arms stood still proves nothing.
static void check_verification(OmLoop* loop, bool* needs_tick) {
    double seen_at = loop->act.time - loop->look_age;
    if (loop->act.visibility < loop->task.visibility)
        loop->visible_since = fmax(loop->visible_since, seen_at);
    loop->belief.is_exposed = seen_at - loop->visible_since >= VISIBLE_TIME;
    *needs_tick = !loop->belief.is_exposed && loop->act.time - loop->verify_begin < VERIFY_LIMIT;
    if (*needs_tick) return;
    const OmRetractResult* r = &loop->result;
    if (r->naction == 0) {  // before any action
        if (loop->belief.is_exposed)
            end_in_view(loop);
        else
            om__loop_go(loop, STAGE_PLAN);
        return;
    }
    bool is_repeated = !loop->belief.is_exposed && loop->act.action.outcome == OM_ACTION_EXPOSED &&
                       r->naction < loop->task.max_actions &&
                       loop->act.ncontinued + 1 < MAX_CONTINUED;
    if (!is_repeated) {
        leave_action(loop);
        return;
    }
    ++loop->act.ncontinued;
    om__loop_go(loop, STAGE_NEXT_ACTION);
}

static OmStatus check_learning(OmLoop* loop, bool* needs_tick) {
    *needs_tick = om__warn_is_learning(&loop->belief);
    if (*needs_tick) return OM_OK;
    conclude_action(loop, needs_tick);
    return OM_OK;
}

static OmStatus check_look(OmLoop* loop, bool* needs_tick) {
    OM_TRY(om__look_take(&loop->belief, needs_tick));
    if (*needs_tick) return OM_OK;
    take_step(loop, next_step(loop, AFTER_LOOK), needs_tick);
    return OM_OK;
}

static OmStatus check_action(OmLoop* loop, bool* needs_tick) {
    bool is_done;
    if (om__look_stops_reach(&loop->belief)) {
        om__act_stop(&loop->act);  // the other one may make room
        loop->act.action.outcome = OM_ACTION_OUTDATED;
        loop->act.arm[loop->act.action.plan.arm].at = -1;
        return end_action(loop, needs_tick);
    }
    if (om__warn_stops(&loop->belief)) {
        om_world_stop(loop->world, loop->act.action.plan.arm);
        loop->act.action.outcome = OM_ACTION_WARNED;
        return end_action(loop, needs_tick);
    }
    OM_TRY(om__action_check(&loop->act, &is_done));
    *needs_tick = !is_done;
    return is_done ? end_action(loop, needs_tick) : OM_OK;
}

static OmStatus begin(OmLoop* loop, bool* needs_tick) {
    loop->result.visibility_start = loop->act.visibility;
    *needs_tick = loop->act.visibility >= loop->task.visibility;
    if (*needs_tick)
        begin_verification(loop);
    else
        om__loop_go(loop, STAGE_PLAN);
    return OM_OK;
}

OmStatus om__loop_decide(OmLoop* loop) {
    bool needs_tick = false;
    OM_TRY(om__slip_react(loop));
    while (!needs_tick && loop->stage != STAGE_ENDED) {
        switch (loop->stage) {
        case STAGE_BEGIN: OM_TRY(begin(loop, &needs_tick)); break;
        case STAGE_VERIFY: check_verification(loop, &needs_tick); break;
        case STAGE_PLAN: OM_TRY(decide_plan(loop)); break;
        case STAGE_NEXT_ACTION: OM_TRY(begin_action(loop, &needs_tick)); break;
        case STAGE_ACTION: OM_TRY(check_action(loop, &needs_tick)); break;
        case STAGE_LOOK: OM_TRY(check_look(loop, &needs_tick)); break;
        case STAGE_LEARN: OM_TRY(check_learning(loop, &needs_tick)); break;
        case STAGE_DOUBT:
            needs_tick = !om__doubt_is_over(&loop->belief);
            if (!needs_tick) om__loop_go(loop, STAGE_PLAN);
            break;
        case STAGE_CONSENT:
        case STAGE_HOLD: needs_tick = true; break;
        case STAGE_ENDED: break;
        }
    }
    return OM_OK;
}
