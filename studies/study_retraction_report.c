// study_retraction_report.c: the tables of chapter 6 beside the thesis's: report.html for people, study.json for
// programs.
#include <math.h>

#include "studies/study_retraction_internal.h"
#include "studies/study_stats.h"
#include "studies/study_table.h"

#define MAX_PATH 1024

static const double thesis_replan[OM_RETRACTION_NGRID][OM_RETRACTION_NSHARE] = {
    {0.25, 0.24, 0.23, 0.24}, {0.68, 0.65, 0.63, 0.62}, {1.50, 1.48, 1.41, 1.42},
    {3.06, 2.97, 2.90, 2.88}, {5.88, 5.70, 5.51, 5.51}, {10.75, 10.21, 9.92, 9.87}};

static void add_number(StudyTable* t, const char* format, double value) {
    char text[32] = "-";
    if (!isnan(value)) snprintf(text, sizeof text, format, value);
    om__table_cell(t, text);
}

// ---- scores -----------------------------------------------------------------------------------------------

static void add_score(const char* title, const OmRetractionScore* r, StudyTable* t) {
    const StudyInterval i = om__interval_share(r->nsuccess, r->nrun);
    om__table_row(t, "%s|%d of %d|%.0f to %.0f %%|%d of %d%s", title, r->nsuccess, r->nrun,
                  100 * i.lo, 100 * i.hi, r->nsuccess_possible, r->npossible,
                  r->nunknown ? ", some not searched" : "");
    add_number(t, "%.0f", 100 * r->visibility);
    add_number(t, "%.0f", 100 * r->visibility_mean);
    add_number(t, "%.3g", r->actions);
    add_number(t, "%.3g", r->events);
    add_number(t, "%.2f", r->force);
    add_number(t, "%.2f", r->force_world);
    om__table_row(t, "%d of %d, %d|%d", r->ngood, r->ntrigger, r->ngood_alone, r->nfalse);
}

// The rows that were run, under a heading; nothing if there is none.
static void add_scores(const char* title, const OmRetractionScore* score, const char* thesis,
                       OmReport* report) {
    StudyTable table = om__table(
        "|success|95 % interval|of those possible|visibility, %, median|mean|actions|force events|F_max / epsilon, "
        "twin|truth|updates to 2 mm, by attachments alone|false alarms");
    for (int row = 0; row < OM_RETRACTION_NROW; ++row)
        if (score[row].nrun > 0) add_score(om__retraction_row_title[row], &score[row], &table);
    if (table.ncell == 0) {
        om__table_end(&table, report);
        return;
    }
    om_report_heading(report, title);
    om__table_end(&table, report);
    om_report_paragraph(report, thesis);
}

// ---- cases ------------------------------------------------------------------------------------------------

static void add_ceiling(const RetractionResult* r, StudyTable* t) {
    const OmSearchResult* best = &r->ceiling.best;
    if (!r->has_ceiling)
        om__table_cell(t, "not searched");
    else if (r->ceiling.is_possible)
        om__table_row(t, "from %d actions%s", best->naction,
                      best->first_block >= 0 ? ", both arms" : "");
    else
        om__table_row(t, "none of %d, %.0f %%", best->nsequence, 100 * best->visibility);
}

static void add_run(const RetractionResult* r, int row, StudyTable* t) {
    const RetractionRun* run = &r->run[row];
    om__table_row(t, "%s|%s", r->c.name, om__retraction_row_title[row]);
    add_ceiling(r, t);
    om__table_row(t, "%.0f|%d|%d / %d|%.2f / %.2f", 100 * run->visibility, run->naction,
                  run->nforce, run->nforce_world, run->force / run->epsilon,
                  run->force_world / run->epsilon);
    om__table_row(t, run->ntrigger ? "%d of %d to 2 mm; %d adopted, %d followed" : "none",
                  run->ngood, run->ntrigger, run->nadopted, run->nfollowed);
    om__table_cell(t, run->is_success ? "success" : om_retract_outcome_text(run->outcome));
}

static void add_table(const Retraction* s, RetractionGroup group, OmReport* report) {
    StudyTable table = om__table(
        "case|how|sequences that expose|visibility, %|actions|force events, twin / truth|F_max / "
        "epsilon|updates|result");
    for (int i = 0; i < s->ncase; ++i)
        for (int row = 0; row < OM_RETRACTION_NROW; ++row)
            if (s->result[i].c.group == group && s->result[i].has_run[row])
                add_run(&s->result[i], row, &table);
    om__table_end(&table, report);
}

