// shape_stuff.c: isosurface stuffing, Labelle & Shewchuk, ACM Transactions on Graphics 26(3), 2007.
//
// The lattice is body-centred cubic: the corners and the centres of cubes of side a. Long edges (a) join
// corners to corners and centres to centres, short ones (a sqrt 3 / 2) centres to the corners of their
// cube. Each face between two cubes holds four tetrahedra: both centres and one edge of the face.
//
//   1. evaluate the function on the lattice, and find where it crosses each edge whose ends differ in sign;
//   2. a lattice point nearer to a crossing than alpha times the edge is moved onto it (and is then on the
//      surface: its other crossings are void);
//   3. cut each tetrahedron: points inside stay, edges from inside to outside end at their crossing.
//
// A cut face with two inside corners is a quadrilateral, and both neighbours must halve it the same way.
// If its inside edge is long, the diagonal starts at the corner of even parity (Labelle & Shewchuk's
// parity rule); if short, at the corner whose cut edge is short.
#include "shape/shape_internal.h"

#include <limits.h>
#include <string.h>

#define ALPHA_LONG 0.24999
#define ALPHA_SHORT 0.41189
#define MEAN_EDGE 0.92344  // mean edge of the lattice over a: (3 + 4 sqrt(3) / 2) / 7

enum { NSLOT = 14 };  // neighbours of a lattice point: 6 along long edges, then 8 along short ones

typedef struct Lattice {
    const OmStuffDef* def;
    double a;     // side of the cubes, m
    int n[3];     // cubes
    int ncorner;  // points with smaller index are corners, the others centres
    int npoint;
    OmVec3 origin;  // of the first corner, m
    double* f;      // value at each point, 0 once moved onto the surface       (npoint)
    int* active;    // index among the points that have a crossing, or -1       (npoint)
    int* point;     // lattice point of each active one                         (nactive)
    int nactive;
    // position of the crossing towards neighbour s, as a fraction of the edge (nactive x 14)
    double* cut;
    OmVec3* moved;  // position of active points                                (nactive)
    int* cut_vert;  // mesh vertex of the crossing, at the end of smaller index (nactive x 14)
    int* vert;      // mesh vertex of each lattice point, or -1                 (npoint)
    OmTetMesh* mesh;
    int cap_vert, cap_tet;
} Lattice;

// ---- the lattice ----------------------------------------------------------------------------------------

static void point_place(const Lattice* l, int p, int at[3], int* is_center) {
    *is_center = p >= l->ncorner;
    int nx = l->n[0] + !*is_center, ny = l->n[1] + !*is_center;
    int q = *is_center ? p - l->ncorner : p;
    at[0] = q % nx;
    at[1] = q / nx % ny;
    at[2] = q / nx / ny;
}

static int point_index(const Lattice* l, const int at[3], int is_center) {
    int nx = l->n[0] + !is_center, ny = l->n[1] + !is_center, nz = l->n[2] + !is_center;
    if (at[0] < 0 || at[1] < 0 || at[2] < 0 || at[0] >= nx || at[1] >= ny || at[2] >= nz) return -1;
    return (is_center ? l->ncorner : 0) + at[0] + nx * (at[1] + ny * at[2]);
}

static OmVec3 point_position(const Lattice* l, int p) {
    int at[3], is_center;
    point_place(l, p, at, &is_center);
    double shift = is_center ? 0.5 : 0.0;
    return om_madd(l->origin, l->a, om_vec3(at[0] + shift, at[1] + shift, at[2] + shift));
}

// The neighbour of p in slot s (-1 beyond the lattice): +-x, +-y, +-z, then the eight diagonals.
static int neighbor(const Lattice* l, int p, int s) {
    int at[3], is_center;
    point_place(l, p, at, &is_center);
    if (s < 6) {
        at[s / 2] += s & 1 ? -1 : 1;
        return point_index(l, at, is_center);
    }
    int back = is_center ? 0 : 1;  // corners look down to centres, centres up to corners
    for (int a = 0; a < 3; a++) at[a] += ((s - 6) >> a & 1) - back;
    return point_index(l, at, !is_center);
}

