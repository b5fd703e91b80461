// world_body_model.c: the model that bodies of one scene and site share, the work of a thread, steps of many bodies.
//
// An organ that deforms is a part of the same tissue, behind the vertices and elements of the site's mesh: one system
// has both, and all that asks for the tissue's vertices finds them first.
#include <string.h>

#include "world/world_body.h"

static OmStatus create_contact(const OmScene* scene, OmBodyModel* m) {
    const OmSite* site = m->site;
    OmContactDef def = om_contact_default_def();
    const bool has_own = site->role == OM_SITE_WORLD && scene->world.friction >= 0;
    def.friction = has_own ? scene->world.friction : scene->tissue.friction;
    OmContactPlane board = {site->pose_world_task.p,
                            om_quat_rotate(site->pose_world_task.q, om_vec3(0, 0, 1))};
    def.self_contact = om_scene_has(scene->tissue.self_contact, site->role) &&
                       (om_engine_capabilities(om_tissue_engine(m->tissue)) & OM_ENGINE_TANGENT);
    def.self_thickness = scene->tissue.self_thickness;
    def.self_friction = fmax(0, scene->tissue.self_friction < 0 ? scene->tissue.friction
                                                                : scene->tissue.self_friction);
    OmTissueObstacle obstacle[2];
    if (site->has_ground) obstacle[def.nobstacle++] = om_plane_obstacle(&board);
    const bool is_soft = site->soft.nvert > 0;
    if (site->has_organ && !is_soft) obstacle[def.nobstacle++] = om_sdf_obstacle(&site->organ_sdf);
    def.obstacle = obstacle;
    OmContactSkin skin = {&site->organ_sdf, site->mesh.nvert, site->mesh.nvert + site->soft.nvert};
    if (is_soft) def.nskin = 1, def.skin = &skin;
    return om_contact_create(&def, m->tissue, &m->contact);
}

// The tissue with the organ that deforms behind it, which is the last material.
typedef struct Joined {
    OmTetMesh mesh;
    OmMaterial material[OM_SITE_MATERIALS + 1];
    double density[OM_SITE_MATERIALS + 1];
    double* spring;  // N/m, of the set "attachment"
    OmTissueBond* bond;
} Joined;

static void joined_done(Joined* j) {
    om_tet_mesh_done(&j->mesh);
    om_free(j->spring);
    om_free(j->bond);
}

static OmStatus join_springs(const OmSite* site, Joined* j) {
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    const OmMeshSet* soft = om_tet_mesh_find_set(&site->soft, "attachment");
    int n = held ? held->nvert : 0;
    OM_ALLOC(j->spring, n + soft->nvert);
    for (int k = 0; k < n; ++k)
        j->spring[k] =
            site->attach_foundation > 0 ? site->attach_spring[k] : site->attach_stiffness;
    memcpy(j->spring + n, site->soft_spring, (size_t)soft->nvert * sizeof *j->spring);
    return OM_OK;
}

// The truth's attachments as springs to the organ: the tissue's part of the set, which comes first, leaves it.
static OmStatus bond_to_organ(const OmSite* site, OmTissueDef* def, OmBodyModel* m, Joined* j) {
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    const int n = held ? held->nvert : 0;
    if (n == 0) return OM_OK;
    OM_ALLOC(j->bond, n);
    OM_TRY(
        om_tissue_make_bonds(&j->mesh, n, held->vert, site->mesh.ntet, j->mesh.ntet, 1, j->bond));
    for (int k = 0; k < n; ++k) j->bond[k].stiffness = j->spring[k];
    for (int s = 0; s < j->mesh.nset; ++s) {
        OmMeshSet* set = &j->mesh.set[s];
        if (strcmp(set->name, "attachment") != 0) continue;
        set->nvert -= n;
        memmove(set->vert, set->vert + n, (size_t)set->nvert * sizeof *set->vert);
        memmove(j->spring, j->spring + n, (size_t)set->nvert * sizeof *j->spring);
    }
    def->nbond = n;
    def->bond = j->bond;
    m->bonded = om_calloc((size_t)site->mesh.nvert, 1);
    if (!m->bonded) return OM_NO_MEMORY;
    for (int k = 0; k < n; ++k) m->bonded[held->vert[k]] = 1;
    return OM_OK;
}

static OmStatus join_organ(const OmScene* scene, OmTissueDef* def, OmBodyModel* m, Joined* j) {
    const OmSite* site = m->site;
    if (site->soft.nvert == 0) return OM_OK;
    OM_CHECK(om_engine_capabilities(def->engine) & OM_ENGINE_TANGENT, OM_UNAVAILABLE,
             "%s: organ: engine %s has no organ that deforms; leave out `deforms: both`",
             om_scene_label(scene), def->engine->name);
    const int last = def->nmaterial > 0 ? def->nmaterial : 1;
    for (int k = 0; k < last; ++k) {
        j->material[k] = def->nmaterial > 0 ? def->material[k] : def->material_default;
        j->density[k] = def->nmaterial > 0 ? def->material_density[k] : def->density;
    }
    const OmSiteMaterial* organ = &site->soft_material;
    j->material[last] =
        (OmMaterial){.law = j->material[0].law, .young = organ->young, .poisson = organ->poisson};
    j->density[last] = organ->density;
    OM_TRY(om_tet_mesh_join(&site->mesh, &site->soft, &j->mesh));
    for (int e = 0; e < j->mesh.ntet; ++e)
        if (e >= site->mesh.ntet || last == 1)
            j->mesh.tet_label[e] = e < site->mesh.ntet ? 0 : last;
    OM_TRY(join_springs(site, j));
    def->mesh = &j->mesh;
    def->nown = site->mesh.nvert;
    def->nmaterial = last + 1;
    def->material = j->material;
    def->material_density = j->density;
    def->attachment_springs = j->spring;
    const bool is_bonded = scene->attach.on_organ && site->role == OM_SITE_WORLD;
    return is_bonded ? bond_to_organ(site, def, m, j) : OM_OK;
}

