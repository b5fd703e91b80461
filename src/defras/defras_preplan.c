// defras_preplan.c: every grasping point tried in the twin, and the choice among them (6.4.2).
//
// One body for each worker, all of one model, all from one snapshot at rest; a worker takes the next point. A point's
// result depends on the snapshot alone, so it is the same for any number of workers. Motions run at the loop's speed:
// at three times this speed (the speed of the calibration) viscous forces are a part of the largest pull. Layouts 50
// to 52 of scenes/sheet.yaml: 16, 10 and 7 points, 14, 11 and 7 s of processor time on a busy machine. The loop
// followed these plans to the end without a new plan: 8 actions each, as predicted.
//
// The predicted force may be larger than that of the run (0.56 N and 0.33 N on layout 51): the truth is softer than
// the twin there, shows the ROI earlier, and the fold stops earlier.
#include "omentum/defras_preplan.h"

#include <stdatomic.h>
#include <string.h>

#include "defras/defras_attempt.h"
#include "omentum/world.h"

#define PREPLAN_COOKIE 0x94e91a2

static const struct {
    const char *word, *text;
} verdict[OM_PREPLAN_NVERDICT] = {
#define VERDICT_ROW(name, word, text) {word, text},
    OM_PREPLAN_VERDICT_TABLE(VERDICT_ROW)
#undef VERDICT_ROW
};

const char* om_preplan_verdict_word(OmPreplanVerdict v) {
    return (unsigned)v < OM_PREPLAN_NVERDICT ? verdict[v].word : "";
}

const char* om_preplan_verdict_text(OmPreplanVerdict v) {
    return (unsigned)v < OM_PREPLAN_NVERDICT ? verdict[v].text : "";
}

OmPreplanDef om_preplan_default_def(const OmScene* scene) {
    return (OmPreplanDef){.cookie = PREPLAN_COOKIE, .scene = scene, .nlowest = 3};
}

// ---- trying -----------------------------------------------------------------------------------------------

typedef struct Worker {  // what one attempt needs for itself
    OmBodyWork* work;
    Attempt attempt;  // owns body, view and lifted
    atomic_bool is_busy;
} Worker;

typedef struct Crew {
    const OmPreplanDef* def;
    const OmProgress* progress;
    OmPreplan* plan;
    OmSite site;
    Grid grid;
    OmBodyModel* model;
    void* rest;  // the settled state
    Worker* worker;
    int nworker;
    int todo[OM_PLAN_MAX_BLOCK], ntodo;  // blocks to try
    atomic_int ndone;
    atomic_int status;  // the first failure
    char message[512];  // of the failure
    atomic_flag is_reported, is_reporting;
} Crew;

static OmStatus worker_create(const Crew* c, Worker* w) {
    const OmScene* scene = c->def->scene;
    Attempt* a = &w->attempt;
    OM_TRY(om_body_work_create(c->model, &w->work));
    OM_TRY(om_body_create_shared(c->model, w->work, &a->body));
    OM_TRY(om_view_create(scene, &c->site, &a->view));
    a->lifted = om_alloc(1, om_body_state_size(a->body));
    if (!a->lifted) return OM_NO_MEMORY;
    a->task = &scene->task;
    a->grid = &c->grid;
    a->has_forces = om_engine_capabilities(om_body_engine(a->body)) & OM_ENGINE_FORCES;
    a->force_limit = scene->task.watch_force ? om__force_limit(&scene->task) : HUGE_VAL;
    for (int k = 0; k < OM_MAX_ARM; ++k) {
        a->psm[k] = om_world_place_psm(&c->site, k);
        a->q[k] = om_world_place_tip(&c->site, k).q;
    }
    return OM_OK;
}

