// test_scan_file.c: scans from files: normals, thinning, poses, and a check against the model.
#include "test_alloc.h"
#include "test_files.h"

#include "scan/scan_internal.h"

#include "omentum/scan_file.h"

enum { NSIDE = 61 };

// A cap of a sphere of 40 mm around the origin, z above 10 mm, on a grid of 1 mm in x and y, without normals.
static OmPointCloud make_cap(double noise) {
    static double x[3 * NSIDE * NSIDE];
    OmRng rng = om_rng_init(3, 0);
    int n = 0;
    for (int i = 0; i < NSIDE * NSIDE; ++i) {
        double a = 1e-3 * (i % NSIDE - NSIDE / 2), b = 1e-3 * (i / NSIDE - NSIDE / 2);
        double z2 = 0.04 * 0.04 - a * a - b * b;
        if (z2 < 1e-4) continue;
        om_store3(x, n++, om_vec3(a, b, sqrt(z2) + noise * om_rng_normal(&rng)));
    }
    return (OmPointCloud){.npoint = n, .x = x};
}

static const char* save(const OmPointCloud* cloud, const char* name) {
    const char* path = temp_path(name);
    assert_ok(om_point_cloud_save(cloud, path, (OmMeshFrame){OM_UNIT_M, OM_SPACE_RAS}));
    return path;
}

static OmScan load(const char* path, const OmScanFileDef* def, OmScanFileReport* report) {
    OmScan scan;
    assert_ok(om_scan_load(path, def, &scan, report));
    assert_ok(om_scan_check(&scan));
    return scan;
}

// Angle between the normal of point i and the outward normal of the sphere, rad.
static double off_radial(const OmScan* s, int i) {
    OmVec3 radial = om_normalize(om_load3(s->x, i));
    return acos(fmax(-1, fmin(1, om_dot(radial, om_load3(s->normal, i)))));
}

static void test_normals_of_a_cap(void** state) {
    (void)state;
    OmPointCloud cap = make_cap(0);
    const char* path = save(&cap, "cap.csv");
    OmScanFileDef def = om_scan_file_default_def();
    OmScanFileReport report;
    for (int way = 0; way < 4; ++way) {  // up, down, a camera above, a camera inside
        def.up = om_vec3(0, 0, way == 1 ? -1 : 1);
        def.has_eye = way >= 2;
        def.eye = om_vec3(0, 0, way == 2 ? 1 : 0.0);
        OmScan s = load(path, &def, &report);
        assert_int_equal(s.npoint, cap.npoint);
        assert_int_equal(report.nestimated, cap.npoint);
        double worst = 0;
        for (int i = 0; i < s.npoint; ++i) {
            double off = off_radial(&s, i);
            worst = fmax(worst, way % 2 ? OM_PI - off : off);
        }
        assert_below(worst,
                     12 * OM_PI / 180);  // a plane through 16 points at the border, 4 mm away
        om_scan_done(&s);
    }
    remove(path);
}

// A whole sphere: directions agree over all of it, although half of them point down.
static void test_normals_agree(void** state) {
    (void)state;
    static double x[3 * 800];
    for (int i = 0; i < 800; ++i) {  // a spiral from pole to pole
        double z = 1 - (2 * i + 1) / 800.0, turn = i * 2.399963229728653;
        double r = sqrt(1 - z * z);
        om_store3(x, i, om_scale(0.03, om_vec3(r * cos(turn), r * sin(turn), z)));
    }
    const OmPointCloud sphere = {.npoint = 800, .x = x};
    const char* path = save(&sphere, "sphere.ply");
    OmScanFileDef def = om_scan_file_default_def();
    OmScan s = load(path, &def, NULL);
    int nout = 0;
    for (int i = 0; i < s.npoint; ++i) nout += off_radial(&s, i) < 0.2;
    assert_true(nout == 0 || nout == s.npoint);
    om_scan_done(&s);
    remove(path);
}

