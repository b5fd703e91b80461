// match_descriptor.c: a first map from vertices that are known to belong together.
//
// Descriptors are wave kernels (Aubry, Schlickewei and Cremers, "The Wave Kernel Signature", 2011): of each vertex,
// sum w_k(e) phi_k(x)^2, and of each landmark p, sum w_k(e) phi_k(p) phi_k(x), for NENERGY energies e with weights that
// are Gaussian in log lambda. With coefficients A of a's descriptors and B of b's, C minimises
//   |C A - B|^2 + w sum_ij (lambda_a_j - lambda_b_i)^2 / mean C_ij^2        (Ovsjanikov et al. 2012, eq. 7)
// row by row. The constant function belongs to the constant function. Both shapes use as many functions, those of the
// smaller basis: energies of different ranges are no descriptors of the same thing.
#include <math.h>
#include <string.h>

#include "match/match_spectral_internal.h"

#define NENERGY 20
#define COMMUTE 1e-2  // w above, times the mean square of the descriptors

// Coefficients of the descriptors by rows (npair x ndesc): kernel of the whole first, then of each landmark. The
// kernels are those of the first `nuse` functions.
static OmStatus make_descriptors(const OmSpectralBasis* s, int npair, int nuse, int nlandmark,
                                 const int* landmark, double* out) {
    OmStatus status = OM_OK;
    size_t n = (size_t)s->nrow, stride = (size_t)s->npair, k = (size_t)nuse;
    size_t ndesc = (size_t)(NENERGY * (nlandmark + 1));
    double *value = NULL, *weight = NULL;
    OM_CALLOC_DONE(value, n * ndesc);
    OM_ALLOC_DONE(weight, k);
    // energies of the functions after the constant one; by Weyl's law they are dimensionless with the area
    double lo = log(fmax(s->eigenvalue[1] * s->total_area, 1e-3));
    double hi = log(fmax(s->eigenvalue[k - 1] * s->total_area, 2e-3));
    double width = 7 * fmax(hi - lo, 1e-3) / NENERGY;
    for (size_t e = 0; e < NENERGY; ++e) {
        double energy = lo + (hi - lo) * (double)e / (NENERGY - 1), total = 0;
        weight[0] = 0;
        for (size_t p = 1; p < k; ++p) {
            double d = energy - log(fmax(s->eigenvalue[p] * s->total_area, 1e-3));
            total += weight[p] = exp(-0.5 * d * d / (width * width));
        }
        for (size_t p = 1; p < k; ++p) weight[p] /= total;  // > 0: energies lie between them
        for (int mark = -1; mark < nlandmark; ++mark) {
            const double* at = mark < 0 ? NULL : s->phi + (size_t)s->row[landmark[mark]] * stride;
            size_t column = e + NENERGY * (size_t)(mark + 1);
            for (size_t i = 0; i < n; ++i) {
                const double* phi = s->phi + i * stride;
                double sum = 0;
                for (size_t p = 1; p < k; ++p) sum += weight[p] * phi[p] * (at ? at[p] : phi[p]);
                value[i * ndesc + column] = sum * s->area[i] / s->total_area;
            }
        }
    }
    om__product_tn(s->nrow, npair, (int)ndesc, s->phi, s->npair, value, out);
done:
    om_free(value);
    om_free(weight);
    return status;
}

// Row i of C, for i >= 1: columns 1 .. npair - 1; that of the constant function is zero.
static bool solve_row(const OmSpectralBasis* a, const OmSpectralBasis* b, int npair,
                      const double* AAt, const double* ABt, int i, double* M, double* c) {
    int n = npair - 1;
    double mean = 0, trace = 0;
    for (int p = 1; p < npair; ++p)
        for (int q = 1; q < npair; ++q) {
            double d = a->eigenvalue[p] * a->total_area - b->eigenvalue[q] * b->total_area;
            mean += d * d / (n * n);
        }
    for (int p = 1; p < npair; ++p) trace += AAt[p * npair + p] / n;
    for (int p = 1; p < npair; ++p) {
        for (int q = 1; q < npair; ++q) M[(p - 1) * n + q - 1] = AAt[p * npair + q];
        double d = a->eigenvalue[p] * a->total_area - b->eigenvalue[i] * b->total_area;
        // the small part keeps M regular where descriptors are fewer than functions
        M[(p - 1) * n + p - 1] += trace * (COMMUTE * d * d / fmax(mean, 1e-300) + 1e-9);
        c[p] = ABt[p * npair + i];
    }
    c[0] = 0;
    return om__dense_solve(n, M, 1, c + 1);
}

static OmStatus check_landmarks(const OmSpectralBasis* s, const char* name, int num,
                                const int* landmark) {
    for (int k = 0; k < num; ++k)
        OM_CHECK(
            landmark[k] >= 0 && landmark[k] < s->nvert && s->row[landmark[k]] >= 0, OM_INVALID,
            "spectral map: landmark %d is vertex %d of %s, which has %d vertices and none there", k,
            landmark[k], name, s->nvert);
    return OM_OK;
}

OmStatus om_spectral_map_from_landmarks(const OmSpectralBasis* a, const OmSpectralBasis* b,
                                        int npair, int nlandmark, const int* landmark_a,
                                        const int* landmark_b, int* map) {
    OM_CHECK(npair >= 3 && npair <= a->npair && npair <= b->npair, OM_INVALID,
             "spectral map: %d functions; 3 or more, and the bases have %d and %d", npair, a->npair,
             b->npair);
    OM_CHECK(nlandmark >= 0 && nlandmark < 1000, OM_INVALID, "spectral map: %d landmarks",
             nlandmark);
    OM_TRY(check_landmarks(a, "a", nlandmark, landmark_a));
    OM_TRY(check_landmarks(b, "b", nlandmark, landmark_b));
    OmStatus status = OM_OK;
    size_t k = (size_t)npair, ndesc = (size_t)(NENERGY * (nlandmark + 1));
    double *A = NULL, *B = NULL, *AAt = NULL, *ABt = NULL, *M = NULL, *C = NULL;
    OM_ALLOC_DONE(A, k * ndesc);
    OM_ALLOC_DONE(B, k * ndesc);
    OM_ALLOC_DONE(AAt, k * k);
    OM_ALLOC_DONE(ABt, k * k);
    OM_ALLOC_DONE(M, k * k);
    OM_CALLOC_DONE(C, k * k);
    int nuse = a->npair < b->npair ? a->npair : b->npair;
    OM_TRY_DONE(make_descriptors(a, npair, nuse, nlandmark, landmark_a, A));
    OM_TRY_DONE(make_descriptors(b, npair, nuse, nlandmark, landmark_b, B));
    om__product_nt(npair, (int)ndesc, npair, 1, A, (int)ndesc, A, AAt);
    om__product_nt(npair, (int)ndesc, npair, 1, A, (int)ndesc, B, ABt);
    C[0] = a->phi[0] * b->phi[0] > 0 ? 1 : -1;
    for (int i = 1; i < npair; ++i)
        OM_CHECK_DONE(solve_row(a, b, npair, AAt, ABt, i, M, C + (size_t)i * k), OM_INVALID,
                      "spectral map: the landmarks do not determine function %d", i);
    OmSpectralDef def = om_spectral_default_def();
    OM_TRY_DONE(om_spectral_map_from_matrix(&def, a, b, npair, npair, C, map));
done:
    om_free(A);
    om_free(B);
    om_free(AAt);
    om_free(ABt);
    om_free(M);
    om_free(C);
    return status;
}
