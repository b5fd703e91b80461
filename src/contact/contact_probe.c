// contact_probe.c: rigid shapes and their exact distances.
//
// A box with rounded edges is the set of points within `rounding` of a smaller box. Outside of the smaller box its
// normal is continuous, so a point that slides over an edge does not jump between faces.
#include <string.h>

#include "contact/contact_press_internal.h"
#include "omentum/shape_meshing.h"

#define PROBE_COOKIE 0x9f0be5u
#define NRING 48  // segments of a drawn circle

OmProbeDef om_probe_default_def(OmProbeShape shape) {
    OmProbeDef def = {.shape = shape,
                      .size = {0.05, 0.01, 0.06},
                      .rounding = 0.001,
                      .radius = shape == OM_PROBE_CAPSULE ? 0.005 : 0.025,
                      .length = 0.05,
                      .cookie = PROBE_COOKIE};
    return def;
}

static OmStatus check_def(const OmProbeDef* def) {
    OM_CHECK(def, OM_INVALID, "probe: the definition is null");
    OM_CHECK(def->cookie == PROBE_COOKIE, OM_INVALID,
             "probe: the definition was not made by om_probe_default_def");
    OM_CHECK(def->shape >= OM_PROBE_BOX && def->shape <= OM_PROBE_MESH, OM_INVALID,
             "probe: shape %d is none of OmProbeShape", (int)def->shape);
    if (def->shape == OM_PROBE_BOX) {
        const double side[3] = {def->size.x, def->size.y, def->size.z};
        for (int a = 0; a < 3; ++a) {
            OM_CHECK(side[a] >= 1e-6 && side[a] <= 10, OM_INVALID,
                     "probe: side %d of the box is %g m; it must be from 1e-6 to 10", a, side[a]);
            OM_CHECK(def->rounding >= 0 && def->rounding <= 0.5 * side[a], OM_INVALID,
                     "probe: rounding is %g m; it must be from 0 to half the side %g m",
                     def->rounding, side[a]);
        }
    } else if (def->shape != OM_PROBE_MESH) {
        OM_CHECK(def->radius >= 1e-6 && def->radius <= 10, OM_INVALID,
                 "probe: radius is %g m; it must be from 1e-6 to 10", def->radius);
        OM_CHECK(def->shape == OM_PROBE_SPHERE || (def->length >= 0 && def->length <= 10),
                 OM_INVALID, "probe: length is %g m; it must be from 0 to 10", def->length);
    } else {
        OM_CHECK(def->surface, OM_INVALID, "probe: the surface of a mesh is null");
    }
    return OM_OK;
}

static void find_bounds(OmProbe* p) {
    const OmProbeDef* def = &p->def;
    double r = def->radius;
    p->lo = om_vec3(-r, -r, -r);
    p->hi = om_vec3(r, r, r);
    p->thickness = r;
    if (def->shape == OM_PROBE_CAPSULE) p->hi.z += def->length;
    if (def->shape == OM_PROBE_BOX) {
        OmVec3 s = def->size;
        p->lo = om_vec3(-0.5 * s.x, -0.5 * s.y, 0);
        p->hi = om_vec3(0.5 * s.x, 0.5 * s.y, s.z);
        p->thickness = 0.5 * fmin(s.x, fmin(s.y, s.z));
    }
    if (def->shape == OM_PROBE_MESH) {
        const OmSurface* s = om__probe_mesh_surface(p->mesh);
        p->lo = p->hi = om_load3(s->x, 0);
        for (int i = 1; i < s->nvert; ++i) {
            p->lo = om_min3(p->lo, om_load3(s->x, i));
            p->hi = om_max3(p->hi, om_load3(s->x, i));
        }
        OmVec3 d = om_sub(p->hi, p->lo);
        p->thickness = 0.125 * fmin(d.x, fmin(d.y, d.z));
    }
}

OmStatus om_probe_create(const OmProbeDef* def, OmProbe** probe) {
    *probe = NULL;
    OM_TRY(check_def(def));
    OmStatus status = OM_OK;
    OmProbe* p = om_calloc(1, sizeof *p);
    if (!p) return OM_NO_MEMORY;
    p->def = *def;
    p->def.surface = NULL;
    if (def->shape == OM_PROBE_MESH) OM_TRY_DONE(om__probe_mesh_create(def->surface, &p->mesh));
    find_bounds(p);
    *probe = p;
    return OM_OK;
done:
    om_probe_destroy(p);
    return status;
}

void om_probe_destroy(OmProbe* p) {
    if (!p) return;
    om__probe_mesh_destroy(p->mesh);
    om_free(p);
}

void om_probe_get_bounds(const OmProbe* p, OmVec3* lo, OmVec3* hi) {
    *lo = p->lo;
    *hi = p->hi;
}

// ---- distances ------------------------------------------------------------------------------------

