// Quadratic tetrahedra: order of nodes in files of Gmsh and VTK, straight and curved edges, round trips, recordings.
#include "shape_file_common.h"
#include "test_alloc.h"

#include "shape_read_set.h"

#include "omentum/shape_tet10.h"

// Vertices of the tetrahedron of these files, and the midpoints of its edges 01 12 02 03 13 23, by hand.
static const double expected[10][3] = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {1, 0, 0},
                                       {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};

// The order of each format: Gmsh's reference manual, "Node ordering", has edge 23 before 13; VTK has 13 before 23.
#define FIRST_EIGHT(p)                                                                  \
    p(1, "0 0 0") p(2, "2 0 0") p(3, "0 2 0") p(4, "0 0 2") p(5, "1 0 0") p(6, "1 1 0") \
        p(7, "0 1 0") p(8, "0 0 1")
#define NUMBERED(n, x) #n " " x "\n"
#define PLAIN(n, x) x "\n"
#define MSH_NAMES "$PhysicalNames\n2\n2 3 \"attachment\"\n3 7 \"fat\"\n$EndPhysicalNames\n"
#define MSH22(last)                                                                              \
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" MSH_NAMES "$Nodes\n10\n" FIRST_EIGHT(NUMBERED) last \
        "$EndNodes\n$Elements\n2\n"                                                              \
        "1 9 2 3 1 1 3 2 7 6 5\n2 11 2 7 1 1 2 3 4 5 6 7 8 9 10\n$EndElements\n"
#define VTK_HEAD "# vtk DataFile Version 3.0\nUNIT=m\nASCII\nDATASET UNSTRUCTURED_GRID\n"
#define VTK_CELL "CELLS 1 11\n10 0 1 2 3 4 5 6 7 8 9\nCELL_TYPES 1\n24\n"
#define MSH_LAST NUMBERED(9, "0 1 1") NUMBERED(10, "1 0 1")
#define VTK_LAST PLAIN(9, "1 0 1") PLAIN(10, "0 1 1")

static const char msh22[] = MSH22(MSH_LAST);
static const char vtk[] = VTK_HEAD "POINTS 10 double\n" FIRST_EIGHT(PLAIN) VTK_LAST VTK_CELL;
// nodes of the last two edges exchanged: both edges are then far from straight
static const char msh_exchanged[] = MSH22(NUMBERED(9, "1 0 1") NUMBERED(10, "0 1 1"));
static const char vtk_exchanged[] =
    VTK_HEAD "POINTS 10 double\n" FIRST_EIGHT(PLAIN) PLAIN(9, "0 1 1") PLAIN(10, "1 0 1") VTK_CELL;

static const char* write_file(const char* name, const char* text) {
    const char* path = temp_path(name);
    write_bytes(path, text, strlen(text));
    return path;
}

static const OmMeshFrame metres = {OM_UNIT_M, OM_SPACE_RAS};

static void test_nodes_of_both_formats_in_order(void** unused) {
    (void)unused;
    const char* path[2] = {write_file("a.msh", msh22), write_file("a.vtk", vtk)};
    for (int i = 0; i < 2; i++) {
        OmTet10Mesh mesh;
        assert_ok(om_tet10_mesh_load(path[i], metres, 0, &mesh));
        assert_int_equal(mesh.nnode, 10);
        assert_int_equal(mesh.nelem, 1);
        for (int k = 0; k < 10; k++)
            assert_memory_equal(mesh.x + 3 * mesh.elem_node[k], expected[k], sizeof expected[k]);
        assert_int_equal(mesh.elem_label[0], i == 0 ? 7 : 0);
        om_tet10_mesh_done(&mesh);
        remove(path[i]);
    }
}

