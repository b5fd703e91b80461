// fem_contact.c: frictionless contact between two sets of faces of a solid.
//
// Quadrature points p of each side search the nearest point y of the other side's faces. A point that is behind
// it, with d = p - y, and not beside the border of the set, stores
//
//     E = w/2 |d|^2,  w = stiffness / 2 times its rest area,
//
// so that both sides together have pressure = stiffness x depth, symmetric in the sides. y minimises |p - y|, so
// its motion within the faces does not enter the gradient: with c_i = N_i of p's face and -N_i of y's,
//
//     dE/dx_i = w c_i d,   d2E/dx_i dx_j = w (c_i c_j I - sum_kl B_ik M_kl^-1 B_jl^T),
//     B_ik = -c_i y_k + dc_i/dxi_k d,   M_kl = y_k . y_l - d . y_kl,
//
// k and l the directions in which y is free: two inside a face, one on an edge, none at a corner (the Schur complement
// of the minimum; Wriggers 2006, chapter 4, derives the same from the projection). The forces of one point sum to zero
// and have no torque, because d is along them. Without the terms of d the tangent is positive semidefinite.
//
// The nearest face is searched among all, filtered by the nearest node and bounding balls: sets are
// small compared to the mesh.
#include <string.h>

#include "fem/fem_solid.h"

#define GRAIN 16
#define SERIAL 256  // with fewer points a team does not pay
#define NEWTON_TURNS 12
#define XI_ROUNDING 1e-12
#define CRUSHED 1e-14  // of a face: sine squared between its directions
#define TIE 1e-9       // relative difference of the distances of two faces that counts as equal
#define AUTOMATIC 100  // times as stiff as the layer of elements behind
#define MAX_JOIN 12    // nodes of two faces

// ---- create -----------------------------------------------------------------------------------------

// The element that has this face, as om__element_face gives it; -1 if none.
static int element_behind(const OmFemSolid* s, const int* face) {
    for (int m = s->node_adr[face[0]]; m < s->node_adr[face[0] + 1]; ++m) {
        int e = s->node_elem[m], local[6], nlocal;
        const int* node = s->mesh.elem_node + (size_t)e * (size_t)s->mesh.nelem_node;
        for (int f = 0; om__element_face(s->mesh.kind, f, local, &nlocal); ++f) {
            bool is_same = true;
            for (int a = 0; a < nlocal; ++a) is_same = is_same && node[local[a]] == face[a];
            if (is_same) return e;
        }
    }
    return -1;
}

static OmStatus check_side(const OmFemSolid* s, const OmFemContact* c, int n, int side,
                           unsigned char* owner) {
    int k = om__face_nnode(s->mesh.kind);
    OM_CHECK(c->nface[side] >= 1 && c->face_node[side], OM_INVALID,
             "OmFemDef.contact[%d]: side %d has no faces", n, side);
    for (int f = 0; f < c->nface[side]; ++f) {
        const int* face = c->face_node[side] + (size_t)f * (size_t)k;
        for (int a = 0; a < k; ++a) {
            OM_CHECK(face[a] >= 0 && face[a] < s->mesh.nnode, OM_INVALID,
                     "OmFemDef.contact[%d] names node %d of %d", n, face[a], s->mesh.nnode);
            OM_CHECK(owner[face[a]] != 2 - side, OM_INVALID,
                     "OmFemDef.contact[%d]: node %d is on both sides; the sides must be apart", n,
                     face[a]);
            owner[face[a]] = (unsigned char)(1 + side);
        }
        OM_CHECK(element_behind(s, face) >= 0, OM_INVALID,
                 "OmFemDef.contact[%d]: face %d of side %d is none of om_fem_mesh_boundary", n, f,
                 side);
    }
    return OM_OK;
}

