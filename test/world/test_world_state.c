// test_world_state.c: goals with orientation, what an arm measures, start and snapshots of a simulated world.
#include "test_alloc.h"
#include "test_field.h"

static double angle_of(OmQuat a, OmQuat b) {
    OmVec3 x = om_quat_rotate(a, om_vec3(1, 0, 0)), u = om_quat_rotate(b, om_vec3(1, 0, 0));
    OmVec3 y = om_quat_rotate(a, om_vec3(0, 1, 0)), v = om_quat_rotate(b, om_vec3(0, 1, 0));
    OmVec3 z = om_quat_rotate(a, om_vec3(0, 0, 1)), w = om_quat_rotate(b, om_vec3(0, 0, 1));
    double cosine = 0.5 * (om_dot(x, u) + om_dot(y, v) + om_dot(z, w) - 1);
    return acos(fmax(-1, fmin(1, cosine)));
}

static OmPose turned(OmPose pose, OmVec3 axis, double angle) {
    pose.q = om_quat_mul(om_quat_axis_angle(axis, angle), pose.q);
    return pose;
}

// 20 mm at 20 mm/s with a turn of 0.4 rad: one second, position and angle advance together.
static void test_orientation_turns_with_the_way(void** state) {
    (void)state;
    Field f;
    OmScene scene = small_scene();
    scene.world.tool_noise = 0;
    setup(&f, scene);
    OmPose begin = observe(&f, 0).arm[0].tip;
    OmPose goal = turned(begin, om_vec3(0, 0, 1), 0.4);
    goal.p.z -= 0.02;
    assert_ok(om_world_move(f.world, 0, goal, 0.02));
    for (int i = 1; i <= 50; ++i) {
        assert_ok(om_world_advance(f.world, 0.02));
        OmArmObservation now = observe(&f, 0).arm[0];
        assert_near(om_distance(now.tip.p, begin.p), 4e-4 * i, 1e-9);
        assert_near(angle_of(begin.q, now.tip.q), 0.4 * i / 50, 1e-6);
    }
    assert_ok(om_world_advance(f.world, 0.02));
    OmArmObservation end = observe(&f, 0).arm[0];
    assert_false(end.is_moving);
    assert_near(om_distance(end.tip.p, goal.p), 0, 1e-12);
    assert_near(angle_of(end.tip.q, goal.q), 0, 1e-6);
    teardown(&f);
}

// A turn that would be faster than the limit sets the pace: 0.5 rad at 1 rad/s, with and without translation.
static void test_turning_has_a_limit(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        Field f;
        OmScene scene = small_scene();
        scene.world.tool_noise = 0;
        setup(&f, scene);
        OmPose begin = observe(&f, 0).arm[0].tip;
        OmPose goal = turned(begin, om_vec3(0, 0, 1), 0.5);
        goal.p.z -= 0.005 * k;
        assert_ok(om_world_move(f.world, 0, goal, 0.1));
        for (int i = 1; i <= 20; ++i) {
            assert_ok(om_world_advance(f.world, 0.02));
            OmArmObservation now = observe(&f, 0).arm[0];
            assert_true(now.is_moving);
            assert_near(angle_of(begin.q, now.tip.q), OM_WORLD_MAX_TURN * 0.02 * i, 1e-6);
            assert_near(om_distance(begin.p, now.tip.p), k * 0.005 * i / 25, 1e-9);
        }
        for (int i = 0; i < 6; ++i) assert_ok(om_world_advance(f.world, 0.02));
        OmArmObservation end = observe(&f, 0).arm[0];
        assert_false(end.is_moving);
        assert_near(angle_of(end.tip.q, goal.q), 0, 1e-6);
        teardown(&f);
    }
}

