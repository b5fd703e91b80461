// calibrate_walk.c: move a tissue model along a path of an experiment.
//
// Between levels the tool moves at the path's speed in equal steps of at most speed * time_step. A long time
// step makes the path quasi-static with an implicit engine: with h = 1 s inertia is negligible, and steps of
// a millimetre or two are short enough. A position-based engine uses its own 0.02 s.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_tissue_internal.h"

typedef struct Walk {
    const OmTissueModel* model;
    const OmCalibrationPath* path;
    OmVec3 direction;  // unit
    OmQuat turn;       // of the tool
    OmTissueState* state;
    OmTissueWork* work;
    OmPress* press;
    OmContact* contact;  // the board below the tissue, or null
    OmContactWork* contact_work;
    // the probe, then the obstacles of the contact, for engines that handle obstacles themselves
    OmTissueObstacle* obstacle;
    bool is_begun;  // the tool is at its start
    double at;      // travel at the end of the last step, m
    OmVec3 force;   // of the tool on the tissue, N
} Walk;

OmStatus om__calibrate_check_path(const OmCalibrationPath* p, int i) {
    OM_CHECK(p->name && p->name[0], OM_INVALID, "path[%d].name is empty", i);
    OM_CHECK(p->kind >= OM_PATH_REST && p->kind <= OM_PATH_LIFT, OM_INVALID,
             "path %s: kind: no such kind, %d", p->name, (int)p->kind);
    OM_CHECK(p->nlevel >= 1 && p->level, OM_INVALID, "path %s: nothing was seen of it", p->name);
    for (int l = 0; l < p->nlevel; ++l)
        OM_CHECK(isfinite(p->level[l]) && p->level[l] >= 0 && (!l || p->level[l] > p->level[l - 1]),
                 OM_INVALID, "path %s: level[%d] is %g: they ascend from 0", p->name, l,
                 p->level[l]);
    OM_CHECK(p->time_step > 0 && p->time_step <= 1000, OM_INVALID,
             "path %s: time_step is %g: above 0 and at most 1000 s", p->name, p->time_step);
    OM_CHECK(p->settle >= 0 && p->settle <= OM_CALIBRATION_MAX_STEP * p->time_step, OM_INVALID,
             "path %s: settle: %g s are %.0f steps of %g s; 0 to %d steps are possible: settle for "
             "less, or take longer steps",
             p->name, p->settle, p->settle / p->time_step, p->time_step, OM_CALIBRATION_MAX_STEP);
    if (p->kind == OM_PATH_REST) {
        OM_CHECK(p->nlevel == 1 && p->level[0] == 0, OM_INVALID,
                 "path %s: tissue at rest has one level, 0", p->name);
        return OM_OK;
    }
    OM_CHECK(p->speed > 0 && isfinite(p->speed), OM_INVALID, "path %s: speed is %g: above 0",
             p->name, p->speed);
    double nstep = p->level[p->nlevel - 1] / (p->speed * p->time_step);
    OM_CHECK(
        nstep <= OM_CALIBRATION_MAX_STEP, OM_INVALID,
        "path %s: %g m at %g m/s take %.0f steps of %g s; at most %d are possible: take longer "
        "steps, or go faster",
        p->name, p->level[p->nlevel - 1], p->speed, nstep, p->time_step, OM_CALIBRATION_MAX_STEP);
    OM_CHECK(om_is_finite3(p->point) && om_is_finite3(p->direction) && om_norm(p->direction) > 0,
             OM_INVALID, "path %s: point and direction must be finite, the direction not zero",
             p->name);
    OM_CHECK(p->kind != OM_PATH_PRESS || p->probe, OM_INVALID, "path %s: probe is null", p->name);
    return OM_OK;
}

// z along the travel, x along the long side.
static OmQuat tool_turn(const OmCalibrationPath* p, OmVec3 direction) {
    OmVec3 z = om_scale(-1, direction), x = om_madd(p->along, -om_dot(p->along, z), z);
    if (!(om_norm(x) > 1e-6 * om_norm(p->along))) {
        OmVec3 axis = fabs(z.x) < 0.9 ? om_vec3(1, 0, 0) : om_vec3(0, 1, 0);
        x = om_madd(axis, -om_dot(axis, z), z);  // not along z: longer than 0.4
    }
    x = om_normalize(x);
    return om_quat_from_mat3(om_mat3_cols(x, om_cross(z, x), z));
}

static OmPose pose_at(const Walk* w, double travel) {
    OmPose pose = {om_madd(w->path->point, travel, w->direction), w->turn};
    return pose;
}

// A failed step says something about the parameters; the search continues.
static OmStatus judge(OmStatus status) {
    return status >= 0 ? OM_OK : status == OM_INVALID ? OM_UNSAT : status;
}

static OmStatus begin(Walk* w) {
    const OmCalibrationPath* p = w->path;
    w->is_begun = true;
    if (p->kind == OM_PATH_LIFT)
        return om_tissue_grasp(w->model, w->state, 0, pose_at(w, 0), p->radius, NULL);
    if (om_tissue_moves_itself(w->model)) return OM_OK;
    OmPressDef def = om_press_default_def(p->probe);
    def.method = p->method;
    def.ntri = p->contact_ntri;
    def.friction = p->friction;
    OM_TRY(om_press_create(&def, w->model, &w->press));
    if (w->contact) om_contact_work_set_presses(w->contact_work, 1, &w->press);
    return om_press_place(w->press, w->model, w->state, pose_at(w, 0));
}

