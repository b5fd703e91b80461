// calibrate_search.c: evaluate many points at once and record them in order.
//
// Workers start evaluations in order and finish in any order. A worker that finishes one, while no other
// worker writes, writes all evaluations that are finished without a gap to the journal, in order. So the file
// does not depend on the number of workers, and a line waits only for earlier evaluations.
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "calibrate/calibrate_internal.h"

typedef struct Batch {
    OmSearch* s;
    int n, first;     // evaluations, and the number of the first
    int inner;        // workers of each evaluation
    double* param;    // (n x nparam)
    double* error;    // (n x nerror)
    double* sorted;   // scratch of the norm (n x nerror), or null
    bool has_errors;  // errors are stored in the journal
    double* cost;     // (n)
    OmStatus* status;
    atomic_int* is_done;  // (n)
    atomic_flag is_writing;
    atomic_int next;       // the first evaluation that is not recorded
    atomic_int stop;       // nonzero after an error or a cancellation
    char (*message)[256];  // error message of each evaluation (n)
    char reason[256];  // message of the first error in order; written by the worker that records
    OmStatus outcome;
} Batch;

void om__search_begin(OmSearch* s, const char* stage, int total) {
    s->stage = stage;
    s->stage_begin = s->neval;
    s->stage_total = total;
}

bool om__search_is_stagnant(OmStagnation* g, double cost, int patience) {
    if (cost < 0.99 * g->mark) {
        g->mark = cost;
        g->still = 0;
    } else {
        ++g->still;
    }
    return g->still >= patience;
}

// ---- one evaluation -------------------------------------------------------------------------------

static void evaluate(Batch* b, int i) {
    OmSearch* s = b->s;
    const OmCalibrationDef* def = s->def;
    const double* p = b->param + (size_t)i * (size_t)s->n;
    double* e = b->error + (size_t)i * (size_t)def->nerror;
    double* sorted = b->sorted ? b->sorted + (size_t)i * (size_t)def->nerror : NULL;
    int k = b->first + i;
    OmStatus status;
    if (k < s->journal.nold) {
        status = om__journal_get(&s->journal, k, p, &b->cost[i], b->has_errors ? e : NULL);
    } else {
        status = def->eval(def->ctx, p, b->inner, e);
        if (status > 0)
            for (int m = 0; m < def->nerror; ++m) e[m] = INFINITY;
        if (status >= 0) b->cost[i] = om_calibration_norm_eval(def, def->nerror, e, sorted);
    }
    b->status[i] = status < 0 ? status : OM_OK;
    if (status < 0) snprintf(b->message[i], sizeof b->message[i], "%s", om_error_message());
}

static OmStatus record(Batch* b, int i) {
    OmSearch* s = b->s;
    int k = b->first + i;
    OM_TRY(b->status[i]);
    if (k >= s->journal.nold) {
        const double* e = b->has_errors ? b->error + (size_t)i * (size_t)s->def->nerror : NULL;
        OM_TRY(om__journal_put(&s->journal, k, s->stage, b->param + (size_t)i * (size_t)s->n,
                               b->cost[i], e));
        ++s->nnew;
    }
    return om_progress_report(s->progress, s->stage, k + 1 - s->stage_begin, s->stage_total);
}

// Record finished evaluations, unless another worker does; check again afterwards for new ones.
static void record_finished(Batch* b) {
    for (;;) {
        int i = atomic_load(&b->next);
        if (atomic_load(&b->stop) || i >= b->n || !atomic_load(&b->is_done[i])) return;
        if (atomic_flag_test_and_set(&b->is_writing)) return;
        for (i = atomic_load(&b->next);
             i < b->n && !atomic_load(&b->stop) && atomic_load(&b->is_done[i]); ++i) {
            OmStatus status = record(b, i);
            if (status < 0) {
                b->outcome = status;
                snprintf(b->reason, sizeof b->reason, "%s",
                         b->status[i] < 0 ? b->message[i] : om_error_message());
                atomic_store(&b->stop, 1);
            }
            atomic_store(&b->next, i + 1);
        }
        atomic_flag_clear(&b->is_writing);
    }
}

static void run_block(void* ctx, int begin, int end, int block) {
    (void)block;
    Batch* b = ctx;
    for (int i = begin; i < end && !atomic_load(&b->stop); ++i) {
        evaluate(b, i);
        atomic_store(&b->is_done[i], 1);
        record_finished(b);
    }
}

// ---- batches --------------------------------------------------------------------------------------

static OmStatus make_room(OmSearch* s, int n) {
    if (s->neval + n <= s->cap) return OM_OK;
    size_t cap = (size_t)(s->cap + n) * 2, dim = (size_t)s->n;
    double* u = om_realloc(s->u, (size_t)s->cap * dim, cap * dim, sizeof *u);
    if (!u) return OM_NO_MEMORY;
    s->u = u;
    double* cost = om_realloc(s->cost, (size_t)s->cap, cap, sizeof *cost);
    if (!cost) return OM_NO_MEMORY;
    s->cost = cost;
    s->cap = (int)cap;
    return OM_OK;
}

static void keep(OmSearch* s, int n, const double* u, const double* cost) {
    memcpy(s->u + (size_t)s->neval * (size_t)s->n, u, (size_t)n * (size_t)s->n * sizeof *u);
    memcpy(s->cost + s->neval, cost, (size_t)n * sizeof *cost);
    for (int i = s->neval; i < s->neval + n; ++i)
        if (s->best < 0 || s->cost[i] < s->cost[s->best]) s->best = i;
    s->neval += n;
}

OmStatus om__search_batch(OmSearch* s, int n, const double* u, double* error) {
    if (n <= 0) return OM_OK;
    OmStatus status;
    Batch b = {.s = s, .n = n, .first = s->neval, .error = error, .has_errors = error != NULL};
    size_t count = (size_t)n * (size_t)s->def->nerror;
    b.inner = n == 1 ? s->nworker : 1;
    OM_TRY_DONE(make_room(s, n));
    OM_ALLOC_DONE(b.param, (size_t)n * (size_t)s->n);
    if (!error) OM_ALLOC_DONE(b.error, count);
    if (s->def->norm == OM_NORM_TRIMMED) OM_ALLOC_DONE(b.sorted, count);
    OM_CALLOC_DONE(b.cost, n);
    OM_CALLOC_DONE(b.status, n);
    OM_CALLOC_DONE(b.message, n);
    OM_CALLOC_DONE(b.is_done, n);
    atomic_flag_clear(&b.is_writing);
    for (int i = 0; i < n * s->n; ++i)
        b.param[i] = om__calibrate_from_unit(&s->def->param[i % s->n], u[i]);
    om_parallel_for(s->nworker, n, 1, run_block, &b);
    status = b.outcome;
    if (status < 0) om_error(status, "%s", b.reason);
    if (status == OM_OK) keep(s, n, u, b.cost);
done:
    if (!error) om_free(b.error);
    om_free(b.param);
    om_free(b.sorted);
    om_free(b.cost);
    om_free(b.status);
    om_free(b.message);
    om_free(b.is_done);
    return status;
}

OmStatus om__search_one(OmSearch* s, const double* u, double* cost) {
    OM_TRY(om__search_batch(s, 1, u, NULL));
    *cost = s->cost[s->neval - 1];
    return OM_OK;
}
