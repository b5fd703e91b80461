// test_nn_store.c: arrays and records in files: back as written; damaged, foreign and wrong ones refused.
#include <string.h>
#include <unistd.h>

#include "omentum/nn_store.h"
#include "test_alloc.h"
#include "test_files.h"

typedef struct Record {
    double a[3];
    int other;  // no field
    int b;
} Record;

static const OmStoreField field[] = {
    {"a", "m", offsetof(Record, a), OM_STORE_F64, 3},
    {"b", NULL, offsetof(Record, b), OM_STORE_I32, 1},
};

static OmStatus save(const float* value, const char* path) {
    const Record record[2] = {{{1, 2, 3}, 4, 5}, {{-1, -2, -3}, -4, -5}};
    const int16_t small[4] = {-32768, -1, 0, 32767};
    const uint64_t seed = 1ull << 63;
    OmStoreWriter* w;
    OM_TRY(om_store_begin("omentum test", 3, &w));
    om_store_text(w, "about", "a test");
    om_store_text(w, "nothing", "");
    om_store_value(w, "seed", OM_STORE_U64, 1, &seed);
    om_store_value(w, "place", OM_STORE_F64, 3, record[0].a);
    om_store_group(w, "set");
    om_store_array(w, "set/value", OM_STORE_F32, (int[3]){2, 3}, 1, "m", value);
    om_store_array(w, "small", OM_STORE_I16, (int[3]){4}, 4, NULL, small);
    om_store_records(w, "set", field, 2, record, sizeof *record, 2);
    return om_store_save(w, path);
}

static const float numbers[6] = {1, 2.5f, -3, 4, 5, 1e-30f};

static void test_round_trip(void** state) {
    (void)state;
    char path[300], *data;
    size_t size;
    snprintf(path, sizeof path, "%s", temp_path("store.h5"));
    assert_ok(save(numbers, path));
    assert_ok(om_file_read(path, 1 << 20, &data, &size));
    OmStoreReader* r;
    assert_ok(om_store_open(data, size, "omentum test", 3, "name", &r));
    uint64_t seed;
    double place[3];
    float value[6];
    int16_t small[4];
    Record record[2];
    memset(record, 7, sizeof record);
    const int other = record[0].other;
    assert_ok(om_store_get_value(r, "seed", OM_STORE_U64, 1, &seed));
    assert_true(seed == 1ull << 63);
    assert_ok(om_store_get_value(r, "place", OM_STORE_F64, 3, place));
    assert_true(place[2] == 3);
    assert_ok(om_store_get_array(r, "set/value", OM_STORE_F32, (int[3]){2, 3}, value));
    assert_memory_equal(value, numbers, sizeof value);
    assert_ok(om_store_get_array(r, "small", OM_STORE_I16, (int[3]){4}, small));
    assert_true(small[0] == -32768 && small[1] == -1 && small[3] == 32767);
    assert_ok(om_store_get_records(r, "set", field, 2, record, sizeof *record, 2));
    assert_true(record[1].a[1] == -2 && record[1].b == -5 && record[0].b == 5);
    assert_true(record[0].other == other);
    char text[8];
    assert_ok(om_store_get_text(r, "about", text, 7));  // six letters and the end
    assert_string_equal(text, "a test");
    assert_status(om_store_get_text(r, "about", text, 6), OM_INVALID);
    assert_string_equal(text, "");
    strcpy(text, "x");
    assert_ok(om_store_get_text(r, "nowhere", text, sizeof text));
    assert_string_equal(text, "");
    assert_ok(om_store_get_text(r, "nothing", text, sizeof text));
    assert_string_equal(text, "");
    assert_status(om_store_get_text(r, "seed", text, sizeof text), OM_INVALID);
    // shapes and names
    assert_status(om_store_check_array(r, "set/value", (int[3]){3, 2}), OM_INVALID);
    assert_status(om_store_check_array(r, "set/value", (int[3]){6}), OM_INVALID);
    assert_status(om_store_check_array(r, "set/nothing", (int[3]){6}), OM_INVALID);
    assert_status(om_store_get_value(r, "place", OM_STORE_F64, 2, place), OM_INVALID);
    assert_status(om_store_get_value(r, "none", OM_STORE_F64, 2, place), OM_INVALID);
    assert_status(om_store_get_records(r, "set", field, 2, record, sizeof *record, 1), OM_INVALID);
    om_store_close(r);
    om_free(data);
    assert_ok(om_path_remove(path));
}

