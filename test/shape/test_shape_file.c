// Files of meshes and surfaces: what is written is read back, number for number.
#include "shape_file_common.h"

static void assert_same_sets(const OmTetMesh* a, const OmTetMesh* b) {
    assert_int_equal(a->nset, b->nset);
    for (int s = 0; s < a->nset; s++) {
        const OmMeshSet* other = om_tet_mesh_find_set(b, a->set[s].name);
        assert_non_null(other);
        assert_int_equal(other->nvert, a->set[s].nvert);
        assert_memory_equal(other->vert, a->set[s].vert, (size_t)other->nvert * sizeof(int));
    }
}

static void assert_same_mesh(const OmTetMesh* a, const OmTetMesh* b) {
    assert_int_equal(a->nvert, b->nvert);
    assert_int_equal(a->ntet, b->ntet);
    assert_memory_equal(a->x, b->x, 3 * (size_t)a->nvert * sizeof(double));
    assert_memory_equal(a->tet_vert, b->tet_vert, 4 * (size_t)a->ntet * sizeof(int));
    assert_memory_equal(a->tet_label, b->tet_label, (size_t)a->ntet * sizeof(int));
    assert_same_sets(a, b);
}

static void test_meshes_round_trip(void** unused) {
    (void)unused;
    OmTetMesh mesh, back;
    make_mesh(&mesh);
    for (size_t i = 0; i < NMESH_FORMAT; i++) {
        const char* path = temp_path(mesh_format[i].name);
        assert_ok(om_tet_mesh_save_format(&mesh, path, OM_UNIT_M, mesh_format[i].format, NULL, 0));
        assert_ok(om_tet_mesh_load(path, OM_UNIT_M, &back));
        assert_same_mesh(&mesh, &back);
        om_tet_mesh_done(&back);
        remove(path);
    }
    om_tet_mesh_done(&mesh);
}

static void test_units_scale_positions(void** unused) {
    (void)unused;
    OmTetMesh mesh, mm, m;
    make_mesh(&mesh);
    const char* path = temp_path("unit.vtu");
    assert_ok(om_tet_mesh_save(&mesh, path, OM_UNIT_MM));
    assert_ok(om_tet_mesh_load(path, OM_UNIT_MM, &mm));
    assert_ok(om_tet_mesh_load(path, OM_UNIT_M, &m));
    for (int i = 0; i < 3 * mesh.nvert; i++) {
        assert_near_rel(mm.x[i], mesh.x[i], 4e-16);  // two roundings
        assert_near_rel(m.x[i], 1000 * mesh.x[i], 4e-16);
    }
    remove(path);
    om_tet_mesh_done(&mesh);
    om_tet_mesh_done(&mm);
    om_tet_mesh_done(&m);
}

// Surfaces keep their triangles and positions; an STL has floats and an order of its own.
static void test_surfaces_round_trip(void** unused) {
    (void)unused;
    static const char* const name[] = {"s.obj", "s.ply", "s.off", "s.vtk", "s.stl"};
    OmTetMesh mesh;
    OmSurface surface, back;
    make_mesh(&mesh);
    assert_ok(om_tet_mesh_boundary(&mesh, &surface, NULL));
    double volume = om_surface_volume(&surface);
    for (size_t i = 0; i < sizeof name / sizeof name[0]; i++) {
        const char* path = temp_path(name[i]);
        assert_ok(om_surface_save(&surface, path, OM_UNIT_M));
        assert_ok(om_surface_load(path, OM_UNIT_M, &back));
        assert_int_equal(back.nvert, surface.nvert);
        assert_int_equal(back.ntri, surface.ntri);
        assert_ok(om_surface_require_closed(&back));
        if (i < 4) {
            assert_memory_equal(back.x, surface.x, 3 * (size_t)back.nvert * sizeof(double));
            assert_memory_equal(back.tri_vert, surface.tri_vert,
                                3 * (size_t)back.ntri * sizeof(int));
        }
        assert_near_rel(om_surface_volume(&back), volume, 1e-6);  // floats
        om_surface_done(&back);
        remove(path);
    }
    om_surface_done(&surface);
    om_tet_mesh_done(&mesh);
}

