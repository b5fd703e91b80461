// world_simulated.c: a simulated operating field: tissue of its own, two PSMs, an endoscope, a depth camera.
//
// The arms stand on either side, remote centres above the tissue's edges, tools pointing down; the endoscope
// looks from -x of the task frame, the depth camera from the opposite side, as on the thesis's bench
// (6.5.1). What is measured is noisy: tool positions by a normal offset, depth by its range.
#include <string.h>

#include "omentum/robot.h"
#include "omentum/sense.h"
#include "omentum/world.h"
#include "world/world_view.h"

#define JAW_CLOSED (20.0 * OM_PI / 180.0)  // below: tissue is held (Alg. 4)
#define JAW_SPEED 3.0                      // rad/s
#define JAW_START (40.0 * OM_PI / 180.0)
#define RCM_HEIGHT 0.13   // m over the board
#define RCM_OUT 0.045     // m beyond the tissue's edge
#define PARK_HEIGHT 0.07  // m, where the tools wait

typedef struct Arm {
    OmPsm psm;
    double q[OM_PSM_NJOINT];
    OmPose tip, goal;  // pose_world_tip
    double speed;      // m/s
    double jaw, jaw_goal;
    bool is_moving;
    int object;  // in the camera's scene
    OmSurface surface;
} Arm;

typedef struct SimWorld {
    OmWorld head;
    const OmScene* scene;
    const OmSite* site;
    OmBody* body;
    Arm arm[OM_MAX_ARM];
    OmSenseScene* sense;
    OmSurface tissue;  // boundary of the mesh
    int* tissue_vert;  // its vertices in the mesh
    int tissue_id, roi_id;
    OmCamera endoscope, rgbd;
    double time;     // s
    uint64_t nstep;  // for the noise of measured tips
    bool is_sense_stale;
} SimWorld;

static void sim_destroy(OmWorld* world) {
    SimWorld* w = (SimWorld*)world;
    om_body_destroy(w->body);
    om_sense_scene_destroy(w->sense);
    om_surface_done(&w->tissue);
    om_free(w->tissue_vert);
    for (int a = 0; a < OM_MAX_ARM; ++a) om_surface_done(&w->arm[a].surface);
    om_free(w);
}

// ---- arms --------------------------------------------------------------------------------------------------

static OmStatus place_arm(SimWorld* w, int index) {
    Arm* arm = &w->arm[index];
    OmPose task = w->site->pose_world_task;
    OmVec3 half = w->site->half_size;
    double side = index == 0 ? -1 : 1;
    // The base leans so that at zero the shaft points at the arm's half of the tissue.
    OmVec3 rcm = om_vec3(0.03, side * (half.y + RCM_OUT), 2 * half.z + RCM_HEIGHT);
    OmVec3 middle = om_vec3(0.03, side * 0.3 * half.y, 2 * half.z + 0.015);
    OmVec3 z = om_normalize(om_sub(rcm, middle));
    OmVec3 x = om_normalize(om_madd(om_vec3(1, 0, 0), -z.x, z));
    OmPose rcm_task = {rcm, om_quat_from_mat3(om_mat3_cols(x, om_cross(z, x), z))};
    arm->psm = om_psm_default(OM_PROGRASP, om_pose_mul(task, rcm_task));
    // Jaws straight down, the gripper opening along the arm's own side.
    OmMat3 down = om_mat3_cols(om_vec3(0, 1, 0), om_vec3(1, 0, 0), om_vec3(0, 0, -1));
    OmVec3 park = om_vec3(0.25 * half.x, side * half.y, 2 * half.z + PARK_HEIGHT);
    OmPose tip_task = {park, om_quat_from_mat3(down)};
    arm->tip = om_pose_mul(task, tip_task);
    arm->goal = arm->tip;
    const double zero[OM_PSM_NJOINT] = {0};
    OmStatus status = om_psm_inverse(&arm->psm, arm->tip, zero, arm->q);
    if (status < 0)
        return om_error_prefix(status, "PSM%d cannot be placed over tissue of %.0f x %.0f mm",
                               index + 1, 2e3 * half.x, 2e3 * half.y);
    arm->jaw = arm->jaw_goal = JAW_START;
    return om_psm_surface(&arm->psm, arm->q, arm->jaw, &arm->surface);
}

static OmStatus sim_move(OmWorld* world, int index, OmVec3 tip, double speed) {
    SimWorld* w = (SimWorld*)world;
    Arm* arm = &w->arm[index];
    OmPose goal = {tip, arm->tip.q};
    double q[OM_PSM_NJOINT];
    OmStatus status = om_psm_inverse(&arm->psm, goal, arm->q, q);
    if (status < 0) return om_error_prefix(status, "PSM%d", index + 1);
    arm->goal = goal;
    arm->speed = speed;
    arm->is_moving = true;
    return OM_OK;
}

