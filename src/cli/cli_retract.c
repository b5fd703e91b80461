// cli_retract.c: omentum retract.
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "cli_retract.h"
#include "omentum/umesh_net.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder for report.html, view.html, run.json, run.vtkhdf and frames"},
    {"--data", NULL, "DIR", "folder that the scene's file names are relative to",
     "the scene's folder"},
    {"--layout", NULL, "K", "seed of attachments and ROI", "the scene's", NULL, 0, 2147483647},
    {"--program", NULL, "FILE", "a logic program instead of the built-in one"},
    {"--force-threshold", NULL, "N", "largest force on the tissue, without a margin",
     "the scene's, with its margin", "N", 1e-3, 1e3},
    {"--dry-run", NULL, NULL, "check the scene, print its sizes, memory and time, and end"},
    {"--example", NULL, NULL, "print a complete scene that runs, with every key, and end"},
    {"--print-scene", NULL, NULL, "print the scene with all defaults filled in, and end"},
    {"--keys", NULL, NULL, "print the page of all keys of a scene (doc/scene_keys.md), and end"},
    {"--update", NULL, NULL,
     "correct the twin's attachments while it runs, as `update: enabled: true`"},
    {"--plan", NULL, "FILE", "follow this plan first, as omentum preplan writes it"},
    {"--defras", NULL, NULL,
     "the whole of chapter 6: plan before (unless --plan is given), watch the twin, learn with the network"},
    {"--supervise", NULL, NULL,
     "take commands from standard input while it runs, a line each: pause, go, slow 0.5, forbid 3 2, ..."},
    {"--acting", NULL, "FILE",
     "carry out reaches and pulls by this policy (omentum rl train -t approach)", "straight lines"},
    {"--both-arms", NULL, NULL,
     "an arm may keep its tissue up while the other one grasps and pulls"},
    {"--approve", NULL, NULL, "with --supervise: each plan waits for yes or no"},
    {"--real-time", NULL, NULL, "time passes as on the wall"},
    {"--world", NULL, "KIND", "simulated; or dds: the robot that answers there, as omentum dvrk",
     "simulated"},
    {"--frames", NULL, "FILE",
     "with --world dds: where the robot's frames are, by omentum register",
     "the robot's tf_static"},
    {"--instrument", NULL, "FILE", "with --world dds: instrument, a file of the dVRK (share/tool)",
     "by tool_type"},
    {"--arm", NULL, "FILE", "with --world dds: arm, a file of the dVRK (PSM.json, PSM_Si.json)",
     "Classic"},
    OM_CLI_OPTION_ARMS,
    {"--endoscope", NULL, "NAME",
     "with --world dds: its topics are NAME/image_raw, NAME/camera_info", "endoscope"},
    {"--depth", NULL, "NAME", "with --world dds: NAME/points or NAME/image_raw, NAME/camera_info",
     "depth"},
    OM_CLI_OPTION_DDS,
    {"--record-acquisitions", NULL, NULL,
     "write what the depth camera saw after each pull and fold to DIR/acquisitions, for omentum update"},
    {"--record", NULL, NULL,
     "write all that the robot observes to DIR/observations.log, for omentum replay"},
    {"--igtl", NULL, "PORT", "tools and tissue by OpenIGTLink, for 3D Slicer on this machine",
     "none", NULL, 1, 65535},
    {"--workers", NULL, "N", "threads", "one a processor", NULL, 0, OM_MAX_WORKER},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"layout", "seed of attachments and ROI"},
    {"visibility_start", "visible fraction of the ROI, 0 to 1"},
    {"visibility_end", "the same, at the end"},
    {"visibility_truth_end", "the same, in the truth"},
    {"actions", "carried out"},
    {"operation_s", "simulated time"},
    {"path_mm", "way of the tips in reaches, pulls and folds"},
    {"wall_s", "time it took"},
    {"force_twin_n", "largest force estimated by the twin"},
    {"force_truth_n", "largest force in the truth"},
    {"twin_step_ms", "mean of a step of the twin"},
    {"acquisitions", "taken, with --update or --record-acquisitions"},
    {"updates_adopted", "estimates that the twin adopted"},
    {"updates_refused", "estimates that left the twin unchanged"},
    {"warnings", "times that the warning state rose to 1 or above"},
    {"mu_max_mm", "largest discrepancy of the twin, while tissue was held"},
    {"observations_bytes", "size of observations.log, with --record"},
};

