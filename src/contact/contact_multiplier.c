// contact_multiplier.c: Signorini's law, satisfied exactly by Lagrange multipliers (thesis 3.8-3.12).
//
//     A dv = b + H^T lambda,   delta = delta_0 + h H dv,   0 <= lambda  _|_  delta >= 0
//
// lambda is an impulse, N s. Eliminating dv leaves W = H A^-1 H^T, one row and column a contact (three with
// friction). The stages of a step:
//
//   motion      A dv = b + H^T lambda_0. lambda_0 are the impulses of the last step, recovered from the nodal forces in
//               the state: a step is a function of the state and starts near its solution. With lambda_0 = 0, the
//               thesis's free motion, tissue pressed 20 mm springs back, and the correction must undo it
//   detection   contacts: points that were pushed, or penetrate by that motion
//   response    columns of W by block CG, eight at a time, to a loose tolerance: W only preconditions the correction
//   correction  projected Gauss-Seidel on delta_k + h W (lambda - lambda_k); dv is corrected by a loose solve of
//               A x = H^T (lambda - lambda_k), which gives a new delta, until every contact meets the law to
//               def.tolerance; at the end the whole system is solved to the model's tolerance from there, and checked
//
// By default (def.reuse 0, no friction) an augmented Lagrangian comes first (contact_penalty.c): the same law to the
// same tolerance without W, four times faster in the study of a breast, whose probe slides over more points than
// there are vertices under it. A step that does not converge is cut; W is used in the shortest substeps.
//
// With def.reuse above 1 columns are kept for some steps, as the thesis keeps its factor: a W of earlier steps corrects
// less in each iteration, and the solution is the same.
//
// Tried and rejected: solving the whole system for each correction (a residual of 1e-3 of all forces hides a small
// correction: it stalled at 1e-3); columns for all points near the probe (twice as many as contacts).
#include <string.h>

#include "contact/contact_press_internal.h"

#define LANES 8            // columns solved together
#define COLUMN_LOOSE 0.03  // residual of a column at first; 0.1 is a fifth quicker and diverged
#define COLUMN_TIGHT 1e-3  // smallest residual of a column
// a correction that leaves more than this of the error asks for better columns
#define SLOW_GAIN 0.4
#define DIVERGED 1.0         // error of the law beyond which another method is used
#define MOVE_LOOSE 0.03      // residual of a correction
#define SAME_DIRECTION 0.98  // cosine: a column is used for directions within this angle
#define SWEEPS 400           // of Gauss-Seidel at most
#define FIRST_ROOM 512       // contacts with memory at first

struct OmPressLcp {
    int dim;      // rows of a contact: 1, or 3 with friction
    int max;      // contacts with memory
    int num;      // contacts
    int ready;    // contacts with columns: the first ones
    int* near;    // entry in OmPress.near of each contact, -1 if not near in this step   (max)
    int* vert;    //                                                             (max)
    OmVec3* dir;  // of each row                                                 (max x dim)
    double* W;    // m s / (N s)                                    (max dim x max dim)
    double *lambda, *was;  // impulses, N s, and those of the last solve         (max x dim)
    double* delta;         // gap or slip of the last solve, m                   (max x dim)
    int nvert;
    double *b, *u;  // eight right-hand sides and solutions                      (8 x nvert x 3)
    double loose;   // residual of their columns
    int age;        // steps that used these columns
    double h;       // they were made for
};

OmStatus om__press_lcp_create(OmPressLcp** lcp) {
    *lcp = om_calloc(1, sizeof **lcp);
    return *lcp ? OM_OK : OM_NO_MEMORY;
}

static void free_rows(OmPressLcp* c) {
    om_free(c->near);
    om_free(c->vert);
    om_free(c->dir);
    om_free(c->W);
    om_free(c->lambda);
    om_free(c->was);
    om_free(c->delta);
    c->near = c->vert = NULL;
    c->dir = NULL;
    c->W = c->lambda = c->was = c->delta = NULL;
    c->max = c->num = c->ready = 0;
}

void om__press_lcp_destroy(OmPressLcp* c) {
    if (!c) return;
    free_rows(c);
    om_free(c->b);
    om_free(c->u);
    om_free(c);
}

