// contact_penalty.c: stiff one-sided springs at the points that touch (thesis 3.7), implicit; with a glued area
// (contact_prescribed.c) also the prescribed method.
//
// A touching point gets the force k (goal - gap) n at the end of the step; k is a hundred times what resists moving
// the point alone, so tissue sinks in by hundredths of a millimetre. The step minimises
//
//     Phi(dv) = 1/2 dv . A dv - b . dv + sum 1/2 k min(0, gap - goal)^2
//
// by a semismooth Newton iteration: solve with the springs of those that touch, let go of what is pulled, take
// what went in, solve again. From the third solve on, dv goes only as far towards the solution as Phi falls: it is a
// parabola on every piece of the way, and its slope costs one product with A. Points of one facet that a curved
// probe touches in turn made the plain iteration cycle. Only the first solve of a step makes coarse matrices; later
// ones change a few diagonal blocks.
//
// A plane that is not the probe at the solution, by distance or angle, is laid anew (contact_press.c). Where tissue is
// soft against push over the probe's radius (an edge), points run along the probe from solve to solve: from the fifth
// on a spring to the last place, as stiff as push times the turn of the plane over the way, damps that; a touch is
// settled when its pull is as small as the angle that a plane may be off.
//
// Friction is Coulomb's with the normal force of the last solve, viscous below 1 mm/s, against the motion of the probe.
// Each solve after the first has its tangent (Newton's method) and the line search its potential, both with that
// normal force. A viscous force with the coefficient of the last solve took 45 solves a step under a sphere and 226 at
// a box's edge to come within 0.5 % of the bound; the tangent takes six and five. Tissue that snaps off never settles
// in a long step: after ten solves a shorter one is asked for while there is one.
#include <string.h>

#include "contact/contact_press_internal.h"

#define STIFF 100       // times what resists moving a point alone
#define SEARCH_FROM 2   // solves before steps may be shortened
#define ROUNDS 8        // of multipliers that take over
#define PATIENCE 10     // solves before a shorter step is asked for
#define DAMP_FROM 4     // solves before moves along a curved probe are damped
#define SAME_RUB 0.005  // of Coulomb's bound: friction that is off by more is solved again

// Friction for the next solve, of a point that moves by d: at first viscous as it is there, afterwards the tangent
// of the force (Newton's method; a viscous law anew in each solve took dozens of them where points begin to slide).
static void lay_friction(const OmPress* p, OmTouch* t, OmVec3 d, double h, bool is_viscous) {
    t->bound = p->def.friction * t->push;
    OmVec3 rel = om_sub(d, t->slip);
    rel = om_madd(rel, -om_dot(rel, t->n), t->n);
    double far = fmax(OM_PRESS_SLOW * h, om_norm(rel));
    OmMat3 K = om_mat3_add(om_mat3_identity(), om_mat3_outer(t->n, om_scale(-1, t->n)));
    OmVec3 f = om_scale(-t->bound / far, rel);
    if (!is_viscous && far > OM_PRESS_SLOW * h)
        K = om_mat3_add(K, om_mat3_outer(rel, om_scale(-1 / (far * far), rel)));
    t->rub_K = om_mat3_scale(t->bound / far, K);
    t->rub = om_add(f, om_mat3_apply(t->rub_K, d));
}

static void choose_first(OmPress* p, OmTissueState* s, const OmTissueWork* w, double h) {
    for (int k = 0; k < p->ntouch; ++k) {
        OmTouch* t = &p->touch[k];
        t->k =
            p->def.stiffness > 0 ? p->def.stiffness : STIFF * om__press_stiffness(p, w, t->point);
        if (t->is_glued) continue;
        OmVec3 d = t->guess;
        double end = t->gap + om_dot(t->n, d) - t->goal;
        t->is_active = end < -OM_PRESS_TAKE * p->size;
        double push = om_dot(om__press_point(p, om_tissue_contact_force(s), t->point), t->n);
        double now = om_dot(t->n, t->slip) + t->gap;  // if it moved as the probe does
        t->is_active |= push > 0 && now < 10 * OM_PRESS_TAKE * p->size;
        if (!t->is_active || p->def.friction == 0) continue;
        t->push = fmax(0, t->multiplier - t->k * end);
        lay_friction(p, t, d, h, true);
    }
}

