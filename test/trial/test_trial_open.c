// test_trial_open.c: a plan carried out open loop: it exposes what it promised where the belief is right.
#include "easy_scene.h"
#include "omentum/trial_search.h"
#include "test_common.h"

static OmPreplan plan;

static void make_plan(const OmScene* scene) {
    OmPreplanDef def = om_preplan_default_def(scene);
    def.nworker = 1;
    assert_ok(om_preplan_run(&def, NULL, &plan));
}

// The truth has the material and the attachments of the twin, and a finer mesh.
static OmScene same_scene(void) {
    OmScene scene = easy_scene();
    scene.task.grid = 3;
    scene.tissue.cells = om_vec3(6, 6, 1);
    scene.tissue.world_cells = om_vec3(9, 9, 1);
    scene.task.grasp_radius = 0.015;
    scene.world.young_factor = 1;
    scene.task.speed *= 2;
    return scene;
}

static void a_right_belief_keeps_its_promise(void** state) {
    (void)state;
    OmScene scene = same_scene();
    OmOpenLoop r;
    make_plan(&scene);
    assert_true(plan.is_exposing);
    const OmPreplanPoint* p = &plan.point[plan.chosen];
    assert_ok(om_retract_open_loop(&scene, &plan, 1, NULL, &r));
    printf("planned %.2f and %.3f N in %d actions, open loop %.2f and %.3f N in %d\n",
           p->visibility, p->force, p->naction, r.visibility, r.force, r.naction);
    assert_true(r.is_held && r.is_exposed && r.visibility >= scene.task.visibility);
    assert_int_equal(r.naction, p->naction);
    // a pull that the plan ends early has its full length here
    assert_true(r.force > p->force && r.force < 0.2 * scene.task.force_threshold);
}

// The robot believes that the far half is free, and it is not: what it holds there does not follow.
static void a_wrong_belief_does_not(void** state) {
    (void)state;
    OmScene scene = same_scene();
    OmOpenLoop right, wrong;
    make_plan(&scene);
    assert_ok(om_retract_open_loop(&scene, &plan, 1, NULL, &right));
    scene.attach.lo.x = -0.02;  // most of the sheet
    assert_ok(om_retract_open_loop(&scene, &plan, 1, NULL, &wrong));
    printf("right %.2f and %.3f N, wrong %.2f and %.3f N\n", right.visibility, right.force,
           wrong.visibility, wrong.force);
    assert_true(wrong.is_held && wrong.force > 5 * right.force);
    scene.attach.lo = om_vec3(-1, -1, -1);  // all of it
    assert_ok(om_retract_open_loop(&scene, &plan, 1, NULL, &wrong));
    assert_true(!wrong.is_exposed && wrong.visibility < right.visibility);
}

static void wrong_plans_are_refused(void** state) {
    (void)state;
    OmScene scene = same_scene();
    OmOpenLoop r;
    make_plan(&scene);
    scene.task.grid = 4;
    assert_status(om_retract_open_loop(&scene, &plan, 1, NULL, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "3 x 3"));
    scene.task.grid = 3;
    plan.chosen = -1;
    assert_status(om_retract_open_loop(&scene, &plan, 1, NULL, &r), OM_INVALID);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_right_belief_keeps_its_promise),
        cmocka_unit_test(a_wrong_belief_does_not),
        cmocka_unit_test(wrong_plans_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
