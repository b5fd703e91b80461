// study_methods_report.c: report.html, study.json and errors.csv of the comparison of methods.
#include <math.h>

#include "studies/study_internal.h"
#include "studies/study_table.h"

#define NDEPTH OM_STUDY_NDEPTH

// ---- numbers for programs -------------------------------------------------------------------------

static OmStatus write_json(const StudyMethods* s) {
    const OmStudyMethodsSummary* sum = &s->sum;
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "weights %s|deformations %d|outside_of_training %d", s->training, sum->ncount,
            sum->noutside);
    for (int by = 0; by < OM_STUDY_NBY; ++by) {
        const OmStudyMethodResult* r = &sum->by[by];
        double mm[NDEPTH];
        for (int k = 0; k < NDEPTH; ++k) mm[k] = 1e3 * r->error[k];
        om_json_open(&json, om__study_method_by_name[by], '{');
        om_json_number(&json, "mean_error_mm", 1e3 * r->mean);
        om_json_numbers(&json, "error_by_depth_mm", mm, NDEPTH);
        om__put(&json, "step_ms %f|stability %f", r->ms, r->stability);
        om_json_close(&json, '}');
    }
    om__put(&json, "worst_gap_mm %f|bar_met? %d", 1e3 * sum->worst_gap, sum->is_met);
    om__study_put_contours(&json, &s->fit.study);
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}

static OmStatus write_errors(const StudyMethods* s) {
    StudyLines t = {0};
    om__lines_add(&t, "method,lesion,depth_mm,error_mm,counts\n");
    for (int by = 0; by < OM_STUDY_NBY; ++by)
        for (int l = 0; l < s->def->nlesion; ++l)
            for (int k = 0; k < NDEPTH; ++k)
                if (s->error[by][l][k] >= 0)
                    om__lines_add(&t, "%s,%d,%g,%.5f,%d\n", om__study_method_by_name[by], l + 1,
                                  1e3 * s->fit.contact.depth[k], 1e3 * s->error[by][l][k],
                                  om__study_methods_count(s, l, k));
    return om__lines_save(&t, s->def->out_dir, "errors.csv");
}

// ---- the report -----------------------------------------------------------------------------------

static void add_outcome(const StudyMethods* s, OmReport* report) {
    const OmStudyMethodsSummary* sum = &s->sum;
    char text[400];
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
    om__report_facts(report, "finite elements, prescribed|particles, calibrated|U-Mesh|rigid",
                     "%.2f mm|%.2f mm|%.2f mm|%.2f mm", 1e3 * sum->by[0].mean,
                     1e3 * sum->by[1].mean, 1e3 * sum->by[2].mean, 1e3 * sum->by[3].mean);
}

// Table 3.5.
static void add_costs(const StudyMethods* s, OmReport* report) {
    StudyTable table = om__table("|a step, ms|stability, %|mean error, mm");
    for (int by = 0; by < OM_STUDY_NBY; ++by) {
        const OmStudyMethodResult* r = &s->sum.by[by];
        om__table_cell(&table, om__study_method_by_title[by]);
        if (by == OM_STUDY_RIGID)
            om__table_cell(&table, NULL);
        else
            om__table_row(&table, "%.2f", r->ms);
        om__table_row(&table, "%.1f|%.2f", 100 * r->stability, 1e3 * r->mean);
    }
    om__table_show(&table, report, "Time and stability (thesis, Table 3.5)", NULL);
}

// Fig. 3.11 and the pairs behind it.
static void add_depths(const StudyMethods* s, OmReport* report) {
    const OmStudyMethodsSummary* sum = &s->sum;
    double mean[OM_STUDY_NBY][NDEPTH];
    for (int by = 0; by < OM_STUDY_NBY; ++by)
        for (int k = 0; k < NDEPTH; ++k)
            mean[by][k] = sum->by[by].ndepth[k] ? 1e3 * sum->by[by].error[k] : (double)NAN;
    om_report_heading(report, "Accuracy");
    om__report_depths(report, "Mean error by deformation (thesis, Fig. 3.11)", OM_STUDY_NBY,
                      om__study_method_by_title, s->fit.contact.depth, mean);
    StudyTable table = om__table(
        "depth, mm|lesions|finite elements, mm|U-Mesh, mm|U-Mesh less finite elements, mm");
    for (int k = 0; k < NDEPTH; ++k) {
        om__table_row(&table, "%.0f|%d", 1e3 * s->fit.contact.depth[k],
                      sum->by[OM_STUDY_FE].ndepth[k]);
        if (sum->by[OM_STUDY_FE].ndepth[k] > 0)
            om__table_row(&table, "%.2f|%.2f|%+.2f", 1e3 * sum->by[OM_STUDY_FE].error[k],
                          1e3 * sum->by[OM_STUDY_UMESH].error[k], 1e3 * sum->gap[k]);
        else
            om__table_row(&table, "||");
    }
    om__table_end(&table, report);
    om_report_paragraph(report,
                        "Means over the lesions for which truth and every method came to this "
                        "depth: the same for all, so differences are paired.");
}