// A picture, the links to the runs of a case, and the reasons of its failures.
static OmStatus add_case(const RetractionResult* r, OmReport* report) {
    char href[OM_RETRACTION_NROW][MAX_PATH], caption[400], reason[600];
    const char *link[OM_RETRACTION_NROW], *text[OM_RETRACTION_NROW];
    const RetractionRun* shown = NULL;
    int n = 0;
    for (int row = 0; row < OM_RETRACTION_NROW; ++row) {
        if (!r->has_run[row]) continue;
        if (!shown) shown = &r->run[row];
        if (row == OM_RETRACTION_OPEN_LOOP) continue;  // it has no report
        snprintf(href[n], MAX_PATH, "runs/%s-%s/report.html", r->c.name,
                 om__retraction_row_name[row]);
        link[n] = href[n];
        text[n++] = om__retraction_row_title[row];
    }
    if (n == 0) return OM_OK;
    OmPicture picture;
    OM_TRY(om__retraction_draw(&r->c, shown, &picture));
    snprintf(caption, sizeof caption, "%s: %s", r->c.name, shown->reason);
    om_report_picture(report, &picture, caption);
    om_picture_done(&picture);
    snprintf(reason, sizeof reason, "%s: ", r->c.name);
    om_report_links(report, reason, text, link, n);
    for (int row = 0; row < OM_RETRACTION_NROW; ++row) {
        const RetractionRun* run = &r->run[row];
        if (!r->has_run[row] || run->is_success) continue;
        const char* force =
            run->is_exposed ? "; the true force was above 1.2 epsilon, so it is no success" : "";
        snprintf(reason, sizeof reason, "%s failed: %s%s.", om__retraction_row_title[row],
                 run->reason, force);
        om_report_paragraph(report, reason);
    }
    return OM_OK;
}

static OmStatus add_group(const Retraction* s, RetractionGroup group, const char* title,
                          const OmRetractionScore* score, const char* thesis, OmReport* report) {
    bool is_there = false;
    for (int i = 0; i < s->ncase; ++i) is_there = is_there || s->result[i].c.group == group;
    if (!is_there) return OM_OK;
    add_scores(title, score, thesis, report);
    add_table(s, group, report);
    om_report_begin_fold(report, "Every case: attachments from above, and the reports of its runs");
    for (int i = 0; i < s->ncase; ++i)
        if (s->result[i].c.group == group) OM_TRY(add_case(&s->result[i], report));
    om_report_end_fold(report);
    return OM_OK;
}

// ---- Table 6.2 --------------------------------------------------------------------------------------------

static void add_plan(const RetractionCase* c, const OmPreplan* plan, double epsilon,
                     StudyTable* t) {
    om__table_row(t, "%d|%d of %d", c->number, plan->nexposing, plan->ntried);
    if (plan->chosen < 0) {
        om__table_row(t, "-|-|-|-");
        return;
    }
    const OmPreplanPoint* p = &plan->point[plan->chosen];
    om__table_row(t, "(%d,%d)|%.0f|%d|%.2f", p->block % plan->n + 1, p->block / plan->n + 1,
                  100 * p->visibility, p->naction, p->force / epsilon);
}

static OmStatus add_plans(const Retraction* s, OmReport* report) {
    OmPreplan* plan;
    OM_ALLOC(plan, 1);
    StudyTable table =
        om__table("scenario|points that expose|chosen|visibility, %|actions|F_max / epsilon");
    for (int i = 0; i < s->ncase; ++i) {
        const RetractionCase* c = &s->result[i].c;
        if (c->group == RETRACTION_SCENARIO && c->kind == RETRACTION_FEWER &&
            om__retraction_load_preplan(s, c, plan) == OM_OK)
            add_plan(c, plan, s->sum.epsilon, &table);
    }
    om_free(plan);
    const bool is_there = table.ncell > 0;
    if (is_there) om_report_heading(report, "Plans before (Table 6.2)");
    om__table_end(&table, report);
    if (is_there)
        om_report_paragraph(report,
                            "The thesis: visibility 100, 100, 100, 95, 80, 100, 93, 100 %; actions "
                            "4, 6, 6, 5, 5, 5, 5, 5; F_max 1.0 to 2.0 epsilon, median 1.3.");
    return OM_OK;
}

// ---- epsilon and Table 6.4 --------------------------------------------------------------------------------

