// tissue_step.c: implicit Euler around an engine's matrix.
//
// An engine assembles A and b. Prescribed vertices have a known velocity change, dv = (x_goal - x) / h - v, and are
// eliminated from the system. Forces added between solves (contact) enter A and b. The force of a tool is the residual
// of the rows of its vertices, f_tool = (A dv - b) / h, inertia included. A step that breaks a rule of tissue_guard.c
// is mended: the work of its residual is removed, then it is linearised once more, then Newton's method continues, up
// to the first iterate that keeps the rules. A step that fails is halved, and substeps become longer again after
// successes. If a step with contact inverts an element, it is halved before Newton's method is tried: with contact
// there is no potential to minimise. Where tissue separates from a probe, Newton's method failed after 16 s (26,000
// elements), and shorter steps took a twentieth of that time. The shortest substep is h / 1024, for which inertia
// dominates: at h / 64, elements of a mesh of 177,000 still inverted.
#include <string.h>

#include "tissue/tissue_internal.h"

#define MIN_SHARE (1.0 / 1024)  // of h, the shortest substep
// Of h, the shortest substep for elements without a barrier.
#define SOFT_SHARE (1.0 / 4)
// OmSolverDef.row_bound: test_fem_quadratic measures 5.1 of single elements. A shell has 7.5 at a Poisson's ratio of
// 0.49, so the bound is the number of its nodes, which is always enough.
#define QUADRATIC_BOUND 6
#define SHELL_BOUND 8
#define SOLVE_WORK 10    // CG iterations that take as long as assembly, preconditioner and checks
#define GUARD_NEWTON 20  // iterations for a step that breaks a rule of tissue_guard.c
// Substeps that must succeed before a longer one is tried; doubled if that fails, up to the second.
#define NLENGTHEN 2
#define MAX_LENGTHEN 64

OmStatus om_tissue_work_create(const OmTissueModel* m, OmTissueWork** work) {
    *work = NULL;
    OmStatus status = OM_OK;
    OmTissueWork* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    size_t n = (size_t)m->mesh.nvert;
    w->nvert = m->mesh.nvert;
    w->engine = m->engine;
    w->share = 1;
    OM_CALLOC_DONE(w->key, n);
    OM_CALLOC_DONE(w->fixed, 3 * n);
    OM_CALLOC_DONE(w->b, 3 * n);
    OM_CALLOC_DONE(w->rhs, 3 * n);
    OM_CALLOC_DONE(w->dv, 3 * n);
    OM_CALLOC_DONE(w->x_end, 3 * n);
    OM_CALLOC_DONE(w->v_end, 3 * n);
    OM_CALLOC_DONE(w->from, 3 * n);
    OM_CALLOC_DONE(w->trial, 3 * n);
    OM_CALLOC_DONE(w->start, 3 * n);
    OM_CALLOC_DONE(w->elastic, 3 * n);
    OM_CALLOC_DONE(w->extra, n);
    OM_CALLOC_DONE(w->is_extra, n);
    OM_CALLOC_DONE(w->extra_f, n);
    OM_CALLOC_DONE(w->extra_K, n);
    OM_CALLOC_DONE(w->extra_diag, 9 * n);
    w->backup = om_calloc(1, om_tissue_state_size(m));
    if (!w->backup) {
        status = OM_NO_MEMORY;
        goto done;
    }
    if (om__has_matrix(m)) {
        OM_TRY_DONE(om_bsr_create(m->mesh.nvert, m->nelem, m->nelem_node, om__elem_node(m), &w->A));
        OmSolverDef solver = m->def.solver;
        if (m->def.element == OM_ELEMENT_QUADRATIC)
            solver.row_bound = fmax(solver.row_bound, QUADRATIC_BOUND);
        if (m->def.element == OM_ELEMENT_SHELL)
            solver.row_bound = fmax(solver.row_bound, SHELL_BOUND);
        OM_TRY_DONE(om_solver_create(&solver, &w->A, m->mesh.x, &w->solver));
    }
    if (m->engine->create_work) OM_TRY_DONE(m->engine->create_work(m, w));
    *work = w;
    return OM_OK;
done:
    om_tissue_work_destroy(w);
    return status;
}

