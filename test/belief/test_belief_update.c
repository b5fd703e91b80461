// test_belief_update.c: attachments of the twin corrected while the loop runs, with estimates made up by the test.
#include <stdatomic.h>
#include <time.h>
#include <unistd.h>

#include "test_alloc.h"

#include "hidden_world.h"
#include "loop_rig.h"

#include "loop/loop_state.h"
#include "omentum/belief_update.h"
#include "omentum/match_acquisition.h"
#include "omentum/retract.h"

// ---- an estimate made up --------------------------------------------------------------------------------

typedef enum FakeKind { FAKE_ACCEPT, FAKE_REFUSE, FAKE_FAIL, FAKE_WAIT } FakeKind;

// Vertices of the underside beyond x = from in the task frame are attached.
typedef struct Fake {
    const OmSite* site;
    FakeKind kind;
    double from;    // m
    double shift;   // m, `from` falls by this with each call
    double sleep;   // s, of each call
    double uneven;  // s more in every other call
    double late;    // s, age of the world's pictures
    double pace;    // s that a tick of the loop takes at least
    int ncall;      // written by the job
    int nmost;      // acquisitions of a call, the most
    atomic_int nrunning;
} Fake;

static void sleep_for(double seconds) {
    if (seconds <= 0) return;
    struct timespec t = {(time_t)seconds, (long)(1e9 * (seconds - floor(seconds)))};
    nanosleep(&t, NULL);
}

static OmStatus fill(const Fake* f, int nacquisition, OmMatchEstimate* e) {
    const OmTetMesh* mesh = &f->site->mesh;
    const OmMeshSet* under = om_tet_mesh_find_set(mesh, "underside");
    OmPose to_task = om_pose_inverse(f->site->pose_world_task);
    OM_ALLOC(e->attached, (size_t)mesh->nvert);
    OM_ALLOC(e->stiffness, (size_t)mesh->nvert);
    e->nvert = e->nnode = mesh->nvert;
    e->nacquisition = nacquisition;
    memset(e->attached, 0, (size_t)mesh->nvert);
    for (int i = 0; i < under->nvert; ++i) {
        const int v = under->vert[i];
        e->attached[v] = om_pose_apply(to_task, om_load3(mesh->x, v)).x > f->from;
        e->stiffness[v] = e->attached[v] ? 50 : 0;
    }
    return OM_OK;
}

static OmStatus fake(void* ctx, int n, const OmAcquisition* a, const OmProgress* progress,
                     OmMatchEstimate* e) {
    Fake* f = ctx;
    (void)a;
    if (atomic_fetch_add(&f->nrunning, 1) > 0) return om_error(OM_IO, "two at once");
    sleep_for(f->sleep + (f->ncall % 2 ? f->uneven : 0));
    OmStatus status = OM_OK;
    if (f->kind == FAKE_WAIT)
        while (status == OM_OK) {
            sleep_for(1e-3);
            status = om_progress_report(progress, "waiting", 0, 1);
        }
    if (f->kind == FAKE_FAIL) status = om_error(OM_INVALID, "nothing was understood");
    if (f->kind == FAKE_ACCEPT || f->kind == FAKE_REFUSE) status = fill(f, n, e);
    e->is_accepted = status == OM_OK && f->kind == FAKE_ACCEPT;
    if (f->kind == FAKE_REFUSE) snprintf(e->reason, sizeof e->reason, "it saw too little");
    f->from -= f->shift;
    f->nmost = n > f->nmost ? n : f->nmost;
    ++f->ncall;
    atomic_fetch_sub(&f->nrunning, 1);
    return status;
}

// ---- a loop with an updater -----------------------------------------------------------------------------

// The truth is attached on the far half; the twin believes in no attachment.
static OmScene update_scene(void) {
    OmScene scene = object_scene();
    scene.believed.kind = OM_BELIEF_NONE;
    scene.rgbd.width = 96, scene.rgbd.height = 72;
    scene.task.max_actions = 16;
    return scene;
}

typedef struct Seen {  // what a listener saw
    int ntaken, nstarted, nended, ndoubt;
    int npoint_min, nheld_min;
    double lift_min;  // m
    uint64_t twin;    // hashes of all ticks, in order
    OmUpdateStage last;
    double rest;  // s from the end of an action to its acquisition
    double pace;  // s of the clock that a tick takes at least
    const Rig* rig;
} Seen;

