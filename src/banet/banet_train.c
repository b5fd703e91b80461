// banet_train.c: the network learns a data set (thesis 4.2.1).
//
// Loss (4.2): 1 - DSC + BCE over the cells near the body, with full weight where a cell holds a surface vertex, because
// only these are read. The optimiser is AdamW with one cycle; the averaged weights are validated. A sample appears as
// one of its images (half turn, mirrors; quarter turns on a square grid) at a random place of the grid, because the
// place decides how poolings cut it. Of a body that is larger than the grid a random part is used: 94 % of the bodies
// fit into 48 x 32 x 16 cells, which take two thirds of the time of 48 x 48 x 16.
//
// Rejected (doc/notes/banet.md): group norm (1 - DSC 0.462 where the plain network has 0.445: it may use the share of
// the grid that a body fills); batches of 32 (0.452, batches of 8 0.403).
#include <limits.h>
#include <string.h>

#include "banet/banet_net_internal.h"
#include "omentum/nn_train.h"

#define COOKIE 0x16ba7a1eu
#define AVERAGE 0.995  // moving average of the weights: factor of a step
#define CLIP 1.0
#define WARMUP 0.2  // fraction of the steps
#define DECAY 0.01

typedef struct Training {
    const OmBanetTrainDef* def;
    OmBanetNet* net;
    OmNet* layers;
    const OmTrainBatch* batch;  // being filled
    OmStatus* status;           // of each sample of the batch                       (batch)
    float* in;                  //               (batch x OM_BANET_NCHANNEL x ncell)
    float* surface;             // of the batch: 1 at cells with a surface vertex  (batch x ncell)
    int ntrain, first_valid;
} Training;

OmBanetTrainDef om_banet_train_default_def(const OmBanetData* data, const char* out_dir) {
    return (OmBanetTrainDef){.data = data,
                             .out_dir = out_dir,
                             .nvalid = data->nsample < 10 ? 1 : data->nsample / 10,
                             .channel = {16, 32, 64, 96, 128},
                             .ngroup = 0,
                             .dropout = 0.1,
                             .dim = {48, 32, 16},
                             .nimage = 4,
                             .type = OM_F32,
                             .batch = 32,
                             .nepoch = 40,
                             .rate = 7e-4,
                             .shell = 0.25,
                             .seed = 1,
                             .cookie = COOKIE};
}

static OmStatus check_def(const OmBanetTrainDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "banet: a definition not made by om_banet_train_default_def");
    OM_CHECK(d->out_dir, OM_INVALID, "banet: no folder to train in");
    OM_CHECK(d->batch >= 1 && d->nepoch >= 1 && d->rate > 0, OM_INVALID,
             "banet: batch = %d, nepoch = %d, rate = %g; all must be above 0", d->batch, d->nepoch,
             d->rate);
    OM_CHECK(!d->group || (d->group->size > 0 && d->batch % d->group->size == 0), OM_INVALID,
             "banet: a batch of %d samples cannot be divided among %d ranks", d->batch,
             d->group->size);
    OM_CHECK(d->shell >= 0 && d->shell <= 1, OM_INVALID, "banet: shell = %g; 0 to 1", d->shell);
    OM_CHECK(
        d->nvalid >= 1 && d->nvalid <= d->data->nsample - d->batch, OM_INVALID,
        "banet: %d samples of %d are kept for validation; at least 1, and a batch of %d besides",
        d->nvalid, d->data->nsample, d->batch);
    OM_CHECK(d->ntrain == 0 || (d->ntrain >= d->batch && d->ntrain <= d->data->nsample - d->nvalid),
             OM_INVALID, "banet: ntrain = %d; 0, or from a batch (%d) to %d samples", d->ntrain,
             d->batch, d->data->nsample - d->nvalid);
    return OM_OK;
}

// ---- filling a batch --------------------------------------------------------------------------------

typedef struct Box {  // of a sample's cells
    int lo[3], hi[3];
} Box;

// Empty at 0 where there are no cells.
static Box find_box(const OmBanetCells* cells, const int dim[3], int symmetry) {
    if (cells->ncell == 0) return (Box){{0}, {0}};
    Box box = {{INT_MAX, INT_MAX, INT_MAX}, {INT_MIN, INT_MIN, INT_MIN}};
    for (int i = 0; i < cells->ncell; ++i) {
        int at[3], to[3];
        om_grid_unpack(cells->grid.dim, (size_t)cells->cell[i], at);
        (void)om_banet_cell_turn(cells->grid.dim, dim, NULL, symmetry, at, to);
        for (int c = 0; c < 3; ++c) {
            box.lo[c] = to[c] < box.lo[c] ? to[c] : box.lo[c];
            box.hi[c] = to[c] > box.hi[c] ? to[c] : box.hi[c];
        }
    }
    return box;
}

