// test_fem_contact.c: two bodies that press on each other: derivatives, balance, patch test, FEBio co01, collision.
#include "test_alloc.h"
#include "test_solid.h"

typedef struct Stack {  // a block on a block
    TestSolid t;
    int nlower;  // nodes of the lower block come first
    OmFemFaces side[2];
    OmFemContact contact;
} Stack;

// Faces of a block whose nodes all have z = at; node numbers go up by `first`.
static void find_side(const OmFemMesh* mesh, double at, int first, OmFemFaces* side) {
    TestSolid block = {.mesh = *mesh};
    assert_ok(om_fem_mesh_boundary(mesh, &block.faces));
    solid_keep_faces(&block, 2, at);
    *side = block.faces;
    for (int n = 0; n < side->nface * side->nface_node; ++n) side->face_node[n] += first;
}

// The unit square twice, [0, 1] below and [1, 2] above, of n[0]^2 and n[1]^2 cells a layer, one or two layers.
static void start_stack(Stack* s, OmElement kind, const int n[2], OmMaterial material,
                        double stiffness, double overlap) {
    OmFemMesh part[2];
    *s = (Stack){.t = {.material = material, .density = 1}};
    for (int k = 0; k < 2; ++k) {
        int num[3] = {n[k], n[k], n[k] > 1 ? 2 : 1};
        double z = k == 0 ? 0 : 1 - overlap;
        assert_ok(om_fem_mesh_box(kind, om_vec3(0, 0, z), om_vec3(1, 1, z + 1), num, &part[k]));
        find_side(&part[k], k == 0 ? 1 : z, k == 0 ? 0 : part[0].nnode, &s->side[k]);
        s->contact.nface[k] = s->side[k].nface;
        s->contact.face_node[k] = s->side[k].face_node;
    }
    s->nlower = part[0].nnode;
    s->contact.stiffness = stiffness;
    assert_ok(om_fem_mesh_join(&part[0], &part[1], &s->t.mesh));
    assert_ok(om_fem_mesh_validate(&s->t.mesh));
    om_fem_mesh_done(&part[0]);
    om_fem_mesh_done(&part[1]);
    s->t.contact = &s->contact;
    solid_start(&s->t);
}

static void end_stack(Stack* s) {
    solid_done(&s->t);
    om_fem_faces_done(&s->side[0]);
    om_fem_faces_done(&s->side[1]);
}

static const OmMaterial soft = {.young = 1, .poisson = 0.3, .law = OM_NEO_HOOKEAN};

// ---- F1, FEBio co01 ---------------------------------------------------------------------------------

// Two cubes pressed together by 0.2; the norm of 0.282846613634 there belongs to a penalty of 100.
static void test_two_cubes(void** context) {
    (void)context;
    const double stiffness[3] = {100, 1e4, 0};
    for (int k = 0; k < 3; ++k) {
        Stack s;
        const int n[2] = {1, 1};
        start_stack(&s, OM_HEX8, n, (OmMaterial){.young = 1, .law = OM_NEO_HOOKEAN}, stiffness[k],
                    0);
        TestSolid* t = &s.t;
        for (int i = 0; i < 3 * t->mesh.nnode; ++i) t->fixed[i] = i % 3 != 2;
        solid_clamp(t, 2, 0);
        solid_hold(t, 2, 2, 2, -0.2);
        solid_solve(t, 1, 1e-12);
        OmFemTouch touch;
        assert_ok(om_fem_eval_contact(t->solid, t->x, 0, &touch, NULL));
        printf("two cubes, %g Pa/m: norm %.12f, depth %.3g, force %.6f, %d Newton iterations\n",
               stiffness[k], solid_free_norm(t), touch.depth, touch.force.z, t->report.nnewton);
        if (k == 0) assert_near_rel(solid_free_norm(t), 0.282846613634, 1e-6);
        if (k == 1) assert_near_rel(solid_free_norm(t), 0.282842712475, 1e-6);
        assert_near_rel(solid_free_norm(t), 0.282842712475, 1e-3);
        end_stack(&s);
    }
}

// ---- derivatives and balance ------------------------------------------------------------------------

