// shape_stuff.c: isosurface stuffing, Labelle & Shewchuk, ACM Transactions on Graphics 26(3), 2007.
//
// The lattice is body-centred cubic: the corners and the centres of cubes of side a. Long edges (a) join
// corners to corners and centres to centres, short ones (a sqrt 3 / 2) centres to the corners of their
// cube. Each face between two cubes holds four tetrahedra: both centres and one edge of the face.
//
//   1. evaluate the function on the lattice; at fine points, halve the edges of the lattice's
//      tetrahedra (shape_stuff_grade.c); find where the function crosses each edge whose ends differ in sign;
//   2. a lattice point nearer to a crossing than alpha times the edge is moved onto it (and is then on the
//      surface: its other crossings are void);
//   3. cut each tetrahedron: points inside stay, edges from inside to outside end at their crossing.
//
// A cut face with two inside corners is a quadrilateral, and both neighbours must halve it the same way: the
// diagonal starts at the inside corner that is nearer to the outside one, of equally near ones at that of even
// parity, else at that of smaller index. This is an order of the corners, so diagonals never run in a circle; on the
// lattice itself it is Labelle & Shewchuk's parity rule.
#include "shape/shape_stuff.h"

#include <limits.h>
#include <string.h>

#define ALPHA_LONG 0.24999
#define ALPHA_SHORT 0.41189
#define ALPHA_GRADED 0.3  // of the shortest edge, at points of halved edges

// ---- the lattice ----------------------------------------------------------------------------------------

static void point_place(const OmLattice* l, int p, int at[3], int* is_center) {
    *is_center = p >= l->ncorner;
    int nx = l->n[0] + !*is_center, ny = l->n[1] + !*is_center;
    int q = *is_center ? p - l->ncorner : p;
    at[0] = q % nx;
    at[1] = q / nx % ny;
    at[2] = q / nx / ny;
}

static int point_index(const OmLattice* l, const int at[3], int is_center) {
    int nx = l->n[0] + !is_center, ny = l->n[1] + !is_center;
    return (is_center ? l->ncorner : 0) + at[0] + nx * (at[1] + ny * at[2]);
}

OmVec3 om__lattice_position(const OmLattice* l, int p) {
    int at[3], is_center;
    if (p >= l->nlattice) return l->middle[p - l->nlattice];
    point_place(l, p, at, &is_center);
    double shift = is_center ? 0.5 : 0.0;
    return om_madd(l->origin, l->a, om_vec3(at[0] + shift, at[1] + shift, at[2] + shift));
}

// Even: 0. Midpoints, whose edges have other lengths, are all even.
static int parity(const OmLattice* l, int p) {
    int at[3], is_center;
    if (p >= l->nlattice) return 0;
    point_place(l, p, at, &is_center);
    return (at[0] + at[1] + at[2]) & 1;
}

static bool is_lattice_edge(const OmLattice* l, int p, int q) {
    return p < l->nlattice && q < l->nlattice;
}

static bool is_long(const OmLattice* l, int p, int q) {
    return (p >= l->ncorner) == (q >= l->ncorner);
}

double om__lattice_length2(const OmLattice* l, int p, int q) {
    if (is_lattice_edge(l, p, q)) return l->a * l->a * (is_long(l, p, q) ? 1 : 0.75);
    return om_norm2(om_sub(om__lattice_position(l, p), om__lattice_position(l, q)));
}

static bool is_crossed(const OmLattice* l, int p, int q) {
    return (l->f[p] < 0 && l->f[q] > 0) || (l->f[p] > 0 && l->f[q] < 0);
}

double om__lattice_eval(const OmLattice* l, OmVec3 x) {
    double f = l->def->fn(l->def->ctx, x) - l->def->level;
    return isnan(f) ? HUGE_VAL : f;
}

static void eval_points(void* ctx, int begin, int end, int block) {
    (void)block;
    OmLattice* l = ctx;
    for (int p = begin; p < end; p++) l->f[p] = om__lattice_eval(l, om__lattice_position(l, p));
}

