// nn_onnx.c: a network as an ONNX file, for other runtimes.
//
// ONNX is one message of Protocol Buffers, written here field by field: a key (number << 3
// type), then a varint, four bytes, or a length and that many bytes. The length of a nested message is not known at its
// beginning: five bytes are reserved for it, the longest varint of a length.
//
// Opset 13. Each layer is a node "n<i>" with the value "v<i>", except: a dense layer is flattened before and reshaped
// after; group normalisation, which that opset lacks, is an instance normalisation with groups as channels, followed
// by weight and bias; dropout is omitted.
#include <string.h>

#include "omentum/nn_file.h"

enum { VARINT = 0, BYTES = 2, WORD = 5 };  // how a field is written
enum { TYPE_FLOAT = 1, TYPE_INT64 = 7 };   // TensorProto.DataType
enum { LENGTH_BYTES = 5, MAX_NAME = OM_NET_NAME + 16 };
#define MAX_FILE ((size_t)0x7fffffff)  // bytes of a message; a limit of every implementation

typedef struct Writer {
    const OmNet* net;
    const float* param;
    OmText text;
    OmStatus status;  // the first failure
} Writer;

// ---- Protocol Buffers -------------------------------------------------------------------------------

static void put(Writer* w, const void* data, size_t size) {
    if (w->status == OM_OK) w->status = om_text_append_raw(&w->text, data, size);
}

static void put_varint(Writer* w, uint64_t value) {
    unsigned char byte[10];
    size_t n = 0;
    do {
        byte[n] = (unsigned char)((value & 0x7f) | (value > 0x7f ? 0x80 : 0));
        value >>= 7;
        ++n;
    } while (value > 0);
    put(w, byte, n);
}

static void put_key(Writer* w, int field, int type) {
    put_varint(w, (uint64_t)field << 3 | (uint64_t)type);
}

static void put_integer(Writer* w, int field, int64_t value) {
    put_key(w, field, VARINT);
    put_varint(w, (uint64_t)value);
}

static void put_string(Writer* w, int field, const char* str) {
    put_key(w, field, BYTES);
    put_varint(w, strlen(str));
    put(w, str, strlen(str));
}

static void put_word(Writer* w, uint32_t bits) {
    const unsigned char byte[4] = {(unsigned char)bits, (unsigned char)(bits >> 8),
                                   (unsigned char)(bits >> 16), (unsigned char)(bits >> 24)};
    put(w, byte, sizeof byte);
}

