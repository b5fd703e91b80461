// test_pbd_motion.c: free bodies move as rigid ones, momentum stays, sheets neither flip nor drift.
#include "pbd_rig.h"

static const OmVec3 nothing = {0, 0, 0};

// No damping, no weight: what is left is what constraints do.
static void start_free(PbdRig* p) {
    p->r.def.gravity = nothing;
    p->pbd.damping = 0;
    pbd_start(p);
}

// x = R x0 + t, v = omega x (R x0) + v0 of every vertex.
static void place(PbdRig* p, OmQuat q, OmVec3 t, OmVec3 omega, OmVec3 v0) {
    int n = p->r.mesh.nvert;
    double *x = om_alloc((size_t)n, 24), *v = om_alloc((size_t)n, 24);
    for (int i = 0; i < n; ++i) {
        OmVec3 d = om_quat_rotate(q, om_load3(p->r.mesh.x, i));
        om_store3(x, i, om_add(d, t));
        om_store3(v, i, om_add(v0, om_cross(omega, d)));
    }
    assert_ok(om_tissue_set_x(p->r.m, p->r.s, x, v));
    om_free(x);
    om_free(v);
}

// The largest distance of a vertex from where the rigid motion has it.
static double deviation(const PbdRig* p, OmQuat q, OmVec3 t) {
    double worst = 0;
    for (int i = 0; i < p->r.mesh.nvert; ++i) {
        OmVec3 want = om_add(om_quat_rotate(q, om_load3(p->r.mesh.x, i)), t);
        worst = fmax(worst, om_distance(want, om_load3(om_tissue_x(p->r.s), i)));
    }
    return worst;
}

static void test_translation_is_exact(void** state) {
    (void)state;
    PbdRig p;
    pbd_box(&p, om_vec3(0.06, 0.04, 0.05), 6, 4, 5);
    start_free(&p);
    OmQuat turned = om_quat_axis_angle(om_normalize(om_vec3(1, 2, -1)), 2.9);
    OmVec3 t = {0.3, -0.2, 0.1}, v = {0.1, 0.05, -0.2};
    place(&p, turned, t, nothing, v);
    pbd_run(&p, 100, 0.02);
    // rounding of 300 substeps, which velocities by difference carry on
    assert_below(deviation(&p, turned, om_madd(t, 2, v)), 1e-9 * test_tol_scale());
    pbd_done(&p);
}

static void test_free_fall(void** state) {
    (void)state;
    PbdRig p;
    pbd_sheet(&p, 0.03);
    p.pbd.damping = 0;
    pbd_start(&p);
    pbd_run(&p, 50, 0.02);
    // symplectic Euler: z = -g sub^2 n (n + 1) / 2 after n substeps
    double sub = 0.02 / 3, n = 150, z = -9.81 * sub * sub * n * (n + 1) / 2;
    assert_below(deviation(&p, om_quat_identity(), om_vec3(0, 0, z)), 1e-10 * test_tol_scale());
    pbd_done(&p);
}

// One cluster of stiffness 1 is a rigid body: each substep turns it by the same angle and keeps its shape. A
// substep from rest predicts along tangents, whose best rotation has the tangent omega sub.
static void test_rotation_is_rigid(void** state) {
    (void)state;
    PbdRig p;
    pbd_sheet(&p, 0.045);
    p.pbd.cluster_radius = p.pbd.cluster_spacing = 1;
    p.pbd.cluster_stiffness = 1;
    p.pbd.substeps = 1;
    start_free(&p);
    double omega = 3, h = 0.02;
    place(&p, om_quat_identity(), nothing, om_vec3(0, 0, omega), nothing);
    pbd_run(&p, 1, h);
    OmQuat turned = om_quat_axis_angle(om_vec3(0, 0, 1), atan(omega * h));
    assert_below(deviation(&p, turned, nothing), 1e-13 * test_tol_scale());
    pbd_run(&p, 100, h);
    double side = om_distance(om_load3(om_tissue_x(p.r.s), 0), om_load3(om_tissue_x(p.r.s), 14));
    assert_near(side, 14 * 0.003, 1e-13);
    OmQuat any = om_quat_axis_angle(om_normalize(om_vec3(1, 2, 3)), 1);
    place(&p, any, nothing, nothing, nothing);
    pbd_run(&p, 10, h);  // at rest, turned: nothing to do
    assert_below(deviation(&p, any, nothing), 1e-14 * test_tol_scale());
    pbd_done(&p);
}

