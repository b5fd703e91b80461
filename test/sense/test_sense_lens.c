// Lenses against formulas written here: projection, rays, folds; a checker under a known distortion; depth, noise and
// clouds of a distorted camera against those of an ideal one.
#include "sense_shapes.h"

// A wide endoscope at 320 x 240: 12 % of barrel distortion in the corners, a decentred lens.
static const OmLens barrel = {250, 247, 163.5, 117.25, -0.31, 0.12, 8e-4, -6e-4, -0.02};
static const OmLens cushion = {310, 310, 0, 0, 0.18, 0.05, -3e-4, 5e-4, 0.01};

static OmCamera with(OmLens lens, int width, int height) {
    OmCamera c = look_down(width, height);
    c.lens = lens;
    return c;
}

// OpenCV's formulas, term by term: docs "Camera Calibration and 3D Reconstruction".
static void project_here(const OmCamera* c, const OmLens* l, OmVec3 p, double* u, double* v) {
    OmVec3 q = om_pose_apply(om_pose_inverse(c->pose_world_camera), p);
    double x = q.x / q.z, y = q.y / q.z, r2 = x * x + y * y;
    double radial = 1 + l->k1 * r2 + l->k2 * pow(r2, 2) + l->k3 * pow(r2, 3);
    double dx = 2 * l->p1 * x * y + l->p2 * (r2 + 2 * x * x);
    double dy = l->p1 * (r2 + 2 * y * y) + 2 * l->p2 * x * y;
    *u = l->fx * (x * radial + dx) + l->cx;
    *v = l->fy * (y * radial + dy) + l->cy;
}

static void points_go_where_the_formulas_say(void** state) {
    (void)state;
    const OmLens lens[2] = {barrel, cushion};
    for (int k = 0; k < 2; ++k) {
        OmCamera c = with(lens[k], 320, 240);
        OmLens full = lens[k];
        if (k == 1) full.cx = 160, full.cy = 120;  // both 0: the middle
        assert_ok(om_camera_check(&c));
        assert_near(om_camera_lens(&c).cx, full.cx, 0);
        OmRng rng = om_rng_init(5, (uint64_t)k);
        int nseen = 0;
        for (int i = 0; i < 4000; ++i) {
            OmVec3 p = om_vec3(0.24 * om_rng_uniform(&rng) - 0.12, 0.2 * om_rng_uniform(&rng) - 0.1,
                               0.06 * om_rng_uniform(&rng));
            double u, v, eu, ev;
            project_here(&c, &full, p, &eu, &ev);
            if (eu < 0 || eu > 320 || ev < 0 || ev > 240) continue;
            if (!om_camera_project(&c, p, &u, &v)) continue;
            ++nseen;
            assert_near(u, eu, 1e-10);
            assert_near(v, ev, 1e-10);
        }
        assert_true(nseen > 1500);
    }
}

// Focal lengths of fov and a centre of one's own; and the other way round.
static void each_pair_has_its_default(void** state) {
    (void)state;
    OmCamera c = with((OmLens){.cx = 100.5, .cy = 90.25}, 320, 240);
    OmLens l = om_camera_lens(&c);
    assert_near(l.fx, 120 / tan(OM_PI / 6), 1e-12);
    assert_near(l.fy, l.fx, 0);
    double u, v;
    assert_true(om_camera_project(&c, om_vec3(0, 0, 0), &u, &v));
    assert_near(u, 100.5, 1e-12);
    assert_near(v, 90.25, 1e-12);
    c = with((OmLens){.fx = 400, .fy = 390}, 320, 240);
    c.fov = 0;  // not used
    assert_ok(om_camera_check(&c));
    assert_true(om_camera_project(&c, om_vec3(0.02, -0.02, 0), &u, &v));
    assert_near(u, 160 + 400 * 0.1, 1e-10);
    assert_near(v, 120 + 390 * 0.1, 1e-10);  // -y of the world is down in the picture
}

