// Meshes that others made: known counts and volumes; skipped where the data are not.
#include "shape_file_common.h"

// Counts and volumes of the data's README; 0 where it states none.
static void test_volume_meshes(void** unused) {
    (void)unused;
    static const struct {
        const char* name;
        double unit;
        int nvert, ntet;
        double volume;  // m^3
    } mesh[] = {
        {"retraction_sheet/tissue_volume.msh", OM_UNIT_M, 493, 1432, 1.15202e-4},
        {"gallbladder_liver/gallbladder_volumetric.vtk", OM_UNIT_MM, 366, 1063, 34.1e-6},
        {"gallbladder_liver/liver_volumetric.vtk", OM_UNIT_MM, 98, 273, 0},
        {"ecoflex_sheet/tissue_volumetric.msh", OM_UNIT_MM, 145, 348, 44.3e-6},
        {"livers/liver.msh", OM_UNIT_CM, 181, 596, 0},
        {"livers/liver2.msh", OM_UNIT_CM, 507, 1493, 0},
        // a cylinder of radius 4.25 and length 182 mm, less what chords cut off
        {"silicone_beam/cylinderPDMS12724Vol.vtk", OM_UNIT_M, 3668, 12724, 1.0159e-5},
    };
    for (size_t i = 0; i < sizeof mesh / sizeof mesh[0]; i++) {
        OmTetMesh m;
        unsigned flags = OM_MESH_FLIP;  // some of them count vertices the other way
        assert_ok(om_tet_mesh_load_flags(test_data(mesh[i].name), mesh[i].unit, flags, &m));
        assert_int_equal(m.nvert, mesh[i].nvert);
        assert_int_equal(m.ntet, mesh[i].ntet);
        if (mesh[i].volume > 0)
            assert_near_rel(om_tet_mesh_volume(&m), mesh[i].volume, 1e-3);  // digits of the README
        om_tet_mesh_done(&m);
    }
}

// The vertex of the gallbladder that no element uses is kept on request.
static void test_unused_vertices(void** unused) {
    (void)unused;
    OmTetMesh m;
    const char* path = test_data("gallbladder_liver/gallbladder_volumetric.vtk");
    unsigned flags = OM_MESH_FLIP | OM_MESH_KEEP_UNUSED;
    assert_ok(om_tet_mesh_load_flags(path, OM_UNIT_MM, flags, &m));
    assert_int_equal(m.nvert, 367);
    om_tet_mesh_done(&m);
}

static void test_surfaces(void** unused) {
    (void)unused;
    static const struct {
        const char* name;
        double unit;
        int nvert, ntri;
        bool is_closed;
    } surface[] = {
        {"livers/liver-smooth.obj", OM_UNIT_CM, 2194, 4384, true},
        {"livers/liver.obj", OM_UNIT_CM, 139, 274, true},
        {"retraction_sheet/tissue_surface.obj", OM_UNIT_M, 448, 892, true},
        {"functional_maps/cat-00.off", OM_UNIT_M, 7207, 14410, true},
        {"functional_maps/lion-00.off", OM_UNIT_M, 5000, 9996, true},
        {"ecoflex_sheet/tissue_collision.stl", OM_UNIT_M, 361, 718, true},
        {"gallbladder_liver/gallbladder_collision.stl", OM_UNIT_MM, 252, 500, true},
        {"gallbladder_liver/liver_collision.stl", OM_UNIT_MM, 279, 479, false},
        {"livers/liver.vtk", OM_UNIT_MM, 5008, 10000, true},  // inside out, in four pieces
    };
    for (size_t i = 0; i < sizeof surface / sizeof surface[0]; i++) {
        OmSurface s;
        assert_ok(om_surface_load(test_data(surface[i].name), surface[i].unit, &s));
        assert_int_equal(s.nvert, surface[i].nvert);
        assert_int_equal(s.ntri, surface[i].ntri);
        assert_status(om_surface_require_closed(&s), surface[i].is_closed ? OM_OK : OM_INVALID);
        om_surface_done(&s);
    }
}

// The laboratory's sheet: the surface of its volume mesh is the surface beside it, point for point.
static void test_the_boundary_of_a_volume_file(void** unused) {
    (void)unused;
    OmSurface a, b;
    assert_ok(om_surface_load(test_data("retraction_sheet/tissue_volume.msh"), OM_UNIT_M, &a));
    assert_ok(om_surface_load(test_data("retraction_sheet/tissue_surface.obj"), OM_UNIT_M, &b));
    assert_int_equal(a.nvert, b.nvert);
    assert_int_equal(a.ntri, b.ntri);
    assert_near_rel(om_surface_volume(&a), om_surface_volume(&b),
                    1e-4);  // digits of the OBJ: 1 um in 8 mm
    om_surface_done(&a);
    om_surface_done(&b);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_volume_meshes),
        cmocka_unit_test(test_unused_vertices),
        cmocka_unit_test(test_surfaces),
        cmocka_unit_test(test_the_boundary_of_a_volume_file),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
