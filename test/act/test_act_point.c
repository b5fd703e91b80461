// test_act_point.c: grasping points from what the depth camera sees: a twin that lies beside the tissue, blocks
// without tissue, a tool in the way, jaws that close on nothing, and a twin that slid off.
#include <unistd.h>

#include "hidden_world.h"
#include "loop/loop_state.h"
#include "loop_rig.h"
#include "omentum/world_log.h"

// Jaws of 5 mm on tissue with a vertex every 5 mm.
static OmScene cloud_scene(void) {
    OmScene scene = easy_scene();
    scene.tissue.cells = om_vec3(10, 10, 1);
    scene.tissue.world_cells = om_vec3(24, 24, 1);
    scene.task.grasp_radius = 0.005;
    scene.task.max_actions = 12;
    scene.world.narm = 1;
    return scene;
}

static OmLoop* cloud_loop(Rig* g, OmWorld* world, bool is_by_twin) {
    OmLoopDef def = om_loop_default_def(&g->scene.task, world, g->twin, g->planner);
    def.is_by_twin = is_by_twin;
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    return loop;
}

// ---- the points -------------------------------------------------------------------------------------------------

// Height of the true tissue's top at a place, world frame: of its vertex nearest to it seen from above.
static double true_height(Rig* g, OmVec3 p) {
    const OmMeshSet* top = om_tet_mesh_find_set(&g->world_site.mesh, "top");
    const double* x = om_body_x(om_world_truth(g->world));
    double best = INFINITY, z = 0;
    for (int i = 0; i < top->nvert; ++i) {
        const OmVec3 v = om_load3(x, top->vert[i]);
        const double d = hypot(v.x - p.x, v.y - p.y);
        if (d < best) best = d, z = v.z;
    }
    return z;
}

// The sheet of 120 mm, believed 6 mm higher, and then 50 mm to the side: points lie on the true tissue, and where the
// twin's sheet reaches beyond it, there are none.
static void test_points_lie_on_the_true_tissue(void** state) {
    (void)state;
    const OmVec3 shift[2] = {om_vec3(0, 0, 0.006), om_vec3(0.05, 0, 0)};
    for (int k = 0; k < 2; ++k) {
        OmScene scene = cloud_scene();
        scene.registration.shift = shift[k];
        Rig g;
        rig_create(&g, scene);
        OmLoop* loop = cloud_loop(&g, g.world, false);
        assert_ok(om_loop_tick(loop));
        assert_ok(om__cloud_look(&loop->act, -1));
        int nnone = 0;
        for (int b = 0; b < 25; ++b) {
            const GraspPoint* p = &loop->act.point[b];
            // 5 x 5 blocks of 24 mm around the believed middle, 50 mm beside the true one
            const double near_side = -0.06 + 0.024 * (b % 5) + shift[k].x;
            const bool is_beside = near_side > 0.06;
            nnone += p->source == GRASP_NONE;
            assert_true(is_beside == (p->source == GRASP_NONE));
            if (is_beside) continue;
            const OmVec3 tip = om_pose_apply(g.twin_site.pose_world_task, p->tip);
            assert_near(tip.z, true_height(&g, tip), 0.001);
            assert_true(fabs(tip.x) < 0.061 && fabs(tip.y) < 0.061);
            assert_int_equal(p->source, k == 0 ? GRASP_MEASURED : p->source);
            if (k == 0) assert_near(p->off, 0.006, 0.001);
        }
        assert_int_equal(nnone, k == 0 ? 0 : 10);
        om__sense_fluents(&loop->belief, &loop->belief.situation);
        for (int b = 0; b < 25; ++b)
            if (loop->act.point[b].source == GRASP_NONE)
                assert_int_equal(loop->belief.situation.reachable[b], 0);
        om_loop_destroy(loop);
        rig_destroy(&g);
    }
}

