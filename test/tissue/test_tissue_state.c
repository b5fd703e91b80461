// test_tissue_state.c: snapshots, hashes, workers, solvers, allocations, embedded points.
#include "test_rig.h"

#include "test_alloc.h"

static const OmVec3 lo = {0, 0, 0}, hi = {0.06, 0.03, 0.01};

static void start_with(TestRig* r, int nworker, OmPreconditioner preconditioner, double tolerance) {
    rig_box(r, lo, hi, 12, 6, 2);
    rig_attach_plane(r, 0, 0);
    r->def.solver.nworker = nworker;
    r->def.solver.preconditioner = preconditioner;
    r->def.solver.tolerance = tolerance;
    rig_start(r);
}

static void start(TestRig* r, int nworker, OmPreconditioner preconditioner) {
    start_with(r, nworker, preconditioner, 1e-6);
}

// One step of a lift; the grasp is in the first.
static void lift(TestRig* r, int n) {
    OmPose tip = {om_vec3(0.055, 0.015, 0.01 + 0.0004 * n), om_quat_identity()};
    if (n == 0) assert_ok(om_tissue_grasp(r->m, r->s, 0, tip, 0, NULL));
    assert_ok(om_tissue_move_grasp(r->s, 0, tip));
    assert_ok(om_tissue_step(r->m, r->s, r->w, 0.02, NULL));
}

// A snapshot is a copy of the block; from it the same steps give the same bytes, in another work too.
static void test_snapshot(void** context) {
    (void)context;
    TestRig r;
    start(&r, 1, OM_MULTIGRID);
    size_t size = om_tissue_state_size(r.m);
    uint64_t at_rest = om_tissue_state_hash(r.s), at_five, at_ten;
    void* copy = om_alloc(size, 1);
    for (int n = 0; n < 5; ++n) lift(&r, n);
    memcpy(copy, r.s, size);
    at_five = om_tissue_state_hash(r.s);
    for (int n = 5; n < 10; ++n) lift(&r, n);
    at_ten = om_tissue_state_hash(r.s);
    assert_true(at_rest != at_five && at_five != at_ten);
    memcpy((void*)r.s, copy, size);
    assert_true(om_tissue_state_hash(r.s) == at_five);
    for (int n = 5; n < 10; ++n) lift(&r, n);
    assert_true(om_tissue_state_hash(r.s) == at_ten);
    // another state of the model, and scratch that has seen nothing
    OmTissueState* own = r.s;
    assert_ok(om_tissue_state_create(r.m, &r.s));
    memcpy((void*)r.s, copy, size);
    om_tissue_work_destroy(r.w);
    assert_ok(om_tissue_work_create(r.m, &r.w));
    for (int n = 5; n < 10; ++n) lift(&r, n);
    assert_true(om_tissue_state_hash(r.s) == at_ten);
    om_tissue_state_reset(r.m, r.s);
    assert_true(om_tissue_state_hash(r.s) == at_rest);
    om_tissue_state_destroy(own);
    om_free(copy);
    rig_done(&r);
}

static uint64_t hash_of_lift(int nworker, OmPreconditioner preconditioner) {
    TestRig r;
    start_with(&r, nworker, preconditioner,
               1e-2);  // two workers meet often: slow on a busy machine
    for (int n = 0; n < 4; ++n) lift(&r, n);
    uint64_t hash = om_tissue_state_hash(r.s);
    rig_done(&r);
    return hash;
}

static void test_same_bytes(void** context) {
    (void)context;
    for (int p = OM_BLOCK_JACOBI; p <= OM_MULTIGRID; ++p) {
        uint64_t one = hash_of_lift(1, (OmPreconditioner)p);
        assert_true(hash_of_lift(1, (OmPreconditioner)p) == one);
        assert_true(hash_of_lift(2, (OmPreconditioner)p) == one);
    }
}

// The three solvers walk the same path: 30 steps of a lift, to their tolerance of 1e-6 a step.
static void test_solvers_agree(void** context) {
    (void)context;
    TestRig r[3];
    double worst = 0;
    for (int p = 0; p < 3; ++p) {
        start(&r[p], 1, (OmPreconditioner)p);
        for (int n = 0; n < 30; ++n) lift(&r[p], n);
    }
    for (int p = 0; p < 2; ++p)
        for (int i = 0; i < r[0].mesh.nvert; ++i)
            worst = fmax(worst, om_norm(om_sub(om_load3(om_tissue_x(r[p].s), i),
                                               om_load3(om_tissue_x(r[2].s), i))));
    printf("after 12 mm of lift the solvers are at most %.2g m apart\n", worst);
    assert_below(worst, 2e-6);
    for (int p = 0; p < 3; ++p) rig_done(&r[p]);
}