static OmStatus add_forces(OmPress* p, OmTissueWork* w) {
    om_tissue_clear_forces(w);
    for (int k = 0; k < p->ntouch; ++k) {
        OmTouch* t = &p->touch[k];
        if (!t->is_active) continue;
        if (t->is_glued) {
            OmMat3 K = om_mat3_scale(t->k, om_mat3_identity());
            OM_TRY(om__press_add_force(p, w, t->point, om_scale(t->k, t->slip), K));
            continue;
        }
        OmMat3 nn = om_mat3_outer(t->n, t->n);
        t->K = om_mat3_scale(t->k - t->damp, nn);
        t->K = om_mat3_add(t->K, om_mat3_scale(t->damp, om_mat3_identity()));
        OmVec3 along = om_madd(t->at, -om_dot(t->at, t->n), t->n);
        t->f = om_scale(t->multiplier + t->k * (t->goal - t->gap), t->n);
        t->f = om_madd(t->f, t->damp, along);
        if (p->def.friction > 0) {
            t->K = om_mat3_add(t->K, t->rub_K);
            t->f = om_add(t->f, t->rub);
        }
        OM_TRY(om__press_add_force(p, w, t->point, t->f, t->K));
    }
    return OM_OK;
}

// Is an active touch, that moved by d, no longer what was solved for? Then its plane and friction are laid anew.
static bool renew(const OmPress* p, OmTouch* t, OmVec3 d, double h, bool is_damped) {
    OmVec3 was_n = t->n, rel = om_sub(d, t->slip), way = om_sub(d, t->at);
    rel = om_madd(rel, -om_dot(rel, was_n), was_n);
    double far = om_norm(om_madd(way, -om_dot(way, was_n), was_n));
    double lean = t->push > 0 ? t->damp * far / t->push : 0;
    bool is_bent = om__press_bend(p, t, om_add(t->x, d), lean), has_slipped = false;
    if (is_bent && is_damped && far > 0)
        t->damp = fmax(0.5 * t->damp, t->push * om_distance(t->n, was_n) / far);
    if (t->push == 0) t->damp = 0;
    if (p->def.friction > 0) {
        double max = p->def.friction * t->push;
        OmVec3 f = om_scale(-max / fmax(OM_PRESS_SLOW * h, om_norm(rel)), rel);
        OmVec3 used = om_sub(t->rub, om_mat3_apply(t->rub_K, d));
        has_slipped = om_distance(f, used) > SAME_RUB * max;
        if (is_bent || has_slipped) lay_friction(p, t, d, h, false);
    }
    return is_bent || has_slipped;
}

// Look at the outcome of a solve; how many points changed.
static int update(OmPress* p, const OmTissueState* s, const OmTissueWork* w, double h,
                  bool is_damped) {
    int nchange = 0;
    for (int k = 0; k < p->ntouch; ++k) {
        OmTouch* t = &p->touch[k];
        OmVec3 d = om__press_move(p, s, w, t->point, h), zero = {0, 0, 0};
        double end = t->gap + om_dot(t->n, d) - t->goal, lift = t->multiplier / t->k;
        t->force = zero;
        if (t->is_glued) {
            t->force = om_scale(t->k, om_sub(t->slip, d));
        } else if (t->is_active && end - lift > OM_PRESS_LET_GO * p->size) {
            t->is_active = false;
            t->push = t->damp = t->bound = 0;
            t->rub = zero;
            t->rub_K = om_mat3_diag(zero);
            ++nchange;
        } else if (t->is_active) {
            t->push = fmax(0, t->multiplier - t->k * end);
            t->force = om_sub(t->f, om_mat3_apply(t->K, d));
            nchange += renew(p, t, d, h, is_damped);
        } else {
            OmVec3 place = om_add(t->x, d);
            double true_end = om__press_gap(p, place) - t->goal - lift;
            bool is_in = true_end < -OM_PRESS_TAKE * p->size;
            // the line search takes points by their planes: they must not say more than the probe
            if (is_in || (!t->is_through && fabs(true_end - end + lift) > OM_PRESS_TAKE * p->size))
                om__press_linearise(p, t, place);
            if (!is_in) continue;
            t->is_active = true;
            ++nchange;
        }
    }
    return nchange;
}

