// calibrate_evolve.c: the global stage: differential evolution, one generation at a time.
//
// Storn and Price 1997 with the mutation current-to-pbest/1 and without the archive and adaptation of Zhang and
// Sanderson 2009 (JADE): v = x + F (pbest - x) + F (a - b), pbest of the best fifth, a and b of the others, F
// and CR drawn for each trial. The trials of a generation depend only on the previous one, so they are
// evaluated at once. Each draws from its own random stream, so the result does not depend on the worker count.
// A coordinate outside the box is replaced by the mean of its parent and the bound.
//
// NLopt's global searches evaluate one point at a time: they use a second processor only inside the model.
// Measured in doc/notes/calibrate.md; they remain as alternatives.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_internal.h"

#define PBEST_SHARE 0.2
// a population has converged when it lies within this fraction of the range in every parameter
#define NARROW 0.02

typedef struct Evolution {
    int np, n;      // members, parameters
    double* x;      // members                  (np x n)
    double* cost;   //                              (np)
    double* trial;  //                          (np x n)
    int* order;     // members by cost              (np)
} Evolution;

// The first population: one member per stratum in every coordinate; the first member is the start.
static void draw_population(const OmSearch* s, Evolution* e) {
    for (int k = 0; k < e->n; ++k) {
        OmRng rng = om_rng_init(s->def->seed, (uint64_t)k);
        for (int i = 0; i < e->np; ++i) e->order[i] = i;
        for (int i = e->np - 1; i > 0; --i) {
            int j = (int)om_rng_below(&rng, (uint32_t)(i + 1)), kept = e->order[i];
            e->order[i] = e->order[j];
            e->order[j] = kept;
        }
        for (int i = 0; i < e->np; ++i)
            e->trial[i * e->n + k] = (e->order[i] + om_rng_uniform(&rng)) / e->np;
        const OmCalibrationParam* p = &s->def->param[k];
        e->trial[k] = om__calibrate_to_unit(p, p->start);
    }
}

static void sort_members(Evolution* e) {
    // insertion sort: a few dozen members, nearly sorted; it is stable
    for (int i = 0; i < e->np; ++i) {
        int j = i;
        for (; j > 0 && e->cost[e->order[j - 1]] > e->cost[i]; --j) e->order[j] = e->order[j - 1];
        e->order[j] = i;
    }
}

static int draw_other(OmRng* rng, int np, int not1, int not2) {
    int k;
    do k = (int)om_rng_below(rng, (uint32_t)np);
    while (k == not1 || k == not2);
    return k;
}

static void make_trial(const OmSearch* s, Evolution* e, int generation, int i) {
    OmRng rng =
        om_rng_init(s->def->seed, 1000 + (uint64_t)generation * (uint64_t)e->np + (uint64_t)i);
    int nbest = (int)fmax(2, PBEST_SHARE * e->np);
    const double* best = e->x + e->order[om_rng_below(&rng, (uint32_t)nbest)] * e->n;
    int ia = draw_other(&rng, e->np, i, i), ib = draw_other(&rng, e->np, i, ia);
    const double *x = e->x + i * e->n, *a = e->x + ia * e->n, *b = e->x + ib * e->n;
    double *v = e->trial + i * e->n, F = om_rng_range(&rng, 0.4, 0.9),
           CR = om_rng_range(&rng, 0.5, 1);
    int kept = (int)om_rng_below(&rng, (uint32_t)e->n);  // at least one coordinate always changes
    for (int k = 0; k < e->n; ++k) {
        bool is_crossed = om_rng_uniform(&rng) < CR || k == kept;
        v[k] = is_crossed ? x[k] + F * (best[k] - x[k]) + F * (a[k] - b[k]) : x[k];
        if (v[k] < 0) v[k] = 0.5 * x[k];
        if (v[k] > 1) v[k] = 0.5 * (x[k] + 1);
    }
}

static void select_members(const OmSearch* s, Evolution* e) {
    const double* cost = s->cost + s->neval - e->np;
    for (int i = 0; i < e->np; ++i) {
        if (cost[i] > e->cost[i]) continue;
        e->cost[i] = cost[i];
        memcpy(e->x + i * e->n, e->trial + i * e->n, (size_t)e->n * sizeof *e->x);
    }
    sort_members(e);
}

// Does the better half lie within a small box?
static bool is_narrow(const Evolution* e) {
    for (int k = 0; k < e->n; ++k) {
        double lo = 1, hi = 0;
        for (int i = 0; i < (e->np + 1) / 2; ++i) {
            double v = e->x[e->order[i] * e->n + k];
            if (v < lo) lo = v;
            if (v > hi) hi = v;
        }
        if (hi - lo > NARROW) return false;
    }
    return true;
}

static OmStatus evolve(OmSearch* s, Evolution* e, int* ngeneration, bool* is_done) {
    draw_population(s, e);
    OM_TRY(om__search_batch(s, e->np, e->trial, NULL));
    for (int i = 0; i < e->np; ++i) e->cost[i] = INFINITY;
    select_members(s, e);
    OmStagnation g = {.mark = e->cost[e->order[0]]};
    for (*ngeneration = 1; *ngeneration < s->def->max_generations; ++*ngeneration) {
        for (int i = 0; i < e->np; ++i) make_trial(s, e, *ngeneration, i);
        OM_TRY(om__search_batch(s, e->np, e->trial, NULL));
        select_members(s, e);
        *is_done =
            om__search_is_stagnant(&g, e->cost[e->order[0]], s->def->patience) || is_narrow(e);
        if (*is_done) break;
    }
    return OM_OK;
}

OmStatus om__calibrate_evolve(OmSearch* s, int* ngeneration, bool* is_done) {
    int np = s->def->population ? s->def->population : (int)fmax(12, 8 * s->n);
    OmStatus status;
    Evolution e = {.np = np, .n = s->n};
    size_t count = (size_t)np * (size_t)s->n;
    OM_CALLOC_DONE(e.x, count);
    OM_CALLOC_DONE(e.trial, count);
    OM_CALLOC_DONE(e.cost, np);
    OM_CALLOC_DONE(e.order, np);
    om__search_begin(s, "global search", np * s->def->max_generations);
    status = evolve(s, &e, ngeneration, is_done);
done:
    om_free(e.x);
    om_free(e.trial);
    om_free(e.cost);
    om_free(e.order);
    return status;
}
