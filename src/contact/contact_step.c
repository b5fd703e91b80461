// contact_step.c: which vertices an obstacle pushes, found inside the step.
//
// A touching vertex asks for gap >= goal at the end of the step; it gets the implicit force
// k (goal - gap_end) n, k a thousand times what resists moving that vertex alone, so that a resting vertex
// sinks in by its weight over k: micrometres. goal is 0, or for tissue that began inside what
// recover_speed allows. The active set is a semismooth Newton iteration: solve, release vertices that are pulled,
// take vertices that went in, solve again. In the second half of the iterations a free vertex stays free.
//
// A curved obstacle is replaced by a plane that turns: laid at the move d0 of the last solve, its normal at a move
// d is n - C (d - d0), C the curvature where the obstacle is hollow. The matrix gets push C for it, so a vertex in
// a hollow feels that the wall rises (with a plane alone a block on bumps of 4 mm never came to rest: 0.1 m/s after
// 6 s). Where the obstacle is round the curvature has the other sign and would make the matrix indefinite: it is
// left out at first, and its magnitude damps the iteration from solve DAMP_FROM on. After every solve each plane is
// compared with the obstacle where the vertex is, by distance and by angle, and laid anew where it differs. A step
// is settled when the set, the planes and friction stay as they were; a step that is not is cut, down to SHORTEST
// of it, and reported as not settled if that does not help.
//
// Friction is Coulomb's with the normal force of the last solve, viscous below SLOW:
// f = -mu push v_t / max(|v_t|, SLOW), v_t at the end of the step, |v_t| of the last solve; solved again until
// push / |v_t| stays. The first solve takes both from the state. With one correction only, what should stick
// crept at 14 mm/s.
#include <string.h>

#include "contact/contact_internal.h"

#define SLOW 1e-3            // m/s
#define SAME_DRAG 0.02       // relative: friction that changes more is solved again
#define LET_GO 1e-8          // of the model's size: pulled
#define TAKE 1e-6            // of the model's size: went in
#define FLAT 1e-5            // of the model's size: a plane farther from the obstacle is laid anew
#define SAME_ANGLE 5e-3      // rad, and one that is turned by more
#define DAMP_FROM 4          // solves before round obstacles damp the iteration
#define SHORTEST (1.0 / 32)  // of a step, to which it is cut for the sake of contacts
#define STILL 3              // steps in a row below a speed: tissue that turns back is slow in one
#define REACH 0.05           // of the model's size: pairs farther than this are not looked at

static OmVec3 moved_by(const OmTissueState* s, const double* dv, int i, double h) {
    return om_scale(h, om_add(om_load3(om_tissue_v(s), i), om_load3(dv, i)));
}

// ---- what stands for an obstacle --------------------------------------------------------------------

// Gap and normal at p. On a curved obstacle the normal is the gradient by differences over c->ring on both sides:
// the gradient of a sampled field jumps from cell to cell, and in a hollow kink no normal would be right. The same
// places tell how the normal turns: H[0] and H[1] along t[0] and t[1], in the plane of these two, H[2] in between.
static double look(const OmContact* c, int obstacle, OmVec3 p, OmVec3* n, OmVec3 t[2],
                   double H[3]) {
    static const OmVec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double gap = om__contact_gap(c, obstacle, p, n), slope[3];
    H[0] = H[1] = H[2] = 0;
    if (c->obstacle[obstacle].is_plane || !isfinite(gap)) return gap;
    OmMat3 turn;
    OmVec3* column[3] = {&turn.cx, &turn.cy, &turn.cz};
    for (int k = 0; k < 3; ++k) {
        OmVec3 ahead, behind;
        double a = om__contact_gap(c, obstacle, om_madd(p, c->ring, axis[k]), &ahead);
        double b = om__contact_gap(c, obstacle, om_madd(p, -c->ring, axis[k]), &behind);
        if (!isfinite(a) || !isfinite(b)) return gap;
        slope[k] = 0.5 * (a - b) / c->ring;
        *column[k] = om_scale(0.5 / c->ring, om_sub(ahead, behind));
    }
    OmVec3 steepest = om_vec3(slope[0], slope[1], slope[2]);
    if (!(om_norm(steepest) > 0.5))
        return gap;  // a thin edge: its two sides have no normal in between
    *n = om_normalize(steepest);
    t[0] = om_orthogonal(*n);
    t[1] = om_cross(*n, t[0]);
    OmVec3 turn0 = om_mat3_apply(turn, t[0]), turn1 = om_mat3_apply(turn, t[1]);
    H[0] = om_dot(t[0], turn0);
    H[1] = om_dot(t[1], turn1);
    H[2] = 0.5 * (om_dot(t[0], turn1) + om_dot(t[1], turn0));
    return gap;
}

