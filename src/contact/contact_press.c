// contact_press.c: a probe carried along its path: detection, the step, the report.
//
// A point of the contact surface that is near the probe, or crosses it on the way, gets a plane: through the nearest
// point of the probe where the solution is expected: x + h (v + dv), at first no farther than the probe goes and half
// an edge; where that is deep inside, through the place where its path relative to the probe enters it. A path longer
// than half the probe's thickness is looked at in pieces, so a thin probe does not slip through.
//
// A plane is right while distance and normal at the solution are those of the probe. One that is not is laid anew, and
// the step solved again: normals that lag behind a sliding probe push forwards or backwards, as friction does (21 % of
// the force up under a box in steps of 1 mm, where only the distance was compared). What the methods do with planes is
// in their own files.
#include <string.h>

#include "contact/contact_press_internal.h"

#define TOO_DEEP 0.05  // of an edge of the contact surface, by the true distance: the step is cut
#define SHORTEST (1.0 / 32)  // of a step, to which it is cut for the sake of contacts
#define PRESS_COOKIE 0x93e55u
#define REACH 0.05      // of the model's size: points farther from the probe are not looked at
#define RESTING 0.02    // of the probe's thickness: a point less deep lies on it
#define MAX_PIECES 64   // of a path
#define MOST_AHEAD 5.0  // times the last move, to where a plane is laid

OmPressDef om_press_default_def(const OmProbe* probe) {
    OmPressDef def = {.probe = probe,
                      .ntri = 1004,
                      .tolerance = 1e-4,
                      .max_iterations = 40,
                      .direction = {0, 0, -1},
                      .reach = 0.01,
                      .cookie = PRESS_COOKIE};
    return def;
}

// ---- create ---------------------------------------------------------------------------------------

static OmStatus check_def(const OmPressDef* def) {
    OM_CHECK(def->cookie == PRESS_COOKIE, OM_INVALID,
             "press: the definition was not made by om_press_default_def");
    OM_CHECK(def->probe, OM_INVALID, "press: probe is null");
    OM_CHECK(def->method >= OM_PRESS_PENALTY && def->method <= OM_PRESS_PRESCRIBED, OM_INVALID,
             "press: method %d is none of OmPressMethod", (int)def->method);
    OM_CHECK(def->surface || def->ntri == 0 || (def->ntri >= 4 && def->ntri <= 10000000),
             OM_INVALID, "press: ntri is %d; it must be 0 or from 4 to 10 million", def->ntri);
    OM_CHECK(def->stiffness == 0 || (def->stiffness >= 1e-3 && def->stiffness <= 1e9), OM_INVALID,
             "press: stiffness is %g N/m; it must be 0 or from 1e-3 to 1e9", def->stiffness);
    OM_CHECK(def->friction >= 0 && def->friction <= 10, OM_INVALID,
             "press: friction is %g; it must be from 0 to 10", def->friction);
    OM_CHECK(def->friction == 0 || def->method != OM_PRESS_PRESCRIBED, OM_INVALID,
             "press: friction is %g; a prescribed area sticks and has none", def->friction);
    OM_CHECK(def->tolerance >= 1e-12 && def->tolerance <= 0.1, OM_INVALID,
             "press: tolerance is %g; it must be from 1e-12 to 0.1", def->tolerance);
    OM_CHECK(def->max_iterations >= 1 && def->max_iterations <= 1000, OM_INVALID,
             "press: max_iterations is %d; it must be from 1 to 1000", def->max_iterations);
    OM_CHECK(
        def->reuse >= 0 && def->reuse <= 1000, OM_INVALID,
        "press: reuse is %d steps; it must be from 0 (no Delassus matrix unless needed) to 1000",
        def->reuse);
    double length = om_norm(def->direction);
    OM_CHECK(length > 1e-9 && length < 1e9, OM_INVALID,
             "press: direction (%g, %g, %g) has no direction", def->direction.x, def->direction.y,
             def->direction.z);
    OM_CHECK(def->reach > 0 && def->reach <= 10, OM_INVALID,
             "press: reach is %g m; it must be above 0 and at most 10", def->reach);
    return OM_OK;
}

