// shape_fit.c: distances between solid and mesh in both directions, and the places where they differ.
//
// Voxels decide: those whose centres only one of both holds are joined over faces, edges and corners to places. A voxel
// next to the mesh's surface may fall on the wrong side of it anywhere, so a place counts only where a voxel is farther
// from that surface than the tolerance.
#include <stdlib.h>
#include <string.h>

#include "omentum/shape_closest.h"
#include "omentum/shape_fit.h"
#include "shape/shape_internal.h"

#define MAX_SAMPLE 100000
#define SHALLOW 0.3  // voxels

// ---- the boundary of a mask ------------------------------------------------------------------------------

OmStatus om_surface_from_mask(const OmMask* mask, OmSurface* surface) {
    OmStatus status = OM_OK;
    const OmVoxelGrid* g = &mask->grid;
    const size_t n = om_grid_count(g->dim);
    OmSdf field = {.grid = {.spacing = 1}};  // in steps of voxels
    memset(surface, 0, sizeof *surface);
    memcpy(field.grid.dim, g->dim, sizeof field.grid.dim);
    OM_ALLOC_DONE(field.d, n);
    for (size_t i = 0; i < n; i++) field.d[i] = mask->inside[i] ? -1 : 1;
    OM_TRY_DONE(om_surface_from_sdf(&field, 0, surface));
    for (int v = 0; v < surface->nvert; v++)
        om_store3(surface->x, v, om_voxel_grid_point(g, om_load3(surface->x, v)));
    if (om_mat3_det(g->axis) < 0) {
        for (int t = 0; t < surface->ntri; t++) {
            int* v = surface->tri_vert + 3 * (size_t)t;
            const int second = v[1];
            v[1] = v[2], v[2] = second;
        }
    }
done:
    om_sdf_done(&field);
    return status;
}

// ---- distances -------------------------------------------------------------------------------------------

typedef struct GapTask {
    const OmSurface* from;
    const OmSurfaceTree* to;
    int stride;
    double* distance;
} GapTask;

// The vertices, then the middles of triangles.
static OmVec3 sample_point(const OmSurface* s, int i) {
    if (i < s->nvert) return om_load3(s->x, i);
    const int* v = s->tri_vert + 3 * (size_t)(i - s->nvert);
    const OmVec3 sum =
        om_add(om_load3(s->x, v[0]), om_add(om_load3(s->x, v[1]), om_load3(s->x, v[2])));
    return om_scale(1.0 / 3, sum);
}

static void find_distances(void* ctx, int begin, int end, int block) {
    (void)block;
    const GapTask* task = ctx;
    for (int i = begin; i < end; i++) {
        OmSurfacePoint q;
        om_surface_tree_find(task->to, sample_point(task->from, i * task->stride), NULL, INFINITY,
                             &q);
        task->distance[i] = q.distance;
    }
}

static int compare_double(const void* a, const void* b) {
    const double x = *(const double*)a, y = *(const double*)b;
    return x < y ? -1 : x > y;
}

static OmStatus measure_gap(const OmSurface* from, const OmSurfaceTree* to, int nworker,
                            OmSurfaceGap* gap) {
    OM_CHECK(from->ntri > 0, OM_INVALID, "a surface has no triangles");
    const int nall = from->nvert + from->ntri;
    GapTask task = {from, to, (nall + MAX_SAMPLE - 1) / MAX_SAMPLE, NULL};
    const int n = (nall - 1) / task.stride + 1;
    OmStatus status = OM_OK;
    memset(gap, 0, sizeof *gap);
    OM_ALLOC(task.distance, n);
    OM_TRY_DONE(om_parallel_for_stop(nworker, n, 256, find_distances, &task));
    double sum = 0;
    gap->max = -1;
    for (int i = 0; i < n; i++) {
        sum += task.distance[i];
        if (task.distance[i] <= gap->max) continue;
        gap->max = task.distance[i];
        gap->where = sample_point(from, i * task.stride);
    }
    gap->mean = sum / n;
    qsort(task.distance, (size_t)n, sizeof(double), compare_double);
    gap->p95 = task.distance[(int)ceil(0.95 * n) - 1];
done:
    om_free(task.distance);
    return status;
}

OmStatus om_surface_gap(const OmSurface* from, const OmSurface* to, int nworker,
                        OmSurfaceGap* gap) {
    OmSurfaceTree* tree = NULL;
    OM_TRY(om_surface_tree_create(to, &tree));
    const OmStatus status = measure_gap(from, tree, nworker, gap);
    om_surface_tree_destroy(tree);
    return status;
}

