// test_banet.h: a sample of a sheet without a solve.
#ifndef OMENTUM_TEST_BANET_H
#define OMENTUM_TEST_BANET_H

#include <string.h>

#include "omentum/banet_data.h"
#include "test_common.h"

#define TEST_SIDE 0.3
#define TEST_VOXEL (TEST_SIDE / 64)

/// A sheet of 100 x 40 x 9 mm in a random pose, wider at one end. Vertices beyond half of its length and one
/// in seven are attached, a quarter is not seen, the displacement is smooth.
static inline OmBanetSample make_sample(uint64_t seed) {
    OmRng rng = om_rng_init(seed, 0);
    OmBanetSample s = {.index = (int64_t)seed, .nregion = 1, .share = 0.5, .visible = 0.75};
    OmVec3 axis = om_vec3(om_rng_normal(&rng), om_rng_normal(&rng), om_rng_normal(&rng));
    OmPose pose = {om_vec3(0.1, -0.2, 0.3),
                   om_quat_axis_angle(om_normalize(axis), om_rng_range(&rng, 0, 6))};
    assert_ok(om_tet_mesh_box(om_vec3(-0.05, -0.02, -0.0045), om_vec3(0.05, 0.02, 0.0045), 21, 9, 2,
                              &s.mesh));
    double* flat = om_alloc(3 * (size_t)s.mesh.nvert, sizeof *flat);
    memcpy(flat, s.mesh.x, 3 * (size_t)s.mesh.nvert * sizeof *flat);
    for (int i = 0; i < s.mesh.nvert; ++i) {
        OmVec3 x = om_load3(flat, i);
        x.y *= 1 + 4 * x.x, x.x *= 1 + 4 * x.y;
        om_store3(s.mesh.x, i, om_pose_apply(pose, x));
    }
    assert_ok(om_tet_mesh_boundary(&s.mesh, &s.surface, &s.surface_vert));
    const size_t n = (size_t)s.surface.nvert;
    s.attached = om_calloc(n, 1);
    s.grasped = om_calloc(n, 1);
    s.u = om_calloc(3 * n, sizeof *s.u);
    s.seen = om_calloc(n, sizeof *s.seen);
    for (int i = 0; i < s.surface.nvert; ++i) {
        OmVec3 x = om_load3(flat, s.surface_vert[i]);
        s.attached[i] = x.x > 0 || i % 7 == 0;
        s.seen[i] = x.y < 0.01;
        OmVec3 u = om_vec3(0.02 * x.x, -0.01 + 0.1 * x.y, 0.03 * cos(30 * x.x) + x.z);
        if (s.seen[i] > 0) om_store3(s.u, i, om_quat_rotate(pose.q, u));
    }
    om_free(flat);
    return s;
}

#endif
