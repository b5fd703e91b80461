// test_tissue_input.c: every wrong input ends with one sentence that names it, and changes nothing.
#include "test_rig.h"

#include "omentum/heuristic.h"
#include "omentum/pbd.h"

typedef void (*Spoil)(TestRig* r);

static void expect_invalid(Spoil spoil, const char* word) {
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.02, 0.02, 0.02), 2, 2, 2);
    r.def.mesh = &r.mesh;
    spoil(&r);
    int64_t alive = om_alloc_alive();
    assert_status(om_tissue_create(&r.def, &r.m), OM_INVALID);
    assert_null(r.m);
    const char* message = om_error_message();
    if (!strstr(message, word)) fail_msg("no \"%s\" in: %s", word, message);
    assert_null(strchr(message, '\n'));
    assert_true(om_alloc_alive() == alive);
    rig_done(&r);
}

static void no_cookie(TestRig* r) { r->def.cookie = 0; }
static void no_mesh(TestRig* r) { r->def.mesh = NULL; }
static void version_engine(TestRig* r) {
    static OmTissueEngine old;
    old = *om_fem_engine();
    old.version = OM_ENGINE_VERSION - 1;
    r->def.engine = &old;
}
static void both_kinds(TestRig* r) {
    static OmTissueEngine both;
    both = *om_fem_engine();
    both.step = om_chain_engine()->step;
    r->def.engine = &both;
}
static void fem_file(TestRig* r) {
    static const OmEngineInput input = {.file = "weights.safetensors"};
    r->def.input = &input;
}
static void chain_quadratic(TestRig* r) {
    r->def.engine = om_chain_engine();
    r->def.element = OM_ELEMENT_QUADRATIC;
}
static void pbd_quadratic(TestRig* r) {
    r->def.engine = om_pbd_engine();
    r->def.element = OM_ELEMENT_QUADRATIC;
}
static void null_engine(TestRig* r) { r->def.engine = NULL; }
static void poisson_half(TestRig* r) { r->def.material_default.poisson = 0.5; }
static void poisson_nan(TestRig* r) { r->def.material_default.poisson = (double)NAN; }
static void young_zero(TestRig* r) { r->def.material_default.young = 0; }
static void young_inf(TestRig* r) { r->def.material_default.young = (double)INFINITY; }
static void density_negative(TestRig* r) { r->def.density = -1000; }
static void density_nan(TestRig* r) { r->def.density = (double)NAN; }
static void damping_negative(TestRig* r) { r->def.rayleigh_mass = -1; }
static void stiffness_nan(TestRig* r) { r->def.rayleigh_stiffness = (double)NAN; }
static void gravity_nan(TestRig* r) { r->def.gravity.y = (double)NAN; }
static void spring_negative(TestRig* r) { r->def.attachment_stiffness = -5; }
static void no_materials(TestRig* r) { r->def.nmaterial = 2; }
static void label_too_large(TestRig* r) {
    static const OmMaterial material[2] = {{.young = 3000, .poisson = 0.45},
                                           {.young = 3000, .poisson = 0.45}};
    r->def.nmaterial = 2;
    r->def.material = material;
    r->mesh.tet_label[7] = 2;
}
static void second_material(TestRig* r) {
    static const OmMaterial material[2] = {{.young = 3000, .poisson = 0.45},
                                           {.young = -3000, .poisson = 0.45}};
    r->def.nmaterial = 2;
    r->def.material = material;
}
static void element_inverted(TestRig* r) {
    int v = r->mesh.tet_vert[4 * 5];
    r->mesh.tet_vert[4 * 5] = r->mesh.tet_vert[4 * 5 + 1];
    r->mesh.tet_vert[4 * 5 + 1] = v;
}
static void vertex_nan(TestRig* r) { r->mesh.x[3 * 4 + 1] = (double)NAN; }
static void index_outside(TestRig* r) { r->mesh.tet_vert[9] = 1000; }
static void vertex_unused(TestRig* r) {
    for (int k = 0; k < 4 * r->mesh.ntet; ++k)
        if (r->mesh.tet_vert[k] == 0) {
            memcpy(r->mesh.tet_vert + k / 4 * 4, r->mesh.tet_vert + 4 * (r->mesh.ntet - 1),
                   4 * sizeof(int));
            k = k / 4 * 4 - 1;
        }
}
static void no_iterations(TestRig* r) { r->def.solver.max_iterations = 0; }

