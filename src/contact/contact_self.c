// contact_self.c: contact of tissue with itself inside a step.
//
// A pair is a vertex and a triangle, or two edges, of the tissue's surface. Its closest points keep a thickness apart,
// by the forces of contact_pair.c. As with obstacles (contact_vertex.c) the active pairs are found by solving again,
// and closest points that differ at the solution are taken anew. A first guess that lies on the other side takes those
// of the impact.
//
// Candidates are pairs whose boxes meet along the predicted paths. Where a solution leaves the boxes by more than
// a slack, candidates are searched again along the paths of the solution: at the end of a step no pair is missed. Then
// the path of each candidate is followed (contact_near.c). The side of a pair is that of the beginning: there surfaces
// are apart, for no earlier step let them through. Pairs that look through the tissue, as the top and the bottom of a
// thin sheet, are behind each other: they are dead. A pair that would pass, dead or not, is caught: it keeps a small
// gap. What still passes is refused, and cut by om_tissue_step_with; a tool is held back.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/base_grow.h"
#include "contact/contact_internal.h"

#define RELEASE 1e-8     // of the model's size: gap at which an active pair is released
#define ACTIVATE 1e-6    // of the model's size: penetration at which a free pair becomes active
#define SAME_GAP 0.01    // of the thickness: error of closest points that are taken anew
#define SAME_ANGLE 0.02  // rad, the same of the normal
#define FREEZE_GAP 0.1   // of the thickness: the same in the second half of the iterations
#define SLACK 0.5        // of the thickness: difference of a path from its prediction
#define FACING 0.5       // cosine: a vertex whose surface looks further away is not in contact
#define REST_SHARE 0.8   // of the distance at rest, which neighbours in one body may keep
#define LEAST_WAY 0.1    // of the thickness, that paths keep
#define CAUGHT 0.2  // of the thickness, that a pair keeps whose path led through the other side
#define HOLD_BACK (1.0 / 8)  // of a step: in shorter ones a tool that would pass stands still
#define LAST (1.5 / 1024)    // of a step: a shorter substep cannot be cut (tissue_step.c)

static int compare(const int a[3], const int b[3]) {
    for (int k = 0; k < 3; ++k)
        if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
    return 0;
}

static int compare_found(const void* a, const void* b) {
    const OmSelfFound *p = a, *q = b;
    return compare((const int[3]){p->first, p->second, p->vert[0]},
                   (const int[3]){q->first, q->second, q->vert[0]});
}

static int compare_pair(const OmSelfPair* p, const OmSelfFound* q) {
    return compare((const int[3]){p->first, p->second, p->vert[0]},
                   (const int[3]){q->first, q->second, q->vert[0]});
}

static int compare_pairs(const void* a, const void* b) {
    const OmSelfPair* q = b;
    OmSelfFound found = {.first = q->first, .second = q->second, .vert = {q->vert[0]}};
    return compare_pair(a, &found);
}

// ---- candidates ---------------------------------------------------------------------------------------

typedef struct Search {
    const OmSelf* self;
    OmSelfWork* work;
    double reach;
} Search;

// Boxes of the paths of two sets of vertices, each wider by the reach.
static bool paths_meet(const Search* s, const int* a, int na, const int* b, int nb) {
    const double* swept = s->work->swept;
    for (size_t k = 0; k < 3; ++k) {
        double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
        for (int n = 0; n < na + nb; ++n) {
            int side = n >= na;
            const double* box = swept + 6 * (size_t)(side ? b[n - na] : a[n]) + k;
            if (box[0] < lo[side]) lo[side] = box[0];
            if (box[3] > hi[side]) hi[side] = box[3];
        }
        if (lo[0] - hi[1] > 2 * s->reach || lo[1] - hi[0] > 2 * s->reach) return false;
    }
    return true;
}

