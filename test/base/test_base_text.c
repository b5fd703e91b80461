// The version, text, JSON, HTML and base64, the nearest word, progress lines.
#include "base/base_internal.h"
#include "test_common.h"

static void json_is_well_formed(void** state) {
    (void)state;
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "name", "a \"quoted\"\n\\ name");
    om_json_number(&json, "nan", NAN);
    om_json_number(&json, "x", 0.25);
    om_json_open(&json, "list", '[');
    om_json_integer(&json, NULL, -3);
    om_json_bool(&json, NULL, true);
    om_json_close(&json, ']');
    double v[3] = {1, 2.5, HUGE_VAL};
    om_json_numbers(&json, "v", v, 3);
    om_json_open(&json, "empty", '{');
    om_json_close(&json, '}');
    om_json_close(&json, '}');
    assert_ok(om_json_end(&json));
    assert_string_equal(text.str,
                        "{\n  \"name\": \"a \\\"quoted\\\"\\u000a\\\\ name\",\n  \"nan\": null,\n"
                        "  \"x\": 0.25,\n  \"list\": [\n    -3,\n    true\n  ],\n"
                        "  \"v\": [1, 2.5, null],\n  \"empty\": {}\n}\n");
    om_text_done(&text);
}

// Bytes that no program reads as text are escaped, the rest stays; what comes out is read again by others.
static void hostile_names_are_escaped(void** state) {
    (void)state;
    static const struct {
        const char *name, *quoted, *plain;
    } row[] = {
        {"liver \xc3\xa4 \xe8\x82\x9d \xf0\x9f\xab\x80",
         "\"liver \xc3\xa4 \xe8\x82\x9d \xf0\x9f\xab\x80\"",
         "liver \xc3\xa4 \xe8\x82\x9d \xf0\x9f\xab\x80"},
        {"a\"b\\", "\"a\\\"b\\\\\"", "a\"b\\"},
        {"a\x1b[31m\n", "\"a\\u001b[31m\\u000a\"", "a\\x1b[31m\\x0a"},
        {"\x7f\xc2\x85\xe2\x80\xa8\xef\xbb\xbf", "\"\\u007f\\u0085\\u2028\\ufeff\"",
         "\\x7f\\xc2\\x85\\xe2\\x80\\xa8\\xef\\xbb\\xbf"},
        // a byte alone, an overlong form, a surrogate, beyond the last plane, a cut character
        {"Gef\xe4\xdf", "\"Gef\\\\xe4\\\\xdf\"", "Gef\\xe4\\xdf"},
        {"\xc0\xaf", "\"\\\\xc0\\\\xaf\"", "\\xc0\\xaf"},
        {"\xed\xa0\x80", "\"\\\\xed\\\\xa0\\\\x80\"", "\\xed\\xa0\\x80"},
        {"\xf4\x90\x80\x80", "\"\\\\xf4\\\\x90\\\\x80\\\\x80\"", "\\xf4\\x90\\x80\\x80"},
        {"\xe8\x82", "\"\\\\xe8\\\\x82\"", "\\xe8\\x82"}};
    for (size_t i = 0; i < sizeof row / sizeof *row; ++i) {
        OmText quoted = {0}, plain = {0};
        char name[64];
        size_t len = strlen(row[i].name);
        assert_ok(om_text_append_quoted(&quoted, row[i].name));
        assert_string_equal(quoted.str, row[i].quoted);
        assert_ok(om_text_append_plain(&plain, row[i].name, len));
        assert_string_equal(plain.str, row[i].plain);
        assert_int_equal(om_text_is_plain(row[i].name, len, NULL), i < 2);
        assert_true(om_text_is_plain(plain.str, plain.len, NULL));
        snprintf(name, sizeof name, "%s", row[i].name);
        om_text_make_plain(name, sizeof name);
        assert_string_equal(name, row[i].plain);
        (void)om_error(OM_INVALID, "%s", row[i].name);
        assert_string_equal(om_error_message(), row[i].plain);
        om_text_done(&quoted);
        om_text_done(&plain);
    }
    assert_true(om_text_is_plain("a\nb", 3, "\n"));
    char name[8] = "abcd\xff\xff";  // no room for a second escape
    om_text_make_plain(name, sizeof name);
    assert_string_equal(name, "abcd");
}

