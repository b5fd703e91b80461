// contact_penalty.c: stiff one-sided springs at contact points (thesis 3.7), implicit; with a prescribed area
// (contact_prescribed.c) also the prescribed method.
//
// An active point gets the force k (goal - gap) n at the end of the step, where k is a hundred times the resistance
// against moving the point alone. The step minimises
//
//     Phi(dv) = 1/2 dv . A dv - b . dv + sum 1/2 k min(0, gap - goal)^2
//
// by a semismooth Newton iteration on the active set: solve, release points that are pulled, activate points that
// penetrate, solve again. From the third solve on a line search limits the step: Phi is a parabola on every piece of
// it, and its slope costs one product with A. Only the first solve of a step makes coarse matrices.
//
// A plane that differs from the probe at the solution, by gap or angle, is linearised again (contact_point.c). From the
// fifth solve on a spring to the last position damps points that move along an edge of the probe; a point has converged
// when this spring tilts the contact force by no more than the angle allowed for a plane. Vertices against the
// obstacles of an OmContact (contact_vertex.c) and several probes share one system, one line search and one test of
// convergence.
//
// Friction is Coulomb's with the normal force of the last solve, viscous below 1 mm/s. Later solves use its tangent
// (Newton's method), and the line search its potential. Where tissue snaps off, a step is cut after ten solves.
// Rejected (doc/notes/contact_tool.md): no line search (cycles between points of one facet); friction with the
// coefficient of the last solve (45 and 226 solves a step instead of six and five).
#include <string.h>

#include "contact/contact_press_internal.h"

#define STIFF 100            // times the resistance against moving a point alone
#define SEARCH_FROM 2        // solves before line searches
#define ROUNDS 8             // updates of multipliers at most
#define CUT_AFTER 10         // solves before the step is cut
#define DAMP_FROM 4          // solves before displacements along a curved probe are damped
#define SAME_FRICTION 0.005  // of Coulomb's bound: a larger error of friction is solved again

// Friction for the next solve, of a point that moves by d: in the first solve viscous, afterwards the tangent of
// Coulomb's force (Newton's method).
static void linearise_friction(const OmPress* p, OmPressPoint* t, OmVec3 d, double h,
                               bool is_viscous) {
    t->friction_max = p->def.friction * t->push;
    OmVec3 rel = om_sub(d, t->probe_move);
    rel = om_madd(rel, -om_dot(rel, t->n), t->n);
    double far = fmax(OM_PRESS_SLOW * h, om_norm(rel));
    OmMat3 K = om_mat3_add(om_mat3_identity(), om_mat3_outer(t->n, om_scale(-1, t->n)));
    OmVec3 f = om_scale(-t->friction_max / far, rel);
    if (!is_viscous && far > OM_PRESS_SLOW * h)
        K = om_mat3_add(K, om_mat3_outer(rel, om_scale(-1 / (far * far), rel)));
    t->friction_K = om_mat3_scale(t->friction_max / far, K);
    t->friction = om_add(f, om_mat3_apply(t->friction_K, d));
}

static void predict_active(OmPress* p, OmTissueState* s, const OmTissueWork* w, double h) {
    for (int k = 0; k < p->nnear; ++k) {
        OmPressPoint* t = &p->near[k];
        t->k = p->def.stiffness > 0 ? p->def.stiffness : STIFF * om__press_stiffness(p, w, t->vert);
        if (t->is_prescribed || t->is_parked) continue;
        OmVec3 d = t->predicted;
        double end = t->gap + om_dot(t->n, d) - t->goal;
        t->is_active = end < -OM_PRESS_ACTIVATE * p->size;
        double push = om_dot(om__press_position(p, om_tissue_contact_force(s), t->vert), t->n);
        double now = om_dot(t->n, t->probe_move) + t->gap;  // if it moved as the probe does
        t->is_active |= push > 0 && now < 10 * OM_PRESS_ACTIVATE * p->size;
        if (!t->is_active || p->def.friction == 0) continue;
        t->push = fmax(0, t->multiplier - t->k * end);
        linearise_friction(p, t, d, h, true);
    }
}