static OmStatus copy_surface(const OmSurface* from, OmSurface* to) {
    OM_CHECK(from->nvert >= 1 && from->ntri >= 1 && from->x && from->tri_vert, OM_INVALID,
             "press: the contact surface has no triangles");
    for (int n = 0; n < 3 * from->nvert; ++n)
        OM_CHECK(isfinite(from->x[n]), OM_INVALID,
                 "press: vertex %d of the contact surface is not finite", n / 3);
    for (int n = 0; n < 3 * from->ntri; ++n)
        OM_CHECK(from->tri_vert[n] >= 0 && from->tri_vert[n] < from->nvert, OM_INVALID,
                 "press: triangle %d of the contact surface has vertex %d, the surface %d", n / 3,
                 from->tri_vert[n], from->nvert);
    OM_TRY(om_surface_init(to, from->nvert, from->ntri));
    memcpy(to->x, from->x, 3 * (size_t)from->nvert * sizeof(double));
    memcpy(to->tri_vert, from->tri_vert, 3 * (size_t)from->ntri * sizeof(int));
    return OM_OK;
}

static void measure_surface(OmPress* p) {
    const OmSurface* s = &p->surface;
    for (int t = 0; t < s->ntri; ++t)
        for (int k = 0; k < 3; ++k)
            p->edge += om_distance(om_load3(s->x, s->tri_vert[3 * t + k]),
                                   om_load3(s->x, s->tri_vert[3 * t + (k + 1) % 3]));
    p->edge /= 3 * s->ntri;
    const OmTetMesh* mesh = om_tissue_mesh(p->model);
    for (int i = 0; i < mesh->nvert; ++i)
        p->size = fmax(p->size, om_distance(om_load3(mesh->x, i), om_load3(mesh->x, 0)));
}

OmStatus om_press_create(const OmPressDef* def, const OmTissueModel* model, OmPress** press) {
    *press = NULL;
    OM_CHECK(def && model, OM_INVALID, "press: the definition or the model is null");
    OM_TRY(check_def(def));
    OmStatus status = OM_OK;
    OmPress* p = om_calloc(1, sizeof *p);
    if (!p) return OM_NO_MEMORY;
    p->def = *def;
    p->def.surface = NULL;
    p->def.direction = om_normalize(def->direction);
    p->model = model;
    if (def->surface)
        OM_TRY_DONE(copy_surface(def->surface, &p->surface));
    else if (def->ntri > 0)
        OM_TRY_DONE(om_contact_surface_make(om_tissue_mesh(model), def->ntri, &p->surface));
    else
        OM_TRY_DONE(om_tet_mesh_boundary(om_tissue_mesh(model), &p->surface, NULL));
    OM_TRY_DONE(om_tissue_embed(model, p->surface.nvert, p->surface.x, &p->embedding));
    size_t n = (size_t)p->surface.nvert;
    OM_CALLOC_DONE(p->touch, n);
    OM_CALLOC_DONE(p->touch_of, n);
    OM_CALLOC_DONE(p->area, n);
    OM_CALLOC_DONE(p->grip, 3 * n);
    OM_CALLOC_DONE(p->tri_area, n);
    OM_CALLOC_DONE(p->out_vert, n);
    OM_CALLOC_DONE(p->out_point, 3 * n);
    OM_CALLOC_DONE(p->out_normal, 3 * n);
    OM_CALLOC_DONE(p->out_push, 3 * n);
    OM_CALLOC_DONE(p->out_gap, n);
    OM_CALLOC_DONE(p->last, 3 * (size_t)om_tissue_mesh(model)->nvert);
    OM_CALLOC_DONE(p->way, 3 * (size_t)om_tissue_mesh(model)->nvert);
    OM_CALLOC_DONE(p->scratch, 3 * (size_t)om_tissue_mesh(model)->nvert);
    if (def->method == OM_PRESS_MULTIPLIERS) OM_TRY_DONE(om__press_lcp_create(&p->lcp));
    measure_surface(p);
    *press = p;
    return OM_OK;
done:
    om_press_destroy(p);
    return status;
}

void om_press_destroy(OmPress* p) {
    if (!p) return;
    om_surface_done(&p->surface);
    om_embedding_done(&p->embedding);
    om_free(p->touch);
    om_free(p->touch_of);
    om_free(p->area);
    om_free(p->grip);
    om_free(p->tri_area);
    om_free(p->out_vert);
    om_free(p->out_point);
    om_free(p->out_normal);
    om_free(p->out_push);
    om_free(p->out_gap);
    om_free(p->last);
    om_free(p->way);
    om_free(p->scratch);
    om__press_lcp_destroy(p->lcp);
    om_free(p);
}

