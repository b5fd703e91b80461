// Stereo against exact surfaces: a plane and a sphere with a solid texture, drawn here without the renderer; cameras
// side by side, and toed in with distorted lenses. Then tissue as om_sense_render draws it, against om_sense_depth.
#include "omentum/sense_stereo.h"
#include "sense_shapes.h"
#include "test_alloc.h"

enum { W = 320, H = 240, N = W * H };

typedef struct Pair {
    OmStereoPair pair;
    OmPicture left, right;
    float truth[N];  // depth of the left camera
} Pair;

// Two endoscopes `base` apart, 100 mm over the origin, looking down; `toe` turns each towards the other.
static void set_cameras(Pair* p, OmLens lens, double base, double distance, double toe) {
    for (int k = 0; k < 2; ++k) {
        double side = k ? 0.5 * base : -0.5 * base;
        OmVec3 eye = om_vec3(side, 0, distance),
               target = om_vec3(side - distance * tan(k ? toe : -toe), 0, 0);
        OmCamera c = {
            om_pose_look_at(eye, target, om_vec3(0, 1, 0)), W, H, 50 * OM_PI / 180, 0.01, 1, lens};
        *(k ? &p->pair.right : &p->pair.left) = c;
        assert_ok(om_picture_init(k ? &p->right : &p->left, W, H, 3));
    }
    p->pair.left_picture = &p->left;
    p->pair.right_picture = &p->right;
}

static void pair_done(Pair* p) {
    om_picture_done(&p->left);
    om_picture_done(&p->right);
}

// ---- surfaces drawn here ------------------------------------------------------------------------------------------

typedef struct Body {
    OmVec3 normal;  // plane normal . x = height
    double height;
    OmVec3 centre;  // and a sphere, none if r is 0
    double r;
} Body;

static double hit(const Body* b, OmVec3 o, OmVec3 d) {
    double t = (b->height - om_dot(b->normal, o)) / om_dot(b->normal, d);
    OmVec3 from = om_sub(o, b->centre);
    double dd = om_norm2(d), od = om_dot(from, d),
           disc = od * od - dd * (om_norm2(from) - b->r * b->r);
    if (b->r > 0 && disc > 0) t = fmin(t, (-od - sqrt(disc)) / dd);
    return t;
}

static double lattice(int i, int j, int k) {
    OmRng rng = om_rng_init(99, (uint64_t)((i + 512) * 1048576 + (j + 512) * 1024 + k + 512));
    return om_rng_uniform(&rng);
}

// Value noise of a cell of 0.8 mm.
static double texture(OmVec3 p) {
    double g[3] = {p.x / 8e-4, p.y / 8e-4, p.z / 8e-4}, sum = 0;
    int c[3];
    for (int k = 0; k < 3; ++k)
        c[k] = (int)floor(g[k]), g[k] -= c[k], g[k] *= g[k] * (3 - 2 * g[k]);
    for (int q = 0; q < 8; ++q) {
        double weight =
            (q & 1 ? g[0] : 1 - g[0]) * (q & 2 ? g[1] : 1 - g[1]) * (q & 4 ? g[2] : 1 - g[2]);
        sum += weight * lattice(c[0] + (q & 1), c[1] + (q >> 1 & 1), c[2] + (q >> 2));
    }
    return sum;
}

static void draw(const Body* b, const OmCamera* c, double gain, OmPicture* out, float* depth) {
    OmVec3 eye = c->pose_world_camera.p,
           axis = om_quat_rotate(c->pose_world_camera.q, om_vec3(0, 0, 1));
    for (int i = 0; i < N; ++i) {
        double sum = 0;
        for (int k = 0; k < 4; ++k) {
            OmVec3 d = om_camera_ray(c, i % W + 0.25 + 0.5 * (k % 2), i / W + 0.25 + 0.5 * (k / 2));
            sum += 0.25 * texture(om_madd(eye, hit(b, eye, d), d));
        }
        for (int k = 0; k < 3; ++k)
            out->pixel[3 * i + k] = (unsigned char)(gain * (20 + 200 * sum) + 0.5);
        OmVec3 d = om_camera_ray(c, i % W + 0.5, i / W + 0.5);
        if (depth) depth[i] = (float)(hit(b, eye, d) * om_dot(d, axis));
    }
}

static void draw_pair(const Body* b, Pair* p) {
    draw(b, &p->pair.left, 1, &p->left, p->truth);
    draw(b, &p->pair.right, 0.85, &p->right, NULL);  // the right one is darker
}

typedef struct Error {
    double share, median, p90, far;  // far: share of depths that are 5 % off
} Error;

