// fem_load.c: dead forces, tractions, gravity, and pressure that follows the surface.
//
// Pressure p on a deformed face: f_a = -p int N_a (dx/dxi x dx/deta). Its tangent is symmetric, and the pressure has an
// energy, only for a closed surface or a fixed rim. Newton's method with the symmetric part alone converges linearly
// with a free rim, more slowly on finer meshes: the bar of test_fem_follower.c with 2 kPa in one load step took 226
// iterations with 4 cells and did not converge with 8; with the whole tangent it takes 49, 69 and 131 with 4, 8 and
// 16.
#include <string.h>

#include "fem/fem_solid.h"

OmStatus om__fem_check_load(const OmFemSolid* s, const OmFemLoad* load) {
    OM_CHECK(load, OM_INVALID, "the load is null");
    OM_CHECK(om_is_finite3(load->body), OM_INVALID, "OmFemLoad.body is not finite");
    for (int i = 0; i < 3 * s->mesh.nnode; ++i) {
        OM_CHECK(!load->force || isfinite(load->force[i]), OM_INVALID,
                 "OmFemLoad.force of node %d is not finite", i / 3);
        OM_CHECK(!load->goal || !load->fixed || !load->fixed[i] || isfinite(load->goal[i]),
                 OM_INVALID, "OmFemLoad.goal of node %d is not finite", i / 3);
    }
    OM_CHECK(load->npressure == 0 || load->pressure, OM_INVALID, "OmFemLoad.pressure is null");
    for (int n = 0; n < load->npressure; ++n) {
        const OmFemPressure* p = &load->pressure[n];
        int nface_node = om__face_nnode(s->mesh.kind);
        OM_CHECK(p->nface >= 0 && (p->nface == 0 || p->face_node) && p->nface_node == nface_node,
                 OM_INVALID, "OmFemLoad.pressure[%d]: faces of %s have %d nodes, not %d", n,
                 om_element_name(s->mesh.kind), nface_node, p->nface_node);
        OM_CHECK(om_is_finite3(p->traction) && isfinite(p->pressure), OM_INVALID,
                 "OmFemLoad.pressure[%d] is not finite", n);
        for (int k = 0; k < p->nface * p->nface_node; ++k)
            OM_CHECK(p->face_node[k] >= 0 && p->face_node[k] < s->mesh.nnode, OM_INVALID,
                     "OmFemLoad.pressure[%d] names node %d of %d", n, p->face_node[k],
                     s->mesh.nnode);
    }
    OM_CHECK(!load->extra || load->extra->eval, OM_INVALID, "OmFemLoad.extra has no eval");
    return OM_OK;
}

static void add_traction(const OmFemSolid* s, const OmFemPressure* p, double* f) {
    OmRule rule;
    om__face_rule(p->nface_node, &rule);
    for (int n = 0; n < p->nface; ++n) {
        const int* node = p->face_node + (size_t)n * (size_t)p->nface_node;
        for (int q = 0; q < rule.npoint; ++q) {
            double N[6], dN[12];
            OmVec3 a, b;
            om__face_shape(p->nface_node, rule.xi[q], N, dN);
            om__face_tangents(p->nface_node, dN, node, s->mesh.x, &a, &b);
            double area = rule.weight[q] * om_norm(om_cross(a, b));
            for (int k = 0; k < p->nface_node; ++k)
                om_store3(f, node[k], om_madd(om_load3(f, node[k]), area * N[k], p->traction));
        }
    }
}

void om__fem_add_dead(const OmFemSolid* s, const OmFemLoad* load, bool is_lumped, double* f) {
    size_t k = (size_t)s->mesh.nelem_node;
    if (load->force)
        for (int i = 0; i < 3 * s->mesh.nnode; ++i) f[i] += load->force[i];
    for (int i = 0; i < s->mesh.nnode && is_lumped; ++i)
        om_store3(f, i, om_madd(om_load3(f, i), s->mass[i], load->body));
    for (size_t n = 0; n < (size_t)s->mesh.nelem * k * k && !is_lumped; ++n) {
        int node = s->mesh.elem_node[n / k];  // rows of the element's mass
        om_store3(f, node, om_madd(om_load3(f, node), s->elem_mass[n], load->body));
    }
    for (int n = 0; n < load->npressure; ++n) add_traction(s, &load->pressure[n], f);
}

bool om__fem_has_follower(const OmFemLoad* load) {
    for (int n = 0; n < load->npressure; ++n)
        if (load->pressure[n].pressure != 0) return true;
    return false;
}

// The matrix u -> v x u.
static OmMat3 cross_matrix(OmVec3 v) {
    return om_mat3_cols(om_vec3(0, v.z, -v.y), om_vec3(-v.z, 0, v.x), om_vec3(v.y, -v.x, 0));
}

// A -= df/dx of one point of a face: df_i = -p N_i (dN_j,1 [.] x b + a x dN_j,2 [.]).
static void add_follower_tangent(int nnode, const int* node, const double* N, const double* dN,
                                 OmVec3 a, OmVec3 b, double scale, OmBsr* A) {
    OmMat3 Xa = cross_matrix(a), Xb = cross_matrix(b);
    for (int i = 0; i < nnode; ++i) {
        for (int j = 0; j < nnode; ++j) {
            OmMat3 m = om_mat3_add(om_mat3_scale(scale * N[i] * dN[2 * j + 1], Xa),
                                   om_mat3_scale(-scale * N[i] * dN[2 * j], Xb));
            om_bsr_add(A, om_bsr_find(A, node[i], node[j]), m);
        }
    }
}

void om__fem_add_follower(const OmFemLoad* load, const double* x, double share, double* f,
                          OmBsr* A) {
    for (int m = 0; m < load->npressure; ++m) {
        const OmFemPressure* p = &load->pressure[m];
        OmRule rule;
        om__face_rule(p->nface_node, &rule);
        for (int n = 0; n < p->nface && p->pressure != 0; ++n) {
            const int* node = p->face_node + (size_t)n * (size_t)p->nface_node;
            for (int q = 0; q < rule.npoint; ++q) {
                double N[6], dN[12], scale = share * p->pressure * rule.weight[q];
                OmVec3 a, b;
                om__face_shape(p->nface_node, rule.xi[q], N, dN);
                om__face_tangents(p->nface_node, dN, node, x, &a, &b);
                OmVec3 normal = om_cross(a, b);
                for (int k = 0; k < p->nface_node && f; ++k)
                    om_store3(f, node[k], om_madd(om_load3(f, node[k]), -scale * N[k], normal));
                if (A) add_follower_tangent(p->nface_node, node, N, dN, a, b, scale, A);
            }
        }
    }
}
