// test_belief_fluents.c: measurements to the fluents of Table 6.1, without a loop.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "belief/belief_state.h"
#include "easy_scene.h"
#include "test_common.h"

// A belief of two arms over a twin that the test makes.
typedef struct Facts {
    OmSceneTask task;
    Grid grid;
    Act act;
    Belief belief;
} Facts;

static Facts* facts_create(const OmScene* scene) {
    Facts* f = calloc(1, sizeof *f);
    f->task = scene->task;
    f->act.narm = 2;
    f->belief.task = f->act.task = &f->task;
    f->belief.grid = f->act.grid = &f->grid;
    f->belief.act = &f->act;
    return f;
}

static void test_fluents(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    scene.task.pull_step = 0.01;
    scene.task.max_height = 0.05;
    OmSite site;
    Facts* f = facts_create(&scene);
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_body_create(&scene, &site, 1, &f->belief.twin));
    assert_ok(om__grid_build(&scene.task, &site, &f->grid));
    f->act.arm[0] = (ArmState){.at = 3, .in_hand = 3, .is_closed = true, .lift = 0.0297};
    f->act.arm[1] = (ArmState){.at = 7, .in_hand = -1, .is_max_force = true, .lift = 0.02};
    f->belief.tried[5] = OM_TRIED_GRASP;
    om__sense_fluents(&f->belief, &f->belief.situation);
    const OmSituation* s = &f->belief.situation;
    assert_int_equal(s->n, 5);
    assert_near(s->spacing, 0.024, 1e-12);
    assert_int_equal(s->arm[0].nlift, 3);
    assert_false(s->arm[0].is_max_height);
    assert_true(s->arm[0].is_closed && s->arm[0].at == 3 && s->arm[0].in_hand == 3);
    assert_int_equal(s->arm[1].nlift, 0);  // holds nothing: it lifts nothing
    assert_false(s->arm[1].is_max_force);
    assert_int_equal(s->tried[5], OM_TRIED_GRASP);
    for (int b = 0; b < 25; ++b) assert_true(s->is_above_roi[b] == (b == 1 * 5 + 0));
    f->act.arm[0].lift = 0.0497;  // a measured tip stops short of its goal
    om__sense_fluents(&f->belief, &f->belief.situation);
    assert_true(f->belief.situation.arm[0].is_max_height);
    om_body_destroy(f->belief.twin);
    om_site_done(&site);
    free(f);
}

// What is near does not depend on the grid. 120 mm of tissue, 12 mm blocks, three attempts within 21.6 mm, then
// within 10.8 mm.
static void test_attempts_are_kept_apart(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    OmSite site;
    Facts* f = facts_create(&scene);
    scene.task.grid = 10;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_body_create(&scene, &site, 1, &f->belief.twin));
    assert_ok(om__grid_build(&scene.task, &site, &f->grid));
    f->act.arm[0] = f->act.arm[1] = (ArmState){.at = -1, .in_hand = -1};
    f->belief.attempt_distance = om__grid_length(&f->grid, ATTEMPT_DISTANCE);
    assert_near(f->belief.attempt_distance, 0.0216, 1e-12);
    // Three attempts in a row: blocks (1,3), (2,3), (3,3), 12 mm apart.
    for (int k = 1; k <= 3; ++k) {
        f->belief.is_exhausted[30 + k] = true;
        f->belief.tried[30 + k] = OM_TRIED_GRASP;
    }
    om__sense_fluents(&f->belief, &f->belief.situation);
    const OmSituation* s = &f->belief.situation;
    for (int b = 0; b < 100; ++b) {
        bool has_point = f->grid.vert[b] >= 0, is_exhausted = b >= 31 && b <= 33;
        // Within 21.6 mm of all three are the two blocks above and below the one in the middle, 17 mm from the others.
        bool is_late = b == 22 || b == 42;
        if (has_point && s->reachable[b])
            assert_int_equal(s->tried[b], is_late || is_exhausted ? OM_TRIED_GRASP : 0);
        // Attached from x = 15 mm on, every 15 mm: blocks whose middle is 10.8 mm from there are as good as attached.
        double y = -54 + 12 * (b / 10), off = fabs(y - 15 * round(y / 15));
        bool is_fixed = b % 10 >= 6 || (b % 10 == 5 && hypot(15 - 6, off) < 10.8);
        if (has_point) assert_true(s->is_fixed[b] == is_fixed);
    }
    assert_true(f->belief.npostponed > 0 && f->belief.npostponed <= 2);
    f->belief.attempt_distance *= 0.5;
    om__sense_fluents(&f->belief, &f->belief.situation);
    assert_int_equal(f->belief.npostponed, 0);
    for (int b = 0; b < 100; ++b)
        assert_int_equal(f->belief.situation.tried[b], b >= 31 && b <= 33 ? OM_TRIED_GRASP : 0);
    om_body_destroy(f->belief.twin);
    om_site_done(&site);
    // Up to 5 x 5 blocks every block is on its own.
    for (int n = 2; n <= 5; ++n) {
        scene.task.grid = n;
        assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
        assert_ok(om_body_create(&scene, &site, 1, &f->belief.twin));
        assert_ok(om__grid_build(&scene.task, &site, &f->grid));
        memset(f->belief.is_exhausted, 0, sizeof f->belief.is_exhausted);
        memset(f->belief.tried, 0, sizeof f->belief.tried);
        for (int b = 1; b < n * n; ++b) f->belief.is_exhausted[b] = true;
        f->belief.attempt_distance = om__grid_length(&f->grid, ATTEMPT_DISTANCE);
        om__sense_fluents(&f->belief, &f->belief.situation);
        assert_int_equal(f->belief.npostponed, 0);
        om_body_destroy(f->belief.twin);
        om_site_done(&site);
    }
    free(f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fluents),
        cmocka_unit_test(test_attempts_are_kept_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
