// solve_galerkin.c: coarse matrices P^T A P, pattern once and values at every refresh.
//
// Values: row i of A P is gathered in a scratch row of padded blocks, then scattered to the coarse rows of
// vertex i by addresses that were computed at creation. The rows of one layer of grid cells belong to one
// task. Layers of equal parity write to different coarse rows, so two sweeps (even, odd) need neither
// atomics nor copies, and sums have the same order for any number of workers. Sums are computed in blocks
// padded to three aligned columns and packed at the end: adding to packed blocks made every load wait for
// the overlapping stores before it (five times slower).
#include <string.h>

#include "solve/solve_multigrid.h"
#include "solve/solve_simd.h"

// ---- pattern ----------------------------------------------------------------------------------------

typedef struct Product {  // columns of A P, needed only while the patterns are made
    int* adr;             // (nfine + 1)
    int* col;
    int* mark;  // slot of a coarse node in the current row, or position in a coarse row (ncoarse)
    int* seen;  // the row that wrote the mark                                          (ncoarse)
} Product;

// Columns of row i of A P in the order they are met. Writes them and the slots if there is room.
static int walk_row(const OmBsr* A, const OmInterp* P, Product* ap, int i, int* col,
                    uint16_t* slot) {
    int num = 0, m = 0;
    for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
        for (int e = P->adr[A->col[k]]; e < P->adr[A->col[k] + 1]; ++e, ++m) {
            int c = P->col[e];
            if (ap->seen[c] != i) {
                ap->seen[c] = i;
                ap->mark[c] = num;
                if (col) col[num] = c;
                ++num;
            }
            if (slot) slot[m] = (uint16_t)ap->mark[c];
        }
    }
    return num;
}

static void forget(Product* ap, int ncoarse) {
    for (int c = 0; c < ncoarse; ++c) ap->seen[c] = -1;
}

static OmStatus make_product(const OmBsr* A, const OmInterp* P, OmGalerkin* G, Product* ap,
                             size_t* memory) {
    size_t n = (size_t)P->nfine;
    OmStatus status = OM_OK;
    OM_CALLOC_DONE(ap->adr, n + 1);
    OM_ALLOC_DONE(ap->mark, P->ncoarse);
    OM_ALLOC_DONE(ap->seen, P->ncoarse);
    OM_CALLOC_DONE(G->ap_num, n);
    OM_CALLOC_DONE(G->slot_adr, n + 1);
    OM_CALLOC_DONE(G->pos_adr, n + 1);
    forget(ap, P->ncoarse);
    int64_t nslot = 0, npos = 0, ncol = 0;
    for (int i = 0; i < P->nfine; ++i) {
        int num = walk_row(A, P, ap, i, NULL, NULL);
        OM_CHECK_DONE(num < UINT16_MAX, OM_INVALID, "vertex %d has too many neighbours", i);
        G->ap_num[i] = num;
        G->max_ap = num > G->max_ap ? num : G->max_ap;
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k)
            nslot += P->adr[A->col[k] + 1] - P->adr[A->col[k]];
        npos += (int64_t)num * (P->adr[i + 1] - P->adr[i]);
        ncol += num;
        OM_CHECK_DONE(nslot < INT32_MAX && npos < INT32_MAX, OM_INVALID,
                      "the matrix is too large for a multigrid");
        G->slot_adr[i + 1] = (int)nslot;
        G->pos_adr[i + 1] = (int)npos;
        ap->adr[i + 1] = (int)ncol;
    }
    OM_ALLOC_DONE(ap->col, ncol);
    OM_ALLOC_DONE(G->slot, nslot);
    OM_ALLOC_DONE(G->pos, npos);
    *memory += (size_t)(nslot + npos) * sizeof(uint16_t) + 3 * n * sizeof(int);
    forget(ap, P->ncoarse);
    for (int i = 0; i < P->nfine; ++i)
        walk_row(A, P, ap, i, ap->col + ap->adr[i], G->slot + G->slot_adr[i]);
done:
    return status;
}

