// test_rig.h: a model with its state and work, made and freed in one line each.
#ifndef OMENTUM_TEST_RIG_H
#define OMENTUM_TEST_RIG_H

#include "test_common.h"

#include "omentum/contact.h"
#include "omentum/fem.h"
#include "omentum/tissue.h"
#include "omentum/tissue_engine.h"

typedef struct TestRig {
    OmTetMesh mesh;
    OmTissueDef def;
    OmTissueModel* m;
    OmTissueState* s;
    OmTissueWork* w;
    OmContact* c;
    OmContactWork* cw;
} TestRig;

/// A box of cells and the default definition, one worker; the caller changes rig->def before rig_start.
static inline void rig_box(TestRig* r, OmVec3 lo, OmVec3 hi, int nx, int ny, int nz) {
    memset(r, 0, sizeof *r);
    assert_ok(om_tet_mesh_box(lo, hi, nx, ny, nz, &r->mesh));
    r->def = om_tissue_default_def(om_fem_engine(), &r->mesh);
    r->def.element = OM_ELEMENT_LINEAR;
    r->def.solver.nworker = 1;
    r->def.solver.tolerance = 1e-6;
    r->def.solver.max_iterations = 500;
}

static inline void rig_start(TestRig* r) {
    r->def.mesh = &r->mesh;
    assert_ok(om_tissue_create(&r->def, &r->m));
    assert_ok(om_tissue_state_create(r->m, &r->s));
    assert_ok(om_tissue_work_create(r->m, &r->w));
}

static inline void rig_contact(TestRig* r, const OmContactDef* def) {
    assert_ok(om_contact_create(def, r->m, &r->c));
    assert_ok(om_contact_work_create(r->c, &r->cw));
}

/// A contact with one obstacle, which must outlive the definition.
static inline OmContactDef rig_on(const OmTissueObstacle* obstacle) {
    OmContactDef def = om_contact_default_def();
    def.nobstacle = 1;
    def.obstacle = obstacle;
    return def;
}

static inline void rig_done(TestRig* r) {
    om_contact_work_destroy(r->cw);
    om_contact_destroy(r->c);
    om_tissue_work_destroy(r->w);
    om_tissue_state_destroy(r->s);
    om_tissue_destroy(r->m);
    om_tet_mesh_done(&r->mesh);
}

/// Model, state, work and a step of a definition, all freed again: for test_failing_allocations.
static inline OmStatus rig_create_and_step(void* def) {
    OmTissueModel* m = NULL;
    OmTissueState* s = NULL;
    OmTissueWork* w = NULL;
    OmStatus status = om_tissue_create(def, &m);
    if (status >= 0) status = om_tissue_state_create(m, &s);
    if (status >= 0) status = om_tissue_work_create(m, &w);
    if (status >= 0) status = om_tissue_step(m, s, w, 0.02, NULL);
    om_tissue_work_destroy(w);
    om_tissue_state_destroy(s);
    om_tissue_destroy(m);
    return status;
}

/// Attach the vertices whose coordinate `axis` (0, 1, 2) lies within 1 nm of `at`; before rig_start.
static inline void rig_attach_plane(TestRig* r, int axis, double at) {
    int* vert = om_alloc((size_t)r->mesh.nvert, sizeof *vert);
    int num = 0;
    for (int i = 0; i < r->mesh.nvert; ++i)
        if (fabs(r->mesh.x[3 * i + axis] - at) < 1e-9) vert[num++] = i;
    assert_true(num > 0);
    assert_ok(om_tet_mesh_add_set(&r->mesh, "attachment", vert, num));
    om_free(vert);
}

/// Newton's method for the state at rest: steps so long that inertia is nothing (M / h^2 against K).
static inline void rig_relax(TestRig* r, int nstep) {
    for (int n = 0; n < nstep; ++n) {
        OmStatus status = om_tissue_step(r->m, r->s, r->w, 10, NULL);
        if (status < 0) fail_msg("step %d: %s", n, om_error_message());
    }
}

/// Move interior vertices at random by up to `amount` (a place that is the same in every run).
static inline void rig_shake_by(const OmTetMesh* mesh, const unsigned char* still, double amount,
                                uint64_t seed, double* x) {
    OmRng rng = om_rng_init(seed, 2);
    for (int i = 0; i < mesh->nvert; ++i)
        for (int k = 0; k < 3; ++k)
            if (!still || !still[i]) x[3 * i + k] += amount * (2 * om_rng_uniform(&rng) - 1);
}

static inline void rig_shake(const OmTetMesh* mesh, const unsigned char* still, double amount,
                             double* x) {
    rig_shake_by(mesh, still, amount, 1, x);
}

#endif
