// belief_update.c: the acquisitions of a loop, and the job that estimates attachments from them.
//
// The loop's thread takes acquisitions and keeps the last ones: a second look at the same grasp replaces the first,
// since it shows the tissue lifted higher; of a grasp one of lifted tissue and one of folded tissue is kept. The job
// reads the acquisitions that were kept when it was started; later ones wait for the next estimate.
#include "belief/belief_updater.h"

#include <math.h>
#include <string.h>

#define UPDATE_COOKIE 0x0bda7e5

const char* om_update_stage_text(OmUpdateStage stage) {
    switch (stage) {
    case OM_UPDATE_TAKEN: return "taken";
    case OM_UPDATE_STARTED: return "started";
    case OM_UPDATE_ADOPTED: return "adopted";
    case OM_UPDATE_REFUSED: return "refused";
    case OM_UPDATE_CANCELLED: return "cancelled";
    case OM_UPDATE_DOUBTED: return "doubted";
    }
    return "";
}

OmStatus om_update_estimate_by_match(void* ctx, int nacquisition, const OmAcquisition* acquisition,
                                     const OmProgress* progress, OmMatchEstimate* estimate) {
    const OmMatchAdvice advice = {
        .present = nacquisition > 0 ? acquisition[nacquisition - 1].attached : NULL};
    return om_match_update_with(ctx, nacquisition, acquisition, &advice, progress, estimate);
}

OmStatus om_update_estimate_by_banet(void* ctx, int nacquisition, const OmAcquisition* acquisition,
                                     const OmProgress* progress, OmMatchEstimate* estimate) {
    return om_banet_update(ctx, nacquisition, acquisition, progress, estimate, NULL);
}

// ---- creation -------------------------------------------------------------------------------------------

OmUpdateDef om_update_default_def(const OmScene* scene, const OmWorld* world, const OmSite* site) {
    return (OmUpdateDef){.cookie = UPDATE_COOKIE,
                         .scan = om_scan_default_def(om_site_spacing(site)),
                         .space = om_cloud_default_def(world, site),
                         .settings = scene->update,
                         .timing = world->waits || om_world_state_size(world) > 0
                                       ? OM_UPDATE_AFTER_LATENCY
                                       : OM_UPDATE_WHEN_READY};
}

static OmStatus check_def(const OmUpdateDef* def) {
    const OmSceneUpdate* s = &def->settings;
    OM_CHECK(def->cookie == UPDATE_COOKIE, OM_INVALID, "OmUpdateDef was not made by default_def");
    OM_CHECK(def->space.site, OM_INVALID, "OmUpdateDef.space has no site");
    OM_CHECK(s->latency >= 0 && isfinite(s->latency), OM_INVALID, "OmSceneUpdate.latency is %g s",
             s->latency);
    OM_CHECK(s->keep >= 1 && s->keep <= OM_UPDATE_MAX_KEEP, OM_INVALID,
             "OmSceneUpdate.keep is %d; 1 to %d", s->keep, OM_UPDATE_MAX_KEEP);
    OM_CHECK(isfinite(s->min_lift), OM_INVALID, "OmSceneUpdate.min_lift is %g m", s->min_lift);
    OM_CHECK(s->rest >= 0 && isfinite(s->rest), OM_INVALID, "OmSceneUpdate.rest is %g s", s->rest);
    OM_CHECK((int)def->timing >= OM_UPDATE_AFTER_LATENCY && def->timing <= OM_UPDATE_REPLAYED,
             OM_INVALID, "OmUpdateDef.timing is %d", (int)def->timing);
    OM_CHECK(def->nreplay >= 0 && (def->nreplay == 0 || def->replay_tick), OM_INVALID,
             "OmUpdateDef.nreplay is %d without ticks", def->nreplay);
    return OM_OK;
}

