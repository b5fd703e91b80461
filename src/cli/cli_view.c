// cli_view.c: omentum view: a recorded run, a run that is supervised, or a hand in the simulation, in a browser.
#include "cli_view.h"

#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "omentum/record_audit.h"
#include "omentum/record_words.h"

static const OmCliOption option[] = {
    {"--free", NULL, NULL,
     "no robot: grasp, pull and press the tissue with the mouse; always so without a scene"},
    {"--defras", NULL, NULL, "all of DEFRAS: plan before, monitor, updates, look-ahead"},
    {"--approve", NULL, NULL, "each plan waits for you"},
    {"--open", NULL, NULL, "open the page in the browser of this machine"},
    {"--output", "-o", "DIR", "also write the record of the run, as omentum retract does"},
    {"--port", NULL, "N", "port of the page; 0: any that is free", "8765", NULL, 0, 65535},
    {"--listen", NULL, "ADDRESS", "address of an interface, for other machines; needs --token",
     "127.0.0.1"},
    {"--token", NULL, "WORD", "that a page must know: letters and digits"},
    {"--unit", NULL, "mm|cm|m", "unit of a mesh's lengths", "the file's unit, else mm"},
    {"--up", NULL, "AXIS", "of a mesh, against gravity: x, y, z, -x, -y or -z", "z"},
    OM_CLI_OPTION_DATA,
    {"--layout", NULL, "K", "seed of attachments and ROI", "the scene's", NULL, 0, 2147483647},
    OM_CLI_OPTION_WORKERS,
    OM_CLI_OPTION_QUIET,
};

static const OmCliKey result_key[] = {
    {"visibility_end", "of a run: visible fraction of the ROI at its end, 0 to 1"},
    {"actions", "of a run: carried out"},
    {"force_truth_n", "of a run: largest force in the truth"},
};

void om_cli_view_wait(double origin, double time) {
    const double left = origin + time - om_clock_now();
    if (left <= 0) return;
    const double most = left < 0.2 ? left : 0.2;
    struct timespec t = {0, (long)(1e9 * most)};
    nanosleep(&t, NULL);
}

// Send what was written, and free it.
static OmStatus send(OmViewServer* server, OmJson* json, OmText* text) {
    OmStatus status = om_json_end(json);
    if (status == OM_OK)
        status = om_view_server_publish(server, OM_VIEW_LASTING, text->str, text->len);
    om_text_done(text);
    return status;
}

OmStatus om_cli_view_say(OmViewServer* server, const char* words, bool is_error) {
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "say", words);
    om_json_bool(&json, "is_error", is_error);
    om_json_close(&json, '}');
    return send(server, &json, &text);
}

// ---- a run ------------------------------------------------------------------------------------------------------

typedef struct Watch {  // of a page
    OmViewServer* server;
    double origin;  // s of the wall clock at the loop's time 0
    bool has_begun, was_heard;
    OmLoopPhase phase;
    bool is_paused;
    char plan[OM_AUDIT_NAME];  // that waits for consent; "": none
} Watch;

// What the page shows as buttons: may a plan begin, does the robot wait, is it paused?
static OmStatus say_state(Watch* w, const OmLoop* loop) {
    const OmLoopPhase phase = om_loop_phase(loop);
    const bool is_paused = om_loop_is_paused(loop);
    char plan[OM_AUDIT_NAME] = "";
    OmText text = {0};
    if (phase == OM_LOOP_CONSENT) om_audit_plan_name(loop, plan);
    if (w->has_begun && phase == w->phase && is_paused == w->is_paused &&
        strcmp(plan, w->plan) == 0)
        return OM_OK;
    memcpy(w->plan, plan, sizeof plan);
    w->phase = phase;
    w->is_paused = is_paused;
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "mode", "run");
    om_json_bool(&json, "paused", is_paused);
    om_json_bool(&json, "asks", phase == OM_LOOP_CONSENT);
    om_json_string(&json, "plan", plan);
    om_json_bool(&json, "holds", phase == OM_LOOP_HOLD);
    om_json_bool(&json, "ended", phase == OM_LOOP_ENDED);
    om_json_string(&json, "reason", phase == OM_LOOP_HOLD ? om_loop_hold_reason(loop) : "");
    om_json_close(&json, '}');
    return send(w->server, &json, &text);
}

// "yes NAME" and "no NAME" answer the plan of that name alone: a person may have looked at the one before. The name is
// taken off the line.
static OmStatus check_plan(const OmLoop* loop, char* line) {
    OmLoopCommand c;
    char name[OM_AUDIT_NAME], *given = strchr(line, ' ');
    if (given) *given++ = 0;
    const bool is_consent = om_loop_command_parse(line, om_loop_grid(loop), &c) == OM_OK &&
                            (c.kind == OM_LOOP_APPROVE || c.kind == OM_LOOP_REJECT);
    if (is_consent && om_loop_phase(loop) == OM_LOOP_CONSENT) {
        om_audit_plan_name(loop, name);
        OM_CHECK(given && given[0], OM_INVALID, "%s names no plan: %s waits; say %s %s", line, name,
                 line, name);
        OM_CHECK(strcmp(given, name) == 0, OM_INVALID,
                 "plan %.16s does not wait any more: look at plan %s, which took its place, and "
                 "answer again",
                 given, name);
    }
    if (given && !is_consent) given[-1] = ' ';
    return OM_OK;
}

