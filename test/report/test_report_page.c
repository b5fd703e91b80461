// Reports: tags that close, text that is escaped, charts that survive bad numbers.
#include "report_check.h"

static void blocks_are_well_formed_and_escaped(void** state) {
    (void)state;
    OmReport r;
    om_report_begin(&r, "A <title> & more", "sub\"title'");
    om_report_verdict(&r, "exposed <script>alert(1)</script>", true);
    om_report_heading(&r, "Heading");
    om_report_paragraph(&r, "a < b");
    const char* value[] = {"1 N", "<2>"};
    const char* label[] = {"force", "height"};
    om_report_facts(&r, value, label, 2);
    om_report_table(&r, label, 2, value, 1);
    const char* cell[] = {"a", "1", "b", "-2.5", "3 c", NULL};
    om_report_table(&r, label, 2, cell, 3);
    om_report_listing(&r, "reach(psm1, 2, 3) <- free\n  pull");
    om_report_details(&r, "why", "x < y\n");
    OmPicture picture;
    assert_ok(om_picture_init(&picture, 4, 3, 3));
    memset(picture.pixel, 200, 36);
    om_report_picture(&r, &picture, "first");
    om_report_picture(&r, &picture, "second");
    om_report_begin_fold(&r, "more <pictures>");
    om_report_picture(&r, &picture, "third");
    om_report_end_fold(&r);
    om_report_heading(&r, "After pictures");
    om_picture_done(&picture);
    char* html = checked_page(&r);
    assert_null(strstr(html, "<script"));
    assert_non_null(strstr(html, "A &lt;title&gt; &amp; more"));
    assert_non_null(strstr(html, "data:image/png;base64,iVBORw0KGgo"));
    assert_int_equal(count_text(html, "loading=\"eager\""), 2);
    assert_int_equal(count_text(html, "loading=\"lazy\""), 1);
    assert_non_null(strstr(html, "<details><summary>more &lt;pictures&gt;</summary>\n"
                                 "<div class=\"pictures\">\n<figure><img alt=\"third\""));
    assert_non_null(strstr(html, "<figcaption>third</figcaption></figure>\n</div>\n</details>"));
    assert_int_equal(count_text(html, "<td class=\"n\">"), 4);  // columns of numbers stand right
    // It needs nothing else: no address but data.
    assert_int_equal(count_text(html, "src=\""), count_text(html, "src=\"data:"));
    assert_int_equal(count_text(html, "href=") + count_text(html, "http"), 0);
    om_free(html);
}

static void charts_survive_bad_numbers(void** state) {
    (void)state;
    const double x[5] = {0, 1, 2, 3, 4}, y[5] = {1, NAN, 3, INFINITY, 2}, same[5] = {7, 7, 7, 7, 7};
    const double event[2] = {1.5, 99};
    OmReport r;
    om_report_begin(&r, "Charts", "");
    OmReportChart chart = {.title = "gaps",
                           .x_label = "time, s",
                           .y_label = "N",
                           .nseries = 2,
                           .series = {{"a", x, y, 5}, {"b", x, same, 5}},
                           .has_limit = true,
                           .limit = 5,
                           .limit_name = "limit",
                           .event = event,
                           .nevent = 2};
    om_report_chart(&r, &chart);
    OmReportChart empty = {.title = "empty", .nseries = 1, .series = {{"none", x, y, 0}}};
    om_report_chart(&r, &empty);
    OmReportChart flat = {.title = "flat", .nseries = 1, .series = {{"flat", same, same, 5}}};
    om_report_chart(&r, &flat);
    char* html = checked_page(&r);
    assert_null(strstr(html, "nan,"));
    assert_null(strstr(html, ",nan"));
    assert_null(strstr(html, "inf"));
    om_free(html);
}

static int failing_after;
static void* fail_later(void* ctx, size_t size, size_t align) {
    (void)ctx;
    return failing_after-- > 0 ? aligned_alloc(align, (size + align - 1) / align * align) : NULL;
}
static void release(void* ctx, void* ptr) {
    (void)ctx;
    free(ptr);
}

static void refused_memory_is_told_at_the_end(void** state) {
    (void)state;
    OmAllocator failing = {fail_later, release, NULL};
    enum { N = 5000 };
    static double x[N], y[N];
    for (int i = 0; i < N; ++i) x[i] = i, y[i] = sin(0.01 * i);
    OmReportChart chart = {.title = "dense", .nseries = 1, .series = {{"sine", x, y, N}}};
    const char* label[] = {"force", "height"};
    char path[] = "/tmp/omentum-refused-XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    remove(path);
    int64_t alive = om_alloc_alive();
    OmStatus status = OM_NO_MEMORY;
    int tries = 0;
    while (status != OM_OK) {
        failing_after = tries++;
        om_allocator_set(&failing);
        OmReport r;
        om_report_begin(&r, "t", "s");
        om_report_chart(&r, &chart);
        om_report_table(&r, label, 2, label, 1);
        OmPicture picture;
        if (om_picture_init(&picture, 4, 3, 3) == OM_OK) {
            memset(picture.pixel, 0, 36);
            om_report_picture(&r, &picture, "caption");
            om_picture_done(&picture);
        }
        for (int i = 0; i < 200; ++i)
            om_report_paragraph(&r, "a paragraph that makes the text grow");
        status = om_report_save(&r, path);
        om_allocator_set(NULL);
        assert_int_equal(om_alloc_alive(), alive);
        assert_int_equal(om_path_exists(path), status == OM_OK);  // whole or not at all
        if (status != OM_OK) assert_int_equal(status, OM_NO_MEMORY);
    }
    assert_true(tries > 2);
    remove(path);
}

// Nothing of the hour, the place or the memory is in a report.
static void the_same_calls_give_the_same_bytes(void** state) {
    (void)state;
    const double x[4] = {0, 1, 2, 3}, y[4] = {0, 0.3, -0.2, 1e-3};
    char* html[2];
    for (int k = 0; k < 2; ++k) {
        OmReport r;
        OmReportChart chart = {.title = "force", .nseries = 1, .series = {{"f", x, y, 4}}};
        om_report_begin(&r, "Twice", "the same");
        om_report_chart(&r, &chart);
        om_report_paragraph(&r, "text");
        html[k] = checked_page(&r);
    }
    assert_string_equal(html[0], html[1]);
    om_free(html[0]);
    om_free(html[1]);
}

static void misuse_is_told_at_the_end(void** state) {
    (void)state;
    OmReport r;
    om_report_begin(&r, "Table", NULL);
    om_report_table(&r, NULL, 0, NULL, 1);
    om_report_paragraph(&r, "after the failure");
    assert_status(om_report_save(&r, "/nowhere/report.html"), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "0; 1 to 32 columns"));
    om_report_begin(&r, "Folder", NULL);
    assert_status(om_report_save(&r, "/no/such/folder/report.html"), OM_IO);
    om_report_done(&r);  // harmless after saving
    om_report_done(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_are_well_formed_and_escaped),
        cmocka_unit_test(charts_survive_bad_numbers),
        cmocka_unit_test(the_same_calls_give_the_same_bytes),
        cmocka_unit_test(misuse_is_told_at_the_end),
        cmocka_unit_test(refused_memory_is_told_at_the_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
