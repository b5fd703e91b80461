// scan_field.c: where the tissue can be: near the task, away from tools and fixed anatomy.
#include "omentum/scan_picture.h"

static bool is_on_tool(const OmScanField* f, OmVec3 p) {
    for (int k = 0; k < f->ncapsule; ++k) {
        const OmPsmCapsule* c = &f->capsule[k];
        OmVec3 axis = om_sub(c->b, c->a), from = om_sub(p, c->a);
        double length2 = om_norm2(axis);  // > 0: a jaw or shaft has a length
        double t = fmax(0, fmin(1, om_dot(from, axis) / length2));
        double reach = c->radius + f->tool_margin;
        if (om_norm2(om_sub(from, om_scale(t, axis))) < reach * reach) return true;
    }
    return false;
}

OmScanPlace om_scan_field_eval(const OmScanField* f, OmVec3 p) {
    if (is_on_tool(f, p)) return OM_PLACE_TOOL;
    OmVec3 at = om_pose_apply(f->pose_task_world, p);
    if (at.x < f->lo.x || at.y < f->lo.y || at.z < f->lo.z) return OM_PLACE_FAR;
    if (at.x > f->hi.x || at.y > f->hi.y || at.z > f->hi.z) return OM_PLACE_FAR;
    double clearance = f->clearance;
    if (f->has_ground && at.z < clearance) return OM_PLACE_FIXED;
    if (f->organ && om_sdf_eval(f->organ, p, NULL) < clearance) return OM_PLACE_FIXED;
    return OM_PLACE_FREE;
}