// Blocks of unlike meshes pushed into each other and shaken: every kind of spot is met, curved faces too.
static void start_shaken(Stack* s, OmElement kind, uint64_t seed) {
    const int n[2] = {2, 3};
    start_stack(s, kind, n, soft, 40, 0);
    OmRng rng = om_rng_init(11, seed);
    for (int i = 0; i < s->t.mesh.nnode; ++i) {
        OmVec3 u = {om_rng_range(&rng, -1, 1), om_rng_range(&rng, -1, 1),
                    om_rng_range(&rng, -1, 1)};
        if (i >= s->nlower) u = om_add(u, om_vec3(3, 2, -3));
        om_store3(s->t.x, i, om_madd(om_load3(s->t.x, i), 0.03, u));
    }
}

static void test_derivatives(void** context) {
    (void)context;
    for (int kind = 0; kind < OM_NELEMENT; ++kind) {
        Stack s;
        start_shaken(&s, (OmElement)kind, (uint64_t)kind);
        TestSolid* t = &s.t;
        size_t n = 3 * (size_t)t->mesh.nnode;
        double *f = om_alloc(n, 8), *more = om_alloc(n, 8), *less = om_alloc(n, 8), h = 1e-6;
        double worst_f = 0, worst_A = 0, size_f = 0, size_A = 0;
        OmBsr A;
        OmFemTouch touch, up, down;
        assert_ok(om_fem_matrix_create(t->solid, &A));
        assert_ok(om_fem_eval_contact(t->solid, t->x, 0, &touch, f));
        assert_true(touch.area > 0.3 && touch.energy > 0);
        for (size_t i = 0; i < n; ++i) size_f = fmax(size_f, fabs(f[i]));
        assert_ok(om_fem_eval_tangent(t->solid, t->x, &A));
        for (int k = 0; k < A.nblock; ++k)
            for (int i = 0; i < 9; ++i) size_A = fmax(size_A, fabs(A.exact[9 * k + i]));
        const size_t stride = test_is_slow() ? 1 : 4;  // not a multiple of 3: every axis in turn
        for (size_t i = 0; i < n; i += stride) {       // of nodes that touch
            double x = t->x[i];
            if (om_norm2(om_load3(f, (int)i / 3)) == 0) continue;
            t->x[i] = x + h;
            assert_ok(om_fem_eval_contact(t->solid, t->x, 0, &up, NULL));
            assert_ok(om_fem_eval_force(t->solid, t->x, more, NULL));
            t->x[i] = x - h;
            assert_ok(om_fem_eval_contact(t->solid, t->x, 0, &down, NULL));
            assert_ok(om_fem_eval_force(t->solid, t->x, less, NULL));
            t->x[i] = x;
            worst_f = fmax(worst_f, fabs((up.energy - down.energy) / (2 * h) - f[i]));
            for (size_t j = 0; j < n; ++j) {
                int at = om_bsr_find(&A, (int)j / 3, (int)i / 3);
                double exact = at < 0 ? 0 : A.exact[9 * (size_t)at + 3 * (i % 3) + j % 3];
                double slope = (more[j] - less[j]) / (2 * h);
                worst_A = fmax(worst_A, fabs(slope - exact));
            }
        }
        printf("%s in contact: forces within %.1e, tangent within %.1e of differences\n",
               om_element_name((OmElement)kind), worst_f / size_f, worst_A / size_A);
        assert_below(worst_f / size_f, 1e-8);  // h^2, and rounding / h
        assert_below(worst_A / size_A, 1e-7);
        om_bsr_destroy(&A);
        om_free(f);
        om_free(more);
        om_free(less);
        end_stack(&s);
    }
}

