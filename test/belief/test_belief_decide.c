// test_belief_decide.c: the tables of belief_decide.h, row by row.
#include "belief/belief_decide.h"
#include "omentum/scene.h"
#include "test_common.h"

static OmSceneMonitor limits(void) {
    OmSceneMonitor s = om_scene_default().monitor;
    s.limit[0] = 2e-3, s.limit[1] = 4e-3, s.limit[2] = 6e-3;
    s.hysteresis = 0;
    s.fold_factor = 2;
    s.part_limit[0] = 6e-3, s.part_limit[1] = 12e-3;
    s.is_fold_at_rest = true;
    return s;
}

// ---- 1: the state ---------------------------------------------------------------------------------------------

static Warning next(Warning was, FrameEvidence e) {
    const OmSceneMonitor s = limits();
    e.state = om_monitor_next_state(&s, 0, e.mu);
    return om__warning_next(&s, was, &e);
}

static void without_tissue_in_hand_the_state_is_0(void** state) {
    (void)state;
    const OmPlanVerb verb[] = {OM_PLAN_REACH, OM_PLAN_PULL, OM_PLAN_MOVE_AWAY, OM_PLAN_RELEASE};
    for (int k = 0; k < 4; ++k) {
        const Warning w = next((Warning){.state = 2, .has_dragged = true},
                               (FrameEvidence){.mu = 9e-3, .part = 0.02, .verb = verb[k]});
        assert_int_equal(w.state, 0);
        assert_int_equal(w.unsettled, 0);
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
        const FrameEvidence e = {
            .mu = row[k].mu, .part = 4e-3 + row[k].part, .holds = true, .verb = OM_PLAN_PULL};
        const Warning w = next((Warning){.part_rest = 4e-3}, e);
        assert_int_equal(w.state, row[k].state);
        assert_near(w.part_rest, 4e-3, 0);
    }
    // other actions have that by mu alone
    const FrameEvidence e = {.mu = 3e-3, .part = 0.03, .holds = true, .verb = OM_PLAN_REACH};
    assert_int_equal(next((Warning){0}, e).state, 1);
}

static void a_fold_has_larger_limits_and_is_judged_at_rest(void** state) {
    (void)state;
    static const struct {
        double mu;
        bool is_acting;
        int was, state, unsettled;
    } row[] = {{3e-3, true, 0, 0, 0}, {5e-3, true, 0, 0, 1}, {5e-3, false, 0, 1, 1},
               {5e-3, true, 1, 1, 1}, {9e-3, true, 0, 2, 2}, {13e-3, true, 0, 3, 3}};
    for (int k = 0; k < 6; ++k) {
        const FrameEvidence e = {.mu = row[k].mu,
                                 .part = 0.05,
                                 .holds = true,
                                 .verb = OM_PLAN_MOVE_ROI,
                                 .is_acting = row[k].is_acting};
        const Warning w = next((Warning){.state = row[k].was}, e);
        assert_int_equal(w.state, row[k].state);
        assert_int_equal(w.unsettled, row[k].unsettled);
        assert_int_equal(w.part_state, 0);
        assert_true(w.has_dragged);
        assert_int_equal(om__warning_settle(w, 1).state, row[k].unsettled);
        // a pull after it still has the limits of folds
        FrameEvidence pull = e;
        pull.verb = OM_PLAN_PULL;
        assert_int_equal(next(w, pull).state, row[k].unsettled);
    }
}

// ---- 2: how the arms move -----------------------------------------------------------------------------------------

static void the_state_tells_how_the_arms_move(void** state) {
    (void)state;
    for (int s = 0; s <= 3; ++s) {
        const Warning w = {.state = s, .state3_begin = 5};
        const Conduct early = om__warning_conduct(w, 5.9), late = om__warning_conduct(w, 6.1);
        assert_near(early.rate, s == 0 ? 1 : 0.5, 0);
        assert_true(early.stops == (s >= 2));
        assert_false(early.calls_a_person);
        assert_true(late.calls_a_person == (s == 3));
    }
    const Warning overruled = {.state = 3, .is_overruled = true};
    assert_false(om__warning_conduct(overruled, 100).calls_a_person);
    // its time counts from the frame that raised it, and a fall ends the person's permission
    Warning w = next((Warning){.state = 2},
                     (FrameEvidence){.time = 7, .mu = 7e-3, .holds = true, .verb = OM_PLAN_PULL});
    assert_near(w.state3_begin, 7, 0);
    w.is_overruled = true;
    w = next(w, (FrameEvidence){.time = 8, .mu = 7e-3, .holds = true, .verb = OM_PLAN_PULL});
    assert_true(w.is_overruled && w.state3_begin == 7);
    w = next(w, (FrameEvidence){.time = 9, .mu = 5e-3, .holds = true, .verb = OM_PLAN_PULL});
    assert_false(w.is_overruled);
}

