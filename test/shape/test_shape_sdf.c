// Distance fields from functions, surfaces and masks; contours that are closed whatever the field.
#include "test_alloc.h"

#include "omentum/shape_meshing.h"
#include "omentum/shape_sdf.h"

static double sphere_fn(void* ctx, OmVec3 p) { return om_norm(p) - *(const double*)ctx; }

// The grid step squared over the radius is the error of flat triangles in a ball.
static void test_sphere_is_a_distance(void** unused) {
    (void)unused;
    double r = 0.03, h = 0.002;
    OmSdfDef def = om_sdf_default_def(h);
    def.margin = 0.01;
    OmSdf sdf;
    assert_ok(
        om_sdf_from_function(sphere_fn, &r, om_vec3(-r, -r, -r), om_vec3(r, r, r), &def, &sdf));
    OmRng rng = om_rng_init(1, 0);
    for (int i = 0; i < 2000; i++) {
        OmVec3 p = om_vec3(om_rng_range(&rng, -0.038, 0.038), om_rng_range(&rng, -0.038, 0.038),
                           om_rng_range(&rng, -0.038, 0.038)),
               g;
        if (om_norm(p) < 0.01) continue;  // the gradient has no limit in the middle
        double d = om_sdf_eval(&sdf, p, &g);
        assert_near(d, om_norm(p) - r, 0.1 * h);  // contour h^2/(8 r), trilinear h^2/(4 |p|)
        // a facet of the contour turns by h / r; towards the middle many are equally near
        if (om_norm(p) > 0.025) assert_near(om_norm(om_sub(g, om_normalize(p))), 0, 0.1);
    }
    // beyond the grid: continuous, growing with the distance to it, gradient by differences
    OmVec3 far = om_vec3(0.09, 0.02, 0.1), g;
    double d = om_sdf_eval(&sdf, far, &g), e = 1e-7;
    assert_near(d, om_norm(far) - r, 0.01);
    assert_near(g.x, (om_sdf_eval(&sdf, om_vec3(far.x + e, far.y, far.z), NULL) - d) / e, 1e-5);
    assert_near(g.y, (om_sdf_eval(&sdf, om_vec3(far.x, far.y + e, far.z), NULL) - d) / e, 1e-5);
    assert_near(g.z, (om_sdf_eval(&sdf, om_vec3(far.x, far.y, far.z + e), NULL) - d) / e, 1e-5);
    om_sdf_done(&sdf);
}

// ---- contours -------------------------------------------------------------------------------------------

enum { N = 12 };

static bool is_inside(const float* value, int i, int j, int k) {
    return i < N && j < N && k < N && value[i + N * (j + N * k)] < 0;
}

// Six corners of a cell around two opposite ones outside: a ring of edges, but a solid without a hole.
static int is_ring(const float* value, const int at[3]) {
    int outside = 0;
    if (at[0] == N - 1 || at[1] == N - 1 || at[2] == N - 1) return 0;
    for (int c = 0; c < 8; c++) {
        if (!is_inside(value, at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)))
            outside |= 1 << c;
    }
    return outside == 0x81 || outside == 0x42 || outside == 0x24 || outside == 0x18;
}

// Random signs, the hardest field there is. The solid whose inside nodes hang together by cell edges has
// chi = nodes - edges + faces - cubes, and its boundary twice that.
static void test_contour_of_noise_is_manifold(void** unused) {
    (void)unused;
    for (int sample = 0; sample < 20; sample++) {
        float value[N * N * N];
        OmSdf sdf = {{{N, N, N}, 1.0, {0, 0, 0}}, value};
        OmRng rng = om_rng_init(11, (uint64_t)sample);
        double share = 0.1 + 0.04 * sample;
        for (int n = 0; n < N * N * N; n++) {
            value[n] = (float)om_rng_range(&rng, 0.1, 1);
            if (om_rng_uniform(&rng) < share) value[n] = -value[n];
        }
        int chi = 0;
        for (int n = 0; n < N * N * N; n++) {
            int at[3] = {n % N, n / N % N, n / N / N};
            for (int span = 0; span < 8;
                 span++) {  // the cell of dimension popcount(span) from node n
                bool all = true;
                int dimension = (span & 1) + (span >> 1 & 1) + (span >> 2);
                for (int c = 0; c < 8 && all; c++) {
                    if (c & ~span) continue;
                    int q[3] = {at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)};
                    all =
                        q[0] < N && q[1] < N && q[2] < N && value[q[0] + N * (q[1] + N * q[2])] < 0;
                }
                if (all) chi += dimension % 2 ? -1 : 1;
            }
            chi += is_ring(value, at);
        }
        OmSurface s;
        int euler;
        assert_ok(om_surface_from_sdf(&sdf, 0, &s));
        assert_ok(om_surface_check_closed(&s, &euler));
        assert_int_equal(euler, 2 * chi);
        assert_true(om_surface_volume(&s) > 0);
        om_surface_done(&s);
    }
}

