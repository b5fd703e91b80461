// test_rl_kidney.c: the task "retract" on a kidney from a file: its place, files that are refused, a patient.
#include "omentum/image.h"
#include "omentum/rl_retract.h"
#include "omentum/shape_file.h"
#include "rl/rl_retract_internal.h"
#include "test_alloc.h"
#include "test_folder.h"

static OmRlTask* shared;  // the kidney made here

static int setup(void** state) {
    assert_ok(om_rl_task_create("retract", NULL, 0, &shared));
    return make_dir(state);
}

static int teardown(void** state) {
    om_rl_task_destroy(shared);
    return remove_dir(state);
}

// The surface of the kidney made here, turned and moved, in a file.
static void save_turned(const char* path, OmQuat turn, OmVec3 move, double unit) {
    OmSurface s = {0};
    assert_ok(om_surface_from_sdf(&om__rl_retract(shared)->ground.sdf, 0, &s));
    for (int i = 0; i < s.nvert; ++i)
        om_store3(s.x, i, om_add(move, om_quat_rotate(turn, om_load3(s.x, i))));
    assert_ok(om_surface_save(&s, path, unit));
    om_surface_done(&s);
}

// In any pose the file gives the scene of the kidney made here: box, tumour, p_T, distances.
static void test_turned(void** state) {
    (void)state;
    OmRng rng = om_rng_init(5, 0);
    const OmRlRetract* made = om__rl_retract(shared);
    for (int k = 0; k < test_count(1, 4); ++k) {
        OmVec3 axis =
            om_normalize(om_vec3(om_rng_normal(&rng), om_rng_normal(&rng), om_rng_normal(&rng)));
        const char* path = in_dir(k % 2 ? "turned.ply" : "turned.stl");
        save_turned(path, om_quat_axis_angle(axis, om_rng_range(&rng, 0, 2 * OM_PI)),
                    om_vec3(0.3, -0.1, 0.05 * k), OM_UNIT_MM);
        OmRlRetractDef def = om_rl_retract_default_def();
        def.kidney_file = path;
        OmSurface s = {0};
        OmRlKidney box;
        assert_ok(om__rl_kidney_load(&def, &s, &box));
        assert_near(box.half.x, 0.030, 3e-4);
        assert_near(box.half.y, 0.055, 3e-4);
        assert_near(box.half.z, 0.022, 3e-4);
        assert_near(box.center.x, -0.008, 1e-12);
        assert_near(box.center.z, box.half.z, 1e-12);
        om__rl_kidney_use(&box, &def);
        assert_near(def.tumour_x, -0.020, 2e-4);
        assert_near(def.tumour_y, 0, 1e-9);
        assert_near(def.target.z, 0.095, 5e-4);
        OmRlGround ground = {0};
        assert_ok(om__rl_ground_init_surface(&s, &box, &ground));
        double far = 0;
        for (int n = 0; n < 300; ++n) {
            OmVec3 normal,
                p = om_vec3(om_rng_range(&rng, -0.06, 0.04), om_rng_range(&rng, -0.06, 0.06),
                            om_rng_range(&rng, 0.001, 0.055));
            double d = om__rl_ground_distance(&ground, p, &normal);
            double expected =
                om__rl_ground_distance(&made->ground, p, &normal) - made->ground.shift;
            if (fabs(expected) < 0.008) far = fmax(far, fabs(d - expected));
        }
        print_message("pose %d: distances differ by %.2f mm at most\n", k, 1e3 * far);
        // poles at the wrong side would be off by 2 x 4 /m x (55 mm)^2 = 24 mm
        assert_below(far, 1.0e-3);
        om__rl_ground_done(&ground);
        om_surface_done(&s);
    }
}

// The whole task from such a file: q and p_T are where they are on the kidney made here, and the fat hides the tumour.
static void test_task(void** state) {
    (void)state;
    const char* path = in_dir("kidney.ply");
    save_turned(path, om_quat_axis_angle(om_vec3(0.6, 0.8, 0), 1), om_vec3(0, 0, 0), OM_UNIT_MM);
    OmRlTask* task;
    assert_ok(om_rl_task_create("retract", &(OmRlSetting){"kidney", path}, 1, &task));
    const OmRlRetract *t = om__rl_retract(task), *made = om__rl_retract(shared);
    assert_near(om_distance(t->q, made->q), 0, 6e-4);
    assert_near(t->rest_exposure, 0, 0);
    assert_true(task->hash != shared->hash);
    om_rl_task_destroy(task);
    if (!test_is_slow()) return;
    // "reality" moves the true kidney, not the believed one
    const OmRlSetting moved[] = {{"kidney", path}, {"kidney_shift_x_mm", "2"}};
    assert_ok(om_rl_task_create("retract", moved, 2, &task));
    t = om__rl_retract(task);
    assert_near(t->true_q.x - t->q.x, 0.002, 1e-12);
    assert_near(om_distance(t->q, made->q), 0, 6e-4);
    om_rl_task_destroy(task);
}

static void refuse(const char* path, const char* label, const char* words) {
    const OmRlSetting setting[] = {{"kidney", path}, {"kidney_label", label}};
    OmRlTask* task;
    assert_status(om_rl_task_create("retract", setting, 2, &task), OM_INVALID);
    print_message("%s\n", om_error_message());
    assert_null(task);
    assert_non_null(strstr(om_error_message(), words));
}