// Force of a touch on the way, share `at` of it, along the way, by its plane; friction by Coulomb's law.
static double force_along(const OmTouch* t, double at, double h) {
    double sum = t->k * fmax(0, t->in - at * t->rate) * t->rate;
    if (t->bound == 0) return sum;
    OmVec3 rel = om_madd(t->rel, at, t->rel_way);
    double far = fmax(OM_PRESS_SLOW * h, om_norm(rel));
    return sum - t->bound / far * om_dot(rel, t->rel_way);
}

// How far from `last` towards the solution Phi falls, at most all the way.
static double search_line(OmPress* p, const OmTissueState* s, OmTissueWork* w, double h) {
    size_t n3 = 3 * (size_t)om_tissue_mesh(p->model)->nvert;
    const double* dv = om_tissue_dv(w);
    double curve = 0, slope = 0, farthest = 0;
    for (size_t n = 0; n < n3; ++n) p->way[n] = dv[n] - p->last[n];
    if (om_tissue_apply(p->model, w, 1, p->way, p->scratch) < 0) return 1;
    for (size_t n = 0; n < n3; ++n) curve += p->way[n] * p->scratch[n];
    slope = -curve;  // dv solves the equations with what acted in them
    for (int k = 0; k < p->ntouch; ++k) {
        OmTouch* t = &p->touch[k];
        if (t->is_glued) continue;  // its spring is a part of A
        OmVec3 d = om_scale(h, om_add(om__press_point(p, om_tissue_v(s), t->point),
                                      om__press_point(p, p->last, t->point)));
        OmVec3 way = om_scale(h, om__press_point(p, p->way, t->point)), rel = om_sub(d, t->slip);
        t->in = t->multiplier / t->k + t->goal - t->gap - om_dot(t->n, d);
        t->rate = om_dot(t->n, way);
        t->rel = om_madd(rel, -om_dot(rel, t->n), t->n);
        t->rel_way = om_madd(way, -t->rate, t->n);
        farthest = fmax(farthest, t->bound > 0 ? om_norm(way) : fabs(t->rate));
        if (!t->is_active) {
            t->in -= OM_PRESS_TAKE * p->size;  // only there it is taken
            continue;
        }
        OmVec3 K_way = om_mat3_apply(t->K, way);
        slope += om_dot(t->f, way) - om_dot(d, K_way);
        curve -= om_dot(way, K_way);
    }
    if (farthest < OM_PRESS_TAKE * p->size) return 1;  // what differs is what solves leave
    double lo = 0, hi = 1;
    for (int n = 0; n < 30; ++n) {
        double at = n == 0 ? 1 : 0.5 * (lo + hi), sum = slope + at * curve;
        for (int k = 0; k < p->ntouch; ++k)
            if (!p->touch[k].is_glued) sum -= force_along(&p->touch[k], at, h);
        if (sum <= 0 && n == 0) return 1;
        *(sum <= 0 ? &lo : &hi) = at;
    }
    return 0.5 * (lo + hi);
}

