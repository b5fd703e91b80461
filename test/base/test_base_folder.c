// Output folders: only what omentum wrote is replaced or removed, and a kill at any moment loses nothing.
#define _GNU_SOURCE
#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test_folder.h"

static void put(const char* name, const char* text) {
    FILE* f = fopen(in_dir(name), "wb");
    assert_non_null(f);
    fputs(text, f);
    fclose(f);
}

static void assert_text(const char* name, const char* text) {
    char* data;
    size_t size;
    assert_ok(om_file_read(in_dir(name), 10000, &data, &size));
    assert_string_equal(data, text);
    om_free(data);
}

static void assert_says(const char* part) {
    if (!strstr(om_error_message(), part))
        fail_msg("\"%s\" does not say \"%s\"", om_error_message(), part);
}

// Entries of a folder that begin with `head`.
static int count(const char* name, const char* head) {
    int n = 0;
    DIR* d = opendir(in_dir(name));
    assert_non_null(d);
    for (struct dirent* e; (e = readdir(d)) != NULL;)
        n += strncmp(e->d_name, head, strlen(head)) == 0;
    closedir(d);
    return n;
}
static int count_temporary(void) { return count(".", ".omentum-"); }

static void write_in(const OmFolder* f, const char* name, const char* text) {
    char path[2048];
    assert_ok(om_path_join(f->path, name, path, sizeof path));
    assert_ok(om_file_write(path, text, strlen(text)));
}

static OmStatus make_whole(const char* name, const char* text) {
    OmFolder f;
    OM_TRY(om_folder_begin(in_dir(name), "test", &f));
    char sub[2048];
    assert_ok(om_path_join(f.path, "sub", sub, sizeof sub));
    assert_ok(om_path_make_dir(sub));
    write_in(&f, "a.txt", text);
    write_in(&f, "sub/b.txt", text);
    return om_folder_commit(&f);
}

// ---- whole folders --------------------------------------------------------------------------------------

static void a_whole_folder_replaces_its_like(void** state) {
    (void)state;
    assert_ok(make_whole("w", "one"));
    assert_text("w/a.txt", "one");
    assert_ok(make_whole("w/", "two"));
    assert_text("w/sub/b.txt", "two");
    assert_ok(unlink(in_dir("w/a.txt")));  // a file that the user removed is no reason to refuse
    assert_ok(make_whole("w", "three"));
    assert_text("w/a.txt", "three");
    assert_ok(mkdir(in_dir("empty"), 0777));
    assert_ok(make_whole("empty", "one"));
    assert_ok(make_whole("far/below/w", "one"));
    assert_int_equal(count_temporary(), 0);
}

static void an_uncommitted_folder_leaves_nothing(void** state) {
    (void)state;
    OmFolder f;
    assert_ok(om_folder_begin(in_dir("u"), "test", &f));
    write_in(&f, "a.txt", "one");
    assert_int_equal(count_temporary(), 1);
    om_folder_end(&f);
    assert_int_equal(count_temporary(), 0);
    assert_false(om_path_exists(in_dir("u")));
}

typedef void (*SpoilFn)(void);
static void add_file(void) { put("s/notes.txt", "mine"); }
static void add_folder(void) { assert_ok(mkdir(in_dir("s/runs"), 0777)); }
static void add_below(void) { put("s/sub/notes.txt", "mine"); }
static void add_link(void) { assert_ok(symlink("/etc/passwd", in_dir("s/link"))); }
static void add_pipe(void) { assert_ok(mkfifo(in_dir("s/pipe"), 0666)); }
static void change_file(void) { put("s/sub/b.txt", "One"); }
static void exchange_for_link(void) {
    put("b.txt", "one");
    assert_ok(unlink(in_dir("s/sub/b.txt")));
    assert_ok(symlink(in_dir("b.txt"), in_dir("s/sub/b.txt")));
}
static void remove_list(void) { assert_ok(unlink(in_dir("s/.omentum"))); }
static void other_list(void) { put("s/.omentum", "settings of another program\n"); }

static void nothing_foreign_is_replaced(void** state) {
    (void)state;
    const struct {
        SpoilFn spoil;
        const char* says;
    } spoilt[] = {{add_file, "notes.txt, which omentum did not write"},
                  {add_folder, "runs, which omentum did not write"},
                  {add_below, "sub/notes.txt, which"},
                  {add_link, "link, which"},
                  {add_pipe, "pipe, which"},
                  {change_file, "s/sub/b.txt was changed after omentum wrote it"},
                  {exchange_for_link, "sub/b.txt, which omentum did not write"},
                  {remove_list, "no list (.omentum)"},
                  {other_list, "no list (.omentum)"}};
    for (size_t i = 0; i < sizeof spoilt / sizeof *spoilt; ++i) {
        assert_ok(make_whole("s", "one"));
        spoilt[i].spoil();
        assert_status(om_folder_check(in_dir("s"), "test"), OM_INVALID);
        assert_status(make_whole("s", "two"), OM_INVALID);
        assert_says(spoilt[i].says);
        assert_says("name another folder");
        assert_text("s/a.txt", "one");
        assert_int_equal(count_temporary(), 0);
        assert_ok(om_path_remove(in_dir("s")));
    }
    assert_text("b.txt", "one");
}

