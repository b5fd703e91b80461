// shape_sdf.c: signed distance fields on regular grids.
//
// Distances: the nodes around each triangle get their exact closest point. Eight sweeps propagate closest
// points from node to node (Danielsson 1980), because the closest point of a node is that of a neighbour or
// near it. Then each node computes its distance to the triangles around its closest point. Signs come from
// the function that was sampled. For a triangle surface they come from the crossings of the rays along the
// three axes, counted with their direction; where the axes disagree, from the generalised winding number. Triangles
// with the solid, or nothing, on both sides are left out of the distance.
//
// Tried and rejected: the fast sweeping method (first order: 0.3 h at the second layer of nodes); sweeps alone
// (closest points off by a cell's diagonal: h^2 / (2 d) too long at distance d, gradients off by a fifth).
#include "shape/shape_internal.h"

#include <string.h>

#include "omentum/shape_closest.h"
#include "shape/shape_winding.h"

// ---- grids --------------------------------------------------------------------------------------------

OmSdfDef om_sdf_default_def(double spacing) {
    OmSdfDef def = {.cookie = OM__SDF_COOKIE,
                    .spacing = spacing,
                    .margin = 3 * spacing,
                    .smooth = 1.2,
                    .iterations = 8,
                    .exact = INFINITY,
                    .max_node = 200000000};
    return def;
}

OmStatus om__sdf_check_def(const OmSdfDef* def) {
    OM_CHECK(def->cookie == OM__SDF_COOKIE, OM_INVALID,
             "OmSdfDef was not made by om_sdf_default_def");
    OM_CHECK(def->spacing > 0 && isfinite(def->spacing), OM_INVALID,
             "distance field: spacing %g m must be positive", def->spacing);
    OM_CHECK(def->margin >= 0 && isfinite(def->margin), OM_INVALID,
             "distance field: margin %g m must not be negative", def->margin);
    OM_CHECK(def->smooth >= 0.5 && def->smooth <= 3, OM_INVALID,
             "distance field: smooth %g must be 0.5 to 3 voxels", def->smooth);
    OM_CHECK(def->iterations >= 0 && def->iterations <= 100, OM_INVALID,
             "distance field: iterations %d must be 0 to 100", def->iterations);
    OM_CHECK(def->exact >= 0, OM_INVALID, "distance field: exact %g m must not be negative",
             def->exact);
    return OM_OK;
}

void om_sdf_done(OmSdf* sdf) {
    if (!sdf) return;
    om_free(sdf->d);
    memset(sdf, 0, sizeof *sdf);
}

OmStatus om__sdf_grid(const OmSdfDef* def, OmVec3 lo, OmVec3 hi, OmSdf* sdf) {
    memset(sdf, 0, sizeof *sdf);
    OM_TRY(om__sdf_check_def(def));
    OM_CHECK(om_is_finite3(lo) && om_is_finite3(hi) && hi.x >= lo.x && hi.y >= lo.y && hi.z >= lo.z,
             OM_INVALID, "distance field: the box to fill is empty or not finite");
    const double h = def->spacing;
    const double size[3] = {hi.x - lo.x, hi.y - lo.y, hi.z - lo.z};
    double nnode = 1;
    for (int a = 0; a < 3; a++) nnode *= ceil((size[a] + 2 * def->margin) / h) + 1;
    OM_CHECK(nnode <= (double)def->max_node && nnode < 2e9, OM_INVALID,
             "distance field: %.0f nodes at a spacing of %.3g mm are too many; use a larger edge",
             nnode, h * 1e3);
    for (int a = 0; a < 3; a++) sdf->grid.dim[a] = (int)ceil((size[a] + 2 * def->margin) / h) + 1;
    OmVec3 half = om_scale(
        0.5 * h, om_vec3(sdf->grid.dim[0] - 1, sdf->grid.dim[1] - 1, sdf->grid.dim[2] - 1));
    sdf->grid.spacing = h;
    sdf->grid.origin = om_sub(om_lerp(lo, hi, 0.5), half);
    sdf->d = om_alloc((size_t)nnode, sizeof(float));
    return sdf->d ? OM_OK : OM_NO_MEMORY;
}

void om_sdf_bounds(const OmSdf* sdf, OmVec3* lo, OmVec3* hi) {
    const double h = sdf->grid.spacing;
    *lo = sdf->grid.origin;
    *hi = om_madd(sdf->grid.origin, h,
                  om_vec3(sdf->grid.dim[0] - 1, sdf->grid.dim[1] - 1, sdf->grid.dim[2] - 1));
}

