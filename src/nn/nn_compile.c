// nn_compile.c: compile a network to operations for one batch size, type and number of workers.
//
// In order: the layers that become operations (a convolution includes the activation after it, dropout is nothing
// in inference), the layout of each tensor, the kernels, and memory. Time is counted in steps: operation i runs
// at step i forward and, in training, at step 2 nop - 1 - i backward. A tensor lives from the step that writes it
// to the last one that reads it; tensors whose lives do not overlap may use the same memory.
//
// In inference of one sample in blocked layout the channels of a concatenation are contiguous, so its inputs
// are written directly into its memory and nothing is copied.
#include <limits.h>
#include <string.h>

#include "nn/nn_internal.h"

// ---- operations -----------------------------------------------------------------------------------------

// The activation that is the only reader of layer i, or -1.
static int fused_activation(const OmNet* net, int i) {
    OmLayerKind kind = net->layer[i].kind;
    if ((kind != OM_LAYER_CONV && kind != OM_LAYER_DENSE) || i == net->output) return -1;
    int reader = -1, count = 0;
    for (int j = i + 1; j < net->nlayer; ++j)
        for (int k = 0; k < net->layer[j].ninput; ++k)
            if (net->layer[j].input[k] == i) {
                reader = j;
                ++count;
            }
    return count == 1 && net->layer[reader].kind == OM_LAYER_ACTIVATION ? reader : -1;
}

static void list_ops(OmNetRun* run) {
    const OmNet* net = run->net;
    for (int i = 0; i < net->nlayer; ++i) run->held_by[i] = i;
    for (int i = 0; i < net->nlayer; ++i) {
        const OmLayer* layer = &net->layer[i];
        bool is_fused = layer->kind == OM_LAYER_ACTIVATION && run->held_by[layer->input[0]] == i;
        if (layer->kind == OM_LAYER_INPUT || is_fused) continue;
        if (layer->kind == OM_LAYER_DROPOUT && (!run->def.is_training || layer->rate == 0)) {
            run->held_by[i] = run->held_by[layer->input[0]];
            continue;
        }
        OmOp* op = &run->op[run->nop++];
        *op = (OmOp){.layer = layer, .out = i, .nin = layer->ninput};
        op->workspace_piece = op->grad_piece = op->bias_piece = -1;
        for (int k = 0; k < op->nin; ++k) op->in[k] = run->held_by[layer->input[k]];
        int next = fused_activation(net, i);
        if (next < 0) continue;
        op->activation = net->layer[next].activation;
        op->slope = net->layer[next].slope;
        run->held_by[i] = op->out = next;
    }
}

static void mark_gradients(OmNetRun* run) {
    run->needs_grad[0] = run->def.has_input_gradient;
    for (int i = 0; i < run->nop; ++i) {
        const OmOp* op = &run->op[i];
        bool needs = op->layer->weight >= 0;
        for (int k = 0; k < op->nin; ++k) needs = needs || run->needs_grad[op->in[k]];
        run->needs_grad[op->out] = needs;
    }
}

// ---- layouts ------------------------------------------------------------------------------------------

// Do only convolutions of few channels read the input? oneDNN has kernels that read it in plain layout.
static bool is_plain_input(const OmNetRun* run) {
    if (run->net->layer[0].shape.c > 3) return false;
    for (int i = 0; i < run->nop; ++i)
        for (int k = 0; k < run->op[i].nin; ++k)
            if (run->op[i].in[k] == 0 && run->op[i].layer->kind != OM_LAYER_CONV) return false;
    return true;
}

static void set_layout(OmNetRun* run, int i, int block, bool is_last) {
    OmNetShape shape = run->net->layer[i].shape;
    run->value[i] = (OmBlocks){.n = run->def.batch, .shape = shape, .type = run->def.type};
    run->value[i].is_last = is_last;
    run->value[i].block = is_last ? shape.c : block;
    run->grad[i] = run->value[i];
}