OmStatus om_updater_create(const OmUpdateDef* def, OmUpdater** updater) {
    *updater = NULL;
    OM_TRY(check_def(def));
    OmStatus status = OM_OK;
    OmUpdater* u = om_calloc(1, sizeof *u);
    if (!u) return OM_NO_MEMORY;
    u->def = *def;
    u->nvert = def->space.site->mesh.nvert;
    // vertices and, of quadratic elements, at most six midpoints of each tetrahedron
    const size_t most = (size_t)u->nvert + 6 * (size_t)def->space.site->mesh.ntet;
    for (int a = 0; a < OM_MAX_ARM; ++a) OM_ALLOC_DONE(u->grasp[a].vert, most);
    if (def->nreplay > 0) {
        OM_ALLOC_DONE(u->replay_tick, (size_t)def->nreplay);
        memcpy(u->replay_tick, def->replay_tick, (size_t)def->nreplay * sizeof *u->replay_tick);
    }
    u->def.replay_tick = u->replay_tick;
    *updater = u;
    u = NULL;
done:
    om_updater_destroy(u);
    return status;
}

static void taken_drop(Taken* t) {
    if (!t || --t->nref > 0) return;
    om_scan_done(&t->data.scan);
    om_free(t->x_twin);
    om_free(t->attached);
    for (int a = 0; a < OM_MAX_ARM; ++a) om_free(t->vert[a]);
    om_free(t);
}

void om__updater_reset(OmUpdater* u) {
    om__updater_cancel(u);
    for (int i = 0; i < u->nkept; ++i) taken_drop(u->kept[i]);
    for (int a = 0; a < OM_MAX_ARM; ++a) u->grasp[a].number = 0;
    om_scan_done(&u->rest);
    u->nkept = u->ngrasp = u->ntaken = u->nestimate = 0;
    u->is_due = false;
}

void om_updater_destroy(OmUpdater* u) {
    if (!u) return;
    om__updater_reset(u);
    for (int a = 0; a < OM_MAX_ARM; ++a) om_free(u->grasp[a].vert);
    om_free(u->replay_tick);
    om_free(u);
}

// ---- acquisitions ---------------------------------------------------------------------------------------

void om__updater_grasp(OmUpdater* u, int arm, OmPose pose_world_tip, double radius,
                       const OmBody* twin) {
    HeldGrasp* g = &u->grasp[arm];
    g->number = ++u->ngrasp;
    g->pose_world_tip = pose_world_tip;
    g->radius = radius;
    u->nnode = om_body_node_count(twin);
    g->nvert = om_body_find_held_nodes(twin, arm, pose_world_tip.p, radius, g->vert);
}

void om__updater_take_rest(OmUpdater* u, OmScan* scan) {
    if (u->ngrasp > 0 || u->rest.pixel || !scan->pixel) return;
    u->rest = *scan;
    memset(scan, 0, sizeof *scan);
}

void om__updater_release(OmUpdater* u, int arm) { u->grasp[arm].number = 0; }

// The grasps of all arms that hold tissue, with the tools where the twin has them.
static OmStatus copy_grasps(const OmUpdater* u, const OmPose tip[OM_MAX_ARM], Taken* t) {
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const HeldGrasp* g = &u->grasp[a];
        t->number[a] = g->number;
        if (g->number == 0) continue;
        OM_ALLOC(t->vert[a], (size_t)g->nvert);
        memcpy(t->vert[a], g->vert, (size_t)g->nvert * sizeof *g->vert);
        t->data.grasp[t->data.ngrasp++] = (OmMatchGrasp){.arm = a,
                                                         .pose_world_grasp = g->pose_world_tip,
                                                         .pose_world_now = tip[a],
                                                         .radius = g->radius,
                                                         .nvert = g->nvert,
                                                         .vert = t->vert[a]};
    }
    return OM_OK;
}

// Keep it as the newest.
static void keep(OmUpdater* u, Taken* t) {
    int drop = u->nkept == u->def.settings.keep ? 0 : -1;
    for (int i = 0; i < u->nkept; ++i)
        if (memcmp(u->kept[i]->number, t->number, sizeof t->number) == 0 &&
            u->kept[i]->is_folded == t->is_folded)
            drop = i;
    if (drop >= 0) {
        taken_drop(u->kept[drop]);
        --u->nkept;
        for (int i = drop; i < u->nkept; ++i) u->kept[i] = u->kept[i + 1];
    }
    u->kept[u->nkept++] = t;
    ++u->ntaken;
}

