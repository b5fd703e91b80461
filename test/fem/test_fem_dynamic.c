// test_fem_dynamic.c: motions: free fall, momenta, energy, explicit against implicit, the stable step.
#include "test_solid.h"

static OmFemDynamics* make_dynamics(const TestSolid* t, OmIntegrator integrator, double damping) {
    OmFemDynamicDef def = om_fem_dynamic_default_def(t->solid);
    OmFemDynamics* d;
    def.integrator = integrator;
    def.mass_damping = damping;
    def.tolerance = 1e-11;
    assert_ok(om_fem_dynamics_create(t->solid, &def, &d));
    return d;
}

// Every node falls alike: by Euler h^2 g n (n + 1) / 2, by the midpoint rule and central differences g t^2 / 2.
static void test_free_fall(void** context) {
    (void)context;
    double h = 0.01, g = 9.81;
    for (int k = OM_IMPLICIT_EULER; k <= OM_CENTRAL_DIFFERENCE; ++k) {
        TestSolid t = {.material = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN}};
        solid_box(&t, OM_TET10, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), 2, 2, 2);
        solid_start(&t);
        t.load.body = om_vec3(0, 0, -g);
        double step = k == OM_CENTRAL_DIFFERENCE ? 1e-4 : h;
        int nstep = 20;
        OmFemDynamics* d = make_dynamics(&t, (OmIntegrator)k, 0);
        OmFemMotion m = {t.x, t.v, 0};
        for (int i = 0; i < nstep; ++i) assert_ok(om_fem_step(d, &t.load, step, &m, NULL));
        double fall = k == OM_IMPLICIT_MIDPOINT ? 0.5 * g * step * step * nstep * nstep
                                                : 0.5 * g * step * step * nstep * (nstep + 1);
        for (int i = 0; i < t.mesh.nnode; ++i) {
            OmVec3 u = solid_displacement(&t, i);
            assert_near(u.x, 0, 1e-12);
            assert_near_rel(u.z, -fall, 1e-9);
        }
        om_fem_dynamics_destroy(d);
        solid_done(&t);
    }
}

// A free body thrown, spinning and shaken: the midpoint rule keeps both momenta, and energy nearly.
static void test_momenta(void** context) {
    (void)context;
    for (int consistent = 0; consistent < 2; ++consistent) {
        TestSolid t = {.material = {.young = 3000, .poisson = 0.45, .law = OM_MOONEY_RIVLIN}};
        solid_box(&t, OM_HEX8, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.2), 3, 3, 6);
        solid_start(&t);
        OmFemDynamicDef def = om_fem_dynamic_default_def(t.solid);
        OmFemDynamics* d;
        def.integrator = OM_IMPLICIT_MIDPOINT;
        def.is_consistent_mass = consistent;
        def.tolerance = 1e-12;
        assert_ok(om_fem_dynamics_create(t.solid, &def, &d));
        OmRng rng = om_rng_init(1, 1);
        for (int i = 0; i < t.mesh.nnode; ++i) {
            OmVec3 x = om_load3(t.mesh.x, i), v = om_cross(om_vec3(2, -1, 4), x);
            for (int k = 0; k < 3; ++k) t.v[3 * i + k] = om_rng_range(&rng, -0.1, 0.1) + (k == 1);
            om_store3(t.v, i, om_add(om_load3(t.v, i), v));
        }
        OmFemMotion m = {t.x, t.v, 0};
        OmVec3 p0, L0, p, L;
        double stored, first = om_fem_eval_momentum(t.solid, consistent, &m, &p0, &L0), worst = 0;
        for (int step = 0; step < 50; ++step) {
            assert_ok(om_fem_step(d, &t.load, 5e-3, &m, NULL));
            double energy = om_fem_eval_momentum(t.solid, consistent, &m, &p, &L);
            assert_ok(om_fem_eval_energy(t.solid, t.x, &stored));
            worst = fmax(worst, fabs(energy + stored - first) / first);
            assert_below(om_distance(p, p0), 1e-9 * om_norm(p0));
            assert_below(om_distance(L, L0), 1e-9 * om_norm(L0));
        }
        printf("thrown body: energy within %.2g\n", worst);
        assert_below(worst, 0.02);
        om_fem_dynamics_destroy(d);
        solid_done(&t);
    }
}

// Euler's method never gains energy, and damping takes what it says from a free body: v e^-at.
static void test_decay(void** context) {
    (void)context;
    TestSolid t = {.material = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN}};
    solid_box(&t, OM_TET4, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), 3, 3, 3);
    solid_start(&t);
    for (int k = OM_IMPLICIT_EULER; k <= OM_CENTRAL_DIFFERENCE; ++k) {
        OmFemDynamics* d = make_dynamics(&t, (OmIntegrator)k, 3);
        memcpy(t.x, t.mesh.x, 3 * (size_t)t.mesh.nnode * sizeof(double));
        for (int i = 0; i < 3 * t.mesh.nnode; ++i) t.v[i] = i % 3 == 0;
        OmFemMotion m = {t.x, t.v, 0};
        for (int i = 0; i < 200; ++i) assert_ok(om_fem_step(d, &t.load, 1e-3, &m, NULL));
        double expected = k == OM_IMPLICIT_EULER ? pow(1 + 3e-3, -200) : exp(-0.6);
        assert_near_rel(t.v[0], expected, 1e-5);
        om_fem_dynamics_destroy(d);
    }
    solid_done(&t);
}

