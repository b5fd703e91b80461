// test_fem_solve.c: statics that answer: far compression, contact by `extra`, refusals, meshes, memory.
#include "omentum/fem_grid.h"

#include "test_alloc.h"
#include "test_solid.h"

// A cube pressed to a share of its height between rough plates, whole load at once.
static void start_press(TestSolid* t, OmElement kind, OmLaw law, double squeeze) {
    *t = (TestSolid){.material = {.young = 3000, .poisson = 0.45, .law = law}};
    solid_box(t, kind, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), 4, 4, 4);
    solid_start(t);
    solid_clamp(t, 2, 0);
    solid_clamp(t, 2, 0.1);
    solid_hold(t, 2, 0.1, 2, -squeeze * 0.1);
}

// Equilibrium, or how far it got and why; never anything else.
static void check_answer(TestSolid* t, OmStatus status) {
    double *f = om_alloc(3 * (size_t)t->mesh.nnode, 8), free2 = 0, all2 = 0;
    assert_ok(om_fem_eval_force(t->solid, t->x, f, NULL));
    for (int i = 0; i < 3 * t->mesh.nnode; ++i) {
        assert_true(isfinite(t->x[i]));
        all2 += f[i] * f[i];
        if (!t->fixed[i]) free2 += f[i] * f[i];
        if (status == OM_OK && t->fixed[i]) assert_near(t->x[i] - t->mesh.x[i], t->goal[i], 1e-15);
    }
    assert_true(sqrt(free2) <= 2e-9 * sqrt(all2) + 1e-15);
    assert_true(om_fem_eval_volume(t->solid, t->x, NULL) > 0);
    if (status == OM_OK)
        assert_true(t->report.load == 1);
    else
        assert_true(t->report.load < 1 && t->report.reason[0]);
    om_free(f);
}

static void test_far_compression(void** context) {
    (void)context;
    const OmLaw law[] = {OM_COROTATIONAL,       OM_ST_VENANT_KIRCHHOFF, OM_NEO_HOOKEAN,
                         OM_STABLE_NEO_HOOKEAN, OM_MOONEY_RIVLIN,       OM_OGDEN};
    for (int n = 0; n < 6; ++n) {
        for (int kind = OM_TET4; kind <= OM_HEX8; kind += 2) {
            TestSolid t;
            start_press(&t, (OmElement)kind, law[n], 0.4);
            OmFemStaticDef def = om_fem_static_default_def(t.solid);
            def.min_step = 1.0 / 16;
            def.max_newton = 20;
            OmStatus status =
                om_fem_static_solve(t.solid, &t.load, &def, t.x, t.reaction, &t.report);
            printf(
                "press to 0.6, %s, %s: load %.3g, %d steps, %d cuts, %d Newton iterations, least J "
                "%.3f %s\n",
                om_law_name(law[n]), om_element_name(t.mesh.kind), t.report.load, t.report.nstep,
                t.report.ncut, t.report.nnewton, t.report.min_volume, t.report.reason);
            assert_true(status >= 0);
            check_answer(&t, status);
            if (law[n] == OM_NEO_HOOKEAN || law[n] == OM_MOONEY_RIVLIN)
                assert_int_equal(status, OM_OK);
            solid_done(&t);
        }
    }
}

// Multigrid CG and CHOLMOD find the same.
static void test_solvers_agree(void** context) {
    (void)context;
    double z[2];
    for (int k = 0; k < 2; ++k) {
        TestSolid t;
        start_press(&t, OM_TET10, OM_NEO_HOOKEAN, 0.2);
        OmFemStaticDef def = om_fem_static_default_def(t.solid);
        def.solver.preconditioner = k == 0 ? OM_CHOLESKY : OM_MULTIGRID;
        def.tolerance = 1e-11;
        assert_ok(om_fem_static_solve(t.solid, &t.load, &def, t.x, t.reaction, &t.report));
        assert_true((t.report.ncg > 0) == (k == 1));
        z[k] = 0;
        for (int i = 0; i < t.mesh.nnode; ++i)
            if (t.mesh.x[3 * i + 2] > 0.1 - 1e-9) z[k] += t.reaction[3 * i + 2];
        solid_done(&t);
    }
    assert_near_rel(z[0], z[1], 1e-9);
}