// Of a straight mesh the vertices are read, labels and sets with them; a set of a face keeps its corners.
static void test_vertices_of_a_straight_mesh(void** unused) {
    (void)unused;
    OmTetMesh mesh;
    for (int keep = 0; keep < 2; keep++) {
        const char* path = write_file("b.msh", msh22);
        assert_ok(om_tet_mesh_load_flags(path, OM_UNIT_MM, keep ? OM_MESH_KEEP_UNUSED : 0, &mesh));
        assert_int_equal(mesh.nvert, 4);
        assert_int_equal(mesh.ntet, 1);
        assert_int_equal(mesh.tet_label[0], 7);
        for (int i = 0; i < 12; i++) assert_near(mesh.x[i], 1e-3 * expected[i / 3][i % 3], 1e-18);
        const OmMeshSet* set = om_tet_mesh_find_set(&mesh, "attachment");
        assert_non_null(set);
        assert_int_equal(set->nvert, 3);
        for (int i = 0; i < 3; i++) assert_int_equal(set->vert[i], i);
        om_tet_mesh_done(&mesh);
        remove(path);
    }
    // all nodes of the face are in the set of a quadratic mesh
    OmTet10Mesh all;
    const char* path = write_file("b.msh", msh22);
    assert_ok(om_tet10_mesh_load(path, metres, 0, &all));
    assert_int_equal(all.nset, 2);
    const int face[6] = {0, 1, 2, 4, 5, 6};
    assert_string_equal(all.set[0].name, "attachment");
    assert_int_equal(all.set[0].nvert, 6);
    assert_memory_equal(all.set[0].vert, face, sizeof face);
    om_tet10_mesh_done(&all);
    remove(path);
}

static int nlog;
static void count_log(void* ctx, OmLogLevel level, const char* message) {
    (void)ctx;
    nlog += level == OM_LOG_INFO && strstr(message, "tetrahedra of ten nodes") != NULL;
}

static void test_curved_elements_are_named(void** unused) {
    (void)unused;
    static const struct {
        const char *name, *text, *part;
    } table[] = {{"c.msh", msh_exchanged, "tetrahedron 1 is curved: node 10 is 1.41 off"},
                 {"c.vtk", vtk_exchanged, "tetrahedron 1 is curved: node 9 is 1.41 off"}};
    OmTetMesh mesh;
    om_log_set_sink(count_log, NULL);
    nlog = 0;
    for (int i = 0; i < 2; i++) {
        const char* path = write_file(table[i].name, table[i].text);
        assert_status(om_tet_mesh_load(path, OM_UNIT_M, &mesh), OM_INVALID);
        assert_null(mesh.x);
        if (!strstr(om_error_message(), table[i].part)) fail_msg("%s", om_error_message());
        assert_non_null(strstr(om_error_message(), path));
        assert_int_equal(nlog, i);
        assert_ok(om_tet_mesh_load_flags(path, OM_UNIT_M, OM_MESH_STRAIGHTEN, &mesh));
        assert_int_equal(nlog, i + 1);
        assert_int_equal(mesh.nvert, 4);
        om_tet_mesh_done(&mesh);
        remove(path);
    }
    om_log_set_sink(NULL, NULL);
}

// An edge may have its node 0.1 % of its length off the midpoint, and no more.
static void test_the_tolerance_of_straight_edges(void** unused) {
    (void)unused;
    for (int side = 0; side < 2; side++) {
        OmTetMesh tet, back;
        OmTet10Mesh mesh;
        assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(2, 2, 2), 1, 1, 1, &tet));
        assert_ok(om_tet10_mesh_from_tet(&tet, &mesh));
        int node = mesh.elem_node[10 * 3 + 4];  // edge 01 of element 3
        OmVec3 along =
            om_sub(om_load3(mesh.x, mesh.elem_node[31]), om_load3(mesh.x, mesh.elem_node[30]));
        om_store3(mesh.x, node, om_madd(om_load3(mesh.x, node), side ? 1.01e-3 : 0.99e-3, along));
        const char* path = temp_path("tolerance.vtu");
        assert_ok(om_tet10_mesh_save(&mesh, path, OM_UNIT_M));
        assert_status(om_tet_mesh_load(path, OM_UNIT_M, &back), side ? OM_INVALID : OM_OK);
        om_tet_mesh_done(&back);
        om_tet10_mesh_done(&mesh);
        om_tet_mesh_done(&tet);
        remove(path);
    }
}

