// contact_point.c: points of the contact surface near a probe: where they are, and the planes that replace the probe.
//
// A point that is near the probe, or crosses it on its path, gets a plane: the tangent plane of the probe at the
// predicted position x + h (v + dv). Before the first solve the prediction is limited to the probe's own displacement
// and half an edge. Where the predicted position is deep inside, the plane is that of the place where the point's
// path relative to the probe enters it. A path longer than half the probe's thickness is checked in pieces, so no point
// passes a thin probe.
//
// A plane is valid while its distance and its normal at the solution are those of the probe. A plane that is not
// valid is linearised again, and the step is solved again: normals that lag behind a sliding probe give forces
// forwards or backwards, like friction (21 % of the normal force under a box in steps of 1 mm, where only the distance
// was compared).
#include "contact/contact_press_internal.h"

#define TOO_DEEP 0.05  // of an edge of the contact surface, by the true distance: the step is cut
#define SHORTEST (1.0 / 32)    // of a step: shortest substep when contact does not converge
#define REACH 0.05             // of the model's size: points farther from the probe are ignored
#define RESTING 0.02           // of the probe's thickness: a point less deep lies on it
#define MAX_PIECES 64          // of a path
#define MAX_EXTRAPOLATION 5.0  // times the last displacement, to where a plane is linearised

OmVec3 om__press_position(const OmPress* p, const double* x, int i) {
    const int* v = p->embedding.tet_vert + 4 * (size_t)i;
    const double* w = p->embedding.bary + 4 * (size_t)i;
    OmVec3 sum = om_scale(w[0], om_load3(x, v[0]));
    for (int a = 1; a < 4; ++a) sum = om_madd(sum, w[a], om_load3(x, v[a]));
    return sum;
}

OmVec3 om__press_displacement(const OmPress* p, const OmTissueState* s, const OmTissueWork* w,
                              int i, double h) {
    return om_scale(h, om_add(om__press_position(p, om_tissue_v(s), i),
                              om__press_position(p, om_tissue_dv(w), i)));
}

double om__press_distance(const OmPress* p, OmVec3 q) {
    OmVec3 n;
    return p->def.obstacle.distance(p->def.obstacle.ctx, q, &n) - p->def.obstacle.offset;
}

bool om__press_is_still(const OmPress* p, const OmTissueState* s, int i) {
    for (int a = 0; a < 4; ++a)
        if (p->embedding.bary[4 * (size_t)i + (size_t)a] != 0 &&
            !om_tissue_is_prescribed(p->model, s, p->embedding.tet_vert[4 * (size_t)i + (size_t)a]))
            return false;
    return true;
}

double om__press_stiffness(const OmPress* p, const OmTissueWork* w, int i) {
    double compliance = 0;
    for (int a = 0; a < 4; ++a) {
        double weight = p->embedding.bary[4 * (size_t)i + (size_t)a];
        int v = p->embedding.tet_vert[4 * (size_t)i + (size_t)a];
        compliance += weight * weight / om_tissue_vertex_stiffness(w, v);  // diagonal of A: above 0
    }
    return 1 / compliance;  // the weights sum to 1
}

double om__press_estimate_force(const OmPress* p, const OmTissueWork* w) {
    double sum = 0;
    for (int k = 0; k < p->nnear; ++k) {
        const OmPressPoint* t = &p->near[k];
        if (t->is_prescribed) continue;
        double depth = t->is_active ? t->goal - t->gap - om_dot(t->n, t->predicted) : 0;
        if (depth <= 0) continue;
        double f = depth * om__press_stiffness(p, w, t->vert);
        for (int a = 0; a < 4; ++a) {
            double weight = p->embedding.bary[4 * (size_t)t->vert + (size_t)a];
            sum += weight * weight * f * f;
        }
    }
    return sqrt(sum);
}

OmStatus om__press_add_force(const OmPress* p, OmTissueWork* w, int i, OmVec3 f, OmMat3 K) {
    return om_tissue_add_point_force(w, p->embedding.tet_vert + 4 * (size_t)i,
                                     p->embedding.bary + 4 * (size_t)i, f, K);
}

// ---- detection ------------------------------------------------------------------------------------

