// shape_stuff_grade.c: a finer lattice at fine points, by halving edges (Rivara 1984, longest edges).
//
// A round marks the longest edge of each tetrahedron that holds a fine point and is too large; then, until nothing
// changes, the longest edge of each tetrahedron with a marked one. Each tetrahedron is halved at its longest marked
// edge, its halves at theirs, and so on. Edges have one order for all tetrahedra, so both sides of a face are cut
// alike, and the lattice stays conforming.
//
// A tetrahedron is too large by its volume: halves of halves of halves have the volume of a lattice of half the edge,
// but their longest edge is 0.7 of the old one.
#include <string.h>

#include "shape/shape_stuff.h"

#define MAX_ROUND 60

typedef struct Edge {
    int lo, hi;  // its ends
} Edge;

static Edge edge_of(const int p[4], int k) {
    const int a = p[om__tet_edge[k][0]], b = p[om__tet_edge[k][1]];
    return (Edge){a < b ? a : b, a < b ? b : a};
}

// Whether edge a comes before edge b: longer, of equally long ones that of smaller points.
static bool is_before(const OmLattice* l, Edge a, Edge b) {
    const double x = om__lattice_length2(l, a.lo, a.hi), y = om__lattice_length2(l, b.lo, b.hi);
    if (x != y) return x > y;
    return a.lo != b.lo ? a.lo < b.lo : a.hi < b.hi;
}

static Edge longest_edge(const OmLattice* l, const int p[4]) {
    Edge best = edge_of(p, 0);
    for (int k = 1; k < 6; k++) {
        const Edge m = edge_of(p, k);
        if (is_before(l, m, best)) best = m;
    }
    return best;
}

// ---- the points that a tetrahedron holds -----------------------------------------------------------------

typedef struct Bins {  // fine points by the cube of the lattice that holds them
    int *adr, *list;   // (cubes + 1), (nfine)
} Bins;

static OmStatus fill_bins(const OmLattice* l, Bins* bins) {
    const size_t ncube = om_grid_count(l->n);
    bins->adr = om_calloc(ncube + 1, sizeof(int));
    bins->list = om_alloc((size_t)l->def->nfine, sizeof(int));
    if (!bins->adr || !bins->list) return OM_NO_MEMORY;
    int at[3];
    for (int pass = 0; pass < 2; pass++) {  // count, then fill each cube's part from its end
        for (int i = l->def->nfine; i-- > 0;) {
            if (!om__lattice_find_cube(l, i, at)) continue;
            int* adr = &bins->adr[om_grid_index(l->n, at[0], at[1], at[2])];
            if (pass == 0)
                ++*adr;
            else
                bins->list[--*adr] = i;
        }
        for (size_t c = 0; c < ncube && pass == 0; c++) bins->adr[c + 1] += bins->adr[c];
    }
    return OM_OK;
}

// The smallest edge of a fine point in a tetrahedron; HUGE_VAL: it holds none.
static double asked_edge(const OmLattice* l, const Bins* bins, const int p[4]) {
    OmVec3 x[4], lo, hi;
    double best = HUGE_VAL;
    for (int c = 0; c < 4; c++) {
        x[c] = om__lattice_position(l, p[c]);
        lo = c ? om_min3(lo, x[c]) : x[c];
        hi = c ? om_max3(hi, x[c]) : x[c];
    }
    lo = om_scale(1 / l->a, om_sub(lo, l->origin));
    hi = om_scale(1 / l->a, om_sub(hi, l->origin));
    const double first[3] = {lo.x, lo.y, lo.z}, last[3] = {hi.x, hi.y, hi.z};
    int from[3], to[3];
    for (int a = 0; a < 3; a++) {
        from[a] = (int)fmax(floor(first[a]), 0);
        to[a] = (int)fmin(floor(last[a]), l->n[a] - 1);
    }
    OmMat3 weights;
    if (om_mat3_inverse(om_mat3_cols(om_sub(x[1], x[0]), om_sub(x[2], x[0]), om_sub(x[3], x[0])),
                        &weights) < 0)
        return HUGE_VAL;
    for (int k = from[2]; k <= to[2]; k++) {
        for (int j = from[1]; j <= to[1]; j++) {
            for (int i = from[0]; i <= to[0]; i++) {
                const size_t cube = om_grid_index(l->n, i, j, k);
                for (int n = bins->adr[cube]; n < bins->adr[cube + 1]; n++) {
                    const int f = bins->list[n];
                    if (l->def->fine_edge[f] >= best) continue;
                    const OmVec3 w =
                        om_mat3_apply(weights, om_sub(om_load3(l->def->fine, f), x[0]));
                    const double rest = 1 - w.x - w.y - w.z, eps = -1e-6;
                    if (w.x >= eps && w.y >= eps && w.z >= eps && rest >= eps)
                        best = l->def->fine_edge[f];
                }
            }
        }
    }
    return best;
}

static double find_volume(const OmLattice* l, const int p[4]) {
    const OmVec3 x = om__lattice_position(l, p[0]);
    OmVec3 side[3];
    for (int c = 0; c < 3; c++) side[c] = om_sub(om__lattice_position(l, p[c + 1]), x);
    return fabs(om_dot(side[0], om_cross(side[1], side[2]))) / 6;
}