// ---- voxels in a mesh ------------------------------------------------------------------------------------

OmStatus om_mask_from_tets(const OmTetMesh* mesh, const OmVoxelGrid* grid, unsigned char* inside) {
    OmMat3 inverse;
    OM_TRY(om_mat3_inverse(grid->axis, &inverse));
    memset(inside, 0, om_grid_count(grid->dim));
    for (int e = 0; e < mesh->ntet; e++) {
        const int* v = mesh->tet_vert + 4 * (size_t)e;
        OmVec3 q[4], lo, hi;  // in steps of voxels
        OmMat3 weights;
        for (int c = 0; c < 4; c++) {
            q[c] = om_mat3_apply(inverse, om_sub(om_load3(mesh->x, v[c]), grid->origin));
            lo = c ? om_min3(lo, q[c]) : q[c];
            hi = c ? om_max3(hi, q[c]) : q[c];
        }
        const OmMat3 sides =
            om_mat3_cols(om_sub(q[1], q[0]), om_sub(q[2], q[0]), om_sub(q[3], q[0]));
        if (om_mat3_inverse(sides, &weights) < 0) continue;  // flat: it holds no centre
        const double first[3] = {lo.x, lo.y, lo.z}, end[3] = {hi.x, hi.y, hi.z};
        int from[3], to[3];
        for (int a = 0; a < 3; a++) {
            from[a] = (int)fmax(ceil(first[a] - 1e-9), 0);
            to[a] = (int)fmin(floor(end[a] + 1e-9), grid->dim[a] - 1);
        }
        for (int k = from[2]; k <= to[2]; k++) {
            for (int j = from[1]; j <= to[1]; j++) {
                for (int i = from[0]; i <= to[0]; i++) {
                    const OmVec3 w = om_mat3_apply(weights, om_sub(om_vec3(i, j, k), q[0]));
                    const double eps = -1e-9;
                    if (w.x >= eps && w.y >= eps && w.z >= eps && 1 - w.x - w.y - w.z >= eps)
                        inside[om_grid_index(grid->dim, i, j, k)] = 1;
                }
            }
        }
    }
    return OM_OK;
}

// ---- places that differ ----------------------------------------------------------------------------------

enum { SAME, MISSING, ADDED, SEEN };

typedef struct Flood {
    const OmVoxelGrid* grid;
    unsigned char* kind;  // of each voxel
    size_t* stack;        // the voxels of a place, then those still to look at           (ndiffer)
    const OmSurfaceTree* tree;
    double voxel;  // m^3
} Flood;

// The place that holds this voxel; its voxels become SEEN. Those farther from the mesh's surface than the tolerance
// come into f->stack[0 .. *ndeep).
static OmShapeLoss flood_place(Flood* f, size_t start, double tolerance, size_t* ndeep) {
    const unsigned char kind = f->kind[start];
    const int* dim = f->grid->dim;
    OmShapeLoss place = {.is_added = kind == ADDED, .depth = -1};
    size_t n = 0;
    f->stack[n++] = start;
    f->kind[start] = SEEN;
    *ndeep = 0;
    for (size_t next = 0; next < n; next++) {
        int at[3];
        OmSurfacePoint q;
        const size_t voxel = f->stack[next];
        om_grid_unpack(dim, voxel, at);
        const OmVec3 p = om_voxel_grid_point(f->grid, om_vec3(at[0], at[1], at[2]));
        om_surface_tree_find(f->tree, p, NULL, INFINITY, &q);
        if (q.distance > place.depth) place.depth = q.distance, place.where = p;
        if (q.distance > tolerance) f->stack[(*ndeep)++] = voxel;  // *ndeep <= next
        for (int d = 0; d < 27; d++) {
            const int i = at[0] + d % 3 - 1, j = at[1] + d / 3 % 3 - 1, k = at[2] + d / 9 - 1;
            if (!om_grid_has(dim, i, j, k)) continue;
            const size_t beside = om_grid_index(dim, i, j, k);
            if (f->kind[beside] != kind) continue;
            f->kind[beside] = SEEN;
            f->stack[n++] = beside;
        }
    }
    place.volume = f->voxel * (double)n;
    return place;
}

static OmStatus add_wrong(const Flood* f, size_t n, OmShapeWrong* wrong) {
    OM_CHECK(n < (size_t)(INT32_MAX / 8 - wrong->n), OM_INVALID, "too many voxels differ");
    double* x = om_realloc(wrong->x, (size_t)wrong->n, (size_t)wrong->n + n, 3 * sizeof(double));
    if (!x) return OM_NO_MEMORY;
    wrong->x = x;
    for (size_t i = 0; i < n; i++) {
        int at[3];
        om_grid_unpack(f->grid->dim, f->stack[i], at);
        om_store3(x, wrong->n++, om_voxel_grid_point(f->grid, om_vec3(at[0], at[1], at[2])));
    }
    return OM_OK;
}

