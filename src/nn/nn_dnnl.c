// nn_dnnl.c: the only file that uses oneDNN (2.6, C interface).
//
// A kernel is one primitive with a memory object for each argument. The run owns the memory itself, plans it
// and binds it. Scratch memory is the caller's (DNNL_SCRATCHPAD_MODE_USER), so that all kernels of a run use
// one piece. Layouts of tensors are given; oneDNN chooses those of weights. Creating a primitive generates
// machine code: some milliseconds, once a process, since oneDNN has a cache.
//
// oneDNN splits work by the number of OpenMP threads at creation and at execution, which must agree;
// om__engine_begin sets the number for this thread and om__engine_end restores it. Its threads are those of
// libgomp, not of om_parallel_for: after a kernel they must sleep soon, so that the others have the
// processors. GOMP_SPINCOUNT=1000 achieves this; the program omentum sets it (cli_environment.c).
#include <dnnl.h>
#include <string.h>
#ifdef OM_WITH_OPENMP
#include <omp.h>
#endif

#include "nn/nn_internal.h"

struct OmEngine {
    dnnl_engine_t engine;
    dnnl_stream_t stream;
    int nworker, old_nworker;
};

struct OmKernel {
    dnnl_stream_t stream;  // of the engine
    dnnl_primitive_t primitive;
    dnnl_memory_t memory[OM_SLOT_COUNT];
    size_t bytes[OM_SLOT_COUNT];
    dnnl_exec_arg_t arg[OM_SLOT_COUNT];
    int narg;
    dnnl_memory_desc_t plain;  // of the weights in plain layout; float
};

static const int slot_arg[OM_SLOT_COUNT] = {
    DNNL_ARG_SRC,       DNNL_ARG_DST,       DNNL_ARG_WEIGHTS,      DNNL_ARG_BIAS,
    DNNL_ARG_DIFF_SRC,  DNNL_ARG_DIFF_DST,  DNNL_ARG_DIFF_WEIGHTS, DNNL_ARG_DIFF_BIAS,
    DNNL_ARG_WORKSPACE, DNNL_ARG_SCRATCHPAD};

// Convert oneDNN's status to OmStatus; `what` names the operation in the message.
static OmStatus check(dnnl_status_t status, const char* what) {
    switch (status) {
    case dnnl_success: return OM_OK;
    case dnnl_out_of_memory: return om_error(OM_NO_MEMORY, "oneDNN has no memory for %s", what);
    case dnnl_unimplemented:
        return om_error(OM_UNAVAILABLE,
                        "oneDNN has no implementation of %s in this type on this processor", what);
    default: return om_error(OM_INVALID, "oneDNN refuses %s (status %d)", what, (int)status);
    }
}

// ---- engine -------------------------------------------------------------------------------------------

OmStatus om__engine_create(int nworker, OmEngine** engine) {
    *engine = NULL;
    OmEngine* e = om_calloc(1, sizeof *e);
    if (!e) return OM_NO_MEMORY;
    e->nworker = om_worker_count(nworker);
    OmStatus status = check(dnnl_engine_create(&e->engine, dnnl_cpu, 0), "an engine");
    if (status == OM_OK)
        status =
            check(dnnl_stream_create(&e->stream, e->engine, dnnl_stream_default_flags), "a stream");
    if (status < 0) {
        om__engine_destroy(e);
        return status;
    }
    *engine = e;
    return OM_OK;
}

void om__engine_destroy(OmEngine* e) {
    if (!e) return;
    if (e->stream) dnnl_stream_destroy(e->stream);
    if (e->engine) dnnl_engine_destroy(e->engine);
    om_free(e);
}

OmStatus om__engine_begin(OmEngine* e) {
#ifdef OM_WITH_OPENMP
    OM_CHECK(e->nworker == 1 || !om_worker_is_inside(), OM_INVALID,
             "a network of %d workers runs inside a parallel loop: give the run one worker",
             e->nworker);
    e->old_nworker = omp_get_max_threads();
    omp_set_num_threads(e->nworker);
#endif
    (void)e;
    return OM_OK;
}

