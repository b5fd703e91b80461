// bench_umesh.c: U-Mesh on the breast phantom: samples, the first ones of seed 1, one worker; predictions of the
// weights that come along, everything in.
#include <stdio.h>

#include "bench.h"
#include "omentum/umesh_net.h"

#define NSAMPLE 20
#define NSAMPLE_QUICK 4
#define THESIS_MS 407.7  // of a solve, 2,174 hexahedra (3.6.1)
#define GOAL_MS 1200     // 1,000 samples in 10 minutes on two cores
#define NPREDICT 100
#define THESIS_PREDICT_MS 3.14  // on a GPU (3.6.1)
#define GOAL_PREDICT_MS 3
#define WEIGHTS "weights/phantom.safetensors"

static OmStatus measure(OmUmeshSolver* solver, const OmUmeshGrid* g, const BenchOptions* options) {
    int nsample = options->is_quick ? NSAMPLE_QUICK : NSAMPLE, nnewton = 0;
    OmStatus status = OM_OK;
    unsigned char* mask = NULL;
    double *u = NULL, *time = NULL, worst = 0;
    uint64_t hash = OM_HASH_SEED;
    OM_ALLOC_DONE(mask, g->fem.mesh.nnode);
    OM_ALLOC_DONE(u, 3 * (size_t)g->fem.mesh.nnode);
    OM_ALLOC_DONE(time, options->nrun);
    for (int run = 0; run < options->nrun; ++run) {
        double start = bench_now();
        hash = OM_HASH_SEED, nnewton = 0;
        for (int i = 0; i < nsample; ++i) {
            OmUmeshSample sample;
            OM_TRY_DONE(om_umesh_sample_make(solver, i, &sample, mask, u));
            nnewton += sample.nnewton;
            worst = fmax(worst, sample.residual);
            hash = om_hash(u, 3 * (size_t)g->fem.mesh.nnode * sizeof *u, hash);
        }
        time[run] = (bench_now() - start) / nsample;
    }
    BenchRow row = {.bench = "umesh",
                    .scene = "breast phantom",
                    .work = "a sample of the data, mean of the first",
                    .size = g->fem.mesh.nelem,
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

// The probe goes down at places around the top, by 5 to 20 mm.
static OmStatus measure_predictions(OmUmeshPredictor* p, const OmUmeshGrid* g,
                                    const BenchOptions* options) {
    OmStatus status = OM_OK;
    unsigned char* mask = NULL;
    float* u = NULL;
    double* time = NULL;
    uint64_t hash = OM_HASH_SEED;
    OM_ALLOC_DONE(mask, g->fem.mesh.nnode);
    OM_ALLOC_DONE(u, 3 * (size_t)g->fem.mesh.nnode);
    OM_ALLOC_DONE(time, options->nrun);
    for (int run = 0; run < options->nrun; ++run) {
        double sum = 0;
        for (int k = 0; k < NPREDICT; ++k) {
            OmVec3 at = om_vec3(0.03 * cos(k), 0.03 * sin(k), 0.07);
            OmUmeshPatch patch = om_umesh_find_place(g, at);
            OmVec3 way = om_scale(-0.005 - 0.015 * k / NPREDICT, patch.normal);
            OmUmeshTrust trust;
            (void)om_umesh_patch_select(g, &patch, mask);
            for (int i = 0; i < g->fem.mesh.nnode; ++i) {
                u[3 * i] = (float)way.x;
                u[3 * i + 1] = (float)way.y;
                u[3 * i + 2] = (float)way.z;
            }
            double start = bench_now();
            OM_TRY_DONE(om_umesh_predict(p, mask, u, &trust));
            sum += bench_now() - start;
        }
        time[run] = sum / NPREDICT;
    }
    hash = om_hash(u, 3 * (size_t)g->fem.mesh.nnode * sizeof *u, hash);
    BenchRow row = {.bench = "umesh",
                    .scene = "breast phantom",
                    .work = "a prediction, all in",
                    .size = g->fem.mesh.nelem,
                    .nworker = options->nworker,
                    .steps = NPREDICT,
                    .nrun = options->nrun,
                    .reference = "thesis 3.6.1, on a GPU",
                    .reference_ms = THESIS_PREDICT_MS,
                    .goal_ms = GOAL_PREDICT_MS,
                    .hash = hash};
    bench_times(time, options->nrun, &row);
    status = bench_print(&row);
done:
    om_free(mask);
    om_free(u);
    om_free(time);
    return status;
}

static OmStatus bench_predictions(const BenchOptions* options) {
    OmUmeshNet* net;
    OmUmeshPredictor* p;
    if (om_umesh_net_load(WEIGHTS, &net) < 0) {
        fprintf(stderr, "umesh: %s; predictions are left out\n", om_error_message());
        return OM_OK;
    }
    OmStatus status = om_umesh_predictor_create(net, options->nworker, &p);
    if (status == OM_OK) status = measure_predictions(p, om_umesh_net_grid(net), options);
    om_umesh_predictor_destroy(p);
    om_umesh_net_destroy(net);
    return status;
}

OmStatus bench_umesh(const BenchOptions* options) {
    OmUmeshOrganDef organ_def = om_umesh_organ_default_def();
    OmUmeshOrgan* organ;
    OmUmeshSolver* solver;
    OM_TRY(om_umesh_organ_create(&organ_def, &organ));
    OmUmeshDataDef def = om_umesh_data_default_def(organ, NULL);
    OmStatus status = om_umesh_solver_create(&def, &solver);
    if (status == OM_OK) status = measure(solver, om_umesh_organ_grid(organ), options);
    om_umesh_solver_destroy(solver);
    om_umesh_organ_destroy(organ);
    return status < 0 ? status : bench_predictions(options);
}