void om__press_path(OmPress* p, const OmTissueState* s, double h) {
    // an accepted substep is followed by one that begins later
    if (om_tissue_time(s) > p->substep_time) p->has_settled &= p->report.is_settled;
    p->substep_time = om_tissue_time(s);
    double t = (om_tissue_time(s) - p->time) / p->h;
    p->from = om__contact_pose_at(p->begin, p->end, t);
    p->to = om__contact_pose_at(p->begin, p->end, t + h / p->h);
    p->turn_from = om_quat_to_mat3(p->from.q);
    p->turn_to = om_quat_to_mat3(p->to.q);
}

double om__press_gap(const OmPress* p, OmVec3 x) {
    OmVec3 q = om_mat3_apply_transposed(p->turn_to, om_sub(x, p->to.p));
    return om__press_distance(p, q);
}

double om__press_linearise(const OmPress* p, OmPressPoint* t, OmVec3 x) {
    OmVec3 n, q = om_mat3_apply_transposed(p->turn_to, om_sub(x, p->to.p));
    const OmTissueObstacle* o = &p->def.obstacle;
    double gap = o->distance(o->ctx, q, &n) - o->offset;
    t->n = om_mat3_apply(p->turn_to, n);
    t->at = om_sub(x, t->x);
    t->gap = gap + om_dot(t->n, om_sub(t->x, x));
    return gap;
}

// Displacement at which the plane of a point is linearised next, when it was linearised at t->at and the point moved
// by d. Linearised at d again and again, the displacements converge as a geometric series where the tissue is soft
// compared with the normal force over the radius; the last two give its limit (a secant step for each point).
static OmVec3 extrapolate(OmPressPoint* t, OmVec3 d) {
    OmVec3 error = om_sub(d, t->at), next = d;
    if (t->nlinear > 0) {
        OmVec3 step = om_sub(t->at, t->last_at);
        double gain = -om_dot(om_sub(error, t->last_error), step), unit = om_norm2(step);
        if (gain > 1 / MAX_EXTRAPOLATION * unit) next = om_madd(t->at, unit / gain, error);
    }
    t->last_at = t->at;
    t->last_error = error;
    ++t->nlinear;
    return next;
}

bool om__press_update_plane(const OmPress* p, OmPressPoint* t, OmVec3 x, double tilt) {
    double gap = t->gap + om_dot(t->n, om_sub(x, t->x)), mu = p->def.friction;
    if (t->is_crossing && fabs(gap) > 0.25 * p->thickness) return false;
    OmPressPoint now = *t;
    double off = om__press_linearise(p, &now, x) - gap;
    double max =
        mu > 0 ? fmin(OM_PRESS_PLANE_ANGLE, OM_PRESS_ANGLE_BY_FRICTION * mu) : OM_PRESS_PLANE_ANGLE;
    if (fabs(off) < OM_PRESS_PLANE_GAP * p->size && om_distance(now.n, t->n) + tilt <= max)
        return false;
    om__press_linearise(p, t, om_add(t->x, extrapolate(t, om_sub(x, t->x))));
    return true;
}

// Position where the path a -> b, in the probe's frame, enters the probe; false if it does not. a is outside.
static bool find_entry(const OmPress* p, OmVec3 a, OmVec3 b, OmVec3* entry) {
    double length = om_distance(a, b), lo = 0, hi = -1;
    int num = (int)fmin(MAX_PIECES, 1 + floor(length / (0.5 * p->thickness)));
    for (int k = 1; k <= num && hi < 0; ++k) {
        double t = (double)k / num;
        if (om__press_distance(p, om_lerp(a, b, t)) < 0)
            hi = t;
        else
            lo = t;
    }
    if (hi < 0) return false;
    for (int k = 0; k < 12; ++k) {
        double t = 0.5 * (lo + hi);
        *(om__press_distance(p, om_lerp(a, b, t)) < 0 ? &hi : &lo) = t;
    }
    *entry = om_lerp(a, b, hi);
    return true;
}

// Predicted displacement of point i: that of the last solution; with max >= 0 that of its velocity, limited to max.
static OmVec3 predict_displacement(const OmPress* p, const OmTissueState* s, const OmTissueWork* w,
                                   int i, double h, double max) {
    if (max < 0) return om__press_displacement(p, s, w, i, h);
    OmVec3 d = om_scale(h, om__press_position(p, om_tissue_v(s), i));
    double far = om_norm(d);
    return far > max ? om_scale(max / far, d) : d;
}

