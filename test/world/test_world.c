// test_world.c: bodies and the simulated operating field: motion, jaws, observations, noise, forces.
#include "test_alloc.h"

#include "linear_sheet.h"
#include "test_field.h"

static void test_tools_move_straight_at_speed(void** state) {
    (void)state;
    Field f;
    OmScene scene = small_scene();
    scene.world.tool_noise = 0;
    setup(&f, scene);
    OmObservation begin = observe(&f, 0);
    OmPose goal = begin.arm[0].tip;
    goal.p = om_add(goal.p, om_vec3(0.01, 0.02, -0.02));
    assert_ok(om_world_move(f.world, 0, goal, 0.02));
    OmVec3 way = om_normalize(om_sub(goal.p, begin.arm[0].tip.p));
    for (int i = 1; i <= 40; ++i) {
        assert_ok(om_world_advance(f.world, 0.02));
        OmObservation now = observe(&f, 0);
        OmVec3 d = om_sub(now.arm[0].tip.p, begin.arm[0].tip.p);
        assert_near(now.time, 0.02 * i, 1e-12);
        assert_near(om_norm(d), 0.02 * 0.02 * i, 1e-9);
        assert_near(om_norm(om_cross(d, way)), 0, 1e-9);
        assert_true(now.arm[0].is_moving && !now.arm[1].is_moving);
    }
    for (int i = 0; i < 80; ++i) assert_ok(om_world_advance(f.world, 0.02));
    OmObservation end = observe(&f, 0);
    assert_false(end.arm[0].is_moving);
    assert_near(om_distance(end.arm[0].tip.p, goal.p), 0, 1e-9);
    assert_near(om_distance(end.arm[1].tip.p, begin.arm[1].tip.p), 0, 1e-12);
    teardown(&f);
}

static void test_unreachable_goals_are_refused(void** state) {
    (void)state;
    Field f;
    setup(&f, small_scene());
    OmObservation begin = observe(&f, 0);
    OmPose here = begin.arm[0].tip, long_quaternion = here;
    long_quaternion.q.w += 0.01;
    assert_status(om_world_move(f.world, 0, goal_of(&f, 0, om_vec3(5, 0, 0)), 0.02), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "PSM1"));
    assert_status(om_world_move(f.world, 2, here, 0.02), OM_INVALID);
    assert_status(om_world_move(f.world, -1, here, 0.02), OM_INVALID);
    assert_status(om_world_move(f.world, 0, goal_of(&f, 0, om_vec3(NAN, 0, 0)), 0.02), OM_INVALID);
    assert_status(om_world_move(f.world, 0, long_quaternion, 0.02), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "quaternion"));
    assert_status(om_world_move(f.world, 0, here, 0), OM_INVALID);
    assert_status(om_world_advance(f.world, -1), OM_INVALID);
    OmObservation end = observe(&f, 0);
    assert_memory_equal(&begin, &end, sizeof begin);
    teardown(&f);
}

// Reach every grasping point of a 5 x 5 grid at the board and 50 mm above it, each arm its own half.
static void test_every_grasping_point_is_in_reach(void** state) {
    (void)state;
    Field f;
    setup(&f, small_scene());
    for (int b = 0; b < 25; ++b)
        for (int high = 0; high < 2; ++high) {
            OmVec3 p = om_vec3(0.048 * (b % 5 - 2) / 2, 0.048 * (b / 5 - 2) / 2, 0.005);
            p.z += 0.05 * high;
            int arm = p.y > 0;
            if (om_world_move(f.world, arm, to_world(&f, arm, p), 0.1) != OM_OK)
                fail_msg("block %d: %s", b, om_error_message());
        }
    teardown(&f);
}

