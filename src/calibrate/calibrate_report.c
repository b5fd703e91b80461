// calibrate_report.c: the result files of a calibration: report.html, calibration.json, calibrated.yaml.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_internal.h"
#include "omentum/report.h"

#define WORD 32
#define MAX_COLUMN 12  // levels in the table of errors

typedef struct Leaf {  // the contents of the report
    const OmCalibrationDef* def;
    const OmCalibrationResult* r;
} Leaf;

static const char* format(char* out, const OmCalibrationParam* p, double v) {
    snprintf(out, WORD, "%.5g", v / p->unit);
    return out;
}

// ---- result ---------------------------------------------------------------------------------------

static void add_verdict(const Leaf* l, OmReport* report) {
    const OmCalibrationDef* d = l->def;
    const OmCalibrationResult* r = l->r;
    char text[512];
    switch (r->outcome) {
    case OM_CALIBRATED:
        snprintf(text, sizeof text, "Calibrated: the error fell from %.3f to %.3f mm.",
                 1e3 * r->cost_start, 1e3 * r->cost);
        break;
    case OM_CALIBRATION_BUDGET:
        snprintf(text, sizeof text,
                 "Not finished: the evaluations were used up at %.3f mm; more may lower it.",
                 1e3 * r->cost);
        break;
    default:
        snprintf(
            text, sizeof text,
            "This model cannot fit: the search stagnates at %.3f mm, %.1f times the noise of %.3f "
            "mm. Look for what the model lacks (attachments, geometry, registration, law) before "
            "trusting its parameters.",
            1e3 * r->cost, r->cost / d->noise, 1e3 * d->noise);
    }
    if (r->is_of_mesh) {
        size_t n = strlen(text);
        snprintf(text + n, sizeof text - n,
                 " The values are those of this mesh: one %.2g times finer shows something else "
                 "with them, by %.3f mm. They serve this mesh, and are not the tissue's own.",
                 r->mesh_ratio, 1e3 * r->mesh_difference);
    }
    om_report_verdict(report, text, r->outcome == OM_CALIBRATED && !r->is_of_mesh);
    int n = snprintf(
        text, sizeof text,
        "Asked: values of %d parameter%s with which the model repeats what was observed%s. Came out: "
        "a mean error of %.3f mm",
        d->nparam, d->nparam == 1 ? "" : "s",
        d->noise > 0 ? ", to the noise of the observations" : "", 1e3 * r->cost);
    if (d->noise > 0)
        n += snprintf(text + n, sizeof text - (size_t)n, ", where the noise is %.3f mm",
                      1e3 * d->noise);
    snprintf(
        text + n, sizeof text - (size_t)n,
        ". A value is to be used where the last column below says that the data determine it.");
    om_report_paragraph(report, text);
    char fact[4][WORD];
    snprintf(fact[0], WORD, "%.3f mm", 1e3 * r->cost_start);
    snprintf(fact[1], WORD, "%.3f mm", 1e3 * r->cost);
    snprintf(fact[2], WORD, d->noise > 0 ? "%.3f mm" : "not stated", 1e3 * d->noise);
    snprintf(fact[3], WORD, "%d", r->neval);
    const char* value[] = {fact[0], fact[1], fact[2], fact[3]};
    static const char* const label[] = {"error at the start", "error at the best", "noise",
                                        "evaluations"};
    om_report_facts(report, value, label, 4);
}

// How well the data determine a parameter, in words.
static void judge(const Leaf* l, int k, char* out, size_t size) {
    const OmCalibrationDef* d = l->def;
    const OmCalibrationProfile* f = &l->r->profile[k];
    if (!l->r->has_profile)
        snprintf(out, size, "not looked at");
    else if (f->is_determined)
        snprintf(out, size, "determined%s", l->r->is_of_mesh ? ", of this mesh" : "");
    else if (f->partner >= 0)
        snprintf(out, size,
                 "the data cannot determine it apart from %s: only their %s matters (%.2f)",
                 d->param[f->partner].name,
                 f->partner_rho > 0 ? "sum or product" : "difference or ratio", f->partner_rho);
    else
        snprintf(out, size, "the data cannot determine it: open %s",
                 f->is_open_lo && f->is_open_hi ? "on both sides"
                 : f->is_open_lo                ? "below"
                                                : "above");
}

