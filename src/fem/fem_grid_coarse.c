// fem_grid_coarse.c: the compliance of the body at rest, on a grid of twice the spacing.
//
// The coarse grid has every second point; nodes between its points take the mean of their neighbours (interpolation P).
// The inverse of P^T K P, K the stiffness at rest, is stored in full in bfloat16: 5 MB for the phantom (544 points).
// The time of a product is that of reading it. The rounding, 0.4 %, is corrected by the next cycle of the solver.
#include <string.h>

#include "base/base_simd.h"
#include "fem/fem_grid_internal.h"

#define NBLOCK 24      // right-hand sides solved together
#define MAX_NODE 3800  // of the coarse grid: 260 MB
#define STIFFEN \
    1e-5  // times the mean diagonal is added to it: points at the rim have little stiffness

struct GridCoarse {
    int nnode, nfine;
    int* parent;             // coarse nodes of a node, then -1                       (nfine x 8)
    float* weight;           //                                                  (nfine x 8)
    int *child_adr, *child;  // the transpose                              (nnode + 1), (all)
    float* child_weight;     //                                                       (all)
    uint16_t* inverse;       // bfloat16                               (3 nnode x 3 nnode)
};

void om__grid_coarse_destroy(GridCoarse* c) {
    if (!c) return;
    om_free(c->parent);
    om_free(c->weight);
    om_free(c->child_adr);
    om_free(c->child);
    om_free(c->child_weight);
    om_free(c->inverse);
    om_free(c);
}

int om__grid_coarse_size(const GridCoarse* c) { return c->nnode; }

// ---- interpolation ------------------------------------------------------------------------------------

// Points of the coarse grid around a node with their weights; none for a fixed node.
static int find_parents(const OmFemGrid* g, int node, const int dim[3], int point[8],
                        float weight[8]) {
    int at[3], p = g->node_point[node], num = 0;
    for (int c = 0; c < 3; ++c) at[c] = p % g->grid.dim[c], p /= g->grid.dim[c];
    for (int corner = 0; corner < 8 && !g->fixed[node]; ++corner) {
        int to[3];
        float w = 1;
        for (int c = 0; c < 3; ++c) {
            int is_high = corner >> c & 1;
            to[c] = at[c] / 2 + is_high;
            w *= at[c] % 2 ? 0.5f : is_high ? 0 : 1;
        }
        if (w == 0) continue;
        point[num] = to[0] + dim[0] * (to[1] + dim[1] * to[2]);
        weight[num++] = w;
    }
    return num;
}

static OmStatus interpolate(const OmFemGrid* g, GridCoarse* c) {
    int dim[3], npoint = 1, *number = NULL, nchild = 0;
    OmStatus status = OM_OK;
    for (int k = 0; k < 3; ++k) npoint *= dim[k] = g->grid.dim[k] / 2 + 1;
    OM_ALLOC_DONE(c->parent, 8 * (size_t)c->nfine);
    OM_CALLOC_DONE(c->weight, 8 * (size_t)c->nfine);
    OM_ALLOC_DONE(number, npoint);
    memset(number, -1, (size_t)npoint * sizeof *number);
    memset(c->parent, -1, 8 * (size_t)c->nfine * sizeof *c->parent);
    for (int i = 0; i < c->nfine; ++i) {
        int* point = c->parent + 8 * (size_t)i;
        int num = find_parents(g, i, dim, point, c->weight + 8 * (size_t)i);
        for (int k = 0; k < num; ++k) {
            if (number[point[k]] < 0) number[point[k]] = c->nnode++;
            point[k] = number[point[k]];
        }
        nchild += num;
    }
    OM_CALLOC_DONE(c->child_adr, c->nnode + 1);
    OM_ALLOC_DONE(c->child, nchild ? nchild : 1);
    OM_ALLOC_DONE(c->child_weight, nchild ? nchild : 1);
    for (int k = 0; k < 8 * c->nfine; ++k)
        if (c->parent[k] >= 0) ++c->child_adr[c->parent[k] + 1];
    for (int i = 0; i < c->nnode; ++i) c->child_adr[i + 1] += c->child_adr[i];
    for (int k = 8 * c->nfine - 1; k >= 0; --k) {  // backwards: each end becomes a beginning
        if (c->parent[k] < 0) continue;
        int to = --c->child_adr[c->parent[k] + 1];
        c->child[to] = k / 8;
        c->child_weight[to] = c->weight[k];
    }
    for (int i = 0; i < c->nnode; ++i) c->child_adr[i] = c->child_adr[i + 1];
    c->child_adr[c->nnode] = nchild;
done:
    om_free(number);
    return status;
}

