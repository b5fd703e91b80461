// trial_crew.c: trials on many bodies of one model, all from one snapshot at rest.
//
// One body for each worker; a worker takes the next trial and begins it from the snapshot, so that the result of a
// trial does not depend on the number of workers.
#include "trial/trial_crew.h"

#include <stdatomic.h>
#include <string.h>

#include "omentum/world.h"

typedef struct Batch {
    Crew* crew;
    CrewJob job;
    void* ctx;
    const OmProgress* progress;
    const char* stage;
    int n;
    atomic_int ndone;
    atomic_int status;  // the first failure
    char message[512];  // of the failure
    atomic_flag is_reported, is_reporting;
} Batch;

static OmStatus worker_create(const Crew* c, Worker* w) {
    const OmScene* scene = c->scene;
    Attempt* a = &w->attempt;
    OM_TRY(om_body_work_create(c->model, &w->work));
    OM_TRY(om_body_create_shared(c->model, w->work, &a->body));
    OM_TRY(om_view_create_of_body(scene, a->body, &a->view));
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

OmStatus om__crew_create(Crew* c, const OmScene* scene, OmSite* site, int nworker) {
    *c = (Crew){.scene = scene, .site = *site, .nworker = om_worker_count(nworker)};
    memset(site, 0, sizeof *site);
    OM_TRY(om__slots_create(c->nworker, &c->free));
    OM_TRY(om__grid_build(&scene->task, &c->site, &c->grid));
    OM_TRY(om_body_model_create(scene, &c->site, 1, &c->model));
    c->worker = om_calloc((size_t)c->nworker, sizeof *c->worker);
    if (!c->worker) return OM_NO_MEMORY;
    for (int k = 0; k < c->nworker; ++k) OM_TRY(worker_create(c, &c->worker[k]));
    OmBody* body = c->worker[0].attempt.body;
    int nadded;
    OM_TRY(om__rest_settle(scene, body, &nadded));
    c->rest = om_alloc(1, om_body_state_size(body));
    if (!c->rest) return OM_NO_MEMORY;
    om_body_save(body, c->rest);
    return OM_OK;
}

void om__crew_done(Crew* c) {
    for (int k = 0; c->worker && k < c->nworker; ++k) {
        om_view_destroy(c->worker[k].attempt.view);
        om_body_destroy(c->worker[k].attempt.body);
        om_body_work_destroy(c->worker[k].work);
        om_free(c->worker[k].attempt.lifted);
    }
    om__slots_destroy(c->free);
    om_free(c->worker);
    om_free(c->rest);
    om_body_model_destroy(c->model);
    om_site_done(&c->site);
    *c = (Crew){.scene = NULL};
}

// A worker that is the only one to report; the progress callback need not be safe for threads.
static OmStatus report(Batch* b) {
    if (atomic_flag_test_and_set(&b->is_reporting)) return OM_OK;
    const OmStatus status = om_progress_report(b->progress, b->stage, atomic_load(&b->ndone), b->n);
    atomic_flag_clear(&b->is_reporting);
    return status;
}

// Before each step of a trial: a trial of a large body takes many seconds.
static OmStatus tick(void* ctx) {
    Batch* b = ctx;
    if (atomic_load(&b->status) < 0) return om_error(OM_CANCELLED, "another trial failed");
    return report(b);
}

static void run_trials(void* ctx, int begin, int end, int block) {
    (void)block;
    Batch* b = ctx;
    for (int i = begin; i < end && atomic_load(&b->status) >= 0; ++i) {
        const int slot = om__slots_take(b->crew->free);
        Worker* w = &b->crew->worker[slot];
        om_body_restore(w->attempt.body, b->crew->rest);
        w->attempt.tick = b->progress ? tick : NULL;
        w->attempt.tick_ctx = b;
        OmStatus status = b->job(b->ctx, w, i);
        om__slots_give(b->crew->free, slot);
        atomic_fetch_add(&b->ndone, 1);
        if (status >= 0) status = report(b);
        if (status < 0 && !atomic_flag_test_and_set(&b->is_reported)) {
            snprintf(b->message, sizeof b->message, "%s", om_error_message());
            atomic_store(&b->status, status);
        }
    }
}

OmStatus om__crew_run(Crew* c, int n, CrewJob job, void* ctx, const OmProgress* progress,
                      const char* stage) {
    Batch b = {.crew = c, .job = job, .ctx = ctx, .progress = progress, .stage = stage, .n = n};
    om_parallel_for(c->nworker, n, 1, run_trials, &b);
    const OmStatus status = (OmStatus)atomic_load(&b.status);
    OM_CHECK(status >= 0, status, "%s", b.message);
    return OM_OK;
}
