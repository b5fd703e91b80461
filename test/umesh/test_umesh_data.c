// test_umesh_data.c: data sets on disk: the same bytes however made, resumed, extended; damaged files refused.
#include "test_alloc.h"
#include "test_samples.h"
#include "umesh/test_umesh.h"
#include "umesh/umesh_internal.h"

static OmUmeshOrgan* the_organ;

static int set_up(void** state) {
    (void)state;
    the_organ = make_organ(120);
    return 0;
}

static int tear_down(void** state) {
    (void)state;
    om_umesh_organ_destroy(the_organ);
    return 0;
}

// ---- the set of the shared cases -----------------------------------------------------------------------

static OmStatus generate(const void* ctx, const char* dir, int nsample, const OmProgress* progress,
                         int* nmade) {
    OmUmeshDataDef def = *(const OmUmeshDataDef*)ctx;
    OmUmeshSummary sum = {0};
    def.out_dir = dir;
    def.nsample = nsample;
    OmStatus status = om_umesh_generate(&def, progress, &sum);
    *nmade = sum.nmade;
    return status;
}

static OmStatus load(const char* dir) {
    OmUmeshData data;
    OmStatus status = om_umesh_data_load(dir, 0, &data);
    if (status < 0) assert_null(data.u);
    om_umesh_data_done(&data);
    return status;
}

// ---- making -----------------------------------------------------------------------------------------

static void test_workers(void** state) {
    (void)state;
    Folder one = fresh_folder("umesh1"), two = fresh_folder("umesh2");
    OmUmeshDataDef def = small_def(the_organ, one.dir);
    OmUmeshSummary a, b;
    def.nworker = 1;
    assert_ok(om_umesh_generate(&def, NULL, &a));
    def.out_dir = two.dir;
    def.nworker = 3;
    def.npicture = 2;  // of the report, not of the set
    assert_ok(om_umesh_generate(&def, NULL, &b));
    assert_same_shards(&one, &two);
    assert_int_equal(a.nsample, 6);
    assert_int_equal(a.nmade, 6);
    assert_true(a.max_u == b.max_u && a.max_u > 0);
    assert_has_report(&one);
    assert_ok(om_path_remove(one.dir));
    assert_ok(om_path_remove(two.dir));
}

static void test_load(void** state) {
    (void)state;
    Folder f = fresh_folder("umesh3");
    OmUmeshDataDef def = small_def(the_organ, f.dir);
    OmUmeshData data;
    assert_ok(om_umesh_generate(&def, NULL, NULL));
    assert_ok(om_umesh_data_load(f.dir, 0, &data));
    const OmUmeshGrid *g = om_umesh_organ_grid(the_organ), *h = &data.grid;
    size_t nnode = (size_t)g->fem.mesh.nnode;
    assert_int_equal(data.nsample, 6);
    assert_int_equal(h->fem.mesh.nnode, g->fem.mesh.nnode);
    assert_true(h->hash == g->hash && data.seed == 1);
    assert_memory_equal(h->fem.mesh.elem_node, g->fem.mesh.elem_node,
                        8 * (size_t)g->fem.mesh.nelem * sizeof(int));
    assert_memory_equal(h->fem.mesh.x, g->fem.mesh.x, 3 * nnode * sizeof(double));
    assert_memory_equal(h->surface_x, g->surface_x, 3 * nnode * sizeof(double));
    assert_memory_equal(h->fem.fixed, g->fem.fixed, nnode);
    // sample 5 made alone
    OmUmeshSolver* solver;
    OmUmeshSample sample;
    unsigned char* mask = om_alloc(nnode, 1);
    double* u = om_alloc(3 * nnode, sizeof *u);
    assert_ok(om_umesh_solver_create(&def, &solver));
    assert_ok(om_umesh_sample_make(solver, 5, &sample, mask, u));
    sample.seconds = 0;
    data.sample[5].seconds = 0;
    assert_memory_equal(&sample, &data.sample[5], sizeof sample);
    assert_memory_equal(mask, data.mask + 5 * nnode, nnode);
    for (size_t i = 0; i < 3 * nnode; ++i) assert_true((float)u[i] == data.u[15 * nnode + i]);
    om_umesh_solver_destroy(solver);
    om_umesh_data_done(&data);
    assert_ok(om_umesh_data_load(f.dir, 5, &data));
    assert_int_equal(data.nsample, 5);
    om_umesh_data_done(&data);
    om_free(mask);
    om_free(u);
    assert_ok(om_path_remove(f.dir));
}

