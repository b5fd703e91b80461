// cli_view_free.c: a hand in the simulation, in the time of the wall. When its file changes, it is read again.
#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "cli_view_hand.h"

#define FRAMES 60.0  // in a second

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

// Until the scene's file is another one, or the user ends the program.
static OmStatus live(Hand* h) {
    char line[OM_VIEW_MAX_LINE + 1];
    double last = -INFINITY, origin = om_clock_now(), begin = 0;
    const OmProgress* alive = om_cli_progress(true);
    while (!is_changed(h)) {
        OM_TRY(om_progress_report(alive, "view", 0, 0));
        while (om_view_server_next(h->server, line, sizeof line)) OM_TRY(om__hand_obey(h, line));
        // a hand that is not heard any more lets go
        if ((h->is_holding || h->is_pressing) &&
            om_view_server_silence(h->server) > OM_VIEW_SILENCE)
            OM_TRY(om__hand_obey(h, "release"));
        const bool is_moving =
            h->has_step || (!h->is_paused && om_view_server_count(h->server) > 0);
        if (is_moving) OM_TRY(om__hand_step(h));
        const double now = om_clock_now();
        if (!is_moving) origin = now, begin = h->time;
        if (now - origin > h->time - begin + 0.1)
            origin = now, begin = h->time;  // slower than time: no hurry after it
        if (now - last >= 1 / FRAMES) {
            OM_TRY(om__hand_send_frame(h));
            last = now;
        }
        OM_TRY(om__hand_send_rate(h));
        om_cli_view_wait(is_moving ? origin : now, is_moving ? h->time - begin : 0.02);
    }
    return OM_OK;
}

// Make the tissue and let a hand move it, until the scene's file is another one.
// `modified`: when the file that the scene was read from was written.
static OmStatus run(OmCliRetract* s, OmViewServer* server, const char* path, double modified,
                    const char* notice) {
    Hand h = {.s = s, .server = server, .path = path, .modified = modified};
    const OmProgress* progress = om_cli_progress(s->is_quiet);
    OmStatus status = OM_OK;
    OM_TRY_DONE(om__hand_begin(&h, progress));
    om_cli_progress_done();
    OM_TRY_DONE(notice ? om_cli_view_say(server, notice, false) : om__hand_say_material(&h));
    status = live(&h);
done:
    om__hand_done(&h);
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
        if (s->has_scene) return OM_OK;  // a mesh or a patient, which is read when it is built
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