static int slot_of(const Lattice* l, int p, int q) {
    for (int s = 0; s < NSLOT; s++) {
        if (neighbor(l, p, s) == q) return s;
    }
    OM_ASSERT(!"lattice points are neighbours");
    return 0;
}

static int parity(const Lattice* l, int p) {
    int at[3], is_center;
    point_place(l, p, at, &is_center);
    return (at[0] + at[1] + at[2]) & 1;
}

static bool is_long(const Lattice* l, int p, int q) {
    return (p >= l->ncorner) == (q >= l->ncorner);
}

static bool is_crossed(const Lattice* l, int p, int q) {
    return (l->f[p] < 0 && l->f[q] > 0) || (l->f[p] > 0 && l->f[q] < 0);
}

static void eval_points(void* ctx, int begin, int end, int block) {
    (void)block;
    Lattice* l = ctx;
    for (int p = begin; p < end; p++) {
        double f = l->def->fn(l->def->ctx, point_position(l, p)) - l->def->level;
        l->f[p] = isnan(f) ? HUGE_VAL : f;
    }
}

static OmStatus lattice_init(const OmStuffDef* def, Lattice* l) {
    l->def = def;
    l->a = def->edge / MEAN_EDGE;
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
    l->npoint = (int)(npoint + ncell);
    OmVec3 half = om_scale(0.5 * l->a, om_vec3(l->n[0], l->n[1], l->n[2]));
    l->origin = om_sub(om_lerp(def->lo, def->hi, 0.5), half);
    OM_ALLOC(l->f, l->npoint);
    OM_ALLOC(l->active, l->npoint);
    OM_ALLOC(l->vert, l->npoint);
    om_parallel_for(def->nworker, l->npoint, 4096, eval_points, l);
    return OM_OK;
}

// ---- crossings --------------------------------------------------------------------------------------------

// Points of the outermost layer count as outside: the solid is cut off at the box.
static void cap_border(Lattice* l) {
    for (int p = 0; p < l->npoint; p++) {
        int at[3], is_center;
        point_place(l, p, at, &is_center);
        for (int a = 0; a < 3; a++) {
            bool is_border = at[a] == 0 || at[a] == l->n[a] - is_center;
            if (is_border && l->f[p] <= 0) l->f[p] = l->a;
        }
    }
}

static OmStatus find_active(Lattice* l) {
    for (int pass = 0; pass < 2; pass++) {
        int n = 0;
        for (int p = 0; p < l->npoint; p++) {
            bool is_active = false;
            for (int s = 0; s < NSLOT && !is_active; s++) {
                int q = neighbor(l, p, s);
                is_active = q >= 0 && is_crossed(l, p, q);
            }
            l->active[p] = is_active ? n : -1;
            if (is_active && pass) l->point[n] = p;
            n += is_active;
        }
        l->nactive = n;
        if (!pass) OM_ALLOC(l->point, n);
    }
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
    Lattice* l = ctx;
    for (int a = begin; a < end; a++) {
        int p = l->point[a];
        OmVec3 x = point_position(l, p);
        l->moved[a] = x;
        for (int s = 0; s < NSLOT; s++) {
            int q = neighbor(l, p, s);
            l->cut_vert[NSLOT * a + s] = -1;
            if (q < 0 || !is_crossed(l, p, q)) continue;
            OmVec3 y = point_position(l, q);
            // start at the inside end, so that both ends compute the same bits
            double t = l->f[p] < 0 ? find_crossing(l->def, x, y, l->f[p], l->f[q])
                                   : 1 - find_crossing(l->def, y, x, l->f[q], l->f[p]);
            l->cut[NSLOT * a + s] = t;
        }
    }
}

// A point that is too near to a crossing moves onto the nearest such crossing, in the order of the points' index.
static void warp(Lattice* l) {
    for (int a = 0; a < l->nactive; a++) {
        int p = l->point[a], best = -1;
        double best_length = HUGE_VAL, best_t = 0;
        for (int s = 0; s < NSLOT; s++) {
            int q = neighbor(l, p, s);
            if (q < 0 || !is_crossed(l, p, q)) continue;
            double t = l->cut[NSLOT * a + s];
            double length = t * (s < 6 ? 1 : 0.8660254037844386);
            if (t < (s < 6 ? ALPHA_LONG : ALPHA_SHORT) && length < best_length) {
                best = q;
                best_length = length;
                best_t = t;
            }
        }
        if (best < 0) continue;
        l->moved[a] = om_lerp(l->moved[a], point_position(l, best), best_t);
        l->f[p] = 0;
    }
}

