// Cameras against geometry: projections, depth of planes and spheres, half-hidden discs, noise.
#include <time.h>

#include "sense_shapes.h"

static void projection_and_rays_agree(void** state) {
    (void)state;
    OmCamera c = look_down(320, 240);
    double u, v;
    assert_true(om_camera_project(&c, om_vec3(0, 0, 0), &u, &v));
    assert_near(u, 160, 1e-10);
    assert_near(v, 120, 1e-10);
    // The picture's half height is distance x tan(30 degrees); +y of the world is up in it.
    assert_true(om_camera_project(&c, om_vec3(0, 0.2 * tan(OM_PI / 6), 0), &u, &v));
    assert_near(v, 0, 1e-10);
    assert_true(om_camera_project(&c, om_vec3(0.03, 0, 0), &u, &v));
    assert_true(u > 160);
    assert_false(om_camera_project(&c, om_vec3(0, 0, 0.3), &u, &v));
    OmVec3 p = om_madd(c.pose_world_camera.p, 0.17, om_camera_ray(&c, 33.3, 200.1));
    assert_true(om_camera_project(&c, p, &u, &v));
    assert_near(u, 33.3, 1e-9);
    assert_near(v, 200.1, 1e-9);
}

static void depth_is_exact(void** state) {
    (void)state;
    OmSenseScene* scene;
    int plane, ball;
    assert_ok(om_sense_scene_create(&scene));
    OmSurface square = make_square(-1, 1, 1, 0),
              sphere = make_sphere(om_vec3(0, 0, 0.05), 0.03, 160);
    assert_ok(om_sense_scene_add(scene, &square, &grey, &plane));
    assert_ok(om_sense_scene_add(scene, &sphere, &grey, &ball));
    assert_ok(om_sense_scene_commit(scene));
    OmCamera c = look_down(64, 48);
    float depth[64 * 48], normal[3 * 64 * 48];
    int id[64 * 48];
    assert_ok(om_sense_depth(scene, &c, 2, depth, id, normal));
    int nball = 0;
    for (int i = 0; i < 64 * 48; ++i) {
        OmVec3 d = om_camera_ray(&c, i % 64 + 0.5, i / 64 + 0.5);
        if (id[i] == plane) {
            assert_near((double)depth[i], 0.2, 1e-6);  // float
            assert_near((double)normal[3 * i + 2], 1, 1e-6);
        } else {
            // Ray and sphere; the mesh lies inside it by r (angle / 2)^2 / 2 at most.
            OmVec3 o = om_sub(c.pose_world_camera.p, om_vec3(0, 0, 0.05));
            double b = om_dot(o, d), disc = b * b - om_norm2(o) + 0.03 * 0.03;
            if (disc < 2e-5) continue;  // grazing: any small error of shape is a large one of depth
            double z = (-b - sqrt(disc)) * -d.z;
            assert_near((double)depth[i], z, 2e-5);
            ++nball;
        }
    }
    assert_true(nball > 50);
    om_sense_scene_show(scene, ball, false);
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(om_sense_depth(scene, &c, 2, depth, id, NULL));
    for (int i = 0; i < 64 * 48; ++i) assert_int_equal(id[i], plane);
    om_surface_done(&square);
    om_surface_done(&sphere);
    om_sense_scene_destroy(scene);
}

