// study_calibration_report.c: report.html, study.json and errors.csv of the calibration study.
#include <math.h>

#include "studies/study_internal.h"

#define NDEPTH OM_STUDY_NDEPTH
#define WORD 32
#define MAX_ROW (OM_STUDY_MAX_LESION + 2)

static OmStatus path_of(const StudyCalibration* s, const char* name, char* out, size_t size) {
    return om_path_join(s->def->out_dir, name, out, size);
}

// ---- numbers for programs -------------------------------------------------------------------------

static void put_search(OmJson* json, const char* key, const OmCalibrationResult* r) {
    static const char* const outcome[] = {"calibrated", "budget", "unfit"};
    om_json_open(json, key, '{');
    om_json_number(json, "cluster_spacing_mm", 1e3 * r->best[0]);
    om_json_number(json, "cluster_radius_mm", 1e3 * r->best[1]);
    om_json_number(json, "cluster_stiffness", r->best[2]);
    om_json_number(json, "error_start_mm", 1e3 * r->cost_start);
    om_json_number(json, "error_mm", 1e3 * r->cost);
    om_json_integer(json, "evaluations", r->neval);
    om_json_string(json, "outcome", outcome[r->outcome]);
    om_json_close(json, '}');
}

static OmStatus write_json(const StudyCalibration* s) {
    const OmStudyCalibrationSummary* sum = &s->sum;
    const double unseen[NBY] = {sum->unseen_gel, sum->unseen_tuned, sum->unseen_prescribed,
                                sum->unseen_penalty, sum->unseen_rigid};
    char path[1024];
    OmText text = {0};
    OM_TRY(path_of(s, "study.json", path, sizeof path));
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_integer(&json, "particles_gel", s->gel.particles.nvert);
    om_json_integer(&json, "particles_breast", s->breast.particles.nvert);
    om_json_number(&json, "particle_spacing_mm", 1e3 * s->def->spacing);
    om_json_number(&json, "speed", s->def->speed);
    om_json_number(&json, "time_step", s->def->time_step);
    om_json_integer(&json, "truth_elements", s->breast.study.truth[0].ntet);
    om_json_integer(&json, "fe_elements", om__study_run_at(&s->breast.study, 0, 0, 0)->ntet);
    om_json_integer(&json, "acquisitions", s->def->nacquisition);
    om_json_integer(&json, "seed", (int64_t)s->def->seed);
    put_search(&json, "gel", &s->gel.result);
    put_search(&json, "breast", &s->breast.result);
    om_json_integer(&json, "tuned_on_lesion", s->def->tuned + 1);
    om_json_open(&json, "unseen_error_mm", '{');
    om_json_integer(&json, "n", sum->nunseen);
    for (int by = 0; by < NBY; ++by) om_json_number(&json, om__study_by_name[by], 1e3 * unseen[by]);
    om_json_close(&json, '}');
    om_json_bool(&json, "bar_met", sum->is_met);
    om__study_put_contours(&json, &s->breast.study);
    om_json_close(&json, '}');
    return om_json_save(&json, path);
}

static OmStatus write_errors(const StudyCalibration* s) {
    char path[1024];
    OmText t = {0};
    OM_TRY(path_of(s, "errors.csv", path, sizeof path));
    OmStatus status = om_text_append(&t, "by,lesion,depth_mm,error_mm,is_tuned_on,counts\n");
    for (int by = 0; by < NBY; ++by)
        for (int l = 0; l < s->def->nlesion; ++l)
            for (int k = 0; k < NDEPTH && status == OM_OK; ++k)
                if (s->error[by][l][k] >= 0)
                    status =
                        om_text_append(&t, "%s,%d,%g,%.5f,%d,%d\n", om__study_by_name[by], l + 1,
                                       1e3 * s->breast.contact.depth[k], 1e3 * s->error[by][l][k],
                                       l == s->def->tuned, om__study_counts(s, l, k));
    if (status == OM_OK) status = om_file_write(path, t.str, t.len);
    om_text_done(&t);
    return status;
}

// ---- the report -----------------------------------------------------------------------------------

