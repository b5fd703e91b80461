// study_curve.c: the learning curve of BA-Net.
//
// All trainings have the same number of steps, so a larger set has fewer epochs: the cost is equal, and differences are
// those of the samples. A training that is complete is read from its folder by its checkpoint (om_banet_train).
#include "studies/study_curve.h"

#include <math.h>
#include <stdio.h>

#include "studies/study_table.h"

#define COOKIE 0x57cbe7e1u
#define NTRAINED 200  // samples of the training that are scored, too
#define MAX_PATH 1024

OmStudyCurveDef om_study_curve_default_def(const OmBanetData* data, const char* out_dir) {
    static const int wanted[] = {1100, 2500, 5000, 10000};
    OmStudyCurveDef def = {.out_dir = out_dir,
                           .train = om_banet_train_default_def(data, NULL),
                           .nstep = 5000,
                           .cookie = COOKIE};
    def.train.nvalid = (int)fmin(500, data->nsample / 10);
    def.train.batch = 8;
    def.train.dropout = 0.05;
    def.train.type = om_net_fast_type();
    const int most = data->nsample - def.train.nvalid;
    for (size_t k = 0; k < sizeof wanted / sizeof *wanted; ++k)
        if (wanted[k] <= most) def.size[def.nsize++] = wanted[k];
    // 5,000 samples have 4,500 for training
    if (def.nsize == 0 || def.size[def.nsize - 1] < most) def.size[def.nsize++] = most;
    return def;
}

static OmStatus check_def(const OmStudyCurveDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "learning curve: a definition not made by om_study_curve_default_def");
    OM_CHECK(d->out_dir, OM_INVALID, "learning curve: no folder");
    OM_CHECK(d->nsize >= 1 && d->nsize <= OM_STUDY_CURVE_MAX, OM_INVALID,
             "learning curve: %d sizes, 1 to %d", d->nsize, OM_STUDY_CURVE_MAX);
    const OmBanetTrainDef* t = &d->train;
    OM_CHECK(d->nstep >= 1 && t->batch >= 1 && t->nvalid >= 1, OM_INVALID,
             "learning curve: nstep %d, batch %d, nvalid %d; all must be above 0", d->nstep,
             t->batch, t->nvalid);
    const int most = t->data->nsample - t->nvalid;
    for (int k = 0; k < d->nsize; ++k)
        OM_CHECK(d->size[k] >= t->batch && (k == 0 || d->size[k] > d->size[k - 1]) &&
                     d->size[k] <= most,
                 OM_INVALID, "learning curve: size %d; from a batch (%d) to %d samples, ascending",
                 d->size[k], t->batch, most);
    return OM_OK;
}

// Scores of the weights in `dir` on the samples first .. first + n - 1.
static OmStatus score(const OmBanetTrainDef* t, const char* dir, int first, int n,
                      const OmProgress* progress, OmBanetEval* eval) {
    char path[MAX_PATH];
    OmBanetNet* net;
    OM_TRY(om_path_join(dir, "weights.safetensors", path, sizeof path));
    OM_TRY(om_banet_net_load(path, &net));
    OmStatus status = om_banet_eval(net, t->data, first, n, t->nworker, progress, eval);
    om_banet_net_destroy(net);
    return status;
}

static OmStatus run_point(const OmStudyCurveDef* d, int nsample, const OmProgress* progress,
                          OmStudyCurvePoint* p) {
    char name[32], dir[MAX_PATH];
    OmBanetTrainSummary s;
    OmBanetEval eval;
    snprintf(name, sizeof name, "n%06d", nsample);
    OM_TRY(om_path_join(d->out_dir, name, dir, sizeof dir));
    const OmBanetTrainDef* t = &d->train;
    OmBanetTrainDef def = *t;
    def.out_dir = dir;
    def.ntrain = nsample;
    def.nepoch = (int)fmax(1, round((double)d->nstep * t->batch / nsample));
    OM_TRY(om_banet_train(&def, progress, &s));
    *p = (OmStudyCurvePoint){
        .nsample = nsample, .nepoch = s.nepoch, .best_epoch = s.best_epoch, .seconds = s.seconds};
    OM_TRY(score(t, dir, t->data->nsample - t->nvalid, t->nvalid, progress, &eval));
    p->dsc = eval.mean_dsc, p->tpr = eval.mean_tpr, p->ece = eval.ece;
    p->dsc_median = eval.dsc_quartile[1];
    om_banet_eval_done(&eval);
    OM_TRY(score(t, dir, 0, nsample < NTRAINED ? nsample : NTRAINED, progress, &eval));
    p->dsc_trained = eval.mean_dsc;
    om_banet_eval_done(&eval);
    return OM_OK;
}

