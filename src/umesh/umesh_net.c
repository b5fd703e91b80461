// umesh_net.c: a trained network and its file.
//
// One safetensors file has all data that a prediction needs. Besides the weights, the file has the tensors:
//     grid.dim (3), grid.frame (7)      points; spacing, origin, up
//     grid.active (npoint)              1 at the lowest point of an active cell
//     grid.fixed (nnode), grid.skin_x (nnode, 3)
//     trust.way (nnode), trust.inward (nnode, 3), trust.limit (6)
//     scale (5)                         of inputs, m; of corrections; Poisson's ratio; of the second order's
//                                       forces; imbalance of samples under the law of the refinement
// All other fields of the grid are computed from these tensors. Inconsistent files are refused.
#include <math.h>
#include <string.h>

#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

#define FORMAT "omentum-umesh-6"
#define MAX_TENSOR 512
#define NOWN 9  // tensors besides the weights
#define MAX_DIM 1024
// Above this imbalance the samples have another law than the refinement.
#define MOST_UNBALANCED 0.01

// ---- create -----------------------------------------------------------------------------------------

OmStatus om__umesh_grid_copy(const OmUmeshGrid* from, OmUmeshGrid* to) {
    unsigned char* active;
    OM_ALLOC(active, from->fem.npoint);
    for (int p = 0; p < from->fem.npoint; ++p) active[p] = from->fem.cell_elem[p] >= 0;
    OmStatus status = om__umesh_grid_init(&from->fem.grid, from->up, active, to);
    om_free(active);
    if (status < 0) return status;
    memcpy(to->fem.fixed, from->fem.fixed, (size_t)to->fem.mesh.nnode);
    memcpy(to->surface_x, from->surface_x, 3 * (size_t)to->fem.mesh.nnode * sizeof *to->surface_x);
    status = om__umesh_grid_find_surface(to);
    to->hash = om__umesh_grid_hash(to);
    if (status < 0) om_umesh_grid_done(to);
    return status;
}

static OmStatus make_layers(OmUmeshNet* n) {
    const OmUmeshGrid* g = &n->grid;
    OmUnetDef def = om_unet_default_def(
        (OmNetShape){UMESH_NCHANNEL, g->fem.grid.dim[2], g->fem.grid.dim[1], g->fem.grid.dim[0]},
        3);
    float* mask = om_calloc((size_t)g->fem.npoint, sizeof *mask);
    if (!mask) return OM_NO_MEMORY;
    for (int i = 0; i < g->fem.mesh.nnode; ++i)
        mask[g->fem.node_point[i]] = g->fem.fixed[i] ? 0 : 1;
    def.base_channels = n->base_channels;
    def.nlevel = n->nlevel;
    def.mask = mask;
    // with ReLU all outputs of a layer became 0 in half of the trials, at a rate of 5e-3
    def.activation = OM_LEAKY_RELU;
    OmStatus status = om_unet_create(&def, &n->net);
    om_free(mask);
    if (status < 0) return status;
    OM_ALLOC(n->param, om_net_parameter_size(n->net));
    return OM_OK;
}

// Requires n->grid.
static OmStatus finish(OmUmeshNet* n, double poisson, int base_channels, int nlevel) {
    n->poisson = poisson;
    n->base_channels = base_channels;
    n->nlevel = nlevel;
    OM_TRY(make_layers(n));
    OM_TRY(om__umesh_region_alloc(n));
    return om_fem_grid_linear_create(&n->grid.fem, n->grid.is_surface, poisson, 0, &n->linear);
}

OmStatus om__umesh_net_set_balance(OmUmeshNet* n, double balance) {
    om_fem_grid_model_destroy(n->model);
    n->model = NULL;
    n->balance = balance;
    if (!(balance <= MOST_UNBALANCED) || n->poisson < 0)
        return OM_OK;  // no refinement: with a negative ratio elements may collapse
    OmStatus status = om_fem_grid_model_create(&n->grid.fem, n->poisson, 0, &n->model);
    return status == OM_UNAVAILABLE ? OM_OK : status;  // grid too large: no refinement
}

OmStatus om__umesh_net_create(const OmUmeshGrid* grid, double poisson, int base_channels,
                              int nlevel, OmUmeshNet** out) {
    *out = NULL;
    OmUmeshNet* n = om_calloc(1, sizeof *n);
    if (!n) return OM_NO_MEMORY;
    OmStatus status = om__umesh_grid_copy(grid, &n->grid);
    if (status >= 0) status = finish(n, poisson, base_channels, nlevel);
    if (status < 0)
        om_umesh_net_destroy(n);
    else
        *out = n;
    return status;
}

