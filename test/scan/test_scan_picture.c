// test_scan_picture.c: a scan against the true surface of a simulated world, which the test knows and the scan
// does not.
#include "scan/scan_truth.h"
#include "test_alloc.h"

#include "omentum/shape_file.h"

static void test_sheet(void** state) {
    (void)state;
    Field f;
    OmScene scene = half_held();
    scene.rgbd = om_scene_default().rgbd;
    setup(&f, scene);
    assert_ok(om_world_reset(f.world));
    OmScanDef def = om_scan_default_def(om_site_spacing(&f.site));
    check_view(&f, &def, &f.site, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, "sheet at rest");
    check_view(&f, &def, &f.site, OM_OBSERVE_DEPTH, "sheet at rest, no colour");
    grasp_at(&f, 0, om_vec3(-0.048, -0.048, 0.005));
    assert_ok(om_world_move(f.world, 0, to_world(&f, 0, om_vec3(0.0, -0.02, 0.045)), 0.02));
    for (int i = 0; i < 200; ++i) assert_ok(om_world_advance(f.world, 0.02));
    assert_true(is_holding(&f, 0));
    check_view(&f, &def, &f.site, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, "folded");
    check_view(&f, &def, &f.site, OM_OBSERVE_DEPTH, "folded, no colour");
    teardown(&f);
}

// A lens of an endoscope: the points are on the surface all the same.
static void test_distortion(void** state) {
    (void)state;
    Field f;
    OmScene scene = half_held();
    scene.rgbd = om_scene_default().rgbd;
    const double lens[5] = {-0.25, 0.08, 1e-3, -1e-3, 0};
    memcpy(scene.rgbd.distortion, lens, sizeof lens);
    setup(&f, scene);
    assert_ok(om_world_advance(f.world, 0.02));
    OmScanDef def = om_scan_default_def(om_site_spacing(&f.site));
    check_view(&f, &def, &f.site, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, "distorted");
    teardown(&f);
}

// Noise that the definition does not know: it is measured, and points and normals stay good.
static void test_more_noise(void** state) {
    (void)state;
    Field f;
    OmScene scene = half_held();
    scene.rgbd = om_scene_default().rgbd;
    setup(&f, scene);
    OmScanDef def = om_scan_default_def(om_site_spacing(&f.site));
    OmObservation obs = observe(&f, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR);
    OmRng rng = om_rng_init(11, 0);
    int npixel = obs.rgbd.camera.width * obs.rgbd.camera.height;
    for (int i = 0; i < npixel; ++i)
        if (obs.rgbd.depth[i] > 0) obs.rgbd.depth[i] += (float)(0.002 * om_rng_normal(&rng));
    OmScan scan;
    const OmCloudDef space = om_cloud_default_def(f.world, &f.site);
    assert_ok(om_scan_from_observation(&def, &space, &obs, &scan));
    Truth truth = truth_init(&f, &obs.rgbd.camera);
    ScanQuality q = scan_quality(&truth, &obs, &scan);
    print_message(
        "2 mm more noise: found %.4f, to the surface %.3f / %.3f mm (noise %.3f), normals "
        "%.1f / %.1f degrees, %.2f mm apart\n",
        q.found, 1e3 * q.median, 1e3 * q.p90, 1e3 * scan.noise, q.normal_median * 180 / OM_PI,
        q.normal_p90 * 180 / OM_PI, 1e3 * q.spacing);
    assert_true(q.found > 0.97);
    assert_below(q.median, 4e-4);
    assert_below(q.p90, 1e-3);
    assert_below(q.normal_median, 6 * OM_PI / 180);
    assert_near_rel(q.spacing, def.spacing, 0.15);
    assert_true(scan.noise > q.median && scan.noise < 3 * q.median);
    truth_done(&truth);
    om_scan_done(&scan);
    om_observation_done(&obs);
    teardown(&f);
}