// sum over eigenvalues of f(e) e e^T, f the positive part, or the magnitude, of -H.
static OmMat3 stiffen(const OmVec3 t[2], const double H[3], bool is_damped) {
    double mean = -0.5 * (H[0] + H[1]), half = -0.5 * (H[0] - H[1]), r = hypot(half, H[2]);
    double hi = mean + r, lo = mean - r;
    hi = is_damped ? fabs(hi) : fmax(0, hi);
    lo = is_damped ? fabs(lo) : fmax(0, lo);
    // f(-H) = a I + b (-H - mean I) in the plane of t
    double a = 0.5 * (hi + lo), b = r > 0 ? 0.5 * (hi - lo) / r : 0;
    OmMat3 C = om_mat3_scale(a + b * half, om_mat3_outer(t[0], t[0]));
    C = om_mat3_add(C, om_mat3_scale(a - b * half, om_mat3_outer(t[1], t[1])));
    OmMat3 mixed = om_mat3_add(om_mat3_outer(t[0], t[1]), om_mat3_outer(t[1], t[0]));
    return om_mat3_add(C, om_mat3_scale(-b * H[2], mixed));
}

// The plane that stands for an obstacle, and how it turns around vertex pair->vert, expected to move by d.
static void lay(const OmContact* c, OmContactPair* pair, OmVec3 x, OmVec3 d, bool is_damped) {
    OmVec3 t[2];
    double H[3], gap = look(c, pair->obstacle, om_add(x, d), &pair->n, t, H);
    pair->gap = gap - om_dot(pair->n, d);
    pair->at = d;
    pair->is_bent = H[0] != 0 || H[1] != 0 || H[2] != 0;
    if (pair->is_bent) pair->C = stiffen(t, H, is_damped);
}

// Is the vertex, that moved by d, where plane and curvature say that the obstacle is?
static bool is_right(const OmContact* c, const OmContactPair* pair, OmVec3 x, OmVec3 d) {
    if (c->obstacle[pair->obstacle].is_plane) return true;
    OmVec3 t[2], n, model = pair->n;
    double H[3], gap = look(c, pair->obstacle, om_add(x, d), &n, t, H);
    if (fabs(gap - pair->gap - om_dot(pair->n, d)) > FLAT * c->size) return false;
    if (pair->is_bent)
        model = om_normalize(om_sub(model, om_mat3_apply(pair->C, om_sub(d, pair->at))));
    double angle = om_distance(n, model), soft = pair->k / c->def.stiffness;
    return angle <= SAME_ANGLE || pair->push * angle <= soft * FLAT * c->size;
}

// ---- stages of a step -------------------------------------------------------------------------------

// An obstacle without a coefficient has the engine's own: none for engines with a matrix.
static double friction_of(const OmContact* c, int obstacle) {
    return fmax(0, c->obstacle[obstacle].friction);
}

// Friction as the last step left it, for the first solve.
static void recall_friction(OmContactPair* pair, double friction, OmVec3 v) {
    OmVec3 vt = om_madd(v, -om_dot(pair->n, v), pair->n);
    pair->drag = friction * pair->push / fmax(SLOW, om_norm(vt));
}

// Pairs within reach, active where the last step pushed or the vertex would go in if nothing else acted. On a
// curved organ a plane is off by more than a resting vertex sinks: its distance alone cannot tell that it rests,
// and to find that out again by solving took three solves a step.
static void find_pairs(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                       const OmTissueWork* w, double h) {
    const OmContact* c = cw->contact;
    const double *x = om_tissue_x(s), *v = om_tissue_v(s), *touch = om_tissue_contact_force(s);
    cw->npair = 0;
    for (int n = 0; n < c->nsurface; ++n) {
        int i = c->surface_vert[n];
        if (om_tissue_is_prescribed(m, s, i)) continue;
        OmVec3 p = om_load3(x, i), d = om_scale(h, om_load3(v, i)), normal;
        for (int k = 0; k < c->def.nobstacle; ++k) {
            double begin = om__contact_gap(c, k, p, &normal);
            if (begin - om_norm(d) > REACH * c->size) continue;
            OmContactPair* pair = &cw->pair[cw->npair++];
            *pair = (OmContactPair){.vert = i, .obstacle = k};
            pair->goal = fmin(0, begin + c->def.recover_speed * h);
            pair->k = c->def.stiffness * om_tissue_vertex_stiffness(w, i);
            double end = om__contact_gap(c, k, om_add(p, d), &pair->n);
            pair->push = fmax(0, om_dot(om_load3(touch, i), pair->n));
            pair->is_active = pair->push > 0 || fmin(begin, end - pair->goal) < -TAKE * c->size;
            if (!pair->is_active) continue;
            lay(c, pair, p, d, false);
            if (friction_of(c, k) > 0) recall_friction(pair, friction_of(c, k), om_load3(v, i));
        }
    }
}

