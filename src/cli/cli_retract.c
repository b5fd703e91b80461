// cli_retract.c: omentum retract.
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "cli_acting.h"
#include "cli_common.h"
#include "cli_supervise.h"
#include "omentum/defras.h"
#include "omentum/defras_replay.h"
#include "omentum/umesh_net.h"

#define AHEAD_POINTS 3  // grasping points that --defras tries in the twin before a new plan

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder for report.html, run.json, run.vtkhdf and frames"},
    {"--data", NULL, "DIR", "folder that the scene's file names are relative to",
     "the scene's folder"},
    {"--layout", NULL, "K", "seed of attachments and ROI", "the scene's", NULL, 0, 2147483647},
    {"--program", NULL, "FILE", "a logic program instead of the built-in one"},
    {"--force-threshold", NULL, "N", "largest force on the tissue, without a margin",
     "the scene's, with its margin", "N", 1e-3, 1e3},
    {"--calibrate-force", NULL, NULL,
     "measure the scene's force threshold instead of running it (6.5.1)"},
    {"--calibrate-mesh", NULL, NULL,
     "measure the scene's mesh_factor instead of running it: how much too stiffly its mesh bends"},
    {"--search", NULL, NULL,
     "try every sequence of actions on the simulated truth: can the ROI be exposed at all?"},
    {"--first", NULL, "K", "with --layouts: the first layout", "1", NULL, 0, 1000000},
    {"--layouts", NULL, "N", "run N layouts, each in its own folder; of the calibration", "17",
     NULL, 1, 10000},
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
    {"--record-acquisitions", NULL, NULL,
     "write what the depth camera saw after each pull and fold to DIR/acquisitions, for omentum update"},
    {"--record", NULL, NULL,
     "write all that the robot observes to DIR/observations.log, for --replay"},
    {"--replay", NULL, "DIR",
     "decide again from the observations in DIR, and compare with its audit.jsonl; with -o the audit is written there"},
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
    {"updates_followed", "estimates after which forces brought the twin to what the camera sees"},
    {"updates_refused", "estimates that left the twin unchanged"},
    {"warnings", "times that the warning state rose to 1 or above"},
    {"mu_max_mm", "largest discrepancy of the twin, while tissue was held"},
    {"observations_bytes", "size of observations.log, with --record"},
    {"same", "with --replay: 1 if all lines of the audit are the same, otherwise 0"},
    {"lines", "of the audit, with --replay"},
    {"layouts", "run with --layouts, or measured"},
    {"exposed", "of these layouts; of the sequences with --search"},
    {"force_threshold_n", "measured with --calibrate-force"},
    {"force_margin_n", "the same"},
    {"mesh_factor", "measured with --calibrate-mesh"},
};

typedef struct Settings {
    OmScene scene;
    OmEngineSet engines;  // that the scene may name: those of the library, and the trained network
    const char *out, *program;
    int nlayout;  // 0: one run
    int first;    // layout of several
    int nworker;
    bool is_quiet;
    bool records_acquisitions, records_observations;
    bool is_defras, has_preplan, needs_approval, has_both_arms;
    OmPreplan preplan;
    OmCliPerson person;
    OmCliActing acting;
    bool needs_scene;  // false: only a text is wanted
} Settings;

// Print the pull on the tissue by the twin's estimate and in the truth, and the limit.
static void print_force(const OmScene* scene, const OmRetractResult* r) {
    const OmSceneTask* task = &scene->task;
    if (isfinite(r->force_max))
        printf("  pull on the tissue: at most %.2f N as the twin estimates it", r->force_max);
    else
        printf("  pull on the tissue: not known to the twin, whose engine %s has no forces",
               scene->tissue.engine);
    if (isfinite(r->force_world_max)) printf(", %.2f N in the simulated truth", r->force_world_max);
    if (isfinite(r->force_more))
        printf(" (up to %.2f N above the estimate)", fmax(0, r->force_more));
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
    printf("; reached %d times\n", r->nforce);
}