OmPose om_press_pose(const OmPress* p) { return p->pose; }
const OmSurface* om_press_surface(const OmPress* p) { return &p->surface; }
const OmEmbedding* om_press_embedding(const OmPress* p) { return &p->embedding; }

// ---- points ---------------------------------------------------------------------------------------

OmVec3 om__press_point(const OmPress* p, const double* x, int i) {
    const int* v = p->embedding.tet_vert + 4 * (size_t)i;
    const double* w = p->embedding.bary + 4 * (size_t)i;
    OmVec3 sum = om_scale(w[0], om_load3(x, v[0]));
    for (int a = 1; a < 4; ++a) sum = om_madd(sum, w[a], om_load3(x, v[a]));
    return sum;
}

OmVec3 om__press_move(const OmPress* p, const OmTissueState* s, const OmTissueWork* w, int i,
                      double h) {
    return om_scale(
        h, om_add(om__press_point(p, om_tissue_v(s), i), om__press_point(p, om_tissue_dv(w), i)));
}

bool om__press_is_still(const OmPress* p, const OmTissueState* s, int i) {
    for (int a = 0; a < 4; ++a)
        if (p->embedding.bary[4 * (size_t)i + (size_t)a] != 0 &&
            !om_tissue_is_prescribed(p->model, s, p->embedding.tet_vert[4 * (size_t)i + (size_t)a]))
            return false;
    return true;
}

double om__press_stiffness(const OmPress* p, const OmTissueWork* w, int i) {
    double give = 0;
    for (int a = 0; a < 4; ++a) {
        double share = p->embedding.bary[4 * (size_t)i + (size_t)a];
        int v = p->embedding.tet_vert[4 * (size_t)i + (size_t)a];
        give += share * share / om_tissue_vertex_stiffness(w, v);  // diagonal of A: above 0
    }
    return 1 / give;  // the shares sum to 1
}

double om__press_guess_force(const OmPress* p, const OmTissueWork* w) {
    double sum = 0;
    for (int k = 0; k < p->ntouch; ++k) {
        const OmTouch* t = &p->touch[k];
        if (t->is_glued) continue;
        double in = t->is_active ? t->goal - t->gap - om_dot(t->n, t->guess) : 0;
        if (in <= 0) continue;
        double f = in * om__press_stiffness(p, w, t->point);
        for (int a = 0; a < 4; ++a) {
            double share = p->embedding.bary[4 * (size_t)t->point + (size_t)a];
            sum += share * share * f * f;
        }
    }
    return sqrt(sum);
}

OmStatus om__press_add_force(const OmPress* p, OmTissueWork* w, int i, OmVec3 f, OmMat3 K) {
    return om_tissue_add_point_force(w, p->embedding.tet_vert + 4 * (size_t)i,
                                     p->embedding.bary + 4 * (size_t)i, f, K);
}

// ---- detection ------------------------------------------------------------------------------------

static OmPose interpolate_pose(OmPose a, OmPose b, double t) {
    if (t <= 0) return a;
    if (t >= 1) return b;
    return (OmPose){om_lerp(a.p, b.p, t), om_quat_slerp(a.q, b.q, t)};
}

void om__press_path(OmPress* p, const OmTissueState* s, double h) {
    // an accepted substep is followed by one that begins later
    if (om_tissue_time(s) > p->substep_time) p->has_settled &= p->report.is_settled;
    p->substep_time = om_tissue_time(s);
    double t = (om_tissue_time(s) - p->time) / p->h, end = t + h / p->h;
    p->from = interpolate_pose(p->begin, p->end, t > 1e-9 ? t : 0);
    p->to = interpolate_pose(p->begin, p->end, end < 1 - 1e-9 ? end : 1);
    p->turn_from = om_quat_to_mat3(p->from.q);
    p->turn_to = om_quat_to_mat3(p->to.q);
}

double om__press_gap(const OmPress* p, OmVec3 x) {
    OmVec3 q = om_mat3_apply_transposed(p->turn_to, om_sub(x, p->to.p));
    return om_probe_eval_distance(p->def.probe, q, NULL);
}

double om__press_linearise(const OmPress* p, OmTouch* t, OmVec3 x) {
    OmVec3 n, q = om_mat3_apply_transposed(p->turn_to, om_sub(x, p->to.p));
    double gap = om_probe_eval_distance(p->def.probe, q, &n);
    t->n = om_mat3_apply(p->turn_to, n);
    t->at = om_sub(x, t->x);
    t->gap = gap + om_dot(t->n, om_sub(t->x, x));
    return gap;
}

