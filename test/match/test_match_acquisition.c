// test_match_acquisition.c: files of acquisitions.
#include "linear_sheet.h"
#include "omentum/match_acquisition.h"
#include "omentum/world_series.h"
#include "test_alloc.h"
#include "test_files.h"

static OmPose random_pose(OmRng* rng) {
    double x = om_rng_normal(rng), y = om_rng_normal(rng), z = om_rng_normal(rng);
    OmVec3 axis = om_normalize(om_vec3(x, y, z));
    OmPose pose = {om_scale(0.1, axis), om_quat_axis_angle(axis, om_rng_range(rng, 0, 3))};
    return pose;
}

static void make_acquisition(OmAcquisition* a, uint64_t seed) {
    OmRng rng = om_rng_init(seed, 0);
    memset(a, 0, sizeof *a);
    assert_ok(om_scan_init(40, 1, &a->scan));
    for (int i = 0; i < 40; ++i) {
        OmPose p = random_pose(&rng);
        om_store3(a->scan.x, i, om_add(p.p, om_vec3(0, 0, 0.001 * i)));
        om_store3(a->scan.normal, i, om_quat_rotate(p.q, om_vec3(0, 0, 1)));
    }
    a->scan.tri_vert[1] = 1, a->scan.tri_vert[2] = 2;
    a->scan.has_camera = true;
    a->scan.camera = (OmCamera){.pose_world_camera = random_pose(&rng),
                                .width = 320,
                                .height = 240,
                                .fov = 0.9,
                                .near_m = 1e-3,
                                .far_m = 10,
                                .lens = {300, 310, 150.5, 121.5, 0.1, -0.02, 1e-3, 2e-3, 1e-3}};
    for (int i = 0; i < 40; ++i) {  // towards the camera, as a scan has them
        OmVec3 to_eye = om_sub(a->scan.camera.pose_world_camera.p, om_load3(a->scan.x, i));
        OmVec3 n = om_load3(a->scan.normal, i);
        om_store3(a->scan.normal, i, om_dot(n, to_eye) < 0 ? om_scale(-1, n) : n);
    }
    a->scan.noise = 0.0003;
    a->time = a->scan.time = 12.25;
    a->ngrasp = 2;
    for (int i = 0; i < 2; ++i)
        a->grasp[i] = (OmMatchGrasp){.arm = 1 - i,
                                     .pose_world_grasp = random_pose(&rng),
                                     .pose_world_now = random_pose(&rng),
                                     .radius = i ? 0 : 0.006};
}

static void check_pose(OmPose a, OmPose b, double tolerance) {
    assert_near(om_distance(a.p, b.p), 0, tolerance);
    assert_near(fabs(a.q.x * b.q.x + a.q.y * b.q.y + a.q.z * b.q.z + a.q.w * b.q.w), 1, 1e-12);
}

static void check_same(const OmAcquisition* a, const OmAcquisition* b) {
    assert_int_equal(a->scan.npoint, b->scan.npoint);
    assert_int_equal(a->ngrasp, b->ngrasp);
    for (int i = 0; i < a->scan.npoint; ++i) {
        assert_near(om_distance(om_load3(a->scan.x, i), om_load3(b->scan.x, i)), 0, 1e-7);
        assert_near(om_distance(om_load3(a->scan.normal, i), om_load3(b->scan.normal, i)), 0, 1e-6);
    }
    assert_near(a->scan.noise, b->scan.noise, 1e-18);
    assert_true(a->time == b->time && a->scan.time == b->scan.time);
    assert_true(b->scan.has_camera);
    check_pose(a->scan.camera.pose_world_camera, b->scan.camera.pose_world_camera, 1e-15);
    assert_int_equal(a->scan.camera.width, b->scan.camera.width);
    assert_near(a->scan.camera.fov, b->scan.camera.fov, 1e-15);
    assert_memory_equal(&a->scan.camera.lens, &b->scan.camera.lens, sizeof(OmLens));
    for (int i = 0; i < a->ngrasp; ++i) {
        assert_int_equal(a->grasp[i].arm, b->grasp[i].arm);
        assert_near(a->grasp[i].radius, b->grasp[i].radius, 1e-17);
        check_pose(a->grasp[i].pose_world_grasp, b->grasp[i].pose_world_grasp, 1e-15);
        check_pose(a->grasp[i].pose_world_now, b->grasp[i].pose_world_now, 1e-15);
    }
}

