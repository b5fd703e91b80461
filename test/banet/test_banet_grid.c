// test_banet_grid.c: the frame of a body, distances and displacements in its cells.
#include <string.h>

#include "omentum/banet_grid.h"
#include "omentum/shape_meshing.h"
#include "test_alloc.h"

#define SIDE 0.3
#define VOXEL (SIDE / 64)

// A sheet of 150 x 90 x 9 mm, its edges about one voxel. With `taper` it is wider and thicker towards +x, longer
// towards +y.
static OmSurface make_sheet(double taper, OmPose pose) {
    OmTetMesh mesh;
    OmSurface s;
    assert_ok(om_tet_mesh_box(om_vec3(-0.075, -0.045, -0.0045), om_vec3(0.075, 0.045, 0.0045), 32,
                              19, 2, &mesh));
    for (int i = 0; i < mesh.nvert; ++i) {
        OmVec3 x = om_load3(mesh.x, i);
        double f = 1 + taper * x.x / 0.075, e = 1 + taper * x.y / 0.045;
        x = om_vec3(x.x * e, x.y * f, x.z * f);
        om_store3(mesh.x, i, om_pose_apply(pose, x));
    }
    assert_ok(om_tet_mesh_boundary(&mesh, &s, NULL));
    om_tet_mesh_done(&mesh);
    return s;
}

static OmPose random_pose(OmRng* rng) {
    OmVec3 axis = om_vec3(om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng));
    OmVec3 p = om_vec3(om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng));
    return (OmPose){p, om_quat_axis_angle(om_normalize(axis), om_rng_range(rng, 0, 6))};
}

static void test_frame(void** state) {
    (void)state;
    OmRng rng = om_rng_init(5, 0);
    for (int pass = 0; pass < 5; ++pass) {
        OmPose pose = pass == 0 ? om_pose_identity() : random_pose(&rng);
        OmSurface s = make_sheet(0, pose);
        OmBanetGrid g;
        assert_ok(om_banet_grid_fit(&s, SIDE, &g));
        // 150 / 4.6875 + 5 = 37, 90 / 4.6875 + 5 = 24.2, 9 / 4.6875 + 5 = 6.92
        assert_int_equal(g.dim[0], 48);
        assert_int_equal(g.dim[1], 32);
        assert_int_equal(g.dim[2], 16);
        assert_near(g.voxel, VOXEL, 1e-15);
        OmVec3 lo = om_vec3(1e9, 1e9, 1e9), hi = om_scale(-1, lo);
        for (int i = 0; i < s.nvert; ++i) {
            OmVec3 p = om_banet_grid_local(&g, om_load3(s.x, i));
            OmVec3 back = om_pose_apply(g.pose_world_grid, om_scale(VOXEL, p));
            assert_near(om_distance(back, om_load3(s.x, i)), 0, 1e-12);
            lo = om_min3(lo, p);
            hi = om_max3(hi, p);
        }
        assert_near(hi.x - lo.x, 0.150 / VOXEL, 1e-9);
        assert_near(hi.y - lo.y, 0.090 / VOXEL, 1e-9);
        assert_near(hi.z - lo.z, 0.009 / VOXEL, 1e-9);
        assert_near(om_distance(om_lerp(lo, hi, 0.5), om_vec3(23.5, 15.5, 7.5)), 0, 1e-9);
        om_surface_done(&s);
    }
}

