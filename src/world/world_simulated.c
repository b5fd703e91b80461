// world_simulated.c: a simulated operating field: tissue of its own, two PSMs, an endoscope, a depth camera.
//
// The arms stand on either side, remote centres above the tissue's edges, tools pointing down; the endoscope
// looks from -x of the task frame, the depth camera from the opposite side, as on the thesis's bench
// (6.5.1). Measurements are noisy: a normal offset on tool positions, noise on depth that grows with its range.
#include <string.h>

#include "omentum/robot.h"
#include "omentum/sense.h"
#include "omentum/world.h"
#include "world/world_arm.h"
#include "world/world_damage.h"
#include "world/world_view.h"

#define JAW_START (40.0 * OM_PI / 180.0)
#define RCM_HEIGHT 0.13  // m over the board
#define RCM_OUT 0.045    // m beyond the tissue's edge
// Of tissue behind arms apart from it: the fastest that a tip moves (dds_arm.h).
#define FOLLOW_SPEED 0.25  // m/s
#define FOLLOW_TURN 5.0    // rad/s
#define PARK_HEIGHT 0.07   // m, height of parked tools

typedef struct Follow {  // of om_world_advance_tissue; in snapshots, between SimState and the body
    int nclose[OM_MAX_ARM];   // closings that the tissue has followed
    OmPose grip[OM_MAX_ARM];  // pose_world_tip where it is held
} Follow;

typedef struct Tool {  // the constants of an arm, and data computed from its state
    OmPsm psm;
    int shaft_id, head_id;  // in the scene of the cameras
    OmSurface surface;
} Tool;

typedef struct SimWorld {
    OmWorld head;
    const OmScene* scene;
    const OmSite* site;
    OmBody* body;
    Tool tool[OM_MAX_ARM];
    SimState now;
    void* start;  // snapshot; before the first reset: at creation, after it: settled
    bool is_settled, is_at_rest;
    OmSenseScene* sense;
    OmSurface tissue;  // boundary of the mesh
    int* tissue_vert;  // its vertices in the mesh
    int tissue_id;
    OmAnatomyIds ids;
    OmAnatomy* anatomy;
    OmCamera endoscope, rgbd;
    OmWindow window;  // of OM_OBSERVE_WINDOW
    OmWorldDamage damage;
    bool is_sense_stale;
    Follow follow;
} SimWorld;

static void sim_destroy(OmWorld* world) {
    SimWorld* w = (SimWorld*)world;
    om_anatomy_destroy(w->anatomy);
    om_body_destroy(w->body);
    om_sense_scene_destroy(w->sense);
    om_surface_done(&w->tissue);
    om_free(w->tissue_vert);
    for (int a = 0; a < OM_MAX_ARM; ++a) om_surface_done(&w->tool[a].surface);
    om__world_damage_done(&w->damage);
    om_free(w->start);
    om_free(w);
}

// ---- arms --------------------------------------------------------------------------------------------------

OmPsm om_world_place_psm(const OmSite* site, int index) {
    OmVec3 half = site->half_size;
    double side = index == 0 ? -1 : 1;
    // The base is tilted so that with all joints at zero the shaft points at the arm's half of the tissue.
    OmVec3 rcm = om_vec3(0.03, side * (half.y + RCM_OUT), 2 * half.z + RCM_HEIGHT);
    OmVec3 middle = om_vec3(0.03, side * 0.3 * half.y, 2 * half.z + 0.015);
    OmVec3 z = om_normalize(om_sub(rcm, middle));
    OmVec3 x = om_normalize(om_madd(om_vec3(1, 0, 0), -z.x, z));
    OmPose rcm_task = {rcm, om_quat_from_mat3(om_mat3_cols(x, om_cross(z, x), z))};
    return om_psm_default(OM_PROGRASP, om_pose_mul(site->pose_world_task, rcm_task));
}

OmPose om_world_place_tip(const OmSite* site, int index) {
    OmVec3 half = site->half_size;
    double side = index == 0 ? -1 : 1;
    // Jaws straight down, the gripper opening along the arm's own side.
    OmMat3 down = om_mat3_cols(om_vec3(0, 1, 0), om_vec3(1, 0, 0), om_vec3(0, 0, -1));
    OmVec3 park = om_vec3(0.25 * half.x, side * half.y, 2 * half.z + PARK_HEIGHT);
    return om_pose_mul(site->pose_world_task, (OmPose){park, om_quat_from_mat3(down)});
}