// Print what the depth camera taught the twin.
static void print_updates(const OmRetractResult* r) {
    if (r->nacquisition == 0) return;
    int nadopted = 0, nfollowed = 0, nrefused = 0;
    const char* reason = "";
    for (int i = 0; i < r->nupdate; ++i) {
        nadopted += r->update[i].stage == OM_UPDATE_ADOPTED;
        nfollowed += r->update[i].is_followed;
        nrefused += r->update[i].stage == OM_UPDATE_REFUSED;
        if (r->update[i].stage == OM_UPDATE_REFUSED) reason = r->update[i].reason;
    }
    printf("  updates: %d acquisitions, %d estimates adopted, %d followed, %d refused%s%s\n",
           r->nacquisition, nadopted, nfollowed, nrefused, nrefused ? ", the last because " : "",
           reason);
    om_cli_figure("acquisitions", r->nacquisition);
    om_cli_figure("updates_adopted", nadopted);
    om_cli_figure("updates_followed", nfollowed);
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
    printf("  observations: %s, %.1f MB; omentum retract --replay %s decides again from them\n",
           path, 1e-6 * (double)size, dir);
    om_cli_figure("observations_bytes", (double)size);
}

// Print a summary for the user.
static void print_result(const OmScene* scene, const OmRetractResult* r, const char* dir) {
    printf("%s, layout %d: %s\n", scene->name, scene->seed, r->reason);
    char truth[40] = "";
    if (isfinite(r->visibility_world_end))
        snprintf(truth, sizeof truth, " (in the truth %.0f %%)", 100 * r->visibility_world_end);
    printf(
        "  ROI visible: %.0f %% at the start, %.0f %% at the end%s; it counts as exposed from %.0f %% on\n",
        100 * r->visibility_start, 100 * r->visibility_end, truth, 100 * scene->task.visibility);
    print_force(scene, r);
    printf(
        "  speed: %.1f s of operation in %.1f s; a twin step %.2f ms; planning %.1f ms (median of %d)\n",
        r->time, r->wall_time, r->twin_step_ms, r->plan_ms_median, r->nplan);
    if (r->twin_nbad + r->world_nbad > 0)
        printf(
            "  note: in %d steps of the twin and %d of the truth an element was inverted, contact had not settled, "
            "or energy was gained: forces of these steps are less certain\n",
            r->twin_nbad, r->world_nbad);
    if (r->nmonitor > 0) {
        printf("  twin: at most %.1f mm from the tissue in %d frames; warning state 1 reached %d "
               "times, 2 %d times, 3 %d times\n",
               1e3 * r->mu_max, r->nmonitor, r->nwarning[0], r->nwarning[1], r->nwarning[2]);
        om_cli_figure("warnings", r->nwarning[0]);
        om_cli_figure("mu_max_mm", 1e3 * r->mu_max);
    }
    if (!r->is_settled) printf("  note: the tissue still moved when the operation began\n");
    if (r->has_slid)
        printf(
            "  note: the tissue slid while it settled, before any action: by %.1f mm in the twin, %.1f mm in "
            "the truth (mean over vertices)\n",
            1e3 * r->twin_shift, 1e3 * r->world_shift);
    if (r->nadded > 0)
        printf(
            "  note: the twin slid off while it settled; %d vertices were attached, so that it stays\n",
            r->nadded);
    if (r->nmeasured > 0)
        printf(
            "  cloud: %d reaches to tissue that the depth camera sees up to %.1f mm from the twin's; %d jaws closed "
            "on nothing\n",
            r->nmeasured, 1e3 * r->measured_off, r->nempty);
    print_updates(r);
    if (dir) printf("  report: %s/report.html\n", dir);
    om_cli_figure("layout", scene->seed);
    om_cli_figure("visibility_start", r->visibility_start);
    om_cli_figure("visibility_end", r->visibility_end);
    om_cli_figure("visibility_truth_end", r->visibility_world_end);
    om_cli_figure("actions", r->naction);
    om_cli_figure("operation_s", r->time);
    om_cli_figure("path_mm", 1e3 * r->path);
    om_cli_figure("wall_s", r->wall_time);
    om_cli_figure("force_twin_n", r->force_max);
    om_cli_figure("force_truth_n", r->force_world_max);
    om_cli_figure("twin_step_ms", r->twin_step_ms);
    om_cli_reason(r->reason);
    om_cli_path(dir);
}

