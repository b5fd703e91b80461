// Files that appear whole or not at all, and paths.
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "test_folder.h"

static void write_then_read(void** state) {
    (void)state;
    const char bytes[] = {'a', 0, 'b', '\n'};
    assert_ok(om_file_write(in_dir("x.bin"), bytes, sizeof bytes));
    char* data;
    size_t size;
    assert_ok(om_file_read(in_dir("x.bin"), 100, &data, &size));
    assert_int_equal(size, sizeof bytes);
    assert_memory_equal(data, bytes, sizeof bytes);
    assert_int_equal(data[size], 0);
    om_free(data);
    assert_status(om_file_read(in_dir("x.bin"), 3, &data, &size), OM_INVALID);
    assert_status(om_file_read(in_dir("none"), 3, &data, &size), OM_IO);
    assert_non_null(strstr(om_error_message(), "No such file"));
    assert_status(om_file_read(dir, 3, &data, &size), OM_IO);
}

// What is no regular file is refused at once: a pipe without a writer would keep the reader for ever.
static void only_files_are_read(void** state) {
    (void)state;
    char pipe[256], sock[256], link[256];
    snprintf(pipe, sizeof pipe, "%s", in_dir("pipe"));
    snprintf(sock, sizeof sock, "%s", in_dir("socket"));
    snprintf(link, sizeof link, "%s", in_dir("link"));
    assert_int_equal(mkfifo(pipe, 0600), 0);
    assert_int_equal(symlink("pipe", link), 0);
    struct sockaddr_un name = {.sun_family = AF_UNIX};
    snprintf(name.sun_path, sizeof name.sun_path, "%.100s", sock);
    int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_int_equal(bind(fd, (struct sockaddr*)&name, sizeof name), 0);
    const struct {
        const char *path, *kind;
    } other[] = {{pipe, "a pipe"},
                 {link, "a pipe"},
                 {sock, "a socket"},
                 {"/dev/zero", "a device"},
                 {dir, "a folder"}};
    for (size_t i = 0; i < sizeof other / sizeof *other; ++i) {
        char* data;
        size_t size;
        FILE* stream;
        assert_status(om_file_read(other[i].path, 100, &data, &size), OM_IO);
        assert_null(data);
        assert_non_null(strstr(om_error_message(), other[i].path));
        assert_non_null(strstr(om_error_message(), other[i].kind));
        assert_status(om_file_open(other[i].path, &stream, NULL), OM_IO);
        assert_null(stream);
    }
    close(fd);
    assert_int_equal(remove(pipe) + remove(sock) + remove(link), 0);
}

static void json_is_saved_and_freed(void** state) {
    (void)state;
    int64_t alive = om_alloc_alive();
    for (int k = 0; k < 2; ++k) {
        OmText text = {0};
        OmJson json = om_json_begin(&text);
        om_json_open(&json, NULL, '{');
        om_json_integer(&json, "n", 7);
        om_json_close(&json, '}');
        assert_status(om_json_save(&json, in_dir(k ? "none/n.json" : "n.json")), k ? OM_IO : OM_OK);
        assert_int_equal(om_alloc_alive(), alive);
    }
    char* data;
    size_t size;
    assert_ok(om_file_read(in_dir("n.json"), 100, &data, &size));
    assert_string_equal(data, "{\n  \"n\": 7\n}\n");
    om_free(data);
}

static void aborted_files_leave_the_old_one(void** state) {
    (void)state;
    assert_ok(om_file_write(in_dir("y"), "old", 3));
    OmAtomicFile file;
    assert_ok(om_file_begin(in_dir("y"), &file));
    fputs("new and unfinished", file.stream);
    char temp[1100];
    snprintf(temp, sizeof temp, "%s", file.temp);
    assert_true(om_path_exists(temp));
    om_file_abort(&file);
    assert_false(om_path_exists(temp));
    char* data;
    size_t size;
    assert_ok(om_file_read(in_dir("y"), 100, &data, &size));
    assert_string_equal(data, "old");
    om_free(data);
}

static void a_full_disk_is_reported(void** state) {
    (void)state;
    if (!om_path_exists("/dev/full")) test_skip("no /dev/full");
    OmAtomicFile file;
    assert_ok(om_file_begin(in_dir("z"), &file));
    fclose(file.stream);
    file.stream = fopen("/dev/full", "wb");
    assert_non_null(file.stream);
    for (int i = 0; i < 100000; ++i) fputs("0123456789", file.stream);
    assert_status(om_file_commit(&file), OM_IO);
    assert_non_null(strstr(om_error_message(), "No space left"));
    assert_false(om_path_exists(in_dir("z")));
    assert_false(om_path_exists(file.temp));
}

static void assert_text(const char* name, const char* text) {
    char* data;
    size_t size;
    assert_ok(om_file_read(in_dir(name), 10000, &data, &size));
    assert_string_equal(data, text);
    om_free(data);
}