void om__press_lcp_forget(OmPressLcp* c) {
    c->num = c->ready = c->age = 0;
    c->loose = COLUMN_LOOSE;
}

// Allocate memory for `num` contacts; if it had to grow, the columns must be computed again.
static OmStatus reserve(OmPressLcp* c, int dim, int num, int nvert) {
    if (!c->b) {
        c->b = om_calloc(LANES * 3 * (size_t)nvert, sizeof *c->b);
        if (!c->b) return OM_NO_MEMORY;
        c->u = om_calloc(LANES * 3 * (size_t)nvert, sizeof *c->u);
        if (!c->u) {
            om_free(c->b);
            c->b = NULL;
            return OM_NO_MEMORY;
        }
        c->nvert = nvert;
    }
    if (num <= c->max && dim == c->dim) return OM_OK;
    free_rows(c);
    size_t rows = (size_t)dim * (size_t)num;
    c->near = om_calloc((size_t)num, sizeof *c->near);
    c->vert = om_calloc((size_t)num, sizeof *c->vert);
    c->dir = om_calloc(rows, sizeof *c->dir);
    c->W = om_calloc(rows * rows, sizeof *c->W);
    c->lambda = om_calloc(rows, sizeof *c->lambda);
    c->was = om_calloc(rows, sizeof *c->was);
    c->delta = om_calloc(rows, sizeof *c->delta);
    if (!c->near || !c->vert || !c->dir || !c->W || !c->lambda || !c->was || !c->delta) {
        free_rows(c);
        return OM_NO_MEMORY;
    }
    c->dim = dim;
    c->max = num;
    return OM_OK;
}

static double* entry(const OmPressLcp* c, int row, int col) {
    return c->W + (size_t)row * (size_t)(c->max * c->dim) + col;
}

// ---- columns --------------------------------------------------------------------------------------

static void add_to_vertices(const OmPress* p, int vert, OmVec3 dir, double* b) {
    for (int a = 0; a < 4; ++a) {
        int v = p->embedding.tet_vert[4 * (size_t)vert + (size_t)a];
        om_store3(b, v,
                  om_madd(om_load3(b, v), p->embedding.bary[4 * (size_t)vert + (size_t)a], dir));
    }
}

// Columns of rows [first, dim num) of W, and by symmetry the rows.
static OmStatus solve_columns(OmPress* p, OmTissueWork* w, int first) {
    OmPressLcp* c = p->lcp;
    int rows = c->dim * c->num;
    size_t n3 = 3 * (size_t)c->nvert;
    om_tissue_set_tolerance(w, c->loose);
    for (int at = first; at < rows; at += LANES) {
        int num = rows - at < LANES ? rows - at : LANES;
        memset(c->b, 0, (size_t)num * n3 * sizeof *c->b);
        memset(c->u, 0, (size_t)num * n3 * sizeof *c->u);
        for (int k = 0; k < num; ++k)
            add_to_vertices(p, c->vert[(at + k) / c->dim], c->dir[at + k], c->b + (size_t)k * n3);
        OmStatus status = om_tissue_solve(p->model, w, num, c->b, c->u, NULL);
        if (status < 0) return status;
        p->report.ncolumn += num;
        for (int k = 0; k < num; ++k)
            for (int i = 0; i < rows; ++i)
                *entry(c, i, at + k) = om_dot(
                    c->dir[i], om__press_position(p, c->u + (size_t)k * n3, c->vert[i / c->dim]));
    }
    om_tissue_set_tolerance(w, 0);
    for (int i = 0; i < rows; ++i) {
        for (int j = first > i ? first : i + 1; j < rows; ++j) {
            double both = i < first ? *entry(c, i, j) : 0.5 * (*entry(c, i, j) + *entry(c, j, i));
            *entry(c, i, j) = *entry(c, j, i) = both;
        }
    }
    return OM_OK;
}

// ---- contacts ------------------------------------------------------------------------------------

static int find_contact(const OmPressLcp* c, int vert) {
    for (int k = 0; k < c->num; ++k)
        if (c->vert[k] == vert) return k;
    return -1;
}

