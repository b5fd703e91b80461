// Recordings: what VTKHDF says must be there is there, read back by HDF5 itself; bad input leaves nothing.
#include "shape_file_common.h"
#include "test_alloc.h"

#include "shape_read_set.h"

static void make_recording(const char* path, const OmTetMesh* mesh, int nstep) {
    OmRecording* r;
    int nvert = mesh->nvert, ntet = mesh->ntet;
    double* x = om_calloc(3 * (size_t)nvert, sizeof *x);
    float* stress = om_calloc((size_t)ntet, sizeof *stress);
    int* part = om_calloc((size_t)ntet, sizeof *part);
    for (int e = 0; e < ntet; e++) part[e] = 7 * e;
    const OmMeshArray array[] = {{"force", OM_ARRAY_DOUBLE, 3, false, NULL},
                                 {"part", OM_ARRAY_INT, 1, true, part},
                                 {"stress", OM_ARRAY_FLOAT, 1, true, NULL}};
    assert_ok(om_recording_begin(path, mesh, array, 3, &r));
    for (int s = 0; s < nstep; s++) {
        for (int i = 0; i < 3 * nvert; i++) x[i] = mesh->x[i] + s;
        for (int e = 0; e < ntet; e++) stress[e] = (float)(100 * s + e);
        const void* value[] = {x, stress};
        assert_false(om_path_exists(path));
        assert_ok(om_recording_add_step(r, 0.25 * s, x, value));
    }
    assert_ok(om_recording_end(r));
    om_free(x);
    om_free(stress);
    om_free(part);
}

static void test_a_run_is_read_back(void** unused) {
    (void)unused;
    enum { NSTEP = 3, MOST = 8000 };
    static double value[MOST];
    OmTetMesh mesh;
    make_mesh(&mesh);
    const char* path = temp_path("run.vtkhdf");
    make_recording(path, &mesh, NSTEP);
    hid_t f = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(f >= 0);
    int nvert = mesh.nvert, ntet = mesh.ntet;

    // elements, labels and sets once
    assert_int_equal(read_set(f, "VTKHDF/Connectivity", value, MOST), 4 * ntet);
    for (int i = 0; i < 4 * ntet; i++) assert_near(value[i], mesh.tet_vert[i], 0);
    assert_int_equal(read_set(f, "VTKHDF/Offsets", value, MOST), ntet + 1);
    for (int e = 0; e <= ntet; e++) assert_near(value[e], 4 * e, 0);
    assert_int_equal(read_set(f, "VTKHDF/CellData/tet_label", value, MOST), ntet);
    for (int e = 0; e < ntet; e++) assert_near(value[e], mesh.tet_label[e], 0);
    assert_int_equal(read_set(f, "VTKHDF/PointData/attachment", value, MOST), nvert);
    const OmMeshSet* set = om_tet_mesh_find_set(&mesh, "attachment");
    double sum = 0;
    for (int i = 0; i < nvert; i++) sum += value[i];
    assert_near(sum, 3, 0);
    assert_int_equal(set->nvert, 3);
    for (int i = 0; i < set->nvert; i++) assert_near(value[set->vert[i]], 1, 0);
    assert_int_equal(read_set(f, "VTKHDF/CellData/part", value, MOST), ntet);
    assert_near(value[5], 35, 0);

    // positions and what was given at each step, one step behind the other
    assert_int_equal(read_set(f, "VTKHDF/Points", value, MOST), NSTEP * nvert);
    for (int i = 0; i < 3 * nvert; i++)
        assert_near(value[2 * 3 * nvert + i], mesh.x[i] + 2, 4e-7);  // floats of up to 5
    assert_int_equal(read_set(f, "VTKHDF/CellData/stress", value, MOST), NSTEP * ntet);
    assert_near(value[ntet + 9], 109, 0);
    assert_int_equal(read_set(f, "VTKHDF/Steps/Values", value, MOST), NSTEP);
    assert_near(value[2], 0.5, 0);
    assert_int_equal(read_set(f, "VTKHDF/Steps/PointOffsets", value, MOST), NSTEP);
    assert_near(value[2], 2 * nvert, 0);
    assert_int_equal(read_set(f, "VTKHDF/Steps/CellDataOffsets/stress", value, MOST), NSTEP);
    assert_near(value[1], ntet, 0);
    assert_int_equal(read_set(f, "VTKHDF/Steps/PointDataOffsets/attachment", value, MOST), NSTEP);
    assert_near(value[2], 0, 0);
    H5Fclose(f);
    remove(path);
    om_tet_mesh_done(&mesh);
}

