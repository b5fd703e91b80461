// test_calibrate_problem.c: problems in files: what they come to, what is said of wrong ones, lack of memory.
#include "omentum/calibrate_problem.h"
#include "test_alloc.h"
#include "test_files.h"

static char dir[512];

static void put(const char* name, const char* text) {
    char path[600];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    write_bytes(path, text, strlen(text));
}

static const char scene[] =
    "name: strip\n"
    "tissue: {source: sheet, size_mm: [60, 30, 10], cells: [4, 2, 1], world_cells: [6, 3, 2]}\n"
    "attachments: {kind: box, lo_mm: [-31, -16, -1], hi_mm: [-20, 16, 1], stiffness: 50}\n"
    "roi: {random: false, center_mm: [0, 0, 5], radius_mm: 3}\n";

static const char problem_text[] =
    "scene: scene.yaml\n"
    "observations: seen.csv\n"
    "parameters:\n"
    "  - {name: tissue.young, min: 500, max: 50000, log: true}\n"
    "  - {name: attachments.stiffness, min: 1, max: 100, start: 20}\n"
    "  - {name: tissue.rayleigh_stiffness, min: 0.001, max: 0.1}\n"
    "paths:\n"
    "  - {name: hang, kind: rest, settle_s: 0.1}\n"
    "  - {name: end, kind: lift, point_mm: [30, 0, 10], direction: [0, 0, 1], grasp_radius_mm: 15, time_step_s: 0.1}\n"
    "search: {norm: huber, huber_mm: 2, noise_mm: 0.5, global: crs, local: bobyqa, generations: 7, seed: 9}\n";

static const char seen[] = "experiment,level_mm,landmark,x_mm,y_mm,z_mm\n"
                           "end,2,tip,20,1,8\n"
                           "end,rest,tip,20,0,5\n"
                           "hang,0,cloud,1,2,3\n"
                           "hang,0,cloud,1,2,4\n"
                           "end,1,tip,20,2,7\n"
                           "end,2,force,0,0,1\n";

static void put_all(void) {
    snprintf(dir, sizeof dir, "%s", temp_path("problem"));
    assert_ok(om_path_make_dir(dir));
    put("scene.yaml", scene);
    put("problem.yaml", problem_text);
    put("seen.csv", seen);
}

static const char* problem_path(void) {
    static char path[600];
    snprintf(path, sizeof path, "%s/problem.yaml", dir);
    return path;
}

static void test_a_problem_is_read(void** state) {
    (void)state;
    put_all();
    OmCalibrationProblem* problem;
    assert_ok(om_calibration_problem_load(problem_path(), NULL, &problem));
    OmCalibrationDef def = om_calibration_problem_search(problem);
    assert_int_equal(def.nparam, 3);
    assert_string_equal(def.param[0].name, "tissue.young");
    assert_near(def.param[0].start, 3000, 0);  // the scene's default
    assert_true(def.param[0].is_log && !def.param[1].is_log);
    assert_near(def.param[1].start, 20, 0);
    assert_near(def.param[2].start, 0.01, 1e-15);
    assert_near_rel(def.param[2].hi, 0.1, 1e-15);
    assert_near(def.param[2].unit, 1, 0);
    assert_int_equal(def.norm, OM_NORM_HUBER);
    assert_near_rel(def.norm_size, 0.002, 1e-15);
    assert_int_equal(def.global, OM_GLOBAL_CRS);
    assert_int_equal(def.local, OM_LOCAL_BOBYQA);
    assert_int_equal(def.max_generations, 7);
    assert_int_equal(def.seed, 9);
    // two landmarks, a force, and a cloud against the vertices of the sheet's top: 5 x 3
    assert_int_equal(def.nerror, 3 + 15);
    assert_near(def.label[0].level, 0.002, 1e-15);
    assert_near(def.label[1].level, 0.001, 1e-15);
    assert_string_equal(def.experiment[def.label[0].experiment], "end");
    assert_string_equal(def.landmark[def.label[2].landmark], "force");
    assert_string_equal(def.experiment[def.label[3].experiment], "hang");
    uint64_t hash = def.problem;
    om_calibration_problem_destroy(problem);
    // whatever decides about the evaluations is in the hash
    put("seen.csv",
        "experiment,level_mm,landmark,x_mm,y_mm,z_mm\nhang,0,cloud,1,2,3\nend,1,cloud,1,2,3\n");
    assert_ok(om_calibration_problem_load(problem_path(), NULL, &problem));
    assert_true(om_calibration_problem_search(problem).problem != hash);
    om_calibration_problem_destroy(problem);
    assert_ok(om_path_remove(dir));
}

