// pbd_sample.c: particles on a cubic lattice inside solids, or in a single layer.
#include "pbd/pbd_internal.h"

#define MAX_PARTICLE 1e7

static OmStatus check_spacing(double spacing, OmVec3 size) {
    OM_CHECK(spacing >= 1e-6 && spacing <= 10, OM_INVALID,
             "pbd: particle spacing is %g m; it must be from 1e-6 to 10", spacing);
    double count = 1;
    const double length[3] = {size.x, size.y, size.z};
    for (int a = 0; a < 3; ++a) count *= fmax(1, round(length[a] / spacing));
    OM_CHECK(count <= MAX_PARTICLE, OM_INVALID,
             "pbd: a particle spacing of %g mm makes %.3g particles; the most is %g", 1e3 * spacing,
             count, MAX_PARTICLE);
    return OM_OK;
}

static OmGrid center_lattice(OmVec3 lo, OmVec3 hi, double spacing) {
    OmGrid a = {.spacing = spacing};
    OmVec3 size = om_sub(hi, lo);
    a.dim[0] = (int)fmax(1, round(size.x / spacing));
    a.dim[1] = (int)fmax(1, round(size.y / spacing));
    a.dim[2] = (int)fmax(1, round(size.z / spacing));
    OmVec3 half = {0.5 * spacing * (a.dim[0] - 1), 0.5 * spacing * (a.dim[1] - 1),
                   0.5 * spacing * (a.dim[2] - 1)};
    a.origin = om_sub(om_scale(0.5, om_add(lo, hi)), half);
    return a;
}

// Points of the lattice inside the field; `x` null: count only.
static int fill(const OmGrid* a, const OmSdf* sdf, double* x) {
    int count = 0;
    for (int k = 0; k < a->dim[2]; ++k)
        for (int j = 0; j < a->dim[1]; ++j)
            for (int i = 0; i < a->dim[0]; ++i) {
                OmVec3 p = om_grid_point(a, i, j, k);
                if (sdf && !(om_sdf_eval(sdf, p, NULL) < 0)) continue;
                if (x) om_store3(x, count, p);
                ++count;
            }
    return count;
}

static OmStatus sample(OmVec3 lo, OmVec3 hi, double spacing, const OmSdf* sdf,
                       OmTetMesh* particles) {
    OM_TRY(check_spacing(spacing, om_sub(hi, lo)));
    OmGrid a = center_lattice(lo, hi, spacing);
    int count = fill(&a, sdf, NULL);
    OM_CHECK(count > 0, OM_INVALID,
             "pbd: no particle of a lattice of %g mm lies inside the solid; reduce the spacing",
             1e3 * spacing);
    OM_TRY(om_tet_mesh_init(particles, count, 0));
    fill(&a, sdf, particles->x);
    return OM_OK;
}

// The bounding box of the inside nodes, and the volume: cells cut by the surface count by their inside fraction.
static OmStatus measure(const OmSdf* sdf, OmVec3* lo, OmVec3* hi, double* volume) {
    *lo = om_vec3(INFINITY, INFINITY, INFINITY);
    *hi = om_scale(-1, *lo);
    double count = 0, d = sdf->grid.spacing;
    for (int k = 0; k < sdf->grid.dim[2]; ++k)
        for (int j = 0; j < sdf->grid.dim[1]; ++j)
            for (int i = 0; i < sdf->grid.dim[0]; ++i) {
                size_t n = om_grid_index(sdf->grid.dim, i, j, k);
                double depth = -(double)sdf->d[n];
                count += fmin(1, fmax(0, 0.5 + depth / d));
                if (!(depth > 0)) continue;
                OmVec3 p = om_grid_point(&sdf->grid, i, j, k);
                double out = fmin(depth, d);  // distance to the surface beyond this point
                *lo = om_min3(*lo, om_sub(p, om_vec3(out, out, out)));
                *hi = om_max3(*hi, om_add(p, om_vec3(out, out, out)));
            }
    OM_CHECK(lo->x <= hi->x, OM_INVALID, "pbd: nothing is inside the distance field");
    *volume = count * d * d * d;
    return OM_OK;
}

OmStatus om_pbd_sample_sdf(const OmSdf* sdf, double spacing, OmTetMesh* particles,
                           double* particle_volume) {
    *particles = (OmTetMesh){0};
    *particle_volume = 0;
    OM_CHECK(sdf && sdf->d, OM_INVALID, "pbd: the distance field is null or empty");
    OmVec3 lo, hi;
    double volume = 0;
    OM_TRY(measure(sdf, &lo, &hi, &volume));
    OM_TRY(sample(lo, hi, spacing, sdf, particles));
    *particle_volume = volume / particles->nvert;
    return OM_OK;
}

OmStatus om_pbd_sample_surface(const OmSurface* surface, double spacing, OmTetMesh* particles,
                               double* particle_volume) {
    *particles = (OmTetMesh){0};
    *particle_volume = 0;
    OM_CHECK(surface && surface->nvert > 0, OM_INVALID, "pbd: the surface is null or empty");
    OmVec3 lo = om_load3(surface->x, 0), hi = lo;
    for (int i = 1; i < surface->nvert; ++i) {
        lo = om_min3(lo, om_load3(surface->x, i));
        hi = om_max3(hi, om_load3(surface->x, i));
    }
    OM_TRY(check_spacing(spacing, om_sub(hi, lo)));
    OmSdf sdf = {0};
    OmSdfDef def = om_sdf_default_def(0.5 * spacing);
    def.margin = spacing;
    OM_TRY(om_sdf_from_surface(surface, &def, &sdf));
    OmStatus status = sample(lo, hi, spacing, &sdf, particles);
    om_sdf_done(&sdf);
    OM_TRY(status);
    *particle_volume = om_surface_volume(surface) / particles->nvert;
    return OM_OK;
}

OmStatus om_pbd_sample_sheet(double size_x, double size_y, double thickness, double spacing,
                             OmTetMesh* particles, double* particle_volume) {
    *particles = (OmTetMesh){0};
    *particle_volume = 0;
    const double length[3] = {size_x, size_y, thickness};
    for (int a = 0; a < 3; ++a)
        OM_CHECK(length[a] > 0 && length[a] <= 10, OM_INVALID,
                 "pbd: side %d of the sheet is %g m; it must be above 0 and at most 10", a,
                 length[a]);
    OmVec3 hi = {0.5 * size_x, 0.5 * size_y, 0};
    OM_TRY(sample(om_scale(-1, hi), hi, spacing, NULL, particles));
    *particle_volume = size_x * size_y * thickness / particles->nvert;
    return OM_OK;
}
