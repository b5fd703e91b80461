// test_study_estimate.c: the time of a study by hand, its sentence, and what the listener receives.
#include "studies/study_cases.h"

#include <string.h>

#include "test_common.h"

static char told[256];
static double told_total;
static int ntold;

static bool listen(void* ctx, const char* stage, double done, double total) {
    (void)done;
    snprintf(told, sizeof told, "%s", stage);
    told_total = total;
    ++ntold;
    return *(bool*)ctx;
}

// 3 x 10 s and 4 x 60 s by one worker; rounds of pieces of one thread are whole, shared work is divided.
static void test_seconds(void** unused) {
    (void)unused;
    const StudyWork work[] = {{"runs", 3, 10, false}, {"searches", 4, 60, true}};
    assert_near(om__study_estimate(work, 2, 1), 270, 1e-9);
    const int n = om_worker_count(2);  // 1 on a machine with one processor
    assert_near(om__study_estimate(work, 2, 2), n == 2 ? 20 + 120 : 270, 1e-9);
}

static void test_sentence(void** unused) {
    (void)unused;
    static const struct {
        int n;
        double seconds;
        const char* text;
    } row[] = {{1, 0.01, "1 runs: about 1 s on 1 core"},
               {3, 29, "3 runs: about 87 s on 1 core"},
               {3, 60, "3 runs: about 3 min on 1 core"},
               {100, 54, "100 runs: about 1.5 h on 1 core"}};
    char text[128];
    for (size_t k = 0; k < sizeof row / sizeof *row; ++k) {
        const StudyWork work[] = {{"plans", 0, 9, true}, {"runs", row[k].n, row[k].seconds, true}};
        om__study_estimate_print(work, 2, 1, text, sizeof text);
        assert_string_equal(text, row[k].text);
    }
    const StudyWork both[] = {{"plans", 2, 30, true}, {"runs", 1, 60, true}};
    om__study_estimate_print(both, 2, 1, text, sizeof text);
    assert_string_equal(text, "2 plans, 1 runs: about 2 min on 1 core");
}

// A total below 0 marks a sentence; nothing is said where nothing is missing.
static void test_tell(void** unused) {
    (void)unused;
    bool is_wanted = true;
    const OmProgress progress = {listen, &is_wanted};
    StudyWork work = {"runs", 0, 10, true};
    assert_ok(om__study_estimate_tell(&work, 1, 1, &progress));
    assert_int_equal(ntold, 0);
    work.n = 2;
    assert_ok(om__study_estimate_tell(&work, 1, 1, NULL));
    assert_ok(om__study_estimate_tell(&work, 1, 1, &progress));
    assert_int_equal(ntold, 1);
    assert_true(told_total < 0);
    assert_string_equal(told, "2 runs: about 20 s on 1 core");
    is_wanted = false;
    assert_status(om__study_estimate_tell(&work, 1, 1, &progress), OM_CANCELLED);
}

static void test_has_file(void** unused) {
    (void)unused;
    assert_true(om__study_has_file("studies", "study_cases.h"));
    assert_false(om__study_has_file("studies", "study_cases.txt"));
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_seconds),
                                       cmocka_unit_test(test_sentence), cmocka_unit_test(test_tell),
                                       cmocka_unit_test(test_has_file)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
