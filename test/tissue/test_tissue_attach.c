// test_tissue_attach.c: attachments of the state: held still, springs of their own stiffness, changed between steps.
#include "test_alloc.h"
#include "test_rig.h"

#include "omentum/heuristic.h"
#include "omentum/pbd.h"

static const OmVec3 lo = {0, 0, 0}, hi = {0.06, 0.03, 0.02};
enum { MAX_VERT = 400 };

typedef struct Attached {  // arguments of om_tissue_set_attachment
    int num, vert[MAX_VERT];
    double anchor[3 * MAX_VERT], stiffness[MAX_VERT];
} Attached;

static void attach(Attached* a, const TestRig* r, int i, double stiffness, OmVec3 shift) {
    assert_true(a->num < MAX_VERT);
    om_store3(a->anchor, a->num, om_add(om_load3(r->mesh.x, i), shift));
    a->stiffness[a->num] = stiffness;
    a->vert[a->num++] = i;
}

static OmStatus set(TestRig* r, const Attached* a) {
    return om_tissue_set_attachment(r->m, r->s, a->num, a->vert, a->anchor, a->stiffness);
}

// ---- equilibrium --------------------------------------------------------------------------------------

// A third of the area of every boundary triangle in the plane `axis` = at, to each of its corners.
static void area_of_plane(const TestRig* r, int axis, double at, double* area) {
    OmSurface surface;
    int* vert;
    assert_ok(om_tet_mesh_boundary(&r->mesh, &surface, &vert));
    memset(area, 0, (size_t)r->mesh.nvert * sizeof *area);
    for (int t = 0; t < surface.ntri; ++t) {
        const int* v = surface.tri_vert + 3 * (size_t)t;
        OmVec3 p[3];
        bool is_in = true;
        for (int k = 0; k < 3; ++k) {
            p[k] = om_load3(surface.x, v[k]);
            is_in &= fabs(surface.x[3 * v[k] + axis] - at) < 1e-9;
        }
        double twice = om_norm(om_cross(om_sub(p[1], p[0]), om_sub(p[2], p[0])));
        for (int k = 0; is_in && k < 3; ++k) area[vert[v[k]]] += twice / 6;
    }
    om_surface_done(&surface);
    om_free(vert);
}

// Two beds of springs and the block between them are three springs in a row: with Poisson's ratio 0 and stiffness by
// area the strain is uniform, and F = d / (1 / K0 + L / (E A) + 1 / K1), which the mesh has exactly.
static void test_chain(void** context) {
    (void)context;
    const double young = 2000, length = hi.x, area = hi.y * hi.z, end[2] = {3, 11}, d = 0.004;
    TestRig r;
    Attached a = {0};
    rig_box(&r, lo, hi, 6, 3, 2);
    double* share = om_alloc((size_t)r.mesh.nvert, sizeof *share);
    r.def.material_default = (OmMaterial){.law = OM_LINEAR, .young = young, .poisson = 0};
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    for (int side = 0; side < 2; ++side) {
        area_of_plane(&r, 0, side ? hi.x : lo.x, share);
        for (int i = 0; i < r.mesh.nvert; ++i)
            if (share[i] > 0)
                attach(&a, &r, i, end[side] * share[i] / area, om_vec3(side ? d : 0, 0, 0));
    }
    assert_ok(set(&r, &a));
    rig_relax(&r, 8);
    double force = d / (1 / end[0] + length / (young * area) + 1 / end[1]);
    double held[3 * MAX_VERT];
    assert_ok(om_tissue_get_attachment_force(r.m, r.s, held));
    OmVec3 sum[2] = {{0, 0, 0}, {0, 0, 0}};
    for (int k = 0; k < a.num; ++k) {
        int i = a.vert[k], side = r.mesh.x[3 * i] > 0.5 * hi.x;
        double at = om_tissue_x(r.s)[3 * i] - r.mesh.x[3 * i];
        assert_near(at, side ? d - force / end[1] : force / end[0], 2e-6 * d);
        sum[side] = om_add(sum[side], om_load3(held, i));
    }
    printf("force of the chain %.8f N, by the springs %.8f and %.8f N\n", force, -sum[0].x,
           sum[1].x);
    assert_near_rel(-sum[0].x, force, 2e-6);
    assert_near_rel(sum[1].x, force, 2e-6);
    assert_near(om_norm(om_sub(sum[1], om_vec3(force, 0, 0))), 0, 1e-6 * force);
    om_free(share);
    rig_done(&r);
}