// ---- the matrix ---------------------------------------------------------------------------------------

// Coarse nodes from which the corners of an element are interpolated, up to 8, and their weights.
static int find_cell(const GridCoarse* c, const int* node, int cell[8], double weight[8][8]) {
    int num = 0;
    memset(weight, 0, 64 * sizeof(double));
    for (int a = 0; a < 8; ++a)
        for (int k = 0; k < 8; ++k) {
            int p = c->parent[8 * (size_t)node[a] + (size_t)k], at = 0;
            if (p < 0) break;
            while (at < num && cell[at] != p) ++at;
            if (at == num) cell[num++] = p;
            weight[at][a] = (double)c->weight[8 * (size_t)node[a] + (size_t)k];
        }
    return num;
}

static void add_element(const double* K, int num, const int cell[8], const double weight[8][8],
                        OmBsr* A) {
    for (int m = 0; m < num; ++m)
        for (int n = 0; n < num; ++n) {
            double sum[9] = {0};
            for (int a = 0; a < 8; ++a)
                for (int b = 0; b < 8; ++b)
                    for (int k = 0; k < 9; ++k)
                        sum[k] += weight[m][a] * weight[n][b] *
                                  K[24 * (3 * a + k % 3) + 3 * b + k / 3];  // by columns
            om_bsr_add(A, om_bsr_find(A, cell[m], cell[n]),
                       (OmMat3){{sum[0], sum[1], sum[2]},
                                {sum[3], sum[4], sum[5]},
                                {sum[6], sum[7], sum[8]}});
        }
}

static OmStatus make_matrix(const GridElements* t, const GridCoarse* c, OmBsr* A) {
    const OmFemMesh* mesh = &t->grid->mesh;
    double K[24 * 24], weight[8][8], trace = 0;
    int* all = NULL;
    OmStatus status = OM_OK;
    OM_CALLOC_DONE(all, 8 * (size_t)mesh->nelem);
    for (int e = 0; e < mesh->nelem; ++e) {
        int cell[8];
        int num = find_cell(c, mesh->elem_node + 8 * (size_t)e, cell, weight);
        for (int k = 0; k < 8; ++k)
            all[8 * (size_t)e + (size_t)k] = num ? cell[k < num ? k : 0] : 0;
    }
    OM_TRY_DONE(om_bsr_create(c->nnode, mesh->nelem, 8, all, A));
    OM_TRY_DONE(om_bsr_make_exact(A));
    om__grid_rest_stiffness(t, K);
    for (int e = 0; e < mesh->nelem; ++e) {
        int cell[8];
        int num = find_cell(c, mesh->elem_node + 8 * (size_t)e, cell, weight);
        add_element(K, num, cell, (const double(*)[8])weight, A);
    }
    for (int i = 0; i < c->nnode; ++i)
        for (int k = 0; k < 9; k += 4)
            trace += A->exact[9 * (size_t)A->row_adr[i] + (size_t)k] / (3 * c->nnode);
    for (int i = 0; i < c->nnode; ++i) {
        double d = STIFFEN * trace;
        om_bsr_add(A, A->row_adr[i], (OmMat3){{d, 0, 0}, {0, d, 0}, {0, 0, d}});
    }
done:
    om_free(all);
    return status;
}

static uint16_t round_bits(float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (uint16_t)((bits + 0x7fff + (bits >> 16 & 1)) >> 16);
}

