// test_dds_frames.c: a frame from touched points, and the file of frames.
#include <string.h>

#include "omentum/dds.h"
#include "test_alloc.h"
#include "test_common.h"
#include "test_files.h"

enum { NPOINT = 6 };
static const double touched[3 * NPOINT] = {0,    0,    0,    0.1,  0,     0.01, 0,     0.08, -0.02,
                                           0.07, 0.06, 0.03, 0.02, -0.05, 0.04, -0.03, 0.01, 0.02};

static OmPose place(void) {
    return (OmPose){om_vec3(0.2, -0.3, 0.15),
                    om_quat_axis_angle(om_normalize(om_vec3(1, -2, 0.5)), 2.2)};
}

static void to_world(OmPose pose, double x[3 * NPOINT]) {
    for (int i = 0; i < NPOINT; ++i) om_store3(x, i, om_pose_apply(pose, om_load3(touched, i)));
}

// Points without error give the pose back; the same points in another order give the same pose.
static void exact(void** unused) {
    (void)unused;
    const OmPose pose = place();
    double x[3 * NPOINT];
    OmDdsFrame f = {0};
    int worst;
    to_world(pose, x);
    assert_ok(om_dds_frame_fit(touched, x, NPOINT, &f, &worst));
    assert_near(om_distance(f.pose_world_frame.p, pose.p), 0, 1e-12);
    const OmQuat d = om_quat_mul(om_quat_conj(pose.q), f.pose_world_frame.q);
    assert_near(fabs(d.w), 1, 1e-12);
    assert_near(f.max, 0, 1e-12);
    assert_int_equal(f.npoint, NPOINT);
}

// One point off by 6 mm: it is the worst, its residual is the largest, and rms and max fit the residuals of the pose.
static void one_wrong_point(void** unused) {
    (void)unused;
    double x[3 * NPOINT], sum = 0, most = 0;
    OmDdsFrame f = {0};
    int worst;
    to_world(place(), x);
    x[3 * 3 + 1] += 0.006;
    assert_ok(om_dds_frame_fit(touched, x, NPOINT, &f, &worst));
    assert_int_equal(worst, 3);
    for (int i = 0; i < NPOINT; ++i) {
        const double off =
            om_distance(om_pose_apply(f.pose_world_frame, om_load3(touched, i)), om_load3(x, i));
        sum += off * off;
        most = fmax(most, off);
    }
    assert_near(f.rms, sqrt(sum / NPOINT), 1e-12);
    assert_near(f.max, most, 1e-12);
    assert_below(0.002, f.max);
}

static OmVec3 centre(const double* x) {
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int i = 0; i < NPOINT; ++i) sum = om_add(sum, om_load3(x, i));
    return om_scale(1.0 / NPOINT, sum);
}

// The rms residual of a rotation, with the best translation for it.
static double rms_of(OmQuat q, const double* x) {
    const OmVec3 a = centre(touched), b = centre(x);
    double sum = 0;
    for (int i = 0; i < NPOINT; ++i) {
        const OmVec3 to = om_add(b, om_quat_rotate(q, om_sub(om_load3(touched, i), a)));
        sum += om_norm2(om_sub(to, om_load3(x, i)));
    }
    return sqrt(sum / NPOINT);
}

// Points of a mirror, turned: the pose is a rotation, and no turn of it by a milliradian has smaller residuals.
static void no_mirror(void** unused) {
    (void)unused;
    double x[3 * NPOINT];
    OmDdsFrame f = {0};
    int worst;
    for (int i = 0; i < NPOINT; ++i) {
        OmVec3 p = om_load3(touched, i);
        p.z *= -1;
        om_store3(x, i, om_pose_apply(place(), p));
    }
    assert_ok(om_dds_frame_fit(touched, x, NPOINT, &f, &worst));
    const OmQuat q = f.pose_world_frame.q;
    assert_near(f.rms, rms_of(q, x), 1e-12);
    for (int k = 0; k < 6; ++k) {
        const OmVec3 axis = om_vec3(k / 2 == 0, k / 2 == 1, k / 2 == 2);
        const OmQuat other = om_quat_mul(om_quat_axis_angle(axis, k % 2 ? 1e-3 : -1e-3), q);
        assert_below(f.rms, rms_of(other, x));
    }
    assert_below(0.002, f.max);
}

