// test_study_body.c: the phantom's outline and lesions, its meshes, and bodies from files.
#include "test_common.h"

#include "omentum/shape_file.h"
#include "omentum/shape_meshing.h"
#include "studies/study.h"

// Half an ellipsoid: 2/3 pi a b c. Lesions are inside, apart, under the surface, and the probe's way is free.
static void test_phantom(void** unused) {
    (void)unused;
    OmStudyBody* body;
    assert_ok(om_study_body_create_phantom(10, 1, &body));
    int n;
    const OmStudyLesion* l = om_study_lesions(body, &n);
    assert_int_equal(n, 10);
    double min = 1, max = 0;
    for (int i = 0; i < n; ++i) {
        assert_near(om_norm(l[i].normal), 1, 1e-12);
        assert_near(om_dot(l[i].normal, l[i].along), 0, 1e-12);
        assert_near(om_study_body_eval(body, l[i].touch), 0, 1e-12);  // on the surface
        OmVec3 d = om_sub(l[i].touch, l[i].center);
        assert_near(om_norm(om_cross(d, l[i].normal)), 0, 1e-12);  // under the middle of the probe
        min = fmin(min, om_norm(d)), max = fmax(max, om_norm(d));
        assert_true(l[i].radius >= 0.0025 && l[i].radius <= 0.005);
        assert_true(om_norm(d) > l[i].radius);
        assert_true(om_dot(om_vec3(0, 0, 1), l[i].normal) > 0.8);
        // at 30 mm the probe is still 20 mm from the base, all of its face
        for (int k = 0; k < 4; ++k) {
            OmVec3 wide = om_cross(l[i].normal, l[i].along);
            OmVec3 p = om_madd(l[i].touch, k & 1 ? 0.025 : -0.025, l[i].along);
            p = om_madd(om_madd(p, k & 2 ? 0.005 : -0.005, wide), -0.030, l[i].normal);
            if (!(p.z > 0.020))
                fail_msg("lesion %d: the probe ends %.1f mm over the base", i, 1e3 * p.z);
        }
        for (int k = 0; k < i; ++k)
            assert_true(om_distance(l[i].center, l[k].center) > l[i].radius + l[k].radius);
    }
    assert_true(min < 0.013 && max > 0.032);
    om_study_body_destroy(body);
    assert_status(om_study_body_create_phantom(0, 1, &body), OM_INVALID);
    assert_null(body);
}

static void test_meshes(void** unused) {
    (void)unused;
    OmStudyBody* body;
    assert_ok(om_study_body_create_phantom(10, 1, &body));
    const int wanted[] = {623, 1363, 2539, 4126, 7369, 12861};
    double exact = 2.0 / 3 * OM_PI * 0.075 * 0.060 * 0.072, last = 1;
    for (int k = 0; k < 6; ++k) {
        OmTetMesh mesh;
        assert_ok(om_study_body_mesh(body, wanted[k], 2, &mesh));
        assert_ok(om_tet_mesh_validate(&mesh));
        // whole lattice cells: 8 % is the worst of the coarse ones
        assert_near_rel(mesh.ntet, wanted[k], 0.08);
        double off = fabs(om_tet_mesh_volume(&mesh) / exact - 1);
        printf("%6d elements for %6d, %d vertices, volume off by %.2f %%\n", mesh.ntet, wanted[k],
               mesh.nvert, 100 * off);
        assert_below(off, fmin(0.08, 1.5 * last));  // chords: second order in the edge
        last = off;
        const OmMeshSet* set = om_tet_mesh_find_set(&mesh, "attachment");
        assert_non_null(set);
        assert_true(set->nvert > 10);
        for (int i = 0; i < set->nvert; ++i)
            assert_near(mesh.x[3 * set->vert[i] + 2], 0, 1e-5);  // the mesher ends its search there
        om_tet_mesh_done(&mesh);
    }
    OmTetMesh mesh;
    assert_status(om_study_body_mesh(body, 10, 1, &mesh), OM_INVALID);
    om_study_body_destroy(body);
}