// Springs of random stiffness beside vertices held still: at rest their forces are the weight, whatever the engine.
static void check_weight(const OmTissueEngine* engine, double tolerance) {
    TestRig r;
    Attached a = {0};
    OmRng rng = om_rng_init(3, 4);
    rig_box(&r, lo, hi, 6, 3, 2);
    OmPbdDef pbd = om_pbd_default_def(OM_PBD_ELASTIC);
    r.def.engine = engine;
    if (engine == om_pbd_engine()) r.def.options = &pbd;
    r.def.material_default.young = 30000;
    r.def.rayleigh_mass = 8;
    rig_start(&r);
    for (int i = 0; i < r.mesh.nvert; ++i)
        if (r.mesh.x[3 * i] < 1e-9)
            attach(&a, &r, i, i % 3 ? pow(10, om_rng_range(&rng, 1, 3)) : 0, om_vec3(0, 0, 0));
    assert_ok(set(&r, &a));
    for (int n = 0; n < 300; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
    OmTissueForces f;
    double held[3 * MAX_VERT];
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_ok(om_tissue_get_attachment_force(r.m, r.s, held));
    OmVec3 sum = {0, 0, 0};
    for (int i = 0; i < r.mesh.nvert; ++i) {
        sum = om_add(sum, om_load3(held, i));
        if (!om_tissue_attached(r.s)[i]) assert_near(om_norm(om_load3(held, i)), 0, 0);
    }
    for (int k = 0; k < a.num; ++k) {
        OmVec3 off = om_sub(om_load3(a.anchor, k), om_load3(om_tissue_x(r.s), a.vert[k]));
        assert_true(om_tissue_is_prescribed(r.m, r.s, a.vert[k]) == (a.stiffness[k] <= 0));
        if (a.stiffness[k] > 0)
            assert_near(om_norm(om_madd(om_load3(held, a.vert[k]), -a.stiffness[k], off)), 0, 0);
        else
            assert_near(om_norm(off), 0, 0);
    }
    double weight = om_norm(f.weight);
    printf("%s: attachments carry %.6f of the weight, off by %.2g of it\n", engine->name,
           om_norm(f.attachment) / weight, om_norm(om_add(f.attachment, f.weight)) / weight);
    assert_near(om_norm(om_sub(sum, f.attachment)), 0, 1e-12);
    assert_near(om_norm(om_add(f.attachment, f.weight)), 0, tolerance * weight);
    rig_done(&r);
}

static void test_weight(void** context) {
    (void)context;
    check_weight(om_fem_engine(),
                 5e-5);  // stresses are floats: 1e-7 of 30 kPa on 0.5 cm^2 an element
    check_weight(om_spring_engine(), 1e-5);
    check_weight(om_pbd_engine(), 1e-5);
}

// ---- derivatives --------------------------------------------------------------------------------------

// Forces are minus the gradient of the spring energy.
static void test_gradient(void** context) {
    (void)context;
    TestRig r;
    Attached a = {0};
    rig_box(&r, lo, hi, 2, 1, 1);
    rig_start(&r);
    for (int i = 0; i < 8; ++i) attach(&a, &r, i, i == 5 ? 0 : 7 * i, om_vec3(0.001, 0, 0.002));
    assert_ok(set(&r, &a));
    double x[3 * MAX_VERT], held[3 * MAX_VERT];
    size_t size = 3 * (size_t)r.mesh.nvert * sizeof *x;
    memcpy(x, r.mesh.x, size);
    rig_shake(&r.mesh, NULL, 0.002, x);
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    assert_ok(om_tissue_get_attachment_force(r.m, r.s, held));
    for (int n = 0; n < 24; ++n) {
        double e[2], step = 1e-6, at = x[n];
        if (n / 3 == 0 || n / 3 == 5) continue;  // held still: the force is of elements and weight
        for (int k = 0; k < 2; ++k) {
            OmTissueEnergy energy;
            x[n] = at + (k ? step : -step);
            assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
            assert_ok(om_tissue_get_energy(r.m, r.s, &energy));
            e[k] = energy.spring;
        }
        x[n] = at;
        assert_near((e[1] - e[0]) / (2 * step), -held[n], 1e-8);
    }
    rig_done(&r);
}

// The system matrix has h^2 k more on the diagonal than without springs, and nothing else.
static void test_matrix(void** context) {
    (void)context;
    const OmTissueEngine* engine[2] = {om_fem_engine(), om_spring_engine()};
    const double h = 0.02;
    for (int e = 0; e < 2; ++e) {
        TestRig r;
        Attached a = {0};
        rig_box(&r, lo, hi, 2, 1, 1);
        r.def.engine = engine[e];
        rig_start(&r);
        for (int i = 0; i < 8; ++i) attach(&a, &r, i, 40 + 5 * i, om_vec3(0.001, 0, 0.002));
        size_t n3 = 3 * (size_t)r.mesh.nvert;
        double dv[3 * MAX_VERT], y[2][3 * MAX_VERT];
        OmRng rng = om_rng_init(1, 7);
        for (size_t n = 0; n < n3; ++n) dv[n] = om_rng_range(&rng, -1, 1);
        for (int k = 0; k < 2; ++k) {
            if (k == 1) assert_ok(set(&r, &a));
            assert_ok(om_tissue_begin_step(r.m, r.s, r.w, h));
            assert_ok(om_tissue_apply(r.m, r.w, 1, dv, y[k]));
        }
        for (size_t n = 0; n < n3; ++n) {
            double k = om_tissue_attachment_stiffness(r.s)[n / 3];
            assert_near(y[1][n] - y[0][n], h * h * k * dv[n], 1e-7 * (1 + fabs(y[0][n])));
        }
        rig_done(&r);
    }
}

// ---- changes between steps ------------------------------------------------------------------------------

static double largest_move(const TestRig* r, const double* from) {
    double largest = 0;
    for (int i = 0; i < r->mesh.nvert; ++i)
        largest = fmax(largest, om_distance(om_load3(om_tissue_x(r->s), i), om_load3(from, i)));
    return largest;
}

// Replace all attachments by others at the same vertices without a jump, and step once.
static void change(TestRig* r, Attached* a, double stiffness, double* moved, double* before) {
    double x[3 * MAX_VERT], f[2][3 * MAX_VERT];
    OmTissueReport report;
    for (int k = 0; k < a->num; ++k) a->stiffness[k] = stiffness > 0 ? stiffness * (1 + k) : 0;
    memcpy(x, om_tissue_x(r->s), 3 * (size_t)r->mesh.nvert * sizeof *x);
    assert_ok(om_tissue_get_attachment_force(r->m, r->s, f[0]));
    assert_ok(om_tissue_eval_anchor(r->m, r->s, a->num, a->vert, a->stiffness, a->anchor));
    assert_ok(set(r, a));
    assert_near(largest_move(r, x), 0, 0);
    assert_ok(om_tissue_get_attachment_force(r->m, r->s, f[1]));
    for (int n = 0; n < 3 * r->mesh.nvert; ++n) assert_near(f[1][n], f[0][n], 1e-5 * *before);
    assert_ok(om_tissue_step(r->m, r->s, r->w, 0.02, &report));
    assert_false(report.is_unguarded);
    assert_int_equal(report.substeps, 1);
    *moved = largest_move(r, x);
}

// At rest nothing moves when held still becomes springs, other springs, and held still again; freed, it falls.
static void test_change(void** context) {
    (void)context;
    TestRig r;
    Attached a = {0};
    double moved, x[3 * MAX_VERT], weight;
    OmTissueForces f;
    rig_box(&r, lo, hi, 6, 3, 2);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default.young = 30000;
    r.def.solver.tolerance = 1e-7;
    r.def.rayleigh_mass = 8;
    rig_start(&r);
    for (int i = 0; i < r.mesh.nvert; ++i)
        if (om_tissue_attached(r.s)[i]) attach(&a, &r, i, 0, om_vec3(0, 0, 0));
    for (int n = 0; n < 300; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    weight = om_norm(f.weight);
    const double to[4] = {200, 30, 1000, 0};
    for (int k = 0; k < 4; ++k) {
        change(&r, &a, to[k], &moved, &weight);
        printf("to %g N/m and more: %.2g mm in the next step\n", to[k], 1e3 * moved);
        assert_below(moved, 1e-7);  // m; without the anchors of om_tissue_eval_anchor 1e-4 to 1e-3
        assert_ok(om_tissue_get_forces(r.m, r.s, &f));
        assert_near(om_norm(om_add(f.attachment, f.weight)), 0, 1e-4 * weight);
    }
    memcpy(x, om_tissue_x(r.s), 3 * (size_t)r.mesh.nvert * sizeof *x);
    OmTissueReport report;
    assert_ok(om_tissue_set_attachment(r.m, r.s, 0, NULL, NULL, NULL));
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_near(om_norm(f.attachment), 0, 0);
    assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, &report));
    assert_false(report.is_unguarded);
    OmVec3 momentum;
    om_tissue_get_momentum(r.m, r.s, &momentum, NULL);
    double fall = om_norm(om_madd(momentum, -0.02 / (1 + 0.02 * 8), f.weight));
    assert_near(fall, 0, 1e-4 * 0.02 * weight);
    rig_done(&r);
}

