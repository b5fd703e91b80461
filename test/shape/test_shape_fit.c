// Fit of a mesh to a solid: topology against hand-made solids and against counts of cells, distances and lost places
// against geometry by hand, every allocation failing once.
#include "test_alloc.h"

#include "omentum/shape_fit.h"
#include "omentum/shape_meshing.h"

// ---- topology --------------------------------------------------------------------------------------------

static double torus_fn(void* ctx, OmVec3 p) {  // two rings side by side, 0.1 apart, around z
    (void)ctx;
    double best = 1;
    for (int side = -1; side <= 1; side += 2) {
        const double x = p.x - 0.75 * side, r = sqrt(x * x + p.y * p.y) - 0.5;
        best = fmin(best, sqrt(r * r + p.z * p.z) - 0.2);
    }
    return best;
}

static double hollow_fn(void* ctx, OmVec3 p) {
    (void)ctx;
    return fmax(om_norm(p) - 1, 0.6 - om_norm(p));
}

static OmTopology of_function(OmShapeFn fn, double half) {
    OmSdfDef def = om_sdf_default_def(0.06);
    OmSdf sdf;
    OmSurface s;
    OmTopology t;
    const OmVec3 hi = om_vec3(half, half, half);
    def.is_raw = true;
    assert_ok(om_sdf_from_function(fn, NULL, om_scale(-1, hi), hi, &def, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, &s));
    assert_ok(om_surface_topology(&s, &t));
    om_surface_done(&s);
    om_sdf_done(&sdf);
    return t;
}

static void assert_topology(const OmTopology* t, int npart, int nhandle, int ncavity) {
    assert_int_equal(t->npart, npart);
    assert_int_equal(t->nhandle, nhandle);
    assert_int_equal(t->ncavity, ncavity);
}

static void test_rings_and_hollows(void** unused) {
    (void)unused;
    OmTopology t = of_function(torus_fn, 1.6);
    assert_topology(&t, 2, 2, 0);
    assert_true(t.is_manifold);
    t = of_function(hollow_fn, 1.3);
    assert_topology(&t, 1, 0, 1);
}

// Two boxes of tetrahedra that share one edge: each triangle there has its partner through its own box.
static void test_boxes_that_touch_are_apart(void** unused) {
    (void)unused;
    OmTetMesh a, b, both;
    OmSurface s;
    OmTopology t;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1, &a));
    assert_ok(om_tet_mesh_box(om_vec3(1, 1, 0), om_vec3(2, 2, 1), 1, 1, 1, &b));
    assert_ok(om_tet_mesh_init(&both, 14, a.ntet + b.ntet));
    memcpy(both.x, a.x, 24 * sizeof(double));
    memcpy(both.tet_vert, a.tet_vert, 4 * sizeof(int) * (size_t)a.ntet);
    int map[8], n = 8;  // vertices 3 and 7 of the first box are 0 and 4 of the second
    for (int v = 0; v < 8; v++) {
        map[v] = v == 0 ? 3 : v == 4 ? 7 : n++;
        om_store3(both.x, map[v], om_load3(b.x, v));
    }
    for (int i = 0; i < 4 * b.ntet; i++) both.tet_vert[4 * a.ntet + i] = map[b.tet_vert[i]];
    assert_ok(om_tet_mesh_boundary(&both, &s, NULL));
    assert_ok(om_surface_topology(&s, &t));
    assert_topology(&t, 2, 0, 0);
    assert_false(t.is_manifold);
    s.ntri--;
    assert_int_equal(om_surface_topology(&s, &t), OM_INVALID);
    s.ntri++;
    om_surface_done(&s);
    om_tet_mesh_done(&a);
    om_tet_mesh_done(&b);
    om_tet_mesh_done(&both);
}

static void random_mask(uint64_t index, OmMask* m) {
    OmRng rng = om_rng_init(35, index);
    const int n[3] = {3 + (int)om_rng_below(&rng, 7), 3 + (int)om_rng_below(&rng, 7),
                      3 + (int)om_rng_below(&rng, 7)};
    const double share = om_rng_range(&rng, 0.1, 0.9);
    assert_ok(om_mask_init(m, n[0], n[1], n[2]));
    m->grid.axis = om_mat3_diag(om_vec3(index % 2 ? -2 : 2, 3, 1));  // left- and right-handed
    for (size_t i = 0; i < om_grid_count(m->grid.dim); i++)
        m->inside[i] = om_rng_uniform(&rng) < share;
}

