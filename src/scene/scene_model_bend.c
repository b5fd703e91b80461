// scene_model_bend.c: how well a mesh bends with quadratic elements.
//
// One half of a strip of the mesh is held, the other half bends under a weight along the thinnest direction of the
// tissue. The strip is solved with quadratic elements, and again refined once. The error is the energy of the
// difference over that of the refined strip, in elements that touch no side that was cut: jagged sides bend too
// easily. Without a cut this is the missing share of the weight's work. Linear elasticity: neither the size of the
// weight nor the scale of the moduli matters.
//
// Of a strip of more than MAX_TET elements the nearest to the middle are taken; a shorter strip has a larger error.
// Against the whole mesh refined: doc/notes/scene.md.
//
// Rejected: the whole mesh (20,000 elements: 2.7 s, refined minutes); linear against quadratic elements (one layer of
// linear ones shows 0.10 to 0.14 of the deflection while the error of quadratic ones falls from 16 to 6 %); the missing
// work of the cut strip (unstructured sheets: two to four times the error).
#include <stdlib.h>
#include <string.h>

#include "omentum/fem.h"
#include "scene/scene_model_internal.h"

#define HALF_WIDTH 1.5  // mean edges
#define MAX_TET 800
#define FAR 1e12     // m^2, beyond every element
#define HELD "held"  // a set of vertices, which a refinement keeps

typedef struct Frame {
    OmVec3 center;               // centroid of an element
    OmVec3 along, across, thin;  // unit vectors
    double width;                // m, of half a strip
} Frame;

static OmVec3 find_centroid(const OmTetMesh* m, int e) {
    const int* v = m->tet_vert + 4 * (size_t)e;
    const OmVec3 a = om_add(om_load3(m->x, v[0]), om_load3(m->x, v[1]));
    return om_scale(0.25, om_add(a, om_add(om_load3(m->x, v[2]), om_load3(m->x, v[3]))));
}

static void find_extent(const OmTetMesh* m, OmVec3 axis, double* lo, double* hi) {
    *lo = HUGE_VAL, *hi = -HUGE_VAL;
    for (int v = 0; v < m->nvert; ++v) {
        const double s = om_dot(axis, om_load3(m->x, v));
        *lo = fmin(*lo, s), *hi = fmax(*hi, s);
    }
}

// The thinnest direction is that of the least moment of inertia. Across it, the direction of a coordinate axis along
// which the mesh is longest: a square has no longest principal axis.
static Frame find_frame(const OmTetMesh* m, double edge) {
    Frame f = {.width = HALF_WIDTH * edge};
    OmVec3 mean = om_vec3(0, 0, 0), w;
    OmMat3 moment = om_mat3_diag(mean), axis;
    double nearest = HUGE_VAL, longest = -1;
    for (int e = 0; e < m->ntet; ++e) mean = om_madd(mean, 1.0 / m->ntet, find_centroid(m, e));
    for (int e = 0; e < m->ntet; ++e) {
        const OmVec3 c = find_centroid(m, e), d = om_sub(c, mean);
        moment = om_mat3_add(moment, om_mat3_outer(d, d));
        if (om_norm2(d) >= nearest) continue;
        nearest = om_norm2(d);
        f.center = c;
    }
    om_mat3_eigen_symmetric(moment, &w, &axis);
    f.thin = axis.cx;
    for (int k = 0; k < 3; ++k) {
        double lo, hi;
        OmVec3 a = om_vec3(k == 0, k == 1, k == 2);
        a = om_madd(a, -om_dot(a, f.thin), f.thin);
        if (om_norm(a) < 0.5) continue;  // two of three remain
        a = om_normalize(a);
        find_extent(m, a, &lo, &hi);
        if (hi - lo <= longest * 1.001) continue;
        longest = hi - lo;
        f.along = a;
    }
    f.across = om_cross(f.thin, f.along);
    return f;
}

static int compare(const void* a, const void* b) {
    const double d = *(const double*)a - *(const double*)b;
    return (d > 0) - (d < 0);
}

// Squared distance from the middle in the plane of the strip; 2 FAR beside it.
static double find_distance(const OmTetMesh* m, const Frame* f, int e) {
    const OmVec3 d = om_sub(find_centroid(m, e), f->center);
    const double s = om_dot(f->across, d);
    return fabs(s) <= f->width ? om_norm2(d) - s * s : 2 * FAR;
}

