// test_study_draw.c: ids of files as git's, draws of a hash, the table of draws, cases of a judged draw.
#include "studies/study_draw.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "studies/study_retraction_protocol.h"
#include "studies/study_sha1.h"
#include "test_files.h"

// Of the folders below, by git 2.39: for f in src studies scenes asp weights; do echo "$f $(git rev-parse HEAD:$f)";
// done | sha1sum
#define HASH "50eb9e9b09c13a18"

static char root[] = "/tmp/om_draw_XXXXXX";

static void put(const char* name, const char* data, size_t size) {
    char path[1024];
    assert_ok(om_path_join(root, name, path, sizeof path));
    FILE* f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
}

static void check_sha1(const char* data, size_t size, int repeat, const char* hex) {
    StudySha1 s;
    unsigned char digest[20];
    char out[41];
    om__sha1_begin(&s);
    for (int k = 0; k < repeat; ++k) om__sha1_add(&s, data, size);
    om__sha1_end(&s, digest);
    for (int k = 0; k < 20; ++k) snprintf(out + 2 * k, 3, "%02x", digest[k]);
    assert_string_equal(out, hex);
}

// The examples of FIPS 180-4.
static void test_sha1(void** unused) {
    (void)unused;
    check_sha1("", 0, 1, "da39a3ee5e6b4b0d3255bfef95601890afd80709");
    check_sha1("abc", 3, 1, "a9993e364706816aba3e25717850c26c9cd0d89d");
    check_sha1("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", 56, 1,
               "84983e441c3bd26ebaae4aa1f95129e5e54670f1");
    check_sha1("aaaaaaaaaa", 10, 100000, "34aa973cd4c4daa4f61eeb2bdbad27316534016f");
}

static void make_tree(void) {
    static const char* const folder[] = {"src",    "src/a", "src/empty", "studies",
                                         "scenes", "asp",   "weights"};
    char path[1024];
    for (size_t k = 0; k < sizeof folder / sizeof *folder; ++k) {
        assert_ok(om_path_join(root, folder[k], path, sizeof path));
        assert_int_equal(mkdir(path, 0755), 0);
    }
    put("src/a.c", "int a;\n", 7);
    put("src/a/b.c", "x", 1);
    put("src/a0", "", 0);
    put("src/a-run", "#!/bin/sh\n", 10);
    assert_ok(om_path_join(root, "src/a-run", path, sizeof path));
    assert_int_equal(chmod(path, 0755), 0);
    assert_ok(om_path_join(root, "src/link", path, sizeof path));
    assert_int_equal(symlink("a.c", path), 0);
    put("studies/s.c", "study\n", 6);
    put("scenes/s.yaml", "y: 1\n", 5);
    put("asp/p.lp", "p.\n", 3);
    put("weights/w", "\0\1\2", 3);
}

// The order of "a-run", "a.c", "a/" and "a0", a program, a link, an empty file and an empty folder.
static void test_hash_is_that_of_git(void** unused) {
    (void)unused;
    char hash[20];
    double newest = 0;
    assert_ok(om__study_draw_hash(root, hash, &newest));
    assert_string_equal(hash, HASH);
    assert_true(newest > 1.7e9);
    put("asp/p.lp", "q.\n", 3);
    assert_ok(om__study_draw_hash(root, hash, NULL));
    assert_string_not_equal(hash, HASH);
    put("asp/p.lp", "p.\n", 3);
    assert_status(om__study_draw_hash("/nowhere", hash, NULL), OM_IO);
}

// Seeds by another program: ((hash ^ n) * 1099511628211), x ^= x >> 29.
static void test_words(void** unused) {
    (void)unused;
    static const uint64_t seed[OM_STUDY_NDRAW] = {0x41989a739f916bf7, 0x41989b739f9161a2,
                                                  0x41989c739f91586d};
    OmStudyDraw draw;
    assert_ok(om_study_draw_read(NULL, 1, NULL, &draw));
    assert_int_equal(draw.kind, OM_DRAW_PUBLISHED);
    assert_ok(om_study_draw_read("development", 1, NULL, &draw));
    assert_int_equal(draw.kind, OM_DRAW_DEVELOPMENT);
    assert_true(draw.seed == 0);
    for (int n = 1; n <= OM_STUDY_NDRAW; ++n) {
        assert_ok(om_study_draw_read(HASH, n, root, &draw));
        assert_int_equal(draw.kind, OM_DRAW_JUDGED);
        assert_true(draw.seed == seed[n - 1]);
        assert_int_equal(draw.number, n);
        assert_string_equal(draw.commit, "-");
    }
    static const char* const bad[] = {"",      "123456",
                                      "HEAD",  "0123456789abcdeg",
                                      "'; ls", "12345678901234567890123456789012345678901"};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k)
        assert_status(om_study_draw_read(bad[k], 1, root, &draw), OM_INVALID);
    assert_status(om_study_draw_read(HASH, 4, root, &draw), OM_INVALID);
    assert_status(om_study_draw_read("0123456", 1, root, &draw), OM_IO);  // no such commit
}

