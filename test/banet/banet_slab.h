// banet_slab.h: a slab held at a part of its underside, pulled at a free place, for tests of room banet.
#ifndef OMENTUM_BANET_SLAB_H
#define OMENTUM_BANET_SLAB_H

#include "test_common.h"

#include "banet/banet_view_internal.h"

typedef struct Slab {
    OmTetMesh mesh;
    OmSurface surface;
    int *surface_vert, *node;
    double* x;
    unsigned char *attached, *grasped;  // of vertices of the surface
    BanetTruth truth;
} Slab;

static inline void slab_done(Slab* s) {
    om_tet_mesh_done(&s->mesh);
    om_surface_done(&s->surface);
    om_free(s->surface_vert);
    om_free(s->node);
    om_free(s->x);
    om_free(s->attached);
    om_free(s->grasped);
}

// 2 h x 1.5 h x 10 mm, h half of the length, in cells of about 5 mm. Attached below where x < `held`, grasped within
// 8 mm of a point on the top, which is lifted by `lift` (vertices prescribed). Quadratic elements have cells of 10 mm.
static inline void slab_init_element(double half, double held, OmVec3 lift, OmElement element,
                                     Slab* s) {
    memset(s, 0, sizeof *s);
    double edge = element == OM_TET10 ? 0.01 : 0.005;
    int nx = (int)lround(2 * half / edge), ny = (int)lround(1.5 * half / edge);
    assert_ok(om_tet_mesh_box(om_vec3(-half, -0.75 * half, 0), om_vec3(half, 0.75 * half, 0.01), nx,
                              ny, (int)lround(0.01 / edge), &s->mesh));
    if (element == OM_TET10) assert_ok(om_tet_mesh_refine_nodes(&s->mesh, &s->node));
    assert_ok(om_tet_mesh_boundary(&s->mesh, &s->surface, &s->surface_vert));
    size_t n = (size_t)s->surface.nvert;
    s->attached = om_calloc(n, 1);
    s->grasped = om_calloc(n, 1);
    size_t ndof = 3 * (size_t)s->mesh.nvert;
    s->x = om_alloc(ndof, sizeof *s->x);
    unsigned char* fixed = om_calloc(ndof, 1);
    double* goal = om_calloc(ndof, sizeof *goal);
    OmVec3 grasp = om_vec3(0.7 * half, 0.1 * half, 0.01);
    for (int i = 0; i < s->surface.nvert; ++i) {
        OmVec3 p = om_load3(s->surface.x, i);
        int v = s->surface_vert[i];
        s->attached[i] = p.z < 1e-6 && p.x < held;
        s->grasped[i] = om_distance(p, grasp) < 0.008;
        if (s->grasped[i]) om_store3(goal, v, lift);
        for (int k = 0; k < 3; ++k) fixed[3 * v + k] = s->attached[i] || s->grasped[i];
    }
    OmMaterial material = {.law = OM_STABLE_NEO_HOOKEAN, .young = 1e4, .poisson = 0.42};
    OmFemMesh mesh;
    OmFemSolid* solid;
    assert_ok(om_fem_mesh_from_nodes(&s->mesh, s->node, &mesh));
    OmFemDef def = om_fem_default_def(&mesh, 1, &material);
    def.nworker = 1;
    assert_ok(om_fem_create(&def, &solid));
    OmFemLoad load = {.fixed = fixed, .goal = goal};
    OmFemStaticDef how = om_fem_static_default_def(solid);
    how.nstep = 4;
    how.tolerance = 1e-6;
    how.solver.nworker = 1;
    memcpy(s->x, s->mesh.x, ndof * sizeof *s->x);
    assert_int_equal(om_fem_static_solve(solid, &load, &how, s->x, NULL, NULL), OM_OK);
    om_fem_destroy(solid);
    om_fem_mesh_done(&mesh);
    om_free(fixed);
    om_free(goal);
    s->truth = (BanetTruth){.mesh = &s->mesh,
                            .node = s->node,
                            .surface = &s->surface,
                            .surface_vert = s->surface_vert,
                            .x = s->x,
                            .attached = s->attached,
                            .grasped = s->grasped,
                            .young = material.young,
                            .poisson = material.poisson,
                            .density = 1000,
                            .pose_world_board = om_pose_identity()};
}

static inline void slab_init(double half, double held, OmVec3 lift, Slab* s) {
    slab_init_element(half, held, lift, OM_TET4, s);
}

typedef struct SlabError {
    double median, p90;  // m, of vertices seen at 0.5 or more
    double seen;         // share of the vertices
} SlabError;

static inline int slab_compare(const void* a, const void* b) {
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

static inline SlabError slab_error(const BanetTruth* t, const double* u, const double* seen) {
    int n = 0, total = t->surface->nvert;
    double* e = malloc(sizeof(double) * (size_t)total);
    for (int i = 0; i < total; ++i) {
        if (seen[i] < 0.5) continue;
        OmVec3 truth = om_sub(om_load3(t->x, t->surface_vert[i]), om_load3(t->surface->x, i));
        e[n++] = om_distance(om_load3(u, i), truth);
    }
    qsort(e, (size_t)n, sizeof *e, slab_compare);
    SlabError out = {n ? e[n / 2] : (double)NAN, n ? e[(int)(0.9 * n)] : (double)NAN,
                     (double)n / total};
    free(e);
    return out;
}

#endif