void om_umesh_net_destroy(OmUmeshNet* n) {
    if (!n) return;
    om_umesh_grid_done(&n->grid);
    om_fem_grid_linear_destroy(n->linear);
    om_fem_grid_model_destroy(n->model);
    om_net_destroy(n->net);
    om_free(n->param);
    om_free(n->region.way);
    om_free(n->region.inward);
    om_facts_done(&n->facts);
    om_free(n);
}

const OmUmeshGrid* om_umesh_net_grid(const OmUmeshNet* n) { return &n->grid; }

const OmNet* om_umesh_net_layers(const OmUmeshNet* n, const float** param) {
    if (param) *param = n->param;
    return n->net;
}

const char* om_umesh_net_fact(const OmUmeshNet* n, const char* key) {
    return om_facts_find(&n->facts, key);
}

// ---- save -------------------------------------------------------------------------------------------

typedef struct Own {  // the tensors besides the weights, in the types of the file
    double dim[3], frame[7], limit[6], scale[5];
    float *active, *fixed;
} Own;

static OmStatus fill_own(const OmUmeshNet* n, Own* own) {
    const OmUmeshGrid* g = &n->grid;
    const UmeshRegion* r = &n->region;
    *own = (Own){.frame = {g->fem.grid.spacing, g->fem.grid.origin.x, g->fem.grid.origin.y,
                           g->fem.grid.origin.z, g->up.x, g->up.y, g->up.z},
                 .limit = {r->stretch, r->rough, r->angle, r->max, r->min, r->margin},
                 .scale = {n->scale, n->correction, n->poisson, n->second, n->balance}};
    for (int c = 0; c < 3; ++c) own->dim[c] = g->fem.grid.dim[c];
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(own->active, g->fem.npoint);
    OM_ALLOC_DONE(own->fixed, g->fem.mesh.nnode);
    for (int p = 0; p < g->fem.npoint; ++p) own->active[p] = g->fem.cell_elem[p] >= 0 ? 1 : 0;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) own->fixed[i] = g->fem.fixed[i] ? 1 : 0;
done:
    return status;
}

static int list_tensors(const OmUmeshNet* n, const Own* own, OmTensor* t) {
    int num = 0, nnode = n->grid.fem.mesh.nnode;
    for (int i = 0; i < om_net_parameter_count(n->net); ++i) {
        const OmNetParameter* p = om_net_parameter(n->net, i);
        t[num] = (OmTensor){
            .name = p->name, .type = OM_TENSOR_F32, .rank = p->ndim, .data = n->param + p->adr};
        for (int d = 0; d < p->ndim; ++d) t[num].dim[d] = p->dim[d];
        ++num;
    }
    t[num++] = (OmTensor){"grid.dim", OM_TENSOR_F64, 1, {3}, own->dim};
    t[num++] = (OmTensor){"grid.frame", OM_TENSOR_F64, 1, {7}, own->frame};
    t[num++] = (OmTensor){"grid.active", OM_TENSOR_F32, 1, {n->grid.fem.npoint}, own->active};
    t[num++] = (OmTensor){"grid.fixed", OM_TENSOR_F32, 1, {nnode}, own->fixed};
    t[num++] = (OmTensor){"grid.skin_x", OM_TENSOR_F64, 2, {nnode, 3}, n->grid.surface_x};
    t[num++] = (OmTensor){"trust.way", OM_TENSOR_F32, 1, {nnode}, n->region.way};
    t[num++] = (OmTensor){"trust.inward", OM_TENSOR_F32, 2, {nnode, 3}, n->region.inward};
    t[num++] = (OmTensor){"trust.limit", OM_TENSOR_F64, 1, {6}, own->limit};
    t[num++] = (OmTensor){"scale", OM_TENSOR_F64, 1, {5}, own->scale};
    return num;
}

