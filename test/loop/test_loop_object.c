// test_loop_object.c: the loop as an object: ticks, listeners, commands, a world without a truth, failures.
#include <unistd.h>

#include "test_alloc.h"
#include "test_files.h"

#include "hidden_world.h"
#include "loop_rig.h"
#include "world/plain_world.h"

#include "loop/loop_state.h"
#include "omentum/record.h"
#include "omentum/retract.h"

// ---- ticks ------------------------------------------------------------------------------------------

// A loop made by hand is om_retract_run, also the second time on the same world and twin.
static void test_ticks_equal_a_run(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmRetractDef def = om_retract_default_def(&g.scene);
    OmRetractResult run;
    def.nworker = 1;
    assert_ok(om_retract_run(&def, NULL, &run));
    assert_int_equal(run.outcome, OM_RETRACT_EXPOSED);
    for (int k = 0; k < 2; ++k) {
        rig_start(&g);
        OmLoop* loop = make_loop(&g, NULL);
        double dt = g.scene.task.time_step;
        while (om_loop_phase(loop) != OM_LOOP_ENDED) {
            OmRetractResult early = {.naction = 77};
            assert_status(om_loop_take_result(loop, &early), OM_INVALID);  // changes nothing
            assert_true(early.naction == 0 && !early.action && !early.sample);
            assert_ok(om_loop_tick(loop));  // one step of the world each, whatever happens in it
            assert_near(om_loop_sample(loop).time, dt * om_loop_ntick(loop), 1e-9);
        }
        expect_same(&run, om_loop_result(loop));
        assert_status(om_loop_tick(loop), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "has ended"));
        assert_status(give(loop, OM_LOOP_ABORT), OM_INVALID);
        OmRetractResult taken;
        assert_ok(om_loop_take_result(loop, &taken));
        assert_int_equal(om_loop_result(loop)->naction, 0);
        om_loop_destroy(loop);
        expect_same(&run, &taken);
        om_retract_result_done(&taken);
    }
    om_retract_result_done(&run);
    rig_destroy(&g);
}

// ---- listeners --------------------------------------------------------------------------------------

typedef struct Count {
    int begin, tick, plan, action_begin, action_end, end;
    bool is_acting;
    double last_time;
    OmStatus answer;  // of on_tick at tick `at`
    int at;
    OmLoop* loop;  // null, or commanded at tick `at`
    OmLoopCommandKind kind;
} Count;

static OmStatus count_begin(void* ctx, const OmLoop* loop) {
    Count* c = ctx;
    assert_int_equal(om_loop_ntick(loop), 0);
    ++c->begin;
    return OM_OK;
}
static OmStatus count_tick(void* ctx, const OmLoop* loop, const OmRetractSample* now) {
    Count* c = ctx;
    assert_true(c->begin == 1 && c->end == 0);
    assert_int_equal(++c->tick, om_loop_ntick(loop));
    assert_true(now->time > c->last_time);
    c->last_time = now->time;
    if (c->tick != c->at) return OM_OK;
    if (c->loop) assert_ok(give(c->loop, c->kind));
    return c->answer;
}
static OmStatus count_plan(void* ctx, const OmLoop* loop, const OmSituation* situation,
                           const OmPlan* plan) {
    Count* c = ctx;
    assert_ptr_equal(plan, om_loop_plan(loop));
    assert_int_equal(situation->n, plan->n);
    assert_int_equal(om_loop_phase(loop), OM_LOOP_PLAN);
    assert_false(c->is_acting);
    ++c->plan;
    return OM_OK;
}
static OmStatus count_action_begin(void* ctx, const OmLoop* loop, const OmPlanAction* action) {
    Count* c = ctx;
    assert_ptr_equal(action, om_loop_action(loop));
    assert_int_equal(om_loop_phase(loop), OM_LOOP_ACT);
    assert_false(c->is_acting);
    c->is_acting = true;
    ++c->action_begin;
    return OM_OK;
}
static OmStatus count_action_end(void* ctx, const OmLoop* loop, const OmRetractAction* action) {
    Count* c = ctx;
    assert_true(c->is_acting && action->end >= action->begin);
    assert_int_equal(om_loop_action(loop)->verb, action->verb);
    c->is_acting = false;
    assert_int_equal(++c->action_end, om_loop_result(loop)->naction);
    return OM_OK;
}
static OmStatus count_end(void* ctx, const OmLoop* loop, const OmRetractResult* result) {
    Count* c = ctx;
    assert_int_equal(om_loop_phase(loop), OM_LOOP_ENDED);
    assert_true(result->reason[0] && result->hash != 0);
    OmRetractResult early;
    if (c->loop) assert_status(om_loop_take_result(c->loop, &early), OM_INVALID);
    ++c->end;
    return OM_OK;
}
static OmLoopListener counter(Count* c) {
    return (OmLoopListener){
        c, count_begin, count_tick, count_plan, count_action_begin, count_action_end, count_end};
}

