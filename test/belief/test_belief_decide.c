// test_belief_decide.c: the tables of belief_decide.h, row by row.
#include "belief/belief_decide.h"
#include "omentum/scene.h"
#include "test_common.h"

static OmSceneMonitor limits(void) {
    OmSceneMonitor s = om_scene_default().monitor;
    s.limit[0] = 2e-3, s.limit[1] = 4e-3, s.limit[2] = 6e-3;
    s.hysteresis = 0;
    s.part_limit[0] = 6e-3, s.part_limit[1] = 12e-3;
    return s;
}

// ---- 1: the state ---------------------------------------------------------------------------------------------

static Warning next(Warning was, double mu, FrameEvidence e) {
    const OmSceneMonitor s = limits();
    e.state = om_monitor_next_state(&s, 0, mu);
    return om__warning_next(&s, was, &e);
}

static void without_tissue_in_hand_the_state_is_0(void** state) {
    (void)state;
    const OmPlanVerb verb[] = {OM_PLAN_REACH, OM_PLAN_PULL, OM_PLAN_MOVE_AWAY, OM_PLAN_RELEASE};
    for (int k = 0; k < 4; ++k) {
        const Warning w = next((Warning){.state = 2, .has_dragged = true}, 9e-3,
                               (FrameEvidence){.part = 0.02, .verb = verb[k]});
        assert_int_equal(w.state, 0);
        assert_false(w.has_dragged);
        assert_near(w.part_rest, 0.02, 0);  // the part begins anew with each grasp
    }
}

static void a_pull_has_the_larger_of_both_states(void** state) {
    (void)state;
    static const struct {
        double mu, part;
        int state;
    } row[] = {{1e-3, 5e-3, 0},  {3e-3, 5e-3, 1}, {5e-3, 5e-3, 2}, {7e-3, 5e-3, 3},
               {1e-3, 11e-3, 1}, {1e-3, 0.03, 2}, {3e-3, 0.03, 2}, {7e-3, 0.03, 3}};
    for (int k = 0; k < 8; ++k) {
        const FrameEvidence e = {.part = 4e-3 + row[k].part, .holds = true, .verb = OM_PLAN_PULL};
        const Warning w = next((Warning){.part_rest = 4e-3}, row[k].mu, e);
        assert_int_equal(w.state, row[k].state);
        assert_near(w.part_rest, 4e-3, 0);
    }
    // other actions have that by mu alone
    const FrameEvidence e = {.part = 0.03, .holds = true, .verb = OM_PLAN_REACH};
    assert_int_equal(next((Warning){0}, 3e-3, e).state, 1);
}

// A fold has the states of mu; a part of the tissue is not judged in it, nor in a pull after it.
static void a_fold_is_judged_by_mu_alone(void** state) {
    (void)state;
    static const struct {
        double mu;
        int state;
    } row[] = {{1e-3, 0}, {3e-3, 1}, {5e-3, 2}, {7e-3, 3}};
    for (int k = 0; k < 4; ++k) {
        FrameEvidence e = {.part = 0.05, .holds = true, .verb = OM_PLAN_MOVE_ROI};
        const Warning w = next((Warning){0}, row[k].mu, e);
        assert_int_equal(w.state, row[k].state);
        assert_int_equal(w.part_state, 0);
        assert_true(w.has_dragged);
        e.verb = OM_PLAN_PULL;
        assert_int_equal(next(w, row[k].mu, e).state, row[k].state);
    }
}

// ---- 2: how the arms move -----------------------------------------------------------------------------------------

static void the_state_tells_how_the_arms_move(void** state) {
    (void)state;
    for (int s = 0; s <= 3; ++s) {
        const Warning w = {.state = s, .state3_begin = 5};
        const Conduct early = om__warning_conduct(w, 5.9, false),
                      late = om__warning_conduct(w, 6.1, false);
        assert_near(early.rate, s == 0 ? 1 : 0.5, 0);
        assert_true(early.stops == (s >= 2));
        assert_false(early.calls_a_person);
        assert_true(late.calls_a_person == (s == 3));
        // an answer is awaited, but not for ever
        assert_false(om__warning_conduct(w, 5 + LEARN_LIMIT - 0.1, true).calls_a_person);
        assert_true(om__warning_conduct(w, 5 + LEARN_LIMIT, true).calls_a_person == (s == 3));
    }
    const Warning overruled = {.state = 3, .is_overruled = true};
    assert_false(om__warning_conduct(overruled, 100, false).calls_a_person);
    // its time counts from the frame that raised it, and a fall ends the person's permission
    Warning w = next((Warning){.state = 2}, 7e-3,
                     (FrameEvidence){.time = 7, .holds = true, .verb = OM_PLAN_PULL});
    assert_near(w.state3_begin, 7, 0);
    w.is_overruled = true;
    w = next(w, 7e-3, (FrameEvidence){.time = 8, .holds = true, .verb = OM_PLAN_PULL});
    assert_true(w.is_overruled && w.state3_begin == 7);
    w = next(w, 5e-3, (FrameEvidence){.time = 9, .holds = true, .verb = OM_PLAN_PULL});
    assert_false(w.is_overruled);
}

