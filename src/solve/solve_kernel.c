// solve_kernel.c: the loops where the time of an iterative solve goes.
//
// Rows are walked one by one with a vertex in four lanes (solve_simd.h): no gathers, and the matrix keeps
// its 36 bytes a block. Tried: a whole block in one 64-byte register, the same speed; gathers for rows side
// by side, slower. Sums are float over a chunk of rows: keep chunks short.
#include "solve/solve_internal.h"
#include "solve/solve_simd.h"

OM_MULTIVERSION
OmCgSums om__cg_multiply(const OmBsr* A, const float* r, const float* u, float* w, int begin,
                         int end) {
    V4 ru = splat(0), uw = splat(0);
    for (int i = begin; i < end; ++i) {
        int k = A->row_adr[i];
        size_t i4 = 4 * (size_t)i;
        V4 wi = row_product(A->value + 9 * (size_t)k, A->col + k, A->row_adr[i + 1] - k, u);
        V4 ui = load4(u + i4);
        store4(w + i4, wi);
        uw += ui * wi;
        ru += load4(r + i4) * ui;
    }
    return (OmCgSums){(double)sum4(ru), (double)sum4(uw)};
}

OM_MULTIVERSION
double om__cg_update(OmSolver* S, float alpha, float beta, bool apply_blocks, int begin, int end) {
    V4 va = splat(alpha), vb = splat(beta), sum = splat(0);
    float *x = S->x, *r = S->r, *p = S->p, *s = S->s, *u = S->u;
    const float *w = S->w, *dinv = S->dinv;
    for (int i = begin; i < end; ++i) {
        size_t i4 = 4 * (size_t)i;
        V4 pi = load4(u + i4) + vb * load4(p + i4);
        V4 si = load4(w + i4) + vb * load4(s + i4);
        V4 ri = load4(r + i4) - va * si;
        store4(p + i4, pi);
        store4(s + i4, si);
        store4(x + i4, load4(x + i4) + va * pi);
        store4(r + i4, ri);
        if (apply_blocks) store4(u + i4, block_product(dinv + 9 * (size_t)i, r + i4));
        sum += ri * ri;
    }
    return (double)sum4(sum);
}

OM_MULTIVERSION
void om__apply_blocks(const float* dinv, const float* r, float* u, int begin, int end) {
    for (int i = begin; i < end; ++i)
        store4(u + 4 * (size_t)i, block_product(dinv + 9 * (size_t)i, r + 4 * (size_t)i));
}

OM_MULTIVERSION
void om__smooth(const OmBsr* A, const float* dinv, const OmSmooth* s, int begin, int end) {
    const float* d = s->d;
    V4 c1 = splat(s->c1), c2 = splat(s->c2);
    for (int i = begin; i < end; ++i) {
        int k = A->row_adr[i];
        size_t i4 = 4 * (size_t)i;
        V4 Ad = row_product(A->value + 9 * (size_t)k, A->col + k, A->row_adr[i + 1] - k, d);
        store4(s->r_out + i4, load4(s->r + i4) - Ad);
        if (!s->d_out) continue;
        V4 dn = c1 * load4(d + i4) + c2 * block_product(dinv + 9 * (size_t)i, s->r_out + i4);
        store4(s->d_out + i4, dn);
        store4(s->x + i4, load4(s->x + i4) + dn);
    }
}

OM_MULTIVERSION
void om__smooth_first(const float* dinv, const OmSmooth* s, int begin, int end) {
    V4 c2 = splat(s->c2);
    for (int i = begin; i < end; ++i) {
        size_t i4 = 4 * (size_t)i;
        V4 dn = c2 * block_product(dinv + 9 * (size_t)i, s->r + i4);
        store4(s->d_out + i4, dn);
        store4(s->x + i4, dn);
    }
}

OM_MULTIVERSION
static void subtract_product(const OmBsr* A, const double* x, double* r, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        double y0 = 0, y1 = 0, y2 = 0;
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
            const float* v = A->value + 9 * (size_t)k;
            const double* xj = x + 3 * (size_t)A->col[k];
            y0 += (double)v[0] * xj[0] + (double)v[3] * xj[1] + (double)v[6] * xj[2];
            y1 += (double)v[1] * xj[0] + (double)v[4] * xj[1] + (double)v[7] * xj[2];
            y2 += (double)v[2] * xj[0] + (double)v[5] * xj[1] + (double)v[8] * xj[2];
        }
        r[3 * (size_t)i] -= y0;
        r[3 * (size_t)i + 1] -= y1;
        r[3 * (size_t)i + 2] -= y2;
    }
}

double om__residual(OmSolver* S, const OmBsr* A, const double* b, int begin, int end, int chunk) {
    for (size_t n = 3 * (size_t)begin; n < 3 * (size_t)end; ++n) S->rd[n] = b[n];
    if (A) subtract_product(A, S->xd, S->rd, begin, end);
    for (int m = S->chunk_fixed[chunk]; m < S->chunk_fixed[chunk + 1]; ++m) {
        size_t i = 3 * (size_t)S->fixed_vert[m];
        for (size_t c = i; c < i + 3; ++c) S->rd[c] = S->fixed[c] ? 0.0 : S->rd[c];
    }
    double sum = 0;
    for (size_t n = 3 * (size_t)begin; n < 3 * (size_t)end; ++n) sum += S->rd[n] * S->rd[n];
    return sum;
}