// A mesh with two surfaces behind it: cells of both kinds, parts, and positions and values of all vertices.
static void test_surfaces_beside_the_mesh(void** unused) {
    (void)unused;
    enum { MOST = 8000, NSTEP = 2 };
    static double value[MOST], x[MOST], force[MOST];
    OmTetMesh mesh;
    OmSurface organ, tool;
    OmRecording* r;
    make_mesh(&mesh);
    assert_ok(om_surface_init(&organ, 4, 2));
    memcpy(organ.tri_vert, (int[6]){0, 1, 2, 0, 2, 3}, sizeof(int[6]));
    assert_ok(om_surface_init(&tool, 3, 1));
    memcpy(tool.tri_vert, (int[3]){2, 1, 0}, sizeof(int[3]));
    const char* path = temp_path("scene.vtkhdf");
    const OmRecordedSurface surface[] = {{"organ", &organ}, {"tool of arm 1", &tool}};
    const OmMeshArray array[] = {{"force_N", OM_ARRAY_DOUBLE, 3, false, NULL},
                                 {"von_mises_Pa", OM_ARRAY_DOUBLE, 1, true, NULL}};
    const OmRecordingArrays arrays = {array, 2};
    assert_ok(om_recording_begin_scene(path, &mesh, "tissue", surface, 2, &arrays, &r));
    const int nvert = mesh.nvert + 7, ncell = mesh.ntet + 3;
    for (int s = 0; s < NSTEP; ++s) {
        for (int i = 0; i < 3 * nvert; ++i) x[i] = 0.5 * i + s, force[i] = -i - s;
        const void* given[] = {force, force};
        assert_ok(om_recording_add_step(r, s, x, given));
    }
    assert_ok(om_recording_end(r));

    hid_t f = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(f >= 0);
    const int nindex = 4 * mesh.ntet + 9;
    assert_int_equal(read_set(f, "VTKHDF/Connectivity", value, MOST), nindex);
    const int expected[9] = {0, 1, 2, 0, 2, 3, 6, 5, 4};  // of the vertices behind the mesh
    for (int i = 0; i < 9; ++i) assert_near(value[4 * mesh.ntet + i], mesh.nvert + expected[i], 0);
    assert_int_equal(read_set(f, "VTKHDF/Offsets", value, MOST), ncell + 1);
    assert_near(value[mesh.ntet], 4 * mesh.ntet, 0);
    assert_near(value[ncell - 1], nindex - 3, 0);
    assert_near(value[ncell], nindex, 0);
    assert_int_equal(read_set(f, "VTKHDF/Types", value, MOST), ncell);
    assert_near(value[mesh.ntet - 1], 10, 0);                             // VTK_TETRA
    for (int k = 0; k < 3; ++k) assert_near(value[mesh.ntet + k], 5, 0);  // VTK_TRIANGLE
    assert_int_equal(read_set(f, "VTKHDF/CellData/part", value, MOST), ncell);
    assert_near(value[mesh.ntet - 1], 0, 0);
    assert_near(value[mesh.ntet], 1, 0);
    assert_near(value[ncell - 1], 2, 0);
    assert_int_equal(read_set(f, "VTKHDF/NumberOfPoints", value, MOST), 1);
    assert_near(value[0], nvert, 0);
    assert_int_equal(read_set(f, "VTKHDF/NumberOfCells", value, MOST), 1);
    assert_near(value[0], ncell, 0);
    assert_int_equal(read_set(f, "VTKHDF/PointData/attachment", value, MOST), nvert);
    for (int i = mesh.nvert; i < nvert; ++i) assert_near(value[i], 0, 0);
    assert_int_equal(read_set(f, "VTKHDF/Points", value, MOST), NSTEP * nvert);
    assert_near(value[3 * (2 * nvert - 1)], 0.5 * 3 * (nvert - 1) + 1, 0);
    assert_int_equal(read_set(f, "VTKHDF/CellData/von_mises_Pa", value, MOST), NSTEP * ncell);
    assert_near(value[2 * ncell - 1], -(ncell - 1) - 1, 0);
    assert_int_equal(read_set(f, "VTKHDF/PointData/force_N", value, MOST), NSTEP * nvert);
    char names[64] = "";
    hid_t root = H5Gopen2(f, "VTKHDF", H5P_DEFAULT);
    hid_t a = H5Aopen(root, "part_names", H5P_DEFAULT), type = H5Aget_type(a);
    assert_true(H5Tget_size(type) <= sizeof names && H5Aread(a, type, names) >= 0);
    assert_string_equal(names, "0 tissue, 1 organ, 2 tool of arm 1");
    H5Tclose(type);
    H5Aclose(a);
    H5Gclose(root);
    H5Fclose(f);
    remove(path);

    const OmRecordedSurface nameless = {"", &organ};
    assert_status(om_recording_begin_scene(path, &mesh, "tissue", &nameless, 1, &arrays, &r),
                  OM_INVALID);
    assert_null(r);
    assert_false(om_path_exists(path));
    om_surface_done(&organ);
    om_surface_done(&tool);
    om_tet_mesh_done(&mesh);
}

