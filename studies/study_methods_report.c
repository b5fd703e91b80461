// study_methods_report.c: report.html, study.json and errors.csv of the comparison of methods.
#include <math.h>

#include "studies/study_internal.h"

#define NDEPTH OM_STUDY_NDEPTH
#define WORD 40
#define MAX_ROW (OM_STUDY_MAX_LESION + 2)

static OmStatus path_of(const StudyMethods* s, const char* name, char* out, size_t size) {
    return om_path_join(s->def->out_dir, name, out, size);
}

// ---- numbers for programs -------------------------------------------------------------------------

static OmStatus write_json(const StudyMethods* s) {
    const OmStudyMethodsSummary* sum = &s->sum;
    char path[1024];
    OmText text = {0};
    OM_TRY(path_of(s, "study.json", path, sizeof path));
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "weights", s->training);
    om_json_integer(&json, "deformations", sum->ncount);
    om_json_integer(&json, "outside_of_training", sum->noutside);
    for (int by = 0; by < OM_STUDY_NBY; ++by) {
        const OmStudyMethodResult* r = &sum->by[by];
        double mm[NDEPTH];
        for (int k = 0; k < NDEPTH; ++k) mm[k] = 1e3 * r->error[k];
        om_json_open(&json, om__study_method_by_name[by], '{');
        om_json_number(&json, "mean_error_mm", 1e3 * r->mean);
        om_json_numbers(&json, "error_by_depth_mm", mm, NDEPTH);
        om_json_number(&json, "step_ms", r->ms);
        om_json_number(&json, "stability", r->stability);
        om_json_close(&json, '}');
    }
    om_json_number(&json, "worst_gap_mm", 1e3 * sum->worst_gap);
    om_json_bool(&json, "bar_met", sum->is_met);
    om__study_put_contours(&json, &s->fit.study);
    om_json_close(&json, '}');
    return om_json_save(&json, path);
}

static OmStatus write_errors(const StudyMethods* s) {
    char path[1024];
    OmText t = {0};
    OM_TRY(path_of(s, "errors.csv", path, sizeof path));
    OmStatus status = om_text_append(&t, "method,lesion,depth_mm,error_mm,counts\n");
    for (int by = 0; by < OM_STUDY_NBY; ++by)
        for (int l = 0; l < s->def->nlesion; ++l)
            for (int k = 0; k < NDEPTH && status == OM_OK; ++k)
                if (s->error[by][l][k] >= 0)
                    status =
                        om_text_append(&t, "%s,%d,%g,%.5f,%d\n", om__study_method_by_name[by],
                                       l + 1, 1e3 * s->fit.contact.depth[k],
                                       1e3 * s->error[by][l][k], om__study_methods_count(s, l, k));
    if (status == OM_OK) status = om_file_write(path, t.str, t.len);
    om_text_done(&t);
    return status;
}

// ---- the report -----------------------------------------------------------------------------------

static void add_outcome(const StudyMethods* s, OmReport* report) {
    const OmStudyMethodsSummary* sum = &s->sum;
    char text[400], fact[4][WORD];
    int len = snprintf(
        text, sizeof text,
        "Criterion %s: the network's error is at %s %.2f mm %s than that of finite elements at "
        "every depth (0.3 mm larger is allowed)",
        sum->is_met ? "met" : "missed", sum->worst_gap < 0 ? "least" : "most",
        1e3 * fabs(sum->worst_gap), sum->worst_gap < 0 ? "smaller" : "larger");
    for (int by = 0; by < OM_STUDY_NBY; ++by)
        if (sum->by[by].stability < 1 - 1e-12)
            len += snprintf(text + len, sizeof text - (size_t)len,
                            "; %s: %.0f %% of its paths are completed",
                            om__study_method_by_title[by], 100 * sum->by[by].stability);
    om_report_verdict(report, text, sum->is_met);
    for (int by = 0; by < OM_STUDY_NBY; ++by)
        snprintf(fact[by], WORD, "%.2f mm", 1e3 * sum->by[by].mean);
    const char* value[] = {fact[0], fact[1], fact[2], fact[3]};
    om_report_facts(report, value, om__study_method_by_title, OM_STUDY_NBY);
}

