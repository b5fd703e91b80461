// test_scene_exact.c: parts of the room against values computed by hand.
#include "test_files.h"

#include "omentum/scene.h"
#include "omentum/scene_ct.h"
#include "omentum/scene_model.h"

#define MM 1e-3

// Twice the vertices: edges of at most 0.79 of the twin's, as 1 / 0.79^3 = 2.03; 0.7 is what the message proposes.
static void test_world_edge(void** state) {
    (void)state;
    static const char* const edge[] = {"7.8", "8"};
    for (int k = 0; k < 2; ++k) {
        char text[400];
        OmScene scene;
        snprintf(text, sizeof text,
                 "name: x\ndata_root: /tmp\ntissue: {source: volume, file: a.nrrd}\n"
                 "model: {label: 3, edge_mm: 10, world_edge_mm: %s}\n",
                 edge[k]);
        assert_status(om_scene_parse(text, strlen(text), "s.yaml", &scene), k ? OM_INVALID : OM_OK);
    }
    assert_non_null(strstr(om_error_message(), "say 7 or leave it out"));
}

// Voxels of 2 mm. Label 1: an L of 4 + 2 voxels, two layers high. Label 2: two voxels in a corner, and one apart.
static void test_label_boxes(void** state) {
    (void)state;
    static const char head[] =
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 6 5 4\nspace: right-anterior-superior\n"
        "space units: \"mm\" \"mm\" \"mm\"\nspace directions: (2,0,0) (0,2,0) (0,0,2)\n"
        "space origin: (0,0,0)\nencoding: raw\n\n";
    char file[sizeof head - 1 + 120];
    unsigned char value[4][5][6] = {0};
    for (int k = 1; k <= 2; ++k) {
        for (int i = 1; i <= 4; ++i) value[k][1][i] = 1;
        value[k][2][1] = value[k][3][1] = 1;
    }
    value[3][0][0] = value[3][0][1] = value[3][4][5] = 2;
    memcpy(file, head, sizeof head - 1);
    memcpy(file + sizeof head - 1, value, sizeof value);
    const char* path = temp_path("exact.nrrd");
    write_bytes(path, file, sizeof file);
    OmLabelList list;
    assert_ok(om_label_list_load(path, -1, NULL, &list));
    unlink(path);
    assert_int_equal(list.nrow, 2);
    const OmLabelRow *one = &list.row[0], *two = &list.row[1];
    assert_int_equal(one->npart, 1);
    assert_int_equal(two->npart, 2);
    assert_near_rel(one->volume, 12 * 8e-9, 1e-9);
    assert_near_rel(one->largest, 12 * 8e-9, 1e-9);
    assert_near_rel(two->largest, 2 * 8e-9, 1e-9);
    assert_true(!one->is_cut && two->is_cut);
    assert_near(om_distance(one->lo, om_vec3(1 * MM, 1 * MM, 1 * MM)), 0, 1e-9);
    assert_near(om_distance(one->hi, om_vec3(9 * MM, 7 * MM, 5 * MM)), 0, 1e-9);
    assert_near(om_distance(one->centroid, om_vec3(4 * MM, 3 * MM, 3 * MM)), 0, 1e-9);
    om_label_list_done(&list);
}

// ---- tissue on a flat organ --------------------------------------------------------------------------------

// Fat on the flat front of an organ with a disc of radius 10 mm in it; voxels of 2 mm. The disc's radius and centre in
// the model.
static double radius_of(double reach, OmVec3* center) {
    enum { N = 28, HIGH = 18 };
    OmVolume v;
    OmPatient p;
    assert_ok(om_volume_init(&v, N, HIGH, N));
    v.grid.axis = om_mat3_scale(2 * MM, om_mat3_identity());
    for (int n = 0; n < N * HIGH * N; ++n) {
        int i = n % N, j = n / N % HIGH, k = n / N / HIGH;
        bool is_organ = i > 2 && i < 25 && k > 2 && k < 25 && j > 2 && j <= 8;
        bool is_fat = i > 5 && i < 22 && k > 5 && k < 22 && j > 8 && j < 14;
        bool is_disc = is_organ && j > 5 && hypot(i - 13.5, k - 13.5) < 5;
        ((float*)v.voxel)[n] = is_disc ? 3 : is_organ ? 2 : is_fat ? 1 : 0;
    }
    OmModelDef def = om_model_default_def("flat", 6 * MM);
    def.label[def.nlabel++] = 1;
    def.over.label[def.over.nlabel++] = 2;
    def.over.label[def.over.nlabel++] = 3;
    def.over.roi = 3;
    def.over.reach = reach;
    def.refine = false;
    assert_ok(om_model_build_volume(&def, &v, NULL, &p, NULL));
    *center = p.roi_center;
    double radius = p.roi_radius;
    om_patient_done(&p);
    om_volume_done(&v);
    return radius;
}

