// cli_preplan.c: omentum preplan: the plan before an operation, from trials in the twin.
#include <string.h>

#include "cli_common.h"
#include "omentum/body.h"
#include "omentum/trial_preplan.h"
#include "omentum/umesh_net.h"

#define FOLDER_KIND "plan before an operation"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder for plan.json and report.html"},
    {"--data", NULL, "DIR", "folder that the scene's file names are relative to",
     "the scene's folder"},
    {"--layout", NULL, "K", "seed of attachments and ROI", "the scene's", NULL, 0, 2147483647},
    {"--lowest", NULL, "N", "points of lowest force that compete by their actions", "3", NULL, 1,
     256},
    {"--workers", NULL, "N", "grasping points in parallel", "one a processor", NULL, 0,
     OM_MAX_WORKER},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"layout", "seed of attachments and ROI"},
    {"points", "tried"},
    {"exposing", "of these points"},
    {"block_x", "of the chosen point, from 1; 0: none"},
    {"block_y", "the same"},
    {"arm", "of the chosen point, from 1; 0: none"},
    {"pulls", "of the chosen point"},
    {"visibility", "visible fraction of the ROI at the end, 0 to 1"},
    {"force_n", "largest pull, by the twin"},
    {"actions", "as a run counts them"},
    {"steps", "of the twin"},
    {"wall_s", "time it took"},
};

typedef struct Settings {
    OmScene scene;
    OmEngineSet engines;
    const char* out;
    int nworker, nlowest;
    bool is_quiet;
} Settings;

static OmStatus write_folder(const OmPreplan* plan, const char* out) {
    OmFolder folder;
    char path[1200];
    OM_TRY(om_folder_begin(out, FOLDER_KIND, &folder));
    OmStatus status = om_path_join(folder.path, "plan.json", path, sizeof path);
    if (status == OM_OK) status = om_preplan_save(plan, path);
    if (status == OM_OK) status = om_path_join(folder.path, "report.html", path, sizeof path);
    if (status == OM_OK) status = om_preplan_save_report(plan, path);
    if (status == OM_OK) status = om_folder_commit(&folder);
    om_folder_end(&folder);
    return status;
}

static OmStatus print_result(const OmPreplan* plan, const char* out, double wall) {
    OmText map = {0};
    OM_TRY(om_preplan_print(plan, &map));
    printf("%s, layout %d: %s\n%s", plan->scene, plan->seed, plan->reason, map.str);
    om_text_done(&map);
    printf("  %d of %d grasping points tried, %d expose the ROI; %.1f s, %lld steps of the twin\n",
           plan->ntried, plan->n * plan->n, plan->nexposing, wall, (long long)plan->nstep);
    printf("  report: %s/report.html\n", out);
    const OmPreplanPoint none = {.block = -1, .arm = -1};
    const OmPreplanPoint* p = plan->chosen >= 0 ? &plan->point[plan->chosen] : &none;
    om_cli_figure("layout", plan->seed);
    om_cli_figure("points", plan->ntried);
    om_cli_figure("exposing", plan->nexposing);
    om_cli_figure("block_x", p->block >= 0 ? p->block % plan->n + 1 : 0);
    om_cli_figure("block_y", p->block >= 0 ? p->block / plan->n + 1 : 0);
    om_cli_figure("arm", p->arm + 1);
    om_cli_figure("pulls", p->npull);
    om_cli_figure("visibility", p->visibility);
    om_cli_figure("force_n", p->force);
    om_cli_figure("actions", p->naction);
    om_cli_figure("steps", (double)plan->nstep);
    om_cli_figure("wall_s", wall);
    om_cli_reason(plan->reason);
    om_cli_path(out);
    return OM_OK;
}

