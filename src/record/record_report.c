// record_report.c: report.html of a run, complete without other files.
#include <string.h>

#include "omentum/record_audit.h"
#include "omentum/report.h"
#include "record/record_internal.h"

static const char* arm_name(int arm) { return arm ? "PSM2" : "PSM1"; }

static void add_facts(OmReport* report, const OmRetractResult* r) {
    enum { N = 8 };
    char text[N][64];
    snprintf(text[0], 64, "%.0f %%", 100 * r->visibility_end);
    snprintf(text[1], 64, isnan(r->truth.visibility) ? "not known" : "%.0f %%",
             100 * r->truth.visibility);
    snprintf(text[2], 64, "%d", r->naction);
    snprintf(text[3], 64, "%.1f s", r->time);
    snprintf(text[4], 64, isnan(r->twin.force) ? "not known" : "%.2f N", r->twin.force);
    snprintf(text[5], 64, isnan(r->truth.force) ? "not known" : "%.2f N", r->truth.force);
    snprintf(text[6], 64, isnan(r->truth.more) ? "not known" : "%.2f N", r->truth.more);
    snprintf(text[7], 64, "%d", r->twin.nforce);
    static const char* const label[N] = {"of the ROI seen at the end, in the picture",
                                         "of the ROI seen at the end, in the truth",
                                         "actions",
                                         "of operation",
                                         "largest pull, by the twin",
                                         "largest pull, in the truth",
                                         "largest excess of the truth over the twin",
                                         "times at the force limit"};
    const char* value[N];
    for (int i = 0; i < N; ++i) value[i] = text[i];
    om_report_facts(report, value, label, N);
}

// How the run was computed, below the pictures.
static void add_computing(OmReport* report, const OmRetractResult* r) {
    enum { N = 5 };
    char text[N][64];
    snprintf(text[0], 64, "%.0f %%", 100 * r->visibility_start);
    snprintf(text[1], 64, "%.2f ms", r->twin.step_ms);
    snprintf(text[2], 64, r->plan_ms_median > 0 ? "%.1f ms" : "not planned here",
             r->plan_ms_median);
    snprintf(text[3], 64, "%d", r->twin.nbad);
    snprintf(text[4], 64, isnan(r->truth.force) ? "not known" : "%d", r->truth.nbad);
    static const char* const label[N] = {"of the ROI seen at the start",
                                         "a step of the twin (mean)", "to make a plan (median)",
                                         "steps of the twin with less certain forces",
                                         "steps of the truth with less certain forces"};
    const char* value[N];
    for (int i = 0; i < N; ++i) value[i] = text[i];
    om_report_facts(report, value, label, N);
}

// What was asked, beside what came out.
static void add_question(OmReport* report, const OmRecorder* rec, const OmRetractResult* r) {
    const OmSceneTask* task = &rec->def.scene->task;
    const bool has_truth = r->truth.nvert > 0, has_force = task->watch_force;
    const double force = has_truth ? r->truth.force : r->twin.force;
    char text[400];
    int n = snprintf(text, sizeof text, "Asked: at least %.0f %% of the region of interest in view",
                     100 * task->visibility);
    if (has_force)
        n += snprintf(text + n, sizeof text - (size_t)n, ", and at most %.3g N on the tissue",
                      task->force_threshold);
    n += snprintf(text + n, sizeof text - (size_t)n, ". Came out: %.0f %%%s",
                  100 * r->visibility_end,
                  r->visibility_end >= task->visibility ? "" : ", too little");
    if (has_force)
        n += snprintf(text + n, sizeof text - (size_t)n, ", and %.2f N%s%s", force,
                      has_truth ? " in the simulated truth" : " by the twin",
                      force > task->force_threshold ? ", too much" : "");
    snprintf(text + n, sizeof text - (size_t)n, ".");
    om_report_paragraph(report, text);
}

