// contact_surface.c: a contact surface with a given number of triangles.
//
// Coarser than the boundary: edges are collapsed, cheapest first. The cost is the square of the length plus the squared
// distance of the new position from the planes of the old triangles (Garland and Heckbert 1997), so triangles have
// similar sizes and ridges remain. A collapse that would fold a triangle or change the topology is refused. Finer:
// edges are halved, longest first. Each vertex has a list of triangle corners. Edges are in a heap; the stamps of its
// ends show that an entry is out of date.
#include <string.h>

#include "contact/contact_press_internal.h"

#define OFF_PLANE 100.0  // weight of a squared distance from planes, relative to a squared length
#define MIN_TURN 0.2     // smallest cosine between a triangle's normals before and after

typedef struct Edge {
    double cost;
    int a, b;
    unsigned stamp;  // sum of the stamps of its ends
} Edge;

typedef struct Quadric {  // sum of area (n . x - d)^2
    double xx, xy, xz, yy, yz, zz, x, y, z, one, area;
} Quadric;

typedef struct Shell {
    int nvert, ntri, nalive;  // vertices and triangles made, triangles alive
    double* x;
    int* tri;         // -1 first where dead
    int* first;       // corner 3 t + k of each vertex, -1 none
    int* next;        // of each corner
    unsigned* stamp;  // of each vertex
    Quadric* quadric;
    Edge* heap;
    int nheap, max_heap;
} Shell;

// ---- heap -----------------------------------------------------------------------------------------

static bool is_before(const Edge* p, const Edge* q) {
    if (p->cost != q->cost) return p->cost < q->cost;
    return p->a != q->a ? p->a < q->a : p->b < q->b;
}

static OmStatus push_edge(Shell* s, double cost, int a, int b) {
    if (s->nheap == s->max_heap) {
        int grown = 2 * s->max_heap + 64;
        Edge* heap = om_realloc(s->heap, (size_t)s->max_heap, (size_t)grown, sizeof *heap);
        if (!heap) return OM_NO_MEMORY;
        s->heap = heap;
        s->max_heap = grown;
    }
    Edge e = {cost, a, b, s->stamp[a] + s->stamp[b]};
    int k = s->nheap++;
    for (; k > 0 && is_before(&e, &s->heap[(k - 1) / 2]); k = (k - 1) / 2)
        s->heap[k] = s->heap[(k - 1) / 2];
    s->heap[k] = e;
    return OM_OK;
}

static Edge pop_edge(Shell* s) {
    Edge top = s->heap[0], e = s->heap[--s->nheap];
    int k = 0;
    for (;;) {
        int c = 2 * k + 1;
        if (c >= s->nheap) break;
        if (c + 1 < s->nheap && is_before(&s->heap[c + 1], &s->heap[c])) ++c;
        if (!is_before(&s->heap[c], &e)) break;
        s->heap[k] = s->heap[c];
        k = c;
    }
    s->heap[k] = e;
    return top;
}

// ---- quadrics -------------------------------------------------------------------------------------

static void add_plane(Quadric* q, OmVec3 n, double d, double w) {
    q->xx += w * n.x * n.x, q->xy += w * n.x * n.y, q->xz += w * n.x * n.z;
    q->yy += w * n.y * n.y, q->yz += w * n.y * n.z, q->zz += w * n.z * n.z;
    q->x -= w * d * n.x, q->y -= w * d * n.y, q->z -= w * d * n.z;
    q->one += w * d * d;
    q->area += w;
}

static Quadric add_quadrics(const Quadric* p, const Quadric* q) {
    return (Quadric){p->xx + q->xx, p->xy + q->xy,   p->xz + q->xz,    p->yy + q->yy,
                     p->yz + q->yz, p->zz + q->zz,   p->x + q->x,      p->y + q->y,
                     p->z + q->z,   p->one + q->one, p->area + q->area};
}

