// test_tissue_force.c: action equals reaction, each force from where it is made.
#include "test_rig.h"

static const OmVec3 lo = {0, 0, 0}, hi = {0.06, 0.03, 0.01};

static void start(TestRig* r, double spring) {
    rig_box(r, lo, hi, 12, 6, 2);
    rig_attach_plane(r, 0, 0);
    r->def.attachment_stiffness = spring;
    r->def.rayleigh_mass = 4;
    r->def.rayleigh_stiffness = 0.01;
    rig_start(r);
}

static OmVec3 sum_of(const TestRig* r, const double* f) {
    OmVec3 sum = {0, 0, 0};
    for (int i = 0; i < r->mesh.nvert; ++i) sum = om_add(sum, om_load3(f, i));
    return sum;
}

// Held at one face, lifted and twisted at the other end, pushed sideways by external forces; at rest.
static void lift_to_rest(TestRig* r) {
    OmPose tip = {om_vec3(0.055, 0.015, 0.01), om_quat_identity()};
    double* push = om_tissue_external_force(r->s);
    for (int i = 0; i < r->mesh.nvert; i += 7) om_store3(push, i, om_vec3(0, 2e-4, -1e-4));
    assert_ok(om_tissue_grasp(r->m, r->s, 0, tip, 0.006, NULL));
    for (int n = 0; n < 250; ++n) {
        if (n < 50) tip.p.z += 0.0003;
        if (n < 50) tip.q = om_quat_axis_angle(om_vec3(1, 0, 0), 0.01 * n);
        assert_ok(om_tissue_move_grasp(r->s, 0, tip));
        assert_ok(om_tissue_step(r->m, r->s, r->w, 0.02, NULL));
    }
}

// The tool's force is the residual of its rows, the attachment's comes from stresses (or springs), weight from
// masses. Their sum is left with the accuracy of float stresses, 1e-7 of 10 kPa over 3 cm^2 an element, and
// of the linear solver: 1e-5 of the weight of 0.18 N.
static void check_balance(double spring) {
    TestRig r;
    start(&r, spring);
    lift_to_rest(&r);
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    double weight = om_norm(f.weight);
    assert_near_rel(weight, 1000 * 0.06 * 0.03 * 0.01 * 9.81, 1e-9);
    OmVec3 sum = om_add(om_add(f.grasp[0], f.attachment), om_add(f.weight, f.external));
    printf("spring %g N/m: grasp %.4f, pull %.4f, attachment %.4f, weight %.4f N, sum %.2g\n",
           spring, om_norm(f.grasp[0]), om_norm(f.pull[0]), om_norm(f.attachment), weight,
           om_norm(sum));
    assert_true(om_norm(f.grasp[0]) > 0.2 * weight && om_norm(f.attachment) > 0.2 * weight);
    assert_near(om_norm(sum), 0, 1e-5 * weight);
    assert_near(om_norm(f.grasp[1]), 0, 0);

    // forces on vertices add up to the resultants, and hold every vertex against stresses and loads
    size_t n = 3 * (size_t)r.mesh.nvert;
    double *held = om_alloc(n, sizeof *held), *in = om_alloc(n, sizeof *in);
    assert_ok(om_tissue_get_holding_force(r.m, r.s, held));
    assert_ok(om_tissue_get_internal_force(r.m, r.s, in));
    OmVec3 total = om_add(om_add(f.grasp[0], f.attachment), f.contact);
    assert_near(om_norm(om_sub(sum_of(&r, held), total)), 0, 1e-12);
    assert_near(om_norm(sum_of(&r, in)), 0, 1e-13);
    assert_near(om_norm(om_sub(sum_of(&r, om_tissue_external_force(r.s)), f.external)), 0, 1e-15);
    OmVec3 grasp = {0, 0, 0}, load = grasp;
    for (int i = 0; i < r.mesh.nvert; ++i) {
        OmVec3 w = om_scale(om_tissue_mass(r.m)[i], om_tissue_gravity(r.m));
        OmVec3 rest = om_add(om_add(om_load3(held, i), om_load3(in, i)),
                             om_add(w, om_load3(om_tissue_external_force(r.s), i)));
        assert_near(om_norm(rest), 0, 1e-5 * weight);
        if (om_tissue_held_by(r.s)[i] != 0) continue;
        grasp = om_add(grasp, om_load3(held, i));
        load = om_add(load, w);
    }
    assert_near(om_norm(om_sub(grasp, f.grasp[0])), 0, 1e-12);
    assert_near(om_norm(om_sub(om_add(grasp, load), f.pull[0])), 0, 1e-12);
    om_free(held);
    om_free(in);
    rig_done(&r);
}

