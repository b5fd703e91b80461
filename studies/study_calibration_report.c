// study_calibration_report.c: report.html, study.json and errors.csv of the calibration study.
#include <math.h>

#include "studies/study_internal.h"
#include "studies/study_table.h"

#define NDEPTH OM_STUDY_NDEPTH

// ---- numbers for programs -------------------------------------------------------------------------

static void put_search(OmJson* json, const char* key, const OmCalibrationResult* r) {
    static const char* const outcome[] = {"calibrated", "budget", "unfit"};
    om__put_object(
        json, key,
        "cluster_spacing_mm %f|cluster_radius_mm %f|cluster_stiffness %f|error_start_mm %f|"
        "error_mm %f|evaluations %d|outcome %s",
        1e3 * r->best[0], 1e3 * r->best[1], r->best[2], 1e3 * r->cost_start, 1e3 * r->cost,
        r->neval, outcome[r->outcome]);
}

static OmStatus write_json(const StudyCalibration* s) {
    const OmStudyCalibrationSummary* sum = &s->sum;
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json,
            "particles_gel %d|particles_breast %d|particle_spacing_mm %f|speed %f|time_step %f|"
            "truth_elements %d|fe_elements %d|acquisitions %d|seed %lld",
            s->gel.particles.nvert, s->breast.particles.nvert, 1e3 * s->def->spacing, s->def->speed,
            s->def->time_step, s->breast.study.truth[0].ntet,
            om__study_run_at(&s->breast.study, 0, 0, 0)->ntet, s->def->nacquisition,
            (long long)s->def->seed);
    put_search(&json, "gel", &s->gel.result);
    put_search(&json, "breast", &s->breast.result);
    om_json_integer(&json, "tuned_on_lesion", s->def->tuned + 1);
    om_json_open(&json, "unseen_error_mm", '{');
    om_json_integer(&json, "n", sum->nunseen);
    for (int by = 0; by < OM_STUDY_NFIT; ++by)
        om_json_number(&json, om__study_by_name[by], 1e3 * sum->unseen[by]);
    om_json_close(&json, '}');
    om_json_bool(&json, "bar_met", sum->is_met);
    om__study_put_contours(&json, &s->breast.study);
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}

static OmStatus write_errors(const StudyCalibration* s) {
    StudyLines t = {0};
    om__lines_add(&t, "by,lesion,depth_mm,error_mm,is_tuned_on,counts\n");
    for (int by = 0; by < OM_STUDY_NFIT; ++by)
        for (int l = 0; l < s->def->nlesion; ++l)
            for (int k = 0; k < NDEPTH; ++k)
                if (s->error[by][l][k] >= 0)
                    om__lines_add(&t, "%s,%d,%g,%.5f,%d,%d\n", om__study_by_name[by], l + 1,
                                  1e3 * s->breast.contact.depth[k], 1e3 * s->error[by][l][k],
                                  l == s->def->tuned, om__study_counts(s, l, k));
    return om__lines_save(&t, s->def->out_dir, "errors.csv");
}

// ---- the report -----------------------------------------------------------------------------------

static void add_outcome(const StudyCalibration* s, OmReport* report) {
    const OmStudyCalibrationSummary* sum = &s->sum;
    double ratio = sum->unseen[OM_FIT_PRESCRIBED] > 0
                       ? sum->unseen[OM_FIT_TUNED] / sum->unseen[OM_FIT_PRESCRIBED]
                       : 0;
    om__report_judge(
        report, sum->is_met,
        "Criterion %s: on lesions without tuning the error of the particle model is %.2f times that of "
        "finite elements (%.2f and %.2f mm; 1.5 times is allowed), and fine-tuning reduced the error of its own "
        "lesion from %.2f to %.2f mm.",
        sum->is_met ? "met" : "missed", ratio, 1e3 * sum->unseen[OM_FIT_TUNED],
        1e3 * sum->unseen[OM_FIT_PRESCRIBED], 1e3 * sum->tuned_start, 1e3 * sum->tuned_error);
    om__report_facts(
        report,
        sum->nnew
            ? "particles, fine-tuned, unseen lesions|finite elements (prescribed), the "
              "same|rigid model, the same|evaluations, both searches|both searches, in this run"
            : "particles, fine-tuned, unseen lesions|finite elements (prescribed), the "
              "same|rigid model, the same|evaluations, both searches",
        "%.2f mm|%.2f mm|%.2f mm|%d|%.0f s", 1e3 * sum->unseen[OM_FIT_TUNED],
        1e3 * sum->unseen[OM_FIT_PRESCRIBED], 1e3 * sum->unseen[OM_FIT_RIGID], sum->neval,
        sum->seconds);
}

