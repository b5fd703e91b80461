// test_defras_warn.c: what the loop does in the warning states of Alg. 5. The twin believes in no attachment, the truth
// is held on the far half; the limits of mu are those at which this small sheet raises the wanted state.
#include <math.h>
#include <string.h>

#include "loop_rig.h"

#include "defras/defras_internal.h"

#include "omentum/defras_ahead.h"
#include "omentum/defras_monitor.h"
#include "omentum/defras_update.h"

// An estimate that knows the truth: the far half is attached. Or it is refused, with the shape of the truth or without.
typedef struct Teacher {
    const OmSite* site;
    bool refuses;
    const OmBody* truth;  // its shape goes with a refusal; null: none
    double way;           // of the way to this shape, 0: all
    double left;  // above 0: of the distance, with the attachments; the shape goes with them
    int nall;     // so many answers attach the whole underside
    int ncall;
} Teacher;

// The truth has a finer mesh: displacements of its vertices, weighted by distance at rest.
static OmVec3 place_in_truth(const OmBody* truth, OmVec3 p) {
    const OmTetMesh* mesh = &om_body_site(truth)->mesh;
    double sum = 0;
    OmVec3 u = om_vec3(0, 0, 0);
    for (int v = 0; v < mesh->nvert; ++v) {
        const OmVec3 rest = om_load3(mesh->x, v);
        const double d2 = om_norm2(om_sub(rest, p)) + 1e-12, w = 1 / (d2 * d2);
        u = om_madd(u, w, om_sub(om_load3(om_body_x(truth), v), rest));
        sum += w;
    }
    return om_madd(p, 1 / sum, u);
}

static OmStatus show_truth(const Teacher* t, const OmAcquisition* a, OmMatchEstimate* e) {
    const OmTetMesh* mesh = &t->site->mesh;
    OM_ALLOC(e->shape, 3 * (size_t)mesh->nvert);
    for (int v = 0; v < mesh->nvert; ++v) {
        const OmVec3 truth = place_in_truth(t->truth, om_load3(mesh->x, v));
        om_store3(e->shape, v, om_lerp(om_load3(a->x_twin, v), truth, t->way > 0 ? t->way : 1));
    }
    e->nvert = mesh->nvert;
    e->has_shape = true;
    return OM_OK;
}

static OmStatus teach(void* ctx, int n, const OmAcquisition* a, const OmProgress* progress,
                      OmMatchEstimate* e) {
    Teacher* t = ctx;
    (void)progress;
    ++t->ncall;
    if (t->refuses) {
        snprintf(e->reason, sizeof e->reason, "it saw too little");
        return t->truth ? show_truth(t, &a[n - 1], e) : OM_OK;
    }
    const OmTetMesh* mesh = &t->site->mesh;
    const OmMeshSet* under = om_tet_mesh_find_set(mesh, "underside");
    OmPose to_task = om_pose_inverse(t->site->pose_world_task);
    OM_ALLOC(e->attached, (size_t)mesh->nvert);
    OM_ALLOC(e->stiffness, (size_t)mesh->nvert);
    e->nvert = mesh->nvert;
    e->nacquisition = n;
    memset(e->attached, 0, (size_t)mesh->nvert);
    memset(e->stiffness, 0, (size_t)mesh->nvert * sizeof *e->stiffness);
    for (int i = 0; i < under->nvert; ++i) {
        const int v = under->vert[i];
        const bool is_all = t->ncall <= t->nall;
        e->attached[v] = is_all || om_pose_apply(to_task, om_load3(mesh->x, v)).x > 0.01;
    }
    e->is_accepted = true;
    e->before_mean = 1e-3;
    e->after_mean = t->left * 1e-3;
    return t->left > 0 ? show_truth(t, &a[n - 1], e) : OM_OK;
}

static OmScene warn_scene(double one, double two, double three) {
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
    scene.monitor.is_fold_at_rest = false;
    scene.monitor.fold_factor = 1;
    return scene;
}

