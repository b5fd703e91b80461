// Unit and space of mesh files: what 3D Slicer and we state is read, written, and gives way to the caller.
#include "shape_file_common.h"

// A tetrahedron (10,20,30) (11,20,30) (10,22,30) (10,20,33), as an LPS file has it.
static const double corner[4][3] = {{10, 20, 30}, {11, 20, 30}, {10, 22, 30}, {10, 20, 33}};
static const int face[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

static size_t put_stl(char* out, const char* head, bool is_binary) {
    if (!is_binary) {
        int n = sprintf(out, "solid %s\n", head);
        for (int f = 0; f < 4; f++) {
            n += sprintf(out + n, "facet normal 0 0 0\nouter loop\n");
            for (int c = 0; c < 3; c++) {
                const double* x = corner[face[f][c]];
                n += sprintf(out + n, "vertex %g %g %g\n", x[0], x[1], x[2]);
            }
            n += sprintf(out + n, "endloop\nendfacet\n");
        }
        return (size_t)(n + sprintf(out + n, "endsolid\n"));
    }
    memset(out, 0, 84);
    memcpy(out, head, strlen(head));
    out[80] = 4;
    size_t n = 84;
    for (int f = 0; f < 4; f++, n += 50) {
        memset(out + n, 0, 50);
        for (int c = 0; c < 3; c++) {
            for (int k = 0; k < 3; k++) {
                float v = (float)corner[face[f][c]][k];
                memcpy(out + n + 12 + 12 * c + 4 * k, &v, 4);
            }
        }
    }
    return n;
}

static size_t put_text(char* out, const char* format, const char* head) {
    int n = sprintf(out, format, head);
    return (size_t)n;
}

#define PLY                                                                                      \
    "ply\nformat ascii 1.0\ncomment VTK generated PLY File\ncomment %s\nelement vertex 4\n"      \
    "property float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar " \
    "int vertex_indices\nend_header\n10 20 30\n11 20 30\n10 22 30\n10 20 33\n3 0 2 1\n3 0 1 3\n" \
    "3 0 3 2\n3 1 2 3\n"
#define OBJ \
    "# %s\n\nv 10 20 30\nv 11 20 30\nv 10 22 30\nv 10 20 33\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
#define OFF \
    "OFF\n# %s\n4 4 0\n10 20 30\n11 20 30\n10 22 30\n10 20 33\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
#define VTK                                                                                       \
    "# vtk DataFile Version 4.2\n%s\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n10 20 30 " \
    "11 20 30 10 22 30 10 20 33\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"

// The surface of a file, and that its first corner lies where it should.
static void assert_corner(const char* path, OmMeshFrame given, OmMeshFrame wanted, OmVec3 place) {
    OmSurface s;
    OmMeshFrame stated;
    assert_ok(om_surface_load_frame(path, given, 0, &s, &stated));
    assert_int_equal(stated.space, wanted.space);
    assert_near(stated.unit, wanted.unit, 0);
    double nearest = HUGE_VAL;
    for (int v = 0; v < s.nvert; v++) nearest = fmin(nearest, om_distance(om_load3(s.x, v), place));
    assert_near(nearest, 0, 1e-9);
    assert_true(om_surface_volume(&s) > 0);
    om_surface_done(&s);
}

static void test_headers_of_slicer(void** unused) {
    (void)unused;
    static const char* const name[] = {"t.stl", "b.stl", "t.ply", "t.obj", "t.off", "t.vtk"};
    static const struct {
        const char* head;
        OmMeshFrame stated;
        OmVec3 place;  // of the corner (10, 20, 30), mm
    } table[] = {
        {"3D Slicer output. SPACE=LPS", {0, OM_SPACE_LPS}, {-10, -20, 30}},
        {"SPACE=LPS", {0, OM_SPACE_LPS}, {-10, -20, 30}},
        {"3D Slicer output. SPACE=RAS", {0, OM_SPACE_RAS}, {10, 20, 30}},
        {"made by hand", {0, OM_SPACE_NONE}, {10, 20, 30}},
        {"SPACE=LPI, MYSPACE=LPS", {0, OM_SPACE_NONE}, {10, 20, 30}},
        {"omentum SPACE=LPS UNIT=cm", {0.01, OM_SPACE_LPS}, {-100, -200, 300}},
        {"UNIT=0.5 of something", {0.5, OM_SPACE_NONE}, {5000, 10000, 15000}},
        {"UNIT=mmm UNIT=-1", {0, OM_SPACE_NONE}, {10, 20, 30}},
    };
    for (size_t t = 0; t < sizeof table / sizeof table[0]; t++) {
        for (int f = 0; f < 6; f++) {
            char file[4096];
            const char* path = temp_path(name[f]);
            size_t size = f < 2 ? put_stl(file, table[t].head, f == 1)
                                : put_text(file,
                                           f == 2   ? PLY
                                           : f == 3 ? OBJ
                                           : f == 4 ? OFF
                                                    : VTK,
                                           table[t].head);
            write_bytes(path, file, size);
            const OmMeshFrame stated = table[t].stated;
            const OmVec3 mm = table[t].place;
            assert_corner(path, (OmMeshFrame){0}, stated, om_scale(1e-3, mm));
            // the caller knows better
            assert_corner(path, (OmMeshFrame){1, OM_SPACE_RAS}, stated, om_vec3(10, 20, 30));
            assert_corner(path, (OmMeshFrame){0.01, OM_SPACE_LPS}, stated,
                          om_vec3(-0.1, -0.2, 0.3));
            if (f == 5) {  // tetrahedra too
                OmTetMesh mesh;
                OmMeshFrame read;
                assert_ok(om_tet_mesh_load_frame(path, (OmMeshFrame){0}, 0, &mesh, &read));
                assert_near(om_distance(om_load3(mesh.x, 0), om_scale(1e-3, mm)), 0, 1e-9);
                assert_int_equal(read.space, stated.space);
                om_tet_mesh_done(&mesh);
            }
            remove(path);
        }
    }
}

// Fields of a VTU: text, and appended raw as VTK writes strings.
static void test_fields_of_vtu(void** unused) {
    (void)unused;
    static const char body[] =
        "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" "
        "NumberOfComponents=\"3\" format=\"ascii\">10 20 30 11 20 30 10 22 30 10 20 33</DataArray>"
        "</Points><Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3"
        "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>"
        "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece>"
        "</UnstructuredGrid>";
    static const struct {
        const char *fields, *appended;
        OmSpace space;
        double unit;
    } table[] = {
        {"<DataArray type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">76 80 83 0"
         "</DataArray>",
         "", OM_SPACE_LPS, 0},
        {"<DataArray type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"appended\" "
         "offset=\"0\"/>",
         "<AppendedData encoding=\"base64\">_BAAAAA==TFBTAA==</AppendedData>", OM_SPACE_LPS, 0},
        {"<DataArray type=\"Int32\" Name=\"is_lps\" format=\"ascii\">1</DataArray>", "",
         OM_SPACE_LPS, 0},
        {"<DataArray type=\"Int32\" Name=\"is_lps\" format=\"ascii\">0</DataArray>", "",
         OM_SPACE_RAS, 0},
        {"<DataArray type=\"Int32\" Name=\"is_lps\" format=\"ascii\">7</DataArray>", "",
         OM_SPACE_NONE, 0},
        {"<DataArray type=\"Int32\" Name=\"is_lps\" format=\"ascii\"></DataArray>", "",
         OM_SPACE_NONE, 0},
        {"<DataArray type=\"Float64\" Name=\"metres_per_unit\" format=\"ascii\">0.01</DataArray>",
         "", OM_SPACE_NONE, 0.01},
        {"<DataArray type=\"String\" Name=\"SPACE\" format=\"ascii\">99</DataArray><DataArray "
         "type=\"Float64\" Name=\"metres_per_unit\" format=\"ascii\">-2</DataArray>",
         "", OM_SPACE_NONE, 0},
    };
    for (size_t t = 0; t < sizeof table / sizeof table[0]; t++) {
        char file[4096];
        OmTetMesh mesh;
        OmMeshFrame stated;
        const char* path = temp_path("f.vtu");
        int n = snprintf(file, sizeof file,
                         "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\">"
                         "<UnstructuredGrid><FieldData>%s</FieldData>%s%s</VTKFile>",
                         table[t].fields, body, table[t].appended);
        write_bytes(path, file, (size_t)n);
        assert_ok(om_tet_mesh_load_frame(path, (OmMeshFrame){0}, 0, &mesh, &stated));
        assert_int_equal(stated.space, table[t].space);
        assert_near(stated.unit, table[t].unit, 0);
        double unit = table[t].unit > 0 ? table[t].unit : 1e-3;
        double sign = table[t].space == OM_SPACE_LPS ? -1 : 1;
        OmVec3 wanted = om_scale(unit, om_vec3(sign * 10, sign * 20, 30));
        assert_near(om_distance(om_load3(mesh.x, 0), wanted), 0, 1e-12);
        om_tet_mesh_done(&mesh);
        remove(path);
    }
}

// What is written in LPS and any unit is read again by what the file says.
static void test_frames_round_trip(void** unused) {
    (void)unused;
    static const char* const surface_name[] = {"r.stl", "r.ply", "r.obj", "r.vtk"};
    static const char* const mesh_name[] = {"m.vtu", "m.vtk"};
    static const OmMeshFrame frame[] = {
        {1, OM_SPACE_LPS}, {1e-3, OM_SPACE_RAS}, {0.01, OM_SPACE_LPS}, {0.0254, OM_SPACE_LPS}};
    OmTetMesh mesh, mesh_back;
    OmSurface surface, back;
    OmMeshFrame stated;
    make_mesh(&mesh);
    assert_ok(om_tet_mesh_boundary(&mesh, &surface, NULL));
    for (size_t f = 0; f < 4; f++) {
        for (int i = 0; i < 4; i++) {
            const char* path = temp_path(surface_name[i]);
            assert_ok(om_surface_save_frame(&surface, path, frame[f]));
            assert_ok(om_surface_load_frame(path, (OmMeshFrame){0}, 0, &back, &stated));
            assert_int_equal(stated.space, frame[f].space);
            assert_near_rel(stated.unit, frame[f].unit, 0);
            assert_int_equal(back.nvert, surface.nvert);
            double worst = 0;
            for (int v = 0; i > 0 && v < 3 * back.nvert; v++)
                worst = fmax(worst, fabs(back.x[v] - surface.x[v]));
            assert_near(worst, 0, 1e-14);  // an STL has an order of its own
            assert_near_rel(om_surface_volume(&back), om_surface_volume(&surface), 1e-6);
            om_surface_done(&back);
            // in the numbers of the file, x runs to the left
            assert_ok(om_surface_load_frame(path, (OmMeshFrame){1, OM_SPACE_RAS}, 0, &back, NULL));
            double sign = frame[f].space == OM_SPACE_LPS ? -1 : 1;
            if (i > 0) assert_near_rel(back.x[0] * frame[f].unit, sign * surface.x[0], 1e-14);
            om_surface_done(&back);
            remove(path);
        }
        for (int i = 0; i < 2; i++) {
            const char* path = temp_path(mesh_name[i]);
            assert_ok(om_tet_mesh_save_frame(&mesh, path, frame[f]));
            assert_ok(om_tet_mesh_load_frame(path, (OmMeshFrame){0}, 0, &mesh_back, &stated));
            assert_int_equal(stated.space, frame[f].space);
            assert_near_rel(stated.unit, frame[f].unit, 0);
            for (int v = 0; v < 3 * mesh.nvert; v++) assert_near(mesh_back.x[v], mesh.x[v], 1e-14);
            om_tet_mesh_done(&mesh_back);
            remove(path);
        }
    }
    om_surface_done(&surface);
    om_tet_mesh_done(&mesh);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_headers_of_slicer),
        cmocka_unit_test(test_fields_of_vtu),
        cmocka_unit_test(test_frames_round_trip),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