static OmStatus place_arm(SimWorld* w, int index) {
    ArmState* arm = &w->now.arm[index];
    Tool* tool = &w->tool[index];
    OmVec3 half = w->site->half_size;
    tool->psm = om_world_place_psm(w->site, index);
    arm->tip = om_world_place_tip(w->site, index);
    arm->set = arm->tip;
    arm->set.p = om_add(arm->tip.p, om__world_arm_offset(w->scene, index));
    arm->goal = arm->set;
    w->follow.grip[index] = arm->tip;
    const double zero[OM_PSM_NJOINT] = {0};
    OmStatus status = om_psm_inverse(&tool->psm, arm->tip, zero, arm->q);
    if (status < 0)
        return om_error_prefix(status, "PSM%d cannot be placed over tissue of %.0f x %.0f mm",
                               index + 1, 2e3 * half.x, 2e3 * half.y);
    arm->jaw = arm->jaw_goal = JAW_START;
    return om_psm_surface(&tool->psm, arm->q, arm->jaw, &tool->surface);
}

static OmStatus sim_move(OmWorld* world, int index, OmPose goal, double speed) {
    SimWorld* w = (SimWorld*)world;
    return om__world_arm_move(w->scene, &w->tool[index].psm, index, goal, speed,
                              &w->now.arm[index]);
}

static OmStatus sim_set_jaw(OmWorld* world, int index, double angle) {
    SimWorld* w = (SimWorld*)world;
    om__world_arm_set_jaw(&w->tool[index].psm, angle, &w->now.arm[index]);
    return OM_OK;
}

static void sim_stop(OmWorld* world, int index) {
    om__world_arm_stop(&((SimWorld*)world)->now.arm[index]);
}

// Grasp the tissue at the tip; nothing between the jaws is no error.
static OmStatus grasp(SimWorld* w, int index) {
    int nheld;
    OmStatus status =
        om_body_grasp(w->body, index, w->now.arm[index].tip, w->scene->task.grasp_radius, &nheld);
    return status < 0 && status != OM_INVALID ? status : OM_OK;
}

static OmStatus move_jaw(SimWorld* w, int index, double dt) {
    ArmState* arm = &w->now.arm[index];
    bool was_closed = arm->jaw < JAW_CLOSED;
    double before = arm->jaw, next = om__world_arm_next_jaw(arm, dt);
    bool is_closed = next < JAW_CLOSED;
    if (is_closed && !was_closed) OM_TRY(grasp(w, index));
    if (was_closed && !is_closed) om_body_release(w->body, index);
    arm->jaw = fmax(next, om_body_is_holding(w->body, index) ? JAW_ON_TISSUE : 0);
    arm->jaw_speed = (arm->jaw - before) / dt;
    return OM_OK;
}

static OmStatus move_arm(SimWorld* w, int index, double dt) {
    ArmState* arm = &w->now.arm[index];
    om__world_arm_step(w->scene, &w->tool[index].psm, index, dt, arm);
    OM_TRY(move_jaw(w, index, dt));
    w->follow.grip[index] = arm->tip;
    return om_body_is_holding(w->body, index) ? om_body_move(w->body, index, arm->tip) : OM_OK;
}

static OmStatus step_tissue(SimWorld* w, double dt) {
    OmBodyReport report;
    OM_TRY(om_body_step(w->body, dt, &report));
    w->is_sense_stale = true;
    double closing[OM_MAX_ARM];
    for (int a = 0; a < OM_MAX_ARM; ++a) closing[a] = om__world_arm_grip(&w->now.arm[a]);
    return om__world_damage_step(&w->damage, closing, w->body);
}

static OmStatus sim_advance(OmWorld* world, double dt) {
    SimWorld* w = (SimWorld*)world;
    for (int a = 0; a < world->narm; ++a) OM_TRY(move_arm(w, a, dt));
    OM_TRY(step_tissue(w, dt));
    w->now.time += dt;
    ++w->now.nstep;
    return OM_OK;
}

// ---- cameras -------------------------------------------------------------------------------------------------

