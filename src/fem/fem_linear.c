// fem_linear.c: the linear system of an iteration of Newton's method.
//
// A symmetric A that is not positive definite is assembled again from projected element tangents, and shifted by its
// diagonal if that is not enough: the step is then a descent direction. A pressure that follows a surface with a free
// rim makes A unsymmetric: then UMFPACK factors it, or, where the solver is iterative, GMRES uses the tangent without
// the pressure as preconditioner. On a closed surface, or one with a fixed or symmetric rim, the unsymmetric parts
// cancel, the pressure has an energy, and the symmetric solver is used.
#include <string.h>

#include "fem/fem_solid.h"

#define FORCE_ROUNDING 4e-16
// of the largest diagonal entry: smaller differences count as symmetric
#define SKEW_ROUNDING 1e-11
#define NATTEMPT 6

OmStatus om__newton_prepare(OmFemNewton* N) {
    N->has_follower = om__fem_has_follower(N->load);
    N->is_unsymmetric = false;
    if (!N->has_follower || N->is_explicit) return OM_OK;
    if (N->solver_def.preconditioner != OM_CHOLESKY)
        return N->B.nvert > 0 ? OM_OK : om_fem_matrix_create(N->solid, &N->B);
    if (!N->lu) {
        OmSolverDef def = N->solver_def;
        def.preconditioner = OM_LU;
        OM_TRY(om_solver_create(&def, &N->A, NULL, &N->lu));
    }
    om_solver_set_fixed(N->lu, N->fixed);
    return OM_OK;
}

// The tangent of `extra`; projected, each node loses the negative part of its own block.
static OmStatus add_extra(OmFemNewton* N, const double* x, double share, bool is_projected) {
    OmBsr* A = &N->A;
    const OmFemExtra* extra = N->load->extra;
    for (int i = 0; i < A->nvert && is_projected; ++i)
        memcpy(N->own + 9 * (size_t)i, A->exact + 9 * (size_t)A->row_adr[i], 9 * sizeof(double));
    OM_TRY(extra->eval(extra->ctx, x, share, NULL, NULL, A));
    for (int i = 0; i < A->nvert && is_projected; ++i) {
        const double *own = N->own + 9 * (size_t)i, *now = A->exact + 9 * (size_t)A->row_adr[i];
        if (memcmp(own, now, 9 * sizeof *own) == 0) continue;
        OmVec3 w;
        OmMat3 V, more = om_mat3_cols(om_sub(om_load3(now, 0), om_load3(own, 0)),
                                      om_sub(om_load3(now, 1), om_load3(own, 1)),
                                      om_sub(om_load3(now, 2), om_load3(own, 2)));
        om_mat3_eigen_symmetric(more, &w, &V);
        OmMat3 lift = om_mat3_diag(om_vec3(fmax(-w.x, 0), fmax(-w.y, 0), fmax(-w.z, 0)));
        om_bsr_add(A, A->row_adr[i], om_mat3_mul(V, om_mat3_mul(lift, om_mat3_transpose(V))));
    }
    return OM_OK;
}

// The tangent without the following pressure, which is added if there is no separate B; with a shift.
static OmStatus make_matrix(OmFemNewton* N, const double* x, double share, bool is_projected,
                            double shift) {
    OM_TRY(om__fem_tangent(N->solid, x, is_projected || N->solid->is_projected, &N->A));
    if (!is_projected && N->has_follower && N->lu)
        om__fem_add_follower(N->load, x, share, NULL, &N->A);
    if (N->load->extra) OM_TRY(add_extra(N, x, share, is_projected));
    if (N->inertia > 0) om_fem_add_mass(N->solid, N->inertia, N->is_consistent, &N->A);
    // Error of forces by rounding of positions, and the shift.
    double largest = 0, sum = 0;
    for (size_t i = 0; i < 3 * (size_t)N->solid->mesh.nnode; ++i)
        largest = fmax(largest, fabs(x[i]));
    for (int i = 0; i < N->A.nvert; ++i) {
        double d[3];
        for (int c = 0; c < 3; ++c) d[c] = N->A.exact[9 * (size_t)N->A.row_adr[i] + 4 * (size_t)c];
        for (int c = 0; c < 3; ++c) sum += d[c] * d[c];
        if (shift <= 0) continue;
        OmVec3 more = {shift * fabs(d[0]), shift * fabs(d[1]), shift * fabs(d[2])};
        om_bsr_add(&N->A, N->A.row_adr[i], om_mat3_diag(more));
    }
    N->rounding = FORCE_ROUNDING * largest * sqrt(sum);
    return OM_OK;
}

