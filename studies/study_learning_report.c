// study_learning_report.c: the report beside Figs 5.7, 5.8 and 5.10.
#include <math.h>
#include <string.h>

#include "omentum/report.h"
#include "studies/study_learning_internal.h"
#include "studies/study_table.h"

enum { SIDE = 7, CELL = 24, MAX_POINT = 400, TEXT = 32 };

static const char* const label[OM_NLEARNER] = {"PPO, the thesis's reward", "PPO, reward (b)",
                                               "GAIL", "behaviour cloning"};

// The return at a step, linear between the rows of a curve.
static double at_step(const LearningRun* run, double step) {
    int i = 0;
    if (run->nrow == 0 || step < run->step[0]) return (double)NAN;
    while (i + 1 < run->nrow && run->step[i + 1] <= step) ++i;
    if (i + 1 == run->nrow) return run->ret[i];
    double t = (step - run->step[i]) / (run->step[i + 1] - run->step[i]);  // steps increase
    return run->ret[i] + t * (run->ret[i + 1] - run->ret[i]);
}

// Fig. 5.7: the mean over seeds, and the lowest and the highest seed.
static OmStatus add_curve(OmReport* report, const Learning* s, int learner) {
    const LearningRun* first = &s->run[learner][0];
    double *x, *y;
    OmStatus status = OM_OK;
    int n = first->nrow < MAX_POINT ? first->nrow : MAX_POINT;
    if (!first->is_there || n < 2) return OM_OK;
    x = om_alloc((size_t)n, sizeof *x);
    y = om_alloc(3 * (size_t)n, sizeof *y);
    if (!x || !y) status = OM_NO_MEMORY;
    for (int i = 0; i < n && status == OM_OK; ++i) {
        double sum = 0, lowest = INFINITY, highest = -INFINITY;
        int num = 0;
        x[i] = first->step[(int64_t)i * (first->nrow - 1) / (n - 1)];
        for (int k = 0; k < s->def->nseed; ++k) {
            double value =
                s->run[learner][k].is_there ? at_step(&s->run[learner][k], x[i]) : (double)NAN;
            if (!isfinite(value)) continue;
            sum += value;
            lowest = fmin(lowest, value);
            highest = fmax(highest, value);
            ++num;
        }
        y[i] = num ? sum / num : (double)NAN;
        y[n + i] = lowest;
        y[2 * n + i] = highest;
    }
    if (status == OM_OK) {
        OmReportChart chart = {.title = label[learner],
                               .x_label = "steps",
                               .y_label = "return of an episode",
                               .nseries = s->def->nseed > 1 ? 3 : 1,
                               .series = {{"mean of the seeds", x, y, n, false},
                                          {"lowest seed", x, y + n, n, false},
                                          {"highest seed", x, y + 2 * n, n, false}}};
        om_report_chart(report, &chart);
    }
    om_free(x);
    om_free(y);
    return status;
}

// Figs 5.8 and 5.10: the score of each start, the mean over seeds; dark is 0, light is 1. Rows begin at the fixed side.
static OmStatus add_map(OmReport* report, const Learning* s, int learner, int world) {
    OmPicture picture = {0};
    char caption[96];
    const int size = SIDE * CELL;
    if (s->nstart != SIDE * SIDE || !s->run[learner][0].score[world]) return OM_OK;
    OM_TRY(om_picture_init(&picture, size, size, 3));
    double sum = 0;
    for (int start = 0; start < s->nstart; ++start) {
        double value = 0;
        for (int k = 0; k < s->def->nseed; ++k)
            value +=
                om__learning_mean(s, &s->run[learner][k], world, start, start + 1) / s->def->nseed;
        sum += value / s->nstart;
        const double v = fmin(fmax(value, 0), 1);
        const unsigned char rgb[3] = {(unsigned char)(68 + 185 * v), (unsigned char)(1 + 230 * v),
                                      (unsigned char)(84 - 47 * v)};
        for (int y = 0; y < CELL; ++y)
            for (int x = 0; x < CELL; ++x)
                memcpy(picture.pixel + 3 * ((ptrdiff_t)(start / SIDE * CELL + y) * size +
                                            start % SIDE * CELL + x),
                       rgb, 3);
    }
    snprintf(caption, sizeof caption, "%s%s: mean %.2f", label[learner],
             world ? ", \"reality\"" : "", sum);
    om_report_picture(report, &picture, caption);
    om_picture_done(&picture);
    return OM_OK;
}

// A number, or an empty cell where there is none.
static void add_number(StudyTable* t, const char* format, double value) {
    char text[TEXT] = "";
    if (isfinite(value)) snprintf(text, sizeof text, format, value);
    om__table_cell(t, text);
}

static void add_table(OmReport* report, const OmStudyLearningSummary* r) {
    StudyTable table = om__table(
        "|mean|of the lowest seed|lowest start|near the fixed side|far third|\"reality\"|lowest "
        "there|steps to 90 %|minutes");
    for (int l = 0; l < OM_NLEARNER; ++l) {
        const OmStudyLearning* b = &r->by[l];
        const double score[] = {b->mean,      b->least_mean,   b->lowest,        b->near_third,
                                b->far_third, b->reality_mean, b->reality_lowest};
        if (!b->is_there) continue;
        om__table_cell(&table, label[l]);
        for (int k = 0; k < 7; ++k) add_number(&table, "%.3f", score[k]);
        add_number(&table, "%.0f", b->steps90);
        add_number(&table, "%.1f", b->seconds / 60);
    }
    om__table_end(&table, report);
}

OmStatus om__learning_report(const Learning* s, const OmStudyLearningSummary* r) {
    OmReport report;
    OmStatus status = OM_OK;
    char text[256], verdict[600];
    snprintf(text, sizeof text, "task %s, %d seeds, %lld steps a training", s->def->task,
             s->def->nseed, (long long)s->def->nstep);
    om_report_begin(&report, "Learning to retract", text);
    snprintf(verdict, sizeof verdict, "Missed: %s.",
             r->missed[0] ? r->missed : "a simulation in \"reality\" failed");
    om_report_verdict(&report, r->is_met ? "Every bound that was measured is met." : verdict,
                      r->is_met);
    om__report_say(
        &report,
        "Score: %s. Each policy takes its most probable action from %d starts. Thesis, real robot (Fig. 5.10): "
        "PPO 0.38 without the starts near the attachment, GAIL 0.90.",
        s->score_name, s->nstart);
    add_table(&report, r);
    om_report_heading(&report, "Learning curves (Fig. 5.7)");
    for (int l = 0; l < OM_NLEARNER && status >= 0; ++l) status = add_curve(&report, s, l);
    for (int world = 0; world < LEARNING_WORLD; ++world) {
        if (world && !s->def->has_reality) continue;
        om_report_heading(&report, world ? "Score by start in \"reality\" (Fig. 5.10)"
                                         : "Score by start (Fig. 5.8)");
        om_report_paragraph(&report, "Rows begin at the fixed side of the fat. Dark: 0, light: 1.");
        for (int l = 0; l < OM_NLEARNER && status >= 0; ++l) status = add_map(&report, s, l, world);
    }
    return om__report_end(&report, s->def->out_dir, status);
}