// One and four workers end in the same bytes.
static void test_determinism(void** context) {
    (void)context;
    uint64_t hash[2];
    for (int k = 0; k < 2; ++k) {
        TestSolid t;
        start_press(&t, OM_TET10, OM_NEO_HOOKEAN, 0.2);
        om_fem_destroy(t.solid);
        OmFemDef solid = om_fem_default_def(&t.mesh, 1, &t.material);
        solid.nworker = k == 0 ? 1 : 4;
        assert_ok(om_fem_create(&solid, &t.solid));
        OmFemStaticDef def = om_fem_static_default_def(t.solid);
        def.solver.preconditioner = OM_MULTIGRID;
        assert_ok(om_fem_static_solve(t.solid, &t.load, &def, t.x, t.reaction, &t.report));
        hash[k] = om_hash(t.x, 3 * (size_t)t.mesh.nnode * sizeof(double), OM_HASH_SEED);
        solid_done(&t);
    }
    assert_true(hash[0] == hash[1]);
}

typedef struct Recovery {
    OmElement kind;
    OmLaw law;
    OmLocking locking;
    double shake;  // m; nodes are 33 mm apart, of quadratic tetrahedra 17
    uint64_t seed, stream;
} Recovery;

// The border is held, the inside shaken about: it comes back to rest. The least J at first.
static double check_recovery(const Recovery* r) {
    TestSolid t = {.material = {.young = 3000, .poisson = 0.4, .law = r->law},
                   .locking = r->locking};
    solid_box(&t, r->kind, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), 3, 3, 3);
    solid_start(&t);
    for (int k = 0; k < 3; ++k) {
        solid_clamp(&t, k, 0);
        solid_clamp(&t, k, 0.1);
    }
    OmRng rng = om_rng_init(r->seed, r->stream);
    for (int i = 0; i < 3 * t.mesh.nnode; ++i)
        if (!t.fixed[i]) t.x[i] += r->shake * om_rng_range(&rng, -1, 1);
    double min = om_fem_eval_volume(t.solid, t.x, NULL), worst = 0;
    OmFemStaticDef def = om_fem_static_default_def(t.solid);
    def.max_newton = 60;
    def.load_begin = 0.5;
    def.min_step = 0.5;  // there is no load that could be raised in smaller steps
    def.tolerance = 1e-8;
    OmStatus status = om_fem_static_solve(t.solid, &t.load, &def, t.x, NULL, &t.report);
    for (int i = 0; i < 3 * t.mesh.nnode; ++i) worst = fmax(worst, fabs(t.x[i] - t.mesh.x[i]));
    printf("recovery, %s, %s: least J %.2f at first, %d Newton iterations, %.2g m from rest %s\n",
           om_element_name(r->kind), om_law_name(r->law), min, t.report.nnewton, worst,
           t.report.reason);
    assert_int_equal(status, OM_OK);
    assert_below(worst, 1e-7);
    solid_done(&t);
    return min;
}

static void test_recovery(void** context) {
    (void)context;
    const Recovery one[] = {{OM_TET4, OM_NEO_HOOKEAN, OM_LOCKING_NONE, 0.03, 3, 0},
                            {OM_TET4, OM_MOONEY_RIVLIN, OM_SMOOTHED, 0.03, 3, 1},
                            {OM_TET4, OM_STABLE_NEO_HOOKEAN, OM_NODAL_VOLUME, 0.03, 3, 2},
                            {OM_TET10, OM_NEO_HOOKEAN, OM_LOCKING_NONE, 0.006, 3, 3},
                            {OM_HEX8, OM_MOONEY_RIVLIN, OM_LOCKING_NONE, 0.03, 3, 4},
                            {OM_HEX8_MEAN, OM_NEO_HOOKEAN, OM_LOCKING_NONE, 0.03, 3, 5}};
    for (int c = 0; c < 6; ++c) assert_true(check_recovery(&one[c]) < 0);
}