// After the first step nothing is allocated: not by steps, grasps, releases, forces, hashes or snapshots.
static void test_no_allocation(void** context) {
    (void)context;
    for (int p = OM_BLOCK_JACOBI; p <= OM_MULTIGRID; ++p) {
        TestRig r;
        start(&r, 1, (OmPreconditioner)p);
        double* f = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *f);
        OmTissueForces forces;
        OmTissueEnergy energy;
        assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        test_count_begin();
        for (int n = 0; n < 5; ++n) lift(&r, n);
        om_tissue_release(r.s, 0);
        for (int n = 0; n < 5; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        assert_ok(om_tissue_get_forces(r.m, r.s, &forces));
        assert_ok(om_tissue_get_holding_force(r.m, r.s, f));
        assert_ok(om_tissue_get_energy(r.m, r.s, &energy));
        om_tissue_state_reset(r.m, r.s);
        assert_int_equal(test_count_end(), 0);
        om_free(f);
        rig_done(&r);
    }
}

static OmStatus make_all(void* ctx) {
    const OmTissueDef* def = ctx;
    OmTissueModel* m = NULL;
    OmTissueState* s = NULL;
    OmTissueWork* w = NULL;
    OmEmbedding points = {0};
    const double point[6] = {0.01, 0.01, 0.005, 0.02, 0.02, 0.01};
    OmStatus status = om_tissue_create(def, &m);
    if (status == OM_OK) status = om_tissue_state_create(m, &s);
    if (status == OM_OK) status = om_tissue_work_create(m, &w);
    if (status == OM_OK) status = om_tissue_step(m, s, w, 0.02, NULL);
    if (status == OM_OK) status = om_tissue_embed(m, 2, point, &points);
    om_embedding_done(&points);
    om_tissue_work_destroy(w);
    om_tissue_state_destroy(s);
    om_tissue_destroy(m);
    return status;
}

static void test_failing_memory(void** context) {
    (void)context;
    for (int p = OM_BLOCK_JACOBI; p <= OM_CHOLESKY; ++p) {
        TestRig r;
        rig_box(&r, lo, hi, 4, 2, 1);
        rig_attach_plane(&r, 0, 0);
        r.def.mesh = &r.mesh;
        r.def.solver.preconditioner = (OmPreconditioner)p;
        assert_true(test_failing_allocations(make_all, &r.def, 1) > 20);
        rig_done(&r);
    }
}

// Points inside are carried by a linear map exactly; points off the surface by the nearest element.
static void test_embedding(void** context) {
    (void)context;
    TestRig r;
    start(&r, 1, OM_BLOCK_JACOBI);
    enum { N = 200 };
    double point[3 * N], moved[3 * N];
    double* x = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *x);
    OmRng rng = om_rng_init(9, 0);
    for (int k = 0; k < N; ++k)
        om_store3(point, k,
                  om_vec3(om_rng_range(&rng, -0.002, 0.062), om_rng_range(&rng, 0, 0.03),
                          om_rng_range(&rng, 0, 0.012)));
    OmEmbedding e;
    assert_ok(om_tissue_embed(r.m, N, point, &e));
    OmMat3 F = {{1.1, 0.2, 0}, {-0.3, 0.9, 0.1}, {0, 0.4, 1.3}};
    for (int i = 0; i < r.mesh.nvert; ++i) om_store3(x, i, om_mat3_apply(F, om_load3(r.mesh.x, i)));
    om_embedding_eval(&e, x, moved);
    for (int k = 0; k < N; ++k) {
        OmVec3 goal = om_mat3_apply(F, om_load3(point, k));
        assert_near(om_norm(om_sub(om_load3(moved, k), goal)), 0, 1e-15);
        double sum = 0, low = 1;
        for (int a = 0; a < 4; ++a) {
            sum += e.bary[4 * k + a];
            low = fmin(low, e.bary[4 * k + a]);
        }
        assert_near(sum, 1, 1e-14);
        OmVec3 p = om_load3(point, k);
        if (p.x >= 0 && p.x <= 0.06 && p.z <= 0.01) assert_true(low > -1e-9);
    }
    om_embedding_done(&e);
    om_free(x);
    rig_done(&r);
}

// Positions that are set come with their velocities, or at rest.
static void test_positions_at_rest(void** context) {
    (void)context;
    TestRig r;
    start(&r, 1, OM_MULTIGRID);
    size_t n = 3 * (size_t)r.mesh.nvert;
    double *x = om_alloc(n, sizeof *x), *v = om_alloc(n, sizeof *v);
    for (size_t i = 0; i < n; ++i) x[i] = r.mesh.x[i], v[i] = 0.01 * (double)(i % 5);
    assert_ok(om_tissue_set_x(r.m, r.s, x, v));
    assert_memory_equal(om_tissue_v(r.s), v, n * sizeof *v);
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_memory_equal(om_tissue_x(r.s), x, n * sizeof *x);
    for (size_t i = 0; i < n; ++i) assert_near(om_tissue_v(r.s)[i], 0, 0);
    om_free(x);
    om_free(v);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_positions_at_rest), cmocka_unit_test(test_snapshot),
        cmocka_unit_test(test_same_bytes),        cmocka_unit_test(test_solvers_agree),
        cmocka_unit_test(test_no_allocation),     cmocka_unit_test(test_failing_memory),
        cmocka_unit_test(test_embedding)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