// Each arm's joints give its own tip: the distance of the tip from the remote centre is known from the insertion.
static void test_joints_and_times_are_measured(void** state) {
    (void)state;
    Field f;
    OmScene scene = small_scene();
    scene.world.tool_noise = 0;
    setup(&f, scene);
    OmPose goal = to_world(&f, 0, om_vec3(-0.02, -0.03, 0.03));
    assert_ok(om_world_move(f.world, 0, goal, 0.05));
    OmVec3 rcm[2];
    for (int a = 0; a < 2; ++a) {
        OmVec3 half = f.site.half_size;
        double side = a == 0 ? -1 : 1;
        rcm[a] = om_vec3(0.03, side * (half.y + 0.045), 2 * half.z + 0.13);
        rcm[a] = om_pose_apply(f.site.pose_world_task, rcm[a]);
    }
    for (int i = 1; i <= 30; ++i) {
        assert_ok(om_world_advance(f.world, 0.02));
        OmObservation obs = observe(&f, 0);
        assert_int_equal(obs.narm, 2);
        for (int a = 0; a < 2; ++a) {
            const OmArmObservation* o = &obs.arm[a];
            OmPsm psm = om_psm_default(OM_PROGRASP, (OmPose){rcm[a], om_quat_identity()});
            OmPose tip = om_psm_forward(&psm, o->q);
            assert_near(o->time, obs.time, 0);
            assert_near(o->time, 0.02 * i, 1e-12);
            assert_near(om_distance(tip.p, rcm[a]), om_distance(o->tip.p, rcm[a]), 1e-9);
            assert_false(o->has_wrench);
            assert_near(om_norm(o->force) + om_norm(o->torque), 0, 0);
        }
    }
    assert_ok(om_world_set_jaw(f.world, 1, 0.2));
    assert_ok(om_world_advance(f.world, 0.02));
    OmObservation obs = observe(&f, 0);
    assert_near(obs.arm[1].jaw_goal, 0.2, 0);
    assert_near(obs.arm[1].jaw_speed, -3, 1e-12);  // rad/s
    assert_near(obs.arm[0].jaw_speed, 0, 0);
    teardown(&f);
}

static void lift_corner(Field* f) {
    grasp_at(f, 0, om_vec3(-0.048, -0.048, 0.005));
    assert_ok(om_world_move(f->world, 0, to_world(f, 0, om_vec3(-0.048, -0.048, 0.03)), 0.05));
    for (int i = 0; i < 20; ++i) assert_ok(om_world_advance(f->world, 0.02));
}

// A held corner hangs on the tool: the measured load is the opposite of the tool's force on the tissue, with the noise
// of the scene.
static void test_forces_are_measured(void** state) {
    (void)state;
    Field f;
    OmScene scene = half_held();
    scene.world.force_noise = 0;
    setup(&f, scene);
    lift_corner(&f);
    OmBodyForces truth;
    assert_ok(om_body_get_forces(om_world_truth(f.world), &truth));
    OmObservation obs = observe(&f, 0);
    assert_true(obs.arm[0].has_wrench && obs.arm[1].has_wrench);
    assert_near(om_norm(om_add(obs.arm[0].force, truth.grasp[0])), 0, 0);
    assert_true(obs.arm[0].force.z < -0.02);  // the weight pulls down
    assert_near(om_norm(obs.arm[1].force), 0, 0);
    f.scene.world.force_noise = 0.1;
    double sum = 0, square = 0;
    enum { N = 100 };
    for (int i = 0; i < N; ++i) {
        assert_ok(om_world_advance(f.world, 0.001));
        OmVec3 free = observe(&f, 0).arm[1].force;
        sum += free.x + free.y + free.z;
        square += om_norm2(free);
    }
    assert_near(sum / (3 * N), 0, 3 * 0.1 / sqrt(3 * N));  // three standard deviations
    assert_near(square / (3 * N), 0.01, 3 * 0.01 * sqrt(2.0 / (3 * N)));
    teardown(&f);
}

// PSM1 alone: the same arm, and no other one in commands, pictures or measurements.
static void test_one_arm(void** state) {
    (void)state;
    Field one, two;
    OmScene scene = half_held();
    scene.world.has_depth_noise = false;
    setup(&two, scene);
    scene.world.narm = 1;
    setup(&one, scene);
    assert_int_equal(om_world_narm(one.world), 1);
    assert_int_equal(om_world_narm(two.world), 2);
    assert_status(om_world_set_jaw(one.world, 1, 0), OM_INVALID);
    assert_status(om_world_move(one.world, 1, om_pose_identity(), 0.02), OM_INVALID);
    assert_null(om_world_tool(one.world, 1));
    assert_null(om_world_psm(one.world, 1));
    assert_ok(om_world_reset(one.world));
    assert_ok(om_world_reset(two.world));
    lift_corner(&one);
    lift_corner(&two);
    assert_true(is_holding(&one, 0));
    OmObservation a = observe(&one, one.world->sources), b = observe(&two, two.world->sources);
    assert_int_equal(a.narm, 1);
    assert_memory_equal(&a.arm[0], &b.arm[0], sizeof a.arm[0]);
    assert_near(a.arm[1].time, 0, 0);  // not written
    assert_true(om_body_hash(om_world_truth(one.world)) == om_body_hash(om_world_truth(two.world)));
    assert_true(hash_color(&a.rgbd.color, 1) != hash_color(&b.rgbd.color, 1));  // PSM2 is in it
    om_observation_done(&a);
    om_observation_done(&b);
    teardown(&one);
    teardown(&two);
    for (int narm = 0; narm <= OM_MAX_ARM + 1; narm += OM_MAX_ARM + 1) {
        OmWorld* world;
        OmSite site = {0};
        scene.world.narm = narm;
        assert_status(om_world_create_simulated(&scene, &site, 1, &world), OM_INVALID);
        assert_null(world);
    }
}

