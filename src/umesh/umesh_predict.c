// umesh_predict.c: input channels of the network, prediction, evaluation.
//
// The size of an input is its largest displacement. Channels at the points of the grid:
//
//   - displacements of the patch over the size, and the mask of the patch,
//   - organ, fixed nodes, and coordinates from -1 to 1: a convolution alone has no information on position,
//   - the linear solution over the size, and the size itself, at all points,
//   - the forces of second order (om_fem_grid_second_order), which determine the correction.
//
// Division by the size scales small and large inputs to the same range. The prediction is the linear solution plus
// the output times the size.
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

#define LEAST_SIZE 1e-6  // m, smallest size of an input

struct OmUmeshPredictor {
    const OmUmeshNet* net;
    OmNetRun* run;
    OmFemGridWork* work;  // null: the output of the network is not relaxed
    OmFemGridReport refinement;
    double tolerance;
    int max_cycle, nworker;
    bool is_linear;  // the linear solution is relaxed, without the network
    float *in, *out, *u, *linear;
};

// ---- channels ---------------------------------------------------------------------------------------

void om__umesh_fill_fixed_channels(const OmUmeshGrid* g, float* in) {
    size_t npoint = (size_t)g->fem.npoint;
    memset(in, 0, UMESH_NCHANNEL * npoint * sizeof *in);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        in[CH_ORGAN * npoint + (size_t)g->fem.node_point[i]] = 1;
        in[CH_HELD * npoint + (size_t)g->fem.node_point[i]] = g->fem.fixed[i] ? 1 : 0;
    }
    for (size_t p = 0; p < npoint; ++p) {
        size_t at = p;
        for (int c = 0; c < 3; ++c) {
            size_t dim = (size_t)g->fem.grid.dim[c];
            in[(CH_PLACE + (size_t)c) * npoint + p] =
                2.0f * (float)(at % dim) / (float)(dim - 1) - 1;
            at /= dim;
        }
    }
}

double om__umesh_size(const OmUmeshGrid* g, const unsigned char* mask, const float* u) {
    double max = 0;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        const float* d = u + 3 * (size_t)i;
        if (mask[i]) max = fmax(max, om_norm2(om_vec3(d[0], d[1], d[2])));
    }
    return fmax(sqrt(max), LEAST_SIZE);
}

typedef struct Filling {
    const OmUmeshNet* net;
    const unsigned char* mask;
    const float *u, *linear;
    float *work, *in;
    double size;
} Filling;

static void fill_displacements(const Filling* f) {
    const OmUmeshGrid* g = &f->net->grid;
    const size_t npoint = (size_t)g->fem.npoint;
    float *patch = f->in + CH_PATCH * npoint, *answer = f->in + CH_LINEAR * npoint;
    const float over = (float)(1 / f->size), share = (float)(f->size / f->net->scale);
    om_umesh_scatter(g, f->u, f->mask, f->in);
    om_umesh_scatter(g, f->linear, NULL, answer);
    for (size_t n = 0; n < 3 * npoint; ++n) f->in[n] *= over, answer[n] *= over;
    memset(patch, 0, npoint * sizeof *patch);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        if (f->mask[i]) patch[g->fem.node_point[i]] = 1;
        f->in[CH_SIZE * npoint + (size_t)g->fem.node_point[i]] = share;
    }
}

static void fill_forces(const Filling* f) {
    const OmUmeshGrid* g = &f->net->grid;
    const size_t npoint = (size_t)g->fem.npoint;
    float* force = f->in + CH_FORCE * npoint;
    const float scale = (float)(1 / f->net->second);
    om_fem_grid_second_order(&g->fem, f->net->poisson, f->size, f->linear, f->work);
    om_umesh_scatter(g, f->work, NULL, force);
    for (size_t n = 0; n < 3 * npoint; ++n) force[n] *= scale;
}

static void fill_part(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int k = begin; k < end; ++k) k == 0 ? fill_forces(ctx) : fill_displacements(ctx);
}