static OmStatus add_pair(Search* s, const int* a, int na, const int* b, int nb, int first,
                         int second) {
    OmSelfWork* w = s->work;
    for (int i = 0; i < na; ++i)
        for (int k = 0; k < nb; ++k)
            if (a[i] == b[k]) return OM_OK;
    if (!paths_meet(s, a, na, b, nb)) return OM_OK;
    OM_GROW(w->found, w->nfound, w->max_found, 256);
    OmSelfFound* p = &w->found[w->nfound++];
    *p = (OmSelfFound){.first = first, .second = second};
    for (int k = 0; k < 4; ++k) p->vert[k] = k < na ? a[k] : b[k - na];
    return OM_OK;
}

// Where one of two bodies has a skin, contact_skin.c has the contact.
static bool is_skins(const OmSelf* f, int t, int u) {
    int a = f->body[f->tri_vert[3 * (size_t)t]], b = f->body[f->tri_vert[3 * (size_t)u]];
    return (f->skin_of[a] < 0) != (f->skin_of[b] < 0);
}

static OmStatus meet(void* ctx, int t, int u) {
    Search* s = ctx;
    const OmSelf* f = s->self;
    if (is_skins(f, t, u)) return OM_OK;
    const int *a = f->tri_vert + 3 * (size_t)t, *b = f->tri_vert + 3 * (size_t)u;
    for (int k = 0; k < 3; ++k) {
        if (f->own[t] & 1 << k) OM_TRY(add_pair(s, a + k, 1, b, 3, -1, u));
        if (f->own[u] & 1 << k) OM_TRY(add_pair(s, b + k, 1, a, 3, -1, t));
    }
    for (int k = 0; k < 3; ++k) {
        if (!(f->own[t] & 8 << k)) continue;
        int e = f->tri_edge[3 * (size_t)t + (size_t)k];
        for (int l = 0; l < 3; ++l) {
            if (!(f->own[u] & 8 << l)) continue;
            int g = f->tri_edge[3 * (size_t)u + (size_t)l], lo = e < g ? e : g, hi = e < g ? g : e;
            OM_TRY(add_pair(s, f->edge_vert + 2 * (size_t)lo, 2, f->edge_vert + 2 * (size_t)hi, 2,
                            lo, hi));
        }
    }
    return OM_OK;
}

static OmVec3 edge_normal(const OmSelf* f, const OmSelfWork* w, int edge) {
    const int* t = f->edge_tri + 2 * (size_t)edge;
    return om_normalize(om_add(om_load3(w->normal, t[0]), om_load3(w->normal, t[1])));
}

// True if the two sides look at each other at the beginning of the step.
static bool is_facing(const OmSelf* f, const OmSelfWork* w, const OmSelfPair* p,
                      const OmNear* near) {
    if (!near->is_front) return false;
    if (p->first >= 0)
        return om_dot(near->n, edge_normal(f, w, p->first)) < 0 &&
               om_dot(near->n, edge_normal(f, w, p->second)) > 0;
    const double* fan = w->fan + 6 * (size_t)p->vert[0];
    OmVec3 n = om_normalize(om_add(om_load3(fan, 0), om_load3(fan, 1)));
    return om_dot(near->n, n) < FACING;
}

// Fraction of its path that a caught pair can go, and the closest points there.
static double impact_of_caught(const OmSelfWork* w, const OmSelfPair* p, OmNear* hit) {
    return om__near_impact(p, w->x, w->end, 0.5 * fmin(p->thickness, p->apart), hit);
}

