// cli_demo.c: omentum demo: from a CT made here to an exposed tumour, with a robot that is wrong at first.
//
// The stages are those of a user's own case, and each writes what the verb of that stage writes: ct.nrrd, labels.nrrd
// (om_ct_make, om_ct_label), model/ (omentum model --over), scene.yaml, plan/ (omentum preplan), run/ (omentum retract
// --defras --plan). The tissue is held along its left side; the robot believes that it is held on the side away from
// the endoscope. Nothing is arranged beyond anatomy, belief and seeds: if no warning comes up, the page says so.
#include <math.h>
#include <string.h>

#include "cli_common.h"
#include "omentum/report.h"
#include "omentum/retract.h"
#include "omentum/scene_ct.h"
#include "omentum/scene_model.h"

// Of a run's folder: a demo of an older version held one.
#define FOLDER_KIND "retraction run"
#define SEED 5
// Coarse, for a plan in seconds: the mesh is 3 % smaller than the fat, whose corners it cuts off (allow_loss).
// Without a loss edges of 8 mm make 2,500 tetrahedra, and the demo takes ten minutes.
#define EDGE 10e-3  // m
#define FAT 11e-3   // m, thickness
#define ORBIT 30    // pictures
#define ATTACHED "underside:left 25 %"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder for the report", "omentum-demo"},
    {"--quick", NULL, NULL, "fewer grasping points, smaller pictures"},
    {"--workers", NULL, "N", "threads", "one a processor", NULL, 0, OM_MAX_WORKER},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"dice_fat", "of the labels found, against those that the CT was made from"},
    {"dice_organ", "the same"},
    {"dice_tumour", "the same"},
    {"tetrahedra", "of the twin"},
    {"plan_visibility", "visible fraction of the ROI that the plan before expects, 0 to 1"},
    {"visibility_start", "visible fraction of the ROI, 0 to 1"},
    {"visibility_end", "the same, at the end"},
    {"visibility_truth_end", "the same, in the truth"},
    {"actions", "carried out"},
    {"operation_s", "simulated time"},
    {"wall_s", "time it took, all stages"},
    {"force_twin_n", "largest force estimated by the twin"},
    {"force_truth_n", "largest force in the truth"},
    {"warnings", "times that the warning state rose to 1 or above"},
    {"mu_max_mm", "largest discrepancy of the twin, while tissue was held"},
    {"updates_adopted", "estimates that the twin adopted"},
};

typedef struct Demo {
    const char* out;
    char trials[1200];  // file of the trials of its plan
    bool is_quick, is_quiet;
    int nworker;
    OmFolder folder;
    OmCtDef ct_def;
    OmVolume ct, truth, labels;
    double dice[OM_CT_NLABEL];
    OmPatient patient;
    OmModelReport model;
    OmScene scene;
    OmPreplan plan;
    OmRetractResult run;
    double begin;
} Demo;

// ---- the stages -------------------------------------------------------------------------------------------------

static OmStatus make_path(const Demo* d, const char* name, char* path, size_t size) {
    return om_path_join(d->folder.path, name, path, size);
}

static OmStatus make_volume(Demo* d) {
    char path[1200];
    d->ct_def = om_ct_default_def(SEED);
    d->ct_def.organ_half = 0.058;
    d->ct_def.organ_lobes = 0.2;
    d->ct_def.fat_half = 0.032;
    d->ct_def.fat_exponent = 4;
    d->ct_def.fat_thickness = FAT;
    OM_TRY(om_progress_report(om_cli_progress(d->is_quiet), "CT", 0, 1));
    OM_TRY(om_ct_make(&d->ct_def, &d->ct, &d->truth));
    OM_TRY(om_ct_label(&d->ct, &d->labels));
    for (int l = 0; l < OM_CT_NLABEL; ++l) d->dice[l] = om_ct_get_dice(&d->labels, &d->truth, l);
    OM_TRY(make_path(d, "ct.nrrd", path, sizeof path));
    OM_TRY(om_volume_save(&d->ct, OM_VOXEL_I16, path));
    OM_TRY(make_path(d, "labels.nrrd", path, sizeof path));
    return om_volume_save(&d->labels, OM_VOXEL_U8, path);
}

