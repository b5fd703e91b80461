// pbd_rig.h: particle models made and freed in one line each.
#ifndef OMENTUM_PBD_RIG_H
#define OMENTUM_PBD_RIG_H

#include "test_rig.h"

#include "omentum/contact_tool.h"
#include "omentum/pbd.h"

typedef struct PbdRig {
    OmPbdDef pbd;
    TestRig r;
} PbdRig;

/// A single layer of particles every 3 mm; change pbd and r.def before pbd_start.
static inline void pbd_sheet(PbdRig* p, double side) {
    memset(p, 0, sizeof *p);
    p->pbd = om_pbd_default_def(OM_PBD_CLUSTERS);
    p->pbd.has_self_collision = false;
    assert_ok(om_pbd_sample_sheet(side, side, 0.003, 0.003, &p->r.mesh, &p->pbd.particle_volume));
    p->r.def = om_tissue_default_def(om_fem_engine(), &p->r.mesh);
    p->r.def.element = OM_ELEMENT_LINEAR;
    p->r.def.solver.nworker = 1;
}

/// The vertices of a box of tetrahedra, held by no one.
static inline void pbd_box(PbdRig* p, OmVec3 size, int nx, int ny, int nz) {
    memset(p, 0, sizeof *p);
    rig_box(&p->r, om_vec3(0, 0, 0), size, nx, ny, nz);
    p->pbd = om_pbd_default_def(OM_PBD_CLUSTERS);
    p->pbd.has_self_collision = false;
    p->pbd.collision_distance = 0;
}

static inline void pbd_start(PbdRig* p) {
    p->r.def.engine = om_pbd_engine();
    p->r.def.options = &p->pbd;
    rig_start(&p->r);
}

static inline void pbd_done(PbdRig* p) { rig_done(&p->r); }

static inline void pbd_run(PbdRig* p, int nstep, double h) {
    for (int n = 0; n < nstep; ++n) assert_ok(om_tissue_step(p->r.m, p->r.s, p->r.w, h, NULL));
}

#endif