typedef struct SampleTask {
    OmSdf* sdf;
    OmShapeFn fn;
    void* ctx;
} SampleTask;

static void sample_slices(void* ctx, int begin, int end, int block) {
    (void)block;
    const SampleTask* task = ctx;
    OmSdf* sdf = task->sdf;
    for (int k = begin; k < end; k++) {
        size_t node = om_grid_index(sdf->grid.dim, 0, 0, k);
        for (int j = 0; j < sdf->grid.dim[1]; j++) {
            for (int i = 0; i < sdf->grid.dim[0]; i++) {
                sdf->d[node++] = (float)task->fn(task->ctx, om_grid_point(&sdf->grid, i, j, k));
            }
        }
    }
}

OmStatus om__sdf_sample(OmSdf* sdf, OmShapeFn fn, void* ctx) {
    SampleTask task = {sdf, fn, ctx};
    return om_parallel_for_stop(0, sdf->grid.dim[2], 1, sample_slices, &task);
}

// ---- evaluation -------------------------------------------------------------------------------------------

double om_sdf_eval(const OmSdf* sdf, OmVec3 p, OmVec3* gradient) {
    const double ih = 1.0 / sdf->grid.spacing;
    const double q[3] = {(p.x - sdf->grid.origin.x) * ih, (p.y - sdf->grid.origin.y) * ih,
                         (p.z - sdf->grid.origin.z) * ih};
    double u[3], out[3];  // position within the cell, and distance beyond the grid, in cells
    int c[3];
    for (int a = 0; a < 3; a++) {
        double last = sdf->grid.dim[a] - 1;
        double inside = q[a] > 0 ? (q[a] < last ? q[a] : last) : 0;  // a NaN ends at 0
        out[a] = q[a] - inside;
        c[a] = (int)inside;
        if (c[a] > sdf->grid.dim[a] - 2) c[a] = sdf->grid.dim[a] > 1 ? sdf->grid.dim[a] - 2 : 0;
        u[a] = inside - c[a];
    }
    const size_t sy = (size_t)sdf->grid.dim[0], sz = sy * (size_t)sdf->grid.dim[1];
    const size_t dx = sdf->grid.dim[0] > 1, dy = sdf->grid.dim[1] > 1 ? sy : 0,
                 dz = sdf->grid.dim[2] > 1 ? sz : 0;
    const float* f = &sdf->d[(size_t)c[0] + sy * (size_t)c[1] + sz * (size_t)c[2]];
    double f000 = (double)f[0], f100 = (double)f[dx], f010 = (double)f[dy];
    double f110 = (double)f[dx + dy], f001 = (double)f[dz], f101 = (double)f[dx + dz];
    double f011 = (double)f[dy + dz], f111 = (double)f[dx + dy + dz];
    double e00 = f000 + u[0] * (f100 - f000), e10 = f010 + u[0] * (f110 - f010);
    double e01 = f001 + u[0] * (f101 - f001), e11 = f011 + u[0] * (f111 - f011);
    double g0 = e00 + u[1] * (e10 - e00), g1 = e01 + u[1] * (e11 - e01);
    double beyond = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    if (gradient) {
        double x0 = (1 - u[1]) * (f100 - f000) + u[1] * (f110 - f010);
        double x1 = (1 - u[1]) * (f101 - f001) + u[1] * (f111 - f011);
        double y0 = e10 - e00, y1 = e11 - e01;
        OmVec3 g = om_vec3(x0 + u[2] * (x1 - x0), y0 + u[2] * (y1 - y0), g1 - g0);
        g = om_scale(ih, g);
        if (beyond > 0) {  // clamped directions only see the distance to the grid
            g = om_vec3(out[0] != 0 ? out[0] / beyond : g.x, out[1] != 0 ? out[1] / beyond : g.y,
                        out[2] != 0 ? out[2] / beyond : g.z);
        }
        *gradient = g;
    }
    return g0 + u[2] * (g1 - g0) + beyond * sdf->grid.spacing;
}

double om_sdf_shape_fn(void* ctx, OmVec3 p) { return om_sdf_eval(ctx, p, NULL); }

// ---- distance to triangles ----------------------------------------------------------------------------------