void om__engine_end(OmEngine* e) {
#ifdef OM_WITH_OPENMP
    omp_set_num_threads(e->old_nworker);
#endif
    (void)e;
}

// ---- layouts ------------------------------------------------------------------------------------------

static dnnl_data_type_t data_type(OmNetType type) { return type == OM_F32 ? dnnl_f32 : dnnl_bf16; }

// The dimensions of a tensor for oneDNN: five axes, or samples and channels only.
static dnnl_memory_desc_t tensor_desc(const OmBlocks* t, int ndim) {
    const dnnl_dims_t dims = {t->n, t->shape.c, t->shape.d, t->shape.h, t->shape.w};
    dnnl_format_tag_t tag = t->block == 1   ? dnnl_ncdhw
                            : t->block == 8 ? dnnl_nCdhw8c
                                            : dnnl_nCdhw16c;
    if (t->is_last) tag = dnnl_ndhwc;
    if (ndim == 2) tag = dnnl_nc;
    dnnl_memory_desc_t desc;
    memset(&desc, 0, sizeof desc);
    dnnl_memory_desc_init_by_tag(&desc, ndim, dims, data_type(t->type), tag);
    return desc;
}

// The layout is chosen by oneDNN, the dimensions are given.
static dnnl_memory_desc_t any_desc(int ndim, const dnnl_dim_t* dim, dnnl_data_type_t type) {
    dnnl_memory_desc_t desc;
    memset(&desc, 0, sizeof desc);
    dnnl_memory_desc_init_by_tag(&desc, ndim, dim, type, dnnl_format_tag_any);
    return desc;
}

// Weights in plain layout: rows of floats, with the first two axes exchanged for a transposed convolution.
static dnnl_memory_desc_t plain_desc(int ndim, const dnnl_dim_t* dim, bool is_up) {
    dnnl_dims_t stride;
    dnnl_dim_t step = 1;
    for (int k = ndim - 1; k >= 2; --k) {
        stride[k] = step;
        step *= dim[k];
    }
    stride[is_up ? 0 : 1] = step;
    stride[is_up ? 1 : 0] = step * dim[is_up ? 0 : 1];
    dnnl_memory_desc_t desc;
    memset(&desc, 0, sizeof desc);
    dnnl_memory_desc_init_by_strides(&desc, ndim, dim, dnnl_f32, stride);
    return desc;
}

// ---- kernels --------------------------------------------------------------------------------------------

void om__kernel_destroy(OmKernel* k) {
    if (!k) return;
    for (int s = 0; s < OM_SLOT_COUNT; ++s)
        if (k->memory[s]) dnnl_memory_destroy(k->memory[s]);
    if (k->primitive) dnnl_primitive_destroy(k->primitive);
    om_free(k);
}

static OmStatus add_argument(OmKernel* k, dnnl_engine_t engine, OmSlot slot,
                             const dnnl_memory_desc_t* desc) {
    k->bytes[slot] = dnnl_memory_desc_get_size(desc);
    if (k->bytes[slot] == 0) return OM_OK;
    OM_TRY(
        check(dnnl_memory_create(&k->memory[slot], desc, engine, DNNL_MEMORY_NONE), "an argument"));
    k->arg[k->narg++] = (dnnl_exec_arg_t){slot_arg[slot], k->memory[slot]};
    return OM_OK;
}