// Quadratic tetrahedra from 20 shakes, the widest of 90 % of the distance of nodes. The last step to rest
// lowers the energy by less than its rounding, which once held up every third of these.
static void test_recovery_sweep(void** context) {
    (void)context;
    int ninverted = 0, nshake = 0;
    for (int n = 0; n < 20; n += test_is_slow() ? 1 : 5, ++nshake) {
        Recovery r = {OM_TET10, OM_NEO_HOOKEAN, OM_LOCKING_NONE, 0.005 + 0.0005 * n, 20, 0};
        r.stream = (uint64_t)n;
        if (n % 4 == 3) r.law = OM_MOONEY_RIVLIN;
        ninverted += check_recovery(&r) < 0;
    }
    assert_true(ninverted >= nshake - (test_is_slow() ? 2 : 1));
}

// With projected elements the tangent of any shape is positive definite.
static void test_projected_tangent(void** context) {
    (void)context;
    for (int kind = 0; kind < OM_NELEMENT + 2; ++kind) {
        OmMaterial material = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN};
        OmFemMesh mesh;
        const int num[3] = {2, 2, 2};
        OmElement element = kind < OM_NELEMENT ? (OmElement)kind : OM_TET4;
        assert_ok(om_fem_mesh_box(element, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), num, &mesh));
        OmSolverDef solver_def = om_solver_default_def();
        solver_def.preconditioner = OM_CHOLESKY;
        OmStatus status[2];
        for (int p = 0; p < 2; ++p) {
            OmFemDef def = om_fem_default_def(&mesh, 1, &material);
            OmFemSolid* solid;
            OmSolver* solver;
            OmBsr A;
            def.locking =
                kind < OM_NELEMENT ? OM_LOCKING_NONE : (OmLocking)(kind - OM_NELEMENT + 1);
            def.is_projected = p == 1;
            assert_ok(om_fem_create(&def, &solid));
            assert_ok(om_fem_matrix_create(solid, &A));
            OmRng rng = om_rng_init(5, 5);
            double* x = om_alloc(3 * (size_t)mesh.nnode, sizeof *x);
            for (int i = 0; i < 3 * mesh.nnode; ++i)
                x[i] = mesh.x[i] + om_rng_range(&rng, -0.03, 0.03);
            assert_ok(om_fem_eval_tangent(solid, x, &A));
            om_fem_add_mass(solid, 1e-3, false, &A);  // rigid motions have no stiffness
            assert_ok(om_solver_create(&solver_def, &A, NULL, &solver));
            status[p] = om_solver_refresh(solver, &A);
            om_solver_destroy(solver);
            om_bsr_destroy(&A);
            om_fem_destroy(solid);
            om_free(x);
        }
        assert_int_equal(status[0], OM_NOT_SPD);
        assert_int_equal(status[1], OM_OK);
        om_fem_mesh_done(&mesh);
    }
}

// ---- contact by `extra` -----------------------------------------------------------------------------

typedef struct Plate {  // a frictionless plate z <= height - travel load, on springs at nodes
    double height, travel, stiffness;
    int nnode, nfinish;
    double force;
} Plate;

static OmStatus plate_eval(void* ctx, const double* x, double load, double* energy, double* f,
                           OmBsr* A) {
    Plate* p = ctx;
    double sum = 0;
    for (int i = 0; i < p->nnode; ++i) {
        double depth = x[3 * i + 2] - (p->height - p->travel * load);
        if (depth <= 0) continue;
        if (energy) *energy += 0.5 * p->stiffness * depth * depth;
        if (f) f[3 * i + 2] += p->stiffness * depth;
        if (A) om_bsr_add(A, A->row_adr[i], om_mat3_diag(om_vec3(0, 0, p->stiffness)));
        sum += p->stiffness * depth;
    }
    if (f) p->force = sum;
    return OM_OK;
}