typedef struct Feet {  // the closest point of each node
    float* point;      // relative to the grid's origin          (nnode x 3)
    int* tri;          // its triangle, -1 as long as none is known
} Feet;

// Exact closest points for the nodes within one cell of each triangle's box.
static void seed_band(const OmSurface* s, const OmSdf* sdf, Feet* feet, float* dist2) {
    const double h = sdf->grid.spacing;
    for (int t = 0; t < s->ntri; t++) {
        const int* v = &s->tri_vert[3 * (size_t)t];
        OmVec3 a = om_load3(s->x, v[0]), b = om_load3(s->x, v[1]), c = om_load3(s->x, v[2]);
        OmVec3 lo = om_min3(a, om_min3(b, c)), hi = om_max3(a, om_max3(b, c));
        const double l[3] = {lo.x - sdf->grid.origin.x, lo.y - sdf->grid.origin.y,
                             lo.z - sdf->grid.origin.z};
        const double u[3] = {hi.x - sdf->grid.origin.x, hi.y - sdf->grid.origin.y,
                             hi.z - sdf->grid.origin.z};
        int from[3], to[3];
        for (int x = 0; x < 3; x++) {
            from[x] = (int)fmax(floor(l[x] / h) - 1, 0);
            to[x] = (int)fmin(ceil(u[x] / h) + 1, sdf->grid.dim[x] - 1);
        }
        for (int k = from[2]; k <= to[2]; k++) {
            for (int j = from[1]; j <= to[1]; j++) {
                size_t row = om_grid_index(sdf->grid.dim, 0, j, k);
                for (int i = from[0]; i <= to[0]; i++) {
                    OmVec3 p = om_grid_point(&sdf->grid, i, j, k);
                    OmVec3 q = om_sub(om_triangle_closest(p, a, b, c, NULL), sdf->grid.origin);
                    float d2 = (float)om_norm2(om_sub(om_sub(p, sdf->grid.origin), q));
                    size_t n = row + (size_t)i;
                    if (d2 >= dist2[n]) continue;
                    dist2[n] = d2;
                    feet->tri[n] = t;
                    feet->point[3 * n] = (float)q.x;
                    feet->point[3 * n + 1] = (float)q.y;
                    feet->point[3 * n + 2] = (float)q.z;
                }
            }
        }
    }
}

// Copy the closest point of node m if it is nearer to node n, which is at (x, y, z).
static inline void take_over(Feet* feet, float* dist2, size_t n, size_t m, float x, float y,
                             float z) {
    if (feet->tri[m] < 0) return;
    const float* p = &feet->point[3 * m];
    float ex = x - p[0], ey = y - p[1], ez = z - p[2];
    float d2 = ex * ex + ey * ey + ez * ez;
    if (d2 >= dist2[n]) return;
    dist2[n] = d2;
    feet->tri[n] = feet->tri[m];
    memcpy(&feet->point[3 * n], p, 3 * sizeof(float));
}

// One sweep in direction (si, sj, sk): each node compares with three neighbours.
static void sweep(const OmSdf* sdf, Feet* feet, float* dist2, int si, int sj, int sk) {
    const int nx = sdf->grid.dim[0], ny = sdf->grid.dim[1], nz = sdf->grid.dim[2];
    const float h = (float)sdf->grid.spacing;
    const ptrdiff_t back_y = -(ptrdiff_t)sj * nx, back_z = -(ptrdiff_t)sk * nx * ny;
    for (int kk = 0; kk < nz; kk++) {
        int k = sk > 0 ? kk : nz - 1 - kk;
        for (int jj = 0; jj < ny; jj++) {
            int j = sj > 0 ? jj : ny - 1 - jj;
            size_t row = (size_t)nx * ((size_t)j + (size_t)ny * (size_t)k);
            for (int ii = 0; ii < nx; ii++) {
                int i = si > 0 ? ii : nx - 1 - ii;
                size_t n = row + (size_t)i;
                float x = (float)i * h, y = (float)j * h, z = (float)k * h;
                if (ii) take_over(feet, dist2, n, (size_t)((ptrdiff_t)n - si), x, y, z);
                if (jj) take_over(feet, dist2, n, (size_t)((ptrdiff_t)n + back_y), x, y, z);
                if (kk) take_over(feet, dist2, n, (size_t)((ptrdiff_t)n + back_z), x, y, z);
            }
        }
    }
}

