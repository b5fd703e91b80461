// test_contact_probe.c: distances of rigid shapes against brute force; contact surfaces of a wanted size.
#include "test_rig.h"

#include "omentum/contact_tool.h"
#include "omentum/shape_meshing.h"

static OmVec3 random_point(OmRng* rng, OmVec3 lo, OmVec3 hi, double margin) {
    return om_vec3(om_rng_range(rng, lo.x - margin, hi.x + margin),
                   om_rng_range(rng, lo.y - margin, hi.y + margin),
                   om_rng_range(rng, lo.z - margin, hi.z + margin));
}

// ---- brute force ----------------------------------------------------------------------------------

static double segment_distance(OmVec3 p, OmVec3 a, OmVec3 b) {
    OmVec3 d = om_sub(b, a);
    double t = om_dot(om_sub(p, a), d) / fmax(om_norm2(d), 1e-300);
    return om_distance(p, om_madd(a, fmin(1, fmax(0, t)), d));
}

// The plane's distance where the foot lies inside all three edges, else the nearest edge.
static double triangle_distance(OmVec3 p, OmVec3 a, OmVec3 b, OmVec3 c) {
    OmVec3 n = om_normalize(om_cross(om_sub(b, a), om_sub(c, a))), x[4] = {a, b, c, a};
    double near = INFINITY;
    bool is_over = om_norm(n) > 0.5;
    for (int k = 0; k < 3; ++k) {
        near = fmin(near, segment_distance(p, x[k], x[k + 1]));
        is_over &= om_dot(om_cross(n, om_sub(x[k + 1], x[k])), om_sub(p, x[k])) >= 0;
    }
    return is_over ? fabs(om_dot(n, om_sub(p, a))) : near;
}

// Solid angle of a triangle (van Oosterom and Strackee 1983); over a closed surface 4 pi inside, 0 outside.
static double solid_angle(OmVec3 p, OmVec3 a, OmVec3 b, OmVec3 c) {
    a = om_sub(a, p), b = om_sub(b, p), c = om_sub(c, p);
    double la = om_norm(a), lb = om_norm(b), lc = om_norm(c);
    double down = la * lb * lc + om_dot(a, b) * lc + om_dot(b, c) * la + om_dot(c, a) * lb;
    return 2 * atan2(om_dot(a, om_cross(b, c)), down);
}

static double brute_distance(const OmSurface* s, OmVec3 p) {
    double near = INFINITY, angle = 0;
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * t;
        OmVec3 a = om_load3(s->x, v[0]), b = om_load3(s->x, v[1]), c = om_load3(s->x, v[2]);
        near = fmin(near, triangle_distance(p, a, b, c));
        angle += solid_angle(p, a, b, c);
    }
    return angle > 2 * OM_PI ? -near : near;
}

// The normal is the gradient, where differences see one.
static void check_normal(const OmProbe* probe, OmVec3 p) {
    const double e = 1e-7;
    OmVec3 n, g;
    double d = om_probe_eval_distance(probe, p, &n);
    double* out[3] = {&g.x, &g.y, &g.z};
    for (int k = 0; k < 3; ++k) {
        OmVec3 step = om_vec3(k == 0 ? e : 0, k == 1 ? e : 0, k == 2 ? e : 0);
        *out[k] = (om_probe_eval_distance(probe, om_add(p, step), NULL) -
                   om_probe_eval_distance(probe, om_sub(p, step), NULL)) /
                  (2 * e);
    }
    assert_near(om_norm(n), 1, 1e-12);
    if (fabs(om_norm(g) - 1) > 1e-5) return;  // on a ridge of the distance
    assert_near(om_distance(n, g), 0, 1e-4 + 1e-9 / fmax(fabs(d), 1e-9));
}

// ---- shapes ---------------------------------------------------------------------------------------

static void compare_with_drawing(OmProbeDef* def, double tolerance, int n) {
    OmProbe* probe;
    OmSurface drawn;
    OmVec3 lo, hi;
    assert_ok(om_probe_create(def, &probe));
    assert_ok(om_probe_get_surface(probe, &drawn));
    assert_ok(om_surface_check_closed(&drawn, NULL));
    assert_true(om_surface_volume(&drawn) > 0);
    om_probe_get_bounds(probe, &lo, &hi);
    OmRng rng = om_rng_init(4, (uint64_t)def->shape);
    double size = om_distance(lo, hi);
    for (int k = 0; k < n; ++k) {
        OmVec3 p = random_point(&rng, lo, hi, 0.3 * size);
        assert_near(om_probe_eval_distance(probe, p, NULL), brute_distance(&drawn, p), tolerance);
        check_normal(probe, p);
    }
    om_surface_done(&drawn);
    om_probe_destroy(probe);
}

