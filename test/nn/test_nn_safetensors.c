// test_nn_safetensors.c: files of tensors: what is written comes back, and nothing else is believed.
#include "omentum/nn_file.h"
#include "test_alloc.h"
#include "test_files.h"

// A file of a header and data, read from the disk.
static OmStatus load_made(const char* header, const void* data, size_t ndata, OmTensorFile** file) {
    unsigned char bytes[8192];
    size_t nheader = strlen(header);
    for (int i = 0; i < 8; ++i) bytes[i] = (unsigned char)((uint64_t)nheader >> 8 * i);
    memcpy(bytes + 8, header, nheader);
    if (ndata) memcpy(bytes + 8 + nheader, data, ndata);
    const char* path = temp_path("made.safetensors");
    write_bytes(path, bytes, 8 + nheader + ndata);
    OmStatus status = om_tensor_file_load(path, file);
    remove(path);
    return status;
}

static void refused(const char* header, size_t ndata, const char* sentence) {
    unsigned char data[256] = {0};
    OmTensorFile* file;
    assert_status(load_made(header, data, ndata, &file), OM_INVALID);
    assert_null(file);
    if (!strstr(om_error_message(), sentence))
        fail_msg("\"%s\" does not say \"%s\"", om_error_message(), sentence);
    assert_non_null(strstr(om_error_message(), "made.safetensors"));
}

static const float a_value[6] = {1, -2, 3.5F, 0, 1e-45F, 3.4e38F};
static const double b_value[2] = {0.1, -1e300};
static const OmTensor three[] = {
    {"first.weight", OM_TENSOR_F32, 2, {3, 2}, a_value},
    {"moments", OM_TENSOR_F64, 1, {2}, b_value},
    {"one", OM_TENSOR_F32, 0, {0}, a_value + 2},
};
static const OmTextPair about[] = {{"units", "m"}, {"quoted", "a \"b\"\n\\ \xc3\xa9"}};

static void test_round_trip(void** state) {
    (void)state;
    const char* path = temp_path("three.safetensors");
    OmTensorFile* file;
    assert_ok(om_tensor_file_save(three, 3, about, 2, path));
    assert_ok(om_tensor_file_load(path, &file));
    assert_int_equal(om_tensor_file_count(file), 3);
    assert_string_equal(om_tensor_file_get(file, 0)->name, "moments");  // doubles come first
    assert_int_equal(om_tensor_file_find(file, "one"), 2);
    assert_int_equal(om_tensor_file_find(file, "two"), -1);
    assert_string_equal(om_tensor_file_meta(file, "units"), "m");
    assert_string_equal(om_tensor_file_meta(file, "quoted"), about[1].value);
    assert_null(om_tensor_file_meta(file, "nothing"));

    float a[6], one;
    double b[2];
    assert_ok(om_tensor_file_read(file, "first.weight", 2, three[0].dim, a));
    assert_memory_equal(a, a_value, sizeof a);
    assert_ok(om_tensor_file_read_double(file, "moments", 1, three[1].dim, b));
    assert_memory_equal(b, b_value, sizeof b);
    assert_ok(om_tensor_file_read(file, "one", 0, NULL, &one));
    assert_true(one == 3.5F);
    om_tensor_file_destroy(file);
    om_tensor_file_destroy(NULL);
    remove(path);
}

static void test_layout_of_bytes(void** state) {
    (void)state;
    const char* path = temp_path("three.safetensors");
    char* bytes;
    size_t size;
    assert_ok(om_tensor_file_save(three, 3, NULL, 0, path));
    assert_ok(om_file_read(path, 1 << 20, &bytes, &size));
    uint64_t nheader = 0;
    for (int i = 7; i >= 0; --i) nheader = nheader << 8 | (unsigned char)bytes[i];
    assert_int_equal(nheader % 8, 0);
    assert_int_equal(size, 8 + nheader + 2 * sizeof(double) + 7 * sizeof(float));
    assert_int_equal(bytes[8], '{');
    const unsigned char expected[4] = {0, 0, 0x80,
                                       0x3f};  // 1.0F, little-endian, behind the doubles
    assert_memory_equal(bytes + 8 + nheader + 16, expected, 4);
    om_free(bytes);
    remove(path);
}

