// solve_bsr.c: the pattern of a block matrix, its addresses, and y = A x in double.
//
// The pattern is built without hashing: elements are listed by vertex (a transposed incidence); each row
// gathers the vertices of its elements, marks visited ones, and sorts them.
#include <string.h>

#include "solve/solve_internal.h"

#define APPLY_GRAIN 256  // rows of one parallel block

// ---- pattern --------------------------------------------------------------------------------------

typedef struct Incidence {  // elements of each vertex
    int* adr;               // (nvert + 1)
    int* elem;
} Incidence;

static OmStatus list_elements(int nvert, int nelem, int k, const int* elem_vert, Incidence* inc) {
    size_t n = (size_t)nelem * (size_t)k;
    inc->adr = om_calloc((size_t)nvert + 2, sizeof(int));
    inc->elem = om_alloc(n, sizeof(int));
    if (!inc->adr || !inc->elem) return OM_NO_MEMORY;
    for (size_t m = 0; m < n; ++m) {
        int v = elem_vert[m];
        OM_CHECK(v >= 0 && v < nvert, OM_INVALID,
                 "element %d names vertex %d, but there are %d vertices", (int)(m / (size_t)k), v,
                 nvert);
        ++inc->adr[v + 2];
    }
    for (int v = 0; v < nvert; ++v) inc->adr[v + 2] += inc->adr[v + 1];
    for (size_t m = 0; m < n; ++m) inc->elem[inc->adr[elem_vert[m] + 1]++] = (int)(m / (size_t)k);
    return OM_OK;
}

static void sort_ints(int* a, int n) {
    for (int i = 1; i < n; ++i) {
        int v = a[i], j = i;
        for (; j > 0 && a[j - 1] > v; --j) a[j] = a[j - 1];
        a[j] = v;
    }
}

// Neighbours of vertex v in ascending order; mark[w] == v: w was visited. Returns their number.
static int gather_row(const Incidence* inc, int k, const int* elem_vert, int v, int* mark,
                      int* out) {
    int n = 0;
    mark[v] = v;
    for (int m = inc->adr[v]; m < inc->adr[v + 1]; ++m) {
        const int* ev = elem_vert + (size_t)inc->elem[m] * (size_t)k;
        for (int a = 0; a < k; ++a) {
            if (mark[ev[a]] == v) continue;
            mark[ev[a]] = v;
            if (out) out[n] = ev[a];
            ++n;
        }
    }
    if (out) sort_ints(out, n);
    return n;
}

// Number the edges and find both blocks of each: rows are visited in order, so the lower blocks of row
// j are found in the order of their columns, one after the other.
static void number_edges(OmBsr* A, int* next_lower) {
    int e = 0;
    for (int i = 0; i < A->nvert; ++i) next_lower[i] = A->row_adr[i] + 1;
    for (int i = 0; i < A->nvert; ++i) {
        for (int k = A->row_adr[i] + 1; k < A->row_adr[i + 1]; ++k) {
            int j = A->col[k];
            if (j < i) continue;
            A->edge_vert[2 * e] = i;
            A->edge_vert[2 * e + 1] = j;
            A->edge_adr[2 * e] = k;
            A->edge_adr[2 * e + 1] = next_lower[j]++;
            ++e;
        }
    }
}