// ---- from surfaces ----------------------------------------------------------------------------------------

static void test_box_surface(void** unused) {
    (void)unused;
    OmTetMesh m;
    OmSurface s;
    OmSdf sdf;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.04, 0.06, 0.02), 4, 6, 2, &m));
    assert_ok(om_tet_mesh_boundary(&m, &s, NULL));
    OmSdfDef def = om_sdf_default_def(0.001);  // nodes lie on faces, edges and corners of the box
    for (int pass = 0; pass < 3; pass++) {
        if (pass == 1) {  // inside out
            for (int t = 0; t < s.ntri; t++) {
                int v = s.tri_vert[3 * t];
                s.tri_vert[3 * t] = s.tri_vert[3 * t + 1];
                s.tri_vert[3 * t + 1] = v;
            }
        }
        if (pass == 2) s.ntri -= 2;  // a hole of two triangles
        assert_ok(om_sdf_from_surface(&s, &def, &sdf));
        OmRng rng = om_rng_init(3, 0);
        for (int i = 0; i < 2000; i++) {
            OmVec3 p = om_vec3(om_rng_range(&rng, -0.003, 0.043), om_rng_range(&rng, -0.003, 0.063),
                               om_rng_range(&rng, -0.003, 0.023));
            double x = fabs(p.x - 0.02) - 0.02, y = fabs(p.y - 0.03) - 0.03,
                   z = fabs(p.z - 0.01) - 0.01;
            double out = om_norm(om_vec3(fmax(x, 0), fmax(y, 0), fmax(z, 0)));
            double exact = out + fmin(0, fmax(x, fmax(y, z)));
            double d = om_sdf_eval(&sdf, p, NULL);
            if (pass < 2)
                assert_near(d, exact, 3e-4);  // trilinear across the edges of the box
            else if (fabs(exact) > 0.001)
                assert_true((d < 0) == (exact < 0));
        }
        om_sdf_done(&sdf);
    }
    s.ntri = 10;
    assert_status(om_sdf_from_surface(&s, &def, &sdf), OM_INVALID);
    om_surface_done(&s);
    // at nodes of the caller; 10 mm apart they enclose the box of 20 mm, but with an offset no node is inside
    assert_ok(om_tet_mesh_boundary(&m, &s, NULL));
    OmGrid nodes = {.dim = {3, 2, 3}, .spacing = 0.07, .origin = {-0.01, -0.005, -0.06}};
    def.grid = &nodes;
    assert_ok(om_sdf_from_surface(&s, &def, &sdf));
    assert_memory_equal(&sdf.grid, &nodes, sizeof nodes);
    assert_near(sdf.d[0], om_norm(om_vec3(0.01, 0.005, 0.06)), 1e-8);
    assert_near(sdf.d[6], om_norm(om_vec3(0.01, 0.005, 0)), 1e-8);  // z = 10 mm
    om_sdf_done(&sdf);
    // distances up to a limit are those without a limit
    OmGrid fine = {.dim = {13, 17, 11}, .spacing = 0.005, .origin = {-0.0101, -0.01, -0.0152}};
    OmSdf all;
    def.grid = &fine;
    assert_ok(om_sdf_from_surface(&s, &def, &all));
    def.exact = 0.012;
    assert_ok(om_sdf_from_surface(&s, &def, &sdf));
    for (size_t n = 0; n < om_grid_count(fine.dim); n++) {
        if (fabsf(all.d[n]) <= 0.012f) assert_true(sdf.d[n] == all.d[n]);
        assert_true(fabsf(sdf.d[n]) >= fabsf(all.d[n]));
    }
    om_sdf_done(&all);
    om_sdf_done(&sdf);
    def.grid = &nodes, def.exact = INFINITY;
    nodes.origin.z = 0.001;
    assert_status(om_sdf_from_surface(&s, &def, &sdf), OM_INVALID);
    om_surface_done(&s);
    om_tet_mesh_done(&m);
}

// ---- from masks -------------------------------------------------------------------------------------------