static void test_definitions(void** context) {
    (void)context;
    const struct {
        Spoil spoil;
        const char* word;
    } list[] = {{no_cookie, "om_tissue_default_def"},
                {no_mesh, "mesh"},
                {version_engine, "version 0"},
                {both_kinds, "either assemble or step"},
                {fem_file, "reads no file, but weights.safetensors"},
                {chain_quadratic, "element: engine \"chainmail\" has no quadratic elements"},
                {pbd_quadratic, "element: engine \"pbd\" has no quadratic elements"},
                {null_engine, "engine"},
                {poisson_half, "poisson is 0.5"},
                {poisson_nan, "poisson"},
                {young_zero, "young is 0"},
                {young_inf, "young"},
                {density_negative, "density is -1000"},
                {density_nan, "density"},
                {damping_negative, "rayleigh_mass is -1"},
                {stiffness_nan, "rayleigh_stiffness"},
                {gravity_nan, "gravity"},
                {spring_negative, "attachment_stiffness is -5"},
                {no_materials, "material is null"},
                {label_too_large, "element 7 has label 2"},
                {second_material, "material[1].young is -3000"},
                {element_inverted, "5"},
                {vertex_nan, "4"},
                {index_outside, "1000"},
                {vertex_unused, "vertex 0"}};
    for (size_t k = 0; k < sizeof list / sizeof *list; ++k)
        expect_invalid(list[k].spoil, list[k].word);
}

static void test_solver_definition(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.02, 0.02, 0.02), 2, 2, 2);
    r.def.mesh = &r.mesh;
    no_iterations(&r);
    OmStatus status = om_tissue_create(&r.def, &r.m);
    if (status == OM_OK) status = om_tissue_work_create(r.m, &r.w);
    assert_int_equal(status, OM_INVALID);
    assert_non_null(strstr(om_error_message(), "max_iterations"));
    assert_null(r.w);
    rig_done(&r);
}

