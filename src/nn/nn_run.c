// nn_run.c: run a compiled network: upload of parameters, forward, backward.
#include <string.h>

#include "nn/nn_internal.h"

#define COOKIE 0x4e45544eu

OmNetRunDef om_net_run_default_def(int batch) {
    return (OmNetRunDef){.batch = batch, .seed = 1, .cookie = COOKIE};
}

// oneDNN 2.6 in bfloat16: 0.8 of the time of float on Zen 4, 2.5 times that of float on an Intel Xeon with AMX, whose
// tiles it does not use. Other processors were not measured and stay with float.
OmNetType om_net_fast_type(void) {
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_is("amd") && om__engine_multiplies_bf16()) return OM_BF16;
#endif
    return OM_F32;
}

void om_net_run_destroy(OmNetRun* run) {
    if (!run) return;
    for (int i = 0; i < run->nop; ++i) {
        OmOp* op = &run->op[i];
        OmKernel* all[] = {op->forward, op->data,      op->weights, op->activate_back,
                           op->load,    op->load_back, op->store};
        for (size_t k = 0; k < sizeof all / sizeof *all; ++k) om__kernel_destroy(all[k]);
        om__norm_done(&op->norm);
    }
    void* all[] = {run->op,         run->held_by,   run->value,     run->grad,
                   run->needs_grad, run->placed_in, run->placed_at, run->value_piece,
                   run->grad_piece, run->piece,     run->memory,    run->weights,
                   run->small,      run->small_at};
    for (size_t k = 0; k < sizeof all / sizeof *all; ++k) om_free(all[k]);
    om__engine_destroy(run->engine);
    om_free(run);
}

OmStatus om_net_run_create(const OmNet* net, const OmNetRunDef* def, OmNetRun** run_out) {
    *run_out = NULL;
    OM_CHECK(def->cookie == COOKIE, OM_INVALID,
             "OmNetRunDef is not from om_net_run_default_def: start from its result");
    OM_CHECK(net->is_finished, OM_INVALID, "the network is not finished: call om_net_finish first");
    OM_CHECK(def->batch >= 1, OM_INVALID, "OmNetRunDef: batch %d is not positive", def->batch);
    OM_CHECK(def->type == OM_F32 || def->type == OM_BF16, OM_INVALID,
             "OmNetRunDef: type %d is neither OM_F32 nor OM_BF16", (int)def->type);
    OM_CHECK(def->nworker >= 0, OM_INVALID, "OmNetRunDef: nworker %d is negative", def->nworker);
    OM_CHECK(def->layout >= OM_LAYOUT_AUTO && def->layout <= OM_LAYOUT_CHANNELS_LAST, OM_INVALID,
             "OmNetRunDef: layout %d is none of OmNetLayout", (int)def->layout);
    for (int i = 0; i < net->nlayer; ++i)
        OM_CHECK(om__net_values(net->layer[i].shape) * def->batch <= INT32_MAX, OM_INVALID,
                 "layer %s: a batch of %d has over 2^31 values: take a smaller one",
                 net->layer[i].name, def->batch);
    OmStatus status = OM_OK;
    OmNetRun* run = om_calloc(1, sizeof *run);
    if (!run) return OM_NO_MEMORY;
    run->net = net;
    run->def = *def;
    run->nworker = om_worker_count(def->nworker);
    OM_TRY_DONE(om__engine_create(run->nworker, &run->engine));
    OM_TRY_DONE(om__engine_begin(run->engine));
    status = om__net_compile(run);
    om__engine_end(run->engine);
    if (status < 0) goto done;
    *run_out = run;
    run = NULL;
done:
    om_net_run_destroy(run);
    return status;
}

size_t om_net_run_memory(const OmNetRun* run) {
    size_t size =
        sizeof *run + run->memory_size + run->weights_size + run->small_size * sizeof(float);
    size += (size_t)run->net->nlayer * (sizeof(OmOp) + 2 * sizeof(OmBlocks) + 40);
    size += (size_t)run->piece_cap * sizeof(OmPiece);
    for (int i = 0; i < run->nop; ++i)
        if (run->op[i].norm.coef) size += om__norm_memory(&run->op[i].norm);
    return size;
}

// ---- parameters -----------------------------------------------------------------------------------------

