// cli_replay.c: omentum replay.
#include "cli_retract.h"
#include "omentum/retract_replay.h"
#include "omentum/umesh_net.h"

static const OmCliOption option[] = {
    {"--output", "-o", "FILE", "write the audit of the replay here"},
    OM_CLI_OPTION_WORKERS,
    OM_CLI_OPTION_QUIET,
};

static const OmCliKey result_key[] = {
    {"same", "1 if all lines of the audit are the same, otherwise 0"},
    {"lines", "of the audit"},
};

// Decide again from the observations of a recorded run. Exit code 1: another decision; both are printed.
int om_cli_replay(int argc, char** argv) {
    const OmCliArgs all = {option, sizeof option / sizeof *option, argc, argv}, *args = &all;
    int npositional;
    OmStatus status = om_cli_check(args, 1, &npositional);
    if (status == OM_OK && npositional == 0)
        status =
            om_error(OM_INVALID, "no folder of a recorded run is given; see omentum replay --help");
    if (status < 0) return om_cli_usage("replay");
    bool is_quiet = om_cli_get(args, "--quiet") != NULL;
    OmReplayDef def = om_replay_default_def(om_cli_positional(args, 0));
    OmReplayResult r;
    OmEngineSet engines = om_engine_set_default();
    status = om_engine_set_add(&engines, om_umesh_engine());
    def.path = om_cli_get(args, "--output");
    def.engines = &engines;
    if (status == OM_OK) status = om_cli_int(args, "--workers", &def.nworker);
    // an estimate on a fine mesh takes seconds
    om_cli_set_end("omentum replay: cancelled; no file is half written\n", 0);
    if (status == OM_OK) status = om_retract_replay(&def, om_cli_progress(is_quiet), &r);
    om_cli_set_end(NULL, 0);
    if (status < 0) return om_cli_fail("replay", status);
    om_cli_progress_done();
    printf("%s\n", r.reason);
    if (r.note[0]) printf("note: %s\n", r.note);
    if (r.line) printf("the run:\n%s\nthe replay:\n%s\n", r.was, r.now);
    om_cli_figure("same", r.is_same);
    om_cli_figure("lines", r.nline);
    om_cli_reason(r.reason);
    int code = r.is_same ? OM_EXIT_OK : OM_EXIT_FAILED;
    om_replay_result_done(&r);
    return code;
}

const OmCliVerb om_cli_verb_replay = {
    .name = "replay",
    .run = om_cli_replay,
    .summary = "decide again from the observations of a recorded run",
    .usage = "omentum replay DIR [options]",
    .about =
        "DIR is the folder of a run with --record. Its observations are decided again, and the audit is compared with\n"
        "DIR/audit.jsonl. Exit code 0: all lines are the same; 1: one differs, and both are printed; 3: also where\n"
        "DIR/scene.yaml or a file that the replay reads was changed since the run.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum retract scenes/belief.yaml --defras --record -o out/recorded\n"
               "  omentum replay out/recorded",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