// Two free cells on every side, where one cell less would be a smaller grid.
static void test_margin(void** state) {
    (void)state;
    const double length[] = {11.1, 10.9, 27.1};
    const int dim[] = {32, 16, 48};
    OmRng rng = om_rng_init(9, 0);
    for (int k = 0; k < 3; ++k) {
        OmTetMesh mesh;
        OmSurface s;
        OmBanetGrid g;
        const OmPose pose = random_pose(&rng);
        assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0),
                                  om_scale(VOXEL, om_vec3(length[k], 0.9 * length[k], 3)), 8, 8, 1,
                                  &mesh));
        for (int i = 0; i < mesh.nvert; ++i)
            om_store3(mesh.x, i, om_pose_apply(pose, om_load3(mesh.x, i)));
        assert_ok(om_tet_mesh_boundary(&mesh, &s, NULL));
        assert_ok(om_banet_grid_fit(&s, SIDE, &g));
        assert_int_equal(g.dim[0], dim[k]);
        for (int i = 0; i < s.nvert; ++i) {
            OmVec3 p = om_banet_grid_local(&g, om_load3(s.x, i));
            assert_true(fmin(p.x, fmin(p.y, p.z)) >= 1.5);
            assert_true(p.x <= g.dim[0] - 2.5 && p.y <= g.dim[1] - 2.5 && p.z <= g.dim[2] - 2.5);
        }
        om_surface_done(&s);
        om_tet_mesh_done(&mesh);
    }
}

// A body without symmetry has the same cells however it lies in space.
static void test_frame_follows(void** state) {
    (void)state;
    OmRng rng = om_rng_init(6, 0);
    OmSurface rest = make_sheet(0.2, om_pose_identity());
    OmBanetGrid g, h;
    assert_ok(om_banet_grid_fit(&rest, SIDE, &g));
    // the tails are at -x and -y
    assert_true(om_quat_rotate(g.pose_world_grid.q, om_vec3(1, 0, 0)).x < -0.9);
    assert_true(om_quat_rotate(g.pose_world_grid.q, om_vec3(0, 1, 0)).y < -0.9);
    for (int pass = 0; pass < 5; ++pass) {
        OmSurface s = make_sheet(0.2, random_pose(&rng));
        assert_ok(om_banet_grid_fit(&s, SIDE, &h));
        assert_memory_equal(g.dim, h.dim, sizeof g.dim);
        for (int i = 0; i < s.nvert; ++i)
            assert_near(om_distance(om_banet_grid_local(&g, om_load3(rest.x, i)),
                                    om_banet_grid_local(&h, om_load3(s.x, i))),
                        0, 1e-8);
        om_surface_done(&s);
    }
    om_surface_done(&rest);
}

typedef struct Case {  // a sheet, its grid and arrays
    OmSurface s;
    OmBanetGrid g;
    size_t ncell;
    double *u, *seen;
    float* in;
    OmQuat q;  // from the sheet's own axes to the world
} Case;

static Case make_case(void) {
    OmRng rng = om_rng_init(7, 0);
    OmPose pose = random_pose(&rng);
    Case c = {.s = make_sheet(0, pose), .q = pose.q};
    assert_ok(om_banet_grid_fit(&c.s, SIDE, &c.g));
    c.ncell = om_grid_count(c.g.dim);
    c.u = om_calloc((size_t)c.s.nvert, 3 * sizeof *c.u);
    c.seen = om_calloc((size_t)c.s.nvert, sizeof *c.seen);
    c.in = om_alloc(OM_BANET_NCHANNEL * c.ncell, sizeof *c.in);
    return c;
}

static void case_done(Case* c) {
    om_surface_done(&c->s);
    om_free(c->u);
    om_free(c->seen);
    om_free(c->in);
}

// Exact distance to the box, in voxels; `p` in cells.
static double box_distance(OmVec3 p) {
    double x = fabs(p.x - 23.5) - 0.075 / VOXEL, y = fabs(p.y - 15.5) - 0.045 / VOXEL,
           z = fabs(p.z - 7.5) - 0.0045 / VOXEL;
    return om_norm(om_vec3(fmax(x, 0), fmax(y, 0), fmax(z, 0))) + fmin(0, fmax(x, fmax(y, z)));
}

static void test_distance(void** state) {
    (void)state;
    Case c = make_case();
    assert_ok(om_banet_voxelize(&c.g, &c.s, c.u, c.seen, c.in));
    for (size_t n = 0; n < c.ncell; ++n) {
        int at[3];
        om_grid_unpack(c.g.dim, n, at);
        double d = box_distance(om_vec3(at[0], at[1], at[2]));
        assert_near(c.in[n], fmax(-2, fmin(2, d)), 1e-5);
        for (size_t k = 1; k < OM_BANET_NCHANNEL; ++k) assert_true(c.in[k * c.ncell + n] == 0);
    }
    case_done(&c);
}

