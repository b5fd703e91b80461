// cli_retract.c: omentum retract and omentum demo.
#include <string.h>

#include "cli_common.h"
#include "omentum/defras.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder for report.html, run.json, run.vtkhdf and frames"},
    {"--data", NULL, "DIR",
     "folder the scene's files are relative to (default: the scene's folder)"},
    {"--layout", NULL, "K", "seed of attachments and ROI (default: the scene's)"},
    {"--program", NULL, "FILE", "a logic program in place of the built-in one"},
    {"--force-threshold", NULL, "N", "epsilon of Alg. 4, in newtons (default: the scene's)"},
    {"--calibrate-force", NULL, NULL,
     "measure the scene's force threshold instead of running it (6.5.1)"},
    {"--layouts", NULL, "N", "layouts of the calibration (default 17)"},
    {"--workers", NULL, "N", "threads (default: one a processor)"},
    {"--quiet", "-q", NULL, "no progress"},
    {"--help", "-h", NULL, "this text"},
};

static void print_help(const OmCliArgs* args) {
    printf(
        "omentum retract: run a scene until the region of interest (ROI) is exposed\n\n"
        "Usage: omentum retract SCENE.yaml -o DIR [options]\n\n"
        "The simulated operating field hides another mesh and another stiffness from the twin that\n"
        "plans and estimates forces. Exit code 0: exposed; 1: not exposed.\n");
    om_cli_print_options(args);
    printf("\nExamples:\n"
           "  omentum retract scenes/sheet.yaml -o out/sheet\n"
           "  omentum retract scenes/sheet.yaml --layout 7 -o out/sheet-7\n"
           "  omentum retract scenes/kidney.yaml --data /path/to/data -o out/kidney\n"
           "  omentum retract scenes/sheet.yaml --calibrate-force\n");
}

// Five lines for whoever ran it.
static void print_result(const OmScene* scene, const OmRetractResult* r, const char* dir) {
    printf("%s, layout %d: %s\n", scene->name, scene->seed, r->reason);
    printf("  ROI seen: %.0f %% at the start, %.0f %% at the end (%.0f %% wanted)\n",
           100 * r->visibility_start, 100 * r->visibility_end, 100 * scene->task.visibility);
    printf("  force: at most %.2f N, above the threshold of %.2f N %d times\n", r->force_max,
           scene->task.force_threshold, r->nforce);
    printf(
        "  speed: %.1f s of operation in %.1f s; a twin step %.2f ms; planning %.1f ms (median of %d)\n",
        r->time, r->wall_time, r->twin_step_ms, r->plan_ms_median, r->nplan);
    if (dir) printf("  report: %s/report.html\n", dir);
}

static int run(const OmScene* scene, const char* out, const char* program, int nworker,
               bool is_quiet) {
    OmRetractDef def = om_retract_default_def(scene);
    def.out_dir = out;
    def.program = program;
    def.nworker = nworker;
    OmRetractResult result;
    OmStatus status = om_retract_run(&def, om_cli_progress(is_quiet), &result);
    if (status < 0) return om_cli_fail("retract", status);
    om_cli_progress_done();
    print_result(scene, &result, out);
    int code = result.is_exposed ? OM_EXIT_OK : OM_EXIT_FAILED;
    om_retract_result_done(&result);
    return code;
}

static int calibrate(const OmScene* scene, int nlayout, int nworker, bool is_quiet) {
    OmForceCalibration c;
    OmStatus status =
        om_retract_calibrate_force(scene, nlayout, nworker, om_cli_progress(is_quiet), &c);
    if (status < 0) return om_cli_fail("retract", status);
    om_cli_progress_done();
    printf(
        "%s: largest pull of %d grasps in %d layouts: median %.3f N (quartiles %.3f, %.3f; largest %.3f)\n"
        "force_threshold: %.2f  # N, twice the median\n",
        scene->name, c.nrun, nlayout, c.median, c.lower_quartile, c.upper_quartile, c.max,
        c.threshold);
    return OM_EXIT_OK;
}