static void add_outcome(const StudyCalibration* s, OmReport* report) {
    const OmStudyCalibrationSummary* sum = &s->sum;
    char text[640], fact[5][WORD];
    double ratio = sum->unseen_prescribed > 0 ? sum->unseen_tuned / sum->unseen_prescribed : 0;
    snprintf(
        text, sizeof text,
        "Criterion %s: on lesions without tuning the error of the particle model is %.2f times that of "
        "finite elements (%.2f and %.2f mm; 1.5 times is allowed), and fine-tuning reduced the error of its own "
        "lesion from %.2f to %.2f mm.",
        sum->is_met ? "met" : "missed", ratio, 1e3 * sum->unseen_tuned,
        1e3 * sum->unseen_prescribed, 1e3 * sum->tuned_start, 1e3 * sum->tuned_error);
    om_report_verdict(report, text, sum->is_met);
    snprintf(fact[0], WORD, "%.2f mm", 1e3 * sum->unseen_tuned);
    snprintf(fact[1], WORD, "%.2f mm", 1e3 * sum->unseen_prescribed);
    snprintf(fact[2], WORD, "%.2f mm", 1e3 * sum->unseen_rigid);
    snprintf(fact[3], WORD, "%d", sum->neval);
    snprintf(fact[4], WORD, "%.0f s", sum->seconds);
    const char* value[] = {fact[0], fact[1], fact[2], fact[3], fact[4]};
    const char* label[] = {"particles, fine-tuned, unseen lesions",
                           "finite elements (prescribed), the same", "rigid model, the same",
                           "evaluations, both searches", "both searches, in this run"};
    om_report_facts(report, value, label, sum->nnew ? 5 : 4);
}

// Table 3.2, with the thesis's rows.
static void add_parameters(const StudyCalibration* s, OmReport* report) {
    static const char* const heading[] = {"",           "spacing, mm",      "radius, mm",
                                          "stiffness",  "error before, mm", "error at the best, mm",
                                          "evaluations"};
    static const char* const thesis[2][7] = {
        {"gel, thesis", "9.60", "9.17", "0.452", NULL, NULL, NULL},
        {"breast, thesis", "11.16", "8.54", "0.465", "6.64", "5.07", NULL}};
    const OmCalibrationResult* r[] = {&s->gel.result, &s->breast.result};
    char text[2][7][WORD];
    const char* cell[4][7];
    for (int i = 0; i < 2; ++i) {
        snprintf(text[i][0], WORD, i ? "breast, lesion %d" : "gel, three beads", s->def->tuned + 1);
        snprintf(text[i][1], WORD, "%.2f", 1e3 * r[i]->best[0]);
        snprintf(text[i][2], WORD, "%.2f", 1e3 * r[i]->best[1]);
        snprintf(text[i][3], WORD, "%.3f", r[i]->best[2]);
        snprintf(text[i][4], WORD, "%.2f", 1e3 * r[i]->cost_start);
        snprintf(text[i][5], WORD, "%.2f", 1e3 * r[i]->cost);
        snprintf(text[i][6], WORD, "%d", r[i]->neval);
        for (int c = 0; c < 7; ++c) cell[2 * i][c] = text[i][c], cell[2 * i + 1][c] = thesis[i][c];
    }
    om_report_heading(report, "Parameters (thesis, Table 3.2)");
    om_report_table(report, heading, 7, cell[0], 4);
    om_report_paragraph(
        report,
        "The gel's search is global (differential evolution, then a direct search) within 5-35 mm, "
        "2.5-15 mm and 0-1, and begins at the thesis's parameters of the gel; fine-tuning is the direct "
        "search alone, from the gel's best, within 40 % of the range. Errors are means of (3.15). "
        "Parameters belong to the particles they were found with: the thesis's are those of another program.");
}

// How well each lesion determines the parameters.
static void add_sensitivity(const StudyCalibration* s, OmReport* report) {
    static const char* const heading[] = {"fine-tuned", "best", "between",
                                          "determined by one lesion"};
    static const char* const name[] = {"spacing, mm", "radius, mm", "stiffness"};
    const OmCalibrationResult* r = &s->breast.result;
    char text[OM_STUDY_NCLUSTER][2][WORD];
    const char* cell[OM_STUDY_NCLUSTER][4];
    if (!r->has_profile) return;
    for (int i = 0; i < OM_STUDY_NCLUSTER; ++i) {
        const OmCalibrationProfile* p = &r->profile[i];
        double unit = i < 2 ? 1e3 : 1;
        snprintf(text[i][0], WORD, "%.3g", unit * r->best[i]);
        snprintf(text[i][1], WORD, "%.3g and %.3g", unit * p->lo, unit * p->hi);
        cell[i][0] = name[i];
        cell[i][1] = text[i][0];
        cell[i][2] = text[i][1];
        cell[i][3] = p->is_determined ? "yes" : p->partner >= 0 ? "with another only" : "no";
    }
    om_report_table(report, heading, 4, cell[0], OM_STUDY_NCLUSTER);
    om_report_paragraph(
        report, "Between these values the lesion's error rises by less than 10 %, the other "
                "two parameters at their best.");
}

