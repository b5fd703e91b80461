// fem_assemble_solid.c: energy, forces and tangent of a solid at given positions.
//
// With g_a the rest gradient of shape function a at a quadrature point of volume w, F = sum x_a g_a^T, the
// force on node a is w P g_a and block (a, b) of the tangent is w g_a . H . g_b. Where a group of points has
// a common volume ratio (a mean-dilatation hexahedron, the patch of a node) U(J) is evaluated at the common
// ratio t = v / V:
//
//     E = sum w W_shape(F) + sum V U(t),  P = P_shape + p C,  H = H_shape + p d2J,  p = U'(t) (mean of the nodes')
//
// and each common ratio adds V U''(t) grad t grad t^T, which couples all nodes that it depends on. Nodal
// pressures are averaged as by Bonet and Burton (1998); with several materials U of a patch is their sum by
// volume. Where shapes are smoothed too, W_shape is evaluated at the mean F of the elements around each edge.
#include <string.h>

#include "fem/fem_solid.h"

#define GRAIN 32
#define SERIAL 128  // with fewer elements of a colour a team does not pay

typedef struct Pass {
    const OmFemSolid* s;
    const double* x;
    const int* elem;  // elements of the colour
    double* f;        // null: not wanted
    OmBsr* A;         // null: not wanted
    bool is_projected;
    const double* pressure;  // of nodes, OM_NODAL_VOLUME
    double* partial;         // energy by block
    double *ratio, *node_pressure, *node_curvature;
} Pass;

// ---- elements ---------------------------------------------------------------------------------------

void om__fem_gradient(const OmFemSolid* s, int e, int q, const double* x, double F[9]) {
    size_t k = (size_t)s->mesh.nelem_node;
    const int* node = s->mesh.elem_node + (size_t)e * k;
    const double* g = s->grad + ((size_t)e * (size_t)s->npoint + (size_t)q) * k * 3;
    memset(F, 0, 9 * sizeof *F);
    for (size_t a = 0; a < k; ++a) {
        const double* p = x + 3 * (size_t)node[a];
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r) F[3 * c + r] += p[r] * g[3 * a + (size_t)c];
    }
}

// v / V of an element.
static double elem_ratio(const OmFemSolid* s, int e, const double* x) {
    double v = 0, F[9], C[9];
    for (int q = 0; q < s->npoint; ++q) {
        om__fem_gradient(s, e, q, x, F);
        v += s->weight[(size_t)e * (size_t)s->npoint + (size_t)q] * om__law_det(F, C);
    }
    return v / s->volume[e];
}

// The pressure of an element with a common volume ratio, and the split of its law.
static double shared_pressure(const Pass* p, int e, OmJet* U) {
    const OmFemSolid* s = p->s;
    *U = (OmJet){0, 0, 0};
    if (s->mesh.kind == OM_HEX8_MEAN) {
        *U = om__law_volume(&s->law[s->mesh.elem_material[e]], elem_ratio(s, e, p->x));
        return U->d;
    }
    if (!p->pressure) return 0;
    const int* node = s->mesh.elem_node + 4 * (size_t)e;
    return 0.25 * (p->pressure[node[0]] + p->pressure[node[1]] + p->pressure[node[2]] +
                   p->pressure[node[3]]);
}

static OmLawPart part_of(const OmFemSolid* s) {
    bool is_shared = s->mesh.kind == OM_HEX8_MEAN || s->locking != OM_LOCKING_NONE;
    return is_shared ? OM_LAW_SHAPE : OM_LAW_WHOLE;
}

// The part of the law that an element evaluates itself; with OM_SMOOTHED only the common pressure.
static void eval_law(const OmFemSolid* s, int e, const double F[9], OmLawOrder order,
                     OmLawValue* out) {
    if (s->locking == OM_SMOOTHED)
        memset(out, 0, sizeof *out);
    else
        om__law_eval(&s->law[s->mesh.elem_material[e]], F, part_of(s), order, out);
}

