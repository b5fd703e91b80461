// defras_retract.c: a run of the loop on a scene: builds world and twin, ticks to the end, writes the record.
#include <string.h>

#include "defras/defras_internal.h"

#define RETRACT_COOKIE 0x0de78a5

const char* om_action_outcome_text(OmActionOutcome outcome) {
    switch (outcome) {
    case OM_ACTION_DONE: return "done";
    case OM_ACTION_EXPOSED: return "ROI exposed";
    case OM_ACTION_FORCE: return "stopped by force";
    case OM_ACTION_HEIGHT: return "stopped by height";
    case OM_ACTION_UNREACHED: return "out of reach";
    case OM_ACTION_EMPTY: return "nothing grasped";
    }
    return "";
}

const char* om_retract_outcome_text(OmRetractOutcome outcome) {
    switch (outcome) {
    case OM_RETRACT_EXPOSED: return "exposed";
    case OM_RETRACT_IN_VIEW: return "in_view_at_start";
    case OM_RETRACT_GAVE_UP: return "gave_up";
    case OM_RETRACT_NO_PLAN: return "no_plan_left";
    case OM_RETRACT_CANCELLED: return "cancelled";
    }
    return "";
}

OmRetractDef om_retract_default_def(const OmScene* scene) {
    return (OmRetractDef){.cookie = RETRACT_COOKIE, .scene = scene, .frame_every = 1};
}

void om_retract_result_done(OmRetractResult* result) {
    if (!result) return;
    om_free(result->action);
    om_free(result->sample);
    memset(result, 0, sizeof *result);
}

// ---- beginning ------------------------------------------------------------------------------------------

// Mean displacement of a body's vertices from the mesh they started from, m.
static double mean_shift(const OmBody* body) {
    const OmTetMesh* mesh = &om_body_site(body)->mesh;
    double sum = 0;
    for (int v = 0; v < mesh->nvert; ++v)
        sum += om_distance(om_load3(om_body_x(body), v), om_load3(mesh->x, v));
    return sum / mesh->nvert;
}

// Let twin and truth come to rest, and note whether the tissue stayed where the scene puts it.
static OmStatus settle(Loop* loop) {
    OmRetractResult* r = loop->result;
    OmBody* truth = om_world_truth(loop->world);
    double dt = loop->scene->task.time_step;
    OmStatus twin = om_body_settle(loop->twin, dt, OM_WORLD_SETTLE_SPEED, OM_WORLD_SETTLE_TIME);
    OM_TRY(twin);
    OmStatus world = om_world_reset(loop->world);
    OM_TRY(world);
    r->is_settled = twin == OM_OK && world == OM_OK;
    r->twin_shift = mean_shift(loop->twin);
    r->world_shift = mean_shift(truth);
    double half = fmin(loop->grid.half.x, loop->grid.half.y);
    r->has_slid = fmax(r->twin_shift, r->world_shift) > OM_RETRACT_SLID * half;
    return OM_OK;
}

static OmStatus begin(Loop* loop) {
    const OmScene* scene = loop->scene;
    OM_TRY(om_site_build(scene, OM_SITE_TWIN, loop->progress, &loop->twin_site));
    OM_TRY(om_site_build(scene, OM_SITE_WORLD, loop->progress, &loop->world_site));
    OM_TRY(om_world_check_visible(scene, &loop->twin_site));
    OM_TRY(om_body_create(scene, &loop->twin_site, loop->def->nworker, &loop->twin));
    OM_TRY(om_world_create_simulated(scene, &loop->world_site, loop->def->nworker, &loop->world));
    OmPlannerDef planner = om_planner_default_def();
    planner.program = loop->def->program;
    planner.max_lift = (int)ceil(scene->task.max_height / scene->task.pull_step - 1e-9);
    OM_TRY(om_planner_create(&planner, &loop->planner));
    OM_TRY(om__grid_build(scene, &loop->twin_site, &loop->grid));
    for (int a = 0; a < OM_MAX_ARM; ++a) loop->arm[a] = (ArmState){.at = -1, .in_hand = -1};
    loop->apart = om__grid_length(&loop->grid, APART);
    loop->rate = 1.0;
    OmRetractResult* r = loop->result;
    r->twin_nvert = loop->twin_site.mesh.nvert;
    r->twin_ntet = loop->twin_site.mesh.ntet;
    r->world_nvert = loop->world_site.mesh.nvert;
    r->world_ntet = loop->world_site.mesh.ntet;
    OM_TRY(settle(loop));
    if (loop->def->out_dir) OM_TRY(om__recorder_create(loop, &loop->recorder));
    loop->twin_wall = 0;
    return om__loop_tick(loop);
}

static void end(Loop* loop) {
    om__recorder_destroy(loop->recorder);
    om_world_destroy(loop->world);
    om_body_destroy(loop->twin);
    om_planner_destroy(loop->planner);
    om_site_done(&loop->twin_site);
    om_site_done(&loop->world_site);
    om_free(loop->plan_ms);
}

// ---- the run --------------------------------------------------------------------------------------------

static void summarise(Loop* loop, double wall_start) {
    OmRetractResult* r = loop->result;
    r->visibility_end = loop->visibility;
    if (!om_world_truth(loop->world)) r->force_world_max = r->force_more = r->force_less = NAN;
    r->time = loop->time;
    r->twin_step_ms = loop->tick ? 1e3 * loop->twin_wall / loop->tick : 0;
    r->hash = om_body_hash(om_world_truth(loop->world));
    r->twin_nbad = om_body_nbad(loop->twin);
    r->world_nbad = om_body_nbad(om_world_truth(loop->world));
    if (r->nplan > 0) {
        om_sort_doubles(loop->plan_ms, r->nplan);
        r->plan_ms_median = loop->plan_ms[r->nplan / 2];
        r->plan_ms_max = loop->plan_ms[r->nplan - 1];
    }
    r->wall_time = om_clock_now() - wall_start;
}