static OmStatus seen_update(void* ctx, const OmLoop* loop, const OmUpdateEvent* event) {
    Seen* s = ctx;
    assert_int_equal(event->tick, om_loop_ntick(loop));
    assert_near(event->time, om_loop_sample(loop).time, 0);
    s->ndoubt += event->stage == OM_UPDATE_DOUBTED;
    if (event->stage == OM_UPDATE_DOUBTED) {
        assert_int_equal(event->index, s->nended - 1);  // the last estimate
        return OM_OK;
    }
    s->last = event->stage;
    if (event->stage == OM_UPDATE_STARTED) assert_int_equal(event->index, s->nstarted++);
    if (event->stage > OM_UPDATE_STARTED) assert_int_equal(event->index, s->nended++);
    if (event->stage != OM_UPDATE_TAKEN) return OM_OK;
    const OmAcquisition* a = event->acquisition;
    const OmTetMesh* mesh = &s->rig->twin_site.mesh;
    assert_int_equal(event->index, s->ntaken++);
    const OmRetractResult* r = om_loop_result(loop);
    assert_near(event->time - r->action[r->naction - 1].end, s->rest, 1e-9);
    assert_near(a->time, event->time, 0);
    assert_ok(om_scan_check(&a->scan));
    assert_int_equal(a->ngrasp, 1);
    assert_memory_equal(a->x_twin, om_body_x(s->rig->twin), 24 * (size_t)mesh->nvert);
    const OmMatchGrasp* g = &a->grasp[0];
    s->npoint_min =
        s->npoint_min && s->npoint_min < a->scan.npoint ? s->npoint_min : a->scan.npoint;
    s->nheld_min = s->nheld_min && s->nheld_min < g->nvert ? s->nheld_min : g->nvert;
    // held vertices have moved with the tool since the grasp
    OmVec3 moved = om_sub(g->pose_world_now.p, g->pose_world_grasp.p);
    OmVec3 up = om_quat_rotate(s->rig->twin_site.pose_world_task.q, om_vec3(0, 0, 1));
    double lift = om_dot(moved, up);
    s->lift_min = s->lift_min > 0 ? fmin(s->lift_min, lift) : lift;
    for (int i = 0; i < g->nvert; ++i) {
        OmVec3 d = om_sub(om_load3(a->x_twin, g->vert[i]), g->pose_world_now.p);
        assert_true(om_norm(d) <= s->rig->scene.task.grasp_radius + 1e-3);
    }
    return OM_OK;
}

static OmStatus seen_tick(void* ctx, const OmLoop* loop, const OmRetractSample* now) {
    (void)loop, (void)now;
    Seen* s = ctx;
    sleep_for(s->pace);
    s->twin = (s->twin ^ om_body_hash(s->rig->twin)) * 0x100000001b3u;
    return OM_OK;
}

typedef struct Run {
    OmRetractResult result;
    Seen seen;
    uint64_t twin;  // hash at the end
} Run;

static void run_done(Run* run) { om_retract_result_done(&run->result); }

// A loop from rest to its end on `world`. `change` may change the updater's definition.
static void run_on(Rig* g, OmWorld* world, Fake* f, const OmUpdateDef* like, Run* run) {
    rig_start(g);
    *run = (Run){.seen = {.rig = g, .pace = f ? f->pace : 0, .rest = f ? 0.3 + f->late : 0}};
    OmUpdateDef def = om_update_default_def(&g->scene, world, &g->twin_site);
    if (f) def.estimate = fake, def.estimate_ctx = f;
    if (like) {
        def.timing = like->timing;
        def.replay_tick = like->replay_tick;
        def.nreplay = like->nreplay;
    }
    OmUpdater* updater;
    assert_ok(om_updater_create(&def, &updater));
    OmLoopListener listener = {.ctx = &run->seen, .on_tick = seen_tick, .on_update = seen_update};
    OmLoopDef loop_def = om_loop_default_def(&g->scene.task, world, g->twin, g->planner);
    loop_def.truth = om_world_truth(world);
    loop_def.listener = &listener;
    loop_def.nlistener = 1;
    loop_def.updater = updater;
    OmLoop* loop;
    assert_ok(om_loop_create(&loop_def, &loop));
    tick_to_end(loop);
    run->twin = om_body_hash(g->twin);
    assert_ok(om_loop_take_result(loop, &run->result));
    om_loop_destroy(loop);
    om_updater_destroy(updater);
}