static void choose_layouts(OmNetRun* run) {
    bool is_last = run->def.layout == OM_LAYOUT_CHANNELS_LAST;
    int block = is_last ? 0 : om__engine_block(run->def.type);
    is_last = block == 0;
    bool is_row = om__net_cells(run->net->layer[0].shape) == 1;
    if (!is_row && !is_last && is_plain_input(run))
        set_layout(run, 0, 1, false);
    else
        set_layout(run, 0, block, is_last || is_row);
    for (int i = 0; i < run->nop; ++i) {
        const OmOp* op = &run->op[i];
        const OmBlocks* in = &run->value[op->in[0]];
        if (op->layer->kind == OM_LAYER_DENSE)
            set_layout(run, op->out, 1, true);
        else if (op->layer->kind == OM_LAYER_CONV || op->layer->kind == OM_LAYER_CONV_UP)
            set_layout(run, op->out, block, is_last);
        else
            set_layout(run, op->out, in->block, in->is_last);
    }
}

// In bfloat16 the last sums need not be rounded to 8 bits: the output of the last convolution or dense layer, and
// masks applied to it, stay float. Gradients do not.
static void keep_output_exact(OmNetRun* run) {
    int last = run->nop - 1;
    while (last > 0 && run->op[last].layer->kind == OM_LAYER_MASK) --last;
    if (last < 0) return;
    const OmOp* op = &run->op[last];
    OmLayerKind kind = op->layer->kind;
    if ((kind != OM_LAYER_CONV && kind != OM_LAYER_DENSE) || op->activation != OM_IDENTITY) return;
    for (int i = last; i < run->nop; ++i) run->value[run->op[i].out].type = OM_F32;
}

// ---- kernels --------------------------------------------------------------------------------------------

static bool has_kernel(OmLayerKind kind) {
    return kind == OM_LAYER_CONV || kind == OM_LAYER_CONV_UP || kind == OM_LAYER_DENSE ||
           kind == OM_LAYER_MAX_POOL || kind == OM_LAYER_UPSAMPLE || kind == OM_LAYER_ACTIVATION;
}

// A transposed convolution as one of 1 x 1 x 1 with out.c times as many channels as its window has cells.
static bool can_unfold(const OmNetRun* run, const OmOp* op) {
    const OmLayer* l = op->layer;
    const OmBlocks* y = &run->value[op->out];
    if (l->kind != OM_LAYER_CONV_UP || (!y->is_last && y->shape.c % y->block != 0)) return false;
    for (int k = 0; k < 3; ++k)
        if (l->kernel[k] != l->stride[k] || l->padding[k] != 0) return false;
    return (int64_t)l->kernel[0] * l->kernel[1] * l->kernel[2] * l->shape.c <= 65536;
}

static OmStatus create_unfolded(OmNetRun* run, OmOp* op, OmKernelDef def) {
    OmLayer layer = *op->layer;
    op->is_unfolded = true;
    op->folded = run->value[op->out];
    op->folded.shape = run->value[op->in[0]].shape;
    op->folded.shape.c = layer.shape.c * layer.kernel[0] * layer.kernel[1] * layer.kernel[2];
    if (op->folded.is_last) op->folded.block = op->folded.shape.c;
    layer.kind = OM_LAYER_CONV;
    layer.shape = op->folded.shape;
    for (int k = 0; k < 3; ++k) layer.kernel[k] = layer.stride[k] = 1;
    def.layer = &layer;
    def.dst = &op->folded;
    return om__kernel_create(run->engine, &def, &op->forward);
}

// It is faster if there are many tiles.
static bool can_winograd(const OmNetRun* run, const OmOp* op) {
    const OmLayer* l = op->layer;
    const OmBlocks *x = &run->value[op->in[0]], *y = &run->value[op->out];
    if (l->kind != OM_LAYER_CONV || x->is_last || y->is_last) return false;
    if (x->type != OM_F32 || y->type != OM_F32) return false;
    if (x->block != OM_WINOGRAD_BLOCK || y->block != OM_WINOGRAD_BLOCK) return false;
    if (x->shape.c % x->block != 0 || y->shape.c % y->block != 0) return false;
    if (op->activation == OM_TANH || op->activation == OM_SIGMOID) return false;
    for (int k = 0; k < 3; ++k)
        if (l->kernel[k] != 3 || l->stride[k] != 1 || l->padding[k] != 1) return false;
    return x->shape.h >= 8 && x->shape.w >= 8;
}

