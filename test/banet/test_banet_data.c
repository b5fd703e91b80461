// test_banet_data.c: data sets on disk: the same bytes however made, resumed, extended; damaged files refused.
#include "banet/banet_data_internal.h"
#include "banet/test_banet.h"
#include "test_alloc.h"
#include "test_samples.h"

// Small bodies that cost little.
static OmBanetDataDef small_def(const char* dir) {
    OmBanetDataDef def = om_banet_data_default_def(77, dir);
    def.sample.extent[0] = 0.04;
    def.sample.extent[1] = 0.06;
    def.sample.thickness[0] = 0.01;
    def.sample.side = 0.6;  // few nodes
    def.sample.way = OM_BANET_EXACT;
    def.nsample = 6;
    def.shard = 4;
    def.npicture = 0;
    return def;
}

static void assert_same_cells(const OmBanetCells* a, const OmBanetCells* b) {
    const size_t n = (size_t)a->ncell;
    assert_int_equal(a->ncell, b->ncell);
    assert_memory_equal(&a->grid, &b->grid, sizeof a->grid);
    assert_memory_equal(&a->fact, &b->fact, offsetof(OmBanetFacts, seconds));
    assert_memory_equal(a->cell, b->cell, n * sizeof *a->cell);
    assert_memory_equal(a->kind, b->kind, n);
    assert_memory_equal(a->value, b->value, OM_BANET_NCHANNEL * n * sizeof *a->value);
}

// ---- shards, without a solve ------------------------------------------------------------------------

static void make_shard(OmBanetShard* s) {
    assert_ok(om__banet_shard_alloc(3, s));
    s->first = 8, s->seed = 5, s->hash = 6, s->side = TEST_SIDE;
    for (int i = 0; i < s->num; ++i) {
        OmBanetSample sample = make_sample((uint64_t)(8 + i));
        assert_ok(om_banet_cells_make(&sample, TEST_SIDE, &s->sample[i]));
        om_banet_sample_done(&sample);
    }
    s->sample[1].value[s->sample[1].ncell] = INT16_MIN + 1;  // differences wrap
    s->sample[1].value[s->sample[1].ncell + 1] = INT16_MAX;
}

static void test_shard(void** state) {
    (void)state;
    const OmBanetSampleDef def = om_banet_sample_default_def(5);
    char path[300];
    OmBanetShard a, b;
    snprintf(path, sizeof path, "%s", temp_path("banet_shard.h5"));
    make_shard(&a);
    assert_ok(om__banet_shard_save(&a, &def, path));
    assert_ok(om__banet_shard_load(path, &b));
    assert_string_equal(b.generator, "omentum banet 3");  // this one
    // a copy keeps the generator of what it copies
    snprintf(b.generator, sizeof b.generator, "omentum banet 1");
    assert_ok(om__banet_shard_save(&b, &def, path));
    om__banet_shard_done(&b);
    assert_ok(om__banet_shard_load(path, &b));
    assert_string_equal(b.generator, "omentum banet 1");
    assert_true(b.first == 8 && b.num == 3 && b.seed == 5 && b.hash == 6 && b.side == TEST_SIDE);
    for (int i = 0; i < 3; ++i) assert_same_cells(&a.sample[i], &b.sample[i]);
    om__banet_shard_done(&b);
    om__banet_shard_done(&a);
    assert_ok(om_path_remove(path));
}

// Values that cannot be right are refused, one by one.
static void test_forged(void** state) {
    (void)state;
    const OmBanetSampleDef def = om_banet_sample_default_def(5);
    char path[300];
    snprintf(path, sizeof path, "%s", temp_path("banet_forged.h5"));
    for (int k = 0; k < 13; ++k) {
        OmBanetShard s, got;
        make_shard(&s);
        OmBanetCells* c = &s.sample[1];
        const int n = c->ncell;
        switch (k) {
        case 0: c->grid.dim[1] = 17; break;
        case 1: c->grid.dim[2] = 1024; break;
        case 2: c->grid.voxel *= 1.001; break;
        case 3: c->grid.pose_world_grid.q.x += 0.1; break;
        case 4: c->cell[5] = c->cell[4]; break;
        case 5: c->cell[n - 1] = (int)om_grid_count(c->grid.dim); break;
        case 6: c->kind[3] = 8; break;
        case 7: c->value[2] = 513; break;
        case 8: c->value[4 * n] = -1; break;
        case 9: c->value[4 * n] = 257; break;
        case 10: c->fact.young = (double)NAN; break;
        case 11: c->fact.index = 4; break;
        default: s.side = -1;
        }
        assert_ok(om__banet_shard_save(&s, &def, path));
        if (om__banet_shard_load(path, &got) != OM_INVALID) fail_msg("case %d is not refused", k);
        assert_null(got.sample);
        om__banet_shard_done(&s);
    }
    assert_ok(om_path_remove(path));
}

