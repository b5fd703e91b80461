// solve_tie.c: ties, terms of a matrix between vertices that share no element.
//
// A tie is w_a w_b K for every two of its vertices. The ties of a matrix are summed in rows of blocks of their own,
// beside the fixed pattern. A product with the matrix adds these rows, chunk by chunk, so sums have the same order for
// any number of workers. On a coarse level a tie is the same K with the weights P^T w: coarse matrices see contact as
// the fine one does. Without them a correction moved both sides of a contact apart or into each other.
//
// The smoother needs an upper bound of the eigenvalues of D^-1 A. With n vertices x.T x <= n sum w_a^2 x_a.K x_a for
// one tie T, so D takes n / bound times the diagonal of each tie where n is above the bound of its level.
#include <math.h>
#include <string.h>

#include "solve/solve_multigrid.h"

#define LEAST_WEIGHT 1e-6f  // weights of a coarse tie that cancel
#define MAX_NODE 256        // nodes of a coarse tie; more are not merged

struct OmTies {
    int nvert;
    int ntie, nnode;
    int* tie_adr;   // first node of each tie                                   (ntie + 1)
    int* node;      //                                                          (nnode)
    float* weight;  // in x, y, z, and a zero                                   (nnode x 4)
    float* K;       // by columns                                               (ntie x 9)
    int nrow;       // vertices with ties
    int* row;       // ascending                                                (nrow)
    int* begin;     // first block of each row                                  (nrow)
    int* end;       // behind the last                                          (nrow)
    int* slot;      // row of a vertex, -1: none                                (nvert)
    int* col;       // vertex of each block; the first of a row is its diagonal
    float* value;   // blocks by columns                                        (x 9)
    float* diag;    // diagonal blocks for the smoother                         (nrow x 9)
    size_t max_tie, max_node, max_block;
};

// ---- memory -----------------------------------------------------------------------------------------

OmStatus om_ties_create(int nvert, OmTies** ties) {
    *ties = NULL;
    OM_CHECK(nvert >= 0, OM_INVALID, "om_ties_create: %d vertices", nvert);
    OmStatus status = OM_OK;
    OmTies* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->nvert = nvert;
    OM_ALLOC_DONE(t->slot, nvert);
    OM_ALLOC_DONE(t->row, nvert);
    OM_ALLOC_DONE(t->begin, nvert);
    OM_ALLOC_DONE(t->end, nvert);
    OM_ALLOC_DONE(t->diag, 9 * (size_t)nvert);
    OM_CALLOC_DONE(t->tie_adr, 1);
    for (int i = 0; i < nvert; ++i) t->slot[i] = -1;
    *ties = t;
    return OM_OK;
done:
    om_ties_destroy(t);
    return status;
}

void om_ties_destroy(OmTies* t) {
    if (!t) return;
    om_free(t->tie_adr);
    om_free(t->node);
    om_free(t->weight);
    om_free(t->K);
    om_free(t->row);
    om_free(t->begin);
    om_free(t->end);
    om_free(t->slot);
    om_free(t->col);
    om_free(t->value);
    om_free(t->diag);
    om_free(t);
}

int om_ties_count(const OmTies* t) { return t->ntie; }

// Room for a tie of `num` nodes.
static OmStatus grow(OmTies* t, size_t num) {
    size_t ntie = (size_t)t->ntie + 1, nnode = (size_t)t->nnode + num;
    if (ntie > t->max_tie) {
        size_t max = 2 * ntie + 64;
        int* adr = om_realloc(t->tie_adr, t->max_tie + 1, max + 1, sizeof *adr);
        if (!adr) return OM_NO_MEMORY;
        t->tie_adr = adr;
        float* K = om_realloc(t->K, 9 * t->max_tie, 9 * max, sizeof *K);
        if (!K) return OM_NO_MEMORY;
        t->K = K;
        t->max_tie = max;
    }
    if (nnode > t->max_node) {
        size_t max = 2 * nnode + 256;
        int* node = om_realloc(t->node, t->max_node, max, sizeof *node);
        if (!node) return OM_NO_MEMORY;
        t->node = node;
        float* weight = om_realloc(t->weight, 4 * t->max_node, 4 * max, sizeof *weight);
        if (!weight) return OM_NO_MEMORY;
        t->weight = weight;
        t->max_node = max;
    }
    return OM_OK;
}

// ---- filling ----------------------------------------------------------------------------------------