static int compare(const void* a, const void* b) {
    double d = *(const double*)a - *(const double*)b;
    return (d > 0) - (d < 0);
}

// Absolute errors in mm over the pixels that have a true depth.
static Error measure(const float* depth, const float* truth) {
    static double e[N];
    int n = 0, want = 0, far = 0;
    for (int i = 0; i < N; ++i) {
        want += truth[i] > 0;
        if (!(depth[i] > 0) || !(truth[i] > 0)) continue;
        e[n] = 1e3 * fabs((double)(depth[i] - truth[i]));
        far += fabsf(depth[i] - truth[i]) > 0.05f * truth[i];
        ++n;
    }
    assert_true(n > 0);
    qsort(e, (size_t)n, sizeof *e, compare);
    return (Error){(double)n / want, e[n / 2], e[n * 9 / 10], (double)far / n};
}

static Error run(const Pair* p, const OmStereoDef* def, const char* name) {
    static float depth[N];
    OmStereoReport report;
    assert_ok(om_stereo_depth(def, &p->pair, depth, &report));
    Error e = measure(depth, p->truth);
    printf(
        "%-16s share %.3f, median %.3f mm, 90 %% %.3f mm, 5 %% off %.4f; ms: %.0f rectify, %.0f match, %.0f refine\n",
        name, e.share, e.median, e.p90, e.far, report.ms_rectify, report.ms_match,
        report.ms_refine);
    int count = 0;
    for (int i = 0; i < N; ++i) count += depth[i] > 0;
    assert_near(report.share, count / (double)N, 1e-12);
    return e;
}

static const OmLens bent = {262, 258, 165, 117, -0.25, 0.08, 5e-4, -4e-4, 0};

// A point is in one row of both rectified pictures, and its disparity is focal x baseline / depth.
static void rectified_rows_agree(void** state) {
    (void)state;
    static Pair p;
    for (int k = 0; k < 2; ++k) {
        set_cameras(&p, k ? bent : (OmLens){0}, 0.005, 0.1, k ? 0.02 : 0);
        p.pair.right.pose_world_camera.p.y += k ? 2e-4 : 0;
        OmCamera l, r;
        assert_ok(om_stereo_rectify(&p.pair, &l, &r));
        assert_ok(om_camera_check(&l));
        if (k == 0) {  // side by side: nothing moves
            assert_int_equal(l.width, W);
            assert_int_equal(l.height, H);
            OmLens own = om_camera_lens(&p.pair.left);
            assert_near(l.lens.fx, own.fx, 1e-9);
            assert_near(l.lens.cx, own.cx, 1e-9);
            assert_near(l.lens.cy, own.cy, 1e-9);
        }
        double base =
            om_distance(p.pair.left.pose_world_camera.p, p.pair.right.pose_world_camera.p);
        OmRng rng = om_rng_init(4, (uint64_t)k);
        for (int i = 0; i < 500; ++i) {
            OmVec3 x = om_vec3(om_rng_range(&rng, -0.03, 0.03), om_rng_range(&rng, -0.03, 0.03),
                               om_rng_range(&rng, -0.03, 0.03));
            double lu, lv, ru, rv;
            assert_true(om_camera_project(&l, x, &lu, &lv));
            assert_true(om_camera_project(&r, x, &ru, &rv));
            double z = om_pose_apply(om_pose_inverse(l.pose_world_camera), x).z;
            assert_near(lv, rv, 1e-9);
            assert_near(lu - ru, l.lens.fx * base / z, 1e-9);
        }
        for (int i = 0; i <= 4; ++i)  // the left picture's corners lie in the rectified one
            for (int j = 0; j <= 4; ++j) {
                OmVec3 d = om_camera_ray(&p.pair.left, i * W / 4.0, j * H / 4.0);
                double u, v;
                assert_true(om_camera_project(&l, om_add(l.pose_world_camera.p, d), &u, &v));
                assert_true(u > -1e-6 && u < l.width + 1e-6 && v > -1e-6 && v < l.height + 1e-6);
            }
        pair_done(&p);
    }
}