typedef struct RefineTask {
    const OmSurface* surface;
    OmSdf* sdf;
    const Feet* feet;
    const int *adr, *corner;  // triangles around each vertex
    double exact;             // m; nodes further away keep their distance of the sweeps
} RefineTask;

static bool has_vertex(const int* tri, int v) { return tri[0] == v || tri[1] == v || tri[2] == v; }

// The exact distance of a node to the triangles around its closest one.
static double refined_distance2(const RefineTask* task, size_t n, OmVec3 p) {
    const OmSurface* s = task->surface;
    const int* near = &s->tri_vert[3 * (size_t)task->feet->tri[n]];
    double best = HUGE_VAL;
    for (int c = 0; c < 3; c++) {
        for (int i = task->adr[near[c]]; i < task->adr[near[c] + 1]; i++) {
            const int* v = &s->tri_vert[3 * (size_t)(task->corner[i] / 3)];
            // triangles that also have an earlier corner were computed there
            bool is_done = c > 0 && has_vertex(v, near[0]);
            if (is_done || (c > 1 && has_vertex(v, near[1]))) continue;
            OmVec3 q = om_triangle_closest(p, om_load3(s->x, v[0]), om_load3(s->x, v[1]),
                                           om_load3(s->x, v[2]), NULL);
            best = fmin(best, om_norm2(om_sub(p, q)));
        }
    }
    return best;
}

static void refine_slices(void* ctx, int begin, int end, int block) {
    (void)block;
    RefineTask* task = ctx;
    OmSdf* sdf = task->sdf;
    const float band = (float)(sdf->grid.spacing * sdf->grid.spacing);  // exact since seed_band
    const float far =
        (float)((task->exact + sdf->grid.spacing) * (task->exact + sdf->grid.spacing));
    for (int k = begin; k < end; k++) {
        size_t n = om_grid_index(sdf->grid.dim, 0, 0, k);
        for (int j = 0; j < sdf->grid.dim[1]; j++) {
            for (int i = 0; i < sdf->grid.dim[0]; i++, n++) {
                if (sdf->d[n] <= band || sdf->d[n] > far) continue;
                double d2 = refined_distance2(task, n, om_grid_point(&sdf->grid, i, j, k));
                sdf->d[n] = fminf(sdf->d[n], (float)d2);
            }
        }
    }
}

OmStatus om__sdf_unsigned(const OmSurface* surface, double exact, OmSdf* sdf) {
    OmStatus status = OM_OK;
    size_t nnode = om_grid_count(sdf->grid.dim);
    Feet feet = {0};
    int *adr = NULL, *corner = NULL;
    OM_ALLOC_DONE(feet.point, 3 * nnode);
    OM_ALLOC_DONE(feet.tri, nnode);
    OM_TRY_DONE(om__surface_corners(surface, &adr, &corner));
    for (size_t n = 0; n < nnode; n++) {
        sdf->d[n] = 1e30f;
        feet.tri[n] = -1;
    }
    seed_band(surface, sdf, &feet, sdf->d);
    for (int s = 0; s < 8; s++) {
        OM_TRY_DONE(om_stop_poll());
        sweep(sdf, &feet, sdf->d, s & 1 ? -1 : 1, s & 2 ? -1 : 1, s & 4 ? -1 : 1);
    }
    RefineTask task = {surface, sdf, &feet, adr, corner, exact};
    OM_TRY_DONE(om_parallel_for_stop(0, sdf->grid.dim[2], 1, refine_slices, &task));
    for (size_t n = 0; n < nnode; n++) sdf->d[n] = sqrtf(sdf->d[n]);
done:
    om_free(feet.point);
    om_free(feet.tri);
    om_free(adr);
    om_free(corner);
    return status;
}

// ---- from functions ---------------------------------------------------------------------------------------------

static OmStatus redistance_once(OmSdf* sdf) {
    OmStatus status = OM_OK;
    size_t nnode = om_grid_count(sdf->grid.dim);
    OmSurface surface = {0};
    unsigned char* inside = NULL;
    OM_TRY_DONE(om_surface_from_sdf(sdf, 0, &surface));
    OM_CHECK_DONE(surface.ntri > 0, OM_INVALID, "distance field: nothing is inside");
    OM_ALLOC_DONE(inside, nnode);
    for (size_t n = 0; n < nnode; n++) inside[n] = sdf->d[n] < 0;
    OM_TRY_DONE(om__sdf_unsigned(&surface, INFINITY, sdf));
    for (size_t n = 0; n < nnode; n++) sdf->d[n] = inside[n] ? -sdf->d[n] : sdf->d[n];
done:
    om_surface_done(&surface);
    om_free(inside);
    return status;
}