// Energy and force on the nodes of an element.
static double eval_element(const Pass* p, int e, double* fe) {
    const OmFemSolid* s = p->s;
    size_t k = (size_t)s->mesh.nelem_node, at = (size_t)e * (size_t)s->npoint;
    OmJet U;
    double pressure = shared_pressure(p, e, &U), energy = s->volume[e] * U.f;
    OmLawValue law;
    memset(fe, 0, 3 * k * sizeof *fe);
    for (int q = 0; q < s->npoint; ++q) {
        double F[9], C[9], w = s->weight[at + (size_t)q];
        const double* g = s->grad + (at + (size_t)q) * k * 3;
        om__fem_gradient(s, e, q, p->x, F);
        eval_law(s, e, F, p->f ? OM_LAW_STRESS : OM_LAW_ENERGY, &law);
        energy += w * law.W;
        if (!p->f) continue;
        if (part_of(s) == OM_LAW_SHAPE) {
            om__law_det(F, C);
            for (int i = 0; i < 9; ++i) law.P[i] += pressure * C[i];
        }
        for (size_t a = 0; a < k; ++a)
            for (size_t r = 0; r < 3; ++r)
                fe[3 * a + r] += w * (law.P[r] * g[3 * a] + law.P[3 + r] * g[3 * a + 1] +
                                      law.P[6 + r] * g[3 * a + 2]);
    }
    return energy;
}

// K += w g_a . H . g_b for a <= b; block (a, b) at K[9 (a k + b)], by columns.
static void add_point_tangent(size_t k, const double* g, double w, const double H[81], double* K) {
    for (size_t b = 0; b < k; ++b) {
        double T[27];  // T[9 c + i]: H[i, 3 d + c] g_b[d]
        const double g0 = w * g[3 * b], g1 = w * g[3 * b + 1], g2 = w * g[3 * b + 2];
        for (size_t c = 0; c < 3; ++c)
            for (size_t i = 0; i < 9; ++i)
                T[9 * c + i] =
                    H[9 * c + i] * g0 + H[9 * (3 + c) + i] * g1 + H[9 * (6 + c) + i] * g2;
        for (size_t a = 0; a <= b; ++a) {
            const double* ga = g + 3 * a;
            double* block = K + 9 * (a * k + b);
            for (size_t c = 0; c < 3; ++c)
                for (size_t r = 0; r < 3; ++r)
                    block[3 * c + r] +=
                        ga[0] * T[9 * c + r] + ga[1] * T[9 * c + 3 + r] + ga[2] * T[9 * c + 6 + r];
        }
    }
}

static void add_outer(size_t k, double scale, const double* v, double* K) {
    for (size_t a = 0; a < k; ++a)
        for (size_t b = a; b < k; ++b)
            for (size_t c = 0; c < 3; ++c)
                for (size_t r = 0; r < 3; ++r)
                    K[9 * (a * k + b) + 3 * c + r] += scale * v[3 * a + r] * v[3 * b + c];
}

static void eval_tangent(const Pass* p, int e, double* K) {
    const OmFemSolid* s = p->s;
    size_t k = (size_t)s->mesh.nelem_node, at = (size_t)e * (size_t)s->npoint;
    OmJet U;
    double pressure = shared_pressure(p, e, &U), mean[3 * OM_MAX_ELEM_NODE] = {0};
    OmLawValue law;
    memset(K, 0, 9 * k * k * sizeof *K);
    for (int q = 0; q < s->npoint; ++q) {
        double F[9], C[9], w = s->weight[at + (size_t)q];
        const double* g = s->grad + (at + (size_t)q) * k * 3;
        om__fem_gradient(s, e, q, p->x, F);
        eval_law(s, e, F, OM_LAW_TANGENT, &law);
        if (part_of(s) == OM_LAW_SHAPE) om__law_add_det2(F, pressure, law.H);
        if (p->is_projected) om__law_project(F, law.H);
        add_point_tangent(k, g, w, law.H, K);
        if (s->mesh.kind != OM_HEX8_MEAN) continue;
        om__law_det(F, C);
        for (size_t a = 0; a < k; ++a)
            for (size_t r = 0; r < 3; ++r)
                mean[3 * a + r] +=
                    w * (C[r] * g[3 * a] + C[3 + r] * g[3 * a + 1] + C[6 + r] * g[3 * a + 2]);
    }
    if (p->is_projected && U.dd < 0) U.dd = 0;
    if (s->mesh.kind == OM_HEX8_MEAN) add_outer(k, U.dd / s->volume[e], mean, K);
}

