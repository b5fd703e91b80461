// study_sheet_report.c: results of the sheet's calibration: report.html for people, study.json for programs.
#include <math.h>

#include "studies/study_sheet_internal.h"
#include "studies/study_table.h"

// ---- report.html ----------------------------------------------------------------------------------

static void add_outcome(const OmStudySheetSummary* sum, OmReport* report) {
    om__report_judge(
        report, sum->is_met,
        "Average error of all clouds %.2f mm: the goal of %g mm is %s. Of those that no search saw %.2f "
        "mm: %s. The thesis reports about %g mm, with nothing held out.",
        1e3 * sum->found, 1e3 * SHEET_GOAL, sum->found <= SHEET_GOAL ? "met" : "missed",
        1e3 * sum->unseen_found, sum->unseen_found <= SHEET_GOAL ? "met" : "missed",
        1e3 * SHEET_THESIS);
    om__report_facts(
        report,
        "thesis's parameters|found|thesis's, unseen pinch|found, unseen pinch|sheet at "
        "rest|evaluations",
        "%.2f mm|%.2f mm|%.2f mm|%.2f mm|%.2f mm|%d", 1e3 * sum->thesis, 1e3 * sum->found,
        1e3 * sum->unseen_thesis, 1e3 * sum->unseen_found, 1e3 * sum->floor, sum->neval);
}

static void add_experiment(const Sheet* s, OmReport* report) {
    const OmStudySheetDef* d = s->def;
    om__report_section(
        report, "The experiment",
        "A sheet of 90 x 90 x 3 mm on a board, fixed on one side, is grasped at five pinch points and "
        "lifted by 10, 20 and 30 mm (thesis 5.4.1). The truth is %d x %d x 1 cells of quadratic finite "
        "elements of 20 kPa; a depth camera with the noise of a D435 sees it. The model is %d particles in "
        "clusters. An error is the mean distance from the points of the model's upper side to the nearest point of the "
        "cloud (5.2); a sheet that nobody lifts, which both have flat on the board, already shows %.2f mm of "
        "it.",
        d->world_cells, d->world_cells, 2 * (d->cells + 1) * (d->cells + 1),
        1e3 * s->thesis_error.rest);
    om_report_paragraph(
        report,
        d->has_all_folds
            ? "Each pinch point in turn is held out: a search sees the clouds of the other four, and its "
              "parameters are judged on the fifth. The first search, without pinch point 1, stands for "
              "the study wherever one set of parameters is shown."
            : "Pinch point 1, the middle of the free side, is held out: the search sees the twelve clouds "
              "of the other four, and its parameters are judged on the three of the first. It was "
              "chosen before anything was run, as the only one without a mirror image among the others.");
}

static void add_params(const Sheet* s, OmReport* report) {
    StudyTable table = om__table(
        "held out|spacing, mm|radius, mm|stiffness|seen, mm|unseen, mm|thesis's on the unseen, "
        "mm|evaluations|how it ended");
    static const char* const outcome[] = {"calibrated", "evaluations used up", "cannot fit"};
    for (int k = 0; k <= s->nfold; ++k) {
        const SheetFold* f = k ? &s->fold[k - 1] : NULL;
        const double* best = f ? f->result.best : s->thesis;
        if (f)
            om__table_row(&table, "pinch %d, %s", f->left_out + 1,
                          om__study_sheet_where[f->left_out]);
        else
            om__table_row(&table, "thesis's optimum");
        int left_out = f ? f->left_out : 0;
        const SheetErrors* e = f ? &f->error : &s->thesis_error;
        om__table_row(&table, "%.3g|%.3g|%.3g|%.2f|%.2f|%.2f|%d|%s", 1e3 * best[0], 1e3 * best[1],
                      best[2], 1e3 * om__study_sheet_mean(e, left_out),
                      1e3 * om__study_sheet_pinch_mean(e, left_out),
                      1e3 * om__study_sheet_pinch_mean(&s->thesis_error, left_out),
                      f ? f->result.neval : 0, f ? outcome[f->result.outcome] : "-");
    }
    om__table_show(
        &table, report, "Parameters",
        "Bounds: 5-35 mm, 2.5-15 mm, 0-1 (thesis 3.5). The thesis prints its optimum without "
        "units (0.127, 0.095, 0.361); it is read as 12.7 mm and 9.5 mm. The row of the thesis's "
        "optimum is split as the first search.");
}

