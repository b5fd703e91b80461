// study_table.c: what the reports of all studies share: tables by rows, sentences with numbers, files of a folder.
#include "studies/study_table.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

#include "studies/study_internal.h"

#define MAX_TEXT 2048
#define MAX_FACT 8
// `text` with the arguments behind `format`.
#define PRINT(text, format)                     \
    char text[MAX_TEXT];                        \
    va_list args;                               \
    va_start(args, format);                     \
    vsnprintf(text, sizeof text, format, args); \
    va_end(args)

// ---- tables ---------------------------------------------------------------------------------------

static void append(StudyTable* t, const char* text, size_t size) {
    if (t->status == OM_OK) t->status = om_text_append_raw(&t->text, text, size);
    if (t->status == OM_OK) t->status = om_text_append_raw(&t->text, "", 1);
}

// The parts between bars; their number.
static int append_parts(StudyTable* t, const char* text) {
    for (int n = 1;; ++n) {
        const size_t size = strcspn(text, "|");
        append(t, text, size);
        if (!text[size]) return n;
        text += size + 1;
    }
}

StudyTable om__table(const char* heading) {
    StudyTable t = {.status = OM_OK};
    t.ncol = append_parts(&t, heading);
    return t;
}

void om__table_row(StudyTable* t, const char* format, ...) {
    PRINT(text, format);
    t->ncell += append_parts(t, text);
}

void om__table_cell(StudyTable* t, const char* text) {
    append(t, text ? text : "", text ? strlen(text) : 0);
    ++t->ncell;
}

void om__table_quartiles(StudyTable* t, double scale, const char* format, StudySample q) {
    char text[96];
    om__sample_print(text, sizeof text, scale, format, q);
    om__table_cell(t, text);
}

void om__table_error(StudyTable* t, double error, const char* mark) {
    if (error < 0)
        om__table_cell(t, NULL);
    else
        om__table_row(t, "%.2f%s", 1e3 * error, mark);
}

StudyTable om__study_depth_table(const char* first, const double* depth, const char* last) {
    char heading[256];
    int n = snprintf(heading, sizeof heading, "%s", first);
    for (int k = 0; k < OM_STUDY_NDEPTH; ++k)
        n += snprintf(heading + n, sizeof heading - (size_t)n, "|D%.0f", 1e3 * depth[k]);
    snprintf(heading + n, sizeof heading - (size_t)n, "%s", last);
    return om__table(heading);
}

void om__report_depths(OmReport* report, const char* title, int n, const char* const* name,
                       const double* depth, double error[][OM_STUDY_NDEPTH]) {
    double mm[OM_STUDY_NDEPTH];
    OmReportChart chart = {.title = title,
                           .x_label = "probe displacement, mm",
                           .y_label = "mm",
                           .nseries = n,
                           .has_range = true};
    for (int k = 0; k < OM_STUDY_NDEPTH; ++k) mm[k] = 1e3 * depth[k];
    for (int i = 0; i < n; ++i)
        chart.series[i] = (OmReportSeries){name[i], mm, error[i], OM_STUDY_NDEPTH, false};
    om_report_chart(report, &chart);
}

void om__table_end(StudyTable* t, OmReport* report) {
    const int n = t->ncol + t->ncell;
    const char** at = t->status == OM_OK ? om_alloc((size_t)n, sizeof *at) : NULL;
    const char* text = t->text.str;
    for (int i = 0; at && i < n; ++i, text += strlen(text) + 1) at[i] = text;
    if (!at)
        om_report_fail(report, t->status < 0 ? t->status : OM_NO_MEMORY);
    else if (t->ncell > 0)
        om_report_table(report, at, t->ncol, at + t->ncol, t->ncell / t->ncol);
    om_free(at);
    om_text_done(&t->text);
}

void om__table_show(StudyTable* t, OmReport* report, const char* heading, const char* text) {
    om_report_heading(report, heading);
    om__table_end(t, report);
    if (text) om_report_paragraph(report, text);
}

// ---- sentences ------------------------------------------------------------------------------------

void om__report_say(OmReport* report, const char* format, ...) {
    PRINT(text, format);
    om_report_paragraph(report, text);
}

void om__report_head(OmReport* report, const char* format, ...) {
    PRINT(text, format);
    om_report_heading(report, text);
}

void om__report_section(OmReport* report, const char* heading, const char* format, ...) {
    PRINT(text, format);
    om_report_heading(report, heading);
    om_report_paragraph(report, text);
}

void om__report_judge(OmReport* report, bool is_good, const char* format, ...) {
    PRINT(text, format);
    om_report_verdict(report, text, is_good);
}

// Replace the bars by ends; the parts.
static int split(char* text, const char* part[MAX_FACT]) {
    int n = 0;
    part[n++] = text;
    for (; *text; ++text)
        if (*text == '|' && n < MAX_FACT) *text = 0, part[n++] = text + 1;
    return n;
}

void om__report_facts(OmReport* report, const char* label, const char* format, ...) {
    char value[MAX_TEXT], name[MAX_TEXT];
    const char *values[MAX_FACT], *names[MAX_FACT];
    va_list args;
    va_start(args, format);
    vsnprintf(value, sizeof value, format, args);
    va_end(args);
    snprintf(name, sizeof name, "%s", label);
    const int nvalue = split(value, values), nname = split(name, names);
    om_report_facts(report, values, names, nvalue < nname ? nvalue : nname);
}

