// test_dds_robot.c: what clients may do to the simulated robot. Robot and client share this thread: a tick is a call.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "dds/dds_robot.h"
#include "easy_scene.h"
#include "test_common.h"
#include "test_domain.h"

#define DT 0.05

typedef struct Served {  // a robot in lock-step, with a client of PSM1
    OmScene scene;
    OmSite site;
    OmWorld* field;
    OmDdsRobot* robot;
    Link* link;
    int tick, state_command, servo_jp, move_jp, servo_cp, move_cp, jaw, hold, jaw_is, jaw_to,
        warning, error, setpoint_js, setpoint_cp;
    int system[3], system_status, freed, jaw_effort, tool_present, status, measured_cv;
    int udp_port;
    char said[400];  // the last sentence of the robot
} Served;

static void hear(void* ctx, const char* sentence) {
    Served* s = ctx;
    snprintf(s->said, sizeof s->said, "%s", sentence);
}

static OmDdsDef make_dds(void) {
    OmDdsDef def = om_dds_default_def();
    def.domain = test_domain();
    return def;
}

static void make_robot(Served* s, OmDdsRobotDef* def, OmVec3 cells) {
    unsetenv("CYCLONEDDS_URI");
    *s = (Served){.scene = easy_scene()};
    s->scene.tissue.cells = om_vec3(4, 4, 1);
    s->scene.tissue.world_cells = cells;
    s->scene.task.grasp_radius = 0.025;
    assert_ok(om_site_build(&s->scene, OM_SITE_WORLD, NULL, &s->site));
    assert_ok(om_world_create_simulated(&s->scene, &s->site, 1, &s->field));
    assert_true(om_world_reset(s->field) >= 0);
    *def = om_dds_robot_default_def(s->field, &s->scene, &s->site);
    def->dds = make_dds();
    def->say = hear;
    def->say_ctx = s;
}

// With an instrument (null: the usual one), which may have no jaw.
static void begin_with(Served* s, const OmPsm* tool) {
    OmDdsRobotDef def;
    make_robot(s, &def, om_vec3(8, 8, 1));
    if (tool) assert_ok(om_world_set_tool(s->field, 0, tool));
    def.is_lock_step = true;
    def.udp_port = s->udp_port = 43000 + getpid() % 4000;
    assert_ok(om_dds_robot_create(&def, &s->robot));
    assert_ok(om__link_create(&def.dds, &s->link));
    const struct {
        int* id;
        unsigned flags;
        LinkType type;
        const char* name;
    } topic[] = {{&s->tick, LINK_OUT, LINK_TICK, "omentum/tick"},
                 {&s->state_command, LINK_OUT, LINK_STAMPED, "PSM1/state_command"},
                 {&s->servo_jp, LINK_OUT, LINK_JOINTS, "PSM1/servo_jp"},
                 {&s->move_jp, LINK_OUT, LINK_JOINTS, "PSM1/move_jp"},
                 {&s->servo_cp, LINK_OUT, LINK_POSE, "PSM1/servo_cp"},
                 {&s->move_cp, LINK_OUT, LINK_POSE, "PSM1/move_cp"},
                 {&s->jaw, LINK_OUT, LINK_JOINTS, "PSM1/jaw/move_jp"},
                 {&s->hold, LINK_OUT, LINK_EMPTY, "PSM1/hold"},
                 {&s->freed, LINK_OUT, LINK_EMPTY, "PSM1/free"},
                 {&s->jaw_is, LINK_IN, LINK_JOINTS, "PSM1/jaw/measured_js"},
                 {&s->jaw_to, LINK_IN, LINK_JOINTS, "PSM1/jaw/setpoint_js"},
                 {&s->system[0], LINK_OUT, LINK_EMPTY, "system/power_on"},
                 {&s->system[1], LINK_OUT, LINK_EMPTY, "system/home"},
                 {&s->system[2], LINK_OUT, LINK_EMPTY, "system/power_off"},
                 {&s->system_status, LINK_IN, LINK_STRING, "system/status"},
                 {&s->jaw_effort, LINK_OUT, LINK_JOINTS, "PSM1/jaw/servo_jf"},
                 {&s->tool_present, LINK_OUT, LINK_BOOL, "PSM1/emulate_tool_present"},
                 {&s->status, LINK_IN, LINK_STRING, "PSM1/status"},
                 {&s->measured_cv, LINK_IN, LINK_TWIST, "PSM1/measured_cv"},
                 {&s->error, LINK_IN, LINK_STRING, "PSM1/error"},
                 {&s->warning, LINK_IN, LINK_STRING, "PSM1/warning"},
                 {&s->setpoint_js, LINK_IN, LINK_JOINTS, "PSM1/setpoint_js"},
                 {&s->setpoint_cp, LINK_IN, LINK_POSE, "PSM1/setpoint_cp"}};
    for (size_t k = 0; k < sizeof topic / sizeof *topic; ++k)
        assert_ok(
            om__link_add(s->link, topic[k].flags, topic[k].type, topic[k].name, 1, topic[k].id));
    const double end = om_clock_now() + 20;
    for (size_t k = 0; k < sizeof topic / sizeof *topic; ++k)
        while (!(tool && !tool->has_jaw && strstr(topic[k].name, "/jaw/")) &&
               om__link_count(s->link, *topic[k].id) == 0 && om_clock_now() < end)
            om__link_wait(s->link, 0.01);
}

