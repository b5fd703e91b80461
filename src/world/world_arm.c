// world_arm.c: arms of a simulated world, and a world of arms alone, which keeps time while the tissue steps elsewhere.
//
// A jaw alone does not know whether it closes on tissue until the tissue has stepped. Until then it closes slowly
// towards the angle at which tissue would stop it, for 4 s at most: it does not pass this angle, so that it never jumps
// back, and it is not at rest (om_arm_is_holding), so that no client takes it for a jaw on tissue.
#include "world/world_arm.h"

#include <string.h>

#include "omentum/robot.h"

#define JAW_SPEED 3.0   // rad/s
#define JAW_CREEP 0.06  // rad/s, until the tissue has answered

OmVec3 om__world_arm_offset(const OmScene* scene, int index) {
    OmRng rng = om_rng_init((uint64_t)scene->seed + 77, (uint64_t)index);
    double still[3];
    for (int i = 0; i < 3; ++i) still[i] = om_rng_normal(&rng);
    return om_scale(scene->world.tool_noise, om_load3(still, 0));
}

// Where the tip is when the arm measures itself at a pose.
static OmPose true_pose(const OmScene* scene, int index, OmPose measured) {
    return (OmPose){om_sub(measured.p, om__world_arm_offset(scene, index)), measured.q};
}

OmStatus om__world_arm_move(const OmScene* scene, const OmPsm* psm, int index, OmPose goal,
                            double speed, ArmState* arm) {
    double q[OM_PSM_NJOINT];
    OmPose reached;
    OmStatus status =
        om_psm_inverse_nearest(psm, true_pose(scene, index, goal), arm->q, q, &reached);
    if (status < 0) return om_error_prefix(status, "PSM%d", index + 1);
    arm->goal = (OmPose){goal.p, reached.q};
    arm->speed = speed;
    arm->is_moving = true;
    return OM_OK;
}

void om__world_arm_set_jaw(const OmPsm* psm, double angle, ArmState* arm) {
    if (!psm->has_jaw) return;
    arm->jaw_goal = fmax(psm->jaw_min, fmin(psm->jaw_max, angle));
}

void om__world_arm_stop(ArmState* arm) {
    arm->goal = arm->set;
    arm->is_moving = false;
}

void om__world_arm_step(const OmScene* scene, const OmPsm* psm, int index, double dt,
                        ArmState* arm) {
    if (!arm->is_moving) return;
    bool is_there;
    OmPose next = om_world_straight_step(arm->set, arm->goal, arm->speed, dt, &is_there);
    arm->is_moving = !is_there;
    OmPose tip = true_pose(scene, index, next);
    // The goal is in reach, but a point of the path may be out of reach: the arm then stops.
    if (om_psm_inverse_nearest(psm, tip, arm->q, arm->q, &tip) == OM_OK)
        arm->set = (OmPose){next.p, tip.q}, arm->tip = tip;
    else
        om__world_arm_stop(arm);
}

// Tissue stops the jaw, and its controller presses as a spring on what is left to the goal, up to a largest torque.
double om__world_arm_grip(const ArmState* arm) {
    return fmin(2, 1 + fmax(0, -arm->jaw_goal) / JAW_ON_TISSUE);
}

double om__world_arm_next_jaw(const ArmState* arm, double dt) {
    const double limit = JAW_SPEED * dt;
    return arm->jaw + fmax(-limit, fmin(limit, arm->jaw_goal - arm->jaw));
}

void om__world_arm_observe(const OmScene* scene, int narm, const SimState* now,
                           OmObservation* obs) {
    for (int a = 0; a < narm; ++a) {
        const ArmState* arm = &now->arm[a];
        uint64_t stream = now->nstep * OM_MAX_ARM + (uint64_t)a;
        // A constant offset of calibration, and a tremor of a twentieth of it.
        OmRng rng = om_rng_init((uint64_t)scene->seed + 78, stream);
        double tremor[3];
        for (int i = 0; i < 3; ++i) tremor[i] = 0.05 * om_rng_normal(&rng);
        OmArmObservation* o = &obs->arm[a];
        o->time = now->time;
        o->tip.p = om_madd(arm->set.p, scene->world.tool_noise, om_load3(tremor, 0));
        o->tip.q = arm->tip.q;
        memcpy(o->q, arm->q, sizeof o->q);
        o->jaw = arm->jaw;
        o->jaw_speed = arm->jaw_speed;
        o->jaw_goal = arm->jaw_goal;
        o->is_moving = arm->is_moving;
    }
}

