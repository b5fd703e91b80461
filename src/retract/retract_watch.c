// retract_watch.c: tools and tissue of a run by OpenIGTLink. The run is the same with and without it: tips of a
// simulated world are its setpoints, which draw no random numbers.
#include "retract/retract_watch.h"

#include "omentum/dds.h"

struct RunWatch {
    OmWatch* watch;
    OmWorld* world;
    OmBody* body;  // that is shown
    OmPose endoscope;
    OmObservation seen;  // of a robot
};

OmStatus om__run_watch_create(int port, const OmScene* scene, OmWorld* world, OmBody* twin,
                              RunWatch** watch) {
    OmBody* truth = om_world_truth(world);
    RunWatch* w = om_calloc(1, sizeof *w);
    *watch = w;
    if (!w) return OM_NO_MEMORY;
    w->world = world;
    w->body = truth ? truth : twin;
    w->endoscope = om_world_endoscope(scene, om_body_site(w->body)).pose_world_camera;
    return om_watch_create(port, om_body_mesh(w->body), &w->watch);
}

void om__run_watch_destroy(RunWatch* watch) {
    if (!watch) return;
    om_watch_destroy(watch->watch);
    om_observation_done(&watch->seen);
    om_free(watch);
}

static OmStatus show(RunWatch* w, double time) {
    static const char* const name[OM_MAX_ARM] = {"PSM1", "PSM2"};
    OmWatchTool tool[OM_MAX_ARM + 1];
    const int narm = om_world_narm(w->world);
    for (int a = 0; a < narm; ++a) {
        tool[a].name = name[a];
        if (om_world_setpoint(w->world, a, &tool[a].pose)) continue;
        if (a == 0) OM_TRY(om_world_observe(w->world, 0, &w->seen));
        tool[a].pose = w->seen.arm[a].tip;
    }
    tool[narm] = (OmWatchTool){"ECM", w->endoscope};
    return om_watch_send(w->watch, time, tool, narm + 1, om_body_x(w->body));
}

static OmStatus on_tick(void* ctx, const OmLoop* loop, const OmRetractSample* now) {
    RunWatch* w = ctx;
    (void)loop;
    return om_watch_is_due(w->watch) ? show(w, now->time) : OM_OK;
}

OmLoopListener om__run_watch_listener(RunWatch* watch) {
    return (OmLoopListener){.ctx = watch, .on_tick = on_tick};
}
