// dds_robot.c: the simulated robot: a world behind the topics of a da Vinci Research Kit.
//
//   topics --take_commands--> Arm (dds_arm.c) --om__arm_step--> om_world_move, om_world_advance
//                                                                      |
//   topics <------publish_arms, publish_pictures------ om_world_observe
//
// One tick is one step of the world. By the wall clock there are `rate` of them in a second; in lock-step a tick is
// made when a client asks for it, once its commands are there: topics have no order between each other, so the tick
// says how many commands it follows. Of several commands on one topic the last one wins, as with the robot's queues of
// one; state commands are obeyed in order. state_command is read without durability: the usual client publishes it
// latched, and an old "enable" would come again.
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include "dds/dds_arm.h"
#include "dds/dds_cloud.h"
#include "dds/dds_mcap.h"
#include "dds/dds_period.h"
#include "dds/dds_udp.h"
#include "omentum/base_job.h"
#include "omentum/dds.h"

#define COOKIE 0xdd5002u
#define LOOK_NICE 10      // of the thread that renders
#define SILENCE 5.0       // s without a reader after which the robot says so
#define BEAT 0.1          // s between two messages while a lock-step stands still
#define FAST 1e3          // m/s: the world reaches the setpoint within the step
#define UDP_MOST 32       // datagrams of a tick; others wait
#define UDP_PATIENCE 1.0  // s without a datagram after which the move of its sender stops
#define WORLD "world"     // the frame of all poses but the local ones

// Of the whole system: a simulated robot has no power, and each arm is homed by its own state_command.
enum { POWER_ON, POWER_OFF, HOME, NSYSTEM };
static const struct {
    const char *name, *answer;
} system_topic[NSYSTEM] = {
    {"system/power_on", "power_on: nothing is done; send home to each arm"},
    {"system/power_off", "power_off: the arms stop, and keep their states"},
    {"system/home", "home: nothing is done; send home to each arm"},
};

typedef struct Hand {  // an arm with its topics
    Arm core;
    char name[16];
    int state_command, servo_cp, servo_jp, move_cp, move_jp, hold, ratio, jaw_servo, jaw_move;
    int jaw_effort, tool_present, measured_cv;
    int measured_js, setpoint_js, measured_cp, setpoint_cp, local_measured, local_setpoint;
    int jaw_measured, jaw_setpoint, body_cf, spatial_cf;
    int state, error, warning, status, tool_type;
    double last_q[OM_PSM_NJOINT];
    OmPose last_tip;
    bool has_last, was_busy;
    int mover;  // om__udp_sender of the last move by UDP
} Hand;

typedef struct Eye {  // a camera with its topics
    const char* frame;
    OmCamera camera;
    int info, image, cloud;  // cloud of the depth camera
} Eye;

struct OmDdsRobot {
    OmDdsRobotDef def;
    Link* link;
    Mcap* mcap;      // null: no recording
    Udp* udp;        // null: not served
    OmText reply;    // to the last datagram
    OmWatch* watch;  // null: not served
    Hand hand[OM_MAX_ARM];
    Hand ecm;  // the endoscope: it has states and a pose, and does not move
    int narm, nend;
    Eye endoscope, depth;
    int clock, tf, tf_static, tick_in, tick_out;
    int system[NSYSTEM], status;  // of the whole system
    Cloud points;                 // of the depth camera
    OmObservation obs;
    OmObservation seen;   // with pictures
    OmJob* job;           // null: no picture is under way
    void* snapshot;       // of the world, for the eyes
    unsigned wanted;      // OM_OBSERVE_ flags of the job
    double taken;         // s, time that the job took
    double stamp_origin;  // s of the epoch at the world's time 0; 0 in lock-step
    double next_picture;  // s of the world
    // of the client in lock-step: its number, commands since its first tick
    uint32_t client, ntaken;
    LinkMessage tick;  // that waits for its commands
    bool has_tick, has_readers, has_said_silent;
    double begun;   // s of the wall clock
    double render;  // s, all pictures
    OmDdsReport report;
    Periods periods;  // of the arms' messages
};

OmDdsRobotDef om_dds_robot_default_def(OmWorld* world, const OmScene* scene, const OmSite* site) {
    return (OmDdsRobotDef){.cookie = COOKIE,
                           .dds = om_dds_default_def(),
                           .world = world,
                           .scene = scene,
                           .site = site,
                           .rate = 100,
                           .picture_rate = 30};
}

static void say(OmDdsRobot* r, const char* format, ...) OM_PRINTF(2, 3);
static void say(OmDdsRobot* r, const char* format, ...) {
    char text[400];
    va_list args;
    if (!r->def.say) return;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    r->def.say(r->def.say_ctx, text);
}

static double stamp(const OmDdsRobot* r) { return r->stamp_origin + r->obs.time; }

// ---- topics -------------------------------------------------------------------------------------------------------

typedef struct Topic {
    size_t offset;  // of the id in its struct
    unsigned flags;
    LinkType type;
    const char* name;
    int depth;
} Topic;

#define IN(field, type, name) \
    { offsetof(Hand, field), LINK_IN, type, name, 10 }
#define OUT(field, type, name) \
    { offsetof(Hand, field), LINK_OUT, type, name, 5 }
