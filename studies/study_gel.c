// study_gel.c: the box of ballistic gel with three stiff beads (thesis 3.5.1).
//
//         |probe|          |probe|          |probe|
//     .---------------------------------------------. z = 70 mm
//     |                                     (  o  )<|--- 63      heights are those of the beads' tops, which
//     |                    (  o  )<-----------------|--- 53      are the points that images show
//     |    (  o  )<---------------------------------|--- 47
//     '---------------------------------------------' z = 0, attached
//
// The thesis gives only the heights 47, 53 and 63 mm. A bead of 18 mm with its centre at 63 mm would stick
// out of a box of 70 mm, so they are taken as the heights of the tops. Beads are 45 mm apart in the middle
// plane and the probe's long side is normal to it, so that it is never near two of them.
#include <math.h>

#include "studies/study_internal.h"

#define SIDE_X 0.155
#define SIDE_Y 0.100
#define SIDE_Z 0.070
#define BEAD_RADIUS 0.009
#define BEAD_APART 0.045
#define MAX_DEPTH 0.020  // m, deepest indentation

double om__study_eval_box(const OmStudyBody* body, OmVec3 p) {
    OmVec3 h = body->half;
    return fmax(fmax(fabs(p.x) - h.x, fabs(p.y) - h.y), fabs(p.z - h.z) - h.z);
}

OmStatus om_study_body_create_gel(OmStudyBody** out) {
    static const double top[] = {0.047, 0.053, 0.063};
    *out = NULL;
    OmStudyBody* body = om_calloc(1, sizeof *body);
    if (!body) return OM_NO_MEMORY;
    snprintf(body->name, sizeof body->name, "gel");
    body->is_box = true;
    body->half = om_vec3(0.5 * SIDE_X, 0.5 * SIDE_Y, 0.5 * SIDE_Z);
    body->up = om_vec3(0, 0, 1);
    body->lo = om_vec3(-0.5 * SIDE_X, -0.5 * SIDE_Y, 0);
    body->hi = om_vec3(0.5 * SIDE_X, 0.5 * SIDE_Y, SIDE_Z);
    for (int i = 0; i < 3; ++i) {
        OmStudyLesion* l = &body->lesion[body->nlesion++];
        l->radius = BEAD_RADIUS;
        l->center = om_vec3((i - 1) * BEAD_APART, 0, top[i] - BEAD_RADIUS);
        l->touch = om_vec3(l->center.x, 0, SIDE_Z);
        l->normal = body->up;
        l->along = om_vec3(0, 1, 0);
        l->max = MAX_DEPTH;
    }
    *out = body;
    return OM_OK;
}
