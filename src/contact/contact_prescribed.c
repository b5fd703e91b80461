// contact_prescribed.c: the area under the probe at first touch moves as the probe does (thesis 3.4.3).
//
// Each point of the area is held by a spring to its place in the probe's frame, a hundred times stiffer than what
// resists moving it alone: from a formulation point of view a penalty without detection. Points rather than
// vertices of the volume, so that the area is the same on every mesh. The other points are kept out of the
// probe by the penalty method: without that, tissue beside the area bulges into the sides of a probe 20 mm deep
// (2.3 mm at 30 mm). As long as none of them touches, a step is one solve.
#include "contact/contact_press_internal.h"
#include "omentum/shape_meshing.h"

#define FRONT 0.5   // least cosine between the probe's normal and its way: not its sides
#define FACING 0.1  // least cosine between the surface's normal and the probe's way

// Does the probe's front lie behind the point q of its frame, no farther than reach against its direction?
static bool is_under(const OmPress* p, OmVec3 q) {
    double way = 0;
    for (int k = 0; k < 200 && way <= p->def.reach; ++k) {
        OmVec3 n;
        double d = om_probe_eval_distance(p->def.probe, om_madd(q, -way, p->def.direction), &n);
        if (d <= 1e-3 * p->def.reach) return om_dot(n, p->def.direction) > FRONT;
        way += d;
    }
    return false;
}

OmStatus om__press_take_area(OmPress* p, const OmTissueState* s, OmPose pose) {
    OmStatus status = OM_OK;
    OmSurface now = p->surface;
    double *x = NULL, *normal = NULL, nearest = INFINITY;
    int narea = 0;
    OM_ALLOC_DONE(x, 3 * (size_t)now.nvert);
    OM_ALLOC_DONE(normal, 3 * (size_t)now.nvert);
    for (int i = 0; i < now.nvert; ++i) om_store3(x, i, om__press_point(p, om_tissue_x(s), i));
    now.x = x;
    om_surface_normals(&now, normal);
    OmVec3 way = om_quat_rotate(pose.q, p->def.direction);
    for (int i = 0; i < now.nvert; ++i) {
        OmVec3 q = om__press_local(pose, om_load3(x, i));
        nearest = fmin(nearest, om_probe_eval_distance(p->def.probe, q, NULL));
        if (om_dot(om_load3(normal, i), way) > -FACING || om__press_is_still(p, s, i) ||
            !is_under(p, q))
            continue;
        p->area[narea] = i;
        om_store3(p->grip, narea++, q);
    }
    OM_CHECK_DONE(narea > 0, OM_INVALID,
                  "press: no point of the contact surface lies under the probe within %.1f mm; the "
                  "nearest is %.1f mm away",
                  1e3 * p->def.reach, 1e3 * nearest);
    p->narea = narea;
done:
    om_free(x);
    om_free(normal);
    return status;
}

void om__press_glue(OmPress* p, const OmTissueState* s) {
    for (int k = 0; k < p->narea; ++k) {
        int i = p->area[k];
        if (p->touch_of[i] < 0) p->touch_of[i] = p->ntouch++;
        OmTouch* t = &p->touch[p->touch_of[i]];
        *t = (OmTouch){.point = i, .is_active = true, .is_glued = true};
        t->x = om__press_point(p, om_tissue_x(s), i);
        t->slip = om_sub(om_pose_apply(p->to, om_load3(p->grip, k)), t->x);
    }
}