static OmStatus make_model(Demo* d) {
    char path[1200];
    OmModelDef def = om_model_default_def("labels.nrrd", EDGE);
    def.refine = false;
    def.allow_loss = true;
    def.label[def.nlabel++] = OM_CT_FAT;
    def.over.label[def.over.nlabel++] = OM_CT_ORGAN;
    def.over.label[def.over.nlabel++] = OM_CT_TUMOUR;
    def.over.roi = OM_CT_TUMOUR;
    def.over.reach = 3.5e-3;  // blur makes the label of the tumour too small
    def.nworker = d->nworker;
    OM_TRY(om_model_parse_attach(ATTACHED, &def.over.attach[def.over.nattach++]));
    OM_TRY(om_model_build_volume(&def, &d->labels, om_cli_progress(d->is_quiet), &d->patient,
                                 &d->model));
    OM_TRY(make_path(d, "model", path, sizeof path));
    return om_patient_save(&d->patient, &d->model, path);
}

// The scene is written as a user would keep it: its files are relative to its folder.
static OmStatus make_scene(Demo* d) {
    OmScene* s = &d->scene;
    char path[1200];
    OmText text = {0};
    *s = om_scene_default();
    snprintf(s->name, sizeof s->name, "demo");
    s->seed = SEED;
    s->tissue.source = OM_SOURCE_PATIENT;
    snprintf(s->tissue.file, sizeof s->tissue.file, "model/patient.yaml");
    s->tissue.view = om_vec3(0, 0, -1);
    s->attach.kind = OM_ATTACH_SET;
    s->organ.deforms = OM_IN_TRUTH;
    s->endoscope.distance = 0.14;
    s->believed.kind = OM_BELIEF_BOX;
    s->believed.lo = om_vec3(0.012, -0.1, -0.1);  // the side away from the endoscope
    s->believed.hi = om_vec3(0.1, 0.1, 0.1);
    s->task.grasp_radius = 7e-3;
    s->task.grid = 4;
    s->monitor.is_enabled = s->update.is_enabled = true;
    snprintf(s->update.network, sizeof s->update.network, "installed");
    if (d->is_quick) {
        s->task.grid = 3;
        s->endoscope.width = 320;
        s->endoscope.height = 240;
    }
    OM_TRY(make_path(d, "scene.yaml", path, sizeof path));
    OmStatus status = om_scene_print(s, false, &text);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    om_text_done(&text);
    return status == OM_OK ? om_scene_load(path, s) : status;
}

static OmStatus plan_before(Demo* d) {
    char path[1200];
    OmPreplanDef def = om_preplan_default_def(&d->scene);
    def.nworker = d->nworker;
    def.trials = d->trials;
    OM_TRY(om_cli_trials_path(d->out, d->trials, sizeof d->trials));
    OM_TRY(om_preplan_run(&def, om_cli_progress(d->is_quiet), &d->plan));
    OM_TRY(make_path(d, "plan.json", path, sizeof path));
    return om_preplan_save(&d->plan, path);
}

static OmStatus operate(Demo* d) {
    char path[1200];
    OmRetractDef def = om_retract_default_def(&d->scene);
    OM_TRY(make_path(d, "run", path, sizeof path));
    def.out_dir = path;
    def.nworker = d->nworker;
    def.preplan = &d->plan;
    def.orbit = d->is_quick ? ORBIT / 2 : ORBIT;
    return om_retract_run(&def, om_cli_progress(d->is_quiet), &d->run);
}

// ---- the page ---------------------------------------------------------------------------------------------------

#define ZOOM 4                // pixels of a voxel
#define MAX_ORBIT (16 << 20)  // bytes

// The slice of the volume through the tumour's middle, seen from below, anterior up; `labels` null: grey.
static OmStatus draw_slice(const Demo* d, const OmVolume* labels, OmPicture* picture) {
    static const unsigned char tint[OM_CT_NLABEL][3] = {
        {0, 0, 0}, {240, 200, 60}, {190, 70, 60}, {220, 40, 200}};
    const int* dim = d->ct.grid.dim;
    const int k = (int)lround((d->ct_def.tumour_shift[1] - d->ct.grid.origin.z) / d->ct_def.voxel);
    OM_TRY(om_picture_init(picture, dim[0] * ZOOM, dim[1] * ZOOM, 3));
    for (int y = 0; y < picture->height; ++y) {
        for (int x = 0; x < picture->width; ++x) {
            size_t n = om_grid_index(dim, x / ZOOM, dim[1] - 1 - y / ZOOM, k);
            // -250 to 200 HU
            double grey = fmax(0, fmin(1, (om_volume_value(&d->ct, n) + 250) / 450));
            int label = labels ? (int)om_volume_value(labels, n) : 0;
            unsigned char* pixel =
                &picture->pixel[3 * ((size_t)y * (size_t)picture->width + (size_t)x)];
            for (int c = 0; c < 3; ++c)
                pixel[c] =
                    (unsigned char)(label ? 0.45 * 255 * grey + 0.55 * tint[label][c] : 255 * grey);
        }
    }
    return OM_OK;
}

