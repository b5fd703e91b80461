// solve_arpack.c: the only file that uses ARPACK (Lehoucq, Sorensen and Yang 1998).
//
// Shift-invert, mode 3 of dsaupd: Lanczos on (A - s B)^-1 B in the inner product of B, with s below the spectrum. Its
// largest eigenvalues 1 / (lambda - s) are the smallest lambda, and A - s B is positive definite, so CHOLMOD factors
// it once (solve_cholmod.c). ARPACK returns its work by reverse communication: every call says which product it needs.
//
// ARPACK keeps its state in static variables of Fortran, so one lock admits one caller at a time from the first call to
// the last. The first vector is the same always: ARPACK's own would depend on the calls before.
//
// A Lanczos iteration sees one vector of each eigenspace; the others come from rounding, and of 41 equal eigenvalues
// some were missing. So the eigenvalues below the last one are counted: A - t B has as many negative pivots
// (Sylvester). If there are more, Lanczos runs again among the vectors orthogonal to the found ones, until the count is
// right or no further eigenvalue below t is found.
//
// SLEPc was not taken: it brings 106 packages.
#include <arpack/arpack.h>
#include <math.h>
#include <pthread.h>
#include <string.h>

#include "base/base_blas.h"
#include "omentum/solve_eigen.h"
#include "solve/solve_internal.h"

#define EIGEN_COOKIE 0x4f6d4567u

static pthread_mutex_t arpack_lock = PTHREAD_MUTEX_INITIALIZER;

typedef struct Lanczos {
    int n, nev, ncv;
    const OmCsr* B;  // null: the identity
    OmCholesky* factor;
    double *resid, *v, *workd, *workl;  // (n), (ncv x n), (3 n), (ncv (ncv + 8))
    double *d, *z;                      // eigenvalues, eigenvectors             (nev), (nev x n)
    a_int iparam[11], ipntr[11];
    int nsolve;
    // Pairs found, ascending, of length 1 in B. Later runs are orthogonal to them.
    int nfound;
    double *lambda, *x;  // (2 npair), (2 npair x n)
    a_int* select;       // (ncv of the first run)
    double* scratch;     // (2 n)
} Lanczos;

OmEigenDef om_eigen_default_def(int npair, double shift) {
    return (OmEigenDef){.npair = npair,
                        .shift = shift,
                        .tolerance = 1e-10,
                        .max_restarts = 300,
                        .cookie = EIGEN_COOKIE};
}

static OmStatus check_matrix(const OmCsr* A, const char* name) {
    double scale = 0;
    for (int k = 0; k < A->row_adr[A->n]; ++k) {
        OM_CHECK(isfinite(A->value[k]), OM_INVALID, "eigenpairs: %s has a value of %g", name,
                 A->value[k]);
        scale = fmax(scale, fabs(A->value[k]));
    }
    for (int i = 0; i < A->n; ++i)
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
            double other = om_csr_get(A, A->col[k], i);
            OM_CHECK(fabs(A->value[k] - other) <= 1e-12 * scale, OM_INVALID,
                     "eigenpairs: %s is not symmetric: %.17g at (%d, %d), %.17g at (%d, %d)", name,
                     A->value[k], i, A->col[k], other, A->col[k], i);
        }
    return OM_OK;
}

static OmStatus check_def(const OmEigenDef* def, const OmCsr* A, const OmCsr* B) {
    OM_CHECK(def->cookie == EIGEN_COOKIE, OM_INVALID,
             "OmEigenDef was not made by om_eigen_default_def");
    OM_CHECK(!om_worker_is_inside(), OM_INVALID,
             "om_eigen_smallest is called inside a parallel loop: ARPACK serves one caller");
    OM_CHECK(def->npair >= 1 && def->npair < A->n, OM_INVALID,
             "OmEigenDef.npair is %d; 1 to %d for a matrix of %d rows", def->npair, A->n - 1, A->n);
    OM_CHECK(isfinite(def->shift), OM_INVALID, "OmEigenDef.shift is %g; it is finite", def->shift);
    OM_CHECK(def->tolerance > 0 && def->tolerance < 1, OM_INVALID,
             "OmEigenDef.tolerance is %g; above 0, below 1", def->tolerance);
    OM_CHECK(def->max_restarts >= 1, OM_INVALID, "OmEigenDef.max_restarts is %d; 1 or more",
             def->max_restarts);
    OM_CHECK(def->nbasis == 0 || (def->nbasis > def->npair && def->nbasis <= A->n), OM_INVALID,
             "OmEigenDef.nbasis is %d; 0, or %d to %d", def->nbasis, def->npair + 1, A->n);
    OM_TRY(check_matrix(A, "A"));
    if (!B) return OM_OK;
    OM_CHECK(B->n == A->n, OM_INVALID, "eigenpairs: A has %d rows and B has %d", A->n, B->n);
    OM_TRY(check_matrix(B, "B"));
    for (int i = 0; i < B->n; ++i)
        OM_CHECK(om_csr_get(B, i, i) > 0, OM_INVALID,
                 "eigenpairs: B is not positive definite: entry (%d, %d) of its diagonal is %g", i,
                 i, om_csr_get(B, i, i));
    return OM_OK;
}

