// test_contact_sheet.c: the thesis's sheet on a board, a block on a slope and on a ball: weights are carried,
// nothing sticks, nothing sinks.
#include "test_common.h"

#include "omentum/omentum.h"

typedef struct Rig {
    OmTetMesh mesh;
    OmTissueModel* m;
    OmTissueState* s;
    OmTissueWork* w;
    OmContact* c;
    OmContactWork* cw;
} Rig;

static OmTissueDef sheet_def(Rig* r, double thickness, int cells) {
    assert_ok(om_tet_mesh_box(om_vec3(-0.06, -0.06, 0), om_vec3(0.06, 0.06, thickness), cells,
                              cells, 1, &r->mesh));
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), &r->mesh);
    def.element = OM_ELEMENT_LINEAR;
    def.solver.nworker = 1;
    def.solver.tolerance = 1e-5;
    return def;
}

static void rig_make(Rig* r, const OmTissueDef* def, const OmContactDef* contact) {
    assert_ok(om_tissue_create(def, &r->m));
    assert_ok(om_tissue_state_create(r->m, &r->s));
    assert_ok(om_tissue_work_create(r->m, &r->w));
    assert_ok(om_contact_create(contact, r->m, &r->c));
    assert_ok(om_contact_work_create(r->c, &r->cw));
}

static void rig_done(Rig* r) {
    om_contact_work_destroy(r->cw);
    om_contact_destroy(r->c);
    om_tissue_work_destroy(r->w);
    om_tissue_state_destroy(r->s);
    om_tissue_destroy(r->m);
    om_tet_mesh_done(&r->mesh);
}

static const OmContactPlane plane = {{0, 0, 0}, {0, 0, 1}};

// A sheet dropped from 1 mm comes to rest; the board carries its weight, 0.706 N.
static void test_sheet_rests(void** context) {
    (void)context;
    Rig r = {0};
    OmTissueDef def = sheet_def(&r, 0.005, 12);
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef contact = om_contact_default_def();
    contact.nobstacle = 1, contact.obstacle = &board;
    for (int i = 0; i < r.mesh.nvert; ++i) r.mesh.x[3 * i + 2] += 0.001;
    rig_make(&r, &def, &contact);
    double weight = 0.12 * 0.12 * 0.005 * 1000 * 9.81, deepest = 0;
    OmContactReport report;
    for (int n = 0; n < 100; ++n) {
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
        assert_true(report.is_settled);
        deepest = fmax(deepest, report.penetration);
    }
    assert_near_rel(report.force.z, weight, 1e-3);
    assert_near(report.force.x, 0, 1e-6 * weight);
    assert_below(deepest, 2e-6);
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    assert_near_rel(f.contact.z, -f.weight.z, 1e-3);
    assert_int_equal(report.ncontact, 13 * 13);
    rig_done(&r);
}

// Lifted by its middle, held at one side: forces sum to zero, and once up nothing pulls it down.
static void test_sheet_lifted(void** context) {
    (void)context;
    Rig r = {0};
    OmTissueDef def = sheet_def(&r, 0.005, 12);
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef contact = om_contact_default_def();
    contact.nobstacle = 1, contact.obstacle = &board;
    int attached[400], num = 0;
    for (int i = 0; i < r.mesh.nvert; ++i)
        if (r.mesh.x[3 * i] < -0.045 && r.mesh.x[3 * i + 2] < 1e-9) attached[num++] = i;
    assert_ok(om_tet_mesh_add_set(&r.mesh, "attachment", attached, num));
    def.rayleigh_stiffness = 0.02;
    rig_make(&r, &def, &contact);
    OmContactReport report;
    OmPose tip = {om_vec3(0.05, 0, 0.005), om_quat_identity()};
    int nheld;
    assert_ok(om_contact_settle(r.cw, r.m, r.s, r.w, 0.02, 1e-3, 2));
    assert_ok(om_tissue_grasp(r.m, r.s, 0, tip, 0.011, &nheld));
    assert_true(nheld > 0);
    double deepest = 0;
    int nsolve = 0, unsettled = 0;
    for (int n = 0; n < 400; ++n) {
        if (tip.p.z < 0.055) tip.p.z += 0.02 * 0.02;
        assert_ok(om_tissue_move_grasp(r.s, 0, tip));
        assert_ok(om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report));
        deepest = fmax(deepest, report.penetration);
        nsolve = report.nsolve > nsolve ? report.nsolve : nsolve;
        unsettled += !report.is_settled;
        const double* f = om_tissue_contact_force(r.s);
        for (int i = 0; i < r.mesh.nvert; ++i) assert_true(f[3 * i + 2] >= 0);
    }
    assert_below(deepest, 2e-4);
    OmTissueForces f;
    assert_ok(om_tissue_get_forces(r.m, r.s, &f));
    OmVec3 sum = om_add(om_add(f.grasp[0], f.attachment), om_add(f.contact, f.weight));
    printf(
        "held %d, grasp %.4f, pull %.4f, attachment %.4f, contact %.4f, weight %.4f N, sum %.2g; "
        "deepest %.3g m, %d solves at most, %d unsettled, |v| ",
        nheld, f.grasp[0].z, f.pull[0].z, f.attachment.z, f.contact.z, f.weight.z, om_norm(sum),
        deepest, nsolve, unsettled);
    OmTissueEnergy energy;
    assert_ok(om_tissue_get_energy(r.m, r.s, &energy));
    printf("kinetic %.3g J\n", energy.kinetic);
    assert_below(om_norm(sum), 2e-3);
    rig_done(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sheet_rests),
                                       cmocka_unit_test(test_sheet_lifted)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