static OmRetractDef make_def(Settings* s, const char* dir) {
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
    if (s->acting.policy) def.law = om_cli_acting_law(&s->acting);
    return def;
}

// The plan before the operation in `dir`, where the user wants one and has none. `trials` receives the file of its
// trials.
static OmStatus plan_before(Settings* s, const char* dir, char* trials, size_t size) {
    if (!s->is_defras || s->has_preplan) return OM_OK;
    OmPreplanDef def = om_preplan_default_def(&s->scene);
    def.nworker = s->nworker;
    def.trials = trials;
    OM_TRY(om_cli_trials_path(dir, trials, size));
    OM_TRY(om_preplan_run(&def, om_cli_progress(s->is_quiet), &s->preplan));
    om_cli_progress_done();
    s->has_preplan = true;
    printf("plan before the operation: %s\n", s->preplan.reason);
    return OM_OK;
}

static int run(Settings* s) {
    char trials[1200] = "";
    OmStatus status = plan_before(s, s->out, trials, sizeof trials);
    OmRetractDef def = make_def(s, s->out);
    OmRetractResult result;
    if (status == OM_OK) status = om_retract_run(&def, om_cli_progress(s->is_quiet), &result);
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
static int dry_run(Settings* s) {
    const OmScene* scene = &s->scene;
    OmRetractDef def = make_def(s, s->out);
    OmRetractEstimate e;
    OmStatus status = om_retract_check(&def, om_cli_progress(s->is_quiet), &e);
    if (status < 0) return om_cli_fail("retract", status);
    om_cli_progress_done();
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);  // ru_maxrss counts kilobytes
    printf("%s, layout %d: the scene can be run\n", scene->name, scene->seed);
    printf("  twin: %d vertices (%d attached), %d tetrahedra; truth: %d vertices (%d attached), %d "
           "tetrahedra\n",
           e.twin_nvert, e.twin_nattached, e.twin_ntet, e.world_nvert, e.world_nattached,
           e.world_ntet);
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
    if (e.visibility >= scene->task.visibility)
        printf("  note: the ROI is already visible: a run ends at once, with exit code 1\n");
    if (e.nplanned == 0) printf("  note: no plan is found: a run ends at once, with exit code 1\n");
    if (!e.is_settled) printf("  note: the tissue still moves when the operation begins\n");
    if (e.has_slid) printf("  note: the tissue slides while it settles\n");
    return OM_EXIT_OK;
}

// Search whether any sequence of actions exposes the layout; print a line.
static int search(const Settings* s) {
    static const char* const fold[OM_PLAN_NVERB] = {[OM_PLAN_MOVE_ROI] = ", folded towards the ROI",
                                                    [OM_PLAN_MOVE_AWAY] =
                                                        ", folded away from the camera"};
    const OmScene* scene = &s->scene;
    OmSearchResult r;
    OmStatus status = om_retract_search(scene, scene->task.force_threshold, s->nworker,
                                        om_cli_progress(s->is_quiet), &r);
    if (status < 0) return om_cli_fail("retract", status);
    om_cli_progress_done();
    om_cli_figure("layout", scene->seed);
    om_cli_figure("exposed", r.nexposed);
    printf("%s, layout %d: %d of %d sequences of %d grasps expose the ROI", scene->name,
           scene->seed, r.nexposed, r.nsequence, r.ngrasp);
    if (r.block >= 0) {
        int n = scene->task.grid;
        printf("; largest visibility: %.0f %%, block (%d,%d) lifted%s%s, %.2f N",
               100 * r.visibility, r.block % n + 1, r.block / n + 1,
               fold[r.first] ? fold[r.first] : "", fold[r.second] ? fold[r.second] : "", r.force);
    }
    printf("\n");
    return r.nexposed > 0 ? OM_EXIT_OK : OM_EXIT_FAILED;
}