// C = A - shift B
static OmStatus make_shifted(const OmCsr* A, const OmCsr* B, double shift, OmCsr* C) {
    OmStatus status = OM_OK;
    memset(C, 0, sizeof *C);
    int n = A->n, na = A->row_adr[n], nb = B ? B->row_adr[n] : n, num = 0;
    int *row = NULL, *col = NULL;
    double* value = NULL;
    OM_CHECK(na < INT32_MAX - nb, OM_INVALID, "eigenpairs: the matrices are too large");
    OM_ALLOC_DONE(row, na + nb);
    OM_ALLOC_DONE(col, na + nb);
    OM_ALLOC_DONE(value, na + nb);
    for (int i = 0; i < n; ++i) {
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k, ++num) {
            row[num] = i;
            col[num] = A->col[k];
            value[num] = A->value[k];
        }
        for (int k = B ? B->row_adr[i] : i; k < (B ? B->row_adr[i + 1] : i + 1); ++k, ++num) {
            row[num] = i;
            col[num] = B ? B->col[k] : i;
            value[num] = -shift * (B ? B->value[k] : 1);
        }
    }
    OM_TRY_DONE(om_csr_init(n, num, row, col, value, C));
done:
    om_free(row);
    om_free(col);
    om_free(value);
    return status;
}

static OmStatus lanczos_init(const OmEigenDef* def, const OmCsr* A, const OmCsr* B, Lanczos* L) {
    OmCsr C = {0};
    OmStatus status = OM_OK;
    L->n = A->n;
    L->nev = def->npair;
    L->ncv = def->nbasis ? def->nbasis : 2 * def->npair > 20 ? 2 * def->npair : 20;
    if (L->ncv > A->n) L->ncv = A->n;
    L->B = B;
    size_t n = (size_t)A->n, ncv = (size_t)L->ncv, npair = (size_t)def->npair;
    OM_CALLOC_DONE(L->resid, n);
    OM_CALLOC_DONE(L->v, n * ncv);
    OM_CALLOC_DONE(L->workd, 3 * n);
    OM_CALLOC_DONE(L->workl, ncv * (ncv + 8));
    OM_CALLOC_DONE(L->d, npair);
    OM_CALLOC_DONE(L->z, n * npair);
    OM_CALLOC_DONE(L->select, ncv);
    OM_CALLOC_DONE(L->lambda, 2 * npair);
    OM_CALLOC_DONE(L->x, 2 * n * npair);
    OM_CALLOC_DONE(L->scratch, 2 * n);
    OM_TRY_DONE(make_shifted(A, B, def->shift, &C));
    status = om__cholesky_create_csr(&C, &L->factor);
    if (status == OM_NOT_SPD)
        om_error_prefix(status, "eigenpairs: A - shift B with shift %g", def->shift);
done:
    om_csr_done(&C);
    return status;
}

static void lanczos_done(Lanczos* L) {
    om__cholesky_destroy(L->factor);
    om_free(L->resid);
    om_free(L->v);
    om_free(L->workd);
    om_free(L->workl);
    om_free(L->d);
    om_free(L->z);
    om_free(L->select);
    om_free(L->lambda);
    om_free(L->x);
    om_free(L->scratch);
}

static void apply_b(const Lanczos* L, const double* x, double* y) {
    if (L->B)
        om_csr_apply(L->B, x, y);
    else
        memcpy(y, x, (size_t)L->n * sizeof *y);
}

static double dot(int n, const double* p, const double* q) {
    double sum = 0;
    for (int i = 0; i < n; ++i) sum += p[i] * q[i];
    return sum;
}