// Mean of the squared distances to the planes.
static double eval_quadric(const Quadric* q, OmVec3 p) {
    double e = q->xx * p.x * p.x + q->yy * p.y * p.y + q->zz * p.z * p.z +
               2 * (q->xy * p.x * p.y + q->xz * p.x * p.z + q->yz * p.y * p.z) +
               2 * (q->x * p.x + q->y * p.y + q->z * p.z) + q->one;
    return q->area > 0 ? fmax(0, e / q->area) : 0;
}

// ---- shell ----------------------------------------------------------------------------------------

static void shell_done(Shell* s) {
    om_free(s->x);
    om_free(s->tri);
    om_free(s->first);
    om_free(s->next);
    om_free(s->stamp);
    om_free(s->quadric);
    om_free(s->heap);
}

static OmVec3 normal_of(const Shell* s, int t) {
    const int* v = s->tri + 3 * (size_t)t;
    OmVec3 a = om_load3(s->x, v[0]);
    return om_cross(om_sub(om_load3(s->x, v[1]), a), om_sub(om_load3(s->x, v[2]), a));
}

static void link_corner(Shell* s, int corner) {
    int v = s->tri[corner];
    s->next[corner] = s->first[v];
    s->first[v] = corner;
}

static OmStatus shell_init(Shell* s, const OmSurface* surface, int ntri) {
    int more = ntri > surface->ntri ? ntri - surface->ntri : 0;
    size_t max_vert = (size_t)surface->nvert + (size_t)more + 2;
    size_t max_tri = (size_t)surface->ntri + (size_t)more + 2;
    OmStatus status = OM_OK;
    OM_CALLOC_DONE(s->x, 3 * max_vert);
    OM_CALLOC_DONE(s->tri, 3 * max_tri);
    OM_CALLOC_DONE(s->next, 3 * max_tri);
    OM_CALLOC_DONE(s->first, max_vert);
    OM_CALLOC_DONE(s->stamp, max_vert);
    OM_CALLOC_DONE(s->quadric, max_vert);
    s->nvert = surface->nvert;
    s->ntri = s->nalive = surface->ntri;
    memcpy(s->x, surface->x, 3 * (size_t)s->nvert * sizeof(double));
    memcpy(s->tri, surface->tri_vert, 3 * (size_t)s->ntri * sizeof(int));
    for (size_t v = 0; v < max_vert; ++v) s->first[v] = -1;
    for (int c = 0; c < 3 * s->ntri; ++c) link_corner(s, c);
    for (int t = 0; t < s->ntri; ++t) {
        OmVec3 n = normal_of(s, t);
        double area = om_norm(n);
        n = om_normalize(n);
        for (int k = 0; k < 3; ++k) {
            int v = s->tri[3 * t + k];
            add_plane(&s->quadric[v], n, om_dot(n, om_load3(s->x, v)), area);
        }
    }
done:
    return status;
}

// Number of live triangles that have both a and b; `tri` gets the first two.
static int shared_triangles(const Shell* s, int a, int b, int tri[2]) {
    int num = 0;
    for (int c = s->first[a]; c >= 0; c = s->next[c]) {
        const int* v = s->tri + 3 * (size_t)(c / 3);
        if (v[0] < 0 || (v[0] != b && v[1] != b && v[2] != b)) continue;
        if (num < 2) tri[num] = c / 3;
        ++num;
    }
    return num;
}

// ---- collapse -------------------------------------------------------------------------------------

// Position of the vertex that replaces an edge, and the cost of this collapse.
static double meet_at(const Shell* s, int a, int b, OmVec3* place) {
    Quadric q = add_quadrics(&s->quadric[a], &s->quadric[b]);
    OmVec3 pa = om_load3(s->x, a), pb = om_load3(s->x, b);
    OmVec3 option[3] = {om_lerp(pa, pb, 0.5), pa, pb};
    double len2 = om_norm2(om_sub(pa, pb)), best = INFINITY;
    for (int k = 0; k < 3; ++k) {
        double e = eval_quadric(&q, option[k]);
        if (e >= best - 1e-9 * len2) continue;  // the middle unless an end is better
        best = e;
        *place = option[k];
    }
    return len2 + OFF_PLANE * best;
}

