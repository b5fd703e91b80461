// match_neighbours.c: nearest rows and small dense products; the only file of the room that uses the BLAS.
//
// The nearest of na points to each of nb points in 30 to 120 dimensions: |a|^2 - 2 a.b for blocks of 32 x 128, as a
// product of matrices, then the smallest of each row. A k-d tree is no faster at 60 dimensions: it visits nearly all
// points. A block is so small that OpenBLAS multiplies it with the calling thread, so the workers are ours and the
// bytes do not depend on their number.
#include <cblas.h>
#include <math.h>

#include "base/base_blas.h"
#include "match/match_spectral_internal.h"

#define ROWS 32
#define COLUMNS 128

typedef struct Search {
    int na, nb, k, stride_b;
    const double *a, *b, *square;  // |a|^2              (na)
    int* nearest;
} Search;

static void search_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Search* s = ctx;
    double product[ROWS * COLUMNS], best[ROWS];
    int n = end - begin;
    for (int j = 0; j < n; ++j) best[j] = INFINITY;
    for (int first = 0; first < s->na; first += COLUMNS) {
        int num = s->na - first < COLUMNS ? s->na - first : COLUMNS;
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, n, num, s->k, -2,
                    s->b + (size_t)begin * (size_t)s->stride_b, s->stride_b,
                    s->a + (size_t)first * (size_t)s->k, s->k, 0, product, COLUMNS);
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < num; ++i) {
                double d = product[j * COLUMNS + i] + s->square[first + i];
                if (d >= best[j]) continue;
                best[j] = d;
                s->nearest[begin + j] = first + i;
            }
    }
}

OmStatus om__nearest_rows(int na, const double* a, int nb, const double* b, int stride_b, int k,
                          int nworker, int* nearest) {
    double* square = om_alloc((size_t)na, sizeof *square);
    if (!square) return OM_NO_MEMORY;
    for (int i = 0; i < na; ++i) {
        square[i] = 0;
        for (int c = 0; c < k; ++c)
            square[i] +=
                a[(size_t)i * (size_t)k + (size_t)c] * a[(size_t)i * (size_t)k + (size_t)c];
    }
    for (int j = 0; j < nb; ++j) nearest[j] = 0;  // rows that are not finite
    Search s = {na, nb, k, stride_b, a, b, square, nearest};
    om__blas_begin(1);
    om_parallel_for(nworker, nb, ROWS, search_rows, &s);
    om__blas_end();
    om_free(square);
    return OM_OK;
}

void om__product_tn(int rows, int m, int n, const double* A, int stride_a, const double* B,
                    double* C) {
    om__blas_begin(1);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, m, n, rows, 1, A, stride_a, B, n, 0, C, n);
    om__blas_end();
}

void om__product_nt(int rows, int m, int n, double scale, const double* A, int stride_a,
                    const double* B, double* C) {
    om__blas_begin(1);
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, rows, n, m, scale, A, stride_a, B, m, 0, C,
                n);
    om__blas_end();
}

bool om__dense_solve(int n, double* M, int nrhs, double* r) {
    for (int j = 0; j < n; ++j) {
        for (int i = j; i < n; ++i) {
            double sum = M[i * n + j];
            for (int k = 0; k < j; ++k) sum -= M[i * n + k] * M[j * n + k];
            if (i == j && !(sum > 0)) return false;
            M[i * n + j] = i == j ? sqrt(sum) : sum / M[j * n + j];
        }
    }
    for (int c = 0; c < nrhs; ++c) {
        double* x = r + (size_t)c * (size_t)n;
        for (int i = 0; i < n; ++i) {
            for (int k = 0; k < i; ++k) x[i] -= M[i * n + k] * x[k];
            x[i] /= M[i * n + i];
        }
        for (int i = n - 1; i >= 0; --i) {
            for (int k = i + 1; k < n; ++k) x[i] -= M[k * n + i] * x[k];
            x[i] /= M[i * n + i];
        }
    }
    return true;
}
