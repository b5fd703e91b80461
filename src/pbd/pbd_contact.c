// pbd_contact.c: particles out of rigid obstacles, with Coulomb's friction.
//
// In each substep a particle asks an obstacle once, where it was and where it is predicted; if it is near it keeps
// out of the tangent plane there, and asks again in the last iteration, if that plane says it may touch. What
// began a substep inside comes out with recover_speed, so that an obstacle put into tissue does not throw it.
// Friction takes back slip against the moving surface, in a substep no more than the coefficient times the depth
// pushed out. Pushes, m d / sub^2, sum to the momentum that obstacles gave.
#include <string.h>

#include "pbd/pbd_internal.h"

#define SLACK 0.5    // of the spacing: largest motion of a far particle by iterations
#define MARGIN 0.02  // of a cluster's spacing: how much a plane may overrate a gap

OmStatus om__pbd_reserve(OmPbdWork* w, int nvert, int nobstacle) {
    if (nobstacle <= w->max_obstacle) return OM_OK;
    size_t n = (size_t)nvert * (size_t)nobstacle;
    double* gap_goal = om_alloc(n, sizeof *gap_goal);
    double* plane = om_alloc(n, 4 * sizeof *plane);
    unsigned char* is_near = om_alloc(n, 1);
    double* push = om_alloc(n, 3 * sizeof *push);
    OmPbdFrame* frame = om_alloc((size_t)nobstacle, sizeof *frame);
    if (!gap_goal || !plane || !is_near || !push || !frame) {
        om_free(gap_goal);
        om_free(plane);
        om_free(is_near);
        om_free(push);
        om_free(frame);
        return OM_NO_MEMORY;
    }
    om_free(w->gap_goal);
    om_free(w->plane);
    om_free(w->is_near);
    om_free(w->push);
    om_free(w->frame);
    w->gap_goal = gap_goal;
    w->plane = plane;
    w->is_near = is_near;
    w->push = push;
    w->frame = frame;
    size_t add = (size_t)(nobstacle - w->max_obstacle);
    w->size += add * ((size_t)nvert * (8 * sizeof(double) + 1) + sizeof *frame);
    w->max_obstacle = nobstacle;
    return OM_OK;
}

void om__pbd_move_obstacles(OmPbdStep* s) {
    double n = s->nsub;
    for (int k = 0; k < s->nobstacle; ++k) {
        const OmTissueObstacle* o = &s->obstacle[k];
        OmPbdFrame* f = &s->w->frame[k];
        f->begin = om_pose_lerp(o->pose_begin, o->pose_end, s->k / n);
        f->end = om_pose_lerp(o->pose_begin, o->pose_end, (s->k + 1) / n);
        f->inverse_begin = om_pose_inverse(f->begin);
        f->inverse_end = om_pose_inverse(f->end);
        f->friction = o->friction < 0 ? s->pbd->def.friction : o->friction;
        f->is_still = om_pose_is_identity(o->pose_begin) && om_pose_is_identity(o->pose_end);
    }
}

// Gap of world point p to obstacle k, at the end of the substep or its beginning; the normal in the world.
static double gap_of(const OmPbdStep* s, int k, bool is_end, OmVec3 p, OmVec3* n) {
    const OmTissueObstacle* o = &s->obstacle[k];
    const OmPbdFrame* f = &s->w->frame[k];
    double d;
    if (f->is_still) {
        d = o->distance(o->ctx, p, n);
    } else {
        d = o->distance(o->ctx, om_pose_apply(is_end ? f->inverse_end : f->inverse_begin, p), n);
        *n = om_quat_rotate(is_end ? f->end.q : f->begin.q, *n);
    }
    if (!isfinite(d) || !om_is_finite3(*n)) return INFINITY;
    return d - o->offset - s->pbd->def.collision_distance;
}

bool om__pbd_find_near(OmPbdStep* s, int i) {
    int nvert = s->m->mesh.nvert;
    OmVec3 p = om_load3(s->x, i), b = om_load3(s->w->begin, i), n;
    double slack = SLACK * s->pbd->def.cluster_spacing + om_distance(p, b);
    bool is_any = false;
    for (int k = 0; k < s->nobstacle; ++k) {
        size_t at = (size_t)k * (size_t)nvert + (size_t)i;
        double gap = gap_of(s, k, true, p, &n);
        s->w->is_near[at] = gap < slack;
        if (!s->w->is_near[at]) continue;
        is_any = true;
        om_store3(s->w->plane + 4 * at, 0, n);
        s->w->plane[4 * at + 3] = gap - om_dot(n, p);
        double begin = gap_of(s, k, false, b, &n);
        s->w->gap_goal[at] = fmin(0, begin + s->pbd->def.recover_speed * s->sub);
    }
    if (is_any) s->w->normal_sum[i] = s->w->friction_sum[i] = 0;
    return is_any;
}

void om__pbd_push_out(OmPbdStep* s, int i, bool is_last) {
    OmPbdWork* w = s->w;
    double margin = MARGIN * s->pbd->def.cluster_spacing;
    for (int k = 0; k < s->nobstacle; ++k) {
        size_t at = (size_t)k * (size_t)s->m->mesh.nvert + (size_t)i;
        if (!w->is_near[at]) continue;
        const double* plane = w->plane + 4 * at;
        OmVec3 p = om_load3(s->x, i), n = om_load3(plane, 0);
        double depth = w->gap_goal[at] - om_dot(n, p) - plane[3];
        if (is_last && depth > -margin) depth = w->gap_goal[at] - gap_of(s, k, true, p, &n);
        if (!(depth > 0)) continue;
        OmVec3 d = om_scale(depth, n);
        w->normal_sum[i] += depth;
        // slip against the surface, which moved from where the same material point was
        const OmPbdFrame* f = &w->frame[k];
        OmVec3 was = f->is_still ? p : om_pose_apply(f->begin, om_pose_apply(f->inverse_end, p));
        OmVec3 slip = om_sub(was, om_load3(w->begin, i));
        slip = om_madd(slip, -om_dot(slip, n), n);
        double length = om_norm(slip),
               allowed = f->friction * w->normal_sum[i] - w->friction_sum[i];
        double back = length < allowed ? length : allowed;
        if (back > 0) {
            d = om_madd(d, -back / length, slip);
            w->friction_sum[i] += back;
        }
        om_store3(s->x, i, om_add(p, d));
        double* push = w->push + 3 * at;
        om_store3(push, 0, om_madd(om_load3(push, 0), s->m->mass[i] / (s->sub * s->h), d));
    }
}

void om__pbd_report_contacts(OmPbdStep* s) {
    int nvert = s->m->mesh.nvert;
    double* touch = om__state_array(s->s, OM__F_TOUCH);
    memset(touch, 0, 3 * (size_t)nvert * sizeof *touch);
    for (int k = 0; k < s->nobstacle; ++k) {
        OmTissueObstacle* o = &s->obstacle[k];
        for (int i = 0; i < nvert; ++i) {
            size_t at = (size_t)k * (size_t)nvert + (size_t)i;
            OmVec3 f = om_load3(s->w->push, (int)at), p = om_load3(s->x, i), n;
            if (om_norm2(f) == 0) continue;
            o->force = om_add(o->force, f);
            o->torque = om_add(o->torque, om_cross(om_sub(p, o->pose_end.p), f));
            om_store3(touch, i, om_add(om_load3(touch, i), f));
            double depth = -gap_of(s, k, true, p, &n);
            o->penetration = fmax(o->penetration, depth);
            ++o->ncontact;
        }
    }
}
