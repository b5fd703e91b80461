// trial_attempt.c: one grasping point tried on a body of the twin, as the loop would do it.
//
// Grasp, then pull by pull (10 mm) until the ROI is exposed, the height limit, or the force limit. Where the ROI is
// still hidden, a fold away from the camera and, again from the lifted state, a fold towards the ROI. Speeds, the
// slowing near the force limit, the stop and the easing above it, the margin at which a motion stops, and the time for
// which the ROI must stay visible are those of the loop (act_motion.c, act_action.c, loop_decide.c). There is no
// robot and no tool in the picture; the arm's joint limits end motions as in the simulated world. The wrist turns for a
// grasp alone (act_wrist.c), so a pull that would need a further turn counts as out of reach.
//
// The result is the best sequence: one that exposes the ROI, of these the one of fewest actions, then of lowest force;
// if none does, the one with the largest visibility at its end.
#include <string.h>

#include "trial/trial_attempt.h"

typedef struct Try {
    const Attempt* a;
    AttemptResult* best;
    int arm;
    OmVec3 tip, grasp_tip;    // task frame, m
    double q[OM_PSM_NJOINT];  // joints of the arm
    OmQuat tool;              // orientation of the tool, world frame
    double force;             // N, now
    double force_max;         // N, of the sequence
    double visibility;        // of the last look
    int npull, naction;       // of the sequence
    int nstep;                //
    int ntrace;               // of these, in the sequence
    int fold_step;            // of these, before the fold
    bool has_fold_from;       // a fold that was begun continues
    OmVec3 fold_from;         // task frame, m
    bool is_cut;              // the limit of steps is reached
} Try;

// ---- steps ------------------------------------------------------------------------------------------------

static OmStatus look(Try* t) {
    OmVisibility v;
    OM_TRY(om_view_look(t->a->view, om_body_x(t->a->body), &v));
    t->visibility = v.npoint > 0 ? (double)v.nseen / v.npoint : 0;
    return OM_OK;
}

OmStatus om__attempt_step(const Attempt* a, int arm, OmVec3 tip, double* force) {
    OmBodyReport report;
    OmBodyForces forces;
    if (a->tick) OM_TRY(a->tick(a->tick_ctx));
    OM_TRY(om_body_move(a->body, arm, (OmPose){tip, a->grid->task.q}));
    OmStatus status = om_body_step(a->body, a->task->time_step, &report);
    if (status < 0 || !a->has_forces) return status < 0 ? status : OM_OK;
    OM_TRY(om_body_get_forces(a->body, &forces));
    *force = om_norm(forces.pull[arm]);
    return OM_OK;
}

// Let a time step pass with the tip at its place.
static OmStatus step(Try* t) {
    const Attempt* a = t->a;
    if (a->max_step > 0 && t->nstep >= a->max_step) {
        t->is_cut = true;
        return OM_OK;
    }
    const OmVec3 tip = om_pose_apply(a->grid->task, t->tip);
    OM_TRY(om__attempt_step(a, t->arm, tip, &t->force));
    if (a->has_forces) t->force_max = fmax(t->force_max, t->force);
    if (a->trace) {
        a->trace[1].n = t->ntrace++;
        OM_TRY(om__trace_add(&a->trace[1], tip, t->force));
    }
    return ++t->nstep % LOOK_EVERY == 0 ? look(t) : OM_OK;
}

static bool is_in_reach(const Try* t, OmVec3 tip, double q[OM_PSM_NJOINT]) {
    OmPose pose = {om_pose_apply(t->a->grid->task, tip), t->tool};
    return om_psm_inverse(&t->a->psm[t->arm], pose, t->q, q) == OM_OK;
}

// Bring the tool to a grasping point: the wrist turns where a joint forbids the orientation of `q`, and then keeps it.
static bool reach(Try* t, OmVec3 tip) {
    const OmPose straight = {om_pose_apply(t->a->grid->task, tip), t->a->q[t->arm]};
    return om__wrist_reach(&t->a->psm[t->arm], straight, t->a->task->wrist_turn, t->q, t->q,
                           &t->tool);
}

// Keep still: is the ROI seen for VISIBLE_TIME without a break?
static OmStatus verify(Try* t, bool* is_exposed) {
    double dt = t->a->task->time_step, seen = 0;
    *is_exposed = false;
    for (double s = 0; s < VERIFY_LIMIT && !*is_exposed && !t->is_cut; s += dt) {
        OM_TRY(step(t));
        seen = t->visibility >= t->a->task->visibility ? seen + dt : 0;
        *is_exposed = seen >= VISIBLE_TIME;
    }
    return OM_OK;
}

// ---- motions ----------------------------------------------------------------------------------------------

// A straight motion of length `left` m has a new place after a step of `length` m. False: the arm does not reach it.
static bool advance(Try* t, OmVec3 goal, double length, bool* is_there) {
    OmVec3 way = om_sub(goal, t->tip);
    double left = om_norm(way);
    *is_there = left <= length;
    OmVec3 next = *is_there ? goal : om_madd(t->tip, length / left, way);
    if (!is_in_reach(t, next, t->q)) return false;
    t->tip = next;
    return true;
}