static void test_triangles_face_the_camera(void** state) {
    (void)state;
    OmTetMesh mesh;
    OmSurface box;
    assert_ok(om_tet_mesh_box(om_vec3(-1, -1, -1), om_vec3(1, 1, 1), 4, 4, 4, &mesh));
    assert_ok(om_tet_mesh_boundary(&mesh, &box, NULL));
    const char* path = temp_path("box.stl");
    assert_ok(om_surface_save(&box, path, OM_UNIT_M));
    OmScanFileDef def = om_scan_file_default_def();
    def.frame.unit = OM_UNIT_M;
    OmScan s = load(path, &def, NULL);
    assert_int_equal(s.npoint, box.nvert);
    assert_int_equal(s.ntri, box.ntri);
    for (int i = 0; i < s.npoint; ++i)  // of the triangles: outward
        assert_true(om_dot(om_load3(s.x, i), om_load3(s.normal, i)) > 0.8);
    om_scan_done(&s);
    def.has_eye = true;
    def.eye = om_vec3(0.1, 0.2, 0.3);  // inside
    s = load(path, &def, NULL);
    for (int t = 0; t < s.ntri; ++t) {
        const int* v = s.tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(s.x, v[0]);
        OmVec3 n = om_cross(om_sub(om_load3(s.x, v[1]), a), om_sub(om_load3(s.x, v[2]), a));
        assert_true(om_dot(n, om_sub(def.eye, a)) > 0);
    }
    for (int i = 0; i < s.npoint; ++i)
        assert_true(om_dot(om_sub(def.eye, om_load3(s.x, i)), om_load3(s.normal, i)) > 0);
    om_scan_done(&s);
    remove(path);
    om_surface_done(&box);
    om_tet_mesh_done(&mesh);
}

// A plane of 100 x 100 mm, a point a millimetre, with triangles and noise: 5 mm apart, joined, with less noise.
static void test_thinning(void** state) {
    (void)state;
    enum { N = 101 };
    OmPointCloud c = {.npoint = N * N, .ntri = 2 * (N - 1) * (N - 1)};
    c.x = malloc(3 * N * N * sizeof *c.x);
    c.tri_vert = malloc(3 * (size_t)c.ntri * sizeof *c.tri_vert);
    OmRng rng = om_rng_init(5, 0);
    for (int i = 0; i < N * N; ++i)
        om_store3(c.x, i, om_vec3(1e-3 * (i % N), 1e-3 * (i / N), 3e-4 * om_rng_normal(&rng)));
    for (int i = 0, t = 0; i < N * (N - 1); ++i) {
        if (i % N == N - 1) continue;
        const int v[6] = {i, i + 1, i + N + 1, i, i + N + 1, i + N};
        memcpy(c.tri_vert + 3 * t, v, sizeof v);
        t += 2;
    }
    const char* path = save(&c, "plane.vtp");
    OmScanFileDef def = om_scan_file_default_def();
    OmScanFileReport report;
    def.spacing = 0.005;
    def.noise = 3e-4;
    OmScan s = load(path, &def, &report);
    assert_int_equal(report.nthinned, N * N - s.npoint);
    double side = 0, square = 0;
    for (int k = 0; k < 3 * s.ntri; ++k) {
        int other = k % 3 == 2 ? k - 2 : k + 1;
        side += om_distance(om_load3(s.x, s.tri_vert[k]), om_load3(s.x, s.tri_vert[other])) /
                (3 * s.ntri);
    }
    for (int i = 0; i < s.npoint; ++i) {
        square += s.x[3 * i + 2] * s.x[3 * i + 2] / s.npoint;
        assert_true(s.normal[3 * i + 2] > 0.98);
    }
    assert_near_rel(side, def.spacing, 0.1);
    assert_near_rel(sqrt(square), s.noise, 0.15);
    assert_true(s.noise < 0.5 * def.noise);
    const OmSurface surface = {s.npoint, s.ntri, s.x, s.tri_vert};
    OmSurfaceCheck check;
    assert_ok(om_surface_check(&surface, &check));
    assert_int_equal(check.nmanifold_edge + check.nflipped_edge, 0);
    assert_int_equal(check.ncomponent, 1);
    assert_int_equal(check.neuler, 1);
    om_scan_done(&s);
    remove(path);
    free(c.x);
    free(c.tri_vert);
}

// Each direction of an edge is used once: by the triangle on its left.
static void test_edges(void** state) {
    (void)state;
    ScanEdges e;
    assert_ok(om__edges_init(&e, 4, 4));
    assert_true(om__edges_take(&e, (int[3]){0, 1, 2}));
    assert_false(om__edges_take(&e, (int[3]){0, 1, 2}));
    assert_false(om__edges_take(&e, (int[3]){3, 0, 1}));  // 0 to 1 is in use; nothing is taken
    assert_true(om__edges_take(&e, (int[3]){1, 0, 3}));
    assert_true(om__edges_take(&e, (int[3]){3, 2, 1}));
    assert_int_equal(e.n, 9);
    om__edges_done(&e);
}

