// test_sheet.h: a sheet of 120 x 120 x 8 mm on a board, one half held; a patch of the other half is lifted, or its
// corner is folded over the held half.
#ifndef OMENTUM_TEST_SHEET_H
#define OMENTUM_TEST_SHEET_H

#include "test_element.h"

#define SIDE 0.12
#define THICK 0.008
#define STEP 0.02  // s

// Distance and direction of the fold, the diagonal through the sheet's middle; u > 0 is the corner that moves.
#define FOLD_U(p) ((SIDE - (p).x - (p).y) * sqrt(0.5))
static const OmVec3 fold_along = {-0.70710678118654752, 0.70710678118654752, 0};

static const OmContactPlane board = {{0, 0, 0}, {0, 0, 1}};

// The held half as an obstacle for the other: the corner of space u <= 0, z <= THICK.
static inline double held_half(const void* ctx, OmVec3 p, OmVec3* normal) {
    (void)ctx;
    double u = FOLD_U(p), z = p.z - THICK;
    OmVec3 out = om_vec3(-sqrt(0.5), -sqrt(0.5), 0), up = om_vec3(0, 0, 1);
    if (u > 0 && z > 0) {
        double d = hypot(u, z);
        *normal = om_scale(1 / d, om_add(om_scale(u, out), om_scale(z, up)));
        return d;
    }
    *normal = u > z ? out : up;
    return fmax(u, z);
}

// A sheet of n x n cells on the board; the caller attaches it.
static inline void sheet_start(TestRig* r, const ElementKind* kind, int n, int layers, OmLaw law,
                               bool is_folded) {
    rig_box(r, om_vec3(0, 0, 0), om_vec3(SIDE, SIDE, THICK), n, n, layers);
    r->def.material_default =
        (OmMaterial){.young = is_folded ? 10000 : 20000, .poisson = 0.43, .law = law};
    r->def.rayleigh_mass = 4;
    r->def.solver.tolerance = 1e-3;
    element_choose(r, kind);
    // without friction a fold unrolls on a level board: 45 degrees down, towards the held half
    double tilt = is_folded ? OM_PI / 4 : 0, along = 9.81 * sin(tilt) * sqrt(0.5);
    r->def.gravity = om_vec3(along, along, -9.81 * cos(tilt));
    rig_start(r);
    OmTissueObstacle obstacle[2] = {om_plane_obstacle(&board), om_field_obstacle(held_half, NULL)};
    OmContactDef def = rig_on(obstacle);
    def.nobstacle = is_folded ? 2 : 1;
    rig_contact(r, &def);
}

#define FLAP (SIDE * 0.70710678118654752)  // m, of the corner from the fold

static inline OmPose fold_pose(double angle) {
    OmQuat turn = om_quat_axis_angle(fold_along, angle);
    OmVec3 hinge = om_vec3(SIDE / 2, SIDE / 2, THICK);
    OmVec3 arm = om_sub(om_vec3(0, 0, THICK / 2), hinge);
    return (OmPose){om_add(hinge, om_quat_rotate(turn, arm)), turn};
}

#endif
