// dds_obey.c: commands to the simulated robot, by topics and by datagrams.
//
// Of several commands on one topic the last one wins, as with the robot's queues of one; state commands are obeyed in
// order. state_command is read without durability: the usual client publishes it latched, and an old "enable" would
// come again.
#include "dds/dds_robot.h"

#include <string.h>

#define UDP_MOST 32       // datagrams of a tick; others wait
#define UDP_PATIENCE 1.0  // s without a datagram after which the move of its sender stops

static const char* const system_answer[NSYSTEM] = {
    "power_on: nothing is done; send home to each arm",
    "power_off: the arms stop, and keep their states",
    "home: nothing is done; send home to each arm"};

// After a state command; FAULT is also an error.
static OmStatus tell_state(OmDdsRobot* r, Hand* hand, const char* command) {
    const Arm* arm = &hand->core;
    char words[256];
    om__robot_say(r, "%s: %s: %s%s", hand->name, command, om__arm_mode_name(arm->mode),
                  arm->is_homed ? ", homed" : "");
    snprintf(words, sizeof words, "%s is in FAULT: state command \"%.100s\"", hand->name, command);
    if (arm->mode == ARM_FAULT) OM_TRY(om__robot_words(r, hand->error, words));
    OM_TRY(om__robot_words(r, hand->status, om__arm_mode_name(arm->mode)));
    return om__robot_state(r, hand);
}

// A command that is refused changes nothing; its sender reads why.
static OmStatus refuse(OmDdsRobot* r, Hand* hand, int topic) {
    char words[256];
    ++r->report.nrefused;
    snprintf(words, sizeof words, "%s refused: %s", om__link_name(r->link, topic),
             om_error_message());
    om__robot_say(r, "%s", words);
    return om__robot_words(r, hand->warning, words);
}

// ---- commands -----------------------------------------------------------------------------------------------------

// The last message of a topic; all are counted.
static bool take_last(OmDdsRobot* r, int id, LinkMessage* m) {
    if (id < 0) return false;  // an instrument without a jaw
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

// The program that wrote a message, where it reads the arms, too; 0: it does not.
static uint64_t find_supervisor(const OmDdsRobot* r, int id, const LinkMessage* m) {
    const uint64_t program = om__link_program(r->link, id, m->writer);
    for (int k = 0; k < r->nprogram; ++k)
        if (r->program[k] == program) return program;
    return 0;
}

static OmStatus take_moves(OmDdsRobot* r, Hand* hand) {
    Arm* arm = &hand->core;
    const double time = r->obs.time;
    LinkMessage m;
    const int topic[2] = {hand->move_jp, hand->move_cp};
    for (int k = 0; k < 2; ++k) {
        if (!take_last(r, topic[k], &m)) continue;
        const OmStatus status =
            k == 0 ? om__arm_move_jp(arm, time, &m.joints) : obey_move_cp(arm, time, &m);
        if (status < 0)
            OM_TRY(refuse(r, hand, topic[k]));
        else
            hand->program = find_supervisor(r, topic[k], &m);
    }
    return OM_OK;
}

// Forces of a jaw are not simulated: the first command of each direction says so.
static OmStatus obey_jaw_effort(OmDdsRobot* r, Hand* hand, const LinkJoints* joints) {
    const double before = hand->core.jaw_goal;
    if (om__arm_jaw_effort(&hand->core, joints) < 0) return refuse(r, hand, hand->jaw_effort);
    const double effort = joints->effort[0];
    if (hand->core.jaw_goal == before) return OM_OK;
    if (effort == 0)
        return om__robot_words(r, hand->status, "jaw/servo_jf: the jaw stays where it is");
    return om__robot_words(r, hand->status,
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
    OM_TRY(take_moves(r, hand));
    if (take_last(r, hand->hold, &m)) om__arm_hold(arm);
    if (take_last(r, hand->freed, &m)) {
        om__arm_hold(arm);
        OM_TRY(
            om__robot_words(r, hand->status, "free: the arm stops; it has no hand that moves it"));
    }
    if (take_last(r, hand->ratio, &m) && om__arm_set_ratio(arm, m.number) < 0)
        OM_TRY(refuse(r, hand, hand->ratio));
    if (take_last(r, hand->jaw_servo, &m) && om__arm_jaw(arm, &m.joints) < 0)
        OM_TRY(refuse(r, hand, hand->jaw_servo));
    if (take_last(r, hand->jaw_move, &m) && om__arm_jaw(arm, &m.joints) < 0)
        OM_TRY(refuse(r, hand, hand->jaw_move));
    if (take_last(r, hand->jaw_effort, &m)) OM_TRY(obey_jaw_effort(r, hand, &m.joints));
    if (take_last(r, hand->tool_present, &m))
        OM_TRY(om__robot_words(r, hand->status,
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
    hand->program = 0;
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
        OM_TRY(om__robot_words(r, r->status, system_answer[k]));
    }
    return OM_OK;
}

OmStatus om__robot_take_commands(OmDdsRobot* r) {
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