// A free corner is lifted; the tissue follows, hangs on the tool, and falls back when released.
static void test_lifting_and_letting_go(void** state) {
    (void)state;
    Field f;
    setup(&f, half_held());
    OmBody* truth = om_world_truth(f.world);
    OmVec3 corner = om_vec3(-0.048, -0.048, 0.005);
    grasp_at(&f, 0, corner);
    assert_true(is_holding(&f, 0));
    assert_ok(om_world_move(f.world, 0, to_world(&f, 0, om_vec3(-0.048, -0.048, 0.035)), 0.02));
    for (int i = 0; i < 150; ++i) assert_ok(om_world_advance(f.world, 0.02));
    OmBodyForces forces;
    assert_ok(om_body_get_forces(truth, &forces));
    assert_true(forces.grasp[0].z > 0.02);
    // The pull is less than the grasp by what the ground no longer bears.
    assert_true(om_norm(forces.pull[0]) < om_norm(forces.grasp[0]));
    // At rest the forces on the tissue are in balance, to what still moves.
    OmVec3 sum =
        om_add(om_add(forces.grasp[0], forces.attachment), om_add(forces.contact, forces.weight));
    assert_near(om_norm(sum), 0, 0.03 * om_norm(forces.weight));
    double highest = 0;
    for (int i = 0; i < f.site.mesh.nvert; ++i)
        highest = fmax(highest, om_load3(om_body_x(truth), i).z);
    assert_true(highest > 0.03 && highest < 0.045);
    assert_ok(om_world_set_jaw(f.world, 0, 0.7));
    for (int i = 0; i < 150; ++i) assert_ok(om_world_advance(f.world, 0.02));
    assert_false(is_holding(&f, 0));
    highest = 0;
    for (int i = 0; i < f.site.mesh.nvert; ++i)
        highest = fmax(highest, om_load3(om_body_x(truth), i).z);
    assert_below(highest, 0.0065);
    teardown(&f);
}

// A sheet that nothing holds: lifted off the board it pulls at nothing, and the tool carries its weight.
static void test_free_tissue_is_carried_without_pull(void** state) {
    (void)state;
    OmScene scene = half_held();
    OmSite site;
    OmBody* body;
    OmBodyReport report;
    OmBodyForces forces;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    int nset = site.mesh.nset;
    site.mesh.nset = 0;  // forget what is attached, and everything else
    assert_ok(om_body_create(&scene, &site, 1, &body));
    assert_true(om_body_settle(body, 0.02, 1e-3, 3) >= 0);
    OmPose tip = {om_vec3(0, 0, 0.005), om_quat_identity()};
    assert_ok(om_body_grasp(body, 0, tip, 0.012, NULL));
    assert_ok(om_body_get_forces(body, &forces));
    assert_near(om_norm(forces.pull[0]), 0, 1e-3);
    for (int i = 0; i < 400; ++i) {
        tip.p.z = fmin(0.15, tip.p.z + 0.001);
        assert_ok(om_body_move(body, 0, tip));
        assert_ok(om_body_step(body, 0.02, &report));
    }
    assert_ok(om_body_get_forces(body, &forces));
    double weight = om_norm(forces.weight);
    assert_near_rel(weight, 0.12 * 0.12 * 0.005 * 1000 * 9.81, 1e-6);
    assert_near(om_norm(forces.contact), 0, 1e-9);
    assert_near(forces.grasp[0].z, weight, 0.02 * weight);  // what still swings
    assert_near(om_norm(forces.pull[0]), 0, 0.02 * weight);
    om_body_destroy(body);
    site.mesh.nset = nset;
    om_site_done(&site);
}