static void a_half_hidden_disc_is_half_visible(void** state) {
    (void)state;
    enum { N = 4000 };
    static double x[3 * N], n[3 * N];
    for (int i = 0; i < N; ++i) {
        double r = 0.01 * sqrt((i + 0.5) / N), a = i * OM_PI * (3 - sqrt(5.0));
        om_store3(x, i, om_vec3(r * cos(a), r * sin(a), 0));
        om_store3(n, i, om_vec3(0, 0, 1));
    }
    OmSenseScene* scene;
    int id;
    assert_ok(om_sense_scene_create(&scene));
    OmSurface lid = make_square(0, 0.05, 0.05, 1e-4);  // over x > 0, just above the disc
    assert_ok(om_sense_scene_add(scene, &lid, &grey, &id));
    assert_ok(om_sense_scene_commit(scene));
    OmCamera c = look_down(64, 48);
    double share;
    assert_ok(om_sense_visibility(scene, &c, x, n, N, 0, &share));
    assert_near(share, 0.5,
                0.02);  // the lid's height moves the edge by 5 micrometres, sampling by 1 %
    assert_ok(om_sense_visibility(scene, &c, x, n, N, (uint64_t)1 << id, &share));
    assert_near(share, 1, 0);
    // Seen from below nothing faces the camera.
    for (int i = 0; i < N; ++i) om_store3(n, i, om_vec3(0, 0, -1));
    assert_ok(om_sense_visibility(scene, &c, x, n, N, 0, &share));
    assert_near(share, 0, 0);
    // Moved away, the lid hides nothing.
    for (int i = 0; i < N; ++i) om_store3(n, i, om_vec3(0, 0, 1));
    for (int i = 0; i < 4; ++i) lid.x[3 * i] += 0.1;
    om_sense_scene_update(scene, id, lid.x, NULL);
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(om_sense_visibility(scene, &c, x, n, N, 0, &share));
    assert_near(share, 1, 0);
    om_surface_done(&lid);
    om_sense_scene_destroy(scene);
}

// Points that face away or lie outside the picture are not seen, and count: the share is of all points.
static void every_point_counts(void** state) {
    (void)state;
    enum { N = 4000 };
    static double x[3 * N], n[3 * N];
    OmCamera c = look_down(64, 48);
    double edge = 0.2 * tan(OM_PI / 6) * 64 / 48;  // the picture's right border on the plane z = 0
    for (int i = 0; i < N; ++i) {
        double r = 0.01 * sqrt((i + 0.5) / N), a = i * OM_PI * (3 - sqrt(5.0));
        om_store3(x, i, om_vec3(edge + r * cos(a), r * sin(a), 0));
        om_store3(n, i, om_vec3(0, 0, 1));
    }
    OmSenseScene* scene;
    OmVisibility v;
    double share;
    assert_ok(om_sense_scene_create(&scene));
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(om_sense_visibility(scene, &c, x, n, N, 0, &share));
    assert_near(share, 0.5, 0.01);  // half of the disc lies beyond the border; sampling
    for (int i = 0; i < N; i += 4) om_store3(n, i, om_vec3(0, 0, -1));
    assert_ok(om_sense_count_visible(scene, &c, x, n, N, 0, &v));
    assert_int_equal(v.npoint, N);
    assert_int_equal(v.naway, N / 4);
    assert_int_equal(v.nhidden, 0);
    assert_int_equal(v.nseen + v.naway + v.noutside, N);
    assert_ok(om_sense_visibility(scene, &c, x, n, N, 0, &share));
    assert_near(share, 0.375, 0.01);
    om_sense_scene_destroy(scene);
}

static void noise_has_the_stated_spread(void** state) {
    (void)state;
    enum { W = 200, H = 200 };
    static float depth[W * H];
    OmCamera c = look_down(W, H);
    OmDepthNoise noise = om_depth_noise_default(3);
    for (int i = 0; i < W * H; ++i) depth[i] = 0.5f;
    om_depth_add_noise(&noise, &c, 7, NULL, depth);
    double sum = 0, sum2 = 0;
    int n = 0;
    for (int i = 0; i < W * H; ++i) {
        if (depth[i] == 0.0f) continue;
        double e = (double)depth[i] - 0.5;
        sum += e, sum2 += e * e, ++n;
    }
    double sigma = noise.a + noise.b * 0.25;
    assert_near(sqrt(sum2 / n), sigma, 0.02 * sigma);  // 40,000 samples: 0.4 % standard error
    assert_near(sum / n, 0, 5 * sigma / 200);
    assert_near(1 - n / (double)(W * H), noise.dropout, 0.002);
    static float again[W * H];
    for (int i = 0; i < W * H; ++i) again[i] = 0.5f;
    om_depth_add_noise(&noise, &c, 7, NULL, again);
    assert_memory_equal(depth, again, sizeof depth);
    om_depth_add_noise(&noise, &c, 8, NULL, again);
    assert_memory_not_equal(depth, again, sizeof depth);
}

