// test_tissue_bond.c: springs between two bodies of one mesh.
#include "test_rig.h"

enum { NX = 4, NY = 2, NZ = 2 };

#define G 1.0  // m/s^2: soft blocks of 80 mm hang down

/// Two blocks of 40 x 20 x 20 mm end to end, the first held at x = 0; bonds at the vertices of the faces between them.
/// The second block has another mesh, `nz` cells high. Without a state yet.
static void rig_make_joined(TestRig* r, double stiffness, int nz, OmTissueElement element) {
    static OmTissueBond bond[100];
    OmTetMesh more, first;
    int vert[100], nbond = 0;
    rig_box(r, om_vec3(0, 0, 0), om_vec3(0.04, 0.02, 0.02), NX, NY, NZ);
    first = r->mesh;
    assert_ok(om_tet_mesh_box(om_vec3(0.04, 0, 0), om_vec3(0.08, 0.02, 0.02), NX, NY, nz, &more));
    assert_ok(om_tet_mesh_join(&first, &more, &r->mesh));
    for (int i = 0; i < more.nvert; ++i)
        if (more.x[3 * i] < 0.04 + 1e-9) vert[nbond++] = first.nvert + i;
    assert_ok(om_tissue_make_bonds(&r->mesh, nbond, vert, 0, first.ntet, stiffness, bond));
    om_tet_mesh_done(&first);
    om_tet_mesh_done(&more);
    r->def.nbond = nbond;
    r->def.bond = bond;
    r->def.element = element;
    r->def.gravity = om_vec3(0, 0, -G);
    rig_attach_plane(r, 0, 0);
}

static void rig_joined(TestRig* r, double stiffness, int nz, OmTissueElement element) {
    rig_make_joined(r, stiffness, nz, element);
    rig_start(r);
}

static double tip(const TestRig* r) {
    double z = 0;
    int num = 0;
    for (int i = 0; i < om_tissue_corner_count(r->m); ++i)
        if (om_tissue_mesh(r->m)->x[3 * i] > 0.08 - 1e-9) {
            z += om_tissue_x(r->s)[3 * i + 2] - om_tissue_mesh(r->m)->x[3 * i + 2];
            ++num;
        }
    return z / num;
}

// Stiff bonds at vertices that match: the deflection of one block.
static void test_two_joined_blocks_bend_as_one(void** state) {
    (void)state;
    TestRig r, one;
    rig_joined(&r, 1e3, NZ, OM_ELEMENT_LINEAR);
    rig_box(&one, om_vec3(0, 0, 0), om_vec3(0.08, 0.02, 0.02), 2 * NX, NY, NZ);
    one.def.gravity = om_vec3(0, 0, -G);
    rig_attach_plane(&one, 0, 0);
    rig_start(&one);
    assert_ok(om_tissue_find_rest(r.m, r.s, r.w, 1e-4, 50, NULL));
    assert_ok(om_tissue_find_rest(one.m, one.s, one.w, 1e-5, 50, NULL));
    assert_near_rel(tip(&r), tip(&one), 0.01);
    rig_done(&r);
    rig_done(&one);
}

// At rest the bonds carry the second block: their forces sum to its weight. Statics and time steps agree; forces of
// attachments and weight balance; energy has the springs.
static void test_bonds_carry_the_weight(void** state) {
    (void)state;
    for (int quadratic = 0; quadratic < 2; ++quadratic) {
        TestRig r;
        rig_joined(&r, 20, 1, quadratic ? OM_ELEMENT_QUADRATIC : OM_ELEMENT_LINEAR);
        double weight = 1000 * 0.04 * 0.02 * 0.02 * G, energy = 0;
        assert_ok(om_tissue_find_rest(r.m, r.s, r.w, 1e-6, 100, NULL));
        double still = tip(&r);
        OmVec3 sum = {0, 0, 0};
        for (int k = 0; k < r.def.nbond; ++k) {
            OmVec3 f = om_tissue_bond_force(r.m, r.s, k);
            sum = om_add(sum, f);
            energy += 0.5 * om_norm2(f) / 20;
        }
        assert_near_rel(sum.z, weight, 1e-4);
        OmTissueForces forces;
        assert_ok(om_tissue_get_forces(r.m, r.s, &forces));
        assert_near_rel(forces.attachment.z, 2 * weight, 1e-4);
        OmTissueEnergy all;
        assert_ok(om_tissue_get_energy(r.m, r.s, &all));
        assert_near_rel(all.spring, energy, 1e-9);
        om_tissue_state_reset(r.m, r.s);
        rig_relax(&r, 12);
        assert_near_rel(tip(&r), still, 1e-3);
        rig_done(&r);
    }
}

