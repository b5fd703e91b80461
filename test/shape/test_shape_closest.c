// test_shape_closest.c: the nearest point on triangles, against all triangles and against a fine search.
#include "omentum/shape_closest.h"
#include "test_alloc.h"

static OmVec3 random_point(OmRng* rng, double lo, double hi) {
    double x = om_rng_range(rng, lo, hi), y = om_rng_range(rng, lo, hi);
    return om_vec3(x, y, om_rng_range(rng, lo, hi));
}

// The point that a triangle's barycentric lattice of n steps has nearest: no shared formula with the library.
static double search_triangle(OmVec3 p, const OmVec3 v[3], int n) {
    double best = INFINITY;
    for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j) {
            double a = (double)i / n, b = (double)j / n;
            OmVec3 q = om_madd(om_madd(om_scale(a, v[0]), b, v[1]), 1 - a - b, v[2]);
            best = fmin(best, om_distance(p, q));
        }
    return best;
}

static void test_one_triangle(void** state) {
    (void)state;
    OmRng rng = om_rng_init(1, 0);
    for (int k = 0; k < 300; ++k) {
        OmVec3 v[3], p = random_point(&rng, -1, 2);
        for (int c = 0; c < 3; ++c) v[c] = random_point(&rng, 0, 1);
        if (k % 5 == 3) v[2] = om_lerp(v[0], v[1], 0.3);  // flat
        if (k % 5 == 4) v[1] = v[2] = v[0];               // a point
        double bary[3];
        OmVec3 q = om_triangle_closest(p, v[0], v[1], v[2], bary);
        double slow = search_triangle(p, v, 60);
        assert_true(om_distance(p, q) <= slow + 1e-12);
        assert_near(om_distance(p, q), slow, 0.02);  // half a step of the lattice, sqrt(3) / 120
        OmVec3 sum = om_madd(om_madd(om_scale(bary[0], v[0]), bary[1], v[1]), bary[2], v[2]);
        assert_near(om_distance(sum, q), 0, 1e-12);
        assert_near(bary[0] + bary[1] + bary[2], 1, 1e-12);
        for (int c = 0; c < 3; ++c) assert_true(bary[c] >= -1e-12 && bary[c] <= 1 + 1e-12);
    }
}

static void make_soup(int kind, OmSurface* s, OmRng* rng) {
    for (int t = 0; t < s->ntri; ++t) {
        OmVec3 at = kind == 1 ? om_vec3(0, 0, 0) : random_point(rng, 0, 1);
        if (kind == 2) at.x = at.y = 0;
        for (int c = 0; c < 3; ++c) {
            om_store3(s->x, 3 * t + c, om_add(at, random_point(rng, 0, 0.1)));
            s->tri_vert[3 * t + c] = 3 * t + c;
        }
    }
    if (kind == 1 && s->ntri > 1) memcpy(s->x, s->x + 9, 9 * sizeof *s->x);  // equally near
}

static int find_slowly(const OmSurface* s, OmVec3 p, const unsigned char* use, double* distance) {
    int best = -1;
    *distance = INFINITY;
    for (int t = 0; t < s->ntri; ++t) {
        if (use && !use[t]) continue;
        OmVec3 q = om_triangle_closest(p, om_load3(s->x, 3 * t), om_load3(s->x, 3 * t + 1),
                                       om_load3(s->x, 3 * t + 2), NULL);
        if (om_distance(p, q) < *distance) *distance = om_distance(p, q), best = t;
    }
    return best;
}