// The elements at a distance of at most `most`. A label is twice the index of the material, 1 more for an element
// of the interior, which has no vertex on a side that was cut.
static OmStatus copy_near(const OmPatient* p, const double* distance, double most, int* to,
                          unsigned char* side, OmTetMesh* strip) {
    const OmTetMesh* m = &p->mesh;
    int ntet = 0, nvert = 0, ninside = 0;
    for (int v = 0; v < m->nvert; ++v) to[v] = -1;
    for (int e = 0; e < m->ntet; ++e) {
        const int* v = m->tet_vert + 4 * (size_t)e;
        const bool is_in = distance[e] <= most;
        ntet += is_in;
        for (int k = 0; k < 4; ++k) {
            side[v[k]] |= distance[e] > FAR;
            if (is_in && to[v[k]] < 0) to[v[k]] = nvert++;
        }
    }
    OM_TRY(om_tet_mesh_init(strip, nvert, ntet));
    for (int v = 0; v < m->nvert; ++v)
        if (to[v] >= 0) om_store3(strip->x, to[v], om_load3(m->x, v));
    for (int e = 0, n = 0; e < m->ntet; ++e) {
        const int* v = m->tet_vert + 4 * (size_t)e;
        bool is_inside = true;
        if (distance[e] > most) continue;
        for (int k = 0; k < 4; ++k) {
            strip->tet_vert[4 * (size_t)n + (size_t)k] = to[v[k]];
            is_inside = is_inside && !side[v[k]];
        }
        ninside += is_inside;
        strip->tet_label[n++] = 2 * om_patient_find_material(p, m->tet_label[e]) + is_inside;
    }
    for (int e = 0; e < ntet && ninside == 0; ++e) strip->tet_label[e] |= 1;
    return OM_OK;
}

static OmStatus cut_strip(const OmPatient* p, const Frame* f, OmTetMesh* strip) {
    const OmTetMesh* m = &p->mesh;
    double *distance = NULL, *sorted = NULL;
    int* to = NULL;
    unsigned char* side = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(distance, (size_t)m->ntet);
    OM_ALLOC_DONE(sorted, (size_t)m->ntet);
    OM_ALLOC_DONE(to, (size_t)m->nvert);
    OM_CALLOC_DONE(side, (size_t)m->nvert);
    for (int e = 0; e < m->ntet; ++e) distance[e] = sorted[e] = find_distance(m, f, e);
    qsort(sorted, (size_t)m->ntet, sizeof *sorted, compare);
    const double most = sorted[m->ntet > MAX_TET ? MAX_TET - 1 : m->ntet - 1];
    OM_TRY_DONE(copy_near(p, distance, fmin(most, FAR), to, side, strip));
    // a part that is joined by an edge or a vertex would turn freely
    OM_TRY_DONE(om_tet_mesh_keep_parts(strip, 0, NULL, NULL));
done:
    om_free(distance);
    om_free(sorted);
    om_free(to);
    om_free(side);
    return status;
}

// Hold the half beyond the middle. OM_UNSAT: too few elements to bend.
static OmStatus hold_half(const Frame* f, OmTetMesh* strip) {
    double lo, hi;
    int *vert, n = 0;
    find_extent(strip, f->along, &lo, &hi);
    OM_ALLOC(vert, (size_t)strip->nvert);
    for (int v = 0; v < strip->nvert; ++v)
        if (om_dot(f->along, om_load3(strip->x, v)) >= 0.5 * (lo + hi) - 0.1 * f->width)
            vert[n++] = v;
    OmStatus status = n < 3 || n == strip->nvert ? OM_UNSAT : OM_OK;
    if (status == OM_OK) status = om_tet_mesh_add_set(strip, HELD, vert, n);
    om_free(vert);
    return status;
}