static OmStatus lattice_init(const OmStuffDef* def, OmLattice* l) {
    l->def = def;
    l->a = def->edge * OM__LATTICE_LONGEST;
    const double size[3] = {def->hi.x - def->lo.x, def->hi.y - def->lo.y, def->hi.z - def->lo.z};
    double npoint = 1, ncell = 1;
    for (int a = 0; a < 3; a++) {
        double n = ceil(size[a] / l->a) + 3;  // one layer outside on each side
        npoint *= n + 1;
        ncell *= n;
    }
    OM_CHECK(npoint + ncell < 5e8, OM_INVALID,
             "edges of %.3g mm need %.0f lattice points: use a larger edge", def->edge * 1e3,
             npoint + ncell);
    for (int a = 0; a < 3; a++) l->n[a] = (int)ceil(size[a] / l->a) + 3;
    l->ncorner = (int)npoint;
    l->npoint = l->nlattice = (int)(npoint + ncell);
    OmVec3 half = om_scale(0.5 * l->a, om_vec3(l->n[0], l->n[1], l->n[2]));
    l->origin = om_sub(om_lerp(def->lo, def->hi, 0.5), half);
    OM_ALLOC(l->f, l->npoint);
    return om_parallel_for_stop(def->nworker, l->npoint, 4096, eval_points, l);
}

// Points of the outermost layer count as outside: the solid is cut off at the box.
static void cap_border(OmLattice* l) {
    for (int p = 0; p < l->npoint; p++) {
        int at[3], is_center;
        point_place(l, p, at, &is_center);
        for (int a = 0; a < 3; a++) {
            bool is_border = at[a] == 0 || at[a] == l->n[a] - is_center;
            if (is_border && l->f[p] <= 0) l->f[p] = l->a;
        }
    }
}

// ---- its tetrahedra ---------------------------------------------------------------------------------------

OmStatus om__lattice_add_tet(OmLattice* l, const int p[4]) {
    if (l->ntet == l->cap_tet) {
        OM_CHECK(l->cap_tet < INT_MAX / 4, OM_INVALID, "mesh: the lattice is too large");
        int cap = 2 * l->cap_tet + 4096;
        int(*grown)[4] = om_realloc(l->tet, (size_t)l->cap_tet, (size_t)cap, sizeof *l->tet);
        if (!grown) return OM_NO_MEMORY;
        l->tet = grown;
        l->cap_tet = cap;
    }
    memcpy(l->tet[l->ntet++], p, sizeof *l->tet);
    return OM_OK;
}

// The four around the long edge from the centre of cube `at` along `axis`: those with a point inside, or all.
static OmStatus list_face_tets(OmLattice* l, const int at[3], int axis, bool is_all) {
    int b = (axis + 1) % 3, c = (axis + 2) % 3, next[3] = {at[0], at[1], at[2]}, ring[4];
    next[axis]++;
    int center[2] = {point_index(l, at, 1), point_index(l, next, 1)};
    const bool is_in = is_all || l->f[center[0]] < 0 || l->f[center[1]] < 0;
    for (int q = 0; q < 4; q++) {
        int corner[3] = {next[0], next[1], next[2]};
        corner[b] += q == 1 || q == 2;
        corner[c] += q >= 2;
        ring[q] = point_index(l, corner, 0);
    }
    for (int q = 0; q < 4; q++) {
        const int p[4] = {center[0], center[1], ring[q], ring[(q + 1) % 4]};
        if (is_in || l->f[p[2]] < 0 || l->f[p[3]] < 0) OM_TRY(om__lattice_add_tet(l, p));
    }
    return OM_OK;
}

bool om__lattice_find_cube(const OmLattice* l, int fine, int at[3]) {
    const OmVec3 q = om_scale(1 / l->a, om_sub(om_load3(l->def->fine, fine), l->origin));
    const double place[3] = {q.x, q.y, q.z};
    for (int a = 0; a < 3; a++) {
        if (!(place[a] >= 0 && place[a] < l->n[a])) return false;
        at[a] = (int)place[a];
    }
    return true;
}

