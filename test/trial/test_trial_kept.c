// Finished trials that are kept: the file, and a plan that continues from it.
#include "easy_scene.h"
#include "omentum/trial_preplan.h"
#include "test_alloc.h"
#include "test_folder.h"
#include "trial/trial_kept.h"

#define KEY 77

// ---- the file -----------------------------------------------------------------------------------------------

static void add(const Kept* k, int index, const char* text) {
    assert_ok(om__kept_add(k, index, text, strlen(text)));
}

static void expect(const Kept* k, int index, const char* text) {
    size_t size = 0;
    const char* found = om__kept_find(k, index, &size);
    if (!text) {
        assert_null(found);
        return;
    }
    assert_non_null(found);
    assert_int_equal(size, strlen(text));
    assert_memory_equal(found, text, size);
}

static void records_are_found_again(void** state) {
    (void)state;
    const char* path = in_dir("trials");
    Kept k;
    assert_ok(om__kept_open(path, KEY, &k));
    add(&k, 3, "first");
    add(&k, 13, "");
    expect(&k, 3, NULL);  // it was not in the file at opening
    Kept second;
    assert_status(om__kept_open(path, KEY, &second), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "another run"));
    om__kept_done(&k);
    for (int round = 0; round < 2; ++round) {
        assert_ok(om__kept_open(path, KEY, &k));
        expect(&k, 3, "first");
        expect(&k, 13, "");
        expect(&k, 30, NULL);
        expect(&k, 25, round ? "later" : NULL);
        if (!round) add(&k, 25, "later");
        om__kept_done(&k);
    }
    assert_ok(om__kept_open(NULL, KEY, &k));
    add(&k, 0, "nowhere");
    expect(&k, 0, NULL);
    om__kept_done(&k);
}

static void change(const char* path, size_t at, char by, size_t less) {
    char* data;
    size_t size;
    assert_ok(om_file_read(path, 1 << 20, &data, &size));
    data[at < size ? at : 0] ^= by;
    assert_ok(om_file_write(path, data, size - less));
    om_free(data);
}

// A kill in the middle of a write, and a damaged record: what comes before is kept, and the file can be continued.
static void a_torn_record_is_cut_off(void** state) {
    (void)state;
    for (int k = 0; k < 3; ++k) {
        const char* path = in_dir(k == 0 ? "torn" : k == 1 ? "flipped" : "size");
        Kept kept;
        assert_ok(om__kept_open(path, KEY, &kept));
        add(&kept, 0, "whole");
        add(&kept, 1, "torn");
        om__kept_done(&kept);
        if (k == 0) change(path, 0, 0, 2);
        if (k == 1) change(path, 24 + 29 + 25, 1, 0);  // of the bytes
        if (k == 2) change(path, 24 + 29 + 15, 1, 0);  // the number of bytes becomes 2^56
        assert_ok(om__kept_open(path, KEY, &kept));
        expect(&kept, 0, "whole");
        expect(&kept, 1, NULL);
        add(&kept, 1, "again");
        om__kept_done(&kept);
        assert_ok(om__kept_open(path, KEY, &kept));
        expect(&kept, 1, "again");
        om__kept_done(&kept);
    }
}

static void another_key_begins_anew(void** state) {
    (void)state;
    const char* path = in_dir("keys");
    Kept k;
    assert_ok(om__kept_open(path, KEY, &k));
    add(&k, 0, "old");
    om__kept_done(&k);
    assert_ok(om__kept_open(path, KEY + 1, &k));
    expect(&k, 0, NULL);
    om__kept_done(&k);
    assert_ok(om__kept_open(path, KEY, &k));
    expect(&k, 0, NULL);
    om__kept_done(&k);
}

static void other_files_are_not_touched(void** state) {
    (void)state;
    const char* path = in_dir("mine.txt");
    char* data;
    size_t size;
    Kept k;
    assert_ok(om_file_write(path, "my notes", 8));
    assert_status(om__kept_open(path, KEY, &k), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "move it away"));
    assert_ok(om_file_read(path, 100, &data, &size));
    assert_string_equal(data, "my notes");
    om_free(data);
    assert_status(om__kept_open(dir, KEY, &k), OM_IO);
    assert_status(om__kept_open(in_dir("none/trials"), KEY, &k), OM_IO);
}

static OmStatus read_one(void* ctx) {
    Kept k;
    size_t size;
    OM_TRY(om__kept_open(ctx, KEY, &k));
    OmStatus status = om__kept_find(&k, 0, &size) ? OM_OK : om__kept_add(&k, 0, "x", 1);
    om__kept_done(&k);
    return status;
}

static void any_allocation_may_fail(void** state) {
    (void)state;
    const char* path = in_dir("memory");
    assert_true(test_failing_allocations(read_one, (void*)(size_t)path, 1) >= 1);
}

// ---- a plan ---------------------------------------------------------------------------------------------------

static OmPreplan whole, resumed;  // too large for a stack with the sanitizer

typedef struct Budget {
    int nstep, most;  // calls of the listener
} Budget;

static bool count(void* ctx, const char* stage, double done, double total) {
    (void)stage;
    (void)done;
    (void)total;
    Budget* b = ctx;
    return ++b->nstep <= b->most;
}

static OmScene small_scene(void) {
    OmScene s = easy_scene();
    s.tissue.cells = om_vec3(4, 4, 1);
    s.task.grid = 3;
    s.task.grasp_radius = 0.02;
    return s;
}

static OmStatus plan(const OmScene* scene, const char* trials, int nworker, Budget* budget,
                     OmPreplan* out) {
    OmPreplanDef def = om_preplan_default_def(scene);
    const OmProgress progress = {count, budget};
    def.nworker = nworker;
    def.trials = trials;
    budget->nstep = 0;
    return om_preplan_run(&def, &progress, out);
}

// Stopped again and again, in any stage: the plan of an uninterrupted run. No finished trial is repeated.
static void a_stopped_plan_continues(void** state) {
    (void)state;
    const OmScene scene = small_scene();
    const char* trials = in_dir("plan.trials");
    Budget all = {0, 1 << 30};
    assert_ok(plan(&scene, NULL, 1, &all, &whole));
    const int total = all.nstep;
    assert_true(whole.is_exposing && whole.ntried >= 4 && total > 1000);

    OmStatus status = OM_CANCELLED;
    int nrun = 0;
    while (status == OM_CANCELLED && nrun < 100) {
        Budget part = {0, total / 4 + 31 * nrun};
        status = plan(&scene, trials, 1 + nrun % 2, &part, &resumed);
        ++nrun;
    }
    assert_ok(status);
    assert_true(nrun > 3);
    assert_memory_equal(&whole, &resumed, sizeof whole);

    // all is kept: nothing is left to do
    assert_ok(plan(&scene, trials, 1, &all, &resumed));
    assert_memory_equal(&whole, &resumed, sizeof whole);
    assert_true(all.nstep < total / 10);

    // another scene: its own trials
    OmScene other = scene;
    other.task.max_height *= 0.5;
    assert_ok(plan(&other, NULL, 1, &all, &whole));
    assert_ok(plan(&other, trials, 1, &all, &resumed));
    assert_memory_equal(&whole, &resumed, sizeof whole);
}

int main(void) {
    om_worker_force(true);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(records_are_found_again), cmocka_unit_test(a_torn_record_is_cut_off),
        cmocka_unit_test(another_key_begins_anew), cmocka_unit_test(other_files_are_not_touched),
        cmocka_unit_test(any_allocation_may_fail), cmocka_unit_test(a_stopped_plan_continues),
    };
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
