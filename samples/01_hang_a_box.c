// 01_hang_a_box.c: a soft box hangs from its top until it is at rest; then the attachments carry its weight.
//
// The three objects of every simulation: a model (never changes), a state (a step changes it; it can be
// copied and hashed) and a work (the scratch and the linear solver of one thread).
#include <stdio.h>
#include <string.h>

#include "omentum/omentum.h"

enum { NX = 2, NY = 2, NZ = 3 };  // quadratic elements, the default, need few cells

// 40 x 40 x 60 mm; the vertices of the top become the set that a model attaches by itself.
static OmStatus make_box(OmTetMesh* mesh) {
    OmStatus status =
        om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.04, 0.04, 0.06), NX, NY, NZ, mesh);
    if (status != OM_OK) return status;
    int top[(NX + 1) * (NY + 1)], ntop = 0;
    for (int i = 0; i < mesh->nvert; ++i)
        if (om_load3(mesh->x, i).z > 0.06 - 1e-9) top[ntop++] = i;
    return om_tet_mesh_add_set(mesh, "attachment", top, ntop);
}

static double lowest_point(const OmTissueModel* model, const OmTissueState* state) {
    double z = 1;
    for (int i = 0; i < om_tissue_mesh(model)->nvert; ++i) {
        OmVec3 p = om_load3(om_tissue_x(state), i);
        if (p.z < z) z = p.z;
    }
    return z;
}

static OmStatus simulate(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work) {
    OmTissueReport report;
    for (int step = 0; step < 400; ++step) {
        OmStatus status = om_tissue_step(model, state, work, 0.02, &report);
        if (status != OM_OK) return status;
        if ((step + 1) % 100 == 0)
            printf("%.1f s: lowest point %.2f mm, %d iterations, hash %016llx\n",
                   om_tissue_time(state), 1e3 * lowest_point(model, state), report.iterations,
                   (unsigned long long)om_tissue_state_hash(state));
    }
    return OM_OK;
}

// At rest the attachments carry the weight. The force is read from the stresses of the elements, so this
// is a test of the simulation, not a definition. Returns 0 if they agree to 1 %.
static int compare_forces(const OmTissueModel* model, const OmTissueState* state) {
    OmTissueForces f;
    if (om_tissue_get_forces(model, state, &f) != OM_OK) return 1;
    printf("weight %.4f N, attachments %.4f N\n", f.weight.z, f.attachment.z);
    return om_norm(om_add(f.attachment, f.weight)) < 0.01 * om_norm(f.weight) ? 0 : 1;
}

int main(void) {
    OmTetMesh mesh;
    OmTissueModel* model = NULL;
    OmTissueState* state = NULL;
    OmTissueWork* work = NULL;
    memset(&mesh, 0, sizeof mesh);
    int code = 1;

    OmStatus status = make_box(&mesh);
    if (status == OM_OK) {
        OmTissueDef def = om_tissue_default_def(om_fem_engine(), &mesh);
        def.material_default.young = 5000;  // Pa
        def.rayleigh_mass = 2;              // 1/s: comes to rest soon
        def.solver.nworker = 1;             // too small to share among threads
        status = om_tissue_create(&def, &model);
    }
    if (status == OM_OK) status = om_tissue_state_create(model, &state);
    if (status == OM_OK) status = om_tissue_work_create(model, &work);
    if (status == OM_OK) status = simulate(model, state, work);
    if (status == OM_OK)
        code = compare_forces(model, state);
    else
        fprintf(stderr, "%s\n", om_error_message());

    om_tissue_work_destroy(work);
    om_tissue_state_destroy(state);
    om_tissue_destroy(model);
    om_tet_mesh_done(&mesh);
    return code;
}
