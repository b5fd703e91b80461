// test_umesh_sample.c: samples: Algorithm 2, equilibrium, reactions, and that the output follows from the input.
#include "test_alloc.h"
#include "umesh/test_umesh.h"

typedef struct Made {
    OmUmeshSample info;
    unsigned char* mask;
    double* u;
} Made;

static Made make_sample(const OmUmeshDataDef* def, OmUmeshSolver* solver, int64_t index) {
    size_t nnode = (size_t)om_umesh_organ_grid(def->organ)->fem.mesh.nnode;
    Made m = {.mask = om_alloc(nnode, 1), .u = om_alloc(3 * nnode, sizeof(double))};
    assert_ok(om_umesh_sample_make(solver, index, &m.info, m.mask, m.u));
    return m;
}

static void made_done(Made* m) {
    om_free(m->mask);
    om_free(m->u);
}

// Forces that nodes must be held with, from displacements alone.
static double* forces_of(const OmUmeshDataDef* def, const double* u) {
    const OmFemMesh* mesh = &om_umesh_organ_grid(def->organ)->fem.mesh;
    size_t n = 3 * (size_t)mesh->nnode;
    OmFemDef solid_def = om_fem_default_def(mesh, 1, &def->material);
    OmFemSolid* solid;
    assert_ok(om_fem_create(&solid_def, &solid));
    double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f);
    for (size_t i = 0; i < n; ++i) x[i] = mesh->x[i] + u[i];
    assert_ok(om_fem_eval_force(solid, x, f, NULL));
    om_free(x);
    om_fem_destroy(solid);
    return f;
}

// Where the patch is, where the force points, for many draws; and how they are spread.
static void test_algorithm_2(void** state) {
    (void)state;
    enum { N = 200 };
    OmUmeshOrgan* organ = make_organ(120);
    const OmUmeshGrid* g = om_umesh_organ_grid(organ);
    OmUmeshDataDef def = small_def(organ, NULL);
    def.press_share = 0;
    def.material.young = 1e5;  // hardly moves: we look at draws
    def.max_force = 0.8;
    OmUmeshSolver* solver;
    assert_ok(om_umesh_solver_create(&def, &solver));
    double force[N] = {0}, tilt[N], mean_x = 0;
    for (int i = 0; i < N; ++i) {
        Made m = make_sample(&def, solver, i);
        const OmUmeshPatch* p = &m.info.patch;
        OmVec3 across = om_cross(p->normal, p->along);
        int num = 0;
        for (int n = 0; n < g->fem.mesh.nnode; ++n) {
            num += m.mask[n];
            if (!m.mask[n]) continue;
            OmVec3 r = om_sub(om_load3(g->surface_x, n), p->center);
            assert_true(g->is_surface[n] && !g->fem.fixed[n]);
            assert_true(fabs(om_dot(r, p->along)) <= 0.025);
            assert_true(fabs(om_dot(r, across)) <= 0.015);
            assert_true(fabs(om_dot(r, p->normal)) <= 0.02);
        }
        assert_int_equal(num, m.info.npatch);
        assert_true(num >= def.min_patch);
        assert_near(om_norm(p->normal), 1, 1e-12);
        assert_near(om_dot(p->normal, p->along), 0, 1e-12);
        // inwards, tilted by what is stored
        double angle = acos(-om_dot(m.info.direction, p->normal));
        assert_near(angle, fabs(m.info.tilt), 1e-6);  // acos near 1
        assert_true(fabs(m.info.tilt) <= OM_PI / 4);
        assert_near(om_norm(om_cross(m.info.force, m.info.direction)), 0, 1e-15);
        assert_near(om_half_ellipsoid_eval(OM_PHANTOM_HALF, p->center), 0, 0.8e-3);
        assert_true(p->center.z > 0);
        force[i] = om_norm(m.info.force);
        tilt[i] = m.info.tilt;
        mean_x += p->center.x / N;
        made_done(&m);
    }
    // Uniform: the largest distance of the empirical distribution is below 1.63 / sqrt(N) in 99 of 100 seeds
    double far_force = 0, far_tilt = 0;
    for (int i = 0; i < N; ++i) {
        double below_force = 0, below_tilt = 0;
        for (int j = 0; j < N; ++j) {
            below_force += force[j] <= force[i];
            below_tilt += tilt[j] <= tilt[i];
        }
        far_force = fmax(far_force, fabs(below_force / N - force[i] / 0.8));
        far_tilt = fmax(far_tilt, fabs(below_tilt / N - (tilt[i] / (OM_PI / 2) + 0.5)));
    }
    assert_below(far_force, 1.63 / sqrt(N));
    assert_below(far_tilt, 1.63 / sqrt(N));
    assert_near(mean_x, 0, 4 * 0.04 / sqrt(N));  // four standard errors; x spreads by 40 mm
    om_umesh_solver_destroy(solver);
    om_umesh_organ_destroy(organ);
}

