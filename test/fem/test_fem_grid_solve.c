// test_fem_grid_solve.c: the grid solver against the finite elements of fem.h: forces, slopes and curvatures of its
// law, the coarse correction against the matrix that it inverts, and equilibria from linear solutions and from inverted
// elements.
#include "test_alloc.h"

#include "fem/fem_grid_internal.h"
#include "omentum/umesh.h"
#include "umesh/umesh_net_internal.h"

#define NELEM 320
#define POISSON 0.45

static OmUmeshOrgan* organ;
static const OmUmeshGrid* g;
static OmUmeshSolver* solver;
static OmFemSolid* solid;
static GridElements elements;
static OmFemGridModel* model;
static OmFemGridLinear* linear;
static size_t nnode, nelem;
static double unit;  // N, of the refinement's forces

static int begin(void** unused) {
    (void)unused;
    OmUmeshOrganDef organ_def = om_umesh_organ_default_def();
    organ_def.nelem = NELEM;
    assert_ok(om_umesh_organ_create(&organ_def, &organ));
    g = om_umesh_organ_grid(organ);
    nnode = (size_t)g->fem.mesh.nnode;
    nelem = (size_t)g->fem.mesh.nelem;
    OmUmeshDataDef def = om_umesh_data_default_def(organ, "");
    def.tolerance = 1e-9;
    assert_near(def.material.poisson, POISSON, 1e-12);
    assert_ok(om_umesh_solver_create(&def, &solver));
    OmFemDef fem = om_fem_default_def(&g->fem.mesh, 1, &def.material);
    assert_ok(om_fem_create(&fem, &solid));
    assert_ok(om__grid_elements_init(&g->fem, POISSON, &elements));
    assert_ok(om_fem_grid_model_create(&g->fem, POISSON, 1, &model));
    assert_ok(om_fem_grid_linear_create(&g->fem, g->is_surface, POISSON, 1, &linear));
    unit = def.material.young / (2 * (1 + POISSON)) * pow(g->fem.grid.spacing, 3) / 8;
    return 0;
}

static int end(void** unused) {
    (void)unused;
    om_fem_grid_linear_destroy(linear);
    om_fem_grid_model_destroy(model);
    om__grid_elements_done(&elements);
    om_fem_destroy(solid);
    om_umesh_solver_destroy(solver);
    om_umesh_organ_destroy(organ);
    return 0;
}

// A smooth bend, and noise of so much of the spacing.
static void deform(double noise, uint64_t seed, float* u) {
    OmRng rng = om_rng_init(seed, 0);
    for (size_t i = 0; i < nnode; ++i) {
        OmVec3 x = om_load3(g->fem.mesh.x, (int)i);
        const double bend[3] = {0.2 * x.z, 3 * x.x * x.z, -0.15 * x.z - 2 * x.y * x.y};
        for (int c = 0; c < 3; ++c)
            u[3 * i + (size_t)c] =
                (float)(bend[c] + noise * g->fem.grid.spacing * om_rng_range(&rng, -1, 1));
    }
}

static double energy_of(const float* u) {
    double* x = om_calloc(3 * nnode, sizeof *x);
    double energy;
    for (size_t i = 0; i < 3 * nnode; ++i) x[i] = g->fem.mesh.x[i] + (double)u[i];
    assert_ok(om_fem_eval_energy(solid, x, &energy));
    om_free(x);
    return energy;
}