static void check_queries(const OmSurface* s, const OmSurfaceTree* tree, OmRng* rng) {
    unsigned char use[1000];
    for (int t = 0; t < s->ntri; ++t) use[t] = om_rng_below(rng, 3) == 0;
    for (int k = 0; k < 200; ++k) {
        OmVec3 p = random_point(rng, -0.5, 1.5);
        const unsigned char* chosen = k % 2 ? use : NULL;
        double distance;
        int slow = find_slowly(s, p, chosen, &distance);
        OmSurfacePoint q = {.tri = -7};
        assert_int_equal(om_surface_tree_find(tree, p, chosen, INFINITY, &q), slow >= 0);
        if (slow < 0) {
            assert_int_equal(q.tri, -7);
            continue;
        }
        assert_int_equal(q.tri, slow);
        assert_near(q.distance, distance, 1e-15);
        assert_near(om_distance(q.x, p), distance, 1e-15);
        assert_true(om_surface_tree_find(tree, p, chosen, distance * 1.0001, NULL));
        assert_false(om_surface_tree_find(tree, p, chosen, distance * 0.9999, &q));
    }
}

// A facing query is one with the other triangles out of use.
static void check_facing(const OmSurface* s, const OmSurfaceTree* tree, OmRng* rng) {
    unsigned char use[1000];
    for (int k = 0; k < 100; ++k) {
        OmVec3 p = random_point(rng, -0.5, 1.5), normal = om_normalize(random_point(rng, -1, 1));
        double min_cosine = om_rng_range(rng, -1, 1), distance;
        for (int t = 0; t < s->ntri; ++t) {
            OmVec3 a = om_load3(s->x, 3 * t), b = om_load3(s->x, 3 * t + 1);
            OmVec3 n = om_cross(om_sub(b, a), om_sub(om_load3(s->x, 3 * t + 2), a));
            use[t] = om_dot(om_normalize(n), normal) > min_cosine;
        }
        int slow = find_slowly(s, p, use, &distance);
        OmSurfacePoint q = {.tri = -1};
        bool is_found =
            om_surface_tree_find_facing(tree, p, normal, min_cosine, NULL, INFINITY, &q);
        assert_int_equal(is_found, slow >= 0);
        assert_int_equal(q.tri, slow);
        if (slow >= 0) assert_near(q.distance, distance, 1e-15);
    }
}

static void test_against_all_triangles(void** state) {
    (void)state;
    static const int size[] = {1, 2, 4, 5, 9, 1000};
    for (int kind = 0; kind < 3; ++kind)
        for (size_t k = 0; k < sizeof size / sizeof *size; ++k) {
            OmRng rng = om_rng_init(2, (uint64_t)(10 * kind) + k);
            OmSurface s;
            OmSurfaceTree* tree;
            assert_ok(om_surface_init(&s, 3 * size[k], size[k]));
            make_soup(kind, &s, &rng);
            assert_ok(om_surface_tree_create(&s, &tree));
            check_queries(&s, tree, &rng);
            check_facing(&s, tree, &rng);
            make_soup(2 - kind, &s, &rng);  // triangles go elsewhere
            om_surface_tree_move(tree, s.x);
            check_queries(&s, tree, &rng);
            om_surface_tree_destroy(tree);
            om_surface_done(&s);
        }
}

static OmStatus make_tree(void* ctx) {
    OmSurfaceTree* tree;
    OM_TRY(om_surface_tree_create(ctx, &tree));
    om_surface_tree_destroy(tree);
    return OM_OK;
}

static void test_bad_input_and_memory(void** state) {
    (void)state;
    OmRng rng = om_rng_init(3, 0);
    OmSurface s;
    assert_ok(om_surface_init(&s, 30, 10));
    make_soup(0, &s, &rng);
    assert_int_equal(test_failing_allocations(make_tree, &s, 1), 6);
    OmSurfaceTree* tree;
    s.tri_vert[7] = 30;
    assert_status(om_surface_tree_create(&s, &tree), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "triangle 2"));
    s.tri_vert[7] = 7;
    s.x[5] = NAN;
    assert_status(om_surface_tree_create(&s, &tree), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertex 1"));
    assert_null(tree);
    s.ntri = 0;
    assert_status(om_surface_tree_create(&s, &tree), OM_INVALID);
    om_surface_done(&s);
    om_surface_tree_destroy(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_triangle),
        cmocka_unit_test(test_against_all_triangles),
        cmocka_unit_test(test_bad_input_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