// Print the pull on the tissue by the twin's estimate and in the truth, and the limit.
static void print_force(const OmScene* scene, const OmRetractResult* r) {
    const OmSceneTask* task = &scene->task;
    if (isfinite(r->twin.force))
        printf("  pull on the tissue: at most %.2f N as the robot estimates it", r->twin.force);
    else
        printf("  pull on the tissue: not known to the twin, whose engine %s has no forces",
               scene->tissue.engine);
    if (isfinite(r->truth.force)) printf(", %.2f N in the simulated truth", r->truth.force);
    if (isfinite(r->truth.more))
        printf(" (up to %.2f N above the estimate)", fmax(0, r->truth.more));
    if (!task->watch_force) {
        printf("\n  limit: none; the scene says watch_force: false\n");
        return;
    }
    printf("\n  limit: the arms stop pulling at %.2f N by the estimate",
           task->force_threshold - task->force_margin);
    if (task->force_margin > 0)
        printf(", the scene's threshold of %.2f N less a margin of %.2f N for its error",
               task->force_threshold, task->force_margin);
    else
        printf(", the scene's threshold");
    printf("; reached %d times\n", r->twin.nforce);
}

// Print what the depth camera taught the twin.
static void print_updates(const OmRetractResult* r) {
    if (r->belief.nacquisition == 0) return;
    int nadopted = 0, nrefused = 0;
    const char* reason = "";
    for (int i = 0; i < r->belief.nupdate; ++i) {
        nadopted += r->belief.update[i].stage == OM_UPDATE_ADOPTED;
        nrefused += r->belief.update[i].stage == OM_UPDATE_REFUSED;
        if (r->belief.update[i].stage == OM_UPDATE_REFUSED) reason = r->belief.update[i].reason;
    }
    printf("  updates: %d acquisitions, %d estimates adopted, %d refused%s%s\n",
           r->belief.nacquisition, nadopted, nrefused, nrefused ? ", the last because " : "",
           reason);
    om_cli_figure("acquisitions", r->belief.nacquisition);
    om_cli_figure("updates_adopted", nadopted);
    om_cli_figure("updates_refused", nrefused);
}

// Print how large the recorded observations are.
static void print_recorded(const char* dir) {
    char path[OM_SCENE_PATH];
    FILE* file;
    uint64_t size;
    if (om_path_join(dir, "observations.log", path, sizeof path) < 0 ||
        om_file_open(path, &file, &size) < 0)
        return;
    fclose(file);
    printf("  observations: %s, %.1f MB; omentum replay %s decides again from them\n", path,
           1e-6 * (double)size, dir);
    om_cli_figure("observations_bytes", (double)size);
}