// Take the closest points for the next solve: those at the end of the path, or, where it leads through the other side,
// those at the impact.
static void linearise(const OmSelfWork* w, OmSelfPair* p, const OmNear* near) {
    OmNear hit = *near;
    OmVec3 move = {0, 0, 0};
    double part = 1;
    if (p->is_caught)
        part = impact_of_caught(w, p, &hit);
    else if (near->distance < 0)
        part = om__near_impact(p, w->x, w->end, p->thickness, &hit);
    memcpy(p->weight, hit.weight, sizeof p->weight);
    p->n = hit.n;
    for (int k = 0; k < 4; ++k) {
        OmVec3 d = om_sub(om_load3(w->end, p->vert[k]), om_load3(w->x, p->vert[k]));
        move = om_madd(move, p->weight[k], d);
    }
    p->gap = hit.distance - p->thickness - part * om_dot(p->n, move);
}

// Gap that a caught pair keeps.
static double keep_of_caught(const OmSelf* f, const OmSelfPair* p) {
    return fmin(CAUGHT * f->thickness, REST_SHARE * om__near_distance(p, f->rest));
}

// From the next solve on keep the two sides of a pair apart, whatever they look at.
static void catch_pair(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                       const OmTissueWork* work, OmSelfPair* p, double h) {
    p->is_caught = true;
    p->thickness = keep_of_caught(cw->contact->self, p);
    p->goal = fmin(0, p->apart - p->thickness + cw->contact->def.recover_speed * h);
    linearise(cw->self, p, &(OmNear){0});
    p->k = om__pair_stiffness(m, s, work, p);
    p->is_active = p->k > 0;
}

// Lengths of the displacements from x to end, without the common translation, which moves no pair.
static void measure_ways(OmSelfWork* w, int nvert) {
    OmVec3 mean = {0, 0, 0};
    for (int i = 0; i < nvert; ++i)
        mean = om_madd(mean, 1.0 / nvert, om_sub(om_load3(w->end, i), om_load3(w->x, i)));
    om_store3(w->mean, 0, mean);
    for (int i = 0; i < nvert; ++i)
        w->way[i] = om_norm(om_sub(om_sub(om_load3(w->end, i), om_load3(w->x, i)), mean));
}

// Side, thickness and first guess of a candidate.
static void begin_pair(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                       const OmTissueWork* work, OmSelfPair* p, double h) {
    const OmSelf* f = cw->contact->self;
    OmSelfWork* w = cw->self;
    OmNear near, later;
    if (p->first >= 0) p->side = om_sub(edge_normal(f, w, p->second), edge_normal(f, w, p->first));
    om__near_eval(f, p, w->x, &near);
    p->apart = near.apart;
    p->is_dead = !is_facing(f, w, p, &near);
    if (p->is_dead) {
        if (p->apart < keep_of_caught(f, p)) catch_pair(cw, m, s, work, p, h);
        return;
    }
    if (p->first >= 0) p->side = near.n;
    double distance = p->apart;  // also of pairs whose contact another one has now
    p->thickness = f->thickness;
    if (distance < f->thickness && f->body[p->vert[0]] == f->body[p->vert[3]])
        p->thickness = fmin(p->thickness, REST_SHARE * om__near_distance(p, f->rest));
    p->goal = fmin(0, distance - p->thickness + cw->contact->def.recover_speed * h);
    if (om__near_bound(p, w->way) >= p->thickness) return;  // too far, whatever is nearest then
    om__near_eval(f, p, w->end, &later);
    if (!isfinite(later.distance)) return;
    // the penetration that is left is the push of the last step
    bool is_in = distance < p->thickness;
    p->is_active = is_in || later.distance - p->thickness - p->goal < -ACTIVATE * f->size;
    if (!p->is_active) return;
    linearise(w, p, &later);
    p->k = om__pair_stiffness(m, s, work, p);
    if (p->k == 0) p->is_active = false;
    if (!p->is_active || f->friction <= 0 || !is_in) return;
    p->push = p->k * fmax(0, p->thickness - distance);
    OmVec3 d = om_sub(om__pair_relative(p, w->end), om__pair_relative(p, w->x));
    p->slip = om__pair_tangential(p, d);
    om__pair_begin_friction(p, f->friction, h);
}