// V - E + F - C of the voxels, the pairs that share a face, the squares and the cubes: connected over faces. Two
// outside voxels at opposite corners of a cube are not joined through its middle: the ring of the six others is
// filled, as by a disc.
static int count_euler(const OmMask* m) {
    const int* n = m->grid.dim;
    int euler = 0;
    for (int k = 0; k < n[2]; k++)
        for (int j = 0; j < n[1]; j++)
            for (int i = 0; i < n[0]; i++)
                for (int shape = 0; shape < 8; shape++) {
                    int layers = 0, inside = 0;  // bit c: corner c, where the cell has one
                    for (int c = 0; c < 8; c++) {
                        const int x = i + (c & 1), y = j + (c >> 1 & 1), z = k + (c >> 2);
                        if ((c & ~shape) == 0 && om_grid_has(n, x, y, z) &&
                            m->inside[om_grid_index(n, x, y, z)])
                            inside |= 1 << c;
                    }
                    for (int a = 0; a < 3; a++) layers += shape >> a & 1;
                    int corners = 0, all = 0;
                    for (int c = 0; c < 8; c++) all |= (c & ~shape) == 0 ? 1 << c : 0;
                    for (int c = 0; c < 8; c++) corners += inside >> c & 1;
                    if (inside == all) euler += layers % 2 ? -1 : 1;
                    // corners 0 and 7, 1 and 6, 2 and 5, 3 and 4 are opposite
                    const int out = 255 & ~inside;
                    if (shape == 7 && corners == 6 &&
                        (out == 129 || out == 66 || out == 36 || out == 24))
                        euler++;
                }
    return euler;
}

static void test_noise_has_the_topology_of_its_cells(void** unused) {
    (void)unused;
    int handles = 0, cavities = 0;
    for (int index = 0; index < test_count(60, 2000); index++) {
        OmMask m;
        OmSurface s;
        OmTopology t;
        int npart;
        random_mask((uint64_t)index, &m);
        assert_ok(om_mask_list_parts(&m, 6, NULL, 0, &npart));
        assert_ok(om_surface_from_mask(&m, &s));
        assert_ok(om_surface_topology(&s, &t));
        assert_int_equal(t.npart, npart);
        assert_int_equal(t.npart - t.nhandle + t.ncavity, count_euler(&m));
        handles += t.nhandle, cavities += t.ncavity;
        om_surface_done(&s);
        om_mask_done(&m);
    }
    printf("%d handles, %d cavities\n", handles, cavities);
    assert_true(handles > 100 && cavities > 4);
}

// ---- distances and places -----------------------------------------------------------------------------------

static double ball_fn(void* ctx, OmVec3 p) { return om_norm(p) - *(const double*)ctx; }

static OmSurface ball(double radius) {
    OmSdfDef def = om_sdf_default_def(0.05);
    OmSdf sdf;
    OmSurface s;
    const OmVec3 hi = om_vec3(1.2, 1.2, 1.2);
    def.is_raw = true;
    assert_ok(om_sdf_from_function(ball_fn, &radius, om_scale(-1, hi), hi, &def, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, &s));
    om_sdf_done(&sdf);
    return s;
}

static void test_balls_are_apart_by_their_radii(void** unused) {
    (void)unused;
    OmSurface large = ball(1), small = ball(0.7);
    OmSurfaceGap gap, again;
    assert_ok(om_surface_gap(&large, &small, 1, &gap));
    assert_near(gap.mean, 0.3, 2e-3);
    assert_near(gap.p95, 0.3, 3e-3);
    assert_true(gap.max >= gap.p95 && gap.max < 0.304);
    assert_near(om_norm(gap.where), 1, 2e-3);
    assert_ok(om_surface_gap(&large, &small, 3, &again));
    assert_memory_equal(&again, &gap, sizeof gap);
    large.ntri = 0;
    assert_int_equal(om_surface_gap(&large, &small, 1, &gap), OM_INVALID);
    om_surface_done(&large);
    om_surface_done(&small);
}

// A box of 10 x 10 x 10 voxels with a rod of 1 x 1 x 6 on it, and a box of tetrahedra of 10 x 10 x 9: the rod and a
// layer are missing; then a box of 10 x 10 x 12: two layers too much around the rod, which is missing above.
static OmMask box_with_rod(void) {
    OmMask m;
    assert_ok(om_mask_init(&m, 14, 14, 20));
    m.grid.axis = om_mat3_diag(om_vec3(1e-3, 1e-3, 1e-3));
    for (int k = 0; k < 18; k++)
        for (int j = 2; j < 12; j++)
            for (int i = 2; i < 12; i++)
                if ((k >= 2 && k < 12) || (k >= 12 && i == 5 && j == 5))
                    m.inside[om_grid_index(m.grid.dim, i, j, k)] = 1;
    return m;
}