static void test_shapes(void** test) {
    (void)test;
    OmProbeDef box = om_probe_default_def(OM_PROBE_BOX);
    box.rounding = 0;
    compare_with_drawing(&box, 1e-15, 3000);
    // circles are drawn with 48 sides: off by r (1 - cos(pi / 48)), twice over on a sphere
    OmProbeDef ball = om_probe_default_def(OM_PROBE_SPHERE);
    compare_with_drawing(&ball, 0.005 * ball.radius, 100);
    OmProbeDef capsule = om_probe_default_def(OM_PROBE_CAPSULE);
    compare_with_drawing(&capsule, 0.005 * capsule.radius, 100);
}

// A rounded box is all within its rounding of a smaller one.
static void test_rounded_box(void** test) {
    (void)test;
    OmProbeDef def = om_probe_default_def(OM_PROBE_BOX), inner = def;
    def.rounding = 0.003;
    inner.rounding = 0;
    inner.size = om_sub(def.size, om_vec3(0.006, 0.006, 0.006));
    OmProbe *probe, *small;
    assert_ok(om_probe_create(&def, &probe));
    assert_ok(om_probe_create(&inner, &small));
    OmRng rng = om_rng_init(4, 9);
    for (int k = 0; k < 3000; ++k) {
        OmVec3 p = random_point(&rng, om_vec3(-0.03, -0.01, -0.01), om_vec3(0.03, 0.01, 0.07), 0);
        double d = om_probe_eval_distance(small, om_sub(p, om_vec3(0, 0, 0.003)), NULL) - 0.003;
        assert_near(om_probe_eval_distance(probe, p, NULL), d, 1e-15);
        check_normal(probe, p);
    }
    om_probe_destroy(probe);
    om_probe_destroy(small);
}

static double torus(void* ctx, OmVec3 p) {
    (void)ctx;
    double q = hypot(p.x, p.y) - 0.02;
    return hypot(q, p.z) - 0.007;
}

// Marching cubes leave slivers; a ring has a hole. Also far away, on vertices and on the surface.
static void test_mesh(void** test) {
    (void)test;
    OmSdf sdf;
    OmSdfDef grid = om_sdf_default_def(0.0021);
    OmSurface ring;
    assert_ok(om_sdf_from_function(torus, NULL, om_vec3(-0.03, -0.03, -0.01),
                                   om_vec3(0.03, 0.03, 0.01), &grid, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, &ring));
    OmProbeDef def = om_probe_default_def(OM_PROBE_MESH);
    def.surface = &ring;
    OmProbe* probe;
    assert_ok(om_probe_create(&def, &probe));
    OmRng rng = om_rng_init(4, 7);
    int ninside = 0;
    for (int k = 0; k < 1500; ++k) {
        OmVec3 p = random_point(&rng, om_vec3(-0.03, -0.03, -0.01), om_vec3(0.03, 0.03, 0.01),
                                k % 3 == 0 ? 0.1 : 0);
        double d = brute_distance(&ring, p);
        ninside += d < 0;
        assert_near(om_probe_eval_distance(probe, p, NULL), d, 1e-13);
        check_normal(probe, p);
    }
    assert_true(ninside > 200);
    for (int v = 0; v < ring.nvert; ++v) {  // out of each vertex along its own normal
        OmVec3 n, p = om_load3(ring.x, v);
        assert_near(om_probe_eval_distance(probe, p, &n), 0, 1e-15);
        assert_near(om_norm(n), 1, 1e-12);
        assert_true(om_probe_eval_distance(probe, om_madd(p, 1e-6, n), NULL) > 0);
        assert_true(om_probe_eval_distance(probe, om_madd(p, -1e-6, n), NULL) < 0);
    }
    om_probe_destroy(probe);
    om_surface_done(&ring);
    om_sdf_done(&sdf);
}

static void refuse(const OmProbeDef* def, const char* word) {
    OmProbe* probe = NULL;
    int64_t alive = om_alloc_alive();
    assert_status(om_probe_create(def, &probe), OM_INVALID);
    assert_null(probe);
    if (!strstr(om_error_message(), word)) fail_msg("no \"%s\" in: %s", word, om_error_message());
    assert_true(om_alloc_alive() == alive);
}

