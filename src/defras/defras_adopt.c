// defras_adopt.c: the twin takes the attachments of an estimate: anchors that change nothing at once travel to their
// places.
#include <string.h>

#include "defras/defras_internal.h"

#define ADOPT_TIME 0.5  // s until the anchors have arrived

void om__adoption_done(Adoption* a) {
    om_free(a->vert);
    om_free(a->stiffness);
    om_free(a->from);
    om_free(a->to);
    om_free(a->anchor);
    *a = (Adoption){0};
}

OmStatus om__adoption_begin(Adoption* a, OmBody* twin, const OmMatchEstimate* estimate) {
    const signed char* held_by = om_body_held_by(twin);
    const OmTetMesh* mesh = &om_body_site(twin)->mesh;
    OmStatus status = OM_OK;
    om__adoption_done(a);
    OM_ALLOC_DONE(a->vert, (size_t)mesh->nvert);
    OM_ALLOC_DONE(a->stiffness, (size_t)mesh->nvert);
    OM_ALLOC_DONE(a->from, 3 * (size_t)mesh->nvert);
    OM_ALLOC_DONE(a->to, 3 * (size_t)mesh->nvert);
    OM_ALLOC_DONE(a->anchor, 3 * (size_t)mesh->nvert);
    for (int v = 0; v < mesh->nvert; ++v) {
        if (!estimate->attached[v] || held_by[v] >= 0) continue;
        om_store3(a->to, a->nvert, om_load3(mesh->x, v));
        a->stiffness[a->nvert] = estimate->stiffness[v];
        a->vert[a->nvert++] = v;
    }
    OM_TRY_DONE(om_body_eval_anchor(twin, a->nvert, a->vert, a->stiffness, a->from));
    OM_TRY_DONE(om_body_set_attachment(twin, a->nvert, a->vert, a->from, a->stiffness));
done:
    if (status < 0) om__adoption_done(a);
    return status;
}

OmStatus om__adoption_step(Adoption* a, OmBody* twin, double dt) {
    if (a->nvert == 0) return OM_OK;
    a->elapsed += dt;
    const double share = fmin(1, a->elapsed / ADOPT_TIME);
    for (int i = 0; i < 3 * a->nvert; ++i)
        a->anchor[i] = a->from[i] + share * (a->to[i] - a->from[i]);
    OM_TRY(om_body_set_attachment(twin, a->nvert, a->vert, a->anchor, a->stiffness));
    if (share == 1) om__adoption_done(a);
    return OM_OK;
}
