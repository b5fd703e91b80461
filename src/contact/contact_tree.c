// contact_tree.c: which triangles of the tissue's surface may meet in a step.
//
// The tree is made once, at rest: triangles are halved by the median of their centres. In each search its boxes are
// refitted to the paths of the step. Two parts of one smooth sheet touch along all of it; they are left out where all
// normals around the two agree, because what is in contact looks at each other. Each vertex and each edge belongs to
// one of its triangles (Curtis et al. 2008, representative triangles), so no pair is found twice.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "contact/contact_internal.h"

// fmin and fmax are calls: they took a seventh of a search.
static inline double least(double a, double b) { return a < b ? a : b; }
static inline double most(double a, double b) { return a > b ? a : b; }

// ---- edges and owners --------------------------------------------------------------------------------

typedef struct Side {  // of a triangle
    int lo, hi, tri, local;
} Side;

static int compare_sides(const void* a, const void* b) {
    const Side *p = a, *q = b;
    if (p->lo != q->lo) return p->lo < q->lo ? -1 : 1;
    if (p->hi != q->hi) return p->hi < q->hi ? -1 : 1;
    return p->tri < q->tri ? -1 : p->tri > q->tri;
}

static OmStatus make_edges(OmSelf* f) {
    OmStatus status = OM_OK;
    size_t n = 3 * (size_t)f->ntri;
    Side* side = NULL;
    unsigned char* has_owner = NULL;
    OM_ALLOC_DONE(side, n);
    OM_CALLOC_DONE(has_owner, f->nvert);
    OM_ALLOC_DONE(f->edge_vert, 2 * n);
    OM_ALLOC_DONE(f->edge_tri, 2 * n);
    OM_ALLOC_DONE(f->tri_edge, n);
    OM_CALLOC_DONE(f->own, f->ntri);
    for (size_t k = 0; k < n; ++k) {
        int t = (int)(k / 3), a = f->tri_vert[k], b = f->tri_vert[3 * (size_t)t + (k + 1) % 3];
        side[k] = (Side){a < b ? a : b, a < b ? b : a, t, (int)(k % 3)};
    }
    qsort(side, n, sizeof *side, compare_sides);
    for (size_t k = 0; k < n; ++k) {
        const Side* s = &side[k];
        bool is_new = k == 0 || s->lo != side[k - 1].lo || s->hi != side[k - 1].hi;
        if (is_new) {
            f->edge_vert[2 * (size_t)f->nedge] = s->lo;
            f->edge_vert[2 * (size_t)f->nedge + 1] = s->hi;
            f->edge_tri[2 * (size_t)f->nedge] = f->edge_tri[2 * (size_t)f->nedge + 1] = s->tri;
            f->own[s->tri] |= (unsigned char)(8 << s->local);
            ++f->nedge;
        } else {
            f->edge_tri[2 * (size_t)(f->nedge - 1) + 1] = s->tri;
        }
        f->tri_edge[3 * (size_t)s->tri + (size_t)s->local] = f->nedge - 1;
    }
    for (size_t k = 0; k < n; ++k) {
        if (has_owner[f->tri_vert[k]]) continue;
        has_owner[f->tri_vert[k]] = 1;
        f->own[k / 3] |= (unsigned char)(1 << k % 3);
    }
done:
    om_free(side);
    om_free(has_owner);
    return status;
}

// The ends of the edges around each vertex.
static OmStatus list_near(OmSelf* f) {
    f->near_adr = om_calloc((size_t)f->nvert + 1, sizeof *f->near_adr);
    f->near_vert = om_alloc(2 * (size_t)f->nedge, sizeof *f->near_vert);
    if (!f->near_adr || !f->near_vert) return OM_NO_MEMORY;
    int* at = f->near_adr;
    for (int k = 0; k < 2 * f->nedge; ++k) ++at[f->edge_vert[k] + 1];
    for (int i = 0; i < f->nvert; ++i) at[i + 1] += at[i];
    for (int k = 0; k < 2 * f->nedge; ++k)
        f->near_vert[at[f->edge_vert[k]]++] = f->edge_vert[k ^ 1];
    // each entry is now the begin of the next
    for (int i = f->nvert; i > 0; --i) at[i] = at[i - 1];
    at[0] = 0;
    return OM_OK;
}