static const Topic hand_topic[] = {
    IN(state_command, LINK_STAMPED, "state_command"),
    IN(servo_cp, LINK_POSE, "servo_cp"),
    IN(servo_jp, LINK_JOINTS, "servo_jp"),
    IN(move_cp, LINK_POSE, "move_cp"),
    IN(move_jp, LINK_JOINTS, "move_jp"),
    IN(hold, LINK_EMPTY, "hold"),
    IN(ratio, LINK_NUMBER, "trajectory_j/set_ratio"),
    IN(jaw_servo, LINK_JOINTS, "jaw/servo_jp"),
    IN(jaw_move, LINK_JOINTS, "jaw/move_jp"),
    IN(jaw_effort, LINK_JOINTS, "jaw/servo_jf"),
    IN(tool_present, LINK_BOOL, "emulate_tool_present"),
    OUT(measured_js, LINK_JOINTS, "measured_js"),
    OUT(setpoint_js, LINK_JOINTS, "setpoint_js"),
    OUT(measured_cp, LINK_POSE, "measured_cp"),
    OUT(setpoint_cp, LINK_POSE, "setpoint_cp"),
    OUT(measured_cv, LINK_TWIST, "measured_cv"),
    OUT(local_measured, LINK_POSE, "local/measured_cp"),
    OUT(local_setpoint, LINK_POSE, "local/setpoint_cp"),
    OUT(jaw_measured, LINK_JOINTS, "jaw/measured_js"),
    OUT(jaw_setpoint, LINK_JOINTS, "jaw/setpoint_js"),
    OUT(body_cf, LINK_WRENCH, "body/measured_cf"),
    OUT(spatial_cf, LINK_WRENCH, "spatial/measured_cf"),
    {offsetof(Hand, state), LINK_OUT | LINK_LATCHED, LINK_STATE, "operating_state", 10},
    {offsetof(Hand, tool_type), LINK_OUT | LINK_LATCHED, LINK_STRING, "tool_type", 1},
    OUT(error, LINK_STRING, "error"),
    OUT(warning, LINK_STRING, "warning"),
    OUT(status, LINK_STRING, "status"),
};

static OmStatus add_topics(OmDdsRobot* r, Hand* hand) {
    char name[80];
    for (size_t k = 0; k < sizeof hand_topic / sizeof *hand_topic; ++k) {
        const Topic* t = &hand_topic[k];
        int* id = (int*)(void*)((char*)hand + t->offset);
        LinkType type = t->type;
        const bool is_words = id == &hand->error || id == &hand->warning || id == &hand->status;
        if (is_words && r->def.has_stamped_strings) type = LINK_STAMPED;
        snprintf(name, sizeof name, "%s/%s", hand->name, t->name);
        OM_TRY(om__link_add(r->link, t->flags, type, name, t->depth, id));
    }
    return OM_OK;
}

// The endoscope's arm: its states and its pose.
static OmStatus add_ecm(OmDdsRobot* r) {
    Hand* e = &r->ecm;
    Link* l = r->link;
    snprintf(e->name, sizeof e->name, "ECM");
    OM_TRY(om__link_add(l, LINK_IN, LINK_STAMPED, "ECM/state_command", 10, &e->state_command));
    OM_TRY(om__link_add(l, LINK_IN, LINK_POSE, "ECM/servo_cp", 10, &e->servo_cp));
    OM_TRY(om__link_add(l, LINK_IN, LINK_POSE, "ECM/move_cp", 10, &e->move_cp));
    OM_TRY(om__link_add(l, LINK_OUT, LINK_POSE, "ECM/measured_cp", 5, &e->measured_cp));
    OM_TRY(om__link_add(l, LINK_OUT, LINK_POSE, "ECM/setpoint_cp", 5, &e->setpoint_cp));
    const unsigned latched = LINK_OUT | LINK_LATCHED;
    OM_TRY(om__link_add(l, latched, LINK_STATE, "ECM/operating_state", 10, &e->state));
    const LinkType words = r->def.has_stamped_strings ? LINK_STAMPED : LINK_STRING;
    OM_TRY(om__link_add(l, LINK_OUT, words, "ECM/error", 5, &e->error));
    OM_TRY(om__link_add(l, LINK_OUT, words, "ECM/status", 5, &e->status));
    return om__link_add(l, LINK_OUT, words, "ECM/warning", 5, &e->warning);
}

static OmStatus add_eye(OmDdsRobot* r, Eye* eye, const char* name, bool has_cloud) {
    char topic[80];
    eye->frame = has_cloud ? "depth_optical" : "endoscope_optical";
    eye->cloud = -1;
    snprintf(topic, sizeof topic, "%s/camera_info", name);
    OM_TRY(om__link_add(r->link, LINK_OUT, LINK_INFO, topic, 1, &eye->info));
    snprintf(topic, sizeof topic, "%s/image_raw", name);
    OM_TRY(om__link_add(r->link, LINK_OUT, LINK_IMAGE, topic, 2, &eye->image));
    if (!has_cloud) return OM_OK;
    snprintf(topic, sizeof topic, "%s/points", name);
    return om__link_add(r->link, LINK_OUT, LINK_CLOUD, topic, 2, &eye->cloud);
}

static OmStatus add_all(OmDdsRobot* r) {
    for (int a = 0; a < r->narm; ++a) OM_TRY(add_topics(r, &r->hand[a]));
    OM_TRY(add_ecm(r));
    OM_TRY(add_eye(r, &r->endoscope, "endoscope", false));
    OM_TRY(add_eye(r, &r->depth, "depth", true));
    OM_TRY(om__link_add(r->link, LINK_OUT, LINK_CLOCK, "clock", 1, &r->clock));
    OM_TRY(om__link_add(r->link, LINK_OUT, LINK_TF, "tf", 10, &r->tf));
    OM_TRY(om__link_add(r->link, LINK_OUT | LINK_LATCHED, LINK_TF, "tf_static", 1, &r->tf_static));
    const LinkType words = r->def.has_stamped_strings ? LINK_STAMPED : LINK_STRING;
    OM_TRY(om__link_add(r->link, LINK_OUT, words, "system/status", 5, &r->status));
    for (int k = 0; k < NSYSTEM; ++k)
        OM_TRY(om__link_add(r->link, LINK_IN, LINK_EMPTY, system_topic[k].name, 1, &r->system[k]));
    r->tick_in = r->tick_out = -1;
    if (!r->def.is_lock_step) return OM_OK;
    OM_TRY(om__link_add(r->link, LINK_OUT, LINK_TOCK, "omentum/tock", 10, &r->tick_out));
    return om__link_add(r->link, LINK_IN, LINK_TICK, "omentum/tick", 10, &r->tick_in);
}

// ---- messages to others -------------------------------------------------------------------------------------------