// A mesh with curved edges, labels and sets of nodes.
static void make_curved(OmTet10Mesh* mesh) {
    OmTetMesh tet;
    make_mesh(&tet);
    assert_ok(om_tet10_mesh_from_tet(&tet, mesh));
    assert_memory_equal(mesh->elem_label, tet.tet_label, (size_t)tet.ntet * sizeof(int));
    OmRng rng = om_rng_init(5, 0);
    for (int i = 3 * tet.nvert; i < 3 * mesh->nnode; i++)
        mesh->x[i] += om_rng_range(&rng, -0.02, 0.02);
    om_tet_mesh_done(&tet);
}

static void assert_same(const OmTet10Mesh* a, const OmTet10Mesh* b) {
    assert_int_equal(a->nnode, b->nnode);
    assert_int_equal(a->nelem, b->nelem);
    assert_memory_equal(a->x, b->x, 3 * (size_t)a->nnode * sizeof(double));
    assert_memory_equal(a->elem_node, b->elem_node, 10 * (size_t)a->nelem * sizeof(int));
    assert_memory_equal(a->elem_label, b->elem_label, (size_t)a->nelem * sizeof(int));
    assert_int_equal(a->nset, b->nset);
    for (int s = 0; s < a->nset; s++) {
        assert_string_equal(a->set[s].name, b->set[s].name);
        assert_int_equal(a->set[s].nvert, b->set[s].nvert);
        assert_memory_equal(a->set[s].vert, b->set[s].vert, (size_t)a->set[s].nvert * sizeof(int));
    }
}

static void test_all_formats_round_trip(void** unused) {
    (void)unused;
    OmTet10Mesh mesh, back;
    make_curved(&mesh);
    for (size_t i = 0; i < NMESH_FORMAT; i++) {
        const char* path = temp_path(mesh_format[i].name);
        assert_ok(
            om_tet10_mesh_save_format(&mesh, path, OM_UNIT_M, mesh_format[i].format, NULL, 0));
        assert_ok(om_tet10_mesh_load(path, metres, 0, &back));
        assert_same(&mesh, &back);
        om_tet10_mesh_done(&back);
        remove(path);
    }
    const char* path = temp_path("a.stl");
    assert_status(om_tet10_mesh_save(&mesh, path, OM_UNIT_M), OM_INVALID);
    assert_status(om_tet10_mesh_save(&mesh, temp_path("a.vtu"), 0), OM_INVALID);
    om_tet10_mesh_done(&mesh);
}

// A word of a text that stands behind another one.
static const char* behind(const char* text, const char* word) {
    const char* at = strstr(text, word);
    if (!at) fail_msg("no %s in the file", word);
    return at + strlen(word);
}

