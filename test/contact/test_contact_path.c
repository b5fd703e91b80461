// test_contact_path.c: probes along paths: nothing missed, friction, the same bytes, memory, bad input.
#include "test_alloc.h"
#include "test_press_rig.h"

static void make_soft_block(PressRig* p, int nx, int ny, int nz) {
    make_block(p, nx, ny, nz);
    p->r.def.solver.tolerance = 1e-4;
    p->r.def.material_default.law = OM_NEO_HOOKEAN;
}

static void start(PressRig* p, const OmProbeDef* shape, OmPressMethod method, double friction) {
    rig_start(&p->r);
    assert_ok(om_probe_create(shape, &p->probe));
    OmPressDef def = om_press_default_def(p->probe);
    def.method = method;
    def.friction = friction;
    assert_ok(om_press_create(&def, p->r.m, &p->press));
}

static OmPose at(double x, double z) {
    OmPose pose = {om_vec3(x, 0.05, z), om_quat_identity()};
    return pose;
}

static OmPressReport go(PressRig* p, OmPose pose, double h) {
    OmPressReport report;
    OmStatus status = om_press_step(p->press, p->r.m, p->r.s, p->r.w, pose, h, &report);
    if (status != OM_OK) fail_msg("z = %.5f: %s", pose.p.z, om_error_message());
    return report;
}

// 20 mm at the thesis's 0.01 m/s: every point is looked at by the formula of the sphere, in every step.
static void test_nothing_missed(void** test) {
    (void)test;
    for (int method = 0; method < 3; ++method) {
        PressRig p;
        make_soft_block(&p, 8, 7, 4);
        OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
        start(&p, &shape, (OmPressMethod)method, 0);
        assert_ok(om_press_place(p.press, p.r.m, p.r.s, at(0.06, 0.075)));
        int n = om_press_surface(p.press)->nvert, max = 0;
        double *x = om_alloc(3 * (size_t)n, sizeof *x), deepest = 0;
        for (int k = 0; k < 100; ++k) {
            OmPose pose = at(0.06, 0.075 - 0.0002 * (k + 1));
            OmPressReport report = go(&p, pose, H);
            om_embedding_eval(om_press_embedding(p.press), om_tissue_x(p.r.s), x);
            double in = 0;
            for (int i = 0; i < n; ++i)
                in = fmax(in, shape.radius - om_distance(om_load3(x, i), pose.p));
            assert_near(in, report.penetration, 1e-12);
            deepest = fmax(deepest, in);
            max = report.ncontact > max ? report.ncontact : max;
            if (k >= 5)
                assert_true(report.ncontact > 0 && report.force.z > 0);  // 1 mm: a point or more
        }
        assert_below(deepest, 1e-4);  // the bar is 0.5 mm
        assert_true(max >= 5);
        om_free(x);
        done(&p);
    }
}

// A plate of 2 mm that goes 15 mm down in one step is nowhere inside the tissue: it takes it along.
// Tissue that lies on a probe and rushes at it ends the step outside, as deep as resting tissue at most: how deep it
// would go says nothing of how deep it may.
static void test_rush(void** test) {
    (void)test;
    for (int method = 0; method < 2; ++method) {
        PressRig p;
        make_soft_block(&p, 8, 7, 4);
        OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
        start(&p, &shape, (OmPressMethod)method, 0);
        assert_ok(om_press_place(p.press, p.r.m, p.r.s, at(0.06, 0.075)));
        for (int k = 0; k < 20; ++k) go(&p, at(0.06, 0.075 - 0.0004 * (k + 1)), H);
        const double* x = om_tissue_x(p.r.s);
        double* v = om_calloc(3 * (size_t)p.r.mesh.nvert, sizeof *v);
        for (int i = 0; i < p.r.mesh.nvert; ++i) v[3 * i + 2] = x[3 * i + 2] > 0.02 ? 0.5 : 0;
        assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, v));
        OmPressReport report = go(&p, at(0.06, 0.067), H);
        assert_true(report.ncontact > 0);
        assert_below(report.penetration, 2.5e-4);
        om_free(v);
        done(&p);
    }
}

