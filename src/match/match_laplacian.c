// match_laplacian.c: the Laplacian of any set of triangles, after Sharp and Crane, "A Laplacian for Nonmanifold
// Triangle Meshes" (2020).
//
// Each triangle gets a front and a back. Around an edge with n triangles the front of one is glued to the back of the
// next, in a circle, so that every edge of the cover has two sides: also at an open edge, where a front meets its own
// back, and where three triangles meet. Vertices keep their numbers. The cover is closed, so edges may be flipped until
// each is intrinsic Delaunay: then the cotangent weight of each edge is not negative, and the matrix has a maximum
// principle, which the cotangents of a thin triangle in space do not give. Lengths replace positions from there on. A
// small length is added to all edges first, so that triangles without area become thin ones ("mollification").
// Each part of the surface is covered twice: half of the cover's matrix is the Laplacian.
//
// Half-edges: triangle f has 3 f, 3 f + 1, 3 f + 2, the next one counter-clockwise. tail[h] is the first vertex,
// twin[h] the other side, length[h] the length in m. A flip moves six half-edges within the slots of two triangles.
#include <math.h>
#include <string.h>

#include "match/match_spectral_internal.h"

#define MOLLIFICATION 1e-5  // of the mean length; as in the authors' code
#define DELAUNAY 1e-9       // a sum of two cotangents above -DELAUNAY counts as Delaunay
#define MIN_EDGE 1e-30      // m, of the mean; 1 / MIN_EDGE at most

typedef struct Cover {
    int nvert, nface;
    int *tail, *twin;  // (3 nface)
    double* length;    // m                          (3 nface)
    int nflip;
} Cover;

