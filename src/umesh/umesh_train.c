// umesh_train.c: the network learns an organ's samples.
//
// The network learns the difference to the linear solution. The loss is the mean norm error (3.17) over free nodes, the
// measure of the evaluation, plus SLOPE times the mean norm error of differences between neighbours. Without the second
// term elements beside the probe invert; with it the first term, too, is 7 % lower. The loss is in metres: outputs are
// relative to the size of the input, so the weight of a sample is its size. The thesis minimises the square of the
// error (3.16), in which the largest displacements dominate. With equal weights a network spends its capacity on small
// samples, for which the linear solution is already accurate. The last samples of the data are for validation, which
// selects the epoch; the test is another data set.
#include <math.h>
#include <string.h>

#include "omentum/nn_train.h"
#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

#define COOKIE 0x03e540a1u
#define AVERAGE 0.999  // moving average of the weights: factor of a step
#define CLIP 1.0
#define WARMUP 0.1  // fraction of the steps
#define SLOPE 3.0   // weight of the differences between neighbours in the loss

typedef struct Training {
    const OmUmeshTrainDef* def;
    OmUmeshNet* net;
    const float* fixed_channel;   // (UMESH_NCHANNEL x npoint)
    float* linear;                // solutions of all samples, m        (nsample x nnode x 3)
    double* size;                 // of all samples, m                                (nsample)
    float* work;                  //                                               (nnode x 3)
    int* mirror[3];               // of nodes, null without a plane of symmetry       (nnode)
    float *image, *linear_image;  // of the sample                                 (nnode x 3)
    unsigned char* mask_image;    //                                                   (nnode)
    double mean_size;             // of the training samples, m
    const OmProgress* progress;
    int ntrain;
    double linear_error;  // mean norm error of the linear solutions on the validation samples, m
} Training;

OmUmeshTrainDef om_umesh_train_default_def(const OmUmeshData* data, const char* out_dir) {
    OmUmeshTrainDef def = {.data = data,
                           .out_dir = out_dir,
                           .nvalid = data->nsample < 10 ? 1 : data->nsample / 10,
                           .base_channels = 16,
                           .nlevel = 3,
                           .type = OM_F32,
                           .batch = 4,
                           .nepoch = 100,
                           .rate = 1e-3,
                           .poisson = 0.45,
                           .seed = 1,
                           .cookie = COOKIE};
    return def;
}

static OmStatus validate(const OmUmeshTrainDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID,
             "umesh: a definition not made by om_umesh_train_default_def");
    OM_CHECK(def->out_dir, OM_INVALID, "umesh: no folder to train in");
    OM_CHECK(def->base_channels >= 1 && def->base_channels <= 256, OM_INVALID,
             "umesh: base_channels = %d; 1 to 256, fast when a multiple of 16", def->base_channels);
    OM_CHECK(def->nlevel >= 1 && def->nlevel <= 6, OM_INVALID, "umesh: nlevel = %d; 1 to 6",
             def->nlevel);
    OM_CHECK(def->batch >= 1 && def->nepoch >= 1 && def->rate > 0, OM_INVALID,
             "umesh: batch = %d, nepoch = %d, rate = %g; all must be above 0", def->batch,
             def->nepoch, def->rate);
    OM_CHECK(
        def->nvalid >= 1 && def->nvalid <= def->data->nsample - def->batch, OM_INVALID,
        "umesh: %d samples of %d are kept for validation; at least 1, and a batch of %d besides",
        def->nvalid, def->data->nsample, def->batch);
    return OM_OK;
}

// ---- callbacks of the training loop -----------------------------------------------------------------

// A training sample, or its image in randomly drawn planes of symmetry.
static void reflect(const Training* t, uint64_t draw, const unsigned char** mask, const float** u,
                    const float** linear) {
    const OmUmeshGrid* g = &t->net->grid;
    OmRng rng = om_rng_init(draw, 0);
    bool is_on[3], is_any = false;
    for (int c = 0; c < 3; ++c) {
        is_on[c] = t->mirror[c] && om_rng_below(&rng, 2);
        is_any = is_any || is_on[c];
    }
    if (!is_any) return;
    om__umesh_reflect(g, t->mirror, is_on, *u, t->image);
    om__umesh_reflect(g, t->mirror, is_on, *linear, t->linear_image);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        int image = i;
        for (int c = 0; c < 3; ++c)
            if (is_on[c]) image = t->mirror[c][image];
        t->mask_image[image] = (*mask)[i];
    }
    *mask = t->mask_image;
    *u = t->image;
    *linear = t->linear_image;
}

