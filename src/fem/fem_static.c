// fem_static.c: equilibrium by load steps, as long as Newton's method converges.
//
// A step that does not converge, or ends with an inverted element, is halved and tried again from the last
// equilibrium; after a success a halved step doubles, never beyond the first length. From the second step on
// Newton's method begins on the straight line through the last two equilibria.
#include <string.h>

#include "fem/fem_solid.h"

#define COOKIE 0x50f7f302u
#define MAX_REPEAT 50  // largest number of repeated solves of a step for `extra`

OmFemStaticDef om_fem_static_default_def(const OmFemSolid* solid) {
    return (OmFemStaticDef){.nstep = 1,
                            .min_step = 1.0 / 4096,
                            .max_newton = 30,
                            .tolerance = 1e-9,
                            .solver = om__newton_solver_def(solid),
                            .cookie = COOKIE};
}

static OmStatus check_def(const OmFemStaticDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID,
             "OmFemStaticDef was not made by om_fem_static_default_def");
    OM_CHECK(def->load_begin >= 0 && def->load_begin < 1, OM_INVALID,
             "OmFemStaticDef.load_begin = %g, must be in [0, 1)", def->load_begin);
    OM_CHECK(def->nstep >= 1, OM_INVALID, "OmFemStaticDef.nstep = %d, must be at least 1",
             def->nstep);
    OM_CHECK(def->min_step > 0 && def->min_step <= 1, OM_INVALID,
             "OmFemStaticDef.min_step = %g, must be in (0, 1]", def->min_step);
    OM_CHECK(def->max_newton >= 1, OM_INVALID, "OmFemStaticDef.max_newton = %d, must be at least 1",
             def->max_newton);
    OM_CHECK(def->tolerance > 0 && def->tolerance < 1, OM_INVALID,
             "OmFemStaticDef.tolerance = %g, must be in (0, 1)", def->tolerance);
    return OM_OK;
}

// Newton's method, repeated while `extra` requests it; then no element may be inverted.
static OmStatus solve_step(OmFemNewton* N, double share, const double* target, const double* guess,
                           double* x, OmFemReport* report) {
    const OmFemExtra* extra = N->load->extra;
    OmStatus status = OM_NOT_CONVERGED;
    for (int turn = 0; turn < MAX_REPEAT; ++turn) {
        status = om__newton_solve(N, share, target, x, turn == 0 ? guess : NULL, report);
        if (status != OM_OK) return status;
        report->min_volume = om_fem_eval_volume(N->solid, x, NULL);
        if (!(report->min_volume > 0)) {
            snprintf(report->reason, sizeof report->reason,
                     "an element is inverted at equilibrium (least volume ratio %.3g)",
                     report->min_volume);
            return OM_NOT_CONVERGED;
        }
        if (extra && extra->finish) status = extra->finish(extra->ctx, x, share);
        if (status != OM_NOT_CONVERGED) return status;
    }
    snprintf(report->reason, sizeof report->reason,
             "OmFemExtra.finish was not content after %d solves", MAX_REPEAT);
    return OM_NOT_CONVERGED;
}

typedef struct Path {  // start and end of prescribed nodes, and the last two equilibria
    double *from, *to, *target, *good, *before, *guess;
    double load_before;  // of `before`; not below the last load: there is none
} Path;

static OmStatus create_path(size_t n, Path* p) {
    double** array[] = {&p->from, &p->to, &p->target, &p->good, &p->before, &p->guess};
    for (int k = 0; k < 6; ++k) OM_ALLOC(*array[k], n);
    return OM_OK;
}

static void begin_path(const OmFemNewton* N, const double* x, Path* p) {
    size_t n = 3 * (size_t)N->solid->mesh.nnode;
    const double* rest = N->solid->mesh.x;
    memcpy(p->from, x, n * sizeof *x);
    memcpy(p->good, x, n * sizeof *x);
    memcpy(p->before, x, n * sizeof *x);
    p->load_before = 2;
    for (size_t i = 0; i < n; ++i)
        p->to[i] = N->fixed[i] ? rest[i] + (N->load->goal ? N->load->goal[i] : 0) : x[i];
}

static void destroy_path(Path* p) {
    om_free(p->from);
    om_free(p->to);
    om_free(p->target);
    om_free(p->good);
    om_free(p->before);
    om_free(p->guess);
}