static void mark_around(const OmLattice* l, const int at[3], unsigned char* mark) {
    enum { REACH = 2 };  // cubes
    int lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        lo[a] = at[a] > REACH ? at[a] - REACH : 0;
        hi[a] = at[a] + REACH < l->n[a] ? at[a] + REACH : l->n[a] - 1;
    }
    for (int k = lo[2]; k <= hi[2]; k++)
        for (int j = lo[1]; j <= hi[1]; j++)
            memset(mark + om_grid_index(l->n, lo[0], j, k), 1, (size_t)(hi[0] - lo[0] + 1));
}

// Mark the cubes near a point inside or a fine point: halving reaches no others.
static void mark_cubes(const OmLattice* l, unsigned char* mark) {
    int at[3], is_center;
    for (int p = 0; p < l->nlattice; p++) {
        if (!(l->f[p] < 0)) continue;
        point_place(l, p, at, &is_center);
        mark_around(l, at, mark);
    }
    for (int i = 0; i < l->def->nfine; i++)
        if (om__lattice_find_cube(l, i, at)) mark_around(l, at, mark);
}

static OmStatus list_tets(OmLattice* l) {
    OmStatus status = OM_OK;
    unsigned char* mark = NULL;
    if (l->def->nfine > 0) {
        OM_CALLOC_DONE(mark, om_grid_count(l->n));
        mark_cubes(l, mark);
    }
    for (int k = 0; k < l->n[2]; k++) {
        for (int j = 0; j < l->n[1]; j++) {
            for (int i = 0; i < l->n[0]; i++) {
                const int at[3] = {i, j, k};
                const bool is_all = mark && mark[om_grid_index(l->n, i, j, k)];
                for (int axis = 0; axis < 3; axis++) {
                    if (at[axis] + 1 < l->n[axis]) OM_TRY_DONE(list_face_tets(l, at, axis, is_all));
                }
            }
        }
    }
done:
    om_free(mark);
    return status;
}

// ---- crossings --------------------------------------------------------------------------------------------

static OmStatus list_crossings(OmLattice* l) {
    for (int e = 0; e < l->ntet; e++) {
        for (int k = 0; k < 6; k++) {
            const int p = l->tet[e][om__tet_edge[k][0]], q = l->tet[e][om__tet_edge[k][1]];
            if (is_crossed(l, p, q)) OM_TRY(om__edge_add(&l->crossed, p, q));
        }
    }
    OM_ALLOC(l->crossing, l->crossed.nedge);
    return OM_OK;
}

// The crossing of the level between inside point x0 and outside point x1, by false position with
// Illinois' halving, which keeps the bracket.
static double find_crossing(const OmStuffDef* def, OmVec3 x0, OmVec3 x1, double f0, double f1) {
    double t0 = 0, t1 = 1, t = 0.5;
    if (!isfinite(f1)) f1 = -f0;
    if (!isfinite(f0)) f0 = -f1;
    if (!isfinite(f0)) return t;
    for (int it = 0; it < 12; it++) {
        t = (t0 * f1 - t1 * f0) / (f1 - f0);  // f0 < 0 < f1
        double f = def->fn(def->ctx, om_lerp(x0, x1, t)) - def->level;
        if (!isfinite(f) || fabs(f) < 1e-7 * def->edge || t1 - t0 < 1e-7) break;
        if (f < 0) {
            t0 = t;
            f0 = f;
            f1 *= 0.5;
        } else {
            t1 = t;
            f1 = f;
            f0 *= 0.5;
        }
    }
    return fmin(fmax(t, 0), 1);
}

static void cut_edges(void* ctx, int begin, int end, int block) {
    (void)block;
    OmLattice* l = ctx;
    for (int c = begin; c < end; c++) {
        const int lo = l->crossed.end[c][0], hi = l->crossed.end[c][1];
        const OmVec3 x = om__lattice_position(l, lo), y = om__lattice_position(l, hi);
        // start at the inside end
        l->crossing[c].t = l->f[lo] < 0 ? find_crossing(l->def, x, y, l->f[lo], l->f[hi])
                                        : 1 - find_crossing(l->def, y, x, l->f[hi], l->f[lo]);
    }
}

