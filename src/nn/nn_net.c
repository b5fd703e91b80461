// nn_net.c: the description of a network: layers, their shapes, and the table of parameters.
//
// A failed om_net_add_* stores its status and message in the net, and every later call returns -1. So a
// network is written as a list of layers and checked once, by om_net_finish.
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <string.h>

#include "nn/nn_internal.h"

static const char* const kind_name[OM_LAYER_NKIND] = {
    "input",      "conv",    "conv_up",    "upsample",   "max_pool", "dense",
    "activation", "dropout", "batch_norm", "group_norm", "concat",   "mask"};

const char* om_layer_kind_name(OmLayerKind kind) {
    return kind >= 0 && kind < OM_LAYER_NKIND ? kind_name[kind] : "unknown";
}

const char* om_activation_name(OmActivation a) {
    static const char* const name[] = {"linear", "relu", "leaky_relu", "tanh", "sigmoid"};
    return a >= 0 && a <= OM_SIGMOID ? name[a] : "unknown";
}

OmStatus om_net_create(OmNet** net) {
    *net = om_calloc(1, sizeof **net);
    if (!*net) return OM_NO_MEMORY;
    (*net)->output = -1;
    return OM_OK;
}

void om_net_destroy(OmNet* net) {
    if (!net) return;
    for (int i = 0; i < net->nlayer; ++i) om_free((void*)net->layer[i].mask);
    om_free(net->layer);
    om_free(net->param);
    om_free(net);
}

// ---- failures -----------------------------------------------------------------------------------------

// Remember the message of this thread as the net's first failure.
static int keep_failure(OmNet* net, OmStatus status) {
    net->status = status;
    snprintf(net->error, sizeof net->error, "%s", om_error_message());
    return -1;
}

static int fail(OmNet* net, const char* layer, const char* format, ...) OM_PRINTF(3, 4);
static int fail(OmNet* net, const char* layer, const char* format, ...) {
    char why[400];
    va_list args;
    va_start(args, format);
    vsnprintf(why, sizeof why, format, args);
    va_end(args);
    return keep_failure(net, om_error(OM_INVALID, "layer %s: %s", layer, why));
}

// ---- layers and parameters ------------------------------------------------------------------------------

static bool is_name(const char* name) {
    size_t len = name ? strlen(name) : 0;
    const char* allowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.-";
    return len >= 1 && len <= 50 && strspn(name, allowed) == len;
}

static bool has_layer(const OmNet* net, const char* name) {
    for (int i = 0; i < net->nlayer; ++i)
        if (strcmp(net->layer[i].name, name) == 0) return true;
    return false;
}

// Room for one more of `size` bytes in an array that doubles.
static OmStatus reserve(void** array, int count, int* cap, size_t size) {
    if (count < *cap) return OM_OK;
    int more = *cap ? 2 * *cap : 16;
    void* grown = om_realloc(*array, (size_t)*cap, (size_t)more, size);
    if (!grown) return OM_NO_MEMORY;
    *array = grown;
    *cap = more;
    return OM_OK;
}

// A layer of this kind reading x, with the shape of x; null after a failure. It is not yet in the net.
static OmLayer* begin_layer(OmNet* net, OmLayerKind kind, const char* name, int x) {
    if (net->status < 0) return NULL;
    char own[OM_NET_NAME];
    if (!name) {
        snprintf(own, sizeof own, "%s_%d", kind_name[kind], net->nlayer);
        name = own;
    }
    if (net->is_finished) {
        fail(net, name, "the network is finished; layers go in before om_net_finish");
        return NULL;
    }
    if (!is_name(name)) {
        fail(net, kind_name[kind], "its name \"%.60s\" is not 1 to 50 of A-Z a-z 0-9 _ . -",
             name ? name : "");
        return NULL;
    }
    if (has_layer(net, name)) {
        fail(net, name, "there is already a layer of this name");
        return NULL;
    }
    if (kind != OM_LAYER_INPUT && (x < 0 || x >= net->nlayer)) {
        fail(net, name, "input %d is none of the %d layers before it", x, net->nlayer);
        return NULL;
    }
    OmStatus status = reserve((void**)&net->layer, net->nlayer, &net->layer_cap, sizeof(OmLayer));
    if (status < 0) {
        keep_failure(net, status);
        return NULL;
    }
    OmLayer* layer = &net->layer[net->nlayer];
    *layer = (OmLayer){.kind = kind, .weight = -1, .bias = -1, .mean = -1, .variance = -1};
    snprintf(layer->name, sizeof layer->name, "%s", name);
    if (kind != OM_LAYER_INPUT) {
        layer->ninput = 1;
        layer->input[0] = x;
        layer->shape = net->layer[x].shape;
    }
    return layer;
}