// A dark shaft, and wrist and jaws of steel: two objects.
static OmStatus add_tool(OmSenseScene* sense, Tool* tool) {
    const OmSurface* whole = &tool->surface;
    OmSurface shaft = *whole, head = {0};
    shaft.nvert = OM_PSM_SHAFT_NVERT;
    shaft.ntri = OM_PSM_SHAFT_NTRI;
    OmSenseLook dark = om_sense_look(OM_PART_SHAFT), steel = om_sense_look(OM_PART_TOOL);
    OM_TRY(om_sense_scene_add(sense, &shaft, &dark, &tool->shaft_id));
    OM_TRY(om_surface_init(&head, whole->nvert - shaft.nvert, whole->ntri - shaft.ntri));
    memcpy(head.x, whole->x + 3 * shaft.nvert, 3 * (size_t)head.nvert * sizeof *head.x);
    for (int i = 0; i < 3 * head.ntri; ++i)
        head.tri_vert[i] = whole->tri_vert[3 * shaft.ntri + i] - shaft.nvert;
    OmStatus status = om_sense_scene_add(sense, &head, &steel, &tool->head_id);
    om_surface_done(&head);
    return status;
}

static OmStatus build_sense(SimWorld* w) {
    const OmSite* site = w->site;
    OM_TRY(om_sense_scene_create(&w->sense));
    OM_TRY(om_tet_mesh_boundary(om_body_mesh(w->body), &w->tissue, &w->tissue_vert));
    OM_TRY(om_anatomy_create(w->body, &w->anatomy));
    OmSenseLook fat = om_sense_look(OM_PART_TISSUE);
    OM_TRY(om_sense_scene_add(w->sense, &w->tissue, &fat, &w->tissue_id));
    OM_TRY(om__world_add_anatomy(site, w->sense, &w->ids));
    for (int a = 0; a < w->head.narm; ++a) {
        OM_TRY(add_tool(w->sense, &w->tool[a]));
    }
    w->endoscope = om_world_endoscope(w->scene, site);
    w->rgbd = om__world_camera(site, &w->scene->rgbd, 1);
    OM_TRY(om_camera_check(&w->endoscope));
    OM_TRY(om_camera_check(&w->rgbd));
    w->is_sense_stale = true;
    return OM_OK;
}

static OmStatus refresh_sense(SimWorld* w) {
    if (!w->is_sense_stale) return OM_OK;
    om_sense_scene_update(w->sense, w->tissue_id, om_body_x(w->body), w->tissue_vert);
    om_anatomy_move(w->anatomy, om_body_x(w->body));
    om__world_move_anatomy(w->anatomy, w->ids, w->sense);
    for (int a = 0; a < w->head.narm; ++a) {
        Tool* tool = &w->tool[a];
        om_psm_surface_update(&tool->psm, w->now.arm[a].q, w->now.arm[a].jaw, &tool->surface);
        const double* x = tool->surface.x;
        om_sense_scene_update(w->sense, tool->shaft_id, x, NULL);
        om_sense_scene_update(w->sense, tool->head_id, x + 3 * OM_PSM_SHAFT_NVERT, NULL);
    }
    OM_TRY(om_sense_scene_commit(w->sense));
    w->is_sense_stale = false;
    return OM_OK;
}

static OmStatus render(SimWorld* w, const OmCamera* camera, OmWindow window, int samples,
                       OmPicture* picture) {
    OM_TRY(refresh_sense(w));
    OmSenseOptions options = om_sense_options_default();
    options.samples = samples;
    options.window = om_window_clip(window, camera->width, camera->height);
    OM_TRY(om_picture_init(picture, options.window.width, options.window.height, 3));
    OmStatus status = om_sense_render(w->sense, camera, &options, picture);
    if (status < 0) om_picture_done(picture);
    return status;
}

// A window outside of the picture would be empty: the whole picture is observed instead.
static void sim_set_window(OmWorld* world, OmWindow window) {
    SimWorld* w = (SimWorld*)world;
    w->window = om_window_clip(window, w->endoscope.width, w->endoscope.height);
}

static OmStatus observe_depth(SimWorld* w, OmDepthPicture* picture) {
    size_t n = (size_t)w->rgbd.width * (size_t)w->rgbd.height;
    float* normal = NULL;  // for the noise alone
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(picture->depth, n);
    OM_ALLOC_DONE(normal, 3 * n);
    OM_TRY_DONE(om_sense_depth(w->sense, &w->rgbd, 0, picture->depth, NULL, normal));
    if (w->scene->world.has_depth_noise) {
        OmDepthNoise noise = om_depth_noise_default((uint64_t)w->scene->seed);
        om_depth_add_noise(&noise, &w->rgbd, w->now.nstep, normal, picture->depth);
    }
    picture->time = w->now.time;
    picture->camera = w->rgbd;
done:
    om_free(normal);
    return status;
}