// The convolution between the transforms, for one sample. The gradient by the input is a forward convolution too.
static OmStatus create_winograd(OmNetRun* run, OmOp* op, OmPass pass) {
    bool is_data = pass == OM_PASS_DATA, is_weights = pass == OM_PASS_WEIGHTS;
    OmDetour* w = is_data ? &op->winograd_back : is_weights ? &op->winograd_grad : &op->winograd;
    OmKernel** kernel = is_data ? &op->data : is_weights ? &op->weights : &op->forward;
    OmLayer layer = *op->layer;
    w->is_on = true;
    w->in = is_data ? run->grad[op->out] : run->value[op->in[0]];
    w->out = is_data ? run->grad[op->in[0]] : run->value[op->out];
    w->in.n = w->out.n = 1;
    w->in.shape = om__winograd_shape(w->in.shape);
    w->out.shape = om__winograd_shape(w->out.shape);
    layer.shape = w->out.shape;
    layer.kernel[1] = layer.kernel[2] = 1;
    layer.padding[1] = layer.padding[2] = 0;
    layer.bias = -1;
    OmKernelDef def = {.layer = &layer, .ngroup = OM_WINOGRAD_POINTS};
    def.pass = is_weights ? OM_PASS_WEIGHTS : OM_PASS_FORWARD;
    def.src = &w->in;
    def.dst = &w->out;
    return om__kernel_create(run->engine, &def, kernel);
}

// For some small extents oneDNN has no fast gradient by the weights in blocks, but one in channels last.
static OmStatus turn_weights(OmNetRun* run, OmOp* op, OmKernelDef def) {
    if (def.src->is_last || strncmp(om__kernel_name(op->weights), "ref", 3) != 0) return OM_OK;
    OmDetour* t = &op->turned;
    t->in = *def.src;
    t->out = *def.dst;
    t->in.is_last = t->out.is_last = true;
    t->in.block = t->in.shape.c;
    t->out.block = t->out.shape.c;
    def.src = &t->in;
    def.dst = &t->out;
    OmKernel* kernel = NULL;
    OM_TRY(om__kernel_create(run->engine, &def, &kernel));
    t->is_on = strncmp(om__kernel_name(kernel), "ref", 3) != 0;
    om__kernel_destroy(t->is_on ? op->weights : kernel);
    if (t->is_on) op->weights = kernel;
    return OM_OK;
}

static OmStatus create_backward(OmNetRun* run, OmOp* op, OmKernelDef def) {
    def.dst = &run->grad[op->out];
    bool has_weights = op->layer->kind != OM_LAYER_ACTIVATION && op->layer->weight >= 0;
    if (op->activation != OM_IDENTITY) {  // fused
        def.pass = OM_PASS_DATA;
        def.activation = op->activation;
        def.slope = op->slope;
        OM_TRY(om__kernel_create(run->engine, &def, &op->activate_back));
        def.activation = OM_IDENTITY;
    }
    if (has_weights) {
        def.pass = OM_PASS_WEIGHTS;
        if (op->winograd.is_on)
            OM_TRY(create_winograd(run, op, OM_PASS_WEIGHTS));
        else
            OM_TRY(om__kernel_create(run->engine, &def, &op->weights));
        if (!op->winograd.is_on && op->layer->kind == OM_LAYER_CONV)
            OM_TRY(turn_weights(run, op, def));
        OM_TRY(om__kernel_create_reorder(run->engine, op->weights, OM_SLOT_DIFF_WEIGHTS, true,
                                         &op->store));
    }
    if (!run->needs_grad[op->in[0]]) return OM_OK;
    def.pass = OM_PASS_DATA;
    if (op->winograd.is_on)
        OM_TRY(create_winograd(run, op, OM_PASS_DATA));
    else
        OM_TRY(om__kernel_create(run->engine, &def, &op->data));
    bool is_same = om__kernel_is_same(op->forward, OM_SLOT_WEIGHTS, op->data, OM_SLOT_WEIGHTS);
    if (has_weights && (op->is_unfolded || op->winograd.is_on || !is_same))
        OM_TRY(om__kernel_create_reorder(run->engine, op->data, OM_SLOT_WEIGHTS, false,
                                         &op->load_back));
    return OM_OK;
}