// ---- passes over colours ----------------------------------------------------------------------------

static void force_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Pass* p = ctx;
    double fe[3 * OM_MAX_ELEM_NODE];
    for (int n = begin; n < end; ++n) {
        int e = p->elem[n], k = p->s->mesh.nelem_node;
        const int* node = p->s->mesh.elem_node + (size_t)e * (size_t)k;
        double energy = eval_element(p, e, fe);
        if (p->partial) p->partial[e] = energy;
        for (int a = 0; a < k && p->f; ++a)
            om_store3(p->f, node[a], om_add(om_load3(p->f, node[a]), om_load3(fe, a)));
    }
}

// Add a block and its transpose to the matrix; on the diagonal they are the same block.
static void scatter(OmBsr* A, int upper, int lower, const double* from) {
    double *to = A->exact + 9 * (size_t)upper, *other = A->exact + 9 * (size_t)lower;
    for (size_t i = 0; i < 9; ++i) to[i] += from[i];
    for (size_t i = 0; i < 9 && upper != lower; ++i) other[i] += from[3 * (i % 3) + i / 3];
}

static void tangent_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Pass* p = ctx;
    double K[9 * OM_MAX_ELEM_NODE * OM_MAX_ELEM_NODE];
    size_t k = (size_t)p->s->mesh.nelem_node;
    for (int n = begin; n < end; ++n) {
        size_t e = (size_t)p->elem[n];
        const int* adr = p->s->elem_adr + e * k * k;
        eval_tangent(p, (int)e, K);
        for (size_t a = 0; a < k; ++a) {
            for (size_t b = a; b < k; ++b) {
                scatter(p->A, adr[a * k + b], adr[b * k + a], K + 9 * (a * k + b));
            }
        }
    }
}

// The same for hexahedra, eight at a time.
static void octet_force_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Pass* p = ctx;
    double fe[8][24], energy[8];
    for (int n = begin; n < end; n += 8) {
        int num = end - n < 8 ? end - n : 8;
        om__octet_force(p->s, p->elem + n, num, p->x, fe, energy);
        for (int l = 0; l < num; ++l) {
            const int* node = p->s->mesh.elem_node + 8 * (size_t)p->elem[n + l];
            if (p->partial) p->partial[p->elem[n + l]] = energy[l];
            for (int a = 0; a < 8 && p->f; ++a)
                om_store3(p->f, node[a], om_add(om_load3(p->f, node[a]), om_load3(fe[l], a)));
        }
    }
}

static void octet_tangent_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Pass* p = ctx;
    double K[8][36][9];
    for (int n = begin; n < end; n += 8) {
        int num = end - n < 8 ? end - n : 8;
        om__octet_tangent(p->s, p->elem + n, num, p->x, K);
        for (int l = 0; l < num; ++l) {
            const int* adr = p->s->elem_adr + 64 * (size_t)p->elem[n + l];
            for (size_t a = 0, m = 0; a < 8; ++a)
                for (size_t b = a; b < 8; ++b, ++m)
                    scatter(p->A, adr[8 * a + b], adr[8 * b + a], K[l][m]);
        }
    }
}

static void for_colors(Pass* p, const OmColors* colors, OmRangeFn fn) {
    for (int c = 0; c < colors->num; ++c) {
        int num = colors->adr[c + 1] - colors->adr[c];
        p->elem = colors->cell + colors->adr[c];
        om_parallel_for(num < SERIAL ? 1 : p->s->nworker, num, GRAIN, fn, p);
    }
}