static void test_input(void** test) {
    (void)test;
    OmProbeDef def;
    OmTetMesh mesh;
    OmSurface s;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 2, 2, 2, &mesh));
    assert_ok(om_tet_mesh_boundary(&mesh, &s, NULL));
#define REFUSE(kind, change, word)    \
    def = om_probe_default_def(kind); \
    def.surface = &s;                 \
    change;                           \
    refuse(&def, word)
    REFUSE(OM_PROBE_BOX, def.cookie = 0, "om_probe_default_def");
    REFUSE(OM_PROBE_BOX, def.size.y = 0, "side 1");
    REFUSE(OM_PROBE_BOX, def.size.z = (double)NAN, "side 2");
    REFUSE(OM_PROBE_BOX, def.rounding = 0.006, "rounding");
    REFUSE(OM_PROBE_SPHERE, def.radius = -1, "radius");
    REFUSE(OM_PROBE_CAPSULE, def.length = (double)INFINITY, "length");
    REFUSE(OM_PROBE_MESH, def.surface = NULL, "surface");
    REFUSE(OM_PROBE_MESH, s.ntri -= 1, "edge");
    s.ntri += 1;
    REFUSE(OM_PROBE_MESH, s.tri_vert[5] = 99, "vertex 99");
    om_surface_done(&s);
    assert_ok(om_tet_mesh_boundary(&mesh, &s, NULL));
    REFUSE(OM_PROBE_MESH, s.x[7] = (double)NAN, "vertex 2");
    s.x[7] = 0;
    for (int t = 0; t < s.ntri; ++t) {
        int swap = s.tri_vert[3 * t];
        s.tri_vert[3 * t] = s.tri_vert[3 * t + 1];
        s.tri_vert[3 * t + 1] = swap;
    }
    REFUSE(OM_PROBE_MESH, (void)0, "outside");
    om_probe_destroy(NULL);
    om_surface_done(&s);
    om_tet_mesh_done(&mesh);
}

// ---- contact surfaces -----------------------------------------------------------------------------

static double dome(void* ctx, OmVec3 p) {
    (void)ctx;
    return fmax(om_norm(p) - 0.06, -p.z);
}

// The requested number of triangles, closed, of like size, near the boundary, the same every time.
static void test_surface(void** test) {
    (void)test;
    const int wanted[] = {200, 1004, 9000};
    OmTetMesh mesh;
    OmStuffDef stuff = om_stuff_default_def(0.008, dome, NULL, om_vec3(-0.07, -0.07, -0.01),
                                            om_vec3(0.07, 0.07, 0.07));
    assert_ok(om_tet_mesh_stuff(&stuff, &mesh));
    OmSurface boundary;
    assert_ok(om_tet_mesh_boundary(&mesh, &boundary, NULL));
    double volume = om_surface_volume(&boundary);
    for (int k = 0; k < 3; ++k) {
        OmSurface s, again;
        int euler;
        assert_ok(om_contact_surface_make(&mesh, wanted[k], &s));
        assert_int_equal(s.ntri, wanted[k]);
        assert_ok(om_surface_check_closed(&s, &euler));
        assert_int_equal(euler, 2);
        // a chord's sagitta of area A: the edge of a coarse triangle off a sphere of 60 mm
        assert_near_rel(om_surface_volume(&s), volume, k == 0 ? 0.06 : 0.02);
        double min = INFINITY, max = 0;
        for (int t = 0; t < s.ntri; ++t) {
            const int* v = s.tri_vert + 3 * t;
            for (int c = 0; c < 3; ++c) {
                double e = om_distance(om_load3(s.x, v[c]), om_load3(s.x, v[(c + 1) % 3]));
                min = fmin(min, e);
                max = fmax(max, e);
            }
        }
        assert_below(max, 12 * min);
        assert_ok(om_contact_surface_make(&mesh, wanted[k], &again));
        assert_memory_equal(s.x, again.x, 3 * (size_t)s.nvert * sizeof *s.x);
        assert_memory_equal(s.tri_vert, again.tri_vert, 3 * (size_t)s.ntri * sizeof *s.tri_vert);
        om_surface_done(&s);
        om_surface_done(&again);
    }
    OmSurface none;
    assert_status(om_contact_surface_make(&mesh, 3, &none), OM_INVALID);
    om_surface_done(&boundary);
    om_tet_mesh_done(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shapes),  cmocka_unit_test(test_rounded_box),
        cmocka_unit_test(test_mesh),    cmocka_unit_test(test_input),
        cmocka_unit_test(test_surface),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
