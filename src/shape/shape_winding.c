// shape_winding.c: generalised winding numbers, and what they say about the solid within triangles.
//
// The winding number of a point is the sum of the solid angles of all triangles over 4 pi (Jacobson 2013): an integer
// where the surface is closed, a smooth number between where it has gaps. Triangles are in a tree of boxes; a group
// farther away than three of its radii counts as one dipole (Barill 2018), which errs by less than 0.05.
//
// Of a closed surface the crossings along a ray give the same integer exactly: om__surface_measure integrates the
// length of rays within the solid. Volumes by the divergence theorem count an overlap twice and are not used there.
#include "shape/shape_winding.h"

#include <stdlib.h>
#include <string.h>

#include "shape/shape_internal.h"

#define LEAF 8
#define FAR 3.0           // radii of a group from which it counts as a dipole
#define MAX_CROSSING 1e6  // of rays with boxes of triangles: fewer rays otherwise
#define PI 3.14159265358979323846

// ---- the tree -----------------------------------------------------------------------------------------

static int build(OmWinding* w, const double* center, int begin, int end) {
    int index = w->nnode++;
    w->node[index] = (OmWindingNode){.begin = begin, .end = end, .right = -1};
    if (end - begin <= LEAF) return index;
    int middle = begin + (end - begin) / 2;
    int axis = om__points_longest_side(center, w->order, begin, end);
    om__points_select(center, w->order, begin, end, middle, axis);
    build(w, center, begin, middle);
    int right = build(w, center, middle, end);
    w->node[index].right = right;
    return index;
}

// Boxes and dipoles of a node from its corners.
static void sum_node(OmWinding* w, OmWindingNode* n) {
    OmVec3 lo = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), hi = om_scale(-1, lo);
    OmVec3 sum = om_vec3(0, 0, 0), plain = sum;
    double area = 0, count = 3.0 * (n->end - n->begin);
    n->normal = sum;
    for (int i = n->begin; i < n->end; i++) {
        OmVec3 a = om_load3(w->corner, 3 * i), b = om_load3(w->corner, 3 * i + 1),
               c = om_load3(w->corner, 3 * i + 2);
        OmVec3 normal = om_scale(0.5, om_cross(om_sub(b, a), om_sub(c, a)));
        OmVec3 three = om_add(a, om_add(b, c));
        double size = om_norm(normal);
        n->normal = om_add(n->normal, normal);
        sum = om_madd(sum, size / 3, three);
        plain = om_add(plain, three);
        area += size;
        lo = om_min3(lo, om_min3(a, om_min3(b, c)));
        hi = om_max3(hi, om_max3(a, om_max3(b, c)));
    }
    n->center = area > 0 ? om_scale(1 / area, sum) : om_scale(1 / count, plain);
    n->radius = 0;
    for (int i = 3 * n->begin; i < 3 * n->end; i++)
        n->radius = fmax(n->radius, om_distance(n->center, om_load3(w->corner, i)));
    memcpy(n->lo, &lo, sizeof n->lo);
    memcpy(n->hi, &hi, sizeof n->hi);
}

OmStatus om__winding_init(const OmSurface* s, const int* list, int nlist, OmWinding* w) {
    OmStatus status = OM_OK;
    double* center = NULL;
    const int ntri = list ? nlist : s->ntri;
    *w = (OmWinding){.ntri = ntri};
    OM_ALLOC_DONE(center, 3 * (size_t)s->ntri);
    OM_ALLOC_DONE(w->order, ntri);
    OM_ALLOC_DONE(w->corner, 9 * (size_t)ntri);
    OM_ALLOC_DONE(w->node, 2 * (size_t)ntri + 1);
    for (int i = 0; i < ntri; i++) {
        const int t = list ? list[i] : i;
        const int* v = s->tri_vert + 3 * (size_t)t;
        w->order[i] = t;
        OmVec3 sum = om_add(om_load3(s->x, v[0]), om_load3(s->x, v[1]));
        om_store3(center, t, om_add(sum, om_load3(s->x, v[2])));
    }
    if (ntri > 0) build(w, center, 0, ntri);
    for (int i = 0; i < ntri; i++)
        for (int c = 0; c < 3; c++)
            om_store3(w->corner, 3 * i + c,
                      om_load3(s->x, s->tri_vert[3 * (size_t)w->order[i] + (size_t)c]));
    for (int i = 0; i < w->nnode; i++) sum_node(w, &w->node[i]);
done:
    om_free(center);
    if (status < 0) om__winding_done(w);
    return status;
}

