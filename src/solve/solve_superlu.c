// solve_superlu.c: the only file that uses SuperLU (Demmel, Eisenstat, Gilbert, Li and Liu 1999), in the place of
// UMFPACK where the build has no parts under the GPL (OM_WITH_GPL).
//
// Rows of blocks are written as compressed columns, so SuperLU holds the transpose and solves with the transpose of
// that. The order of elimination is CHOLMOD's for the symmetric pattern, and pivots stay on the diagonal where they are
// not small. Each solve ends with steps of refinement. SuperLU ends the program where it finds no memory for small
// arrays; for the factors it reports that.
#include <slu_ddefs.h>
#include <string.h>

#include "base/base_blas.h"
#include "solve/solve_internal.h"

typedef int LuIndex;
#include "solve/solve_lu_pattern.h"

#define PIVOT 0.01    // a diagonal entry above this share of its column is the pivot
#define NREFINE 2     // steps of refinement of a solution
#define PANEL_WAYS 2  // sp_ienv: its parameters of panels and of relaxed supernodes

struct OmLu {
    int n, nentry;
    LuIndex *begin, *row;          // of the transpose (n + 1), (nentry)
    double* value;                 // (nentry)
    int* order;                    // of elimination, by CHOLMOD (n)
    int *perm_c, *perm_r, *etree;  // of SuperLU (n)
    double *x, *r;                 // a solution and its residual (n)
    SuperMatrix L, U;
    bool has_factors;
};

static void drop_factors(OmLu* lu) {
    if (!lu->has_factors) return;
    Destroy_SuperNode_Matrix(&lu->L);
    Destroy_CompCol_Matrix(&lu->U);
    lu->has_factors = false;
}

OmStatus om__lu_create(const OmBsr* A, OmLu** out) {
    *out = NULL;
    OmStatus status = OM_OK;
    OM_CHECK(A->nblock < INT32_MAX / 9, OM_INVALID, "the matrix is too large for LU factors");
    OmLu* lu = om_calloc(1, sizeof *lu);
    if (!lu) return OM_NO_MEMORY;
    lu->n = 3 * A->nvert;
    lu->nentry = 9 * A->nblock;
    OM_ALLOC_DONE(lu->begin, (size_t)lu->n + 1);
    OM_ALLOC_DONE(lu->row, lu->nentry);
    OM_CALLOC_DONE(lu->value, lu->nentry);
    OM_ALLOC_DONE(lu->order, lu->n);
    OM_ALLOC_DONE(lu->perm_c, lu->n);
    OM_ALLOC_DONE(lu->perm_r, lu->n);
    OM_ALLOC_DONE(lu->etree, lu->n);
    OM_ALLOC_DONE(lu->x, lu->n);
    OM_ALLOC_DONE(lu->r, lu->n);
    om__lu_fill_pattern(A, lu->begin, lu->row);
    OM_TRY_DONE(om__find_order(A, lu->order));
    *out = lu;
done:
    if (status < 0) om__lu_destroy(lu);
    return status;
}

void om__lu_destroy(OmLu* lu) {
    if (!lu) return;
    drop_factors(lu);
    om_free(lu->begin);
    om_free(lu->row);
    om_free(lu->value);
    om_free(lu->order);
    om_free(lu->perm_c);
    om_free(lu->perm_r);
    om_free(lu->etree);
    om_free(lu->x);
    om_free(lu->r);
    om_free(lu);
}

