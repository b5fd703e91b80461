// solve_cholmod.c: the only file that uses CHOLMOD (Chen, Davis, Hager and Rajamanickam 2008).
//
// The lower triangle is written into compressed columns in double: row i of blocks, read transposed, is
// column i. Prescribed degrees of freedom become rows of the identity, so the pattern and the analysis
// never change. The factor is supernodal and double. A long factorisation uses the threads of the BLAS, a
// short one a single thread: threads of OpenBLAS wait for each other in every product. The choice depends
// on the matrix alone, because the bytes of the factor may depend on it.
//
// CHOLMOD's own OpenMP loops always ask for four threads, which spin between the many short loops of a factorisation
// and take the processors from other workers. They are made to run on the calling thread: with two workers that each
// factorise 5,000 to 15,000 unknowns beside other work, three times as many equilibria in the same time.
#include <cholmod.h>
#include <string.h>
#ifdef OM_WITH_OPENMP
#include <omp.h>
#endif

#include "base/base_blas.h"
#include "solve/solve_internal.h"

#define MANY_FLOPS 2e9  // some hundred milliseconds on one processor
#ifdef OM_WITH_GPL
#define KIND CHOLMOD_SUPERNODAL
#else  // the supernodal module is under the GPL
#define KIND CHOLMOD_SIMPLICIAL
#endif

struct OmCholesky {
    cholmod_common common;
    bool is_started;
    cholmod_sparse* lower;     // lower triangle, sorted columns
    cholmod_factor* factor;    // analysed at creation
    bool is_single;            // one thread always
    double flops;              // of a factorisation
    cholmod_dense *X, *Y, *E;  // solution and workspace, kept between solves
};

static OmStatus status_of(const OmCholesky* chol, const char* what) {
    int code = chol->common.status;
    if (code == CHOLMOD_OK || code == CHOLMOD_DSMALL) return OM_OK;
    if (code == CHOLMOD_NOT_POSDEF)
        return om_error(OM_NOT_SPD, "CHOLMOD %s: pivot %d is not positive", what,
                        chol->factor ? (int)chol->factor->minor : -1);
    if (code == CHOLMOD_OUT_OF_MEMORY || code == CHOLMOD_TOO_LARGE)
        return om_error(OM_NO_MEMORY, "CHOLMOD %s: not enough memory for the factor", what);
    return om_error(OM_INVALID, "CHOLMOD %s: status %d", what, code);
}

static void begin_blas(const OmCholesky* chol) {
    bool is_alone = chol->is_single || om_worker_is_inside() || chol->flops < MANY_FLOPS;
    om__blas_begin(is_alone ? 1 : om_worker_count(0));
}

// Numeric factors, without CHOLMOD's own threads.
static void factorise(OmCholesky* chol) {
    begin_blas(chol);
#ifdef OM_WITH_OPENMP
    int nlevel = omp_get_max_active_levels();
    omp_set_max_active_levels(0);
#endif
    cholmod_factorize(chol->lower, chol->factor, &chol->common);
#ifdef OM_WITH_OPENMP
    omp_set_max_active_levels(nlevel);
#endif
    om__blas_end();
}

static void fill_pattern(const OmBsr* A, int* colptr, int* row) {
    int n = 0;
    for (int i = 0; i < A->nvert; ++i) {
        for (int c = 0; c < 3; ++c) {
            colptr[3 * i + c] = n;
            for (int r = c; r < 3; ++r) row[n++] = 3 * i + r;
            for (int k = A->row_adr[i] + 1; k < A->row_adr[i + 1]; ++k)
                for (int r = 0; r < 3 && A->col[k] > i; ++r) row[n++] = 3 * A->col[k] + r;
        }
    }
    colptr[3 * A->nvert] = n;
}

// Start CHOLMOD with a lower triangle of n columns and nnz entries, whose memory is not cleared.
static OmStatus begin(size_t n, size_t nnz, OmCholesky** out) {
    *out = NULL;
    OmStatus status = OM_OK;
    OmCholesky* chol = om_calloc(1, sizeof *chol);
    if (!chol) return OM_NO_MEMORY;
    cholmod_common* c = &chol->common;
    chol->is_started = cholmod_start(c) != 0;
    c->print = 0;
    c->supernodal = KIND;
    // a simplicial factor stops at a pivot that is not positive, as a supernodal one does
    c->final_ll = 1;
    chol->lower = cholmod_allocate_sparse(n, n, nnz, 1, 1, -1, CHOLMOD_REAL, c);
    OM_TRY_DONE(status_of(chol, "create"));
    *out = chol;
done:
    if (status < 0) om__cholesky_destroy(chol);
    return status;
}

static OmStatus analyse(OmCholesky* chol) {
    chol->factor = cholmod_analyze(chol->lower, &chol->common);
    OM_TRY(status_of(chol, "analyse"));
    chol->flops = chol->common.fl;
    return OM_OK;
}