// Create primitive and arguments of a descriptor; the slots in `slots` (ended by OM_SLOT_COUNT) and those it adds.
static OmStatus finish_kernel(OmEngine* e, const_dnnl_primitive_desc_t pd, const OmSlot* slots,
                              const char* name, OmKernel* k) {
    static const dnnl_query_t query[OM_SLOT_COUNT] = {
        dnnl_query_src_md,          dnnl_query_dst_md,          dnnl_query_weights_md,
        dnnl_query_weights_md,      dnnl_query_diff_src_md,     dnnl_query_diff_dst_md,
        dnnl_query_diff_weights_md, dnnl_query_diff_weights_md, dnnl_query_workspace_md,
        dnnl_query_scratchpad_md};
    k->stream = e->stream;
    OM_TRY(check(dnnl_primitive_create(&k->primitive, pd), name));
    for (int i = 0;; ++i) {
        OmSlot slot = slots[i];
        if (slot == OM_SLOT_COUNT) break;
        int index = slot == OM_SLOT_BIAS || slot == OM_SLOT_DIFF_BIAS;
        const dnnl_memory_desc_t* desc = dnnl_primitive_desc_query_md(pd, query[slot], index);
        OM_CHECK(desc, OM_INVALID, "oneDNN gives no description of an argument of %s", name);
        OM_TRY(add_argument(k, e->engine, slot, desc));
    }
    const dnnl_memory_desc_t* scratch =
        dnnl_primitive_desc_query_md(pd, dnnl_query_scratchpad_md, 0);
    return scratch ? add_argument(k, e->engine, OM_SLOT_SCRATCH, scratch) : OM_OK;
}

static dnnl_alg_kind_t activation_alg(OmActivation a, bool is_by_result) {
    switch (a) {
    case OM_TANH: return is_by_result ? dnnl_eltwise_tanh_use_dst_for_bwd : dnnl_eltwise_tanh;
    case OM_SIGMOID:
        return is_by_result ? dnnl_eltwise_logistic_use_dst_for_bwd : dnnl_eltwise_logistic;
    default: return is_by_result ? dnnl_eltwise_relu_use_dst_for_bwd : dnnl_eltwise_relu;
    }
}

// Attributes of all kernels: scratch memory by the caller, and the activation at the end.
static OmStatus create_attr(const OmKernelDef* def, dnnl_primitive_attr_t* attr) {
    *attr = NULL;
    OM_TRY(check(dnnl_primitive_attr_create(attr), "attributes"));
    dnnl_status_t s = dnnl_primitive_attr_set_scratchpad_mode(*attr, dnnl_scratchpad_mode_user);
    if (s == dnnl_success && def->pass == OM_PASS_FORWARD && def->activation != OM_IDENTITY) {
        dnnl_post_ops_t ops = NULL;
        s = dnnl_post_ops_create(&ops);
        if (s == dnnl_success)
            s = dnnl_post_ops_append_eltwise(ops, 1, activation_alg(def->activation, false),
                                             def->slope, 0);
        if (s == dnnl_success) s = dnnl_primitive_attr_set_post_ops(*attr, ops);
        if (ops) dnnl_post_ops_destroy(ops);
    }
    OmStatus status = check(s, "attributes");
    if (status < 0) {
        dnnl_primitive_attr_destroy(*attr);
        *attr = NULL;
    }
    return status;
}

// A descriptor of any operation; the hint, which backward passes need, may be null.
static OmStatus create_desc(OmEngine* e, const void* op, dnnl_primitive_attr_t attr,
                            const_dnnl_primitive_desc_t hint, const char* name,
                            dnnl_primitive_desc_t* pd) {
    return check(dnnl_primitive_desc_create(pd, op, attr, e->engine, hint), name);
}

// The oneDNN objects of the operations of one layer.
typedef struct Parts {
    const OmKernelDef* def;
    dnnl_memory_desc_t src, dst, weights, bias;
    dnnl_memory_desc_t grad_weights;  // float for any type of the weights
    dnnl_dims_t stride, pad, window, dilation;
    dnnl_prop_kind_t forward;
    bool has_bias;
} Parts;