static OmStatus fill(void* ctx, const OmTrainBatch* batch) {
    const Training* t = ctx;
    const OmUmeshData* data = t->def->data;
    const OmUmeshGrid* g = &t->net->grid;
    size_t nnode = (size_t)g->fem.mesh.nnode, npoint = (size_t)g->fem.npoint;
    for (int b = 0; b < batch->count; ++b) {
        size_t s = (size_t)batch->sample[b] + (batch->is_validation ? (size_t)t->ntrain : 0);
        float* in = batch->in + (size_t)b * UMESH_NCHANNEL * npoint;
        float* target = batch->target + (size_t)b * 3 * npoint;
        const unsigned char* mask = data->mask + s * nnode;
        const float *u = data->u + 3 * s * nnode, *linear = t->linear + 3 * s * nnode;
        memcpy(in, t->fixed_channel, UMESH_NCHANNEL * npoint * sizeof *in);
        if (!batch->is_validation) reflect(t, batch->draw[b], &mask, &u, &linear);
        om__umesh_fill_input(t->net, mask, u, linear, 1, t->work, in);
        batch->weight[b] = (float)(t->size[s] / t->mean_size);
        float over = (float)(1 / (t->net->correction * t->size[s]));
        memset(target, 0, 3 * npoint * sizeof *target);
        for (size_t i = 0; i < nnode; ++i)
            for (size_t c = 0; c < 3; ++c)
                target[c * npoint + (size_t)g->fem.node_point[i]] =
                    over * (u[3 * i + c] - linear[3 * i + c]);
    }
    return OM_OK;
}

// Sum of mean norm errors, m.
static double measure(void* ctx, const int64_t* sample, const float* out, const float* target,
                      int count) {
    const Training* t = ctx;
    const OmUmeshGrid* g = &t->net->grid;
    size_t npoint = (size_t)g->fem.npoint;
    double sum = 0;
    for (int b = 0; b < count; ++b, out += 3 * npoint, target += 3 * npoint) {
        double error = 0;
        int num = 0;
        for (int i = 0; i < g->fem.mesh.nnode; ++i) {
            if (g->fem.fixed[i]) continue;
            double d2 = 0;
            for (size_t c = 0; c < 3; ++c) {
                size_t at = c * npoint + (size_t)g->fem.node_point[i];
                d2 += (double)(out[at] - target[at]) * (double)(out[at] - target[at]);
            }
            error += sqrt(d2);
            ++num;
        }
        sum += num ? t->net->correction * t->size[t->ntrain + sample[b]] * error / num : 0;
    }
    return sum;
}

// ---- training ---------------------------------------------------------------------------------------

// Root mean square of the displacements of patches.
static double find_scale(const OmUmeshData* data, int ntrain) {
    size_t nnode = (size_t)data->grid.fem.mesh.nnode;
    double sum = 0;
    int64_t num = 0;
    for (size_t n = 0; n < (size_t)ntrain * nnode; ++n) {
        if (!data->mask[n]) continue;
        for (size_t c = 0; c < 3; ++c)
            sum += (double)data->u[3 * n + c] * (double)data->u[3 * n + c];
        ++num;
    }
    return num && sum > 0 ? sqrt(sum / (double)num) : 1e-3;
}

OmStatus om__umesh_measure_balance(const OmUmeshData* data, double poisson, const float* linear,
                                   int first, int n, double* balance) {
    const OmFemGrid* g = &data->grid.fem;
    const size_t at = (size_t)first * (size_t)g->mesh.nnode;
    const unsigned char* mask = data->mask + at;
    double *left = NULL, *all = NULL;
    int num = 0;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(left, n);
    OM_ALLOC_DONE(all, n);
    OM_TRY_DONE(om_fem_grid_eval_residual(g, poisson, n, mask, data->u + 3 * at, left));
    OM_TRY_DONE(om_fem_grid_eval_residual(g, poisson, n, mask, linear + 3 * at, all));
    for (int s = 0; s < n; ++s)
        if (all[s] > 0) left[num++] = left[s] / all[s];
    om_sort_doubles(left, num);
    *balance = num > 0 ? left[num / 2] : 0;
done:
    om_free(left);
    om_free(all);
    return status;
}

