// test_contact_peel.c: a sheet is peeled off its board, or an organ, and laid down again at 20 mm/s;
// forces do not jump.
#include "test_rig.h"

static const OmContactPlane plane = {{0, 0, 0}, {0, 0, 1}};

// The thesis's sheet on a board, held under one edge; made and settled.
static void start(TestRig* r, double tolerance) {
    rig_box(r, om_vec3(-0.06, -0.06, 0), om_vec3(0.06, 0.06, 0.005), 10, 10, 1);
    int vert[200], num = 0;
    for (int i = 0; i < r->mesh.nvert; ++i)
        if (r->mesh.x[3 * i] < -0.045 && r->mesh.x[3 * i + 2] < 1e-9) vert[num++] = i;
    assert_ok(om_tet_mesh_add_set(&r->mesh, "attachment", vert, num));
    r->def.rayleigh_stiffness = 0.02;
    r->def.solver.tolerance = tolerance;
    rig_start(r);
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef def = rig_on(&board);
    rig_contact(r, &def);
    assert_ok(om_contact_settle(r->cw, r->m, r->s, r->w, 0.02, 1e-3, 3));
}

typedef struct Peel {
    double jump;     // N, the largest change of the contact resultant in a step
    double max;      // N, the largest contact resultant
    double deepest;  // m
    int nunsettled;
} Peel;

// Up by 40 mm, a while of rest, down again. Up to 0.2 s after each change of speed is counted too.
static Peel peel(double tolerance) {
    TestRig r;
    start(&r, tolerance);
    Peel p = {0};
    OmPose tip = {om_vec3(0.05, 0, 0.005), om_quat_identity()};
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.013, NULL));
    OmContactReport report;
    assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
    double last = report.force.z;
    for (int n = 0; n < 230; ++n) {
        if (n < 100) tip.p.z += 0.02 * 0.02;
        if (n >= 120 && n < 220) tip.p.z -= 0.02 * 0.02;
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
        p.jump = fmax(p.jump, fabs(report.force.z - last));
        p.max = fmax(p.max, report.force.z);
        p.deepest = fmax(p.deepest, report.penetration);
        p.nunsettled += !report.is_settled;
        last = report.force.z;
    }
    rig_done(&r);
    return p;
}

// The sheet weighs 0.71 N and its resultant goes from about 0.6 to 0.3 N and back within 2 s, 0.003 N a step.
// A row of 11 vertices that leaves or lands carries 0.06 N. When residuals were measured against the penalties
// of moving vertices, the resultant jumped by 0.11 N here at a tolerance of 1e-3, by 4 N on finer sheets.
static void test_peel(void** context) {
    (void)context;
    double tolerance[2] = {1e-3, 1e-5};
    for (int k = 0; k < 2; ++k) {
        Peel p = peel(tolerance[k]);
        printf(
            "tolerance %g: contact at most %.3f N, changes by at most %.4f N a step, deepest %.3g m, %d steps "
            "unsettled\n",
            tolerance[k], p.max, p.jump, p.deepest, p.nunsettled);
        assert_below(p.jump, 0.08);
        assert_below(p.max, 0.85);
        assert_below(p.deepest, 1e-4);
    }
}

static double ball(void* ctx, OmVec3 p) {
    (void)ctx;
    return om_norm(om_sub(p, om_vec3(0, 0, -0.04))) - 0.04;
}

// A layer draped over a round organ on springs at one edge; the other edge is lifted by 30 mm and laid down. At
// the end everything that acts on it sums to zero.
static void test_peel_off_organ(void** context) {
    (void)context;
    OmSdfDef sdf_def = om_sdf_default_def(0.002);
    OmSdf sdf;
    assert_ok(om_sdf_from_function(ball, NULL, om_vec3(-0.045, -0.045, -0.085),
                                   om_vec3(0.045, 0.045, 0.005), &sdf_def, &sdf));
    OmTissueObstacle organ = om_sdf_obstacle(&sdf);
    OmContactDef def = rig_on(&organ);
    TestRig r;
    rig_box(&r, om_vec3(-0.03, -0.03, 0), om_vec3(0.03, 0.03, 0.004), 10, 10, 1);
    rig_attach_plane(&r, 0, -0.03);
    for (int i = 0; i < r.mesh.nvert; ++i) {  // bent to the shape of the ball
        OmVec3 p = om_load3(r.mesh.x, i), c = om_vec3(0, 0, -0.04);
        OmVec3 out = om_sub(om_vec3(p.x, p.y, 0), c);
        om_store3(r.mesh.x, i, om_madd(c, (0.04 + p.z) / om_norm(out), out));
    }
    r.def.attachment_stiffness = 20;
    r.def.rayleigh_stiffness = 0.02;
    r.def.rayleigh_mass = 2;
    r.def.solver.tolerance = 1e-4;
    rig_start(&r);
    rig_contact(&r, &def);
    assert_ok(om_contact_settle(r.cw, r.m, r.s, r.w, 0.02, 1e-3, 5));
    OmPose tip = {om_load3(om_tissue_x(r.s), 10 + 11 * (5 + 11)), om_quat_identity()};
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.007, NULL));
    OmContactReport report;
    assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
    OmVec3 last = report.force;
    double jump = 0, deepest = 0;
    int nsolve = 0;
    for (int n = 0; n < 260; ++n) {
        if (n < 75) tip.p = om_add(tip.p, om_vec3(-0.0002, 0, 0.0004));
        if (n >= 85 && n < 160) tip.p = om_sub(tip.p, om_vec3(-0.0002, 0, 0.0004));
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
        jump = fmax(jump, om_norm(om_sub(report.force, last)));
        deepest = fmax(deepest, report.penetration);
        if (n >= 210) nsolve += report.nsolve;
        last = report.force;
    }
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    OmVec3 sum = om_add(om_add(f.grasp[0], f.attachment), om_add(f.contact, f.weight));
    double weight = om_norm(f.weight);
    printf(
        "organ: contact changes by at most %.4f N a step, deepest %.3g m; at rest %.2f solves a step, "
        "grasp %.4f, springs %.4f, "
        "contact %.4f, weight %.4f N, sum %.2g\n",
        jump, deepest, nsolve / 50.0, om_norm(f.grasp[0]), om_norm(f.attachment),
        om_norm(f.contact), weight, om_norm(sum));
    assert_below(jump, 0.2 * weight);
    assert_below(deepest, 1e-4);
    assert_near(om_norm(sum), 0, 1e-3 * weight);
    assert_true(nsolve <= 60);  // who rests is known from the step before
    om_sdf_done(&sdf);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_peel),
                                       cmocka_unit_test(test_peel_off_organ)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