static OmStatus add_slices(OmReport* page, const Demo* d) {
    static const char* const caption[2] = {
        "A slice through the tumour, anterior up: gas black, fat dark, organ light, tumour bright",
        "The same with the labels found: fat yellow, organ red, tumour magenta"};
    for (int k = 0; k < 2; ++k) {
        OmPicture picture;
        OM_TRY(draw_slice(d, k ? &d->labels : NULL, &picture));
        om_report_picture(page, &picture, caption[k]);
        om_picture_done(&picture);
    }
    return OM_OK;
}

// A picture of the run, if it wrote one of this name.
static OmStatus add_file(OmReport* page, const Demo* d, const char* name, const char* caption) {
    char path[1200];
    OmPicture picture;
    OM_TRY(make_path(d, name, path, sizeof path));
    if (!om_path_exists(path)) return OM_OK;
    OM_TRY(om_picture_load_png(path, &picture));
    om_report_picture(page, &picture, caption);
    om_picture_done(&picture);
    return OM_OK;
}

// The end of the run from all sides.
static OmStatus add_orbit(OmReport* page, const Demo* d) {
    char path[1200];
    char* png;
    size_t size;
    OM_TRY(make_path(d, "run/orbit.png", path, sizeof path));
    if (!om_path_exists(path)) return OM_OK;
    OM_TRY(om_file_read(path, MAX_ORBIT, &png, &size));
    om_report_png(page, png, size,
                  "The end of the operation: fat yellow, organ red, tumour magenta");
    om_free(png);
    return OM_OK;
}

static OmStatus add_charts(OmReport* page, const Demo* d) {
    const OmRetractResult* r = &d->run;
    const OmSceneMonitor* m = &d->scene.monitor;
    OmStatus status = OM_OK;
    double *t = NULL, *y[4] = {NULL, NULL, NULL, NULL}, *event = NULL;
    const int n = r->nsample;
    int nevent = 0;
    OM_ALLOC_DONE(t, n + 1);
    OM_ALLOC_DONE(event, r->belief.nupdate + 1);
    for (int k = 0; k < 4; ++k) OM_ALLOC_DONE(y[k], n + 1);
    for (int i = 0; i < n; ++i) {
        t[i] = r->sample[i].time;
        y[0][i] = 1e3 * r->sample[i].mu;
        y[1][i] = r->sample[i].warning;
        y[2][i] = 100 * r->sample[i].visibility;
        y[3][i] = 100 * r->sample[i].visibility_world;
    }
    for (int i = 0; i < r->belief.nupdate; ++i)
        if (r->belief.update[i].stage == OM_UPDATE_ADOPTED)
            event[nevent++] = r->belief.update[i].end;
    OmReportChart chart = {.title = "Distance of the tissue from the twin (mu), and warning state",
                           .x_label = "time, s; vertical lines: the twin adopts new attachments",
                           .y_label = "mm; state 0 to 3",
                           .nseries = 2,
                           .series = {{"mu, mm", t, y[0], n}, {"warning state", t, y[1], n, true}},
                           .has_limit = true,
                           .limit = 1e3 * m->limit[0],
                           .limit_name = "state 1 above",
                           .limit2 = 1e3 * m->limit[1],
                           .limit2_name = "state 2 above",
                           .has_range = true,
                           .y_max = 1e3 * m->limit[1],
                           .event = event,
                           .nevent = nevent};
    om_report_chart(page, &chart);
    OmReportChart seen = {.title = "Visible part of the tumour",
                          .x_label = chart.x_label,
                          .y_label = "%",
                          .nseries = 2,
                          .series = {{"in the endoscope's picture", t, y[2], n},
                                     {"in the simulated truth", t, y[3], n}},
                          .has_limit = true,
                          .limit = 100 * d->scene.task.visibility,
                          .limit_name = "exposed",
                          .has_range = true,
                          .y_max = 100,
                          .event = event,
                          .nevent = nevent};
    om_report_chart(page, &seen);
done:
    om_free(t);
    om_free(event);
    for (int k = 0; k < 4; ++k) om_free(y[k]);
    return status;
}

