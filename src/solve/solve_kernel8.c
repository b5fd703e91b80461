// solve_kernel8.c: the loops of solve_kernel.c for eight right-hand sides at once.
//
// A vertex is three rows of eight lanes. Each of the nine values of a block is broadcast and multiplies a
// row, into nine independent sums: a block costs about twice that of one right-hand side, and the matrix
// is read once for eight.
#include "solve/solve_multigrid.h"
#include "solve/solve_simd.h"

#define W 24  // floats a vertex

typedef double D8u __attribute__((vector_size(64), aligned(8), may_alias));

typedef struct Lanes {  // x, y, z of eight right-hand sides
    V8 x, y, z;
} Lanes;

static inline Lanes load_lanes(const float* p) {
    return (Lanes){load8(p), load8(p + 8), load8(p + 16)};
}
static inline void store_lanes(float* p, Lanes v) {
    store8(p, v.x);
    store8(p + 8, v.y);
    store8(p + 16, v.z);
}
static inline Lanes add_lanes(Lanes a, Lanes b) { return (Lanes){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline Lanes subtract_lanes(Lanes a, Lanes b) {
    return (Lanes){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline Lanes scale_lanes(V8 s, Lanes a) { return (Lanes){s * a.x, s * a.y, s * a.z}; }
static inline V8 dot_lanes(Lanes a, Lanes b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Nine sums, one for each entry of a block.
typedef struct Sums {
    Lanes c0, c1, c2;
} Sums;

static inline void add_block8(const float* v, const float* x, Sums* s) {
    V8 x0 = load8(x), x1 = load8(x + 8), x2 = load8(x + 16);
    s->c0.x += splat8(v[0]) * x0;
    s->c0.y += splat8(v[1]) * x0;
    s->c0.z += splat8(v[2]) * x0;
    s->c1.x += splat8(v[3]) * x1;
    s->c1.y += splat8(v[4]) * x1;
    s->c1.z += splat8(v[5]) * x1;
    s->c2.x += splat8(v[6]) * x2;
    s->c2.y += splat8(v[7]) * x2;
    s->c2.z += splat8(v[8]) * x2;
}

static inline Lanes row_product8(const OmBsr* A, int i, const float* x) {
    Sums s = {{{0}, {0}, {0}}, {{0}, {0}, {0}}, {{0}, {0}, {0}}};
    const int* col = A->col;
    const float* value = A->value;
    for (int k = A->row_adr[i], end = A->row_adr[i + 1]; k < end; ++k)
        add_block8(value + 9 * (size_t)k, x + W * (size_t)col[k], &s);
    return add_lanes(add_lanes(s.c0, s.c1), s.c2);
}

static inline Lanes block_product8(const float* v, const float* x) {
    Sums s = {{{0}, {0}, {0}}, {{0}, {0}, {0}}, {{0}, {0}, {0}}};
    add_block8(v, x, &s);
    return add_lanes(add_lanes(s.c0, s.c1), s.c2);
}

static inline void put_sums(double* out, V8 sum) {
    for (int q = 0; q < 8; ++q) out[q] = (double)sum[q];
}

// ---- CG ---------------------------------------------------------------------------------------------

OM_MULTIVERSION
static void multiply(const OmBsr* A, const OmSolver* S, int begin, int end, double* sums) {
    const float *r = S->r, *u = S->u;
    float* w = S->w;
    V8 ru = splat8(0), uw = ru;
    for (int i = begin; i < end; ++i) {
        size_t at = W * (size_t)i;
        Lanes wi = row_product8(A, i, u), ui = load_lanes(u + at);
        store_lanes(w + at, wi);
        uw += dot_lanes(ui, wi);
        ru += dot_lanes(load_lanes(r + at), ui);
    }
    put_sums(sums, ru);
    put_sums(sums + 8, uw);
}

OM_MULTIVERSION
static void update(OmSolver* S, const float* alpha, const float* beta, bool with_blocks, int begin,
                   int end, double* rr) {
    V8 va = load8(alpha), vb = load8(beta), sum = splat8(0);
    float *x = S->x, *r = S->r, *p = S->p, *s = S->s, *u = S->u;
    const float *w = S->w, *dinv = S->dinv;
    for (int i = begin; i < end; ++i) {
        size_t at = W * (size_t)i;
        Lanes pi = add_lanes(load_lanes(u + at), scale_lanes(vb, load_lanes(p + at)));
        Lanes si = add_lanes(load_lanes(w + at), scale_lanes(vb, load_lanes(s + at)));
        Lanes ri = subtract_lanes(load_lanes(r + at), scale_lanes(va, si));
        store_lanes(p + at, pi);
        store_lanes(s + at, si);
        store_lanes(x + at, add_lanes(load_lanes(x + at), scale_lanes(va, pi)));
        store_lanes(r + at, ri);
        if (with_blocks) store_lanes(u + at, block_product8(dinv + 9 * (size_t)i, r + at));
        sum += dot_lanes(ri, ri);
    }
    put_sums(rr, sum);
}

OM_MULTIVERSION
static void apply_blocks(const float* dinv, const float* r, float* u, int begin, int end) {
    for (int i = begin; i < end; ++i)
        store_lanes(u + W * (size_t)i, block_product8(dinv + 9 * (size_t)i, r + W * (size_t)i));
}

OM_MULTIVERSION
static void subtract_product8(const OmBsr* A, const double* x, double* r, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        D8 sum[3] = {{0}, {0}, {0}};
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
            const float* v = A->value + 9 * (size_t)k;
            const double* xj = x + W * (size_t)A->col[k];
            for (int c = 0; c < 3; ++c) {
                D8 xc = (D8)(*(const D8u*)(xj + 8 * c));
                for (int d = 0; d < 3; ++d) sum[d] += (double)v[3 * c + d] * xc;
            }
        }
        for (int d = 0; d < 3; ++d) {
            double* out = r + W * (size_t)i + 8 * d;
            *(D8u*)out = (D8u)((D8)(*(const D8u*)out) - sum[d]);
        }
    }
}

static void residual(OmSolver* S, const OmBsr* A, const double* b, int nrhs, int chunk,
                     double* rr) {
    int begin = S->chunks.begin[chunk], end = S->chunks.begin[chunk + 1];
    size_t stride = 3 * (size_t)S->nvert;
    for (size_t n = 3 * (size_t)begin; n < 3 * (size_t)end; ++n)
        for (size_t q = 0; q < 8; ++q) S->rd[8 * n + q] = q < (size_t)nrhs ? b[stride * q + n] : 0;
    if (A) subtract_product8(A, S->xd, S->rd, begin, end);
    om__clear_fixed(S, 8, chunk);
    for (size_t q = 0; q < 8; ++q) rr[q] = 0;
    for (size_t n = 3 * (size_t)begin; n < 3 * (size_t)end; ++n)
        for (size_t q = 0; q < 8; ++q) rr[q] += S->rd[8 * n + q] * S->rd[8 * n + q];
}

// ---- multigrid --------------------------------------------------------------------------------------

OM_MULTIVERSION
static void smooth(const OmBsr* A, const float* dinv, const OmSmooth* s, int begin, int end) {
    const float* d = s->d;
    V8 c1 = splat8(s->c1), c2 = splat8(s->c2);
    for (int i = begin; i < end; ++i) {
        size_t at = W * (size_t)i;
        store_lanes(s->r_out + at, subtract_lanes(load_lanes(s->r + at), row_product8(A, i, d)));
        if (!s->d_out) continue;
        Lanes z = block_product8(dinv + 9 * (size_t)i, s->r_out + at);
        Lanes dn = add_lanes(scale_lanes(c1, load_lanes(d + at)), scale_lanes(c2, z));
        store_lanes(s->d_out + at, dn);
        store_lanes(s->x + at, add_lanes(load_lanes(s->x + at), dn));
    }
}

OM_MULTIVERSION
static void smooth_first(const float* dinv, const OmSmooth* s, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        size_t at = W * (size_t)i;
        Lanes dn = scale_lanes(splat8(s->c2), block_product8(dinv + 9 * (size_t)i, s->r + at));
        store_lanes(s->d_out + at, dn);
        store_lanes(s->x + at, dn);
    }
}

static inline Lanes weigh(const float* w, Lanes v) {
    return (Lanes){splat8(w[0]) * v.x, splat8(w[1]) * v.y, splat8(w[2]) * v.z};
}

OM_MULTIVERSION
static void restrict_rows(const OmInterp* P, const float* r, float* b, int begin, int end) {
    for (int c = begin; c < end; ++c) {
        Lanes sum = {{0}, {0}, {0}};
        for (int t = P->t_adr[c]; t < P->t_adr[c + 1]; ++t)
            sum = add_lanes(sum, weigh(P->weight + 4 * (size_t)P->t_entry[t],
                                       load_lanes(r + W * (size_t)P->t_row[t])));
        store_lanes(b + W * (size_t)c, sum);
    }
}

OM_MULTIVERSION
static void prolong_rows(const OmInterp* P, const float* xc, float* d, float* x, int begin,
                         int end) {
    for (int i = begin; i < end; ++i) {
        size_t at = W * (size_t)i;
        Lanes sum = {{0}, {0}, {0}};
        for (int e = P->adr[i]; e < P->adr[i + 1]; ++e)
            sum = add_lanes(
                sum, weigh(P->weight + 4 * (size_t)e, load_lanes(xc + W * (size_t)P->col[e])));
        store_lanes(d + at, sum);
        store_lanes(x + at, add_lanes(load_lanes(x + at), sum));
    }
}

OM_MULTIVERSION
static void dense_solve(OmDense* dense, const float* b, float* x) {
    int n = dense->n;
    float* y = dense->y;
    for (int k = 0; k < n; ++k) store8(y + 8 * (size_t)k, splat8(0));
    for (int k = 0; k < n; ++k) {
        const float* row = dense->apply + (size_t)k * (size_t)n;
        V8 sum = splat8(0);
        for (int j = 0; j <= k; ++j) sum += splat8(row[j]) * load8(b + 8 * (size_t)j);
        for (int j = 0; j <= k; ++j)
            store8(y + 8 * (size_t)j, load8(y + 8 * (size_t)j) + splat8(row[j]) * sum);
    }
    for (int k = 0; k < n; ++k) store8(x + 8 * (size_t)k, load8(y + 8 * (size_t)k));
}

const OmKernels om__kernels_eight = {.lanes = 8,
                                     .width = W,
                                     .multiply = multiply,
                                     .update = update,
                                     .apply_blocks = apply_blocks,
                                     .residual = residual,
                                     .smooth = smooth,
                                     .smooth_first = smooth_first,
                                     .restrict_rows = restrict_rows,
                                     .prolong_rows = prolong_rows,
                                     .dense_solve = dense_solve};
