// record_report_monitor.c: the part of report.html on the discrepancy between twin and depth camera (Alg. 5).
#include "omentum/report.h"
#include "record/record_internal.h"

static void add_counts(OmReport* report, const OmSceneMonitor* m, const OmRetractResult* r) {
    char text[512];
    snprintf(
        text, sizeof text,
        "%d frames of the depth camera were compared with the twin. While tissue was held the "
        "median distance rose by up to %.1f mm above its value before the grasp. The warning "
        "state rose to 1 (above %.3g mm: half speed) %d times, to 2 (above %.3g mm: stop, "
        "learn, plan again) %d times, to 3 (above %.3g mm: a person decides) %d times; to 1 and 2 "
        "also where a part of the tissue did not follow a pull as expected.",
        r->belief.nmonitor, 1e3 * r->belief.mu_max, 1e3 * m->limit[0], r->belief.nwarning[0],
        1e3 * m->limit[1], r->belief.nwarning[1], 1e3 * m->limit[2], r->belief.nwarning[2]);
    om_report_paragraph(report, text);
}

static OmStatus add_charts(OmReport* report, const OmSceneMonitor* m, const OmRetractResult* r) {
    const int n = r->nsample;
    double *t = NULL, *mu = NULL, *state = NULL, *learnt = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(t, n);
    OM_ALLOC_DONE(mu, n);
    OM_ALLOC_DONE(state, n);
    OM_ALLOC_DONE(learnt, r->belief.nupdate);
    for (int i = 0; i < n; ++i) {
        t[i] = r->sample[i].time;
        mu[i] = 1e3 * r->sample[i].mu;
        state[i] = r->sample[i].warning;
    }
    for (int i = 0; i < r->belief.nupdate; ++i) learnt[i] = r->belief.update[i].start;
    OmReportChart chart = {
        .title = "Distance of the tissue from the twin, above its value before the grasp; "
                 "vertical lines: an estimate of the attachments began",
        .x_label = "time, s",
        .y_label = "mm, median",
        .nseries = 1,
        .series = {{"mu", t, mu, n}},
        .has_limit = true,
        .limit = 1e3 * m->limit[0],
        .limit_name = "state 1",
        .limit2 = 1e3 * m->limit[2],
        .limit2_name = "state 3",
        .has_range = true,
        .y_max = 1e3 * m->limit[2],
        .event = learnt,
        .nevent = r->belief.nupdate};
    om_report_chart(report, &chart);
    chart.title = "Warning state while tissue is held";
    chart.y_label = "0 to 3";
    chart.series[0] = (OmReportSeries){"state", t, state, n, .is_step = true};
    chart.has_limit = false;
    chart.limit2_name = NULL;
    chart.y_max = 3;
    om_report_chart(report, &chart);
done:
    om_free(t);
    om_free(mu);
    om_free(state);
    om_free(learnt);
    return status;
}

OmStatus om__report_add_monitor(OmReport* report, const OmRecorder* rec, const OmRetractResult* r) {
    if (r->belief.nmonitor == 0) return OM_OK;
    om_report_heading(report, "Does the twin agree with the tissue?");
    add_counts(report, &rec->def.scene->monitor, r);
    return add_charts(report, &rec->def.scene->monitor, r);
}
