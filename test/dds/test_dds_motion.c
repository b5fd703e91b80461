// test_dds_motion.c: the motion of an arm in a recording that another program wrote (rosbags 0.11.9, MCAP).
//
// The path is lift.csv of test/cli/rl_motion.cmd: 31 poses of PSM2 in 3 s along three straight lines. From the third on
// an angle of the jaw, 0.01 rad times its number, follows each pose; the sixth pose is there twice.
#include <string.h>

#include "omentum/dds.h"
#include "test_alloc.h"
#include "test_common.h"

#define PATH "fuzz/corpus/dds_motion/lift.mcap"

static char* data;
static size_t size;

static OmStatus parse(const char* arm, OmDdsMotion* m) {
    return om_dds_motion_parse(data, size, "lift.mcap", arm, m);
}

static void another_programs_recording(void** unused) {
    (void)unused;
    static const double row[4][3] = {
        {-0.05, 0.004, 0.04}, {-0.046, 0.001, 0.022}, {-0.02, 0.002, 0.075}, {0, 0, 0.095}};
    OmDdsMotion m;
    assert_ok(om_dds_motion_load(PATH, "PSM2", &m));
    assert_int_equal(m.n, 31);
    assert_true(m.has_jaw);
    assert_string_equal(m.frame, "world");
    for (int i = 0; i < m.n; ++i) {
        const int k = i < 30 ? i / 10 : 2;
        const OmVec3 p = om_lerp(om_load3(row[k], 0), om_load3(row[k + 1], 0), (i - 10 * k) / 10.0);
        assert_near(om_distance(m.tip[i].p, p), 0, 1e-15);
        assert_near(fabs(m.tip[i].q.x), 1, 0);
        assert_near(m.time[i], 100 + 0.1 * i, 1e-9);
        assert_int_equal(m.message[i], i < 6 ? i + 1 : i + 2);
        assert_near(m.jaw[i], i < 3 ? 0.02 : 0.01 * (i - 1), 1e-15);
    }
    om_dds_motion_done(&m);
}

static void refused(void** unused) {
    (void)unused;
    OmDdsMotion m;
    assert_status(parse("PSM1", &m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no message on topic /PSM1/measured_cp"));
    assert_null(m.time);
    assert_status(om_dds_motion_load("no.mcap", "PSM2", &m), OM_IO);
    assert_status(om_dds_motion_parse("time,x,y,z\n", 11, "a.csv", "PSM2", &m), OM_INVALID);
    // the chunk begins behind magic and Header; its 28 bytes of times, size and CRC end before its compression
    const size_t chunk = 8 + 9 + 26;
    assert_int_equal(data[chunk], 6);
    char* other = malloc(size + 4);
    memcpy(other, data, chunk + 9 + 28);
    memcpy(other + chunk + 9 + 28, "\4\0\0\0zstd", 8);
    memcpy(other + chunk + 9 + 28 + 8, data + chunk + 9 + 28 + 4, size - chunk - 9 - 28 - 4);
    assert_status(om_dds_motion_parse(other, size + 4, "a.mcap", "PSM2", &m), OM_UNAVAILABLE);
    assert_non_null(strstr(om_error_message(), "compressed (zstd)"));
    // a chunk that was torn
    memcpy(other, data, size);
    other[chunk + 3000] ^= 1;
    assert_status(om_dds_motion_parse(other, size, "a.mcap", "PSM2", &m), OM_INVALID);
    free(other);
}

// A damaged chunk before another one is an error, and no end of the file; so is a clock that goes back.
static void damaged(void** unused) {
    (void)unused;
    OmDdsMotion m;
    const size_t chunk = 8 + 9 + 26;
    uint64_t content = 0;
    for (int i = 8; i > 0; --i) content = content << 8 | (unsigned char)data[chunk + (size_t)i];
    const size_t end = chunk + 9 + (size_t)content;
    char* two = malloc(size + end - chunk);
    memcpy(two, data, end);
    memcpy(two + end, data + chunk, size - chunk);
    assert_status(om_dds_motion_parse(two, size + end - chunk, "two.mcap", "PSM2", &m), OM_INVALID);
    assert_non_null(
        strstr(om_error_message(),
               "message 33 of /PSM2/measured_cp: its time goes back from 103.000 s to 100.000 s"));
    two[chunk + 9 + 16] ^= 1;  // its size; this writer has no sums
    assert_status(om_dds_motion_parse(two, size + end - chunk, "two.mcap", "PSM2", &m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "a chunk is damaged"));
    free(two);
}

// What is left of a file is read up to its last whole chunk: here there is one.
static void cut(void** unused) {
    (void)unused;
    OmDdsMotion m;
    int nwhole = 0;
    for (size_t n = 0; n < size; n += 13) {
        const OmStatus status = om_dds_motion_parse(data, n, "cut.mcap", "PSM2", &m);
        assert_true(status == OM_OK || status == OM_INVALID);
        assert_int_equal(m.n, status == OM_OK ? 31 : 0);
        nwhole += status == OM_OK;
        om_dds_motion_done(&m);
    }
    assert_true(nwhole > 50);
}

static OmStatus parse_once(void* ctx) {
    OmDdsMotion m;
    OmStatus status = parse(ctx, &m);
    om_dds_motion_done(&m);
    return status;
}

static void memory_runs_out(void** unused) {
    (void)unused;
    char arm[] = "PSM2";
    assert_true(test_failing_allocations(parse_once, arm, 1) == 4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(another_programs_recording),
        cmocka_unit_test(refused),
        cmocka_unit_test(damaged),
        cmocka_unit_test(cut),
        cmocka_unit_test(memory_runs_out),
    };
    if (om_file_read(PATH, 1 << 20, &data, &size) < 0) return 1;
    const int n = cmocka_run_group_tests(tests, NULL, NULL);
    om_free(data);
    return n;
}
