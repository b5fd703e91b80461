// cli_update.c: omentum update: attachments of a twin from what a camera saw.
#include <math.h>
#include <string.h>

#include "cli_common.h"
#include "omentum/banet_update.h"
#include "omentum/match_acquisition.h"
#include "omentum/match_report.h"
#include "omentum/scan_file.h"
#include "omentum/scene_model.h"

enum { MAX_ACQUISITION = 32 };

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder for report.html, update.json and attachments.vtu"},
    {"--data", NULL, "DIR", "folder that the scene's file names are relative to",
     "the scene's folder"},
    {"--layout", NULL, "K", "seed of the scene's attachments and ROI", "the scene's", NULL, 0,
     2147483647},
    {"--network", NULL, "FILE", "weights of BA-Net, or none: physics alone",
     "the weights that come along, if they are installed"},
    {"--example", NULL, NULL, "print a complete acquisition file with every key, and end"},
    {"--workers", NULL, "N", "threads", "one a processor", NULL, 0, OM_MAX_WORKER},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"acquisitions", "that were read"},
    {"used", "of them: those that fit the model at rest, and each other"},
    {"accepted", "1: the twin takes the new attachments; 0: it keeps its attachments"},
    {"seen_share", "of the area that may be attached, below which the clouds show the surface"},
    {"before_median_mm", "distance of the clouds from the twin as believed"},
    {"after_median_mm", "the same with the new attachments"},
    {"network_views", "acquisitions from which the network estimated attachments"},
    {"update_ms", "time of the estimate, without reading and building"},
};

typedef struct Update {
    OmScene scene;
    OmSite site;
    OmMatch* match;
    OmBanetNet* net;       // null: physics alone
    const char* net_name;  // option --network, or null
    OmBanetUpdater* updater;
    OmBanetAdvice advice;
    OmMatchEstimate estimate;
    OmAcquisitionFile file[MAX_ACQUISITION];
    OmAcquisition acquisition[MAX_ACQUISITION];
    OmRegistration registration[MAX_ACQUISITION];
    const char* name[MAX_ACQUISITION];
    OmMatchReport report;
    const char *patient, *out;
    char reason[512];
    int nacquisition, nworker;
    bool is_quiet;
} Update;

// ---- input ------------------------------------------------------------------------------------------

static OmStatus read_patient(const OmCliArgs* args, Update* u) {
    bool is_patient;
    OM_TRY(om_cli_is_patient(u->patient, &is_patient));
    if (is_patient) {
        const char* slash = strrchr(u->patient, '/');
        u->scene = om_scene_default();
        OM_TRY(om_path_dir(u->patient, u->scene.data_root, sizeof u->scene.data_root));
        OM_CHECK(strlen(slash ? slash + 1 : u->patient) < sizeof u->scene.tissue.file, OM_INVALID,
                 "%s: the path is too long", u->patient);
        strcpy(u->scene.tissue.file, slash ? slash + 1 : u->patient);
        u->scene.tissue.source = OM_SOURCE_PATIENT;
        u->scene.attach.kind = OM_ATTACH_SET;
        u->scene.roi.is_random = false;
    } else {
        OM_TRY(om_scene_load(u->patient, &u->scene));
    }
    const char* data = om_cli_get(args, "--data");
    if (data) {
        OM_CHECK(strlen(data) < sizeof u->scene.data_root, OM_INVALID,
                 "option --data: path too long");
        strcpy(u->scene.data_root, data);
    }
    return om_cli_int(args, "--layout", &u->scene.seed);
}

static OmStatus read_acquisitions(Update* u) {
    for (int k = 0; k < u->nacquisition; ++k) {
        OM_TRY(om_acquisition_load(u->name[k], &u->site, &u->file[k], &u->acquisition[k]));
        OM_CHECK(u->acquisition[k].ngrasp > 0, OM_INVALID,
                 "%s: tools: no tool holds the tissue; an update needs a grasp", u->name[k]);
    }
    return OM_OK;
}

// ---- stages -----------------------------------------------------------------------------------------

