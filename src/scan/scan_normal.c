// scan_normal.c: normals of points without a picture: planes through neighbours, then their directions.
//
// Without a camera the directions are made to agree along a minimum spanning tree of the graph of neighbours, whose
// edges cost 1 - |n_i . n_j|: where the surface is smooth first (Hoppe et al., Surface reconstruction from unorganized
// points, SIGGRAPH 1992). The tree is Prim's, with a binary heap; it grows from the normals that a file gives, which
// stay.
#include <string.h>

#include "omentum/shape_points.h"
#include "scan/scan_internal.h"

#define NEIGHBOUR 16
#define MIN_FIT 6        // points of a plane
#define MIN_SPREAD 0.05  // variance across a line over the variance along it: less is no plane

OmVec3 om__plane_normal(const double* x, int n, const int* point, OmVec3* mean) {
    OmVec3 spread;
    OmMat3 axes = om_points_axes(x, n, point, mean, &spread);
    bool is_plane = n >= MIN_FIT && spread.y > MIN_SPREAD * spread.z;
    return is_plane ? axes.cx : om_vec3(0, 0, 0);
}

// ---- directions that agree ----------------------------------------------------------------------------------------

typedef struct Step {  // an edge of the graph, to a point that may have no direction yet
    double cost;
    int from, to;
} Step;

typedef struct Walk {
    const int* near;  // neighbours of each point, itself first; -1 ends     (npoint x NEIGHBOUR)
    double* normal;
    bool* is_fixed;  // has its direction                                    (npoint)
    Step* heap;      // (npoint x NEIGHBOUR + 1)
    int n;
} Walk;

static bool is_before(Step a, Step b) {
    if (a.cost != b.cost) return a.cost < b.cost;
    return a.to != b.to ? a.to < b.to : a.from < b.from;
}

static void push(Walk* w, Step step) {
    int i = w->n++;
    for (; i > 0 && is_before(step, w->heap[(i - 1) / 2]); i = (i - 1) / 2)
        w->heap[i] = w->heap[(i - 1) / 2];
    w->heap[i] = step;
}

static Step pop(Walk* w) {
    Step first = w->heap[0], last = w->heap[--w->n];
    int i = 0;
    for (int child = 1; child < w->n; child = 2 * i + 1) {
        if (child + 1 < w->n && is_before(w->heap[child + 1], w->heap[child])) ++child;
        if (!is_before(w->heap[child], last)) break;
        w->heap[i] = w->heap[child];
        i = child;
    }
    w->heap[i] = last;
    return first;
}

static void push_neighbours(Walk* w, int i) {
    OmVec3 n = om_load3(w->normal, i);
    for (int k = 1; k < NEIGHBOUR && w->near[NEIGHBOUR * i + k] >= 0; ++k) {
        int j = w->near[NEIGHBOUR * i + k];
        if (w->is_fixed[j]) continue;
        push(w, (Step){1 - fabs(om_dot(n, om_load3(w->normal, j))), i, j});
    }
}

// From the edges on the heap on; the points met are listed in `piece` behind the first n. Returns their number.
static int agree(Walk* w, int n, int* piece) {
    while (w->n > 0) {
        Step s = pop(w);
        if (w->is_fixed[s.to]) continue;
        OmVec3 a = om_load3(w->normal, s.from), b = om_load3(w->normal, s.to);
        if (om_dot(a, b) < 0) om_store3(w->normal, s.to, om_scale(-1, b));
        w->is_fixed[s.to] = true;
        piece[n++] = s.to;
        push_neighbours(w, s.to);
    }
    return n;
}

// A known neighbour that does not count i among its own, -1: none.
static int known_near(const Walk* w, const bool* is_known, int i) {
    for (int k = 1; k < NEIGHBOUR && w->near[NEIGHBOUR * i + k] >= 0; ++k)
        if (is_known[w->near[NEIGHBOUR * i + k]]) return w->near[NEIGHBOUR * i + k];
    return -1;
}

// Known normals stay, and those around them agree with them; a piece without any looks up.
static OmStatus make_agree(const int* near, const bool* is_known, OmVec3 up, OmScan* scan) {
    OmStatus status = OM_OK;
    Walk w = {.near = near, .normal = scan->normal};
    int* piece = NULL;
    OM_CALLOC_DONE(w.is_fixed, scan->npoint);
    OM_ALLOC_DONE(w.heap, NEIGHBOUR * (size_t)scan->npoint + 1);
    OM_ALLOC_DONE(piece, scan->npoint);
    for (int i = 0; i < scan->npoint; ++i) w.is_fixed[i] = is_known[i];
    for (int i = 0; i < scan->npoint; ++i)
        if (is_known[i]) push_neighbours(&w, i);
    agree(&w, 0, piece);
    for (int i = 0; i < scan->npoint; ++i) {
        if (w.is_fixed[i]) continue;
        OmVec3 normal = om_load3(scan->normal, i);
        int known = known_near(&w, is_known, i);
        if (known >= 0 && om_dot(om_load3(scan->normal, known), normal) < 0)
            om_store3(scan->normal, i, om_scale(-1, normal));
        w.is_fixed[i] = true;
        piece[0] = i;
        push_neighbours(&w, i);
        int n = agree(&w, 1, piece);
        if (known >= 0) continue;
        double sum = 0;
        for (int k = 0; k < n; ++k) sum += om_dot(om_load3(scan->normal, piece[k]), up);
        for (int k = 0; k < n && sum < 0; ++k)
            om_store3(scan->normal, piece[k], om_scale(-1, om_load3(scan->normal, piece[k])));
    }
done:
    om_free(w.is_fixed);
    om_free(w.heap);
    om_free(piece);
    return status;
}

OmStatus om__scan_estimate_normals(const OmVec3* eye, OmVec3 up, OmScan* scan, int* nestimated) {
    OmStatus status = OM_OK;
    OmPointTree* tree = NULL;
    int* near = NULL;
    bool* is_known = NULL;
    *nestimated = 0;
    OM_TRY_DONE(om_point_tree_create(scan->npoint, scan->x, &tree));
    OM_ALLOC_DONE(near, NEIGHBOUR * (size_t)scan->npoint);
    OM_CALLOC_DONE(is_known, scan->npoint);
    for (int i = 0; i < scan->npoint; ++i) {
        int* list = near + NEIGHBOUR * (size_t)i;
        int n = om_point_tree_find_many(tree, om_load3(scan->x, i), NEIGHBOUR, list);
        if (n < NEIGHBOUR) list[n] = -1;
        is_known[i] = om_norm2(om_load3(scan->normal, i)) > 0;
        if (is_known[i]) continue;
        OmVec3 mean, normal = om__plane_normal(scan->x, n, list, &mean);
        om_store3(scan->normal, i, normal);
        *nestimated += om_norm2(normal) > 0;
    }
    if (!eye && *nestimated > 0) status = make_agree(near, is_known, up, scan);
done:
    om_free(near);
    om_free(is_known);
    om_point_tree_destroy(tree);
    return status;
}