// Both sides feel the same, without torque; a rigid motion changes no energy and turns the forces along.
static void test_balance(void** context) {
    (void)context;
    for (int kind = 0; kind < OM_NELEMENT; ++kind) {
        Stack s;
        start_shaken(&s, (OmElement)kind, 20 + (uint64_t)kind);
        TestSolid* t = &s.t;
        double* f = om_alloc(3 * (size_t)t->mesh.nnode, 8);
        OmFemTouch touch, turned;
        assert_ok(om_fem_eval_contact(t->solid, t->x, 0, &touch, f));
        OmVec3 side[2] = {{0, 0, 0}, {0, 0, 0}}, torque[2] = {{0, 0, 0}, {0, 0, 0}};
        for (int i = 0; i < t->mesh.nnode; ++i) {
            int k = i >= s.nlower;
            side[k] = om_sub(side[k], om_load3(f, i));
            torque[k] = om_sub(torque[k], om_cross(om_load3(t->x, i), om_load3(f, i)));
        }
        double size = om_norm(touch.force);
        assert_true(size > 0.1 && touch.force.z < 0);
        assert_below(om_norm(om_add(side[0], side[1])), 1e-14 * size);
        assert_below(om_norm(om_add(torque[0], torque[1])), 1e-13 * size);
        assert_below(om_distance(side[0], touch.force), 1e-13 * size);
        assert_below(om_distance(torque[0], touch.torque), 1e-13 * size);
        OmQuat q = om_quat_axis_angle(om_vec3(0.3, -1.1, 0.7), 1.3);
        for (int i = 0; i < t->mesh.nnode; ++i)
            om_store3(t->x, i, om_add(om_quat_rotate(q, om_load3(t->x, i)), om_vec3(0.4, -2, 0.1)));
        assert_ok(om_fem_eval_contact(t->solid, t->x, 0, &turned, NULL));
        assert_near_rel(turned.energy, touch.energy, 1e-12);
        assert_below(om_distance(turned.force, om_quat_rotate(q, touch.force)), 1e-12 * size);
        om_free(f);
        end_stack(&s);
    }
}

// ---- patch test -------------------------------------------------------------------------------------

// Blocks of unlike meshes pressed together evenly: how far stresses are from even.
static void test_patch(void** context) {
    (void)context;
    const OmElement kind[3] = {OM_HEX8, OM_TET4, OM_TET10};
    for (int k = 0; k < 3; ++k) {
        for (int like = 0; like < 2; ++like) {
            Stack s;
            const int n[2] = {3, like ? 3 : 4};
            OmMaterial material = {.young = 1, .poisson = 0, .law = OM_NEO_HOOKEAN};
            start_stack(&s, kind[k], n, material, 0, 0);
            TestSolid* t = &s.t;
            for (int a = 0; a < 3; ++a) solid_hold(t, a, 0, a, 0);
            for (int a = 0; a < 2; ++a) solid_hold(t, a, 1, a, 0);
            solid_hold(t, 2, 2, 2, -0.1);
            solid_solve(t, 1, 1e-10);
            double mean = 0, worst = 0;
            for (int pass = 0; pass < 2; ++pass) {
                for (int e = 0; e < t->mesh.nelem; ++e) {
                    OmMat3 stress;
                    assert_ok(om_fem_eval_stress(t->solid, t->x, e, NULL, &stress, NULL));
                    if (pass == 0) mean += stress.cz.z / t->mesh.nelem;
                    if (pass == 1) worst = fmax(worst, fabs(stress.cz.z / mean - 1));
                }
            }
            OmFemTouch touch;
            assert_ok(om_fem_eval_contact(t->solid, t->x, 0, &touch, NULL));
            printf("patch, %s on %s: stress %.5f within %.2g, force %.6f, depth %.2g\n",
                   like ? "like" : "unlike", om_element_name(kind[k]), mean, worst, touch.force.z,
                   touch.depth);
            // points of one mesh do not see where faces of the other end
            assert_below(worst, like ? 1e-11 : 4e-3);
            assert_near_rel(touch.force.z, mean, like ? 1e-9 : 1e-4);  // the section stays 1 m^2
            assert_below(touch.depth, 5e-3 * 0.1);
            assert_below(fabs(touch.force.x) + fabs(touch.force.y), 1e-5 * fabs(touch.force.z));
            end_stack(&s);
        }
    }
}

// A block that has slid halfway off: what hangs over does not touch, and nothing pushes it back.
static void test_overhang(void** context) {
    (void)context;
    for (int kind = 0; kind < OM_NELEMENT; ++kind) {
        Stack s;
        const int n[2] = {4, 5};
        start_stack(&s, (OmElement)kind, n, soft, 100, 0);
        for (int i = s.nlower; i < s.t.mesh.nnode; ++i) {
            s.t.x[3 * i] += 0.4;
            s.t.x[3 * i + 2] -= 0.02;
        }
        OmFemTouch touch;
        assert_ok(om_fem_eval_contact(s.t.solid, s.t.x, 0, &touch, NULL));
        printf("overhang, %s: area %.3f, force %.4f\n", om_element_name((OmElement)kind),
               touch.area, touch.force.z);
        assert_near(touch.area, 0.6, 0.05);  // of whole points, 0.04 to 0.1 apart
        assert_near_rel(touch.force.z, -2 * touch.area, 1e-9);
        assert_below(fabs(touch.force.x) + fabs(touch.force.y), 1e-12);
        assert_near_rel(touch.depth, 0.02, 1e-9);
        end_stack(&s);
    }
}