static void test_forces(void** unused) {
    (void)unused;
    float *u = om_calloc(3 * nnode, sizeof *u), *F = om_calloc(GRID_F * nelem, sizeof *F);
    float *force = om_calloc(24 * nelem, sizeof *force),
          *drive = om_calloc(3 * nnode, sizeof *drive);
    double *x = om_calloc(3 * nnode, sizeof *x), *f = om_calloc(3 * nnode, sizeof *f), worst = 0;
    unsigned char* mask = om_calloc(nnode, 1);
    deform(0.08, 3, u);
    mask[nnode - 1] = 1;
    om__grid_gradients(&elements, u, 1, F, 0, (int)nelem);
    om__grid_element_forces(&elements, F, force, 0, (int)nelem);
    om__grid_node_forces(&elements, mask, force, drive, 0, (int)nnode);
    for (size_t i = 0; i < 3 * nnode; ++i) x[i] = g->fem.mesh.x[i] + (double)u[i];
    assert_ok(om_fem_eval_force(solid, x, f, NULL));
    double max = 0;
    for (size_t i = 0; i < 3 * nnode; ++i) {
        bool is_given = mask[i / 3] || g->fem.fixed[i / 3];
        worst = fmax(worst, fabs(unit * (double)drive[i] + (is_given ? 0 : f[i])));
        max = fmax(max, fabs(f[i]));
    }
    assert_below(worst, 1e-5 * max);
    double min = om_fem_eval_volume(solid, x, NULL);
    assert_near((double)om__grid_min_volume(F, 0, (int)nelem), min, 1e-5);
    assert_true(min > 0.2 && min < 0.9);
    om_free(u), om_free(F), om_free(force), om_free(drive), om_free(x), om_free(f), om_free(mask);
}

// The slope along D is that of the energy, the curvatures those of the slope; D and S are two other fields.
static void test_slopes(void** unused) {
    (void)unused;
    float *u = om_calloc(3 * nnode, sizeof *u), *d = om_calloc(3 * nnode, sizeof *d);
    float *s = om_calloc(3 * nnode, sizeof *s), *at = om_calloc(3 * nnode, sizeof *at);
    float* F[4];
    for (int k = 0; k < 4; ++k) F[k] = om_calloc(GRID_F * nelem, sizeof *F[k]);
    deform(0.05, 1, u);
    deform(0.3, 2, d);
    deform(0.3, 5, s);
    bool is_open;
    double curve[3], slope[2][2], energy[2];
    const float step = 0.01f;
    GridDirection along = {F[0], F[3], F[1], {1, 0}};
    om__grid_gradients(&elements, u, 1, F[0], 0, (int)nelem);
    om__grid_gradients(&elements, d, 0, F[1], 0, (int)nelem);
    om__grid_gradients(&elements, s, 0, F[2], 0, (int)nelem);
    for (size_t i = 0; i < GRID_F * nelem; ++i) F[3][i] = F[0][i] - F[2][i];  // before S
    om__grid_curvature(&along, elements.lambda, 0, (int)nelem, curve);
    for (int sign = 0; sign < 2; ++sign) {
        const float way = sign ? step : -step;
        for (size_t i = 0; i < 3 * nnode; ++i) at[i] = u[i] + way * d[i];
        energy[sign] = energy_of(at);
        slope[0][sign] = om__grid_slope(&along, elements.lambda, way, 0, 0, (int)nelem, &is_open);
        GridDirection beside = {F[3], F[3], F[1], {1, 0}};
        for (size_t i = 0; i < GRID_F * nelem; ++i) F[3][i] = F[0][i] + way * F[2][i];
        slope[1][sign] = om__grid_slope(&beside, elements.lambda, 0, 0, 0, (int)nelem, &is_open);
    }
    double here = om__grid_slope(&along, elements.lambda, 0, 0, 0, (int)nelem, &is_open);
    assert_true(is_open);
    assert_near_rel(unit * here, (energy[1] - energy[0]) / (2 * (double)step), 2e-3);
    assert_near_rel(curve[0], (slope[0][1] - slope[0][0]) / (2 * (double)step), 2e-3);
    assert_near(curve[1], (slope[1][1] - slope[1][0]) / (2 * (double)step), 2e-3 * curve[0]);
    assert_true(curve[2] > 0);
    (void)om__grid_slope(&along, elements.lambda, 5, 0.4f, 0, (int)nelem, &is_open);
    assert_false(is_open);  // so far along noise elements turn over

    // D / 2 - 2 S: the slope is that of both, and what is gone along it ends there
    for (size_t i = 0; i < GRID_F * nelem; ++i) F[3][i] = F[0][i] - F[2][i];
    GridDirection by_s = {F[0], F[3], F[2], {1, 0}}, both = {F[0], F[3], F[1], {0.5f, -2}};
    double other = om__grid_slope(&by_s, elements.lambda, 0, 0, 0, (int)nelem, &is_open);
    double mixed = om__grid_slope(&both, elements.lambda, 0, 0, 0, (int)nelem, &is_open);
    assert_near(mixed, 0.5 * here - 2 * other, 1e-4 * (fabs(here) + fabs(other)));
    float* old = om_calloc(GRID_F * nelem, sizeof *old);
    memcpy(old, F[0], GRID_F * nelem * sizeof *old);
    om__grid_advance(&both, 0.1f, 0, (int)nelem);
    for (size_t i = 0; i < GRID_F * nelem; ++i)
        assert_near((double)F[0][i], (double)(old[i] + 0.1f * (0.5f * F[1][i] - 2 * F[2][i])),
                    1e-5);
    assert_memory_equal(F[3], old, GRID_F * nelem * sizeof *old);
    om_free(old);
    om_free(u), om_free(d), om_free(s), om_free(at);
    for (int k = 0; k < 4; ++k) om_free(F[k]);
}