static void add_params(const Leaf* l, OmReport* report) {
    enum { NCOL = 8 };
    static const char* const heading[NCOL] = {"parameter",
                                              "best",
                                              "start",
                                              "bounds",
                                              "from",
                                              "to",
                                              "with the mesh's error",
                                              "determined by the data"};
    char text[OM_CALIBRATION_MAX_PARAM][NCOL][160];
    const char* cell[OM_CALIBRATION_MAX_PARAM * NCOL];
    for (int k = 0; k < l->def->nparam; ++k) {
        const OmCalibrationParam* p = &l->def->param[k];
        const OmCalibrationProfile* f = &l->r->profile[k];
        char a[WORD], b[WORD];
        snprintf(text[k][0], 160, "%s", p->name);
        format(text[k][1], p, l->r->best[k]);
        format(text[k][2], p, p->start);
        snprintf(text[k][3], 160, "%s to %s", format(a, p, p->lo), format(b, p, p->hi));
        snprintf(text[k][4], 160, "-");
        snprintf(text[k][5], 160, "-");
        if (l->r->has_profile) format(text[k][4], p, f->lo), format(text[k][5], p, f->hi);
        snprintf(text[k][6], 160, "-");
        if (l->r->has_profile && l->r->has_mesh)
            snprintf(text[k][6], 160, "%s to %s", format(a, p, f->mesh_lo),
                     format(b, p, f->mesh_hi));
        judge(l, k, text[k][7], 160);
        for (int c = 0; c < NCOL; ++c) cell[k * NCOL + c] = text[k][c];
    }
    om_report_heading(report, "Parameters");
    om_report_table(report, heading, NCOL, cell, l->def->nparam);
    char note[512];
    snprintf(
        note, sizeof note,
        "From and to: how far each parameter can move, the others at the best, before the error rises "
        "by %.0f %% of itself%s. Two parameters of which only a combination matters are named.",
        100 * l->def->rise, l->def->noise > 0 ? ", or of the noise where that is more" : "");
    if (l->r->has_profile) om_report_paragraph(report, note);
    const OmCalibrationResult* r = l->r;
    if (!r->has_mesh) return;
    snprintf(
        note, sizeof note,
        "With the mesh's error: a mesh %.2g times finer, with the best values, shows something else by %.3f mm; "
        "all of the mesh's error is %.3f mm, extrapolated for elements of second order. The interval is how far "
        "each parameter can move before the error rises by as much, added as squares. A finer mesh makes it "
        "narrower.",
        r->mesh_ratio, 1e3 * r->mesh_difference, 1e3 * r->mesh_cost);
    om_report_paragraph(report, note);
}

// ---- errors by level and landmark -----------------------------------------------------------------

typedef struct Table {
    int nlevel, nrow, ncol;
    double level[MAX_COLUMN];
    double* sum;  // sums before and after, and their number      (nrow x nlevel x 3)
} Table;

// Collect the distinct levels, ascending, the first MAX_COLUMN of them.
static void find_levels(const OmCalibrationDef* d, Table* t) {
    for (int i = 0; i < d->nerror; ++i) {
        int k = 0;
        while (k < t->nlevel && t->level[k] < d->label[i].level) ++k;
        if (k == MAX_COLUMN || (k < t->nlevel && t->level[k] == d->label[i].level)) continue;
        int end = t->nlevel < MAX_COLUMN ? t->nlevel++ : MAX_COLUMN - 1;
        memmove(t->level + k + 1, t->level + k, (size_t)(end - k) * sizeof *t->level);
        t->level[k] = d->label[i].level;
    }
}

static OmStatus fill_table(const Leaf* l, Table* t) {
    const OmCalibrationDef* d = l->def;
    find_levels(d, t);
    t->nrow = d->nexperiment * d->nlandmark;
    t->sum = om_calloc((size_t)t->nrow * MAX_COLUMN * 3, sizeof *t->sum);
    if (!t->sum) return OM_NO_MEMORY;
    for (int i = 0; i < d->nerror; ++i) {
        int k = 0, row = d->label[i].experiment * d->nlandmark + d->label[i].landmark;
        while (k < t->nlevel && t->level[k] != d->label[i].level) ++k;
        if (k == t->nlevel) continue;
        double* s = t->sum + 3 * (row * MAX_COLUMN + k);
        s[0] += l->r->error_start[i];
        s[1] += l->r->error[i];
        s[2] += 1;
    }
    return OM_OK;
}

static bool has_row(const Table* t, int row) {
    for (int k = 0; k < t->nlevel; ++k)
        if (t->sum[3 * (row * MAX_COLUMN + k) + 2] > 0) return true;
    return false;
}

