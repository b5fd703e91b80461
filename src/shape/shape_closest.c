// shape_closest.c: a tree of boxes around triangles.
//
// The triangles of a node are a range of the array `order`. A node is split at the median of the triangles' centres
// along the longest side of their box; its left child is the next node, its right child is stored. A query walks to
// the nearer child first and leaves out boxes that are farther than the best triangle so far. Corners are stored in
// the order of the tree, so that a leaf reads one block of memory.
#include <math.h>
#include <string.h>

#include "omentum/shape_closest.h"
#include "shape/shape_internal.h"

#define LEAF 4
#define MAX_DEPTH 64

typedef struct Node {
    double lo[3], hi[3];
    int begin, end;  // of `order`
    int right;       // the right child, -1: a leaf
} Node;

struct OmSurfaceTree {
    int nvert, ntri, nnode;
    int* tri_vert;   // in the order of the tree           (ntri x 3)
    int* order;      // triangle of the input              (ntri)
    double* corner;  // in the order of the tree           (ntri x 9)
    Node* node;      // parents before children            (nnode)
};

// ---- one triangle -----------------------------------------------------------------------------------

static OmVec3 set_point(double wa, double wb, double wc, OmVec3 q, double bary[3]) {
    // 1 - t may round below 0
    if (bary) bary[0] = fmax(0, wa), bary[1] = fmax(0, wb), bary[2] = fmax(0, wc);
    return q;
}

// Ericson 2005, 5.1.5.
OmVec3 om_triangle_closest(OmVec3 p, OmVec3 a, OmVec3 b, OmVec3 c, double bary[3]) {
    OmVec3 ab = om_sub(b, a), ac = om_sub(c, a), ap = om_sub(p, a);
    double d1 = om_dot(ab, ap), d2 = om_dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return set_point(1, 0, 0, a, bary);
    OmVec3 bp = om_sub(p, b);
    double d3 = om_dot(ab, bp), d4 = om_dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return set_point(0, 1, 0, b, bary);
    double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        double t = d1 > d3 ? d1 / (d1 - d3) : 0;
        return set_point(1 - t, t, 0, om_madd(a, t, ab), bary);
    }
    OmVec3 cp = om_sub(p, c);
    double d5 = om_dot(ab, cp), d6 = om_dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return set_point(0, 0, 1, c, bary);
    double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        double t = d2 > d6 ? d2 / (d2 - d6) : 0;
        return set_point(1 - t, 0, t, om_madd(a, t, ac), bary);
    }
    double va = d3 * d6 - d5 * d4, e4 = d4 - d3, e5 = d5 - d6;
    if (va <= 0 && e4 >= 0 && e5 >= 0) {
        double t = e4 + e5 > 0 ? e4 / (e4 + e5) : 0;
        return set_point(0, 1 - t, t, om_madd(b, t, om_sub(c, b)), bary);
    }
    double sum = va + vb + vc;  // positive: flat triangles were handled above
    OmVec3 q = om_add(a, om_add(om_scale(vb / sum, ab), om_scale(vc / sum, ac)));
    return set_point(1 - vb / sum - vc / sum, vb / sum, vc / sum, q, bary);
}

// ---- building ---------------------------------------------------------------------------------------

typedef struct Build {
    OmSurfaceTree* tree;
    double* center;  // three times the centre of each triangle of the input   (ntri x 3)
} Build;

// Returns the node of the range; boxes are set later.
static int build(Build* b, int begin, int end) {
    OmSurfaceTree* t = b->tree;
    int index = t->nnode++;
    t->node[index] = (Node){.begin = begin, .end = end, .right = -1};
    if (end - begin <= LEAF) return index;
    int middle = begin + (end - begin) / 2;
    int axis = om__points_longest_side(b->center, t->order, begin, end);
    om__points_select(b->center, t->order, begin, end, middle, axis);
    build(b, begin, middle);
    int right = build(b, middle, end);
    t->node[index].right = right;
    return index;
}