// A tool above the sheet hides a part of it: the twin's own points stand there, and only there.
static void test_a_tool_hides_points(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, cloud_scene());
    OmLoop* loop = cloud_loop(&g, g.world, false);
    assert_ok(om_loop_tick(loop));
    assert_ok(om__cloud_look(&loop->act, -1));
    for (int b = 0; b < 25; ++b) {
        assert_int_equal(loop->act.point[b].source, GRASP_AGREED);
        assert_true(loop->act.point[b].off < 0.002);
    }
    const OmPose goal = om__goal_pose(&loop->act, 0, om_vec3(0, 0, 0.01));
    assert_ok(om_world_move(g.world, 0, goal, 0.2));
    for (int i = 0; i < 100; ++i) assert_ok(om_world_advance(g.world, 0.02));
    loop->act.point_tick = -1;
    assert_ok(om__cloud_look(&loop->act, -1));
    int nfilled = 0;
    for (int b = 0; b < 25; ++b) {
        nfilled += loop->act.point[b].source == GRASP_FILLED;
        assert_true(loop->act.point[b].source != GRASP_NONE);
        if (loop->act.point[b].source == GRASP_FILLED) assert_near(loop->act.point[b].off, 0, 0);
    }
    printf("behind a tool: %d of 25 points are the twin's\n", nfilled);
    assert_true(nfilled >= 1 && nfilled <= 5);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// ---- grasps -----------------------------------------------------------------------------------------------------

static OmActionOutcome first_grasp(const OmRetractResult* r) {
    for (int i = 0; i < r->naction; ++i)
        if (r->action[i].verb == OM_PLAN_GRASP) return r->action[i].outcome;
    fail_msg("nothing was grasped in %d actions", r->naction);
    return OM_ACTION_EMPTY;
}

// A twin 6 mm too high: the jaw closes on tissue; by the twin's points it closes on nothing, at every block once.
static void test_a_displaced_twin_is_grasped(void** state) {
    (void)state;
    OmScene scene = cloud_scene();
    scene.registration.shift = om_vec3(0, 0, 0.006);
    Rig g;
    rig_create(&g, scene);
    for (int by_twin = 0; by_twin < 2; ++by_twin) {
        rig_start(&g);
        OmLoop* loop = cloud_loop(&g, g.world, by_twin);
        tick_to_end(loop);
        const OmRetractResult* r = om_loop_result(loop);
        printf("%s: %s\n", by_twin ? "by the twin" : "by the cloud", r->reason);
        assert_int_equal(first_grasp(r), by_twin ? OM_ACTION_EMPTY : OM_ACTION_DONE);
        assert_true(r->is_exposed == !by_twin);
        assert_int_equal(r->effort.nempty, by_twin ? 6 : 0);
        if (!by_twin) {
            assert_true(r->effort.nmeasured >= 1);
            assert_near(r->effort.measured_off, 0.006, 0.001);
        }
        bool was_tried[OM_PLAN_MAX_BLOCK] = {false};
        for (int i = 0; by_twin && i < r->naction; ++i) {
            if (r->action[i].verb != OM_PLAN_GRASP) continue;
            assert_false(was_tried[r->action[i].block]);
            was_tried[r->action[i].block] = true;
        }
        om_loop_destroy(loop);
    }
    rig_destroy(&g);
}

// The depth camera measures 12 mm too short until a jaw has closed on nothing.
static bool is_biased;
static OmStatus biased_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    OmStatus status = om_world_observe(((HiddenWorld*)world)->inner, what, obs);
    for (int a = 0; a < obs->narm; ++a) is_biased &= !om_arm_is_empty(&obs->arm[a]);
    const OmCamera* c = &obs->rgbd.camera;
    for (int i = 0; is_biased && obs->rgbd.depth && i < c->width * c->height; ++i)
        obs->rgbd.depth[i] -= 0.012f;
    return status;
}