static void expect_same_run(const Run* a, const Run* b) {
    expect_same(&a->result, &b->result);
    assert_true(a->twin == b->twin);
    assert_true(a->seen.twin == b->seen.twin);
    assert_int_equal(a->result.belief.nupdate, b->result.belief.nupdate);
    for (int i = 0; i < a->result.belief.nupdate; ++i) {
        const OmRetractUpdate *u = &a->result.belief.update[i], *v = &b->result.belief.update[i];
        assert_int_equal(u->stage, v->stage);
        assert_int_equal(u->start_tick, v->start_tick);
        assert_int_equal(u->end_tick, v->end_tick);
        assert_int_equal(u->nattached_before, v->nattached_before);
        assert_int_equal(u->nattached_after, v->nattached_after);
    }
}

// ---- acquisitions ---------------------------------------------------------------------------------------

// Acquisitions alone change nothing: the run is that without an updater.
static void test_acquisitions_alone(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, update_scene());
    OmLoop* loop = make_loop(&g, NULL);
    tick_to_end(loop);
    OmRetractResult plain;
    assert_ok(om_loop_take_result(loop, &plain));
    om_loop_destroy(loop);
    Run run;
    run_on(&g, g.world, NULL, NULL, &run);
    expect_same(&plain, &run.result);
    int nlifted = 0;
    for (int i = 0; i < plain.naction; ++i) {
        OmPlanVerb verb = plain.action[i].verb;
        nlifted += verb == OM_PLAN_PULL || verb == OM_PLAN_MOVE_ROI || verb == OM_PLAN_MOVE_AWAY;
    }
    assert_true(nlifted >= 3);
    assert_int_equal(run.seen.ntaken, nlifted);
    assert_int_equal(run.result.belief.nacquisition, nlifted);
    assert_true(run.seen.nstarted == 0 && run.result.belief.nupdate == 0);
    print_message("%d acquisitions, at least %d points, lifted %.1f mm, %d vertices held\n",
                  nlifted, run.seen.npoint_min, 1e3 * run.seen.lift_min, run.seen.nheld_min);
    assert_true(run.seen.npoint_min > 30 && run.seen.nheld_min >= 1);
    assert_true(run.seen.lift_min >= 0.009);
    run_done(&run);
    // Higher tissue alone.
    g.scene.update.min_lift = 0.03;
    run_on(&g, g.world, NULL, NULL, &run);
    assert_true(run.seen.ntaken > 0 && run.seen.ntaken < nlifted && run.seen.lift_min >= 0.029);
    run_done(&run);
    om_retract_result_done(&plain);
    rig_destroy(&g);
}

// ---- adoption -------------------------------------------------------------------------------------------

// In a simulated world an estimate is adopted a fixed time after its start, at any speed of the estimate and with any
// number of workers.
static void test_a_fixed_latency(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, update_scene());
    g.scene.update.latency = 0.25;
    Run first;
    for (int k = 0; k < 3; ++k) {
        Fake f = {.site = &g.twin_site, .from = 0.03, .shift = 0.02};
        f.sleep = k == 1 ? 0.05 : 0;
        f.uneven = k == 1 ? 0.05 : 0;
        Run run;
        if (k == 2) {  // a twin and a world with two workers
            rig_destroy(&g);
            OmScene scene = update_scene();
            scene.update.latency = 0.25;
            rig_create_with(&g, scene, 2);
            f.site = &g.twin_site;
        }
        run_on(&g, g.world, &f, NULL, &run);
        const OmRetractResult* r = &run.result;
        print_message("%d updates, %s\n", r->belief.nupdate, r->reason);
        assert_true(r->belief.nupdate >= 2 && f.ncall >= 2);
        for (int i = 0; i < r->belief.nupdate; ++i) {
            const OmRetractUpdate* u = &r->belief.update[i];
            if (u->stage == OM_UPDATE_CANCELLED) continue;
            assert_int_equal(u->stage, OM_UPDATE_ADOPTED);
            assert_int_equal(u->end_tick - u->start_tick, 13);  // 0.25 s in ticks of 0.02 s
            assert_true(i > 0 || u->nattached_before == 0);
            assert_true(u->nattached_after > u->nattached_before);
        }
        if (k > 0) expect_same_run(&first, &run);
        if (k == 0)
            first = run;
        else
            run_done(&run);
    }
    run_done(&first);
    rig_destroy(&g);
}

