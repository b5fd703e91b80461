// contact_vertex.c: contact of vertices with obstacles; the active set is found inside the step.
//
// A contact vertex must have gap >= goal at the end of the step; it gets the implicit force k (goal - gap_end) n. k
// is a thousand times the resistance against moving the vertex alone, so that a resting vertex penetrates by its
// weight over k: micrometres. goal is 0, or the gap that recover_speed allows for a vertex that began inside. The
// active set is a semismooth Newton iteration: solve, release vertices that are pulled, activate vertices that
// penetrate, solve again. In the second half of the iterations a free vertex stays free.
//
// A curved obstacle is replaced by a plane that rotates: linearised at the displacement d0 of the last solve, its
// normal at a displacement d is n - C (d - d0), C the curvature where the obstacle is hollow. The matrix gets push C
// for it, so in a hollow the force accounts for the curvature (with a plane alone a block on bumps of 4 mm did not
// come to rest: 0.1 m/s after 6 s). Where the obstacle is round the curvature has the other sign and would make the
// matrix indefinite: it is left out at first, and its magnitude damps the iteration from the fifth solve on. After
// every solve each plane is compared with the obstacle at the vertex, by gap and angle, and linearised again where it
// differs. A step has settled when active set, planes and friction stay the same. A step that has not is cut, down to
// a 32nd, and reported as not settled if that does not help.
//
// Friction is Coulomb's with the normal force of the last solve, viscous below SLOW:
// f = -mu push v_t / max(|v_t|, SLOW), v_t at the end of the step against the obstacle, |v_t| of the last solve; solved
// again until push / |v_t| stays the same. The first solve takes both from the state. With one correction only, tissue
// that should stick crept at 14 mm/s.
#include <string.h>

#include "contact/contact_internal.h"

#define SLOW 1e-3        // m/s
#define SAME_DRAG 0.02   // relative: friction that changes more is solved again
#define RELEASE 1e-8     // of the model's size: gap at which an active vertex is released
#define ACTIVATE 1e-6    // of the model's size: penetration at which a free vertex becomes active
#define PLANE_GAP 1e-5   // of the model's size: error of a plane that is linearised again
#define SAME_ANGLE 5e-3  // rad, the same of its normal
#define REACH 0.05       // of the model's size: vertices farther from an obstacle are ignored
#define FACING 0.1       // cosine between the surface and an obstacle that it looks at

static OmVec3 displacement(const OmTissueState* s, const double* dv, int i, double h) {
    return om_scale(h, om_add(om_load3(om_tissue_v(s), i), om_load3(dv, i)));
}

// ---- planes that replace an obstacle ------------------------------------------------------------------

