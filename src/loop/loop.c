// loop.c: the loop as an object: creation, ticks, commands, listeners, queries.
#include <string.h>

#include "belief/belief_updater.h"
#include "loop/loop_state.h"

#define LOOP_COOKIE 0x100be7d
#define PICTURE (OM_OBSERVE_IMAGE | OM_OBSERVE_WINDOW)  // sources in which the ROI is measured

const char* om_retract_outcome_text(OmRetractOutcome outcome) {
    switch (outcome) {
    case OM_RETRACT_EXPOSED: return "exposed";
    case OM_RETRACT_IN_VIEW: return "in_view_at_start";
    case OM_RETRACT_GAVE_UP: return "gave_up";
    case OM_RETRACT_NO_PLAN: return "no_plan_left";
    case OM_RETRACT_CANCELLED: return "cancelled";
    case OM_RETRACT_ABORTED: return "aborted";
    case OM_RETRACT_HELD: return "held";
    }
    return "";
}

void om_retract_result_done(OmRetractResult* result) {
    if (!result) return;
    om_free(result->action);
    om_free(result->sample);
    om_free(result->belief.update);
    memset(result, 0, sizeof *result);
}

// ---- creation -------------------------------------------------------------------------------------------

OmLoopDef om_loop_default_def(const OmSceneTask* task, OmWorld* world, OmBody* twin,
                              OmPlanner* planner) {
    return (OmLoopDef){.cookie = LOOP_COOKIE,
                       .task = task,
                       .world = world,
                       .twin = twin,
                       .planner = planner,
                       .max_age = 0.2,
                       .is_settled = true,
                       .wall_begin = om_clock_now()};
}

static OmStatus check_positive(double value, const char* name) {
    OM_CHECK(value > 0 && isfinite(value), OM_INVALID, "OmSceneTask.%s is %g; must be positive",
             name, value);
    return OM_OK;
}

static OmStatus check_task(const OmSceneTask* task) {
    OM_CHECK(task->force_margin >= 0 && om__force_limit(task) > 0, OM_INVALID,
             "force_margin %g N leaves nothing of force_threshold %g N", task->force_margin,
             task->force_threshold);
    OM_TRY(check_positive(task->max_height, "max_height"));
    OM_TRY(check_positive(task->pull_step, "pull_step"));
    OM_TRY(check_positive(task->visibility, "visibility"));
    OM_TRY(check_positive(task->visibility_margin, "visibility_margin"));
    OM_TRY(check_positive(task->speed, "speed"));
    OM_TRY(check_positive(task->grasp_radius, "grasp_radius"));
    OM_TRY(check_positive(task->time_step, "time_step"));
    OM_TRY(check_positive(task->retract, "retract"));
    OM_CHECK(task->wrist_turn >= 0 && task->wrist_turn <= OM_PI / 2, OM_INVALID,
             "OmSceneTask.wrist_turn is %g rad; 0 to pi / 2", task->wrist_turn);
    OM_CHECK(task->max_actions >= 1, OM_INVALID, "OmSceneTask.max_actions is %d; 1 or more",
             task->max_actions);
    return OM_OK;
}

static OmStatus check_updater(const OmLoopDef* def) {
    if (!def->updater) return OM_OK;
    OM_CHECK(om_world_sources(def->world) & OM_OBSERVE_DEPTH, OM_INVALID,
             "OmLoopDef.updater needs a world that observes depth");
    OM_CHECK(def->updater->nvert == om_body_site(def->twin)->mesh.nvert, OM_INVALID,
             "OmLoopDef.updater is of a twin of %d vertices, not %d", def->updater->nvert,
             om_body_site(def->twin)->mesh.nvert);
    return OM_OK;
}