static OmStatus append_wrong(const OmShapeWrong* from, OmShapeWrong* to) {
    const size_t n = (size_t)from->n, old = (size_t)to->n;
    if (n == 0) return OM_OK;
    OM_CHECK(n < INT32_MAX / 8 - old, OM_INVALID, "too many voxels differ");
    double* x = om_realloc(to->x, old, old + n, 3 * sizeof(double));
    if (!x) return OM_NO_MEMORY;
    memcpy(x + 3 * old, from->x, 3 * n * sizeof(double));
    to->x = x;
    to->n += from->n;
    return OM_OK;
}

void om_shape_wrong_done(OmShapeWrong* wrong) {
    om_free(wrong->x);
    memset(wrong, 0, sizeof *wrong);
}

static void add_place(OmShapeFit* fit, const OmShapeLoss* place) {
    fit->nloss++;
    *(place->is_added ? &fit->added : &fit->lost) += place->volume;
    const int kept = fit->nloss - 1 < OM_MAX_LOSS ? fit->nloss - 1 : OM_MAX_LOSS;
    int at = kept;
    while (at > 0 && fit->loss[at - 1].volume < place->volume) at--;
    for (int i = kept < OM_MAX_LOSS ? kept : OM_MAX_LOSS - 1; i > at; i--)
        fit->loss[i] = fit->loss[i - 1];
    if (at < OM_MAX_LOSS) fit->loss[at] = *place;
}

// ---- places that change the topology ---------------------------------------------------------------------

static bool is_in_mesh(const Flood* f, const OmMask* mask, size_t voxel) {
    return (mask->inside[voxel] != 0) != (f->kind[voxel] != SAME);
}

// Cells of the mesh's voxels (1: themselves, 2: pairs over faces, 4: squares, 8: cubes; even ones count 1, odd ones -1)
// that hold this voxel and would be there with the place, whose voxels have this kind. A cell counts at its first voxel
// of the place.
static int count_cells(const Flood* f, const OmMask* mask, size_t voxel, unsigned char kind) {
    int at[3], sum = 0;
    const int* dim = f->grid->dim;
    om_grid_unpack(dim, voxel, at);
    for (int shape = 0; shape < 8; shape++) {  // bit a: the cell has two layers along axis a
        const int sign = ((shape & 1) + (shape >> 1 & 1) + (shape >> 2)) % 2 ? -1 : 1;
        for (int low = 0; low < 8; low++) {  // bit a: this voxel is in the upper layer
            if (low & ~shape) continue;
            bool is_in = true;
            for (int corner = 0; corner < 8 && is_in; corner++) {
                if (corner & ~shape) continue;
                int x[3];
                for (int a = 0; a < 3; a++) x[a] = at[a] + (corner >> a & 1) - (low >> a & 1);
                if (!om_grid_has(dim, x[0], x[1], x[2])) {
                    is_in = false;
                    break;
                }
                const size_t v = om_grid_index(dim, x[0], x[1], x[2]);
                const bool is_of_place = f->kind[v] == kind;
                is_in = is_of_place ? v >= voxel : is_in_mesh(f, mask, v);
            }
            sum += is_in ? sign : 0;
        }
    }
    return sum;
}

// The voxels of places, joined over faces, with which the Euler characteristic of the mesh's voxels would change.
static OmStatus find_changing(Flood* f, const OmMask* mask, OmShapeWrong* wrong) {
    enum { THIS = 4, DONE = 5 };
    const size_t n = om_grid_count(mask->grid.dim);
    for (size_t i = 0; i < n; i++) {
        if (f->kind[i] != SEEN) continue;
        const bool is_missing = mask->inside[i];
        size_t count = 0;
        int change = 0;
        f->stack[count++] = i;
        f->kind[i] = THIS;
        for (size_t next = 0; next < count; next++) {
            int at[3];
            om_grid_unpack(f->grid->dim, f->stack[next], at);
            for (int d = 0; d < 6; d++) {
                int x[3] = {at[0], at[1], at[2]};
                x[d / 2] += d % 2 ? 1 : -1;
                if (!om_grid_has(f->grid->dim, x[0], x[1], x[2])) continue;
                const size_t v = om_grid_index(f->grid->dim, x[0], x[1], x[2]);
                if (f->kind[v] != SEEN || (mask->inside[v] != 0) != is_missing) continue;
                f->kind[v] = THIS;
                f->stack[count++] = v;
            }
        }
        for (size_t k = 0; k < count; k++) change += count_cells(f, mask, f->stack[k], THIS);
        for (size_t k = 0; k < count; k++) f->kind[f->stack[k]] = DONE;
        if (change != 0) OM_TRY(add_wrong(f, count, wrong));
    }
    return OM_OK;
}

