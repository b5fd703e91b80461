// sense_shapes.h: a camera and the shapes it looks at, for the tests of pictures and of depth.
#ifndef OMENTUM_SENSE_SHAPES_H
#define OMENTUM_SENSE_SHAPES_H

#include "omentum/sense.h"
#include "test_common.h"

static const OmSenseLook grey = {.red = 0.5, .green = 0.5, .blue = 0.5};

static inline OmCamera look_down(int width, int height) {
    OmPose pose = om_pose_look_at(om_vec3(0, 0, 0.2), om_vec3(0, 0, 0), om_vec3(0, 1, 0));
    OmCamera c = {pose, width, height, 60 * OM_PI / 180, 0.01, 1.0};
    return c;
}

// A flat square of side 2 r at height z, facing up.
static inline OmSurface make_square(double x0, double x1, double r, double z) {
    OmSurface s;
    assert_ok(om_surface_init(&s, 4, 2));
    const double p[12] = {x0, -r, z, x1, -r, z, x1, r, z, x0, r, z};
    const int t[6] = {0, 1, 2, 0, 2, 3};
    memcpy(s.x, p, sizeof p);
    memcpy(s.tri_vert, t, sizeof t);
    return s;
}

static inline OmSurface make_sphere(OmVec3 c, double r, int n) {
    OmSurface s;
    assert_ok(om_surface_init(&s, n * 2 * n, 2 * (n - 1) * 2 * n));
    int t = 0;
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < 2 * n; ++j) {
            double a = OM_PI * i / (n - 1), b = OM_PI * j / n;
            OmVec3 p = om_vec3(sin(a) * cos(b), sin(a) * sin(b), cos(a));
            om_store3(s.x, i * 2 * n + j, om_madd(c, r, p));
            if (i + 1 == n) continue;
            int k = (j + 1) % (2 * n),
                v[4] = {i * 2 * n + j, i * 2 * n + k, (i + 1) * 2 * n + k, (i + 1) * 2 * n + j};
            memcpy(&s.tri_vert[3 * t++], (int[3]){v[0], v[2], v[1]}, 3 * sizeof(int));
            memcpy(&s.tri_vert[3 * t++], (int[3]){v[0], v[3], v[2]}, 3 * sizeof(int));
        }
    }
    return s;
}

#endif