// Table 3.2, with the thesis's rows.
static void add_parameters(const StudyCalibration* s, OmReport* report) {
    static const char* const thesis[2] = {"gel, thesis|9.60|9.17|0.452|||",
                                          "breast, thesis|11.16|8.54|0.465|6.64|5.07|"};
    const OmCalibrationResult* r[] = {&s->gel.result, &s->breast.result};
    StudyTable table = om__table(
        "|spacing, mm|radius, mm|stiffness|error before, mm|error at the best, mm|evaluations");
    for (int i = 0; i < 2; ++i) {
        om__table_row(&table, i ? "breast, lesion %d" : "gel, three beads", s->def->tuned + 1);
        om__table_row(&table, "%.2f|%.2f|%.3f|%.2f|%.2f|%d|%s", 1e3 * r[i]->best[0],
                      1e3 * r[i]->best[1], r[i]->best[2], 1e3 * r[i]->cost_start, 1e3 * r[i]->cost,
                      r[i]->neval, thesis[i]);
    }
    om__table_show(
        &table, report, "Parameters (thesis, Table 3.2)",
        "The gel's search is global (differential evolution, then a direct search) within 5-35 mm, "
        "2.5-15 mm and 0-1, and begins at the thesis's parameters of the gel; fine-tuning is the direct "
        "search alone, from the gel's best, within 40 % of the range. Errors are means of (3.15). "
        "Parameters belong to the particles they were found with: the thesis's are those of another program.");
}

// How well each lesion determines the parameters.
static void add_sensitivity(const StudyCalibration* s, OmReport* report) {
    static const char* const name[] = {"spacing, mm", "radius, mm", "stiffness"};
    const OmCalibrationResult* r = &s->breast.result;
    if (!r->has_profile) return;
    StudyTable table = om__table("fine-tuned|best|between|determined by one lesion");
    for (int i = 0; i < OM_STUDY_NCLUSTER; ++i) {
        const OmCalibrationProfile* p = &r->profile[i];
        double unit = i < 2 ? 1e3 : 1;
        om__table_row(&table, "%s|%.3g|%.3g and %.3g|%s", name[i], unit * r->best[i], unit * p->lo,
                      unit * p->hi,
                      p->is_determined  ? "yes"
                      : p->partner >= 0 ? "with another only"
                                        : "no");
    }
    om__table_end(&table, report);
    om_report_paragraph(
        report, "Between these values the lesion's error rises by less than 10 %, the other "
                "two parameters at their best.");
}

static void add_beads(const StudyCalibration* s, OmReport* report) {
    StudyTable table = om__table("mm|D5|D10|D15|D20|rigid at the last");
    const double* e = s->gel.result.error;
    for (int b = 0; b < 3; ++b) {
        const StudyTruthResult* t = &s->gel.study.truth[b];
        const OmStudyLesion* l = &s->gel.body->lesion[b];
        OmVec3 c = om__study_contour(l);
        om__table_row(&table, "bead at %.0f mm", 1e3 * c.z);
        for (int k = 0; k < 4; ++k) {
            double sum = 0;
            for (int a = 0; k < t->ndepth && a < s->def->nacquisition; ++a) sum += *e++;
            if (k < t->ndepth)
                om__table_row(&table, "%.2f", 1e3 * sum / s->def->nacquisition);
            else
                om__table_cell(&table, NULL);
        }
        int last = t->ndepth - 1;
        OmVec3 rigid = om_madd(c, -t->at[last].depth, l->normal);
        om__table_row(&table, "%.2f", 1e3 * om_distance(rigid, t->at[last].contour));
    }
    om__table_show(&table, report, "On the gel",
                   "Error at the best parameters by bead and indentation, mean of the "
                   "acquisitions. An empty cell: the truth found no equilibrium there.");
}

// Table 3.6 of one method.
static void add_lesions(const StudyCalibration* s, OmStudyFit by, OmReport* report) {
    om__report_say(report, "Error by lesion, mm: %s", om__study_by_title[by]);
    StudyTable table = om__study_depth_table("lesion", s->breast.contact.depth, "|mean");
    for (int l = 0; l < s->def->nlesion; ++l) {
        double sum = 0;
        int n = 0;
        om__table_row(&table, l == s->def->tuned ? "%d (tuned on)" : "%d", l + 1);
        for (int k = 0; k < NDEPTH; ++k) {
            om__table_error(&table, s->error[by][l][k], "");
            if (s->error[by][l][k] < 0) continue;
            sum += s->error[by][l][k];
            ++n;
        }
        om__table_error(&table, n ? sum / n : -1, "");
    }
    om__table_end(&table, report);
}