// Table 3.5.
static void add_costs(const StudyMethods* s, OmReport* report) {
    static const char* const heading[] = {"", "a step, ms", "stability, %", "mean error, mm"};
    char text[OM_STUDY_NBY][3][WORD];
    const char* cell[OM_STUDY_NBY][4];
    for (int by = 0; by < OM_STUDY_NBY; ++by) {
        const OmStudyMethodResult* r = &s->sum.by[by];
        snprintf(text[by][0], WORD, "%.2f", r->ms);
        snprintf(text[by][1], WORD, "%.1f", 100 * r->stability);
        snprintf(text[by][2], WORD, "%.2f", 1e3 * r->mean);
        cell[by][0] = om__study_method_by_title[by];
        cell[by][1] = by == OM_STUDY_RIGID ? NULL : text[by][0];
        cell[by][2] = text[by][1];
        cell[by][3] = text[by][2];
    }
    om_report_heading(report, "Time and stability (thesis, Table 3.5)");
    om_report_table(report, heading, 4, cell[0], OM_STUDY_NBY);
}

// Fig. 3.11 and the pairs behind it.
static void add_depths(const StudyMethods* s, OmReport* report) {
    const OmStudyMethodsSummary* sum = &s->sum;
    double depth[NDEPTH], mean[OM_STUDY_NBY][NDEPTH];
    OmReportChart chart = {.title = "Mean error by deformation (thesis, Fig. 3.11)",
                           .x_label = "probe displacement, mm",
                           .y_label = "mm",
                           .nseries = OM_STUDY_NBY,
                           .has_range = true};
    for (int by = 0; by < OM_STUDY_NBY; ++by) {
        for (int k = 0; k < NDEPTH; ++k) {
            depth[k] = 1e3 * s->fit.contact.depth[k];
            mean[by][k] = sum->by[by].ndepth[k] ? 1e3 * sum->by[by].error[k] : (double)NAN;
        }
        chart.series[by] =
            (OmReportSeries){om__study_method_by_title[by], depth, mean[by], NDEPTH, false};
    }
    om_report_heading(report, "Accuracy");
    om_report_chart(report, &chart);
    static const char* const heading[] = {"depth, mm", "lesions", "finite elements, mm",
                                          "U-Mesh, mm", "U-Mesh less finite elements, mm"};
    char text[NDEPTH][5][WORD];
    const char* cell[NDEPTH][5];
    for (int k = 0; k < NDEPTH; ++k) {
        snprintf(text[k][0], WORD, "%.0f", depth[k]);
        snprintf(text[k][1], WORD, "%d", sum->by[OM_STUDY_FE].ndepth[k]);
        snprintf(text[k][2], WORD, "%.2f", 1e3 * sum->by[OM_STUDY_FE].error[k]);
        snprintf(text[k][3], WORD, "%.2f", 1e3 * sum->by[OM_STUDY_UMESH].error[k]);
        snprintf(text[k][4], WORD, "%+.2f", 1e3 * sum->gap[k]);
        bool has = sum->by[OM_STUDY_FE].ndepth[k] > 0;
        for (int c = 0; c < 5; ++c) cell[k][c] = has || c < 2 ? text[k][c] : NULL;
    }
    om_report_table(report, heading, 5, cell[0], NDEPTH);
    om_report_paragraph(report,
                        "Means over the lesions for which truth and every method came to this "
                        "depth: the same for all, so differences are paired.");
}

// Table 3.6 of one method.
static void add_lesions(const StudyMethods* s, OmStudyMethod by, OmReport* report) {
    const char* heading[NDEPTH + 1] = {"lesion"};
    char name[NDEPTH][WORD], text[MAX_ROW][NDEPTH + 1][WORD], title[96];
    const char* cell[MAX_ROW][NDEPTH + 1] = {{0}};
    for (int k = 0; k < NDEPTH; ++k) {
        snprintf(name[k], WORD, "D%.0f", 1e3 * s->fit.contact.depth[k]);
        heading[1 + k] = name[k];
    }
    for (int l = 0; l < s->def->nlesion; ++l) {
        snprintf(text[l][0], WORD, "%d", l + 1);
        cell[l][0] = text[l][0];
        for (int k = 0; k < NDEPTH; ++k) {
            if (s->error[by][l][k] < 0) continue;
            bool is_marked = by == OM_STUDY_UMESH && s->is_outside[l][k];
            snprintf(text[l][1 + k], WORD, "%.2f%s", 1e3 * s->error[by][l][k],
                     is_marked ? " *" : "");
            cell[l][1 + k] = text[l][1 + k];
        }
    }
    snprintf(title, sizeof title, "Error by lesion, mm: %s%s", om__study_method_by_title[by],
             by == OM_STUDY_UMESH ? " (* outside the range of the training, by its own test)" : "");
    om_report_paragraph(report, title);
    om_report_table(report, heading, NDEPTH + 1, cell[0], s->def->nlesion);
}