static OmStatus add_forces(OmPress* p, OmTissueWork* w) {
    for (int k = 0; k < p->nnear; ++k) {
        OmPressPoint* t = &p->near[k];
        if (!t->is_active) continue;
        if (t->is_prescribed) {
            OmMat3 K = om_mat3_scale(t->k, om_mat3_identity());
            OM_TRY(om__press_add_force(p, w, t->vert, om_scale(t->k, t->probe_move), K));
            continue;
        }
        OmMat3 nn = om_mat3_outer(t->n, t->n);
        t->K = om_mat3_scale(t->k - t->damp, nn);
        t->K = om_mat3_add(t->K, om_mat3_scale(t->damp, om_mat3_identity()));
        OmVec3 along = om_madd(t->at, -om_dot(t->at, t->n), t->n);
        t->f = om_scale(t->multiplier + t->k * (t->goal - t->gap), t->n);
        t->f = om_madd(t->f, t->damp, along);
        if (p->def.friction > 0) {
            t->K = om_mat3_add(t->K, t->friction_K);
            t->f = om_add(t->f, t->friction);
        }
        OM_TRY(om__press_add_force(p, w, t->vert, t->f, t->K));
    }
    return OM_OK;
}

// Linearise plane and friction of an active point again if they differ at displacement d from those of the solve.
static bool update_point(OmPress* p, OmPressPoint* t, const OmTissueState* s, const OmTissueWork* w,
                         OmVec3 d, double h, bool is_damped) {
    OmVec3 was_n = t->n, rel = om_sub(d, t->probe_move), move = om_sub(d, t->at);
    rel = om_madd(rel, -om_dot(rel, was_n), was_n);
    double far = om_norm(om_madd(move, -om_dot(move, was_n), was_n));
    double tilt = t->push > 0 ? t->damp * far / t->push : 0;
    bool is_sliding = om__press_is_sliding(p, t->vert), has_slipped = false;
    OmPressPlace place = is_sliding ? om__press_follow(p, t, s, w, h) : OM_PRESS_PARKED;
    bool is_bent = place == OM_PRESS_MOVED;
    if (is_bent) d = om__press_displacement(p, s, w, t->vert, h);
    if (place == OM_PRESS_PARKED) is_bent = om__press_update_plane(p, t, om_add(t->x, d), tilt);
    if (is_bent && is_damped && far > 0 && !is_sliding)
        t->damp = fmax(0.5 * t->damp, t->push * om_distance(t->n, was_n) / far);
    if (t->push == 0) t->damp = 0;
    if (p->def.friction > 0) {
        double max = p->def.friction * t->push;
        OmVec3 f = om_scale(-max / fmax(OM_PRESS_SLOW * h, om_norm(rel)), rel);
        OmVec3 used = om_sub(t->friction, om_mat3_apply(t->friction_K, d));
        has_slipped = om_distance(f, used) > SAME_FRICTION * max;
        if (is_bent || has_slipped) linearise_friction(p, t, d, h, false);
    }
    return is_bent || has_slipped;
}

// Compare the points with the last solution; returns how many changed.
static int update(OmPress* p, const OmTissueState* s, const OmTissueWork* w, double h,
                  bool is_damped) {
    int nchange = 0;
    for (int k = 0; k < p->nnear; ++k) {
        OmPressPoint* t = &p->near[k];
        OmVec3 d = om__press_displacement(p, s, w, t->vert, h), zero = {0, 0, 0};
        double end = t->gap + om_dot(t->n, d) - t->goal, lift = t->multiplier / t->k;
        t->force = zero;
        if (t->is_prescribed) {
            t->force = om_scale(t->k, om_sub(t->probe_move, d));
        } else if (t->is_active && end - lift > OM_PRESS_RELEASE * p->size) {
            t->is_active = false;
            t->push = t->damp = t->friction_max = 0;
            t->friction = zero;
            t->friction_K = om_mat3_diag(zero);
            ++nchange;
        } else if (t->is_active) {
            t->push = fmax(0, t->multiplier - t->k * end);
            t->force = om_sub(t->f, om_mat3_apply(t->K, d));
            nchange += update_point(p, t, s, w, d, h, is_damped);
        } else {
            if (om__press_is_sliding(p, t->vert)) {
                t->is_parked = om__press_follow(p, t, s, w, h) == OM_PRESS_PARKED;
                if (t->is_parked) continue;
                d = om__press_displacement(p, s, w, t->vert, h);
                end = t->gap + om_dot(t->n, d) - t->goal;
            }
            OmVec3 place = om_add(t->x, d);
            double true_end = om__press_gap(p, place) - t->goal - lift;
            bool is_in = true_end < -OM_PRESS_ACTIVATE * p->size;
            // the line search activates points by their planes, which must not overrate penetration
            if (is_in ||
                (!t->is_crossing && fabs(true_end - end + lift) > OM_PRESS_ACTIVATE * p->size))
                om__press_linearise(p, t, place);
            if (!is_in) continue;
            t->is_active = true;
            ++nchange;
        }
    }
    return nchange;
}