static void add_beads(const StudyCalibration* s, OmReport* report) {
    static const char* const heading[] = {"mm", "D5", "D10", "D15", "D20", "rigid at the last"};
    char text[3][6][WORD];
    const char* cell[3][6] = {{0}};
    const double* e = s->gel.result.error;
    for (int b = 0; b < 3; ++b) {
        const StudyTruthResult* t = &s->gel.study.truth[b];
        const OmStudyLesion* l = &s->gel.body->lesion[b];
        OmVec3 c = om__study_contour(l);
        snprintf(text[b][0], WORD, "bead at %.0f mm", 1e3 * c.z);
        cell[b][0] = text[b][0];
        for (int k = 0; k < t->ndepth && k < 4; ++k) {
            double sum = 0;
            for (int a = 0; a < s->def->nacquisition; ++a) sum += *e++;
            snprintf(text[b][1 + k], WORD, "%.2f", 1e3 * sum / s->def->nacquisition);
            cell[b][1 + k] = text[b][1 + k];
        }
        int last = t->ndepth - 1;
        OmVec3 rigid = om_madd(c, -t->at[last].depth, l->normal);
        snprintf(text[b][5], WORD, "%.2f", 1e3 * om_distance(rigid, t->at[last].contour));
        cell[b][5] = text[b][5];
    }
    om_report_heading(report, "On the gel");
    om_report_table(report, heading, 6, cell[0], 3);
    om_report_paragraph(report,
                        "Error at the best parameters by bead and indentation, mean of the "
                        "acquisitions. An empty cell: the truth found no equilibrium there.");
}

// Table 3.6 of one method; the status is kept in the report.
static void add_lesions(const StudyCalibration* s, StudyBy by, OmReport* report) {
    const char* heading[NDEPTH + 2] = {"lesion"};
    char name[NDEPTH][WORD], text[MAX_ROW][NDEPTH + 2][WORD], title[96];
    const char* cell[MAX_ROW][NDEPTH + 2] = {{0}};
    for (int k = 0; k < NDEPTH; ++k) {
        snprintf(name[k], WORD, "D%.0f", 1e3 * s->breast.contact.depth[k]);
        heading[1 + k] = name[k];
    }
    heading[NDEPTH + 1] = "mean";
    for (int l = 0; l < s->def->nlesion; ++l) {
        double sum = 0;
        int n = 0;
        snprintf(text[l][0], WORD, l == s->def->tuned ? "%d (tuned on)" : "%d", l + 1);
        cell[l][0] = text[l][0];
        for (int k = 0; k < NDEPTH; ++k) {
            if (s->error[by][l][k] < 0) continue;
            snprintf(text[l][1 + k], WORD, "%.2f", 1e3 * s->error[by][l][k]);
            cell[l][1 + k] = text[l][1 + k];
            sum += s->error[by][l][k];
            ++n;
        }
        if (!n) continue;
        snprintf(text[l][NDEPTH + 1], WORD, "%.2f", 1e3 * sum / n);
        cell[l][NDEPTH + 1] = text[l][NDEPTH + 1];
    }
    snprintf(title, sizeof title, "Error by lesion, mm: %s", om__study_by_title[by]);
    om_report_paragraph(report, title);
    om_report_table(report, heading, NDEPTH + 2, cell[0], s->def->nlesion);
}

// Means over the unseen lesions by depth.
static void add_depths(const StudyCalibration* s, OmReport* report) {
    double depth[NDEPTH], mean[NBY][NDEPTH];
    OmReportChart chart = {.title = "Mean error on unseen lesions (thesis, Fig. 3.11)",
                           .x_label = "probe displacement, mm",
                           .y_label = "mm",
                           .nseries = NBY,
                           .has_range = true};
    for (int by = 0; by < NBY; ++by) {
        for (int k = 0; k < NDEPTH; ++k) {
            double sum = 0;
            int n = 0;
            for (int l = 0; l < s->def->nlesion; ++l) {
                if (l == s->def->tuned || s->error[by][l][k] < 0) continue;
                sum += s->error[by][l][k];
                ++n;
            }
            depth[k] = 1e3 * s->breast.contact.depth[k];
            mean[by][k] = n ? 1e3 * sum / n : (double)NAN;
        }
        chart.series[by] = (OmReportSeries){om__study_by_title[by], depth, mean[by], NDEPTH, false};
    }
    om_report_heading(report, "On the breast");
    om_report_chart(report, &chart);
}