static OmStatus check_def(const OmLoopDef* def) {
    OM_CHECK(def->cookie == LOOP_COOKIE, OM_INVALID, "OmLoopDef was not made by default_def");
    OM_CHECK(def->task, OM_INVALID, "OmLoopDef.task is null");
    OM_CHECK(def->world, OM_INVALID, "OmLoopDef.world is null");
    OM_CHECK(def->twin, OM_INVALID, "OmLoopDef.twin is null");
    OM_CHECK(def->planner, OM_INVALID, "OmLoopDef.planner is null");
    OM_CHECK(def->nlistener >= 0 && def->nlistener <= OM_LOOP_MAX_LISTENER, OM_INVALID,
             "OmLoopDef.nlistener is %d; 0 to %d", def->nlistener, OM_LOOP_MAX_LISTENER);
    OM_CHECK(def->nlistener == 0 || def->listener, OM_INVALID, "OmLoopDef.listener is null");
    OM_CHECK(
        om_world_sources(def->world) & (PICTURE | OM_OBSERVE_VISIBILITY), OM_INVALID,
        "OmLoopDef.world observes neither the endoscope's picture nor the visibility of the ROI");
    OM_TRY(om__check_watch(def->task, om_body_engine(def->twin)));
    OM_TRY(check_updater(def));
    OM_CHECK(!def->preplan || def->preplan->n == def->task->grid, OM_INVALID,
             "OmLoopDef.preplan has %d x %d blocks, the task %d x %d", def->preplan->n,
             def->preplan->n, def->task->grid, def->task->grid);
    OM_CHECK(!def->monitor || om_world_sources(def->world) & OM_OBSERVE_DEPTH, OM_INVALID,
             "OmLoopDef.monitor needs a world that observes depth");
    OM_CHECK(def->is_attended || !def->needs_approval, OM_INVALID,
             "OmLoopDef.needs_approval needs a person: is_attended is false");
    OM_CHECK(def->max_age >= 0 && def->max_lag >= 0, OM_INVALID,
             "OmLoopDef.max_age is %g s and max_lag %g s; 0 or more", def->max_age, def->max_lag);
    return check_task(def->task);
}

int om__count_attached(const OmBody* body) {
    if (!body) return 0;  // a world without truth
    const unsigned char* attached = om_body_attached(body);
    int n = 0;
    for (int v = 0; v < om_body_site(body)->mesh.nvert; ++v) n += attached[v] != 0;
    return n;
}

static void begin_result(OmLoop* loop, bool is_settled) {
    OmRetractResult* r = &loop->result;
    const OmTetMesh* mesh = &om_body_site(loop->twin)->mesh;
    r->is_settled = is_settled;
    r->twin.nvert = mesh->nvert;
    r->twin.ntet = mesh->ntet;
    r->twin.shift = om__rest_shift(loop->twin);
    r->truth.shift = NAN;
    loop->truth_nattached = om__count_attached(loop->truth);
    if (loop->truth) {
        const OmTetMesh* hidden = &om_body_site(loop->truth)->mesh;
        r->truth.nvert = hidden->nvert;
        r->truth.ntet = hidden->ntet;
        r->truth.shift = om__rest_shift(loop->truth);
    } else {
        r->truth.force = r->truth.more = r->truth.less = NAN;
    }
    if (!loop->has_forces) r->twin.force = r->truth.more = r->truth.less = NAN;
    double half = fmin(loop->grid.half.x, loop->grid.half.y);
    r->has_slid = fmax(r->twin.shift, r->truth.shift) > OM_RETRACT_SLID * half;
}

// ---- what arms and belief tell the loop ------------------------------------------------------------------

static void take_scan(void* ctx, OmScan* scan) {
    OmLoop* loop = ctx;
    if (loop->belief.updater) om__updater_take_rest(loop->belief.updater, scan);
}

static void note_grasp(void* ctx, int arm, OmPose tip) {
    OmLoop* loop = ctx;
    om__look_note_grasp(&loop->belief, arm, tip);
}

static OmStatus note_release(void* ctx, int arm) {
    OmLoop* loop = ctx;
    return om__look_note_release(&loop->belief, arm);
}

static void note_lag(void* ctx, int arm, double behind) {
    om__loop_alarm(ctx, OM_HOLD_ARM, "PSM%d does not follow: it is %.0f mm behind its command",
                   arm + 1, 1e3 * behind);
}

static OmStatus tell_update(void* ctx, const OmUpdateEvent* event) {
    if (event->stage == OM_UPDATE_DOUBTED) om__loop_go(ctx, STAGE_DOUBT);
    return om__loop_notify_update(ctx, event);
}

static OmStatus tell_warning(void* ctx, int was) { return om__loop_notify_warning(ctx, was); }

static void note_alarm(void* ctx, OmHold hold, const char* reason) {
    om__loop_alarm(ctx, hold, "%s", reason);
}

static void note_pause(void* ctx) { ((OmLoop*)ctx)->has_lag_origin = false; }

static void connect(OmLoop* loop, const OmLoopDef* def) {
    const bool has_depth = om_world_sources(def->world) & OM_OBSERVE_DEPTH;
    loop->act = (Act){.task = &loop->task,
                      .grid = &loop->grid,
                      .world = def->world,
                      .twin = def->twin,
                      .effort = &loop->result.effort,
                      .law = def->law,
                      .host = {loop, take_scan, note_grasp, note_release, note_lag}};
    om__act_init(&loop->act, has_depth && !def->is_by_twin);
    loop->belief = (Belief){.task = &loop->task,
                            .grid = &loop->grid,
                            .world = def->world,
                            .twin = def->twin,
                            .act = &loop->act,
                            .updater = def->updater,
                            .monitor = def->monitor,
                            .record = &loop->result.belief,
                            .max_age = def->max_age,
                            .host = {loop, tell_update, tell_warning, note_alarm, note_pause}};
}

