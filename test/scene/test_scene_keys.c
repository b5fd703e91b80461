// Every key of a scene file lands in its own field, in SI: values worked out by hand, no two the same.
#include "test_common.h"

#include "omentum/scene.h"

static OmScene parse(const char* text) {
    OmScene s;
    assert_ok(om_scene_parse(text, strlen(text), "s.yaml", &s));
    return s;
}

#define PI 3.14159265358979323846

// Rounding of one product or quotient.
#define expect(value, wanted) assert_near_rel(value, wanted, 1e-14)

static void expect3(OmVec3 v, double x, double y, double z) {
    expect(v.x, x);
    expect(v.y, y);
    expect(v.z, z);
}

// Long: every key once, with its value.
static void test_a_sheet(void** state) {
    (void)state;
    OmScene s = parse(
        "name: keys\n"
        "seed: 23\n"
        "tissue:\n"
        "  source: sheet\n"
        "  size_mm: [101, 102, 7]\n"
        "  cells: [11, 12, 3]\n"
        "  world_cells: [25, 26, 4]\n"
        "  gravity: 1.62\n"
        "  young: 4321\n"
        "  poisson: 0.41\n"
        "  density: 1061\n"
        "  rayleigh_mass: 0.21\n"
        "  rayleigh_stiffness: 0.017\n"
        "  cluster_spacing_mm: 13\n"
        "  cluster_radius_mm: 9.25\n"
        "  cluster_stiffness: 0.375\n"
        "attachments: {kind: random_patch, share_min: 0.15, share_max: 0.35, stiffness: 77}\n"
        "roi: {radius_mm: 6.5, margin_mm: 3.5}\n"
        "endoscope: {distance_mm: 210, elevation_deg: 36, fov_deg: 72, width: 320, height: 200}\n"
        "rgbd: {distance_mm: 310, elevation_deg: 60, fov_deg: 45, width: 160, height: 120,\n"
        "  focal_px: [151, 152], center_px: [80.5, 60.25], distortion: [-0.2, 0.05, 0.001, -0.002, 0.01]}\n"
        "world: {young_factor: 0.7, density_factor: 1.3, tool_noise_mm: 0.4, depth_noise: false, "
        "arms: 1, force_noise: 0.3}\n"
        "task:\n"
        "  grid: 6\n"
        "  force_threshold: 2.25\n"
        "  force_margin: 0.125\n"
        "  max_height_mm: 48\n"
        "  pull_step_mm: 8\n"
        "  visibility: 0.75\n"
        "  speed_mm_s: 18\n"
        "  grasp_radius_mm: 4\n"
        "  time_step_ms: 25\n"
        "  max_actions: 90\n"
        "  retract_mm: 95\n"
        "  ahead: 5\n"
        "monitor: {enabled: true, limits_mm: [1.5, 3, 7], hysteresis_mm: 0.25, rate_hz: 15, points: "
        "400, part_limits_mm: [3, 5], part_share: 0.04}\n");
    assert_int_equal(s.seed, 23);
    expect3(s.tissue.size, 0.101, 0.102, 0.007);
    expect3(s.tissue.cells, 11, 12, 3);
    expect3(s.tissue.world_cells, 25, 26, 4);
    expect(s.tissue.gravity, 1.62);
    expect(s.tissue.young, 4321);
    expect(s.tissue.poisson, 0.41);
    expect(s.tissue.density, 1061);
    expect(s.tissue.rayleigh_mass, 0.21);
    expect(s.tissue.rayleigh_stiffness, 0.017);
    expect(s.tissue.cluster_spacing, 0.013);
    expect(s.tissue.cluster_radius, 0.00925);
    expect(s.tissue.cluster_stiffness, 0.375);
    expect(s.attach.share_min, 0.15);
    expect(s.attach.share_max, 0.35);
    expect(s.attach.stiffness, 77);
    expect(s.roi.radius, 0.0065);
    expect(s.roi.margin, 0.0035);
    expect(s.endoscope.distance, 0.21);
    expect(s.endoscope.elevation, PI / 5);
    expect(s.endoscope.fov, 2 * PI / 5);
    assert_int_equal(s.endoscope.width, 320);
    assert_int_equal(s.endoscope.height, 200);
    expect(s.rgbd.distance, 0.31);
    expect(s.rgbd.elevation, PI / 3);
    expect(s.rgbd.fov, PI / 4);
    assert_int_equal(s.rgbd.width, 160);
    assert_int_equal(s.rgbd.height, 120);
    expect(s.rgbd.focal[0], 151);
    expect(s.rgbd.focal[1], 152);
    expect(s.rgbd.center[0], 80.5);
    expect(s.rgbd.center[1], 60.25);
    const double distortion[5] = {-0.2, 0.05, 0.001, -0.002, 0.01};
    for (int i = 0; i < 5; ++i) expect(s.rgbd.distortion[i], distortion[i]);
    // OpenCV counts the first pixel's centre as 0, an OmLens as 0.5.
    OmCamera camera = om_scene_camera_place(&s.rgbd, (OmPose){.q = om_quat_identity()});
    const double lens[9] = {151, 152, 81, 60.75, -0.2, 0.05, 0.001, -0.002, 0.01};
    assert_memory_equal(&camera.lens, lens, sizeof lens);
    camera = om_scene_camera_place(&s.endoscope, (OmPose){.q = om_quat_identity()});
    assert_memory_equal(&camera.lens, &(OmLens){0}, sizeof camera.lens);
    expect(s.world.young_factor, 0.7);
    expect(s.world.narm, 1);
    expect(s.world.force_noise, 0.3);
    expect(s.world.density_factor, 1.3);
    expect(s.world.tool_noise, 0.0004);
    assert_false(s.world.has_depth_noise);
    assert_int_equal(s.task.grid, 6);
    expect(s.task.force_threshold, 2.25);
    expect(s.task.force_margin, 0.125);
    expect(s.task.max_height, 0.048);
    expect(s.task.pull_step, 0.008);
    expect(s.task.visibility, 0.75);
    expect(s.task.speed, 0.018);
    expect(s.task.grasp_radius, 0.004);
    expect(s.task.time_step, 0.025);
    assert_int_equal(s.task.max_actions, 90);
    expect(s.task.retract, 0.095);
    assert_int_equal(s.task.ahead, 5);
    assert_true(s.monitor.is_enabled);
    expect(s.monitor.limit[0], 0.0015);
    expect(s.monitor.limit[1], 0.003);
    expect(s.monitor.limit[2], 0.007);
    expect(s.monitor.hysteresis, 0.00025);
    expect(s.monitor.rate, 15);
    assert_int_equal(s.monitor.npoint, 400);
    expect(s.monitor.part_limit[0], 0.003);
    expect(s.monitor.part_limit[1], 0.005);
    expect(s.monitor.part_share, 0.04);
}

