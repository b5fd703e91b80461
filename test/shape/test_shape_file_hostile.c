// Files that lie: each is refused with one sentence that says where, and nothing is left behind.
#include "omentum/shape_tet10.h"
#include "shape_file_common.h"
#include "test_alloc.h"

#include <dirent.h>

#define VTK_HEAD "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n"
#define VTK_POINTS "POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
#define MSH_HEAD "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
#define MSH_NODES "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
#define MSH4_HEAD "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
#define VTU_FILE "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\">"
#define VTU_HEAD VTU_FILE "<UnstructuredGrid>"
#define VTU_TAIL "</UnstructuredGrid></VTKFile>"
#define VTU_POINTS                                                                         \
    "<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 " \
    "1 0 0 0 1 0 0 0 1</DataArray></Points>"
#define VTU_CELL(conn, off, type)                                                   \
    "<Cells><DataArray Name=\"connectivity\" type=\"Int32\" format=\"ascii\">" conn \
    "</DataArray><DataArray Name=\"offsets\" type=\"Int32\" format=\"ascii\">" off  \
    "</DataArray><DataArray Name=\"types\" type=\"UInt8\" format=\"ascii\">" type   \
    "</DataArray></Cells>"
#define VTU_PIECE(n, body) \
    VTU_HEAD "<Piece NumberOfPoints=\"" n "\" NumberOfCells=\"1\">" body "</Piece>" VTU_TAIL
#define PLY_HEAD "ply\nformat ascii 1.0\n"
#define PLY_XYZ "property float x\nproperty float y\nproperty float z\n"
#define PLY_FACE "element face 1\nproperty list uchar int vertex_indices\nend_header\n"

typedef struct Case {
    const char *ext, *text, *expected;  // part of the message
} Case;

