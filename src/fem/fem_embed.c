// fem_embed.c: the element that contains a point, and the weights of its nodes.
//
// Elements are sorted into a grid of buckets by their bounding boxes, slightly enlarged. A point tests the
// elements of its bucket, then of rings of buckets around it until no nearer one is possible. In each element
// Newton's method gives the reference coordinates; a point outside is moved to the nearest reference point by
// clamping, and the element with the smallest distance is chosen.
#include <stdlib.h>
#include <string.h>

#include "fem/fem_solid.h"

typedef struct Buckets {
    OmGrid grid;  // dim: cells
    int* adr;     // (cells + 1)
    int* elem;    // elements whose box meets the cell
} Buckets;

static void elem_box(const OmFemMesh* mesh, int e, OmVec3* lo, OmVec3* hi) {
    const int* node = mesh->elem_node + (size_t)e * (size_t)mesh->nelem_node;
    *lo = *hi = om_load3(mesh->x, node[0]);
    for (int a = 1; a < mesh->nelem_node; ++a) {
        *lo = om_min3(*lo, om_load3(mesh->x, node[a]));
        *hi = om_max3(*hi, om_load3(mesh->x, node[a]));
    }
}

// Count (adr) or list (elem) elements of the cells.
static void fill_buckets(const OmFemMesh* mesh, Buckets* b, bool is_list) {
    for (int e = 0; e < mesh->nelem; ++e) {
        OmVec3 lo, hi;
        int from[3], to[3];
        elem_box(mesh, e, &lo, &hi);
        om_grid_cell(&b->grid, lo, from);
        om_grid_cell(&b->grid, hi, to);
        for (int k = from[2]; k <= to[2]; ++k)
            for (int j = from[1]; j <= to[1]; ++j)
                for (int i = from[0]; i <= to[0]; ++i) {
                    size_t cell = om_grid_index(b->grid.dim, i, j, k);
                    if (is_list)
                        b->elem[b->adr[cell]++] = e;
                    else
                        ++b->adr[cell + 1];
                }
    }
}

static OmStatus make_buckets(const OmFemMesh* mesh, Buckets* b) {
    OmVec3 lo = om_load3(mesh->x, 0), hi = lo;
    double side = 0;
    for (int e = 0; e < mesh->nelem; ++e) {
        OmVec3 l, h;
        elem_box(mesh, e, &l, &h);
        lo = om_min3(lo, l), hi = om_max3(hi, h);
        side += cbrt((h.x - l.x) * (h.y - l.y) * (h.z - l.z));
    }
    b->grid.origin = lo;
    b->grid.spacing = side / mesh->nelem;
    const double size[3] = {hi.x - lo.x, hi.y - lo.y, hi.z - lo.z};
    double cells = 1;
    OM_CHECK(b->grid.spacing > 0, OM_INVALID, "om_fem_mesh_embed: the elements are flat");
    for (int c = 0; c < 3; ++c) {
        double num = fmin(1 + floor(size[c] / b->grid.spacing), 200);
        b->grid.dim[c] = (int)num;
        cells *= num;
    }
    for (int c = 0; c < 3; ++c) b->grid.spacing = fmax(b->grid.spacing, size[c] / b->grid.dim[c]);
    int ncell = (int)cells;
    b->adr = om_calloc((size_t)ncell + 1, sizeof(int));
    if (!b->adr) return OM_NO_MEMORY;
    fill_buckets(mesh, b, false);
    for (int n = 0; n < ncell; ++n) b->adr[n + 1] += b->adr[n];
    OM_ALLOC(b->elem, b->adr[ncell]);
    fill_buckets(mesh, b, true);
    memmove(b->adr + 1, b->adr, (size_t)ncell * sizeof(int));
    b->adr[0] = 0;
    return OM_OK;
}

// Clamp to the reference element: the simplex by clipping and scaling, the cube by clipping.
static void clamp_inside(OmElement kind, double xi[3]) {
    bool is_hex = kind == OM_HEX8 || kind == OM_HEX8_MEAN;
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        xi[k] = fmin(fmax(xi[k], is_hex ? -1 : 0), 1);
        sum += xi[k];
    }
    for (int k = 0; k < 3 && !is_hex && sum > 1; ++k) xi[k] /= sum;
}