// Solve until the set of active points stays the same.
static OmStatus settle(OmPress* p, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                       double h, OmTissueReport* report) {
    OmStatus status = OM_OK;
    OmTissueReport one = {0};
    size_t n3 = 3 * (size_t)om_tissue_mesh(m)->nvert;
    p->report.is_settled = false;
    for (int n = 0; n < p->def.max_iterations && !p->report.is_settled; ++n) {
        if (n >= SEARCH_FROM) memcpy(p->last, om_tissue_dv(w), n3 * sizeof *p->last);
        OM_CHECK(n < PATIENCE || !om__press_may_cut(p, h), OM_INVALID,
                 "press: the points that touch have not settled after %d solves", n);
        OM_TRY(add_forces(p, w));
        one = (OmTissueReport){0};
        status = om_tissue_solve_step(m, s, w, &one);
        if (status < 0) return status;
        report->iterations += one.iterations;
        ++p->report.nsolve;
        double share = n >= SEARCH_FROM ? search_line(p, s, w, h) : 1;
        if (share < 1) {
            for (size_t i = 0; i < n3; ++i) p->way[i] *= share - 1;
            om_tissue_add_dv(w, p->way);
        }
        p->report.is_settled = update(p, s, w, h, n >= DAMP_FROM) == 0 && share == 1;
    }
    report->residual = fmax(report->residual, one.residual);  // of the solve that counts
    return status;
}

OmStatus om__press_penalty(void* ctx, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                           double h, OmTissueReport* report) {
    OmPress* p = ctx;
    om__press_path(p, s, h);
    om__press_detect(p, s, w, h);
    if (p->def.method == OM_PRESS_PRESCRIBED) om__press_glue(p, s);
    choose_first(p, s, w, h);
    om_tissue_set_force_scale(w, om__press_guess_force(p, w));
    OmStatus status = settle(p, m, s, w, h, report);
    if (status < 0) return status;
    OM_TRY(om__press_check_depth(p, s, w, h));
    return status;
}

// ---- augmented Lagrangian -----------------------------------------------------------------------------

// How far the touches are from Signorini's law, max |min(push / most, gap / edge)|; what springs give goes to
// multipliers.
static double take_over(OmPress* p, const OmTissueState* s, const OmTissueWork* w, double h) {
    double max = 0, worst = 0;
    for (int k = 0; k < p->ntouch; ++k)
        if (p->touch[k].is_active) max = fmax(max, p->touch[k].push);
    for (int k = 0; k < p->ntouch; ++k) {
        OmTouch* t = &p->touch[k];
        OmVec3 d = om__press_move(p, s, w, t->point, h);
        double gap = t->is_active ? t->gap + om_dot(t->n, d) - t->goal
                                  : om__press_gap(p, om_add(t->x, d)) - t->goal;
        double push = t->is_active && max > 0 ? t->push / max : 0;
        worst = fmax(worst, fabs(fmin(push, gap / p->edge)));
        t->multiplier = t->is_active ? t->push : 0;
    }
    return worst;
}

OmStatus om__press_augmented(OmPress* p, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                             double h, OmTissueReport* report) {
    // From the motion of the beginning: what brought us here may have led astray.
    int nvert = om_tissue_mesh(m)->nvert;
    for (int i = 0; i < nvert; ++i) {
        bool is_held = om_tissue_is_prescribed(m, s, i);
        OmVec3 back = om_scale(-1, om_load3(om_tissue_dv(w), i)), zero = {0, 0, 0};
        om_store3(p->way, i, is_held ? zero : back);
    }
    om_tissue_add_dv(w, p->way);
    p->seen_h = 0;
    om__press_detect(p, s, w, h);
    choose_first(p, s, w, h);
    om_tissue_set_force_scale(w, om__press_guess_force(p, w));
    OmStatus status = OM_OK;
    for (int round = 0; round < ROUNDS; ++round) {
        OmTissueReport one = {0};
        status = settle(p, m, s, w, h, &one);
        report->iterations += one.iterations;
        if (status < 0) return status;
        p->report.complementarity = take_over(p, s, w, h);
        bool is_met = p->report.complementarity <= p->def.tolerance;
        if (is_met || round == ROUNDS - 1) report->residual = fmax(report->residual, one.residual);
        if (is_met && p->report.is_settled) break;
    }
    p->report.is_settled = p->report.is_settled && p->report.complementarity <= p->def.tolerance;
    OM_TRY(om__press_check_depth(p, s, w, h));
    return status;
}