// ---- edge patches -----------------------------------------------------------------------------------

// Energy, stress and tangent of a patch, times its volume.
static void eval_patch(const Pass* p, int patch, OmLawOrder order, OmLawValue* sum) {
    const OmPatches* P = &p->s->patches;
    double F[9] = {0};
    for (int a = P->adr[patch]; a < P->adr[patch + 1]; ++a)
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r)
                F[3 * c + r] += p->x[3 * P->node[a] + r] * P->grad[3 * a + c];
    memset(sum, 0, sizeof *sum);
    for (int m = P->part_adr[patch]; m < P->part_adr[patch + 1]; ++m) {
        OmLawValue law;
        om__law_eval(&p->s->law[P->material[m]], F, OM_LAW_SHAPE, order, &law);
        sum->W += P->volume[m] * law.W;
        for (int i = 0; i < 9 && order >= OM_LAW_STRESS; ++i) sum->P[i] += P->volume[m] * law.P[i];
        for (int i = 0; i < 81 && order == OM_LAW_TANGENT; ++i)
            sum->H[i] += P->volume[m] * law.H[i];
    }
    if (order == OM_LAW_TANGENT && p->is_projected) om__law_project(F, sum->H);
}

static void patch_force_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Pass* p = ctx;
    const OmPatches* P = &p->s->patches;
    for (int n = begin; n < end; ++n) {
        OmLawValue law;
        int patch = p->elem[n];
        eval_patch(p, patch, p->f ? OM_LAW_STRESS : OM_LAW_ENERGY, &law);
        p->partial[patch] = law.W;
        for (int a = P->adr[patch]; a < P->adr[patch + 1] && p->f; ++a) {
            OmVec3 f = om_load3(p->f, P->node[a]);
            for (int c = 0; c < 3; ++c) f = om_madd(f, P->grad[3 * a + c], om_load3(law.P, c));
            om_store3(p->f, P->node[a], f);
        }
    }
}

static void patch_tangent_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Pass* p = ctx;
    const OmPatches* P = &p->s->patches;
    double K[9 * OM__MAX_PATCH * OM__MAX_PATCH];
    for (int n = begin; n < end; ++n) {
        OmLawValue law;
        int patch = p->elem[n];
        size_t first = (size_t)P->adr[patch], k = (size_t)P->adr[patch + 1] - first;
        eval_patch(p, patch, OM_LAW_TANGENT, &law);
        memset(K, 0, 9 * k * k * sizeof *K);
        add_point_tangent(k, P->grad + 3 * first, 1, law.H, K);
        for (size_t a = 0; a < k; ++a)
            for (size_t b = a; b < k; ++b) {
                int i = P->node[first + a], j = P->node[first + b];
                scatter(p->A, om_bsr_find(p->A, i, j), om_bsr_find(p->A, j, i),
                        K + 9 * (a * k + b));
            }
    }
}

// ---- nodal volumes ----------------------------------------------------------------------------------

static void ratio_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Pass* p = ctx;
    for (int e = begin; e < end; ++e) p->ratio[e] = elem_ratio(p->s, e, p->x);
}

// Pressure, curvature of the energy by nodal volume, and the energy of each node's patch.
static void pressure_block(void* ctx, int begin, int end, int block) {
    (void)block;
    const Pass* p = ctx;
    const OmFemSolid* s = p->s;
    for (int i = begin; i < end; ++i) {
        double v = 0;
        OmJet sum = {0, 0, 0};
        for (int m = s->node_adr[i]; m < s->node_adr[i + 1]; ++m)
            v += 0.25 * s->volume[s->node_elem[m]] * p->ratio[s->node_elem[m]];
        double V = s->node_volume[i];
        for (int m = s->node_adr[i]; m < s->node_adr[i + 1]; ++m) {
            int e = s->node_elem[m];
            OmJet U = om__law_volume(&s->law[s->mesh.elem_material[e]], v / V);
            sum.f += 0.25 * s->volume[e] * U.f;
            sum.d += 0.25 * s->volume[e] * U.d / V;
            sum.dd += 0.25 * s->volume[e] * U.dd / (V * V);
        }
        p->partial[i] = sum.f;
        p->node_pressure[i] = sum.d;
        p->node_curvature[i] = sum.dd;
    }
}

