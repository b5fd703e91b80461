// test_contact_press.c: a probe pressed into a block by each method: forces, balance, consistency.
#include "test_press_rig.h"

static void start(PressRig* p, const OmProbeDef* shape, OmPressMethod method, int reuse,
                  double friction, double tolerance) {
    rig_start(&p->r);
    assert_ok(om_probe_create(shape, &p->probe));
    OmPressDef def = om_press_default_def(p->probe);
    def.method = method;
    def.reuse = reuse;
    def.ntri = 2600;
    OmSurface top = {0};
    if (shape->shape == OM_PROBE_BOX) {
        make_top(&top);
        def.surface = &top;
    }
    def.friction = friction;
    def.tolerance = tolerance;
    assert_ok(om_press_create(&def, p->r.m, &p->press));
    om_surface_done(&top);
}

static OmPose above(double z) {
    OmPose pose = {om_vec3(0.06, 0.05, z), om_quat_identity()};
    return pose;
}

static OmPressReport press_down(PressRig* p, double top, double depth, int npress, int nhold,
                                double h) {
    OmPressReport report;
    assert_ok(om_press_place(p->press, p->r.m, p->r.s, above(top)));
    for (int n = 0; n < npress + nhold; ++n) {
        double z = top - depth * fmin(1, (n + 1.0) / npress);
        OmStatus status = om_press_step(p->press, p->r.m, p->r.s, p->r.w, above(z), h, &report);
        if (status != OM_OK) fail_msg("step %d: %s", n, om_error_message());
        assert_true(report.is_settled);
    }
    return report;
}

// The prescribed area of a ball: every vertex of the upper side within `reach` above which the ball's normal is
// within 60 degrees of the direction of pressing, counted here from the geometry. Vertices beside it stay free.
static void test_area_of_ball(void** test) {
    (void)test;
    PressRig p;
    make_block(&p, 12, 10, 4);
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    rig_start(&p.r);
    assert_ok(om_probe_create(&shape, &p.probe));
    OmSurface top;
    make_top(&top);
    OmPressDef def = om_press_default_def(p.probe);
    def.method = OM_PRESS_PRESCRIBED;
    def.surface = &top;
    // the ball's sides are within it: 25 mm less the root of 25^2 - r^2 mm for r up to 24.8 mm
    def.reach = 0.022;
    assert_ok(om_press_create(&def, p.r.m, &p.press));
    double radius = shape.radius * sin(OM_PI / 3);
    int expected = 0;
    for (int i = 0; i < top.nvert; ++i)
        expected += hypot(top.x[3 * i] - 0.06, top.x[3 * i + 1] - 0.05) < radius;
    OmPressReport report;
    double centre = 0.05 + shape.radius;
    assert_ok(om_press_place(p.press, p.r.m, p.r.s, above(centre)));
    assert_ok(om_press_step(p.press, p.r.m, p.r.s, p.r.w, above(centre - 1e-4), H, &report));
    printf("area of a ball: %d vertices, %d by geometry\n", report.ncontact, expected);
    assert_int_equal(report.ncontact, expected);
    om_surface_done(&top);
    done(&p);
}

// Springs so stiff that their compression is near the gap at which a point is released: a multiplier must not pull
// within that gap. While the ball goes in, aside and out, every step meets Signorini's law, in little more than one
// solve; with multipliers that pull, steps are cut, and it takes 201.
static void test_nothing_pulls(void** test) {
    (void)test;
    PressRig p;
    make_block(&p, 12, 10, 5);
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    rig_start(&p.r);
    assert_ok(om_probe_create(&shape, &p.probe));
    OmPressDef def = om_press_default_def(p.probe);
    def.method = OM_PRESS_MULTIPLIERS;
    def.stiffness = 1e6;
    def.ntri = 2600;
    assert_ok(om_press_create(&def, p.r.m, &p.press));
    OmPressReport report;
    OmPose pose = above(0.05 + shape.radius);
    assert_ok(om_press_place(p.press, p.r.m, p.r.s, pose));
    int nsolve = 0;
    double worst = 0;
    for (int n = 0; n < 45; ++n) {
        if (n < 15)
            pose.p.z -= 1.7e-4;
        else if (n < 30)
            pose.p.x += 2.3e-4;
        else
            pose.p.z += 1.7e-4;
        assert_ok(om_press_step(p.press, p.r.m, p.r.s, p.r.w, pose, H, &report));
        nsolve += report.nsolve;
        worst = fmax(worst, report.complementarity);
    }
    printf("stiff springs: %d solves in 45 steps, error of the law %.3g\n", nsolve, worst);
    assert_true(nsolve <= 90);
    assert_below(worst, 1.0001e-4);
    done(&p);
}

