// contact_probe_mesh.c: exact signed distance to a closed triangle mesh.
//
// A tree of boxes gives the nearest triangle, and the normal of the nearest feature gives the side. At a vertex, angles
// weight the normals of its faces (Baerentzen and Aanaes 2005), which is correct for every closed mesh.
#include <stdlib.h>
#include <string.h>

#include "contact/contact_press_internal.h"
#include "omentum/shape_meshing.h"

#define LEAF 4        // triangles of a leaf at most
#define MAX_DEPTH 64  // of the tree: halves of at most 2^31 triangles

typedef struct Node {
    OmVec3 lo, hi;
    int first, num;  // of `order` in a leaf; num = 0: children are first and first + 1
} Node;

struct OmProbeMesh {
    OmSurface surface;
    OmVec3* face;  // unit normals, zero where a triangle has no area          (ntri)
    OmVec3* edge;  // sums of the normals of the faces at edge k -> k + 1      (ntri x 3)
    OmVec3* vert;  // weighted by angle                                        (nvert)
    int* order;    // triangles by leaves                                      (ntri)
    int nnode;
    Node* node;  //                                                            (2 ntri)
};

const OmSurface* om__probe_mesh_surface(const OmProbeMesh* mesh) { return &mesh->surface; }

// ---- normals --------------------------------------------------------------------------------------

typedef struct Edge {
    int lo, hi, slot;
} Edge;

static int compare_edges(const void* a, const void* b) {
    const Edge *p = a, *q = b;
    if (p->lo != q->lo) return p->lo < q->lo ? -1 : 1;
    if (p->hi != q->hi) return p->hi < q->hi ? -1 : 1;
    return (p->slot > q->slot) - (p->slot < q->slot);
}

static double angle_between(OmVec3 a, OmVec3 b) {
    return atan2(om_norm(om_cross(a, b)), om_dot(a, b));
}

static OmStatus find_normals(OmProbeMesh* m) {
    const OmSurface* s = &m->surface;
    Edge* edge = om_alloc(3 * (size_t)s->ntri, sizeof *edge);
    if (!edge) return OM_NO_MEMORY;
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        OmVec3 x[3] = {om_load3(s->x, v[0]), om_load3(s->x, v[1]), om_load3(s->x, v[2])};
        m->face[t] = om_normalize(om_cross(om_sub(x[1], x[0]), om_sub(x[2], x[0])));
        for (int k = 0; k < 3; ++k) {
            int a = v[k], b = v[(k + 1) % 3];
            OmVec3 next = om_sub(x[(k + 1) % 3], x[k]), last = om_sub(x[(k + 2) % 3], x[k]);
            m->vert[a] = om_madd(m->vert[a], angle_between(next, last), m->face[t]);
            edge[3 * (size_t)t + (size_t)k] = (Edge){a < b ? a : b, a < b ? b : a, 3 * t + k};
        }
    }
    qsort(edge, 3 * (size_t)s->ntri, sizeof *edge, compare_edges);
    for (int n = 0; n + 1 < 3 * s->ntri; n += 2) {  // a closed mesh has each edge twice
        int p = edge[n].slot, q = edge[n + 1].slot;
        m->edge[p] = m->edge[q] = om_add(m->face[p / 3], m->face[q / 3]);
    }
    om_free(edge);
    return OM_OK;
}

// ---- tree -----------------------------------------------------------------------------------------

static double middle(const OmSurface* s, int t, int axis) {
    const int* v = s->tri_vert + 3 * (size_t)t;
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += s->x[3 * (size_t)v[k] + (size_t)axis];
    return sum;
}

// Order triangles so that the first half is below the second half along an axis (quickselect).
static void split_half(const OmSurface* s, int* order, int num, int axis) {
    int lo = 0, hi = num - 1, half = num / 2;
    while (lo < hi) {
        double pivot = middle(s, order[(lo + hi) / 2], axis);
        int i = lo, j = hi;
        while (i <= j) {
            while (middle(s, order[i], axis) < pivot) ++i;
            while (middle(s, order[j], axis) > pivot) --j;
            if (i > j) break;
            int swap = order[i];
            order[i++] = order[j];
            order[j--] = swap;
        }
        if (half <= j)
            hi = j;
        else if (half >= i)
            lo = i;
        else
            return;
    }
}

