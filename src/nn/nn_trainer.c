// nn_trainer.c: the loop of training.
//
//     epoch:  order = permutation of the samples drawn from (seed, epoch)
//             batch:  fill, forward, loss, backward, [mean over ranks], descend
//             validate with the averaged weights; keep the best; stop when patience runs out
//
// Rank r of R takes samples [(b R + r) B, (b R + r + 1) B) of the order as batch b, so that R ranks with batches of B
// process the same samples as one rank with batches of R B. A rank that fails or is cancelled informs the others
// before the gradients are averaged: then no rank descends, and all stop at the same step.
//
// A step is a function of (state, step number): an interrupted training continues from its last checkpoint through
// the same states.
#include <math.h>
#include <string.h>

#include "nn/nn_train_internal.h"

#define COOKIE 0x7472616eu
#define METRICS_PERIOD 1.0  // s between writes of metrics.csv when epochs are shorter

typedef struct Loop {
    const OmTrainDef* def;
    const OmProgress* progress;
    OmTrainState state;
    OmNetRun *run, *valid_run;
    OmNetShape out_shape;
    int64_t in_size, out_size, nparam, nbatch;  // values of a sample; batches of an epoch
    int rank, nrank;
    int64_t *order, *sample;                   // of the epoch (ntrain), of the batch (batch)
    uint64_t* draw;                            // (batch)
    float *in, *target, *out, *dout, *weight;  // weight: of the batch's samples (batch)
    float* cell_weight;                        // of the batch's cells, or null
    float *grad, *mean;                        // (parameters); mean: the averaged weights
    double start, last_save, last_metrics;
    OmStatus pending;  // a file error of this rank that the other ranks do not know yet
} Loop;

OmTrainDef om_train_default_def(const OmNet* net, OmTrainFillFn fill, void* ctx) {
    return (OmTrainDef){.cookie = COOKIE,
                        .net = net,
                        .fill = fill,
                        .ctx = ctx,
                        .batch = 4,
                        .nepoch = 100,
                        .valid_every = 1,
                        .loss = om_loss(OM_LOSS_MSE),
                        .optim = om_optim_default_def(),
                        .schedule = om_schedule_one_cycle(1e-3),
                        .type = OM_F32,
                        .seed = 1,
                        .checkpoint_period = 60};
}

// ---- beginning ----------------------------------------------------------------------------------------

static OmStatus check_def(const OmTrainDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID, "training: begin with om_train_default_def()");
    OM_CHECK(d->net && d->fill, OM_INVALID, "training: net and fill are needed");
    OM_CHECK(d->batch >= 1, OM_INVALID, "training: batch is %d, must be 1 or more", d->batch);
    OM_CHECK(d->nepoch >= 1, OM_INVALID, "training: nepoch is %d, must be 1 or more", d->nepoch);
    OM_CHECK(d->valid_every >= 1, OM_INVALID, "training: valid_every is %d, must be 1 or more",
             d->valid_every);
    OM_CHECK(d->patience >= 0, OM_INVALID, "training: patience is %d, must not be negative",
             d->patience);
    OM_CHECK(d->nvalid >= 0, OM_INVALID, "training: nvalid is %d, must not be negative", d->nvalid);
    OM_CHECK(d->patience == 0 || d->nvalid > 0, OM_INVALID,
             "training: patience needs validation samples, nvalid is 0");
    OM_CHECK(d->checkpoint_period >= 0, OM_INVALID,
             "training: checkpoint_period is %g, must not be negative", d->checkpoint_period);
    OM_CHECK(!d->has_cell_weight || !d->loss.weight, OM_INVALID,
             "training: has_cell_weight and loss.weight exclude each other");
    int nrank = d->group ? d->group->size : 1;
    OM_CHECK(!d->group || (d->group->mean && d->group->rank >= 0 && d->group->rank < nrank),
             OM_INVALID, "training: a group of rank %d of %d", d->group->rank, nrank);
    OM_CHECK(d->ntrain / d->batch >= nrank, OM_INVALID,
             "training: %d samples do not fill one batch of %d on each of %d ranks", d->ntrain,
             d->batch, nrank);
    OM_TRY(om__schedule_check(&d->schedule));
    OM_TRY(om__optim_check(&d->optim));
    double weight_sum;
    return om__loss_check(&d->loss, d->batch, om_net_layer(d->net, om_net_output(d->net))->shape,
                          &weight_sum);
}

static OmStatus create_runs(Loop* l) {
    const OmTrainDef* d = l->def;
    OmNetRunDef run = om_net_run_default_def(d->batch);
    run.type = d->type;
    run.nworker = d->nworker;
    run.seed = d->seed;
    if (d->nvalid > 0) OM_TRY(om_net_run_create(d->net, &run, &l->valid_run));
    run.is_training = true;
    return om_net_run_create(d->net, &run, &l->run);
}

