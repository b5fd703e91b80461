// test_fem_cook.c: Cook's membrane, compressible against deal.II, nearly incompressible against OpenGeoSys.
#include "test_solid.h"

// The unit box bent into Cook's panel, n x n x 1 cells, thickness 1 mm; u_y at `tip`, mm.
static double cook(OmElement kind, OmLocking locking, OmMaterial material, int n, double force,
                   OmVec3 tip, int nstep) {
    TestSolid t = {.material = material, .locking = locking};
    solid_box(&t, kind, om_vec3(0, 0, 0), om_vec3(1, 1, 1), n, n, 1);
    for (int i = 0; i < t.mesh.nnode; ++i) {
        OmVec3 p = om_load3(t.mesh.x, i);
        double low = 44 * p.x, high = 44 + 16 * p.x;
        om_store3(t.mesh.x, i, om_scale(1e-3, om_vec3(48 * p.x, low + (high - low) * p.y, p.z)));
    }
    solid_start(&t);
    solid_clamp(&t, 0, 0);
    for (int i = 0; i < t.mesh.nnode; ++i) t.fixed[3 * i + 2] = 1;
    solid_keep_faces(&t, 0, 48e-3);
    OmFemPressure push = solid_pressure(&t, om_vec3(0, force / 16e-6, 0), 0);
    t.load.pressure = &push;
    t.load.npressure = 1;
    solid_solve(&t, nstep, 1e-9);
    double u = 1e3 * solid_displacement(&t, solid_nearest(&t, om_scale(1e-3, tip))).y;
    solid_done(&t);
    return u;
}

// C1, deal.II's code gallery.
static void test_cook(void** context) {
    (void)context;
    static const double expected[][2] = {
        {2, 8.63837}, {4, 12.07123}, {8, 13.86320}, {16, 14.48526}, {32, 14.67}};
    double mu = 422.5e3, nu = 0.3;
    OmMaterial material = {.young = 2 * mu * (1 + nu),
                           .poisson = nu,
                           .law = OM_MOONEY_RIVLIN,
                           .volumetric = OM_VOLUME_MIXED};
    for (int k = 0; k < 5; ++k) {
        double u = cook(OM_HEX8, OM_LOCKING_NONE, material, (int)expected[k][0], 1,
                        om_vec3(48, 52, 0), 10);
        printf("Cook: %d cells, %.5f mm, deal.II %.5f\n", (int)expected[k][0], u, expected[k][1]);
        assert_near_rel(u, expected[k][1], 5e-4);
    }
}

// Nearly incompressible: OpenGeoSys' benchmark "Cook's membrane example for nearly incompressible solid under
// large deformation" (Tests/Data/LargeDeformation, quadrilaterals with F-bar; after de Souza Neto et al. 1996
// and Elguedj et al. 2008): 6.8914 mm with 30 cells a side; without F-bar 2.28672 mm with 4.
static void test_cook_incompressible(void** context) {
    (void)context;
    OmMaterial material = {.young = 240.565e6, .poisson = 0.499, .law = OM_MOONEY_RIVLIN};
    OmVec3 tip = {48, 60, 0};
    double reference = 6.891409184641067;
    double plain = cook(OM_HEX8, OM_LOCKING_NONE, material, 4, 100, tip, 1);
    printf("Cook, nu 0.499: hexahedra, 4 cells: %.6f mm, OpenGeoSys 2.286722\n", plain);
    assert_near_rel(plain, 2.2867221436878916, 5e-4);
    for (int n = 8; n <= 32; n *= 2) {
        double locked = cook(OM_TET4, OM_LOCKING_NONE, material, n, 100, tip, 1);
        double u = cook(OM_TET4, OM_NODAL_VOLUME, material, n, 100, tip, 1);
        double smooth = cook(OM_TET4, OM_SMOOTHED, material, n, 100, tip, 1);
        double hex = cook(OM_HEX8_MEAN, OM_LOCKING_NONE, material, n, 100, tip, 1);
        printf(
            "Cook, nu 0.499, %d cells: tetrahedra %.4f mm (%+.2f %%), with nodal volumes %.4f mm "
            "(%+.2f %%), smoothed %.4f mm (%+.2f %%), hexahedra of mean dilatation %.4f mm (%+.2f %%)\n",
            n, locked, 100 * (locked / reference - 1), u, 100 * (u / reference - 1), smooth,
            100 * (smooth / reference - 1), hex, 100 * (hex / reference - 1));
        if (n < 32) continue;
        assert_near_rel(u, reference, 0.04);
        assert_near_rel(smooth, reference, 0.02);
        assert_near_rel(hex, reference, 0.01);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cook),
        cmocka_unit_test(test_cook_incompressible),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