// Tick until the end; progress can cancel.
static OmStatus tick_to_end(Loop* loop) {
    OM_TRY(om__loop_decide(loop));
    while (loop->stage != STAGE_ENDED) {
        OM_TRY(om__loop_tick(loop));
        OM_TRY(om__loop_decide(loop));
    }
    return OM_OK;
}

// The record of a run that is cancelled; it is no reason to lose what was seen.
static OmStatus keep_part(Loop* loop, double wall_start) {
    OmRetractResult* r = loop->result;
    r->outcome = OM_RETRACT_CANCELLED;
    snprintf(r->reason, sizeof r->reason, "cancelled after %d actions and %.1f s", r->naction,
             loop->time);
    summarise(loop, wall_start);
    OM_TRY(om__recorder_commit(loop->recorder, loop, true));
    return om_error(OM_CANCELLED, "cancelled; the record so far is in %s",
                    om__recorder_place(loop->recorder));
}

static OmStatus check_def(const OmRetractDef* def) {
    OM_CHECK(def->cookie == RETRACT_COOKIE, OM_INVALID, "OmRetractDef was not made by default_def");
    OM_CHECK(def->scene, OM_INVALID, "OmRetractDef.scene is null");
    const OmSceneTask* task = &def->scene->task;
    OM_CHECK(task->force_margin >= 0 && om__force_limit(task) > 0, OM_INVALID,
             "force_margin %g N leaves nothing of force_threshold %g N", task->force_margin,
             task->force_threshold);
    OM_CHECK(def->frame_every >= 0, OM_INVALID, "OmRetractDef.frame_every is %d", def->frame_every);
    return OM_OK;
}

OmStatus om_retract_run(const OmRetractDef* def, const OmProgress* progress,
                        OmRetractResult* result) {
    memset(result, 0, sizeof *result);
    OM_TRY(check_def(def));
    if (def->out_dir) OM_TRY(om_folder_check(def->out_dir, OM__RETRACT_KIND));
    double wall_start = om_clock_now();
    Loop* loop = om_calloc(1, sizeof *loop);
    if (!loop) return OM_NO_MEMORY;
    loop->scene = def->scene;
    loop->def = def;
    loop->progress = progress;
    loop->result = result;
    OmStatus status = begin(loop);
    if (status >= 0) status = tick_to_end(loop);
    if (status == OM_CANCELLED && loop->recorder) {
        status = keep_part(loop, wall_start);
    } else if (status >= 0) {
        summarise(loop, wall_start);
        status = loop->recorder ? om__recorder_commit(loop->recorder, loop, false) : OM_OK;
    }
    end(loop);
    om_free(loop);
    if (status < 0) om_retract_result_done(result);
    return status;
}

// ---- before a run -------------------------------------------------------------------------------------------

static int count_attached(const OmBody* body) {
    if (!body) return 0;  // a world without truth
    const unsigned char* attached = om_body_attached(body);
    int num = 0;
    for (int i = 0; i < om_body_site(body)->mesh.nvert; ++i) num += attached[i] != 0;
    return num;
}

static void fill_estimate(const Loop* loop, OmRetractEstimate* e) {
    const OmRetractResult* r = loop->result;
    const OmSceneCamera* camera = &loop->scene->endoscope;
    e->twin_nvert = r->twin_nvert, e->twin_ntet = r->twin_ntet;
    e->world_nvert = r->world_nvert, e->world_ntet = r->world_ntet;
    e->twin_nattached = count_attached(loop->twin);
    e->world_nattached = count_attached(om_world_truth(loop->world));
    e->nblock = loop->grid.n * loop->grid.n;
    for (int b = 0; b < e->nblock; ++b)
        e->ngrasp += loop->grid.vert[b] >= 0 && !om__grid_is_fixed(&loop->grid, loop->twin, b);
    e->visibility = loop->visibility;
    e->is_settled = r->is_settled;
    e->has_slid = r->has_slid;
    int every = loop->def->frame_every, max = loop->scene->task.max_actions;
    double nframe = 1 + (every > 0 ? max / every : 0);
    e->picture_bytes = nframe * 3.0 * camera->width * camera->height;
}

OmStatus om_retract_check(const OmRetractDef* def, const OmProgress* progress,
                          OmRetractEstimate* estimate) {
    memset(estimate, 0, sizeof *estimate);
    OM_TRY(check_def(def));
    double start = om_clock_now();
    OmRetractResult result = {0};
    Loop* loop = om_calloc(1, sizeof *loop);
    if (!loop) return OM_NO_MEMORY;
    loop->scene = def->scene;
    loop->def = def;
    loop->progress = progress;
    loop->result = &result;
    OmStatus status = begin(loop);
    if (status < 0) goto done;
    fill_estimate(loop, estimate);
    status = om__loop_plan(loop);
    if (status < 0) goto done;
    estimate->nplanned = status == OM_OK ? loop->plan.naction : 0;
    estimate->begin_time = om_clock_now() - start;
    double tick_start = om_clock_now(), time = loop->time;
    int ntick = (int)ceil(OM_RETRACT_CHECK_TIME / def->scene->task.time_step);
    status = OM_OK;
    for (int i = 0; i < ntick && status >= 0; ++i) status = om__loop_tick(loop);
    estimate->time_rate = (om_clock_now() - tick_start) / fmax(1e-3, loop->time - time);
done:
    end(loop);
    om_free(loop);
    om_retract_result_done(&result);
    return status < 0 ? status : OM_OK;
}