static OmStatus create_arrays(Loop* l) {
    const OmTrainDef* d = l->def;
    int64_t batch = d->batch;
    OM_ALLOC(l->order, d->ntrain);
    OM_ALLOC(l->sample, batch);
    OM_ALLOC(l->draw, batch);
    OM_ALLOC(l->weight, batch);
    OM_ALLOC(l->target, batch * l->out_size);
    OM_ALLOC(l->out, batch * l->out_size);
    OM_ALLOC(l->dout, batch * l->out_size);
    if (d->has_cell_weight) OM_ALLOC(l->cell_weight, batch * l->out_size / l->out_shape.c);
    OM_ALLOC(l->grad, l->nparam);
    OM_ALLOC(l->mean, l->nparam);
    OM_ALLOC(l->state.best, l->nparam);
    OM_ALLOC(l->state.row, d->nepoch);
    // Clear a last batch of validation that is not full, so that no old values are computed with.
    l->in = om_calloc((size_t)(batch * l->in_size), sizeof *l->in);
    return l->in ? OM_OK : OM_NO_MEMORY;
}

static void loop_done(Loop* l) {
    om_net_run_destroy(l->run);
    om_net_run_destroy(l->valid_run);
    om_optim_destroy(l->state.optim);
    om_free(l->order);
    om_free(l->sample);
    om_free(l->draw);
    om_free(l->weight);
    om_free(l->in);
    om_free(l->target);
    om_free(l->out);
    om_free(l->dout);
    om_free(l->cell_weight);
    om_free(l->grad);
    om_free(l->mean);
    om_free(l->state.best);
    om_free(l->state.row);
}

static OmStatus loop_init(Loop* l, bool* is_resumed) {
    const OmTrainDef* d = l->def;
    l->nparam = (int64_t)om_net_parameter_size(d->net);
    l->in_size = om_net_in_size(d->net);
    l->out_size = om_net_out_size(d->net);
    l->out_shape = om_net_layer(d->net, om_net_output(d->net))->shape;
    l->rank = d->group ? d->group->rank : 0;
    l->nrank = d->group ? d->group->size : 1;
    l->nbatch = d->ntrain / (d->batch * l->nrank);
    OM_TRY(om_optim_create(&d->optim, d->net, &l->state.optim));
    OM_TRY(create_arrays(l));
    OM_TRY(create_runs(l));
    if (d->dir) {
        OM_TRY(om_path_make_dir(d->dir));
        OM_TRY(om__train_load(d, &l->state, is_resumed));
    }
    l->start = l->last_save = l->last_metrics = om_clock_now();
    return OM_OK;
}

// ---- batches ------------------------------------------------------------------------------------------

static void shuffle(Loop* l, int epoch) {
    OmRng rng = om_rng_init(l->def->seed, (uint64_t)epoch);
    for (int i = 0; i < l->def->ntrain; ++i) l->order[i] = i;
    for (int i = l->def->ntrain - 1; i > 0; --i) {
        uint32_t k = om_rng_below(&rng, (uint32_t)i + 1);
        int64_t other = l->order[k];
        l->order[k] = l->order[i];
        l->order[i] = other;
    }
}

static OmStatus fill_batch(Loop* l, bool is_validation, int epoch, int count) {
    for (int i = 0; i < count; ++i) {
        // Validation uses the same random draws in every epoch.
        uint64_t name[3] = {l->def->seed, is_validation ? UINT64_MAX : (uint64_t)epoch,
                            (uint64_t)l->sample[i]};
        l->draw[i] = om_hash(name, sizeof name, OM_HASH_SEED);
        l->weight[i] = 1;
    }
    OmTrainBatch batch = {.is_validation = is_validation,
                          .epoch = epoch,
                          .count = count,
                          .sample = l->sample,
                          .draw = l->draw,
                          .in = l->in,
                          .target = l->target,
                          .weight = l->weight,
                          .cell_weight = l->cell_weight};
    return l->def->fill(l->def->ctx, &batch);
}

static OmStatus eval_loss(Loop* l, int count, double* value, float* dout) {
    OmLoss loss = l->def->loss;
    loss.sample_weight = l->weight;
    loss.cell_weight = l->cell_weight;
    return om_loss_eval(&loss, count, l->out_shape, l->out, l->target, l->def->nworker, value,
                        dout);
}