// ---- rounds ----------------------------------------------------------------------------------------------

static OmStatus mark_edges(const OmLattice* l, const Bins* bins, OmEdgeTable* marked) {
    for (int e = 0; e < l->ntet; e++) {
        const double a = asked_edge(l, bins, l->tet[e]) * OM__LATTICE_LONGEST;
        const Edge m = longest_edge(l, l->tet[e]);
        if (find_volume(l, l->tet[e]) >
            1.001 * a * a * a / 12)  // of an element of a lattice of cubes a
            OM_TRY(om__edge_add(marked, m.lo, m.hi));
    }
    for (int before = -1; before < marked->nedge;) {
        before = marked->nedge;
        for (int e = 0; e < l->ntet; e++) {
            bool has_mark = false;
            for (int k = 0; k < 6 && !has_mark; k++) {
                const Edge m = edge_of(l->tet[e], k);
                has_mark = om__edge_find(marked, m.lo, m.hi) >= 0;
            }
            if (!has_mark) continue;
            const Edge longest = longest_edge(l, l->tet[e]);
            OM_TRY(om__edge_add(marked, longest.lo, longest.hi));
        }
    }
    return OM_OK;
}

// The midpoints of the marked edges become points: that of mark i is l->npoint + i before the call.
static OmStatus add_middles(OmLattice* l, const OmEdgeTable* marked) {
    const int old = l->npoint, nmiddle = old - l->nlattice;
    const OmStuffDef* def = l->def;
    double* f = om_realloc(l->f, (size_t)old, (size_t)old + (size_t)marked->nedge, sizeof *f);
    if (!f) return OM_NO_MEMORY;
    l->f = f;
    OmVec3* middle = om_realloc(l->middle, (size_t)nmiddle, (size_t)nmiddle + (size_t)marked->nedge,
                                sizeof *middle);
    if (!middle) return OM_NO_MEMORY;
    l->middle = middle;
    for (int i = 0; i < marked->nedge; i++) {
        const OmVec3 x = om_lerp(om__lattice_position(l, marked->end[i][0]),
                                 om__lattice_position(l, marked->end[i][1]), 0.5);
        const double far = 0.5 * l->a;  // the solid is cut off at the box
        const bool is_out = x.x < def->lo.x - far || x.y < def->lo.y - far ||
                            x.z < def->lo.z - far || x.x > def->hi.x + far ||
                            x.y > def->hi.y + far || x.z > def->hi.z + far;
        l->middle[nmiddle + i] = x;
        l->f[old + i] = om__lattice_eval(l, x);
        if (is_out && l->f[old + i] <= 0) l->f[old + i] = l->a;
    }
    return OM_OK;
}

// Append the parts of a tetrahedron: halved at its longest marked edge, and the halves likewise.
static OmStatus split_tet(OmLattice* l, const OmEdgeTable* marked, const int p[4]) {
    Edge longest = {-1, -1};
    int at = -1;
    for (int k = 0; k < 6; k++) {
        const Edge m = edge_of(p, k);
        const int i = m.hi < l->npoint ? om__edge_find(marked, m.lo, m.hi) : -1;
        if (i < 0 || (at >= 0 && !is_before(l, m, longest))) continue;
        longest = m;
        at = i;
    }
    if (at < 0) return om__lattice_add_tet(l, p);
    for (int side = 0; side < 2; side++) {
        int half[4];
        for (int c = 0; c < 4; c++)
            half[c] = p[c] == (side ? longest.lo : longest.hi) ? l->npoint + at : p[c];
        OM_TRY(split_tet(l, marked, half));
    }
    return OM_OK;
}

static OmStatus split_tets(OmLattice* l, const OmEdgeTable* marked) {
    OmStatus status = OM_OK;
    int(*old)[4] = l->tet;
    const int nold = l->ntet;
    l->tet = NULL;
    l->ntet = l->cap_tet = 0;
    for (int e = 0; e < nold; e++) OM_TRY_DONE(split_tet(l, marked, old[e]));
    OM_CHECK_DONE(l->ntet / 4 <= l->def->max_tet, OM_INVALID,
                  "the fine edges give more than %d tetrahedra: use larger ones", l->def->max_tet);
    l->npoint += marked->nedge;
done:
    om_free(old);
    return status;
}

OmStatus om__lattice_grade(OmLattice* l) {
    OmStatus status = OM_OK;
    Bins bins = {0};
    OmEdgeTable marked = {0};
    OM_TRY_DONE(fill_bins(l, &bins));
    for (int round = 0; round < MAX_ROUND; round++) {
        OM_TRY_DONE(mark_edges(l, &bins, &marked));
        if (marked.nedge == 0) break;
        OM_TRY_DONE(add_middles(l, &marked));
        OM_TRY_DONE(split_tets(l, &marked));
        om__edge_table_done(&marked);
    }
done:
    om_free(bins.adr);
    om_free(bins.list);
    om__edge_table_done(&marked);
    return status;
}