// The place of a neighbour among those of a lattice point: along +-x, +-y, +-z, then the eight diagonals.
static int place_of(const OmLattice* l, int p, int q) {
    if (!is_lattice_edge(l, p, q)) return q;
    const OmVec3 d = om_sub(om__lattice_position(l, q), om__lattice_position(l, p));
    const double size[3] = {fabs(d.x), fabs(d.y), fabs(d.z)}, part[3] = {d.x, d.y, d.z};
    if (!is_long(l, p, q)) return 6 + (d.x > 0) + 2 * (d.y > 0) + 4 * (d.z > 0);
    const int axis = size[0] > size[1] ? (size[0] > size[2] ? 0 : 2) : size[1] > size[2] ? 1 : 2;
    return 2 * axis + (part[axis] < 0);
}

// Shortest edge at each point that has an edge which ends at a midpoint, else 0.           (npoint)
static OmStatus find_shortest(const OmLattice* l, double** shortest) {
    unsigned char* is_graded = NULL;
    OmStatus status = OM_OK;
    *shortest = NULL;
    OM_ALLOC_DONE(*shortest, l->npoint);
    OM_CALLOC_DONE(is_graded, l->npoint);
    for (int p = 0; p < l->npoint; p++) (*shortest)[p] = HUGE_VAL;
    for (int e = 0; e < l->ntet; e++) {
        for (int k = 0; k < 6; k++) {
            const int p = l->tet[e][om__tet_edge[k][0]], q = l->tet[e][om__tet_edge[k][1]];
            const double length = sqrt(om__lattice_length2(l, p, q));
            (*shortest)[p] = fmin((*shortest)[p], length);
            (*shortest)[q] = fmin((*shortest)[q], length);
            if (!is_lattice_edge(l, p, q)) is_graded[p] = is_graded[q] = 1;
        }
    }
    for (int p = 0; p < l->npoint; p++)
        if (!is_graded[p]) (*shortest)[p] = 0;
done:
    om_free(is_graded);
    return status;
}

typedef struct Warp {
    int *adr, *list;   // crossings at each active point
    int* point;        // of each active one
    double* shortest;  // null: nothing is graded
    int nactive;
} Warp;

static OmStatus list_active(OmLattice* l, Warp* w) {
    OM_ALLOC(l->active, l->npoint);
    OM_ALLOC(w->point, 2 * (size_t)l->crossed.nedge);
    for (int p = 0; p < l->npoint; p++) l->active[p] = 0;
    for (int c = 0; c < l->crossed.nedge; c++) {
        l->active[l->crossed.end[c][0]]++;
        l->active[l->crossed.end[c][1]]++;
    }
    w->adr = om_calloc(2 * (size_t)l->crossed.nedge + 1, sizeof(int));
    if (!w->adr) return OM_NO_MEMORY;
    for (int p = 0; p < l->npoint; p++) {
        const int count = l->active[p];
        l->active[p] = count ? w->nactive : -1;
        if (!count) continue;
        w->point[w->nactive] = p;
        w->adr[w->nactive + 1] = w->adr[w->nactive] + count;
        w->nactive++;
    }
    OM_ALLOC(w->list, 2 * (size_t)l->crossed.nedge);
    OM_ALLOC(l->moved, w->nactive);
    for (int pass = 0; pass < 2; pass++) {  // fill, then move the beginnings back
        for (int c = l->crossed.nedge; pass == 0 && c-- > 0;) {
            const int* end = l->crossed.end[c];
            for (int s = 0; s < 2; s++) w->list[w->adr[l->active[end[s]]]++] = c;
        }
        for (int a = w->nactive; pass == 1 && a > 0; a--) w->adr[a] = w->adr[a - 1];
        if (pass == 1) w->adr[0] = 0;
    }
    return OM_OK;
}

// The distance up to which a point moves onto the crossing of an edge.
static double reach_of(const OmLattice* l, const Warp* w, int p, int q, double alpha) {
    if (w->shortest && w->shortest[p] > 0) return alpha * w->shortest[p];
    return sqrt(om__lattice_length2(l, p, q)) * (is_long(l, p, q) ? ALPHA_LONG : ALPHA_SHORT);
}

