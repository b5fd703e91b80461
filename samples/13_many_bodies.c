// 13_many_bodies.c: one model, many bodies: 24 sheets are pulled in 24 directions, several at once.
//
// The model of a body (mesh, material, contact with the board) is constant and shared by all threads. Each body has a
// state, each thread a work. A body gives the same bytes whichever thread steps it, so one worker gives the same hash.
#include <stdio.h>

#include "omentum/omentum.h"

#define NBODY 24
#define NSTEP 40
#define MAX_WORK 8

typedef struct Farm {
    OmBodyModel* model;
    OmBody* body[NBODY];
    OmBodyWork* work[MAX_WORK];
    OmPose start;  // of the tool, where it grasps
} Farm;

// Goal of body k at step i: 10 mm upwards and 10 mm sideways in the end, a direction for each body.
static OmPose goal_of(const Farm* farm, int k, int i) {
    double angle = 2 * OM_PI * k / NBODY, t = (i + 1.0) / NSTEP;
    OmPose goal = farm->start;
    goal.p = om_madd(goal.p, t, om_vec3(0.01 * cos(angle), 0.01 * sin(angle), 0.01));
    return goal;
}

// All bodies from rest; the hash of all states.
static OmStatus run(Farm* farm, int nwork, uint64_t* hash) {
    OmStatus status = OM_OK, each[NBODY];
    double min = 1e30, max = 0, begin = om_clock_now();
    for (int k = 0; k < NBODY && status >= 0; ++k) {
        om_body_reset(farm->body[k]);
        status = om_body_grasp(farm->body[k], 0, farm->start, 0.01, NULL);
    }
    for (int i = 0; i < NSTEP && status >= 0; ++i) {
        for (int k = 0; k < NBODY && status >= 0; ++k)
            status = om_body_move(farm->body[k], 0, goal_of(farm, k, i));
        if (status >= 0)
            status = om_body_step_many(NBODY, farm->body, nwork, farm->work, 0.02, each);
    }
    double s = om_clock_now() - begin;
    *hash = OM_HASH_SEED;
    for (int k = 0; k < NBODY && status >= 0; ++k) {
        OmBodyForces f;
        uint64_t h = om_body_hash(farm->body[k]);
        *hash = om_hash(&h, sizeof h, *hash);
        status = om_body_get_forces(farm->body[k], &f);
        double force = om_norm(f.grasp[0]);
        min = force < min ? force : min;
        max = force > max ? force : max;
    }
    if (status < 0) return status;
    printf("%d bodies x %d steps, %d works: %.2f s, forces from %.3f to %.3f N, hash %016llx\n",
           NBODY, NSTEP, nwork, s, min, max, (unsigned long long)*hash);
    return OM_OK;
}

static OmStatus create(Farm* farm, const OmScene* scene, const OmSite* site, int nwork) {
    OmStatus status = om_body_model_create(scene, site, 1, &farm->model);
    for (int k = 0; k < nwork && status >= 0; ++k)
        status = om_body_work_create(farm->model, &farm->work[k]);
    for (int k = 0; k < NBODY && status >= 0; ++k)
        status = om_body_create_shared(farm->model, NULL, &farm->body[k]);
    if (status >= 0) printf("a body takes %zu bytes\n", om_body_state_size(farm->body[0]));
    return status;
}

static void destroy(Farm* farm) {
    for (int k = 0; k < NBODY; ++k) om_body_destroy(farm->body[k]);
    for (int k = 0; k < MAX_WORK; ++k) om_body_work_destroy(farm->work[k]);
    om_body_model_destroy(farm->model);
}

int main(void) {
    OmScene scene = om_scene_default();
    scene.tissue.size = om_vec3(0.06, 0.06, 0.003);
    scene.tissue.cells = om_vec3(10, 10, 1);
    scene.tissue.element = OM_ELEMENT_LINEAR;  // smaller than by default: some seconds
    scene.attach.kind = OM_ATTACH_BOX;         // one side of the sheet
    scene.attach.lo = om_vec3(-0.031, -0.031, -0.01);
    scene.attach.hi = om_vec3(-0.024, 0.031, 0.01);
    OmSite site = {0};
    Farm farm = {0};
    uint64_t one = 0, many = 1;
    int nwork = om_worker_count(0) < MAX_WORK ? om_worker_count(0) : MAX_WORK;
    OmStatus status = om_site_build(&scene, OM_SITE_TWIN, NULL, &site);
    farm.start = site.pose_world_task;
    farm.start.p = om_pose_apply(site.pose_world_task, om_vec3(0.03, 0, 0.003));
    if (status >= 0) status = create(&farm, &scene, &site, nwork);
    if (status >= 0) status = run(&farm, 1, &one);
    if (status >= 0) status = run(&farm, nwork, &many);
    if (status < 0) fprintf(stderr, "%s: %s\n", om_status_text(status), om_error_message());
    destroy(&farm);
    om_site_done(&site);
    return status >= 0 && one == many ? 0 : 1;
}
