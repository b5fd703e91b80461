// shape_points.c: a k-d tree without pointers.
//
// The points of a node are a range of the array. The node is split at the median along its longest side,
// found by Hoare's selection. Its children are the ranges left and right of the median, so that the order of
// the points is the tree. A range of a few points is searched one by one.
#include "omentum/shape_points.h"

#include <math.h>

#include "shape/shape_internal.h"

#define LEAF 8

struct OmPointTree {
    int n;
    double* x;    // in the order of the tree           (n x 3)
    int* index;   // index of the point in the input          (n)
    char* split;  // axis along which a node is split          (n)
};

// ---- building -------------------------------------------------------------------------------------

int om__points_longest_side(const double* x, const int* order, int begin, int end) {
    OmVec3 lo = om_load3(x, order[begin]), hi = lo;
    for (int i = begin + 1; i < end; ++i) {
        lo = om_min3(lo, om_load3(x, order[i]));
        hi = om_max3(hi, om_load3(x, order[i]));
    }
    OmVec3 d = om_sub(hi, lo);
    return d.x >= d.y && d.x >= d.z ? 0 : d.y >= d.z ? 1 : 2;
}

void om__points_select(const double* x, int* order, int begin, int end, int middle, int axis) {
    const double* along = x + axis;
    int lo = begin, hi = end - 1;
    while (lo < hi) {
        double pivot = along[3 * (size_t)order[(lo + hi) / 2]];
        int i = lo, j = hi;
        while (i <= j) {
            while (along[3 * (size_t)order[i]] < pivot) ++i;
            while (along[3 * (size_t)order[j]] > pivot) --j;
            if (i > j) break;
            int kept = order[i];
            order[i++] = order[j];
            order[j--] = kept;
        }
        if (middle <= j)
            hi = j;
        else if (middle >= i)
            lo = i;
        else
            return;
    }
}

static void build(OmPointTree* t, const double* x, int begin, int end) {
    while (end - begin > LEAF) {
        int middle = begin + (end - begin) / 2;
        int axis = om__points_longest_side(x, t->index, begin, end);
        om__points_select(x, t->index, begin, end, middle, axis);
        t->split[middle] = (char)axis;
        build(t, x, begin, middle);
        begin = middle + 1;
    }
}

OmStatus om_point_tree_create(int n, const double* x, OmPointTree** tree) {
    *tree = NULL;
    OM_CHECK(n > 0, OM_INVALID, "a tree of %d points", n);
    for (int i = 0; i < n; ++i)
        OM_CHECK(om_is_finite3(om_load3(x, i)), OM_INVALID, "point %d is not finite", i);
    OmStatus status = OM_OK;
    OmPointTree* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->n = n;
    OM_ALLOC_DONE(t->x, 3 * (size_t)n);
    OM_ALLOC_DONE(t->index, n);
    OM_CALLOC_DONE(t->split, n);
    for (int i = 0; i < n; ++i) t->index[i] = i;
    build(t, x, 0, n);
    for (int i = 0; i < n; ++i) om_store3(t->x, i, om_load3(x, t->index[i]));
    *tree = t;
    return OM_OK;
done:
    om_point_tree_destroy(t);
    return status;
}

void om_point_tree_destroy(OmPointTree* tree) {
    if (!tree) return;
    om_free(tree->x);
    om_free(tree->index);
    om_free(tree->split);
    om_free(tree);
}

// ---- queries --------------------------------------------------------------------------------------

typedef struct Nearest {
    OmVec3 p;
    int num;     // points wanted, >= 1
    double* d2;  // squared distances of the best points so far, ascending   (num)
    int* index;  // their indices                                            (num)
} Nearest;

static void look(const OmPointTree* t, int i, Nearest* best) {
    double d2 = om_norm2(om_sub(om_load3(t->x, i), best->p));
    int at = best->num - 1, index = t->index[i];
    if (d2 > best->d2[at] || (d2 == best->d2[at] && index > best->index[at])) return;
    while (at > 0 &&
           (d2 < best->d2[at - 1] || (d2 == best->d2[at - 1] && index < best->index[at - 1]))) {
        best->d2[at] = best->d2[at - 1];
        best->index[at] = best->index[at - 1];
        --at;
    }
    best->d2[at] = d2;
    best->index[at] = index;
}

static void descend(const OmPointTree* t, int begin, int end, Nearest* best) {
    if (end - begin <= LEAF) {
        for (int i = begin; i < end; ++i) look(t, i, best);
        return;
    }
    int middle = begin + (end - begin) / 2, axis = t->split[middle];
    double gap = (axis == 0   ? best->p.x
                  : axis == 1 ? best->p.y
                              : best->p.z) -
                 t->x[3 * middle + axis];
    look(t, middle, best);
    if (gap <= 0) descend(t, begin, middle, best);
    if (gap > 0) descend(t, middle + 1, end, best);
    // no point behind the plane is nearer or equally near
    if (gap * gap > best->d2[best->num - 1]) return;
    if (gap <= 0) descend(t, middle + 1, end, best);
    if (gap > 0) descend(t, begin, middle, best);
}

int om_point_tree_find(const OmPointTree* tree, OmVec3 p, double* distance) {
    double d2 = INFINITY;
    int index = tree->n;
    Nearest best = {.p = p, .num = 1, .d2 = &d2, .index = &index};
    descend(tree, 0, tree->n, &best);
    if (distance) *distance = sqrt(d2);
    return index;
}

int om_point_tree_find_many(const OmPointTree* tree, OmVec3 p, int num, int* index) {
    double d2[OM_MAX_NEAREST];
    if (num > tree->n) num = tree->n;
    if (num > OM_MAX_NEAREST) num = OM_MAX_NEAREST;
    if (num < 1) return 0;
    for (int k = 0; k < num; ++k) {
        d2[k] = INFINITY;
        index[k] = tree->n;
    }
    Nearest best = {.p = p, .num = num, .d2 = d2, .index = index};
    descend(tree, 0, tree->n, &best);
    return num;
}

OmMat3 om_points_axes(const double* x, int n, const int* point, OmVec3* mean, OmVec3* spread) {
    OmVec3 zero = om_vec3(0, 0, 0);
    OmMat3 sum = om_mat3_diag(zero), axes;
    *mean = zero;
    for (int k = 0; k < n; ++k) *mean = om_madd(*mean, 1.0 / n, om_load3(x, point[k]));
    for (int k = 0; k < n; ++k) {
        OmVec3 d = om_sub(om_load3(x, point[k]), *mean);
        sum = om_mat3_add(sum, om_mat3_outer(d, d));
    }
    om_mat3_eigen_symmetric(sum, spread, &axes);
    return axes;
}