// Forces of free nodes vanish, those of the patch share the force, and the ground pushes back.
static void test_equilibrium(void** state) {
    (void)state;
    OmUmeshOrgan* organ = make_organ(400);
    const OmUmeshGrid* g = om_umesh_organ_grid(organ);
    OmUmeshDataDef def = small_def(organ, NULL);
    OmUmeshSolver* solver;
    assert_ok(om_umesh_solver_create(&def, &solver));
    int npress = 0;
    for (int i = 0; i < 8; ++i) {
        Made m = make_sample(&def, solver, i);
        double* f = forces_of(&def, m.u);
        OmVec3 ground = {0, 0, 0}, patch = {0, 0, 0};
        double rest = 0, size = om_norm(m.info.force);
        for (int n = 0; n < g->fem.mesh.nnode; ++n) {
            OmVec3 fn = om_load3(f, n);
            if (g->fem.fixed[n]) {
                assert_near(om_norm(om_load3(m.u, n)), 0, 0);
                ground = om_add(ground, fn);
            } else if (m.mask[n]) {
                patch = om_add(patch, fn);
                OmVec3 way = om_scale(m.info.press, m.info.direction);
                if (m.info.press > 0)
                    assert_near(om_distance(om_load3(m.u, n), way), 0, 1e-15);
                else
                    rest += om_norm2(om_sub(fn, om_scale(1.0 / m.info.npatch, m.info.force)));
            } else {
                rest += om_norm2(fn);
            }
        }
        npress += m.info.press > 0;
        // the tolerance of solves, relative to loads and reactions, which for a patch of n nodes are below
        // twice the resultant
        assert_below(sqrt(rest), 2 * def.tolerance * fmax(size, 1e-3) + 1e-12);
        assert_below(om_distance(patch, m.info.force), 1e-3 * fmax(size, 1e-3));
        assert_below(om_norm(om_add(ground, m.info.force)), 1e-3 * fmax(size, 1e-3));
        assert_true(m.info.min_volume >= def.min_volume);
        om_free(f);
        made_done(&m);
    }
    assert_in_range(npress, 1, 7);
    om_umesh_solver_destroy(solver);
    om_umesh_organ_destroy(organ);
}

// What a network has as input determines the output: prescribing it gives the same field.
static void test_input_determines_output(void** state) {
    (void)state;
    OmUmeshOrgan* organ = make_organ(400);
    size_t nnode = (size_t)om_umesh_organ_grid(organ)->fem.mesh.nnode;
    OmUmeshDataDef def = small_def(organ, NULL);
    def.tolerance = 1e-9;
    OmUmeshSolver* solver;
    assert_ok(om_umesh_solver_create(&def, &solver));
    for (int i = 0; i < 4; ++i) {
        Made m = make_sample(&def, solver, i);
        double* u = om_calloc(3 * nnode, sizeof *u);
        for (size_t n = 0; n < 3 * nnode; ++n) u[n] = m.mask[n / 3] ? m.u[n] : 0;
        assert_ok(om_umesh_solve(solver, m.mask, u, NULL));
        for (size_t n = 0; n < 3 * nnode; ++n) assert_near(u[n], m.u[n], 1e-8);
        // A held node stays, also where the caller prescribes it.
        const unsigned char* fixed = om_umesh_organ_grid(organ)->fem.fixed;
        size_t held = 0;
        while (!fixed[held]) ++held;
        assert_false(m.mask[held]);
        m.mask[held] = 1;
        for (int c = 0; c < 3; ++c) u[3 * held + (size_t)c] = 0.002;
        assert_ok(om_umesh_solve(solver, m.mask, u, NULL));
        for (size_t n = 0; n < 3 * nnode; ++n) assert_near(u[n], m.u[n], 1e-8);
        om_free(u);
        made_done(&m);
    }
    om_umesh_solver_destroy(solver);
    om_umesh_organ_destroy(organ);
}