// A point that is too near to a crossing moves onto the nearest such crossing, in the order of the points' index.
static void warp_points(OmLattice* l, const Warp* w, double alpha) {
    for (int a = 0; a < w->nactive; a++) {
        const int p = w->point[a];
        int best = -1;
        double best_length = HUGE_VAL, best_t = 0;
        l->moved[a] = om__lattice_position(l, p);
        for (int i = w->adr[a]; i < w->adr[a + 1]; i++) {
            const int c = w->list[i];
            const bool is_first = l->crossed.end[c][0] == p;
            const int q = l->crossed.end[c][is_first];
            if (!is_crossed(l, p, q)) continue;
            const double t = is_first ? l->crossing[c].t : 1 - l->crossing[c].t;
            const double length = t * sqrt(om__lattice_length2(l, p, q));
            if (!(length < reach_of(l, w, p, q, alpha)) || length > best_length) continue;
            if (length == best_length && place_of(l, p, q) > place_of(l, p, best)) continue;
            best = q;
            best_length = length;
            best_t = t;
        }
        if (best < 0) continue;
        l->moved[a] = om_lerp(l->moved[a], om__lattice_position(l, best), best_t);
        l->f[p] = 0;
    }
}

// ---- the mesh -----------------------------------------------------------------------------------------------

static OmStatus add_vertex(OmLattice* l, OmVec3 x, int* index) {
    OmTetMesh* m = l->mesh;
    if (m->nvert == l->cap_mesh_vert) {
        int cap = 2 * l->cap_mesh_vert + 1024;
        double* grown = om_realloc(m->x, (size_t)l->cap_mesh_vert, (size_t)cap, 3 * sizeof(double));
        if (!grown) return OM_NO_MEMORY;
        m->x = grown;
        l->cap_mesh_vert = cap;
    }
    *index = m->nvert++;
    om_store3(m->x, *index, x);
    return OM_OK;
}

static OmStatus add_tet(OmLattice* l, int a, int b, int c, int d) {
    OmTetMesh* m = l->mesh;
    OM_CHECK(m->ntet < l->def->max_tet, OM_INVALID,
             "edges of %.3g mm give more than %d tetrahedra: use a larger edge", l->def->edge * 1e3,
             l->def->max_tet);
    if (m->ntet == l->cap_mesh_tet) {
        int cap = 2 * l->cap_mesh_tet + 4096;
        int* grown = om_realloc(m->tet_vert, (size_t)l->cap_mesh_tet, (size_t)cap, 4 * sizeof(int));
        if (!grown) return OM_NO_MEMORY;
        m->tet_vert = grown;
        l->cap_mesh_tet = cap;
    }
    int* t = &m->tet_vert[4 * (size_t)m->ntet++];
    t[0] = a;
    t[1] = b;
    t[2] = c;
    t[3] = d;
    return OM_OK;
}

static OmStatus lattice_vertex(OmLattice* l, int p, int* vert) {
    if (l->vert[p] < 0) {
        OmVec3 x = l->active[p] >= 0 ? l->moved[l->active[p]] : om__lattice_position(l, p);
        OM_TRY(add_vertex(l, x, &l->vert[p]));
    }
    *vert = l->vert[p];
    return OM_OK;
}

static OmStatus cut_vertex(OmLattice* l, int p, int q, int* vert) {
    const int edge = om__edge_find(&l->crossed, p, q);
    OM_ASSERT(edge >= 0);
    OmCrossing* c = &l->crossing[edge];
    if (c->vert < 0) {
        const int* end = l->crossed.end[edge];
        OmVec3 x = om_lerp(om__lattice_position(l, end[0]), om__lattice_position(l, end[1]), c->t);
        OM_TRY(add_vertex(l, x, &c->vert));
    }
    *vert = c->vert;
    return OM_OK;
}

// On the face (a, b, m) with a and b inside and m outside: does the diagonal start at a?
static bool diagonal_from_first(const OmLattice* l, int a, int b, int m) {
    const double to_a = om__lattice_length2(l, a, m), to_b = om__lattice_length2(l, b, m);
    if (to_a != to_b) return to_a < to_b;
    const int odd_a = parity(l, a), odd_b = parity(l, b);
    return odd_a != odd_b ? odd_a == 0 : a < b;
}