static void rays_invert_projections(void** state) {
    (void)state;
    const OmLens lens[3] = {barrel, cushion, {.fx = 280, .fy = 300, .cx = 150, .cy = 130}};
    for (int k = 0; k < 3; ++k) {
        OmCamera c = with(lens[k], 320, 240);
        assert_ok(om_camera_check(&c));
        for (int j = 0; j <= 240; j += 3)
            for (int i = 0; i <= 320; i += 4) {  // with the corners
                OmVec3 ray = om_camera_ray(&c, i, j);
                assert_near(om_norm(ray), 1, 1e-14);
                OmVec3 p = om_madd(c.pose_world_camera.p, 0.13, ray);
                double u, v, eu, ev;
                assert_true(om_camera_project(&c, p, &u, &v));
                assert_near(u, i, 1e-9);
                assert_near(v, j, 1e-9);
                OmLens full = om_camera_lens(&c);
                project_here(&c, &full, p, &eu, &ev);
                assert_near(eu, i, 1e-9);
                assert_near(ev, j, 1e-9);
            }
    }
}

// x (1 - 0.4 x^2) has its largest value at x = sqrt(1 / 1.2) = 0.9129, where it is 0.6086: no ray goes beyond.
static void outside_of_its_domain_a_lens_has_no_ray(void** state) {
    (void)state;
    OmCamera c = with((OmLens){.fx = 100, .fy = 100, .k1 = -0.4}, 320, 240);
    double fold = sqrt(1 / 1.2), limit = fold * (1 - 0.4 * fold * fold), u, v;
    OmPose at = c.pose_world_camera;
    assert_true(om_camera_project(&c, om_pose_apply(at, om_vec3(fold - 1e-9, 0, 1)), &u, &v));
    assert_near(u, 160 + 100 * limit, 1e-9);
    assert_false(om_camera_project(&c, om_pose_apply(at, om_vec3(fold + 1e-9, 0, 1)), &u, &v));
    assert_false(om_camera_project(&c, om_pose_apply(at, om_vec3(50, 0, 1)), &u, &v));
    assert_near(om_norm(om_camera_ray(&c, 160 + 100 * (limit - 1e-9), 120)), 1, 1e-12);
    assert_near(om_norm(om_camera_ray(&c, 160 + 100 * (limit + 1e-6), 120)), 0, 0);
    assert_near(om_norm(om_camera_ray(&c, 1e9, -1e9)), 0, 0);
    // A tangential term alone: along -x the slope is 1 - 6 p2 x, 0 at x = -1 / (6 p2).
    c.lens = (OmLens){.fx = 100, .fy = 100, .p2 = 0.2};
    double x = -1 / 1.2;
    assert_true(om_camera_project(&c, om_pose_apply(at, om_vec3(x + 1e-9, 0, 1)), &u, &v));
    assert_near(u, 160 + 100 * (x + 0.6 * x * x), 1e-6);
    assert_false(om_camera_project(&c, om_pose_apply(at, om_vec3(x - 1e-9, 0, 1)), &u, &v));
}

static void assert_refused(OmLens lens, const char* words) {
    OmCamera c = with(lens, 320, 240);
    float depth[1];
    assert_status(om_camera_check(&c), OM_INVALID);
    if (!strstr(om_error_message(), words)) fail_msg("%s: %s", words, om_error_message());
    assert_status(om_sense_depth(NULL, &c, 1, depth, NULL, NULL), OM_INVALID);
}

static void bad_lenses_are_refused(void** state) {
    (void)state;
    assert_refused((OmLens){.fx = -200, .fy = 200}, "lens.fx -200");
    assert_refused((OmLens){.fx = 200}, "lens.fy 0");
    assert_refused((OmLens){.fx = NAN, .fy = 200}, "lens.fx is");
    assert_refused((OmLens){.k3 = INFINITY}, "lens.k3 is");
    assert_refused((OmLens){.cx = 321, .cy = 3}, "lens.cx 321");
    assert_refused((OmLens){.cx = 32, .cy = -3}, "lens.cy -3");
    assert_refused((OmLens){.fx = 100, .fy = 100, .k1 = -0.4}, "folds the picture");
    assert_refused((OmLens){.fx = 60, .fy = 60, .k2 = -0.1}, "folds the picture");
    assert_refused((OmLens){.fx = 100, .fy = 100, .p1 = 0.2}, "folds the picture");
    OmCamera c = with((OmLens){.fx = 400, .fy = 400, .k1 = -0.4}, 320, 240);
    assert_ok(om_camera_check(&c));  // narrower: the corner is before the fold
}