// Mark nodes of the held set, and those between two of them.
static void find_fixed(const OmTetMesh* strip, const OmFemMesh* nodes, unsigned char* fixed) {
    static const int end[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    const OmMeshSet* held = om_tet_mesh_find_set(strip, HELD);
    for (int k = 0; k < held->nvert; ++k) memset(fixed + 3 * (size_t)held->vert[k], 1, 3);
    for (int e = 0; e < nodes->nelem; ++e) {
        const int* node = nodes->elem_node + 10 * (size_t)e;
        for (int k = 0; k < 6; ++k)
            if (fixed[3 * (size_t)node[end[k][0]]] && fixed[3 * (size_t)node[end[k][1]]])
                memset(fixed + 3 * (size_t)node[4 + k], 1, 3);
    }
}

static OmStatus solve(const OmFemSolid* solid, const unsigned char* fixed, const double* load,
                      double* u) {
    OmBsr A = {0};
    OmSolver* solver = NULL;
    const OmFemMesh* mesh = om_fem_mesh(solid);
    OmSolverDef def = om_solver_default_def();
    def.preconditioner = OM_CHOLESKY;
    def.nworker = 1;
    def.row_bound = OM_MAX_ELEM_NODE;
    OM_TRY(om_fem_matrix_create(solid, &A));
    OmStatus status = om_fem_eval_tangent(solid, mesh->x, &A);
    OM_TRY_DONE(status);
    OM_TRY_DONE(om_solver_create(&def, &A, mesh->x, &solver));
    om_solver_set_fixed(solver, fixed);
    status = om_solver_refresh(solver, &A);
    if (status == OM_OK) status = om_solver_solve(solver, &A, 1, load, u, NULL);
done:
    om_solver_destroy(solver);
    om_bsr_destroy(&A);
    return status;
}

typedef struct Bent {  // a strip at rest under its weight; bent_done frees
    OmFemMesh nodes;
    double* u;  // displacement, m  (nnode x 3)
} Bent;

static void bent_done(Bent* b) {
    om_fem_mesh_done(&b->nodes);
    om_free(b->u);
}

static OmStatus make_solid(const OmPatient* p, const OmFemMesh* nodes, OmFemSolid** solid) {
    OmMaterial material[OM_MAX_MATERIAL];
    double density[OM_MAX_MATERIAL];
    for (int k = 0; k < p->nmaterial; ++k) {
        const OmPatientMaterial* m = &p->material[k];
        material[k] = (OmMaterial){.law = OM_LINEAR, .young = m->young, .poisson = m->poisson};
        density[k] = m->density;
    }
    OmFemDef def = om_fem_default_def(nodes, p->nmaterial, material);
    def.density = density;
    def.nworker = 1;
    return om_fem_create(&def, solid);
}

static OmStatus bend(const OmPatient* p, const OmTetMesh* strip, OmVec3 weight, Bent* b) {
    OmFemSolid* solid = NULL;
    unsigned char* fixed = NULL;
    double *g = NULL, *load = NULL;
    OM_TRY(om_fem_mesh_from_tet(strip, OM_TET10, &b->nodes));
    const size_t n = 3 * (size_t)b->nodes.nnode;
    for (int e = 0; e < strip->ntet; ++e) b->nodes.elem_material[e] = strip->tet_label[e] / 2;
    OmStatus status = make_solid(p, &b->nodes, &solid);
    OM_TRY_DONE(status);
    OM_CALLOC_DONE(fixed, n);
    OM_ALLOC_DONE(g, n);
    OM_ALLOC_DONE(load, n);
    OM_CALLOC_DONE(b->u, n);
    find_fixed(strip, &b->nodes, fixed);
    for (int v = 0; v < b->nodes.nnode; ++v) om_store3(g, v, weight);
    om_fem_apply_mass(solid, true, g, load);
    status = solve(solid, fixed, load, b->u);
done:
    om_free(fixed);
    om_free(g);
    om_free(load);
    om_fem_destroy(solid);
    return status;
}

// Displacement of the coarse strip's element e at point q.
static OmVec3 interpolate(const Bent* b, int e, OmVec3 q) {
    static const int end[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    const int* node = b->nodes.elem_node + 10 * (size_t)e;
    const OmVec3 o = om_load3(b->nodes.x, node[0]), d = om_sub(q, o);
    const OmVec3 i = om_sub(om_load3(b->nodes.x, node[1]), o);
    const OmVec3 j = om_sub(om_load3(b->nodes.x, node[2]), o);
    const OmVec3 k = om_sub(om_load3(b->nodes.x, node[3]), o);
    const double six = om_dot(om_cross(i, j), k);  // above 0: om_tet_mesh_validate
    double w[4] = {0, om_dot(om_cross(d, j), k) / six, om_dot(om_cross(i, d), k) / six,
                   om_dot(om_cross(i, j), d) / six};
    w[0] = 1 - w[1] - w[2] - w[3];
    OmVec3 u = om_vec3(0, 0, 0);
    for (int a = 0; a < 4; ++a) u = om_madd(u, w[a] * (2 * w[a] - 1), om_load3(b->u, node[a]));
    for (int a = 0; a < 6; ++a)
        u = om_madd(u, 4 * w[end[a][0]] * w[end[a][1]], om_load3(b->u, node[4 + a]));
    return u;
}

// Energy of the difference of the two strips over that of the fine one, in the interior. Without a cut it is the share
// of the weight's work that is missing (Galerkin orthogonality).
static OmStatus compare_energy(const OmPatient* p, const OmTetMesh* refined, const Bent* coarse,
                               const Bent* fine, double* error) {
    OmFemSolid* solid = NULL;
    OmFemMesh inside = fine->nodes;
    const size_t n = 3 * (size_t)inside.nnode;
    double *x = NULL, whole = 0, missing = 0;
    int* node = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(x, n);
    OM_ALLOC_DONE(node, 10 * (size_t)refined->ntet);
    inside.elem_node = node;
    inside.elem_material = NULL;
    OM_ALLOC_DONE(inside.elem_material, (size_t)refined->ntet);
    inside.nelem = 0;
    for (int e = 0; e < refined->ntet; ++e) {
        if (refined->tet_label[e] % 2 == 0) continue;
        memcpy(node + 10 * (size_t)inside.nelem, fine->nodes.elem_node + 10 * (size_t)e,
               10 * sizeof *node);
        inside.elem_material[inside.nelem++] = refined->tet_label[e] / 2;
    }
    OM_TRY_DONE(make_solid(p, &inside, &solid));
    for (size_t i = 0; i < n; ++i) x[i] = inside.x[i] + fine->u[i];
    OM_TRY_DONE(om_fem_eval_energy(solid, x, &whole));
    for (int e = 0; e < refined->ntet; ++e)  // elements 8 t to 8 t + 7 fill element t
        for (int k = 0; k < 10; ++k) {
            const int v = fine->nodes.elem_node[10 * (size_t)e + (size_t)k];
            const OmVec3 at = om_load3(inside.x, v);
            om_store3(x, v,
                      om_add(at, om_sub(om_load3(fine->u, v), interpolate(coarse, e / 8, at))));
        }
    OM_TRY_DONE(om_fem_eval_energy(solid, x, &missing));
    if (whole > 0) *error = fmin(1, missing / whole);
done:
    om_free(x);
    om_free(node);
    if (inside.elem_material != fine->nodes.elem_material) om_free(inside.elem_material);
    om_fem_destroy(solid);
    return status;
}

OmStatus om_patient_find_bending_error(const OmPatient* p, double* error) {
    OmTetMesh strip = {0};
    OmMeshQuality quality;
    Bent coarse = {0}, fine = {0};
    *error = 1;
    OM_TRY(om__patient_check_materials(p));
    OM_TRY(om_tet_mesh_quality(&p->mesh, &quality));
    const Frame f = find_frame(&p->mesh, quality.edge_mean);
    OmStatus status = cut_strip(p, &f, &strip);
    if (status == OM_OK) status = hold_half(&f, &strip);
    if (status == OM_OK) status = bend(p, &strip, f.thin, &coarse);
    if (status == OM_OK) status = om_tet_mesh_refine(&strip);
    if (status == OM_OK) status = bend(p, &strip, f.thin, &fine);
    // Any other outcome: too few elements, or hinges between them, that leave a mechanism; nothing bends.
    if (status == OM_OK) status = compare_energy(p, &strip, &coarse, &fine, error);
    om_tet_mesh_done(&strip);
    bent_done(&coarse);
    bent_done(&fine);
    return status < 0 ? status : OM_OK;
}