// Steps and positions that cannot be: the state keeps its bytes, and the next good step works.
static void test_states(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.02, 0.02, 0.02), 2, 2, 2);
    rig_attach_plane(&r, 2, 0);
    rig_start(&r);
    uint64_t before = om_tissue_state_hash(r.s);
    const double step[] = {0, -0.01, (double)NAN, (double)INFINITY, 11};
    for (size_t k = 0; k < sizeof step / sizeof *step; ++k) {
        assert_status(om_tissue_step(r.m, r.s, r.w, step[k], NULL), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "time step"));
    }
    double* x = om_alloc(3 * (size_t)r.mesh.nvert, sizeof *x);
    memcpy(x, r.mesh.x, 3 * (size_t)r.mesh.nvert * sizeof *x);
    x[3 * 5 + 2] = (double)INFINITY;
    assert_status(om_tissue_set_x(r.m, r.s, x, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertex 5"));
    assert_status(om_tissue_set_x(r.m, r.s, r.mesh.x, x), OM_INVALID);
    assert_status(om_tissue_set_x(r.m, r.s, NULL, NULL), OM_INVALID);
    assert_true(om_tissue_state_hash(r.s) == before);
    // stages out of order
    assert_status(om_tissue_solve_step(r.m, r.s, r.w, NULL), OM_INVALID);
    assert_status(om_tissue_end_step(r.m, r.s, r.w), OM_INVALID);
    assert_ok(om_tissue_begin_step(r.m, r.s, r.w, 0.02));
    assert_status(om_tissue_end_step(r.m, r.s, r.w), OM_INVALID);
    assert_true(om_tissue_state_hash(r.s) == before);
    // a force that is not a number is said, and nothing moves
    om_tissue_external_force(r.s)[3 * 20 + 1] = (double)NAN;
    before = om_tissue_state_hash(r.s);
    assert_status(om_tissue_step(r.m, r.s, r.w, 0.02, NULL), OM_INVALID);
    assert_true(strlen(om_error_message()) > 10);
    assert_true(om_tissue_state_hash(r.s) == before);
    om_tissue_external_force(r.s)[3 * 20 + 1] = 0;
    assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
    om_free(x);
    rig_done(&r);
}

// Too few iterations: said, with the residual, and the best iterate is taken.
static void test_not_converged(void** context) {
    (void)context;
    TestRig r;
    rig_box(&r, om_vec3(0, 0, 0), om_vec3(0.06, 0.03, 0.01), 12, 6, 2);
    rig_attach_plane(&r, 0, 0);
    r.def.solver.preconditioner = OM_BLOCK_JACOBI;
    r.def.solver.max_iterations = 3;
    rig_start(&r);
    OmTissueReport report;
    assert_status(om_tissue_step(r.m, r.s, r.w, 0.02, &report), OM_NOT_CONVERGED);
    assert_int_equal(report.iterations, 3);
    assert_int_equal(report.substeps, 1);
    printf("residual after 3 iterations: %.3g\n", report.residual);
    assert_true(report.residual > 1e-6 && report.residual < 100);
    assert_near(om_tissue_time(r.s), 0.02, 0);
    rig_done(&r);
}

// ---- steps that are cut -------------------------------------------------------------------------------

static OmStatus solve_if_short(void* ctx, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                               double h, OmTissueReport* report) {
    if (h > *(const double*)ctx) return om_error(OM_INVALID, "too long for this test");
    return om_tissue_solve_step(m, s, w, report);
}

// What cannot be solved in one step is solved in halves, to the bytes of shorter steps, and the tool arrives all
// the same. An unsolvable step does not change the state.
static void test_cut_steps(void** context) {
    (void)context;
    TestRig r, q;
    TestRig* both[2] = {&r, &q};
    OmPose tip = {om_vec3(0.06, 0.015, 0.01), om_quat_identity()};
    for (int k = 0; k < 2; ++k) {
        rig_box(both[k], om_vec3(0, 0, 0), om_vec3(0.06, 0.03, 0.01), 6, 3, 1);
        rig_attach_plane(both[k], 0, 0);
        rig_start(both[k]);
        assert_ok(om_tissue_grasp(both[k]->m, both[k]->s, 0, tip, 0.008, NULL));
    }
    double longest = 0.006;
    OmTissueReport report;
    tip.p.z += 0.004;
    assert_ok(om_tissue_move_grasp(r.s, 0, tip));
    assert_ok(om_tissue_step_with(r.m, r.s, r.w, 0.02, solve_if_short, &longest, &report));
    assert_int_equal(report.substeps, 4);
    tip.p.z -= 0.004;
    for (int n = 0; n < 4; ++n) {
        tip.p.z += 0.001;
        assert_ok(om_tissue_move_grasp(q.s, 0, tip));
        assert_ok(om_tissue_step(q.m, q.s, q.w, 0.005, NULL));
    }
    assert_near(om_tissue_time(r.s), 0.02, 1e-15);
    for (int k = 0; k < 3 * r.mesh.nvert;
         ++k)  // tips differ by rounding, which the solver carries on
        assert_near(om_tissue_x(r.s)[k], om_tissue_x(q.s)[k], 1e-7);

    uint64_t before = om_tissue_state_hash(r.s);
    longest = 0;
    assert_status(om_tissue_step_with(r.m, r.s, r.w, 0.02, solve_if_short, &longest, NULL),
                  OM_INVALID);
    assert_non_null(strstr(om_error_message(), "too long for this test"));
    assert_true(om_tissue_state_hash(r.s) == before);
    assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, NULL));
    rig_done(&r);
    rig_done(&q);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_definitions), cmocka_unit_test(test_solver_definition),
        cmocka_unit_test(test_states), cmocka_unit_test(test_not_converged),
        cmocka_unit_test(test_cut_steps)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