OmStatus om_bsr_create(int nvert, int nelem, int nelem_vert, const int* elem_vert, OmBsr* A) {
    *A = (OmBsr){0};
    OM_CHECK(nvert > 0 && nelem >= 0 && nelem_vert >= 1, OM_INVALID,
             "a matrix of %d vertices and %d elements of %d vertices cannot be", nvert, nelem,
             nelem_vert);
    OmStatus status = OM_OK;
    Incidence inc = {0};
    int* mark = NULL;
    OM_TRY_DONE(list_elements(nvert, nelem, nelem_vert, elem_vert, &inc));
    OM_ALLOC_DONE(mark, nvert);
    OM_ALLOC_DONE(A->row_adr, nvert + 1);
    A->nvert = nvert;

    // Count, then fill.
    int64_t nblock = 0;
    for (int v = 0; v < nvert; ++v) mark[v] = -1;
    for (int v = 0; v < nvert; ++v) {
        A->row_adr[v] = (int)nblock;
        nblock += 1 + gather_row(&inc, nelem_vert, elem_vert, v, mark, NULL);
        OM_CHECK_DONE(nblock < INT32_MAX / 16, OM_INVALID, "a matrix of more than %d blocks",
                      INT32_MAX / 16);
    }
    A->row_adr[nvert] = A->nblock = (int)nblock;
    A->nedge = (A->nblock - nvert) / 2;
    OM_ALLOC_DONE(A->col, A->nblock);
    OM_CALLOC_DONE(A->value, (size_t)A->nblock * 9 + 3);
    OM_ALLOC_DONE(A->edge_vert, 2 * (size_t)A->nedge);
    OM_ALLOC_DONE(A->edge_adr, 2 * (size_t)A->nedge);
    for (int v = 0; v < nvert; ++v) mark[v] = -1;
    for (int v = 0; v < nvert; ++v) {
        A->col[A->row_adr[v]] = v;
        gather_row(&inc, nelem_vert, elem_vert, v, mark, A->col + A->row_adr[v] + 1);
    }
    number_edges(A, mark);
done:
    om_free(inc.adr);
    om_free(inc.elem);
    om_free(mark);
    if (status < 0) om_bsr_destroy(A);
    return status;
}

void om_bsr_destroy(OmBsr* A) {
    if (!A) return;
    om_free(A->row_adr);
    om_free(A->col);
    om_free(A->edge_vert);
    om_free(A->edge_adr);
    om_free(A->value);
    om_free(A->exact);
    *A = (OmBsr){0};
}

// ---- addresses ------------------------------------------------------------------------------------

int om_bsr_find(const OmBsr* A, int i, int j) {
    if (i < 0 || i >= A->nvert) return -1;
    if (i == j) return A->row_adr[i];
    return om__find_column(A->col, A->row_adr[i] + 1, A->row_adr[i + 1], j);
}

OmStatus om_bsr_find_elements(const OmBsr* A, int nelem, int nelem_vert, const int* elem_vert,
                              int* adr) {
    for (int e = 0; e < nelem; ++e) {
        const int* ev = elem_vert + (size_t)e * (size_t)nelem_vert;
        for (int a = 0; a < nelem_vert; ++a) {
            for (int b = 0; b < nelem_vert; ++b) {
                int k = om_bsr_find(A, ev[a], ev[b]);
                OM_CHECK(k >= 0, OM_INVALID, "element %d: vertices %d and %d are not coupled", e,
                         ev[a], ev[b]);
                *adr++ = k;
            }
        }
    }
    return OM_OK;
}

OmStatus om_bsr_make_exact(OmBsr* A) {
    if (A->exact) return OM_OK;
    OM_ALLOC(A->exact, 9 * (size_t)A->nblock);
    for (size_t n = 0; n < 9 * (size_t)A->nblock; ++n) A->exact[n] = (double)A->value[n];
    return OM_OK;
}

void om_bsr_zero(OmBsr* A) {
    memset(A->value, 0, ((size_t)A->nblock * 9 + 3) * sizeof(float));
    if (A->exact) memset(A->exact, 0, 9 * (size_t)A->nblock * sizeof(double));
}

// ---- y = A x in double ----------------------------------------------------------------------------

typedef struct Apply {
    const OmBsr* A;
    const double* x;
    double* y;
} Apply;

OM_MULTIVERSION
static void apply_rows(const OmBsr* A, const double* x, double* y, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        om_store3(y, i, om__row_product(A, x, i));
    }
}

static void apply_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Apply* a = ctx;
    apply_rows(a->A, a->x, a->y, begin, end);
    if (a->A->ties) om__ties_add_rows(a->A->ties, a->x, a->y, begin, end);
}

void om_bsr_apply(const OmBsr* A, int nworker, const double* x, double* y) {
    Apply a = {A, x, y};
    om_parallel_for(nworker, A->nvert, APPLY_GRAIN, apply_block, &a);
}
