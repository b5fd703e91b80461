// test_candidates.h: stiffness, small strain, of the elements that were compared for thin tissue, in double.
//
// CAND_LINEAR     tetrahedra, 4 nodes
// CAND_QUADRATIC  tetrahedra, 10 nodes, integrated as in the engine (fem_quadratic.h)
// CAND_EDGE       tetrahedra, 4 nodes: deviatoric strain averaged around edges, volumetric around nodes (Liu and
//                 Nguyen, Smoothed finite element methods, 2010): OM_SMOOTHED at rest with OM_MOONEY_RIVLIN
// CAND_HEX1, 7    solid-shell hexahedra, 8 nodes, thickness along the third axis: transverse shear assumed from mid
//                 edges (Dvorkin and Bathe 1984), thickness strain from corners (Betsch and Stein 1995), both of the
//                 mid-surface; enhanced by 1 (linear thickness strain; Buechter, Ramm and Roehl 1994) or 7
//                 parameters (membrane and thickness; Klinkel, Gruttmann and Wagner 2006)
// CAND_PRISM      solid-shell prisms, 6 nodes: transverse shear of MITC3 (Lee and Bathe 2004), thickness strain from
//                 the corners, 1 parameter
// CAND_PRISM_PLUS the same with the transverse shear of MITC3+ (Lee, Lee and Bathe 2014) and its bubble, two parameters
//                 more; close to MITC-S6 (Ko and Lee 2017)
//
// Covariant strains E_ij are interpolated, then turned to Cartesian axes by the Jacobian of the point; parameters are
// eliminated element by element.
#ifndef OMENTUM_TEST_CANDIDATES_H
#define OMENTUM_TEST_CANDIDATES_H

#include "test_common.h"

#include "fem/fem_principal.h"
#include "omentum/fem.h"

typedef enum CandKind {
    CAND_LINEAR,
    CAND_QUADRATIC,
    CAND_EDGE,
    CAND_HEX1,
    CAND_HEX7,
    CAND_PRISM,
    CAND_PRISM_PLUS,
    CAND_NUM
} CandKind;

static const char* const cand_name[CAND_NUM] = {
    "linear tet",         "quadratic tet",     "edge-smoothed tet", "solid-shell hex, 1",
    "solid-shell hex, 7", "solid-shell prism", "solid-shell prism+"};

#define CAND_PART 128  // most nodes of a part
#define CAND_MORE 7    // most parameters
#define CAND_COL (24 + CAND_MORE)

typedef struct CandBody {
    CandKind kind;
    double lambda, mu;                // Pa
    OmFemMesh mesh;                   // its nodes; prisms are halves of its hexahedra
    int npart;                        // elements, or patches of CAND_EDGE
    int *part_adr, *part_node;        // nodes of each part
    double *part_grad, *part_volume;  // of CAND_EDGE: the mean gradient of each node; m^3
    double* mass;                     // lumped, of 1000 kg/m^3, kg (nnode)
    OmBsr K;
} CandBody;

// ---- solid-shells -------------------------------------------------------------------------------------------

// Voigt order: 11, 22, 33, 2 12, 2 13, 2 23.
static const int cand_pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

typedef struct CandShell {
    CandKind kind;
    int nnode, nmore;
    double x[8][3];
} CandShell;