static OmStatus plate_finish(void* ctx, const double* x, double load) {
    (void)x, (void)load;
    Plate* p = ctx;
    return ++p->nfinish % 2 == 1 ? OM_NOT_CONVERGED : OM_OK;  // asks for one more solve each step
}

// The plate's force equals the force at the bottom; continuing from load_begin ends where one go does.
static void test_extra_contact(void** context) {
    (void)context;
    double whole = 0;
    for (int parts = 1; parts <= 2; ++parts) {
        TestSolid t = {.material = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN}};
        solid_box(&t, OM_TET10, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.05), 4, 4, 2);
        solid_start(&t);
        solid_clamp(&t, 2, 0);
        Plate plate = {.height = 0.05, .travel = 0.01, .stiffness = 1e3, .nnode = t.mesh.nnode};
        OmFemExtra extra = {plate_eval, plate_finish, &plate};
        t.load.extra = &extra;
        OmFemStaticDef def = om_fem_static_default_def(t.solid);
        if (parts == 2) {
            plate.travel = 0.005;
            assert_ok(om_fem_static_solve(t.solid, &t.load, &def, t.x, NULL, NULL));
            plate.travel = 0.01;
            def.load_begin = 0.5;
        }
        assert_ok(om_fem_static_solve(t.solid, &t.load, &def, t.x, t.reaction, &t.report));
        OmVec3 sum = {0, 0, 0};
        for (int i = 0; i < t.mesh.nnode; ++i) sum = om_add(sum, om_load3(t.reaction, i));
        assert_near_rel(sum.z, plate.force, 1e-7);
        assert_true(plate.nfinish >= 2);
        if (parts == 1) whole = plate.force;
        assert_near_rel(plate.force, whole, 1e-7);
        solid_done(&t);
    }
    printf("plate: %.4f N\n", whole);
}

// ---- refusals and memory ----------------------------------------------------------------------------

static bool stop_at_half(void* ctx, const char* stage, double done, double total) {
    (void)ctx, (void)stage;
    return done < 0.5 * total;
}

static void test_refusals(void** context) {
    (void)context;
    TestSolid t;
    start_press(&t, OM_TET4, OM_NEO_HOOKEAN, 0.2);
    OmFemStaticDef def = om_fem_static_default_def(t.solid), raw = {.nstep = 1};
    assert_status(om_fem_static_solve(t.solid, &t.load, &raw, t.x, NULL, NULL), OM_INVALID);
    t.force[4] = NAN;
    assert_status(om_fem_static_solve(t.solid, &t.load, &def, t.x, NULL, NULL), OM_INVALID);
    t.force[4] = 0;
    OmProgress progress = {stop_at_half, NULL};
    def.progress = &progress;
    def.nstep = 4;
    assert_status(om_fem_static_solve(t.solid, &t.load, &def, t.x, NULL, NULL), OM_CANCELLED);
    for (int i = 0; i < 3 * t.mesh.nnode; ++i) assert_true(t.x[i] == t.mesh.x[i]);
    OmFemDef bad = om_fem_default_def(&t.mesh, 1, &t.material);
    OmFemSolid* solid;
    t.mesh.elem_material[3] = 7;
    assert_status(om_fem_create(&bad, &solid), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "element 3"));
    t.mesh.elem_material[3] = 0;
    t.material.law = OM_COROTATIONAL;
    bad.locking = OM_NODAL_VOLUME;
    assert_status(om_fem_create(&bad, &solid), OM_INVALID);
    t.mesh.elem_node[1] = t.mesh.elem_node[0];
    assert_status(om_fem_mesh_validate(&t.mesh), OM_INVALID);
    solid_done(&t);
}