static OmStatus write_report(const OmStudyCurveDef* d, const OmStudyCurveSummary* s) {
    const OmBanetTrainDef* t = &d->train;
    double n[OM_STUDY_CURVE_MAX], dsc[OM_STUDY_CURVE_MAX], trained[OM_STUDY_CURVE_MAX];
    OmReport report;
    om_report_begin(&report, "Learning curve", "BA-Net by the number of its training samples");
    if (s->npoint > 1)
        om__report_judge(
            &report, s->is_saturated,
            "Twice the samples bring %+.3f of the mean DSC (from %d to %d samples): %s.", s->gain,
            s->point[s->npoint - 2].nsample, s->point[s->npoint - 1].nsample,
            s->is_saturated ? "more of them are not worth making"
                            : "more of them are worth making");
    StudyTable table =
        om__table("samples|epochs|best|DSC|DSC, median|TPR, %|ECE|DSC of its training|minutes");
    for (int k = 0; k < s->npoint; ++k) {
        const OmStudyCurvePoint* p = &s->point[k];
        n[k] = p->nsample, dsc[k] = p->dsc, trained[k] = p->dsc_trained;
        om__table_row(&table, "%d|%d|%d|%.3f|%.3f|%.1f|%.3f|%.3f|%.1f", p->nsample, p->nepoch,
                      p->best_epoch, p->dsc, p->dsc_median, 100 * p->tpr, p->ece, p->dsc_trained,
                      p->seconds / 60);
    }
    om__table_end(&table, &report);
    OmReportChart chart = {.title = "Mean DSC",
                           .x_label = "training samples",
                           .y_label = "mean DSC",
                           .is_log_x = true,
                           .series = {{"validation samples", n, dsc, s->npoint, false},
                                      {"samples of the training", n, trained, s->npoint, false}},
                           .nseries = 2};
    om_report_chart(&report, &chart);
    om__report_say(
        &report,
        "Each training has %d steps of %d samples, peak rate %g, dropout %g, and begins with %s. The "
        "last %d of %d samples are for validation; they choose epoch, calibration and threshold of each.",
        d->nstep, t->batch, t->rate, t->dropout, t->start ? t->start : "random weights", t->nvalid,
        t->data->nsample);
    return om__report_end(&report, d->out_dir, OM_OK);
}

static OmStatus write_json(const OmStudyCurveDef* d, const OmStudyCurveSummary* s) {
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "steps %d|batch %d|validation_samples %d", d->nstep, d->train.batch,
            d->train.nvalid);
    om_json_open(&json, "points", '[');
    for (int k = 0; k < s->npoint; ++k) {
        const OmStudyCurvePoint* p = &s->point[k];
        om__put_object(
            &json, NULL,
            "samples %d|epochs %d|best_epoch %d|dsc %f|dsc_median %f|tpr %f|ece %f|dsc_trained %f",
            p->nsample, p->nepoch, p->best_epoch, p->dsc, p->dsc_median, p->tpr, p->ece,
            p->dsc_trained);
    }
    om_json_close(&json, ']');
    if (s->npoint > 1) om_json_number(&json, "gain_of_twice", s->gain);
    return om__study_save_json(d->out_dir, &json, OM_OK);
}

OmStatus om_study_curve_run(const OmStudyCurveDef* def, const OmProgress* progress,
                            OmStudyCurveSummary* s) {
    OmFolder folder = {0};
    *s = (OmStudyCurveSummary){.gain = (double)NAN};
    OM_TRY(check_def(def));
    OmStatus status = om_folder_open(def->out_dir, "study-curve", &folder);
    for (int k = 0; k < def->nsize && status == OM_OK; ++k) {
        status = run_point(def, def->size[k], progress, &s->point[k]);
        s->npoint += status == OM_OK;
    }
    if (s->npoint > 1) {
        const OmStudyCurvePoint *a = &s->point[s->npoint - 2], *b = &s->point[s->npoint - 1];
        s->gain = (b->dsc - a->dsc) * log(2) / log((double)b->nsample / a->nsample);
        s->is_saturated = s->gain < OM_STUDY_CURVE_GAIN;
    }
    if (status == OM_OK) status = write_json(def, s);
    if (status == OM_OK) status = write_report(def, s);
    om_folder_end(&folder);
    return status;
}
