// cli_view_free.c: a hand in the simulation: lines of the page move the tissue of a scene.
//
// | line            | what it does                                                               |
// |-----------------|----------------------------------------------------------------------------|
// | grasp X Y Z     | hold the tissue within the scene's grasp_radius of a point, world frame, m |
// | move X Y Z      | the held tissue follows to this point, at most SPEED                       |
// | release         | let go                                                                     |
// | pause, go, step | stop, continue, one time step                                              |
// | reset           | back to rest, with the scene's modulus                                     |
// | young FACTOR    | the modulus times this factor, 0.1 to 10                                   |
//
// When the file of the scene changes, it is read again.
#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "cli_view.h"
#include "omentum/view.h"

#define SPEED 0.25   // m/s, of the hand
#define FRAMES 30.0  // in a second
#define SETTLE_SPEED 1e-3
#define SETTLE_TIME 5.0

typedef struct Hand {
    OmCliRetract* s;
    OmViewServer* server;
    OmSite site;
    OmBody* body;
    OmView3d* view;
    OmText message;
    void* start;  // snapshot at rest
    OmVec3 tip, goal;
    bool is_holding, is_paused, has_step, has_forces;
    double time, young;
    const char* path;          // of the scene
    double modified, checked;  // s: when its file was written, and when this was looked at
} Hand;

// When a file was written; 0: it is not there.
static double modified_at(const char* path) {
    struct stat info;
    if (stat(path, &info) != 0) return 0;
    return (double)info.st_mtim.tv_sec + 1e-9 * (double)info.st_mtim.tv_nsec;
}

// Looked at twice a second.
static bool is_changed(Hand* h) {
    const double now = om_clock_now();
    if (now - h->checked < 0.5) return false;
    h->checked = now;
    const double modified = modified_at(h->path);
    return modified != 0 && modified != h->modified;
}

static OmStatus say_mode(const Hand* h) {
    const char* mode = h->is_paused ? "{\"mode\":\"free\",\"paused\":true}"
                                    : "{\"mode\":\"free\",\"paused\":false}";
    return om_view_server_publish(h->server, OM_VIEW_LASTING, mode, strlen(mode));
}

static OmStatus send_scene(Hand* h) {
    OmView3dDef def = om_view3d_default_def(&h->s->scene, h->body);
    def.is_live = true;
    om_view3d_destroy(h->view);
    h->view = NULL;
    OM_TRY(om_view3d_create(&def, &h->view));
    om_view_server_clear(h->server);
    h->message.len = 0;
    OM_TRY(om_view3d_add_scene(h->view, &h->message));
    OM_TRY(om_view_server_publish(h->server, OM_VIEW_LASTING, h->message.str, h->message.len));
    h->message.len = 0;
    OM_TRY(om_view3d_add_points(h->body, om_body_attached(h->body), OM_VIEW_BELIEVED, &h->message));
    OM_TRY(om_view_server_publish(h->server, OM_VIEW_LASTING, h->message.str, h->message.len));
    return say_mode(h);
}

static OmStatus send_frame(Hand* h) {
    OmBodyForces forces = {0};
    OmViewNow now = {.time = h->time,
                     .visibility = NAN,
                     .force = NAN,
                     .force_world = NAN,
                     .mu = NAN,
                     .height = NAN};
    if (h->has_forces) {
        OM_TRY(om_body_get_forces(h->body, &forces));
        now.force = h->is_holding ? om_norm(forces.grasp[0]) : 0;
    }
    h->message.len = 0;
    OM_TRY(om_view3d_add_frame(h->view, &now, &h->message));
    return om_view_server_publish(h->server, OM_VIEW_NEWEST, h->message.str, h->message.len);
}

static OmStatus say_young(Hand* h) {
    char text[80];
    snprintf(text, sizeof text, "modulus %.3g kPa", 1e-3 * h->young * h->site.young);
    return om_cli_view_say(h->server, text, false);
}

