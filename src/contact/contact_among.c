// contact_among.c: obstacles for engines that keep out of them themselves (position based dynamics).
#include "contact/contact_internal.h"
#include "omentum/contact_tool.h"

static double obstacle_distance(const void* ctx, OmVec3 p, OmVec3* n) {
    const OmContactAmong* a = ctx;
    return om__contact_gap(a->contact, a->obstacle, p, n);
}

OmStatus om__contact_among_create(OmContact* c) {
    c->among = om_calloc((size_t)c->nobstacle, sizeof *c->among);
    c->body = om_calloc((size_t)c->nobstacle, sizeof *c->body);
    if (!c->among || !c->body) return OM_NO_MEMORY;
    for (int k = 0; k < c->nobstacle; ++k) {
        c->among[k] = (OmContactAmong){c, k};
        c->body[k] = (OmTissueObstacle){.distance = obstacle_distance,
                                        .ctx = &c->among[k],
                                        .pose_begin = om_pose_identity(),
                                        .pose_end = om_pose_identity(),
                                        .friction = c->has_own_friction ? -1 : c->def.friction};
    }
    return OM_OK;
}

int om_contact_get_obstacles(const OmContact* c, const OmTissueObstacle** obstacle) {
    *obstacle = c->body;
    return c->nobstacle;
}

OmStatus om__contact_step_among(OmContact* c, const OmTissueModel* m, OmTissueState* s,
                                OmTissueWork* w, double h, OmTissueReport* tissue) {
    OmContactReport* r = &c->report;
    OmStatus status = om_tissue_step_among(m, s, w, h, c->nobstacle, c->body, tissue);
    if (status < 0) return status;
    r->nsolve = tissue->substeps;
    r->is_settled = true;
    for (int k = 0; k < c->nobstacle; ++k) {
        const OmTissueObstacle* o = &c->body[k];
        r->ncontact += o->ncontact;
        r->force = om_add(r->force, o->force);
        r->penetration = fmax(r->penetration, o->penetration);
    }
    return status;
}

static double probe_distance(const void* ctx, OmVec3 p, OmVec3* n) {
    return om_probe_eval_distance(ctx, p, n);
}

OmTissueObstacle om_probe_obstacle(const OmProbe* probe, OmPose begin, OmPose end,
                                   double friction) {
    return (OmTissueObstacle){.distance = probe_distance,
                              .ctx = probe,
                              .pose_begin = begin,
                              .pose_end = end,
                              .friction = friction};
}