static void test_balance_held(void** context) {
    (void)context;
    check_balance(0);
}
static void test_balance_springs(void** context) {
    (void)context;
    check_balance(50);
}

// Released vertices have no tool force any more: before the next step and after it.
static void test_release_leaves_nothing(void** context) {
    (void)context;
    TestRig r;
    start(&r, 0);
    lift_to_rest(&r);
    double* held = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *held);
    unsigned char* was_held = om_calloc((size_t)r.mesh.nvert, 1);
    for (int i = 0; i < r.mesh.nvert; ++i) was_held[i] = om_tissue_held_by(r.s)[i] == 0;
    for (int k = 0; k < 2; ++k) {
        if (k == 0)
            om_tissue_release(r.s, 0);
        else
            assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        OmTissueForces f;
        assert_ok(om_tissue_get_forces(r.m, r.s, &f));
        assert_near(om_norm(f.grasp[0]), 0, 0);
        assert_near(om_norm(f.pull[0]), 0, 0);
        assert_ok(om_tissue_get_holding_force(r.m, r.s, held));
        for (int i = 0; i < r.mesh.nvert; ++i)
            if (was_held[i]) assert_near(om_norm(om_load3(held, i)), 0, 0);
    }
    // A tool that has only just closed has made no force yet, whatever held the same vertices before.
    for (int turn = 0; turn < 2; ++turn) {
        OmTissueForces f;
        int some = 0;
        while (!was_held[some]) ++some;
        OmPose tip = {om_load3(om_tissue_x(r.s), some), om_quat_identity()};
        assert_ok(om_tissue_grasp(r.m, r.s, turn, tip, 0.006, NULL));
        assert_ok(om_tissue_get_forces(r.m, r.s, &f));
        assert_near(om_norm(f.grasp[turn]), 0, 0);
        assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        assert_ok(om_tissue_get_forces(r.m, r.s, &f));
        assert_true(om_norm(f.grasp[turn]) > 0);
        om_tissue_release(r.s, turn);
    }
    om_free(held);
    om_free(was_held);
    rig_done(&r);
}

// A spring pulls from the anchor it was given, not from where the vertex is at rest: k times the distance.
static void test_anchors_pull(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 4, 2, 1);
    r.def.attachment_stiffness = 50;
    r.def.gravity = om_vec3(0, 0, 0);
    rig_start(&r);
    int vert[2] = {0, r.mesh.nvert - 1};
    double anchor[6], held[3 * 64];
    assert_true(r.mesh.nvert <= 64);
    om_store3(anchor, 0, om_add(om_load3(r.mesh.x, vert[0]), om_vec3(-0.002, 0, 0)));
    om_store3(anchor, 1, om_add(om_load3(r.mesh.x, vert[1]), om_vec3(0, 0, 0.003)));
    assert_ok(om_tissue_set_attachment(r.m, r.s, 2, vert, anchor, NULL));
    assert_ok(om_tissue_get_holding_force(r.m, r.s, held));
    assert_near(om_distance(om_load3(held, vert[0]), om_vec3(-0.1, 0, 0)), 0, 1e-12);
    assert_near(om_distance(om_load3(held, vert[1]), om_vec3(0, 0, 0.15)), 0, 1e-12);
    rig_done(&r);
}