static void begin(Served* s) { begin_with(s, NULL); }

static void end(Served* s) {
    om__link_destroy(s->link);
    om_dds_robot_destroy(s->robot);
    om_world_destroy(s->field);
    om_site_done(&s->site);
}

// One step of the world, after the commands that were written.
static void step(Served* s, double dt) {
    assert_ok(om__link_write(s->link, s->tick, &(LinkMessage){.tick = {.client = 7, .dt = dt}}));
    assert_ok(om_dds_robot_run(s->robot, 0.5 * dt, NULL));
}

static void order(Served* s, const char* command) {
    LinkMessage m = {0};
    snprintf(m.text, sizeof m.text, "%s", command);
    assert_ok(om__link_write(s->link, s->state_command, &m));
}

// The last message of a topic.
static LinkMessage last(Served* s, int id) {
    LinkMessage m = {0};
    const double end = om_clock_now() + 5;
    bool is_there = false;
    while (!(is_there = om__link_take(s->link, id, &m)) && om_clock_now() < end)
        om__link_wait(s->link, 0.01);
    assert_true(is_there);
    return m;
}

static void drive(Served* s, int id, const double q[OM_PSM_NJOINT]) {
    LinkMessage m = {.joints = {.nposition = OM_PSM_NJOINT}};
    memcpy(m.joints.position, q, OM_PSM_NJOINT * sizeof *q);
    assert_ok(om__link_write(s->link, id, &m));
}

// To a goal of one joint, by move_jp, or by goals of servo_jp on the way to it.
static void drive_to(Served* s, int joint, double goal, bool is_servo) {
    const double most = joint == 2 ? 0.02 : 0.15;
    double q[OM_PSM_NJOINT];
    memcpy(q, last(s, s->setpoint_js).joints.position, sizeof q);
    if (!is_servo) {
        q[joint] = goal;
        drive(s, s->move_jp, q);
        for (int i = 0; i < 16; ++i) step(s, 0.9);
    }
    for (int i = 0; is_servo && i < 40; ++i) {
        q[joint] += fmax(-most, fmin(most, goal - q[joint]));
        drive(s, s->servo_jp, q);
        step(s, 0.2);
    }
}

// Each joint to both of its limits and back: it is there, or the arm says why not, and stands where its joints are.
// At small insertion the world finds other joints for the pose and refuses: this ended the robot.
static void joint_limits(void** unused) {
    (void)unused;
    Served s;
    begin(&s);
    const OmPsm psm = om_world_place_psm(&s.site, 0);
    LinkMessage m;
    int nstopped = 0;
    order(&s, "home");
    step(&s, DT);
    const LinkJoints start = last(&s, s.setpoint_js).joints;
    const OmVec3 off =
        om_sub(last(&s, s.setpoint_cp).pose.p, om_psm_forward(&psm, start.position).p);
    for (int k = 0; k < 4 * OM_PSM_NJOINT; ++k) {
        const int joint = k / 4;
        const double goal = k % 2 ? psm.q_max[joint] : psm.q_min[joint];
        step(&s, DT);
        drive_to(&s, joint, goal, k % 4 >= 2);
        const double* q = (m = last(&s, s.setpoint_js)).joints.position;
        const OmVec3 tip = om_sub(om_psm_forward(&psm, q).p, om_scale(-1, off));
        assert_near(om_distance(last(&s, s.setpoint_cp).pose.p, tip), 0, 1e-9);
        const double left = fabs(q[joint] - goal);
        if (om__link_take(s.link, s.warning, &m)) {
            assert_non_null(strstr(m.text, "the arm stops before its goal: PSM1: point"));
            assert_below(0.001, left);
            ++nstopped;
        } else {
            assert_near(left, 0, 1e-9);
        }
        step(&s, DT);
        drive_to(&s, joint, start.position[joint], false);
        assert_near(last(&s, s.setpoint_js).joints.position[joint], start.position[joint], 1e-9);
        while (om__link_take(s.link, s.warning, &m)) continue;
    }
    assert_int_equal(nstopped, 2);  // the insertion, both ways
    end(&s);
}