// A prism with triangle x below y and (x0, x1, x2, y) positive. from[i]: the diagonal of the side between i
// and i + 1 starts at x[i] (else at x[i + 1]). The three diagonals must not run in a circle.
static OmStatus add_prism(OmLattice* l, const int x[3], const int y[3], const bool from[3]) {
    for (int p = 0; p < 3; p++) {
        int q = (p + 1) % 3, r = (p + 2) % 3;
        bool starts_both = from[p] && !from[r];  // both sides at p have their diagonal start there
        if (!starts_both) continue;
        bool is_forward = from[q];  // the third starts at q, else at r
        if (is_forward) {
            OM_TRY(add_tet(l, x[p], x[q], x[r], y[r]));
            OM_TRY(add_tet(l, x[p], x[q], y[r], y[q]));
            return add_tet(l, x[p], y[q], y[r], y[p]);
        }
        OM_TRY(add_tet(l, x[p], x[q], x[r], y[q]));
        OM_TRY(add_tet(l, x[p], y[q], x[r], y[r]));
        return add_tet(l, x[p], y[q], y[r], y[p]);
    }
    OM_ASSERT(!"prism diagonals run in a circle");
    return OM_OK;
}

// Two inside (a, b), two outside (m, n): a wedge around edge ab. Its side on the surface belongs to no
// other tetrahedron, so the better of its two diagonals is chosen.
static OmStatus add_wedge(OmLattice* l, int a, int b, int m, int n) {
    int x[3], y[3];
    OM_TRY(lattice_vertex(l, a, &x[0]));
    OM_TRY(cut_vertex(l, a, m, &x[1]));
    OM_TRY(cut_vertex(l, a, n, &x[2]));
    OM_TRY(lattice_vertex(l, b, &y[0]));
    OM_TRY(cut_vertex(l, b, m, &y[1]));
    OM_TRY(cut_vertex(l, b, n, &y[2]));
    bool from[3] = {diagonal_from_first(l, a, b, m), false, !diagonal_from_first(l, a, b, n)};
    if (from[0] == from[2]) {  // the first two do not meet in one corner: no choice
        from[1] = !from[0];
        return add_prism(l, x, y, from);
    }
    double quality[2];
    for (int choice = 0; choice < 2; choice++) {
        int first = l->mesh->ntet;
        from[1] = choice == 1;
        OM_TRY(add_prism(l, x, y, from));
        quality[choice] = HUGE_VAL;
        for (int e = first; e < l->mesh->ntet; e++) {
            quality[choice] = fmin(quality[choice], om__tet_flatness(l->mesh, e));
        }
        l->mesh->ntet = first;
    }
    from[1] = quality[1] > quality[0];
    return add_prism(l, x, y, from);
}

// Two inside (a, b), z on the surface, m outside: a pyramid with apex z.
static OmStatus add_pyramid(OmLattice* l, int a, int b, int z, int m) {
    int va, vb, vz, am, bm;
    OM_TRY(lattice_vertex(l, a, &va));
    OM_TRY(lattice_vertex(l, b, &vb));
    OM_TRY(lattice_vertex(l, z, &vz));
    OM_TRY(cut_vertex(l, a, m, &am));
    OM_TRY(cut_vertex(l, b, m, &bm));
    if (diagonal_from_first(l, a, b, m)) {
        OM_TRY(add_tet(l, va, vb, vz, bm));
        return add_tet(l, va, bm, vz, am);
    }
    OM_TRY(add_tet(l, va, vb, vz, am));
    return add_tet(l, am, vb, vz, bm);
}

// Three inside, m outside.
static OmStatus add_truncated(OmLattice* l, const int in[3], int m) {
    int x[3], y[3];
    bool from[3];
    for (int i = 0; i < 3; i++) {
        OM_TRY(lattice_vertex(l, in[i], &x[i]));
        OM_TRY(cut_vertex(l, in[i], m, &y[i]));
        from[i] = diagonal_from_first(l, in[i], in[(i + 1) % 3], m);
    }
    return add_prism(l, x, y, from);
}