// The force of the tissue acts at the tip. The point grasp of this model transmits no torque.
static OmStatus observe_forces(SimWorld* w, OmObservation* obs) {
    double sigma = w->scene->world.force_noise;
    if (sigma < 0) return OM_OK;
    OmBodyForces forces;
    OM_TRY(om_body_get_forces(w->body, &forces));
    for (int a = 0; a < w->head.narm; ++a) {
        uint64_t stream = w->now.nstep * OM_MAX_ARM + (uint64_t)a;
        OmRng rng = om_rng_init((uint64_t)w->scene->seed + 79, stream);
        double noise[3];
        for (int i = 0; i < 3; ++i) noise[i] = om_rng_normal(&rng);
        OmVec3 load = om_scale(-1, forces.grasp[a]);
        obs->arm[a].has_wrench = true;
        obs->arm[a].force = om_madd(load, sigma, om_load3(noise, 0));
    }
    return OM_OK;
}

static OmStatus sim_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    SimWorld* w = (SimWorld*)world;
    om_observation_done(obs);
    obs->time = w->now.time;
    obs->narm = world->narm;
    om__world_arm_observe(w->scene, world->narm, &w->now, obs);
    OmStatus status = observe_forces(w, obs);
    if (status == OM_OK && what) status = refresh_sense(w);
    const bool has_picture = what & (OM_OBSERVE_IMAGE | OM_OBSERVE_WINDOW);
    if (has_picture || what & OM_OBSERVE_VISIBILITY) {
        obs->endoscope.time = w->now.time;
        obs->endoscope.camera = w->endoscope;
    }
    if (status == OM_OK && (what & OM_OBSERVE_VISIBILITY)) {
        uint64_t ignore = om__world_roi_bit(w->ids.roi);
        status = om_sense_visibility(w->sense, &w->endoscope, w->anatomy->roi_x, w->anatomy->roi_n,
                                     w->site->nroi, ignore, &obs->visibility);
    }
    if (status == OM_OK && has_picture) {
        if (!(what & OM_OBSERVE_IMAGE)) obs->endoscope.window = w->window;
        status = render(w, &w->endoscope, obs->endoscope.window, 1, &obs->endoscope.color);
    }
    if (status == OM_OK && (what & (OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR)))
        status = observe_depth(w, &obs->rgbd);
    if (status == OM_OK && (what & OM_OBSERVE_COLOR))
        status = render(w, &w->rgbd, (OmWindow){0}, 1, &obs->rgbd.color);
    if (status < 0) om_observation_done(obs);
    return status;
}

// ---- start and snapshots ----------------------------------------------------------------------------------------

static size_t sim_state_size(const OmWorld* world) {
    return sizeof(SimState) + sizeof(Follow) + om_body_state_size(((const SimWorld*)world)->body);
}

static void sim_save(const OmWorld* world, void* block) {
    const SimWorld* w = (const SimWorld*)world;
    char* at = block;
    memcpy(at, &w->now, sizeof w->now);
    memcpy(at + sizeof w->now, &w->follow, sizeof w->follow);
    om_body_save(w->body, at + sizeof w->now + sizeof w->follow);
}

static void sim_restore(OmWorld* world, const void* block) {
    SimWorld* w = (SimWorld*)world;
    const char* at = block;
    memcpy(&w->now, at, sizeof w->now);
    memcpy(&w->follow, at + sizeof w->now, sizeof w->follow);
    om_body_restore(w->body, at + sizeof w->now + sizeof w->follow);
    w->is_sense_stale = true;
}

static OmStatus sim_reset(OmWorld* world) {
    SimWorld* w = (SimWorld*)world;
    sim_restore(world, w->start);
    if (!w->is_settled) {
        OmStatus status = om_body_settle(w->body, w->scene->task.time_step, OM_WORLD_SETTLE_SPEED,
                                         OM_WORLD_SETTLE_TIME);
        OM_TRY(status);
        w->is_at_rest = status == OM_OK;
        w->is_settled = true;
        sim_save(world, w->start);
    }
    OM_CHECK(w->is_at_rest, OM_NOT_CONVERGED, "the tissue still moves after %g s",
             OM_WORLD_SETTLE_TIME);
    return OM_OK;
}

