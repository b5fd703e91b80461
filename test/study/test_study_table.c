// test_study_table.c: rows, cells, sentences and facts in a report's HTML; a failure stays with the report.
#include "studies/study_table.h"

#include <math.h>
#include <string.h>

#include "test_folder.h"

static char* html;

// Save the report and read it, without the class of columns of numbers.
static void read_report(OmReport* report) {
    size_t size;
    om_free(html);
    assert_ok(om__report_end(report, dir, OM_OK));
    assert_ok(om_file_read(in_dir("report.html"), 1 << 20, &html, &size));
    for (char* at = html; (at = strstr(at, " class=\"n\"")) != NULL;)
        memmove(at, at + 10, strlen(at + 10) + 1);
}

static void assert_has(const char* text) {
    if (!strstr(html, text)) fail_msg("the report has no \"%s\"", text);
}

static void test_rows(void** unused) {
    (void)unused;
    OmReport report;
    om_report_begin(&report, "tables", "");
    StudyTable t = om__table("|error, mm|n");
    om__table_row(&t, "%s|%.2f|%d", "first", 1.234, 5);
    om__table_row(&t, "%s", "second|");
    om__table_row(&t, "7");
    om__table_cell(&t, "a|b");
    om__table_cell(&t, NULL);
    om__table_error(&t, 0.00456, "");
    om__table_row(&t, "%s", "");
    om__table_row(&t, "third|8");
    om__table_end(&t, &report);
    read_report(&report);
    assert_has(">error, mm</th>");
    assert_has("<tr><td>first</td><td>1.23</td><td>5</td></tr>");
    assert_has("<tr><td>second</td><td></td><td>7</td></tr>");
    assert_has("<tr><td></td><td>third</td><td>8</td></tr>");
    assert_has("<tr><td>a|b</td><td></td><td>4.56</td></tr>");
}

// 3 mm with quartiles 2 and 4; no value; no error; columns of depth.
static void test_cells(void** unused) {
    (void)unused;
    static const double depth[5] = {0.01, 0.015, 0.02, 0.025, 0.03};
    OmReport report;
    om_report_begin(&report, "cells", "");
    StudyTable t = om__study_depth_table("lesion", depth, "|mean");
    om__table_quartiles(&t, 1e3, "%.0f",
                        (StudySample){.n = 3, .lower = 0.002, .median = 0.003, .upper = 0.004});
    om__table_quartiles(&t, 1e3, "%.0f", (StudySample){0});
    om__table_error(&t, -1, "*");
    om__table_error(&t, 0.001, " *");
    om__table_row(&t, "||%d", 1);
    om__table_end(&t, &report);
    read_report(&report);
    assert_has(">D10</th>");
    assert_has(">D30</th>");
    assert_has(">3 (2-4)</td><td>-</td><td></td><td>1.00 *</td>");
}

static void test_sentences(void** unused) {
    (void)unused;
    OmReport report;
    om_report_begin(&report, "sentences", "");
    om__report_judge(&report, true, "%d of %d", 3, 4);
    om__report_head(&report, "part %d", 2);
    om__report_say(&report, "%.1f mm", 0.25);
    om__report_facts(&report, "one|two", "%d|%d|%d", 1, 2,
                     3);  // a value without a label is left out
    StudyTable none = om__table("nothing|here");
    om__table_end(&none, &report);
    read_report(&report);
    assert_has(">3 of 4<");
    assert_has(">part 2<");
    assert_has(">0.2 mm<");
    assert_has(">two</dt><dd>2<");
    assert_null(strstr(html, ">3</dd>"));
    assert_null(strstr(html, "nothing"));
}

