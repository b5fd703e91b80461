// test_study_truth.c: the truth and the runs of the contact study compared with each other and with exact values:
// two codes of their own (quadratic tetrahedra under a smooth pressure, linear ones under penalty) press alike.
#include "test_files.h"

#include "studies/study_internal.h"

static char dir[] = "/tmp/om_truth_XXXXXX";
static OmStudyBody* body;

// The lesion that lies nearest to the probe, over a coarse phantom; 1 to 5 mm deep.
static OmStudyContactDef small_def(void) {
    OmStudyContactDef def = om_study_contact_default_def(body, dir);
    def.nresolution = 1;
    def.resolution[0] = 900;
    def.nlesion = 1;
    def.truth_ntet = 900;
    def.time_step = 0.05;
    def.contact_ntri = 900;
    for (int i = 0; i < OM_STUDY_NDEPTH; ++i) def.depth[i] = 0.001 * (i + 1);
    def.nworker = 1;
    return def;
}

static StudyTruthResult solve(const OmStudyContactDef* def) {
    OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);
    shape.rounding = PROBE_ROUNDING;
    OmProbe* probe;
    StudyTruth* truth;
    StudyTruthResult r = {0};
    assert_ok(om_probe_create(&shape, &probe));
    assert_ok(om__study_truth_create(def, probe, &truth));
    assert_ok(om__study_truth_solve(truth, 0, NULL, &r));
    assert_int_equal(r.ndepth, OM_STUDY_NDEPTH);
    om__study_truth_destroy(truth);
    om_probe_destroy(probe);
    return r;
}

// A stiffer lesion makes the body stiffer and keeps its own shape better, as far as a coarse mesh tells; of the body's
// modulus it is no lesion.
static void test_lesions_are_stiff(void** unused) {
    (void)unused;
    OmStudyContactDef def = small_def();
    double force[2], squeeze[2];
    for (int k = 0; k < 2; ++k) {
        def.lesion_ratio = k ? 50 : 1;
        StudyTruthResult r = solve(&def);
        const StudyTruthDepth* at = &r.at[OM_STUDY_NDEPTH - 1];
        force[k] = at->force;
        squeeze[k] = body->lesion[0].radius - om_distance(at->contour, at->fine);
        printf("lesion %g times as stiff: %.4f N, its upper half squeezed by %.4f mm\n",
               def.lesion_ratio, force[k], 1e3 * squeeze[k]);
    }
    assert_true(force[1] > 1.02 * force[0]);
    assert_true(squeeze[0] > 0 && squeeze[1] < 0.75 * squeeze[0]);
}

// The runs know no lesions: their force is that of a truth without them, but that linear tetrahedra of this size lock
// (Poisson's ratio 0.45), so they are stiffer, and a patch that is glued to the probe more so than one that slides.
static void test_forces_of_two_codes(void** unused) {
    (void)unused;
    OmStudyContactDef def = small_def();
    def.lesion_ratio = 1;
    StudyTruthResult truth = solve(&def);
    OmStudyContactSummary sum;
    assert_ok(om_study_contact_run(&def, NULL, &sum));
    assert_int_equal(sum.ncomplete, 3);
    char *text, *rest, path[128];
    size_t size;
    snprintf(path, sizeof path, "%s/runs.csv", dir);
    assert_ok(om_file_read(path, 1 << 20, &text, &size));
    strtok_r(text, "\n", &rest);
    double wanted = truth.at[OM_STUDY_NDEPTH - 1].force, force[OM_STUDY_NMETHOD];
    for (int k = 0; k < OM_STUDY_NMETHOD; ++k) {
        char* row = strtok_r(NULL, "\n", &rest);
        assert_non_null(row);
        int n = sscanf(row, "%*[^,],%*d,%*d,%*d,%*d,%*d,%*f,%*f,%*f,%*f,%*f,%*d,%lf", &force[k]);
        assert_int_equal(n, 1);
        printf("%s: %.4f N, truth %.4f N\n", om__study_method_name[k], force[k], wanted);
    }
    assert_true(force[OM_PRESS_PENALTY] > wanted && force[OM_PRESS_PENALTY] < 2 * wanted);
    assert_near_rel(force[OM_PRESS_MULTIPLIERS], force[OM_PRESS_PENALTY], 0.02);
    assert_true(force[OM_PRESS_PRESCRIBED] > force[OM_PRESS_PENALTY]);
    assert_true(force[OM_PRESS_PRESCRIBED] < 5 * wanted);
    om_free(text);
}

// A step that misses the residual or lets the probe in too far ends the path, and says why.
static void test_steps_that_do_not_count(void** unused) {
    (void)unused;
    OmStudyContactDef def = small_def();
    for (int k = 0; k < 2; ++k) {
        def = small_def();
        def.density = 1001 + k;  // other runs
        if (k == 0) def.max_penetration = 1e-7;
        if (k == 1) def.max_iterations = 2;
        for (int m = 0; m < OM_STUDY_NMETHOD; ++m) def.has_method[m] = m == OM_PRESS_PENALTY;
        OmStudyContactSummary sum;
        assert_ok(om_study_contact_run(&def, NULL, &sum));
        assert_int_equal(sum.ncomplete, 0);
        assert_true(sum.worst_stability < 1);
        char *text, path[128];
        size_t size;
        snprintf(path, sizeof path, "%s/runs.csv", dir);
        assert_ok(om_file_read(path, 1 << 20, &text, &size));
        assert_non_null(strstr(text, k == 0 ? "\"penetration 0." : "\"residual "));
        om_free(text);
    }
}

static int begin(void** unused) {
    (void)unused;
    char meshes[64];
    if (!mkdtemp(dir)) return 1;
    snprintf(meshes, sizeof meshes, "%s/meshes", dir);
    OmFolder folder;  // with its list, as the study leaves it
    if (om_folder_open(dir, "contact study", &folder) < 0) return 1;
    om_folder_end(&folder);
    return om_path_make_dir(meshes) == OM_OK && om_study_body_create_phantom(10, 1, &body) == OM_OK
               ? 0
               : 1;
}
static int end(void** unused) {
    (void)unused;
    om_study_body_destroy(body);
    return om_path_remove(dir) == OM_OK ? 0 : 1;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lesions_are_stiff),
        cmocka_unit_test(test_forces_of_two_codes),
        cmocka_unit_test(test_steps_that_do_not_count),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