void om_tissue_work_destroy(OmTissueWork* w) {
    if (!w) return;
    if (w->data && w->engine->destroy_work) w->engine->destroy_work(w);
    om_solver_destroy(w->solver);
    om_bsr_destroy(&w->A);
    om_free(w->key);
    om_free(w->fixed);
    om_free(w->b);
    om_free(w->rhs);
    om_free(w->dv);
    om_free(w->x_end);
    om_free(w->v_end);
    om_free(w->from);
    om_free(w->trial);
    om_free(w->start);
    om_free(w->elastic);
    om_free(w->extra);
    om_free(w->is_extra);
    om_free(w->extra_f);
    om_free(w->extra_K);
    om_free(w->extra_diag);
    om_free(w->point);
    om_free(w->undo);
    om_ties_destroy(w->ties);
    om_ties_destroy(w->bonds);
    om_free(w->tie);
    om_free(w->backup);
    om_free(w);
}

// ---- stages ---------------------------------------------------------------------------------------

// The target of a prescribed vertex at the end of the step.
static OmVec3 goal_of(const OmTissueState* s, const OmTissueWork* w, int i) {
    int arm = om__state_held_by(s)[i];
    if (arm < 0) return om_load3(om__state_array(s, OM__ANCHOR), i);
    return om_pose_apply(w->next[arm], om_load3(om__state_array(s, OM__GRIP), i));
}

static void prescribe(const OmTissueState* s, OmTissueWork* w, int i) {
    OmVec3 x = om_load3(om__state_array(s, OM__X), i), v = om_load3(om__state_array(s, OM__V), i);
    om_store3(w->dv, i, om_sub(om_scale(1 / w->h, om_sub(goal_of(s, w, i), x)), v));
}

// Pass the prescribed vertices to the solver if they changed.
static void refresh_fixed(const OmTissueState* s, OmTissueWork* w) {
    bool is_changed = false;
    for (int i = 0; i < w->nvert; ++i) {
        unsigned char key = om__is_prescribed(s, i);
        if (key == w->key[i]) continue;
        is_changed = true;
        w->key[i] = key;
        memset(w->fixed + 3 * (size_t)i, key, 3);
    }
    if (is_changed) om_solver_set_fixed(w->solver, w->fixed);
}

OmStatus om_tissue_begin_step(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double h) {
    OM_CHECK(h > 0 && h <= 10, OM_INVALID, "tissue: time step is %g s; it must be in (0, 10]", h);
    OM_CHECK(om__has_matrix(m), OM_UNAVAILABLE, "tissue: engine \"%s\" has no stages to a step",
             m->engine->name);
    w->nextra = w->npoint = w->nundo = w->ntie = 0;
    w->A.ties = w->bonds;
    memset(w->is_extra, 0, (size_t)w->nvert);
    w->force_scale = 0;
    om_solver_set_tolerance(w->solver, 0);
    refresh_fixed(s, w);
    for (int arm = 0; arm < OM_MAX_ARM; ++arm)
        w->next[arm] = om_pose_lerp(s->arm[arm].pose, s->arm[arm].goal, w->share);
    double a = m->def.rayleigh_mass, b = m->def.rayleigh_stiffness;
    OmAssembly at = {.x = om__state_array(s, OM__X),
                     .v = om__state_array(s, OM__V),
                     .mass = 1 + h * a,
                     .stiffness = h * h + h * b,
                     .force = h,
                     .lag = h + b,
                     .spring = h * h,
                     .spring_lag = h};
    if (!w->is_static) OM_TRY(om__assemble(m, s, w, &at));
    w->h = h;
    w->is_fresh = w->is_stale = true;
    memset(w->dv, 0, 3 * (size_t)w->nvert * sizeof(double));
    for (int i = 0; i < w->nvert; ++i)
        if (w->key[i]) prescribe(s, w, i);
    return OM_OK;
}

void om_tissue_add_force(OmTissueWork* w, int i, OmVec3 f, OmMat3 K) {
    om__points_undo(w);
    if (!w->is_extra[i]) {
        w->is_extra[i] = 1;
        w->extra[w->nextra++] = i;
        w->extra_f[i] = om_vec3(0, 0, 0);
        w->extra_K[i] = om_mat3_diag(w->extra_f[i]);
        memcpy(w->extra_diag + 9 * (size_t)i, w->A.value + 9 * (size_t)w->A.row_adr[i],
               9 * sizeof(float));
    }
    w->extra_f[i] = om_add(w->extra_f[i], f);
    w->extra_K[i] = om_mat3_add(w->extra_K[i], K);
    w->is_changed = true;
}

