// tissue_guard.c: checks of a step: inverted elements and the balance of energy.
//
// One linearisation does not detect an element that inverts, nor a stress at the end of the step that is far from its
// linear prediction. So two rules check the outcome of every step, one for each element and one for the energy:
//
//     det F of an element does not fall below min(0.1, half of its value at the beginning)
//     dE <= W + ENERGY_SLACK s (E_kinetic + E_elastic + |W|) + ENERGY_FLOOR sum V mu
//
// s is the length of the substep as a fraction of the whole step. E is the kinetic, elastic and gravitational energy
// and that of springs. W is the work of tools, contact and external forces: the force at the end of the step times the
// displacement. For implicit Euler and a quadratic energy dE = W - |dv|_M^2 / 2 - d . K d / 2, so a correct step
// dissipates the last two terms.
// Changes are computed from dv and d, not as differences of energies. The check computes elastic energies in float,
// and again in double where the float energies break the rule.
//
// A linear solve that stopped early leaves r = rhs - A dv at free vertices, whose work -r.d / h may raise the energy.
// om__guard_project removes this work, not the rule: it minimises the energy of the linear system along v and dv, which
// makes r.v = r.dv = 0, so r.d = 0.
//
// Both checks take 5 to 15 % of a step of 1,440 elements. Tried and rejected: cutting a step to h / 1024 for elements
// whose energy is finite at det F = 0. Shorter steps do not prevent the inversion of a corotational element in a hard
// impact: as many elements inverted, and the run took a hundred times as long.
#include "tissue/tissue_internal.h"

#define ENERGY_SLACK 0.01
#define ENERGY_FLOOR 1e-6  // ten times the rounding of energies in floats
#define FLOAT_ERROR 1e-5   // of a large energy in floats, relative

OmVec3 om__apply_row(const OmBsr* A, const double* dv, int i) {
    OmVec3 y = {0, 0, 0};
    for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
        const float* a = A->value + 9 * (size_t)k;
        OmVec3 d = om_load3(dv, A->col[k]);
        y.x += (double)a[0] * d.x + (double)a[3] * d.y + (double)a[6] * d.z;
        y.y += (double)a[1] * d.x + (double)a[4] * d.y + (double)a[7] * d.z;
        y.z += (double)a[2] * d.x + (double)a[5] * d.y + (double)a[8] * d.z;
    }
    if (A->ties) om_ties_apply_row(A->ties, dv, i, &y);
    return y;
}

// x_end and the displacement d (in w->v_end).
static void move(const OmTissueState* s, OmTissueWork* w, const double* dv) {
    const double *x = om__state_array(s, OM__X), *v = om__state_array(s, OM__V);
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) {
        double d = w->h * (v[n] + dv[n]);
        w->v_end[n] = d;
        w->x_end[n] = x[n] + d;
    }
}

bool om__is_crushing(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                     const double* dv) {
    OmTissueCheck check;
    if (!m->engine->check) return false;
    const double *x = om__state_array(s, OM__X), *v = om__state_array(s, OM__V);
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) w->x_end[n] = x[n] + w->h * (v[n] + dv[n]);
    m->engine->check(m, w, x, w->x_end, false, &check);
    return check.ncrushed > 0;
}

// Work of the forces that were added to the step (contact): force at the end of the step times displacement.
static double work_of_added(const OmTissueWork* w) {
    double work = om__ties_work(w, w->v_end);
    for (int n = 0; n < w->nextra; ++n) {
        int i = w->extra[n];
        OmVec3 d = om_load3(w->v_end, i);
        work += om_dot(om_sub(w->extra_f[i], om_mat3_apply(w->extra_K[i], d)), d);
    }
    for (int n = 0; n < w->npoint; ++n) {
        const OmTissuePoint* p = &w->point[n];
        OmVec3 d = {0, 0, 0};
        for (int a = 0; a < 4; ++a) d = om_madd(d, p->weight[a], om_load3(w->v_end, p->vert[a]));
        work += om_dot(om_sub(p->f, om_mat3_apply(p->K, d)), d);
    }
    return work;
}

typedef struct Balance {  // J
    double kinetic;       // at the beginning
    double change;        // of kinetic energy, gravity and springs
    double effort;        // sum of the works' magnitudes
    double work;          // of tools, attachments that move, contact and external forces
} Balance;

static Balance balance_step(const OmTissueModel* m, const OmTissueState* s, const OmTissueWork* w) {
    Balance b = {.work = work_of_added(w)};
    b.effort = fabs(b.work);
    b.change = om__bonds_add(m, w->x_end, NULL, NULL) -
               om__bonds_add(m, om__state_array(s, OM__X), NULL, NULL);
    const double *x = om__state_array(s, OM__X), *v = om__state_array(s, OM__V);
    const double *anchor = om__state_array(s, OM__ANCHOR), *f = om__state_array(s, OM__F_EXT);
    for (int i = 0; i < w->nvert; ++i) {
        OmVec3 d = om_load3(w->v_end, i), dv = om_load3(w->dv, i), v0 = om_load3(v, i);
        b.kinetic += 0.5 * m->mass[i] * om_norm2(v0);
        b.change += m->mass[i] * (om_dot(v0, dv) + 0.5 * om_norm2(dv) - om_dot(m->def.gravity, d));
        double work = om_dot(om_load3(f, i), d), k = om__state_stiffness(s)[i];
        if (k > 0)
            b.change += k * om_dot(om_madd(om_sub(om_load3(x, i), om_load3(anchor, i)), 0.5, d), d);
        if (w->key[i] && om_norm2(d) > 0) {
            OmVec3 r = om_sub(om__apply_row(&w->A, w->dv, i), om_load3(w->rhs, i));
            work += om_dot(r, d) / w->h;
        }
        b.work += work;
        b.effort += fabs(work);
    }
    return b;
}

