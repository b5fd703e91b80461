// test_pbd_elastic.c: XPBD against finite elements of the same law, its own forces against its energy.
#include "pbd_rig.h"

// The same box for both engines: attached at one plane, heavy damping, stable neo-Hookean.
static void make(PbdRig* p, bool is_pbd, OmVec3 size, const int num[3], int axis, double at) {
    pbd_box(p, size, num[0], num[1], num[2]);
    p->pbd = om_pbd_default_def(OM_PBD_ELASTIC);
    p->pbd.collision_distance = 0;
    p->r.def.material_default.law = OM_STABLE_NEO_HOOKEAN;
    p->r.def.rayleigh_mass = 5;
    rig_attach_plane(&p->r, axis, at);
    if (is_pbd)
        pbd_start(p);
    else
        rig_start(&p->r);
}

// How far a beam's end, then a hanging block's lowest corner, sink.
static void test_weight_as_finite_elements(void** state) {
    (void)state;
    static const struct {
        OmVec3 size;
        int num[3], axis, tip;
        double at;
    } body[] = {{{0.08, 0.02, 0.02}, {12, 3, 3}, 0, 12, 0},
                {{0.04, 0.04, 0.06}, {4, 4, 6}, 2, 0, 0.06}};
    for (int k = 0; k < 2; ++k) {
        double sunk[2];
        for (int e = 0; e < 2; ++e) {
            PbdRig p;
            make(&p, e == 1, body[k].size, body[k].num, body[k].axis, body[k].at);
            pbd_run(&p, 200, 0.02);
            sunk[e] = p.r.mesh.x[3 * body[k].tip + 2] - om_tissue_x(p.r.s)[3 * body[k].tip + 2];
            OmTissueForces f;
            assert_ok(om_tissue_get_forces(p.r.m, p.r.s, &f));
            assert_below(om_norm(om_add(f.attachment, f.weight)), 2e-3 * om_norm(f.weight));
            if (e == 1)
                assert_true(om_engine_capabilities(om_tissue_engine(p.r.m)) & OM_ENGINE_FORCES);
            pbd_done(&p);
        }
        assert_near_rel(sunk[1], sunk[0], 0.001);  // measured 0.002 %
    }
}

// A ball of 10 mm pressed 5 mm into a block: the force on the ball. Then its top pulled 10 mm: on the tool.
static double indent(PbdRig* p, const OmProbe* ball, bool is_pbd) {
    OmPress* press = NULL;
    OmVec3 top = {0.03, 0.03, 0.04};
    OmPose pose = {top, om_quat_identity()};
    OmPressReport report;
    double force = 0;
    if (!is_pbd) {
        OmPressDef def = om_press_default_def(ball);
        def.ntri = 0;
        assert_ok(om_press_create(&def, p->r.m, &press));
        assert_ok(om_press_place(press, p->r.m, p->r.s, pose));
    }
    for (int n = 0; n < 100; ++n) {
        OmPose to = {om_madd(top, -0.005 * fmin(1, (n + 1) / 50.0), om_vec3(0, 0, 1)), pose.q};
        if (is_pbd) {
            OmTissueObstacle o = om_probe_obstacle(ball, pose, to, 0);
            assert_ok(om_tissue_step_among(p->r.m, p->r.s, p->r.w, 0.02, 1, &o, NULL));
            force = o.force.z;
        } else {
            assert_ok(om_press_step(press, p->r.m, p->r.s, p->r.w, to, 0.02, &report));
            force = -report.force.z;
        }
        pose = to;
    }
    om_press_destroy(press);
    return force;
}

static double pull(PbdRig* p) {
    OmPose pose = {om_vec3(0.03, 0.03, 0.03), om_quat_identity()};
    assert_ok(om_tissue_grasp(p->r.m, p->r.s, 0, pose, 0.008, NULL));
    for (int n = 0; n < 200; ++n) {
        pose.p.z = 0.03 + 0.01 * fmin(1, (n + 1) / 100.0);
        assert_ok(om_tissue_move_grasp(p->r.s, 0, pose));
        assert_ok(om_tissue_step(p->r.m, p->r.s, p->r.w, 0.02, NULL));
    }
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(p->r.m, p->r.s, &f));
    return f.grasp[0].z;
}

