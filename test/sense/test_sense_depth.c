// Depth cameras and visibility against geometry: normals of a sphere, noise by range, areas behind a strip, a
// real tool; the same bytes for any number of workers; refused memory.
#include "omentum/robot.h"
#include "omentum/shape_closest.h"
#include "sense_shapes.h"
#include "test_alloc.h"

enum { W = 96, H = 72 };

typedef struct Frame {
    float depth[W * H], normal[3 * W * H];
    int id[W * H];
} Frame;

static void normals_of_a_sphere(void** state) {
    (void)state;
    static Frame f;
    static double x[3 * W * H], n[3 * W * H];
    const OmVec3 centre = {0, 0, 0.05};
    const double r = 0.03;
    for (int k = 0; k < 4; ++k) {
        const int nring = k < 2 ? 60 : 30, is_smooth = k % 2;
        const double cell = OM_PI / (nring - 1);  // angle between rings, and at most of meridians
        OmSenseScene* scene;
        int id;
        OmSurface sphere = make_sphere(centre, r, nring);
        OmSenseLook look = {.red = 1, .is_smooth = is_smooth};
        assert_ok(om_sense_scene_create(&scene));
        assert_ok(om_sense_scene_add(scene, &sphere, &look, &id));
        assert_ok(om_sense_scene_commit(scene));
        OmCamera c = look_down(W, H);
        assert_ok(om_sense_depth(scene, &c, 2, f.depth, f.id, f.normal));
        int count = om_depth_to_cloud(&c, f.depth, f.id, f.normal, id, x, n);
        assert_true(count > 400);
        for (int i = 0; i < count; ++i) {
            OmVec3 out = om_sub(om_load3(x, i), centre), normal = om_load3(n, i);
            // a chord lies within r (1 - cos(half its angle)) of its arc; a triangle's diagonal is sqrt(2) cells
            assert_near(om_norm(out), r, r * cell * cell / 4 + 1e-7);
            assert_near(om_norm(normal), 1, 1e-6);  // float
            // Flat: the normal is that of a point within the triangle. Smooth: second order in the cell,
            // but towards the pole, where triangles shrink from ring to ring.
            if (is_smooth && om_normalize(out).z > cos(0.4)) continue;
            double angle = om_distance(om_normalize(out), normal);
            assert_below(angle, is_smooth ? 0.5 * cell * cell : 0.75 * cell);
        }
        om_surface_done(&sphere);
        om_sense_scene_destroy(scene);
    }
}

static void pixels_name_their_triangle(void** state) {
    (void)state;
    static float depth[W * H], again[W * H];
    static int id[W * H], tri[W * H];
    OmSenseScene* scene;
    int first, second, count[2] = {0};
    OmSurface near = make_sphere(om_vec3(0.01, 0, 0.06), 0.015, 20),
              far = make_sphere(om_vec3(0, 0, 0.03), 0.03, 30);
    const OmSurface* of[2] = {&near, &far};
    OmSenseLook look = {.red = 1};
    assert_ok(om_sense_scene_create(&scene));
    assert_ok(om_sense_scene_add(scene, &near, &look, &first));
    assert_ok(om_sense_scene_add(scene, &far, &look, &second));
    assert_ok(om_sense_scene_commit(scene));
    OmCamera c = look_down(W, H);
    assert_ok(om_sense_triangles(scene, &c, 2, depth, id, tri));
    assert_ok(om_sense_depth(scene, &c, 1, again, NULL, NULL));
    assert_memory_equal(depth, again, sizeof depth);
    for (int i = 0; i < W * H; ++i) {
        if (id[i] < 0) assert_int_equal(tri[i], -1);
        if (id[i] < 0) continue;
        const OmSurface* s = of[id[i]];
        const int* v = &s->tri_vert[3 * tri[i]];
        OmVec3 ray = om_camera_ray(&c, i % W + 0.5, i / W + 0.5);
        OmVec3 axis = om_quat_rotate(c.pose_world_camera.q, om_vec3(0, 0, 1));
        OmVec3 p = om_madd(c.pose_world_camera.p, (double)depth[i] / om_dot(ray, axis), ray);
        OmVec3 q = om_triangle_closest(p, om_load3(s->x, v[0]), om_load3(s->x, v[1]),
                                       om_load3(s->x, v[2]), NULL);
        assert_below(om_distance(q, p), 1e-6);  // float rays
        ++count[id[i]];
    }
    assert_true(count[first] > 50 && count[second] > 50);
    om_surface_done(&near);
    om_surface_done(&far);
    om_sense_scene_destroy(scene);
}