// Slopes of the shape functions at natural coordinates: hexahedra in [-1, 1]^3; prisms r, s >= 0, r + s <= 1, the third
// in [-1, 1].
static inline void cand_slopes(const CandShell* e, const double at[3], double N[8],
                               double dN[8][3]) {
    static const double sign[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (int a = 0; a < e->nnode; ++a) {
        int n = e->nnode / 2, i = a % n;
        double up = a < n ? -1 : 1, h, hr, hs;
        if (n == 4) {
            double p = 1 + sign[i][0] * at[0], q = 1 + sign[i][1] * at[1];
            h = p * q / 4, hr = sign[i][0] * q / 4, hs = p * sign[i][1] / 4;
        } else {
            h = i == 0 ? 1 - at[0] - at[1] : at[i - 1];
            hr = i == 0 ? -1 : i == 1, hs = i == 0 ? -1 : i == 2;
        }
        double z = (1 + up * at[2]) / 2;
        N[a] = h * z;
        dN[a][0] = hr * z, dN[a][1] = hs * z, dN[a][2] = h * up / 2;
    }
}

// The covariant strains of the displacement, B (6 x CAND_COL), and the Jacobian J[i] = dx / d natural_i. The bubble of
// prisms, f = 27 r s (1 - r - s), moves in the plane by f times the third coordinate: columns 3 nnode + 1 and + 2.
static inline void cand_natural(const CandShell* e, const double at[3], double B[6][CAND_COL],
                                double J[3][3]) {
    double N[8], dN[8][3];
    cand_slopes(e, at, N, dN);
    memset(J, 0, 9 * sizeof J[0][0]);
    for (int a = 0; a < e->nnode; ++a)
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 3; ++c) J[i][c] += dN[a][i] * e->x[a][c];
    memset(B, 0, 6 * sizeof B[0]);
    for (int v = 0; v < 6; ++v) {
        int i = cand_pair[v][0], j = cand_pair[v][1];
        for (int a = 0; a < e->nnode; ++a)
            for (int c = 0; c < 3; ++c)
                B[v][3 * a + c] =
                    i == j ? dN[a][i] * J[i][c] : dN[a][i] * J[j][c] + dN[a][j] * J[i][c];
    }
    if (e->kind != CAND_PRISM_PLUS) return;
    double r = at[0], s = at[1], z = at[2], third[3] = {1.0 / 3, 1.0 / 3, 0}, plane[2][3] = {{0}};
    double slope[3] = {27 * s * (1 - 2 * r - s) * z, 27 * r * (1 - r - 2 * s) * z,
                       27 * r * s * (1 - r - s)};
    cand_slopes(e, third, N, dN);
    for (int k = 0; k < 2; ++k)
        for (int a = 0; a < e->nnode; ++a)
            for (int c = 0; c < 3; ++c) plane[k][c] += dN[a][k] * e->x[a][c];
    for (int v = 0; v < 6; ++v)
        for (int k = 0; k < 2; ++k) {
            int i = cand_pair[v][0], j = cand_pair[v][1];
            double along_i = 0, along_j = 0;
            for (int c = 0; c < 3; ++c)
                along_i += J[i][c] * plane[k][c], along_j += J[j][c] * plane[k][c];
            B[v][3 * e->nnode + 1 + k] =
                i == j ? slope[i] * along_i : slope[i] * along_j + slope[j] * along_i;
        }
}

// B[row] += scale times row `from` of the strains at a point of the mid-surface.
static inline void cand_tie(const CandShell* e, int row, double scale, int from, double r, double s,
                            double B[6][CAND_COL]) {
    double at[3] = {r, s, 0}, tied[6][CAND_COL], J[3][3];
    cand_natural(e, at, tied, J);
    for (int c = 0; c < CAND_COL; ++c) B[row][c] += scale * tied[from][c];
}

// MITC3: transverse shear that is constant along each edge. MITC3+: interior points. Rows 4 and 5 are e_rt and e_st.
static inline void cand_tie_prism(const CandShell* e, const double at[3], double B[6][CAND_COL]) {
    double r = at[0], s = at[1];
    if (e->kind == CAND_PRISM) {
        for (int k = 0; k < 2; ++k) {
            double twist = k == 0 ? s : -r;
            cand_tie(e, 4 + k, 1, 4 + k, k == 0 ? 0.5 : 0, k == 0 ? 0 : 0.5, B);
            cand_tie(e, 4 + k, twist, 5, 0, 0.5, B);
            cand_tie(e, 4 + k, -twist, 4, 0.5, 0, B);
            cand_tie(e, 4 + k, -twist, 5, 0.5, 0.5, B);
            cand_tie(e, 4 + k, twist, 4, 0.5, 0.5, B);
        }
        return;
    }
    const double near = 1.0 / 6, far = 2.0 / 3, d = 1e-4, third = 1.0 / 3;
    for (int k = 0; k < 2; ++k) {
        double twist = (k == 0 ? 3 * s - 1 : 1 - 3 * r) / 3;
        cand_tie(e, 4 + k, 2.0 / 3, 4 + k, k == 0 ? far : near, k == 0 ? near : far, B);
        cand_tie(e, 4 + k, -1.0 / 3, 5 - k, k == 0 ? far : near, k == 0 ? near : far, B);
        cand_tie(e, 4 + k, third, 4, near, near, B);
        cand_tie(e, 4 + k, third, 5, near, near, B);
        cand_tie(e, 4 + k, twist, 4, third + d, third + d, B);
        cand_tie(e, 4 + k, -twist, 4, third + d, third - 2 * d, B);
        cand_tie(e, 4 + k, -twist, 5, third + d, third + d, B);
        cand_tie(e, 4 + k, twist, 5, third - 2 * d, third + d, B);
    }
}