static void test_limits_of_the_monitor(void** state) {
    (void)state;
    const OmSceneMonitor plain = om_scene_default().monitor;
    assert_false(plain.is_enabled);
    expect(plain.part_limit[0], 0.004);
    expect(plain.part_limit[1], 0.008);
    expect(plain.limit[0], 0.002);
    expect(plain.limit[1], 0.004);
    expect(plain.limit[2], 0.006);
    const char* const wrong[][2] = {
        {"limits_mm: [2, 2, 6]", "limits_mm must ascend"},
        {"limits_mm: [2, 7, 6]", "limits_mm must ascend"},
        {"limits_mm: [2, 4]", "limits_mm"},
        {"part_limits_mm: [5, 5]", "part_limits_mm must ascend"},
        {"part_limits_mm: [0.3, 5]", "hysteresis_mm 0.5 must be below the first of part_limits_mm"},
        {"hysteresis_mm: 2", "hysteresis_mm 2 must be below the first limit, 2"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
        char text[256];
        OmScene s;
        int n = snprintf(text, sizeof text, "name: keys\ntissue: {source: sheet}\nmonitor: {%s}\n",
                         wrong[i][0]);
        assert_status(om_scene_parse(text, (size_t)n, "keys", &s), OM_INVALID);
        if (!strstr(om_error_message(), wrong[i][1])) fail_msg("%s", om_error_message());
    }
}

static void test_a_mesh(void** state) {
    (void)state;
    OmScene s =
        parse("name: keys\n"
              "tissue: {source: mesh, file: a.vtu, unit_mm: 10, up: [0, 1, 0], view: [1, 0, 0]}\n"
              "attachments: {kind: box, lo_mm: [-1, -2, -3], hi_mm: [4, 5, 6]}\n"
              "roi: {random: false, center_mm: [7, -8, 9], radius_mm: 5}\n");
    expect(s.tissue.unit, 0.01);
    expect3(s.tissue.up, 0, 1, 0);
    expect3(s.tissue.view, 1, 0, 0);
    expect3(s.attach.lo, -0.001, -0.002, -0.003);
    expect3(s.attach.hi, 0.004, 0.005, 0.006);
    expect3(s.roi.center, 0.007, -0.008, 0.009);
    expect(s.roi.radius, 0.005);
}

static void test_a_volume(void** state) {
    (void)state;
    OmScene s = parse("name: keys\n"
                      "tissue: {source: volume, file: a.nii.gz}\n"
                      "model:\n"
                      "  label: 9\n"
                      "  edge_mm: 4.5\n"
                      "  world_edge_mm: 3.25\n"
                      "  thickness_mm: 8.5\n"
                      "  side: lateral\n"
                      "  half_length_mm: 41\n"
                      "  half_width_mm: 31\n"
                      "  attach: border:superior 30 %\n"
                      "  tumour_radius_mm: 11\n"
                      "  tumour_shift_mm: [2, -3, 0]\n"
                      "  tumour_range_mm: [5, 6, 0]\n"
                      "  attach_turn_deg: 90\n");
    assert_int_equal(s.model.label, 9);
    expect(s.model.edge, 0.0045);
    expect(s.model.world_edge, 0.00325);
    expect(s.model.thickness, 0.0085);
    assert_string_equal(s.model.side, "lateral");
    expect(s.model.half_length, 0.041);
    expect(s.model.half_width, 0.031);
    assert_string_equal(s.model.attach, "border:superior 30 %");
    expect(s.model.tumour_radius, 0.011);
    expect3(s.model.tumour_shift, 0.002, -0.003, 0);
    expect3(s.model.tumour_range, 0.005, 0.006, 0);
    expect(s.model.attach_turn, PI / 2);
}

// Shells are cells of a sheet, and its default: they are read, and other tissue refuses them with the remedy.
static void test_shells(void** state) {
    (void)state;
    OmScene s = parse("name: keys\ntissue: {source: sheet}\n");
    assert_int_equal(s.tissue.element, -1);
    assert_int_equal(om_scene_element(&s, OM_SITE_TWIN), OM_ELEMENT_SHELL);
    assert_int_equal(om_scene_element(&s, OM_SITE_WORLD), OM_ELEMENT_SHELL);
    s = parse("name: keys\ntissue: {source: mesh, file: a.vtu}\n");
    assert_int_equal(om_scene_element(&s, OM_SITE_TWIN), OM_ELEMENT_QUADRATIC);
    s = parse("name: keys\ntissue: {source: sheet, element: linear}\n");
    assert_int_equal(om_scene_element(&s, OM_SITE_WORLD), OM_ELEMENT_LINEAR);
    s = parse("name: keys\ntissue: {source: sheet, element: shell}\nworld: {element: quadratic}\n");
    assert_int_equal(om_scene_element(&s, OM_SITE_TWIN), OM_ELEMENT_SHELL);
    assert_int_equal(om_scene_element(&s, OM_SITE_WORLD), OM_ELEMENT_QUADRATIC);
    const char text[] = "name: keys\ntissue: {source: mesh, file: a.vtu, element: shell}\n";
    assert_status(om_scene_parse(text, strlen(text), "keys", &s), OM_INVALID);
    if (!strstr(om_error_message(), "shell needs `source: sheet`"))
        fail_msg("%s", om_error_message());
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_sheet), cmocka_unit_test(test_limits_of_the_monitor),
        cmocka_unit_test(test_a_mesh),  cmocka_unit_test(test_a_volume),
        cmocka_unit_test(test_shells),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