// With a refusal the twin is, in every tick, the twin of a run without estimates. Estimates that fail again and again
// end in a hold.
static void test_a_refusal_changes_nothing(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, update_scene());
    const OmUpdateDef never = {.timing = OM_UPDATE_REPLAYED};
    Fake f = {.site = &g.twin_site};
    Run without, run;
    run_on(&g, g.world, &f, &never, &without);
    assert_int_equal(without.result.belief.nupdate, 1);  // the job is never ripe
    assert_int_equal(without.result.belief.update[0].stage, OM_UPDATE_CANCELLED);
    assert_int_equal(without.result.belief.update[0].end_tick, -1);
    for (int k = 0; k < 2; ++k) {
        f = (Fake){.site = &g.twin_site, .kind = k ? FAKE_FAIL : FAKE_REFUSE};
        run_on(&g, g.world, &f, NULL, &run);
        if (k) {
            assert_int_equal(run.result.outcome, OM_RETRACT_HELD);
            assert_int_equal(run.result.hold, OM_HOLD_UPDATE);
            assert_int_equal(run.result.belief.nupdate, OM_LOOP_MAX_FAILED);
            assert_non_null(strstr(run.result.reason, "nothing was understood"));
            for (int i = 0; i + 1 < run.result.naction; ++i)
                assert_near(run.result.action[i].end, without.result.action[i].end, 0);
        } else {
            expect_same(&without.result, &run.result);
            assert_true(without.seen.twin == run.seen.twin);
            assert_true(run.result.belief.nupdate >= 2);
        }
        const OmRetractUpdate* u = &run.result.belief.update[0];
        assert_int_equal(u->stage, OM_UPDATE_REFUSED);
        assert_string_equal(u->reason, k ? "nothing was understood" : "it saw too little");
        assert_int_equal(u->nattached_after, u->nattached_before);
        run_done(&run);
    }
    run_done(&without);
    rig_destroy(&g);
}

// In a real world an estimate is adopted when it is ready. A replay adopts in the recorded ticks. Pictures come late
// there: the arms keep still until one was exposed while the tissue rested.
static void test_a_real_world_and_its_replay(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, update_scene());
    HiddenWorld hidden = hidden_world(g.world, om_world_sources(g.world));
    assert_int_equal(om_world_state_size(&hidden.head), 0);
    Fake f = {.site = &g.twin_site, .from = 0.03, .shift = 0.02};
    f.sleep = 0.01, f.uneven = 0.02, f.pace = 0.002;
    f.late = hidden.delay = 0.06;
    Run real, replay;
    run_on(&g, &hidden.head, &f, NULL, &real);
    int tick[64], n = 0;
    for (int i = 0; i < real.result.belief.nupdate; ++i)
        tick[n++] = real.result.belief.update[i].end_tick;
    assert_int_equal(real.result.belief.update[n - 1].end_tick < 0,
                     real.result.belief.update[n - 1].stage == OM_UPDATE_CANCELLED);
    print_message("%d adopted, the first after %d ticks\n", n,
                  tick[0] - real.result.belief.update[0].start_tick);
    assert_true(n >= 1 && tick[0] > real.result.belief.update[0].start_tick);
    f = (Fake){.site = &g.twin_site, .from = 0.03, .shift = 0.02, .late = 0.06};  // another speed
    const OmUpdateDef like = {.timing = OM_UPDATE_REPLAYED, .replay_tick = tick, .nreplay = n};
    run_on(&g, &hidden.head, &f, &like, &replay);
    expect_same_run(&real, &replay);
    run_done(&real);
    run_done(&replay);
    rig_destroy(&g);
}

// ---- the end --------------------------------------------------------------------------------------------

