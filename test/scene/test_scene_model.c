// Patient models: the sheet over an organ, materials, messages for bad input.
#include "test_alloc.h"

#include "omentum/scene_model.h"

// ---- the sheet ----------------------------------------------------------------------------------------

// An ellipsoid of labels 7 in a field of 2.5 mm voxels, on the patient's left.
static void ellipsoid_volume(OmVolume* v) {
    enum { N = 40 };
    assert_ok(om_volume_init(v, N, N, N));
    v->grid.axis = om_mat3_scale(0.0025, om_mat3_identity());
    v->grid.origin = om_vec3(-0.06, -0.05, -0.05);
    for (int k = 0, n = 0; k < N; k++) {
        for (int j = 0; j < N; j++) {
            for (int i = 0; i < N; i++, n++) {
                OmVec3 p = om_voxel_grid_point(&v->grid, om_vec3(i, j, k));
                OmVec3 q = om_vec3((p.x + 0.02) / 0.025, p.y / 0.02, p.z / 0.04);
                ((float*)v->voxel)[n] = om_norm(q) < 1 ? 7.0f : 0.0f;
            }
        }
    }
}

static OmModelDef sheet_def(void) {
    OmModelDef def = om_model_default_def("ellipsoid", 0.0045);
    def.label[def.nlabel++] = 7;
    def.sheet.thickness = 0.008;
    def.sheet.attach[0] = (OmAttachDef){"border", "superior", 0.3, 0};
    def.sheet.attach[1] = (OmAttachDef){"underside", "random", 0.2, 5};
    def.sheet.nattach = 2;
    return def;
}

// The distance of a point to the organ's surface, by its nearest vertex.
static double to_organ(const OmPatient* p, OmVec3 x) {
    double best = HUGE_VAL;
    for (int v = 0; v < p->organ.nvert; v++) {
        double d = om_norm2(om_sub(x, om_load3(p->organ.x, v)));
        if (d < best) best = d;
    }
    return sqrt(best);
}

static void test_sheet_on_an_ellipsoid(void** unused) {
    (void)unused;
    OmVolume v;
    OmPatient p;
    OmModelReport r;
    int euler;
    ellipsoid_volume(&v);
    OmModelDef def = sheet_def();
    assert_ok(om_model_build_volume(&def, &v, NULL, &p, &r));
    printf("sheet: %d tets, volume error %.3f %%, dihedral %.1f, surface error %.3f mm; %s\n",
           r.quality.ntet, 100 * r.volume_error, r.quality.dihedral_min * 180 / OM_PI,
           r.surface_error_mean * 1e3, r.warning);
    assert_below(r.volume_error, 0.02);
    assert_true(r.quality.dihedral_min * 180 / OM_PI > 10);
    assert_int_equal(r.quality.npart, 1);
    assert_int_equal(r.quality.euler, 2);
    printf("bending error %.3f\n", r.bending_error);
    assert_true(r.quality.nlayer <= 4 && r.bending_error > 0 && r.bending_error < OM_BENDING_LIMIT);
    assert_null(strstr(r.warning, "bending"));
    assert_ok(om_surface_check_closed(&p.organ, &euler));
    const OmMeshSet* under = om_tet_mesh_find_set(&p.mesh, "underside");
    const OmMeshSet* top = om_tet_mesh_find_set(&p.mesh, "top");
    const OmMeshSet* border = om_tet_mesh_find_set(&p.mesh, "border");
    const OmMeshSet* held = om_tet_mesh_find_set(&p.mesh, "attachment");
    assert_true(under->nvert > 100 && top->nvert > 100 && border->nvert > 50);
    assert_near(held->nvert, 0.3 * border->nvert + 0.2 * under->nvert, 0.1 * border->nvert);
    // the underside lies on the organ, the top 8 mm above: half an edge for vertices and feet between
    for (int i = 0; i < under->nvert; i++) {
        assert_below(to_organ(&p, om_load3(p.mesh.x, under->vert[i])), 0.002);
    }
    for (int i = 0; i < top->nvert; i++) {
        assert_near(to_organ(&p, om_load3(p.mesh.x, top->vert[i])), 0.008, 0.0015);
    }
    // the tumour is on the organ, bulges 3 mm towards the front, and is covered
    assert_int_equal(p.nroi, 200);
    assert_near(om_distance(p.roi_center, om_vec3(-0.02, 0.023, 0)), 0, 0.003);
    for (int i = 0; i < p.nroi; i++) {
        OmVec3 x = om_load3(p.roi_point, i), n = om_load3(p.roi_normal, i);
        assert_below(to_organ(&p, x), 0.0018);  // a triangle of a 2.25 mm cell
        assert_below(om_distance(x, p.roi_center), 0.0125);
        assert_true(n.y > 0);
    }
    om_patient_done(&p);
    om_volume_done(&v);
}

