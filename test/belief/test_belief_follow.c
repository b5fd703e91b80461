// test_belief_follow.c: the twin follows the picture of a fold where no attachments explain it.
#include "warn_rig.h"

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
        while (c.loop->act.arm[0].in_hand < 0) assert_ok(om_loop_tick(c.loop));
        c.loop->belief.warn.has_dragged = true;  // as if the tissue had been folded before
        if (k) {  // a person pauses the arms and lets them go on while the twin follows
            while (!c.loop->belief.is_waiting) assert_ok(om_loop_tick(c.loop));
            assert_ok(give(c.loop, OM_LOOP_PAUSE));
            assert_ok(om_loop_tick(c.loop));
            assert_ok(give(c.loop, OM_LOOP_RESUME));
            int nfixed = 0;  // the springs of the following are no attachments
            for (int b = 0; b < c.loop->grid.n * c.loop->grid.n; ++b)
                nfixed += om__follow_is_fixed(&c.loop->belief, b);
            assert_int_equal(nfixed, 0);
            while (c.loop->belief.is_waiting) {
                OmObservation obs = {0};
                assert_ok(om_loop_tick(c.loop));
                assert_ok(om_world_observe(c.g.world, 0, &obs));
                assert_false(obs.arm[0].is_moving && c.loop->belief.is_waiting);
                om_observation_done(&obs);
            }
        }
        tick_past_warning(c.loop, 1);
        const OmRetractResult* r = om_loop_result(c.loop);
        print_course(r);
        assert_true(r->belief.nupdate >= 1);
        const OmRetractUpdate* u = &r->belief.update[0];
        assert_int_equal(u->stage, OM_UPDATE_FOLLOWED);
        assert_true(u->is_followed);
        assert_string_equal(u->reason, "it saw too little");
        assert_int_equal(u->nattached_after, u->nattached_before);
        assert_true(u->mu_after < 0.5 * u->mu_before);
        assert_true(om_match_adoption_force(c.loop->belief.adoption) > 0);
        assert_int_equal(c.seen.nmove_in_learning, 0);
        int i = 0;  // the first that a warning stopped
        while (i + 1 < r->naction && r->action[i].outcome != OM_ACTION_WARNED) ++i;
        assert_true(i + 1 < r->naction);
        const bool is_kept = r->action[i + 1].verb != OM_PLAN_RELEASE;
        printf("  then: %s\n", is_kept ? "the tissue stays in hand" : "it is let go");
        assert_int_equal(is_kept, k);
        assert_true(k ? r->twin.nahead_step > 100 : r->twin.nahead_step == 0);
        course_end(&c);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_follow),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