// Weights of the point of element e nearest to p; returns its distance from p.
static double project_point(const OmFemMesh* mesh, int e, OmVec3 p, double* weight) {
    const int* node = mesh->elem_node + (size_t)e * (size_t)mesh->nelem_node;
    double xi[3], dN[3 * OM_MAX_ELEM_NODE];
    om__element_centre(mesh->kind, xi);
    for (int turn = 0; turn < 20; ++turn) {
        om__element_shape(mesh->kind, xi, weight, dN);
        OmVec3 at = {0, 0, 0};
        for (int a = 0; a < mesh->nelem_node; ++a)
            at = om_madd(at, weight[a], om_load3(mesh->x, node[a]));
        OmMat3 inverse;
        if (om_mat3_inverse(om__element_jacobian(mesh->nelem_node, dN, mesh->x, node), &inverse) <
            0)
            break;
        OmVec3 step = om_mat3_apply(inverse, om_sub(p, at));
        xi[0] += step.x, xi[1] += step.y, xi[2] += step.z;
        for (int k = 0; k < 3; ++k) xi[k] = fmin(fmax(xi[k], -3), 3);
        if (om_norm(step) < 1e-13) break;
    }
    bool is_in = om__element_inside(mesh->kind, xi) >= -1e-9;
    if (!is_in) clamp_inside(mesh->kind, xi);
    om__element_shape(mesh->kind, xi, weight, NULL);
    OmVec3 at = {0, 0, 0};
    for (int a = 0; a < mesh->nelem_node; ++a)
        at = om_madd(at, weight[a], om_load3(mesh->x, node[a]));
    return is_in ? 0 : om_distance(at, p);
}

static void embed_point(const OmFemMesh* mesh, const Buckets* b, OmVec3 p, int* elem,
                        double* weight) {
    int cell[3];
    double best = INFINITY, w[OM_MAX_ELEM_NODE];
    om_grid_cell(&b->grid, p, cell);
    int reach = b->grid.dim[0] > b->grid.dim[1] ? b->grid.dim[0] : b->grid.dim[1];
    reach = reach > b->grid.dim[2] ? reach : b->grid.dim[2];
    // how far p is outside the grid of buckets: rings start there
    OmVec3 hi = om_grid_point(&b->grid, b->grid.dim[0], b->grid.dim[1], b->grid.dim[2]);
    double out = om_distance(p, om_min3(om_max3(p, b->grid.origin), hi));
    for (int ring = 0; ring <= reach && best > 0; ++ring) {
        if (best <= fmax(out, 0) + (ring - 1) * b->grid.spacing && ring > 1) break;
        for (int k = cell[2] - ring; k <= cell[2] + ring; ++k)
            for (int j = cell[1] - ring; j <= cell[1] + ring; ++j)
                for (int i = cell[0] - ring; i <= cell[0] + ring; ++i) {
                    bool is_shell = abs(i - cell[0]) == ring || abs(j - cell[1]) == ring ||
                                    abs(k - cell[2]) == ring;
                    if (!is_shell || !om_grid_has(b->grid.dim, i, j, k)) continue;
                    size_t n = om_grid_index(b->grid.dim, i, j, k);
                    for (int m = b->adr[n]; m < b->adr[n + 1] && best > 0; ++m) {
                        double d = project_point(mesh, b->elem[m], p, w);
                        if (d >= best) continue;
                        best = d;
                        *elem = b->elem[m];
                        memcpy(weight, w, (size_t)mesh->nelem_node * sizeof *w);
                    }
                }
    }
}

OmStatus om_fem_mesh_embed(const OmFemMesh* mesh, int n, const double* p, int* elem,
                           double* weight) {
    for (int i = 0; i < n; ++i)
        OM_CHECK(om_is_finite3(om_load3(p, i)), OM_INVALID, "point %d is not finite", i);
    Buckets b = {0};
    OmStatus status = make_buckets(mesh, &b);
    for (int i = 0; i < n && status == OM_OK; ++i) {
        elem[i] = 0;
        embed_point(mesh, &b, om_load3(p, i), &elem[i],
                    weight + (size_t)i * (size_t)mesh->nelem_node);
    }
    om_free(b.adr);
    om_free(b.elem);
    return status;
}