typedef struct Settings {
    OmScene scene;
    const char* out;
    int nlayout, nworker;
    bool is_quiet;
} Settings;

static OmStatus read_settings(const OmCliArgs* args, Settings* s) {
    int npositional;
    OM_TRY(om_cli_check(args, 1, &npositional));
    OM_CHECK(npositional == 1, OM_INVALID, "no scene is given; see omentum retract --help");
    s->out = om_cli_get(args, "--output");
    s->is_quiet = om_cli_get(args, "--quiet") != NULL;
    OM_TRY(om_cli_get_int(args, "--layouts", 1, 10000, &s->nlayout));
    OM_TRY(om_cli_get_int(args, "--workers", 0, OM_MAX_WORKER, &s->nworker));
    OM_CHECK(s->out || om_cli_get(args, "--calibrate-force"), OM_INVALID,
             "no output folder is given; add -o DIR");
    return OM_OK;
}

static OmStatus read_scene(const OmCliArgs* args, Settings* s) {
    OM_TRY(om_scene_load(om_cli_positional(args, 0), &s->scene));
    const char* data = om_cli_get(args, "--data");
    if (data) {
        OM_CHECK(strlen(data) < sizeof s->scene.data_root, OM_INVALID,
                 "option --data: path too long");
        strcpy(s->scene.data_root, data);
    }
    OM_TRY(om_cli_get_int(args, "--layout", 0, 2147483647, &s->scene.seed));
    return om_cli_get_double(args, "--force-threshold", 1e-3, 1e3, &s->scene.task.force_threshold);
}

int om_cli_retract(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    if (om_cli_get(&args, "--help")) {
        print_help(&args);
        return OM_EXIT_OK;
    }
    Settings s = {.nlayout = 17};
    if (read_settings(&args, &s) < 0) {
        fprintf(stderr, "omentum retract: %s\n", om_error_message());
        return OM_EXIT_USAGE;
    }
    OmStatus status = read_scene(&args, &s);
    if (status < 0) return om_cli_fail("retract", status);
    if (om_cli_get(&args, "--calibrate-force"))
        return calibrate(&s.scene, s.nlayout, s.nworker, s.is_quiet);
    return run(&s.scene, s.out, om_cli_get(&args, "--program"), s.nworker, s.is_quiet);
}

// ---- demo -----------------------------------------------------------------------------------------------

static const OmCliOption demo_option[] = {
    {"--output", "-o", "DIR", "folder for the report (default: omentum-demo)"},
    {"--quick", NULL, NULL, "coarser meshes, smaller pictures: some seconds"},
    {"--quiet", "-q", NULL, "no progress"},
    {"--help", "-h", NULL, "this text"},
};

int om_cli_demo(int argc, char** argv) {
    OmCliArgs args = {demo_option, sizeof demo_option / sizeof *demo_option, argc, argv};
    if (om_cli_get(&args, "--help")) {
        printf("omentum demo: lift a sheet of soft tissue off a tumour; needs no file\n\n"
               "Usage: omentum demo [-o DIR] [--quick]\n");
        om_cli_print_options(&args);
        return OM_EXIT_OK;
    }
    int npositional;
    if (om_cli_check(&args, 0, &npositional) < 0) {
        fprintf(stderr, "omentum demo: %s\n", om_error_message());
        return OM_EXIT_USAGE;
    }
    OmScene scene = om_scene_default();
    snprintf(scene.name, sizeof scene.name, "demo");
    if (om_cli_get(&args, "--quick")) {
        scene.world.has_depth_noise = false;
        scene.endoscope.width = 320;
        scene.endoscope.height = 240;
    }
    const char* out = om_cli_get(&args, "--output");
    return run(&scene, out ? out : "omentum-demo", NULL, 0, om_cli_get(&args, "--quiet") != NULL);
}