static void test_round_trip(void** state) {
    (void)state;
    OmAcquisition a, b;
    OmAcquisitionFile file;
    make_acquisition(&a, 1);
    const char* path = temp_path("lift.yaml");
    assert_ok(om_acquisition_save(&a, path));
    assert_ok(om_acquisition_load(path, NULL, &file, &b));
    assert_int_equal(file.registered, OM_REGISTERED_YES);
    assert_non_null(strstr(file.cloud, "lift.ply"));
    assert_null(strchr(file.cloud, '/'));
    check_same(&a, &b);
    om_acquisition_done(&b);
    assert_ok(om_acquisition_load(path, NULL, NULL, &b));
    // there and back: every part moves with the frame
    OmRng rng = om_rng_init(2, 0);
    OmPose pose = random_pose(&rng);
    om_acquisition_move(&b, pose);
    OmVec3 moved = om_pose_apply(pose, a.grasp[0].pose_world_now.p);
    assert_near(om_distance(moved, b.grasp[0].pose_world_now.p), 0, 1e-15);
    assert_near(om_distance(om_pose_apply(pose, om_load3(a.scan.x, 5)), om_load3(b.scan.x, 5)), 0,
                1e-7);
    OmVec3 turned = om_quat_rotate(pose.q, om_load3(a.scan.normal, 5));
    assert_near(om_distance(turned, om_load3(b.scan.normal, 5)), 0, 1e-6);
    om_acquisition_move(&b, om_pose_inverse(pose));
    for (int i = 0; i < 2; ++i)
        assert_near(om_distance(a.grasp[i].pose_world_grasp.p, b.grasp[i].pose_world_grasp.p), 0,
                    1e-15);
    assert_near(om_distance(a.scan.camera.pose_world_camera.p, b.scan.camera.pose_world_camera.p),
                0, 1e-15);
    om_acquisition_done(&a);
    om_acquisition_done(&b);
    om_acquisition_done(NULL);
    assert_status(om_acquisition_save(&b, "cloud.yml"), OM_INVALID);
    remove(path);
    remove(temp_path("lift.ply"));
}

static void refuse(const char* text, const char* word) {
    OmAcquisitionFile file;
    assert_status(om_acquisition_parse(text, strlen(text), "a.yaml", &file), OM_INVALID);
    if (!strstr(om_error_message(), word) || !strstr(om_error_message(), "a.yaml"))
        fail_msg("\"%s\" does not name %s", om_error_message(), word);
}

#define TOOL "  - {arm: psm1, grasp: {position_mm: [0, 0, 0]}, now: {position_mm: [0, 0, 9]}}\n"

static void test_keys(void** state) {
    (void)state;
    OmText text = {0};
    OmAcquisitionFile file;
    assert_ok(om_acquisition_print_example(&text));
    assert_ok(om_acquisition_parse(text.str, text.len, "example", &file));
    om_text_done(&text);
    assert_int_equal(file.ngrasp, 1);
    assert_true(file.has_camera && file.frame.unit == OM_UNIT_MM);
    assert_int_equal(file.frame.space, OM_SPACE_RAS);
    assert_near(file.grasp[0].pose_world_now.p.z, 0.030, 1e-15);
    // the camera of the example looks at the tissue
    OmVec3 z = om_quat_rotate(file.camera.pose_world_camera.q, om_vec3(0, 0, 1));
    OmVec3 to_tissue = om_normalize(om_scale(-1, file.camera.pose_world_camera.p));
    assert_true(om_dot(z, to_tissue) > 0.99);
    refuse("unit: mm\n", "cloud");
    refuse("cloud: \"\"\n", "name one source");
    refuse("cloud: a.ply\nseries: b\n", "name one source");
    refuse("cloud: a.ply\ntools:\n  - {arm: psm1, grasp_frame: 1}\n", "needs a series");
    refuse("cloud: a.ply\nunits: mm\n", "did you mean \"unit\"");
    refuse("cloud: a.ply\nunit: inch\n", "inch");
    refuse("cloud: a.ply\nregistered: maybe\n", "maybe");
    refuse("cloud: a.ply\nnoise_mm: .nan\n", "noise_mm");
    refuse("cloud: a.ply\ntools:\n" TOOL TOOL, "two are of arm psm1");
    refuse("cloud: a.ply\ntools:\n  - {arm: psm3}\n", "psm3");
    refuse("cloud: a.ply\ntools:\n  - {arm: psm1, grasp: {position_mm: [0, 0, 0]}}\n", "now");
    refuse("cloud: a.ply\ncamera: {position_mm: [0, 0, 1], orientation: {x: 0, y: 0, z: 0, w: 0},"
           " width: 4, height: 3, fov_deg: 40}\n",
           "length 0");
    refuse("cloud: a.ply\ncamera: {position_mm: [0, 0, 1], orientation: {x: 0, y: 0, z: 0, w: 1},"
           " width: 400, height: 300, fov_deg: 40, focal_px: [300, 300],"
           " distortion: [-900, 0, 0, 0, 0]}\n",
           "camera");
}