OmStatus om__umesh_net_save(const OmUmeshNet* n, const char* path) {
    Own own;
    OmText layers = {0};
    OmTensor tensor[MAX_TENSOR];
    OmTextPair meta[OM_FACTS_MAX + 7];
    char base[16], levels[16], hash[24], sum[24];
    int nmeta = 0;
    OM_CHECK(om_net_parameter_count(n->net) + NOWN <= MAX_TENSOR, OM_INVALID,
             "umesh: the network has more than %d tensors", MAX_TENSOR - NOWN);
    OmStatus status = fill_own(n, &own);
    if (status >= 0) status = om_net_describe(n->net, &layers);
    if (status >= 0) {
        snprintf(base, sizeof base, "%d", n->base_channels);
        snprintf(levels, sizeof levels, "%d", n->nlevel);
        snprintf(hash, sizeof hash, "%016llx", (unsigned long long)om_net_hash(n->net));
        meta[nmeta++] = (OmTextPair){"format", FORMAT};
        meta[nmeta++] = (OmTextPair){"base_channels", base};
        meta[nmeta++] = (OmTextPair){"levels", levels};
        meta[nmeta++] = (OmTextPair){"network", hash};
        meta[nmeta++] = (OmTextPair){"architecture", layers.str};
        meta[nmeta++] = (OmTextPair){"units", "m"};
        int ntensor = list_tensors(n, &own, tensor);
        snprintf(sum, sizeof sum, "%016llx",
                 (unsigned long long)om_tensor_checksum(tensor, ntensor));
        meta[nmeta++] = (OmTextPair){"checksum", sum};
        for (int i = 0; i < n->facts.n; ++i) meta[nmeta++] = n->facts.pair[i];
        status = om_tensor_file_save(tensor, ntensor, meta, nmeta, path);
    }
    om_text_done(&layers);
    om_free(own.active);
    om_free(own.fixed);
    return status;
}

OmStatus om_umesh_net_save_onnx(const OmUmeshNet* n, const char* path) {
    char scale[32], correction[32], second[32];
    snprintf(scale, sizeof scale, "%.17g", n->scale);
    snprintf(correction, sizeof correction, "%.17g", n->correction);
    snprintf(second, sizeof second, "%.17g", n->second);
    OmTextPair meta[OM_FACTS_MAX + 3] = {
        {"scale_m", scale}, {"correction", correction}, {"second", second}};
    memcpy(meta + 3, n->facts.pair, (size_t)n->facts.n * sizeof *meta);
    return om_net_save_onnx(n->net, n->param, meta, n->facts.n + 3, path);
}

static OmStatus copy_net(const OmUmeshNet* n, OmUmeshNet** out) {
    OM_TRY(om__umesh_net_create(&n->grid, n->poisson, n->base_channels, n->nlevel, out));
    OmUmeshNet* c = *out;
    size_t nnode = (size_t)n->grid.fem.mesh.nnode;
    float *way = c->region.way, *inward = c->region.inward;
    memcpy(c->param, n->param, om_net_parameter_size(n->net) * sizeof *n->param);
    memcpy(way, n->region.way, nnode * sizeof *way);
    memcpy(inward, n->region.inward, 3 * nnode * sizeof *inward);
    c->region = n->region;
    c->region.way = way;
    c->region.inward = inward;
    c->scale = n->scale;
    c->correction = n->correction;
    c->second = n->second;
    c->balance = n->balance;
    for (int i = 0; i < n->facts.n; ++i)
        if (strncmp(n->facts.pair[i].key, "test_", 5) != 0)
            OM_TRY(om_facts_add(&c->facts, n->facts.pair[i].key, "%s", n->facts.pair[i].value));
    return OM_OK;
}

OmStatus om_umesh_record_test(const OmUmeshNet* n, const OmUmeshData* test, const OmUmeshEval* eval,
                              const char* path) {
    OmUmeshNet* copy = NULL;
    OmStatus status;
    OM_TRY_DONE(copy_net(n, &copy));
    OM_TRY_DONE(om_facts_add(&copy->facts, "test_seed", "%llu", (unsigned long long)test->seed));
    OM_TRY_DONE(om_facts_add(&copy->facts, "test_samples", "%d", eval->n));
    OM_TRY_DONE(om_facts_add(&copy->facts, "test_error_mm", "%.5f", 1e3 * eval->mean));
    OM_TRY_DONE(om_facts_add(&copy->facts, "test_worst_mm", "%.5f", 1e3 * eval->worst));
    OM_TRY_DONE(
        om_facts_add(&copy->facts, "test_network_error_mm", "%.5f", 1e3 * eval->network_mean));
    OM_TRY_DONE(om__umesh_net_save(copy, path));
done:
    om_umesh_net_destroy(copy);
    return status;
}

// ---- load -------------------------------------------------------------------------------------------

