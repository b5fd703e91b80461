// Isosurface stuffing: the guaranteed dihedral bounds, exact filling, convergence of the sphere's volume,
// the same mesh for any number of workers, one to the failure of every allocation.
#include "test_alloc.h"

#include "omentum/shape_meshing.h"

static double sphere_fn(void* ctx, OmVec3 p) { return om_norm(p) - *(const double*)ctx; }

// A sum of waves: every sign pattern a lattice tetrahedron can have, and every place of its crossings.
static double waves_fn(void* ctx, OmVec3 p) {
    const double* phase = ctx;
    double sum = phase[18];
    for (int i = 0; i < 6; i++) {
        const double* w = &phase[3 * i];
        sum += sin(w[0] * p.x + w[1] * p.y + w[2] * p.z + i);
    }
    return sum;
}

// Labelle & Shewchuk, table 1: 10.7843 and 164.726 degrees for these alphas; rounding allowed 1e-6.
static void check_bounds(const OmTetMesh* m) {
    OmMeshQuality q;
    assert_ok(om_tet_mesh_quality(m, &q));
    assert_true(q.dihedral_min * 180 / OM_PI > 10.78);
    assert_true(q.dihedral_max * 180 / OM_PI < 164.8);
}

static void test_sphere_converges(void** unused) {
    (void)unused;
    double r = 0.05, last = 1;
    for (int level = 0; level < 3; level++) {
        double edge = 0.016 / (1 << level);
        OmStuffDef def =
            om_stuff_default_def(edge, sphere_fn, &r, om_vec3(-r, -r, -r), om_vec3(r, r, r));
        OmTetMesh m;
        OmMeshQuality q;
        assert_ok(om_tet_mesh_stuff(&def, &m));
        assert_ok(om_tet_mesh_quality(&m, &q));
        double error = fabs(q.volume / (4.0 / 3 * OM_PI * r * r * r) - 1);
        printf(
            "edge %.1f mm: %d tets, volume error %.3f %%, dihedral %.2f-%.2f, mean edge %.2f mm\n",
            edge * 1e3, q.ntet, error * 100, q.dihedral_min * 180 / OM_PI,
            q.dihedral_max * 180 / OM_PI, q.edge_mean * 1e3);
        check_bounds(&m);
        assert_true(q.is_manifold);
        assert_int_equal(q.euler, 2);
        assert_int_equal(q.npart, 1);
        assert_below(error, 0.35 * last);          // second order: a quarter at each halving
        assert_near_rel(q.edge_mean, edge, 0.15);  // cut elements are smaller
        last = level ? error : error * 2;
        om_tet_mesh_done(&m);
    }
}

static void test_bounds_hold_for_any_function(void** unused) {
    (void)unused;
    double smallest = OM_PI, largest = 0;
    for (int sample = 0; sample < test_count(15, 25); sample++) {
        OmRng rng = om_rng_init(7, (uint64_t)sample);
        double phase[19];
        for (int i = 0; i < 18; i++) phase[i] = 4 * om_rng_normal(&rng);
        phase[18] = om_rng_normal(&rng);
        OmStuffDef def =
            om_stuff_default_def(0.11, waves_fn, phase, om_vec3(-1, -1, -1), om_vec3(1, 1, 1));
        OmTetMesh m;
        OmMeshQuality q;
        assert_ok(om_tet_mesh_stuff(&def, &m));
        assert_ok(om_tet_mesh_quality(&m, &q));
        smallest = fmin(smallest, q.dihedral_min);
        largest = fmax(largest, q.dihedral_max);
        // the faces between elements agree: the boundary of the elements holds all of their volume
        OmSurface s;
        assert_ok(om_tet_mesh_boundary(&m, &s, NULL));
        assert_near_rel(om_surface_volume(&s), q.volume, 1e-10);
        om_surface_done(&s);
        om_tet_mesh_done(&m);
    }
    printf("dihedral angles %.4f to %.4f degrees\n", smallest * 180 / OM_PI, largest * 180 / OM_PI);
    assert_true(smallest * 180 / OM_PI > 10.78);
    assert_true(largest * 180 / OM_PI < 164.8);
}