// The same block is grasped again, where the new look shows the tissue.
static void test_an_empty_jaw_looks_again(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, cloud_scene());
    HiddenWorld world = hidden_world(g.world, om_world_sources(g.world));
    OmWorldOps ops = *world.head.ops;
    ops.observe = biased_observe;
    world.head.ops = &ops;
    for (int a = 0; a < om_world_narm(g.world); ++a) world.head.psm[a] = om_world_psm(g.world, a);
    is_biased = true;
    OmLoop* loop = cloud_loop(&g, &world.head, false);
    tick_to_end(loop);
    const OmRetractResult* r = om_loop_result(loop);
    int grasp[2] = {-1, -1}, n = 0;
    for (int i = 0; i < r->naction && n < 2; ++i)
        if (r->action[i].verb == OM_PLAN_GRASP) grasp[n++] = i;
    assert_int_equal(n, 2);
    assert_int_equal(r->action[grasp[0]].outcome, OM_ACTION_EMPTY);
    assert_int_equal(r->action[grasp[1]].outcome, OM_ACTION_DONE);
    assert_int_equal(r->action[grasp[0]].block, r->action[grasp[1]].block);
    assert_true(r->action[grasp[1] - 1].is_replanned);  // a new plan begins with a reach
    assert_int_equal(r->effort.nempty, 1);
    assert_true(r->is_exposed && !is_biased);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// The twin's tissue lies 20 mm from where the jaw holds the real one: its own vertex of the block is grasped, and drawn
