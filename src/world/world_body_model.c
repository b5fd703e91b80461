// world_body_model.c: the model that bodies of one scene and site share, the work of a thread, steps of many bodies.
#include "world/world_body.h"

static OmStatus create_contact(const OmScene* scene, OmBodyModel* m) {
    const OmSite* site = m->site;
    OmContactDef def = om_contact_default_def();
    const bool has_own = site->role == OM_SITE_WORLD && scene->world.friction >= 0;
    def.friction = has_own ? scene->world.friction : scene->tissue.friction;
    OmContactPlane board = {site->pose_world_task.p,
                            om_quat_rotate(site->pose_world_task.q, om_vec3(0, 0, 1))};
    def.self_contact = scene->tissue.self_contact &&
                       (om_engine_capabilities(om_tissue_engine(m->tissue)) & OM_ENGINE_TANGENT);
    def.self_thickness = scene->tissue.self_thickness;
    def.self_friction = fmax(0, scene->tissue.self_friction < 0 ? scene->tissue.friction
                                                                : scene->tissue.self_friction);
    OmTissueObstacle obstacle[2];
    if (site->has_ground) obstacle[def.nobstacle++] = om_plane_obstacle(&board);
    if (site->has_organ) obstacle[def.nobstacle++] = om_sdf_obstacle(&site->organ_sdf);
    def.obstacle = obstacle;
    return om_contact_create(&def, m->tissue, &m->contact);
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
    if (status == OM_OK) status = om_tissue_create(&def, &m->tissue);
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