// Read an array of zeros and ones.
static OmStatus read_flags(const OmTensorFile* f, const char* path, const char* name, int n,
                           unsigned char* flag) {
    const int64_t dim[1] = {n};
    float* value;
    OM_ALLOC(value, n);
    OmStatus status = om_tensor_file_read(f, name, 1, dim, value);
    for (int i = 0; i < n && status >= 0; ++i) {
        flag[i] = value[i] == 1;
        if (value[i] != 0 && value[i] != 1)
            status = om_error(OM_INVALID, "%s: tensor \"%s\" has a value of %g, not 0 or 1", path,
                              name, (double)value[i]);
    }
    om_free(value);
    return status;
}

static OmStatus read_frame(const OmTensorFile* f, const char* path, OmGrid* frame, OmVec3* up) {
    double dim[3], value[7];
    OM_TRY(om_tensor_file_read_double(f, "grid.dim", 1, (const int64_t[]){3}, dim));
    OM_TRY(om_tensor_file_read_double(f, "grid.frame", 1, (const int64_t[]){7}, value));
    for (int c = 0; c < 3; ++c) {
        OM_CHECK(dim[c] >= 2 && dim[c] <= MAX_DIM && dim[c] == floor(dim[c]), OM_INVALID,
                 "%s: grid.dim[%d] is %g; 2 to %d", path, c, dim[c], MAX_DIM);
        frame->dim[c] = (int)dim[c];
    }
    OM_CHECK(dim[0] * dim[1] * dim[2] <= OM__UMESH_MAX_POINT, OM_INVALID,
             "%s: a grid of %g x %g x %g points; at most %d are read", path, dim[0], dim[1], dim[2],
             OM__UMESH_MAX_POINT);
    frame->spacing = value[0];
    frame->origin = om_vec3(value[1], value[2], value[3]);
    *up = om_vec3(value[4], value[5], value[6]);
    OM_CHECK(frame->spacing > 1e-6 && frame->spacing < 1, OM_INVALID,
             "%s: spacing of the grid is %g m; 1e-6 to 1", path, frame->spacing);
    OM_CHECK(om_norm(*up) > 0.99 && om_norm(*up) < 1.01 && om_norm(frame->origin) < 1e3, OM_INVALID,
             "%s: grid.frame is no frame", path);
    return OM_OK;
}

static OmStatus read_grid(const OmTensorFile* f, const char* path, OmUmeshGrid* g) {
    OmGrid points;
    OmVec3 up;
    OM_TRY(read_frame(f, path, &points, &up));
    int npoint = (int)om_grid_count(points.dim);
    unsigned char* active;
    OM_ALLOC(active, npoint);
    OmStatus status = read_flags(f, path, "grid.active", npoint, active);
    if (status >= 0) status = om__umesh_grid_init(&points, up, active, g);
    om_free(active);
    if (status < 0) return status;
    OM_TRY(read_flags(f, path, "grid.fixed", g->fem.mesh.nnode, g->fem.fixed));
    OM_TRY(om_tensor_file_read_double(f, "grid.skin_x", 2, (const int64_t[]){g->fem.mesh.nnode, 3},
                                      g->surface_x));
    OM_TRY(om__umesh_grid_find_surface(g));
    g->hash = om__umesh_grid_hash(g);
    return OM_OK;
}

static OmStatus read_weights(const OmTensorFile* f, const char* path, OmUmeshNet* n) {
    int num = om_net_parameter_count(n->net);
    for (int i = 0; i < num; ++i) {
        const OmNetParameter* p = om_net_parameter(n->net, i);
        int64_t dim[5];
        for (int d = 0; d < p->ndim; ++d) dim[d] = p->dim[d];
        OM_TRY(om_tensor_file_read(f, p->name, p->ndim, dim, n->param + p->adr));
    }
    OM_CHECK(om_tensor_file_count(f) == num + NOWN, OM_INVALID,
             "%s: has %d tensors; a network of %d channels and %d levels with its grid has %d",
             path, om_tensor_file_count(f), n->base_channels, n->nlevel, num + NOWN);
    return OM_OK;
}

static OmStatus read_region(const OmTensorFile* f, const char* path, OmUmeshNet* n) {
    UmeshRegion* r = &n->region;
    const int64_t dim[2] = {n->grid.fem.mesh.nnode, 3};
    double limit[6];
    OM_TRY(om_tensor_file_read(f, "trust.way", 1, dim, r->way));
    OM_TRY(om_tensor_file_read(f, "trust.inward", 2, dim, r->inward));
    OM_TRY(om_tensor_file_read_double(f, "trust.limit", 1, (const int64_t[]){6}, limit));
    r->stretch = limit[0];
    r->rough = limit[1];
    r->angle = limit[2];
    r->max = limit[3];
    r->min = limit[4];
    r->margin = limit[5];
    OM_CHECK(r->stretch >= 0 && r->rough >= 0 && r->angle >= 0 && r->min >= 1 && r->max >= r->min &&
                 r->margin >= 1 && r->margin <= 2,
             OM_INVALID, "%s: trust.limit is no region", path);
    return OM_OK;
}