// Gap and normal at p. On a curved obstacle the normal is the gradient by differences over c->ring on both sides: the
// gradient of a sampled field jumps from cell to cell, and in a hollow kink there is no normal. The same differences
// give the derivative of the normal in the tangent plane: H[0] along t[0], H[1] along t[1], H[2] mixed.
static double eval_obstacle(const OmContactWork* cw, int obstacle, OmVec3 p, OmVec3* n, OmVec3 t[2],
                            double H[3]) {
    static const OmVec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const OmContact* c = cw->contact;
    double gap = om__contact_gap(cw, obstacle, true, p, n), slope[3];
    H[0] = H[1] = H[2] = 0;
    if (c->obstacle[obstacle].is_plane || !isfinite(gap)) return gap;
    OmMat3 turn;
    OmVec3* column[3] = {&turn.cx, &turn.cy, &turn.cz};
    for (int k = 0; k < 3; ++k) {
        OmVec3 ahead, behind;
        double a = om__contact_gap(cw, obstacle, true, om_madd(p, c->ring, axis[k]), &ahead);
        double b = om__contact_gap(cw, obstacle, true, om_madd(p, -c->ring, axis[k]), &behind);
        if (!isfinite(a) || !isfinite(b)) return gap;
        slope[k] = 0.5 * (a - b) / c->ring;
        *column[k] = om_scale(0.5 / c->ring, om_sub(ahead, behind));
    }
    OmVec3 steepest = om_vec3(slope[0], slope[1], slope[2]);
    if (!(om_norm(steepest) > 0.5)) return gap;  // a thin edge: its two sides have no common normal
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
static OmMat3 curvature_tangent(const OmVec3 t[2], const double H[3], bool is_damped) {
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

// The plane that replaces an obstacle, and its rotation, for a vertex at x with predicted displacement d.
static void linearise(const OmContactWork* cw, OmContactPair* pair, OmVec3 x, OmVec3 d,
                      bool is_damped) {
    OmVec3 t[2];
    double H[3], gap = eval_obstacle(cw, pair->obstacle, om_add(x, d), &pair->n, t, H);
    pair->gap = gap - om_dot(pair->n, d);
    pair->at = d;
    pair->is_curved = H[0] != 0 || H[1] != 0 || H[2] != 0;
    if (pair->is_curved) pair->C = curvature_tangent(t, H, is_damped);
}

// True if plane and curvature agree with the obstacle at displacement d of the vertex.
static bool is_plane_valid(const OmContactWork* cw, const OmContactPair* pair, OmVec3 x, OmVec3 d) {
    const OmContact* c = cw->contact;
    if (c->obstacle[pair->obstacle].is_plane) return true;
    OmVec3 t[2], n, model = pair->n;
    double H[3], gap = eval_obstacle(cw, pair->obstacle, om_add(x, d), &n, t, H);
    if (fabs(gap - pair->gap - om_dot(pair->n, d)) > PLANE_GAP * c->size) return false;
    if (pair->is_curved)
        model = om_normalize(om_sub(model, om_mat3_apply(pair->C, om_sub(d, pair->at))));
    double angle = om_distance(n, model), soft = pair->k / c->def.stiffness;
    return angle <= SAME_ANGLE || pair->push * angle <= soft * PLANE_GAP * c->size;
}

// ---- stages of a step -------------------------------------------------------------------------------

static void find_normals(OmContactWork* cw, const double* x) {
    const OmContact* c = cw->contact;
    memset(cw->normal, 0, 3 * (size_t)c->nvert * sizeof *cw->normal);
    for (int t = 0; t < c->ntri; ++t) {
        const int* v = c->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(x, v[0]);
        OmVec3 n = om_cross(om_sub(om_load3(x, v[1]), a), om_sub(om_load3(x, v[2]), a));
        for (int k = 0; k < 3; ++k)
            om_store3(cw->normal, v[k], om_add(om_load3(cw->normal, v[k]), n));
    }
    cw->has_normal = true;
}

// True if the surface at vertex i looks at an obstacle with normal n. In a fall the motion predicted for a step may be
// longer than the body: then the far side would penetrate too, but the near side stops it. With every such vertex in
// the first guess an impact took five solves in place of one, with coarse matrices made for the wrong set.
bool om__contact_is_facing(OmContactWork* cw, const double* x, int i, OmVec3 n) {
    if (cw->contact->ntri == 0) return true;
    if (!cw->has_normal) find_normals(cw, x);
    OmVec3 out = om_load3(cw->normal, i);
    return om_dot(out, n) < -FACING * om_norm(out);
}

// An obstacle without a coefficient has the engine's own: none for engines with a matrix.
static double friction_of(const OmContact* c, int obstacle) {
    return fmax(0, c->obstacle[obstacle].friction);
}

// Friction of the last step, for the first solve.
static void recall_friction(OmContactPair* pair, double friction, OmVec3 v) {
    OmVec3 vt = om_madd(v, -om_dot(pair->n, v), pair->n);
    pair->drag = friction * pair->push / fmax(SLOW, om_norm(vt));
}

// On a curved organ the error of a plane is larger than the penetration of a resting vertex: the gap alone does not
// show that the vertex rests, and finding the active set again from gaps took three solves a step.
OmStatus om__contact_find_pairs(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                                const OmTissueWork* w, double h) {
    const OmContact* c = cw->contact;
    const double *x = om_tissue_x(s), *v = om_tissue_v(s), *last_force = om_tissue_contact_force(s);
    cw->npair = cw->nactive = 0;
    cw->has_normal = false;
    for (int n = 0; n < c->nsurface; ++n) {
        int i = c->surface_vert[n];
        if (om_tissue_is_prescribed(m, s, i)) continue;
        OmVec3 p = om_load3(x, i), d = om_scale(h, om_load3(v, i)), normal;
        for (int k = 0; k < c->def.nobstacle; ++k) {
            double begin = om__contact_gap(cw, k, false, p, &normal);
            OmVec3 move = om__contact_obstacle_move(cw, k, p);
            if (begin - om_norm(d) - om_norm(move) > REACH * c->size) continue;
            OmContactPair* pair = &cw->pair[cw->npair++];
            *pair = (OmContactPair){.vert = i, .obstacle = k, .obstacle_move = move};
            pair->is_moving = om_norm2(move) > 0;
            pair->goal = fmin(0, begin + c->def.recover_speed * h);
            pair->k = c->def.stiffness * om_tissue_vertex_stiffness(w, i);
            double end = om__contact_gap(cw, k, true, om_add(p, d), &pair->n);
            pair->push = fmax(0, om_dot(om_load3(last_force, i), pair->n));
            // with self-contact the last force may be that of other tissue
            if (c->body && begin > c->ring) pair->push = 0;
            bool is_old = pair->push > 0 || begin < -ACTIVATE * c->size;
            pair->is_active = is_old || (end - pair->goal < -ACTIVATE * c->size &&
                                         om__contact_is_facing(cw, x, i, normal));
            if (!pair->is_active) continue;
            ++cw->nactive;
            linearise(cw, pair, p, d, false);
            OmVec3 slip = om_load3(v, i);
            if (pair->is_moving) slip = om_madd(slip, -1 / h, move);
            if (friction_of(c, k) > 0) recall_friction(pair, friction_of(c, k), slip);
        }
    }
    om__skins_find_pairs(cw, m, s, w, h);
    return om__self_find_pairs(cw, m, s, w, h);
}

// Pairs of places of the tissue: vertices against skins, and the tissue against itself.
enum { SKINS, SELF, NKIND };

typedef struct OmPairs {
    int npair;
    OmSelfPair* pair;
} OmPairs;

static OmPairs pairs_of(const OmContactWork* cw, int kind) {
    if (kind == SKINS) return cw->ride ? (OmPairs){cw->ride->npair, cw->ride->pair} : (OmPairs){0};
    return cw->self ? (OmPairs){cw->self->npair, cw->self->pair} : (OmPairs){0};
}

OmStatus om__contact_add_forces(OmContactWork* cw, OmTissueWork* w, double h) {
    for (int k = 0; k < cw->npair; ++k) {
        OmContactPair* pair = &cw->pair[k];
        pair->was_drag = pair->drag;
        pair->was_push = pair->push;
        if (!pair->is_active) continue;
        OmMat3 nn = om_mat3_outer(pair->n, pair->n);
        OmMat3 K = om_mat3_scale(pair->k - pair->drag / h, nn);
        K = om_mat3_add(K, om_mat3_scale(pair->drag / h, om_mat3_identity()));
        OmVec3 f = om_scale(pair->k * (pair->goal - pair->gap), pair->n);
        if (pair->is_moving) {
            OmVec3 along =
                om_madd(pair->obstacle_move, -om_dot(pair->obstacle_move, pair->n), pair->n);
            f = om_madd(f, pair->drag / h, along);
        }
        if (pair->is_curved) {
            OmMat3 turn = om_mat3_scale(pair->push, pair->C);
            K = om_mat3_add(K, turn);
            f = om_add(f, om_mat3_apply(turn, pair->at));
        }
        om_tissue_add_force(w, pair->vert, f, K);
    }
    for (int kind = 0; kind < NKIND; ++kind) {
        OmPairs list = pairs_of(cw, kind);
        OM_TRY(om__pairs_add_forces(list.npair, list.pair, w));
    }
    return OM_OK;
}

static int update_vertices(OmContactWork* cw, const OmTissueState* s, const OmTissueWork* w,
                           double h, bool is_damped) {
    const OmContact* c = cw->contact;
    const double *x = om_tissue_x(s), *dv = om_tissue_dv(w);
    int nchange = 0;
    cw->nswitch = 0;
    for (int k = 0; k < cw->npair; ++k) {
        OmContactPair* pair = &cw->pair[k];
        OmVec3 p = om_load3(x, pair->vert), d = displacement(s, dv, pair->vert, h), n;
        double end = pair->gap + om_dot(pair->n, d) - pair->goal;
        pair->force = om_vec3(0, 0, 0);
        if (pair->is_active && end > RELEASE * c->size) {
            pair->is_active = false;
            pair->push = pair->drag = 0;
            --cw->nactive;
            ++cw->nswitch;
            ++nchange;
        } else if (pair->is_active) {
            OmVec3 rel = pair->is_moving ? om_sub(d, pair->obstacle_move) : d;
            OmVec3 vt = om_scale(1 / h, om_madd(rel, -om_dot(pair->n, rel), pair->n));
            pair->push = fmax(0, -pair->k * end);
            pair->force = om_madd(om_scale(pair->push, pair->n), -pair->was_drag, vt);
            if (pair->is_curved)
                pair->force = om_madd(pair->force, -pair->was_push,
                                      om_mat3_apply(pair->C, om_sub(d, pair->at)));
            double drag = friction_of(c, pair->obstacle) * pair->push / fmax(SLOW, om_norm(vt));
            bool is_same = fabs(drag - pair->drag) <= SAME_DRAG * drag;
            pair->drag = drag;
            nchange += !is_same;
            if (is_plane_valid(cw, pair, p, d)) continue;
            linearise(cw, pair, p, d, is_damped);
            nchange += is_same;
        } else {
            if (om__contact_gap(cw, pair->obstacle, true, om_add(p, d), &n) - pair->goal >=
                -ACTIVATE * c->size)
                continue;
            ++nchange;
            if (pair->is_closed) continue;
            linearise(cw, pair, p, d, is_damped);
            pair->is_active = true;
            ++cw->nactive;
            ++cw->nswitch;
        }
    }
    return nchange;
}

OmStatus om__contact_update_pairs(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                                  const OmTissueWork* w, double h, bool is_damped, int* nchange) {
    int nself;
    *nchange = update_vertices(cw, s, w, h, is_damped);
    OM_TRY(om__self_update_pairs(cw, m, s, w, h, is_damped, &nself));
    *nchange += nself + om__skins_update_pairs(cw, m, s, w, h, is_damped);
    return OM_OK;
}

void om__contact_close_set(OmContactWork* cw) {
    for (int k = 0; k < cw->npair; ++k) cw->pair[k].is_closed |= !cw->pair[k].is_active;
    for (int kind = 0; kind < NKIND; ++kind) {
        OmPairs list = pairs_of(cw, kind);
        om__pairs_close_set(list.npair, list.pair);
    }
}

double om__contact_estimate_force(const OmContactWork* cw, const OmTissueState* s, double h) {
    double sum = 0;
    for (int k = 0; k < cw->npair; ++k) {
        const OmContactPair* pair = &cw->pair[k];
        if (!pair->is_active || !pair->is_moving) continue;
        OmVec3 d = om_scale(h, om_load3(om_tissue_v(s), pair->vert));
        double depth = pair->goal - pair->gap - om_dot(pair->n, d);
        double f = fmax(0, depth) * pair->k / cw->contact->def.stiffness;
        sum += f * f;
    }
    return sqrt(sum);
}

void om__contact_begin_line(OmContactWork* cw, const OmTissueState* s, const double* last,
                            const double* increment, double h, OmContactLine* line) {
    for (int k = 0; k < cw->npair; ++k) {
        OmContactPair* pair = &cw->pair[k];
        OmVec3 d = displacement(s, last, pair->vert, h);
        pair->depth = pair->goal - pair->gap - om_dot(pair->n, d);
        pair->depth_rate = h * om_dot(pair->n, om_load3(increment, pair->vert));
        if (!pair->is_active) continue;
        line->farthest = fmax(line->farthest, fabs(pair->depth_rate));
        line->slope += pair->k * pair->depth * pair->depth_rate;
        line->curve -= pair->k * pair->depth_rate * pair->depth_rate;
    }
    for (int kind = 0; kind < NKIND; ++kind) {
        OmPairs list = pairs_of(cw, kind);
        om__pairs_begin_line(list.npair, list.pair, s, last, increment, h, line);
    }
}

void om__contact_add_line(const OmContactWork* cw, double at, double* slope) {
    for (int k = 0; k < cw->npair; ++k) {
        const OmContactPair* pair = &cw->pair[k];
        if (!pair->is_active) continue;
        *slope -= pair->k * fmax(0, pair->depth - at * pair->depth_rate) * pair->depth_rate;
    }
    for (int kind = 0; kind < NKIND; ++kind) {
        OmPairs list = pairs_of(cw, kind);
        om__pairs_add_line(list.npair, list.pair, at, slope);
    }
}

OmStatus om__contact_report_pairs(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                                  const OmTissueWork* w, double h) {
    double* f_contact = om_tissue_contact_force(s);
    OmContactReport* report = &cw->report;
    memset(f_contact, 0, 3 * (size_t)om_tissue_mesh(m)->nvert * sizeof *f_contact);
    report->ncontact = 0;
    report->penetration = 0;
    report->force = om_vec3(0, 0, 0);
    for (int k = 0; k < cw->contact->def.nobstacle; ++k) {
        OmTissueObstacle* o = &cw->obstacle[k];
        o->force = o->torque = om_vec3(0, 0, 0);
        o->ncontact = 0;
        o->penetration = 0;
    }
    for (int k = 0; k < cw->npair; ++k) {
        const OmContactPair* pair = &cw->pair[k];
        OmTissueObstacle* o = &cw->obstacle[pair->obstacle];
        OmVec3 d = displacement(s, om_tissue_dv(w), pair->vert, h), n;
        OmVec3 place = om_add(om_load3(om_tissue_x(s), pair->vert), d);
        double gap = om__contact_gap(cw, pair->obstacle, true, place, &n);
        o->penetration = fmax(o->penetration, -gap);
        report->penetration = fmax(report->penetration, -gap);
        if (!pair->is_active || pair->push <= 0) continue;
        om_store3(f_contact, pair->vert, om_add(om_load3(f_contact, pair->vert), pair->force));
        report->force = om_add(report->force, pair->force);
        ++report->ncontact;
        OmVec3 arm = om_sub(place, cw->frame[pair->obstacle].end.p);
        o->force = om_add(o->force, pair->force);
        o->torque = om_add(o->torque, om_cross(arm, pair->force));
        ++o->ncontact;
    }
    cw->ntouch = report->ntouch = 0;
    report->touch = cw->touch;
    OM_TRY(om__skins_report_pairs(cw, s));
    return om__self_report_pairs(cw, s);
}