// Sweeps turn every element back, and then only ever lower the energy.
static void test_relax(void** unused) {
    (void)unused;
    float *u = om_calloc(3 * nnode, sizeof *u), *F = om_calloc(GRID_F * nelem, sizeof *F);
    float* again = om_calloc(GRID_F * nelem, sizeof *again);
    unsigned char* is_skipped = om_calloc(nnode, 1);
    deform(0.55, 4, u);
    om__grid_gradients(&elements, u, 1, F, 0, (int)nelem);
    assert_below((double)om__grid_min_volume(F, 0, (int)nelem), -0.1);
    double last = INFINITY;
    for (int sweep = 0; sweep < 8; ++sweep) {
        for (int color = 0; color < 8; ++color)
            om__grid_relax(&elements, is_skipped, F, u, elements.color_adr[color],
                           elements.color_adr[color + 1]);
        if (sweep < 3) continue;
        double energy = energy_of(u);
        assert_below(energy, last * (1 + 1e-6));
        last = energy;
    }
    assert_true(om__grid_min_volume(F, 0, (int)nelem) > 0.05f);
    om__grid_gradients(&elements, u, 1, again, 0, (int)nelem);  // recomputed from scratch
    for (size_t i = 0; i < GRID_F * nelem; ++i) assert_near((double)F[i], (double)again[i], 1e-4);
    size_t nmoved = 0;
    for (size_t i = 0; i < nnode; ++i) is_skipped[i] = g->fem.mesh.x[3 * i] < 0;
    memcpy(again, u, 3 * nnode * sizeof *u);
    om__grid_relax(&elements, is_skipped, F, u, 0, elements.color_adr[8]);
    for (size_t i = 0; i < 3 * nnode; ++i) {
        assert_true(!is_skipped[i / 3] || u[i] == again[i]);
        nmoved += u[i] != again[i];
    }
    assert_true(nmoved > nnode / 2);
    om_free(u), om_free(F), om_free(again), om_free(is_skipped);
}

