// nn_optim.c: Adam and AdamW, gradient clipping, averaged weights, schedules of the learning rate.
//
// With g the gradient (clipped), d the weight decay, t the step from 1:
//
//     Adam   g += d p                           (Kingma and Ba 2015, Alg. 1)
//     AdamW  p -= rate d p                      (Loshchilov and Hutter 2019, Alg. 2)
//     m = beta1 m + (1 - beta1) g               m^ = m / (1 - beta1^t)
//     v = beta2 v + (1 - beta2) g^2             v^ = v / (1 - beta2^t)
//     p -= rate m^ / (sqrt(v^) + epsilon)
//
// All updates of a parameter are done in one pass, because memory bandwidth limits the speed. The norm of the gradient
// is summed in double by lanes and blocks that do not depend on the worker count.
#include <math.h>
#include <string.h>

#include "base/base_multiversion.h"
#include "nn/nn_train_internal.h"

#define COOKIE 0x6f70746du
enum { GRAIN = 16384, LANES = 8 };
#define PI 3.14159265358979323846

struct OmOptim {
    OmOptimDef def;
    const OmNet* net;
    int64_t nparam, step;
    float *m, *v, *mean;  // moments, averaged weights or null (nparam)
    double* sum;          // one for each block of the gradient
};

// ---- schedules ----------------------------------------------------------------------------------------

OmSchedule om_schedule_constant(double rate) {
    return (OmSchedule){.kind = OM_SCHEDULE_CONSTANT, .peak = rate};
}

OmSchedule om_schedule_cosine(double peak, double warmup) {
    return (OmSchedule){.kind = OM_SCHEDULE_COSINE, .peak = peak, .warmup = warmup};
}

OmSchedule om_schedule_one_cycle(double peak) {
    return (OmSchedule){
        .kind = OM_SCHEDULE_ONE_CYCLE, .peak = peak, .start = 0.04, .end = 4e-6, .warmup = 0.3};
}

OmStatus om__schedule_check(const OmSchedule* s) {
    OM_CHECK(s->kind >= OM_SCHEDULE_CONSTANT && s->kind <= OM_SCHEDULE_ONE_CYCLE, OM_INVALID,
             "schedule: no kind %d", (int)s->kind);
    OM_CHECK(s->peak > 0 && isfinite(s->peak), OM_INVALID, "schedule: peak is %g, must be above 0",
             s->peak);
    OM_CHECK(s->start >= 0 && s->start <= 1, OM_INVALID, "schedule: start is %g, outside 0 to 1",
             s->start);
    OM_CHECK(s->end >= 0 && s->end <= 1, OM_INVALID, "schedule: end is %g, outside 0 to 1", s->end);
    OM_CHECK(s->warmup >= 0 && s->warmup < 1, OM_INVALID,
             "schedule: warmup is %g, must be 0 or more and below 1", s->warmup);
    return OM_OK;
}

// From a to b by half a cosine, x in [0, 1].
static double cosine(double a, double b, double x) { return b + (a - b) / 2 * (1 + cos(PI * x)); }

double om_schedule_rate(const OmSchedule* s, int64_t step, int64_t nstep) {
    double last = (double)(nstep > 1 ? nstep - 1 : 1);
    double at = (double)step;
    // The step of the peak rate; PyTorch's one cycle puts it one step before its fraction of all steps.
    double top = s->kind == OM_SCHEDULE_ONE_CYCLE ? fmax(s->warmup * (double)nstep - 1, 0)
                                                  : s->warmup * (double)nstep;
    if (at < top) {
        double x = at / top;  // top > at >= 0
        if (s->kind == OM_SCHEDULE_ONE_CYCLE) return s->peak * cosine(s->start, 1, x);
        // Warm-up counts steps from 1, so that the first step has a nonzero rate.
        return s->peak * (s->start + (1 - s->start) * fmin((at + 1) / top, 1));
    }
    if (s->kind == OM_SCHEDULE_CONSTANT) return s->peak;
    double x = last > top ? (at - top) / (last - top) : 0;
    return s->peak * cosine(1, s->end, fmin(x, 1));
}

// ---- optimisers ---------------------------------------------------------------------------------------

OmOptimDef om_optim_default_def(void) {
    return (OmOptimDef){.cookie = COOKIE,
                        .kind = OM_OPTIM_ADAMW,
                        .beta1 = 0.9,
                        .beta2 = 0.999,
                        .epsilon = 1e-8,
                        .weight_decay = 0.01};
}