// Print a summary for the user.
static void print_result(const OmScene* scene, const OmRetractResult* r, const char* dir) {
    printf("%s, layout %d: %s\n", scene->name, scene->seed, r->reason);
    char truth[40] = "";
    if (isfinite(r->truth.visibility))
        snprintf(truth, sizeof truth, " (in the truth %.0f %%)", 100 * r->truth.visibility);
    printf(
        "  ROI visible: %.0f %% at the start, %.0f %% at the end%s; it counts as exposed from %.0f %% on\n",
        100 * r->visibility_start, 100 * r->visibility_end, truth, 100 * scene->task.visibility);
    print_force(scene, r);
    printf(
        "  speed: %.1f s of operation in %.1f s; a twin step %.2f ms; planning %.1f ms (median of %d)\n",
        r->time, r->wall_time, r->twin.step_ms, r->plan_ms_median, r->nplan);
    if (r->twin.nbad + r->truth.nbad > 0)
        printf(
            "  note: in %d steps of the twin and %d of the truth an element was inverted, contact had not settled, "
            "or energy was gained: forces of these steps are less certain\n",
            r->twin.nbad, r->truth.nbad);
    if (r->belief.nmonitor > 0) {
        printf("  twin: at most %.1f mm from the tissue in %d frames; warning state 1 reached %d "
               "times, 2 %d times, 3 %d times\n",
               1e3 * r->belief.mu_max, r->belief.nmonitor, r->belief.nwarning[0],
               r->belief.nwarning[1], r->belief.nwarning[2]);
        om_cli_figure("warnings", r->belief.nwarning[0]);
        om_cli_figure("mu_max_mm", 1e3 * r->belief.mu_max);
    }
    if (!r->is_settled) printf("  note: the tissue still moved when the operation began\n");
    if (r->has_slid)
        printf(
            "  note: the tissue slid while it settled, before any action: by %.1f mm in the twin, %.1f mm in "
            "the truth (mean over vertices)\n",
            1e3 * r->twin.shift, 1e3 * r->truth.shift);
    if (r->twin.nadded > 0)
        printf(
            "  note: the twin slid off while it settled; %d vertices were attached, so that it stays\n",
            r->twin.nadded);
    if (r->twin.unregistered[0])
        printf("  note: the tissue seen at rest is not the model's within the noise: %s\n",
               r->twin.unregistered);
    if (r->twin.turned > 0 || r->twin.shifted > 0)
        printf(
            "  registration: before the operation the model was turned by %.1f degrees and shifted by %.1f mm, "
            "onto the tissue seen at rest\n",
            180 / OM_PI * r->twin.turned, 1e3 * r->twin.shifted);
    if (r->effort.nmeasured > 0)
        printf(
            "  cloud: %d reaches to tissue that the depth camera sees up to %.1f mm from the twin's; %d jaws closed "
            "on nothing\n",
            r->effort.nmeasured, 1e3 * r->effort.measured_off, r->effort.nempty);
    print_updates(r);
    if (dir) printf("  report: %s/report.html; in three dimensions: %s/view.html\n", dir, dir);
    om_cli_figure("layout", scene->seed);
    om_cli_figure("visibility_start", r->visibility_start);
    om_cli_figure("visibility_end", r->visibility_end);
    om_cli_figure("visibility_truth_end", r->truth.visibility);
    om_cli_figure("actions", r->naction);
    om_cli_figure("operation_s", r->time);
    om_cli_figure("path_mm", 1e3 * r->effort.path);
    om_cli_figure("wall_s", r->wall_time);
    om_cli_figure("force_twin_n", r->twin.force);
    om_cli_figure("force_truth_n", r->truth.force);
    om_cli_figure("twin_step_ms", r->twin.step_ms);
    om_cli_reason(r->reason);
    om_cli_path(dir);
}

// A motion law from a policy of the task "approach".
static OmStatus next_place(void* ctx, const OmLoopMotion* m, OmVec3* place) {
    return om_rl_acting_next(ctx, m->verb == OM_PLAN_REACH, m->nplace == 0, m->tip, m->goal, place);
}

OmRetractDef om_cli_retract_def(OmCliRetract* s, const char* dir) {
    OmRetractDef def = om_retract_default_def(&s->scene);
    def.out_dir = dir;
    def.program = s->program;
    def.nworker = s->nworker;
    def.records_acquisitions = s->records_acquisitions;
    if (s->has_preplan) def.preplan = &s->preplan;
    if (s->person.reads || s->person.is_paced) {
        def.supervise = om_cli_supervise;
        def.supervise_ctx = &s->person;
    }
    def.needs_approval = s->needs_approval;
    def.has_both_arms = s->has_both_arms;
    def.records_observations = s->records_observations;
    if (s->has_robot) def.robot = &s->robot;
    def.igtl_port = s->igtl_port;
    if (s->acting) def.law = (OmMotionLaw){s->acting, next_place};
    return def;
}