static void test_no_tensors(void** state) {
    (void)state;
    OmTensorFile* file;
    assert_ok(load_made("{}", NULL, 0, &file));
    assert_int_equal(om_tensor_file_count(file), 0);
    assert_null(om_tensor_file_meta(file, "units"));
    om_tensor_file_destroy(file);
    // An empty tensor's other dimensions are not multiplied.
    assert_ok(
        load_made("{\"a\":{\"dtype\":\"F32\",\"shape\":[9223372036854775807,9223372036854775807,0],"
                  "\"data_offsets\":[0,0]}}",
                  NULL, 0, &file));
    assert_int_equal(om_tensor_count(om_tensor_file_get(file, 0)), 0);
    om_tensor_file_destroy(file);
}

static void test_types(void** state) {
    (void)state;
    // binary16: 1, -2, the least subnormal 2^-24, the largest 65504; bfloat16: 1, -2, 2^127
    const uint16_t data[8] = {0x3c00, 0xc000, 0x0001, 0x7bff, 0x3f80, 0xc000, 0x7f00, 0};
    const int64_t four = 4, three_long = 3;
    OmTensorFile* file;
    assert_ok(load_made("{\"h\":{\"dtype\":\"F16\",\"shape\":[4],\"data_offsets\":[0,8]},"
                        "\"b\":{\"dtype\":\"BF16\",\"shape\":[3],\"data_offsets\":[8,14]},"
                        "\"i\":{\"dtype\":\"I16\",\"shape\":[],\"data_offsets\":[14,16]}}   ",
                        data, 16, &file));
    float v[4];
    double d[3];
    assert_ok(om_tensor_file_read(file, "h", 1, &four, v));
    assert_true(v[0] == 1 && v[1] == -2 && v[2] == 0x1p-24F && v[3] == 65504);
    assert_ok(om_tensor_file_read_double(file, "b", 1, &three_long, d));
    assert_true(d[0] == 1 && d[1] == -2 && d[2] == 0x1p127);
    assert_status(om_tensor_file_read(file, "i", 0, NULL, v), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "I16"));
    om_tensor_file_destroy(file);
}

// Every binary16 number against its definition.
static void test_all_halves(void** state) {
    (void)state;
    for (uint32_t bits = 0; bits < 0x10000; bits += 7) {
        const uint16_t half = (uint16_t)bits;
        OmTensorFile* file;
        float v;
        assert_ok(load_made("{\"h\":{\"dtype\":\"F16\",\"shape\":[],\"data_offsets\":[0,2]}}",
                            &half, 2, &file));
        bool is_finite = (bits >> 10 & 31) != 31;
        assert_status(om_tensor_file_read(file, "h", 0, NULL, &v), is_finite ? OM_OK : OM_INVALID);
        double size = bits & 0x7c00
                          ? (1 + (bits & 1023) / 1024.0) * pow(2, (bits >> 10 & 31) - 15.0)
                          : (bits & 1023) / 1024.0 * pow(2, -14);
        if (is_finite) assert_near((double)v, bits >> 15 ? -size : size, 0);
        om_tensor_file_destroy(file);
    }
}

static void test_values_not_finite(void** state) {
    (void)state;
    const float nan[2] = {1, NAN};
    const double large = 1e300;
    const int64_t two = 2;
    OmTensorFile* file;
    float v[2];
    double d;
    assert_ok(load_made("{\"w\":{\"dtype\":\"F32\",\"shape\":[2],\"data_offsets\":[0,8]}}", nan, 8,
                        &file));
    assert_status(om_tensor_file_read(file, "w", 1, &two, v), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "\"w\": value 1 is"));
    om_tensor_file_destroy(file);
    // A double that is no float is not finite as one.
    assert_ok(load_made("{\"w\":{\"dtype\":\"F64\",\"shape\":[],\"data_offsets\":[0,8]}}", &large,
                        8, &file));
    assert_status(om_tensor_file_read(file, "w", 0, NULL, v), OM_INVALID);
    assert_ok(om_tensor_file_read_double(file, "w", 0, NULL, &d));
    om_tensor_file_destroy(file);

    const char* path = temp_path("nan.safetensors");
    const OmTensor bad = {"w", OM_TENSOR_F32, 1, {2}, nan};
    assert_status(om_tensor_file_save(&bad, 1, NULL, 0, path), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "value 1"));
    assert_false(om_path_exists(path));
}

