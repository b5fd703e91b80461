// fem_explicit.c: the longest stable step of central differences.
//
// With K the tangent and M the lumped mass, central differences are stable up to h = 2 / omega, omega^2 the largest
// eigenvalue of M^-1/2 K M^-1/2. Lanczos' method finds it: after m products the largest eigenvalue of its
// tridiagonal matrix is below the true one by less than the last residual, which ends the iteration.
#include <string.h>

#include "fem/fem_solid.h"

#define MAX_LANCZOS 120
#define ENOUGH 2e-3  // relative error of the eigenvalue
#define SAFETY 0.98

// Largest eigenvalue of the tridiagonal matrix (a, b) by bisection on Sturm counts, and the size of the last entry
// of its eigenvector by inverse recurrence.
static double largest_eigenvalue(int m, const double* a, const double* b, double* last) {
    double lo = a[0], hi = a[0];
    for (int i = 0; i < m; ++i) {
        double r = (i > 0 ? fabs(b[i - 1]) : 0) + (i < m - 1 ? fabs(b[i]) : 0);
        lo = fmax(lo, a[i]);
        hi = fmax(hi, a[i] + r);
    }
    for (int turn = 0; turn < 100; ++turn) {
        double mid = 0.5 * (lo + hi), q = 1;
        bool is_above = true;  // all pivots of mid - T positive
        for (int i = 0; i < m && is_above; ++i) {
            q = mid - a[i] - (i > 0 ? b[i - 1] * b[i - 1] / q : 0);
            is_above = q > 0;
        }
        if (is_above)
            hi = mid;
        else
            lo = mid;
    }
    // (hi - T) y = e_last up to scale: y from the top by y[i+1] = (hi - a[i]) y[i] - b[i-1] y[i-1]) / b[i]
    double before = 0, y = 1, sum = 1;
    for (int i = 0; i < m - 1; ++i) {
        double next = b[i] != 0 ? ((hi - a[i]) * y - (i > 0 ? b[i - 1] * before : 0)) / b[i] : 0;
        before = y, y = next;
        sum += y * y;
    }
    *last = fabs(y) / sqrt(sum);
    return hi;
}

OmStatus om_fem_eval_stable_step(const OmFemSolid* s, const double* x, const unsigned char* fixed,
                                 double* h) {
    *h = 0;
    OmStatus status = OM_OK;
    OmBsr A = {0};
    size_t n = 3 * (size_t)s->mesh.nnode;
    double *u = NULL, *before = NULL, *w = NULL, *y = NULL;
    double a[MAX_LANCZOS], b[MAX_LANCZOS], omega2 = 0, last = 1, norm = 0;
    OM_TRY_DONE(om_fem_matrix_create(s, &A));
    OM_ALLOC_DONE(u, n);
    OM_CALLOC_DONE(before, n);
    OM_ALLOC_DONE(w, n);
    OM_ALLOC_DONE(y, n);
    OM_TRY_DONE(om__fem_tangent(s, x, true, &A));
    OmRng rng = om_rng_init(1, 0);
    for (size_t i = 0; i < n; ++i) {
        u[i] = fixed && fixed[i] ? 0 : om_rng_range(&rng, -1, 1);
        norm += u[i] * u[i];
    }
    OM_CHECK_DONE(norm > 0, OM_INVALID, "om_fem_eval_stable_step: every node is prescribed");
    for (size_t i = 0; i < n; ++i) u[i] /= sqrt(norm);
    for (int m = 0; m < MAX_LANCZOS; ++m) {
        for (size_t i = 0; i < n; ++i) y[i] = u[i] / sqrt(s->mass[i / 3]);  // mass is positive
        om_bsr_apply(&A, s->nworker, y, w);
        a[m] = 0, norm = 0;
        for (size_t i = 0; i < n; ++i) {
            w[i] = fixed && fixed[i] ? 0 : w[i] / sqrt(s->mass[i / 3]);
            a[m] += w[i] * u[i];
        }
        for (size_t i = 0; i < n; ++i) {
            w[i] -= a[m] * u[i] + (m > 0 ? b[m - 1] * before[i] : 0);
            norm += w[i] * w[i];
        }
        b[m] = sqrt(norm);
        omega2 = largest_eigenvalue(m + 1, a, b, &last);
        if (b[m] <= 1e-12 * omega2 || b[m] * last < ENOUGH * omega2) break;
        for (size_t i = 0; i < n; ++i) {
            before[i] = u[i];
            u[i] = w[i] / b[m];
        }
    }
    OM_CHECK_DONE(omega2 > 0, OM_INVALID, "om_fem_eval_stable_step: the solid has no stiffness");
    *h = SAFETY * 2 / sqrt(omega2);
done:
    om_bsr_destroy(&A);
    om_free(u);
    om_free(before);
    om_free(w);
    om_free(y);
    return status;
}