// Candidates along the paths x to x + predicted; what is known of those of the last search stays.
static OmStatus search(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                       const OmTissueWork* work, double h) {
    const OmSelf* f = cw->contact->self;
    OmSelfWork* w = cw->self;
    OmSelfPair* swap = w->old;
    int max = w->max_old;
    w->old = w->pair;
    w->max_old = w->max_pair;
    w->nold = w->npair;
    w->pair = swap;
    w->max_pair = max;
    w->npair = w->nfound = 0;
    // a common translation lengthens no path
    OmVec3 mean = {0, 0, 0};
    for (int i = 0; i < f->nvert; ++i)
        mean = om_madd(mean, 1.0 / f->nvert, om_load3(w->predicted, i));
    for (int i = 0; i < f->nvert; ++i)
        om_store3(w->end, i, om_sub(om_load3(w->predicted, i), mean));
    om_store3(w->predicted_mean, 0, mean);
    Search search = {f, w, (0.5 + SLACK) * f->thickness};
    om__self_refit(f, w, w->x, w->end, search.reach);
    OM_TRY(om__self_search(f, w, true, meet, &search));
    for (size_t n = 0; n < 3 * (size_t)f->nvert; ++n) w->end[n] = w->x[n] + w->predicted[n];
    measure_ways(w, f->nvert);
    if (w->nold > 0) {  // to be matched; the order of a first search is that of the tree
        qsort(w->old, (size_t)w->nold, sizeof *w->old, compare_pairs);
        qsort(w->found, (size_t)w->nfound, sizeof *w->found, compare_found);
    }
    if (w->nfound > w->max_pair) {
        size_t more = (size_t)w->nfound + (size_t)w->nfound / 2;
        OmSelfPair* pair = om_realloc(w->pair, (size_t)w->max_pair, more, sizeof *pair);
        if (!pair) return OM_NO_MEMORY;
        w->pair = pair;
        w->max_pair = (int)more;
    }
    w->sums.nactive = 0;
    for (int k = 0, old = 0; k < w->nfound; ++k) {
        const OmSelfFound* found = &w->found[k];
        OmSelfPair* p = &w->pair[w->npair];
        while (old < w->nold && compare_pair(&w->old[old], found) < 0) ++old;
        if (old < w->nold && compare_pair(&w->old[old], found) == 0) {
            *p = w->old[old];
        } else {
            *p = (OmSelfPair){.first = found->first, .second = found->second};
            memcpy(p->vert, found->vert, sizeof p->vert);
            begin_pair(cw, m, s, work, p, h);
        }
        w->sums.nactive += p->is_active;
        ++w->npair;
    }
    return OM_OK;
}

OmStatus om__self_find_pairs(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                             const OmTissueWork* work, double h) {
    OmSelfWork* w = cw->self;
    if (!w) return OM_OK;
    const double *x = om_tissue_x(s), *v = om_tissue_v(s);
    for (size_t n = 0; n < 3 * (size_t)cw->contact->nvert; ++n) {
        w->x[n] = x[n];
        w->predicted[n] = h * v[n];
    }
    w->npair = w->nold = w->sums.nsolve = 0;
    return search(cw, m, s, work, h);
}

// ---- stages of a step -----------------------------------------------------------------------------------

