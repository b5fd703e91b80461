// Every organ at edges of 0.8 to 1.5 voxels, the fat of the body, the breasts at 0.2 mm, and 50,000 tetrahedra
// in 5 s: minutes of work.
#include "model_check.h"

static const double voxel = 0.003;  // m, of CT and MR

static void sweep(const char* title, const OmModelDef* at_voxel) {
    static const double share[] = {0.8, 1.0, 1.25, 1.5};
    for (int e = 0; e < 4; e++) {
        OmModelDef def = *at_voxel;
        def.edge = share[e] * voxel;
        (void)model_check(title, &def);
    }
}

static void test_masks_of_the_ct(void** unused) {
    (void)unused;
    static const char* const file[] = {"organs/aorta",         "organs/colon",
                                       "organs/gallbladder",   "organs/inferior_vena_cava",
                                       "organs/kidney_left",   "organs/kidney_right",
                                       "organs/liver",         "organs/pancreas",
                                       "organs/spleen",        "organs/stomach",
                                       "fat/subcutaneous_fat", "fat/torso_fat"};
    model_table_head();
    for (size_t i = 0; i < sizeof file / sizeof *file; i++) {
        char name[256];
        snprintf(name, sizeof name, "ct_abdomen/%s.nii.gz", file[i]);
        OmModelDef def = om_model_default_def(test_data(name), voxel);
        sweep(strchr(file[i], '/') + 1, &def);
    }
}

// All parts, not only the largest, of what is in pieces.
static void test_organs_in_pieces(void** unused) {
    (void)unused;
    static const char* const organ[] = {"pancreas", "colon", "stomach"};
    for (int i = 0; i < 3; i++) {
        char name[256];
        snprintf(name, sizeof name, "ct_abdomen/organs/%s.nii.gz", organ[i]);
        OmModelDef def = om_model_default_def(test_data(name), voxel);
        def.keep_all = true;
        snprintf(name, sizeof name, "%s, all parts", organ[i]);
        sweep(name, &def);
    }
}

static void test_labels_of_the_mr(void** unused) {
    (void)unused;
    for (int label = 1; label <= 7; label++) {
        char name[32];
        snprintf(name, sizeof name, "mr label %d", label);
        OmModelDef def = om_model_default_def(test_data("mr_abdomen/labels.nii.gz"), voxel);
        def.label[def.nlabel++] = label;
        sweep(name, &def);
    }
}

// The union of ten tissues, free and compressed between paddles; volumes as counted in the voxels.
static void test_breasts(void** unused) {
    (void)unused;
    static const int label[] = {1, 2, 29, 33, 40, 88, 95, 125, 150, 225};
    static const struct {
        const char* file;
        double volume;  // m^3
    } breast[] = {{"breast_victre/p_1.nhdr", 257618e-9}, {"breast_victre/pc_1.nhdr", 256225e-9}};
    for (int b = 0; b < 2; b++) {
        for (int e = 0; e < 3; e++) {
            OmModelDef def = om_model_default_def(test_data(breast[b].file), 0.003 + 0.002 * e);
            for (size_t i = 0; i < sizeof label / sizeof *label; i++) {
                def.label[def.nlabel++] = label[i];
            }
            double volume = model_check(strchr(breast[b].file, '/') + 1, &def);
            assert_near_rel(volume, breast[b].volume, 0.005);  // less the parts left out
        }
    }
}

static void test_fifty_thousand_in_five_seconds(void** unused) {
    (void)unused;
    OmPatient p;
    OmModelReport r;
    OmModelDef def = om_model_default_def(test_data("ct_abdomen/organs/spleen.nii.gz"), 0.0036);
    assert_ok(om_model_build(&def, NULL, &p, &r));
    printf("%d tetrahedra in %.2f s\n", r.quality.ntet, r.seconds);
    assert_true(r.quality.ntet > 50000);
    assert_below(r.seconds, 5);
    om_patient_done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_masks_of_the_ct),
        cmocka_unit_test(test_organs_in_pieces),
        cmocka_unit_test(test_labels_of_the_mr),
        cmocka_unit_test(test_breasts),
        cmocka_unit_test(test_fifty_thousand_in_five_seconds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