static void noise_grows_with_range(void** state) {
    (void)state;
    static float depth[200 * 200];
    OmCamera c = look_down(200, 200);
    OmDepthNoise noise = om_depth_noise_default(11);
    noise.dropout = 0;
    const double range[] = {0.1, 0.2, 0.4, 0.8};
    double last = 0;
    for (int k = 0; k < 4; ++k) {
        const int n = 200 * 200;
        for (int i = 0; i < n; ++i) depth[i] = (float)range[k];
        om_depth_add_noise(&noise, &c, (uint64_t)k, NULL, depth);
        double sigma = noise.a + noise.b * range[k] * range[k], sum2 = 0, sum4 = 0;
        int within = 0;
        for (int i = 0; i < n; ++i) {
            double e = ((double)depth[i] - range[k]) / sigma;
            sum2 += e * e, sum4 += e * e * e * e, within += fabs(e) < 1;
        }
        // Standard errors with 40,000 samples: 0.35 % of sigma, 0.05 of the kurtosis, 0.23 % of the share.
        assert_near(sqrt(sum2 / n), 1, 0.0175);
        assert_near(sum4 / n / (sum2 / n) / (sum2 / n), 3, 0.25);
        assert_near(within / (double)n, erf(sqrt(0.5)), 0.0115);
        assert_true(sigma > last);
        last = sigma;
    }
}

static void grazing_and_lost_pixels_give_no_depth(void** state) {
    (void)state;
    static float depth[W * H], normal[3 * W * H];
    OmCamera c = look_down(W, H);
    OmDepthNoise noise = om_depth_noise_default(5);
    noise.dropout = 0;
    noise.min_grazing = 0.15;
    for (int tilt = 0; tilt < 2; ++tilt) {  // seen at a cosine of 0.2, then of 0.1, in the middle
        double cosine = tilt ? 0.1 : 0.2;
        for (int i = 0; i < W * H; ++i) {
            depth[i] = 0.2f;
            OmVec3 d = om_camera_ray(&c, i % W + 0.5, i / W + 0.5);
            OmVec3 side = om_normalize(om_cross(d, om_vec3(0, 1, 0)));
            OmVec3 n = om_madd(om_scale(-cosine, d), sqrt(1 - cosine * cosine), side);
            normal[3 * i] = (float)n.x, normal[3 * i + 1] = (float)n.y,
                       normal[3 * i + 2] = (float)n.z;
        }
        om_depth_add_noise(&noise, &c, 0, normal, depth);
        for (int i = 0; i < W * H; ++i) assert_int_equal(depth[i] > 0, !tilt);
    }
    noise.dropout = 1;
    for (int i = 0; i < W * H; ++i) depth[i] = 0.2f;
    om_depth_add_noise(&noise, &c, 0, NULL, depth);
    for (int i = 0; i < W * H; ++i) assert_true(depth[i] == 0.0f);
}

// Pictures of one scene have noise of their own each; the same picture again has the same noise.
static void noise_is_new_in_every_frame(void** state) {
    (void)state;
    static float first[W * H], other[W * H], again[W * H];
    OmCamera c = look_down(W, H);
    OmDepthNoise noise = om_depth_noise_default(11);
    noise.dropout = 0;
    for (int i = 0; i < W * H; ++i) first[i] = other[i] = again[i] = 0.2f;
    om_depth_add_noise(&noise, &c, 4, NULL, first);
    om_depth_add_noise(&noise, &c, 5, NULL, other);
    om_depth_add_noise(&noise, &c, 4, NULL, again);
    assert_memory_equal(first, again, sizeof first);
    double sigma = noise.a + noise.b * 0.2 * 0.2, product = 0;
    for (int i = 0; i < W * H; ++i)
        product += ((double)first[i] - 0.2) * ((double)other[i] - 0.2) / (sigma * sigma);
    assert_near(product / (W * H), 0, 4 / sqrt(W * H));  // four standard errors
}

