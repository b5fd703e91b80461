// contact_prescribed.c: the area under the probe at first contact moves as the probe does (thesis 3.4.3).
//
// A spring holds each point of the area at its position in the probe's frame. The spring is a hundred times stiffer
// than the resistance against moving the point alone: a penalty without detection. The area consists of points of the
// contact surface, not of vertices of the volume, so that it is the same on every mesh. The penalty method keeps the
// other points out of the probe: without it, tissue beside the area bulges into the sides of a probe 20 mm deep (2.3
// mm at 30 mm). A step without other contact points is one solve.
#include "contact/contact_press_internal.h"
#include "omentum/shape_meshing.h"

// smallest cosine between the probe's normal and its direction: the probe's sides are left out
#define FRONT 0.5
// smallest cosine between the surface's normal and the opposite of the probe's direction
#define FACING 0.1

// True if the probe's front is behind the point q (probe's frame), at most `reach` against the probe's direction.
static bool is_under(const OmPress* p, OmVec3 q) {
    const OmTissueObstacle* o = &p->def.obstacle;
    double path = 0;
    for (int k = 0; k < 200 && path <= p->def.reach; ++k) {
        OmVec3 n;
        double d = o->distance(o->ctx, om_madd(q, -path, p->def.direction), &n) - o->offset;
        if (d <= 1e-3 * p->def.reach) return om_dot(n, p->def.direction) > FRONT;
        path += d;
    }
    return false;
}

OmStatus om__press_select_area(OmPress* p, const OmTissueState* s, OmPose pose) {
    OmStatus status = OM_OK;
    OmSurface now = p->surface;
    double *x = NULL, *normal = NULL, nearest = INFINITY;
    int narea = 0;
    OM_ALLOC_DONE(x, 3 * (size_t)now.nvert);
    OM_ALLOC_DONE(normal, 3 * (size_t)now.nvert);
    for (int i = 0; i < now.nvert; ++i) om_store3(x, i, om__press_position(p, om_tissue_x(s), i));
    now.x = x;
    om_surface_normals(&now, normal);
    OmVec3 direction = om_quat_rotate(pose.q, p->def.direction);
    for (int i = 0; i < now.nvert; ++i) {
        OmVec3 q = om__press_local(pose, om_load3(x, i));
        nearest = fmin(nearest, om__press_distance(p, q));
        if (om_dot(om_load3(normal, i), direction) > -FACING || om__press_is_still(p, s, i) ||
            !is_under(p, q))
            continue;
        p->area[narea] = i;
        om_store3(p->area_place, narea++, q);
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

void om__press_prescribe(OmPress* p, const OmTissueState* s) {
    for (int k = 0; k < p->narea; ++k) {
        int i = p->area[k];
        if (p->near_of[i] < 0) p->near_of[i] = p->nnear++;
        OmPressPoint* t = &p->near[p->near_of[i]];
        *t = (OmPressPoint){.vert = i, .is_active = true, .is_prescribed = true};
        t->x = om__press_position(p, om_tissue_x(s), i);
        t->probe_move = om_sub(om_pose_apply(p->to, om_load3(p->area_place, k)), t->x);
    }
}