static int count_leftovers(const char* part) {
    char command[300];
    snprintf(command, sizeof command, "ls -a /tmp | grep -c -- '%s'", part);
    FILE* pipe = popen(command, "r");
    int n = -1;
    assert_non_null(pipe);
    assert_int_equal(fscanf(pipe, "%d", &n), 1);
    pclose(pipe);
    return n;
}

static herr_t count_object(hid_t at, const char* name, const H5O_info_t* info, void* ctx) {
    (void)at;
    int* n = ctx;
    assert_true(info->ctime == 0 && info->mtime == 0 && info->atime == 0 && info->btime == 0);
    *n += name[0] != 0;
    return 0;
}

// The same bytes at any time of the day: no object of the file holds the time at which it was made.
static void test_objects_have_no_time(void** state) {
    (void)state;
    const char* path = "/tmp/test_shape_vtkhdf_time.vtkhdf";
    OmTetMesh mesh;
    OmRecording* r;
    int n = 0;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(1, 1, 1), 1, 1, 1, &mesh));
    assert_ok(om_recording_begin(path, &mesh, NULL, 0, &r));
    assert_ok(om_recording_add_step(r, 0, mesh.x, NULL));
    assert_ok(om_recording_end(r));
    hid_t f = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(f >= 0);
    assert_true(H5Ovisit2(f, H5_INDEX_NAME, H5_ITER_INC, count_object, &n, H5O_INFO_TIME) >= 0);
    assert_true(n > 12);
    H5Fclose(f);
    remove(path);
    om_tet_mesh_done(&mesh);
}

static void test_bad_input_leaves_nothing(void** unused) {
    (void)unused;
    OmTetMesh mesh;
    OmRecording* r;
    make_mesh(&mesh);
    char name[64];
    snprintf(name, sizeof name, "omentum-%ld-bad.vtkhdf", (long)getpid());
    const char* path = temp_path("bad.vtkhdf");
    const OmMeshArray wide = {"wide", OM_ARRAY_DOUBLE, 12, false, NULL};
    const OmMeshArray unnamed = {"", OM_ARRAY_DOUBLE, 1, false, NULL};
    assert_status(om_recording_begin(path, &mesh, &wide, 1, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "wide"));
    assert_null(r);
    assert_status(om_recording_begin(path, &mesh, &unnamed, 1, &r), OM_INVALID);
    assert_status(om_recording_begin("/nowhere/a.vtkhdf", &mesh, NULL, 0, &r), OM_IO);
    assert_non_null(strstr(om_error_message(), "/nowhere"));

    assert_ok(om_recording_begin(path, &mesh, NULL, 0, &r));
    assert_ok(om_recording_add_step(r, 1, mesh.x, NULL));
    assert_status(om_recording_add_step(r, 1, mesh.x, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "time 1 s"));
    assert_status(om_recording_add_step(r, NAN, mesh.x, NULL), OM_INVALID);
    om_recording_abort(r);
    om_recording_abort(NULL);
    assert_int_equal(count_leftovers(name), 0);
    om_tet_mesh_done(&mesh);
}

static void test_failing_allocations_leak_nothing(void** unused) {
    (void)unused;
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    test_alloc_countdown = -1;
    om_allocator_set(&failing);
    OmTetMesh mesh;
    make_mesh(&mesh);
    const char* path = temp_path("starved.vtkhdf");
    int64_t alive = om_alloc_alive();
    int n = 0;
    for (OmStatus status = OM_NO_MEMORY; status != OM_OK; n++) {
        OmRecording* r;
        test_alloc_countdown = n;
        status = om_recording_begin(path, &mesh, NULL, 0, &r);
        if (status == OM_OK) status = om_recording_add_step(r, 0, mesh.x, NULL);
        if (r) {
            OmStatus end = om_recording_end(r);
            if (status == OM_OK) status = end;
        }
        assert_int_equal(om_alloc_alive(), alive);
        assert_int_equal(om_path_exists(path), status == OM_OK);
        assert_true(n < 100);
    }
    assert_true(n > 3);
    remove(path);
    om_tet_mesh_done(&mesh);
    om_allocator_set(NULL);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_a_run_is_read_back),
        cmocka_unit_test(test_surfaces_beside_the_mesh),
        cmocka_unit_test(test_objects_have_no_time),
        cmocka_unit_test(test_bad_input_leaves_nothing),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