void om_ties_clear(OmTies* t) {
    for (int r = 0; r < t->nrow; ++r) t->slot[t->row[r]] = -1;
    t->ntie = t->nnode = t->nrow = 0;
}

OmStatus om_ties_add(OmTies* t, int num, const int* vert, const double* weight, OmMat3 K) {
    OM_CHECK(num >= 1 && num <= MAX_NODE, OM_INVALID, "om_ties_add: %d vertices", num);
    for (int a = 0; a < num; ++a)
        OM_CHECK(vert[a] >= 0 && vert[a] < t->nvert, OM_INVALID,
                 "om_ties_add: vertex %d is not one of the matrix's %d", vert[a], t->nvert);
    OM_TRY(grow(t, (size_t)num));
    for (int a = 0; a < num; ++a) {
        if (weight[a] == 0) continue;
        t->node[t->nnode] = vert[a];
        for (size_t c = 0; c < 3; ++c) t->weight[4 * (size_t)t->nnode + c] = (float)weight[a];
        t->weight[4 * (size_t)t->nnode + 3] = 0;
        ++t->nnode;
    }
    const double e[9] = {K.cx.x, K.cx.y, K.cx.z, K.cy.x, K.cy.y, K.cy.z, K.cz.x, K.cz.y, K.cz.z};
    for (size_t n = 0; n < 9; ++n) t->K[9 * (size_t)t->ntie + n] = (float)e[n];
    t->tie_adr[++t->ntie] = t->nnode;
    return OM_OK;
}

// Rows in ascending order, with room for the blocks of every tie.
static OmStatus make_rows(OmTies* t) {
    for (int r = 0; r < t->nrow; ++r) t->slot[t->row[r]] = -1;
    t->nrow = 0;
    for (int n = 0; n < t->nnode; ++n) {
        int i = t->node[n];
        if (t->slot[i] >= 0) continue;
        t->slot[i] = 0;
        t->row[t->nrow++] = i;
    }
    om_sort_ints(t->row, t->nrow);
    for (int r = 0; r < t->nrow; ++r) {
        t->slot[t->row[r]] = r;
        t->end[r] = 1;  // the diagonal
    }
    for (int k = 0; k < t->ntie; ++k)
        for (int a = t->tie_adr[k]; a < t->tie_adr[k + 1]; ++a)
            t->end[t->slot[t->node[a]]] += t->tie_adr[k + 1] - t->tie_adr[k] - 1;
    size_t nblock = 0;
    for (int r = 0; r < t->nrow; ++r) {
        t->begin[r] = (int)nblock;
        nblock += (size_t)t->end[r];
        OM_CHECK(nblock < INT32_MAX / 16, OM_INVALID, "solve: too many ties");
        t->end[r] = t->begin[r] + 1;
    }
    if (nblock > t->max_block) {
        size_t max = nblock + nblock / 2;
        int* col = om_realloc(t->col, t->max_block, max, sizeof *col);
        if (!col) return OM_NO_MEMORY;
        t->col = col;
        float* value = om_realloc(t->value, 9 * t->max_block, 9 * max, sizeof *value);
        if (!value) return OM_NO_MEMORY;
        t->value = value;
        t->max_block = max;
    }
    for (int r = 0; r < t->nrow; ++r) {
        t->col[t->begin[r]] = t->row[r];
        memset(t->value + 9 * (size_t)t->begin[r], 0, 9 * sizeof(float));
    }
    return OM_OK;
}

// Block of column j in row r, made if it is not there.
static float* block_of(OmTies* t, int r, int j) {
    for (int k = t->begin[r]; k < t->end[r]; ++k)
        if (t->col[k] == j) return t->value + 9 * (size_t)k;
    int k = t->end[r]++;
    t->col[k] = j;
    return memset(t->value + 9 * (size_t)k, 0, 9 * sizeof(float));
}