// ---- the mesh -----------------------------------------------------------------------------------------------

static OmStatus add_vertex(Lattice* l, OmVec3 x, int* index) {
    OmTetMesh* m = l->mesh;
    if (m->nvert == l->cap_vert) {
        int cap = 2 * l->cap_vert + 1024;
        double* grown = om_realloc(m->x, (size_t)l->cap_vert, (size_t)cap, 3 * sizeof(double));
        if (!grown) return OM_NO_MEMORY;
        m->x = grown;
        l->cap_vert = cap;
    }
    *index = m->nvert++;
    om_store3(m->x, *index, x);
    return OM_OK;
}

static OmStatus add_tet(Lattice* l, int a, int b, int c, int d) {
    OmTetMesh* m = l->mesh;
    OM_CHECK(m->ntet < l->def->max_tet, OM_INVALID,
             "edges of %.3g mm give more than %d tetrahedra: use a larger edge", l->def->edge * 1e3,
             l->def->max_tet);
    if (m->ntet == l->cap_tet) {
        int cap = 2 * l->cap_tet + 4096;
        int* grown = om_realloc(m->tet_vert, (size_t)l->cap_tet, (size_t)cap, 4 * sizeof(int));
        if (!grown) return OM_NO_MEMORY;
        m->tet_vert = grown;
        l->cap_tet = cap;
    }
    int* t = &m->tet_vert[4 * (size_t)m->ntet++];
    t[0] = a;
    t[1] = b;
    t[2] = c;
    t[3] = d;
    return OM_OK;
}

static OmStatus lattice_vertex(Lattice* l, int p, int* vert) {
    if (l->vert[p] < 0) {
        OmVec3 x = l->active[p] >= 0 ? l->moved[l->active[p]] : point_position(l, p);
        OM_TRY(add_vertex(l, x, &l->vert[p]));
    }
    *vert = l->vert[p];
    return OM_OK;
}

static OmStatus cut_vertex(Lattice* l, int p, int q, int* vert) {
    int from = p < q ? p : q, to = p < q ? q : p;
    int adr = NSLOT * l->active[from] + slot_of(l, from, to);
    if (l->cut_vert[adr] < 0) {
        OmVec3 x = om_lerp(point_position(l, from), point_position(l, to), l->cut[adr]);
        OM_TRY(add_vertex(l, x, &l->cut_vert[adr]));
    }
    *vert = l->cut_vert[adr];
    return OM_OK;
}

// On the face (a, b, m) with a and b inside and m outside: does the diagonal start at a?
static bool diagonal_from_first(const Lattice* l, int a, int b, int m) {
    if (is_long(l, a, b)) return parity(l, a) == 0;
    return !is_long(l, a, m);
}

// A prism with triangle x below y and (x0, x1, x2, y) positive. from[i]: the diagonal of the side between i
// and i + 1 starts at x[i] (else at x[i + 1]). The three diagonals must not run in a circle.
static OmStatus add_prism(Lattice* l, const int x[3], const int y[3], const bool from[3]) {
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

// Smallest dihedral angle of a tetrahedron, rad.
static double smallest_angle(const Lattice* l, const int v[4]) {
    OmTetMesh one = {.x = l->mesh->x, .nvert = l->mesh->nvert, .ntet = 1, .tet_vert = (int*)v};
    double smallest, largest;
    om_tet_dihedral(&one, 0, &smallest, &largest);
    return fmin(smallest, OM_PI - largest);
}

// Two inside (a, b), two outside (m, n): a wedge around edge ab. Its side on the surface belongs to no
// other tetrahedron, so the better of its two diagonals is chosen.
static OmStatus add_wedge(Lattice* l, int a, int b, int m, int n) {
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
            quality[choice] =
                fmin(quality[choice], smallest_angle(l, &l->mesh->tet_vert[4 * (size_t)e]));
        }
        l->mesh->ntet = first;
    }
    from[1] = quality[1] > quality[0];
    return add_prism(l, x, y, from);
}

