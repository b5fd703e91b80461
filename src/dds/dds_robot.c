// dds_robot.c: the simulated robot: a world behind the topics of a da Vinci Research Kit.
//
//   topics --dds_obey.c--> Arm (dds_arm.c) --om__arm_step--> om_world_move, om_world_advance
//                                                                      |
//   topics <------dds_publish.c, dds_eyes.c----------- om_world_observe
//
// One tick is one step of the world. By the wall clock there are `rate` of them in a second; in lock-step a tick is
// made when a client asks for it, once its commands are there: topics have no order between each other, so the tick
// says how many commands it follows.
#include <stddef.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include "dds/dds_robot.h"

#define COOKIE 0xdd5002u
#define SILENCE 5.0  // s without a reader after which the robot says so
#define BEAT 0.1     // s between two messages while a lock-step stands still
#define FAST 1e3     // m/s: the world reaches the setpoint within the step

OmDdsRobotDef om_dds_robot_default_def(OmWorld* world, const OmScene* scene, const OmSite* site) {
    return (OmDdsRobotDef){.cookie = COOKIE,
                           .dds = om_dds_default_def(),
                           .world = world,
                           .scene = scene,
                           .site = site,
                           .rate = 100,
                           .tool_type = "PROGRASP_FORCEPS:400093",
                           .arm = {"PSM1", "PSM2"},
                           .picture_rate = 30};
}

// Of the whole system: a simulated robot has no power, and each arm is homed by its own state_command.
static const char* const system_topic[NSYSTEM] = {"system/power_on", "system/power_off",
                                                  "system/home"};

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
    IN(freed, LINK_EMPTY, "free"),
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
        *id = -1;
        if (!hand->core.psm.has_jaw && strncmp(t->name, "jaw/", 4) == 0) continue;
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
        OM_TRY(om__link_add(r->link, LINK_IN, LINK_EMPTY, system_topic[k], 1, &r->system[k]));
    r->tick_in = r->tick_out = -1;
    if (!r->def.is_lock_step) return OM_OK;
    OM_TRY(om__link_add(r->link, LINK_OUT, LINK_TOCK, "omentum/tock", 10, &r->tick_out));
    return om__link_add(r->link, LINK_IN, LINK_TICK, "omentum/tick", 10, &r->tick_in);
}

// ---- ticks --------------------------------------------------------------------------------------------------------

static OmStatus stop_hand(OmDdsRobot* r, Hand* hand, const char* why) {
    char words[256];
    om__arm_hold(&hand->core);
    snprintf(words, sizeof words, "the arm stops before its goal: %s", why);
    om__robot_say(r, "%s: %s", hand->name, words);
    return om__robot_words(r, hand->warning, words);
}

// Of joints within their limits the world sees the pose alone, and may find other joints that are not: the arm then
// stays where it was.
static OmStatus move_hand(OmDdsRobot* r, int a, double dt) {
    Hand* hand = &r->hand[a];
    const Arm before = hand->core;
    if (om__arm_step(&hand->core, r->obs.time, dt)) {
        const OmStatus moved = om_world_move(r->arms, a, hand->core.setpoint, FAST);
        if (moved < 0 && moved != OM_INVALID) return moved;
        if (moved < 0) {
            hand->core.setpoint = before.setpoint;
            memcpy(hand->core.q, before.q, sizeof before.q);
            OM_TRY(stop_hand(r, hand, om_error_message()));
        }
    }
    if (hand->core.has_timed_out) {
        om__robot_say(r, "%s: no command for %.2f s: it stops before its goal", hand->name,
                      r->obs.time - hand->core.heard);
        OM_TRY(
            om__robot_words(r, hand->warning, "no command in time: the arm stops before its goal"));
    }
    return om_world_set_jaw(r->arms, a, hand->core.jaw_goal);
}

// Where a jaw stops: a jaw on tissue that closes keeps its goal, and its grip.
static void see_jaw(OmDdsRobot* r, int a) {
    Arm* arm = &r->hand[a].core;
    const double jaw = r->obs.arm[a].jaw;
    const bool is_holding =
        r->is_apart ? r->is_holding[a] : om_body_is_holding(om_world_truth(r->def.world), a);
    arm->jaw_stop = is_holding ? fmin(arm->jaw_goal, jaw) : jaw;
}