// Reorder the weights (in, out, cells) of a folded transposed convolution to (cells, out, in), and copy its
// bias for each cell; returns where the weights now are.
static const float* load_unfolded(OmNetRun* run, const OmOp* op, const float* param) {
    const OmLayer* l = op->layer;
    const OmNetParameter* p = &run->net->param[l->weight];
    int nin = p->dim[0], nout = p->dim[1], ncell = op->folded.shape.c / nout;
    const float* from = param + p->adr;
    float* to = (float*)(void*)(run->weights + run->staging_at);
    float* bias = (float*)(void*)(run->weights + op->folded_bias_at);
    for (int i = 0; i < nin; ++i)
        for (int o = 0; o < nout; ++o)
            for (int k = 0; k < ncell; ++k)
                to[((int64_t)k * nout + o) * nin + i] = from[((int64_t)i * nout + o) * ncell + k];
    for (int k = 0; k < ncell && l->bias >= 0; ++k)
        memcpy(bias + (int64_t)k * nout, param + run->net->param[l->bias].adr,
               (size_t)nout * sizeof *bias);
    return to;
}

static OmStatus load_parameters(OmNetRun* run, const float* param) {
    for (int i = 0; i < run->nop; ++i) {
        OmOp* op = &run->op[i];
        OmKernel* load[2] = {op->load, op->load_back};
        for (int k = 0; k < 2; ++k) {
            if (!load[k]) continue;
            const OmNetParameter* p = &run->net->param[op->layer->weight];
            const float* from = param + p->adr;
            if (k == 0 && op->is_unfolded) from = load_unfolded(run, op, param);
            if (op->winograd.is_on) {
                float* staging = (float*)(void*)(run->weights + run->staging_at);
                om__winograd_weights(run->nworker, from, p->dim[0], p->dim[1], k == 1, staging);
                from = staging;
            }
            OM_TRY(om__kernel_bind(load[k], OM_SLOT_SRC, from));
            OM_TRY(om__kernel_run(load[k]));
        }
    }
    for (int i = 0; i < run->net->nparam; ++i) {
        const OmNetParameter* p = &run->net->param[i];
        if (run->small_at[i] >= 0)
            memcpy(run->small + run->small_at[i], param + p->adr, (size_t)p->num * sizeof *param);
    }
    return OM_OK;
}

OmStatus om_net_run_set_parameters(OmNetRun* run, const float* param) {
    OM_TRY(om__engine_begin(run->engine));
    OmStatus status = load_parameters(run, param);
    om__engine_end(run->engine);
    run->has_parameters = status == OM_OK;
    run->has_forward = false;
    return status;
}

void om_net_run_set_step(OmNetRun* run, uint64_t step, int64_t first_sample) {
    run->step = step;
    run->first_sample = first_sample;
    run->has_forward = false;  // a backward pass would draw other random numbers
}

static const float* small_of(const OmNetRun* run, int param) {
    return run->small + run->small_at[param];
}

// ---- forward --------------------------------------------------------------------------------------------

static uint64_t dropout_seed(const OmNetRun* run, const OmOp* op) {
    const uint64_t word[3] = {run->def.seed, run->step, (uint64_t)op->out};
    return om_hash(word, sizeof word, OM_HASH_SEED);
}

static void norm_forward(OmNetRun* run, OmOp* op) {
    const OmBlocks *x = &run->value[op->in[0]], *y = &run->value[op->out];
    const OmLayer* l = op->layer;
    if (!op->norm.is_batch || run->def.is_training) {
        om__norm_measure(run->nworker, &op->norm, x);
    } else {
        for (int c = 0; c < op->norm.c; ++c) {
            op->norm.mean[c] = (double)small_of(run, l->mean)[c];
            op->norm.var[c] = (double)small_of(run, l->variance)[c];
        }
    }
    om__norm_apply(run->nworker, &op->norm, x, small_of(run, l->weight), small_of(run, l->bias), y);
}

static void concat_forward(OmNetRun* run, const OmOp* op) {
    for (int k = 0, c = 0; k < op->nin; ++k) {
        const OmBlocks* x = &run->value[op->in[k]];
        if (!op->is_placed[k])
            om__blocks_copy_channels(run->nworker, x, 0, &run->value[op->out], c, x->shape.c);
        c += x->shape.c;
    }
}

