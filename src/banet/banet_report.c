// banet_report.c: summary.json and report.html of a data set.
#include <string.h>

#include "banet/banet_data_internal.h"
#include "omentum/report.h"
#include "omentum/sense.h"

#define NBIN 20
#define WIDTH 480
#define HEIGHT 360
#define MAX_BIN_U 0.2  // m: the histogram ends here

// ---- summary ----------------------------------------------------------------------------------------

typedef struct Histogram {
    double edge[NBIN + 1], count[NBIN];
} Histogram;

// Values in [0, max]; larger ones are in the last bin.
static Histogram histogram_of(const OmBanetFacts* fact, int n, size_t offset, double max) {
    Histogram h = {0};
    for (int k = 0; k <= NBIN; ++k) h.edge[k] = max * k / NBIN;
    for (int i = 0; i < n; ++i) {
        double value;
        memcpy(&value, (const char*)&fact[i] + offset, sizeof value);
        const double bin = NBIN * value / max;  // max > 0
        h.count[bin >= NBIN ? NBIN - 1 : bin > 0 ? (int)bin : 0] += 1;
    }
    return h;
}

static OmStatus write_summary(const OmBanetDataDef* def, const OmBanetSummary* s,
                              const Histogram* u) {
    char path[1024], hash[20];
    OM_TRY(om_path_join(def->out_dir, "summary.json", path, sizeof path));
    OmText text = {0};
    OmJson j = om_json_begin(&text);
    om_json_open(&j, NULL, '{');
    snprintf(hash, sizeof hash, "%016llx",
             (unsigned long long)om_banet_sample_def_hash(&def->sample));
    om_json_string(&j, "hash", hash);
    om_json_integer(&j, "seed", (int64_t)def->sample.seed);
    om_json_integer(&j, "first", def->first);
    om_json_integer(&j, "samples", s->nsample);
    om_json_string(&j, "way", om_banet_way_name(def->sample.way));
    om_json_string(&j, "law", om_law_name(def->sample.law));
    om_json_string(&j, "element", om_element_name(def->sample.element));
    om_json_number(&j, "side_mm", 1e3 * def->sample.side);
    om_json_integer(&j, "camera", s->ncamera);
    om_json_integer(&j, "board", s->nboard);
    om_json_integer(&j, "two_regions", s->ntwo);
    om_json_number(&j, "median_displacement_mm", 1e3 * s->median_u);
    om_json_number(&j, "largest_displacement_mm", 1e3 * s->max_u);
    om_json_number(&j, "median_visible", s->median_visible);
    om_json_integer(&j, "draws", s->nattempt);
    om_json_integer(&j, "failed_solves", s->nfail);
    om_json_integer(&j, "cells", s->ncell);
    om_json_integer(&j, "bytes", s->nbyte);
    om_json_numbers(&j, "histogram_edges_m", u->edge, NBIN + 1);
    om_json_numbers(&j, "histogram", u->count, NBIN);
    om_json_close(&j, '}');
    return om_json_save(&j, path);
}

// ---- pictures ---------------------------------------------------------------------------------------

enum { SEEN, UNSEEN, ATTACHED, GRASPED, NCLASS };

static int class_of(const OmBanetSample* s, const int* tri) {
    int nattached = 0, ngrasped = 0;
    double seen = 0;
    for (int c = 0; c < 3; ++c) {
        nattached += s->attached[tri[c]] != 0;
        ngrasped += s->grasped[tri[c]] != 0;
        seen += s->seen[tri[c]];
    }
    return nattached == 3 ? ATTACHED : ngrasped >= 2 ? GRASPED : seen > 1.5 ? SEEN : UNSEEN;
}