// The gradient of this rank's part of batch b.
static OmStatus differentiate(Loop* l, int64_t b, double* loss) {
    const OmTrainDef* d = l->def;
    OmTrainState* s = &l->state;
    const int64_t* first = l->order + (b * l->nrank + l->rank) * d->batch;
    memcpy(l->sample, first, (size_t)d->batch * sizeof *first);
    OM_TRY(fill_batch(l, false, s->nrow, d->batch));
    OM_TRY(om_net_run_set_parameters(l->run, s->param));
    om_net_run_set_step(l->run, (uint64_t)(s->nrow * l->nbatch + b), (int64_t)l->rank * d->batch);
    OM_TRY(om_net_run_forward(l->run, l->in, l->out));
    OM_TRY(eval_loss(l, d->batch, loss, l->dout));
    OM_CHECK(isfinite(*loss), OM_INVALID,
             "epoch %d, batch %lld: the loss is %g; lower the learning rate (peak %g) or clip the "
             "gradient",
             s->nrow + 1, (long long)b, *loss, d->schedule.peak);
    return om_net_run_backward(l->run, l->dout, l->grad, NULL);
}

// The result of the batch on all ranks: the first failure or cancellation ends it for all.
static OmStatus meet(const Loop* l, OmStatus status, double* loss) {
    const OmTrainGroup* group = l->def->group;
    if (!group) return status;
    bool is_cancelled = status == OM_CANCELLED;
    float word[3] = {status < 0 ? 0 : (float)*loss, status < 0 && !is_cancelled, is_cancelled};
    OmStatus met = group->mean(group->ctx, word, 3);
    if (status < 0) return status;
    OM_TRY(met);
    OM_CHECK(!(word[1] > 0), OM_INVALID, "training: another rank failed");
    OM_CHECK(!(word[2] > 0), OM_CANCELLED, "training: stopped by another rank");
    *loss = (double)word[0];
    return OM_OK;
}

static OmStatus average_over_ranks(const Loop* l, float* value, int64_t count) {
    const OmTrainGroup* group = l->def->group;
    return group && count > 0 ? group->mean(group->ctx, value, count) : OM_OK;
}

static OmStatus update_statistics(Loop* l) {
    om_net_run_update_statistics(l->run, l->state.param);
    for (int i = 0; i < om_net_parameter_count(l->def->net); ++i) {
        const OmNetParameter* p = om_net_parameter(l->def->net, i);
        if (!p->is_trained) OM_TRY(average_over_ranks(l, l->state.param + p->adr, p->num));
    }
    return OM_OK;
}

static OmStatus train_batch(Loop* l, int64_t b) {
    const OmTrainDef* d = l->def;
    OmTrainState* s = &l->state;
    double loss = 0, norm = 0;
    int64_t step = s->nrow * l->nbatch + b, nstep = d->nepoch * l->nbatch;
    OmStatus status = l->pending;
    if (status == OM_OK)
        status = om_progress_report(l->progress, "training", (double)step, (double)nstep);
    if (status == OM_OK) status = differentiate(l, b, &loss);
    OM_TRY(meet(l, status, &loss));
    OM_TRY(average_over_ranks(l, l->grad, l->nparam));
    s->rate = om_schedule_rate(&d->schedule, step, nstep);
    OM_TRY(om_optim_step(s->optim, s->rate, l->grad, s->param, &norm));
    OM_TRY(update_statistics(l));
    s->loss_sum += loss;
    s->norm_sum += norm;
    ++s->nbatch_done;
    return OM_OK;
}

// ---- files --------------------------------------------------------------------------------------------

static OmStatus save(Loop* l, bool is_due) {
    const OmTrainDef* d = l->def;
    double now = om_clock_now();
    if (!d->dir || l->rank != 0) return OM_OK;
    if (is_due || now - l->last_save >= d->checkpoint_period) {
        // Restart the clock here, so that time lost by a kill is not counted twice.
        l->state.seconds += now - l->start;
        l->start = l->last_save = l->last_metrics = now;
        return om__train_save(d, &l->state);
    }
    return OM_OK;
}

static OmStatus save_metrics(Loop* l) {
    double now = om_clock_now();
    if (!l->def->dir || l->rank != 0 || now - l->last_metrics < METRICS_PERIOD) return OM_OK;
    l->last_metrics = now;
    return om__train_save_metrics(l->def, &l->state);
}

// ---- epochs -------------------------------------------------------------------------------------------

// Sum the measured quantities over this rank's samples.
static OmStatus measure(Loop* l, double* sum) {
    const OmTrainDef* d = l->def;
    int64_t first = (int64_t)d->nvalid * l->rank / l->nrank;
    int64_t last = (int64_t)d->nvalid * (l->rank + 1) / l->nrank;
    OM_TRY(om_net_run_set_parameters(l->valid_run, l->mean));
    for (; first < last; first += d->batch) {
        int count = last - first < d->batch ? (int)(last - first) : d->batch;
        for (int i = 0; i < count; ++i) l->sample[i] = first + i;
        OM_TRY(fill_batch(l, true, l->state.nrow, count));
        OM_TRY(om_net_run_forward(l->valid_run, l->in, l->out));
        double value;
        if (d->metric) {
            value = d->metric(d->ctx, l->sample, l->out, l->target, count);
        } else {
            OM_TRY(eval_loss(l, count, &value, NULL));
            value *= count;
        }
        *sum += value;
    }
    return OM_OK;
}

