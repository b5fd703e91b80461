// Random patches of thesis eq. 4.1, geodesics, noise, samples.
#include "test_common.h"

#include "omentum/shape_meshing.h"

static void make_plate(OmSurface* s, int** vert) {
    OmTetMesh m;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.12, 0.12, 0.005), 24, 24, 1, &m));
    assert_ok(om_tet_mesh_boundary(&m, s, vert));
    om_tet_mesh_done(&m);
}

// Along a row of edges the geodesic is the distance; elsewhere it is longer, at most by the detour of edges.
static void test_geodesic_on_a_plate(void** unused) {
    (void)unused;
    OmSurface s;
    make_plate(&s, NULL);
    double* d = om_alloc((size_t)s.nvert, sizeof *d);
    assert_ok(om_surface_geodesic(&s, 0, d));
    for (int v = 0; v < s.nvert; v++) {
        OmVec3 x = om_load3(s.x, v);
        double straight = om_norm(x);
        assert_true(d[v] >= straight - 1e-12);
        if (x.z > 0) continue;
        if (x.y == 0) assert_near(d[v], x.x, 1e-12);
        assert_true(d[v] <= 1.4143 * straight + 1e-12);
    }
    om_free(d);
    om_surface_done(&s);
}

static void test_patch_has_its_share_and_its_side(void** unused) {
    (void)unused;
    OmSurface s;
    make_plate(&s, NULL);
    int* below = om_alloc((size_t)s.nvert, sizeof *below);
    int nbelow = 0;
    for (int v = 0; v < s.nvert; v++) {
        if (s.x[3 * v + 2] == 0) below[nbelow++] = v;
    }
    assert_int_equal(nbelow, 25 * 25);
    for (int seed = 1; seed <= 17; seed++) {
        OmPatchDef def = om_patch_default_def(0.3, (uint64_t)seed);
        int *vert, *again, n, m;
        assert_ok(om_surface_random_patch(&s, below, nbelow, &def, &vert, &n));
        assert_int_equal(n, (int)(0.3 * nbelow + 0.5));
        for (int i = 0; i < n; i++) assert_true(s.x[3 * vert[i] + 2] == 0);
        for (int i = 1; i < n; i++) assert_true(vert[i] > vert[i - 1]);
        OmPatchDef borrowing = def;  // normals that the caller has give the same patch
        double* normal = om_alloc(3 * (size_t)s.nvert, sizeof *normal);
        om_surface_normals(&s, normal);
        borrowing.normal = normal;
        assert_ok(om_surface_random_patch(&s, below, nbelow, &borrowing, &again, &m));
        om_free(normal);
        assert_memory_equal(vert, again, (size_t)n * sizeof(int));
        om_free(vert);
        om_free(again);
    }
    // without candidates the angle keeps most of the patch on the side of its centre
    OmPatchDef def = om_patch_default_def(0.3, 3);
    int *vert, n, nsame = 0;
    def.center = below[300];
    assert_ok(om_surface_random_patch(&s, NULL, 0, &def, &vert, &n));
    for (int i = 0; i < n; i++) nsame += s.x[3 * vert[i] + 2] == 0;
    assert_true(nsame > 0.9 * n);
    om_free(vert);
    def.share = 1.5;
    assert_status(om_surface_random_patch(&s, NULL, 0, &def, &vert, &n), OM_INVALID);
    om_free(below);
    om_surface_done(&s);
}

// Gradient noise vanishes on the lattice, is bounded and smooth, and differs between seeds.
static void test_noise(void** unused) {
    (void)unused;
    double lo = 1, hi = -1;
    for (int i = 0; i < 2000; i++) {
        OmRng rng = om_rng_init(1, (uint64_t)i);
        OmVec3 p = om_vec3(om_rng_range(&rng, -9, 9), om_rng_range(&rng, -9, 9),
                           om_rng_range(&rng, -9, 9));
        double a = om_noise_perlin(p, 5), b = om_noise_perlin(om_vec3(p.x + 1e-6, p.y, p.z), 5);
        assert_true(fabs(a - b) < 1e-5);
        lo = fmin(lo, a);
        hi = fmax(hi, a);
    }
    assert_true(lo < -0.5 && hi > 0.5 && lo >= -1 && hi <= 1);
    assert_near(om_noise_perlin(om_vec3(3, -2, 7), 5), 0, 1e-15);
    assert_true(om_noise_perlin(om_vec3(0.3, 0.4, 0.5), 5) !=
                om_noise_perlin(om_vec3(0.3, 0.4, 0.5), 6));
}

// Systematic sampling: half the area gets half the points, within one.
static void test_samples_follow_the_area(void** unused) {
    (void)unused;
    OmSurface s;
    make_plate(&s, NULL);
    enum { N = 1000 };
    static double point[3 * N], normal[3 * N];
    OmRng rng = om_rng_init(2, 0);
    assert_ok(om_surface_sample(&s, NULL, N, &rng, point, normal));
    int nbelow = 0;
    for (int i = 0; i < N; i++) {
        nbelow += normal[3 * i + 2] < -0.5;
        assert_near(om_norm(om_load3(normal, i)), 1, 1e-12);
    }
    double area = 2 * 0.12 * 0.12 + 4 * 0.12 * 0.005;
    assert_near(nbelow, N * 0.12 * 0.12 / area, 60);  // interleaved runs of triangles, one a run
    om_surface_done(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_geodesic_on_a_plate),
        cmocka_unit_test(test_patch_has_its_share_and_its_side),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_samples_follow_the_area),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