static void take_parts(const OmKernelDef* def, Parts* p, OmKernel* k) {
    const OmLayer* l = def->layer;
    const OmBlocks *src = def->src, *dst = def->dst;
    memset(p, 0, sizeof *p);
    p->def = def;
    p->forward = def->is_training || def->pass != OM_PASS_FORWARD ? dnnl_forward_training
                                                                  : dnnl_forward_inference;
    bool is_dense = l->kind == OM_LAYER_DENSE;
    int ndim = is_dense && om__net_cells(src->shape) == 1 ? 2 : 5;
    p->src = tensor_desc(src, ndim);
    p->dst = tensor_desc(dst, is_dense ? 2 : 5);
    for (int i = 0; i < 3; ++i) {
        p->stride[i] = l->stride[i];
        p->pad[i] = l->padding[i];
        p->window[i] = l->kernel[i];
    }
    if (l->weight < 0) return;
    const dnnl_dims_t dim = {dst->shape.c, src->shape.c, is_dense ? src->shape.d : l->kernel[0],
                             is_dense ? src->shape.h : l->kernel[1],
                             is_dense ? src->shape.w : l->kernel[2]};
    p->has_bias = l->bias >= 0;
    if (def->ngroup > 1) {
        const dnnl_dims_t grouped = {
            def->ngroup, dim[0] / def->ngroup, dim[1] / def->ngroup, dim[2], dim[3], dim[4]};
        p->weights = any_desc(6, grouped, data_type(src->type));
        p->grad_weights = any_desc(6, grouped, dnnl_f32);
        k->plain = plain_desc(6, grouped, false);
        return;
    }
    p->weights = any_desc(ndim, dim, data_type(src->type));
    p->grad_weights = any_desc(ndim, dim, dnnl_f32);
    k->plain = plain_desc(ndim, dim, l->kind == OM_LAYER_CONV_UP);
    if (p->has_bias) p->bias = any_desc(1, dim, dnnl_f32);
}

// The three operations of convolutions, up and down, and dense layers; `pd` of `pass`.
static OmStatus describe_conv(OmEngine* e, const Parts* p, OmPass pass, dnnl_primitive_attr_t attr,
                              const_dnnl_primitive_desc_t hint, dnnl_primitive_desc_t* pd) {
    const dnnl_memory_desc_t* bias = p->has_bias ? &p->bias : NULL;
    dnnl_convolution_desc_t d;
    dnnl_status_t s;
    const dnnl_alg_kind_t alg = dnnl_convolution_direct;
    if (pass == OM_PASS_FORWARD)
        s = dnnl_convolution_forward_desc_init(&d, p->forward, alg, &p->src, &p->weights, bias,
                                               &p->dst, p->stride, p->pad, p->pad);
    else if (pass == OM_PASS_DATA)
        s = dnnl_convolution_backward_data_desc_init(&d, alg, &p->src, &p->weights, &p->dst,
                                                     p->stride, p->pad, p->pad);
    else
        s = dnnl_convolution_backward_weights_desc_init(&d, alg, &p->src, &p->grad_weights, bias,
                                                        &p->dst, p->stride, p->pad, p->pad);
    OM_TRY(check(s, "a convolution"));
    return create_desc(e, &d, attr, hint, "a convolution", pd);
}

static OmStatus describe_conv_up(OmEngine* e, const Parts* p, OmPass pass,
                                 dnnl_primitive_attr_t attr, const_dnnl_primitive_desc_t hint,
                                 dnnl_primitive_desc_t* pd) {
    const dnnl_memory_desc_t* bias = p->has_bias ? &p->bias : NULL;
    dnnl_deconvolution_desc_t d;
    dnnl_status_t s;
    const dnnl_alg_kind_t alg = dnnl_deconvolution_direct;
    if (pass == OM_PASS_FORWARD)
        s = dnnl_deconvolution_forward_desc_init(&d, p->forward, alg, &p->src, &p->weights, bias,
                                                 &p->dst, p->stride, p->pad, p->pad);
    else if (pass == OM_PASS_DATA)
        s = dnnl_deconvolution_backward_data_desc_init(&d, alg, &p->src, &p->weights, &p->dst,
                                                       p->stride, p->pad, p->pad);
    else
        s = dnnl_deconvolution_backward_weights_desc_init(&d, alg, &p->src, &p->grad_weights, bias,
                                                          &p->dst, p->stride, p->pad, p->pad);
    OM_TRY(check(s, "a transposed convolution"));
    return create_desc(e, &d, attr, hint, "a transposed convolution", pd);
}

