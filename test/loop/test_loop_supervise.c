// Commands of a person, and faults that end in a hold.
#include <math.h>
#include <string.h>

#include "hidden_world.h"
#include "loop_rig.h"

// ---- faults -------------------------------------------------------------------------------------------------

// A world with one fault from a time on.
typedef enum Fault {
    FAULT_NONE,
    FAULT_CLOCK,
    FAULT_PICTURE,
    FAULT_ARM_OLD,
    FAULT_ARM_NAN,
    FAULT_STUCK
} Fault;

typedef struct FaultyWorld {
    HiddenWorld hidden;
    Fault fault;
    double from;  // s of the inner world
    double frozen_time;
    OmPose stuck;
    bool is_stuck;
} FaultyWorld;

static OmStatus faulty_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    FaultyWorld* w = (FaultyWorld*)world;
    OM_TRY(om_world_observe(w->hidden.inner, what, obs));
    if (obs->time < w->from) {
        w->frozen_time = obs->time;
        w->stuck = obs->arm[0].tip;
        return OM_OK;
    }
    switch (w->fault) {
    case FAULT_CLOCK: obs->time = w->frozen_time; break;
    case FAULT_PICTURE: obs->endoscope.time = w->frozen_time; break;
    case FAULT_ARM_OLD: obs->arm[0].time = w->frozen_time; break;
    case FAULT_ARM_NAN: obs->arm[0].tip.p.x = NAN; break;
    case FAULT_STUCK: obs->arm[0].tip = w->stuck, obs->arm[0].is_moving = true; break;
    case FAULT_NONE: break;
    }
    return OM_OK;
}

static OmWorldOps faulty_ops;

static FaultyWorld faulty_world(OmWorld* inner, Fault fault, double from) {
    faulty_ops = hidden_ops;
    faulty_ops.observe = faulty_observe;
    FaultyWorld w = {
        .hidden = hidden_world(inner, OM_OBSERVE_VISIBILITY), .fault = fault, .from = from};
    w.hidden.head.ops = &faulty_ops;
    return w;
}

// What a listener saw of holds.
typedef struct Told {
    int nhold;
    OmHold hold;
    char reason[256];
} Told;

static OmStatus on_hold(void* ctx, const OmLoop* loop, OmHold hold, const char* reason) {
    Told* t = ctx;
    assert_int_equal(om_loop_phase(loop), OM_LOOP_HOLD);
    assert_int_equal(om_loop_hold(loop), hold);
    ++t->nhold;
    t->hold = hold;
    snprintf(t->reason, sizeof t->reason, "%s", reason);
    return OM_OK;
}

static OmLoop* make_faulty(Rig* g, FaultyWorld* w, OmLoopListener* listener, bool is_attended) {
    rig_start(g);
    OmLoopDef def = om_loop_default_def(&g->scene.task, &w->hidden.head, g->twin, g->planner);
    def.listener = listener;
    def.nlistener = 1;
    def.is_attended = is_attended;
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    return loop;
}

// Each fault ends in a hold within 0.3 s of its begin, an arm that is stuck once its command is 15 mm ahead. The arms
// are stopped, and listeners hear the reason once.
static void test_faults_end_in_a_hold(void** state) {
    (void)state;
    static const struct {
        Fault fault;
        OmHold hold;
        const char* word;
        double within;  // s
    } want[] = {{FAULT_CLOCK, OM_HOLD_STALE, "clock stands still", 0.25},
                {FAULT_PICTURE, OM_HOLD_STALE, "picture is 0.", 0.35},
                {FAULT_ARM_OLD, OM_HOLD_TOOL, "PSM1 was last measured", 0.25},
                {FAULT_ARM_NAN, OM_HOLD_TOOL, "not measured", 0.05},
                {FAULT_STUCK, OM_HOLD_ARM, "does not follow", 1.5}};
    Rig g;
    rig_create(&g, object_scene());
    for (size_t i = 0; i < sizeof want / sizeof *want; ++i) {
        FaultyWorld w = faulty_world(g.world, want[i].fault, 1.0);
        Told told = {0};
        OmLoopListener listener = {.ctx = &told, .on_hold = on_hold};
        OmLoop* loop = make_faulty(&g, &w, &listener, false);
        tick_to_end(loop);
        const OmRetractResult* r = om_loop_result(loop);
        assert_int_equal(r->outcome, OM_RETRACT_HELD);
        assert_int_equal(r->hold, want[i].hold);
        assert_int_equal(r->nhold, 1);
        assert_int_equal(told.nhold, 1);
        assert_int_equal(told.hold, want[i].hold);
        assert_non_null(strstr(told.reason, want[i].word));
        assert_non_null(strstr(r->reason, want[i].word));
        assert_false(r->is_exposed);
        assert_int_equal(r->action[r->naction - 1].outcome, OM_ACTION_HELD);
        assert_true(w.hidden.nstop >= 1);
        const double lasted = g.scene.task.time_step * om_loop_ntick(loop) - 1.0;
        printf("%s: held after %.2f s: %s\n", om_hold_text(r->hold), lasted, told.reason);
        assert_true(lasted > -1e-9 && lasted < want[i].within);
        om_loop_destroy(loop);
    }
    rig_destroy(&g);
}

