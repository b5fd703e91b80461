// contact_obstacle.c: obstacles made of planes, distance fields and functions; their distances.
#include "contact/contact_internal.h"

#define STEEP 1e-6  // norm of a gradient below which a distance field has no normal

static double plane_distance(const void* ctx, OmVec3 p, OmVec3* normal) {
    const OmContactPlane* plane = ctx;
    *normal = om_scale(1 / om_norm(plane->normal), plane->normal);
    return om_dot(*normal, om_sub(p, plane->point));
}

// The same of a plane whose normal is of unit length.
static double unit_plane_distance(const void* ctx, OmVec3 p, OmVec3* normal) {
    const OmContactPlane* plane = ctx;
    *normal = plane->normal;
    return om_dot(plane->normal, om_sub(p, plane->point));
}

static double sdf_distance(const void* ctx, OmVec3 p, OmVec3* normal) {
    double d = om_sdf_eval(ctx, p, normal), steep = om_norm(*normal);
    // deep inside a thin organ the field is flat: without a direction the obstacle does not push
    if (!(steep > STEEP)) return INFINITY;
    *normal = om_scale(1 / steep, *normal);
    return d;
}

OmTissueObstacle om_field_obstacle(OmDistanceFn distance, const void* ctx) {
    return (OmTissueObstacle){.distance = distance,
                              .ctx = ctx,
                              .pose_begin = om_pose_identity(),
                              .pose_end = om_pose_identity(),
                              .friction = -1};
}

OmTissueObstacle om_plane_obstacle(const OmContactPlane* plane) {
    OmTissueObstacle o = om_field_obstacle(plane_distance, plane);
    o.is_plane = true;
    return o;
}

OmTissueObstacle om_sdf_obstacle(const OmSdf* sdf) { return om_field_obstacle(sdf_distance, sdf); }

bool om__contact_is_pose(OmPose pose) {
    OmQuat q = pose.q;
    double unit = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    return om_is_finite3(pose.p) && om_norm(pose.p) < 1e6 && fabs(unit - 1) < 1e-6;
}

static OmStatus check_plane(const OmContactPlane* plane, int k) {
    OM_CHECK(plane, OM_INVALID, "contact: obstacle[%d]: the plane is null", k);
    OmVec3 n = plane->normal;
    double length = om_norm(n);
    OM_CHECK(om_is_finite3(plane->point), OM_INVALID,
             "contact: obstacle[%d]: the plane's point is not finite", k);
    OM_CHECK(length > 1e-100 && length < 1e100, OM_INVALID,
             "contact: obstacle[%d]: the plane's normal (%g, %g, %g) has no direction", k, n.x, n.y,
             n.z);
    return OM_OK;
}

OmStatus om__contact_check_obstacles(const OmContactDef* def) {
    OM_CHECK(def->nobstacle >= 0 && (def->nobstacle == 0 || def->obstacle), OM_INVALID,
             "contact: nobstacle is %d, and obstacle is null or the count negative",
             def->nobstacle);
    for (int k = 0; k < def->nobstacle; ++k) {
        const OmTissueObstacle* o = &def->obstacle[k];
        OM_CHECK(o->distance, OM_INVALID, "contact: obstacle[%d].distance is null", k);
        if (o->distance == plane_distance) OM_TRY(check_plane(o->ctx, k));
        if (o->distance == sdf_distance) {
            const OmSdf* sdf = o->ctx;
            OM_CHECK(sdf && sdf->d, OM_INVALID,
                     "contact: obstacle[%d]: the distance field is null or empty", k);
        }
        OM_CHECK(o->offset >= 0 && o->offset <= 1, OM_INVALID,
                 "contact: obstacle[%d].offset is %g m; it must be from 0 to 1", k, o->offset);
        OM_CHECK(
            om__contact_is_pose(o->pose_begin) && om__contact_is_pose(o->pose_end), OM_INVALID,
            "contact: obstacle[%d]: a pose is not finite, or its quaternion not of unit length", k);
        OM_CHECK(o->friction <= 10, OM_INVALID,
                 "contact: obstacle[%d].friction is %g; it must be at most 10, negative for the "
                 "contact's own",
                 k, o->friction);
    }
    return OM_OK;
}