OmGuard om__guard_step(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                       double share, bool is_solved) {
    OmGuard g = {0};
    OmTissueCheck check;
    if (!m->engine->check) return g;
    const double* x = om__state_array(s, OM__X);
    move(s, w, w->dv);
    m->engine->check(m, w, x, w->x_end, is_solved, &check);
    Balance b = balance_step(m, s, w);
    g.ncrushed = check.ncrushed;
    g.nbarrier = check.nbarrier;
    g.ninverted = check.ninverted;
    double begin = check.elastic_begin, end = check.elastic_end;
    double floor = ENERGY_FLOOR * m->total_mu;
    g.gain = end - begin + b.change - b.work;
    g.bound = ENERGY_SLACK * share * (b.kinetic + begin + b.effort) + floor;
    // The check computes in float. If its energy may rise too much, the energy is computed in double.
    bool is_clear = g.gain > g.bound + floor + FLOAT_ERROR * (begin + end);
    if (!(g.gain <= g.bound) && !is_clear && m->engine->eval_balance &&
        m->engine->eval_balance(m, w, x, w->elastic, &begin) == OM_OK &&
        m->engine->eval_balance(m, w, w->x_end, w->elastic, &end) == OM_OK) {
        g.gain = end - begin + b.change - b.work;
        g.bound = ENERGY_SLACK * share * (b.kinetic + begin + b.effort) + floor;
    }
    g.is_bad = g.ncrushed > 0 || !(g.gain <= g.bound);
    return g;
}

static double dot_all(int nvert, const double* a, const double* b) {
    double sum = 0;
    for (size_t n = 0; n < 3 * (size_t)nvert; ++n) sum += a[n] * b[n];
    return sum;
}

// The coefficients that minimise the energy of the linear system along p and q: r.p = r.q = 0 afterwards.
static void minimise(double pp, double pq, double qq, double rp, double rq, double* a, double* b) {
    double det = pp * qq - pq * pq;
    *a = *b = 0;
    if (det > 1e-12 * pp * qq) {  // neither is zero, and they are not parallel
        *a = (qq * rp - pq * rq) / det;
        *b = (pp * rq - pq * rp) / det;
    } else if (qq > 0) {
        *b = rq / qq;
    } else if (pp > 0) {
        *a = rp / pp;
    }
}

bool om__guard_project(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                       const OmGuard* g, double* growth) {
    const double* v = om__state_array(s, OM__V);
    double *p = w->from, *q = w->start, *Ap = w->trial, *Aq = w->x_end, *r = w->v_end, a, b;
    const OmVec3 zero = {0, 0, 0};
    om_bsr_apply(&w->A, m->def.solver.nworker, w->dv, r);
    for (int i = 0; i < w->nvert; ++i) {
        OmVec3 left = om_sub(om_load3(w->rhs, i), om_load3(r, i));
        om_store3(p, i, w->key[i] ? zero : om_load3(v, i));
        om_store3(q, i, w->key[i] ? zero : om_load3(w->dv, i));
        om_store3(r, i, w->key[i] ? zero : left);
    }
    double rp = dot_all(w->nvert, r, p), rq = dot_all(w->nvert, r, q), before = 0, after = 0;
    if (!(g->gain + rp + rq <= g->bound)) return false;  // -(rp + rq) is the work of the residual
    om_bsr_apply(&w->A, m->def.solver.nworker, p, Ap);
    om_bsr_apply(&w->A, m->def.solver.nworker, q, Aq);
    minimise(dot_all(w->nvert, p, Ap), dot_all(w->nvert, p, Aq), dot_all(w->nvert, q, Aq), rp, rq,
             &a, &b);
    for (int i = 0; i < w->nvert; ++i) {
        if (w->key[i]) continue;
        OmVec3 one = om_madd(om_madd(om_load3(r, i), -a, om_load3(Ap, i)), -b, om_load3(Aq, i));
        before += om_norm2(om_load3(r, i));
        after += om_norm2(one);
    }
    *growth = before > 0 ? sqrt(after / before) : 1;
    if (*growth > 1 && m->def.solver.tolerance > 0) return false;
    for (size_t n = 0; n < 3 * (size_t)w->nvert; ++n) w->dv[n] += a * p[n] + b * q[n];
    return true;
}

OmStatus om__guard_refuse(const OmGuard* g) {
    if (g->ncrushed > 0)
        return om_error(OM_INVALID,
                        "tissue: %d elements are flattened or inverted beyond the limit of a step",
                        g->ncrushed);
    return om_error(OM_INVALID, "tissue: the energy rises by %.3g J more than the work done",
                    g->gain);
}
