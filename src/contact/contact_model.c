// contact_model.c: the definition of a contact, its constant part and the memory of a thread.
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

static OmStatus check_def(const OmContactDef* def) {
    OM_CHECK(def->cookie == CONTACT_COOKIE, OM_INVALID,
             "contact: the definition was not made by om_contact_default_def");
    OM_TRY(om__contact_check_obstacles(def));
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
    OM_CHECK(def->self_thickness >= 0 && def->self_thickness <= 0.1, OM_INVALID,
             "contact: self_thickness is %g m; it must be from 0 to 0.1", def->self_thickness);
    OM_CHECK(def->self_friction >= 0 && def->self_friction <= 10, OM_INVALID,
             "contact: self_friction is %g; it must be from 0 to 10", def->self_friction);
    OM_CHECK(def->max_iterations >= 1 && def->max_iterations <= 1000, OM_INVALID,
             "contact: max_iterations is %d; it must be from 1 to 1000", def->max_iterations);
    return OM_OK;
}

static OmStatus copy_boundary(const OmTetMesh* mesh, OmContact* c) {
    OmSurface surface = {0};
    int* vert = NULL;
    if (mesh->ntet == 0) return OM_OK;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_tet_mesh_boundary(mesh, &surface, &vert));
    c->ntri = surface.ntri;
    OM_ALLOC_DONE(c->tri_vert, 3 * (size_t)c->ntri);
    for (int n = 0; n < 3 * c->ntri; ++n) c->tri_vert[n] = vert[surface.tri_vert[n]];
done:
    om_surface_done(&surface);
    om_free(vert);
    return status;
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
    const int* surface = om_tissue_surface_vert(model, &c->nsurface);
    c->nvert = om_tissue_mesh(model)->nvert;
    OM_ALLOC_DONE(c->plane, def->nobstacle);
    OM_ALLOC_DONE(c->obstacle, def->nobstacle);
    OM_ALLOC_DONE(c->surface_vert, c->nsurface);
    om__contact_copy_obstacles(c, def);
    c->def.obstacle = c->obstacle;
    memcpy(c->surface_vert, surface, (size_t)c->nsurface * sizeof *surface);
    const OmTetMesh* mesh = om_tissue_mesh(model);
    OM_TRY_DONE(copy_boundary(mesh, c));
    for (int i = 0; i < mesh->nvert; ++i)
        c->size = fmax(c->size, om_norm(om_sub(om_load3(mesh->x, i), om_load3(mesh->x, 0))));
    c->ring = RING * c->size;
    if (def->self_contact)
        OM_TRY_DONE(om__self_create(def, model, c->ntri, c->tri_vert, c->size, &c->self));
    *contact = c;
    return OM_OK;
done:
    om_contact_destroy(c);
    return status;
}

void om_contact_destroy(OmContact* c) {
    if (!c) return;
    om_free(c->plane);
    om_free(c->obstacle);
    om_free(c->surface_vert);
    om_free(c->tri_vert);
    om__self_destroy(c->self);
    om_free(c);
}

OmStatus om_contact_work_create(const OmContact* contact, OmContactWork** contact_work) {
    *contact_work = NULL;
    OmStatus status = OM_OK;
    OmContactWork* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    size_t nobstacle = (size_t)contact->def.nobstacle;
    w->contact = contact;
    OM_ALLOC_DONE(w->obstacle, nobstacle);
    OM_ALLOC_DONE(w->frame, nobstacle);
    OM_ALLOC_DONE(w->pair, (size_t)contact->nsurface * nobstacle);
    OM_ALLOC_DONE(w->normal, 3 * (size_t)contact->nvert);
    for (size_t k = 0; k < nobstacle; ++k) w->obstacle[k] = contact->obstacle[k];
    if (contact->self) OM_TRY_DONE(om__self_work_create(contact->self, &w->self));
    *contact_work = w;
    return OM_OK;
done:
    om_contact_work_destroy(w);
    return status;
}

void om_contact_work_destroy(OmContactWork* w) {
    if (!w) return;
    om_free(w->obstacle);
    om_free(w->frame);
    om_free(w->pair);
    om_free(w->normal);
    om__self_work_destroy(w->self);
    om_free(w);
}
