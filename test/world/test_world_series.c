// Recorded series: written and read back the same, pictures of every kind, mistakes named by file and line.
#include "omentum/world_series.h"
#include "test_alloc.h"
#include "test_files.h"

enum { W = 48, H = 36, N = W * H };

static OmCamera make_camera(void) {
    return (OmCamera){.pose_world_camera = om_pose_look_at(om_vec3(0.1, 0.2, 0.3), om_vec3(0, 0, 0),
                                                           om_vec3(0, 0, 1)),
                      .width = W,
                      .height = H,
                      .near_m = 0.01,
                      .far_m = 2,
                      .lens = {61, 62, 23.75, 18.5, -0.1, 0.02, 1e-3, -2e-3, 0.003}};
}

// Frame k: depth that tells k and the pixel, arms that tell k.
static OmObservation make_frame(int k) {
    OmObservation obs = {.time = k, .narm = 2};
    obs.rgbd.time = 0.1 + k / 3.0;
    obs.rgbd.camera = make_camera();
    obs.rgbd.camera.pose_world_camera.p.x += 0.001 * k;
    obs.rgbd.depth = om_calloc(N, sizeof(float));
    assert_non_null(obs.rgbd.depth);
    assert_ok(om_picture_init(&obs.rgbd.color, W, H, 3));
    for (int i = 0; i < N; ++i) obs.rgbd.depth[i] = i % 7 ? 0.1f + 1e-4f * (float)(i % 50 + k) : 0;
    for (int i = 0; i < 3 * N; ++i) obs.rgbd.color.pixel[i] = (unsigned char)(i * 13 + k);
    for (int a = 0; a < 2; ++a) {
        obs.arm[a].tip = (OmPose){om_vec3(0.01 * a, 1.0 / 3, 0.02 * k),
                                  om_quat_axis_angle(om_vec3(0, 1, 0), 0.3 + a + k)};
        for (int j = 0; j < OM_PSM_NJOINT; ++j) obs.arm[a].q[j] = 0.1 * j + a + 1.0 / (k + 3);
        obs.arm[a].jaw = 0.2 + 0.1 * a;
    }
    return obs;
}

static const char* make_dir(void) {
    const char* dir = temp_path("series");
    om_path_remove(dir);
    return dir;
}

static void what_is_written_is_read(void** state) {
    (void)state;
    const char* dir = make_dir();
    OmCamera camera = make_camera();
    OmSeries s, t;
    assert_ok(om_series_begin(dir, &camera, NULL, &s));
    assert_ok(om_series_load(dir, &t));
    assert_int_equal(t.nframe, 0);
    om_series_done(&t);
    for (int k = 0; k < 3; ++k) {
        OmObservation obs = make_frame(k);
        if (k == 1) om_picture_done(&obs.rgbd.color);
        assert_ok(om_series_append(&s, &obs));
        om_observation_done(&obs);
    }
    assert_ok(om_series_load(dir, &t));
    assert_int_equal(t.nframe, 3);
    assert_memory_equal(&t.camera.lens, &camera.lens, sizeof camera.lens);
    OmObservation got = {0};
    for (int k = 0; k < 3; ++k) {
        OmObservation want = make_frame(k);
        assert_ok(om_series_get_frame(&t, k, NULL, &got));
        assert_near(got.rgbd.time, want.rgbd.time, 0);
        assert_memory_equal(&got.rgbd.camera.pose_world_camera, &want.rgbd.camera.pose_world_camera,
                            sizeof(OmPose));
        assert_int_equal(got.narm, 2);
        for (int a = 0; a < 2; ++a) {
            assert_memory_equal(&got.arm[a].tip, &want.arm[a].tip, sizeof(OmPose));
            assert_memory_equal(got.arm[a].q, want.arm[a].q, sizeof want.arm[a].q);
            assert_near(got.arm[a].jaw, want.arm[a].jaw, 0);
        }
        for (int i = 0; i < N; ++i)  // half a unit of 0.1 mm, and float
            assert_near((double)got.rgbd.depth[i], (double)want.rgbd.depth[i], 5.001e-5);
        for (int i = 0; i < N; ++i) assert_int_equal(got.rgbd.depth[i] == 0, i % 7 == 0);
        if (k == 1)
            assert_null(got.rgbd.color.pixel);
        else
            assert_memory_equal(got.rgbd.color.pixel, want.rgbd.color.pixel, 3 * N);
        om_observation_done(&want);
    }
    assert_status(om_series_get_frame(&t, 3, NULL, &got), OM_INVALID);
    assert_null(got.rgbd.depth);
    om_series_done(&t);
    om_series_done(&s);
    assert_status(om_series_begin(dir, &camera, NULL, &s), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "holds a series"));
    om_path_remove(dir);
}

