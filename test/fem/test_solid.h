// test_solid.h: a solid with loads for tests: make a mesh, fix by a rule, push, solve, look.
#ifndef OMENTUM_TEST_SOLID_H
#define OMENTUM_TEST_SOLID_H

#include "test_common.h"

#include "omentum/fem.h"

typedef struct TestSolid {
    OmFemMesh mesh;
    OmMaterial material;
    double density;
    OmLocking locking;
    const OmFemContact* contact;  // one, or null
    OmFemSolid* solid;
    OmFemFaces faces;
    unsigned char* fixed;
    double *goal, *force, *x, *v, *reaction;
    OmFemLoad load;
    OmFemReport report;
} TestSolid;

// After mesh, material (and locking, contact, density) are set.
static inline void solid_start(TestSolid* t) {
    size_t n = 3 * (size_t)t->mesh.nnode;
    OmFemDef def = om_fem_default_def(&t->mesh, 1, &t->material);
    if (t->density > 0) def.density = &t->density;
    def.locking = t->locking;
    def.contact = t->contact;
    def.ncontact = t->contact ? 1 : 0;
    assert_ok(om_fem_create(&def, &t->solid));
    assert_ok(om_fem_mesh_boundary(&t->mesh, &t->faces));
    t->fixed = om_calloc(n, 1);
    t->goal = om_calloc(n, sizeof(double));
    t->force = om_calloc(n, sizeof(double));
    t->x = om_alloc(n, sizeof(double));
    t->v = om_calloc(n, sizeof(double));
    t->reaction = om_calloc(n, sizeof(double));
    memcpy(t->x, t->mesh.x, n * sizeof(double));
    t->load = (OmFemLoad){.fixed = t->fixed, .goal = t->goal, .force = t->force};
}

static inline void solid_done(TestSolid* t) {
    om_fem_destroy(t->solid);
    om_fem_mesh_done(&t->mesh);
    om_fem_faces_done(&t->faces);
    om_free(t->fixed);
    om_free(t->goal);
    om_free(t->force);
    om_free(t->x);
    om_free(t->v);
    om_free(t->reaction);
}

// Prescribe displacement u in direction k of nodes whose coordinate `axis` is `at`.
static inline void solid_hold(TestSolid* t, int axis, double at, int k, double u) {
    for (int i = 0; i < t->mesh.nnode; ++i) {
        if (fabs(t->mesh.x[3 * i + axis] - at) > 1e-9 * (1 + fabs(at))) continue;
        t->fixed[3 * i + k] = 1;
        t->goal[3 * i + k] = u;
    }
}

static inline void solid_clamp(TestSolid* t, int axis, double at) {
    for (int k = 0; k < 3; ++k) solid_hold(t, axis, at, k, 0);
}

// Keep of the boundary the faces whose nodes all have coordinate `axis` at `at`.
static inline void solid_keep_faces(TestSolid* t, int axis, double at) {
    int kept = 0, k = t->faces.nface_node;
    for (int f = 0; f < t->faces.nface; ++f) {
        bool is_there = true;
        for (int a = 0; a < k; ++a)
            is_there &= fabs(t->mesh.x[3 * t->faces.face_node[f * k + a] + axis] - at) <
                        1e-9 * (1 + fabs(at));
        if (!is_there) continue;
        memmove(t->faces.face_node + kept * k, t->faces.face_node + f * k, (size_t)k * sizeof(int));
        ++kept;
    }
    t->faces.nface = kept;
}

static inline OmFemPressure solid_pressure(const TestSolid* t, OmVec3 traction, double pressure) {
    return (OmFemPressure){.nface = t->faces.nface,
                           .nface_node = t->faces.nface_node,
                           .face_node = t->faces.face_node,
                           .traction = traction,
                           .pressure = pressure};
}

static inline void solid_solve(TestSolid* t, int nstep, double tolerance) {
    OmFemStaticDef def = om_fem_static_default_def(t->solid);
    def.nstep = nstep;
    def.min_step = 1.0 / 64;
    def.tolerance = tolerance;
    assert_ok(om_fem_static_solve(t->solid, &t->load, &def, t->x, t->reaction, &t->report));
}

static inline OmVec3 solid_displacement(const TestSolid* t, int node) {
    return om_sub(om_load3(t->x, node), om_load3(t->mesh.x, node));
}

static inline int solid_nearest(const TestSolid* t, OmVec3 p) {
    int best = 0;
    for (int i = 1; i < t->mesh.nnode; ++i)
        if (om_distance(om_load3(t->mesh.x, i), p) < om_distance(om_load3(t->mesh.x, best), p))
            best = i;
    return best;
}

// Norm of the displacements of free degrees of freedom.
static inline double solid_free_norm(const TestSolid* t) {
    double sum = 0;
    for (int i = 0; i < 3 * t->mesh.nnode; ++i)
        if (!t->fixed[i]) sum += (t->x[i] - t->mesh.x[i]) * (t->x[i] - t->mesh.x[i]);
    return sqrt(sum);
}

static inline void solid_box(TestSolid* t, OmElement kind, OmVec3 lo, OmVec3 hi, int nx, int ny,
                             int nz) {
    int num[3] = {nx, ny, nz};
    assert_ok(om_fem_mesh_box(kind, lo, hi, num, &t->mesh));
}

#endif