static int count_adopted(const OmRetractResult* r) {
    int n = 0;
    for (int i = 0; i < r->belief.nupdate; ++i) n += r->belief.update[i].stage == OM_UPDATE_ADOPTED;
    return n;
}

// Four frames of the run: the first, the last, and two between.
static OmStatus add_frames(OmReport* page, const Demo* d) {
    int nframe = 0;
    char name[64], path[1200];
    for (; nframe < 1000; ++nframe) {
        snprintf(name, sizeof name, "run/frames/%03d.png", nframe);
        OM_TRY(make_path(d, name, path, sizeof path));
        if (!om_path_exists(path)) break;
    }
    for (int k = 0; k < 4 && k < nframe; ++k) {
        char caption[64];
        int at = nframe < 4 ? k : k * (nframe - 1) / 3;
        snprintf(name, sizeof name, "run/frames/%03d.png", at);
        snprintf(caption, sizeof caption, "Picture %d of %d", at + 1, nframe);
        OM_TRY(add_file(page, d, name, caption));
    }
    return OM_OK;
}

static OmStatus add_run(OmReport* page, const Demo* d) {
    const OmRetractResult* r = &d->run;
    char text[512];
    om_report_heading(page, "4. The operation");
    om_report_paragraph(page, r->reason);
    if (d->plan.chosen >= 0 && r->naction > 0 && r->action[0].block != d->plan.chosen)
        om_report_paragraph(page, "The robot did not follow the plan before: run/report.html says "
                                  "why, with the reasons for each later plan.");
    OM_TRY(add_frames(page, d));
    om_report_heading(page, "5. Warning and update");
    if (r->belief.nwarning[0] > 0)
        snprintf(
            text, sizeof text,
            "The depth camera saw the tissue up to %.1f mm from where the twin expected it. The "
            "warning state rose to 1 or above %d times, to 2 %d times, to 3 %d times. The twin "
            "adopted %d new estimates of its attachments.",
            1e3 * r->belief.mu_max, r->belief.nwarning[0], r->belief.nwarning[1],
            r->belief.nwarning[2], count_adopted(r));
    else
        snprintf(
            text, sizeof text,
            "No warning came up: the depth camera saw the tissue at most %.1f mm from where the "
            "twin expected it. The twin adopted %d new estimates of its attachments.",
            1e3 * r->belief.mu_max, count_adopted(r));
    om_report_paragraph(page, text);
    if (r->belief.nupdate > 0 && isfinite(r->belief.update[0].part_before)) {
        snprintf(
            text, sizeof text,
            "The first update came after %.1f s: a part of the tissue was %.1f mm from where the "
            "twin expected it, while most of it lay still.",
            r->belief.update[0].start, 1e3 * r->belief.update[0].part_before);
        om_report_paragraph(page, text);
    }
    OM_TRY(add_charts(page, d));
    OM_TRY(add_file(page, d, "run/attached_before.png",
                    "What the robot believed before: attached where blue, seen from below"));
    OM_TRY(add_file(page, d, "run/attached_after.png", "What it believed at the end"));
    return add_file(page, d, "run/attached_truth.png", "The truth, which the robot never sees");
}

