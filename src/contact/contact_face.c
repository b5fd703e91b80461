// contact_face.c: contact of faces: on every edge and triangle of the boundary, the point that lies deepest in the
// probe.
//
// Contact of vertices alone does not see an edge of the probe between them: vertices snap past the edge one by one, and
// each snap takes work that nothing gives back. A convex probe is outside of a triangle if and only if the smallest
// signed distance over the triangle is above zero, and that distance is a continuous function of the corners, whose
// gradient is the probe's normal times the barycentric weights of the deepest point. So these points get contact forces
// as vertices do, and slide along their edge or triangle as the probe does.
//
// An edge that lies flat on the probe touches it at both ends of a segment: the deepest place jumps between them from
// solve to solve. So an edge has two points; the nearer one takes the deepest place, the other stays.
//
// Points are numbered: vertices of the surface, then two for each edge, then one for each triangle. The corners of
// point i are tet_vert[4 i ...] of the embedding, its weights bary[4 i ...].
#include <stdlib.h>
#include <string.h>

#include "contact/contact_press_internal.h"

#define HALVINGS 14      // of an edge
#define SAME_ANGLE 5e-3  // rad: a normal that turned by less is the same
#define RIM 1e-3   // of a side: a point of a triangle that is nearer to its rim is one of the rim
#define NEAR 1.2   // of half an edge or triangle: one whose middle is farther cannot touch
#define APART 0.1  // of an edge: two points of it that are nearer are one

static OmVec3 to_probe(const OmPress* p, OmVec3 x) {
    return om_mat3_apply_transposed(p->turn_to, om_sub(x, p->to.p));
}

// Slope of the distance at q along `way`.
static double slope_at(const OmPress* p, OmVec3 q, OmVec3 way, OmVec3* n) {
    const OmTissueObstacle* o = &p->def.obstacle;
    (void)o->distance(o->ctx, q, n);
    return om_dot(*n, way);
}

// Fraction of a -> b at which the distance is smallest, and the normal there.
static double deepest_on_segment(const OmPress* p, OmVec3 a, OmVec3 b, OmVec3* n) {
    OmVec3 way = om_sub(b, a);
    if (slope_at(p, a, way, n) >= 0) return 0;
    if (slope_at(p, b, way, n) <= 0) return 1;
    double lo = 0, hi = 1;
    for (int k = 0; k < HALVINGS; ++k) {
        double t = 0.5 * (lo + hi);
        *(slope_at(p, om_madd(a, t, way), way, n) < 0 ? &lo : &hi) = t;
    }
    return 0.5 * (lo + hi);
}

// Of the segment from the fraction u of a triangle's first side to its third corner: the fraction v at which the
// distance is smallest, and its slope along that side there.
static double slope_of_segment(const OmPress* p, const OmVec3 q[3], double u, double* v) {
    OmVec3 side = om_sub(q[1], q[0]), foot = om_madd(q[0], u, side), n;
    *v = deepest_on_segment(p, foot, q[2], &n);
    return slope_at(p, om_lerp(foot, q[2], *v), side, &n);
}

// Weights of the deepest point of a triangle: on the segment whose slope along the first side is zero. False where it
// is on the rim.
static bool deepest_in_triangle(const OmPress* p, const OmVec3 q[3], double weight[4]) {
    double lo = RIM, hi = 1 - RIM, u = 0, v = 0;
    if (slope_of_segment(p, q, lo, &v) >= 0 || slope_of_segment(p, q, hi, &v) <= 0) return false;
    for (int k = 0; k < HALVINGS; ++k) {
        u = 0.5 * (lo + hi);
        *(slope_of_segment(p, q, u, &v) < 0 ? &lo : &hi) = u;
        if (v >= 1 - RIM) return false;
    }
    weight[0] = (1 - v) * (1 - u), weight[1] = (1 - v) * u, weight[2] = v, weight[3] = 0;
    return v > RIM;
}