// B = A and the tangent of the pressure, for GMRES.
static void make_unsymmetric(OmFemNewton* N, const double* x, double share) {
    size_t num = 9 * (size_t)N->A.nblock;
    memcpy(N->B.value, N->A.value, num * sizeof *N->B.value);
    memcpy(N->B.exact, N->A.exact, num * sizeof *N->B.exact);
    om__fem_add_follower(N->load, x, share, NULL, &N->B);
}

// Is A unsymmetric between free degrees of freedom, beyond rounding?
static bool is_skew(const OmFemNewton* N, const OmBsr* A) {
    double max = 0, largest = 0;
    for (int i = 0; i < A->nvert; ++i) {
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
            int j = A->col[k];
            if (j < i) continue;
            const double* a = A->exact + 9 * (size_t)k;
            const double* b = A->exact + 9 * (size_t)om_bsr_find(A, j, i);
            for (int r = 0; r < 3; ++r) {
                if (j == i) largest = fmax(largest, fabs(a[4 * r]));
                for (int c = 0; c < 3; ++c)
                    if (!N->fixed[3 * i + r] && !N->fixed[3 * j + c])
                        max = fmax(max, fabs(a[3 * c + r] - b[3 * r + c]));
            }
        }
    }
    return max > SKEW_ROUNDING * largest;
}

// Solve with A, or with B and A as its preconditioner, or with the factors of an unsymmetric A.
static OmStatus solve_system(OmFemNewton* N, bool has_gmres, OmFemReport* report) {
    OmSolveInfo info = {0};
    OmSolver* S = N->is_unsymmetric && N->lu ? N->lu : N->solver;
    OmStatus status = om_solver_refresh(S, &N->A);
    if (status == OM_OK && has_gmres)
        status = om_solver_solve_gmres(S, &N->A, &N->B, fmax(N->solver_def.tolerance, 1e-12),
                                       N->work, N->dx, &info);
    else if (status == OM_OK)
        status = om_solver_solve(S, &N->A, 1, N->work, N->dx, &info);
    report->ncg += info.iterations;
    if (status != OM_INVALID) return status;
    snprintf(report->reason, sizeof report->reason, "the linear system is not finite");
    return OM_NOT_CONVERGED;  // an overflow in our own numbers
}

// Is dx a descent direction? Always true with prescribed motion, or without an energy.
static bool is_downhill(const OmFemNewton* N) {
    double slope = 0;
    bool is_driven = false;
    for (size_t i = 0; i < 3 * (size_t)N->solid->mesh.nnode; ++i) {
        if (N->fixed[i])
            is_driven = is_driven || N->dx[i] != 0;
        else
            slope += N->r[i] * N->dx[i];
    }
    return slope <= 0 || is_driven || N->is_unsymmetric;
}

OmStatus om__newton_step(OmFemNewton* N, const double* x, double share, OmFemReport* report) {
    size_t n = 3 * (size_t)N->solid->mesh.nnode;
    for (size_t i = 0; i < n; ++i) N->work[i] = -N->r[i];
    N->is_repaired = N->is_unsymmetric = false;
    bool has_gmres = false, is_followed = N->has_follower;
    int first = N->solid->is_projected && !is_followed ? 1 : 0;
    for (int attempt = first; attempt < NATTEMPT; ++attempt) {
        OM_TRY(make_matrix(N, x, share, attempt > 0, attempt < 2 ? 0 : pow(10, attempt - 5)));
        if (attempt == 0 && is_followed && N->lu) N->is_unsymmetric = is_skew(N, &N->A);
        if (attempt == 0 && is_followed && !N->lu) {
            make_unsymmetric(N, x, share);
            has_gmres = N->is_unsymmetric = is_skew(N, &N->B);
            if (!has_gmres)
                memcpy(N->A.value, N->B.value, 9 * (size_t)N->A.nblock * sizeof *N->A.value);
        }
        if (attempt > 0 && !has_gmres) N->is_unsymmetric = false;
        for (size_t i = 0; i < n; ++i)
            if (!N->fixed[i]) N->dx[i] = 0;
        OmStatus status = solve_system(N, has_gmres, report);
        if (status < 0 || (status == OM_NOT_CONVERGED && report->reason[0])) return status;
        // the preconditioner was not positive definite, but CG did not detect it
        if (has_gmres && status == OM_NOT_CONVERGED && attempt + 1 < NATTEMPT) continue;
        // The number of unstable directions since rest is even; an odd number would be detected here.
        bool is_odd =
            N->is_unsymmetric && N->lu && status != OM_NOT_SPD && om_solver_sign(N->lu) < 0;
        if (is_odd || (status == OM_NOT_SPD && !has_gmres)) N->is_repaired = true;
        if (status == OM_NOT_SPD || (is_odd && !N->is_plain)) continue;
        if (is_downhill(N)) return OM_OK;
    }
    snprintf(report->reason, sizeof report->reason,
             "the tangent could not be made positive definite");
    return OM_NOT_CONVERGED;
}