static OmStatus add_error_table(const Leaf* l, OmReport* report) {
    const OmCalibrationDef* d = l->def;
    Table t = {0};
    if (!d->label) return OM_OK;
    OM_TRY(fill_table(l, &t));
    int ncol = 2 + t.nlevel, n = 0;
    const char* heading[2 + MAX_COLUMN] = {"experiment", "landmark"};
    char level[MAX_COLUMN][WORD];
    char(*text)[WORD] = om_alloc((size_t)t.nrow * MAX_COLUMN, sizeof *text);
    const char** cell = om_alloc((size_t)t.nrow * (size_t)ncol, sizeof *cell);
    for (int k = 0; k < t.nlevel; ++k) {
        snprintf(level[k], WORD, "%.4g mm", 1e3 * t.level[k]);
        heading[2 + k] = level[k];
    }
    for (int row = 0; text && cell && row < t.nrow; ++row) {
        if (!has_row(&t, row)) continue;
        const char** c = cell + ncol * n++;
        c[0] = d->experiment[row / d->nlandmark];
        c[1] = d->landmark[row % d->nlandmark];
        for (int k = 0; k < t.nlevel; ++k) {
            const double* s = t.sum + 3 * (row * MAX_COLUMN + k);
            char* out = text[row * MAX_COLUMN + k];
            snprintf(out, WORD, s[2] > 0 ? "%.2f (%.2f)" : "-", 1e3 * s[1] / s[2],
                     1e3 * s[0] / s[2]);
            c[2 + k] = out;
        }
    }
    om_report_heading(report, "Errors");
    if (n) om_report_table(report, heading, ncol, cell, n);
    om_report_paragraph(
        report, "Mean distance in mm by experiment, landmark and level: at the best, and in "
                "brackets at the start. Forces count as the problem says.");
    OmStatus status = text && cell ? OM_OK : OM_NO_MEMORY;
    om_free(text);
    om_free(cell);
    om_free(t.sum);
    return status;
}

// ---- charts ---------------------------------------------------------------------------------------

static OmStatus add_convergence(const Leaf* l, OmReport* report) {
    int n = l->r->neval;
    double* x = om_alloc(3 * (size_t)n, sizeof *x);
    if (!x) return OM_NO_MEMORY;
    double *all = x + n, *best = all + n, min = INFINITY, max = 0;
    for (int i = 0; i < n; ++i) {
        min = fmin(min, l->r->trace[i]);
        if (isfinite(l->r->trace[i])) max = fmax(max, l->r->trace[i]);
        x[i] = i + 1;
        all[i] = 1e3 * l->r->trace[i];
        best[i] = 1e3 * min;
    }
    double event[2] = {1.5 + l->r->nglobal, 1.5 + l->r->nglobal + l->r->nlocal};
    OmReportChart chart = {.title = "Convergence: global search, local search, sensitivity",
                           .x_label = "evaluation",
                           .y_label = "error, mm",
                           .nseries = 2,
                           .is_log_y = max > 10 * l->r->cost,
                           .has_limit = l->def->noise > 0,
                           .limit = 1e3 * l->def->noise,
                           .limit_name = "noise",
                           .event = event,
                           .nevent = l->r->has_profile ? 2 : l->r->nlocal > 0};
    chart.series[0] = (OmReportSeries){"each evaluation", x, all, n, false};
    chart.series[1] = (OmReportSeries){"best so far", x, best, n, true};
    om_report_heading(report, "Search");
    om_report_chart(report, &chart);
    char text[400];
    static const char* const global[] = {"No global search",
                                         "Differential evolution (current-to-pbest/1/bin)",
                                         "NLopt's controlled random search", "NLopt's ESCH"};
    static const char* const local[] = {"no local search", "NLopt's SBPLX", "NLopt's BOBYQA"};
    snprintf(
        text, sizeof text,
        "%s, %d evaluations in %d generations, to %.3f mm; then %s within %.0f %% of the range "
        "around the best, %d evaluations; %d for the sensitivity. Seed %llu.",
        global[l->def->global], l->r->nglobal, l->r->ngeneration, 1e3 * l->r->cost_global,
        local[l->def->local], 100 * l->def->local_range, l->r->nlocal, l->r->nprofile,
        (unsigned long long)l->def->seed);
    om_report_paragraph(report, text);
    om_free(x);
    return OM_OK;
}

