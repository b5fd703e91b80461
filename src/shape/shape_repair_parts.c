// shape_repair_parts.c: which side of each part is outside, which parts lie in others, which triangles cross.
//
// A part is a piece connected over edges of two triangles. Its parent is the smallest part that holds it; only the 64
// largest are looked at as parents. Downwards from the outermost parts: a part in empty space must face outwards, and
// is turned with all that lies in it where it does not, so that cavities stay cavities. In a filled part, a part that
// faces inwards is a cavity, one that faces outwards changes nothing.
#include <stdlib.h>
#include <string.h>

#include "shape/shape_repair_internal.h"
#include "shape/shape_winding.h"

#define MAX_PARENT 64
#define NSAMPLE 8  // triangles of a part that must all lie in its parent

typedef struct Part {
    int begin, end;  // of the triangles sorted by part
    double volume;   // signed, m^3
    OmVec3 lo, hi;
    bool is_closed;  // as many half edges forward as back
    int parent;      // -1: none
    int winding;     // within it, the parents' included
    bool is_turned;
} Part;

typedef struct Parts {
    int npart;
    Part* part;
    int* piece;  // of each triangle
    int* tri;    // triangles sorted by part
    int* order;  // parts by volume, the largest first
    int nparent;
    OmWinding parent[MAX_PARENT];  // of the first nparent of `order`, made when needed
} Parts;

static void parts_done(Parts* p) {
    for (int i = 0; i < MAX_PARENT; i++) om__winding_done(&p->parent[i]);
    om_free(p->part);
    om_free(p->piece);
    om_free(p->tri);
    om_free(p->order);
}

static void measure_part(const OmMend* m, const Parts* p, Part* part) {
    const OmVec3 o = om_load3(m->x, m->tri[3 * (size_t)p->tri[part->begin]]);
    part->lo = part->hi = o;
    for (int i = part->begin; i < part->end; i++) {
        const int* v = m->tri + 3 * (size_t)p->tri[i];
        OmVec3 a = om_load3(m->x, v[0]), b = om_load3(m->x, v[1]), c = om_load3(m->x, v[2]);
        part->lo = om_min3(part->lo, om_min3(a, om_min3(b, c)));
        part->hi = om_max3(part->hi, om_max3(a, om_max3(b, c)));
        part->volume += om_dot(om_sub(a, o), om_cross(om_sub(b, o), om_sub(c, o))) / 6;
    }
}

// Parts that do not close by themselves: the sum over the half edges of one part at an edge is not zero.
static void mark_open(const OmMendEdges* e, Parts* p) {
    for (int i = 0; i < e->nedge; i++) {
        const OmHalf* h = e->half + e->adr[i];
        const int n = om__edge_count(e, i);
        if (n == 2 && h[0].is_forward != h[1].is_forward) continue;
        for (int a = 0; a < n; a++) {
            int sum = 0;
            const int part = p->piece[h[a].corner / 3];
            // of very many triangles at one edge nothing can be said
            for (int b = 0; b < n && n <= 64; b++)
                if (p->piece[h[b].corner / 3] == part) sum += h[b].is_forward ? 1 : -1;
            if (sum != 0 || n > 64) p->part[part].is_closed = false;
        }
    }
}

typedef struct Ranked {
    double volume;
    int part;
} Ranked;

static int compare_ranked(const void* a, const void* b) {
    const Ranked *p = a, *q = b;
    if (p->volume != q->volume) return p->volume > q->volume ? -1 : 1;
    return p->part < q->part ? -1 : p->part > q->part;
}

static OmStatus find_parts(const OmMend* m, const OmMendEdges* e, Parts* p) {
    OmStatus status = OM_OK;
    Ranked* ranked = NULL;
    OM_ALLOC_DONE(p->piece, m->ntri);
    OM_ALLOC_DONE(p->tri, m->ntri);
    OM_TRY_DONE(om__mend_pieces(m, e, p->piece, NULL, &p->npart));
    OM_CALLOC_DONE(p->part, p->npart);
    OM_ALLOC_DONE(p->order, p->npart);
    OM_ALLOC_DONE(ranked, p->npart);
    for (int t = 0; t < m->ntri; t++) p->part[p->piece[t]].end++;
    for (int i = 0, at = 0; i < p->npart; i++) {
        Part* part = &p->part[i];
        const int num = part->end;
        part->begin = part->end = at;
        at += num;
        part->parent = -1;
        part->is_closed = true;
    }
    for (int t = 0; t < m->ntri; t++) p->tri[p->part[p->piece[t]].end++] = t;
    for (int i = 0; i < p->npart; i++) {
        measure_part(m, p, &p->part[i]);
        ranked[i] = (Ranked){fabs(p->part[i].volume), i};
    }
    mark_open(e, p);
    qsort(ranked, (size_t)p->npart, sizeof *ranked, compare_ranked);
    for (int i = 0; i < p->npart; i++) p->order[i] = ranked[i].part;
    p->nparent = p->npart < MAX_PARENT ? p->npart : MAX_PARENT;
done:
    om_free(ranked);
    return status;
}

