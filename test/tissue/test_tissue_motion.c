// test_tissue_motion.c: what implicit Euler promises: free fall without error, momentum, order in time, damping.
#include "test_rig.h"

static const OmVec3 lo = {0, 0, 0}, hi = {0.04, 0.03, 0.02};

// Nothing but weight: v_n = v_0 + n h g, x_n = x_0 + n h v_0 + h^2 g n (n + 1) / 2, and with damping a
// v_n+1 = (v_n + h g) / (1 + h a).
static void test_free_fall(void** context) {
    (void)context;
    for (int is_damped = 0; is_damped < 2; ++is_damped) {
        TestRig r;
        rig_box(&r, lo, hi, 4, 3, 2);
        r.def.rayleigh_mass = is_damped ? 3 : 0;
        r.def.solver.preconditioner = OM_CHOLESKY;
        rig_start(&r);
        double h = 0.02, a = r.def.rayleigh_mass;
        OmVec3 g = r.def.gravity, v = {0.3, -0.1, 0.5}, d = {0, 0, 0};
        double* speed = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *speed);
        for (int i = 0; i < r.mesh.nvert; ++i) om_store3(speed, i, v);
        assert_ok(om_tissue_set_x(r.m, r.s, r.mesh.x, speed));
        for (int n = 0; n < 50; ++n) {
            assert_ok(om_tissue_step(r.m, r.s, r.w, h, NULL));
            v = om_scale(1 / (1 + h * a), om_madd(v, h, g));
            d = om_madd(d, h, v);
        }
        assert_near(om_tissue_time(r.s), 1, 1e-12);
        for (int i = 0; i < r.mesh.nvert; ++i) {
            OmVec3 x = om_add(om_load3(r.mesh.x, i), d);
            // 5 m at 10 m/s; rows of h^2 K, 300 times the mass, sum to zero but for rounding to float
            assert_near(om_norm(om_sub(om_load3(om_tissue_x(r.s), i), x)), 0, 5e-5);
            assert_near(om_norm(om_sub(om_load3(om_tissue_v(r.s), i), v)), 0, 1e-4);
        }
        om_free(speed);
        rig_done(&r);
    }
}

typedef struct Momentum {
    OmVec3 linear, angular;
    double energy;
} Momentum;

static Momentum momentum_of(const TestRig* r) {
    Momentum p;
    OmTissueEnergy e;
    om_tissue_get_momentum(r->m, r->s, &p.linear, &p.angular);
    assert_ok(om_tissue_get_energy(r->m, r->s, &e));
    p.energy = e.kinetic + e.elastic;
    return p;
}

// A free body that spins, drifts and vibrates; returns the change of angular momentum, relative.
static double spin_change(double h, double seconds, OmPreconditioner preconditioner, OmLaw law,
                          int max_newton) {
    TestRig r;
    rig_box(&r, lo, hi, 4, 3, 2);
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.rayleigh_mass = 0;
    r.def.solver.preconditioner = preconditioner;
    r.def.solver.tolerance = 1e-7;
    r.def.material_default.law = law;
    r.def.max_newton = max_newton;
    r.def.newton_tolerance = 1e-8;
    rig_start(&r);
    size_t n = 3 * (size_t)r.mesh.nvert;
    double *x = om_alloc(n, sizeof *x), *v = om_alloc(n, sizeof *v);
    OmVec3 spin = om_vec3(2, -1, 6), drift = om_vec3(0.1, 0.05, -0.02);
    for (int i = 0; i < r.mesh.nvert; ++i) {
        OmVec3 p = om_load3(r.mesh.x, i), arm = om_sub(p, om_scale(0.5, hi));
        om_store3(x, i, om_madd(p, 0.05, om_vec3(p.x, -p.y, 0)));
        om_store3(v, i, om_add(drift, om_cross(spin, arm)));
    }
    assert_ok(om_tissue_set_x(r.m, r.s, x, v));
    Momentum before = momentum_of(&r), last = before;
    for (int k = 0; k < (int)lround(seconds / h); ++k) {
        assert_ok(om_tissue_step(r.m, r.s, r.w, h, NULL));
        Momentum now = momentum_of(&r);
        // one linearisation a step is not the implicit equation itself: 1e-4 of energy may come back
        assert_true(now.energy <= last.energy * (1 + (max_newton > 1 ? 1e-9 : 1e-3)));
        last = now;
    }
    // rows of K sum to zero but for their rounding to float: 1e-7 of the internal forces
    assert_near(om_norm(om_sub(last.linear, before.linear)), 0, 1e-5 * om_norm(before.linear));
    om_free(x);
    om_free(v);
    rig_done(&r);
    return om_norm(om_sub(last.angular, before.angular)) / om_norm(before.angular);
}

