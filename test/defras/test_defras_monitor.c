// test_defras_monitor.c: distance, rest, warning state and timing of the monitor.
#include "test_alloc.h"

#include "easy_scene.h"
#include "omentum/defras_monitor.h"
#include "omentum/shape_closest.h"

#define RADIUS 0.011  // m, of the grasp

// A simulated world and a twin, one arm that lifts both.
typedef struct Pair {
    OmScene scene;
    OmSite twin_site, world_site;
    const OmSite* site;  // of the twin
    OmWorld* world;
    OmBody* twin;
    OmMonitor* monitor;
    OmObservation obs;
    bool has_grasped;
    double time;  // s
} Pair;

// `is_equal`: the twin has the world's own mesh and numbers.
static void pair_create(Pair* p, OmScene scene, bool is_equal) {
    *p = (Pair){.scene = scene};
    assert_ok(om_site_build(&p->scene, OM_SITE_WORLD, NULL, &p->world_site));
    assert_ok(om_site_build(&p->scene, OM_SITE_TWIN, NULL, &p->twin_site));
    p->site = is_equal ? &p->world_site : &p->twin_site;
    assert_ok(om_body_create(&p->scene, p->site, 1, &p->twin));
    assert_ok(om_world_create_simulated(&p->scene, &p->world_site, 1, &p->world));
    assert_true(om_body_settle(p->twin, scene.task.time_step, OM_WORLD_SETTLE_SPEED,
                               OM_WORLD_SETTLE_TIME) >= 0);
    assert_true(om_world_reset(p->world) >= 0);
    OmMonitorDef def = om_monitor_default_def(&p->scene, p->world, p->site);
    assert_ok(om_monitor_create(&def, &p->monitor));
}

static void pair_destroy(Pair* p) {
    om_observation_done(&p->obs);
    om_monitor_destroy(p->monitor);
    om_world_destroy(p->world);
    om_body_destroy(p->twin);
    om_site_done(&p->twin_site);
    om_site_done(&p->world_site);
}

static void pair_look(Pair* p, OmMonitorFrame* frame) {
    assert_ok(om_world_observe(p->world, om_monitor_sources(p->monitor, p->world), &p->obs));
    assert_ok(om_monitor_frame(p->monitor, &p->obs, om_body_x(p->twin), p->has_grasped, frame));
}

static void pair_step(Pair* p) {
    assert_ok(om_world_advance(p->world, p->scene.task.time_step));
    assert_ok(om_world_observe(p->world, 0, &p->obs));
    if (om_body_is_holding(p->twin, 0)) {
        OmPose tip = {p->obs.arm[0].tip.p, p->site->pose_world_task.q};
        assert_ok(om_body_move(p->twin, 0, tip));
    }
    OmBodyReport report;
    assert_true(om_body_step(p->twin, p->scene.task.time_step, &report) >= 0);
}

// PSM1 moves to a point of the task frame.
static void pair_move(Pair* p, OmVec3 at) {
    assert_ok(om_world_observe(p->world, 0, &p->obs));
    OmPose goal = {om_pose_apply(p->site->pose_world_task, at), p->obs.arm[0].tip.q};
    assert_ok(om_world_move(p->world, 0, goal, 0.05));
    do pair_step(p);
    while (p->obs.arm[0].is_moving);
}

static void pair_grasp(Pair* p, OmVec3 at) {
    pair_move(p, at);
    assert_ok(om_world_set_jaw(p->world, 0, 0));
    for (int i = 0; i < 20; ++i) pair_step(p);
    int nheld;
    OmPose tip = {p->obs.arm[0].tip.p, p->site->pose_world_task.q};
    assert_ok(om_body_grasp(p->twin, 0, tip, RADIUS, &nheld));
    p->has_grasped = true;
}

static const OmVec3 corner = {-0.045, -0.03, 0.005};

static void test_lift(OmScene scene, bool is_equal, double bound, const char* name) {
    Pair p;
    OmMonitorFrame f;
    pair_create(&p, scene, is_equal);
    for (int i = 0; i < 5; ++i) {
        pair_step(&p);
        pair_look(&p, &f);
    }
    pair_grasp(&p, corner);
    double most = 0;
    for (int lift = 1; lift <= 4; ++lift) {
        pair_move(&p, om_madd(corner, 0.01 * lift, om_vec3(0, 0, 1)));
        pair_look(&p, &f);
        assert_int_equal(f.state, 0);
        assert_true(f.npoint >= 500 && !f.is_stale && !f.is_blind);
        most = fmax(most, fabs(f.mu));
    }
    printf("%s: rest %.3f mm, largest mu %.3f mm, %d points\n", name, 1e3 * f.rest, 1e3 * most,
           f.npoint);
    assert_below(most, bound);
    pair_destroy(&p);
}

static OmScene exact_scene(void) {
    OmScene s = easy_scene();
    s.world.young_factor = 1;
    s.world.tool_noise = 0;
    s.world.has_depth_noise = false;
    return s;
}

static void a_lift_of_an_equal_twin_has_no_discrepancy(void** state) {
    (void)state;
    test_lift(exact_scene(), true, 0.05e-3, "equal, no noise");
}

static void a_lift_of_another_mesh_with_noise_has_little(void** state) {
    (void)state;
    test_lift(easy_scene(), false, 1e-3, "other mesh, stiffness and noise");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_lift_of_an_equal_twin_has_no_discrepancy),
        cmocka_unit_test(a_lift_of_another_mesh_with_noise_has_little),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
