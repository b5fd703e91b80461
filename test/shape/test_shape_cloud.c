// test_shape_cloud.c: clouds of points from tables, PLY and VTP.
#include "shape_file_common.h"
#include "test_alloc.h"

#include "omentum/shape_cloud.h"

static OmStatus load_text(const char* name, const char* text, OmPointCloud* cloud) {
    const char* path = temp_path(name);
    write_bytes(path, text, strlen(text));
    OmStatus status =
        om_point_cloud_load(path, (OmMeshFrame){OM_UNIT_M, OM_SPACE_RAS}, cloud, NULL);
    remove(path);
    return status;
}

static void assert_point(const OmPointCloud* cloud, int i, double x, double y, double z) {
    assert_near(cloud->x[3 * i], x, 0);
    assert_near(cloud->x[3 * i + 1], y, 0);
    assert_near(cloud->x[3 * i + 2], z, 0);
}

static void test_tables(void** state) {
    (void)state;
    static const char* const table[] = {
        "x,y,z\n1,2,3\n4.5,-5e-1,6\n", "X;Y;Z\r\n1;2;3\r\n4.5;-.5;6\r\n",
        "x\ty\tz\n1\t2\t3\n4.5\t-0.5\t6",
        "\xef\xbb\xbf# a comment\n\nname, z ,\"y\",x\n\"a\", 3, \"2\" ,1\nb,6,-0.5,4.5\n\n",
        "\"Points:0\",\"Points:1\",\"Points:2\",\"p\"\n1,2,3,9\n4.5,-0.5,6,9\n"};
    for (int k = 0; k < 5; ++k) {
        OmPointCloud c;
        assert_ok(load_text("cloud.csv", table[k], &c));
        assert_int_equal(c.npoint, 2);
        assert_int_equal(c.ntri + c.nduplicate + c.ndropped, 0);
        assert_null(c.normal);
        assert_point(&c, 0, 1, 2, 3);
        assert_point(&c, 1, 4.5, -0.5, 6);
        om_point_cloud_done(&c);
    }
}

static void test_bad_tables(void** state) {
    (void)state;
    static const char* const bad[][2] = {
        {"", "empty"},
        {"# nothing\n", "empty"},
        {"x,y,z\n", "no points"},
        {"1,2,3\n4,5,6\n", "must name the columns"},
        {"x,y\n1,2\n", "z is missing"},
        {"x y z\n1 2 3\n", "comma, semicolon or tab"},
        {"x,y,z,nx,ny\n1,2,3,0,0\n", "nx, ny and nz"},
        {"x;y;z\n1,5;2,5;3,5\n", "line 2: \"1,5\" has a decimal comma"},
        {"x,y,z\n1,2,3\n1,5,2,5,3,5\n", "line 3: 6 values under 3 column names: a decimal comma?"},
        {"x,y,z\n1,2\n", "line 2: 2 values under 3"},
        {"x,y,z\n1,2,three\n", "\"three\" is no number"},
        {"x,y,z\n1,2,\n,,\nnan,0,0\n", "none of its 3 points is finite"}};
    for (int k = 0; k < (int)(sizeof bad / sizeof bad[0]); ++k) {
        OmPointCloud c;
        assert_status(load_text("bad.csv", bad[k][0], &c), OM_INVALID);
        if (!strstr(om_error_message(), bad[k][1]) || !strstr(om_error_message(), "bad.csv"))
            fail_msg("\"%s\" does not say \"%s\"", om_error_message(), bad[k][1]);
        assert_null(c.x);
    }
}

// Points that are not finite are left out and counted, equal points merged and counted.
static void test_drop_and_merge(void** state) {
    (void)state;
    OmPointCloud c;
    assert_ok(load_text("c.csv",
                        "x,y,z,nx,ny,nz\n0,0,0,0,0,2\n1,0,0,,,\nnan,0,0,0,0,1\n0,1,0,0,0,0\n"
                        "1,0,0,0,3,0\n-0,0,0,1,0,0\n5,5,inf,1,0,0\n",
                        &c));
    assert_int_equal(c.npoint, 3);
    assert_int_equal(c.nduplicate, 2);
    assert_int_equal(c.ndropped, 2);
    assert_point(&c, 1, 1, 0, 0);
    assert_point(&c, 2, 0, 1, 0);
    const double normal[9] = {0, 0, 1, 0, 1, 0, 0, 0, 0};  // of length 1; the first that is known
    for (int i = 0; i < 9; ++i) assert_near(c.normal[i], normal[i], 1e-15);
    om_point_cloud_done(&c);
    assert_ok(load_text("c.ply",
                        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float "
                        "y\nproperty float z\nelement face 3\nproperty list uchar int "
                        "vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\nnan 0 0\n1 0 0\n"
                        "3 0 1 2\n3 0 1 3\n3 0 1 4\n",
                        &c));
    assert_int_equal(c.npoint, 3);
    assert_int_equal(c.ndropped, 1);
    assert_int_equal(c.nduplicate, 1);
    assert_int_equal(c.ntri, 1);
    om_point_cloud_done(&c);
}

