// test_study_sheet.c: the sheet's calibration small: it resumes to the same numbers, its search never sees what is
// held out, and it says what is wrong.
#include <unistd.h>

#include "studies/study_sheet.h"
#include "test_alloc.h"
#include "test_files.h"
#include "test_folder.h"

static OmStudySheetDef small_def(void) {
    OmStudySheetDef def = om_study_sheet_default_def(dir);
    def.cells = 10;
    def.world_cells = 15;
    def.population = 5;
    def.generations = 1;
    def.local_evaluations = 3;
    def.rise = 0;
    return def;
}

static void read_text(const char* name, char** text) {
    char path[600];
    size_t size;
    assert_ok(om_path_join(dir, name, path, sizeof path));
    assert_ok(om_file_read(path, 1 << 24, text, &size));
}

static void remove_file(const char* name) {
    char path[600];
    assert_ok(om_path_join(dir, name, path, sizeof path));
    assert_ok(om_path_remove(path));
}

static void assert_same(const OmStudySheetSummary* a, const OmStudySheetSummary* b) {
    assert_near(a->found, b->found, 0);
    assert_near(a->thesis, b->thesis, 0);
    assert_near(a->unseen_found, b->unseen_found, 0);
    assert_int_equal(a->neval, b->neval);
    for (int k = 0; k < OM_STUDY_NCLUSTER; ++k) assert_near(a->best[k], b->best[k], 0);
}

static void test_study(void** unused) {
    (void)unused;
    OmStudySheetDef def = small_def();
    OmStudySheetSummary first, again;
    char *clouds, *same, *seen;
    assert_ok(om_study_sheet_run(&def, NULL, &first));
    assert_int_equal(first.nfold, 1);
    assert_int_equal(first.nnew, first.neval);
    // particles at rest lie where the elements lie: closer to their cloud than lifted ones to theirs
    assert_true(first.floor > 0 && first.floor < first.found);
    assert_true(first.found < 0.02 && first.thesis < 0.02);
    read_text("clouds.csv", &clouds);
    read_text("without-1/clouds.csv", &seen);
    assert_non_null(strstr(clouds, "pinch 1,30,cloud"));
    assert_null(strstr(seen, "pinch 1,"));
    assert_null(strstr(seen, "nobody"));
    for (int k = 2; k <= OM_STUDY_NPINCH; ++k) {
        char word[32];
        snprintf(word, sizeof word, "pinch %d,30,cloud", k);
        assert_non_null(strstr(seen, word));
    }
    // all there: nothing is evaluated by the search
    assert_ok(om_study_sheet_run(&def, NULL, &again));
    assert_int_equal(again.nnew, 0);
    assert_same(&first, &again);
    // clouds and half the journal lost, and made again by two workers: the same bytes
    char* journal;
    read_text("without-1/journal.jsonl", &journal);
    char* half = strchr(strchr(strchr(journal, '\n') + 1, '\n') + 1, '\n') + 1;
    char path[600];
    assert_ok(om_path_join(dir, "without-1/journal.jsonl", path, sizeof path));
    assert_int_equal(truncate(path, half - journal), 0);  // as after a loss of power
    remove_file("clouds.csv");
    def.nworker = 2;
    assert_ok(om_study_sheet_run(&def, NULL, &again));
    assert_true(again.nnew > 0 && again.nnew < again.neval);
    assert_same(&first, &again);
    read_text("clouds.csv", &same);
    assert_string_equal(clouds, same);
    om_free(clouds);
    om_free(same);
    om_free(seen);
    om_free(journal);
}

static bool say_stop(void* ctx, const char* stage, double done, double total) {
    (void)ctx, (void)stage, (void)done, (void)total;
    return false;
}

static void test_cancel(void** unused) {
    (void)unused;
    OmStudySheetDef def = small_def();
    OmStudySheetSummary sum;
    OmProgress stop = {say_stop, NULL};
    char *clouds, path[600];
    read_text("clouds.csv", &clouds);
    remove_file("clouds.csv");
    assert_status(om_study_sheet_run(&def, &stop, &sum), OM_CANCELLED);
    assert_ok(om_path_join(dir, "clouds.csv", path, sizeof path));
    assert_false(om_path_exists(path));
    assert_ok(om_file_write(path, clouds, strlen(clouds)));
    om_free(clouds);
    assert_ok(om_study_sheet_run(&def, NULL, &sum));
    assert_int_equal(sum.nnew, 0);
}

static void assert_refused(OmStudySheetDef def, const char* message) {
    OmStudySheetSummary sum;
    assert_status(om_study_sheet_run(&def, NULL, &sum), OM_INVALID);
    if (!strstr(om_error_message(), message))
        fail_msg("\"%s\" and not \"%s\"", om_error_message(), message);
}

static void test_nonsense(void** unused) {
    (void)unused;
    OmStudySheetDef def = small_def();
    def.cells = 9;
    assert_refused(def, "cells is 9: 10 to 60");
    def = small_def();
    def.population = 0;
    assert_refused(def, "population is 0");
    def = small_def();
    def.rise = -1;
    assert_refused(def, "rise is -1");
    def = small_def();
    def.seed = 1ull << 31;
    assert_refused(def, "seed is 2147483648");
    def = small_def();
    def.world_cells = 16;
    assert_refused(def, "sheet.yaml is of a study with other settings");
    def = small_def();
    def.generations = 2;
    assert_refused(def, "lift.yaml is of a study with other settings");
    assert_refused((OmStudySheetDef){.out_dir = dir}, "not made by its default_def");
    assert_refused(om_study_sheet_default_def(NULL), "no folder");
}

static OmStatus finish_again(void* ctx) {
    OmStudySheetSummary sum;
    return om_study_sheet_run(ctx, NULL, &sum);
}

static void test_memory(void** unused) {
    (void)unused;
    OmStudySheetDef def = small_def();  // its search is there
    def.nworker = 1;
    test_count_begin();
    assert_ok(finish_again(&def));
    int n = test_count_end();
    int nfail = test_failing_allocations(finish_again, &def, n / 5 + 1);
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