static void set_directions(OmPressLcp* c, int k, OmVec3 n) {
    c->dir[k * c->dim] = n;
    if (c->dim == 1) return;
    c->dir[k * c->dim + 1] = om_orthogonal(n);
    c->dir[k * c->dim + 2] = om_cross(n, c->dir[k * c->dim + 1]);
}

// Make a point near the probe a contact with its own row, unless it is one already; false if there is no memory.
static bool add_contact(OmPress* p, int near) {
    OmPressLcp* c = p->lcp;
    OmPressPoint* t = &p->near[near];
    int k = find_contact(c, t->vert);
    t->is_active = true;
    if (k < 0) {
        if (c->num == c->max) return false;
        k = c->num++;
        c->vert[k] = t->vert;
        for (int r = 0; r < c->dim; ++r) c->lambda[k * c->dim + r] = 0;
    }
    c->near[k] = near;
    set_directions(c, k, t->n);
    return true;
}

// Compute impulses from the nodal forces of the last step: least squares by Gauss-Seidel on H H^T.
static void recall_impulses(OmPress* p, OmTissueState* s, double h) {
    OmPressLcp* c = p->lcp;
    const double* f = om_tissue_contact_force(s);
    int rows = c->dim * c->num;
    memset(c->u, 0, 3 * (size_t)c->nvert * sizeof *c->u);  // H^T lambda
    for (int sweep = 0; sweep < 60; ++sweep) {
        for (int i = 0; i < rows; ++i) {
            int vert = c->vert[i / c->dim];
            if (c->near[i / c->dim] < 0 || i % c->dim > 0) continue;
            const double* weight = p->embedding.bary + 4 * (size_t)vert;
            double error = 0, norm = 0;
            for (int a = 0; a < 4; ++a) {
                int v = p->embedding.tet_vert[4 * (size_t)vert + (size_t)a];
                OmVec3 d = om_sub(om_scale(h, om_load3(f, v)), om_load3(c->u, v));
                error += weight[a] * om_dot(c->dir[i], d);
                norm += weight[a] * weight[a];
            }
            double now = fmax(0, c->lambda[i] + error / norm), add = now - c->lambda[i];
            c->lambda[i] = now;
            add_to_vertices(p, vert, om_scale(add, c->dir[i]), c->u);
        }
    }
}

// ---- Gauss-Seidel ---------------------------------------------------------------------------------

static double predicted(const OmPressLcp* c, int i, double h) {
    int rows = c->dim * c->num;
    const double* W = entry(c, i, 0);
    double sum = 0;
    for (int j = 0; j < rows; ++j) sum += W[j] * (c->lambda[j] - c->was[j]);
    return c->delta[i] + h * sum;
}

// Project the tangential impulse into the disc of radius mu lambda_n.
static void project_friction(double* lambda, double mu) {
    double size = sqrt(lambda[1] * lambda[1] + lambda[2] * lambda[2]), max = mu * lambda[0];
    double factor = size > max ? max / size : 1;  // size > max >= 0
    lambda[1] *= factor;
    lambda[2] *= factor;
}

// Both tangential impulses of a contact at once and by one factor: the fixed point is Coulomb's law.
static double relax_friction(OmPress* p, int i, double h) {
    OmPressLcp* c = p->lcp;
    double *lambda = c->lambda + i, was1 = lambda[1], was2 = lambda[2];
    double unit = h * (*entry(c, i + 1, i + 1) + *entry(c, i + 2, i + 2));  // W is definite
    double d1 = predicted(c, i + 1, h) / unit, d2 = predicted(c, i + 2, h) / unit;
    lambda[1] -= d1;
    lambda[2] -= d2;
    project_friction(lambda, p->def.friction);
    return hypot(lambda[1] - was1, lambda[2] - was2);
}