static OmStatus advance(OmDdsRobot* r, double dt) {
    for (int a = 0; a < r->narm; ++a) OM_TRY(move_hand(r, a, dt));
    OM_TRY(om_world_advance(r->arms, dt));
    OM_TRY(om_world_observe(r->arms, 0, &r->obs));
    if (r->is_apart) om__robot_feel(r);
    for (int a = 0; a < r->narm; ++a) see_jaw(r, a);
    ++r->report.ntick;
    for (int a = 0; a < r->narm; ++a) {
        Hand* hand = &r->hand[a];
        if (hand->was_busy != (hand->core.motion == ARM_MOVE)) OM_TRY(om__robot_state(r, hand));
    }
    OM_TRY(om__robot_publish_arms(r, dt));
    om__periods_count(&r->periods, om_clock_now(), 1 / r->def.rate);
    return OM_OK;
}

// A program that has ordered a move, read the arms and is gone cannot stop it any more.
static OmStatus stop_orphans(OmDdsRobot* r) {
    for (int a = 0; a < r->narm; ++a) {
        Hand* hand = &r->hand[a];
        int k = 0;
        while (k < r->nprogram && r->program[k] != hand->program) ++k;
        if (hand->core.motion != ARM_MOVE || !hand->program || k < r->nprogram) continue;
        OM_TRY(stop_hand(r, hand, "the client that ordered its move is gone"));
    }
    return OM_OK;
}

// ROS programs that speak another protocol than DDS hear nothing, without a word.
static OmStatus watch_readers(OmDdsRobot* r) {
    const int before = r->nprogram;
    int n = 0;
    for (int a = 0; a < r->narm; ++a) {
        const Hand* h = &r->hand[a];
        n = om__link_add_programs(r->link, h->measured_cp, n, MAX_PROGRAM, r->program);
        n = om__link_add_programs(r->link, h->measured_js, n, MAX_PROGRAM, r->program);
    }
    r->nprogram = n;
    if (n == 0 && before > 0) {
        for (int a = 0; a < r->narm; ++a) om__arm_hold(&r->hand[a].core);
        om__robot_say(r, "no client reads the arms any more; they stop where they are");
    }
    if (n > 0 && before == 0) om__robot_say(r, "a client reads the arms");
    if (n > before && before > 0) om__robot_say(r, "another client reads the arms: %d now", n);
    if (n > 0 && n < before) om__robot_say(r, "a client is gone; %d still there", n);
    OM_TRY(stop_orphans(r));
    if (n > 0) r->has_said_silent = true;
    if (n > 0 || r->has_said_silent || om_clock_now() - r->begun < SILENCE) return OM_OK;
    r->has_said_silent = true;
    om__robot_say(
        r,
        "no client reads the arms after %.0f s. ROS 2 with rmw_zenoh hears nothing of DDS: set "
        "RMW_IMPLEMENTATION=rmw_cyclonedds_cpp or rmw_fastrtps_cpp there, and the same "
        "ROS_DOMAIN_ID (here %d)",
        SILENCE, r->def.dds.domain);
    return OM_OK;
}

static void wait_until(double time) {
    const double left = time - om_clock_now();
    if (left <= 0) return;
    const struct timespec t = {(time_t)left, (long)(1e9 * (left - floor(left)))};
    nanosleep(&t, NULL);
}

// Endoscope and depth camera by turns: a picture of one does not wait for that of the other.
static OmStatus look(OmDdsRobot* r) {
    const unsigned wanted = om__robot_wanted_pictures(r), image = wanted & OM_OBSERVE_IMAGE;
    const unsigned depth = wanted & ~image;
    const int neye = image && depth ? 2 : 1;
    r->is_depth_turn = !image || (depth && !r->is_depth_turn);
    r->next_picture = fmax(r->next_picture + 1 / (neye * r->def.picture_rate), r->obs.time);
    return om__robot_begin_look(r, r->is_depth_turn ? depth : image);
}

static OmStatus tick_by_clock(OmDdsRobot* r, double end, const OmProgress* progress) {
    const double dt = 1 / r->def.rate;
    double next = om_clock_now() + dt;
    while (r->obs.time < end - 0.5 * dt) {
        OM_TRY(om_progress_report(progress, "dvrk", r->obs.time, end));
        wait_until(next);
        OM_TRY(om__robot_take_commands(r));
        OM_TRY(advance(r, dt));
        OM_TRY(om__robot_follow(r));
        const bool is_free = !r->job || om_job_is_finished(r->job);
        if (r->def.picture_rate > 0 && is_free && r->obs.time >= r->next_picture) {
            OM_TRY(om__robot_publish_info(r));
            OM_TRY(look(r));
        }
        OM_TRY(om__robot_show(r));
        OM_TRY(watch_readers(r));
        next += dt;
        if (om_clock_now() - next > 0.1) next = om_clock_now();  // slower than time: no hurry after
    }
    return OM_OK;
}

