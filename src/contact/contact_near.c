// contact_near.c: closest points of a vertex and a triangle or of two edges, and whether a path keeps them apart.
//
// Paths are checked by conservative advancement (Li, Kaufman and Jiang 2021, "Codimensional incremental potential
// contact", section 5, ACCD): in the time distance / speed nothing can touch.
#include <math.h>

#include "contact/contact_self.h"
#include "omentum/shape_closest.h"

#define INSIDE 1e-9    // a weight below it: the closest point is on the border
#define PARALLEL 1e-6  // sin^2 of the angle between edges that have no single closest points
#define FLAT \
    0.05  // cosine: a triangle that leans towards the other edge by less is not nearer to it
#define UPRIGHT \
    1e-6  // cosine of the angle between edges around a corner and what is right above it
#define IN_PLANE \
    1e-6  // sine of the angle between an edge and the plane of a triangle that it lies in
#define ADVANCE 0.9      // part of the free way that one piece of a path takes
#define MAX_ADVANCE 200  // pieces; a path that needs more is not free

// Ericson 2005, "Real-time collision detection", 5.1.9; edges of no length are points.
static void closest_of_edges(const OmVec3 p[4], double* s, double* t) {
    OmVec3 u = om_sub(p[1], p[0]), v = om_sub(p[3], p[2]), r = om_sub(p[0], p[2]);
    double a = om_norm2(u), e = om_norm2(v), f = om_dot(v, r), c = om_dot(u, r), b = om_dot(u, v);
    double denom = a * e - b * b;
    *s = denom > 1e-14 * a * e ? fmin(fmax((b * f - c * e) / denom, 0), 1) : 0;
    *t = e > 0 ? (b * *s + f) / e : 0;
    if (*t < 0 || *t > 1) {
        *t = *t < 0 ? 0 : 1;
        *s = a > 0 ? fmin(fmax((b * *t - c) / a, 0), 1) : 0;
    }
}

static void weigh(bool is_edges, const OmVec3 p[4], double weight[4]) {
    if (is_edges) {
        double s, t;
        closest_of_edges(p, &s, &t);
        weight[0] = 1 - s;
        weight[1] = s;
        weight[2] = t - 1;
        weight[3] = -t;
    } else {
        double bary[3];
        om_triangle_closest(p[0], p[1], p[2], p[3], bary);
        weight[0] = 1;
        for (int k = 0; k < 3; ++k) weight[k + 1] = -bary[k];
    }
}

static OmVec3 combine(const double weight[4], const OmVec3 p[4]) {
    OmVec3 r = om_scale(weight[0], p[0]);
    for (int k = 1; k < 4; ++k) r = om_madd(r, weight[k], p[k]);
    return r;
}

static void load(const OmSelfPair* pair, const double* x, OmVec3 p[4]) {
    for (int k = 0; k < 4; ++k) p[k] = om_load3(x, pair->vert[k]);
}

static double distance_of(bool is_edges, const OmVec3 p[4]) {
    double weight[4];
    weigh(is_edges, p, weight);
    return om_norm(combine(weight, p));
}

double om__near_distance(const OmSelfPair* pair, const double* x) {
    OmVec3 p[4];
    load(pair, x, p);
    return distance_of(pair->first >= 0, p);
}

static OmVec3 area_of(const OmSelf* self, int tri, const double* x) {
    const int* v = self->tri_vert + 3 * (size_t)tri;
    OmVec3 a = om_load3(x, v[0]);
    return om_cross(om_sub(om_load3(x, v[1]), a), om_sub(om_load3(x, v[2]), a));
}

// Unit vector in a triangle from one of its edges to the inside.
static OmVec3 inwards(const OmSelf* self, int edge, int tri, const double* x) {
    const int *v = self->edge_vert + 2 * (size_t)edge, *w = self->tri_vert + 3 * (size_t)tri;
    int opposite = w[0] != v[0] && w[0] != v[1] ? w[0] : w[1] != v[0] && w[1] != v[1] ? w[1] : w[2];
    OmVec3 a = om_load3(x, v[0]), along = om_normalize(om_sub(om_load3(x, v[1]), a)),
           in = om_sub(om_load3(x, opposite), a);
    return om_normalize(om_madd(in, -om_dot(in, along), along));
}

