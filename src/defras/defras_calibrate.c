// defras_calibrate.c: the force threshold of a scene, by what pulling its tissue takes (6.5.1).
//
// The twin alone: every block of every layout is grasped at rest and lifted straight to the height limit
// at the task's speed, whatever the force. The threshold is twice the median of the largest pulls. Layouts
// run in parallel, each alone in its thread, and their results are put in order of layout and block.
#include <string.h>

#include "defras/defras_internal.h"

#define SETTLE_TIME 3.0
#define SETTLE_SPEED 1e-3
#define HOLD_TIME 0.4  // s at the top

typedef struct Outcome {  // messages belong to a thread: they are carried home
    OmStatus status;
    char message[512];
} Outcome;

typedef struct Calibration {
    const OmScene* scene;
    double* largest;   // N, -1 where nothing was held (nlayout x nblock)
    Outcome* outcome;  // of each layout
    int nblock, nlayout;
    int first;  // layout of the round under way
} Calibration;

// Lift one block from the settled state; the largest pull on the way.
static OmStatus lift_block(const OmScene* scene, const Grid* grid, OmBody* body, int block,
                           double* largest) {
    *largest = -1;
    OmVec3 tip = om_load3(om_body_x(body), grid->vert[block]);
    OmPose pose = {tip, grid->task.q};
    int nheld;
    OmStatus status = om_body_grasp(body, 0, pose, scene->task.grasp_radius, &nheld);
    if (status == OM_INVALID) return OM_OK;  // only attached tissue in reach
    OM_TRY(status);
    OmVec3 up = om_quat_rotate(grid->task.q, om_vec3(0, 0, 1));
    double dt = scene->task.time_step, time = scene->task.max_height / scene->task.speed;
    *largest = 0;
    for (double t = dt; t <= time + HOLD_TIME; t += dt) {
        pose.p = om_madd(tip, fmin(t, time) * scene->task.speed, up);
        OmBodyReport report;
        OmBodyForces forces;
        OM_TRY(om_body_move(body, 0, pose));
        OM_TRY(om_body_step(body, dt, &report));
        OM_TRY(om_body_get_forces(body, &forces));
        *largest = fmax(*largest, om_norm(forces.pull[0]));
    }
    return OM_OK;
}

static OmStatus run_layout(Calibration* c, int layout) {
    OmScene scene = *c->scene;
    scene.seed = layout + 1;
    OmSite site = {0};
    OmBody* body = NULL;
    Grid* grid = NULL;
    void* rest = NULL;
    OmStatus status = om_site_build(&scene, OM_SITE_TWIN, NULL, &site);
    if (status < 0) goto done;
    OM_CALLOC_DONE(grid, 1);
    OM_TRY_DONE(om_body_create(&scene, &site, 1, &body));
    OM_TRY_DONE(om__grid_build(&scene, &site, grid));
    OM_TRY_DONE(om_body_settle(body, scene.task.time_step, SETTLE_SPEED, SETTLE_TIME));
    rest = om_alloc(1, om_body_state_size(body));
    OM_CHECK_DONE(rest, OM_NO_MEMORY, "out of memory for a snapshot");
    om_body_save(body, rest);
    for (int b = 0; b < c->nblock; ++b) {
        double* largest = &c->largest[layout * c->nblock + b];
        *largest = -1;
        if (grid->vert[b] < 0) continue;
        om_body_restore(body, rest);
        OM_TRY_DONE(lift_block(&scene, grid, body, b, largest));
    }
done:
    om_free(rest);
    om_free(grid);
    om_body_destroy(body);
    om_site_done(&site);
    return status;
}

static void run_layouts(void* ctx, int begin, int end, int block) {
    (void)block;
    Calibration* c = ctx;
    for (int i = begin; i < end; ++i) {
        Outcome* o = &c->outcome[c->first + i];
        o->status = run_layout(c, c->first + i);
        if (o->status < 0) snprintf(o->message, sizeof o->message, "%s", om_error_message());
    }
}

static OmStatus summarise(Calibration* c, OmForceCalibration* out) {
    int n = 0;
    for (int i = 0; i < c->nlayout * c->nblock; ++i) {
        if (c->largest[i] >= 0) c->largest[n++] = c->largest[i];
    }
    OM_CHECK(n > 0, OM_INVALID, "%s: no grasping point of any layout can be grasped",
             c->scene->path);
    om_sort_doubles(c->largest, n);
    *out = (OmForceCalibration){.nrun = n,
                                .median = 0.5 * (c->largest[(n - 1) / 2] + c->largest[n / 2]),
                                .lower_quartile = c->largest[n / 4],
                                .upper_quartile = c->largest[(3 * n) / 4 < n ? (3 * n) / 4 : n - 1],
                                .max = c->largest[n - 1]};
    out->threshold = 2 * out->median;
    return OM_OK;
}

OmStatus om_retract_calibrate_force(const OmScene* scene, int nlayout, int nworker,
                                    const OmProgress* progress, OmForceCalibration* calibration) {
    memset(calibration, 0, sizeof *calibration);
    OM_CHECK(nlayout >= 1 && nlayout <= 10000, OM_INVALID, "%d layouts; 1 to 10000", nlayout);
    Calibration c = {
        .scene = scene, .nlayout = nlayout, .nblock = scene->task.grid * scene->task.grid};
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(c.largest, (size_t)nlayout * (size_t)c.nblock);
    OM_CALLOC_DONE(c.outcome, nlayout);
    // A round of as many layouts as workers at a time: progress is told, and cancelling heard, between.
    int worker = om_worker_count(nworker);
    for (; c.first < nlayout; c.first += worker) {
        OM_TRY_DONE(om_progress_report(progress, "calibrating force", c.first, nlayout));
        int n = nlayout - c.first < worker ? nlayout - c.first : worker;
        om_parallel_for(worker, n, 1, run_layouts, &c);
        for (int i = c.first; i < c.first + n; ++i) {
            OM_CHECK_DONE(c.outcome[i].status >= 0, c.outcome[i].status, "layout %d: %s", i + 1,
                          c.outcome[i].message);
        }
    }
    status = summarise(&c, calibration);
done:
    om_free(c.largest);
    om_free(c.outcome);
    return status;
}