// After a force stop: back towards `from` until the force is below its limit.
static OmStatus ease(Try* t, OmVec3 from) {
    const OmSceneTask* task = t->a->task;
    bool is_there = false;
    double length = SLOW_RATE * task->speed * task->time_step;
    for (double s = 0; s < MOTION_TIME && !is_there && !t->is_cut; s += task->time_step) {
        if (t->force <= EASE * t->a->force_limit || !advance(t, from, length, &is_there)) break;
        OM_TRY(step(t));
    }
    return OM_OK;
}

// Move the tip to a goal as om__motion_check does. `from`: where a force stop leads back to.
static OmStatus move(Try* t, OmVec3 goal, OmVec3 from, double margin, OmActionOutcome* outcome) {
    const Attempt* a = t->a;
    const double dt = a->task->time_step, limit = a->force_limit;
    Watch watch = {a->task->visibility, margin, t->visibility};
    double q[OM_PSM_NJOINT], over = 0;
    bool is_there = false;
    *outcome = OM_ACTION_UNREACHED;
    if (!is_in_reach(t, goal, q)) return OM_OK;
    *outcome = OM_ACTION_DONE;
    for (double s = 0; s < MOTION_TIME && !is_there && !t->is_cut; s += dt) {
        double rate = isfinite(limit) ? om__force_rate(t->force, limit) : 1;
        if (!advance(t, goal, rate * a->task->speed * dt, &is_there)) return OM_OK;
        OM_TRY(step(t));
        if (t->force > limit) over += dt;
        *outcome = om__motion_outcome(&watch, t->visibility, t->force, limit, over);
        if (*outcome == OM_ACTION_FORCE) return ease(t, from);
        if (*outcome != OM_ACTION_DONE) return OM_OK;
    }
    return OM_OK;
}

static OmVec3 pull_goal(const Try* t) {
    double top = t->grasp_tip.z + t->a->task->max_height;
    return om_vec3(t->tip.x, t->tip.y, fmin(t->tip.z + t->a->task->pull_step, top));
}

static OmStatus pull(Try* t, double margin, OmActionOutcome* outcome) {
    return move(t, pull_goal(t), om_vec3(t->tip.x, t->tip.y, t->grasp_tip.z), margin, outcome);
}

// As step_fold of act_action.c.
static OmStatus fold(Try* t, OmPlanVerb verb, double margin, OmActionOutcome* outcome) {
    const OmVec3 from = t->has_fold_from ? t->fold_from : t->tip;
    OmVec3 direction;
    double length;
    om__fold_path(t->a->grid, t->a->task->retract, from, verb, &direction, &length);
    const bool is_past =
        t->has_fold_from && om_dot(om_sub(t->tip, from), direction) > length - FOLD_STEP;
    t->has_fold_from = false;
    *outcome = is_past ? OM_ACTION_DONE : OM_ACTION_UNREACHED;
    while (*outcome == OM_ACTION_UNREACHED && (length -= FOLD_STEP) > 0)
        OM_TRY(move(t, om_madd(from, length, direction), from, margin, outcome));
    bool has_gained = true;
    while (*outcome == OM_ACTION_DONE && has_gained && !t->is_cut) {
        double before = t->visibility;
        const OmVec3 begin = t->tip;
        OM_TRY(move(t, om_madd(begin, FOLD_STEP, direction), begin, margin, outcome));
        has_gained = t->force <= t->a->force_limit && t->visibility >= before + FOLD_GAIN;
    }
    if (*outcome == OM_ACTION_UNREACHED) *outcome = OM_ACTION_DONE;  // end of the workspace
    return OM_OK;
}

// ---- sequences --------------------------------------------------------------------------------------------

static OmStatus keep_trace(const Try* t) {
    Trace* trace = t->a->trace;
    if (!trace) return OM_OK;
    trace[0].n = 0;
    trace[0].fold_step = t->fold_step;
    for (int i = 0; i < t->ntrace; ++i)
        OM_TRY(om__trace_add(&trace[0], trace[1].tip[i], trace[1].force[i]));
    return OM_OK;
}

static OmStatus keep(const Try* t, OmPlanVerb verb, bool exposes) {
    AttemptResult* b = t->best;
    bool is_better = t->visibility > b->visibility;
    if (exposes || b->exposes) {
        is_better = exposes && !b->exposes;
        if (exposes && b->exposes)
            is_better =
                t->naction < b->naction || (t->naction == b->naction && t->force_max < b->force);
    }
    if (!is_better && b->naction > 0) return OM_OK;
    b->exposes = exposes;
    b->npull = t->npull;
    b->fold = verb;
    b->visibility = t->visibility;
    b->force = t->force_max;
    b->naction = t->naction;
    return keep_trace(t);
}

// A point that exposes nothing has the largest force of all its sequences.
static void keep_force(const Try* t) {
    if (!t->best->exposes) t->best->force = fmax(t->best->force, t->force_max);
}