static void test_workers_do_not_matter(void** unused) {
    (void)unused;
    double r = 0.05;
    uint64_t first = 0;
    for (int nworker = 1; nworker <= 4; nworker++) {
        OmStuffDef def =
            om_stuff_default_def(0.006, sphere_fn, &r, om_vec3(-r, -r, -r), om_vec3(r, r, r));
        def.nworker = nworker;
        OmTetMesh m;
        assert_ok(om_tet_mesh_stuff(&def, &m));
        uint64_t hash = om_hash(m.x, (size_t)m.nvert * 24, OM_HASH_SEED);
        hash = om_hash(m.tet_vert, (size_t)m.ntet * 16, hash);
        if (nworker == 1) first = hash;
        assert_true(hash == first);
        om_tet_mesh_done(&m);
    }
}

// Two balls: parts are counted, the larger is kept, both on request; sets follow.
static double balls_fn(void* ctx, OmVec3 p) {
    (void)ctx;
    return fmin(om_distance(p, om_vec3(-1, 0, 0)) - 0.5, om_distance(p, om_vec3(0.8, 0, 0)) - 0.7);
}

static void test_parts(void** unused) {
    (void)unused;
    OmStuffDef def = om_stuff_default_def(0.2, balls_fn, NULL, om_vec3(-1.5, -0.7, -0.7),
                                          om_vec3(1.5, 0.7, 0.7));
    OmTetMesh m;
    int nkept, nfound;
    assert_ok(om_tet_mesh_stuff(&def, &m));
    int all = m.nvert;
    int* vert = om_alloc((size_t)all, sizeof *vert);
    for (int v = 0; v < all; v++) vert[v] = v;
    assert_ok(om_tet_mesh_add_set(&m, "all", vert, all));
    om_free(vert);
    assert_ok(om_tet_mesh_keep_parts(&m, 0.1, &nkept, &nfound));
    assert_int_equal(nkept, 2);
    assert_int_equal(m.nvert, all);
    assert_ok(om_tet_mesh_keep_parts(&m, 0, &nkept, &nfound));
    assert_int_equal(nkept, 1);
    assert_int_equal(nfound, 2);
    assert_ok(om_tet_mesh_validate(&m));
    assert_int_equal(m.set[0].nvert, m.nvert);
    for (int v = 0; v < m.nvert; v++) assert_true(m.x[3 * v] > 0);
    om_tet_mesh_done(&m);
}

// Fine points at one end of a ball, and in a rod thinner than an edge that sticks out of it.
static double rod_fn(void* ctx, OmVec3 p) {
    const double ball = sphere_fn(ctx, p);
    const double rod = fmax(hypot(p.y, p.z) - 0.003, fmax(-p.x, p.x - 0.08));
    return fmin(ball, rod);
}

