// loop_rig.h: world, twin and planner of a small scene, for tests of the loop as an object.
#ifndef OMENTUM_TEST_LOOP_RIG_H
#define OMENTUM_TEST_LOOP_RIG_H

#include <stdlib.h>

#include "easy_scene.h"
#include "omentum/loop.h"
#include "test_common.h"

// World, twin and planner of a scene, at rest; `start` brings them back there.
typedef struct Rig {
    OmScene scene, truth;  // body and world borrow them
    OmSite twin_site, world_site;
    OmBody* twin;
    OmWorld* world;
    OmPlanner* planner;
    void* rest;  // of the twin
} Rig;

static inline OmPlanner* make_planner(const OmScene* scene) {
    OmPlannerDef def = om_planner_default_def();
    OmPlanner* planner;
    def.max_lift = (int)ceil(scene->task.max_height / scene->task.pull_step - 1e-9);
    assert_ok(om_planner_create(&def, &planner));
    return planner;
}

// The world's tissue is that of another scene, and its modulus times `young`. `role`: of it; OM_SITE_TWIN: it has the
// mesh and the material of a twin.
static inline void rig_create_apart(Rig* g, OmScene scene, const OmScene* truth, OmSiteRole role,
                                    double young, int nworker) {
    *g = (Rig){.scene = scene, .truth = *truth};
    assert_ok(om_site_build(&g->scene, OM_SITE_TWIN, NULL, &g->twin_site));
    assert_ok(om_site_build(&g->truth, role, NULL, &g->world_site));
    g->world_site.young *= young;
    assert_ok(om_body_create(&g->scene, &g->twin_site, nworker, &g->twin));
    assert_ok(om_world_create_simulated(&g->truth, &g->world_site, nworker, &g->world));
    assert_true(om_body_settle(g->twin, scene.task.time_step, OM_WORLD_SETTLE_SPEED,
                               OM_WORLD_SETTLE_TIME) >= 0);
    assert_true(om_world_reset(g->world) >= 0);
    g->rest = malloc(om_body_state_size(g->twin));
    om_body_save(g->twin, g->rest);
    g->planner = make_planner(&g->scene);
}

static inline void rig_create_as(Rig* g, OmScene scene, OmSiteRole role, int nworker) {
    rig_create_apart(g, scene, &scene, role, 1, nworker);
}

static inline void rig_create_with(Rig* g, OmScene scene, int nworker) {
    rig_create_as(g, scene, OM_SITE_WORLD, nworker);
}

static inline void rig_create(Rig* g, OmScene scene) { rig_create_with(g, scene, 1); }

static inline void rig_start(Rig* g) {
    om_body_restore(g->twin, g->rest);
    assert_true(om_world_reset(g->world) >= 0);
}

static inline void rig_destroy(Rig* g) {
    om_planner_destroy(g->planner);
    om_world_destroy(g->world);
    om_body_destroy(g->twin);
    om_site_done(&g->twin_site);
    om_site_done(&g->world_site);
    free(g->rest);
}

static inline OmLoop* make_loop(Rig* g, const OmLoopListener* listener) {
    OmLoopDef def = om_loop_default_def(&g->scene.task, g->world, g->twin, g->planner);
    def.truth = om_world_truth(g->world);
    def.listener = listener;
    def.nlistener = listener ? 1 : 0;
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    return loop;
}

static inline void tick_to_end(OmLoop* loop) {
    while (om_loop_phase(loop) != OM_LOOP_ENDED) assert_ok(om_loop_tick(loop));
}

static inline OmStatus give(OmLoop* loop, OmLoopCommandKind kind) {
    return om_loop_command(loop, &(OmLoopCommand){kind});
}

static inline OmScene object_scene(void) {
    OmScene scene = easy_scene();
    scene.tissue.cells = om_vec3(6, 6, 1);
    scene.tissue.world_cells = om_vec3(9, 9, 1);
    scene.task.grasp_radius = 0.015;
    return scene;
}

// Actions, samples and hash without the times that a clock measured.
static inline void expect_same(const OmRetractResult* a, const OmRetractResult* b) {
    assert_true(a->hash == b->hash);
    assert_int_equal(a->outcome, b->outcome);
    assert_string_equal(a->reason, b->reason);
    assert_int_equal(a->naction, b->naction);
    assert_int_equal(a->nsample, b->nsample);
    assert_int_equal(a->nplan, b->nplan);
    assert_near(a->time, b->time, 0);
    for (int i = 0; i < a->naction; ++i) {
        assert_int_equal(a->action[i].verb, b->action[i].verb);
        assert_int_equal(a->action[i].block, b->action[i].block);
        assert_int_equal(a->action[i].outcome, b->action[i].outcome);
        assert_near(a->action[i].begin, b->action[i].begin, 0);
        assert_near(a->action[i].end, b->action[i].end, 0);
        assert_near(a->action[i].force_max, b->action[i].force_max, 0);
    }
    for (int i = 0; i < a->nsample; ++i) {
        assert_near(a->sample[i].visibility, b->sample[i].visibility, 0);
        assert_near(a->sample[i].force, b->sample[i].force, 0);
        assert_near(a->sample[i].speed_rate, b->sample[i].speed_rate, 0);
    }
}

#endif