static void test_refused(void** state) {
    (void)state;
    OmRlTask* task;
    const OmRlSetting none = {"kidney", "/nowhere/kidney.stl"};
    assert_status(om_rl_task_create("retract", &none, 1, &task), OM_IO);
    assert_non_null(strstr(om_error_message(), "no such file"));
    // metres in a file that is read as millimetres
    save_turned(in_dir("metres.obj"), om_quat_identity(), om_vec3(0, 0, 0), OM_UNIT_M);
    OmSurface s = {0};
    assert_ok(om_surface_load(in_dir("metres.obj"), OM_UNIT_MM, &s));
    for (int i = 0; i < 3 * s.nvert; ++i) s.x[i] = 4 * s.x[i];
    assert_ok(om_surface_save(&s, in_dir("other.stl"), OM_UNIT_M));
    refuse(in_dir("other.stl"), "3", "millimetres");
    // a hole
    --s.ntri;
    assert_ok(om_surface_save(&s, in_dir("open.stl"), OM_UNIT_MM));
    refuse(in_dir("open.stl"), "3", "open.stl");
    om_surface_done(&s);
    // a volume without the label
    OmVolume volume;
    assert_ok(om_volume_init(&volume, 8, 8, 8));
    ((float*)volume.voxel)[100] = 3;
    assert_ok(om_volume_save(&volume, OM_VOXEL_U8, in_dir("volume.nii.gz")));
    om_volume_done(&volume);
    refuse(in_dir("volume.nii.gz"), "2", "kidney_label");
    refuse(in_dir("volume.nii.gz"), "3", "volume.nii.gz");  // one voxel of a metre
}

typedef struct Work {
    const char* path;
} Work;

static OmStatus load_once(void* ctx) {
    OmRlRetractDef def = om_rl_retract_default_def();
    def.kidney_file = ((Work*)ctx)->path;
    OmSurface s = {0};
    OmRlKidney box;
    OmStatus status = om__rl_kidney_load(&def, &s, &box);
    om_surface_done(&s);
    return status;
}

// A ball of 40 mm in a label volume: every allocation fails once.
static void test_allocations(void** state) {
    (void)state;
    OmVolume volume;
    assert_ok(om_volume_init(&volume, 24, 24, 24));
    volume.grid.axis = om_mat3_scale(0.004, om_mat3_identity());
    for (size_t n = 0; n < om_volume_count(&volume); ++n) {
        int at[3];
        om_grid_unpack(volume.grid.dim, n, at);
        double r = sqrt(pow(at[0] - 12, 2) + pow(at[1] - 12, 2) + pow(at[2] - 12, 2));
        ((float*)volume.voxel)[n] = r < 5 ? 3 : 0;
    }
    Work work = {in_dir("ball.nii.gz")};
    assert_ok(om_volume_save(&volume, OM_VOXEL_U8, work.path));
    om_volume_done(&volume);
    int nfail = test_failing_allocations(load_once, &work, test_stride(11));
    print_message("%d allocations failed\n", nfail);
    assert_true(nfail > 2);
}

// ---- the patient ----------------------------------------------------------------------------------------

static OmRlTask* patient(const char* label) {
    const char* path = test_data("ct_abdomen/labels.nii.gz");
    const OmRlSetting setting[] = {{"kidney", path}, {"kidney_label", label}};
    OmRlTask* task;
    assert_ok(om_rl_task_create("retract", setting, 2, &task));
    return task;
}

// The left kidney has 3,676 voxels of 27 mm^3. The fat hides the tumour, and rests on the kidney without entering it.
static void test_patient_scene(void** state) {
    (void)state;
    OmRlTask* task = patient("3");
    const OmRlRetract* t = om__rl_retract(task);
    double volume = om_surface_volume(&t->organ);
    OmVec3 half = t->def.kidney.half;
    print_message("left kidney: %.1f mL, %.0f x %.0f x %.0f mm\n", 1e6 * volume, 2e3 * half.x,
                  2e3 * half.y, 2e3 * half.z);
    assert_near_rel(volume, 3676 * 27e-9, 0.03);
    assert_true(half.y > half.x && half.x > half.z);
    assert_near(t->rest_exposure, 0, 0);
    for (int i = 0; i < t->nvert; ++i) {
        OmVec3 n;
        double d = om__rl_ground_distance(&t->ground, om_load3(t->rest_x, i), &n);
        assert_true(d - t->ground.shift > 0.0010);
    }
    om_rl_task_destroy(task);
}

// Neither trivial nor impossible, as on the kidney made here.
static void test_patient_survey(void** state) {
    (void)state;
    OmRlTask* task = patient("3");
    OmRlSurvey survey;
    double best = 0, near = 0;
    assert_ok(om_rl_retract_survey(task, 0, &survey));
    for (int i = 0; i < OM_RL_GRID; ++i) {
        print_message("%5.1f mm:", 1e3 * survey.along[i]);
        for (int j = 0; j < OM_RL_GRID; ++j) {
            double e = survey.exposure[i][j];
            print_message(" %.2f", e);
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
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_turned),        cmocka_unit_test(test_task),
        cmocka_unit_test(test_refused),       cmocka_unit_test(test_allocations),
        cmocka_unit_test(test_patient_scene), cmocka_slow_test(test_patient_survey)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
