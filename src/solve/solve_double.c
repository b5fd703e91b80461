// solve_double.c: conjugate gradients in double with block Jacobi, for systems that float cannot reduce.
//
// Float fails on a system whose stiffest and softest directions differ by more than about 1e6, such as a sheet
// of flat elements: a correction then enlarges the residual. The vectors of this solve use the memory of the
// float vectors, one right-hand side at a time:
//
//     vector:  p (3 nvert) | w, then z = D^-1 r | r | the best iterate             doubles
//
// The residual of CG is not monotone; the iterate with the smallest one is kept.
//
// Tried on the sheet of 0.1 mm with cells of 10 mm: float corrections as long as the energy falls (it falls for one
// to three of them, then rises without bound); multigrid in float inside CG in double (330 to 490 V-cycles to 1e-3,
// where block Jacobi takes 500 to 560 iterations, and a V-cycle costs as much as three of them: 642 against 222
// microseconds with 5,328 vertices, one worker).
#include <math.h>
#include <string.h>

#include "solve/solve_internal.h"

#define NEGATIVE 1e-12  // of |p| |A p|: smaller values are rounding

typedef struct Wide {  // one lane, for one member of the team
    OmSolver* S;
    const OmBsr* A;
    const OmRank* who;
    int first, last;  // chunks
    size_t lanes, lane;
    double *p, *w, *r, *best;
} Wide;

OM_MULTIVERSION
static void multiply_rows(const OmBsr* A, const double* x, double* y, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        om_store3(y, i, om__row_product(A, x, i));
    }
}

// z = D^-1 r of rows; dinv is zero at prescribed degrees of freedom.
static void apply_blocks(const float* dinv, const double* r, double* z, int begin, int end) {
    for (size_t i = (size_t)begin; i < (size_t)end; ++i)
        for (size_t c = 0; c < 3; ++c) {
            const float* d = dinv + 9 * i + c;
            const double* ri = r + 3 * i;
            z[3 * i + c] = (double)d[0] * ri[0] + (double)d[3] * ri[1] + (double)d[6] * ri[2];
        }
}

enum {
    OF_PRODUCT = 0,
    OF_UPDATE = 3
};  // columns of partial: the sums of one are read while the other's are written

// The sums of `num` columns over all chunks; every member gets the same ones.
static void add_up(const Wide* d, int column, int num, double* sum) {
    om_team_barrier(d->who->team);
    for (int c = 0; c < num; ++c) sum[c] = om__total(d->S, column + c);
}

// w = A p with zeros at prescribed rows. Sums: p.w, p.p, w.w.
static void multiply(const Wide* d, double sum[3]) {
    OmSolver* S = d->S;
    for (int k = d->first; k < d->last; ++k) {
        double part[3] = {0, 0, 0};
        multiply_rows(d->A, d->p, d->w, S->chunks.begin[k], S->chunks.begin[k + 1]);
        if (d->A->ties)
            om__ties_add_rows(d->A->ties, d->p, d->w, S->chunks.begin[k], S->chunks.begin[k + 1]);
        for (size_t n = 3 * (size_t)S->chunks.begin[k]; n < 3 * (size_t)S->chunks.begin[k + 1];
             ++n) {
            if (S->fixed[n]) d->w[n] = 0;
            part[0] += d->p[n] * d->w[n];
            part[1] += d->p[n] * d->p[n];
            part[2] += d->w[n] * d->w[n];
        }
        om__put_partial(S, OF_PRODUCT, k, part, 3);
    }
    add_up(d, OF_PRODUCT, 3, sum);
}

// x += alpha p, r -= alpha w, z = D^-1 r in the memory of w. Sums: r.r and r.z.
static void update(const Wide* d, double alpha, double sum[2]) {
    OmSolver* S = d->S;
    for (int k = d->first; k < d->last; ++k) {
        size_t begin = 3 * (size_t)S->chunks.begin[k], end = 3 * (size_t)S->chunks.begin[k + 1];
        double part[2] = {0, 0};
        for (size_t n = begin; n < end; ++n) {
            S->xd[d->lanes * n + d->lane] += alpha * d->p[n];
            d->r[n] -= alpha * d->w[n];
            part[0] += d->r[n] * d->r[n];
        }
        apply_blocks(S->dinv, d->r, d->w, S->chunks.begin[k], S->chunks.begin[k + 1]);
        for (size_t n = begin; n < end; ++n) part[1] += d->r[n] * d->w[n];
        om__put_partial(S, OF_UPDATE, k, part, 2);
    }
    add_up(d, OF_UPDATE, 2, sum);
}

static void next_direction(const Wide* d, double beta) {
    for (size_t n = 3 * (size_t)d->who->begin; n < 3 * (size_t)d->who->end; ++n)
        d->p[n] = d->w[n] + beta * d->p[n];
    om_team_barrier(d->who->team);
}

static void keep(const Wide* d) {
    for (size_t n = 3 * (size_t)d->who->begin; n < 3 * (size_t)d->who->end; ++n)
        d->best[n] = d->S->xd[d->lanes * n + d->lane];
}

static void restore(const Wide* d) {
    for (size_t n = 3 * (size_t)d->who->begin; n < 3 * (size_t)d->who->end; ++n)
        d->S->xd[d->lanes * n + d->lane] = d->best[n];
}

OmCgEnd om__cg_double(OmSolver* S, const OmBsr* A, const OmRank* who, const OmLane* lane,
                      double goal, int max_iterations, int* iterations) {
    size_t n3 = 3 * (size_t)S->nvert;
    Wide d = {.S = S,
              .A = A,
              .who = who,
              .first = lane->first_chunk,
              .last = lane->last_chunk,
              .lanes = (size_t)lane->num,
              .lane = (size_t)lane->index,
              .p = (double*)S->vector,
              .w = (double*)S->vector + n3,
              .r = (double*)S->vector + 2 * n3,
              .best = (double*)S->vector + 3 * n3};
    double sum[3], min, target = goal * goal;
    om_team_barrier(who->team);  // the float vectors are not needed after this
    for (size_t n = 3 * (size_t)who->begin; n < 3 * (size_t)who->end; ++n) {
        d.r[n] = S->rd[d.lanes * n + d.lane];
        d.p[n] = d.w[n] = 0;
    }
    keep(&d);
    update(&d, 0, sum);  // z of the first residual
    next_direction(&d, 0);
    double rr = min = sum[0], gamma = sum[1];
    OmCgEnd end = OM_CG_DONE;
    *iterations = 0;
    while (rr > target && *iterations < max_iterations) {
        multiply(&d, sum);
        if (!isfinite(sum[0]) || !isfinite(gamma)) end = OM_CG_NOT_FINITE;
        if (sum[0] < -NEGATIVE * sqrt(sum[1] * sum[2])) end = OM_CG_INDEFINITE;
        if (end != OM_CG_DONE || gamma <= 0 || sum[0] <= 0) break;
        update(&d, gamma / sum[0], sum);
        ++*iterations;
        next_direction(&d, sum[1] / gamma);
        rr = sum[0];
        gamma = sum[1];
        if (rr < min) {
            min = rr;
            keep(&d);
        }
    }
    if (!(rr <= min)) restore(&d);
    return end;
}