OmStatus om__lu_refresh(OmLu* lu, const OmBsr* A, const unsigned char* fixed) {
    OM_TRY(om__rows_write(A, fixed, lu->value));
    drop_factors(lu);
    superlu_options_t options;
    set_default_options(&options);
    options.ColPerm = MY_PERMC;
    options.SymmetricMode = YES;
    options.DiagPivotThresh = PIVOT;
    for (int k = 0; k < lu->n; ++k) lu->perm_c[lu->order[k]] = k;  // the new place of a column
    SuperMatrix M, permuted;
    SuperLUStat_t stat;
    GlobalLU_t work;
    int info = 0;
    om__blas_begin(1);
    StatInit(&stat);
    dCreate_CompCol_Matrix(&M, lu->n, lu->n, lu->nentry, lu->value, lu->row, lu->begin, SLU_NC,
                           SLU_D, SLU_GE);
    sp_preorder(&options, &M, lu->perm_c, lu->etree, &permuted);
    dgstrf(&options, &permuted, sp_ienv(PANEL_WAYS), sp_ienv(1), lu->etree, NULL, 0, lu->perm_c,
           lu->perm_r, &lu->L, &lu->U, &work, &stat, &info);
    Destroy_CompCol_Permuted(&permuted);
    Destroy_SuperMatrix_Store(&M);
    StatFree(&stat);
    om__blas_end();
    OM_CHECK(info >= 0, OM_INVALID, "SuperLU factorise: argument %d is wrong", -info);
    OM_CHECK(info <= lu->n, OM_NO_MEMORY, "SuperLU factorise: not enough memory for the factors");
    lu->has_factors = true;
    if (info > 0) return om_error(OM_NOT_SPD, "SuperLU factorise: the matrix is singular");
    return OM_OK;
}

// x += M^-T r, where the columns of M are the rows of the matrix.
static OmStatus add_solution(const OmLu* lu, double* r, double* x) {
    SuperMatrix B;
    SuperLUStat_t stat;
    int info = 0;
    StatInit(&stat);
    dCreate_Dense_Matrix(&B, lu->n, 1, r, lu->n, SLU_DN, SLU_D, SLU_GE);
    SuperMatrix L = lu->L, U = lu->U;
    dgstrs(TRANS, &L, &U, lu->perm_c, lu->perm_r, &B, &stat, &info);
    Destroy_SuperMatrix_Store(&B);
    StatFree(&stat);
    OM_CHECK(info == 0, OM_INVALID, "SuperLU solve: status %d", info);
    for (int i = 0; i < lu->n; ++i) x[i] += r[i];
    return OM_OK;
}

OmStatus om__lu_solve(OmLu* lu, int nrhs, double* b) {
    for (int k = 0; k < nrhs; ++k) {
        double* bk = b + (size_t)k * (size_t)lu->n;
        memset(lu->x, 0, (size_t)lu->n * sizeof *lu->x);
        for (int step = 0; step <= NREFINE; ++step) {
            for (int i = 0; i < lu->n; ++i) {
                double sum = bk[i];
                for (int e = lu->begin[i]; e < lu->begin[i + 1]; ++e)
                    sum -= lu->value[e] * lu->x[lu->row[e]];
                lu->r[i] = sum;
            }
            om__blas_begin(1);
            OmStatus status = add_solution(lu, lu->r, lu->x);
            om__blas_end();
            OM_TRY(status);
        }
        memcpy(bk, lu->x, (size_t)lu->n * sizeof *bk);
    }
    return OM_OK;
}

// 1 or -1: a permutation of n with k cycles is n - k exchanges.
static int sign_of(const int* perm, int n, int* seen) {
    int nexchange = n;
    memset(seen, 0, (size_t)n * sizeof *seen);
    for (int i = 0; i < n; ++i) {
        nexchange -= !seen[i];
        for (int j = i; !seen[j]; j = perm[j]) seen[j] = 1;
    }
    return nexchange % 2 == 0 ? 1 : -1;
}

// The diagonal of U is stored with the blocks of L.
int om__lu_sign(const OmLu* lu) {
    const SCformat* L = lu->L.Store;
    const double* value = L->nzval;
    int sign = sign_of(lu->perm_c, lu->n, lu->etree) * sign_of(lu->perm_r, lu->n, lu->etree);
    for (int j = 0; j < lu->n; ++j) {
        int first = L->sup_to_col[L->col_to_sup[j]];
        if (value[L->nzval_colptr[j] + j - first] < 0) sign = -sign;
    }
    return sign;
}