void om__contact_copy_obstacles(OmContact* c, const OmContactDef* def) {
    for (int k = 0; k < def->nobstacle; ++k) {
        OmTissueObstacle* o = &c->obstacle[k];
        *o = def->obstacle[k];
        o->offset += def->offset;
        if (o->friction < 0) o->friction = def->friction;
        if (o->distance != plane_distance) continue;
        c->plane[k] = *(const OmContactPlane*)o->ctx;
        c->plane[k].normal = om_scale(1 / om_norm(c->plane[k].normal), c->plane[k].normal);
        o->distance = unit_plane_distance;
        o->ctx = &c->plane[k];
    }
}

OmPose om__contact_pose_at(OmPose begin, OmPose end, double t) {
    // Fractions that rounding moved off 0 or 1 give the pose at that end.
    if (t <= 1e-9) t = 0;
    if (t >= 1 - 1e-9) t = 1;
    return om_pose_lerp(begin, end, t);
}

void om__contact_begin_substep(OmContactWork* cw, double time, double h) {
    // an accepted substep is followed by one that begins later
    if (time > cw->substep_time) cw->has_settled &= cw->report.is_settled;
    cw->substep_time = time;
    double t = (time - cw->time) / cw->h;
    for (int k = 0; k < cw->contact->def.nobstacle; ++k) {
        const OmTissueObstacle* o = &cw->obstacle[k];
        OmContactFrame* f = &cw->frame[k];
        f->begin = om__contact_pose_at(o->pose_begin, o->pose_end, t);
        f->end = om__contact_pose_at(o->pose_begin, o->pose_end, t + h / cw->h);
        f->inverse_begin = om_pose_inverse(f->begin);
        f->inverse_end = om_pose_inverse(f->end);
        f->is_identity = om_pose_is_identity(o->pose_begin) && om_pose_is_identity(o->pose_end);
    }
}

double om__contact_gap(const OmContactWork* cw, int obstacle, bool is_end, OmVec3 p, OmVec3* n) {
    const OmTissueObstacle* o = &cw->obstacle[obstacle];
    const OmContactFrame* f = &cw->frame[obstacle];
    if (f->is_identity) return o->distance(o->ctx, p, n) - o->offset;
    OmVec3 local = om_pose_apply(is_end ? f->inverse_end : f->inverse_begin, p);
    double d = o->distance(o->ctx, local, n);
    *n = om_quat_rotate(is_end ? f->end.q : f->begin.q, *n);
    return d - o->offset;
}

OmVec3 om__contact_obstacle_move(const OmContactWork* cw, int obstacle, OmVec3 p) {
    const OmContactFrame* f = &cw->frame[obstacle];
    if (f->is_identity) return om_vec3(0, 0, 0);
    return om_sub(om_pose_apply(f->end, om_pose_apply(f->inverse_begin, p)), p);
}

OmStatus om_contact_work_move(OmContactWork* cw, int obstacle, OmPose begin, OmPose end) {
    OM_CHECK(obstacle >= 0 && obstacle < cw->contact->def.nobstacle, OM_INVALID,
             "contact: there is no obstacle %d; there are %d", obstacle,
             cw->contact->def.nobstacle);
    OM_CHECK(om__contact_is_pose(begin) && om__contact_is_pose(end), OM_INVALID,
             "contact: obstacle %d: a pose is not finite, or its quaternion not of unit length",
             obstacle);
    cw->obstacle[obstacle].pose_begin = begin;
    cw->obstacle[obstacle].pose_end = end;
    return OM_OK;
}

int om_contact_get_obstacles(const OmContact* c, const OmTissueObstacle** obstacle) {
    *obstacle = c->obstacle;
    return c->def.nobstacle;
}

double om_contact_eval_distance(const OmContact* c, OmVec3 p) {
    double nearest = INFINITY;
    OmVec3 n;
    for (int k = 0; k < c->def.nobstacle; ++k) {
        const OmTissueObstacle* o = &c->obstacle[k];
        OmVec3 local =
            om_pose_is_identity(o->pose_end) ? p : om_pose_apply(om_pose_inverse(o->pose_end), p);
        nearest = fmin(nearest, o->distance(o->ctx, local, &n));
    }
    return nearest;
}