// Parameters that the scene's engine does not use are refused; those in mm are in m.
static void test_parameters_have_an_effect(void** state) {
    (void)state;
    static const struct {
        const char *engine, *param, *refused;
    } set[] = {{"fem", "tissue.cluster_radius_mm", "tissue.cluster_radius_mm has no effect"},
               {"pbd", "tissue.young", "tissue.young has no effect"},
               {"pbd", "tissue.rayleigh_stiffness", "tissue.rayleigh_stiffness has no effect"},
               {"chainmail", "tissue.poisson", "tissue.poisson has no effect"},
               {"pbd", "tissue.cluster_radius_mm", NULL}};
    for (int k = 0; k < 5; ++k) {
        char text[512];
        put_all();
        snprintf(text, sizeof text,
                 "name: strip\ntissue: {source: sheet, size_mm: [60, 30, 10], cells: [4, 2, 1], "
                 "engine: %s}\nroi: {random: false, center_mm: [0, 0, 5], radius_mm: 3}\n",
                 set[k].engine);
        put("scene.yaml", text);
        snprintf(text, sizeof text,
                 "scene: scene.yaml\nobservations: seen.csv\nparameters: [{name: %s, min: 0.0001, "
                 "max: 1000000}]\npaths: [{name: hang, kind: rest}]\n",
                 set[k].param);
        put("problem.yaml", text);
        put("seen.csv", "experiment,level_mm,landmark,x_mm,y_mm,z_mm\nhang,0,cloud,1,2,3\n");
        OmCalibrationProblem* problem;
        OmStatus status = om_calibration_problem_load(problem_path(), NULL, &problem);
        if (set[k].refused) {
            assert_status(status, OM_INVALID);
            if (!strstr(om_error_message(), set[k].refused))
                fail_msg("\"%s\" and not \"%s\"", om_error_message(), set[k].refused);
        } else {
            assert_ok(status);
            OmCalibrationDef def = om_calibration_problem_search(problem);
            assert_near(def.param[0].start, 0.0095, 1e-15);
            assert_near(def.param[0].unit, 1e-3, 0);
        }
        om_calibration_problem_destroy(problem);
        assert_ok(om_path_remove(dir));
    }
}

// The points of a picture are the points of the errors.
static void test_points_of_a_cloud(void** state) {
    (void)state;
    put_all();
    OmCalibrationProblem* problem;
    assert_ok(om_calibration_problem_load(problem_path(), NULL, &problem));
    OmCalibrationDef def = om_calibration_problem_search(problem);
    const double* start = om_calibration_problem_start(problem);
    int nseen, n = om_calibration_problem_npoint(problem);
    const OmCalibrationSeen* all = om_calibration_problem_seen(problem, &nseen);
    assert_int_equal(nseen, 5);
    assert_int_equal(n, 15);
    double x[45], error[18];
    assert_int_equal(def.nerror, 18);
    assert_ok(om_calibration_run_points(problem, start, 0, x));
    assert_ok(def.eval(def.ctx, start, 1, error));
    for (int i = 0; i < n; ++i) {
        double min = INFINITY;
        for (int k = 0; k < nseen; ++k)
            if (all[k].landmark == OM_SEEN_CLOUD)
                min = fmin(min, om_distance(all[k].x, om_load3(x, i)));
        assert_near(error[3 + i], min, 1e-12);  // rounding of the task frame's pose
    }
    assert_status(om_calibration_run_points(problem, start, 2, x), OM_INVALID);
    om_calibration_problem_destroy(problem);
    assert_ok(om_path_remove(dir));
}

static void assert_refused(const char* file, const char* text, const char* message) {
    put_all();
    put(file, text);
    OmCalibrationProblem* problem;
    OmStatus status = om_calibration_problem_load(problem_path(), NULL, &problem);
    if (status >= 0 || !strstr(om_error_message(), message))
        fail_msg("%s: status %d, \"%s\" and not \"%s\"", file, (int)status, om_error_message(),
                 message);
    assert_null(problem);
    assert_ok(om_path_remove(dir));
}

