// trial_lift.c: trial grasps on one body, each from its state at rest; for calibration and search.
//
// There is no robot, no tool in the picture and no second body. The tip moves as in the loop (speed, height limit,
// folds that continue while they gain visibility); force and visibility are those of this body.
#include "trial/trial_lift.h"

#include "base/base_grow.h"

#define SETTLE_TIME 3.0
#define SETTLE_SPEED 1e-3
#define REST_TIME 0.4  // s without motion at the end of a lift or fold

OmStatus om__trial_create(const OmScene* scene, int seed, OmSiteRole role, int nworker,
                          Trial** trial) {
    *trial = NULL;
    Trial* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->scene = *scene;
    t->scene.seed = seed;
    t->speed = scene->task.speed;
    t->enough = INFINITY;
    OmSite twin = {0};  // grasping points are vertices of the twin, also in trials on the truth
    OmStatus status = om_site_build(&t->scene, role, NULL, &t->site);
    if (status < 0) goto done;
    if (role != OM_SITE_TWIN) OM_TRY_DONE(om_site_build(&t->scene, OM_SITE_TWIN, NULL, &twin));
    OM_TRY_DONE(om__grid_build(&t->scene.task, role == OM_SITE_TWIN ? &t->site : &twin, &t->grid));
    OM_TRY_DONE(om_body_create(&t->scene, &t->site, nworker, &t->body));
    OM_TRY_DONE(om_view_create_of_body(&t->scene, t->body, &t->view));
    OM_TRY_DONE(om_body_settle(t->body, t->scene.task.time_step, SETTLE_SPEED, SETTLE_TIME));
    t->rest = om_alloc(1, om_body_state_size(t->body));
    OM_CHECK_DONE(t->rest, OM_NO_MEMORY, "out of memory for a snapshot");
    om_body_save(t->body, t->rest);
    *trial = t;
    t = NULL;
done:
    om_site_done(&twin);
    om__trial_destroy(t);
    return status;
}

void om__trial_destroy(Trial* t) {
    if (!t) return;
    om_free(t->rest);
    om_view_destroy(t->view);
    om_body_destroy(t->body);
    om_site_done(&t->site);
    om_free(t);
}

static OmStatus look(Trial* t, TrialResult* c, double* now) {
    OmVisibility v;
    OM_TRY(om_view_look(t->view, om_body_x(t->body), &v));
    *now = (double)v.nseen / v.npoint;
    c->visibility = fmax(c->visibility, *now);
    return OM_OK;
}

OmStatus om__trial_grasp(Trial* t, int block, TrialResult* c, int* nheld) {
    om_body_restore(t->body, t->rest);
    return om__trial_grasp_at(t, om_pose_apply(t->grid.task, t->grid.tip[block]), c, nheld);
}

OmStatus om__trial_grasp_at(Trial* t, OmVec3 tip, TrialResult* c, int* nheld) {
    *c = (TrialResult){.trace = c->trace, .tip = tip};
    *nheld = 0;
    OmPose pose = {tip, t->grid.task.q};
    OmStatus status = om_body_grasp(t->body, t->arm, pose, t->scene.task.grasp_radius, nheld);
    return status == OM_INVALID ? OM_OK : status;  // all tissue in reach is attached
}

OmStatus om__trace_add(Trace* trace, OmVec3 tip, double force) {
    int capacity = trace->capacity;  // that of both, once both have grown
    OM_GROW(trace->tip, trace->n, capacity, 256);
    OM_GROW(trace->force, trace->n, trace->capacity, 256);
    trace->tip[trace->n] = tip;
    trace->force[trace->n++] = force;
    return OM_OK;
}

void om__trace_done(Trace* trace) {
    om_free(trace->tip);
    om_free(trace->force);
    *trace = (Trace){0};
}

// One step with the tip at a given place; `force` receives the pull. OM_NOT_CONVERGED: the step is not right.
static OmStatus step(Trial* t, OmVec3 tip, double* force) {
    OmBodyReport report;
    OmBodyForces forces;
    if (t->tick) OM_TRY(t->tick(t->tick_ctx));
    OM_TRY(om_body_move(t->body, t->arm, (OmPose){tip, t->grid.task.q}));
    OmStatus status = om_body_step(t->body, t->scene.task.time_step, &report);
    if (status < 0) return status;
    OM_TRY(om_body_get_forces(t->body, &forces));
    *force = 0;
    for (int k = 0; k < OM_MAX_ARM; ++k) *force = fmax(*force, om_norm(forces.pull[k]));
    return status;
}

