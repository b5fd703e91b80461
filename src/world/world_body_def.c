// world_body_def.c: the definition of a scene's tissue on a site: engine, materials, gravity, attachments.
#include <stdio.h>
#include <string.h>

#include "omentum/body.h"
#include "omentum/fem.h"
#include "omentum/heuristic.h"

#define CG_TOLERANCE 1e-3
#define CG_ITERATIONS 200

// Particles are the vertices of the site's mesh, which lie on its surface.
static OmPbdDef particle_def(const OmSceneTissue* t) {
    OmPbdDef def =
        om_pbd_default_def(t->model == OM_ENGINE_XPBD ? OM_PBD_ELASTIC : OM_PBD_CLUSTERS);
    def.cluster_spacing = t->cluster_spacing;
    def.cluster_radius = t->cluster_radius;
    def.cluster_stiffness = t->cluster_stiffness;
    def.collision_distance = 0;
    return def;
}

static OmMaterial material_of(const OmScene* scene, const OmSiteMaterial* m) {
    return (OmMaterial){.law = (OmLaw)scene->tissue.law, .young = m->young, .poisson = m->poisson};
}

static OmSceneEngine engine_of(const OmScene* scene, const OmSite* site) {
    return site->role == OM_SITE_TWIN ? (OmSceneEngine)scene->tissue.model : OM_ENGINE_FEM;
}

OmTissueDef om_body_tissue_def(const OmScene* scene, const OmSite* site, OmBodyParts* parts) {
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), &site->mesh);
    OmSiteMaterial first = om_site_get_material(site, 0);
    def.material_default = material_of(scene, &first);
    def.density = site->density;
    if (site->nmaterial > 1) {
        for (int k = 0; k < site->nmaterial; ++k) {
            OmSiteMaterial m = om_site_get_material(site, k);
            parts->material[k] = material_of(scene, &m);
            parts->density[k] = m.density;
        }
        def.nmaterial = site->nmaterial;
        def.material = parts->material;
        def.material_density = parts->density;
    }
    def.rayleigh_mass = scene->tissue.rayleigh_mass;
    def.rayleigh_stiffness = scene->tissue.rayleigh_stiffness;
    def.gravity = site->gravity;
    def.attachment_stiffness = scene->attach.stiffness;
    def.solver.tolerance = CG_TOLERANCE;
    def.solver.max_iterations = CG_ITERATIONS;
    parts->pbd = particle_def(&scene->tissue);
    switch (engine_of(scene, site)) {
    case OM_ENGINE_FEM: def.is_averaged = scene->tissue.is_averaged; break;
    case OM_ENGINE_PBD: def.engine = om_pbd_engine(), def.options = &parts->pbd; break;
    case OM_ENGINE_XPBD: def.engine = om_xpbd_engine(), def.options = &parts->pbd; break;
    case OM_ENGINE_SPRINGS: def.engine = om_spring_engine(); break;
    case OM_ENGINE_CHAINMAIL: def.engine = om_chain_engine(); break;
    }
    return def;
}

void om_body_describe(const OmScene* scene, const OmSite* site, char* text, size_t size) {
    switch (engine_of(scene, site)) {
    case OM_ENGINE_PBD:
        snprintf(text, size, "particles in clusters, which know no law and no modulus");
        return;
    case OM_ENGINE_CHAINMAIL:
        snprintf(text, size, "ChainMail, which knows no law and no modulus");
        return;
    case OM_ENGINE_XPBD:
        snprintf(text, size, "XPBD, %s", om_law_name(OM_STABLE_NEO_HOOKEAN));
        break;
    case OM_ENGINE_SPRINGS: snprintf(text, size, "springs on edges, no law"); break;
    default: snprintf(text, size, "finite elements, %s", om_law_name((OmLaw)scene->tissue.law));
    }
    for (int k = 0; k < (site->nmaterial > 0 ? site->nmaterial : 1); ++k) {
        size_t n = strlen(text);
        OmSiteMaterial m = om_site_get_material(site, k);
        snprintf(text + n, size - n, "%s%s%sYoung's modulus %.0f Pa, Poisson's ratio %.3g",
                 k > 0 ? "; " : ", ", site->nmaterial > 1 ? m.name : "",
                 site->nmaterial > 1 ? ": " : "", m.young, m.poisson);
    }
}