// A sentence on how the tissue settled before the operation, if it moved far or is not at rest.
static void add_start(OmReport* report, const OmRetractResult* r) {
    char text[256];
    if (!r->is_settled)
        om_report_paragraph(report, "Warning: the tissue still moved when the operation began.");
    if (r->twin.nadded > 0) {
        snprintf(
            text, sizeof text,
            "The twin slid off while it settled, which the patient's images contradict: %d vertices of its "
            "underside were attached, so that it stays.",
            r->twin.nadded);
        om_report_paragraph(report, text);
    }
    if (r->twin.unregistered[0]) {
        snprintf(
            text, sizeof text,
            "Note: the tissue seen at rest is not the model's within the noise, and estimates may be refused: %.150s",
            r->twin.unregistered);
        om_report_paragraph(report, text);
    }
    if (r->twin.turned > 0 || r->twin.shifted > 0) {
        snprintf(
            text, sizeof text,
            "Before the operation the model was turned by %.1f degrees and shifted by %.1f mm, onto the tissue "
            "that the depth camera saw at rest.",
            180 / OM_PI * r->twin.turned, 1e3 * r->twin.shifted);
        om_report_paragraph(report, text);
    }
    if (r->effort.nmeasured > 0) {
        snprintf(
            text, sizeof text,
            "%d times an arm reached for tissue where the depth camera sees it, and not the twin: up to %.1f mm "
            "apart. In %d grasps the twin's tissue was drawn to the jaws.",
            r->effort.nmeasured, 1e3 * r->effort.measured_off, r->effort.ndrawn);
        om_report_paragraph(report, text);
    }
    if (!r->has_slid) return;
    int n =
        snprintf(text, sizeof text,
                 "Warning: the tissue slid while it settled, before any action: its vertices moved "
                 "by %.1f mm in the twin",
                 1e3 * r->twin.shift);
    if (isfinite(r->truth.shift))
        n += snprintf(text + n, sizeof text - (size_t)n, " and %.1f mm in the truth",
                      1e3 * r->truth.shift);
    snprintf(text + n, sizeof text - (size_t)n, ", in the mean.");
    om_report_paragraph(report, text);
}

static OmStatus add_charts(OmReport* report, const OmSceneTask* task, const OmRetractResult* r) {
    int n = r->nsample, ne = r->naction;
    double *t = NULL, *y[5] = {NULL, NULL, NULL, NULL, NULL}, *event = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(t, n);
    OM_ALLOC_DONE(event, ne);
    for (int k = 0; k < 5; ++k) OM_ALLOC_DONE(y[k], n);
    for (int i = 0; i < n; ++i) {
        t[i] = r->sample[i].time;
        y[0][i] = 100 * r->sample[i].visibility;
        y[1][i] = r->sample[i].force;
        y[2][i] = 1e3 * r->sample[i].height;
        y[3][i] = r->sample[i].force_world;
        y[4][i] = 100 * r->sample[i].visibility_world;
    }
    for (int i = 0; i < ne; ++i) event[i] = r->action[i].begin;
    OmReportChart chart = {.title = "Visibility of the ROI",
                           .x_label = "time, s",
                           .y_label = "% of its points",
                           .nseries = n > 0 && isnan(y[4][0]) ? 1 : 2,
                           .series = {{"in the picture", t, y[0], n}, {"in the truth", t, y[4], n}},
                           .has_limit = true,
                           .limit = 100 * task->visibility,
                           .limit_name = "exposed",
                           .has_range = true,
                           .y_max = 100,
                           .event = event,
                           .nevent = ne};
    om_report_chart(report, &chart);
    chart.title =
        "Pull on the tissue, estimated by the twin, and in the truth that the arms do not see";
    chart.y_label = "N, grasp force less the weight it carries";
    chart.series[0] = (OmReportSeries){"twin", t, y[1], n};
    chart.series[1] = (OmReportSeries){"truth", t, y[3], n};
    chart.nseries = r->nsample && isnan(y[3][0]) ? 1 : 2;
    if (isnan(r->twin.force)) {  // a twin without forces
        chart.title = "Pull on the tissue in the truth; the engine of the twin has no forces";
        chart.series[0] = chart.series[1];
        chart.nseries = 1;
    }
    chart.limit = task->force_threshold;
    chart.limit_name = "threshold of the scene";
    chart.limit2 = om__force_limit(task);
    chart.limit2_name =
        task->watch_force && task->force_margin > 0 ? "the arms stop pulling" : NULL;
    chart.y_max = task->force_threshold;
    om_report_chart(report, &chart);
    chart.nseries = 1;
    chart.limit2_name = NULL;
    chart.title = "Height of the gripper over the grasping point";
    chart.y_label = "mm";
    chart.series[0] = (OmReportSeries){"height", t, y[2], n};
    chart.limit = 1e3 * task->max_height;
    chart.limit_name = "height limit";
    chart.y_max = 1e3 * task->max_height;
    om_report_chart(report, &chart);
done:
    om_free(t);
    om_free(event);
    for (int k = 0; k < 5; ++k) om_free(y[k]);
    return status;
}