typedef struct Seen {
    int nwarning, largest, nhold;
    double state3, lasted;  // s, begin of state 3, and until the hold
    int ntaken, nmove_in_learning;
    bool has_parts;
    OmWorld* world;
    int ndoubt, nrest;  // doubts; vertices still attached after the last one
    int nfirst;         // doubts of the first belief
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
    s->nfirst +=
        strcmp(event->reason, "the attachments that were believed before the operation") == 0;
    s->nrest = 0;
    s->naction = om_loop_result(loop)->naction;
    for (int v = 0; v < event->estimate->nvert; ++v) {
        s->nrest += event->estimate->attached[v];
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

static void course_begin_as(Course* c, OmScene scene, OmSiteRole role, bool refuses,
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

static void course_begin(Course* c, OmScene scene, bool refuses, bool is_attended) {
    course_begin_as(c, scene, OM_SITE_WORLD, refuses, is_attended);
}

static void course_end(Course* c) {
    om_loop_destroy(c->loop);
    om_ahead_destroy(c->ahead);
    om_updater_destroy(c->updater);
    om_monitor_destroy(c->monitor);
    rig_destroy(&c->g);
}

static void print_course(const OmRetractResult* r) {
    printf("%s; mu %.2f mm; warnings %d %d %d\n", r->reason, 1e3 * r->mu_max, r->nwarning[0],
           r->nwarning[1], r->nwarning[2]);
    for (int i = 0; i < r->nupdate; ++i)
        printf("  update %s: mu %.2f -> %.2f mm, part %.2f -> %.2f mm\n",
               om_update_stage_text(r->update[i].stage), 1e3 * r->update[i].mu_before,
               1e3 * r->update[i].mu_after, 1e3 * r->update[i].part_before,
               1e3 * r->update[i].part_after);
}

// Without a difference of more than the first limit nothing is learnt, and nothing slows down.
static void test_no_warning(void** state) {
    (void)state;
    Course c;
    course_begin(&c, warn_scene(0.02, 0.05, 0.06), false, false);
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    assert_true(r->is_exposed && r->nmonitor > 20);
    assert_int_equal(c.seen.nwarning, 0);
    assert_int_equal(c.seen.ntaken, 0);
    assert_int_equal(r->nupdate, 0);
    assert_true(r->mu_max > 0.3e-3 && r->mu_max < 0.02);
    course_end(&c);
}

// State 1: pulls take twice the time, an acquisition follows, and with the truth learnt mu falls.
static void test_state_one(void** state) {
    (void)state;
    Course c;
    double pull[2] = {0, 0};
    for (int k = 0; k < 2; ++k) {
        course_begin(&c, warn_scene(k ? 0.005e-3 : 0.02, 0.05, 0.06), k, false);
        tick_to_end(c.loop);
        const OmRetractResult* r = om_loop_result(c.loop);
        print_course(r);
        assert_true(r->is_exposed);
        for (int i = 0; i < r->naction; ++i) {
            const OmRetractAction* a = &r->action[i];
            assert_int_not_equal(a->outcome, OM_ACTION_WARNED);
            if (a->verb == OM_PLAN_PULL && a->outcome == OM_ACTION_DONE)
                pull[k] = fmax(pull[k], a->end - a->begin);
        }
        if (k) assert_int_equal(c.seen.largest, 1);
        if (k) assert_true(c.seen.ntaken > 0 && c.teacher.ncall > 0);
        course_end(&c);
    }
    printf("longest pull %.2f s, in state 1 %.2f s\n", pull[0], pull[1]);
    assert_near(pull[1], 2 * pull[0], 0.05);
}

// State 2: the motion stops, the arms keep still until the twin has learnt, and mu falls to less than half. The plan
// that follows continues with the tissue in hand.
static void test_state_two(void** state) {
    (void)state;
    Course c;
    course_begin(&c, warn_scene(0.1e-3, 0.3e-3, 0.06), false, false);
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    assert_true(r->is_exposed);
    assert_int_equal(c.seen.largest, 2);
    assert_int_equal(c.seen.nmove_in_learning, 0);
    int nwarned = 0;
    for (int i = 0; i + 1 < r->naction; ++i) {
        if (r->action[i].outcome != OM_ACTION_WARNED) continue;
        ++nwarned;
        assert_true(r->action[i + 1].is_replanned);
        assert_int_not_equal(r->action[i + 1].verb, OM_PLAN_RELEASE);
    }
    assert_true(nwarned >= 1 && r->nupdate >= 1);
    assert_int_equal(r->update[0].stage, OM_UPDATE_ADOPTED);
    assert_true(r->update[0].mu_after < 0.5 * r->update[0].mu_before);
    course_end(&c);
}

// If nothing is learnt in state 2, the tissue is released and another point is grasped.
static void test_nothing_is_learnt(void** state) {
    (void)state;
    Course c;
    course_begin(&c, warn_scene(0.1e-3, 0.3e-3, 0.06), true, false);
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    int nwarned = 0;
    for (int i = 0; i + 1 < r->naction; ++i) {
        if (r->action[i].outcome != OM_ACTION_WARNED) continue;
        ++nwarned;
        assert_int_equal(r->action[i + 1].verb, OM_PLAN_RELEASE);
        for (int k = i + 2; k < r->naction; ++k)
            assert_int_not_equal(r->action[k].block, r->action[i].block);
    }
    assert_true(nwarned >= 1);
    assert_int_equal(r->update[0].stage, OM_UPDATE_REFUSED);
    assert_true(r->update[0].mu_after > 0.3e-3);
    course_end(&c);
}

static bool is_first_fold(const OmLoop* loop) {
    const OmPlanVerb verb = loop->action.plan.verb;
    const OmRetractResult* r = om_loop_result(loop);
    for (int i = 0; i + 1 < r->naction; ++i)
        if (r->action[i].verb == OM_PLAN_MOVE_ROI || r->action[i].verb == OM_PLAN_MOVE_AWAY)
            return false;
    return verb == OM_PLAN_MOVE_ROI || verb == OM_PLAN_MOVE_AWAY;
}

// World and twin differ by nothing, but in the first fold the twin's tool is kept `aside` m aside. It is drawn back at
// 20 mm/s: with the end of the motion, or never. Alg. 5 warns at once. Judged at rest, only what remains warns.
typedef struct FoldCase {
    bool at_rest, remains;
    double second, aside;  // m, limit of state 2
    double fold;           // factor on the limits in folds; 0: 1
} FoldCase;

typedef struct FoldSeen {
    double end, warned, mu, before;  // s, s, m, m
    int nstop, nfold;                // of the first plan with a fold
} FoldSeen;

static FoldSeen watch_fold(Course* c, const FoldCase* f) {
    FoldSeen s = {.end = NAN, .warned = NAN};
    while (om_loop_phase(c->loop) != OM_LOOP_ENDED && !(c->loop->time > s.end + 2)) {
        const bool is_moving = c->loop->stage == STAGE_ACTION;
        const bool is_still = c->loop->stage == STAGE_SETTLE && f->remains;
        const bool is_fold = is_first_fold(c->loop);
        const int n = om_loop_result(c->loop)->naction;
        if (is_fold && ((is_moving && isnan(s.end)) || is_still))
            c->loop->arm[c->loop->action.plan.arm].twin_off = om_vec3(f->aside, 0, 0);
        assert_ok(om_loop_tick(c->loop));
        if (is_fold) s.mu = fmax(s.mu, c->loop->frame.mu);
        if (!is_fold && isnan(s.end)) s.before = fmax(s.before, c->loop->frame.mu);
        const bool has_ended = om_loop_result(c->loop)->naction > n;
        if (is_fold && is_moving && has_ended && isnan(s.end)) s.end = c->loop->time;
        if (isnan(s.warned) && om_loop_warning(c->loop) > 0) s.warned = c->loop->time;
    }
    const OmRetractResult* r = om_loop_result(c->loop);
    for (int i = 0; i < r->naction; ++i) {
        s.nfold += r->action[i].verb == OM_PLAN_MOVE_ROI || r->action[i].verb == OM_PLAN_MOVE_AWAY;
        s.nstop += r->action[i].outcome == OM_ACTION_WARNED;
    }
    printf("at rest %d, remains %d: mu %.2f mm, in the fold %.2f mm; it ends at %.2f s, warning at "
           "%.2f s; %d folds, %d stopped\n",
           f->at_rest, f->remains, 1e3 * s.before, 1e3 * s.mu, s.end, s.warned, s.nfold, s.nstop);
    return s;
}

static void test_a_fold_at_rest(void** state) {
    (void)state;
    static const FoldCase f[] = {{false, false, 0.05, 0.015},
                                 {true, false, 0.05, 0.015},
                                 {true, true, 0.05, 0.015},
                                 {true, false, 0.5e-3, 0.015},
                                 {true, false, 0.5e-3, 0.015, 4}};
    FoldSeen s[5];
    int ntaken[5];
    for (int k = 0; k < 5; ++k) {
        Course c;
        OmScene scene = warn_scene(0.3e-3, f[k].second, 0.06);
        scene.believed = om_scene_default().believed;
        scene.monitor.is_fold_at_rest = f[k].at_rest;
        scene.monitor.fold_factor = f[k].fold > 0 ? f[k].fold : 1;
        scene.task.visibility = 1.5;  // nothing exposes it
        course_begin_as(&c, scene, OM_SITE_TWIN, true, false);
        s[k] = watch_fold(&c, &f[k]);
        ntaken[k] = c.seen.ntaken;
        course_end(&c);
        assert_true(s[k].before < 0.05e-3 && s[k].mu > 0.5e-3);
    }
    assert_true(s[0].warned < s[0].end);
    assert_true(isnan(s[1].warned) && ntaken[1] == 0);
    assert_near(s[2].warned - s[2].end, 1.5, 0.11);
    assert_true(ntaken[2] > 0);
    assert_true(s[3].warned <= s[3].end && s[3].nstop == 1 && ntaken[3] > 0);  // state 2: at once
    assert_true(isnan(s[4].warned) && s[4].nstop == 0 && ntaken[4] == 0);
}

// If no attachments explain the picture, the twin follows it: mu falls, and the attachments are those from before. The
// tissue stays in hand only where a fold exposes the ROI in the twin from there; without a look ahead it is let go.
static void test_follow(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        Course c;
        OmScene scene = warn_scene(0.15e-3, 0.3e-3, 0.06);
        scene.task.ahead = k ? 3 : 0;
        course_begin(&c, scene, true, false);
        c.teacher.truth = om_world_truth(c.g.world);
        while (c.loop->arm[0].in_hand < 0) assert_ok(om_loop_tick(c.loop));
        c.loop->has_dragged = true;  // as if the tissue had been folded before
        if (k) {  // a person pauses the arms and lets them go on while the twin follows
            while (!c.loop->is_waiting) assert_ok(om_loop_tick(c.loop));
            assert_ok(give(c.loop, OM_LOOP_PAUSE));
            assert_ok(om_loop_tick(c.loop));
            assert_ok(give(c.loop, OM_LOOP_RESUME));
            int nfixed = 0;  // the springs of the following are no attachments
            for (int b = 0; b < c.loop->grid.n * c.loop->grid.n; ++b)
                nfixed += om__follow_is_fixed(c.loop, b);
            assert_int_equal(nfixed, 0);
            while (c.loop->is_waiting) {
                OmObservation obs = {0};
                assert_ok(om_loop_tick(c.loop));
                assert_ok(om_world_observe(c.g.world, 0, &obs));
                assert_false(obs.arm[0].is_moving && c.loop->is_waiting);
                om_observation_done(&obs);
            }
        }
        tick_to_end(c.loop);
        const OmRetractResult* r = om_loop_result(c.loop);
        print_course(r);
        assert_true(r->nupdate >= 1);
        const OmRetractUpdate* u = &r->update[0];
        assert_int_equal(u->stage, OM_UPDATE_FOLLOWED);
        assert_true(u->is_followed);
        assert_string_equal(u->reason, "it saw too little");
        assert_int_equal(u->nattached_after, u->nattached_before);
        assert_true(u->mu_after < 0.5 * u->mu_before);
        assert_true(om_match_adoption_force(c.loop->adoption) > 0);
        assert_int_equal(c.seen.nmove_in_learning, 0);
        int i = 0;  // the first that a warning stopped
        while (i + 1 < r->naction && r->action[i].outcome != OM_ACTION_WARNED) ++i;
        assert_true(i + 1 < r->naction);
        const bool is_kept = r->action[i + 1].verb != OM_PLAN_RELEASE;
        printf("  then: %s\n", is_kept ? "the tissue stays in hand" : "it is let go");
        assert_int_equal(is_kept, k);
        assert_true(k ? r->nahead_step > 100 : r->nahead_step == 0);
        course_end(&c);
    }
}

// What is learnt in a fold must explain most of the distance, otherwise the twin follows.
static void test_doubtful_fold(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        Course c;
        course_begin(&c, warn_scene(0.1e-3, 0.3e-3, 0.06), false, false);
        c.teacher.truth = om_world_truth(c.g.world);
        c.teacher.left = k ? 0.7 : 0.5;
        while (c.loop->arm[0].in_hand < 0) assert_ok(om_loop_tick(c.loop));
        c.loop->has_dragged = true;
        while (om_loop_result(c.loop)->nupdate == 0 ||
               om_loop_result(c.loop)->update[0].stage == OM_UPDATE_STARTED)
            assert_ok(om_loop_tick(c.loop));
        const OmRetractUpdate* u = &om_loop_result(c.loop)->update[0];
        assert_int_equal(u->stage, k ? OM_UPDATE_FOLLOWED : OM_UPDATE_ADOPTED);
        assert_true((u->nattached_after == u->nattached_before) == k);
        if (k) assert_non_null(strstr(u->reason, "still 0.7 mm from the model, before 1.0 mm"));
        course_end(&c);
    }
}

// Where mu stays above its first limit the tissue is let go, whatever a fold would show in the twin.
static void test_half_a_follow(void** state) {
    (void)state;
    Course c;
    OmScene scene = warn_scene(0.15e-3, 0.3e-3, 0.06);
    scene.task.ahead = 3;
    course_begin(&c, scene, true, false);
    c.teacher.truth = om_world_truth(c.g.world);
    c.teacher.way = 0.3;
    while (c.loop->arm[0].in_hand < 0) assert_ok(om_loop_tick(c.loop));
    c.loop->has_dragged = true;
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    assert_true(r->update[0].mu_after > 0.15e-3);
    assert_true(r->update[0].mu_after < r->update[0].mu_before);
    int i = 0;
    while (i + 1 < r->naction && r->action[i].outcome != OM_ACTION_WARNED) ++i;
    assert_true(i + 1 < r->naction);
    assert_int_equal(r->action[i + 1].verb, OM_PLAN_RELEASE);
    course_end(&c);
}

// State 3 ends an unattended run. A person may continue: the state then holds no more until it has fallen.
static void test_state_three(void** state) {
    (void)state;
    Course c;
    course_begin(&c, warn_scene(0.05e-3, 0.06e-3, 0.07e-3), false, false);
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    assert_int_equal(r->outcome, OM_RETRACT_HELD);
    assert_int_equal(r->hold, OM_HOLD_WARNING);
    assert_int_equal(c.seen.nhold, 1);
    assert_near(c.seen.lasted, 1.0, 0.15);  // frames come every 0.1 s
    course_end(&c);
    course_begin(&c, warn_scene(0.05e-3, 0.06e-3, 0.07e-3), false, true);
    while (om_loop_phase(c.loop) != OM_LOOP_HOLD) assert_ok(om_loop_tick(c.loop));
    assert_ok(give(c.loop, OM_LOOP_RESUME));
    for (int i = 0; i < 10; ++i) assert_ok(om_loop_tick(c.loop));
    assert_int_equal(om_loop_warning(c.loop), 3);
    assert_int_equal(c.seen.nhold, 1);
    // the operation continues, and holds again only where the state has fallen before
    for (int i = 0; i < 20000 && om_loop_phase(c.loop) != OM_LOOP_ENDED; ++i) {
        assert_ok(om_loop_tick(c.loop));
        if (om_loop_phase(c.loop) == OM_LOOP_HOLD) assert_ok(give(c.loop, OM_LOOP_RESUME));
    }
    assert_int_equal(om_loop_phase(c.loop), OM_LOOP_ENDED);
    assert_int_not_equal(om_loop_result(c.loop)->outcome, OM_RETRACT_HELD);
    assert_true(om_loop_result(c.loop)->naction > 5);
    course_end(&c);
}

// A part of the tissue that does not follow the pull is noticed while mu is below its first limit. The truth learnt, it
// does follow.
static void test_a_part(void** state) {
    (void)state;
    Course c;
    OmScene scene = warn_scene(0.02, 0.05, 0.06);
    scene.monitor.part_limit[0] = 1e-3, scene.monitor.part_limit[1] = 2e-3;
    scene.monitor.hysteresis = 0.1e-3;
    course_begin(&c, scene, false, false);
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    assert_true(r->is_exposed);
    assert_int_equal(c.seen.largest, 2);
    assert_int_equal(c.seen.nmove_in_learning, 0);
    assert_true(r->nupdate >= 1);
    assert_int_equal(r->update[0].stage, OM_UPDATE_ADOPTED);
    assert_true(r->update[0].mu_after < 0.5 * r->update[0].mu_before);
    assert_true(r->update[0].part_after < r->update[0].part_before);
    course_end(&c);
}

// The same pulls as if the tissue had been folded before: it was dragged over the board, and its part is not judged.
static void test_a_part_after_a_fold(void** state) {
    (void)state;
    Course c;
    OmScene scene = warn_scene(0.02, 0.05, 0.06);
    scene.monitor.part_limit[0] = 1e-3, scene.monitor.part_limit[1] = 2e-3;
    scene.monitor.hysteresis = 0.1e-3;
    course_begin(&c, scene, false, false);
    while (c.loop->arm[0].in_hand < 0) assert_ok(om_loop_tick(c.loop));
    c.loop->has_dragged = true;
    double part = 0;
    for (bool is_pulling = true; is_pulling;) {
        assert_ok(om_loop_tick(c.loop));
        const OmPlanVerb verb = c.loop->action.plan.verb;
        is_pulling = c.loop->arm[0].in_hand >= 0 && om_loop_phase(c.loop) != OM_LOOP_ENDED;
        is_pulling = is_pulling && verb != OM_PLAN_MOVE_ROI && verb != OM_PLAN_MOVE_AWAY;
        part = fmax(part, om__warn_part(c.loop));
        assert_int_equal(om_loop_warning(c.loop), 0);
    }
    assert_true(part > 2e-3);  // it would have warned
    course_end(&c);
}

// The scene of the doubts: points 12 and `other` may be grasped, and neither exposes all of the ROI by a lift of 20 mm.
static OmScene doubt_scene(double visibility) {
    OmScene scene = warn_scene(0.1e-3, 0.02, 0.03);
    scene.task.max_height = scene.task.retract = 0.02;
    scene.task.visibility = visibility;
    scene.task.max_actions = 60;
    scene.tissue.friction = 0.3;  // a free twin without friction slides away
    return scene;
}

static void begin_doubt(Course* c, OmScene scene, int other, int nall) {
    course_begin(c, scene, false, false);
    c->teacher.nall = nall;
    for (int b = 0; b < 25; ++b)
        if (b != 12 && b != other)
            assert_ok(om_loop_command(c->loop, &(OmLoopCommand){OM_LOOP_FORBID, .block = b}));
}

// The first estimate attaches everything: no point may be grasped, and the loop would end. It was free in the belief
// before: the twin frees it again, and another point is grasped.
static void test_doubt(void** state) {
    (void)state;
    for (int has_doubt = 0; has_doubt < 2; ++has_doubt) {
        Course c;
        begin_doubt(&c, doubt_scene(0.99), 20, 1);
        if (!has_doubt) {
            om_free(c.loop->always);
            c.loop->always = NULL;
        }
        tick_to_end(c.loop);
        const OmRetractResult* r = om_loop_result(c.loop);
        print_course(r);
        assert_true(r->nupdate >= 1);
        assert_int_equal(r->update[0].stage, OM_UPDATE_ADOPTED);
        assert_int_equal(c.seen.ndoubt > 0, has_doubt);
        if (has_doubt) {
            assert_int_equal(c.seen.nrest, 0);
            assert_true(r->naction > c.seen.naction);
            assert_int_not_equal(r->outcome, OM_RETRACT_NO_PLAN);
        } else {
            assert_int_equal(r->outcome, OM_RETRACT_NO_PLAN);
        }
        course_end(&c);
    }
}

// Every estimate attaches everything: the tissue in hand is given up after a second doubt, each of the two points is
// grasped once, and the loop ends.
static void test_doubt_ends(void** state) {
    (void)state;
    Course c;
    begin_doubt(&c, doubt_scene(1.5), 20, 1000);  // nothing exposes it
    c.loop->task.max_height = 0.05;
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    int ngrasp = 0;
    for (int i = 0; i < r->naction; ++i) ngrasp += r->action[i].verb == OM_PLAN_GRASP;
    assert_int_equal(ngrasp, 2);
    assert_true(c.seen.ndoubt >= 1 && c.seen.ndoubt <= 4);
    assert_int_not_equal(r->outcome, OM_RETRACT_GAVE_UP);
    course_end(&c);
}

// The first belief attaches the tissue under another point, which is free, and every estimate agrees and attaches all.
// After a warning, where no plan is left, the first belief is given up, and that point is grasped; unless a person has
// marked it.
static void test_doubt_of_the_first_belief(void** state) {
    (void)state;
    for (int is_marked = 0; is_marked < 2; ++is_marked) {
        Course c;
        OmScene scene = doubt_scene(1.5);  // nothing exposes it
        scene.believed.kind = OM_BELIEF_BOX;
        scene.believed.lo = om_vec3(-1, 0.01, -1), scene.believed.hi = om_vec3(-0.03, 1, 1);
        begin_doubt(&c, scene, 15, 1000);
        if (is_marked)
            assert_ok(om_loop_command(c.loop, &(OmLoopCommand){OM_LOOP_ATTACH, .block = 15}));
        tick_to_end(c.loop);
        const OmRetractResult* r = om_loop_result(c.loop);
        print_course(r);
        int ngrasp[25] = {0};
        for (int i = 0; i < r->naction; ++i)
            if (r->action[i].verb == OM_PLAN_GRASP) ++ngrasp[r->action[i].block];
        assert_int_equal(ngrasp[12], 1);
        assert_int_equal(ngrasp[15], !is_marked);
        assert_int_equal(c.seen.nfirst, !is_marked);
        assert_int_not_equal(r->outcome, OM_RETRACT_GAVE_UP);
        course_end(&c);
    }
}

// Without a warning nothing says that the first belief is wrong: where it attaches all, the loop ends.
static void test_no_doubt_without_a_warning(void** state) {
    (void)state;
    Course c;
    OmScene scene = doubt_scene(1.5);
    scene.believed.kind = OM_BELIEF_BOX;
    scene.believed.lo = om_vec3(-1, -1, -1), scene.believed.hi = om_vec3(1, 1, 1);
    begin_doubt(&c, scene, 15, 1000);
    tick_to_end(c.loop);
    const OmRetractResult* r = om_loop_result(c.loop);
    assert_int_equal(r->outcome, OM_RETRACT_NO_PLAN);
    assert_int_equal(r->naction, 0);
    assert_int_equal(c.seen.ndoubt, 0);
    course_end(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_warning),
        cmocka_unit_test(test_state_one),
        cmocka_unit_test(test_state_two),
        cmocka_unit_test(test_nothing_is_learnt),
        cmocka_unit_test(test_a_fold_at_rest),
        cmocka_unit_test(test_follow),
        cmocka_unit_test(test_doubtful_fold),
        cmocka_unit_test(test_half_a_follow),
        cmocka_unit_test(test_state_three),
        cmocka_unit_test(test_a_part),
        cmocka_unit_test(test_a_part_after_a_fold),
        cmocka_unit_test(test_doubt),
        cmocka_unit_test(test_doubt_ends),
        cmocka_unit_test(test_doubt_of_the_first_belief),
        cmocka_unit_test(test_no_doubt_without_a_warning),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