static void links_are_followed(void** state) {
    (void)state;
    char real[256];
    snprintf(real, sizeof real, "%s", in_dir("real.txt"));
    assert_ok(om_file_write(real, "one", 3));
    assert_ok(symlink("real.txt", in_dir("soft.txt")));
    assert_ok(om_file_write(in_dir("soft.txt"), "two", 3));
    assert_text("real.txt", "two");
    struct stat st;
    assert_ok(lstat(in_dir("soft.txt"), &st));
    assert_true(S_ISLNK(st.st_mode));
    assert_ok(symlink("made.txt", in_dir("loose.txt")));
    assert_ok(om_file_write(in_dir("loose.txt"), "new", 3));
    assert_text("made.txt", "new");
    assert_ok(symlink("round.txt", in_dir("round.txt")));
    assert_status(om_file_write(in_dir("round.txt"), "x", 1), OM_IO);
    // another name of the same bytes keeps them
    char hard[256];
    snprintf(hard, sizeof hard, "%s", in_dir("hard.txt"));
    assert_ok(link(real, hard));
    assert_ok(chmod(real, 0640));
    assert_ok(om_file_write(real, "three", 5));
    assert_text("real.txt", "three");
    assert_text("hard.txt", "two");
    assert_ok(stat(real, &st));
    assert_int_equal(st.st_mode & 0777, 0640);
}

static void what_is_no_file_is_not_replaced(void** state) {
    (void)state;
    struct stat st;
    assert_status(om_file_write("/dev/full", "x", 1), OM_IO);
    assert_non_null(strstr(om_error_message(), "No space left"));
    assert_ok(stat("/dev/full", &st));
    assert_true(S_ISCHR(st.st_mode));
    assert_ok(om_file_write("/dev/null", "x", 1));
    assert_ok(stat("/dev/null", &st));
    assert_true(S_ISCHR(st.st_mode));
    char pipe[256];
    snprintf(pipe, sizeof pipe, "%s", in_dir("pipe"));
    assert_ok(mkfifo(pipe, 0666));
    assert_status(om_file_write(pipe, "x", 1), OM_IO);
    assert_non_null(strstr(om_error_message(), "no program reads"));
    int fd = open(pipe, O_RDONLY | O_NONBLOCK);
    assert_ok(om_file_write(pipe, "through", 7));
    char got[16];
    assert_int_equal(read(fd, got, sizeof got), 7);
    assert_memory_equal(got, "through", 7);
    close(fd);
    assert_ok(lstat(pipe, &st));
    assert_true(S_ISFIFO(st.st_mode));
    assert_ok(om_path_make_dir(in_dir("folder")));
    assert_status(om_file_write(in_dir("folder"), "x", 1), OM_IO);
    assert_non_null(strstr(om_error_message(), "is a folder"));
    // an open file is written at its position, and stays the same file
    char name[64];
    fd = open(in_dir("open.txt"), O_RDWR | O_CREAT, 0666);
    assert_int_equal(write(fd, "before ", 7), 7);
    snprintf(name, sizeof name, "/dev/fd/%d", fd);
    assert_ok(om_file_write(name, "and after", 9));
    assert_int_equal(write(fd, " all", 4), 4);
    close(fd);
    assert_text("open.txt", "before and after all");
}

static void files_that_a_user_named(void** state) {
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s", in_dir("named.csv"));
    assert_ok(om_file_check_ours(path, NULL));
    OmText text = {0};
    assert_ok(om_text_append(&text, "a,b\n1,2\n"));
    assert_ok(om_text_seal(&text));
    assert_ok(om_file_write(path, text.str, text.len));
    assert_ok(om_file_check_ours(path, NULL));
    assert_ok(om_file_check_ours(path, "a,b"));
    text.str[4] = '3';
    assert_ok(om_file_write(path, text.str, text.len));
    assert_status(om_file_check_ours(path, NULL), OM_INVALID);
    assert_status(om_file_check_ours(path, "none"), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "name another file"));
    om_text_done(&text);
    assert_ok(om_file_write(path, "", 0));
    assert_ok(om_file_check_ours(path, NULL));  // nothing is lost
    assert_ok(om_file_check_ours("/dev/full", NULL));
}

static void paths(void** state) {
    (void)state;
    char out[1024];
    om_path_extension("/a.b/Organ.NII.gz", out, sizeof out);
    assert_string_equal(out, "nii.gz");
    om_path_extension("mesh.vtu", out, sizeof out);
    assert_string_equal(out, "vtu");
    om_path_extension("/a.b/none", out, sizeof out);
    assert_string_equal(out, "");
    assert_ok(om_path_dir("/a/b/c.txt", out, sizeof out));
    assert_string_equal(out, "/a/b");
    assert_ok(om_path_dir("c.txt", out, sizeof out));
    assert_string_equal(out, ".");
    assert_ok(om_path_share("weights/README.md", out, sizeof out));
    assert_true(om_path_exists(out));
    assert_status(om_path_share("weights/no_such_file", out, sizeof out), OM_IO);
    assert_ok(om_path_join("/a/", "b", out, sizeof out));
    assert_string_equal(out, "/a/b");
    assert_ok(om_path_join("/a", "/b", out, sizeof out));
    assert_string_equal(out, "/b");
    assert_status(om_path_join("/a", "b", out, 3), OM_INVALID);
    assert_ok(om_path_make_dir(in_dir("p/q/r")));
    assert_ok(om_path_make_dir(in_dir("p/q/r")));
    assert_ok(om_file_write(in_dir("p/q/r/f"), "", 0));
    assert_ok(om_path_remove(in_dir("p")));
    assert_false(om_path_exists(in_dir("p")));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(write_then_read),
        cmocka_unit_test(only_files_are_read),
        cmocka_unit_test(json_is_saved_and_freed),
        cmocka_unit_test(aborted_files_leave_the_old_one),
        cmocka_unit_test(a_full_disk_is_reported),
        cmocka_unit_test(links_are_followed),
        cmocka_unit_test(what_is_no_file_is_not_replaced),
        cmocka_unit_test(files_that_a_user_named),
        cmocka_unit_test(paths),
    };
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