// How well the data determine each parameter of the first search.
static void add_ranges(const Sheet* s, OmReport* report) {
    const SheetFold* f = &s->fold[0];
    if (!f->result.has_profile) return;
    for (int k = 0; k < OM_STUDY_NCLUSTER; ++k) {
        const OmCalibrationProfile* p = &f->result.profile[k];
        const OmCalibrationParam* param = &f->search.param[k];
        om__report_say(
            report,
            "%s: %.3g; the error rises by %.0f %% of itself, or by as much as noise hides, at %.3g%s and "
            "%.3g%s.",
            param->name, f->result.best[k] / param->unit, 100 * f->search.rise, p->lo / param->unit,
            p->is_open_lo ? " (the bound, not even there)" : "", p->hi / param->unit,
            p->is_open_hi ? " (the bound, not even there)" : "");
    }
}

static void add_errors(const Sheet* s, OmReport* report) {
    StudyTable table = om__table("pinch point|where|10 mm|20 mm|30 mm|mean");
    const SheetErrors *found = &s->fold[0].error, *thesis = &s->thesis_error;
    for (int p = 0; p <= OM_STUDY_NPINCH; ++p) {
        bool is_mean = p == OM_STUDY_NPINCH;
        om__table_row(&table, is_mean ? "all" : "pinch %d", p + 1);
        om__table_row(&table, "%s%s", is_mean ? "-" : om__study_sheet_where[p],
                      p == s->fold[0].left_out ? " (unseen)" : "");
        for (int l = 0; l < OM_STUDY_NLIFT; ++l) {
            double a = 0, b = 0;
            for (int q = 0; q < OM_STUDY_NPINCH; ++q) {
                a += found->at[q][l] / OM_STUDY_NPINCH;
                b += thesis->at[q][l] / OM_STUDY_NPINCH;
            }
            om__table_row(&table, "%.2f (%.2f)", 1e3 * (is_mean ? a : found->at[p][l]),
                          1e3 * (is_mean ? b : thesis->at[p][l]));
        }
        om__table_row(&table, "%.2f (%.2f)",
                      1e3 * (is_mean ? om__study_sheet_mean(found, -1)
                                     : om__study_sheet_pinch_mean(found, p)),
                      1e3 * (is_mean ? om__study_sheet_mean(thesis, -1)
                                     : om__study_sheet_pinch_mean(thesis, p)));
    }
    om__table_show(
        &table, report, "Errors",
        "Mean error of a cloud in mm by pinch point and lift: with what the first search "
        "found, and in brackets with the thesis's optimum.");
}

static OmStatus add_convergence(const Sheet* s, OmReport* report) {
    const OmCalibrationResult* r = &s->fold[0].result;
    double *x, min = INFINITY;
    OM_ALLOC(x, 2 * (size_t)r->neval);
    double* best = x + r->neval;
    for (int i = 0; i < r->neval; ++i) {
        min = fmin(min, r->trace[i]);
        x[i] = i + 1;
        best[i] = 1e3 * min;
    }
    OmReportChart chart = {.title = "The first search",
                           .x_label = "evaluations",
                           .y_label = "error of the clouds it sees, mm",
                           .series = {{"best so far", x, best, r->neval, true}},
                           .nseries = 1,
                           .has_limit = true,
                           .limit = 1e3 * SHEET_GOAL,
                           .limit_name = "goal"};
    om_report_chart(report, &chart);
    om_free(x);
    return OM_OK;
}