// Where to lay the plane of a touch next when it was laid for a move t->at and the point went by d: laid there again
// and again, the moves converge as a geometric series where tissue is soft against push over radius; the last two
// tell its limit (a secant step for each point).
static OmVec3 predict_move(OmTouch* t, OmVec3 d) {
    OmVec3 miss = om_sub(d, t->at), next = d;
    if (t->nlaid > 0) {
        OmVec3 way = om_sub(t->at, t->was_at);
        double gain = -om_dot(om_sub(miss, t->was_miss), way), unit = om_norm2(way);
        if (gain > 1 / MOST_AHEAD * unit) next = om_madd(t->at, unit / gain, miss);
    }
    t->was_at = t->at;
    t->was_miss = miss;
    ++t->nlaid;
    return next;
}

bool om__press_bend(const OmPress* p, OmTouch* t, OmVec3 x, double lean) {
    double gap = t->gap + om_dot(t->n, om_sub(x, t->x)), mu = p->def.friction;
    if (t->is_through && fabs(gap) > 0.25 * p->def.probe->thickness) return false;
    OmTouch now = *t;
    double off = om__press_linearise(p, &now, x) - gap;
    double max = mu > 0 ? fmin(OM_PRESS_ANGLE, OM_PRESS_SHARE * mu) : OM_PRESS_ANGLE;
    if (fabs(off) < OM_PRESS_FLAT * p->size && om_distance(now.n, t->n) + lean <= max) return false;
    om__press_linearise(p, t, om_add(t->x, predict_move(t, om_sub(x, t->x))));
    return true;
}

// Where the path a -> b, in the probe's frame, first goes in; false if it does not. a is not inside.
static bool find_entry(const OmProbe* probe, OmVec3 a, OmVec3 b, OmVec3* entry) {
    double length = om_distance(a, b), lo = 0, hi = -1;
    int num = (int)fmin(MAX_PIECES, 1 + floor(length / (0.5 * probe->thickness)));
    for (int k = 1; k <= num && hi < 0; ++k) {
        double t = (double)k / num;
        if (om_probe_eval_distance(probe, om_lerp(a, b, t), NULL) < 0)
            hi = t;
        else
            lo = t;
    }
    if (hi < 0) return false;
    for (int k = 0; k < 12; ++k) {
        double t = 0.5 * (lo + hi);
        *(om_probe_eval_distance(probe, om_lerp(a, b, t), NULL) < 0 ? &hi : &lo) = t;
    }
    *entry = om_lerp(a, b, hi);
    return true;
}

// The guess for point i at x: as far as it is going, at first no farther than the probe goes and half an edge
// (`most`; below 0: as far).
static OmVec3 guess_move(const OmPress* p, const OmTissueState* s, const OmTissueWork* w, int i,
                         double h, double max) {
    if (max < 0) return om__press_move(p, s, w, i, h);
    OmVec3 d = om_scale(h, om__press_point(p, om_tissue_v(s), i));
    double far = om_norm(d);
    return far > max ? om_scale(max / far, d) : d;
}