static void another_kind_is_not_replaced(void** state) {
    (void)state;
    assert_ok(make_whole("kind", "one"));
    assert_status(om_folder_check(in_dir("kind"), "tests"), OM_INVALID);
    assert_says("holds a test, not a tests");
    OmFolder f;
    assert_status(om_folder_open(in_dir("kind"), "test", &f), OM_INVALID);
    assert_ok(om_folder_open(in_dir("grows"), "test", &f));
    om_folder_end(&f);
    assert_status(om_folder_check(in_dir("grows"), "test"), OM_INVALID);
}

static void neighbours_of_old_names_stay(void** state) {
    (void)state;
    const char* name[] = {"n.old", "n.partial", "n.part-1"};
    for (int i = 0; i < 3; ++i) assert_ok(mkdir(in_dir(name[i]), 0777));
    put("n.old/mine", "1");
    put("n.partial/mine", "2");
    put("n.part-1/mine", "3");
    put(".omentum-0123456789abcdef-00000000.part", "a name of no check number");
    for (int i = 0; i < 2; ++i) assert_ok(make_whole("n", "one"));
    assert_text("n.old/mine", "1");
    assert_text("n.partial/mine", "2");
    assert_text("n.part-1/mine", "3");
    assert_text(".omentum-0123456789abcdef-00000000.part", "a name of no check number");
    assert_ok(unlink(in_dir(".omentum-0123456789abcdef-00000000.part")));
}

static void a_file_added_meanwhile_is_kept(void** state) {
    (void)state;
    assert_ok(make_whole("m", "one"));
    OmFolder f;
    assert_ok(om_folder_begin(in_dir("m"), "test", &f));
    write_in(&f, "a.txt", "two");
    put("m/notes.txt", "mine");
    assert_status(om_folder_commit(&f), OM_INVALID);
    assert_says("the result is in");
    assert_text("m/notes.txt", "mine");
    assert_text("m/a.txt", "one");
    assert_int_equal(count(".", "m.new-"), 1);
    char a[1200];
    assert_ok(om_path_join(f.place, "a.txt", a, sizeof a));
    char* data;
    size_t size;
    assert_ok(om_file_read(a, 100, &data, &size));
    assert_string_equal(data, "two");
    om_free(data);
    assert_int_equal(count_temporary(), 0);
}

static void a_part_goes_beside(void** state) {
    (void)state;
    for (int i = 0; i < 2; ++i) {
        OmFolder f;
        assert_ok(om_folder_begin(in_dir("p"), "test", &f));
        write_in(&f, "a.txt", i ? "part" : "first");
        assert_ok(om_folder_commit_beside(&f));
        assert_true((strstr(f.place, "p.new-") != NULL) == (i == 1));
    }
    assert_text("p/a.txt", "first");
    assert_int_equal(count(".", "p.new-"), 1);
}

static void links_and_dots_lead_to_the_folder(void** state) {
    (void)state;
    assert_ok(make_whole("real", "one"));
    assert_ok(symlink("real", in_dir("link")));
    assert_ok(make_whole("link", "two"));
    struct stat st;
    assert_ok(lstat(in_dir("link"), &st));
    assert_true(S_ISLNK(st.st_mode));
    assert_text("real/a.txt", "two");
    assert_ok(symlink("nowhere", in_dir("loose")));
    assert_status(make_whole("loose", "two"), OM_IO);
    assert_says("link to a missing folder");
    put("plain", "x");
    assert_status(make_whole("plain", "two"), OM_IO);
    assert_says("is a file");
    char here[1024];
    assert_non_null(getcwd(here, sizeof here));
    assert_ok(chdir(in_dir("real")));
    OmStatus dot = om_folder_check(".", "test");
    assert_ok(chdir(here));
    assert_status(dot, OM_INVALID);
    assert_status(om_folder_check("/proc", "test"), OM_INVALID);
    assert_says("mounted");
}