static OmStatus small_press(void* ctx) {
    const OmFemMesh* mesh = ctx;
    OmMaterial material = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN};
    OmFemDef def = om_fem_default_def(mesh, 1, &material);
    OmFemSolid* solid;
    def.locking = OM_NODAL_VOLUME;
    def.nworker = 1;
    OM_TRY(om_fem_create(&def, &solid));
    unsigned char fixed[24] = {0};
    double x[24], goal[24] = {0};
    memcpy(x, mesh->x, sizeof x);
    for (int i = 0; i < 24; ++i) fixed[i] = i < 12 || i % 3 == 2;
    for (int i = 14; i < 24; i += 3) goal[i] = -0.01;
    OmFemLoad load = {.fixed = fixed, .goal = goal};
    OmFemStaticDef how = om_fem_static_default_def(solid);
    how.solver.preconditioner = OM_BLOCK_JACOBI;
    how.solver.nworker = 1;
    OmStatus status = om_fem_static_solve(solid, &load, &how, x, NULL, NULL);
    om_fem_destroy(solid);
    return status;
}

// Everything else that allocates.
static OmStatus small_motion(void* ctx) {
    (void)ctx;
    OmFemMesh mesh = {0};
    OmFemFaces faces = {0};
    OmFemSolid* solid = NULL;
    OmFemDynamics* dynamics = NULL;
    OmMaterial material = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN};
    OmStatus status = OM_OK;
    const int num[3] = {1, 1, 1};
    double x[81], v[81] = {0}, weight[10], h, p[3] = {0.03, 0.05, 0.02};
    int elem;
    OM_TRY_DONE(om_fem_mesh_box(OM_TET10, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), num, &mesh));
    OM_TRY_DONE(om_fem_mesh_boundary(&mesh, &faces));
    OM_TRY_DONE(om_fem_mesh_embed(&mesh, 1, p, &elem, weight));
    OmFemDef def = om_fem_default_def(&mesh, 1, &material);
    def.nworker = 1;
    OM_TRY_DONE(om_fem_create(&def, &solid));
    memcpy(x, mesh.x, sizeof x);
    OM_TRY_DONE(om_fem_eval_stable_step(solid, x, NULL, &h));
    OmFemDynamicDef how = om_fem_dynamic_default_def(solid);
    how.solver.preconditioner = OM_MULTIGRID;
    how.solver.nworker = 1;
    OM_TRY_DONE(om_fem_dynamics_create(solid, &how, &dynamics));
    OmFemMotion m = {x, v, 0};
    OmFemLoad load = {.body = {0, 0, -9.81}};
    OM_TRY_DONE(om_fem_step(dynamics, &load, 0.01, &m, NULL));
done:
    om_fem_dynamics_destroy(dynamics);
    om_fem_destroy(solid);
    om_fem_faces_done(&faces);
    om_fem_mesh_done(&mesh);
    return status;
}

static void test_memory(void** context) {
    (void)context;
    OmFemMesh mesh;
    const int num[3] = {1, 1, 1};
    assert_ok(om_fem_mesh_box(OM_TET4, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), num, &mesh));
    int nfail = test_failing_allocations(small_press, &mesh, 1);
    printf("memory: %d allocations failed in turn\n", nfail);
    assert_true(nfail > 40);
    assert_true(test_failing_allocations(small_motion, NULL, 1) > 60);
    om_fem_mesh_done(&mesh);
}

// ---- meshes -----------------------------------------------------------------------------------------

static double ball(void* ctx, OmVec3 p) {
    (void)ctx;
    return om_norm(p) - 0.05;
}

