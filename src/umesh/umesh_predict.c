// umesh_predict.c: what the network is fed, what comes back, and how good it is.
//
// Channels at the points of the grid: the displacement of the patch over the input's size, which is the largest of
// them; where the patch is; what tells places apart, for a convolution alone does not know where it is: the organ, the
// held nodes, and the coordinates from -1 to 1; the linear answer, over the size; and the size itself, everywhere. So
// small inputs are as large as others; what comes out, times the size, is added to the linear answer. Last, the forces
// of second order (umesh_second.c): what drives the correction.
#include <math.h>
#include <string.h>

#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

enum {
    CH_PATCH = 3,
    CH_ORGAN = 4,
    CH_HELD = 5,
    CH_PLACE = 6,
    CH_LINEAR = 9,
    CH_SIZE = 12,
    CH_FORCE = 13
};

#define LEAST_SIZE 1e-6  // m, of an input

struct OmUmeshPredictor {
    const OmUmeshNet* net;
    OmNetRun* run;
    int nworker;
    float *in, *out, *u, *linear;
};

// ---- channels ---------------------------------------------------------------------------------------

void om__umesh_fill_fixed_channels(const OmUmeshGrid* g, float* in) {
    size_t npoint = (size_t)g->npoint;
    memset(in, 0, UMESH_NCHANNEL * npoint * sizeof *in);
    for (int i = 0; i < g->mesh.nnode; ++i) {
        in[CH_ORGAN * npoint + (size_t)g->node_point[i]] = 1;
        in[CH_HELD * npoint + (size_t)g->node_point[i]] = g->fixed[i] ? 1 : 0;
    }
    for (size_t p = 0; p < npoint; ++p) {
        size_t at = p;
        for (int c = 0; c < 3; ++c) {
            size_t dim = (size_t)g->dim[c];
            in[(CH_PLACE + (size_t)c) * npoint + p] =
                2.0f * (float)(at % dim) / (float)(dim - 1) - 1;
            at /= dim;
        }
    }
}

double om__umesh_size(const OmUmeshGrid* g, const unsigned char* mask, const float* u) {
    double most = 0;
    for (int i = 0; i < g->mesh.nnode; ++i) {
        const float* d = u + 3 * (size_t)i;
        if (mask[i]) most = fmax(most, om_norm2(om_vec3(d[0], d[1], d[2])));
    }
    return fmax(sqrt(most), LEAST_SIZE);
}

void om__umesh_fill_input(const OmUmeshNet* net, const unsigned char* mask, const float* u,
                          const float* linear, float* work, float* in) {
    const OmUmeshGrid* g = &net->grid;
    size_t npoint = (size_t)g->npoint;
    float *patch = in + CH_PATCH * npoint, *answer = in + CH_LINEAR * npoint;
    float* force = in + CH_FORCE * npoint;
    double size = om__umesh_size(g, mask, u);
    float over = (float)(1 / size), share = (float)(size / net->scale);
    float drive = (float)(1 / net->second);
    om_umesh_scatter(g, u, mask, in);
    om_umesh_scatter(g, linear, NULL, answer);
    om__umesh_second_order(g, net->poisson, size, linear, work);
    om_umesh_scatter(g, work, NULL, force);
    for (size_t n = 0; n < 3 * npoint; ++n) in[n] *= over, answer[n] *= over, force[n] *= drive;
    memset(patch, 0, npoint * sizeof *patch);
    for (int i = 0; i < g->mesh.nnode; ++i) {
        if (mask[i]) patch[g->node_point[i]] = 1;
        in[CH_SIZE * npoint + (size_t)g->node_point[i]] = share;
    }
}

// ---- prediction ---------------------------------------------------------------------------------------

// In 16 bits where the processor multiplies them: a fifth faster. What they round is the correction, not the answer.
static OmStatus create_run(const OmUmeshNet* net, int nworker, OmNetRun** run) {
    OmNetRunDef def = om_net_run_default_def(1);
    def.nworker = nworker;
    def.type = OM_BF16;
    OmStatus status = om_net_run_create(net->net, &def, run);
    if (status != OM_UNAVAILABLE) return status;
    def.type = OM_F32;
    return om_net_run_create(net->net, &def, run);
}

OmStatus om_umesh_create_predictor(const OmUmeshNet* net, int nworker, OmUmeshPredictor** out) {
    *out = NULL;
    OmUmeshPredictor* p = om_calloc(1, sizeof *p);
    if (!p) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    p->net = net;
    p->nworker = nworker;
    OM_TRY_DONE(create_run(net, nworker, &p->run));
    OM_TRY_DONE(om_net_run_set_parameters(p->run, net->param));
    OM_ALLOC_DONE(p->in, UMESH_NCHANNEL * (size_t)net->grid.npoint);
    OM_ALLOC_DONE(p->out, 3 * (size_t)net->grid.npoint);
    OM_ALLOC_DONE(p->u, 3 * (size_t)net->grid.mesh.nnode);
    OM_ALLOC_DONE(p->linear, 3 * (size_t)net->grid.mesh.nnode);
    om__umesh_fill_fixed_channels(&net->grid, p->in);
    *out = p;
    return OM_OK;
done:
    om_umesh_destroy_predictor(p);
    return status;
}

