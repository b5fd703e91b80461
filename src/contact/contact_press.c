// contact_press.c: a probe with its contact surface: definition, memory, pose, report.
#include <string.h>

#include "contact/contact_press_internal.h"

#define PRESS_COOKIE 0x93e55u

OmPressDef om_press_default_def(const OmProbe* probe) {
    OmPressDef def = {.ntri = 1004,
                      .tolerance = 1e-4,
                      .max_iterations = 40,
                      .direction = {0, 0, -1},
                      .reach = 0.01,
                      .cookie = PRESS_COOKIE};
    if (probe) def.obstacle = om_probe_obstacle(probe, om_pose_identity(), om_pose_identity(), 0);
    return def;
}

// ---- create ---------------------------------------------------------------------------------------

static OmStatus check_def(const OmPressDef* def) {
    OM_CHECK(def->cookie == PRESS_COOKIE, OM_INVALID,
             "press: the definition was not made by om_press_default_def");
    OM_CHECK(def->obstacle.distance, OM_INVALID, "press: probe is null: obstacle.distance");
    OM_CHECK(def->method >= OM_PRESS_PENALTY && def->method <= OM_PRESS_PRESCRIBED, OM_INVALID,
             "press: method %d is none of OmPressMethod", (int)def->method);
    OM_CHECK(def->surface || def->ntri == 0 || (def->ntri >= 4 && def->ntri <= 10000000),
             OM_INVALID, "press: ntri is %d; it must be 0 or from 4 to 10 million", def->ntri);
    OM_CHECK(!def->has_face_contact || (def->method == OM_PRESS_PENALTY && !def->surface),
             OM_INVALID,
             "press: contact of faces is of the penalty method, on the boundary of the volume: set "
             "method to OM_PRESS_PENALTY and surface to null");
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
    OM_CHECK(!def->has_face_contact || om_tissue_mesh(model)->ntet > 0, OM_INVALID,
             "press: contact of faces needs a model with tetrahedra");
    OmStatus status = OM_OK;
    OmPress* p = om_calloc(1, sizeof *p);
    if (!p) return OM_NO_MEMORY;
    p->def = *def;
    p->def.surface = NULL;
    p->def.direction = om_normalize(def->direction);
    p->model = model;
    const OmTissueObstacle* o = &def->obstacle;
    p->thickness = o->thickness > 0 ? o->thickness : (double)INFINITY;
    p->radius = o->has_bounds ? 0.5 * om_distance(o->lo, o->hi) : (double)INFINITY;
    if (o->has_bounds) p->middle = om_lerp(o->lo, o->hi, 0.5);
    if (def->has_face_contact)
        OM_TRY_DONE(om__press_make_faces(p));
    else if (def->surface)
        OM_TRY_DONE(copy_surface(def->surface, &p->surface));
    else if (def->ntri > 0)
        OM_TRY_DONE(om_contact_surface_make(om_tissue_mesh(model), def->ntri, &p->surface));
    else
        OM_TRY_DONE(om_tet_mesh_boundary(om_tissue_mesh(model), &p->surface, NULL));
    if (!def->has_face_contact) {
        OM_TRY_DONE(om_tissue_embed(model, p->surface.nvert, p->surface.x, &p->embedding));
        p->npoint = p->surface.nvert;
    }
    size_t n = (size_t)p->npoint;
    OM_CALLOC_DONE(p->near, n);
    OM_CALLOC_DONE(p->near_of, n);
    OM_CALLOC_DONE(p->area, n);
    OM_CALLOC_DONE(p->area_place, 3 * n);
    OM_CALLOC_DONE(p->tri_area, n);
    OM_CALLOC_DONE(p->out_vert, n);
    OM_CALLOC_DONE(p->out_point, 3 * n);
    OM_CALLOC_DONE(p->out_normal, 3 * n);
    OM_CALLOC_DONE(p->out_push, 3 * n);
    OM_CALLOC_DONE(p->out_gap, n);
    OM_CALLOC_DONE(p->last, 3 * (size_t)om_tissue_mesh(model)->nvert);
    OM_CALLOC_DONE(p->increment, 3 * (size_t)om_tissue_mesh(model)->nvert);
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
    om_free(p->near);
    om_free(p->near_of);
    om_free(p->area);
    om_free(p->area_place);
    om_free(p->tri_area);
    om_free(p->out_vert);
    om_free(p->out_point);
    om_free(p->out_normal);
    om_free(p->out_push);
    om_free(p->out_gap);
    om_free(p->last);
    om_free(p->increment);
    om_free(p->scratch);
    om__press_lcp_destroy(p->lcp);
    om_free(p);
}

