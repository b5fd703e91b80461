// contact_pair.c: two places of the tissue that touch, and their forces in a step.
//
// Friction is Coulomb's, linearised at the last slip: Newton's method. Where the slip turned round, the pair is tried
// as sticking. A push that is far from the last one, as in first guesses, takes the viscosity instead: Newton's
// tangent is a force that does not depend on the slip, and of a wrong push it threw a fold off its sheet. With the
// viscosity alone, as for obstacles, an impact had not settled after twelve solves in 20 of 30 substeps.
#include <math.h>

#include "base/base_grow.h"
#include "contact/contact_internal.h"

#define STIFF 30            // times the resistance against moving the two sides alone
#define SLOW 1e-5           // m/s, below it friction is viscous
#define SAME_FRICTION 0.02  // of Coulomb's bound: a larger error of friction is solved again
#define DAMP_FROM 10        // solves; from then on friction takes a part of Newton's tangent alone
#define DAMPED 0.5          // this part: between Newton's tangent and the viscosity
#define WEAK 0.05           // of the strongest push: weaker pairs are measured by its bound

OmVec3 om__pair_relative(const OmSelfPair* p, const double* x) {
    OmVec3 r = {0, 0, 0};
    for (int k = 0; k < 4; ++k) r = om_madd(r, p->weight[k], om_load3(x, p->vert[k]));
    return r;
}

OmVec3 om__pair_tangential(const OmSelfPair* p, OmVec3 d) {
    return om_madd(d, -om_dot(p->n, d), p->n);
}

double om__pair_stiffness(const OmTissueModel* m, OmTissueState* s, const OmTissueWork* work,
                          const OmSelfPair* p) {
    double give = 0;
    for (int k = 0; k < 4; ++k)
        if (!om_tissue_is_prescribed(m, s, p->vert[k]))
            give += p->weight[k] * p->weight[k] / om_tissue_vertex_stiffness(work, p->vert[k]);
    return give > 0 ? STIFF / give : 0;
}

// ---- friction ---------------------------------------------------------------------------------------

// For the next solve, linearised at the last slip. newton: 1, its tangent; 0, a viscosity that gives it at this slip,
// which converges slowly and always.
static void linearise(OmSelfPair* p, double max, double h, double newton) {
    double far = fmax(SLOW * h, om_norm(p->slip));
    OmMat3 K = om_mat3_add(om_mat3_identity(), om_mat3_outer(p->n, om_scale(-1, p->n)));
    if (far > SLOW * h)
        K = om_mat3_add(K, om_mat3_outer(p->slip, om_scale(-newton / (far * far), p->slip)));
    p->friction_K = om_mat3_scale(max / far, K);
    p->friction = om_madd(om_mat3_apply(p->friction_K, p->slip), -max / far, p->slip);
}

void om__pair_begin_friction(OmSelfPair* p, double mu, double h) {
    linearise(p, mu * p->push, h, 0);
}

// Friction that holds the two together, to try where the slip turned round in a solve.
static void try_to_stick(OmSelfPair* p, double max, double h) {
    OmMat3 K = om_mat3_add(om_mat3_identity(), om_mat3_outer(p->n, om_scale(-1, p->n)));
    p->friction_K = om_mat3_scale(max / (SLOW * h), K);
    p->friction = om_vec3(0, 0, 0);
}

// Compare the friction of an active pair with the solution; true if it must be solved again.
static bool update_friction(OmPairSums* sums, OmSelfPair* p, double mu, OmVec3 d, double h) {
    if (mu == 0) return false;
    OmVec3 was = p->slip, used = om_sub(p->friction, om_mat3_apply(p->friction_K, d));
    p->slip = om__pair_tangential(p, d);
    double max = mu * p->push, far = fmax(SLOW * h, om_norm(p->slip));
    OmVec3 right = om_scale(-max / far, p->slip);
    double error = om_distance(used, right);
    sums->friction_error += error;
    sums->friction_bound += max;
    if (error <= SAME_FRICTION * fmax(max, mu * WEAK * sums->strongest)) return false;
    ++sums->nslip;
    // Newton's tangent is a force that does not depend on the slip: of a wrong push it would throw tissue away
    bool is_late = sums->nsolve > DAMP_FROM;
    bool is_damped = is_late || p->push > 2 * p->was_push || p->push < 0.5 * p->was_push;
    if (om_dot(was, p->slip) < 0 && far > SLOW * h && !is_damped)
        try_to_stick(p, max, h);
    else
        linearise(p, max, h, is_late ? DAMPED : is_damped ? 0 : 1);
    return true;
}

// ---- stages of a step -----------------------------------------------------------------------------------

double om__pair_gap_at_end(const OmSelfPair* p, const double* x, const double* end) {
    OmVec3 d = om_sub(om__pair_relative(p, end), om__pair_relative(p, x));
    return p->gap - p->goal + om_dot(p->n, d);
}

OmStatus om__pairs_add_forces(int npair, const OmSelfPair* pair, OmTissueWork* work) {
    for (int k = 0; k < npair; ++k) {
        const OmSelfPair* p = &pair[k];
        if (!p->is_active) continue;
        OmMat3 K = om_mat3_add(om_mat3_scale(p->k, om_mat3_outer(p->n, p->n)), p->friction_K);
        OmVec3 f = om_madd(p->friction, p->k * (p->goal - p->gap), p->n);
        OM_TRY(om_tissue_add_tie(work, p->vert, p->weight, f, K));
    }
    return OM_OK;
}