void om__press_detect(OmPress* p, const OmTissueState* s, const OmTissueWork* w, double h) {
    const OmProbe* probe = p->def.probe;
    const double* x = om_tissue_x(s);
    OmVec3 middle = om_lerp(probe->lo, probe->hi, 0.5);
    OmVec3 middle_from = om_pose_apply(p->from, middle), middle_to = om_pose_apply(p->to, middle);
    double reach = REACH * p->size, radius = 0.5 * om_distance(probe->lo, probe->hi) + reach;
    bool is_first = om_tissue_time(s) != p->seen_time || h != p->seen_h;
    p->seen_time = om_tissue_time(s);
    p->seen_h = h;
    p->ntouch = 0;
    for (int i = 0; i < p->surface.nvert; ++i) {
        p->touch_of[i] = -1;
        OmTouch t = {.point = i, .x = om__press_point(p, x, i)};
        // far from the ball around the probe on all of the way
        OmVec3 begin_to = om_sub(t.x, middle_from);
        double begin_far = om_norm(begin_to);
        OmVec3 a = om_mat3_apply_transposed(p->turn_from, om_sub(t.x, p->from.p)), entry;
        t.slip = om_sub(om_add(p->to.p, om_mat3_apply(p->turn_to, a)), t.x);
        t.guess = guess_move(p, s, w, i, h, is_first ? om_norm(t.slip) + 0.5 * p->edge : -1);
        OmVec3 place = om_add(t.x, t.guess);
        if (begin_far > radius + om_distance(om_sub(place, middle_to), begin_to) ||
            om__press_is_still(p, s, i))
            continue;
        OmVec3 b = om_mat3_apply_transposed(p->turn_to, om_sub(place, p->to.p));
        double begin = om_probe_eval_distance(probe, a, NULL);
        double end = om_probe_eval_distance(probe, b, NULL);
        bool is_resting = begin < 0 && begin > -RESTING * probe->thickness && end < 0;
        bool is_entering = begin >= 0 && (end < 0 || om_distance(a, b) > 0.5 * probe->thickness) &&
                           find_entry(probe, a, b, &entry);
        if (!is_entering && end > reach) continue;
        if (is_resting) entry = a;
        // a point that ends near the surface slides there; one that ends deep inside may be on its way through
        bool is_near =
            end > -RESTING * probe->thickness && om_distance(a, b) < 0.5 * probe->thickness;
        bool is_at_entry = (is_entering || is_resting) && !is_near;
        OmVec3 at = is_at_entry ? om_pose_apply(p->to, entry) : place;
        om__press_linearise(p, &t, at);
        t.is_through = is_entering && end >= 0;
        t.goal = begin >= 0 ? 0 : fmin(0, begin + OM_PRESS_RECOVER * h);
        p->touch_of[i] = p->ntouch;
        p->touch[p->ntouch++] = t;
    }
}

// ---- placing --------------------------------------------------------------------------------------

static OmStatus check_pose(OmPose pose) {
    OmQuat q = pose.q;
    double n = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    OM_CHECK(om_is_finite3(pose.p) && om_norm(pose.p) < 1e6 && fabs(n - 1) < 1e-6, OM_INVALID,
             "press: the pose is not finite, or its quaternion not of unit length");
    return OM_OK;
}

OmStatus om_press_place(OmPress* p, const OmTissueModel* m, const OmTissueState* s, OmPose pose) {
    OM_CHECK(m == p->model, OM_INVALID, "press: it was made for another model");
    OM_TRY(check_pose(pose));
    if (p->def.method == OM_PRESS_PRESCRIBED) OM_TRY(om__press_take_area(p, s, pose));
    if (p->lcp) om__press_lcp_forget(p->lcp);
    p->pose = pose;
    p->is_placed = true;
    return OM_OK;
}

double om_press_eval_gap(const OmPress* p, const OmTissueState* s, OmPose pose) {
    double nearest = INFINITY;
    for (int i = 0; i < p->surface.nvert; ++i) {
        OmVec3 q = om__press_local(pose, om__press_point(p, om_tissue_x(s), i));
        nearest = fmin(nearest, om_probe_eval_distance(p->def.probe, q, NULL));
    }
    return nearest;
}

bool om__press_may_cut(const OmPress* p, double h) { return h >= 2 * SHORTEST * p->h; }

OmStatus om__press_check_depth(const OmPress* p, const OmTissueState* s, const OmTissueWork* w,
                               double h) {
    const OmProbe* probe = p->def.probe;
    OmVec3 middle = om_pose_apply(p->to, om_lerp(probe->lo, probe->hi, 0.5));
    double r = 0.5 * om_distance(probe->lo, probe->hi), deepest = 0;
    for (int i = 0; i < p->surface.nvert; ++i) {
        const OmTouch* t = p->touch_of[i] >= 0 ? &p->touch[p->touch_of[i]] : NULL;
        if (t ? t->is_glued : om__press_is_still(p, s, i)) continue;
        OmVec3 place = om_add(om__press_point(p, om_tissue_x(s), i), om__press_move(p, s, w, i, h));
        if (om_norm2(om_sub(place, middle)) > r * r) continue;
        deepest = fmax(deepest, (t ? t->goal : 0) - om__press_gap(p, place));
    }
    if (deepest <= TOO_DEEP * p->edge || !om__press_may_cut(p, h)) return OM_OK;
    return om_error(OM_INVALID, "press: a point would end %.3g mm inside the probe", 1e3 * deepest);
}

// ---- report ---------------------------------------------------------------------------------------