static OmStatus add_stages(OmReport* page, const Demo* d) {
    char text[1024];
    om_report_heading(page, "1. The CT and its labels");
    snprintf(text, sizeof text,
             "A CT of %d x %d x %d voxels of %.1f mm was made here: fat over an organ, a tumour "
             "between, blur and noise of %.0f HU. Thresholds label it. Dice coefficients against "
             "the labels it was made from: fat %.3f, organ %.3f, tumour %.3f (1 is perfect).",
             d->ct.grid.dim[0], d->ct.grid.dim[1], d->ct.grid.dim[2], 1e3 * d->ct_def.voxel,
             d->ct_def.noise, d->dice[OM_CT_FAT], d->dice[OM_CT_ORGAN], d->dice[OM_CT_TUMOUR]);
    om_report_paragraph(page, text);
    OM_TRY(add_slices(page, d));
    om_report_heading(page, "2. The patient model");
    snprintf(
        text, sizeof text,
        "The fat became %d tetrahedra (smallest dihedral angle %.0f degrees, volume %+.1f %% of "
        "the label), the organ a surface below it, the tumour the region to expose (ROI). The "
        "fat is held at %d vertices where it meets the organ, along its left side.",
        d->model.quality.ntet, d->model.quality.dihedral_min * 180 / OM_PI,
        100 * d->model.label_error, om_tet_mesh_find_set(&d->patient.mesh, "attachment")->nvert);
    om_report_paragraph(page, text);
    OM_TRY(om_patient_add_pictures(&d->patient, page));
    om_report_heading(page, "3. The plan before the operation");
    snprintf(
        text, sizeof text,
        "A CT does not show where fat is attached. The robot believes that it is held on the side away "
        "from the endoscope, which is wrong. With this belief it tried %d grasping points in its "
        "simulation, the twin, and found: %s.",
        d->plan.ntried, d->plan.reason);
    om_report_paragraph(page, text);
    OM_TRY(om_preplan_add_maps(&d->plan, page));
    return add_run(page, d);
}

static OmStatus write_page(const Demo* d) {
    OmReport page;
    char path[1200], text[256];
    OM_TRY(make_path(d, "report.html", path, sizeof path));
    om_report_begin(&page, "From a CT to an exposed tumour", "omentum demo");
    om_report_verdict(&page, d->run.reason, d->run.is_exposed);
    char asked[512];
    snprintf(
        asked, sizeof asked,
        "Asked: at least %.0f %% of the tumour in view, and at most %.2f N on the fat, by a robot that "
        "believes the fat to be held on the wrong side. Came out: %.0f %% in the endoscope's picture, %.0f "
        "%% in truth, and at most %.2f N.",
        100 * d->scene.task.visibility, d->scene.task.force_threshold, 100 * d->run.visibility_end,
        100 * d->run.truth.visibility, d->run.truth.force);
    om_report_paragraph(&page, asked);
    static const char* const name[] = {"watch the operation in three dimensions",
                                       "the operation, action by action", "the patient model"};
    static const char* const href[] = {"run/view.html", "run/report.html", "model/report.html"};
    om_report_links(&page, "Pages of their own: ", name, href, 3);
    OmStatus status = add_orbit(&page, d);
    if (status == OM_OK) status = add_stages(&page, d);
    om_report_heading(&page, "Files");
    snprintf(text, sizeof text,
             "The folder holds the result of every stage: ct.nrrd, labels.nrrd, model/report.html, "
             "plan.json, run/report.html, run/run.vtkhdf for ParaView, and scene.yaml. `omentum "
             "retract scene.yaml --defras -o again` runs it again.");
    om_report_paragraph(&page, text);
    if (status == OM_OK) return om_report_save(&page, path);
    om_report_done(&page);
    return status;
}

// ---- the verb ---------------------------------------------------------------------------------------------------