// The level whose surface encloses `volume`: Newton with dV/dlevel = area, as d is a distance.
static OmStatus level_of_volume(const OmSdf* sdf, double volume, double* level) {
    *level = 0;
    for (int it = 0; it < 4; it++) {
        OmSurface surface;
        OM_TRY(om_surface_from_sdf(sdf, *level, &surface));
        double v = om_surface_volume(&surface), area = 0;
        for (int t = 0; t < surface.ntri; t++) {
            const int* w = &surface.tri_vert[3 * (size_t)t];
            OmVec3 a = om_load3(surface.x, w[0]);
            area += 0.5 * om_norm(om_cross(om_sub(om_load3(surface.x, w[1]), a),
                                           om_sub(om_load3(surface.x, w[2]), a)));
        }
        om_surface_done(&surface);
        double step = area > 0 ? (volume - v) / area : 0;
        *level += fmax(-sdf->grid.spacing, fmin(sdf->grid.spacing, step));
        if (fabs(volume - v) < 1e-4 * volume) break;
    }
    return OM_OK;
}

OmStatus om__sdf_redistance(OmSdf* sdf, double volume) {
    OM_TRY(redistance_once(sdf));
    if (volume <= 0) return OM_OK;
    double level;
    OM_TRY(level_of_volume(sdf, volume, &level));
    size_t nnode = om_grid_count(sdf->grid.dim);
    for (size_t n = 0; n < nnode; n++) sdf->d[n] -= (float)level;
    return OM_OK;
}

OmStatus om_sdf_from_function(OmShapeFn fn, void* ctx, OmVec3 lo, OmVec3 hi, const OmSdfDef* def,
                              OmSdf* sdf) {
    OM_TRY(om__sdf_grid(def, lo, hi, sdf));
    OmStatus status = om__sdf_sample(sdf, fn, ctx);
    if (status >= 0 && !def->is_raw) status = om__sdf_redistance(sdf, 0);
    if (status < 0) om_sdf_done(sdf);
    return status;
}

// ---- from surfaces --------------------------------------------------------------------------------------------

// For each crossing of a triangle by a grid line along `axis`, add +-1 to `crossing` at the first node behind it.
static void count_crossings(const OmSurface* s, const OmSdf* sdf, int axis, signed char* crossing) {
    const int u = (axis + 1) % 3, w = (axis + 2) % 3;
    const double h = sdf->grid.spacing,
                 o[3] = {sdf->grid.origin.x, sdf->grid.origin.y, sdf->grid.origin.z};
    size_t stride[3];
    om_grid_stride(sdf->grid.dim, stride);
    for (int t = 0; t < s->ntri; t++) {
        const int* v = &s->tri_vert[3 * (size_t)t];
        const double* x[3];
        for (int c = 0; c < 3; c++) x[c] = &s->x[3 * (size_t)v[c]];
        double lo[2] = {fmin(x[0][u], fmin(x[1][u], x[2][u])),
                        fmin(x[0][w], fmin(x[1][w], x[2][w]))};
        double hi[2] = {fmax(x[0][u], fmax(x[1][u], x[2][u])),
                        fmax(x[0][w], fmax(x[1][w], x[2][w]))};
        int u0 = (int)fmax(floor((lo[0] - o[u]) / h), 0);
        int u1 = (int)fmin(ceil((hi[0] - o[u]) / h), sdf->grid.dim[u] - 1);
        int w0 = (int)fmax(floor((lo[1] - o[w]) / h), 0);
        int w1 = (int)fmin(ceil((hi[1] - o[w]) / h), sdf->grid.dim[w] - 1);
        for (int iw = w0; iw <= w1; iw++) {
            for (int iu = u0; iu <= u1; iu++) {
                double pu = o[u] + h * iu, pw = o[w] + h * iw;
                double e0 = om__edge_side(s->x, v[1], v[2], u, w, pu, pw);
                double e1 = om__edge_side(s->x, v[2], v[0], u, w, pu, pw);
                double e2 = om__edge_side(s->x, v[0], v[1], u, w, pu, pw);
                bool is_front = e0 > 0 && e1 > 0 && e2 > 0;
                if (!is_front && !(e0 < 0 && e1 < 0 && e2 < 0)) continue;
                double sum = e0 + e1 + e2;  // not zero: all have one sign
                double at = (e0 * x[0][axis] + e1 * x[1][axis] + e2 * x[2][axis]) / sum;
                double first = fmax(ceil((at - o[axis]) / h), 0);
                if (first > sdf->grid.dim[axis] - 1) continue;
                size_t n =
                    (size_t)first * stride[axis] + (size_t)iu * stride[u] + (size_t)iw * stride[w];
                crossing[n] = (signed char)(crossing[n] + (is_front ? -1 : 1));
            }
        }
    }
}