OmStatus om__optim_check(const OmOptimDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID, "optimiser: begin with om_optim_default_def()");
    OM_CHECK(d->kind == OM_OPTIM_ADAM || d->kind == OM_OPTIM_ADAMW, OM_INVALID,
             "optimiser: no kind %d", (int)d->kind);
    OM_CHECK(d->beta1 >= 0 && d->beta1 < 1, OM_INVALID,
             "optimiser: beta1 is %g, must be 0 or more and below 1", d->beta1);
    OM_CHECK(d->beta2 >= 0 && d->beta2 < 1, OM_INVALID,
             "optimiser: beta2 is %g, must be 0 or more and below 1", d->beta2);
    OM_CHECK(d->average >= 0 && d->average < 1, OM_INVALID,
             "optimiser: average is %g, must be 0 or more and below 1", d->average);
    OM_CHECK(d->epsilon > 0 && isfinite(d->epsilon), OM_INVALID,
             "optimiser: epsilon is %g, must be above 0", d->epsilon);
    OM_CHECK(d->weight_decay >= 0 && isfinite(d->weight_decay), OM_INVALID,
             "optimiser: weight_decay is %g, must not be negative", d->weight_decay);
    OM_CHECK(d->clip_norm >= 0 && isfinite(d->clip_norm), OM_INVALID,
             "optimiser: clip_norm is %g, must not be negative", d->clip_norm);
    return OM_OK;
}

OmStatus om_optim_create(const OmOptimDef* def, const OmNet* net, OmOptim** optim) {
    OmStatus status = OM_OK;
    *optim = NULL;
    OM_TRY(om__optim_check(def));
    OmOptim* o = om_calloc(1, sizeof *o);
    if (!o) return OM_NO_MEMORY;
    o->def = *def;
    o->net = net;
    o->nparam = (int64_t)om_net_parameter_size(net);
    OM_CHECK_DONE(o->nparam > 0 && o->nparam < INT32_MAX, OM_INVALID,
                  "optimiser: a network of %lld parameters", (long long)o->nparam);
    OM_CALLOC_DONE(o->m, o->nparam);
    OM_CALLOC_DONE(o->v, o->nparam);
    if (def->average > 0) OM_CALLOC_DONE(o->mean, o->nparam);
    OM_CALLOC_DONE(o->sum, om_block_count((int)o->nparam, GRAIN));
    *optim = o;
    o = NULL;
done:
    om_optim_destroy(o);
    return status;
}

void om_optim_destroy(OmOptim* optim) {
    if (!optim) return;
    om_free(optim->m);
    om_free(optim->v);
    om_free(optim->mean);
    om_free(optim->sum);
    om_free(optim);
}

OmOptimState om__optim_state(OmOptim* o) {
    return (OmOptimState){.step = &o->step, .m = o->m, .v = o->v, .mean = o->mean};
}

size_t om_optim_size(const OmOptim* o) { return (size_t)o->nparam * (o->mean ? 3 : 2); }

void om_optim_save(const OmOptim* o, int64_t* step, float* value) {
    size_t n = (size_t)o->nparam;
    *step = o->step;
    memcpy(value, o->m, n * sizeof *value);
    memcpy(value + n, o->v, n * sizeof *value);
    if (o->mean) memcpy(value + 2 * n, o->mean, n * sizeof *value);
}

OmStatus om_optim_restore(OmOptim* o, int64_t step, const float* value) {
    size_t n = (size_t)o->nparam;
    OM_CHECK(step >= 0, OM_INVALID, "optimiser: a saved state of step %lld", (long long)step);
    for (size_t i = 0; i < om_optim_size(o); ++i)
        OM_CHECK(isfinite(value[i]), OM_INVALID,
                 "optimiser: value %zu of a saved state is not finite", i);
    o->step = step;
    memcpy(o->m, value, n * sizeof *value);
    memcpy(o->v, value + n, n * sizeof *value);
    if (o->mean) memcpy(o->mean, value + 2 * n, n * sizeof *value);
    return OM_OK;
}

typedef struct Step {
    OmOptim* o;
    const float* grad;
    float* param;
    double learning_rate;
    float scale;                  // of the gradient
    float beta1, beta2, epsilon;  //
    float new1, new2;             // 1 - beta
    float rate;                   // with the first moment's correction
    float root;                   // 1 / sqrt of the second moment's correction
    float mean_keep;              // of the averaged weights
} Step;

// ---- the norm of the gradient

OM_MULTIVERSION static double square_sum(const float* g, int n) {
    double lane[LANES] = {0};
    int i = 0;
    for (; i + LANES <= n; i += LANES)
        for (int k = 0; k < LANES; ++k) lane[k] += (double)g[i + k] * (double)g[i + k];
    for (int k = 0; i < n; ++i, ++k) lane[k] += (double)g[i] * (double)g[i];
    return ((lane[0] + lane[4]) + (lane[1] + lane[5])) +
           ((lane[2] + lane[6]) + (lane[3] + lane[7]));
}