// What is saved is loaded again; a pose and a unit move it.
static void test_round_trip(void** state) {
    (void)state;
    static const char* const name[3] = {"s.ply", "s.vtp", "s.csv"};
    OmPointCloud cap = make_cap(0);
    const char* first = save(&cap, "cap.ply");
    OmScanFileDef def = om_scan_file_default_def();
    OmScan a = load(first, &def, NULL);
    remove(first);
    for (int k = 0; k < 3; ++k) {
        const char* path = temp_path(name[k]);
        assert_ok(om_scan_save(&a, path, (OmMeshFrame){OM_UNIT_MM, OM_SPACE_LPS}));
        def = om_scan_file_default_def();
        OmScanFileReport report;
        OmScan b = load(path, &def, &report);
        assert_int_equal(b.npoint, a.npoint);
        assert_int_equal(report.npoint, a.npoint);
        assert_int_equal(report.nestimated + report.nduplicate + report.ndropped, 0);
        for (int i = 0; i < 3 * a.npoint; ++i) {
            assert_near(b.x[i], a.x[i], 1e-17);
            assert_near(b.normal[i], a.normal[i], 1e-15);
        }
        om_scan_done(&b);
        def.pose_world_file = (OmPose){{0.1, 0.2, 0.3}, om_quat_axis_angle(om_vec3(0, 0, 1), 0.7)};
        b = load(path, &def, NULL);
        for (int i = 0; i < a.npoint; ++i) {
            OmVec3 p = om_pose_apply(def.pose_world_file, om_load3(a.x, i));
            OmVec3 n = om_quat_rotate(def.pose_world_file.q, om_load3(a.normal, i));
            assert_near(om_distance(p, om_load3(b.x, i)), 0, 1e-15);
            assert_near(om_distance(n, om_load3(b.normal, i)), 0, 1e-14);
        }
        om_scan_done(&b);
        remove(path);
    }
    om_scan_done(&a);
}

// One normal of a file is missing: the others stay, and it agrees with them.
static void test_known_normals_stay(void** state) {
    (void)state;
    char text[8192];
    int len = snprintf(text, sizeof text, "x,y,z,nx,ny,nz\n");
    for (int i = 0; i < 100; ++i)
        len += snprintf(text + len, sizeof text - (size_t)len, "%d,%d,0,%s\n", i % 10, i / 10,
                        i == 44 ? ",," : "0,0,-1");
    const char* path = temp_path("known.csv");
    write_bytes(path, text, (size_t)len);
    OmScanFileDef def = om_scan_file_default_def();
    OmScanFileReport r;
    OmScan s = load(path, &def, &r);
    assert_int_equal(r.nestimated, 1);
    assert_int_equal(s.npoint, 100);
    for (int i = 0; i < 100; ++i) assert_near(s.normal[3 * i + 2], -1, i == 44 ? 1e-12 : 0);
    om_scan_done(&s);
    remove(path);
}

static void test_report(void** state) {
    (void)state;
    static const char text[] = "x,y,z,nx,ny,nz\n0,0,0,0,0,1\n0,0,0,0,0,1\n1,0,0,0,0,-1\n,,,,,\n";
    const char* path = temp_path("r.csv");
    write_bytes(path, text, strlen(text));
    OmScanFileDef def = om_scan_file_default_def();
    OmScanFileReport r;
    OmScan s = load(path, &def, &r);
    assert_int_equal(r.npoint, 4);
    assert_int_equal(r.nduplicate, 1);
    assert_int_equal(r.ndropped, 1);
    assert_int_equal(r.nestimated, 0);
    assert_int_equal(s.npoint, 2);
    assert_near(s.x[3], 1e-3, 1e-18);  // millimetres, where nothing is said
    assert_near(s.normal[5], -1, 0);   // normals of a file keep their direction
    om_scan_done(&s);
    def.has_eye = true;
    def.eye = om_vec3(0, 0, 1);
    s = load(path, &def, NULL);
    assert_near(s.normal[5], 1, 0);  // but for a camera
    om_scan_done(&s);
    OmScan bad;
    OmScanFileDef wrong[7];
    for (int i = 0; i < 7; ++i) wrong[i] = def;
    wrong[0].cookie = 0;
    wrong[1].frame.unit = -1;
    wrong[2].pose_world_file.q.w = 2;
    wrong[3].eye.x = NAN;
    wrong[4].up = om_vec3(0, 0, 0);
    wrong[5].spacing = -1;
    wrong[6].noise = INFINITY;
    for (int i = 0; i < 7; ++i) {
        assert_status(om_scan_load(path, &wrong[i], &bad, NULL), OM_INVALID);
        assert_null(bad.x);
    }
    remove(path);
    assert_status(om_scan_load(path, &def, &bad, NULL), OM_IO);
}