// Depth without return, not finite, or beyond 16 bits is 0.
static void depth_that_does_not_fit_is_none(void** state) {
    (void)state;
    const char* dir = make_dir();
    OmCamera camera = make_camera();
    OmSeries s;
    OmObservation obs = make_frame(0), got = {0};
    const float odd[] = {NAN, INFINITY, -1, 6.6f, 4e-5f, 6e-5f, 6.5f};
    memcpy(obs.rgbd.depth, odd, sizeof odd);
    assert_ok(om_series_begin(dir, &camera, NULL, &s));
    assert_ok(om_series_append(&s, &obs));
    assert_ok(om_series_get_frame(&s, 0, NULL, &got));
    for (int i = 0; i < 5; ++i) assert_true(got.rgbd.depth[i] == 0);
    assert_near((double)got.rgbd.depth[5], 1e-4, 1e-10);
    assert_near((double)got.rgbd.depth[6], 6.5, 1e-6);
    om_observation_done(&obs);
    om_observation_done(&got);
    om_series_done(&s);
    om_path_remove(dir);
}

static void refuse(const OmObservation* obs, OmSeries* s, const char* words) {
    int before = s->nframe;
    assert_status(om_series_append(s, obs), OM_INVALID);
    if (!strstr(om_error_message(), words)) fail_msg("%s: %s", words, om_error_message());
    assert_int_equal(s->nframe, before);
}

static void bad_frames_are_refused(void** state) {
    (void)state;
    const char* dir = make_dir();
    OmCamera camera = make_camera();
    OmSeries s, t;
    OmObservation obs = make_frame(0), empty = {0};
    assert_ok(om_series_begin(dir, &camera, NULL, &s));
    refuse(&empty, &s, "no depth picture");
    obs.rgbd.camera.lens.k1 = 0;
    refuse(&obs, &s, "not the one that the series began with");
    obs.rgbd.camera.lens.k1 = camera.lens.k1;
    obs.arm[1].tip.q.x = NAN;
    refuse(&obs, &s, "is not finite");
    obs.arm[1].tip.q.x = 0;
    obs.rgbd.time = NAN;
    refuse(&obs, &s, "time nan");
    obs.rgbd.time = 3;
    assert_ok(om_series_append(&s, &obs));
    refuse(&obs, &s, "time 3 of a frame does not come after 3");
    assert_ok(om_series_load(dir, &t));
    obs.rgbd.time = 4;
    refuse(&obs, &t, "a series that was read gets none");
    assert_status(om_series_append_stereo(&s, 5, camera.pose_world_camera, &obs.rgbd.color,
                                          &obs.rgbd.color, NULL),
                  OM_INVALID);
    om_series_done(&t);
    // A picture that is missing, and one of another size, are named.
    OmPicture other;
    char path[600];
    snprintf(path, sizeof path, "%s/%s", dir, s.frame[0].color);
    assert_ok(om_picture_init(&other, 5, 4, 3));
    assert_ok(om_picture_save_png(&other, path));
    om_picture_done(&other);
    assert_status(om_series_get_frame(&s, 0, NULL, &empty), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "000000_color.png: 5 x 4 pixels"));
    assert_null(empty.rgbd.depth);
    remove(path);
    assert_status(om_series_get_frame(&s, 0, NULL, &empty), OM_IO);
    assert_non_null(strstr(om_error_message(), "000000_color.png"));
    om_observation_done(&obs);
    om_series_done(&s);
    om_path_remove(dir);
    assert_status(om_series_load(dir, &s), OM_IO);
}

#define CAMERA "camera: {width: 48, height: 36, focal_px: [60, 60], center_px: [23.5, 17.5]}\n"
#define POSE "position: [0, 0, 1], quaternion_xyzw: [0, 0, 0, 1]"