static OmStatus crew_create(Crew* c, const OmProgress* progress) {
    const OmScene* scene = c->def->scene;
    OM_TRY(om_site_build(scene, OM_SITE_TWIN, progress, &c->site));
    OM_TRY(om_world_check_visible(scene, &c->site));
    OM_TRY(om__grid_build(&scene->task, &c->site, &c->grid));
    OM_TRY(om_body_model_create(scene, &c->site, 1, &c->model));
    c->worker = om_calloc((size_t)c->nworker, sizeof *c->worker);
    if (!c->worker) return OM_NO_MEMORY;
    for (int k = 0; k < c->nworker; ++k) OM_TRY(worker_create(c, &c->worker[k]));
    OmBody* body = c->worker[0].attempt.body;
    OM_TRY(
        om_body_settle(body, scene->task.time_step, OM_WORLD_SETTLE_SPEED, OM_WORLD_SETTLE_TIME));
    c->rest = om_alloc(1, om_body_state_size(body));
    if (!c->rest) return OM_NO_MEMORY;
    om_body_save(body, c->rest);
    return OM_OK;
}

static void crew_done(Crew* c) {
    for (int k = 0; c->worker && k < c->nworker; ++k) {
        om_view_destroy(c->worker[k].attempt.view);
        om_body_destroy(c->worker[k].attempt.body);
        om_body_work_destroy(c->worker[k].work);
        om_free(c->worker[k].attempt.lifted);
    }
    om_free(c->worker);
    om_free(c->rest);
    om_body_model_destroy(c->model);
    om_site_done(&c->site);
}

// The blocks that are tried: with tissue, and not above an attachment.
static void list_points(Crew* c) {
    OmPreplan* plan = c->plan;
    OmSituation s;
    om_situation_init(&s, c->grid.n, 2 * fmin(c->grid.half.x, c->grid.half.y) / c->grid.n);
    plan->n = c->grid.n;
    for (int b = 0; b < plan->n * plan->n; ++b) {
        OmPreplanPoint* p = &plan->point[b];
        *p = (OmPreplanPoint){.block = b, .arm = -1, .fold = OM_PLAN_PULL};
        for (int k = c->def->scene->world.narm - 1; k >= 0; --k)
            if (s.reachable[b] >> k & 1) p->arm = k;
        if (c->grid.vert[b] < 0)
            p->verdict = OM_PREPLAN_NO_TISSUE;
        else if (om__grid_is_fixed(&c->grid, c->worker[0].attempt.body, b))
            p->verdict = OM_PREPLAN_ATTACHED;
        else if (p->arm < 0)
            p->verdict = OM_PREPLAN_OUT_OF_REACH;
        else
            c->todo[c->ntodo++] = b;
    }
}

static OmStatus try_point(const Crew* c, Worker* w, int block) {
    OmPreplanPoint* p = &c->plan->point[block];
    AttemptResult r;
    om_body_restore(w->attempt.body, c->rest);
    OM_TRY(om__attempt_run(&w->attempt, p->arm, block, &r));
    if (!r.is_held) {
        p->verdict = r.is_in_reach ? OM_PREPLAN_NO_TISSUE : OM_PREPLAN_OUT_OF_REACH;
        return OM_OK;
    }
    p->verdict = r.is_forced ? OM_PREPLAN_FORCE_LIMIT : OM_PREPLAN_HIDDEN;
    p->is_tried = true;
    p->exposes = r.exposes;
    p->npull = r.npull;
    p->fold = r.fold;
    p->visibility = r.visibility;
    p->force = r.force;
    p->naction = r.naction;
    p->nstep = r.nstep;
    return OM_OK;
}

// As many blocks run at once as there are workers: one of them is free.
static Worker* take_worker(Crew* c) {
    for (int k = 0;; k = (k + 1) % c->nworker)
        if (!atomic_exchange(&c->worker[k].is_busy, true)) return &c->worker[k];
}

static void try_points(void* ctx, int begin, int end, int block) {
    (void)block;
    Crew* c = ctx;
    for (int i = begin; i < end && atomic_load(&c->status) >= 0; ++i) {
        Worker* w = take_worker(c);
        OmStatus status = try_point(c, w, c->todo[i]);
        atomic_store(&w->is_busy, false);
        int ndone = atomic_fetch_add(&c->ndone, 1) + 1;
        if (status >= 0 && !atomic_flag_test_and_set(&c->is_reporting)) {
            status = om_progress_report(c->progress, "trying grasping points", ndone, c->ntodo);
            atomic_flag_clear(&c->is_reporting);
        }
        if (status < 0 && !atomic_flag_test_and_set(&c->is_reported)) {
            snprintf(c->message, sizeof c->message, "%s", om_error_message());
            atomic_store(&c->status, status);
        }
    }
}

