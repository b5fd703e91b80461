// test_scan_exact.c: parts of the room against values computed by hand.
#include "test_common.h"

#include "omentum/scan_file.h"
#include "omentum/scan_picture.h"
#include "scan/scan_internal.h"

static double ball(void* ctx, OmVec3 p) {
    (void)ctx;
    return om_norm(p) - 0.02;
}

// A board at z = -30 mm of the task, a ball of 20 mm, a tool of 3 mm along z at x = 40 mm, and a reach of 60 mm.
static void test_field(void** state) {
    (void)state;
    OmSdf organ;
    OmSdfDef def = om_sdf_default_def(0.002);
    assert_ok(om_sdf_from_function(ball, NULL, om_vec3(-0.03, -0.03, -0.03),
                                   om_vec3(0.03, 0.03, 0.03), &def, &organ));
    OmScanField f = {.pose_task_world = {om_vec3(0, 0, 0.03), om_quat_identity()},
                     .lo = om_vec3(-0.06, -0.06, -0.06),
                     .hi = om_vec3(0.06, 0.06, 0.06),
                     .has_ground = true,
                     .organ = &organ,
                     .clearance = 0.002,
                     .tool_margin = 0.002,
                     .ncapsule = 1};
    f.capsule[0] =
        (OmPsmCapsule){.a = om_vec3(0.04, 0, 0), .b = om_vec3(0.04, 0, 0.02), .radius = 0.003};
    assert_int_equal(om_scan_field_eval(&f, om_vec3(0.021, 0, 0)), OM_PLACE_FIXED);
    assert_int_equal(om_scan_field_eval(&f, om_vec3(0.0225, 0, 0)), OM_PLACE_FREE);
    assert_int_equal(om_scan_field_eval(&f, om_vec3(0, 0.04, -0.0285)), OM_PLACE_FIXED);
    assert_int_equal(om_scan_field_eval(&f, om_vec3(0, 0.04, -0.0275)), OM_PLACE_FREE);
    assert_int_equal(om_scan_field_eval(&f, om_vec3(0.04, 0.0045, 0.01)), OM_PLACE_TOOL);
    assert_int_equal(om_scan_field_eval(&f, om_vec3(0.04, 0.0055, 0.01)), OM_PLACE_FREE);
    assert_int_equal(om_scan_field_eval(&f, om_vec3(0.04, 0, 0.0245)), OM_PLACE_TOOL);
    assert_int_equal(om_scan_field_eval(&f, om_vec3(0.04, 0, 0.0255)), OM_PLACE_FREE);
    assert_int_equal(om_scan_field_eval(&f, om_vec3(0, 0, 0.0305)),
                     OM_PLACE_FAR);  // z 60.5 mm of the task
    om_sdf_done(&organ);
}

// Twelve points: in a plane they have its normal, along a line, 1 % wide, none.
static void test_plane_or_line(void** state) {
    (void)state;
    double x[36];
    int point[12];
    OmVec3 mean;
    for (int wide = 0; wide < 2; ++wide) {
        for (int i = 0; i < 12; ++i) {
            point[i] = i;
            om_store3(x, i, om_vec3(0.001 * i, (i % 2 ? 1 : -1) * (wide ? 0.002 : 0.00003), 0.5));
        }
        OmVec3 n = om__plane_normal(x, 12, point, &mean);
        assert_near(fabs(n.z), wide, 1e-9);
        assert_near(om_norm(n), wide, 1e-9);
        assert_near(om_distance(mean, om_vec3(0.0055, 0, 0.5)), 0, 1e-12);
    }
}

// A scan of 1000 times, or a thousandth of, the model's size.
static void test_size(void** state) {
    (void)state;
    double x[9] = {0, 0, 0, 0.06, 0, 0, 0, 0.06, 0};
    int tri[3] = {0, 1, 2};
    const OmSurface model = {3, 1, x, tri};
    for (int k = 0; k < 2; ++k) {
        OmScan scan;
        assert_ok(om_scan_init(25, 0, &scan));
        for (int i = 0; i < 25; ++i)
            om_store3(scan.x, i,
                      om_scale(k ? 1e3 : 1e-3, om_vec3(0.015 * (i % 5), 0.015 * (i / 5), 0)));
        assert_status(om_scan_check_model(&scan, &model, INFINITY, NULL), OM_INVALID);
        assert_non_null(
            strstr(om_error_message(), k ? "1e+03 times larger" : "1e+03 times smaller"));
        om_scan_done(&scan);
    }
}

// Hues spread evenly from 20 to 40 degrees: quantiles of 5 and 95 % are 21 and 39, each 9 degrees further out.
static void test_hues(void** state) {
    (void)state;
    enum { N = 20 };
    unsigned char pixel[3 * N * N];
    for (int i = 0; i < N * N; ++i) {
        double hue = 20 + 20.0 * i / (N * N - 1);
        pixel[3 * i] = 240;
        pixel[3 * i + 1] = (unsigned char)(40 + 200 * hue / 60 + 0.5);
        pixel[3 * i + 2] = 40;
    }
    const OmPicture picture = {.width = N, .height = N, .nchannel = 3, .pixel = pixel};
    const OmScanRegion all = {.is_box = true, .width = N, .height = N};
    OmSenseRange range;
    assert_ok(om_scan_learn_range(&picture, &all, &range));
    assert_near(range.hue_min, 12, 0.5);  // a step of green is 0.3 degrees
    assert_near(range.hue_max, 48, 0.5);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_field),
        cmocka_unit_test(test_plane_or_line),
        cmocka_unit_test(test_size),
        cmocka_unit_test(test_hues),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