void om_tissue_clear_forces(OmTissueWork* w) {
    w->is_changed |= w->nundo > 0 || w->nextra > 0 || w->ntie > 0;
    om__points_undo(w);
    for (int k = 0; k < w->nextra; ++k) {
        int i = w->extra[k];
        w->is_extra[i] = 0;
        memcpy(w->A.value + 9 * (size_t)w->A.row_adr[i], w->extra_diag + 9 * (size_t)i,
               9 * sizeof(float));
    }
    w->nextra = w->npoint = w->ntie = 0;
    w->A.ties = w->bonds;
}

// Add the extra forces to the diagonal blocks and the right-hand side: b += h f - h^2 K v, A += h^2 K.
static OmStatus add_extra(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w) {
    const double* v = om__state_array(s, OM__V);
    memcpy(w->rhs, w->b, 3 * (size_t)w->nvert * sizeof(double));
    om__points_undo(w);
    for (int n = 0; n < w->nextra; ++n) {
        int i = w->extra[n];
        OmVec3 Kv = om_mat3_apply(w->extra_K[i], om_load3(v, i));
        OmVec3 add = om_madd(om_scale(w->h, w->extra_f[i]), -w->h * w->h, Kv);
        om_store3(w->rhs, i, om_add(om_load3(w->rhs, i), add));
        memcpy(w->A.value + 9 * (size_t)w->A.row_adr[i], w->extra_diag + 9 * (size_t)i,
               9 * sizeof(float));
        om_bsr_add(&w->A, w->A.row_adr[i], om_mat3_scale(w->h * w->h, w->extra_K[i]));
    }
    om__points_apply(s, w);
    return om__ties_apply(m, s, w);
}

// Penalties on moving vertices make the right-hand side large, and any residual of the tissue is small relative to it.
// With added forces the tolerance is therefore relative to the right-hand side without them.
static double reference_norm(const OmTissueWork* w) {
    double sum = w->h * w->h * w->force_scale * w->force_scale;
    if (w->reference > 0 || w->nextra + w->npoint + w->ntie == 0) return w->reference;
    for (int i = 0; i < w->nvert; ++i)
        if (!w->key[i]) sum += om_norm2(om_load3(w->b, i));
    return sqrt(sum);
}

static OmStatus refresh_solver(OmTissueWork* w) {
    if (!w->is_stale && !w->is_changed) return OM_OK;
    OmStatus status = w->is_stale ? om_solver_refresh(w->solver, &w->A)
                                  : om_solver_refresh_diagonal(w->solver, &w->A);
    if (status < 0) return status;
    OM_CHECK(status == OM_OK, OM_INVALID,
             "tissue: the system matrix of this step is not positive definite");
    w->is_stale = w->is_changed = false;
    return OM_OK;
}

OmStatus om_tissue_solve_step(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                              OmTissueReport* report) {
    OM_CHECK(w->h > 0, OM_INVALID, "tissue: om_tissue_begin_step must come first");
    OM_TRY(add_extra(m, s, w));
    OM_TRY(refresh_solver(w));
    om_solver_set_reference(w->solver, reference_norm(w));
    OmSolveInfo info = {0};
    OmStatus status = om_solver_solve(w->solver, &w->A, 1, w->rhs, w->dv, &info);
    if (status < 0) return status;
    double sum = 0;  // not finite if any entry is not
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) sum += fabs(w->dv[n]);
    OM_CHECK(status != OM_NOT_SPD && isfinite(sum), OM_INVALID,
             "tissue: the linear system of this step has no finite solution");
    w->is_fresh = false;
    w->work += info.iterations + SOLVE_WORK;
    if (report) {
        report->iterations += info.iterations;
        report->residual = fmax(report->residual, info.residual);
    }
    return status;
}

bool om_tissue_is_spent(const OmTissueModel* m, const OmTissueWork* w) {
    return om__is_spent(m, w);
}

void om_tissue_set_tolerance(OmTissueWork* w, double tolerance) {
    if (w->solver) om_solver_set_tolerance(w->solver, tolerance);
}

void om_tissue_renew_solver(OmTissueWork* w) { w->is_stale = true; }

void om_tissue_set_force_scale(OmTissueWork* w, double force) { w->force_scale = force; }

const double* om_tissue_dv(const OmTissueWork* w) { return w->dv; }

void om_tissue_add_dv(OmTissueWork* w, const double* correction) {
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) w->dv[n] += correction[n];
}

void om_tissue_stop_tools(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w) {
    (void)m;
    for (int arm = 0; arm < OM_MAX_ARM; ++arm) w->next[arm] = s->arm[arm].pose;
    for (int i = 0; i < w->nvert; ++i)
        if (om__state_held_by(s)[i] >= 0) prescribe(s, w, i);
}

