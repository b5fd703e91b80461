// shape_contour.c: marching cubes (Lorensen & Cline 1987) whose neighbouring cells agree on each shared face.
//
// The table is computed, not typed in. On each face of a cell the cut edges are joined in pairs; on an
// ambiguous face the inside corners stay apart. The pairs form loops, and each loop is filled with
// triangles. The rule depends on the face alone, so the two cells that share it always agree. The surface
// is therefore closed and manifold; it is the boundary of the solid in which inside nodes are connected
// over cell edges.
//
// Filling a loop by diagonals is safe unless a diagonal would lie in a face of the cell, where the
// neighbour may draw the same one; such a loop gets a vertex in its middle instead.
//
//        6-------7        corner c at (c & 1, c >> 1 & 1, c >> 2 & 1)
//       /|      /|        edge 4 a + q: along axis a, q numbers the four parallel edges by the bits of the
//      4-------5 |        corner in the two following axes
//      | 2-----|-3
//      |/      |/
//      0-------1
#include "shape/shape_internal.h"

#include <limits.h>
#include <string.h>

#define MAX_LOOP 4     // a cell has at most four loops
#define MAX_CORNER 12  // of a loop

typedef struct Loop {
    int n;                 // corners, each a cut edge of the cell
    int edge[MAX_CORNER];  // counter-clockwise seen from outside the solid
    int apex;              // fan from this corner; -1: from a vertex in the middle
} Loop;

typedef struct Case {
    int nloop;
    Loop loop[MAX_LOOP];
} Case;

static void edge_ends(int edge, int* from, int* to) {
    int a = edge / 4, q = edge % 4;
    int b = (a + 1) % 3, c = (a + 2) % 3;
    *from = (q & 1) << b | (q >> 1) << c;
    *to = *from | 1 << a;
}

static int edge_between(int x, int y) {
    int lower = x < y ? x : y, diff = x ^ y;
    int a = diff == 1 ? 0 : diff == 2 ? 1 : 2;
    int b = (a + 1) % 3, c = (a + 2) % 3;
    return 4 * a + (lower >> b & 1) + 2 * (lower >> c & 1);
}

// The corners of face 2 axis + side, counter-clockwise seen from outside the cell.
static void face_corners(int face, int corner[4]) {
    int a = face / 2, side = face % 2;
    int b = (a + 1) % 3, c = (a + 2) % 3;
    const int ring[4] = {0, 1 << b, 1 << b | 1 << c, 1 << c};
    for (int i = 0; i < 4; i++) corner[i] = ring[side ? i : 3 - i] | side << a;
}

// next[e]: the cut edge that follows e on its loop, counter-clockwise seen from outside the solid. Walking
// round a face, each run of inside corners gives one segment, from the edge where it begins to the edge
// where it ends, which keeps the inside corners apart on an ambiguous face.
static void trace_faces(int inside, int next[12]) {
    for (int e = 0; e < 12; e++) next[e] = -1;
    for (int face = 0; face < 6; face++) {
        int corner[4];
        face_corners(face, corner);
        for (int i = 0; i < 4; i++) {
            int here = corner[i], before = corner[(i + 3) % 4];
            if (!(inside >> here & 1) || (inside >> before & 1)) continue;
            int last = i;
            while (inside >> corner[(last + 1) % 4] & 1) last++;
            int entry = edge_between(before, here);
            int exit = edge_between(corner[last % 4], corner[(last + 1) % 4]);
            next[entry] = exit;
        }
    }
}

static bool share_face(int edge_a, int edge_b) {
    int a0, a1, b0, b1;
    edge_ends(edge_a, &a0, &a1);
    edge_ends(edge_b, &b0, &b1);
    for (int axis = 0; axis < 3; axis++) {
        int bit = 1 << axis;
        if ((a0 & bit) == (a1 & bit) && (b0 & bit) == (b1 & bit) && (a0 & bit) == (b0 & bit))
            return true;
    }
    return false;
}