// One displacement for all vertices with x < 23.5 cells, of which all are seen; the others move elsewhere, unseen.
static void test_displacement(void** state) {
    (void)state;
    Case c = make_case();
    OmVec3 u = om_vec3(0.012, -0.03, 0.007);
    for (int i = 0; i < c.s.nvert; ++i) {
        c.seen[i] = om_banet_grid_local(&c.g, om_load3(c.s.x, i)).x < 23.5;
        om_store3(c.u, i, c.seen[i] > 0 ? u : om_vec3(1, 1, 1));
    }
    assert_ok(om_banet_voxelize(&c.g, &c.s, c.u, c.seen, c.in));
    OmVec3 local = om_scale(1 / VOXEL, om_quat_rotate(om_quat_conj(c.g.pose_world_grid.q), u));
    int nseen = 0, nunseen = 0;
    for (size_t n = 0; n < c.ncell; ++n) {
        int at[3];
        om_grid_unpack(c.g.dim, n, at);
        const float* v = c.in + n;
        double d = box_distance(om_vec3(at[0], at[1], at[2])), seen = (double)v[4 * c.ncell];
        OmVec3 have = om_vec3(v[c.ncell], v[2 * c.ncell], v[3 * c.ncell]);
        bool is_near = fabs(d) < 1 - 1e-4;
        if (is_near && at[0] < 22) assert_true(seen == 1);  // no holes
        if (seen > 0) assert_near(om_distance(have, local), 0, 1e-5);
        if (seen == 0) assert_true(om_norm(have) == 0);
        if (fabs(d) > 1 + 1e-4 || at[0] > 25) assert_true(seen == 0);
        nseen += seen > 0, nunseen += is_near && seen == 0;
    }
    assert_true(nseen > 1000 && nunseen > 1000);
    case_done(&c);
}

// A cell against sums over all vertices, in the order of the formula.
static void test_weights(void** state) {
    (void)state;
    Case c = make_case();
    OmRng rng = om_rng_init(8, 0);
    for (int i = 0; i < c.s.nvert; ++i) {
        c.seen[i] = om_rng_uniform(&rng) < 0.5 ? 0 : om_rng_uniform(&rng);
        for (int k = 0; k < 3; ++k) c.u[3 * i + k] = 0.01 * om_rng_normal(&rng);
    }
    assert_ok(om_banet_voxelize(&c.g, &c.s, c.u, c.seen, c.in));
    int ntested = 0;
    for (size_t n = 0; n < c.ncell; ++n) {
        int at[3];
        om_grid_unpack(c.g.dim, n, at);
        OmVec3 p = om_vec3(at[0], at[1], at[2]), sum = om_vec3(0, 0, 0);
        if (fabs(fabs(box_distance(p)) - 1) < 1e-3) continue;
        double all = 0, seen = 0;
        for (int i = 0; i < c.s.nvert && fabs(box_distance(p)) < 1; ++i) {
            double r = om_distance(p, om_banet_grid_local(&c.g, om_load3(c.s.x, i)));
            double w = r > 2 ? 0 : exp(-0.5 * r * r / (0.6 * 0.6));
            all += w;
            seen += w * c.seen[i];
            sum = om_madd(sum, w * c.seen[i], om_load3(c.u, i));
        }
        bool is_seen = seen > 0.01 * all;
        OmVec3 u = om_scale(is_seen ? 1 / seen / VOXEL : 0, sum);
        u = om_quat_rotate(om_quat_conj(c.g.pose_world_grid.q), u);
        assert_near(c.in[c.ncell + n], u.x, 1e-5);
        assert_near(c.in[2 * c.ncell + n], u.y, 1e-5);
        assert_near(c.in[3 * c.ncell + n], u.z, 1e-5);
        assert_near(c.in[4 * c.ncell + n], is_seen ? seen / all : 0, 1e-5);
        ntested += is_seen;
    }
    assert_true(ntested > 2000);
    case_done(&c);
}