// Append the layer; its index, or -1 if its shape is invalid.
static int end_layer(OmNet* net, OmLayer* layer) {
    const int extent[4] = {layer->shape.c, layer->shape.d, layer->shape.h, layer->shape.w};
    static const char* const axis[4] = {"channels", "depth", "height", "width"};
    int64_t values = 1;
    for (int k = 0; k < 4; ++k) {
        if (extent[k] < 1)
            return fail(net, layer->name, "its output would have %d %s", extent[k], axis[k]);
        values *= extent[k];
        if (values > INT32_MAX)
            return fail(net, layer->name, "its output %d x %d x %d x %d has over 2^31 values",
                        extent[0], extent[1], extent[2], extent[3]);
    }
    return net->nlayer++;
}

// Append an entry to the table; its index, or -1 with the failure stored.
static int add_parameter(OmNet* net, const OmLayer* layer, const char* what, int ndim,
                         const int64_t* dim) {
    OmStatus status =
        reserve((void**)&net->param, net->nparam, &net->param_cap, sizeof(OmNetParameter));
    if (status < 0) return keep_failure(net, status);
    OmNetParameter* p = &net->param[net->nparam];
    *p = (OmNetParameter){.ndim = ndim, .num = 1, .layer = net->nlayer, .is_trained = true};
    snprintf(p->name, sizeof p->name, "%.50s.%s", layer->name, what);
    for (int k = 0; k < ndim; ++k) {
        p->num = p->num <= INT32_MAX ? p->num * dim[k] : p->num;
        p->dim[k] = (int)dim[k];
    }
    if (p->num > INT32_MAX) return fail(net, layer->name, "its %s has over 2^31 values", what);
    p->is_decayed = ndim > 1;
    if (net->nparam > 0) p->adr = p[-1].adr + p[-1].num;
    return net->nparam++;
}

int om_net_add_input(OmNet* net, const char* name, OmNetShape shape) {
    OmLayer* layer = begin_layer(net, OM_LAYER_INPUT, name, -1);
    if (!layer) return -1;
    if (net->nlayer > 0) return fail(net, name, "the input is the first layer and the only one");
    layer->shape = shape;
    return end_layer(net, layer);
}

OmNetConv om_net_conv(int channels, int kernel) {
    return om_net_conv_strided(channels, kernel, 1, kernel > 0 ? (kernel - 1) / 2 : 0);
}

OmNetConv om_net_conv_strided(int channels, int kernel, int stride, int padding) {
    return (OmNetConv){channels,
                       {kernel, kernel, kernel},
                       {stride, stride, stride},
                       {padding, padding, padding},
                       true};
}

// Store kernel, stride and padding of convolutions and pooling in the layer.
static int take_windows(OmNet* net, OmLayer* layer, const int kernel[3], const int stride[3],
                        const int padding[3]) {
    for (int k = 0; k < 3; ++k) {
        if (kernel[k] < 1 || kernel[k] > 1024)
            return fail(net, layer->name, "kernel %d is not in 1 to 1024", kernel[k]);
        if (stride[k] < 1 || stride[k] > 1024)
            return fail(net, layer->name, "stride %d is not in 1 to 1024", stride[k]);
        if (padding[k] < 0 || padding[k] >= kernel[k])
            return fail(net, layer->name, "padding %d is not in 0 to kernel - 1 = %d", padding[k],
                        kernel[k] - 1);
        layer->kernel[k] = kernel[k];
        layer->stride[k] = stride[k];
        layer->padding[k] = padding[k];
    }
    return 0;
}