// Rest areas of the points, the stiffness of a layer of elements (Pa/m, from Young's modulus: with the bulk modulus
// faces would be far too stiff and unlike meshes would have contact in spots only) and the mean edge, by area.
static void measure_side(const OmFemSolid* s, const OmFacePair* c, int side, double* layer,
                         double* edge) {
    size_t k = (size_t)c->nface_node;
    OmRule rule;
    om__face_rule(c->nface_node, &rule);
    double whole = 0;
    *layer = *edge = 0;
    for (int f = 0; f < c->nface[side]; ++f) {
        const int* face = c->face_node[side] + (size_t)f * k;
        double area = 0;
        for (int q = 0; q < rule.npoint; ++q) {
            double N[6], dN[12];
            OmVec3 a, b;
            om__face_shape(c->nface_node, rule.xi[q], N, dN);
            om__face_tangents(c->nface_node, dN, face, s->mesh.x, &a, &b);
            double w = rule.weight[q] * om_norm(om_cross(a, b));
            c->weight[side][f * rule.npoint + q] = w;
            area += w;
        }
        int e = element_behind(s, face);
        const OmLawParam* law = &s->law[s->mesh.elem_material[e]];
        // mu > 0
        double young = law->mu * (3 * law->lambda + 2 * law->mu) / (law->lambda + law->mu);
        *layer += area * young * area / s->volume[e];
        *edge += area * om_distance(om_load3(s->mesh.x, face[0]), om_load3(s->mesh.x, face[1]));
        whole += area;
    }
    *layer /= whole;
    *edge /= whole;
}

// Edges of faces (bits 0 to 3) that no other face of the side has, and corners (4 to 7) on such edges.
static void mark_border(OmFacePair* c, int side, unsigned char* on_border) {
    int k = c->nface_node, n = k == 4 ? 4 : 3;
    for (int f = 0; f < c->nface[side]; ++f) {
        const int* face = c->face_node[side] + (size_t)f * (size_t)k;
        c->border[side][f] = 0;
        for (int e = 0; e < n; ++e) {
            bool is_shared = false;
            int a = face[e], b = face[(e + 1) % n];
            for (int g = 0; g < c->nface[side] && !is_shared; ++g) {
                const int* other = c->face_node[side] + (size_t)g * (size_t)k;
                for (int m = 0; m < n; ++m)  // a neighbour has the edge in the opposite direction
                    is_shared = is_shared || (other[m] == b && other[(m + 1) % n] == a);
            }
            if (is_shared) continue;
            c->border[side][f] |= (unsigned char)(1 << e);
            on_border[a] = on_border[b] = 1;
        }
    }
    for (int f = 0; f < c->nface[side]; ++f)
        for (int e = 0; e < n; ++e)
            if (on_border[c->face_node[side][f * k + e]])
                c->border[side][f] |= (unsigned char)(16 << e);
}

static OmStatus init_pair(const OmFemSolid* s, const OmFemContact* def, int n, OmFacePair* c,
                          unsigned char* owner) {
    OmRule rule;
    size_t k = (size_t)om__face_nnode(s->mesh.kind);
    double layer[2], edge[2];
    OM_CHECK(def->stiffness >= 0 && isfinite(def->stiffness), OM_INVALID,
             "OmFemDef.contact[%d].stiffness = %g Pa/m, must not be negative", n, def->stiffness);
    OM_CHECK(def->reach >= 0 && isfinite(def->reach), OM_INVALID,
             "OmFemDef.contact[%d].reach = %g m, must not be negative", n, def->reach);
    memset(owner, 0, (size_t)s->mesh.nnode);
    om__face_rule((int)k, &rule);
    c->nface_node = (int)k;
    for (int side = 0; side < 2; ++side) {
        OM_TRY(check_side(s, def, n, side, owner));
        size_t nface = (size_t)def->nface[side];
        c->nface[side] = def->nface[side];
        c->npoint[side] = def->nface[side] * rule.npoint;
        OM_ALLOC(c->face_node[side], nface * k);
        OM_ALLOC(c->weight[side], c->npoint[side]);
        OM_ALLOC(c->border[side], nface);
        memcpy(c->face_node[side], def->face_node[side], nface * k * sizeof(int));
        measure_side(s, c, side, &layer[side], &edge[side]);
    }
    double stiffness = def->stiffness > 0 ? def->stiffness : AUTOMATIC * fmin(layer[0], layer[1]);
    c->reach = def->reach > 0 ? def->reach : fmax(edge[0], edge[1]);
    for (int side = 0; side < 2; ++side) {
        for (int q = 0; q < c->npoint[side]; ++q) c->weight[side][q] *= 0.5 * stiffness;
        for (int i = 0; i < s->mesh.nnode; ++i) c->nnode[side] += owner[i] == 1 + side;
        OM_ALLOC(c->node[side], c->nnode[side]);
        for (int i = 0, m = 0; i < s->mesh.nnode; ++i)
            if (owner[i] == 1 + side) c->node[side][m++] = i;
    }
    memset(owner, 0, (size_t)s->mesh.nnode);
    for (int side = 0; side < 2; ++side) mark_border(c, side, owner);
    c->stiffness = stiffness;
    return OM_OK;
}