// One inside: the others are on the surface or cut.
static OmStatus add_corner(OmLattice* l, const int p[4], int in) {
    int v[4];
    for (int c = 0; c < 4; c++) {
        if (l->f[p[c]] <= 0)
            OM_TRY(lattice_vertex(l, p[c], &v[c]));
        else
            OM_TRY(cut_vertex(l, in, p[c], &v[c]));
    }
    return add_tet(l, v[0], v[1], v[2], v[3]);
}

// Even permutations that bring corner c to the end.
static const int to_end[4][4] = {{1, 3, 2, 0}, {0, 2, 3, 1}, {0, 3, 1, 2}, {0, 1, 2, 3}};

static OmStatus add_lattice_tet(OmLattice* l, const int p[4]) {
    int nin = 0, nout = 0, in = -1, out = -1, zero = -1;
    for (int c = 0; c < 4; c++) {
        double f = l->f[p[c]];
        if (f < 0) {
            nin++;
            in = c;
        } else if (f > 0) {
            nout++;
            out = c;
        } else {
            zero = c;
        }
    }
    if (nin == 0) return OM_OK;
    if (nin == 1) return add_corner(l, p, p[in]);
    if (nout == 0) {
        int v[4];
        for (int c = 0; c < 4; c++) OM_TRY(lattice_vertex(l, p[c], &v[c]));
        return add_tet(l, v[0], v[1], v[2], v[3]);
    }
    int r[4];
    for (int c = 0; c < 4; c++) r[c] = p[to_end[out][c]];
    if (nin == 3) return add_truncated(l, r, r[3]);
    // two inside: rotate the first three corners until the third is the other inside corner
    int third = zero >= 0 ? p[zero] : -1;
    for (int turn = 0; turn < 3; turn++) {
        bool is_third = third >= 0 ? r[2] == third : l->f[r[2]] > 0;
        if (is_third) break;
        int t = r[0];
        r[0] = r[1];
        r[1] = r[2];
        r[2] = t;
    }
    return zero >= 0 ? add_pyramid(l, r[0], r[1], r[2], r[3])
                     : add_wedge(l, r[0], r[1], r[2], r[3]);
}

static OmStatus cut_tets(OmLattice* l) {
    for (int p = 0; p < l->npoint; p++) l->vert[p] = -1;
    for (int c = 0; c < l->crossed.nedge; c++) l->crossing[c].vert = -1;
    for (int e = 0; e < l->ntet; e++) OM_TRY(add_lattice_tet(l, l->tet[e]));
    return OM_OK;
}

// Whether no element is flat or inverted.
static bool is_valid(const OmTetMesh* m) {
    for (int e = 0; e < m->ntet; e++) {
        const int* v = m->tet_vert + 4 * (size_t)e;
        const OmVec3 a = om_load3(m->x, v[0]);
        const OmVec3 b = om_sub(om_load3(m->x, v[1]), a), c = om_sub(om_load3(m->x, v[2]), a);
        const OmVec3 d = om_sub(om_load3(m->x, v[3]), a);
        const double longest = fmax(om_norm2(b), fmax(om_norm2(c), om_norm2(d)));
        if (!(om_dot(om_cross(b, c), d) > 1e-6 * longest * sqrt(longest))) return false;
    }
    return true;
}

// Move points and cut. Where edges of different lengths meet, a point that moves may flatten an element: then points
// move less far, at last not at all.
static OmStatus warp_and_cut(OmLattice* l) {
    OmStatus status = OM_OK;
    Warp w = {0};
    double* before = NULL;
    const bool is_graded = l->npoint > l->nlattice;
    OM_TRY_DONE(list_active(l, &w));
    OM_ALLOC_DONE(l->vert, l->npoint);
    if (is_graded) {
        OM_TRY_DONE(find_shortest(l, &w.shortest));
        OM_ALLOC_DONE(before, l->npoint);
        memcpy(before, l->f, (size_t)l->npoint * sizeof *before);
    }
    for (double alpha = ALPHA_GRADED;; alpha -= 0.1) {
        warp_points(l, &w, alpha);
        OM_TRY_DONE(cut_tets(l));
        if (!is_graded || alpha < 0.05 || is_valid(l->mesh)) break;
        memcpy(l->f, before, (size_t)l->npoint * sizeof *before);
        l->mesh->nvert = l->mesh->ntet = 0;
    }
done:
    om_free(w.adr);
    om_free(w.list);
    om_free(w.point);
    om_free(w.shortest);
    om_free(before);
    return status;
}