static OmStatus grasp(Hand* h, OmVec3 at) {
    int nheld;
    const OmPose tip = {at, h->site.pose_world_task.q};
    if (h->is_holding) om_body_release(h->body, 0);
    h->is_holding = false;
    const OmStatus status = om_body_grasp(h->body, 0, tip, h->s->scene.task.grasp_radius, &nheld);
    if (status == OM_INVALID || (status >= 0 && nheld == 0))
        return om_cli_view_say(h->server, "no free tissue there to grasp", true);
    OM_TRY(status);
    h->is_holding = true;
    h->tip = h->goal = at;
    return OM_OK;
}

static OmStatus reset(Hand* h) {
    if (h->is_holding) om_body_release(h->body, 0);
    h->is_holding = false;
    h->time = 0;
    if (h->young != 1) OM_TRY(om_body_set_young(h->body, &h->s->scene, 1));
    h->young = 1;
    om_body_restore(h->body, h->start);
    return om_cli_view_say(h->server, "back at rest", false);
}

// The model is made again with another modulus; the tissue stays where it is.
static OmStatus set_young(Hand* h, double factor) {
    if (h->is_holding) om_body_release(h->body, 0);
    h->is_holding = false;
    OM_TRY(om_body_set_young(h->body, &h->s->scene, factor));
    h->young = factor;
    return say_young(h);
}

static bool is_word(const char* line, const char* word) {
    const size_t n = strlen(word);
    return strncmp(line, word, n) == 0 && (line[n] == 0 || line[n] == ' ');
}

static OmStatus obey(Hand* h, const char* line) {
    OmVec3 p;
    double factor;
    const int n = sscanf(line, "%*s %lf %lf %lf", &p.x, &p.y, &p.z);
    const bool is_point =
        n == 3 && isfinite(p.x) && isfinite(p.y) && isfinite(p.z) && om_norm(p) < 100;
    if (is_word(line, "grasp") && is_point) return grasp(h, p);
    if (is_word(line, "move") && is_point) {
        if (h->is_holding) h->goal = p;
        return OM_OK;
    }
    if (is_word(line, "release")) {
        if (h->is_holding) om_body_release(h->body, 0);
        h->is_holding = false;
        return OM_OK;
    }
    if (is_word(line, "pause") || is_word(line, "go")) {
        h->is_paused = line[0] == 'p';
        OM_TRY(say_mode(h));
        return om_cli_view_say(h->server, h->is_paused ? "paused" : "the tissue moves", false);
    }
    if (is_word(line, "step")) {
        h->is_paused = h->has_step = true;
        return say_mode(h);
    }
    if (is_word(line, "reset")) return reset(h);
    if (sscanf(line, "young %lf", &factor) == 1 && factor >= 0.1 && factor <= 10)
        return set_young(h, factor);
    return om_cli_view_say(h->server, "this is no command here", true);
}

static OmStatus step(Hand* h) {
    const double dt = h->s->scene.task.time_step;
    OmBodyReport report;
    if (h->is_holding) {
        const OmVec3 way = om_sub(h->goal, h->tip);
        const double left = om_norm(way), most = SPEED * dt;
        h->tip = left <= most ? h->goal : om_madd(h->tip, most / left, way);
        OM_TRY(om_body_move(h->body, 0, (OmPose){h->tip, h->site.pose_world_task.q}));
    }
    OmStatus status = om_body_step(h->body, dt, &report);
    h->time += dt;
    h->has_step = false;
    return status < 0 ? status : OM_OK;
}

// Until the scene's file is another one, or the user ends the program.
static OmStatus live(Hand* h) {
    char line[OM_VIEW_MAX_LINE + 1];
    double last = -INFINITY, origin = om_clock_now(), begin = 0;
    const OmProgress* alive = om_cli_progress(true);
    while (!is_changed(h)) {
        OM_TRY(om_progress_report(alive, "view", 0, 0));
        while (om_view_server_next(h->server, line, sizeof line)) OM_TRY(obey(h, line));
        // a hand that is not heard any more lets go
        if (h->is_holding && om_view_server_silence(h->server) > OM_VIEW_SILENCE)
            OM_TRY(obey(h, "release"));
        const bool is_moving =
            h->has_step || (!h->is_paused && om_view_server_count(h->server) > 0);
        if (is_moving) OM_TRY(step(h));
        const double now = om_clock_now();
        if (!is_moving) origin = now, begin = h->time;
        if (now - origin > h->time - begin + 0.1)
            origin = now, begin = h->time;  // slower than time: no hurry after it
        if (now - last >= 1 / FRAMES) {
            OM_TRY(send_frame(h));
            last = now;
        }
        om_cli_view_wait(is_moving ? origin : now, is_moving ? h->time - begin : 0.02);
    }
    return OM_OK;
}