// The client that reads the arms goes away while a move is under way: the arm stops where it is.
static void reader_gone(void** unused) {
    (void)unused;
    Served s;
    Link* reader;
    int id;
    begin(&s);
    const OmDdsDef dds = make_dds();
    assert_ok(om__link_create(&dds, &reader));
    assert_ok(om__link_add(reader, LINK_IN, LINK_POSE, "PSM1/measured_cp", 1, &id));
    while (om__link_count(reader, id) == 0) om__link_wait(reader, 0.01);
    order(&s, "home");
    step(&s, DT);
    assert_string_equal(s.said, "a client reads the arms");
    double q[OM_PSM_NJOINT];
    memcpy(q, last(&s, s.setpoint_js).joints.position, sizeof q);
    q[0] += 0.5;
    drive(&s, s.move_jp, q);
    for (int i = 0; i < 5; ++i) step(&s, DT);
    om__link_destroy(reader);
    for (int i = 0; i < 200 && !strstr(s.said, "they stop where they are"); ++i) {
        step(&s, 1e-4);
        poll(NULL, 0, 5);
    }
    assert_non_null(strstr(s.said, "they stop where they are"));
    step(&s, DT);
    const LinkMessage there = last(&s, s.setpoint_js);
    for (int i = 0; i < 5; ++i) step(&s, DT);
    assert_near(last(&s, s.setpoint_js).joints.position[0], there.joints.position[0], 0);
    assert_below(0.01, fabs(there.joints.position[0] - q[0]));  // rad: short of its goal
    end(&s);
}

// Of two clients that read the arms one orders a move and goes away: it stops. A move of a client that does not read
// them, as `ros2 topic pub --once`, has no client that could stop it: it ends.
static void mover_gone(void** unused) {
    (void)unused;
    Served s;
    Link* link[2];
    int id[2], move;
    const OmDdsDef dds = make_dds();
    begin(&s);
    for (int k = 0; k < 2; ++k) {
        assert_ok(om__link_create(&dds, &link[k]));
        assert_ok(om__link_add(link[k], LINK_IN, LINK_POSE, "PSM1/measured_cp", 1, &id[k]));
    }
    assert_ok(om__link_add(link[0], LINK_OUT, LINK_JOINTS, "PSM1/move_jp", 1, &move));
    while (!om__link_count(link[0], id[0]) || !om__link_count(link[1], id[1]) ||
           !om__link_count(link[0], move))
        om__link_wait(link[0], 0.01);
    order(&s, "home");
    step(&s, DT);
    LinkMessage m = {.joints = {.nposition = OM_PSM_NJOINT}};
    memcpy(m.joints.position, last(&s, s.setpoint_js).joints.position, 6 * sizeof(double));
    m.joints.position[0] += 0.5;
    assert_ok(om__link_write(link[0], move, &m));
    for (int i = 0; i < 5; ++i) step(&s, DT);
    om__link_destroy(link[0]);
    LinkMessage said = {0};
    for (int i = 0; i < 200 && !om__link_take(s.link, s.warning, &said); ++i) {
        step(&s, 1e-4);
        poll(NULL, 0, 5);
    }
    assert_non_null(strstr(said.text, "the client that ordered its move is gone"));
    step(&s, DT);
    const double there = last(&s, s.setpoint_js).joints.position[0];
    for (int i = 0; i < 5; ++i) step(&s, DT);
    assert_near(last(&s, s.setpoint_js).joints.position[0], there, 0);
    assert_below(0.01, m.joints.position[0] - there);  // rad: short of its goal
    drive(&s, s.move_jp, m.joints.position);
    for (int i = 0; i < 60; ++i) step(&s, DT);
    assert_near(last(&s, s.setpoint_js).joints.position[0], m.joints.position[0], 1e-9);
    om__link_destroy(link[1]);
    end(&s);
}

