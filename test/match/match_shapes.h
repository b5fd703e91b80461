// match_shapes.h: surfaces with known Laplacians, for the tests of functional maps.
#ifndef OMENTUM_MATCH_SHAPES_H
#define OMENTUM_MATCH_SHAPES_H

#include "omentum/shape.h"
#include "test_common.h"

#define PI 3.14159265358979323846

/// The rectangle [0, width] x [0, height] in nx x ny cells; inner vertices are moved by up to `jitter` cells, and the
/// diagonals take turns in each direction at random.
static inline void shape_sheet(double width, double height, int nx, int ny, double jitter,
                               uint64_t seed, OmSurface* s) {
    OmRng rng = om_rng_init(seed, 0);
    assert_ok(om_surface_init(s, (nx + 1) * (ny + 1), 2 * nx * ny));
    for (int j = 0; j <= ny; ++j)
        for (int i = 0; i <= nx; ++i) {
            double u = i, v = j;
            if (i > 0 && i < nx) u += om_rng_range(&rng, -jitter, jitter);
            if (j > 0 && j < ny) v += om_rng_range(&rng, -jitter, jitter);
            om_store3(s->x, i + (nx + 1) * j, om_vec3(u * width / nx, v * height / ny, 0));
        }
    for (int j = 0, t = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) {
            int a = i + (nx + 1) * j, b = a + 1, c = b + nx + 1, d = a + nx + 1;
            bool turn = om_rng_uniform(&rng) < 0.5;
            const int v[6] = {a, b, turn ? c : d, turn ? a : b, c, d};
            for (int k = 0; k < 6; ++k) s->tri_vert[3 * t + k] = v[k];
            t += 2;
        }
}

/// An icosahedron on the unit sphere, each triangle cut into four `level` times.
static inline void shape_sphere(int level, OmSurface* s) {
    const double g = 1.618033988749895;
    const double x[12][3] = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                             {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                             {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    const int v[60] = {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                       4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                       6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
    assert_ok(om_surface_init(s, 12, 20));
    for (int i = 0; i < 12; ++i)
        om_store3(s->x, i, om_normalize(om_vec3(x[i][0], x[i][1], x[i][2])));
    memcpy(s->tri_vert, v, sizeof v);
    for (int l = 0; l < level; ++l) {
        OmSurface fine;
        assert_ok(om_surface_init(&fine, s->nvert + s->ntri * 3 / 2, 4 * s->ntri));
        memcpy(fine.x, s->x, 24 * (size_t)s->nvert);
        int* mid = om_alloc(3 * (size_t)s->ntri, sizeof(int));
        int num = s->nvert;
        for (int h = 0; h < 3 * s->ntri; ++h) {
            int i = s->tri_vert[h], j = s->tri_vert[h % 3 == 2 ? h - 2 : h + 1];
            mid[h] = -1;
            for (int o = 0; o < h && mid[h] < 0; ++o)
                if (s->tri_vert[o] == j && s->tri_vert[o % 3 == 2 ? o - 2 : o + 1] == i)
                    mid[h] = mid[o];
            if (mid[h] >= 0) continue;
            om_store3(fine.x, num, om_normalize(om_add(om_load3(s->x, i), om_load3(s->x, j))));
            mid[h] = num++;
        }
        for (int t = 0; t < s->ntri; ++t) {
            const int *p = s->tri_vert + 3 * t, *m = mid + 3 * t;
            const int w[12] = {p[0], m[0], m[2], m[0], p[1], m[1],
                               m[2], m[1], p[2], m[0], m[1], m[2]};
            memcpy(fine.tri_vert + 12 * t, w, sizeof w);
        }
        om_free(mid);
        om_surface_done(s);
        *s = fine;
    }
}

#endif