static OmStatus follow_path(OmFemNewton* N, const OmFemStaticDef* def, Path* p, double* x,
                            OmFemReport* report) {
    size_t n = 3 * (size_t)N->solid->mesh.nnode;
    double whole = 1 - def->load_begin, first = whole / def->nstep, step = first;
    char reason[sizeof report->reason] = "";
    while (report->load < 1) {
        double next = report->load + step;
        if (next > 1 - 1e-9 * whole) next = 1;
        double way = (next - def->load_begin) / whole;
        for (size_t i = 0; i < n; ++i)
            p->target[i] = next < 1 ? p->from[i] + way * (p->to[i] - p->from[i]) : p->to[i];
        bool has_guess = p->load_before < report->load;
        double more = has_guess ? (next - report->load) / (report->load - p->load_before) : 0;
        for (size_t i = 0; i < n; ++i) p->guess[i] = x[i] + more * (x[i] - p->before[i]);
        OmStatus status = solve_step(N, next, p->target, has_guess ? p->guess : NULL, x, report);
        if (status < 0) return status;
        if (status == OM_OK) {
            memcpy(p->before, p->good, n * sizeof *x);
            memcpy(p->good, x, n * sizeof *x);
            p->load_before = report->load;
            report->load = next;
            ++report->nstep;
            step = fmin(2 * step, first);
            OM_TRY(om_progress_report(def->progress, "load", next, 1));
            continue;
        }
        memcpy(reason, report->reason, sizeof reason);
        memcpy(x, p->good, n * sizeof *x);
        step *= 0.5;
        ++report->ncut;
        if (step < def->min_step * whole) {
            snprintf(report->reason, sizeof report->reason, "%s", reason);
            return om_error(OM_NOT_CONVERGED, "statics stopped at load %g: %s", report->load,
                            reason);
        }
    }
    return OM_OK;
}

// Forces on prescribed degrees of freedom, and the residual, of the returned state.
static OmStatus final_forces(OmFemNewton* N, const double* x, double* reaction,
                             OmFemReport* report) {
    size_t n = 3 * (size_t)N->solid->mesh.nnode;
    double sum = 0;
    OM_TRY(om__newton_residual(N, x, report->load, N->r, &report->force_scale));
    for (size_t i = 0; i < n; ++i)
        if (!N->fixed[i]) sum += N->r[i] * N->r[i];
    report->residual = report->force_scale > 0 ? sqrt(sum) / report->force_scale : 0;
    report->min_volume = om_fem_eval_volume(N->solid, x, NULL);
    for (size_t i = 0; i < n && reaction; ++i) reaction[i] = N->fixed[i] ? N->r[i] : 0;
    return OM_OK;
}

struct OmFemStatics {
    OmFemStaticDef def;
    OmFemNewton newton;
    Path path;
};

OmStatus om_fem_statics_create(const OmFemSolid* s, const OmFemStaticDef* def, OmFemStatics** out) {
    *out = NULL;
    OM_TRY(check_def(def));
    OmFemStatics* statics = om_calloc(1, sizeof *statics);
    if (!statics) return OM_NO_MEMORY;
    statics->def = *def;
    OmStatus status = om__newton_create(s, &def->solver, &statics->newton);
    if (status >= 0) status = create_path(3 * (size_t)s->mesh.nnode, &statics->path);
    statics->newton.max_newton = def->max_newton;
    statics->newton.tolerance = def->tolerance;
    statics->newton.is_plain_only = def->is_plain;
    statics->newton.progress = def->progress;
    if (status < 0)
        om_fem_statics_destroy(statics);
    else
        *out = statics;
    return status < 0 ? status : OM_OK;
}

void om_fem_statics_destroy(OmFemStatics* statics) {
    if (!statics) return;
    om__newton_done(&statics->newton);
    destroy_path(&statics->path);
    om_free(statics);
}

OmStatus om_fem_statics_solve(OmFemStatics* statics, const OmFemLoad* load, double* x,
                              double* reaction, OmFemReport* out) {
    OmFemNewton* N = &statics->newton;
    const OmFemMesh* mesh = &N->solid->mesh;
    OmFemReport report = {.load = statics->def.load_begin};
    if (out) *out = report;
    for (int i = 0; i < mesh->nnode; ++i)
        OM_CHECK(om_is_finite3(om_load3(x, i)), OM_INVALID, "position of node %d is not finite", i);
    OM_TRY(om__newton_set_load(N, load));
    begin_path(N, x, &statics->path);
    OmStatus status = follow_path(N, &statics->def, &statics->path, x, &report);
    if (status >= 0) {
        OmStatus forces = final_forces(N, x, reaction, &report);
        if (forces < 0) status = forces;
    }
    if (status < 0) memcpy(x, statics->path.from, 3 * (size_t)mesh->nnode * sizeof *x);
    if (out) *out = report;
    return status;
}

OmStatus om_fem_static_solve(const OmFemSolid* s, const OmFemLoad* load, const OmFemStaticDef* def,
                             double* x, double* reaction, OmFemReport* report) {
    if (report) *report = (OmFemReport){.load = def->load_begin};
    OmFemStatics* statics;
    OM_TRY(om_fem_statics_create(s, def, &statics));
    OmStatus status = om_fem_statics_solve(statics, load, x, reaction, report);
    om_fem_statics_destroy(statics);
    return status;
}
