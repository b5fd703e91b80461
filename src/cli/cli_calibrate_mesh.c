// cli_calibrate_mesh.c: omentum calibrate-mesh.
#include "cli_retract.h"
#include "omentum/umesh_net.h"

static const OmCliOption option[] = {
    OM_CLI_OPTION_DATA,
    {"--layout", NULL, "K", "seed of attachments and ROI", "the scene's", NULL, 0, 2147483647},
    OM_CLI_OPTION_QUIET,
};

static const OmCliKey result_key[] = {
    {"mesh_factor", "measured"},
};

static int calibrate_mesh(const OmCliRetract* s) {
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
    return status < 0 ? om_cli_fail("calibrate-mesh", status) : OM_EXIT_OK;
}

int om_cli_calibrate_mesh(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmCliRetract s = {.verb = "calibrate-mesh"};
    int code = om_cli_retract_begin(&args, false, &s);
    if (code != OM_EXIT_OK) return code;
    return calibrate_mesh(&s);
}

const OmCliVerb om_cli_verb_calibrate_mesh = {
    .name = "calibrate-mesh",
    .run = om_cli_calibrate_mesh,
    .summary = "measure how much too stiffly the mesh of a scene bends",
    .usage = "omentum calibrate-mesh SCENE.yaml [options]",
    .about =
        "Prints mesh_factor, the twin's modulus over that of the tissue: the same mesh refined yields\n"
        "that much more to gravity.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum calibrate-mesh scenes/sheet.yaml",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