// A file of the name that HDF5 is given for the memory, in the current folder.
static void test_beside_a_program(void** state) {
    (void)state;
    char here[1024], dir[256], path[320], *data;
    size_t size;
    OmStoreReader* r;
    assert_non_null(getcwd(here, sizeof here));
    snprintf(dir, sizeof dir, "%s", temp_path("beside"));
    snprintf(path, sizeof path, "%s/store", dir);
    assert_ok(om_path_make_dir(dir));
    assert_int_equal(chdir(dir), 0);
    assert_ok(om_file_write("omentum", "program", 7));
    assert_ok(save(numbers, path));
    assert_ok(om_file_read(path, 1 << 20, &data, &size));
    assert_ok(om_store_open(data, size, "omentum test", 3, "name", &r));
    om_store_close(r);
    om_free(data);
    assert_int_equal(chdir(here), 0);
    assert_ok(om_path_remove(dir));
}

static void assert_refused(const char* data, size_t size, const char* kind, int format,
                           const char* why) {
    OmStoreReader* r;
    assert_true(om_store_open(data, size, kind, format, "name", &r) < 0);
    assert_null(r);
    if (!strstr(om_error_message(), why)) fail_msg("\"%s\" lacks \"%s\"", om_error_message(), why);
}

static void test_refused(void** state) {
    (void)state;
    char path[300], *data;
    size_t size;
    snprintf(path, sizeof path, "%s", temp_path("store2.h5"));
    assert_ok(save(numbers, path));
    assert_ok(om_file_read(path, 1 << 20, &data, &size));
    assert_refused(data, size, "omentum else", 3, "not a file of samples");
    assert_refused(data, size, "omentum test", 4, "format 3");
    assert_refused(data, size - 1, "omentum test", 3, "truncated");
    assert_refused(data, 20, "omentum test", 3, "truncated");
    assert_refused(data, 0, "omentum test", 3, "not a file of samples");
    for (size_t at = 512; at < size; at += 97) {
        data[at] ^= 1;
        assert_refused(data, size, "omentum test", 3, "corrupted");
        data[at] ^= 1;
    }
    om_free(data);
    // a value that is not finite
    const float bad[6] = {1, 2, 3, NAN, 5, 6};
    float value[6];
    OmStoreReader* r;
    assert_ok(save(bad, path));
    assert_ok(om_file_read(path, 1 << 20, &data, &size));
    assert_ok(om_store_open(data, size, "omentum test", 3, "name", &r));
    assert_status(om_store_get_array(r, "set/value", OM_STORE_F32, (int[3]){2, 3}, value),
                  OM_INVALID);
    assert_non_null(strstr(om_error_message(), "value 3"));
    om_store_close(r);
    om_free(data);
    assert_ok(om_path_remove(path));
    // a dataset twice is a failure of HDF5, reported at the end
    OmStoreWriter* w;
    assert_ok(om_store_begin("omentum test", 3, &w));
    om_store_array(w, "twice", OM_STORE_F32, (int[3]){6}, 6, NULL, numbers);
    om_store_array(w, "twice", OM_STORE_F32, (int[3]){6}, 6, NULL, numbers);
    assert_status(om_store_save(w, path), OM_IO);
    assert_false(om_path_exists(path));
}

static OmStatus save_work(void* ctx) { return save(numbers, ctx); }

static void test_memory(void** state) {
    (void)state;
    char path[300];
    snprintf(path, sizeof path, "%s", temp_path("store3.h5"));
    assert_true(test_failing_allocations(save_work, path, 1) >= 4);
    assert_ok(om_path_remove(path));
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_beside_a_program),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