// Only where somebody listens, or the recording does.
static OmStatus send(OmDdsRobot* r, int id, const LinkMessage* m) {
    return om__link_is_wanted(r->link, id) ? om__link_write(r->link, id, m) : OM_OK;
}

static LinkMessage message_in(const OmDdsRobot* r, const char* frame) {
    LinkMessage m = {.time = stamp(r)};
    snprintf(m.frame, sizeof m.frame, "%s", frame);
    return m;
}

static OmStatus send_words(OmDdsRobot* r, int id, const char* words) {
    LinkMessage m = message_in(r, "");
    snprintf(m.text, sizeof m.text, "%s", words);
    return om__link_write(r->link, id, &m);
}

static OmStatus send_state(OmDdsRobot* r, Hand* hand) {
    LinkMessage m = message_in(r, hand->name);
    snprintf(m.state.name, sizeof m.state.name, "%s", om__arm_mode_name(hand->core.mode));
    m.state.is_homed = hand->core.is_homed;
    m.state.is_busy = hand->was_busy = hand->core.motion == ARM_MOVE;
    return om__link_write(r->link, hand->state, &m);
}

// After a state command; FAULT is also an error.
static OmStatus tell_state(OmDdsRobot* r, Hand* hand, const char* command) {
    const Arm* arm = &hand->core;
    char words[256];
    say(r, "%s: %s: %s%s", hand->name, command, om__arm_mode_name(arm->mode),
        arm->is_homed ? ", homed" : "");
    snprintf(words, sizeof words, "%s is in FAULT: state command \"%.100s\"", hand->name, command);
    if (arm->mode == ARM_FAULT) OM_TRY(send_words(r, hand->error, words));
    OM_TRY(send_words(r, hand->status, om__arm_mode_name(arm->mode)));
    return send_state(r, hand);
}

// A command that is refused changes nothing; its sender reads why.
static OmStatus refuse(OmDdsRobot* r, Hand* hand, int topic) {
    char words[256];
    ++r->report.nrefused;
    snprintf(words, sizeof words, "%s refused: %s", om__link_name(r->link, topic),
             om_error_message());
    say(r, "%s", words);
    return send_words(r, hand->warning, words);
}

static LinkMessage joints_message(const OmDdsRobot* r, int n, const double* position,
                                  const double* velocity) {
    LinkMessage m = message_in(r, "");
    LinkJoints* j = &m.joints;
    j->nname = j->nposition = n;
    j->nvelocity = velocity ? n : 0;
    for (int i = 0; i < n; ++i) {
        snprintf(j->name[i], sizeof j->name[i], "%s", n == 1 ? "jaw" : om__arm_joint_name(i));
        j->position[i] = position[i];
        if (velocity) j->velocity[i] = velocity[i];
    }
    return m;
}

static OmStatus send_pose(OmDdsRobot* r, int id, const char* frame, OmPose pose) {
    LinkMessage m = message_in(r, frame);
    m.pose = pose;
    return send(r, id, &m);
}

static OmStatus send_forces(OmDdsRobot* r, Hand* hand, const OmArmObservation* o) {
    if (!o->has_wrench) return OM_OK;
    const OmQuat back = om_quat_conj(o->tip.q);
    LinkMessage m = message_in(r, WORLD);
    m.wrench.force = o->force, m.wrench.torque = o->torque;
    OM_TRY(send(r, hand->spatial_cf, &m));
    m = message_in(r, hand->name);
    m.wrench.force = om_quat_rotate(back, o->force);
    m.wrench.torque = om_quat_rotate(back, o->torque);
    return send(r, hand->body_cf, &m);
}

// Between the last two measured poses, in the frame of measured_cp.
static OmStatus send_speed(OmDdsRobot* r, Hand* hand, OmPose tip, double dt) {
    LinkMessage m = message_in(r, WORLD);
    if (hand->has_last && dt > 0) {
        m.twist.linear = om_scale(1 / dt, om_sub(tip.p, hand->last_tip.p));
        m.twist.angular = om_scale(1 / dt, om__arm_turn(hand->last_tip.q, tip.q));
    }
    hand->last_tip = tip;
    return send(r, hand->measured_cv, &m);
}

static OmStatus send_joints(OmDdsRobot* r, Hand* hand, const OmArmObservation* o, double dt) {
    double speed[OM_PSM_NJOINT] = {0};
    for (int i = 0; hand->has_last && dt > 0 && i < OM_PSM_NJOINT; ++i)
        speed[i] = (o->q[i] - hand->last_q[i]) / dt;
    memcpy(hand->last_q, o->q, sizeof hand->last_q);
    hand->has_last = true;
    LinkMessage m = joints_message(r, OM_PSM_NJOINT, o->q, speed);
    OM_TRY(send(r, hand->measured_js, &m));
    m = joints_message(r, OM_PSM_NJOINT, hand->core.q, NULL);
    OM_TRY(send(r, hand->setpoint_js, &m));
    m = joints_message(r, 1, &o->jaw, &o->jaw_speed);
    OM_TRY(send(r, hand->jaw_measured, &m));
    m = joints_message(r, 1, &o->jaw_goal, NULL);
    return send(r, hand->jaw_setpoint, &m);
}

static OmStatus publish_arm(OmDdsRobot* r, int a, double dt) {
    Hand* hand = &r->hand[a];
    const OmArmObservation* o = &r->obs.arm[a];
    const OmPose back = om_pose_inverse(hand->core.psm.pose_world_rcm);
    char base[32];
    snprintf(base, sizeof base, "%s_base", hand->name);
    OM_TRY(send_forces(r, hand, o));
    OM_TRY(send_speed(r, hand, o->tip, dt));
    OM_TRY(send_joints(r, hand, o, dt));
    OM_TRY(send_pose(r, hand->measured_cp, WORLD, o->tip));
    OM_TRY(send_pose(r, hand->setpoint_cp, WORLD, hand->core.setpoint));
    OM_TRY(send_pose(r, hand->local_measured, base, om_pose_mul(back, o->tip)));
    return send_pose(r, hand->local_setpoint, base, om_pose_mul(back, hand->core.setpoint));
}