// A planner out of its budget: held at the first plan, the arms have not moved.
static void test_a_planner_out_of_budget_holds(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmPlanner* enough = g.planner;
    OmPlannerDef def = om_planner_default_def();
    def.conflict_limit = 1;
    assert_ok(om_planner_create(&def, &g.planner));
    FaultyWorld w = faulty_world(g.world, FAULT_NONE, 0);
    Told told = {0};
    OmLoopListener listener = {.ctx = &told, .on_hold = on_hold};
    OmLoop* loop = make_faulty(&g, &w, &listener, false);
    tick_to_end(loop);
    const OmRetractResult* r = om_loop_result(loop);
    assert_int_equal(r->outcome, OM_RETRACT_HELD);
    assert_int_equal(r->hold, OM_HOLD_PLANNER);
    assert_int_equal(told.nhold, 1);
    assert_non_null(strstr(told.reason, "budget"));
    assert_int_equal(r->naction, 0);
    om_loop_destroy(loop);
    om_planner_destroy(g.planner);
    g.planner = enough;
    rig_destroy(&g);
}

// With a person the loop waits; at a command, once the fault is gone, it continues and succeeds.
static void test_a_person_goes_on(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    for (double from = 0.5; from < 4.3; from += 0.6) {
        FaultyWorld w = faulty_world(g.world, FAULT_ARM_OLD, from);
        Told told = {0};
        OmLoopListener listener = {.ctx = &told, .on_hold = on_hold};
        OmLoop* loop = make_faulty(&g, &w, &listener, true);
        while (told.nhold == 0 && om_loop_phase(loop) != OM_LOOP_ENDED)
            assert_ok(om_loop_tick(loop));
        if (om_loop_phase(loop) != OM_LOOP_ENDED) {
            const int naction = om_loop_result(loop)->naction;
            for (int i = 0; i < 20; ++i) assert_ok(om_loop_tick(loop));
            assert_int_equal(om_loop_phase(loop), OM_LOOP_HOLD);
            assert_int_equal(om_loop_result(loop)->naction, naction);
            w.fault = FAULT_NONE;
            assert_ok(give(loop, OM_LOOP_RESUME));
            assert_int_equal(om_loop_hold(loop), OM_HOLD_NONE);
            tick_to_end(loop);
        }
        printf("from %.1f s: %d holds, %s\n", from, told.nhold, om_loop_result(loop)->reason);
        assert_int_equal(told.nhold, 1);
        assert_int_equal(om_loop_result(loop)->outcome, OM_RETRACT_EXPOSED);
        om_loop_destroy(loop);
    }
    rig_destroy(&g);
}

// ---- commands -------------------------------------------------------------------------------------------------

static OmLoop* make_attended(Rig* g, bool needs_approval) {
    rig_start(g);
    OmLoopDef def = om_loop_default_def(&g->scene.task, g->world, g->twin, g->planner);
    def.is_attended = true;
    def.needs_approval = needs_approval;
    OmLoop* loop;
    assert_ok(om_loop_create(&def, &loop));
    return loop;
}

static OmStatus command(OmLoop* loop, OmLoopCommandKind kind, int block, double value) {
    return om_loop_command(loop, &(OmLoopCommand){kind, block, value});
}

static void tick_until(OmLoop* loop, OmLoopPhase phase) {
    for (int i = 0; om_loop_phase(loop) != phase && i < 5000; ++i) assert_ok(om_loop_tick(loop));
    assert_int_equal(om_loop_phase(loop), phase);
}

