// test_sense_segment.c: parts of a picture can be told by colour alone: their pixels lie in the ranges of HSV that the
// header states, under several poses of camera, tissue and tools. Object ids are used in the test only.
#include "omentum/robot.h"
#include "sense_shapes.h"

enum { W = 320, H = 240, NGRID = 41 };

// A sheet of 80 x 80 mm with a fold along x of the given height, and its underside.
static OmSurface make_sheet(double height) {
    OmSurface s;
    const int n = NGRID * NGRID;
    assert_ok(om_surface_init(&s, 2 * n, 4 * (NGRID - 1) * (NGRID - 1)));
    int t = 0;
    for (int side = 0; side < 2; ++side) {
        for (int i = 0; i < n; ++i) {
            double x = 0.08 * (i % NGRID) / (NGRID - 1) - 0.04,
                   y = 0.08 * (i / NGRID) / (NGRID - 1) - 0.04;
            double z = 0.001 + height * exp(-(x - 0.01) * (x - 0.01) / 2e-4);
            om_store3(s.x, side * n + i, om_vec3(x, y, z + (side ? 0 : 0.004)));
        }
        for (int i = 0; i < n; ++i) {
            if (i % NGRID + 1 == NGRID || i / NGRID + 1 == NGRID) continue;
            int a = side * n + i, b = a + 1, c = b + NGRID, d = a + NGRID;
            memcpy(&s.tri_vert[3 * t++], side ? (int[3]){a, c, b} : (int[3]){a, b, c},
                   3 * sizeof(int));
            memcpy(&s.tri_vert[3 * t++], side ? (int[3]){a, d, c} : (int[3]){a, c, d},
                   3 * sizeof(int));
        }
    }
    return s;
}

static void add(OmSenseScene* scene, OmSurface* surface, OmSensePart part, OmSensePart* of_id) {
    OmSenseLook look = om_sense_look(part);
    int id;
    assert_ok(om_sense_scene_add(scene, surface, &look, &id));
    of_id[id] = part;
    om_surface_done(surface);
}

// Shaft, and wrist and jaws, of a gripper with its tip at p.
static void add_tool(OmSenseScene* scene, OmVec3 p, double jaw, OmSensePart* of_id) {
    OmPsm psm = om_psm_default(OM_PROGRASP, (OmPose){{0.01, 0.10, 0.13}, om_quat_identity()});
    const double start[OM_PSM_NJOINT] = {0};
    double q[OM_PSM_NJOINT];
    OmMat3 down = om_mat3_cols(om_vec3(0, 1, 0), om_vec3(1, 0, 0), om_vec3(0, 0, -1));
    assert_ok(om_psm_inverse(&psm, (OmPose){p, om_quat_from_mat3(down)}, start, q));
    OmSurface tool, shaft, head;
    assert_ok(om_psm_surface(&psm, q, jaw, &tool));
    const int nvert = OM_PSM_SHAFT_NVERT, ntri = OM_PSM_SHAFT_NTRI;
    assert_ok(om_surface_init(&shaft, nvert, ntri));
    assert_ok(om_surface_init(&head, tool.nvert - nvert, tool.ntri - ntri));
    for (int i = 0; i < 3 * tool.nvert; ++i)
        *(i < 3 * nvert ? &shaft.x[i] : &head.x[i - 3 * nvert]) = tool.x[i];
    for (int i = 0; i < 3 * tool.ntri; ++i) {
        int vert = tool.tri_vert[i];
        assert_int_equal(i < 3 * ntri, vert < nvert);  // no triangle belongs to both
        *(i < 3 * ntri ? &shaft.tri_vert[i] : &head.tri_vert[i - 3 * ntri]) =
            vert < nvert ? vert : vert - nvert;
    }
    om_surface_done(&tool);
    add(scene, &shaft, OM_PART_SHAFT, of_id);
    add(scene, &head, OM_PART_TOOL, of_id);
}

typedef struct Count {
    int all, right;
} Count;