OmStatus om__trial_replay(Trial* t, int n, const OmVec3* tip, double most, double* force,
                          bool* is_over) {
    int nwrong = 0;
    *is_over = false;
    for (int i = 0; i < n; ++i) {
        if (*is_over) {
            force[i] = force[i - 1];
            continue;
        }
        const OmStatus status = step(t, tip[i], &force[i]);
        if (status < 0) return status;
        nwrong = status == OM_NOT_CONVERGED ? nwrong + 1 : 0;
        *is_over = force[i] > most || nwrong == TRIAL_WRONG;
        if (nwrong > 0 && !(force[i] > most)) force[i] = NAN;
    }
    return OM_OK;
}

// Move the tip straight by `length` m, then keep it still for `rest` s. The force limit ends the motion early, and so
// does a view of enough.
static OmStatus move(Trial* t, OmVec3 direction_task, double length, double rest,
                     double force_limit, TrialResult* c) {
    OmVec3 direction = om_quat_rotate(t->grid.task.q, direction_task);
    double dt = t->scene.task.time_step, time = length / t->speed, now, gone = 0;
    OmVec3 from = c->tip;
    c->is_stopped = c->is_enough = false;
    int nstep = 0;
    for (double s = dt; s <= time + rest + 0.5 * dt; s += dt) {
        gone = fmin(s, time) * t->speed;
        c->tip = om_madd(from, gone, direction);
        double force;
        OM_TRY(step(t, c->tip, &force));
        c->force = fmax(c->force, force);
        if (c->trace) OM_TRY(om__trace_add(c->trace, c->tip, force));
        if (++nstep % LOOK_EVERY == 0) {
            OM_TRY(look(t, c, &now));
            c->is_enough = now >= t->enough;
        }
        c->is_stopped = force > force_limit;
        if (c->is_stopped || c->is_enough) break;
    }
    c->length += gone;
    return OM_OK;
}

OmStatus om__trial_lift(Trial* t, double force_limit, TrialResult* c) {
    return move(t, om_vec3(0, 0, 1), t->scene.task.max_height, REST_TIME, force_limit, c);
}

OmStatus om__trial_pull(Trial* t, double height, double force_limit, TrialResult* c) {
    const OmSceneTask* task = &t->scene.task;
    const double left = task->max_height - height;
    const bool is_last = left <= task->pull_step + 1e-9;
    return move(t, om_vec3(0, 0, 1), fmin(left, task->pull_step), is_last ? REST_TIME : 0,
                force_limit, c);
}

OmStatus om__trial_fold(Trial* t, OmPlanVerb verb, double force_limit, TrialResult* c) {
    OmVec3 tip = om_pose_apply(om_pose_inverse(t->grid.task), c->tip), direction;
    double length, before, now;
    om__fold_path(&t->grid, t->scene.task.retract, tip, verb, &direction, &length);
    if (length <= 0) return OM_OK;
    OM_TRY(move(t, direction, length - FOLD_STEP, 0, force_limit, c));
    OM_TRY(look(t, c, &now));
    do {
        if (c->is_stopped || c->is_enough) return OM_OK;
        before = now;
        OM_TRY(move(t, direction, FOLD_STEP, 0, force_limit, c));
        OM_TRY(look(t, c, &now));
    } while (now >= before + FOLD_GAIN && !c->is_enough);
    if (c->is_enough) return OM_OK;
    return move(t, direction, 0, REST_TIME, force_limit, c);
}

OmStatus om__trial_hold(Trial* t, double seconds, double* least, TrialResult* c) {
    *least = 1;
    for (double s = 0; s < seconds; s += t->scene.task.time_step) {
        double force, now;
        OM_TRY(step(t, c->tip, &force));
        OM_TRY(look(t, c, &now));
        c->force = fmax(c->force, force);
        *least = fmin(*least, now);
    }
    return OM_OK;
}

OmStatus om__trial_second_fold(Trial* t, OmPlanVerb verb, OmVec3 lifted, double force_limit,
                               TrialResult* c) {
    OmVec3 way = om_quat_rotate(om_quat_conj(t->grid.task.q), om_sub(lifted, c->tip));
    double length = om_norm(way);
    if (length > 0) OM_TRY(move(t, om_scale(1 / length, way), length, 0, INFINITY, c));
    return om__trial_fold(t, verb, force_limit, c);
}