// Compare an active pair with the solution; true if it must be solved again.
static bool update_active(const OmSelf* f, OmSelfWork* w, OmSelfPair* p, double h, bool is_damped) {
    double end = om__pair_gap_at_end(p, w->x, w->end);
    OmNear near;
    double part = 1;
    if (p->is_caught)
        part = impact_of_caught(w, p, &near);
    else
        om__near_eval(f, p, w->end, &near);
    // closest points that went over a border by little: a pair that switched with its neighbour would not settle
    if (!isfinite(near.distance) && near.is_front && om_distance(near.n, p->n) <= SAME_ANGLE)
        near.distance = near.apart;
    if (end > RELEASE * f->size || !isfinite(near.distance)) {
        om__pair_release(&w->sums, p);
        return true;
    }
    bool is_changed = om__pair_take_solution(&w->sums, p, f->friction, w->x, w->end, h);
    double gap = near.distance - p->thickness - p->goal;
    double error = fabs(gap - end), angle = om_distance(near.n, p->n);
    bool is_valid = is_damped ? error <= FREEZE_GAP * f->thickness
                              : error <= SAME_GAP * f->thickness && angle <= SAME_ANGLE;
    is_valid &= part >= 1;
    if (!is_valid) linearise(w, p, &near);
    w->sums.nslip -= is_changed && !is_valid;  // counted once
    return !is_valid || is_changed;
}

// True if the path of a pair in the last solution leads through the other side.
static bool is_passing(const OmSelf* f, const OmSelfWork* w, const OmSelfPair* p) {
    double least = LEAST_WAY * f->thickness;
    return om__near_bound(p, w->way) <= least && !om__near_is_free(p, w->x, w->end, least);
}

// Pairs that no force keeps apart, and that would pass; returns how many.
static int catch_passing(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                         const OmTissueWork* work, double h) {
    const OmSelf* f = cw->contact->self;
    OmSelfWork* w = cw->self;
    int num = 0;
    for (int k = 0; k < w->npair; ++k) {
        OmSelfPair* p = &w->pair[k];
        if (p->is_active || p->is_closed || !is_passing(f, w, p)) continue;
        catch_pair(cw, m, s, work, p, h);
        w->sums.nactive += p->is_active;
        num += p->is_active;
    }
    return num;
}

OmStatus om__self_update_pairs(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                               const OmTissueWork* work, double h, bool is_damped, int* nchange) {
    const OmSelf* f = cw->contact->self;
    OmSelfWork* w = cw->self;
    *nchange = 0;
    if (!w) return OM_OK;
    const double *v = om_tissue_v(s), *dv = om_tissue_dv(work);
    double slack = SLACK * f->thickness;
    bool is_lost = false;
    for (size_t n = 0; n < 3 * (size_t)f->nvert; ++n) {
        double d = h * (v[n] + dv[n]);
        w->end[n] = w->x[n] + d;
    }
    measure_ways(w, f->nvert);
    for (size_t n = 0; n < 3 * (size_t)f->nvert; ++n) {
        // the boxes hold the whole predicted path: a vertex that stops short of its end is in it
        double d = w->end[n] - w->x[n] - w->mean[n % 3],
               p = w->predicted[n] - w->predicted_mean[n % 3];
        is_lost = is_lost || !(d >= (p < 0 ? p : 0) - slack && d <= (p > 0 ? p : 0) + slack);
    }
    om__pairs_begin_update(&w->sums, w->npair, w->pair, w->x, w->end);
    for (int k = 0; k < w->npair; ++k) {
        OmSelfPair* p = &w->pair[k];
        p->force = om_vec3(0, 0, 0);
        if (p->is_active) {
            *nchange += update_active(f, w, p, h, is_damped);
            continue;
        }
        if (p->is_dead) continue;
        OmNear near;
        if (om__near_bound(p, w->way) >= p->thickness) continue;
        om__near_eval(f, p, w->end, &near);
        // a pair that must stay free may penetrate as far as the closest points of pushed ones may be wrong: of many
        // redundant pairs a few switch on and off by turns; the next step has them
        double allowed = p->is_closed ? SAME_GAP * f->thickness : ACTIVATE * f->size;
        if (!isfinite(near.distance) || near.distance - p->thickness - p->goal >= -allowed)
            continue;
        linearise(w, p, &near);
        p->k = om__pair_stiffness(m, s, work, p);
        if (p->k == 0) continue;  // all four are held: nothing can move
        ++*nchange;
        if (p->is_closed) continue;
        om__pair_activate(&w->sums, p);
    }
    *nchange = om__pairs_count_changes(&w->sums, *nchange);
    if (!is_lost) {
        if (*nchange == 0) *nchange = catch_passing(cw, m, s, work, h);
        return OM_OK;
    }
    for (size_t n = 0; n < 3 * (size_t)f->nvert; ++n) w->predicted[n] = w->end[n] - w->x[n];
    int nactive = w->sums.nactive, npair = w->npair;
    OM_TRY(search(cw, m, s, work, h));
    // new candidates that penetrate are solved for; pairs that left are far apart
    *nchange += w->sums.nactive != nactive || w->npair > npair;
    w->sums.nswitch +=
        w->sums.nactive > nactive ? w->sums.nactive - nactive : nactive - w->sums.nactive;
    return OM_OK;
}

