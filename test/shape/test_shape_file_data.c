// Meshes that others made: known counts and volumes, skipped where the data are not; and a box written by hand.
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

// ---- a box of 10 x 20 x 30 mm as other programs write it ----------------------------------------------------

#define BOX_VOLUME 6e-6  // m^3
// corner k is at x = bit 0, y = bit 1, z = bit 2 of k; four corners of each face, counterclockwise from outside
static const int box_face[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                   {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
// paths from corner 0 to corner 7 along the edges; every second tetrahedron counts its corners the other way
static const int box_path[6][2] = {{1, 2}, {1, 4}, {2, 1}, {2, 4}, {4, 1}, {4, 2}};

static void put_corners(OmText* t, const char* before, bool is_numbered) {
    for (int k = 0; k < 8; k++) {
        const int x = k & 1 ? 10 : 0, y = k & 2 ? 20 : 0, z = k & 4 ? 30 : 0;
        if (is_numbered) assert_ok(om_text_append(t, "%d ", 10 * k + 7));
        assert_ok(om_text_append(t, "%s%d %d.0 %d\n", before, x, y, z));
    }
}

static const char* save(OmText* t, const char* name) {
    const char* path = temp_path(name);
    write_bytes(path, t->str, t->len);
    om_text_done(t);
    return path;
}

// Gmsh 2.2 with numbers that have gaps, and a point beside the volume.
static const char* save_msh(void) {
    OmText t = {0};
    assert_ok(om_text_append(&t, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n"));
    put_corners(&t, "", true);
    assert_ok(om_text_append(&t, "$EndNodes\n$Elements\n7\n1 15 2 0 1 7\n"));
    for (int p = 0; p < 6; p++) {
        const int a = box_path[p][0], b = a + box_path[p][1];
        assert_ok(om_text_append(&t, "%d 4 2 0 1 7 %d %d 77\n", p + 5, 10 * a + 7, 10 * b + 7));
    }
    assert_ok(om_text_append(&t, "$EndElements\n"));
    return save(&t, "made.msh");
}

// Legacy VTK; no element uses the ninth point.
static const char* save_vtk(void) {
    OmText t = {0};
    assert_ok(om_text_append(&t, "# vtk DataFile Version 3.0\na box\nASCII\nDATASET "
                                 "UNSTRUCTURED_GRID\nPOINTS 9 float\n"));
    put_corners(&t, "", false);
    assert_ok(om_text_append(&t, "5 5 5\nCELLS 6 30\n"));
    for (int p = 0; p < 6; p++)
        assert_ok(
            om_text_append(&t, "4 0 %d %d 7\n", box_path[p][0], box_path[p][0] + box_path[p][1]));
    assert_ok(om_text_append(&t, "CELL_TYPES 6\n10\n10\n10\n10\n10\n10\n"));
    return save(&t, "made.vtk");
}

// OBJ with quads, normals and texture; the last face is left out of an open box.
static const char* save_obj(int nface) {
    OmText t = {0};
    assert_ok(om_text_append(&t, "# a box\no box\n"));
    put_corners(&t, "v ", false);
    assert_ok(om_text_append(&t, "vt 0 0\nvn 0 0 1\ns off\n"));
    for (int f = 0; f < nface; f++) {
        const int* v = box_face[f];
        assert_ok(om_text_append(&t, "f %d/1/1 %d/1/1 %d/1/1 %d/1/1\n", v[0] + 1, v[1] + 1,
                                 v[2] + 1, v[3] + 1));
    }
    return save(&t, "made.obj");
}

static const char* save_off(void) {
    OmText t = {0};
    assert_ok(om_text_append(&t, "OFF\n8 12 0\n"));
    put_corners(&t, "", false);
    for (int f = 0; f < 6; f++) {
        const int* v = box_face[f];
        assert_ok(
            om_text_append(&t, "3 %d %d %d\n3 %d %d %d\n", v[0], v[1], v[2], v[0], v[2], v[3]));
    }
    return save(&t, "made.off");
}

static void check_made_mesh(const char* path, unsigned flags, int nvert) {
    OmTetMesh m;
    assert_ok(om_tet_mesh_load_flags(path, OM_UNIT_MM, OM_MESH_FLIP | flags, &m));
    assert_int_equal(m.nvert, nvert);
    assert_int_equal(m.ntet, 6);
    assert_near_rel(om_tet_mesh_volume(&m), BOX_VOLUME, 1e-12);  // rounding
    for (int e = 0; e < 6; e++) {
        const int* v = m.tet_vert + 4 * e;
        const OmVec3 a = om_load3(m.x, v[0]), b = om_sub(om_load3(m.x, v[1]), a),
                     c = om_sub(om_load3(m.x, v[2]), a), d = om_sub(om_load3(m.x, v[3]), a);
        assert_near_rel(om_dot(b, om_cross(c, d)), BOX_VOLUME,
                        1e-12);  // each a sixth, none inverted
    }
    om_tet_mesh_done(&m);
}

static void test_made_volume_meshes(void** unused) {
    (void)unused;
    OmTetMesh m;
    const char *msh = save_msh(), *vtk = save_vtk();
    check_made_mesh(msh, 0, 8);
    check_made_mesh(vtk, 0, 8);
    check_made_mesh(vtk, OM_MESH_KEEP_UNUSED, 9);
    assert_status(om_tet_mesh_load_flags(msh, OM_UNIT_MM, 0, &m), OM_INVALID);
    remove(msh);
    remove(vtk);
}

static void check_made_surface(const char* path, int ntri, bool is_closed) {
    OmSurface s;
    assert_ok(om_surface_load(path, OM_UNIT_MM, &s));
    assert_int_equal(s.nvert, 8);
    assert_int_equal(s.ntri, ntri);
    assert_status(om_surface_require_closed(&s), is_closed ? OM_OK : OM_INVALID);
    if (is_closed) assert_near_rel(om_surface_volume(&s), BOX_VOLUME, 1e-12);  // rounding
    om_surface_done(&s);
    remove(path);
}

// The boundary of the volume file is the surface that others wrote.
static void test_made_surfaces(void** unused) {
    (void)unused;
    check_made_surface(save_obj(6), 12, true);
    check_made_surface(save_obj(5), 10, false);
    check_made_surface(save_off(), 12, true);
    check_made_surface(save_msh(), 12, true);
    check_made_surface(save_vtk(), 12, true);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_volume_meshes),
        cmocka_unit_test(test_unused_vertices),
        cmocka_unit_test(test_surfaces),
        cmocka_unit_test(test_the_boundary_of_a_volume_file),
        cmocka_unit_test(test_made_volume_meshes),
        cmocka_unit_test(test_made_surfaces),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
