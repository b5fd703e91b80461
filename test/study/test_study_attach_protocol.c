// test_study_attach_protocol.c: exact strains, free bodies and failures of the solver; scores counted by hand.
#include "studies/study_attach_protocol.h"

#include <math.h>
#include <string.h>

#include "test_alloc.h"

typedef struct Bar {  // 60 x 20 x 20 mm, held at x = 0, grasped at x = 60 mm
    OmTetMesh mesh;
    AttachModel* model;
    int ngrasp, grasp[64];
    double goal[3 * 64];
    unsigned char attached[512];
    double x[3 * 512];
} Bar;

static void bar_begin(Bar* b, OmLaw law, double poisson) {
    memset(b, 0, sizeof *b);
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.06, 0.02, 0.02), 6, 2, 2, &b->mesh));
    assert_true(b->mesh.nvert <= 512);
    AttachModelDef def = om__attach_model_default_def(
        &b->mesh, (OmMaterial){.young = 3000, .poisson = poisson, .law = law});
    assert_ok(om__attach_model_create(&def, &b->model));
    for (int i = 0; i < b->mesh.nvert; ++i) {
        double x = b->mesh.x[3 * i];
        b->attached[i] = x < 1e-9;
        if (x > 0.06 - 1e-9) b->grasp[b->ngrasp++] = i;
    }
    assert_int_equal(b->ngrasp, 9);
}

static void bar_end(Bar* b) {
    om__attach_model_destroy(b->model);
    om_tet_mesh_done(&b->mesh);
}

static void set_goal(Bar* b, OmPose move, OmVec3 stretch) {
    for (int i = 0; i < b->ngrasp; ++i) {
        OmVec3 p = om_load3(b->mesh.x, b->grasp[i]);
        p = om_vec3(p.x * stretch.x, p.y * stretch.y, p.z * stretch.z);
        om_store3(b->goal, i, om_pose_apply(move, p));
    }
}

static AttachMove move_of(const Bar* b) {
    return (AttachMove){b->ngrasp, b->grasp, b->goal, b->attached};
}

static const OmPose nowhere = {{0, 0, 0}, {0, 0, 0, 1}};
static const OmVec3 as_it_was = {1, 1, 1};

// Without lateral contraction (Poisson's ratio 0) the strain of a bar that is pulled by 30 % is uniform: x' = 1.3 x.
static void test_uniform(void** unused) {
    (void)unused;
    Bar b;
    AttachSolve solve;
    bar_begin(&b, OM_NEO_HOOKEAN, 0);
    set_goal(&b, nowhere, om_vec3(1.3, 1, 1));
    AttachMove move = move_of(&b);
    b.attached[b.grasp[0]] = 1;  // the grasp wins
    assert_ok(om__attach_model_solve(b.model, &move, b.x, &solve));
    assert_true(solve.is_converged && !solve.is_loose && solve.load == 1 && !solve.reason[0]);
    for (int i = 0; i < b.mesh.nvert; ++i) {
        assert_near(b.x[3 * i], 1.3 * b.mesh.x[3 * i], 1e-6);  // m, by the tolerance of 1e-4
        assert_near(b.x[3 * i + 1], b.mesh.x[3 * i + 1], 1e-6);
        assert_near(b.x[3 * i + 2], b.mesh.x[3 * i + 2], 1e-6);
    }
    bar_end(&b);
}

