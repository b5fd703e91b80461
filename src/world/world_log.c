// world_log.c: the recorded world and the replayed world.
//
// The recorded world writes each call with its answer when the answer is there. The replayed world reads one record a
// call and compares. Commands are compared to the last bit: a replay that departs a little departs for good. A
// departure is OM_IO, since a controller takes OM_INVALID of a motion as a goal out of reach, and would go on.
#include "omentum/world_log.h"

#include <string.h>

#include "world/world_log_file.h"

#define DEG (180.0 / OM_PI)

// ---- the recorded world ---------------------------------------------------------------------------------------------

typedef struct RecordedWorld {
    OmWorld head;
    OmWorld* inner;  // borrowed
    LogWriter writer;
    OmStatus failed;  // of a stop, which returns nothing: the next call does
} RecordedWorld;

// Write a call and its answer. @return the answer, or the error of the log
static OmStatus note(RecordedWorld* w, LogCall* call, OmStatus answer) {
    call->status = answer;
    if (answer < 0) snprintf(call->message, sizeof call->message, "%s", om_error_message());
    OM_CHECK(w->failed >= 0, OM_IO, "%s cannot be written", w->writer.path);
    OmStatus status = om__log_write(&w->writer, call);
    if (status < 0) {
        w->failed = status;
        return status;
    }
    return answer < 0 ? om_error(answer, "%s", call->message) : answer;
}

static void recorded_destroy(OmWorld* world) {
    RecordedWorld* w = (RecordedWorld*)world;
    om__log_writer_done(&w->writer);
    om_free(w);
}

static OmStatus recorded_move(OmWorld* world, int arm, OmPose goal, double speed) {
    RecordedWorld* w = (RecordedWorld*)world;
    LogCall call = {.kind = LOG_MOVE, .arm = arm, .goal = goal, .value = speed};
    return note(w, &call, om_world_move(w->inner, arm, goal, speed));
}

static OmStatus recorded_set_jaw(OmWorld* world, int arm, double angle) {
    RecordedWorld* w = (RecordedWorld*)world;
    LogCall call = {.kind = LOG_JAW, .arm = arm, .value = angle};
    return note(w, &call, om_world_set_jaw(w->inner, arm, angle));
}

static void recorded_stop(OmWorld* world, int arm) {
    RecordedWorld* w = (RecordedWorld*)world;
    LogCall call = {.kind = LOG_STOP, .arm = arm};
    om_world_stop(w->inner, arm);
    note(w, &call, OM_OK);  // an error is kept for the next call
}

static OmStatus recorded_advance(OmWorld* world, double dt) {
    RecordedWorld* w = (RecordedWorld*)world;
    LogCall call = {.kind = LOG_ADVANCE, .value = dt};
    return note(w, &call, om_world_advance(w->inner, dt));
}

static OmStatus recorded_observe(OmWorld* world, unsigned what, OmObservation* observation) {
    RecordedWorld* w = (RecordedWorld*)world;
    LogCall call = {.kind = LOG_OBSERVE, .what = what};
    OmStatus status = om_world_observe(w->inner, what, observation);
    if (status >= 0) {
        om__log_round(observation);
        call.observation = *observation;
    }
    status = note(w, &call, status);
    if (status < 0) om_observation_done(observation);
    return status;
}

// Not written: each picture has its window.
static void recorded_set_window(OmWorld* world, OmWindow window) {
    om_world_set_window(((RecordedWorld*)world)->inner, window);
}

static OmStatus recorded_reset(OmWorld* world) {
    RecordedWorld* w = (RecordedWorld*)world;
    LogCall call = {.kind = LOG_RESET};
    return note(w, &call, om_world_reset(w->inner));
}

static const OmWorldOps recorded_ops = {.destroy = recorded_destroy,
                                        .move = recorded_move,
                                        .set_jaw = recorded_set_jaw,
                                        .stop = recorded_stop,
                                        .advance = recorded_advance,
                                        .observe = recorded_observe,
                                        .reset = recorded_reset,
                                        .set_window = recorded_set_window};