static void add_profile(const Leaf* l, int k, OmReport* report) {
    enum { N = OM_CALIBRATION_NPROFILE };
    const OmCalibrationParam* p = &l->def->param[k];
    const OmCalibrationProfile* f = &l->r->profile[k];
    double x[N], y[N];
    int n = 0;
    for (int i = 0; i < N; ++i) {
        if (n && f->x[i] / p->unit <= x[n - 1]) continue;  // at a bound points coincide
        x[n] = f->x[i] / p->unit;
        y[n++] = 1e3 * f->cost[i];
    }
    double middle = f->cost[N / 2];
    OmReportChart chart = {
        .title = p->name,
        .x_label = p->name,
        .y_label = "error, mm",
        .nseries = 1,
        .is_log_x = p->is_log,
        .has_limit = true,
        .limit = 1e3 * om__calibrate_limit(l->def, middle),
        .limit_name = "rise that counts",
    };
    chart.series[0] = (OmReportSeries){"error along this parameter", x, y, n, false};
    om_report_chart(report, &chart);
}

// ---- files ----------------------------------------------------------------------------------------

static OmStatus save_page(const Leaf* l, const char* path) {
    OmReport report;
    char subtitle[96];
    snprintf(subtitle, sizeof subtitle, "%d parameter%s, %d observed distances", l->def->nparam,
             l->def->nparam == 1 ? "" : "s", l->def->nerror);
    om_report_begin(&report, l->def->title ? l->def->title : "Calibration", subtitle);
    add_verdict(l, &report);
    add_params(l, &report);
    OmStatus status = add_error_table(l, &report);
    if (status == OM_OK) status = add_convergence(l, &report);
    if (status < 0) {
        om_report_done(&report);
        return status;
    }
    if (l->r->has_profile) om_report_heading(&report, "Sensitivity");
    for (int k = 0; l->r->has_profile && k < l->def->nparam; ++k) add_profile(l, k, &report);
    return om_report_save(&report, path);
}

static void put_param(const Leaf* l, int k, OmJson* json) {
    const OmCalibrationParam* p = &l->def->param[k];
    const OmCalibrationProfile* f = &l->r->profile[k];
    om_json_open(json, NULL, '{');
    om_json_string(json, "name", p->name);
    om_json_number(json, "best", l->r->best[k] / p->unit);
    om_json_number(json, "start", p->start / p->unit);
    om_json_number(json, "min", p->lo / p->unit);
    om_json_number(json, "max", p->hi / p->unit);
    if (l->r->has_profile) {
        om_json_number(json, "from", f->lo / p->unit);
        om_json_number(json, "to", f->hi / p->unit);
        if (l->r->has_mesh) {
            om_json_number(json, "from_with_mesh", f->mesh_lo / p->unit);
            om_json_number(json, "to_with_mesh", f->mesh_hi / p->unit);
        }
        om_json_bool(json, "is_open_below", f->is_open_lo);
        om_json_bool(json, "is_open_above", f->is_open_hi);
        om_json_bool(json, "is_determined", f->is_determined);
        om_json_string(json, "traded_for", f->partner >= 0 ? l->def->param[f->partner].name : "");
    }
    om_json_close(json, '}');
}

static OmStatus save_json(const Leaf* l, const char* path) {
    static const char* const outcome[] = {"calibrated", "budget", "unfit"};
    const OmCalibrationResult* r = l->r;
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "title", l->def->title);
    om_json_string(&json, "outcome", outcome[r->outcome]);
    om_json_number(&json, "error_start_m", r->cost_start);
    om_json_number(&json, "error_global_m", r->cost_global);
    om_json_number(&json, "error_m", r->cost);
    om_json_number(&json, "noise_m", l->def->noise);
    if (r->has_mesh) {
        om_json_number(&json, "finer_mesh_ratio", r->mesh_ratio);
        om_json_number(&json, "difference_to_finer_mesh_m", r->mesh_difference);
        om_json_number(&json, "error_of_mesh_m", r->mesh_cost);
        om_json_bool(&json, "is_of_this_mesh", r->is_of_mesh);
    }
    om_json_integer(&json, "evaluations", r->neval);
    om_json_integer(&json, "seed", (int64_t)l->def->seed);
    om_json_open(&json, "parameters", '[');
    for (int k = 0; k < l->def->nparam; ++k) put_param(l, k, &json);
    om_json_close(&json, ']');
    om_json_open(&json, "errors", '[');
    for (int i = 0; l->def->label && i < r->nerror; ++i) {
        const OmCalibrationLabel* b = &l->def->label[i];
        om_json_open(&json, NULL, '{');
        om_json_string(&json, "experiment", l->def->experiment[b->experiment]);
        om_json_string(&json, "landmark", l->def->landmark[b->landmark]);
        om_json_number(&json, "level_m", b->level);
        om_json_number(&json, "start_m", r->error_start[i]);
        om_json_number(&json, "error_m", r->error[i]);
        om_json_close(&json, '}');
    }
    om_json_close(&json, ']');
    om_json_close(&json, '}');
    OmStatus status = om_json_end(&json);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}