OmStatus om__contact_create(OmFemSolid* s, int ncontact, const OmFemContact* def) {
    OmStatus status = OM_OK;
    unsigned char* owner = NULL;  // 1 + side of each node
    if (ncontact == 0) return OM_OK;
    OM_CHECK(ncontact > 0 && def, OM_INVALID, "OmFemDef.ncontact = %d without contact", ncontact);
    OM_CALLOC_DONE(s->contact, ncontact);
    s->ncontact = ncontact;
    OM_ALLOC_DONE(owner, s->mesh.nnode);
    for (int n = 0; n < ncontact; ++n) OM_TRY_DONE(init_pair(s, &def[n], n, &s->contact[n], owner));
done:
    om_free(owner);
    return status;
}

void om__contact_destroy(OmFemSolid* s) {
    for (int n = 0; n < s->ncontact; ++n) {
        for (int side = 0; side < 2; ++side) {
            om_free(s->contact[n].face_node[side]);
            om_free(s->contact[n].weight[side]);
            om_free(s->contact[n].border[side]);
            om_free(s->contact[n].node[side]);
        }
    }
    om_free(s->contact);
}

int64_t om__contact_pairs(const OmFemSolid* s, int* pair) {
    int64_t num = 0;
    for (int n = 0; n < s->ncontact; ++n) {
        const OmFacePair* c = &s->contact[n];
        if (!pair) num += (int64_t)c->nnode[0] * c->nnode[1];
        for (int a = 0; a < c->nnode[0] && pair; ++a) {
            for (int b = 0; b < c->nnode[1]; ++b, ++num) {
                pair[2 * num] = c->node[0][a];
                pair[2 * num + 1] = c->node[1][b];
            }
        }
    }
    return num;
}

// ---- the nearest point of a face --------------------------------------------------------------------

typedef struct Face {
    int nnode;
    const int* node;
    const double* x;
} Face;

typedef struct Spot {  // a point of a face near p, and its free directions
    double xi[2];
    int edge, corner;       // edge or corner that contains it; or -1
    int nfree;              // directions in which it is free
    double dir[2][2];       // the free directions, in xi
    OmVec3 d;               // p - y
    OmVec3 slope[2];        // y_k
    double M[2][2];         // y_k . y_l - d . y_kl
    double N[6], dN[2][6];  // of y, dN along the free directions
    OmVec3 normal;          // outward, of length one
} Spot;