// ---- against a model ----------------------------------------------------------------------------------------------

static void move(OmScan* s, double scale, double dx) {
    for (int i = 0; i < s->npoint; ++i)
        om_store3(s->x, i, om_add(om_scale(scale, om_load3(s->x, i)), om_vec3(dx, 0, 0)));
}

static void assert_refused(OmScan* s, const OmSurface* model, double reach, const char* word) {
    assert_status(om_scan_check_model(s, model, reach, NULL), OM_INVALID);
    if (!strstr(om_error_message(), word))
        fail_msg("\"%s\" does not say \"%s\"", om_error_message(), word);
}

static void test_check_model(void** state) {
    (void)state;
    OmTetMesh mesh;
    OmSurface model;
    assert_ok(om_tet_mesh_box(om_vec3(-0.03, -0.03, 0), om_vec3(0.03, 0.03, 0.03), 2, 2, 1, &mesh));
    assert_ok(om_tet_mesh_boundary(&mesh, &model, NULL));
    OmScan s;
    assert_ok(om_scan_init(25, 0, &s));
    for (int i = 0; i < 25; ++i)
        om_store3(s.x, i, om_vec3(0.01 * (i % 5) - 0.02, 0.01 * (i / 5) - 0.02, 0.03));
    OmScanFit fit;
    assert_ok(om_scan_check_model(&s, &model, 0, &fit));
    assert_near_rel(fit.ratio, sqrt(2 * 0.04 * 0.04) / sqrt(2 * 0.06 * 0.06 + 0.03 * 0.03), 1e-12);
    assert_near(fit.gap, 0, 0);
    move(&s, 1, 0.1);  // from 0.08 on; the model ends at 0.03
    assert_ok(om_scan_check_model(&s, &model, 0.051, &fit));
    assert_near(fit.gap, 0.05, 1e-12);
    assert_refused(&s, &model, 0.049, "50.0 mm away");
    assert_ok(om_scan_check_model(&s, &model, INFINITY, NULL));
    move(&s, 1, -0.1);
    move(&s, 1000, 0);
    assert_refused(&s, &model, INFINITY, "unit");
    move(&s, 1e-6, 0);
    assert_refused(&s, &model, INFINITY, "unit");
    move(&s, 1e4, 0);
    assert_refused(&s, &model, INFINITY, "another organ");
    s.npoint = 19;
    assert_refused(&s, &model, INFINITY, "19 points");
    s.npoint = 25;
    assert_refused(&s, &model, -1, "reach");
    model.ntri = 0;
    assert_refused(&s, &model, INFINITY, "no surface");
    om_scan_done(&s);
    om_surface_done(&model);
    om_tet_mesh_done(&mesh);
}

static OmStatus load_again(void* ctx) {
    OmScanFileDef def = om_scan_file_default_def();
    def.spacing = 0.004;
    OmScan s;
    OmStatus status = om_scan_load(ctx, &def, &s, NULL);
    if (status == OM_OK) om_scan_done(&s);
    return status;
}

static void test_no_memory(void** state) {
    (void)state;
    OmPointCloud cap = make_cap(1e-4);
    char path[600];
    snprintf(path, sizeof path, "%s", save(&cap, "cap.csv"));
    assert_true(test_failing_allocations(load_again, path, 1) > 20);
    remove(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_normals_of_a_cap),
        cmocka_unit_test(test_normals_agree),
        cmocka_unit_test(test_triangles_face_the_camera),
        cmocka_unit_test(test_thinning),
        cmocka_unit_test(test_edges),
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_known_normals_stay),
        cmocka_unit_test(test_report),
        cmocka_unit_test(test_check_model),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