// The assumed strains at a point: rows 33, 13 and 23 are replaced.
static inline void cand_assumed(const CandShell* e, const double at[3], double B[6][CAND_COL],
                                double J[3][3]) {
    static const double corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}},
                        triangle[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    cand_natural(e, at, B, J);
    for (int v = 2; v < 6; v += v == 2 ? 2 : 1) memset(B[v], 0, sizeof B[v]);
    if (e->nnode == 6) {
        double h[3] = {1 - at[0] - at[1], at[0], at[1]};
        for (int i = 0; i < 3; ++i) cand_tie(e, 2, h[i], 2, triangle[i][0], triangle[i][1], B);
        cand_tie_prism(e, at, B);
        return;
    }
    for (int i = 0; i < 4; ++i)
        cand_tie(e, 2, (1 + corner[i][0] * at[0]) * (1 + corner[i][1] * at[1]) / 4, 2, corner[i][0],
                 corner[i][1], B);
    for (int side = -1; side < 2; side += 2) {
        cand_tie(e, 4, (1 + side * at[1]) / 2, 4, 0, side, B);
        cand_tie(e, 5, (1 + side * at[0]) / 2, 5, side, 0, B);
    }
}

static inline double cand_invert(double J[3][3], double inverse[3][3]) {
    OmMat3 m = om_mat3_cols(om_load3(J[0], 0), om_load3(J[1], 0), om_load3(J[2], 0)), back;
    assert_ok(om_mat3_inverse(m, &back));  // rows: slopes of the natural coordinates
    const double all[9] = {back.cx.x, back.cy.x, back.cz.x, back.cx.y, back.cy.y,
                           back.cz.y, back.cx.z, back.cy.z, back.cz.z};
    memcpy(inverse, all, sizeof all);
    return om_dot(m.cx, om_cross(m.cy, m.cz));
}

// Cartesian strains from covariant ones: T (6 x 6), by the inverse Jacobian.
static inline void cand_turn(double inverse[3][3], double T[6][6]) {
    for (int v = 0; v < 6; ++v)
        for (int w = 0; w < 6; ++w) {
            int i = cand_pair[v][0], j = cand_pair[v][1], k = cand_pair[w][0], l = cand_pair[w][1];
            double sum = inverse[k][i] * inverse[l][j];
            if (k != l) sum = (sum + inverse[l][i] * inverse[k][j]) / 2;
            T[v][w] = i == j ? sum : 2 * sum;
        }
}

// Natural strains of parameter m at a point: which row, and its value.
static inline double cand_enhance(const CandShell* e, int m, const double at[3], int* row) {
    static const int rows[7] = {2, 0, 1, 3, 3, 2, 2};
    *row = rows[m];
    if (e->nnode == 6) return m == 0 ? at[2] : 0;  // the other two are the bubble's
    const double value[7] = {at[2], at[0], at[1], at[0], at[1], at[0] * at[2], at[1] * at[2]};
    return value[m];
}

// A point of integration; returns false after the last one.
static inline bool cand_point(const CandShell* e, int q, double at[3], double* weight) {
    // six points in the triangle, exact to the fourth order (Dunavant 1985)
    static const double place[2] = {0.445948490915965, 0.091576213509771},
                        share[2] = {0.223381589678011 / 2, 0.109951743655322 / 2};
    const double g = sqrt(1.0 / 3);
    if (q >= (e->nnode == 8 ? 8 : 12)) return false;
    at[2] = q % 2 ? g : -g;
    if (e->nnode == 8) {
        at[0] = q & 2 ? g : -g, at[1] = q & 4 ? g : -g;
        *weight = 1;
        return true;
    }
    int k = q / 2 % 3, ring = q / 6;
    double a = place[ring], b = 1 - 2 * a;
    at[0] = k == 1 ? b : a, at[1] = k == 2 ? b : a;
    *weight = share[ring];
    return true;
}

