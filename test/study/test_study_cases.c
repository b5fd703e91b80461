// test_study_cases.c: files of results, and cases that are found or made by several threads.
#include "studies/study_cases.h"

#include <math.h>
#include <string.h>

#include "test_alloc.h"
#include "test_folder.h"

#define N 7

// Bounds are inside; a NaN, a value beyond and one below are refused, and named.
static void test_ranges(void** unused) {
    (void)unused;
    StudyRange range[] = {{"n", 3, 1, 3}, {"share", 0, 0, 1}};
    assert_ok(om__study_check("study", true, dir, 2, range, 2));
    assert_status(om__study_check("study", false, dir, 2, range, 2), OM_INVALID);
    assert_status(om__study_check("study", true, NULL, 2, range, 2), OM_INVALID);
    assert_status(om__study_check("study", true, dir, OM_MAX_WORKER + 1, range, 2), OM_INVALID);
    const double wrong[] = {-0.5, 1.5, (double)NAN};
    for (int k = 0; k < 3; ++k) {
        range[1].value = wrong[k];
        assert_status(om__study_check("study", true, dir, 0, range, 2), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "study: share is "));
    }
}

// A result is read back by its setup alone; changed bytes, another length and another setup are not read.
static void test_parts(void** unused) {
    (void)unused;
    int a[3] = {1, 2, 3}, x[3] = {0};
    char b[5] = "four", y[5] = "";
    const StudyPart out[2] = {{a, sizeof a}, {b, sizeof b}}, in[2] = {{x, sizeof x}, {y, sizeof y}};
    assert_false(om__study_load_parts(dir, "p.bin", 9, in, 2));
    assert_ok(om__study_save_parts(dir, "p.bin", 9, out, 2));
    assert_true(om__study_load_parts(dir, "p.bin", 9, in, 2));
    assert_memory_equal(a, x, sizeof a);
    assert_string_equal(y, "four");
    assert_false(om__study_load_parts(dir, "p.bin", 8, in, 2));
    assert_false(om__study_load_parts(dir, "p.bin", 9, in, 1));
    char* data;
    size_t size;
    assert_ok(om_file_read(in_dir("p.bin"), 1 << 20, &data, &size));
    assert_int_equal(size, 3 * sizeof(uint64_t) + sizeof a + sizeof b);
    data[size - 2] ^= 1;
    assert_ok(om_file_write(in_dir("p.bin"), data, size));
    assert_false(om__study_load_parts(dir, "p.bin", 9, in, 2));
    assert_ok(om_file_write(in_dir("p.bin"), data, 10));
    assert_null(om__study_load_block(dir, "p.bin", 9, &size));
    om_free(data);
}

typedef struct Squares {
    uint64_t seed;
    int bad;     // the case that fails; -1: none
    int folder;  // part of the name
    bool was_inside;
    int nmade[N];
} Squares;

static OmStatus name_square(const void* ctx, int i, char name[64], uint64_t* hash) {
    const Squares* s = ctx;
    snprintf(name, 64, "square-%d-%d.bin", s->folder, i);
    *hash = om_hash(&s->seed, sizeof s->seed, (uint64_t)i);
    return OM_OK;
}

static OmStatus make_square(void* ctx, int i, void* result) {
    Squares* s = ctx;
    ++s->nmade[i];
    s->was_inside = om_worker_is_inside();
    if (i == s->bad) return om_error(OM_INVALID, "case %d is bad", i);
    *(int*)result += i * i;  // 0 before
    return OM_OK;
}

static StudyCases squares(Squares* s, int* result, int nworker) {
    return (StudyCases){.dir = dir,
                        .what = "squares",
                        .n = N,
                        .nworker = nworker,
                        .size = sizeof *result,
                        .result = result,
                        .ctx = s,
                        .name = name_square,
                        .make = make_square};
}

// With two workers, batches of 0 1, 2 3, 4 5: case 3 fails after 2 was kept, and 4 to 6 are not begun.
static void test_failure(void** unused) {
    (void)unused;
    Squares s = {.seed = 5, .bad = 3};
    int result[N] = {77, 77, 77, 77, 77, 77, 77};
    om_worker_force(true);
    StudyCases c = squares(&s, result, 2);
    assert_status(om__cases_run(&c, NULL), OM_INVALID);
    om_worker_force(false);
    assert_string_equal(om_error_message(), "case 3 is bad");
    const int once[N] = {1, 1, 1, 1};
    assert_memory_equal(s.nmade, once, sizeof once);
    assert_true(om_path_exists(in_dir("square-0-2.bin")));
    assert_false(om_path_exists(in_dir("square-0-3.bin")));
}

// The same call continues: 3 to 6 are made; then nothing; another setting makes all of them.
static void test_continue(void** unused) {
    (void)unused;
    Squares s = {.seed = 5, .bad = -1};
    int result[N] = {77, 77, 77, 77, 77, 77, 77};
    StudyCases c = squares(&s, result, 1);
    assert_ok(om__cases_run(&c, NULL));
    assert_int_equal(c.nmissing, 4);
    assert_false(s.was_inside);  // one case at a time may have several workers
    const int made[N] = {0, 0, 0, 1, 1, 1, 1};
    assert_memory_equal(s.nmade, made, sizeof made);
    for (int i = 0; i < N; ++i) assert_int_equal(result[i], i * i);
    memset(result, 0, sizeof result);
    assert_ok(om__cases_run(&c, NULL));
    assert_int_equal(c.nmissing, 0);
    for (int i = 0; i < N; ++i) assert_int_equal(result[i], i * i);
    s.seed = 6;
    assert_ok(om__cases_run(&c, NULL));
    assert_int_equal(c.nmissing, N);
}

static bool stop_at_four(void* ctx, const char* stage, double done, double total) {
    (void)stage;
    (void)total;
    *(double*)ctx = done;
    return done < 4;
}

// A batch of two: progress comes before each, and ends the run.
static void test_cancel(void** unused) {
    (void)unused;
    Squares s = {.seed = 7, .bad = -1};
    int result[N];
    double done = -1;
    const OmProgress progress = {.report = stop_at_four, .ctx = &done};
    om_worker_force(true);
    StudyCases c = squares(&s, result, 2);
    assert_status(om__cases_run(&c, &progress), OM_CANCELLED);
    om_worker_force(false);
    assert_near(done, 4, 0);
    const int made[N] = {1, 1, 1, 1};
    assert_memory_equal(s.nmade, made, sizeof made);
}

// A file that cannot be read for want of memory counts as missing: here no file is there.
static OmStatus run_anew(void* ctx) {
    Squares s = {.bad = -1, .folder = ++*(int*)ctx};
    int result[N];
    StudyCases c = squares(&s, result, 1);
    return om__cases_run(&c, NULL);
}

static void test_memory(void** unused) {
    (void)unused;
    int folder = 0;
    // the list of missing cases, the tasks, the text of each file
    assert_true(test_failing_allocations(run_anew, &folder, 1) >= 2 + N);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ranges),  cmocka_unit_test(test_parts),
        cmocka_unit_test(test_failure), cmocka_unit_test(test_continue),
        cmocka_unit_test(test_cancel),  cmocka_unit_test(test_memory)};
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
