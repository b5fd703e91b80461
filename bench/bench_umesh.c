// bench_umesh.c: samples of the breast phantom for U-Mesh, the first ones of seed 1, one worker.
#include <stdio.h>

#include "bench.h"

#define NSAMPLE 20
#define NSAMPLE_QUICK 4
#define THESIS_MS 407.7  // of a solve, 2,174 hexahedra (3.6.1)
#define GOAL_MS 1200     // 1,000 samples in 10 minutes on two cores

static OmStatus measure(OmUmeshSolver* solver, const OmUmeshGrid* g, const BenchOptions* options) {
    int nsample = options->is_quick ? NSAMPLE_QUICK : NSAMPLE, nnewton = 0;
    OmStatus status = OM_OK;
    unsigned char* mask = NULL;
    double *u = NULL, *time = NULL, worst = 0;
    uint64_t hash = OM_HASH_SEED;
    OM_ALLOC_DONE(mask, g->mesh.nnode);
    OM_ALLOC_DONE(u, 3 * (size_t)g->mesh.nnode);
    OM_ALLOC_DONE(time, options->nrun);
    for (int run = 0; run < options->nrun; ++run) {
        double start = om_clock_now();
        hash = OM_HASH_SEED, nnewton = 0;
        for (int i = 0; i < nsample; ++i) {
            OmUmeshSample sample;
            OM_TRY_DONE(om_umesh_make_sample(solver, i, &sample, mask, u));
            nnewton += sample.nnewton;
            worst = fmax(worst, sample.residual);
            hash = om_hash(u, 3 * (size_t)g->mesh.nnode * sizeof *u, hash);
        }
        time[run] = (om_clock_now() - start) / nsample;
    }
    BenchRow row = {.bench = "umesh",
                    .scene = "breast phantom",
                    .work = "a sample of the data, mean of the first",
                    .size = g->mesh.nelem,
                    .nworker = 1,
                    .steps = nsample,
                    .nrun = options->nrun,
                    .reference = "thesis 3.6.1, a solve",
                    .reference_ms = THESIS_MS,
                    .goal_ms = GOAL_MS,
                    .iterations = (double)nnewton / nsample,
                    .residual = worst,
                    .hash = hash};
    bench_times(time, options->nrun, &row);
    status = bench_print(&row);
done:
    om_free(mask);
    om_free(u);
    om_free(time);
    return status;
}

OmStatus bench_umesh(const BenchOptions* options) {
    OmUmeshOrganDef organ_def = om_umesh_default_organ_def();
    OmUmeshOrgan* organ;
    OmUmeshSolver* solver;
    OM_TRY(om_umesh_create_organ(&organ_def, &organ));
    OmUmeshDataDef def = om_umesh_default_data_def(organ, NULL);
    OmStatus status = om_umesh_create_solver(&def, &solver);
    if (status == OM_OK) status = measure(solver, om_umesh_grid(organ), options);
    om_umesh_destroy_solver(solver);
    om_umesh_destroy_organ(organ);
    return status;
}