static void norm_block(void* ctx, int begin, int end, int block) {
    const Step* s = ctx;
    s->o->sum[block] = square_sum(s->grad + begin, end - begin);
}

// Running statistics have gradient 0.
static double gradient_norm(Step* s) {
    int n = (int)s->o->nparam;
    double sum = 0;
    om_parallel_for(s->o->def.nworker, n, GRAIN, norm_block, s);
    for (int i = 0; i < om_block_count(n, GRAIN); ++i) sum += s->o->sum[i];
    return sqrt(sum);
}

// ---- the step

OM_MULTIVERSION static void update(const Step* s, double decay, int n, const float* restrict grad,
                                   float* restrict param, float* restrict m, float* restrict v) {
    bool is_w = s->o->def.kind == OM_OPTIM_ADAMW;
    float keep = is_w ? (float)(1 - s->learning_rate * decay) : 1;
    float add = is_w ? 0 : (float)decay;
    float scale = s->scale, rate = s->rate, root = s->root, epsilon = s->epsilon;
    float beta1 = s->beta1, beta2 = s->beta2, new1 = s->new1, new2 = s->new2;
    for (int i = 0; i < n; ++i) {
        float g = scale * grad[i] + add * param[i];
        m[i] = beta1 * m[i] + new1 * g;
        v[i] = beta2 * v[i] + new2 * (g * g);
        param[i] = keep * param[i] - rate * m[i] / (sqrtf(v[i]) * root + epsilon);  // epsilon > 0
    }
}

OM_MULTIVERSION static void average(int n, float keep, const float* restrict param,
                                    float* restrict mean) {
    for (int i = 0; i < n; ++i) mean[i] += (1 - keep) * (param[i] - mean[i]);
}

// A range of the flat array: the parts of the entries that lie in it.
static void update_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Step* s = ctx;
    OmOptim* o = s->o;
    for (int i = 0; i < om_net_parameter_count(o->net); ++i) {
        const OmNetParameter* p = om_net_parameter(o->net, i);
        int64_t at = p->adr > begin ? p->adr : begin;
        int64_t stop = p->adr + p->num < end ? p->adr + p->num : end;
        if (!p->is_trained || at >= stop) continue;
        int n = (int)(stop - at);
        update(s, p->is_decayed ? o->def.weight_decay : 0, n, s->grad + at, s->param + at,
               o->m + at, o->v + at);
        if (o->mean) average(n, s->mean_keep, s->param + at, o->mean + at);
    }
}

OmStatus om_optim_step(OmOptim* o, double rate, const float* grad, float* param, double* norm) {
    const OmOptimDef* d = &o->def;
    Step s = {.o = o, .grad = grad, .param = param};
    double length = gradient_norm(&s);
    if (norm) *norm = length;
    OM_CHECK(isfinite(length), OM_INVALID,
             "step %lld: the gradient is not finite; lower the learning rate or clip the gradient",
             (long long)o->step + 1);
    OM_CHECK(rate >= 0 && isfinite(rate), OM_INVALID, "step %lld: a learning rate of %g",
             (long long)o->step + 1, rate);
    double t = (double)++o->step;
    s.scale = d->clip_norm > 0 && length > d->clip_norm ? (float)(d->clip_norm / length) : 1;
    s.beta1 = (float)d->beta1;
    s.beta2 = (float)d->beta2;
    s.new1 = (float)(1 - d->beta1);
    s.new2 = (float)(1 - d->beta2);
    s.epsilon = (float)d->epsilon;
    s.learning_rate = rate;
    s.rate = (float)(rate / (1 - pow(d->beta1, t)));  // beta < 1, t >= 1
    s.root = (float)(1 / sqrt(1 - pow(d->beta2, t)));
    s.mean_keep = t == 1 ? 0 : (float)fmin(d->average, t / (9 + t));
    om_parallel_for(d->nworker, (int)o->nparam, GRAIN, update_block, &s);
    return OM_OK;
}

void om_optim_get_average(const OmOptim* o, const float* param, float* out) {
    for (int i = 0; i < om_net_parameter_count(o->net); ++i) {
        const OmNetParameter* p = om_net_parameter(o->net, i);
        const float* from = p->is_trained && o->mean && o->step > 0 ? o->mean : param;
        memcpy(out + p->adr, from + p->adr, (size_t)p->num * sizeof *out);
    }
}