OmStatus om__cholesky_create(const OmBsr* A, bool is_single, OmCholesky** out) {
    *out = NULL;
    OM_CHECK(A->nblock < INT32_MAX / 9, OM_INVALID,
             "the matrix is too large for a Cholesky factor");
    OmStatus status = OM_OK;
    OmCholesky* chol;
    size_t n = 3 * (size_t)A->nvert, nnz = 6 * (size_t)A->nvert + 9 * (size_t)A->nedge;
    OM_TRY(begin(n, nnz, &chol));
    chol->is_single = is_single;
    fill_pattern(A, chol->lower->p, chol->lower->i);
    memset(chol->lower->x, 0, nnz * sizeof(double));
    OM_TRY_DONE(analyse(chol));
    *out = chol;
done:
    if (status < 0) om__cholesky_destroy(chol);
    return status;
}

OmStatus om__find_order(const OmBsr* A, int* order) {
    OmCholesky* chol;
    OM_TRY(om__cholesky_create(A, true, &chol));
    memcpy(order, chol->factor->Perm, chol->lower->nrow * sizeof *order);
    om__cholesky_destroy(chol);
    return OM_OK;
}

static void fill_csr(const OmCsr* A, OmCholesky* chol) {
    int num = 0, *colptr = chol->lower->p, *row = chol->lower->i;
    double* value = chol->lower->x;
    for (int i = 0; i < A->n; ++i) {  // row i right of the diagonal is column i below it
        colptr[i] = num;
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
            if (A->col[k] < i) continue;
            row[num] = A->col[k];
            value[num++] = A->value[k];
        }
    }
    colptr[A->n] = num;
    chol->is_single = true;
}

OmStatus om__cholesky_create_csr(const OmCsr* A, OmCholesky** out) {
    *out = NULL;
    OmStatus status = OM_OK;
    OmCholesky* chol;
    OM_TRY(begin((size_t)A->n, (size_t)A->row_adr[A->n], &chol));
    fill_csr(A, chol);
    OM_TRY_DONE(analyse(chol));
    factorise(chol);
    OM_TRY_DONE(status_of(chol, "factorise"));
    if (status == OM_OK) *out = chol;
done:
    if (status != OM_OK) om__cholesky_destroy(chol);
    return status;
}

OmStatus om__count_negative(const OmCsr* A, int* num) {
    *num = -1;
    OmStatus status = OM_OK;
    OmCholesky* chol;
    OM_TRY(begin((size_t)A->n, (size_t)A->row_adr[A->n], &chol));
    fill_csr(A, chol);
    chol->common.supernodal = CHOLMOD_SIMPLICIAL;  // L D L^T, whose D may be negative
    chol->common.final_ll = 0;
    OM_TRY_DONE(analyse(chol));
    factorise(chol);
    OM_TRY_DONE(status_of(chol, "factorise"));
    if (status != OM_OK) goto done;
    const int* adr = chol->factor->p;
    const double* value = chol->factor->x;
    *num = 0;
    for (size_t j = 0; j < chol->factor->n; ++j) *num += value[adr[j]] < 0;
done:
    om__cholesky_destroy(chol);
    return status;
}

void om__cholesky_destroy(OmCholesky* chol) {
    if (!chol) return;
    if (chol->is_started) {
        cholmod_free_dense(&chol->X, &chol->common);
        cholmod_free_dense(&chol->Y, &chol->common);
        cholmod_free_dense(&chol->E, &chol->common);
        cholmod_free_factor(&chol->factor, &chol->common);
        cholmod_free_sparse(&chol->lower, &chol->common);
        cholmod_finish(&chol->common);
    }
    om_free(chol);
}

OmStatus om__cholesky_refresh(OmCholesky* chol, const OmBsr* A, const unsigned char* fixed) {
    double* out = chol->lower->x;
    bool is_finite = true;
    for (int i = 0; i < A->nvert; ++i) {
        for (int c = 0; c < 3; ++c) {
            bool is_fixed = fixed[3 * (size_t)i + (size_t)c];
            for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
                int j = A->col[k];
                if (j < i) continue;
                for (int r = j == i ? c : 0; r < 3; ++r) {
                    size_t at = 9 * (size_t)k + (size_t)(3 * r + c);
                    double e = A->exact ? A->exact[at] : (double)A->value[at];
                    is_finite = is_finite && e * 0.0 == 0.0;
                    if (is_fixed || fixed[3 * (size_t)j + (size_t)r])
                        e = j == i && r == c ? 1.0 : 0.0;
                    *out++ = e;
                }
            }
        }
    }
    OM_CHECK(is_finite, OM_INVALID, "om_solver_refresh: the matrix has a value that is not finite");
    factorise(chol);
    return status_of(chol, "factorise");
}

OmStatus om__cholesky_solve(OmCholesky* chol, int nrhs, double* b) {
    size_t n = chol->lower->nrow;
    cholmod_dense B = {.nrow = n,
                       .ncol = (size_t)nrhs,
                       .nzmax = n * (size_t)nrhs,
                       .d = n,
                       .x = b,
                       .xtype = CHOLMOD_REAL,
                       .dtype = CHOLMOD_DOUBLE};
    begin_blas(chol);
    cholmod_solve2(CHOLMOD_A, chol->factor, &B, NULL, &chol->X, NULL, &chol->Y, &chol->E,
                   &chol->common);
    om__blas_end();
    OmStatus status = status_of(chol, "solve");
    if (status == OM_OK) memcpy(b, chol->X->x, n * (size_t)nrhs * sizeof(double));
    return status;
}