// A plan waits for consent; a rejected plan's point is not proposed again; one that is allowed again is.
static void test_plans_need_consent(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop = make_attended(&g, true);
    assert_status(give(loop, OM_LOOP_APPROVE), OM_INVALID);
    tick_until(loop, OM_LOOP_CONSENT);
    const int first = om_loop_plan(loop)->grasp_block;
    for (int i = 0; i < 30; ++i) assert_ok(om_loop_tick(loop));
    assert_int_equal(om_loop_phase(loop), OM_LOOP_CONSENT);
    assert_int_equal(om_loop_result(loop)->naction, 0);
    assert_ok(give(loop, OM_LOOP_REJECT));
    assert_ok(om_loop_tick(loop));
    assert_int_equal(om_loop_phase(loop), OM_LOOP_CONSENT);
    const int second = om_loop_plan(loop)->grasp_block;
    assert_true(second >= 0 && second != first);
    assert_ok(command(loop, OM_LOOP_ALLOW, first, 0));
    assert_ok(give(loop, OM_LOOP_REPLAN));
    assert_ok(om_loop_tick(loop));
    assert_int_equal(om_loop_plan(loop)->grasp_block, first);
    assert_ok(give(loop, OM_LOOP_APPROVE));
    tick_until(loop, OM_LOOP_ACT);
    assert_int_equal(om_loop_action(loop)->block, first);
    assert_ok(give(loop, OM_LOOP_ABORT));
    assert_int_equal(om_loop_result(loop)->ncommand, 4);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// A block forbidden while the arm reaches for it is given up at once; one that is held may be lifted further.
static void test_a_forbidden_block(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop = make_attended(&g, false);
    tick_until(loop, OM_LOOP_ACT);
    const int first = om_loop_action(loop)->block;
    assert_ok(om_loop_tick(loop));
    assert_ok(command(loop, OM_LOOP_FORBID, first, 0));
    assert_int_equal(om_loop_result(loop)->naction, 1);
    assert_int_equal(om_loop_result(loop)->action[0].outcome, OM_ACTION_REPLANNED);
    tick_to_end(loop);
    const OmRetractResult* r = om_loop_result(loop);
    for (int i = 1; i < r->naction; ++i) assert_int_not_equal(r->action[i].block, first);
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// At half the speed a reach takes about twice the time, less the parts that do not depend on it.
static void test_slow(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    double lasted[2];
    for (int k = 0; k < 2; ++k) {
        OmLoop* loop = make_attended(&g, false);
        if (k) assert_ok(command(loop, OM_LOOP_SLOW, -1, 0.5));
        while (om_loop_result(loop)->naction == 0) assert_ok(om_loop_tick(loop));
        const OmRetractAction* a = &om_loop_result(loop)->action[0];
        assert_int_equal(a->verb, OM_PLAN_REACH);
        lasted[k] = a->end - a->begin;
        om_loop_destroy(loop);
    }
    assert_near(lasted[1], 2 * lasted[0], 0.1);
    rig_destroy(&g);
}

// Attachments that a person marks reach the twin, which holds still there, and the planner, which avoids them.
static void test_marked_attachments(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop = make_attended(&g, false);
    tick_until(loop, OM_LOOP_ACT);
    const int block = om_loop_action(loop)->block;
    const OmMeshSet* under = om_tet_mesh_find_set(&g.twin_site.mesh, "underside");
    int before = 0, after = 0, freed = 0;
    for (int i = 0; i < under->nvert; ++i) before += om_body_attached(g.twin)[under->vert[i]];
    assert_ok(command(loop, OM_LOOP_ATTACH, block, 0));
    for (int i = 0; i < 60; ++i) assert_ok(om_loop_tick(loop));
    for (int i = 0; i < under->nvert; ++i) after += om_body_attached(g.twin)[under->vert[i]];
    assert_true(after > before);
    assert_int_equal(om_loop_result(loop)->action[0].outcome, OM_ACTION_REPLANNED);
    assert_int_not_equal(om_loop_plan(loop)->grasp_block, block);
    assert_ok(command(loop, OM_LOOP_FREE, block, 0));
    for (int i = 0; i < 60; ++i) assert_ok(om_loop_tick(loop));
    for (int i = 0; i < under->nvert; ++i) freed += om_body_attached(g.twin)[under->vert[i]];
    assert_int_equal(freed, before);
    assert_ok(give(loop, OM_LOOP_ABORT));
    om_loop_destroy(loop);
    rig_destroy(&g);
}

// A new plan may be demanded at any tick, also while a jaw closes: what is held is known afterwards, and the loop
// succeeds.
static void test_a_new_plan_at_any_tick(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    for (int at = 20; at < 400; at += 37) {
        OmLoop* loop = make_attended(&g, false);
        for (int i = 0; i < at && om_loop_phase(loop) != OM_LOOP_ENDED; ++i)
            assert_ok(om_loop_tick(loop));
        if (om_loop_phase(loop) == OM_LOOP_ENDED) {
            om_loop_destroy(loop);
            break;
        }
        assert_ok(give(loop, OM_LOOP_REPLAN));
        tick_to_end(loop);
        assert_int_equal(om_loop_result(loop)->outcome, OM_RETRACT_EXPOSED);
        om_loop_destroy(loop);
    }
    rig_destroy(&g);
}

// ---- words ----------------------------------------------------------------------------------------------------

static void test_words(void** state) {
    (void)state;
    OmLoopCommand c;
    assert_ok(om_loop_command_parse("  forbid 3 2 ", 5, &c));
    assert_true(c.kind == OM_LOOP_FORBID && c.block == 7);
    assert_ok(om_loop_command_parse("fo 1 1", 5, &c));
    assert_true(c.kind == OM_LOOP_FORBID && c.block == 0);
    assert_ok(om_loop_command_parse("slow 0.25", 5, &c));
    assert_true(c.kind == OM_LOOP_SLOW && c.value == 0.25);
    for (int k = 0; k < OM_LOOP_NCOMMAND; ++k) {
        char text[32];
        const bool has_block = k >= OM_LOOP_FORBID && k <= OM_LOOP_FREE;
        snprintf(text, sizeof text, "%s%s", om_loop_command_text((OmLoopCommandKind)k),
                 has_block           ? " 5 5"
                 : k == OM_LOOP_SLOW ? " 1"
                                     : "");
        assert_ok(om_loop_command_parse(text, 5, &c));
        assert_int_equal(c.kind, k);
    }
    static const char* const wrong[] = {
        "",       "a",        "f",        "forbid", "forbid 6 1", "forbid 1 0",   "slow",
        "slow 0", "slow 1.1", "slow nan", "go now", "forbid 1",   "forbid 1 1 1", "3",
        "halt"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i)
        assert_status(om_loop_command_parse(wrong[i], 5, &c), OM_INVALID);
    for (int h = OM_HOLD_NONE; h <= OM_HOLD_ARM; ++h) assert_true(om_hold_text((OmHold)h)[0]);
}

static void test_wrong_commands(void** state) {
    (void)state;
    Rig g;
    rig_create(&g, object_scene());
    OmLoop* loop = make_attended(&g, false);
    assert_status(command(loop, OM_LOOP_FORBID, -1, 0), OM_INVALID);
    assert_status(command(loop, OM_LOOP_ATTACH, 25, 0), OM_INVALID);
    assert_status(command(loop, OM_LOOP_SLOW, -1, 0), OM_INVALID);
    assert_status(command(loop, OM_LOOP_NCOMMAND, -1, 0), OM_INVALID);
    assert_ok(om_loop_tick(loop));  // the loop has not failed
    om_loop_destroy(loop);
    OmLoopDef def = om_loop_default_def(&g.scene.task, g.world, g.twin, g.planner);
    def.needs_approval = true;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    def.needs_approval = false;
    def.max_age = -1;
    assert_status(om_loop_create(&def, &loop), OM_INVALID);
    rig_destroy(&g);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slow),
        cmocka_unit_test(test_a_new_plan_at_any_tick),
        cmocka_unit_test(test_a_person_goes_on),
        cmocka_unit_test(test_a_forbidden_block),
        cmocka_unit_test(test_a_planner_out_of_budget_holds),
        cmocka_unit_test(test_faults_end_in_a_hold),
        cmocka_unit_test(test_marked_attachments),
        cmocka_unit_test(test_words),
        cmocka_unit_test(test_wrong_commands),
        cmocka_unit_test(test_plans_need_consent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
