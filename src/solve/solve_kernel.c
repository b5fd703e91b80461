// solve_kernel.c: the hot loops of an iterative solve, for one right-hand side.
//
// Rows are processed one by one with a vertex in four lanes (solve_simd.h): no gathers, and a block of the
// matrix has 36 bytes. Tried: a whole block in one 64-byte register, the same speed; gathers for several
// rows at once, slower. Sums are float over a chunk of rows: keep chunks short.
#include <string.h>

#include "solve/solve_multigrid.h"
#include "solve/solve_simd.h"

OM_MULTIVERSION
static void multiply(const OmBsr* A, const OmSolver* S, int begin, int end, double* sums) {
    const float *r = S->r, *u = S->u;
    float* w = S->w;
    V4 ru = splat4(0), uw = splat4(0);
    for (int i = begin; i < end; ++i) {
        int k = A->row_adr[i];
        size_t i4 = 4 * (size_t)i;
        V4 wi = row_product(A->value + 9 * (size_t)k, A->col + k, A->row_adr[i + 1] - k, u);
        V4 ui = load4(u + i4);
        store4(w + i4, wi);
        uw += ui * wi;
        ru += load4(r + i4) * ui;
    }
    sums[0] = (double)sum4(ru);
    sums[1] = (double)sum4(uw);
}

OM_MULTIVERSION
static void update(OmSolver* S, const float* alpha, const float* beta, bool with_blocks, int begin,
                   int end, double* rr) {
    V4 va = splat4(*alpha), vb = splat4(*beta), sum = splat4(0);
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
        if (with_blocks) store4(u + i4, block_product(dinv + 9 * (size_t)i, ri));
        sum += ri * ri;
    }
    *rr = (double)sum4(sum);
}

OM_MULTIVERSION
static void apply_blocks(const float* dinv, const float* r, float* u, int begin, int end) {
    for (int i = begin; i < end; ++i)
        store4(u + 4 * (size_t)i, block_product(dinv + 9 * (size_t)i, vertex(r, i)));
}

OM_MULTIVERSION
static void smooth(const OmBsr* A, const float* dinv, const OmSmooth* s, int begin, int end) {
    const float* d = s->d;
    V4 c1 = splat4(s->c1), c2 = splat4(s->c2);
    for (int i = begin; i < end; ++i) {
        int k = A->row_adr[i];
        size_t i4 = 4 * (size_t)i;
        V4 Ad = row_product(A->value + 9 * (size_t)k, A->col + k, A->row_adr[i + 1] - k, d);
        V4 r = load4(s->r + i4) - Ad;
        store4(s->r_out + i4, r);
        if (!s->d_out) continue;
        V4 dn = c1 * load4(d + i4) + c2 * block_product(dinv + 9 * (size_t)i, r);
        store4(s->d_out + i4, dn);
        store4(s->x + i4, load4(s->x + i4) + dn);
    }
}

OM_MULTIVERSION
static void smooth_first(const float* dinv, const OmSmooth* s, int begin, int end) {
    V4 c2 = splat4(s->c2);
    for (int i = begin; i < end; ++i) {
        size_t i4 = 4 * (size_t)i;
        V4 dn = c2 * block_product(dinv + 9 * (size_t)i, load4(s->r + i4));
        store4(s->d_out + i4, dn);
        store4(s->x + i4, dn);
    }
}

OM_MULTIVERSION
static void subtract_product(const OmBsr* A, const double* x, double* r, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        om_store3(r, i, om_sub(om_load3(r, i), om__row_product(A, x, i)));
    }
}

void om__clear_fixed(OmSolver* S, int lanes, int chunk) {
    for (int m = S->chunk_fixed[chunk]; m < S->chunk_fixed[chunk + 1]; ++m)
        for (size_t c = 3 * (size_t)S->fixed_vert[m]; c < 3 * (size_t)S->fixed_vert[m] + 3; ++c)
            for (size_t q = 0; q < (size_t)lanes && S->fixed[c]; ++q)
                S->rd[c * (size_t)lanes + q] = 0.0;
}

static void residual(OmSolver* S, const OmBsr* A, const double* b, int nrhs, int chunk,
                     double* rr) {
    (void)nrhs;
    int begin = S->chunks.begin[chunk], end = S->chunks.begin[chunk + 1];
    for (size_t n = 3 * (size_t)begin; n < 3 * (size_t)end; ++n) S->rd[n] = b[n];
    if (A) subtract_product(A, S->xd, S->rd, begin, end);
    om__clear_fixed(S, 1, chunk);
    *rr = 0;
    for (size_t n = 3 * (size_t)begin; n < 3 * (size_t)end; ++n) *rr += S->rd[n] * S->rd[n];
}

// ---- coarse levels ----------------------------------------------------------------------------------

OM_MULTIVERSION
static void restrict_rows(const OmInterp* P, const float* r, float* b, int begin, int end) {
    for (int c = begin; c < end; ++c) {
        V4 sum = splat4(0);
        for (int t = P->t_adr[c]; t < P->t_adr[c + 1]; ++t)
            sum +=
                load4(P->weight + 4 * (size_t)P->t_entry[t]) * load4(r + 4 * (size_t)P->t_row[t]);
        store4(b + 4 * (size_t)c, sum);
    }
}

OM_MULTIVERSION
static void prolong_rows(const OmInterp* P, const float* xc, float* d, float* x, int begin,
                         int end) {
    for (int i = begin; i < end; ++i) {
        V4 sum = splat4(0);
        for (int e = P->adr[i]; e < P->adr[i + 1]; ++e)
            sum += load4(P->weight + 4 * (size_t)e) * load4(xc + 4 * (size_t)P->col[e]);
        store4(d + 4 * (size_t)i, sum);
        store4(x + 4 * (size_t)i, load4(x + 4 * (size_t)i) + sum);
    }
}

OM_MULTIVERSION
static float dot_row(const float* restrict a, const float* restrict b, int n) {
    float lane[16] = {0}, sum = 0;
    int k = 0;
    for (; k + 16 <= n; k += 16)
        for (int m = 0; m < 16; ++m) lane[m] += a[k + m] * b[k + m];
    for (int m = 0; k + m < n; ++m) lane[m] += a[k + m] * b[k + m];
    for (int m = 0; m < 16; ++m) sum += lane[m];
    return sum;
}

OM_MULTIVERSION
static void add_row(float* restrict a, const float* restrict b, float s, int n) {
    for (int k = 0; k < n; ++k) a[k] += s * b[k];
}

static void dense_solve(OmDense* dense, const float* b, float* x) {
    int n = dense->n;
    float *y = dense->y, *packed = dense->y + n;
    for (int k = 0; k < n; ++k) packed[k] = b[4 * (k / 3) + k % 3];
    memset(y, 0, (size_t)n * sizeof(float));
    for (int k = 0; k < n; ++k) {
        const float* row = dense->apply + (size_t)k * (size_t)n;
        add_row(y, row, dot_row(row, packed, k + 1), k + 1);
    }
    for (int k = 0; k < n; ++k) x[4 * (k / 3) + k % 3] = y[k];
}

const OmKernels om__kernels_one = {.lanes = 1,
                                   .width = 4,
                                   .multiply = multiply,
                                   .update = update,
                                   .apply_blocks = apply_blocks,
                                   .residual = residual,
                                   .smooth = smooth,
                                   .smooth_first = smooth_first,
                                   .restrict_rows = restrict_rows,
                                   .prolong_rows = prolong_rows,
                                   .dense_solve = dense_solve};