// Two tools at mirrored places share the weight of a free sheet, and none of them pulls.
static void test_two_tools_share_the_weight(void** state) {
    (void)state;
    OmScene scene = half_held();
    OmSite site;
    OmBody* body;
    OmBodyReport report;
    OmBodyForces forces;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    int nset = site.mesh.nset;
    site.mesh.nset = 0;
    assert_ok(om_body_create(&scene, &site, 1, &body));
    assert_true(om_body_settle(body, 0.02, 1e-3, 3) >= 0);
    OmPose tip[2] = {{om_vec3(0, -0.03, 0.005), om_quat_identity()},
                     {om_vec3(0, 0.03, 0.005), om_quat_identity()}};
    for (int a = 0; a < 2; ++a) assert_ok(om_body_grasp(body, a, tip[a], 0.012, NULL));
    for (int i = 0; i < 400; ++i) {
        for (int a = 0; a < 2; ++a) {
            tip[a].p.z = fmin(0.15, tip[a].p.z + 0.001);
            assert_ok(om_body_move(body, a, tip[a]));
        }
        assert_ok(om_body_step(body, 0.02, &report));
    }
    assert_ok(om_body_get_forces(body, &forces));
    double weight = 0.12 * 0.12 * 0.005 * 1000 * 9.81;
    assert_near_rel(-forces.weight.z, weight, 1e-6);
    for (int a = 0; a < 2; ++a) {
        assert_near(forces.grasp[a].z, 0.5 * weight, 0.02 * weight);  // what still swings
        assert_near(forces.pull[a].z, 0, 0.02 * weight);
    }
    om_body_destroy(body);
    site.mesh.nset = nset;
    om_site_done(&site);
}

// A sheet without a board hangs on springs: all together they bear its weight, so that their mean stretch is known.
static void test_attachments_are_springs(void** state) {
    (void)state;
    OmScene scene = half_held();
    scene.tissue.has_board = false;
    scene.attach.lo.x = -1;  // every vertex
    scene.attach.stiffness = 5;
    scene.tissue.rayleigh_mass = 20;  // to rest soon
    OmSite site;
    OmBody* body;
    OmBodyReport report;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    int n = om_tet_mesh_find_set(&site.mesh, "attachment")->nvert;
    assert_ok(om_body_create(&scene, &site, 1, &body));
    for (int i = 0; i < 200; ++i) assert_ok(om_body_step(body, 0.02, &report));
    double sum = 0, weight = 0.12 * 0.12 * 0.005 * 1000 * 9.81;
    const OmMeshSet* held = om_tet_mesh_find_set(&site.mesh, "attachment");
    for (int i = 0; i < n; ++i)
        sum += site.mesh.x[3 * held->vert[i] + 2] - om_body_x(body)[3 * held->vert[i] + 2];
    assert_near_rel(sum, weight / 5, 0.01);  // m
    om_body_destroy(body);
    om_site_done(&site);
}

// A patch is pushed through the tissue below it: what the step could not keep is no OM_OK, and is counted.
static void test_bad_steps_are_counted(void** state) {
    (void)state;
    OmScene scene = small_scene();
    OmSite site;
    OmBody* body;
    OmBodyReport report;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_body_create(&scene, &site, 1, &body));
    OmPose tip = {om_vec3(0, 0, 0.005), om_quat_identity()};
    assert_ok(om_body_grasp(body, 0, tip, 0.012, NULL));
    assert_ok(om_body_step(body, 0.02, &report));
    assert_int_equal(report.ninverted, 0);
    assert_int_equal(om_body_nbad(body), 0);
    tip.q = om_quat_axis_angle(om_vec3(1, 0, 0), 3.1);
    tip.p.z = 0.002;
    assert_ok(om_body_move(body, 0, tip));
    assert_status(om_body_step(body, 0.02, &report), OM_NOT_CONVERGED);
    assert_true(report.ninverted > 0);
    assert_int_equal(om_body_nbad(body), 1);
    om_body_destroy(body);
    om_site_done(&site);
}

static void test_jaws_close_on_air(void** state) {
    (void)state;
    Field f;
    setup(&f, small_scene());
    assert_ok(om_world_set_jaw(f.world, 0, 0));
    for (int i = 0; i < 20; ++i) assert_ok(om_world_advance(f.world, 0.02));
    OmObservation obs = observe(&f, 0);
    assert_false(om_arm_is_holding(&obs.arm[0]));
    assert_near(obs.arm[0].jaw, 0, 0);
    assert_ok(om_world_set_jaw(f.world, 0, -0.2));  // jaws that meet close no further
    assert_ok(om_world_advance(f.world, 0.02));
    assert_near(observe(&f, 0).arm[0].jaw, 0, 0);
    teardown(&f);
}