static OmStatus add_actions(OmReport* report, int grid, const OmRetractResult* r) {
    enum { NCOL = 8, LEN = 48 };
    static const char* const heading[NCOL] = {"time, s", "plan",     "action",     "block",
                                              "outcome", "ROI seen", "pull, twin", "pull, truth"};
    int n = r->naction;
    OmStatus status = OM_OK;
    char* text = NULL;
    const char** cell = NULL;
    OM_ALLOC_DONE(text, (size_t)n * NCOL * LEN);
    OM_ALLOC_DONE(cell, (size_t)n * NCOL);
    for (int i = 0; i < n; ++i) {
        const OmRetractAction* a = &r->action[i];
        char(*c)[LEN] = (char(*)[LEN])(text + (size_t)i * NCOL * LEN);
        snprintf(c[0], LEN, "%.1f - %.1f", a->begin, a->end);
        snprintf(c[1], LEN, "%d%s", a->plan + 1, a->is_replanned ? " (new)" : "");
        snprintf(c[2], LEN, "%s %s", arm_name(a->arm), om_plan_verb_text(a->verb));
        if (a->block >= 0)
            snprintf(c[3], LEN, "(%d,%d)", a->block % grid + 1, a->block / grid + 1);
        else
            snprintf(c[3], LEN, "-");
        const int m = snprintf(c[4], LEN, "%s", om_action_outcome_text(a->outcome));
        if (a->turn > 0)
            snprintf(c[4] + m, (size_t)(LEN - m), ", wrist turned by %.0f deg",
                     a->turn * 180 / OM_PI);
        snprintf(c[5], LEN, "%.0f %%", 100 * a->visibility);
        snprintf(c[6], LEN, isnan(a->force_max) ? "-" : "%.2f N", a->force_max);
        snprintf(c[7], LEN, isnan(a->force_world_max) ? "-" : "%.2f N", a->force_world_max);
        for (int k = 0; k < NCOL; ++k) cell[i * NCOL + k] = c[k];
    }
    om_report_table(report, heading, NCOL, cell, n);
done:
    om_free(text);
    om_free(cell);
    return status;
}

// Vertical, rad: that of the focal length where a camera has one.
static double field_of_view(const OmSceneCamera* c) {
    return c->focal[1] > 0 ? 2 * atan(0.5 * c->height / c->focal[1]) : c->fov;
}

static void add_settings(OmReport* report, const OmRecorder* rec, const OmRetractResult* r) {
    const OmScene* s = rec->def.scene;
    char text[2048], body[512];
    om_body_describe(s, om_body_site(rec->def.twin), body, sizeof body);
    int n = snprintf(text, sizeof text, "Twin: %d vertices, %d tetrahedra, %s. ", r->twin.nvert,
                     r->twin.ntet, body);
    if (rec->def.truth) {
        om_body_describe(s, om_body_site(rec->def.truth), body, sizeof body);
        n += snprintf(text + n, sizeof text - (size_t)n,
                      "Simulated truth: %d vertices, %d tetrahedra, %s; measured tips are off by "
                      "%.2g mm. ",
                      r->truth.nvert, r->truth.ntet, body, 1e3 * s->world.tool_noise);
    }
    snprintf(text + n, sizeof text - (size_t)n,
             "Rayleigh damping %.3g 1/s on mass and %.3g s on stiffness, time step %.0f ms.",
             s->tissue.rayleigh_mass, s->tissue.rayleigh_stiffness, 1e3 * s->task.time_step);
    om_report_paragraph(report, text);
    char margin[80] = "";
    if (!s->task.watch_force)
        snprintf(margin, sizeof margin, ", not watched: the arms do not stop for force");
    else if (s->task.force_margin > 0)
        snprintf(margin, sizeof margin, ", less a margin of %.2f N for the error of the estimate",
                 s->task.force_margin);
    snprintf(
        text, sizeof text,
        "Endoscope %.0f mm from the middle of the tissue, %.0f degrees above it, vertical field of view %.0f "
        "degrees. Grasping points on a %d x %d grid; tissue within %.0f mm of the tip is held. Pulls of %.0f "
        "mm up to %.0f mm; force threshold %.2f N%s; exposed at %.0f %% of all its points. Seed %d.",
        1e3 * s->endoscope.distance, s->endoscope.elevation * 180 / OM_PI,
        field_of_view(&s->endoscope) * 180 / OM_PI, s->task.grid, s->task.grid,
        1e3 * s->task.grasp_radius, 1e3 * s->task.pull_step, 1e3 * s->task.max_height,
        s->task.force_threshold, margin, 100 * s->task.visibility, s->seed);
    om_report_paragraph(report, text);
}