// The same input makes the same mesh, to the last bit.
static void test_again(void** unused) {
    (void)unused;
    OmVolume v;
    OmPatient p, again;
    ellipsoid_volume(&v);
    OmModelDef def = sheet_def();
    def.edge = 0.008;
    assert_ok(om_model_build_volume(&def, &v, NULL, &p, NULL));
    assert_ok(om_model_build_volume(&def, &v, NULL, &again, NULL));
    assert_int_equal(p.mesh.nvert, again.mesh.nvert);
    assert_memory_equal(p.mesh.x, again.mesh.x, (size_t)p.mesh.nvert * 24);
    om_patient_done(&p);
    om_patient_done(&again);
    om_volume_done(&v);
}

static void test_bad_input_is_named(void** unused) {
    (void)unused;
    OmVolume v;
    OmPatient p;
    ellipsoid_volume(&v);
    OmModelDef def = sheet_def();
    def.label[0] = 8;
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no voxel has label 8; the volume holds 7"));
    def = sheet_def();
    def.edge = 0.009;
    snprintf(def.sheet.side, sizeof def.sheet.side, "anteriour");
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "did you mean \"anterior\""));
    def = sheet_def();
    def.edge = 0.009;
    def.sheet.tumour_shift[0] = 0.2;
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "does not lie under the sheet"));
    def = sheet_def();
    def.edge = 0;
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "edge"));
    def = sheet_def();
    def.edge = 0.009;
    def.sheet.attach[0].face[0] = 'x';
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_null(p.mesh.x);
    assert_status(om_model_build(&def, NULL, &p, NULL), OM_IO);
    om_volume_done(&v);
}

// Numbers in the wrong unit, options that nothing uses, and an empty map: the message has the numbers or the remedy.
static void test_slips_are_named(void** unused) {
    (void)unused;
    OmVolume v;
    OmPatient p;
    ellipsoid_volume(&v);
    OmModelDef def = sheet_def();
    def.sheet.thickness = 8;  // mm
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "sheet thickness: 8000 mm"));
    def = sheet_def();
    def.sheet.thickness = 0;
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "belong to a sheet"));
    def.sheet.nattach = 0;
    def.over.nattach = 1;
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "belong to a sheet"));
    def = om_model_default_def("ellipsoid", 0.0045);
    def.label[def.nlabel++] = 7;
    v.grid.axis = om_mat3_scale(1e-3, v.grid.axis);
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    // 32 voxels of 2.5 um lie inside of the longest semi-axis, 40 mm
    assert_non_null(strstr(om_error_message(), "0.08 mm long and an edge 4.5 mm"));
    memset(v.voxel, 0, om_volume_count(&v) * sizeof(float));
    def = om_model_default_def("ellipsoid", 0.0045);
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "every voxel is 0"));
    om_volume_done(&v);
}

// Two halves of a box: elements get the label of their side, and each label needs a material.
static void test_labels_become_materials(void** unused) {
    (void)unused;
    enum { N = 16 };
    OmVolume v;
    OmPatient p;
    assert_ok(om_volume_init(&v, N, N, N));
    v.grid.axis = om_mat3_scale(0.003, om_mat3_identity());
    for (int n = 0; n < N * N * N; n++) {
        int i = n % N, j = n / N % N, k = n / N / N;
        bool is_in = i > 2 && i < 13 && j > 2 && j < 13 && k > 2 && k < 13;
        ((float*)v.voxel)[n] = !is_in ? 0 : i < 8 ? 29 : 1;
    }
    OmModelDef def = om_model_default_def("halves", 0.004);
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "halves holds 2 labels, 1, 29: choose"));
    def.all_labels = true;
    def.material[def.nmaterial++] = (OmPatientMaterial){"gland", 29, 15000, 0.49, 1020};
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no material for label 1"));
    def.material[def.nmaterial++] = (OmPatientMaterial){"fat", -1, 5000, 0.49, 920};
    assert_ok(om_model_build_volume(&def, &v, NULL, &p, NULL));
    for (int e = 0; e < p.mesh.ntet; e++) {
        double x = 0;
        for (int c = 0; c < 4; c++) x += 0.25 * p.mesh.x[3 * p.mesh.tet_vert[4 * e + c]];
        assert_int_equal(p.mesh.tet_label[e], x < 7.5 * 0.003 ? 29 : 1);
    }
    om_patient_done(&p);
    om_volume_done(&v);
}