// ---- state --------------------------------------------------------------------------------------------

static void test_snapshot(void** context) {
    (void)context;
    TestRig r;
    Attached a = {0};
    rig_box(&r, lo, hi, 6, 3, 2);
    rig_attach_plane(&r, 0, 0);
    r.def.attachment_stiffness = 50;
    rig_start(&r);
    uint64_t first = om_tissue_state_hash(r.s);
    for (int i = 0; i < r.mesh.nvert; ++i)
        if (om_tissue_attached(r.s)[i]) attach(&a, &r, i, 50, om_vec3(0, 0, 0));
    assert_ok(set(&r, &a));  // the same again
    assert_true(om_tissue_state_hash(r.s) == first);
    a.stiffness[3] = 51;
    assert_ok(set(&r, &a));
    uint64_t one = om_tissue_state_hash(r.s);
    a.stiffness[3] = 52;
    assert_ok(set(&r, &a));
    assert_true(one != first && om_tissue_state_hash(r.s) != one);
    size_t size = om_tissue_state_size(r.m);
    void* saved = om_alloc(size, 1);
    memcpy(saved, r.s, size);
    uint64_t hash[2];
    for (int k = 0; k < 2; ++k) {
        for (int n = 0; n < 5; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        hash[k] = om_tissue_state_hash(r.s);
        assert_ok(om_tissue_set_attachment(r.m, r.s, 0, NULL, NULL, NULL));
        assert_near(om_tissue_attachment_stiffness(r.s)[a.vert[3]], 0, 0);
        memcpy((void*)r.s, saved, size);
        assert_near(om_tissue_attachment_stiffness(r.s)[a.vert[3]], 52, 0);
    }
    assert_true(hash[0] == hash[1]);
    om_tissue_state_reset(r.m, r.s);
    assert_true(om_tissue_state_hash(r.s) == first);
    om_free(saved);
    rig_done(&r);
}

// Springs of the definition: each vertex of the set has its own, after a reset too, and they are the state's default.
static void test_definition(void** context) {
    (void)context;
    TestRig r;
    Attached a = {0};
    double spring[MAX_VERT];
    rig_box(&r, lo, hi, 2, 1, 1);
    rig_attach_plane(&r, 0, 0);
    for (int k = 0; k < 4; ++k) spring[k] = k == 2 ? 0 : 10 + k;
    r.def.attachment_stiffness = 3;
    r.def.attachment_springs = spring;
    rig_start(&r);
    const OmMeshSet* set_of_mesh = om_tet_mesh_find_set(om_tissue_mesh(r.m), "attachment");
    assert_int_equal(set_of_mesh->nvert, 4);
    uint64_t first = om_tissue_state_hash(r.s);
    for (int pass = 0; pass < 2; ++pass) {
        for (int k = 0; k < 4; ++k) {
            int i = set_of_mesh->vert[k];
            assert_near(om_tissue_attachment_stiffness(r.s)[i], spring[k], 0);
            assert_true(om_tissue_is_prescribed(r.m, r.s, i) == (k == 2));
            if (pass == 0) attach(&a, &r, i, 99, om_vec3(0, 0, 0));
        }
        if (pass == 0) assert_ok(set(&r, &a));
        if (pass == 0) om_tissue_state_reset(r.m, r.s);
    }
    assert_ok(om_tissue_set_attachment(r.m, r.s, a.num, a.vert, NULL, NULL));
    assert_true(om_tissue_state_hash(r.s) == first);
    int free_vert = r.mesh.nvert - 1;
    assert_ok(om_tissue_set_attachment(r.m, r.s, 1, &free_vert, NULL, NULL));
    assert_near(om_tissue_attachment_stiffness(r.s)[free_vert], 3, 0);
    OmTissueModel* model;
    spring[1] = -1;
    assert_status(om_tissue_create(&r.def, &model), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "attachment_springs[1]"));
    rig_done(&r);
}