void om__winding_done(OmWinding* w) {
    om_free(w->order);
    om_free(w->corner);
    om_free(w->node);
    memset(w, 0, sizeof *w);
}

// Half the solid angle of a triangle (van Oosterom and Strackee 1983).
static double half_angle(const double* corner, OmVec3 p) {
    OmVec3 a = om_sub(om_load3(corner, 0), p), b = om_sub(om_load3(corner, 1), p),
           c = om_sub(om_load3(corner, 2), p);
    double la = om_norm(a), lb = om_norm(b), lc = om_norm(c);
    double top = om_dot(a, om_cross(b, c));
    double bottom = la * lb * lc + om_dot(a, b) * lc + om_dot(b, c) * la + om_dot(c, a) * lb;
    return top == 0 ? 0 : atan2(top, bottom);
}

double om__winding_at(const OmWinding* w, OmVec3 p) {
    double angle = 0, dipole = 0;
    int stack[96], nstack = 0;  // medians halve: the depth is below 32
    if (w->nnode > 0) stack[nstack++] = 0;
    while (nstack > 0) {
        const int index = stack[--nstack];
        const OmWindingNode* n = &w->node[index];
        OmVec3 d = om_sub(n->center, p);
        double r2 = om_norm2(d);
        if (r2 > FAR * FAR * n->radius * n->radius && r2 > 0) {
            dipole += om_dot(n->normal, d) / (r2 * sqrt(r2));
        } else if (n->right < 0) {
            for (int i = n->begin; i < n->end; i++)
                angle += half_angle(w->corner + 9 * (size_t)i, p);
        } else {
            stack[nstack++] = n->right;
            stack[nstack++] = index + 1;
        }
    }
    return (2 * angle + dipole) / (4 * PI);
}

// ---- the solid along rays -------------------------------------------------------------------------------

typedef struct Crossing {
    double at;
    int ray, sign;
} Crossing;

static int compare_crossings(const void* a, const void* b) {
    const Crossing *p = a, *q = b;
    if (p->ray != q->ray) return p->ray < q->ray ? -1 : 1;
    if (p->at != q->at) return p->at < q->at ? -1 : 1;
    return q->sign - p->sign;  // entering before leaving: no gap between two walls at one place
}

typedef struct Rays {  // a lattice of n x n rays along `axis`
    const OmSurface* s;
    int axis, n;
    double origin[2], step[2];  // across
} Rays;

// The rays that the box of a triangle meets: first and last index in both directions.
static void ray_box(const Rays* r, const int* v, int from[2], int to[2]) {
    for (int k = 0; k < 2; k++) {
        const int axis = (r->axis + 1 + k) % 3;
        double a = r->s->x[3 * (size_t)v[0] + (size_t)axis],
               b = r->s->x[3 * (size_t)v[1] + (size_t)axis],
               c = r->s->x[3 * (size_t)v[2] + (size_t)axis];
        double first = ceil((fmin(a, fmin(b, c)) - r->origin[k]) / r->step[k]);
        double last = floor((fmax(a, fmax(b, c)) - r->origin[k]) / r->step[k]);
        from[k] = (int)fmax(first, 0);
        to[k] = (int)fmin(last, r->n - 1);
    }
}

static double count_boxes(const Rays* r) {
    double sum = 0;
    for (int t = 0; t < r->s->ntri; t++) {
        int from[2], to[2];
        ray_box(r, r->s->tri_vert + 3 * (size_t)t, from, to);
        sum += fmax(0, to[0] - from[0] + 1) * fmax(0, to[1] - from[1] + 1);
    }
    return sum;
}

