// test_fem_cases.c: numbers that other codes and books give for the same meshes and laws.
//
// FEBio's test suite (te01, ma36, ma02, ma01, dy11), CalculiX's beamog, caribou's StVK beam. "norm" is that of all
// free displacements at the end.
#include "test_solid.h"

// A1, FEBio te01: one linear tetrahedron pressed down.
static void test_one_tetrahedron(void** context) {
    (void)context;
    TestSolid t = {0};
    OmTetMesh tet;
    assert_ok(om_tet_mesh_init(&tet, 4, 1));
    const double x[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    memcpy(tet.x, x, sizeof x);
    for (int a = 0; a < 4; ++a) tet.tet_vert[a] = a;
    assert_ok(om_fem_mesh_from_tet(&tet, OM_TET4, &t.mesh));
    om_tet_mesh_done(&tet);
    t.material = (OmMaterial){
        .young = 6, .law = OM_MOONEY_RIVLIN, .volumetric = OM_VOLUME_LOG, .c10 = 1, .bulk = 1000};
    solid_start(&t);
    for (int i = 0; i < 4; ++i) {
        t.fixed[3 * i + 2] = i != 3;
        t.fixed[3 * i + 1] = i != 2;
        t.fixed[3 * i] = i != 1;
    }
    t.force[11] = -0.5;
    solid_solve(&t, 4, 1e-12);
    assert_near_rel(solid_free_norm(&t), 0.44268188785, 1e-4);
    assert_near_rel(t.x[3] - 1, 0.21446319, 1e-4);
    assert_near_rel(t.x[11] - 1, -0.32245673, 1e-4);
    solid_done(&t);
}

// A2, FEBio ma36: a cube of coupled neo-Hookean drawn out.
static void test_one_cube(void** context) {
    (void)context;
    TestSolid t = {.material = {.young = 1, .poisson = 0.3, .law = OM_NEO_HOOKEAN}};
    solid_box(&t, OM_HEX8, om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1);
    solid_start(&t);
    for (int k = 0; k < 3; ++k) solid_hold(&t, k, 0, k, 0);
    solid_hold(&t, 0, 1, 0, 1);
    solid_solve(&t, 1, 1e-12);
    assert_near_rel(solid_free_norm(&t), 0.571123119063, 1e-4);
    assert_near_rel(t.x[solid_nearest(&t, om_vec3(1, 1, 1)) * 3 + 1], 0.7980774858, 1e-4);
    solid_done(&t);
}

// A5 and A6, FEBio ma02 and ma01: a clamped block of Ogden's law drawn to one and a half.
static double drawn_block(OmElement kind, OmMaterial material) {
    TestSolid t = {.material = material};
    solid_box(&t, kind, om_vec3(-1, -0.5, 0), om_vec3(1, 0.5, 1), 8, 4, 4);
    solid_start(&t);
    solid_clamp(&t, 0, -1);
    solid_clamp(&t, 0, 1);
    solid_hold(&t, 0, 1, 0, 1);
    OmFemStaticDef def = om_fem_static_default_def(t.solid);
    def.max_newton = 300;
    def.tolerance = 1e-10;
    assert_ok(om_fem_static_solve(t.solid, &t.load, &def, t.x, NULL, &t.report));
    double norm = solid_free_norm(&t);
    printf("Ogden block, %s: %.6f in %d iterations\n", om_element_name(kind), norm,
           t.report.nnewton);
    solid_done(&t);
    return norm;
}

static void test_ogden_blocks(void** context) {
    (void)context;
    OmMaterial soft = {.young = 1,
                       .law = OM_OGDEN_COUPLED,
                       .bulk = 1,
                       .nterm = 1,
                       .ogden_mu = {0.658 / 6.83},
                       .ogden_alpha = {6.83}};
    OmMaterial stiff = soft;
    stiff.law = OM_OGDEN;
    stiff.volumetric = OM_VOLUME_LOG;
    stiff.bulk = 1000;
    double a5 = drawn_block(OM_HEX8, soft), a6 = drawn_block(OM_HEX8_MEAN, stiff);
    assert_near_rel(a5, 7.50244860312, 1e-4);
    assert_near_rel(a6, 7.73149507271, 1e-4);
    // What locking costs a plain hexahedron; its equilibrium is a saddle (pressures checker), to which projected
    // tangents take some 200 iterations.
    assert_near_rel(drawn_block(OM_HEX8, stiff), 8.00642, 1e-4);
}

// A8, CalculiX beamog: a bar of Ogden's law pulled; the exact answer is uniform.
static void test_ogden_bar(void** context) {
    (void)context;
    double mu = 3.488, alpha = 2.163;
    TestSolid t = {.material = {.young = 1,
                                .law = OM_OGDEN,
                                .nterm = 1,
                                .ogden_mu = {2 * mu / alpha},
                                .ogden_alpha = {alpha},
                                .bulk = 2 * mu / 0.1}};
    solid_box(&t, OM_HEX8, om_vec3(0, 0, 0), om_vec3(1, 1, 8), 1, 1, 4);
    solid_start(&t);
    for (int k = 0; k < 3; ++k) solid_hold(&t, k, 0, k, 0);
    solid_keep_faces(&t, 2, 8);
    OmFemPressure pull = solid_pressure(&t, om_vec3(0, 0, 1), 0);
    t.load.pressure = &pull;
    t.load.npressure = 1;
    solid_solve(&t, 1, 1e-12);
    OmVec3 u = solid_displacement(&t, solid_nearest(&t, om_vec3(1, 1, 8)));
    printf("Ogden bar: uz %.7f, ux %.8f\n", u.z, u.x);
    assert_near_rel(u.z, 0.8549496, 1e-6);
    assert_near_rel(u.x, -0.0470033, 1e-5);
    solid_done(&t);
}

// ---- caribou's beam ---------------------------------------------------------------------------------

static void start_beam(TestSolid* t) {
    solid_box(t, OM_HEX8, om_vec3(-7.5, -7.5, 0), om_vec3(7.5, 7.5, 80), 2, 2, 8);
    solid_start(t);
    solid_clamp(t, 2, 0);
}

// B1: bent by a dead traction; also the residuals of Newton's method in the first step.
static void test_beam_static(void** context) {
    (void)context;
    TestSolid t = {.material = {.young = 3000, .poisson = 0.499, .law = OM_ST_VENANT_KIRCHHOFF}};
    start_beam(&t);
    solid_keep_faces(&t, 2, 80);
    OmFemPressure push = solid_pressure(&t, om_vec3(0, -30, 0), 0);
    OmFemPressure first = solid_pressure(&t, om_vec3(0, -6, 0), 0);
    t.load.npressure = 1;
    t.load.pressure = &first;
    OmFemStaticDef def = om_fem_static_default_def(t.solid);
    def.is_plain = true;
    assert_ok(om_fem_static_solve(t.solid, &t.load, &def, t.x, NULL, &t.report));
    const double expected[] = {1, 4.802014099846802e-3, 3.457785823647809e-4, 6.417769508095073e-8};
    assert_true(t.report.nhistory >= 5);
    for (int k = 0; k < 4; ++k)
        assert_near_rel(t.report.history[k + 1] / t.report.history[1], expected[k], 1e-5);
    memcpy(t.x, t.mesh.x, 3 * (size_t)t.mesh.nnode * sizeof(double));
    t.load.pressure = &push;
    solid_solve(&t, 5, 1e-10);
    OmVec3 p = om_load3(t.x, 76);
    printf("beam bent: (%.5f, %.5f, %.5f)\n", p.x, p.y, p.z);
    assert_near(p.x, 0, 1e-6);
    assert_near_rel(p.y, -21.01640, 1e-4);
    assert_near_rel(p.z, 76.18975, 1e-4);
    solid_done(&t);
}

// B2: falls under gravity by backward Euler of whole seconds.
static void test_beam_dynamic(void** context) {
    (void)context;
    static const double expected[][3] = {
        {1, -9.56227989, 79.39044912},  {2, -22.00410425, 76.59222366},
        {3, -31.20604723, 72.81692907}, {4, -35.28683993, 70.56333712},
        {5, -34.98586695, 70.70392039}, {10, -24.46657107, 75.68966106},
        {30, -27.10271984, 74.64181417}};
    TestSolid t = {.material = {.young = 15000, .poisson = 0.3, .law = OM_ST_VENANT_KIRCHHOFF},
                   .density = 0.2};
    start_beam(&t);
    t.load.body = om_vec3(0, -9.81, 0);
    OmFemDynamicDef def = om_fem_dynamic_default_def(t.solid);
    OmFemDynamics* d;
    def.is_consistent_mass = true;
    assert_ok(om_fem_dynamics_create(t.solid, &def, &d));
    OmFemMotion m = {t.x, t.v, 0};
    double worst = 0;
    for (int step = 1, next = 0; step <= 30; ++step) {
        assert_ok(om_fem_step(d, &t.load, 1, &m, &t.report));
        if (step != (int)expected[next][0]) continue;
        for (int k = 1; k < 3; ++k)
            worst = fmax(worst, fabs(t.x[3 * 76 + k] / expected[next][k] - 1));
        ++next;
    }
    printf("beam falling: within %.2g\n", worst);
    assert_below(worst, 5e-4);
    om_fem_dynamics_destroy(d);
    solid_done(&t);
}

// E1, FEBio dy11: the amplitude of a cube that a sudden load sets swinging does not decay.
static void test_swinging_cube(void** context) {
    (void)context;
    TestSolid t = {.material = {.young = 10, .poisson = 0, .law = OM_NEO_HOOKEAN}, .density = 1};
    solid_box(&t, OM_HEX8, om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1);
    solid_start(&t);
    for (int k = 0; k < 3; ++k) solid_hold(&t, k, 0, k, 0);
    t.load.body = om_vec3(0, 0, -1);
    OmFemDynamicDef def = om_fem_dynamic_default_def(t.solid);
    OmFemDynamics* d;
    def.is_consistent_mass = true;
    def.integrator = OM_IMPLICIT_MIDPOINT;
    assert_ok(om_fem_dynamics_create(t.solid, &def, &d));
    OmFemMotion m = {t.x, t.v, 0};
    double early = 0, late = 0;
    for (int step = 1; step <= 80; ++step) {
        assert_ok(om_fem_step(d, &t.load, 0.05, &m, NULL));
        double u = 1 - t.x[3 * 7 + 2];
        if (step <= 40)
            early = fmax(early, u);
        else
            late = fmax(late, u);
    }
    printf("swinging cube: norm %.6f, amplitude %.6f early, %.6f late\n", solid_free_norm(&t),
           early, late);
    assert_near_rel(solid_free_norm(&t), 0.187507, 5e-4);
    assert_near_rel(early, late, 2e-2);  // the peak falls between steps
    om_fem_dynamics_destroy(d);
    solid_done(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_tetrahedron), cmocka_unit_test(test_one_cube),
        cmocka_unit_test(test_ogden_blocks),    cmocka_unit_test(test_ogden_bar),
        cmocka_unit_test(test_beam_static),     cmocka_unit_test(test_beam_dynamic),
        cmocka_unit_test(test_swinging_cube),

    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