// What is turned and shaken alike moves alike: the model knows no direction.
static void test_rotation_invariance(void** state) {
    (void)state;
    PbdRig p;
    pbd_box(&p, om_vec3(0.05, 0.03, 0.04), 5, 3, 4);
    start_free(&p);
    size_t n = 3 * (size_t)p.r.mesh.nvert;
    double *a = om_alloc(n, 8), *b = om_alloc(n, 8), *out = om_alloc(n, 8);
    memcpy(a, p.r.mesh.x, n * 8);
    rig_shake(&p.r.mesh, NULL, 0.003, a);
    OmQuat q = om_quat_axis_angle(om_normalize(om_vec3(-1, 0.3, 2)), 2);
    for (int i = 0; i < p.r.mesh.nvert; ++i) om_store3(b, i, om_quat_rotate(q, om_load3(a, i)));
    assert_ok(om_tissue_set_x(p.r.m, p.r.s, a, NULL));
    pbd_run(&p, 10, 0.02);
    memcpy(out, om_tissue_x(p.r.s), n * 8);
    assert_ok(om_tissue_set_x(p.r.m, p.r.s, b, NULL));
    pbd_run(&p, 10, 0.02);
    double worst = 0;
    for (int i = 0; i < p.r.mesh.nvert; ++i)
        worst = fmax(worst, om_distance(om_quat_rotate(q, om_load3(out, i)),
                                        om_load3(om_tissue_x(p.r.s), i)));
    assert_below(worst, 1e-10 * test_tol_scale());  // 270 iterations that do not forget their start
    om_free(a), om_free(b), om_free(out);
    pbd_done(&p);
}

// Linear momentum stays whatever happens. Corrections have no moment about the positions they are found at, which
// for the first iteration after rest are those of the beginning: then angular momentum stays as exactly.
static void check_momentum(PbdRig* p, double linear_stretch, double speed) {
    p->pbd.linear_stretch = linear_stretch;
    p->pbd.substeps = 1;
    if (speed == 0) p->pbd.iterations = 1;
    start_free(p);
    size_t n = 3 * (size_t)p->r.mesh.nvert;
    double *x = om_alloc(n, 8), *v = om_calloc(n, 8);
    memcpy(x, p->r.mesh.x, n * 8);
    rig_shake(&p->r.mesh, NULL, 0.002, x);
    rig_shake(&p->r.mesh, NULL, speed, v);
    assert_ok(om_tissue_set_x(p->r.m, p->r.s, x, v));
    OmVec3 p0, l0, p1, l1;
    om_tissue_get_momentum(p->r.m, p->r.s, &p0, &l0);
    pbd_run(p, 1, 0.02);
    om_tissue_get_momentum(p->r.m, p->r.s, &p1, &l1);
    double scale = 0;
    for (int i = 0; i < p->r.mesh.nvert; ++i)
        scale += om_tissue_mass(p->r.m)[i] * om_norm(om_load3(om_tissue_v(p->r.s), i));
    assert_below(om_distance(p0, p1), 1e-12 * scale * test_tol_scale());
    if (speed == 0) assert_below(om_distance(l0, l1), 1e-12 * scale * 0.05 * test_tol_scale());
    om_free(x), om_free(v);
    pbd_done(p);
}

static void test_momentum_stays(void** state) {
    (void)state;
    PbdRig p;
    for (int k = 0; k < 4; ++k) {
        pbd_box(&p, om_vec3(0.05, 0.03, 0.04), 5, 3, 4);
        check_momentum(&p, k % 2 ? 0.5 : 0, k < 2 ? 0 : 0.1);
        pbd_sheet(&p, 0.045);
        check_momentum(&p, k % 2 ? 0.5 : 0, k < 2 ? 0 : 0.1);
    }
}