// At the bound is met, from both sides; beyond it is missed, and so is a value that was not measured.
static void test_goals(void** unused) {
    (void)unused;
    OmReport report;
    const StudyGoal most = {"error", "%.1f mm", 2, 2, true},
                    least = {"share", "%.0f %%", 80, 80, .thesis = "72 %"};
    StudyGoals goals = {2, {most, least}};
    assert_true(om__goals_met(goals));
    om_report_begin(&report, "goals", "");
    om__report_goals(&report, "ours", goals);
    goals.goal[0].found = 2.1;
    goals.goal[1].found = 79;
    goals.goal[goals.n++] = most;
    goals.goal[goals.n] = least;
    goals.goal[goals.n++].found = (double)NAN;
    assert_false(om__goals_met(goals));
    om__report_goals(&report, "others", goals);
    read_report(&report);
    assert_has(">ours: 2 of 2 goals are met.<");
    assert_has(
        "<tr><td>error</td><td>2.0 mm</td><td>at most 2.0 mm</td><td></td><td>met</td></tr>");
    assert_has(
        "<tr><td>share</td><td>80 %</td><td>at least 80 %</td><td>72 %</td><td>met</td></tr>");
    assert_has(">others: 1 of 4 goals are met.<");
    assert_has("<td>2.1 mm</td><td>at most 2.0 mm</td><td></td><td>missed</td>");
    assert_has("<td>79 %</td><td>at least 80 %</td><td>72 %</td><td>missed</td>");
    assert_has("<td>-</td><td>at least 80 %</td><td>72 %</td><td>missed</td>");
}

static void assert_file(const char* name, const char* text) {
    char* found;
    size_t size;
    assert_ok(om_file_read(in_dir(name), 1 << 20, &found, &size));
    assert_int_equal(size, strlen(text));
    assert_memory_equal(found, text, size);
    om_free(found);
}

// Each type; a value that is not finite; an object in a list; lines of a file and in a fold.
static void test_files(void** unused) {
    (void)unused;
    OmReport report;
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "n %d|seed %lld|mm %f|by %s|is_met? %d", -3, 1LL << 40, 0.25, "a|b \"c\"", 1);
    om_json_open(&json, "rows", '[');
    om__put_object(&json, NULL, "is_there? %d|mm %f", 0, (double)NAN);
    om_json_close(&json, ']');
    assert_ok(om__study_save_json(dir, &json, OM_OK));
    assert_file("study.json",
                "{\n  \"n\": -3,\n  \"seed\": 1099511627776,\n  \"mm\": 0.25,\n"
                "  \"by\": \"a|b \\\"c\\\"\",\n  \"is_met\": true,\n  \"rows\": [\n    {\n"
                "      \"is_there\": false,\n      \"mm\": null\n    }\n  ]\n}\n");
    text = (OmText){0};
    json = om__json(&text);
    assert_status(om__study_save_json(dir, &json, OM_CANCELLED), OM_CANCELLED);
    StudyLines lines = {0};
    om__lines_add(&lines, "a,b\n");
    om__lines_add(&lines, "%d,%.1f\n", 1, 2.0);
    assert_ok(om__lines_save(&lines, dir, "t2.csv"));
    assert_file("t2.csv", "a,b\n1,2.0\n");
    om_report_begin(&report, "folds", "");
    lines = (StudyLines){0};
    om__lines_fold(&lines, &report, "empty");
    om__lines_add(&lines, "line %d\n", 1);
    om__lines_fold(&lines, &report, "one line");
    read_report(&report);
    assert_has("one line</summary>");
    assert_has("line 1\n");
    assert_null(strstr(html, ">empty<"));
}

// A failure on the way keeps the old report, and is returned.
static void test_failures(void** unused) {
    (void)unused;
    OmReport report;
    om_report_begin(&report, "new", "");
    assert_status(om__report_end(&report, dir, OM_CANCELLED), OM_CANCELLED);
    om_report_begin(&report, "new", "");
    StudyTable t = om__table("a");
    t.status = OM_NO_MEMORY;
    om__table_row(&t, "%d", 1);
    om__table_end(&t, &report);
    assert_true(om__report_end(&report, dir, OM_OK) < 0);
    size_t size;
    om_free(html);
    assert_ok(om_file_read(in_dir("report.html"), 1 << 20, &html, &size));
    assert_has("folds");
    StudyLines lines = {.status = OM_IO};
    om__lines_add(&lines, "a,%d\n", 1);
    assert_status(om__lines_save(&lines, dir, "t.csv"), OM_IO);
    assert_false(om_path_exists(in_dir("t.csv")));
    om_free(html);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows),      cmocka_unit_test(test_cells),
        cmocka_unit_test(test_sentences), cmocka_unit_test(test_goals),
        cmocka_unit_test(test_files),     cmocka_unit_test(test_failures)};
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