// Bounds are a third above what was measured. A tenth of a pixel is 0.8 mm at 100 mm.
static void exact_surfaces(void** state) {
    (void)state;
    static Pair p;
    OmStereoDef def = om_stereo_default_def();
    const Body plane = {.normal = {0.25, 0.1, 0.9631}, .height = 0},
               ball = {.normal = {0, 0, 1}, .height = -0.01, .centre = {0, 0, 0}, .r = 0.025};
    const Error bound[4] = {{0.93, 0.08, 0.19, 0.001},
                            {0.93, 0.12, 0.29, 0.003},
                            {0.95, 0.22, 0.69, 0.001},
                            {0.96, 0.27, 0.74, 0.004}};
    for (int k = test_count(3, 0); k < 4; ++k) {  // the ball of the bent cameras is the hardest
        const Body* b = k % 2 ? &ball : &plane;
        set_cameras(&p, k / 2 ? bent : (OmLens){0}, 0.005, 0.1, k / 2 ? 0.02 : 0);
        draw_pair(b, &p);
        def.is_refined = false;
        Error rough = run(&p, &def, "parabola");
        def.is_refined = true;
        Error e = run(&p, &def, k % 2 ? "sphere" : "plane");
        assert_true(e.share > bound[k].share);
        assert_below(e.median, bound[k].median);
        assert_below(e.p90, bound[k].p90);
        assert_below(e.far, bound[k].far);
        assert_below(e.median, 0.35 * rough.median);
        pair_done(&p);
    }
}

static Pair* make_plane_pair(void) {
    static Pair p;
    // by the first case that needs it; the cases change their copies
    static unsigned char drawn[2][3 * N];
    static bool is_drawn;
    const Body plane = {.normal = {0.25, 0.1, 0.9631}, .height = 0};
    set_cameras(&p, (OmLens){0}, 0.005, 0.1, 0);
    if (!is_drawn) {
        draw_pair(&plane, &p);
        for (int k = 0; k < 2; ++k)
            memcpy(drawn[k], k ? p.right.pixel : p.left.pixel, sizeof drawn[k]);
    }
    is_drawn = true;
    for (int k = 0; k < 2; ++k) memcpy(k ? p.right.pixel : p.left.pixel, drawn[k], sizeof drawn[k]);
    return &p;
}

static void workers_change_nothing(void** state) {
    (void)state;
    static float one[N], many[N];
    Pair* p = make_plane_pair();
    OmStereoDef def = om_stereo_default_def();
    def.nworker = 1;
    assert_ok(om_stereo_depth(&def, &p->pair, one, NULL));
    def.nworker = 4;
    assert_ok(om_stereo_depth(&def, &p->pair, many, NULL));
    assert_memory_equal(one, many, sizeof one);
    pair_done(p);
}

static OmStatus depth_of(void* ctx) {
    static float depth[N];
    OmStereoDef def = om_stereo_default_def();
    def.nworker = 1;
    return om_stereo_depth(&def, ctx, depth, NULL);
}

static void every_refused_memory_returns(void** state) {
    (void)state;
    Pair* p = make_plane_pair();
    assert_true(test_failing_allocations(depth_of, &p->pair, test_stride(4)) > test_count(3, 10));
    pair_done(p);
}

// Pictures without texture, or of two different scenes, give next to no depth.
static void no_match_is_no_depth(void** state) {
    (void)state;
    static float depth[N];
    Pair* p = make_plane_pair();
    OmStereoDef def = om_stereo_default_def();
    OmStereoReport report;
    memset(p->left.pixel, 90, 3 * N);
    memset(p->right.pixel, 90, 3 * N);
    assert_ok(om_stereo_depth(&def, &p->pair, depth, &report));
    assert_near(report.share, 0, 0);
    for (int k = 0; k < 2; ++k) {
        OmRng rng = om_rng_init(8, (uint64_t)k);
        unsigned char* pixel = k ? p->right.pixel : p->left.pixel;
        for (int i = 0; i < 3 * N; ++i) pixel[i] = (unsigned char)om_rng_below(&rng, 256);
    }
    assert_ok(om_stereo_depth(&def, &p->pair, depth, &report));
    assert_below(report.share, 0.02);
    pair_done(p);
}

static void refuse(const OmStereoDef* def, const OmStereoPair* pair, const char* words) {
    static float depth[N];
    assert_status(om_stereo_depth(def, pair, depth, NULL), OM_INVALID);
    if (!strstr(om_error_message(), words)) fail_msg("%s: %s", words, om_error_message());
}

