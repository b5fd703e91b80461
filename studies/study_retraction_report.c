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
    add_number(t, "%+.3g", r->more_actions);
    add_number(t, "%.3g", r->events);
    add_number(t, "%.2f", r->force);
    add_number(t, "%.2f", r->force_world);
    om__table_row(t, "%d|%d, %d|%d of %d|%d", r->nforce, r->nheld, r->nheld_alone, r->ngood,
                  r->ntrigger, r->nfalse);
}

// The rows that were run, under a heading; nothing if there is none.
static void add_scores(const char* title, const OmRetractionScore* score, const char* thesis,
                       OmReport* report) {
    StudyTable table = om__table(
        "|success|95 % interval|of those possible|visibility, %, median|mean|actions|above the search's|force "
        "events|F_max / epsilon, twin|truth|above 1.2|held for a person, where the search exposes|updates to 2 "
        "mm|false alarms");
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
    om__table_row(t, run->ntrigger ? "%d of %d to 2 mm; %d adopted" : "none", run->ngood,
                  run->ntrigger, run->nadopted);
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
    om__report_section(
        report, "The force threshold (6.5.1)",
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
    om__table_show(&table, report, "Re-planning times (Table 6.4)", NULL);
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
    om__report_section(
        report, "Does a wrong belief matter?",
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
    om__put_object(
        json, key,
        "success? %d|outcome %s|reason %s|visibility_start %f|visibility %f|force_n %f|"
        "force_world_n %f|epsilon_n %f|force_events %d|force_events_world %d|actions %d|plans %d|"
        "updates %d|updates_adopted %d|triggers %d|triggers_good %d|"
        "warnings %d|hold %s|"
        "visibility_seen %f|mu_max_m %f|time_s %f|wall_time_s %f",
        r->is_success, om_retract_outcome_text(r->outcome), r->reason, r->visibility_start,
        r->visibility, r->force, r->force_world, r->epsilon, r->nforce, r->nforce_world, r->naction,
        r->nplan, r->nupdate, r->nadopted, r->ntrigger, r->ngood,
        r->nwarning[0] + r->nwarning[1] + r->nwarning[2], om_hold_text(r->hold), r->visibility_seen,
        r->mu_max, r->time, r->wall_time);
}

static void put_case_json(OmJson* json, const RetractionResult* r) {
    const double roi[2] = {r->c.roi.x, r->c.roi.y};
    const OmSearchResult* best = &r->ceiling.best;
    om_json_open(json, NULL, '{');
    om__put(json, "name %s|seed %d|share %f|believed %f", r->c.name, r->c.seed, r->c.share,
            r->c.believed);
    om_json_numbers(json, "roi_m", roi, 2);
    if (r->has_ceiling)
        om__put(json,
                "possible? %d|sequences_tried %d|sequences_exposed %d|best_visibility %f|"
                "search_both_arms? %d|search_actions %d",
                r->ceiling.is_possible, best->nsequence, best->nexposed, best->visibility,
                r->ceiling.is_possible && best->first_block >= 0, best->naction);
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
        om__put_object(json, om__retraction_row_name[row],
                       "runs %d|possible %d|success %d|success_possible %d|visibility %f|"
                       "visibility_mean %f|actions %f|force_events %f|force_ratio %f|"
                       "force_world_ratio %f|triggers %d|triggers_good %d|"
                       "false_alarms %d|more_actions %f|above_force %d|held %d|"
                       "held_where_search_exposes %d",
                       r->nrun, r->npossible, r->nsuccess, r->nsuccess_possible, r->visibility,
                       r->visibility_mean, r->actions, r->events, r->force, r->force_world,
                       r->ntrigger, r->ngood, r->nfalse, r->more_actions, r->nforce, r->nheld,
                       r->nheld_alone);
    }
    om_json_close(json, '}');
}

static void put_difference_json(OmJson* json, const char* key, const OmRetractionDifference* d) {
    if (d->npair == 0) return;
    const StudyInterval i = om__interval_paired(d->defras_only, d->other_only, d->npair);
    const double interval[2] = {i.lo, i.hi};
    om_json_open(json, key, '{');
    om__put(json, "pairs %d|defras_only %d|other_only %d|difference %f", d->npair, d->defras_only,
            d->other_only, i.value);
    om_json_numbers(json, "interval_95", interval, 2);
    om_json_number(json, "actions_more", d->actions);
    om_json_close(json, '}');
}

OmStatus om__retraction_write_json(const Retraction* s) {
    const OmStudyRetractionSummary* sum = &s->sum;
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "version %s|epsilon_n %f", om_version(), sum->epsilon);
    if (s->def->draw.kind == OM_DRAW_JUDGED)
        om__put(&json, "draw_hash %s|draw %d", s->def->draw.hash, s->def->draw.number);
    om__put(&json, "pairs_drawn %d|pairs_harmless %d|pairs_impossible %d|pairs_counting %d",
            sum->pairs.ndrawn, sum->pairs.nharmless, sum->pairs.nimpossible, sum->pairs.ncounting);
    om_json_open(&json, "differences", '{');
    for (int row = OM_RETRACTION_DEFRAS + 1; row < OM_RETRACTION_NROW; ++row)
        put_difference_json(&json, om__retraction_row_name[row], &sum->difference[row]);
    om_json_close(&json, '}');
    put_scores_json(&json, "scenarios", sum->scenario);
    put_scores_json(&json, "random", sum->random);
    put_scores_json(&json, "laboratory", sum->laboratory);
    put_scores_json(&json, "kidney", sum->kidney);
    put_scores_json(&json, "alarms", sum->alarm);
    if (s->has_replan) {
        om_json_open(&json, "replan_ms", '[');
        for (int g = 0; g < OM_RETRACTION_NGRID; ++g) {
            double ms[OM_RETRACTION_NSHARE];
            for (int f = 0; f < OM_RETRACTION_NSHARE; ++f) ms[f] = 1e3 * s->replan.mean[g][f];
            om_json_numbers(&json, NULL, ms, OM_RETRACTION_NSHARE);
        }
        om_json_close(&json, ']');
    }
    if (s->has_threshold)
        om__put(&json, "measured_epsilon_n %f|measured_margin_n %f", s->threshold.force.threshold,
                s->threshold.force.margin);
    om_json_open(&json, "cases", '[');
    for (int i = 0; i < s->ncase; ++i) put_case_json(&json, &s->result[i]);
    om_json_close(&json, ']');
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}