// Index of the k-th of m evenly spaced items among n, first and last included.
static int pick(int k, int m, int n) { return m < 2 ? 0 : (int)((int64_t)k * (n - 1) / (m - 1)); }

static OmStatus add_frame(OmReport* report, const Frame* f, int factor) {
    char caption[256];
    OmPicture small;
    snprintf(caption, sizeof caption, "%.1f s. %s", f->time, f->caption);
    OM_TRY(om_picture_shrink(&f->picture, factor, &small));
    om_report_picture(report, &small, caption);
    om_picture_done(&small);
    return OM_OK;
}

// A few pictures are visible at once; further ones of a long run are folded, at half the size.
static OmStatus add_frames(OmReport* report, const OmRecorder* rec) {
    enum { NOPEN = 9, NFOLDED = 36 };
    char summary[160];
    const int n = rec->nframe, nopen = n < NOPEN + 3 ? n : NOPEN;
    for (int k = 0; k < nopen; ++k) OM_TRY(add_frame(report, &rec->frame[pick(k, nopen, n)], 1));
    if (nopen == n) return OM_OK;
    const int nfolded = n < NFOLDED ? n : NFOLDED;
    if (nfolded == n)
        snprintf(summary, sizeof summary,
                 "All %d pictures, smaller; the folder frames has them at full size", n);
    else
        snprintf(summary, sizeof summary,
                 "%d of %d pictures, smaller; the folder frames has all at full size", nfolded, n);
    om_report_begin_fold(report, summary);
    for (int k = 0; k < nfolded; ++k)
        OM_TRY(add_frame(report, &rec->frame[pick(k, nfolded, n)], 2));
    om_report_end_fold(report);
    return OM_OK;
}

OmStatus om__report_write(const OmRecorder* rec, const OmRetractResult* r) {
    char subtitle[192], path[1100];
    snprintf(subtitle, sizeof subtitle, "scene %s, layout %d", rec->def.scene->name,
             rec->def.scene->seed);
    OM_TRY(om_path_join(rec->folder.path, "report.html", path, sizeof path));
    OmReport report;
    om_report_begin(&report, "Tissue retraction", subtitle);
    om_report_verdict(&report, r->reason, r->is_exposed);
    add_question(&report, rec, r);
    if (rec->view) {
        const char *text = "in three dimensions, with every decision", *href = "view.html";
        om_report_links(&report, "Watch the run: ", &text, &href, 1);
    }
    add_start(&report, r);
    add_facts(&report, r);
    om_report_heading(&report, "What the endoscope saw");
    OmStatus status = add_frames(&report, rec);
    add_computing(&report, r);
    om_report_heading(&report, "The course of it");
    if (status == OM_OK) status = add_charts(&report, &rec->def.scene->task, r);
    om_report_heading(&report, "What was done");
    if (status == OM_OK) status = add_actions(&report, rec->def.scene->task.grid, r);
    if (status == OM_OK) status = om__report_add_contact(&report, rec);
    if (status == OM_OK) status = om__report_add_monitor(&report, rec, r);
    if (status == OM_OK) status = om__report_add_belief(&report, rec, r);
    if (status == OM_OK) status = om__report_add_updates(&report, rec, r);
    if (rec->audit)
        om_report_details(&report, "The whole course in words", om_audit_story(rec->audit));
    om_report_details(&report, "Every plan, and why", rec->plans.str ? rec->plans.str : "");
    om_report_heading(&report, "Settings");
    add_settings(&report, rec, r);
    om_report_paragraph(
        &report,
        rec->def.has_recording
            ? "run.vtkhdf opens in ParaView 5.11 or later as a time series; run.json holds "
              "the numbers of this page."
            : "run.json holds the numbers of this page.");
    if (status == OM_OK) return om_report_save(&report, path);
    om_report_done(&report);
    return status;
}