static void base64_pads(void** state) {
    (void)state;
    const char* in[] = {"", "f", "fo", "foo", "foob", "fooba", "foobar"};  // RFC 4648, section 10
    const char* out[] = {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"};
    for (int i = 0; i < 7; ++i) {
        OmText text = {0};
        assert_ok(om_text_append_base64(&text, in[i], strlen(in[i])));
        assert_string_equal(text.str, out[i]);
        om_text_done(&text);
    }
}

static void html_is_escaped(void** state) {
    (void)state;
    OmText text = {0};
    assert_ok(om_text_append_html(&text, "<a href=\"x\">&'</a>"));
    assert_string_equal(text.str, "&lt;a href=&quot;x&quot;&gt;&amp;&#39;&lt;/a&gt;");
    om_text_done(&text);
}

static void appending_grows(void** state) {
    (void)state;
    OmText text = {0};
    for (int i = 0; i < 1000; ++i) assert_ok(om_text_append(&text, "%d,", i));
    assert_int_equal(text.len, 10 * 2 + 90 * 3 + 900 * 4);
    assert_int_equal(strlen(text.str), text.len);
    om_text_done(&text);
}

static void typing_errors_find_their_word(void** state) {
    (void)state;
    const char* words[] = {"young", "poisson", "density"};
    assert_string_equal(om_nearest_word("yuong", words, 3), "young");
    assert_string_equal(om_nearest_word("poison", words, 3), "poisson");
    assert_null(om_nearest_word("xyz", words, 3));
}

static void plain_progress_is_quiet_when_short(void** state) {
    (void)state;
    FILE* f = tmpfile();
    assert_non_null(f);
    OmProgressBar bar;
    om_progress_bar_init(&bar, f);
    for (int i = 0; i <= 10; ++i) om_progress_bar_draw(&bar, "meshing", i, 10);
    om_progress_bar_done(&bar);
    assert_int_equal(ftell(f), 0);
    fclose(f);
    assert_ok(om_progress_report(NULL, "x", 0, 1));
}

static bool refuse(void* ctx, const char* stage, double done, double total) {
    (void)ctx, (void)stage, (void)total;
    return done < 2;
}

static void progress_cancels(void** state) {
    (void)state;
    OmProgress p = {refuse, NULL};
    assert_ok(om_progress_report(&p, "meshing", 1, 5));
    assert_status(om_progress_report(&p, "meshing", 2, 5), OM_CANCELLED);
    assert_string_equal(om_error_message(), "cancelled during meshing");
}

static void library_has_the_version_of_the_header(void** state) {
    (void)state;
    assert_string_equal(om_version(), OM_VERSION);
    int number[3], end = 0;
    assert_int_equal(sscanf(om_version(), "%d.%d.%d%n", &number[0], &number[1], &number[2], &end),
                     3);
    assert_int_equal(end, strlen(om_version()));
}

// 999 of 1000 are not yet all; more than all is all. A time left is that of the rate, rounded up, of long stages alone.
static void test_progress_never_says_more_than_is_done(void** state) {
    (void)state;
    OmProgressBar bar = {.is_terminal = false, .stage = "steps"};
    char line[200];
    om__progress_line(line, sizeof line, &bar, 20, 999, 1000);
    assert_string_equal(line, "steps: 999 of 1000 (99 %), 50/s, 00:01 left");
    om__progress_line(line, sizeof line, &bar, 20, 1000, 1000);
    assert_string_equal(line, "steps: 1000 of 1000 (100 %), 50/s");
    om__progress_line(line, sizeof line, &bar, 4, 800, 1000);  // 5 s in all
    assert_string_equal(line, "steps: 800 of 1000 (80 %), 200/s");
    om__progress_line(line, sizeof line, &bar, 2, 1, 1000);  // too early
    assert_string_equal(line, "steps: 1 of 1000 (0 %), 0.5/s");
    om__progress_line(line, sizeof line, &bar, 20, 5, 0);  // no share of an unknown total
    assert_string_equal(line, "steps: 5 so far, 0.25/s");
    // no rate and no time before the first
    om__progress_line(line, sizeof line, &bar, 20, 0, 1000);
    assert_string_equal(line, "steps: 0 of 1000 (0 %)");
    om__progress_line(line, sizeof line, &bar, 100, 10, 1000);
    assert_string_equal(line, "steps: 10 of 1000 (1 %), 0.1/s, 2:45 h left");
    bar.is_terminal = true;
    om__progress_line(line, sizeof line, &bar, 20, 1500, 1000);
    assert_non_null(strstr(line, "[########################] 100 %"));
    assert_null(strstr(line, "left"));
    om__progress_line(line, sizeof line, &bar, 20, 999, 1000);
    assert_non_null(strstr(line, "[#######################.]  99 %"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_progress_never_says_more_than_is_done),
        cmocka_unit_test(json_is_well_formed),
        cmocka_unit_test(hostile_names_are_escaped),
        cmocka_unit_test(base64_pads),
        cmocka_unit_test(html_is_escaped),
        cmocka_unit_test(appending_grows),
        cmocka_unit_test(progress_cancels),
        cmocka_unit_test(typing_errors_find_their_word),
        cmocka_unit_test(library_has_the_version_of_the_header),
        cmocka_unit_test(plain_progress_is_quiet_when_short),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