// What is written, read without our readers: the numbers of one element in the text of each format.
static void test_written_text(void** unused) {
    (void)unused;
    OmTetMesh tet;
    OmTet10Mesh mesh;
    assert_ok(om_tet_mesh_init(&tet, 4, 1));
    memcpy(tet.x, expected, 12 * sizeof(double));
    memcpy(tet.tet_vert, (int[4]){0, 1, 2, 3}, sizeof(int[4]));
    tet.tet_label[0] = 5;
    assert_ok(om_tet10_mesh_from_tet(&tet, &mesh));
    static const struct {
        const char* name;
        OmMeshFormat format;
        const char *first, *second;  // words before the type and before the nodes
        int type, edge[2];           // ends of the edge of the ninth node
        int shift;
    } table[] = {{"t.vtu", OM_MESH_VTU_ASCII, "\"types\"", "\"connectivity\"", 24, {1, 3}, 0},
                 {"t.vtk", OM_MESH_VTK_ASCII, "CELL_TYPES 1\n", "CELLS 1 11\n10 ", 24, {1, 3}, 0},
                 {"t.msh", OM_MESH_MSH22, "$Elements\n1\n1 ", " 2 5 1 ", 11, {2, 3}, 1},
                 {"u.msh", OM_MESH_MSH41, "$Elements\n1 1 1 1\n3 1 ", " 1\n1 ", 11, {2, 3}, 1}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const char* path = temp_path(table[i].name);
        char* text;
        size_t size;
        assert_ok(om_tet10_mesh_save_format(&mesh, path, OM_UNIT_M, table[i].format, NULL, 0));
        assert_ok(om_file_read(path, 1 << 20, &text, &size));
        char* copy = om_alloc(size + 1, 1);
        memcpy(copy, text, size);
        copy[size] = 0;
        const char* at = behind(copy, table[i].first);
        if (i == 0) at = behind(at, "format=\"ascii\">\n");
        assert_int_equal(strtol(at, NULL, 10), table[i].type);
        const char* nodes = behind(i < 2 ? copy : at, table[i].second);
        if (i == 0) nodes = behind(nodes, "format=\"ascii\">\n");
        int node[10];
        char* end = (char*)(uintptr_t)nodes;
        for (int k = 0; k < 10; k++) node[k] = (int)strtol(end, &end, 10) - table[i].shift;
        for (int k = 0; k < 4; k++) assert_int_equal(node[k], k);
        const double* p = expected[table[i].edge[0]];
        const double* q = expected[table[i].edge[1]];
        for (int c = 0; c < 3; c++) assert_near(mesh.x[3 * node[8] + c], 0.5 * (p[c] + q[c]), 0);
        om_free(copy);
        om_free(text);
        remove(path);
    }
    om_tet10_mesh_done(&mesh);
    om_tet_mesh_done(&tet);
}

// Arrays of nodes and elements are written with the mesh.
static void test_arrays(void** unused) {
    (void)unused;
    OmTet10Mesh mesh;
    OmTetMesh back;
    make_curved(&mesh);
    unsigned char* flag = om_calloc((size_t)mesh.nnode, 1);
    flag[mesh.elem_node[0]] = flag[mesh.elem_node[5]] = 1;  // a corner and a node on an edge
    const OmMeshArray array = {"marked", OM_ARRAY_BYTE, 1, false, flag};
    const char* path = temp_path("arrays.vtk");
    assert_ok(om_tet10_mesh_save_format(&mesh, path, OM_UNIT_M, OM_MESH_VTK, &array, 1));
    assert_ok(om_tet_mesh_load_flags(path, OM_UNIT_M, OM_MESH_STRAIGHTEN, &back));
    const OmMeshSet* set = om_tet_mesh_find_set(&back, "marked");
    assert_non_null(set);
    assert_int_equal(set->nvert, 1);
    remove(path);
    om_free(flag);
    om_tet_mesh_done(&back);
    om_tet10_mesh_done(&mesh);
}

// An inverted element is turned around with its nodes on edges: the nodes stay on their edges.
static void test_flipped_elements_keep_their_edges(void** unused) {
    (void)unused;
    static const char flipped[] = VTK_HEAD "POINTS 10 double\n" FIRST_EIGHT(PLAIN) VTK_LAST
        "CELLS 1 11\n10 0 2 1 3 6 5 4 7 9 8\nCELL_TYPES 1\n24\n";
    static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    OmTet10Mesh mesh;
    OmTetMesh tet;
    const char* path = write_file("flipped.vtk", flipped);
    assert_status(om_tet10_mesh_load(path, metres, 0, &mesh), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "inverted"));
    assert_ok(om_tet10_mesh_load(path, metres, OM_MESH_FLIP, &mesh));
    for (int k = 0; k < 6; k++) {
        OmVec3 p = om_load3(mesh.x, mesh.elem_node[edge[k][0]]);
        OmVec3 q = om_load3(mesh.x, mesh.elem_node[edge[k][1]]);
        OmVec3 mid = om_load3(mesh.x, mesh.elem_node[4 + k]);
        assert_near(om_distance(mid, om_lerp(p, q, 0.5)), 0, 0);
    }
    assert_ok(om_tet_mesh_load_flags(path, OM_UNIT_M, OM_MESH_FLIP, &tet));
    assert_near(om_tet_mesh_volume(&tet), 8.0 / 6, 1e-15);
    om_tet_mesh_done(&tet);
    om_tet10_mesh_done(&mesh);
    remove(path);
}

