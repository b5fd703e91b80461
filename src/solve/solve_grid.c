// solve_grid.c: coarse spaces from a background grid.
//
// The points lie in a box of cubic cells about 2h wide. Each cell is six tetrahedra around its main
// diagonal (Kuhn), and a point takes the values of the four corners of its tetrahedron by barycentric
// coordinates: linear fields, hence translations and the linear part of rotations, are reproduced.
// Compared with trilinear interpolation (eight corners) the coarse matrices have two thirds of the
// blocks and need one CG iteration more (measured on the lift beams). Unused nodes are removed.
#include <math.h>
#include <string.h>

#include "solve/solve_multigrid.h"

#define MIN_WEIGHT 1e-5  // smaller barycentric coordinates count as zero: the point lies on a face

typedef struct Grid {
    OmVec3 lo;
    double size[3];  // of a cell
    int num[3];      // cells
} Grid;

static Grid make_grid(int n, const double* x, double h) {
    OmVec3 lo = om_load3(x, 0), hi = lo;
    for (int i = 1; i < n; ++i) {
        lo = om_min3(lo, om_load3(x, i));
        hi = om_max3(hi, om_load3(x, i));
    }
    Grid g = {.lo = lo};
    const double ext[3] = {hi.x - lo.x, hi.y - lo.y, hi.z - lo.z};
    for (int a = 0; a < 3; ++a) {
        double num = h > 0.0 ? rint(ext[a] / h) : 1.0;
        g.num[a] = num < 1.0 ? 1 : num > 1000.0 ? 1000 : (int)num;
        g.size[a] = ext[a] > 0.0 ? ext[a] / g.num[a] : 1.0;
    }
    return g;
}

// Grid nodes and weights of one point; returns the number of nonzero weights. `layer` is its cell along `axis`.
static int locate(const Grid* g, OmVec3 p, int axis, int64_t node[4], double weight[4],
                  int* layer) {
    const double s[3] = {(p.x - g->lo.x) / g->size[0], (p.y - g->lo.y) / g->size[1],
                         (p.z - g->lo.z) / g->size[2]};
    int cell[3], order[3] = {0, 1, 2};
    double f[3];
    for (int a = 0; a < 3; ++a) {
        cell[a] = (int)(s[a] + 1e-9);
        cell[a] = cell[a] > g->num[a] - 1 ? g->num[a] - 1 : cell[a];
        f[a] = fmin(fmax(s[a] - cell[a], 0.0), 1.0);
    }
    *layer = cell[axis];
    // Walk from the low corner to the high one, largest coordinate first.
    for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2 - a; ++b)
            if (f[order[b]] < f[order[b + 1]]) {
                int swap = order[b];
                order[b] = order[b + 1];
                order[b + 1] = swap;
            }
    const double w[4] = {1 - f[order[0]], f[order[0]] - f[order[1]], f[order[1]] - f[order[2]],
                         f[order[2]]};
    int num = 0;
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
        if (k > 0) ++cell[order[k - 1]];
        if (w[k] < MIN_WEIGHT) continue;
        node[num] =
            cell[0] + (g->num[0] + 1) * ((int64_t)cell[1] + (int64_t)(g->num[1] + 1) * cell[2]);
        weight[num++] = w[k];
        sum += w[k];
    }
    for (int k = 0; k < num; ++k)
        weight[k] /= sum;  // the weights summed to 1: at least one was kept
    return num;
}

static OmVec3 node_position(const Grid* g, int64_t node) {
    int64_t i = node % (g->num[0] + 1), jk = node / (g->num[0] + 1);
    int64_t j = jk % (g->num[1] + 1), k = jk / (g->num[1] + 1);
    return om_vec3(g->lo.x + (double)i * g->size[0], g->lo.y + (double)j * g->size[1],
                   g->lo.z + (double)k * g->size[2]);
}

// ---- transposed lists -------------------------------------------------------------------------------

static void transpose(OmInterp* P) {
    memset(P->t_adr, 0, ((size_t)P->ncoarse + 2) * sizeof(int));
    for (int e = 0; e < P->nentry; ++e) ++P->t_adr[P->col[e] + 2];
    for (int c = 0; c < P->ncoarse; ++c) P->t_adr[c + 2] += P->t_adr[c + 1];
    for (int i = 0; i < P->nfine; ++i) {
        for (int e = P->adr[i]; e < P->adr[i + 1]; ++e) {
            int at = P->t_adr[P->col[e] + 1]++;
            P->t_row[at] = i;
            P->t_entry[at] = e;
        }
    }
}

static void sort_layers(OmInterp* P, const int* layer) {
    for (int i = 0; i < P->nfine; ++i) ++P->layer_adr[layer[i] + 2];
    for (int c = 0; c < P->nlayer; ++c) P->layer_adr[c + 2] += P->layer_adr[c + 1];
    for (int i = 0; i < P->nfine; ++i) P->layer_row[P->layer_adr[layer[i] + 1]++] = i;
}