static void test_wrong_files(void** state) {
    (void)state;
#define HEAD "experiment,level_mm,landmark,x_mm,y_mm,z_mm\n"
#define YAML "scene: scene.yaml\nobservations: seen.csv\n"
#define PARAM "parameters: [{name: tissue.young, min: 1, max: 9000}]\n"
#define PATHS "paths: [{name: end, kind: rest}, {name: hang, kind: rest}]\n"
    assert_refused("seen.csv", "", "seen.csv:1: the first line must be experiment,level_mm");
    assert_refused("seen.csv", HEAD "hang,0,cloud,1,2\n", "seen.csv:2: z_mm: \"\" is not a number");
    assert_refused("seen.csv", HEAD "hang,0,cloud,1,2,3,4\n", "seen.csv:2: more than six columns");
    assert_refused("seen.csv", HEAD "hang,0,cloud,1,2,3e300\n",
                   "seen.csv:2: z_mm: 3e+300 is too large");
    assert_refused("seen.csv", HEAD "hang,0,Gef\xe4\xdf,1,2,3\n",
                   "seen.csv:2: landmark: the name is no UTF-8");
    assert_refused("seen.csv", HEAD "end,0,a\x1b[31m,1,2,3\n",
                   "seen.csv:2: landmark: the name is no UTF-8");
    assert_refused("seen.csv", HEAD "\n# x\nhang,-1,cloud,1,2,3\n", "seen.csv:4: level_mm: -1");
    assert_refused("seen.csv", HEAD "hang,0,,1,2,3\n", "seen.csv:2: landmark: a name of 0 letters");
    assert_refused("seen.csv", HEAD "hung,0,cloud,1,2,3\n",
                   "no path \"hung\"; did you mean \"hang\"?");
    assert_refused("seen.csv", HEAD "hang,rest,a,1,2,3\nend,rest,a,1,2,3\n",
                   "seen.csv:3: landmark: \"a\" has a place at rest already");
    assert_refused("seen.csv", HEAD "hang,rest,force,1,2,3\n",
                   "seen.csv:2: landmark: a force has no place");
    assert_refused("seen.csv", HEAD "hang,0,a,1,2,3\nend,1,a,1,2,3\n",
                   "the position of \"a\" at rest is missing");
    assert_refused("seen.csv", HEAD "hang,0,cloud,1,2,3\n", "nothing was seen of the path \"end\"");
    assert_refused("seen.csv", HEAD "hang,5,cloud,1,2,3\nend,1,cloud,1,2,3\n", "one level, 0");
    assert_refused("problem.yaml", YAML "parameters: []\n" PATHS, "parameters: the list is empty");
    assert_refused("problem.yaml", YAML PARAM "paths: []\n", "paths: the list is empty");
    assert_refused("problem.yaml", "scene: scene.yaml\n" PARAM PATHS,
                   "\"observations\" is missing");
    assert_refused("problem.yaml",
                   YAML "parameters: [{name: tissue.young, min: 9, max: 1}]\n" PATHS,
                   "tissue.young: min 9 is not below max 1");
    assert_refused("problem.yaml",
                   YAML PARAM "paths: [{name: a, kind: rest}, {name: a, kind: rest}]\n",
                   "two have the name \"a\"");
    assert_refused("problem.yaml", YAML PARAM PATHS "search: {norm: huber}\n",
                   "needs huber_mm or noise_mm");
    assert_refused("problem.yaml", YAML PARAM PATHS "search: {sed: 3}\n",
                   "problem.yaml:5: search: unknown key \"sed\"; did you mean \"seed\"?");
    assert_refused("scene.yaml", "name: x\n", "scene.yaml");
    assert_refused("problem.yaml",
                   YAML PARAM "paths: [{name: end, kind: rest, contact_triangles: 1000000}]\n",
                   "contact_triangles: 1000000 is outside its range, 0 to 200000");
    // clusters have no forces in newtons
    assert_refused("scene.yaml",
                   "name: strip\n"
                   "tissue: {source: sheet, size_mm: [60, 30, 10], cells: [6, 3, 1], engine: pbd}\n"
                   "roi: {random: false, center_mm: [0, 0, 5], radius_mm: 3}\n",
                   "path end has an observed force, but engine \"pbd\" has no forces");
}

static OmStatus load(void* ctx) {
    (void)ctx;
    OmCalibrationProblem* problem;
    OM_TRY(om_calibration_problem_load(problem_path(), NULL, &problem));
    om_calibration_problem_destroy(problem);
    return OM_OK;
}

static void test_allocations_fail(void** state) {
    (void)state;
    put_all();
    assert_true(test_failing_allocations(load, NULL, 3) > 20);
    assert_ok(om_path_remove(dir));
}