// ---- creation --------------------------------------------------------------------------------------------------

static const OmWorldOps sim_ops = {.destroy = sim_destroy,
                                   .move = sim_move,
                                   .set_jaw = sim_set_jaw,
                                   .stop = sim_stop,
                                   .advance = sim_advance,
                                   .observe = sim_observe,
                                   .reset = sim_reset,
                                   .state_size = sim_state_size,
                                   .save = sim_save,
                                   .restore = sim_restore,
                                   .set_window = sim_set_window};

OmStatus om_world_create_simulated(const OmScene* scene, const OmSite* site, int nworker,
                                   OmWorld** world) {
    *world = NULL;
    OM_CHECK(scene->world.narm >= 1 && scene->world.narm <= OM_MAX_ARM, OM_INVALID,
             "world: %d arms; 1 to %d", scene->world.narm, OM_MAX_ARM);
    SimWorld* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    w->head.ops = &sim_ops;
    w->head.narm = scene->world.narm;
    w->head.sources = OM_OBSERVE_VISIBILITY | OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH |
                      OM_OBSERVE_COLOR | OM_OBSERVE_WINDOW;
    for (int a = 0; a < w->head.narm; ++a) w->head.psm[a] = &w->tool[a].psm;
    w->scene = scene;
    w->site = site;
    OmStatus status = om_body_create(scene, site, nworker, &w->body);
    for (int a = 0; status == OM_OK && a < w->head.narm; ++a) status = place_arm(w, a);
    if (status == OM_OK) status = build_sense(w);
    if (status == OM_OK) status = om__world_damage_init(scene, site, &w->damage);
    if (status == OM_OK) {
        w->start = om_calloc(1, sim_state_size(&w->head));
        status = w->start ? OM_OK : OM_NO_MEMORY;
    }
    if (status == OM_OK) sim_save(&w->head, w->start);
    if (status < 0)
        sim_destroy(&w->head);
    else
        *world = &w->head;
    return status;
}

static OmStatus check_simulated(const OmWorld* world) {
    OM_CHECK(world && world->ops == &sim_ops, OM_UNAVAILABLE,
             "the arms of a world that is not simulated cannot move apart from its tissue");
    return OM_OK;
}

OmStatus om_world_set_tool(OmWorld* world, int arm, const OmPsm* tool) {
    OM_TRY(check_simulated(world));
    SimWorld* w = (SimWorld*)world;
    OM_CHECK(arm >= 0 && arm < world->narm, OM_INVALID, "no arm %d; the world has %d", arm,
             world->narm);
    OM_CHECK(w->now.nstep == 0, OM_INVALID, "PSM%d: instruments change before the first step",
             arm + 1);
    ArmState* now = &w->now.arm[arm];
    OmPsm psm = *tool;
    psm.pose_world_rcm = w->tool[arm].psm.pose_world_rcm;
    const double zero[OM_PSM_NJOINT] = {0};
    OmPose tip;
    const OmStatus status =
        om_psm_inverse_nearest(&psm, om_world_place_tip(w->site, arm), zero, now->q, &tip);
    if (status < 0) return om_error_prefix(status, "PSM%d with this instrument", arm + 1);
    w->tool[arm].psm = psm;
    now->tip.q = now->set.q = now->goal.q = tip.q;
    w->follow.grip[arm] = now->tip;
    now->jaw = now->jaw_goal = psm.has_jaw ? fmin(JAW_START, psm.jaw_max) : JAW_START;
    om_psm_surface_update(&psm, now->q, now->jaw, &w->tool[arm].surface);
    w->is_sense_stale = true;
    sim_save(world, w->start);
    return OM_OK;
}

// ---- arms in another thread -------------------------------------------------------------------------------------

OmStatus om_world_create_arms(const OmWorld* world, OmWorld** arms) {
    *arms = NULL;
    OM_TRY(check_simulated(world));
    const SimWorld* w = (const SimWorld*)world;
    OM_TRY(om__world_arms_create(w->scene, world->narm, world->psm, &w->now, arms));
    return om_world_answer_arms(world, *arms);
}

OmStatus om_world_set_arms(OmWorld* world, const void* block) {
    OM_TRY(check_simulated(world));
    SimWorld* w = (SimWorld*)world;
    memcpy(&w->now, block, sizeof w->now);
    w->is_sense_stale = true;
    return OM_OK;
}