static void add_frame(LinkMessage* m, const char* child, OmPose pose_world_child) {
    LinkFrame* f = &m->tf.frame[m->tf.n++];
    snprintf(f->parent, sizeof f->parent, "%s", WORLD);
    snprintf(f->child, sizeof f->child, "%s", child);
    f->pose = pose_world_child;
}

static OmStatus publish_arms(OmDdsRobot* r, double dt) {
    LinkMessage m = message_in(r, "");
    OM_TRY(om__link_write(r->link, r->clock, &m));
    for (int a = 0; a < r->narm; ++a) {
        add_frame(&m, r->hand[a].name, r->obs.arm[a].tip);
        OM_TRY(publish_arm(r, a, dt));
    }
    add_frame(&m, r->ecm.name, r->endoscope.camera.pose_world_camera);
    OM_TRY(send_pose(r, r->ecm.measured_cp, WORLD, r->endoscope.camera.pose_world_camera));
    OM_TRY(send_pose(r, r->ecm.setpoint_cp, WORLD, r->endoscope.camera.pose_world_camera));
    return send(r, r->tf, &m);
}

static OmStatus publish_info(OmDdsRobot* r) {
    const Eye* eyes[2] = {&r->endoscope, &r->depth};
    for (int k = 0; k < 2; ++k) {
        LinkMessage m = message_in(r, eyes[k]->frame);
        m.info.width = eyes[k]->camera.width;
        m.info.height = eyes[k]->camera.height;
        m.info.lens = om_camera_lens(&eyes[k]->camera);
        OM_TRY(send(r, eyes[k]->info, &m));
    }
    return OM_OK;
}

static OmStatus publish_static(OmDdsRobot* r) {
    LinkMessage m = message_in(r, "");
    char base[32];
    for (int a = 0; a < r->narm; ++a) {
        snprintf(base, sizeof base, "%s_base", r->hand[a].name);
        add_frame(&m, base, r->hand[a].core.psm.pose_world_rcm);
    }
    add_frame(&m, r->endoscope.frame, r->endoscope.camera.pose_world_camera);
    add_frame(&m, r->depth.frame, r->depth.camera.pose_world_camera);
    OM_TRY(om__link_write(r->link, r->tf_static, &m));
    for (int a = 0; a < r->narm; ++a) {
        OM_TRY(send_state(r, &r->hand[a]));
        OM_TRY(send_words(r, r->hand[a].tool_type, "PROGRASP_FORCEPS:400093"));
    }
    return send_state(r, &r->ecm);
}

// ---- pictures -----------------------------------------------------------------------------------------------------

static LinkMessage picture_message(const OmDdsRobot* r, const char* frame) {
    LinkMessage m = {.time = r->stamp_origin + r->seen.time};
    snprintf(m.frame, sizeof m.frame, "%s", frame);
    return m;
}

static OmStatus send_cloud(OmDdsRobot* r, const OmDepthPicture* p) {
    LinkMessage m = picture_message(r, r->depth.frame);
    m.picture = om__cloud_pack(&r->points, p);
    return om__link_write(r->link, r->depth.cloud, &m);
}

static OmStatus send_image(OmDdsRobot* r, const Eye* eye, int width, int height,
                           const char* encoding, int nbyte, const void* data) {
    LinkMessage m = picture_message(r, eye->frame);
    m.picture = (LinkPicture){.width = width,
                              .height = height,
                              .step = nbyte * width,
                              .data = data,
                              .size = (size_t)nbyte * (size_t)width * (size_t)height};
    snprintf(m.picture.encoding, sizeof m.picture.encoding, "%s", encoding);
    return om__link_write(r->link, eye->image, &m);
}

// Render and send OM_OBSERVE_ flags `what` of a world at rest between two steps. Also called by the job, which shares
// nothing but constants, the link, and the fields of pictures with the other thread.
static OmStatus take_pictures(OmDdsRobot* r, OmWorld* world, unsigned what) {
    const double start = om_clock_now();
    what &= om_world_sources(world) & (OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR);
    r->taken = 0;
    if (!what) return OM_OK;
    OM_TRY(om_world_observe(world, what, &r->seen));
    const OmPicture* color = &r->seen.endoscope.color;
    const OmDepthPicture* depth = &r->seen.rgbd;
    if (color->pixel)
        OM_TRY(send_image(r, &r->endoscope, color->width, color->height,
                          color->nchannel == 3 ? "rgb8" : "mono8", color->nchannel, color->pixel));
    if (depth->depth && om__link_is_wanted(r->link, r->depth.image))
        OM_TRY(send_image(r, &r->depth, depth->camera.width, depth->camera.height, "32FC1", 4,
                          depth->depth));
    if (depth->depth) OM_TRY(send_cloud(r, depth));
    r->taken = om_clock_now() - start;
    return OM_OK;
}

static void count_pictures(OmDdsRobot* r) {
    r->report.npicture += r->taken > 0;
    r->render += r->taken;
}

static OmStatus publish_pictures(OmDdsRobot* r, unsigned what) {
    OM_TRY(take_pictures(r, r->def.world, what));
    count_pictures(r);
    return OM_OK;
}

static OmStatus look(void* ctx, const OmProgress* progress) {
    OmDdsRobot* r = ctx;
    (void)progress;
    // the arms come first; on Linux: of this thread and its children
    (void)setpriority(PRIO_PROCESS, 0, LOOK_NICE);
    OM_TRY(om_world_restore(r->def.eyes, r->snapshot));
    return take_pictures(r, r->def.eyes, r->wanted);
}

// The job ends before the next one begins.
static OmStatus end_look(OmDdsRobot* r) {
    if (!r->job) return OM_OK;
    const OmStatus status = om_job_join(r->job);
    r->job = NULL;
    count_pictures(r);
    return status;
}