// Whether a vertex at r from a corner is nearest to that corner, and not to an edge or a triangle around it. All of
// these triangles find the same pair: the corner's owner takes it.
static bool is_peak(const OmSelf* self, int tri, const double weight[4], OmVec3 r,
                    const double* x) {
    int k = weight[1] < -0.5 ? 0 : weight[2] < -0.5 ? 1 : 2, corner = self->tri_vert[3 * tri + k];
    if (!(self->own[tri] & 1 << k)) return false;
    OmVec3 a = om_load3(x, corner);
    for (int n = self->near_adr[corner]; n < self->near_adr[corner + 1]; ++n) {
        OmVec3 e = om_sub(om_load3(x, self->near_vert[n]), a);
        if (om_dot(r, e) > UPRIGHT * om_norm(r) * om_norm(e)) return false;
    }
    return true;
}

// Whether a vertex at r from a point on the border of a triangle is nearest to that border: not where the triangle
// beyond it is nearer. On a flat surface no border is, or its slant normals would brake what slides.
static bool is_ridge(const OmSelf* self, int tri, const double weight[4], OmVec3 r,
                     const double* x) {
    int corner = -1;
    for (int k = 0; k < 3; ++k) {
        if (weight[k + 1] < -INSIDE) continue;
        if (corner >= 0) return is_peak(self, tri, weight, r, x);
        corner = k;
    }
    int edge = self->tri_edge[3 * (size_t)tri + (size_t)(corner + 1) % 3];
    const int* t = self->edge_tri + 2 * (size_t)edge;
    return om_dot(r, inwards(self, edge, t[0] == tri ? t[1] : t[0], x)) < 0;
}

// The same of an edge and the unit vector from it to another one: no triangle of the edge is nearer. Of edges in two
// flat faces all those with the common normal count.
static bool is_edge_ridge(const OmSelf* self, int edge, OmVec3 n, const double* x) {
    const int* t = self->edge_tri + 2 * (size_t)edge;
    return om_dot(n, inwards(self, edge, t[0], x)) < FLAT &&
           om_dot(n, inwards(self, edge, t[1], x)) < FLAT;
}

void om__near_eval(const OmSelf* self, const OmSelfPair* pair, const double* x, OmNear* near) {
    OmVec3 p[4], out;
    bool is_edges = pair->first >= 0, is_border;
    load(pair, x, p);
    weigh(is_edges, p, near->weight);
    OmVec3 r = combine(near->weight, p);
    double d = om_norm(r);
    near->apart = d;
    near->distance = INFINITY;
    near->is_front = true;
    near->n = d > 0 ? om_scale(1 / d, r) : om_vec3(0, 0, 0);
    OmVec3 u = om_sub(p[1], p[0]), v = om_sub(p[3], p[2]);
    if (is_edges) {
        is_border = fmin(near->weight[0], near->weight[1]) < INSIDE ||
                    fmax(near->weight[2], near->weight[3]) > -INSIDE ||
                    om_norm2(om_cross(u, v)) < PARALLEL * om_norm2(u) * om_norm2(v);
        out = pair->side;
    } else {
        is_border = fmax(near->weight[1], fmax(near->weight[2], near->weight[3])) > -INSIDE;
        out = area_of(self, pair->second, x);
    }
    double side = om_dot(r, out);
    near->is_front = side > 0;
    // another pair has the contact
    if (is_edges && !is_border)
        is_border = !is_edge_ridge(self, pair->first, om_scale(-1, near->n), x) ||
                    !is_edge_ridge(self, pair->second, near->n, x);
    if (is_border && (is_edges || side < 0 || !is_ridge(self, pair->second, near->weight, r, x)))
        return;
    near->distance = side < 0 ? -d : d;
    if (side < 0) near->n = om_scale(-1, near->n);
    if (d < 1e-12 * self->size) near->n = om_normalize(out);
}

