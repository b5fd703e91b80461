// test_dds_udp.c: commands in JSON.
#include <string.h>

#include "dds/dds_udp.h"
#include "test_alloc.h"
#include "test_common.h"

static OmStatus parse(const char* text, UdpCommand* c) {
    return om__udp_parse(text, strlen(text), c);
}

static void commands(void** unused) {
    (void)unused;
    UdpCommand c;
    assert_ok(parse("{\"arm\": \"PSM1\"}", &c));
    assert_int_equal(c.kind, UDP_ASK);
    assert_string_equal(c.arm, "PSM1");
    assert_ok(parse("{\"servo_cp\": [1, 2, 3, 0, 0, 0, 1], \"arm\": \"PSM2\"}", &c));
    assert_int_equal(c.kind, UDP_SERVO_CP);
    assert_int_equal(c.n, 7);
    assert_near(c.x[2], 3, 0);
    assert_near(c.x[6], 1, 0);
    assert_ok(parse("{\"arm\": \"PSM1\", \"move_jp\": [1, 2, 3, 4, 5, 6.5]}", &c));
    assert_int_equal(c.kind, UDP_MOVE_JP);
    assert_near(c.x[5], 6.5, 0);
    assert_ok(parse("{\"arm\": \"PSM1\", \"jaw\": -0.25}", &c));
    assert_int_equal(c.kind, UDP_JAW);
    assert_near(c.x[0], -0.25, 0);
    assert_ok(parse("{\"arm\": \"PSM1\", \"hold\": true}", &c));
    assert_int_equal(c.kind, UDP_HOLD);
    assert_ok(parse("{\"arm\": \"PSM1\", \"state_command\": \"home\"}", &c));
    assert_int_equal(c.kind, UDP_STATE);
    assert_string_equal(c.text, "home");
}

static void refused(void** unused) {
    (void)unused;
    static const char* const bad[] = {
        "",
        "7",
        "[]",
        "{\"arm\": 1}",
        "{\"servo_cp\": [1, 2, 3, 0, 0, 0, 1]}",
        "{\"arm\": \"PSM1\", \"servo_cp\": [1, 2, 3, 0, 0, 0]}",
        "{\"arm\": \"PSM1\", \"servo_cp\": [1, 2, 3, 0, 0, 0, \"1\"]}",
        "{\"arm\": \"PSM1\", \"servo_cp\": [1, 2, 3, 0, 0, 0, NaN]}",
        "{\"arm\": \"PSM1\", \"jaw\": \"shut\"}",
        "{\"arm\": \"PSM1\", \"jaw\": 1, \"hold\": true}",
        "{\"arm\": \"PSM1\", \"jaw\": 1, \"jaw\": 2}",
        "{\"arm\": \"PSM1\", \"dance\": 1}",
        "{\"arm\": \"a name that is too long\"}",
        "{\"arm\": \"PSM1\", \"state_command\": \"a word that is much longer than any\"}"};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
        UdpCommand c;
        assert_status(parse(bad[k], &c), OM_INVALID);
        assert_int_equal(c.kind, UDP_ASK);
        assert_int_equal(c.n, 0);
    }
}

static OmStatus open_and_close(void* ctx) {
    Udp* udp;
    (void)ctx;
    OM_TRY(om__udp_open(47123, &udp));
    om__udp_close(udp);
    return OM_OK;
}

static void memory(void** unused) {
    (void)unused;
    assert_int_equal(test_failing_allocations(open_and_close, NULL, 1), 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(commands), cmocka_unit_test(refused),
                                       cmocka_unit_test(memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