static int choose_apex(const Loop* loop) {
    for (int apex = 0; apex < loop->n; apex++) {
        bool is_safe = true;
        for (int i = 2; i < loop->n - 1; i++) {
            if (share_face(loop->edge[apex], loop->edge[(apex + i) % loop->n])) is_safe = false;
        }
        if (is_safe) return apex;
    }
    return -1;
}

static void make_case(int inside, Case* out) {
    int next[12];
    bool is_used[12] = {false};
    out->nloop = 0;
    trace_faces(inside, next);
    for (int e = 0; e < 12; e++) {
        if (next[e] < 0 || is_used[e]) continue;
        Loop* loop = &out->loop[out->nloop++];
        loop->n = 0;
        for (int f = e; !is_used[f]; f = next[f]) {
            is_used[f] = true;
            loop->edge[loop->n++] = f;
        }
        loop->apex = choose_apex(loop);
    }
}

// ---- the surface --------------------------------------------------------------------------------------

typedef struct Contour {
    const OmSdf* sdf;
    double level;
    Case table[256];
    // surface vertex on the edge from each node along an axis; nodes of two slices
    int* edge_vert[3];
    OmSurface* out;
    int cap_vert, cap_tri;
} Contour;

// Node values; one layer of air surrounds the grid, so indices run from -1 to dim.
static double node_value(const Contour* c, int i, int j, int k) {
    const int* dim = c->sdf->grid.dim;
    if (!om_grid_has(dim, i, j, k)) return c->sdf->grid.spacing;
    return (double)c->sdf->d[om_grid_index(dim, i, j, k)] - c->level;
}

static OmStatus add_vertex(Contour* c, OmVec3 p, int* index) {
    OmSurface* s = c->out;
    if (s->nvert == c->cap_vert) {
        OM_CHECK(c->cap_vert < INT_MAX / 6, OM_INVALID, "the surface has too many vertices");
        int cap = 2 * c->cap_vert + 1024;
        double* x = om_realloc(s->x, (size_t)c->cap_vert, (size_t)cap, 3 * sizeof(double));
        if (!x) return OM_NO_MEMORY;
        s->x = x;
        c->cap_vert = cap;
    }
    *index = s->nvert++;
    om_store3(s->x, *index, p);
    return OM_OK;
}

static OmStatus add_triangle(Contour* c, int a, int b, int d) {
    OmSurface* s = c->out;
    if (s->ntri == c->cap_tri) {
        OM_CHECK(c->cap_tri < INT_MAX / 6, OM_INVALID, "the surface has too many triangles");
        int cap = 2 * c->cap_tri + 2048;
        int* tri = om_realloc(s->tri_vert, (size_t)c->cap_tri, (size_t)cap, 3 * sizeof(int));
        if (!tri) return OM_NO_MEMORY;
        s->tri_vert = tri;
        c->cap_tri = cap;
    }
    int* t = &s->tri_vert[3 * (size_t)s->ntri++];
    t[0] = a;
    t[1] = b;
    t[2] = d;
    return OM_OK;
}

// The vertex on a cut edge of the cell at (i, j, k); made once, shared by the four cells around the edge.
static OmStatus edge_vertex(Contour* c, int i, int j, int k, int edge, int* vert) {
    int from, to, axis = edge / 4;
    edge_ends(edge, &from, &to);
    int a[3] = {i + (from & 1), j + (from >> 1 & 1), k + (from >> 2 & 1)};
    int b[3] = {i + (to & 1), j + (to >> 1 & 1), k + (to >> 2 & 1)};
    size_t nx = (size_t)c->sdf->grid.dim[0] + 2, ny = (size_t)c->sdf->grid.dim[1] + 2;
    size_t slot = (size_t)(a[0] + 1) + nx * ((size_t)(a[1] + 1) + ny * (size_t)((a[2] + 1) & 1));
    int* known = &c->edge_vert[axis][slot];
    if (*known < 0) {
        double fa = node_value(c, a[0], a[1], a[2]), fb = node_value(c, b[0], b[1], b[2]);
        double t = fa / (fa - fb);  // the signs differ
        t = t > 1e-3 ? (t < 1 - 1e-3 ? t : 1 - 1e-3)
                     : 1e-3;  // no flat triangles at nodes on the level
        OmVec3 p = om_lerp(om_vec3(a[0], a[1], a[2]), om_vec3(b[0], b[1], b[2]), t);
        OM_TRY(add_vertex(c, om_madd(c->sdf->grid.origin, c->sdf->grid.spacing, p), known));
    }
    *vert = *known;
    return OM_OK;
}

