// test_match_register.c: rigid registration of shapes with a formula: known poses.
#include "match/match_icp.h"
#include "match/register_shapes.h"

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
        if (!test_is_slow()) def.npoint = 1000;
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
    check_poses(potato, 0.003, true, true, test_is_slow() ? 4 : 1);
}
static void test_from_nothing(void** state) {
    (void)state;
    check_poses(potato, 0.003, false, true, 1);
}

// Front and back of the plate are 4 mm apart: only the side that the camera sees is a partner.
static void test_hidden_side(void** state) {
    (void)state;
    check_poses(plate, 0.0015, true, false, test_is_slow() ? 2 : 1);
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_curved),       cmocka_unit_test(test_exact),
        cmocka_unit_test(test_from_a_start), cmocka_slow_test(test_from_nothing),
        cmocka_unit_test(test_hidden_side),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