// The places deeper than the tolerance and their deep voxels. Where the topology differs also the voxels that change
// it; where there are none of both, all that are deeper than a part of a voxel.
static OmStatus find_places(const OmMask* mask, const OmTetMesh* mesh, const OmSurfaceTree* tree,
                            double tolerance, OmShapeFit* fit, OmShapeWrong* wrong) {
    OmStatus status = OM_OK;
    const size_t n = om_grid_count(mask->grid.dim);
    size_t ndiffer = 0, ndeep;
    OmShapeWrong changing = {0};
    Flood f = {&mask->grid, NULL, NULL, tree, fabs(om_mat3_det(mask->grid.axis))};
    OM_ALLOC_DONE(f.kind, n);
    OM_TRY_DONE(om_mask_from_tets(mesh, &mask->grid, f.kind));
    OM_TRY_DONE(om_stop_poll());
    for (size_t i = 0; i < n; i++) {
        f.kind[i] = f.kind[i] == mask->inside[i] ? SAME : f.kind[i] ? ADDED : MISSING;
        ndiffer += f.kind[i] != SAME;
    }
    OM_ALLOC_DONE(f.stack, ndiffer);
    for (size_t i = 0; i < n; i++) {
        if (f.kind[i] != MISSING && f.kind[i] != ADDED) continue;
        OM_TRY_DONE(om_stop_poll());
        const OmShapeLoss place = flood_place(&f, i, tolerance, &ndeep);
        if (place.depth <= tolerance) continue;
        add_place(fit, &place);
        if (wrong) OM_TRY_DONE(add_wrong(&f, ndeep, wrong));
    }
    if (om_topology_is_equal(&fit->solid, &fit->mesh)) goto done;
    OM_TRY_DONE(find_changing(&f, mask, &changing));
    fit->has_change = changing.n > 0;
    if (changing.n > 0) fit->change = om_load3(changing.x, 0);
    if (!wrong) goto done;
    OM_TRY_DONE(append_wrong(&changing, wrong));
    if (wrong->n > 0) goto done;
    for (size_t i = 0; i < n; i++) {
        if (f.kind[i] == SAME) continue;
        f.kind[i] = mask->inside[i] ? MISSING : ADDED;
    }
    for (size_t i = 0; i < n; i++) {
        if (f.kind[i] != MISSING && f.kind[i] != ADDED) continue;
        (void)flood_place(&f, i, SHALLOW * cbrt(f.voxel), &ndeep);
        OM_TRY_DONE(add_wrong(&f, ndeep, wrong));
    }
done:
    om_free(f.kind);
    om_free(f.stack);
    om_shape_wrong_done(&changing);
    return status;
}

OmStatus om_shape_fit_measure(const OmMask* mask, const OmSurface* solid, const OmTetMesh* mesh,
                              double tolerance, int nworker, OmShapeFit* fit, OmShapeWrong* wrong) {
    OmStatus status = OM_OK;
    OmSurface boundary = {0};
    OmSurfaceTree *of_mesh = NULL, *of_solid = NULL;
    memset(fit, 0, sizeof *fit);
    if (wrong) memset(wrong, 0, sizeof *wrong);
    OM_TRY_DONE(om_tet_mesh_boundary(mesh, &boundary, NULL));
    OM_TRY_DONE(om_surface_topology(solid, &fit->solid));
    OM_TRY_DONE(om_surface_topology(&boundary, &fit->mesh));
    OM_TRY_DONE(om_stop_poll());
    OM_TRY_DONE(om_surface_tree_create(&boundary, &of_mesh));
    OM_TRY_DONE(om_surface_tree_create(solid, &of_solid));
    OM_TRY_DONE(measure_gap(solid, of_mesh, nworker, &fit->to_mesh));
    OM_TRY_DONE(measure_gap(&boundary, of_solid, nworker, &fit->to_solid));
    OM_TRY_DONE(find_places(mask, mesh, of_mesh, tolerance, fit, wrong));
done:
    om_surface_done(&boundary);
    om_surface_tree_destroy(of_mesh);
    om_surface_tree_destroy(of_solid);
    if (status < 0 && wrong) om_shape_wrong_done(wrong);
    return status;
}