static OmStatus describe_dense(OmEngine* e, const Parts* p, OmPass pass, dnnl_primitive_attr_t attr,
                               const_dnnl_primitive_desc_t hint, dnnl_primitive_desc_t* pd) {
    const dnnl_memory_desc_t* bias = p->has_bias ? &p->bias : NULL;
    dnnl_inner_product_desc_t d;
    dnnl_status_t s;
    if (pass == OM_PASS_FORWARD)
        s = dnnl_inner_product_forward_desc_init(&d, p->forward, &p->src, &p->weights, bias,
                                                 &p->dst);
    else if (pass == OM_PASS_DATA)
        s = dnnl_inner_product_backward_data_desc_init(&d, &p->src, &p->weights, &p->dst);
    else
        s = dnnl_inner_product_backward_weights_desc_init(&d, &p->src, &p->grad_weights, bias,
                                                          &p->dst);
    OM_TRY(check(s, "a dense layer"));
    return create_desc(e, &d, attr, hint, "a dense layer", pd);
}

static OmStatus describe_pool(OmEngine* e, const Parts* p, OmPass pass, dnnl_primitive_attr_t attr,
                              const_dnnl_primitive_desc_t hint, dnnl_primitive_desc_t* pd) {
    dnnl_pooling_desc_t d;
    dnnl_status_t s;
    const dnnl_alg_kind_t alg = dnnl_pooling_max;
    if (pass == OM_PASS_FORWARD)
        s = dnnl_pooling_forward_desc_init(&d, p->forward, alg, &p->src, &p->dst, p->stride,
                                           p->window, p->pad, p->pad);
    else
        s = dnnl_pooling_backward_desc_init(&d, alg, &p->src, &p->dst, p->stride, p->window, p->pad,
                                            p->pad);
    OM_TRY(check(s, "max pooling"));
    return create_desc(e, &d, attr, hint, "max pooling", pd);
}

static OmStatus describe_upsample(OmEngine* e, const Parts* p, OmPass pass,
                                  dnnl_primitive_attr_t attr, const_dnnl_primitive_desc_t hint,
                                  dnnl_primitive_desc_t* pd) {
    dnnl_resampling_desc_t d;
    const int* scale = p->def->layer->scale;
    const float factor[3] = {(float)scale[0], (float)scale[1], (float)scale[2]};
    dnnl_status_t s;
    const dnnl_alg_kind_t alg = dnnl_resampling_linear;
    if (pass == OM_PASS_FORWARD)
        s = dnnl_resampling_forward_desc_init(&d, p->forward, alg, factor, &p->src, &p->dst);
    else
        s = dnnl_resampling_backward_desc_init(&d, alg, factor, &p->src, &p->dst);
    OM_TRY(check(s, "up-sampling"));
    return create_desc(e, &d, attr, hint, "up-sampling", pd);
}

static OmStatus describe_activation(OmEngine* e, const Parts* p, OmPass pass,
                                    dnnl_primitive_attr_t attr, const_dnnl_primitive_desc_t hint,
                                    dnnl_primitive_desc_t* pd) {
    dnnl_eltwise_desc_t d;
    dnnl_status_t s;
    dnnl_alg_kind_t alg = activation_alg(p->def->activation, true);
    if (pass == OM_PASS_FORWARD)
        s = dnnl_eltwise_forward_desc_init(&d, dnnl_forward_training, alg, &p->dst, p->def->slope,
                                           0);
    else
        s = dnnl_eltwise_backward_desc_init(&d, alg, &p->dst, &p->dst, p->def->slope, 0);
    OM_TRY(check(s, "an activation"));
    return create_desc(e, &d, attr, hint, "an activation", pd);
}