static void test_grid(void** context) {
    (void)context;
    OmSdf sdf;
    OmSdfDef def = om_sdf_default_def(0.003);
    OmFemGrid grid;
    assert_ok(om_sdf_from_function(ball, NULL, om_vec3(-0.06, -0.06, -0.06),
                                   om_vec3(0.06, 0.06, 0.06), &def, &sdf));
    assert_ok(om_fem_grid_from_sdf(&sdf, 0.01, &grid));
    assert_ok(om_fem_mesh_validate(&grid.mesh));
    double volume = grid.mesh.nelem * 1e-6;
    assert_true(volume > 5.236e-4 &&
                volume < 9.5e-4);  // the ball's, and that of the cells it touches
    // the first node of an element is the lowest point of its cell
    for (int e = 0; e < grid.mesh.nelem; ++e)
        assert_int_equal(grid.cell_elem[grid.node_point[grid.mesh.elem_node[8 * e]]], e);
    // every point of the ball is in a cell
    OmRng rng = om_rng_init(1, 2);
    for (int n = 0; n < 2000; ++n) {
        OmVec3 d =
            om_normalize(om_vec3(om_rng_normal(&rng), om_rng_normal(&rng), om_rng_normal(&rng)));
        OmVec3 p = om_sub(om_scale(0.0499 * cbrt(om_rng_uniform(&rng)), d), grid.grid.origin);
        int i = (int)(p.x / 0.01), j = (int)(p.y / 0.01), k = (int)(p.z / 0.01);
        assert_true(grid.cell_elem[om_grid_index(grid.grid.dim, i, j, k)] >= 0);
    }
    om_fem_grid_done(&grid);
    om_sdf_done(&sdf);
}

// Boundary faces close the body and point outward; embedded points come back.
static void test_boundary_and_embedding(void** context) {
    (void)context;
    for (int kind = 0; kind < OM_NELEMENT; ++kind) {
        OmFemMesh mesh;
        OmFemFaces faces;
        const int num[3] = {3, 2, 4};
        assert_ok(
            om_fem_mesh_box((OmElement)kind, om_vec3(0, 0, 0), om_vec3(0.3, 0.2, 0.4), num, &mesh));
        for (int i = 0; i < mesh.nnode; ++i)
            mesh.x[3 * i] += 0.3 * mesh.x[3 * i + 1] * mesh.x[3 * i + 2];
        assert_ok(om_fem_mesh_boundary(&mesh, &faces));
        double volume = 0;
        for (int f = 0; f < faces.nface; ++f) {
            const int* v = faces.face_node + f * faces.nface_node;
            for (int a = 1; a + 1 < (faces.nface_node == 4 ? 4 : 3); ++a)
                volume += om_dot(om_load3(mesh.x, v[0]),
                                 om_cross(om_load3(mesh.x, v[a]), om_load3(mesh.x, v[a + 1]))) /
                          6;
        }
        assert_near_rel(volume, 0.024, kind == OM_TET10 ? 2e-3 : 1e-2);
        OmRng rng = om_rng_init(9, (uint64_t)kind);
        double p[60 * 3], weight[60 * 10];
        int elem[60];
        for (int n = 0; n < 60; ++n) {
            OmVec3 q = {om_rng_range(&rng, 0.03, 0.27), om_rng_range(&rng, 0.02, 0.18),
                        om_rng_range(&rng, 0.02, 0.38)};
            q.x += 0.3 * q.y * q.z;
            om_store3(p, n, q);
        }
        assert_ok(om_fem_mesh_embed(&mesh, 60, p, elem, weight));
        for (int n = 0; n < 60; ++n) {
            OmVec3 q = {0, 0, 0};
            double sum = 0;
            for (int a = 0; a < mesh.nelem_node; ++a) {
                double w = weight[n * mesh.nelem_node + a];
                sum += w;
                q = om_madd(q, w, om_load3(mesh.x, mesh.elem_node[elem[n] * mesh.nelem_node + a]));
            }
            assert_near(sum, 1, 1e-12);
            assert_below(om_distance(q, om_load3(p, n)), 1e-10);
        }
        double far[3] = {1, 0.1, 0.1};
        assert_ok(om_fem_mesh_embed(&mesh, 1, far, elem, weight));
        for (int a = 0; a < mesh.nelem_node; ++a) assert_true(fabs(weight[a]) <= 1 + 1e-9);
        om_fem_faces_done(&faces);
        om_fem_mesh_done(&mesh);
    }
}