void om__umesh_fill_input(const OmUmeshNet* net, const unsigned char* mask, const float* u,
                          const float* linear, int nworker, float* work, float* in) {
    Filling f = {net, mask, u, linear, work, in, om__umesh_size(&net->grid, mask, u)};
    om_parallel_for(nworker, 2, 1, fill_part, &f);
}

// ---- prediction ---------------------------------------------------------------------------------------

// Use the processor's fastest type: bfloat16 rounds only the correction, not the whole prediction. oneDNN waits for all
// its threads, so their number is limited to the processors that are free now.
static OmStatus create_run(const OmUmeshNet* net, int nworker, OmNetRun** run) {
    OmNetRunDef def = om_net_run_default_def(1);
    def.nworker = om_worker_free(nworker);
    def.type = om_net_fast_type();
    OmStatus status = om_net_run_create(net->net, &def, run);
    if (status != OM_UNAVAILABLE) return status;
    def.type = OM_F32;
    return om_net_run_create(net->net, &def, run);
}

OmStatus om_umesh_predictor_create(const OmUmeshNet* net, int nworker, OmUmeshPredictor** out) {
    *out = NULL;
    OmUmeshPredictor* p = om_calloc(1, sizeof *p);
    if (!p) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    p->net = net;
    p->nworker = nworker;
    om_umesh_predictor_set_refinement(p, OM_UMESH_TOLERANCE, OM_UMESH_MAX_CYCLE);
    if (net->model) OM_TRY_DONE(om_fem_grid_work_create(net->model, &p->work));
    OM_TRY_DONE(create_run(net, nworker, &p->run));
    OM_TRY_DONE(om_net_run_set_parameters(p->run, net->param));
    OM_ALLOC_DONE(p->in, UMESH_NCHANNEL * (size_t)net->grid.fem.npoint);
    OM_ALLOC_DONE(p->out, 3 * (size_t)net->grid.fem.npoint);
    OM_ALLOC_DONE(p->u, 3 * (size_t)net->grid.fem.mesh.nnode);
    OM_ALLOC_DONE(p->linear, 3 * (size_t)net->grid.fem.mesh.nnode);
    om__umesh_fill_fixed_channels(&net->grid, p->in);
    *out = p;
    return OM_OK;
done:
    om_umesh_predictor_destroy(p);
    return status;
}

void om_umesh_predictor_destroy(OmUmeshPredictor* p) {
    if (!p) return;
    om_net_run_destroy(p->run);
    om_fem_grid_work_destroy(p->work);
    om_free(p->in);
    om_free(p->out);
    om_free(p->u);
    om_free(p->linear);
    om_free(p);
}

size_t om__umesh_predictor_memory(const OmUmeshPredictor* p) {
    size_t npoint = (size_t)p->net->grid.fem.npoint, nnode = (size_t)p->net->grid.fem.mesh.nnode;
    return sizeof *p + om_net_run_memory(p->run) +
           (p->work ? om_fem_grid_work_memory(p->work) : 0) +
           ((UMESH_NCHANNEL + 3) * npoint + 6 * nnode) * sizeof(float);
}

void om_umesh_predictor_set_refinement(OmUmeshPredictor* p, double tolerance, int max_cycle) {
    p->tolerance = tolerance;
    p->max_cycle = max_cycle;
}

void om_umesh_predictor_set_linear(OmUmeshPredictor* p, bool is_linear) {
    p->is_linear = is_linear;
}

OmFemGridReport om_umesh_predictor_refinement(const OmUmeshPredictor* p) { return p->refinement; }

static OmStatus check_input(const OmUmeshGrid* g, const unsigned char* mask, const float* u) {
    int nmasked = 0;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        if (!mask[i]) continue;
        ++nmasked;
        for (int c = 0; c < 3; ++c)
            OM_CHECK(isfinite(u[3 * i + c]), OM_INVALID,
                     "umesh: the displacement of node %d is not finite", i);
    }
    OM_CHECK(nmasked > 0, OM_INVALID, "umesh: no node is moved");
    return OM_OK;
}