// Compute the layer's shape from windows of `kernel`; -1 if not even one window fits.
static int shrink_shape(OmNet* net, OmLayer* layer) {
    int* extent[3] = {&layer->shape.d, &layer->shape.h, &layer->shape.w};
    for (int k = 0; k < 3; ++k) {
        int room = *extent[k] + 2 * layer->padding[k] - layer->kernel[k];
        if (room < 0)
            return fail(net, layer->name, "its kernel of %d is larger than the padded input of %d",
                        layer->kernel[k], *extent[k] + 2 * layer->padding[k]);
        *extent[k] = room / layer->stride[k] + 1;
    }
    return 0;
}

static int grow_shape(OmNet* net, OmLayer* layer) {
    int* extent[3] = {&layer->shape.d, &layer->shape.h, &layer->shape.w};
    for (int k = 0; k < 3; ++k) {
        int64_t out =
            (int64_t)(*extent[k] - 1) * layer->stride[k] + layer->kernel[k] - 2 * layer->padding[k];
        if (out < 1 || out > INT32_MAX)
            return fail(net, layer->name, "its output would have an extent of %lld",
                        (long long)out);
        *extent[k] = (int)out;
    }
    return 0;
}

static int add_any_conv(OmNet* net, OmLayerKind kind, const char* name, int x, OmNetConv conv) {
    OmLayer* layer = begin_layer(net, kind, name, x);
    if (!layer) return -1;
    if (conv.channels < 1) return fail(net, name, "%d channels of output", conv.channels);
    if (take_windows(net, layer, conv.kernel, conv.stride, conv.padding) < 0) return -1;
    int in = layer->shape.c, out = conv.channels;
    bool is_up = kind == OM_LAYER_CONV_UP;
    if ((is_up ? grow_shape(net, layer) : shrink_shape(net, layer)) < 0) return -1;
    layer->shape.c = out;
    const int64_t dim[5] = {is_up ? in : out, is_up ? out : in, conv.kernel[0], conv.kernel[1],
                            conv.kernel[2]};
    layer->weight = add_parameter(net, layer, "weight", 5, dim);
    if (layer->weight < 0) return -1;
    if (conv.has_bias) {
        layer->bias = add_parameter(net, layer, "bias", 1, (int64_t[]){out});
        if (layer->bias < 0) return -1;
    }
    return end_layer(net, layer);
}

int om_net_add_conv(OmNet* net, const char* name, int x, OmNetConv conv) {
    return add_any_conv(net, OM_LAYER_CONV, name, x, conv);
}

int om_net_add_conv_up(OmNet* net, const char* name, int x, OmNetConv conv) {
    return add_any_conv(net, OM_LAYER_CONV_UP, name, x, conv);
}

int om_net_add_upsample(OmNet* net, int x, const int scale[3]) {
    OmLayer* layer = begin_layer(net, OM_LAYER_UPSAMPLE, NULL, x);
    if (!layer) return -1;
    int* extent[3] = {&layer->shape.d, &layer->shape.h, &layer->shape.w};
    for (int k = 0; k < 3; ++k) {
        if (scale[k] < 1 || scale[k] > 64 || (int64_t)scale[k] * *extent[k] > INT32_MAX)
            return fail(net, layer->name, "factor %d is not in 1 to 64", scale[k]);
        layer->scale[k] = scale[k];
        *extent[k] *= scale[k];
    }
    return end_layer(net, layer);
}