OmStatus om_tissue_apply(const OmTissueModel* m, OmTissueWork* w, int nrhs, const double* x,
                         double* y) {
    OM_CHECK(w->h > 0 && nrhs >= 1, OM_INVALID,
             "tissue: om_tissue_begin_step must come first, and nrhs (%d) be at least 1", nrhs);
    size_t n = 3 * (size_t)w->nvert;
    for (int k = 0; k < nrhs; ++k)
        om_bsr_apply(&w->A, m->def.solver.nworker, x + (size_t)k * n, y + (size_t)k * n);
    return OM_OK;
}

OmStatus om_tissue_solve(const OmTissueModel* m, OmTissueWork* w, int nrhs, const double* b,
                         double* x, OmSolveInfo* info) {
    (void)m;
    OM_CHECK(w->h > 0 && nrhs >= 1, OM_INVALID,
             "tissue: om_tissue_begin_step must come first, and nrhs (%d) be at least 1", nrhs);
    OM_TRY(refresh_solver(w));
    om_solver_set_reference(w->solver, 0);
    for (int k = 0; k < nrhs; ++k)
        for (int i = 0; i < w->nvert; ++i)
            if (w->key[i]) om_store3(x + 3 * (size_t)k * (size_t)w->nvert, i, om_vec3(0, 0, 0));
    OmStatus status = om_solver_solve(w->solver, &w->A, nrhs, b, x, info);
    OM_CHECK(status != OM_NOT_SPD, OM_INVALID,
             "tissue: the system matrix is not positive definite");
    return status;
}

double om_tissue_vertex_stiffness(const OmTissueWork* w, int i) {
    const float* d =
        w->is_extra[i] ? w->extra_diag + 9 * (size_t)i : w->A.value + 9 * (size_t)w->A.row_adr[i];
    return ((double)d[0] + (double)d[4] + (double)d[8]) / (3 * w->h * w->h);
}

OmStatus om_tissue_end_step(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w) {
    (void)m;
    OM_CHECK(w->h > 0 && !w->is_fresh, OM_INVALID, "tissue: om_tissue_solve_step must come first");
    double *x = om__state_array(s, OM__X), *v = om__state_array(s, OM__V);
    double* f_tool = om__state_array(s, OM__F_TOOL);
    const signed char* by = om__state_held_by(s);
    double h = w->h;
    for (int i = 0; i < w->nvert; ++i) {
        if (by[i] < 0) continue;
        OmVec3 r = om_sub(om__apply_row(&w->A, w->dv, i), om_load3(w->rhs, i));
        om_store3(f_tool, i, om_scale(1 / h, r));
    }
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) {
        v[n] += w->dv[n];
        x[n] += h * v[n];
    }
    for (int i = 0; i < w->nvert; ++i)  // exact, unlike x + h ((goal - x) / h)
        if (w->key[i]) om_store3(x, i, goal_of(s, w, i));
    for (int arm = 0; arm < OM_MAX_ARM; ++arm) s->arm[arm].pose = w->next[arm];
    s->time += h;
    w->h = 0;
    return OM_OK;
}

// ---- whole steps ----------------------------------------------------------------------------------

typedef struct Solve {
    OmTissueStepFn fn;
    void* ctx;
} Solve;

// Copy the guard's findings on an accepted substep into the report; OM_NOT_CONVERGED if it broke a rule.
static OmStatus judge(const OmGuard* g, OmStatus status, OmTissueReport* report) {
    report->ninverted = g->ninverted;
    report->energy_gain = fmax(report->energy_gain, g->gain);
    if (!g->is_bad) return status;
    report->is_unguarded = true;
    om__guard_refuse(g);
    return OM_NOT_CONVERGED;
}

// True if every crushed element has a law with finite energy at det F = 0 (corotational, linear, St Venant-Kirchhoff,
// stable neo-Hookean). Substeps below SOFT_SHARE do not prevent their inversion.
static bool is_soft(const OmGuard* g) { return g->ncrushed > 0 && g->nbarrier == 0; }

static double shortest_share(const OmGuard* g) {
    return is_soft(g) && g->gain <= g->bound ? SOFT_SHARE : MIN_SHARE;
}

// True if the step broke a rule and may still be halved.
static bool is_refused(const OmGuard* g, double share) {
    return g->is_bad && share >= 2 * shortest_share(g);
}