// A tolerance below rounding ends at rounding: hardly an iteration more, no cut, and OM_OK.
static void test_floor_of_rounding(void** context) {
    (void)context;
    const OmLaw laws[] = {OM_COROTATIONAL, OM_NEO_HOOKEAN, OM_STABLE_NEO_HOOKEAN};
    for (int k = 0; k < 6; ++k) {
        int num[2];
        for (int fine = 0; fine < 2; ++fine) {
            TestSolid t = {.material = {.young = 3e3, .poisson = 0.45, .law = laws[k % 3]}};
            solid_box(&t, OM_HEX8, om_vec3(0, 0, 0), om_vec3(0.1, 0.03, 0.03), 8, 3, 3);
            solid_start(&t);
            solid_clamp(&t, 0, 0);
            t.load.body = om_vec3(0, 0, -1);
            if (k < 3) {
                solid_solve(&t, 1, fine ? 1e-16 : 1e-9);
                num[fine] = t.report.nnewton;
                assert_int_equal(t.report.ncut, 0);
            } else {
                OmFemDynamicDef def = om_fem_dynamic_default_def(t.solid);
                OmFemDynamics* d;
                OmFemMotion m = {t.x, t.v, 0};
                def.tolerance = fine ? 1e-16 : 1e-9;
                assert_ok(om_fem_dynamics_create(t.solid, &def, &d));
                num[fine] = 0;
                for (int n = 0; n < 10; ++n) {
                    assert_ok(om_fem_step(d, &t.load, 0.01, &m, &t.report));
                    num[fine] += t.report.nnewton;
                    assert_int_equal(t.report.ncut, 0);
                }
                om_fem_dynamics_destroy(d);
            }
            solid_done(&t);
        }
        assert_true(num[1] <= num[0] + (k < 3 ? 2 : 10));  // one more a step
    }
}

// A straight column, pressed by 6 % between clamps, where Euler's buckling strain is 3.3 %: straight is equilibrium,
// and is said to be unstable; pushed aside a little, the column buckles, and is stable.
static void test_instability_is_reported(void** context) {
    (void)context;
    for (int push = 0; push < 2; ++push) {
        TestSolid t = {.material = {.young = 1e5, .poisson = 0, .law = OM_NEO_HOOKEAN}};
        solid_box(&t, OM_TET10, om_vec3(0, 0, 0), om_vec3(0.1, 0.01, 0.01), 10, 1, 1);
        solid_start(&t);
        solid_clamp(&t, 0, 0);
        solid_clamp(&t, 0, 0.1);
        solid_hold(&t, 0, 0.1, 0, -0.006);
        t.load.body = om_vec3(0, 0, push ? -0.5 : 0);
        solid_solve(&t, 4, 1e-9);
        double aside = 0;
        for (int i = 0; i < t.mesh.nnode; ++i)
            aside = fmax(aside, fabs(t.x[3 * i + 2] - t.mesh.x[3 * i + 2]));
        printf("column: %.2f mm aside, %s\n", 1e3 * aside,
               t.report.is_unstable ? "unstable" : "stable");
        assert_true(t.report.is_unstable == (aside < 1e-3));
        if (push) assert_false(t.report.is_unstable);
        solid_done(&t);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_floor_of_rounding),
        cmocka_unit_test(test_instability_is_reported),
        cmocka_unit_test(test_far_compression),
        cmocka_unit_test(test_solvers_agree),
        cmocka_unit_test(test_determinism),
        cmocka_unit_test(test_recovery),
        cmocka_unit_test(test_recovery_sweep),
        cmocka_unit_test(test_projected_tangent),
        cmocka_unit_test(test_extra_contact),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_grid),
        cmocka_unit_test(test_boundary_and_embedding),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