static void a_folder_that_cannot_be_written(void** state) {
    (void)state;
    OmFolder f;
    assert_status(om_folder_begin("/proc/omentum/out", "test", &f), OM_IO);
    assert_status(om_folder_open("/proc/omentum", "test", &f), OM_IO);
    if (geteuid() == 0) return;  // root writes everywhere else
    assert_ok(mkdir(in_dir("fixed"), 0555));
    assert_status(om_folder_begin(in_dir("fixed/out"), "test", &f), OM_IO);
    assert_says("Permission denied");
}

// ---- folders that grow ----------------------------------------------------------------------------------

static void a_growing_folder_goes_on(void** state) {
    (void)state;
    OmFolder f;
    for (int i = 0; i < 3; ++i) {
        assert_ok(om_folder_open(in_dir("g"), "test", &f));
        write_in(&f, "a.txt", i ? "two" : "one");
        if (i < 2) om_folder_end(&f);
    }
    OmFolder second;
    assert_status(om_folder_open(in_dir("g"), "test", &second), OM_INVALID);
    assert_says("another run");
    om_folder_end(&f);
    assert_ok(om_folder_open(in_dir("g"), "test", &second));
    om_folder_end(&second);
    put("g/notes.txt", "mine");  // beside ours: it is not replaced
    assert_ok(om_folder_open(in_dir("g"), "test", &f));
    char path[1200];
    assert_ok(om_path_join(f.path, "notes.txt", path, sizeof path));
    assert_status(om_file_write(path, "x", 1), OM_INVALID);
    assert_says("was not written by omentum");
    om_folder_end(&f);
    assert_text("g/notes.txt", "mine");
    put("g/a.txt", "Two");
    assert_status(om_folder_open(in_dir("g"), "test", &f), OM_INVALID);
    assert_says("g/a.txt was changed");
    assert_text("g/a.txt", "Two");
}

static void a_growing_folder_takes_no_folder_of_others(void** state) {
    (void)state;
    OmFolder f;
    assert_ok(mkdir(in_dir("o"), 0777));
    put("o/journal.jsonl", "mine");
    assert_status(om_folder_open(in_dir("o"), "test", &f), OM_INVALID);
    assert_says("holds journal.jsonl and no list");
    assert_false(om_path_exists(in_dir("o/.omentum")));
    // a folder in a folder that grows belongs to it
    assert_ok(om_folder_open(in_dir("outer"), "outer", &f));
    assert_ok(om_path_make_dir(in_dir("outer/in")));
    write_in(&f, "in/a.txt", "one");
    OmFolder in;
    assert_ok(om_folder_open(in_dir("outer/in"), "inner", &in));
    write_in(&in, "a.txt", "two");
    om_folder_end(&in);
    om_folder_end(&f);
    assert_false(om_path_exists(in_dir("outer/in/.omentum")));
    assert_text("outer/in/a.txt", "two");
}

// The list after a kill in the middle of a line, and lists that are no lists.
static void a_cut_list_is_gone_on_with(void** state) {
    (void)state;
    OmFolder f;
    assert_ok(om_folder_open(in_dir("cut"), "test", &f));
    write_in(&f, "a.txt", "one");
    om_folder_end(&f);
    FILE* list = fopen(in_dir("cut/.omentum"), "ab");
    assert_non_null(list);
    fputs("file 12 0123", list);
    fclose(list);
    assert_ok(om_folder_open(in_dir("cut"), "test", &f));
    write_in(&f, "a.txt", "two");
    write_in(&f, "b.txt", "two");
    om_folder_end(&f);
    assert_ok(om_folder_open(in_dir("cut"), "test", &f));
    write_in(&f, "b.txt", "three");
    om_folder_end(&f);
    const char* damaged[] = {"", "\n", "omentum 1 growing test", "omentum 1 growing test\nfile",
                             "omentum 1 growing test\nfile 1 0123456789abcdef \n\n\nfile -1 x y\n"};
    for (int i = 0; i < 5; ++i) {
        put("cut/.omentum", damaged[i]);
        OmStatus status = om_folder_open(in_dir("cut"), "test", &f);
        assert_true(i < 3 ? status == OM_INVALID : status == OM_OK);
        if (status == OM_OK) om_folder_end(&f);
        assert_text("cut/b.txt", "three");
    }
}

// ---- kills ----------------------------------------------------------------------------------------------

static void run_and_die(int when) {
    OmFolder f;
    if (when == 0) {
        if (om_folder_begin(in_dir("k"), "test", &f) < 0) _exit(1);
        write_in(&f, "a.txt", "unfinished");
    } else {
        OmAtomicFile file;
        if (om_file_begin(in_dir("k.txt"), &file) < 0) _exit(1);
        fputs("unfinished", file.stream);
        fflush(file.stream);
    }
    raise(SIGKILL);
}