// Somewhere from 0 to room; in the middle without random numbers.
static int draw_place(int room, OmRng* rng) {
    if (room <= 0) return 0;
    return rng ? (int)om_rng_below(rng, (uint32_t)room + 1) : room / 2;
}

// The cells in a window of `dim` cells: a copy, or the same where all of them fit.
static OmStatus crop(const OmBanetCells* from, const int dim[3], OmRng* rng, OmBanetCells* to) {
    const Box box = find_box(from, from->grid.dim, 0);
    const size_t num = (size_t)from->ncell;
    bool fits = true;
    int begin[3];
    for (int c = 0; c < 3; ++c) {
        int room = box.hi[c] - box.lo[c] + 1 - dim[c];
        fits = fits && room <= 0;
        begin[c] = box.lo[c] + draw_place(room, rng);
    }
    *to = *from;
    if (fits) return OM_OK;
    OmStatus status = OM_OK;
    to->cell = NULL, to->value = NULL, to->kind = NULL, to->ncell = 0;
    int* kept = NULL;
    OM_ALLOC_DONE(kept, num);
    for (size_t i = 0; i < num; ++i) {
        int at[3];
        bool is_in = true;
        om_grid_unpack(from->grid.dim, (size_t)from->cell[i], at);
        for (int c = 0; c < 3; ++c) is_in = is_in && at[c] >= begin[c] && at[c] < begin[c] + dim[c];
        if (is_in) kept[to->ncell++] = (int)i;
    }
    const size_t nkept = (size_t)to->ncell;
    OM_ALLOC_DONE(to->cell, nkept);
    OM_ALLOC_DONE(to->value, OM_BANET_NCHANNEL * nkept);
    OM_ALLOC_DONE(to->kind, nkept);
    for (size_t k = 0; k < nkept; ++k) {
        const size_t i = (size_t)kept[k];
        to->cell[k] = from->cell[i];
        to->kind[k] = from->kind[i];
        for (size_t c = 0; c < OM_BANET_NCHANNEL; ++c)
            to->value[c * nkept + k] = from->value[c * num + i];
    }
done:
    om_free(kept);
    if (status < 0) om_banet_cells_done(to);
    return status;
}

// Cells into the arrays of sample b.
static OmStatus fill_cells(const Training* t, int b, const OmBanetCells* cells, int symmetry,
                           const int shift[3]) {
    const int* dim = t->def->dim;
    const size_t ncell = om_grid_count(dim), at = (size_t)b * ncell;
    float *in = t->in + OM_BANET_NCHANNEL * at, *weight = t->batch->cell_weight + at;
    float* surface = t->surface + at;
    OM_TRY(om_banet_cells_expand(cells, dim, shift, symmetry, in, t->batch->target + at, weight));
    om__banet_features(dim, in, t->batch->in + BANET_NINPUT * at);
    for (size_t i = 0; i < ncell; ++i) weight[i] *= (float)t->def->shell;
    memset(surface, 0, ncell * sizeof *surface);
    for (int i = 0; i < cells->ncell; ++i) {
        int from[3], to[3];
        if (!(cells->kind[i] & OM_BANET_SURFACE)) continue;
        om_grid_unpack(cells->grid.dim, (size_t)cells->cell[i], from);
        (void)om_banet_cell_turn(cells->grid.dim, dim, shift, symmetry, from, to);
        surface[om_grid_index(dim, to[0], to[1], to[2])] = 1;
        weight[om_grid_index(dim, to[0], to[1], to[2])] = 1;
    }
    return OM_OK;
}