// The camera and every pixel are those of the picture; triangles face the camera.
static void test_scan_says_where_from(void** state) {
    (void)state;
    Field f;
    setup(&f, half_held());
    assert_ok(om_world_advance(f.world, 0.02));
    OmObservation obs = observe(&f, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR);
    OmScanDef def = om_scan_default_def(om_site_spacing(&f.site));
    OmScan scan;
    const OmCloudDef space = om_cloud_default_def(f.world, &f.site);
    assert_ok(om_scan_from_observation(&def, &space, &obs, &scan));
    assert_near(scan.time, 0.02, 1e-12);
    assert_true(scan.has_camera);
    assert_memory_equal(&scan.camera, &obs.rgbd.camera, sizeof scan.camera);
    OmVec3 eye = scan.camera.pose_world_camera.p;
    int ntissue = 0, nother = 0;
    for (int i = 0; i < scan.camera.width * scan.camera.height; ++i) {
        ntissue += scan.pixel[i] == OM_SCAN_TISSUE;
        nother += scan.pixel[i] == OM_SCAN_OTHER;
    }
    assert_true(ntissue > 3000 && nother > 3000);
    for (int t = 0; t < scan.ntri; ++t) {
        const int* v = scan.tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(scan.x, v[0]), b = om_load3(scan.x, v[1]), c = om_load3(scan.x, v[2]);
        assert_true(om_dot(om_cross(om_sub(b, a), om_sub(c, a)), om_sub(eye, a)) > 0);
    }
    for (int i = 0; i < scan.npoint; ++i) {
        double u, v;
        OmVec3 p = om_load3(scan.x, i);
        assert_true(om_dot(om_load3(scan.normal, i), om_sub(eye, p)) > 0);
        assert_true(om_camera_project(&scan.camera, p, &u, &v));
        assert_int_equal(scan.pixel[(int)v * scan.camera.width + (int)u], OM_SCAN_TISSUE);
    }
    om_scan_done(&scan);
    om_observation_done(&obs);
    teardown(&f);
}

// ---- made-up pictures: exact ----------------------------------------------------------------------------------

enum { WIDTH = 40, HEIGHT = 30 };

typedef struct Made {
    OmSite site;
    OmCloudDef space;  // no tools are known
    OmObservation obs;
    float depth[WIDTH * HEIGHT];
    unsigned char rgb[3 * WIDTH * HEIGHT];
} Made;

static const unsigned char orange[3] = {200, 130, 40}, white[3] = {250, 250, 245},
                           green[3] = {20, 140, 120};

static void paint(Made* m, int column, int row, float depth, const unsigned char rgb[3]) {
    int i = row * WIDTH + column;
    m->depth[i] = depth;
    memcpy(&m->rgb[3 * i], rgb, 3);
}

// A camera 200 mm above a plane of tissue, a pixel of it 1 mm wide.
static void make_picture(Made* m) {
    memset(m, 0, sizeof *m);
    m->site.pose_world_task = om_pose_identity();
    m->site.half_size = om_vec3(0.06, 0.06, 0.0025);
    m->space = om_cloud_default_def(NULL, &m->site);
    m->obs.rgbd.depth = m->depth;
    m->obs.rgbd.color = (OmPicture){WIDTH, HEIGHT, 3, m->rgb};
    OmPose pose = om_pose_look_at(om_vec3(0, 0, 0.2), om_vec3(0, 0, 0), om_vec3(0, 1, 0));
    m->obs.rgbd.camera = (OmCamera){pose, WIDTH, HEIGHT, 2 * atan(0.5 * HEIGHT * 0.005), 0.01, 1};
    for (int i = 0; i < WIDTH * HEIGHT; ++i) paint(m, i % WIDTH, i / WIDTH, 0.2F, orange);
}

static OmScan scan_of(const Made* m, const OmScanDef* def) {
    OmScan scan;
    assert_ok(om_scan_from_observation(def, &m->space, &m->obs, &scan));
    assert_ok(om_scan_check(&scan));
    return scan;
}

static int class_at(const OmScan* scan, int column, int row) {
    return scan->pixel[row * WIDTH + column];
}

static OmScanDef made_def(void) { return om_scan_default_def(0.004); }

