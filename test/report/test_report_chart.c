// test_report_chart.c: where points land, what ticks say, and what is left out.
#include "report_check.h"

static char* draw_both(const OmReportChart* chart) {
    OmReport r;
    om_report_begin(&r, "Chart", NULL);
    om_report_chart(&r, chart);
    return checked_page(&r);
}

// The drawing for wide screens: the one for phones is cut out.
static char* draw(const OmReportChart* chart) {
    char* html = draw_both(chart);
    char* phone = strstr(html, "<svg class=\"narrow");
    if (phone) {
        char* end = strstr(phone, "</svg>\n");
        assert_non_null(end);
        end += strlen("</svg>\n");
        memmove(phone, end, strlen(end) + 1);
    }
    return html;
}

// Points and moves of the first line of a page.
static int count_in_path(const char* html, char letter) {
    const char* d = strstr(html, "<path class=\"data c0\" d=\"");
    assert_non_null(d);
    d += strlen("<path class=\"data c0\" d=\"");
    int n = 0;
    for (; *d && *d != '"'; ++d) n += *d == letter;
    return n;
}

static void test_corners(void** state) {
    (void)state;
    // x from 0 to 10 spans 58 to 944 px, y from 0 to 1 spans 218 to 8 px.
    const double x[] = {0, 5, 10}, y[] = {0, 0.5, 1};
    OmReportSeries s = {"line", x, y, 3, false};
    char* html = draw(&(OmReportChart){.title = "share",
                                       .x_label = "time, s",
                                       .series = {s},
                                       .nseries = 1,
                                       .has_range = true,
                                       .y_max = 1});
    assert_non_null(strstr(html, "d=\"M58.0 218.0h0L501.0 113.0L944.0 8.0\""));
    assert_non_null(strstr(html, ">0.2</text>"));
    assert_non_null(strstr(html, ">10</text>"));
    assert_int_equal(count_text(html, "class=\"legend\""),
                     0);  // one series: the title names it
    om_free(html);
}

static void test_steps(void** state) {
    (void)state;
    const double x[] = {0, 5, 10}, y[] = {0, 1, 0};
    OmReportSeries s = {"rate", x, y, 3, true};
    char* html = draw(&(OmReportChart){
        .title = "rate", .series = {s}, .nseries = 1, .has_range = true, .y_max = 1});
    assert_non_null(strstr(html, "d=\"M58.0 218.0h0H501.0V8.0H944.0V218.0\""));
    om_free(html);
}

static void test_gaps(void** state) {
    (void)state;
    const double x[] = {0, 1, 2, 3, 4, 5}, y[] = {0, 1, NAN, 1, INFINITY, 2};
    OmReportSeries s = {"gaps", x, y, 6, false};
    char* html = draw(&(OmReportChart){.title = "gaps", .series = {s}, .nseries = 1});
    assert_int_equal(count_in_path(html, 'M'), 3);
    assert_int_equal(count_in_path(html, 'L'), 1);
    assert_int_equal(count_text(html, "nan") + count_text(html, "inf"), 0);
    om_free(html);
}

static void test_nothing_to_draw(void** state) {
    (void)state;
    const double x[] = {0, 1}, y[] = {NAN, 1e305};
    OmReportSeries s[] = {{"nan", x, y, 2, false}, {"empty", NULL, NULL, 0, false}};
    char* html = draw(&(OmReportChart){
        .title = "none", .series = {s[0], s[1]}, .nseries = 2, .has_limit = true, .limit = 3});
    assert_non_null(strstr(html, "No values were recorded"));
    assert_null(strstr(html, "<svg"));
    om_free(html);
    html = draw(&(OmReportChart){.title = "no series"});
    assert_non_null(strstr(html, "No values were recorded"));
    om_free(html);
}

