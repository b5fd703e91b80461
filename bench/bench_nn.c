// bench_nn.c: the U-Net of thesis Fig. 3.7b on 32 x 24 x 16 nodes, the 32 along width: forward of one sample, and a
// training step of four: parameters into the kernels' layouts, forward, backward, Adam.
#include <stdio.h>
#include <stdlib.h>

#include "bench.h"

#define NCALL 20  // calls a run

static const struct {
    int base;  // channels of the first level
    OmNetType type;
    bool is_training, is_quick;
    double pytorch_ms;  // PyTorch 2.15 at its best, the same type, one core; tools/bench_peers.py
    double goal_ms;     // two cores of the reference machine
} case_table[] = {
    {16, OM_F32, false, true, 12.8, 4},  {16, OM_BF16, false, true, 7.76, 3},
    {16, OM_F32, true, true, 162, 45},   {16, OM_BF16, true, true, 95.3, 25},
    {64, OM_F32, false, false, 176, 55}, {64, OM_BF16, false, false, 86.2, 30},
    {64, OM_F32, true, false, 2360, 0},  {64, OM_BF16, true, false, 1216, 0},
};

typedef struct Work {
    OmNet* net;
    OmNetRun* run;
    OmOptim* optim;
    float *param, *grad, *in, *out, *dout;
    size_t nout;
} Work;

static void work_done(Work* w) {
    om_optim_destroy(w->optim);
    om_net_run_destroy(w->run);
    om_net_destroy(w->net);
    om_free(w->param);
    om_free(w->grad);
    om_free(w->in);
    om_free(w->out);
    om_free(w->dout);
}

static OmStatus work_create(int k, int nworker, Work* w) {
    OmStatus status = OM_OK;
    *w = (Work){0};
    int batch = case_table[k].is_training ? 4 : 1;
    OmUnetDef unet = om_unet_default_def((OmNetShape){3, 16, 24, 32}, 3);
    unet.base_channels = case_table[k].base;
    OM_TRY_DONE(om_unet_create(&unet, &w->net));
    OmNetRunDef def = om_net_run_default_def(batch);
    def.type = case_table[k].type;
    def.is_training = case_table[k].is_training;
    def.nworker = nworker;
    OM_TRY_DONE(om_net_run_create(w->net, &def, &w->run));
    OmOptimDef optim = om_optim_default_def();
    optim.nworker = nworker;
    OM_TRY_DONE(om_optim_create(&optim, w->net, &w->optim));
    size_t nparam = om_net_parameter_size(w->net), nin = (size_t)(batch * om_net_in_size(w->net));
    w->nout = (size_t)(batch * om_net_out_size(w->net));
    OM_ALLOC_DONE(w->param, nparam);
    OM_CALLOC_DONE(w->grad, nparam);
    OM_ALLOC_DONE(w->in, nin);
    OM_CALLOC_DONE(w->out, w->nout);
    OM_ALLOC_DONE(w->dout, w->nout);
    OmRng rng = om_rng_init(1, 2);
    for (size_t i = 0; i < nin; ++i) w->in[i] = (float)om_rng_normal(&rng);
    for (size_t i = 0; i < w->nout; ++i) w->dout[i] = 1e-6f * (float)om_rng_normal(&rng);
    om_net_init_parameters(w->net, 1, w->param);
    OM_TRY_DONE(om_net_run_set_parameters(w->run, w->param));
done:
    if (status < 0) work_done(w);
    return status;
}

static OmStatus call(Work* w, bool is_training) {
    if (is_training) OM_TRY(om_net_run_set_parameters(w->run, w->param));
    OM_TRY(om_net_run_forward(w->run, w->in, w->out));
    if (!is_training) return OM_OK;
    OM_TRY(om_net_run_backward(w->run, w->dout, w->grad, NULL));
    return om_optim_step(w->optim, 1e-4, w->grad, w->param, NULL);
}

static OmStatus measure(int k, const BenchOptions* options) {
    OmStatus status = OM_OK;
    Work w = {0};
    bool is_training = case_table[k].is_training;
    int ntime = 0;
    double* time = om_alloc((size_t)options->nrun, NCALL * sizeof *time);
    if (!time) return OM_NO_MEMORY;
    OM_TRY_DONE(work_create(k, options->nworker, &w));
    for (int i = 0; i < 3; ++i) OM_TRY_DONE(call(&w, is_training));  // caches, threads
    for (int i = 0; i < options->nrun * NCALL; ++i) {
        double begin = bench_now();
        OM_TRY_DONE(call(&w, is_training));
        time[ntime++] = bench_now() - begin;
    }
    char scene[64];
    snprintf(scene, sizeof scene, "U-Net 32x24x16, %d channels, %s", case_table[k].base,
             case_table[k].type == OM_F32 ? "f32" : "bf16");
    BenchRow row = {.bench = "nn",
                    .scene = scene,
                    .work = is_training ? "training step, batch 4" : "forward, batch 1",
                    .size = (int64_t)om_net_parameter_size(w.net),
                    .nworker = options->nworker,
                    .steps = NCALL,
                    .reference = "PyTorch 2.15 at its best, same type, one core",
                    .reference_ms = case_table[k].pytorch_ms,
                    .goal_ms = case_table[k].goal_ms,
                    .hash = om_hash(w.out, w.nout * sizeof *w.out, OM_HASH_SEED)};
    bench_times(time, ntime, &row);
    row.nrun = options->nrun;
    status = bench_print(&row);
done:
    work_done(&w);
    om_free(time);
    return status;
}

OmStatus bench_nn(const BenchOptions* options) {
    for (int k = 0; k < (int)(sizeof case_table / sizeof *case_table); ++k) {
        if (options->is_quick && !case_table[k].is_quick) continue;
        OmStatus status = measure(k, options);
        if (status == OM_UNAVAILABLE) continue;  // no bfloat16 here
        if (status < 0) return status;
    }
    return OM_OK;
}