// Implicit Euler with one linearisation keeps linear momentum. Angular momentum it changes to first order in
// h while vibrations are resolved (the moment of h K v on a strained body); where steps are longer it stays
// within some thousandths.
static void test_momentum(void** context) {
    (void)context;
    OmLaw turned = OM_COROTATIONAL;
    for (double h = 0.02; h > 0.001; h *= 0.5)
        assert_below(spin_change(h, 0.2, OM_CHOLESKY, turned, 1), 5e-3);
    (void)spin_change(0.01, 0.2, OM_MULTIGRID, turned, 1);
    double a = spin_change(4e-4, 0.02, OM_CHOLESKY, turned, 1),
           b = spin_change(2e-4, 0.02, OM_CHOLESKY, turned, 1),
           c = spin_change(1e-4, 0.02, OM_CHOLESKY, turned, 1);
    printf("angular momentum changed in 20 ms by %.3g, %.3g, %.3g of it at h = 0.4, 0.2, 0.1 ms\n",
           a, b, c);
    assert_true(log2(a / b) > 0.7 && log2(b / c) > 0.7);
}

// Solved to the end, the forces of a step belong to its final shape and have no moment about it: angular momentum is
// lost only as implicit Euler loses it, (h w)^2 of it a step for a spin w, and energy never grows. The linearised
// forces of hyperelastic laws have a moment, h v x f: a body that spins and vibrates at 5 % strain loses a third of
// its momentum in 20 steps with them, whether the tangent is projected or not.
static void test_momentum_of_laws(void** context) {
    (void)context;
    const OmLaw law[] = {OM_NEO_HOOKEAN, OM_STABLE_NEO_HOOKEAN, OM_ST_VENANT_KIRCHHOFF};
    for (int k = 0; k < 3; ++k) {
        double once = spin_change(0.01, 0.2, OM_CHOLESKY, law[k], 1);
        double a = spin_change(0.01, 0.2, OM_CHOLESKY, law[k], 50),
               b = spin_change(0.005, 0.2, OM_CHOLESKY, law[k], 50);
        printf(
            "%s: angular momentum changed by %.3g (one linearisation), converged %.3g, %.3g at h = "
            "10, 5 ms\n",
            om_law_name(law[k]), once, a, b);
        assert_below(once, 0.5);
        // 20 steps of (0.01 s x 6.4 /s)^2, and half as much at half the step
        assert_below(a, 20 * 0.064 * 0.064);
        assert_below(b, 0.7 * a);
    }
}

// ---- order in time ----------------------------------------------------------------------------------

// The free end of a bar that swings down under its weight, after 0.16 s.
static OmVec3 swing(double h) {
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.02, 0.02), 6, 2, 2);
    rig_attach_plane(&r, 0, 0);
    r.def.material_default.young = 20000;
    rig_start(&r);
    for (int n = 0; n < (int)lround(0.16 / h); ++n)
        assert_ok(om_tissue_step(r.m, r.s, r.w, h, NULL));
    OmVec3 end = om_load3(om_tissue_x(r.s), 6 + 7 * (1 + 3 * 1));
    rig_done(&r);
    return end;
}

static void test_order_in_time(void** context) {
    (void)context;
    OmVec3 exact = swing(0.000125);
    double error[3], h = 0.004;
    for (int k = 0; k < 3; ++k, h *= 0.5) error[k] = om_norm(om_sub(swing(h), exact));
    printf("free end after 0.16 s: errors %.3g, %.3g, %.3g mm at h = 4, 2, 1 ms\n", 1e3 * error[0],
           1e3 * error[1], 1e3 * error[2]);
    for (int k = 0; k < 2; ++k) {
        double order = log2(error[k] / error[k + 1]);
        assert_true(order > 0.8 && order < 1.3);
    }
}

// ---- damping of one mode ------------------------------------------------------------------------------