// Ends of the part of a -> b whose distance is within `more` of that at t.
static void find_ends(const OmPress* p, OmVec3 a, OmVec3 b, double t, double more, double end[2]) {
    double least = om__press_distance(p, om_lerp(a, b, t));
    for (int side = 0; side < 2; ++side) {
        double in = t, out = side;
        if (om__press_distance(p, side ? b : a) <= least + more) in = out;
        for (int k = 0; k < HALVINGS && in != out; ++k) {
            double mid = 0.5 * (in + out);
            *(om__press_distance(p, om_lerp(a, b, mid)) <= least + more ? &in : &out) = mid;
        }
        end[side] = in;
    }
}

static void weigh_segment(double* weight, double t) {
    weight[0] = 1 - t, weight[1] = t, weight[2] = weight[3] = 0;
}

// Positions of the corners of point i at the end of the substep, in the probe's frame; those of the last solution, or
// with is_first those of velocities, limited as those of points.
static void find_corners(const OmPress* p, const OmTissueState* s, const OmTissueWork* w, int i,
                         double h, bool is_first, OmVec3 q[3]) {
    for (int a = 0; a < 3; ++a) {
        int v = p->embedding.tet_vert[4 * (size_t)i + (size_t)a];
        OmVec3 x = om_load3(om_tissue_x(s), v), d = om_scale(h, om_load3(om_tissue_v(s), v));
        if (is_first) {
            OmVec3 local = om_mat3_apply_transposed(p->turn_from, om_sub(x, p->from.p));
            OmVec3 carried = om_add(p->to.p, om_mat3_apply(p->turn_to, local));
            double far = om_norm(d), max = om_distance(carried, x) + 0.5 * p->edge;
            if (far > max) d = om_scale(max / far, d);
        } else {
            d = om_madd(d, h, om_load3(om_tissue_dv(w), v));
        }
        q[a] = to_probe(p, om_add(x, d));
    }
}

OmPressPlace om__press_place(OmPress* p, const OmTissueState* s, const OmTissueWork* w, int i,
                             double h, bool is_first) {
    double* weight = p->embedding.bary + 4 * (size_t)i;
    OmVec3 q[3], n;
    find_corners(p, s, w, i, h, is_first, q);
    int slot = i - p->surface.nvert;
    bool is_edge = slot < 2 * p->nedge;
    OmVec3 middle =
        is_edge ? om_lerp(q[0], q[1], 0.5) : om_scale(1.0 / 3, om_add(q[0], om_add(q[1], q[2])));
    double size = fmax(om_distance(middle, q[0]), om_distance(middle, q[1]));
    size = fmax(size, om_distance(middle, q[2]));
    if (om__press_distance(p, middle) > NEAR * size) return OM_PRESS_FAR;
    if (!is_edge) {
        if (deepest_in_triangle(p, q, weight)) return OM_PRESS_DEEPEST;
        for (int a = 0; a < 4; ++a) weight[a] = a < 3 ? 1.0 / 3 : 0;
        return OM_PRESS_PARKED;
    }
    double t = deepest_on_segment(p, q[0], q[1], &n), end[2];
    find_ends(p, q[0], q[1], t, OM_PRESS_PLANE_GAP * p->size, end);
    bool is_wide = end[1] - end[0] > APART;
    if (is_wide) t = end[slot % 2];
    weigh_segment(weight, t);
    return t > 0 && t < 1 && (is_wide || slot % 2 == 0) ? OM_PRESS_DEEPEST : OM_PRESS_PARKED;
}

// Whether a slot of an edge takes the deepest place t.
static bool takes(const OmPress* p, int i, double t) {
    int slot = i - p->surface.nvert, other = i + (slot % 2 ? -1 : 1);
    int k = p->near_of[i], j = p->near_of[other];
    bool is_on = p->near[k].is_active, is_other_on = j >= 0 && p->near[j].is_active;
    double far = fabs(t - p->embedding.bary[4 * (size_t)i + 1]);
    double other_far = fabs(t - p->embedding.bary[4 * (size_t)other + 1]);
    if (is_on && is_other_on) return far < other_far || (far == other_far && slot % 2 == 0);
    if (is_on) return far < APART;
    if (is_other_on) return other_far >= APART;
    return slot % 2 == 0;
}