static void add_unseen(const StudyCalibration* s, OmReport* report) {
    static const char* const heading[] = {"unseen lesions, 15 to 30 mm", "mean error, mm",
                                          "over finite elements (prescribed)"};
    const OmStudyCalibrationSummary* sum = &s->sum;
    const double unseen[NBY] = {sum->unseen_gel, sum->unseen_tuned, sum->unseen_prescribed,
                                sum->unseen_penalty, sum->unseen_rigid};
    char text[NBY][2][WORD];
    const char* cell[NBY][3];
    for (int by = 0; by < NBY; ++by) {
        snprintf(text[by][0], WORD, "%.2f", 1e3 * unseen[by]);
        snprintf(text[by][1], WORD, "%.2f", unseen[by] / fmax(1e-12, sum->unseen_prescribed));
        cell[by][0] = om__study_by_title[by];
        cell[by][1] = text[by][0];
        cell[by][2] = text[by][1];
    }
    om_report_table(report, heading, 3, cell[0], NBY);
    char line[320];
    snprintf(
        line, sizeof line,
        "Means over the same %d deformations, those that truth and all methods completed. The thesis's "
        "finite elements are the prescribed ones (Table 3.6: 4.9, 5.8 and 6.5 mm at 20, 25 and 30 mm; its "
        "particles 4.9, 6.3 and 6.9).",
        sum->nunseen);
    om_report_paragraph(report, line);
}

static void add_assumptions(const StudyCalibration* s, OmReport* report) {
    const OmStudyCalibrationDef* d = s->def;
    const OmStudyContactDef* c = &s->breast.contact;
    char text[1200];
    om_report_heading(report, "Assumptions");
    snprintf(
        text, sizeof text,
        "Truth, on both bodies: %d and %d quadratic tetrahedra, static, lesions and beads %.1f times as "
        "stiff, contact without friction, and the noise of the tracking (%.2f mm once per acquisition, %.2f mm "
        "at each depth), never particles. The %d acquisitions of a bead have the same truth and differ in their noise.",
        s->gel.study.truth[0].ntet, s->breast.study.truth[0].ntet, c->lesion_ratio,
        1e3 * c->pointer_noise, 1e3 * c->probe_noise, d->nacquisition);
    om_report_paragraph(report, text);
    snprintf(
        text, sizeof text,
        "Particles: %d in the gel, %d in the breast, %.3g mm apart, 3 substeps of 9 iterations, and what "
        "else Table 3.1 fixes, but no gravity (3.3.2); the probe goes at %.3g mm/s in steps of %.0f ms and waits "
        "%.2g s at each depth. The particle nearest to the contour point that faces the probe is followed. Its "
        "distance to that point at rest is subtracted; the thesis compares positions. Finite elements "
        "are compared at the contour point itself.",
        s->gel.particles.nvert, s->breast.particles.nvert, 1e3 * d->spacing, 1e3 * d->speed,
        1e3 * d->time_step, d->settle);
    om_report_paragraph(report, text);
    om_report_paragraph(
        report,
        "The gel's beads: heights of 47, 53 and 63 mm are taken as heights of their tops, since one of "
        "18 mm centred at 63 mm would stick out of the box. gel/ and breast/ hold the truth, the runs "
        "and a report of each search.");
}

static OmStatus write_report(const StudyCalibration* s) {
    char path[1024], subtitle[96];
    OM_TRY(path_of(s, "report.html", path, sizeof path));
    snprintf(subtitle, sizeof subtitle, "three beads in gel, %d lesions of a breast phantom",
             s->def->nlesion);
    OmReport report;
    om_report_begin(&report, "Particles calibrated on gel, fine-tuned on a breast", subtitle);
    add_outcome(s, &report);
    add_parameters(s, &report);
    add_sensitivity(s, &report);
    add_beads(s, &report);
    add_depths(s, &report);
    add_unseen(s, &report);
    add_lesions(s, BY_TUNED, &report);
    add_lesions(s, BY_PRESCRIBED, &report);
    add_assumptions(s, &report);
    return om_report_save(&report, path);
}

OmStatus om__study_report_calibration(const StudyCalibration* s) {
    OM_TRY(write_json(s));
    OM_TRY(write_errors(s));
    return write_report(s);
}
