// rl_report.c: the report of a training: the learning curve (Fig. 5.7) and the losses.
#include <math.h>

#include "omentum/report.h"
#include "rl/rl_internal.h"

typedef struct Curve {
    const char *title, *label;
    double value;
} Curve;

enum { SCORE = 1, EVALUATION = 6, NCURVE = 7 };

static void curves_of(const OmRlTrainRow* r, Curve c[NCURVE]) {
    c[0] = (Curve){"Return", "return, last 100 episodes", r->mean_return};
    c[1] = (Curve){"Score", "score, last 100 episodes", r->mean_score};
    c[2] = (Curve){"Length", "steps of an episode", r->mean_length};
    c[3] = (Curve){"Entropy", "entropy of the policy", r->entropy};
    c[4] = (Curve){"Value", "loss of the critic", r->loss_value};
    c[5] = (Curve){"Update", "approximate KL divergence", r->divergence};
    c[6] = (Curve){"Evaluations", "mean score, most probable actions", r->eval_score};
}

static void add_curve(OmReport* report, const RlSession* s, int k, double* x, double* y) {
    Curve c[NCURVE];
    int n = 0;
    for (int i = 0; i < s->nrow; ++i) {
        curves_of(&s->row[i], c);
        if (k == EVALUATION && !isfinite(c[k].value)) continue;
        x[n] = (double)s->row[i].step;
        y[n++] = c[k].value;
    }
    if (n == 0) return;
    curves_of(&s->row[0], c);
    OmReportChart chart = {.title = c[k].title,
                           .x_label = "steps",
                           .y_label = c[k].label,
                           .nseries = 1,
                           .series[0] = {om_rl_method_name(s->def->method), x, y, n, false}};
    if ((k == SCORE || k == EVALUATION) && isfinite(s->def->task->target)) {
        chart.has_limit = true;
        chart.limit = s->def->task->target;
        chart.limit_name = "target";
    }
    om_report_chart(report, &chart);
}

// What was asked, what came out, and whether it is good: by the last evaluation, or else by the last episodes.
static void add_verdict(OmReport* report, const RlSession* s) {
    const OmRlTrainDef* def = s->def;
    const OmRlTrainRow* last = s->nrow > 0 ? &s->row[s->nrow - 1] : NULL;
    double score = NAN;
    char text[320];
    for (int i = s->nrow - 1; i >= 0 && !isfinite(score); --i) score = s->row[i].eval_score;
    const bool is_evaluated = isfinite(score), has_target = isfinite(def->task->target);
    if (!is_evaluated && last) score = last->mean_score;
    const char* of = is_evaluated ? "in the last evaluation" : "in the last 100 episodes";
    if (!isfinite(score))
        om_report_verdict(report, "No episode has ended yet.", false);
    else if (has_target) {
        const bool is_good = score >= def->task->target;
        snprintf(text, sizeof text, "The mean score %s is %.3g: the target %.3g is %sreached.", of,
                 score, def->task->target, is_good ? "" : "not ");
        om_report_verdict(report, text, is_good);
    }
    int n = snprintf(text, sizeof text, "Asked: a policy for the task %s", def->task->name);
    if (has_target)
        n += snprintf(text + n, sizeof text - (size_t)n, " with a mean score of at least %.3g",
                      def->task->target);
    if (isfinite(score))
        snprintf(text + n, sizeof text - (size_t)n,
                 ". Came out: a mean score of %.3g %s, after %lld steps.", score, of,
                 (long long)last->step);
    else
        snprintf(text + n, sizeof text - (size_t)n, ".");
    om_report_paragraph(report, text);
}

OmStatus om__rl_save_report(const RlSession* s) {
    const OmRlTrainDef* def = s->def;
    const OmRlTrainRow* last = s->nrow > 0 ? &s->row[s->nrow - 1] : NULL;
    OmReport report;
    OmStatus status = OM_OK;
    double *x = NULL, *y = NULL;
    char text[5][64], path[1024], subtitle[128];
    OM_TRY(om_path_join(def->out_dir, "report.html", path, sizeof path));
    snprintf(subtitle, sizeof subtitle, "task %s, method %s, seed %llu", def->task->name,
             om_rl_method_name(def->method), (unsigned long long)def->seed);
    om_report_begin(&report, "Learning", subtitle);
    add_verdict(&report, s);
    OM_ALLOC_DONE(x, s->nrow + 1);
    OM_ALLOC_DONE(y, s->nrow + 1);
    if (last) {
        snprintf(text[0], sizeof text[0], "%lld", (long long)last->step);
        snprintf(text[1], sizeof text[1], "%lld", (long long)last->nepisode);
        snprintf(text[2], sizeof text[2], "%.4g", last->mean_return);
        snprintf(text[3], sizeof text[3], "%.4g", last->mean_score);
        snprintf(text[4], sizeof text[4], "%.1f", s->c.seconds / 60);
        const char* const value[] = {text[0], text[1], text[2], text[3], text[4]};
        const char* const label[] = {"steps", "episodes", "return", "score", "minutes"};
        om_report_facts(&report, value, label, 5);
        om_report_heading(&report, "Curves");
        for (int k = 0; k < NCURVE; ++k) add_curve(&report, s, k, x, y);
    }
    if (def->command) {
        om_report_heading(&report, "Command");
        om_report_listing(&report, def->command);
    }
    status = om_report_save(&report, path);
    om_free(x);
    om_free(y);
    return status;
done:
    om_report_done(&report);
    om_free(x);
    om_free(y);
    return status;
}