static void add_forces(OmContactWork* cw, OmTissueWork* w, double h) {
    om_tissue_clear_forces(w);
    for (int k = 0; k < cw->npair; ++k) {
        OmContactPair* pair = &cw->pair[k];
        pair->was_drag = pair->drag;
        pair->was_push = pair->push;
        if (!pair->is_active) continue;
        OmMat3 nn = om_mat3_outer(pair->n, pair->n);
        OmMat3 K = om_mat3_scale(pair->k - pair->drag / h, nn);
        K = om_mat3_add(K, om_mat3_scale(pair->drag / h, om_mat3_identity()));
        OmVec3 f = om_scale(pair->k * (pair->goal - pair->gap), pair->n);
        if (pair->is_bent) {
            OmMat3 turn = om_mat3_scale(pair->push, pair->C);
            K = om_mat3_add(K, turn);
            f = om_add(f, om_mat3_apply(turn, pair->at));
        }
        om_tissue_add_force(w, pair->vert, f, K);
    }
}

// Look at the outcome of a solve; returns how many pairs changed.
static int update_pairs(OmContactWork* cw, const OmTissueState* s, const OmTissueWork* w, double h,
                        bool is_damped) {
    const OmContact* c = cw->contact;
    const double *x = om_tissue_x(s), *dv = om_tissue_dv(w);
    int nchange = 0;
    for (int k = 0; k < cw->npair; ++k) {
        OmContactPair* pair = &cw->pair[k];
        OmVec3 p = om_load3(x, pair->vert), d = moved_by(s, dv, pair->vert, h), n;
        double end = pair->gap + om_dot(pair->n, d) - pair->goal;
        pair->force = om_vec3(0, 0, 0);
        if (pair->is_active && end > LET_GO * c->size) {
            pair->is_active = false;
            pair->push = pair->drag = 0;
            ++nchange;
        } else if (pair->is_active) {
            OmVec3 vt = om_scale(1 / h, om_madd(d, -om_dot(pair->n, d), pair->n));
            pair->push = fmax(0, -pair->k * end);
            pair->force = om_madd(om_scale(pair->push, pair->n), -pair->was_drag, vt);
            if (pair->is_bent)
                pair->force = om_madd(pair->force, -pair->was_push,
                                      om_mat3_apply(pair->C, om_sub(d, pair->at)));
            double drag = friction_of(c, pair->obstacle) * pair->push / fmax(SLOW, om_norm(vt));
            bool is_same = fabs(drag - pair->drag) <= SAME_DRAG * drag;
            pair->drag = drag;
            nchange += !is_same;
            if (is_right(c, pair, p, d)) continue;
            lay(c, pair, p, d, is_damped);
            nchange += is_same;
        } else {
            if (om__contact_gap(c, pair->obstacle, om_add(p, d), &n) - pair->goal >=
                -TAKE * c->size)
                continue;
            ++nchange;
            if (pair->is_closed) continue;
            lay(c, pair, p, d, is_damped);
            pair->is_active = true;
        }
    }
    return nchange;
}

// From the middle of the iterations on, who is free stays free.
static void close_set(OmContactWork* cw) {
    for (int k = 0; k < cw->npair; ++k) cw->pair[k].is_closed |= !cw->pair[k].is_active;
}

// Forces into the state; count, resultant and depth into the report.
static void report_pairs(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                         const OmTissueWork* w, double h) {
    double* f_touch = om_tissue_contact_force(s);
    const OmContact* c = cw->contact;
    OmContactReport* report = &cw->report;
    memset(f_touch, 0, 3 * (size_t)om_tissue_mesh(m)->nvert * sizeof *f_touch);
    report->ncontact = 0;
    report->penetration = 0;
    report->force = om_vec3(0, 0, 0);
    for (int k = 0; k < cw->npair; ++k) {
        const OmContactPair* pair = &cw->pair[k];
        OmVec3 d = moved_by(s, om_tissue_dv(w), pair->vert, h), n;
        double gap =
            om__contact_gap(c, pair->obstacle, om_add(om_load3(om_tissue_x(s), pair->vert), d), &n);
        report->penetration = fmax(report->penetration, -gap);
        if (!pair->is_active || pair->push <= 0) continue;
        om_store3(f_touch, pair->vert, om_add(om_load3(f_touch, pair->vert), pair->force));
        report->force = om_add(report->force, pair->force);
        ++report->ncontact;
    }
}

