// test_view_hand.c: lines of a page that moves tissue by hand.
#include "omentum/view_hand.h"
#include "test_common.h"

static void lines_are_read(void** unused) {
    (void)unused;
    OmHandLine l;
    assert_ok(om_hand_line_parse("grasp 0.5 -1e-2 3", &l));
    assert_int_equal(l.verb, OM_HAND_GRASP);
    assert_near(l.at.x, 0.5, 0);
    assert_near(l.at.y, -0.01, 1e-18);
    assert_near(l.at.z, 3, 0);
    assert_ok(om_hand_line_parse(" young  2.5 ", &l));
    assert_int_equal(l.verb, OM_HAND_YOUNG);
    assert_near(l.value, 2.5, 0);
    assert_ok(om_hand_line_parse("law ogden-coupled", &l));
    assert_int_equal(l.verb, OM_HAND_LAW);
    assert_string_equal(l.name, "ogden-coupled");
    for (int v = 0; v < OM_HAND_NVERB; ++v) {  // every word, with what follows it
        char text[80];
        const char* rest = v <= OM_HAND_MOVE      ? "0 0 0.1"
                           : v == OM_HAND_YOUNG   ? "1"
                           : v == OM_HAND_POISSON ? "0.3"
                           : v == OM_HAND_PROBE   ? "0.01"
                           : v >= OM_HAND_LAW     ? "fem"
                                                  : "";
        snprintf(text, sizeof text, "%s %s", om_hand_verb_text((OmHandVerb)v), rest);
        assert_ok(om_hand_line_parse(text, &l));
        assert_int_equal(l.verb, v);
    }
    assert_null(om_hand_verb_text(OM_HAND_NVERB));
}

static void wrong_lines_are_explained(void** unused) {
    (void)unused;
    static const char* const wrong[][2] = {{"", "no command"},
                                           {"dance", "no command"},
                                           {"grasps 0 0 0", "no command"},
                                           {"grasp", "three numbers"},
                                           {"grasp 1 2", "three numbers"},
                                           {"grasp 1 2 x", "three numbers"},
                                           {"grasp nan 0 0", "three numbers"},
                                           {"move 0 0 inf", "three numbers"},
                                           {"move 0 0 100", "three numbers"},
                                           {"move 0 0 1 2", "too much"},
                                           {"young 0", "from 0.1 to 10"},
                                           {"young 11", "from 0.1 to 10"},
                                           {"poisson 0.5", "from 0 to"},
                                           {"poisson -0.1", "from 0 to"},
                                           {"probe 1", "from 0.001 to 0.1"},
                                           {"law", "needs a name"},
                                           {"pause now", "too much"}};
    OmHandLine l;
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; ++k) {
        assert_status(om_hand_line_parse(wrong[k][0], &l), OM_INVALID);
        if (!strstr(om_error_message(), wrong[k][1]))
            fail_msg("\"%s\": \"%s\" does not say \"%s\"", wrong[k][0], om_error_message(),
                     wrong[k][1]);
    }
    char text[200] = "engine ";
    memset(text + 7, 'x', OM_HAND_NAME);
    assert_status(om_hand_line_parse(text, &l), OM_INVALID);
    text[7 + OM_HAND_NAME - 1] = 0;
    assert_ok(om_hand_line_parse(text, &l));
    assert_int_equal(strlen(l.name), OM_HAND_NAME - 1);
}

int main(void) {
    const struct CMUnitTest test[] = {cmocka_unit_test(lines_are_read),
                                      cmocka_unit_test(wrong_lines_are_explained)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