void om__press_detect(OmPress* p, const OmTissueState* s, const OmTissueWork* w, double h) {
    const double* x = om_tissue_x(s);
    OmVec3 middle_from = om_pose_apply(p->from, p->middle);
    OmVec3 middle_to = om_pose_apply(p->to, p->middle);
    double reach = REACH * p->size, radius = p->radius + reach;
    bool is_first = om_tissue_time(s) != p->detect_time || h != p->detect_h;
    p->detect_time = om_tissue_time(s);
    p->detect_h = h;
    p->nnear = 0;
    for (int i = 0; i < p->npoint; ++i) {
        p->near_of[i] = -1;
        OmPressPlace found = OM_PRESS_DEEPEST;
        if (om__press_is_sliding(p, i)) found = om__press_place(p, s, w, i, h, is_first);
        if (found == OM_PRESS_FAR) continue;
        OmPressPoint t = {
            .vert = i, .x = om__press_position(p, x, i), .is_parked = found == OM_PRESS_PARKED};
        // outside the ball around the probe on its whole path
        OmVec3 begin_to = om_sub(t.x, middle_from);
        double begin_far = om_norm(begin_to);
        OmVec3 a = om_mat3_apply_transposed(p->turn_from, om_sub(t.x, p->from.p)), entry;
        t.probe_move = om_sub(om_add(p->to.p, om_mat3_apply(p->turn_to, a)), t.x);
        t.predicted = predict_displacement(p, s, w, i, h,
                                           is_first ? om_norm(t.probe_move) + 0.5 * p->edge : -1);
        OmVec3 place = om_add(t.x, t.predicted);
        if (begin_far > radius + om_distance(om_sub(place, middle_to), begin_to) ||
            om__press_is_still(p, s, i))
            continue;
        OmVec3 b = om_mat3_apply_transposed(p->turn_to, om_sub(place, p->to.p));
        double begin = om__press_distance(p, a);
        double end = om__press_distance(p, b);
        bool is_resting = begin < 0 && begin > -RESTING * p->thickness && end < 0;
        bool is_entering = begin >= 0 && (end < 0 || om_distance(a, b) > 0.5 * p->thickness) &&
                           find_entry(p, a, b, &entry);
        if (!is_entering && end > reach) continue;
        if (is_resting) entry = a;
        // a point that ends near the surface slides there; one that ends deep inside may be crossing the probe
        bool is_near = end > -RESTING * p->thickness && om_distance(a, b) < 0.5 * p->thickness;
        bool is_at_entry = (is_entering || is_resting) && !is_near;
        OmVec3 at = is_at_entry ? om_pose_apply(p->to, entry) : place;
        om__press_linearise(p, &t, at);
        t.is_crossing = is_entering && end >= 0;
        t.goal = begin >= 0 ? 0 : fmin(0, begin + OM_PRESS_RECOVER * h);
        p->near_of[i] = p->nnear;
        p->near[p->nnear++] = t;
    }
}

bool om__press_may_cut(const OmPress* p, double h) { return h >= 2 * SHORTEST * p->h; }

OmStatus om__press_check_depth(const OmPress* p, const OmTissueState* s, const OmTissueWork* w,
                               double h) {
    OmVec3 middle = om_pose_apply(p->to, p->middle);
    double r = p->radius, deepest = 0;
    for (int i = 0; i < p->npoint; ++i) {
        const OmPressPoint* t = p->near_of[i] >= 0 ? &p->near[p->near_of[i]] : NULL;
        if (!t && om__press_is_sliding(p, i)) continue;
        if (t ? t->is_prescribed : om__press_is_still(p, s, i)) continue;
        OmVec3 place =
            om_add(om__press_position(p, om_tissue_x(s), i), om__press_displacement(p, s, w, i, h));
        if (om_norm2(om_sub(place, middle)) > r * r) continue;
        deepest = fmax(deepest, (t ? t->goal : 0) - om__press_gap(p, place));
    }
    if (deepest <= TOO_DEEP * p->edge || !om__press_may_cut(p, h)) return OM_OK;
    return om_error(OM_INVALID, "press: a point would end %.3g mm inside the probe", 1e3 * deepest);
}