static void what_a_kill_leaves_is_cleaned_up(void** state) {
    (void)state;
    assert_ok(make_whole("k", "old"));
    put("k.txt", "old");
    OmFolder living;
    assert_ok(om_folder_begin(in_dir("living"), "test", &living));
    for (int when = 0; when < 2; ++when) {
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0) run_and_die(when);
        int how;
        assert_int_equal(waitpid(child, &how, 0), child);
        assert_true(WIFSIGNALED(how));
        assert_int_equal(count_temporary(), 2);
        assert_text("k/a.txt", "old");
        assert_text("k.txt", "old");
        assert_ok(make_whole("other", "one"));
        assert_int_equal(count_temporary(), 1);  // that of the living run
    }
    write_in(&living, "a.txt", "one");
    assert_ok(om_folder_commit(&living));
    assert_text("living/a.txt", "one");
}

// Killed when the list was written and the name not yet taken: the result is put into its place.
static void a_finished_folder_without_its_name_gets_it(void** state) {
    (void)state;
    OmFolder f;
    char temp[1100];
    assert_ok(make_whole("late", "one"));
    assert_ok(om_folder_begin(in_dir("late2"), "test", &f));
    snprintf(temp, sizeof temp, "%s", f.path);
    om_folder_end(&f);
    assert_ok(rename(in_dir("late"), temp));
    om_path_clean(dir, false);
    assert_text("late/a.txt", "one");
    // the name is taken: the older one is removed, but not with a file of the user in it
    assert_ok(make_whole("late3", "one"));
    assert_ok(rename(in_dir("late3"), temp));
    assert_ok(make_whole("other", "two"));
    assert_text("late3/a.txt", "one");
    assert_ok(rename(in_dir("late3"), temp));
    assert_ok(mkdir(in_dir("late3"), 0777));
    char notes[1200];
    assert_ok(om_path_join(temp, "notes.txt", notes, sizeof notes));
    assert_ok(om_file_write(notes, "mine", 4));
    om_path_clean(dir, false);
    assert_true(om_path_exists(notes));
    assert_ok(unlink(notes));
    om_path_clean(dir, false);
    assert_false(om_path_exists(temp));
}

// ---- inputs ---------------------------------------------------------------------------------------------

static void inputs_are_no_outputs(void** state) {
    (void)state;
    assert_ok(om_path_make_dir(in_dir("i/data")));
    put("i/data/x.csv", "x");
    assert_ok(symlink("data", in_dir("i/link")));
    assert_ok(link(in_dir("i/data/x.csv"), in_dir("i/hard.csv")));
    const struct {
        const char *input, *output;
        bool is_apart;
    } pair[] = {{"i/data/x.csv", "i/data/x.csv", false},
                {"i/data/x.csv", "i/hard.csv", false},
                {"i/link/x.csv", "i/data/x.csv", false},
                {"i/data/x.csv", "i/link", false},
                {"i/data/x.csv", "i/./data/", false},
                {"i/data", "i/data", false},
                {"i/data/x.csv", "i", false},
                {"i/data/x.csv", "i/dat", true},
                {"i/data/x.csv", "i/new/out", true},
                {"i/data", "i/data/out", true},
                {"i/none.csv", "i", true},
                {"i/data/x.csv", "i/link/y.csv", true}};
    for (size_t k = 0; k < sizeof pair / sizeof *pair; ++k) {
        OmStatus status = om_path_check_apart(in_dir(pair[k].input), in_dir(pair[k].output));
        if (status != (pair[k].is_apart ? OM_OK : OM_INVALID))
            fail_msg("%s, %s: %d", pair[k].input, pair[k].output, (int)status);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_whole_folder_replaces_its_like),
        cmocka_unit_test(an_uncommitted_folder_leaves_nothing),
        cmocka_unit_test(nothing_foreign_is_replaced),
        cmocka_unit_test(another_kind_is_not_replaced),
        cmocka_unit_test(neighbours_of_old_names_stay),
        cmocka_unit_test(a_file_added_meanwhile_is_kept),
        cmocka_unit_test(a_part_goes_beside),
        cmocka_unit_test(links_and_dots_lead_to_the_folder),
        cmocka_unit_test(a_folder_that_cannot_be_written),
        cmocka_unit_test(a_growing_folder_goes_on),
        cmocka_unit_test(a_growing_folder_takes_no_folder_of_others),
        cmocka_unit_test(a_cut_list_is_gone_on_with),
        cmocka_unit_test(what_a_kill_leaves_is_cleaned_up),
        cmocka_unit_test(a_finished_folder_without_its_name_gets_it),
        cmocka_unit_test(inputs_are_no_outputs),
    };
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