// A vertex has one keeper, or its force would count twice: what a tool holds cannot be held still as well. A
// spring pulls at a held vertex too, and the tool feels it.
static void test_one_keeper(void** context) {
    (void)context;
    for (double spring = 0; spring < 100; spring += 50) {
        TestRig r;
        start(&r, spring);
        OmPose tip = {om_vec3(0.055, 0.015, 0.01), om_quat_identity()};
        int both[500], num = 0;
        assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.006, NULL));
        for (int i = 0; i < r.mesh.nvert; ++i)
            if (om_tissue_attached(r.s)[i] || (om_tissue_held_by(r.s)[i] == 0 && i % 2))
                both[num++] = i;
        uint64_t before = om_tissue_state_hash(r.s);
        if (spring == 0) {
            assert_status(om_tissue_set_attachment(r.m, r.s, num, both, NULL, NULL), OM_INVALID);
            assert_non_null(strstr(om_error_message(), "release"));
            assert_true(om_tissue_state_hash(r.s) == before);
            rig_done(&r);
            continue;
        }
        assert_ok(om_tissue_set_attachment(r.m, r.s, num, both, NULL, NULL));
        tip.p.z += 0.001;
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        for (int n = 0; n < 150; ++n) assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
        OmTissueForces f;
        assert_ok(om_tissue_get_forces(r.m, r.s, &f));
        OmVec3 sum = om_add(om_add(f.grasp[0], f.attachment), f.weight);
        assert_near(om_norm(sum), 0, 1e-5 * om_norm(f.weight));
        rig_done(&r);
    }
}

// A tool that moves a free body carries its weight and its inertia: m (a - g) at every instant.
static void test_tool_carries_inertia(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, lo, hi, 6, 3, 1);
    r.def.material_default.young = 1e6;
    r.def.rayleigh_mass = 0;
    rig_start(&r);
    OmPose tip = {om_vec3(0.03, 0.015, 0.005), om_quat_identity()};
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 1, NULL));  // all of it
    double h = 0.01, a = 2, v = 0, mass = 1000 * 0.06 * 0.03 * 0.01;
    for (int n = 0; n < 20; ++n) {
        v += h * a;
        tip.p.x += h * v;
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        assert_ok(om_tissue_step(r.m, r.s, r.w, h, NULL));
        OmTissueForces f;
        assert_ok(om_tissue_get_forces(r.m, r.s, &f));
        assert_near(f.grasp[0].x, mass * a, 2e-4 * mass * 9.81);
        assert_near(f.grasp[0].z, mass * 9.81, 2e-4 * mass * 9.81);
        assert_near(f.pull[0].z, 0, 2e-4 * mass * 9.81);
    }
    rig_done(&r);
}

// Energy of weight and springs: a body moved as a whole.
static void test_energies(void** context) {
    (void)context;
    TestRig r;
    start(&r, 50);
    double* x = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *x);
    double* v = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *v);
    for (int i = 0; i < r.mesh.nvert; ++i) {
        om_store3(x, i, om_add(om_load3(r.mesh.x, i), om_vec3(0.001, 0, 0.002)));
        om_store3(v, i, om_vec3(0.3, 0, 0.4));
    }
    OmTissueEnergy before, after;
    assert_ok(om_tissue_get_energy(r.m, r.s, &before));
    assert_ok(om_tissue_set_x(r.m, r.s, x, v));
    assert_ok(om_tissue_get_energy(r.m, r.s, &after));
    double mass = 0.018;
    assert_near(after.kinetic, 0.5 * mass * 0.25, 1e-12);
    assert_near(after.gravity - before.gravity, mass * 9.81 * 0.002, 1e-12);
    assert_near(after.spring, 0.5 * 50 * 5e-6 * 7 * 3, 1e-12);  // 7 x 3 vertices are attached
    assert_near(after.elastic, 0, 1e-15);
    om_free(x);
    om_free(v);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_balance_held),
                                       cmocka_unit_test(test_balance_springs),
                                       cmocka_unit_test(test_release_leaves_nothing),
                                       cmocka_unit_test(test_anchors_pull),
                                       cmocka_unit_test(test_one_keeper),
                                       cmocka_unit_test(test_tool_carries_inertia),
                                       cmocka_unit_test(test_energies)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