// Forces that a field of the coarse grid makes at rest: the correction finds the field again.
static void test_coarse(void** unused) {
    (void)unused;
    GridCoarse* c;
    double K[24 * 24], off = 0, size = 0;
    assert_ok(om__grid_coarse_create(&elements, 1, &c));
    const int num = om__grid_coarse_size(c);
    assert_true(num > (int)nnode / 16 && num < (int)nnode / 2);
    float *w = om_calloc(3 * (size_t)num, sizeof *w),
          *sum = om_calloc(3 * (size_t)num, sizeof *sum);
    float *u = om_calloc(3 * nnode, sizeof *u), *r = om_calloc(3 * nnode, sizeof *r);
    float* z = om_calloc(3 * nnode, sizeof *z);
    OmRng rng = om_rng_init(9, 0);
    for (int i = 0; i < 3 * num; ++i) w[i] = (float)om_rng_range(&rng, -1, 1);
    om__grid_coarse_prolong(c, w, u, 0, (int)nnode);
    for (size_t i = 0; i < nnode; ++i) assert_true(!g->fem.fixed[i] || u[3 * i] == 0);
    om__grid_rest_stiffness(&elements, K);
    for (size_t e = 0; e < nelem; ++e)
        for (int row = 0; row < 24; ++row) {
            const int* node = g->fem.mesh.elem_node + 8 * e;
            double f = 0;
            for (int col = 0; col < 24; ++col)
                f += K[24 * row + col] * (double)u[3 * node[col / 3] + col % 3];
            r[3 * node[row / 3] + row % 3] += (float)f;
        }
    om__grid_coarse_restrict(c, r, sum, 0, num);
    om__grid_coarse_multiply(c, sum, w, 0, num);
    om__grid_coarse_prolong(c, w, z, 0, (int)nnode);
    for (size_t i = 0; i < 3 * nnode; ++i) {
        off += pow((double)z[i] - (double)u[i], 2);
        size += pow((double)u[i], 2);
    }
    printf("a field of the coarse grid comes back to %.4f of itself\n", sqrt(off / size));
    assert_below(sqrt(off / size), 0.02);  // bfloat16
    om__grid_coarse_destroy(c);
    om_free(w), om_free(sum), om_free(u), om_free(r), om_free(z);
}

// From linear answers to presses of 0 to 20 mm: the same states as Newton's method, the same bytes with any workers.
static void test_equilibrium(void** unused) {
    (void)unused;
    unsigned char* mask = om_calloc(nnode, 1);
    float *u = om_calloc(3 * nnode, sizeof *u), *v = om_calloc(3 * nnode, sizeof *v);
    float* truth = om_calloc(3 * nnode, sizeof *truth);
    double* goal = om_calloc(3 * nnode, sizeof *goal);
    OmFemGridWork* work;
    assert_ok(om_fem_grid_work_create(model, &work));
    for (int press = 0; press <= 20; press += 5) {
        OmUmeshPatch place = om_umesh_find_place(g, om_vec3(0.02, 0.01, 0.07));
        assert_true(om_umesh_patch_select(g, &place, mask) >= 3);
        OmVec3 way = om_scale(-1e-3 * press, place.normal);
        for (int i = 0; i < g->fem.mesh.nnode; ++i)
            om_store3(goal, i, mask[i] ? way : om_vec3(0, 0, 0));
        for (size_t i = 0; i < 3 * nnode; ++i) v[i] = (float)goal[i];
        OmFemGridPatch patch;
        OmFemGridReport one, other, loose;
        const int nworker = 2 + press / 5;  // they cut the work elsewhere each
        assert_ok(om_fem_grid_patch_init(linear, mask, &patch));
        assert_ok(om_fem_grid_linear_eval(linear, &patch, v, 1, u));
        for (size_t i = 0; i < 3 * nnode; ++i) u[i] = mask[i / 3] ? v[i] : u[i];
        assert_ok(om_umesh_solve(solver, mask, goal, NULL));
        for (size_t i = 0; i < 3 * nnode; ++i) truth[i] = (float)goal[i];
        double before = om__umesh_mean_error(g, u, truth);
        memcpy(v, u, 3 * nnode * sizeof *u);
        assert_ok(om_fem_grid_solve(work, &patch, mask, &(OmFemGridStop){1e-4, 60, 1}, u, &loose));
        double rough = om__umesh_mean_error(g, u, truth);
        memcpy(u, v, 3 * nnode * sizeof *u);
        assert_ok(om_fem_grid_solve(work, &patch, mask, &(OmFemGridStop){3e-6, 60, 1}, u, &one));
        assert_ok(
            om_fem_grid_solve(work, &patch, mask, &(OmFemGridStop){3e-6, 60, nworker}, v, &other));
        double after = om__umesh_mean_error(g, u, truth);
        printf("press of %d mm: linear %.3f mm off, %.4f after %d cycles, %.5f after %d\n", press,
               1e3 * before, 1e3 * rough, loose.ncycle, 1e3 * after, one.ncycle);
        assert_below(rough, 1e-4);
        assert_below(after, 1e-5);
        assert_true(loose.ncycle <= one.ncycle && one.ncycle < 60 && one.left < 3e-6);
        assert_true(press > 0 || one.ncycle == 1);  // nothing moves: nothing to do
        assert_true(one.min_volume > 0.1);
        assert_memory_equal(u, v, 3 * nnode * sizeof *u);
        assert_true(one.ncycle == other.ncycle && one.left == other.left &&
                    one.min_volume == other.min_volume);
        for (size_t i = 0; i < 3 * nnode; ++i)
            assert_true(g->fem.fixed[i / 3] ? u[i] == 0 : !mask[i / 3] || u[i] == (float)goal[i]);
        om_fem_grid_patch_done(&patch);
    }
    om_fem_grid_work_destroy(work);
    om_free(mask), om_free(u), om_free(v), om_free(truth), om_free(goal);
}