static void bad_input_is_refused(void** state) {
    (void)state;
    Pair* p = make_plane_pair();
    OmStereoDef def = om_stereo_default_def(), bad = def;
    bad.cookie = 0;
    refuse(&bad, &p->pair, "om_stereo_default_def");
    bad = def, bad.near_m = 0;
    refuse(&bad, &p->pair, "near_m 0");
    bad = def, bad.near_m = 0.002;
    refuse(&bad, &p->pair, "raise OmStereoDef.near_m");
    bad = def, bad.penalty_jump = 121;
    refuse(&bad, &p->pair, "penalty_jump is 121");
    bad = def, bad.penalty_one = 96;
    refuse(&bad, &p->pair, "penalty_one is 96");
    bad = def, bad.min_gain = 1;
    refuse(&bad, &p->pair, "min_gain");
    OmStereoPair pair = p->pair;
    pair.left = p->pair.right, pair.right = p->pair.left;
    refuse(&def, &pair, "exchanged");
    OmPicture two = *p->pair.left_picture;
    two.nchannel = 2;
    pair = p->pair, pair.left_picture = &two;
    refuse(&def, &pair, "2 channels");
    pair = p->pair, pair.right = pair.left;
    refuse(&def, &pair, "at one place");
    pair = p->pair, pair.left.fov = 0;
    refuse(&def, &pair, "left camera of the pair: camera: fov");
    pair = p->pair, pair.right.pose_world_camera.q.w = NAN;
    refuse(&def, &pair, "right camera of the pair: its pose");
    pair = p->pair, pair.right.width = 100;
    refuse(&def, &pair, "the right picture has 320 x 240");
    pair = p->pair, pair.left_picture = NULL;
    refuse(&def, &pair, "the left picture of the pair is missing");
    pair = p->pair,
    pair.right.pose_world_camera.q =
        om_quat_mul(pair.right.pose_world_camera.q, om_quat_axis_angle(om_vec3(0, 1, 0), 2.0));
    refuse(&def, &pair, "different directions");
    pair_done(p);
}

// ---- tissue -------------------------------------------------------------------------------------------------------

static OmSurface make_hill(int n) {
    OmSurface s;
    assert_ok(om_surface_init(&s, n * n, 2 * (n - 1) * (n - 1)));
    int t = 0;
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            double x = 0.2 * i / (n - 1) - 0.1, y = 0.2 * j / (n - 1) - 0.1;
            om_store3(s.x, j * n + i,
                      om_vec3(x, y, 0.02 * exp(-(x * x + y * y) / (2 * 0.02 * 0.02))));
            if (i + 1 == n || j + 1 == n) continue;
            int a = j * n + i;
            memcpy(&s.tri_vert[3 * t++], (int[3]){a, a + 1, a + n + 1}, 3 * sizeof(int));
            memcpy(&s.tri_vert[3 * t++], (int[3]){a, a + n + 1, a + n}, 3 * sizeof(int));
        }
    return s;
}

// Wet tissue: highlights move with the camera, and each picture has its own light. Bounds in mm, a third above what was
// measured.
static void tissue_of_the_renderer(void** state) {
    (void)state;
    const double median[2][4] = {{0.31, 0.63, 0.80, 2.2}, {0.19, 0.31, 0.49, 1.5}};
    static Pair p;
    OmSurface hill = make_hill(81);
    const OmSensePart part[2] = {OM_PART_TISSUE, OM_PART_ORGAN};
    for (int q = 0; q < 2; ++q)
        for (int k = 0; k < 4; k += test_count(3, 1)) {
            OmSenseScene* scene;
            int id;
            OmSenseLook look = om_sense_look(part[q]);
            assert_ok(om_sense_scene_create(&scene));
            assert_ok(om_sense_scene_add(scene, &hill, &look, &id));
            assert_ok(om_sense_scene_commit(scene));
            const double distance[4] = {0.08, 0.12, 0.16, 0.22};
            set_cameras(&p, (OmLens){0}, 0.005, distance[k], 0);
            OmSenseOptions options = om_sense_options_default();
            assert_ok(om_sense_render(scene, &p.pair.left, &options, &p.left));
            assert_ok(om_sense_render(scene, &p.pair.right, &options, &p.right));
            assert_ok(om_sense_depth(scene, &p.pair.left, 0, p.truth, NULL, NULL));
            char name[64];
            snprintf(name, sizeof name, "%s at %.0f mm", q ? "organ" : "tissue", 1e3 * distance[k]);
            OmStereoDef def = om_stereo_default_def();
            Error e = run(&p, &def, name);
            assert_true(e.share > 0.91);
            assert_below(e.median, median[q][k]);
            assert_below(e.p90, 4 * median[q][k]);
            assert_below(e.far, 0.01);
            pair_done(&p);
            om_sense_scene_destroy(scene);
        }
    om_surface_done(&hill);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rectified_rows_agree),         cmocka_unit_test(exact_surfaces),
        cmocka_unit_test(tissue_of_the_renderer),       cmocka_unit_test(workers_change_nothing),
        cmocka_unit_test(every_refused_memory_returns), cmocka_unit_test(no_match_is_no_depth),
        cmocka_unit_test(bad_input_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