// ---- the tree -----------------------------------------------------------------------------------------

typedef struct Build {
    OmSelf* self;
    int* order;      // triangles                                                    (ntri)
    double* center;  //                                                              (ntri x 3)
} Build;

static bool is_before(const Build* b, int axis, int s, int t) {
    double p = b->center[3 * s + axis], q = b->center[3 * t + axis];
    return p != q ? p < q : s < t;
}

// The smallest `num` of order[begin .. end) come first.
static void select_lowest(const Build* b, int axis, int begin, int end, int num) {
    while (end - begin > 1) {
        int pivot = b->order[begin + (end - begin) / 2], i = begin, j = end - 1;
        while (i <= j) {
            while (is_before(b, axis, b->order[i], pivot)) ++i;
            while (is_before(b, axis, pivot, b->order[j])) --j;
            if (i > j) break;
            int swap = b->order[i];
            b->order[i++] = b->order[j];
            b->order[j--] = swap;
        }
        if (num <= j)
            end = j + 1;
        else if (num >= i)
            begin = i;
        else
            return;
    }
}

static int build(const Build* b, int begin, int end) {
    int at = b->self->nnode++;
    b->self->node[at] = (OmSelfNode){0, b->order[begin]};
    if (end - begin == 1) return at;
    OmVec3 lo = om_load3(b->center, b->order[begin]), hi = lo;
    for (int k = begin; k < end; ++k) {
        lo = om_min3(lo, om_load3(b->center, b->order[k]));
        hi = om_max3(hi, om_load3(b->center, b->order[k]));
    }
    OmVec3 size = om_sub(hi, lo);
    int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : size.y >= size.z ? 1 : 2;
    int mid = begin + (end - begin) / 2;
    select_lowest(b, axis, begin, end, mid);
    build(b, begin, mid);
    b->self->node[at].right = build(b, mid, end);
    return at;
}

static OmStatus make_tree(OmSelf* f) {
    OmStatus status = OM_OK;
    Build b = {.self = f};
    OM_ALLOC_DONE(b.order, f->ntri);
    OM_ALLOC_DONE(b.center, 3 * (size_t)f->ntri);
    OM_ALLOC_DONE(f->node, 2 * (size_t)f->ntri);
    for (int t = 0; t < f->ntri; ++t) {
        const int* v = f->tri_vert + 3 * (size_t)t;
        OmVec3 sum = om_add(om_load3(f->rest, v[0]), om_load3(f->rest, v[1]));
        b.order[t] = t;
        om_store3(b.center, t, om_scale(1.0 / 3, om_add(sum, om_load3(f->rest, v[2]))));
    }
    build(&b, 0, f->ntri);
done:
    om_free(b.order);
    om_free(b.center);
    return status;
}

static double mean_edge(const OmSelf* f) {
    double sum = 0;
    int num = 0;
    for (int e = 0; e < f->nedge; ++e) {
        const int* v = f->edge_vert + 2 * (size_t)e;
        if (f->skin_of[f->body[v[0]]] >= 0) continue;
        sum += om_distance(om_load3(f->rest, v[0]), om_load3(f->rest, v[1]));
        ++num;
    }
    return num > 0 ? sum / num : 0.1 * f->size;
}