static void test_one_empty_series_of_two(void** state) {
    (void)state;
    const double x[] = {0, 1}, y[] = {1, 2};
    OmReportSeries s[] = {{"empty", NULL, NULL, 0, false}, {"full", x, y, 2, false}};
    char* html = draw(&(OmReportChart){.title = "two", .series = {s[0], s[1]}, .nseries = 2});
    assert_int_equal(count_text(html, "class=\"legend\""), 1);
    assert_int_equal(count_in_path(html, 'M'), 0);
    om_free(html);
}

static void test_scales(void** state) {
    (void)state;
    // One point, constants, zero, tiny and huge values: each gives ticks and numbers.
    const double value[][3] = {{7, 7, 7},
                               {0, 0, 0},
                               {1e-9, 2e-9, 3e-9},
                               {-4e12, 3e12, 1e11},
                               {-1e299, 1e299, 0},
                               {1e9, 1e9 + 1e-3, 1e9},
                               {-0.05, -0.03, -0.04}};
    const double x[] = {1e-3, 2e-3, 3e-3};
    for (size_t k = 0; k < sizeof value / sizeof *value; ++k) {
        for (int n = 1; n <= 3; n += 2) {
            OmReportSeries s = {"scale", x, value[k], n, false};
            char* html = draw(&(OmReportChart){.title = "scale", .series = {s}, .nseries = 1});
            int nline = count_text(html, "class=\"grid\"");
            if (nline < 2 || nline > 12)
                fail_msg("%d ticks for values of about %g", nline, value[k][0]);
            assert_int_equal(count_text(html, "nan") + count_text(html, "inf"), 0);
            om_free(html);
        }
    }
}

static void test_marks(void** state) {
    (void)state;
    const double x[] = {0, 10}, y[] = {0, 0.2};
    OmReportSeries s = {"force", x, y, 2, false};
    OmReportSpan span[] = {
        {"reach", 0, 4, false}, {"pull & hold", 4, 4.05, true}, {"lost", NAN, 4, false}};
    const double event[] = {5, 6, 11, NAN};
    char* html = draw(&(OmReportChart){.title = "force",
                                       .series = {s},
                                       .nseries = 1,
                                       .has_limit = true,
                                       .limit = 0.3,
                                       .limit_name = "threshold <0.3 N>",
                                       .span = span,
                                       .nspan = 3,
                                       .event = event,
                                       .nevent = 4});
    assert_int_equal(count_text(html, "class=\"limit\""),
                     1);  // in range, though above the data
    assert_non_null(strstr(html, "threshold &lt;0.3 N&gt;"));
    assert_int_equal(count_text(html, "class=\"span"), 3);  // two strips, one of them named
    assert_non_null(strstr(html, "1 reach</text>"));
    assert_non_null(strstr(html, "<title>2 pull &amp; hold (did not end as meant)</title>"));
    assert_int_equal(count_text(html, "class=\"event\""), 2);
    om_free(html);
}

// A limit far above the data belongs to the range: 0 to 4 spans 218 to 8 px, so 4 is at the top and 1 below it.
static void test_limit_is_in_the_picture(void** state) {
    (void)state;
    const double x[] = {0, 1}, y[] = {0, 1};
    char* html = draw(&(OmReportChart){.title = "limit",
                                       .series = {{"force", x, y, 2, false}},
                                       .nseries = 1,
                                       .has_limit = true,
                                       .limit = 4,
                                       .limit_name = "threshold"});
    assert_non_null(
        strstr(html, "<line class=\"limit\" x1=\"58.0\" x2=\"944.0\" y1=\"8.0\" y2=\"8.0\""));
    assert_non_null(strstr(html, "d=\"M58.0 218.0h0L944.0 165.5\""));
    om_free(html);
}

// What a span that ended badly says besides its colour.
static void test_bad_span_has_a_sign(void** state) {
    (void)state;
    const double x[] = {0, 10}, y[] = {0, 1};
    OmReportSpan span[] = {{"reach", 0, 5, false}, {"pull", 5, 10, true}};
    char* html = draw(&(OmReportChart){.title = "spans",
                                       .series = {{"force", x, y, 2, false}},
                                       .nseries = 1,
                                       .span = span,
                                       .nspan = 2});
    assert_non_null(strstr(html, ">1 reach</text>"));
    assert_non_null(strstr(html, ">2! pull</text>"));
    om_free(html);
}

