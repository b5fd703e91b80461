// contact_model.c: the definition of a contact, its constant part and the memory of a thread.
#include <string.h>

#include "base/base_union.h"
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
    OM_CHECK(def->nskin >= 0 && (def->nskin == 0 || def->skin), OM_INVALID,
             "contact: nskin is %d, or skin is null", def->nskin);
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

// Pieces of the mesh, numbered by their first vertices.
static OmStatus find_bodies(const OmTetMesh* mesh, OmContact* c) {
    OM_ALLOC(c->body, mesh->nvert);
    int* parent = om_alloc((size_t)mesh->nvert, sizeof *parent);
    if (!parent) return OM_NO_MEMORY;
    for (int i = 0; i < mesh->nvert; ++i) parent[i] = i;
    for (int e = 0; e < mesh->ntet; ++e)
        for (int k = 1; k < 4; ++k) {
            int a = om__find_root(parent, mesh->tet_vert[4 * (size_t)e]),
                b = om__find_root(parent, mesh->tet_vert[4 * (size_t)e + (size_t)k]);
            if (a != b) parent[a < b ? b : a] = a < b ? a : b;
        }
    for (int i = 0; i < mesh->nvert; ++i) {
        int root = om__find_root(parent, i);
        c->body[i] = root == i ? c->nbody++ : c->body[root];
    }
    om_free(parent);
    return OM_OK;
}

// What ties between places of the tissue need.
static OmStatus check_engine(const OmContactDef* def, const OmContact* c, const OmTissueModel* m) {
    const char* what = def->self_contact ? "self_contact" : "a skin";
    OM_CHECK(c->ntri > 0 && (om_engine_capabilities(om_tissue_engine(m)) & OM_ENGINE_TANGENT),
             OM_UNAVAILABLE, "contact: %s needs a mesh of tetrahedra and an engine with a matrix",
             what);
    OM_CHECK(om_engine_def(m)->solver.preconditioner < OM_CHOLESKY, OM_UNAVAILABLE,
             "contact: %s needs CG as the tissue's solver (OM_MULTIGRID, OM_BLOCK_JACOBI)", what);
    return OM_OK;
}

static OmStatus create_soft(const OmContactDef* def, const OmTissueModel* m, OmContact* c) {
    if (!def->self_contact && def->nskin == 0) return OM_OK;
    OM_TRY(check_engine(def, c, m));
    OM_TRY(find_bodies(om_tissue_mesh(m), c));
    OM_ALLOC(c->skin_of, c->nbody);
    for (int b = 0; b < c->nbody; ++b) c->skin_of[b] = -1;
    c->skin_friction = fmax(0, c->def.friction);
    OM_TRY(om__skins_create(def, m, c));
    return def->self_contact ? om__self_create(c, m, &c->self) : OM_OK;
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
    OM_TRY_DONE(create_soft(def, model, c));
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
    om_free(c->body);
    om_free(c->skin_of);
    om__skins_destroy(c);
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
    OM_TRY_DONE(om__skins_work_create(contact, &w->ride));
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
    om__skins_work_destroy(w->contact, w->ride);
    om_free(w->touch);
    om_free(w);
}
