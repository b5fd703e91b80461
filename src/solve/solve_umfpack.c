// solve_umfpack.c: the only file that uses UMFPACK (Davis 2004), which factors unsymmetric matrices.
//
// Rows of blocks are written as compressed columns, so UMFPACK holds the transpose and solves with the transpose
// of that. Prescribed degrees of freedom become rows and columns of the identity, so that the pattern and the
// analysis never change. Indices are long: factors of solids have more entries than an int can count.
#include <string.h>
#include <umfpack.h>

#include "base/base_blas.h"
#include "solve/solve_internal.h"

typedef SuiteSparse_long LuIndex;
#include "solve/solve_lu_pattern.h"

struct OmLu {
    int n;
    LuIndex *begin, *row;  // (n + 1), (entries)
    double* value;         // (entries)
    double* y;             // a solution (n)
    void *symbolic, *numeric;
    double control[UMFPACK_CONTROL];
};

static OmStatus status_of(SuiteSparse_long code, const char* what) {
    if (code == UMFPACK_OK) return OM_OK;
    if (code == UMFPACK_WARNING_singular_matrix)
        return om_error(OM_NOT_SPD, "UMFPACK %s: the matrix is singular", what);
    if (code == UMFPACK_ERROR_out_of_memory)
        return om_error(OM_NO_MEMORY, "UMFPACK %s: not enough memory for the factors", what);
    return om_error(OM_INVALID, "UMFPACK %s: status %d", what, (int)code);
}

OmStatus om__lu_create(const OmBsr* A, OmLu** out) {
    *out = NULL;
    OmStatus status = OM_OK;
    OmLu* lu = om_calloc(1, sizeof *lu);
    if (!lu) return OM_NO_MEMORY;
    lu->n = 3 * A->nvert;
    umfpack_dl_defaults(lu->control);
    lu->control[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;  // the pattern is
    lu->control[UMFPACK_ORDERING] = UMFPACK_ORDERING_METIS;
    OM_ALLOC_DONE(lu->begin, (size_t)lu->n + 1);
    OM_ALLOC_DONE(lu->row, 9 * (size_t)A->nblock);
    OM_CALLOC_DONE(lu->value, 9 * (size_t)A->nblock);
    OM_ALLOC_DONE(lu->y, lu->n);
    om__lu_fill_pattern(A, lu->begin, lu->row);
    OM_TRY_DONE(status_of(umfpack_dl_symbolic(lu->n, lu->n, lu->begin, lu->row, NULL, &lu->symbolic,
                                              lu->control, NULL),
                          "analyse"));
    *out = lu;
done:
    if (status < 0) om__lu_destroy(lu);
    return status;
}

void om__lu_destroy(OmLu* lu) {
    if (!lu) return;
    umfpack_dl_free_symbolic(&lu->symbolic);
    umfpack_dl_free_numeric(&lu->numeric);
    om_free(lu->begin);
    om_free(lu->row);
    om_free(lu->value);
    om_free(lu->y);
    om_free(lu);
}

OmStatus om__lu_refresh(OmLu* lu, const OmBsr* A, const unsigned char* fixed) {
    OM_TRY(om__rows_write(A, fixed, lu->value));
    umfpack_dl_free_numeric(&lu->numeric);
    om__blas_begin(1);
    long code = umfpack_dl_numeric(lu->begin, lu->row, lu->value, lu->symbolic, &lu->numeric,
                                   lu->control, NULL);
    om__blas_end();
    return status_of(code, "factorise");
}

OmStatus om__lu_solve(OmLu* lu, int nrhs, double* b) {
    for (int k = 0; k < nrhs; ++k) {
        double* bk = b + (size_t)k * (size_t)lu->n;
        om__blas_begin(1);
        long code = umfpack_dl_solve(UMFPACK_At, lu->begin, lu->row, lu->value, lu->y, bk,
                                     lu->numeric, lu->control, NULL);
        om__blas_end();
        OM_TRY(status_of(code, "solve"));
        memcpy(bk, lu->y, (size_t)lu->n * sizeof *bk);
    }
    return OM_OK;
}

int om__lu_sign(const OmLu* lu) {
    double mantissa = 0, exponent = 0;
    umfpack_dl_get_determinant(&mantissa, &exponent, lu->numeric, NULL);
    return mantissa > 0 ? 1 : -1;
}