// K (ndof x ndof, ndof = 3 nnode), the parameters eliminated.
static inline void cand_shell(const CandShell* e, double lambda, double mu, double* K) {
    int ndof = 3 * e->nnode, n = ndof + e->nmore;
    double A[CAND_COL][CAND_COL] = {{0}}, at[3] = {0, 0, 0}, weight, B[6][CAND_COL], J[3][3],
           inverse[3][3], T0[6][6], T[6][6];
    if (e->nnode == 6) at[0] = at[1] = 1.0 / 3;
    cand_natural(e, at, B, J);
    double middle = cand_invert(J, inverse);
    cand_turn(inverse, T0);
    for (int q = 0; cand_point(e, q, at, &weight); ++q) {
        double S[6][CAND_COL] = {{0}}, stress[6][CAND_COL];
        cand_assumed(e, at, B, J);
        double det = cand_invert(J, inverse);
        assert_true(det > 0);
        cand_turn(inverse, T);
        for (int v = 0; v < 6; ++v)
            for (int w = 0; w < 6; ++w)
                for (int c = 0; c < n; ++c) S[v][c] += T[v][w] * B[w][c];
        for (int m = 0; m < e->nmore; ++m) {
            int row;
            double value = cand_enhance(e, m, at, &row) * middle / det;
            for (int v = 0; v < 6; ++v) S[v][ndof + m] += T0[v][row] * value;
        }
        for (int c = 0; c < n; ++c) {
            double trace = S[0][c] + S[1][c] + S[2][c];
            for (int v = 0; v < 6; ++v)
                stress[v][c] = v < 3 ? lambda * trace + 2 * mu * S[v][c] : mu * S[v][c];
        }
        for (int v = 0; v < 6; ++v)
            for (int r = 0; r < n; ++r)
                for (int c = 0; c < n; ++c) A[r][c] += weight * det * S[v][r] * stress[v][c];
    }
    for (int p = n - 1; p >= ndof; --p)
        for (int r = 0; r < p; ++r) {
            double factor = A[r][p] / A[p][p];  // the parameters' own matrix is positive definite
            for (int c = 0; c < p; ++c) A[r][c] -= factor * A[p][c];
        }
    for (int r = 0; r < ndof; ++r)
        for (int c = 0; c < ndof; ++c) K[r * ndof + c] = A[r][c];
}

// ---- tetrahedra ---------------------------------------------------------------------------------------------

static const int cand_edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

// Gradients of the barycentric coordinates; returns the volume.
static inline double cand_tet(const double* x, const int* node, OmVec3 g[4]) {
    OmVec3 o = om_load3(x, node[0]);
    OmVec3 a = om_sub(om_load3(x, node[1]), o), b = om_sub(om_load3(x, node[2]), o),
           c = om_sub(om_load3(x, node[3]), o);
    double six = om_dot(om_cross(a, b), c);
    assert_true(six > 0);
    g[1] = om_scale(1 / six, om_cross(b, c));
    g[2] = om_scale(1 / six, om_cross(c, a));
    g[3] = om_scale(1 / six, om_cross(a, b));
    g[0] = om_scale(-1, om_add(g[1], om_add(g[2], g[3])));
    return six / 6;
}

// K += weight (lambda g_i g_j^T + mu g_j g_i^T + mu (g_i . g_j) I) for every two of k nodes.
static inline void cand_add_gradients(int k, const OmVec3* g, double weight, double lambda,
                                      double mu, double* K) {
    for (int i = 0; i < k; ++i)
        for (int j = 0; j < k; ++j) {
            const double p[3] = {g[i].x, g[i].y, g[i].z}, q[3] = {g[j].x, g[j].y, g[j].z};
            double dot = om_dot(g[i], g[j]);
            for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c)
                    K[(3 * i + r) * 3 * k + 3 * j + c] +=
                        weight * (lambda * p[r] * q[c] + mu * q[r] * p[c] + (r == c) * mu * dot);
        }
}

