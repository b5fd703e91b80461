// cli_dvrk.c: omentum dvrk: a simulated da Vinci Research Kit on the topics of ROS 2.
#include <math.h>
#include <string.h>

#include "cli_retract.h"

static const OmCliOption option[] = {
    OM_CLI_OPTION_DDS,
    OM_CLI_OPTION_ARMS,
    {"--time", NULL, "S", "end after S seconds of the simulated field", "until Ctrl-C", "s", 1e-3,
     1e9},
    {"--rate", NULL, "HZ", "messages of the arms in a second", "100", "Hz", 1, 1000},
    {"--pictures", NULL, "HZ", "pictures and clouds in a second, while somebody reads them", "30",
     "Hz", 0, 1000},
    {"--lock-step", NULL, NULL, "time advances only with omentum retract --world dds"},
    {"--udp", NULL, "PORT", "commands in JSON by UDP, too, for this machine alone", "none", NULL, 1,
     65535},
    {"--igtl", NULL, "PORT", "tools and tissue by OpenIGTLink, too, for 3D Slicer on this machine",
     "none", NULL, 1, 65535},
    {"--record", NULL, "FILE", "all messages to a new file, MCAP as rosbag2 reads it", "none"},
    {"--record-pictures", NULL, NULL, "with pictures and clouds, about 40 MB a second"},
    {"--instrument", NULL, "FILE",
     "instrument of both arms, a file of the dVRK: share/tool/NAME_NUMBER.json", "a ProGrasp"},
    {"--arm", NULL, "FILE", "the same for the arm: PSM_Si.json for an S or Si instrument",
     "Classic"},
    {"--stamped-strings", NULL, NULL,
     "error, warning and status are crtk_msgs/StringStamped, as in JHU's simulators"},
    OM_CLI_OPTION_DATA,
    {"--layout", NULL, "K", "seed of attachments and ROI", "the scene's", NULL, 0, 2147483647},
    OM_CLI_OPTION_WORKERS,
    OM_CLI_OPTION_QUIET,
};

static const OmCliKey result_key[] = {
    {"time_s", "of the simulated field"},
    {"wall_s", "of the wall clock"},
    {"commands", "taken"},
    {"refused", "of them refused"},
    {"period_median_ms", "between two messages of an arm, by the wall clock"},
    {"period_99_ms", "99 % of the periods are below"},
    {"period_max_ms", "the longest"},
    {"late", "periods longer than one and a half"},
    {"pictures", "sent"},
    {"picture_ms", "mean to render and send one"},
    {"tissue_pace", "seconds of the tissue in a second of the arms"},
    {"step_max_ms", "the longest step of the tissue"},
};

OmStatus om_cli_dds(const OmCliArgs* args, OmDdsDef* dds) {
    *dds = om_dds_default_def();
    dds->network = om_cli_get(args, "--network");
    dds->peer = om_cli_get(args, "--peer");
    return om_cli_int(args, "--domain", &dds->domain);
}

OmStatus om_cli_arms(const OmCliArgs* args, char text[OM_CLI_NAMES], const char* arm[OM_MAX_ARM]) {
    const char* names = om_cli_get(args, "--arms");
    if (!names) return OM_OK;
    snprintf(text, OM_CLI_NAMES, "%s", names);
    char* comma = strchr(text, ',');
    OM_CHECK(comma && comma > text && comma[1] && !strchr(comma + 1, ',') &&
                 strlen(names) < OM_CLI_NAMES,
             OM_INVALID, "--arms \"%s\": give two names with a comma, as PSM2,PSM3", names);
    *comma = 0;
    arm[0] = text;
    arm[1] = comma + 1;
    return OM_OK;
}

static void say(void* ctx, const char* sentence) {
    (void)ctx;
    fprintf(stderr, "%s\n", sentence);
}

static void print_report(const OmDdsRobot* robot, double rate) {
    const OmDdsReport r = om_dds_robot_report(robot);
    printf("%.1f s of the field in %.1f s; %lld commands, %lld refused\n", r.time, r.wall_time,
           (long long)r.ncommand, (long long)r.nrefused);
    if (isfinite(r.period_median))
        printf(
            "  arms: a message every %.1f ms (median; %.1f ms wanted), 99 %% within %.1f ms, the longest %.1f "
            "ms; %lld of %lld late\n",
            1e3 * r.period_median, 1e3 / rate, 1e3 * r.period_99, 1e3 * r.period_max,
            (long long)r.nlate, (long long)r.ntick);
    if (r.npicture > 0)
        printf("  pictures: %lld, %.1f ms each\n", (long long)r.npicture, 1e3 * r.picture_render);
    if (isfinite(r.pace))
        printf("  tissue: %.2f s in a second of the arms; %lld steps, the longest %.1f ms\n",
               r.pace, (long long)r.nstep, 1e3 * r.step_max);
    om_cli_figure("time_s", r.time);
    om_cli_figure("wall_s", r.wall_time);
    om_cli_figure("commands", (double)r.ncommand);
    om_cli_figure("refused", (double)r.nrefused);
    om_cli_figure("period_median_ms", 1e3 * r.period_median);
    om_cli_figure("period_99_ms", 1e3 * r.period_99);
    om_cli_figure("period_max_ms", 1e3 * r.period_max);
    om_cli_figure("late", (double)r.nlate);
    om_cli_figure("pictures", (double)r.npicture);
    om_cli_figure("picture_ms", 1e3 * r.picture_render);
    om_cli_figure("tissue_pace", r.pace);
    om_cli_figure("step_max_ms", 1e3 * r.step_max);
}