static void add_threshold(const Retraction* s, OmReport* report) {
    const OmForceCalibration* f = &s->threshold.force;
    if (!s->has_threshold) return;
    om_report_heading(report, "The force threshold (6.5.1)");
    om__report_say(
        report,
        "%d grasps in %d layouts: median of the largest pulls %.3f N (quartiles %.3f and %.3f), so "
        "epsilon is %.2f N; the study uses %.2f N. The truth bears up to %.2f N more (95 %% of the "
        "instants). The thesis has a median of 0.15 N and 0.3 N, of nodal forces on its own mesh.",
        f->nrun, s->threshold.nlayout, f->median, f->lower_quartile, f->upper_quartile,
        f->threshold, s->sum.epsilon, f->margin);
}

static void add_replan(const Retraction* s, OmReport* report) {
    if (!s->has_replan) return;
    StudyTable table = om__table("blocks along a side|10 % attached|30 %|50 %|70 %");
    for (int g = 0; g < OM_RETRACTION_NGRID; ++g) {
        om__table_row(&table, "%d", 5 + g);
        for (int f = 0; f < OM_RETRACTION_NSHARE; ++f)
            om__table_row(&table, "%.1f +- %.1f (%.0f)", 1e3 * s->replan.mean[g][f],
                          1e3 * s->replan.sd[g][f], 1e3 * thesis_replan[g][f]);
    }
    om_report_heading(report, "Re-planning times (Table 6.4)");
    om__table_end(&table, report);
    om__report_say(report,
                   "Processor time of one plan in ms, %d random states a cell; in brackets the "
                   "thesis's mean. Look-ahead is off.",
                   s->replan.nstate);
}

// ---- report.html ------------------------------------------------------------------------------------------

static void add_outcome(const Retraction* s, OmReport* report) {
    const OmRetractionScore* d = &s->sum.scenario[OM_RETRACTION_DEFRAS];
    if (d->nrun == 0) return;
    om__report_judge(
        report, d->nsuccess_possible == d->npossible,
        "DEFRAS: %d of %d scenarios exposed with a true force of at most 1.2 epsilon, %d of the %d that "
        "are possible. The thesis: 13 of 16.",
        d->nsuccess, d->nrun, d->nsuccess_possible, d->npossible);
}

static void add_pairs(const Retraction* s, OmReport* report) {
    const OmRetractionPairs* p = &s->sum.pairs;
    if (p->ndrawn == 0) return;
    om_report_heading(report, "Does a wrong belief matter?");
    om__report_say(
        report,
        "%d pairs were drawn. In %d the plan made with the believed attachments succeeds when it is "
        "carried out without looking: there the belief does no harm. In %d others no sequence of "
        "actions exposes the ROI, and %d are not searched yet. The other %d count: every row below "
        "has these pairs alone, but for the row of the open loop, which has all.",
        p->ndrawn, p->nharmless, p->nimpossible,
        p->ndrawn - p->nharmless - p->nimpossible - p->ncounting, p->ncounting);
}

// What a module is worth: each row against DEFRAS, on the same pairs.
static void add_differences(const Retraction* s, OmReport* report) {
    StudyTable table =
        om__table("against DEFRAS|pairs|DEFRAS alone succeeds|the other alone|success of DEFRAS "
                  "more by|95 % interval|its actions more, median");
    for (int row = OM_RETRACTION_DEFRAS + 1; row < OM_RETRACTION_NROW; ++row) {
        const OmRetractionDifference* d = &s->sum.difference[row];
        if (d->npair == 0) continue;
        const StudyInterval i = om__interval_paired(d->defras_only, d->other_only, d->npair);
        om__table_row(&table, "%s|%d|%d|%d|%+.0f points|%+.0f to %+.0f points",
                      om__retraction_row_title[row], d->npair, d->defras_only, d->other_only,
                      100 * i.value, 100 * i.lo, 100 * i.hi);
        add_number(&table, "%+.3g", d->actions);
    }
    if (table.ncell > 0) om_report_heading(report, "What each module is worth");
    om__table_end(&table, report);
}