static OmStatus fill_sample(const Training* t, int b) {
    const OmTrainBatch* batch = t->batch;
    const int* dim = t->def->dim;
    const int s = (int)batch->sample[b] + (batch->is_validation ? t->first_valid : 0);
    const OmBanetCells* sample = &t->def->data->sample[s];
    OmRng random = om_rng_init(batch->draw[b], 0), *rng = batch->is_validation ? NULL : &random;
    OmBanetCells cells;
    int symmetry = 0, shift[3];
    OM_TRY(crop(sample, dim, rng, &cells));
    if (rng) symmetry = (int)om_rng_below(rng, OM_BANET_NSYMMETRY);
    if (dim[0] != dim[1]) symmetry &= ~1;  // half turns only
    const Box box = find_box(&cells, dim, symmetry);
    for (int c = 0; c < 3; ++c)
        shift[c] = draw_place(dim[c] - 1 - box.hi[c] + box.lo[c], rng) - box.lo[c];
    OmStatus status = fill_cells(t, b, &cells, symmetry, shift);
    if (cells.cell != sample->cell) om_banet_cells_done(&cells);
    return status;
}

static void fill_samples(void* ctx, int begin, int end, int block) {
    const Training* t = ctx;
    (void)block;
    for (int b = begin; b < end; ++b) t->status[b] = fill_sample(t, b);
}

static OmStatus fill(void* ctx, const OmTrainBatch* batch) {
    Training* t = ctx;
    t->batch = batch;
    om_parallel_for(t->def->nworker, batch->count, 1, fill_samples, t);
    for (int b = 0; b < batch->count; ++b)
        // Again, for the message of this thread.
        if (t->status[b] < 0) return fill_sample(t, b);
    return OM_OK;
}

// Sum of 1 - DSC over the samples, at an output of 0. Validation fills and measures batch by batch.
static double measure(void* ctx, const int64_t* sample, const float* out, const float* target,
                      int count) {
    const Training* t = ctx;
    const size_t ncell = om_grid_count(t->def->dim);
    double sum = 0;
    (void)sample;
    for (int b = 0; b < count; ++b) {
        double both = 0, either = 0;
        for (size_t i = (size_t)b * ncell; i < (size_t)(b + 1) * ncell; ++i) {
            if (!(t->surface[i] > 0)) continue;
            bool is_found = out[i] > 0, is_true = target[i] > 0;
            both += is_found && is_true;
            either += is_found + is_true;
        }
        sum += 1 - (either > 0 ? 2 * both / either : 1);
    }
    return sum;
}

// ---- training ---------------------------------------------------------------------------------------

static OmStatus read_start(const OmBanetTrainDef* def, OmBanetNet* net) {
    OmBanetNet* start;
    om_net_init_parameters(net->net, def->seed, net->param);
    if (!def->start) return OM_OK;
    OM_TRY(om_banet_net_load(def->start, &start));
    bool is_alike = memcmp(start->channel, net->channel, sizeof net->channel) == 0 &&
                    start->ngroup == net->ngroup;
    if (is_alike) memcpy(net->param, start->param, om_banet_net_size(net) * sizeof *net->param);
    om_banet_net_destroy(start);
    OM_CHECK(is_alike, OM_INVALID, "%s: has other channels or norms than the network to train",
             def->start);
    return OM_OK;
}

static OmStatus run_loop(Training* t, const OmProgress* progress, OmTrainResult* result) {
    const OmBanetTrainDef* def = t->def;
    OmTrainDef loop = om_train_default_def(t->layers, fill, t);
    loop.ntrain = t->ntrain;
    loop.nvalid = def->nvalid;
    loop.batch = def->batch / (def->group ? def->group->size : 1);
    loop.group = def->group;
    loop.nepoch = def->nepoch;
    loop.loss = (OmLoss){.nterm = 2, .term = {{OM_LOSS_DICE, 1}, {OM_LOSS_BCE, 1}}};
    loop.has_cell_weight = true;
    loop.optim.kind = OM_OPTIM_ADAMW;
    loop.optim.weight_decay = DECAY;
    loop.optim.average = AVERAGE;
    loop.optim.clip_norm = CLIP;
    loop.schedule = om_schedule_one_cycle(def->rate);
    loop.schedule.warmup = WARMUP;
    loop.type = def->type;
    loop.nworker = def->nworker;
    loop.seed = def->seed;
    loop.metric = measure;
    loop.dir = def->out_dir;
    loop.data_hash = om_hash(&def->shell, sizeof def->shell, def->data->hash);
    return om_train_run(&loop, progress, t->net->param, result);
}