// An ellipsoid sampled by voxels of a given header.
static void make_mask(OmMask* m, int nx, int ny, int nz, OmMat3 axis, OmVec3 semi) {
    assert_ok(om_mask_init(m, nx, ny, nz));
    m->grid.axis = axis;
    m->grid.origin =
        om_mat3_apply(axis, om_vec3(-0.5 * (nx - 1), -0.5 * (ny - 1), -0.5 * (nz - 1)));
    for (int k = 0, n = 0; k < nz; k++) {
        for (int j = 0; j < ny; j++) {
            for (int i = 0; i < nx; i++, n++) {
                OmVec3 p = om_add(m->grid.origin, om_mat3_apply(axis, om_vec3(i, j, k)));
                p = om_vec3(p.x / semi.x, p.y / semi.y, p.z / semi.z);
                m->inside[n] = om_norm(p) < 1;
            }
        }
    }
}

static void test_mask_keeps_volume_and_shape(void** unused) {
    (void)unused;
    double r = 0.03, voxel = 0.003;
    OmMask m;
    OmSdf sdf;
    OmSurface s;
    make_mask(&m, 24, 24, 24, om_mat3_scale(voxel, om_mat3_identity()), om_vec3(r, r, r));
    OmSdfDef def = om_sdf_default_def(0.0015);
    assert_ok(om_sdf_from_mask(&m, &def, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, &s));
    assert_near_rel(om_surface_volume(&s), om_mask_volume(&m), 1e-3);
    double sum = 0, max = 0;
    for (int v = 0; v < s.nvert; v++) {
        double e = fabs(om_norm(om_load3(s.x, v)) - r);
        sum += e;
        max = fmax(max, e);
    }
    printf("ball of 10 voxels: mean %.3f, largest %.3f voxels from the true ball\n",
           sum / s.nvert / voxel, max / voxel);
    assert_below(sum / s.nvert, 0.15 * voxel);  // the voxels themselves are 0.25 off on average
    assert_below(max, 0.5 * voxel);
    om_surface_done(&s);
    om_sdf_done(&sdf);
    om_mask_done(&m);
}

// What a Gaussian cut at one half would lose: a rod and a plate one voxel thick keep their volumes.
static void test_thin_parts_stay(void** unused) {
    (void)unused;
    OmMask m;
    OmSdf sdf;
    OmSurface s;
    int euler;
    assert_ok(om_mask_init(&m, 30, 30, 30));
    m.grid.axis = om_mat3_scale(0.003, om_mat3_identity());
    for (int i = 2; i < 28; i++) {
        m.inside[i + 30 * (6 + 30 * 6)] = 1;
        for (int j = 2; j < 28; j++) m.inside[i + 30 * (j + 30 * 20)] = 1;
    }
    OmSdfDef def = om_sdf_default_def(0.001);
    assert_ok(om_sdf_from_mask(&m, &def, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, &s));
    assert_ok(om_surface_check_closed(&s, &euler));
    assert_int_equal(euler, 4);  // two pieces, neither broken nor pierced
    OmVec3 rod = om_vec3(0.045, 0.018, 0.018), plate = om_vec3(0.045, 0.045, 0.06);
    assert_true(om_sdf_eval(&sdf, rod, NULL) < -0.0008);
    assert_true(om_sdf_eval(&sdf, plate, NULL) < -0.0008);
    assert_near_rel(om_surface_volume(&s), om_mask_volume(&m), 1e-2);
    om_surface_done(&s);
    om_sdf_done(&sdf);
    om_mask_done(&m);
}

// The same organ under other headers: axes exchanged and turned around (left-handed), and an oblique,
// anisotropic grid. The fields agree in space.
static void test_header_does_not_move_the_organ(void** unused) {
    (void)unused;
    OmVec3 semi = om_vec3(0.03, 0.02, 0.024);
    OmSdfDef def = om_sdf_default_def(0.0015);
    OmMask a, b, c;
    OmSdf fa, fb, fc;
    make_mask(&a, 30, 30, 30, om_mat3_diag(om_vec3(0.002, 0.0025, 0.003)), semi);
    // i runs along -z, j along +x, k along -y
    make_mask(&b, 30, 30, 30,
              om_mat3_cols(om_vec3(0, 0, -0.003), om_vec3(0.002, 0, 0), om_vec3(0, -0.0025, 0)),
              semi);
    OmMat3 turn = om_quat_to_mat3(om_quat_axis_angle(om_normalize(om_vec3(1, 2, -1)), 0.7));
    make_mask(&c, 40, 40, 26, om_mat3_mul(turn, om_mat3_diag(om_vec3(0.002, -0.002, 0.004))), semi);
    assert_ok(om_sdf_from_mask(&a, &def, &fa));
    assert_ok(om_sdf_from_mask(&b, &def, &fb));
    assert_ok(om_sdf_from_mask(&c, &def, &fc));
    OmRng rng = om_rng_init(9, 0);
    double max = 0;
    for (int i = 0; i < 3000; i++) {
        OmVec3 p = om_vec3(om_rng_range(&rng, -0.034, 0.034), om_rng_range(&rng, -0.024, 0.024),
                           om_rng_range(&rng, -0.028, 0.028));
        double d = om_sdf_eval(&fa, p, NULL);
        assert_near(om_sdf_eval(&fb, p, NULL), d, 2e-5);  // the same voxels: only rounding differs
        max = fmax(max, fabs(om_sdf_eval(&fc, p, NULL) - d));
    }
    printf("oblique against straight header: at most %.2f mm apart\n", max * 1e3);
    assert_below(max, 0.002);  // other voxels: half of a diagonal of 2 x 2 x 4 mm
    assert_near_rel(om_mask_volume(&c), om_mask_volume(&a), 0.02);
    om_sdf_done(&fa);
    om_sdf_done(&fb);
    om_sdf_done(&fc);
    om_mask_done(&a);
    om_mask_done(&b);
    om_mask_done(&c);
}