// A lens that says what the pinhole has gives the same bits; and a camera of another size the same view.
static void lens_and_pinhole_agree(void** state) {
    (void)state;
    OmCamera c = look_down(96, 72), other = c;
    other.lens = om_camera_lens(&c);
    for (int i = 0; i < 96 * 72; ++i) {
        OmVec3 a = om_camera_ray(&c, i % 96 + 0.5, i / 96 + 0.5),
               b = om_camera_ray(&other, i % 96 + 0.5, i / 96 + 0.5);
        assert_memory_equal(&a, &b, sizeof a);
    }
    OmCamera from = with(barrel, 320, 240), to = om_camera_resize(&from, 640, 480);
    assert_int_equal(to.width, 640);
    double u, v, U, V;
    assert_true(om_camera_project(&from, om_vec3(0.03, 0.02, 0.01), &u, &v));
    assert_true(om_camera_project(&to, om_vec3(0.03, 0.02, 0.01), &U, &V));
    assert_near(U, 2 * u, 1e-10);
    assert_near(V, 2 * v, 1e-10);
    to = om_camera_resize(&from, 400, 240);  // wider: 40 pixels more at each side
    assert_true(om_camera_project(&to, om_vec3(0.03, 0.02, 0.01), &U, &V));
    assert_near(U, u + 40, 1e-10);
    assert_near(V, v, 1e-10);
    to = om_camera_resize(&c, 960, 720);
    assert_memory_equal(&to.lens, &(OmLens){0}, sizeof to.lens);
}

// ---- pictures -----------------------------------------------------------------------------------------------------

enum { W = 320, H = 240 };

typedef struct Board {
    OmSenseScene* scene;
    OmSurface square;
    int id;
} Board;

static Board make_board(OmSenseLook look) {
    Board b;
    b.square = make_square(-0.6, 0.6, 0.6, 0.02);
    assert_ok(om_sense_scene_create(&b.scene));
    assert_ok(om_sense_scene_add(b.scene, &b.square, &look, &b.id));
    assert_ok(om_sense_scene_commit(b.scene));
    return b;
}

static void board_done(Board* b) {
    om_surface_done(&b->square);
    om_sense_scene_destroy(b->scene);
}

// The two shades of the checker meet where x or y of the board is a multiple of 10 mm. In every row and column of the
// picture, edges of brightness lie where the formulas put them.
static void a_checker_bends(void** state) {
    (void)state;
    OmSenseLook look = {.red = 0.6, .green = 0.6, .blue = 0.6, .is_checker = true};
    Board b = make_board(look);
    OmCamera c = with(barrel, W, H);
    OmPicture picture;
    OmSenseOptions options = om_sense_options_default();
    options.has_shadow = false;
    assert_ok(om_picture_init(&picture, W, H, 3));
    assert_ok(om_sense_render(b.scene, &c, &options, &picture));
    OmLens full = om_camera_lens(&c);
    int nedge = 0, nwrong = 0;
    for (int line = -8; line <= 8; ++line)
        for (int k = -60; k <= 60;
             ++k) {  // points of the line x = line x 10 mm, between lines of y
            if (abs(k) % 10 < 3 || abs(k) % 10 > 7) continue;
            double u, v;
            project_here(&c, &full, om_vec3(0.01 * line, 1e-3 * k, 0.02), &u, &v);
            int row = (int)floor(v);
            if (row < 2 || row >= H - 2 || u < 4 || u >= W - 4) continue;
            // the brightness jumps within a pixel of u, not three pixels off
            const unsigned char* p = &picture.pixel[3 * (row * W)];
            int i = (int)floor(u - 0.5);  // centres i + 0.5 <= u < i + 1.5
            int across = abs((int)p[3 * (i + 2)] - (int)p[3 * (i - 1)]);
            int left = abs((int)p[3 * (i - 1)] - (int)p[3 * (i - 3)]);
            int right = abs((int)p[3 * (i + 4)] - (int)p[3 * (i + 2)]);
            ++nedge;
            nwrong += !(across > 8 && left < across / 2 && right < across / 2);
        }
    assert_true(nedge > 300);
    assert_int_equal(nwrong, 0);
    om_picture_done(&picture);
    board_done(&b);
}