// A free body follows the grasp rigidly, also through a quarter turn, and the same model then serves another set.
static void test_free_body(void** unused) {
    (void)unused;
    Bar b;
    AttachSolve solve;
    bar_begin(&b, OM_NEO_HOOKEAN, 0.45);
    OmPose turn = {om_vec3(0.02, 0.01, 0.04), om_quat_axis_angle(om_vec3(0, 1, 0), 0.5 * OM_PI)};
    set_goal(&b, turn, as_it_was);
    AttachMove move = move_of(&b);
    move.attached = NULL;
    assert_ok(om__attach_model_solve(b.model, &move, b.x, &solve));
    assert_true(solve.is_converged && !solve.is_loose);
    for (int i = 0; i < b.mesh.nvert; ++i) {
        OmVec3 want = om_pose_apply(turn, om_load3(b.mesh.x, i));
        assert_near(om_distance(om_load3(b.x, i), want), 0, 2e-5);
    }
    // held, then pulled by 10 mm along the bar: the held end stays, the grasped end arrives
    set_goal(&b, (OmPose){{0.01, 0, 0}, {0, 0, 0, 1}}, as_it_was);
    move.attached = b.attached;
    assert_ok(om__attach_model_solve(b.model, &move, b.x, &solve));
    assert_true(solve.is_converged);
    for (int i = 0; i < b.mesh.nvert; ++i)
        if (b.attached[i]) assert_true(om_distance(om_load3(b.x, i), om_load3(b.mesh.x, i)) == 0);
    for (int i = 0; i < b.ngrasp; ++i)
        assert_near(om_distance(om_load3(b.x, b.grasp[i]), om_load3(b.goal, i)), 0, 1e-12);
    bar_end(&b);
}

// On straight ways the corners of an end that turns by 170 degrees would meet in the middle and crush the bar.
static void test_turn(void** unused) {
    (void)unused;
    Bar b;
    AttachSolve solve;
    bar_begin(&b, OM_NEO_HOOKEAN, 0.4);
    OmQuat q = om_quat_axis_angle(om_vec3(1, 0, 0), 170 * OM_PI / 180);
    OmVec3 middle = om_vec3(0.06, 0.01, 0.01);
    OmPose turn = {om_sub(om_vec3(0.09, 0.01, 0.01), om_quat_rotate(q, middle)), q};
    set_goal(&b, turn, as_it_was);
    AttachMove move = move_of(&b);
    assert_ok(om__attach_model_solve(b.model, &move, b.x, &solve));
    assert_true(solve.is_converged && solve.load == 1 && solve.min_volume > 0);
    for (int i = 0; i < b.ngrasp; ++i)
        assert_near(om_distance(om_load3(b.x, b.grasp[i]), om_load3(b.goal, i)), 0, 1e-12);
    // in the middle of the bar the section has turned by about half
    for (int i = 0; i < b.mesh.nvert; ++i) {
        OmVec3 p = om_load3(b.mesh.x, i);
        if (fabs(p.x - 0.03) > 1e-9 || p.y > 1e-9 || fabs(p.z - 0.01) > 1e-9) continue;
        double angle = atan2(b.x[3 * i + 2] - 0.01, b.x[3 * i + 1] - 0.01);  // at rest: pi
        assert_near(fabs(remainder(angle - OM_PI, 2 * OM_PI)), 85 * OM_PI / 180, 0.2);
    }
    bar_end(&b);
}

// One grasped vertex cannot stop a turn: soft springs hold the body, which is moved without strain.
static void test_loose(void** unused) {
    (void)unused;
    Bar b;
    AttachSolve solve;
    bar_begin(&b, OM_NEO_HOOKEAN, 0.45);
    set_goal(&b, (OmPose){{0, 0, 0.01}, {0, 0, 0, 1}}, as_it_was);
    AttachMove move = move_of(&b);
    move.ngrasp = 1;
    move.attached = NULL;
    assert_ok(om__attach_model_solve(b.model, &move, b.x, &solve));
    assert_true(solve.is_converged && solve.is_loose);
    for (int t = 0; t < b.mesh.ntet; ++t)  // edges keep their lengths
        for (int a = 0; a < 3; ++a) {
            int i = b.mesh.tet_vert[4 * t + a], j = b.mesh.tet_vert[4 * t + a + 1];
            double l = om_distance(om_load3(b.mesh.x, i), om_load3(b.mesh.x, j));
            assert_near(om_distance(om_load3(b.x, i), om_load3(b.x, j)), l, 1e-3 * l);
        }
    move.ngrasp = 3;  // the first row of the grasped end
    assert_ok(om__attach_model_solve(b.model, &move, b.x, &solve));
    assert_true(solve.is_converged && solve.is_loose);
    bar_end(&b);
}