static OmStatus save_work(void* ctx) {
    const OmBanetSampleDef def = om_banet_sample_default_def(5);
    return om__banet_shard_save(ctx, &def, temp_path("banet_memory.h5"));
}

static OmStatus load_work(void* ctx) {
    OmBanetShard s;
    OmStatus status = om__banet_shard_load(ctx, &s);
    om__banet_shard_done(&s);
    return status;
}

static void test_shard_memory(void** state) {
    (void)state;
    char path[300];
    OmBanetShard s;
    snprintf(path, sizeof path, "%s", temp_path("banet_memory.h5"));
    make_shard(&s);
    assert_true(test_failing_allocations(save_work, &s, 1) > 20);
    assert_true(test_failing_allocations(load_work, path, 1) > 30);
    om__banet_shard_done(&s);
    assert_ok(om_path_remove(path));
}

// ---- the set of the shared cases -----------------------------------------------------------------------

static OmStatus generate(const void* ctx, const char* dir, int nsample, const OmProgress* progress,
                         int* nmade) {
    OmBanetDataDef def = *(const OmBanetDataDef*)ctx;
    OmBanetSummary sum = {0};
    def.out_dir = dir;
    def.nsample = nsample;
    OmStatus status = om_banet_generate(&def, progress, &sum);
    *nmade = sum.nmade;
    return status;
}

static OmStatus load(const char* dir) {
    OmBanetData data;
    OmStatus status = om_banet_data_load(dir, 0, &data);
    if (status < 0) assert_null(data.sample);
    om_banet_data_done(&data);
    return status;
}

// ---- sets -------------------------------------------------------------------------------------------

static void test_workers(void** state) {
    (void)state;
    Folder one = fresh_folder("banet1"), two = fresh_folder("banet2");
    OmBanetDataDef def = small_def(one.dir);
    OmBanetSummary a, b;
    OmBanetData data;
    def.nworker = 1;
    assert_ok(om_banet_generate(&def, NULL, &a));
    def.out_dir = two.dir;
    def.nworker = 3;
    def.npicture = 1;  // of the report, not of the set
    assert_ok(om_banet_generate(&def, NULL, &b));
    assert_same_shards(&one, &two);
    assert_true(a.nsample == 6 && a.nmade == 6 && a.nbyte == b.nbyte && a.nbyte > 1000);
    assert_true(a.median_u == b.median_u && a.median_u > 0 && a.max_u >= a.median_u);
    assert_has_report(&one);
    // a sample of the set, made alone
    assert_ok(om_banet_data_load(one.dir, 0, &data));
    assert_true(data.nsample == 6 && data.first == 0 && data.seed == 77 && data.side == 0.6);
    assert_string_equal(data.generator, "omentum banet 3");
    assert_string_equal(data.way, om_banet_way_name(def.sample.way));
    assert_string_equal(data.law, "neo-hookean");
    assert_string_equal(data.element, "quadratic");
    OmBanetSample sample;
    OmBanetCells cells;
    assert_ok(om_banet_sample_make(&def.sample, 5, &sample));
    assert_ok(om_banet_cells_make(&sample, def.sample.side, &cells));
    assert_same_cells(&cells, &data.sample[5]);
    om_banet_sample_done(&sample);
    om_banet_cells_done(&cells);
    om_banet_data_done(&data);
    assert_ok(om_banet_data_load(one.dir, 5, &data));
    assert_int_equal(data.nsample, 5);
    om_banet_data_done(&data);
    assert_ok(om_path_remove(one.dir));
    assert_ok(om_path_remove(two.dir));
}