void om__pairs_close_set(int npair, OmSelfPair* pair) {
    for (int k = 0; k < npair; ++k) pair[k].is_closed |= !pair[k].is_active;
}

void om__pairs_begin_update(OmPairSums* sums, int npair, const OmSelfPair* pair, const double* x,
                            const double* end) {
    sums->nswitch = sums->nslip = 0;
    sums->strongest = sums->friction_error = sums->friction_bound = 0;
    ++sums->nsolve;
    for (int k = 0; k < npair; ++k)
        if (pair[k].is_active)
            sums->strongest =
                fmax(sums->strongest, -pair[k].k * om__pair_gap_at_end(&pair[k], x, end));
}

bool om__pair_take_solution(OmPairSums* sums, OmSelfPair* p, double mu, const double* x,
                            const double* end, double h) {
    OmVec3 d = om_sub(om__pair_relative(p, end), om__pair_relative(p, x));
    p->was_push = p->push;
    p->push = fmax(0, -p->k * (p->gap - p->goal + om_dot(p->n, d)));
    p->force = om_madd(om_sub(p->friction, om_mat3_apply(p->friction_K, d)), p->push, p->n);
    return update_friction(sums, p, mu, d, h);
}

void om__pair_activate(OmPairSums* sums, OmSelfPair* p) {
    p->is_active = true;
    ++sums->nactive;
    ++sums->nswitch;
}

void om__pair_release(OmPairSums* sums, OmSelfPair* p) {
    p->is_active = false;
    p->push = 0;
    p->friction = p->slip = om_vec3(0, 0, 0);
    p->friction_K = om_mat3_diag(p->friction);
    --sums->nactive;
    ++sums->nswitch;
}

int om__pairs_count_changes(const OmPairSums* sums, int nchange) {
    bool is_right =
        sums->nsolve > DAMP_FROM && sums->friction_error <= SAME_FRICTION * sums->friction_bound;
    return is_right ? nchange - sums->nslip : nchange;
}

void om__pairs_begin_line(int npair, OmSelfPair* pair, const OmTissueState* s, const double* last,
                          const double* increment, double h, OmContactLine* line) {
    for (int k = 0; k < npair; ++k) {
        OmSelfPair* p = &pair[k];
        if (!p->is_active) continue;
        OmVec3 d =
            om_scale(h, om_add(om__pair_relative(p, om_tissue_v(s)), om__pair_relative(p, last)));
        p->depth = p->goal - p->gap - om_dot(p->n, d);
        p->depth_rate = h * om_dot(p->n, om__pair_relative(p, increment));
        line->farthest = fmax(line->farthest, fabs(p->depth_rate));
        line->slope += p->k * p->depth * p->depth_rate;
        line->curve -= p->k * p->depth_rate * p->depth_rate;
    }
}

void om__pairs_add_line(int npair, const OmSelfPair* pair, double at, double* slope) {
    for (int k = 0; k < npair; ++k) {
        const OmSelfPair* p = &pair[k];
        if (!p->is_active) continue;
        *slope -= p->k * fmax(0, p->depth - at * p->depth_rate) * p->depth_rate;
    }
}

OmStatus om__pair_report(OmContactWork* cw, OmTissueState* s, const OmSelfPair* p, int nfirst,
                         const double* end, double gap) {
    const int* body = cw->contact->body;
    double* f_contact = om_tissue_contact_force(s);
    OM_GROW(cw->touch, cw->ntouch, cw->max_touch, 64);
    OmContactTouch* t = &cw->touch[cw->ntouch++];
    *t = (OmContactTouch){.body = {body[p->vert[0]], body[p->vert[3]]},
                          .normal = p->n,
                          .force = p->force,
                          .gap = gap};
    for (int a = 0; a < 4; ++a) {
        t->vert[a] = p->vert[a];
        t->weight[a] = p->weight[a];
        OmVec3 x = om_load3(end, p->vert[a]);
        if (a < nfirst) t->point = om_madd(t->point, p->weight[a], x);
        OmVec3 sum = om_load3(f_contact, p->vert[a]);
        om_store3(f_contact, p->vert[a], om_madd(sum, p->weight[a], p->force));
    }
    cw->report.self_penetration = fmax(cw->report.self_penetration, -gap);
    cw->report.ntouch = cw->ntouch;
    cw->report.touch = cw->touch;
    return OM_OK;
}

// ---- what callers ask -----------------------------------------------------------------------------------

OmVec3 om_contact_body_force(const OmContactWork* cw, int a, int b) {
    OmVec3 sum = {0, 0, 0};
    for (int k = 0; k < cw->ntouch; ++k) {
        const OmContactTouch* t = &cw->touch[k];
        if (t->body[0] == a && t->body[1] == b) sum = om_add(sum, t->force);
        if (t->body[0] == b && t->body[1] == a) sum = om_sub(sum, t->force);
    }
    return sum;
}

int om_contact_body_count(const OmContact* c) { return c->nbody; }

int om_contact_body_of(const OmContact* c, int vert) {
    return c->body && vert >= 0 && vert < c->nvert ? c->body[vert] : -1;
}