static bool is_finite(const float* u, size_t n) {
    for (size_t i = 0; i < n; ++i)
        if (!isfinite(u[i])) return false;
    return true;
}

// Relax to equilibrium; u is not changed if the result is not finite.
static OmStatus refine(OmUmeshPredictor* p, const OmFemGridPatch* patch, const unsigned char* mask,
                       float* u) {
    size_t n = 3 * (size_t)p->net->grid.fem.mesh.nnode;
    if (!p->work || p->max_cycle <= 0) return OM_OK;
    memcpy(p->linear, u, n * sizeof *u);
    const OmFemGridStop stop = {p->tolerance, p->max_cycle, p->nworker};
    OM_TRY(om_fem_grid_solve(p->work, patch, mask, &stop, u, &p->refinement));
    if (is_finite(u, n)) return OM_OK;
    memcpy(u, p->linear, n * sizeof *u);
    p->refinement = (OmFemGridReport){.left = INFINITY};
    return OM_OK;
}

// Add the output of the network to the linear solution.
static OmStatus add_correction(OmUmeshPredictor* p, const unsigned char* mask, const float* u) {
    const OmUmeshGrid* g = &p->net->grid;
    const float scale = (float)(p->net->correction * om__umesh_size(g, mask, u));
    om__umesh_fill_input(p->net, mask, u, p->linear, p->nworker, p->u, p->in);
    OM_TRY(om_net_run_forward(p->run, p->in, p->out));
    om_umesh_gather(g, p->out, p->u);
    for (int i = 0; i < 3 * g->fem.mesh.nnode; ++i) p->linear[i] += scale * p->u[i];
    return OM_OK;
}

OmStatus om_umesh_predict(OmUmeshPredictor* p, const unsigned char* mask, float* u,
                          OmUmeshTrust* trust) {
    const OmUmeshGrid* g = &p->net->grid;
    OmFemGridPatch patch;
    OmStatus status = OM_OK;
    p->refinement = (OmFemGridReport){0};
    OM_TRY(check_input(g, mask, u));
    OM_TRY(om_fem_grid_patch_init(p->net->linear, mask, &patch));
    OM_TRY_DONE(om_fem_grid_linear_eval(p->net->linear, &patch, u, p->nworker, p->linear));
    if (!p->is_linear) OM_TRY_DONE(add_correction(p, mask, u));
    if (trust) om_umesh_judge(p->net, mask, u, trust);
    for (int i = 0; i < g->fem.mesh.nnode; ++i)
        for (int c = 0; c < 3 && (g->fem.fixed[i] || !mask[i]); ++c)
            u[3 * i + c] = g->fem.fixed[i] ? 0 : p->linear[3 * i + c];
    OM_TRY_DONE(refine(p, &patch, mask, u));
done:
    om_fem_grid_patch_done(&patch);
    return status;
}

// ---- evaluation ---------------------------------------------------------------------------------------

