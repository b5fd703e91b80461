// test_tissue_engine.c: sets of engines, capabilities, and an engine that is not omentum's.
//
// The engine here is as simple as can be checked by hand: every vertex makes the mean displacement of the prescribed
// ones, so a body is rigid and does not turn; a tool carries the weight.
#include "test_alloc.h"
#include "test_rig.h"

#include "omentum/heuristic.h"
#include "omentum/pbd.h"

typedef struct Rigid {  // options, as loaded
    double factor;      // of displacements
    char file[32];
} Rigid;

static int nloaded, nmodel, nwork;

static OmStatus rigid_load(const OmEngineInput* input, void** options) {
    Rigid* r = om_calloc(1, sizeof *r);
    if (!r) return OM_NO_MEMORY;
    r->factor = om_engine_get_number(input, "factor", 1);
    snprintf(r->file, sizeof r->file, "%s", input->file);
    *options = r;
    ++nloaded;
    return OM_OK;
}
static void rigid_unload(void* options) {
    om_free(options);
    --nloaded;
}

static OmStatus rigid_create(OmTissueModel* m) {
    double* data = om_alloc(1, sizeof *data);
    if (!data) return OM_NO_MEMORY;
    *data = ((const Rigid*)om_engine_options(m))->factor;
    om_engine_set_data(m, data);
    ++nmodel;
    return OM_OK;
}
static void rigid_destroy(OmTissueModel* m) {
    if (!om_engine_data(m)) return;
    om_free(om_engine_data(m));
    --nmodel;
}

static OmStatus rigid_create_work(const OmTissueModel* m, OmTissueWork* w) {
    int* nstep = om_calloc((size_t)om_tissue_mesh(m)->nvert, sizeof *nstep);
    if (!nstep) return OM_NO_MEMORY;
    om_engine_set_work_data(w, nstep);
    ++nwork;
    return OM_OK;
}
static void rigid_destroy_work(OmTissueWork* w) {
    om_free(om_engine_work_data(w));
    --nwork;
}

// The engine counts its steps in the state.
static size_t rigid_state_size(const OmTissueModel* m) {
    (void)m;
    return sizeof(int64_t);
}

static OmStatus rigid_step(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double h,
                           int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report) {
    (void)nobstacle, (void)obstacle;
    double *x = om_engine_x(s), *v = om_engine_v(s), factor = *(const double*)om_engine_data(m);
    int nvert = om_tissue_mesh(m)->nvert, num = 0;
    OmVec3 mean = {0, 0, 0}, goal;
    om_engine_save_state(s, w);
    for (int i = 0; i < nvert; ++i) {
        if (!om_engine_find_goal(s, i, &goal)) continue;
        mean = om_add(mean, om_sub(goal, om_load3(x, i)));
        ++num;
    }
    for (int i = 0; i < nvert; ++i) {
        bool is_held = om_engine_find_goal(s, i, &goal);
        OmVec3 p = om_madd(om_load3(x, i), num ? factor / num : 0, mean);
        if (is_held) p = goal;
        om_store3(v, i, om_scale(1 / h, om_sub(p, om_load3(x, i))));
        om_store3(x, i, p);
        OmVec3 carried = om_vec3(0, 0, is_held ? 9.81 / num : 0);
        om_store3(om_engine_tool_force(s), i, carried);
    }
    if (num == 0) {  // nothing holds it: it stays, and the step fails
        om_engine_restore_state(s, w);
        return om_error(OM_INVALID, "rigid: nothing holds the body");
    }
    ++*(int64_t*)om_engine_state_data(s);
    report->substeps = 1;
    om_engine_end_step(s, h);
    return OM_OK;
}

static const char* const number[] = {"factor", NULL};
static const OmTissueEngine rigid = {
    .version = OM_ENGINE_VERSION,
    .name = "rigid",
    .number = number,
    .has_forces = true,
    .needs_file = true,
    .load = rigid_load,
    .unload = rigid_unload,
    .create = rigid_create,
    .destroy = rigid_destroy,
    .create_work = rigid_create_work,
    .destroy_work = rigid_destroy_work,
    .step = rigid_step,
    .get_state_size = rigid_state_size,
};

// ---- tests --------------------------------------------------------------------------------------------

static void test_capabilities(void** state) {
    (void)state;
    const unsigned FORCES = OM_ENGINE_FORCES, TANGENT = OM_ENGINE_TANGENT;
    const unsigned STATICS = OM_ENGINE_STATICS, AMONG = OM_ENGINE_OBSTACLES;
    assert_int_equal(om_engine_capabilities(om_fem_engine()),
                     FORCES | TANGENT | STATICS | OM_ENGINE_STRESS);
    assert_int_equal(om_engine_capabilities(om_spring_engine()), FORCES | TANGENT | STATICS);
    assert_int_equal(om_engine_capabilities(om_chain_engine()), AMONG);
    assert_int_equal(om_engine_capabilities(om_pbd_engine()), AMONG | OM_ENGINE_PARTICLES);
    assert_int_equal(om_engine_capabilities(om_xpbd_engine()),
                     FORCES | AMONG | OM_ENGINE_PARTICLES);
    assert_int_equal(om_engine_capabilities(&rigid), FORCES | AMONG);
    assert_true(om_engine_uses(om_fem_engine(), "young"));
    assert_true(om_engine_uses(om_pbd_engine(), "cluster_radius"));
    assert_false(om_engine_uses(om_pbd_engine(), "young"));
    assert_false(om_engine_uses(om_chain_engine(), "rayleigh_mass"));
    assert_true(om_engine_uses(om_chain_engine(), "density"));
}