#define REACH 0.1  // m, largest gap between the boxes of a cloud and of the model at rest

// A cloud of another unit or place is an error of the files.
static OmStatus check_clouds(const Update* u) {
    for (int k = 0; k < u->nacquisition; ++k) {
        double reach = u->file[k].registered == OM_REGISTERED_YES ? REACH : HUGE_VAL;
        OmStatus status = om_scan_check_model(&u->acquisition[k].scan,
                                              om_match_view(u->match)->surface, reach, NULL);
        if (status < 0) return om_error_prefix(status, "%s", u->name[k]);
    }
    return OM_OK;
}

// Bring the acquisitions into the frame of the model. Where this fails, `reason` says why.
static OmStatus register_all(Update* u) {
    const OmMatchView* view = om_match_view(u->match);
    u->report.registration = u->registration;
    for (int k = 0; k < u->nacquisition; ++k) {
        if (u->file[k].registered == OM_REGISTERED_YES) continue;
        OmRegisterDef def = om_register_default_def();
        def.has_start = u->file[k].registered == OM_REGISTERED_ROUGHLY;
        def.nworker = u->nworker;
        OmRegistration* r = &u->registration[k];
        OM_TRY(om_scan_register(&def, view->surface, &u->acquisition[k].scan, r));
        u->report.register_ms += r->ms;
        if (!r->is_reliable && !u->reason[0])
            snprintf(u->reason, sizeof u->reason, "%s cannot be registered: %s", u->name[k],
                     r->reason);
        om_acquisition_move(&u->acquisition[k], r->pose_model_scan);
    }
    return OM_OK;
}

static OmStatus build(Update* u, const OmProgress* progress) {
    OM_TRY(om_site_build(&u->scene, OM_SITE_TWIN, progress, &u->site));
    OmMatchDef def = om_match_default_def(&u->scene, &u->site);
    def.nworker = u->nworker > 0 ? u->nworker : om_worker_count(0);
    OM_TRY(om_match_create(&def, &u->match));
    OmBanetUpdateDef banet = om_banet_update_default_def(u->match);
    banet.net = u->net;
    banet.is_corrected = true;
    banet.nworker = def.nworker;
    return om_banet_updater_create(&banet, &u->updater);
}

static OmStatus compute(Update* u, const OmProgress* progress) {
    OmMatchReport* r = &u->report;
    double begin = om_clock_now();
    OM_TRY(om_banet_net_find(u->net_name, NULL, &u->net));
    OM_TRY(build(u, progress));
    r->build_ms = 1e3 * (om_clock_now() - begin);
    begin = om_clock_now();
    OM_TRY(read_acquisitions(u));
    r->load_ms = 1e3 * (om_clock_now() - begin);
    r->title = u->patient;
    r->site = &u->site;
    r->match = u->match;
    r->nacquisition = u->nacquisition;
    r->acquisition = u->acquisition;
    r->name = u->name;
    r->reason = u->reason;
    OM_TRY(check_clouds(u));
    OM_TRY(register_all(u));
    if (u->reason[0]) return OM_OK;
    OM_TRY(om_banet_update(u->updater, u->nacquisition, u->acquisition, progress, &u->estimate,
                           &u->advice));
    if (u->net) u->estimate.total_ms = u->advice.total_ms;  // with correspondence and network
    r->estimate = &u->estimate;
    return OM_OK;
}

// ---- output -----------------------------------------------------------------------------------------

static OmStatus write_files(const OmMatchReport* r, const char* dir) {
    char path[1200];
    OM_TRY(om_path_join(dir, "update.json", path, sizeof path));
    OM_TRY(om_match_report_save_json(r, path));
    OM_TRY(om_path_join(dir, "report.html", path, sizeof path));
    OM_TRY(om_match_report_save(r, path));
    if (!r->estimate) return OM_OK;
    OM_TRY(om_path_join(dir, "attachments.vtu", path, sizeof path));
    return om_match_report_save_mesh(r, path);
}