OmStatus om_world_create_recorded(OmWorld* inner, const char* path, OmWorld** world) {
    *world = NULL;
    RecordedWorld* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    LogHead head = {.narm = om_world_narm(inner), .sources = om_world_sources(inner)};
    w->head = *inner;
    w->head.ops = &recorded_ops;
    w->inner = inner;
    for (int a = 0; a < head.narm; ++a) {
        head.has_psm[a] = inner->psm[a] != NULL;
        if (head.has_psm[a]) head.psm[a] = *inner->psm[a];
    }
    OmStatus status = om__log_begin(path, &head, &w->writer);
    if (status < 0)
        om_free(w);
    else
        *world = &w->head;
    return status;
}

OmStatus om_world_log_end(OmWorld* world) {
    OM_CHECK(world && world->ops == &recorded_ops, OM_INVALID, "this world has no log");
    return om__log_end(&((RecordedWorld*)world)->writer);
}

// ---- the replayed world ---------------------------------------------------------------------------------------------

typedef struct ReplayedWorld {
    OmWorld head;
    OmPsm psm[OM_MAX_ARM];
    LogReader reader;
    LogCall call;       // the last of the log
    int tick;           // advances so far
    double time;        // s, all of them
    char failed[2048];  // a difference; "": none. Every later call repeats it
} ReplayedWorld;

// A call in words: "move arm 1 to (0.0100, 0.0200, 0.0300) m at 20 mm/s".
static void print_call(const LogCall* c, char* text, size_t size) {
    const OmVec3 p = c->goal.p;
    const OmQuat q = c->goal.q;
    switch (c->kind) {
    case LOG_RESET: snprintf(text, size, "reset"); return;
    case LOG_MOVE:
        snprintf(text, size,
                 "move arm %d to (%.9g, %.9g, %.9g) m, quaternion (%.6g, %.6g, %.6g, %.6g), at "
                 "%.9g m/s",
                 c->arm, p.x, p.y, p.z, q.w, q.x, q.y, q.z, c->value);
        return;
    case LOG_JAW:
        snprintf(text, size, "jaw of arm %d to %.9g degrees", c->arm, DEG * c->value);
        return;
    case LOG_STOP: snprintf(text, size, "stop arm %d", c->arm); return;
    case LOG_ADVANCE: snprintf(text, size, "advance by %.9g s", c->value); return;
    case LOG_OBSERVE: snprintf(text, size, "observe with flags 0x%x", c->what); return;
    default: snprintf(text, size, "end"); return;
    }
}

static bool is_same_number(double a, double b) { return memcmp(&a, &b, sizeof a) == 0; }

static bool is_same_call(const LogCall* a, const LogCall* b) {
    return a->kind == b->kind && a->arm == b->arm && a->what == b->what &&
           is_same_number(a->value, b->value) && memcmp(&a->goal, &b->goal, sizeof a->goal) == 0;
}

static OmStatus depart(ReplayedWorld* w, const LogCall* now) {
    char then_text[300], now_text[300];
    print_call(now, now_text, sizeof now_text);
    if (w->call.kind == LOG_CUT) {
        snprintf(w->failed, sizeof w->failed,
                 "%s: the log was cut off at tick %d (%.2f s); the next call would be: %s",
                 w->reader.path, w->tick, w->time, now_text);
    } else {
        print_call(&w->call, then_text, sizeof then_text);
        snprintf(w->failed, sizeof w->failed,
                 "%s: the replay departs from the log at tick %d (%.2f s). Log: %s. Now: %s",
                 w->reader.path, w->tick, w->time, then_text, now_text);
    }
    return om_error(OM_IO, "%s", w->failed);
}

// Read the next record and compare it with the call that is made now. @return the recorded answer
static OmStatus answer(ReplayedWorld* w, const LogCall* now) {
    OM_CHECK(!w->failed[0], OM_IO, "%s", w->failed);
    OmStatus status = om__log_read(&w->reader, &w->call);
    if (status == OM_NO_MEMORY) return status;
    if (status < 0) {
        snprintf(w->failed, sizeof w->failed, "%s", om_error_message());
        return om_error(OM_IO, "%s", w->failed);
    }
    if (!is_same_call(&w->call, now)) return depart(w, now);
    if (w->call.status < 0) return om_error(w->call.status, "%s", w->call.message);
    return w->call.status;
}