static bool holds_box(const Part* a, const Part* b) {
    return a->lo.x <= b->lo.x && a->lo.y <= b->lo.y && a->lo.z <= b->lo.z && a->hi.x >= b->hi.x &&
           a->hi.y >= b->hi.y && a->hi.z >= b->hi.z;
}

// Whether the part at rank k of the order holds the other one.
static OmStatus holds_part(const OmMend* m, Parts* p, int k, const Part* other, bool* is_in) {
    const Part* part = &p->part[p->order[k]];
    *is_in = false;
    if (!part->is_closed || !holds_box(part, other)) return OM_OK;
    if (p->parent[k].nnode == 0) {
        const OmSurface s = {m->nvert, m->ntri, m->x, m->tri};
        OM_TRY(om__winding_init(&s, p->tri + part->begin, part->end - part->begin, &p->parent[k]));
    }
    const int num = other->end - other->begin, nsample = num < NSAMPLE ? num : NSAMPLE;
    for (int i = 0; i < nsample; i++) {
        const int t = p->tri[other->begin + (int)((int64_t)i * num / nsample)];
        if (fabs(om__winding_at(&p->parent[k], om__mend_center(m, t))) < 0.5) return OM_OK;
    }
    *is_in = true;
    return OM_OK;
}

static OmStatus find_parents(const OmMend* m, Parts* p) {
    for (int i = 1; i < p->npart; i++) {
        Part* part = &p->part[p->order[i]];
        const int last = i < p->nparent ? i : p->nparent;
        for (int k = last - 1; k >= 0 && part->parent < 0; k--) {
            bool is_in;
            OM_TRY(holds_part(m, p, k, part, &is_in));
            if (is_in) part->parent = p->order[k];
        }
    }
    return OM_OK;
}

static void orient_parts(OmMend* m, Parts* p) {
    for (int i = 0; i < p->npart; i++) {
        Part* part = &p->part[p->order[i]];
        const Part* parent = part->parent >= 0 ? &p->part[part->parent] : NULL;
        const OmVec3 place = om__mend_center(m, p->tri[part->begin]);
        int around = parent ? parent->winding : 0;
        part->is_turned = parent && parent->is_turned;
        int sign = (part->volume < 0) == part->is_turned ? 1 : -1;
        // rounding decides the sign of a flat part
        if (!part->is_closed ||
            fabs(part->volume) <= 1e-12 * m->diagonal * m->diagonal * m->diagonal) {
            part->winding = around;  // nothing tells its outside
            continue;
        }
        if (around <= 0 && sign < 0) {
            part->is_turned = !part->is_turned;
            sign = 1;
            om__mend_found(m, OM_DEFECT_INSIDE_OUT, 1, place);
        } else if (around > 0 && sign > 0) {
            om__mend_found(m, OM_DEFECT_NESTED, 1, place);
        } else if (around > 0) {
            m->report->ncavity++;
        }
        part->winding = around + sign;
    }
    for (int t = 0; t < m->ntri; t++)
        if (p->part[p->piece[t]].is_turned) om__mend_turn(m, t);
}

static void count_edges(OmMend* m, const OmMendEdges* e) {
    for (int i = 0; i < e->nedge; i++) {
        const OmHalf* h = &e->half[e->adr[i]];
        const OmVec3 middle = om_lerp(om_load3(m->x, h->lo), om_load3(m->x, h->hi), 0.5);
        if (om__edge_excess(e, i) != 0)
            om__mend_found(m, OM_DEFECT_OPEN, 1, middle);
        else if (om__edge_count(e, i) > 2)
            om__mend_found(m, OM_DEFECT_TOUCHING, 1, middle);
    }
}

OmStatus om__mend_parts(OmMend* m) {
    OmStatus status = OM_OK;
    OmMendEdges e = {0};
    Parts p = {0};
    OM_TRY_DONE(om__mend_edges_init(m, &e));
    OM_TRY_DONE(find_parts(m, &e, &p));
    OM_TRY_DONE(find_parents(m, &p));
    orient_parts(m, &p);
    m->report->npart = p.npart;
    om__mend_edges_done(&e);
    OM_TRY_DONE(om__mend_edges_init(m, &e));  // turned parts: forward is back
    count_edges(m, &e);
done:
    om__mend_edges_done(&e);
    parts_done(&p);
    return status;
}