// The statements of Table 3.7 with their numbers.
static void add_statements(const StudyMethods* s, OmReport* report) {
    static const char* const heading[] = {"", "finite elements", "particles", "U-Mesh"};
    const OmStudyMethodResult* r = s->sum.by;
    char ms[3][WORD], error[3][WORD], ways[3][WORD];
    for (int by = 0; by < 3; ++by) {
        snprintf(ms[by], WORD, "%.2f ms, %.0f a second", r[by].ms,
                 r[by].ms > 0 ? 1e3 / r[by].ms : 0);
        snprintf(error[by], WORD, "%.2f mm", 1e3 * r[by].mean);
        snprintf(ways[by], WORD, "%.0f %% of the paths", 100 * r[by].stability);
    }
    const char* cell[][4] = {
        {"time of a step", ms[0], ms[1], ms[2]},
        {"error on the lesions", error[0], error[1], error[2]},
        {"stability", ways[0], ways[1], ways[2]},
        {"parameters", "physical: Young's modulus, Poisson's ratio",
         "of the clusters, to be calibrated for each body", "none: those of the samples"},
        {"new parameters during the task", "at once", "at once, after a calibration of minutes",
         "new samples and training"},
        {"where the probe touches",
         "known beforehand (prescribed), or found (penalty, multipliers)", "found",
         "known beforehand; other places are reported"},
        {"forces", "on the probe and at the attachments", "none (clusters)", "none"},
    };
    om_report_heading(report, "Properties of the methods (thesis, Table 3.7)");
    om_report_table(report, heading, 4, cell[0], (int)(sizeof cell / sizeof *cell));
}

static void add_assumptions(const StudyMethods* s, OmReport* report) {
    const OmStudyMethodsDef* d = s->def;
    const OmStudyContactDef* c = &s->fit.contact;
    char text[1000];
    om_report_heading(report, "Assumptions");
    snprintf(
        text, sizeof text,
        "Truth: %d quadratic tetrahedra, static, lesions %.1f times as stiff, contact without friction, and the "
        "noise of the tracking (%.2f mm once a lesion, %.2f mm at each depth). Finite elements: %d linear "
        "tetrahedra, %s, %.0f Pa, %.2f. Particles: %d, %.3g mm apart; clusters of %.2f mm, radius %.2f mm, "
        "stiffness %.3f. %s. Prescribed displacement and the network stick to the probe, truth slides.",
        s->fit.study.truth[0].ntet, c->lesion_ratio, 1e3 * c->pointer_noise, 1e3 * c->probe_noise,
        om__study_run_at(&s->fit.study, 0, OM_PRESS_PRESCRIBED, 0)->ntet,
        om_law_name(c->material.law), c->material.young, c->material.poisson,
        s->fit.particles.nvert, 1e3 * d->spacing, 1e3 * d->cluster[0], 1e3 * d->cluster[1],
        d->cluster[2], s->training);
    om_report_paragraph(report, text);
    om_report_paragraph(
        report,
        "The compared point is the point of a lesion's contour that faces the probe. For particles it is the particle "
        "nearest to it, minus their distance at rest; in a mesh it is the point itself. The time of a step is "
        "the median over the probe's path for finite elements and the network, and for "
        "particles the mean, with as many parallel paths as there are workers.");
}

static OmStatus write_report(const StudyMethods* s) {
    char path[1024], subtitle[96];
    OM_TRY(path_of(s, "report.html", path, sizeof path));
    snprintf(subtitle, sizeof subtitle, "%d lesions of a breast phantom, 10 to 30 mm",
             s->def->nlesion);
    OmReport report;
    om_report_begin(&report, "Finite elements, particles and a trained network", subtitle);
    add_outcome(s, &report);
    add_costs(s, &report);
    add_depths(s, &report);
    for (int by = 0; by < OM_STUDY_NBY; ++by) add_lesions(s, (OmStudyMethod)by, &report);
    add_statements(s, &report);
    add_assumptions(s, &report);
    return om_report_save(&report, path);
}

OmStatus om__study_report_methods(const StudyMethods* s) {
    OM_TRY(write_json(s));
    OM_TRY(write_errors(s));
    return write_report(s);
}