// On a phone of 360 px a drawing is 312 px wide: 360 less the page's margins, the card's padding and borders. Text of
// 12 px of the drawing is 11 px there, and all that is drawn lies in the drawing. Wide ones stay above 11 px, too, in a
// box that scrolls.
static void test_phone(void** state) {
    (void)state;
    const double x[] = {0, 5, 10}, y[] = {0, 0.5, 1};
    const OmReportChart chart = {.title = "share",
                                 .x_label = "time, s",
                                 .series = {{"line", x, y, 3, false}},
                                 .nseries = 1,
                                 .has_range = true,
                                 .y_max = 1};
    char* html = draw_both(&chart);
    const double screen = 360 - 2 * 12 - 2 * 10 - 2 * 1;
    assert_non_null(
        strstr(html, "name=\"viewport\" content=\"width=device-width,initial-scale=1\""));
    assert_non_null(strstr(html, "main{padding:22px 12px 48px}"));
    assert_non_null(strstr(html, ".card,figure.chart,details{padding:10px}"));
    assert_non_null(strstr(html, "svg text{font-size:12px"));
    assert_non_null(strstr(html, "svg.wide{min-width:880px}"));
    const char* phone = strstr(html, "<svg class=\"narrow\" viewBox=\"0 0 ");
    assert_non_null(phone);
    int width = 0, height = 0;
    assert_int_equal(sscanf(strstr(phone, "0 0 "), "0 0 %d %d", &width, &height), 2);
    assert_true(12 * screen / width >= 11);
    assert_true(12 * 880.0 / 960 >= 11);
    double first[2], last[2], half[2];
    const char* path = strstr(phone, "class=\"data c0\" d=\"");
    assert_int_equal(sscanf(path, "class=\"data c0\" d=\"M%lf %lfh0L%lf %lfL%lf %lf\"", first,
                            first + 1, half, half + 1, last, last + 1),
                     6);
    assert_near(half[0], 0.5 * (first[0] + last[0]), 0.051);  // written to 0.1
    assert_near(half[1], 0.5 * (first[1] + last[1]), 0.051);
    assert_true(first[0] > 30 && last[0] < width && last[1] >= 0 && first[1] < height);
    om_free(html);
}

// Names of groups that do not fit a phone: the wide drawing scrolls there.
static void test_groups_on_a_phone(void** state) {
    (void)state;
    const char* group[] = {"a name that is long", "another name of length", "c"};
    const OmReportBox box[3] = {{1, 2, 3, 4, 5, 9}, {1, 2, 3, 4, 5, 9}, {1, 2, 3, 4, 5, 9}};
    OmReportChart chart = {.title = "boxes",
                           .series = {{.name = "all"}},
                           .nseries = 1,
                           .ngroup = 3,
                           .group = group,
                           .box = box};
    char* html = draw_both(&chart);
    assert_int_equal(count_text(html, "<svg class=\"narrow"), 0);
    assert_int_equal(count_text(html, "<svg class=\"wide\""), 1);
    om_free(html);
    const char* brief[] = {"a", "b", "c"};
    chart.group = brief;
    html = draw_both(&chart);
    assert_int_equal(count_text(html, "<svg class=\"narrow\""), 1);
    assert_int_equal(count_text(html, "<svg class=\"wide has-narrow\""), 1);
    om_free(html);
}

static void test_dense_series_keep_peaks(void** state) {
    (void)state;
    enum { N = 200000 };
    double *x = malloc(N * sizeof *x), *y = malloc(N * sizeof *y);
    assert_non_null(x);
    assert_non_null(y);
    for (int i = 0; i < N; ++i) {
        x[i] = 1e-3 * i;
        y[i] = 0.5;
    }
    y[77777] = 1;  // one sample of 200,000
    y[123456] = NAN;
    OmReportSeries s = {"dense", x, y, N, false};
    char* html = draw(&(OmReportChart){
        .title = "dense", .series = {s}, .nseries = 1, .has_range = true, .y_max = 1});
    int npoint = count_in_path(html, 'L') + count_in_path(html, 'M');
    assert_true(npoint < 4 * 890);
    assert_int_equal(count_in_path(html, 'M'), 2);
    assert_int_equal(count_text(html, " 8.0L"), 1);  // the peak, at the top of the plot
    om_free(html);
    free(x);
    free(y);
}