// A step that broke a rule, without contact and inverted elements: cheaper remedies than Newton's method, which is to
// follow if the guard is still bad. Inverted elements come back only with its line search.
static OmStatus mend(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double share,
                     OmGuard* guard, OmStatus* status, OmTissueReport* report) {
    for (int turn = 0; turn < 2; ++turn) {
        double growth;
        if (guard->ncrushed == 0 && om__guard_project(m, s, w, guard, &growth)) {
            *guard = om__guard_step(m, s, w, share, false);
            report->residual *= fmax(1, growth);
        }
        if (!guard->is_bad || turn == 1 || om__is_spent(m, w)) break;
        *status = om__relinearise(m, s, w, report);
        if (*status < 0) return *status;
        *guard = om__guard_step(m, s, w, share, false);
    }
    return OM_OK;
}

// The displacement of free vertices is halved until the step breaks no rule; at last they stop where they are.
static void hold_back(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w, double share,
                      OmGuard* guard) {
    const double* v = om__state_array(s, OM__V);
    for (double left = 0.5; guard->is_bad; left = left > 0.1 ? 0.5 * left : 0) {
        for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n)
            if (!w->fixed[n]) w->dv[n] = (left > 0 ? 0.5 : 0) * (v[n] + w->dv[n]) - v[n];
        *guard = om__guard_step(m, s, w, share, false);
        if (left <= 0) break;
    }
}

// share: fraction of the whole step.
static OmStatus try_step(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double h,
                         double share, const Solve* solve, OmTissueReport* report) {
    OM_TRY(om_tissue_begin_step(m, s, w, h));
    OmStatus status = solve->fn ? solve->fn(solve->ctx, m, s, w, h, report)
                                : om_tissue_solve_step(m, s, w, report);
    if (status < 0) return status;
    OmGuard guard = om__guard_step(m, s, w, share, false);
    if (guard.is_bad && guard.ninverted == 0 && m->def.max_newton <= 1 && !solve->fn)
        OM_TRY(mend(m, s, w, share, &guard, &status, report));
    // Newton's method helps little with contact, and where the energy of an inverted element is not smooth.
    bool is_creased = guard.nbarrier == 0 && guard.ninverted > 0 && share < 2 * SOFT_SHARE;
    bool is_cut = guard.is_bad && m->def.max_newton <= 1 && (solve->fn || is_creased);
    bool is_spent = om__is_spent(m, w), is_short = is_spent && m->def.max_newton > 1;
    if (is_cut && !is_spent && is_refused(&guard, share)) return om__guard_refuse(&guard);
    if (!is_spent && (m->def.max_newton > 1 || (guard.is_bad && !is_cut))) {
        OmNewton newton = {.tolerance = m->def.newton_tolerance,
                           .scale = om__newton_scale(m, w),
                           .max_iterations =
                               m->def.max_newton > 1 ? m->def.max_newton : GUARD_NEWTON,
                           .fn = solve->fn,
                           .ctx = solve->ctx,
                           .share = m->def.max_newton > 1 || solve->fn ? 0 : share};
        // The tolerances of Newton's linear solves refer to decreasing norms: the criterion is
        // Newton's own residual.
        double linear = report->residual, worst = report->newton_residual;
        status = om__newton(m, s, w, &newton, report);
        if (status < 0) return status;
        bool is_useful = status == OM_OK || newton.is_at_floor;
        report->residual = linear;
        report->newton_residual = fmax(worst, report->newton_residual);
        // om__newton has set the message if it did not converge
        guard = newton.is_guarded ? newton.guard : om__guard_step(m, s, w, share, is_useful);
        is_spent = om__is_spent(m, w);
        is_short = is_spent && !is_useful;
        bool is_last = is_spent || share < 2 * shortest_share(&guard);
        if (!is_last && !is_useful) return om_error_prefix(OM_INVALID, "step of %.3g s", h);
        if (!is_spent && is_refused(&guard, share)) return om__guard_refuse(&guard);
    }
    report->is_work_spent |= is_short || (is_spent && guard.is_bad);
    if (is_spent && guard.is_bad) hold_back(m, s, w, share, &guard);
    OM_TRY(om_tissue_end_step(m, s, w));
    ++report->substeps;
    return judge(&guard, status, report);
}