// Two inside (a, b), z on the surface, m outside: a pyramid with apex z.
static OmStatus add_pyramid(Lattice* l, int a, int b, int z, int m) {
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
static OmStatus add_truncated(Lattice* l, const int in[3], int m) {
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
static OmStatus add_corner(Lattice* l, const int p[4], int in) {
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

static OmStatus add_lattice_tet(Lattice* l, const int p[4]) {
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

// The four tetrahedra around the long edge from the centre of cube `at` along `axis`.
static OmStatus add_face_tets(Lattice* l, const int at[3], int axis) {
    int b = (axis + 1) % 3, c = (axis + 2) % 3, next[3] = {at[0], at[1], at[2]}, ring[4];
    next[axis]++;
    int center[2] = {point_index(l, at, 1), point_index(l, next, 1)};
    for (int q = 0; q < 4; q++) {
        int corner[3] = {next[0], next[1], next[2]};
        corner[b] += q == 1 || q == 2;
        corner[c] += q >= 2;
        ring[q] = point_index(l, corner, 0);
    }
    for (int q = 0; q < 4; q++) {
        const int p[4] = {center[0], center[1], ring[q], ring[(q + 1) % 4]};
        OM_TRY(add_lattice_tet(l, p));
    }
    return OM_OK;
}

static OmStatus add_tets(Lattice* l) {
    for (int p = 0; p < l->npoint; p++) l->vert[p] = -1;
    for (int k = 0; k < l->n[2]; k++) {
        for (int j = 0; j < l->n[1]; j++) {
            for (int i = 0; i < l->n[0]; i++) {
                const int at[3] = {i, j, k};
                for (int axis = 0; axis < 3; axis++) {
                    if (at[axis] + 1 < l->n[axis]) OM_TRY(add_face_tets(l, at, axis));
                }
            }
        }
    }
    return OM_OK;
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
    OM_CHECK(def->max_tet > 0 && def->max_tet < INT_MAX / 16 && isfinite(def->level), OM_INVALID,
             "mesh: max_tet %d or level %g out of range", def->max_tet, def->level);
    return OM_OK;
}

OmStatus om_tet_mesh_stuff(const OmStuffDef* def, OmTetMesh* mesh) {
    OmStatus status = OM_OK;
    memset(mesh, 0, sizeof *mesh);
    OM_TRY(check_def(def));
    Lattice l = {.mesh = mesh};
    OM_TRY_DONE(lattice_init(def, &l));
    cap_border(&l);
    OM_TRY_DONE(find_active(&l));
    OM_CHECK_DONE(l.nactive > 0, OM_INVALID,
                  "no lattice point is inside: the shape is thinner than an edge of %.3g mm",
                  def->edge * 1e3);
    OM_CHECK_DONE(l.nactive < INT_MAX / NSLOT, OM_INVALID, "mesh: the surface is too large");
    OM_ALLOC_DONE(l.cut, NSLOT * (size_t)l.nactive);
    OM_ALLOC_DONE(l.cut_vert, NSLOT * (size_t)l.nactive);
    OM_ALLOC_DONE(l.moved, l.nactive);
    om_parallel_for(def->nworker, l.nactive, 256, cut_edges, &l);
    warp(&l);
    OM_TRY_DONE(add_tets(&l));
    OM_CHECK_DONE(mesh->ntet > 0, OM_INVALID,
                  "no element is inside: the shape is thinner than an edge of %.3g mm",
                  def->edge * 1e3);
    mesh->tet_label = om_calloc((size_t)mesh->ntet, sizeof(int));
    if (!mesh->tet_label) status = OM_NO_MEMORY;
done:
    om_free(l.f);
    om_free(l.active);
    om_free(l.point);
    om_free(l.vert);
    om_free(l.cut);
    om_free(l.cut_vert);
    om_free(l.moved);
    if (status < 0) om_tet_mesh_done(mesh);
    return status;
}