// The tissue's own elements: they come first, also of quadratic ones.
static void show_own(OmBodyModel* m) {
    const OmTetMesh* all = om_tissue_mesh(m->tissue);
    const int ntet = m->site->mesh.ntet + m->site->soft.ntet;
    m->shown = *all;
    m->nsub = ntet > 0 ? all->ntet / ntet : 1;
    m->shown.ntet = m->nsub * m->site->mesh.ntet;
}

// Shells have no nodes at midpoints; estimates of attachments compute with them (om_body_node_count).
static OmStatus make_midpoints(OmBodyModel* m) {
    OmTetMesh mesh;
    int *node = NULL, nvert = m->site->mesh.nvert;
    OM_TRY(om_tet_mesh_copy(&m->site->mesh, &mesh));
    OmStatus status = om_tet_mesh_refine_nodes(&mesh, &node);
    if (status == OM_OK) {
        m->nmid = mesh.nvert - nvert;
        m->mid_end = om_alloc(2 * (size_t)m->nmid, sizeof *m->mid_end);
        if (m->mid_end) om_tet_mesh_midpoint_ends(m->site->mesh.ntet, node, nvert, m->mid_end);
        if (!m->mid_end) status = OM_NO_MEMORY;
    }
    om_free(node);
    om_tet_mesh_done(&mesh);
    return status;
}

OmStatus om_body_model_create(const OmScene* scene, const OmSite* site, int nworker,
                              OmBodyModel** model) {
    return om__body_model_create(scene, site, nworker, 1, model);
}

OmStatus om__body_model_create(const OmScene* scene, const OmSite* site, int nworker, double factor,
                               OmBodyModel** model) {
    *model = NULL;
    OmBodyModel* m = om_calloc(1, sizeof *m);
    if (!m) return OM_NO_MEMORY;
    m->site = site;
    OmBodyParts parts;
    OmTissueDef def;
    OmStatus status = om_body_make_tissue_def(scene, site, &parts, &def);
    def.solver.nworker = nworker;
    def.material_default.young *= factor;
    for (int k = 0; status == OM_OK && k < def.nmaterial; ++k) parts.material[k].young *= factor;
    Joined joined = {.spring = NULL};
    if (status == OM_OK) status = join_organ(scene, &def, m, &joined);
    if (status == OM_OK) status = om_tissue_create(&def, &m->tissue);
    if (status == OM_OK && def.element == OM_ELEMENT_SHELL) status = make_midpoints(m);
    joined_done(&joined);
    if (status == OM_OK) show_own(m);
    if (status == OM_OK) status = create_contact(scene, m);
    if (status < 0)
        om_body_model_destroy(m);
    else
        *model = m;
    return status;
}

void om_body_model_destroy(OmBodyModel* m) {
    if (!m) return;
    om_contact_destroy(m->contact);
    om_tissue_destroy(m->tissue);
    om_free(m->bonded);
    om_free(m->mid_end);
    om_free(m);
}

OmStatus om_body_work_create(const OmBodyModel* model, OmBodyWork** work) {
    *work = NULL;
    OmBodyWork* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    w->model = model;
    OmStatus status = om_tissue_work_create(model->tissue, &w->tissue);
    if (status == OM_OK) status = om_contact_work_create(model->contact, &w->contact);
    if (status < 0)
        om_body_work_destroy(w);
    else
        *work = w;
    return status;
}

void om_body_work_destroy(OmBodyWork* w) {
    if (!w) return;
    om_contact_work_destroy(w->contact);
    om_tissue_work_destroy(w->tissue);
    om_free(w);
}

// ---- many bodies -----------------------------------------------------------------------------------------

typedef struct Crowd {
    int nbody, nwork;
    OmBody* const* body;
    OmBodyWork* const* work;
    double dt;
    OmStatus* status;
} Crowd;

// Each rank steps every size-th body with its own work; the outcome of a body does not depend on the rank.
static void step_share(void* ctx, OmTeam* team, int rank, int size) {
    (void)team;
    const Crowd* c = ctx;
    for (int k = rank; k < c->nbody; k += size) {
        OmBodyReport report;
        om_body_set_work(c->body[k], c->work[rank]);
        c->status[k] = om_body_step(c->body[k], c->dt, &report);
        om_body_set_work(c->body[k], NULL);
    }
}

OmStatus om_body_step_many(int nbody, OmBody* const* body, int nwork, OmBodyWork* const* work,
                           double dt, OmStatus* status) {
    OM_CHECK(nbody >= 0 && nwork >= 1 && body && work && status, OM_INVALID,
             "body: %d bodies and %d works, or a list is null", nbody, nwork);
    Crowd c = {nbody, nwork, body, work, dt, status};
    om_parallel_team(nwork, step_share, &c);
    OmStatus outcome = OM_OK;
    for (int k = 0; k < nbody; ++k) {
        if (status[k] < 0)
            return om_error(status[k], "body %d of %d: %s", k, nbody, om_status_text(status[k]));
        if (status[k] > 0) outcome = status[k];
    }
    if (outcome == OM_OK) return OM_OK;
    return om_error(outcome, "bodies: a step did not converge; the list of statuses says which");
}