static void test_thin_and_fast(void** test) {
    (void)test;
    for (int method = 0; method < 2; ++method) {
        PressRig p;
        make_soft_block(&p, 8, 7, 4);
        OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);
        shape.size = om_vec3(0.04, 0.04, 0.002);
        start(&p, &shape, (OmPressMethod)method, 0);
        assert_ok(om_press_place(p.press, p.r.m, p.r.s, at(0.06, 0.052)));
        OmPressReport report = go(&p, at(0.06, 0.037), H);
        const OmEmbedding* e = om_press_embedding(p.press);
        const double* rest = om_press_surface(p.press)->x;
        double* x = om_alloc(3 * (size_t)e->npoint, sizeof *x);
        om_embedding_eval(e, om_tissue_x(p.r.s), x);
        int num = 0;
        for (int i = 0; i < e->npoint; ++i) {
            OmVec3 q = om_sub(om_load3(rest, i), om_vec3(0.06, 0.05, 0.05));
            if (fabs(q.x) > 0.018 || fabs(q.y) > 0.018 || fabs(q.z) > 1e-9) continue;
            assert_below(x[3 * i + 2], 0.037 + 1e-3);
            ++num;
        }
        assert_true(num > 5 && report.ncontact > 2 && report.penetration < 1e-3);
        om_free(x);
        done(&p);
    }
}

// A flat probe dragged sideways: what it feels aside is the friction coefficient times what it feels up.
static void test_friction(void** test) {
    (void)test;
    const double mu = 0.3;
    for (int method = 0; method < 2; ++method) {
        PressRig p;
        make_soft_block(&p, 8, 7, 4);
        OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
        shape.radius = 0.2;  // flat where it touches: its normals lean by 0.07 at most
        start(&p, &shape, (OmPressMethod)method, mu);
        assert_ok(om_press_place(p.press, p.r.m, p.r.s, at(0.06, 0.25)));
        OmPressReport report = {0};
        for (int k = 0; k < 20; ++k) report = go(&p, at(0.06, 0.25 - 0.00005 * (k + 1)), H);
        assert_below(fabs(report.force.x), 0.2 * report.force.z);  // less than it can: it sticks
        for (int k = 0; k < 150; ++k) {
            report = go(&p, at(0.06 + 0.0002 * (k + 1), 0.249), H);
            double aside = hypot(report.force.x, report.force.y);
            assert_below(aside, (mu + 0.07) * report.force.z);
        }
        printf("dragged: %.4f N aside, %.4f N up\n", -report.force.x, report.force.z);
        assert_near_rel(-report.force.x, mu * report.force.z, 0.05);
        done(&p);
    }
}

// ---- the same bytes, memory, input ------------------------------------------------------------------

static uint64_t press_hash(PressRig* p) {
    uint64_t hash = OM_HASH_SEED;
    om_tissue_state_reset(p->r.m, p->r.s);
    assert_ok(om_press_place(p->press, p->r.m, p->r.s, at(0.06, 0.05)));
    for (int k = 0; k < 8; ++k) {
        OmPressReport report = go(p, at(0.06 + 0.0002 * k, 0.05 - 0.0005 * (k + 1)), H);
        hash = om_hash(&report.force, sizeof report.force, hash);
        hash = om_hash(report.push, 3 * (size_t)report.ncontact * sizeof(double), hash);
    }
    return om_hash(om_tissue_x(p->r.s), 3 * (size_t)p->r.mesh.nvert * sizeof(double), hash);
}