OmStatus om_cli_retract_plan(OmCliRetract* s, const char* dir, char* trials, size_t size) {
    if (!s->is_defras || s->has_preplan) return OM_OK;
    // An error comes before the plan, which takes a minute.
    OmRetractEstimate e;
    OmRetractDef run = om_cli_retract_def(s, dir);
    run.needs_approval = false;  // the page of `omentum view` brings its person later
    OM_TRY(om_retract_check(&run, NULL, &e));
    if (s->has_robot) {  // does it answer?
        OmWorld* world;
        OM_TRY(om_world_create_dds(&s->robot, &world));
        om_world_destroy(world);
    }
    OmPreplanDef def = om_preplan_default_def(&s->scene);
    def.nworker = s->nworker;
    if (dir) {
        def.trials = trials;
        OM_TRY(om_cli_trials_path(dir, trials, size));
    }
    OM_TRY(om_preplan_run(&def, om_cli_progress(s->is_quiet), &s->preplan));
    om_cli_progress_done();
    s->has_preplan = true;
    printf("plan before the operation: %s\n", s->preplan.reason);
    fflush(stdout);
    return OM_OK;
}

static int run(OmCliRetract* s) {
    char trials[1200] = "";
    OmStatus status = om_cli_retract_plan(s, s->out, trials, sizeof trials);
    OmRetractDef def = om_cli_retract_def(s, s->out);
    OmRetractResult result;
    // what a person types does not mix with a bar: plans and actions are printed instead
    const bool is_quiet = s->is_quiet || s->person.reads;
    if (status == OM_OK) status = om_retract_run(&def, om_cli_progress(is_quiet), &result);
    if (status < 0) return om_cli_fail_trials("retract", status, trials);
    if (trials[0]) (void)om_path_remove(trials);
    om_cli_progress_done();
    print_result(&s->scene, &result, s->out);
    if (s->records_observations) print_recorded(s->out);
    int code = result.is_exposed ? OM_EXIT_OK : OM_EXIT_FAILED;
    om_retract_result_done(&result);
    return code;
}

// Everything a run does before its first action, and what the rest would take.
static int dry_run(OmCliRetract* s) {
    const OmScene* scene = &s->scene;
    OmRetractDef def = om_cli_retract_def(s, s->out);
    OmRetractEstimate e;
    OmStatus status = om_retract_check(&def, om_cli_progress(s->is_quiet), &e);
    if (status < 0) return om_cli_fail("retract", status);
    om_cli_progress_done();
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);  // ru_maxrss counts kilobytes
    const bool is_seen = e.visibility >= scene->task.visibility;
    printf("%s, layout %d: the scene can be run%s\n", scene->name, scene->seed,
           is_seen ? ", but its ROI is in view before any action" : "");
    printf("  twin: %d vertices (%d attached), %d tetrahedra; truth: %d vertices (%d attached), %d "
           "tetrahedra\n",
           e.twin_nvert, e.twin_nattached, e.twin_ntet, e.world_nvert, e.world_nattached,
           e.world_ntet);
    if (e.world_norgan > 0)
        printf("  the organ gives way in the %s: %d vertices\n",
               e.twin_norgan > 0 ? "twin and in the truth" : "truth", e.world_norgan);
    printf("  grid: %d of %d blocks can be grasped; the first plan has %d actions\n", e.ngrasp,
           e.nblock, e.nplanned);
    printf("  ROI visible before any action: %.0f %% (%.0f %% counts as exposed)\n",
           100 * e.visibility, 100 * scene->task.visibility);
    printf("  memory: %.0f MB so far, and up to %.0f MB for the report's pictures\n",
           1024e-6 * (double)usage.ru_maxrss, 1e-6 * e.picture_bytes);
    printf(
        "  time: %.1f s to begin, then about %.2f s for each second of operation (tissue at rest; "
        "lifted tissue takes longer); at most %d actions\n",
        e.begin_time, e.time_rate, scene->task.max_actions);
    if (is_seen)
        printf(
            "  warning: %.0f %% of the ROI is already visible: a run ends at once, with exit code 1; cover the ROI "
            "with more tissue, move it or turn the endoscope\n",
            100 * e.visibility);
    else if (e.visibility > 0.5 * scene->task.visibility)
        printf("  warning: %.0f %% of the ROI is already visible: little is hidden\n",
               100 * e.visibility);
    if (e.nadded > 0)
        printf(
            "  note: the twin slid off while it settled; %d vertices more are attached, so that it stays\n",
            e.nadded);
    if (e.registration.reason[0])
        printf("  registration on the tissue at rest: %s\n", e.registration.reason);
    if (e.nplanned == 0) printf("  note: no plan is found: a run ends at once, with exit code 1\n");
    if (!e.is_settled) printf("  note: the tissue still moves when the operation begins\n");
    if (e.has_slid) printf("  note: the tissue slides while it settles\n");
    return OM_EXIT_OK;
}