// The crossings of all rays, unsorted; returns their number. A null `out` counts.
static int64_t find_crossings(const Rays* r, Crossing* out) {
    const OmSurface* s = r->s;
    const int u = (r->axis + 1) % 3, w = (r->axis + 2) % 3;
    int64_t num = 0;
    for (int t = 0; t < s->ntri; t++) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        int from[2], to[2];
        ray_box(r, v, from, to);
        for (int iu = from[0]; iu <= to[0]; iu++) {
            for (int iw = from[1]; iw <= to[1]; iw++) {
                double pu = r->origin[0] + r->step[0] * iu, pw = r->origin[1] + r->step[1] * iw;
                double e0 = om__edge_side(s->x, v[1], v[2], u, w, pu, pw);
                double e1 = om__edge_side(s->x, v[2], v[0], u, w, pu, pw);
                double e2 = om__edge_side(s->x, v[0], v[1], u, w, pu, pw);
                bool is_front = e0 > 0 && e1 > 0 && e2 > 0;
                if (!is_front && !(e0 < 0 && e1 < 0 && e2 < 0)) continue;
                if (out) {
                    const double* x = s->x + r->axis;
                    double sum = e0 + e1 + e2;  // not zero: all have one sign
                    double at = (e0 * x[3 * (size_t)v[0]] + e1 * x[3 * (size_t)v[1]] +
                                 e2 * x[3 * (size_t)v[2]]) /
                                sum;
                    out[num] = (Crossing){at, iu * r->n + iw, is_front ? -1 : 1};
                }
                num++;
            }
        }
    }
    return num;
}

static OmVec3 ray_point(const Rays* r, int ray, double at) {
    double p[3];
    p[r->axis] = at;
    p[(r->axis + 1) % 3] = r->origin[0] + r->step[0] * (ray / r->n);
    p[(r->axis + 2) % 3] = r->origin[1] + r->step[1] * (ray % r->n);
    return om_vec3(p[0], p[1], p[2]);
}

typedef struct Longest {
    double overlap, negative;
    OmVec3 overlap_place, negative_place;
} Longest;

// Add the lengths along one ray; a ray through a gap, whose crossings do not cancel, counts as empty.
static bool add_ray(const Rays* r, const Crossing* c, int64_t num, OmSolidMeasure* m,
                    Longest* longest) {
    int winding = 0;
    for (int64_t i = 0; i < num; i++) winding += c[i].sign;
    if (winding != 0) return false;
    for (int64_t i = 0; i + 1 < num; i++) {
        winding += c[i].sign;
        double length = c[i + 1].at - c[i].at, middle = 0.5 * (c[i + 1].at + c[i].at);
        if (winding > 0) m->volume += length;
        if (winding > 1) m->overlap += length * (winding - 1);
        if (winding < 0) m->negative += length;
        if (winding > 1 && length > longest->overlap) {
            longest->overlap = length;
            longest->overlap_place = ray_point(r, c[i].ray, middle);
        }
        if (winding < 0 && length > longest->negative) {
            longest->negative = length;
            longest->negative_place = ray_point(r, c[i].ray, middle);
        }
    }
    return true;
}

static OmStatus measure_axis(const Rays* r, OmSolidMeasure* out, Longest* longest) {
    OmStatus status = OM_OK;
    Crossing* c = NULL;
    OmSolidMeasure m = {0};
    double nray = 0, nwhole = 0;
    const int64_t num = find_crossings(r, NULL);
    OM_ALLOC_DONE(c, (size_t)num + 1);
    find_crossings(r, c);
    qsort(c, (size_t)num, sizeof *c, compare_crossings);
    for (int64_t begin = 0, end; begin < num; begin = end) {
        for (end = begin; end < num && c[end].ray == c[begin].ray;) end++;
        nray++;
        nwhole += add_ray(r, c + begin, end - begin, &m, longest);
    }
    // rays through gaps are replaced by the others
    const double area = nwhole > 0 ? r->step[0] * r->step[1] * nray / nwhole : 0;
    out->volume += area * m.volume / 3;
    out->overlap += area * m.overlap / 3;
    out->negative += area * m.negative / 3;
done:
    om_free(c);
    return status;
}

