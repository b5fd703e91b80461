// test_trial_preplan_workers.c: a plan before an operation does not depend on the number of workers.
#include "easy_scene.h"
#include "omentum/trial_preplan.h"
#include "test_common.h"

static OmPreplan one, three;  // too large for a stack with the sanitizer

static void run(const OmScene* scene, int nworker, OmPreplan* out) {
    OmPreplanDef def = om_preplan_default_def(scene);
    def.nworker = nworker;
    assert_ok(om_preplan_run(&def, NULL, out));
}

// A quick run has fewer cells, points and actions.
static void any_number_of_workers_gives_the_same_plan(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    if (!test_is_slow()) {
        scene.tissue.cells = om_vec3(6, 6, 1);
        scene.task.grasp_radius = 0.015;
        scene.endoscope.width = 40, scene.endoscope.height = 30;
        scene.task.grid = 2;
        scene.task.max_actions = 6;
    }
    run(&scene, 3, &three);
    run(&scene, 1, &one);
    assert_memory_equal(&one, &three, sizeof one);
    assert_true(one.ntried >= test_count(2, 8) && one.nexposing >= test_count(2, 4));
}

int main(void) {
    om_worker_force(true);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_number_of_workers_gives_the_same_plan),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