// ---- start ----------------------------------------------------------------------------------------------------

static void test_reset_settles_once(void** state) {
    (void)state;
    Field f;
    setup(&f, half_held());
    OmBody* truth = om_world_truth(f.world);
    uint64_t created = om_body_hash(truth);
    lift_corner(&f);  // before the first reset: the start does not depend on it
    assert_ok(om_world_reset(f.world));
    uint64_t settled = om_body_hash(truth);
    assert_true(settled != created);
    OmObservation first = observe(&f, OM_OBSERVE_VISIBILITY);
    assert_near(first.time, 0, 0);
    assert_near(first.arm[0].jaw, 40 * OM_PI / 180, 1e-12);
    double* x = malloc(3 * sizeof *x * (size_t)f.site.mesh.nvert);
    memcpy(x, om_body_x(truth), 3 * sizeof *x * (size_t)f.site.mesh.nvert);
    assert_ok(om_world_advance(f.world, 0.02));  // at rest: nothing moves faster than the limit
    for (int v = 0; v < f.site.mesh.nvert; ++v) {
        double moved = om_distance(om_load3(x, v), om_load3(om_body_x(truth), v));
        assert_below(moved, 1.5 * 0.02 * OM_WORLD_SETTLE_SPEED);
    }
    lift_corner(&f);
    assert_ok(om_world_reset(f.world));
    assert_true(om_body_hash(truth) == settled);
    assert_memory_equal(om_body_x(truth), x, 3 * sizeof *x * (size_t)f.site.mesh.nvert);
    OmObservation second = observe(&f, OM_OBSERVE_VISIBILITY);
    assert_memory_equal(&first, &second, sizeof first);
    free(x);
    teardown(&f);
}

// Tissue that cannot come to rest in the time allowed is at the start all the same, at every reset.
static void test_reset_of_restless_tissue(void** state) {
    (void)state;
    OmScene scene = half_held();
    scene.tissue.has_board = false;
    scene.attach.stiffness = 1e-3;  // N/m: on such springs it falls for metres
    Field f;
    setup(&f, scene);
    assert_status(om_world_reset(f.world), OM_NOT_CONVERGED);
    uint64_t start = om_body_hash(om_world_truth(f.world));
    assert_ok(om_world_advance(f.world, 0.02));
    assert_status(om_world_reset(f.world), OM_NOT_CONVERGED);
    assert_true(om_body_hash(om_world_truth(f.world)) == start);
    teardown(&f);
}

// ---- snapshots ------------------------------------------------------------------------------------------------

enum { NSTEP = 50 };

// Hash of 50 steps with a motion, a closing jaw and all that is observed on the way.
static uint64_t live(Field* f) {
    uint64_t h = OM_HASH_SEED;
    for (int i = 0; i < NSTEP; ++i) {
        if (i == 5) assert_ok(om_world_set_jaw(f->world, 1, 0));
        assert_ok(om_world_advance(f->world, 0.02));
        OmObservation obs = observe(f, i % 10 ? 0 : f->world->sources);
        h = om_hash(&obs.time, sizeof obs.time, h);
        for (int a = 0; a < obs.narm; ++a) {
            h = om_hash(&obs.arm[a].tip, sizeof obs.arm[a].tip, h);
            h = om_hash(obs.arm[a].q, sizeof obs.arm[a].q, h);
            h = om_hash(&obs.arm[a].jaw, sizeof obs.arm[a].jaw, h);
            h = om_hash(&obs.arm[a].is_moving, sizeof obs.arm[a].is_moving, h);
        }
        h = hash_pictures(&obs, h);
        om_observation_done(&obs);
    }
    uint64_t body = om_body_hash(om_world_truth(f->world));
    return om_hash(&body, sizeof body, h);
}