// A parameter that the data do not determine is left out.
static bool is_idle(const Leaf* l, int k) {
    return l->r->has_profile && l->r->profile[k].is_open_lo && l->r->profile[k].is_open_hi;
}

static OmStatus append_param(const Leaf* l, int k, const char* key, OmText* t) {
    const OmCalibrationParam* p = &l->def->param[k];
    const OmCalibrationProfile* f = &l->r->profile[k];
    bool is_doubtful = l->r->has_profile && !f->is_determined;
    OM_TRY(
        om_text_append(t, "%s%s: %.9g", is_idle(l, k) ? "# " : "", key, l->r->best[k] / p->unit));
    if (l->r->has_profile)
        OM_TRY(om_text_append(t, "  # %.4g to %.4g%s", f->lo / p->unit, f->hi / p->unit,
                              is_doubtful ? "; the data cannot determine it" : ""));
    return om_text_append(t, "\n");
}

// "tissue.young" is `young` of the mapping `tissue`; the parameters of a mapping are written together.
static OmStatus append_group(const Leaf* l, int first, OmText* t) {
    const OmCalibrationParam* p = l->def->param;
    const char* name = p[first].name;
    size_t n = strcspn(name, ".");
    if (name[n] != '.') return append_param(l, first, name, t);
    for (int k = 0; k < first; ++k)
        if (strncmp(p[k].name, name, n + 1) == 0) return OM_OK;  // written together with that one
    bool is_empty = true;
    for (int k = first; k < l->def->nparam; ++k)
        is_empty = is_empty && (strncmp(p[k].name, name, n + 1) != 0 || is_idle(l, k));
    OM_TRY(om_text_append(t, "%s%.*s:\n", is_empty ? "# " : "", (int)n, name));
    for (int k = first; k < l->def->nparam; ++k) {
        if (strncmp(p[k].name, name, n + 1) != 0) continue;
        OM_TRY(om_text_append(t, "  "));
        OM_TRY(append_param(l, k, p[k].name + n + 1, t));
    }
    return OM_OK;
}

static OmStatus append_yaml(const Leaf* l, OmText* t) {
    OM_TRY(om_text_append(t, "# "));
    OM_TRY(om_text_append_plain(t, l->def->title, strlen(l->def->title)));
    OM_TRY(om_text_append(t, ": error %.3f mm", 1e3 * l->r->cost));
    if (l->def->noise > 0) OM_TRY(om_text_append(t, ", noise %.3f mm", 1e3 * l->def->noise));
    if (l->r->outcome == OM_CALIBRATION_UNFIT) OM_TRY(om_text_append(t, "; the model cannot fit"));
    if (l->r->is_of_mesh) OM_TRY(om_text_append(t, "; values of the mesh they were found with"));
    OM_TRY(om_text_append(t, "\n"));
    for (int k = 0; k < l->def->nparam; ++k) OM_TRY(append_group(l, k, t));
    return OM_OK;
}

static OmStatus save_yaml(const Leaf* l, const char* path) {
    OmText text = {0};
    OmStatus status = append_yaml(l, &text);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status;
}

OmStatus om__calibrate_report(const OmCalibrationDef* def, const OmCalibrationResult* result) {
    static const struct {
        const char* name;
        OmStatus (*save)(const Leaf* l, const char* path);
    } file[] = {{"calibrated.yaml", save_yaml},
                {"calibration.json", save_json},
                {"report.html", save_page}};
    Leaf leaf = {def, result};
    char path[1024];
    for (size_t i = 0; i < sizeof file / sizeof *file; ++i) {
        OM_TRY(om_path_join(def->out_dir, file[i].name, path, sizeof path));
        OM_TRY(file[i].save(&leaf, path));
    }
    return OM_OK;
}