// Tissue stops the jaw at 5 degrees. It is held from 20 degrees on, and known to be held when the jaw rests.
static void test_jaws_close_on_tissue(void** state) {
    (void)state;
    Field f;
    setup(&f, half_held());
    assert_ok(om_world_reset(f.world));
    assert_ok(om_world_move(f.world, 0, to_world(&f, 0, om_vec3(-0.048, -0.048, 0.005)), 0.1));
    for (int i = 0; i < 200 && observe(&f, 0).arm[0].is_moving; ++i)
        assert_ok(om_world_advance(f.world, 0.02));
    OmBody* truth = om_world_truth(f.world);
    assert_ok(om_world_set_jaw(f.world, 0, 0));
    double angle = 40 * OM_PI / 180;
    for (int i = 0; i < 11; ++i) {  // 35 degrees at 3 rad/s take 10.2 steps
        assert_ok(om_world_advance(f.world, 0.02));
        OmArmObservation arm = observe(&f, 0).arm[0];
        angle = fmax(angle - 0.06, 5 * OM_PI / 180);
        assert_near(arm.jaw, angle, 1e-12);
        assert_true(om_body_is_holding(truth, 0) == (angle < 20 * OM_PI / 180));
        assert_false(om_arm_is_holding(&arm));  // it moves
    }
    for (int i = 0; i < 3; ++i) {
        assert_ok(om_world_advance(f.world, 0.02));
        assert_near(observe(&f, 0).arm[0].jaw, 5 * OM_PI / 180, 1e-12);
        assert_true(is_holding(&f, 0));
        assert_false(is_holding(&f, 1));
    }
    assert_ok(om_world_set_jaw(f.world, 0, 0.7));
    assert_false(is_holding(&f, 0));  // commanded open
    for (int i = 0; i < 15; ++i) assert_ok(om_world_advance(f.world, 0.02));
    assert_false(is_holding(&f, 0));
    assert_false(om_body_is_holding(truth, 0));
    assert_ok(om_world_set_jaw(f.world, 0, 0));  // in one large step
    assert_ok(om_world_advance(f.world, 0.5));
    assert_near(observe(&f, 0).arm[0].jaw, 5 * OM_PI / 180, 1e-12);
    teardown(&f);
}

static void test_hidden_at_first(void** state) {
    (void)state;
    for (int seed = 1; seed <= (test_is_slow() ? 17 : 5); ++seed) {
        Field f;
        OmScene scene = small_scene();
        scene.seed = seed;
        setup(&f, scene);
        assert_ok(om_world_advance(f.world, 0.02));
        OmObservation obs = observe(&f, OM_OBSERVE_VISIBILITY);
        if (!(obs.visibility <= 0.05)) fail_msg("layout %d shows %g", seed, obs.visibility);
        teardown(&f);
    }
}

// The ROI in the corner of a narrow picture: what lies outside counts as hidden, and such a scene is refused.
static void test_most_that_can_be_seen(void** state) {
    (void)state;
    OmScene scene = half_held();
    OmSite site;
    OmView* view;
    OmVisibility v;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_world_check_visible(&scene, &site));
    assert_ok(om_view_create(&scene, &site, &view));
    assert_ok(om_view_look(view, NULL, &v));
    assert_int_equal(v.nseen, v.npoint);
    assert_ok(om_view_look(view, site.mesh.x, &v));
    assert_int_equal(v.nseen, 0);
    assert_int_equal(v.nhidden, v.npoint);
    om_view_destroy(view);
    scene.endoscope.fov = 12 * OM_PI / 180;  // 42 mm across at 200 mm; the ROI is 20 to 36 mm off
    assert_ok(om_view_create(&scene, &site, &view));
    assert_ok(om_view_look(view, NULL, &v));
    assert_true(v.noutside > v.npoint / 4 && v.nseen + v.noutside == v.npoint);
    om_view_destroy(view);
    assert_status(om_world_check_visible(&scene, &site), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "fov_deg or distance_mm"));
    // The same by a focal length: half the height over tan 6 degrees.
    scene.endoscope.fov = OM_PI / 2;
    scene.endoscope.focal[0] = scene.endoscope.focal[1] =
        0.5 * scene.endoscope.height / tan(6 * OM_PI / 180);
    OmVisibility same;
    assert_ok(om_view_create(&scene, &site, &view));
    assert_ok(om_view_look(view, NULL, &same));
    assert_int_equal(same.noutside, v.noutside);
    om_view_destroy(view);
    assert_status(om_world_check_visible(&scene, &site), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "focal_px smaller or distance_mm"));
    om_site_done(&site);
}

