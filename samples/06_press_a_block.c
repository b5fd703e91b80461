// 06_press_a_block.c: an ultrasound probe presses 10 mm into a block of tissue: its force by three methods.
//
// A probe is a rigid shape, a press carries it and keeps the tissue out of it. The block is fixed on its
// underside, 120 x 100 x 50 mm, 3 kPa. At rest the force on the probe equals the force of the attachment.
#include <stdio.h>
#include <string.h>

#include "omentum/omentum.h"

enum { NX = 6, NY = 5, NZ = 2 };

static const double thickness = 0.05, depth = 0.01, speed = 0.01, h = 0.02;  // m, m, m/s, s

static OmStatus make_block(OmTetMesh* mesh) {
    OmVec3 corner = om_vec3(0.12, 0.1, thickness);
    OmStatus status = om_tet_mesh_box(om_vec3(0, 0, 0), corner, NX, NY, NZ, mesh);
    if (status != OM_OK) return status;
    int under[(NX + 1) * (NY + 1)], num = 0;
    for (int i = 0; i < mesh->nvert; ++i)
        if (om_load3(mesh->x, i).z < 1e-9) under[num++] = i;
    return om_tet_mesh_add_set(mesh, "attachment", under, num);
}

// The pressing face of a box probe is at the origin of its frame, its body above.
static OmPose probe_at(double z) {
    OmPose pose = {om_vec3(0.06, 0.05, z), om_quat_identity()};
    return pose;
}

static OmStatus press_down(OmPress* press, const OmTissueModel* model, OmTissueState* state,
                           OmTissueWork* work) {
    OmPressReport report = {0};
    OmStatus status = om_press_place(press, model, state, probe_at(thickness));
    int nstep = (int)(depth / (speed * h) + 0.5);
    for (int n = 1; n <= nstep && status == OM_OK; ++n) {
        OmPose pose = probe_at(thickness - speed * h * n);
        status = om_press_step(press, model, state, work, pose, h, &report);
        if (n % 25 == 0 && status == OM_OK)
            printf("  %4.1f mm: %.3f N, %2d contacts, %4.0f mm2, in by %.3f mm\n",
                   1e3 * speed * h * n, report.force.z, report.ncontact, 1e6 * report.area,
                   1e3 * report.penetration);
    }
    // To rest: steps so long that inertia is nothing.
    for (int n = 0; n < 5 && status == OM_OK; ++n)
        status = om_press_step(press, model, state, work, probe_at(thickness - depth), 5, &report);
    if (status != OM_OK) return status;
    OmTissueForces f;
    status = om_tissue_get_forces(model, state, &f);
    printf("  at rest: %.4f N on the probe, %.4f N on the attachments\n", report.force.z,
           f.attachment.z);
    double error = om_distance(report.force, f.attachment);
    return error < 1e-3 * report.force.z ? status : OM_NOT_CONVERGED;
}

// The same block lies free on a board, with its weight: board and probe act in one step.
static OmStatus press_on_board(OmPress* press, const OmTissueModel* model, OmTissueState* state,
                               OmTissueWork* work, OmContactWork* contact) {
    OmContactReport report = {0};
    OmStatus status = om_tissue_set_attachment(model, state, 0, NULL, NULL, NULL);
    if (status == OM_OK) status = om_press_place(press, model, state, probe_at(thickness));
    if (status == OM_OK) om_contact_work_set_presses(contact, 1, &press);
    for (int n = 1; n <= 100 && status == OM_OK; ++n) {
        status = om_press_move(press, probe_at(thickness - fmin(depth, speed * h * n)));
        if (status == OM_OK) status = om_contact_step(contact, model, state, work, h, &report);
    }
    if (status != OM_OK) return status;
    double board = report.obstacle[0].force.z, probe = om_press_report(press)->force.z;
    double weight = 9.81 * 1000 * 0.12 * 0.1 * thickness;
    printf("on a board\n  the board bears %.3f N, the probe %.3f N, the weight is %.3f N\n", board,
           probe, weight);
    return fabs(board - probe - weight) < 0.01 * board ? OM_OK : OM_NOT_CONVERGED;
}

static OmStatus run(OmPressMethod method, const OmTissueModel* model, const OmProbe* probe,
                    const OmContact* contact) {
    OmTissueState* state = NULL;
    OmTissueWork* work = NULL;
    OmPress* press = NULL;
    OmContactWork* contact_work = NULL;
    OmPressDef def = om_press_default_def(probe);
    def.method = method;
    def.ntri = 4000;  // of the contact surface, whatever the volume mesh
    OmStatus status = om_press_create(&def, model, &press);
    if (status == OM_OK) status = om_tissue_state_create(model, &state);
    if (status == OM_OK) status = om_tissue_work_create(model, &work);
    if (status == OM_OK && contact) status = om_contact_work_create(contact, &contact_work);
    if (status == OM_OK)
        status = contact ? press_on_board(press, model, state, work, contact_work)
                         : press_down(press, model, state, work);
    om_contact_work_destroy(contact_work);
    om_press_destroy(press);
    om_tissue_work_destroy(work);
    om_tissue_state_destroy(state);
    return status;
}

static OmStatus make_model(const OmTetMesh* mesh, double gravity, OmTissueModel** model) {
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), mesh);
    def.material_default.law = OM_NEO_HOOKEAN;
    def.gravity = om_vec3(0, 0, -gravity);
    def.solver.max_rhs = 8;       // multipliers solve eight columns at a time
    def.solver.tolerance = 1e-4;  // forces are to balance to 1e-3
    def.solver.nworker = 1;
    return om_tissue_create(&def, model);
}

int main(void) {
    static const char* const name[] = {"penalty", "Lagrange multipliers",
                                       "prescribed displacement"};
    OmTetMesh mesh;
    OmTissueModel *model = NULL, *heavy = NULL;
    OmProbe* probe = NULL;
    OmContact* contact = NULL;
    memset(&mesh, 0, sizeof mesh);
    OmStatus status = make_block(&mesh);
    if (status == OM_OK) status = make_model(&mesh, 0, &model);
    if (status == OM_OK) status = make_model(&mesh, 9.81, &heavy);
    OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);  // 50 x 10 mm
    if (status == OM_OK) status = om_probe_create(&shape, &probe);
    for (int method = 0; method < 3 && status == OM_OK; ++method) {
        printf("%s\n", name[method]);
        status = run((OmPressMethod)method, model, probe, NULL);
    }
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef def = om_contact_default_def();
    def.nobstacle = 1, def.obstacle = &board;
    def.friction = 0.5;
    if (status == OM_OK) status = om_contact_create(&def, heavy, &contact);
    if (status == OM_OK) status = run(OM_PRESS_PENALTY, heavy, probe, contact);
    if (status != OM_OK) fprintf(stderr, "%s: %s\n", om_status_text(status), om_error_message());
    om_contact_destroy(contact);
    om_probe_destroy(probe);
    om_tissue_destroy(heavy);
    om_tissue_destroy(model);
    om_tet_mesh_done(&mesh);
    return status == OM_OK ? 0 : 1;
}
