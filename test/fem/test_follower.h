// test_follower.h: a bar that a pressure bends, which follows its top.
#ifndef OMENTUM_TEST_FOLLOWER_H
#define OMENTUM_TEST_FOLLOWER_H

#include "test_solid.h"

// A bar of hexahedra, n long and n / 4 thick, clamped at an end, with 600 Pa on its top: the tip goes down
// by its length.
// Returns the iterations.
static inline int curl_bar(int n, OmPreconditioner solver, OmVec3* tip) {
    TestSolid t = {.material = {.young = 1e5, .poisson = 0.3, .law = OM_NEO_HOOKEAN}};
    solid_box(&t, OM_HEX8, om_vec3(0, 0, 0), om_vec3(0.1, 0.02, 0.02), n, n / 4, n / 4);
    solid_start(&t);
    solid_clamp(&t, 0, 0);
    solid_keep_faces(&t, 2, 0.02);
    OmFemPressure push = solid_pressure(&t, om_vec3(0, 0, 0), 600);
    t.load.pressure = &push;
    t.load.npressure = 1;
    OmFemStaticDef def = om_fem_static_default_def(t.solid);
    def.nstep = 8;
    def.solver.preconditioner = solver;
    assert_ok(om_fem_static_solve(t.solid, &t.load, &def, t.x, t.reaction, &t.report));
    const OmFemReport* r = &t.report;
    *tip = solid_displacement(&t, t.mesh.nnode - 1);
    printf("bar of %d cells: %d iterations in 8 steps, %d cut, tip (%.2f, %.2f) mm; the last step:",
           n, r->nnewton, r->ncut, 1e3 * tip->x, 1e3 * tip->z);
    for (int k = 0; k < r->nhistory; ++k) printf(" %.1e", r->history[k]);
    printf(" N\n");
    assert_int_equal(r->ncut, 0);
    assert_below(r->residual, 1e-9);
    // quadratic: the last iteration takes four digits or more
    assert_below(r->history[r->nhistory - 1], 1e-4 * r->history[r->nhistory - 2]);
    solid_done(&t);
    return r->nnewton;
}

#endif