// ---- what the mesh does to parameters ---------------------------------------------------------------

static const char strip_text[] =
    "name: strip\n"
    "tissue: {source: sheet, size_mm: [60, 30, 10], cells: [%s], poisson: 0.3,"
    " rayleigh_stiffness: 0, element: linear, law: stable-neo-hookean}\n"
    "attachments: {kind: box, lo_mm: [-31, -16, -1], hi_mm: [-9, 16, 1]}\n"
    "roi: {random: false, center_mm: [0, 0, 5], radius_mm: 3}\n"
    "world: {young_factor: 1}\n";

static const char lifted_text[] =
    "scene: scene.yaml\n"
    "observations: seen.csv\n"
    "parameters:\n"
    "  - {name: tissue.young, min: 500, max: 40000, start: 4000, log: true}\n"
    "paths:\n"
    "  - {name: end, kind: lift, point_mm: [30, 0, 10], direction: [0, 0, 1], grasp_radius_mm: 12,"
    " speed_mm_s: 10, time_step_s: 0.1, settle_s: 0.5}\n"
    "search: {noise_mm: 0.1, force_mm_per_n: 50, global: none, local_evaluations: 40, unfit: 100}\n";

static void put_strip(const char* cells) {
    char text[sizeof strip_text + 32];
    snprintf(text, sizeof text, strip_text, cells);
    put("scene.yaml", text);
}

static void calibrate_strip(OmCalibrationResult* r) {
    OmCalibrationProblem* problem;
    char path[600];
    snprintf(path, sizeof path, "%s/shown.csv", dir);
    assert_ok(om_calibration_problem_load(problem_path(), path, &problem));
    OmCalibrationDef def = om_calibration_problem_search(problem);
    assert_ok(om_calibration_run(&def, NULL, r));
    om_calibration_problem_destroy(problem);
}

// A strip of 6000 Pa on 9 x 5 x 2 cells is lifted. On 6 x 3 x 1 cells the calibration makes up for stiff elements:
// its interval, which knows the noise alone, misses the truth. The mesh's error is stated, and with it the interval
// holds the truth. On the truth's own mesh the interval contains the truth without widening.
static void test_a_value_of_the_mesh_is_called_so(void** state) {
    (void)state;
    const double truth = 6000;
    put_all();
    put("problem.yaml", lifted_text);
    put("seen.csv", "experiment,level_mm,landmark,x_mm,y_mm,z_mm\nend,rest,middle,5,0,5\n"
                    "end,10,middle,0,0,0\nend,20,middle,0,0,0\nend,20,force,0,0,0\n");
    put_strip("6, 3, 1");
    OmCalibrationProblem* problem;
    char path[600];
    snprintf(path, sizeof path, "%s/shown.csv", dir);
    assert_ok(om_calibration_problem_load(problem_path(), NULL, &problem));
    assert_ok(om_calibration_save_synthetic(problem, &truth, 0, 1, path));
    om_calibration_problem_destroy(problem);
    OmCalibrationResult r;
    calibrate_strip(&r);
    const OmCalibrationProfile* f = &r.profile[0];
    assert_true(f->hi < truth);
    assert_true(r.has_mesh && r.is_of_mesh && r.mesh_cost > r.mesh_difference);
    assert_near_rel(r.mesh_ratio, cbrt(10.0 * 6 * 3 / (7 * 4 * 2)), 1e-12);
    assert_near_rel(r.mesh_cost, r.mesh_difference / (1 - 1 / (r.mesh_ratio * r.mesh_ratio)),
                    1e-12);
    assert_true(f->mesh_lo < f->lo && f->mesh_lo < truth && truth < f->mesh_hi);
    double coarse = r.mesh_difference;
    om_calibration_result_done(&r);
    put_strip("9, 5, 2");
    calibrate_strip(&r);
    assert_true(f->lo <= truth && truth <= f->hi);
    assert_near_rel(r.best[0], truth, 2e-3);
    assert_true(r.mesh_difference < 0.5 * coarse);  // a finer mesh owes less to itself
    om_calibration_result_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_problem_is_read),
        cmocka_unit_test(test_parameters_have_an_effect),
        cmocka_unit_test(test_points_of_a_cloud),
        cmocka_unit_test(test_wrong_files),
        cmocka_unit_test(test_allocations_fail),
        cmocka_unit_test(test_a_value_of_the_mesh_is_called_so),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