// The linear solutions of all samples, and the scale of the corrections: the size of their errors on free nodes,
// relative to the sizes of the inputs.
static OmStatus solve_linear(Training* t) {
    const OmUmeshData* data = t->def->data;
    const OmUmeshGrid* g = &t->net->grid;
    size_t nnode = (size_t)g->fem.mesh.nnode;
    double sum = 0, square = 0, num = 0;
    OM_ALLOC(t->linear, 3 * nnode * (size_t)data->nsample);
    OM_ALLOC(t->size, data->nsample);
    OM_ALLOC(t->work, 3 * nnode);
    for (int s = 0; s < data->nsample; ++s) {
        const float* u = data->u + 3 * (size_t)s * nnode;
        float* linear = t->linear + 3 * (size_t)s * nnode;
        t->size[s] = om__umesh_size(g, data->mask + (size_t)s * nnode, u);
        OM_TRY(om_fem_grid_linear_solve(t->net->linear, data->mask + (size_t)s * nnode, u,
                                        t->def->nworker, linear));
        OM_TRY(om_progress_report(t->progress, "linear answers", s + 1, data->nsample));
        if (s >= t->ntrain) {
            t->linear_error += om__umesh_mean_error(g, u, linear) / t->def->nvalid;
            continue;
        }
        t->mean_size += t->size[s] / t->ntrain;
        om_fem_grid_second_order(&g->fem, t->net->poisson, t->size[s], linear, t->work);
        for (size_t i = 0; i < nnode; ++i) {
            if (g->fem.fixed[i]) continue;
            for (size_t c = 0; c < 3; ++c) {
                double d = ((double)u[3 * i + c] - (double)linear[3 * i + c]) / t->size[s];
                sum += d * d;
                square += (double)t->work[3 * i + c] * (double)t->work[3 * i + c];
            }
            num += 1;
        }
    }
    t->net->correction = num > 0 && sum > 0 ? sqrt(sum / num) : 1;
    t->net->second = num > 0 && square > 0 ? sqrt(square / num) : 1;
    return om__umesh_measure_balance(data, t->net->poisson, t->linear, t->ntrain, t->def->nvalid,
                                     &t->net->balance);
}

static OmStatus add_facts(const OmUmeshTrainDef* def, const OmTrainResult* result,
                          OmUmeshNet* net) {
    if (def->command) OM_TRY(om_facts_add(&net->facts, "command", "%s", def->command));
    OM_TRY(om_facts_add(&net->facts, "seed", "%llu", (unsigned long long)def->seed));
    OM_TRY(om_facts_add(&net->facts, "data", "%016llx", (unsigned long long)def->data->hash));
    OM_TRY(om_facts_add(&net->facts, "samples", "%d", def->data->nsample - def->nvalid));
    OM_TRY(om_facts_add(&net->facts, "epochs", "%d", result->best_epoch));
    return om_facts_add(&net->facts, "validation_error_mm", "%.5f", 1e3 * result->best_value);
}

// Write weights, metadata and report after the training loop.
static OmStatus keep(Training* t, const OmTrainResult* result) {
    const OmUmeshTrainDef* def = t->def;
    char path[1024];
    OmUmeshEval eval;
    OM_TRY(add_facts(def, result, t->net));
    OM_TRY(om__umesh_net_set_balance(t->net, t->net->balance));
    OM_TRY(om_path_join(def->out_dir, "weights.safetensors", path, sizeof path));
    OM_TRY(om__umesh_net_save(t->net, path));
    OM_TRY(om_umesh_eval(t->net, def->data, t->ntrain, def->nvalid, OM_UMESH_TOLERANCE,
                         def->nworker, &eval));
    OmStatus status = om__umesh_report_training(def, t->net, result, &eval);
    om_umesh_eval_done(&eval);
    return status;
}