// What needs no run: a scene's text, an example, or the page of all keys.
static int print_text(const OmCliArgs* args, OmCliRetract* s) {
    OmText text = {0};
    OmStatus status = OM_OK;
    if (om_cli_get(args, "--example")) {
        status = om_scene_print_example(&text);
    } else if (om_cli_get(args, "--keys")) {
        status = om_scene_print_keys(&text);
    } else {
        char here[OM_SCENE_PATH], *root = s->scene.data_root, joined[OM_SCENE_PATH];
        if (root[0] != '/' && getcwd(here, sizeof here)) {  // the text may be kept elsewhere
            status = om_path_join(here, root, joined, sizeof joined);
            if (status == OM_OK) strcpy(root, joined);
        }
        if (status == OM_OK) status = om_scene_print(&s->scene, true, &text);
    }
    if (status == OM_OK) fputs(text.str, stdout);
    om_text_done(&text);
    return status < 0 ? om_cli_fail("retract", status) : OM_EXIT_OK;
}

// The argument of an option that this verb may lack.
static const char* get(const OmCliArgs* args, const char* name) {
    bool is_known = om_cli_find_option(args->option, args->noption, name, strlen(name)) != NULL;
    return is_known ? om_cli_get(args, name) : NULL;
}

static OmStatus get_int(const OmCliArgs* args, const char* name, int* value) {
    return get(args, name) ? om_cli_int(args, name, value) : OM_OK;
}

static OmStatus read_settings(const OmCliArgs* args, bool needs_folder, OmCliRetract* s) {
    int npositional;
    OM_TRY(om_cli_check(args, 1, &npositional));
    s->needs_scene = !get(args, "--example") && !get(args, "--keys");
    if (!s->needs_scene) {
        OM_CHECK(npositional == 0, OM_INVALID, "\"%s\" is one argument too many",
                 om_cli_positional(args, 0));
        return OM_OK;
    }
    OM_CHECK(npositional == 1, OM_INVALID, "no scene is given; see omentum %s --help", s->verb);
    s->out = get(args, "--output");
    s->program = get(args, "--program");
    s->is_quiet = get(args, "--quiet") != NULL;
    s->records_acquisitions = get(args, "--record-acquisitions") != NULL;
    s->is_defras = get(args, "--defras") != NULL;
    s->person.reads = get(args, "--supervise") != NULL;
    s->person.is_paced = get(args, "--real-time") != NULL;
    s->needs_approval = get(args, "--approve") != NULL;
    s->has_both_arms = get(args, "--both-arms") != NULL;
    const bool has_person =
        om_cli_find_option(args->option, args->noption, "--supervise", 11) != NULL;
    OM_CHECK(s->person.reads || !s->needs_approval || !has_person, OM_INVALID,
             "--approve needs --supervise");
    s->records_observations = get(args, "--record") != NULL;
    s->first = 1;
    s->nlayout = 17;
    OM_TRY(get_int(args, "--count", &s->nlayout));
    OM_TRY(get_int(args, "--first", &s->first));
    OM_TRY(get_int(args, "--workers", &s->nworker));
    OM_TRY(get_int(args, "--igtl", &s->igtl_port));
    bool is_run = needs_folder && !get(args, "--print-scene") && !get(args, "--dry-run");
    OM_CHECK(s->out || !is_run, OM_INVALID, "no output folder is given; add -o DIR");
    return OM_OK;
}