// Whatever ends the loop while an estimate runs: the job is cancelled and joined.
static void test_an_end_while_an_estimate_runs(void** state) {
    (void)state;
    Rig g;
    OmScene scene = update_scene();
    scene.update.latency = 60;
    rig_create(&g, scene);
    for (int k = 0; k < 4; ++k) {
        rig_start(&g);
        Fake f = {.site = &g.twin_site, .kind = FAKE_WAIT};
        Seen seen = {.rig = &g, .rest = 0.3};
        OmUpdateDef def = om_update_default_def(&g.scene, g.world, &g.twin_site);
        def.estimate = fake, def.estimate_ctx = &f;
        OmUpdater* updater;
        assert_ok(om_updater_create(&def, &updater));
        OmLoopListener listener = {.ctx = &seen, .on_update = seen_update};
        OmLoopDef loop_def = om_loop_default_def(&g.scene.task, g.world, g.twin, g.planner);
        loop_def.updater = updater;
        loop_def.listener = &listener;
        loop_def.nlistener = 1;
        OmLoop* loop;
        assert_ok(om_loop_create(&loop_def, &loop));
        while (seen.nstarted == 0) assert_ok(om_loop_tick(loop));
        assert_int_equal(om_loop_result(loop)->belief.update[0].stage, OM_UPDATE_STARTED);
        if (k == 1) assert_ok(give(loop, OM_LOOP_PAUSE));
        for (int i = 0; i < 10; ++i) assert_ok(om_loop_tick(loop));
        if (k < 2) {
            assert_ok(give(loop, k ? OM_LOOP_CANCEL : OM_LOOP_ABORT));
            assert_int_equal(seen.last, OM_UPDATE_CANCELLED);
            assert_int_equal(om_loop_result(loop)->belief.update[0].stage, OM_UPDATE_CANCELLED);
            assert_int_equal(om_loop_result(loop)->belief.update[0].end_tick, -1);
            assert_int_equal(atomic_load(&f.nrunning), 0);
        }
        if (k == 3) {  // a failed loop ends its job when it is destroyed
            loop->has_failed = true;
        }
        om_loop_destroy(loop);
        assert_int_equal(atomic_load(&f.nrunning), 0);
        om_updater_destroy(updater);
    }
    om_updater_destroy(NULL);
    rig_destroy(&g);
}

// An arm that reaches for a block stops when an update says that the block is attached; then a new plan is made.
static void test_a_reach_for_an_attached_block(void** state) {
    (void)state;
    Rig g;
    OmScene scene = update_scene();
    scene.task.visibility = 1.5;  // no grasp exposes it
    scene.roi.center = om_vec3(-0.01, 0.03, 0);
    rig_create(&g, scene);
    OmUpdateDef like = {.timing = OM_UPDATE_REPLAYED};
    Fake f = {.site = &g.twin_site, .from = -1};  // the whole underside
    Run without, run;
    run_on(&g, g.world, &f, &like, &without);
    int at = 0;
    for (int i = 1; i < without.result.naction; ++i)
        if (without.result.action[i].verb == OM_PLAN_REACH && at == 0) at = i;
    assert_true(at > 0);
    const double middle = 0.5 * (without.result.action[at].begin + without.result.action[at].end);
    const int tick = (int)(middle / scene.task.time_step);
    like.replay_tick = &tick;
    like.nreplay = 1;
    run_on(&g, g.world, &f, &like, &run);
    const OmRetractResult* r = &run.result;
    assert_int_equal(r->action[at].verb, OM_PLAN_REACH);
    assert_int_equal(r->action[at].outcome, OM_ACTION_OUTDATED);
    assert_near(r->action[at].end, tick * scene.task.time_step, 1e-9);
    // No block is left, so the twin doubts what it has just learnt, and the operation continues.
    assert_int_equal(run.seen.ndoubt, 1);
    assert_true(r->naction > at + 1 && r->nplan > without.result.action[at].plan + 2);
    run_done(&run);
    run_done(&without);
    rig_destroy(&g);
}

// Between two actions new attachments lead to a new plan where they change the blocks that may be grasped.
static void test_a_new_plan_after_adoption(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, update_scene());
    const OmUpdateDef never = {.timing = OM_UPDATE_REPLAYED};
    for (int k = 0; k < 2; ++k) {
        Fake f = {.site = &g.twin_site, .from = k ? 0.03 : 1};  // half of the blocks, or none
        Run without, run;
        run_on(&g, g.world, &f, &never, &without);
        run_on(&g, g.world, &f, NULL, &run);
        assert_int_equal(run.result.belief.update[0].stage, OM_UPDATE_ADOPTED);
        assert_true(run.result.belief.update[0].end <
                    run.result.action[run.result.naction - 1].begin);
        assert_int_equal(without.result.nplan, 1);
        assert_int_equal(run.result.nplan, k ? 2 : 1);
        run_done(&run);
        run_done(&without);
    }
    rig_destroy(&g);
}