// Gradient of the volume of node a's patch at node i: a quarter of dv_e / dx_i summed over elements of both.
static OmVec3 volume_gradient(const OmFemSolid* s, const double* x, int a, int i) {
    OmVec3 sum = {0, 0, 0};
    for (int m = s->node_adr[i]; m < s->node_adr[i + 1]; ++m) {
        size_t e = (size_t)s->node_elem[m];
        const int* node = s->mesh.elem_node + 4 * e;
        int has = -1, local = 0;
        for (int b = 0; b < 4; ++b) {
            if (node[b] == a) has = b;
            if (node[b] == i) local = b;
        }
        if (has < 0) continue;
        double F[9], C[9];
        const double* g = s->grad + 12 * e + 3 * (size_t)local;
        om__fem_gradient(s, (int)e, 0, x, F);
        om__law_det(F, C);
        for (int c = 0; c < 3; ++c) sum = om_madd(sum, 0.25 * s->volume[e] * g[c], om_load3(C, c));
    }
    return sum;
}

// Row i of sum_a curvature_a grad v_a grad v_a^T: a runs over i and its neighbours, j over a's patch.
static void patch_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Pass* p = ctx;
    const OmFemSolid* s = p->s;
    for (int i = begin; i < end; ++i) {
        for (int m = s->node_adr[i]; m < s->node_adr[i + 1]; ++m) {
            const int* around = s->mesh.elem_node + 4 * (size_t)s->node_elem[m];
            for (int b = 0; b < 4; ++b) {
                // each pair (element around i, its node a) once per a: at its first occurrence
                int a = around[b], first = s->node_adr[i];
                bool is_met = false;
                for (; first < m && !is_met; ++first)
                    for (int c = 0; c < 4; ++c)
                        is_met |=
                            s->mesh.elem_node[4 * (size_t)s->node_elem[first] + (size_t)c] == a;
                double curvature = p->node_curvature[a];
                if (is_met || (p->is_projected && curvature < 0)) continue;
                OmVec3 gi = om_scale(curvature, volume_gradient(s, p->x, a, i));
                for (int n = s->node_adr[a]; n < s->node_adr[a + 1]; ++n) {
                    size_t e = (size_t)s->node_elem[n];
                    double F[9], C[9];
                    om__fem_gradient(s, (int)e, 0, p->x, F);
                    om__law_det(F, C);
                    for (size_t d = 0; d < 4; ++d) {
                        const double* g = s->grad + 12 * e + 3 * d;
                        OmVec3 gj = {0, 0, 0};
                        for (int c = 0; c < 3; ++c)
                            gj = om_madd(gj, 0.25 * s->volume[e] * g[c], om_load3(C, c));
                        double* to = p->A->exact +
                                     9 * (size_t)om_bsr_find(p->A, i, s->mesh.elem_node[4 * e + d]);
                        OmMat3 add = om_mat3_outer(gi, gj);
                        for (int c = 0; c < 3; ++c) {
                            OmVec3 col = c == 0 ? add.cx : c == 1 ? add.cy : add.cz;
                            om_store3(to, c, om_add(om_load3(to, c), col));
                        }
                    }
                }
            }
        }
    }
}