static OmStatus check_surface(const OmSurface* s) {
    OM_CHECK(s->ntri > 0, OM_INVALID, "a surface without triangles");
    for (int i = 0; i < s->nvert; ++i)
        OM_CHECK(om_is_finite3(om_load3(s->x, i)), OM_INVALID, "vertex %d is not finite", i);
    for (size_t k = 0; k < 3 * (size_t)s->ntri; ++k)
        OM_CHECK(s->tri_vert[k] >= 0 && s->tri_vert[k] < s->nvert, OM_INVALID,
                 "triangle %d has vertex %d of %d", (int)(k / 3), s->tri_vert[k], s->nvert);
    return OM_OK;
}

static OmStatus build_tree(const OmSurface* surface, Build* b) {
    OmStatus status = OM_OK;
    OmSurfaceTree* t = b->tree;
    OM_ALLOC_DONE(b->center, 3 * (size_t)t->ntri);
    OM_ALLOC_DONE(t->node, 2 * (size_t)t->ntri);
    OM_ALLOC_DONE(t->order, t->ntri);
    OM_ALLOC_DONE(t->tri_vert, 3 * (size_t)t->ntri);
    OM_ALLOC_DONE(t->corner, 9 * (size_t)t->ntri);
    for (int i = 0; i < t->ntri; ++i) {
        const int* v = surface->tri_vert + 3 * (size_t)i;
        OmVec3 sum = om_add(om_load3(surface->x, v[0]), om_load3(surface->x, v[1]));
        om_store3(b->center, i, om_add(sum, om_load3(surface->x, v[2])));
        t->order[i] = i;
    }
    build(b, 0, t->ntri);
    for (int i = 0; i < t->ntri; ++i)
        memcpy(t->tri_vert + 3 * (size_t)i, surface->tri_vert + 3 * (size_t)t->order[i],
               3 * sizeof(int));
    om_surface_tree_move(t, surface->x);
done:
    return status;
}

OmStatus om_surface_tree_create(const OmSurface* surface, OmSurfaceTree** tree) {
    *tree = NULL;
    OM_TRY(check_surface(surface));
    OmSurfaceTree* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->nvert = surface->nvert;
    t->ntri = surface->ntri;
    Build b = {.tree = t};
    OmStatus status = build_tree(surface, &b);
    om_free(b.center);
    if (status < 0)
        om_surface_tree_destroy(t);
    else
        *tree = t;
    return status;
}

void om_surface_tree_destroy(OmSurfaceTree* tree) {
    if (!tree) return;
    om_free(tree->tri_vert);
    om_free(tree->order);
    om_free(tree->corner);
    om_free(tree->node);
    om_free(tree);
}

static void grow_box(Node* node, const double* lo, const double* hi) {
    for (int k = 0; k < 3; ++k) {
        node->lo[k] = fmin(node->lo[k], lo[k]);
        node->hi[k] = fmax(node->hi[k], hi[k]);
    }
}

void om_surface_tree_move(OmSurfaceTree* tree, const double* x) {
    for (size_t k = 0; k < 3 * (size_t)tree->ntri; ++k)
        memcpy(tree->corner + 3 * k, x + 3 * (size_t)tree->tri_vert[k], 3 * sizeof *x);
    for (int n = tree->nnode - 1; n >= 0; --n) {  // children before parents
        Node* node = tree->node + n;
        for (int k = 0; k < 3; ++k) node->lo[k] = INFINITY, node->hi[k] = -INFINITY;
        if (node->right >= 0) {
            grow_box(node, tree->node[n + 1].lo, tree->node[n + 1].hi);
            grow_box(node, tree->node[node->right].lo, tree->node[node->right].hi);
        } else {
            for (size_t k = 3 * (size_t)node->begin; k < 3 * (size_t)node->end; ++k)
                grow_box(node, tree->corner + 3 * k, tree->corner + 3 * k);
        }
    }
}

// ---- queries ----------------------------------------------------------------------------------------

