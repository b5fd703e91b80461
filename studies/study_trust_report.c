// study_trust_report.c: the study of trust as report.html, study.json and cases.csv.
#include <math.h>
#include <string.h>

#include "omentum/match.h"
#include "studies/study_table.h"
#include "studies/study_trust_internal.h"

#define NSIZE 5  // rows of a table of sizes

static const char* const title[TRUST_NERROR] = {"none",
                                                "camera shifted",
                                                "camera turned about the tissue",
                                                "camera turned about itself",
                                                "wrong focal length",
                                                "wrong scale of depth",
                                                "distances along the ray",
                                                "a part without depth",
                                                "colour mirrored",
                                                "inverse pose",
                                                "OpenGL's axes",
                                                "quaternion in another order",
                                                "other tissue"};

// For people: mm, deg, or % of the true value.
static double show_size(const TrustCase* c) {
    switch (c->error) {
    case TRUST_SHIFT: return 1e3 * c->size;
    case TRUST_TILT:
    case TRUST_AIM: return 180 / OM_PI * c->size;
    case TRUST_FOCAL:
    case TRUST_SCALE: return 100 * (c->size - 1);
    case TRUST_MISSING: return 100 * c->size;
    default: return 0;
    }
}

static const char* unit_of(TrustError error) {
    const bool is_ratio = error == TRUST_FOCAL || error == TRUST_SCALE;
    return is_ratio ? "%" : om__trust_error_unit[error];
}

static void print_case(const TrustCase* c, char* out, size_t size) {
    const char* unit = unit_of(c->error);
    if (unit[0])
        snprintf(out, size, "%s, %.2f %s", title[c->error], show_size(c), unit);
    else
        snprintf(out, size, "%s", title[c->error]);
}

// ---- report.html: outcome and kinds --------------------------------------------------------------------------------

static void add_outcome(const Trust* s, OmReport* report) {
    const OmStudyTrustSummary* sum = &s->sum;
    char subject[96];
    snprintf(subject, sizeof subject, "%d right and %d wrong acquisitions", sum->nright,
             sum->nwrong);
    om__report_goals(report, subject, om__trust_goals(sum));
    om__report_facts(
        report,
        "Dice, right data|Dice, accepted wrong data|wrong acquisitions refused|Brier score|Brier score, "
        "attached or not|processor time of an update|time of judging",
        "%.2f|%.2f|%d of %d|%.3f|%.3f|%.0f ms|%.0f ms", sum->dice_right, sum->dice_wrong,
        sum->nwrong_refused, sum->nwrong, sum->all.brier, sum->all.brier_hard, sum->ms,
        sum->judge_ms);
    if (sum->nlost + sum->nabsent > 0)
        om__report_say(report,
                       "Of %d lifts %d have no picture, because the jaw lost the tissue. %d wrong "
                       "acquisitions could not be made: the other tissue has no such lift.",
                       TRUST_NLIFT * s->ntruth, sum->nlost, sum->nabsent);
}

static void add_kinds(const Trust* s, OmReport* report) {
    StudyTable table = om__table(
        "error|cases|accepted|corrected|refused|right cause|bad|Dice, right data|Dice, with the error");
    for (int i = 0; i < OM_STUDY_TRUST_NKIND; ++i) {
        const OmStudyTrustKind* k = &s->sum.kind[i];
        om__table_row(&table, "%s|%d|%d|%d|%d", title[1 + i], k->n, k->nclean, k->ncorrected,
                      k->nrefused);
        if (k->nrefused)
            om__table_row(&table, "%d of %d", k->nnamed, k->nrefused);
        else
            om__table_row(&table, "%s", "");
        om__table_row(&table, "%d", k->nbad);
        const bool is_any = k->nclean + k->ncorrected > 0;
        om__table_row(&table, is_any ? "%.2f|%.2f" : "|", k->dice_right, k->dice);
    }
    om__table_show(
        &table, report, "Wrong acquisitions",
        "Accepted: used unchanged; most of these errors are too small to matter. Corrected: the update found that the "
        "camera had moved, and put its points where they are. Refused: the twin keeps its belief. Right cause: the "
        "reason of a refusal names the error that was made; for a part without depth this is too little depth, for "
        "other tissue that no known error explains the scan. Bad: accepted, and the Dice is more than 0.15 below that "
        "of the right data. Dice are medians over accepted cases.");
}

// ---- report.html: sizes --------------------------------------------------------------------------------------------

typedef struct SizeRow {
    int n, nclean, ncorrected, nrefused;
    double worst;  // largest loss of Dice of an accepted case
    double loss[TRUST_NLIFT * OM_STUDY_TRUST_MAX_TRUTH];
} SizeRow;