// Decades are evenly spaced; what is not above 0 leaves a gap.
static void test_decades(void** state) {
    (void)state;
    const double x[] = {100, 1000, 10000, 100000}, y[] = {0.1, 1, 0, 100};
    OmReportSeries s = {"time", x, y, 4, false};
    char* html = draw(&(OmReportChart){.title = "time",
                                       .series = {s},
                                       .nseries = 1,
                                       .has_limit = true,
                                       .limit = 20,
                                       .limit_name = "real time",
                                       .limit2 = 40,
                                       .limit2_name = "25 frames a second",
                                       .is_log_x = true,
                                       .is_log_y = true});
    // three decades over 886 px, and over 210 px
    assert_non_null(strstr(html, "d=\"M58.0 218.0h0L353.3 148.0M944.0 8.0h0\""));
    assert_non_null(strstr(html, ">0.1</text>"));
    assert_non_null(strstr(html, ">100000</text>"));
    assert_non_null(strstr(html, "25 frames a second</text>"));
    om_free(html);
}

// A box from the lower to the upper quartile; none for a sample of nothing.
static void test_boxes(void** state) {
    (void)state;
    const char* group[] = {"623", "1363"};
    const OmReportBox box[] = {{0, 1, 2, 3, 4, 9}, {1, 1, 1, 1, 1, 3}, {0}, {0, 2, 2.5, 3, 4, 7}};
    char* html = draw(&(OmReportChart){.title = "error",
                                       .series = {{.name = "LM"}, {.name = "Penalty"}},
                                       .nseries = 2,
                                       .ngroup = 2,
                                       .group = group,
                                       .box = box});
    assert_int_equal(count_text(html, "<rect class=\"data"), 3);
    assert_non_null(strstr(html, "<title>Penalty, 1363, 7 values</title>"));
    assert_non_null(strstr(html, ">623</text>"));
    // y from 0 to 4 spans 218 to 8 px: quartiles 1 and 3
    assert_non_null(strstr(html, "y=\"60.5\" height=\"105.0\""));
    // medians 2 and 2.5 at half and five eighths of the height; whiskers from 1 to 0 and from 3 to 4
    assert_non_null(strstr(html, "y1=\"113.0\" y2=\"113.0\""));
    assert_non_null(strstr(html, "y1=\"86.8\" y2=\"86.8\""));
    assert_non_null(strstr(html, "y1=\"165.5\" y2=\"218.0\""));
    assert_non_null(strstr(html, "y1=\"8.0\" y2=\"60.5\""));
    om_free(html);
}

static void test_misuse(void** state) {
    (void)state;
    OmReport r;
    om_report_begin(&r, "Bad", NULL);
    om_report_chart(&r, &(OmReportChart){.title = "many", .nseries = 9});
    om_report_paragraph(&r, "later calls change nothing");
    assert_status(om_report_save(&r, "/nowhere/report.html"), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "\"many\""));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_corners),
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_gaps),
        cmocka_unit_test(test_nothing_to_draw),
        cmocka_unit_test(test_one_empty_series_of_two),
        cmocka_unit_test(test_scales),
        cmocka_unit_test(test_marks),
        cmocka_unit_test(test_bad_span_has_a_sign),
        cmocka_unit_test(test_phone),
        cmocka_unit_test(test_groups_on_a_phone),
        cmocka_unit_test(test_dense_series_keep_peaks),
        cmocka_unit_test(test_limit_is_in_the_picture),
        cmocka_unit_test(test_decades),
        cmocka_unit_test(test_boxes),
        cmocka_unit_test(test_misuse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