static OmStatus push_around(Shell* s, int a, int sign) {
    for (int c = s->first[a]; c >= 0; c = s->next[c]) {
        const int* v = s->tri + 3 * (size_t)(c / 3);
        if (v[0] < 0) continue;
        for (int k = 0; k < 3; ++k) {
            OmVec3 place;
            int lo = v[k] < a ? v[k] : a, hi = v[k] < a ? a : v[k];
            if (v[k] == a) continue;
            double cost = sign > 0 ? meet_at(s, lo, hi, &place)
                                   : -om_norm2(om_sub(om_load3(s->x, lo), om_load3(s->x, hi)));
            OM_TRY(push_edge(s, cost, lo, hi));
        }
    }
    return OM_OK;
}

// True if moving vertex a to p folds one of its triangles without b.
static bool is_folding(const Shell* s, int a, int b, OmVec3 p) {
    for (int c = s->first[a]; c >= 0; c = s->next[c]) {
        const int* v = s->tri + 3 * (size_t)(c / 3);
        if (v[0] < 0 || v[0] == b || v[1] == b || v[2] == b) continue;
        OmVec3 old = normal_of(s, c / 3), x[3];
        for (int k = 0; k < 3; ++k) x[k] = v[k] == a ? p : om_load3(s->x, v[k]);
        OmVec3 now = om_cross(om_sub(x[1], x[0]), om_sub(x[2], x[0]));
        if (om_dot(old, now) <= MIN_TURN * om_norm(old) * om_norm(now)) return true;
    }
    return false;
}

// Vertices joined to both a and b: two where the surface is a disc around the edge.
static int count_common(const Shell* s, int a, int b) {
    int num = 0;
    for (int c = s->first[a]; c >= 0; c = s->next[c]) {
        const int* v = s->tri + 3 * (size_t)(c / 3);
        if (v[0] < 0) continue;
        int follow = v[(c % 3 + 1) % 3];  // each neighbour of a follows it once
        int unused[2];
        if (follow != b && shared_triangles(s, follow, b, unused) > 0) ++num;
    }
    return num;
}

static OmStatus collapse(Shell* s, int a, int b) {
    OmVec3 p;
    int gone[2];
    if (s->nalive <= 4 || shared_triangles(s, a, b, gone) != 2 || count_common(s, a, b) != 2)
        return OM_OK;
    meet_at(s, a, b, &p);
    if (is_folding(s, a, b, p) || is_folding(s, b, a, p)) return OM_OK;
    for (int k = 0; k < 2; ++k) s->tri[3 * (size_t)gone[k]] = -1;
    s->nalive -= 2;
    for (int c = s->first[b], next; c >= 0; c = next) {
        next = s->next[c];
        if (s->tri[3 * (size_t)(c / 3)] < 0) continue;
        s->tri[c] = a;
        link_corner(s, c);
    }
    s->first[b] = -1;
    om_store3(s->x, a, p);
    s->quadric[a] = add_quadrics(&s->quadric[a], &s->quadric[b]);
    ++s->stamp[a];
    s->stamp[b] += 1u << 30;  // no edge of b is valid any more
    return push_around(s, a, 1);
}

// ---- split ----------------------------------------------------------------------------------------

