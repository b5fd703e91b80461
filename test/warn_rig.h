// warn_rig.h: a loop with monitor, updater and a made up estimate, for the tests of the warning states of Alg. 5. The
// twin believes in no attachment, the truth is held on the far half; the limits of mu are those at which this small
// sheet raises the wanted state.
#ifndef OMENTUM_TEST_WARN_RIG_H
#define OMENTUM_TEST_WARN_RIG_H

#include <math.h>
#include <string.h>

#include "loop_rig.h"

#include "loop/loop_state.h"

#include "omentum/belief_monitor.h"
#include "omentum/belief_update.h"
#include "omentum/trial_ahead.h"

// An estimate that knows the truth: the far half is attached. Or it is refused.
typedef struct Teacher {
    const OmSite* site;
    bool refuses;
    int nall;  // so many answers attach the whole underside
    int ncall;
} Teacher;

static OmStatus teach(void* ctx, int n, const OmAcquisition* a, const OmProgress* progress,
                      OmMatchEstimate* e) {
    Teacher* t = ctx;
    (void)a, (void)progress;
    ++t->ncall;
    if (t->refuses) {
        snprintf(e->reason, sizeof e->reason, "it saw too little");
        return OM_OK;
    }
    const OmTetMesh* mesh = &t->site->mesh;
    const OmMeshSet* under = om_tet_mesh_find_set(mesh, "underside");
    OmPose to_task = om_pose_inverse(t->site->pose_world_task);
    OM_ALLOC(e->attached, (size_t)mesh->nvert);
    OM_ALLOC(e->stiffness, (size_t)mesh->nvert);
    e->nvert = e->nnode = mesh->nvert;
    e->nacquisition = n;
    memset(e->attached, 0, (size_t)mesh->nvert);
    memset(e->stiffness, 0, (size_t)mesh->nvert * sizeof *e->stiffness);
    for (int i = 0; i < under->nvert; ++i) {
        const int v = under->vert[i];
        const bool is_all = t->ncall <= t->nall;
        e->attached[v] = is_all || om_pose_apply(to_task, om_load3(mesh->x, v)).x > 0.01;
    }
    e->is_accepted = true;
    return OM_OK;
}

static inline OmScene warn_scene(double one, double two, double three) {
    OmScene scene = object_scene();
    scene.believed.kind = OM_BELIEF_NONE;
    scene.world.has_depth_noise = false;
    scene.world.young_factor = 1;
    scene.rgbd.width = 96, scene.rgbd.height = 72;
    scene.task.max_actions = 16;
    scene.monitor.rate = 10;
    scene.monitor.limit[0] = one, scene.monitor.limit[1] = two, scene.monitor.limit[2] = three;
    scene.monitor.hysteresis = 0.2 * one;
    scene.monitor.part_limit[0] = scene.monitor.part_limit[1] = 0;
    return scene;
}

typedef struct Seen {
    int nwarning, largest, nhold;
    double state3, lasted;  // s, begin of state 3, and until the hold
    int ntaken, nmove_in_learning;
    bool has_parts;
    OmWorld* world;
    int ndoubt, nrest;  // doubts; vertices still attached after the last one
    int nhand;          // of these below the block in hand
    int naction;        // when it began
} Seen;

static OmStatus on_warning(void* ctx, const OmLoop* loop, int was, const OmMonitorFrame* frame) {
    Seen* s = ctx;
    assert_int_not_equal(was, om_loop_warning(loop));
    if (!s->has_parts)
        assert_true(om_loop_warning(loop) == 0 || om_loop_warning(loop) == frame->state);
    s->largest = om_loop_warning(loop) > s->largest ? om_loop_warning(loop) : s->largest;
    ++s->nwarning;
    if (om_loop_warning(loop) == 3) s->state3 = om_loop_sample(loop).time;
    return OM_OK;
}

static OmStatus on_tick(void* ctx, const OmLoop* loop, const OmRetractSample* now) {
    Seen* s = ctx;
    OmObservation obs = {0};
    (void)now;
    OM_TRY(om_world_observe(s->world, 0, &obs));
    s->nmove_in_learning += om_loop_phase(loop) == OM_LOOP_LEARN && obs.arm[0].is_moving;
    om_observation_done(&obs);
    return OM_OK;
}

static OmStatus on_update(void* ctx, const OmLoop* loop, const OmUpdateEvent* event) {
    Seen* s = ctx;
    s->ntaken += event->stage == OM_UPDATE_TAKEN;
    if (event->stage != OM_UPDATE_DOUBTED) return OM_OK;
    ++s->ndoubt;
    s->nrest = s->nhand = 0;
    s->naction = om_loop_result(loop)->naction;
    for (int v = 0; v < event->estimate->nvert; ++v) {
        const Belief* b = &loop->belief;
        const OmVec3 x = om_load3(om_body_site(b->twin)->mesh.x, v);
        const int block = b->act->arm[0].in_hand;
        const bool is_below = block >= 0 && om__grid_loads(b->grid, block, x);
        s->nrest += event->estimate->attached[v];
        s->nhand += event->estimate->attached[v] && is_below;
        assert_true(event->was_attached[v] || !event->estimate->attached[v]);
    }
    return OM_OK;
}