static OmStatus begin_parts(OmLoop* loop, const OmLoopDef* def) {
    OmExposure exposure[OM_PLAN_MAX_BLOCK];
    OM_TRY(om__grid_build(def->task, om_body_site(def->twin), &loop->grid));
    if (om_world_sources(def->world) & PICTURE)
        OM_TRY(om_roi_meter_create(om_body_site(def->twin), &loop->meter));
    connect(loop, def);
    if (def->preplan) {
        OM_ALLOC(loop->preplan, 1);
        *loop->preplan = *def->preplan;
        om_preplan_get_exposure(loop->preplan, exposure);
    }
    return om__belief_begin(&loop->belief, def->preplan ? exposure : NULL);
}

OmStatus om_loop_create(const OmLoopDef* def, OmLoop** out) {
    *out = NULL;
    OM_TRY(check_def(def));
    OmLoop* loop = om_calloc(1, sizeof *loop);
    if (!loop) return OM_NO_MEMORY;
    loop->task = *def->task;
    loop->world = def->world;
    loop->twin = def->twin;
    loop->has_forces = om_engine_capabilities(om_body_engine(def->twin)) & OM_ENGINE_FORCES;
    loop->truth = def->truth;
    loop->planner = def->planner;
    loop->ahead = def->ahead;
    loop->nlistener = def->nlistener;
    for (int i = 0; i < def->nlistener; ++i) loop->listener[i] = def->listener[i];
    loop->wall_begin = def->wall_begin;
    loop->is_attended = def->is_attended;
    loop->needs_approval = def->needs_approval;
    loop->max_lag = def->max_lag;
    OmStatus status = begin_parts(loop, def);
    if (status < 0) {
        loop->belief.updater = NULL;  // its work is not cancelled
        om_loop_destroy(loop);
        return status;
    }
    loop->force_world = loop->visibility_world = NAN;
    loop->result.truth.visibility = NAN;
    begin_result(loop, def->is_settled);
    loop->result.twin.nadded = def->nadded;
    loop->result.twin.turned = def->turned;
    loop->result.twin.shifted = def->shifted;
    snprintf(loop->result.twin.unregistered, sizeof loop->result.twin.unregistered, "%s",
             def->unregistered ? def->unregistered : "");
    if (def->updater) om__updater_reset(def->updater);
    *out = loop;
    return OM_OK;
}

void om_loop_destroy(OmLoop* loop) {
    if (!loop) return;
    if (loop->belief.updater) om__updater_cancel(loop->belief.updater);
    om__belief_done(&loop->belief);
    om_roi_meter_destroy(loop->meter);
    om_free(loop->preplan);
    om_retract_result_done(&loop->result);
    om_free(loop->plan_ms);
    om_free(loop);
}

// ---- the end --------------------------------------------------------------------------------------------

static OmStatus finish(OmLoop* loop) {
    OmRetractResult* r = &loop->result;
    OM_TRY(om__look_end(&loop->belief));
    om__warn_end(&loop->belief);
    r->twin.step_ms = loop->act.tick ? 1e3 * loop->twin_wall / loop->act.tick : 0;
    r->truth.ntorn = loop->truth_nattached - om__count_attached(loop->truth);
    r->hash = om_body_hash(loop->truth ? loop->truth : loop->twin);
    r->twin.nbad = om_body_nbad(loop->twin) - loop->ahead_count.nbad;
    r->truth.nbad = loop->truth ? om_body_nbad(loop->truth) : 0;
    if (r->nplan > 0) {
        om_sort_doubles(loop->plan_ms, r->nplan);
        r->plan_ms_median = loop->plan_ms[r->nplan / 2];
        r->plan_ms_max = loop->plan_ms[r->nplan - 1];
    }
    r->wall_time = om_clock_now() - loop->wall_begin;
    return om__loop_notify_end(loop);
}

// ---- commands -------------------------------------------------------------------------------------------

static OmStatus apply(OmLoop* loop, const OmLoopCommand* command) {
    OM_TRY(om__loop_notify_begin(loop));
    OM_TRY(om__loop_apply(loop, command));
    return loop->stage == STAGE_ENDED ? finish(loop) : OM_OK;
}

static OmStatus check_running(const OmLoop* loop) {
    OM_CHECK(!loop->has_failed, OM_INVALID, "the loop has failed: it can only be destroyed");
    OM_CHECK(loop->stage != STAGE_ENDED, OM_INVALID, "the loop has ended: %s", loop->result.reason);
    return OM_OK;
}

