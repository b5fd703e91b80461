// nn_weights.c: the parameters of a network in a safetensors file, with the text that describes the network.
#include <string.h>

#include "nn/nn_file_internal.h"

#define NETWORK_KEY "network"
#define ARCHITECTURE_KEY "architecture"

// ---- the description --------------------------------------------------------------------------------

static OmStatus put_three(OmText* text, const char* what, const int v[3]) {
    if (v[0] == v[1] && v[1] == v[2]) return om_text_append(text, " %s %d", what, v[0]);
    return om_text_append(text, " %s %dx%dx%d", what, v[0], v[1], v[2]);
}

static OmStatus put_convolution(OmText* text, const OmLayer* l) {
    OM_TRY(put_three(text, "kernel", l->kernel));
    OM_TRY(put_three(text, "stride", l->stride));
    OM_TRY(put_three(text, "padding", l->padding));
    return l->kind != OM_LAYER_MAX_POOL && l->bias < 0 ? om_text_append(text, " no bias") : OM_OK;
}

static OmStatus put_settings(OmText* text, const OmLayer* l) {
    size_t ncell = (size_t)l->shape.d * (size_t)l->shape.h * (size_t)l->shape.w;
    switch (l->kind) {
    case OM_LAYER_CONV:
    case OM_LAYER_CONV_UP:
    case OM_LAYER_MAX_POOL: return put_convolution(text, l);
    case OM_LAYER_UPSAMPLE: return put_three(text, "scale", l->scale);
    case OM_LAYER_ACTIVATION:
        OM_TRY(om_text_append(text, " %s", om_activation_name(l->activation)));
        if (l->activation != OM_LEAKY_RELU) return OM_OK;
        return om_text_append(text, " slope %.9g", (double)l->slope);
    case OM_LAYER_DROPOUT: return om_text_append(text, " rate %.9g", (double)l->rate);
    case OM_LAYER_BATCH_NORM: return om_text_append(text, " epsilon %.9g", (double)l->epsilon);
    case OM_LAYER_GROUP_NORM:
        return om_text_append(text, " groups %d epsilon %.9g", l->ngroup, (double)l->epsilon);
    case OM_LAYER_MASK:
        return om_text_append(
            text, " of %016llx",
            (unsigned long long)om_hash(l->mask, ncell * sizeof *l->mask, OM_HASH_SEED));
    default: return OM_OK;
    }
}

OmStatus om_net_describe(const OmNet* net, OmText* text) {
    for (int i = 0; i < om_net_layer_count(net); ++i) {
        const OmLayer* l = om_net_layer(net, i);
        OM_TRY(om_text_append(text, "%d %s", i, om_layer_kind_name(l->kind)));
        if (l->name[0]) OM_TRY(om_text_append(text, " %s", l->name));
        for (int k = 0; k < l->ninput; ++k)
            OM_TRY(om_text_append(text, "%s%d", k ? "," : " of ", l->input[k]));
        OM_TRY(put_settings(text, l));
        OM_TRY(om_text_append(text, " gives %dx%dx%dx%d%s\n", l->shape.c, l->shape.d, l->shape.h,
                              l->shape.w, i == om_net_output(net) ? ", the output" : ""));
    }
    return OM_OK;
}

// ---- writing ----------------------------------------------------------------------------------------

static OmTensor tensor_of(const OmNetParameter* p, const float* param) {
    OmTensor t = {.name = p->name, .type = OM_TENSOR_F32, .rank = p->ndim};
    for (int k = 0; k < p->ndim; ++k) t.dim[k] = p->dim[k];
    t.data = param ? param + p->adr : NULL;
    return t;
}

static void network_name(const OmNet* net, char out[20]) {
    snprintf(out, 20, "%016llx", (unsigned long long)om_net_hash(net));
}