// Again after a reset, from a snapshot, and by any number of workers; no step but the first takes memory.
static void test_same_bytes(void** test) {
    (void)test;
    for (int method = 0; method < 3; ++method) {
        uint64_t first = 0;
        for (int nworker = 1; nworker <= 2; ++nworker) {
            PressRig p;
            make_soft_block(&p, 8, 7, 4);
            p.r.def.solver.nworker = nworker;
            OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);
            start(&p, &shape, (OmPressMethod)method, method == OM_PRESS_MULTIPLIERS ? 0.2 : 0);
            uint64_t hash = press_hash(&p);
            if (nworker == 1) first = hash;
            assert_true(hash == first);
            assert_true(press_hash(&p) == first);
            OmPose here = om_press_pose(p.press);
            size_t size = om_tissue_state_size(p.r.m);
            void* before = om_alloc(1, size);
            memcpy(before, p.r.s, size);
            go(&p, at(0.0615, 0.0455), H);
            uint64_t once = om_tissue_state_hash(p.r.s);
            memcpy(p.r.s, before, size);
            if (method != OM_PRESS_PRESCRIBED) {  // its area is where it was put down
                assert_ok(om_press_place(p.press, p.r.m, p.r.s, here));
                test_count_begin();
                go(&p, at(0.0615, 0.0455), H);
                assert_int_equal(test_count_end(), 0);
                assert_true(om_tissue_state_hash(p.r.s) == once);
            }
            om_free(before);
            done(&p);
        }
    }
}

// The thesis's variant, columns kept for five steps, ends where the other does.
static void test_reuse(void** test) {
    (void)test;
    double force[2];
    int column[2] = {0, 0};
    for (int run = 0; run < 2; ++run) {
        PressRig p;
        make_soft_block(&p, 8, 7, 4);
        p.r.def.solver.tolerance = 1e-6;
        OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
        rig_start(&p.r);
        assert_ok(om_probe_create(&shape, &p.probe));
        OmPressDef def = om_press_default_def(p.probe);
        def.method = OM_PRESS_MULTIPLIERS;
        def.reuse = run == 0 ? 1 : 5;
        def.tolerance = 1e-6;
        assert_ok(om_press_create(&def, p.r.m, &p.press));
        assert_ok(om_press_place(p.press, p.r.m, p.r.s, at(0.06, 0.075)));
        for (int k = 0; k < 40; ++k) {
            OmPressReport report = go(&p, at(0.06, 0.075 - 0.0003 * (k + 1)), H);
            force[run] = report.force.z;
            column[run] += report.ncolumn;
        }
        done(&p);
    }
    printf("columns in 40 steps: %d, kept for five: %d\n", column[0], column[1]);
    assert_near_rel(force[0], force[1], 1e-4);
    assert_true(3 * column[1] < column[0]);
}

typedef struct Scene {
    TestRig* r;
    OmPressMethod method;
    bool has_faces;
} Scene;

static OmStatus press_with_memory(void* ctx) {
    const Scene* scene = ctx;
    OmProbe* probe = NULL;
    OmPress* press = NULL;
    OmTissueWork* work = NULL;
    OmStatus status = OM_OK;
    OmSurface box = {0}, drawn = {0};
    om_tissue_state_reset(scene->r->m, scene->r->s);
    OM_TRY_DONE(om_tet_mesh_boundary(&scene->r->mesh, &box, NULL));
    OmProbeDef shape = om_probe_default_def(OM_PROBE_MESH);
    shape.surface = &box;
    OM_TRY_DONE(om_probe_create(&shape, &probe));
    OM_TRY_DONE(om_probe_get_surface(probe, &drawn));
    OM_TRY_DONE(om_tissue_work_create(scene->r->m, &work));
    OmPressDef def = om_press_default_def(probe);
    def.method = scene->method;
    def.ntri = 60;
    def.has_face_contact = scene->has_faces;
    OM_TRY_DONE(om_press_create(&def, scene->r->m, &press));
    OmPose pose = {om_vec3(0.03, 0.02, 0.05), om_quat_identity()};
    OM_TRY_DONE(om_press_place(press, scene->r->m, scene->r->s, pose));
    for (int k = 0; k < 2; ++k) {
        pose.p.z -= 0.001;
        OM_TRY_DONE(om_press_step(press, scene->r->m, scene->r->s, work, pose, H, NULL));
    }
done:
    om_press_destroy(press);
    om_probe_destroy(probe);
    om_tissue_work_destroy(work);
    om_surface_done(&box);
    om_surface_done(&drawn);
    return status;
}

static void test_memory(void** test) {
    (void)test;
    PressRig p;
    make_soft_block(&p, 2, 2, 1);
    rig_start(&p.r);
    for (int method = 0; method < 3; ++method) {
        Scene scene = {&p.r, (OmPressMethod)method, false};
        assert_true(test_failing_allocations(press_with_memory, &scene, 1) > 40);
    }
    Scene faces = {&p.r, OM_PRESS_PENALTY, true};
    assert_true(test_failing_allocations(press_with_memory, &faces, 1) > 40);
    rig_done(&p.r);
}