static OmStatus on_hold(void* ctx, const OmLoop* loop, OmHold hold, const char* reason) {
    ((Seen*)ctx)->lasted = om_loop_sample(loop).time - ((Seen*)ctx)->state3;
    assert_int_equal(hold, OM_HOLD_WARNING);
    assert_non_null(strstr(reason, "mm is the limit"));
    ++((Seen*)ctx)->nhold;
    return OM_OK;
}

typedef struct Course {
    Rig g;
    Teacher teacher;
    Seen seen;
    OmUpdater* updater;
    OmMonitor* monitor;
    OmAhead* ahead;
    OmLoop* loop;
} Course;

static inline void course_begin_as(Course* c, OmScene scene, OmSiteRole role, bool refuses,
                                   bool is_attended) {
    memset(c, 0, sizeof *c);
    rig_create_as(&c->g, scene, role, 1);
    if (scene.task.ahead > 0) {
        OmAheadDef ahead = om_ahead_default_def(&c->g.scene, &c->g.twin_site);
        assert_ok(om_ahead_create(&ahead, c->g.twin, &c->ahead));
    }
    c->teacher = (Teacher){.site = &c->g.twin_site, .refuses = refuses};
    c->seen.world = c->g.world;
    c->seen.has_parts = scene.monitor.part_limit[1] > 0;
    OmUpdateDef update = om_update_default_def(&c->g.scene, c->g.world, &c->g.twin_site);
    update.estimate = teach, update.estimate_ctx = &c->teacher;
    assert_ok(om_updater_create(&update, &c->updater));
    OmMonitorDef monitor = om_monitor_default_def(&c->g.scene, c->g.world, &c->g.twin_site);
    assert_ok(om_monitor_create(&monitor, &c->monitor));
    OmLoopListener listener = {.ctx = &c->seen,
                               .on_tick = on_tick,
                               .on_warning = on_warning,
                               .on_update = on_update,
                               .on_hold = on_hold};
    OmLoopDef def = om_loop_default_def(&c->g.scene.task, c->g.world, c->g.twin, c->g.planner);
    def.truth = om_world_truth(c->g.world);
    def.listener = &listener;
    def.nlistener = 1;
    def.updater = c->updater;
    def.monitor = c->monitor;
    def.is_attended = is_attended;
    def.ahead = c->ahead;
    assert_ok(om_loop_create(&def, &c->loop));
}

static inline void course_begin(Course* c, OmScene scene, bool refuses, bool is_attended) {
    course_begin_as(c, scene, OM_SITE_WORLD, refuses, is_attended);
}

static inline void course_end(Course* c) {
    om_loop_destroy(c->loop);
    om_ahead_destroy(c->ahead);
    om_updater_destroy(c->updater);
    om_monitor_destroy(c->monitor);
    rig_destroy(&c->g);
}

static inline void print_course(const OmRetractResult* r) {
    printf("%s; mu %.2f mm; warnings %d %d %d\n", r->reason, 1e3 * r->belief.mu_max,
           r->belief.nwarning[0], r->belief.nwarning[1], r->belief.nwarning[2]);
    for (int i = 0; i < r->belief.nupdate; ++i)
        printf("  update %s: mu %.2f -> %.2f mm, part %.2f -> %.2f mm\n",
               om_update_stage_text(r->belief.update[i].stage), 1e3 * r->belief.update[i].mu_before,
               1e3 * r->belief.update[i].mu_after, 1e3 * r->belief.update[i].part_before,
               1e3 * r->belief.update[i].part_after);
}

// The number of the first action that a warning stopped, if `more` actions have followed it; otherwise -1.
static inline int find_warned(const OmRetractResult* r, int more) {
    for (int i = 0; i + more < r->naction; ++i)
        if (r->action[i].outcome == OM_ACTION_WARNED) return i;
    return -1;
}

// To the end; in a quick run until `more` actions have followed the first that a warning stopped.
static inline void tick_past_warning(OmLoop* loop, int more) {
    while (om_loop_phase(loop) != OM_LOOP_ENDED &&
           (test_is_slow() || find_warned(om_loop_result(loop), more) < 0))
        assert_ok(om_loop_tick(loop));
}

// The scene of the doubts: points 12 and `other` may be grasped, and neither exposes all of the ROI by a lift of 20 mm.
static inline OmScene doubt_scene(double visibility) {
    OmScene scene = warn_scene(0.1e-3, 0.02, 0.03);
    scene.task.max_height = scene.task.retract = 0.02;
    scene.task.visibility = visibility;
    scene.task.max_actions = 60;
    if (!test_is_slow()) {
        scene.endoscope.width = 40, scene.endoscope.height = 30;
        scene.rgbd.width = 64, scene.rgbd.height = 48;
        scene.monitor.rate = 5;
    }
    scene.tissue.friction = 0.3;  // a free twin without friction slides away
    return scene;
}

static inline void begin_doubt(Course* c, OmScene scene, int other, int nall) {
    course_begin(c, scene, false, false);
    c->teacher.nall = nall;
    for (int b = 0; b < 25; ++b)
        if (b != 12 && b != other)
            assert_ok(om_loop_command(c->loop, &(OmLoopCommand){OM_LOOP_FORBID, .block = b}));
}

#endif