// Means over the unseen lesions by depth.
static void add_depths(const StudyCalibration* s, OmReport* report) {
    double mean[OM_STUDY_NFIT][NDEPTH];
    for (int by = 0; by < OM_STUDY_NFIT; ++by) {
        for (int k = 0; k < NDEPTH; ++k) {
            double sum = 0;
            int n = 0;
            for (int l = 0; l < s->def->nlesion; ++l) {
                if (l == s->def->tuned || s->error[by][l][k] < 0) continue;
                sum += s->error[by][l][k];
                ++n;
            }
            mean[by][k] = n ? 1e3 * sum / n : (double)NAN;
        }
    }
    om_report_heading(report, "On the breast");
    om__report_depths(report, "Mean error on unseen lesions (thesis, Fig. 3.11)", OM_STUDY_NFIT,
                      om__study_by_title, s->breast.contact.depth, mean);
}

static void add_unseen(const StudyCalibration* s, OmReport* report) {
    StudyTable table =
        om__table("unseen lesions, 15 to 30 mm|mean error, mm|over finite elements (prescribed)");
    const OmStudyCalibrationSummary* sum = &s->sum;
    for (int by = 0; by < OM_STUDY_NFIT; ++by)
        om__table_row(&table, "%s|%.2f|%.2f", om__study_by_title[by], 1e3 * sum->unseen[by],
                      sum->unseen[by] / fmax(1e-12, sum->unseen[OM_FIT_PRESCRIBED]));
    om__table_end(&table, report);
    om__report_say(
        report,
        "Means over the same %d deformations, those that truth and all methods completed. The thesis's "
        "finite elements are the prescribed ones (Table 3.6: 4.9, 5.8 and 6.5 mm at 20, 25 and 30 mm; its "
        "particles 4.9, 6.3 and 6.9).",
        sum->nunseen);
}

static void add_assumptions(const StudyCalibration* s, OmReport* report) {
    const OmStudyCalibrationDef* d = s->def;
    const OmStudyContactDef* c = &s->breast.contact;
    om__report_section(
        report, "Assumptions",
        "Truth, on both bodies: %d and %d quadratic tetrahedra, static, lesions and beads %.1f times as "
        "stiff, contact without friction, and the noise of the tracking (%.2f mm once per acquisition, %.2f mm "
        "at each depth), never particles. The %d acquisitions of a bead have the same truth and differ in their noise.",
        s->gel.study.truth[0].ntet, s->breast.study.truth[0].ntet, c->lesion_ratio,
        1e3 * c->pointer_noise, 1e3 * c->probe_noise, d->nacquisition);
    om__report_say(
        report,
        "Particles: %d in the gel, %d in the breast, %.3g mm apart, 3 substeps of 9 iterations, and what "
        "else Table 3.1 fixes, but no gravity (3.3.2); the probe goes at %.3g mm/s in steps of %.0f ms and waits "
        "%.2g s at each depth. The particle nearest to the contour point that faces the probe is followed. Its "
        "distance to that point at rest is subtracted; the thesis compares positions. Finite elements "
        "are compared at the contour point itself.",
        s->gel.particles.nvert, s->breast.particles.nvert, 1e3 * d->spacing, 1e3 * d->speed,
        1e3 * d->time_step, d->settle);
    om_report_paragraph(
        report,
        "The gel's beads: heights of 47, 53 and 63 mm are taken as heights of their tops, since one of "
        "18 mm centred at 63 mm would stick out of the box. gel/ and breast/ hold the truth, the runs "
        "and a report of each search.");
}

static OmStatus write_report(const StudyCalibration* s) {
    char subtitle[96];
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
    add_lesions(s, OM_FIT_TUNED, &report);
    add_lesions(s, OM_FIT_PRESCRIBED, &report);
    add_assumptions(s, &report);
    return om__report_end(&report, s->def->out_dir, OM_OK);
}

OmStatus om__study_report_calibration(const StudyCalibration* s) {
    OM_TRY(write_json(s));
    OM_TRY(write_errors(s));
    return write_report(s);
}