static uint32_t float_bits(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

// A nested message: its content is written between begin and end. Returns the position of its length.
static size_t begin(Writer* w, int field) {
    const unsigned char room[LENGTH_BYTES] = {0};
    put_key(w, field, BYTES);
    put(w, room, sizeof room);
    return w->text.len;
}

static void end(Writer* w, size_t at) {
    if (w->status != OM_OK) return;
    uint64_t size = w->text.len - at;
    for (int i = 0; i < LENGTH_BYTES; ++i) {
        unsigned char byte =
            (unsigned char)((size >> 7 * i & 0x7f) | (i < LENGTH_BYTES - 1 ? 0x80 : 0));
        w->text.str[at - LENGTH_BYTES + (size_t)i] = (char)byte;
    }
}

// ---- tensors and nodes ------------------------------------------------------------------------------

static void put_dims(Writer* w, int field, int rank, const int* dim) {
    for (int i = 0; i < rank; ++i) put_integer(w, field, dim[i]);
}

// GraphProto.initializer
static void put_floats(Writer* w, const char* name, int rank, const int* dim, const float* value) {
    size_t count = 1, tensor = begin(w, 5);
    for (int i = 0; i < rank; ++i) count *= (size_t)dim[i];
    put_dims(w, 1, rank, dim);
    put_integer(w, 2, TYPE_FLOAT);
    put_string(w, 8, name);
    size_t raw = begin(w, 9);
    for (size_t i = 0; i < count; ++i) put_word(w, float_bits(value[i]));
    end(w, raw);
    end(w, tensor);
}

static void put_integers(Writer* w, const char* name, int count, const int64_t* value) {
    size_t tensor = begin(w, 5);
    put_dims(w, 1, 1, &count);
    put_integer(w, 2, TYPE_INT64);
    put_string(w, 8, name);
    size_t raw = begin(w, 9);
    for (int i = 0; i < count; ++i) {
        put_word(w, (uint32_t)(uint64_t)value[i]);
        put_word(w, (uint32_t)((uint64_t)value[i] >> 32));
    }
    end(w, raw);
    end(w, tensor);
}

// The attributes of a node follow until end(w, ..).
static size_t begin_node(Writer* w, const char* op, const char* output, int ninput,
                         const char* const* input) {
    size_t at = begin(w, 1);
    for (int i = 0; i < ninput; ++i) put_string(w, 1, input[i]);
    put_string(w, 2, output);
    put_string(w, 3, output);
    put_string(w, 4, op);
    return at;
}

static void put_node(Writer* w, const char* op, const char* output, int ninput,
                     const char* const* input) {
    end(w, begin_node(w, op, output, ninput, input));
}

static void put_int_attribute(Writer* w, const char* name, int value) {
    size_t at = begin(w, 5);
    put_string(w, 1, name);
    put_integer(w, 3, value);
    put_integer(w, 20, 2);
    end(w, at);
}

static void put_ints_attribute(Writer* w, const char* name, int count, const int* value) {
    size_t at = begin(w, 5);
    put_string(w, 1, name);
    put_dims(w, 8, count, value);
    put_integer(w, 20, 7);
    end(w, at);
}

static void put_float_attribute(Writer* w, const char* name, float value) {
    size_t at = begin(w, 5);
    put_string(w, 1, name);
    put_key(w, 2, WORD);
    put_word(w, float_bits(value));
    put_integer(w, 20, 1);
    end(w, at);
}

static void put_string_attribute(Writer* w, const char* name, const char* value) {
    size_t at = begin(w, 5);
    put_string(w, 1, name);
    put_string(w, 4, value);
    put_integer(w, 20, 3);
    end(w, at);
}

// ---- layers -----------------------------------------------------------------------------------------

typedef struct Name {
    char str[MAX_NAME];
} Name;

static Name value_name(const OmNet* net, int layer) {
    Name name;
    if (layer == om_net_output(net))
        snprintf(name.str, sizeof name.str, "output");
    else if (om_net_layer(net, layer)->kind == OM_LAYER_INPUT)
        snprintf(name.str, sizeof name.str, "input");
    else
        snprintf(name.str, sizeof name.str, "v%d", layer);
    return name;
}

// A constant or a value between the nodes of one layer.
static Name own_name(int layer, const char* what) {
    Name name;
    snprintf(name.str, sizeof name.str, "v%d.%s", layer, what);
    return name;
}

static const char* param_name(const Writer* w, int index) {
    return om_net_parameter(w->net, index)->name;
}

// Conv, ConvTranspose, MaxPool
static void put_window(Writer* w, const OmLayer* l, const char* op, const char* out,
                       const char* in) {
    const char* input[3] = {in, l->weight >= 0 ? param_name(w, l->weight) : NULL,
                            l->bias >= 0 ? param_name(w, l->bias) : NULL};
    int ninput = l->weight < 0 ? 1 : l->bias < 0 ? 2 : 3;
    const int pads[6] = {l->padding[0], l->padding[1], l->padding[2],
                         l->padding[0], l->padding[1], l->padding[2]};
    size_t at = begin_node(w, op, out, ninput, input);
    put_ints_attribute(w, "kernel_shape", 3, l->kernel);
    put_ints_attribute(w, "strides", 3, l->stride);
    put_ints_attribute(w, "pads", 6, pads);
    end(w, at);
}

static void put_reshape(Writer* w, const char* out, const char* in, const char* shape_name,
                        int rank, const int64_t* shape) {
    put_integers(w, shape_name, rank, shape);
    put_node(w, "Reshape", out, 2, (const char*[]){in, shape_name});
}

static void put_dense(Writer* w, int i, const OmLayer* l, const char* out, const char* in) {
    Name flat = own_name(i, "flat"), row = own_name(i, "row"), shape = own_name(i, "shape");
    const char* input[3] = {flat.str, param_name(w, l->weight),
                            l->bias >= 0 ? param_name(w, l->bias) : NULL};
    const int64_t five[5] = {-1, l->shape.c, 1, 1, 1};
    put_node(w, "Flatten", flat.str, 1, &in);  // axis 1
    size_t at = begin_node(w, "Gemm", row.str, l->bias >= 0 ? 3 : 2, input);
    put_int_attribute(w, "transB", 1);
    end(w, at);
    put_reshape(w, out, row.str, shape.str, 5, five);
}

// Nearest cell by cell centres; the first two extents do not change.
static void put_upsample(Writer* w, int i, const OmLayer* l, const char* out, const char* in) {
    Name scales = own_name(i, "scales");
    const int five = 5;
    const float scale[5] = {1, 1, (float)l->scale[0], (float)l->scale[1], (float)l->scale[2]};
    put_floats(w, scales.str, 1, &five, scale);
    size_t at = begin_node(w, "Resize", out, 3, (const char*[]){in, "", scales.str});
    put_string_attribute(w, "mode", "linear");
    put_string_attribute(w, "coordinate_transformation_mode", "half_pixel");
    end(w, at);
}

static void put_batch_norm(Writer* w, const OmLayer* l, const char* out, const char* in) {
    const char* input[5] = {in, param_name(w, l->weight), param_name(w, l->bias),
                            param_name(w, l->mean), param_name(w, l->variance)};
    size_t at = begin_node(w, "BatchNormalization", out, 5, input);
    put_float_attribute(w, "epsilon", l->epsilon);
    end(w, at);
}

static void put_group_norm(Writer* w, int i, const OmLayer* l, const char* out, const char* in) {
    Name rows = own_name(i, "rows"), rows_shape = own_name(i, "rows_shape");
    Name one = own_name(i, "one"), zero = own_name(i, "zero"), equal = own_name(i, "equal");
    Name back = own_name(i, "back"), shape = own_name(i, "shape");
    Name weight = own_name(i, "weight"), bias = own_name(i, "bias"), scaled = own_name(i, "scaled");
    const int64_t three[3] = {0, l->ngroup, -1};
    const int64_t five[5] = {-1, l->shape.c, l->shape.d, l->shape.h, l->shape.w};
    const int channels[4] = {l->shape.c, 1, 1, 1};
    float* value = om_calloc((size_t)l->ngroup, sizeof *value);
    if (!value) {
        if (w->status == OM_OK) w->status = OM_NO_MEMORY;
        return;
    }
    put_floats(w, zero.str, 1, &l->ngroup, value);
    for (int k = 0; k < l->ngroup; ++k) value[k] = 1;
    put_floats(w, one.str, 1, &l->ngroup, value);
    om_free(value);
    put_floats(w, weight.str, 4, channels, w->param + om_net_parameter(w->net, l->weight)->adr);
    put_floats(w, bias.str, 4, channels, w->param + om_net_parameter(w->net, l->bias)->adr);

    put_reshape(w, rows.str, in, rows_shape.str, 3, three);
    size_t at = begin_node(w, "InstanceNormalization", equal.str, 3,
                           (const char*[]){rows.str, one.str, zero.str});
    put_float_attribute(w, "epsilon", l->epsilon);
    end(w, at);
    put_reshape(w, back.str, equal.str, shape.str, 5, five);
    put_node(w, "Mul", scaled.str, 2, (const char*[]){back.str, weight.str});
    put_node(w, "Add", out, 2, (const char*[]){scaled.str, bias.str});
}

static void put_activation(Writer* w, const OmLayer* l, const char* out, const char* in) {
    static const char* const op[] = {"Identity", "Relu", "LeakyRelu", "Tanh", "Sigmoid"};
    size_t at = begin_node(w, op[l->activation], out, 1, &in);
    if (l->activation == OM_LEAKY_RELU) put_float_attribute(w, "alpha", l->slope);
    end(w, at);
}

static void put_concat(Writer* w, const OmLayer* l, const char* out) {
    Name name[OM_LAYER_MAX_INPUT];
    const char* input[OM_LAYER_MAX_INPUT];
    for (int k = 0; k < l->ninput; ++k) {
        name[k] = value_name(w->net, l->input[k]);
        input[k] = name[k].str;
    }
    size_t at = begin_node(w, "Concat", out, l->ninput, input);
    put_int_attribute(w, "axis", 1);
    end(w, at);
}

static void put_mask(Writer* w, int i, const OmLayer* l, const char* out, const char* in) {
    Name mask = own_name(i, "mask");
    const int five[5] = {1, 1, l->shape.d, l->shape.h, l->shape.w};
    put_floats(w, mask.str, 5, five, l->mask);
    put_node(w, "Mul", out, 2, (const char*[]){in, mask.str});
}

static void put_layer(Writer* w, int i) {
    const OmLayer* l = om_net_layer(w->net, i);
    Name name = value_name(w->net, i);
    Name from = value_name(w->net, l->ninput > 0 ? l->input[0] : i);
    const char *out = name.str, *in = from.str;
    switch (l->kind) {
    case OM_LAYER_INPUT: break;
    case OM_LAYER_CONV: put_window(w, l, "Conv", out, in); break;
    case OM_LAYER_CONV_UP: put_window(w, l, "ConvTranspose", out, in); break;
    case OM_LAYER_UPSAMPLE: put_upsample(w, i, l, out, in); break;
    case OM_LAYER_MAX_POOL: put_window(w, l, "MaxPool", out, in); break;
    case OM_LAYER_DENSE: put_dense(w, i, l, out, in); break;
    case OM_LAYER_ACTIVATION: put_activation(w, l, out, in); break;
    case OM_LAYER_DROPOUT: put_node(w, "Identity", out, 1, &in); break;
    case OM_LAYER_BATCH_NORM: put_batch_norm(w, l, out, in); break;
    case OM_LAYER_GROUP_NORM: put_group_norm(w, i, l, out, in); break;
    case OM_LAYER_CONCAT: put_concat(w, l, out); break;
    case OM_LAYER_MASK: put_mask(w, i, l, out, in); break;
    }
}

// ---- the model --------------------------------------------------------------------------------------

// GraphProto.input or output: batch x shape floats
static void put_value_info(Writer* w, int field, const char* name, OmNetShape shape) {
    const int dim[4] = {shape.c, shape.d, shape.h, shape.w};
    size_t info = begin(w, field);
    put_string(w, 1, name);
    size_t type = begin(w, 2), tensor = begin(w, 1);
    put_integer(w, 1, TYPE_FLOAT);
    size_t dims = begin(w, 2);
    for (int i = -1; i < 4; ++i) {
        size_t at = begin(w, 1);
        if (i < 0)
            put_string(w, 2, "batch");
        else
            put_integer(w, 1, dim[i]);
        end(w, at);
    }
    end(w, dims);
    end(w, tensor);
    end(w, type);
    end(w, info);
}

// Parameters that a node reads by name; those of group norms are written with their layer.
static void put_parameters(Writer* w) {
    for (int i = 0; i < om_net_parameter_count(w->net); ++i) {
        const OmNetParameter* p = om_net_parameter(w->net, i);
        if (om_net_layer(w->net, p->layer)->kind != OM_LAYER_GROUP_NORM)
            put_floats(w, p->name, p->ndim, p->dim, w->param + p->adr);
    }
}

static void put_graph(Writer* w) {
    int output = om_net_output(w->net);
    size_t graph = begin(w, 7);
    put_string(w, 2, "omentum");
    for (int i = 0; i < om_net_layer_count(w->net); ++i) put_layer(w, i);
    put_parameters(w);
    put_value_info(w, 11, "input", om_net_layer(w->net, 0)->shape);
    put_value_info(w, 12, "output", om_net_layer(w->net, output)->shape);
    end(w, graph);
}

static void put_pair(Writer* w, const char* key, const char* value) {
    size_t at = begin(w, 14);
    put_string(w, 1, key);
    put_string(w, 2, value);
    end(w, at);
}

OmStatus om_net_save_onnx(const OmNet* net, const float* param, const OmTextPair* meta, int nmeta,
                          const char* path) {
    Writer w = {.net = net, .param = param};
    OM_CHECK(om_net_layer(net, om_net_output(net))->kind != OM_LAYER_INPUT, OM_INVALID,
             "%s: a network without layers has no ONNX file", path);
    put_integer(&w, 1, 7);  // IR
    put_string(&w, 2, "omentum");
    put_graph(&w);
    size_t opset = begin(&w, 8);
    put_string(&w, 1, "");
    put_integer(&w, 2, 13);
    end(&w, opset);
    for (int i = 0; i < nmeta; ++i) put_pair(&w, meta[i].key, meta[i].value);
    OmStatus status = w.status;
    if (status == OM_OK && w.text.len > MAX_FILE)
        status = om_error(OM_INVALID, "%s: an ONNX file holds 2 GiB at most, not %zu bytes", path,
                          w.text.len);
    if (status == OM_OK) status = om_file_write(path, w.text.str, w.text.len);
    om_text_done(&w.text);
    return status;
}
