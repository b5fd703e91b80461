// 17_follow_the_camera.c: a twin that believes in no attachment learns from the depth camera where the tissue is held.
//
// The loop lifts the tissue. After each pull it looks through the depth camera, and a job in the background estimates
// the attachments. The twin adopts an accepted estimate while the arms work, and the next plan avoids what is held.
#include <stdio.h>

#include "omentum/omentum.h"

// ---- a listener that prints what was learnt ----------------------------------------------------------------

static OmStatus on_update(void* ctx, const OmLoop* loop, const OmUpdateEvent* event) {
    (void)loop;
    int* nadopted = ctx;
    if (event->stage == OM_UPDATE_TAKEN)
        printf("%5.1f s  seen: %d points\n", event->time, event->acquisition->scan.npoint);
    if (event->stage == OM_UPDATE_REFUSED)
        printf("%5.1f s  the twin stays unchanged: %s\n", event->time, event->reason);
    if (event->stage != OM_UPDATE_ADOPTED) return OM_OK;
    const OmMatchEstimate* e = event->estimate;
    int nattached = 0;
    for (int v = 0; v < e->nvert; ++v) nattached += e->attached[v] != 0;
    printf(
        "%5.1f s  adopted: %d of %d vertices are attached; the scan is %.2f mm from the twin (median)\n",
        event->time, nattached, e->nvert, 1e3 * e->after_median);
    ++*nadopted;
    return OM_OK;
}

static OmStatus on_action_end(void* ctx, const OmLoop* loop, const OmRetractAction* action) {
    (void)ctx, (void)loop;
    printf("%5.1f s  %s; %.0f %% of the region seen\n", action->end,
           om_action_outcome_text(action->outcome), 100 * action->visibility);
    return OM_OK;
}

// ---- the operation -----------------------------------------------------------------------------------------

// What a loop needs, made from one scene.
typedef struct Parts {
    OmSite twin_site, world_site;
    OmBody* twin;
    OmWorld* world;
    OmPlanner* planner;
    OmMatch* match;  // the twin as a static problem; the job alone uses it
    OmUpdater* updater;
    OmLoop* loop;
} Parts;

static void parts_done(Parts* p) {
    om_loop_destroy(p->loop);  // cancels a job that still runs
    om_updater_destroy(p->updater);
    om_match_destroy(p->match);
    om_planner_destroy(p->planner);
    om_world_destroy(p->world);
    om_body_destroy(p->twin);
    om_site_done(&p->world_site);
    om_site_done(&p->twin_site);
}

static OmStatus parts_build(const OmScene* scene, Parts* p) {
    OmPlannerDef planner = om_planner_default_def();
    OmStatus status = om_site_build(scene, OM_SITE_TWIN, NULL, &p->twin_site);
    if (status >= 0) status = om_site_build(scene, OM_SITE_WORLD, NULL, &p->world_site);
    if (status >= 0) status = om_body_create(scene, &p->twin_site, 0, &p->twin);
    if (status >= 0) status = om_world_create_simulated(scene, &p->world_site, 0, &p->world);
    if (status >= 0) status = om_planner_create(&planner, &p->planner);
    // the tissue comes to rest on its ground, in the twin and in the world
    if (status >= 0)
        status = om_body_settle(p->twin, scene->task.time_step, OM_WORLD_SETTLE_SPEED,
                                OM_WORLD_SETTLE_TIME);
    if (status >= 0) status = om_world_reset(p->world);
    if (status < 0) return status;
    OmMatchDef match = om_match_default_def(scene, &p->twin_site);
    status = om_match_create(&match, &p->match);
    if (status < 0) return status;
    OmUpdateDef update = om_update_default_def(scene, p->world, &p->twin_site);
    update.estimate = om_update_estimate_by_match;
    update.estimate_ctx = p->match;
    return om_updater_create(&update, &p->updater);
}

static OmStatus operate(const OmScene* scene, const OmLoopListener* listener, Parts* p) {
    OmLoopDef def = om_loop_default_def(&scene->task, p->world, p->twin, p->planner);
    def.listener = listener;
    def.nlistener = 1;
    def.updater = p->updater;
    OmStatus status = om_loop_create(&def, &p->loop);
    while (status >= 0 && om_loop_phase(p->loop) != OM_LOOP_ENDED) status = om_loop_tick(p->loop);
    return status;
}

int main(void) {
    OmScene scene = om_scene_default();
    scene.seed = 1;
    scene.tissue.cells = om_vec3(6, 6, 1);  // smaller than by default: some seconds
    scene.believed.kind = OM_BELIEF_NONE;
    scene.task.max_actions = 5;
    int nadopted = 0;
    OmLoopListener listener = {
        .ctx = &nadopted, .on_action_end = on_action_end, .on_update = on_update};
    Parts parts = {0};
    OmStatus status = parts_build(&scene, &parts);
    if (status >= 0) status = operate(&scene, &listener, &parts);
    if (status < 0)
        fprintf(stderr, "%s\n", om_error_message());
    else
        printf("%5.1f s  %s\n", om_loop_result(parts.loop)->time,
               om_loop_result(parts.loop)->reason);
    parts_done(&parts);
    return status >= 0 && nadopted > 0 ? 0 : 1;
}