double om__umesh_mean_error(const OmUmeshGrid* g, const float* a, const float* b) {
    double sum = 0;
    int num = 0;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        if (g->fem.fixed[i]) continue;
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

enum {
    NETWORK,
    ALONE,
    LINEAR,
    REFINED
};  // the network alone; linear solutions alone and refined; network refined

// Predict all samples in one mode, one after another, so that times are those of continuous use.
static OmStatus try_samples(OmUmeshPredictor* p, int kind, const OmUmeshData* data, int first,
                            double tolerance, float* u, double* ms, OmUmeshEval* e) {
    const OmUmeshGrid* g = &p->net->grid;
    const size_t nnode = (size_t)g->fem.mesh.nnode;
    bool is_refined = kind == LINEAR || kind == REFINED;
    om_umesh_predictor_set_refinement(p, tolerance, is_refined ? OM_UMESH_MAX_CYCLE : 0);
    om_umesh_predictor_set_linear(p, kind == ALONE || kind == LINEAR);
    for (int s = 0; s < e->n; ++s) {
        const float* truth = data->u + 3 * (size_t)(first + s) * nnode;
        OmUmeshTrust trust;
        memcpy(u, truth, 3 * nnode * sizeof *u);
        double begin = om_clock_now();
        OM_TRY(om_umesh_predict(p, data->mask + (size_t)(first + s) * nnode, u, &trust));
        ms[s] = 1e3 * (om_clock_now() - begin);
        double error = om__umesh_mean_error(g, u, truth);
        if (kind == NETWORK) {
            e->network_mean += error / e->n;
            e->network_worst = fmax(e->network_worst, error);
        } else if (kind == ALONE) {
            e->alone_mean += error / e->n;
            e->alone_worst = fmax(e->alone_worst, error);
        } else if (kind == LINEAR) {
            e->linear_mean += error / e->n;
            e->linear_worst = fmax(e->linear_worst, error);
        } else {
            const OmFemGridReport* r = &p->refinement;
            e->error[s] = error;
            e->score[s] = trust.score;
            e->ninside += trust.is_inside;
            e->mean_cycle += (double)r->ncycle / e->n;
            if (r->ncycle > e->max_cycle) e->max_cycle = r->ncycle;
            if (r->ncycle > 0 && !(r->min_volume > 0)) ++e->ninverted;
            if (r->ncycle > 0 && error > fmax(tolerance, r->left)) ++e->nbeyond;
        }
    }
    om_sort_doubles(ms, e->n);
    return OM_OK;
}

static void summarise(OmUmeshEval* e) {
    for (int s = 0; s < e->n; ++s) {
        e->mean += e->error[s] / e->n;
        if (e->error[s] >= e->worst) e->worst = e->error[s], e->worst_sample = s;
    }
    for (int s = 0; s < e->n; ++s)
        e->sd += (e->error[s] - e->mean) * (e->error[s] - e->mean) / e->n;
    e->sd = sqrt(e->sd);
}

OmStatus om_umesh_eval(const OmUmeshNet* net, const OmUmeshData* data, int first, int n,
                       double tolerance, int nworker, OmUmeshEval* e) {
    *e = (OmUmeshEval){.n = n};
    OM_CHECK(data->grid.hash == net->grid.hash, OM_INVALID,
             "umesh: the data are of another organ or grid than the network (%d and %d elements)",
             data->grid.fem.mesh.nelem, net->grid.fem.mesh.nelem);
    OM_CHECK(n >= 1 && first >= 0 && n <= data->nsample - first, OM_INVALID,
             "umesh: %d samples from %d on; the data have %d", n, first, data->nsample);
    OmUmeshPredictor* p = NULL;
    float* u = NULL;
    double* ms = NULL;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_umesh_predictor_create(net, nworker, &p));
    OM_ALLOC_DONE(u, 3 * (size_t)net->grid.fem.mesh.nnode);
    OM_ALLOC_DONE(ms, n);
    OM_ALLOC_DONE(e->error, n);
    OM_ALLOC_DONE(e->score, n);
    OM_TRY_DONE(try_samples(p, NETWORK, data, first, tolerance, u, ms, e));
    OM_TRY_DONE(try_samples(p, ALONE, data, first, tolerance, u, ms, e));
    OM_TRY_DONE(try_samples(p, LINEAR, data, first, tolerance, u, ms, e));
    e->linear_ms = ms[n / 2];
    OM_TRY_DONE(try_samples(p, REFINED, data, first, tolerance, u, ms, e));
    e->ms_min = ms[0];
    e->ms_median = ms[n / 2];
    e->ms_max = ms[n - 1];
    for (int s = first; s < first + n; ++s) e->max_u = fmax(e->max_u, data->sample[s].max_u);
    summarise(e);
done:
    om_free(ms);
    om_free(u);
    om_umesh_predictor_destroy(p);
    if (status < 0) om_umesh_eval_done(e);
    return status;
}

void om_umesh_eval_done(OmUmeshEval* e) {
    om_free(e->error);
    om_free(e->score);
    *e = (OmUmeshEval){0};
}