static OmStatus create_kernels(OmNetRun* run) {
    for (int i = 0; i < run->nop; ++i) {
        OmOp* op = &run->op[i];
        OmLayerKind kind = op->layer->kind;
        if (kind == OM_LAYER_BATCH_NORM || kind == OM_LAYER_GROUP_NORM)
            OM_TRY(om__norm_create(&run->value[op->in[0]], op->layer, &op->norm));
        if (!has_kernel(kind)) continue;
        bool is_activation = kind == OM_LAYER_ACTIVATION;
        OmKernelDef def = {.layer = op->layer,
                           .pass = OM_PASS_FORWARD,
                           .is_training = run->def.is_training,
                           .src = &run->value[op->in[0]],
                           .dst = &run->value[op->out],
                           .activation = is_activation ? op->layer->activation : op->activation,
                           .slope = is_activation ? op->layer->slope : op->slope};
        if (can_unfold(run, op))
            OM_TRY(create_unfolded(run, op, def));
        else if (can_winograd(run, op))
            OM_TRY(create_winograd(run, op, OM_PASS_FORWARD));
        else
            OM_TRY(om__kernel_create(run->engine, &def, &op->forward));
        if (om__kernel_bytes(op->forward, OM_SLOT_WEIGHTS) > 0)
            OM_TRY(om__kernel_create_reorder(run->engine, op->forward, OM_SLOT_WEIGHTS, false,
                                             &op->load));
        if (!is_activation) def.activation = OM_IDENTITY;
        if (run->def.is_training && run->needs_grad[op->out]) OM_TRY(create_backward(run, op, def));
    }
    return OM_OK;
}

// ---- lives of tensors --------------------------------------------------------------------------------------

static int add_piece(OmNetRun* run, size_t bytes, int begin, int end) {
    OM_ASSERT(run->npiece < run->piece_cap);
    run->piece[run->npiece] = (OmPiece){.bytes = bytes, .begin = begin, .end = end};
    return run->npiece++;
}

static int back_step(const OmNetRun* run, int op) { return 2 * run->nop - 1 - op; }

static void live_until(OmNetRun* run, int piece, int step) {
    OmPiece* p = &run->piece[piece];
    if (step > p->end) p->end = step;
    if (step < p->begin) p->begin = step;
}

// May the output of layer `in` be written directly into its part of concatenation `op`?
static bool can_place(const OmNetRun* run, const OmOp* op, int k, int from_c) {
    const OmBlocks *x = &run->value[op->in[k]], *y = &run->value[op->out];
    if (run->def.is_training || run->def.batch != 1 || x->is_last || x->block != y->block)
        return false;
    if (x->shape.c % x->block != 0 || from_c % y->block != 0) return false;
    return op->in[k] != 0 && run->placed_in[op->in[k]] < 0;
}

static void place_concats(OmNetRun* run) {
    for (int i = 0; i < run->nop; ++i) {
        OmOp* op = &run->op[i];
        if (op->layer->kind != OM_LAYER_CONCAT) continue;
        for (int k = 0, c = 0; k < op->nin; c += run->value[op->in[k]].shape.c, ++k) {
            if (!can_place(run, op, k, c)) continue;
            const OmBlocks* y = &run->value[op->out];
            op->is_placed[k] = true;
            run->placed_in[op->in[k]] = op->out;
            run->placed_at[op->in[k]] =
                (size_t)c * (size_t)om__net_cells(y->shape) * om__type_size(y->type);
        }
    }
}

// The tensor whose memory holds the tensor of layer i.
static int root_of(const OmNetRun* run, int i) {
    while (run->placed_in[i] >= 0) i = run->placed_in[i];
    return i;
}

static void plan_values(OmNetRun* run) {
    run->value_piece[0] = add_piece(run, om__blocks_bytes(&run->value[0]), 0, 0);
    for (int i = 0; i < run->nop; ++i) {
        int out = run->op[i].out;
        if (run->placed_in[out] < 0)
            run->value_piece[out] = add_piece(run, om__blocks_bytes(&run->value[out]), i, i);
    }
    for (int i = 0; i < run->nop; ++i) {
        const OmOp* op = &run->op[i];
        bool is_back = run->def.is_training && run->needs_grad[op->out];
        bool keeps_in = is_back && op->layer->weight >= 0;
        bool keeps_out =
            is_back && (op->activation != OM_IDENTITY || op->layer->kind == OM_LAYER_ACTIVATION);
        for (int k = 0; k < op->nin; ++k) {
            int piece = run->value_piece[root_of(run, op->in[k])];
            live_until(run, piece, i);
            if (keeps_in) live_until(run, piece, back_step(run, i));
        }
        int piece = run->value_piece[root_of(run, op->out)];
        live_until(run, piece, i);
        if (keeps_out) live_until(run, piece, back_step(run, i));
    }
    live_until(run, run->value_piece[root_of(run, run->held_by[run->net->output])], run->nop);
}

