// cli_layouts.c: omentum layouts.
#include "cli_retract.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder for the folders of the layouts"},
    OM_CLI_OPTION_DATA,
    {"--count", NULL, "N", "number of layouts", "17", NULL, 1, 10000},
    {"--first", NULL, "K", "the first layout", "1", NULL, 0, 1000000},
    {"--program", NULL, "FILE", "a logic program instead of the built-in one"},
    OM_CLI_OPTION_FORCE,
    {"--update", NULL, NULL, "correct the twin's attachments while it runs"},
    {"--defras", NULL, NULL, "as --defras of omentum retract"},
    {"--acting", NULL, "FILE", "carry out reaches and pulls by this policy", "straight lines"},
    {"--both-arms", NULL, NULL,
     "an arm may keep its tissue up while the other one grasps and pulls"},
    {"--record-acquisitions", NULL, NULL, "write what the depth camera saw"},
    {"--record", NULL, NULL, "write all that the robot observes, for omentum replay"},
    OM_CLI_OPTION_WORKERS,
    OM_CLI_OPTION_QUIET,
};

static const OmCliKey result_key[] = {
    {"layouts", "that were run"},
    {"exposed", "of these"},
};

// Layouts FIRST to FIRST + N - 1, a line each. A layout that cannot be run stops the rest; those before it are kept.
static int run_layouts(OmCliRetract* s) {
    char dir[OM_SCENE_PATH];
    int nexposed = 0;
    double twin_ms = 0, pace = 0;
    for (int k = s->first; k < s->first + s->nlayout; ++k) {
        char name[32], trials[1200] = "";
        snprintf(name, sizeof name, "layout-%02d", k);
        OmStatus status = om_path_join(s->out, name, dir, sizeof dir);
        s->scene.seed = k;
        s->has_preplan = false;
        if (status == OM_OK) status = om_cli_retract_plan(s, dir, trials, sizeof trials);
        OmRetractDef def = om_cli_retract_def(s, dir);
        OmRetractResult r;
        if (status == OM_OK) status = om_path_make_dir(s->out);
        if (status == OM_OK) status = om_retract_run(&def, om_cli_progress(s->is_quiet), &r);
        if (status < 0) return om_cli_fail_trials("layouts", status, trials);
        if (trials[0]) (void)om_path_remove(trials);
        om_cli_progress_done();
        char by_twin[32] = "not known to the twin";
        if (isfinite(r.twin.force))
            snprintf(by_twin, sizeof by_twin, "%.2f N by the twin", r.twin.force);
        printf("%2d  %-7s  ROI %3.0f -> %3.0f %%  %3d actions  %5.1f s  force %s, %.2f N in "
               "the truth  %s\n",
               k,
               r.is_exposed                      ? "exposed"
               : r.outcome == OM_RETRACT_IN_VIEW ? "in view"
                                                 : "hidden",
               100 * r.visibility_start, 100 * r.visibility_end, r.naction, r.time, by_twin,
               r.truth.force, r.reason);
        fflush(stdout);
        nexposed += r.is_exposed;
        twin_ms += r.twin.step_ms / s->nlayout;
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

int om_cli_layouts(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmCliRetract s = {.verb = "layouts"};
    int code = om_cli_retract_begin(&args, true, &s);
    if (code != OM_EXIT_OK) return code;
    code = run_layouts(&s);
    om_rl_acting_destroy(s.acting);
    return code;
}

const OmCliVerb om_cli_verb_layouts = {
    .name = "layouts",
    .run = om_cli_layouts,
    .summary = "run a scene with many layouts, each in its own folder",
    .usage = "omentum layouts SCENE.yaml -o DIR [options]",
    .about =
        "Layouts are seeds of attachments and ROI. Each one is run as by omentum retract, into DIR/layout-NN,\n"
        "with a line of its result. Exit code 0: all were exposed.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum layouts scenes/sheet.yaml -o out/sheet\n"
               "  omentum layouts scenes/sheet.yaml --count 17 --first 18 -o out/unseen",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