static void replayed_destroy(OmWorld* world) {
    ReplayedWorld* w = (ReplayedWorld*)world;
    om_observation_done(&w->call.observation);
    om__log_close(&w->reader);
    om_free(w);
}

static OmStatus replayed_move(OmWorld* world, int arm, OmPose goal, double speed) {
    LogCall now = {.kind = LOG_MOVE, .arm = arm, .goal = goal, .value = speed};
    return answer((ReplayedWorld*)world, &now);
}

static OmStatus replayed_set_jaw(OmWorld* world, int arm, double angle) {
    LogCall now = {.kind = LOG_JAW, .arm = arm, .value = angle};
    return answer((ReplayedWorld*)world, &now);
}

static void replayed_stop(OmWorld* world, int arm) {
    LogCall now = {.kind = LOG_STOP, .arm = arm};
    answer((ReplayedWorld*)world, &now);  // a difference is kept for the next call
}

static OmStatus replayed_advance(OmWorld* world, double dt) {
    ReplayedWorld* w = (ReplayedWorld*)world;
    LogCall now = {.kind = LOG_ADVANCE, .value = dt};
    OmStatus status = answer(w, &now);
    if (status < 0) return status;
    ++w->tick;
    w->time += dt;
    return status;
}

static OmStatus replayed_observe(OmWorld* world, unsigned what, OmObservation* observation) {
    ReplayedWorld* w = (ReplayedWorld*)world;
    LogCall now = {.kind = LOG_OBSERVE, .what = what};
    om_observation_done(observation);
    OmStatus status = answer(w, &now);
    if (status < 0) return status;
    *observation = w->call.observation;
    w->call.observation = (OmObservation){0};
    return status;
}

static OmStatus replayed_reset(OmWorld* world) {
    LogCall now = {.kind = LOG_RESET};
    return answer((ReplayedWorld*)world, &now);
}

static const OmWorldOps replayed_ops = {.destroy = replayed_destroy,
                                        .move = replayed_move,
                                        .set_jaw = replayed_set_jaw,
                                        .stop = replayed_stop,
                                        .advance = replayed_advance,
                                        .observe = replayed_observe,
                                        .reset = replayed_reset};

OmStatus om_world_create_replayed(const char* path, OmWorld** world) {
    *world = NULL;
    ReplayedWorld* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    OmStatus status = om__log_open(path, &w->reader);
    if (status < 0) {
        om_free(w);
        return status;
    }
    const LogHead* head = &w->reader.head;
    w->head = (OmWorld){.ops = &replayed_ops, .narm = head->narm, .sources = head->sources};
    for (int a = 0; a < head->narm; ++a) {
        w->psm[a] = head->psm[a];
        w->head.psm[a] = head->has_psm[a] ? &w->psm[a] : NULL;
    }
    *world = &w->head;
    return OM_OK;
}

// ---- a log as a whole -----------------------------------------------------------------------------------------------

static void count_call(const LogCall* call, OmWorldLogInfo* info) {
    const OmObservation* obs = &call->observation;
    if (call->kind == LOG_ADVANCE && call->status >= 0) {
        ++info->nadvance;
        info->time += call->value;
    }
    info->nobserve += call->kind == LOG_OBSERVE;
    info->npicture += (obs->rgbd.depth != NULL) + (obs->rgbd.color.pixel != NULL) +
                      (obs->endoscope.color.pixel != NULL);
}

OmStatus om_world_log_check(const char* path, OmWorldLogInfo* info) {
    LogReader reader;
    LogCall call = {.kind = LOG_HEAD};
    memset(info, 0, sizeof *info);
    OM_TRY(om__log_open(path, &reader));
    OmWorldLogInfo found = {
        .narm = reader.head.narm, .sources = reader.head.sources, .size = (int64_t)reader.size};
    OmStatus status = OM_OK;
    while (status == OM_OK && call.kind != LOG_END && call.kind != LOG_CUT) {
        status = om__log_read(&reader, &call);
        if (status == OM_OK) count_call(&call, &found);
    }
    found.is_complete = call.kind == LOG_END;
    om_observation_done(&call.observation);
    om__log_close(&reader);
    if (status == OM_OK) *info = found;
    return status;
}
