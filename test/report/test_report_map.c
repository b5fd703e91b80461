// test_report_map.c: a map: each number once, in the row and column of its cell; colours that can be read.
#include <string.h>

#include "report_check.h"

static int count(const char* text, const char* word) {
    int n = 0;
    for (; (text = strstr(text, word)); ++text) ++n;
    return n;
}

// The place of the text of a cell.
static void find(const char* html, const char* text, int* x, int* y) {
    char mark[40];
    snprintf(mark, sizeof mark, ">%s</text>", text);
    const char* at = strstr(html, mark);
    assert_non_null(at);
    while (strncmp(at, "<text", 5) != 0) --at;
    assert_int_equal(sscanf(at, "<text x=\"%d\" y=\"%d\"", x, y), 2);
}

static void numbers_stand_in_their_cells(void** unused) {
    (void)unused;
    static const double value[6] = {1.25, 2.5, NAN, 4.75, 5.5, 6.25};
    static const char* const word[6] = {NULL, NULL, "he<ld", NULL, NULL, NULL};
    static const unsigned char mark[6] = {0, 1, 0, 0, 2, 0};
    const OmReportMap m = {.title = "pull & force, N",
                           .axes = "x, y",
                           .nx = 3,
                           .ny = 2,
                           .value = value,
                           .word = word,
                           .mark = mark,
                           .most = 6.25,
                           .digits = 2};
    OmReport r;
    om_report_begin(&r, "map", NULL);
    om_report_map(&r, &m);
    assert_int_equal(r.status, OM_OK);
    const char* html = r.html.str;
    int x[6], y[6];
    static const char* const text[6] = {"1.25", "2.50", "he&lt;ld", "4.75", "5.50", "6.25"};
    for (int i = 0; i < 6; ++i) find(html, text[i], &x[i], &y[i]);
    for (int i = 0; i < 6; ++i) {
        assert_int_equal(x[i], x[i % 3]);
        assert_int_equal(y[i], y[i / 3 * 3]);
    }
    assert_true(x[0] < x[1] && x[1] < x[2] && y[3] < y[0]);  // y upwards
    assert_int_equal(count(html, "stroke:#e69f00"), 3);
    assert_int_equal(count(html, "rgb(8,64,129)"), 1);  // the largest alone
    assert_non_null(strstr(html, "pull &amp; force, N"));
    om_report_done(&r);
}

// Words that are wider than the cells widen the picture, and begin at its left edge.
static void words_below_are_not_cut(void** unused) {
    (void)unused;
    static const double value[1] = {1};
    const char* axes = "x to the right, y upwards; PSM1 at the lower edge";
    const OmReportMap m = {
        .title = "one", .axes = axes, .nx = 1, .ny = 1, .value = value, .most = 1};
    OmReport r;
    int width, x, y;
    om_report_begin(&r, "map", NULL);
    om_report_map(&r, &m);
    assert_int_equal(sscanf(strstr(r.html.str, "viewBox"), "viewBox=\"0 0 %d", &width), 1);
    find(r.html.str, axes, &x, &y);
    assert_int_equal(x, 0);
    assert_true(width > 6 * (int)strlen(axes));  // letters of 11 px are 5 to 6 px wide
    om_report_done(&r);
}

static void a_map_needs_cells(void** unused) {
    (void)unused;
    const OmReportMap m = {.title = "none"};
    OmReport r;
    om_report_begin(&r, "map", NULL);
    om_report_map(&r, &m);
    assert_int_equal(r.status, OM_INVALID);
    om_report_done(&r);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(numbers_stand_in_their_cells),
        cmocka_unit_test(words_below_are_not_cut),
        cmocka_unit_test(a_map_needs_cells),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