static OmStatus sim_set_jaw(OmWorld* world, int index, double angle) {
    Arm* arm = &((SimWorld*)world)->arm[index];
    arm->jaw_goal = fmax(arm->psm.jaw_min, fmin(arm->psm.jaw_max, angle));
    return OM_OK;
}

static void sim_stop(OmWorld* world, int index) {
    Arm* arm = &((SimWorld*)world)->arm[index];
    arm->goal = arm->tip;
    arm->is_moving = false;
}

static void move_jaw(SimWorld* w, int index, double dt) {
    Arm* arm = &w->arm[index];
    bool was_closed = arm->jaw < JAW_CLOSED;
    double way = arm->jaw_goal - arm->jaw, step = JAW_SPEED * dt;
    arm->jaw += fmax(-step, fmin(step, way));
    bool is_closed = arm->jaw < JAW_CLOSED;
    if (is_closed && !was_closed) {
        int nheld;  // nothing between the jaws is no error of the world
        (void)om_body_grasp(w->body, index, arm->tip, w->scene->task.grasp_radius, &nheld);
    }
    if (was_closed && !is_closed) om_body_release(w->body, index);
}

static OmStatus move_arm(SimWorld* w, int index, double dt) {
    Arm* arm = &w->arm[index];
    if (arm->is_moving) {
        OmVec3 way = om_sub(arm->goal.p, arm->tip.p);
        double left = om_norm(way), step = arm->speed * dt;
        OmPose next = arm->goal;
        if (left > step)
            next.p = om_madd(arm->tip.p, step / left, way);
        else
            arm->is_moving = false;
        // The goal is in reach; a point on the way may not be: the arm then stops where it is.
        if (om_psm_inverse(&arm->psm, next, arm->q, arm->q) == OM_OK)
            arm->tip = next;
        else
            sim_stop(&w->head, index);
    }
    move_jaw(w, index, dt);
    return om_body_is_holding(w->body, index) ? om_body_move(w->body, index, arm->tip) : OM_OK;
}

static OmStatus sim_advance(OmWorld* world, double dt) {
    SimWorld* w = (SimWorld*)world;
    for (int a = 0; a < OM_MAX_ARM; ++a) OM_TRY(move_arm(w, a, dt));
    OmBodyReport report;
    OM_TRY(om_body_step(w->body, dt, &report));
    w->time += dt;
    ++w->nstep;
    w->is_sense_stale = true;
    return OM_OK;
}

// ---- cameras -------------------------------------------------------------------------------------------------

static OmStatus build_sense(SimWorld* w) {
    const OmSite* site = w->site;
    OM_TRY(om_sense_scene_create(&w->sense));
    OM_TRY(om_tet_mesh_boundary(&site->mesh, &w->tissue, &w->tissue_vert));
    OmSenseLook fat = om_sense_look(OM_PART_TISSUE), steel = om_sense_look(OM_PART_TOOL);
    OM_TRY(om_sense_scene_add(w->sense, &w->tissue, &fat, &w->tissue_id));
    OM_TRY(om__world_add_anatomy(site, w->sense, &w->roi_id));
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        OM_TRY(om_sense_scene_add(w->sense, &w->arm[a].surface, &steel, &w->arm[a].object));
    }
    w->endoscope = om__world_camera(site, &w->scene->endoscope, -1);
    w->rgbd = om__world_camera(site, &w->scene->rgbd, 1);
    w->is_sense_stale = true;
    return OM_OK;
}

static OmStatus refresh_sense(SimWorld* w) {
    if (!w->is_sense_stale) return OM_OK;
    om_sense_scene_update(w->sense, w->tissue_id, om_body_x(w->body), w->tissue_vert);
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        Arm* arm = &w->arm[a];
        om_psm_surface_update(&arm->psm, arm->q, arm->jaw, &arm->surface);
        om_sense_scene_update(w->sense, arm->object, arm->surface.x, NULL);
    }
    OM_TRY(om_sense_scene_commit(w->sense));
    w->is_sense_stale = false;
    return OM_OK;
}

static OmStatus render(SimWorld* w, int width, int height, int samples, OmPicture* picture) {
    OM_TRY(refresh_sense(w));
    OmCamera camera = w->endoscope;
    camera.width = width;
    camera.height = height;
    OM_TRY(om_picture_init(picture, width, height, 3));
    OmSenseOptions options = om_sense_options_default();
    options.samples = samples;
    OmStatus status = om_sense_render(w->sense, &camera, &options, picture);
    if (status < 0) om_picture_done(picture);
    return status;
}

