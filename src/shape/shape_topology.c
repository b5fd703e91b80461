// shape_topology.c: parts, handles and cavities of the solid inside a closed surface.
//
// Triangles are joined over edges. Where a surface touches itself, an edge has four triangles or more: each is joined
// to the next one through the inside of the solid, so that the parts that touch stay apart. A vertex counts once for
// each fan of joined triangles around it. Each component of the surface then has the genus 1 - (V - E + F) / 2; the
// sum of the genera is the number of handles. A component around a negative volume bounds a cavity.
#include <stdlib.h>
#include <string.h>

#include "base/base_union.h"
#include "omentum/shape_fit.h"
#include "shape/shape_internal.h"

typedef struct Half {  // a side of a triangle
    int lo, hi;        // its ends
    int tri, corner;   // the side starts at this corner
    bool is_forward;   // from lo to hi
} Half;

static int compare_half(const void* a, const void* b) {
    const Half *x = a, *y = b;
    if (x->lo != y->lo) return x->lo < y->lo ? -1 : 1;
    if (x->hi != y->hi) return x->hi < y->hi ? -1 : 1;
    if (x->tri != y->tri) return x->tri < y->tri ? -1 : 1;
    return x->corner < y->corner ? -1 : 1;
}

static void join(int* parent, int a, int b) {
    a = om__find_root(parent, a), b = om__find_root(parent, b);
    if (a < b) parent[b] = a;
    if (b < a) parent[a] = b;
}

// Join two triangles over their common side: the triangles, and the fans at its two ends.
static void join_sides(int* fan, int* part, const Half* a, const Half* b) {
    const int a0 = 3 * a->tri + a->corner, a1 = 3 * a->tri + (a->corner + 1) % 3;
    const int b0 = 3 * b->tri + b->corner, b1 = 3 * b->tri + (b->corner + 1) % 3;
    join(fan, a0, b1);  // the sides run in opposite directions
    join(fan, a1, b0);
    join(part, a->tri, b->tri);
}

// The direction of a triangle, away from its side, in the plane across the side: an angle.
static double angle_of(const OmSurface* s, const Half* h, OmVec3 u, OmVec3 w) {
    const int* v = s->tri_vert + 3 * (size_t)h->tri;
    const OmVec3 d = om_sub(om_load3(s->x, v[(h->corner + 2) % 3]), om_load3(s->x, h->lo));
    return atan2(om_dot(d, w), om_dot(d, u));
}

// Pair the n triangles at one edge. Seen along the edge, the solid is on the clockwise side of a forward triangle: its
// partner is the next one clockwise that is not forward.
static void pair_around(const OmSurface* s, Half* h, int n, int* fan, int* part) {
    const OmVec3 along = om_normalize(om_sub(om_load3(s->x, h[0].hi), om_load3(s->x, h[0].lo)));
    const OmVec3 u = om_orthogonal(along), w = om_cross(along, u);
    for (int i = 0; i < n; i++) {
        if (!h[i].is_forward) continue;
        const double from = angle_of(s, &h[i], u, w);
        double best = HUGE_VAL;
        int partner = -1;
        for (int j = 0; j < n; j++) {
            if (h[j].is_forward) continue;
            double turn = from - angle_of(s, &h[j], u, w);
            if (turn <= 0) turn += 2 * OM_PI;
            if (turn < best) best = turn, partner = j;
        }
        join_sides(fan, part, &h[i], &h[partner]);
    }
}

static OmStatus pair_sides(const OmSurface* s, int* fan, int* part, bool* is_manifold) {
    OmStatus status = OM_OK;
    const size_t n = 3 * (size_t)s->ntri;
    Half* half = NULL;
    OM_ALLOC_DONE(half, n);
    for (size_t i = 0; i < n; i++) {
        const int t = (int)(i / 3), c = (int)(i % 3);
        const int a = s->tri_vert[i], b = s->tri_vert[3 * (size_t)t + (size_t)((c + 1) % 3)];
        half[i] = (Half){a < b ? a : b, a < b ? b : a, t, c, a < b};
    }
    qsort(half, n, sizeof *half, compare_half);
    for (size_t begin = 0, end; begin < n; begin = end) {
        int nforward = 0;
        for (end = begin;
             end < n && half[end].lo == half[begin].lo && half[end].hi == half[begin].hi; end++)
            nforward += half[end].is_forward;
        const int count = (int)(end - begin);
        OM_CHECK_DONE(
            2 * nforward == count, OM_INVALID,
            "the surface is not closed: the edge from vertex %d to %d has %d triangles, %d "
            "of them in one direction",
            half[begin].lo, half[begin].hi, count, nforward);
        if (count == 2) {
            join_sides(fan, part, &half[begin], &half[begin + 1]);
        } else {
            pair_around(s, half + begin, count, fan, part);
            *is_manifold = false;
        }
    }
done:
    om_free(half);
    return status;
}

OmStatus om_surface_topology(const OmSurface* s, OmTopology* topology) {
    OmStatus status = OM_OK;
    int *fan = NULL, *part = NULL, *chi = NULL, *last = NULL;
    double* six = NULL;
    memset(topology, 0, sizeof *topology);
    topology->is_manifold = true;
    OM_ALLOC_DONE(fan, 3 * (size_t)s->ntri);
    OM_ALLOC_DONE(part, s->ntri);
    OM_CALLOC_DONE(chi, s->ntri);
    OM_CALLOC_DONE(six, s->ntri);
    OM_ALLOC_DONE(last, s->nvert);
    for (int i = 0; i < 3 * s->ntri; i++) fan[i] = i;
    for (int t = 0; t < s->ntri; t++) part[t] = t;
    OM_TRY_DONE(pair_sides(s, fan, part, &topology->is_manifold));
    // 2 (V - E + F) of each component, at its first triangle: E is three halves of F
    for (int i = 0; i < 3 * s->ntri; i++)
        if (om__find_root(fan, i) == i) chi[om__find_root(part, i / 3)] += 2;
    for (int t = 0; t < s->ntri; t++) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        const int p = om__find_root(part, t);
        chi[p] -= 1;
        six[p] +=
            om_dot(om_load3(s->x, v[0]), om_cross(om_load3(s->x, v[1]), om_load3(s->x, v[2])));
    }
    // a vertex at which fans meet touches itself
    for (int v = 0; v < s->nvert; v++) last[v] = -1;
    for (int i = 0; i < 3 * s->ntri; i++) {
        const int v = s->tri_vert[i], root = om__find_root(fan, i);
        if (last[v] >= 0 && last[v] != root) topology->is_manifold = false;
        last[v] = root;
    }
    for (int t = 0; t < s->ntri; t++) {
        if (om__find_root(part, t) != t) continue;
        topology->nhandle += 1 - chi[t] / 4;
        topology->npart += six[t] > 0;
        topology->ncavity += six[t] <= 0;
    }
done:
    om_free(fan);
    om_free(part);
    om_free(chi);
    om_free(six);
    om_free(last);
    return status;
}

bool om_topology_is_equal(const OmTopology* a, const OmTopology* b) {
    return a->npart == b->npart && a->nhandle == b->nhandle && a->ncavity == b->ncavity;
}