static void test_vtp(void** state) {
    (void)state;
    static const char text[] =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
        "byte_order=\"LittleEndian\">\n<PolyData>\n<Piece NumberOfPoints=\"5\" NumberOfVerts=\"1\" "
        "NumberOfLines=\"0\" NumberOfStrips=\"1\" NumberOfPolys=\"1\">\n<PointData "
        "Normals=\"Normals\">\n<DataArray type=\"Float32\" Name=\"Normals\" "
        "NumberOfComponents=\"3\" format=\"ascii\">0 0 1 0 0 1 0 0 1 0 2 0 0 0 0</DataArray>\n"
        "<DataArray type=\"UInt8\" Name=\"flag\" format=\"ascii\">1 2 3 4 5</DataArray>\n"
        "</PointData>\n<Points>\n<DataArray type=\"Float64\" NumberOfComponents=\"3\" "
        "format=\"ascii\">0 0 0 1 0 0 1 1 0 0 1 0 2 2 0</DataArray>\n</Points>\n<Verts>\n"
        "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">4</DataArray>\n"
        "<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">1</DataArray>\n</Verts>\n"
        "<Strips>\n<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 3 2"
        "</DataArray>\n<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>\n"
        "</Strips>\n<Polys>\n<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 "
        "3</DataArray>\n<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>\n"
        "</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n";
    OmPointCloud c;
    assert_ok(load_text("c.vtp", text, &c));
    assert_int_equal(c.npoint, 5);
    assert_int_equal(c.ntri, 4);  // a polygon of four, a strip of two
    const int tri[12] = {0, 1, 2, 0, 2, 3, 0, 1, 3, 3, 1, 2};
    assert_memory_equal(c.tri_vert, tri, sizeof tri);
    assert_near(c.normal[3 * 3 + 1], 1, 1e-15);
    assert_near(c.normal[3 * 4 + 2], 0, 0);
    om_point_cloud_done(&c);
    OmSurface s;  // the same file is a surface
    const char* path = temp_path("c.vtp");
    write_bytes(path, text, strlen(text));
    assert_ok(om_surface_load(path, OM_UNIT_M, &s));
    remove(path);
    assert_int_equal(s.nvert, 4);
    assert_int_equal(s.ntri, 4);
    om_surface_done(&s);
    static const char* const bad[][2] = {
        {"<VTKFile type=\"UnstructuredGrid\"></VTKFile>", "PolyData is wanted"},
        {"<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"1\" NumberOfStrips=\"-1\">"
         "</Piece></PolyData></VTKFile>",
         "a piece of"},
        {"<VTKFile type=\"PolyData\"></VTKFile>", "no piece"},
        {"x", "no VTK XML file"}};
    for (int k = 0; k < 4; ++k) {
        assert_status(load_text("bad.vtp", bad[k][0], &c), OM_INVALID);
        if (!strstr(om_error_message(), bad[k][1]))
            fail_msg("\"%s\" does not say \"%s\"", om_error_message(), bad[k][1]);
    }
}

static OmPointCloud make_cloud(bool has_normal) {
    static double x[60], normal[60];
    static int tri[9] = {0, 1, 2, 5, 4, 3, 19, 7, 11};
    OmRng rng = om_rng_init(7, 0);
    for (int i = 0; i < 20; ++i) {
        OmVec3 n = om_vec3(om_rng_normal(&rng), om_rng_normal(&rng), om_rng_normal(&rng));
        om_store3(normal, i, i == 4 ? om_vec3(0, 0, 0) : om_normalize(n));
        om_store3(x, i,
                  om_vec3(om_rng_normal(&rng), om_rng_normal(&rng) * 1e-3, om_rng_normal(&rng)));
    }
    return (OmPointCloud){
        .npoint = 20, .ntri = 3, .x = x, .normal = has_normal ? normal : NULL, .tri_vert = tri};
}