typedef struct Path {  // of the vertices of a pair, without their common motion
    bool is_edges;
    OmVec3 p[4], move[4];
    double fastest;  // m, how much nearer the path can bring the two
} Path;

static void load_path(const OmSelfPair* pair, const double* x, const double* end, Path* path) {
    OmVec3 mean = {0, 0, 0};
    double speed[4];
    path->is_edges = pair->first >= 0;
    load(pair, x, path->p);
    load(pair, end, path->move);
    for (int k = 0; k < 4; ++k) {
        path->move[k] = om_sub(path->move[k], path->p[k]);
        mean = om_madd(mean, 0.25, path->move[k]);
    }
    for (int k = 0; k < 4; ++k) {
        path->move[k] = om_sub(path->move[k], mean);
        speed[k] = om_norm(path->move[k]);
    }
    path->fastest = path->is_edges ? fmax(speed[0], speed[1]) + fmax(speed[2], speed[3])
                                   : speed[0] + fmax(speed[1], fmax(speed[2], speed[3]));
}

// Fraction of a path at which the distance falls to `least` (to a tenth more); 1: it does not. d: at its beginning.
static double advance(const Path* path, double d, double least) {
    double done = 0;
    if (d <= 1.1 * least) return 0;
    for (int n = 0; n < MAX_ADVANCE; ++n) {
        OmVec3 q[4];
        done += ADVANCE * (d - least) / path->fastest;
        if (done >= 1) return 1;
        for (int k = 0; k < 4; ++k) q[k] = om_madd(path->p[k], done, path->move[k]);
        d = distance_of(path->is_edges, q);
        if (d <= 1.1 * least) break;
    }
    return done;
}

double om__near_bound(const OmSelfPair* pair, const double* way) {
    double a = way[pair->vert[0]], b = way[pair->vert[1]], c = way[pair->vert[2]],
           d = way[pair->vert[3]], far = c > d ? c : d;
    return pair->apart - (pair->first >= 0 ? (a > b ? a : b) + far : a + (b > far ? b : far));
}

bool om__near_is_free(const OmSelfPair* pair, const double* x, const double* end, double least) {
    Path path;
    load_path(pair, x, end, &path);
    double d = pair->apart;
    least = fmin(least, 0.5 * d);
    return path.fastest < d - least || (d > 0 && advance(&path, d, least) >= 1);
}

double om__near_impact(const OmSelfPair* pair, const double* x, const double* end, double least,
                       OmNear* near) {
    Path path;
    load_path(pair, x, end, &path);
    double d = distance_of(path.is_edges, path.p);
    double part = path.fastest < d - least ? 1 : advance(&path, d, least);
    for (int k = 0; k < 4; ++k) path.p[k] = om_madd(path.p[k], part, path.move[k]);
    weigh(path.is_edges, path.p, near->weight);
    OmVec3 r = combine(near->weight, path.p);
    near->distance = near->apart = om_norm(r);
    near->n = om_normalize(r);
    near->is_front = true;
    return part;
}

bool om__near_crosses(const int edge[2], const int tri[3], const double* x) {
    OmVec3 p = om_load3(x, edge[0]), q = om_load3(x, edge[1]), a = om_load3(x, tri[0]),
           b = om_load3(x, tri[1]), c = om_load3(x, tri[2]);
    OmVec3 d = om_sub(q, p), e = om_sub(b, a), f = om_sub(c, a), h = om_cross(d, f);
    double det = om_dot(e, h);  // Moeller and Trumbore 1997
    // an edge in the plane of the triangle goes along it, not through it
    if (!(fabs(det) > IN_PLANE * om_norm(d) * om_norm(om_cross(e, f)))) return false;
    OmVec3 s = om_sub(p, a), r = om_cross(s, e);
    double u = om_dot(s, h) / det, v = om_dot(d, r) / det, t = om_dot(f, r) / det;
    return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= 1;
}