static void test_wrong_shape(void** state) {
    (void)state;
    const float data[6] = {0};
    const int64_t other[2] = {2, 3}, shorter[1] = {6};
    OmTensorFile* file;
    float v[6];
    assert_ok(load_made("{\"w\":{\"dtype\":\"F32\",\"shape\":[3,2],\"data_offsets\":[0,24]}}", data,
                        24, &file));
    assert_status(om_tensor_file_read(file, "w", 2, other, v), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "\"w\" has the shape [3, 2], [2, 3] is expected"));
    assert_status(om_tensor_file_read(file, "w", 1, shorter, v), OM_INVALID);
    assert_status(om_tensor_file_read(file, "x", 1, shorter, v), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "has no tensor \"x\" of shape [6]"));
    om_tensor_file_destroy(file);
}

static void test_hostile_headers(void** state) {
    (void)state;
#define ONE(type, shape, offsets) \
    "{\"w\":{\"dtype\":\"" type "\",\"shape\":" shape ",\"data_offsets\":" offsets "}}"
    refused("", 0, "not a safetensors file");
    refused("[]", 0, "does not begin with {");
    refused("{", 0, "header");
    refused("{\"w\":{\"dtype\":\"F32\"", 0, "header, byte");
    refused("{}x", 0, "header, byte");
    refused("{\"w\":1}", 0, "{..} is expected");
    refused(ONE("F33", "[1]", "[0,4]"), 4, "unknown type \"F33\"");
    refused("{\"w\":{\"shape\":[1],\"data_offsets\":[0,4]}}", 4, "no text \"dtype\"");
    refused("{\"w\":{\"dtype\":4,\"shape\":[1],\"data_offsets\":[0,4]}}", 4, "no text \"dtype\"");
    refused(ONE("F32", "1", "[0,4]"), 4, "no list \"shape\"");
    refused(ONE("F32", "[1.0]", "[0,4]"), 4, "not a whole number");
    refused(ONE("F32", "[-1]", "[0,4]"), 4, "not a whole number");
    refused(ONE("F32", "[1,1,1,1,1,1,1,1,1]", "[0,4]"), 4, "9 dimensions, at most 8");
    refused(ONE("F32", "[1]", "[0]"), 4, "no list \"data_offsets\"");
    refused(ONE("F32", "[1]", "[0,4,8]"), 4, "no list \"data_offsets\"");
    refused(ONE("F32", "[1]", "[0.0,4]"), 4, "no list \"data_offsets\"");
    refused(ONE("F32", "[1]", "{}"), 4, "no list \"data_offsets\"");
    refused(ONE("F32", "[1]", "[0,8]"), 4, "truncated or damaged");
    refused(ONE("F32", "[1]", "[4,0]"), 4, "truncated or damaged");
    refused(ONE("F32", "[1]", "[-4,0]"), 4, "truncated or damaged");
    refused(ONE("F32", "[2]", "[0,4]"), 4, "of shape [2] does not fill its 4 bytes");
    refused(ONE("F32", "[4611686018427387905,4]", "[0,4]"), 4, "does not fill");  // 2^64 + 16
    refused(ONE("F32", "[99999999999999999999]", "[0,4]"), 4, "header, byte");
    refused(ONE("F32", "[1]", "[0,4]"), 8, "4 bytes at its end belong to no tensor");
    refused(ONE("F32", "[1]", "[4,8]"), 8, "after a gap");
    refused("{\"a\":{\"dtype\":\"F32\",\"shape\":[2],\"data_offsets\":[0,8]},"
            "\"b\":{\"dtype\":\"F32\",\"shape\":[2],\"data_offsets\":[4,12]}}",
            12, "\"b\" overlaps another");
    refused("{\"a\":{\"dtype\":\"U8\",\"shape\":[1],\"data_offsets\":[0,1]},"
            "\"a\":{\"dtype\":\"U8\",\"shape\":[1],\"data_offsets\":[1,2]}}",
            2, "duplicate");
    refused("{\"__metadata__\":[]}", 0, "is not {..}");
    refused("{\"__metadata__\":{\"a\":1}}", 0, "not a text");
    refused("{\"\\u0000\":{}}", 0, "header, byte");
    refused("{\"\xff\":{}}", 0, "header, byte");
#undef ONE
}

static void test_broken_files(void** state) {
    (void)state;
    const char* path = temp_path("broken.safetensors");
    OmTensorFile* file;
    assert_status(om_tensor_file_load("/nowhere/at.all", &file), OM_IO);
    write_bytes(path, "{}", 2);
    assert_status(om_tensor_file_load(path, &file), OM_INVALID);
    const unsigned char large[9] = {0, 0, 0, 0, 0, 0, 0, 0x80, '{'};
    write_bytes(path, large, sizeof large);
    assert_status(om_tensor_file_load(path, &file), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "a header of 9223372036854775808 bytes"));
    const unsigned char short_by_one[9] = {2, 0, 0, 0, 0, 0, 0, 0, '{'};
    write_bytes(path, short_by_one, sizeof short_by_one);
    assert_status(om_tensor_file_load(path, &file), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "truncated"));
    assert_null(file);
    remove(path);
}