// Validate the averaged weights and store them if they are the best so far.
static OmStatus validate(Loop* l, double* value) {
    const OmTrainDef* d = l->def;
    OmTrainState* s = &l->state;
    double sum = 0;
    om_optim_get_average(s->optim, s->param, l->mean);
    OmStatus status = measure(l, &sum);
    OM_TRY(meet(l, status, &sum));
    *value = sum * l->nrank / d->nvalid;
    OM_CHECK(isfinite(*value), OM_INVALID, "epoch %d: validation gives %g", s->nrow + 1, *value);
    if (s->best_epoch == 0 || *value < s->best_value) {
        memcpy(s->best, l->mean, (size_t)l->nparam * sizeof *l->mean);
        s->best_epoch = s->nrow + 1;
        s->best_value = *value;
        s->nworse = 0;
    } else {
        ++s->nworse;
    }
    return OM_OK;
}

static OmStatus end_epoch(Loop* l) {
    const OmTrainDef* d = l->def;
    OmTrainState* s = &l->state;
    bool is_last = s->nrow == d->nepoch - 1;
    OmTrainEpoch* row = &s->row[s->nrow];
    *row = (OmTrainEpoch){.epoch = s->nrow + 1,
                          .step = (s->nrow + 1) * l->nbatch,
                          .train = s->loss_sum / (double)l->nbatch,  // nbatch >= 1
                          .valid = (double)NAN,
                          .rate = s->rate,
                          .grad_norm = s->norm_sum / (double)l->nbatch};
    if (d->nvalid > 0 && (is_last || (s->nrow + 1) % d->valid_every == 0))
        OM_TRY(validate(l, &row->valid));
    row->seconds = s->seconds + om_clock_now() - l->start;
    ++s->nrow;
    s->nbatch_done = 0;
    s->loss_sum = s->norm_sum = 0;
    s->is_early = d->patience > 0 && s->nworse >= d->patience && !is_last;
    s->is_ended = is_last || s->is_early;
    if (d->on_epoch && l->rank == 0) d->on_epoch(d->ctx, row);
    return OM_OK;
}

static OmStatus train_epoch(Loop* l) {
    OmTrainState* s = &l->state;
    shuffle(l, s->nrow);
    while (s->nbatch_done < l->nbatch) {
        OM_TRY(train_batch(l, s->nbatch_done));
        if (s->nbatch_done < l->nbatch) l->pending = save(l, false);
    }
    OM_TRY(end_epoch(l));
    l->pending = save(l, s->is_ended);
    if (l->pending == OM_OK) l->pending = save_metrics(l);
    return OM_OK;
}

// The caller gets the best weights, and the rows written so far.
static void take_result(Loop* l, OmTrainResult* result) {
    OmTrainState* s = &l->state;
    if (s->best_epoch == 0) {
        om_optim_get_average(s->optim, s->param, s->best);
        s->best_epoch = s->nrow;
        s->best_value = (double)NAN;
    }
    memcpy(s->param, s->best, (size_t)l->nparam * sizeof *s->best);
    result->epoch = s->row;
    s->row = NULL;
    result->nepoch = s->nrow;
    result->nstep = s->nrow * l->nbatch;
    result->best_epoch = s->best_epoch;
    result->best_value = s->best_value;
    result->seconds = s->seconds + om_clock_now() - l->start;
    result->is_early = s->is_early;
}

OmStatus om_train_run(const OmTrainDef* def, const OmProgress* progress, float* param,
                      OmTrainResult* result) {
    Loop l = {.def = def, .progress = progress, .state.param = param};
    OmStatus status = OM_OK;
    memset(result, 0, sizeof *result);
    OM_TRY(check_def(def));
    double nothing = 0;
    status = loop_init(&l, &result->is_resumed);
    OM_TRY_DONE(meet(&l, status, &nothing));
    while (!l.state.is_ended) OM_TRY_DONE(train_epoch(&l));
    OM_TRY_DONE(l.pending);
    take_result(&l, result);
    (void)om_progress_report(progress, "training", (double)result->nstep, (double)result->nstep);
done:
    if (status == OM_CANCELLED) {
        OmStatus saved = save(&l, true);
        if (saved < 0) status = saved;
    }
    loop_done(&l);
    return status;
}

void om_train_result_done(OmTrainResult* result) {
    om_free(result->epoch);
    memset(result, 0, sizeof *result);
}