// A checkout: its commit gives the hash of its files, and so does "here" as long as nothing is changed.
static void test_commit(void** unused) {
    (void)unused;
    char command[512], commit[64], path[1024];
    snprintf(
        command, sizeof command,
        "cd %s && git init -q . && git add -A && git -c user.name=a -c user.email=a@a commit -qm a && git "
        "rev-parse HEAD",
        root);
    FILE* f = popen(command, "r");
    const bool is_there = f && fgets(commit, sizeof commit, f);
    if (f) (void)pclose(f);
    if (!is_there) skip();  // no git
    commit[40] = 0;
    OmStudyDraw draw;
    assert_ok(om_study_draw_read(commit, 1, root, &draw));
    assert_string_equal(draw.hash, HASH);
    assert_string_equal(draw.commit, commit);
    assert_status(om_study_draw_read("here", 1, root, &draw),
                  OM_INVALID);  // newer than this program
    assert_non_null(strstr(om_error_message(), "build it"));
    assert_ok(om_study_draw_table(NULL, root, path, sizeof path));
    assert_non_null(strstr(path, "/doc/draws.csv"));
    assert_status(om_study_draw_table(NULL, "/tmp", path, sizeof path), OM_INVALID);
    assert_ok(om_study_draw_table("mine.csv", "/tmp", path, sizeof path));
    assert_string_equal(path, "mine.csv");
}

static void test_table(void** unused) {
    (void)unused;
    static const char expected[] = "study,part,hash,draw,commit,cases,result\n"
                                   "retraction,random," HASH ",2,-,1001-1100,96 of 100 exposed\n"
                                   "retraction,alarms," HASH ",2,-,3001-3100,2 of 100 warned\n";
    char path[1024];
    OmStudyDraw draw, none;
    assert_ok(om_path_join(root, "draws.csv", path, sizeof path));
    assert_ok(om_study_draw_read(HASH, 2, root, &draw));
    assert_ok(om_study_draw_read("development", 1, root, &none));
    for (int again = 0; again < 2; ++again) {
        assert_ok(om_study_draw_append(path, &draw, "retraction", "random", "1001-1100",
                                       "96 of 100 exposed"));
        assert_ok(om_study_draw_append(path, &draw, "retraction", "alarms", "3001-3100",
                                       "2 of 100 warned"));
        assert_ok(om_study_draw_append(path, &none, "retraction", "random", "2501-2600",
                                       "1 of 100 exposed"));
    }
    char* text;
    size_t size;
    assert_ok(om_file_read(path, 10000, &text, &size));
    assert_string_equal(text, expected);
    om_free(text);
}

// Every draw of a hash has pairs of its own, the same each time; those published stay (test_study_retraction).
static void test_pairs(void** unused) {
    (void)unused;
    RetractionCase c[4], again;
    OmStudyDraw draw = {.kind = OM_DRAW_PUBLISHED};
    assert_ok(om__retraction_pair(RETRACTION_FIRST_PAIR, &draw, true, &c[0]));
    assert_string_equal(c[0].name, "pair-1001-fewer");
    for (int n = 1; n <= OM_STUDY_NDRAW; ++n) {
        assert_ok(om_study_draw_read(HASH, n, root, &draw));
        assert_ok(om__retraction_pair(RETRACTION_FIRST_PAIR, &draw, true, &c[n]));
        assert_ok(om__retraction_pair(RETRACTION_FIRST_PAIR, &draw, true, &again));
        assert_memory_equal(&c[n], &again, sizeof again);
        for (int k = 0; k < n; ++k) assert_int_not_equal(c[n].seed, c[k].seed);
    }
    assert_string_equal(c[2].name, "pair-1001-fewer-" HASH "-2");
    assert_ok(om__retraction_alarm(RETRACTION_FIRST_ALARM, &draw, true, &again));
    assert_string_equal(again.name, "alarm-3001-" HASH "-3");
}

int main(void) {
    if (!mkdtemp(root)) return 1;
    make_tree();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sha1),  cmocka_unit_test(test_hash_is_that_of_git),
        cmocka_unit_test(test_words), cmocka_unit_test(test_commit),
        cmocka_unit_test(test_table), cmocka_unit_test(test_pairs),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[64];
    snprintf(command, sizeof command, "rm -rf %s", root);
    return system(command) == 0 ? failed : 1;
}