static int run(const Settings* s) {
    char trials[1200] = "";
    double begin = om_clock_now();
    OmPreplanDef def = om_preplan_default_def(&s->scene);
    def.nworker = s->nworker;
    def.nlowest = s->nlowest;
    OmPreplan* plan = om_calloc(1, sizeof *plan);
    if (!plan) return om_cli_fail("preplan", OM_NO_MEMORY);
    OmStatus status = om_folder_check(s->out, FOLDER_KIND);
    if (status == OM_OK) status = om_cli_trials_path(s->out, trials, sizeof trials);
    def.trials = trials;
    if (status == OM_OK) status = om_preplan_run(&def, om_cli_progress(s->is_quiet), plan);
    if (status == OM_OK) status = write_folder(plan, s->out);
    if (status == OM_OK) status = om_path_remove(trials);
    if (status == OM_OK) {
        om_cli_progress_done();
        status = print_result(plan, s->out, om_clock_now() - begin);
    }
    int code = plan->is_exposing ? OM_EXIT_OK : OM_EXIT_FAILED;
    if (status < 0) code = om_cli_fail_trials("preplan", status, trials);
    om_free(plan);
    return code;
}

static OmStatus read_options(const OmCliArgs* args, Settings* s) {
    int npositional;
    OM_TRY(om_cli_check(args, 1, &npositional));
    OM_CHECK(npositional == 1, OM_INVALID, "no scene is given; see omentum preplan --help");
    s->out = om_cli_get(args, "--output");
    s->is_quiet = om_cli_get(args, "--quiet") != NULL;
    s->nlowest = 3;
    OM_CHECK(s->out, OM_INVALID, "no output folder is given; add -o DIR");
    OM_TRY(om_cli_int(args, "--lowest", &s->nlowest));
    return om_cli_int(args, "--workers", &s->nworker);
}

static OmStatus read_scene(const OmCliArgs* args, Settings* s) {
    OM_TRY(om_scene_load(om_cli_positional(args, 0), &s->scene));
    s->engines = om_engine_set_default();
    OM_TRY(om_engine_set_add(&s->engines, om_umesh_engine()));
    s->scene.engines = &s->engines;
    const char* data = om_cli_get(args, "--data");
    if (data) {
        OM_CHECK(strlen(data) < sizeof s->scene.data_root, OM_INVALID,
                 "option --data: path too long");
        strcpy(s->scene.data_root, data);
    }
    return om_cli_int(args, "--layout", &s->scene.seed);
}

int om_cli_preplan(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    Settings s = {0};
    if (read_options(&args, &s) < 0) return om_cli_usage("preplan");
    OmStatus status = read_scene(&args, &s);
    const char* const input[] = {om_cli_positional(&args, 0)};
    if (status == OM_OK) status = om_cli_check_apart(s.out, input, 1);
    return status < 0 ? om_cli_fail("preplan", status) : run(&s);
}

const OmCliVerb om_cli_verb_preplan = {
    .name = "preplan",
    .run = om_cli_preplan,
    .summary = "plan before an operation: try every grasping point in the twin",
    .usage = "omentum preplan SCENE.yaml -o DIR [options]",
    .about =
        "Tries every grasping point that is not above a believed attachment in the simulation of the\n"
        "twin: pulls, and folds where the ROI is still hidden. Of the points that expose the ROI the\n"
        "three of lowest force compete; the one of fewest actions is chosen. Writes plan.json, which\n"
        "omentum retract --plan follows, and report.html with the map of the grid. DIR must be new,\n"
        "empty, or hold an older plan. After Ctrl-C, SIGTERM or a kill DIR.trials keeps each finished\n"
        "trial, and the same command continues from there. Exit code 0: the chosen point exposes the ROI;\n"
        "1: no point does, and the plan is the one with the best visibility.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum preplan scenes/sheet.yaml -o out/plan\n"
               "  omentum preplan scenes/sheet.yaml --layout 50 -o out/plan-50\n"
               "  omentum preplan scenes/kidney.yaml --data /path/to/data -o out/plan-kidney",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