OmStatus om_tissue_step_with(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double h,
                             OmTissueStepFn fn, void* ctx, OmTissueReport* report) {
    OmTissueReport local;
    if (!report) report = &local;
    *report = (OmTissueReport){0};
    OM_CHECK(h > 0 && h <= 10, OM_INVALID, "tissue: time step is %g s; it must be in (0, 10]", h);
    OM_CHECK(
        !m->engine->step || !fn, OM_UNAVAILABLE,
        "tissue: engine \"%s\" solves no system in a step; om_tissue_step_among takes obstacles",
        m->engine->name);
    OM_TRY(om_stop_poll());
    if (m->engine->step) return m->engine->step(m, s, w, h, 0, NULL, report);
    OmStatus outcome = OM_OK;
    Solve solve = {fn, ctx};
    w->work = 0;
    double left = h, part = h;
    bool is_cut = false;
    int ngood = 0, need = NLENGTHEN;
    while (left > 1e-9 * h) {
        part = om__is_spent(m, w) ? left : fmin(part, left);
        w->share = part / left;
        double residual = report->residual, newton_residual = report->newton_residual;
        double gain = report->energy_gain;
        OmStatus status = try_step(m, s, w, part, part / h, &solve, report);
        w->share = 1;
        if (status >= 0) {
            left -= part;
            if (status > 0) outcome = status;
            if (++ngood % need == 0) part *= 2;
            continue;
        }
        // Halve the step; the state at its beginning is kept from the first failure on.
        report->residual = residual;
        report->newton_residual = newton_residual;
        report->energy_gain = gain;
        if (!is_cut) memcpy(w->backup, s, om__state_bytes(s));
        is_cut = true;
        if (ngood > 0 && need < MAX_LENGTHEN) need *= 2;
        ngood = 0;
        part *= 0.5;
        bool may_cut = part >= MIN_SHARE * h && !om__is_spent(m, w);
        if (may_cut && status != OM_NO_MEMORY && status != OM_CANCELLED) continue;
        memcpy((void*)s, w->backup, om__state_bytes(s));
        report->substeps = report->ninverted = 0;
        report->energy_gain = 0;
        report->is_unguarded = report->is_work_spent = false;
        return om_error_prefix(status, "step at %.4g s failed, cut to %.3g s", s->time, part);
    }
    if (report->is_work_spent)
        return om_error(OM_NOT_CONVERGED,
                        "tissue: the step at %.4g s needs more than max_work %d: %d iterations, %d "
                        "substeps, %d of Newton",
                        s->time, m->def.max_work, report->iterations, report->substeps,
                        report->newton);
    if (report->ninverted == 0) return outcome;
    return om_error(OM_NOT_CONVERGED,
                    "tissue: %d elements are inverted after the step at %.4g s: " OM__INVERTED,
                    report->ninverted, s->time);
}

OmStatus om_tissue_step(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double h,
                        OmTissueReport* report) {
    return om_tissue_step_with(m, s, w, h, NULL, NULL, report);
}

static bool is_pose(OmPose p) {
    double unit = p.q.x * p.q.x + p.q.y * p.q.y + p.q.z * p.q.z + p.q.w * p.q.w;
    return om_is_finite3(p.p) && fabs(unit - 1) < 1e-6;
}

// Check the inputs of each obstacle, and clear the fields that a step writes.
static OmStatus check_obstacles(int nobstacle, OmTissueObstacle* obstacle) {
    for (int k = 0; k < nobstacle; ++k) {
        OmTissueObstacle* o = &obstacle[k];
        OM_CHECK(o->distance && is_pose(o->pose_begin) && is_pose(o->pose_end), OM_INVALID,
                 "tissue: obstacle[%d] has no distance, or a pose that is not finite or whose "
                 "quaternion is not of unit length",
                 k);
        o->force = o->torque = om_vec3(0, 0, 0);
        o->ncontact = 0;
        o->penetration = 0;
    }
    return OM_OK;
}

OmStatus om_tissue_step_among(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double h,
                              int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report) {
    OmTissueReport local;
    if (!report) report = &local;
    *report = (OmTissueReport){0};
    OM_CHECK(h > 0 && h <= 10, OM_INVALID, "tissue: time step is %g s; it must be in (0, 10]", h);
    OM_CHECK(m->engine->step, OM_UNAVAILABLE,
             "tissue: engine \"%s\" needs room contact to keep out of obstacles", m->engine->name);
    OM_CHECK(nobstacle >= 0 && (nobstacle == 0 || obstacle), OM_INVALID,
             "tissue: %d obstacles, and their list is null or the count negative", nobstacle);
    OM_TRY(check_obstacles(nobstacle, obstacle));
    OM_TRY(om_stop_poll());
    return m->engine->step(m, s, w, h, nobstacle, obstacle, report);
}