static void turn_roi(OmSite* site, OmVec3 n) {
    n = om_quat_rotate(site->pose_world_field.q, om_normalize(n));
    for (int i = 0; i < site->nroi; ++i) om_store3(site->roi_n, i, n);
}

// A region that faces away from an endoscope below 45 degrees: the message names an elevation that works.
static void test_an_elevation_that_works_is_named(void** state) {
    (void)state;
    OmScene scene = half_held();
    OmSite site;
    double deg;
    scene.endoscope.elevation = 20 * OM_PI / 180;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    turn_roi(&site, om_vec3(1, 0, 1));  // the endoscope is on the side of negative x
    assert_status(om_world_check_visible(&scene, &site), OM_INVALID);
    const char* said = strstr(om_error_message(), "elevation_deg: ");
    assert_non_null(said);
    assert_int_equal(sscanf(said, "elevation_deg: %lf of the endoscope shows enough", &deg), 1);
    assert_true(deg >= 45 && deg <= 65);
    scene.endoscope.elevation = deg * OM_PI / 180;
    assert_ok(om_world_check_visible(&scene, &site));
    turn_roi(&site, om_vec3(0, 0, -1));
    assert_status(om_world_check_visible(&scene, &site), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no elevation_deg of the endoscope shows enough"));
    om_site_done(&site);
}

// What is measured is off by an offset that stays and a tremor. The arm steers by it: it is at its goal where it
// measures itself there, and in truth off by the offset.
static void test_arms_steer_by_what_they_measure(void** state) {
    (void)state;
    Field exact, noisy;
    OmScene scene = small_scene();
    scene.world.tool_noise = 0;
    setup(&exact, scene);
    scene.world.tool_noise = 0.0005;
    setup(&noisy, scene);
    Field* both[2] = {&exact, &noisy};
    OmPose goal = to_world(&exact, 0, om_vec3(0, -0.03, 0.03));
    OmArmObservation arm[2];
    for (int k = 0; k < 2; ++k) arm[k] = observe(both[k], 0).arm[0];
    // before any motion the truth is the same
    const OmVec3 off = om_sub(arm[1].tip.p, arm[0].tip.p);
    assert_true(om_norm(off) > 1e-4 && om_norm(off) < 2.5e-3);
    double worst = 0;
    for (int k = 0; k < 2; ++k) {
        assert_ok(om_world_move(both[k]->world, 0, goal, 0.05));
        for (int i = 0; i < 300 && arm[k].is_moving + (i < 2); ++i) {
            assert_ok(om_world_advance(both[k]->world, 0.02));
            arm[k] = observe(both[k], 0).arm[0];
        }
        assert_false(arm[k].is_moving);
    }
    assert_near(om_distance(arm[0].tip.p, goal.p), 0, 1e-9);
    for (int i = 0; i < 20; ++i) {
        assert_ok(om_world_advance(noisy.world, 0.02));
        worst = fmax(worst, om_distance(observe(&noisy, 0).arm[0].tip.p, goal.p));
    }
    assert_true(worst > 0 && worst < 2e-4);  // tremor: a twentieth of 0.5 mm along each axis
    const OmSurface *a = om_world_tool(exact.world, 0), *b = om_world_tool(noisy.world, 0);
    OmVec3 apart = {0, 0, 0};
    for (int v = 0; v < a->nvert; ++v)
        apart = om_madd(apart, 1.0 / a->nvert, om_sub(om_load3(b->x, v), om_load3(a->x, v)));
    // the shaft turns about its port, so that the tool as a whole moves a little otherwise than its tip
    assert_true(om_norm(om_add(apart, off)) < 0.6 * om_norm(off));
    assert_true(om_dot(apart, off) < 0);
    teardown(&exact);
    teardown(&noisy);
}

// The offset of a tool is drawn along every axis, of the stated spread: over seeds and arms.
static void test_noise_of_three_axes(void** state) {
    (void)state;
    const int NSEED = test_is_slow() ? 16 : 5;
    double square = 0, product = 0;
    for (int seed = 1; seed <= NSEED; ++seed) {
        OmScene scene = half_held();
        scene.seed = seed;
        Field f[2];
        OmVec3 tip[2][2];
        for (int k = 0; k < 2; ++k) {
            scene.world.tool_noise = 0.0005 * k;
            setup(&f[k], scene);
            OmObservation now = observe(&f[k], 0);
            for (int a = 0; a < 2; ++a) tip[k][a] = now.arm[a].tip.p;
            teardown(&f[k]);
        }
        for (int a = 0; a < 2; ++a) {
            OmVec3 off = om_sub(tip[1][a], tip[0][a]);
            square += om_norm2(off);
            product += off.x * off.y + off.y * off.z + off.z * off.x;
        }
    }
    double n = 3 * 2 * NSEED, variance = 0.0005 * 0.0005 * (1 + 0.05 * 0.05);
    assert_near(square / n, variance, 3 * variance * sqrt(2 / n));  // three standard deviations
    assert_near(product / n, 0, 3 * variance / sqrt(n));
}

static void test_snapshots(void** state) {
    (void)state;
    Field f;
    setup(&f, half_held());
    OmBody* body = om_world_truth(f.world);
    void* block = malloc(om_body_state_size(body));
    om_body_save(body, block);
    uint64_t before = om_body_hash(body);
    OmPose tip = {om_vec3(-0.048, -0.048, 0.005), om_quat_identity()};
    uint64_t after[2];
    for (int k = 0; k < 2; ++k) {
        OmBodyReport report;
        assert_ok(om_body_grasp(body, 0, tip, 0.008, NULL));
        OmPose up = {om_vec3(-0.048, -0.048, 0.02), tip.q};
        assert_ok(om_body_move(body, 0, up));
        for (int i = 0; i < 10; ++i) assert_ok(om_body_step(body, 0.02, &report));
        after[k] = om_body_hash(body);
        om_body_restore(body, block);
        assert_true(om_body_hash(body) == before);
    }
    assert_true(after[0] == after[1] && after[0] != before);
    free(block);
    teardown(&f);
}

// What the ground bore before the first grasp belongs to the snapshot: a body restored to before it is grasped again,
// and its pulls are those of a body that was never grasped elsewhere.
static void test_snapshots_keep_the_ground_at_rest(void** state) {
    (void)state;
    Field f;
    setup(&f, half_held());
    OmBody* body = om_world_truth(f.world);
    void* block = malloc(om_body_state_size(body));
    om_body_save(body, block);  // never grasped
    OmPose tip = {om_vec3(-0.048, -0.048, 0.005), om_quat_identity()};
    OmBodyReport report;
    OmBodyForces first, second, third;
    for (int i = 0; i < 10; ++i) assert_ok(om_body_step(body, 0.02, &report));
    assert_ok(om_body_grasp(body, 0, tip, 0.008, NULL));
    assert_ok(om_body_get_forces(body, &first));
    void* held = malloc(om_body_state_size(body));
    om_body_save(body, held);
    om_body_restore(body, block);  // in the air: nothing has touched the ground yet
    assert_ok(om_body_grasp(body, 0, tip, 0.008, NULL));
    assert_ok(om_body_get_forces(body, &second));
    assert_near(om_distance(second.pull[0], second.grasp[0]), 0, 1e-12);
    om_body_restore(body, held);
    assert_ok(om_body_get_forces(body, &third));
    assert_near(om_distance(third.pull[0], first.pull[0]), 0, 0);
    assert_true(om_norm(first.contact) > 0.01);
    free(held);
    free(block);
    teardown(&f);
}

// A tissue of two materials: the heavier and stiffer half weighs and sinks as it should, for every engine that knows
// elements; and the method of computation is named.
static void test_materials_of_a_site(void** state) {
    (void)state;
    OmScene scene = half_held();
    OmSite site;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    site.nmaterial = 2;
    site.material[0] = (OmSiteMaterial){"fat", 3000, 0.45, 900};
    site.material[1] = (OmSiteMaterial){"gland", 9000, 0.48, 1800};
    scene.tissue.young = scene.tissue.poisson = scene.tissue.density = -1;
    om_site_set_numbers(&scene, &site);
    for (int e = 0; e < site.mesh.ntet; ++e) site.mesh.tet_label[e] = e % 2;
    static const char* const said[] = {
        ("finite elements, neo-hookean, fat: Young's modulus 3000 Pa, Poisson's ratio 0.45; gland: "
         "Young's modulus 9000 Pa, Poisson's ratio 0.48"),
        "particles in clusters", "XPBD, stable-neo-hookean, fat: Young's modulus 3000 Pa",
        "springs on edges, no law, fat:", "ChainMail"};
    scene.tissue.law = OM_NEO_HOOKEAN;
    OmEngineSet set = om_engine_set_default();
    assert_int_equal(set.nengine, 5);
    for (int k = 0; k < set.nengine; ++k) {
        snprintf(scene.tissue.engine, sizeof scene.tissue.engine, "%s", set.engine[k]->name);
        OmBodyParts parts;
        char text[512];
        om_body_describe(&scene, &site, text, sizeof text);
        if (strncmp(text, said[k], strlen(said[k])) != 0)
            fail_msg("\"%s\" instead of \"%s\"", text, said[k]);
        scene.tissue.element = OM_ELEMENT_QUADRATIC;
        OmTissueDef def;
        assert_ok(om_body_make_tissue_def(&scene, &site, &parts, &def));
        OmTissueModel* model;
        assert_true((def.element == OM_ELEMENT_QUADRATIC) == (k == 0));
        assert_ok(om_tissue_create(&def, &model));
        double total = 0, volume = om_tet_mesh_volume(&site.mesh);
        for (int i = 0; i < om_tissue_mesh(model)->nvert; ++i) total += om_tissue_mass(model)[i];
        assert_near_rel(total, 0.5 * (900 + 1800) * volume,
                        1e-9);  // half of a cell's elements each
        om_tissue_destroy(model);
        site.role = OM_SITE_WORLD;  // the truth always has elements
        assert_ok(om_body_make_tissue_def(&scene, &site, &parts, &def));
        assert_true(def.element == OM_ELEMENT_QUADRATIC);
        scene.world.element = OM_ELEMENT_LINEAR;
        assert_ok(om_body_make_tissue_def(&scene, &site, &parts, &def));
        assert_true(def.element == OM_ELEMENT_LINEAR);
        scene.world.element = -1;
        site.role = OM_SITE_TWIN;
    }
    OmBody* body[2];
    OmBodyReport report;
    strcpy(scene.tissue.engine, "fem");
    assert_ok(om_body_create(&scene, &site, 1, &body[0]));
    site.material[1].young = 30000;
    assert_ok(om_body_create(&scene, &site, 1, &body[1]));
    for (int k = 0; k < 2; ++k)
        for (int i = 0; i < 5; ++i) assert_ok(om_body_step(body[k], 0.02, &report));
    assert_true(om_body_hash(body[0]) != om_body_hash(body[1]));
    om_body_destroy(body[0]);
    om_body_destroy(body[1]);
    om_site_done(&site);
}

static OmStatus live_a_little(void* ctx) {
    OmSite site = {0};
    OmWorld* world = NULL;
    OmObservation obs = {0};
    OmStatus status = om_site_build(ctx, OM_SITE_WORLD, NULL, &site);
    if (status == OM_OK) status = om_world_create_simulated(ctx, &site, 1, &world);
    if (status == OM_OK) status = om_world_advance(world, 0.02);
    if (status == OM_OK) status = om_world_observe(world, om_world_sources(world), &obs);
    om_observation_done(&obs);
    om_world_destroy(world);
    om_site_done(&site);
    return status;
}

static void test_failing_allocations_leak_nothing(void** state) {
    (void)state;
    OmScene scene = small_scene();
    scene.tissue.cells = om_vec3(10, 10, 1);
    scene.tissue.world_cells = om_vec3(14, 14, 2);
    scene.endoscope.width = 32, scene.endoscope.height = 24;
    scene.rgbd.width = 32, scene.rgbd.height = 24;
    scene.world.force_noise = 0.1;
    assert_true(test_failing_allocations(live_a_little, &scene, test_stride(11)) > 8);
}

// A sheet dragged over its board by one edge: the board's force leans by the coefficient of friction.
static void test_friction_is_coulombs(void** state) {
    (void)state;
    OmScene scene = linear_sheet();
    scene.tissue.cells = om_vec3(6, 6, 1);
    scene.tissue.young = 1e5;
    scene.attach.stiffness = 1e-6;  // holds nothing
    scene.task.grasp_radius = 0.025;
    const double mu[3] = {-1, 0.3, 0.6};  // below 0: finite elements have none of their own
    for (int k = 0; k < 3; ++k) {
        scene.tissue.friction = mu[k];
        OmSite site;
        OmBody* body;
        assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
        assert_ok(om_body_create(&scene, &site, 1, &body));
        OmPose tip = {om_vec3(site.half_size.x, 0, 0.005), om_quat_identity()};
        tip.p = om_pose_apply(site.pose_world_task, tip.p);
        int nheld;
        assert_ok(om_body_grasp(body, 0, tip, scene.task.grasp_radius, &nheld));
        OmVec3 along = om_quat_rotate(site.pose_world_task.q, om_vec3(1, 0, 0));
        OmVec3 up = om_quat_rotate(site.pose_world_task.q, om_vec3(0, 0, 1));
        for (int i = 0; i < 60; ++i) {  // 24 mm at 20 mm/s: all of it slides
            tip.p = om_madd(tip.p, 4e-4, along);
            OmBodyReport report;
            assert_ok(om_body_move(body, 0, tip));
            assert_true(om_body_step(body, 0.02, &report) >= 0);
        }
        OmBodyForces f;
        assert_ok(om_body_get_forces(body, &f));
        double normal = om_dot(f.contact, up), drag = -om_dot(f.contact, along);
        assert_true(normal > 0.3);  // most of 0.7 N
        assert_near(drag / normal, fmax(mu[k], 0), 0.02);
        om_body_destroy(body);
        om_site_done(&site);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tools_move_straight_at_speed),
        cmocka_unit_test(test_unreachable_goals_are_refused),
        cmocka_unit_test(test_every_grasping_point_is_in_reach),
        cmocka_unit_test(test_lifting_and_letting_go),
        cmocka_unit_test(test_free_tissue_is_carried_without_pull),
        cmocka_unit_test(test_two_tools_share_the_weight),
        cmocka_unit_test(test_attachments_are_springs),
        cmocka_unit_test(test_noise_of_three_axes),
        cmocka_unit_test(test_bad_steps_are_counted),
        cmocka_unit_test(test_jaws_close_on_air),
        cmocka_unit_test(test_jaws_close_on_tissue),
        cmocka_unit_test(test_hidden_at_first),
        cmocka_unit_test(test_most_that_can_be_seen),
        cmocka_unit_test(test_an_elevation_that_works_is_named),
        cmocka_unit_test(test_arms_steer_by_what_they_measure),
        cmocka_unit_test(test_snapshots),
        cmocka_unit_test(test_materials_of_a_site),
        cmocka_unit_test(test_snapshots_keep_the_ground_at_rest),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
        cmocka_unit_test(test_friction_is_coulombs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
