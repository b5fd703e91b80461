// fem_element.c: shape functions, quadrature and faces of the reference elements.
//
// Tetrahedra: xi in the unit corner, node 0 at the origin, nodes 1, 2, 3 on the axes. Hexahedra: xi in
// [-1, 1]^3. Rules: Keast's 4 points (degree 2) for tetrahedra, 14 positive points of degree 5 for mass
// (Walkington 2000); Gauss 2 x 2 x 2 for hexahedra, 3 x 3 x 3 for their mass; on faces 7 points of degree 5
// (Radon) and Gauss 2 x 2.
#include <string.h>

#include "fem/fem_solid.h"

static const int corner[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                 {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

static bool is_hex(OmElement kind) { return kind == OM_HEX8 || kind == OM_HEX8_MEAN; }

const char* om_element_name(OmElement kind) {
    static const char* const name[OM_NELEMENT] = {"tet4", "tet10", "hex8", "hex8-mean"};
    return (int)kind >= 0 && kind < OM_NELEMENT ? name[kind] : NULL;
}

int om__element_nnode(OmElement kind) { return is_hex(kind) ? 8 : kind == OM_TET10 ? 10 : 4; }

// ---- quadrature -------------------------------------------------------------------------------------

static void add_point(OmRule* rule, double x, double y, double z, double weight) {
    double* xi = rule->xi[rule->npoint];
    xi[0] = x, xi[1] = y, xi[2] = z;
    rule->weight[rule->npoint++] = weight;
}

// Four points with barycentric coordinates (1 - 3 a, a, a, a) in turn; weights of a unit volume.
static void add_four(OmRule* rule, double a, double weight) {
    double b = 1 - 3 * a;
    add_point(rule, a, a, a, weight / 6);
    add_point(rule, b, a, a, weight / 6);
    add_point(rule, a, b, a, weight / 6);
    add_point(rule, a, a, b, weight / 6);
}

// Six points with coordinates (a, a, 1/2 - a, 1/2 - a) in turn.
static void add_six(OmRule* rule, double a, double weight) {
    double b = 0.5 - a;
    add_point(rule, a, b, b, weight / 6);
    add_point(rule, b, a, b, weight / 6);
    add_point(rule, b, b, a, weight / 6);
    add_point(rule, b, a, a, weight / 6);
    add_point(rule, a, b, a, weight / 6);
    add_point(rule, a, a, b, weight / 6);
}

void om__element_rule(OmElement kind, bool is_mass, OmRule* rule) {
    rule->npoint = 0;
    if (is_hex(kind) && is_mass) {
        double g = sqrt(0.6);
        for (int n = 0; n < 27; ++n) {
            int i = n % 3 - 1, j = n / 3 % 3 - 1, k = n / 9 - 1;
            double w = (i ? 5 : 8) * (j ? 5 : 8) * (k ? 5 : 8) / 729.0;
            add_point(rule, i * g, j * g, k * g, w);
        }
    } else if (is_hex(kind)) {
        double g = sqrt(1.0 / 3);
        for (int k = 0; k < 8; ++k)
            add_point(rule, corner[k][0] * g, corner[k][1] * g, corner[k][2] * g, 1);
    } else if (kind == OM_TET4 && !is_mass) {
        add_point(rule, 0.25, 0.25, 0.25, 1.0 / 6);
    } else if (kind == OM_TET4 || !is_mass) {
        add_four(rule, (5 - sqrt(5.0)) / 20, 0.25);
    } else {
        add_four(rule, 0.0927352503108912264, 0.07349304311636194934);
        add_four(rule, 0.3108859192633006097, 0.1126879257180158508);
        add_six(rule, 0.0455037041256496494, 0.04254602077708146644);
    }
}

// ---- shape functions --------------------------------------------------------------------------------

static void shape_hex(const double xi[3], double* N, double* dN) {
    for (int a = 0; a < 8; ++a) {
        double f[3];
        for (int k = 0; k < 3; ++k) f[k] = 0.5 * (1 + corner[a][k] * xi[k]);
        N[a] = f[0] * f[1] * f[2];
        for (int k = 0; k < 3 && dN; ++k)
            dN[3 * a + k] = 0.5 * corner[a][k] * f[(k + 1) % 3] * f[(k + 2) % 3];
    }
}

static void shape_tet(const double xi[3], bool is_quadratic, double* N, double* dN) {
    static const double dL[4][3] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double L[4] = {1 - xi[0] - xi[1] - xi[2], xi[0], xi[1], xi[2]};
    for (int a = 0; a < 4; ++a) {
        N[a] = is_quadratic ? L[a] * (2 * L[a] - 1) : L[a];
        for (int k = 0; k < 3 && dN; ++k)
            dN[3 * a + k] = is_quadratic ? (4 * L[a] - 1) * dL[a][k] : dL[a][k];
    }
    for (int e = 0; e < 6 && is_quadratic; ++e) {
        int i = edge[e][0], j = edge[e][1];
        N[4 + e] = 4 * L[i] * L[j];
        for (int k = 0; k < 3 && dN; ++k)
            dN[3 * (4 + e) + k] = 4 * (L[i] * dL[j][k] + L[j] * dL[i][k]);
    }
}

void om__element_shape(OmElement kind, const double xi[3], double* N, double* dN) {
    if (is_hex(kind))
        shape_hex(xi, N, dN);
    else
        shape_tet(xi, kind == OM_TET10, N, dN);
}

void om__element_centre(OmElement kind, double xi[3]) {
    for (int k = 0; k < 3; ++k) xi[k] = is_hex(kind) ? 0 : 0.25;
}

double om__element_inside(OmElement kind, const double xi[3]) {
    if (is_hex(kind)) return 1 - fmax(fabs(xi[0]), fmax(fabs(xi[1]), fabs(xi[2])));
    return fmin(1 - xi[0] - xi[1] - xi[2], fmin(xi[0], fmin(xi[1], xi[2])));
}

OmMat3 om__element_jacobian(int nnode, const double* dN, const double* x, const int* node) {
    OmMat3 m = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    for (int a = 0; a < nnode; ++a) {
        OmVec3 p = om_load3(x, node[a]);
        m.cx = om_madd(m.cx, dN[3 * a], p);
        m.cy = om_madd(m.cy, dN[3 * a + 1], p);
        m.cz = om_madd(m.cz, dN[3 * a + 2], p);
    }
    return m;
}

// ---- faces ------------------------------------------------------------------------------------------

bool om__element_face(OmElement kind, int face, int local[6], int* nlocal) {
    static const int hex[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                  {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
    static const int tet[4][6] = {
        {0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 8, 7}, {1, 2, 3, 5, 9, 8}, {2, 0, 3, 6, 7, 9}};
    if (face >= (is_hex(kind) ? 6 : 4)) return false;
    *nlocal = om__face_nnode(kind);
    memcpy(local, is_hex(kind) ? hex[face] : tet[face], (size_t)*nlocal * sizeof *local);
    return true;
}

int om__face_nnode(OmElement kind) { return is_hex(kind) ? 4 : kind == OM_TET10 ? 6 : 3; }

static void add_three(OmRule* rule, double a, double weight) {
    add_point(rule, a, a, 0, weight / 2);
    add_point(rule, 1 - 2 * a, a, 0, weight / 2);
    add_point(rule, a, 1 - 2 * a, 0, weight / 2);
}

void om__face_rule(int nnode, OmRule* rule) {
    rule->npoint = 0;
    double g = sqrt(1.0 / 3), s = sqrt(15.0);
    if (nnode == 4) {
        for (int k = 0; k < 4; ++k) add_point(rule, k % 2 ? g : -g, k / 2 ? g : -g, 0, 1);
    } else {
        add_point(rule, 1.0 / 3, 1.0 / 3, 0, 9.0 / 80);
        add_three(rule, (6 - s) / 21, (155 - s) / 1200);
        add_three(rule, (6 + s) / 21, (155 + s) / 1200);
    }
}

static const double dL[3][2] = {{-1, -1}, {1, 0}, {0, 1}};  // of barycentric coordinates

void om__face_shape(int nnode, const double* xi, double* N, double* dN) {
    if (nnode == 4) {
        for (int a = 0; a < 4; ++a) {
            double f = 0.5 * (1 + corner[a][0] * xi[0]), g = 0.5 * (1 + corner[a][1] * xi[1]);
            N[a] = f * g;
            dN[2 * a] = 0.5 * corner[a][0] * g;
            dN[2 * a + 1] = 0.5 * corner[a][1] * f;
        }
        return;
    }
    const double L[3] = {1 - xi[0] - xi[1], xi[0], xi[1]};
    for (int a = 0; a < 3; ++a) {
        int b = (a + 1) % 3;
        N[a] = nnode == 6 ? L[a] * (2 * L[a] - 1) : L[a];
        if (nnode == 6) N[3 + a] = 4 * L[a] * L[b];
        for (int k = 0; k < 2; ++k) {
            dN[2 * a + k] = nnode == 6 ? (4 * L[a] - 1) * dL[a][k] : dL[a][k];
            if (nnode == 6) dN[2 * (3 + a) + k] = 4 * (L[a] * dL[b][k] + L[b] * dL[a][k]);
        }
    }
}

void om__face_curvature(int nnode, double* ddN) {
    memset(ddN, 0, 3 * (size_t)nnode * sizeof *ddN);
    for (int a = 0; a < 4 && nnode == 4; ++a) ddN[3 * a + 2] = 0.25 * corner[a][0] * corner[a][1];
    for (int a = 0; a < 3 && nnode == 6; ++a) {
        const double *u = dL[a], *v = dL[(a + 1) % 3];
        for (int k = 0; k < 3; ++k) {
            int i = k == 1, j = k > 0;
            ddN[3 * a + k] = 4 * u[i] * u[j];
            ddN[3 * (3 + a) + k] = 4 * (u[i] * v[j] + u[j] * v[i]);
        }
    }
}

void om__face_tangents(int nnode, const double* dN, const int* node, const double* x, OmVec3* a,
                       OmVec3* b) {
    *a = *b = om_vec3(0, 0, 0);
    for (int k = 0; k < nnode; ++k) {
        *a = om_madd(*a, dN[2 * k], om_load3(x, node[k]));
        *b = om_madd(*b, dN[2 * k + 1], om_load3(x, node[k]));
    }
}