static void add_to_row(const TrustUpdate* u, const TrustUpdate* right, SizeRow* row) {
    ++row->n;
    if (!u->is_accepted) {
        ++row->nrefused;
        return;
    }
    const double loss = right->dice - u->dice;
    row->loss[row->nclean + row->ncorrected] = loss;
    row->nclean += !u->is_moved;
    row->ncorrected += u->is_moved != 0;
    row->worst = fmax(row->worst, loss);
}

static void add_size_row(const Trust* s, TrustError error, double from, double to, SizeRow* row,
                         StudyTable* table) {
    memset(row, 0, sizeof *row);
    row->worst = -HUGE_VAL;
    for (int i = 0; i < s->ntruth; ++i)
        for (int k = 0; k < s->result[i].nlift; ++k) {
            const TrustResult* r = &s->result[i];
            const double size = fabs(show_size(&r->c[k]));
            if (r->c[k].error == error && r->wrong[k].is_there && size >= from && size < to)
                add_to_row(&r->wrong[k], &r->right[k], row);
        }
    if (row->n == 0) return;
    om__table_row(table, "%s|%g to %g %s|%d|%d|%d|%d", title[error], from, to, unit_of(error),
                  row->n, row->nclean, row->ncorrected, row->nrefused);
    const int naccepted = row->nclean + row->ncorrected;
    om__table_row(table, naccepted ? "%.2f|%.2f" : "|",
                  om__study_sample(row->loss, naccepted).median, row->worst);
}

static void add_sizes(const Trust* s, OmReport* report) {
    static const struct {
        TrustError error;
        double limit[NSIZE + 1];
    } list[] = {{TRUST_SHIFT, {0, 0.3, 1, 3, 10, 31}}, {TRUST_TILT, {0, 0.2, 0.6, 2, 6, 21}},
                {TRUST_AIM, {0, 0.1, 0.3, 1, 3, 11}},  {TRUST_FOCAL, {0, 1, 3, 10, 20, 50}},
                {TRUST_SCALE, {0, 0.3, 1, 4, 15, 65}}, {TRUST_MISSING, {0, 15, 30, 45, 60, 71}}};
    SizeRow* row = om_alloc(1, sizeof *row);
    if (!row) {
        om_report_fail(report, OM_NO_MEMORY);
        return;
    }
    StudyTable table =
        om__table("error|size|cases|accepted|corrected|refused|Dice lost, median|Dice lost, most");
    for (size_t e = 0; e < sizeof list / sizeof *list; ++e)
        for (int k = 0; k < NSIZE; ++k)
            add_size_row(s, list[e].error, list[e].limit[k], list[e].limit[k + 1], row, &table);
    om_free(row);
    om__table_show(
        &table, report, "Sizes",
        "Dice lost: that of the right data less that with the error, over accepted cases; below 0 it "
        "was higher with the error. Focal length and scale of depth: away from the true value, up or "
        "down.");
}

// ---- report.html: probabilities ------------------------------------------------------------------------------------

static void add_probabilities(const Trust* s, OmReport* report) {
    const OmStudyReliability *all = &s->sum.all, *right = &s->sum.right, *every = &s->sum.every;
    double x[OM_STUDY_TRUST_NBIN], y[OM_STUDY_TRUST_NBIN];
    const double diagonal[2] = {0, 1};
    om_report_heading(report, "Probabilities");
    StudyTable scores = om__table("updates|vertices|ECE|Brier score|Brier score, attached or not");
    const struct {
        const char* name;
        const OmStudyReliability* r;
    } row[] = {{"right, accepted", right},
               {"right and wrong, accepted (the goal)", all},
               {"right and wrong, refused ones too", every}};
    for (int k = 0; k < 3; ++k)
        om__table_row(&scores, "%s|%d|%.3f|%.3f|%.3f", row[k].name, row[k].r->n, row[k].r->ece,
                      row[k].r->brier, row[k].r->brier_hard);
    om__table_end(&scores, report);
    StudyTable table = om__table("bin|vertices|mean probability|share attached");
    for (int b = 0; b < OM_STUDY_TRUST_NBIN; ++b) {
        x[b] = all->count[b] ? all->mean[b] : (b + 0.5) / OM_STUDY_TRUST_NBIN;
        y[b] = all->count[b] ? all->share[b] : HUGE_VAL;  // a gap
        om__table_row(&table, "%.2f to %.2f|%d", b / (double)OM_STUDY_TRUST_NBIN,
                      (b + 1) / (double)OM_STUDY_TRUST_NBIN, all->count[b]);
        om__table_row(&table, all->count[b] ? "%.3f|%.3f" : "|", all->mean[b], all->share[b]);
    }
    OmReportChart chart = {.title = "Are probabilities what they say?",
                           .x_label = "mean probability of a bin",
                           .y_label = "share of its vertices that is attached",
                           .series = {{"accepted updates", x, y, OM_STUDY_TRUST_NBIN, false},
                                      {"perfect", diagonal, diagonal, 2, false}},
                           .nseries = 2};
    om_report_chart(report, &chart);
    om__table_end(&table, report);
    om_report_paragraph(
        report,
        "Vertices of the underside, pooled over updates. ECE: the mean distance of both columns, by the number of "
        "vertices. Brier score: the mean squared distance of probability and truth; beside it that of the estimated "
        "set, taken as probabilities 0 and 1. A refused update states the prior, or an estimate that is not used.");
}

