// test_press_rig.h: a block, a probe and what presses the one on the other.
#ifndef OMENTUM_TEST_PRESS_RIG_H
#define OMENTUM_TEST_PRESS_RIG_H

#include "test_rig.h"

#include "omentum/contact_tool.h"

#define H 0.02

typedef struct PressRig {
    TestRig r;
    OmProbe* probe;
    OmPress* press;
} PressRig;

// A block on its fixed underside, 0.12 x 0.1 x 0.05 m.
static inline void make_block(PressRig* p, int nx, int ny, int nz) {
    memset(p, 0, sizeof *p);
    rig_box(&p->r, om_vec3(0, 0, 0), om_vec3(0.12, 0.1, 0.05), nx, ny, nz);
    rig_attach_plane(&p->r, 2, 0);
    p->r.def.gravity = om_vec3(0, 0, 0);
    p->r.def.rayleigh_mass = 2;
    p->r.def.solver.max_rhs = 8;
    p->r.def.solver.tolerance = 1e-5;
}

static inline void done(PressRig* p) {
    om_press_destroy(p->press);
    om_probe_destroy(p->probe);
    rig_done(&p->r);
}

// The upper side as a grid of 2 mm, so that a flat probe has rows of points under it and
// none under its rounded edges.
static inline void make_top(OmSurface* top) {
    enum { NX = 61, NY = 51 };
    assert_ok(om_surface_init(top, NX * NY, 2 * (NX - 1) * (NY - 1)));
    int* t = top->tri_vert;
    for (int j = 0; j < NY; ++j) {
        for (int i = 0; i < NX; ++i) {
            om_store3(top->x, i + NX * j, om_vec3(0.002 * i, 0.002 * j, 0.05));
            if (i == NX - 1 || j == NY - 1) continue;
            int a = i + NX * j, tri[6] = {a, a + 1, a + 1 + NX, a, a + 1 + NX, a + NX};
            memcpy(t, tri, sizeof tri);
            t += 6;
        }
    }
}

#endif
