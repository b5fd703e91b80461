// test_scene_bend.c: the bending error of a mesh against that of the whole mesh refined once, computed apart (quadratic
// elements, the half beyond the middle held, a weight across, Cholesky): 0.1269, 0.0581, 0.0259 and 0.0139.
#include "omentum/scene_model.h"
#include "omentum/shape_meshing.h"
#include "test_alloc.h"

static OmPatient make_patient(void) {
    OmPatient p = {.nmaterial = 1};
    p.material[0] =
        (OmPatientMaterial){.label = -1, .young = 3000, .poisson = 0.45, .density = 1000};
    return p;
}

static double bend_box(double width, double height, int nx, int ny, int nz, double length) {
    OmPatient p = make_patient();
    double error;
    assert_ok(om_tet_mesh_box(om_vec3(-0.5 * length, -0.5 * width, 0),
                              om_vec3(0.5 * length, 0.5 * width, height), nx, ny, nz, &p.mesh));
    assert_ok(om_patient_find_bending_error(&p, &error));
    om_patient_done(&p);
    return error;
}

// Two cells wide: the strip is the whole mesh, so only the weight's direction differs, by a thousandth.
static void test_whole_strip(void** unused) {
    (void)unused;
    assert_near(bend_box(0.02, 0.005, 12, 2, 1, 0.12), 0.1269, 3e-4);
}

// The sides of the strip cut through cells.
static void test_plate(void** unused) {
    (void)unused;
    assert_near(bend_box(0.12, 0.005, 24, 24, 1, 0.12), 0.0581, 0.005);
}

static void test_block(void** unused) {
    (void)unused;
    assert_near(bend_box(0.04, 0.04, 6, 4, 4, 0.06), 0.0259, 0.005);
}

static double box_fn(void* ctx, OmVec3 p) {
    const OmVec3* half = ctx;
    return fmax(fabs(p.x) - half->x, fmax(fabs(p.y) - half->y, fabs(p.z) - half->z));
}

// 100 x 80 x 6 mm in edges of 5 mm, whose sides are jagged: an upper estimate.
static void test_unstructured_sheet(void** unused) {
    (void)unused;
    OmPatient p = make_patient();
    OmVec3 half = om_vec3(0.05, 0.04, 0.003);
    double error;
    OmStuffDef def = om_stuff_default_def(0.005, box_fn, &half, om_scale(-1, half), half);
    def.nworker = 1;
    assert_ok(om_tet_mesh_stuff(&def, &p.mesh));
    assert_ok(om_tet_mesh_keep_parts(&p.mesh, 0, NULL, NULL));
    assert_ok(om_patient_find_bending_error(&p, &error));
    assert_true(error > 0.0139 && error < 1.5 * 0.0139);
    om_patient_done(&p);
}

// Neither the scale of the moduli, nor density, nor size matters; Poisson's ratio does.
static void test_scales(void** unused) {
    (void)unused;
    OmPatient p = make_patient();
    double error, other;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.06, 0.02, 0.005), 6, 2, 1, &p.mesh));
    assert_ok(om_patient_find_bending_error(&p, &error));
    p.material[0].young *= 7, p.material[0].density *= 2;
    for (int i = 0; i < 3 * p.mesh.nvert; ++i) p.mesh.x[i] *= 3;
    assert_ok(om_patient_find_bending_error(&p, &other));
    assert_near(other, error, 1e-6);
    p.material[0].poisson = 0.2;
    assert_ok(om_patient_find_bending_error(&p, &other));
    assert_true(other < 0.9 * error);
    // a label without material
    p.material[0].label = 3;
    assert_status(om_patient_find_bending_error(&p, &other), OM_INVALID);
    om_patient_done(&p);
}

// One element cannot bend.
static void test_one_element(void** unused) {
    (void)unused;
    OmPatient p = make_patient();
    const double x[12] = {0, 0, 0, 0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01};
    double error;
    assert_ok(om_tet_mesh_init(&p.mesh, 4, 1));
    for (int i = 0; i < 12; ++i) p.mesh.x[i] = x[i];
    for (int i = 0; i < 4; ++i) p.mesh.tet_vert[i] = i;
    p.mesh.tet_label[0] = 0;
    assert_ok(om_patient_find_bending_error(&p, &error));
    assert_near(error, 1, 0);
    om_patient_done(&p);
}

static OmStatus find_error(void* ctx) {
    double error;
    return om_patient_find_bending_error(ctx, &error);
}

static void test_memory(void** unused) {
    (void)unused;
    OmPatient p = make_patient();
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.03, 0.01, 0.005), 3, 1, 1, &p.mesh));
    assert_true(test_failing_allocations(find_error, &p, test_stride(2)) > 10);
    om_patient_done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_whole_strip), cmocka_unit_test(test_plate),
        cmocka_unit_test(test_block),       cmocka_unit_test(test_unstructured_sheet),
        cmocka_unit_test(test_scales),      cmocka_unit_test(test_one_element),
        cmocka_unit_test(test_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