static void build_node(OmProbeMesh* m, int at, int first, int num) {
    const OmSurface* s = &m->surface;
    Node* node = &m->node[at];
    for (int n = 0; n < num; ++n) {
        const int* v = s->tri_vert + 3 * (size_t)m->order[first + n];
        for (int k = 0; k < 3; ++k) {
            OmVec3 x = om_load3(s->x, v[k]);
            node->lo = n + k == 0 ? x : om_min3(node->lo, x);
            node->hi = n + k == 0 ? x : om_max3(node->hi, x);
        }
    }
    node->first = first;
    node->num = num;
    if (num <= LEAF) return;
    OmVec3 d = om_sub(node->hi, node->lo);
    split_half(s, m->order + first, num, d.x >= d.y && d.x >= d.z ? 0 : d.y >= d.z ? 1 : 2);
    int child = m->nnode;
    m->nnode += 2;
    node->first = child;
    node->num = 0;
    build_node(m, child, first, num / 2);
    build_node(m, child + 1, first + num / 2, num - num / 2);
}

OmStatus om__probe_mesh_create(const OmSurface* surface, OmProbeMesh** mesh) {
    *mesh = NULL;
    OmStatus status = OM_OK;
    OM_CHECK(surface->nvert >= 4 && surface->ntri >= 4 && surface->x && surface->tri_vert,
             OM_INVALID, "probe: a closed mesh has at least 4 vertices and 4 triangles");
    OM_CHECK(surface->ntri < 100000000, OM_INVALID, "probe: a mesh of %d triangles is too large",
             surface->ntri);
    for (int n = 0; n < 3 * surface->nvert; ++n)
        OM_CHECK(isfinite(surface->x[n]) && fabs(surface->x[n]) < 1e6, OM_INVALID,
                 "probe: vertex %d of the mesh is not finite", n / 3);
    for (int n = 0; n < 3 * surface->ntri; ++n)
        OM_CHECK(surface->tri_vert[n] >= 0 && surface->tri_vert[n] < surface->nvert, OM_INVALID,
                 "probe: triangle %d has vertex %d, the mesh %d", n / 3, surface->tri_vert[n],
                 surface->nvert);
    OM_TRY(om_surface_check_closed(surface, NULL));
    OM_CHECK(om_surface_volume(surface) > 0, OM_INVALID,
             "probe: the mesh encloses %.3g m^3; its triangles must run counter-clockwise seen "
             "from outside",
             om_surface_volume(surface));
    OmProbeMesh* m = om_calloc(1, sizeof *m);
    if (!m) return OM_NO_MEMORY;
    OM_TRY_DONE(om_surface_init(&m->surface, surface->nvert, surface->ntri));
    memcpy(m->surface.x, surface->x, 3 * (size_t)surface->nvert * sizeof(double));
    memcpy(m->surface.tri_vert, surface->tri_vert, 3 * (size_t)surface->ntri * sizeof(int));
    OM_CALLOC_DONE(m->face, surface->ntri);
    OM_CALLOC_DONE(m->edge, 3 * (size_t)surface->ntri);
    OM_CALLOC_DONE(m->vert, surface->nvert);
    OM_CALLOC_DONE(m->order, surface->ntri);
    OM_CALLOC_DONE(m->node, 2 * (size_t)surface->ntri);
    OM_TRY_DONE(find_normals(m));
    for (int t = 0; t < surface->ntri; ++t) m->order[t] = t;
    m->nnode = 1;
    build_node(m, 0, 0, surface->ntri);
    *mesh = m;
    return OM_OK;
done:
    om__probe_mesh_destroy(m);
    return status;
}

void om__probe_mesh_destroy(OmProbeMesh* m) {
    if (!m) return;
    om_surface_done(&m->surface);
    om_free(m->face);
    om_free(m->edge);
    om_free(m->vert);
    om_free(m->order);
    om_free(m->node);
    om_free(m);
}

// ---- queries --------------------------------------------------------------------------------------