// A listener may run inside of this call; its commands wait. An error of a step leaves the loop between two states.
static OmStatus leave(OmLoop* loop, OmStatus status) {
    for (int i = 0; status >= 0 && i < loop->npending && loop->stage != STAGE_ENDED; ++i)
        status = apply(loop, &loop->pending[i]);
    loop->npending = 0;
    loop->is_ticking = false;
    if (loop->astray[0] && status >= 0) status = om_error(OM_INVALID, "%s", loop->astray);
    loop->has_failed |= status < 0;
    return status < 0 ? status : OM_OK;
}

OmStatus om_loop_command(OmLoop* loop, const OmLoopCommand* command) {
    OM_TRY(check_running(loop));
    OM_TRY(om__loop_check_command(loop, command));
    if (loop->is_ticking) {
        OM_CHECK(loop->npending < OM_LOOP_MAX_PENDING, OM_INVALID,
                 "more than %d commands within one tick", OM_LOOP_MAX_PENDING);
        loop->pending[loop->npending++] = *command;
        return OM_OK;
    }
    loop->is_ticking = true;
    return leave(loop, apply(loop, command));
}

// ---- ticks ----------------------------------------------------------------------------------------------

static OmStatus tick(OmLoop* loop) {
    OM_TRY(om__loop_notify_begin(loop));
    OM_TRY(om__loop_step(loop));
    OM_TRY(om__loop_notify_tick(loop));
    OM_TRY(om__look_check(&loop->belief));
    OM_TRY(om__loop_check_hold(loop));
    if (!loop->is_paused && loop->stage != STAGE_ENDED) OM_TRY(om__loop_decide(loop));
    if (loop->stage != STAGE_ENDED) OM_TRY(om__look_start(&loop->belief));
    return loop->stage == STAGE_ENDED ? finish(loop) : OM_OK;
}

OmStatus om_loop_tick(OmLoop* loop) {
    OM_TRY(check_running(loop));
    loop->is_ticking = true;
    return leave(loop, tick(loop));
}

// ---- queries --------------------------------------------------------------------------------------------

OmLoopPhase om_loop_phase(const OmLoop* loop) {
    switch (loop->stage) {
    case STAGE_BEGIN: return OM_LOOP_BEGIN;
    case STAGE_VERIFY: return OM_LOOP_VERIFY;
    case STAGE_PLAN:
    case STAGE_NEXT_ACTION: return OM_LOOP_PLAN;
    case STAGE_ACTION: return OM_LOOP_ACT;
    case STAGE_LOOK: return OM_LOOP_LOOK;
    case STAGE_DOUBT:
    case STAGE_LEARN: return OM_LOOP_LEARN;
    case STAGE_CONSENT: return OM_LOOP_CONSENT;
    case STAGE_HOLD: return OM_LOOP_HOLD;
    case STAGE_ENDED: break;
    }
    return OM_LOOP_ENDED;
}

bool om_loop_is_paused(const OmLoop* loop) { return loop->is_paused; }

OmHold om_loop_hold(const OmLoop* loop) { return loop->hold; }

int om_loop_warning(const OmLoop* loop) { return loop->belief.warn.state; }

const char* om_loop_hold_reason(const OmLoop* loop) { return loop->hold_text; }

int om_loop_grid(const OmLoop* loop) { return loop->grid.n; }

int om_loop_ntick(const OmLoop* loop) { return loop->act.tick; }

OmRetractSample om_loop_sample(const OmLoop* loop) { return om__loop_sample(loop); }

double om_loop_force(const OmLoop* loop, int arm) {
    if (!loop->has_forces) return NAN;
    return arm >= 0 && arm < OM_MAX_ARM ? loop->act.force[arm] : 0;
}

const OmPlan* om_loop_plan(const OmLoop* loop) { return &loop->plan; }

const OmPreplan* om_loop_preplan(const OmLoop* loop) {
    return loop->is_preplan ? loop->preplan : NULL;
}

const OmPlanAction* om_loop_action(const OmLoop* loop) {
    return loop->stage == STAGE_ACTION ? &loop->plan.action[loop->action_index] : NULL;
}

const OmRetractResult* om_loop_result(const OmLoop* loop) { return &loop->result; }

OmStatus om_loop_take_result(OmLoop* loop, OmRetractResult* result) {
    memset(result, 0, sizeof *result);
    OM_CHECK(loop->has_failed || loop->stage == STAGE_ENDED, OM_INVALID,
             "the loop still runs: its result is not complete");
    OM_CHECK(!loop->is_ticking, OM_INVALID, "a listener cannot take the result of its loop");
    *result = loop->result;
    memset(&loop->result, 0, sizeof loop->result);
    loop->sample_capacity = loop->action_capacity = loop->belief.update_capacity = 0;
    return OM_OK;
}