// A frame of a recorded series: the scan of its pictures, and the tips in both frames.
static void test_series(void** state) {
    (void)state;
    char dir[64], file_name[80], path[100];
    snprintf(dir, sizeof dir, "/tmp/omentum-series-XXXXXX");
    assert_non_null(mkdtemp(dir));
    snprintf(file_name, sizeof file_name, "%s/series", dir);
    OmScene scene = linear_sheet();
    OmSite site, twin;
    OmWorld* world;
    OmObservation obs = {0};
    OmSeries series = {.nframe = 0};
    scene.tissue.cells = om_vec3(6, 6, 1);
    scene.tissue.world_cells = om_vec3(10, 10, 1);
    scene.rgbd.width = 160, scene.rgbd.height = 120;
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &site));
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
    assert_ok(om_world_create_simulated(&scene, &site, 1, &world));
    OmPose tip[2];
    for (int k = 0; k < 2; ++k) {
        assert_ok(om_world_observe(world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs));
        if (k == 0) assert_ok(om_series_begin(file_name, &obs.rgbd.camera, NULL, &series));
        tip[k] = obs.arm[0].tip;
        assert_ok(om_series_append(&series, &obs));
        tip[k] = series.frame[k].arm[0].tip;
        OmPose goal = tip[k];
        goal.p.z += 0.01;
        assert_ok(om_world_move(world, 0, goal, 0.02));
        for (int i = 0; i < 10; ++i) assert_true(om_world_advance(world, 0.02) >= 0);
    }
    snprintf(path, sizeof path, "%s/lift.yaml", dir);
    const char* text = "series: series\nframe: 1\ntools:\n  - {arm: psm1, grasp_frame: 0}\n";
    write_bytes(path, text, strlen(text));
    OmAcquisition a;
    assert_ok(om_acquisition_load(path, &twin, NULL, &a));
    assert_true(a.scan.npoint > 20 && a.scan.has_camera && a.scan.pixel);
    assert_near(a.time, obs.rgbd.time, 1e-9);
    check_pose(a.grasp[0].pose_world_grasp, tip[0], 1e-9);
    check_pose(a.grasp[0].pose_world_now, tip[1], 1e-9);
    om_acquisition_done(&a);
    assert_status(om_acquisition_load(path, NULL, NULL, &a), OM_INVALID);
    const char* late = "series: series\nframe: 1\ntools:\n  - {arm: psm1, grasp_frame: 2}\n";
    write_bytes(path, late, strlen(late));
    assert_status(om_acquisition_load(path, &twin, NULL, &a), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "2 frames"));
    om_series_done(&series);
    om_observation_done(&obs);
    om_world_destroy(world);
    om_site_done(&site);
    om_site_done(&twin);
    assert_ok(om_path_remove(dir));
}

static OmStatus save_and_load(void* ctx) {
    OmAcquisition back;
    const char* path = temp_path("memory.yaml");
    OM_TRY(om_acquisition_save(ctx, path));
    OM_TRY(om_acquisition_load(path, NULL, NULL, &back));
    om_acquisition_done(&back);
    return OM_OK;
}

static void test_memory(void** state) {
    (void)state;
    OmAcquisition a;
    make_acquisition(&a, 3);
    assert_true(test_failing_allocations(save_and_load, &a, 1) > 10);
    om_acquisition_done(&a);
    remove(temp_path("memory.yaml"));
    remove(temp_path("memory.ply"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_keys),
        cmocka_unit_test(test_series),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