int om_net_add_max_pool(OmNet* net, int x, const int kernel[3], const int stride[3],
                        const int padding[3]) {
    OmLayer* layer = begin_layer(net, OM_LAYER_MAX_POOL, NULL, x);
    if (!layer || take_windows(net, layer, kernel, stride, padding) < 0) return -1;
    for (int k = 0; k < 3; ++k)
        if (2 * padding[k] > kernel[k])
            return fail(net, layer->name, "padding %d is over half the kernel of %d", padding[k],
                        kernel[k]);
    if (shrink_shape(net, layer) < 0) return -1;
    return end_layer(net, layer);
}

int om_net_add_dense(OmNet* net, const char* name, int x, int nout) {
    OmLayer* layer = begin_layer(net, OM_LAYER_DENSE, name, x);
    if (!layer) return -1;
    if (nout < 1) return fail(net, name, "%d values of output", nout);
    const int64_t dim[2] = {nout, om__net_values(layer->shape)};
    layer->shape = (OmNetShape){nout, 1, 1, 1};
    layer->weight = add_parameter(net, layer, "weight", 2, dim);
    if (layer->weight < 0) return -1;
    layer->bias = add_parameter(net, layer, "bias", 1, dim);
    if (layer->bias < 0) return -1;
    return end_layer(net, layer);
}

int om_net_add_activation(OmNet* net, int x, OmActivation activation, float slope) {
    OmLayer* layer = begin_layer(net, OM_LAYER_ACTIVATION, NULL, x);
    if (!layer) return -1;
    if (activation < OM_RELU || activation > OM_SIGMOID)
        return fail(net, layer->name, "%d is none of relu, leaky_relu, tanh, sigmoid", activation);
    if (activation == OM_LEAKY_RELU && !(slope >= 0 && slope < 1))
        return fail(net, layer->name, "slope %g is not in [0, 1)", (double)slope);
    layer->activation = activation;
    layer->slope = activation == OM_LEAKY_RELU ? slope : 0;
    return end_layer(net, layer);
}

int om_net_add_dropout(OmNet* net, int x, float rate) {
    OmLayer* layer = begin_layer(net, OM_LAYER_DROPOUT, NULL, x);
    if (!layer) return -1;
    if (!(rate >= 0 && rate < 1))
        return fail(net, layer->name, "rate %g is not in [0, 1)", (double)rate);
    layer->rate = rate;
    return end_layer(net, layer);
}

static int add_norm(OmNet* net, OmLayerKind kind, const char* name, int x, int ngroup) {
    OmLayer* layer = begin_layer(net, kind, name, x);
    if (!layer) return -1;
    if (ngroup < 0 || (ngroup > 0 && layer->shape.c % ngroup != 0))
        return fail(net, name, "%d groups do not divide %d channels", ngroup, layer->shape.c);
    layer->epsilon = 1e-5f;
    layer->ngroup = ngroup;
    const int64_t dim[1] = {layer->shape.c};
    if ((layer->weight = add_parameter(net, layer, "weight", 1, dim)) < 0) return -1;
    if ((layer->bias = add_parameter(net, layer, "bias", 1, dim)) < 0) return -1;
    if (kind == OM_LAYER_BATCH_NORM) {
        layer->momentum = 0.1f;
        if ((layer->mean = add_parameter(net, layer, "running_mean", 1, dim)) < 0) return -1;
        if ((layer->variance = add_parameter(net, layer, "running_var", 1, dim)) < 0) return -1;
        net->param[layer->mean].is_trained = net->param[layer->variance].is_trained = false;
    }
    return end_layer(net, layer);
}

int om_net_add_batch_norm(OmNet* net, const char* name, int x) {
    return add_norm(net, OM_LAYER_BATCH_NORM, name, x, 0);
}

int om_net_add_group_norm(OmNet* net, const char* name, int x, int ngroup) {
    return add_norm(net, OM_LAYER_GROUP_NORM, name, x, ngroup == 0 ? -1 : ngroup);
}

