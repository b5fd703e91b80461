// test_banet_cells.c: cells that are stored, and what they become in other grids.
#include "banet/test_banet.h"
#include "test_alloc.h"

#define QUANTUM (0.5 / OM_BANET_UNIT + 1e-5)

typedef struct Case {
    OmBanetSample sample;
    OmBanetCells cells;
} Case;

static Case make_case(uint64_t seed) {
    Case c = {.sample = make_sample(seed)};
    assert_ok(om_banet_cells_make(&c.sample, TEST_SIDE, &c.cells));
    return c;
}

static void case_done(Case* c) {
    om_banet_sample_done(&c->sample);
    om_banet_cells_done(&c->cells);
}

static void test_make(void** state) {
    (void)state;
    Case c = make_case(3);
    const OmBanetGrid* g = &c.cells.grid;
    const size_t n = om_grid_count(g->dim);
    float* in = om_alloc(OM_BANET_NCHANNEL * n, sizeof *in);
    float* have = om_alloc((OM_BANET_NCHANNEL + 2) * n, sizeof *have);
    int* cell = om_alloc((size_t)c.sample.surface.nvert, sizeof *cell);
    assert_ok(om_banet_voxelize(g, &c.sample.surface, c.sample.u, c.sample.seen, in));
    float *target = have + OM_BANET_NCHANNEL * n, *weight = target + n;
    assert_ok(om_banet_cells_expand(&c.cells, g->dim, NULL, 0, have, target, weight));
    for (size_t i = 0; i < OM_BANET_NCHANNEL * n; ++i) assert_near(have[i], in[i], QUANTUM);
    // kinds, one by one from the vertices
    unsigned char* kind = om_calloc(n, 1);
    om_banet_find_cells(g, &c.sample.surface, cell);
    for (int i = 0; i < c.sample.surface.nvert; ++i)
        kind[cell[i]] |= (unsigned char)(c.sample.attached[i] ? 3 : 2);
    int nattached = 0, nsurface = 0;
    for (int i = 0; i < c.cells.ncell; ++i) {
        const int at = c.cells.cell[i];
        assert_true(i == 0 || at > c.cells.cell[i - 1]);
        assert_int_equal(c.cells.kind[i] & 3, kind[at]);
        assert_int_equal(!!(c.cells.kind[i] & OM_BANET_NEAR), in[at] < 1);
        assert_true(!kind[at] || c.cells.kind[i] & OM_BANET_NEAR);
        assert_true(target[at] == (float)(kind[at] & 1));
        assert_true(weight[at] == (in[at] < 1 ? 1.0f : 0.0f));
        nattached += kind[at] & 1, nsurface += kind[at] >> 1, kind[at] = 0;
    }
    for (size_t i = 0; i < n; ++i) assert_int_equal(kind[i], 0);  // none is left out
    assert_true(nattached > 100 && nattached < nsurface);
    assert_int_equal(c.cells.fact.index, 3);
    assert_int_equal(c.cells.fact.nsurface, c.sample.surface.nvert);
    om_free(in);
    om_free(have);
    om_free(cell);
    om_free(kind);
    case_done(&c);
}

// The surface itself turned in its grid and made into voxels again.
static void turn_sample(const OmBanetGrid* g, int symmetry, const OmBanetSample* s, OmBanetGrid* h,
                        OmSurface* moved, double* u) {
    *h = *g;
    if (symmetry & 1) h->dim[0] = g->dim[1], h->dim[1] = g->dim[0];
    const OmVec3 from = om_scale(0.5, om_vec3(g->dim[0] - 1, g->dim[1] - 1, g->dim[2] - 1)),
                 to = om_scale(0.5, om_vec3(h->dim[0] - 1, h->dim[1] - 1, h->dim[2] - 1));
    const OmMat3 quarter =
        om_quat_to_mat3(om_quat_axis_angle(om_vec3(0, 0, 1), 0.5 * OM_PI * (symmetry % 4)));
    const OmMat3 mirror = om_mat3_diag(om_vec3(symmetry & 4 ? -1 : 1, 1, symmetry & 8 ? -1 : 1));
    const OmMat3 t = om_mat3_mul(mirror, quarter);
    assert_ok(om_surface_init(moved, s->surface.nvert, s->surface.ntri));
    memcpy(moved->tri_vert, s->surface.tri_vert, 3 * (size_t)moved->ntri * sizeof(int));
    for (int i = 0; i < moved->nvert; ++i) {
        OmVec3 p = om_sub(om_banet_grid_local(g, om_load3(s->surface.x, i)), from);
        p = om_scale(g->voxel, om_add(to, om_mat3_apply(t, p)));
        om_store3(moved->x, i, om_pose_apply(g->pose_world_grid, p));
        OmVec3 v = om_quat_rotate(om_quat_conj(g->pose_world_grid.q), om_load3(s->u, i));
        om_store3(u, i, om_quat_rotate(g->pose_world_grid.q, om_mat3_apply(t, v)));
    }
}