// Stopped in the second shard, continued, extended: the files of an uninterrupted run.
static void test_resume(void** state) {
    (void)state;
    Folder whole = fresh_folder("umesh4"), f = fresh_folder("umesh5");
    OmUmeshDataDef def = small_def(the_organ, whole.dir);
    OmUmeshSummary sum;
    def.nworker = 1;
    assert_resumes(&(TestSet){&def, generate, load}, &whole, &f);
    def.out_dir = f.dir;
    // a shard that was changed is not replaced; once it is moved away, it is made again
    write_bytes(f.path[0], "omentum umesh 1\n", 16);
    assert_status(om_umesh_generate(&def, NULL, &sum), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "samples_000000.h5 was changed"));
    assert_ok(om_path_remove(f.path[0]));
    assert_ok(om_umesh_generate(&def, NULL, &sum));
    assert_int_equal(sum.nmade, 4);
    assert_same_file(whole.path[0], f.path[0]);
    // another seed has no business in the folder
    def.seed = 2;
    assert_status(om_umesh_generate(&def, NULL, &sum), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "another seed"));
    assert_ok(om_path_remove(whole.dir));
    assert_ok(om_path_remove(f.dir));
}

// ---- what is refused --------------------------------------------------------------------------------

static void test_hostile(void** state) {
    (void)state;
    Folder f = fresh_folder("umesh6");
    OmUmeshDataDef def = small_def(the_organ, f.dir);
    const TestSet set = {&def, generate, load};
    char* good;
    size_t size;
    assert_ok(om_umesh_generate(&def, NULL, NULL));
    assert_ok(om_file_read(f.path[0], 1 << 26, &good, &size));
    assert_damage_refused(&set, &f);
    // another format, no samples at all
    good[14] = '9';
    write_bytes(f.path[0], good, size);
    assert_refused(&set, f.dir, "format 9");
    good[14] = '1';
    // the second shard in place of the first, none, one of another set
    OmUmeshData data;
    assert_ok(om_path_remove(f.path[0]));
    assert_refused(&set, f.dir, "missing");
    char* second;
    size_t second_size;
    assert_ok(om_file_read(f.path[1], 1 << 26, &second, &second_size));
    write_bytes(f.path[0], second, second_size);
    assert_refused(&set, f.dir, "same set");
    assert_ok(om_path_remove(f.path[0]));
    Folder other = fresh_folder("umesh7");
    def.out_dir = other.dir;
    def.max_force = 0.2;
    assert_ok(om_umesh_generate(&def, NULL, NULL));
    assert_ok(om_path_remove(f.path[1]));
    assert_refused(&set, f.dir, "no file of samples");
    write_bytes(f.path[0], good, size);
    assert_ok(om_umesh_data_load(f.dir, 0, &data));
    om_umesh_data_done(&data);
    char* foreign;
    assert_ok(om_file_read(other.path[1], 1 << 26, &foreign, &second_size));
    write_bytes(f.path[1], foreign, second_size);
    assert_refused(&set, f.dir, "same set");
    om_free(good);
    om_free(second);
    om_free(foreign);
    assert_ok(om_path_remove(f.dir));
    assert_ok(om_path_remove(other.dir));
}

static void test_write_failure(void** state) {
    (void)state;
    Folder f = fresh_folder("umesh8");
    write_bytes(f.dir, "x", 1);  // a file where the folder should be
    OmUmeshDataDef def = small_def(the_organ, f.dir);
    assert_status(om_umesh_generate(&def, NULL, NULL), OM_IO);
    assert_ok(om_path_remove(f.dir));
    OmUmeshData data;
    assert_status(om_umesh_data_load("/nowhere/at/all", 0, &data), OM_INVALID);
}

// A set of which a sample cannot be made is not called finished.
static void test_given_up(void** state) {
    (void)state;
    Folder f = fresh_folder("umesh10");
    char report[300];
    OmUmeshDataDef def = small_def(the_organ, f.dir);
    def.min_patch = 1000000;
    def.max_attempt = 3;
    assert_status(om_umesh_generate(&def, NULL, NULL), OM_NOT_CONVERGED);
    assert_non_null(strstr(om_error_message(), "min_patch"));
    snprintf(report, sizeof report, "%s/report.html", f.dir);
    assert_false(om_path_exists(report));
    assert_ok(om_path_remove(f.dir));
}

// ---- memory -----------------------------------------------------------------------------------------

static OmStatus generate_work(void* ctx) {
    OmUmeshDataDef def = *(OmUmeshDataDef*)ctx;
    if (om_path_exists(def.out_dir)) OM_TRY(om_path_remove(def.out_dir));
    return om_umesh_generate(&def, NULL, NULL);
}

static OmStatus load_work(void* ctx) {
    OmUmeshDataDef* def = ctx;
    OmUmeshData data;
    OmStatus status = om_umesh_data_load(def->out_dir, 0, &data);
    om_umesh_data_done(&data);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    Folder f = fresh_folder("umesh9");
    OmUmeshDataDef def = small_def(the_organ, f.dir);
    def.nworker = 1;
    def.nsample = 2;
    def.shard = 1;
    def.max_press = 1e-3;
    def.max_force = 0.01;
    assert_true(test_failing_allocations(generate_work, &def, test_stride(7)) > 10);
    assert_true(test_failing_allocations(load_work, &def, 1) > 10);
    assert_ok(om_path_remove(f.dir));
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_workers),       cmocka_unit_test(test_load),
        cmocka_unit_test(test_resume),        cmocka_unit_test(test_hostile),
        cmocka_unit_test(test_write_failure), cmocka_unit_test(test_given_up),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(test, set_up, tear_down);
}
