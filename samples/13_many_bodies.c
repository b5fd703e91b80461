// 13_many_bodies.c: one model, many states: 32 sheets are pulled in 32 directions, several at once.
//
// The model is constant and shared by all threads. Each body needs a state, each thread a work. A body gives the
// same bytes whichever thread steps it, so a run with one worker has the same hashes.
#include <stdio.h>

#include "omentum/omentum.h"

#define NBODY 32
#define NSTEP 50

typedef struct Farm {
    const OmTissueModel* model;
    OmTissueState* state[NBODY];
    OmStatus status[NBODY];
    double force[NBODY];  // N, that the tool exerts
} Farm;

// Grasp the free edge's middle and pull it by 10 mm, in a direction that belongs to body k.
static OmStatus pull(const OmTissueModel* model, OmTissueState* state, OmTissueWork* work, int k,
                     double* force) {
    double angle = 2 * OM_PI * k / NBODY;
    OmPose tip = {om_vec3(0.06, 0.03, 0.003), om_quat_identity()};
    OmVec3 way = om_vec3(0.005, 0.01 * cos(angle), 0.01 * sin(angle));
    OmStatus status = om_tissue_grasp(model, state, 0, tip, 0.005, NULL);
    for (int i = 0; i < NSTEP && status >= 0; ++i) {
        tip.p = om_madd(tip.p, 1.0 / NSTEP, way);
        status = om_tissue_move_grasp(state, 0, tip);
        if (status >= 0) status = om_tissue_step(model, state, work, 0.02, NULL);
    }
    OmTissueForces f = {0};
    if (status >= 0) status = om_tissue_get_forces(model, state, &f);
    *force = om_norm(f.grasp[0]);
    return status;
}

// One block of the loop: bodies [begin, end), with a work of its own.
static void pull_some(void* ctx, int begin, int end, int block) {
    (void)block;
    Farm* farm = ctx;
    OmTissueWork* work;
    OmStatus status = om_tissue_work_create(farm->model, &work);
    for (int k = begin; k < end; ++k)
        farm->status[k] =
            status < 0 ? status : pull(farm->model, farm->state[k], work, k, &farm->force[k]);
    om_tissue_work_destroy(work);
}

// All bodies from rest; the hash of all states.
static OmStatus run(Farm* farm, int nworker, uint64_t* hash) {
    for (int k = 0; k < NBODY; ++k) om_tissue_state_reset(farm->model, farm->state[k]);
    double begin = om_clock_now();
    om_parallel_for(nworker, NBODY, 4, pull_some, farm);
    double s = om_clock_now() - begin;
    *hash = OM_HASH_SEED;
    double least = 1e30, most = 0;
    for (int k = 0; k < NBODY; ++k) {
        if (farm->status[k] < 0) return farm->status[k];
        uint64_t h = om_tissue_state_hash(farm->state[k]);
        *hash = om_hash(&h, sizeof h, *hash);
        if (farm->force[k] < least) least = farm->force[k];
        if (farm->force[k] > most) most = farm->force[k];
    }
    printf("%d bodies x %d steps, workers %d: %.2f s, forces from %.3f to %.3f N, hash %016llx\n",
           NBODY, NSTEP, om_worker_count(nworker), s, least, most, (unsigned long long)*hash);
    return OM_OK;
}

static OmStatus make_model(OmTissueModel** model) {
    OmTetMesh mesh;
    int held[2 * 11], nheld = 0;
    OmStatus status =
        om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.06, 0.06, 0.003), 10, 10, 1, &mesh);
    if (status != OM_OK) return status;
    for (int i = 0; i < mesh.nvert; ++i)
        if (om_load3(mesh.x, i).x < 1e-9) held[nheld++] = i;
    status = om_tet_mesh_add_set(&mesh, "attachment", held, nheld);
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), &mesh);
    def.material_default.law = OM_STABLE_NEO_HOOKEAN;
    def.solver.nworker = 1;  // the bodies are shared among threads, not the steps
    if (status == OM_OK) status = om_tissue_create(&def, model);
    om_tet_mesh_done(&mesh);
    return status;
}

int main(void) {
    Farm farm = {0};
    OmTissueModel* model = NULL;
    uint64_t one = 0, many = 1;
    OmStatus status = make_model(&model);
    farm.model = model;
    for (int k = 0; k < NBODY && status == OM_OK; ++k)
        status = om_tissue_state_create(model, &farm.state[k]);
    if (status == OM_OK) printf("a state takes %zu bytes\n", om_tissue_state_size(model));
    if (status == OM_OK) status = run(&farm, 1, &one);
    if (status == OM_OK) status = run(&farm, 0, &many);
    if (status < 0) fprintf(stderr, "%s: %s\n", om_status_text(status), om_error_message());
    for (int k = 0; k < NBODY; ++k) om_tissue_state_destroy(farm.state[k]);
    om_tissue_destroy(model);
    return status == OM_OK && one == many ? 0 : 1;
}