static void test_set(void** state) {
    (void)state;
    OmEngineSet set = {0};
    const OmTissueEngine* engine;
    assert_ok(om_engine_set_add(&set, om_fem_engine()));
    assert_ok(om_engine_set_add(&set, &rigid));
    assert_ok(om_engine_set_find(&set, "rigid", &engine));
    assert_ptr_equal(engine, &rigid);
    assert_status(om_engine_set_add(&set, &rigid), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "engine of this name"));
    assert_status(om_engine_set_find(&set, "rigit", &engine), OM_INVALID);
    assert_null(engine);
    assert_string_equal(om_error_message(),
                        "engine \"rigit\" is not known; did you mean \"rigid\"?; "
                        "engines: fem, rigid");
    assert_status(om_engine_set_find(&set, "pbd", &engine), OM_INVALID);  // not handed in
    OmTissueEngine bad = rigid;
    bad.unload = NULL;
    assert_status(om_engine_set_add(&set, &bad), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "load and unload"));
    assert_int_equal(set.nengine, 2);
    OmTissueEngine many[OM_MAX_ENGINE];
    char name[OM_MAX_ENGINE][8];
    for (int k = 2; k < OM_MAX_ENGINE; ++k) {
        snprintf(name[k], sizeof name[k], "e%d", k);
        many[k] = rigid;
        many[k].name = name[k];
        assert_ok(om_engine_set_add(&set, &many[k]));
    }
    bad = rigid;
    bad.name = "last";
    assert_status(om_engine_set_add(&set, &bad), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "32 engines already"));
}

static void rigid_box(TestRig* r, OmEngineInput* input) {
    static const OmEngineNumber half = {"factor", 0.5};
    rig_box(r, om_vec3(0, 0, 0), om_vec3(0.02, 0.02, 0.02), 2, 2, 2);
    *input = (OmEngineInput){.file = "model.txt", .nnumber = 1, .number = &half};
    r->def.engine = &rigid;
    r->def.input = input;
}

// A body is grasped and lifted: vertices, velocities, time, force, the engine's own bytes; a failed step leaves all.
static void test_step(void** state) {
    (void)state;
    TestRig r;
    OmEngineInput input;
    OmTissueReport report;
    OmTissueForces f;
    int nheld;
    rigid_box(&r, &input);
    rig_start(&r);
    assert_string_equal(((const Rigid*)om_engine_options(r.m))->file, "model.txt");
    uint64_t hash = om_tissue_state_hash(r.s);
    assert_status(om_tissue_step(r.m, r.s, r.w, 0.02, &report), OM_INVALID);
    assert_true(om_tissue_state_hash(r.s) == hash);
    OmPose tip = {om_vec3(0.02, 0.02, 0.02), om_quat_identity()};
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.001, &nheld));
    assert_int_equal(nheld, 1);
    tip.p.z += 0.004;
    assert_ok(om_tissue_move_grasp(r.s, 0, tip));
    assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, &report));
    for (int i = 0; i < r.mesh.nvert; ++i) {
        OmVec3 rest = om_load3(r.mesh.x, i), x = om_load3(om_tissue_x(r.s), i);
        bool is_held = om_tissue_held_by(r.s)[i] >= 0;
        assert_near(x.z - rest.z, is_held ? 0.004 : 0.002, 1e-15);
        assert_near(om_load3(om_tissue_v(r.s), i).z, (x.z - rest.z) / 0.02, 1e-12);
    }
    assert_near(om_tissue_time(r.s), 0.02, 0);
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_near(f.grasp[0].z, 9.81, 1e-12);
    assert_true(*(int64_t*)om_engine_state_data(r.s) == 1);
    assert_ok(om_tissue_step(r.m, r.s, r.w, 0.02, &report));  // the tool has reached its goal
    assert_near(om_load3(om_tissue_x(r.s), 0).z - r.mesh.x[2], 0.002, 1e-15);
    assert_true(*(int64_t*)om_engine_state_data(r.s) == 2);
    rig_done(&r);
    assert_true(nloaded == 0 && nmodel == 0 && nwork == 0);
}

// What the engine cannot do is refused by name.
static void test_refusals(void** state) {
    (void)state;
    TestRig r;
    OmEngineInput input;
    rigid_box(&r, &input);
    OmTissueModel* m;
    r.def.attachment_stiffness = 10;
    assert_status(om_tissue_create(&r.def, &m), OM_UNAVAILABLE);
    assert_non_null(strstr(om_error_message(), "\"rigid\" has no springs"));
    r.def.attachment_stiffness = 0;
    input.file = NULL;
    assert_status(om_tissue_create(&r.def, &m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "\"rigid\" needs a file"));
    r.def.options = &input;
    assert_status(om_tissue_create(&r.def, &m), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "both given"));
    r.def.options = NULL;
    input.file = "model.txt";
    rig_start(&r);
    assert_status(om_tissue_begin_step(r.m, r.s, r.w, 0.02), OM_UNAVAILABLE);
    assert_status(om_tissue_find_rest(r.m, r.s, r.w, 1e-3, 10, NULL), OM_UNAVAILABLE);
    double value[48];
    assert_status(om_tissue_get_measure(r.m, r.s, OM_VON_MISES, value), OM_UNAVAILABLE);
    rig_done(&r);
    assert_true(nloaded == 0 && nmodel == 0 && nwork == 0);
}

static void test_memory(void** state) {
    (void)state;
    TestRig r;
    OmEngineInput input;
    rigid_box(&r, &input);
    rig_attach_plane(&r, 2, 0);
    assert_true(test_failing_allocations(rig_create_and_step, &r.def, 1) > 5);
    assert_true(nloaded == 0 && nmodel == 0 && nwork == 0);
    om_tet_mesh_done(&r.mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_capabilities), cmocka_unit_test(test_set),
        cmocka_unit_test(test_step),         cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