static void tell(int fd, int port, const char* words) {
    const struct sockaddr_in at = {.sin_family = AF_INET,
                                   .sin_port = htons((uint16_t)port),
                                   .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const size_t size = strlen(words);
    assert_int_equal(sendto(fd, words, size, 0, (const struct sockaddr*)&at, sizeof at), size);
}

// A move by UDP continues as long as its sender is heard within 1 s, and then stops; another sender does not count.
static void sender_gone(void** unused) {
    (void)unused;
    Served s;
    begin(&s);
    const int fd = socket(AF_INET, SOCK_DGRAM, 0), other = socket(AF_INET, SOCK_DGRAM, 0);
    char words[300];
    LinkMessage m;
    order(&s, "home");
    step(&s, DT);
    double q[OM_PSM_NJOINT];
    memcpy(q, last(&s, s.setpoint_js).joints.position, sizeof q);
    double before = q[0];
    snprintf(words, sizeof words,
             "{\"arm\": \"PSM1\", \"move_jp\": [%.9f, %.9f, %.9f, %.9f, %.9f, %.9f]}", 1.5, q[1],
             q[2], q[3], q[4], q[5]);
    tell(fd, s.udp_port, words);
    for (int i = 0; i < 30; ++i) {
        // heard at 0 and 0.9 s: the setpoint of tick 20, at 2.0 s, is that of tick 19
        if (i == 9) tell(fd, s.udp_port, "{\"arm\": \"PSM2\"}");
        if (i > 9) tell(other, s.udp_port, "{\"arm\": \"PSM1\"}");
        step(&s, 0.1);
        const double now = last(&s, s.setpoint_js).joints.position[0];
        assert_true(i < 19 ? now > before + 1e-4 : i < 21 || now == before);
        before = now;
    }
    assert_string_equal(last(&s, s.warning).text,
                        "no command in time: the arm stops before its goal");
    assert_false(om__link_take(s.link, s.warning, &m));  // said once
    assert_below(before, 1.4);
    close(fd);
    close(other);
    end(&s);
}

// FAULT is an error, by DDS and by UDP; a command that FAULT refuses is a warning.
static void fault(void** unused) {
    (void)unused;
    Served s;
    LinkMessage m;
    begin(&s);
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    order(&s, "home");
    step(&s, DT);
    assert_false(om__link_take(s.link, s.error, &m));
    order(&s, "fault");
    step(&s, DT);
    assert_string_equal(last(&s, s.error).text, "PSM1 is in FAULT: state command \"fault\"");
    order(&s, "home");
    step(&s, DT);
    assert_non_null(strstr(last(&s, s.warning).text, "refused in state FAULT"));
    order(&s, "clear_fault");
    step(&s, DT);
    assert_false(om__link_take(s.link, s.error, &m));
    tell(fd, s.udp_port, "{\"arm\": \"PSM1\", \"state_command\": \"fault\"}");
    step(&s, DT);
    assert_string_equal(last(&s, s.error).text, "PSM1 is in FAULT: state command \"fault\"");
    close(fd);
    end(&s);
}

// A goal in the frame of the base is refused and changes nothing; in "world" or without a name it is obeyed.
static void frames(void** unused) {
    (void)unused;
    static const char* const name[] = {"PSM1_base", "worlds", "world", ""};
    Served s;
    LinkMessage m;
    begin(&s);
    order(&s, "home");
    step(&s, DT);
    const int topic[2] = {s.servo_cp, s.move_cp};
    for (int k = 0; k < 8; ++k) {
        step(&s, DT);
        const OmPose before = last(&s, s.setpoint_cp).pose;
        m = (LinkMessage){.pose = before};
        snprintf(m.frame, sizeof m.frame, "%s", name[k / 2]);
        m.pose.p.z -= 0.002;
        assert_ok(om__link_write(s.link, topic[k % 2], &m));
        for (int i = 0; i < 10; ++i) step(&s, DT);
        const double moved = before.p.z - last(&s, s.setpoint_cp).pose.p.z;
        assert_near(moved, k < 4 ? 0 : 0.002, 1e-12);
        assert_int_equal(om__link_take(s.link, s.warning, &m), k < 4);
        if (k < 4) assert_non_null(strstr(m.text, "refused: the goal is in frame"));
    }
    end(&s);
}

static void order_jaw(Served* s, double goal) {
    const LinkMessage m = {.joints = {.nposition = 1, .position = {goal}}};
    assert_ok(om__link_write(s->link, s->jaw, &m));
}

static double jaw_after(Served* s, int nstep) {
    for (int i = 0; i < nstep; ++i) step(s, DT);
    return last(s, s->jaw_is).joints.position[0];
}

// A jaw that opens stops at hold, and in each state that is not enabled and homed.
static void jaw(void** unused) {
    (void)unused;
    static const char* const command[] = {"pause", "disable", "fault", "unhome", NULL};
    Served s;
    begin(&s);
    for (int k = 0; k < 5; ++k) {
        order(&s, k == 3 ? "clear_fault" : k == 1 ? "resume" : "enable");
        step(&s, DT);
        order(&s, "home");
        step(&s, DT);
        order_jaw(&s, 0.4);
        assert_near(jaw_after(&s, 20), 0.4, 1e-9);
        order_jaw(&s, 1.2);
        const double there = jaw_after(&s, 2);
        assert_near(there, 0.7, 1e-9);  // at 3 rad/s
        if (command[k])
            order(&s, command[k]);
        else
            assert_ok(om__link_write(s.link, s.hold, &(LinkMessage){0}));
        assert_near(jaw_after(&s, 10), there, 0);
    }
    end(&s);
}

// A jaw that holds tissue keeps it, and its grip, through hold and pause: its goal stays below 3 degrees, at which a
// client tells tissue from an empty jaw. One that opens stops, and still holds while it is open by less than 20.
static void jaw_on_tissue(void** unused) {
    (void)unused;
    Served s;
    LinkMessage m;
    begin(&s);
    order(&s, "home");
    step(&s, DT);
    m = (LinkMessage){.pose = last(&s, s.setpoint_cp).pose};
    m.pose.p = om_pose_mul(s.site.pose_world_task,
                           (OmPose){om_vec3(-0.02, -0.03, 0.006), om_quat_identity()})
                   .p;
    assert_ok(om__link_write(s.link, s.move_cp, &m));
    for (int i = 0; i < 60; ++i) step(&s, DT);
    order_jaw(&s, -0.1);
    const double held = jaw_after(&s, 20);
    assert_near(held, 5 * OM_PI / 180, 1e-9);  // on tissue
    for (int k = 0; k < 2; ++k) {
        assert_ok(om__link_write(s.link, s.hold, &(LinkMessage){0}));
        if (k == 1) order(&s, "pause");
        assert_near(jaw_after(&s, 5), held, 0);
        assert_below(last(&s, s.jaw_to).joints.position[0], 3 * OM_PI / 180);
    }
    order(&s, "resume");
    order_jaw(&s, 1);
    const double there = jaw_after(&s, 1);
    assert_true(there > held + 0.1 && om_body_is_holding(om_world_truth(s.field), 0));
    assert_ok(om__link_write(s.link, s.hold, &(LinkMessage){0}));
    assert_near(jaw_after(&s, 5), there, 0);
    assert_true(om_body_is_holding(om_world_truth(s.field), 0));
    end(&s);
}

// A tick answers 32 datagrams; the others wait for the next one. Arms have the names that they are given.
static void many_datagrams(void** unused) {
    (void)unused;
    Served s;
    OmDdsRobotDef def;
    make_robot(&s, &def, om_vec3(8, 8, 1));
    def.has_record_pictures = true;  // of what?
    assert_status(om_dds_robot_create(&def, &s.robot), OM_INVALID);
    def.has_record_pictures = false;
    static const char* const bad[] = {"PSM2", "ECM", "", "a/b", "sixteen_letters_", NULL};
    for (int k = 0; k < 6; ++k) {
        def.arm[0] = bad[k];
        assert_status(om_dds_robot_create(&def, &s.robot), OM_INVALID);
    }
    def.arm[0] = "LEFT";
    def.rate = 20;
    def.picture_rate = 0;
    def.udp_port = 43000 + getpid() % 4000;
    assert_ok(om_dds_robot_create(&def, &s.robot));
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    char answer[8192];
    for (int k = 0; k < 40; ++k) tell(fd, def.udp_port, "{\"arm\": \"LEFT\"}");
    for (int k = 0; k < 2; ++k) {
        int n = 0;
        assert_ok(om_dds_robot_run(s.robot, 1 / def.rate, NULL));
        for (ssize_t size; (size = recv(fd, answer, sizeof answer - 1, MSG_DONTWAIT)) > 0; ++n) {
            answer[size] = 0;
            assert_non_null(strstr(answer, "\"refused\": \"\""));
            assert_true(strstr(answer, "\"LEFT\"") && strstr(answer, "\"PSM2\""));
        }
        assert_int_equal(n, k == 0 ? 32 : 8);
    }
    assert_int_equal(om_dds_robot_report(s.robot).ntick, 2);
    close(fd);
    end(&s);
}

// A tissue that needs more than a period for a step: the arms move and publish in time, the robot says once that the
// tissue does not.
static void tissue_behind(void** unused) {
    (void)unused;
    Served s;
    OmDdsRobotDef def;
    char answer[8192];
    make_robot(&s, &def, om_vec3(44, 44, 3));
    s.scene.task.time_step = 0.001;  // s: a step of the tissue is a period of the arms, no more
    def.rate = 200;
    def.picture_rate = 0;
    def.eyes = s.field;
    assert_status(om_dds_robot_create(&def, &s.robot), OM_INVALID);
    assert_ok(om_world_create_simulated(&s.scene, &s.site, 1, &def.eyes));
    def.udp_port = 43000 + getpid() % 4000;
    assert_ok(om_dds_robot_create(&def, &s.robot));
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    tell(fd, def.udp_port, "{\"arm\": \"PSM1\", \"state_command\": \"home\"}");
    tell(fd, def.udp_port, "{\"arm\": \"PSM1\", \"jaw\": 0.3}");
    assert_ok(om_dds_robot_run(s.robot, 1.05, NULL));
    assert_int_equal(om_dds_robot_report(s.robot).ntick, 210);
    assert_non_null(strstr(s.said, "the tissue is slower than time"));
    tell(fd, def.udp_port, "{\"arm\": \"PSM1\"}");
    assert_ok(om_dds_robot_run(s.robot, 1 / def.rate, NULL));
    ssize_t n = 0;
    for (ssize_t k; (k = recv(fd, answer, sizeof answer - 1, MSG_DONTWAIT)) > 0;) n = k;
    answer[n] = 0;
    const char* jaw = strstr(answer, "\"jaw\": ");
    assert_non_null(jaw);
    assert_near(strtod(jaw + 7, NULL), 0.3, 1e-9);
    const OmDdsReport r = om_dds_robot_report(s.robot);
    assert_below(r.period_median, 0.0075);
    assert_true(r.step_max > 0.0075);
    assert_true(r.nstep > 1 && r.nstep < r.ntick);
    assert_near(r.pace * r.time, r.tissue_time, 0.05);  // but for the last step
    assert_below(r.pace, 0.9);
    close(fd);
    om_dds_robot_destroy(s.robot);
    om_world_destroy(def.eyes);
    om_world_destroy(s.field);
    om_site_done(&s.site);
}

// An instrument that bends once and has no jaw: five joints, no topics of a jaw; it goes to points, with the nearest
// orientation that it reaches; who orders six joints, or a jaw, is refused.
static void short_wrist(void** unused) {
    (void)unused;
    static const char file[] =
        "{\"DH\": {\"convention\": \"modified\", \"joints\": [{\"alpha\": 0, \"A\": 0, \"theta\": 0, \"D\": "
        "0.4162, \"offset\": 0, \"qmin\": -4.5, \"qmax\": 4.5}, {\"alpha\": -1.5708, \"A\": 0, \"theta\": 0, "
        "\"D\": 0, \"offset\": -1.5708, \"qmin\": -1.3, \"qmax\": 1.3}]}, \"tooltip_offset\": [[0, 0, 1, 0.01], "
        "[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]}";
    Served s;
    LinkMessage m;
    double q[OM_PSM_NJOINT];
    OmPsm tool = om_psm_default(OM_PROGRASP, om_pose_identity());
    assert_ok(om_psm_parse_instrument(file, sizeof file - 1, "short.json", &tool));
    begin_with(&s, &tool);
    const OmPsm psm = *om_world_psm(s.field, 0);
    assert_int_equal(om__link_count(s.link, s.jaw) + om__link_count(s.link, s.jaw_is) +
                         om__link_count(s.link, s.jaw_to) + om__link_count(s.link, s.jaw_effort),
                     0);
    order(&s, "home");
    step(&s, DT);
    m = last(&s, s.setpoint_js);
    assert_true(m.joints.nposition == 5 && m.joints.nname == 5);
    assert_string_equal(m.joints.name[4], "wrist_pitch");
    // a goal with an orientation that five joints do not reach
    const OmPose before = last(&s, s.setpoint_cp).pose;
    OmPose goal = before;
    goal.p = om_add(goal.p, om_vec3(0.004, 0.003, -0.005));
    goal.q = om_quat_mul(goal.q, om_quat_axis_angle(om_vec3(0, 1, 0), 0.2));
    assert_status(om_psm_inverse(&psm, goal, m.joints.position, q), OM_INVALID);
    for (int i = 0; i < 12; ++i) {
        assert_ok(om__link_write(s.link, s.servo_cp, &(LinkMessage){.pose = goal}));
        step(&s, DT);
    }
    const OmPose there = last(&s, s.setpoint_cp).pose;
    assert_near(om_distance(there.p, goal.p), 0, 1e-9);
    assert_true(om_quat_angle(there.q, goal.q) < 0.2 && om_quat_angle(there.q, goal.q) > 0.01);
    m = last(&s, s.setpoint_js);
    OmPose made = om_psm_forward(&s.robot->hand[0].core.psm, m.joints.position);
    assert_near(om_distance(made.p, there.p), 0, 1e-9);
    assert_near(om_quat_angle(made.q, there.q), 0, 1e-6);
    // the field went there, too
    OmObservation seen = {0};
    assert_ok(om_world_observe(s.field, 0, &seen));
    assert_near(om_distance(seen.arm[0].tip.p, there.p), 0, 1e-3);
    om_observation_done(&seen);
    // five joints are a command, six are not
    memcpy(q, m.joints.position, 5 * sizeof *q);
    q[4] += 0.1;
    LinkMessage joints = {.joints = {.nposition = 5}};
    memcpy(joints.joints.position, q, 5 * sizeof *q);
    assert_ok(om__link_write(s.link, s.move_jp, &joints));
    for (int i = 0; i < 20; ++i) step(&s, DT);
    assert_near(last(&s, s.setpoint_js).joints.position[4], q[4], 1e-9);
    joints.joints.nposition = 6;
    assert_ok(om__link_write(s.link, s.move_jp, &joints));
    step(&s, DT);
    assert_non_null(strstr(last(&s, s.warning).text, "6 positions; the arm has 5 joints"));
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    char answer[8192];
    tell(fd, s.udp_port, "{\"arm\": \"PSM1\", \"jaw\": 0.3}");
    step(&s, DT);
    const ssize_t n = recv(fd, answer, sizeof answer - 1, 0);
    assert_true(n > 0);
    answer[n] = 0;
    assert_non_null(strstr(answer, "the instrument has no jaw"));
    close(fd);
    // not after the first step
    assert_status(om_world_set_tool(s.field, 0, &tool), OM_INVALID);
    assert_status(om_world_set_tool(s.field, 2, &tool), OM_INVALID);
    end(&s);
}

// A disk that does not answer.
typedef struct Gate {
    atomic_bool is_open;
    atomic_int nwaiting;
} Gate;

static void wait_at(void* ctx) {
    Gate* g = ctx;
    const double end = om_clock_now() + 20;
    atomic_fetch_add(&g->nwaiting, 1);
    while (!atomic_load(&g->is_open) && om_clock_now() < end)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    atomic_fetch_sub(&g->nwaiting, 1);
}

// The disk of a recording stands: the arms do not wait for it, and their poses are in the file once it answers.
static void stopped_disk(void** unused) {
    (void)unused;
    Served s;
    OmDdsRobotDef def;
    OmDdsMotion m;
    Gate gate = {false};
    char name[100];
    snprintf(name, sizeof name, "/tmp/om_robot_%d.mcap", (int)getpid());
    make_robot(&s, &def, om_vec3(8, 8, 1));
    def.picture_rate = 0;
    def.record = name;
    assert_ok(om_dds_robot_create(&def, &s.robot));
    om__tape_hinder(s.robot->tape, TAPE_MOST, wait_at, &gate);
    assert_ok(om_dds_robot_run(s.robot, 0.4, NULL));
    assert_int_equal(atomic_load(&gate.nwaiting), 1);
    assert_below(om_dds_robot_report(s.robot).wall_time, 10);
    atomic_store(&gate.is_open, true);
    assert_ok(om_dds_robot_end_record(s.robot));
    assert_ok(om_dds_motion_load(name, "PSM2", &m));
    assert_int_equal(m.n, 40);
    assert_near(m.time[39] - m.time[0], 0.39, 1e-6);
    om_dds_motion_done(&m);
    unlink(name);
    om_dds_robot_destroy(s.robot);
    om_world_destroy(s.field);
    om_site_done(&s.site);
}

// Topics of the whole system: a sentence, and no arm moves or changes its state; power_off stops arms.
static void whole_system(void** unused) {
    (void)unused;
    static const char* const sentence[3] = {"power_on: nothing", "home: nothing", "power_off: the"};
    Served s;
    begin(&s);
    order(&s, "home");
    step(&s, DT);
    double q[OM_PSM_NJOINT];
    memcpy(q, last(&s, s.setpoint_js).joints.position, sizeof q);
    q[3] += 1;
    drive(&s, s.move_jp, q);
    for (int k = 0; k < 3; ++k) {
        step(&s, DT);
        const double before = last(&s, s.setpoint_js).joints.position[3];
        assert_ok(om__link_write(s.link, s.system[k], &(LinkMessage){0}));
        step(&s, DT);
        const LinkMessage m = last(&s, s.system_status);
        assert_ptr_equal(strstr(m.text, sentence[k]), m.text);
        const double after = last(&s, s.setpoint_js).joints.position[3];
        assert_int_equal(after > before, k < 2);
    }
    // free is a hold here: a move ends before its goal
    q[3] -= 2;
    drive(&s, s.move_jp, q);
    for (int k = 0; k < 3; ++k) step(&s, DT);
    last(&s, s.status);
    assert_ok(om__link_write(s.link, s.freed, &(LinkMessage){0}));
    step(&s, DT);
    assert_non_null(strstr(last(&s, s.status).text, "free: the arm stops"));
    const double there = last(&s, s.setpoint_js).joints.position[3];
    for (int k = 0; k < 3; ++k) step(&s, DT);
    assert_near(last(&s, s.setpoint_js).joints.position[3], there, 0);
    assert_ok(om__link_write(s.link, s.tool_present, &(LinkMessage){.is_on = true}));
    step(&s, DT);
    assert_non_null(strstr(last(&s, s.status).text, "emulate_tool_present"));
    end(&s);
}

// A negative effort closes the jaw, a positive one opens it, a status says so once.
static void effort(void** unused) {
    (void)unused;
    LinkMessage m = {.joints = {.neffort = 1}}, said;
    Served s;
    begin(&s);
    order(&s, "home");
    step(&s, DT);
    last(&s, s.status);
    for (int k = 0; k < 4; ++k) {
        m.joints.effort[0] = k < 2 ? 0.015 : -0.02;
        assert_ok(om__link_write(s.link, s.jaw_effort, &m));
        const double is = jaw_after(&s, 30);
        if (k < 2) assert_true(is > 1);
        if (k >= 2) assert_below(is, 1e-9);
        assert_int_equal(om__link_take(s.link, s.status, &said), k % 2 == 0);
        if (k == 2) assert_non_null(strstr(said.text, "the jaw closes"));
    }
    end(&s);
}

// A speed times its step is the way between two measured poses: also of the turn, in the frame of the poses.
static void speed(void** unused) {
    (void)unused;
    Served s;
    int measured_cp;
    begin(&s);
    assert_ok(om__link_add(s.link, LINK_IN, LINK_POSE, "PSM1/measured_cp", 1, &measured_cp));
    const double end_of_wait = om_clock_now() + 20;
    while (om__link_count(s.link, measured_cp) == 0 && om_clock_now() < end_of_wait)
        om__link_wait(s.link, 0.01);
    order(&s, "home");
    step(&s, DT);
    double q[OM_PSM_NJOINT];
    memcpy(q, last(&s, s.setpoint_js).joints.position, sizeof q);
    q[0] += 0.2, q[3] += 0.5;
    drive(&s, s.move_jp, q);
    last(&s, s.measured_cv);
    OmPose before = last(&s, measured_cp).pose;
    double fastest = 0;
    for (int i = 0; i < 8; ++i) {
        step(&s, DT);
        const OmPose now = last(&s, measured_cp).pose;
        const LinkMessage m = last(&s, s.measured_cv);
        assert_string_equal(m.frame, "world");
        assert_near(om_distance(om_madd(before.p, DT, m.twist.linear), now.p), 0, 1e-12);
        const OmVec3 w = m.twist.angular;
        const double turn = om_norm(w) * DT;
        const OmVec3 axis = om_scale(turn > 0 ? sin(turn / 2) / om_norm(w) : 0, w);
        const OmQuat d = {.w = cos(turn / 2), .x = axis.x, .y = axis.y, .z = axis.z};
        const OmQuat to = om_quat_mul(d, before.q);
        const double same = to.w * now.q.w + to.x * now.q.x + to.y * now.q.y + to.z * now.q.z;
        assert_near(fabs(same), 1, 1e-12);
        fastest = fmax(fastest, om_norm(w));
        before = now;
    }
    assert_true(fastest > 0.1);
    end(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(joint_limits),  cmocka_unit_test(reader_gone),
        cmocka_unit_test(sender_gone),   cmocka_unit_test(fault),
        cmocka_unit_test(frames),        cmocka_unit_test(jaw),
        cmocka_unit_test(jaw_on_tissue), cmocka_unit_test(many_datagrams),
        cmocka_unit_test(tissue_behind), cmocka_unit_test(whole_system),
        cmocka_unit_test(effort),        cmocka_unit_test(speed),
        cmocka_unit_test(stopped_disk),  cmocka_unit_test(short_wrist),
        cmocka_unit_test(mover_gone)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