// An engine without springs says so; it can hold vertices still.
static void test_refused(void** context) {
    (void)context;
    TestRig r;
    Attached a = {0};
    rig_box(&r, lo, hi, 2, 1, 1);
    r.def.engine = om_chain_engine();
    rig_start(&r);
    attach(&a, &r, 2, 0, om_vec3(0, 0, 0));
    attach(&a, &r, 5, 10, om_vec3(0, 0, 0));
    uint64_t before = om_tissue_state_hash(r.s);
    assert_status(set(&r, &a), OM_UNAVAILABLE);
    assert_non_null(strstr(om_error_message(), "chainmail"));
    assert_non_null(strstr(om_error_message(), "vertex 5"));
    assert_status(om_tissue_eval_anchor(r.m, r.s, a.num, a.vert, a.stiffness, a.anchor),
                  OM_UNAVAILABLE);
    assert_true(om_tissue_state_hash(r.s) == before);
    OmTissueModel* model;
    r.def.attachment_stiffness = 10;
    assert_status(om_tissue_create(&r.def, &model), OM_UNAVAILABLE);
    assert_null(model);
    r.def.engine = om_fem_engine();
    OmTissueDef fem = r.def;
    rig_done(&r);

    rig_box(&r, lo, hi, 2, 1, 1);
    fem.mesh = &r.mesh;
    r.def = fem;
    rig_start(&r);
    const double bad[4] = {-1, 2e9, (double)NAN, (double)INFINITY};
    before = om_tissue_state_hash(r.s);
    for (int k = 0; k < 4; ++k) {
        a.stiffness[1] = bad[k];
        assert_status(set(&r, &a), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "vertex 5"));
    }
    assert_status(om_tissue_eval_anchor(r.m, r.s, 2, NULL, NULL, a.anchor), OM_INVALID);
    assert_true(om_tissue_state_hash(r.s) == before);
    rig_done(&r);
}