// Force of a point along the step of a line search, at the fraction `at` of it, by the point's plane and Coulomb's law.
static double force_along(const OmPressPoint* t, double at, double h) {
    double sum = t->k * fmax(0, t->depth - at * t->depth_rate) * t->depth_rate;
    if (t->friction_max == 0) return sum;
    OmVec3 rel = om_madd(t->slip, at, t->slip_step);
    double far = fmax(OM_PRESS_SLOW * h, om_norm(rel));
    return sum - t->friction_max / far * om_dot(rel, t->slip_step);
}

// Begin a line search: take the forces of a probe's points out of the parabola.
static void begin_line(OmPress* p, const OmTissueState* s, const double* last,
                       const double* increment, double h, OmContactLine* line) {
    for (int k = 0; k < p->nnear; ++k) {
        OmPressPoint* t = &p->near[k];
        if (t->is_prescribed || t->is_parked) continue;  // the spring of the first is a part of A
        OmVec3 d = om_scale(h, om_add(om__press_position(p, om_tissue_v(s), t->vert),
                                      om__press_position(p, last, t->vert)));
        OmVec3 step = om_scale(h, om__press_position(p, increment, t->vert)),
               rel = om_sub(d, t->probe_move);
        t->depth = t->multiplier / t->k + t->goal - t->gap - om_dot(t->n, d);
        t->depth_rate = om_dot(t->n, step);
        t->slip = om_madd(rel, -om_dot(rel, t->n), t->n);
        t->slip_step = om_madd(step, -t->depth_rate, t->n);
        double far = t->friction_max > 0 ? om_norm(step) : fabs(t->depth_rate);
        line->farthest = fmax(line->farthest, far);
        if (!t->is_active) {
            t->depth -= OM_PRESS_ACTIVATE * p->size;  // activation begins at this depth
            continue;
        }
        OmVec3 K_step = om_mat3_apply(t->K, step);
        line->slope += om_dot(t->f, step) - om_dot(d, K_step);
        line->curve -= om_dot(step, K_step);
    }
}

// Fraction of the step from `last` to the solution at which Phi is smallest.
static double search_line(const OmContactGroup* g, const OmTissueState* s, OmTissueWork* w,
                          double h) {
    OmPress* p = g->press[0];
    size_t n3 = 3 * (size_t)om_tissue_mesh(p->model)->nvert;
    const double* dv = om_tissue_dv(w);
    OmContactLine line = {0};
    for (size_t n = 0; n < n3; ++n) p->increment[n] = dv[n] - p->last[n];
    if (om_tissue_apply(p->model, w, 1, p->increment, p->scratch) < 0) return 1;
    for (size_t n = 0; n < n3; ++n) line.curve += p->increment[n] * p->scratch[n];
    line.slope = -line.curve;  // dv solves the linear system
    for (int k = 0; k < g->npress; ++k) begin_line(g->press[k], s, p->last, p->increment, h, &line);
    if (g->contact) om__contact_begin_line(g->contact, s, p->last, p->increment, h, &line);
    if (line.farthest < OM_PRESS_ACTIVATE * p->size) return 1;  // below the solver's error
    double lo = 0, hi = 1;
    for (int n = 0; n < 30; ++n) {
        double at = n == 0 ? 1 : 0.5 * (lo + hi), sum = line.slope + at * line.curve;
        for (int k = 0; k < g->npress; ++k)
            for (int i = 0; i < g->press[k]->nnear; ++i)
                if (!g->press[k]->near[i].is_prescribed && !g->press[k]->near[i].is_parked)
                    sum -= force_along(&g->press[k]->near[i], at, h);
        if (g->contact) om__contact_add_line(g->contact, at, &sum);
        if (sum <= 0 && n == 0) return 1;
        *(sum <= 0 ? &lo : &hi) = at;
    }
    return 0.5 * (lo + hi);
}