// Points of a plane lie on it, cover it, and are joined to one piece.
static void test_plane(void** state) {
    (void)state;
    Made m;
    make_picture(&m);
    OmScanDef def = made_def();
    OmScan scan = scan_of(&m, &def);
    double area = 0;
    for (int i = 0; i < scan.npoint; ++i) {
        assert_near(scan.x[3 * i + 2], 0, 1e-8);  // depth is a float
        assert_near(scan.normal[3 * i + 2], 1, 1e-9);
    }
    for (int t = 0; t < scan.ntri; ++t) {
        const int* v = scan.tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(scan.x, v[0]);
        area +=
            0.5 * om_cross(om_sub(om_load3(scan.x, v[1]), a), om_sub(om_load3(scan.x, v[2]), a)).z;
    }
    assert_true(area > 0.8 * WIDTH * HEIGHT * 1e-6 && area < WIDTH * HEIGHT * 1e-6);
    OmSurface surface = {scan.npoint, scan.ntri, scan.x, scan.tri_vert};
    OmSurfaceCheck check;
    assert_ok(om_surface_check(&surface, &check));
    assert_int_equal(check.ncomponent, 1);
    assert_int_equal(check.nmanifold_edge, 0);
    assert_int_equal(check.nflipped_edge, 0);
    assert_int_equal(check.neuler, 1);  // a disc
    assert_near_rel(scan.noise, (2e-4 + 1.5e-3 * 0.04) / 3,
                    0.3);  // 9 pixels of 1 mm within 1.33 mm
    om_scan_done(&scan);
}

// What a sensor writes where it measured nothing says nothing: not that something else is there.
static void test_depth_out_of_range(void** state) {
    (void)state;
    static const float bad[] = {0, 65.535F, 0.005F, -1, INFINITY, NAN};
    Made m;
    make_picture(&m);
    for (int k = 0; k < 6; ++k)
        for (int row = 5; row < 13; ++row)
            for (int column = 0; column < 3; ++column) {
                paint(&m, 6 * k + column, row, bad[k], orange);
                paint(&m, 6 * k + 3 + column, row, bad[k], green);
            }
    for (int row = 18; row < 27; ++row)
        for (int column = 10; column < 20; ++column) paint(&m, column, row, 0.25F, green);
    OmScanDef def = made_def();
    for (int use = 0; use < 2; ++use) {
        def.use_color = use;
        OmScan scan = scan_of(&m, &def);
        for (int k = 0; k < 6; ++k)
            for (int column = 0; column < 6; ++column) {
                assert_int_equal(class_at(&scan, 6 * k + column, 9), OM_SCAN_UNKNOWN);
                assert_true(scan.depth[9 * WIDTH + 6 * k + column] == 0);
            }
        if (use) assert_int_equal(class_at(&scan, 15, 22), OM_SCAN_OTHER);
        assert_true(scan.depth[22 * WIDTH + 15] == 0.25F);
        om_scan_done(&scan);
    }
}

// A white spot in the tissue is tissue; beside the tissue, or before it, it is not. Other colours are never tissue.
static void test_highlights(void** state) {
    (void)state;
    Made m;
    make_picture(&m);
    for (int row = 5; row < 9; ++row)
        for (int column = 5; column < 9; ++column) {
            paint(&m, column, row, 0.2F, white);        // inside
            paint(&m, column + 10, row, 0.15F, white);  // before the tissue: a tool
            paint(&m, column + 20, row, 0.2F, green);   // another colour
            paint(&m, column, row + 12, row < 7 ? 0.2F : 0, row < 7 ? green : white);  // no depth
        }
    for (int i = 0; i < WIDTH * 4; ++i) paint(&m, i % WIDTH, HEIGHT - 4 + i / WIDTH, 0.2F, green);
    paint(&m, 20, HEIGHT - 2, 0.2F, white);  // a highlight of the board
    OmScanDef def = made_def();
    def.margin = 0;
    OmScan scan = scan_of(&m, &def);
    assert_int_equal(class_at(&scan, 6, 6), OM_SCAN_TISSUE);
    assert_int_equal(class_at(&scan, 16, 6),
                     OM_SCAN_TOOL);  // no kinematics: any grey thing is a tool
    assert_int_equal(class_at(&scan, 26, 6), OM_SCAN_OTHER);
    assert_int_equal(class_at(&scan, 6, 18), OM_SCAN_OTHER);
    assert_int_equal(class_at(&scan, 6, 20), OM_SCAN_UNKNOWN);
    assert_int_equal(class_at(&scan, 20, HEIGHT - 2), OM_SCAN_TOOL);
    assert_int_equal(class_at(&scan, 14, 6), OM_SCAN_TISSUE);
    om_scan_done(&scan);
    def.margin = 2;
    scan = scan_of(&m, &def);
    assert_int_equal(class_at(&scan, 14, 6), OM_SCAN_TOOL);
    assert_int_equal(class_at(&scan, 13, 4), OM_SCAN_TOOL);
    assert_int_equal(class_at(&scan, 12, 6), OM_SCAN_TISSUE);
    om_scan_done(&scan);
}