// Weight without a board: the free end of a held bar sinks by about rho g A L^4 / (8 E I).
static void test_weight(void** unused) {
    (void)unused;
    Bar b;
    AttachSolve solve;
    bar_begin(&b, OM_LINEAR, 0.3);
    om__attach_model_destroy(b.model);
    AttachModelDef def = om__attach_model_default_def(
        &b.mesh, (OmMaterial){.young = 3e5, .poisson = 0.3, .law = OM_LINEAR});
    def.gravity = om_vec3(0, 0, -9.81);
    assert_ok(om__attach_model_create(&def, &b.model));
    // one vertex of the held end counts as the grasp
    int first = 0;
    while (!b.attached[first]) ++first;
    AttachMove move = {1, &first, b.mesh.x + 3 * first, b.attached};
    assert_ok(om__attach_model_solve(b.model, &move, b.x, &solve));
    assert_true(solve.is_converged);
    double sag = 0, want = 1000 * 9.81 * 4e-4 * pow(0.06, 4) / (8 * 3e5 * 4e-4 * 4e-4 / 12);
    for (int i = 0; i < b.ngrasp; ++i)
        sag += (b.mesh.x[3 * b.grasp[i] + 2] - b.x[3 * b.grasp[i] + 2]) / b.ngrasp;
    assert_true(sag > 0.4 * want &&
                sag < 1.3 * want);  // linear tetrahedra are too stiff in bending
    bar_end(&b);
}

// A grasp that crosses the held end cannot be solved: the result says so and keeps what was reached.
static void test_failure(void** unused) {
    (void)unused;
    Bar b;
    AttachSolve solve;
    bar_begin(&b, OM_ST_VENANT_KIRCHHOFF, 0.45);
    set_goal(&b, (OmPose){{-0.3, 0, 0}, {0, 0, 0, 1}}, as_it_was);
    AttachMove move = move_of(&b);
    assert_ok(om__attach_model_solve(b.model, &move, b.x, &solve));
    assert_true(!solve.is_converged && solve.load < 1 && solve.reason[0]);
    for (int i = 0; i < 3 * b.mesh.nvert; ++i) assert_true(isfinite(b.x[i]));
    move.ngrasp = 0;
    assert_status(om__attach_model_solve(b.model, &move, b.x, &solve), OM_INVALID);
    move.ngrasp = 1;
    const int outside = b.mesh.nvert;
    move.grasp = &outside;
    assert_status(om__attach_model_solve(b.model, &move, b.x, &solve), OM_INVALID);
    move.grasp = b.grasp;
    b.goal[0] = NAN;
    assert_status(om__attach_model_solve(b.model, &move, b.x, &solve), OM_INVALID);
    bar_end(&b);
}

static OmStatus solve_bar(void* ctx) {
    Bar* b = ctx;
    AttachModel* model;
    AttachSolve solve;
    AttachModelDef def = om__attach_model_default_def(&b->mesh, (OmMaterial){.young = 3000});
    OM_TRY(om__attach_model_create(&def, &model));
    AttachMove move = move_of(b);
    OmStatus status = om__attach_model_solve(model, &move, b->x, &solve);
    om__attach_model_destroy(model);
    return status;
}

static void test_memory(void** unused) {
    (void)unused;
    Bar b;
    bar_begin(&b, OM_COROTATIONAL, 0.45);
    set_goal(&b, nowhere, om_vec3(1.1, 1, 1));
    assert_true(test_failing_allocations(solve_bar, &b, 1) > 20);
    bar_end(&b);
}

// ---- scores -----------------------------------------------------------------------------------------