// Its region reaches a voxel and a half beyond the disc, or as far as asked; the surface has cells of a voxel.
static void test_region(void** state) {
    (void)state;
    OmVec3 center;
    double usual = radius_of(0, &center), wide = radius_of(7 * MM, &center);
    print_message("radius %.2f mm, wide %.2f mm\n", usual / MM, wide / MM);
    assert_near(usual, 13 * MM, 1.5 * MM);
    assert_near(wide, 17 * MM, 1.5 * MM);
    assert_near(wide - usual, 4 * MM, 1 * MM);
    assert_near(om_distance(center, om_vec3(27 * MM, 17 * MM, 27 * MM)), 0, 1 * MM);
}

// ---- the rim of the fat ------------------------------------------------------------------------------------------

// Fat without ripples: 15 mm, times 1.3 sqrt(1 - (x / 20 mm)^6) near the rim.
static void test_rim(void** state) {
    (void)state;
    OmVolume ct, truth;
    OmCtDef def = om_ct_default_def(1);
    def.voxel = 1 * MM;
    def.organ_half = 30 * MM;
    def.fat_half = 20 * MM;
    def.fat_thickness = 15 * MM;
    def.fat_ripple = def.noise = def.blur = 0;
    def.tumour_shift[0] = def.tumour_shift[1] = 0;
    assert_ok(om_ct_make(&def, &ct, &truth));
    for (int x = 14; x <= 19; ++x) {
        const int at_x = (ct.grid.dim[0] - 1) / 2 + x, at_z = (ct.grid.dim[2] - 1) / 2;
        int n = 0;
        for (int j = 0; j < ct.grid.dim[1]; ++j)
            n += om_volume_value(&truth, om_grid_index(ct.grid.dim, at_x, j, at_z)) == OM_CT_FAT;
        assert_near(n, 15 * fmin(1, 1.3 * sqrt(1 - pow(x / 20.0, 6))), 1.5);
    }
    om_volume_done(&ct);
    om_volume_done(&truth);
}

// ---- a saved model ------------------------------------------------------------------------------------------------

static bool has_text(const char* path, const char* words) {
    char* text;
    size_t size;
    assert_ok(om_file_read(path, 1 << 20, &text, &size));
    char* whole = malloc(size + 1);
    memcpy(whole, text, size);
    whole[size] = 0;
    bool is_there = strstr(whole, words) != NULL;
    free(whole);
    om_free(text);
    return is_there;
}

// A box of 20 ml. A point of the ROI lies above a corner of the organ, whose grid has 2 mm: 5 + 2 x 2 mm are allowed.
static void test_saved_model(void** state) {
    (void)state;
    OmPatient p = {.name = "box", .up = {0, 0, 1}, .nmaterial = 1, .organ_spacing = 2 * MM}, q;
    OmTetMesh below;
    char dir[256], file[300];
    snprintf(dir, sizeof dir, "%s", temp_path("exact-model"));
    p.material[0] = (OmPatientMaterial){"fat", -1, 3000, 0.45, 920};
    assert_ok(
        om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(50 * MM, 40 * MM, 10 * MM), 5, 4, 1, &p.mesh));
    assert_ok(
        om_tet_mesh_box(om_vec3(0, 0, -20 * MM), om_vec3(50 * MM, 40 * MM, 0), 5, 4, 2, &below));
    assert_ok(om_tet_mesh_boundary(&below, &p.organ, NULL));
    double point[3] = {0}, normal[] = {0, 0, 1};
    p.nroi = 1;
    p.roi_point = point;
    p.roi_normal = normal;
    OmModelReport report = {.quality = {.volume = om_tet_mesh_volume(&p.mesh)}};
    report.level_shift = 0.25 * MM;
    for (int k = 0; k < 2; ++k) {
        point[2] = k ? 9.1 * MM : 8.9 * MM;
        assert_ok(om_patient_save(&p, &report, dir));
        snprintf(file, sizeof file, "%s/patient.yaml", dir);
        assert_status(om_patient_load(file, &q), k ? OM_INVALID : OM_OK);
        if (k == 0) om_patient_done(&q);
    }
    assert_non_null(strstr(om_error_message(), "lies 9.1 mm from the organ"));
    snprintf(file, sizeof file, "%s/report.json", dir);
    assert_true(has_text(file, "\"tissue_volume_ml\": 20"));
    assert_true(has_text(file, "\"level_shift_mm\": 0.25"));
    assert_ok(om_path_remove(dir));
    p.roi_point = p.roi_normal = NULL;
    om_tet_mesh_done(&below);
    om_patient_done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_world_edge),  cmocka_unit_test(test_label_boxes),
        cmocka_unit_test(test_region),      cmocka_unit_test(test_rim),
        cmocka_unit_test(test_saved_model),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