static OmStatus ask_forces(void* ctx) {
    TestRig* r = ctx;
    const int vert[2] = {0, 1};
    double anchor[6];
    OmTissueForces forces;
    OM_TRY(om_tissue_get_forces(r->m, r->s, &forces));
    return om_tissue_eval_anchor(r->m, r->s, 2, vert, NULL, anchor);
}

static void test_allocation(void** context) {
    (void)context;
    TestRig r;
    Attached a = {0};
    rig_box(&r, lo, hi, 2, 1, 1);
    rig_start(&r);
    for (int i = 0; i < 6; ++i) attach(&a, &r, i, 10 * (i % 2), om_vec3(0, 0, 0));
    assert_ok(set(&r, &a));
    assert_int_equal(test_failing_allocations(ask_forces, &r, 1), 3);
    rig_done(&r);
}

// The state's own arrays as arguments: they are copied before they are cleared.
static void test_own_arrays(void** context) {
    (void)context;
    TestRig r;
    Attached a = {0};
    rig_box(&r, lo, hi, 6, 3, 2);
    rig_attach_plane(&r, 0, 0);
    rig_start(&r);
    int num = r.mesh.nvert, all[MAX_VERT];
    assert_true(num < MAX_VERT);
    for (int i = 0; i < num; ++i) {
        all[i] = i;
        attach(&a, &r, i, 10 + i, om_vec3(1e-4 * i, 0, -1e-4));
    }
    assert_ok(set(&r, &a));
    uint64_t hash = om_tissue_state_hash(r.s);
    assert_ok(om_tissue_set_attachment(r.m, r.s, num, all, om_tissue_anchor(r.s),
                                       om_tissue_attachment_stiffness(r.s)));
    assert_true(om_tissue_state_hash(r.s) == hash);
    for (int i = 0; i < num; ++i) {
        assert_near(om_tissue_attachment_stiffness(r.s)[i], 10 + i, 0);
        assert_near(om_tissue_anchor(r.s)[3 * i], r.mesh.x[3 * i] + 1e-4 * i, 1e-15);
    }
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chain),      cmocka_unit_test(test_weight),
        cmocka_unit_test(test_gradient),   cmocka_unit_test(test_matrix),
        cmocka_unit_test(test_change),     cmocka_unit_test(test_snapshot),
        cmocka_unit_test(test_definition), cmocka_unit_test(test_refused),
        cmocka_unit_test(test_allocation), cmocka_unit_test(test_own_arrays)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