// Solve once with the forces of all active points and vertices.
static OmStatus solve(const OmContactGroup* g, const OmTissueModel* m, OmTissueState* s,
                      OmTissueWork* w, double h, OmTissueReport* report) {
    om_tissue_clear_forces(w);
    if (g->contact) OM_TRY(om__contact_add_forces(g->contact, w, h));
    for (int k = 0; k < g->npress; ++k) OM_TRY(add_forces(g->press[k], w));
    OmStatus status = om_tissue_solve_step(m, s, w, report);
    if (status < 0) return status;
    if (g->contact) ++g->contact->report.nsolve;
    for (int k = 0; k < g->npress; ++k) ++g->press[k]->report.nsolve;
    return status;
}

// Solve until the active sets, planes and friction stay the same.
static OmStatus iterate(const OmContactGroup* g, const OmTissueModel* m, OmTissueState* s,
                        OmTissueWork* w, double h, OmTissueReport* report) {
    OmStatus status = OM_OK;
    OmTissueReport one = {0};
    OmPress* p = g->press[0];
    size_t n3 = 3 * (size_t)om_tissue_mesh(m)->nvert;
    int max_iterations = 0;
    for (int k = 0; k < g->npress; ++k)
        if (g->press[k]->def.max_iterations > max_iterations)
            max_iterations = g->press[k]->def.max_iterations;
    bool is_settled = false;
    for (int n = 0; n < max_iterations && !is_settled; ++n) {
        if (n >= SEARCH_FROM) memcpy(p->last, om_tissue_dv(w), n3 * sizeof *p->last);
        OM_CHECK(n < CUT_AFTER || !om__press_may_cut(p, h), OM_INVALID,
                 "press: contact has not settled after %d solves", n);
        if (n >= CUT_AFTER && g->contact) om__contact_close_set(g->contact);
        one = (OmTissueReport){0};
        status = solve(g, m, s, w, h, &one);
        if (status < 0) return status;
        report->iterations += one.iterations;
        double fraction = n >= SEARCH_FROM ? search_line(g, s, w, h) : 1;
        if (fraction < 1) {
            for (size_t i = 0; i < n3; ++i) p->increment[i] *= fraction - 1;
            om_tissue_add_dv(w, p->increment);
        }
        int nchange = 0;
        if (g->contact)
            OM_TRY(om__contact_update_pairs(g->contact, m, s, w, h, n >= DAMP_FROM, &nchange));
        for (int k = 0; k < g->npress; ++k) nchange += update(g->press[k], s, w, h, n >= DAMP_FROM);
        is_settled = nchange == 0 && fraction == 1;
    }
    if (g->contact) g->contact->report.is_settled = is_settled;
    for (int k = 0; k < g->npress; ++k) g->press[k]->report.is_settled = is_settled;
    report->residual = fmax(report->residual, one.residual);  // of the last solve
    return status;
}

// Find the points and vertices near obstacles, and predict which of them are active.
static OmStatus begin(const OmContactGroup* g, const OmTissueModel* m, OmTissueState* s,
                      OmTissueWork* w, double h) {
    double force = 0;
    if (g->contact) {
        OM_TRY(om__contact_find_pairs(g->contact, m, s, w, h));
        force = om__contact_estimate_force(g->contact, s, h);
    }
    for (int k = 0; k < g->npress; ++k) {
        OmPress* p = g->press[k];
        om__press_detect(p, s, w, h);
        if (p->def.method == OM_PRESS_PRESCRIBED) om__press_prescribe(p, s);
        predict_active(p, s, w, h);
        double own = om__press_estimate_force(p, w);
        force = force > 0 ? hypot(force, own) : own;
    }
    om_tissue_set_force_scale(w, force);
    return OM_OK;
}

