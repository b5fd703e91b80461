// test_contact_hertz.c: a sphere pressed into a half space.
#include "test_rig.h"

#include "omentum/contact_tool.h"

// Cells of 0.6 mm within 4.8 mm, then 1.6 times longer each.
static double grade(double u) {
    enum { INNER = 8, OUTER = 8 };
    double cell = fabs(u) * (INNER + OUTER), x = 0.0006 * fmin(cell, INNER), length = 0.0006;
    for (int k = INNER; k + 0.5 < cell; ++k) x += length *= 1.6;
    return copysign(x, u);
}

// Hertz (F3 of the reference cases): R 10 mm, 1 mm deep, E 5 kPa, nu 0.45: 0.0264349 N within 5 %. A block of
// 140 x 140 x 70 mm stands for the half space.
static void test_hertz(void** test) {
    (void)test;
    TestRig r;
    OmProbe* probe;
    OmPress* press;
    rig_box(&r, om_vec3(-1, -1, -1), om_vec3(1, 1, 0), 32, 32, 16);
    rig_attach_plane(&r, 2, -1);
    for (int n = 0; n < 3 * r.mesh.nvert; ++n) r.mesh.x[n] = grade(r.mesh.x[n]);
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.solver.tolerance = 1e-4;
    r.def.solver.nworker = 2;
    r.def.material_default.young = 5000;
    rig_start(&r);
    OmSurface top;  // the grid around the contact
    assert_ok(om_surface_init(&top, 17 * 17, 2 * 16 * 16));
    for (int j = 0, *t = top.tri_vert; j < 17; ++j) {
        for (int i = 0; i < 17; ++i) {
            om_store3(top.x, i + 17 * j, om_vec3(0.0006 * (i - 8), 0.0006 * (j - 8), 0));
            if (i == 16 || j == 16) continue;
            int a = i + 17 * j, tri[6] = {a, a + 1, a + 18, a, a + 18, a + 17};
            memcpy(t, tri, sizeof tri);
            t += 6;
        }
    }
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    shape.radius = 0.01;
    assert_ok(om_probe_create(&shape, &probe));
    OmPressDef def = om_press_default_def(probe);
    def.surface = &top;
    assert_ok(om_press_create(&def, r.m, &press));
    om_surface_done(&top);
    OmPose pose = {om_vec3(0, 0, 0.01), om_quat_identity()};
    assert_ok(om_press_place(press, r.m, r.s, pose));
    OmPressReport report = {0};
    for (int k = 0; k < 5; ++k) {
        pose.p.z = 0.01 - 0.001 * fmin(1, (k + 1) / 3.0);
        assert_ok(om_press_step(press, r.m, r.s, r.w, pose, 5, &report));
    }
    double radius = sqrt(report.area / OM_PI);
    printf("Hertz: %.5f N (0.02643), contact radius %.2f mm (3.16), %d contacts\n", report.force.z,
           1e3 * radius, report.ncontact);
    assert_near_rel(report.force.z, 0.0264349, 0.05);
    assert_near_rel(radius, 3.1623e-3, 0.1);  // counted in whole triangles
    om_press_destroy(press);
    om_probe_destroy(probe);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_hertz)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