// A pixel's noise is the first three numbers of its stream, drawn one pixel at a time here.
static void noise_is_that_of_single_streams(void** state) {
    (void)state;
    static float depth[W * H];
    OmCamera c = look_down(W - 3, H);  // rows that eight does not divide
    OmDepthNoise noise = om_depth_noise_default(0x123456789abcdefull);
    const int n = (W - 3) * H;
    for (int i = 0; i < n; ++i) depth[i] = 0.2f;
    om_depth_add_noise(&noise, &c, 63, NULL, depth);
    double sigma = noise.a + noise.b * 0.2 * 0.2;
    for (int i = 0; i < n; ++i) {
        OmRng rng = om_rng_init(noise.seed, (uint64_t)63 << 26 | (uint64_t)i);
        bool is_lost = om_rng_u32(&rng) * 0x1p-32 < noise.dropout;
        double u = (om_rng_u32(&rng) + 1.0) * 0x1p-32, v = om_rng_u32(&rng) * 0x1p-32;
        double want = 0.2 + sigma * sqrt(-2 * log(u)) * cos(2 * OM_PI * v);
        assert_near((double)depth[i], is_lost ? 0 : want, 3e-8);  // float
    }
}

static OmSenseScene* make_scene(int* disc, int* tool, OmSurface* tool_surface) {
    OmSenseScene* scene;
    assert_ok(om_sense_scene_create(&scene));
    enum { N = 256 };
    OmSurface s;
    assert_ok(om_surface_init(&s, N + 1, N));
    om_store3(s.x, N, om_vec3(0, 0, 0));
    for (int i = 0; i < N; ++i) {
        double a = 2 * OM_PI * i / N;
        om_store3(s.x, i, om_vec3(0.02 * cos(a), 0.02 * sin(a), 0));
        memcpy(&s.tri_vert[3 * i], (int[3]){N, i, (i + 1) % N}, 3 * sizeof(int));
    }
    assert_ok(om_sense_scene_add(scene, &s, &grey, disc));
    om_surface_done(&s);
    // A gripper whose shaft comes in from the side, its tip above the disc's middle.
    OmPose rcm = {{0.08, 0, 0.14}, om_quat_identity()};
    OmPsm psm = om_psm_default(OM_PROGRASP, rcm);
    const double start[OM_PSM_NJOINT] = {0};
    double q[OM_PSM_NJOINT];
    OmMat3 down = om_mat3_cols(om_vec3(0, 1, 0), om_vec3(1, 0, 0), om_vec3(0, 0, -1));
    OmPose tip = {{0.002, 0.001, 0.03}, om_quat_from_mat3(down)};
    assert_ok(om_psm_inverse(&psm, tip, start, q));
    assert_ok(om_psm_surface(&psm, q, 0.4, tool_surface));
    assert_ok(om_sense_scene_add(scene, tool_surface, &grey, tool));
    assert_ok(om_sense_scene_commit(scene));
    return scene;
}

enum { NPOINT = 20000 };

static void fill_disc(double r, double* x, double* n) {
    for (int i = 0; i < NPOINT; ++i) {
        double s = r * sqrt((i + 0.5) / NPOINT), a = i * OM_PI * (3 - sqrt(5.0));
        om_store3(x, i, om_vec3(s * cos(a), s * sin(a), 0));
        om_store3(n, i, om_vec3(0, 0, 1));
    }
}

// Area of the part of a disc of radius r with x > d, over the disc's.
static double segment(double r, double d) {
    return (r * r * acos(d / r) - d * sqrt(r * r - d * d)) / (OM_PI * r * r);
}

static void a_strip_hides_its_area(void** state) {
    (void)state;
    static double x[3 * NPOINT], n[3 * NPOINT];
    fill_disc(0.02, x, n);
    OmCamera c = look_down(W, H);  // 0.2 above the disc
    const double edge[][2] = {{-0.004, 0.003}, {0.002, 0.05}, {-0.015, -0.001}};
    for (int k = 0; k < 3; ++k) {
        OmSenseScene* scene;
        int id;
        double z = 0.04, scale = 0.2 / (0.2 - z);  // the strip hides what lies in its projection
        OmSurface strip = make_square(edge[k][0], edge[k][1], 0.1, z);
        assert_ok(om_sense_scene_create(&scene));
        assert_ok(om_sense_scene_add(scene, &strip, &grey, &id));
        assert_ok(om_sense_scene_commit(scene));
        double share, hidden = segment(0.02, scale * edge[k][0]) -
                               segment(0.02, fmin(0.02, scale * edge[k][1]));
        assert_ok(om_sense_visibility(scene, &c, x, n, NPOINT, 0, &share));
        // 20,000 points in a spiral: their discrepancy is of the order of N^(-3/4)
        assert_near(share, 1 - hidden, 1e-3);
        om_surface_done(&strip);
        om_sense_scene_destroy(scene);
    }
}