// to the tip.
static void test_a_twin_is_drawn_to_the_tip(void** state) {
    (void)state;
    OmScene scene = cloud_scene();
    scene.attach.lo = om_vec3(-1, -1, -1);  // drawn, in the twin, by the arm alone
    scene.believed.kind = OM_BELIEF_NONE;
    Rig g;
    rig_create(&g, scene);
    OmLoop* loop = cloud_loop(&g, g.world, false);
    const int block = 12, vert = loop->grid.vert[block];
    const OmVec3 rest = om_load3(g.twin_site.mesh.x, vert);
    // shift the twin's sheet: grasp, move by 20 mm, release
    int nheld;
    const OmQuat q = g.twin_site.pose_world_task.q;
    OmBodyReport report;
    assert_ok(om_body_grasp(g.twin, 1, (OmPose){rest, q}, 0.2, &nheld));
    for (int i = 1; i <= 50; ++i) {
        assert_ok(om_body_move(g.twin, 1, (OmPose){om_add(rest, om_vec3(0.0004 * i, 0, 0)), q}));
        assert_true(om_body_step(g.twin, 0.02, &report) >= 0);
    }
    om_body_release(g.twin, 1);
    assert_near(om_distance(om_load3(om_body_x(g.twin), vert), rest), 0.02, 0.002);
    const OmVec3 tip = om_vec3(rest.x, rest.y, rest.z + 0.012);
    assert_status(om_body_grasp(g.twin, 0, (OmPose){tip, q}, 0.005, &nheld), OM_INVALID);
    assert_ok(om__cloud_grasp_twin(&loop->act, 0, block, (OmPose){tip, q}));
    // above the place of its own vertex by more than the jaws are wide: the nearest one, of a mesh of 12 mm
    assert_true(om_body_is_holding(g.twin, 0));
    assert_near(om_norm(loop->act.arm[0].twin_off), hypot(0.012, 0.004), 0.001);
    om_body_release(g.twin, 0);
    const OmVec3 near = om_vec3(rest.x, rest.y, rest.z + 0.004);
    loop->task.grasp_radius = 0.0041;
    assert_ok(om__cloud_grasp_twin(&loop->act, 0, block, (OmPose){near, q}));
    assert_int_equal(om_body_held_by(g.twin)[vert], 0);
    const double time = om__cloud_draw_time(&loop->act, 0);
    assert_near(time, hypot(0.020, 0.004) / 0.02, 0.1);
    int nstep = 0;
    while (om_norm(loop->act.arm[0].twin_off) > 0 && nstep < 1000)
        om__cloud_draw(&loop->act, 0), ++nstep;
    assert_near(nstep * 0.02, time, 0.021);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// A twin 8 mm too low, whose tissue is drawn to the jaws: exposed, and the recorded observations lead to the same
// decisions and the same twin, to the last bit.
static void test_a_replay_is_the_same(void** state) {
    (void)state;
    OmScene scene = cloud_scene();
    scene.registration.shift = om_vec3(0, 0, -0.008);
    OmRetractResult result[2];
    char path[64];
    snprintf(path, sizeof path, "/tmp/omentum-test-cloud-%ld", (long)getpid());
    Rig g;
    rig_create(&g, scene);
    for (int run = 0; run < 2; ++run) {
        om_body_restore(g.twin, g.rest);
        OmWorld* world;
        if (run)
            assert_ok(om_world_create_replayed(path, &world));
        else
            assert_ok(om_world_create_recorded(g.world, path, &world));
        OmLoop* loop = cloud_loop(&g, world, false);
        tick_to_end(loop);
        assert_ok(om_loop_take_result(loop, &result[run]));
        om_loop_destroy(loop);
        if (!run) assert_ok(om_world_log_end(world));
        om_world_destroy(world);
    }
    printf("too low: %s\n", result[0].reason);
    assert_true(result[0].is_exposed && result[0].effort.nmeasured >= 1 &&
                result[0].effort.ndrawn >= 1);
    assert_near(result[0].effort.measured_off, 0.008, 0.001);
    expect_same(&result[0], &result[1]);
    assert_int_equal(result[0].effort.ndrawn, result[1].effort.ndrawn);
    assert_near(result[0].effort.measured_off, result[1].effort.measured_off, 0);
    om_retract_result_done(&result[0]);
    om_retract_result_done(&result[1]);
    unlink(path);
    rig_destroy(&g);
}

// ---- a twin that slides off ------------------------------------------------------------------------------------

// A board tilted by 45 degrees: its sheet stays where it is attached well enough, and slides off otherwise. Attached at
// its upper end, as far as needed, it stays.
static void test_a_twin_that_slides_off_is_held(void** state) {
    (void)state;
    for (int k = 0; k < 3; ++k) {
        OmScene scene = easy_scene();
        scene.tissue.friction = 0.1;
        scene.attach.lo.x = k == 2 ? -1 : 0.059;  // everywhere, or the far edge, its lower end
        if (k == 1) scene.believed.kind = OM_BELIEF_NONE;
        OmSite site;
        assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
        site.gravity = om_vec3(9.81 * sqrt(0.5), 0, -9.81 * sqrt(0.5));
        OmBody *free_twin, *twin;
        assert_ok(om_body_create(&scene, &site, 1, &free_twin));
        assert_ok(om_body_create(&scene, &site, 1, &twin));
        assert_true(om_body_settle(free_twin, 0.02, OM_WORLD_SETTLE_SPEED, OM_WORLD_SETTLE_TIME) >=
                    0);
        int nadded = -1, nfar = 0, n = 0;
        assert_true(om__rest_settle(&scene, twin, &nadded) >= 0);
        printf("slides by %.1f mm; with %d vertices more %.1f mm\n",
               1e3 * om__rest_shift(free_twin), nadded, 1e3 * om__rest_shift(twin));
        assert_true((om__rest_shift(free_twin) > 0.01) == (nadded > 0));
        assert_true(om__rest_shift(twin) <= 0.01);
        for (int v = 0; v < site.mesh.nvert; ++v) {
            n += om_body_attached(twin)[v];
            nfar += om_body_attached(twin)[v] && site.mesh.x[3 * v] > 0.001;
        }
        assert_int_equal(n, om__count_attached(free_twin) + nadded);
        assert_true(k != 1 || (nadded > 0 && nfar == 0));  // the upper half alone
        assert_true(k != 2 || nadded == 0);
        om_body_destroy(free_twin);
        om_body_destroy(twin);
        om_site_done(&site);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_replay_is_the_same),
        cmocka_unit_test(test_an_empty_jaw_looks_again),
        cmocka_unit_test(test_a_twin_that_slides_off_is_held),
        cmocka_unit_test(test_a_displaced_twin_is_grasped),
        cmocka_unit_test(test_a_twin_is_drawn_to_the_tip),
        cmocka_unit_test(test_a_tool_hides_points),
        cmocka_unit_test(test_points_lie_on_the_true_tissue),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