// Sum the crossings along the axis to winding numbers; where they are positive, add a vote; where they are above 1 or
// below 0, mark the node as folded. Returns whether there is one.
static bool cast_votes(const OmSdf* sdf, int axis, signed char* crossing, unsigned char* vote) {
    size_t stride[3];
    om_grid_stride(sdf->grid.dim, stride);
    const int u = (axis + 1) % 3, w = (axis + 2) % 3;
    bool is_folded = false;
    for (int iw = 0; iw < sdf->grid.dim[w]; iw++) {
        for (int iu = 0; iu < sdf->grid.dim[u]; iu++) {
            size_t n = (size_t)iu * stride[u] + (size_t)iw * stride[w];
            int winding = 0;
            for (int i = 0; i < sdf->grid.dim[axis]; i++, n += stride[axis]) {
                winding += crossing[n];
                if (winding > 0) vote[n]++;
                if ((unsigned)winding > 1) {
                    vote[n] |= OM__NODE_FOLDED;
                    is_folded = true;
                }
                crossing[n] = 0;
            }
        }
    }
    return is_folded;
}

typedef struct GapTask {
    const OmSdf* sdf;
    const OmWinding* winding;
    unsigned char* vote;
} GapTask;

// Nodes this far from the surface have rays that agree, unless a ray passes through a gap. Nearer ones may lie on it.
static bool is_doubtful(const OmSdf* sdf, const unsigned char* vote, size_t n) {
    return (vote[n] & OM__NODE_VOTES) % 3 != 0 && (double)sdf->d[n] > 1e-3 * sdf->grid.spacing;
}

static void decide_slices(void* ctx, int begin, int end, int block) {
    (void)block;
    const GapTask* task = ctx;
    const OmGrid* g = &task->sdf->grid;
    for (int k = begin; k < end; k++) {
        size_t n = om_grid_index(g->dim, 0, 0, k);
        for (int j = 0; j < g->dim[1]; j++)
            for (int i = 0; i < g->dim[0]; i++, n++)
                if (is_doubtful(task->sdf, task->vote, n))
                    task->vote[n] = om__winding_at(task->winding, om_grid_point(g, i, j, k)) > 0.5
                                        ? OM__NODE_VOTES
                                        : 0;
    }
}

// Where the rays disagree, the surface has gaps: the generalised winding number decides.
static OmStatus decide_gaps(const OmSurface* s, const OmSdf* sdf, unsigned char* vote) {
    const size_t nnode = om_grid_count(sdf->grid.dim);
    size_t n = 0;
    while (n < nnode && !is_doubtful(sdf, vote, n)) n++;
    if (n == nnode) return OM_OK;
    OmWinding winding;
    OM_TRY(om__winding_init(s, NULL, 0, &winding));
    GapTask task = {sdf, &winding, vote};
    OmStatus status = om_parallel_for_stop(0, sdf->grid.dim[2], 1, decide_slices, &task);
    om__winding_done(&winding);
    return status;
}

// Distances to the parts of the surface that bound the solid: walls between overlapping parts are left out.
static OmStatus measure_visible(const OmSurface* s, double exact, const unsigned char* vote,
                                OmSdf* sdf) {
    OmSurface visible;
    OM_TRY(om__surface_visible(s, &sdf->grid, vote, &visible));
    OmStatus status = om__sdf_unsigned(visible.ntri > 0 ? &visible : s, exact, sdf);
    om_surface_done(&visible);
    return status;
}