static OmStatus write_folder(const Update* u) {
    OmFolder folder;
    OM_TRY(om_folder_begin(u->out, "update of a twin", &folder));
    OmStatus status = write_files(&u->report, folder.path);
    if (status == OM_OK) status = om_folder_commit(&folder);
    om_folder_end(&folder);
    return status;
}

// Acquisitions that were left out or corrected.
static void print_verdicts(const Update* u) {
    const OmMatchEstimate* e = u->report.estimate;
    int nused = 0;
    for (int k = 0; e && e->verdict && k < u->nacquisition; ++k) {
        const OmMatchVerdict* v = &e->verdict[k];
        nused += v->is_good;
        if (v->reason[0])
            printf("  %s: %s%s\n", u->name[k], v->is_good ? "" : "left out: ", v->reason);
    }
    om_cli_figure("used", nused);
}

static void print_network(const Update* u) {
    static const char* const choice[] = {"network and physics", "physics alone",
                                         "the attachments before", "the network alone"};
    const OmMatchEstimate* e = u->report.estimate;
    int k = e && u->advice.nused > 0 ? e->choice : 1;  // without a view the network says nothing
    om_cli_figure("network_views", u->advice.nused);
    if (!u->net)
        printf("  network: none%s\n", u->net_name ? "" : " installed; physics alone");
    else
        printf("  network: %d of %d acquisitions; the attachments are those of %s%s%s\n",
               u->advice.nused, u->nacquisition,
               k < 4 ? choice[k] : "the network, with another threshold",
               u->advice.reason[0] ? "; " : "", u->advice.reason);
}

static void print_result(const Update* u) {
    const OmMatchReport* r = &u->report;
    const OmMatchEstimate* e = r->estimate;
    bool is_good = om_match_report_is_accepted(r);
    if (is_good)
        printf("%s: the twin takes the new attachments\n", u->patient);
    else
        printf("%s: the twin keeps its attachments: %s\n", u->patient, om_match_report_reason(r));
    om_cli_figure("acquisitions", u->nacquisition);
    om_cli_figure("accepted", is_good);
    om_cli_reason(om_match_report_reason(r));
    om_cli_path(u->out);
    if (e && e->before_median > 0) {
        printf(
            "  cloud to twin: median %.2f mm before, %.2f mm after; 90 %% %.1f mm before, %.1f mm after\n"
            "  the surface above %.0f %% of the candidates is seen\n",
            1e3 * e->before_median, 1e3 * e->after_median, 1e3 * e->before_p90, 1e3 * e->after_p90,
            100 * e->seen_share);
        if (e->has_look_next)
            printf("  where to look or grasp next: (%.0f, %.0f, %.0f) mm\n", 1e3 * e->look_next.x,
                   1e3 * e->look_next.y, 1e3 * e->look_next.z);
        om_cli_figure("seen_share", e->seen_share);
        om_cli_figure("before_median_mm", 1e3 * e->before_median);
        om_cli_figure("after_median_mm", 1e3 * e->after_median);
        om_cli_figure("update_ms", e->total_ms);
    }
    print_verdicts(u);
    print_network(u);
    printf("  time: read %.0f ms, build the twin %.0f ms, register %.0f ms, update %.0f ms\n",
           r->load_ms, r->build_ms, r->register_ms, e ? e->total_ms : 0);
    printf("  report: %s/report.html\n", u->out);
}

static int run(Update* u) {
    const OmProgress* progress = om_cli_progress(u->is_quiet);
    OmStatus status = om_folder_check(u->out, "update of a twin");
    // a fit of a fine mesh takes seconds, and there are no files yet
    om_cli_set_end("omentum update: cancelled; nothing was written\n", 0);
    if (status >= 0) status = compute(u, progress);
    om_cli_set_end(NULL, 0);
    if (status >= 0) status = write_folder(u);
    if (status < 0) return om_cli_fail("update", status);
    om_cli_progress_done();
    print_result(u);
    return om_match_report_is_accepted(&u->report) ? OM_EXIT_OK : OM_EXIT_FAILED;
}