static OmStatus begin_look(OmDdsRobot* r, unsigned what) {
    if (!r->def.eyes) return publish_pictures(r, what);
    OM_TRY(end_look(r));
    if (!what) return OM_OK;
    OM_TRY(om_world_save(r->def.world, r->snapshot));
    r->wanted = what;
    return om_job_start(look, r, &r->job);
}

// What the readers of pictures want.
static unsigned wanted_pictures(const OmDdsRobot* r) {
    unsigned what = 0;
    if (om__link_is_wanted(r->link, r->endoscope.image)) what |= OM_OBSERVE_IMAGE;
    if (om__link_is_wanted(r->link, r->depth.image)) what |= OM_OBSERVE_DEPTH;
    if (om__link_is_wanted(r->link, r->depth.cloud)) what |= OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR;
    return what;
}

// ---- OpenIGTLink --------------------------------------------------------------------------------------------------

static OmStatus show(OmDdsRobot* r) {
    OmWatchTool tool[OM_MAX_ARM + 1];
    if (!r->watch || !om_watch_is_due(r->watch)) return OM_OK;
    for (int a = 0; a < r->narm; ++a) tool[a] = (OmWatchTool){r->hand[a].name, r->obs.arm[a].tip};
    tool[r->narm] = (OmWatchTool){r->ecm.name, r->endoscope.camera.pose_world_camera};
    return om_watch_send(r->watch, stamp(r), tool, r->narm + 1,
                         om_body_x(om_world_truth(r->def.world)));
}

// ---- commands -----------------------------------------------------------------------------------------------------

// The last message of a topic; all are counted.
static bool take_last(OmDdsRobot* r, int id, LinkMessage* m) {
    bool is_there = false;
    while (om__link_take(r->link, id, m)) {
        is_there = true;
        ++r->ntaken;
        ++r->report.ncommand;
    }
    return is_there;
}

static OmStatus take_states(OmDdsRobot* r, Hand* hand) {
    LinkMessage m;
    while (om__link_take(r->link, hand->state_command, &m)) {
        ++r->ntaken;
        ++r->report.ncommand;
        if (om__arm_command(&hand->core, m.text) < 0) {
            OM_TRY(refuse(r, hand, hand->state_command));
            continue;
        }
        OM_TRY(tell_state(r, hand, m.text));
    }
    return OM_OK;
}

// In the frame that measured_cp has.
static OmStatus check_frame(const LinkMessage* m) {
    OM_CHECK(!m->frame[0] || strcmp(m->frame, WORLD) == 0, OM_INVALID,
             "the goal is in frame \"%s\"; must be \"" WORLD "\" or empty", m->frame);
    return OM_OK;
}

static OmStatus obey_servo_cp(Arm* arm, double time, const LinkMessage* m) {
    OM_TRY(check_frame(m));
    return om__arm_servo_cp(arm, time, m->pose);
}

static OmStatus obey_move_cp(Arm* arm, double time, const LinkMessage* m) {
    OM_TRY(check_frame(m));
    return om__arm_move_cp(arm, time, m->pose);
}

// Forces of a jaw are not simulated: the first command of each direction says so.
static OmStatus obey_jaw_effort(OmDdsRobot* r, Hand* hand, const LinkJoints* joints) {
    const double before = hand->core.jaw_goal;
    if (om__arm_jaw_effort(&hand->core, joints) < 0) return refuse(r, hand, hand->jaw_effort);
    const double effort = joints->effort[0];
    if (hand->core.jaw_goal == before) return OM_OK;
    if (effort == 0) return send_words(r, hand->status, "jaw/servo_jf: the jaw stays where it is");
    return send_words(r, hand->status,
                      effort < 0 ? "jaw/servo_jf: the jaw closes; its force is not simulated"
                                 : "jaw/servo_jf: the jaw opens; its force is not simulated");
}

static OmStatus take_hand(OmDdsRobot* r, Hand* hand) {
    Arm* arm = &hand->core;
    const double time = r->obs.time;
    LinkMessage m;
    OM_TRY(take_states(r, hand));
    if (take_last(r, hand->servo_jp, &m) && om__arm_servo_jp(arm, time, &m.joints) < 0)
        OM_TRY(refuse(r, hand, hand->servo_jp));
    if (take_last(r, hand->servo_cp, &m) && obey_servo_cp(arm, time, &m) < 0)
        OM_TRY(refuse(r, hand, hand->servo_cp));
    if (take_last(r, hand->move_jp, &m) && om__arm_move_jp(arm, time, &m.joints) < 0)
        OM_TRY(refuse(r, hand, hand->move_jp));
    if (take_last(r, hand->move_cp, &m) && obey_move_cp(arm, time, &m) < 0)
        OM_TRY(refuse(r, hand, hand->move_cp));
    if (take_last(r, hand->hold, &m)) om__arm_hold(arm);
    if (take_last(r, hand->ratio, &m) && om__arm_set_ratio(arm, m.number) < 0)
        OM_TRY(refuse(r, hand, hand->ratio));
    if (take_last(r, hand->jaw_servo, &m) && om__arm_jaw(arm, &m.joints) < 0)
        OM_TRY(refuse(r, hand, hand->jaw_servo));
    if (take_last(r, hand->jaw_move, &m) && om__arm_jaw(arm, &m.joints) < 0)
        OM_TRY(refuse(r, hand, hand->jaw_move));
    if (take_last(r, hand->jaw_effort, &m)) OM_TRY(obey_jaw_effort(r, hand, &m.joints));
    if (take_last(r, hand->tool_present, &m))
        OM_TRY(send_words(r, hand->status,
                          "emulate_tool_present: nothing is done; the tool is always there"));
    return OM_OK;
}

// ---- datagrams ----------------------------------------------------------------------------------------------------

static OmPose pose_of(const double x[7]) {
    return (OmPose){om_load3(x, 0), (OmQuat){.w = x[6], .x = x[3], .y = x[4], .z = x[5]}};
}