// Two layers: the triangles are cut at the step, pixels between the layers and small pieces are left out.
static void test_steps_and_specks(void** state) {
    (void)state;
    Made m;
    make_picture(&m);
    for (int i = 0; i < WIDTH * HEIGHT; ++i)
        if (i % WIDTH >= 20) m.depth[i] = i % WIDTH == 20 ? 0.185F : 0.17F;
    for (int i = 0; i < 9; ++i)
        paint(&m, 5 + i % 3, 5 + i / 3, 0.19F, orange);  // a speck of 9 mm^2
    OmScanDef def = made_def();
    OmScan scan = scan_of(&m, &def);
    for (int row = 0; row < HEIGHT; ++row) {
        assert_int_equal(class_at(&scan, 20, row), OM_SCAN_UNKNOWN);
        assert_int_equal(class_at(&scan, 19, row), OM_SCAN_TISSUE);
        assert_int_equal(class_at(&scan, 21, row), OM_SCAN_TISSUE);
    }
    assert_int_equal(class_at(&scan, 6, 6), OM_SCAN_UNKNOWN);
    for (int i = 0; i < scan.npoint; ++i) {
        double z = scan.x[3 * i + 2];
        assert_true(fabs(z) < 1e-8 || fabs(z - 0.03) < 1e-8);
    }
    for (int t = 0; t < scan.ntri; ++t) {
        const int* v = scan.tri_vert + 3 * (size_t)t;
        for (int k = 1; k < 3; ++k) assert_near(scan.x[3 * v[k] + 2], scan.x[3 * v[0] + 2], 1e-8);
    }
    om_scan_done(&scan);
    def.min_area = 5e-6;
    scan = scan_of(&m, &def);
    assert_int_equal(class_at(&scan, 6, 6), OM_SCAN_TISSUE);
    om_scan_done(&scan);
    def.min_area = 1;  // more than all: an empty scan, which is no error
    scan = scan_of(&m, &def);
    assert_int_equal(scan.npoint + scan.ntri, 0);
    om_scan_done(&scan);
}

// A slope of 3.5 mm a pixel of 1 mm: its cosine is 0.28.
static void test_grazing(void** state) {
    (void)state;
    Made m;
    make_picture(&m);
    for (int i = 0; i < WIDTH * HEIGHT; ++i) m.depth[i] = 0.2F + 0.0035F * (float)(i % WIDTH - 20);
    OmScanDef def = made_def();
    m.space.reach = 0.2;
    OmScan scan = scan_of(&m, &def);
    // Points are 4 mm apart on the slope, which is 3.6 times as long as in the picture.
    assert_true(scan.npoint > 150 && scan.ntri > 1.4 * scan.npoint);
    om_scan_done(&scan);
    def.min_cosine = 0.5;
    scan = scan_of(&m, &def);
    assert_int_equal(scan.ntri, 0);
    om_scan_done(&scan);
    def.max_jump = 0.003;  // no pixel has a neighbour at its depth in its row: two are not enough
    scan = scan_of(&m, &def);
    assert_int_equal(scan.npoint, 0);
    om_scan_done(&scan);
}

// A steep strip of two pixels, 28 mm^2 in the picture, away from the plane: it has points, but what lies on a line has
// neither a plane nor triangles.
static void test_strip(void** state) {
    (void)state;
    Made m;
    make_picture(&m);
    for (int row = 0; row < HEIGHT; ++row)
        for (int column = 0; column < 10; ++column) paint(&m, column, row, 0.2F, green);
    for (int row = 8; row < 22; ++row)
        for (int column = 4; column < 6; ++column)
            paint(&m, column, row, 0.2F + 0.003F * (float)(row - 7), orange);
    m.space.reach = 0.2;
    OmScanDef def = made_def();
    OmScan scan = scan_of(&m, &def);
    int nstrip = 0;
    for (int i = 0; i < scan.npoint; ++i) {
        OmVec3 p = om_load3(scan.x, i);
        bool is_strip = p.z < -1e-4;
        nstrip += is_strip;
        assert_near(om_norm(om_load3(scan.normal, i)), is_strip ? 0 : 1, is_strip ? 0 : 1e-12);
        for (int k = 0; k < 3 * scan.ntri; ++k) assert_true(!is_strip || scan.tri_vert[k] != i);
    }
    assert_int_equal(nstrip, 7);  // rows are 3.2 mm apart: a point of every second one
    om_scan_done(&scan);
}

