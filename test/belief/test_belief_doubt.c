// test_belief_doubt.c: where no plan is left, the twin doubts what it has learnt.
#include "warn_rig.h"

// The first estimate attaches everything: no point may be grasped, and the loop would end. It was free in the belief
// before: the twin frees it again, but for what is in hand, and another point is grasped.
static void test_doubt(void** state) {
    (void)state;
    for (int has_doubt = test_is_slow() ? 0 : 1; has_doubt < 2; ++has_doubt) {
        Course c;
        begin_doubt(&c, doubt_scene(0.99), 14, 1);
        if (!has_doubt) {
            om_free(c.loop->belief.always);
            c.loop->belief.always = NULL;
        }
        // a quick run ends where another point is grasped
        while (om_loop_phase(c.loop) != OM_LOOP_ENDED &&
               (test_is_slow() || c.seen.ndoubt == 0 ||
                om_loop_result(c.loop)->naction <= c.seen.naction))
            assert_ok(om_loop_tick(c.loop));
        const OmRetractResult* r = om_loop_result(c.loop);
        print_course(r);
        assert_true(r->belief.nupdate >= 1);
        assert_int_equal(r->belief.update[0].stage, OM_UPDATE_ADOPTED);
        assert_int_equal(c.seen.ndoubt > 0, has_doubt);
        if (has_doubt) {
            assert_true(c.seen.nhand > 0);
            assert_int_equal(c.seen.nrest, c.seen.nhand);
            assert_true(r->naction > c.seen.naction);
            assert_int_not_equal(r->outcome, OM_RETRACT_NO_PLAN);
        } else {
            assert_int_equal(r->outcome, OM_RETRACT_NO_PLAN);
        }
        course_end(&c);
    }
}

// What an estimate attaches below the block in hand is marked until an estimate frees it; a person's mark stays.
static void test_what_a_pull_showed(void** state) {
    (void)state;
    Course c;
    begin_doubt(&c, doubt_scene(0.99), 14, 1);
    while (!c.loop->belief.always) assert_ok(om_loop_tick(c.loop));
    Belief* belief = &c.loop->belief;
    const OmTetMesh* mesh = &om_body_site(belief->twin)->mesh;
    unsigned char* all = om_calloc((size_t)mesh->nvert, 1);
    belief->act->arm[0].in_hand = 12;
    int person = -1, nmarked = 0;
    for (int v = 0; v < mesh->nvert; ++v) {
        belief->source[v] = 0;
        all[v] = 1;
        if (om__grid_loads(belief->grid, 12, om_load3(mesh->x, v))) person = v;
    }
    om__doubt_mark(belief, person, true);
    const unsigned char mark = belief->source[person];
    om__doubt_note(belief, all);
    for (int v = 0; v < mesh->nvert; ++v) {
        const bool is_below = om__grid_loads(belief->grid, 12, om_load3(mesh->x, v));
        assert_int_equal(belief->source[v] != 0, is_below);
        nmarked += is_below;
    }
    assert_in_range(nmarked, 2, mesh->nvert / 4);
    assert_int_equal(belief->source[person], mark);
    memset(all, 0, (size_t)mesh->nvert);
    om__doubt_note(belief, all);
    for (int v = 0; v < mesh->nvert; ++v) assert_int_equal(belief->source[v] != 0, v == person);
    belief->act->arm[0].in_hand = -1;
    om_free(all);
    course_end(&c);
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
        cmocka_unit_test(test_doubt),
        cmocka_unit_test(test_what_a_pull_showed),
        cmocka_unit_test(test_no_doubt_without_a_warning),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