// Triangles of one class of the deformed surface.
static OmStatus add_class(OmSenseScene* scene, const OmBanetSample* s, int class) {
    static const OmSenseLook look[NCLASS] = {
        {.red = 0.93, .green = 0.74, .blue = 0.45, .gloss = 0.1, .is_smooth = true},
        {.red = 0.45, .green = 0.45, .blue = 0.45, .is_smooth = true},
        {.red = 0.1, .green = 0.25, .blue = 0.7},
        {.red = 0.85, .green = 0.2, .blue = 0.15}};
    OmSurface part;
    int n = 0, id;
    OM_TRY(om_surface_init(&part, s->surface.nvert, s->surface.ntri));
    for (int i = 0; i < part.nvert; ++i) om_store3(part.x, i, om_load3(s->x, s->surface_vert[i]));
    for (int t = 0; t < s->surface.ntri; ++t) {
        const int* v = s->surface.tri_vert + 3 * (size_t)t;
        if (class_of(s, v) == class) memcpy(part.tri_vert + 3 * (size_t)n++, v, 3 * sizeof *v);
    }
    part.ntri = n;
    OmStatus status = n > 0 ? om_sense_scene_add(scene, &part, &look[class], &id) : OM_OK;
    om_surface_done(&part);
    return status;
}

// From the side, the force upwards.
static OmStatus render(const OmBanetSample* s, const OmSenseScene* scene, int nworker,
                       OmReport* report, const char* caption) {
    OmVec3 lo = om_load3(s->x, 0), hi = lo;
    for (int i = 0; i < s->mesh.nvert; ++i) {
        lo = om_min3(lo, om_load3(s->x, i));
        hi = om_max3(hi, om_load3(s->x, i));
    }
    const OmVec3 target = om_lerp(lo, hi, 0.5), up = om_normalize(s->force);
    const OmVec3 side = om_normalize(om_madd(om_orthogonal(up), 0.5, up));
    const OmVec3 eye = om_madd(target, 1.4 * om_distance(lo, hi), side);
    const OmCamera camera = {.pose_world_camera = om_pose_look_at(eye, target, up),
                             .width = WIDTH,
                             .height = HEIGHT,
                             .fov = 40 * OM_PI / 180,
                             .near_m = 0.001,
                             .far_m = 100};
    OmSenseOptions options = om_sense_options_default();
    OmPicture picture = {0};
    options.nworker = nworker;
    OmStatus status = om_picture_init(&picture, WIDTH, HEIGHT, 3);
    if (status == OM_OK) status = om_sense_render(scene, &camera, &options, &picture);
    if (status == OM_OK) om_report_picture(report, &picture, caption);
    om_picture_done(&picture);
    return status;
}

// A sample is a function of definition and index, so samples for pictures are made again.
static OmStatus add_picture(const OmBanetDataDef* def, int index, OmReport* report) {
    OmBanetSample s = {0};
    OmSenseScene* scene = NULL;
    char caption[300];
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_banet_sample_make(&def->sample, index, &s));
    if (status != OM_OK) goto done;  // no valid draw: the set itself has said so
    OM_TRY_DONE(om_sense_scene_create(&scene));
    for (int k = 0; k < NCLASS; ++k) OM_TRY_DONE(add_class(scene, &s, k));
    OM_TRY_DONE(om_sense_scene_commit(scene));
    snprintf(
        caption, sizeof caption,
        "Sample %d: %s%s, %d region%s, %.0f %% attached, %.0f %% seen, largest displacement %.1f mm",
        index, s.is_camera ? "camera" : "exact", s.has_board ? ", on a board" : "", s.nregion,
        s.nregion == 1 ? "" : "s", 100 * s.share, 100 * s.visible, 1e3 * s.max_u);
    status = render(&s, scene, def->nworker, report, caption);
done:
    om_sense_scene_destroy(scene);
    om_banet_sample_done(&s);
    return status;
}

// ---- the page ---------------------------------------------------------------------------------------

static void add_facts(const OmBanetSummary* s, OmReport* report) {
    const char* const label[6] = {"samples",
                                  "through a camera",
                                  "on a board",
                                  "with two regions",
                                  "mm, median of the largest displacement",
                                  "kB a sample"};
    char value[6][32];
    const char* pointer[6];
    snprintf(value[0], sizeof value[0], "%d", s->nsample);
    snprintf(value[1], sizeof value[1], "%d", s->ncamera);
    snprintf(value[2], sizeof value[2], "%d", s->nboard);
    snprintf(value[3], sizeof value[3], "%d", s->ntwo);
    snprintf(value[4], sizeof value[4], "%.1f", 1e3 * s->median_u);
    snprintf(value[5], sizeof value[5], "%.1f", 1e-3 * (double)s->nbyte / s->nsample);
    for (int k = 0; k < 6; ++k) pointer[k] = value[k];
    om_report_facts(report, pointer, label, 6);
}