static OmStatus run_by_clock(OmDdsRobot* r, double end, const OmProgress* progress) {
    om__robot_hurry(r);
    const OmStatus status = tick_by_clock(r, end, progress);
    om__robot_rest(r);
    if (status < 0 && status != OM_CANCELLED) return status;  // its message; destroy ends the jobs
    OM_TRY(om__robot_end_look(r));
    OM_TRY(om__robot_end_step(r));
    return status;
}

// A tick: advance, send what is wanted, answer. An error of the world ends the robot; the client reads it first.
static OmStatus make_tick(OmDdsRobot* r) {
    LinkMessage answer = r->tick;
    OmStatus status = OM_OK;
    r->has_tick = false;
    if (r->tick.tick.dt > 0)
        status = advance(r, r->tick.tick.dt);
    else
        status = om__robot_publish_arms(r, 0);
    if (status >= 0) status = om__robot_publish_pictures(r, r->tick.tick.what);
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
            om__robot_say(r, "a client makes the ticks");
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
        OM_TRY(om__robot_take_commands(r));
        OM_TRY(take_tick(r));
        OM_TRY(om__robot_show(r));
        OM_TRY(watch_readers(r));
        const double now = om_clock_now();
        if (before != r->report.ntick) last = now;
        if (now - last < BEAT) continue;
        // clients give up on a robot that is silent
        OM_TRY(om__robot_publish_info(r));
        OM_TRY(om__robot_publish_arms(r, 0));
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

static OmStatus check_names(const OmDdsRobotDef* def) {
    const int narm = om_world_narm(def->world);
    for (int a = 0; a < narm; ++a) {
        const char* name = def->arm[a];
        OM_CHECK(om__link_is_name(name, sizeof(((Hand*)0)->name)) && !strchr(name, '/'), OM_INVALID,
                 "OmDdsRobotDef.arm[%d] is \"%s\"; a name has at most 15 letters, digits and _", a,
                 name ? name : "");
        bool is_taken = strcmp(name, "ECM") == 0;
        for (int b = 0; b < a; ++b) is_taken |= strcmp(name, def->arm[b]) == 0;
        OM_CHECK(!is_taken, OM_INVALID, "OmDdsRobotDef.arm[%d] is \"%s\", as another arm", a, name);
    }
    return OM_OK;
}

static OmStatus check_def(const OmDdsRobotDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID, "OmDdsRobotDef was not made by default_def");
    OM_CHECK(def->world && def->scene && def->site, OM_INVALID,
             "OmDdsRobotDef: world, scene or site is null");
    OM_CHECK(def->tool_type && def->tool_type[0], OM_INVALID, "OmDdsRobotDef.tool_type is empty");
    OM_CHECK(def->eyes != def->world, OM_INVALID,
             "OmDdsRobotDef.eyes is its world: pictures are taken while the tissue steps");
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
    return check_names(def);
}

// The robot knows its base where its measurements put it: off by the error of its calibration.
static OmStatus begin_hand(OmDdsRobot* r, int a) {
    OmPsm psm = *om_world_psm(r->def.world, a);
    OmPose tip;
    OM_CHECK(om_world_setpoint(r->def.world, a, &tip), OM_INVALID,
             "OmDdsRobotDef.world is not simulated");
    const OmVec3 off = om_sub(tip.p, om_world_place_tip(r->def.site, a).p);
    psm.pose_world_rcm.p = om_add(psm.pose_world_rcm.p, off);
    const double zero[OM_PSM_NJOINT] = {0};
    double q[OM_PSM_NJOINT];
    snprintf(r->hand[a].name, sizeof r->hand[a].name, "%s", r->def.arm[a]);
    OM_TRY(om_psm_inverse_nearest(&psm, tip, zero, q, &tip));
    om__arm_init(&r->hand[a].core, &psm, tip, q, r->obs.arm[a].jaw_goal);
    return OM_OK;
}