static OmStatus read_scale(const OmTensorFile* f, const char* path, OmUmeshNet* n,
                           double* poisson) {
    double value[5];
    OM_TRY(om_tensor_file_read_double(f, "scale", 1, (const int64_t[]){5}, value));
    for (int i = 0; i < 5; ++i)
        OM_CHECK(i == 2 || i == 4 || (value[i] > 1e-9 && value[i] < 1e3), OM_INVALID,
                 "%s: scale[%d] is %g; 1e-9 to 1000", path, i, value[i]);
    OM_CHECK(value[2] > -0.9 && value[2] < 0.4999, OM_INVALID,
             "%s: scale[2], Poisson's ratio, is %g; above -0.9, below 0.4999", path, value[2]);
    n->scale = value[0];
    n->correction = value[1];
    n->second = value[3];
    OM_CHECK(value[4] >= 0 && value[4] < 1e9, OM_INVALID,
             "%s: scale[4], the balance of the samples, is %g; 0 to 1e9", path, value[4]);
    n->balance = value[4];
    *poisson = value[2];
    return OM_OK;
}

static OmStatus read_facts(const OmTensorFile* f, OmUmeshNet* n) {
    static const char* const key[] = {"command",
                                      "seed",
                                      "data",
                                      "samples",
                                      "epochs",
                                      "validation_error_mm",
                                      "test_seed",
                                      "test_samples",
                                      "test_error_mm",
                                      "test_worst_mm",
                                      "test_network_error_mm"};
    for (size_t i = 0; i < sizeof key / sizeof *key; ++i) {
        const char* value = om_tensor_file_meta(f, key[i]);
        if (value) OM_TRY(om_facts_add(&n->facts, key[i], "%s", value));
    }
    return OM_OK;
}

static OmStatus read_net(const OmTensorFile* f, const char* path, OmUmeshNet* n) {
    const char* format = om_tensor_file_meta(f, "format");
    int base, nlevel;
    double poisson = 0;
    OM_CHECK(
        format && strcmp(format, FORMAT) == 0, OM_INVALID,
        "%s: not a trained U-Mesh (format \"%.30s\", wanted \"%s\"); omentum umesh train writes one",
        path, format ? format : "", FORMAT);
    OM_TRY(om_tensor_file_check(f, path));  // first: building the model takes seconds
    OM_TRY(om_tensor_file_setting(f, path, "base_channels", 1, 256, &base));
    OM_TRY(om_tensor_file_setting(f, path, "levels", 1, 6, &nlevel));
    OM_TRY(read_grid(f, path, &n->grid));
    OM_TRY(read_scale(f, path, n, &poisson));
    n->poisson = poisson;
    n->base_channels = base;
    n->nlevel = nlevel;
    OM_TRY(make_layers(n));
    OM_TRY(om__umesh_region_alloc(n));
    OM_TRY(read_weights(f, path, n));  // the last check of the file; the rest takes seconds
    OM_TRY(read_region(f, path, n));
    OM_TRY(om_fem_grid_linear_create(&n->grid.fem, n->grid.is_surface, poisson, 0, &n->linear));
    OM_TRY(om__umesh_net_set_balance(n, n->balance));
    return read_facts(f, n);
}

OmStatus om_umesh_net_load(const char* path, OmUmeshNet** out) {
    *out = NULL;
    OmTensorFile* file;
    OM_TRY(om_tensor_file_load(path, &file));
    OmUmeshNet* n = om_calloc(1, sizeof *n);
    OmStatus status = n ? read_net(file, path, n) : OM_NO_MEMORY;
    om_tensor_file_destroy(file);
    if (status < 0)
        om_umesh_net_destroy(n);
    else
        *out = n;
    return status;
}

OmStatus om_umesh_untangle(const OmUmeshNet* n, const unsigned char* mask, float* u,
                           OmFemGridUntangling* untangling) {
    return om_fem_grid_untangle(&n->grid.fem, n->poisson, mask, u, untangling);
}