// ---- acquisitions that are kept ---------------------------------------------------------------------------

// The last acquisitions of different grasps are given together; the same grasp again replaces its acquisition.
static void test_acquisitions_of_several_grasps(void** state) {
    (void)state;
    Rig g;
    OmScene scene = update_scene();
    scene.task.visibility = 1.5;  // no grasp exposes it
    scene.task.max_actions = test_is_slow() ? 40 : 24;
    scene.believed.kind = OM_BELIEF_SAME;
    scene.roi.center = om_vec3(-0.01, 0.03, 0);
    rig_create(&g, scene);
    const OmUpdateDef never = {.timing = OM_UPDATE_WHEN_READY};
    for (int keep = test_is_slow() ? 1 : 2; keep <= 2; ++keep) {
        g.scene.update.keep = keep;
        Fake f = {.site = &g.twin_site, .kind = FAKE_REFUSE};
        Run run;
        run_on(&g, g.world, &f, &never, &run);
        int ngrasp = 0;
        for (int i = 0; i < run.result.naction; ++i)
            ngrasp += run.result.action[i].verb == OM_PLAN_GRASP;
        assert_true(ngrasp >= 3 && run.result.belief.nacquisition > ngrasp);
        assert_int_equal(f.nmost, keep);
        assert_int_equal(run.result.belief.update[1].nacquisition,
                         1);  // two looks at the first grasp
        run_done(&run);
    }
    rig_destroy(&g);
}

// Of one grasp the newest acquisition of lifted tissue and the newest of folded tissue are kept.
static void test_a_fold_keeps_the_lift(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, update_scene());
    OmUpdateDef def = om_update_default_def(&g.scene, g.world, &g.twin_site);
    def.settings.keep = 3;
    OmUpdater* u;
    assert_ok(om_updater_create(&def, &u));
    OmObservation obs = {0};
    assert_ok(om_world_observe(g.world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs));
    OmPose tip[OM_MAX_ARM];
    for (int a = 0; a < OM_MAX_ARM; ++a) tip[a] = (OmPose){om_vec3(0, 0, 0), om_quat_identity()};
    const unsigned char* attached = om_body_attached(g.twin);
    om__updater_grasp(u, 0, tip[0], 0.01, g.twin);
    static const double kept[][2] = {{1, 0}, {1, 2}, {2, 3}, {3, 4}};  // s, after each acquisition
    for (int i = 0; i < 4; ++i) {  // lifted, folded, lifted, folded
        assert_ok(om__updater_take(u, &obs, 1 + i, tip, g.twin, attached, i % 2 == 1, false));
        assert_int_equal(u->nkept, i ? 2 : 1);
        for (int k = 0; k < u->nkept; ++k) assert_near(u->kept[k]->data.time, kept[i][k], 0);
    }
    om__updater_grasp(u, 0, tip[0], 0.01, g.twin);  // another grasp
    assert_ok(om__updater_take(u, &obs, 5, tip, g.twin, attached, true, false));
    assert_int_equal(u->nkept, 3);
    om_observation_done(&obs);
    om_updater_destroy(u);
    rig_destroy(&g);
}

// ---- omentum retract ----------------------------------------------------------------------------------------

// Recorded acquisitions can be read again, and recording changes nothing in the run.
static void test_recorded_acquisitions(void** state) {
    (void)state;
    OmScene scene = update_scene();
    scene.task.max_actions = 6;
    char dir[] = "/tmp/om_update_XXXXXX", out[64], path[128];
    assert_non_null(mkdtemp(dir));
    snprintf(out, sizeof out, "%s/run", dir);
    OmRetractDef def = om_retract_default_def(&scene);
    def.nworker = 1;
    OmRetractResult plain, r;
    assert_ok(om_retract_run(&def, NULL, &plain));
    assert_int_equal(plain.belief.nacquisition, 0);
    def.out_dir = out;
    def.frame_every = 0;
    def.records_acquisitions = true;
    assert_ok(om_retract_run(&def, NULL, &r));
    expect_same(&plain, &r);
    assert_true(r.belief.nacquisition > 0 && r.belief.nupdate == 0);
    double last = 0;
    for (int i = 0; i < r.belief.nacquisition; ++i) {
        snprintf(path, sizeof path, "%s/acquisitions/%03d.yaml", out, i);
        OmAcquisitionFile file;
        OmAcquisition a;
        assert_ok(om_acquisition_load(path, NULL, &file, &a));
        assert_true(a.scan.npoint > 30 && a.scan.has_camera && a.time > last);
        assert_int_equal(a.ngrasp, 1);
        OmVec3 moved = om_sub(a.grasp[0].pose_world_now.p, a.grasp[0].pose_world_grasp.p);
        assert_true(om_norm(moved) > 0.009);
        assert_near(a.grasp[0].radius, scene.task.grasp_radius, 1e-12);
        last = a.time;
        om_acquisition_done(&a);
    }
    snprintf(path, sizeof path, "%s/acquisitions/%03d.yaml", out, r.belief.nacquisition);
    assert_false(om_path_exists(path));
    assert_ok(om_path_remove(dir));
    om_retract_result_done(&plain);
    om_retract_result_done(&r);
}

