// contact_step.c: which vertices an obstacle pushes, found inside the step.
//
// A touching vertex asks for gap >= goal at the end of the step; it gets the implicit force
// k (goal - gap_end) n, k a thousand times what resists moving that vertex alone, so that a resting vertex
// sinks in by its weight over k: micrometres. goal is 0, or for tissue that began inside what
// recover_speed allows. The active set is a semismooth Newton iteration: solve, let go of what is pulled,
// take what went in, solve again. In the second half of the iterations who is free stays free, so it
// ends; what then goes in is pushed out in the next step. Obstacles are
// replaced by their tangent planes, where a vertex is expected at the end of the step.
//
// Friction is Coulomb's with the normal force of the last solve, viscous below SLOW:
// f = -mu push v_t / max(|v_t|, SLOW), v_t at the end of the step, |v_t| of the last solve; solved again until
// push / |v_t| stays. The first solve takes both from the state. With one correction only, what should stick
// crept at 14 mm/s.
#include <string.h>

#include "contact/contact_internal.h"

#define SLOW 1e-3       // m/s
#define SAME_DRAG 0.02  // relative: friction that changes more is solved again
#define LET_GO 1e-8     // of the model's size: pulled
#define TAKE 1e-6       // of the model's size: went in
#define REACH 0.05      // of the model's size: pairs farther than this are not looked at

static OmVec3 moved_by(const OmTissueState* s, const double* dv, int i, double h) {
    return om_scale(h, om_add(om_load3(om_tissue_v(s), i), om_load3(dv, i)));
}

// The plane that stands for an obstacle near vertex i, when the vertex is expected at p.
static void linearise(const OmContact* c, OmContactPair* pair, const double* x, OmVec3 p) {
    double gap = om__contact_gap(c, pair->obstacle, p, &pair->n);
    pair->gap = gap + om_dot(pair->n, om_sub(om_load3(x, pair->vert), p));
}

// Friction as the last step left it, for the first solve.
static void recall_friction(const OmContact* c, OmContactPair* pair, OmVec3 force, OmVec3 v) {
    pair->push = fmax(0, om_dot(force, pair->n));
    OmVec3 vt = om_madd(v, -om_dot(pair->n, v), pair->n);
    pair->drag = c->def.friction * pair->push / fmax(SLOW, om_norm(vt));
}

// Pairs within reach, active where the last step pushed or the vertex would go in if nothing else acted. On a
// curved organ a plane is off by more than a resting vertex sinks: its distance alone cannot tell that it rests,
// and to find that out again by solving took three solves a step.
static void find_pairs(OmContact* c, const OmTissueModel* m, OmTissueState* s,
                       const OmTissueWork* w, double h) {
    const double *x = om_tissue_x(s), *v = om_tissue_v(s), *touch = om_tissue_contact_force(s);
    c->npair = 0;
    for (int n = 0; n < c->nsurface; ++n) {
        int i = c->surface_vert[n];
        if (om_tissue_is_prescribed(m, s, i)) continue;
        OmVec3 p = om_load3(x, i), d = om_scale(h, om_load3(v, i)), normal;
        for (int k = 0; k < c->nobstacle; ++k) {
            double begin = om__contact_gap(c, k, p, &normal);
            if (begin - om_norm(d) > REACH * c->size) continue;
            OmContactPair* pair = &c->pair[c->npair++];
            *pair = (OmContactPair){.vert = i, .obstacle = k};
            linearise(c, pair, x, om_add(p, d));
            pair->goal = fmin(0, fmin(begin, pair->gap) + c->def.recover_speed * h);
            pair->k = c->def.stiffness * om_tissue_vertex_stiffness(w, i);
            bool was_pushed = om_dot(om_load3(touch, i), pair->n) > 0;
            double sunk = fmin(begin, pair->gap + om_dot(pair->n, d) - pair->goal);
            pair->is_active = was_pushed || sunk < -TAKE * c->size;
            if (pair->is_active && c->def.friction > 0)
                recall_friction(c, pair, om_load3(touch, i), om_load3(v, i));
        }
    }
}

static void add_forces(OmContact* c, OmTissueWork* w, double h) {
    om_tissue_clear_forces(w);
    for (int k = 0; k < c->npair; ++k) {
        OmContactPair* pair = &c->pair[k];
        pair->was_drag = pair->drag;
        if (!pair->is_active) continue;
        OmMat3 nn = om_mat3_outer(pair->n, pair->n);
        OmMat3 K = om_mat3_scale(pair->k - pair->drag / h, nn);
        K = om_mat3_add(K, om_mat3_scale(pair->drag / h, om_mat3_identity()));
        om_tissue_add_force(w, pair->vert, om_scale(pair->k * (pair->goal - pair->gap), pair->n),
                            K);
    }
}