// A vertical tool whose tip touches the plane. Beside it, where its margin is, colours decide; inside it, and without
// colours, they do not.
static void test_beside_a_tool(void** state) {
    (void)state;
    Made m;
    make_picture(&m);
    OmPsm psm = om_psm_default(OM_PROGRASP, om_pose_identity());
    const double q[OM_PSM_NJOINT] = {0, 0, 0.1, 0, 0, 0};
    OmVec3 tip = om_vec3(0.0005, 0.0005, -0.004);
    psm.pose_world_rcm.p = om_sub(tip, om_psm_forward(&psm, q).p);
    m.obs.narm = 1;
    m.obs.arm[0].tip = om_psm_forward(&psm, q);
    memcpy(m.obs.arm[0].q, q, sizeof q);
    OmScanDef def = made_def();
    m.space.psm[0] = &psm;
    def.margin = 0;
    OmScan by_color = scan_of(&m, &def);
    int i = 0;
    while (by_color.pixel[i] != OM_SCAN_TOOL && i < WIDTH * HEIGHT - 1) ++i;
    assert_int_equal(by_color.pixel[i], OM_SCAN_TOOL);  // inside the capsule, of any colour
    assert_int_equal(by_color.pixel[i - 1], OM_SCAN_TISSUE);
    paint(&m, (i - 1) % WIDTH, i / WIDTH, 0.2F, white);
    paint(&m, 35, 25, 0.2F, white);
    OmScan grey = scan_of(&m, &def);
    assert_int_equal(grey.pixel[i - 1], OM_SCAN_TOOL);
    assert_int_equal(class_at(&grey, 35, 25), OM_SCAN_TISSUE);  // a highlight, away from the tool
    def.use_color = false;
    OmScan by_space = scan_of(&m, &def);
    assert_int_equal(by_space.pixel[i - 1], OM_SCAN_TOOL);
    assert_int_equal(by_space.pixel[i - 4], OM_SCAN_TISSUE);
    om_scan_done(&by_color);
    om_scan_done(&grey);
    om_scan_done(&by_space);
}

static void test_bad_input(void** state) {
    (void)state;
    Made m;
    make_picture(&m);
    const OmScanDef good = made_def();
    OmScan scan;
    OmCloudDef space = m.space;
    OmScanDef bad[9];
    for (int i = 0; i < 9; ++i) bad[i] = good;
    bad[0].cookie = 0;
    bad[1].spacing = 0;
    bad[2].max_jump = NAN;
    bad[3].min_cosine = 1;
    bad[4].min_area = -1;
    bad[5].margin = 17;
    bad[6].noise_a = -1e-4;
    bad[7].tissue.hue_max = 400;
    bad[8].tool.value_min = 2;
    for (int i = 0; i < 9; ++i) {
        assert_status(om_scan_from_observation(&bad[i], &space, &m.obs, &scan), OM_INVALID);
        assert_null(scan.x);
    }
    space.reach = -1;
    assert_status(om_scan_from_observation(&good, &space, &m.obs, &scan), OM_INVALID);
    assert_null(scan.x);
    space = m.space;
    m.obs.rgbd.color.width = WIDTH - 1;
    assert_status(om_scan_from_observation(&good, &space, &m.obs, &scan), OM_INVALID);
    m.obs.rgbd.depth = NULL;
    assert_status(om_scan_from_observation(&good, &space, &m.obs, &scan), OM_INVALID);
}

static OmStatus make_scan(void* ctx) {
    const Made* m = ctx;
    const OmScanDef def = made_def();
    OmScan scan;
    OmStatus status = om_scan_from_observation(&def, &m->space, &m->obs, &scan);
    if (status == OM_OK) om_scan_done(&scan);
    return status;
}

static void test_no_memory(void** state) {
    (void)state;
    Made m;
    make_picture(&m);
    assert_true(test_failing_allocations(make_scan, &m, 1) > 10);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sheet),         cmocka_unit_test(test_more_noise),
        cmocka_unit_test(test_distortion),    cmocka_unit_test(test_scan_says_where_from),
        cmocka_unit_test(test_plane),         cmocka_unit_test(test_depth_out_of_range),
        cmocka_unit_test(test_highlights),    cmocka_unit_test(test_steps_and_specks),
        cmocka_unit_test(test_grazing),       cmocka_unit_test(test_strip),
        cmocka_unit_test(test_beside_a_tool), cmocka_unit_test(test_bad_input),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
