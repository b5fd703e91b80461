// test_study_contact.c: the contact study small: it resumes to the same numbers, refuses nonsense, and its
// truth does not depend on its mesh more than the check by refinement says.
#include "test_alloc.h"

#include "studies/study_internal.h"

static char dir[] = "/tmp/om_study_XXXXXX";
static OmStudyBody* body;

// One lesion, one coarse mesh, twenty steps.
static OmStudyContactDef small_def(void) {
    OmStudyContactDef def = om_study_contact_default_def(body, dir);
    def.nresolution = 1;
    def.resolution[0] = 400;
    def.nlesion = 1;
    def.truth_ntet = 900;
    def.time_step = 0.05;
    def.contact_ntri = 900;
    for (int i = 0; i < OM_STUDY_NDEPTH; ++i)
        def.depth[i] = (test_is_slow() ? 0.002 : 0.001) * (i + 1);
    def.nworker = 1;
    return def;
}

static void read_run(const OmStudyContactDef* def, const char* name, char** text) {
    char path[1024];
    size_t size;
    assert_ok(om__study_path(def, path, sizeof path, "%s", name));
    assert_ok(om_file_read(path, 1 << 20, text, &size));
}

static void test_study(void** unused) {
    (void)unused;
    OmStudyContactDef def = small_def();
    OmStudyContactSummary sum;
    char *first, *again;
    assert_ok(om_study_contact_run(&def, NULL, &sum));
    assert_int_equal(sum.nrun, 3);
    assert_int_equal(sum.nnew, 3);
    assert_int_equal(sum.ncomplete, 3);
    assert_near(sum.worst_stability, 1, 0);
    read_run(&def, "errors.csv", &first);
    // all there: nothing is made; the same numbers
    assert_ok(om_study_contact_run(&def, NULL, &sum));
    assert_int_equal(sum.nnew, 0);
    read_run(&def, "errors.csv", &again);
    assert_string_equal(first, again);
    om_free(again);
    // one run lost, and made by two workers: the same numbers still
    char path[1024];
    assert_ok(om__study_path(&def, path, sizeof path, "runs/penalty-000400-01.json"));
    assert_ok(om_path_remove(path));
    def.nworker = 2;
    assert_ok(om_study_contact_run(&def, NULL, &sum));
    assert_int_equal(sum.nnew, 1);
    read_run(&def, "errors.csv", &again);
    assert_string_equal(first, again);
    om_free(again);
    om_free(first);
    if (!test_is_slow()) return;
    // another tolerance makes the runs again, not the truth
    def.tolerance = 5e-4;
    assert_ok(om_study_contact_run(&def, NULL, &sum));
    assert_int_equal(sum.nnew, 3);
}

static bool stop(void* ctx, const char* stage, double done, double total) {
    (void)done, (void)total;
    return !strstr(stage, " elements, ") || --*(int*)ctx > 0;  // counts the runs
}

static void test_cancel(void** unused) {
    (void)unused;
    OmStudyContactDef def = small_def();
    OmStudyContactSummary sum;
    def.density = 1010;
    int left = 2;  // one run is made, the others are not begun
    OmProgress progress = {stop, &left};
    assert_status(om_study_contact_run(&def, &progress, &sum), OM_CANCELLED);
    assert_ok(om_study_contact_run(&def, NULL, &sum));
    assert_int_equal(sum.nnew, 2);
}

// The first millimetres: the lesion follows the probe, less the deeper it lies, and forces grow.
static void test_truth(void** unused) {
    (void)unused;
    OmStudyContactDef def = small_def();
    OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);
    shape.rounding = PROBE_ROUNDING;
    OmProbe* probe;
    StudyTruth* truth;
    StudyTruthResult r = {0};
    char meshes[64];  // made by the study, unless this case runs alone
    snprintf(meshes, sizeof meshes, "%s/meshes", dir);
    if (!om_path_exists(meshes)) assert_ok(om_path_make_dir(meshes));
    assert_ok(om_probe_create(&shape, &probe));
    assert_ok(om__study_truth_create(&def, probe, &truth));
    assert_ok(om__study_truth_solve(truth, 0, NULL, &r));
    double last = 0;
    for (int k = 0; k < OM_STUDY_NDEPTH; ++k) {
        OmVec3 move = om_sub(r.at[k].fine, body->lesion[0].center);
        double along = -om_dot(move, body->lesion[0].normal);
        printf(
            "D%.1f: %.3f mm along the way, %.3f N, sunk in by %.3f mm, meshes differ by %.3f mm\n",
            1e3 * def.depth[k], 1e3 * along, r.at[k].force, 1e3 * r.at[k].sink,
            1e3 * om_distance(r.at[k].fine, r.at[k].coarse));
        assert_true(along > 0.1 * def.depth[k] && along < def.depth[k]);
        assert_true(r.at[k].force > last);
        assert_below(r.at[k].residual, 1e-3);
        if (k >= 2) assert_below(fabs(r.at[k].sink), 5e-5);  // before, it hardly touches
        last = r.at[k].force;
    }
    om__study_truth_destroy(truth);
    om_probe_destroy(probe);
}