// Pixels of each part in one picture, and how many of them have the colour of their part.
static void count_pixels(double height, double azimuth, double elevation, double distance,
                         Count count[OM_NPART + 1]) {
    OmSenseScene* scene;
    OmSensePart of_id[16];
    assert_ok(om_sense_scene_create(&scene));
    OmSurface sheet = make_sheet(height), board = make_square(-0.13, 0.13, 0.13, 0);
    OmSurface roi = make_sphere(om_vec3(-0.065, 0.02, 0), 0.009, 24);
    OmSurface organ = make_sphere(om_vec3(0.03, -0.075, 0), 0.028, 40);
    OmSurface held = make_square(-0.07, -0.05, 0.012, 0.001);
    for (int i = 0; i < 4; ++i) held.x[3 * i + 1] -= 0.03;
    add(scene, &sheet, OM_PART_TISSUE, of_id);
    add(scene, &board, OM_PART_BOARD, of_id);
    add(scene, &roi, OM_PART_ROI, of_id);
    add(scene, &organ, OM_PART_ORGAN, of_id);
    add(scene, &held, OM_PART_HELD, of_id);
    add_tool(scene, om_vec3(0.01 - height, 0.01, 0.01 + height), 0.5, of_id);
    assert_ok(om_sense_scene_commit(scene));
    OmVec3 eye = om_vec3(distance * cos(elevation) * cos(azimuth),
                         distance * cos(elevation) * sin(azimuth), distance * sin(elevation));
    OmPose pose = om_pose_look_at(eye, om_vec3(0, 0, 0.01), om_vec3(0, 0, 1));
    OmCamera c = {pose, W, H, 60 * OM_PI / 180, 0.01, 2};
    static float depth[W * H];
    static int id[W * H];
    OmPicture picture;
    assert_ok(om_picture_init(&picture, W, H, 3));
    OmSenseOptions options = om_sense_options_default();
    assert_ok(om_sense_render(scene, &c, &options, &picture));
    assert_ok(om_sense_depth(scene, &c, 1, depth, id, NULL));
    for (int i = 0; i < W * H; ++i) {
        OmSensePart is = id[i] >= 0 ? of_id[id[i]] : OM_NPART;
        OmSensePart seen = om_sense_part_of(&picture.pixel[3 * i]);
        ++count[is].all;
        count[is].right += seen == (is == OM_PART_SHAFT ? OM_PART_TOOL : is);
    }
    om_picture_done(&picture);
    om_sense_scene_destroy(scene);
}

static void parts_are_told_by_colour(void** state) {
    (void)state;
    static const char* const name[] = {"tissue", "organ", "ROI",   "held",
                                       "board",  "tool",  "shaft", "nothing"};
    Count total[OM_NPART + 1] = {{0}};
    for (int k = 0; k < 12; ++k) {
        Count count[OM_NPART + 1] = {{0}};
        count_pixels(0.012 * (k % 3), 0.3 + 2 * OM_PI * k / 12, (k % 4 ? 35 : 70) * OM_PI / 180,
                     k % 2 ? 0.15 : 0.24, count);
        for (int part = 0; part <= OM_NPART; ++part) {
            total[part].all += count[part].all;
            total[part].right += count[part].right;
            if (count[part].all < 1000) continue;  // almost hidden
            double share = count[part].right / (double)count[part].all;
            if (!(share >= 0.98)) fail_msg("pose %d, %s: %.4f of its pixels", k, name[part], share);
        }
    }
    for (int part = 0; part <= OM_NPART; ++part) {
        if (total[part].all < 1500)
            fail_msg("%s: %d pixels are too few", name[part], total[part].all);
        double share = total[part].right / (double)total[part].all;
        if (!(share >= 0.98)) fail_msg("%s: %.4f of its pixels", name[part], share);
        print_message("%s: %.4f of %d pixels\n", name[part], share, total[part].all);
    }
}

// No colour is in two ranges (a tool's parts share one), and om_sense_part_of names the range that a colour is in.
static void ranges_do_not_overlap(void** state) {
    (void)state;
    for (int i = 0; i < 52 * 52 * 52; ++i) {
        const unsigned char rgb[3] = {(unsigned char)(5 * (i % 52)),
                                      (unsigned char)(5 * (i / 52 % 52)),
                                      (unsigned char)(5 * (i / 2704))};
        double hsv[3];
        om_sense_hsv(rgb, hsv);
        // hues at a border, which rounding puts on either side
        if (hsv[1] > 0 && fabs(hsv[0] - 2 * round(hsv[0] / 2)) < 1e-9) continue;
        int n = 0;
        OmSensePart last = OM_NPART;
        for (int part = 0; part < OM_PART_SHAFT; ++part) {
            OmSenseRange r = om_sense_range(part);
            double hue = fmod(hsv[0] - r.hue_min + 360, 360);
            double width = r.hue_max - r.hue_min + (r.hue_max < r.hue_min ? 360 : 0);
            bool is_in = hue < width && hsv[1] >= r.saturation_min && hsv[2] >= r.value_min &&
                         (hsv[1] < r.saturation_max || r.saturation_max == 1) &&
                         hsv[2] <= r.value_max;
            if (is_in) last = part, ++n;
        }
        assert_true(n <= 1);
        assert_int_equal(om_sense_part_of(rgb), last);
    }
}

static void hsv_of_known_colours(void** state) {
    (void)state;
    static const unsigned char rgb[][3] = {{255, 0, 0},   {0, 255, 0},     {0, 0, 128},
                                           {255, 255, 0}, {200, 100, 150}, {7, 7, 7}};
    static const double want[][3] = {
        {0, 1, 1},        {120, 1, 1}, {240, 1, 128 / 255.0}, {60, 1, 1}, {330, 0.5, 200 / 255.0},
        {0, 0, 7 / 255.0}};
    for (int i = 0; i < 6; ++i) {
        double hsv[3];
        om_sense_hsv(rgb[i], hsv);
        for (int k = 0; k < 3; ++k) assert_near(hsv[k], want[i][k], 1e-12);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hsv_of_known_colours),
        cmocka_unit_test(ranges_do_not_overlap),
        cmocka_unit_test(parts_are_told_by_colour),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
