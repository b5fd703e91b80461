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

double om__contact_gap(const OmContact* c, int obstacle, OmVec3 p, OmVec3* n) {
    const OmTissueObstacle* o = &c->obstacle[obstacle];
    return o->distance(o->ctx, p, n) - o->offset;
}

int om_contact_get_obstacles(const OmContact* c, const OmTissueObstacle** obstacle) {
    *obstacle = c->obstacle;
    return c->def.nobstacle;
}

double om_contact_eval_distance(const OmContact* c, OmVec3 p) {
    double nearest = INFINITY;
    OmVec3 n;
    for (int k = 0; k < c->def.nobstacle; ++k)
        nearest = fmin(nearest, om__contact_gap(c, k, p, &n) + c->obstacle[k].offset);
    return nearest;
}
