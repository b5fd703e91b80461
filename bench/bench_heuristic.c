// bench_heuristic.c: a beam fixed at one end, the other lifted by 2 cm in 1 s, as in bench_fem.c: springs (multigrid
// to 1e-3) and ChainMail (10 sweeps) beside the finite elements of the same mesh.
#include <stdio.h>
#include <stdlib.h>

#include "bench.h"

#define NWARM 10
#define NSTEP 50

static const int cells_table[][3] = {{19, 6, 6}, {36, 11, 11}};
#define NMESH ((int)(sizeof cells_table / sizeof *cells_table))
#define NENGINE 3

// The far end, by a sphere so large that it is flat there.
static OmStatus lift(OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double* time) {
    OmPose tip = {om_vec3(1000.1 - 1e-5, 0.015, 0.015), om_quat_identity()};
    om_tissue_state_reset(m, s);
    OM_TRY(om_tissue_grasp(m, s, 0, tip, 1000, NULL));
    for (int step = 0; step < NWARM + NSTEP; ++step) {
        if (step >= NWARM) tip.p.z += 0.02 / NSTEP;
        OM_TRY(om_tissue_move_grasp(s, 0, tip));
        double begin = bench_now();
        OM_TRY(om_tissue_step(m, s, w, 0.02, NULL));
        if (step >= NWARM) *time += (bench_now() - begin) / NSTEP;
    }
    return OM_OK;
}

static OmStatus measure(const OmTetMesh* mesh, int engine, const char* scene,
                        const BenchOptions* options, double* reference_ms) {
    const OmTissueEngine* table[NENGINE] = {om_fem_engine(), om_spring_engine(), om_chain_engine()};
    OmTissueDef def = om_tissue_default_def(table[engine], mesh);
    def.element = OM_ELEMENT_LINEAR;
    def.gravity = om_vec3(0, 0, 0);
    def.solver.nworker = options->nworker;
    def.solver.tolerance = 1e-3;
    OmTissueModel* m = NULL;
    OmTissueState* s = NULL;
    OmTissueWork* w = NULL;
    OmStatus status = OM_OK;
    double* time = om_calloc((size_t)options->nrun, sizeof *time);
    if (!time) return OM_NO_MEMORY;
    OM_TRY_DONE(om_tissue_create(&def, &m));
    OM_TRY_DONE(om_tissue_state_create(m, &s));
    OM_TRY_DONE(om_tissue_work_create(m, &w));
    for (int run = 0; run < options->nrun; ++run) OM_TRY_DONE(lift(m, s, w, &time[run]));
    BenchRow row = {.bench = "heuristic",
                    .scene = scene,
                    .work = table[engine]->name,
                    .size = mesh->ntet,
                    .nworker = options->nworker,
                    .steps = NSTEP,
                    .nrun = options->nrun,
                    .bytes_per_element = (double)om_tissue_memory(m, w) / mesh->ntet,
                    .hash = om_tissue_state_hash(s)};
    bench_times(time, options->nrun, &row);
    if (engine == 0) {
        *reference_ms = row.min_ms;
    } else {
        row.reference = "fem";
        row.reference_ms = *reference_ms;
    }
    status = bench_print(&row);
done:
    om_tissue_work_destroy(w);
    om_tissue_state_destroy(s);
    om_tissue_destroy(m);
    om_free(time);
    return status;
}

OmStatus bench_heuristic(const BenchOptions* options) {
    for (int k = 0; k < NMESH && (k == 0 || !options->is_quick); ++k) {
        OmTetMesh mesh;
        char scene[64];
        double reference_ms = 0;
        const int* n = cells_table[k];
        snprintf(scene, sizeof scene, "lift beam %dx%dx%d", n[0], n[1], n[2]);
        OM_TRY(bench_box(om_vec3(0.1, 0.03, 0.03), n, 0, &mesh));
        OmStatus status = OM_OK;
        for (int e = 0; e < NENGINE && status >= 0; ++e)
            status = measure(&mesh, e, scene, options, &reference_ms);
        om_tet_mesh_done(&mesh);
        if (status < 0) return status;
    }
    return OM_OK;
}