// A plane has the same depth for both, and its cloud lies on it where the formulas say.
static void depth_of_a_plane_ignores_the_lens(void** state) {
    (void)state;
    static float depth[W * H], ideal[W * H], normal[3 * W * H];
    static double x[3 * W * H], n[3 * W * H];
    Board b = make_board(grey);
    OmCamera c = with(barrel, W, H), pinhole = look_down(W, H);
    assert_ok(om_sense_depth(b.scene, &c, 2, depth, NULL, normal));
    assert_ok(om_sense_depth(b.scene, &pinhole, 2, ideal, NULL, NULL));
    for (int i = 0; i < W * H; ++i) assert_near((double)depth[i], (double)ideal[i], 1e-6);
    assert_int_equal(om_depth_to_cloud(&c, depth, NULL, normal, -1, x, n), W * H);
    OmLens full = om_camera_lens(&c);
    for (int i = 0; i < W * H; ++i) {
        double u, v;
        assert_near(x[3 * i + 2], 0.02, 1e-6);
        project_here(&c, &full, om_load3(x, i), &u, &v);
        assert_near(u, i % W + 0.5, 1e-8);
        assert_near(v, i / W + 0.5, 1e-8);
    }
    board_done(&b);
}

// Grazing pixels are judged by the ray of the lens: normals at a cosine of 0.2 and of 0.1 to it, the limit between.
static void noise_follows_the_rays(void** state) {
    (void)state;
    static float depth[W * H], normal[3 * W * H];
    OmCamera c = with(barrel, W, H);
    OmDepthNoise noise = om_depth_noise_default(5);
    noise.dropout = 0;
    noise.min_grazing = 0.15;
    for (int tilt = 0; tilt < 2; ++tilt) {
        double cosine = tilt ? 0.1499 : 0.1501;
        for (int i = 0; i < W * H; ++i) {
            depth[i] = 0.2f;
            OmVec3 d = om_camera_ray(&c, i % W + 0.5, i / W + 0.5);
            OmVec3 side = om_normalize(om_cross(d, om_vec3(0, 1, 0)));
            OmVec3 q = om_madd(om_scale(-cosine, d), sqrt(1 - cosine * cosine), side);
            for (int k = 0; k < 3; ++k)
                normal[3 * i + k] = (float)(k == 0 ? q.x : k == 1 ? q.y : q.z);
        }
        om_depth_add_noise(&noise, &c, 0, normal, depth);
        for (int i = 0; i < W * H; ++i) assert_int_equal(depth[i] > 0, !tilt);
    }
}

// A point that an ideal camera of the same focal length puts outside, and barrel distortion brings into the picture.
static void visibility_follows_the_lens(void** state) {
    (void)state;
    Board b = make_board(grey);
    OmCamera c = with((OmLens){.fx = 400, .fy = 400, .k1 = -0.4}, W, H), pinhole = c;
    pinhole.lens.k1 = 0;
    // x = 0.42: 160 + 400 x = 328 without, 160 + 400 x (1 - 0.4 x^2) = 316 with distortion
    const double x[3] = {0.42 * 0.18, 0, 0.02}, n[3] = {0, 0, 1};
    OmVisibility v;
    assert_ok(om_sense_count_visible(b.scene, &c, x, n, 1, 1, &v));
    assert_int_equal(v.nseen, 1);
    assert_ok(om_sense_count_visible(b.scene, &pinhole, x, n, 1, 1, &v));
    assert_int_equal(v.noutside, 1);
    board_done(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_go_where_the_formulas_say),
        cmocka_unit_test(each_pair_has_its_default),
        cmocka_unit_test(rays_invert_projections),
        cmocka_unit_test(outside_of_its_domain_a_lens_has_no_ray),
        cmocka_unit_test(bad_lenses_are_refused),
        cmocka_unit_test(lens_and_pinhole_agree),
        cmocka_unit_test(a_checker_bends),
        cmocka_unit_test(depth_of_a_plane_ignores_the_lens),
        cmocka_unit_test(noise_follows_the_rays),
        cmocka_unit_test(visibility_follows_the_lens),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