static OmStatus add_facts(const OmBanetTrainDef* def, int ntrain, const OmTrainResult* result,
                          const OmBanetEval* eval, OmFacts* facts) {
    if (def->command) OM_TRY(om_facts_add(facts, "command", "%s", def->command));
    if (def->start) OM_TRY(om_facts_add(facts, "start", "%s", def->start));
    OM_TRY(om_facts_add(facts, "seed", "%llu", (unsigned long long)def->seed));
    OM_TRY(om_facts_add(facts, "data", "%016llx", (unsigned long long)def->data->hash));
    OM_TRY(om__banet_origin_add(def->data, facts));
    OM_TRY(om_facts_add(facts, "dropout", "%g", def->dropout));
    OM_TRY(om_facts_add(facts, "samples", "%d", ntrain));
    OM_TRY(om_facts_add(facts, "epochs", "%d of %d", result->best_epoch, result->nepoch));
    OM_TRY(om_facts_add(facts, "validation_dsc", "%.4f", eval->mean_dsc));
    OM_TRY(om_facts_add(facts, "validation_tpr", "%.4f", eval->mean_tpr));
    return om_facts_add(facts, "validation_ece", "%.4f", eval->ece);
}

// Calibrate, and write weights and report.
static OmStatus keep(Training* t, const OmTrainResult* result, const OmProgress* progress,
                     OmBanetTrainSummary* summary) {
    const OmBanetTrainDef* def = t->def;
    BanetOutputs outputs = {0};
    OmBanetEval eval = {0};
    char path[1024];
    OmStatus status;
    OM_TRY_DONE(om__banet_outputs_make(t->net, def->data, t->first_valid, def->nvalid, def->nworker,
                                       progress, &outputs));
    OM_TRY_DONE(om__banet_calibrate(t->net, &outputs));
    OM_TRY_DONE(om__banet_eval_outputs(t->net, &outputs, &eval));
    OM_TRY_DONE(add_facts(def, t->ntrain, result, &eval, &t->net->facts));
    OM_TRY_DONE(om_path_join(def->out_dir, "weights.safetensors", path, sizeof path));
    OM_TRY_DONE(om__banet_net_save(t->net, path));
    OM_TRY_DONE(om__banet_report_training(def, t->net, result, &eval));
    summary->dsc = eval.mean_dsc;
    summary->tpr = eval.mean_tpr;
    summary->ece = eval.ece;
    summary->threshold = t->net->threshold;
done:
    om__banet_outputs_done(&outputs);
    om_banet_eval_done(&eval);
    return status;
}

static OmStatus training_init(Training* t) {
    const OmBanetTrainDef* def = t->def;
    const size_t num = (size_t)def->batch * om_grid_count(def->dim);
    BanetLayers layers = {.ngroup = def->ngroup, .dropout = def->dropout, .nimage = def->nimage};
    memcpy(layers.channel, def->channel, sizeof layers.channel);
    OM_TRY(om__banet_net_create(&layers, &t->net));
    OM_TRY(om__banet_net_layers(t->net, def->dim, &t->layers));
    OM_TRY(read_start(def, t->net));
    OM_ALLOC(t->status, def->batch);
    OM_ALLOC(t->in, OM_BANET_NCHANNEL * num);
    OM_ALLOC(t->surface, num);
    return OM_OK;
}

OmStatus om_banet_train(const OmBanetTrainDef* def, const OmProgress* progress,
                        OmBanetTrainSummary* summary) {
    *summary = (OmBanetTrainSummary){0};
    OM_TRY(check_def(def));
    const int first_valid = def->data->nsample - def->nvalid;
    Training t = {.def = def, .first_valid = first_valid};
    t.ntrain = def->ntrain > 0 ? def->ntrain : first_valid;
    OmTrainResult result = {0};
    OmFolder folder = {0};
    OmStatus status;
    const bool is_first = !def->group || def->group->rank == 0;
    status = is_first ? om_folder_open(def->out_dir, OM_BANET_NET_KIND, &folder) : OM_OK;
    if (status == OM_OK) status = training_init(&t);
    OM_TRY_DONE(om_train_group_agree(def->group, status));
    OM_TRY_DONE(run_loop(&t, progress, &result));
    if (is_first) OM_TRY_DONE(keep(&t, &result, progress, summary));
    summary->best_epoch = result.best_epoch;
    summary->nepoch = result.nepoch;
    summary->nstep = result.nstep;
    summary->seconds = result.seconds;
    summary->is_resumed = result.is_resumed;
done:
    om_folder_end(&folder);
    om_train_result_done(&result);
    om_net_destroy(t.layers);
    om_banet_net_destroy(t.net);
    om_free(t.status);
    om_free(t.in);
    om_free(t.surface);
    return status;
}
