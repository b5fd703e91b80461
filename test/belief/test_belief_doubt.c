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
            om_free(c.loop->belief.source);
            c.loop->belief.source = NULL;
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
    while (!c.loop->belief.source) assert_ok(om_loop_tick(c.loop));
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
    om__doubt_note(belief, all, NULL);
    for (int v = 0; v < mesh->nvert; ++v) {
        const bool is_below = om__grid_loads(belief->grid, 12, om_load3(mesh->x, v));
        assert_int_equal(belief->source[v] != 0, is_below);
        nmarked += is_below;
    }
    assert_in_range(nmarked, 2, mesh->nvert / 4);
    assert_int_equal(belief->source[person], mark);
    memset(all, 0, (size_t)mesh->nvert);
    om__doubt_note(belief, all, NULL);
    for (int v = 0; v < mesh->nvert; ++v) assert_int_equal(belief->source[v] != 0, v == person);
    belief->act->arm[0].in_hand = -1;
    om_free(all);
    course_end(&c);
}

// A doubt with all blocks attached, of which block b has the probability 0.3 + 0.02 b: the level, or -1.
static double doubt_blocks(Course* c, unsigned char* left) {
    Belief* belief = &c->loop->belief;
    const OmTetMesh* mesh = &om_body_site(belief->twin)->mesh;
    const int n = mesh->nvert;
    int* vert = om_alloc((size_t)n, sizeof *vert);
    double* p = om_calloc((size_t)n, sizeof *p);
    unsigned char* all = om_alloc((size_t)n, 1);
    bool is_changed;
    for (int v = 0; v < n; ++v) {
        vert[v] = v;
        all[v] = 1;
        p[v] = 0.3 + 0.02 * om__grid_block_of(belief->grid, om_load3(mesh->x, v));
    }
    assert_ok(om_body_set_attachment(belief->twin, n, vert, NULL, NULL));
    om_match_adoption_destroy(belief->adoption);
    assert_ok(om_match_adoption_create(n, &belief->adoption));
    om__doubt_note(belief, all, p);
    for (int b = 0; b < 25; ++b) {
        belief->situation.is_fixed[b] = true;
        belief->situation.reachable[b] = true;
        belief->situation.tried[b] = belief->tried[b] = 0;
        belief->situation.is_forbidden[b] = b == 0;
    }
    belief->updater->nestimate = 1;
    assert_ok(om__doubt_free(belief, &is_changed));
    memcpy(left, all, (size_t)n);
    if (is_changed) om_match_adoption_get_goal(belief->adoption, left);
    double level = -1;
    for (int v = 0; v < n; ++v)
        if (!left[v]) level = fmax(level, p[v]);
    om_free(vert);
    om_free(p);
    om_free(all);
    return level;
}

// The least probable attachments are freed, up to the level that frees a point; a forbidden point does not count, and
// what a person has marked stays.
static void test_the_least_probable(void** state) {
    (void)state;
    Course c;
    begin_doubt(&c, doubt_scene(0.99), 14, 1);
    while (!c.loop->belief.source) assert_ok(om_loop_tick(c.loop));
    Belief* belief = &c.loop->belief;
    const OmTetMesh* mesh = &om_body_site(belief->twin)->mesh;
    unsigned char* left = om_alloc((size_t)mesh->nvert, 1);
    // Vertices between two blocks are of one of them, so freeing block 1 takes block 2 where both share a place.
    assert_near(doubt_blocks(&c, left), 0.32, 1e-12);
    for (int v = 0; v < mesh->nvert; ++v)
        assert_int_equal(left[v], om__grid_block_of(belief->grid, om_load3(mesh->x, v)) > 1);
    int marked = -1;
    for (int v = 0; v < mesh->nvert; ++v)
        if (om__grid_block_of(belief->grid, om_load3(mesh->x, v)) == 1) marked = v;
    om__doubt_mark(belief, marked, true);
    assert_near(doubt_blocks(&c, left), 0.34, 1e-12);
    for (int v = 0; v < mesh->nvert; ++v)
        assert_int_equal(left[v],
                         v == marked || om__grid_block_of(belief->grid, om_load3(mesh->x, v)) > 2);
    for (int v = 0; v < mesh->nvert; ++v) om__doubt_mark(belief, v, true);
    assert_near(doubt_blocks(&c, left), -1, 0);
    om_free(left);
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
        cmocka_unit_test(test_the_least_probable),
        cmocka_unit_test(test_no_doubt_without_a_warning),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
