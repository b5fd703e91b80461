// cli_calibrate.c: omentum calibrate: the parameters of a tissue from observations.
#include <math.h>
#include <string.h>

#include "cli_common.h"
#include "omentum/calibrate_problem.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR",
     "journal, report and calibrated.yaml; evaluations on file are not repeated"},
    {"--observations", NULL, "FILE.csv", "instead of the file that the problem names"},
    {"--seed", NULL, "N", "seed instead of the problem's", NULL, NULL, 0, 2147483647},
    {"--synthetic", NULL, "OUT.csv", "write synthetic observations of the scene's world instead"},
    {"--set", NULL, "NAME=VALUE",
     "with --synthetic: a parameter of the scene's world; may be repeated"},
    {"--workers", NULL, "N", "threads", "one per processor", NULL, 0, OM_MAX_WORKER},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"error_start_mm", "error with the start values"},
    {"error_mm", "error with the calibrated values"},
    {"evaluations", "simulations in all"},
    {"parameter.*", "the value of each parameter, in the unit of its name"},
};

// ---- results --------------------------------------------------------------------------------------

static void print_param(const OmCalibrationDef* def, const OmCalibrationResult* r, int k) {
    const OmCalibrationParam* p = &def->param[k];
    const OmCalibrationProfile* f = &r->profile[k];
    printf("%s: %.6g (start %.6g", p->name, r->best[k] / p->unit, p->start / p->unit);
    if (r->has_profile) printf(", %.4g to %.4g", f->lo / p->unit, f->hi / p->unit);
    if (r->is_of_mesh && r->has_profile)
        printf(" of this mesh; %.4g to %.4g with its error", f->mesh_lo / p->unit,
               f->mesh_hi / p->unit);
    printf(")%s", !r->has_profile || f->is_determined ? "\n" : ": not determined by the data");
    if (!r->has_profile || f->is_determined) return;
    if (f->partner >= 0)
        printf(" apart from %s\n", def->param[f->partner].name);
    else
        printf(", it is open %s\n", f->is_open_lo && f->is_open_hi ? "on both sides"
                                    : f->is_open_lo                ? "below"
                                                                   : "above");
}

static void print_result(const OmCalibrationDef* def, const OmCalibrationResult* r) {
    static const char* const outcome[] = {
        "calibrated", "not finished: the limit of evaluations is reached", "the model cannot fit"};
    printf("%s: error %.3f mm at the start, %.3f mm now", outcome[r->outcome], 1e3 * r->cost_start,
           1e3 * r->cost);
    if (def->noise > 0) printf(", noise %.3f mm", 1e3 * def->noise);
    printf("\n%d evaluations (%d new)\n", r->neval, r->nnew);
    for (int k = 0; k < def->nparam; ++k) print_param(def, r, k);
    if (r->is_of_mesh)
        printf(
            "note: these values hold for this mesh: with a mesh %.2g times finer the predictions differ by %.3f "
            "mm; make the mesh finer\n",
            r->mesh_ratio, 1e3 * r->mesh_difference);
    om_cli_figure("error_start_mm", 1e3 * r->cost_start);
    om_cli_figure("error_mm", 1e3 * r->cost);
    om_cli_figure("evaluations", r->neval);
    for (int k = 0; k < def->nparam; ++k) {
        char name[256];
        snprintf(name, sizeof name, "parameter.%s", def->param[k].name);
        om_cli_figure(name, r->best[k] / def->param[k].unit);
    }
    om_cli_path(def->out_dir);
    printf("report: %s/report.html\n", def->out_dir);
}

// ---- synthetic observations -----------------------------------------------------------------------

static OmStatus set_value(const OmCalibrationDef* def, const char* word, double* param) {
    const char *equals = strchr(word, '='), *name[OM_CALIBRATION_MAX_PARAM];
    size_t n = equals ? (size_t)(equals - word) : 0;
    OM_CHECK(n > 0, OM_INVALID, "--set: \"%s\" is not NAME=VALUE", word);
    for (int k = 0; k < def->nparam; ++k) {
        const OmCalibrationParam* p = &def->param[k];
        name[k] = p->name;
        if (strlen(p->name) != n || strncmp(p->name, word, n) != 0) continue;
        const char *at = equals + 1, *end = word + strlen(word);
        OM_CHECK(om_number_parse(&at, end, &param[k]) && at == end && isfinite(param[k]),
                 OM_INVALID, "--set: \"%s\" is not a number", equals + 1);
        param[k] *= p->unit;
        return OM_OK;
    }
    const char* near = om_nearest_word(word, name, def->nparam);
    return om_error(OM_INVALID, "--set: the problem has no parameter \"%.*s\"%s%s", (int)n, word,
                    near ? "; did you mean " : "", near ? near : "");
}

static int write_synthetic(const OmCliArgs* args, const OmCalibrationProblem* problem,
                           const OmCalibrationDef* def) {
    double param[OM_CALIBRATION_MAX_PARAM];
    memcpy(param, om_calibration_problem_start(problem), (size_t)def->nparam * sizeof *param);
    const char *word, *out = om_cli_get(args, "--synthetic");
    OmStatus status = om_file_check_ours(out, NULL);
    for (int i = 0; status == OM_OK && (word = om_cli_get_nth(args, "--set", i)); ++i)
        status = set_value(def, word, param);
    if (status == OM_OK)
        status = om_calibration_save_synthetic(problem, param, def->noise / sqrt(8 / OM_PI),
                                               def->seed, out);
    if (status < 0) return om_cli_fail("calibrate", status);
    om_cli_clean_beside(out);
    printf("synthetic observations: %s\n", out);
    om_cli_path(out);
    return OM_EXIT_OK;
}

