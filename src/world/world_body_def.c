// world_body_def.c: the definition of a scene's tissue on a site: engine, materials, gravity, attachments.
#include <stdio.h>
#include <string.h>

#include "omentum/body.h"
#include "omentum/fem.h"
#include "omentum/heuristic.h"
#include "omentum/pbd.h"

#define CG_TOLERANCE 1e-3
#define CG_ITERATIONS 200

OmEngineSet om_engine_set_default(void) {
    return (OmEngineSet){5,
                         {om_fem_engine(), om_pbd_engine(), om_xpbd_engine(), om_spring_engine(),
                          om_chain_engine()}};
}

OmStatus om_body_find_engine(const OmScene* scene, OmSiteRole role, const OmTissueEngine** engine) {
    *engine = om_fem_engine();
    if (role != OM_SITE_TWIN) return OM_OK;
    OmEngineSet plain = om_engine_set_default();
    const OmEngineSet* set = scene->engines ? scene->engines : &plain;
    OmStatus status = om_engine_set_find(set, scene->tissue.engine, engine);
    return status < 0 ? om_error_prefix(status, "%s: tissue", om_scene_label(scene)) : OM_OK;
}

static OmLaw law_of(const OmScene* scene, const OmSite* site) {
    bool has_own = site->role == OM_SITE_WORLD && scene->world.law >= 0;
    return has_own ? (OmLaw)scene->world.law : scene->tissue.law;
}

static OmMaterial material_of(const OmScene* scene, const OmSite* site, const OmSiteMaterial* m) {
    return (OmMaterial){.law = law_of(scene, site), .young = m->young, .poisson = m->poisson};
}

// Input for the engine's options: the scene's numbers and the file of `weights`.
static OmStatus make_input(const OmScene* scene, OmSiteRole role, const OmTissueEngine* engine,
                           OmBodyParts* parts) {
    const OmSceneTissue* t = &scene->tissue;
    const OmEngineNumber number[] = {{"cluster_spacing", t->cluster_spacing},
                                     {"cluster_radius", t->cluster_radius},
                                     {"cluster_stiffness", t->cluster_stiffness}};
    _Static_assert(sizeof number <= sizeof parts->number, "OmBodyParts has room for all numbers");
    memcpy(parts->number, number, sizeof number);
    parts->input =
        (OmEngineInput){.number = parts->number, .nnumber = (int)(sizeof number / sizeof *number)};
    OM_CHECK(!engine->needs_file || t->weights[0], OM_INVALID,
             "%s: tissue: engine %s needs a file; name it by the key weights",
             om_scene_label(scene), engine->name);
    if (!engine->needs_file) {
        OM_CHECK(!t->weights[0] || role != OM_SITE_TWIN, OM_INVALID,
                 "%s: tissue: engine %s reads no file; remove the key weights",
                 om_scene_label(scene), engine->name);
        return OM_OK;
    }
    OM_TRY(om_path_join(scene->data_root, t->weights, parts->file, sizeof parts->file));
    parts->input.file = parts->file;
    return OM_OK;
}

OmStatus om_body_make_tissue_def(const OmScene* scene, const OmSite* site, OmBodyParts* parts,
                                 OmTissueDef* out) {
    const OmTissueEngine* engine;
    OM_TRY(om_body_find_engine(scene, site->role, &engine));
    OM_TRY(make_input(scene, site->role, engine, parts));
    OmTissueDef def = om_tissue_default_def(engine, &site->mesh);
    def.input = &parts->input;
    if (engine->has_quadratic) def.element = om_scene_element(scene, site->role);
    OmSiteMaterial first = om_site_get_material(site, 0);
    def.material_default = material_of(scene, site, &first);
    def.density = site->density;
    if (site->nmaterial > 1) {
        for (int k = 0; k < site->nmaterial; ++k) {
            OmSiteMaterial m = om_site_get_material(site, k);
            parts->material[k] = material_of(scene, site, &m);
            parts->density[k] = m.density;
        }
        def.nmaterial = site->nmaterial;
        def.material = parts->material;
        def.material_density = parts->density;
    }
    def.rayleigh_mass = scene->tissue.rayleigh_mass;
    def.rayleigh_stiffness = scene->tissue.rayleigh_stiffness;
    def.gravity = site->gravity;
    def.attachment_stiffness = site->attach_stiffness;
    if (site->attach_foundation > 0) def.attachment_springs = site->attach_spring;
    def.solver.tolerance = CG_TOLERANCE;
    def.solver.max_iterations = CG_ITERATIONS;
    *out = def;
    return OM_OK;
}

void om_body_describe(const OmScene* scene, const OmSite* site, char* text, size_t size) {
    const OmTissueEngine* engine;
    if (om_body_find_engine(scene, site->role, &engine) < 0) {
        snprintf(text, size, "an unknown engine");
        return;
    }
    snprintf(text, size, "%s", engine->summary ? engine->summary : engine->name);
    if (engine->has_law) {
        size_t n = strlen(text);
        snprintf(text + n, size - n, ", %s", om_law_name(law_of(scene, site)));
    }
    if (!om_engine_uses(engine, "young")) return;
    for (int k = 0; k < (site->nmaterial > 0 ? site->nmaterial : 1); ++k) {
        size_t n = strlen(text);
        OmSiteMaterial m = om_site_get_material(site, k);
        snprintf(text + n, size - n, "%s%s%sYoung's modulus %.0f Pa, Poisson's ratio %.3g",
                 k > 0 ? "; " : ", ", site->nmaterial > 1 ? m.name : "",
                 site->nmaterial > 1 ? ": " : "", m.young, m.poisson);
    }
    size_t n = strlen(text);
    if (site->soft.nvert > 0)
        snprintf(text + n, size - n, "; on an organ of %d vertices that gives way, %.0f Pa",
                 site->soft.nvert, site->soft_material.young);
}