static void pictures_do_not_depend_on_workers(void** state) {
    (void)state;
    OmSenseScene* scene;
    int id;
    OmSurface sphere = make_sphere(om_vec3(0, 0, 0.05), 0.03, 30),
              square = make_square(-1, 1, 1, 0);
    assert_ok(om_sense_scene_create(&scene));
    OmSenseLook smooth = {.red = 0.9,
                          .green = 0.6,
                          .blue = 0.3,
                          .gloss = 0.5,
                          .is_smooth = true,
                          .texture = OM_TEXTURE_ORGAN};
    assert_ok(om_sense_scene_add(scene, &sphere, &smooth, &id));
    assert_ok(om_sense_scene_add(scene, &square, &grey, &id));
    assert_ok(om_sense_scene_commit(scene));
    OmCamera c = look_down(93, 61);
    OmPicture one, many;
    assert_ok(om_picture_init(&one, 93, 61, 3));
    assert_ok(om_picture_init(&many, 93, 61, 3));
    OmSenseOptions options = om_sense_options_default();
    options.samples = 2;
    options.nworker = 1;
    assert_ok(om_sense_render(scene, &c, &options, &one));
    options.nworker = 4;
    assert_ok(om_sense_render(scene, &c, &options, &many));
    assert_memory_equal(one.pixel, many.pixel, 93 * 61 * 3);
    // A window has the pixels of the whole picture; where it lies outside there is none.
    options.window = om_window_clip((OmWindow){56, -4, 90, 31}, 93, 61);
    assert_true(options.window.width == 37 && options.window.row == 0 &&
                options.window.height == 27);
    OmPicture part;
    assert_ok(om_picture_init(&part, 37, 27, 3));
    assert_ok(om_sense_render(scene, &c, &options, &part));
    for (int row = 0; row < 27; ++row)
        assert_memory_equal(&part.pixel[3 * row * 37], &one.pixel[3 * (row * 93 + 56)], 3 * 37);
    assert_int_equal(om_window_clip((OmWindow){93, 0, 5, 5}, 93, 61).width, 0);
    assert_int_equal(om_window_clip((OmWindow){-5, 0, 5, 5}, 93, 61).width, 0);
    assert_int_equal(om_window_clip((OmWindow){0}, 93, 61).height, 61);
    options.window.width = 38;
    assert_status(om_sense_render(scene, &c, &options, &part), OM_INVALID);
    options.window = (OmWindow){0};
    om_picture_done(&part);
    // The ball, lit from the camera, is brighter in its middle than the shadowed ground at the corner.
    int middle = 3 * (30 * 93 + 46);
    assert_true(one.pixel[middle] > one.pixel[0] + 20);
    assert_status(om_sense_render(scene, &c, &options, &(OmPicture){.width = 5}), OM_INVALID);
    om_picture_done(&one);
    om_picture_done(&many);
    om_surface_done(&sphere);
    om_surface_done(&square);
    om_sense_scene_destroy(scene);
}

typedef struct Asks {
    clock_t last;    // when om_stop_poll asked
    double longest;  // s, of processor time from one question to the next
} Asks;

static bool note_ask(void* ctx) {
    Asks* a = ctx;
    const clock_t now = clock();
    a->longest = fmax(a->longest, (double)(now - a->last) / CLOCKS_PER_SEC);
    a->last = now;
    return false;
}