// One action, continued while it shows the ROI and the ROI closes again.
static OmStatus act(Try* t, OmPlanVerb verb, bool* is_exposed, OmActionOutcome* outcome) {
    *is_exposed = false;
    for (int k = 0; k < MAX_CONTINUED && !*is_exposed && !t->is_cut; ++k) {
        const double margin = t->a->task->visibility_margin * (1 + k);
        t->naction += 1;
        t->npull += verb == OM_PLAN_PULL;
        OM_TRY(verb == OM_PLAN_PULL ? pull(t, margin, outcome) : fold(t, verb, margin, outcome));
        OM_TRY(look(t));
        if (t->visibility >= t->a->task->visibility) OM_TRY(verify(t, is_exposed));
        if (*outcome != OM_ACTION_EXPOSED) break;
    }
    if (t->is_cut) return OM_OK;
    OM_TRY(keep(t, verb, *is_exposed));
    keep_force(t);
    return OM_OK;
}

static OmStatus try_pulls(Try* t, bool* is_exposed) {
    const OmSceneTask* task = t->a->task;
    OmActionOutcome outcome = OM_ACTION_DONE;
    double top = t->grasp_tip.z + task->max_height;
    *is_exposed = false;
    while (!*is_exposed && !t->is_cut && t->tip.z < top - 1e-9) {
        OM_TRY(act(t, OM_PLAN_PULL, is_exposed, &outcome));
        t->best->is_forced |= outcome == OM_ACTION_FORCE;
        if (outcome == OM_ACTION_FORCE || outcome == OM_ACTION_UNREACHED) break;
    }
    return OM_OK;
}

static OmStatus try_folds(Try* t, bool exposes[2]) {
    static const OmPlanVerb verb[2] = {OM_PLAN_MOVE_AWAY, OM_PLAN_MOVE_ROI};
    om_body_save(t->a->body, t->a->lifted);
    t->fold_step = t->ntrace;
    const Try lifted = *t;
    exposes[0] = exposes[1] = false;
    for (int k = 0; k < 2 && !t->is_cut; ++k) {
        OmActionOutcome outcome;
        int nstep = t->nstep;
        *t = lifted;
        t->nstep = nstep;
        if (k) om_body_restore(t->a->body, t->a->lifted);
        OM_TRY(act(t, verb[k], &exposes[k], &outcome));
    }
    return OM_OK;
}

OmStatus om__attempt_run(const Attempt* a, int arm, int block, AttemptResult* result) {
    *result = (AttemptResult){.fold = OM_PLAN_PULL, .force = a->has_forces ? 0 : -1};
    Try t = {.a = a, .best = result, .arm = arm, .force_max = a->has_forces ? 0 : -1};
    OmVec3 p = om__grid_point(a->grid, om_body_x(a->body), block);
    t.tip = t.grasp_tip = om__to_task(a->grid, p);
    result->is_in_reach = reach(&t, t.tip);
    if (!result->is_in_reach) return OM_OK;
    int nheld;
    OmPose pose = {p, a->grid->task.q};
    OmStatus status = om_body_grasp(a->body, arm, pose, a->task->grasp_radius, &nheld);
    if (status == OM_INVALID) return OM_OK;  // all tissue in reach is attached
    OM_TRY(status);
    result->is_held = true;
    t.naction = 2;  // reach, grasp
    bool is_exposed, exposes[2];
    OM_TRY(look(&t));
    OM_TRY(try_pulls(&t, &is_exposed));
    if (!is_exposed && !t.is_cut) OM_TRY(try_folds(&t, exposes));
    result->nstep = t.nstep;
    result->is_cut = t.is_cut;
    return OM_OK;
}

OmStatus om__attempt_continue(const Attempt* a, OmPlanVerb verb, int arm, const Trace* trace,
                              bool* exposes, int* nstep) {
    AttemptResult result = {.fold = OM_PLAN_PULL};
    Attempt plain = *a;
    plain.trace = NULL;
    OmActionOutcome outcome;
    const int last = trace->n - 1, begin = trace->fold_step;
    Try t = {.a = &plain, .best = &result, .arm = arm};
    t.tip = om__to_task(a->grid, trace->tip[last]);
    t.grasp_tip = om__to_task(a->grid, trace->tip[0]);
    *exposes = false;
    t.tool = a->q[arm];
    if (!is_in_reach(&t, t.tip, t.q) && (!reach(&t, t.grasp_tip) || !is_in_reach(&t, t.tip, t.q)))
        return OM_OK;
    OM_TRY(look(&t));
    if (verb == OM_PLAN_PULL) {
        OM_TRY(try_pulls(&t, exposes));
    } else {
        t.has_fold_from = begin > 0;
        if (begin > 0) t.fold_from = om__to_task(a->grid, trace->tip[begin - 1]);
        OM_TRY(act(&t, verb, exposes, &outcome));
    }
    *nstep += t.nstep;
    return OM_OK;
}