// Make the tissue and let a hand move it, until the scene's file is another one.
// `modified`: when the file that the scene was read from was written.
static OmStatus run(OmCliRetract* s, OmViewServer* server, const char* path, double modified,
                    const char* notice) {
    Hand h = {.s = s, .server = server, .path = path, .young = 1, .modified = modified};
    char line[OM_VIEW_MAX_LINE + 1];
    const OmProgress* progress = om_cli_progress(s->is_quiet);
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_site_build(&s->scene, OM_SITE_TWIN, progress, &h.site));
    OM_TRY_DONE(om_body_create(&s->scene, &h.site, s->nworker, &h.body));
    h.has_forces = om_engine_capabilities(om_body_engine(h.body)) & OM_ENGINE_FORCES;
    status = om_body_settle(h.body, s->scene.task.time_step, SETTLE_SPEED, SETTLE_TIME);
    OM_TRY_DONE(status);
    h.start = om_alloc(om_body_state_size(h.body), 1);
    OM_CHECK_DONE(h.start, OM_NO_MEMORY, "out of memory for a snapshot");
    om_body_save(h.body, h.start);
    om_cli_progress_done();
    OM_TRY_DONE(send_scene(&h));
    OM_TRY_DONE(notice ? om_cli_view_say(server, notice, false) : say_young(&h));
    while (om_view_server_next(server, line, sizeof line)) {
    }  // they were of an earlier scene
    status = live(&h);
done:
    om_view3d_destroy(h.view);
    om_text_done(&h.message);
    om_free(h.start);
    om_body_destroy(h.body);
    om_site_done(&h.site);
    return status;
}

// Until the file is another one than it was at `modified`.
static OmStatus wait_for_change(const char* path, double modified) {
    while (modified_at(path) == modified) {
        OM_TRY(om_progress_report(om_cli_progress(true), "view", 0, 0));
        om_cli_view_wait(om_clock_now(), 0.2);
    }
    return OM_OK;
}

// Read the file again, with the layout and the folder of data of the command line. Where that fails the page says why,
// and the file is watched until it is another one.
static OmStatus load_again(OmCliRetract* s, OmViewServer* server, const char* path,
                           double* modified) {
    while (true) {
        OmScene scene;
        *modified = modified_at(path);
        OmStatus status = om_scene_load(path, &scene);
        if (status == OM_OK) {
            scene.engines = s->scene.engines;
            if (s->has_layout) scene.seed = s->scene.seed;
            if (s->has_data) memcpy(scene.data_root, s->scene.data_root, sizeof scene.data_root);
            s->scene = scene;
            return OM_OK;
        }
        if (status != OM_INVALID && status != OM_IO) return status;
        OM_TRY(om_cli_view_say(server, om_error_message(), true));
        OM_TRY(wait_for_change(path, *modified));
    }
}

OmStatus om_cli_view_free(OmCliRetract* s, OmViewServer* server, const char* path) {
    double modified = modified_at(path);
    OmStatus status = run(s, server, path, modified, NULL);
    while (status == OM_OK) {
        OM_TRY(load_again(s, server, path, &modified));
        status = run(s, server, path, modified, "the scene's file was read again");
        if (status != OM_INVALID && status != OM_UNSAT) continue;
        // a scene that is read but cannot be built
        OM_TRY(om_cli_view_say(server, om_error_message(), true));
        status = wait_for_change(path, modified);
    }
    return status;
}