static void test_wrong_meshes_are_refused(void** unused) {
    (void)unused;
    OmTet10Mesh mesh;
    static const char linear[] = VTK_HEAD "POINTS 10 double\n" FIRST_EIGHT(PLAIN) VTK_LAST
        "CELLS 2 16\n4 0 1 2 3\n10 0 1 2 3 4 5 6 7 8 9\nCELL_TYPES 2\n10\n24\n";
    static const char outside[] = VTK_HEAD "POINTS 10 double\n" FIRST_EIGHT(PLAIN) VTK_LAST
        "CELLS 1 11\n10 0 1 2 3 4 5 6 7 8 10\nCELL_TYPES 1\n24\n";
    OmTetMesh tet;
    const char* path = write_file("wrong.vtk", linear);
    assert_status(om_tet10_mesh_load(path, metres, 0, &mesh), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "tetrahedron 1 has four nodes"));
    assert_ok(om_tet_mesh_load(path, OM_UNIT_M, &tet));  // a mixed mesh has vertices
    assert_int_equal(tet.ntet, 2);
    om_tet_mesh_done(&tet);
    path = write_file("wrong.vtk", outside);
    assert_status(om_tet_mesh_load(path, OM_UNIT_M, &tet), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "11"));
    assert_status(om_tet10_mesh_load(path, metres, 0, &mesh), OM_INVALID);
    remove(path);

    make_curved(&mesh);
    int saved = mesh.elem_node[17];
    mesh.elem_node[17] = mesh.nnode;
    assert_status(om_tet10_mesh_validate(&mesh), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "element 1 names node"));
    mesh.elem_node[17] = saved;
    mesh.x[5] = NAN;
    assert_status(om_tet10_mesh_save(&mesh, temp_path("nan.vtu"), OM_UNIT_M), OM_INVALID);
    mesh.x[5] = 0;
    for (int i = 0; i < 3 * mesh.nnode; i += 3) mesh.x[i] *= -1;
    assert_status(om_tet10_mesh_validate(&mesh), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "element 0 have a volume of -"));
    om_tet10_mesh_done(&mesh);
}

// ---- recordings -------------------------------------------------------------------------------------