// The first pair that would pass, or null.
static const OmSelfPair* find_passing(const OmContactWork* cw) {
    const OmSelf* f = cw->contact->self;
    const OmSelfWork* w = cw->self;
    for (int k = 0; k < w->npair; ++k) {
        const OmSelfPair* p = &w->pair[k];
        if (is_passing(f, w, p)) return p;
    }
    return NULL;
}

static bool is_held(const OmTissueState* s, const OmSelfPair* p) {
    bool is_any = false;
    for (int k = 0; k < 4; ++k) is_any |= om_tissue_held_by(s)[p->vert[k]] >= 0;
    return is_any;
}

static void stop(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s, OmTissueWork* work,
                 double h) {
    OmSelfWork* w = cw->self;
    int nvert = cw->contact->nvert;
    cw->report.is_held_back |= om_tissue_nheld(s, 0) > 0 || om_tissue_nheld(s, 1) > 0;
    om_tissue_stop_tools(m, s, work);
    const double *v = om_tissue_v(s), *dv = om_tissue_dv(work);
    for (size_t n = 0; n < 3 * (size_t)nvert; ++n)
        w->end[n] = om_tissue_is_prescribed(m, s, (int)(n / 3)) ? 0 : -v[n] - dv[n];
    om_tissue_add_dv(work, w->end);
    for (size_t n = 0; n < 3 * (size_t)nvert; ++n) w->end[n] = w->x[n] + h * (v[n] + dv[n]);
    measure_ways(w, nvert);
    cw->report.is_settled = false;
}

OmStatus om__self_check_paths(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                              OmTissueWork* work, double h) {
    if (!cw->self) return OM_OK;
    const OmSelfPair* p = find_passing(cw);
    if (p && (h < LAST * cw->h || om_tissue_is_spent(m, work))) {
        stop(cw, m, s, work, h);
        p = find_passing(cw);
    }
    if (!p) return OM_OK;
    // shorter steps may help what is free, not a tool
    if (h < 2 * HOLD_BACK * cw->h && is_held(s, p)) cw->report.is_held_back = true;
    OmVec3 at = om_scale(1e3, om_load3(cw->self->x, p->vert[0]));
    return om_error(OM_INVALID,
                    "contact: the tissue would pass through itself at (%.1f, %.1f, %.1f) mm", at.x,
                    at.y, at.z);
}

// ---- outcome --------------------------------------------------------------------------------------------

OmStatus om__self_report_pairs(OmContactWork* cw, OmTissueState* s) {
    const OmSelf* f = cw->contact->self;
    OmSelfWork* w = cw->self;
    if (!w) return OM_OK;
    for (int k = 0; k < w->npair; ++k) {
        const OmSelfPair* p = &w->pair[k];
        if (!p->is_active || p->push <= 0) continue;
        OmNear near;
        om__near_eval(f, p, w->end, &near);
        if (p->is_caught) near.distance = near.apart;
        OM_TRY(
            om__pair_report(cw, s, p, p->first < 0 ? 1 : 2, w->end, near.distance - p->thickness));
    }
    return OM_OK;
}