static void test_finer_at_points(void** unused) {
    (void)unused;
    enum { NFINE = 36 };
    double r = 0.05, fine[3 * NFINE], fine_edge[NFINE];
    for (int i = 0; i < NFINE; i++) {
        om_store3(fine, i, om_vec3(0.045 + 0.001 * i, 0, 0));
        fine_edge[i] = 0.003;
    }
    OmStuffDef def =
        om_stuff_default_def(0.016, rod_fn, &r, om_vec3(-r, -r, -r), om_vec3(0.085, r, r));
    OmTetMesh coarse, m, again;
    OmMeshQuality q;
    assert_ok(om_tet_mesh_stuff(&def, &coarse));
    def.nfine = NFINE;
    def.fine = fine;
    def.fine_edge = fine_edge;
    def.nworker = 1;
    assert_ok(om_tet_mesh_stuff(&def, &m));
    def.nworker = 3;
    assert_ok(om_tet_mesh_stuff(&def, &again));
    assert_int_equal(again.ntet, m.ntet);
    assert_memory_equal(again.x, m.x, 3 * sizeof(double) * (size_t)m.nvert);
    assert_memory_equal(again.tet_vert, m.tet_vert, 4 * sizeof(int) * (size_t)m.ntet);
    assert_ok(om_tet_mesh_validate(&m));
    assert_ok(om_tet_mesh_quality(&m, &q));
    printf("%d tets, %d with fine points, angles %.1f to %.1f\n", coarse.ntet, m.ntet,
           q.dihedral_min * 180 / OM_PI, q.dihedral_max * 180 / OM_PI);
    assert_true(q.is_manifold);
    assert_int_equal(q.npart, 1);
    assert_int_equal(q.euler, 2);
    assert_true(q.dihedral_min * 180 / OM_PI > 10 && q.dihedral_max * 180 / OM_PI < 165);
    // the rod is there to its end, and no element in it or at the other end of the ball has the other's size
    const double most = pow(0.003 / 0.92344, 3) / 12, far = pow(0.016 / 0.92344, 3) / 12;
    double end = 0, largest = 0;
    for (int e = 0; e < m.ntet; e++) {
        const int* v = m.tet_vert + 4 * (size_t)e;
        const OmVec3 a = om_load3(m.x, v[0]), b = om_sub(om_load3(m.x, v[1]), a);
        const OmVec3 c = om_sub(om_load3(m.x, v[2]), a), d = om_sub(om_load3(m.x, v[3]), a);
        const double volume = om_dot(om_cross(b, c), d) / 6;
        for (int k = 0; k < 4; k++) end = fmax(end, m.x[3 * v[k]]);
        largest = fmax(largest, volume);
        if (a.x > 0.055 && a.x < 0.075) assert_below(volume, 1.3 * most);
    }
    assert_near(end, 0.08, 0.001);
    assert_true(largest > 0.8 * far);
    OmSurface s;
    assert_ok(om_tet_mesh_boundary(&m, &s, NULL));
    assert_near_rel(om_surface_volume(&s), q.volume, 1e-10);
    om_surface_done(&s);
    def.fine_edge = NULL;
    om_tet_mesh_done(&again);
    assert_status(om_tet_mesh_stuff(&def, &again), OM_INVALID);
    om_tet_mesh_done(&coarse);
    om_tet_mesh_done(&m);
}

static void test_bad_input(void** unused) {
    (void)unused;
    double r = 0.001;
    OmTetMesh m;
    OmStuffDef def = om_stuff_default_def(0, sphere_fn, &r, om_vec3(-1, -1, -1), om_vec3(1, 1, 1));
    assert_status(om_tet_mesh_stuff(&def, &m), OM_INVALID);
    def.edge = 0.3;
    r = -1;  // nothing inside
    assert_status(om_tet_mesh_stuff(&def, &m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "edge of 300 mm"));
    def.cookie = 0;
    assert_status(om_tet_mesh_stuff(&def, &m), OM_INVALID);
}

static void test_failing_allocations_leak_nothing(void** unused) {
    (void)unused;
    double r = 0.05;
    OmStuffDef def =
        om_stuff_default_def(0.02, sphere_fn, &r, om_vec3(-r, -r, -r), om_vec3(r, r, r));
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    const double fine[3] = {0.04, 0, 0}, fine_edge = 0.008;
    def.nfine = 1;
    def.fine = fine;
    def.fine_edge = &fine_edge;
    int64_t alive = om_alloc_alive();
    om_allocator_set(&failing);
    int nfail = 0;
    for (OmStatus status = OM_NO_MEMORY; status != OM_OK; nfail++) {
        OmTetMesh m;
        OmMeshQuality q;
        test_alloc_countdown = nfail;
        status = om_tet_mesh_stuff(&def, &m);
        if (status == OM_OK) status = om_tet_mesh_keep_parts(&m, 0, NULL, NULL);
        if (status == OM_OK) status = om_tet_mesh_quality(&m, &q);
        om_tet_mesh_done(&m);
        assert_true(status == OM_OK || status == OM_NO_MEMORY);
        assert_int_equal(om_alloc_alive(), alive);
    }
    om_allocator_set(NULL);
    assert_true(nfail > 20);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sphere_converges),
        cmocka_unit_test(test_bounds_hold_for_any_function),
        cmocka_unit_test(test_workers_do_not_matter),
        cmocka_unit_test(test_parts),
        cmocka_unit_test(test_finer_at_points),
        cmocka_unit_test(test_bad_input),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
