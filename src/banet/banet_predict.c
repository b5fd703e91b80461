// banet_predict.c: inputs of the layers, and predictions.
//
// Linear elasticity has the same attachments for any force, but noise does not shrink with it. So displacements are
// given in voxels, relative to the largest one, and by direction with a logarithm of their length: a still place
// differs from one that moves a little. The place relative to the grasp (mean place, weighted by the fourth power of
// the displacement) saves the network the search. Sixteen channels cost what five do: oneDNN pads to sixteen.
#include <math.h>
#include <string.h>

#include "banet/banet_net_internal.h"

#define FAR 8.0       // voxels, scale of displacements
#define STILL 0.05    // voxels, a displacement that noise may be
#define TURNING 0.25  // voxels, a displacement whose direction counts by half
#define SMALL 0.02    // voxels, where the logarithm begins
#define REACH 16.0    // voxels, scale of distances from the grasp

struct OmBanetPredictor {
    const OmBanetNet* net;
    OmNet* layers;
    OmNetRun* run;
    int dim[3];
    float *image, *in, *out;  // (OM_BANET_NCHANNEL x ncell), inputs and outputs of the images
};

// ---- channels ---------------------------------------------------------------------------------------

typedef struct Grasp {  // of one input, voxels
    double largest;     // displacement
    double at[3];       // cell
} Grasp;

static double length_of(const float* in, size_t ncell, size_t i) {
    const double u[3] = {(double)in[OM_BANET_UX * ncell + i], (double)in[OM_BANET_UY * ncell + i],
                         (double)in[OM_BANET_UZ * ncell + i]};
    return sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
}

static Grasp find_grasp(const int dim[3], const float* in) {
    const size_t ncell = om_grid_count(dim);
    Grasp g = {0};
    double sum = 0;
    for (size_t i = 0; i < ncell; ++i) {
        if (!(in[OM_BANET_SEEN * ncell + i] > 0)) continue;
        double u = length_of(in, ncell, i), weight = u * u * u * u;
        int at[3];
        om_grid_unpack(dim, i, at);
        g.largest = fmax(g.largest, u);
        sum += weight;
        for (int c = 0; c < 3; ++c) g.at[c] += weight * at[c];
    }
    for (int c = 0; c < 3; ++c) g.at[c] = sum > 0 ? g.at[c] / sum : 0.5 * (dim[c] - 1);
    return g;
}

static void fill_cell(const Grasp* g, const int at[3], const float* in, size_t ncell, float* out) {
    const double distance = (double)in[0], seen = (double)in[OM_BANET_SEEN * ncell];
    const double length = length_of(in, ncell, 0);
    double value[BANET_NINPUT] = {(OM_BANET_CLIP - distance) / (2 * OM_BANET_CLIP),
                                  fmax(0, 1 - fabs(distance)), seen};
    for (size_t c = 0; c < 3; ++c) {
        double u = (double)in[(OM_BANET_UX + c) * ncell];
        value[3 + c] = u / FAR;
        value[6 + c] = u / (length + TURNING);
        value[13 + c] = (at[c] - g->at[c]) / REACH;
    }
    value[9] = g->largest > 0 ? length / g->largest : 0;
    value[10] = log1p(length / SMALL) / 8;
    value[11] = seen * STILL / (STILL + length);
    value[12] = g->largest / FAR;
    for (size_t c = 0; c < BANET_NINPUT; ++c) out[c * ncell] = (float)value[c];
}

void om__banet_features(const int dim[3], const float* in, float* out) {
    const size_t ncell = om_grid_count(dim);
    const Grasp grasp = find_grasp(dim, in);
    memset(out, 0, BANET_NINPUT * ncell * sizeof *out);
    for (size_t i = 0; i < ncell; ++i) {
        int at[3];
        if (!((double)in[i] < OM_BANET_CLIP)) continue;
        om_grid_unpack(dim, i, at);
        fill_cell(&grasp, at, in + i, ncell, out + i);
    }
}

// ---- prediction -------------------------------------------------------------------------------------

// bfloat16 rounds outputs by less than they differ between images.
static OmStatus create_run(OmBanetPredictor* p, int nworker) {
    OmNetRunDef def = om_net_run_default_def(p->net->nimage);
    def.nworker = om_worker_count(nworker);  // not the free ones: the bytes of oneDNN depend on it
    def.type = om_net_fast_type();
    OmStatus status = om_net_run_create(p->layers, &def, &p->run);
    if (status != OM_UNAVAILABLE) return status;
    def.type = OM_F32;
    return om_net_run_create(p->layers, &def, &p->run);
}

