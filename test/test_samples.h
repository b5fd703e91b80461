// test_samples.h: cases of data sets on disk, of banet and umesh: 6 samples in shards of 4.
#ifndef OMENTUM_TEST_SAMPLES_H
#define OMENTUM_TEST_SAMPLES_H

#include "test_files.h"

typedef struct Folder {
    char dir[256], path[2][300];  // and its two shards
} Folder;

static inline Folder fresh_folder(const char* name) {
    Folder f;
    snprintf(f.dir, sizeof f.dir, "%s", temp_path(name));
    snprintf(f.path[0], sizeof f.path[0], "%s/samples_000000.h5", f.dir);
    snprintf(f.path[1], sizeof f.path[1], "%s/samples_000004.h5", f.dir);
    if (om_path_exists(f.dir)) assert_ok(om_path_remove(f.dir));
    return f;
}

static inline void assert_same_file(const char* a, const char* b) {
    char *p, *q;
    size_t np, nq;
    assert_ok(om_file_read(a, 1 << 26, &p, &np));
    assert_ok(om_file_read(b, 1 << 26, &q, &nq));
    assert_int_equal(np, nq);
    assert_memory_equal(p, q, np);
    om_free(p);
    om_free(q);
}

static inline void assert_same_shards(const Folder* a, const Folder* b) {
    for (int k = 0; k < 2; ++k) assert_same_file(a->path[k], b->path[k]);
}

static inline void assert_has_report(const Folder* f) {
    char file[300];
    snprintf(file, sizeof file, "%s/summary.json", f->dir);
    assert_true(om_path_exists(file));
    snprintf(file, sizeof file, "%s/report.html", f->dir);
    assert_true(om_path_exists(file));
}

/// The room's functions of a set; `def` is the room's definition.
typedef struct TestSet {
    const void* def;
    OmStatus (*generate)(const void* def, const char* dir, int nsample, const OmProgress* progress,
                         int* nmade);
    OmStatus (*load)(const char* dir);  // fails the test where a failed call leaves data
} TestSet;

static inline bool stop_at_five(void* ctx, const char* stage, double done, double total) {
    (void)stage, (void)total;
    *(int*)ctx += 1;
    return done < 5;
}

/// Stopped in the second shard, continued, extended: the files of an uninterrupted run. Both folders have the set.
static inline void assert_resumes(const TestSet* set, const Folder* whole, const Folder* f) {
    int nreport = 0, nmade;
    const OmProgress progress = {stop_at_five, &nreport};
    assert_ok(set->generate(set->def, whole->dir, 6, NULL, &nmade));
    assert_int_equal(nmade, 6);
    assert_status(set->generate(set->def, f->dir, 6, &progress, &nmade), OM_CANCELLED);
    assert_true(nreport > 0);
    assert_same_file(whole->path[0], f->path[0]);
    assert_false(om_path_exists(f->path[1]));
    assert_ok(set->generate(set->def, f->dir, 5, NULL, &nmade));
    assert_int_equal(nmade, 1);
    assert_ok(set->generate(set->def, f->dir, 6, NULL, &nmade));
    assert_int_equal(nmade, 2);  // the short shard is made again
    assert_same_shards(whole, f);
    assert_ok(set->generate(set->def, f->dir, 6, NULL, &nmade));
    assert_int_equal(nmade, 0);
}

static inline void assert_refused(const TestSet* set, const char* dir, const char* why) {
    OmStatus status = set->load(dir);
    assert_true(status == OM_INVALID || status == OM_UNAVAILABLE);
    if (!strstr(om_error_message(), why)) fail_msg("\"%s\" lacks \"%s\"", om_error_message(), why);
}

/// The first shard, shorter by any amount, or with a flipped bit anywhere behind the head. It is whole afterwards.
static inline void assert_damage_refused(const TestSet* set, const Folder* f) {
    char* good;
    size_t size;
    assert_ok(om_file_read(f->path[0], 1 << 26, &good, &size));
    const size_t length[] = {0, 3, 13, 15, 40, 511, 512, 513, 2000, size / 2, size - 1};
    for (size_t k = 0; k < sizeof length / sizeof *length; ++k) {
        write_bytes(f->path[0], good, length[k]);
        assert_refused(set, f->dir, length[k] < 15 ? "not a file of samples" : "truncated");
    }
    for (size_t at = 512; at < size; at += size / 40) {
        good[at] ^= 4;
        write_bytes(f->path[0], good, size);
        assert_refused(set, f->dir, "corrupted");
        good[at] ^= 4;
    }
    write_bytes(f->path[0], good, size);
    om_free(good);
}

#endif
