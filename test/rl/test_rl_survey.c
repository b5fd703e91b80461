// test_rl_survey.c: the scene of the task "retract" is the committed one, and neither trivial nor impossible.
#include "omentum/rl_retract.h"
#include "test_common.h"

// Kidney, tumour, p_T, camera and starts were fixed before any policy was trained. Weights, demonstrations and every
// figure of doc/rl.md belong to these numbers: a change of them is a new task.
#define SCENE_HASH 0x188a1631194f55f1ull

static void test_hash(void** state) {
    (void)state;
    OmRlRetractDef d = om_rl_retract_default_def();
    OmPose eye = d.endoscope.pose_world_camera;
    double scene[] = {d.kidney.center.x,
                      d.kidney.center.y,
                      d.kidney.center.z,
                      d.kidney.half.x,
                      d.kidney.half.y,
                      d.kidney.half.z,
                      d.kidney.bend,
                      d.tumour_x,
                      d.tumour_y,
                      d.tumour_radius,
                      d.target.x,
                      d.target.y,
                      d.target.z,
                      d.workspace_lo.x,
                      d.workspace_lo.y,
                      d.workspace_lo.z,
                      d.workspace_hi.x,
                      d.workspace_hi.y,
                      d.workspace_hi.z,
                      d.endoscope.fov,
                      d.endoscope.width,
                      d.endoscope.height,
                      d.start_height,
                      d.move,
                      d.reach,
                      d.hold,
                      OM_RL_GRID,
                      round(1e9 * eye.p.x),
                      round(1e9 * eye.p.y),
                      round(1e9 * eye.p.z)};
    uint64_t hash = om_hash(scene, sizeof scene, OM_HASH_SEED);
    print_message("scene hash %#llx\n", (unsigned long long)hash);
    assert_true(hash == SCENE_HASH);
}

static void test_survey(void** state) {
    (void)state;
    OmRlTask* task;
    OmRlSurvey survey;
    // ten times the step of the task: the same places, in a tenth of the time
    const OmRlSetting fast[] = {{"move_mm", "5"}};
    assert_ok(om_rl_task_create("retract", fast, test_count(1, 0), &task));
    assert_ok(om_rl_retract_survey(task, 0, &survey));
    double best = 0, near = 0;
    print_message("TE by grasping place, rows from the fixed side:\n");
    for (int i = 0; i < OM_RL_GRID; ++i) {
        print_message("%5.1f mm:", 1e3 * survey.along[i]);
        for (int j = 0; j < OM_RL_GRID; ++j) {
            double e = survey.exposure[i][j];
            print_message(" %.2f", e);
            assert_true(e >= 0 && e <= 1);
            best = fmax(best, e);
            if (survey.along[i] < 0.03) near = fmax(near, e);
        }
        print_message("\n");
    }
    assert_true(near < 0.3);
    assert_true(best >= 0.95);
    om_rl_task_destroy(task);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_hash), cmocka_unit_test(test_survey)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