// A move by UDP has no reader that could go away: its client shows by any datagram that it lives.
static OmStatus begin_udp_move(OmDdsRobot* r, Hand* hand, const UdpCommand* c,
                               const LinkJoints* q) {
    Arm* arm = &hand->core;
    if (c->kind == UDP_MOVE_CP)
        OM_TRY(om__arm_move_cp(arm, r->obs.time, pose_of(c->x)));
    else
        OM_TRY(om__arm_move_jp(arm, r->obs.time, q));
    arm->patience = UDP_PATIENCE;
    hand->mover = om__udp_sender(r->udp);
    return OM_OK;
}

static void hear_sender(OmDdsRobot* r) {
    for (int a = 0; a < r->narm; ++a) {
        Hand* hand = &r->hand[a];
        const bool is_its_move = hand->core.motion == ARM_MOVE && isfinite(hand->core.patience);
        if (is_its_move && hand->mover == om__udp_sender(r->udp)) hand->core.heard = r->obs.time;
    }
}

static OmStatus obey_datagram(OmDdsRobot* r, const char* data, size_t size) {
    UdpCommand c;
    OM_TRY(om__udp_parse(data, size, &c));
    Hand* hand = NULL;
    for (int a = 0; a < r->narm; ++a)
        if (strcmp(r->hand[a].name, c.arm) == 0) hand = &r->hand[a];
    OM_CHECK(hand, OM_INVALID, "no arm \"%s\"", c.arm);
    Arm* arm = &hand->core;
    LinkJoints joints = {.nposition = c.n};
    memcpy(joints.position, c.x, (size_t)c.n * sizeof *c.x);
    switch (c.kind) {
    case UDP_SERVO_CP: return om__arm_servo_cp(arm, r->obs.time, pose_of(c.x));
    case UDP_SERVO_JP: return om__arm_servo_jp(arm, r->obs.time, &joints);
    case UDP_MOVE_CP:
    case UDP_MOVE_JP: return begin_udp_move(r, hand, &c, &joints);
    case UDP_JAW: return om__arm_jaw(arm, &joints);
    case UDP_HOLD: om__arm_hold(arm); return OM_OK;
    case UDP_STATE: OM_TRY(om__arm_command(arm, c.text)); return tell_state(r, hand, c.text);
    default: return OM_OK;
    }
}

// The state of all arms, and why a command was refused.
static OmStatus print_reply(OmDdsRobot* r, const char* refused) {
    r->reply.len = 0;
    OmJson json = om_json_begin(&r->reply);
    om_json_open(&json, NULL, '{');
    om_json_number(&json, "time", r->obs.time);
    om_json_string(&json, "refused", refused);
    for (int a = 0; a < r->narm; ++a)
        om__udp_print_arm(&json, r->hand[a].name, &r->hand[a].core, &r->obs.arm[a]);
    om_json_close(&json, '}');
    return om_json_end(&json);
}

static OmStatus serve_datagrams(OmDdsRobot* r) {
    const char* data;
    size_t size;
    for (int k = 0; k < UDP_MOST && r->udp && om__udp_take(r->udp, &data, &size); ++k) {
        hear_sender(r);
        const OmStatus status = obey_datagram(r, data, size);
        if (status < 0 && status != OM_INVALID) return status;
        r->has_said_silent = true;  // somebody speaks
        ++r->report.ncommand;
        r->report.nrefused += status < 0;
        OM_TRY(print_reply(r, status < 0 ? om_error_message() : ""));
        om__udp_answer(r->udp, r->reply.str, r->reply.len);
    }
    return OM_OK;
}

static OmStatus take_system(OmDdsRobot* r) {
    LinkMessage m;
    for (int k = 0; k < NSYSTEM; ++k) {
        if (!take_last(r, r->system[k], &m)) continue;
        for (int a = 0; a < r->narm && k == POWER_OFF; ++a) om__arm_hold(&r->hand[a].core);
        OM_TRY(send_words(r, r->status, system_topic[k].answer));
    }
    return OM_OK;
}

static OmStatus take_commands(OmDdsRobot* r) {
    OM_TRY(serve_datagrams(r));
    OM_TRY(take_system(r));
    for (int a = 0; a < r->narm; ++a) OM_TRY(take_hand(r, &r->hand[a]));
    Hand* ecm = &r->ecm;
    LinkMessage m;
    OM_TRY(take_states(r, ecm));
    const int moves[2] = {ecm->servo_cp, ecm->move_cp};
    for (int k = 0; k < 2; ++k) {
        if (!take_last(r, moves[k], &m)) continue;
        om_error(OM_INVALID, "the endoscope of a scene does not move");
        OM_TRY(refuse(r, ecm, moves[k]));
    }
    return OM_OK;
}

// ---- ticks --------------------------------------------------------------------------------------------------------

static OmStatus stop_hand(OmDdsRobot* r, Hand* hand, const char* why) {
    char words[256];
    om__arm_hold(&hand->core);
    snprintf(words, sizeof words, "the arm stops before its goal: %s", why);
    say(r, "%s: %s", hand->name, words);
    return send_words(r, hand->warning, words);
}

// Of joints within their limits the world sees the pose alone, and may find other joints that are not: the arm then
// stays where it was.
static OmStatus move_hand(OmDdsRobot* r, int a, double dt) {
    Hand* hand = &r->hand[a];
    const Arm before = hand->core;
    if (om__arm_step(&hand->core, r->obs.time, dt)) {
        const OmStatus moved = om_world_move(r->def.world, a, hand->core.setpoint, FAST);
        if (moved < 0 && moved != OM_INVALID) return moved;
        if (moved < 0) {
            hand->core.setpoint = before.setpoint;
            memcpy(hand->core.q, before.q, sizeof before.q);
            OM_TRY(stop_hand(r, hand, om_error_message()));
        }
    }
    if (hand->core.has_timed_out) {
        say(r, "%s: no command for %.2f s: it stops before its goal", hand->name,
            r->obs.time - hand->core.heard);
        OM_TRY(send_words(r, hand->warning, "no command in time: the arm stops before its goal"));
    }
    return om_world_set_jaw(r->def.world, a, hand->core.jaw_goal);
}