static const Case tet_case[] = {
    {"msh", "", "empty"},
    {"msh", "solid", "a section is wanted"},
    {"msh", "$Nodes\n1\n", "does not begin with $MeshFormat"},
    {"msh", "$MeshFormat\n3 0 8\n$EndMeshFormat\n", "version 3"},
    {"msh", "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n", "version 4"},
    {"msh", "$MeshFormat\n2.2 1 4\nabcd", "numbers of 4 bytes"},
    {"msh", "$MeshFormat\n2.2 1 8\nabcd", "order of bytes"},
    {"msh", "$MeshFormat\n2.2 0 8\n$Nodes\n", "$EndMeshFormat"},
    {"msh", MSH_HEAD "$Nodes\n1000000000000\n", "line 5"},
    {"msh", MSH_HEAD "$Nodes\n400000000\n", "can hold at most"},
    {"msh", MSH_HEAD "$Nodes\n-1\n", "-1"},
    {"msh", MSH_HEAD "$Nodes\n1\n1 0 nan 0\n$EndNodes\n", "node 1: a coordinate is not finite"},
    {"msh", MSH_HEAD "$Nodes\n1\n1 0 x 0\n$EndNodes\n", "line 6: a coordinate: a number is wanted"},
    {"msh", MSH_HEAD "$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n", "before the nodes"},
    {"msh", MSH_HEAD "$Nodes\n2\n1 0 0 0\n1 0 0 1\n$EndNodes\n$Elements\n0\n",
     "node 1 occurs twice"},
    {"msh", MSH_HEAD MSH_NODES "$Elements\n1\n9 4 0 1 2 3 5\n$EndElements\n",
     "element 9 names node 5"},
    {"msh", MSH_HEAD MSH_NODES "$Elements\n1\n1 77 0 1 2 3 4\n$EndElements\n", "type 77"},
    {"msh", MSH_HEAD MSH_NODES "$Elements\n1\n1 4 0 1 3 2 4\n$EndElements\n",
     "tetrahedron 1 is inverted"},
    {"msh", MSH_HEAD MSH_NODES "$Elements\n1\n1 4 0 1 2 3 3\n$EndElements\n",
     "tetrahedron 1 is flat"},
    {"msh", MSH_HEAD MSH_NODES "$Elements\n1\n1 2 0 1 2 3\n$EndElements\n", "no tetrahedra"},
    {"msh", MSH_HEAD MSH_NODES "$Elements\n1\n1 4 0 1 2 3 4\n$EndNodes\n", "$EndElements"},
    {"msh", MSH_HEAD "$PhysicalNames\n1\n3 1 fat\n$EndPhysicalNames\n", "quotes"},
    {"msh", MSH_HEAD "$PhysicalNames\n1\n3 1 \"\"\n$EndPhysicalNames\n", "line 6"},
    {"msh", MSH_HEAD "$Periodic\n1\n", "$Periodic has no end"},
    {"msh", MSH4_HEAD "$Nodes\n1 1 1 1\n3 1 7 1\n1\n0 0 0\n$EndNodes\n", "flag 7"},
    {"msh", MSH4_HEAD "$Nodes\n1 9 1 9\n3 1 0 999999999\n1\n", "line 6"},
    {"msh", MSH4_HEAD "$Entities\n0 0 0 99999999\n", "number of entities"},
    {"msh", "$NOD\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n1\n1 4 1 1 3 1 2 3\n",
     "has 3 nodes, 4 are wanted"},
    {"vtk", "", "no VTK legacy file"},
    {"vtk", "# vtk DataFile Version x\n", "version"},
    {"vtk", "# vtk DataFile Version 3.0\nx\nTEXT\n", "ASCII or BINARY"},
    {"vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\n",
     "STRUCTURED_POINTS"},
    {"vtk", VTK_HEAD "POINTS 4 complex\n", "complex"},
    {"vtk", VTK_HEAD "POINTS 400000000 float\n0 0 0\n", "line 5"},
    {"vtk", VTK_HEAD VTK_POINTS VTK_POINTS, "POINTS come twice"},
    {"vtk", VTK_HEAD VTK_POINTS "CELLS 1 5\n4 0 1 2 9\nCELL_TYPES 1\n10\n",
     "tetrahedron 1 names vertex 10"},
    {"vtk", VTK_HEAD VTK_POINTS "CELLS 1 5\n4 0 1 2 -1\nCELL_TYPES 1\n10\n", "names vertex -1"},
    {"vtk", VTK_HEAD VTK_POINTS "CELLS 1 5\n7 0 1 2 3\nCELL_TYPES 1\n10\n", "cell 0"},
    {"vtk", VTK_HEAD VTK_POINTS "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n10\n",
     "a tetrahedron of 3 vertices"},
    {"vtk", VTK_HEAD VTK_POINTS "CELLS 9 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n", "9 cells in 5 entries"},
    {"vtk", VTK_HEAD VTK_POINTS "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 2\n10 10\n",
     "2 types of 1 cells"},
    {"vtk", VTK_HEAD VTK_POINTS "CELLS 1 5\n4 0 1 2 3\n", "no CELL_TYPES"},
    {"vtk", VTK_HEAD VTK_POINTS "CELLS 1 5\n4 0 1 2 3\nFOO 1\n", "\"FOO\" is not known"},
    {"vtk",
     VTK_HEAD "POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 inf 1\nCELLS 1 5\n4 0 1 2 3\n"
              "CELL_TYPES 1\n10\n",
     "vertex 4: a coordinate is not a finite number"},
    {"vtk",
     VTK_HEAD VTK_POINTS "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 1\n"
                         "SCALARS tet_label long\nLOOKUP_TABLE default\n3000000000\n",
     "label of cell 0"},
    {"vtu", "", "does not begin with a tag VTKFile"},
    {"vtu", "<html></html>", "does not begin with a tag VTKFile"},
    {"vtu", "<VTKFile type=\"PolyData\">", "\"PolyData\""},
    {"vtu", "<VTKFile type=\"UnstructuredGrid\" byte_order=\"Middle\">", "byte_order"},
    {"vtu", "<VTKFile type=\"UnstructuredGrid\" header_type=\"Float32\">", "header_type"},
    {"vtu", "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkLZ4DataCompressor\">",
     "vtkLZ4DataCompressor"},
    {"vtu", VTU_HEAD VTU_TAIL, "no piece"},
    {"vtu", VTU_HEAD "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">", "cut short"},
    {"vtu", VTU_HEAD "<Piece NumberOfPoints=\"4\" NumberOfCells=\"-3\"/>" VTU_TAIL, "-3 cells"},
    {"vtu", VTU_HEAD "<Piece NumberOfPoints=\"many\" NumberOfCells=\"1\"/>" VTU_TAIL, "\"many\""},
    {"vtu", VTU_PIECE("4", ""), "no array of points"},
    {"vtu", VTU_PIECE("4", VTU_POINTS), "no array \"offsets\""},
    {"vtu", VTU_PIECE("500000000", VTU_POINTS), "cannot hold them"},
    {"vtu", VTU_PIECE("9", VTU_POINTS VTU_CELL("0 1 2 3", "4", "10")),
     "points: 27 values are wanted"},
    {"vtu", VTU_PIECE("4", VTU_POINTS VTU_CELL("0 1 2 4", "4", "10")),
     "\"connectivity\": entry 3 names point 4"},
    {"vtu", VTU_PIECE("4", VTU_POINTS VTU_CELL("0 1 2 3", "-4", "10")),
     "\"offsets\": entry 0 is -4"},
    {"vtu", VTU_PIECE("4", VTU_POINTS VTU_CELL("0 1 2 3", "3", "10")),
     "cell 0: a tetrahedron of 3 vertices"},
    {"vtu", VTU_PIECE("4", VTU_POINTS VTU_CELL("0 1 2 x", "4", "10")), "\"connectivity\": line 1"},
    {"vtu", VTU_PIECE("4", VTU_POINTS VTU_CELL("0 2 1 3", "4", "10")), "inverted"},
};

static const Case surface_case[] = {
    {"stl", "", "the header"},
    {"stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 nan\n",
     "line 4: a coordinate is not"},
    {"stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\n",
     "\"vertex\" is wanted"},
    {"stl", "solid x\nendsolid x\n", "no triangles"},
    {"stl", "solid x\nfacets\n", "line 2"},
    {"stl",
     "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nvertex 1 0 0\n"
     "endloop\nendfacet\n",
     "degenerate"},
    {"obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "triangle 1 names vertex 4"},
    {"obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "line 4"},
    {"obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "line 4"},
    {"obj", "v 0 0 0\nv 1 0 inf\n", "line 2"},
    {"obj", "v 0 0 0\nf 1 1\n", "a face of 2 corners"},
    {"obj",
     "\x7f"
     "ELF\n",
     "not the text of an OBJ"},
    {"obj", "v 0 0\n", "a coordinate"},
    {"ply", "", "ply"},
    {"ply", "ply\nend_header\n", "format"},
    {"ply", "ply\nformat text 1.0\n", "\"text\" is no format"},
    {"ply", PLY_HEAD "element vertex 900000000\n" PLY_XYZ PLY_FACE "0 0 0\n", "900000000"},
    {"ply", PLY_HEAD "element vertex 3\nproperty float x\n" PLY_FACE "0\n", "x, y and z"},
    {"ply", PLY_HEAD "element vertex 3\nproperty half x\n", "\"half\" is no type"},
    {"ply", PLY_HEAD "property float x\n", "before the first element"},
    {"ply", PLY_HEAD "element vertex 3\n" PLY_XYZ PLY_FACE "0 0 0 1 0 0 0 1 0\n3 0 1 3\n",
     "triangle 1 names vertex 4"},
    {"ply", PLY_HEAD "element vertex 3\n" PLY_XYZ PLY_FACE "0 0 0 1 0 0 0 1 0\n3 0 1 -1\n",
     "-1 is no vertex"},
    {"ply", PLY_HEAD "element vertex 3\n" PLY_XYZ PLY_FACE "0 0 0 1 0 0 0 nan 0\n3 0 1 2\n",
     "vertex 3"},
    {"off", "OBJ\n", "does not begin with OFF"},
    {"off", "OFF\n3 1 0\n0 0 0 1 0 0 0 1 0\n3 0 1 3\n", "line 4"},
    {"off", "OFF\n300000000 1 0\n", "line 2"},
    {"off", "OFF\n3 1 0\n0 0 0 1 0 0 0 nan 0\n3 0 1 2\n", "line 3"},
    {"off", "OFF\n3 1 0\n0 0 0 1 0 0 0 1 0\n2 0 1\n", "no triangles"},
};

// One sentence, one line, with the file's name and what is wrong.
static void assert_refused(const Case* c, const char* path, OmStatus status, bool is_empty) {
    const char* message = om_error_message();
    if (status != OM_INVALID || !strstr(message, c->expected) || !strstr(message, path) ||
        strchr(message, '\n') || !is_empty)
        fail_msg(".%s \"%s\": status %d, \"%s\" is expected in \"%s\"", c->ext, c->text,
                 (int)status, c->expected, message);
}

static const char* write_case(const Case* c) {
    char name[32];
    snprintf(name, sizeof name, "hostile.%s", c->ext);
    const char* path = temp_path(name);
    write_bytes(path, c->text, strlen(c->text));
    return path;
}

static void test_meshes_that_lie(void** unused) {
    (void)unused;
    int64_t alive = om_alloc_alive();
    for (size_t i = 0; i < sizeof tet_case / sizeof tet_case[0]; i++) {
        OmTetMesh mesh;
        const char* path = write_case(&tet_case[i]);
        OmStatus status = om_tet_mesh_load(path, OM_UNIT_M, &mesh);
        assert_refused(&tet_case[i], path, status, mesh.x == NULL);
        assert_int_equal(om_alloc_alive(), alive);
        remove(path);
    }
}

static void test_surfaces_that_lie(void** unused) {
    (void)unused;
    int64_t alive = om_alloc_alive();
    for (size_t i = 0; i < sizeof surface_case / sizeof surface_case[0]; i++) {
        OmSurface surface;
        const char* path = write_case(&surface_case[i]);
        OmStatus status = om_surface_load(path, OM_UNIT_M, &surface);
        assert_refused(&surface_case[i], path, status, surface.x == NULL);
        assert_int_equal(om_alloc_alive(), alive);
        remove(path);
    }
}

static void test_missing_and_unknown_files(void** unused) {
    (void)unused;
    OmTetMesh mesh;
    OmSurface surface;
    assert_status(om_tet_mesh_load("/nowhere/a.vtu", OM_UNIT_M, &mesh), OM_IO);
    assert_non_null(strstr(om_error_message(), "/nowhere/a.vtu"));
    assert_status(om_tet_mesh_load("/nowhere/a.stl", OM_UNIT_M, &mesh), OM_INVALID);
    assert_non_null(strstr(om_error_message(), ".msh, .vtk and .vtu are read"));
    assert_status(om_surface_load("/nowhere/a.doc", OM_UNIT_M, &surface), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "/nowhere/a.doc"));
    const Case good = {"vtk", VTK_HEAD VTK_POINTS "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n", ""};
    const char* path = write_case(&good);
    assert_status(om_tet_mesh_load(path, -1, &mesh), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "unit"));
    assert_ok(om_tet_mesh_load(path, OM_UNIT_M, &mesh));
    om_tet_mesh_done(&mesh);
    remove(path);
}

static void test_flags_forgive(void** unused) {
    (void)unused;
    const Case bad = {
        "vtk", VTK_HEAD VTK_POINTS "CELLS 2 10\n4 0 1 3 2\n4 0 1 2 2\nCELL_TYPES 2\n10\n10\n", ""};
    const char* path = write_case(&bad);
    OmTetMesh mesh;
    assert_status(om_tet_mesh_load(path, OM_UNIT_M, &mesh), OM_INVALID);
    assert_status(om_tet_mesh_load_flags(path, OM_UNIT_M, OM_MESH_FLIP, &mesh), OM_INVALID);
    assert_ok(om_tet_mesh_load_flags(path, OM_UNIT_M, OM_MESH_FLIP | OM_MESH_DROP_FLAT, &mesh));
    assert_int_equal(mesh.ntet, 1);
    assert_near(om_tet_mesh_volume(&mesh), 1.0 / 6, 1e-16);
    om_tet_mesh_done(&mesh);
    remove(path);
}

// ---- every seed, cut at every byte; every allocation failing ------------------------------------------

typedef void SeedFn(const char* path, const char* ext, const char* data, size_t size);

static void for_each_seed(SeedFn* fn) {
    static const char* const ext[] = {"msh", "vtk", "vtu", "stl", "obj", "ply", "off"};
    int nseed = 0;
    for (size_t i = 0; i < sizeof ext / sizeof ext[0]; i++) {
        char dir[64];
        struct dirent** entry;
        snprintf(dir, sizeof dir, "fuzz/corpus/%s", ext[i]);
        int n = scandir(dir, &entry, NULL, alphasort);
        for (int k = 0; k < n; k++) {
            char path[400], *data;
            size_t size;
            snprintf(path, sizeof path, "%s/%s", dir, entry[k]->d_name);
            bool is_seed = entry[k]->d_name[0] != '.';
            free(entry[k]);
            if (!is_seed) continue;
            assert_ok(om_file_read(path, 1 << 20, &data, &size));
            fn(path, ext[i], data, size);
            om_free(data);
            nseed++;
        }
        if (n >= 0) free(entry);
    }
    assert_true(nseed >= 20);
}

static bool has_tet(const char* ext) {
    return strcmp(ext, "msh") == 0 || strncmp(ext, "vt", 2) == 0;
}

static OmStatus load_tet(const char* path) {
    OmTetMesh mesh;
    OmStatus status = om_tet_mesh_load(path, OM_UNIT_M, &mesh);
    if (status == OM_OK) om_tet_mesh_done(&mesh);
    return status;
}

static OmStatus load_tet10(const char* path) {
    OmTet10Mesh mesh;
    OmStatus status = om_tet10_mesh_load(path, (OmMeshFrame){OM_UNIT_M, OM_SPACE_RAS}, 0, &mesh);
    om_tet10_mesh_done(&mesh);
    return status;
}

static OmStatus load_surface(const char* path) {
    OmSurface surface;
    OmStatus status = om_surface_load(path, OM_UNIT_M, &surface);
    if (status == OM_OK) om_surface_done(&surface);
    return status;
}

static void assert_cut(const char* seed, const char* path, size_t cut, OmStatus status) {
    if (status != OM_OK && (status != OM_INVALID || !strstr(om_error_message(), path)))
        fail_msg("%s cut at byte %zu: status %d, %s", seed, cut, (int)status, om_error_message());
}

static void cut_seed(const char* seed, const char* ext, const char* data, size_t size) {
    char name[32];
    snprintf(name, sizeof name, "cut.%s", ext);
    const char* path = temp_path(name);
    int64_t alive = om_alloc_alive();
    // a quick run cuts heads and ends at every byte, what lies between at every fifth
    const size_t stride = (size_t)test_count(5, 1);
    for (size_t cut = 0; cut < size; cut += cut < 160 || cut + 64 > size ? 1 : stride) {
        write_bytes(path, data, cut);
        assert_cut(seed, path, cut, load_surface(path));
        if (has_tet(ext)) assert_cut(seed, path, cut, load_tet(path));
        if (strstr(seed, "tet10")) assert_cut(seed, path, cut, load_tet10(path));
        assert_int_equal(om_alloc_alive(), alive);
    }
    remove(path);
}

static void test_truncation_at_every_byte(void** unused) {
    (void)unused;
    for_each_seed(cut_seed);
}

// With the n-th allocation failing, n = 0, 1, ..., nothing but OM_NO_MEMORY until none is needed.
static void starve(const char* seed, OmStatus (*load)(const char*)) {
    OmStatus healthy = load(seed), status = OM_NO_MEMORY;
    int64_t alive = om_alloc_alive();
    for (int n = 0; status == OM_NO_MEMORY; n++) {
        test_alloc_countdown = n;
        status = load(seed);
        assert_int_equal(om_alloc_alive(), alive);
        assert_true(n < 1000);
    }
    if (test_alloc_countdown < 0)
        fail_msg("%s: a failed allocation ended as status %d", seed, (int)status);
    test_alloc_countdown = -1;
    assert_int_equal(status, healthy);
}

static void starve_seed(const char* seed, const char* ext, const char* data, size_t size) {
    (void)data;
    (void)size;
    bool is_refused = strstr(seed, "twice") || strstr(seed, "/cloud.");  // a cloud has no triangles
    assert_int_equal(load_surface(seed), is_refused ? OM_INVALID : OM_OK);
    starve(seed, load_surface);
    if (has_tet(ext)) starve(seed, load_tet);
    if (strstr(seed, "tet10")) starve(seed, load_tet10);
}

static void test_failing_allocations_of_readers(void** unused) {
    (void)unused;
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    test_alloc_countdown = -1;
    om_allocator_set(&failing);
    for_each_seed(starve_seed);
    om_allocator_set(NULL);
}

static void test_failing_allocations_of_writers(void** unused) {
    (void)unused;
    static const char* const ext[] = {"vtu", "vtk", "msh", "stl", "obj", "ply", "off"};
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    test_alloc_countdown = -1;
    om_allocator_set(&failing);
    OmTetMesh mesh;
    OmSurface surface;
    make_mesh(&mesh);
    assert_ok(om_tet_mesh_boundary(&mesh, &surface, NULL));
    for (size_t i = 0; i < sizeof ext / sizeof ext[0]; i++) {
        char name[32];
        snprintf(name, sizeof name, "starved.%s", ext[i]);
        const char* path = temp_path(name);
        int64_t alive = om_alloc_alive();
        OmStatus status = OM_NO_MEMORY;
        int n = 0;
        for (; status != OM_OK; n++) {
            test_alloc_countdown = n;
            status = i < 3 ? om_tet_mesh_save(&mesh, path, OM_UNIT_M)
                           : om_surface_save(&surface, path, OM_UNIT_M);
            assert_int_equal(om_alloc_alive(), alive);
            if (status == OM_OK) break;
            assert_int_equal(status, OM_NO_MEMORY);
            assert_false(om_path_exists(path));
        }
        assert_true(n > 3);
        remove(path);
    }
    om_surface_done(&surface);
    om_tet_mesh_done(&mesh);
    om_allocator_set(NULL);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_meshes_that_lie),
        cmocka_unit_test(test_surfaces_that_lie),
        cmocka_unit_test(test_missing_and_unknown_files),
        cmocka_unit_test(test_flags_forgive),
        cmocka_unit_test(test_truncation_at_every_byte),
        cmocka_unit_test(test_failing_allocations_of_readers),
        cmocka_unit_test(test_failing_allocations_of_writers),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
