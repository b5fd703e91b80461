// fem_shell.c: the stiffness of a solid-shell hexahedron at rest for its hourglass patterns.
//
// Covariant strains of the displacement, with these replaced: transverse shear by that of the middles of the edges of
// the mid-surface (Dvorkin and Bathe 1984), thickness strain by that of its corners (Betsch and Stein 1995); enhanced
// by seven parameters in the plane and through the thickness (Klinkel, Gruttmann and Wagner 2006), which are
// eliminated. From the energy of the patterns that of their mean strain and that of the two points is taken away, for
// the law has it. Only the patterns enter: where the faces of a cell are not parallel, that keeps uniform strain
// exact, which the assumed strains are not.
#include "fem/fem_shell.h"

#include <string.h>

#define NMORE 7            // enhanced strains
#define NCOL (12 + NMORE)  // columns: component c of pattern i, 3 i + c, then the parameters
#define MIN_PIVOT 1e-9     // of the largest of k: -k must be below it in every direction
#define NSHRINK 10         // of B, by tenths, until k has no energy below zero

typedef struct Cell {
    double x[OM__SHELL_NODE][3];
    double inverse[6][6];  // Cartesian strains from covariant ones at the middle
    double volume;         // of the Jacobian at the middle
} Cell;

static const double sign[OM__SHELL_NODE][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                               {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
static const int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

// Patterns xi eta, eta zeta, zeta xi, xi eta zeta at a node.
static void pattern_at(int node, double h[4]) {
    const double* s = sign[node];
    const double all[4] = {s[0] * s[1], s[1] * s[2], s[2] * s[0], s[0] * s[1] * s[2]};
    memcpy(h, all, sizeof all);
}

// J[i] = dx / d xi_i.
static void jacobian(const Cell* cell, const double at[3], double J[3][3]) {
    memset(J, 0, 9 * sizeof J[0][0]);
    for (int a = 0; a < OM__SHELL_NODE; ++a) {
        const double* s = sign[a];
        double p[3] = {1 + s[0] * at[0], 1 + s[1] * at[1], 1 + s[2] * at[2]};
        for (int i = 0; i < 3; ++i) {
            double slope = s[i] * p[(i + 1) % 3] * p[(i + 2) % 3] / 8;
            for (int c = 0; c < 3; ++c) J[i][c] += slope * cell->x[a][c];
        }
    }
}

static double determinant_of(double J[3][3]) {
    return om_dot(om_load3(J[0], 0), om_cross(om_load3(J[1], 0), om_load3(J[2], 0)));
}

// Covariant strains of the patterns.
static void natural_strain(const Cell* cell, const double at[3], double B[6][NCOL]) {
    const double r = at[0], s = at[1], t = at[2];
    const double slope[4][3] = {{s, r, 0}, {0, t, s}, {t, 0, r}, {s * t, t * r, r * s}};
    double J[3][3];
    jacobian(cell, at, J);
    memset(B, 0, 6 * sizeof B[0]);
    for (int v = 0; v < 6; ++v)
        for (int n = 0; n < 12; ++n) {
            int i = pair[v][0], j = pair[v][1], c = n % 3;
            const double* h = slope[n / 3];
            B[v][n] = i == j ? h[i] * J[i][c] : h[i] * J[j][c] + h[j] * J[i][c];
        }
}

// B[row] += scale times that row at a point of the mid-surface.
static void tie(const Cell* cell, int row, double scale, double r, double s, double B[6][NCOL]) {
    const double at[3] = {r, s, 0};
    double tied[6][NCOL];
    natural_strain(cell, at, tied);
    for (int n = 0; n < NCOL; ++n) B[row][n] += scale * tied[row][n];
}

// Cartesian strains from covariant ones.
static void make_turn(double J[3][3], double T[6][6]) {
    double g[3][3], inv = 1 / determinant_of(J);  // g[i]: slope of xi_i
    for (int i = 0; i < 3; ++i)
        om_store3(
            g[i], 0,
            om_scale(inv, om_cross(om_load3(J[(i + 1) % 3], 0), om_load3(J[(i + 2) % 3], 0))));
    for (int v = 0; v < 6; ++v)
        for (int w = 0; w < 6; ++w) {
            int i = pair[v][0], j = pair[v][1], k = pair[w][0], l = pair[w][1];
            double sum = g[k][i] * g[l][j];
            if (k != l) sum = (sum + g[l][i] * g[k][j]) / 2;
            T[v][w] = i == j ? sum : 2 * sum;
        }
}

// Strains of patterns and parameters at a point; the determinant of its Jacobian is returned.
static double strain_at(const Cell* cell, const double at[3], double S[6][NCOL]) {
    static const int row[NMORE] = {2, 0, 1, 3, 3, 2, 2};
    const double value[NMORE] = {at[2], at[0], at[1], at[0], at[1], at[0] * at[2], at[1] * at[2]};
    double B[6][NCOL], J[3][3], T[6][6];
    natural_strain(cell, at, B);
    memset(B[2], 0, sizeof B[2]);
    memset(B[4], 0, 2 * sizeof B[4]);
    for (int a = 0; a < 4; ++a)
        tie(cell, 2, (1 + sign[a][0] * at[0]) * (1 + sign[a][1] * at[1]) / 4, sign[a][0],
            sign[a][1], B);
    for (int side = -1; side < 2; side += 2) {
        tie(cell, 4, (1 + side * at[1]) / 2, 0, side, B);
        tie(cell, 5, (1 + side * at[0]) / 2, side, 0, B);
    }
    jacobian(cell, at, J);
    make_turn(J, T);
    double det = determinant_of(J);
    for (int v = 0; v < 6; ++v)
        for (int n = 0; n < NCOL; ++n) {
            S[v][n] = 0;
            for (int w = 0; w < 6 && n < 12; ++w) S[v][n] += T[v][w] * B[w][n];
            if (n >= 12)
                S[v][n] = cell->inverse[v][row[n - 12]] * value[n - 12] * cell->volume / det;
        }
    return det;
}

static void load_cell(const OmTissueModel* m, int e, Cell* cell) {
    static const double middle[3] = {0, 0, 0};
    double J[3][3];
    for (int a = 0; a < OM__SHELL_NODE; ++a)
        memcpy(cell->x[a], m->mesh.x + 3 * (size_t)m->elem_node[8 * (size_t)e + (size_t)a],
               sizeof cell->x[a]);
    jacobian(cell, middle, J);
    make_turn(J, cell->inverse);
    cell->volume = determinant_of(J);
}

static void gauss_point(int q, double at[3]) {
    for (int c = 0; c < 3; ++c) at[c] = sign[q][c] / sqrt(3);
}

// A += volume S^T C S.
static void add_energy(double S[6][NCOL], double volume, double lambda, double mu,
                       double A[NCOL][NCOL]) {
    for (int n = 0; n < NCOL; ++n) {
        double stress[6], trace = S[0][n] + S[1][n] + S[2][n];
        for (int v = 0; v < 6; ++v)
            stress[v] = v < 3 ? lambda * trace + 2 * mu * S[v][n] : mu * S[v][n];
        for (int r = 0; r < NCOL; ++r)
            for (int v = 0; v < 6; ++v) A[r][n] += volume * S[v][r] * stress[v];
    }
}

// The energy of patterns and parameters, with the parameters eliminated from the last to the first.
static void eliminate(const Cell* cell, double lambda, double mu, double A[NCOL][NCOL]) {
    double S[6][NCOL], at[3];
    memset(A, 0, NCOL * sizeof A[0]);
    for (int q = 0; q < 8; ++q) {
        gauss_point(q, at);
        double det = strain_at(cell, at, S);
        add_energy(S, det, lambda, mu, A);
    }
    for (int p = NCOL - 1; p >= 12; --p)
        for (int r = 0; r < p; ++r) {
            double factor = A[r][p] / A[p][p];  // the parameters' own matrix is positive definite
            for (int n = 0; n < p; ++n) A[r][n] -= factor * A[p][n];
        }
}

// Volume and mean gradients: integrals of the slopes, exact with eight points.
static bool integrate(const Cell* cell, OmFemShell* s) {
    s->volume = 0;
    memset(s->grad, 0, sizeof s->grad);
    for (int q = 0; q < 8; ++q) {
        double at[3], J[3][3], cof[3][3];
        gauss_point(q, at);
        jacobian(cell, at, J);
        double det = determinant_of(J);
        if (!(det > 0)) return false;
        s->volume += det;
        for (int i = 0; i < 3; ++i)
            om_store3(cof[i], 0,
                      om_cross(om_load3(J[(i + 1) % 3], 0), om_load3(J[(i + 2) % 3], 0)));
        for (int a = 0; a < OM__SHELL_NODE; ++a)
            for (int i = 0; i < 3; ++i) {
                double p = 1 + sign[a][(i + 1) % 3] * at[(i + 1) % 3];
                double slope = sign[a][i] * p * (1 + sign[a][(i + 2) % 3] * at[(i + 2) % 3]) / 8;
                for (int c = 0; c < 3; ++c) s->grad[a][c] += slope * cof[i][c];
            }
    }
    for (int a = 0; a < OM__SHELL_NODE; ++a)
        for (int c = 0; c < 3; ++c) s->grad[a][c] /= s->volume;
    return true;
}

// Rows 4 to 7 of the inverse of the nodes' (1, x, y, z, h): the shares of the patterns. False: singular.
static bool make_hour(const Cell* cell, OmFemShell* s) {
    double A[8][16] = {{0}}, size = cbrt(s->volume);
    for (int a = 0; a < 8; ++a) {
        A[a][0] = 1;
        for (int c = 0; c < 3; ++c) A[a][1 + c] = (cell->x[a][c] - cell->x[0][c]) / size;
        pattern_at(a, A[a] + 4);
        A[a][8 + a] = 1;
    }
    for (int k = 0; k < 8; ++k) {
        int best = k;
        for (int r = k; r < 8; ++r)
            if (fabs(A[r][k]) > fabs(A[best][k])) best = r;
        if (!(fabs(A[best][k]) > 1e-9)) return false;
        for (int n = 0; n < 16; ++n) {
            double was = A[k][n];
            A[k][n] = A[best][n];
            A[best][n] = was;
        }
        for (int r = 0; r < 8; ++r) {
            double factor = A[r][k] / A[k][k];
            for (int n = k; n < 16 && r != k; ++n) A[r][n] -= factor * A[k][n];
        }
    }
    for (int i = 0; i < 4; ++i)
        for (int a = 0; a < 8; ++a) s->hour[i][a] = A[4 + i][8 + a] / A[4 + i][4 + i];
    return true;
}

// The mean strain of the patterns: F has it. Zero in a parallelepiped.
static void mean_strain(const OmFemShell* s, double mean[6][NCOL]) {
    memset(mean, 0, 6 * sizeof mean[0]);
    for (int n = 0; n < 12; ++n) {
        double slope[3] = {0, 0, 0},
               h[4];  // the mean gradient of pattern n / 3, along component n % 3
        for (int a = 0; a < 8; ++a) {
            pattern_at(a, h);
            for (int c = 0; c < 3; ++c) slope[c] += h[n / 3] * s->grad[a][c];
        }
        for (int v = 0; v < 6; ++v) {
            int i = pair[v][0], j = pair[v][1];
            mean[v][n] = (i == n % 3) * slope[j] + (i != j) * (j == n % 3) * slope[i];
        }
    }
}

// The energy of the patterns that their mean strain has: V times that of the mean.
static void subtract_mean(const OmFemShell* s, double lambda, double mu, double A[NCOL][NCOL]) {
    double mean[6][NCOL];
    mean_strain(s, mean);
    add_energy(mean, -s->volume, lambda, mu, A);
}

// Strains of the patterns at a point, 6 x 12 in S, with the parameters that minimise the energy: of A, eliminated.
static void condensed_strain(const Cell* cell, double A[NCOL][NCOL], const double at[3],
                             double S[6][NCOL]) {
    double more[NCOL][12];
    strain_at(cell, at, S);
    for (int n = 0; n < 12; ++n)
        for (int p = 12; p < NCOL; ++p) {  // the first first
            double sum = A[p][n];
            for (int m = 12; m < p; ++m) sum += A[p][m] * more[m][n];
            more[p][n] = -sum / A[p][p];
            for (int v = 0; v < 6; ++v) S[v][n] += S[v][p] * more[p][n];
        }
    for (int v = 0; v < 6; ++v) memset(S[v] + 12, 0, NMORE * sizeof S[v][0]);
}

// Is k above -MIN_PIVOT of its largest entry in every direction? By Cholesky's method.
static bool is_positive(double k[NCOL][NCOL]) {
    double L[12][12], largest = 0;
    for (int r = 0; r < 12; ++r) largest = fmax(largest, k[r][r]);
    for (int r = 0; r < 12; ++r)
        for (int c = 0; c <= r; ++c) {
            double sum = 0.5 * (k[r][c] + k[c][r]) + (r == c ? MIN_PIVOT * largest : 0);
            for (int n = 0; n < c; ++n) sum -= L[r][n] * L[c][n];
            if (r == c && !(sum > 0)) return false;
            L[r][c] = r == c ? sqrt(sum) : sum / L[c][c];
        }
    return true;
}

// k and B, or false: an energy below zero. B is made smaller where only that leaves k none, in cells that are far from
// parallel; at rest the sum is the same.
static bool make_stiff(const Cell* cell, double lambda, double mu, OmFemShell* s) {
    const double above[3] = {0, 0, 1 / sqrt(3)}, below[3] = {0, 0, -1 / sqrt(3)};
    double A[NCOL][NCOL], S[6][NCOL], other[6][NCOL], k[NCOL][NCOL];
    eliminate(cell, lambda, mu, A);
    condensed_strain(cell, A, above, S);
    condensed_strain(cell, A, below, other);
    subtract_mean(s, lambda, mu, A);
    for (int shrink = 0; shrink <= NSHRINK; ++shrink) {
        for (int v = 0; v < 6; ++v)
            for (int n = 0; n < NCOL; ++n)
                other[v][n] = (shrink == 0 ? 0.5 * (S[v][n] - other[v][n])
                                           : S[v][n] * (1 - (double)shrink / NSHRINK));
        if (shrink == 0) memcpy(S, other, sizeof S);
        memcpy(k, A, sizeof k);
        add_energy(other, -s->volume, lambda, mu, k);
        if (!is_positive(k)) continue;
        for (int r = 0; r < 12; ++r)
            for (int c = 0; c < 12; ++c) s->stiff[r][c] = 0.5 * (k[r][c] + k[c][r]);
        for (int v = 0; v < 6; ++v) memcpy(s->strain[v], other[v], sizeof s->strain[v]);
        return true;
    }
    return false;
}

// k with what both points add at rest.
static void whole_stiffness(const OmFemShell* s, double lambda, double mu, double k[12][12]) {
    double S[6][NCOL] = {{0}}, A[NCOL][NCOL] = {{0}};
    for (int v = 0; v < 6; ++v) memcpy(S[v], s->strain[v], sizeof s->strain[v]);
    add_energy(S, s->volume, lambda, mu, A);
    for (int r = 0; r < 12; ++r)
        for (int c = 0; c < 12; ++c) k[r][c] = s->stiff[r][c] + A[r][c];
}

// The lanes of an element, in units of its V mu.
static void fill_lane(const OmTissueModel* m, const OmFemShell* s, int e, int l, OmFemShells* out) {
    double lambda, mu, k[9], all[12][12];
    om__fem_lame(m, e, &lambda, &mu);
    whole_stiffness(s, lambda, mu, all);
    double unit = 1 / (s->volume * mu);
    out->turns[l] = om__fem_material(m, e)->law == OM_LINEAR ? 0.0F : 1.0F;
    for (int a = 0; a < OM__SHELL_NODE; ++a) {
        out->vert[a][l] = m->elem_node[8 * (size_t)e + (size_t)a];
        for (int c = 0; c < 3; ++c) out->grad[3 * a + c][l] = (float)s->grad[a][c];
        for (int i = 0; i < 4; ++i) out->hour[8 * i + a][l] = (float)s->hour[i][a];
    }
    for (int i = 0, at = 0; i < 4; ++i)
        for (int j = i; j < 4; ++j)
            for (int c = 0; c < 9; ++c, ++at)
                out->stiff[at][l] = (float)(unit * s->stiff[3 * i + c % 3][3 * j + c / 3]);
    for (int v = 0; v < 6; ++v)
        for (int n = 0; n < 12; ++n) out->strain[12 * v + n][l] = (float)s->strain[v][n];
    for (int a = 0, at = 0; a < 8; ++a)
        for (int b = a + 1; b < 8; ++b, at += 9) {
            memset(k, 0, sizeof k);
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j)
                    for (int c = 0; c < 9; ++c)
                        k[c] += s->hour[i][a] * s->hour[j][b] * all[3 * i + c % 3][3 * j + c / 3];
            for (int c = 0; c < 9; ++c) out->block[at + c][l] = (float)(unit * k[c]);
        }
}

OmStatus om__fem_shell_make(const OmTissueModel* m, OmFem* fem) {
    OM_ALLOC(fem->shell, fem->nelem);
    fem->shells = om_calloc((size_t)fem->nbatch, sizeof *fem->shells);
    if (!fem->shells) return OM_NO_MEMORY;
    for (int e = 0; e < fem->nelem; ++e) {
        Cell cell;
        double lambda, mu;
        load_cell(m, e, &cell);
        om__fem_lame(m, e, &lambda, &mu);
        OmFemShell* s = &fem->shell[e];
        OM_CHECK(
            integrate(&cell, s) && make_hour(&cell, s) && make_stiff(&cell, lambda, mu, s),
            OM_INVALID,
            "fem: cell %d is too distorted for a shell; element \"quadratic\" has no such limit",
            e);
    }
    for (int k = 0; k < fem->nbatch * OM__LANE; ++k) {
        int e = k < fem->nelem ? k : fem->nelem - 1;
        fill_lane(m, &fem->shell[e], e, k % OM__LANE, &fem->shells[k / OM__LANE]);
    }
    return OM_OK;
}

void om__fem_shell_strains(const OmTissueModel* m, int e, const double d[12], double strain[6][6]) {
    const int* node = m->elem_node + 8 * (size_t)e;
    Cell cell;
    double lambda, mu, A[NCOL][NCOL], S[6][NCOL], mean[6][NCOL];
    load_cell(m, e, &cell);
    om__fem_lame(m, e, &lambda, &mu);
    eliminate(&cell, lambda, mu, A);
    mean_strain(&((const OmFem*)m->data)->shell[e], mean);
    for (int t = 0; t < 6; ++t) {
        const int* vert = m->mesh.tet_vert + 4 * (6 * (size_t)e + (size_t)t);
        double at[3] = {0, 0, 0};
        for (int k = 0; k < 4; ++k) {
            int n = 0;
            while (node[n] != vert[k]) ++n;
            for (int c = 0; c < 3; ++c) at[c] += 0.25 * sign[n][c];
        }
        condensed_strain(&cell, A, at, S);
        for (int v = 0; v < 6; ++v) {
            strain[t][v] = 0;
            for (int n = 0; n < 12; ++n) strain[t][v] += (S[v][n] - mean[v][n]) * d[n];
        }
    }
}

// U' and U'' of c/2 (ln J/J0)^2, 0 from J0 on, continued below the floor of logarithms as in fem_law.c.
static double resist(double J, double c, double* d, double* dd) {
    double b = fmax(J, OM_LAW_LOG_FLOOR), t = J - b, l = log(b / OM__SHELL_CRUSHED);
    *d = *dd = 0;
    if (J >= OM__SHELL_CRUSHED) return 0;
    double slope = c * l / b;
    *dd = c * (1 - l) / (b * b);
    *d = slope + t * *dd;
    return 0.5 * c * l * l + t * (slope + 0.5 * t * *dd);
}

double om__fem_shell_resist_at(const OmTissueModel* m, int e, const double F[9], const double q[12],
                               double* slope, double* block) {
    const OmFemShell* s = &((const OmFem*)m->data)->shell[e];
    double lambda, mu, energy = 0, axis[3][3] = {{0}};
    if (om__fem_material(m, e)->law == OM_LINEAR) return 0;
    om__fem_lame(m, e, &lambda, &mu);
    for (int a = 0; a < OM__SHELL_NODE; ++a)
        for (int n = 0; n < 9; ++n) axis[n / 3][n % 3] += sign[a][n / 3] * s->grad[a][n % 3];
    for (int g = 0; g < 8; ++g) {
        double at[3], n[OM__SHELL_NODE][3], d, dd;
        gauss_point(g, at);
        const double dh[4][3] = {{at[1], at[0], 0},
                                 {0, at[2], at[1]},
                                 {at[2], 0, at[0]},
                                 {at[1] * at[2], at[2] * at[0], at[0] * at[1]}};
        OmVec3 col[3], cof[3], by[OM__SHELL_NODE];
        for (int c = 0; c < 3; ++c) {
            double h[4] = {0, 0, 0, 0};  // slope of each pattern along c
            for (int j = 0; j < 4; ++j)
                for (int i = 0; i < 3; ++i) h[j] += dh[j][i] * axis[i][c];
            col[c] = om_load3(F, c);
            for (int j = 0; j < 4; ++j) col[c] = om_madd(col[c], h[j], om_load3(q, j));
            for (int a = 0; a < OM__SHELL_NODE; ++a) {
                n[a][c] = s->grad[a][c];
                for (int j = 0; j < 4; ++j) n[a][c] += h[j] * s->hour[j][a];
            }
        }
        for (int c = 0; c < 3; ++c) cof[c] = om_cross(col[(c + 1) % 3], col[(c + 2) % 3]);
        energy += resist(om_dot(col[0], cof[0]), (lambda + mu) / mu, &d, &dd) / 8;
        for (int a = 0; a < OM__SHELL_NODE; ++a) {
            by[a] = (OmVec3){0, 0, 0};  // dJ / dx_a
            for (int c = 0; c < 3; ++c) by[a] = om_madd(by[a], n[a][c], cof[c]);
            if (slope) om_store3(slope, a, om_madd(om_load3(slope, a), d / 8, by[a]));
        }
        for (int a = 0, at_block = 0; block && dd > 0 && a < OM__SHELL_NODE; ++a)
            for (int b = a + 1; b < OM__SHELL_NODE; ++b, at_block += 9) {
                const double p[3] = {by[a].x, by[a].y, by[a].z}, r[3] = {by[b].x, by[b].y, by[b].z};
                for (int c = 0; c < 9; ++c) block[at_block + c] += dd / 8 * p[c % 3] * r[c / 3];
            }
    }
    return energy;
}

double om__fem_shell_resist(const OmTissueModel* m, int e, const V16 F[9], const V16 q[12], int l,
                            double* slope, double* block) {
    double Fl[9], ql[12];
    for (int n = 0; n < 9; ++n) Fl[n] = (double)F[n][l];
    for (int n = 0; n < 12; ++n) ql[n] = (double)q[n][l];
    return om__fem_shell_resist_at(m, e, Fl, ql, slope, block);
}