// Four points with lambda of at most OM__INNER_RATIO mu, the rest of lambda at the centroid.
static inline void cand_quadratic(const CandBody* b, const int* node, double* K) {
    double inner = fmin(b->lambda, OM__INNER_RATIO * b->mu);
    OmVec3 g[4], at[10];
    double volume = cand_tet(b->mesh.x, node, g);
    for (int q = 0; q < 5; ++q) {
        double L[4];
        for (int k = 0; k < 4; ++k)
            L[k] = q == 4 ? 0.25 : k == q ? (5 + 3 * sqrt(5)) / 20 : (5 - sqrt(5)) / 20;
        for (int k = 0; k < 4; ++k) at[k] = om_scale(4 * L[k] - 1, g[k]);
        for (int k = 0; k < 6; ++k)
            at[4 + k] = om_scale(4, om_add(om_scale(L[cand_edge[k][1]], g[cand_edge[k][0]]),
                                           om_scale(L[cand_edge[k][0]], g[cand_edge[k][1]])));
        cand_add_gradients(10, at, q == 4 ? volume : volume / 4, q == 4 ? b->lambda - inner : inner,
                           q == 4 ? 0 : b->mu, K);
    }
}

// Patches: the elements around each node with a quarter of their volume, then around each edge with a sixth.
static inline void cand_make_patches(CandBody* b) {
    const OmFemMesh* m = &b->mesh;
    OmBsr graph;
    assert_ok(om_bsr_create(m->nnode, m->nelem, 4, m->elem_node, &graph));
    int *number = om_alloc((size_t)graph.nblock, sizeof(int)), nuse = 10 * m->nelem;
    for (int e = 0; e < graph.nedge; ++e)
        number[graph.edge_adr[2 * e]] = number[graph.edge_adr[2 * e + 1]] = m->nnode + e;
    b->npart = m->nnode + graph.nedge;
    int *first = om_calloc((size_t)b->npart + 2, sizeof(int)),
        *use = om_alloc((size_t)nuse, sizeof(int));
    for (int pass = 0; pass < 2; ++pass) {
        for (int u = 0; u < nuse; ++u) {
            const int *node = m->elem_node + 4 * (u / 10), k = u % 10;
            int part = k < 4 ? node[k]
                             : number[om_bsr_find(&graph, node[cand_edge[k - 4][0]],
                                                  node[cand_edge[k - 4][1]])];
            if (pass == 0)
                ++first[part + 2];
            else
                use[first[part + 1]++] = u / 10;
        }
        for (int p = 0; p < b->npart && pass == 0; ++p) first[p + 2] += first[p + 1];
    }
    b->part_adr = om_calloc((size_t)b->npart + 1, sizeof(int));
    b->part_node = om_alloc(4 * (size_t)nuse, sizeof(int));
    b->part_grad = om_calloc(12 * (size_t)nuse, sizeof(double));
    b->part_volume = om_calloc((size_t)b->npart, sizeof(double));
    for (int p = 0; p < b->npart; ++p) {
        int begin = b->part_adr[p], end = begin;
        for (int u = first[p]; u < first[p + 1]; ++u) {
            const int* node = m->elem_node + 4 * use[u];
            OmVec3 g[4];
            double volume = cand_tet(m->x, node, g) / (p < m->nnode ? 4 : 6);
            b->part_volume[p] += volume;
            for (int a = 0; a < 4; ++a) {
                int at = begin;
                while (at < end && b->part_node[at] != node[a]) ++at;
                if (at == end) b->part_node[end++] = node[a];
                om_store3(b->part_grad, at, om_madd(om_load3(b->part_grad, at), volume, g[a]));
            }
        }
        assert_true(end - begin <= CAND_PART);
        for (int k = 3 * begin; k < 3 * end; ++k) b->part_grad[k] /= b->part_volume[p];
        b->part_adr[p + 1] = end;
    }
    om_bsr_destroy(&graph);
    om_free(number), om_free(first), om_free(use);
}