// Pressures and curvatures in scratch memory that the caller frees; null where they are not needed.
static OmStatus begin_pass(Pass* p, bool wants_energy, double** scratch, double* energy) {
    const OmFemSolid* s = p->s;
    size_t ne = (size_t)s->mesh.nelem, nn = (size_t)s->mesh.nnode;
    bool is_nodal = s->locking != OM_LOCKING_NONE;
    *energy = 0;
    *scratch = NULL;
    if (!is_nodal && !wants_energy) return OM_OK;
    size_t max = ne > nn ? ne : nn;  // elements, nodes or patches
    if ((size_t)s->patches.num > max) max = (size_t)s->patches.num;
    OM_ALLOC(*scratch, max + ne + 2 * nn);
    p->partial = *scratch;
    if (!is_nodal) return OM_OK;
    p->node_pressure = p->partial + max;
    p->node_curvature = p->node_pressure + nn;
    p->ratio = p->node_curvature + nn;
    om_parallel_for(s->nworker, s->mesh.nelem, GRAIN, ratio_block, p);
    om_parallel_for(s->nworker, s->mesh.nnode, GRAIN, pressure_block, p);
    p->pressure = p->node_pressure;
    for (size_t i = 0; i < nn; ++i) *energy += p->partial[i];
    return OM_OK;
}

// ---- public functions -------------------------------------------------------------------------------

OmStatus om_fem_eval_force(const OmFemSolid* s, const double* x, double* f, double* energy) {
    Pass p = {.s = s, .x = x, .f = f};
    double *scratch, sum;
    OM_TRY(begin_pass(&p, energy != NULL, &scratch, &sum));
    if (f) memset(f, 0, 3 * (size_t)s->mesh.nnode * sizeof *f);
    for_colors(&p, &s->colors, s->has_octets ? octet_force_block : force_block);
    for (int e = 0; e < s->mesh.nelem && p.partial; ++e) sum += p.partial[e];
    for_colors(&p, &s->patches.colors, patch_force_block);
    for (int e = 0; e < s->patches.num; ++e) sum += p.partial[e];
    om_free(scratch);
    if (energy) *energy = sum;
    return om__contact_eval(s, x, false, energy, f, NULL);
}

OmStatus om_fem_eval_energy(const OmFemSolid* s, const double* x, double* energy) {
    return om_fem_eval_force(s, x, NULL, energy);
}

static void round_block(void* ctx, int begin, int end, int block) {
    (void)block;
    OmBsr* A = ctx;
    for (size_t n = 9 * (size_t)begin; n < 9 * (size_t)end; ++n) A->value[n] = (float)A->exact[n];
}

OmStatus om__fem_tangent(const OmFemSolid* s, const double* x, bool is_projected, OmBsr* A) {
    OM_CHECK(A->exact && A->nvert == s->mesh.nnode, OM_INVALID,
             "the matrix was not made by om_fem_matrix_create of this solid");
    Pass p = {.s = s, .x = x, .A = A, .is_projected = is_projected};
    double *scratch, energy;
    OM_TRY(begin_pass(&p, false, &scratch, &energy));
    om_bsr_zero(A);
    for_colors(&p, &s->colors,
               s->has_octets && !is_projected ? octet_tangent_block : tangent_block);
    for_colors(&p, &s->patches.colors, patch_tangent_block);
    if (s->locking != OM_LOCKING_NONE)
        om_parallel_for(s->nworker, s->mesh.nnode, GRAIN, patch_rows, &p);
    om_free(scratch);
    OM_TRY(om__contact_eval(s, x, is_projected, NULL, NULL, A));
    om_parallel_for(s->nworker, A->nblock, 4096, round_block, A);
    return OM_OK;
}

OmStatus om_fem_eval_tangent(const OmFemSolid* s, const double* x, OmBsr* A) {
    return om__fem_tangent(s, x, s->is_projected, A);
}

double om_fem_eval_volume(const OmFemSolid* s, const double* x, double* ratio) {
    double min = INFINITY, F[9], C[9];
    for (int e = 0; e < s->mesh.nelem; ++e) {
        for (int q = 0; q < s->npoint; ++q) {
            om__fem_gradient(s, e, q, x, F);
            min = fmin(min, om__law_det(F, C));
        }
        if (ratio) ratio[e] = elem_ratio(s, e, x);
    }
    return min;
}