OmStatus om__self_create(const OmContact* c, const OmTissueModel* m, OmSelf** self) {
    *self = NULL;
    const OmTetMesh* mesh = om_tissue_mesh(m);
    OmStatus status = OM_OK;
    OmSelf* f = om_calloc(1, sizeof *f);
    if (!f) return OM_NO_MEMORY;
    f->tri_vert = c->tri_vert;
    f->ntri = c->ntri;
    f->nvert = mesh->nvert;
    f->body = c->body;
    f->skin_of = c->skin_of;
    OM_ALLOC_DONE(f->rest, 3 * (size_t)mesh->nvert);
    memcpy(f->rest, mesh->x, 3 * (size_t)mesh->nvert * sizeof *f->rest);
    OM_TRY_DONE(make_edges(f));
    OM_TRY_DONE(list_near(f));
    OM_TRY_DONE(make_tree(f));
    f->size = c->size;
    f->edge = mean_edge(f);
    f->thickness = c->def.self_thickness > 0 ? c->def.self_thickness : 0.1 * f->edge;
    f->friction = c->def.self_friction;
    *self = f;
    return OM_OK;
done:
    om__self_destroy(f);
    return status;
}

void om__self_destroy(OmSelf* f) {
    if (!f) return;
    om_free(f->edge_vert);
    om_free(f->edge_tri);
    om_free(f->tri_edge);
    om_free(f->own);
    om_free(f->near_adr);
    om_free(f->near_vert);
    om_free(f->node);
    om_free(f->rest);
    om_free(f);
}

// A search of two nodes adds at most three pairs of nodes and takes one away; a path through the tree is about
// 2 log2 ntri long, and each of its levels holds at most three.
#define STACK 1024

OmStatus om__self_work_create(const OmSelf* f, OmSelfWork** work) {
    *work = NULL;
    OmStatus status = OM_OK;
    OmSelfWork* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    size_t n = 3 * (size_t)f->nvert;
    w->max_stack = STACK;
    OM_ALLOC_DONE(w->box, f->nnode);
    OM_ALLOC_DONE(w->normal, 3 * (size_t)f->ntri);
    OM_ALLOC_DONE(w->fan, 2 * n);
    OM_ALLOC_DONE(w->swept, 2 * n);
    OM_ALLOC_DONE(w->x, n);
    OM_ALLOC_DONE(w->end, n);
    OM_ALLOC_DONE(w->predicted, n);
    OM_ALLOC_DONE(w->way, f->nvert);
    OM_ALLOC_DONE(w->last, n);
    OM_ALLOC_DONE(w->stack, w->max_stack);
    *work = w;
    return OM_OK;
done:
    om__self_work_destroy(w);
    return status;
}

void om__self_work_destroy(OmSelfWork* w) {
    if (!w) return;
    om_free(w->box);
    om_free(w->normal);
    om_free(w->fan);
    om_free(w->swept);
    om_free(w->x);
    om_free(w->end);
    om_free(w->predicted);
    om_free(w->way);
    om_free(w->last);
    om_free(w->pair);
    om_free(w->found);
    om_free(w->old);
    om_free(w->stack);
    om_free(w);
}

// ---- boxes --------------------------------------------------------------------------------------------

static void widen(double lo[3], double hi[3], const double p[3]) {
    for (int k = 0; k < 3; ++k) {
        lo[k] = least(lo[k], p[k]);
        hi[k] = most(hi[k], p[k]);
    }
}

static void find_fans(const OmSelf* f, OmSelfWork* w, const double* x) {
    for (int t = 0; t < 3 * f->ntri; ++t) {
        double* fan = w->fan + 6 * (size_t)f->tri_vert[t];
        for (int k = 0; k < 6; ++k) fan[k] = k < 3 ? INFINITY : -INFINITY;
    }
    for (int t = 0; t < f->ntri; ++t) {
        const int* v = f->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(x, v[0]);
        OmVec3 n = om_cross(om_sub(om_load3(x, v[1]), a), om_sub(om_load3(x, v[2]), a));
        double length = om_norm(n);
        om_store3(w->normal, t, length > 0 ? om_scale(1 / length, n) : n);
        for (int k = 0; k < 3; ++k) {
            double* fan = w->fan + 6 * (size_t)v[k];
            widen(fan, fan + 3, w->normal + 3 * (size_t)t);
        }
    }
}