// Where the run takes place.
static OmStatus read_world(const OmCliArgs* args, OmCliRetract* s) {
    const char* kind = get(args, "--world");
    s->has_robot = kind && strcmp(kind, "dds") == 0;
    OM_CHECK(!kind || s->has_robot || strcmp(kind, "simulated") == 0, OM_INVALID,
             "option --world: \"%s\"; it is simulated or dds", kind);
    static const char* const only[] = {"--domain", "--network",    "--peer",
                                       "--frames", "--instrument", "--arm",
                                       "--arms",   "--endoscope",  "--depth"};
    for (size_t k = 0; !s->has_robot && k < sizeof only / sizeof *only; ++k)
        OM_CHECK(strcmp(s->verb, "retract") != 0 || !get(args, only[k]), OM_INVALID,
                 "option %s needs --world dds", only[k]);
    if (!s->has_robot) return OM_OK;
    s->robot = om_dds_world_default_def(&s->scene);
    s->robot.frame = s->frame;
    s->robot.instrument_file = get(args, "--instrument");
    s->robot.arm_file = get(args, "--arm");
    if (get(args, "--endoscope")) s->robot.endoscope = get(args, "--endoscope");
    if (get(args, "--depth")) s->robot.depth = get(args, "--depth");
    OM_TRY(om_cli_arms(args, s->arms, s->robot.arm));
    if (get(args, "--frames"))
        OM_TRY(om_dds_frames_load(get(args, "--frames"), s->frame, &s->robot.nframe));
    return om_cli_dds(args, &s->robot.dds);
}

static OmStatus read_scene(const OmCliArgs* args, OmCliRetract* s) {
    const OmTissueEngine* engine;
    if (!s->has_scene) OM_TRY(om_scene_load(om_cli_positional(args, 0), &s->scene));
    s->engines = om_engine_set_default();
    OM_TRY(om_engine_set_add(&s->engines, om_umesh_engine()));
    s->scene.engines = &s->engines;
    OM_TRY(om_body_find_engine(&s->scene, OM_SITE_TWIN, &engine));
    const char* data = get(args, "--data");
    s->has_layout = get(args, "--layout") != NULL;
    s->has_data = data != NULL;
    if (data) {
        OM_CHECK(strlen(data) < sizeof s->scene.data_root, OM_INVALID,
                 "option --data: path too long");
        strcpy(s->scene.data_root, data);
    }
    OM_TRY(get_int(args, "--layout", &s->scene.seed));
    if (get(args, "--update")) s->scene.update.is_enabled = true;
    if (get(args, "--force-threshold")) {
        s->scene.task.force_margin = 0;
        OM_TRY(om_cli_double(args, "--force-threshold", &s->scene.task.force_threshold));
    }
    if (s->is_defras) om_retract_use_all(&s->scene);
    OM_TRY(read_world(args, s));
    const char* plan = get(args, "--plan");
    s->has_preplan = plan != NULL;
    const char* acting = get(args, "--acting");
    OM_CHECK(!acting || !s->records_observations, OM_INVALID,
             "--acting: a run by a policy cannot be replayed; leave out --record");
    if (acting) OM_TRY(om_rl_acting_load(acting, &s->acting));
    return plan ? om_preplan_load(plan, &s->preplan) : OM_OK;
}

