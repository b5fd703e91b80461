// test_world_mesh_factor.c: how much too stiffly a mesh bends, against quadratic elements and another fine mesh.
#include "test_common.h"

#include "omentum/body.h"
#include "omentum/fem.h"

static void sheet(int nx, int nz, OmScene* scene, OmSite* site) {
    *scene = om_scene_default();
    scene->tissue.cells = om_vec3(nx, nx, nz);
    scene->attach.kind = OM_ATTACH_BOX;
    scene->attach.lo = om_vec3(0.01, -1, -1);
    scene->attach.hi = om_vec3(1, 1, 1);
    assert_ok(om_site_build(scene, OM_SITE_TWIN, NULL, site));
}

// Work of a small weight on a sheet of 120 x 120 x 5 mm, held where x >= 0, by a mesh of its own.
static double work_of(int nx, int nz, OmElement element) {
    OmTetMesh tet;
    OmFemMesh mesh;
    OmFemSolid* solid;
    const OmMaterial material = {.law = OM_LINEAR, .young = 1000, .poisson = 0.45};
    assert_ok(
        om_tet_mesh_box(om_vec3(-0.06, -0.06, 0), om_vec3(0.06, 0.06, 0.005), nx, nx, nz, &tet));
    assert_ok(om_fem_mesh_from_tet(&tet, element, &mesh));
    OmFemDef def = om_fem_default_def(&mesh, 1, &material);
    assert_ok(om_fem_create(&def, &solid));
    const size_t n = 3 * (size_t)mesh.nnode;
    double* x = test_malloc(n * sizeof *x);
    unsigned char* fixed = test_calloc(n, 1);
    for (size_t i = 0; i < n; ++i) x[i] = mesh.x[i];
    for (size_t v = 0; v < n / 3; ++v)
        for (int k = 0; k < 3; ++k) fixed[3 * v + (size_t)k] = mesh.x[3 * v] > -1e-9;
    const OmFemLoad load = {.body = om_vec3(0, 0, -1e-3), .fixed = fixed};
    OmFemStaticDef how = om_fem_static_default_def(solid);
    assert_ok(om_fem_static_solve(solid, &load, &how, x, NULL, NULL));
    // The strain energy of a linear body is half the work of its load.
    double energy;
    assert_ok(om_fem_eval_energy(solid, x, &energy));
    test_free(x), test_free(fixed);
    om_fem_destroy(solid);
    om_fem_mesh_done(&mesh);
    om_tet_mesh_done(&tet);
    return 2 * energy;
}

static void test_a_sheet_against_other_meshes(void** state) {
    (void)state;
    OmScene scene;
    OmSite site;
    double factor;
    sheet(12, 1, &scene, &site);
    assert_ok(om_body_find_mesh_factor(&site, &factor));
    const double linear = work_of(12, 1, OM_TET4), quadratic = work_of(12, 1, OM_TET10);
    // as fine as the refinement, with other diagonals
    const double finer = work_of(24, 2, OM_TET4);
    assert_true(linear < finer && finer < quadratic);
    assert_true(factor > linear / quadratic);
    assert_near(factor, linear / finer, 0.2 * factor);
    // Young's modulus and density do not matter.
    double other;
    site.young *= 7;
    site.density *= 2;
    assert_ok(om_body_find_mesh_factor(&site, &other));
    assert_near(other, factor, 1e-6);
    om_site_done(&site);
}

// A block of 60 x 60 x 20 mm: the error of linear elements falls with the square of their edge.
static void test_finer_meshes_come_near_one(void** state) {
    (void)state;
    double error[3];
    for (int k = 0; k < 3; ++k) {
        OmScene scene = om_scene_default();
        OmSite site;
        scene.tissue.size = om_vec3(0.06, 0.06, 0.02);
        scene.tissue.cells = om_vec3(4 << k, 4 << k, 2 << k);
        scene.attach.kind = OM_ATTACH_BOX;
        scene.attach.lo = om_vec3(0.01, -1, -1);
        scene.attach.hi = om_vec3(1, 1, 1);
        scene.roi.is_random = false;
        scene.roi.center = om_vec3(-0.015, 0, 0);
        assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
        site.poisson = 0.2;
        assert_ok(om_body_find_mesh_factor(&site, &error[k]));
        error[k] = 1 - error[k];
        om_site_done(&site);
    }
    assert_true(error[0] > 0.2 && error[1] < 0.6 * error[0] && error[2] < 0.5 * error[1]);
    assert_true(error[2] > 0);
}

// The twin has the modulus times the factor, the world that of the tissue; without gravity there is no factor.
static void test_whose_modulus(void** state) {
    (void)state;
    OmScene scene;
    OmSite twin, world;
    double factor;
    sheet(6, 1, &scene, &twin);
    om_site_done(&twin);
    scene.tissue.mesh_factor = 0.25;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &world));
    assert_near(twin.young, 0.25 * 3000, 1e-9);
    assert_near(world.young, 0.85 * 3000, 1e-9);
    twin.gravity = om_vec3(0, 0, 0);
    assert_status(om_body_find_mesh_factor(&twin, &factor), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "gravity"));
    om_site_done(&twin);
    om_site_done(&world);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_a_sheet_against_other_meshes),
        cmocka_unit_test(test_finer_meshes_come_near_one),
        cmocka_unit_test(test_whose_modulus),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