static OmStatus op_forward(OmNetRun* run, OmOp* op) {
    const OmBlocks *x = &run->value[op->in[0]], *y = &run->value[op->out];
    if (op->winograd.is_on) {
        const float* bias = op->layer->bias >= 0 ? small_of(run, op->layer->bias) : NULL;
        return om__winograd_run(run->nworker, &op->winograd, op->forward, x, bias,
                                op->activation != OM_IDENTITY, op->slope, y);
    }
    if (op->forward) {
        OM_TRY(om__kernel_run(op->forward));
        if (op->is_unfolded) om__blocks_unfold(run->nworker, &op->folded, op->layer->kernel, y);
        return OM_OK;
    }
    switch (op->layer->kind) {
    case OM_LAYER_CONCAT: concat_forward(run, op); break;
    case OM_LAYER_MASK: om__blocks_mask(run->nworker, x, op->layer->mask, y); break;
    case OM_LAYER_DROPOUT:
        om__blocks_dropout(run->nworker, x, op->layer->rate, dropout_seed(run, op),
                           run->first_sample, y);
        break;
    default: norm_forward(run, op); break;
    }
    return OM_OK;
}

OmStatus om_net_run_forward(OmNetRun* run, const float* in, float* out) {
    OM_CHECK(run->has_parameters, OM_INVALID,
             "the network has no parameters: call om_net_run_set_parameters first");
    OM_TRY(om__engine_begin(run->engine));
    OmStatus status = OM_OK;
    om__blocks_from_plain(run->nworker, in, &run->value[0]);
    for (int i = 0; i < run->nop && status == OM_OK; ++i) {
        status = op_forward(run, &run->op[i]);
        if (status < 0) om_error_prefix(status, "layer %s", run->op[i].layer->name);
    }
    if (status == OM_OK)
        om__blocks_to_plain(run->nworker, &run->value[run->held_by[run->net->output]], out);
    om__engine_end(run->engine);
    run->has_forward = status == OM_OK;
    return status;
}

// ---- backward -------------------------------------------------------------------------------------------

// Where the gradient by input k is written; null if it is not needed.
static const OmBlocks* target_of(const OmNetRun* run, const OmOp* op, int k) {
    if (!run->needs_grad[op->in[k]]) return NULL;
    return op->is_extra[k] ? &op->extra[k] : &run->grad[op->in[k]];
}

static OmStatus weights_backward(OmNetRun* run, OmOp* op, float* grad) {
    const OmLayer* l = op->layer;
    const OmNetParameter* param = run->net->param;
    float *dweight = grad + param[l->weight].adr,
          *dbias = l->bias >= 0 ? grad + param[l->bias].adr : NULL;
    if (op->winograd_grad.is_on) {
        float* slice = (float*)(void*)(run->memory + run->piece[op->slice_piece].at);
        float* staging = (float*)(void*)(run->weights + run->staging_at);
        return om__winograd_gradient(run->nworker, &op->winograd_grad, op->weights, op->store,
                                     &run->value[op->in[0]], &run->grad[op->out], slice, staging,
                                     dweight, dbias);
    }
    if (op->turned.is_on) {
        const OmDetour* t = &op->turned;
        om__blocks_copy_channels(run->nworker, &run->value[op->in[0]], 0, &t->in, 0, t->in.shape.c);
        om__blocks_copy_channels(run->nworker, &run->grad[op->out], 0, &t->out, 0, t->out.shape.c);
    }
    OM_TRY(om__kernel_run(op->weights));
    OM_TRY(om__kernel_bind(op->store, OM_SLOT_DST, dweight));
    OM_TRY(om__kernel_run(op->store));
    if (dbias)
        memcpy(dbias, run->memory + run->piece[op->bias_piece].at,
               (size_t)param[l->bias].num * sizeof *grad);
    return OM_OK;
}

static OmStatus kernels_backward(OmNetRun* run, OmOp* op, float* grad) {
    if (op->activate_back) OM_TRY(om__kernel_run(op->activate_back));
    if (op->weights) OM_TRY(weights_backward(run, op, grad));
    if (op->winograd_back.is_on)
        return om__winograd_run(run->nworker, &op->winograd_back, op->data, &run->grad[op->out],
                                NULL, false, 0, target_of(run, op, 0));
    return op->data ? om__kernel_run(op->data) : OM_OK;
}

