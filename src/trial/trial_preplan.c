// trial_preplan.c: every grasping point tried in the twin, and the choice among them (6.4.2).
//
// One body for each worker, all of one model, all from one snapshot at rest; a worker takes the next point. A point's
// result depends on the snapshot alone, so it is the same for any number of workers. Motions run at the loop's speed:
// at three times this speed (the speed of the calibration) viscous forces are a part of the largest pull.
//
// The predicted force may be larger than that of the run: where the truth is softer than the twin it shows the ROI
// earlier, and the fold stops earlier. Times and forces are in doc/notes/defras.md.
#include "omentum/trial_preplan.h"

#include <math.h>
#include <string.h>

#include "omentum/world.h"
#include "trial/trial_crew.h"
#include "trial/trial_kept.h"

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

typedef struct Trying {
    const OmPreplanDef* def;
    OmPreplan* plan;
    Crew crew;
    Kept kept;
    int todo[OM_PLAN_MAX_BLOCK], ntodo;  // blocks to try
} Trying;

// The blocks that are tried: with tissue, and not above an attachment.
static void list_points(Trying* t) {
    OmPreplan* plan = t->plan;
    const Crew* c = &t->crew;
    OmSituation s;
    om_situation_init(&s, c->grid.n, 2 * fmin(c->grid.half.x, c->grid.half.y) / c->grid.n);
    plan->n = c->grid.n;
    for (int b = 0; b < plan->n * plan->n; ++b) {
        OmPreplanPoint* p = &plan->point[b];
        *p = (OmPreplanPoint){.block = b, .arm = -1, .fold = OM_PLAN_PULL};
        for (int k = c->scene->world.narm - 1; k >= 0; --k)
            if (s.reachable[b] >> k & 1) p->arm = k;
        if (c->grid.vert[b] < 0)
            p->verdict = OM_PREPLAN_NO_TISSUE;
        else if (om__grid_is_fixed(&c->grid, c->worker[0].attempt.body, b))
            p->verdict = OM_PREPLAN_ATTACHED;
        else if (p->arm < 0)
            p->verdict = OM_PREPLAN_OUT_OF_REACH;
        else
            t->todo[t->ntodo++] = b;
    }
}

static bool is_sane(const OmPreplanPoint* p, const OmPreplanPoint* now) {
    return p->block == now->block && p->arm == now->arm &&
           (unsigned)p->verdict < OM_PREPLAN_NVERDICT && p->npull >= 0 &&
           p->npull <= OM_PLAN_MAX_HORIZON && isfinite(p->visibility) && isfinite(p->force) &&
           (p->fold == OM_PLAN_PULL || p->fold == OM_PLAN_MOVE_AWAY || p->fold == OM_PLAN_MOVE_ROI);
}

// Was the trial kept?
static bool find_point(Trying* t, int b) {
    size_t size;
    OmPreplanPoint kept;
    const void* data = om__kept_find(&t->kept, b, &size);
    if (!data || size != sizeof kept) return false;
    memcpy(&kept, data, sizeof kept);
    if (!is_sane(&kept, &t->plan->point[b])) return false;
    t->plan->point[b] = kept;
    return true;
}

static OmStatus try_block(const Worker* w, OmPreplanPoint* p) {
    AttemptResult r;
    OM_TRY(om__attempt_run(&w->attempt, p->arm, p->block, &r));
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

static OmStatus try_point(void* ctx, Worker* w, int i) {
    Trying* t = ctx;
    const int b = t->todo[i];
    OmPreplanPoint* p = &t->plan->point[b];
    if (find_point(t, b)) return OM_OK;
    OM_TRY(try_block(w, p));
    return t->kept.fd < 0 ? OM_OK : om__kept_add(&t->kept, b, p, sizeof *p);
}

// ---- choosing -----------------------------------------------------------------------------------------------

// Of lower force; between equals the fewer actions, then the lower block.
static bool is_gentler(const OmPreplanPoint* a, const OmPreplanPoint* b) {
    if (a->force != b->force) return a->force < b->force;
    return a->naction != b->naction ? a->naction < b->naction : a->block < b->block;
}

// The choice among exposing points: of the `nlowest` of lowest force the one of fewest actions.
static void choose_exposing(OmPreplan* plan, int nlowest) {
    OmPreplanPoint* best = NULL;
    for (int k = 0; k < nlowest; ++k) {
        OmPreplanPoint* next = NULL;
        for (int b = 0; b < plan->n * plan->n; ++b) {
            OmPreplanPoint* p = &plan->point[b];
            if (p->exposes && p->verdict != OM_PREPLAN_MORE_ACTIONS &&
                (!next || is_gentler(p, next)))
                next = p;
        }
        if (!next) break;
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

static OmStatus begin(Trying* t, const OmProgress* progress) {
    const OmScene* scene = t->def->scene;
    OmSite site;
    OM_TRY(om_site_build(scene, OM_SITE_TWIN, progress, &site));
    OmStatus status = om_world_check_visible(scene, &site);
    if (status == OM_OK) status = om__crew_create(&t->crew, scene, &site, t->def->nworker);
    om_site_done(&site);
    return status;
}

// Of all that a trial depends on: the scene, and what was read and built from its files.
static OmStatus key_of(const Trying* t, uint64_t* key) {
    static const char version[] = OM_VERSION;
    const OmSite* site = &t->crew.site;
    const size_t layout = sizeof(OmPreplanPoint);
    OmText text = {0};
    OmScene* scene = om_alloc(1, sizeof *scene);
    if (!scene) return OM_NO_MEMORY;
    *scene = *t->def->scene;
    scene->data_root[0] = 0;  // the same files may be moved
    OmStatus status = om_scene_print(scene, false, &text);
    om_free(scene);
    uint64_t h = om_hash(version, sizeof version, OM_HASH_SEED);
    h = om_hash(&layout, sizeof layout, h);
    if (status == OM_OK) h = om_hash(text.str, text.len, h);
    h = om_hash(site->mesh.x, 3 * sizeof(double) * (size_t)site->mesh.nvert, h);
    h = om_hash(site->mesh.tet_vert, 4 * sizeof(int) * (size_t)site->mesh.ntet, h);
    h = om_hash(site->roi_x, 3 * sizeof(double) * (size_t)site->nroi, h);
    const uint64_t rest = om_body_hash(t->crew.worker[0].attempt.body);
    *key = om_hash(&rest, sizeof rest, h);
    om_text_done(&text);
    return status;
}

static OmStatus open_kept(Trying* t) {
    uint64_t key;
    if (!t->def->trials) return OM_OK;
    OM_TRY(key_of(t, &key));
    return om__kept_open(t->def->trials, key, &t->kept);
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
    Trying* t;
    t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->def = def;
    t->plan = plan;
    t->kept.fd = -1;
    OmStatus status = begin(t, progress);
    if (status < 0) goto done;
    OM_TRY_DONE(open_kept(t));
    list_points(t);
    OM_TRY_DONE(om__crew_run(&t->crew, t->ntodo, try_point, t, progress, "trying grasping points"));
    om__preplan_choose(plan, def->nlowest);
    status = OM_OK;
done:
    om__kept_done(&t->kept);
    om__crew_done(&t->crew);
    om_free(t);
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