typedef OmStatus (*DescribeFn)(OmEngine*, const Parts*, OmPass, dnnl_primitive_attr_t,
                               const_dnnl_primitive_desc_t, dnnl_primitive_desc_t*);

// How each kind of layer is described, and the arguments of its passes.
static DescribeFn describe_of(OmLayerKind kind) {
    switch (kind) {
    case OM_LAYER_CONV: return describe_conv;
    case OM_LAYER_CONV_UP: return describe_conv_up;
    case OM_LAYER_DENSE: return describe_dense;
    case OM_LAYER_MAX_POOL: return describe_pool;
    case OM_LAYER_UPSAMPLE: return describe_upsample;
    default: return describe_activation;
    }
}

static void list_slots(const OmKernelDef* def, bool has_bias, OmSlot* slot) {
    int n = 0;
    const OmLayer* l = def->layer;
    bool is_activation = l->kind == OM_LAYER_ACTIVATION || def->activation != OM_IDENTITY;
    if (def->pass == OM_PASS_FORWARD) {
        slot[n++] = OM_SLOT_SRC;
        slot[n++] = OM_SLOT_DST;
        if (l->weight >= 0) slot[n++] = OM_SLOT_WEIGHTS;
        if (has_bias) slot[n++] = OM_SLOT_BIAS;
    } else if (def->pass == OM_PASS_DATA) {
        slot[n++] = OM_SLOT_DIFF_SRC;
        slot[n++] = OM_SLOT_DIFF_DST;
        if (l->weight >= 0 && !is_activation) slot[n++] = OM_SLOT_WEIGHTS;
        if (is_activation) slot[n++] = OM_SLOT_DST;
    } else {
        slot[n++] = OM_SLOT_SRC;
        slot[n++] = OM_SLOT_DIFF_DST;
        slot[n++] = OM_SLOT_DIFF_WEIGHTS;
        if (has_bias) slot[n++] = OM_SLOT_DIFF_BIAS;
    }
    if (l->kind == OM_LAYER_MAX_POOL && (def->is_training || def->pass == OM_PASS_DATA))
        slot[n++] = OM_SLOT_WORKSPACE;
    slot[n] = OM_SLOT_COUNT;
}

OmStatus om__kernel_create(OmEngine* e, const OmKernelDef* def, OmKernel** kernel) {
    *kernel = NULL;
    OmStatus status = OM_OK;
    dnnl_primitive_attr_t attr = NULL;
    dnnl_primitive_desc_t hint = NULL, pd = NULL;
    OmKernel* k = om_calloc(1, sizeof *k);
    if (!k) return OM_NO_MEMORY;
    Parts parts;
    take_parts(def, &parts, k);
    // The backward pass of a fused activation is a kernel of its own.
    bool is_activation = def->pass != OM_PASS_FORWARD && def->activation != OM_IDENTITY;
    DescribeFn describe = is_activation ? describe_activation : describe_of(def->layer->kind);
    OmSlot slots[OM_SLOT_COUNT + 1];
    list_slots(def, parts.has_bias, slots);
    bool is_own = describe == describe_activation;  // the activation is the operation itself
    OmKernelDef bare = *def;
    if (is_own) bare.activation = OM_IDENTITY;
    OM_TRY_DONE(create_attr(&bare, &attr));
    if (def->pass != OM_PASS_FORWARD)
        OM_TRY_DONE(describe(e, &parts, OM_PASS_FORWARD, NULL, NULL, &hint));
    OM_TRY_DONE(describe(e, &parts, def->pass, attr, hint, &pd));
    OM_TRY_DONE(finish_kernel(e, pd, slots, om_layer_kind_name(def->layer->kind), k));
    *kernel = k;
    k = NULL;
done:
    if (hint) dnnl_primitive_desc_destroy(hint);
    if (pd) dnnl_primitive_desc_destroy(pd);
    if (attr) dnnl_primitive_attr_destroy(attr);
    om__kernel_destroy(k);
    if (status < 0) om_error_prefix(status, "layer %s", def->layer->name);
    return status;
}