// Make y orthogonal, in B, to the pairs found.
static void project(const Lanczos* L, double* y) {
    if (L->nfound == 0) return;
    apply_b(L, y, L->scratch);
    for (int p = 0; p < L->nfound; ++p) {
        const double* x = L->x + (size_t)p * (size_t)L->n;
        double share = dot(L->n, x, L->scratch);
        for (int i = 0; i < L->n; ++i) y[i] -= share * x[i];
    }
}

// The dialogue with ARPACK. 0, 1 and 3 of its codes are outcomes; a lower one is an error.
static OmStatus iterate(const OmEigenDef* def, Lanczos* L, a_int* info) {
    a_int ido = 0, lworkl = L->ncv * (L->ncv + 8);
    const char* kind = L->B ? "G" : "I";
    L->iparam[0] = 1;
    L->iparam[2] = def->max_restarts;
    L->iparam[3] = 1;
    L->iparam[6] = 3;
    *info = 1;  // the first vector is in resid
    OmRng rng = om_rng_init(1, (uint64_t)L->nfound);
    for (int i = 0; i < L->n; ++i) L->resid[i] = om_rng_range(&rng, 0.5, 1.5);
    project(L, L->resid);
    for (;;) {
        dsaupd_c(&ido, kind, L->n, "LM", L->nev, def->tolerance, L->resid, L->ncv, L->v, L->n,
                 L->iparam, L->ipntr, L->workd, L->workl, lworkl, info);
        double* x = L->workd + L->ipntr[0] - 1;
        double* y = L->workd + L->ipntr[1] - 1;
        if (ido == 99) break;
        if (ido == 2) {
            apply_b(L, x, y);
            continue;
        }
        OM_CHECK(ido == -1 || ido == 1, OM_INVALID, "ARPACK: request %d is unknown", (int)ido);
        // y = (A - s B)^-1 B x; in request 1 ARPACK has B x, unless B is the identity
        if (ido == 1 && L->B)
            memcpy(y, L->workd + L->ipntr[2] - 1, (size_t)L->n * sizeof *y);
        else
            apply_b(L, x, y);
        OM_TRY(om__cholesky_solve(L->factor, 1, y));
        project(L, y);
        ++L->nsolve;
    }
    OM_CHECK(*info >= 0, OM_INVALID, "ARPACK: dsaupd ended with code %d", (int)*info);
    return OM_OK;
}

static OmStatus extract(const OmEigenDef* def, Lanczos* L) {
    a_int info = 0, lworkl = L->ncv * (L->ncv + 8);
    dseupd_c(1, "A", L->select, L->d, L->z, L->n, def->shift, L->B ? "G" : "I", L->n, "LM", L->nev,
             def->tolerance, L->resid, L->ncv, L->v, L->n, L->iparam, L->ipntr, L->workd, L->workl,
             lworkl, &info);
    OM_CHECK(info == 0, OM_INVALID, "ARPACK: dseupd ended with code %d", (int)info);
    return OM_OK;
}

// Add the pairs of the last run to those found, in ascending order.
static void keep_pairs(Lanczos* L, int npair) {
    size_t n = (size_t)L->n;
    for (int k = 0; k < npair; ++k) {
        double* z = L->z + n * (size_t)k;
        apply_b(L, z, L->scratch);
        double largest = 0, square = dot(L->n, z, L->scratch);
        for (size_t i = 0; i < n; ++i)
            if (fabs(z[i]) > fabs(largest)) largest = z[i];
        double scale = copysign(1 / sqrt(square), largest);  // z is not zero, B is definite
        int at = L->nfound++;
        for (; at > 0 && L->lambda[at - 1] > L->d[k]; --at) {
            L->lambda[at] = L->lambda[at - 1];
            memcpy(L->x + n * (size_t)at, L->x + n * (size_t)(at - 1), n * sizeof *z);
        }
        L->lambda[at] = L->d[k];
        for (size_t i = 0; i < n; ++i) L->x[n * (size_t)at + i] = scale * z[i];
    }
}

// Largest residual of A x = lambda B x, relative to |(lambda - shift) B x|.
static double worst_residual(const OmEigenDef* def, const Lanczos* L, const OmCsr* A) {
    double worst = 0, *Ax = L->scratch, *Bx = L->scratch + L->n;
    for (int p = 0; p < L->nfound; ++p) {
        const double* x = L->x + (size_t)p * (size_t)L->n;
        apply_b(L, x, Bx);
        om_csr_apply(A, x, Ax);
        for (int i = 0; i < L->n; ++i) Ax[i] -= L->lambda[p] * Bx[i];
        // lambda is above the shift, because A - shift B has a Cholesky factor
        double residual = sqrt(dot(L->n, Ax, Ax) / dot(L->n, Bx, Bx)) / (L->lambda[p] - def->shift);
        worst = isfinite(residual) ? fmax(worst, residual) : HUGE_VAL;
    }
    return worst;
}