// Table 3.6 of one method.
static void add_lesions(const StudyMethods* s, OmStudyMethod by, OmReport* report) {
    om__report_say(report, "Error by lesion, mm: %s%s", om__study_method_by_title[by],
                   by == OM_STUDY_UMESH ? " (* outside the range of the training, by its own test)"
                                        : "");
    StudyTable table = om__study_depth_table("lesion", s->fit.contact.depth, "");
    for (int l = 0; l < s->def->nlesion; ++l) {
        om__table_row(&table, "%d", l + 1);
        for (int k = 0; k < NDEPTH; ++k)
            om__table_error(&table, s->error[by][l][k],
                            by == OM_STUDY_UMESH && s->is_outside[l][k] ? " *" : "");
    }
    om__table_end(&table, report);
}

// The statements of Table 3.7 with their numbers.
static void add_statements(const StudyMethods* s, OmReport* report) {
    const OmStudyMethodResult* r = s->sum.by;
    StudyTable table = om__table("|finite elements|particles|U-Mesh");
    om__table_row(&table, "time of a step");
    for (int by = 0; by < 3; ++by)
        om__table_row(&table, "%.2f ms, %.0f a second", r[by].ms,
                      r[by].ms > 0 ? 1e3 / r[by].ms : 0);
    om__table_row(&table, "error on the lesions|%.2f mm|%.2f mm|%.2f mm", 1e3 * r[0].mean,
                  1e3 * r[1].mean, 1e3 * r[2].mean);
    om__table_row(&table,
                  "stability|%.0f %% of the paths|%.0f %% of the paths|%.0f %% of the paths",
                  100 * r[0].stability, 100 * r[1].stability, 100 * r[2].stability);
    om__table_row(&table,
                  "parameters|physical: Young's modulus, Poisson's ratio|"
                  "of the clusters, to be calibrated for each body|none: those of the samples");
    om__table_row(&table, "new parameters during the task|at once|"
                          "at once, after a calibration of minutes|new samples and training");
    om__table_row(&table, "where the probe touches|"
                          "known beforehand (prescribed), or found (penalty, multipliers)|found|"
                          "known beforehand; other places are reported");
    om__table_row(&table, "forces|on the probe and at the attachments|none (clusters)|none");
    om__table_show(&table, report, "Properties of the methods (thesis, Table 3.7)", NULL);
}

static void add_assumptions(const StudyMethods* s, OmReport* report) {
    const OmStudyMethodsDef* d = s->def;
    const OmStudyContactDef* c = &s->fit.contact;
    om__report_section(
        report, "Assumptions",
        "Truth: %d quadratic tetrahedra, static, lesions %.1f times as stiff, contact without friction, and the "
        "noise of the tracking (%.2f mm once a lesion, %.2f mm at each depth). Finite elements: %d linear "
        "tetrahedra, %s, %.0f Pa, %.2f. Particles: %d, %.3g mm apart; clusters of %.2f mm, radius %.2f mm, "
        "stiffness %.3f. %s. Prescribed displacement and the network stick to the probe, truth slides.",
        s->fit.study.truth[0].ntet, c->lesion_ratio, 1e3 * c->pointer_noise, 1e3 * c->probe_noise,
        om__study_run_at(&s->fit.study, 0, OM_PRESS_PRESCRIBED, 0)->ntet,
        om_law_name(c->material.law), c->material.young, c->material.poisson,
        s->fit.particles.nvert, 1e3 * d->spacing, 1e3 * d->cluster[0], 1e3 * d->cluster[1],
        d->cluster[2], s->training);
    om_report_paragraph(
        report,
        "The compared point is the point of a lesion's contour that faces the probe. For particles it is the particle "
        "nearest to it, minus their distance at rest; in a mesh it is the point itself. The time of a step is "
        "the median over the probe's path for finite elements and the network, and for "
        "particles the mean, with as many parallel paths as there are workers.");
}

static OmStatus write_report(const StudyMethods* s) {
    char subtitle[96];
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
    return om__report_end(&report, s->def->out_dir, OM_OK);
}

OmStatus om__study_report_methods(const StudyMethods* s) {
    OM_TRY(write_json(s));
    OM_TRY(write_errors(s));
    return write_report(s);
}