typedef struct Crossing {
    const OmSelf* self;
    const double* x;
    int num;
    OmVec3 at;
    bool skips_inside;  // without those of neighbours in one body
} Crossing;

// Are an edge and a triangle neighbours in one body? A body that is turned inside out may go through itself there.
static bool are_neighbours(const OmSelf* f, const int edge[2], const int tri[3]) {
    if (f->body[edge[0]] != f->body[tri[0]]) return false;
    double least = INFINITY;
    for (int k = 0; k < 5; ++k) {
        OmSelfPair p = {.vert = {edge[0], edge[1], tri[k % 3], tri[(k + 1) % 3]}};
        if (k >= 3) p = (OmSelfPair){.vert = {edge[k - 3], tri[0], tri[1], tri[2]}, .first = -1};
        least = fmin(least, om__near_distance(&p, f->rest));
    }
    return least < f->edge;
}

static OmStatus cross(void* ctx, int t, int u) {
    Crossing* c = ctx;
    const OmSelf* f = c->self;
    if (is_skins(f, t, u)) return OM_OK;
    for (int turn = 0; turn < 2; ++turn) {
        int a = turn ? u : t, b = turn ? t : u;
        const int* tri = f->tri_vert + 3 * (size_t)b;
        for (int k = 0; k < 3; ++k) {
            if (!(f->own[a] & 8 << k)) continue;
            const int* edge = f->edge_vert + 2 * (size_t)f->tri_edge[3 * (size_t)a + (size_t)k];
            bool is_neighbour = false;
            for (int n = 0; n < 6; ++n) is_neighbour |= edge[n / 3] == tri[n % 3];
            if (is_neighbour || !om__near_crosses(edge, tri, c->x)) continue;
            if (c->skips_inside && are_neighbours(f, edge, tri)) continue;
            if (c->num++ == 0)
                c->at = om_scale(0.5, om_add(om_load3(c->x, edge[0]), om_load3(c->x, edge[1])));
        }
    }
    return OM_OK;
}

static OmStatus find_crossing(OmContactWork* cw, Crossing* c) {
    om__self_refit(c->self, cw->self, c->x, NULL, 0);
    return om__self_search(c->self, cw->self, false, cross, c);
}

OmStatus om_contact_find_crossing(OmContactWork* cw, const OmTissueState* s, int* num, OmVec3* at) {
    OM_CHECK(cw->self, OM_UNAVAILABLE, "contact: it was made without self_contact");
    Crossing c = {cw->contact->self, om_tissue_x(s), 0, {0, 0, 0}, false};
    OM_TRY(find_crossing(cw, &c));
    *num = c.num;
    if (at) *at = c.at;
    return OM_OK;
}

OmStatus om__self_check_start(OmContactWork* cw, const OmTissueState* s) {
    OmSelfWork* w = cw->self;
    size_t size = 3 * (size_t)cw->contact->nvert * sizeof(double);
    if (!w || (w->has_last && memcmp(w->last, om_tissue_x(s), size) == 0)) return OM_OK;
    Crossing c = {cw->contact->self, om_tissue_x(s), 0, {0, 0, 0}, true};
    OM_TRY(find_crossing(cw, &c));
    OM_CHECK(
        c.num == 0, OM_INVALID,
        "contact: surfaces of the tissue go through each other or touch at the start of the "
        "step, at %d places, the first at (%.1f, %.1f, %.1f) mm; move the bodies apart, or make "
        "the contact without self_contact",
        c.num, 1e3 * c.at.x, 1e3 * c.at.y, 1e3 * c.at.z);
    return OM_OK;
}

void om__self_end_step(OmContactWork* cw, const OmTissueState* s) {
    if (!cw->self) return;
    memcpy(cw->self->last, om_tissue_x(s), 3 * (size_t)cw->contact->nvert * sizeof(double));
    cw->self->has_last = true;
}