OmStatus om__ties_sum(OmTies* t, double bound) {
    OM_TRY(make_rows(t));
    memset(t->diag, 0, 9 * (size_t)t->nrow * sizeof *t->diag);
    for (int k = 0; k < t->ntie; ++k) {
        const float* K = t->K + 9 * (size_t)k;
        int num = t->tie_adr[k + 1] - t->tie_adr[k];
        float raise = num > bound ? (float)(num / bound) : 1.0f;
        for (int a = t->tie_adr[k]; a < t->tie_adr[k + 1]; ++a) {
            int r = t->slot[t->node[a]];
            const float* wa = t->weight + 4 * (size_t)a;
            for (int b = t->tie_adr[k]; b < t->tie_adr[k + 1]; ++b) {
                const float* wb = t->weight + 4 * (size_t)b;
                float* v = block_of(t, r, t->node[b]);
                for (int c = 0; c < 3; ++c)
                    for (int q = 0; q < 3; ++q) v[3 * c + q] += wa[q] * K[3 * c + q] * wb[c];
            }
            float* d = t->diag + 9 * (size_t)r;
            for (int c = 0; c < 3; ++c)
                for (int q = 0; q < 3; ++q) d[3 * c + q] += raise * wa[q] * K[3 * c + q] * wa[c];
        }
    }
    return OM_OK;
}

OmStatus om_ties_sum(OmTies* t) { return om__ties_sum(t, 4); }

OmStatus om__ties_coarsen(const OmTies* fine, const OmInterp* P, OmTies* coarse) {
    om_ties_clear(coarse);
    for (int k = 0; k < fine->ntie; ++k) {
        size_t room = 0;
        for (int a = fine->tie_adr[k]; a < fine->tie_adr[k + 1]; ++a)
            room += (size_t)(P->adr[fine->node[a] + 1] - P->adr[fine->node[a]]);
        OM_TRY(grow(coarse, room));
        int first = coarse->nnode;
        for (int a = fine->tie_adr[k]; a < fine->tie_adr[k + 1]; ++a) {
            const float* wa = fine->weight + 4 * (size_t)a;
            for (int e = P->adr[fine->node[a]]; e < P->adr[fine->node[a] + 1]; ++e) {
                int n = first;
                while (n < coarse->nnode && coarse->node[n] != P->col[e]) ++n;
                float* w = coarse->weight + 4 * (size_t)n;
                if (n == coarse->nnode) {
                    coarse->node[coarse->nnode++] = P->col[e];
                    memset(w, 0, 4 * sizeof *w);
                }
                for (size_t c = 0; c < 3; ++c) w[c] += wa[c] * P->weight[4 * (size_t)e + c];
            }
        }
        int num = first;  // nodes of both sides may cancel
        for (int n = first; n < coarse->nnode; ++n) {
            const float* w = coarse->weight + 4 * (size_t)n;
            if (fabsf(w[0]) + fabsf(w[1]) + fabsf(w[2]) < LEAST_WEIGHT) continue;
            coarse->node[num] = coarse->node[n];
            memmove(coarse->weight + 4 * (size_t)num++, w, 4 * sizeof *w);
        }
        coarse->nnode = num;
        if (num == first) continue;
        memcpy(coarse->K + 9 * (size_t)coarse->ntie, fine->K + 9 * (size_t)k, 9 * sizeof(float));
        coarse->tie_adr[++coarse->ntie] = num;
    }
    return OM_OK;
}

// ---- products ---------------------------------------------------------------------------------------