// ---- 3: after an action ----------------------------------------------------------------------------------------

// A pull in state 1 that nothing has answered, with monitor and estimator.
static AfterEvidence warned_pull(void) {
    return (AfterEvidence){.verb = OM_PLAN_PULL,
                           .state = 1,
                           .unsettled = 1,
                           .highest = 1,
                           .has_monitor = true,
                           .has_updater = true,
                           .has_estimator = true,
                           .folds_rest = true,
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

static void a_fold_settles_before_it_is_judged(void** state) {
    (void)state;
    AfterEvidence e = warned_pull();
    e.verb = OM_PLAN_MOVE_AWAY;
    e.state = 0;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_SETTLE);
    assert_int_equal(om__belief_after(&e, AFTER_SETTLE), AFTER_LOOK);  // once
    AfterEvidence other = e;
    other.is_seen = true;
    assert_int_equal(om__belief_after(&other, AFTER_GO), AFTER_LOOK);
    other = e;
    other.folds_rest = false;
    assert_int_equal(om__belief_after(&other, AFTER_GO), AFTER_LOOK);
    other = e;
    other.verb = OM_PLAN_PULL;
    assert_int_equal(om__belief_after(&other, AFTER_GO), AFTER_LOOK);
    other = e;
    other.unsettled = 0;
    assert_int_equal(om__belief_after(&other, AFTER_GO), AFTER_LOOK);
}

static void the_arms_wait_for_what_is_learnt(void** state) {
    (void)state;
    AfterEvidence e = warned_pull();
    e.is_due = true;  // of the look that was taken
    assert_int_equal(om__belief_after(&e, AFTER_LOOK), AFTER_LEARN);
    e.continues = true;  // a pull may run beside the estimate
    assert_int_equal(om__belief_after(&e, AFTER_LOOK), AFTER_GO);
    e.continues = false;
    e.is_seen = true;
    assert_int_equal(om__belief_after(&e, AFTER_LOOK), AFTER_GO);
    e.is_seen = false;
    e.has_monitor = false;
    assert_int_equal(om__belief_after(&e, AFTER_LOOK), AFTER_GO);
    // an answer under way: no second acquisition, but its effect is awaited
    e = warned_pull();
    e.is_answering = true;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LEARN);
    assert_int_equal(om__belief_after(&e, AFTER_LEARN), AFTER_GO);
    // a stop by a warning, and a fold in state 2, wait in any case
    e = warned_pull();
    e.is_lifted = false;
    e.outcome = OM_ACTION_WARNED;
    e.continues = e.is_seen = true;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_LEARN);
    e.outcome = OM_ACTION_DONE;
    assert_int_equal(om__belief_after(&e, AFTER_GO), AFTER_GO);
    e.state = e.unsettled = 2;
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

static void an_estimate_is_judged(void** state) {
    (void)state;
    const EstimateEvidence good = {.is_accepted = true,
                                   .has_monitor = true,
                                   .is_of_fold = true,
                                   .has_shape = true,
                                   .before_mean = 5e-3,
                                   .after_mean = 2.9e-3};
    EstimateEvidence e = good;
    assert_int_equal(om__belief_judge(&e), VERDICT_ADOPT);
    e.after_mean = 3.1e-3;  // explains too little of a fold
    assert_int_equal(om__belief_judge(&e), VERDICT_FOLLOW);
    e.is_of_fold = false;
    assert_int_equal(om__belief_judge(&e), VERDICT_ADOPT);
    e = good;
    e.after_mean = 3.1e-3;
    e.has_shape = false;
    assert_int_equal(om__belief_judge(&e), VERDICT_ADOPT);
    e = good;
    e.after_mean = 3.1e-3;
    e.has_monitor = false;
    assert_int_equal(om__belief_judge(&e), VERDICT_ADOPT);
    e = good;
    e.is_accepted = false;
    assert_int_equal(om__belief_judge(&e), VERDICT_FOLLOW);
    e.has_failed = true;
    assert_int_equal(om__belief_judge(&e), VERDICT_REFUSE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_tissue_in_hand_the_state_is_0),
        cmocka_unit_test(a_pull_has_the_larger_of_both_states),
        cmocka_unit_test(a_fold_has_larger_limits_and_is_judged_at_rest),
        cmocka_unit_test(the_state_tells_how_the_arms_move),
        cmocka_unit_test(after_an_action_comes_the_first_row_that_holds),
        cmocka_unit_test(a_fold_settles_before_it_is_judged),
        cmocka_unit_test(the_arms_wait_for_what_is_learnt),
        cmocka_unit_test(waiting_ends),
        cmocka_unit_test(an_estimate_is_judged),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
