// banet_net.c: layers and file of BA-Net.
//
// U-Net of thesis Fig. 4.3c: on each of five grids two 3x3x3 convolutions, max pooling down, trilinear interpolation
// up, dropout behind both, 1x1x1 at the end. Ours: the channels; leaky ReLU; a 1x1x1 convolution before each
// interpolation (a step of 16 samples of 48 x 48 x 16 cells takes 1.05 s of processor time, 1.30 s without); inputs of
// om__banet_features; no dropout on the finest grid, where it takes as long as a convolution. No norm by default: its
// statistics would depend on the margin of the grid. Channels are multiples of 16: oneDNN 2.7 has no fast convolution
// of 8 without bias.
//
// A safetensors file has the weights and the tensor "calibration" (3): slope and offset of the logit, threshold.
// Settings, facts and a checksum are metadata.
#include <math.h>
#include <string.h>

#include "banet/banet_net_internal.h"

#define FORMAT "omentum-banet-1"
#define WEIGHTS "weights/banet.safetensors"  // that come along
#define MAX_TENSOR 128
#define MAX_CHANNEL 256
#define SLOPE 0.01f  // of leaky ReLU

// ---- layers -----------------------------------------------------------------------------------------

static int add_stage(OmNet* net, const OmBanetNet* n, int x, int channels, const char* part,
                     int number) {
    char name[OM_NET_NAME];
    OmNetConv conv = om_net_conv(channels, 3);
    conv.has_bias = n->ngroup == 0;  // a norm has its own
    snprintf(name, sizeof name, "%s.conv%d", part, number);
    x = om_net_add_conv(net, name, x, conv);
    snprintf(name, sizeof name, "%s.norm%d", part, number);
    if (n->ngroup) x = om_net_add_group_norm(net, name, x, n->ngroup);
    return om_net_add_activation(net, x, OM_LEAKY_RELU, SLOPE);
}

static int add_stages(OmNet* net, const OmBanetNet* n, int x, int level, const char* part) {
    x = add_stage(net, n, x, n->channel[level], part, 1);
    return add_stage(net, n, x, n->channel[level], part, 2);
}

static int add_dropout(OmNet* net, const OmBanetNet* n, int x) {
    return n->dropout > 0 ? om_net_add_dropout(net, x, (float)n->dropout) : x;
}

static int add_layers(OmNet* net, const OmBanetNet* n, const int dim[3]) {
    const int two[3] = {2, 2, 2}, zero[3] = {0};
    int skip[OM_BANET_NLEVEL], last = OM_BANET_NLEVEL - 1;
    char name[OM_NET_NAME];
    int x = om_net_add_input(net, "input", (OmNetShape){BANET_NINPUT, dim[2], dim[1], dim[0]});
    for (int k = 0; k < last; ++k) {
        snprintf(name, sizeof name, "enc%d", k);
        x = skip[k] = add_stages(net, n, x, k, name);
        x = add_dropout(net, n, om_net_add_max_pool(net, x, two, two, zero));
    }
    x = add_stages(net, n, x, last, "bottom");
    for (int k = last - 1; k >= 0; --k) {
        snprintf(name, sizeof name, "dec%d.up", k);
        x = om_net_add_conv(net, name, x, om_net_conv(n->channel[k], 1));
        x = om_net_add_upsample(net, x, two);
        if (k > 0) x = add_dropout(net, n, x);
        x = om_net_add_concat(net, 2, (int[]){skip[k], x});
        snprintf(name, sizeof name, "dec%d", k);
        x = add_stages(net, n, x, k, name);
    }
    return om_net_add_conv(net, "head", x, om_net_conv(1, 1));
}

OmStatus om__banet_net_layers(const OmBanetNet* n, const int dim[3], OmNet** layers) {
    *layers = NULL;
    for (int c = 0; c < 3; ++c)
        OM_CHECK(dim[c] >= OM_BANET_MULTIPLE && dim[c] % OM_BANET_MULTIPLE == 0, OM_INVALID,
                 "banet: the grid has %d x %d x %d cells; multiples of %d", dim[0], dim[1], dim[2],
                 OM_BANET_MULTIPLE);
    OmNet* net;
    OM_TRY(om_net_create(&net));
    OmStatus status = om_net_finish(net, add_layers(net, n, dim));
    if (status < 0)
        om_net_destroy(net);
    else
        *layers = net;
    return status;
}

// ---- create -----------------------------------------------------------------------------------------