static void test_forces_as_finite_elements(void** state) {
    (void)state;
    OmProbeDef def = om_probe_default_def(OM_PROBE_SPHERE);
    def.radius = 0.01;
    OmProbe* ball;
    assert_ok(om_probe_create(&def, &ball));
    double pressed[2], pulled[2];
    for (int e = 0; e < 2; ++e) {
        PbdRig p;
        const int num[3] = {8, 8, 4};
        make(&p, e == 1, om_vec3(0.06, 0.06, 0.03), num, 2, 0);
        pressed[e] = indent(&p, ball, e == 1);
        om_tissue_state_reset(p.r.m, p.r.s);
        pulled[e] = pull(&p);
        pbd_done(&p);
    }
    print_message("press %.4f N, finite elements %.4f; pull %.4f N, finite elements %.4f\n",
                  pressed[1], pressed[0], pulled[1], pulled[0]);
    // measured 0.3 and 0.0 %; finite elements let the ball sink in by a hundredth of a mm
    assert_near_rel(pressed[1], pressed[0], 0.01);
    assert_near_rel(pulled[1], pulled[0], 0.002);
    om_probe_destroy(ball);
}

// Forces are less the slope of the energy, and rest is rest.
static void test_forces_of_energy(void** state) {
    (void)state;
    PbdRig p;
    const int num[3] = {3, 2, 2};
    make(&p, true, om_vec3(0.03, 0.02, 0.02), num, 0, 0);
    size_t n = 3 * (size_t)p.r.mesh.nvert;
    double *x = om_alloc(n, 8), *f = om_alloc(n, 8);
    OmTissueEnergy energy;
    assert_ok(om_tissue_get_internal_force(p.r.m, p.r.s, f));
    for (size_t i = 0; i < n; ++i) assert_near(f[i], 0, 1e-12);
    assert_ok(om_tissue_get_energy(p.r.m, p.r.s, &energy));
    assert_near(energy.elastic, 0, 1e-15);
    memcpy(x, p.r.mesh.x, n * 8);
    rig_shake(&p.r.mesh, NULL, 0.002, x);
    assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, NULL));
    assert_ok(om_tissue_get_internal_force(p.r.m, p.r.s, f));
    for (size_t i = 0; i < n; i += 5) {
        double W[2], at = x[i], d = 1e-7;
        for (int k = 0; k < 2; ++k) {
            x[i] = at + (k ? d : -d);
            assert_ok(om_tissue_set_x(p.r.m, p.r.s, x, NULL));
            assert_ok(om_tissue_get_energy(p.r.m, p.r.s, &energy));
            W[k] = energy.elastic;
        }
        x[i] = at;
        assert_near(-(W[1] - W[0]) / (2 * d), f[i],
                    1e-7);  // forces of 0.1 N, W of 1e-3 J in double
    }
    om_free(x), om_free(f);
    pbd_done(&p);
}

// One element whose edges are springs: its corner goes where Hooke's law has it.
static void test_lengths(void** state) {
    (void)state;
    PbdRig p;
    memset(&p, 0, sizeof p);
    assert_ok(om_tet_mesh_init(&p.r.mesh, 4, 1));
    const double x[12] = {0, 0, 0, 0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01};
    memcpy(p.r.mesh.x, x, sizeof x);
    memcpy(p.r.mesh.tet_vert, (int[4]){0, 1, 2, 3}, 4 * sizeof(int));
    assert_ok(om_tet_mesh_add_set(&p.r.mesh, "attachment", (int[3]){0, 1, 2}, 3));
    p.r.def = om_tissue_default_def(om_fem_engine(), &p.r.mesh);
    p.r.def.element = OM_ELEMENT_LINEAR;
    p.r.def.gravity = om_vec3(0, 0, 0);
    p.r.def.rayleigh_mass = 20;
    p.pbd = om_pbd_default_def(OM_PBD_LENGTHS);
    p.pbd.edge_stiffness = 3;
    p.pbd.volume_stiffness = 0;
    pbd_start(&p);
    om_store3(om_tissue_external_force(p.r.s), 3, om_vec3(0, 0, 1e-4));
    pbd_run(&p, 200, 0.02);
    OmVec3 u = om_sub(om_load3(om_tissue_x(p.r.s), 3), om_vec3(0, 0, 0.01));
    // K = k [[1/2, 0, -1/2], [0, 1/2, -1/2], [-1/2, -1/2, 2]]: u = f / k (1, 1, 1)
    for (int a = 0; a < 3; ++a) {
        double got = a == 0 ? u.x : a == 1 ? u.y : u.z;
        assert_near_rel(got, 1e-4 / 3, 0.02);  // the second order of a strain of 0.3 %
    }
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(p.r.m, p.r.s, &f));
    assert_near(f.attachment.z, -1e-4, 1e-6);  // multipliers of the last substeps
    assert_true(om_engine_capabilities(om_tissue_engine(p.r.m)) & OM_ENGINE_FORCES);
    pbd_done(&p);
}