// Depth with noise, then the points that lie on the tissue.
static OmStatus observe_cloud(SimWorld* w, OmObservation* obs) {
    size_t n = (size_t)w->rgbd.width * (size_t)w->rgbd.height;
    float *depth = NULL, *normal = NULL;
    int* id = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(depth, n);
    OM_ALLOC_DONE(normal, 3 * n);
    OM_ALLOC_DONE(id, n);
    OM_ALLOC_DONE(obs->cloud, 3 * n);
    OM_TRY_DONE(om_sense_depth(w->sense, &w->rgbd, 0, depth, id, normal));
    if (w->scene->world.has_depth_noise) {
        OmDepthNoise noise = om_depth_noise_default((uint64_t)w->scene->seed);
        om_depth_add_noise(&noise, &w->rgbd, w->nstep, normal, depth);
    }
    obs->ncloud = om_depth_to_cloud(&w->rgbd, depth, id, NULL, w->tissue_id, obs->cloud, NULL);
done:
    om_free(depth);
    om_free(normal);
    om_free(id);
    return status;
}

static void observe_arms(const SimWorld* w, OmObservation* obs) {
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const Arm* arm = &w->arm[a];
        // An offset of calibration that stays, and a tremor a twentieth of it.
        OmRng still = om_rng_init((uint64_t)w->scene->seed + 77, (uint64_t)a);
        OmRng now = om_rng_init((uint64_t)w->scene->seed + 78, w->nstep * OM_MAX_ARM + (uint64_t)a);
        double noise[3];
        for (int i = 0; i < 3; ++i) noise[i] = om_rng_normal(&still) + 0.05 * om_rng_normal(&now);
        obs->arm[a] = (OmArmObservation){
            .tip = om_madd(arm->tip.p, w->scene->world.tool_noise, om_load3(noise, 0)),
            .jaw = arm->jaw,
            .is_moving = arm->is_moving,
            .is_holding = om_body_is_holding(w->body, a)};
    }
}

static OmStatus sim_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    SimWorld* w = (SimWorld*)world;
    om_observation_done(obs);
    obs->time = w->time;
    observe_arms(w, obs);
    OmStatus status = what ? refresh_sense(w) : OM_OK;
    if (status == OM_OK && (what & OM_OBSERVE_VISIBILITY)) {
        uint64_t ignore = om__world_roi_bit(w->roi_id);
        status = om_sense_visibility(w->sense, &w->endoscope, w->site->roi_x, w->site->roi_n,
                                     w->site->nroi, ignore, &obs->visibility);
    }
    if (status == OM_OK && (what & OM_OBSERVE_IMAGE)) {
        status = render(w, w->endoscope.width, w->endoscope.height, 1, &obs->image);
    }
    if (status == OM_OK && (what & OM_OBSERVE_CLOUD)) status = observe_cloud(w, obs);
    if (status < 0) om_observation_done(obs);
    return status;
}

// ---- creation --------------------------------------------------------------------------------------------------

static const OmWorldOps sim_ops = {.destroy = sim_destroy,
                                   .move = sim_move,
                                   .set_jaw = sim_set_jaw,
                                   .stop = sim_stop,
                                   .advance = sim_advance,
                                   .observe = sim_observe};

OmStatus om_world_create_simulated(const OmScene* scene, const OmSite* site, int nworker,
                                   OmWorld** world) {
    *world = NULL;
    SimWorld* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    w->head.ops = &sim_ops;
    w->scene = scene;
    w->site = site;
    OmStatus status = om_body_create(scene, site, nworker, &w->body);
    for (int a = 0; status == OM_OK && a < OM_MAX_ARM; ++a) status = place_arm(w, a);
    if (status == OM_OK) status = build_sense(w);
    if (status < 0)
        sim_destroy(&w->head);
    else
        *world = &w->head;
    return status;
}

OmBody* om_world_truth(OmWorld* world) {
    return world && world->ops == &sim_ops ? ((SimWorld*)world)->body : NULL;
}

const OmSurface* om_world_tool(OmWorld* world, int index) {
    if (!world || world->ops != &sim_ops || index < 0 || index >= OM_MAX_ARM) return NULL;
    Arm* arm = &((SimWorld*)world)->arm[index];
    om_psm_surface_update(&arm->psm, arm->q, arm->jaw, &arm->surface);
    return &arm->surface;
}

OmStatus om_world_render(OmWorld* world, int width, int height, OmPicture* picture) {
    OM_CHECK(world->ops == &sim_ops, OM_UNAVAILABLE,
             "only a simulated world can be drawn at any size");
    return render((SimWorld*)world, width, height, 2, picture);
}