// ---- masks --------------------------------------------------------------------------------------------------

static void test_parts_holes_crop_close(void** unused) {
    (void)unused;
    OmMask m;
    int nkept, nfound;
    assert_ok(om_mask_init(&m, 10, 10, 10));
    m.grid.axis = om_mat3_scale(0.001, om_mat3_identity());
    for (int k = 0; k < 5; k++) {
        for (int j = 0; j < 5; j++) {
            for (int i = 0; i < 5; i++)
                m.inside[i + 10 * (j + 10 * k)] = i != 2 || j != 2 || k != 2;
        }
    }
    m.inside[5 + 10 * (5 + 10 * 5)] = 1;  // touches the cube's corner: one part by 26, two by 6
    m.inside[9 + 10 * (9 + 10 * 9)] = 1;
    assert_ok(om_mask_keep_parts(&m, 26, 0.001, &nkept, &nfound));
    assert_int_equal(nfound, 2);
    assert_int_equal(nkept, 2);
    // three parts by faces, two of one voxel: the largest first, equal ones by their place
    int64_t size[8];
    const int middle = 2, no_part = 4;
    unsigned char before[1000];
    memcpy(before, m.inside, sizeof before);
    assert_ok(om_mask_list_parts(&m, 26, size, 8, &nfound));
    assert_int_equal(nfound, 2);
    assert_int_equal(size[0], 125);
    assert_ok(om_mask_list_parts(&m, 6, size, 2, &nfound));
    assert_int_equal(nfound, 3);
    assert_int_equal(size[0], 124);
    assert_int_equal(size[1], 1);
    assert_status(om_mask_choose_parts(&m, 6, &no_part, 1), OM_INVALID);
    assert_memory_equal(m.inside, before, sizeof before);
    assert_ok(om_mask_choose_parts(&m, 6, &middle, 1));
    assert_int_equal(om_mask_count(&m), 1);
    assert_int_equal(m.inside[5 + 10 * (5 + 10 * 5)], 1);
    memcpy(m.inside, before, sizeof before);
    assert_ok(om_mask_choose_parts(&m, 6, (const int[]){3, 1}, 2));
    assert_int_equal(om_mask_count(&m), 125);
    assert_int_equal(m.inside[999], 1);
    memcpy(m.inside, before, sizeof before);
    assert_ok(om_mask_keep_parts(&m, 6, 0, &nkept, &nfound));
    assert_int_equal(nfound, 3);
    assert_int_equal(nkept, 1);
    assert_int_equal(om_mask_count(&m), 124);
    assert_ok(om_mask_fill_holes(&m));
    assert_int_equal(om_mask_count(&m), 125);
    assert_ok(om_mask_crop(&m, 2));
    assert_int_equal(m.grid.dim[0], 9);
    assert_near(om_norm(om_sub(m.grid.origin, om_vec3(-0.002, -0.002, -0.002))), 0, 1e-15);
    // a cut one voxel wide closes but for its rim, which a ball of one voxel can reach from outside
    for (int j = 2; j < 7; j++) {
        for (int i = 2; i < 7; i++) m.inside[i + 9 * (j + 9 * 4)] = 0;
    }
    assert_int_equal(om_mask_count(&m), 100);
    assert_ok(om_mask_close(&m, 0.001));
    assert_int_equal(om_mask_count(&m), 109);
    memset(m.inside, 0, 729);
    assert_status(om_mask_crop(&m, 1), OM_INVALID);
    om_mask_done(&m);
}