static void measure_box(const OmMask* m, double top, double tolerance, OmShapeFit* fit,
                        OmShapeWrong* wrong) {
    OmTetMesh mesh;
    OmSurface s;
    assert_ok(om_tet_mesh_box(om_vec3(1.5e-3, 1.5e-3, 1.5e-3), om_vec3(11.5e-3, 11.5e-3, top), 4, 4,
                              4, &mesh));
    assert_ok(om_surface_from_mask(m, &s));
    assert_ok(om_shape_fit_measure(m, &s, &mesh, tolerance, 1, fit, wrong));
    om_surface_done(&s);
    om_tet_mesh_done(&mesh);
}

static void test_places_that_differ(void** unused) {
    (void)unused;
    OmMask m = box_with_rod();
    OmShapeFit fit;
    OmShapeWrong wrong;
    measure_box(&m, 10.5e-3, 2e-3, &fit, &wrong);
    assert_int_equal(fit.nloss, 1);
    assert_false(fit.loss[0].is_added);
    assert_near(fit.loss[0].volume, (100 + 6) * 1e-9, 1e-15);
    assert_near(fit.lost, fit.loss[0].volume, 1e-18);
    assert_near(fit.loss[0].depth, 6.5e-3, 1e-9);  // the top voxel of the rod
    assert_near(om_distance(fit.loss[0].where, om_vec3(5e-3, 5e-3, 17e-3)), 0, 1e-12);
    assert_int_equal(wrong.n, 5);  // of the rod, those more than 2 mm away
    assert_near(fit.to_mesh.max, 7e-3, 0.5e-3);
    om_shape_wrong_done(&wrong);
    measure_box(&m, 13.5e-3, 0.4e-3, &fit, NULL);
    assert_int_equal(fit.nloss, 2);
    assert_true(fit.loss[0].is_added && !fit.loss[1].is_added);
    assert_near(fit.added, 2 * 99e-9, 1e-15);
    assert_near(fit.lost, 4e-9, 1e-15);
    measure_box(&m, 11.5e-3, 10e-3, &fit, &wrong);  // deep enough for no place
    assert_int_equal(fit.nloss, 0);
    assert_int_equal(wrong.n, 0);
    assert_true(om_topology_is_equal(&fit.solid, &fit.mesh));
    om_mask_done(&m);
}

// A ring of voxels, and a box without a hole: no voxel is deep, and the hole's voxels change the topology.
static void test_a_hole_is_found(void** unused) {
    (void)unused;
    OmMask m;
    OmShapeFit fit;
    OmShapeWrong wrong;
    assert_ok(om_mask_init(&m, 14, 14, 14));
    m.grid.axis = om_mat3_diag(om_vec3(1e-3, 1e-3, 1e-3));
    for (int k = 2; k < 4; k++)
        for (int j = 2; j < 12; j++)
            for (int i = 2; i < 12; i++)
                m.inside[om_grid_index(m.grid.dim, i, j, k)] = i != 6 || j != 7;
    m.inside[om_grid_index(m.grid.dim, 3, 3, 4)] = 1;  // a bump changes nothing
    measure_box(&m, 3.5e-3, 5e-3, &fit, &wrong);
    assert_int_equal(fit.nloss, 0);
    assert_int_equal(fit.solid.nhandle, 1);
    assert_int_equal(fit.mesh.nhandle, 0);
    assert_int_equal(wrong.n, 2);
    for (int i = 0; i < 2; i++) {
        assert_near(om_load3(wrong.x, i).x, 6e-3, 1e-12);
        assert_near(om_load3(wrong.x, i).y, 7e-3, 1e-12);
    }
    om_shape_wrong_done(&wrong);
    om_mask_done(&m);
}

static OmStatus measure_once(void* ctx) {
    OmMask* m = ctx;
    OmTetMesh mesh = {0};
    OmSurface s = {0};
    OmShapeFit fit;
    OmShapeWrong wrong = {0};
    OmStatus status = om_tet_mesh_box(om_vec3(1.5e-3, 1.5e-3, 1.5e-3),
                                      om_vec3(11.5e-3, 11.5e-3, 11.5e-3), 2, 2, 2, &mesh);
    if (status == OM_OK) status = om_surface_from_mask(m, &s);
    if (status == OM_OK) status = om_shape_fit_measure(m, &s, &mesh, 1e-3, 1, &fit, &wrong);
    om_shape_wrong_done(&wrong);
    om_surface_done(&s);
    om_tet_mesh_done(&mesh);
    return status;
}

static void test_memory_runs_out(void** unused) {
    (void)unused;
    OmMask m = box_with_rod();
    assert_true(test_failing_allocations(measure_once, &m, 1) > 10);
    om_mask_done(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rings_and_hollows),
        cmocka_unit_test(test_boxes_that_touch_are_apart),
        cmocka_unit_test(test_noise_has_the_topology_of_its_cells),
        cmocka_unit_test(test_balls_are_apart_by_their_radii),
        cmocka_unit_test(test_places_that_differ),
        cmocka_unit_test(test_a_hole_is_found),
        cmocka_unit_test(test_memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