// What was asked, and what came out.
static void add_verdict(const OmBanetSummary* s, OmReport* report) {
    char text[320];
    snprintf(text, sizeof text, "%d samples are there, each of them in equilibrium.", s->nsample);
    om_report_verdict(report, text, s->nsample > 0);
    snprintf(
        text, sizeof text,
        "Asked: random bodies with random attachments, pulled at one place, from which a network learns to find "
        "attachments. Came out: %d samples from %d draws; %d found no equilibrium and were drawn again.",
        s->nsample, s->nattempt, s->nfail);
    om_report_paragraph(report, text);
}

static void add_histogram(const Histogram* h, double scale, const char* title, const char* unit,
                          OmReport* report) {
    double x[NBIN + 1], y[NBIN + 1];
    for (int k = 0; k <= NBIN; ++k) {
        x[k] = scale * h->edge[k];
        y[k] = h->count[k < NBIN ? k : NBIN - 1];
    }
    OmReportChart chart = {.title = title,
                           .x_label = unit,
                           .y_label = "samples",
                           .nseries = 1,
                           .series = {{"samples", x, y, NBIN + 1, true}}};
    om_report_chart(report, &chart);
}

static void add_settings(const OmBanetDataDef* def, const OmBanetSummary* s, OmReport* report) {
    const OmBanetSampleDef* d = &def->sample;
    char text[900];
    snprintf(
        text, sizeof text,
        "Bodies of %.0f to %.0f mm, %.1f to %.1f mm thick, in voxels of %.2f mm. %.0f to %.0f %% of the surface "
        "is attached. %s tetrahedra, law %s, Young's modulus %g to %g kPa, Poisson's ratio %g to %g. Displacements are "
        "measured the %s way. %d draws, of which %d solves failed and were drawn again. Seed %llu.",
        1e3 * d->extent[0], 1e3 * d->extent[1], 1e3 * d->thickness[0], 1e3 * d->thickness[1],
        1e3 * d->side / OM_BANET_SIDE_CELL, 100 * d->share[0], 100 * d->share[1],
        d->element == OM_TET10 ? "Quadratic" : "Linear", om_law_name(d->law), 1e-3 * d->young[0],
        1e-3 * d->young[1], d->poisson[0], d->poisson[1], om_banet_way_name(d->way), s->nattempt,
        s->nfail, (unsigned long long)d->seed);
    om_report_paragraph(report, text);
}

OmStatus om__banet_write_report(const OmBanetDataDef* def, const OmBanetSummary* s,
                                const OmBanetFacts* fact) {
    char path[1024];
    OmReport report;
    const Histogram u = histogram_of(fact, s->nsample, offsetof(OmBanetFacts, max_u), MAX_BIN_U),
                    share = histogram_of(fact, s->nsample, offsetof(OmBanetFacts, share), 1),
                    visible = histogram_of(fact, s->nsample, offsetof(OmBanetFacts, visible), 1);
    OM_TRY(write_summary(def, s, &u));
    OM_TRY(om_path_join(def->out_dir, "report.html", path, sizeof path));
    om_report_begin(&report, "BA-Net data", def->out_dir);
    add_verdict(s, &report);
    add_facts(s, &report);
    add_settings(def, s, &report);
    add_histogram(&u, 1e3, "Largest displacement of a vertex", "mm", &report);
    add_histogram(&share, 100, "Attached part of the surface", "%", &report);
    add_histogram(&visible, 100, "Seen part of the surface", "%", &report);
    if (def->npicture > 0) {
        om_report_heading(&report, "Samples");
        om_report_paragraph(&report,
                            "Blue: attached. Red: grasped. Grey: not seen. The force points up.");
    }
    OmStatus status = OM_OK;
    for (int k = 0; k < def->npicture && k < s->nsample && status == OM_OK; ++k)
        status = add_picture(def, def->first + k, &report);
    if (status == OM_OK) return om_report_save(&report, path);
    om_report_done(&report);
    return status;
}