static OmStatus invert(const OmBsr* A, int nworker, GridCoarse* c) {
    const int n = 3 * c->nnode;
    double *b = NULL, *x = NULL;
    OmSolver* solver = NULL;
    OmSolverDef how = om_solver_default_def();
    OmStatus status = OM_OK;
    how.preconditioner = OM_CHOLESKY;
    how.nworker = nworker;
    OM_ALLOC_DONE(c->inverse, (size_t)n * (size_t)n);
    OM_ALLOC_DONE(b, NBLOCK * (size_t)n);
    OM_ALLOC_DONE(x, NBLOCK * (size_t)n);
    OM_TRY_DONE(om_solver_create(&how, A, NULL, &solver));
    OM_TRY_DONE(om__grid_solved(om_solver_refresh(solver, A)));
    for (int first = 0; first < n; first += NBLOCK) {
        int num = n - first < NBLOCK ? n - first : NBLOCK;
        memset(b, 0, (size_t)num * (size_t)n * sizeof *b);
        memset(x, 0, (size_t)num * (size_t)n * sizeof *x);
        for (int k = 0; k < num; ++k) b[(size_t)k * (size_t)n + (size_t)(first + k)] = 1;
        OM_TRY_DONE(om__grid_solved(om_solver_solve(solver, A, num, b, x, NULL)));
        for (int k = 0; k < num; ++k)
            for (int i = 0; i < n; ++i)
                c->inverse[(size_t)(first + k) * (size_t)n + (size_t)i] =
                    round_bits((float)x[(size_t)k * (size_t)n + (size_t)i]);
    }
done:
    om_solver_destroy(solver);
    om_free(b);
    om_free(x);
    return status;
}

OmStatus om__grid_coarse_create(const GridElements* t, int nworker, GridCoarse** out) {
    *out = NULL;
    OmBsr A = {0};
    OmStatus status = OM_OK;
    GridCoarse* c = om_calloc(1, sizeof *c);
    if (!c) return OM_NO_MEMORY;
    c->nfine = t->grid->mesh.nnode;
    OM_TRY_DONE(interpolate(t->grid, c));
    OM_CHECK_DONE(
        c->nnode > 0 && c->nnode <= MAX_NODE, OM_UNAVAILABLE,
        "grid: equilibrium is computed on up to %d points of twice the spacing; this grid has %d",
        MAX_NODE, c->nnode);
    OM_TRY_DONE(make_matrix(t, c, &A));
    OM_TRY_DONE(invert(&A, nworker, c));
done:
    om_bsr_destroy(&A);
    if (status < 0)
        om__grid_coarse_destroy(c);
    else
        *out = c;
    return status < 0 ? status : OM_OK;
}

// ---- corrections ---------------------------------------------------------------------------------------

void om__grid_coarse_restrict(const GridCoarse* c, const float* r, float* sum, int begin, int end) {
    for (int m = begin; m < end; ++m) {
        float* to = sum + 3 * (size_t)m;
        to[0] = to[1] = to[2] = 0;
        for (int k = c->child_adr[m]; k < c->child_adr[m + 1]; ++k)
            for (int i = 0; i < 3; ++i)
                to[i] += c->child_weight[k] * r[3 * (size_t)c->child[k] + (size_t)i];
    }
}

typedef uint32_t U16 __attribute__((vector_size(64)));
typedef uint16_t H16 __attribute__((vector_size(32)));

OM_MULTIVERSION void om__grid_coarse_multiply(const GridCoarse* c, const float* sum, float* answer,
                                              int begin, int end) {
    const int n = 3 * c->nnode;
    for (int row = 3 * begin; row < 3 * end; ++row) {
        const uint16_t* a = c->inverse + (size_t)row * (size_t)n;
        V16 lane = {0}, x;
        H16 half;
        float total = 0;
        int k = 0;
        for (; k + 16 <= n; k += 16) {
            memcpy(&half, a + k, sizeof half);
            memcpy(&x, sum + k, sizeof x);
            lane += (V16)(__builtin_convertvector(half, U16) << 16) * x;
        }
        for (; k < n; ++k) {
            uint32_t bits = (uint32_t)a[k] << 16;
            float entry;
            memcpy(&entry, &bits, sizeof entry);
            total += entry * sum[k];
        }
        for (int l = 0; l < 16; ++l) total += lane[l];
        answer[row] = total;
    }
}

void om__grid_coarse_prolong(const GridCoarse* c, const float* answer, float* z, int begin,
                             int end) {
    for (int n = begin; n < end; ++n) {
        float* to = z + 3 * (size_t)n;
        to[0] = to[1] = to[2] = 0;
        for (size_t k = 8 * (size_t)n; k < 8 * (size_t)n + 8 && c->parent[k] >= 0; ++k)
            for (int i = 0; i < 3; ++i) to[i] += c->weight[k] * answer[3 * c->parent[k] + i];
    }
}