static OmStatus init(OmBanetNet* n, const BanetLayers* layers) {
    memcpy(n->channel, layers->channel, sizeof n->channel);
    n->ngroup = layers->ngroup;
    n->dropout = layers->dropout;
    n->nimage = layers->nimage;
    n->slope = 1;
    n->threshold = 0.5;
    for (int k = 0; k < OM_BANET_NLEVEL; ++k) {
        OM_CHECK(n->channel[k] >= 1 && n->channel[k] <= MAX_CHANNEL, OM_INVALID,
                 "banet: %d channels on grid %d; 1 to %d", n->channel[k], k, MAX_CHANNEL);
        OM_CHECK(n->ngroup == 0 || (n->ngroup > 0 && n->channel[k] % n->ngroup == 0), OM_INVALID,
                 "banet: %d groups do not divide the %d channels of grid %d", n->ngroup,
                 n->channel[k], k);
    }
    OM_CHECK(n->dropout >= 0 && n->dropout < 1, OM_INVALID, "banet: dropout = %g; 0 to below 1",
             n->dropout);
    OM_CHECK(n->nimage >= 1 && n->nimage <= BANET_MAX_IMAGE, OM_INVALID,
             "banet: %d mirror images; 1 to %d", n->nimage, BANET_MAX_IMAGE);
    const int smallest[3] = {OM_BANET_MULTIPLE, OM_BANET_MULTIPLE, OM_BANET_MULTIPLE};
    OM_TRY(om__banet_net_layers(n, smallest, &n->net));
    OM_CHECK(om_net_parameter_count(n->net) < MAX_TENSOR, OM_INVALID, "banet: too many tensors");
    OM_ALLOC(n->param, om_net_parameter_size(n->net));
    return OM_OK;
}

OmStatus om__banet_net_create(const BanetLayers* layers, OmBanetNet** out) {
    *out = NULL;
    OmBanetNet* n = om_calloc(1, sizeof *n);
    if (!n) return OM_NO_MEMORY;
    OmStatus status = init(n, layers);
    if (status < 0)
        om_banet_net_destroy(n);
    else
        *out = n;
    return status;
}

void om_banet_net_destroy(OmBanetNet* n) {
    if (!n) return;
    om_net_destroy(n->net);
    om_free(n->param);
    om_facts_done(&n->facts);
    om_free(n);
}

double om_banet_net_threshold(const OmBanetNet* n) { return n->threshold; }

const char* om_banet_net_fact(const OmBanetNet* n, const char* key) {
    return om_facts_find(&n->facts, key);
}

uint64_t om_banet_net_hash(const OmBanetNet* n) {
    const double calibration[3] = {n->slope, n->offset, n->threshold};
    uint64_t hash = om_hash(calibration, sizeof calibration, OM_HASH_SEED);
    return om_hash(n->param, om_net_parameter_size(n->net) * sizeof *n->param, hash);
}

size_t om_banet_net_size(const OmBanetNet* n) { return om_net_parameter_size(n->net); }

// ---- save -------------------------------------------------------------------------------------------

static int list_tensors(const OmBanetNet* n, const double* calibration, OmTensor* t) {
    int num = om_net_parameter_count(n->net);
    for (int i = 0; i < num; ++i) {
        const OmNetParameter* p = om_net_parameter(n->net, i);
        t[i] = (OmTensor){
            .name = p->name, .type = OM_TENSOR_F32, .rank = p->ndim, .data = n->param + p->adr};
        for (int d = 0; d < p->ndim; ++d) t[i].dim[d] = p->dim[d];
    }
    t[num] = (OmTensor){"calibration", OM_TENSOR_F64, 1, {3}, calibration};
    return num + 1;
}

OmStatus om__banet_net_save(const OmBanetNet* n, const char* path) {
    const double calibration[3] = {n->slope, n->offset, n->threshold};
    const char* const key[] = {"format", "groups", "images", "checksum", "units"};
    char value[5][24] = {FORMAT}, channel[OM_BANET_NLEVEL][24], level[OM_BANET_NLEVEL][16];
    OmTensor tensor[MAX_TENSOR];
    OmTextPair meta[OM_FACTS_MAX + 16];
    int num = list_tensors(n, calibration, tensor), nmeta = 0;
    snprintf(value[1], sizeof value[1], "%d", n->ngroup);
    snprintf(value[2], sizeof value[2], "%d", n->nimage);
    snprintf(value[3], sizeof value[3], "%016llx",
             (unsigned long long)om_tensor_checksum(tensor, num));
    snprintf(value[4], sizeof value[4], "voxels");
    for (int k = 0; k < 5; ++k) meta[nmeta++] = (OmTextPair){key[k], value[k]};
    for (int k = 0; k < OM_BANET_NLEVEL; ++k) {
        snprintf(level[k], sizeof level[k], "channels_%d", k);
        snprintf(channel[k], sizeof channel[k], "%d", n->channel[k]);
        meta[nmeta++] = (OmTextPair){level[k], channel[k]};
    }
    for (int i = 0; i < n->facts.n; ++i) meta[nmeta++] = n->facts.pair[i];
    return om_tensor_file_save(tensor, num, meta, nmeta, path);
}

// ---- load -------------------------------------------------------------------------------------------