// Where a jaw stops: a jaw on tissue that closes keeps its goal, and its grip.
static void see_jaw(OmDdsRobot* r, int a) {
    Arm* arm = &r->hand[a].core;
    const double jaw = r->obs.arm[a].jaw;
    const bool is_holding = om_body_is_holding(om_world_truth(r->def.world), a);
    arm->jaw_stop = is_holding ? fmin(arm->jaw_goal, jaw) : jaw;
}

static OmStatus advance(OmDdsRobot* r, double dt) {
    for (int a = 0; a < r->narm; ++a) OM_TRY(move_hand(r, a, dt));
    OM_TRY(om_world_advance(r->def.world, dt));
    OM_TRY(om_world_observe(r->def.world, 0, &r->obs));
    for (int a = 0; a < r->narm; ++a) see_jaw(r, a);
    ++r->report.ntick;
    for (int a = 0; a < r->narm; ++a) {
        Hand* hand = &r->hand[a];
        if (hand->was_busy != (hand->core.motion == ARM_MOVE)) OM_TRY(send_state(r, hand));
    }
    OM_TRY(publish_arms(r, dt));
    om__periods_count(&r->periods, om_clock_now(), 1 / r->def.rate);
    return OM_OK;
}

// ROS programs that speak another protocol than DDS hear nothing, without a word.
static void watch_readers(OmDdsRobot* r) {
    int n = 0;
    for (int a = 0; a < r->narm; ++a)
        n += om__link_count(r->link, r->hand[a].measured_cp) +
             om__link_count(r->link, r->hand[a].measured_js);
    if (n > 0 && !r->has_readers) say(r, "a client reads the arms");
    if (n == 0 && r->has_readers) {
        for (int a = 0; a < r->narm; ++a) om__arm_hold(&r->hand[a].core);
        say(r, "no client reads the arms any more; they stop where they are");
    }
    r->has_readers = n > 0;
    if (n > 0) r->has_said_silent = true;
    if (n > 0 || r->has_said_silent || om_clock_now() - r->begun < SILENCE) return;
    r->has_said_silent = true;
    say(r,
        "no client reads the arms after %.0f s. ROS 2 with rmw_zenoh hears nothing of DDS: set "
        "RMW_IMPLEMENTATION=rmw_cyclonedds_cpp or rmw_fastrtps_cpp there, and the same "
        "ROS_DOMAIN_ID (here %d)",
        SILENCE, r->def.dds.domain);
}

static void wait_until(double time) {
    const double left = time - om_clock_now();
    if (left <= 0) return;
    const struct timespec t = {(time_t)left, (long)(1e9 * (left - floor(left)))};
    nanosleep(&t, NULL);
}

static OmStatus run_by_clock(OmDdsRobot* r, double end, const OmProgress* progress) {
    const double dt = 1 / r->def.rate;
    double next = om_clock_now() + dt;
    while (r->obs.time < end - 0.5 * dt) {
        OM_TRY(om_progress_report(progress, "dvrk", r->obs.time, end));
        wait_until(next);
        OM_TRY(take_commands(r));
        OM_TRY(advance(r, dt));
        const bool is_free = !r->job || om_job_is_finished(r->job);
        if (r->def.picture_rate > 0 && is_free && r->obs.time >= r->next_picture) {
            OM_TRY(publish_info(r));
            OM_TRY(begin_look(r, wanted_pictures(r)));
            r->next_picture = fmax(r->next_picture + 1 / r->def.picture_rate, r->obs.time);
        }
        OM_TRY(show(r));
        watch_readers(r);
        next += dt;
        if (om_clock_now() - next > 0.1) next = om_clock_now();  // slower than time: no hurry after
    }
    return end_look(r);
}

// A tick: advance, send what is wanted, answer. An error of the world ends the robot; the client reads it first.
static OmStatus make_tick(OmDdsRobot* r) {
    LinkMessage answer = r->tick;
    OmStatus status = OM_OK;
    r->has_tick = false;
    if (r->tick.tick.dt > 0)
        status = advance(r, r->tick.tick.dt);
    else
        status = publish_arms(r, 0);
    if (status >= 0) status = publish_pictures(r, r->tick.tick.what);
    answer.time = r->obs.time;
    answer.tick.error[0] = 0;
    if (status < 0) snprintf(answer.tick.error, sizeof answer.tick.error, "%s", om_error_message());
    OM_TRY(om__link_write(r->link, r->tick_out, &answer));
    return status;
}

static OmStatus take_tick(OmDdsRobot* r) {
    if (!r->has_tick && om__link_take(r->link, r->tick_in, &r->tick)) {
        r->has_tick = isfinite(r->tick.tick.dt) && r->tick.tick.dt < 1;
        if (r->tick.tick.client != r->client) {
            say(r, "a client makes the ticks");
            r->client = r->tick.tick.client;
            r->ntaken = 0;
        }
    }
    return r->has_tick && r->ntaken >= r->tick.tick.ncommand ? make_tick(r) : OM_OK;
}

static OmStatus run_in_lock_step(OmDdsRobot* r, double end, const OmProgress* progress) {
    double last = om_clock_now();
    while (r->obs.time < end) {
        const int64_t before = r->report.ntick;
        OM_TRY(om_progress_report(progress, "dvrk", r->obs.time, end));
        om__link_wait(r->link, BEAT);
        OM_TRY(take_commands(r));
        OM_TRY(take_tick(r));
        OM_TRY(show(r));
        watch_readers(r);
        const double now = om_clock_now();
        if (before != r->report.ntick) last = now;
        if (now - last < BEAT) continue;
        // clients give up on a robot that is silent
        OM_TRY(publish_info(r));
        OM_TRY(publish_arms(r, 0));
        last = now;
    }
    return OM_OK;
}

OmStatus om_dds_robot_run(OmDdsRobot* robot, double seconds, const OmProgress* progress) {
    const double end = robot->obs.time + seconds;
    return robot->def.is_lock_step ? run_in_lock_step(robot, end, progress)
                                   : run_by_clock(robot, end, progress);
}