// What is written is read again, by what the file states, in every unit and space.
static void test_round_trip(void** state) {
    (void)state;
    static const char* const name[3] = {"c.ply", "c.vtp", "c.csv"};
    static const OmMeshFrame frame[3] = {
        {OM_UNIT_M, OM_SPACE_RAS}, {OM_UNIT_MM, OM_SPACE_LPS}, {0.37, OM_SPACE_NONE}};
    for (int k = 0; k < 18; ++k) {
        const OmPointCloud out = make_cloud(k % 2);
        const OmMeshFrame f = frame[k / 6];
        const char* path = temp_path(name[k / 2 % 3]);
        assert_ok(om_point_cloud_save(&out, path, f));
        OmPointCloud in;
        OmMeshFrame stated;
        assert_ok(om_point_cloud_load(path, (OmMeshFrame){0}, &in, &stated));
        assert_near(stated.unit, f.unit, 0);
        assert_int_equal(stated.space, f.space == OM_SPACE_LPS ? OM_SPACE_LPS : OM_SPACE_RAS);
        assert_int_equal(in.npoint, out.npoint);
        assert_int_equal(in.ntri, k / 2 % 3 == 2 ? 0 : out.ntri);
        assert_memory_equal(in.tri_vert, out.tri_vert, 3 * (size_t)in.ntri * sizeof(int));
        assert_true((in.normal != NULL) == (out.normal != NULL));
        for (int i = 0; i < 60; ++i) {
            // three roundings: one over the unit, times it, times the unit
            assert_near(in.x[i], out.x[i], 4e-16 * fabs(out.x[i]));
            if (in.normal) assert_near(in.normal[i], out.normal[i], 3e-16);
        }
        om_point_cloud_done(&in);
        remove(path);
    }
    const OmPointCloud out = make_cloud(true);
    assert_status(om_point_cloud_save(&out, temp_path("c.xyz"), frame[0]), OM_INVALID);
    assert_status(om_point_cloud_save(&out, temp_path("c.ply"), (OmMeshFrame){0}), OM_INVALID);
}

// The corners of an STL file's triangles are not duplicates.
static void test_surface_files(void** state) {
    (void)state;
    OmTetMesh mesh;
    OmSurface s;
    OmPointCloud c;
    make_mesh(&mesh);
    assert_ok(om_tet_mesh_boundary(&mesh, &s, NULL));
    static const char* const name[] = {"s.stl", "s.obj", "s.off"};
    for (int k = 0; k < 3; ++k) {
        assert_ok(om_surface_save(&s, temp_path(name[k]), OM_UNIT_M));
        assert_ok(om_point_cloud_load(temp_path(name[k]), (OmMeshFrame){OM_UNIT_M, 0}, &c, NULL));
        assert_int_equal(c.npoint, s.nvert);
        assert_int_equal(c.ntri, s.ntri);
        assert_int_equal(c.nduplicate, 0);
        om_point_cloud_done(&c);
        remove(temp_path(name[k]));
    }
    om_surface_done(&s);
    om_tet_mesh_done(&mesh);
    assert_status(om_point_cloud_load("cloud.xyz", (OmMeshFrame){0}, &c, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), ".csv"));
    assert_status(om_surface_load("cloud.csv", OM_UNIT_M, &s), OM_INVALID);
}

static OmStatus load_again(void* ctx) {
    OmPointCloud c;
    OmStatus status = om_point_cloud_load(ctx, (OmMeshFrame){0}, &c, NULL);
    if (status == OM_OK) om_point_cloud_done(&c);
    return status;
}

static OmStatus save_again(void* ctx) {
    const OmPointCloud out = make_cloud(true);
    return om_point_cloud_save(&out, ctx, (OmMeshFrame){OM_UNIT_M, OM_SPACE_LPS});
}

static void test_no_memory(void** state) {
    (void)state;
    static const char* const name[3] = {"c.ply", "c.vtp", "c.csv"};
    for (int k = 0; k < 3; ++k) {
        char path[1024];
        snprintf(path, sizeof path, "%s", temp_path(name[k]));
        assert_true(test_failing_allocations(save_again, path, 1) > 3);
        assert_true(test_failing_allocations(load_again, path, 1) > 6);
        remove(path);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tables),         cmocka_unit_test(test_bad_tables),
        cmocka_unit_test(test_drop_and_merge), cmocka_unit_test(test_vtp),
        cmocka_unit_test(test_round_trip),     cmocka_unit_test(test_surface_files),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