// ---- the body -----------------------------------------------------------------------------------------------

static inline CandShell cand_element(const CandBody* b, int p) {
    CandShell e = {.kind = b->kind, .nnode = b->part_adr[p + 1] - b->part_adr[p]};
    e.nmore = b->kind == CAND_HEX7 ? 7 : b->kind == CAND_PRISM_PLUS ? 3 : 1;
    for (int a = 0; a < e.nnode; ++a)
        memcpy(e.x[a], b->mesh.x + 3 * b->part_node[b->part_adr[p] + a], sizeof e.x[a]);
    return e;
}

// The matrix of a part (3 k x 3 k), k nodes.
static inline int cand_part(const CandBody* b, int p, double* K) {
    int begin = b->part_adr[p], k = b->part_adr[p + 1] - begin;
    const int* node = b->part_node + begin;
    OmVec3 g[CAND_PART];
    memset(K, 0, 9 * (size_t)(k * k) * sizeof *K);
    if (b->kind == CAND_LINEAR) {
        double volume = cand_tet(b->mesh.x, node, g);
        cand_add_gradients(4, g, volume, b->lambda, b->mu, K);
    } else if (b->kind == CAND_QUADRATIC) {
        cand_quadratic(b, node, K);
    } else if (b->kind == CAND_EDGE) {
        bool is_node = p < b->mesh.nnode;
        for (int a = 0; a < k; ++a) g[a] = om_load3(b->part_grad, begin + a);
        cand_add_gradients(k, g, b->part_volume[p],
                           is_node ? b->lambda + 2 * b->mu / 3 : -2 * b->mu / 3,
                           is_node ? 0 : b->mu, K);
    } else {
        CandShell e = cand_element(b, p);
        cand_shell(&e, b->lambda, b->mu, K);
    }
    return k;
}

// Volume of each node, of 1000 kg/m^3: shares of the shape functions, scaled diagonal (HRZ) of quadratic elements.
static inline void cand_lump(CandBody* b) {
    b->mass = om_calloc((size_t)b->mesh.nnode, sizeof *b->mass);
    if (b->kind < CAND_HEX1) {
        OmMaterial material = {.young = 1, .poisson = 0, .law = OM_LINEAR};
        OmFemDef def = om_fem_default_def(&b->mesh, 1, &material);
        OmFemSolid* solid;
        def.nworker = 1;
        assert_ok(om_fem_create(&def, &solid));
        memcpy(b->mass, om_fem_mass(solid), (size_t)b->mesh.nnode * sizeof *b->mass);
        om_fem_destroy(solid);
        return;
    }
    for (int p = 0; p < b->npart; ++p) {
        CandShell e = cand_element(b, p);
        double at[3], weight, N[8], dN[8][3], J[3][3], inverse[3][3], B[6][CAND_COL];
        for (int q = 0; cand_point(&e, q, at, &weight); ++q) {
            cand_slopes(&e, at, N, dN);
            cand_natural(&e, at, B, J);
            double share = 1000 * weight * cand_invert(J, inverse);
            for (int a = 0; a < e.nnode; ++a)
                b->mass[b->part_node[b->part_adr[p] + a]] += share * N[a];
        }
    }
}

// Nodes of the parts from the mesh; prisms are the halves of hexahedra, cut along the diagonal 0 2.
static inline void cand_make_parts(CandBody* b) {
    static const int half[2][6] = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}};
    if (b->kind == CAND_EDGE) {
        cand_make_patches(b);
        return;
    }
    bool is_prism = b->kind >= CAND_PRISM;
    int k = is_prism ? 6 : b->mesh.nelem_node, split = is_prism ? 2 : 1;
    b->npart = split * b->mesh.nelem;
    b->part_adr = om_alloc((size_t)b->npart + 1, sizeof(int));
    b->part_node = om_alloc((size_t)(k * b->npart), sizeof(int));
    for (int p = 0; p <= b->npart; ++p) b->part_adr[p] = k * p;
    for (int p = 0; p < b->npart; ++p) {
        const int* node = b->mesh.elem_node + b->mesh.nelem_node * (p / split);
        for (int a = 0; a < k; ++a) b->part_node[k * p + a] = node[is_prism ? half[p % 2][a] : a];
    }
}