OmStatus om_net_save(const OmNet* net, const float* param, const OmTextPair* meta, int nmeta,
                     const char* path) {
    OmStatus status = OM_OK;
    OmTensor* tensor = NULL;
    OmTextPair* pair = NULL;
    OmText architecture = {0};
    char network[20];
    int ntensor = om_net_parameter_count(net);
    OM_ALLOC_DONE(tensor, ntensor);
    OM_ALLOC_DONE(pair, nmeta + 2);
    OM_TRY_DONE(om_net_describe(net, &architecture));
    network_name(net, network);
    for (int i = 0; i < ntensor; ++i) tensor[i] = tensor_of(om_net_parameter(net, i), param);
    pair[0] = (OmTextPair){ARCHITECTURE_KEY, architecture.str};
    pair[1] = (OmTextPair){NETWORK_KEY, network};
    if (nmeta > 0) memcpy(pair + 2, meta, (size_t)nmeta * sizeof *meta);
    status = om_tensor_file_save(tensor, ntensor, pair, nmeta + 2, path);
done:
    om_text_done(&architecture);
    om_free(pair);
    om_free(tensor);
    return status;
}

// ---- reading ----------------------------------------------------------------------------------------

// The tensors of the file must be exactly those of the table.
static OmStatus check_names(const OmNet* net, const OmTensorFile* file, const char* path) {
    char text[160];
    for (int i = 0; i < om_tensor_file_count(file); ++i) {
        const OmTensor* t = om_tensor_file_get(file, i);
        OM_CHECK(
            om_net_find_parameter(net, t->name) >= 0, OM_INVALID,
            "%s: tensor \"%.80s\" of shape %s belongs to another network: this one has no tensor of "
            "that name",
            path, t->name, om__tensor_shape_text(t->rank, t->dim, text, sizeof text));
    }
    return OM_OK;
}

static int line_length(const char* text) { return (int)strcspn(text, "\n"); }

// Name the first layer that differs: the first different line of the two descriptions.
static OmStatus other_network(const char* path, const char* theirs, const char* ours) {
    while (*theirs && *ours && line_length(theirs) == line_length(ours) &&
           strncmp(theirs, ours, (size_t)line_length(ours)) == 0) {
        theirs += line_length(theirs) + (theirs[line_length(theirs)] == '\n');
        ours += line_length(ours) + (ours[line_length(ours)] == '\n');
    }
    if (!*theirs && !*ours)
        return om_error(OM_INVALID, "%s: the weights are those of another network", path);
    int have = line_length(theirs), want = line_length(ours);
    return om_error(OM_INVALID,
                    "%s: the weights are those of another network: it has the layer \"%.*s\", this "
                    "one \"%.*s\"",
                    path, have < 100 ? have : 100, theirs, want < 100 ? want : 100, ours);
}

static OmStatus check_network(const OmNet* net, const OmTensorFile* file, const char* path) {
    const char* network = om_tensor_file_meta(file, NETWORK_KEY);
    const char* architecture = om_tensor_file_meta(file, ARCHITECTURE_KEY);
    char ours[20];
    network_name(net, ours);
    if (!network || strcmp(network, ours) == 0) return OM_OK;
    OmText text = {0};
    OmStatus status = om_net_describe(net, &text);
    if (status == OM_OK) status = other_network(path, architecture ? architecture : "", text.str);
    om_text_done(&text);
    return status;
}

OmStatus om_net_load(const OmNet* net, const char* path, float* param) {
    OmTensorFile* file;
    OmStatus status = OM_OK;
    OM_TRY(om_tensor_file_load(path, &file));
    OM_TRY_DONE(check_names(net, file, path));
    for (int i = 0; i < om_net_parameter_count(net); ++i) {
        const OmNetParameter* p = om_net_parameter(net, i);
        OmTensor t = tensor_of(p, NULL);
        OM_TRY_DONE(om_tensor_file_read(file, p->name, t.rank, t.dim, param + p->adr));
    }
    status = check_network(net, file, path);
done:
    om_tensor_file_destroy(file);
    return status;
}