static void add_cost(const Sheet* s, const OmStudySheetSummary* sum, OmReport* report) {
    char truth[64] = "was there already";
    double seconds = 0;
    for (int k = 0; k < s->nfold; ++k) seconds += s->fold[k].seconds;
    if (s->truth_seconds > 0) snprintf(truth, sizeof truth, "took %.0f s", s->truth_seconds);
    om__report_section(
        report, "What it cost",
        "The truth %s. %d searches made %d evaluations, %d of them now, in %.0f s; one, of all five lifts, "
        "took %.2f s on %d processors. Folders without-N hold the problem, journal and report of each "
        "search; omentum calibrate takes them.",
        truth, s->nfold, sum->neval, sum->nnew, seconds, s->eval_seconds,
        om_worker_count(s->def->nworker));
}

OmStatus om__study_sheet_write_report(const Sheet* s, const OmStudySheetSummary* sum) {
    OmReport report;
    om_report_begin(&report, "A sheet calibrated",
                    "clusters of particles against the clouds of a depth camera");
    add_outcome(sum, &report);
    add_experiment(s, &report);
    OmStatus status = om__study_sheet_add_pictures(s, &report);
    add_errors(s, &report);
    add_params(s, &report);
    add_ranges(s, &report);
    if (status == OM_OK) status = add_convergence(s, &report);
    add_cost(s, sum, &report);
    return om__report_end(&report, s->def->out_dir, status);
}

// ---- study.json -----------------------------------------------------------------------------------

static void put_errors(OmJson* json, const char* key, const SheetErrors* e) {
    om_json_open(json, key, '[');
    for (int p = 0; p < OM_STUDY_NPINCH; ++p) om_json_numbers(json, NULL, e->at[p], OM_STUDY_NLIFT);
    om_json_close(json, ']');
}

static void put_folds(OmJson* json, const Sheet* s) {
    static const char* const outcome[] = {"calibrated", "budget", "unfit"};
    om_json_open(json, "searches", '[');
    for (int k = 0; k < s->nfold; ++k) {
        const SheetFold* f = &s->fold[k];
        om_json_open(json, NULL, '{');
        om__put(json,
                "held_out_pinch %d|outcome %s|cluster_spacing %f|cluster_radius %f|"
                "cluster_stiffness %f|seen %f|unseen %f|unseen_thesis %f|evaluations %d|"
                "new_evaluations %d|seconds_of_this_call %f",
                f->left_out + 1, outcome[f->result.outcome], f->result.best[0], f->result.best[1],
                f->result.best[2], om__study_sheet_mean(&f->error, f->left_out),
                om__study_sheet_pinch_mean(&f->error, f->left_out),
                om__study_sheet_pinch_mean(&s->thesis_error, f->left_out), f->result.neval,
                f->result.nnew, f->seconds);
        put_errors(json, "error_by_pinch_and_lift", &f->error);
        om_json_close(json, '}');
    }
    om_json_close(json, ']');
}

OmStatus om__study_sheet_write_json(const Sheet* s, const OmStudySheetSummary* sum) {
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "cells %d|world_cells %d|seed %lld|workers %d", s->def->cells,
            s->def->world_cells, (long long)s->def->seed, om_worker_count(s->def->nworker));
    om_json_numbers(&json, "lift", om__study_sheet_lift, OM_STUDY_NLIFT);
    om__put(&json,
            "error_unlifted %f|error_thesis %f|error_found %f|unseen_thesis %f|unseen_found %f|"
            "is_met? %d|seconds_of_one_evaluation %f",
            sum->floor, sum->thesis, sum->found, sum->unseen_thesis, sum->unseen_found, sum->is_met,
            s->eval_seconds);
    put_errors(&json, "thesis_by_pinch_and_lift", &s->thesis_error);
    put_folds(&json, s);
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}