static OmStatus split(Shell* s, int a, int b) {
    int old[2];
    if (shared_triangles(s, a, b, old) != 2) return OM_OK;
    int m = s->nvert++;
    om_store3(s->x, m, om_lerp(om_load3(s->x, a), om_load3(s->x, b), 0.5));
    for (int n = 0; n < 2; ++n) {
        int from = 3 * old[n], to = 3 * s->ntri++;
        for (int k = 0; k < 3; ++k) s->tri[to + k] = s->tri[from + k];
        s->tri[from] = -1;
        // The old triangle is marked dead and its two halves get new entries, so no list entry is removed.
        int other = 3 * s->ntri++;
        for (int k = 0; k < 3; ++k) {
            int v = s->tri[to + k];
            s->tri[other + k] = v == a ? m : v;
            s->tri[to + k] = v == b ? m : v;
        }
        for (int k = 0; k < 3; ++k) {
            link_corner(s, to + k);
            link_corner(s, other + k);
        }
    }
    s->nalive += 2;
    return push_around(s, m, -1);
}

// ---- the whole ------------------------------------------------------------------------------------

static OmStatus write_surface(const Shell* s, OmSurface* out) {
    int* index = om_alloc((size_t)s->nvert, sizeof *index);
    if (!index) return OM_NO_MEMORY;
    int nvert = 0, ntri = 0;
    for (int v = 0; v < s->nvert; ++v) index[v] = -1;
    for (int t = 0; t < s->ntri; ++t)
        for (int k = 0; k < 3 && s->tri[3 * (size_t)t] >= 0; ++k) index[s->tri[3 * t + k]] = 0;
    for (int v = 0; v < s->nvert; ++v)
        if (index[v] == 0) index[v] = nvert++;
    OmStatus status = om_surface_init(out, nvert, s->nalive);
    if (status >= 0) {
        for (int v = 0; v < s->nvert; ++v)
            if (index[v] >= 0) om_store3(out->x, index[v], om_load3(s->x, v));
        for (int t = 0; t < s->ntri; ++t) {
            if (s->tri[3 * (size_t)t] < 0) continue;
            for (int k = 0; k < 3; ++k) out->tri_vert[3 * ntri + k] = index[s->tri[3 * t + k]];
            ++ntri;
        }
    }
    om_free(index);
    return status;
}

static OmStatus push_all(Shell* s, int sign) {
    for (int c = 0; c < 3 * s->ntri; ++c) {
        int a = s->tri[c], b = s->tri[c % 3 == 2 ? c - 2 : c + 1];
        OmVec3 place;
        if (a >= b) continue;  // once from each of its two sides
        double cost = sign > 0 ? meet_at(s, a, b, &place)
                               : -om_norm2(om_sub(om_load3(s->x, a), om_load3(s->x, b)));
        OM_TRY(push_edge(s, cost, a, b));
    }
    return OM_OK;
}

OmStatus om_contact_surface_make(const OmTetMesh* mesh, int ntri, OmSurface* surface) {
    *surface = (OmSurface){0};
    OM_CHECK(mesh && ntri >= 4 && ntri <= 10000000, OM_INVALID,
             "contact surface: %d triangles; from 4 to 10 million", ntri);
    OmStatus status = OM_OK;
    OmSurface boundary = {0};
    Shell s = {0};
    OM_TRY_DONE(om_tet_mesh_boundary(mesh, &boundary, NULL));
    OM_TRY_DONE(shell_init(&s, &boundary, 3 * ntri + 8));
    int sign = boundary.ntri > ntri ? 1 : -1;
    OM_TRY_DONE(push_all(&s, sign));
    for (int64_t i = 0; s.nheap > 0 && (sign > 0 ? s.nalive > ntri : s.nalive < ntri); ++i) {
        Edge e = pop_edge(&s);
        if (i % 64 == 0) OM_TRY_DONE(om_stop_poll());
        if (e.stamp != s.stamp[e.a] + s.stamp[e.b]) continue;
        OM_TRY_DONE(sign > 0 ? collapse(&s, e.a, e.b) : split(&s, e.a, e.b));
    }
    OM_TRY_DONE(write_surface(&s, surface));
done:
    om_surface_done(&boundary);
    shell_done(&s);
    if (status < 0) om_surface_done(surface);
    return status;
}