OmPose om_press_pose(const OmPress* p) { return p->pose; }
const OmSurface* om_press_surface(const OmPress* p) { return &p->surface; }
const OmPressReport* om_press_report(const OmPress* p) { return &p->report; }
const OmEmbedding* om_press_embedding(const OmPress* p) { return &p->embedding; }

// ---- placing --------------------------------------------------------------------------------------

OmStatus om__press_check_pose(OmPose pose) {
    OM_CHECK(om__contact_is_pose(pose), OM_INVALID,
             "press: the pose is not finite, or its quaternion not of unit length");
    return OM_OK;
}

OmStatus om_press_place(OmPress* p, const OmTissueModel* m, const OmTissueState* s, OmPose pose) {
    OM_CHECK(m == p->model, OM_INVALID, "press: it was made for another model");
    OM_TRY(om__press_check_pose(pose));
    if (p->def.method == OM_PRESS_PRESCRIBED) OM_TRY(om__press_select_area(p, s, pose));
    if (p->lcp) om__press_lcp_forget(p->lcp);
    p->pose = p->goal = pose;
    p->is_placed = true;
    return OM_OK;
}

OmStatus om_press_move(OmPress* p, OmPose pose_end) {
    OM_TRY(om__press_check_pose(pose_end));
    p->goal = pose_end;
    p->has_goal = true;
    return OM_OK;
}

double om_press_eval_gap(const OmPress* p, const OmTissueState* s, OmPose pose) {
    double nearest = INFINITY;
    for (int i = 0; i < p->surface.nvert; ++i) {
        OmVec3 q = om__press_local(pose, om__press_position(p, om_tissue_x(s), i));
        nearest = fmin(nearest, om__press_distance(p, q));
    }
    return nearest;
}

// ---- report ---------------------------------------------------------------------------------------

// A third of the triangles around each pushed point, in the current shape.
static void measure_areas(OmPress* p, const double* x) {
    const OmSurface* s = &p->surface;
    for (int k = 0; k < p->nnear; ++k) p->tri_area[p->near[k].vert] = 0;
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        if (p->near_of[v[0]] < 0 && p->near_of[v[1]] < 0 && p->near_of[v[2]] < 0) continue;
        OmVec3 a = om__press_position(p, x, v[0]);
        OmVec3 n = om_cross(om_sub(om__press_position(p, x, v[1]), a),
                            om_sub(om__press_position(p, x, v[2]), a));
        for (int k = 0; k < 3; ++k) p->tri_area[v[k]] += om_norm(n) / 6;
    }
}

// The deepest point in the probe where it is now.
static double measure_depth(const OmPress* p, const double* x) {
    OmVec3 middle = om_pose_apply(p->pose, p->middle);
    double r = p->radius, deepest = 0;
    for (int i = 0; i < p->surface.nvert; ++i) {
        OmVec3 at = om__press_position(p, x, i);
        if (om_norm2(om_sub(at, middle)) > r * r) continue;
        deepest = fmax(deepest, -om__press_distance(p, om__press_local(p->pose, at)));
    }
    for (int k = 0; k < p->nnear; ++k) {
        int i = p->near[k].vert;
        if (!om__press_is_sliding(p, i)) continue;
        OmVec3 at = om__press_position(p, x, i);
        deepest = fmax(deepest, -om__press_distance(p, om__press_local(p->pose, at)));
    }
    return deepest;
}

void om__press_write_forces(const OmPress* p, OmTissueState* s) {
    double* f_contact = om_tissue_contact_force(s);
    for (int k = 0; k < p->nnear; ++k) {
        const OmPressPoint* t = &p->near[k];
        if (om_norm2(t->force) == 0) continue;
        for (int a = 0; a < 4; ++a) {
            int v = p->embedding.tet_vert[4 * (size_t)t->vert + (size_t)a];
            double weight = p->embedding.bary[4 * (size_t)t->vert + (size_t)a];
            om_store3(f_contact, v, om_madd(om_load3(f_contact, v), weight, t->force));
        }
    }
}

void om__press_report_points(OmPress* p, const OmTissueState* s) {
    OmPressReport* r = &p->report;
    const double* x = om_tissue_x(s);
    measure_areas(p, x);
    for (int k = 0; k < p->nnear; ++k) {
        const OmPressPoint* t = &p->near[k];
        if (om_norm2(t->force) == 0) continue;
        OmVec3 at = om__press_position(p, x, t->vert), n;
        int c = r->ncontact++;
        r->force = om_sub(r->force, t->force);
        r->torque = om_sub(r->torque, om_cross(om_sub(at, p->pose.p), t->force));
        r->area += p->tri_area[t->vert];
        p->out_vert[c] = om__press_is_sliding(p, t->vert) ? -1 : t->vert;
        const OmTissueObstacle* o = &p->def.obstacle;
        p->out_gap[c] = o->distance(o->ctx, om__press_local(p->pose, at), &n) - o->offset;
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