// ---- crossings ------------------------------------------------------------------------------------------------

typedef struct Crossings {
    const OmMend* m;
    const OmWinding* tree;
    double budget;  // of pairs to look at: hostile files have too many
    int num, first;
} Crossings;

// Six times the volume of (a, b, c, d), 0 where rounding decides.
static double side(OmVec3 a, OmVec3 b, OmVec3 c, OmVec3 d) {
    OmVec3 u = om_sub(b, a), v = om_sub(c, a), w = om_sub(d, a);
    double x = om_dot(om_cross(u, v), w);
    return fabs(x) > 1e-10 * om_norm(u) * om_norm(v) * om_norm(w) ? x : 0;
}

// Whether the segment pq passes from one side of the triangle to the other.
static bool pierces(OmVec3 p, OmVec3 q, const OmVec3 t[3]) {
    const double up = side(t[0], t[1], t[2], p), uq = side(t[0], t[1], t[2], q);
    if (!((up > 0 && uq < 0) || (up < 0 && uq > 0))) return false;
    const double a = side(p, q, t[0], t[1]), b = side(p, q, t[1], t[2]), c = side(p, q, t[2], t[0]);
    return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

static bool cross(const OmMend* m, int s, int t) {
    const int *a = m->tri + 3 * (size_t)s, *b = m->tri + 3 * (size_t)t;
    OmVec3 p[3], q[3];
    int nshared = 0, ia = 0, ib = 0;
    for (int i = 0; i < 3; i++) {
        p[i] = om_load3(m->x, a[i]);
        q[i] = om_load3(m->x, b[i]);
        for (int k = 0; k < 3; k++)
            if (a[i] == b[k]) nshared++, ia = i, ib = k;
    }
    if (nshared >= 2) return false;
    if (nshared == 1)  // only the edges opposite to the shared vertex can pass through
        return pierces(p[(ia + 1) % 3], p[(ia + 2) % 3], q) ||
               pierces(q[(ib + 1) % 3], q[(ib + 2) % 3], p);
    for (int i = 0; i < 3; i++)
        if (pierces(p[i], p[(i + 1) % 3], q) || pierces(q[i], q[(i + 1) % 3], p)) return true;
    return false;
}

static bool boxes_meet(const OmWindingNode* a, const OmWindingNode* b) {
    for (int i = 0; i < 3; i++)
        if (a->lo[i] > b->hi[i] || b->lo[i] > a->hi[i]) return false;
    return true;
}

static void look_at_leaves(Crossings* c, const OmWindingNode* a, const OmWindingNode* b) {
    for (int i = a->begin; i < a->end; i++) {
        for (int k = a == b ? i + 1 : b->begin; k < b->end; k++) {
            c->budget--;
            const int s = c->tree->order[i], t = c->tree->order[k];
            if (!cross(c->m, s, t)) continue;
            c->num++;
            const int first = s < t ? s : t;
            if (c->first < 0 || first < c->first) c->first = first;
        }
    }
}

static void look_at_nodes(Crossings* c, int i, int k) {
    const OmWindingNode *a = &c->tree->node[i], *b = &c->tree->node[k];
    if (!(c->budget > 0) || c->num == 1 << 30 || !boxes_meet(a, b)) return;
    c->budget--;
    if (a->right < 0 && b->right < 0) {
        look_at_leaves(c, a, b);
    } else if (i == k) {
        look_at_nodes(c, i + 1, i + 1);
        look_at_nodes(c, i + 1, a->right);
        look_at_nodes(c, a->right, a->right);
    } else if (b->right < 0 || (a->right >= 0 && a->end - a->begin >= b->end - b->begin)) {
        look_at_nodes(c, i + 1, k);
        look_at_nodes(c, a->right, k);
    } else {
        look_at_nodes(c, i, k + 1);
        look_at_nodes(c, i, b->right);
    }
}

OmStatus om__mend_crossings(OmMend* m) {
    OmWinding tree;
    const OmSurface s = {m->nvert, m->ntri, m->x, m->tri};
    OM_TRY(om__winding_init(&s, NULL, 0, &tree));
    Crossings c = {.m = m, .tree = &tree, .budget = 1e6 + 200.0 * m->ntri, .first = -1};
    look_at_nodes(&c, 0, 0);
    om__winding_done(&tree);
    if (c.num > 0) om__mend_found(m, OM_DEFECT_CROSSING, c.num, om__mend_center(m, c.first));
    return OM_OK;
}