// An accepted substep is followed by one that begins later.
static void note_settled(OmContactWork* cw, double time) {
    if (time > cw->seen_time) cw->has_settled &= cw->report.is_settled;
    cw->seen_time = time;
}

static OmStatus solve_contact(void* ctx, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                              double h, OmTissueReport* report) {
    OmContactWork* cw = ctx;
    OmStatus status = OM_OK;
    note_settled(cw, om_tissue_time(s));
    find_pairs(cw, m, s, w, h);
    cw->report.is_settled = false;
    for (int n = 0; n < cw->contact->def.max_iterations && !cw->report.is_settled; ++n) {
        if (n >= cw->contact->def.max_iterations / 2) close_set(cw);
        add_forces(cw, w, h);
        status = om_tissue_solve_step(m, s, w, report);
        if (status < 0) return status;
        ++cw->report.nsolve;
        int nchange = update_pairs(cw, s, w, h, n >= DAMP_FROM);
        cw->report.is_settled = nchange == 0;
    }
    OM_CHECK(cw->report.is_settled || h < 2 * SHORTEST * cw->h, OM_INVALID,
             "contact: what touches has not settled after %d solves",
             cw->contact->def.max_iterations);
    report_pairs(cw, m, s, w, h);
    return status;
}

// A step of an engine that keeps out of obstacles itself, into the report.
static OmStatus step_among(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                           OmTissueWork* w, double h, OmTissueReport* tissue) {
    OmContactReport* r = &cw->report;
    int nobstacle = cw->contact->def.nobstacle;
    OmStatus status = om_tissue_step_among(m, s, w, h, nobstacle, cw->obstacle, tissue);
    if (status < 0) return status;
    r->nsolve = tissue->substeps;
    r->is_settled = true;
    for (int k = 0; k < nobstacle; ++k) {
        const OmTissueObstacle* o = &cw->obstacle[k];
        r->ncontact += o->ncontact;
        r->force = om_add(r->force, o->force);
        r->penetration = fmax(r->penetration, o->penetration);
    }
    return status;
}

OmStatus om_contact_step(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                         OmTissueWork* w, double h, OmContactReport* report) {
    cw->report = (OmContactReport){0};
    cw->h = h;
    cw->seen_time = om_tissue_time(s);
    cw->has_settled = true;
    OmTissueReport tissue = {0};
    OmStatus status = om_tissue_moves_itself(m)
                          ? step_among(cw, m, s, w, h, &tissue)
                          : om_tissue_step_with(m, s, w, h, solve_contact, cw, &tissue);
    cw->report.is_settled &= cw->has_settled;
    cw->report.tissue = tissue;
    if (report) *report = cw->report;
    if (status != OM_OK || cw->report.is_settled) return status;
    return om_error(OM_NOT_CONVERGED, "contact: what touches has not settled in a step of %g s", h);
}

OmStatus om_contact_settle(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                           OmTissueWork* w, double h, double speed, double seconds) {
    OM_CHECK(speed > 0 && seconds > 0 && h > 0 && seconds / h <= 1e9, OM_INVALID,
             "contact: speed (%g m/s), seconds (%g) and the time step (%g s) must be above 0",
             speed, seconds, h);
    int nvert = om_tissue_mesh(m)->nvert, nstill = 0;
    for (int n = 0; n < (int)ceil(seconds / h); ++n) {
        OM_TRY(om_contact_step(cw, m, s, w, h, NULL));
        double fastest = 0;
        for (int i = 0; i < nvert; ++i)
            fastest = fmax(fastest, om_norm2(om_load3(om_tissue_v(s), i)));
        nstill = cw->report.is_settled && fastest < speed * speed ? nstill + 1 : 0;
        if (nstill < STILL) continue;
        int ninverted = cw->report.tissue.ninverted;
        if (ninverted == 0) return OM_OK;
        return om_error(OM_NOT_CONVERGED, "the tissue is at rest with %d inverted elements",
                        ninverted);
    }
    return om_error(OM_NOT_CONVERGED, "the tissue still moves faster than %g m/s after %g s", speed,
                    seconds);
}