// Nearest point of a triangle (Ericson 2005, 5.1.5); feature: 0-2 a vertex, 3-5 an edge, 6 the face.
static OmVec3 nearest_of_triangle(OmVec3 p, OmVec3 a, OmVec3 b, OmVec3 c, int* feature) {
    OmVec3 ab = om_sub(b, a), ac = om_sub(c, a), ap = om_sub(p, a);
    double d1 = om_dot(ab, ap), d2 = om_dot(ac, ap);
    *feature = 0;
    if (d1 <= 0 && d2 <= 0) return a;
    OmVec3 bp = om_sub(p, b);
    double d3 = om_dot(ab, bp), d4 = om_dot(ac, bp);
    *feature = 1;
    if (d3 >= 0 && d4 <= d3) return b;
    double vc = d1 * d4 - d3 * d2;
    *feature = 3;
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return om_madd(a, d1 / (d1 - d3), ab);
    OmVec3 cp = om_sub(p, c);
    double d5 = om_dot(ab, cp), d6 = om_dot(ac, cp);
    *feature = 2;
    if (d6 >= 0 && d5 <= d6) return c;
    double vb = d5 * d2 - d1 * d6;
    *feature = 5;
    if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return om_madd(a, d2 / (d2 - d6), ac);
    double va = d3 * d6 - d5 * d4;
    *feature = 4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0 && d4 - d3 + d5 - d6 > 0)
        return om_madd(b, (d4 - d3) / (d4 - d3 + d5 - d6), om_sub(c, b));
    *feature = 6;
    double sum = va + vb + vc;
    if (!(sum > 0)) return a;  // no area
    return om_madd(om_madd(a, vb / sum, ab), vc / sum, ac);
}

static double box_distance2(const Node* n, OmVec3 p) {
    OmVec3 d = om_max3(om_max3(om_sub(n->lo, p), om_sub(p, n->hi)), om_vec3(0, 0, 0));
    return om_norm2(d);
}

typedef struct Nearest {
    double d2;
    OmVec3 at;
    int tri, feature;
} Nearest;

static void look_at_leaf(const OmProbeMesh* m, const Node* node, OmVec3 p, Nearest* best) {
    const OmSurface* s = &m->surface;
    for (int n = node->first; n < node->first + node->num; ++n) {
        const int* v = s->tri_vert + 3 * (size_t)m->order[n];
        int feature;
        OmVec3 at = nearest_of_triangle(p, om_load3(s->x, v[0]), om_load3(s->x, v[1]),
                                        om_load3(s->x, v[2]), &feature);
        double d2 = om_norm2(om_sub(p, at));
        if (d2 < best->d2) *best = (Nearest){d2, at, m->order[n], feature};
    }
}

double om__probe_mesh_distance(const OmProbeMesh* m, OmVec3 p, OmVec3* normal) {
    Nearest best = {.d2 = INFINITY};
    int stack[MAX_DEPTH + 1], num = 0;
    stack[num++] = 0;
    while (num > 0) {
        const Node* node = &m->node[stack[--num]];
        if (box_distance2(node, p) >= best.d2) continue;
        if (node->num > 0) {
            look_at_leaf(m, node, p, &best);
            continue;
        }
        int near = node->first, far = near + 1;  // the nearer child comes off the stack first
        if (box_distance2(&m->node[far], p) < box_distance2(&m->node[near], p)) near = far--;
        stack[num++] = far;
        stack[num++] = near;
    }
    const int* v = m->surface.tri_vert + 3 * (size_t)best.tri;
    OmVec3 n = best.feature < 3   ? m->vert[v[best.feature]]
               : best.feature < 6 ? m->edge[3 * (size_t)best.tri + (size_t)best.feature - 3]
                                  : m->face[best.tri];
    OmVec3 out = om_sub(p, best.at);
    double d = sqrt(best.d2), sign = om_dot(out, n) < 0 ? -1 : 1;
    OmVec3 size = om_sub(m->node[0].hi, m->node[0].lo);
    *normal = d > 1e-12 * om_norm(size) ? om_scale(sign / d, out) : om_normalize(n);
    return sign * d;
}