// Two elements share an edge, which is one spring still: K_zz = k (1 + 4 / 2), and nothing pulls sideways. Iterations
// come nearer to it, as they would not without what was pushed before in the substep.
static void test_shared_lengths(void** state) {
    (void)state;
    for (int k = 0; k < 2; ++k) {
        PbdRig p;
        memset(&p, 0, sizeof p);
        assert_ok(om_tet_mesh_init(&p.r.mesh, 6, 2));
        const double x[18] = {0, 0, 0,    0.01,  0, 0, 0, 0.01,  0,
                              0, 0, 0.01, -0.01, 0, 0, 0, -0.01, 0};
        memcpy(p.r.mesh.x, x, sizeof x);
        memcpy(p.r.mesh.tet_vert, (int[8]){0, 1, 2, 3, 0, 4, 5, 3}, 8 * sizeof(int));
        assert_ok(om_tet_mesh_add_set(&p.r.mesh, "attachment", (int[5]){0, 1, 2, 4, 5}, 5));
        p.r.def = om_tissue_default_def(om_fem_engine(), &p.r.mesh);
        p.r.def.element = OM_ELEMENT_LINEAR;
        p.r.def.gravity = om_vec3(0, 0, 0);
        p.r.def.rayleigh_mass = 20;
        p.pbd = om_pbd_default_def(OM_PBD_LENGTHS);
        p.pbd.edge_stiffness = 3;
        p.pbd.volume_stiffness = 0;
        p.pbd.iterations = k ? 30 : 1;
        pbd_start(&p);
        om_store3(om_tissue_external_force(p.r.s), 3, om_vec3(0, 0, 1e-4));
        pbd_run(&p, 200, 0.02);
        OmVec3 u = om_sub(om_load3(om_tissue_x(p.r.s), 3), om_vec3(0, 0, 0.01));
        assert_near_rel(u.z, 1e-4 / (3 * 3), k ? 0.01 : 0.1);
        assert_near(hypot(u.x, u.y), 0, 0.05 * u.z);
        pbd_done(&p);
    }
}

// The same element that keeps its volume L^3 / 6, too: along z the corner meets (kv / V) (dV/dz)^2 = kv L / 6 more.
static void test_volume_stiffness(void** state) {
    (void)state;
    const double step[2] = {0.02, 0.01};  // at rest the step says nothing
    for (int k = 0; k < 2; ++k) {
        PbdRig p;
        memset(&p, 0, sizeof p);
        assert_ok(om_tet_mesh_init(&p.r.mesh, 4, 1));
        const double x[12] = {0, 0, 0, 0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01};
        memcpy(p.r.mesh.x, x, sizeof x);
        memcpy(p.r.mesh.tet_vert, (int[4]){0, 1, 2, 3}, 4 * sizeof(int));
        assert_ok(om_tet_mesh_add_set(&p.r.mesh, "attachment", (int[3]){0, 1, 2}, 3));
        p.r.def = om_tissue_default_def(om_fem_engine(), &p.r.mesh);
        p.r.def.element = OM_ELEMENT_LINEAR;
        p.r.def.gravity = om_vec3(0, 0, 0);
        p.r.def.rayleigh_mass = 20;
        p.pbd = om_pbd_default_def(OM_PBD_LENGTHS);
        p.pbd.edge_stiffness = 3;
        p.pbd.volume_stiffness = 3600;
        pbd_start(&p);
        om_store3(om_tissue_external_force(p.r.s), 3, om_vec3(0, 0, 1e-4));
        pbd_run(&p, 400, step[k]);
        OmVec3 u = om_sub(om_load3(om_tissue_x(p.r.s), 3), om_vec3(0, 0, 0.01));
        assert_near_rel(u.z, 1e-4 / (3 + 3600 * 0.01 / 6), 0.1);  // few iterations
        pbd_done(&p);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_weight_as_finite_elements),
        cmocka_unit_test(test_forces_as_finite_elements),
        cmocka_unit_test(test_forces_of_energy),
        cmocka_unit_test(test_lengths),
        cmocka_unit_test(test_shared_lengths),
        cmocka_unit_test(test_volume_stiffness),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
