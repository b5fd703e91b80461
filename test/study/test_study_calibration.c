// test_study_calibration.c: the calibration study small: the gel is the thesis's, searches improve what they
// search, a second run makes nothing and any worker count the same bytes, nonsense is refused.
#include "test_alloc.h"

#include "studies/study_internal.h"

static char dir[] = "/tmp/om_calstudy_XXXXXX";

static OmStudyCalibrationDef small_def(void) {
    OmStudyCalibrationDef def = om_study_calibration_default_def(dir);
    def.nlesion = 2;
    def.nacquisition = 2;
    def.spacing = 0.009;
    def.settle = 0;
    def.speed = 0.05;
    def.population = 5;
    def.max_generations = 1;
    def.max_local = 2;
    def.has_sensitivity = false;
    def.truth_ntet = def.gel_truth_ntet = 900;
    def.fe_ntet = 400;
    def.contact_ntri = 900;
    def.nworker = 1;
    return def;
}

// Its volume, where its beads' tops are, and that beads are inside.
static void test_gel(void** unused) {
    (void)unused;
    static const double top[] = {0.047, 0.053, 0.063};
    OmStudyBody* gel;
    OmTetMesh mesh;
    int n;
    assert_ok(om_study_body_create_gel(&gel));
    const OmStudyLesion* l = om_study_lesions(gel, &n);
    assert_int_equal(n, 3);
    for (int i = 0; i < n; ++i) {
        assert_near(om__study_contour(&l[i]).z, top[i], 1e-15);
        assert_below(om_study_body_eval(gel, l[i].center), -l[i].radius + 1e-15);
        assert_near(om_study_body_eval(gel, l[i].touch), 0, 1e-15);
    }
    assert_ok(om_study_body_mesh(gel, 2000, 1, &mesh));
    double volume = 0, whole = 0.155 * 0.100 * 0.070;
    for (int e = 0; e < mesh.ntet; ++e) {
        OmVec3 v[4];
        for (int a = 0; a < 4; ++a) v[a] = om_load3(mesh.x, mesh.tet_vert[4 * e + a]);
        volume += om_dot(om_cross(om_sub(v[1], v[0]), om_sub(v[2], v[0])), om_sub(v[3], v[0])) / 6;
    }
    assert_near(volume, whole, 0.05 * whole);  // lattice cells cut edges off
    om_tet_mesh_done(&mesh);
    om_study_body_destroy(gel);
}

static char* read_errors(void) {
    char path[1024], *text;
    size_t size;
    assert_ok(om_path_join(dir, "errors.csv", path, sizeof path));
    assert_ok(om_file_read(path, 1 << 20, &text, &size));
    return text;
}

static void test_study(void** unused) {
    (void)unused;
    OmStudyCalibrationDef def = small_def();
    OmStudyCalibrationSummary sum, again;
    assert_ok(om_study_calibration_run(&def, NULL, &sum));
    printf("gel %.2f -> %.2f mm, lesion %.2f -> %.2f mm, unseen %.2f mm, rigid %.2f mm\n",
           1e3 * sum.gel_start, 1e3 * sum.gel_error, 1e3 * sum.tuned_start, 1e3 * sum.tuned_error,
           1e3 * sum.unseen[OM_FIT_TUNED], 1e3 * sum.unseen[OM_FIT_RIGID]);
    assert_true(sum.nnew == sum.neval && sum.neval > 8);
    assert_true(sum.gel_error <= sum.gel_start && sum.tuned_error <= sum.tuned_start);
    assert_true(sum.unseen[OM_FIT_TUNED] > 0 && sum.unseen[OM_FIT_PRESCRIBED] > 0 &&
                sum.nunseen > 0);
    for (int i = 0; i < OM_STUDY_NCLUSTER; ++i) assert_true(isfinite(sum.tuned[i]));
    assert_true(sum.gel[1] >= 0.5 * sum.gel[0] && sum.tuned[1] >= 0.5 * sum.tuned[0]);
    char* first = read_errors();
    // all there: nothing is evaluated again, by two workers neither; the same numbers
    def.nworker = 2;
    assert_ok(om_study_calibration_run(&def, NULL, &again));
    assert_int_equal(again.nnew, 0);
    assert_int_equal(again.neval, sum.neval);
    char* second = read_errors();
    assert_string_equal(first, second);
    om_free(first);
    om_free(second);
}

static bool stop(void* ctx, const char* stage, double done, double total) {
    (void)stage, (void)done, (void)total;
    return --*(int*)ctx > 0;
}

// Stopped in a search of its own: what was evaluated stays, and two workers end where one does.
static void test_cancel(void** unused) {
    (void)unused;
    OmStudyCalibrationDef def = small_def();
    OmStudyCalibrationSummary sum, again;
    int left = 3;
    OmProgress progress = {stop, &left};
    def.seed = 2;
    assert_status(om_study_calibration_run(&def, &progress, &sum), OM_CANCELLED);
    def.nworker = 2;
    assert_ok(om_study_calibration_run(&def, NULL, &sum));
    assert_true(sum.nnew <= sum.neval);
    assert_ok(om_study_calibration_run(&def, NULL, &again));
    for (int i = 0; i < OM_STUDY_NCLUSTER; ++i) assert_true(again.tuned[i] == sum.tuned[i]);
}

static void test_bad(void** unused) {
    (void)unused;
    OmStudyCalibrationSummary sum;
    OmStudyCalibrationDef def = {0};
    assert_status(om_study_calibration_run(&def, NULL, &sum), OM_INVALID);
    def = small_def();
    def.tuned = 2;
    assert_status(om_study_calibration_run(&def, NULL, &sum), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "tuned = 2"));
    def = small_def();
    def.spacing = 0;
    assert_status(om_study_calibration_run(&def, NULL, &sum), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "spacing"));
}

// The folder is complete: the rest of the study with each allocation failing in turn.
static OmStatus finish_again(void* ctx) {
    OmStudyCalibrationSummary sum;
    return om_study_calibration_run(ctx, NULL, &sum);
}

static void test_memory(void** unused) {
    (void)unused;
    OmStudyCalibrationDef def = small_def();
    int nfail = test_failing_allocations(finish_again, &def, 149);
    printf("%d allocations failed\n", nfail);
    assert_true(nfail > 5);
}

static int begin(void** unused) {
    (void)unused;
    return mkdtemp(dir) ? 0 : -1;
}

static int end(void** unused) {
    (void)unused;
    return om_path_remove(dir) == OM_OK ? 0 : -1;
}

int main(void) {
    const struct CMUnitTest test[] = {cmocka_unit_test(test_gel), cmocka_unit_test(test_study),
                                      cmocka_unit_test(test_cancel), cmocka_unit_test(test_memory),
                                      cmocka_unit_test(test_bad)};
    return cmocka_run_group_tests(test, begin, end);
}
