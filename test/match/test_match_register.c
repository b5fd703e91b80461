// test_match_register.c: rigid registration of shapes with a formula: known poses, and poses that no shape can tell.
#include "match/match_icp.h"
#include "match/register_cases.h"
#include "test_alloc.h"

// ---- shapes -----------------------------------------------------------------------------------------

// An egg with a bump on one side and a dent on another: no symmetry.
static double potato(void* ctx, OmVec3 p) {
    (void)ctx;
    OmVec3 q = om_vec3(p.x / 0.050, p.y / 0.036, p.z / 0.028);
    double bump = exp(-om_norm2(om_sub(p, om_vec3(0.025, 0.025, 0.012))) / (0.016 * 0.016));
    double dent = exp(-om_norm2(om_sub(p, om_vec3(-0.025, 0.010, 0.025))) / (0.014 * 0.014));
    return 0.030 * (om_norm(q) - 1) - 0.008 * bump + 0.006 * dent;
}

static double egg(void* ctx, OmVec3 p) {  // round about z
    (void)ctx;
    return 0.030 * (om_norm(om_vec3(p.x / 0.030, p.y / 0.030, p.z / (p.z > 0 ? 0.06 : 0.04))) - 1);
}

static double ball(void* ctx, OmVec3 p) {
    (void)ctx;
    return om_norm(p) - 0.035;
}

// A plate of 4 mm in the shape of an L, bent: front and back are near each other.
static double plate(void* ctx, OmVec3 p) {
    (void)ctx;
    double z = p.z - 4 * p.x * p.x - 2 * p.y * p.y * p.y / 0.04;
    double a = fmax(fabs(p.x) - 0.045, fabs(p.y + 0.015) - 0.012);
    double b = fmax(fabs(p.x + 0.030) - 0.015, fabs(p.y) - 0.035);
    return fmax(fmin(a, b), fabs(z) - 0.002);
}

static void make_surface(OmShapeFn shape, double spacing, OmSurface* s) {
    OmSdfDef def = om_sdf_default_def(spacing);
    OmVec3 hi = om_vec3(0.060, 0.052, 0.066);
    OmSdf sdf;
    assert_ok(om_sdf_from_function(shape, NULL, om_scale(-1, hi), hi, &def, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, s));
    om_sdf_done(&sdf);
}

static void make_case(OmShapeFn shape, double spacing, OrganCase* c) {
    make_surface(shape, spacing, &c->model);
    make_surface(shape, 0.0016, &c->truth);
    case_prepare(c);
}

static OmRegisterDef def_near(const OmScan* scan, OmPose truth, uint64_t seed) {
    OmRegisterDef def = om_register_default_def();
    def.has_start = true;
    def.pose_model_scan = case_start(scan, truth, OM_PI / 6, 0.03, seed);
    def.nworker = 1;
    return def;
}

// ---- known poses --------------------------------------------------------------------------------------

static void check_poses(OmShapeFn shape, double spacing, bool has_start, bool has_normals, int n) {
    double angle2 = 0, sigma2 = 0;
    OrganCase c;
    make_case(shape, spacing, &c);
    for (int k = 0; k < n; ++k) {
        OmScan scan;
        OmPose truth;
        OmRegistration r;
        double angle, shift;
        case_look(&c, 100 + (uint64_t)k, &scan, &truth);
        if (!has_normals) memset(scan.normal, 0, 3 * (size_t)scan.npoint * sizeof *scan.normal);
        OmRegisterDef def = def_near(&scan, truth, (uint64_t)k);
        def.has_start = has_start;
        def.max_sigma_angle = 0.5 * OM_PI / 180;
        assert_ok(om_scan_register(&def, &c.model, &scan, &r));
        case_error(&r, truth, &angle, &shift);
        if (!r.is_reliable) print_message("%d: %s\n", k, r.reason);
        assert_below(angle, 0.5);
        assert_below(shift, 0.5);
        assert_true(r.is_reliable && r.reason[0] == 0);
        assert_below(r.residual, 0.0003);  // noise of 0.25 mm: 0.17 mm in the median
        assert_true(r.overlap > 0.9 && r.overlap <= 1);
        // the error is within 3.5 standard deviations of the least known direction
        assert_below(angle, 3.5 * r.sigma_angle * 180 / OM_PI + 0.02);
        angle2 += angle * angle;
        sigma2 += pow(r.sigma_angle * 180 / OM_PI, 2);
        om_scan_done(&scan);
    }
    print_message("angle: error %.3f, sigma %.3f degrees\n", sqrt(angle2 / n), sqrt(sigma2 / n));
    assert_below(sqrt(angle2), 1.5 * sqrt(sigma2));  // facets count in the uncertainty
    case_done(&c);
}