static void a_tool_hides_what_is_behind_it(void** state) {
    (void)state;
    enum { W2 = 480, H2 = 360 };
    static double x[3 * NPOINT], n[3 * NPOINT];
    static float depth[W2 * H2];
    static int id[W2 * H2];
    int disc, tool;
    OmSurface surface;
    OmSenseScene* scene = make_scene(&disc, &tool, &surface);
    OmCamera c = look_down(W2, H2);
    c.fov = 0.3;  // the disc fills most of the picture
    fill_disc(0.02, x, n);
    // The share of the disc's pixels that stay its own when the tool is there: a disc across the axis is
    // not distorted, so pixels and points weigh the same.
    int count[2];
    double share[2];
    for (int is_there = 0; is_there < 2; ++is_there) {
        om_sense_scene_show(scene, tool, is_there);
        assert_ok(om_sense_scene_commit(scene));
        assert_ok(om_sense_depth(scene, &c, 2, depth, id, NULL));
        count[is_there] = 0;
        for (int i = 0; i < W2 * H2; ++i) count[is_there] += id[i] == disc;
        assert_ok(
            om_sense_visibility(scene, &c, x, n, NPOINT, (uint64_t)1 << disc, &share[is_there]));
    }
    assert_near(share[0], 1, 0);
    double by_pixel = count[1] / (double)count[0];
    assert_true(by_pixel < 0.9 && by_pixel > 0.1);
    assert_near(share[1], by_pixel, 0.005);  // pixels on the outline: about 1,000 of 80,000
    // The tool itself may be looked through.
    double all;
    uint64_t both = (uint64_t)1 << disc | (uint64_t)1 << tool;
    assert_ok(om_sense_visibility(scene, &c, x, n, NPOINT, both, &all));
    assert_near(all, 1, 0);
    om_surface_done(&surface);
    om_sense_scene_destroy(scene);
}

// Points just inside and just outside of each edge of the picture, 20 mm before the camera.
static void points_beside_the_picture_are_not_seen(void** state) {
    (void)state;
    int disc, tool;
    OmSurface surface;
    OmSenseScene* scene = make_scene(&disc, &tool, &surface);
    OmCamera c = look_down(W, H);
    const double pixel[8][2] = {{1, 30}, {-1, 30}, {W - 1, 30}, {W + 1, 30},
                                {50, 1}, {50, -1}, {50, H - 1}, {50, H + 1}};
    for (int i = 0; i < 8; ++i) {
        double p[3];
        OmVisibility v;
        OmVec3 ray = om_camera_ray(&c, pixel[i][0], pixel[i][1]);
        om_store3(p, 0, om_madd(c.pose_world_camera.p, 0.02, om_normalize(ray)));
        assert_ok(om_sense_count_visible(scene, &c, p, NULL, 1, 0, &v));
        assert_int_equal(v.noutside, i % 2);
        assert_int_equal(v.nseen, 1 - i % 2);
    }
    om_surface_done(&surface);
    om_sense_scene_destroy(scene);
}

static void depth_does_not_depend_on_workers(void** state) {
    (void)state;
    static Frame one, many;
    int disc, tool;
    OmSurface surface;
    OmSenseScene* scene = make_scene(&disc, &tool, &surface);
    OmCamera c = look_down(W, H);
    OmDepthNoise noise = om_depth_noise_default(3);
    noise.nworker = 1;
    assert_ok(om_sense_depth(scene, &c, 1, one.depth, one.id, one.normal));
    om_depth_add_noise(&noise, &c, 9, one.normal, one.depth);
    for (int nworker = 2; nworker <= 5; nworker += 3) {
        noise.nworker = nworker;
        assert_ok(om_sense_depth(scene, &c, nworker, many.depth, many.id, many.normal));
        om_depth_add_noise(&noise, &c, 9, many.normal, many.depth);
        assert_memory_equal(&one, &many, sizeof one);
    }
    om_surface_done(&surface);
    om_sense_scene_destroy(scene);
}