// Layouts FIRST to FIRST + N - 1, a line each. A layout that cannot be run stops the rest; those before it are kept.
static int run_layouts(Settings* s) {
    char dir[OM_SCENE_PATH];
    int nexposed = 0;
    double twin_ms = 0, pace = 0;
    for (int k = s->first; k < s->first + s->nlayout; ++k) {
        char name[32], trials[1200] = "";
        snprintf(name, sizeof name, "layout-%02d", k);
        OmStatus status = om_path_join(s->out, name, dir, sizeof dir);
        s->scene.seed = k;
        s->has_preplan = false;
        if (status == OM_OK) status = plan_before(s, dir, trials, sizeof trials);
        OmRetractDef def = make_def(s, dir);
        OmRetractResult r;
        if (status == OM_OK) status = om_path_make_dir(s->out);
        if (status == OM_OK) status = om_retract_run(&def, om_cli_progress(s->is_quiet), &r);
        if (status < 0) return om_cli_fail_trials("retract", status, trials);
        if (trials[0]) (void)om_path_remove(trials);
        om_cli_progress_done();
        char by_twin[32] = "not known to the twin";
        if (isfinite(r.force_max))
            snprintf(by_twin, sizeof by_twin, "%.2f N by the twin", r.force_max);
        printf("%2d  %-7s  ROI %3.0f -> %3.0f %%  %3d actions  %5.1f s  force %s, %.2f N in "
               "the truth  %s\n",
               k,
               r.is_exposed                      ? "exposed"
               : r.outcome == OM_RETRACT_IN_VIEW ? "in view"
                                                 : "hidden",
               100 * r.visibility_start, 100 * r.visibility_end, r.naction, r.time, by_twin,
               r.force_world_max, r.reason);
        fflush(stdout);
        nexposed += r.is_exposed;
        twin_ms += r.twin_step_ms / s->nlayout;
        pace += r.time / r.wall_time / s->nlayout;
        om_retract_result_done(&r);
    }
    om_cli_figure("layouts", s->nlayout);
    om_cli_figure("exposed", nexposed);
    om_cli_path(s->out);
    printf("%s: %d of %d layouts exposed; a twin step %.2f ms; %.1f x real time; reports in "
           "%s/layout-*\n",
           s->scene.name, nexposed, s->nlayout, twin_ms, pace, s->out);
    return nexposed == s->nlayout ? OM_EXIT_OK : OM_EXIT_FAILED;
}

// Decide again from the observations of a recorded run. Exit code 1: another decision; both are printed.
static int replay(const OmCliArgs* args) {
    Settings s = {.is_quiet = om_cli_get(args, "--quiet") != NULL};
    OmReplayDef def = om_replay_default_def(om_cli_get(args, "--replay"));
    OmReplayResult r;
    OmEngineSet engines = om_engine_set_default();
    OmStatus status = om_engine_set_add(&engines, om_umesh_engine());
    def.path = om_cli_get(args, "--output");
    def.engines = &engines;
    if (status == OM_OK) status = om_cli_int(args, "--workers", &def.nworker);
    if (status == OM_OK) status = om_retract_replay(&def, om_cli_progress(s.is_quiet), &r);
    if (status < 0) return om_cli_fail("retract", status);
    om_cli_progress_done();
    printf("%s\n", r.reason);
    if (r.line) printf("the run:\n%s\nthe replay:\n%s\n", r.was, r.now);
    om_cli_figure("same", r.is_same);
    om_cli_figure("lines", r.nline);
    om_cli_reason(r.reason);
    int code = r.is_same ? OM_EXIT_OK : OM_EXIT_FAILED;
    om_replay_result_done(&r);
    return code;
}