// The pattern, and the sum of the parts.
static inline void cand_assemble(CandBody* b) {
    int num = 0, *two;
    for (int p = 0; p < b->npart; ++p) {
        int k = b->part_adr[p + 1] - b->part_adr[p];
        num += k * (k - 1) / 2;
    }
    two = om_alloc(2 * (size_t)num, sizeof *two);
    num = 0;
    for (int p = 0; p < b->npart; ++p)
        for (int i = b->part_adr[p]; i < b->part_adr[p + 1]; ++i)
            for (int j = i + 1; j < b->part_adr[p + 1]; ++j, ++num)
                two[2 * num] = b->part_node[i], two[2 * num + 1] = b->part_node[j];
    assert_ok(om_bsr_create(b->mesh.nnode, num, 2, two, &b->K));
    assert_ok(om_bsr_make_exact(&b->K));
    om_free(two);
    om_bsr_zero(&b->K);
    double* K = om_alloc(9 * CAND_PART * CAND_PART, sizeof *K);
    for (int p = 0; p < b->npart; ++p) {
        const int* node = b->part_node + b->part_adr[p];
        int k = cand_part(b, p, K);
        for (int i = 0; i < k; ++i)
            for (int j = 0; j < k; ++j) {
                double* exact = b->K.exact + 9 * (size_t)om_bsr_find(&b->K, node[i], node[j]);
                for (int c = 0; c < 9; ++c) exact[c] += K[(3 * i + c % 3) * 3 * k + 3 * j + c / 3];
            }
    }
    for (int k = 0; k < 9 * b->K.nblock; ++k) b->K.value[k] = (float)b->K.exact[k];
    om_free(K);
}

/// y = K x (nnode x 3), in double.
static inline void cand_apply(const CandBody* b, const double* x, double* y) {
    const OmBsr* K = &b->K;
    for (int i = 0; i < K->nvert; ++i) {
        double sum[3] = {0, 0, 0};
        for (int k = K->row_adr[i]; k < K->row_adr[i + 1]; ++k)
            for (int c = 0; c < 9; ++c)
                sum[c % 3] += K->exact[9 * k + c] * x[3 * K->col[k] + c / 3];
        memcpy(y + 3 * i, sum, sizeof sum);
    }
}

// Edges of quadratic tetrahedra are straight.
static inline void cand_straighten(OmFemMesh* m) {
    for (int e = 0; e < m->nelem; ++e)
        for (int k = 0; k < 6; ++k) {
            const int* node = m->elem_node + 10 * e;
            om_store3(m->x, node[4 + k],
                      om_lerp(om_load3(m->x, node[cand_edge[k][0]]),
                              om_load3(m->x, node[cand_edge[k][1]]), 0.5));
        }
}

/// A box of cells; `shift` moves its nodes (may be null). The thickness of solid-shells is along z.
static inline void cand_start(CandBody* b, CandKind kind, OmVec3 size, const int num[3],
                              double young, double poisson, void (*shift)(OmFemMesh* mesh)) {
    *b = (CandBody){.kind = kind};
    OmMaterial material = {.young = young, .poisson = poisson, .law = OM_LINEAR};
    double bulk;
    om_material_lame(&material, &b->lambda, &b->mu, &bulk);
    OmElement element = kind == CAND_QUADRATIC ? OM_TET10 : kind < CAND_HEX1 ? OM_TET4 : OM_HEX8;
    assert_ok(om_fem_mesh_box(element, om_vec3(0, 0, 0), size, num, &b->mesh));
    if (shift) {
        shift(&b->mesh);
        if (kind == CAND_QUADRATIC) cand_straighten(&b->mesh);
    }
    cand_make_parts(b);
    cand_lump(b);
    cand_assemble(b);
}

static inline void cand_done(CandBody* b) {
    om_bsr_destroy(&b->K);
    om_fem_mesh_done(&b->mesh);
    om_free(b->part_adr), om_free(b->part_node), om_free(b->part_grad), om_free(b->part_volume);
    om_free(b->mass);
}

#endif
