// dds_robot.h: the parts of the simulated robot: dds_robot.c has its ticks, dds_publish.c the messages of its arms,
// dds_eyes.c its pictures, dds_obey.c its commands, dds_tissue.c the tissue beside arms by the wall clock.
#ifndef OMENTUM_DDS_ROBOT_H
#define OMENTUM_DDS_ROBOT_H

#include "dds/dds_arm.h"
#include "dds/dds_cloud.h"
#include "dds/dds_period.h"
#include "dds/dds_tape.h"
#include "dds/dds_udp.h"
#include "omentum/base_job.h"
#include "omentum/dds.h"

#define WORLD "world"  // the frame of all poses but the local ones

enum { MAX_PROGRAM = 32 };  // of which the robot keeps count

// Topics of the whole system.
enum { POWER_ON, POWER_OFF, HOME, NSYSTEM };

typedef struct Hand {  // an arm with its topics
    Arm core;
    char name[16];
    int state_command, servo_cp, servo_jp, move_cp, move_jp, hold, freed, ratio, jaw_servo,
        jaw_move;
    int jaw_effort, tool_present, measured_cv;
    int measured_js, setpoint_js, measured_cp, setpoint_cp, local_measured, local_setpoint;
    int jaw_measured, jaw_setpoint, body_cf, spatial_cf;
    int state, error, warning, status, tool_type;
    double last_q[OM_PSM_NJOINT];
    OmPose last_tip;
    bool has_last, was_busy;
    int mover;         // om__udp_sender of the last move by UDP
    uint64_t program;  // that ordered the last move, and read the arms; 0: none
} Hand;

typedef struct Eye {  // a camera with its topics
    const char* frame;
    OmCamera camera;
    int info, image, cloud;  // cloud of the depth camera
} Eye;

struct OmDdsRobot {
    OmDdsRobotDef def;
    Link* link;
    Tape* tape;      // null: no recording
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
    OmObservation seen;  // with pictures
    // Of commands: by the wall clock arms apart from the tissue (owned), in lock-step the world.
    OmWorld* arms;
    bool is_apart;
    OmJob* step;                        // of the tissue; null: none is under way
    void* pose;                         // snapshot of the arms, for the step
    double step_dt;                     // s of the step
    double apart_begun, step_begun;     // s of the arms
    double step_taken;                  // s of the wall clock, that the step took
    OmObservation felt;                 // of the job
    OmArmObservation load[OM_MAX_ARM];  // forces after the last step that has ended
    bool is_holding[OM_MAX_ARM];        // the same
    double* x;  // the same, vertices of the tissue, for programs that watch; null: none do
    double window_begun, window_tissue;  // s of the arms; s of the tissue since then
    bool has_said_slow;
    // Of the thread that ticks, before; whether it has real-time priority now.
    int nice, policy;
    bool is_hurried;
    OmJob* job;           // null: no picture is under way
    void* snapshot;       // of the world, for the eyes
    void* fresh;          // the same, of the last step; null: no eyes
    bool is_fresh;        // newer than `snapshot`
    void* look_pose;      // of the arms, for the eyes
    unsigned wanted;      // OM_OBSERVE_ flags of the job
    double taken;         // s, time that the job took
    double stamp_origin;  // s of the epoch at the world's time 0; 0 in lock-step
    double next_picture;  // s of the world
    bool is_depth_turn;   // of the last picture
    // of the client in lock-step: its number, commands since its first tick
    uint32_t client, ntaken;
    LinkMessage tick;  // that waits for its commands
    bool has_tick, has_said_silent;
    uint64_t program[MAX_PROGRAM];  // that read the arms
    int nprogram;
    double begun;   // s of the wall clock
    double render;  // s, all pictures
    OmDdsReport report;
    Periods periods;  // of the arms' messages
};

// An event in words, for the one who runs the robot.
void om__robot_say(OmDdsRobot* r, const char* format, ...) OM_PRINTF(2, 3);
// s of the stamps, now.
double om__robot_stamp(const OmDdsRobot* r);

// ---- dds_publish.c ----
OmStatus om__robot_words(OmDdsRobot* r, int id, const char* words);
OmStatus om__robot_state(OmDdsRobot* r, Hand* hand);
// Clock, arms and tf; dt: s since the last call, of speeds.
OmStatus om__robot_publish_arms(OmDdsRobot* r, double dt);
OmStatus om__robot_publish_info(OmDdsRobot* r);    // of both cameras
OmStatus om__robot_publish_static(OmDdsRobot* r);  // frames, states, tools: once

// ---- dds_eyes.c ----
// What the readers of pictures want, as OM_OBSERVE_ flags.
unsigned om__robot_wanted_pictures(const OmDdsRobot* r);
OmStatus om__robot_publish_pictures(OmDdsRobot* r, unsigned what);
// The same of a snapshot, by a job; the job before has ended.
OmStatus om__robot_begin_look(OmDdsRobot* r, unsigned what);
OmStatus om__robot_end_look(OmDdsRobot* r);
// By OpenIGTLink, where a program watches.
OmStatus om__robot_show(OmDdsRobot* r);

// ---- dds_tissue.c ----
// Priorities: of the arms' thread while it keeps time, back again, of the threads beside it.
void om__robot_hurry(OmDdsRobot* r);
void om__robot_rest(OmDdsRobot* r);
void om__robot_yield(const OmDdsRobot* r);
// Where no step of the tissue is under way: take the answer of the last one, begin the next one.
OmStatus om__robot_follow(OmDdsRobot* r);
// Wait for the step that is under way.
OmStatus om__robot_end_step(OmDdsRobot* r);
// Put the forces of the last step into what the arms observe.
void om__robot_feel(OmDdsRobot* r);

// ---- dds_obey.c ----
OmStatus om__robot_take_commands(OmDdsRobot* r);

#endif