// Further arrays stand beside labels and sets, in both kinds, and do not become sets themselves.
static void test_arrays_are_written(void** unused) {
    (void)unused;
    static const struct {
        const char *name, *expected;
        OmMeshFormat format;
    } table[] = {{"c.vtu", "Name=\"force\" NumberOfComponents=\"3\"", OM_MESH_VTU},
                 {"d.vtu", "<DataArray type=\"Float32\" Name=\"stress\"", OM_MESH_VTU_ASCII},
                 {"c.vtk", "force 3 120 double", OM_MESH_VTK},
                 {"d.vtk", "stress 1 360 float", OM_MESH_VTK_ASCII}};
    OmTetMesh mesh, back;
    make_mesh(&mesh);
    assert_int_equal(mesh.nvert, 120);
    double* force = om_calloc(3 * (size_t)mesh.nvert, sizeof *force);
    float* stress = om_calloc((size_t)mesh.ntet, sizeof *stress);
    const OmMeshArray array[] = {{"force", OM_ARRAY_DOUBLE, 3, false, force},
                                 {"stress", OM_ARRAY_FLOAT, 1, true, stress}};
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        const char* path = temp_path(table[i].name);
        char* text;
        size_t size;
        assert_ok(om_tet_mesh_save_format(&mesh, path, OM_UNIT_M, table[i].format, array, 2));
        assert_ok(om_tet_mesh_load(path, OM_UNIT_M, &back));
        assert_same_mesh(&mesh, &back);
        om_tet_mesh_done(&back);
        assert_ok(om_file_read(path, 1 << 20, &text, &size));
        if (table[i].format == OM_MESH_VTK)  // zeros would end the string
            for (size_t k = 0; k < size; k++) text[k] = text[k] ? text[k] : '0';
        if (!strstr(text, table[i].expected))
            fail_msg("%s: \"%s\" is not in the file", table[i].name, table[i].expected);
        om_free(text);
        remove(path);
    }
    const char* path = temp_path("c.msh");
    assert_status(om_tet_mesh_save_format(&mesh, path, OM_UNIT_M, OM_MESH_MSH41, array, 2),
                  OM_INVALID);
    assert_false(om_path_exists(path));
    om_free(force);
    om_free(stress);
    om_tet_mesh_done(&mesh);
}

static void test_bad_saves_leave_nothing(void** unused) {
    (void)unused;
    OmTetMesh mesh;
    make_mesh(&mesh);
    const OmMeshArray bad[] = {{"two words", OM_ARRAY_FLOAT, 1, true, mesh.x},
                               {"wide", OM_ARRAY_FLOAT, 10, true, mesh.x},
                               {"none", OM_ARRAY_FLOAT, 1, true, NULL}};
    const char* path = temp_path("bad.vtu");
    for (int i = 0; i < 3; i++) {
        assert_status(om_tet_mesh_save_format(&mesh, path, OM_UNIT_M, OM_MESH_VTU, &bad[i], 1),
                      OM_INVALID);
        assert_non_null(strstr(om_error_message(), bad[i].name));
    }
    assert_status(om_tet_mesh_save(&mesh, path, 0), OM_INVALID);
    assert_status(om_tet_mesh_save(&mesh, path, NAN), OM_INVALID);
    assert_status(om_tet_mesh_save(&mesh, temp_path("bad.stl"), OM_UNIT_M), OM_INVALID);
    mesh.x[5] = NAN;
    assert_status(om_tet_mesh_save(&mesh, path, OM_UNIT_M), OM_INVALID);
    assert_false(om_path_exists(path));
    mesh.x[5] = 0;
    assert_status(om_tet_mesh_save(&mesh, "/nowhere/at/all.vtu", OM_UNIT_M), OM_IO);
    assert_non_null(strstr(om_error_message(), "/nowhere/at/all.vtu"));
    om_tet_mesh_done(&mesh);
}

// A tetrahedron in millimetres, read by hand: 80 bytes, a count, records of 12 floats and 2 bytes. Normals are of unit
// length, outwards. The format has no mark: "solid" at its begin makes it no text.
static void test_stl_byte_by_byte(void** unused) {
    (void)unused;
    const double x[12] = {0.001, 0, 0, 0.004, 0, 0, 0.001, 0.005, 0, 0.001, 0, 0.007};
    const int tri[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    OmSurface s, back;
    assert_ok(om_surface_init(&s, 4, 4));
    memcpy(s.x, x, sizeof x);
    memcpy(s.tri_vert, tri, sizeof tri);
    const char* path = temp_path("hand.stl");
    assert_ok(om_surface_save(&s, path, OM_UNIT_MM));
    char* bytes;
    size_t size;
    assert_ok(om_file_read(path, 10000, &bytes, &size));
    assert_int_equal(size, 84 + 4 * 50);
    assert_int_equal((unsigned char)bytes[80], 4);
    const double outward[4][3] = {{0, 0, -1}, {0, -1, 0}, {-1, 0, 0}, {35, 21, 15}};
    for (int t = 0; t < 4; t++) {
        float record[12];
        memcpy(record, bytes + 84 + 50 * t, sizeof record);
        OmVec3 n = om_normalize(om_load3(outward[t], 0));
        assert_near(
            om_distance(om_vec3((double)record[0], (double)record[1], (double)record[2]), n), 0,
            1e-6);
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                assert_near((double)record[3 + 3 * c + k], 1e3 * x[3 * tri[3 * t + c] + k], 1e-6);
    }
    memcpy(bytes, "solid by another program", 24);
    write_bytes(path, bytes, size);
    assert_ok(om_surface_load(path, OM_UNIT_MM, &back));
    assert_int_equal(back.ntri, 4);
    assert_int_equal(back.nvert, 4);
    assert_near_rel(om_surface_volume(&back), 0.003 * 0.005 * 0.007 / 6, 1e-6);
    remove(path);
    om_free(bytes);
    om_surface_done(&s);
    om_surface_done(&back);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_meshes_round_trip),   cmocka_unit_test(test_units_scale_positions),
        cmocka_unit_test(test_surfaces_round_trip), cmocka_unit_test(test_stl_byte_by_byte),
        cmocka_unit_test(test_arrays_are_written),  cmocka_unit_test(test_bad_saves_leave_nothing),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