// A single layer has clusters of rank two. Shaken for 10,000 steps by forces of zero sum it must keep its
// shape, its side and its place.
static void test_sheet_does_not_flip_or_drift(void** state) {
    (void)state;
    PbdRig p;
    pbd_sheet(&p, 0.03);
    p.r.def.gravity = nothing;
    pbd_start(&p);
    OmRng rng = om_rng_init(4, 0);
    int n = p.r.mesh.nvert;
    double mass = om_tissue_mass(p.r.m)[0], *f = om_tissue_external_force(p.r.s);
    for (int step = 0; step < 10000; ++step) {
        int i = (int)om_rng_below(&rng, (uint32_t)n), j = (int)om_rng_below(&rng, (uint32_t)n);
        OmVec3 kick = {om_rng_normal(&rng), om_rng_normal(&rng), om_rng_normal(&rng)};
        kick = om_scale(20 * mass, kick);
        memset(f, 0, (size_t)n * 24);
        om_store3(f, i, kick);
        om_store3(f, j, om_sub(om_load3(f, j), kick));
        assert_ok(om_tissue_step(p.r.m, p.r.s, p.r.w, 0.02, NULL));
    }
    memset(f, 0, (size_t)n * 24);
    pbd_run(&p, 200, 0.02);
    const double* x = om_tissue_x(p.r.s);
    OmVec3 center = nothing;
    for (int i = 0; i < n; ++i) center = om_madd(center, 1.0 / n, om_load3(x, i));
    assert_below(om_norm(center), 1e-10 * test_tol_scale());  // rounding of 30,000 substeps
    // 10 x 10 particles every 3 mm: normals of all quads agree with that of the corners
    OmVec3 o = om_load3(x, 0);
    OmVec3 up = om_cross(om_sub(om_load3(x, 9), o), om_sub(om_load3(x, 90), o));
    up = om_normalize(up);
    for (int k = 0; k < 9; ++k)
        for (int i = 0; i < 9; ++i) {
            OmVec3 c = om_load3(x, i + 10 * k), a = om_sub(om_load3(x, i + 1 + 10 * k), c),
                   b = om_sub(om_load3(x, i + 10 * (k + 1)), c);
            assert_near(om_norm(a), 0.003, 1e-5);
            assert_near(om_norm(b), 0.003, 1e-5);
            assert_true(om_dot(om_normalize(om_cross(a, b)), up) > 0.999);
        }
    pbd_done(&p);
}

// Collapsed to a point, a line, a plane, mirrored: all come back finite and bounded.
static void test_collapsed_starts(void** state) {
    (void)state;
    const OmVec3 scale[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, -1}, {-1, -1, -1}};
    for (int k = 0; k < 5; ++k) {
        PbdRig p;
        pbd_box(&p, om_vec3(0.04, 0.04, 0.04), 4, 4, 4);
        start_free(&p);
        double* x = om_alloc(3 * (size_t)p.r.mesh.nvert, 8);
        for (int i = 0; i < p.r.mesh.nvert; ++i) {
            OmVec3 d = om_load3(p.r.mesh.x, i);
            om_store3(x, i, om_vec3(d.x * scale[k].x, d.y * scale[k].y, d.z * scale[k].z));
        }
        assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, NULL));
        pbd_run(&p, 300, 0.02);
        for (int i = 0; i < p.r.mesh.nvert; ++i) {
            OmVec3 d = om_sub(om_load3(om_tissue_x(p.r.s), i), om_load3(om_tissue_x(p.r.s), 0));
            assert_below(om_norm(d), 0.2);  // NaN is not below
        }
        om_free(x);
        pbd_done(&p);
    }
}

// Turned by half a turn behind the rotations' back, at which their gradient is zero: they find the way.
static void test_half_turn_is_found(void** state) {
    (void)state;
    PbdRig p;
    pbd_sheet(&p, 0.03);
    p.r.def.gravity = nothing;
    pbd_start(&p);
    OmQuat half[3] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
    for (int k = 0; k < 3; ++k) {
        om_tissue_state_reset(p.r.m, p.r.s);
        double* x = (double*)(uintptr_t)om_tissue_x(p.r.s);
        for (int i = 0; i < p.r.mesh.nvert; ++i)
            om_store3(x, i, om_quat_rotate(half[k], om_load3(p.r.mesh.x, i)));
        pbd_run(&p, 50, 0.02);
        double side = om_distance(om_load3(x, 0), om_load3(x, 9));
        assert_near(side, 0.027, 1e-6);
    }
    pbd_done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_translation_is_exact),
        cmocka_unit_test(test_free_fall),
        cmocka_unit_test(test_rotation_is_rigid),
        cmocka_unit_test(test_rotation_invariance),
        cmocka_unit_test(test_momentum_stays),
        cmocka_unit_test(test_sheet_does_not_flip_or_drift),
        cmocka_unit_test(test_collapsed_starts),
        cmocka_unit_test(test_half_turn_is_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