// ---- creation -----------------------------------------------------------------------------------------------------

static OmStatus check_def(const OmDdsRobotDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID, "OmDdsRobotDef was not made by default_def");
    OM_CHECK(def->world && def->scene && def->site, OM_INVALID,
             "OmDdsRobotDef: world, scene or site is null");
    OM_CHECK(def->record || !def->has_record_pictures, OM_INVALID,
             "OmDdsRobotDef.has_record_pictures needs a file to record to");
    OM_CHECK(def->rate >= 1 && def->rate <= 1000, OM_INVALID,
             "OmDdsRobotDef.rate is %g Hz; 1 to 1000", def->rate);
    OM_CHECK(def->udp_port >= 0 && def->udp_port <= 65535, OM_INVALID,
             "OmDdsRobotDef.udp_port is %d; 0 to 65535", def->udp_port);
    OM_CHECK(def->igtl_port >= 0 && def->igtl_port <= 65535, OM_INVALID,
             "OmDdsRobotDef.igtl_port is %d; 0 to 65535", def->igtl_port);
    OM_CHECK(def->picture_rate >= 0 && def->picture_rate <= 1000, OM_INVALID,
             "OmDdsRobotDef.picture_rate is %g Hz; 0 to 1000", def->picture_rate);
    return OM_OK;
}

// The robot knows its base where its measurements put it: off by the error of its calibration.
static OmStatus begin_hand(OmDdsRobot* r, int a) {
    OmPsm psm = om_world_place_psm(r->def.site, a);
    OmPose tip;
    OM_CHECK(om_world_setpoint(r->def.world, a, &tip), OM_INVALID,
             "OmDdsRobotDef.world is not simulated");
    const OmVec3 off = om_sub(tip.p, om_world_place_tip(r->def.site, a).p);
    psm.pose_world_rcm.p = om_add(psm.pose_world_rcm.p, off);
    const double zero[OM_PSM_NJOINT] = {0};
    double q[OM_PSM_NJOINT];
    snprintf(r->hand[a].name, sizeof r->hand[a].name, "PSM%d", a + 1);
    OM_TRY(om_psm_inverse(&psm, tip, zero, q));
    om__arm_init(&r->hand[a].core, &psm, tip, q, r->obs.arm[a].jaw_goal);
    return OM_OK;
}

static OmStatus begin(OmDdsRobot* r) {
    const unsigned has = om_world_sources(r->def.world);
    OM_TRY(om_world_observe(r->def.world, has & (OM_OBSERVE_DEPTH | OM_OBSERVE_IMAGE), &r->obs));
    r->endoscope.camera = r->obs.endoscope.camera;
    r->depth.camera = r->obs.rgbd.camera;
    r->narm = om_world_narm(r->def.world);
    for (int a = 0; a < r->narm; ++a) OM_TRY(begin_hand(r, a));
    OM_TRY(om__cloud_init(&r->depth.camera, &r->points));
    if (r->def.eyes) {
        const size_t size = om_world_state_size(r->def.world);
        OM_CHECK(size > 0 && om_world_state_size(r->def.eyes) == size, OM_INVALID,
                 "OmDdsRobotDef.eyes is no world of this scene");
        r->snapshot = om_alloc(size, 1);
        if (!r->snapshot) return OM_NO_MEMORY;
    }
    const OmTetMesh* mesh = om_body_mesh(om_world_truth(r->def.world));
    if (r->def.igtl_port > 0) OM_TRY(om_watch_create(r->def.igtl_port, mesh, &r->watch));
    if (r->def.udp_port > 0) OM_TRY(om__udp_open(r->def.udp_port, &r->udp));
    OM_TRY(om__link_create(&r->def.dds, &r->link));
    if (r->def.record) OM_TRY(om__mcap_open(r->def.record, &r->mcap));
    om__link_record(r->link, r->mcap, r->def.has_record_pictures);
    OM_TRY(add_all(r));
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    const double epoch = (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
    r->stamp_origin = r->def.is_lock_step ? 0 : epoch - r->obs.time;
    r->begun = om_clock_now();
    return publish_static(r);
}

OmStatus om_dds_robot_create(const OmDdsRobotDef* def, OmDdsRobot** robot) {
    *robot = NULL;
    OM_TRY(check_def(def));
    OmDdsRobot* r = om_calloc(1, sizeof *r);
    if (!r) return OM_NO_MEMORY;
    r->def = *def;
    const OmStatus status = begin(r);
    if (status < 0)
        om_dds_robot_destroy(r);
    else
        *robot = r;
    return status < 0 ? status : OM_OK;
}

OmStatus om_dds_robot_end_record(OmDdsRobot* robot) {
    const OmStatus status = end_look(robot);
    Mcap* mcap = robot->mcap;
    robot->mcap = NULL;
    om__link_record(robot->link, NULL, false);
    const OmStatus closed = om__mcap_close(mcap);
    return status < 0 ? status : closed;
}

void om_dds_robot_destroy(OmDdsRobot* robot) {
    if (!robot) return;
    om_job_join(robot->job);
    om__mcap_close(robot->mcap);
    om__link_destroy(robot->link);
    om__udp_close(robot->udp);
    om_watch_destroy(robot->watch);
    om_text_done(&robot->reply);
    om_observation_done(&robot->obs);
    om_observation_done(&robot->seen);
    om_free(robot->snapshot);
    om__cloud_done(&robot->points);
    om_free(robot);
}

OmDdsReport om_dds_robot_report(const OmDdsRobot* robot) {
    OmDdsReport report = robot->report;
    report.time = robot->obs.time;
    report.wall_time = om_clock_now() - robot->begun;
    report.period_median = om__periods_quantile(&robot->periods, 0.5);
    report.period_99 = om__periods_quantile(&robot->periods, 0.99);
    report.period_max = robot->periods.longest;
    report.nlate = robot->periods.nlate;
    report.picture_render =
        report.npicture > 0 ? robot->render / (double)report.npicture : (double)NAN;
    return report;
}