// Columns of coarse row c, diagonal first, then ascending. Writes them if there is room.
static int coarse_row(const OmInterp* P, Product* ap, int c, int* col) {
    int num = 1;
    ap->seen[c] = c;
    if (col) col[0] = c;
    for (int t = P->t_adr[c]; t < P->t_adr[c + 1]; ++t) {
        int i = P->t_row[t];
        for (int k = ap->adr[i]; k < ap->adr[i + 1]; ++k) {
            if (ap->seen[ap->col[k]] == c) continue;
            ap->seen[ap->col[k]] = c;
            if (col) col[num] = ap->col[k];
            ++num;
        }
    }
    if (col) om_sort_ints(col + 1, num - 1);
    return num;
}

static OmStatus make_coarse(const OmInterp* P, Product* ap, OmBsr* coarse, size_t* memory) {
    OmStatus status = OM_OK;
    int64_t nblock = 0;
    *coarse = (OmBsr){.nvert = P->ncoarse};
    OM_CALLOC_DONE(coarse->row_adr, (size_t)P->ncoarse + 1);
    forget(ap, P->ncoarse);
    for (int c = 0; c < P->ncoarse; ++c) {
        int num = coarse_row(P, ap, c, NULL);
        nblock += num;
        OM_CHECK_DONE(nblock < INT32_MAX / 16 && num < UINT16_MAX, OM_INVALID,
                      "the matrix is too large for a multigrid");
        coarse->row_adr[c + 1] = (int)nblock;
    }
    coarse->nblock = (int)nblock;
    coarse->nedge = (coarse->nblock - coarse->nvert) / 2;
    OM_ALLOC_DONE(coarse->col, nblock);
    OM_CALLOC_DONE(coarse->value, 9 * (size_t)nblock + 3);
    *memory += (size_t)nblock * 40 + (size_t)P->ncoarse * sizeof(int);
    forget(ap, P->ncoarse);
    for (int c = 0; c < P->ncoarse; ++c) coarse_row(P, ap, c, coarse->col + coarse->row_adr[c]);
done:
    return status;
}

// Address of each block of row i of A P in the coarse rows of vertex i.
static void find_positions(const OmInterp* P, const Product* ap, const OmBsr* coarse,
                           OmGalerkin* G) {
    for (int c = 0; c < P->ncoarse; ++c) {
        int* where = ap->mark;
        for (int k = coarse->row_adr[c]; k < coarse->row_adr[c + 1]; ++k)
            where[coarse->col[k]] = k - coarse->row_adr[c];
        for (int t = P->t_adr[c]; t < P->t_adr[c + 1]; ++t) {
            int i = P->t_row[t];
            uint16_t* pos = G->pos + G->pos_adr[i] + (P->t_entry[t] - P->adr[i]) * G->ap_num[i];
            for (int k = 0; k < G->ap_num[i]; ++k)
                pos[k] = (uint16_t)where[ap->col[ap->adr[i] + k]];
        }
    }
}

OmStatus om__galerkin_create(const OmBsr* A, const OmInterp* P, int nworker, OmGalerkin* G,
                             OmBsr* coarse, size_t* memory) {
    OmStatus status = OM_OK;
    Product ap = {0};
    *coarse = (OmBsr){0};
    OM_TRY_DONE(make_product(A, P, G, &ap, memory));
    OM_TRY_DONE(make_coarse(P, &ap, coarse, memory));
    find_positions(P, &ap, coarse, G);
    OM_ALLOC_DONE(G->scratch, (size_t)nworker * (size_t)G->max_ap * 12);
    *memory += (size_t)nworker * (size_t)G->max_ap * 48;
done:
    om_free(ap.adr);
    om_free(ap.col);
    om_free(ap.mark);
    om_free(ap.seen);
    return status;
}

void om__galerkin_done(OmGalerkin* G) {
    om_free(G->ap_num);
    om_free(G->slot_adr);
    om_free(G->slot);
    om_free(G->pos_adr);
    om_free(G->pos);
    om_free(G->scratch);
    *G = (OmGalerkin){0};
}

// ---- values -----------------------------------------------------------------------------------------

// A block of three padded columns, 12 floats.
typedef struct Wide {
    V8 lo;
    V4 hi;
} Wide;