static void* take(size_t* memory, size_t count, size_t size) {
    *memory += count * size;
    return om_calloc(count, size);
}

OmStatus om__grid_interpolate(int n, const double* x, double h, OmInterp* P, double** node,
                              size_t* memory) {
    OmStatus status = OM_OK;
    Grid g = make_grid(n, x, h);
    int axis = g.num[0] >= g.num[1] ? (g.num[0] >= g.num[2] ? 0 : 2) : g.num[1] >= g.num[2] ? 1 : 2;
    size_t nnode = (size_t)(g.num[0] + 1) * (size_t)(g.num[1] + 1) * (size_t)(g.num[2] + 1);
    int *number = NULL, *layer = NULL;
    OM_CHECK(nnode < INT32_MAX / 4, OM_INVALID, "positions are too far apart for a multigrid");
    OM_CALLOC_DONE(number, nnode);
    OM_ALLOC_DONE(layer, n);
    *P = (OmInterp){.nfine = n, .nlayer = g.num[axis]};
    P->adr = take(memory, (size_t)n + 1, sizeof(int));
    P->col = take(memory, 4 * (size_t)n, sizeof(int));
    P->base = take(memory, 4 * (size_t)n, sizeof(float));
    P->layer_adr = take(memory, (size_t)P->nlayer + 2, sizeof(int));
    P->layer_row = take(memory, (size_t)n, sizeof(int));
    P->mask = take(memory, (size_t)n, 1);
    OM_CHECK_DONE(P->mask && P->adr && P->col && P->base && P->layer_adr && P->layer_row,
                  OM_NO_MEMORY, "out of memory for the multigrid");

    // Entries with grid numbers first; then the used nodes are numbered in grid order.
    for (int i = 0; i < n; ++i) {
        int64_t corner[4];
        double weight[4];
        int num = locate(&g, om_load3(x, i), axis, corner, weight, &layer[i]);
        for (int k = 0; k < num; ++k) {
            P->col[P->nentry] = (int)corner[k];
            P->base[P->nentry++] = (float)weight[k];
            number[corner[k]] = 1;
        }
        P->adr[i + 1] = P->nentry;
    }
    for (size_t k = 0; k < nnode; ++k) number[k] = number[k] ? P->ncoarse++ : -1;
    for (int e = 0; e < P->nentry; ++e) P->col[e] = number[P->col[e]];
    OM_ALLOC_DONE(*node, 3 * (size_t)P->ncoarse);
    for (size_t k = 0; k < nnode; ++k)
        if (number[k] >= 0) om_store3(*node, number[k], node_position(&g, (int64_t)k));

    P->weight = take(memory, 4 * (size_t)P->nentry, sizeof(float));
    P->t_adr = take(memory, (size_t)P->ncoarse + 2, sizeof(int));
    P->t_row = take(memory, (size_t)P->nentry, sizeof(int));
    P->t_entry = take(memory, (size_t)P->nentry, sizeof(int));
    OM_CHECK_DONE(P->weight && P->t_adr && P->t_row && P->t_entry, OM_NO_MEMORY,
                  "out of memory for the multigrid");
    transpose(P);
    sort_layers(P, layer);
    om__interp_mask(P, NULL);
done:
    om_free(number);
    om_free(layer);
    return status;
}

void om__interp_done(OmInterp* P) {
    om_free(P->adr);
    om_free(P->col);
    om_free(P->base);
    om_free(P->weight);
    om_free(P->mask);
    om_free(P->t_adr);
    om_free(P->t_row);
    om_free(P->t_entry);
    om_free(P->layer_adr);
    om_free(P->layer_row);
    *P = (OmInterp){0};
}

const float om__mask_lanes[8][4] = {{1, 1, 1, 0}, {0, 1, 1, 0}, {1, 0, 1, 0}, {0, 0, 1, 0},
                                    {1, 1, 0, 0}, {0, 1, 0, 0}, {1, 0, 0, 0}, {0, 0, 0, 0}};

void om__interp_mask(OmInterp* P, const unsigned char* fixed) {
    for (int i = 0; i < P->nfine; ++i) {
        const unsigned char* f = fixed ? fixed + 3 * (size_t)i : NULL;
        P->mask[i] = f ? (unsigned char)((f[0] != 0) | (f[1] != 0) << 1 | (f[2] != 0) << 2) : 0;
        const float* lane = om__mask_lanes[P->mask[i]];
        for (int e = P->adr[i]; e < P->adr[i + 1]; ++e)
            for (int c = 0; c < 3; ++c) P->weight[4 * (size_t)e + (size_t)c] = lane[c] * P->base[e];
    }
}