// lambda of delta_k + h W (lambda - lambda_k), from lambda_k; stops at changes of `small` of the largest.
static void gauss_seidel(OmPress* p, double h, double small) {
    OmPressLcp* c = p->lcp;
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
        double change = 0, max = 0;
        for (int k = 0; k < c->num; ++k) {
            if (c->near[k] < 0) continue;
            int i = k * c->dim;
            double *lambda = c->lambda + i, old = lambda[0];
            lambda[0] = fmax(0, old - predicted(c, i, h) / (h * *entry(c, i, i)));
            change = fmax(change, fabs(lambda[0] - old));
            max = fmax(max, lambda[0]);
            if (c->dim > 1) change = fmax(change, relax_friction(p, i, h));
        }
        if (change <= small * max) return;
    }
}

// ---- the step -------------------------------------------------------------------------------------

// Set the forces of the points from the impulses.
static void set_forces(OmPress* p, double h) {
    const OmPressLcp* c = p->lcp;
    for (int k = 0; k < c->num; ++k) {
        if (c->near[k] < 0) continue;
        OmVec3 f = {0, 0, 0};
        for (int r = 0; r < c->dim; ++r)
            f = om_madd(f, c->lambda[k * c->dim + r] / h, c->dir[k * c->dim + r]);
        p->near[c->near[k]].force = f;
    }
}

static OmStatus add_impulses(OmPress* p, OmTissueWork* w, double h) {
    const OmPressLcp* c = p->lcp;
    OmMat3 none = om_mat3_diag(om_vec3(0, 0, 0));
    om_tissue_clear_forces(w);
    set_forces(p, h);
    for (int k = 0; k < c->num; ++k) {
        if (c->near[k] < 0) continue;
        OmVec3 f = p->near[c->near[k]].force;
        if (om_norm2(f) > 0) OM_TRY(om__press_add_force(p, w, c->vert[k], f, none));
    }
    return OM_OK;
}

// delta of all contacts after a solve, the error of their laws, and new contacts for free points that penetrate.
static OmStatus evaluate(OmPress* p, const OmTissueState* s, const OmTissueWork* w, double h,
                         int* nchange) {
    OmPressLcp* c = p->lcp;
    double max = 0, worst = 0;
    *nchange = 0;
    for (int k = 0; k < c->num; ++k)
        if (c->near[k] >= 0) max = fmax(max, c->lambda[k * c->dim]);
    double unit = max > 0 ? 1 / max : 0;
    for (int k = 0; k < c->num; ++k) {
        if (c->near[k] < 0) continue;
        OmPressPoint* t = &p->near[c->near[k]];
        double *lambda = c->lambda + k * c->dim, *delta = c->delta + k * c->dim;
        OmVec3 d = om__press_displacement(p, s, w, t->vert, h);
        if (om__press_update_plane(p, t, om_add(t->x, d), 0)) {
            if (om_dot(t->n, c->dir[k * c->dim]) < SAME_DIRECTION && k < c->ready) c->ready = k;
            set_directions(c, k, t->n);
            ++*nchange;
        }
        delta[0] = t->gap + om_dot(t->n, d) - t->goal;
        worst = fmax(worst, fabs(fmin(lambda[0] * unit, delta[0] / p->edge)));
        if (c->dim == 1) continue;
        OmVec3 slip = om_sub(d, t->probe_move);
        double would[3] = {lambda[0]};
        for (int r = 1; r < 3; ++r) {
            delta[r] = om_dot(c->dir[k * c->dim + r], slip);
            would[r] = lambda[r] - delta[r] * max / p->edge;
        }
        project_friction(would, p->def.friction);
        worst = fmax(worst, unit * hypot(would[1] - lambda[1], would[2] - lambda[2]));
    }
    for (int n = 0; n < p->nnear; ++n) {
        OmPressPoint* t = &p->near[n];
        if (t->is_active) continue;
        OmVec3 place = om_add(t->x, om__press_displacement(p, s, w, t->vert, h));
        double gap = om__press_gap(p, place) - t->goal;
        if (gap >= 0) continue;
        worst = fmax(worst, -gap / p->edge);
        if (gap > -0.1 * p->def.tolerance * p->edge) continue;
        om__press_linearise(p, t, place);
        OM_CHECK(add_contact(p, n), OM_INVALID, "press: more than %d contacts at once", c->max);
        int row = find_contact(c, t->vert) * c->dim;
        for (int r = 0; r < c->dim; ++r)
            c->delta[row + r] =
                r == 0 ? gap : om_dot(c->dir[row + r], om_sub(place, om_add(t->x, t->probe_move)));
        ++*nchange;
    }
    p->report.complementarity = worst;
    return OM_OK;
}