// ---- dynamics ---------------------------------------------------------------------------------------

// A block falls on another that is free: they part again, momenta are kept and energy nearly.
static void test_collision(void** context) {
    (void)context;
    Stack s;
    const int n[2] = {2, 3};
    start_stack(&s, OM_HEX8, n, (OmMaterial){.young = 10, .law = OM_NEO_HOOKEAN}, 0, -0.02);
    TestSolid* t = &s.t;
    for (int i = s.nlower; i < t->mesh.nnode; ++i) om_store3(t->v, i, om_vec3(0.05, 0, -0.2));
    OmFemDynamicDef def = om_fem_dynamic_default_def(t->solid);
    OmFemDynamics* d;
    def.integrator = OM_IMPLICIT_MIDPOINT;
    assert_ok(om_fem_dynamics_create(t->solid, &def, &d));
    OmFemMotion m = {t->x, t->v, 0};
    OmVec3 p0, L0, p, L;
    double kinetic = om_fem_eval_momentum(t->solid, false, &m, &p0, &L0), stored, deepest = 0;
    double size = om_norm(p0), worst = 0;
    OmFemTouch touch = {0};
    for (int step = 0; step < 200; ++step) {
        assert_ok(om_fem_step(d, &t->load, 0.005, &m, &t->report));
        assert_ok(om_fem_eval_contact(t->solid, t->x, 0, &touch, NULL));
        deepest = fmax(deepest, touch.depth);
        double now = om_fem_eval_momentum(t->solid, false, &m, &p, &L);
        assert_ok(om_fem_eval_energy(t->solid, t->x, &stored));
        worst = fmax(worst, fabs((now + stored) / kinetic - 1));
        assert_below(om_distance(p, p0), 1e-8 * size);
        assert_below(om_distance(L, L0), 1e-8 * size);
    }
    OmVec3 upper = {0, 0, 0};
    double mass = 0;
    for (int i = s.nlower; i < t->mesh.nnode; ++i) {
        upper = om_madd(upper, om_fem_mass(t->solid)[i], om_load3(t->v, i));
        mass += om_fem_mass(t->solid)[i];
    }
    printf("collision: depth %.2g m, energy within %.2g, the upper block leaves at %.3f m/s\n",
           deepest, worst, upper.z / mass);
    assert_true(deepest > 0 && touch.depth == 0);
    assert_below(worst, 0.03);  // second order in the step, which the impact's corners are not
    assert_true(upper.z / mass > -0.02);
    assert_near_rel(upper.x / mass, 0.05, 0.05);  // no friction, but the faces bulge
    om_fem_dynamics_destroy(d);
    end_stack(&s);
}

// ---- tangents, bytes, refusals, memory --------------------------------------------------------------

// With projected elements the tangent is positive definite, however the faces lie.
static void test_projected(void** context) {
    (void)context;
    OmSolverDef def = om_solver_default_def();
    def.preconditioner = OM_CHOLESKY;
    for (int kind = 0; kind < OM_NELEMENT; ++kind) {
        Stack s;
        OmFemSolid* solid;
        OmSolver* solver;
        OmBsr A;
        start_shaken(&s, (OmElement)kind, 40 + (uint64_t)kind);
        OmFemDef projected = om_fem_default_def(&s.t.mesh, 1, &s.t.material);
        projected.contact = &s.contact;
        projected.ncontact = 1;
        projected.is_projected = true;
        assert_ok(om_fem_create(&projected, &solid));
        assert_ok(om_fem_matrix_create(solid, &A));
        assert_ok(om_fem_eval_tangent(solid, s.t.x, &A));
        om_fem_add_mass(solid, 1e-6, false, &A);  // rigid motions have no stiffness
        assert_ok(om_solver_create(&def, &A, NULL, &solver));
        assert_ok(om_solver_refresh(solver, &A));
        om_solver_destroy(solver);
        om_bsr_destroy(&A);
        om_fem_destroy(solid);
        end_stack(&s);
    }
}