// Cells of type 24 with ten nodes each, surfaces behind them, positions of all nodes.
static void test_a_recording_has_quadratic_cells(void** unused) {
    (void)unused;
    enum { MOST = 20000 };
    static double value[MOST], x[MOST];
    OmTet10Mesh mesh;
    OmSurface tool;
    OmRecording* r;
    make_curved(&mesh);
    assert_ok(om_surface_init(&tool, 3, 1));
    memcpy(tool.tri_vert, (int[3]){2, 1, 0}, sizeof(int[3]));
    const OmRecordedSurface surface = {"tool", &tool};
    const OmMeshArray array = {"stress", OM_ARRAY_DOUBLE, 1, true, NULL};
    const OmRecordingArrays arrays = {&array, 1};
    const char* path = temp_path("tet10.vtkhdf");
    assert_ok(om_recording_begin_tet10(path, &mesh, "tissue", &surface, 1, &arrays, &r));
    const int nvert = mesh.nnode + 3, ncell = mesh.nelem + 1, nconn = 10 * mesh.nelem + 3;
    for (int s = 0; s < 2; s++) {
        for (int i = 0; i < 3 * nvert; i++) x[i] = 0.25 * i + s;
        const void* given = x;
        assert_ok(om_recording_add_step(r, s, x, &given));
    }
    assert_ok(om_recording_end(r));
    hid_t f = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(f >= 0);
    assert_int_equal(read_set(f, "VTKHDF/Types", value, MOST), ncell);
    for (int e = 0; e < mesh.nelem; e++) assert_near(value[e], 24, 0);  // VTK_QUADRATIC_TETRA
    assert_near(value[mesh.nelem], 5, 0);
    assert_int_equal(read_set(f, "VTKHDF/Offsets", value, MOST), ncell + 1);
    for (int e = 0; e <= mesh.nelem; e++) assert_near(value[e], 10 * e, 0);
    assert_near(value[ncell], nconn, 0);
    assert_int_equal(read_set(f, "VTKHDF/Connectivity", value, MOST), nconn);
    for (int i = 0; i < 10 * mesh.nelem; i++) assert_near(value[i], mesh.elem_node[i], 0);
    assert_near(value[nconn - 3], mesh.nnode + 2, 0);
    assert_int_equal(read_set(f, "VTKHDF/CellData/tet_label", value, MOST), ncell);
    for (int e = 0; e < mesh.nelem; e++) assert_near(value[e], mesh.elem_label[e], 0);
    assert_int_equal(read_set(f, "VTKHDF/Points", value, MOST), 2 * nvert);
    assert_near(value[3 * (2 * nvert - 1)], 0.25 * 3 * (nvert - 1) + 1, 0);
    assert_int_equal(read_set(f, "VTKHDF/PointData/attachment", value, MOST), nvert);
    for (int i = 0; i < mesh.set[0].nvert; i++) assert_near(value[mesh.set[0].vert[i]], 1, 0);
    H5Fclose(f);
    remove(path);
    om_surface_done(&tool);
    om_tet10_mesh_done(&mesh);
}

// ---- memory -----------------------------------------------------------------------------------------

static OmStatus make_save_load(const OmTetMesh* tet, const char* path) {
    OmTet10Mesh mesh, back = {0};
    OM_TRY(om_tet10_mesh_from_tet(tet, &mesh));
    OmStatus status = om_tet10_mesh_save(&mesh, path, OM_UNIT_M);
    if (status == OM_OK) status = om_tet10_mesh_load(path, metres, 0, &back);
    om_tet10_mesh_done(&mesh);
    om_tet10_mesh_done(&back);
    return status;
}

static void test_failing_allocations_leak_nothing(void** unused) {
    (void)unused;
    OmTetMesh tet;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(2, 2, 2), 1, 1, 1, &tet));
    assert_ok(om_tet_mesh_add_set(&tet, "attachment", (int[2]){0, 1}, 2));
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    static const char* const name[] = {"m.msh", "m.vtk", "m.vtu"};
    test_alloc_countdown = -1;
    for (int i = 0; i < 3; i++) {
        const char* path = temp_path(name[i]);
        const int64_t alive = om_alloc_alive();
        int n = 0;
        om_allocator_set(&failing);
        for (OmStatus status = OM_NO_MEMORY; status != OM_OK; n++) {
            test_alloc_countdown = n;
            status = make_save_load(&tet, path);
            if (status < 0) assert_int_equal(status, OM_NO_MEMORY);
            assert_int_equal(om_alloc_alive(), alive);
            assert_true(n < 1000);
        }
        test_alloc_countdown = -1;
        om_allocator_set(NULL);
        assert_true(n > 15);
        remove(path);
    }
    om_tet_mesh_done(&tet);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_nodes_of_both_formats_in_order),
        cmocka_unit_test(test_vertices_of_a_straight_mesh),
        cmocka_unit_test(test_curved_elements_are_named),
        cmocka_unit_test(test_the_tolerance_of_straight_edges),
        cmocka_unit_test(test_all_formats_round_trip),
        cmocka_unit_test(test_written_text),
        cmocka_unit_test(test_arrays),
        cmocka_unit_test(test_flipped_elements_keep_their_edges),
        cmocka_unit_test(test_wrong_meshes_are_refused),
        cmocka_unit_test(test_a_recording_has_quadratic_cells),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