static int calibrate(const Settings* s) {
    OmForceCalibration c;
    int nlayout = s->nlayout ? s->nlayout : 17;
    OmStatus status = om_retract_calibrate_force(&s->scene, nlayout, s->nworker,
                                                 om_cli_progress(s->is_quiet), &c);
    if (status < 0) return om_cli_fail("retract", status);
    om_cli_progress_done();
    om_cli_figure("layouts", nlayout);
    om_cli_figure("force_threshold_n", c.threshold);
    om_cli_figure("force_margin_n", c.margin);
    printf(
        "%s: largest pull of %d grasps in %d layouts: median %.3f N (quartiles %.3f, %.3f; largest %.3f, "
        "cut off at twice the threshold)\n"
        "force_threshold: %.2f  # N, twice the median\n"
        "force_margin: %.2f  # N, 95 %% quantile of truth less twin at %d instants; median %.2f N\n",
        s->scene.name, c.nrun, nlayout, c.median, c.lower_quartile, c.upper_quartile, c.max,
        c.threshold, c.margin, c.npair, c.more_median);
    return OM_EXIT_OK;
}

static int calibrate_mesh(const Settings* s) {
    OmSite site = {0};
    double factor;
    OmStatus status = om_site_build(&s->scene, OM_SITE_TWIN, om_cli_progress(s->is_quiet), &site);
    if (status == OM_OK) status = om_body_find_mesh_factor(&site, &factor);
    om_cli_progress_done();
    if (status >= 0) {
        om_cli_figure("mesh_factor", factor);
        printf("%s: under its own weight the twin's mesh of %d tetrahedra yields "
               "%.0f %% as much as the same mesh refined\n"
               "mesh_factor: %.2f  # under `tissue:`, the twin's modulus over that of the tissue\n",
               s->scene.name, site.mesh.ntet, 100 * factor, factor);
    }
    om_site_done(&site);
    return status < 0 ? om_cli_fail("retract", status) : OM_EXIT_OK;
}