// ---- arms alone ---------------------------------------------------------------------------------------------

typedef struct ArmsWorld {
    OmWorld head;
    const OmScene* scene;
    OmPsm psm[OM_MAX_ARM];
    SimState now;
    // the tissue's last answer: to which closing, and whether the jaw holds tissue
    int nanswered[OM_MAX_ARM];
    bool is_holding[OM_MAX_ARM];
} ArmsWorld;

static void arms_destroy(OmWorld* world) { om_free(world); }

static OmStatus arms_move(OmWorld* world, int index, OmPose goal, double speed) {
    ArmsWorld* w = (ArmsWorld*)world;
    return om__world_arm_move(w->scene, &w->psm[index], index, goal, speed, &w->now.arm[index]);
}

static OmStatus arms_set_jaw(OmWorld* world, int index, double angle) {
    ArmsWorld* w = (ArmsWorld*)world;
    om__world_arm_set_jaw(&w->psm[index], angle, &w->now.arm[index]);
    return OM_OK;
}

static void arms_stop(OmWorld* world, int index) {
    om__world_arm_stop(&((ArmsWorld*)world)->now.arm[index]);
}

static void move_jaw(ArmsWorld* w, int index, double dt) {
    ArmState* arm = &w->now.arm[index];
    const double before = arm->jaw, next = om__world_arm_next_jaw(arm, dt);
    double least = 0;
    if (next < JAW_CLOSED) {
        arm->nclose += before >= JAW_CLOSED;
        if (w->nanswered[index] != arm->nclose)
            least = fmax(JAW_ON_TISSUE, fmin(before, JAW_CLOSED) - JAW_CREEP * dt);
        else if (w->is_holding[index])
            least = JAW_ON_TISSUE;
    }
    arm->jaw = fmax(next, least);
    arm->jaw_speed = (arm->jaw - before) / dt;
}

static OmStatus arms_advance(OmWorld* world, double dt) {
    ArmsWorld* w = (ArmsWorld*)world;
    for (int a = 0; a < world->narm; ++a) {
        om__world_arm_step(w->scene, &w->psm[a], a, dt, &w->now.arm[a]);
        move_jaw(w, a, dt);
    }
    w->now.time += dt;
    ++w->now.nstep;
    return OM_OK;
}

static OmStatus arms_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    const ArmsWorld* w = (const ArmsWorld*)world;
    (void)what;  // no sources
    om_observation_done(obs);
    obs->time = w->now.time;
    obs->narm = world->narm;
    om__world_arm_observe(w->scene, world->narm, &w->now, obs);
    return OM_OK;
}

static size_t arms_state_size(const OmWorld* world) {
    (void)world;
    return sizeof(SimState);
}

static void arms_save(const OmWorld* world, void* block) {
    memcpy(block, &((const ArmsWorld*)world)->now, sizeof(SimState));
}

static void arms_restore(OmWorld* world, const void* block) {
    memcpy(&((ArmsWorld*)world)->now, block, sizeof(SimState));
}

static const OmWorldOps arms_ops = {.destroy = arms_destroy,
                                    .move = arms_move,
                                    .set_jaw = arms_set_jaw,
                                    .stop = arms_stop,
                                    .advance = arms_advance,
                                    .observe = arms_observe,
                                    .state_size = arms_state_size,
                                    .save = arms_save,
                                    .restore = arms_restore};

OmStatus om__world_arms_create(const OmScene* scene, int narm, const OmPsm* const* psm,
                               const SimState* now, OmWorld** arms) {
    *arms = NULL;
    ArmsWorld* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    w->head = (OmWorld){.ops = &arms_ops, .narm = narm};
    w->scene = scene;
    w->now = *now;
    for (int a = 0; a < narm; ++a) {
        w->psm[a] = *psm[a];
        w->head.psm[a] = &w->psm[a];
    }
    *arms = &w->head;
    return OM_OK;
}

bool om__world_is_arms(const OmWorld* world) { return world && world->ops == &arms_ops; }

void om__world_arms_answer(OmWorld* arms, int index, int nclose, bool is_holding) {
    ArmsWorld* w = (ArmsWorld*)arms;
    w->nanswered[index] = nclose;
    w->is_holding[index] = is_holding;
}
