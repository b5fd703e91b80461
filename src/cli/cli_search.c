// cli_search.c: omentum search.
#include "cli_retract.h"
#include "omentum/trial_search.h"

static const OmCliOption option[] = {
    OM_CLI_OPTION_DATA,
    {"--layout", NULL, "K", "seed of attachments and ROI", "the scene's", NULL, 0, 2147483647},
    OM_CLI_OPTION_FORCE,
    OM_CLI_OPTION_WORKERS,
    OM_CLI_OPTION_QUIET,
};

static const OmCliKey result_key[] = {
    {"layout", "seed of attachments and ROI"},
    {"exposed", "of the sequences"},
};

// Search whether any sequence of actions exposes the layout; print a line.
static int search(const OmCliRetract* s) {
    static const char* const fold[OM_PLAN_NVERB] = {[OM_PLAN_MOVE_ROI] = ", folded towards the ROI",
                                                    [OM_PLAN_MOVE_AWAY] =
                                                        ", folded away from the camera"};
    const OmScene* scene = &s->scene;
    OmSearchResult r;
    OmStatus status = om_retract_search(scene, scene->task.force_threshold, s->nworker,
                                        om_cli_progress(s->is_quiet), &r);
    if (status < 0) return om_cli_fail("search", status);
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

int om_cli_search(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmCliRetract s = {.verb = "search"};
    int code = om_cli_retract_begin(&args, false, &s);
    if (code != OM_EXIT_OK) return code;
    return search(&s);
}

const OmCliVerb om_cli_verb_search = {
    .name = "search",
    .run = om_cli_search,
    .summary =
        "try every sequence of actions on the simulated truth: can the ROI be exposed at all?",
    .usage = "omentum search SCENE.yaml [options]",
    .about =
        "Prints how many sequences of grasps, pulls and folds expose the ROI, and the one that shows most of it.\n"
        "Exit code 0: at least one exposes it.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum search scenes/sheet.yaml --layout 11",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