// Squared distance of p to a box.
static double distance2_to(const Node* node, OmVec3 p) {
    double dx = fmax(fmax(node->lo[0] - p.x, p.x - node->hi[0]), 0);
    double dy = fmax(fmax(node->lo[1] - p.y, p.y - node->hi[1]), 0);
    double dz = fmax(fmax(node->lo[2] - p.z, p.z - node->hi[2]), 0);
    return dx * dx + dy * dy + dz * dz;
}

typedef struct Best {
    double d2;       // squared distance; the limit as long as nothing is found
    int place;       // of the triangle in the tree, -1: none
    bool is_facing;  // only triangles whose normal n has n . normal > min_cosine
    OmVec3 normal;
    double min_cosine;
} Best;

static bool is_facing(const Best* best, const double* corner) {
    OmVec3 a = om_load3(corner, 0);
    OmVec3 n = om_cross(om_sub(om_load3(corner, 1), a), om_sub(om_load3(corner, 2), a));
    return om_dot(n, best->normal) > best->min_cosine * om_norm(n);
}

static void look_at_leaf(const OmSurfaceTree* t, const Node* leaf, OmVec3 p,
                         const unsigned char* use, Best* best) {
    for (int i = leaf->begin; i < leaf->end; ++i) {
        if (use && !use[t->order[i]]) continue;
        const double* c = t->corner + 9 * (size_t)i;
        if (best->is_facing && !is_facing(best, c)) continue;
        OmVec3 q = om_triangle_closest(p, om_load3(c, 0), om_load3(c, 1), om_load3(c, 2), NULL);
        double d2 = om_norm2(om_sub(p, q));
        bool is_first = best->place < 0 || t->order[i] < t->order[best->place];
        if (d2 > best->d2 || (d2 == best->d2 && !is_first)) continue;
        best->d2 = d2;
        best->place = i;
    }
}

static void search(const OmSurfaceTree* t, OmVec3 p, const unsigned char* use, Best* best) {
    int stack[MAX_DEPTH], nstack = 0;  // the depth is at most 1 + log2 of the number of triangles
    double far_d2[MAX_DEPTH];
    int n = 0;
    double d2 = distance2_to(t->node, p);
    for (;;) {
        if (d2 <= best->d2) {
            const Node* node = t->node + n;
            if (node->right >= 0) {
                int near = n + 1, far = node->right;
                double near_d2 = distance2_to(t->node + near, p);
                double other = distance2_to(t->node + far, p);
                if (other < near_d2) {
                    far = near, near = node->right;
                    double kept = near_d2;
                    near_d2 = other, other = kept;
                }
                far_d2[nstack] = other;
                stack[nstack++] = far;
                n = near, d2 = near_d2;
                continue;
            }
            look_at_leaf(t, node, p, use, best);
        }
        if (nstack == 0) return;
        n = stack[--nstack], d2 = far_d2[nstack];
    }
}

static bool find(const OmSurfaceTree* tree, OmVec3 p, const unsigned char* use, Best* best,
                 OmSurfacePoint* q) {
    search(tree, p, use, best);
    if (best->place < 0) return false;
    if (!q) return true;
    const double* c = tree->corner + 9 * (size_t)best->place;
    q->tri = tree->order[best->place];
    q->x = om_triangle_closest(p, om_load3(c, 0), om_load3(c, 1), om_load3(c, 2), q->bary);
    q->distance = sqrt(best->d2);
    return true;
}

bool om_surface_tree_find(const OmSurfaceTree* tree, OmVec3 p, const unsigned char* use,
                          double max_distance, OmSurfacePoint* q) {
    Best best = {.d2 = max_distance * max_distance, .place = -1};
    return find(tree, p, use, &best, q);
}

bool om_surface_tree_find_facing(const OmSurfaceTree* tree, OmVec3 p, OmVec3 normal,
                                 double min_cosine, const unsigned char* use, double max_distance,
                                 OmSurfacePoint* q) {
    Best best = {.d2 = max_distance * max_distance,
                 .place = -1,
                 .is_facing = true,
                 .normal = normal,
                 .min_cosine = min_cosine};
    return find(tree, p, use, &best, q);
}