// ---- the verb -------------------------------------------------------------------------------------

static OmStatus check_args(const OmCliArgs* args) {
    int npositional, number = 1;
    OM_TRY(om_cli_check(args, 1, &npositional));
    OM_CHECK(npositional == 1, OM_INVALID, "no problem is given; see --help");
    const char *dir = om_cli_get(args, "--output"), *csv = om_cli_get(args, "--synthetic");
    OM_CHECK(dir || csv, OM_INVALID, "no output folder is given; add -o DIR");
    OM_CHECK(!dir || !csv, OM_INVALID, "-o and --synthetic exclude each other");
    OM_CHECK(csv || !om_cli_get(args, "--set"), OM_INVALID, "--set needs --synthetic");
    OM_TRY(om_cli_int(args, "--seed", &number));
    return om_cli_int(args, "--workers", &number);
}

static int calibrate(const OmCliArgs* args, const OmCalibrationDef* search) {
    OmCalibrationDef def = *search;
    OmCalibrationResult result;
    OmStatus status = om_cli_int(args, "--workers", &def.nworker);
    def.out_dir = om_cli_get(args, "--output");
    om_log_set_sink(NULL, NULL);  // warnings about parameters that the search only tries
    const OmProgress* progress = om_cli_progress(om_cli_get(args, "--quiet") != NULL);
    if (status == OM_OK) status = om_calibration_run(&def, progress, &result);
    if (status < 0) return om_cli_fail_kept("calibrate", status);
    om_cli_progress_done();
    print_result(&def, &result);
    om_calibration_result_done(&result);
    return status == OM_OK ? OM_EXIT_OK : OM_EXIT_FAILED;
}

// The problem may lie in the output folder, as the problem of a study's search does; its inputs are
// not overwritten.
static OmStatus check_inputs(const OmCalibrationProblem* problem, const char* dir) {
    static const char* const name[] = {"journal.jsonl", "report.html", "calibration.json",
                                       "calibrated.yaml"};
    for (int k = 0; dir && k < 4; ++k) {
        char path[1024];
        const char* input;
        OM_TRY(om_path_join(dir, name[k], path, sizeof path));
        for (int i = 0; (input = om_calibration_problem_input(problem, i)) != NULL; ++i)
            OM_TRY(om_path_check_apart(input, path));
    }
    return OM_OK;
}

// A file with every place at the origin says what is to be observed, not what was.
static OmStatus check_observed(const OmCalibrationProblem* problem) {
    int n;
    const OmCalibrationSeen* seen = om_calibration_problem_seen(problem, &n);
    for (int i = 0; i < n; ++i)
        if (seen[i].x.x != 0 || seen[i].x.y != 0 || seen[i].x.z != 0) return OM_OK;
    return om_error(
        OM_INVALID,
        "%s: all %d observations are 0, as in a plan of what is to be observed; --synthetic FILE fills in "
        "simulated ones, --observations FILE takes those or measured ones",
        om_calibration_problem_input(problem, 2), n);
}

int om_cli_calibrate(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    if (check_args(&args) < 0) return om_cli_usage("calibrate");
    OmCalibrationProblem* problem;
    OmStatus status = om_calibration_problem_load(om_cli_positional(&args, 0),
                                                  om_cli_get(&args, "--observations"), &problem);
    if (status < 0) return om_cli_fail("calibrate", status);
    status = check_inputs(problem, om_cli_get(&args, "--output"));
    if (status == OM_OK && !om_cli_get(&args, "--synthetic")) status = check_observed(problem);
    if (status < 0) {
        om_calibration_problem_destroy(problem);
        return om_cli_fail("calibrate", status);
    }
    OmCalibrationDef def = om_calibration_problem_search(problem);
    int seed = (int)def.seed;
    om_cli_int(&args, "--seed", &seed);  // already checked
    def.seed = (uint64_t)seed;
    int code = om_cli_get(&args, "--synthetic") ? write_synthetic(&args, problem, &def)
                                                : calibrate(&args, &def);
    om_calibration_problem_destroy(problem);
    return code;
}

const OmCliVerb om_cli_verb_calibrate = {
    .name = "calibrate",
    .run = om_cli_calibrate,
    .summary = "find a tissue's parameters from observations",
    .usage = "omentum calibrate PROBLEM.yaml -o DIR [options]\n"
             "omentum calibrate PROBLEM.yaml --synthetic OUT.csv [--set NAME=VALUE ...]",
    .about =
        "The problem names a scene, its parameters with bounds, the paths of probe or grasper, and a file\n"
        "of observations: landmarks, point clouds, forces (doc/calibrate.md). The stages are a global\n"
        "search, a local search within 40 % of the range, and profiles, which show how far each parameter\n"
        "can change before the error rises. DIR receives report.html, calibration.json, calibrated.yaml\n"
        "(for the key `calibrated:` of a scene) and journal.jsonl, from which an interrupted calibration\n"
        "continues. Exit code 0: calibrated; 1: the model cannot fit, or the limit of evaluations is\n"
        "reached.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum calibrate gel.yaml -o out/gel\n"
               "  omentum calibrate gel.yaml --synthetic planned.csv --set tissue.young=5000\n"
               "  omentum calibrate gel.yaml --observations planned.csv -o out/planned",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