int om_net_add_concat(OmNet* net, int ninput, const int* x) {
    OmLayer* layer = begin_layer(net, OM_LAYER_CONCAT, NULL, ninput > 0 ? x[0] : -1);
    if (!layer) return -1;
    if (ninput < 2 || ninput > OM_LAYER_MAX_INPUT)
        return fail(net, layer->name, "%d inputs, not 2 to %d", ninput, OM_LAYER_MAX_INPUT);
    int64_t channels = layer->shape.c;
    for (int k = 1; k < ninput; ++k) {
        if (x[k] < 0 || x[k] >= net->nlayer)
            return fail(net, layer->name, "input %d is none of the layers before it", x[k]);
        OmNetShape a = net->layer[x[0]].shape, b = net->layer[x[k]].shape;
        if (a.d != b.d || a.h != b.h || a.w != b.w)
            return fail(net, layer->name, "%s is %d x %d x %d, but %s is %d x %d x %d",
                        net->layer[x[0]].name, a.d, a.h, a.w, net->layer[x[k]].name, b.d, b.h, b.w);
        channels += b.c;
        layer->input[k] = x[k];
    }
    if (channels > INT32_MAX) return fail(net, layer->name, "over 2^31 channels");
    layer->ninput = ninput;
    layer->shape.c = (int)channels;
    return end_layer(net, layer);
}

int om_net_add_mask(OmNet* net, int x, const float* mask) {
    OmLayer* layer = begin_layer(net, OM_LAYER_MASK, NULL, x);
    if (!layer) return -1;
    if (!mask) return fail(net, layer->name, "no values");
    size_t num = (size_t)om__net_cells(layer->shape);
    for (size_t i = 0; i < num; ++i)
        if (!isfinite(mask[i])) return fail(net, layer->name, "value %zu is not finite", i);
    float* copy = om_alloc(num, sizeof *copy);
    if (!copy) return keep_failure(net, OM_NO_MEMORY);
    memcpy(copy, mask, num * sizeof *copy);
    layer->mask = copy;
    return end_layer(net, layer);
}

// ---- finishing ----------------------------------------------------------------------------------------

OmStatus om_net_finish(OmNet* net, int output) {
    if (net->status < 0) return om_error(net->status, "%s", net->error);
    OM_CHECK(!net->is_finished, OM_INVALID, "the network is finished already");
    OM_CHECK(output >= 0 && output < net->nlayer, OM_INVALID,
             "output %d is none of the network's %d layers", output, net->nlayer);
    // Backwards: a layer is needed if a needed layer reads it.
    bool* is_needed = om_calloc((size_t)net->nlayer, sizeof *is_needed);
    if (!is_needed) return OM_NO_MEMORY;
    is_needed[output] = true;
    int unused = -1;
    for (int i = net->nlayer - 1; i >= 0; --i) {
        if (!is_needed[i]) unused = i;
        for (int k = 0; k < net->layer[i].ninput && is_needed[i]; ++k)
            is_needed[net->layer[i].input[k]] = true;
    }
    om_free(is_needed);
    OM_CHECK(unused < 0, OM_INVALID, "layer %s: the output %s does not depend on it",
             net->layer[unused].name, net->layer[output].name);
    net->output = output;
    net->is_finished = true;
    return OM_OK;
}

int om_net_layer_count(const OmNet* net) { return net->nlayer; }

const OmLayer* om_net_layer(const OmNet* net, int i) {
    return i >= 0 && i < net->nlayer ? &net->layer[i] : NULL;
}

int om_net_output(const OmNet* net) { return net->output; }

int64_t om_net_in_size(const OmNet* net) {
    return net->nlayer > 0 ? om__net_values(net->layer[0].shape) : 0;
}

int64_t om_net_out_size(const OmNet* net) {
    return net->output >= 0 ? om__net_values(net->layer[net->output].shape) : 0;
}