// ---- 3: after an action ----------------------------------------------------------------------------------------

// A pull in state 1 that nothing has answered, with monitor and estimator.
static AfterEvidence warned_pull(void) {
    return (AfterEvidence){.verb = OM_PLAN_PULL,
                           .state = 1,
                           .highest = 1,
                           .has_monitor = true,
                           .has_updater = true,
                           .has_estimator = true,
                           .is_lifted = true};
}

static void after_an_action_comes_the_first_row_that_holds(void** state) {
    (void)state;
    AfterEvidence e = warned_pull();
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LOOK);
    e.is_lifted = false;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    e = warned_pull();
    e.highest = 0;
    e.continues = true;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    e.is_seen = false;
    e.continues = false;  // the end of a lift is looked at, as evidence for the fold that follows
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LOOK);
    e.has_dragged = true;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    e.has_dragged = false;
    e.is_seen = true;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    e.is_seen = false;
    e.verb = OM_PLAN_MOVE_ROI;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    e.has_monitor = false;  // then every pull and fold is followed by a look
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LOOK);
    e.verb = OM_PLAN_GRASP;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    e = warned_pull();
    e.has_updater = e.has_estimator = false;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    // an updater without an estimator takes acquisitions for listeners
    e.has_updater = true;
    e.highest = 0;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LOOK);
}

static void the_arms_wait_for_what_is_learnt(void** state) {
    (void)state;
    AfterEvidence e = warned_pull();
    e.is_due = true;  // of the look that was taken
    assert_int_equal(om__belief_after(&e, AFTER_LOOK), AFTER_LEARN);
    e.continues = true;  // the next pull waits, too
    assert_int_equal(om__belief_after(&e, AFTER_LOOK), AFTER_LEARN);
    e.continues = false;
    e.is_seen = true;
    assert_int_equal(om__belief_after(&e, AFTER_LOOK), AFTER_GO);
    e.is_seen = false;
    e.has_monitor = false;
    assert_int_equal(om__belief_after(&e, AFTER_LOOK), AFTER_GO);
    // an answer under way: no second acquisition but at the end of the lift, and its effect is awaited
    e = warned_pull();
    e.is_answering = e.continues = true;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LEARN);
    e.continues = false;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LOOK);
    assert_int_equal(om__belief_after(&e, AFTER_LOOK), AFTER_LEARN);
    assert_int_equal(om__belief_after(&e, AFTER_LEARN), AFTER_GO);
    // a stop by a warning, and a fold in state 2, wait in any case
    e = warned_pull();
    e.is_lifted = false;
    e.outcome = OM_ACTION_WARNED;
    e.continues = e.is_seen = true;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LEARN);
    e.outcome = OM_ACTION_DONE;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    e.state = 2;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    e.verb = OM_PLAN_MOVE_ROI;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LEARN);
}

// ---- 4 and 5: learning ---------------------------------------------------------------------------------------------

static void waiting_ends(void** state) {
    (void)state;
    static const struct {
        WaitEvidence e;
        WaitStep step;
    } row[] = {
        {{.state = 3, .is_stopped = true, .waited = 100}, WAIT_STAY},
        {{.state = 3}, WAIT_RELEASE},
        {{.state = 3, .is_changing = true}, WAIT_STAY},
        {{.state = 1, .is_changing = true}, WAIT_STAY},
        {{.state = 1, .is_answering = true}, WAIT_STAY},
        {{.state = 1, .is_answering = true, .waited = LEARN_LIMIT}, WAIT_GO},
        {{.state = 2, .is_answering = true, .is_changing = true, .waited = LEARN_LIMIT},
         WAIT_RELEASE},
        {{.state = 2}, WAIT_RELEASE},
        {{.state = 1}, WAIT_GO},
        {{.state = 0}, WAIT_GO},
    };
    for (size_t k = 0; k < sizeof row / sizeof *row; ++k)
        assert_int_equal(om__belief_wait(&row[k].e), row[k].step);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_tissue_in_hand_the_state_is_0),
        cmocka_unit_test(a_pull_has_the_larger_of_both_states),
        cmocka_unit_test(a_fold_is_judged_by_mu_alone),
        cmocka_unit_test(the_state_tells_how_the_arms_move),
        cmocka_unit_test(after_an_action_comes_the_first_row_that_holds),
        cmocka_unit_test(the_arms_wait_for_what_is_learnt),
        cmocka_unit_test(waiting_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