static OmStatus add_parts(const Retraction* s, OmReport* report) {
    OM_TRY(add_plans(s, report));
    OM_TRY(add_group(
        s, RETRACTION_SCENARIO, "Scenarios (Table 6.3)", s->sum.scenario,
        "The thesis: DEFRAS 13 of 16, medians of 100 %, 8 actions, 18 force events, 2.0 "
        "epsilon, 32 of 34 updates; FRAS 11 of 16, 93 %, 16 actions, 24 events, 3.0 epsilon.",
        report));
    OM_TRY(add_group(
        s, RETRACTION_LAB, "Laboratory (Table 6.5)", s->sum.laboratory,
        "The thesis: 8 of 9 above 80 %, mean 94 %, 17 of 18 updates; GAIL 90 %, Attanasio et "
        "al. 83 %.",
        report));
    add_pairs(s, report);
    OM_TRY(
        add_group(s, RETRACTION_PAIR, "Random pairs", s->sum.random, "Not in the thesis.", report));
    add_differences(s, report);
    OM_TRY(add_group(s, RETRACTION_ALARM, "False alarms: right attachments, every other error",
                     s->sum.alarm, "Not in the thesis.", report));
    OM_TRY(add_group(s, RETRACTION_KIDNEY, "Kidney", s->sum.kidney, "Not in the thesis.", report));
    add_replan(s, report);
    add_threshold(s, report);
    return OM_OK;
}

OmStatus om__retraction_write_report(const Retraction* s) {
    OmReport report;
    om_report_begin(&report, "Retraction under wrong beliefs", "thesis chapter 6");
    add_outcome(s, &report);
    om_report_paragraph(
        &report,
        "A success exposes 80 % of the ROI by the judge, who counts its points by rays, with a "
        "true force of at most 1.2 epsilon. Possible are the cases that a run exposed, or an exhaustive search of one "
        "arm with the true attachments exposes within this force. Pictures: blue or green where the "
        "tissue is attached, a red line around what is believed, magenta the ROI, a ring around the "
        "first grasp, a dot on the last.");
    const OmStudyDraw* draw = &s->def->draw;
    if (draw->kind == OM_DRAW_JUDGED) {
        om__report_say(
            &report,
            "Random pairs and alarms are draw %d of the sources with the hash %s (commit %s).",
            draw->number, draw->hash, draw->commit);
    }
    OmStatus status = add_parts(s, &report);
    return om__report_end(&report, s->def->out_dir, status);
}

// ---- study.json -------------------------------------------------------------------------------------------

static void put_run_json(OmJson* json, const char* key, const RetractionRun* r) {
    om_json_open(json, key, '{');
    om_json_bool(json, "success", r->is_success);
    om_json_string(json, "outcome", om_retract_outcome_text(r->outcome));
    om_json_string(json, "reason", r->reason);
    om_json_number(json, "visibility_start", r->visibility_start);
    om_json_number(json, "visibility", r->visibility);
    om_json_number(json, "force_n", r->force);
    om_json_number(json, "force_world_n", r->force_world);
    om_json_number(json, "epsilon_n", r->epsilon);
    om_json_integer(json, "force_events", r->nforce);
    om_json_integer(json, "force_events_world", r->nforce_world);
    om_json_integer(json, "actions", r->naction);
    om_json_integer(json, "plans", r->nplan);
    om_json_integer(json, "updates", r->nupdate);
    om_json_integer(json, "updates_adopted", r->nadopted);
    om_json_integer(json, "triggers", r->ntrigger);
    om_json_integer(json, "triggers_good", r->ngood);
    om_json_integer(json, "triggers_good_by_attachments", r->ngood_alone);
    om_json_integer(json, "updates_followed", r->nfollowed);
    om_json_integer(json, "warnings", r->nwarning[0] + r->nwarning[1] + r->nwarning[2]);
    om_json_string(json, "hold", om_hold_text(r->hold));
    om_json_number(json, "visibility_seen", r->visibility_seen);
    om_json_number(json, "mu_max_m", r->mu_max);
    om_json_number(json, "time_s", r->time);
    om_json_number(json, "wall_time_s", r->wall_time);
    om_json_close(json, '}');
}

static void put_case_json(OmJson* json, const RetractionResult* r) {
    const double roi[2] = {r->c.roi.x, r->c.roi.y};
    om_json_open(json, NULL, '{');
    om_json_string(json, "name", r->c.name);
    om_json_integer(json, "seed", r->c.seed);
    om_json_number(json, "share", r->c.share);
    om_json_number(json, "believed", r->c.believed);
    om_json_numbers(json, "roi_m", roi, 2);
    if (r->has_ceiling) {
        om_json_bool(json, "possible", r->ceiling.is_possible);
        om_json_integer(json, "sequences", r->ceiling.best.nsequence);
        om_json_integer(json, "sequences_exposed", r->ceiling.best.nexposed);
        om_json_number(json, "best_visibility", r->ceiling.best.visibility);
        om_json_bool(json, "search_both_arms",
                     r->ceiling.is_possible && r->ceiling.best.first_block >= 0);
        om_json_integer(json, "search_actions", r->ceiling.best.naction);
    }
    om_json_open(json, "runs", '{');
    for (int row = 0; row < OM_RETRACTION_NROW; ++row)
        if (r->has_run[row]) put_run_json(json, om__retraction_row_name[row], &r->run[row]);
    om_json_close(json, '}');
    om_json_close(json, '}');
}