static int count_below(const Lanczos* L, double bound) {
    int num = 0;
    while (num < L->nfound && L->lambda[num] < bound) ++num;
    return num;
}

// One run: at most `nev` further pairs. The number of converged ones in `npair`.
static OmStatus run_once(const OmEigenDef* def, Lanczos* L, int nev, int* npair) {
    *npair = 0;
    int room = L->n - L->nfound;
    L->nev = nev < room - 1 ? nev : room - 1;
    if (L->nev < 1) return OM_OK;
    if (L->ncv > room) L->ncv = room;
    a_int code = 0;
    OM_TRY(iterate(def, L, &code));
    int num = (int)L->iparam[4] < L->nev ? (int)L->iparam[4] : L->nev;
    if (num > 0) OM_TRY(extract(def, L));
    keep_pairs(L, num);
    *npair = num;
    return OM_OK;
}

// Find copies of multiple eigenvalues that Lanczos missed below the last one.
static OmStatus find_missing(const OmEigenDef* def, Lanczos* L, const OmCsr* A, const OmCsr* B) {
    for (int turn = 0; turn < def->npair; ++turn) {
        double last = L->lambda[def->npair - 1];
        double bound = last - 1e-6 * (last - def->shift);  // below all copies of the last one
        int total, num, before = count_below(L, bound);
        OmCsr C;
        OM_TRY(make_shifted(A, B, bound, &C));
        OmStatus status = om__count_negative(&C, &total);
        om_csr_done(&C);
        if (status != OM_OK || total <= before) return status < 0 ? status : OM_OK;
        int nev = total - before < def->npair ? total - before : def->npair;
        OM_TRY(run_once(def, L, nev, &num));
        L->nfound = def->npair;
        if (num == 0)
            return om_error(OM_NOT_CONVERGED, "eigenpairs: %d below %g were not found",
                            total - before, bound);
        if (count_below(L, bound) == before) return OM_OK;  // rounding of the pivots
    }
    return om_error(OM_NOT_CONVERGED, "eigenpairs: some are still missing after %d runs",
                    def->npair);
}

static OmStatus find_pairs(const OmEigenDef* def, Lanczos* L, const OmCsr* A, const OmCsr* B) {
    int npair;
    OM_TRY(run_once(def, L, def->npair, &npair));
    // A run that ends early, with an invariant subspace or its restarts, leaves pairs that a run beside those finds.
    while (npair > 0 && L->nfound < def->npair)
        OM_TRY(run_once(def, L, def->npair - L->nfound, &npair));
    if (L->nfound < def->npair)
        return om_error(OM_NOT_CONVERGED, "eigenpairs: %d of %d converged in %d restarts a run",
                        L->nfound, def->npair, def->max_restarts);
    return find_missing(def, L, A, B);
}

OmStatus om_eigen_smallest(const OmEigenDef* def, const OmCsr* A, const OmCsr* B,
                           double* eigenvalue, double* eigenvector, OmEigenInfo* info) {
    OmEigenInfo own = {0};
    if (!info) info = &own;
    *info = own;
    OM_TRY(check_def(def, A, B));
    Lanczos L = {0};
    OmStatus status = lanczos_init(def, A, B, &L);
    if (status != OM_OK) goto done;
    pthread_mutex_lock(&arpack_lock);
    om__blas_begin(1);
    status = find_pairs(def, &L, A, B);
    om__blas_end();
    pthread_mutex_unlock(&arpack_lock);
    OM_TRY_DONE(status);
    double residual = worst_residual(def, &L, A);
    OM_CHECK_DONE(isfinite(residual), OM_INVALID,
                  "eigenpairs: the residual is not finite; the matrices are badly scaled");
    *info = (OmEigenInfo){L.nfound, L.nsolve, residual};
    size_t n = (size_t)A->n, found = (size_t)L.nfound, all = (size_t)def->npair;
    memset(eigenvalue + found, 0, (all - found) * sizeof *eigenvalue);
    memset(eigenvector + n * found, 0, n * (all - found) * sizeof *eigenvector);
    memcpy(eigenvalue, L.lambda, found * sizeof *eigenvalue);
    memcpy(eigenvector, L.x, n * found * sizeof *eigenvector);
done:
    lanczos_done(&L);
    return status;
}