static inline Wide load_wide(const float* p) { return (Wide){(V8)(*(const V8u*)p), load4(p + 8)}; }
static inline Wide load_packed(const float* v) {
    return (Wide){__builtin_shufflevector(load4(v), load4(v + 3), 0, 1, 2, 3, 4, 5, 6, 7),
                  load4(v + 6)};
}
static inline void store_wide(float* p, Wide b) {
    *(V8u*)p = (V8u)b.lo;
    store4(p + 8, b.hi);
}
static inline void add_scaled(float* out, Wide b, float w) {
    const V8 w8 = {w, w, w, w, w, w, w, w};
    Wide sum = load_wide(out);
    sum.lo += b.lo * w8;
    sum.hi += b.hi * splat4(w);
    store_wide(out, sum);
}

// Clear the columns (or rows) of single prescribed directions; whole vertices have zero weights already.
static inline Wide mask_columns(Wide b, const float* free) {
    V4 f = load4(free);
    b.lo *= __builtin_shufflevector(f, f, 0, 0, 0, 0, 1, 1, 1, 1);
    b.hi *= OM_SPREAD(f, 2);
    return b;
}
static inline Wide mask_rows(Wide b, const float* free) {
    V4 f = load4(free);
    b.lo *= __builtin_shufflevector(f, f, 0, 1, 2, 3, 0, 1, 2, 3);
    b.hi *= f;
    return b;
}

// Row i of A P: block k of A times the weights of the entries of its column.
static inline void gather_row(const OmBsr* A, const OmInterp* P, const uint16_t* slot, int i,
                              float* restrict row) {
    const int *col = A->col, *adr = P->adr, end = A->row_adr[i + 1];
    const float *value = A->value, *base = P->base;
    const unsigned char* mask = P->mask;
    for (int k = A->row_adr[i]; k < end; ++k) {
        int j = col[k], last = adr[j + 1];
        Wide b = load_packed(value + 9 * (size_t)k);
        if (mask[j] != OM_MASK_NONE) b = mask_columns(b, om__mask_lanes[mask[j]]);
        for (int e = adr[j]; e < last; ++e) add_scaled(row + 12 * (size_t)*slot++, b, base[e]);
    }
}

// Add row i of A P, times the weight of one entry of P, to a coarse row.
static inline void scatter_row(const float* restrict row, int num, const uint16_t* pos, float w,
                               float* restrict out) {
    for (int k = 0; k < num; ++k)
        add_scaled(out + 12 * (size_t)pos[k], load_wide(row + 12 * (size_t)k), w);
}

OM_MULTIVERSION
void om__galerkin_layer(const OmBsr* A, const OmInterp* P, const OmGalerkin* G, int layer,
                        float* restrict row, const OmBsr* coarse, float* restrict wide) {
    const int *adr = P->adr, *coarse_adr = coarse->row_adr, *layer_row = P->layer_row;
    const int last = P->layer_adr[layer + 1];
    for (int m = P->layer_adr[layer]; m < last; ++m) {
        int i = layer_row[m], num = G->ap_num[i], end = adr[i + 1];
        unsigned char mask = P->mask[i];
        const uint16_t* pos = G->pos + G->pos_adr[i];
        if (mask == OM_MASK_ALL) continue;
        for (int k = 0; k < num; ++k) store_wide(row + 12 * (size_t)k, (Wide){{0}, {0}});
        gather_row(A, P, G->slot + G->slot_adr[i], i, row);
        if (mask != OM_MASK_NONE)
            for (int k = 0; k < num; ++k)
                store_wide(row + 12 * (size_t)k,
                           mask_rows(load_wide(row + 12 * (size_t)k), om__mask_lanes[mask]));
        for (int e = adr[i]; e < end; ++e, pos += num)
            scatter_row(row, num, pos, P->base[e], wide + 12 * (size_t)coarse_adr[P->col[e]]);
    }
}

OM_MULTIVERSION
void om__galerkin_pack(const float* wide, OmBsr* coarse, int begin, int end) {
    for (int k = begin; k < end; ++k) {
        const float* in = wide + 12 * (size_t)k;
        float* out = coarse->value + 9 * (size_t)k;
        V4 c0 = *(const V4*)in, c1 = *(const V4*)(in + 4), c2 = *(const V4*)(in + 8);
        store4(out, __builtin_shufflevector(c0, c1, 0, 1, 2, 4));
        store4(out + 4, __builtin_shufflevector(c1, c2, 1, 2, 4, 5));
        out[8] = c2[2];
    }
}