// ---- pictures -------------------------------------------------------------------------------------

OmStatus om__report_render(OmReport* report, OmSenseScene* scene, const OmCamera* camera,
                           int nworker, const char* caption) {
    OmPicture picture = {0};
    OmSenseOptions options = om_sense_options_default();
    options.nworker = nworker;
    OM_TRY(om_sense_scene_commit(scene));
    OM_TRY(om_picture_init(&picture, camera->width, camera->height, 3));
    OmStatus status = om_sense_render(scene, camera, &options, &picture);
    if (status == OM_OK) om_report_picture(report, &picture, caption);
    om_picture_done(&picture);
    return status;
}

// ---- files ----------------------------------------------------------------------------------------

OmStatus om__report_end(OmReport* report, const char* dir, OmStatus status) {
    char path[1024];
    if (status >= 0) status = om_path_join(dir, "report.html", path, sizeof path);
    if (status >= 0) return om_report_save(report, path);
    om_report_done(report);
    return status;
}

OmJson om__json(OmText* text) {
    OmJson json = om_json_begin(text);
    om_json_open(&json, NULL, '{');
    return json;
}

static void put_all(OmJson* json, const char* format, va_list args) {
    while (*format) {
        char key[64];
        const size_t n = strcspn(format, " ");
        const bool is_truth = n > 0 && format[n - 1] == '?';
        const char* type = format + n + 2;  // behind " %"
        snprintf(key, sizeof key, "%.*s", (int)n - is_truth, format);
        switch (*type) {
        case 'd':
            if (is_truth)
                om_json_bool(json, key, va_arg(args, int));
            else
                om_json_integer(json, key, va_arg(args, int));
            break;
        case 'l': om_json_integer(json, key, va_arg(args, long long)); break;
        case 'f': om_json_number(json, key, va_arg(args, double)); break;
        default: om_json_string(json, key, va_arg(args, const char*));
        }
        format = type + strcspn(type, "|");
        if (*format) ++format;
    }
}

void om__put(OmJson* json, const char* format, ...) {
    va_list args;
    va_start(args, format);
    put_all(json, format, args);
    va_end(args);
}

void om__put_object(OmJson* json, const char* key, const char* format, ...) {
    va_list args;
    va_start(args, format);
    om_json_open(json, key, '{');
    put_all(json, format, args);
    om_json_close(json, '}');
    va_end(args);
}

double om__finite(double value) { return isfinite(value) ? value : 1e300; }

void om__put_vec3(OmJson* json, const char* key, OmVec3 v) {
    const double x[3] = {om__finite(v.x), om__finite(v.y), om__finite(v.z)};
    om_json_numbers(json, key, x, 3);
}

OmStatus om__study_save_json(const char* dir, OmJson* json, OmStatus status) {
    char path[1024];
    om_json_close(json, '}');
    if (status >= 0) status = om_path_join(dir, "study.json", path, sizeof path);
    if (status >= 0) return om_json_save(json, path);
    om_text_done(json->text);
    return status;
}

void om__lines_add(StudyLines* lines, const char* format, ...) {
    PRINT(text, format);
    if (lines->status == OM_OK) lines->status = om_text_append(&lines->text, "%s", text);
}

OmStatus om__lines_save(StudyLines* lines, const char* dir, const char* name) {
    char path[1024];
    OmStatus status = lines->status;
    if (status >= 0) status = om_path_join(dir, name, path, sizeof path);
    if (status >= 0) status = om_file_write(path, lines->text.str, lines->text.len);
    om_text_done(&lines->text);
    return status;
}

void om__lines_fold(StudyLines* lines, OmReport* report, const char* summary) {
    om_report_fail(report, lines->status);
    if (lines->text.len > 0) om_report_details(report, summary, lines->text.str);
    om_text_done(&lines->text);
}

// ---- goals ------------------------------------------------------------------------------------------

static bool is_met(const StudyGoal* g) {
    return g->is_most ? g->found <= g->bound : g->found >= g->bound;  // a NaN is neither
}

static int count_met(const StudyGoals* goals) {
    int nmet = 0;
    for (int i = 0; i < goals->n; ++i) nmet += is_met(&goals->goal[i]);
    return nmet;
}

bool om__goals_met(StudyGoals goals) { return count_met(&goals) == goals.n; }

void om__report_goals(OmReport* report, const char* subject, StudyGoals goals) {
    const int nmet = count_met(&goals);
    StudyTable table = om__table("goal|found|bound|thesis|");
    om__report_judge(report, nmet == goals.n, "%s: %d of %d goals are met.", subject, nmet,
                     goals.n);
    for (int i = 0; i < goals.n; ++i) {
        const StudyGoal* g = &goals.goal[i];
        char found[32] = "-", bound[32];
        if (g->found == g->found) snprintf(found, sizeof found, g->format, g->found);
        snprintf(bound, sizeof bound, g->format, g->bound);
        om__table_row(&table, "%s|%s|%s %s|%s|%s", g->what, found,
                      g->is_most ? "at most" : "at least", bound, g->thesis ? g->thesis : "",
                      is_met(g) ? "met" : "missed");
    }
    om__table_end(&table, report);
}