// The slowest mode of K phi = w^2 M phi, of largest entry 1; returns w.
static double find_mode(const TestRig* r, double* phi) {
    int n = r->mesh.nvert;
    const double* mass = om_tissue_mass(r->m);
    double* b = om_alloc(3 * (size_t)n, sizeof *b);
    double h = 10, value = 0;
    assert_ok(om_tissue_begin_step(r->m, r->s, r->w, h));
    for (int k = 0; k < 3 * n; ++k) phi[k] = k % 3 == 2;
    for (int round = 0; round < 60; ++round) {
        double largest = 0, top = 0, bottom = 0;
        for (int k = 0; k < 3 * n; ++k) largest = fmax(largest, fabs(phi[k]));
        for (int k = 0; k < 3 * n; ++k) b[k] = mass[k / 3] * (phi[k] /= largest);
        memset(phi, 0, 3 * (size_t)n * sizeof *phi);
        assert_ok(om_tissue_solve(r->m, r->w, 1, b, phi, NULL));
        for (int k = 0; k < 3 * n; ++k) {  // Rayleigh's quotient of (M + h^2 K)^-1 M
            top += phi[k] * mass[k / 3] * phi[k];
            bottom += phi[k] * b[k];
        }
        value = top / bottom;
    }
    double largest = 0;
    for (int k = 0; k < 3 * n; ++k) largest = fmax(largest, fabs(phi[k]));
    for (int k = 0; k < 3 * n; ++k) phi[k] /= largest;
    om_free(b);
    return sqrt((1 / value - 1) / (h * h));
}

// A mode of frequency w and damping c = a + b w^2 does, in implicit Euler,
// q_n+1 (1 + h c + h^2 w^2) = q_n (2 + h c) - q_n-1; its envelope falls at the rate c / 2 + h w^2 / 2.
static void check_damping(double a, double b) {
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.02, 0.02), 6, 2, 2);
    rig_attach_plane(&r, 0, 0);
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.rayleigh_mass = 0;
    r.def.solver.preconditioner = OM_CHOLESKY;
    rig_start(&r);
    size_t n = 3 * (size_t)r.mesh.nvert;
    double *phi = om_calloc(n, sizeof *phi), *x = om_alloc(n, sizeof *x);
    double w = find_mode(&r, phi), h = 0.02 / w, c = a + b * w * w, size = 1e-4;
    om_tissue_work_destroy(r.w);
    om_tissue_state_destroy(r.s);
    om_tissue_destroy(r.m);
    r.def.rayleigh_mass = a;
    r.def.rayleigh_stiffness = b;
    rig_start(&r);
    for (size_t k = 0; k < n; ++k) x[k] = r.mesh.x[k] + size * phi[k];
    assert_ok(om_tissue_set_x(r.m, r.s, x, NULL));
    const double* mass = om_tissue_mass(r.m);
    double norm = 0, q0 = 1, q1 = 1, peak_time = 0, peak = 1;
    for (size_t k = 0; k < n; ++k) norm += phi[k] * mass[k / 3] * phi[k];
    int nstep = (int)(6 * 3.14159265 / (w * h));
    for (int k = 1; k <= nstep; ++k) {
        assert_ok(om_tissue_step(r.m, r.s, r.w, h, NULL));
        double q = 0;
        for (size_t i = 0; i < n; ++i)
            q += phi[i] * mass[i / 3] * (om_tissue_x(r.s)[i] - r.mesh.x[i]) / (size * norm);
        double next = ((2 + h * c) * q1 - q0) / (1 + h * c + h * h * w * w);
        q0 = q1;
        q1 = next;
        // rounding of stresses and the curvature of a displacement of 0.1 mm
        assert_near(q, next, 2e-3);
        if (k > nstep / 2 && q0 > q1 && q > peak * exp(-10)) {
            peak = fmax(peak_time > 0 ? peak : 0, q);
            if (peak == q) peak_time = om_tissue_time(r.s);
        }
    }
    double rate = -log(peak) / peak_time, theory = 0.5 * (c + h * w * w);
    printf("mode of %.2f Hz, a %g 1/s, b %g s: damping rate %.4f 1/s, theory %.4f\n",
           w / (2 * 3.14159265), a, b, rate, theory);
    assert_near_rel(rate, theory, 0.03);
    om_free(phi);
    om_free(x);
    rig_done(&r);
}

static void test_rayleigh_damping(void** context) {
    (void)context;
    check_damping(0, 0);
    check_damping(1.5, 0);
    check_damping(0, 0.004);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_fall), cmocka_unit_test(test_momentum),
        cmocka_unit_test(test_momentum_of_laws), cmocka_unit_test(test_order_in_time),
        cmocka_unit_test(test_rayleigh_damping)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
