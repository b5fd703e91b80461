// test_contact_obstacle.c: boxes on boards, slopes and balls: weights are carried, nothing sticks or sinks.
#include "test_rig.h"

static const OmContactPlane plane = {{0, 0, 0}, {0, 0, 2}};  // any length will do

// A box of 40 x 40 x 20 mm whose underside is at `bottom`, on planes or one SDF.
static void start(TestRig* r, double bottom, const OmContactDef* contact) {
    rig_box(r, om_vec3(-0.02, -0.02, bottom), om_vec3(0.02, 0.02, bottom + 0.02), 4, 4, 2);
    r->def.rayleigh_stiffness = 0.01;
    r->def.solver.tolerance = 1e-5;
    rig_start(r);
    rig_contact(r, contact);
}

static OmContactDef on_board(OmTissueObstacle* board) {
    *board = om_plane_obstacle(&plane);
    return rig_on(board);
}

static const double weight = 1000 * 0.04 * 0.04 * 0.02 * 9.81;

// At rest on a board: the board's force is the weight, and so is the sum over vertices; none pulls.
static void test_box_rests(void** context) {
    (void)context;
    TestRig r;
    OmTissueObstacle board;
    OmContactDef def = on_board(&board);
    start(&r, 0.002, &def);
    OmContactReport report;
    for (int n = 0; n < 150; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
        assert_below(report.penetration, 1e-5);
    }
    assert_near(report.force.z, weight, 1e-3 * weight);
    assert_near(hypot(report.force.x, report.force.y), 0, 1e-9);
    OmVec3 sum = {0, 0, 0};
    int npushed = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        OmVec3 f = om_load3(om_tissue_contact_force(r.s), i);
        assert_true(f.z >= 0);
        npushed += f.z > 0;
        sum = om_add(sum, f);
    }
    assert_int_equal(npushed, report.ncontact);
    assert_near(om_norm(om_sub(sum, report.force)), 0, 1e-15);
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_near(om_norm(om_sub(f.contact, report.force)), 0, 1e-15);
    rig_done(&r);
}

// Lifting a box that rests takes its weight and no more, from the first millimetre: it does not stick.
static void test_no_sticking(void** context) {
    (void)context;
    TestRig r;
    OmTissueObstacle board;
    OmContactDef def = on_board(&board);
    start(&r, 0, &def);
    r.def.rayleigh_mass = 0;
    assert_ok(om_contact_settle(r.cw, r.m, r.s, r.w, 0.02, 1e-4, 4));
    OmPose tip = {om_vec3(0, 0, om_tissue_x(r.s)[3 * 62 + 2]), om_quat_identity()};
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.03, NULL));
    double max = 0;
    OmTissueForces f;
    OmContactReport report;
    for (int n = 0; n < 300; ++n) {
        if (n < 200) tip.p.z += 0.02 * 0.001;  // 1 mm/s: inertia is nothing
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
        assert_ok(om_tissue_get_forces(r.m, r.s, &f));
        max = fmax(max, f.grasp[0].z);
        assert_true(report.force.z >= 0);
    }
    assert_int_equal(report.ncontact, 0);
    assert_near(f.grasp[0].z, weight, 1e-3 * weight);
    assert_below(max, 1.02 * weight);  // released tissue swings a little
    rig_done(&r);
}

// On a slope it slides with g (sin(a) - mu cos(a)); with mu > tan(a) it stays.
static void slide(double friction, double* travel, double* ideal) {
    TestRig r;
    double a = 0.2, h = 0.01;
    OmContactPlane slope = {{0, 0, 0}, {sin(a), 0, cos(a)}};
    OmTissueObstacle board = om_plane_obstacle(&slope);
    OmContactDef def = rig_on(&board);
    def.friction = friction;
    rig_box(&r, om_vec3(-0.02, -0.02, 0), om_vec3(0.02, 0.02, 0.01), 4, 4, 1);
    for (int i = 0; i < r.mesh.nvert; ++i)
        om_store3(r.mesh.x, i,
                  om_quat_rotate(om_quat_axis_angle(om_vec3(0, 1, 0), a), om_load3(r.mesh.x, i)));
    r.def.rayleigh_mass = 0;
    r.def.rayleigh_stiffness = 0.01;
    rig_start(&r);
    rig_contact(&r, &def);
    for (int n = 0; n < 50; ++n) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, h, NULL));
    *travel = 0;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        OmVec3 d = om_sub(om_load3(om_tissue_x(r.s), i), om_load3(r.mesh.x, i));
        *travel += om_dot(d, om_vec3(cos(a), 0, -sin(a))) / r.mesh.nvert;
    }
    *ideal = 9.81 * sin(a) * h * h * 50 * 51 / 2;  // what implicit Euler makes of t^2 / 2
    rig_done(&r);
}

static void test_slope(void** context) {
    (void)context;
    double free, ideal, rough, slow;
    slide(0, &free, &ideal);
    slide(0.5, &rough, &ideal);
    slide(0.1, &slow, &ideal);
    printf("slope: %.2f mm without friction, theory %.2f; %.3f mm with mu = 0.5\n", 1e3 * free,
           1e3 * ideal, 1e3 * rough);
    assert_near_rel(free, ideal, 0.01);
    printf("with mu = 0.1 %.2f mm, theory %.2f\n", 1e3 * slow, 1e3 * ideal * (1 - 0.1 / tan(0.2)));
    assert_near_rel(slow, ideal * (1 - 0.1 / tan(0.2)), 0.02);  // friction settles to 2 %
    assert_below(rough, 4e-4);  // viscous below 1 mm/s: it creeps at tan(a) / mu of that, 0.4 mm/s
}