// Refitted or rebuilt, a moved scene gives the same depths.
static void refitting_is_building_anew(void** state) {
    (void)state;
    static Frame moved, fresh;
    OmCamera c = look_down(W, H);
    OmSenseLook smooth = {.red = 1, .is_smooth = true};
    OmSurface sphere = make_sphere(om_vec3(0, 0, 0.05), 0.03, 40);
    OmSenseScene* scene;
    int id;
    assert_ok(om_sense_scene_create(&scene));
    assert_ok(om_sense_scene_add(scene, &sphere, &smooth, &id));
    assert_ok(om_sense_scene_commit(scene));
    for (int i = 0; i < sphere.nvert; ++i) {
        OmVec3 p = om_load3(sphere.x, i);
        om_store3(sphere.x, i, om_vec3(p.x + 0.2 * p.z, 1.3 * p.y, p.z - 0.5 * p.x));
    }
    om_sense_scene_update(scene, id, sphere.x, NULL);
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(om_sense_depth(scene, &c, 2, moved.depth, moved.id, moved.normal));
    om_sense_scene_destroy(scene);
    assert_ok(om_sense_scene_create(&scene));
    assert_ok(om_sense_scene_add(scene, &sphere, &smooth, &id));
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(om_sense_depth(scene, &c, 2, fresh.depth, fresh.id, fresh.normal));
    om_sense_scene_destroy(scene);
    om_surface_done(&sphere);
    assert_memory_equal(moved.id, fresh.id, sizeof fresh.id);
    for (int i = 0; i < W * H; ++i) {
        assert_near((double)moved.depth[i], (double)fresh.depth[i], 1e-7);  // float
    }
}

static OmStatus use_a_scene(const OmSurface* s) {
    OmSenseLook look = {.red = 1, .is_smooth = true, .texture = OM_TEXTURE_FAT};
    OmSenseScene* scene = NULL;
    OmPicture picture = {0};
    OmCamera c = look_down(16, 12);
    OmSenseOptions options = om_sense_options_default();
    OmStatus status = OM_OK;
    int id;
    OM_TRY_DONE(om_sense_scene_create(&scene));
    for (int i = 0; i < 10; ++i) {  // more than the list of objects holds at first
        status = om_sense_scene_add(scene, s, &look, &id);
        if (status < 0) assert_int_equal(id, -1);
        OM_TRY_DONE(status);
    }
    OM_TRY_DONE(om_sense_scene_commit(scene));
    OM_TRY_DONE(om_picture_init(&picture, 16, 12, 3));
    OM_TRY_DONE(om_sense_render(scene, &c, &options, &picture));
done:
    om_picture_done(&picture);
    om_sense_scene_destroy(scene);
    return status;
}

static void refused_memory_leaks_nothing(void** state) {
    (void)state;
    OmSurface sphere = make_sphere(om_vec3(0, 0, 0.05), 0.03, 8);
    int64_t alive = om_alloc_alive();
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    om_allocator_set(&failing);
    int nfail = 0;
    for (const int stride = test_stride(5);; nfail += stride) {
        test_alloc_countdown = nfail;
        OmStatus status = use_a_scene(&sphere);
        assert_int_equal(om_alloc_alive(), alive);
        if (status == OM_OK) break;
        assert_int_equal(status, OM_NO_MEMORY);
    }
    om_allocator_set(NULL);
    assert_true(nfail > 40);  // some five an object
    om_surface_done(&sphere);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(normals_of_a_sphere),
        cmocka_unit_test(pixels_name_their_triangle),
        cmocka_unit_test(noise_grows_with_range),
        cmocka_unit_test(noise_is_new_in_every_frame),
        cmocka_unit_test(noise_is_that_of_single_streams),
        cmocka_unit_test(grazing_and_lost_pixels_give_no_depth),
        cmocka_unit_test(a_strip_hides_its_area),
        cmocka_unit_test(a_tool_hides_what_is_behind_it),
        cmocka_unit_test(points_beside_the_picture_are_not_seen),
        cmocka_unit_test(depth_does_not_depend_on_workers),
        cmocka_unit_test(refitting_is_building_anew),
        cmocka_unit_test(refused_memory_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