// Set the probe and the board as obstacles of a step, for engines that handle obstacles themselves.
static OmStatus step_among(Walk* w, double travel) {
    const OmTissueObstacle* still = NULL;
    int nstill = w->contact ? om_contact_get_obstacles(w->contact, &still) : 0;
    if (nstill) memcpy(w->obstacle + 1, still, (size_t)nstill * sizeof *still);
    w->obstacle[0] =
        om_probe_obstacle(w->path->probe, pose_at(w, w->at), pose_at(w, travel), w->path->friction);
    OmStatus status = om_tissue_step_among(w->model, w->state, w->work, w->path->time_step,
                                           1 + nstill, w->obstacle, NULL);
    if (status >= 0) w->force = w->obstacle[0].force;
    return status;
}

// Step with the probe, and with the board below the tissue where there is one.
static OmStatus step_press(Walk* w, double travel) {
    double h = w->path->time_step;
    OmPose pose = pose_at(w, travel);
    OmStatus status;
    if (w->contact) {
        OM_TRY(om_press_move(w->press, pose));
        status = om_contact_step(w->contact_work, w->model, w->state, w->work, h, NULL);
    } else {
        status = om_press_step(w->press, w->model, w->state, w->work, pose, h, NULL);
    }
    if (status >= 0) w->force = om_scale(-1, om_press_report(w->press)->force);
    return status;
}

static OmStatus step(Walk* w, double travel) {
    double h = w->path->time_step;
    OmStatus status;
    if (w->is_begun && w->path->kind == OM_PATH_PRESS) {
        status = w->press ? step_press(w, travel) : step_among(w, travel);
    } else {
        if (w->is_begun) OM_TRY(om_tissue_move_grasp(w->state, 0, pose_at(w, travel)));
        status = w->contact ? om_contact_step(w->contact_work, w->model, w->state, w->work, h, NULL)
                            : om_tissue_step(w->model, w->state, w->work, h, NULL);
    }
    w->at = travel;
    return judge(status);
}

static OmStatus settle(Walk* w, double travel) {
    int n = (int)ceil(w->path->settle / w->path->time_step - 1e-9);
    for (int i = 0; i < n; ++i) {
        OmStatus status = step(w, travel);
        if (status != OM_OK) return status;
    }
    return OM_OK;
}

static OmStatus go(Walk* w, double from, double to) {
    if (!(to > from)) return OM_OK;
    int n = (int)ceil((to - from) / (w->path->speed * w->path->time_step) - 1e-9);
    n = n > 1 ? n : 1;
    for (int i = 1; i <= n; ++i) {
        OmStatus status = step(w, from + (to - from) * i / n);
        if (status != OM_OK) return status;
    }
    return settle(w, to);
}

static OmStatus read_force(Walk* w) {
    if (w->path->kind != OM_PATH_LIFT || !w->is_begun) return OM_OK;
    OmTissueForces f;
    OM_TRY(om_tissue_get_forces(w->model, w->state, &f));
    w->force = f.grasp[0];
    return OM_OK;
}

static OmStatus walk(Walk* w, OmWalkFn fn, void* ctx) {
    const OmCalibrationPath* p = w->path;
    double at = 0;
    OmStatus status = settle(w, 0);
    for (int l = 0; l < p->nlevel && status == OM_OK; ++l) {
        if (p->level[l] > 0 && !w->is_begun) status = begin(w);
        if (status == OM_OK) status = go(w, at, p->level[l]);
        if (status == OM_OK) status = read_force(w);
        if (status == OM_OK) status = fn(ctx, l, om_tissue_x(w->state), w->force);
        at = p->level[l];
    }
    return status;
}

OmStatus om__calibrate_walk(const OmTissueModel* model, const OmCalibrationPath* path,
                            const OmContactDef* contact, OmWalkFn fn, void* ctx) {
    Walk w = {.model = model, .path = path};
    if (path->kind != OM_PATH_REST) {
        w.direction = om_normalize(path->direction);
        w.turn = tool_turn(path, w.direction);
    }
    OmStatus status = om_tissue_state_create(model, &w.state);
    if (status == OM_OK) status = om_tissue_work_create(model, &w.work);
    if (status == OM_OK && contact) status = om_contact_create(contact, model, &w.contact);
    if (status == OM_OK && contact) status = om_contact_work_create(w.contact, &w.contact_work);
    if (status == OM_OK && path->kind == OM_PATH_PRESS && om_tissue_moves_itself(model)) {
        const OmTissueObstacle* still;
        int n = 1 + (w.contact ? om_contact_get_obstacles(w.contact, &still) : 0);
        w.obstacle = om_alloc((size_t)n, sizeof *w.obstacle);
        if (!w.obstacle) status = OM_NO_MEMORY;
    }
    if (status == OM_OK) status = walk(&w, fn, ctx);
    om_free(w.obstacle);
    om_contact_work_destroy(w.contact_work);
    om_contact_destroy(w.contact);
    om_press_destroy(w.press);
    om_tissue_work_destroy(w.work);
    om_tissue_state_destroy(w.state);
    return status < 0 ? om_error_prefix(status, "path %s", path->name) : status;
}