static OmStatus read_weights(const OmTensorFile* f, const char* path, OmBanetNet* n) {
    int num = om_net_parameter_count(n->net);
    for (int i = 0; i < num; ++i) {
        const OmNetParameter* p = om_net_parameter(n->net, i);
        int64_t dim[5];
        for (int d = 0; d < p->ndim; ++d) dim[d] = p->dim[d];
        OM_TRY(om_tensor_file_read(f, p->name, p->ndim, dim, n->param + p->adr));
    }
    OM_CHECK(om_tensor_file_count(f) == num + 1, OM_INVALID,
             "%s: has %d tensors; a network of these channels has %d", path,
             om_tensor_file_count(f), num + 1);
    return OM_OK;
}

static OmStatus read_calibration(const OmTensorFile* f, const char* path, OmBanetNet* n) {
    double value[3];
    OM_TRY(om_tensor_file_read_double(f, "calibration", 1, (const int64_t[]){3}, value));
    OM_CHECK(value[0] > 1e-6 && value[0] < 1e3 && fabs(value[1]) < 1e3, OM_INVALID,
             "%s: calibration has slope %g, offset %g; 1e-6 to 1000, -1000 to 1000", path, value[0],
             value[1]);
    OM_CHECK(value[2] > 0 && value[2] < 1, OM_INVALID, "%s: the threshold is %g; 0 to 1", path,
             value[2]);
    n->slope = value[0];
    n->offset = value[1];
    n->threshold = value[2];
    return OM_OK;
}

static OmStatus read_facts(const OmTensorFile* f, OmBanetNet* n) {
    static const char* const key[] = {
        "command", "seed",           "data",           "samples",
        "epochs",  "validation_dsc", "validation_tpr", "validation_ece",
        "dropout", "start",          "generator",      "way",
        "law",     "element",        "side_m",         "voxel_m"};
    for (size_t i = 0; i < sizeof key / sizeof *key; ++i) {
        const char* value = om_tensor_file_meta(f, key[i]);
        if (value) OM_TRY(om_facts_add(&n->facts, key[i], "%s", value));
    }
    return OM_OK;
}

static OmStatus read_net(const OmTensorFile* f, const char* path, OmBanetNet* n) {
    const char* format = om_tensor_file_meta(f, "format");
    BanetLayers layers = {0};
    OM_CHECK(
        format && strcmp(format, FORMAT) == 0, OM_INVALID,
        "%s: not a trained BA-Net (format \"%.30s\", wanted \"%s\"); omentum banet train writes one",
        path, format ? format : "", FORMAT);
    OM_TRY(om_tensor_file_check(f, path));
    OM_TRY(om_tensor_file_setting(f, path, "groups", 0, MAX_CHANNEL, &layers.ngroup));
    OM_TRY(om_tensor_file_setting(f, path, "images", 1, BANET_MAX_IMAGE, &layers.nimage));
    for (int k = 0; k < OM_BANET_NLEVEL; ++k) {
        char key[16];
        snprintf(key, sizeof key, "channels_%d", k);
        OM_TRY(om_tensor_file_setting(f, path, key, 1, MAX_CHANNEL, &layers.channel[k]));
    }
    OM_TRY(init(n, &layers));
    OM_TRY(read_weights(f, path, n));
    OM_TRY(read_calibration(f, path, n));
    OM_TRY(read_facts(f, n));
    return om__banet_origin_read(path, n);
}

static OmStatus find_weights(const char* path, char* out, size_t size) {
    if (path) {
        OM_CHECK(snprintf(out, size, "%s", path) < (int)size, OM_INVALID, "banet: too long a path");
        return OM_OK;
    }
    OM_CHECK(om_path_share(WEIGHTS, out, size) >= 0, OM_IO,
             "no trained BA-Net: %s is not installed; make one by omentum banet generate -o DATA, "
             "then omentum banet train -d DATA -o DIR",
             WEIGHTS);
    return OM_OK;
}

OmStatus om_banet_net_load(const char* path, OmBanetNet** out) {
    *out = NULL;
    char found[1024];
    OmTensorFile* file;
    OM_TRY(find_weights(path, found, sizeof found));
    OM_TRY(om_tensor_file_load(found, &file));
    OmBanetNet* n = om_calloc(1, sizeof *n);
    OmStatus status = n ? read_net(file, found, n) : OM_NO_MEMORY;
    om_tensor_file_destroy(file);
    if (status < 0)
        om_banet_net_destroy(n);
    else
        *out = n;
    return status;
}

OmStatus om_banet_net_find(const char* name, const char* root, OmBanetNet** net) {
    char path[1200];
    *net = NULL;
    if (!name) {  // that come along, if any
        if (om_path_share(WEIGHTS, path, sizeof path) == OM_IO) return OM_OK;
        return om_banet_net_load(path, net);
    }
    if (!*name || strcmp(name, "none") == 0) return OM_OK;
    if (strcmp(name, "installed") == 0) return om_banet_net_load(NULL, net);
    if (!root) return om_banet_net_load(name, net);
    OM_TRY(om_path_join(root, name, path, sizeof path));
    return om_banet_net_load(path, net);
}