static void test_from_a_start(void** state) {
    (void)state;
    check_poses(potato, 0.003, true, true, 4);
}
static void test_from_nothing(void** state) {
    (void)state;
    check_poses(potato, 0.003, false, true, 1);
}

// Front and back of the plate are 4 mm apart: only the side that the camera sees is a partner.
static void test_hidden_side(void** state) {
    (void)state;
    check_poses(plate, 0.0015, true, false, 2);
}

// Points on the model itself, far from the origin: to rounding, and the pose maps the scan to the model.
static void test_exact(void** state) {
    (void)state;
    OmSurface model;
    OmScan scan;
    make_surface(potato, 0.004, &model);
    assert_ok(om_scan_init(model.nvert, 0, &scan));
    OmPose truth = {{0.3, -0.2, 0.1}, om_quat_axis_angle(om_normalize(om_vec3(1, 2, -1)), 0.4)};
    OmPose back = om_pose_inverse(truth);
    for (int i = 0; i < model.nvert; ++i)
        om_store3(scan.x, i, om_pose_apply(back, om_load3(model.x, i)));
    OmRegisterDef def = om_register_default_def();
    def.has_start = true;
    def.pose_model_scan = truth;
    def.pose_model_scan.p.x += 0.01;
    def.npoint = 100000;
    OmRegistration r;
    double angle, shift;
    assert_ok(om_scan_register(&def, &model, &scan, &r));
    case_error(&r, truth, &angle, &shift);
    assert_below(angle, 1e-3);
    assert_below(shift, 1e-3);
    assert_near(r.overlap, 1, 1e-12);
    assert_true(r.is_reliable);
    for (int i = 0; i < model.nvert; i += 50) {
        OmVec3 p = om_pose_apply(r.pose_model_scan, om_load3(scan.x, i));
        assert_near(om_distance(p, om_load3(model.x, i)), 0, 2e-6);
    }
    om_scan_done(&scan);
    om_surface_done(&model);
}

// Points of a sphere, and a model whose vertices lie on it: the triangles stand for the sphere, not for chords.
static void test_curved(void** state) {
    (void)state;
    OmSurface model;
    OmScan scan;
    OmIcp icp;
    OmRng rng = om_rng_init(5, 0);
    make_surface(ball, 0.006, &model);
    for (int i = 0; i < model.nvert; ++i)
        om_store3(model.x, i, om_scale(0.035, om_normalize(om_load3(model.x, i))));
    assert_ok(om_scan_init(500, 0, &scan));
    for (int i = 0; i < 500; ++i) om_store3(scan.x, i, om_scale(0.035, random_direction(&rng)));
    assert_ok(om__icp_create(&model, &scan, 500, &icp));
    OmIcpFit fit = {.pose = om_pose_identity()};
    om__icp_run(&icp, 500, 0, 1e-6, &fit);
    double curved = 0, chord = 0;
    for (int i = 0; i < 500; ++i) {
        OmSurfacePoint q;
        assert_true(om_surface_tree_find(icp.tree, om_load3(scan.x, i), NULL, HUGE_VAL, &q));
        curved += fabs(icp.residual[i]) / 500;
        chord += q.distance / 500;
    }
    assert_true(chord > 5e-5);
    assert_below(curved, 0.5 * chord);  // normals of vertices are means of facets
    om__icp_done(&icp);
    om_scan_done(&scan);
    om_surface_done(&model);
}

// ---- poses that the shape does not tell ---------------------------------------------------------------

static void register_shape(OmShapeFn model, OmShapeFn truth, uint64_t seed, OmRegistration* r) {
    OrganCase c;
    OmScan scan;
    OmPose pose;
    make_surface(model, 0.003, &c.model);
    make_surface(truth, 0.0016, &c.truth);
    case_prepare(&c);
    case_look(&c, seed, &scan, &pose);
    OmRegisterDef def = def_near(&scan, pose, seed);
    assert_ok(om_scan_register(&def, &c.model, &scan, r));
    om_scan_done(&scan);
    case_done(&c);
}