// Saved in the middle of a lift: the steps after it, repeated, are the same with all that is observed.
static void test_snapshots_repeat_a_run(void** state) {
    (void)state;
    Field f;
    OmScene scene = half_held();
    scene.world.tool_noise = 0.0005;
    setup(&f, scene);
    assert_ok(om_world_reset(f.world));
    lift_corner(&f);
    assert_ok(om_world_move(f.world, 0, to_world(&f, 0, om_vec3(-0.02, -0.048, 0.04)), 0.02));
    size_t size = om_world_state_size(f.world);
    assert_true(size > om_body_state_size(om_world_truth(f.world)));
    void* block = malloc(size);
    assert_ok(om_world_save(f.world, block));
    uint64_t first = live(&f);
    uint64_t other = live(&f);
    assert_ok(om_world_restore(f.world, block));
    assert_true(live(&f) == first);
    assert_true(other != first);
    // Another world of the same scene continues in the same way: the block holds all that changes.
    Field g;
    setup(&g, scene);
    assert_ok(om_world_restore(g.world, block));
    assert_true(live(&g) == first);
    free(block);
    teardown(&g);
    teardown(&f);
}

// The picture after a snapshot is restored is that of the snapshot, with no step between.
static void test_pictures_follow_a_snapshot(void** state) {
    (void)state;
    Field f;
    setup(&f, half_held());
    void* block = malloc(om_world_state_size(f.world));
    assert_ok(om_world_save(f.world, block));
    OmObservation before = observe(&f, OM_OBSERVE_IMAGE);
    uint64_t first = hash_pictures(&before, OM_HASH_SEED);
    om_observation_done(&before);
    lift_corner(&f);
    OmObservation lifted = observe(&f, OM_OBSERVE_IMAGE);
    assert_true(hash_pictures(&lifted, OM_HASH_SEED) != first);
    om_observation_done(&lifted);
    assert_ok(om_world_restore(f.world, block));
    OmObservation after = observe(&f, OM_OBSERVE_IMAGE);
    assert_true(hash_pictures(&after, OM_HASH_SEED) == first);
    om_observation_done(&after);
    free(block);
    teardown(&f);
}

// A kind of world that fills only the required functions: what is optional says that it is missing.
static OmStatus bare_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    (void)what;
    obs->narm = world->narm;
    return OM_OK;
}
static void test_optional_functions(void** state) {
    (void)state;
    const OmWorldOps ops = {.observe = bare_observe};
    OmWorld world = {&ops, 1, OM_OBSERVE_IMAGE};
    OmObservation obs = {0};
    char block[8];
    assert_int_equal(om_world_narm(&world), 1);
    assert_int_equal(om_world_sources(&world), OM_OBSERVE_IMAGE);
    assert_ok(om_world_observe(&world, OM_OBSERVE_IMAGE, &obs));
    assert_status(om_world_observe(&world, OM_OBSERVE_VISIBILITY, &obs), OM_UNAVAILABLE);
    assert_non_null(strstr(om_error_message(), "visibility"));
    assert_status(om_world_set_jaw(&world, 1, 0), OM_INVALID);
    assert_status(om_world_reset(&world), OM_UNAVAILABLE);
    assert_int_equal(om_world_state_size(&world), 0);
    assert_status(om_world_save(&world, block), OM_UNAVAILABLE);
    assert_status(om_world_restore(&world, block), OM_UNAVAILABLE);
    assert_null(om_world_truth(&world));
    assert_null(om_world_tool(&world, 0));
}

static OmStatus reset_and_save(void* ctx) {
    OmSite site = {0};
    OmWorld* world = NULL;
    OmStatus status = om_site_build(ctx, OM_SITE_WORLD, NULL, &site);
    if (status == OM_OK) status = om_world_create_simulated(ctx, &site, 1, &world);
    if (status == OM_OK) status = om_world_reset(world);
    om_world_destroy(world);
    om_site_done(&site);
    return status;
}

static void test_failing_allocations_leak_nothing(void** state) {
    (void)state;
    OmScene scene = small_scene();
    scene.tissue.cells = om_vec3(10, 10, 1);
    scene.tissue.world_cells = om_vec3(14, 14, 2);
    assert_true(test_failing_allocations(reset_and_save, &scene, test_stride(11)) > 4);
}