uint64_t om_net_hash(const OmNet* net) {
    uint64_t hash = OM_HASH_SEED;
    for (int i = 0; i < net->nlayer; ++i) {
        // field by field, because padding bytes of the struct are undefined
        const OmLayer layer = net->layer[i];
        hash = om_hash(layer.name, strlen(layer.name), hash);
        const int32_t word[] = {(int32_t)layer.kind,
                                layer.ninput,
                                layer.input[0],
                                layer.input[1],
                                layer.input[2],
                                layer.input[3],
                                layer.shape.c,
                                layer.shape.d,
                                layer.shape.h,
                                layer.shape.w,
                                layer.kernel[0],
                                layer.kernel[1],
                                layer.kernel[2],
                                layer.stride[0],
                                layer.stride[1],
                                layer.stride[2],
                                layer.padding[0],
                                layer.padding[1],
                                layer.padding[2],
                                layer.scale[0],
                                layer.scale[1],
                                layer.scale[2],
                                (int32_t)layer.activation,
                                layer.ngroup,
                                layer.weight,
                                layer.bias,
                                layer.mean,
                                layer.variance};
        const float real[] = {layer.slope, layer.rate, layer.epsilon, layer.momentum};
        hash = om_hash(word, sizeof word, hash);
        hash = om_hash(real, sizeof real, hash);
        if (layer.mask)
            hash = om_hash(layer.mask, (size_t)om__net_cells(layer.shape) * sizeof(float), hash);
    }
    const int32_t end[2] = {net->output, 0};
    return om_hash(end, sizeof end, hash);
}

int om_net_parameter_count(const OmNet* net) { return net->nparam; }

const OmNetParameter* om_net_parameter(const OmNet* net, int i) {
    return i >= 0 && i < net->nparam ? &net->param[i] : NULL;
}

int om_net_find_parameter(const OmNet* net, const char* name) {
    for (int i = 0; i < net->nparam; ++i)
        if (strcmp(net->param[i].name, name) == 0) return i;
    return -1;
}

size_t om_net_parameter_size(const OmNet* net) {
    if (net->nparam == 0) return 0;
    const OmNetParameter* last = &net->param[net->nparam - 1];
    return (size_t)(last->adr + last->num);
}

// Square of the gain of the activation that reads the layer, also behind norms and dropout: He et al. 2015.
static double gain_squared(const OmNet* net, int layer) {
    for (int i = layer + 1; i < net->nlayer; ++i) {
        const OmLayer* l = &net->layer[i];
        bool is_reader = false;
        for (int k = 0; k < l->ninput; ++k) is_reader = is_reader || l->input[k] == layer;
        if (!is_reader) continue;
        if (l->kind == OM_LAYER_BATCH_NORM || l->kind == OM_LAYER_GROUP_NORM ||
            l->kind == OM_LAYER_DROPOUT || l->kind == OM_LAYER_MASK)
            return gain_squared(net, i);
        if (l->kind != OM_LAYER_ACTIVATION) return 1;
        if (l->activation == OM_TANH) return 25.0 / 9;
        if (l->activation == OM_SIGMOID) return 1;
        return 2 / (1 + (double)l->slope * (double)l->slope);
    }
    return 1;
}

void om_net_init_parameters(const OmNet* net, uint64_t seed, float* param) {
    for (int i = 0; i < net->nparam; ++i) {
        const OmNetParameter* p = &net->param[i];
        const OmLayer* layer = &net->layer[p->layer];
        float* value = param + p->adr;
        if (!p->is_decayed) {  // biases and means 0, factors and variances 1
            bool is_one = i == layer->weight || i == layer->variance;
            for (int64_t k = 0; k < p->num; ++k) value[k] = is_one ? 1 : 0;
            continue;
        }
        // Number of products in an output's sum: a transposed convolution adds kernel / stride of them per axis.
        double fan = (double)p->num / p->dim[0];
        if (layer->kind == OM_LAYER_CONV_UP) {
            fan = (double)p->num / p->dim[1];
            for (int k = 0; k < 3; ++k) fan /= fmin(layer->stride[k], layer->kernel[k]);
        }
        double bound = sqrt(3 * gain_squared(net, p->layer) / fan);
        OmRng rng = om_rng_init(seed, (uint64_t)i);
        for (int64_t k = 0; k < p->num; ++k) value[k] = (float)om_rng_range(&rng, -bound, bound);
    }
}