// A sample does not remember what was solved before it, nor by whom.
static void test_alone(void** state) {
    (void)state;
    OmUmeshOrgan* organ = make_organ(200);
    size_t size = 3 * (size_t)om_umesh_organ_grid(organ)->fem.mesh.nnode * sizeof(double);
    OmUmeshDataDef def = small_def(organ, NULL);
    OmUmeshSolver *one, *other;
    assert_ok(om_umesh_solver_create(&def, &one));
    assert_ok(om_umesh_solver_create(&def, &other));
    Made first[6];
    for (int i = 0; i < 6; ++i) first[i] = make_sample(&def, one, i);
    for (int i = 5; i >= 0; i -= 2) {
        Made again = make_sample(&def, other, i);
        assert_memory_equal(again.u, first[i].u, size);
        again.info.seconds = first[i].info.seconds;
        assert_memory_equal(&again.info, &first[i].info, sizeof again.info);
        made_done(&again);
    }
    assert_memory_not_equal(first[0].u, first[1].u, size);
    def.seed = 2;
    om_umesh_solver_destroy(other);
    assert_ok(om_umesh_solver_create(&def, &other));
    Made seeded = make_sample(&def, other, 0);
    assert_memory_not_equal(seeded.u, first[0].u, size);
    made_done(&seeded);
    for (int i = 0; i < 6; ++i) made_done(&first[i]);
    om_umesh_solver_destroy(one);
    om_umesh_solver_destroy(other);
    om_umesh_organ_destroy(organ);
}

// St Venant-Kirchhoff gives way under a press that the default law bears: drawn again, counted, given up.
static void test_failures(void** state) {
    (void)state;
    OmUmeshOrgan* organ = make_organ(120);
    size_t nnode = (size_t)om_umesh_organ_grid(organ)->fem.mesh.nnode;
    OmUmeshDataDef def = small_def(organ, NULL);
    def.material.law = OM_ST_VENANT_KIRCHHOFF;
    def.press_share = 1;
    def.max_press = 0.05;
    def.max_attempt = 2;
    unsigned char* mask = om_alloc(nnode, 1);
    double* u = om_alloc(3 * nnode, sizeof *u);
    OmUmeshSolver* solver;
    OmUmeshSample sample;
    assert_ok(om_umesh_solver_create(&def, &solver));
    int nfail = 0, ngiven_up = 0;
    for (int i = 0; i < 6; ++i) {
        OmStatus status = om_umesh_sample_make(solver, i, &sample, mask, u);
        assert_true(status == OM_OK || status == OM_NOT_CONVERGED);
        ngiven_up += status == OM_NOT_CONVERGED;
        if (status != OM_OK) continue;
        nfail += sample.nfail;
        assert_true(sample.nattempt > sample.nfail && sample.min_volume >= def.min_volume);
    }
    assert_true(nfail + ngiven_up > 0);
    om_umesh_solver_destroy(solver);
    def.max_tilt = -1;
    assert_status(om_umesh_solver_create(&def, &solver), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "max_tilt"));
    om_free(mask);
    om_free(u);
    om_umesh_organ_destroy(organ);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_algorithm_2),
        cmocka_unit_test(test_equilibrium),
        cmocka_unit_test(test_input_determines_output),
        cmocka_unit_test(test_alone),
        cmocka_unit_test(test_failures),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