static OmStatus obey(Watch* w, OmLoop* loop, char* line) {
    OmLoopCommand command;
    OmText words = {0};
    OmStatus status = check_plan(loop, line);
    if (status == OM_OK) status = om_loop_command_parse(line, om_loop_grid(loop), &command);
    if (status == OM_OK) status = om_loop_command(loop, &command);
    if (status == OM_OK) status = om_words_command(loop, &command, &words);
    if (status == OM_OK) status = om_cli_view_say(w->server, words.str, false);
    om_text_done(&words);
    return status == OM_INVALID ? om_cli_view_say(w->server, om_error_message(), true) : status;
}

// A page with the controls that is not heard any more pauses the run.
static OmStatus watch_page(Watch* w, OmLoop* loop) {
    const bool is_heard = om_view_server_silence(w->server) < OM_VIEW_SILENCE;
    const bool is_lost = w->was_heard && !is_heard;
    w->was_heard = is_heard;
    if (!is_lost || om_loop_is_paused(loop) || om_loop_phase(loop) == OM_LOOP_ENDED) return OM_OK;
    OM_TRY(om_cli_view_say(w->server, "the page with the controls is gone: paused; go continues",
                           true));
    return om_loop_command(loop, &(OmLoopCommand){OM_LOOP_PAUSE});
}

static OmStatus supervise(void* ctx, OmLoop* loop) {
    Watch* w = ctx;
    char line[OM_VIEW_MAX_LINE + 1];
    const double time = om_loop_sample(loop).time, now = om_clock_now();
    if (!w->has_begun || now - w->origin > time + 0.1) w->origin = now - time;
    OM_TRY(watch_page(w, loop));
    while (om_loop_phase(loop) != OM_LOOP_ENDED &&
           om_view_server_next(w->server, line, sizeof line))
        OM_TRY(obey(w, loop, line));
    OM_TRY(say_state(w, loop));
    w->has_begun = true;
    om_cli_view_wait(w->origin, time);
    return OM_OK;
}

// Until a page is open, or the user ends the program.
static OmStatus wait_for_page(OmViewServer* server) {
    while (om_view_server_count(server) == 0) {
        OM_TRY(om_progress_report(om_cli_progress(true), "view", 0, 0));
        om_cli_view_wait(om_clock_now(), 0.1);
    }
    return OM_OK;
}

// The page stays until the user ends the program.
static int stay(void) {
    while (!om_cli_is_interrupted()) om_cli_view_wait(om_clock_now(), 0.1);
    return OM_EXIT_OK;
}

int om_cli_view_run(OmCliRetract* s, OmViewServer* server) {
    Watch watch = {.server = server, .was_heard = true};
    char trials[1200] = "";
    OmRetractResult result;
    OmStatus status = om_cli_retract_plan(s, s->out, trials, sizeof trials);
    if (status == OM_OK) status = wait_for_page(server);
    OmRetractDef def = om_cli_retract_def(s, s->out);
    def.supervise = supervise;
    def.supervise_ctx = &watch;
    def.server = server;
    if (status == OM_OK) status = om_retract_run(&def, om_cli_progress(true), &result);
    if (status < 0) return om_cli_fail_trials("view", status, trials);
    if (trials[0]) (void)om_path_remove(trials);
    printf("%s, layout %d: %s\n", s->scene.name, s->scene.seed, result.reason);
    if (s->out)
        printf("  report: %s/report.html; in three dimensions: %s/view.html\n", s->out, s->out);
    fflush(stdout);
    om_cli_figure("visibility_end", result.visibility_end);
    om_cli_figure("actions", result.naction);
    om_cli_figure("force_truth_n", result.truth.force);
    om_cli_reason(result.reason);
    const int code = result.is_exposed ? OM_EXIT_OK : OM_EXIT_FAILED;
    om_retract_result_done(&result);
    stay();
    return code;
}

// ---- the verb ---------------------------------------------------------------------------------------------------

// The browser of the desktop, where there is one; the address is printed anyway.
static void open_browser(const char* url) {
    const pid_t child = fork();
    if (child != 0) return;
    setsid();  // Ctrl-C is not for it
    const int null = open("/dev/null", O_RDWR);
    for (int fd = 0; null >= 0 && fd < 3; ++fd) dup2(null, fd);
    execlp("xdg-open", "xdg-open", url, (char*)NULL);
    _exit(127);
}