static void test_what_is_not_written(void** state) {
    (void)state;
    const char* path = temp_path("refused.safetensors");
    OmTensor two[2] = {three[0], three[0]};
    assert_status(om_tensor_file_save(two, 2, NULL, 0, path), OM_INVALID);  // the same name twice
    assert_non_null(strstr(om_error_message(), "duplicate"));
    two[0].type = OM_TENSOR_BF16;
    assert_status(om_tensor_file_save(two, 1, NULL, 0, path), OM_INVALID);
    two[1].dim[0] = -1;
    assert_status(om_tensor_file_save(two + 1, 1, NULL, 0, path), OM_INVALID);
    two[1].rank = 9;
    assert_status(om_tensor_file_save(two + 1, 1, NULL, 0, path), OM_INVALID);
    const OmTextPair no_text = {"latin", "caf\xe9"};
    assert_status(om_tensor_file_save(three, 3, &no_text, 1, path), OM_INVALID);
    assert_false(om_path_exists(path));
    assert_status(om_tensor_file_save(three, 3, NULL, 0, "/nowhere/at/all.safetensors"), OM_IO);
}

static OmStatus save_and_load(void* path) {
    OmTensorFile* file;
    OM_TRY(om_tensor_file_save(three, 3, about, 2, path));
    OM_TRY(om_tensor_file_load(path, &file));
    om_tensor_file_destroy(file);
    return OM_OK;
}

static void test_what_a_file_says_of_itself(void** state) {
    (void)state;
    OmFacts facts = {0};
    assert_ok(om_facts_add(&facts, "samples", "%d", 12));
    assert_ok(om_facts_add(&facts, "data", "none"));
    assert_string_equal(om_facts_find(&facts, "samples"), "12");
    assert_null(om_facts_find(&facts, "seed"));
    char sum[24];
    OmTensorFile* file;
    int value = 0;
    const char* path = temp_path("facts.safetensors");
    uint64_t expected = om_tensor_checksum(three, 3);
    const OmTensor turned[] = {three[2], three[1], three[0]};
    assert_true(om_tensor_checksum(turned, 3) == expected);
    for (int wrong = 0; wrong < 2; ++wrong) {
        snprintf(sum, sizeof sum, "%016llx", (unsigned long long)expected + (unsigned)wrong);
        OmTextPair meta[] = {facts.pair[0], facts.pair[1], {"checksum", sum}};
        assert_ok(om_tensor_file_save(three, 3, meta, 3, path));
        assert_ok(om_tensor_file_load(path, &file));
        assert_status(om_tensor_file_check(file, path), wrong ? OM_INVALID : OM_OK);
        assert_ok(om_tensor_file_setting(file, path, "samples", 1, 12, &value));
        assert_int_equal(value, 12);
        assert_status(om_tensor_file_setting(file, path, "samples", 1, 11, &value), OM_INVALID);
        assert_status(om_tensor_file_setting(file, path, "data", 1, 11, &value), OM_INVALID);
        assert_status(om_tensor_file_setting(file, path, "seed", 1, 11, &value), OM_INVALID);
        om_tensor_file_destroy(file);
    }
    while (facts.n < OM_FACTS_MAX) assert_ok(om_facts_add(&facts, "more", "%s", ""));
    assert_status(om_facts_add(&facts, "more", "%s", ""), OM_INVALID);
    om_facts_done(&facts);
    remove(path);
}

static void test_no_memory(void** state) {
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s", temp_path("memory.safetensors"));
    assert_true(test_failing_allocations(save_and_load, path, 1) > 5);
    remove(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),   cmocka_unit_test(test_layout_of_bytes),
        cmocka_unit_test(test_no_tensors),   cmocka_unit_test(test_types),
        cmocka_unit_test(test_all_halves),   cmocka_unit_test(test_values_not_finite),
        cmocka_unit_test(test_wrong_shape),  cmocka_unit_test(test_hostile_headers),
        cmocka_unit_test(test_broken_files), cmocka_unit_test(test_what_is_not_written),
        cmocka_unit_test(test_no_memory),    cmocka_unit_test(test_what_a_file_says_of_itself),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
