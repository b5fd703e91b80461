// test_shape_points.c: the nearest of many points, against looking at all of them.
#include "omentum/shape_points.h"
#include "test_alloc.h"

static int find_slowly(int n, const double* x, OmVec3 p) {
    int best = 0;
    for (int i = 1; i < n; ++i)
        if (om_norm2(om_sub(om_load3(x, i), p)) < om_norm2(om_sub(om_load3(x, best), p))) best = i;
    return best;
}

// Points at random, on a coarse lattice (many equally near), on a line, and all in one place.
static void make_points(int kind, int n, double* x) {
    OmRng rng = om_rng_init(1, (uint64_t)kind);
    for (int i = 0; i < 3 * n; ++i) {
        double u = om_rng_uniform(&rng);
        x[i] = kind == 0   ? u
               : kind == 1 ? floor(4 * u)
               : kind == 2 ? (i % 3 == 1) * floor(9 * u)
                           : 0.5;
    }
}

// The list in order, by looking at all points once for each place of the list.
static void check_many(const OmPointTree* tree, int n, const double* x, OmVec3 p, int num) {
    int index[OM_MAX_NEAREST], found = om_point_tree_find_many(tree, p, num, index);
    assert_int_equal(found, num < n ? num : n);
    double last = -1;
    for (int k = 0; k < found; ++k) {
        int best = -1;
        for (int i = 0; i < n; ++i) {
            double d = om_norm2(om_sub(om_load3(x, i), p));
            if (d < last || (d == last && k > 0 && i <= index[k - 1])) continue;
            if (best < 0 || d < om_norm2(om_sub(om_load3(x, best), p))) best = i;
        }
        assert_int_equal(index[k], best);
        last = om_norm2(om_sub(om_load3(x, best), p));
    }
}

static void test_every_point_is_found(void** state) {
    (void)state;
    static const int size[] = {1, 2, 8, 9, 17, 1000};
    double x[3000];
    for (int kind = 0; kind < 4; ++kind) {
        for (size_t k = 0; k < sizeof size / sizeof *size; ++k) {
            make_points(kind, size[k], x);
            OmPointTree* tree;
            assert_ok(om_point_tree_create(size[k], x, &tree));
            OmRng rng = om_rng_init(2, (uint64_t)kind);
            for (int q = 0; q < 500; ++q) {
                OmVec3 p = om_vec3(om_rng_range(&rng, -1, 5), om_rng_range(&rng, -1, 5),
                                   floor(5 * om_rng_uniform(&rng)));
                double d;
                int i = om_point_tree_find(tree, p, &d);
                assert_int_equal(i, find_slowly(size[k], x, p));
                assert_true(d == om_distance(om_load3(x, i), p));
                check_many(tree, size[k], x, p, q % 12 + 1);
            }
            om_point_tree_destroy(tree);
        }
    }
}

static OmStatus make_tree(void* ctx) {
    OmPointTree* tree;
    OM_TRY(om_point_tree_create(100, ctx, &tree));
    om_point_tree_destroy(tree);
    return OM_OK;
}

static void test_bad_input_and_memory(void** state) {
    (void)state;
    double x[300];
    make_points(0, 100, x);
    assert_int_equal(test_failing_allocations(make_tree, x, 1), 4);
    OmPointTree* tree;
    assert_status(om_point_tree_create(0, x, &tree), OM_INVALID);
    x[7] = NAN;
    assert_status(om_point_tree_create(100, x, &tree), OM_INVALID);
    assert_null(tree);
    assert_non_null(strstr(om_error_message(), "point 2"));
    om_point_tree_destroy(NULL);
}

// A cross in the plane z = 2: one arm along (1, 1, 0), a shorter one across, sums of squares 2 * 2 and 2 * 0.5. Two
// other points are not taken.
static void test_axes(void** state) {
    (void)state;
    const double x[] = {9, 9, 9, 2, 1, 2, 0, -1, 2, 1.5, -0.5, 2, 0.5, 0.5, 2, -7, 0, 3};
    const int point[] = {1, 2, 3, 4};
    OmVec3 mean, spread;
    const OmMat3 axes = om_points_axes(x, 4, point, &mean, &spread);
    assert_near(om_distance(mean, om_vec3(1, 0, 2)), 0, 1e-12);
    assert_near(spread.x, 0, 1e-12);
    assert_near(spread.y, 1, 1e-12);
    assert_near(spread.z, 4, 1e-12);
    assert_near(fabs(axes.cx.z), 1, 1e-12);
    assert_near(fabs(om_dot(axes.cz, om_vec3(sqrt(0.5), sqrt(0.5), 0))), 1, 1e-12);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_point_is_found),
        cmocka_unit_test(test_axes),
        cmocka_unit_test(test_bad_input_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