// What needs no run: a scene's text, an example, or the page of all keys.
static int print_text(const OmCliArgs* args, Settings* s) {
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

static OmStatus read_settings(const OmCliArgs* args, Settings* s) {
    int npositional;
    OM_TRY(om_cli_check(args, 1, &npositional));
    s->needs_scene = !om_cli_get(args, "--example") && !om_cli_get(args, "--keys") &&
                     !om_cli_get(args, "--replay");
    if (!s->needs_scene) {
        OM_CHECK(npositional == 0, OM_INVALID, "\"%s\" is one argument too many",
                 om_cli_positional(args, 0));
        return OM_OK;
    }
    OM_CHECK(npositional == 1, OM_INVALID, "no scene is given; see omentum retract --help");
    s->out = om_cli_get(args, "--output");
    s->program = om_cli_get(args, "--program");
    s->is_quiet = om_cli_get(args, "--quiet") != NULL;
    s->records_acquisitions = om_cli_get(args, "--record-acquisitions") != NULL;
    s->is_defras = om_cli_get(args, "--defras") != NULL;
    s->person.reads = om_cli_get(args, "--supervise") != NULL;
    s->person.is_paced = om_cli_get(args, "--real-time") != NULL;
    s->needs_approval = om_cli_get(args, "--approve") != NULL;
    s->has_both_arms = om_cli_get(args, "--both-arms") != NULL;
    OM_CHECK(s->person.reads || !s->needs_approval, OM_INVALID, "--approve needs --supervise");
    s->records_observations = om_cli_get(args, "--record") != NULL;
    s->first = 1;
    OM_TRY(om_cli_int(args, "--layouts", &s->nlayout));
    OM_TRY(om_cli_int(args, "--first", &s->first));
    OM_TRY(om_cli_int(args, "--workers", &s->nworker));
    bool has_folder = !om_cli_get(args, "--calibrate-force") && !om_cli_get(args, "--search") &&
                      !om_cli_get(args, "--calibrate-mesh") && !om_cli_get(args, "--print-scene") &&
                      !om_cli_get(args, "--dry-run");
    OM_CHECK(!om_cli_get(args, "--search") || !om_cli_get(args, "--update"), OM_INVALID,
             "--search has no updates; leave out --update");
    OM_CHECK(s->out || !has_folder, OM_INVALID, "no output folder is given; add -o DIR");
    return OM_OK;
}

static OmStatus read_scene(const OmCliArgs* args, Settings* s) {
    const OmTissueEngine* engine;
    OM_TRY(om_scene_load(om_cli_positional(args, 0), &s->scene));
    s->engines = om_engine_set_default();
    OM_TRY(om_engine_set_add(&s->engines, om_umesh_engine()));
    s->scene.engines = &s->engines;
    OM_TRY(om_body_find_engine(&s->scene, OM_SITE_TWIN, &engine));
    const char* data = om_cli_get(args, "--data");
    if (data) {
        OM_CHECK(strlen(data) < sizeof s->scene.data_root, OM_INVALID,
                 "option --data: path too long");
        strcpy(s->scene.data_root, data);
    }
    OM_TRY(om_cli_int(args, "--layout", &s->scene.seed));
    if (om_cli_get(args, "--update")) s->scene.update.is_enabled = true;
    if (om_cli_get(args, "--force-threshold")) s->scene.task.force_margin = 0;
    OM_TRY(om_cli_double(args, "--force-threshold", &s->scene.task.force_threshold));
    if (s->is_defras) {
        s->scene.monitor.is_enabled = s->scene.update.is_enabled = true;
        s->scene.update.learns_modulus_by_shape = om_engine_uses(engine, "young");
        if (s->scene.task.ahead == 0) s->scene.task.ahead = AHEAD_POINTS;
        if (strcmp(s->scene.update.network, "none") == 0)
            strcpy(s->scene.update.network, "installed");
    }
    const char* plan = om_cli_get(args, "--plan");
    OM_CHECK(!plan || s->nlayout == 0, OM_INVALID, "--plan is for one layout; leave out --layouts");
    s->has_preplan = plan != NULL;
    const char* acting = om_cli_get(args, "--acting");
    OM_CHECK(!acting || !s->records_observations, OM_INVALID,
             "--acting: a run by a policy cannot be replayed; leave out --record");
    if (acting) OM_TRY(om_cli_acting_load(acting, &s->acting));
    return plan ? om_preplan_load(plan, &s->preplan) : OM_OK;
}

int om_cli_retract(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    Settings s = {0};
    if (read_settings(&args, &s) < 0) {
        fprintf(stderr, "omentum retract: %s\n", om_error_message());
        return OM_EXIT_USAGE;
    }
    if (om_cli_get(&args, "--replay")) return replay(&args);
    if (!s.needs_scene) return print_text(&args, &s);
    OmStatus status = read_scene(&args, &s);
    const char* const input[] = {om_cli_positional(&args, 0), s.program};
    if (status == OM_OK) status = om_cli_check_apart(s.out, input, 2);
    if (status < 0) return om_cli_fail("retract", status);
    if (om_cli_get(&args, "--print-scene")) return print_text(&args, &s);
    if (om_cli_get(&args, "--dry-run")) return dry_run(&s);
    if (om_cli_get(&args, "--calibrate-force")) return calibrate(&s);
    if (om_cli_get(&args, "--calibrate-mesh")) return calibrate_mesh(&s);
    if (om_cli_get(&args, "--search")) return search(&s);
    int code = s.nlayout ? run_layouts(&s) : run(&s);
    om_cli_acting_done(&s.acting);
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
        "  omentum retract scenes/sheet.yaml --layouts 17 -o out/sheet\n"
        "  omentum retract scenes/sheet.yaml --layouts 17 --first 18 -o out/unseen\n"
        "  omentum retract scenes/sheet.yaml --layout 11 --search\n"
        "  omentum retract scenes/sheet.yaml --acting weights/approach.safetensors -o out/policy\n"
        "  omentum retract scenes/belief.yaml --update -o out/belief\n"
        "  omentum retract scenes/belief.yaml --defras -o out/defras\n"
        "  omentum retract scenes/belief.yaml --defras --supervise --approve --real-time -o out/watched\n"
        "  omentum retract scenes/belief.yaml --defras --record -o out/recorded\n"
        "  omentum retract --replay out/recorded\n"
        "  omentum retract scenes/sheet.yaml --dry-run\n"
        "  omentum retract --example > my.yaml\n"
        "  omentum retract scenes/kidney.yaml --print-scene\n"
        "  omentum retract scenes/sheet.yaml --calibrate-force\n"
        "  omentum retract scenes/sheet.yaml --calibrate-mesh",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