static void test_round_shapes(void** state) {
    (void)state;
    for (uint64_t seed = 1; seed < 2; ++seed) {
        OmRegistration r;
        register_shape(ball, ball, seed, &r);
        assert_false(r.is_reliable);
        assert_true(r.sigma_angle > OM_PI / 180);
        assert_below(r.residual, 0.0003);
        register_shape(egg, egg, seed, &r);
        assert_false(r.is_reliable);
        assert_true(r.sigma_angle > OM_PI / 180);
        assert_true(fabs(r.axis_angle.z) > 0.9);  // it is round about z
    }
}

static void test_another_organ(void** state) {
    (void)state;
    for (uint64_t seed = 1; seed < 3; ++seed) {
        OmRegistration r;
        register_shape(potato, plate, seed, &r);
        assert_false(r.is_reliable);
        register_shape(egg, potato, seed, &r);
        assert_false(r.is_reliable);
        assert_true(r.reason[0] != 0);
    }
}

// ---- input ----------------------------------------------------------------------------------------------

static void test_bad_input(void** state) {
    (void)state;
    OrganCase c;
    OmScan scan;
    OmPose truth;
    OmRegistration r;
    make_case(potato, 0.004, &c);
    case_look(&c, 1, &scan, &truth);
    OmRegisterDef good = def_near(&scan, truth, 1), def = good;
    def.cookie = 0;
    assert_status(om_scan_register(&def, &c.model, &scan, &r), OM_INVALID);
    def = good, def.npoint = 99;
    assert_status(om_scan_register(&def, &c.model, &scan, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "npoint"));
    def = good, def.pose_model_scan.q.w += 0.5;
    assert_status(om_scan_register(&def, &c.model, &scan, &r), OM_INVALID);
    OmSurface empty = {0};
    assert_status(om_scan_register(&good, &empty, &scan, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no surface"));
    int n = scan.npoint;
    scan.npoint = 29;
    assert_status(om_scan_register(&good, &c.model, &scan, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "29 points"));
    scan.npoint = n;
    double kept = scan.x[10];
    scan.x[10] = (double)NAN;
    assert_status(om_scan_register(&good, &c.model, &scan, &r), OM_INVALID);
    scan.x[10] = kept;
    def = good, def.pose_model_scan.p.x += 2;
    assert_ok(om_scan_register(&def, &c.model, &scan, &r));
    assert_false(r.is_reliable);
    assert_non_null(strstr(r.reason, "outside the model"));
    for (int i = 0; i < 3 * n; ++i) scan.x[i] *= 1e3;  // millimetres taken for metres
    def = good, def.has_start = false;
    assert_ok(om_scan_register(&def, &c.model, &scan, &r));
    assert_false(r.is_reliable);
    assert_non_null(strstr(r.reason, "unit"));
    om_scan_done(&scan);
    case_done(&c);
}

typedef struct Run {
    OmRegisterDef def;
    const OmSurface* model;
    const OmScan* scan;
    OmRegistration r;
} Run;

static OmStatus run_once(void* ctx) {
    Run* run = ctx;
    return om_scan_register(&run->def, run->model, run->scan, &run->r);
}

static void test_workers_and_memory(void** state) {
    (void)state;
    OrganCase c;
    OmScan scan;
    OmPose truth;
    make_case(potato, 0.006, &c);
    case_look(&c, 1, &scan, &truth);
    Run run = {.def = def_near(&scan, truth, 1), .model = &c.model, .scan = &scan};
    run.def.npoint = 300;
    assert_ok(run_once(&run));
    OmRegistration first = run.r;
    run.def.nworker = 3;
    assert_ok(run_once(&run));
    run.r.ms = first.ms;
    assert_memory_equal(&first.pose_model_scan, &run.r.pose_model_scan, sizeof(OmPose));
    assert_true(first.sigma_angle == run.r.sigma_angle && first.residual == run.r.residual);
    assert_int_equal(first.niteration, run.r.niteration);
    run.def.start_angle = run.def.start_shift = 0;  // one start: fewer runs
    assert_true(test_failing_allocations(run_once, &run, 1) > 15);
    om_scan_done(&scan);
    case_done(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_curved),
        cmocka_unit_test(test_exact),
        cmocka_unit_test(test_from_a_start),
        cmocka_unit_test(test_from_nothing),
        cmocka_unit_test(test_hidden_side),
        cmocka_unit_test(test_round_shapes),
        cmocka_unit_test(test_another_organ),
        cmocka_unit_test(test_bad_input),
        cmocka_unit_test(test_workers_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