// Samples of this law are known from those of another.
static void test_balance(void** unused) {
    (void)unused;
    const OmLaw law[2] = {OM_NEO_HOOKEAN, OM_ST_VENANT_KIRCHHOFF};
    float* answer = om_calloc(3 * nnode, sizeof *answer);
    double* u = om_calloc(3 * nnode, sizeof *u);
    for (int k = 0; k < 2; ++k) {
        OmUmeshDataDef def = om_umesh_data_default_def(organ, "");
        OmUmeshSolver* own;
        OmUmeshSample sample;
        OmUmeshData data = {.grid = *g, .nsample = 1, .sample = &sample};
        double balance, other;
        def.material.law = law[k];
        def.press_share = 0;
        data.mask = om_calloc(nnode, 1);
        data.u = om_calloc(3 * nnode, sizeof *data.u);
        assert_ok(om_umesh_solver_create(&def, &own));
        assert_ok(om_umesh_sample_make(own, 0, &sample, data.mask, u));
        for (size_t i = 0; i < 3 * nnode; ++i) data.u[i] = (float)u[i];
        assert_ok(om_fem_grid_linear_solve(linear, data.mask, data.u, 1, answer));
        assert_ok(om__umesh_measure_balance(&data, POISSON, answer, 0, 1, &balance));
        assert_ok(om__umesh_measure_balance(&data, 0.4, answer, 0, 1, &other));
        printf("%s: forces left %.5f, with another Poisson's ratio %.3f\n", om_law_name(law[k]),
               balance, other);
        assert_true(k == 0 ? balance < 2e-3 : balance > 0.05);
        assert_true(other > 0.05);
        om_umesh_solver_destroy(own);
        om_free(data.mask);
        om_free(data.u);
    }
    om_free(answer), om_free(u);
}

static OmStatus make_all(void* unused) {
    (void)unused;
    OmFemGridModel* r = NULL;
    OmFemGridWork* work = NULL;
    OmFemGridPatch patch = {0};
    OmFemGridReport report;
    unsigned char* mask = NULL;
    float* u = NULL;
    OmStatus status = OM_OK;
    OM_CALLOC_DONE(mask, nnode);
    OM_CALLOC_DONE(u, 3 * nnode);
    for (size_t i = 0; i < nnode; ++i)
        mask[i] = g->is_surface[i] && g->fem.mesh.x[3 * i + 2] > 0.06;
    OM_TRY_DONE(om_fem_grid_patch_init(linear, mask, &patch));
    OM_TRY_DONE(om_fem_grid_model_create(&g->fem, POISSON, 1, &r));
    OM_TRY_DONE(om_fem_grid_work_create(r, &work));
    OM_TRY_DONE(om_fem_grid_solve(work, &patch, mask, &(OmFemGridStop){1e-5, 3, 1}, u, &report));
done:
    om_fem_grid_patch_done(&patch);
    om_fem_grid_work_destroy(work);
    om_fem_grid_model_destroy(r);
    om_free(mask);
    om_free(u);
    return status;
}