void om__self_refit(const OmSelf* f, OmSelfWork* w, const double* x, const double* move,
                    double reach) {
    find_fans(f, w, x);
    for (size_t n = 0; n < 3 * (size_t)f->nvert; ++n) {
        double* box = w->swept + 6 * (n / 3) + n % 3;
        double end = x[n] + (move ? move[n] : 0);
        box[0] = least(x[n], end);
        box[3] = most(x[n], end);
    }
    for (int n = f->nnode - 1; n >= 0; --n) {
        OmSelfBox* b = &w->box[n];
        if (f->node[n].right) {
            const OmSelfBox *l = &w->box[n + 1], *r = &w->box[f->node[n].right];
            for (int k = 0; k < 3; ++k) {
                b->lo[k] = least(l->lo[k], r->lo[k]);
                b->hi[k] = most(l->hi[k], r->hi[k]);
                b->nlo[k] = least(l->nlo[k], r->nlo[k]);
                b->nhi[k] = most(l->nhi[k], r->nhi[k]);
            }
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            b->lo[k] = b->nlo[k] = INFINITY;
            b->hi[k] = b->nhi[k] = -INFINITY;
        }
        for (int c = 0; c < 3; ++c) {
            size_t v = (size_t)f->tri_vert[3 * (size_t)f->node[n].tri + (size_t)c];
            widen(b->lo, b->hi, w->swept + 6 * v);
            widen(b->lo, b->hi, w->swept + 6 * v + 3);
            widen(b->nlo, b->nhi, w->fan + 6 * v);
            widen(b->nlo, b->nhi, w->fan + 6 * v + 3);
        }
        for (int k = 0; k < 3; ++k) {
            b->lo[k] -= reach;
            b->hi[k] += reach;
        }
    }
}

// ---- search -------------------------------------------------------------------------------------------

static bool boxes_meet(const OmSelfBox* a, const OmSelfBox* b) {
    for (int k = 0; k < 3; ++k)
        if (a->lo[k] > b->hi[k] || b->lo[k] > a->hi[k]) return false;
    return true;
}

// True if every normal of the one and every normal of the other have a cosine above 0.
static bool normals_agree(const OmSelfBox* a, const OmSelfBox* b) {
    double sum = 0;
    for (int k = 0; k < 3; ++k)
        sum += least(least(a->nlo[k] * b->nlo[k], a->nlo[k] * b->nhi[k]),
                     least(a->nhi[k] * b->nlo[k], a->nhi[k] * b->nhi[k]));
    return sum > 0;
}

OmStatus om__self_search(const OmSelf* f, OmSelfWork* w, bool skips, OmSelfMeetFn meet, void* ctx) {
    int num = 0;
    w->stack[num++] = 0;
    w->stack[num++] = 0;
    while (num > 0) {
        int b = w->stack[--num], a = w->stack[--num];
        OM_CHECK(num + 6 <= w->max_stack, OM_INVALID,
                 "contact: the tree of %d triangles is too deep", f->ntri);
        const OmSelfNode *p = &f->node[a], *q = &f->node[b];
        if (a != b && !boxes_meet(&w->box[a], &w->box[b])) continue;
        if (skips && normals_agree(&w->box[a], &w->box[b])) continue;
        if (a == b) {
            if (!p->right) continue;
            const int push[6] = {a + 1, p->right, p->right, p->right, a + 1, a + 1};
            for (int k = 0; k < 6; ++k) w->stack[num++] = push[k];
            continue;
        }
        if (!p->right && !q->right) {
            OM_TRY(meet(ctx, p->tri, q->tri));
            continue;
        }
        // the node that holds more triangles is opened; the left child follows its parent
        bool opens_a = p->right && (!q->right || p->right - a >= q->right - b);
        const OmSelfNode* open = opens_a ? p : q;
        int at = opens_a ? a : b, other = opens_a ? b : a;
        w->stack[num++] = open->right;
        w->stack[num++] = other;
        w->stack[num++] = at + 1;
        w->stack[num++] = other;
    }
    return OM_OK;
}