static int next_of(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
static int prev_of(int h) { return h % 3 == 0 ? h + 2 : h - 1; }
static int head_of(const Cover* c, int h) { return c->tail[next_of(h)]; }

static void cover_done(Cover* c) {
    om_free(c->tail);
    om_free(c->twin);
    om_free(c->length);
}

// ---- the cover --------------------------------------------------------------------------------------

// The side of front half-edge h that runs from the smaller to the larger vertex, or the other one.
static int side_of(const Cover* c, int h, bool is_upward) {
    if ((c->tail[h] < head_of(c, h)) == is_upward) return h;
    return 3 * (c->nface / 2 + h / 3) + 2 - h % 3;
}

static void glue(Cover* c, int h, int g) {
    int up = side_of(c, h, true), down = side_of(c, g, false);
    c->twin[up] = down;
    c->twin[down] = up;
}

// Glue the triangles around each edge in a circle. `list` chains the half-edges by their smaller vertex.
static OmStatus glue_edges(Cover* c) {
    OmStatus status = OM_OK;
    int nfront = c->nface / 2 * 3;
    int *first_of = NULL, *chain = NULL, *first = NULL, *last = NULL, *stamp = NULL;
    OM_ALLOC_DONE(first_of, c->nvert);
    OM_ALLOC_DONE(chain, nfront);
    OM_ALLOC_DONE(first, c->nvert);
    OM_ALLOC_DONE(last, c->nvert);
    OM_ALLOC_DONE(stamp, c->nvert);
    for (int v = 0; v < c->nvert; ++v) first_of[v] = stamp[v] = -1;
    for (int h = nfront - 1; h >= 0; --h) {
        int i = c->tail[h], j = head_of(c, h), low = i < j ? i : j;
        chain[h] = first_of[low];
        first_of[low] = h;
    }
    for (int v = 0; v < c->nvert; ++v) {
        for (int h = first_of[v]; h >= 0; h = chain[h]) {
            int other = c->tail[h] == v ? head_of(c, h) : c->tail[h];
            if (stamp[other] == v)
                glue(c, last[other], h);
            else
                first[other] = h;
            stamp[other] = v;
            last[other] = h;
        }
        for (int h = first_of[v]; h >= 0; h = chain[h]) {  // close the circles
            int other = c->tail[h] == v ? head_of(c, h) : c->tail[h];
            if (last[other] == h) glue(c, h, first[other]);
        }
    }
done:
    om_free(first_of);
    om_free(chain);
    om_free(first);
    om_free(last);
    om_free(stamp);
    return status;
}

static OmStatus cover_init(int nvert, const double* x, int ntri, const int* tri_vert, Cover* c) {
    OmStatus status = OM_OK;
    int num = 0;
    OM_ALLOC_DONE(c->tail, 6 * (size_t)ntri);
    OM_ALLOC_DONE(c->twin, 6 * (size_t)ntri);
    OM_ALLOC_DONE(c->length, 6 * (size_t)ntri);
    for (int t = 0; t < ntri; ++t) {
        const int* v = tri_vert + 3 * (size_t)t;
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
        for (int k = 0; k < 3; ++k) c->tail[3 * num + k] = v[k];
        ++num;
    }
    OM_CHECK_DONE(num > 0, OM_INVALID, "Laplacian: no triangle has three different vertices");
    c->nvert = nvert;
    c->nface = 2 * num;
    for (int f = 0; f < num; ++f)  // the back: 0 2 1
        for (int k = 0; k < 3; ++k) c->tail[3 * (num + f) + k] = c->tail[3 * f + (3 - k) % 3];
    for (int h = 0; h < 6 * num; ++h)
        c->length[h] = om_norm(om_sub(om_load3(x, head_of(c, h)), om_load3(x, c->tail[h])));
    OM_TRY_DONE(glue_edges(c));
done:
    return status;
}

// ---- lengths ----------------------------------------------------------------------------------------

// Twice the area of the triangle of half-edge h; Kahan's form of Heron's formula, for thin triangles.
static double double_area(const Cover* c, int h) {
    double a = c->length[h], b = c->length[next_of(h)], d = c->length[prev_of(h)], swap;
    if (a < b) swap = a, a = b, b = swap;
    if (b < d) swap = b, b = d, d = swap;
    if (a < b) swap = a, a = b, b = swap;
    double product = (a + (b + d)) * (d - (a - b)) * (d + (a - b)) * (a + (b - d));
    return product > 0 ? 0.5 * sqrt(product) : 0;
}

// Cotangent of the angle opposite to h. A flip can only lose area to rounding: 0 then counts as tiny.
static double cotangent(const Cover* c, int h) {
    double a = c->length[h], b = c->length[next_of(h)], d = c->length[prev_of(h)];
    double area = fmax(double_area(c, h), 1e-14 * (b * b + d * d));
    return 0.5 * (b * b + d * d - a * a) / area;
}

static double mollify(Cover* c) {
    double mean = 0, added = 0;
    int nhalf = 3 * c->nface;
    for (int h = 0; h < nhalf; ++h) mean += c->length[h] / nhalf;
    for (int h = 0; h < nhalf; ++h)
        added = fmax(added, MOLLIFICATION * mean -
                                (c->length[next_of(h)] + c->length[prev_of(h)] - c->length[h]));
    for (int h = 0; h < nhalf; ++h) c->length[h] += added;
    return added;
}

// ---- flips ------------------------------------------------------------------------------------------

// Length of the other diagonal of the two triangles at h, laid out in a plane.
static double other_diagonal(const Cover* c, int h) {
    int t = c->twin[h];
    double d = c->length[h], base[2], height[2];  // d > 0 after mollification
    for (int s = 0; s < 2; ++s) {
        // the lengths from the tail of h and from its head to the third vertex
        double from_tail = c->length[s == 0 ? prev_of(h) : next_of(t)];
        double from_head = c->length[s == 0 ? next_of(h) : prev_of(t)];
        base[s] = (d * d + from_tail * from_tail - from_head * from_head) / (2 * d);
        height[s] = double_area(c, s == 0 ? h : t) / d;
    }
    return hypot(base[0] - base[1], height[0] + height[1]);
}

// Replace edge h, i j between k and l, by k l. The slots become [k l, l j, j k] and [l k, k i, i l].
static void flip(Cover* c, int h) {
    int t = c->twin[h];
    double diagonal = other_diagonal(c, h);
    const int from[4] = {prev_of(t), next_of(h), prev_of(h), next_of(t)};  // l j, j k, k i, i l
    const int to[4] = {next_of(h), prev_of(h), next_of(t), prev_of(t)};
    int tail[4], twin[4], k = c->tail[prev_of(h)], l = c->tail[prev_of(t)];
    double length[4];
    for (int e = 0; e < 4; ++e) {
        tail[e] = c->tail[from[e]];
        twin[e] = c->twin[from[e]];
        length[e] = c->length[from[e]];
        for (int g = 0; g < 4; ++g)  // the other side may move, too
            if (c->twin[from[e]] == from[g]) twin[e] = to[g];
    }
    for (int e = 0; e < 4; ++e) {
        c->tail[to[e]] = tail[e];
        c->length[to[e]] = length[e];
        c->twin[to[e]] = twin[e];
        c->twin[twin[e]] = to[e];
    }
    c->tail[h] = k;
    c->tail[t] = l;
    c->length[h] = c->length[t] = diagonal;
    ++c->nflip;
}

// Flip edges until each is Delaunay. Every flip lowers the Dirichlet energy of every function, so the loop ends; the
// bound is for rounding.
static OmStatus make_delaunay(Cover* c) {
    OmStatus status = OM_OK;
    int nhalf = 3 * c->nface, *stack = NULL, num = 0;
    unsigned char* is_in = NULL;
    int64_t left = 100 * (int64_t)nhalf;
    OM_ALLOC_DONE(stack, nhalf);
    OM_CALLOC_DONE(is_in, nhalf);
    for (int h = nhalf - 1; h >= 0; --h) {
        if (h > c->twin[h]) continue;
        stack[num++] = h;
        is_in[h] = 1;
    }
    while (num > 0 && left-- > 0) {
        int h = stack[--num], t = c->twin[h];
        is_in[h] = 0;
        if (t / 3 == h / 3 || cotangent(c, h) + cotangent(c, t) >= -DELAUNAY) continue;
        flip(c, h);
        const int around[4] = {next_of(h), prev_of(h), next_of(t), prev_of(t)};
        for (int e = 0; e < 4; ++e) {
            int low = around[e] < c->twin[around[e]] ? around[e] : c->twin[around[e]];
            if (is_in[low]) continue;
            stack[num++] = low;
            is_in[low] = 1;
        }
    }
    OM_CHECK_DONE(num == 0, OM_INVALID, "Laplacian: %d edges are still not Delaunay after %d flips",
                  num, c->nflip);
done:
    om_free(stack);
    om_free(is_in);
    return status;
}

// ---- the matrix -------------------------------------------------------------------------------------

// Half of the cover, times `scale`.
static OmStatus assemble(const Cover* c, double scale, OmLaplacian* out) {
    OmStatus status = OM_OK;
    int nhalf = 3 * c->nface, num = 0, *row = NULL, *col = NULL;
    double* value = NULL;
    OM_CHECK(nhalf < INT32_MAX / 2, OM_INVALID, "Laplacian: too many triangles");
    OM_ALLOC_DONE(row, 2 * (size_t)nhalf + (size_t)c->nvert);
    OM_ALLOC_DONE(col, 2 * (size_t)nhalf + (size_t)c->nvert);
    OM_ALLOC_DONE(value, 2 * (size_t)nhalf + (size_t)c->nvert);
    OM_CALLOC_DONE(out->area, c->nvert);
    for (int h = 0; h < nhalf; ++h) {
        int i = c->tail[h], j = head_of(c, h), t = c->twin[h];
        double corner = 0.5 * scale * double_area(c, h) / 6;
        out->area[i] += corner;
        out->total_area += corner;
        if (h > t || i == j) continue;
        // an edge whose two sides lie in one triangle may have a negative sum; a loop there has no other weight
        double w = 0.25 * scale * fmax(0, cotangent(c, h) + cotangent(c, t));
        const double entry[4] = {w, w, -w, -w};
        for (int e = 0; e < 4; ++e, ++num) {
            row[num] = e == 0 || e == 2 ? i : j;
            col[num] = e == 0 || e == 3 ? i : j;
            value[num] = entry[e];
        }
    }
    for (int i = 0; i < c->nvert; ++i, ++num) {  // a diagonal also where no triangle is
        row[num] = col[num] = i;
        value[num] = 0;
    }
    OM_TRY_DONE(om_csr_init(c->nvert, num, row, col, value, &out->stiffness));
done:
    om_free(row);
    om_free(col);
    om_free(value);
    return status;
}

OmStatus om__laplacian_init(int nvert, const double* x, int ntri, const int* tri_vert, double scale,
                            OmLaplacian* out) {
    memset(out, 0, sizeof *out);
    OM_CHECK(nvert > 0 && ntri > 0 && ntri < INT32_MAX / 12, OM_INVALID,
             "Laplacian: %d vertices and %d triangles", nvert, ntri);
    for (int i = 0; i < nvert; ++i)
        OM_CHECK(om_is_finite3(om_load3(x, i)), OM_INVALID, "Laplacian: vertex %d is not finite",
                 i);
    for (int k = 0; k < 3 * ntri; ++k)
        OM_CHECK(tri_vert[k] >= 0 && tri_vert[k] < nvert, OM_INVALID,
                 "Laplacian: triangle %d has vertex %d of %d", k / 3, tri_vert[k], nvert);
    OmStatus status = OM_OK;
    Cover c = {0};
    OM_TRY_DONE(cover_init(nvert, x, ntri, tri_vert, &c));
    double largest = 0, edge = 0, mean = 0;
    for (int h = 0; h < 3 * c.nface; h += 3) largest = fmax(largest, double_area(&c, h));
    for (int h = 0; h < 3 * c.nface; ++h) {
        edge = fmax(edge, c.length[h]);
        mean += c.length[h] / (3.0 * c.nface);
    }
    OM_CHECK_DONE(largest > 1e-12 * edge * edge && isfinite(edge * edge), OM_INVALID,
                  "Laplacian: no triangle has an area");
    OM_CHECK_DONE(mean >= MIN_EDGE && mean <= 1 / MIN_EDGE, OM_INVALID,
                  "Laplacian: the mean edge is %g m; %g to %g", mean, MIN_EDGE, 1 / MIN_EDGE);
    out->added = mollify(&c);
    OM_TRY_DONE(make_delaunay(&c));
    out->nflip = c.nflip;
    OM_TRY_DONE(assemble(&c, scale, out));
done:
    cover_done(&c);
    if (status < 0) om_laplacian_done(out);
    return status;
}

OmStatus om_laplacian_init(int nvert, const double* x, int ntri, const int* tri_vert,
                           OmLaplacian* laplacian) {
    return om__laplacian_init(nvert, x, ntri, tri_vert, 1, laplacian);
}

void om_laplacian_done(OmLaplacian* laplacian) {
    if (!laplacian) return;
    om_csr_done(&laplacian->stiffness);
    om_free(laplacian->area);
    memset(laplacian, 0, sizeof *laplacian);
}