static void test_scores(void** unused) {
    (void)unused;
    const unsigned char truth[6] = {1, 1, 1, 0, 0, 0}, found[6] = {1, 1, 0, 1, 0, 0};
    const unsigned char none[6] = {0}, every[6] = {1, 1, 1, 1, 1, 1};
    double dsc, tpr;
    om__attach_score(6, NULL, found, truth, &dsc, &tpr);  // 2 in both, 3 found, 3 true
    assert_near(dsc, 2.0 / 3, 1e-15);
    assert_near(tpr, 2.0 / 3, 1e-15);
    om__attach_score(6, NULL, truth, truth, &dsc, &tpr);
    assert_true(dsc == 1 && tpr == 1);
    om__attach_score(6, NULL, none, truth, &dsc, &tpr);
    assert_true(dsc == 0 && tpr == 0);
    om__attach_score(6, NULL, found, none, &dsc, &tpr);
    assert_true(dsc == 0 && tpr == 0);
    om__attach_score(6, NULL, every, truth, &dsc, &tpr);  // 2 * 3 / (6 + 3)
    assert_near(dsc, 2.0 / 3, 1e-15);
    assert_true(tpr == 1);
    const double area[6] = {2, 1, 5, 4, 1, 1};  // both 3, found 7, true 8
    om__attach_score(6, area, found, truth, &dsc, &tpr);
    assert_near(dsc, 6.0 / 15, 1e-15);
    assert_near(tpr, 3.0 / 8, 1e-15);
    // cells: 7 found and true (two vertices), 3 true, 9 found; the vertex of cell -1 does not count
    const int cell[6] = {7, 7, 3, 9, 0, -1};
    const unsigned char also[6] = {1, 0, 0, 1, 0, 1};
    assert_ok(om__attach_score_cells(6, cell, also, truth, &dsc, &tpr));
    assert_near(dsc, 2.0 / 4, 1e-15);
    assert_near(tpr, 1.0 / 2, 1e-15);
    const int outside[6] = {-1, -1, -1, -1, -1, -1};
    assert_ok(om__attach_score_cells(6, outside, also, truth, &dsc, &tpr));
    assert_true(dsc == 0 && tpr == 0);
}

static void test_errors(void** unused) {
    (void)unused;
    const double x[6] = {0, 0, 0, 1, 1, 1}, shifted[6] = {3, 0, 4, 4, 1, 5};
    const double one[6] = {0, 0, 0, 1, 1, 8};
    double ave, mve;
    om__attach_error(2, x, shifted, &ave, &mve);
    assert_near(ave, 5, 1e-15);
    assert_near(mve, 5, 1e-15);
    om__attach_error(2, x, one, &ave, &mve);
    assert_near(ave, 3.5, 1e-15);
    assert_near(mve, 7, 1e-15);
}

static void test_areas(void** unused) {
    (void)unused;
    double x[12] = {0, 0, 0, 2, 0, 0, 0, 3, 0, 2, 3, 0}, area[4];
    int tri[6] = {0, 1, 2, 1, 3, 2};
    OmSurface s = {4, 2, x, tri};
    om__attach_areas(&s, area);  // triangles of 3 each
    assert_near(area[0], 1, 1e-15);
    assert_near(area[1], 2, 1e-15);
    assert_near(area[2], 2, 1e-15);
    assert_near(area[3], 1, 1e-15);
}

static void test_quartiles(void** unused) {
    (void)unused;
    double value[5] = {0.5, 0.1, 0.4, 0.2, 0.3};
    char text[64];
    StudySample q = om__study_sample(value, 5);
    assert_true(q.n == 5 && q.lower == 0.2 && q.median == 0.3 && q.upper == 0.4);
    om__sample_print(text, sizeof text, 100, "%.0f", q);
    assert_string_equal(text, "30 (20-40)");
    om__sample_print(text, sizeof text, 100, "%.0f", om__study_sample(value, 0));
    assert_string_equal(text, "-");
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_uniform),   cmocka_unit_test(test_free_body),
        cmocka_unit_test(test_turn),      cmocka_unit_test(test_loose),
        cmocka_unit_test(test_weight),    cmocka_unit_test(test_failure),
        cmocka_unit_test(test_memory),    cmocka_unit_test(test_scores),
        cmocka_unit_test(test_errors),    cmocka_unit_test(test_areas),
        cmocka_unit_test(test_quartiles),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