static void refuse(const PressRig* p, const OmPressDef* def, const char* word) {
    OmPress* press = NULL;
    int64_t alive = om_alloc_alive();
    assert_status(om_press_create(def, p->r.m, &press), OM_INVALID);
    assert_null(press);
    if (!strstr(om_error_message(), word)) fail_msg("no \"%s\" in: %s", word, om_error_message());
    assert_true(om_alloc_alive() == alive);
}

static void test_input(void** test) {
    (void)test;
    PressRig p, other;
    make_soft_block(&p, 3, 3, 2);
    make_soft_block(&other, 2, 2, 1);
    rig_start(&other.r);
    OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);
    start(&p, &shape, OM_PRESS_PRESCRIBED, 0);
    const double nan = (double)NAN;
    double corner[9] = {0, 0, 0, 1, 0, 0, 0, nan, 0};
    int tri[3] = {0, 1, 3};
    OmSurface bad = {3, 1, corner, tri};
    OmPressDef def;
#define REFUSE(change, word)             \
    def = om_press_default_def(p.probe); \
    change;                              \
    refuse(&p, &def, word)
    REFUSE(def.cookie = 0, "om_press_default_def");
    REFUSE(def.obstacle.distance = NULL, "probe");
    REFUSE(def.method = (OmPressMethod)3, "method");
    REFUSE(def.ntri = 3, "ntri");
    REFUSE(def.stiffness = -1, "stiffness");
    REFUSE(def.has_face_contact = true; def.method = OM_PRESS_MULTIPLIERS, "contact of faces");
    REFUSE(def.has_face_contact = true; def.surface = &bad, "contact of faces");
    REFUSE(def.friction = nan, "friction");
    REFUSE(def.friction = 0.1; def.method = OM_PRESS_PRESCRIBED, "friction");
    REFUSE(def.tolerance = 0, "tolerance");
    REFUSE(def.max_iterations = 0, "max_iterations");
    REFUSE(def.reuse = -1, "reuse");
    REFUSE(def.direction = om_vec3(0, 0, 0), "direction");
    REFUSE(def.reach = 0, "reach");
    REFUSE(def.surface = &bad, "vertex 2");
    corner[7] = 1;
    REFUSE(def.surface = &bad, "vertex 3");
    OmPose far = at(0.06, 1), odd = at(0.06, 0.05), lost = at(nan, 0.05);
    odd.q.w = 0.5;
    assert_status(om_press_place(p.press, p.r.m, p.r.s, far), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "950.0 mm away"));
    assert_status(om_press_place(p.press, p.r.m, p.r.s, odd), OM_INVALID);
    assert_status(om_press_place(p.press, p.r.m, p.r.s, lost), OM_INVALID);
    assert_status(om_press_place(p.press, other.r.m, other.r.s, at(0.06, 0.05)), OM_INVALID);
    uint64_t hash = om_tissue_state_hash(p.r.s);
    OmPressReport report;
    assert_ok(om_press_place(p.press, p.r.m, p.r.s, at(0.06, 0.05)));
    assert_status(om_press_step(p.press, p.r.m, p.r.s, p.r.w, odd, H, &report), OM_INVALID);
    assert_status(om_press_step(p.press, p.r.m, p.r.s, p.r.w, at(0.06, 0.049), nan, &report),
                  OM_INVALID);
    assert_true(om_tissue_state_hash(p.r.s) == hash);
    assert_near(om_press_pose(p.press).p.z, 0.05, 0);
    om_press_destroy(NULL);
    done(&p);
    rig_done(&other.r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nothing_missed), cmocka_unit_test(test_rush),
        cmocka_unit_test(test_thin_and_fast),  cmocka_unit_test(test_friction),
        cmocka_unit_test(test_same_bytes),     cmocka_unit_test(test_reuse),
        cmocka_unit_test(test_memory),         cmocka_unit_test(test_input),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