static OmStatus fill_loop(Contour* c, const Loop* loop, int i, int j, int k) {
    int vert[MAX_CORNER], middle = -1;
    for (int e = 0; e < loop->n; e++) OM_TRY(edge_vertex(c, i, j, k, loop->edge[e], &vert[e]));
    if (loop->apex >= 0) {
        for (int e = 1; e < loop->n - 1; e++) {
            OM_TRY(add_triangle(c, vert[loop->apex], vert[(loop->apex + e) % loop->n],
                                vert[(loop->apex + e + 1) % loop->n]));
        }
        return OM_OK;
    }
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int e = 0; e < loop->n; e++) sum = om_add(sum, om_load3(c->out->x, vert[e]));
    OM_TRY(add_vertex(c, om_scale(1.0 / loop->n, sum), &middle));
    for (int e = 0; e < loop->n; e++) {
        OM_TRY(add_triangle(c, middle, vert[e], vert[(e + 1) % loop->n]));
    }
    return OM_OK;
}

// The cells between node slices k and k + 1.
static OmStatus march_slice(Contour* c, int k) {
    const int* dim = c->sdf->grid.dim;
    for (int j = -1; j < dim[1]; j++) {
        int inside = 0;  // corners of the cell; moving along i, the right four become the left four
        for (int i = -2; i < dim[0]; i++) {
            inside = inside >> 1 & 0x55;
            for (int q = 0; q < 4; q++) {
                if (node_value(c, i + 1, j + (q & 1), k + (q >> 1)) < 0) inside |= 2 << (2 * q);
            }
            if (i < -1 || inside == 0 || inside == 255) continue;
            const Case* cell = &c->table[inside];
            for (int l = 0; l < cell->nloop; l++) OM_TRY(fill_loop(c, &cell->loop[l], i, j, k));
        }
    }
    return OM_OK;
}

OmStatus om_surface_from_sdf(const OmSdf* sdf, double level, OmSurface* surface) {
    OmStatus status = OM_OK;
    memset(surface, 0, sizeof *surface);
    size_t slice = ((size_t)sdf->grid.dim[0] + 2) * ((size_t)sdf->grid.dim[1] + 2);
    Contour* c = om_calloc(1, sizeof *c);
    if (!c) return OM_NO_MEMORY;
    c->sdf = sdf;
    c->level = level;
    c->out = surface;
    for (int a = 0; a < 3; a++) OM_ALLOC_DONE(c->edge_vert[a], 2 * slice);
    for (int inside = 0; inside < 256; inside++) make_case(inside, &c->table[inside]);
    for (int a = 0; a < 3; a++) {
        for (size_t n = 0; n < 2 * slice; n++) c->edge_vert[a][n] = -1;
    }
    for (int k = -1; k < sdf->grid.dim[2]; k++) {
        // the upper node slice of these cells takes the place of the one below them
        for (int a = 0; a < 3; a++) {
            int* upper = &c->edge_vert[a][slice * (size_t)((k + 2) & 1)];
            for (size_t n = 0; n < slice; n++) upper[n] = -1;
        }
        OM_TRY_DONE(march_slice(c, k));
    }
done:
    for (int a = 0; a < 3; a++) om_free(c->edge_vert[a]);
    om_free(c);
    if (status < 0) om_surface_done(surface);
    return status;
}