// ---- report.html: single cases -------------------------------------------------------------------------------------

static void add_bad(const Trust* s, OmReport* report) {
    StudyTable table =
        om__table("truth|lift, mm|held, %|error|Dice, right data|Dice, with the error|judged as");
    om_report_heading(report, "Bad cases");
    if (s->sum.nbad == 0) om_report_paragraph(report, "None.");
    for (int i = 0; i < s->ntruth; ++i)
        for (int k = 0; k < s->result[i].nlift; ++k) {
            const TrustResult* r = &s->result[i];
            const TrustUpdate* u = &r->wrong[k];
            char text[96];
            if (!om__trust_is_bad(u, &r->right[k])) continue;
            print_case(&r->c[k], text, sizeof text);
            om__table_row(&table, "%d|%.0f|%.0f|%s|%.2f|%.2f", i, 1e3 * r->height[k],
                          100 * r->share, text, r->right[k].dice, u->dice);
            om__table_cell(&table, u->reason[0] ? u->reason : "right");
        }
    om__table_end(&table, report);
}

static void add_refused(const Trust* s, OmReport* report) {
    StudyTable table = om__table("truth|lift, mm|held, %|Dice, not used|reason");
    om_report_heading(report, "Right cases that were refused");
    if (s->sum.nright_refused == 0) om_report_paragraph(report, "None.");
    for (int i = 0; i < s->ntruth; ++i)
        for (int k = 0; k < s->result[i].nlift; ++k) {
            const TrustResult* r = &s->result[i];
            if (r->right[k].is_accepted) continue;
            om__table_row(&table, "%d|%.0f|%.0f|%.2f", i, 1e3 * r->height[k], 100 * r->share,
                          r->right[k].dice);
            om__table_cell(&table, r->right[k].reason);
        }
    om__table_end(&table, report);
}

static void add_two(const Trust* s, OmReport* report) {
    const OmStudyTrustSummary* sum = &s->sum;
    om__report_section(
        report, "A right acquisition with a wrong one",
        "%d updates have two acquisitions: a right one, and the next lift, of which the picture shows other "
        "tissue. In %d the wrong one is left out or the update is refused (%d refused). In %d the update is "
        "accepted with a Dice more than %.2f below that of the right acquisition alone.",
        sum->ntwo, sum->ntwo_out, sum->ntwo_refused, sum->ntwo_bad, OM_STUDY_TRUST_LOSS);
}

static void add_how(const Trust* s, OmReport* report) {
    om_report_heading(report, "How");
    if (s->def->draw.kind == OM_DRAW_JUDGED)
        om__report_say(report, "Cases are draw %d of the sources with the hash %s (commit %s).",
                       s->def->draw.number, s->def->draw.hash, s->def->draw.commit);
    else
        om_report_paragraph(report,
                            "Cases have the seed of development: thresholds were chosen on them.");
    om_report_paragraph(
        report,
        "A truth is a sheet of the simulated world with a random patch of 10 to 50 % of its underside attached and 0.7 "
        "to 1.3 of the twin's stiffness. It is grasped near its border and lifted to 16, 23, 30, 37 and 44 mm; at each "
        "height the depth camera sees it with noise and with the tool in view, and once before the tool touches it. "
        "The twin believes in no attachment. Each lift is given to the update alone. One error of the list is drawn "
        "for it, with a size that is even in its logarithm; it changes both pictures. Dice is by number of vertices of "
        "the underside.");
}

static OmStatus write_report(const Trust* s) {
    char text[160];
    OmReport report;
    snprintf(text, sizeof text, "%d sheets, each lifted to %d heights, right data and wrong data%s",
             s->ntruth, TRUST_NLIFT, s->def->is_quick ? ", quick" : "");
    om_report_begin(&report, "Trust in updates", text);
    add_outcome(s, &report);
    add_kinds(s, &report);
    add_sizes(s, &report);
    add_two(s, &report);
    add_probabilities(s, &report);
    add_bad(s, &report);
    add_refused(s, &report);
    add_how(s, &report);
    return om__report_end(&report, s->def->out_dir, OM_OK);
}