// The first contacts: points that were pushed in the last step, or penetrate by their prediction.
static OmStatus begin_contacts(OmPress* p, OmTissueState* s, double h) {
    OmPressLcp* c = p->lcp;
    int dim = p->def.friction > 0 ? 3 : 1;
    int room = p->surface.nvert < FIRST_ROOM ? p->surface.nvert : FIRST_ROOM;
    while (room < p->nnear) room *= 2;
    if (room > p->surface.nvert) room = p->surface.nvert;
    OM_TRY(reserve(c, dim, room, om_tissue_mesh(p->model)->nvert));
    if (c->age >= (p->def.reuse > 1 ? p->def.reuse : 1) || c->h != h) om__press_lcp_forget(c);
    if (c->num + p->nnear > c->max) om__press_lcp_forget(c);
    c->h = h;
    for (int k = 0; k < c->num; ++k) c->near[k] = -1;
    for (int k = 0; k < c->dim * c->max; ++k) c->lambda[k] = 0;
    for (int n = 0; n < p->nnear; ++n) {
        OmPressPoint* t = &p->near[n];
        double push = om_dot(om__press_position(p, om_tissue_contact_force(s), t->vert), t->n);
        double now = om_dot(t->n, t->probe_move) + t->gap;  // if it moved as the probe does
        bool was_pushed = push > 0 && now < 10 * OM_PRESS_ACTIVATE * p->size;
        if (was_pushed || t->gap + om_dot(t->n, t->predicted) - t->goal < 0) add_contact(p, n);
    }
    recall_impulses(p, s, h);
    return OM_OK;
}

// Remove contacts without a column that are neither pushed nor penetrate.
static void remove_inactive(OmPress* p) {
    OmPressLcp* c = p->lcp;
    int num = c->ready;
    for (int k = c->ready; k < c->num; ++k) {
        if (c->lambda[k * c->dim] == 0 && c->delta[k * c->dim] >= 0) {
            if (c->near[k] >= 0) p->near[c->near[k]].is_active = false;
            continue;
        }
        for (int r = 0; r < c->dim; ++r) {
            c->lambda[num * c->dim + r] = c->lambda[k * c->dim + r];
            c->delta[num * c->dim + r] = c->delta[k * c->dim + r];
            c->dir[num * c->dim + r] = c->dir[k * c->dim + r];
        }
        c->vert[num] = c->vert[k];
        c->near[num++] = c->near[k];
    }
    c->num = num;
}

// Correct dv for lambda - lambda_k.
static OmStatus correct_motion(OmPress* p, OmTissueWork* w, OmTissueReport* report) {
    OmPressLcp* c = p->lcp;
    OmSolveInfo info;
    size_t n3 = 3 * (size_t)c->nvert;
    memset(c->b, 0, n3 * sizeof *c->b);
    memset(c->u, 0, n3 * sizeof *c->u);
    for (int i = 0; i < c->num * c->dim; ++i)
        if (c->near[i / c->dim] >= 0)
            add_to_vertices(p, c->vert[i / c->dim], om_scale(c->lambda[i] - c->was[i], c->dir[i]),
                            c->b);
    om_tissue_set_tolerance(w, MOVE_LOOSE);
    OmStatus status = om_tissue_solve(p->model, w, 1, c->b, c->u, &info);
    om_tissue_set_tolerance(w, 0);
    if (status < 0) return status;
    om_tissue_add_dv(w, c->u);
    report->iterations += info.iterations;
    ++p->report.nsolve;
    return OM_OK;
}

