// test_random.h: random matrices and rotations.
#ifndef OMENTUM_TEST_RANDOM_H
#define OMENTUM_TEST_RANDOM_H

#include "test_common.h"

static inline OmMat3 random_mat3(OmRng* rng, double size) {
    double e[9];
    for (int k = 0; k < 9; ++k) e[k] = size * om_rng_normal(rng);
    return om_mat3_cols(om_load3(e, 0), om_load3(e, 1), om_load3(e, 2));
}

static inline OmMat3 random_rotation(OmRng* rng) {
    OmVec3 axis = om_vec3(om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng));
    return om_quat_to_mat3(om_quat_axis_angle(axis, om_rng_range(rng, 0.1, 3.1)));
}

#endif
