// solve_dense.c: the coarsest level: A = U^T U in double, then the inverse of U^T by rows in float, so that
// a solve is two triangular products that run along rows (solve_kernel.c).
#include <math.h>
#include <string.h>

#include "solve/solve_multigrid.h"

// relative to its diagonal entry; a smaller pivot: this direction has no stiffness
#define MIN_PIVOT 1e-10

OmStatus om__dense_create(int n, int lanes, OmDense* dense, size_t* memory) {
    size_t n2 = (size_t)n * (size_t)n;
    *dense = (OmDense){.n = n};
    OM_ALLOC(dense->factor, n2);
    OM_ALLOC(dense->inverse, n2);
    OM_ALLOC(dense->apply, n2);
    OM_ALLOC(dense->y, 2 * (size_t)n * (size_t)lanes);
    *memory += 20 * n2 + 8 * (size_t)n * (size_t)lanes;
    return OM_OK;
}

void om__dense_done(OmDense* dense) {
    om_free(dense->factor);
    om_free(dense->inverse);
    om_free(dense->apply);
    om_free(dense->y);
    *dense = (OmDense){0};
}

OM_MULTIVERSION
static void subtract_row(double* restrict a, const double* restrict b, double s, int begin,
                         int end) {
    for (int k = begin; k < end; ++k) a[k] -= s * b[k];
}

static void unpack(OmDense* dense, const OmBsr* A) {
    size_t n = (size_t)dense->n;
    memset(dense->factor, 0, n * n * sizeof(double));
    for (int i = 0; i < A->nvert; ++i)
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k)
            for (size_t r = 0; r < 3; ++r)
                for (size_t c = 0; c < 3; ++c)
                    dense->factor[(3 * (size_t)i + r) * n + 3 * (size_t)A->col[k] + c] =
                        (double)A->value[9 * (size_t)k + 3 * c + r];
    if (A->ties) om__ties_add_dense(A->ties, dense->n, dense->factor);
}

void om__dense_refresh(OmDense* dense, const OmBsr* A) {
    int n = dense->n;
    double *U = dense->factor, *W = dense->inverse;
    unpack(dense, A);
    // Row k of U, then subtract its products from the rows below.
    for (int k = 0; k < n; ++k) {
        double* row = U + (size_t)k * (size_t)n;
        double first = (double)A->value[9 * (size_t)A->row_adr[k / 3] + (size_t)(4 * (k % 3))];
        bool is_held = row[k] > MIN_PIVOT * first && row[k] > 0.0;
        double inv = is_held ? 1.0 / sqrt(row[k]) : 0.0;
        for (int j = k; j < n; ++j) row[j] *= inv;
        for (int i = k + 1; i < n && is_held; ++i)
            subtract_row(U + (size_t)i * (size_t)n, row, row[i], i, n);
    }
    // Forward substitution on the rows of the identity.
    memset(W, 0, (size_t)n * (size_t)n * sizeof(double));
    for (int k = 0; k < n; ++k) {
        double* row = W + (size_t)k * (size_t)n;
        double pivot = U[(size_t)k * (size_t)n + (size_t)k];
        if (pivot == 0.0) continue;  // a direction without stiffness
        row[k] = 1.0;
        for (int j = 0; j < k; ++j)
            subtract_row(row, W + (size_t)j * (size_t)n, U[(size_t)j * (size_t)n + (size_t)k], 0,
                         j + 1);
        for (int j = 0; j <= k; ++j) row[j] /= pivot;
    }
    for (size_t m = 0; m < (size_t)n * (size_t)n; ++m) dense->apply[m] = (float)W[m];
}
