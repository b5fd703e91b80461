// test_belief_warn.c: what the loop does in the warning states of Alg. 5.
#include "warn_rig.h"

// State 1: pulls take twice the time, an acquisition follows, and with the truth learnt mu falls.
static void test_state_one(void** state) {
    (void)state;
    Course c;
    double pull[2] = {0, 0};
    for (int k = 0; k < 2; ++k) {
        course_begin(&c, warn_scene(k ? 0.005e-3 : 0.02, 0.05, 0.06), k, false);
        bool has_pulled = false;  // a quick run ends with the first pull
        while (om_loop_phase(c.loop) != OM_LOOP_ENDED && (test_is_slow() || !has_pulled)) {
            assert_ok(om_loop_tick(c.loop));
            for (int i = 0; i < om_loop_result(c.loop)->naction; ++i)
                has_pulled |= om_loop_result(c.loop)->action[i].verb == OM_PLAN_PULL &&
                              i + 1 < om_loop_result(c.loop)->naction;
        }
        const OmRetractResult* r = om_loop_result(c.loop);
        print_course(r);
        if (test_is_slow()) assert_true(r->is_exposed);
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
    tick_past_warning(c.loop, 1);
    const OmRetractResult* r = om_loop_result(c.loop);
    print_course(r);
    if (test_is_slow()) assert_true(r->is_exposed);
    assert_int_equal(c.seen.largest, 2);
    assert_int_equal(c.seen.nmove_in_learning, 0);
    int nwarned = 0;
    for (int i = 0; i + 1 < r->naction; ++i) {
        if (r->action[i].outcome != OM_ACTION_WARNED) continue;
        ++nwarned;
        assert_true(r->action[i + 1].is_replanned);
        assert_int_not_equal(r->action[i + 1].verb, OM_PLAN_RELEASE);
    }
    assert_true(nwarned >= 1 && r->belief.nupdate >= 1);
    assert_int_equal(r->belief.update[0].stage, OM_UPDATE_ADOPTED);
    assert_true(r->belief.update[0].mu_after < 0.5 * r->belief.update[0].mu_before);
    course_end(&c);
}

// If nothing is learnt in state 2, the tissue is released and another point is grasped.
static void test_nothing_is_learnt(void** state) {
    (void)state;
    Course c;
    course_begin(&c, warn_scene(0.1e-3, 0.3e-3, 0.06), true, false);
    tick_past_warning(c.loop, 2);
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
    assert_int_equal(r->belief.update[0].stage, OM_UPDATE_REFUSED);
    assert_true(r->belief.update[0].mu_after > 0.3e-3);
    course_end(&c);
}

static bool is_estimate_due(Course* c) {
    bool needs_tick;
    c->updater->is_due = false;
    c->loop->belief.look_begin = -1;  // the arms have been still for long enough
    assert_ok(om__look_take(&c->loop->belief, &needs_tick));
    assert_false(needs_tick);
    return c->updater->is_due;
}

// An acquisition leads to an estimate if there was a warning, and if neither an estimate runs nor the effect of one is
// awaited.
static void test_what_a_look_leads_to(void** state) {
    (void)state;
    Course c;
    course_begin(&c, warn_scene(0.02, 0.05, 0.06), true, false);
    assert_ok(om_loop_tick(c.loop));
    Belief* b = &c.loop->belief;
    for (int warned = 0; warned <= 3; ++warned) {
        b->warning_action = warned;
        assert_int_equal(is_estimate_due(&c), warned > 0);
        assert_ok(om__updater_start(c.updater, b->act->tick, b->act->time));
        assert_false(is_estimate_due(&c));
        om__updater_cancel(c.updater);
        b->has_effect_due = true;
        assert_false(is_estimate_due(&c));
        b->has_effect_due = false;
    }
    assert_int_equal(c.seen.ntaken, 12);
    course_end(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_state_one),
        cmocka_unit_test(test_state_two),
        cmocka_unit_test(test_nothing_is_learnt),
        cmocka_unit_test(test_what_a_look_leads_to),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
