// Patient models from real segmentations at 3 to 6 mm: volume, distances, topology, angles, time.
#include "model_check.h"
#include "omentum/shape_file.h"

static const double voxel = 0.003;           // m, of CT and MR
static const double edges[3] = {1, 1.5, 2};  // voxels

static void test_organs_of_the_ct(void** unused) {
    (void)unused;
    static const char* const organ[] = {
        "aorta",       "colon",        "gallbladder", "inferior_vena_cava",
        "kidney_left", "kidney_right", "liver",       "pancreas",
        "spleen",      "stomach"};
    model_table_head();
    for (size_t i = 0; i < sizeof organ / sizeof *organ; i++) {
        char name[256];
        snprintf(name, sizeof name, "ct_abdomen/organs/%s.nii.gz", organ[i]);
        for (int k = 0; k < 3; k++) {
            OmModelDef def = om_model_default_def(test_data(name), edges[k] * voxel);
            (void)model_check(organ[i], &def);
        }
    }
}

static void test_labels_of_the_mr(void** unused) {
    (void)unused;
    for (int label = 1; label <= 7; label++) {
        char name[32];
        snprintf(name, sizeof name, "mr label %d", label);
        for (int k = 0; k < 3; k++) {
            OmModelDef def =
                om_model_default_def(test_data("mr_abdomen/labels.nii.gz"), edges[k] * voxel);
            def.label[def.nlabel++] = label;
            (void)model_check(name, &def);
        }
    }
}

// Remeshed volume meshes and closed surfaces; no file states its unit, these are about decimetres.
static void test_livers(void** unused) {
    (void)unused;
    static const struct {
        const char* file;
        double unit, edge;
    } liver[] = {{"livers/liver.msh", OM_UNIT_CM, 0.004},
                 {"livers/liver2.msh", OM_UNIT_CM, 0.001},
                 {"livers/liver.obj", OM_UNIT_CM, 0.004},
                 {"livers/liver2.obj", OM_UNIT_CM, 0.001},
                 {"livers/liver-smooth.obj", OM_UNIT_CM, 0.004},
                 {"gallbladder_liver/liver_volumetric.vtk", OM_UNIT_MM, 0.006},
                 {"gallbladder_liver/gallbladder_volumetric.vtk", OM_UNIT_MM, 0.003}};
    for (size_t i = 0; i < sizeof liver / sizeof *liver; i++) {
        OmModelDef def = om_model_default_def(test_data(liver[i].file), liver[i].edge);
        def.unit = liver[i].unit;
        def.remesh = true;
        def.allow_loss = liver[i].edge == 0.006;  // 0.2 mL of 1.2 litres, told with place
        (void)model_check(strrchr(liver[i].file, '/') + 1, &def);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_organs_of_the_ct),
        cmocka_unit_test(test_labels_of_the_mr),
        cmocka_unit_test(test_livers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