static OmStatus serve(const OmCliArgs* args, const char* title, const char* file,
                      OmViewServer** server) {
    OmViewServerDef def = om_view_server_default_def();
    def.title = title;
    def.file = file;
    def.token = om_cli_get(args, "--token");
    if (om_cli_get(args, "--listen")) def.address = om_cli_get(args, "--listen");
    OM_TRY(om_cli_int(args, "--port", &def.port));
    OM_TRY(om_view_server_create(&def, server));
    printf("open %s in a browser; Ctrl-C ends the program\n", om_view_server_url(*server));
    fflush(stdout);
    if (om_cli_get(args, "--open")) open_browser(om_view_server_url(*server));
    return OM_OK;
}

// The page of a run's folder, or of a demo's. `path` is empty if `name` is no folder.
static OmStatus find_recording(const char* name, char* path, size_t size) {
    struct stat info;
    path[0] = 0;
    if (!name || stat(name, &info) != 0 || !S_ISDIR(info.st_mode)) return OM_OK;
    OM_TRY(om_path_join(name, "run/view.html", path, size));
    if (om_path_exists(path)) return OM_OK;
    OM_TRY(om_path_join(name, "patient.yaml", path, size));
    const bool is_model = om_path_exists(path);
    OM_TRY(om_path_join(name, "view.html", path, size));
    if (is_model && !om_path_exists(path)) {
        path[0] = 0;
        return OM_OK;
    }
    OM_CHECK(
        om_path_exists(path), OM_INVALID,
        "%s has neither view.html nor patient.yaml: it is no folder of a run or of a model, or of an earlier version; "
        "run the scene again",
        name);
    return OM_OK;
}

static OmStatus check_options(const OmCliArgs* args, const OmCliRetract* s) {
    OM_CHECK(s->has_scene || (!om_cli_get(args, "--unit") && !om_cli_get(args, "--up")), OM_INVALID,
             "--unit and --up are of meshes; a scene has `unit` and `up`");
    OM_CHECK(!s->out || (!s->has_scene && !om_cli_get(args, "--free")), OM_INVALID,
             "--output is of runs; a hand in the simulation writes nothing");
    return OM_OK;
}

static int view_scene(const OmCliArgs* args) {
    OmCliRetract s = {.verb = "view"};
    OmViewServer* server = NULL;
    char path[1200];
    OmStatus status =
        om_cli_positional(args, 0) ? om_cli_view_load(args, &s, path, sizeof path) : OM_OK;
    if (status < 0) return om_cli_fail("view", status);
    int code = om_cli_retract_begin(args, false, &s);
    if (code != OM_EXIT_OK) return code;
    status = check_options(args, &s);
    if (status == OM_OK) status = serve(args, s.scene.name, NULL, &server);
    if (status < 0) return om_cli_fail("view", status);
    if (s.has_scene || om_cli_get(args, "--free")) {
        status = om_cli_view_free(&s, server, path);
        code = status == OM_CANCELLED ? OM_EXIT_OK : om_cli_fail("view", status);
    } else {
        code = om_cli_view_run(&s, server);
    }
    om_view_server_destroy(server);
    return code;
}

static int om_cli_view(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmViewServer* server;
    char path[1200];
    int npositional;
    if (om_cli_check(&args, 1, &npositional) < 0) return om_cli_usage("view");
    const char* name = om_cli_positional(&args, 0);
    OmStatus status = find_recording(name, path, sizeof path);
    if (status == OM_OK && !path[0]) return view_scene(&args);
    om_cli_progress(true);  // takes Ctrl-C
    if (status == OM_OK) status = serve(&args, name, path, &server);
    if (status < 0) return om_cli_fail("view", status);
    const int code = stay();
    om_view_server_destroy(server);
    return code;
}

const OmCliVerb om_cli_verb_view = {
    .name = "view",
    .run = om_cli_view,
    .summary = "watch a run in a browser, supervise one, or pull any tissue with the mouse",
    .usage = "omentum view DIR | SCENE.yaml | MESH | PATIENT [options]",
    .about =
        "With the folder of a run it serves that run's view.html. With a scene it makes a run, which begins when a\n"
        "page is open, takes its time as on the wall, and obeys the page: pause, go, slow, forbid, approve and the\n"
        "other commands of --supervise. With --free there is no robot: the mouse grasps the tissue and pulls it, or\n"
        "presses it with a ball, and the page shows the force; material, law and elements are chosen there. So it is\n"
        "with a tetrahedral mesh (.vtu, .vtk, .msh) and a patient model (patient.yaml, or its folder), which need no\n"
        "scene: they are held at their attachments, a mesh without any at its lowest layer. The page is at\n"
        "http://127.0.0.1:8765/, for this machine alone; over SSH forward that port: ssh -L 8765:127.0.0.1:8765 HOST.\n"
        "A page with the controls that is not heard for two seconds pauses the run. Ctrl-C ends the program.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum view out/run\n"
               "  omentum view scenes/sheet.yaml --free\n"
               "  omentum view liver.msh --unit mm\n"
               "  omentum view out/model\n"
               "  omentum view scenes/belief.yaml --defras\n"
               "  omentum view scenes/sheet.yaml --free --listen 192.168.1.20 --token 8f3a21",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