static void test_cells(void** state) {
    (void)state;
    Case c = make_case();
    int* cell = om_alloc((size_t)c.s.nvert, sizeof *cell);
    om_banet_find_cells(&c.g, &c.s, cell);
    for (int i = 0; i < c.s.nvert; ++i) {
        int at[3];
        om_grid_unpack(c.g.dim, (size_t)cell[i], at);
        OmVec3 d =
            om_sub(om_banet_grid_local(&c.g, om_load3(c.s.x, i)), om_vec3(at[0], at[1], at[2]));
        assert_true(fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z))) <= 0.5 + 1e-9);
    }
    om_store3(c.s.x, 0, om_vec3(1e30, 0, 0));
    om_banet_find_cells(&c.g, &c.s, cell);
    assert_int_equal(cell[0], -1);
    om_free(cell);
    case_done(&c);
}

// A membrane of 1 mm between two layers of cells encloses no centre of a cell, and is no error.
static void test_thin(void** state) {
    (void)state;
    OmTetMesh mesh;
    OmSurface s;
    OmBanetGrid g;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.1, 0.05, 0.001), 20, 10, 1, &mesh));
    assert_ok(om_tet_mesh_boundary(&mesh, &s, NULL));
    assert_ok(om_banet_grid_fit(&s, SIDE, &g));
    size_t ncell = om_grid_count(g.dim);
    double* zero = om_calloc(3 * (size_t)s.nvert, sizeof *zero);
    float* in = om_alloc(OM_BANET_NCHANNEL * ncell, sizeof *in);
    assert_ok(om_banet_voxelize(&g, &s, zero, zero, in));
    float low = 2;
    for (size_t n = 0; n < ncell; ++n) low = fminf(low, in[n]);
    assert_near(low, 0.5 - 0.5 * 0.001 / VOXEL, 1e-5);
    om_free(zero);
    om_free(in);
    om_surface_done(&s);
    om_tet_mesh_done(&mesh);
}

static void test_refused(void** state) {
    (void)state;
    Case c = make_case();
    OmBanetGrid g;
    assert_status(om_banet_grid_fit(&c.s, 0, &g), OM_INVALID);
    assert_status(om_banet_grid_fit(&c.s, 0.001, &g), OM_INVALID);  // 2^24 cells and more
    c.seen[3] = 1.5;
    assert_status(om_banet_voxelize(&c.g, &c.s, c.u, c.seen, c.in), OM_INVALID);
    c.seen[3] = (double)NAN;
    assert_status(om_banet_voxelize(&c.g, &c.s, c.u, c.seen, c.in), OM_INVALID);
    c.seen[3] = 0;
    c.u[3] = (double)INFINITY;
    assert_status(om_banet_voxelize(&c.g, &c.s, c.u, c.seen, c.in), OM_INVALID);
    c.u[3] = 0;
    g = c.g;
    g.pose_world_grid.p.x += 0.5;  // elsewhere
    assert_status(om_banet_voxelize(&g, &c.s, c.u, c.seen, c.in), OM_INVALID);
    c.s.x[5] = (double)NAN;
    assert_status(om_banet_grid_fit(&c.s, SIDE, &g), OM_INVALID);
    assert_status(om_banet_voxelize(&c.g, &c.s, c.u, c.seen, c.in), OM_INVALID);
    c.s.ntri = 0;
    assert_status(om_banet_grid_fit(&c.s, SIDE, &g), OM_INVALID);
    case_done(&c);
}

static OmStatus voxelize_work(void* ctx) {
    Case* c = ctx;
    return om_banet_voxelize(&c->g, &c->s, c->u, c->seen, c->in);
}

static void test_memory(void** state) {
    (void)state;
    Case c = make_case();
    assert_true(test_failing_allocations(voxelize_work, &c, 1) > 5);
    case_done(&c);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_frame),         cmocka_unit_test(test_margin),
        cmocka_unit_test(test_frame_follows), cmocka_unit_test(test_distance),
        cmocka_unit_test(test_displacement),  cmocka_unit_test(test_weights),
        cmocka_unit_test(test_cells),         cmocka_unit_test(test_thin),
        cmocka_unit_test(test_refused),       cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
