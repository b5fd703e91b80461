// cli_calibrate_force.c: omentum calibrate-force.
#include <stdlib.h>

#include "cli_retract.h"
#include "omentum/trial_search.h"

static const OmCliOption option[] = {
    OM_CLI_OPTION_DATA,
    {"--count", NULL, "N", "number of layouts", "17", NULL, 1, 10000},
    {"--young", NULL, "LO,HI",
     "the truth's modulus from LO to HI times the twin's (default: the scene's)"},
    OM_CLI_OPTION_WORKERS,
    OM_CLI_OPTION_QUIET,
};

static const OmCliKey result_key[] = {
    {"layouts", "that were measured"},
    {"force_threshold_n", "measured"},
    {"force_margin_n", "measured"},
    {"held_median_n", "largest pull above attachments, median"},
};

static OmStatus read_young(const OmCliArgs* args, double young[2], bool* is_given) {
    const char* text = om_cli_get(args, "--young");
    char* end;
    *is_given = text != NULL;
    if (!text) return OM_OK;
    young[0] = strtod(text, &end);
    if (*end == ',') young[1] = strtod(end + 1, &end);
    OM_CHECK(end != text && *end == 0 && young[0] > 0 && young[1] >= young[0] && young[1] < 1e6,
             OM_INVALID, "--young: \"%s\" is not of the form LO,HI, as 0.5,2", text);
    return OM_OK;
}

static int calibrate(const OmCliRetract* s, const double* young) {
    OmForceCalibration c;
    int nlayout = s->nlayout ? s->nlayout : 17;
    OmStatus status = om_retract_calibrate_force(&s->scene, young, nlayout, s->nworker,
                                                 om_cli_progress(s->is_quiet), &c);
    if (status < 0) return om_cli_fail("calibrate-force", status);
    om_cli_progress_done();
    om_cli_figure("layouts", nlayout);
    om_cli_figure("force_threshold_n", c.threshold);
    om_cli_figure("force_margin_n", c.margin);
    om_cli_figure("held_median_n", c.held_median);
    printf(
        "%s: largest pull of %d grasps of free tissue in %d layouts: median %.3f N (quartiles %.3f, %.3f; "
        "largest %.3f, cut off at twice the threshold)\n"
        "%d grasps above attachments, which the robot leaves out: median %.3f N\n"
        "force_threshold: %.2f  # N, twice the median of free tissue; thesis 0.3 N for its sheet\n"
        "force_margin: %.2f  # N: the arms act at %.2f N of the twin, where the truth stays below the threshold\n"
        "in 95 %% of %d instants; it bears %.2f N more than the twin (median)\n",
        s->scene.name, c.nrun, nlayout, c.median, c.lower_quartile, c.upper_quartile, c.max,
        c.nheld, c.held_median, c.threshold, c.margin, c.threshold - c.margin, c.npair,
        c.more_median);
    return OM_EXIT_OK;
}

int om_cli_calibrate_force(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmCliRetract s = {.verb = "calibrate-force"};
    int code = om_cli_retract_begin(&args, false, &s);
    if (code != OM_EXIT_OK) return code;
    double young[2] = {0, 0};
    bool is_given;
    OmStatus status = read_young(&args, young, &is_given);
    if (status < 0) return om_cli_fail("calibrate-force", status);
    return calibrate(&s, is_given ? young : NULL);
}

const OmCliVerb om_cli_verb_calibrate_force = {
    .name = "calibrate-force",
    .run = om_cli_calibrate_force,
    .summary = "measure the force threshold and margin of a scene (thesis, 6.5.1)",
    .usage = "omentum calibrate-force SCENE.yaml [options]",
    .about =
        "Pulls at every block of many layouts, until the ROI is seen, and prints force_threshold, twice the\n"
        "median of the largest pulls of free tissue, and force_margin, as the scene's `task:` has them. Grasps\n"
        "above attachments are counted apart. The margin is for the modulus of the scene's simulated truth;\n"
        "with --young, for a range of moduli.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum calibrate-force scenes/sheet.yaml\n"
               "  omentum calibrate-force scenes/sheet.yaml --young 0.5,2\n"
               "  omentum calibrate-force scenes/kidney.yaml --data /path/to/data --count 5",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