// First row of t at vertex i or behind it.
static int first_row(const OmTies* t, int i) {
    int lo = 0, hi = t->nrow;
    while (lo < hi) {
        int mid = lo + (hi - lo) / 2;
        if (t->row[mid] < i)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

// y = row r times the vectors of one lane; a vector has `width` floats a vertex, the directions `step` apart.
static void tie_product(const OmTies* t, int r, const float* x, size_t width, size_t step,
                        float y[3]) {
    y[0] = y[1] = y[2] = 0;
    for (int k = t->begin[r]; k < t->end[r]; ++k) {
        const float *v = t->value + 9 * (size_t)k, *xj = x + width * (size_t)t->col[k];
        for (size_t q = 0; q < 3; ++q)
            y[q] += v[q] * xj[0] + v[3 + q] * xj[step] + v[6 + q] * xj[2 * step];
    }
}

void om__ties_multiply(const OmTies* t, const OmKernels* K, const OmSolver* S, int begin, int end,
                       double* sums) {
    size_t lanes = (size_t)K->lanes, width = (size_t)K->width;
    for (int r = first_row(t, begin); r < t->nrow && t->row[r] < end; ++r)
        for (size_t q = 0; q < lanes; ++q) {
            float y[3];
            tie_product(t, r, S->u + q, width, lanes, y);
            for (size_t c = 0; c < 3; ++c) {
                size_t at = width * (size_t)t->row[r] + lanes * c + q;
                S->w[at] += y[c];
                sums[lanes + q] += (double)(S->u[at] * y[c]);
            }
        }
}

void om__ties_smooth(const OmTies* t, const OmKernels* K, const float* dinv, const OmSmooth* s,
                     int begin, int end) {
    size_t lanes = (size_t)K->lanes, width = (size_t)K->width;
    for (int r = first_row(t, begin); r < t->nrow && t->row[r] < end; ++r) {
        const float* D = dinv + 9 * (size_t)t->row[r];
        for (size_t q = 0; q < lanes; ++q) {
            float y[3];
            tie_product(t, r, s->d + q, width, lanes, y);
            for (size_t c = 0; c < 3; ++c) {
                size_t at = width * (size_t)t->row[r] + lanes * c + q;
                s->r_out[at] -= y[c];
                if (!s->d_out) continue;
                float d = s->c2 * (D[c] * y[0] + D[3 + c] * y[1] + D[6 + c] * y[2]);
                s->d_out[at] -= d;
                s->x[at] -= d;
            }
        }
    }
}

// y -= row r times x, of `lanes` vectors in double.
static void subtract_row(const OmTies* t, int r, const double* x, size_t lanes, size_t lane,
                         double y[3]) {
    for (int k = t->begin[r]; k < t->end[r]; ++k) {
        const float* v = t->value + 9 * (size_t)k;
        size_t j = lanes * 3 * (size_t)t->col[k] + lane;
        for (size_t q = 0; q < 3; ++q)
            y[q] -= (double)v[q] * x[j] + (double)v[3 + q] * x[j + lanes] +
                    (double)v[6 + q] * x[j + 2 * lanes];
    }
}

void om__ties_residual(const OmTies* t, OmSolver* S, int lanes, int chunk, double* rr) {
    int begin = S->chunks.begin[chunk], end = S->chunks.begin[chunk + 1];
    int r = first_row(t, begin);
    size_t L = (size_t)lanes;
    if (r == t->nrow || t->row[r] >= end) return;
    for (; r < t->nrow && t->row[r] < end; ++r)
        for (size_t q = 0; q < L; ++q) {
            double y[3] = {0, 0, 0};
            subtract_row(t, r, S->xd, L, q, y);
            for (size_t c = 0; c < 3; ++c) S->rd[L * (3 * (size_t)t->row[r] + c) + q] += y[c];
        }
    om__clear_fixed(S, lanes, chunk);
    for (size_t q = 0; q < L; ++q) {
        rr[q] = 0;
        for (size_t n = 3 * (size_t)begin; n < 3 * (size_t)end; ++n)
            rr[q] += S->rd[L * n + q] * S->rd[L * n + q];
    }
}

void om__ties_add_rows(const OmTies* t, const double* x, double* y, int begin, int end) {
    for (int r = first_row(t, begin); r < t->nrow && t->row[r] < end; ++r) {
        double sum[3] = {0, 0, 0};
        subtract_row(t, r, x, 1, 0, sum);
        for (size_t c = 0; c < 3; ++c) y[3 * (size_t)t->row[r] + c] -= sum[c];
    }
}

void om_ties_apply_row(const OmTies* t, const double* x, int i, OmVec3* y) {
    if (t->slot[i] < 0) return;
    double sum[3] = {0, 0, 0};
    subtract_row(t, t->slot[i], x, 1, 0, sum);
    *y = om_sub(*y, om_vec3(sum[0], sum[1], sum[2]));
}

const float* om__ties_diagonal(const OmTies* t, int i) {
    return t->slot[i] < 0 ? NULL : t->diag + 9 * (size_t)t->slot[i];
}

void om__ties_add_dense(const OmTies* t, int n, double* dense) {
    for (int r = 0; r < t->nrow; ++r)
        for (int k = t->begin[r]; k < t->end[r]; ++k)
            for (size_t q = 0; q < 3; ++q)
                for (size_t c = 0; c < 3; ++c)
                    dense[(3 * (size_t)t->row[r] + q) * (size_t)n + 3 * (size_t)t->col[k] + c] +=
                        (double)t->value[9 * (size_t)k + 3 * c + q];
}

size_t om_ties_memory(const OmTies* t) {
    return sizeof *t + (size_t)t->nvert * (4 * sizeof(int) + 9 * sizeof(float)) +
           t->max_tie * (sizeof(int) + 9 * sizeof(float)) +
           t->max_node * (sizeof(int) + 4 * sizeof(float)) +
           t->max_block * (sizeof(int) + 9 * sizeof(float));
}