static void refused(void** unused) {
    (void)unused;
    double x[3 * NPOINT];
    OmDdsFrame f = {0};
    int worst;
    to_world(place(), x);
    assert_status(om_dds_frame_fit(touched, x, 3, &f, &worst), OM_INVALID);
    double line[3 * NPOINT], moved[3 * NPOINT];
    for (int i = 0; i < NPOINT; ++i) {
        om_store3(line, i, om_vec3(0.02 * i, 0.001 * (i % 2), 0));
        om_store3(moved, i, om_pose_apply(place(), om_load3(line, i)));
    }
    assert_status(om_dds_frame_fit(line, moved, NPOINT, &f, &worst), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "one line"));
    x[4] = NAN;
    assert_status(om_dds_frame_fit(touched, x, NPOINT, &f, &worst), OM_INVALID);
}

static void files(void** unused) {
    (void)unused;
    const char* path = temp_path("frames.json");
    OmDdsFrame made[2] = {
        {.name = "PSM1_base", .pose_world_frame = place(), .npoint = 6, .rms = 1e-3, .max = 2e-3},
        {.name = "ECM", .pose_world_frame = om_pose_identity()}};
    OmDdsFrame read[OM_DDS_MAX_FRAME];
    int n;
    assert_ok(om_dds_frames_save(made, 2, path));
    assert_ok(om_dds_frames_load(path, read, &n));
    assert_int_equal(n, 2);
    assert_string_equal(read[0].name, "PSM1_base");
    assert_near(om_distance(read[0].pose_world_frame.p, made[0].pose_world_frame.p), 0, 1e-9);
    assert_near(read[0].rms, 1e-3, 1e-9);
    static const char* const bad[] = {
        "{",
        "[]",
        "{\"frames\": [{\"name\": \"a\"}]}",
        "{\"frames\": [{\"name\": \"a\", \"position_mm\": [0, 0], \"quaternion_xyzw\": [0, 0, 0, 1]}]}",
        "{\"frames\": [{\"name\": \"a\", \"position_mm\": [0, 0, 0], \"quaternion_xyzw\": [0, 0, 0, 2]}]}",
        ("{\"frames\": [{\"name\": \"a\", \"position_mm\": [0, 0, 0], \"quaternion_xyzw\": [0, 0, 0, 1]}, "
         "{\"name\": \"a\", \"position_mm\": [0, 0, 0], \"quaternion_xyzw\": [0, 0, 0, 1]}]}")};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
        write_bytes(path, bad[k], strlen(bad[k]));
        assert_status(om_dds_frames_load(path, read, &n), OM_INVALID);
        assert_int_equal(n, 0);
    }
    remove(path);
    assert_status(om_dds_frames_load(path, read, &n), OM_IO);
}

static OmStatus save_and_load(void* ctx) {
    OmDdsFrame frame[OM_DDS_MAX_FRAME] = {{.name = "PSM1_base", .pose_world_frame = place()}};
    int n;
    OM_TRY(om_dds_frames_save(frame, 1, ctx));
    return om_dds_frames_load(ctx, frame, &n);
}

static void memory(void** unused) {
    (void)unused;
    const char* path = temp_path("frames_memory.json");
    assert_true(test_failing_allocations(save_and_load, (void*)(uintptr_t)path, 1) > 1);
    remove(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact),   cmocka_unit_test(one_wrong_point), cmocka_unit_test(no_mirror),
        cmocka_unit_test(refused), cmocka_unit_test(files),           cmocka_unit_test(memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