// A run with estimates of room match repeats to the byte with one worker and with two, and its record lists them.
static void test_a_run_with_updates(void** state) {
    (void)state;
    OmScene scene = update_scene();
    scene.update.is_enabled = true;
    scene.task.max_actions = test_is_slow() ? 7 : 4;
    char dir[] = "/tmp/om_update_XXXXXX", out[64], path[128], *text;
    size_t size;
    assert_non_null(mkdtemp(dir));
    snprintf(out, sizeof out, "%s/run", dir);
    OmRetractDef def = om_retract_default_def(&scene);
    def.out_dir = out;
    def.frame_every = 0;
    OmRetractResult r[2];
    for (int k = 0; k < 2; ++k) {
        def.nworker = 1 + k;
        assert_ok(om_retract_run(&def, NULL, &r[k]));
    }
    expect_same(&r[0], &r[1]);
    assert_true(r[0].belief.nupdate > 0);
    assert_int_equal(r[0].belief.nupdate, r[1].belief.nupdate);
    for (int i = 0; i < r[0].belief.nupdate; ++i) {
        assert_int_equal(r[0].belief.update[i].stage, r[1].belief.update[i].stage);
        assert_string_equal(r[0].belief.update[i].reason, r[1].belief.update[i].reason);
        assert_int_equal(r[0].belief.update[i].nattached_after,
                         r[1].belief.update[i].nattached_after);
        assert_near(r[0].belief.update[i].after_median, r[1].belief.update[i].after_median, 0);
    }
    snprintf(path, sizeof path, "%s/run.json", out);
    assert_ok(om_file_read(path, 1 << 22, &text, &size));
    assert_non_null(strstr(text, "\"updates\": ["));
    om_free(text);
    // an engine without springs cannot take them
    snprintf(scene.tissue.engine, sizeof scene.tissue.engine, "chainmail");
    scene.task.watch_force = false;
    OmRetractResult refused;
    assert_status(om_retract_run(&def, NULL, &refused), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "springs"));
    assert_ok(om_path_remove(dir));
    for (int k = 0; k < 2; ++k) om_retract_result_done(&r[k]);
}

// ---- definitions and memory ---------------------------------------------------------------------------------

static void test_wrong_definitions(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, update_scene());
    const OmUpdateDef good = om_update_default_def(&g.scene, g.world, &g.twin_site);
    OmUpdateDef def = good;
    OmUpdater* updater;
    def.cookie = 0;
    assert_status(om_updater_create(&def, &updater), OM_INVALID);
    assert_null(updater);
    def = good, def.settings.keep = 0;
    assert_status(om_updater_create(&def, &updater), OM_INVALID);
    def = good, def.settings.keep = OM_UPDATE_MAX_KEEP + 1;
    assert_status(om_updater_create(&def, &updater), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "keep"));
    def = good, def.settings.latency = -1;
    assert_status(om_updater_create(&def, &updater), OM_INVALID);
    def = good, def.settings.rest = NAN;
    assert_status(om_updater_create(&def, &updater), OM_INVALID);
    def = good, def.settings.min_lift = INFINITY;
    assert_status(om_updater_create(&def, &updater), OM_INVALID);
    def = good, def.nreplay = 1;
    assert_status(om_updater_create(&def, &updater), OM_INVALID);
    def = good, def.timing = (OmUpdateTiming)7;
    assert_status(om_updater_create(&def, &updater), OM_INVALID);
    // a world without depth, a twin of another mesh
    OmLoop* loop;
    assert_ok(om_updater_create(&good, &updater));
    HiddenWorld blind = hidden_world(g.world, OM_OBSERVE_VISIBILITY);
    OmLoopDef loop_def = om_loop_default_def(&g.scene.task, &blind.head, g.twin, g.planner);
    loop_def.updater = updater;
    assert_status(om_loop_create(&loop_def, &loop), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "depth"));
    loop_def.world = g.world;
    loop_def.twin = om_world_truth(g.world);
    assert_status(om_loop_create(&loop_def, &loop), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertices"));
    om_updater_destroy(updater);
    rig_destroy(&g);
}