// One and four workers find the same bytes.
static void test_determinism(void** context) {
    (void)context;
    uint64_t hash[2];
    for (int k = 0; k < 2; ++k) {
        Stack s;
        const int n[2] = {8, 9};
        start_stack(&s, OM_HEX8, n, soft, 0, 0.01);
        om_fem_destroy(s.t.solid);
        OmFemDef def = om_fem_default_def(&s.t.mesh, 1, &s.t.material);
        def.contact = &s.contact;
        def.ncontact = 1;
        def.nworker = k == 0 ? 1 : 4;
        assert_ok(om_fem_create(&def, &s.t.solid));
        for (int i = 0; i < 3 * s.t.mesh.nnode; ++i) s.t.x[i] += 0.005 * sin(7.0 * i);
        assert_ok(om_fem_eval_force(s.t.solid, s.t.x, s.t.force, NULL));
        hash[k] = om_hash(s.t.force, 3 * (size_t)s.t.mesh.nnode * sizeof(double), OM_HASH_SEED);
        end_stack(&s);
    }
    assert_true(hash[0] == hash[1]);
}

static void test_refusals(void** context) {
    (void)context;
    Stack s;
    const int n[2] = {2, 2};
    start_stack(&s, OM_TET4, n, soft, 0, 0);
    OmFemDef def = om_fem_default_def(&s.t.mesh, 1, &s.t.material);
    OmFemContact bad = s.contact;
    OmFemSolid* solid;
    OmFemTouch touch;
    OmFemMesh mesh, hex;
    def.contact = &bad;
    def.ncontact = 1;
    bad.stiffness = -1;
    assert_status(om_fem_create(&def, &solid), OM_INVALID);
    bad = s.contact;
    bad.reach = NAN;
    assert_status(om_fem_create(&def, &solid), OM_INVALID);
    bad = s.contact;
    bad.face_node[1] = bad.face_node[0];
    assert_status(om_fem_create(&def, &solid), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "both sides"));
    bad = s.contact;
    bad.nface[0] = 0;
    assert_status(om_fem_create(&def, &solid), OM_INVALID);
    bad = s.contact;
    s.side[1].face_node[0] = s.side[1].face_node[1];
    assert_status(om_fem_create(&def, &solid), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "face 0 of side 1"));
    s.side[1].face_node[0] = s.t.mesh.nnode;
    assert_status(om_fem_create(&def, &solid), OM_INVALID);
    def.contact = NULL;
    assert_status(om_fem_create(&def, &solid), OM_INVALID);
    assert_status(om_fem_eval_contact(s.t.solid, s.t.x, 1, &touch, NULL), OM_INVALID);
    assert_ok(om_fem_mesh_box(OM_HEX8, om_vec3(0, 0, 0), om_vec3(1, 1, 1), (int[]){1, 1, 1}, &hex));
    assert_status(om_fem_mesh_join(&s.t.mesh, &hex, &mesh), OM_INVALID);
    om_fem_mesh_done(&hex);
    end_stack(&s);
}

static OmStatus small_contact(void* ctx) {
    const Stack* s = ctx;
    OmStatus status = OM_OK;
    OmFemSolid* solid = NULL;
    OmFemMesh twice = {0};
    OmFemTouch touch;
    OmBsr A = {0};
    OmFemDef def = om_fem_default_def(&s->t.mesh, 1, &s->t.material);
    def.contact = &s->contact;
    def.ncontact = 1;
    def.nworker = 1;
    OM_TRY_DONE(om_fem_mesh_join(&s->t.mesh, &s->t.mesh, &twice));
    OM_TRY_DONE(om_fem_create(&def, &solid));
    OM_TRY_DONE(om_fem_matrix_create(solid, &A));
    OM_TRY_DONE(om_fem_eval_tangent(solid, s->t.x, &A));
    OM_TRY_DONE(om_fem_eval_contact(solid, s->t.x, 0, &touch, NULL));
done:
    om_bsr_destroy(&A);
    om_fem_destroy(solid);
    om_fem_mesh_done(&twice);
    return status;
}

static void test_memory(void** context) {
    (void)context;
    Stack s;
    const int n[2] = {1, 1};
    start_stack(&s, OM_HEX8, n, soft, 0, 0.01);
    assert_true(test_failing_allocations(small_contact, &s, 1) > 30);
    end_stack(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_cubes), cmocka_unit_test(test_derivatives),
        cmocka_unit_test(test_balance),   cmocka_unit_test(test_patch),
        cmocka_unit_test(test_overhang),  cmocka_unit_test(test_collision),
        cmocka_unit_test(test_projected), cmocka_unit_test(test_determinism),
        cmocka_unit_test(test_refusals),  cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
