// contact_model.c: obstacles checked and copied; their distances.
#include <string.h>

#include "contact/contact_internal.h"

#define CONTACT_COOKIE 0xc047ac7u
#define RING 1e-3  // of the model's size, the ring over which normals are averaged

OmContactDef om_contact_default_def(void) {
    OmContactDef def = {.stiffness = 1000,
                        .recover_speed = 0.1,
                        .friction = -1,
                        .max_iterations = 12,
                        .cookie = CONTACT_COOKIE};
    return def;
}

static OmStatus check_obstacles(const OmContactDef* def) {
    OM_CHECK(def->nplane >= 0 && (def->nplane == 0 || def->plane), OM_INVALID,
             "contact: nplane is %d, and plane is null or the count negative", def->nplane);
    OM_CHECK(def->nsdf >= 0 && (def->nsdf == 0 || def->sdf), OM_INVALID,
             "contact: nsdf is %d, and sdf is null or the count negative", def->nsdf);
    OM_CHECK(def->nfield >= 0 && (def->nfield == 0 || def->field), OM_INVALID,
             "contact: nfield is %d, and field is null or the count negative", def->nfield);
    for (int k = 0; k < def->nplane; ++k) {
        const OmContactPlane* p = &def->plane[k];
        double length = om_norm(p->normal);
        OM_CHECK(om_is_finite3(p->point), OM_INVALID, "contact: plane[%d].point is not finite", k);
        OM_CHECK(length > 1e-100 && length < 1e100, OM_INVALID,
                 "contact: plane[%d].normal (%g, %g, %g) has no direction", k, p->normal.x,
                 p->normal.y, p->normal.z);
    }
    for (int k = 0; k < def->nsdf; ++k)
        OM_CHECK(def->sdf[k] && def->sdf[k]->d, OM_INVALID, "contact: sdf[%d] is null or empty", k);
    for (int k = 0; k < def->nfield; ++k)
        OM_CHECK(def->field[k].distance, OM_INVALID, "contact: field[%d].distance is null", k);
    return OM_OK;
}

static OmStatus check_def(const OmContactDef* def) {
    OM_CHECK(def->cookie == CONTACT_COOKIE, OM_INVALID,
             "contact: the definition was not made by om_contact_default_def");
    OM_TRY(check_obstacles(def));
    OM_CHECK(def->offset >= 0 && def->offset <= 1, OM_INVALID,
             "contact: offset is %g m; it must be from 0 to 1", def->offset);
    OM_CHECK(def->stiffness >= 1 && def->stiffness <= 1e6, OM_INVALID,
             "contact: stiffness is %g; it must be from 1 to 1e6", def->stiffness);
    OM_CHECK(def->recover_speed > 0 && def->recover_speed <= 100, OM_INVALID,
             "contact: recover_speed is %g m/s; it must be above 0 and at most 100",
             def->recover_speed);
    OM_CHECK(def->friction <= 10, OM_INVALID,
             "contact: friction is %g; it must be at most 10, negative for the engine's own",
             def->friction);
    OM_CHECK(def->max_iterations >= 1 && def->max_iterations <= 1000, OM_INVALID,
             "contact: max_iterations is %d; it must be from 1 to 1000", def->max_iterations);
    return OM_OK;
}

OmStatus om_contact_create(const OmContactDef* def, const OmTissueModel* model,
                           OmContact** contact) {
    *contact = NULL;
    OM_CHECK(def && model, OM_INVALID, "contact: the definition or the model is null");
    OM_TRY(check_def(def));
    OmStatus status = OM_OK;
    OmContact* c = om_calloc(1, sizeof *c);
    if (!c) return OM_NO_MEMORY;
    c->def = *def;
    c->has_own_friction = def->friction < 0;
    if (c->has_own_friction) c->def.friction = 0;  // of engines that leave contact to this room
    c->nobstacle = def->nplane + def->nsdf + def->nfield;
    const int* surface = om_tissue_surface_vert(model, &c->nsurface);
    OM_ALLOC_DONE(c->plane, def->nplane);
    c->sdf = om_alloc((size_t)def->nsdf, sizeof *c->sdf);
    c->field = om_alloc((size_t)def->nfield, sizeof *c->field);
    c->surface_vert = om_alloc((size_t)c->nsurface, sizeof *c->surface_vert);
    c->pair = om_alloc((size_t)c->nsurface * (size_t)c->nobstacle, sizeof *c->pair);
    if (!c->sdf || !c->field || !c->surface_vert || !c->pair) {
        status = OM_NO_MEMORY;
        goto done;
    }
    for (int k = 0; k < def->nplane; ++k) {
        c->plane[k] = def->plane[k];
        c->plane[k].normal = om_scale(1 / om_norm(c->plane[k].normal), c->plane[k].normal);
    }
    for (int k = 0; k < def->nsdf; ++k) c->sdf[k] = def->sdf[k];
    for (int k = 0; k < def->nfield; ++k) c->field[k] = def->field[k];
    memcpy(c->surface_vert, surface, (size_t)c->nsurface * sizeof *surface);
    const OmTetMesh* mesh = om_tissue_mesh(model);
    for (int i = 0; i < mesh->nvert; ++i)
        c->size = fmax(c->size, om_norm(om_sub(om_load3(mesh->x, i), om_load3(mesh->x, 0))));
    c->ring = RING * c->size;
    OM_TRY_DONE(om__contact_among_create(c));
    *contact = c;
    return OM_OK;
done:
    om_contact_destroy(c);
    return status;
}

void om_contact_destroy(OmContact* c) {
    if (!c) return;
    om_free(c->plane);
    om_free((void*)(uintptr_t)c->sdf);
    om_free(c->field);
    om_free(c->surface_vert);
    om_free(c->pair);
    om_free(c->among);
    om_free(c->body);
    om_free(c);
}

double om__contact_gap(const OmContact* c, int obstacle, OmVec3 p, OmVec3* n) {
    const OmContactDef* def = &c->def;
    if (obstacle < def->nplane) {
        *n = c->plane[obstacle].normal;
        return om_dot(*n, om_sub(p, c->plane[obstacle].point)) - def->offset;
    }
    obstacle -= def->nplane;
    double d;
    if (obstacle < def->nsdf) {
        d = om_sdf_eval(c->sdf[obstacle], p, n);
    } else {
        const OmContactField* field = &c->field[obstacle - def->nsdf];
        d = field->distance(field->ctx, p, n);
    }
    // Where a field is flat (deep inside a thin organ) there is no way out to point at: up to the others.
    double length = om_norm(*n);
    if (!(length > 1e-6)) return INFINITY;
    *n = om_scale(1 / length, *n);
    return d - def->offset;
}

double om_contact_eval_distance(const OmContact* c, OmVec3 p) {
    double near = INFINITY;
    OmVec3 n;
    for (int k = 0; k < c->nobstacle; ++k)
        near = fmin(near, om__contact_gap(c, k, p, &n) + c->def.offset);
    return near;
}