static void test_directions(void** unused) {
    (void)unused;
    OmVec3 d;
    assert_ok(om_model_direction("lateral", true, &d));
    assert_near(d.x, -1, 0);
    assert_ok(om_model_direction("medial", true, &d));
    assert_near(d.x, 1, 0);
    assert_ok(om_model_direction("0,3,4", true, &d));
    assert_near(d.z, 0.8, 1e-15);
    assert_status(om_model_direction("0,0,0", true, &d), OM_INVALID);
    assert_status(om_model_direction("up", true, &d), OM_INVALID);
}

static bool cancel(void* ctx, const char* stage, double done, double total) {
    (void)stage, (void)done, (void)total;
    return --*(int*)ctx > 0;
}

// Ctrl-C at every stage: cancelled, nothing left behind.
static void test_cancel_leaves_nothing(void** unused) {
    (void)unused;
    OmVolume v;
    OmPatient p;
    ellipsoid_volume(&v);
    OmModelDef def = sheet_def();
    def.edge = 1e-3 * test_count(9, 7);  // coarse: every stage runs, not for long
    int64_t alive = om_alloc_alive();
    int nstage = 0;
    for (OmStatus status = OM_CANCELLED; status != OM_OK; nstage += test_count(5, 1)) {
        int left = nstage;
        OmProgress progress = {cancel, &left};
        status = om_model_build_volume(&def, &v, &progress, &p, NULL);
        if (status == OM_OK)
            om_patient_done(&p);
        else
            assert_int_equal(status, OM_CANCELLED);
        assert_int_equal(om_alloc_alive(), alive);
    }
    assert_true(nstage > 4);
    om_volume_done(&v);
}

// ---- every allocation failing in turn --------------------------------------------------------------------

static void test_failing_allocations_leak_nothing(void** unused) {
    (void)unused;
    enum { N = 10 };
    OmVolume v;
    assert_ok(om_volume_init(&v, N, N, N));
    v.grid.axis = om_mat3_scale(0.008, om_mat3_identity());
    for (int n = 0; n < N * N * N; n++) {
        OmVec3 p = om_vec3(n % N - 4.5, n / N % N - 4.5, n / N / N - 4.5);
        ((float*)v.voxel)[n] = om_norm(p) < 3.5;
    }
    OmModelDef def = om_model_default_def("ball", 0.02);
    def.sheet.thickness = 0.03;
    def.sheet.bridge = 0.005;
    def.nworker = 1;
    def.refine = false;
    def.allow_loss = true;  // of the coarse sheet
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    int64_t alive = om_alloc_alive();
    om_allocator_set(&failing);
    int nfail = 0;
    for (OmStatus status = OM_NO_MEMORY; status != OM_OK;
         nfail += test_stride(200)) {  // of 300; room shape tests all
        OmPatient p;
        test_alloc_countdown = nfail;
        status = om_model_build_volume(&def, &v, NULL, &p, NULL);
        if (status == OM_OK) om_patient_done(&p);
        assert_true(status == OM_OK || status == OM_NO_MEMORY);
        assert_int_equal(om_alloc_alive(), alive);
    }
    om_allocator_set(NULL);
    assert_true(nfail > 100);
    om_volume_done(&v);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sheet_on_an_ellipsoid),
        cmocka_unit_test(test_cancel_leaves_nothing),
        cmocka_unit_test(test_failing_allocations_leak_nothing),
        cmocka_unit_test(test_bad_input_is_named),
        cmocka_unit_test(test_slips_are_named),
        cmocka_unit_test(test_directions),
        cmocka_unit_test(test_labels_become_materials),
        cmocka_slow_test(test_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