static void print_result(const Demo* d) {
    const OmRetractResult* r = &d->run;
    double wall = om_clock_now() - d->begin;
    printf(
        "CT: %d x %d x %d voxels; labels by thresholds, Dice: fat %.3f, organ %.3f, tumour %.3f\n",
        d->ct.grid.dim[0], d->ct.grid.dim[1], d->ct.grid.dim[2], d->dice[OM_CT_FAT],
        d->dice[OM_CT_ORGAN], d->dice[OM_CT_TUMOUR]);
    printf(
        "model: %d tetrahedra, %+.1f %% of the label's volume, held at %d vertices on the left; the robot believes on "
        "the far side; %.2g mL of the rim left out, as the mesh is coarse\n",
        r->twin.ntet, 100 * d->model.label_error,
        om_tet_mesh_find_set(&d->patient.mesh, "attachment")->nvert, d->model.fit.lost * 1e6);
    printf("plan before the operation: %s\n", d->plan.reason);
    printf("demo: %s\n", r->reason);
    printf("  ROI visible: %.0f %% at the start, %.0f %% at the end (in the truth %.0f %%)\n",
           100 * r->visibility_start, 100 * r->visibility_end, 100 * r->truth.visibility);
    printf("  pull: at most %.2f N by the twin, %.2f N in the truth\n", r->twin.force,
           r->truth.force);
    printf("  twin: at most %.1f mm from the tissue; warning state 1 reached %d times, 2 %d times; "
           "%d estimates of the attachments adopted\n",
           1e3 * r->belief.mu_max, r->belief.nwarning[0], r->belief.nwarning[1], count_adopted(r));
    printf("  %.0f s; report: %s/report.html; the run in three dimensions: %s/run/view.html\n",
           wall, d->out, d->out);
    om_cli_figure("dice_fat", d->dice[OM_CT_FAT]);
    om_cli_figure("dice_organ", d->dice[OM_CT_ORGAN]);
    om_cli_figure("dice_tumour", d->dice[OM_CT_TUMOUR]);
    om_cli_figure("tetrahedra", r->twin.ntet);
    om_cli_figure("plan_visibility",
                  d->plan.chosen >= 0 ? d->plan.point[d->plan.chosen].visibility : 0);
    om_cli_figure("visibility_start", r->visibility_start);
    om_cli_figure("visibility_end", r->visibility_end);
    om_cli_figure("visibility_truth_end", r->truth.visibility);
    om_cli_figure("actions", r->naction);
    om_cli_figure("operation_s", r->time);
    om_cli_figure("wall_s", wall);
    om_cli_figure("force_twin_n", r->twin.force);
    om_cli_figure("force_truth_n", r->truth.force);
    om_cli_figure("warnings", r->belief.nwarning[0]);
    om_cli_figure("mu_max_mm", 1e3 * r->belief.mu_max);
    om_cli_figure("updates_adopted", count_adopted(r));
    om_cli_reason(r->reason);
    om_cli_path(d->out);
}

static OmStatus run_stages(Demo* d) {
    OM_TRY(om_folder_begin(d->out, FOLDER_KIND, &d->folder));
    OM_TRY(make_volume(d));
    OM_TRY(make_model(d));
    OM_TRY(make_scene(d));
    OM_TRY(plan_before(d));
    OmStatus status = operate(d);
    if (status == OM_CANCELLED) {
        OM_TRY(om_folder_commit_beside(&d->folder));
        return om_error(OM_CANCELLED, "cancelled; the record so far is in %s", d->folder.place);
    }
    OM_TRY(status);
    OM_TRY(write_page(d));
    return om_folder_commit(&d->folder);
}

static void demo_done(Demo* d) {
    om_folder_end(&d->folder);
    om_volume_done(&d->ct);
    om_volume_done(&d->truth);
    om_volume_done(&d->labels);
    om_patient_done(&d->patient);
    om_retract_result_done(&d->run);
    om_free(d);
}

int om_cli_demo(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional, nworker = 0;
    if (om_cli_check(&args, 0, &npositional) < 0 || om_cli_int(&args, "--workers", &nworker) < 0)
        return om_cli_usage("demo");
    Demo* d = om_calloc(1, sizeof *d);
    if (!d) return om_cli_fail("demo", OM_NO_MEMORY);
    d->folder.lock = -1;
    d->nworker = nworker;
    d->begin = om_clock_now();
    d->out = om_cli_get(&args, "--output");
    if (!d->out) d->out = "omentum-demo";
    d->is_quick = om_cli_get(&args, "--quick") != NULL;
    d->is_quiet = om_cli_get(&args, "--quiet") != NULL;
    OmStatus status = run_stages(d);
    int code = d->run.is_exposed ? OM_EXIT_OK : OM_EXIT_FAILED;
    if (status < 0) {
        code = om_cli_fail_trials("demo", status, d->trials);
    } else {
        (void)om_path_remove(d->trials);
        om_cli_progress_done();
        print_result(d);
    }
    demo_done(d);
    return code;
}

const OmCliVerb om_cli_verb_demo = {
    .name = "demo",
    .run = om_cli_demo,
    .summary = "from a CT made here to an exposed tumour; needs no file",
    .usage = "omentum demo [-o DIR] [--quick]",
    .about =
        "Makes a CT of fat over an organ and labels it, builds the patient model, plans before the\n"
        "operation with wrong attachments, and operates. A depth camera watches; where the tissue is not\n"
        "as believed, the robot learns its attachments. Exit code 0: exposed; 1: not exposed.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum demo --quick -o out/demo",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