// Look at the outcome of a solve; returns how many pairs changed sides.
static int update_pairs(OmContact* c, const OmTissueState* s, const OmTissueWork* w, double h) {
    const double *x = om_tissue_x(s), *dv = om_tissue_dv(w);
    int nchange = 0;
    for (int k = 0; k < c->npair; ++k) {
        OmContactPair* pair = &c->pair[k];
        OmVec3 d = moved_by(s, dv, pair->vert, h);
        double end = pair->gap + om_dot(pair->n, d) - pair->goal;
        if (pair->is_active && end > LET_GO * c->size) {
            pair->is_active = false;
            pair->push = pair->drag = 0;
            ++nchange;
        } else if (pair->is_active) {
            OmVec3 vt = om_scale(1 / h, om_madd(d, -om_dot(pair->n, d), pair->n));
            pair->push = fmax(0, -pair->k * end);
            double drag = c->def.friction * pair->push / fmax(SLOW, om_norm(vt));
            nchange += fabs(drag - pair->drag) > SAME_DRAG * drag;
            pair->drag = drag;
        } else if (!pair->was_let_go) {
            OmVec3 p = om_add(om_load3(x, pair->vert), d), n;
            if (om__contact_gap(c, pair->obstacle, p, &n) - pair->goal >= -TAKE * c->size) continue;
            linearise(c, pair, x, p);
            pair->is_active = true;
            ++nchange;
        }
    }
    return nchange;
}

// From the middle of the iterations on, who is free stays free.
static void close_set(OmContact* c) {
    for (int k = 0; k < c->npair; ++k) c->pair[k].was_let_go |= !c->pair[k].is_active;
}

// Forces into the state; count, resultant and depth into the report.
static void report_pairs(OmContact* c, const OmTissueModel* m, OmTissueState* s,
                         const OmTissueWork* w, double h) {
    double* f_touch = om_tissue_contact_force(s);
    OmContactReport* report = &c->report;
    memset(f_touch, 0, 3 * (size_t)om_tissue_mesh(m)->nvert * sizeof *f_touch);
    report->ncontact = 0;
    report->penetration = 0;
    report->force = om_vec3(0, 0, 0);
    for (int k = 0; k < c->npair; ++k) {
        const OmContactPair* pair = &c->pair[k];
        OmVec3 d = moved_by(s, om_tissue_dv(w), pair->vert, h), n;
        double gap =
            om__contact_gap(c, pair->obstacle, om_add(om_load3(om_tissue_x(s), pair->vert), d), &n);
        report->penetration = fmax(report->penetration, -gap);
        if (!pair->is_active || pair->push <= 0) continue;
        OmVec3 dt = om_madd(d, -om_dot(pair->n, d), pair->n);
        OmVec3 f = om_madd(om_scale(pair->push, pair->n), -pair->was_drag / h, dt);
        om_store3(f_touch, pair->vert, om_add(om_load3(f_touch, pair->vert), f));
        report->force = om_add(report->force, f);
        ++report->ncontact;
    }
}

static OmStatus solve_contact(void* ctx, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                              double h, OmTissueReport* report) {
    OmContact* c = ctx;
    OmStatus status = OM_OK;
    find_pairs(c, m, s, w, h);
    c->report.is_settled = false;
    for (int n = 0; n < c->def.max_iterations && !c->report.is_settled; ++n) {
        if (n >= c->def.max_iterations / 2) close_set(c);
        add_forces(c, w, h);
        status = om_tissue_solve_step(m, s, w, report);
        if (status < 0) return status;
        ++c->report.nsolve;
        int nchange = update_pairs(c, s, w, h);
        c->report.is_settled = nchange == 0;
    }
    report_pairs(c, m, s, w, h);
    return status;
}

OmStatus om_contact_step(OmContact* c, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                         double h, OmContactReport* report) {
    c->report = (OmContactReport){0};
    OmTissueReport tissue = {0};
    OmStatus status = om_tissue_moves_itself(m)
                          ? om__contact_step_among(c, m, s, w, h, &tissue)
                          : om_tissue_step_with(m, s, w, h, solve_contact, c, &tissue);
    c->report.tissue = tissue;
    if (report) *report = c->report;
    return status;
}

OmStatus om_contact_settle(OmContact* c, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                           double h, double speed, double seconds) {
    OM_CHECK(speed > 0 && seconds > 0 && h > 0 && seconds / h <= 1e9, OM_INVALID,
             "contact: speed (%g m/s), seconds (%g) and the time step (%g s) must be above 0",
             speed, seconds, h);
    int nvert = om_tissue_mesh(m)->nvert;
    for (int n = 0; n < (int)ceil(seconds / h); ++n) {
        OM_TRY(om_contact_step(c, m, s, w, h, NULL));
        double fastest = 0;
        for (int i = 0; i < nvert; ++i)
            fastest = fmax(fastest, om_norm2(om_load3(om_tissue_v(s), i)));
        if (fastest < speed * speed) return OM_OK;
    }
    return om_error(OM_NOT_CONVERGED, "the tissue still moves faster than %g m/s after %g s", speed,
                    seconds);
}