// One of the attached vertices becomes a spring.
static void loosen_one(OmBody* body, int n) {
    int num = 0, *vert = om_alloc((size_t)n, sizeof *vert);
    double* anchor = om_alloc(3 * (size_t)n, sizeof *anchor);
    double* stiffness = om_calloc((size_t)n, sizeof *stiffness);
    for (int i = 0; i < n; ++i) {
        if (!om_body_attached(body)[i]) continue;
        vert[num] = i;
        om_store3(anchor, num++, om_load3(om_body_x(body), i));
    }
    stiffness[0] = 1;
    assert_ok(om_body_set_attachment(body, num, vert, anchor, stiffness));
    om_free(vert), om_free(anchor), om_free(stiffness);
}

// The first grasp of a body asks for its forces, which allocate where some vertices are held still and others by
// springs.
static void test_a_grasp_without_memory_is_an_error(void** state) {
    (void)state;
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    Field f;
    OmScene scene = half_held();
    setup(&f, scene);
    OmBody* truth = om_world_truth(f.world);
    loosen_one(truth, f.site.mesh.nvert);
    OmVec3 corner = om_vec3(-0.05, -0.05, 0.005);
    assert_ok(om_world_move(f.world, 0, to_world(&f, 0, corner), 0.1));
    for (int i = 0; i < 200 && observe(&f, 0).arm[0].is_moving; ++i)
        assert_ok(om_world_advance(f.world, 0.02));
    assert_ok(om_world_set_jaw(f.world, 0, 0));
    void* block = malloc(om_world_state_size(f.world));
    for (int i = 0; i < 50 && !om_body_is_holding(truth, 0); ++i) {
        assert_ok(om_world_save(f.world, block));
        assert_ok(om_world_advance(f.world, 0.02));
    }
    assert_true(om_body_is_holding(truth, 0));
    assert_ok(om_world_restore(f.world, block));
    om_allocator_set(&failing);
    test_alloc_countdown = 0;
    OmStatus status = om_world_advance(f.world, 0.02);
    om_allocator_set(NULL);
    assert_int_equal(status, OM_NO_MEMORY);
    assert_false(om_body_is_holding(truth, 0));
    assert_ok(om_world_advance(f.world, 0.02));  // the next step grasps
    assert_true(om_body_is_holding(truth, 0));
    free(block);
    teardown(&f);
}

// A body that is given a modulus moves as one that was made with it.
static void test_a_body_takes_a_modulus(void** state) {
    (void)state;
    const OmScene scene = small_scene();
    OmSite site, other;
    OmBody *changed, *made;
    OmBodyReport report;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &other));
    other.young *= 0.3;
    assert_ok(om_body_create(&scene, &site, 1, &changed));
    assert_ok(om_body_create(&scene, &other, 1, &made));
    for (int i = 0; i < 10; ++i) assert_true(om_body_step(changed, 0.02, &report) >= 0);
    void* now = malloc(om_body_state_size(changed));
    om_body_save(changed, now);
    om_body_restore(made, now);
    assert_status(om_body_set_young(changed, &scene, 0), OM_INVALID);
    assert_status(om_body_set_young(changed, &scene, NAN), OM_INVALID);
    assert_ok(om_body_set_young(changed, &scene, 0.3));
    assert_true(om_body_hash(changed) == om_body_hash(made));
    assert_true(om_body_site(changed) == &site);
    for (int i = 0; i < 10; ++i) {
        assert_true(om_body_step(changed, 0.02, &report) >= 0);
        assert_true(om_body_step(made, 0.02, &report) >= 0);
    }
    assert_true(om_body_hash(changed) == om_body_hash(made));
    // and not as one that kept its modulus
    assert_ok(om_body_set_young(changed, &scene, 1));
    om_body_restore(changed, now);
    for (int i = 0; i < 10; ++i) assert_true(om_body_step(changed, 0.02, &report) >= 0);
    assert_true(om_body_hash(changed) != om_body_hash(made));
    free(now);
    om_body_destroy(changed);
    om_body_destroy(made);
    om_site_done(&site);
    om_site_done(&other);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_orientation_turns_with_the_way),
        cmocka_unit_test(test_a_body_takes_a_modulus),
        cmocka_unit_test(test_turning_has_a_limit),
        cmocka_unit_test(test_joints_and_times_are_measured),
        cmocka_unit_test(test_forces_are_measured),
        cmocka_unit_test(test_one_arm),
        cmocka_unit_test(test_reset_settles_once),
        cmocka_unit_test(test_reset_of_restless_tissue),
        cmocka_unit_test(test_snapshots_repeat_a_run),
        cmocka_unit_test(test_pictures_follow_a_snapshot),
        cmocka_unit_test(test_optional_functions),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
        cmocka_unit_test(test_a_grasp_without_memory_is_an_error),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