// PROGRASP_FORCEPS_400093.json is PROGRASP_FORCEPS:400093, as the dVRK writes it.
static void name_tool(const char* path, char* type, size_t size) {
    const char* slash = strrchr(path, '/');
    snprintf(type, size, "%s", slash ? slash + 1 : path);
    char* end = strstr(type, ".json");
    if (end) *end = 0;
    char* number = strrchr(type, '_');
    if (number && number[1] && strspn(number + 1, "0123456789") == strlen(number + 1))
        *number = ':';
}

// The files of --instrument and --arm.
static OmStatus set_tools(const OmCliArgs* args, OmWorld* world) {
    const char *instrument = om_cli_get(args, "--instrument"), *arm = om_cli_get(args, "--arm");
    for (int a = 0; (instrument || arm) && a < om_world_narm(world); ++a) {
        OmPsm psm = *om_world_psm(world, a);
        if (instrument) OM_TRY(om_psm_load_instrument(instrument, &psm));
        if (arm) OM_TRY(om_psm_load_arm(arm, &psm));
        OM_TRY(om_world_set_tool(world, a, &psm));
    }
    return OM_OK;
}

// Build the field, let it come to rest, serve it.
static OmStatus serve(const OmCliArgs* args, OmCliRetract* s) {
    OmSite site = {0};
    OmWorld *world = NULL, *eyes = NULL;
    OmDdsRobot* robot = NULL;
    double seconds = INFINITY;
    char tool[128], names[OM_CLI_NAMES];
    const OmProgress* progress = om_cli_progress(true);
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_cli_double(args, "--time", &seconds));
    OM_TRY_DONE(om_site_build(&s->scene, OM_SITE_WORLD, progress, &site));
    OM_TRY_DONE(om_world_create_simulated(&s->scene, &site, s->nworker, &world));
    OM_TRY_DONE(set_tools(args, world));
    OM_TRY_DONE(om_world_reset(world));
    OmDdsRobotDef def = om_dds_robot_default_def(world, &s->scene, &site);
    OM_TRY_DONE(om_cli_dds(args, &def.dds));
    OM_TRY_DONE(om_cli_arms(args, names, def.arm));
    OM_TRY_DONE(om_cli_double(args, "--rate", &def.rate));
    OM_TRY_DONE(om_cli_double(args, "--pictures", &def.picture_rate));
    if (om_cli_get(args, "--instrument")) {
        name_tool(om_cli_get(args, "--instrument"), tool, sizeof tool);
        def.tool_type = tool;
    }
    def.is_lock_step = om_cli_get(args, "--lock-step") != NULL;
    if (!def.is_lock_step) {
        OM_TRY_DONE(om_world_create_simulated(&s->scene, &site, s->nworker, &eyes));
        OM_TRY_DONE(set_tools(args, eyes));
        def.eyes = eyes;
    }
    OM_TRY_DONE(om_cli_int(args, "--udp", &def.udp_port));
    OM_TRY_DONE(om_cli_int(args, "--igtl", &def.igtl_port));
    def.has_stamped_strings = om_cli_get(args, "--stamped-strings") != NULL;
    def.record = om_cli_get(args, "--record");
    def.has_record_pictures = om_cli_get(args, "--record-pictures") != NULL;
    if (!s->is_quiet) def.say = say;
    OM_TRY_DONE(om_dds_robot_create(&def, &robot));
    const bool has_two = om_world_narm(world) > 1;
    printf("%s, layout %d: %s%s%s on domain %d; Ctrl-C ends the program\n", s->scene.name,
           s->scene.seed, def.arm[0], has_two ? " and " : "", has_two ? def.arm[1] : "",
           def.dds.domain);
    fflush(stdout);
    status = om_dds_robot_run(robot, seconds, progress);
    if (status >= 0 || status == OM_CANCELLED) print_report(robot, def.rate);
    if (status >= 0 || status == OM_CANCELLED) OM_TRY_DONE(om_dds_robot_end_record(robot));
done:
    om_dds_robot_destroy(robot);
    om_world_destroy(world);
    om_world_destroy(eyes);
    om_site_done(&site);
    return status;
}

static int om_cli_dvrk(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmCliRetract s = {.verb = "dvrk"};
    const int code = om_cli_retract_begin(&args, false, &s);
    if (code != OM_EXIT_OK) return code;
    const OmStatus status = serve(&args, &s);
    return status >= 0 || status == OM_CANCELLED ? OM_EXIT_OK : om_cli_fail("dvrk", status);
}

const OmCliVerb om_cli_verb_dvrk = {
    .name = "dvrk",
    .run = om_cli_dvrk,
    .summary = "serve a scene as a da Vinci Research Kit, over DDS, for any CRTK client",
    .usage = "omentum dvrk SCENE.yaml [options]",
    .about =
        "PSM1 and PSM2 over the tissue of a scene, with a camera and a depth camera, on the topics and types of\n"
        "ROS 2 and CRTK: operating_state, measured_cp, servo_cp, move_cp, jaw/servo_jp and the others of doc/dvrk.md.\n"
        "ROS is not needed. A jaw that closes on tissue grasps it, and the tissue follows the arm. Arms begin\n"
        "disabled: send state_command \"home\". By default only this machine is reached, without multicast; with\n"
        "--network or --peer others are. CYCLONEDDS_URI is used where it is set and neither is given.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum dvrk scenes/sheet.yaml\n"
        "  omentum dvrk scenes/belief.yaml --domain 7 --time 60\n"
        "  omentum dvrk scenes/belief.yaml --lock-step\n"
        "  omentum dvrk scenes/sheet.yaml --network eth0\n"
        "  omentum dvrk scenes/sheet.yaml --instrument MONOPOLAR_CURVED_SCISSORS_400179.json",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