static void norm_backward(OmNetRun* run, OmOp* op, float* grad) {
    const OmLayer* l = op->layer;
    const OmNetParameter* param = run->net->param;
    om__norm_backward(run->nworker, &op->norm, &run->value[op->in[0]], &run->grad[op->out],
                      small_of(run, l->weight), target_of(run, op, 0), grad + param[l->weight].adr,
                      grad + param[l->bias].adr);
}

static void concat_backward(OmNetRun* run, const OmOp* op) {
    for (int k = 0, c = 0; k < op->nin; ++k) {
        const OmBlocks* to = target_of(run, op, k);
        int num = run->value[op->in[k]].shape.c;
        if (to) om__blocks_copy_channels(run->nworker, &run->grad[op->out], c, to, 0, num);
        c += num;
    }
}

static OmStatus op_backward(OmNetRun* run, OmOp* op, float* grad) {
    const OmBlocks *dy = &run->grad[op->out], *dx = target_of(run, op, 0);
    OmStatus status = OM_OK;
    if (op->forward) {
        status = kernels_backward(run, op, grad);
    } else {
        switch (op->layer->kind) {
        case OM_LAYER_CONCAT: concat_backward(run, op); break;
        case OM_LAYER_MASK: om__blocks_mask(run->nworker, dy, op->layer->mask, dx); break;
        case OM_LAYER_DROPOUT:
            om__blocks_dropout(run->nworker, dy, op->layer->rate, dropout_seed(run, op),
                               run->first_sample, dx);
            break;
        default: norm_backward(run, op, grad); break;
        }
    }
    for (int k = 0; k < op->nin; ++k)
        if (op->is_extra[k]) om__blocks_add(run->nworker, &op->extra[k], &run->grad[op->in[k]]);
    return status;
}

OmStatus om_net_run_backward(OmNetRun* run, const float* dout, float* grad, float* din) {
    OM_CHECK(run->def.is_training, OM_INVALID,
             "the run was created for inference: set is_training in its definition");
    OM_CHECK(run->has_forward, OM_INVALID,
             "backward without a forward since the last parameters or step");
    OM_CHECK(
        !din || run->def.has_input_gradient, OM_INVALID,
        "the gradient of the input is not planned for: set has_input_gradient in the definition");
    OM_TRY(om__engine_begin(run->engine));
    OmStatus status = OM_OK;
    int output = run->held_by[run->net->output];
    for (int i = 0; i < run->net->nparam; ++i) {
        const OmNetParameter* p = &run->net->param[i];
        if (!p->is_trained) memset(grad + p->adr, 0, (size_t)p->num * sizeof *grad);
    }
    if (run->needs_grad[output]) om__blocks_from_plain(run->nworker, dout, &run->grad[output]);
    for (int i = run->nop - 1; i >= 0 && status == OM_OK; --i) {
        if (!run->needs_grad[run->op[i].out]) continue;
        status = op_backward(run, &run->op[i], grad);
        if (status < 0) om_error_prefix(status, "layer %s, backward", run->op[i].layer->name);
    }
    if (status == OM_OK && din) om__blocks_to_plain(run->nworker, &run->grad[0], din);
    om__engine_end(run->engine);
    run->has_forward = false;  // gradients have overwritten the values of the forward pass
    return status;
}

void om_net_run_update_statistics(const OmNetRun* run, float* param) {
    if (!run->def.is_training) return;
    for (int i = 0; i < run->nop; ++i) {
        const OmOp* op = &run->op[i];
        if (op->layer->kind != OM_LAYER_BATCH_NORM) continue;
        float* mean = param + run->net->param[op->layer->mean].adr;
        float* var = param + run->net->param[op->layer->variance].adr;
        double m = (double)op->layer->momentum;
        double count = (double)(run->def.batch * om__net_cells(op->layer->shape));
        double unbiased = count > 1 ? count / (count - 1) : 1;
        for (int c = 0; c < op->norm.c; ++c) {
            mean[c] = (float)((1 - m) * (double)mean[c] + m * op->norm.mean[c]);
            var[c] = (float)((1 - m) * (double)var[c] + m * unbiased * op->norm.var[c]);
        }
    }
}