// Set the last layer to zero: training starts at the linear solution.
static void start_at_linear(OmUmeshNet* net) {
    const OmLayer* head = NULL;
    for (int i = 0; i < om_net_layer_count(net->net); ++i)
        if (om_net_layer(net->net, i)->weight >= 0) head = om_net_layer(net->net, i);
    const int entry[] = {head->weight, head->bias};
    for (int k = 0; k < 2; ++k) {
        const OmNetParameter* p = om_net_parameter(net->net, entry[k]);
        memset(net->param + p->adr, 0, (size_t)p->num * sizeof *net->param);
    }
}

static OmStatus run_loop(Training* t, const float* weight, OmTrainResult* result) {
    const OmUmeshTrainDef* def = t->def;
    OmTrainDef loop = om_train_default_def(t->net->net, fill, t);
    loop.ntrain = t->ntrain;
    loop.nvalid = def->nvalid;
    loop.batch = def->batch;
    loop.nepoch = def->nepoch;
    loop.loss = (OmLoss){.nterm = 2, .term = {{OM_LOSS_NORM, 1}, {OM_LOSS_SLOPE, SLOPE}}};
    loop.loss.weight = weight;
    loop.optim.kind = OM_OPTIM_ADAM;
    loop.optim.weight_decay = 0;
    loop.optim.average = AVERAGE;
    loop.optim.clip_norm = CLIP;
    loop.schedule = om_schedule_one_cycle(def->rate);
    loop.schedule.warmup = WARMUP;
    loop.type = def->type;
    loop.nworker = def->nworker;
    loop.seed = def->seed;
    loop.metric = measure;
    loop.dir = def->out_dir;
    loop.data_hash = def->data->hash;
    om_net_init_parameters(t->net->net, def->seed, t->net->param);
    start_at_linear(t->net);
    return om_train_run(&loop, t->progress, t->net->param, result);
}

OmStatus om_umesh_train(const OmUmeshTrainDef* def, const OmProgress* progress,
                        OmUmeshTrainSummary* summary) {
    *summary = (OmUmeshTrainSummary){0};
    OM_TRY(validate(def));
    const OmUmeshGrid* g = &def->data->grid;
    Training t = {.def = def, .progress = progress, .ntrain = def->data->nsample - def->nvalid};
    OmTrainResult result = {0};
    float *channel = NULL, *weight = NULL;
    OmFolder folder = {0};
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_folder_open(def->out_dir, OM_UMESH_NET_KIND, &folder));
    OM_TRY_DONE(om__umesh_net_create(g, def->poisson, def->base_channels, def->nlevel, &t.net));
    OM_TRY_DONE(om__umesh_region_make(t.net, def->data, t.ntrain));
    t.net->scale = find_scale(def->data, t.ntrain);
    OM_TRY_DONE(solve_linear(&t));
    OM_TRY_DONE(om__umesh_find_mirrors(g, t.mirror));
    OM_ALLOC_DONE(t.image, 3 * (size_t)g->fem.mesh.nnode);
    OM_ALLOC_DONE(t.linear_image, 3 * (size_t)g->fem.mesh.nnode);
    OM_ALLOC_DONE(t.mask_image, g->fem.mesh.nnode);
    OM_ALLOC_DONE(channel, UMESH_NCHANNEL * (size_t)g->fem.npoint);
    OM_CALLOC_DONE(weight, g->fem.npoint);
    om__umesh_fill_fixed_channels(g, channel);
    t.fixed_channel = channel;
    for (int i = 0; i < g->fem.mesh.nnode; ++i)
        weight[g->fem.node_point[i]] = g->fem.fixed[i] ? 0 : 1;
    OM_TRY_DONE(run_loop(&t, weight, &result));
    OM_TRY_DONE(keep(&t, &result));
    *summary = (OmUmeshTrainSummary){.valid_error = result.best_value,
                                     .linear_error = t.linear_error,
                                     .best_epoch = result.best_epoch,
                                     .nepoch = result.nepoch,
                                     .nstep = result.nstep,
                                     .seconds = result.seconds,
                                     .is_resumed = result.is_resumed};
done:
    om_folder_end(&folder);
    om_train_result_done(&result);
    om_free(t.linear);
    om_free(t.size);
    om_free(t.work);
    for (int c = 0; c < 3; ++c) om_free(t.mirror[c]);
    om_free(t.image);
    om_free(t.linear_image);
    om_free(t.mask_image);
    om_free(weight);
    om_free(channel);
    om_umesh_net_destroy(t.net);
    return status;
}