// Arms apart from the tissue, with what they and the tissue pass to each other.
static OmStatus part_arms(OmDdsRobot* r, const OmTetMesh* mesh) {
    OM_TRY(om_world_create_arms(r->def.world, &r->arms));
    r->is_apart = true;
    r->apart_begun = r->step_begun = r->window_begun = r->obs.time;
    r->pose = om_alloc(om_world_state_size(r->arms), 1);
    if (!r->pose) return OM_NO_MEMORY;
    r->look_pose = om_alloc(om_world_state_size(r->arms), 1);
    if (!r->look_pose) return OM_NO_MEMORY;
    OM_TRY(om_world_observe(r->def.world, 0, &r->felt));
    memcpy(r->load, r->felt.arm, sizeof r->load);
    if (r->watch) OM_ALLOC(r->x, 3 * (size_t)mesh->nvert);
    if (r->x)
        memcpy(r->x, om_body_x(om_world_truth(r->def.world)),
               3 * (size_t)mesh->nvert * sizeof *r->x);
    if (!r->def.eyes) return OM_OK;
    const size_t size = om_world_state_size(r->def.world);
    OM_CHECK(size > 0 && om_world_state_size(r->def.eyes) == size, OM_INVALID,
             "OmDdsRobotDef.eyes is no world of this scene");
    r->snapshot = om_alloc(size, 1);
    if (!r->snapshot) return OM_NO_MEMORY;
    r->fresh = om_alloc(size, 1);
    if (!r->fresh) return OM_NO_MEMORY;
    return om_world_save(r->def.world, r->snapshot);
}

static OmStatus begin(OmDdsRobot* r) {
    const unsigned has = om_world_sources(r->def.world);
    OM_TRY(om_world_observe(r->def.world, has & (OM_OBSERVE_DEPTH | OM_OBSERVE_IMAGE), &r->obs));
    r->endoscope.camera = r->obs.endoscope.camera;
    r->depth.camera = r->obs.rgbd.camera;
    r->narm = om_world_narm(r->def.world);
    for (int a = 0; a < r->narm; ++a) OM_TRY(begin_hand(r, a));
    OM_TRY(om__cloud_init(&r->depth.camera, &r->points));
    const OmTetMesh* mesh = om_body_mesh(om_world_truth(r->def.world));
    if (r->def.igtl_port > 0) OM_TRY(om_watch_create(r->def.igtl_port, mesh, &r->watch));
    r->arms = r->def.world;
    if (!r->def.is_lock_step) OM_TRY(part_arms(r, mesh));
    if (r->def.udp_port > 0) OM_TRY(om__udp_open(r->def.udp_port, &r->udp));
    OM_TRY(om__link_create(&r->def.dds, &r->link));
    if (r->def.record) OM_TRY(om__tape_open(r->def.record, &r->tape));
    om__link_record(r->link, r->tape, r->def.has_record_pictures);
    OM_TRY(add_all(r));
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    const double epoch = (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
    r->stamp_origin = r->def.is_lock_step ? 0 : epoch - r->obs.time;
    r->begun = om_clock_now();
    return om__robot_publish_static(r);
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
    const OmStatus status = om__robot_end_look(robot);
    Tape* tape = robot->tape;
    robot->tape = NULL;
    om__link_record(robot->link, NULL, false);
    const OmStatus closed = om__tape_close(tape);
    return status < 0 ? status : closed;
}

void om_dds_robot_destroy(OmDdsRobot* robot) {
    if (!robot) return;
    om_job_join(robot->job);
    om_job_join(robot->step);
    if (robot->is_apart) om_world_destroy(robot->arms);
    om__tape_close(robot->tape);
    om__link_destroy(robot->link);
    om__udp_close(robot->udp);
    om_watch_destroy(robot->watch);
    om_text_done(&robot->reply);
    om_observation_done(&robot->obs);
    om_observation_done(&robot->seen);
    om_observation_done(&robot->felt);
    om_free(robot->pose);
    om_free(robot->look_pose);
    om_free(robot->snapshot);
    om_free(robot->fresh);
    om_free(robot->x);
    om__cloud_done(&robot->points);
    om_free(robot);
}

OmDdsReport om_dds_robot_report(const OmDdsRobot* robot) {
    OmDdsReport report = robot->report;
    if (!robot->is_apart) report.nstep = report.ntick;
    const double followed = robot->step_begun - robot->apart_begun;
    report.pace = report.tissue_time > 0 ? report.tissue_time / followed : (double)NAN;
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