int om_cli_retract_begin(const OmCliArgs* args, bool needs_folder, OmCliRetract* s) {
    if (read_settings(args, needs_folder, s) < 0) {
        fprintf(stderr, "omentum %s: %s\n", s->verb, om_error_message());
        return OM_EXIT_USAGE;
    }
    if (!s->needs_scene) return OM_EXIT_OK;
    OmStatus status = read_scene(args, s);
    const char* const input[] = {om_cli_positional(args, 0), s->program};
    if (status == OM_OK) status = om_cli_check_apart(s->out, input, 2);
    return status < 0 ? om_cli_fail(s->verb, status) : OM_EXIT_OK;
}

// Options that are commands now, or are gone: say so.
static bool is_moved(int argc, char** argv) {
    static const char* const moved[][2] = {{"--calibrate-force", "calibrate-force SCENE.yaml"},
                                           {"--calibrate-mesh", NULL},
                                           {"--search", "search SCENE.yaml"},
                                           {"--replay", "replay DIR"},
                                           {"--layouts", "layouts SCENE.yaml --count N -o DIR"},
                                           {"--first", "layouts SCENE.yaml --first K -o DIR"}};
    for (int i = 1; i < argc; ++i)
        for (size_t k = 0; k < sizeof moved / sizeof *moved; ++k) {
            size_t len = strlen(moved[k][0]);
            bool is_it = strncmp(argv[i], moved[k][0], len) == 0 &&
                         (argv[i][len] == 0 || argv[i][len] == '=');
            if (!is_it) continue;
            if (moved[k][1])
                fprintf(stderr, "omentum retract: %s is a command of its own: omentum %s\n",
                        moved[k][0], moved[k][1]);
            else
                fprintf(stderr, "omentum retract: %s is gone: " OM_CLI_NO_MESH_FACTOR "\n",
                        moved[k][0]);
            return true;
        }
    return false;
}

int om_cli_retract(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmCliRetract s = {.verb = "retract"};
    if (is_moved(argc, argv)) return OM_EXIT_USAGE;
    int code = om_cli_retract_begin(&args, true, &s);
    if (code != OM_EXIT_OK) return code;
    if (!s.needs_scene || om_cli_get(&args, "--print-scene")) return print_text(&args, &s);
    if (om_cli_get(&args, "--dry-run")) return dry_run(&s);
    code = run(&s);
    om_rl_acting_destroy(s.acting);
    return code;
}

const OmCliVerb om_cli_verb_retract = {
    .name = "retract",
    .run = om_cli_retract,
    .summary = "run a scene: sense, plan, act until the ROI is seen; writes a report",
    .usage = "omentum retract SCENE.yaml -o DIR [options]",
    .about =
        "Runs the deliberative loop on a simulated operating field. Its mesh and stiffness differ from\n"
        "those of the twin, which plans and estimates forces. Exit code 0: the arms exposed the ROI; 1: not\n"
        "exposed, or in view before any action. DIR must be new, empty, or hold an older run. After Ctrl-C\n"
        "or SIGTERM the record up to then is kept. DIR/audit.jsonl has every decision with its facts and\n"
        "reasons; while a run lives, and after a kill, it is in DIR-unfinished.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum retract scenes/sheet.yaml -o out/sheet\n"
        "  omentum retract scenes/sheet.yaml --layout 7 -o out/sheet-7\n"
        "  omentum retract scenes/kidney.yaml --data /path/to/data -o out/kidney\n"
        "  omentum retract scenes/sheet.yaml --acting weights/approach.safetensors -o out/policy\n"
        "  omentum retract scenes/belief.yaml --update -o out/belief\n"
        "  omentum retract scenes/belief.yaml --defras -o out/defras\n"
        "  omentum retract scenes/belief.yaml --defras --supervise --approve --real-time -o out/watched\n"
        "  omentum retract scenes/belief.yaml --defras --record -o out/recorded\n"
        "  omentum retract scenes/belief.yaml --world dds --defras -o out/robot\n"
        "  omentum retract scenes/sheet.yaml --dry-run\n"
        "  omentum retract --example > my.yaml\n"
        "  omentum retract scenes/kidney.yaml --print-scene",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
