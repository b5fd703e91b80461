// test_contact_fall.c: a block falls on a board so fast that it moves farther than its height in one step.
#include "test_rig.h"

#define H 0.02
#define SPEED 2.4  // m/s; 48 mm a step, and the block is 40 mm high

static const OmContactPlane ground = {{0, 0, 0}, {0, 0, 1}};

// A block of 30 kPa, 1 mm above the board, turned by `tilt`. iterations: above 0, so many of block Jacobi a solve.
static void start(TestRig* r, OmTissueObstacle* board, double tilt, double tolerance,
                  int iterations) {
    rig_box(r, om_vec3(0, 0, 0), om_vec3(0.06, 0.04, 0.04), 9, 6, 6);
    r->def.material_default.young = 30000;
    r->def.solver.tolerance = tolerance;
    if (iterations > 0) {
        r->def.solver.preconditioner = OM_BLOCK_JACOBI;
        r->def.solver.max_iterations = iterations;
    }
    rig_start(r);
    *board = om_plane_obstacle(&ground);
    OmContactDef def = rig_on(board);
    rig_contact(r, &def);
    size_t n = (size_t)r->mesh.nvert;
    double *x = om_alloc(6 * n, sizeof *x), *v = x + 3 * n, low = INFINITY;
    assert_non_null(x);
    OmQuat q = om_quat_axis_angle(om_normalize(om_vec3(1, 0.3, 0.2)), tilt);
    for (int i = 0; i < r->mesh.nvert; ++i) {
        OmVec3 p = om_quat_rotate(q, om_load3(r->mesh.x, i));
        om_store3(x, i, p);
        om_store3(v, i, om_vec3(0, 0, -SPEED));
        low = fmin(low, p.z);
    }
    for (size_t i = 0; i < n; ++i) x[3 * i + 2] += 0.001 - low;
    assert_ok(om_tissue_set_x(r->m, r->s, x, v));
    om_free(x);
}

static double momentum(const TestRig* r) {
    double sum = 0;
    for (int i = 0; i < r->mesh.nvert; ++i)
        sum += om_tissue_mass(r->m)[i] * om_tissue_v(r->s)[3 * i + 2];
    return sum;
}

static double mass(const TestRig* r) {
    double sum = 0;
    for (int i = 0; i < r->mesh.nvert; ++i) sum += om_tissue_mass(r->m)[i];
    return sum;
}

// The first guess of the active set is the underside, not the whole block: it is right.
static void test_flat(void** context) {
    (void)context;
    TestRig r;
    OmTissueObstacle board;
    OmContactReport report;
    start(&r, &board, 0, 1e-6, 0);
    double before = momentum(&r);
    assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, H, &report));
    printf("%d solves, %d iterations, %d vertices in contact\n", report.nsolve,
           report.tissue.iterations, report.ncontact);
    assert_int_equal(report.nsolve, 1);
    assert_int_equal(report.ncontact, 70);  // 10 x 7 vertices of the underside
    // Momentum: the board, the weight and the damping (rayleigh_mass times momentum at the end of the step).
    double after = momentum(&r), drag = r.def.rayleigh_mass * after;
    double push = (after - before) / H + 9.81 * mass(&r) + drag;
    // the rounding of penalties to float, 3e-8 of 70 times 4e5 N/m times 48 mm: 0.04 N
    assert_near(report.force.z, push, 0.1);
    rig_done(&r);
}

// The active set takes several solves, most of them loose, with coarse matrices made again: without either the two
// impacts take 110 to 160 iterations. The outcome is that of a tolerance a million times smaller; no vertex is inside
// or pulled, and only vertices on the board are pushed.
static void test_tilted(void** context) {
    (void)context;
    for (int k = 4; k <= 10; k += 6) {
        TestRig r, exact;
        OmTissueObstacle board;
        OmContactReport report, tight;
        start(&r, &board, 0.1 * k, 1e-3, 0);
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, H, &report));
        start(&exact, &board, 0.1 * k, 1e-9, 0);
        assert_true(om_contact_step(exact.cw, exact.m, exact.s, exact.w, H, &tight) >= 0);
        double far = 0;
        for (int i = 0; i < 3 * r.mesh.nvert; ++i)
            far = fmax(far, fabs(om_tissue_x(r.s)[i] - om_tissue_x(exact.s)[i]));
        printf(
            "tilt %.1f: %d solves, %d iterations, residual %.3g, %d vertices in contact, %.3g um "
            "from exact\n",
            0.1 * k, report.nsolve, report.tissue.iterations, report.tissue.residual,
            report.ncontact, 1e6 * far);
        assert_true(report.nsolve <= 7);
        assert_true(report.tissue.iterations <= (k == 4 ? 105 : 113));
        assert_below(report.tissue.residual, 1e-3);
        assert_int_equal(report.tissue.substeps, 1);
        assert_int_equal(report.ncontact, tight.ncontact);
        assert_below(far, 1e-6);  // 1e-3 of the weight's share of a solve moves no vertex by more
        for (int i = 0; i < r.mesh.nvert; ++i) {
            double z = om_tissue_x(r.s)[3 * i + 2], f = om_tissue_contact_force(r.s)[3 * i + 2];
            assert_true(f >= 0 && z > -1e-4);
            if (f > 0) assert_below(fabs(z), 1e-4);
        }
        rig_done(&exact);
        rig_done(&r);
    }
}

// Solves of 25 iterations leave a residual of the order of the impact: the set still settles, in two substeps at most.
static void test_unsolved(void** context) {
    (void)context;
    for (int k = 0; k <= 10; k += 2) {
        TestRig r;
        OmTissueObstacle board;
        OmContactReport report;
        start(&r, &board, 0.1 * k, 0, 25);
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, H, &report));
        printf("tilt %.1f: %d solves, %d iterations, %d substeps, residual %.3g, %d vertices\n",
               0.1 * k, report.nsolve, report.tissue.iterations, report.tissue.substeps,
               report.tissue.residual, report.ncontact);
        assert_true(report.tissue.iterations <= 25 * report.nsolve);
        assert_true(report.tissue.substeps <= 2);
        rig_done(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_flat), cmocka_unit_test(test_tilted),
                                       cmocka_unit_test(test_unsolved)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