// Gradients: from the first reader (backward) to the layer's own operation.
static void plan_gradients(OmNetRun* run) {
    int output = run->held_by[run->net->output];
    if (run->needs_grad[output])
        run->grad_piece[output] =
            add_piece(run, om__blocks_bytes(&run->grad[output]), run->nop, run->nop);
    for (int i = run->nop - 1; i >= 0; --i) {
        OmOp* op = &run->op[i];
        int step = back_step(run, i);
        if (!run->needs_grad[op->out]) continue;
        live_until(run, run->grad_piece[op->out], step);
        for (int k = 0; k < op->nin; ++k) {
            int in = op->in[k];
            if (!run->needs_grad[in]) continue;
            size_t bytes = om__blocks_bytes(&run->grad[in]);
            op->is_extra[k] = run->grad_piece[in] >= 0;
            if (op->is_extra[k]) {
                op->extra[k] = run->grad[in];
                op->extra_piece[k] = add_piece(run, bytes, step, step);
                live_until(run, run->grad_piece[in], step);
            } else {
                run->grad_piece[in] = add_piece(run, bytes, step, step);
            }
        }
        size_t weights = om__kernel_bytes(op->weights, OM_SLOT_DIFF_WEIGHTS);
        size_t bias = om__kernel_bytes(op->weights, OM_SLOT_DIFF_BIAS);
        if (weights) op->grad_piece = add_piece(run, weights, step, step);
        if (bias) op->bias_piece = add_piece(run, bias, step, step);
    }
    if (run->grad_piece[0] >= 0) live_until(run, run->grad_piece[0], 2 * run->nop);
}

static size_t larger(size_t a, size_t b) { return a > b ? a : b; }

static void plan_detour(OmNetRun* run, OmDetour* w, int step) {
    if (!w->is_on) return;
    w->in_piece = add_piece(run, om__blocks_bytes(&w->in), step, step);
    w->out_piece = add_piece(run, om__blocks_bytes(&w->out), step, step);
}

static void plan_rest(OmNetRun* run) {
    size_t scratch = 0;
    for (int i = 0; i < run->nop; ++i) {
        OmOp* op = &run->op[i];
        size_t workspace = om__kernel_bytes(op->forward, OM_SLOT_WORKSPACE);
        plan_detour(run, &op->winograd, i);
        plan_detour(run, &op->winograd_back, back_step(run, i));
        plan_detour(run, &op->winograd_grad, back_step(run, i));
        plan_detour(run, &op->turned, back_step(run, i));
        if (op->winograd_grad.is_on) {
            const OmBlocks* y = &run->value[op->out];
            size_t num = (size_t)om__blocks_count(y) * OM_WINOGRAD_BLOCK * (size_t)y->shape.d;
            op->slice_piece =
                add_piece(run, num * sizeof(float), back_step(run, i), back_step(run, i));
        }
        if (op->is_unfolded) op->folded_piece = add_piece(run, om__blocks_bytes(&op->folded), i, i);
        if (workspace) op->workspace_piece = add_piece(run, workspace, i, back_step(run, i));
        const OmKernel* all[] = {op->forward, op->data,      op->weights, op->activate_back,
                                 op->load,    op->load_back, op->store};
        for (size_t k = 0; k < sizeof all / sizeof *all; ++k)
            scratch = larger(scratch, om__kernel_bytes(all[k], OM_SLOT_SCRATCH));
    }
    run->scratch_piece = add_piece(run, scratch, 0, INT_MAX);
}