static void mistakes_are_named(void** state) {
    (void)state;
    static const struct {
        const char *text, *message;
    } bad[] = {
        {"frame: []\n", "s.yaml:1: series: \"camera\" is missing"},
        {"camera: {width: 48, height: 36, focal_px: [60], center_px: [1, 1]}\n",
         "s.yaml:1: focal_px: has 1 numbers, 2 are wanted"},
        {"camera: {width: 48, height: 36, focal_px: [6, 6], center_px: [23.5, 17.5], "
         "distortion: [-1, 0, 0, 0, 0]}\n",
         "folds the picture"},
        {CAMERA "frame:\n  - {time: 1, color: a.png}\n", "s.yaml:3: frame: its pose is missing"},
        {CAMERA "frame:\n  - {time: 1, " POSE "}\n", "s.yaml:3: frame: no picture; give color"},
        {CAMERA "frame:\n  - {time: 1, color: a.png, position: [0, 0, 1], "
                "quaternion_xyzw: [0, 0, 0.5, 0.5]}\n",
         "s.yaml:3: frame: quaternion_xyzw has length 0.707"},
        {CAMERA "frame:\n  - {time: 1, color: a.png, " POSE ", matrix: [1,0,0,0, 0,1,0,0, 0,0,1,0, "
                "0,0,0,1]}\n",
         "s.yaml:3: frame: its pose is given twice"},
        {CAMERA "frame:\n  - {time: 1, color: a.png, matrix: [1,0,0,0, 0,1,0,0, 0,0,-1,0, "
                "0,0,0,1]}\n",
         "s.yaml:3: frame: matrix is not a rigid motion"},
        {CAMERA "frame:\n  - {time: 1, color: a.png, position: [nan, 0, 1], "
                "quaternion_xyzw: [0, 0, 0, 1]}\n",
         "s.yaml:3: position: \"nan\" is not a number"},
        {CAMERA "frame:\n  - {time: 1, color: ../a.png, " POSE "}\n",
         "s.yaml:3: frame: \"../a.png\" is not in the series' folder"},
        {CAMERA "frame:\n  - {time: 1, color: a.png, right: b.png, " POSE "}\n",
         "s.yaml:3: frame: right is given, but the series has no camera"},
        {CAMERA "frame:\n  - {time: 2, color: a.png, " POSE "}\n  - {time: 2, color: a.png, " POSE
                "}\n",
         "s.yaml:4: frame: time 2 does not come after 2"},
        {CAMERA "frame:\n  - time: 2\n    color: a.png\n    " POSE "\n", "s.yaml:"},
        {CAMERA "frame:\n  - {time: 2, color: a.png, " POSE ",\n    arm: [{joints: [0, 0, 0, 0, 0, "
                "0], jaw: 1}]}\n",
         "s.yaml:4: arm: its pose is missing"},
        {CAMERA "frame:\n  - {time: 2, color: a.png, " POSE ",\n    arm: [{" POSE ", jaw: 1}]}\n",
         "s.yaml:4: arm: \"joints\" is missing"},
        {CAMERA "frame:\n  - {time: 2, colour: a.png}\n", "did you mean \"color\"?"},
    };
    OmSeries s;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        assert_status(om_series_parse(bad[i].text, strlen(bad[i].text), "s.yaml", ".", &s),
                      OM_INVALID);
        if (!strstr(om_error_message(), bad[i].message))
            fail_msg("%s: %s", bad[i].message, om_error_message());
        assert_null(s.frame);
    }
}

// OpenCV's centre, a pose as a matrix, and the default unit.
static void files_of_others_are_read(void** state) {
    (void)state;
    const char* text =
        CAMERA "right: {width: 48, height: 36, focal_px: [60, 60], center_px: [23.5, 17.5],\n"
               "  position: [0.005, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}\n"
               "frame:\n  - {time: 1, color: l.png, right: r.png,\n"
               "     matrix: [0, -1, 0, 0.1,  1, 0, 0, 0.2,  0, 0, 1, 0.3,  0, 0, 0, 1]}\n";
    OmSeries s;
    assert_ok(om_series_parse(text, strlen(text), "s.yaml", "/data", &s));
    assert_near(s.camera.lens.cx, 24, 0);
    assert_near(s.camera.lens.cy, 18, 0);
    assert_near(s.depth_unit, 1e-4, 1e-18);
    assert_near(s.right.pose_world_camera.p.x, 0.005, 0);
    OmVec3 p = om_pose_apply(s.frame[0].pose_world_camera, om_vec3(1, 2, 3));
    assert_near(om_distance(p, om_vec3(-1.9, 1.2, 3.3)), 0, 1e-12);
    om_series_done(&s);
}