// ---- entry ----------------------------------------------------------------------------------------------------

OmStuffDef om_stuff_default_def(double edge, OmShapeFn fn, void* ctx, OmVec3 lo, OmVec3 hi) {
    OmStuffDef def = {.cookie = OM__STUFF_COOKIE,
                      .edge = edge,
                      .fn = fn,
                      .ctx = ctx,
                      .lo = lo,
                      .hi = hi,
                      .max_tet = 20000000};
    return def;
}

static OmStatus check_def(const OmStuffDef* def) {
    OM_CHECK(def->cookie == OM__STUFF_COOKIE, OM_INVALID,
             "OmStuffDef was not made by om_stuff_default_def");
    OM_CHECK(def->edge > 0 && isfinite(def->edge), OM_INVALID,
             "mesh: the edge length %g m must be positive", def->edge);
    OM_CHECK(def->fn, OM_INVALID, "mesh: no function to mesh");
    OM_CHECK(om_is_finite3(def->lo) && om_is_finite3(def->hi) && def->hi.x > def->lo.x &&
                 def->hi.y > def->lo.y && def->hi.z > def->lo.z,
             OM_INVALID, "mesh: the box to fill is empty or not finite");
    OM_CHECK(def->nfine >= 0 && (def->nfine == 0 || (def->fine && def->fine_edge)), OM_INVALID,
             "mesh: %d fine points without places or edges", def->nfine);
    for (int i = 0; i < def->nfine; i++)
        OM_CHECK(om_is_finite3(om_load3(def->fine, i)) && def->fine_edge[i] > 0, OM_INVALID,
                 "mesh: fine point %d is not finite, or its edge %g m is not positive", i,
                 def->fine_edge[i]);
    OM_CHECK(def->max_tet > 0 && def->max_tet < INT_MAX / 16 && isfinite(def->level), OM_INVALID,
             "mesh: max_tet %d or level %g out of range", def->max_tet, def->level);
    return OM_OK;
}

OmStatus om_tet_mesh_stuff(const OmStuffDef* def, OmTetMesh* mesh) {
    OmStatus status = OM_OK;
    memset(mesh, 0, sizeof *mesh);
    OM_TRY(check_def(def));
    OmLattice l = {.mesh = mesh};
    OM_TRY_DONE(lattice_init(def, &l));
    OM_TRY_DONE(om_stop_poll());
    cap_border(&l);
    OM_TRY_DONE(list_tets(&l));
    OM_TRY_DONE(om_stop_poll());
    if (def->nfine > 0) OM_TRY_DONE(om__lattice_grade(&l));
    OM_TRY_DONE(om_stop_poll());
    OM_TRY_DONE(list_crossings(&l));
    OM_CHECK_DONE(l.crossed.nedge > 0, OM_INVALID,
                  "no lattice point is inside: the shape is thinner than an edge of %.3g mm",
                  def->edge * 1e3);
    OM_TRY_DONE(om_parallel_for_stop(def->nworker, l.crossed.nedge, 256, cut_edges, &l));
    OM_TRY_DONE(om_stop_poll());
    OM_TRY_DONE(warp_and_cut(&l));
    OM_CHECK_DONE(mesh->ntet > 0, OM_INVALID,
                  "no element is inside: the shape is thinner than an edge of %.3g mm",
                  def->edge * 1e3);
    if (l.npoint > l.nlattice) OM_TRY_DONE(om__mesh_improve(mesh));
    mesh->tet_label = om_calloc((size_t)mesh->ntet, sizeof(int));
    if (!mesh->tet_label) status = OM_NO_MEMORY;
done:
    om_free(l.middle);
    om_free(l.f);
    om_free(l.tet);
    om_free(l.crossing);
    om__edge_table_done(&l.crossed);
    om_free(l.active);
    om_free(l.moved);
    om_free(l.vert);
    if (status < 0) om_tet_mesh_done(mesh);
    return status;
}