OmStatus om__kernel_create_reorder(OmEngine* e, const OmKernel* owner, OmSlot slot,
                                   bool is_to_plain, OmKernel** kernel) {
    *kernel = NULL;
    OmStatus status = OM_OK;
    dnnl_primitive_attr_t attr = NULL;
    dnnl_primitive_desc_t pd = NULL;
    OmKernel* k = om_calloc(1, sizeof *k);
    if (!k) return OM_NO_MEMORY;
    const dnnl_memory_desc_t* inner = NULL;
    OM_TRY_DONE(check(dnnl_memory_get_memory_desc(owner->memory[slot], &inner), "weights"));
    const dnnl_memory_desc_t *from = is_to_plain ? inner : &owner->plain,
                             *to = is_to_plain ? &owner->plain : inner;
    OM_TRY_DONE(create_attr(&(OmKernelDef){.pass = OM_PASS_FORWARD}, &attr));
    OM_TRY_DONE(check(dnnl_reorder_primitive_desc_create(&pd, from, e->engine, to, e->engine, attr),
                      "a change of layout"));
    const OmSlot slots[] = {OM_SLOT_SRC, OM_SLOT_DST, OM_SLOT_COUNT};
    OM_TRY_DONE(finish_kernel(e, pd, slots, "a change of layout", k));
    *kernel = k;
    k = NULL;
done:
    if (pd) dnnl_primitive_desc_destroy(pd);
    if (attr) dnnl_primitive_attr_destroy(attr);
    om__kernel_destroy(k);
    return status;
}

size_t om__kernel_bytes(const OmKernel* kernel, OmSlot slot) {
    return kernel ? kernel->bytes[slot] : 0;
}

bool om__kernel_is_same(const OmKernel* a, OmSlot a_slot, const OmKernel* b, OmSlot b_slot) {
    const dnnl_memory_desc_t *x = NULL, *y = NULL;
    return a && b && a->memory[a_slot] && b->memory[b_slot] &&
           dnnl_memory_get_memory_desc(a->memory[a_slot], &x) == dnnl_success &&
           dnnl_memory_get_memory_desc(b->memory[b_slot], &y) == dnnl_success &&
           dnnl_memory_desc_equal(x, y);
}

OmStatus om__kernel_bind(OmKernel* kernel, OmSlot slot, const void* data) {
    if (!kernel || !kernel->memory[slot]) return OM_OK;
    return check(dnnl_memory_set_data_handle_v2(kernel->memory[slot], (void*)data, kernel->stream),
                 "memory");
}

OmStatus om__kernel_run(OmKernel* k) {
    return check(dnnl_primitive_execute(k->primitive, k->stream, k->narg, k->arg), "a layer");
}

const char* om__kernel_name(const OmKernel* k) {
    const char* name = "";
    const_dnnl_primitive_desc_t pd = NULL;
    if (k && dnnl_primitive_get_primitive_desc(k->primitive, &pd) == dnnl_success)
        dnnl_primitive_desc_query(pd, dnnl_query_impl_info_str, 0, &name);
    return name;
}

int om__engine_block(OmNetType type) {
    int isa = (int)dnnl_get_effective_cpu_isa();
    if ((isa & (int)dnnl_cpu_isa_avx512_core) == (int)dnnl_cpu_isa_avx512_core) return 16;
    return type == OM_F32 && (isa & (int)dnnl_cpu_isa_avx2) == (int)dnnl_cpu_isa_avx2 ? 8 : 0;
}

bool om__engine_multiplies_bf16(void) {
    int isa = (int)dnnl_get_effective_cpu_isa(), wanted = (int)dnnl_cpu_isa_avx512_core_bf16;
    return (isa & wanted) == wanted;
}