// Quantiles of 0..4, by hand; noise has the requested spread.
static void test_numbers(void** unused) {
    (void)unused;
    double v[] = {3, 1, 4, 0, 2};
    StudySample s = om__study_sample(v, 5);
    assert_near(s.mean, 2, 1e-15);
    assert_near(s.sd, sqrt(2.5), 1e-15);
    assert_near(s.lower, 1, 1e-15);
    assert_near(s.median, 2, 1e-15);
    assert_near(s.max, 4, 1e-15);
    OmStudyContactDef def = small_def();
    double square = 0;
    enum { N = 4000 };
    for (int i = 0; i < N; ++i) {
        StudyTruthResult t = {.lesion = i};
        square += om_norm2(om__study_measured(&def, &t, 1)) / N;
    }
    double expected = pow(def.probe_noise, 2) + pow(def.pointer_noise, 2);
    assert_near_rel(square, expected, 0.06);  // 4 sigma of a mean of 4,000 squares
}

static void test_nonsense(void** unused) {
    (void)unused;
    OmStudyContactSummary sum;
    OmStudyContactDef def = small_def();
    def.resolution[0] = 5;
    assert_status(om_study_contact_run(&def, NULL, &sum), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "resolution[0] = 5"));
    def = small_def();
    def.depth[2] = 0;
    assert_status(om_study_contact_run(&def, NULL, &sum), OM_INVALID);
    def = small_def();
    def.material.poisson = 0.5;
    assert_status(om_study_contact_run(&def, NULL, &sum), OM_INVALID);
    def = (OmStudyContactDef){.body = body, .out_dir = dir};
    assert_status(om_study_contact_run(&def, NULL, &sum), OM_INVALID);
}

static OmStatus finish_again(void* ctx) {
    OmStudyContactSummary sum;
    return om_study_contact_run(ctx, NULL, &sum);
}

static OmStatus make_body(void* ctx) {
    (void)ctx;
    OmStudyBody* phantom;
    OmTetMesh mesh;
    OmStatus status = om_study_body_create_phantom(3, 2, &phantom);
    if (status == OM_OK) status = om_study_body_mesh(phantom, 200, 1, &mesh);
    if (status == OM_OK) om_tet_mesh_done(&mesh);
    om_study_body_destroy(phantom);
    return status;
}

static void test_memory(void** unused) {
    (void)unused;
    OmStudyContactSummary sum;
    OmStudyContactDef def = small_def();
    assert_ok(
        om_study_contact_run(&def, NULL, &sum));  // its runs are there, unless this case runs alone
    int nfail = test_failing_allocations(make_body, NULL, test_stride(13));
    nfail += test_failing_allocations(finish_again, &def, test_stride(61));
    printf("%d allocations failed\n", nfail);
    assert_true(nfail > 10);
}

static int begin(void** unused) {
    (void)unused;
    assert_non_null(mkdtemp(dir));
    assert_ok(om_study_body_create_phantom(10, 1, &body));
    return 0;
}

static int end(void** unused) {
    (void)unused;
    om_study_body_destroy(body);
    return om_path_remove(dir) == OM_OK ? 0 : 1;
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_study),    cmocka_unit_test(test_cancel),
        cmocka_unit_test(test_truth),    cmocka_unit_test(test_memory),
        cmocka_unit_test(test_nonsense), cmocka_unit_test(test_numbers),
    };
    return cmocka_run_group_tests(test, begin, end);
}