// Place the parameters in the kernels' layouts, one after the other; kernels read biases and norms in plain layout.
static void plan_parameters(OmNetRun* run) {
    size_t at = 0;
    for (int i = 0; i < run->nop; ++i) {
        OmOp* op = &run->op[i];
        op->weight_at = op->weight_back_at = at;
        at += (om__kernel_bytes(op->forward, OM_SLOT_WEIGHTS) + 63) / 64 * 64;
        if (!op->load_back) continue;
        op->weight_back_at = at;
        at += (om__kernel_bytes(op->data, OM_SLOT_WEIGHTS) + 63) / 64 * 64;
    }
    size_t staging = 0;
    for (int i = 0; i < run->nop; ++i) {
        OmOp* op = &run->op[i];
        size_t num = op->layer->weight >= 0 ? (size_t)run->net->param[op->layer->weight].num : 0;
        if (op->winograd.is_on)
            staging = larger(staging, num / 9 * OM_WINOGRAD_POINTS * sizeof(float));
        if (!op->is_unfolded) continue;
        op->folded_bias_at = at;
        at += ((size_t)op->folded.shape.c * sizeof(float) + 63) / 64 * 64;
        staging = larger(staging, num * sizeof(float));
    }
    run->staging_at = at;
    run->weights_size = at + staging;
    size_t small = 0;
    for (int i = 0; i < run->net->nparam; ++i) {
        run->small_at[i] = -1;
        if (run->net->param[i].is_decayed) continue;
        run->small_at[i] = (int64_t)small;
        small += ((size_t)run->net->param[i].num + 15) / 16 * 16;
    }
    run->small_size = small;
}

// ---- binding --------------------------------------------------------------------------------------------

static char* piece_data(const OmNetRun* run, int piece) {
    return piece < 0 ? NULL : run->memory + run->piece[piece].at;
}

static void locate_tensors(OmNetRun* run) {
    for (int i = 0; i < run->net->nlayer; ++i) {
        size_t offset = 0;
        int root = i;
        for (; run->placed_in[root] >= 0; root = run->placed_in[root])
            offset += run->placed_at[root];
        char* data = piece_data(run, run->value_piece[root]);
        run->value[i].data = data ? data + offset : NULL;
        run->grad[i].data = piece_data(run, run->grad_piece[i]);
    }
    for (int i = 0; i < run->nop; ++i)
        for (int k = 0; k < run->op[i].nin; ++k)
            if (run->op[i].is_extra[k])
                run->op[i].extra[k].data = piece_data(run, run->op[i].extra_piece[k]);
    for (int i = 0; i < run->nop; ++i) {
        OmOp* op = &run->op[i];
        if (op->is_unfolded) op->folded.data = piece_data(run, op->folded_piece);
        OmDetour* w[4] = {&op->winograd, &op->winograd_back, &op->winograd_grad, &op->turned};
        for (int k = 0; k < 4; ++k) {
            if (!w[k]->is_on) continue;
            w[k]->in.data = piece_data(run, w[k]->in_piece);
            w[k]->out.data = piece_data(run, w[k]->out_piece);
        }
    }
}