// More files than are open at a time, some of them there already: the samples of one file.
static void test_many_shards(void** state) {
    (void)state;
    Folder few = fresh_folder("banet5"), many = fresh_folder("banet6");
    OmBanetDataDef def = small_def(few.dir);
    OmBanetSummary a, b;
    OmBanetData one, two;
    def.nsample = def.shard = 11;
    assert_ok(om_banet_generate(&def, NULL, &a));
    def.out_dir = many.dir;
    def.shard = 1;
    def.first = 3, def.nsample = 5;
    assert_ok(om_banet_generate(&def, NULL, &b));
    assert_true(b.nsample == 2 && b.nmade == 2);
    def.first = 0, def.nsample = 11;
    assert_ok(om_banet_generate(&def, NULL, &b));
    assert_true(b.nsample == 11 && b.nmade == 9 && a.max_u == b.max_u && a.median_u == b.median_u);
    assert_true(a.nattempt == b.nattempt && a.ncell == b.ncell);
    assert_ok(om_banet_data_load(few.dir, 0, &one));
    assert_ok(om_banet_data_load(many.dir, 0, &two));
    for (int i = 0; i < 11; ++i) assert_same_cells(&one.sample[i], &two.sample[i]);
    om_banet_data_done(&one);
    om_banet_data_done(&two);
    assert_ok(om_path_remove(few.dir));
    assert_ok(om_path_remove(many.dir));
}

// Stopped in the second shard, continued, extended, in parts: the files of an uninterrupted run.
static void test_resume(void** state) {
    (void)state;
    Folder whole = fresh_folder("banet3"), f = fresh_folder("banet4");
    OmBanetDataDef def = small_def(whole.dir);
    OmBanetSummary sum;
    def.nworker = 1;
    assert_resumes(&(TestSet){&def, generate, load}, &whole, &f);
    def.out_dir = f.dir;
    // other settings have no business in the folder
    def.sample.share[1] = 0.4;
    assert_status(om_banet_generate(&def, NULL, &sum), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "other settings"));
    assert_ok(om_path_remove(f.dir));
    // the second part alone
    def = small_def(f.dir);
    def.first = 4;
    assert_ok(om_banet_generate(&def, NULL, &sum));
    assert_true(sum.nsample == 2 && sum.nmade == 2);
    assert_same_file(whole.path[1], f.path[1]);
    // and both parts together
    Folder both = fresh_folder("banet_both");
    const char* const part[] = {f.dir, whole.dir};
    def.out_dir = both.dir, def.first = 0, def.part = part, def.npart = 2;
    assert_ok(om_banet_generate(&def, NULL, &sum));
    assert_true(sum.nsample == 6 && sum.nmade == 0);
    assert_same_shards(&whole, &both);
    assert_ok(om_path_remove(both.dir));
    OmBanetData data;
    assert_ok(om_banet_data_load(f.dir, 0, &data));
    assert_true(data.nsample == 2 && data.first == 4 && data.sample[1].fact.index == 5);
    om_banet_data_done(&data);
    assert_ok(om_path_remove(whole.dir));
    assert_ok(om_path_remove(f.dir));
}

// ---- what is refused --------------------------------------------------------------------------------

static void save(int first, uint64_t hash, const char* path) {
    const OmBanetSampleDef def = om_banet_sample_default_def(5);
    OmBanetShard s;
    make_shard(&s);
    for (int i = 0; i < s.num; ++i) s.sample[i].fact.index = first + i;
    s.first = first, s.hash = hash;
    assert_ok(om__banet_shard_save(&s, &def, path));
    om__banet_shard_done(&s);
}

static void test_hostile(void** state) {
    (void)state;
    Folder f = fresh_folder("banet5");
    const TestSet set = {NULL, generate, load};
    char path[300];
    assert_refused(&set, f.dir, "no file of samples");
    assert_ok(om_path_make_dir(f.dir));
    save(0, 1, f.path[0]);
    assert_damage_refused(&set, &f);
    // a gap, then a file of another set, then one of this set
    save(4, 1, f.path[1]);
    assert_refused(&set, f.dir, "missing");
    snprintf(path, sizeof path, "%s/samples_000003.h5", f.dir);
    save(4, 1, path);
    assert_refused(&set, f.dir, "same set");
    save(3, 2, path);
    assert_refused(&set, f.dir, "same set");
    assert_ok(om_path_remove(f.path[1]));
    save(3, 1, path);
    OmBanetData data;
    assert_ok(om_banet_data_load(f.dir, 4, &data));
    assert_int_equal(data.nsample, 4);
    om_banet_data_done(&data);
    assert_ok(om_path_remove(f.dir));
}