// Turned as a whole the bodies feel no force; free, they keep their momentum.
static void test_turning_and_momentum(void** state) {
    (void)state;
    TestRig r;
    rig_joined(&r, 50, 3, OM_ELEMENT_LINEAR);
    OmQuat q = om_quat_axis_angle(om_normalize(om_vec3(1, 2, 3)), 1.1);
    size_t n3 = 3 * (size_t)om_tissue_mesh(r.m)->nvert;
    double *x = om_alloc(n3, sizeof *x), *v = om_calloc(n3, sizeof *v);
    for (int i = 0; i < om_tissue_mesh(r.m)->nvert; ++i)
        om_store3(x, i, om_quat_rotate(q, om_load3(om_tissue_mesh(r.m)->x, i)));
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    for (int k = 0; k < r.def.nbond; ++k)
        assert_true(om_norm(om_tissue_bond_force(r.m, r.s, k)) < 1e-12);
    rig_done(&r);

    rig_joined(&r, 50, 3, OM_ELEMENT_LINEAR);
    assert_ok(om_tissue_set_attachment(r.m, r.s, 0, NULL, NULL, NULL));
    OmRng rng = om_rng_init(5, 0);
    for (size_t k = 0; k < n3; ++k) {
        x[k] = om_tissue_mesh(r.m)->x[k];
        v[k] = om_rng_range(&rng, -0.05, 0.05);
    }
    assert_ok(om_tissue_set_x(r.m, r.s, x, v));
    OmVec3 p0, p1;
    om_tissue_get_momentum(r.m, r.s, &p0, NULL);
    double h = 0.01, mass = 2 * 1000 * 0.04 * 0.02 * 0.02;
    for (int n = 0; n < 20; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, h, NULL));
    om_tissue_get_momentum(r.m, r.s, &p1, NULL);
    // weight and Rayleigh's damping alone act on it
    double a = 0.1, keep = pow(1 / (1 + a * h), 20);
    OmVec3 want = om_scale(keep, p0);
    want.z -= mass * G * (1 - keep) / a;
    assert_true(om_distance(p1, want) < 1e-4 * mass * G * 0.2);
    om_free(x);
    om_free(v);
    rig_done(&r);
}

// Without weight two free, stiff blocks swing against each other as two masses on a spring, in steps of implicit Euler:
// v' (1 + h a + h^2 w^2) = v - h w^2 u, u' = u + h v'.
static void test_two_masses_swing(void** state) {
    (void)state;
    TestRig r;
    rig_make_joined(&r, 2, 2, OM_ELEMENT_LINEAR);
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.material_default.young = 3e5;
    rig_start(&r);
    assert_ok(om_tissue_set_attachment(r.m, r.s, 0, NULL, NULL, NULL));
    const double mass = 1000 * 0.04 * 0.02 * 0.02, h = 0.01, a = r.def.rayleigh_mass;
    const double square = 2 * r.def.nbond / (0.5 * mass);  // w^2
    const int n = om_tissue_corner_count(r.m), first = n / 2;
    double *x = om_calloc(3 * (size_t)n, sizeof *x), *v = om_calloc(3 * (size_t)n, sizeof *v);
    for (int i = 0; i < n; ++i) {
        om_store3(x, i, om_load3(om_tissue_mesh(r.m)->x, i));
        v[3 * i] = i < first ? -0.01 : 0.01;
    }
    assert_ok(om_tissue_set_x(r.m, r.s, x, v));
    double u = 0, speed = 0.02, most = 0;
    for (int step = 0; step < 40; ++step) {
        assert_ok(om_tissue_step(r.m, r.s, r.w, h, NULL));
        speed = (speed - h * square * u) / (1 + h * a + h * h * square);
        u += h * speed;
        most = fmax(most, u);
        double apart = 0;
        for (int i = 0; i < n; ++i)
            apart += (i < first ? -1 : 1) * (om_tissue_x(r.s)[3 * i] - x[3 * i]) / first;
        assert_near(apart, u, 0.01 * most);
    }
    assert_true(u < 0.5 * most);  // it came back
    om_free(x);
    om_free(v);
    rig_done(&r);
}

static void test_what_is_refused(void** state) {
    (void)state;
    TestRig r;
    rig_joined(&r, 50, NZ, OM_ELEMENT_LINEAR);
    OmTissueBond bad = r.def.bond[0];
    OmTissueDef def = r.def;
    OmTissueModel* m;
    def.nbond = 1;
    def.bond = &bad;
    bad.stiffness = 0;
    assert_status(om_tissue_create(&def, &m), OM_INVALID);
    bad = r.def.bond[0];
    bad.weight[0] = 1.5;
    assert_status(om_tissue_create(&def, &m), OM_INVALID);
    bad = r.def.bond[0];
    bad.vert[0] = 0;  // another place
    assert_status(om_tissue_create(&def, &m), OM_INVALID);
    bad.vert[0] = 1 << 20;
    assert_status(om_tissue_create(&def, &m), OM_INVALID);
    bad = r.def.bond[0];
    def.solver.preconditioner = OM_CHOLESKY;
    assert_status(om_tissue_create(&def, &m), OM_UNAVAILABLE);
    def.bond = NULL;
    assert_status(om_tissue_create(&def, &m), OM_INVALID);
    int own = 0, far = 1 << 20;
    assert_status(om_tissue_make_bonds(&r.mesh, 1, &own, 0, 10, 1, &bad), OM_INVALID);
    assert_status(om_tissue_make_bonds(&r.mesh, 1, &far, 0, 10, 1, &bad), OM_INVALID);
    assert_status(om_tissue_make_bonds(&r.mesh, 1, &own, 5, 5, 1, &bad), OM_INVALID);
    assert_true(om_norm(om_tissue_bond_force(r.m, r.s, -1)) == 0);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_joined_blocks_bend_as_one),
        cmocka_unit_test(test_bonds_carry_the_weight),
        cmocka_unit_test(test_turning_and_momentum),
        cmocka_unit_test(test_two_masses_swing),
        cmocka_unit_test(test_what_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