typedef struct Small {
    Rig* rig;
    void *twin, *world;  // snapshots, right before the first acquisition
} Small;

// From a grasp that is held, through one acquisition and its estimate, to the first steps of the adoption.
static OmStatus run_small(void* ctx) {
    const Small* s = ctx;
    Rig* g = s->rig;
    Fake f = {.site = &g->twin_site, .from = 0.03};
    om_body_restore(g->twin, s->twin);
    OmUpdater* updater = NULL;
    OmLoop* loop = NULL;
    OmUpdateDef def = om_update_default_def(&g->scene, g->world, &g->twin_site);
    def.estimate = fake, def.estimate_ctx = &f;
    OmLoopDef loop_def = om_loop_default_def(&g->scene.task, g->world, g->twin, g->planner);
    OmStatus status = om_world_restore(g->world, s->world);
    if (status >= 0) status = om_updater_create(&def, &updater);
    loop_def.updater = updater;
    if (status >= 0) status = om_loop_create(&loop_def, &loop);
    if (status >= 0) {  // as after a pull
        om__look_note_grasp(&loop->belief, 0, (OmPose){om_vec3(0, 0, 0), om_quat_identity()});
        bool needs_tick;
        status = om_loop_tick(loop);
        loop->belief.look_begin = -1;
        if (status >= 0) status = om__look_take(&loop->belief, &needs_tick);
        for (int i = 0; i < 3 && status >= 0; ++i) status = om_loop_tick(loop);
        if (status >= 0 && loop->result.belief.update[0].stage != OM_UPDATE_ADOPTED) status = OM_IO;
    }
    om_loop_destroy(loop);
    om_updater_destroy(updater);
    return status;
}

static void test_every_allocation_may_fail(void** state) {
    (void)state;
    Rig g;
    OmScene scene = update_scene();
    scene.update.latency = 0;
    scene.rgbd.width = 24, scene.rgbd.height = 18;
    rig_create(&g, scene);
    OmBody* truth = om_world_truth(g.world);
    OmVec3 tip =
        om_load3(om_body_x(g.twin), om_tet_mesh_find_set(&g.twin_site.mesh, "top")->vert[0]);
    OmPose pose = {tip, g.twin_site.pose_world_task.q};
    int nheld;
    assert_ok(om_body_grasp(g.twin, 0, pose, 0.02, &nheld));
    assert_ok(om_body_grasp(truth, 0, pose, 0.02, &nheld));
    Small small = {&g, malloc(om_body_state_size(g.twin)), malloc(om_world_state_size(g.world))};
    om_body_save(g.twin, small.twin);
    assert_ok(om_world_save(g.world, small.world));
    assert_ok(run_small(&small));  // what the world, the planner and the twin keep is there now
    assert_true(test_failing_allocations(run_small, &small, 3) > 5);
    free(small.twin);
    free(small.world);
    rig_destroy(&g);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_acquisitions_of_several_grasps),
        cmocka_unit_test(test_a_run_with_updates),
        cmocka_unit_test(test_a_new_plan_after_adoption),
        cmocka_unit_test(test_a_real_world_and_its_replay),
        cmocka_unit_test(test_a_refusal_changes_nothing),
        cmocka_unit_test(test_a_fixed_latency),
        cmocka_unit_test(test_a_reach_for_an_attached_block),
        cmocka_unit_test(test_wrong_definitions),
        cmocka_unit_test(test_every_allocation_may_fail),
        cmocka_unit_test(test_recorded_acquisitions),
        cmocka_unit_test(test_an_end_while_an_estimate_runs),
        cmocka_unit_test(test_acquisitions_alone),
        cmocka_unit_test(test_a_fold_keeps_the_lift),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