static void test_a_listener_counts(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    Count c[2] = {{0}, {0}};
    OmLoopListener listener[3] = {counter(&c[0]), {.ctx = NULL}, counter(&c[1])};
    OmLoopDef def = om_loop_default_def(&g.scene.task, g.world, g.twin, g.planner);
    def.listener = listener;
    def.nlistener = 3;
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    tick_to_end(loop);
    const OmRetractResult* r = om_loop_result(loop);
    for (int k = 0; k < 2; ++k) {
        assert_true(c[k].begin == 1 && c[k].end == 1 && !c[k].is_acting);
        assert_int_equal(c[k].tick, om_loop_ntick(loop));
        assert_int_equal(c[k].plan, r->nplan);
        assert_int_equal(c[k].action_begin, r->naction);
        assert_int_equal(c[k].action_end, r->naction);
    }
    assert_true(r->naction > 2);
    om_loop_destroy(loop);
    // An error of a listener is the tick's, and the loop cannot be ticked again.
    rig_start(&g);
    Count bad = {.at = 7, .answer = OM_IO};
    OmLoopListener one = counter(&bad);
    loop = make_loop(&g, &one);
    for (int i = 1; i < 7; ++i) assert_ok(om_loop_tick(loop));
    assert_status(om_loop_tick(loop), OM_IO);
    assert_status(om_loop_tick(loop), OM_INVALID);
    assert_status(give(loop, OM_LOOP_ABORT), OM_INVALID);
    assert_int_equal(bad.end, 0);
    OmRetractResult part;  // of a loop that has failed
    assert_ok(om_loop_take_result(loop, &part));
    assert_int_equal(part.nsample, 2);
    om_retract_result_done(&part);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// ---- commands ---------------------------------------------------------------------------------------

// A pause of one second while an arm pulls: the arm stops, world and twin stay in time, and the operation ends as
// without it, later by the pause.
static void test_pause_and_resume(void** state) {
    (void)state;
    Rig g;
    OmScene scene = object_scene();
    scene.world.tool_noise = 0;
    rig_create(&g, scene);
    OmLoop* loop = make_loop(&g, NULL);
    tick_to_end(loop);
    OmRetractResult whole;
    assert_ok(om_loop_take_result(loop, &whole));
    om_loop_destroy(loop);
    for (int k = 0; k < 4; ++k) {  // in a reach, while the jaw closes, in a pull, and twice
        rig_start(&g);
        loop = make_loop(&g, NULL);
        const OmRetractAction* a = &whole.action[k < 3 ? k : 2];
        while (om_loop_sample(loop).time < 0.5 * (a->begin + a->end)) assert_ok(om_loop_tick(loop));
        OmObservation before = {0}, after = {0};
        assert_ok(om_world_observe(g.world, 0, &before));
        for (int repeat = 0; repeat < (k == 3 ? 2 : 1); ++repeat) {
            const int naction = om_loop_result(loop)->naction;
            const double begin = om_loop_sample(loop).time;
            assert_ok(give(loop, OM_LOOP_PAUSE));
            assert_ok(give(loop, OM_LOOP_PAUSE));  // already paused
            assert_true(om_loop_is_paused(loop));
            for (int i = 0; i < 50; ++i) assert_ok(om_loop_tick(loop));
            assert_near(om_loop_sample(loop).time - begin, 1.0, 1e-9);
            assert_ok(om_world_observe(g.world, 0, &after));
            assert_near(om_distance(before.arm[0].tip.p, after.arm[0].tip.p), 0, 1e-12);
            assert_false(after.arm[0].is_moving);
            assert_int_equal(om_loop_result(loop)->naction, naction);
            assert_ok(give(loop, OM_LOOP_RESUME));
            assert_false(om_loop_is_paused(loop));
        }
        om_observation_done(&before);
        om_observation_done(&after);
        tick_to_end(loop);
        const OmRetractResult* r = om_loop_result(loop);
        assert_int_equal(r->outcome, OM_RETRACT_EXPOSED);
        assert_int_equal(r->naction, whole.naction);
        for (int i = 0; i < r->naction; ++i) {
            assert_int_equal(r->action[i].verb, whole.action[i].verb);
            assert_int_equal(r->action[i].block, whole.action[i].block);
        }
        assert_near(r->time - whole.time, k == 3 ? 2.0 : 1.0, 0.25);
        om_loop_destroy(loop);
    }
    om_retract_result_done(&whole);
    rig_destroy(&g);
}

// A pause while the endoscope looks: the look begins again.
static void test_pause_in_a_look(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop = make_loop(&g, NULL);
    while (om_loop_phase(loop) != OM_LOOP_VERIFY) assert_ok(om_loop_tick(loop));
    for (int i = 0; i < 10; ++i) assert_ok(om_loop_tick(loop));
    assert_int_equal(om_loop_phase(loop), OM_LOOP_VERIFY);
    assert_ok(give(loop, OM_LOOP_PAUSE));
    for (int i = 0; i < 100; ++i) assert_ok(om_loop_tick(loop));
    assert_int_equal(om_loop_phase(loop), OM_LOOP_VERIFY);  // no look lasts longer than 1.5 s else
    assert_ok(give(loop, OM_LOOP_RESUME));
    const double begin = om_loop_sample(loop).time;
    tick_to_end(loop);
    assert_true(om_loop_result(loop)->is_exposed);
    assert_near(om_loop_result(loop)->time - begin, 0.5, 0.021);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// A pause while an arm moves back after a force stop: the arm moves back afterwards until the force is below the limit.
static void test_pause_after_a_force_stop(void** state) {
    (void)state;
    Rig g;
    OmScene scene = object_scene();
    scene.task.force_threshold = 0.06;
    scene.task.visibility = 1.0;
    rig_create(&g, scene);
    OmLoop* loop = make_loop(&g, NULL);
    while (loop->stage != STAGE_ACTION || loop->act.action.nwait > 0 || !loop->act.motion.is_easing)
        assert_ok(om_loop_tick(loop));
    const int naction = om_loop_result(loop)->naction;
    const double height = om_loop_sample(loop).height;
    assert_ok(give(loop, OM_LOOP_PAUSE));
    for (int i = 0; i < 10; ++i) assert_ok(om_loop_tick(loop));
    assert_true(om_loop_force(loop, loop->act.motion.arm) > 0.9 * 0.06);  // not done yet
    assert_ok(give(loop, OM_LOOP_RESUME));
    const double begin = om_loop_sample(loop).time;
    while (om_loop_result(loop)->naction == naction) assert_ok(om_loop_tick(loop));
    const OmRetractAction* a = &om_loop_result(loop)->action[naction];
    assert_int_equal(a->outcome, OM_ACTION_FORCE);
    assert_true(a->end - begin < 2 && om_loop_sample(loop).force <= 0.9 * 0.06);
    assert_true(om_loop_sample(loop).height < height);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// A pause above the force limit: the time above the limit does not count, and the motion continues afterwards.
static void test_pause_above_the_force_limit(void** state) {
    (void)state;
    Rig g;
    OmScene scene = object_scene();
    scene.task.force_threshold = 0.08;
    scene.task.visibility = 1.0;
    rig_create(&g, scene);
    OmLoop* loop = make_loop(&g, NULL);
    while (!loop->act.is_over || !loop->act.motion.is_holding || loop->act.over_time == 0)
        assert_ok(om_loop_tick(loop));
    const double over_time = loop->act.over_time;
    assert_false(loop->act.motion.is_easing);
    assert_ok(give(loop, OM_LOOP_PAUSE));
    int nover = 0;
    for (int i = 0; i < 50; ++i) {
        assert_ok(om_loop_tick(loop));
        nover += loop->act.is_over;
    }
    assert_true(nover > 0);  // tissue at rest pulls less: the force falls below the limit
    assert_near(loop->act.over_time, over_time, 0);
    assert_ok(give(loop, OM_LOOP_RESUME));
    while (!loop->act.is_over) assert_ok(om_loop_tick(loop));
    assert_near(loop->act.over_time, over_time + scene.task.time_step, 1e-12);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// Whenever the loop is aborted: the arms stop in the same instant, no jaw opens, and the record is that of the whole
// run up to there.
static void test_abort_at_any_tick(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    HiddenWorld hidden = hidden_world(g.world, OM_OBSERVE_VISIBILITY);
    OmLoopDef def = om_loop_default_def(&g.scene.task, &hidden.head, g.twin, g.planner);
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    tick_to_end(loop);
    const int ntick = om_loop_ntick(loop);
    OmRetractResult whole;
    assert_ok(om_loop_take_result(loop, &whole));
    om_loop_destroy(loop);
    for (int at = 0; at < ntick; at += at < 5 ? 1 : 23) {
        rig_start(&g);
        hidden.nopen = 0;
        Count c = {0};
        OmLoopListener listener = counter(&c);
        def.listener = &listener;
        def.nlistener = 1;
        assert_ok(om_loop_create(&def, &loop));
        for (int i = 0; i < at; ++i) assert_ok(om_loop_tick(loop));
        const int nopen = hidden.nopen, nfull = om_loop_result(loop)->naction;
        const bool is_acting = om_loop_phase(loop) == OM_LOOP_ACT;
        assert_ok(give(loop, at % 2 ? OM_LOOP_ABORT : OM_LOOP_CANCEL));
        const OmRetractResult* r = om_loop_result(loop);
        assert_int_equal(om_loop_phase(loop), OM_LOOP_ENDED);
        assert_int_equal(r->outcome, at % 2 ? OM_RETRACT_ABORTED : OM_RETRACT_CANCELLED);
        assert_non_null(strstr(r->reason, at % 2 ? "aborted after" : "cancelled after"));
        assert_int_equal(om_loop_ntick(loop), at);
        assert_int_equal(hidden.nopen, nopen);
        assert_int_equal(r->naction, nfull + is_acting);
        assert_true(c.begin == 1 && c.end == 1);
        if (is_acting) assert_int_equal(r->action[nfull].outcome, OM_ACTION_ABORTED);
        for (int i = 0; i < nfull; ++i) assert_near(r->action[i].end, whole.action[i].end, 0);
        for (int i = 0; i < r->nsample; ++i)
            assert_near(r->sample[i].force, whole.sample[i].force, 0);
        OmObservation seen = {0};
        assert_ok(om_world_observe(g.world, 0, &seen));
        for (int a = 0; a < 2; ++a) assert_false(seen.arm[a].is_moving);
        om_observation_done(&seen);
        om_loop_destroy(loop);
    }
    om_retract_result_done(&whole);
    rig_destroy(&g);
}

// A listener commands the loop: the command takes effect when the tick has ended.
static void test_commands_of_a_listener(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    Count c = {.at = 20, .kind = OM_LOOP_ABORT};
    OmLoopListener listener = counter(&c);
    OmLoop* loop = make_loop(&g, &listener);
    c.loop = loop;
    tick_to_end(loop);
    assert_int_equal(om_loop_result(loop)->outcome, OM_RETRACT_ABORTED);
    assert_int_equal(om_loop_ntick(loop), 20);
    assert_int_equal(c.end, 1);
    om_loop_destroy(loop);
    // In any phase it can be destroyed instead.
    for (int at = 0; at < 200; at += 40) {
        rig_start(&g);
        loop = make_loop(&g, NULL);
        for (int i = 0; i < at; ++i) assert_ok(om_loop_tick(loop));
        om_loop_destroy(loop);
    }
    om_loop_destroy(NULL);
    rig_destroy(&g);
}

// ---- a world without a truth ------------------------------------------------------------------------

static void expect_file(const char* dir, const char* name, bool is_there) {
    char path[256];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    assert_true(om_path_exists(path) == is_there);
}

// The same arms and pictures, but the tissue's true state is unknown: the same actions, and a record that says so.
static void test_a_world_without_a_truth(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop = make_loop(&g, NULL);
    tick_to_end(loop);
    OmRetractResult known;
    assert_ok(om_loop_take_result(loop, &known));
    om_loop_destroy(loop);
    char dir[] = "/tmp/om_object_XXXXXX", out[64];
    assert_non_null(mkdtemp(dir));
    for (int has_image = 0; has_image < 2; ++has_image) {
        rig_start(&g);
        HiddenWorld hidden =
            hidden_world(g.world, OM_OBSERVE_WINDOW | (has_image ? OM_OBSERVE_IMAGE : 0u));
        assert_null(om_world_truth(&hidden.head));
        snprintf(out, sizeof out, "%s/run%d", dir, has_image);
        OmRecorderDef rec = om_recorder_default_def(out, &g.scene, &hidden.head, g.twin, g.planner);
        OmRecorder* recorder;
        assert_ok(om_recorder_create(&rec, &recorder));
        OmLoopListener listener = om_recorder_listener(recorder);
        OmLoopDef def = om_loop_default_def(&g.scene.task, &hidden.head, g.twin, g.planner);
        def.listener = &listener;
        def.nlistener = 1;
        assert_ok(om_loop_create(&def, &loop));
        tick_to_end(loop);
        const OmRetractResult* r = om_loop_result(loop);
        assert_true(r->is_exposed && isnan(r->truth.force) && isnan(r->truth.shift));
        assert_true(isnan(r->truth.more) && isnan(r->truth.less) &&
                    isnan(r->sample[3].force_world) && isnan(r->sample[3].visibility_world));
        assert_true(r->truth.nvert == 0 && r->truth.nbad == 0 && r->truth.nforce == 0);
        assert_true(r->hash == om_body_hash(g.twin));
        assert_int_equal(r->naction, known.naction);
        for (int i = 0; i < r->naction; ++i) {
            assert_near(r->action[i].end, known.action[i].end, 0);
            assert_near(r->action[i].force_max, known.action[i].force_max, 0);
            assert_true(isnan(r->action[i].force_world_max));
        }
        expect_file(om_recorder_place(recorder), "report.html", true);
        expect_file(out, "run.vtkhdf", true);
        expect_file(out, "frames/000.png", has_image);
        char *text, path[128];
        size_t size;
        snprintf(path, sizeof path, "%s/run.json", out);
        assert_ok(om_file_read(path, 1 << 22, &text, &size));
        assert_non_null(strstr(text, "\"force_world_max_n\": null"));
        assert_non_null(strstr(text, "\"world_shift_at_start_m\": null"));
        om_free(text);
        om_recorder_destroy(recorder);
        om_loop_destroy(loop);
    }
    assert_ok(om_path_remove(dir));
    om_retract_result_done(&known);
    rig_destroy(&g);
}

// An arm that a joint keeps 25 mm above its grasp, where the task allows more: a pull that is not possible is not
// tried again with the same grasp; a fold follows.
static void test_a_pull_out_of_reach_is_not_repeated(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    HiddenWorld hidden = hidden_world(g.world, OM_OBSERVE_VISIBILITY);
    hidden.max_rise = 0.025;
    OmLoopDef def = om_loop_default_def(&g.scene.task, &hidden.head, g.twin, g.planner);
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    tick_to_end(loop);
    const OmRetractResult* r = om_loop_result(loop);
    int nforbidden = 0, nfold = 0;
    for (int i = 0; i < r->naction; ++i) {
        const OmRetractAction* a = &r->action[i];
        if (a->verb != OM_PLAN_PULL || a->outcome != OM_ACTION_UNREACHED) continue;
        ++nforbidden;
        if (i + 1 == r->naction) continue;
        assert_int_not_equal(a[1].verb, OM_PLAN_PULL);
        nfold += a[1].verb == OM_PLAN_MOVE_ROI || a[1].verb == OM_PLAN_MOVE_AWAY;
    }
    assert_true(nforbidden > 0 && nfold > 0);
    assert_int_not_equal(r->outcome, OM_RETRACT_GAVE_UP);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// The ROI closes while the arms keep still: the same action continues, and no new plan is made.
static void test_an_action_is_continued(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    HiddenWorld hidden = hidden_world(g.world, OM_OBSERVE_VISIBILITY);
    hidden.nblink = 2;
    Count c = {0};
    OmLoopListener listener = counter(&c);
    OmLoopDef def = om_loop_default_def(&g.scene.task, &hidden.head, g.twin, g.planner);
    def.listener = &listener;
    def.nlistener = 1;
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    tick_to_end(loop);
    const OmRetractResult* r = om_loop_result(loop);
    assert_true(r->is_exposed);
    int ncontinued = 0;
    for (int i = 1; i < r->naction; ++i) {
        const OmRetractAction *a = &r->action[i], *last = &r->action[i - 1];
        if (last->outcome != OM_ACTION_EXPOSED) continue;
        ++ncontinued;
        assert_true(a->verb == last->verb && a->block == last->block && a->plan == last->plan);
        assert_false(a->is_replanned);
        assert_near(a->begin - last->end, 1.5, 0.021);  // the longest verification
    }
    assert_int_equal(ncontinued, 2);
    assert_int_equal(hidden.nblink, 0);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// Tick a loop on a world from rest to its end. The caller frees the result.
static OmRetractResult run_world(Rig* g, HiddenWorld* hidden) {
    rig_start(g);
    OmLoopDef def = om_loop_default_def(&g->scene.task, &hidden->head, g->twin, g->planner);
    def.max_age = 0;  // old pictures are what is tested
    OmLoop* loop;
    OmRetractResult result;
    assert_ok(om_loop_create(&def, &loop));
    tick_to_end(loop);
    assert_ok(om_loop_take_result(loop, &result));
    om_loop_destroy(loop);
    return result;
}

// The clock of a world starts anywhere: times of the operation count from its begin. Pictures that come late delay the
// end of each look by their age, and an endoscope that repeats one picture never shows that the ROI stays visible.
static void test_clocks_of_a_world(void** state) {
    (void)state;
    Rig g;
    OmScene scene = object_scene();
    scene.task.max_actions = 12;
    scene.task.time_step = 1.0 / 64;  // all times are exact: both clocks decide the same
    rig_create(&g, scene);
    HiddenWorld hidden = hidden_world(g.world, OM_OBSERVE_VISIBILITY);
    OmRetractResult whole = run_world(&g, &hidden);
    assert_true(whole.is_exposed);
    const double last = whole.action[whole.naction - 1].end;

    hidden.clock = 1e6;
    OmRetractResult r = run_world(&g, &hidden);
    assert_true(r.hash == whole.hash);
    assert_string_equal(r.reason, whole.reason);
    assert_near(r.time, whole.time, 0);
    assert_int_equal(r.naction, whole.naction);
    for (int i = 0; i < r.naction; ++i) {
        assert_near(r.action[i].begin, whole.action[i].begin, 0);
        assert_near(r.action[i].end, whole.action[i].end, 0);
    }
    assert_int_equal(r.nsample, whole.nsample);
    for (int i = 0; i < r.nsample; ++i) assert_near(r.sample[i].time, whole.sample[i].time, 0);
    om_retract_result_done(&r);

    hidden.delay = 0.25;
    r = run_world(&g, &hidden);
    assert_true(r.is_exposed);
    assert_near(r.action[r.naction - 1].end, last, 0);
    assert_near(r.time - whole.time, 0.25, 0);
    om_retract_result_done(&r);

    hidden.delay = 0;
    hidden.is_frozen = true;
    r = run_world(&g, &hidden);
    assert_false(r.is_exposed);
    assert_true(hidden.frozen_visibility >= 0.85 && r.visibility_end >= 0.85);
    assert_int_equal(r.outcome, OM_RETRACT_GAVE_UP);
    om_retract_result_done(&r);
    om_retract_result_done(&whole);
    rig_destroy(&g);
}

// Another kind of world, in closed form, with one arm or two: the ROI shows once held tissue has moved by more than
// 10 mm, in proportion, and all of it at 40 mm. This world has no reset. The ROI lies on the side of PSM2, which the
// planner chooses if there is one.
static void test_a_world_in_closed_form(void** state) {
    (void)state;
    Rig g;
    OmScene scene = object_scene();
    scene.roi.center.y = 0.03;
    rig_create(&g, scene);
    for (int narm = 1; narm <= 2; ++narm) {
        om_body_restore(g.twin, g.rest);
        PlainWorld plain;
        plain_world_init(&plain, &g.world_site, narm);
        OmLoopDef def = om_loop_default_def(&g.scene.task, &plain.head, g.twin, g.planner);
        OmLoop* loop;
        assert_ok(om_loop_create(&def, &loop));
        assert_status(om_world_reset(&plain.head), OM_UNAVAILABLE);
        tick_to_end(loop);
        const OmRetractResult* r = om_loop_result(loop);
        assert_int_equal(r->outcome, OM_RETRACT_EXPOSED);
        assert_true(r->visibility_start == 0 && isnan(r->truth.force));
        assert_true(plain.arm[narm - 1].is_holding && r->twin.force > 0.01);
        // Exposed from 80 % on, stopped at 85 %: 34 mm and 35.5 mm, and up to a look of 5 ticks later.
        double moved = om_distance(plain.arm[narm - 1].tip.p, plain.arm[narm - 1].grasp);
        assert_true(moved >= 0.034 && moved <= 0.0355 + 6 * 0.02 * g.scene.task.speed);
        assert_near(r->visibility_end, (moved - 0.01) / 0.03, 1e-9);
        for (int i = 0; i < r->naction; ++i) assert_int_equal(r->action[i].arm, narm - 1);
        om_loop_destroy(loop);
    }
    rig_destroy(&g);
}

// A robot that does not answer ends the loop with its error; nothing is written.
static void test_a_failing_world(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    HiddenWorld hidden = hidden_world(g.world, OM_OBSERVE_VISIBILITY);
    hidden.fail_at = 30;
    char dir[] = "/tmp/om_object_XXXXXX", out[64];
    assert_non_null(mkdtemp(dir));
    snprintf(out, sizeof out, "%s/run", dir);
    OmRecorderDef rec = om_recorder_default_def(out, &g.scene, &hidden.head, g.twin, g.planner);
    OmRecorder* recorder;
    assert_ok(om_recorder_create(&rec, &recorder));
    OmLoopListener listener = om_recorder_listener(recorder);
    OmLoopDef def = om_loop_default_def(&g.scene.task, &hidden.head, g.twin, g.planner);
    def.listener = &listener;
    def.nlistener = 1;
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    OmStatus status = OM_OK;
    while (status == OM_OK) status = om_loop_tick(loop);
    assert_status(status, OM_IO);
    assert_non_null(strstr(om_error_message(), "the robot does not answer"));
    assert_int_equal(om_loop_ntick(loop), 29);
    assert_status(om_loop_tick(loop), OM_INVALID);
    om_loop_destroy(loop);
    om_recorder_destroy(recorder);
    assert_int_equal(rmdir(dir), 0);  // no folder, no temporary one
    rig_destroy(&g);
}

// ---- definitions and memory ---------------------------------------------------------------------------

static void test_wrong_definitions(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop;
    OmLoopDef good = om_loop_default_def(&g.scene.task, g.world, g.twin, g.planner), def = good;
    OmSceneTask task = g.scene.task;
    def.cookie = 0;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    assert_null(loop);
    def = good, def.world = NULL;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    def = good, def.twin = NULL;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    def = good, def.planner = NULL;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    def = good, def.nlistener = 1;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    def = good, def.nlistener = OM_LOOP_MAX_LISTENER + 1;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    def = good, def.task = &task;
    task.time_step = 0;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "time_step"));
    task = g.scene.task, task.force_margin = task.force_threshold;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    HiddenWorld blind = hidden_world(g.world, 0);
    def = good, def.world = &blind.head;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "visibility"));
    OmRecorder* recorder;
    OmRecorderDef rec = om_recorder_default_def(NULL, &g.scene, g.world, g.twin, g.planner);
    assert_status(om_recorder_create(&rec, &recorder), OM_INVALID);
    loop = make_loop(&g, NULL);
    assert_status(give(loop, (OmLoopCommandKind)77), OM_INVALID);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

typedef struct Small {
    Rig* rig;
    const char* out;
} Small;

// Loop and recorder from creation to an abort in the first action.
static OmStatus run_small(void* ctx) {
    const Small* s = ctx;
    Rig* g = s->rig;
    om_body_restore(g->twin, g->rest);
    OmStatus status = om_world_reset(g->world);
    OmLoop* loop = NULL;
    OmRecorder* recorder = NULL;
    OmRecorderDef rec = om_recorder_default_def(s->out, &g->scene, g->world, g->twin, g->planner);
    rec.truth = om_world_truth(g->world);
    if (status >= 0) status = om_recorder_create(&rec, &recorder);
    if (status >= 0) {
        OmLoopListener listener = om_recorder_listener(recorder);
        OmLoopDef def = om_loop_default_def(&g->scene.task, g->world, g->twin, g->planner);
        def.truth = rec.truth;
        def.listener = &listener;
        def.nlistener = 1;
        status = om_loop_create(&def, &loop);
    }
    for (int i = 0; i < 3 && status >= 0; ++i) status = om_loop_tick(loop);
    if (status >= 0) status = give(loop, OM_LOOP_ABORT);
    om_loop_destroy(loop);
    om_recorder_destroy(recorder);
    return status;
}

static void test_every_allocation_may_fail(void** state) {
    (void)state;
    Rig g;
    const int64_t alive = om_alloc_alive();
    OmScene scene = object_scene();
    scene.task.grid = 2;
    scene.endoscope.width = 32, scene.endoscope.height = 24;
    rig_create(&g, scene);
    char dir[] = "/tmp/om_object_XXXXXX", out[64];
    assert_non_null(mkdtemp(dir));
    snprintf(out, sizeof out, "%s/run", dir);
    Small small = {&g, out};
    // World, twin and planner keep some of what they allocate: leaks show when they are gone.
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    int nfail = 0;
    for (int at = 0; at < 1000000; at += 7, ++nfail) {
        om_allocator_set(&failing);
        test_alloc_countdown = at;
        OmStatus status = run_small(&small);
        om_allocator_set(NULL);
        if (status >= 0) break;
        if (status != OM_NO_MEMORY) fail_msg("allocation %d: %s", at, om_error_message());
        assert_false(om_path_exists(out));
    }
    assert_true(nfail > 5);
    assert_ok(om_path_remove(dir));
    rig_destroy(&g);
    assert_int_equal(om_alloc_alive(), alive);
}

// With both arms allowed the second arm grasps while the first one holds; without, the first lets go before.
static void test_both_arms(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.max_height = scene.task.retract = 0.01;
    scene.task.visibility = 0.99;
    scene.task.max_actions = 14;
    for (int both = 0; both < 2; ++both) {
        Rig g;
        rig_create(&g, scene);
        OmPlannerDef def = om_planner_default_def();
        def.max_lift = 1;
        def.has_both_arms = both;
        om_planner_destroy(g.planner);
        assert_ok(om_planner_create(&def, &g.planner));
        OmLoop* loop = make_loop(&g, NULL);
        for (int b = 0; b < 25; ++b)
            if (b != 12 && b != 20)
                assert_ok(om_loop_command(loop, &(OmLoopCommand){OM_LOOP_FORBID, .block = b}));
        bool has_held_both = false;
        while (om_loop_phase(loop) != OM_LOOP_ENDED) {
            assert_ok(om_loop_tick(loop));
            has_held_both |= om_body_is_holding(g.twin, 0) && om_body_is_holding(g.twin, 1);
        }
        const OmRetractResult* r = om_loop_result(loop);
        int second = -1, released = -1;
        for (int k = 0; k < r->naction; ++k) {
            if (second < 0 && r->action[k].verb == OM_PLAN_GRASP && r->action[k].arm == 1)
                second = k;
            if (released < 0 && r->action[k].verb == OM_PLAN_RELEASE) released = k;
        }
        assert_true(second > 0);
        assert_int_equal(has_held_both, both);
        assert_int_equal(released < 0 || released > second, both);
        om_loop_destroy(loop);
        rig_destroy(&g);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_clocks_of_a_world),
        cmocka_unit_test(test_pause_and_resume),
        cmocka_unit_test(test_every_allocation_may_fail),
        cmocka_unit_test(test_abort_at_any_tick),
        cmocka_unit_test(test_ticks_equal_a_run),
        cmocka_unit_test(test_both_arms),
        cmocka_unit_test(test_pause_after_a_force_stop),
        cmocka_unit_test(test_pause_in_a_look),
        cmocka_unit_test(test_commands_of_a_listener),
        cmocka_unit_test(test_an_action_is_continued),
        cmocka_unit_test(test_a_world_without_a_truth),
        cmocka_unit_test(test_wrong_definitions),
        cmocka_unit_test(test_a_failing_world),
        cmocka_unit_test(test_a_pull_out_of_reach_is_not_repeated),
        cmocka_unit_test(test_a_listener_counts),
        cmocka_unit_test(test_pause_above_the_force_limit),
        cmocka_unit_test(test_a_world_in_closed_form),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