// ---- every allocation failing in turn ------------------------------------------------------------------------

static OmStatus build_everything(const OmMask* mask) {
    OmStatus status = OM_OK;
    OmMask m = {0};
    OmSdf sdf = {0}, again = {0};
    OmSurface s = {0};
    OmSdfDef def = om_sdf_default_def(0.004);
    OM_TRY_DONE(om_mask_init(&m, mask->grid.dim[0], mask->grid.dim[1], mask->grid.dim[2]));
    m.grid.axis = mask->grid.axis;
    memcpy(m.inside, mask->inside, om_grid_count(m.grid.dim));
    OM_TRY_DONE(om_mask_crop(&m, 2));
    OM_TRY_DONE(om_mask_close(&m, 0.004));
    OM_TRY_DONE(om_mask_keep_parts(&m, 6, 0, NULL, NULL));
    OM_TRY_DONE(om_mask_choose_parts(&m, 6, (const int[]){1}, 1));
    OM_TRY_DONE(om_mask_fill_holes(&m));
    OM_TRY_DONE(om_sdf_from_mask(&m, &def, &sdf));
    OM_TRY_DONE(om_surface_from_sdf(&sdf, 0, &s));
    OM_TRY_DONE(om_sdf_from_surface(&s, &def, &again));
done:
    om_surface_done(&s);
    om_sdf_done(&sdf);
    om_sdf_done(&again);
    om_mask_done(&m);
    return status;
}

static void test_failing_allocations_leak_nothing(void** unused) {
    (void)unused;
    OmMask mask;
    make_mask(&mask, 8, 8, 8, om_mat3_scale(0.004, om_mat3_identity()),
              om_vec3(0.012, 0.012, 0.012));
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    int64_t alive = om_alloc_alive();
    om_allocator_set(&failing);
    int nfail = 0;
    for (OmStatus status = OM_NO_MEMORY; status != OM_OK; nfail++) {
        test_alloc_countdown = nfail;
        status = build_everything(&mask);
        assert_true(status == OM_OK || status == OM_NO_MEMORY);
        assert_int_equal(om_alloc_alive(), alive);
    }
    om_allocator_set(NULL);
    assert_true(nfail > 40);
    om_mask_done(&mask);
}

// The field of noise, and of cubes that touch along edges: its sign at the centre of each voxel, and outside in the
// middle of a square in which two inside voxels touch along an edge.
static void test_field_of_a_mask_has_its_signs(void** unused) {
    (void)unused;
    enum { SIDE = 10 };
    int nsquare = 0;
    for (int sample = 0; sample < test_count(30, 200); sample++) {
        OmRng rng = om_rng_init(9, (uint64_t)sample);
        OmMask m;
        OmMaskField* field;
        const double share = om_rng_range(&rng, 0.2, 0.8);
        assert_ok(om_mask_init(&m, SIDE, SIDE, SIDE));
        for (int k = 1; k < SIDE - 1; k++)
            for (int j = 1; j < SIDE - 1; j++)
                for (int i = 1; i < SIDE - 1; i++)
                    m.inside[om_grid_index(m.grid.dim, i, j, k)] =
                        sample % 2 ? om_rng_uniform(&rng) < share : (i / 2 + j / 2 + k / 2) % 2;
        assert_ok(om_mask_field_create(&m, 0, 1.2, 8, &field));
        for (int k = 0; k < SIDE - 1; k++)
            for (int j = 0; j < SIDE - 1; j++)
                for (int i = 0; i < SIDE - 1; i++) {
                    const unsigned char* in = &m.inside[om_grid_index(m.grid.dim, i, j, k)];
                    assert_true((om_mask_field_eval(field, om_vec3(i, j, k)) < 0) == in[0]);
                    if (in[0] != in[SIDE + 1] || in[1] != in[SIDE] || in[0] == in[1]) continue;
                    assert_true(om_mask_field_eval(field, om_vec3(i + 0.5, j + 0.5, k)) > 0);
                    nsquare++;
                }
        om_mask_field_destroy(field);
        om_mask_done(&m);
    }
    assert_true(nsquare > 500);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sphere_is_a_distance),
        cmocka_unit_test(test_contour_of_noise_is_manifold),
        cmocka_unit_test(test_box_surface),
        cmocka_unit_test(test_mask_keeps_volume_and_shape),
        cmocka_unit_test(test_thin_parts_stay),
        cmocka_unit_test(test_header_does_not_move_the_organ),
        cmocka_unit_test(test_parts_holes_crop_close),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
        cmocka_unit_test(test_field_of_a_mask_has_its_signs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