// ---- choosing -----------------------------------------------------------------------------------------------

// Of lower force; between equals the fewer actions, then the lower block.
static bool is_gentler(const OmPreplanPoint* a, const OmPreplanPoint* b) {
    if (a->force != b->force) return a->force < b->force;
    return a->naction != b->naction ? a->naction < b->naction : a->block < b->block;
}

// The choice among exposing points: the `nlowest` of lowest force, of these the fewest actions.
static void choose_exposing(OmPreplan* plan, int nlowest) {
    OmPreplanPoint* best = NULL;
    for (int k = 0; k < nlowest && k < plan->nexposing; ++k) {
        OmPreplanPoint* next = NULL;
        for (int b = 0; b < plan->n * plan->n; ++b) {
            OmPreplanPoint* p = &plan->point[b];
            if (p->exposes && p->verdict != OM_PREPLAN_MORE_ACTIONS &&
                (!next || is_gentler(p, next)))
                next = p;
        }
        next->verdict = OM_PREPLAN_MORE_ACTIONS;  // one of the lowest; the chosen one is set below
        if (!best || next->naction < best->naction) best = next;
    }
    for (int b = 0; b < plan->n * plan->n; ++b) {
        OmPreplanPoint* p = &plan->point[b];
        bool is_lowest = p->verdict == OM_PREPLAN_MORE_ACTIONS && p->naction > best->naction;
        if (p->exposes && !is_lowest) p->verdict = OM_PREPLAN_MORE_FORCE;
    }
    best->verdict = OM_PREPLAN_CHOSEN;
    plan->chosen = best->block;
}

static void choose_visible(OmPreplan* plan) {
    OmPreplanPoint* best = NULL;
    for (int b = 0; b < plan->n * plan->n; ++b) {
        OmPreplanPoint* p = &plan->point[b];
        if (p->is_tried && (!best || p->visibility > best->visibility)) best = p;
    }
    if (!best) return;
    best->verdict = OM_PREPLAN_CHOSEN;
    plan->chosen = best->block;
}

static const char* fold_words(OmPlanVerb fold) {
    return fold == OM_PLAN_MOVE_AWAY  ? " and a fold away from the camera"
           : fold == OM_PLAN_MOVE_ROI ? " and a fold towards the ROI"
                                      : "";
}

static void write_reason(OmPreplan* plan) {
    char force[32] = "";
    size_t size = sizeof plan->reason;
    if (plan->chosen < 0) {
        snprintf(plan->reason, size,
                 "no grasping point can be tried: every point is attached, out of reach or empty");
        return;
    }
    const OmPreplanPoint* p = &plan->point[plan->chosen];
    int ix = p->block % plan->n + 1, iy = p->block / plan->n + 1;
    if (p->force >= 0) snprintf(force, sizeof force, ", %.2f N", p->force);
    if (plan->is_exposing)
        snprintf(plan->reason, size,
                 "point (%d,%d), PSM%d: %d pull%s%s expose%s %.0f %% of the ROI in %d actions%s",
                 ix, iy, p->arm + 1, p->npull, p->npull == 1 ? "" : "s", fold_words(p->fold),
                 p->npull == 1 && p->fold == OM_PLAN_PULL ? "s" : "", 100 * p->visibility,
                 p->naction, force);
    else
        snprintf(plan->reason, size,
                 "warning: none of %d points exposes %.0f %% of the ROI; the best is (%d,%d), "
                 "PSM%d, with %.0f %% after %d pull%s%s%s",
                 plan->ntried, 100 * plan->visibility, ix, iy, p->arm + 1, 100 * p->visibility,
                 p->npull, p->npull == 1 ? "" : "s", fold_words(p->fold), force);
}