OmStatus om_banet_predictor_create(const OmBanetNet* net, const int dim[3], int nworker,
                                   OmBanetPredictor** out) {
    *out = NULL;
    OmBanetPredictor* p = om_calloc(1, sizeof *p);
    if (!p) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    p->net = net;
    memcpy(p->dim, dim, sizeof p->dim);
    OM_TRY_DONE(om__banet_net_layers(net, dim, &p->layers));
    OM_TRY_DONE(create_run(p, nworker));
    OM_TRY_DONE(om_net_run_set_parameters(p->run, net->param));
    const size_t ncell = om_grid_count(dim), nimage = (size_t)net->nimage;
    OM_ALLOC_DONE(p->image, OM_BANET_NCHANNEL * ncell);
    OM_ALLOC_DONE(p->in, nimage * BANET_NINPUT * ncell);
    OM_ALLOC_DONE(p->out, nimage * ncell);
    *out = p;
    return OM_OK;
done:
    om_banet_predictor_destroy(p);
    return status;
}

void om_banet_predictor_destroy(OmBanetPredictor* p) {
    if (!p) return;
    om_net_run_destroy(p->run);
    om_net_destroy(p->layers);
    om_free(p->image);
    om_free(p->in);
    om_free(p->out);
    om_free(p);
}

// Bits: mirrored in x, y, z. The first images are the most different ones.
static const int mirror[BANET_MAX_IMAGE] = {0, 7, 3, 4, 1, 6, 2, 5};

static size_t find_image(const int dim[3], size_t cell, int image) {
    int at[3];
    om_grid_unpack(dim, cell, at);
    for (int c = 0; c < 3; ++c)
        if (image >> c & 1) at[c] = dim[c] - 1 - at[c];
    return om_grid_index(dim, at[0], at[1], at[2]);
}

static void reflect(const int dim[3], int image, const float* in, float* out) {
    const size_t ncell = om_grid_count(dim);
    for (size_t i = 0; i < ncell; ++i) {
        const size_t to = find_image(dim, i, image);
        for (size_t c = 0; c < OM_BANET_NCHANNEL; ++c) {
            bool is_turned = c >= OM_BANET_UX && c <= OM_BANET_UZ && image >> (c - OM_BANET_UX) & 1;
            float value = in[c * ncell + i];
            out[c * ncell + to] = is_turned ? -value : value;
        }
    }
}

OmStatus om__banet_predict_logit(OmBanetPredictor* p, const float* in, float* logit) {
    const size_t ncell = om_grid_count(p->dim);
    const int nimage = p->net->nimage;
    for (size_t i = 0; i < OM_BANET_NCHANNEL * ncell; ++i)
        OM_CHECK(isfinite(in[i]), OM_INVALID, "banet: the input of cell %zu is not finite",
                 i % ncell);
    for (int k = 0; k < nimage; ++k) {
        reflect(p->dim, mirror[k], in, p->image);
        om__banet_features(p->dim, p->image, p->in + (size_t)k * BANET_NINPUT * ncell);
    }
    OM_TRY(om_net_run_forward(p->run, p->in, p->out));
    memset(logit, 0, ncell * sizeof *logit);
    for (int k = 0; k < nimage; ++k)
        for (size_t i = 0; i < ncell; ++i)
            logit[i] +=
                p->out[(size_t)k * ncell + find_image(p->dim, i, mirror[k])] / (float)nimage;
    for (size_t i = 0; i < ncell; ++i)
        OM_CHECK(isfinite(logit[i]), OM_INVALID,
                 "banet: the network's output of cell %zu is not finite: its weights are damaged",
                 i);
    return OM_OK;
}

OmStatus om_banet_predict(OmBanetPredictor* p, const float* in, float* probability) {
    OM_TRY(om__banet_predict_logit(p, in, probability));
    for (size_t i = 0; i < om_grid_count(p->dim); ++i)
        probability[i] = (float)om__banet_probability(p->net, (double)probability[i]);
    return OM_OK;
}

OmStatus om_banet_estimate(const OmBanetNet* net, double side, const OmSurface* surface,
                           const double* u, const double* seen, double* probability) {
    OmBanetGrid grid;
    OmBanetPredictor* p = NULL;
    float *in = NULL, *out = NULL;
    int* cell = NULL;
    OmText note = {0};
    OmStatus status = om_banet_net_check(net, side, NULL, &note);
    om_text_done(&note);
    OM_TRY(status);
    OM_TRY(om_banet_grid_fit(surface, side, &grid));
    const size_t ncell = om_grid_count(grid.dim);
    OM_ALLOC_DONE(in, OM_BANET_NCHANNEL * ncell);
    OM_ALLOC_DONE(out, ncell);
    OM_ALLOC_DONE(cell, surface->nvert);
    OM_TRY_DONE(om_banet_voxelize(&grid, surface, u, seen, in));
    // One worker: also within a parallel loop, and the same bytes everywhere.
    OM_TRY_DONE(om_banet_predictor_create(net, grid.dim, 1, &p));
    OM_TRY_DONE(om_banet_predict(p, in, out));
    om_banet_find_cells(&grid, surface, cell);  // inside: the grid encloses the surface
    for (int i = 0; i < surface->nvert; ++i) probability[i] = (double)out[cell[i]];
done:
    om_banet_predictor_destroy(p);
    om_free(in);
    om_free(out);
    om_free(cell);
    return status;
}