static double ball(void* ctx, OmVec3 p) {
    (void)ctx;
    return om_norm(om_sub(p, om_vec3(0, 0, -0.03))) - 0.03;
}

// Dropped on a round organ: it drapes over it, half a gram heavier than nothing, and does not go through.
static void test_sphere(void** context) {
    (void)context;
    OmSdfDef sdf_def = om_sdf_default_def(0.002);
    OmSdf sdf;
    assert_ok(om_sdf_from_function(ball, NULL, om_vec3(-0.035, -0.035, -0.065),
                                   om_vec3(0.035, 0.035, 0.005), &sdf_def, &sdf));
    OmTissueObstacle organ = om_sdf_obstacle(&sdf);
    OmContactDef def = rig_on(&organ);
    def.friction = 0.8;  // or it slides off
    TestRig r;
    rig_box(&r, om_vec3(-0.03, -0.03, 0.002), om_vec3(0.03, 0.03, 0.006), 10, 10, 1);
    r.def.rayleigh_stiffness = 0.01;
    r.def.rayleigh_mass = 4;
    r.def.solver.tolerance = 1e-4;
    rig_start(&r);
    rig_contact(&r, &def);
    OmContactReport report;
    double deepest = 0, last = 0;
    for (int n = 0; n < 120; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
        deepest = fmax(deepest, report.penetration);
        last = report.penetration;
    }
    double carried = 1000 * 0.06 * 0.06 * 0.004 * 9.81;
    printf("ball: %d vertices touch, force %.4f of %.4f N, deepest %.3g, at last %.3g m\n",
           report.ncontact, report.force.z, carried, deepest, last);
    assert_near(report.force.z, carried, 1e-3 * carried);
    assert_near(hypot(report.force.x, report.force.y), 0, 1e-3 * carried);
    assert_below(deepest, 3e-4);
    assert_below(last, 2e-5);
    // outside the ball itself, not only its sampled field (cells of 2 mm: their chord is off by 17 um)
    for (int i = 0; i < r.mesh.nvert; ++i)
        assert_true(ball(NULL, om_load3(om_tissue_x(r.s), i)) > -1e-4);
    assert_near(om_contact_eval_distance(r.c, om_vec3(0, 0, 0.004)), 0.004, 1e-4);
    om_sdf_done(&sdf);
    rig_done(&r);
}

// Tissue that starts 3 mm inside comes out at recover_speed, not at once, and is not thrown off.
static void test_starts_inside(void** context) {
    (void)context;
    TestRig r;
    OmTissueObstacle board;
    OmContactDef def = on_board(&board);
    def.recover_speed = 0.05;
    start(&r, -0.003, &def);
    OmContactReport report;
    double before = 0.003, fastest = 0;
    for (int n = 0; n < 100; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.01, &report));
        if (before > 0.001) assert_near(before - report.penetration, 0.05 * 0.01, 5e-5);
        before = report.penetration;
        for (int i = 0; i < r.mesh.nvert; ++i) fastest = fmax(fastest, om_tissue_v(r.s)[3 * i + 2]);
    }
    assert_below(report.penetration, 1e-5);
    assert_below(fastest, 0.1);
    assert_near(report.force.z, weight, 0.01 * weight);
    rig_done(&r);
}

// Distance kept from the obstacle.
static void test_offset(void** context) {
    (void)context;
    TestRig r;
    OmTissueObstacle board;
    OmContactDef def = on_board(&board);
    def.offset = 0.001;
    start(&r, 0.001, &def);
    for (int n = 0; n < 50; ++n) assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
    for (int i = 0; i < 25; ++i) assert_near(om_tissue_x(r.s)[3 * i + 2], 0.001, 1e-5);
    assert_near(om_contact_eval_distance(r.c, om_vec3(0, 0, 0.02)), 0.02, 1e-12);
    rig_done(&r);
}

// Without obstacles a step is om_tissue_step, to the byte.
static void test_no_obstacle(void** context) {
    (void)context;
    TestRig r, q;
    OmContactDef def = om_contact_default_def();
    start(&r, 0, &def);
    start(&q, 0, &def);
    for (int n = 0; n < 5; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, NULL));
        assert_ok(om_tissue_step(q.m, q.s, q.w, 0.02, NULL));
    }
    assert_true(om_tissue_state_hash(r.s) == om_tissue_state_hash(q.s));
    assert_true(isinf(om_contact_eval_distance(r.c, om_vec3(0, 0, 0))));
    rig_done(&r);
    rig_done(&q);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_box_rests),     cmocka_unit_test(test_no_sticking),
        cmocka_unit_test(test_slope),         cmocka_unit_test(test_sphere),
        cmocka_unit_test(test_starts_inside), cmocka_unit_test(test_offset),
        cmocka_unit_test(test_no_obstacle)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