// A row of 131 thousand rays takes milliseconds: a request to stop is noticed after one row or the period,
// not after the eight rows of a block of a small picture.
static void a_large_picture_can_be_stopped(void** state) {
    (void)state;
    enum { SIDE = 8192, NROW = 16 };
    OmSenseScene* scene;
    int id;
    assert_ok(om_sense_scene_create(&scene));
    OmSurface square = make_square(-1, 1, 1, 0);
    assert_ok(om_sense_scene_add(scene, &square, &grey, &id));
    assert_ok(om_sense_scene_commit(scene));
    OmCamera c = look_down(SIDE, SIDE);
    OmPicture picture;
    assert_ok(om_picture_init(&picture, SIDE, NROW, 3));
    OmSenseOptions options = om_sense_options_default();
    options.samples = 4;
    options.nworker = 1;
    options.window = (OmWindow){0, SIDE / 2, SIDE, NROW};
    const clock_t start = clock();
    Asks asks = {.last = start};
    om_stop_set(note_ask, &asks);
    assert_ok(om_sense_render(scene, &c, &options, &picture));
    om_stop_set(NULL, NULL);
    const double row = (double)(clock() - start) / CLOCKS_PER_SEC / NROW;
    assert_below(asks.longest, OM_STOP_PERIOD + 3 * row);
    om_picture_done(&picture);
    om_surface_done(&square);
    om_sense_scene_destroy(scene);
}

static void bad_surfaces_are_refused(void** state) {
    (void)state;
    OmSenseScene* scene;
    int id;
    assert_ok(om_sense_scene_create(&scene));
    OmSurface s = make_square(0, 1, 1, 0);
    s.tri_vert[4] = 9;
    assert_status(om_sense_scene_add(scene, &s, &grey, &id), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertex 9 of 4"));
    s.tri_vert[4] = 2;
    s.x[5] = NAN;
    assert_status(om_sense_scene_add(scene, &s, &grey, &id), OM_INVALID);
    om_surface_done(&s);
    om_sense_scene_destroy(scene);
}

static void clouds_lie_on_the_surface(void** state) {
    (void)state;
    OmSenseScene* scene;
    int id;
    OmSurface square = make_square(-1, 1, 1, 0.01);
    assert_ok(om_sense_scene_create(&scene));
    assert_ok(om_sense_scene_add(scene, &square, &grey, &id));
    assert_ok(om_sense_scene_commit(scene));
    OmCamera c = look_down(32, 24);
    float depth[32 * 24], normal[3 * 32 * 24];
    int ids[32 * 24];
    double x[3 * 32 * 24], n[3 * 32 * 24];
    assert_ok(om_sense_depth(scene, &c, 1, depth, ids, normal));
    assert_int_equal(om_depth_to_cloud(&c, depth, ids, normal, id, x, n), 32 * 24);
    for (int i = 0; i < 32 * 24; ++i) assert_near(x[3 * i + 2], 0.01, 1e-6);
    assert_int_equal(om_depth_to_cloud(&c, depth, ids, normal, id + 1, x, n), 0);
    const float none[] = {0, -0.1F, NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 5; ++i) depth[7 * i] = none[i];
    assert_int_equal(om_depth_to_cloud(&c, depth, ids, normal, id, x, n), 32 * 24 - 5);
    for (int i = 0; i < 32 * 24 - 5; ++i) assert_near(x[3 * i + 2], 0.01, 1e-6);
    om_surface_done(&square);
    om_sense_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(projection_and_rays_agree),
        cmocka_unit_test(depth_is_exact),
        cmocka_unit_test(a_half_hidden_disc_is_half_visible),
        cmocka_unit_test(every_point_counts),
        cmocka_unit_test(noise_has_the_stated_spread),
        cmocka_unit_test(pictures_do_not_depend_on_workers),
        cmocka_unit_test(a_large_picture_can_be_stopped),
        cmocka_unit_test(bad_surfaces_are_refused),
        cmocka_unit_test(clouds_lie_on_the_surface),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