OmStatus om__updater_take(OmUpdater* u, const OmObservation* obs, double time,
                          const OmPose tip[OM_MAX_ARM], const OmBody* twin,
                          const unsigned char* attached, bool is_folded, bool is_wanted) {
    OmStatus status = OM_OK;
    u->nnode = om_body_node_count(twin);
    Taken* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->nref = 1;
    t->is_folded = is_folded;
    t->data.time = time;
    t->data.rest = u->rest.pixel ? &u->rest : NULL;  // as long as the updater's loop
    OM_TRY_DONE(copy_grasps(u, tip, t));
    OM_ALLOC_DONE(t->x_twin, 3 * (size_t)u->nnode);
    om_body_get_nodes(twin, t->x_twin);
    t->data.x_twin = t->x_twin;
    OM_ALLOC_DONE(t->attached, (size_t)u->nvert);
    memcpy(t->attached, attached, (size_t)u->nvert);
    t->data.attached = t->attached;
    OM_TRY_DONE(om_scan_from_observation(&u->def.scan, &u->def.space, obs, &t->data.scan));
    keep(u, t);
    u->is_due |= is_wanted;
    t = NULL;
done:
    taken_drop(t);
    return status;
}

// ---- the job --------------------------------------------------------------------------------------------

static OmStatus run_job(void* ctx, const OmProgress* progress) {
    OmUpdater* u = ctx;
    double begin = om_clock_now();
    OmStatus status =
        u->def.estimate(u->def.estimate_ctx, u->ngiven, u->acquisition, progress, &u->estimate);
    u->wall = om_clock_now() - begin;
    return status;
}

OmStatus om__updater_start(OmUpdater* u, int tick, double time) {
    for (int i = 0; i < u->nkept; ++i) {
        u->given[i] = u->kept[i];
        ++u->given[i]->nref;
        u->acquisition[i] = u->given[i]->data;
    }
    u->ngiven = u->nkept;
    u->estimate = (OmMatchEstimate){0};
    u->start_tick = tick;
    u->start = time;
    u->is_due = false;
    OmStatus status = om_job_start(run_job, u, &u->job);
    if (status < 0) {
        om__updater_drop(u);
        return status;
    }
    ++u->nestimate;
    return OM_OK;
}

bool om__updater_is_ripe(const OmUpdater* u, int tick, double time_step) {
    if (!u->job) return false;
    const int index = u->nestimate - 1;
    switch (u->def.timing) {
    case OM_UPDATE_AFTER_LATENCY:
        return tick - u->start_tick >= (int)ceil(u->def.settings.latency / time_step - 1e-9);
    case OM_UPDATE_WHEN_READY: return om_job_is_finished(u->job);
    case OM_UPDATE_REPLAYED:  // never: below 0, or beyond the record
        return index < u->def.nreplay && u->replay_tick[index] >= 0 &&
               tick >= u->replay_tick[index];
    }
    return false;
}

OmStatus om__updater_join(OmUpdater* u) {
    OmJob* job = u->job;
    u->job = NULL;
    return om_job_join(job);
}

void om__updater_refresh(OmUpdater* u) {
    const size_t n = 3 * (size_t)u->nnode;
    const OmMatchEstimate* e = &u->estimate;
    for (int i = 0; e->x && e->nnode == u->nnode && i < u->ngiven && i < e->nacquisition; ++i)
        memcpy(u->given[i]->x_twin, e->x + (size_t)i * n, n * sizeof *e->x);
}

void om__updater_drop(OmUpdater* u) {
    om_match_estimate_done(&u->estimate);
    u->estimate = (OmMatchEstimate){0};
    for (int i = 0; i < u->ngiven; ++i) taken_drop(u->given[i]);
    u->ngiven = 0;
}

void om__updater_cancel(OmUpdater* u) {
    if (!u->job) return;
    om_job_cancel(u->job);
    om__updater_join(u);  // the outcome does not matter
    om__updater_drop(u);
}