// Shape gradients at the point that has these weights; reference coordinates are sums over nodes.
static OmStatus gradients_at(const OmFemSolid* s, int e, const double* weight, double* g) {
    static const double tet[10][3] = {{0, 0, 0},   {1, 0, 0},   {0, 1, 0},  {0, 0, 1},
                                      {.5, 0, 0},  {.5, .5, 0}, {0, .5, 0}, {0, 0, .5},
                                      {.5, 0, .5}, {0, .5, .5}};
    static const double hex[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                     {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
    int k = s->mesh.nelem_node;
    double xi[3] = {0, 0, 0}, N[OM_MAX_ELEM_NODE], dN[3 * OM_MAX_ELEM_NODE];
    for (int a = 0; a < k; ++a)
        for (int c = 0; c < 3; ++c) xi[c] += weight[a] * (k == 8 ? hex[a][c] : tet[a][c]);
    om__element_shape(s->mesh.kind, xi, N, dN);
    const int* node = s->mesh.elem_node + (size_t)e * (size_t)k;
    OmMat3 inverse;
    OM_TRY(om_mat3_inverse(om__element_jacobian(k, dN, s->mesh.x, node), &inverse));
    for (int a = 0; a < k; ++a) om_store3(g, a, om_mat3_apply_transposed(inverse, om_load3(dN, a)));
    return OM_OK;
}

// Cauchy stress of one deformation gradient, added to sum with a weight.
static void add_stress(const OmFemSolid* s, int e, const double* x, const double F[9], double w,
                       double sum[9]) {
    OmLawValue law;
    double C[9], J = om__law_det(F, C);
    om__law_eval(&s->law[s->mesh.elem_material[e]], F, part_of(s), OM_LAW_STRESS, &law);
    if (s->mesh.kind == OM_HEX8_MEAN) {
        OmJet U = om__law_volume(&s->law[s->mesh.elem_material[e]], elem_ratio(s, e, x));
        for (int i = 0; i < 9; ++i) law.P[i] += U.d * C[i];
    }
    double by_J = fabs(J) > 1e-12 ? w / J : 0;  // Cauchy stress is undefined without volume
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            for (int k = 0; k < 3; ++k) sum[3 * c + r] += by_J * law.P[3 * k + r] * F[3 * k + c];
}

OmStatus om_fem_eval_stress(const OmFemSolid* s, const double* x, int elem, const double* weight,
                            OmMat3* stress, OmMat3* F) {
    OM_CHECK(elem >= 0 && elem < s->mesh.nelem, OM_INVALID, "there is no element %d of %d", elem,
             s->mesh.nelem);
    OM_CHECK(s->locking == OM_LOCKING_NONE || !stress, OM_INVALID,
             "om_fem_eval_stress: the pressure of OM_NODAL_VOLUME belongs to nodes");
    double f[9], mean[9] = {0}, sigma[9] = {0}, g[3 * OM_MAX_ELEM_NODE];
    const int* node = s->mesh.elem_node + (size_t)elem * (size_t)s->mesh.nelem_node;
    if (weight) {
        OM_TRY(gradients_at(s, elem, weight, g));
        for (int a = 0; a < s->mesh.nelem_node; ++a)
            for (int c = 0; c < 3; ++c)
                om_store3(mean, c, om_madd(om_load3(mean, c), g[3 * a + c], om_load3(x, node[a])));
        add_stress(s, elem, x, mean, 1, sigma);
    }
    for (int q = 0; q < s->npoint && !weight; ++q) {
        double share = s->weight[(size_t)elem * (size_t)s->npoint + (size_t)q] / s->volume[elem];
        om__fem_gradient(s, elem, q, x, f);
        for (int i = 0; i < 9; ++i) mean[i] += share * f[i];
        add_stress(s, elem, x, f, share, sigma);
    }
    if (stress) *stress = om_mat3_cols(om_load3(sigma, 0), om_load3(sigma, 1), om_load3(sigma, 2));
    if (F) *F = om_mat3_cols(om_load3(mean, 0), om_load3(mean, 1), om_load3(mean, 2));
    return OM_OK;
}