// A body read from a file is the same body.
static void test_file(void** unused) {
    (void)unused;
    OmStudyBody *body, *read;
    OmTetMesh mesh, again;
    char dir[] = "/tmp/om_study_XXXXXX", path[64], sites[64];
    assert_non_null(mkdtemp(dir));
    snprintf(path, sizeof path, "%s/body.vtu", dir);
    snprintf(sites, sizeof sites, "%s/sites.txt", dir);
    assert_ok(om_study_body_create_phantom(4, 1, &body));
    assert_ok(om_study_body_mesh(body, 12861, 2, &mesh));
    assert_ok(om_tet_mesh_save(&mesh, path, OM_UNIT_MM));
    int n;
    const OmStudyLesion* l = om_study_lesions(body, &n);
    OmText text = {0};
    assert_ok(om_text_append(&text, "# x y z radius\n\n"));
    for (int i = 0; i < n; ++i)
        assert_ok(om_text_append(&text, "%.6f, %.6f %.6f %.3f # lesion\n", 1e3 * l[i].center.x,
                                 1e3 * l[i].center.y, 1e3 * l[i].center.z, 1e3 * l[i].radius));
    assert_ok(om_file_write(sites, text.str, text.len));
    assert_ok(om_study_body_load(path, OM_UNIT_MM, sites, OM_UNIT_MM, om_vec3(0, 0, 0), &read));
    int m;
    const OmStudyLesion* r = om_study_lesions(read, &m);
    assert_int_equal(n, m);
    for (int i = 0; i < n; ++i) {
        assert_near(om_distance(l[i].center, r[i].center), 0, 1e-8);
        assert_near(l[i].radius, r[i].radius, 1e-6);
        // the normal is that above the lesion, not that of the nearest point: some degrees apart
        assert_true(om_dot(l[i].normal, r[i].normal) > cos(0.35));
        assert_near(om_study_body_eval(body, r[i].touch), 0, 2e-3);
    }
    assert_ok(om_study_body_mesh(read, 4126, 2, &again));
    assert_near_rel(om_tet_mesh_volume(&again), om_tet_mesh_volume(&mesh), 0.03);
    assert_non_null(om_tet_mesh_find_set(&again, "attachment"));
    om_study_body_destroy(read);
    // messages name file and line
    assert_ok(om_file_write(sites, "0 0 500\n", 8));
    assert_status(om_study_body_load(path, OM_UNIT_MM, sites, OM_UNIT_MM, om_vec3(0, 0, 1), &read),
                  OM_INVALID);
    assert_non_null(strstr(om_error_message(), "none of 1 lesions is inside"));
    assert_ok(om_file_write(sites, "0 0 5\n0 0 50\n0 0 3\n", 19));
    assert_ok(om_study_body_load(path, OM_UNIT_MM, sites, OM_UNIT_CM, om_vec3(0, 0, 1), &read));
    om_study_lesions(read, &m);
    assert_int_equal(m, 2);
    assert_int_equal(om_study_count_outside(read), 1);
    // 0.6 of the 72 mm between the top of the phantom and its base, which is held
    assert_near(om_study_lesions(read, &m)[0].max, 0.6 * 0.072, 0.002);
    om_study_body_destroy(read);
    assert_ok(om_file_write(sites, "0 0 30\n1 2\n", 11));
    assert_status(om_study_body_load(path, OM_UNIT_MM, sites, OM_UNIT_MM, om_vec3(0, 0, 1), &read),
                  OM_INVALID);
    assert_non_null(strstr(om_error_message(), "sites.txt:2"));
    om_text_done(&text);
    om_tet_mesh_done(&mesh);
    om_tet_mesh_done(&again);
    om_study_body_destroy(body);
    assert_ok(om_path_remove(dir));
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_phantom),
        cmocka_unit_test(test_meshes),
        cmocka_unit_test(test_file),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