OmStatus om__surface_measure(const OmSurface* s, int n, OmSolidMeasure* out) {
    OmVec3 lo = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), hi = om_scale(-1, lo);
    Longest longest = {0};
    *out = (OmSolidMeasure){0};
    for (int i = 0; i < 3 * s->ntri; i++) {
        lo = om_min3(lo, om_load3(s->x, s->tri_vert[i]));
        hi = om_max3(hi, om_load3(s->x, s->tri_vert[i]));
    }
    const double low[3] = {lo.x, lo.y, lo.z}, high[3] = {hi.x, hi.y, hi.z};
    for (int axis = 0; axis < 3; axis++) {
        Rays r = {.s = s, .axis = axis, .n = n};
        for (;; r.n /= 2) {
            for (int k = 0; k < 2; k++) {
                const int a = (axis + 1 + k) % 3;
                r.step[k] = (high[a] - low[a]) / r.n;
                if (!(r.step[k] > 0)) return OM_OK;  // flat: it holds nothing
                r.origin[k] = low[a] + (k ? 0.5137 : 0.4871) * r.step[k];
            }
            if (r.n <= 8 || count_boxes(&r) <= MAX_CROSSING) break;
        }
        OM_TRY(measure_axis(&r, out, &longest));
    }
    out->place = longest.overlap > 0 ? longest.overlap_place : longest.negative_place;
    return OM_OK;
}

// ---- the visible part ------------------------------------------------------------------------------------

typedef struct Pieces {  // of triangles
    const OmWinding* winding;
    const OmGrid* grid;
    const unsigned char* node;  // OM__NODE_ bits
    double step;
    OmVec3* x;  // three corners each; doubled when full
    int num, cap;
} Pieces;

static bool separates(const Pieces* p, OmVec3 at, OmVec3 normal) {
    double above = om__winding_at(p->winding, om_madd(at, 1e-3 * p->step, normal));
    double below = om__winding_at(p->winding, om_madd(at, -1e-3 * p->step, normal));
    return (above > 0.5) != (below > 0.5);
}

static OmStatus add_piece(Pieces* p, OmVec3 a, OmVec3 b, OmVec3 c) {
    if (p->num == p->cap) {
        const int cap = p->cap ? 2 * p->cap : 256;
        OM_CHECK(cap < 1 << 28, OM_INVALID, "the surface has too many pieces");
        OmVec3* x = om_alloc(3 * (size_t)cap, sizeof *x);
        if (!x) return OM_NO_MEMORY;
        if (p->num) memcpy(x, p->x, 3 * (size_t)p->num * sizeof *x);
        om_free(p->x);
        p->x = x;
        p->cap = cap;
    }
    OmVec3* at = p->x + 3 * (size_t)p->num++;
    at[0] = a, at[1] = b, at[2] = c;
    return OM_OK;
}

// What the nodes within a cell of the box of a piece say: 1 it is visible, 0 it is not, -1 they do not know.
static int ask_nodes(const Pieces* p, OmVec3 a, OmVec3 b, OmVec3 c) {
    const OmVec3 o = p->grid->origin, lo = om_sub(om_min3(a, om_min3(b, c)), o),
                 hi = om_sub(om_max3(a, om_max3(b, c)), o);
    const double l[3] = {lo.x, lo.y, lo.z}, u[3] = {hi.x, hi.y, hi.z};
    int from[3], to[3], all = OM__NODE_INSIDE, any = 0;
    for (int k = 0; k < 3; k++) {
        from[k] = (int)fmax(floor(l[k] / p->step) - 1, 0);
        to[k] = (int)fmin(ceil(u[k] / p->step) + 1, p->grid->dim[k] - 1);
        if (from[k] > to[k]) return -1;  // off the grid
    }
    for (int k = from[2]; k <= to[2]; k++) {
        for (int j = from[1]; j <= to[1]; j++) {
            const unsigned char* row = p->node + om_grid_index(p->grid->dim, 0, j, k);
            for (int i = from[0]; i <= to[0]; i++) all &= row[i], any |= row[i];
        }
    }
    return !(any & OM__NODE_FOLDED) ? 1 : all ? 0 : -1;
}