static void test_no_memory(void** unused) {
    (void)unused;
    assert_true(test_failing_allocations(make_all, NULL, 1) > 20);
}

static void check_refused(OmGrid points, const unsigned char* active, const char* field) {
    OmFemGrid grid;
    assert_status(om_fem_grid_init(&points, active, &grid), OM_INVALID);
    assert_non_null(strstr(om_error_message(), field));
    assert_null(grid.cell_elem);
    assert_int_equal(grid.npoint, 0);
}

static void test_grids_out_of_range(void** unused) {
    (void)unused;
    unsigned char active[8] = {1};
    const OmGrid good = {.dim = {2, 2, 2}, .spacing = 0.01};
    OmGrid bad;
    OmFemGrid grid;
    assert_ok(om_fem_grid_init(&good, active, &grid));
    assert_int_equal(grid.mesh.nelem, 1);
    om_fem_grid_done(&grid);
    for (int c = 0; c < 3; ++c) {
        const char* const field[] = {"points.dim[0]", "points.dim[1]", "points.dim[2]"};
        bad = good, bad.dim[c] = 0;
        check_refused(bad, active, field[c]);
        bad.dim[c] = -2;
        check_refused(bad, active, field[c]);
        bad = (OmGrid){{65536, 65536, 65536}, 0.01, {0}};  // as an int: 0
        bad.dim[c] = 1;
        check_refused(bad, active, "4294967296 points");
    }
    bad = good, bad.dim[0] = 89478486, bad.dim[1] = bad.dim[2] = 1;  // 2^31 / 24 is 89,478,485.3
    check_refused(bad, active, "89478486 points; at most 89478485");
    const double spacing[] = {0, -0.01, NAN, INFINITY};
    for (int k = 0; k < 4; ++k) {
        bad = good, bad.spacing = spacing[k];
        check_refused(bad, active, "points.spacing");
    }
    check_refused(good, NULL, "active");
}

// At 0.5 the law's lambda is infinite, and above it or below -1 the stiffness is not positive.
static void test_poisson_out_of_range(void** unused) {
    (void)unused;
    const double poisson[] = {0.5, 0.7, -1, -3, NAN, INFINITY};
    unsigned char* mask = calloc(nnode, 1);
    float* u = calloc(3 * nnode, sizeof *u);
    for (int k = 0; k < 6; ++k) {
        OmFemGridModel* r = model;
        OmFemGridLinear* l = linear;
        OmFemGridUntangling report;
        double norm;
        assert_status(om_fem_grid_model_create(&g->fem, poisson[k], 1, &r), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "poisson"));
        assert_null(r);
        assert_status(om_fem_grid_linear_create(&g->fem, g->is_surface, poisson[k], 1, &l),
                      OM_INVALID);
        assert_non_null(strstr(om_error_message(), "grid: poisson"));
        assert_null(l);
        assert_status(om_fem_grid_eval_residual(&g->fem, poisson[k], 1, mask, u, &norm),
                      OM_INVALID);
        assert_status(om_fem_grid_untangle(&g->fem, poisson[k], mask, u, &report), OM_INVALID);
    }
    free(mask);
    free(u);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_forces),
        cmocka_unit_test(test_slopes),
        cmocka_unit_test(test_relax),
        cmocka_unit_test(test_coarse),
        cmocka_unit_test(test_equilibrium),
        cmocka_unit_test(test_balance),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_grids_out_of_range),
        cmocka_unit_test(test_poisson_out_of_range),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