void om__preplan_choose(OmPreplan* plan, int nlowest) {
    plan->chosen = -1;
    for (int b = 0; b < plan->n * plan->n; ++b) {
        plan->ntried += plan->point[b].is_tried;
        plan->nexposing += plan->point[b].exposes;
        plan->nstep += plan->point[b].nstep;
    }
    plan->is_exposing = plan->nexposing > 0;
    if (plan->is_exposing)
        choose_exposing(plan, nlowest);
    else
        choose_visible(plan);
    write_reason(plan);
}

// ---- public -----------------------------------------------------------------------------------------------

static OmStatus check_def(const OmPreplanDef* def) {
    OM_CHECK(def->cookie == PREPLAN_COOKIE, OM_INVALID, "OmPreplanDef was not made by default_def");
    OM_CHECK(def->scene, OM_INVALID, "OmPreplanDef.scene is null");
    OM_CHECK(def->nlowest >= 1, OM_INVALID, "OmPreplanDef.nlowest is %d; 1 or more", def->nlowest);
    OM_CHECK(def->nworker >= 0 && def->nworker <= OM_MAX_WORKER, OM_INVALID,
             "OmPreplanDef.nworker is %d; 0 to %d", def->nworker, OM_MAX_WORKER);
    const OmSceneTask* task = &def->scene->task;
    OM_CHECK(task->force_margin >= 0 && om__force_limit(task) > 0, OM_INVALID,
             "%s: task: force_margin %g N leaves nothing of force_threshold %g N",
             om_scene_label(def->scene), task->force_margin, task->force_threshold);
    const OmTissueEngine* engine;
    OM_TRY(om_body_find_engine(def->scene, OM_SITE_TWIN, &engine));
    return om__check_watch(task, engine);
}

OmStatus om_preplan_run(const OmPreplanDef* def, const OmProgress* progress, OmPreplan* plan) {
    memset(plan, 0, sizeof *plan);
    plan->chosen = -1;
    OM_TRY(check_def(def));
    const OmSceneTask* task = &def->scene->task;
    memcpy(plan->scene, def->scene->name, sizeof plan->scene);
    plan->seed = def->scene->seed;
    plan->visibility = task->visibility;
    plan->force_limit = task->watch_force ? om__force_limit(task) : -1;
    Crew c = {.def = def, .plan = plan, .progress = progress};
    c.nworker = om_worker_count(def->nworker);
    OmStatus status = crew_create(&c, progress);
    if (status < 0) goto done;
    list_points(&c);
    om_parallel_for(c.nworker, c.ntodo, 1, try_points, &c);
    status = (OmStatus)atomic_load(&c.status);
    OM_CHECK_DONE(status >= 0, status, "%s", c.message);
    om__preplan_choose(plan, def->nlowest);
    status = OM_OK;
done:
    crew_done(&c);
    return status;
}

void om_preplan_make_plan(const OmPreplan* preplan, OmPlan* plan) {
    memset(plan, 0, sizeof *plan);
    plan->n = preplan->n;
    plan->grasp_block = plan->grasp_arm = -1;
    if (preplan->chosen < 0) return;
    const OmPreplanPoint* p = &preplan->point[preplan->chosen];
    plan->grasp_block = p->block;
    plan->grasp_arm = p->arm;
    OmPlanVerb verb[OM_PLAN_MAX_HORIZON] = {OM_PLAN_REACH, OM_PLAN_GRASP};
    int n = 2;
    for (int k = 0; k < p->npull && n < OM_PLAN_MAX_HORIZON - 1; ++k) verb[n++] = OM_PLAN_PULL;
    if (p->fold != OM_PLAN_PULL) verb[n++] = p->fold;
    for (int k = 0; k < n; ++k) plan->action[k] = (OmPlanAction){verb[k], p->arm, p->block, k};
    plan->naction = n;
}

void om_preplan_get_exposure(const OmPreplan* preplan, OmExposure exposure[OM_PLAN_MAX_BLOCK]) {
    for (int b = 0; b < OM_PLAN_MAX_BLOCK; ++b) {
        const OmPreplanPoint* p = &preplan->point[b];
        exposure[b] = (OmExposure){.fold = OM_PLAN_PULL};
        if (b >= preplan->n * preplan->n || !p->is_tried) continue;
        exposure[b] = (OmExposure){true, p->exposes, p->npull, p->fold};
    }
}