static OmStatus check_depths(const OmContactGroup* g, const OmTissueState* s, const OmTissueWork* w,
                             double h) {
    for (int k = 0; k < g->npress; ++k) OM_TRY(om__press_check_depth(g->press[k], s, w, h));
    return OM_OK;
}

OmStatus om__contact_penalty(const OmContactGroup* g, const OmTissueModel* m, OmTissueState* s,
                             OmTissueWork* w, double h, OmTissueReport* report) {
    OM_TRY(begin(g, m, s, w, h));
    OmStatus status = iterate(g, m, s, w, h, report);
    if (status < 0) return status;
    OM_TRY(check_depths(g, s, w, h));
    return status;
}

// ---- augmented Lagrangian -----------------------------------------------------------------------------

// Error of Signorini's law, max |min(push / largest push, gap / edge)|; the forces of the springs go to the
// multipliers.
static double update_multipliers(OmPress* p, const OmTissueState* s, const OmTissueWork* w,
                                 double h) {
    double max = 0, worst = 0;
    for (int k = 0; k < p->nnear; ++k)
        if (p->near[k].is_active) max = fmax(max, p->near[k].push);
    for (int k = 0; k < p->nnear; ++k) {
        OmPressPoint* t = &p->near[k];
        OmVec3 d = om__press_displacement(p, s, w, t->vert, h);
        double gap = t->is_active ? t->gap + om_dot(t->n, d) - t->goal
                                  : om__press_gap(p, om_add(t->x, d)) - t->goal;
        double push = t->is_active && max > 0 ? t->push / max : 0;
        worst = fmax(worst, fabs(fmin(push, gap / p->edge)));
        t->multiplier = t->is_active ? t->push : 0;
    }
    return worst;
}

// Update the multipliers of all probes that have them; true if every tolerance is met.
static bool update_all_multipliers(const OmContactGroup* g, const OmTissueState* s,
                                   const OmTissueWork* w, double h) {
    bool is_met = true;
    for (int k = 0; k < g->npress; ++k) {
        OmPress* p = g->press[k];
        if (p->def.method != OM_PRESS_MULTIPLIERS) continue;
        p->report.complementarity = update_multipliers(p, s, w, h);
        is_met = is_met && p->report.complementarity <= p->def.tolerance;
    }
    return is_met;
}

OmStatus om__contact_augmented(const OmContactGroup* g, const OmTissueModel* m, OmTissueState* s,
                               OmTissueWork* w, double h, OmTissueReport* report) {
    // Restart from dv = 0: the previous iterate may be a poor start.
    OmPress* p = g->press[0];
    int nvert = om_tissue_mesh(m)->nvert;
    for (int i = 0; i < nvert; ++i) {
        bool is_held = om_tissue_is_prescribed(m, s, i);
        OmVec3 back = om_scale(-1, om_load3(om_tissue_dv(w), i)), zero = {0, 0, 0};
        om_store3(p->increment, i, is_held ? zero : back);
    }
    om_tissue_add_dv(w, p->increment);
    for (int k = 0; k < g->npress; ++k) g->press[k]->detect_h = 0;
    OM_TRY(begin(g, m, s, w, h));
    OmStatus status = OM_OK;
    bool is_met = false;
    for (int round = 0; round < ROUNDS; ++round) {
        OmTissueReport one = {0};
        status = iterate(g, m, s, w, h, &one);
        report->iterations += one.iterations;
        if (status < 0) return status;
        is_met = update_all_multipliers(g, s, w, h);
        if (is_met || round == ROUNDS - 1) report->residual = fmax(report->residual, one.residual);
        if (is_met && p->report.is_settled) break;
    }
    for (int k = 0; k < g->npress; ++k) g->press[k]->report.is_settled &= is_met;
    if (g->contact) g->contact->report.is_settled &= is_met;
    OM_TRY(check_depths(g, s, w, h));
    return status;
}