// Split until a piece is at most 2 steps long and its centre and three points near the corners agree, or it is a
// quarter of a step long.
static OmStatus add_visible(Pieces* p, OmVec3 a, OmVec3 b, OmVec3 c, int depth) {
    OmVec3 area = om_cross(om_sub(b, a), om_sub(c, a));
    double length = fmax(om_distance(a, b), fmax(om_distance(b, c), om_distance(c, a)));
    if (!(om_norm(area) > 0)) return OM_OK;
    if (length <= 2 * p->step || depth == 0) {
        const int known = ask_nodes(p, a, b, c);
        if (known >= 0) return known ? add_piece(p, a, b, c) : OM_OK;
        OmVec3 normal = om_normalize(area), middle = om_scale(1.0 / 3, om_add(a, om_add(b, c)));
        int num = separates(p, middle, normal);
        if (length <= 0.25 * p->step || depth == 0) return num ? add_piece(p, a, b, c) : OM_OK;
        num += separates(p, om_lerp(middle, a, 0.9), normal);
        num += separates(p, om_lerp(middle, b, 0.9), normal);
        num += separates(p, om_lerp(middle, c, 0.9), normal);
        if (num == 0) return OM_OK;
        if (num == 4) return add_piece(p, a, b, c);
    }
    OmVec3 ab = om_lerp(a, b, 0.5), bc = om_lerp(b, c, 0.5), ca = om_lerp(c, a, 0.5);
    OM_TRY(add_visible(p, a, ab, ca, depth - 1));
    OM_TRY(add_visible(p, ab, b, bc, depth - 1));
    OM_TRY(add_visible(p, ca, bc, c, depth - 1));
    return add_visible(p, ab, bc, ca, depth - 1);
}

typedef struct VisibleTask {
    const OmSurface* s;
    const OmWinding* winding;
    const OmGrid* grid;
    const unsigned char* node;
    int chunk;
    Pieces* out;       // of each chunk of triangles
    OmStatus* status;  // of each chunk
} VisibleTask;

static void find_chunks(void* ctx, int begin, int end, int block) {
    (void)block;
    const VisibleTask* task = ctx;
    const OmSurface* s = task->s;
    for (int k = begin; k < end; k++) {
        Pieces* p = &task->out[k];
        *p = (Pieces){task->winding, task->grid, task->node, task->grid->spacing, NULL, 0, 0};
        int last = task->chunk * (k + 1) < s->ntri ? task->chunk * (k + 1) : s->ntri;
        for (int t = task->chunk * k; t < last && task->status[k] == OM_OK; t++) {
            const int* v = s->tri_vert + 3 * (size_t)t;
            task->status[k] = add_visible(p, om_load3(s->x, v[0]), om_load3(s->x, v[1]),
                                          om_load3(s->x, v[2]), 10);
        }
    }
}

OmStatus om__surface_visible(const OmSurface* s, const OmGrid* grid, const unsigned char* node,
                             OmSurface* visible) {
    OmStatus status = OM_OK;
    OmWinding winding = {0};
    VisibleTask task = {.s = s, .winding = &winding, .grid = grid, .node = node, .chunk = 256};
    const int nchunk = (s->ntri + task.chunk - 1) / task.chunk;
    memset(visible, 0, sizeof *visible);
    OM_CALLOC_DONE(task.out, nchunk);
    OM_CALLOC_DONE(task.status, nchunk);
    OM_TRY_DONE(om__winding_init(s, NULL, 0, &winding));
    OM_TRY_DONE(om_parallel_for_stop(0, nchunk, 1, find_chunks, &task));
    int64_t num = 0;
    for (int k = 0; k < nchunk; k++) {
        if (task.status[k] < 0) OM_TRY_DONE(task.status[k]);
        num += task.out[k].num;
    }
    OM_CHECK_DONE(num < 1 << 28, OM_INVALID, "the surface has too many pieces");
    OM_TRY_DONE(om_surface_init(visible, (int)(3 * num), (int)num));
    int at = 0;
    for (int k = 0; k < nchunk; k++)
        for (int i = 0; i < 3 * task.out[k].num; i++) om_store3(visible->x, at++, task.out[k].x[i]);
    for (int i = 0; i < at; i++) visible->tri_vert[i] = i;
    if (num > 0) OM_TRY_DONE(om__surface_merge(visible, 1e-6 * grid->spacing));
done:
    for (int k = 0; task.out && k < nchunk; k++) om_free(task.out[k].x);
    om_free(task.out);
    om_free(task.status);
    om__winding_done(&winding);
    if (status < 0) om_surface_done(visible);
    return status;
}
