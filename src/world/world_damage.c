// world_damage.c: grasps that slip and attachments that tear, in the simulated truth (the thesis models neither).
//
// A grasp slips where the force of the tool on the grasped tissue, weight included, exceeds friction x grip force. An
// attached vertex tears where the force of its attachment exceeds its strength: a stress times the vertex's share of
// the attached area, so that two meshes tear at about the same load. A vertex without a share of the area does not
// tear. The load of torn vertices is carried by their neighbours from the next step on, so a border tears row by row.
#include "world/world_damage.h"

OmStatus om__world_damage_init(const OmScene* scene, const OmSite* site, OmWorldDamage* d) {
    const OmSceneWorld* w = &scene->world;
    *d = (OmWorldDamage){.grip = w->grip_friction < 0 ? -1 : w->grip_friction * w->grip_force};
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    if (w->tear_strength <= 0 || !held || !site->attach_area) return OM_OK;
    const size_t n = (size_t)site->mesh.nvert;
    OmStatus status = OM_OK;
    OM_CALLOC_DONE(d->strength, n);
    OM_ALLOC_DONE(d->force, 3 * n);
    OM_ALLOC_DONE(d->stiffness, n);
    OM_ALLOC_DONE(d->vert, n);
    for (int k = 0; k < held->nvert; ++k)
        d->strength[held->vert[k]] = w->tear_strength * site->attach_area[k];
done:
    if (status < 0) om__world_damage_done(d);
    return status;
}

void om__world_damage_done(OmWorldDamage* d) {
    om_free(d->strength);
    om_free(d->force);
    om_free(d->stiffness);
    om_free(d->vert);
    *d = (OmWorldDamage){.grip = -1};
}

static OmStatus slip(const OmWorldDamage* d, const double closing[OM_MAX_ARM], OmBody* body) {
    OmBodyForces forces;
    if (!om_body_is_holding(body, 0) && !om_body_is_holding(body, 1)) return OM_OK;
    OM_TRY(om_body_get_forces(body, &forces));
    for (int a = 0; a < OM_MAX_ARM; ++a)
        if (om_body_is_holding(body, a) && om_norm(forces.grasp[a]) > closing[a] * d->grip)
            om_body_release(body, a);
    return OM_OK;
}

static OmStatus tear(const OmWorldDamage* d, OmBody* body) {
    const unsigned char* attached = om_body_attached(body);
    const double* stiffness = om_body_attachment_stiffness(body);
    const int nvert = om_body_site(body)->mesh.nvert;
    int n = 0, ntorn = 0;
    OM_TRY(om_body_get_attachment_force(body, d->force));
    for (int v = 0; v < nvert; ++v) {
        if (!attached[v]) continue;
        bool is_torn = d->strength[v] > 0 && om_norm(om_load3(d->force, v)) > d->strength[v];
        ntorn += is_torn;
        if (is_torn) continue;
        d->stiffness[n] = stiffness[v];
        d->vert[n++] = v;
    }
    // The truth is attached at its rest positions.
    return ntorn > 0 ? om_body_set_attachment(body, n, d->vert, NULL, d->stiffness) : OM_OK;
}

OmStatus om__world_damage_step(const OmWorldDamage* d, const double closing[OM_MAX_ARM],
                               OmBody* body) {
    if (d->grip >= 0) OM_TRY(slip(d, closing, body));
    return d->strength ? tear(d, body) : OM_OK;
}
