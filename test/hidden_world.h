// hidden_world.h: a world around a simulated one that shows commands and observations alone, as a real robot does.
#ifndef OMENTUM_TEST_HIDDEN_WORLD_H
#define OMENTUM_TEST_HIDDEN_WORLD_H

#include "omentum/world.h"

// om_world_truth, om_world_tool and om_world_render know nothing of it.
enum { NCLOSED = 30 };  // looks, 3 s: longer than the loop waits for the ROI

typedef struct HiddenWorld {
    OmWorld head;
    OmWorld* inner;           // borrowed
    int nmove, nstop, nopen;  // commands so far; nopen: the jaw was commanded to open
    int fail_at;              // advance fails at this call, counted from 1; 0: never
    int nadvance;
    int nblink;    // times that the ROI closes for NCLOSED looks once 85 % of it are seen; 0: never
    int nclosed;   // looks until it opens again
    double clock;  // s that this world's clock is ahead of the inner one
    double delay;  // s from the exposure of a picture to its observation
    // m above the place where a jaw closed that an arm reaches until the jaw opens; 0: no such limit
    double max_rise;
    double z, closed_z;  // m, of the last goal; where the jaw closed
    bool is_closed;
    bool is_frozen;  // the endoscope repeats the first picture that shows 85 % of the ROI
    double frozen_visibility, frozen_time;  // of that picture; 0 before it
} HiddenWorld;

static void hidden_destroy(OmWorld* world) { (void)world; }
static OmStatus hidden_move(OmWorld* world, int arm, OmPose goal, double speed) {
    HiddenWorld* w = (HiddenWorld*)world;
    ++w->nmove;
    if (w->max_rise > 0 && w->is_closed && goal.p.z > w->closed_z + w->max_rise)
        return om_error(OM_INVALID, "a joint forbids z = %g m", goal.p.z);
    w->z = goal.p.z;
    return om_world_move(w->inner, arm, goal, speed);
}
static OmStatus hidden_set_jaw(OmWorld* world, int arm, double angle) {
    HiddenWorld* w = (HiddenWorld*)world;
    w->nopen += angle > 0.1;
    w->is_closed = angle <= 0.1;
    w->closed_z = w->z;
    return om_world_set_jaw(w->inner, arm, angle);
}
static void hidden_stop(OmWorld* world, int arm) {
    HiddenWorld* w = (HiddenWorld*)world;
    ++w->nstop;
    om_world_stop(w->inner, arm);
}
static OmStatus hidden_advance(OmWorld* world, double dt) {
    HiddenWorld* w = (HiddenWorld*)world;
    if (++w->nadvance == w->fail_at) return om_error(OM_IO, "the robot does not answer");
    return om_world_advance(w->inner, dt);
}
static void hidden_set_window(OmWorld* world, OmWindow window) {
    om_world_set_window(((HiddenWorld*)world)->inner, window);
}
static OmStatus hidden_observe(OmWorld* world, unsigned what, OmObservation* observation) {
    HiddenWorld* w = (HiddenWorld*)world;
    OmStatus status = om_world_observe(w->inner, what, observation);
    observation->time += w->clock;
    for (int a = 0; a < observation->narm; ++a) observation->arm[a].time += w->clock;
    observation->endoscope.time += w->clock - w->delay;
    observation->rgbd.time += w->clock - w->delay;
    if (status < 0 || !(what & OM_OBSERVE_VISIBILITY)) return status;
    if (w->nclosed > 0) {
        --w->nclosed;
        observation->visibility = 0;
    } else if (w->nblink > 0 && observation->visibility >= 0.85) {
        --w->nblink;
        w->nclosed = NCLOSED;
    }
    if (w->is_frozen && w->frozen_visibility > 0) {
        observation->visibility = w->frozen_visibility;
        observation->endoscope.time = w->frozen_time;
    } else if (w->is_frozen && observation->visibility >= 0.85) {
        w->frozen_visibility = observation->visibility;
        w->frozen_time = observation->endoscope.time;
    }
    return status;
}

static const OmWorldOps hidden_ops = {.destroy = hidden_destroy,
                                      .move = hidden_move,
                                      .set_jaw = hidden_set_jaw,
                                      .stop = hidden_stop,
                                      .advance = hidden_advance,
                                      .observe = hidden_observe,
                                      .set_window = hidden_set_window};

static inline HiddenWorld hidden_world(OmWorld* inner, unsigned sources) {
    return (HiddenWorld){.head = {&hidden_ops, om_world_narm(inner), sources}, .inner = inner};
}

#endif