static void eval_spot(const Face* F, OmVec3 p, Spot* at) {
    double dN[12], ddN[18];
    OmVec3 y = {0, 0, 0}, y1[2], y2[3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    om__face_shape(F->nnode, at->xi, at->N, dN);
    om__face_curvature(F->nnode, ddN);
    om__face_tangents(F->nnode, dN, F->node, F->x, &y1[0], &y1[1]);
    for (int a = 0; a < F->nnode; ++a) {
        OmVec3 x = om_load3(F->x, F->node[a]);
        y = om_madd(y, at->N[a], x);
        for (int k = 0; k < 3; ++k) y2[k] = om_madd(y2[k], ddN[3 * a + k], x);
    }
    at->d = om_sub(p, y);
    OmVec3 normal = om_cross(y1[0], y1[1]);
    double length = om_norm(normal);
    at->normal = om_scale(length > 0 ? 1 / length : 0, normal);  // zero where a face is crushed
    for (int k = 0; k < at->nfree; ++k) {
        const double* u = at->dir[k];
        at->slope[k] = om_madd(om_scale(u[0], y1[0]), u[1], y1[1]);
        for (int a = 0; a < F->nnode; ++a) at->dN[k][a] = u[0] * dN[2 * a] + u[1] * dN[2 * a + 1];
    }
    for (int k = 0; k < at->nfree; ++k) {
        for (int l = 0; l < at->nfree; ++l) {
            const double *u = at->dir[k], *v = at->dir[l];
            OmVec3 bend = om_madd(om_scale(u[0] * v[0], y2[0]), u[1] * v[1], y2[1]);
            bend = om_madd(bend, u[0] * v[1] + u[1] * v[0], y2[2]);
            at->M[k][l] = om_dot(at->slope[k], at->slope[l]) - om_dot(at->d, bend);
        }
    }
}

// The inverse of M, or without its terms of d if is_plain or M is not positive definite.
static void invert_free(const Spot* at, bool is_plain, double inverse[2][2]) {
    double M[2][2] = {{1, 0}, {0, 1}};
    for (int turn = is_plain ? 1 : 0; turn < 2; ++turn) {
        for (int k = 0; k < at->nfree; ++k)
            for (int l = 0; l < at->nfree; ++l)
                M[k][l] = turn ? om_dot(at->slope[k], at->slope[l]) : at->M[k][l];
        if (M[0][0] > 0 && M[0][0] * M[1][1] - M[0][1] * M[1][0] > 0) break;
    }
    double det = M[0][0] * M[1][1] - M[0][1] * M[1][0];
    // a crushed face has no directions
    double by_det = det > CRUSHED * M[0][0] * M[1][1] ? 1 / det : 0;
    inverse[0][0] = by_det * M[1][1];
    inverse[1][1] = by_det * M[0][0];
    inverse[0][1] = inverse[1][0] = -by_det * M[0][1];
}

// Newton's step of the square of the distance along the free directions.
static void find_slide(const Spot* at, double step[2]) {
    double inverse[2][2], push[2] = {0, 0};
    invert_free(at, false, inverse);
    for (int k = 0; k < at->nfree; ++k) push[k] = om_dot(at->d, at->slope[k]);
    for (int k = 0; k < 2; ++k) step[k] = inverse[k][0] * push[0] + inverse[k][1] * push[1];
}

// Distance of xi from the border of the face, positive inside.
static double face_inside(int nnode, const double xi[2]) {
    if (nnode == 4) return 1 - fmax(fabs(xi[0]), fabs(xi[1]));
    return fmin(1 - xi[0] - xi[1], fmin(xi[0], xi[1]));
}

// The nearest point inside the face: false if there is none.
static bool find_inside(const Face* F, OmVec3 p, Spot* at) {
    double middle = F->nnode == 4 ? 0 : 1.0 / 3;
    *at = (Spot){.xi = {middle, middle}, .edge = -1, .corner = -1, .nfree = 2};
    at->dir[0][0] = at->dir[1][1] = 1;
    for (int turn = 0; turn < NEWTON_TURNS; ++turn) {
        double step[2];
        eval_spot(F, p, at);
        find_slide(at, step);
        double size = fmax(fabs(step[0]), fabs(step[1])), cut = size > 1 ? 1 / size : 1;
        for (int k = 0; k < 2; ++k) at->xi[k] += cut * step[k];
        if (face_inside(F->nnode, at->xi) < -1) return false;
        if (size < XI_ROUNDING) break;
    }
    eval_spot(F, p, at);
    return face_inside(F->nnode, at->xi) >= -XI_ROUNDING;
}

// The nearest point of edge e.
static void find_on_edge(const Face* F, OmVec3 p, int e, Spot* at) {
    static const double tri[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    static const double quad[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    int n = F->nnode == 4 ? 4 : 3;
    const double *a = n == 4 ? quad[e] : tri[e], *b = n == 4 ? quad[(e + 1) % n] : tri[(e + 1) % n];
    *at = (Spot){.edge = e, .corner = -1, .nfree = 1, .dir = {{b[0] - a[0], b[1] - a[1]}}};
    double t = 0.5;
    for (int turn = 0; turn < NEWTON_TURNS; ++turn) {
        double step[2], last = t;
        for (int k = 0; k < 2; ++k) at->xi[k] = a[k] + t * at->dir[0][k];
        eval_spot(F, p, at);
        find_slide(at, step);
        t = fmin(fmax(t + step[0], 0), 1);
        if (fabs(t - last) < XI_ROUNDING) break;
    }
    if (t <= 0 || t >= 1) {
        at->corner = t <= 0 ? e : (e + 1) % n;
        at->nfree = 0;
    }
    for (int k = 0; k < 2; ++k) at->xi[k] = a[k] + t * at->dir[0][k];
    eval_spot(F, p, at);
}

static void find_on_face(const Face* F, OmVec3 p, Spot* best) {
    if (find_inside(F, p, best)) return;
    for (int e = 0; e < (F->nnode == 4 ? 4 : 3); ++e) {
        Spot at;
        find_on_edge(F, p, e, &at);
        if (e == 0 || om_norm2(at.d) < om_norm2(best->d)) *best = at;
    }
}

// ---- points in contact ------------------------------------------------------------------------------

typedef struct Hit {  // the contact of a point of one side with the other side
    int face;         // -1: no contact
    Spot spot;
} Hit;

typedef struct Search {
    const OmFacePair* c;
    int side;  // the side whose points are tested
    const double* x;
    const OmRule* rule;
    double (*N)[6];  // shape functions at the points of the rule
    double* ball;    // centre and radius of the other side's faces     (nface x 4)
    Hit* hit;        // (npoint)
} Search;

static Face face_of(const OmFacePair* c, int side, int f, const double* x) {
    return (Face){c->nface_node, c->face_node[side] + (size_t)f * (size_t)c->nface_node, x};
}

// Is the point beside the faces of the set, not behind them?
static bool is_on_border(const OmFacePair* c, int side, int f, const Spot* at) {
    int bits = c->border[side][f];
    return at->corner >= 0 ? bits >> (4 + at->corner) & 1 : at->edge >= 0 && (bits >> at->edge & 1);
}

// Distance to the nearest node of a side, limited to the reach: faces further away do not matter.
static double nearest_node(const OmFacePair* c, int side, const double* x, OmVec3 p) {
    double near2 = c->reach * c->reach;
    for (int a = 0; a < c->nnode[side]; ++a)
        near2 = fmin(near2, om_norm2(om_sub(p, om_load3(x, c->node[side][a]))));
    return sqrt(near2) * (1 + TIE);
}

static void search_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Search* s = ctx;
    const OmFacePair* c = s->c;
    for (int n = begin; n < end; ++n) {
        Face own = face_of(c, s->side, n / s->rule->npoint, s->x);
        const double* N = s->N[n % s->rule->npoint];
        OmVec3 p = {0, 0, 0};
        for (int a = 0; a < own.nnode; ++a) p = om_madd(p, N[a], om_load3(s->x, own.node[a]));
        Hit* hit = &s->hit[n];
        double near = nearest_node(c, 1 - s->side, s->x, p), steep = 0;
        hit->face = -1;
        for (int f = 0; f < c->nface[1 - s->side]; ++f) {
            const double* ball = s->ball + 4 * (size_t)f;
            if (om_distance(p, om_load3(ball, 0)) - ball[3] > near) continue;
            Face F = face_of(c, 1 - s->side, f, s->x);
            Spot at;
            find_on_face(&F, p, &at);
            double dist = om_norm(at.d), depth = -om_dot(at.d, at.normal);
            // on an edge two faces are equally near: the face with the larger normal component of d
            // decides on the side
            bool is_nearer = dist < near * (1 - TIE);
            if (!is_nearer && !(dist <= near * (1 + TIE) && fabs(depth) > steep)) continue;
            near = fmin(dist, near);
            steep = fabs(depth);
            hit->face = depth > 0 && !is_on_border(c, 1 - s->side, f, &at) ? f : -1;
            hit->spot = at;
        }
    }
}

// Balls around the faces: shape functions of six nodes reach up to 5/3 of their farthest node.
static void make_balls(const OmFacePair* c, int side, const double* x, double* ball) {
    for (int f = 0; f < c->nface[side]; ++f) {
        Face F = face_of(c, side, f, x);
        OmVec3 mid = {0, 0, 0};
        double radius = 0;
        for (int a = 0; a < F.nnode; ++a) mid = om_madd(mid, 1.0 / F.nnode, om_load3(x, F.node[a]));
        for (int a = 0; a < F.nnode; ++a)
            radius = fmax(radius, om_distance(mid, om_load3(x, F.node[a])));
        om_store3(ball + 4 * (size_t)f, 0, mid);
        ball[4 * (size_t)f + 3] = F.nnode == 6 ? radius * 5 / 3 : radius;
    }
}

// ---- energy, forces, tangent ------------------------------------------------------------------------

typedef struct Join {  // the nodes that a point and its nearest point depend on
    int num, node[MAX_JOIN];
    double c[MAX_JOIN];      // dd/dx_i = c_i I
    double dc[2][MAX_JOIN];  // along the free directions
} Join;

static void join_nodes(const Face* own, const double* N, const Face* other, const Spot* at,
                       Join* j) {
    *j = (Join){.num = own->nnode + other->nnode};
    for (int a = 0; a < own->nnode; ++a) {
        j->node[a] = own->node[a];
        j->c[a] = N[a];
    }
    for (int b = 0; b < other->nnode; ++b) {
        int i = own->nnode + b;
        j->node[i] = other->node[b];
        j->c[i] = -at->N[b];
        for (int k = 0; k < at->nfree; ++k) j->dc[k][i] = -at->dN[k][b];
    }
}

static void add_tangent(const Join* j, const Spot* at, double w, bool is_projected, OmBsr* A) {
    OmVec3 B[2][MAX_JOIN];
    double inverse[2][2];
    invert_free(at, is_projected, inverse);
    for (int k = 0; k < at->nfree; ++k)
        for (int i = 0; i < j->num; ++i)
            B[k][i] =
                om_madd(om_scale(-j->c[i], at->slope[k]), is_projected ? 0 : j->dc[k][i], at->d);
    for (int i = 0; i < j->num; ++i) {
        for (int m = 0; m < j->num; ++m) {
            double own = w * j->c[i] * j->c[m];
            OmMat3 block = om_mat3_diag(om_vec3(own, own, own));
            for (int k = 0; k < at->nfree; ++k)
                for (int l = 0; l < at->nfree; ++l)
                    block = om_mat3_add(
                        block, om_mat3_scale(-w * inverse[k][l], om_mat3_outer(B[k][i], B[l][m])));
            om_bsr_add(A, om_bsr_find(A, j->node[i], j->node[m]), block);
        }
    }
}

// Energy, forces and tangent of the points of one side.
static void add_side(const Search* s, bool is_projected, OmFemTouch* touch, double* f, OmBsr* A) {
    const OmFacePair* c = s->c;
    for (int n = 0; n < c->npoint[s->side]; ++n) {
        const Spot* at = &s->hit[n].spot;
        if (s->hit[n].face < 0) continue;
        Face own = face_of(c, s->side, n / s->rule->npoint, s->x);
        Face other = face_of(c, 1 - s->side, s->hit[n].face, s->x);
        const double *N = s->N[n % s->rule->npoint], w = c->weight[s->side][n];
        Join j;
        join_nodes(&own, N, &other, at, &j);
        for (int i = 0; i < j.num && f; ++i)
            om_store3(f, j.node[i], om_madd(om_load3(f, j.node[i]), w * j.c[i], at->d));
        if (A) add_tangent(&j, at, w, is_projected, A);
        OmVec3 p = {0, 0, 0}, push = om_scale(s->side == 0 ? -w : w, at->d);
        for (int a = 0; a < own.nnode; ++a) p = om_madd(p, N[a], om_load3(s->x, own.node[a]));
        touch->energy += 0.5 * w * om_norm2(at->d);
        touch->force = om_add(touch->force, push);
        touch->torque = om_add(touch->torque, om_cross(p, push));
        touch->area += w / c->stiffness;
        touch->depth = fmax(touch->depth, om_norm(at->d));
    }
}

static OmStatus add_pair(const OmFemSolid* s, const OmFacePair* c, const double* x,
                         bool is_projected, OmFemTouch* touch, double* f, OmBsr* A) {
    OmStatus status = OM_OK;
    OmRule rule;
    double N[OM__MAX_POINT][6], dN[12];
    om__face_rule(c->nface_node, &rule);
    for (int q = 0; q < rule.npoint; ++q) om__face_shape(c->nface_node, rule.xi[q], N[q], dN);
    Search search = {.c = c, .x = x, .rule = &rule, .N = N};
    int nface = c->nface[0] > c->nface[1] ? c->nface[0] : c->nface[1];
    OM_ALLOC_DONE(search.ball, 4 * (size_t)nface);
    OM_ALLOC_DONE(search.hit, (size_t)nface * (size_t)rule.npoint);
    for (search.side = 0; search.side < 2; ++search.side) {
        make_balls(c, 1 - search.side, x, search.ball);
        int npoint = c->npoint[search.side];
        om_parallel_for(npoint < SERIAL ? 1 : s->nworker, npoint, GRAIN, search_block, &search);
        add_side(&search, is_projected, touch, f, A);
    }
done:
    om_free(search.ball);
    om_free(search.hit);
    return status;
}

OmStatus om__contact_eval(const OmFemSolid* s, const double* x, bool is_projected, double* energy,
                          double* f, OmBsr* A) {
    for (int n = 0; n < s->ncontact; ++n) {
        OmFemTouch touch = {0};
        OM_TRY(add_pair(s, &s->contact[n], x, is_projected, &touch, f, A));
        if (energy) *energy += touch.energy;
    }
    return OM_OK;
}

OmStatus om_fem_eval_contact(const OmFemSolid* s, const double* x, int contact, OmFemTouch* touch,
                             double* f) {
    *touch = (OmFemTouch){0};
    OM_CHECK(contact >= 0 && contact < s->ncontact, OM_INVALID, "there is no contact %d of %d",
             contact, s->ncontact);
    if (f) memset(f, 0, 3 * (size_t)s->mesh.nnode * sizeof *f);
    return add_pair(s, &s->contact[contact], x, false, touch, f, NULL);
}