// The way of a tip in a step that comes late is long: all of it at once would strain the tissue as no motion of the arm
// does, and a solver that needs longer for it would be later still. The grip follows at a limited speed.
static OmPose follow_tip(OmPose from, OmPose to, double dt) {
    const double way = om_distance(from.p, to.p), turn = om_quat_angle(from.q, to.q);
    double part = way > FOLLOW_SPEED * dt ? FOLLOW_SPEED * dt / way : 1;
    if (turn * part > FOLLOW_TURN * dt) part = FOLLOW_TURN * dt / turn;
    if (part >= 1) return to;
    return (OmPose){om_lerp(from.p, to.p, part), om_quat_slerp(from.q, to.q, part)};
}

// A jaw that has opened and closed again between two steps lets go, and grasps where it is.
static OmStatus follow_arm(SimWorld* w, int index, double dt) {
    const ArmState* arm = &w->now.arm[index];
    const bool is_closed = arm->jaw < JAW_CLOSED,
               is_another = arm->nclose != w->follow.nclose[index];
    if (om_body_is_holding(w->body, index) && (!is_closed || is_another))
        om_body_release(w->body, index);
    if (is_closed && is_another) OM_TRY(grasp(w, index));
    w->follow.nclose[index] = arm->nclose;
    const bool is_held = om_body_is_holding(w->body, index) && !is_another;
    w->follow.grip[index] = is_held ? follow_tip(w->follow.grip[index], arm->tip, dt) : arm->tip;
    return om_body_is_holding(w->body, index) ? om_body_move(w->body, index, w->follow.grip[index])
                                              : OM_OK;
}

OmStatus om_world_advance_tissue(OmWorld* world, double dt) {
    OM_TRY(check_simulated(world));
    OM_CHECK(dt > 0 && isfinite(dt), OM_INVALID, "time step is %g s; must be positive", dt);
    SimWorld* w = (SimWorld*)world;
    for (int a = 0; a < world->narm; ++a) OM_TRY(follow_arm(w, a, dt));
    return step_tissue(w, dt);
}

OmStatus om_world_answer_arms(const OmWorld* world, OmWorld* arms) {
    OM_TRY(check_simulated(world));
    OM_CHECK(om__world_is_arms(arms) && arms->narm == world->narm, OM_INVALID,
             "these are no arms of om_world_create_arms");
    const SimWorld* w = (const SimWorld*)world;
    for (int a = 0; a < world->narm; ++a)
        om__world_arms_answer(arms, a, w->follow.nclose[a], om_body_is_holding(w->body, a));
    return OM_OK;
}

OmBody* om_world_truth(OmWorld* world) {
    return world && world->ops == &sim_ops ? ((SimWorld*)world)->body : NULL;
}

bool om_world_setpoint(const OmWorld* world, int index, OmPose* setpoint) {
    *setpoint = om_pose_identity();
    if (!world || world->ops != &sim_ops || index < 0 || index >= world->narm) return false;
    *setpoint = ((const SimWorld*)world)->now.arm[index].set;
    return true;
}

const OmSurface* om_world_tool(OmWorld* world, int index) {
    if (!world || world->ops != &sim_ops || index < 0 || index >= world->narm) return NULL;
    SimWorld* w = (SimWorld*)world;
    Tool* tool = &w->tool[index];
    om_psm_surface_update(&tool->psm, w->now.arm[index].q, w->now.arm[index].jaw, &tool->surface);
    return &tool->surface;
}

OmStatus om_world_render(OmWorld* world, int width, int height, OmPicture* picture) {
    OM_CHECK(world->ops == &sim_ops, OM_UNAVAILABLE,
             "only a simulated world can be drawn at any size");
    OmCamera camera = om_camera_resize(&((SimWorld*)world)->endoscope, width, height);
    return om_world_render_from(world, &camera, picture);
}

OmStatus om_world_render_from(OmWorld* world, const OmCamera* camera, OmPicture* picture) {
    *picture = (OmPicture){0};
    OM_CHECK(world->ops == &sim_ops, OM_UNAVAILABLE,
             "only a simulated world can be drawn from any camera");
    OM_TRY(om_camera_check(camera));
    return render((SimWorld*)world, camera, (OmWindow){0}, 2, picture);
}