// ---- study.json, cases.csv -----------------------------------------------------------------------------------------

static void put_kinds(OmJson* json, const OmStudyTrustSummary* sum) {
    om_json_open(json, "kinds", '{');
    for (int i = 0; i < OM_STUDY_TRUST_NKIND; ++i) {
        const OmStudyTrustKind* k = &sum->kind[i];
        om__put_object(
            json, k->name,
            "cases %d|accepted %d|corrected %d|refused %d|right_cause %d|bad %d|dice_right %f|"
            "dice %f",
            k->n, k->nclean, k->ncorrected, k->nrefused, k->nnamed, k->nbad, k->dice_right,
            k->dice);
    }
    om_json_close(json, '}');
}

static void put_reliability(OmJson* json, const char* key, const OmStudyReliability* r) {
    om_json_open(json, key, '{');
    om__put(json, "vertices %d|ece %f|brier %f|brier_of_set %f", r->n, r->ece, r->brier,
            r->brier_hard);
    om_json_open(json, "bins", '[');
    for (int b = 0; b < OM_STUDY_TRUST_NBIN; ++b) {
        om__put_object(json, NULL, "vertices %d|probability %f|attached %f", r->count[b],
                       r->mean[b], r->share[b]);
    }
    om_json_close(json, ']');
    om_json_close(json, '}');
}

static OmStatus write_json(const Trust* s) {
    const OmStudyTrustSummary* sum = &s->sum;
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "is_met? %d|is_quick? %d", sum->is_met, s->def->is_quick);
    if (s->def->draw.kind == OM_DRAW_JUDGED)
        om__put(&json, "draw_hash %s|draw %d", s->def->draw.hash, s->def->draw.number);
    om__put(&json,
            "truths %d|lost_lifts %d|right %d|right_refused %d|wrong %d|wrong_refused %d|bad %d|"
            "absent %d|dice_right %f|dice_wrong %f",
            sum->ntruth, sum->nlost, sum->nright, sum->nright_refused, sum->nwrong,
            sum->nwrong_refused, sum->nbad, sum->nabsent, sum->dice_right, sum->dice_wrong);
    put_kinds(&json, sum);
    om__put(&json, "two %d|two_out %d|two_refused %d|two_bad %d", sum->ntwo, sum->ntwo_out,
            sum->ntwo_refused, sum->ntwo_bad);
    put_reliability(&json, "probability_right", &sum->right);
    put_reliability(&json, "probability", &sum->all);
    put_reliability(&json, "probability_with_refused", &sum->every);
    om__put(&json, "processor_ms %f|judge_ms %f", sum->ms, sum->judge_ms);
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}

static void add_line(StudyLines* t, const char* part, int truth, int lift, const TrustCase* c,
                     const TrustUpdate* u, const TrustUpdate* right) {
    if (!u->is_there) return;
    char reason[sizeof u->reason];
    snprintf(reason, sizeof reason, "%s", u->reason);
    for (char* at = reason; *at; ++at)
        if (*at == '"') *at = '\'';
    const char* cause = om_match_cause_name((OmMatchCause)u->cause);
    om__lines_add(t, "%s,%d,%d,%s,%.6g,%s,%d,%d,%d,%s,%.6f,%.6f,%d,%.1f,\"%s\"\n", part, truth,
                  lift, om__trust_error_name[c->error], show_size(c), unit_of(c->error),
                  u->is_accepted, u->is_moved, u->is_left_out, cause, u->dice, right->dice,
                  om__trust_is_bad(u, right), u->ms, reason);
}

static OmStatus write_csv(const Trust* s) {
    static const TrustCase none = {0}, other = {.error = TRUST_OTHER};
    StudyLines t = {0};
    om__lines_add(&t, "part,truth,lift,error,size,unit,accepted,corrected,left_out,"
                      "cause,dice,dice_right,bad,processor_ms,reason\n");
    for (int i = 0; i < s->ntruth; ++i) {
        const TrustResult* r = &s->result[i];
        for (int k = 0; k < r->nlift; ++k) {
            const TrustUpdate* right = &r->right[k];
            add_line(&t, "right", i, k, &none, right, right);
            add_line(&t, "wrong", i, k, &r->c[k], &r->wrong[k], right);
            if (k + 1 < r->nlift) add_line(&t, "two", i, k, &other, &r->two[k], right);
        }
    }
    return om__lines_save(&t, s->def->out_dir, "cases.csv");
}

OmStatus om__trust_write(const Trust* s) {
    OM_TRY(write_json(s));
    OM_TRY(write_csv(s));
    return write_report(s);
}