static void test_symmetries(void** state) {
    (void)state;
    Case c = make_case(4);
    const size_t n = om_grid_count(c.cells.grid.dim);
    float* want = om_alloc(OM_BANET_NCHANNEL * n, sizeof *want);
    float* have = om_alloc((OM_BANET_NCHANNEL + 1) * n, sizeof *have);
    double* u = om_alloc(3 * (size_t)c.sample.surface.nvert, sizeof *u);
    int* cell = om_alloc((size_t)c.sample.surface.nvert, sizeof *cell);
    assert_true(c.cells.grid.dim[0] != c.cells.grid.dim[1]);
    for (int symmetry = 0; symmetry < OM_BANET_NSYMMETRY; ++symmetry) {
        OmBanetGrid h;
        OmSurface moved;
        turn_sample(&c.cells.grid, symmetry, &c.sample, &h, &moved, u);
        assert_ok(om_banet_voxelize(&h, &moved, u, c.sample.seen, want));
        float* target = have + OM_BANET_NCHANNEL * n;
        assert_ok(om_banet_cells_expand(&c.cells, h.dim, NULL, symmetry, have, target, NULL));
        for (size_t i = 0; i < n; ++i) {
            // rounding decides on which side of the band a cell is
            if (fabs(fabs((double)want[i]) - 1) < 1e-3) continue;
            for (size_t k = 0; k < OM_BANET_NCHANNEL; ++k)
                if (fabsf(have[k * n + i] - want[k * n + i]) > (float)QUANTUM)
                    fail_msg("symmetry %d, channel %zu, cell %zu: %g, not %g", symmetry, k, i,
                             (double)have[k * n + i], (double)want[k * n + i]);
        }
        om_banet_find_cells(&h, &moved, cell);
        for (int i = 0; i < moved.nvert; ++i) {
            OmVec3 p = om_banet_grid_local(&h, om_load3(moved.x, i));
            OmVec3 r = om_sub(p, om_vec3(floor(p.x), floor(p.y), floor(p.z)));
            bool is_clear = fabs(r.x - 0.5) > 1e-6 && fabs(r.y - 0.5) > 1e-6 &&
                            fabs(r.z - 0.5) > 1e-6;  // of the border between two cells
            if (c.sample.attached[i] && is_clear) assert_true(target[cell[i]] == 1);
        }
        om_surface_done(&moved);
    }
    om_free(want);
    om_free(have);
    om_free(u);
    om_free(cell);
    case_done(&c);
}

// In a larger grid with a shift: the same numbers elsewhere.
static void test_shift(void** state) {
    (void)state;
    Case c = make_case(5);
    const int *from = c.cells.grid.dim, to[3] = {64, 48, 32}, shift[3] = {-7, 3, 6};
    const size_t n = om_grid_count(from), m = om_grid_count(to);
    float* a = om_alloc((OM_BANET_NCHANNEL + 2) * n, sizeof *a);
    float* b = om_alloc((OM_BANET_NCHANNEL + 2) * m, sizeof *b);
    assert_ok(om_banet_cells_expand(&c.cells, from, NULL, 0, a, a + 5 * n, a + 6 * n));
    assert_ok(om_banet_cells_expand(&c.cells, to, shift, 0, b, b + 5 * m, b + 6 * m));
    for (size_t i = 0; i < m; ++i) {
        int at[3];
        om_grid_unpack(to, i, at);
        for (int k = 0; k < 3; ++k) at[k] -= (to[k] - from[k]) / 2 + shift[k];
        bool is_in = om_grid_has(from, at[0], at[1], at[2]);
        size_t j = is_in ? om_grid_index(from, at[0], at[1], at[2]) : 0;
        for (size_t k = 0; k < OM_BANET_NCHANNEL + 2; ++k)
            assert_true(b[k * m + i] == (is_in ? a[k * n + j] : k == 0 ? 2.0f : 0.0f));
    }
    assert_status(om_banet_cells_expand(&c.cells, to, (int[3]){40, 0, 0}, 0, b, NULL, NULL),
                  OM_INVALID);
    assert_status(om_banet_cells_expand(&c.cells, (int[3]){16, 16, 16}, NULL, 0, b, NULL, NULL),
                  OM_INVALID);
    om_free(a);
    om_free(b);
    case_done(&c);
}

static OmStatus make_work(void* ctx) {
    OmBanetCells cells;
    OmStatus status = om_banet_cells_make(ctx, TEST_SIDE, &cells);
    om_banet_cells_done(&cells);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    Case c = make_case(6);
    assert_true(test_failing_allocations(make_work, &c.sample, 1) > 8);
    for (int i = 0; i < c.sample.surface.nvert; ++i) om_store3(c.sample.u, i, om_vec3(1, 1, 1));
    om_banet_cells_done(&c.cells);
    assert_status(om_banet_cells_make(&c.sample, TEST_SIDE, &c.cells), OM_INVALID);
    case_done(&c);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_make),
        cmocka_unit_test(test_symmetries),
        cmocka_unit_test(test_shift),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