OmPressPlace om__press_follow(OmPress* p, OmPressPoint* t, const OmTissueState* s,
                              const OmTissueWork* w, double h) {
    double *weight = p->embedding.bary + 4 * (size_t)t->vert, place[4];
    OmVec3 q[3], n, d = om__press_displacement(p, s, w, t->vert, h);
    find_corners(p, s, w, t->vert, h, false, q);
    if (t->vert - p->surface.nvert < 2 * p->nedge) {
        double at = deepest_on_segment(p, q[0], q[1], &n);
        if (at <= 0 || at >= 1 || !takes(p, t->vert, at)) return OM_PRESS_PARKED;
        weigh_segment(place, at);
    } else if (!deepest_in_triangle(p, q, place)) {
        return OM_PRESS_PARKED;
    }
    double gap = t->gap + om_dot(t->n, d), was[4];
    memcpy(was, weight, sizeof was);
    memcpy(weight, place, sizeof was);
    OmPressPoint now = *t;
    now.x = om__press_position(p, om_tissue_x(s), t->vert);
    d = om__press_displacement(p, s, w, t->vert, h);
    double off = om__press_linearise(p, &now, om_add(now.x, d)) - gap;
    if (t->is_active && fabs(off) < OM_PRESS_PLANE_GAP * p->size &&
        om_distance(now.n, t->n) <= SAME_ANGLE) {
        memcpy(weight, was, sizeof was);
        return OM_PRESS_DEEPEST;
    }
    now.nlinear = 0;
    *t = now;
    return OM_PRESS_MOVED;
}

static int compare_edges(const void* a, const void* b) {
    const int *p = a, *q = b;
    return p[0] != q[0] ? p[0] - q[0] : p[1] - q[1];
}

OmStatus om__press_make_faces(OmPress* p) {
    OmStatus status = OM_OK;
    int *surface_vert = NULL, *edge = NULL, nedge = 0;
    om_surface_done(&p->surface);
    OM_TRY_DONE(om_tet_mesh_boundary(om_tissue_mesh(p->model), &p->surface, &surface_vert));
    const OmSurface* s = &p->surface;
    OM_ALLOC_DONE(edge, 6 * (size_t)s->ntri);
    for (int t = 0; t < s->ntri; ++t)
        for (int k = 0; k < 3; ++k) {
            int a = s->tri_vert[3 * t + k], b = s->tri_vert[3 * t + (k + 1) % 3];
            if (a > b) continue;
            edge[2 * nedge] = a;
            edge[2 * nedge++ + 1] = b;
        }
    qsort(edge, (size_t)nedge, 2 * sizeof *edge, compare_edges);
    p->nedge = nedge;
    p->npoint = s->nvert + 2 * nedge + s->ntri;
    OM_CALLOC_DONE(p->embedding.tet, p->npoint);
    OM_CALLOC_DONE(p->embedding.bary, 4 * (size_t)p->npoint);
    OM_CALLOC_DONE(p->embedding.tet_vert, 4 * (size_t)p->npoint);
    p->embedding.npoint = s->nvert;
    for (int i = 0; i < p->npoint; ++i) {
        int* v = p->embedding.tet_vert + 4 * (size_t)i;
        int slot = i - s->nvert, e = slot / 2, t = slot - 2 * nedge;
        for (int a = 0; a < 4; ++a) {
            int own = slot < 0 ? i : t < 0 ? edge[2 * e + a % 2] : s->tri_vert[3 * t + a % 3];
            v[a] = surface_vert[own];
        }
        p->embedding.bary[4 * (size_t)i] = 1;
    }
done:
    om_free(surface_vert);
    om_free(edge);
    return status;
}
