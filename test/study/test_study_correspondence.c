// test_study_correspondence.c: the study of correspondence on its quick cases: resumed to the same numbers, cancelled,
// refused, and without memory.
#include "studies/study_match.h"
#include "test_alloc.h"
#include "test_files.h"
#include "test_folder.h"

static OmStudyCorrespondenceDef quick_def(void) {
    OmStudyCorrespondenceDef def = om_study_correspondence_default_def(dir);
    def.is_quick = true;
    def.nworker = 1;
    return def;
}

static void remove_file(const char* name) {
    char path[600];
    assert_ok(om_path_join(dir, name, path, sizeof path));
    assert_ok(om_path_remove(path));
}

static void assert_same(const OmStudyWayResult* a, const OmStudyWayResult* b) {
    assert_int_equal(a->npoint, b->npoint);
    assert_near(a->answered, b->answered, 0);
    assert_near(a->median, b->median, 0);
    assert_near(a->p90, b->p90, 0);
    assert_near(a->worst, b->worst, 0);
}

static void test_study(void** unused) {
    (void)unused;
    OmStudyCorrespondenceDef def = quick_def();
    OmStudyCorrespondenceSummary first, again;
    assert_ok(om_study_correspondence_run(&def, NULL, &first));
    assert_int_equal(first.ncase, 4);
    assert_int_equal(first.nnew, 4);
    assert_true(om_path_exists(in_dir("study.json")));
    const OmStudyWayResult *rest = &first.fold[OM_STUDY_REST],
                           *twin = &first.fold[OM_STUDY_TWIN_END];
    assert_true(rest->npoint > 100 && rest->npoint < first.all[OM_STUDY_REST].npoint);
    // A twin that has gone the whole way shows where a folded point is; the rest shape does not.
    assert_true(twin->median < 0.01 && rest->median > 3 * twin->median);
    assert_true(twin->median <= twin->p90 && twin->p90 <= twin->worst && twin->worst < 0.17);
    remove_file("case-quick-03.bin");
    remove_file("truth-quick-40.bin");
    def.nworker = 2;
    assert_ok(om_study_correspondence_run(&def, NULL, &again));
    assert_int_equal(again.nnew, 1);
    for (int way = 0; way < OM_STUDY_NWAY; ++way) {
        assert_same(&first.all[way], &again.all[way]);
        assert_same(&first.fold[way], &again.fold[way]);
    }
}

static bool say_stop(void* ctx, const char* stage, double done, double total) {
    (void)ctx, (void)stage, (void)total;
    return done < 1;
}

static void test_cancel(void** unused) {
    (void)unused;
    OmStudyCorrespondenceDef def = quick_def();
    OmStudyCorrespondenceSummary sum;
    OmProgress stop = {say_stop, NULL};
    remove_file("case-quick-01.bin");
    remove_file("case-quick-02.bin");
    assert_status(om_study_correspondence_run(&def, &stop, &sum), OM_CANCELLED);
    assert_ok(om_study_correspondence_run(&def, NULL, &sum));
    assert_int_equal(sum.nnew, 1);  // the first was kept
}

static void assert_refused(OmStudyCorrespondenceDef def, const char* message) {
    OmStudyCorrespondenceSummary sum;
    assert_status(om_study_correspondence_run(&def, NULL, &sum), OM_INVALID);
    if (!strstr(om_error_message(), message))
        fail_msg("\"%s\" and not \"%s\"", om_error_message(), message);
}

static void test_nonsense(void** unused) {
    (void)unused;
    OmStudyCorrespondenceDef def = quick_def();
    def.spacing = 0.001;
    assert_refused(def, "spacing is 0.001: 0.002 to 0.02");
    def = quick_def();
    def.nworker = -1;
    assert_refused(def, "nworker is -1");
    assert_refused((OmStudyCorrespondenceDef){.out_dir = dir}, "not made by its default_def");
    assert_refused(om_study_correspondence_default_def(NULL), "no folder");
}

static OmStatus finish_again(void* ctx) {
    OmStudyCorrespondenceSummary sum;
    return om_study_correspondence_run(ctx, NULL, &sum);
}

static void test_memory(void** unused) {
    (void)unused;
    OmStudyCorrespondenceDef def = quick_def();  // its cases are there
    test_count_begin();
    assert_ok(finish_again(&def));
    int n = test_count_end();
    int nfail = test_failing_allocations(finish_again, &def, n / 20 + 1);
    printf("%d of %d allocations failed\n", nfail, n);
    assert_true(nfail >= 4);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_study),
        cmocka_unit_test(test_cancel),
        cmocka_unit_test(test_nonsense),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(test, make_dir, remove_dir);
}
