// rl_retract_ground.c: the kidney and the table of the task "retract", and the distance to both.
//
// The kidney is a bent ellipsoid: p = (x, y, z) is on it where (x' / a)^2 + (y / b)^2 + (z / c)^2 = 1 with
// x' = x - bend y^2; both poles bend away from the endoscope. Its distance field is sampled once. Contact reads value
// and normal of a point with eight loads of four floats; om_sdf_eval differentiates its interpolation, and the slope
// jumps between cells. The field of a kidney from a file is that of its surface (rl_retract_kidney.c).
#include <math.h>
#include <string.h>

#include "rl/rl_retract_internal.h"

#define SPACING 0.002  // m, of the distance field
#define MARGIN 0.014   // m, that the field reaches beyond the kidney

typedef float F4 __attribute__((vector_size(16)));

static double kidney_level(void* ctx, OmVec3 p) {
    const OmRlKidney* k = ctx;
    OmVec3 q = om_sub(p, k->center);
    double x = (q.x - k->bend * q.y * q.y) / k->half.x, y = q.y / k->half.y, z = q.z / k->half.z;
    return sqrt(x * x + y * y + z * z) - 1;
}

// Value and unit normal at each node.
static void make_table(OmRlGround* g) {
    const OmGrid* grid = &g->sdf.grid;
    size_t n = 0;
    for (int k = 0; k < grid->dim[2]; ++k)
        for (int j = 0; j < grid->dim[1]; ++j)
            for (int i = 0; i < grid->dim[0]; ++i, ++n) {
                OmVec3 slope, p = om_grid_point(grid, i, j, k);
                // a little off the node: at a node the derivative jumps
                double e = 0.25 * grid->spacing, s[3];
                for (int a = 0; a < 3; ++a) {
                    OmVec3 d = om_vec3(a == 0 ? e : 0, a == 1 ? e : 0, a == 2 ? e : 0);
                    s[a] = om_sdf_eval(&g->sdf, om_add(p, d), NULL) -
                           om_sdf_eval(&g->sdf, om_sub(p, d), NULL);
                }
                slope = om_normalize(om_vec3(s[0], s[1], s[2]));
                float* at = g->table + 4 * n;
                at[0] = g->sdf.d[n];
                at[1] = (float)slope.x, at[2] = (float)slope.y, at[3] = (float)slope.z;
            }
}

static OmStatus finish(OmRlGround* ground) {
    om_sdf_bounds(&ground->sdf, &ground->lo, &ground->hi);
    ground->table = om_alloc(om_grid_count(ground->sdf.grid.dim), 4 * sizeof *ground->table);
    if (!ground->table) return OM_NO_MEMORY;
    make_table(ground);
    return OM_OK;
}

OmStatus om__rl_ground_init(const OmRlKidney* kidney, OmRlGround* ground) {
    *ground = (OmRlGround){.kidney = *kidney};
    double bent = fabs(kidney->bend) * kidney->half.y * kidney->half.y;
    OmVec3 reach = om_vec3(kidney->half.x + bent, kidney->half.y, kidney->half.z);
    OmSdfDef def = om_sdf_default_def(SPACING);
    def.margin = MARGIN;
    OM_TRY(om_sdf_from_function(kidney_level, &ground->kidney, om_sub(kidney->center, reach),
                                om_add(kidney->center, reach), &def, &ground->sdf));
    return finish(ground);
}

OmStatus om__rl_ground_init_surface(const OmSurface* surface, const OmRlKidney* box,
                                    OmRlGround* ground) {
    *ground = (OmRlGround){.kidney = *box, .is_loaded = true};
    OmSdfDef def = om_sdf_default_def(SPACING);
    def.margin = MARGIN;
    OM_TRY(om_sdf_from_surface(surface, &def, &ground->sdf));
    return finish(ground);
}

void om__rl_ground_done(OmRlGround* ground) {
    om_sdf_done(&ground->sdf);
    om_free(ground->table);
    *ground = (OmRlGround){0};
}

static inline F4 load_node(const float* table, size_t n) {
    F4 v;
    memcpy(&v, table + 4 * n, sizeof v);
    return v;
}

// Trilinear value and normal inside the grid.
static double eval_kidney(const OmRlGround* g, OmVec3 p, OmVec3* normal) {
    const OmGrid* grid = &g->sdf.grid;
    double inverse = 1 / grid->spacing;
    double u[3] = {(p.x - grid->origin.x) * inverse, (p.y - grid->origin.y) * inverse,
                   (p.z - grid->origin.z) * inverse};
    int c[3];
    F4 f[3];
    for (int a = 0; a < 3; ++a) {
        c[a] = (int)u[a];
        if (c[a] > grid->dim[a] - 2) c[a] = grid->dim[a] - 2;
        float t = (float)(u[a] - c[a]);
        f[a] = (F4){t, t, t, t};
    }
    size_t dy = (size_t)grid->dim[0], dz = dy * (size_t)grid->dim[1];
    const float* at = g->table + 4 * om_grid_index(grid->dim, c[0], c[1], c[2]);
    F4 row[4];
    for (int r = 0; r < 4; ++r) {
        size_t n = (size_t)(r & 1) * dy + (size_t)(r >> 1) * dz;
        F4 a = load_node(at, n);
        row[r] = a + f[0] * (load_node(at, n + 1) - a);
    }
    F4 below = row[0] + f[1] * (row[1] - row[0]), above = row[2] + f[1] * (row[3] - row[2]);
    F4 v = below + f[2] * (above - below);
    OmVec3 n = om_vec3((double)v[1], (double)v[2], (double)v[3]);
    double length2 = om_norm2(n);
    // opposite normals at the middle of the kidney may cancel
    *normal = length2 > 1e-12 ? om_scale(1 / sqrt(length2), n) : om_vec3(0, 0, 1);
    return (double)v[0];
}

double om__rl_ground_distance(const void* ctx, OmVec3 p, OmVec3* normal) {
    const OmRlGround* g = ctx;
    double d = INFINITY;
    if (p.x >= g->lo.x && p.x <= g->hi.x && p.y >= g->lo.y && p.y <= g->hi.y && p.z >= g->lo.z &&
        p.z <= g->hi.z)
        d = eval_kidney(g, p, normal);
    if (p.z < d) {
        d = p.z;
        *normal = om_vec3(0, 0, 1);
    }
    return d + g->shift;
}

OmVec3 om__rl_ground_top(const OmRlGround* ground, double x, double y, OmVec3* normal) {
    double lo = ground->kidney.center.z, hi = ground->hi.z;
    OmVec3 n;
    if (ground->is_loaded) {  // its highest layer at (x, y); the table where there is none
        for (lo = hi; lo > 0; lo -= 0.5 * SPACING)
            if (om__rl_ground_distance(ground, om_vec3(x, y, lo), &n) < ground->shift) break;
        hi = fmin(hi, lo + 0.5 * SPACING);
    }
    for (int k = 0; k < 40; ++k) {
        double z = 0.5 * (lo + hi);
        double d = om__rl_ground_distance(ground, om_vec3(x, y, z), &n) - ground->shift;
        if (d < 0)
            lo = z;
        else
            hi = z;
    }
    OmVec3 p = om_vec3(x, y, 0.5 * (lo + hi));
    om__rl_ground_distance(ground, p, normal);
    return p;
}