void om_umesh_destroy_predictor(OmUmeshPredictor* p) {
    if (!p) return;
    om_net_run_destroy(p->run);
    om_free(p->in);
    om_free(p->out);
    om_free(p->u);
    om_free(p->linear);
    om_free(p);
}

size_t om__umesh_predictor_memory(const OmUmeshPredictor* p) {
    size_t npoint = (size_t)p->net->grid.npoint, nnode = (size_t)p->net->grid.mesh.nnode;
    return sizeof *p + om_net_run_memory(p->run) +
           ((UMESH_NCHANNEL + 3) * npoint + 6 * nnode) * sizeof(float);
}

OmStatus om_umesh_predict(OmUmeshPredictor* p, const unsigned char* mask, float* u,
                          OmUmeshTrust* trust) {
    const OmUmeshGrid* g = &p->net->grid;
    int nmasked = 0;
    for (int i = 0; i < g->mesh.nnode; ++i) {
        if (!mask[i]) continue;
        ++nmasked;
        for (int c = 0; c < 3; ++c)
            OM_CHECK(isfinite(u[3 * i + c]), OM_INVALID,
                     "umesh: the displacement of node %d is not finite", i);
    }
    OM_CHECK(nmasked > 0, OM_INVALID, "umesh: no node is moved");
    float scale = (float)(p->net->correction * om__umesh_size(g, mask, u));
    OM_TRY(om__umesh_linear_solve(p->net->linear, mask, u, p->nworker, p->linear));
    om__umesh_fill_input(p->net, mask, u, p->linear, p->u, p->in);
    OM_TRY(om_net_run_forward(p->run, p->in, p->out));
    om_umesh_gather(g, p->out, p->u);
    if (trust) om_umesh_judge(p->net, mask, u, trust);
    for (int i = 0; i < g->mesh.nnode; ++i)
        for (int c = 0; c < 3 && (g->fixed[i] || !mask[i]); ++c)
            u[3 * i + c] = g->fixed[i] ? 0 : p->linear[3 * i + c] + scale * p->u[3 * i + c];
    return OM_OK;
}

// ---- evaluation ---------------------------------------------------------------------------------------

double om__umesh_mean_error(const OmUmeshGrid* g, const float* a, const float* b) {
    double sum = 0;
    int num = 0;
    for (int i = 0; i < g->mesh.nnode; ++i) {
        if (g->fixed[i]) continue;
        double d2 = 0;
        for (int c = 0; c < 3; ++c) {
            double d = (double)a[3 * i + c] - (double)b[3 * i + c];
            d2 += d * d;
        }
        sum += sqrt(d2);
        ++num;
    }
    return num ? sum / num : 0;
}

static void summarise(OmUmeshEval* e, double* ms) {
    for (int s = 0; s < e->n; ++s) {
        e->mean += e->error[s] / e->n;
        if (e->error[s] >= e->worst) e->worst = e->error[s], e->worst_sample = s;
    }
    for (int s = 0; s < e->n; ++s)
        e->sd += (e->error[s] - e->mean) * (e->error[s] - e->mean) / e->n;
    e->sd = sqrt(e->sd);
    om_sort_doubles(ms, e->n);
    e->ms_least = ms[0];
    e->ms_median = ms[e->n / 2];
    e->ms_most = ms[e->n - 1];
}

OmStatus om_umesh_eval(const OmUmeshNet* net, const OmUmeshData* data, int first, int n,
                       int nworker, OmUmeshEval* e) {
    size_t nnode = (size_t)net->grid.mesh.nnode;
    *e = (OmUmeshEval){.n = n};
    OM_CHECK(data->grid.hash == net->grid.hash, OM_INVALID,
             "umesh: the data are of another organ or grid than the network (%d and %d elements)",
             data->grid.mesh.nelem, net->grid.mesh.nelem);
    OM_CHECK(n >= 1 && first >= 0 && n <= data->nsample - first, OM_INVALID,
             "umesh: %d samples from %d on; the data have %d", n, first, data->nsample);
    OmUmeshPredictor* p = NULL;
    float* u = NULL;
    double* ms = NULL;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_umesh_create_predictor(net, nworker, &p));
    OM_ALLOC_DONE(u, 3 * nnode);
    OM_ALLOC_DONE(ms, n);
    OM_ALLOC_DONE(e->error, n);
    OM_ALLOC_DONE(e->score, n);
    for (int s = 0; s < n; ++s) {
        size_t at = (size_t)(first + s) * nnode;
        OmUmeshTrust trust;
        memcpy(u, data->u + 3 * at, 3 * nnode * sizeof *u);
        double begin = om_clock_now();
        OM_TRY_DONE(om_umesh_predict(p, data->mask + at, u, &trust));
        ms[s] = 1e3 * (om_clock_now() - begin);
        e->error[s] = om__umesh_mean_error(&net->grid, u, data->u + 3 * at);
        e->score[s] = trust.score;
        e->ninside += trust.is_inside;
        e->max_u = fmax(e->max_u, data->sample[first + s].max_u);
    }
    summarise(e, ms);
done:
    om_free(ms);
    om_free(u);
    om_umesh_destroy_predictor(p);
    if (status < 0) om_umesh_eval_done(e);
    return status;
}

void om_umesh_eval_done(OmUmeshEval* e) {
    om_free(e->error);
    om_free(e->score);
    *e = (OmUmeshEval){0};
}