// A bar under a sudden load: the explicit method at half its stable step and the midpoint rule agree.
static void test_explicit_against_implicit(void** context) {
    (void)context;
    double z[2];
    for (int k = 0; k < 2; ++k) {
        TestSolid t = {.material = {.young = 3000, .poisson = 0.4, .law = OM_NEO_HOOKEAN}};
        solid_box(&t, OM_TET4, om_vec3(0, 0, 0), om_vec3(0.04, 0.04, 0.1), 2, 2, 5);
        solid_start(&t);
        solid_clamp(&t, 2, 0);
        t.load.body = om_vec3(2, 0, -3);
        double h, end = 0.15;
        assert_ok(om_fem_eval_stable_step(t.solid, t.x, t.fixed, &h));
        int nstep = (int)ceil(end / (0.5 * h));
        OmFemDynamics* d =
            make_dynamics(&t, k == 0 ? OM_CENTRAL_DIFFERENCE : OM_IMPLICIT_MIDPOINT, 0);
        for (int i = 0; i < t.mesh.nnode && k == 0; ++i)  // half a step before the load
            if (!t.fixed[3 * i]) om_store3(t.v, i, om_scale(-0.5 * end / nstep, t.load.body));
        OmFemMotion m = {t.x, t.v, 0};
        for (int i = 0; i < nstep; ++i) assert_ok(om_fem_step(d, &t.load, end / nstep, &m, NULL));
        z[k] = om_norm(solid_displacement(&t, solid_nearest(&t, om_vec3(0.04, 0.04, 0.1))));
        om_fem_dynamics_destroy(d);
        solid_done(&t);
    }
    printf("bar set swinging: tip moved %.6f m explicitly, %.6f m by the midpoint rule\n", z[0],
           z[1]);
    assert_near_rel(z[0], z[1], 5e-3);
}

// Energy of a shaken cube after 3,000 explicit steps of `share` of the estimate, over that at the start; huge
// if it blew up.
static double energy_growth(OmElement kind, double share) {
    TestSolid t = {.material = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN}};
    solid_box(&t, kind, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), 3, 3, 3);
    solid_start(&t);
    solid_clamp(&t, 2, 0);
    double h, stored, growth = 1e300;
    assert_ok(om_fem_eval_stable_step(t.solid, t.x, t.fixed, &h));
    OmRng rng = om_rng_init(6, 1);
    for (int i = 0; i < 3 * t.mesh.nnode; ++i)
        t.v[i] = t.fixed[i] ? 0 : om_rng_range(&rng, -1e-3, 1e-3);
    OmFemDynamics* d = make_dynamics(&t, OM_CENTRAL_DIFFERENCE, 0);
    OmFemMotion m = {t.x, t.v, 0};
    double first = om_fem_eval_momentum(t.solid, false, &m, NULL, NULL);
    OmStatus status = OM_OK;
    for (int i = 0, nstep = test_is_slow() ? 3000 : 1200; i < nstep && status == OM_OK; ++i)
        status = om_fem_step(d, &t.load, share * h, &m, NULL);
    if (status == OM_OK) {
        assert_ok(om_fem_eval_energy(t.solid, t.x, &stored));
        growth = (stored + om_fem_eval_momentum(t.solid, false, &m, NULL, NULL)) / first;
    }
    om_fem_dynamics_destroy(d);
    solid_done(&t);
    return growth;
}

// Stable at the estimate, not at 1.05 of it. With steps of h = 2 s / w a mode of frequency w keeps v- v+ + (w x)^2, of
// the velocities half a step before and after. What is measured, (w x)^2 + v-^2, lies between 1 / (1 + s) and
// 1 / (1 - s) of it, and equals it at the start, where x = 0. No mode has a larger s than the share of the limit.
static void test_stable_step(void** context) {
    (void)context;
    const OmElement kind[] = {OM_TET4, OM_HEX8, OM_TET10};
    for (int k = 0; k < 3; ++k) {
        double calm = energy_growth(kind[k], 1), wild = energy_growth(kind[k], 1.05);
        double half = energy_growth(kind[k], 0.5), max = energy_growth(kind[k], 0.9);
        printf(
            "%s: energy x %.3g, %.3g, %.3g at 0.5, 0.9 and all of the stable step, x %.3g at 1.05 of it\n",
            om_element_name(kind[k]), half, max, calm, wild);
        assert_true(half > 1 / 1.5 && half < 1 / 0.5);
        assert_true(max > 1 / 1.9 && max < 1 / 0.1);
        assert_below(calm, 4);  // at the limit itself one mode grows in proportion to the steps
        assert_true(wild > 1e4);
    }
}

// What cannot be done is said, and nothing changes.
static void test_refusals(void** context) {
    (void)context;
    TestSolid t = {.material = {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN}};
    solid_box(&t, OM_TET4, om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.1), 1, 1, 1);
    solid_start(&t);
    OmFemDynamicDef def = om_fem_dynamic_default_def(t.solid);
    OmFemDynamics* d;
    def.mass_damping = -1;
    assert_status(om_fem_dynamics_create(t.solid, &def, &d), OM_INVALID);
    assert_null(d);
    d = make_dynamics(&t, OM_IMPLICIT_EULER, 0);
    OmFemMotion m = {t.x, t.v, 0};
    assert_status(om_fem_step(d, &t.load, 0, &m, NULL), OM_INVALID);
    t.v[0] = NAN;
    assert_status(om_fem_step(d, &t.load, 0.01, &m, NULL), OM_INVALID);
    t.v[0] = 0;
    t.load.body.x = INFINITY;
    assert_status(om_fem_step(d, &t.load, 0.01, &m, NULL), OM_INVALID);
    for (int i = 0; i < 3 * t.mesh.nnode; ++i) assert_true(t.x[i] == t.mesh.x[i] && t.v[i] == 0);
    om_fem_dynamics_destroy(d);
    solid_done(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_fall),   cmocka_unit_test(test_momenta),
        cmocka_unit_test(test_decay),       cmocka_unit_test(test_explicit_against_implicit),
        cmocka_unit_test(test_stable_step), cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