// A third of the triangles around each point that is pushed, as they are now.
static void measure_areas(OmPress* p, const double* x) {
    const OmSurface* s = &p->surface;
    for (int k = 0; k < p->ntouch; ++k) p->tri_area[p->touch[k].point] = 0;
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        if (p->touch_of[v[0]] < 0 && p->touch_of[v[1]] < 0 && p->touch_of[v[2]] < 0) continue;
        OmVec3 a = om__press_point(p, x, v[0]);
        OmVec3 n = om_cross(om_sub(om__press_point(p, x, v[1]), a),
                            om_sub(om__press_point(p, x, v[2]), a));
        for (int k = 0; k < 3; ++k) p->tri_area[v[k]] += om_norm(n) / 6;
    }
}

// The deepest point in the probe where it is now.
static double measure_depth(const OmPress* p, const double* x) {
    const OmProbe* probe = p->def.probe;
    OmVec3 middle = om_pose_apply(p->pose, om_lerp(probe->lo, probe->hi, 0.5));
    double r = 0.5 * om_distance(probe->lo, probe->hi), deepest = 0;
    for (int i = 0; i < p->surface.nvert; ++i) {
        OmVec3 at = om__press_point(p, x, i);
        if (om_norm2(om_sub(at, middle)) > r * r) continue;
        deepest = fmax(deepest, -om_probe_eval_distance(probe, om__press_local(p->pose, at), NULL));
    }
    return deepest;
}

// Forces into the state; what the probe feels into the report.
static void report_touches(OmPress* p, OmTissueState* s) {
    OmPressReport* r = &p->report;
    const double* x = om_tissue_x(s);
    double* f_touch = om_tissue_contact_force(s);
    memset(f_touch, 0, 3 * (size_t)om_tissue_mesh(p->model)->nvert * sizeof *f_touch);
    measure_areas(p, x);
    for (int k = 0; k < p->ntouch; ++k) {
        const OmTouch* t = &p->touch[k];
        if (om_norm2(t->force) == 0) continue;
        OmVec3 at = om__press_point(p, x, t->point), n;
        int c = r->ncontact++;
        for (int a = 0; a < 4; ++a) {
            int v = p->embedding.tet_vert[4 * (size_t)t->point + (size_t)a];
            double share = p->embedding.bary[4 * (size_t)t->point + (size_t)a];
            om_store3(f_touch, v, om_madd(om_load3(f_touch, v), share, t->force));
        }
        r->force = om_sub(r->force, t->force);
        r->torque = om_sub(r->torque, om_cross(om_sub(at, p->pose.p), t->force));
        r->area += p->tri_area[t->point];
        p->out_vert[c] = t->point;
        p->out_gap[c] = om_probe_eval_distance(p->def.probe, om__press_local(p->pose, at), &n);
        om_store3(p->out_point, c, at);
        om_store3(p->out_normal, c, om_quat_rotate(p->pose.q, n));
        om_store3(p->out_push, c, t->force);
    }
    r->penetration = measure_depth(p, x);
    r->vert = p->out_vert;
    r->point = p->out_point;
    r->normal = p->out_normal;
    r->push = p->out_push;
    r->gap = p->out_gap;
}

// ---- the step -------------------------------------------------------------------------------------

OmStatus om_press_step(OmPress* p, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                       OmPose pose_end, double h, OmPressReport* report) {
    static const OmTissueStepFn method_table[] = {om__press_penalty, om__press_multipliers,
                                                  om__press_penalty};
    p->report = (OmPressReport){0};
    if (report) *report = p->report;
    OM_CHECK(m == p->model, OM_INVALID, "press: it was made for another model");
    OM_CHECK(h > 0 && h <= 10, OM_INVALID, "press: time step is %g s; it must be in (0, 10]", h);
    OM_TRY(check_pose(pose_end));
    OM_TRY(om_tissue_reserve_points(w, p->surface.nvert));
    if (!p->is_placed) OM_TRY(om_press_place(p, m, s, pose_end));
    p->begin = p->pose;
    p->end = pose_end;
    p->time = om_tissue_time(s);
    p->h = h;
    p->seen_h = 0;
    p->substep_time = p->time;
    p->has_settled = true;
    OmTissueReport tissue;
    OmStatus status = om_tissue_step_with(m, s, w, h, method_table[p->def.method], p, &tissue);
    if (status < 0) return status;
    p->report.tissue = tissue;
    p->report.is_settled &= p->has_settled;
    p->pose = pose_end;
    report_touches(p, s);
    if (report) *report = p->report;
    if (status != OM_OK || p->report.is_settled) return status;
    return om_error(OM_NOT_CONVERGED, "press: what touches has not settled in a step of %g s", h);
}