// Columns, Gauss-Seidel and corrections of dv until all contacts meet their law, or solves run out.
static OmStatus correct(OmPress* p, const OmTissueState* s, OmTissueWork* w, double h, int max,
                        OmTissueReport* report) {
    OmPressLcp* c = p->lcp;
    int nchange = 1;
    while (p->report.nsolve < max - 1 &&
           (nchange > 0 || p->report.complementarity > p->def.tolerance)) {
        if (c->ready < c->num) OM_TRY(solve_columns(p, w, c->ready * c->dim));
        c->ready = c->num;
        memcpy(c->was, c->lambda, (size_t)(c->num * c->dim) * sizeof *c->was);
        gauss_seidel(p, h, fmin(1e-3, 0.1 * p->def.tolerance));
        OM_TRY(correct_motion(p, w, report));
        double before = p->report.complementarity;
        OM_TRY(evaluate(p, s, w, h, &nchange));
        if (!(p->report.complementarity < fmax(DIVERGED, 2 * before))) return OM_OK;
        if (nchange == 0 &&
            p->report.complementarity > fmax(SLOW_GAIN * before, p->def.tolerance) &&
            c->loose > COLUMN_TIGHT) {
            c->loose *= 0.1;
            c->ready = 0;
        }
    }
    return OM_OK;
}

static OmStatus refuse(const OmContactGroup* g, OmStatus status) {
    const OmPress* p = g->press[0];
    for (int k = 1; k < g->npress; ++k)
        if (g->press[k]->report.complementarity > p->report.complementarity) p = g->press[k];
    return om_error(status,
                    "press: contacts meet their law to %.3g, %.3g was asked for, after %d solves",
                    p->report.complementarity, p->def.tolerance, p->report.nsolve);
}

// Signorini's law of a single probe with a Delassus matrix.
static OmStatus solve_delassus(const OmContactGroup* g, const OmTissueModel* m, OmTissueState* s,
                               OmTissueWork* w, double h, OmTissueReport* report) {
    OmPress* p = g->press[0];
    OmTissueReport last = {0};
    OmStatus status = OM_OK;
    int nchange, first = p->report.nsolve, max = first + p->def.max_iterations;
    OM_TRY(begin_contacts(p, s, h));
    bool is_done = false;
    while (!is_done && p->report.nsolve < max) {
        OM_TRY(add_impulses(p, w, h));
        last = (OmTissueReport){0};
        status = om_tissue_solve_step(m, s, w, &last);
        if (status < 0) return status;
        report->iterations += last.iterations;
        bool is_first = p->report.nsolve++ == first;
        OM_TRY(evaluate(p, s, w, h, &nchange));
        if (is_first) remove_inactive(p);
        is_done = nchange == 0 && p->report.complementarity <= p->def.tolerance;
        if (!(p->report.complementarity < DIVERGED) && !is_first) break;
        if (!is_done) OM_TRY(correct(p, s, w, h, max, report));
    }
    ++p->lcp->age;
    if (is_done && status == OM_OK && om__press_check_depth(p, s, w, h) == OM_OK) {
        set_forces(p, h);
        report->residual = fmax(report->residual, last.residual);
    } else {
        om__press_lcp_forget(p->lcp);
        status = om__contact_augmented(g, m, s, w, h, report);
        if (status < 0) return status;
        is_done = p->report.is_settled;
    }
    p->report.is_settled = is_done;
    return status;
}

OmStatus om__contact_multipliers(const OmContactGroup* g, const OmTissueModel* m, OmTissueState* s,
                                 OmTissueWork* w, double h, OmTissueReport* report) {
    OmPress* p = g->press[0];
    OmStatus status = OM_OK;
    bool is_alone = g->npress == 1 && !g->contact;
    p->report.is_settled = false;
    if (is_alone) om__press_detect(p, s, w, h);
    if (!is_alone || (p->def.reuse == 0 && p->def.friction == 0)) {
        status = om__contact_augmented(g, m, s, w, h, report);
        if (status == OM_OK && p->report.is_settled) return status;
        if (om__press_may_cut(p, h)) return status < 0 ? status : refuse(g, OM_INVALID);
        if (!is_alone) return status != OM_OK ? status : refuse(g, OM_NOT_CONVERGED);
        om__press_detect(p, s, w, h);
    }
    status = solve_delassus(g, m, s, w, h, report);
    if (status != OM_OK || p->report.is_settled) return status;
    // refuse this step if a shorter one is available
    return refuse(g, om__press_may_cut(p, h) ? OM_INVALID : OM_NOT_CONVERGED);
}
