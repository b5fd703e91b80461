// scan_thin.c: fewer points of a cloud, by their distance in space.
//
// In the order of the file: a point is kept if no kept point is nearer than a radius; a hash table of cells finds such
// points. A kept point becomes the mean of the points within a third of the spacing, as in pictures
// (scan_decimate.c). A triangle whose corners are nearest to three kept points becomes a triangle of these.
#include <string.h>

#include "omentum/shape_points.h"
#include "scan/scan_internal.h"

OmStatus om__edges_init(ScanEdges* e, int npoint, int ntri) {
    OmStatus status = OM_OK;
    *e = (ScanEdges){0};
    OM_ALLOC_DONE(e->head, npoint);
    OM_ALLOC_DONE(e->next, 3 * (size_t)ntri);
    OM_ALLOC_DONE(e->to, 3 * (size_t)ntri);
    for (int i = 0; i < npoint; ++i) e->head[i] = -1;
done:
    return status;
}

void om__edges_done(ScanEdges* e) {
    om_free(e->head);
    om_free(e->next);
    om_free(e->to);
}

bool om__edges_take(ScanEdges* e, const int v[3]) {
    for (int k = 0; k < 3; ++k)
        for (int i = e->head[v[k]]; i >= 0; i = e->next[i])
            if (e->to[i] == v[(k + 1) % 3]) return false;
    for (int k = 0; k < 3; ++k) {
        e->to[e->n] = v[(k + 1) % 3];
        e->next[e->n] = e->head[v[k]];
        e->head[v[k]] = e->n++;
    }
    return true;
}

typedef struct Thin {
    const OmScan* from;
    double radius;
    int* head;  // first kept point of a cell, by its hash; -1: none
    uint64_t mask;
    int *next, *kept, nkept;  // of kept points; the point of the scan that each is (npoint)
    double* x;                // of kept points (npoint x 3)
    int* cell;                // nearest kept point of each point (npoint)
} Thin;

static uint64_t cell_hash(const Thin* t, OmVec3 p, const int step[3]) {
    // Cells of coordinates beyond 2^53 radii are one: they are found by distance all the same.
    const double cell[3] = {floor(p.x / t->radius) + step[0], floor(p.y / t->radius) + step[1],
                            floor(p.z / t->radius) + step[2]};
    const double plain[3] = {cell[0] + 0.0, cell[1] + 0.0, cell[2] + 0.0};  // -0 + 0 = 0
    return om_hash(plain, sizeof plain, OM_HASH_SEED) & t->mask;
}

static bool is_covered(const Thin* t, OmVec3 p) {
    for (int k = 0; k < 27; ++k) {
        const int step[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
        for (int i = t->head[cell_hash(t, p, step)]; i >= 0; i = t->next[i])
            if (om_distance(om_load3(t->x, i), p) < t->radius) return true;
    }
    return false;
}

static void choose(Thin* t) {
    for (int i = 0; i < t->from->npoint; ++i) {
        OmVec3 p = om_load3(t->from->x, i);
        if (is_covered(t, p)) continue;
        uint64_t at = cell_hash(t, p, (int[3]){0});
        om_store3(t->x, t->nkept, p);
        t->kept[t->nkept] = i;
        t->next[t->nkept] = t->head[at];
        t->head[at] = t->nkept++;
    }
}

static OmStatus thin_init(Thin* t, const OmScan* scan, double radius) {
    OmStatus status = OM_OK;
    *t = (Thin){.from = scan, .radius = radius};
    size_t n = (size_t)scan->npoint, size = 16;
    while (size < n) size *= 2;
    t->mask = size - 1;
    OM_ALLOC_DONE(t->head, size);
    OM_ALLOC_DONE(t->next, n);
    OM_ALLOC_DONE(t->kept, n);
    OM_ALLOC_DONE(t->x, 3 * n);
    OM_ALLOC_DONE(t->cell, n);
    for (size_t i = 0; i < size; ++i) t->head[i] = -1;
done:
    return status;
}

static void thin_done(Thin* t) {
    om_free(t->head);
    om_free(t->next);
    om_free(t->kept);
    om_free(t->x);
    om_free(t->cell);
}

// Means around the kept points, into the scan `to`; `count` is scratch (nkept).
static void take_means(const Thin* t, double reach, int* count, OmScan* to) {
    for (int i = 0; i < t->from->npoint; ++i) {
        int k = t->cell[i];
        OmVec3 p = om_load3(t->from->x, i), n = om_load3(t->from->normal, i);
        OmVec3 center = om_load3(t->x, k), kept = om_load3(t->from->normal, t->kept[k]);
        if (om_distance(p, center) > reach) continue;
        om_store3(to->x, k, om_add(om_load3(to->x, k), p));
        ++count[k];
        if (om_dot(n, kept) > 0) om_store3(to->normal, k, om_add(om_load3(to->normal, k), n));
    }
    double sum = 0;
    for (int k = 0; k < t->nkept; ++k) {  // the kept point itself counts: count > 0
        om_store3(to->x, k, om_scale(1.0 / count[k], om_load3(to->x, k)));
        om_store3(to->normal, k, om_normalize(om_load3(to->normal, k)));
        sum += 1.0 / count[k];
    }
    to->noise = t->nkept > 0 ? t->from->noise * sqrt(sum / t->nkept) : 0;
}

static OmVec3 facet(const OmScan* s, const int v[3]) {
    OmVec3 a = om_load3(s->x, v[0]);
    return om_cross(om_sub(om_load3(s->x, v[1]), a), om_sub(om_load3(s->x, v[2]), a));
}

static OmStatus take_triangles(const Thin* t, OmScan* to) {
    ScanEdges e;
    OmStatus status = om__edges_init(&e, t->nkept, t->from->ntri);
    to->ntri = 0;
    for (int i = 0; i < t->from->ntri && status == OM_OK; ++i) {
        const int* old = t->from->tri_vert + 3 * (size_t)i;
        const int v[3] = {t->cell[old[0]], t->cell[old[1]], t->cell[old[2]]};
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
        if (om_dot(facet(t->from, old), facet(to, v)) <= 0 || !om__edges_take(&e, v)) continue;
        memcpy(to->tri_vert + 3 * (size_t)to->ntri++, v, sizeof v);
    }
    om__edges_done(&e);
    return status;
}

OmStatus om__scan_thin(double spacing, OmScan* scan, int* nthinned) {
    Thin t;
    OmScan to = {0};
    OmPointTree* tree = NULL;
    int* count = NULL;
    OmStatus status = thin_init(&t, scan, OM__SCAN_COVER * spacing);
    if (status < 0) goto done;
    choose(&t);
    OM_TRY_DONE(om_scan_init(t.nkept, scan->ntri, &to));
    OM_CALLOC_DONE(count, t.nkept);
    OM_TRY_DONE(om_point_tree_create(t.nkept, t.x, &tree));
    for (int i = 0; i < scan->npoint; ++i)
        t.cell[i] = om_point_tree_find(tree, om_load3(scan->x, i), NULL);
    take_means(&t, spacing / 3, count, &to);
    OM_TRY_DONE(take_triangles(&t, &to));
    *nthinned = scan->npoint - t.nkept;
    om_scan_done(scan);
    *scan = to;
    to = (OmScan){0};
done:
    om_point_tree_destroy(tree);
    om_free(count);
    om_scan_done(&to);
    thin_done(&t);
    return status;
}
