// study_hand.c: an arm of the simulated world, kept pictures, scans.
#include "studies/study_hand.h"

#include <string.h>

#define MAX_WAY 1000  // ticks to a goal
#define JAW_TICKS 30
#define JAW_OPEN 0.7  // rad

OmStatus om__hand_wait(StudyHand* h, int n) {
    for (int i = 0; i < n; ++i) OM_TRY(om_world_advance(h->world, h->dt));
    return om_world_observe(h->world, 0, &h->obs);
}

OmStatus om__hand_go(StudyHand* h, OmVec3 p, double speed) {
    OmPose goal = h->obs.arm[h->arm].tip;
    goal.p = p;
    OM_TRY(om_world_move(h->world, h->arm, goal, speed));
    for (int i = 0; i < MAX_WAY; ++i) {
        OM_TRY(om__hand_wait(h, 1));
        if (!h->obs.arm[h->arm].is_moving) return OM_OK;
    }
    return om_error(OM_INVALID, "%s: the arm does not arrive", h->name);
}

OmStatus om__hand_close(StudyHand* h, OmVec3 above, OmVec3 at) {
    OM_TRY(om_world_set_jaw(h->world, h->arm, JAW_OPEN));
    OM_TRY(om__hand_go(h, above, HAND_FAST));
    OM_TRY(om__hand_go(h, at, HAND_FAST));
    OM_TRY(om_world_set_jaw(h->world, h->arm, 0));
    return om__hand_wait(h, JAW_TICKS);
}

OmStatus om__hand_grasp(StudyHand* h, OmVec3 above, OmVec3 at) {
    OM_TRY(om__hand_close(h, above, at));
    OM_CHECK(om_arm_is_holding(&h->obs.arm[h->arm]), OM_INVALID, "%s: no tissue in the jaw",
             h->name);
    return OM_OK;
}

OmStatus om__hand_force(const StudyHand* h, double* force) {
    OmBodyForces f;
    OM_TRY(om_body_get_forces(om_world_truth(h->world), &f));
    *force = om_norm(f.pull[h->arm]);
    return OM_OK;
}

OmStatus om__hand_show(double time, const OmArmObservation arm[OM_MAX_ARM], int narm,
                       const OmCamera* camera, const float* depth, const unsigned char* color,
                       OmObservation* obs) {
    const size_t n = (size_t)camera->width * (size_t)camera->height;
    OmStatus status;
    *obs = (OmObservation){.time = time, .narm = narm, .rgbd = {.time = time, .camera = *camera}};
    memcpy(obs->arm, arm, sizeof obs->arm);
    OM_ALLOC_DONE(obs->rgbd.depth, n);
    memcpy(obs->rgbd.depth, depth, n * sizeof *depth);
    OM_TRY_DONE(om_picture_init(&obs->rgbd.color, camera->width, camera->height, 3));
    memcpy(obs->rgbd.color.pixel, color, 3 * n);
done:
    if (status < 0) om_observation_done(obs);
    return status;
}

OmStatus om__hand_scan(const OmObservation* obs, const OmSite* twin, const OmPsm* psm,
                       double spacing, OmScan* scan) {
    OmScanDef def = om_scan_default_def(om_site_spacing(twin));
    OmCloudDef space = om_cloud_default_def(NULL, twin);
    if (spacing > 0) def.spacing = spacing;
    for (int a = 0; a < obs->narm && psm; ++a) space.psm[a] = &psm[a];
    return om_scan_from_observation(&def, &space, obs, scan);
}

double om__hand_share_facing(const OmSurface* surface, const int* vert, const double* x,
                             OmVec3 eye) {
    double all = 0, facing = 0;
    for (int k = 0; k < surface->ntri; ++k) {
        const int* v = surface->tri_vert + 3 * (size_t)k;
        const OmVec3 a = om_load3(x, vert[v[0]]), b = om_load3(x, vert[v[1]]);
        const OmVec3 normal = om_cross(om_sub(b, a), om_sub(om_load3(x, vert[v[2]]), a));
        all += om_norm(normal);
        if (om_dot(normal, om_sub(eye, a)) > 0) facing += om_norm(normal);
    }
    return facing / all;  // > 0: tissue has an area
}

OmStatus om__hand_surface(const OmSurface* surface, const int* vert, const double* x,
                          OmSurface* out) {
    OM_TRY(om_surface_init(out, surface->nvert, surface->ntri));
    memcpy(out->tri_vert, surface->tri_vert, 3 * (size_t)surface->ntri * sizeof *out->tri_vert);
    for (int i = 0; i < surface->nvert; ++i) om_store3(out->x, i, om_load3(x, vert[i]));
    return OM_OK;
}

double om__processor_ms(clock_t begin) { return 1e3 * (double)(clock() - begin) / CLOCKS_PER_SEC; }