// Two pictures of a textured plane 100 mm away; colours alone are the endoscope's.
static void a_stereo_pair_becomes_depth(void** state) {
    (void)state;
    enum { W2 = 160, H2 = 120 };
    const char* dir = make_dir();
    OmCamera left = {.pose_world_camera =
                         om_pose_look_at(om_vec3(0, 0, 0.1), om_vec3(0, 0, 0), om_vec3(0, 1, 0)),
                     .width = W2,
                     .height = H2,
                     .near_m = 0.01,
                     .far_m = 1,
                     .lens = {200, 200, 80, 60, 0, 0, 0, 0, 0}};
    OmCamera right = left;
    right.pose_world_camera = (OmPose){om_vec3(0.005, 0, 0), om_quat_identity()};
    OmPicture l, r;
    assert_ok(om_picture_init(&l, W2, H2, 3));
    assert_ok(om_picture_init(&r, W2, H2, 3));
    OmRng rng = om_rng_init(6, 0);
    static unsigned char noise[H2][W2 + 10];  // disparity 200 x 0.005 / 0.1 = 10 pixels
    for (int y = 0; y < H2; ++y)
        for (int x = 0; x < W2 + 10; ++x) noise[y][x] = (unsigned char)om_rng_below(&rng, 250);
    for (int i = 0; i < W2 * H2; ++i)
        for (int k = 0; k < 3; ++k) {
            l.pixel[3 * i + k] = noise[i / W2][i % W2];
            r.pixel[3 * i + k] = noise[i / W2][i % W2 + 10];
        }
    OmSeries s, t;
    assert_ok(om_series_begin(dir, &left, &right, &s));
    assert_ok(om_series_append_stereo(&s, 1, left.pose_world_camera, &l, &r, NULL));
    assert_ok(om_series_load(dir, &t));
    OmObservation obs = {0};
    assert_ok(om_series_get_frame(&t, 0, NULL, &obs));
    int n = 0;
    for (int i = 0; i < W2 * H2; ++i) {
        if (!(obs.rgbd.depth[i] > 0)) continue;
        assert_near((double)obs.rgbd.depth[i], 0.1, 5e-4);
        ++n;
    }
    assert_true(n > W2 * H2 * 85 / 100);
    assert_memory_equal(obs.rgbd.color.pixel, l.pixel, 3 * W2 * H2);
    t.frame[0].right[0] = 0;
    assert_ok(om_series_get_frame(&t, 0, NULL, &obs));
    assert_null(obs.rgbd.depth);
    assert_memory_equal(obs.endoscope.color.pixel, l.pixel, 3 * W2 * H2);
    om_observation_done(&obs);
    om_picture_done(&l);
    om_picture_done(&r);
    om_series_done(&s);
    om_series_done(&t);
    om_path_remove(dir);
}

// Nothing is written that om_series_load refuses.
static void values_out_of_range_are_refused(void** state) {
    (void)state;
    const char* dir = make_dir();
    OmCamera camera = make_camera();
    OmSeries s, t;
    for (int k = 0; k < 3; ++k) {
        OmCamera bad = camera, right = camera;
        if (k == 0) bad.far_m = 5000;
        if (k == 1) bad.lens.fx = 1e7;
        if (k == 2) right.pose_world_camera.q.w += 1;
        assert_status(om_series_begin(dir, &bad, &right, &s), OM_INVALID);
    }
    assert_ok(om_series_begin(dir, &camera, NULL, &s));
    OmObservation good = make_frame(0);
    for (int k = 0; k < 10; ++k) {
        OmObservation obs = good;
        if (k == 0) obs.arm[1].q[2] = NAN;
        if (k == 1) obs.arm[1].q[2] = 200;
        if (k == 2) obs.arm[0].jaw = 7;
        if (k == 3) obs.arm[0].jaw = NAN;
        if (k == 4) obs.arm[1].tip.p.z = 2000;
        if (k == 5) obs.arm[1].tip.q.w += 0.1;
        if (k == 6) obs.rgbd.camera.pose_world_camera.q.x = NAN;
        if (k == 7) obs.rgbd.time = 1e13;
        if (k == 8) obs.narm = OM_MAX_ARM + 1;
        if (k == 9) obs.narm = -1;
        assert_status(om_series_append(&s, &obs), OM_INVALID);
    }
    assert_int_equal(s.nframe, 0);
    assert_ok(om_series_append(&s, &good));
    assert_ok(om_series_load(dir, &t));
    om_observation_done(&good);
    om_series_done(&s);
    om_series_done(&t);
    om_path_remove(dir);
}

static OmStatus record_and_read(void* ctx) {
    const OmObservation* obs = ctx;
    const char* dir = make_dir();
    OmSeries s = {0}, t = {0};
    OmObservation got = {0};
    OmStatus status = om_series_begin(dir, &obs->rgbd.camera, NULL, &s);
    if (status == OM_OK) status = om_series_append(&s, obs);
    if (status == OM_OK) status = om_series_load(dir, &t);
    if (status == OM_OK) status = om_series_get_frame(&t, 0, NULL, &got);
    om_observation_done(&got);
    om_series_done(&s);
    om_series_done(&t);
    return status;
}

static void every_refused_memory_returns(void** state) {
    (void)state;
    OmObservation obs = make_frame(0);
    assert_true(test_failing_allocations(record_and_read, &obs, 1) > 10);
    om_observation_done(&obs);
    om_path_remove(make_dir());
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_is_read),
        cmocka_unit_test(depth_that_does_not_fit_is_none),
        cmocka_unit_test(bad_frames_are_refused),
        cmocka_unit_test(mistakes_are_named),
        cmocka_unit_test(files_of_others_are_read),
        cmocka_unit_test(a_stereo_pair_becomes_depth),
        cmocka_unit_test(values_out_of_range_are_refused),
        cmocka_unit_test(every_refused_memory_returns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