static void put_scores_json(OmJson* json, const char* key, const OmRetractionScore* score) {
    om_json_open(json, key, '{');
    for (int row = 0; row < OM_RETRACTION_NROW; ++row) {
        const OmRetractionScore* r = &score[row];
        if (r->nrun == 0) continue;
        om_json_open(json, om__retraction_row_name[row], '{');
        om_json_integer(json, "runs", r->nrun);
        om_json_integer(json, "possible", r->npossible);
        om_json_integer(json, "success", r->nsuccess);
        om_json_integer(json, "success_possible", r->nsuccess_possible);
        om_json_number(json, "visibility", r->visibility);
        om_json_number(json, "visibility_mean", r->visibility_mean);
        om_json_number(json, "actions", r->actions);
        om_json_number(json, "force_events", r->events);
        om_json_number(json, "force_ratio", r->force);
        om_json_number(json, "force_world_ratio", r->force_world);
        om_json_integer(json, "triggers", r->ntrigger);
        om_json_integer(json, "triggers_good", r->ngood);
        om_json_integer(json, "triggers_good_by_attachments", r->ngood_alone);
        om_json_integer(json, "false_alarms", r->nfalse);
        om_json_close(json, '}');
    }
    om_json_close(json, '}');
}

static void put_difference_json(OmJson* json, const char* key, const OmRetractionDifference* d) {
    if (d->npair == 0) return;
    const StudyInterval i = om__interval_paired(d->defras_only, d->other_only, d->npair);
    const double interval[2] = {i.lo, i.hi};
    om_json_open(json, key, '{');
    om_json_integer(json, "pairs", d->npair);
    om_json_integer(json, "defras_only", d->defras_only);
    om_json_integer(json, "other_only", d->other_only);
    om_json_number(json, "difference", i.value);
    om_json_numbers(json, "interval_95", interval, 2);
    om_json_number(json, "actions_more", d->actions);
    om_json_close(json, '}');
}

OmStatus om__retraction_write_json(const Retraction* s) {
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "version", om_version());
    om_json_number(&json, "epsilon_n", s->sum.epsilon);
    if (s->def->draw.kind == OM_DRAW_JUDGED) {
        om_json_string(&json, "draw_hash", s->def->draw.hash);
        om_json_number(&json, "draw", s->def->draw.number);
    }
    om_json_integer(&json, "pairs_drawn", s->sum.pairs.ndrawn);
    om_json_integer(&json, "pairs_harmless", s->sum.pairs.nharmless);
    om_json_integer(&json, "pairs_impossible", s->sum.pairs.nimpossible);
    om_json_integer(&json, "pairs_counting", s->sum.pairs.ncounting);
    om_json_open(&json, "differences", '{');
    for (int row = OM_RETRACTION_DEFRAS + 1; row < OM_RETRACTION_NROW; ++row)
        put_difference_json(&json, om__retraction_row_name[row], &s->sum.difference[row]);
    om_json_close(&json, '}');
    put_scores_json(&json, "scenarios", s->sum.scenario);
    put_scores_json(&json, "random", s->sum.random);
    put_scores_json(&json, "laboratory", s->sum.laboratory);
    put_scores_json(&json, "kidney", s->sum.kidney);
    put_scores_json(&json, "alarms", s->sum.alarm);
    if (s->has_replan) {
        om_json_open(&json, "replan_ms", '[');
        for (int g = 0; g < OM_RETRACTION_NGRID; ++g) {
            double ms[OM_RETRACTION_NSHARE];
            for (int f = 0; f < OM_RETRACTION_NSHARE; ++f) ms[f] = 1e3 * s->replan.mean[g][f];
            om_json_numbers(&json, NULL, ms, OM_RETRACTION_NSHARE);
        }
        om_json_close(&json, ']');
    }
    if (s->has_threshold) {
        om_json_number(&json, "measured_epsilon_n", s->threshold.force.threshold);
        om_json_number(&json, "measured_margin_n", s->threshold.force.margin);
    }
    om_json_open(&json, "cases", '[');
    for (int i = 0; i < s->ncase; ++i) put_case_json(&json, &s->result[i]);
    om_json_close(&json, ']');
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}