// A flat box, 1 mm (2 %) into the block, by three methods: one force, in balance with the attachment.
static void test_flat_box(void** test) {
    (void)test;
    double force[3];
    for (int method = 0; method < 3; ++method) {
        PressRig p;
        int n = test_is_slow() ? 2 : 1;
        make_block(&p, 12 * n, 10 * n, 4 * n);
        OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);
        shape.rounding = 0.0005;
        start(&p, &shape, (OmPressMethod)method, 0, 0, 1e-6);
        OmPressReport report = press_down(&p, 0.05, 0.001, 5, 0, H);
        for (int k = 0; k < 4; ++k)  // at rest: steps so long that inertia is nothing
            assert_ok(om_press_step(p.press, p.r.m, p.r.s, p.r.w, above(0.049), 5, &report));
        OmTissueForces f;
        assert_ok(om_tissue_get_forces(p.r.m, p.r.s, &f));
        force[method] = report.force.z;
        assert_near(f.attachment.z, report.force.z, 1e-3 * report.force.z);
        assert_near(f.contact.z, -report.force.z, 1e-12);
        double aside = method == OM_PRESS_PRESCRIBED ? 0.1 : 1e-6;  // what sticks is pulled aside
        assert_below(fabs(report.force.x) + fabs(report.force.y), aside * report.force.z);
        assert_below(report.penetration, 5e-5);
        // the report's own sums: force, and torque about the centre of the face
        OmVec3 sum = {0, 0, 0}, torque = {0, 0, 0};
        for (int k = 0; k < report.ncontact; ++k) {
            OmVec3 push = om_load3(report.push, k), at = om_load3(report.point, k);
            sum = om_sub(sum, push);
            torque = om_sub(torque, om_cross(om_sub(at, above(0.049).p), push));
            assert_true(method == OM_PRESS_PRESCRIBED || fabs(report.gap[k]) < 5e-5);
        }
        assert_near(om_distance(sum, report.force), 0, 1e-12);
        assert_near(om_distance(torque, report.torque), 0, 1e-12);
        assert_below(om_norm(report.torque), 0.002 * report.force.z);  // 2 mm off the axis
        done(&p);
    }
    printf("flat box, 1 mm: penalty %.5f N, multipliers %.5f N, prescribed %.5f N\n", force[0],
           force[1], force[2]);
    assert_near_rel(force[0], force[1], 0.01);
    // its area ends at vertices: 10 mm apart in the quick run
    if (test_is_slow()) assert_near_rel(force[2], force[1], 0.05);
    assert_true(force[2] > force[1] && force[2] < 1.25 * force[1]);
}

// A deep sphere, with and without friction: the force on it equals the force of the attachment.
static void test_sphere_balance(void** test) {
    (void)test;
    // without friction: test_signorini, and the slow run
    for (int run = test_is_slow() ? 0 : 2; run < 4; ++run) {
        PressRig p;
        if (test_is_slow())
            make_block(&p, 12, 10, 5);
        else
            make_block(&p, 10, 8, 4);
        OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
        start(&p, &shape, run % 2 ? OM_PRESS_MULTIPLIERS : OM_PRESS_PENALTY, 0, run < 2 ? 0 : 0.3,
              1e-5);
        OmPressReport report = press_down(&p, 0.075, 0.015, 30, 0, H);
        for (int n = 0; n < 10; ++n)
            assert_ok(om_press_step(p.press, p.r.m, p.r.s, p.r.w, above(0.06), 5, &report));
        OmTissueForces f;
        assert_ok(om_tissue_get_forces(p.r.m, p.r.s, &f));
        printf("sphere, run %d: %.5f N, attachment %.5f N, %d contacts, %.0f mm2, in by %.2g um\n",
               run, report.force.z, f.attachment.z, report.ncontact, 1e6 * report.area,
               1e6 * report.penetration);
        assert_near(om_distance(f.attachment, report.force), 0, 1e-3 * report.force.z);
        assert_below(report.penetration, 5e-5);
        done(&p);
    }
}

// Signorini's law to rounding in every step of a press, and of lifting off again.
static void press_and_lift(int reuse) {
    PressRig p;
    make_block(&p, 8, 6, 4);
    p.r.def.solver.tolerance = 1e-10;
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    start(&p, &shape, OM_PRESS_MULTIPLIERS, reuse, 0, 1e-8);
    assert_ok(om_press_place(p.press, p.r.m, p.r.s, above(0.0755)));
    int max = 0;
    for (int n = 0; n < 50; ++n) {
        OmPressReport report;
        double z = 0.0755 - 0.01 * sin(OM_PI * (n + 1) / 45.0);
        assert_ok(om_press_step(p.press, p.r.m, p.r.s, p.r.w, above(z), H, &report));
        assert_true(report.complementarity <= 1e-8 * test_tol_scale());
        for (int k = 0; k < report.ncontact; ++k)
            assert_true(om_dot(om_load3(report.push, k), om_load3(report.normal, k)) > 0);
        max = report.ncontact > max ? report.ncontact : max;
        if (n == 49) assert_int_equal(report.ncontact, 0);
    }
    assert_true(max >= 5);
    done(&p);
}

// By an augmented Lagrangian, and by Gauss-Seidel on the Delassus matrix.
static void test_signorini(void** test) {
    (void)test;
    press_and_lift(0);
    press_and_lift(1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flat_box),      cmocka_unit_test(test_sphere_balance),
        cmocka_unit_test(test_signorini),     cmocka_unit_test(test_area_of_ball),
        cmocka_unit_test(test_nothing_pulls),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