static void test_definitions(void** state) {
    (void)state;
    OmBanetDataDef def = small_def("/tmp");
    OmBanetDataDef bad = def;
    bad.cookie = 0;
    assert_status(om_banet_generate(&bad, NULL, NULL), OM_INVALID);
    bad = def, bad.first = 2;
    assert_status(om_banet_generate(&bad, NULL, NULL), OM_INVALID);
    bad = def, bad.nsample = 0;
    assert_status(om_banet_generate(&bad, NULL, NULL), OM_INVALID);
    bad = def, bad.out_dir = "";
    assert_status(om_banet_generate(&bad, NULL, NULL), OM_INVALID);
    bad = def, bad.sample.side = -1;
    assert_status(om_banet_generate(&bad, NULL, NULL), OM_INVALID);
    // the test sets, which never change
    const uint64_t hash[OM_BANET_NTEST] = {4001, 4002, 4003, 4004};
    for (int k = 0; k < OM_BANET_NTEST; ++k) {
        def = om_banet_data_test_def((OmBanetTest)k, "/tmp");
        assert_true(def.sample.seed == hash[k]);
        assert_int_equal(def.nsample, k < 2 ? 380 : 190);
        assert_true(def.sample.board_share == (k == OM_BANET_TEST_BOARD));
        assert_true(def.sample.two_share == (k == OM_BANET_TEST_TWO));
    }
    // every setting has a part in the hash
    OmBanetSampleDef d = om_banet_sample_default_def(1);
    const uint64_t before = om_banet_sample_def_hash(&d);
    double* const number[] = {
        &d.side,     &d.extent[0],  &d.extent[1],  &d.thickness[0], &d.thickness[1], &d.share[0],
        &d.share[1], &d.visible[0], &d.visible[1], &d.two_share,    &d.board_share,  &d.young[0],
        &d.young[1], &d.poisson[0], &d.poisson[1], &d.radius[0],    &d.radius[1],    &d.pull[0],
        &d.pull[1],  &d.min_u,      &d.max_u,      &d.tolerance,    &d.min_volume};
    int* const whole[] = {&d.max_dim[0], &d.max_dim[1], &d.max_dim[2], &d.max_attempt};
    for (size_t k = 0; k < sizeof number / sizeof *number; ++k) {
        *number[k] += 1;
        assert_true(om_banet_sample_def_hash(&d) != before);
        d = om_banet_sample_default_def(1);
    }
    for (size_t k = 0; k < sizeof whole / sizeof *whole; ++k) {
        ++*whole[k];
        assert_true(om_banet_sample_def_hash(&d) != before);
        --*whole[k];
    }
    OmBanetSampleDef other = d;
    other.seed = 2;
    assert_true(om_banet_sample_def_hash(&other) != before);
    other = d, other.way = OM_BANET_EXACT;
    assert_true(om_banet_sample_def_hash(&other) != before);
    other = d, other.law = OM_ST_VENANT_KIRCHHOFF;
    assert_true(om_banet_sample_def_hash(&other) != before);
    other = d, other.element = OM_TET4;
    assert_true(om_banet_sample_def_hash(&other) != before);
    // a set that was made before there were other elements than linear ones
    other = om_banet_data_default_def(5, "/tmp").sample;
    other.way = OM_BANET_EXACT, other.element = OM_TET4;
    assert_true(om_banet_sample_def_hash(&other) == 0xdc4cd963e5f7859d);
    double x[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    int tet[4] = {0, 1, 2, 3};
    const OmTetMesh body = {.nvert = 4, .ntet = 1, .x = x, .tet_vert = tet};
    other = d, other.body = &body;
    const uint64_t with_body = om_banet_sample_def_hash(&other);
    x[3] = 2;
    assert_true(with_body != before && om_banet_sample_def_hash(&other) != with_body);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_shard),        cmocka_unit_test(test_forged),
        cmocka_unit_test(test_shard_memory), cmocka_unit_test(test_workers),
        cmocka_unit_test(test_many_shards),  cmocka_unit_test(test_resume),
        cmocka_unit_test(test_hostile),      cmocka_unit_test(test_definitions),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