static OmStatus bind_op(OmNetRun* run, OmOp* op) {
    const OmLayer* l = op->layer;
    const char* scratch = piece_data(run, run->scratch_piece);
    const char* workspace = piece_data(run, op->workspace_piece);
    const void *src = run->value[op->in[0]].data, *dst = run->value[op->out].data;
    const void* ddst = run->grad[op->out].data;
    const void* dsrc = op->is_extra[0] ? op->extra[0].data : run->grad[op->in[0]].data;
    const char *weight = run->weights + op->weight_at,
               *weight_back = run->weights + op->weight_back_at;
    const void* bias = l->bias >= 0 ? run->small + run->small_at[l->bias] : NULL;
    const void *source = src, *result = op->is_unfolded ? op->folded.data : dst;
    const void *back_source = NULL, *back_result = dst;  // an activation reads its result
    const void* grad_source = op->turned.is_on ? op->turned.in.data : src;
    const void* grad_result = op->turned.is_on ? op->turned.out.data : ddst;
    if (op->winograd.is_on) {
        source = op->winograd.in.data;
        result = op->winograd.out.data;
        back_source = op->winograd_back.in.data;
        back_result = op->winograd_back.out.data;
        grad_source = op->winograd_grad.in.data;
        grad_result = op->winograd_grad.out.data;
    }
    if (op->is_unfolded) bias = run->weights + op->folded_bias_at;
    const struct {
        OmKernel* kernel;
        OmSlot slot;
        const void* data;
    } bind[] = {
        {op->forward, OM_SLOT_SRC, source},
        {op->forward, OM_SLOT_DST, result},
        {op->forward, OM_SLOT_WEIGHTS, weight},
        {op->forward, OM_SLOT_BIAS, bias},
        {op->forward, OM_SLOT_WORKSPACE, workspace},
        {op->activate_back, OM_SLOT_DST, dst},
        {op->activate_back, OM_SLOT_DIFF_DST, ddst},
        {op->activate_back, OM_SLOT_DIFF_SRC, ddst},
        {op->weights, OM_SLOT_SRC, grad_source},
        {op->weights, OM_SLOT_DIFF_DST, grad_result},
        {op->weights, OM_SLOT_DIFF_WEIGHTS, piece_data(run, op->grad_piece)},
        {op->weights, OM_SLOT_DIFF_BIAS, piece_data(run, op->bias_piece)},
        {op->store, OM_SLOT_SRC, piece_data(run, op->grad_piece)},
        {op->data, OM_SLOT_SRC, back_source},
        {op->data, OM_SLOT_DST, back_result},
        {op->data, OM_SLOT_DIFF_DST, ddst},
        {op->data, OM_SLOT_DIFF_SRC, dsrc},
        {op->data, OM_SLOT_WEIGHTS, weight_back},
        {op->data, OM_SLOT_WORKSPACE, workspace},
        {op->load, OM_SLOT_DST, weight},
        {op->load_back, OM_SLOT_DST, weight_back},
    };
    for (size_t k = 0; k < sizeof bind / sizeof *bind; ++k)
        OM_TRY(om__kernel_bind(bind[k].kernel, bind[k].slot, bind[k].data));
    OmKernel* all[] = {op->forward, op->data,      op->weights, op->activate_back,
                       op->load,    op->load_back, op->store};
    for (size_t k = 0; k < sizeof all / sizeof *all; ++k)
        OM_TRY(om__kernel_bind(all[k], OM_SLOT_SCRATCH, scratch));
    return OM_OK;
}

// ---- the whole compilation ------------------------------------------------------------------------------

static OmStatus allocate_tables(OmNetRun* run) {
    OmStatus status = OM_OK;
    size_t n = (size_t)run->net->nlayer;
    OM_CALLOC_DONE(run->op, n);
    OM_CALLOC_DONE(run->held_by, n);
    OM_CALLOC_DONE(run->value, n);
    OM_CALLOC_DONE(run->grad, n);
    OM_CALLOC_DONE(run->needs_grad, n);
    OM_CALLOC_DONE(run->placed_in, n);
    OM_CALLOC_DONE(run->placed_at, n);
    OM_CALLOC_DONE(run->value_piece, n);
    OM_CALLOC_DONE(run->grad_piece, n);
    OM_CALLOC_DONE(run->small_at, (size_t)run->net->nparam);
    // per layer: a value, a gradient, a workspace, two of parameters, nine of detours, extras
    run->piece_cap = run->net->nlayer * (14 + OM_LAYER_MAX_INPUT) + 1;  // and the scratch
    OM_CALLOC_DONE(run->piece, (size_t)run->piece_cap);
    for (size_t i = 0; i < n; ++i)
        run->placed_in[i] = run->value_piece[i] = run->grad_piece[i] = -1;
done:
    return status;
}

OmStatus om__net_compile(OmNetRun* run) {
    OmStatus status = OM_OK;
    OM_TRY_DONE(allocate_tables(run));
    list_ops(run);
    mark_gradients(run);
    choose_layouts(run);
    keep_output_exact(run);
    OM_TRY_DONE(create_kernels(run));
    place_concats(run);
    plan_values(run);
    if (run->def.is_training) plan_gradients(run);
    plan_rest(run);
    plan_parameters(run);
    OM_TRY_DONE(om__plan_pieces(run->npiece, run->piece, &run->memory_size));
    // Cleared, because kernels may read the unused channels of a block.
    OM_CALLOC_DONE(run->memory, run->memory_size);
    OM_CALLOC_DONE(run->weights, run->weights_size);
    OM_CALLOC_DONE(run->small, run->small_size);
    locate_tensors(run);
    for (int i = 0; i < run->nop; ++i) OM_TRY_DONE(bind_op(run, &run->op[i]));
done:
    return status;
}
