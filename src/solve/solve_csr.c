// solve_csr.c: sparse matrices of numbers in compressed rows.
//
// Triplets are sorted by row, then by column, with two passes of counting sort, as in CSparse (Davis 2006, section
// 2.4): the transpose of the transpose has sorted rows. Equal places are then added in the order of the triplets.
#include <math.h>
#include <string.h>

#include "solve/solve_internal.h"

// Places of n items in the order of their key; items with one key keep the order of `in`, null for 0, 1, 2 ...
static void sort_by_key(int n, int nkey, const int* key, const int* in, int* adr, int* out) {
    memset(adr, 0, ((size_t)nkey + 1) * sizeof *adr);
    for (int k = 0; k < n; ++k) ++adr[key[k] + 1];
    for (int i = 0; i < nkey; ++i) adr[i + 1] += adr[i];
    for (int k = 0; k < n; ++k) {
        int item = in ? in[k] : k;
        out[adr[key[item]]++] = item;
    }
}

static OmStatus check_triplets(int n, int nentry, const int* row, const int* col,
                               const double* value) {
    OM_CHECK(n >= 1 && nentry >= 0, OM_INVALID, "a matrix of %d rows and %d entries", n, nentry);
    for (int k = 0; k < nentry; ++k) {
        OM_CHECK(row[k] >= 0 && row[k] < n && col[k] >= 0 && col[k] < n, OM_INVALID,
                 "entry %d is at (%d, %d) of a matrix of %d rows", k, row[k], col[k], n);
        OM_CHECK(isfinite(value[k]), OM_INVALID, "entry %d at (%d, %d) is %g", k, row[k], col[k],
                 value[k]);
    }
    return OM_OK;
}

OmStatus om_csr_init(int n, int nentry, const int* row, const int* col, const double* value,
                     OmCsr* A) {
    memset(A, 0, sizeof *A);
    OM_TRY(check_triplets(n, nentry, row, col, value));
    OmStatus status = OM_OK;
    int *by_col = NULL, *by_row = NULL, *adr = NULL;
    OM_ALLOC_DONE(by_col, nentry);
    OM_ALLOC_DONE(by_row, nentry);
    OM_ALLOC_DONE(adr, (size_t)n + 1);
    OM_CALLOC_DONE(A->row_adr, (size_t)n + 1);
    OM_ALLOC_DONE(A->col, nentry);
    OM_ALLOC_DONE(A->value, nentry);
    A->n = n;
    sort_by_key(nentry, n, col, NULL, adr, by_col);
    sort_by_key(nentry, n, row, by_col, adr, by_row);
    int num = 0;
    for (int k = 0, last_row = -1, last_col = -1; k < nentry; ++k) {
        int item = by_row[k], i = row[item], j = col[item];
        if (i != last_row || j != last_col) {
            A->col[num] = j;
            A->value[num++] = 0;
        }
        A->value[num - 1] += value[item];
        A->row_adr[i + 1] = num;
        last_row = i;
        last_col = j;
    }
    for (int i = 0; i < n; ++i)  // rows without entries
        if (A->row_adr[i + 1] < A->row_adr[i]) A->row_adr[i + 1] = A->row_adr[i];
done:
    om_free(by_col);
    om_free(by_row);
    om_free(adr);
    if (status < 0) om_csr_done(A);
    return status;
}

OmStatus om_csr_init_diagonal(int n, const double* value, OmCsr* A) {
    memset(A, 0, sizeof *A);
    OM_CHECK(n >= 1, OM_INVALID, "a matrix of %d rows", n);
    OmStatus status = OM_OK;
    int* place = NULL;
    OM_ALLOC_DONE(place, n);
    for (int i = 0; i < n; ++i) place[i] = i;
    OM_TRY_DONE(om_csr_init(n, n, place, place, value, A));
done:
    om_free(place);
    return status;
}

void om_csr_done(OmCsr* A) {
    if (!A) return;
    om_free(A->row_adr);
    om_free(A->col);
    om_free(A->value);
    memset(A, 0, sizeof *A);
}

void om_csr_apply(const OmCsr* A, const double* x, double* y) {
    for (int i = 0; i < A->n; ++i) {
        double sum = 0;
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) sum += A->value[k] * x[A->col[k]];
        y[i] = sum;
    }
}

double om_csr_get(const OmCsr* A, int i, int j) {
    if (i < 0 || j < 0 || i >= A->n || j >= A->n) return 0;
    int k = om__find_column(A->col, A->row_adr[i], A->row_adr[i + 1], j);
    return k < 0 ? 0 : A->value[k];
}