static double box_distance(const OmProbeDef* def, OmVec3 p, OmVec3* n) {
    double r = def->rounding;
    p.z -= 0.5 * def->size.z;
    OmVec3 q = om_vec3(fabs(p.x) - 0.5 * def->size.x + r, fabs(p.y) - 0.5 * def->size.y + r,
                       fabs(p.z) - 0.5 * def->size.z + r);
    OmVec3 out = om_max3(q, om_vec3(0, 0, 0));
    double d = om_norm(out);
    if (d > 0) {
        out = om_scale(1 / d, out);
    } else {  // the nearest face
        d = fmax(q.x, fmax(q.y, q.z));
        out = d == q.z ? om_vec3(0, 0, 1) : d == q.y ? om_vec3(0, 1, 0) : om_vec3(1, 0, 0);
    }
    *n = om_vec3(copysign(out.x, p.x), copysign(out.y, p.y), copysign(out.z, p.z));
    return d - r;
}

static double capsule_distance(double radius, double length, OmVec3 p, OmVec3* n) {
    p.z -= fmin(length, fmax(0, p.z));
    double d = om_norm(p);
    *n = d > 0 ? om_scale(1 / d, p) : length > 0 ? om_vec3(1, 0, 0) : om_vec3(0, 0, -1);
    return d - radius;
}

double om_probe_eval_distance(const OmProbe* probe, OmVec3 p, OmVec3* normal) {
    OmVec3 unused, *n = normal ? normal : &unused;
    switch (probe->def.shape) {
    case OM_PROBE_BOX: return box_distance(&probe->def, p, n);
    case OM_PROBE_SPHERE: return capsule_distance(probe->def.radius, 0, p, n);
    case OM_PROBE_CAPSULE: return capsule_distance(probe->def.radius, probe->def.length, p, n);
    case OM_PROBE_MESH: break;
    }
    return om__probe_mesh_distance(probe->mesh, p, n);
}

static double probe_distance(const void* ctx, OmVec3 p, OmVec3* n) {
    return om_probe_eval_distance(ctx, p, n);
}

OmTissueObstacle om_probe_obstacle(const OmProbe* probe, OmPose begin, OmPose end,
                                   double friction) {
    return (OmTissueObstacle){.distance = probe_distance,
                              .ctx = probe,
                              .thickness = probe->thickness,
                              .has_bounds = true,
                              .lo = probe->lo,
                              .hi = probe->hi,
                              .pose_begin = begin,
                              .pose_end = end,
                              .friction = friction};
}

// ---- pictures -------------------------------------------------------------------------------------

static OmStatus draw_box(OmVec3 lo, OmVec3 hi, OmSurface* surface) {
    static const int tri[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                   {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                   {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    OM_TRY(om_surface_init(surface, 8, 12));
    for (int i = 0; i < 8; ++i)
        om_store3(surface->x, i,
                  om_vec3(i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z));
    memcpy(surface->tri_vert, tri, sizeof tri);
    return OM_OK;
}

// Rings from pole to pole; the upper half of them shifted by length.
static OmStatus draw_capsule(double radius, double length, OmSurface* surface) {
    const int half = NRING / 4, nring = 2 * half;
    OM_TRY(om_surface_init(surface, nring * NRING + 2, 2 * nring * NRING));
    om_store3(surface->x, 0, om_vec3(0, 0, -radius));
    om_store3(surface->x, nring * NRING + 1, om_vec3(0, 0, length + radius));
    for (int r = 0; r < nring; ++r) {
        double shift = r < half ? 0 : length;
        double step = r < half ? r + 1 - half : r - half;  // the equator is drawn twice
        double lat = step * 0.5 * OM_PI / half;
        for (int k = 0; k < NRING; ++k) {
            double lon = 2 * OM_PI * k / NRING;
            om_store3(surface->x, 1 + r * NRING + k,
                      om_vec3(radius * cos(lat) * cos(lon), radius * cos(lat) * sin(lon),
                              shift + radius * sin(lat)));
        }
    }
    int* t = surface->tri_vert;
    for (int k = 0; k < NRING; ++k) {
        int next = (k + 1) % NRING, last = 1 + (nring - 1) * NRING;
        int south[3] = {0, 1 + next, 1 + k}, north[3] = {nring * NRING + 1, last + k, last + next};
        memcpy(t, south, sizeof south);
        memcpy(t + 3, north, sizeof north);
        t += 6;
        for (int r = 0; r + 1 < nring; ++r, t += 6) {
            int a = 1 + r * NRING + k, b = 1 + r * NRING + next, c = a + NRING, d = b + NRING;
            int quad[6] = {a, b, d, a, d, c};
            memcpy(t, quad, sizeof quad);
        }
    }
    return OM_OK;
}

OmStatus om_probe_get_surface(const OmProbe* p, OmSurface* surface) {
    *surface = (OmSurface){0};
    if (p->def.shape == OM_PROBE_BOX) return draw_box(p->lo, p->hi, surface);
    if (p->def.shape != OM_PROBE_MESH)
        return draw_capsule(p->def.radius,
                            p->def.shape == OM_PROBE_CAPSULE ? p->def.length : 1e-9 * p->def.radius,
                            surface);
    const OmSurface* own = om__probe_mesh_surface(p->mesh);
    OM_TRY(om_surface_init(surface, own->nvert, own->ntri));
    memcpy(surface->x, own->x, 3 * (size_t)own->nvert * sizeof(double));
    memcpy(surface->tri_vert, own->tri_vert, 3 * (size_t)own->ntri * sizeof(int));
    return OM_OK;
}