// The nodes of the caller, around the box of the surface.
static OmStatus take_grid(const OmSdfDef* def, OmVec3 lo, OmVec3 hi, OmSdf* sdf) {
    const OmGrid* g = def->grid;
    OM_TRY(om__sdf_check_def(def));
    OM_CHECK(g->spacing > 0 && isfinite(g->spacing), OM_INVALID,
             "distance field: the grid's spacing %g m must be positive", g->spacing);
    double nnode = 1;
    for (int a = 0; a < 3; a++) nnode *= fmax(g->dim[a], 0);
    OM_CHECK(nnode >= 1 && nnode <= (double)def->max_node && nnode < 2e9, OM_INVALID,
             "distance field: a grid of %d x %d x %d nodes", g->dim[0], g->dim[1], g->dim[2]);
    OmVec3 end = om_grid_end(g);
    OM_CHECK(lo.x >= g->origin.x && lo.y >= g->origin.y && lo.z >= g->origin.z && hi.x <= end.x &&
                 hi.y <= end.y && hi.z <= end.z,
             OM_INVALID, "distance field: the grid does not enclose the surface");
    sdf->grid = *g;
    OM_ALLOC(sdf->d, nnode);
    return OM_OK;
}

OmStatus om_sdf_from_surface(const OmSurface* surface, const OmSdfDef* def, OmSdf* sdf) {
    OmStatus status = OM_OK;
    signed char* crossing = NULL;
    unsigned char* vote = NULL;
    OmSurface turned = {0};
    memset(sdf, 0, sizeof *sdf);
    OM_CHECK(surface->ntri > 0 && surface->nvert > 0, OM_INVALID, "the surface has no triangles");
    OmVec3 lo = om_load3(surface->x, 0), hi = lo;
    for (int v = 0; v < surface->nvert; v++) {
        OmVec3 x = om_load3(surface->x, v);
        OM_CHECK(om_is_finite3(x), OM_INVALID,
                 "vertex %d of the surface has a coordinate that is not finite", v);
        lo = om_min3(lo, x);
        hi = om_max3(hi, x);
    }
    OM_TRY_DONE(def->grid ? take_grid(def, lo, hi, sdf) : om__sdf_grid(def, lo, hi, sdf));

    // a surface with normals that point inward is reversed
    OM_TRY_DONE(om_surface_init(&turned, surface->nvert, surface->ntri));
    memcpy(turned.x, surface->x, (size_t)surface->nvert * 3 * sizeof(double));
    bool is_inward = om_surface_volume(surface) < 0;
    for (int t = 0; t < surface->ntri; t++) {
        const int* v = &surface->tri_vert[3 * (size_t)t];
        int* w = &turned.tri_vert[3 * (size_t)t];
        w[0] = v[0];
        w[1] = is_inward ? v[2] : v[1];
        w[2] = is_inward ? v[1] : v[2];
    }

    size_t nnode = om_grid_count(sdf->grid.dim), ninside = 0;
    OM_CALLOC_DONE(crossing, nnode);
    OM_CALLOC_DONE(vote, nnode);
    bool is_folded = false;
    for (int axis = 0; axis < 3; axis++) {
        count_crossings(&turned, sdf, axis, crossing);
        is_folded |= cast_votes(sdf, axis, crossing, vote);
    }
    if (is_folded)
        OM_TRY_DONE(measure_visible(&turned, def->exact, vote, sdf));
    else
        OM_TRY_DONE(om__sdf_unsigned(&turned, def->exact, sdf));
    OM_TRY_DONE(decide_gaps(&turned, sdf, vote));
    for (size_t n = 0; n < nnode; n++) {
        if (!(vote[n] & OM__NODE_INSIDE)) continue;
        sdf->d[n] = -sdf->d[n];
        ninside++;
    }
    OM_CHECK_DONE(ninside > 0 || def->grid, OM_INVALID,
                  "the surface encloses nothing at a spacing of %.3g mm: it is open or too thin",
                  def->spacing * 1e3);
done:
    om_free(crossing);
    om_free(vote);
    om_surface_done(&turned);
    if (status < 0) om_sdf_done(sdf);
    return status;
}

double om_half_ellipsoid_eval(OmVec3 h, OmVec3 p) {
    OmVec3 q = om_vec3(p.x / h.x, p.y / h.y, p.z / h.z);
    OmVec3 g = om_vec3(q.x / h.x, q.y / h.y, q.z / h.z);
    // (|q|^2 - 1) over its slope: a distance to first order; the slope is bounded away from 0 at the centre
    double f = 0.5 * (om_norm2(q) - 1) / fmax(om_norm(g), 0.5 / h.x);
    return fmax(f, -p.z);
}