static void update_done(Update* u) {
    om_match_estimate_done(&u->estimate);
    om_banet_advice_done(&u->advice);
    om_banet_updater_destroy(u->updater);
    om_banet_net_destroy(u->net);
    om_match_destroy(u->match);
    om_site_done(&u->site);
    for (int k = 0; k < u->nacquisition; ++k) om_acquisition_done(&u->acquisition[k]);
    om_free(u);
}

// ---- command line -----------------------------------------------------------------------------------

static OmStatus read_options(const OmCliArgs* args, Update* u) {
    int npositional;
    OM_TRY(om_cli_check(args, 1 + MAX_ACQUISITION, &npositional));
    if (om_cli_get(args, "--example")) return OM_OK;
    OM_CHECK(npositional >= 2, OM_INVALID,
             "a patient model or scene and at least one acquisition are needed; see omentum update "
             "--help");
    u->patient = om_cli_positional(args, 0);
    u->nacquisition = npositional - 1;
    for (int k = 0; k < u->nacquisition; ++k) u->name[k] = om_cli_positional(args, k + 1);
    u->out = om_cli_get(args, "--output");
    u->net_name = om_cli_get(args, "--network");
    u->is_quiet = om_cli_get(args, "--quiet") != NULL;
    OM_CHECK(u->out, OM_INVALID, "no output folder is given; add -o DIR");
    return om_cli_int(args, "--workers", &u->nworker);
}

static int print_example(void) {
    OmText text = {0};
    OmStatus status = om_acquisition_print_example(&text);
    if (status == OM_OK) fputs(text.str, stdout);
    om_text_done(&text);
    return status < 0 ? om_cli_fail("update", status) : OM_EXIT_OK;
}

int om_cli_update(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    Update* u = om_calloc(1, sizeof *u);
    if (!u) return om_cli_fail("update", OM_NO_MEMORY);
    int code = OM_EXIT_USAGE;
    if (read_options(&args, u) < 0) {
        fprintf(stderr, "omentum update: %s\n", om_error_message());
    } else if (om_cli_get(&args, "--example")) {
        code = print_example();
    } else {
        const char* input[1 + MAX_ACQUISITION] = {u->patient};
        for (int k = 0; k < u->nacquisition; ++k) input[k + 1] = u->name[k];
        OmStatus status = om_cli_check_apart(u->out, input, 1 + u->nacquisition);
        if (status >= 0) status = read_patient(&args, u);
        code = status < 0 ? om_cli_fail("update", status) : run(u);
    }
    update_done(u);
    return code;
}

const OmCliVerb om_cli_verb_update = {
    .name = "update",
    .run = om_cli_update,
    .summary = "correct the attachments of a twin by what a camera saw",
    .usage = "omentum update PATIENT.yaml ACQUISITION.yaml... -o DIR [options]",
    .about =
        "PATIENT is a patient model (omentum model) or a scene. An acquisition is one moment while a tool\n"
        "holds tissue: the cloud of a depth camera or a frame of a series of pictures, and the poses of the\n"
        "tools when their jaws closed and now. Estimates which vertices of the twin are attached.\n"
        "Each acquisition is judged by itself, best where it names a cloud or frame of the tissue at rest: a\n"
        "small error of the camera is corrected, a larger one is named (turned, focal length, unit, axes, ...).\n"
        "By network and physics, or by physics alone where no weights are installed. Writes\n"
        "report.html (clouds over the model, attachments before and after, where to look next, times),\n"
        "update.json and attachments.vtu (probability, uncertainty, stiffness, displacement). DIR must be new,\n"
        "empty, or hold an older update. Exit code 0: the twin takes the new attachments; 1:\n"
        "it keeps its attachments, with the reason.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum update --example > lift.yaml\n"
        "  omentum update out/kidney/patient.yaml lift.yaml -o out/update\n"
        "  omentum update scenes/sheet.yaml lift-1.yaml lift-2.yaml lift-3.yaml -o out/update",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
