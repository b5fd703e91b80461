// test_dds_lies.c: a robot that lies, and a world over DDS that drives it: motion stops, with the reason.
#include <stdatomic.h>
#include <string.h>
#include <time.h>

#include "dds/dds_link.h"
#include "easy_scene.h"
#include "omentum/base_job.h"
#include "test_common.h"
#include "test_domain.h"

#define DT 0.02
#define PERIOD 0.01  // s, of the robot's messages
#define OTHER_ARM "left/PSM_7"
#define OTHER_CAMERA "kinect/"

typedef enum Lie {
    NONE,
    GROWS,     // its pictures become larger
    NAN_TURN,  // a quaternion that is not finite
    TURNS,     // an arm is turned about at once
    FROZEN,    // the stamps stand still: old messages, sent again
    STILL,     // an arm does not go where it is sent
    APART,     // the setpoint is not where the arm is
    ERROR,     // an error, with a stamp as simulators send it
    SILENT,    // nothing comes while the program is busy
    FAULT,     // an arm is not enabled
    LATE,      // pictures are 0.3 s on their way: no lie
    OLD,       // pictures are 30 s old
    MIXED,     // each pose is followed by one of 50 ms before, which is 60 mm away: no lie
    IMAGE,     // no points, but a depth image in m: no lie
    IMAGE_MM,  // the same in mm, sent without reliability, all with other names
    IMAGE_8,   // the same of 8 bits: of what?
    PERSON     // no lie: a person presses Ctrl-C
} Lie;

typedef struct Arm {
    int cp, js, setpoint, jaw, jaw_setpoint, state, tool, error, servo, hold;
    OmPose tip;
    double q[OM_PSM_NJOINT];
} Arm;

typedef struct Robot {
    OmScene scene;
    OmSite site;
    Link* link;
    Arm arm[2];
    int tf, depth_info, info, cloud, image;
    Lie lie;
    atomic_bool is_lying, is_over;
    atomic_int nservo;  // goals for PSM1
    atomic_int nhold;   // holds of both arms
    OmJob* job;
} Robot;

static float point[4 * 128 * 96];  // x, y, z, rgb of the largest cloud
static float metre[64 * 48];       // of a depth image, and the same
static uint16_t millimetre[64 * 48];

static OmDdsDef make_dds(void) {
    OmDdsDef def = om_dds_default_def();
    def.domain = test_domain();
    return def;
}

static void pause_for(double seconds) {
    const struct timespec t = {(time_t)seconds, (long)(1e9 * (seconds - floor(seconds)))};
    nanosleep(&t, NULL);
}

static void send_arm(Robot* r, Arm* arm, double time, double stamp) {
    const Lie lie = r->is_lying ? r->lie : NONE;
    LinkMessage m;
    const bool is_first = arm == r->arm;
    while (om__link_take(r->link, arm->servo, &m)) {
        r->nservo += is_first;
        if (r->lie != STILL) arm->tip = m.pose;
    }
    while (om__link_take(r->link, arm->hold, &m)) ++r->nhold;
    m = (LinkMessage){.time = lie == FROZEN ? stamp : time, .frame = "world", .pose = arm->tip};
    if (lie == NAN_TURN && is_first) m.pose.q.x = NAN;
    if (lie == TURNS && is_first) m.pose.q = (OmQuat){.x = 1};
    om__link_write(r->link, arm->cp, &m);
    if (lie == MIXED) {
        m.time -= 5 * PERIOD;
        m.pose.p.x += 0.06;
        om__link_write(r->link, arm->cp, &m);
        m.time = time;
    }
    m.pose = arm->tip;
    if (r->lie == APART) m.pose.p.x += 0.045;
    om__link_write(r->link, arm->setpoint, &m);
    m = (LinkMessage){.time = time, .joints = {.nposition = OM_PSM_NJOINT}};
    memcpy(m.joints.position, arm->q, sizeof arm->q);
    om__link_write(r->link, arm->js, &m);
    m = (LinkMessage){.time = time, .joints = {.nposition = 1}};
    om__link_write(r->link, arm->jaw, &m);
    om__link_write(r->link, arm->jaw_setpoint, &m);
    m = (LinkMessage){.time = time, .state = {.name = "ENABLED", .is_homed = true}};
    if (r->lie == FAULT) {
        snprintf(m.state.name, sizeof m.state.name, "FAULT");
        m.state.is_homed = false;
    }
    om__link_write(r->link, arm->state, &m);
    m = (LinkMessage){.time = time, .text = "hit the board"};
    if (lie == ERROR) om__link_write(r->link, arm->error, &m);
}

// Depth grows along the rows, and the first pixel has none.
static void send_image(Robot* r, double time) {
    const bool is_mm = r->lie == IMAGE_MM;
    const int n = is_mm ? 2 : 4;
    LinkMessage m = {.time = time, .frame = "camera"};
    for (int i = 1; i < 64 * 48; ++i) millimetre[i] = (uint16_t)(100 + i);
    for (int i = 1; i < 64 * 48; ++i) metre[i] = 1e-3f * (float)(100 + i);
    metre[0] = NAN;
    m.picture = (LinkPicture){.width = 64, .height = 48, .step = n * 64};
    m.picture.data = is_mm ? (const unsigned char*)millimetre : (const unsigned char*)metre;
    m.picture.size = (size_t)n * 64 * 48;
    snprintf(m.picture.encoding, sizeof m.picture.encoding, "%s",
             is_mm               ? "16UC1"
             : r->lie == IMAGE_8 ? "8UC1"
                                 : "32FC1");
    om__link_write(r->link, r->image, &m);
}

static void send_pictures(Robot* r, double time) {
    const bool is_large = r->is_lying && r->lie == GROWS;
    const int w = is_large ? 128 : 64, h = is_large ? 96 : 48;
    LinkMessage m = {.time = time, .frame = "camera", .info = {.width = w, .height = h}};
    m.info.lens = (OmLens){.fx = w, .fy = w, .cx = 0.5 * w, .cy = 0.5 * h};
    om__link_write(r->link, r->depth_info, &m);
    om__link_write(r->link, r->info, &m);
    if (r->image >= 0) send_image(r, time);
    if (r->image >= 0) return;
    m = (LinkMessage){.time = time, .frame = "camera"};
    m.picture = (LinkPicture){.width = w,
                              .height = h,
                              .point_step = 16,
                              .step = 16 * w,
                              .y = 4,
                              .z = 8,
                              .rgb = 12,
                              .data = (unsigned char*)point,
                              .size = 16 * (size_t)w * (size_t)h};
    om__link_write(r->link, r->cloud, &m);
}

static OmStatus be_robot(void* ctx, const OmProgress* progress) {
    Robot* r = ctx;
    double time = 1, stamp = 0;
    (void)progress;
    for (int k = 0; !r->is_over; ++k, time += PERIOD) {
        pause_for(PERIOD);
        const bool is_silent = r->is_lying && r->lie == SILENT;
        if (!r->is_lying) stamp = time;
        for (int a = 0; a < 2 && !is_silent; ++a) send_arm(r, &r->arm[a], time, stamp);
        for (LinkMessage m; is_silent && om__link_take(r->link, r->arm[0].servo, &m);) ++r->nservo;
        const double age = r->lie == LATE ? 0.3 : r->lie == OLD ? 30 : 0;
        if (k % 5 == 0) send_pictures(r, time - age);
    }
    return OM_OK;
}

static void add(Robot* r, const char* arm, const char* name, unsigned flags, LinkType type,
                int* id) {
    char text[80];
    snprintf(text, sizeof text, "%s%s", arm, name);
    assert_ok(om__link_add(r->link, flags, type, text, 10, id));
}

static void begin(Robot* r, Lie lie) {
    const OmDdsDef dds = make_dds();
    const char* const names[2] = {lie == IMAGE_MM ? OTHER_ARM : "PSM1", "PSM2"};
    const char* const camera = lie == IMAGE_MM ? OTHER_CAMERA : "";
    LinkMessage tf = {.tf = {.n = 3}};
    unsetenv("CYCLONEDDS_URI");
    *r = (Robot){.scene = easy_scene(), .lie = lie};
    r->scene.tissue.cells = om_vec3(4, 4, 1);
    r->scene.rgbd.width = 64, r->scene.rgbd.height = 48;
    assert_ok(om_site_build(&r->scene, OM_SITE_TWIN, NULL, &r->site));
    assert_ok(om__link_create(&dds, &r->link));
    for (int a = 0; a < 2; ++a) {
        Arm* arm = &r->arm[a];
        const char* name = names[a];
        const OmPsm psm = om_world_place_psm(&r->site, a);
        const double middle[OM_PSM_NJOINT] = {0};
        arm->tip = om_world_place_tip(&r->site, a);
        assert_ok(om_psm_inverse(&psm, arm->tip, middle, arm->q));
        add(r, name, "/measured_cp", LINK_OUT, LINK_POSE, &arm->cp);
        add(r, name, "/measured_js", LINK_OUT, LINK_JOINTS, &arm->js);
        add(r, name, "/setpoint_cp", LINK_OUT, LINK_POSE, &arm->setpoint);
        add(r, name, "/jaw/measured_js", LINK_OUT, LINK_JOINTS, &arm->jaw);
        add(r, name, "/jaw/setpoint_js", LINK_OUT, LINK_JOINTS, &arm->jaw_setpoint);
        add(r, name, "/operating_state", LINK_OUT | LINK_LATCHED, LINK_STATE, &arm->state);
        add(r, name, "/tool_type", LINK_OUT | LINK_LATCHED, LINK_STRING, &arm->tool);
        add(r, name, "/error", LINK_OUT, LINK_STAMPED, &arm->error);
        add(r, name, "/servo_cp", LINK_IN, LINK_POSE, &arm->servo);
        add(r, name, "/hold", LINK_IN, LINK_EMPTY, &arm->hold);
        assert_ok(om__link_write(r->link, arm->tool, &(LinkMessage){.text = "PROGRASP"}));
        tf.tf.frame[a] = (LinkFrame){.parent = "world", .pose = psm.pose_world_rcm};
        snprintf(tf.tf.frame[a].child, sizeof tf.tf.frame[a].child, "%s_base", names[a]);
    }
    tf.tf.frame[2] = (LinkFrame){.parent = "world", .child = "camera", .pose = om_pose_identity()};
    add(r, "", "tf_static", LINK_OUT | LINK_LATCHED, LINK_TF, &r->tf);
    const unsigned pictures = lie == IMAGE_MM ? LINK_OUT | LINK_LOSSY : LINK_OUT;
    add(r, camera, "depth/camera_info", pictures, LINK_INFO, &r->depth_info);
    add(r, camera, "endoscope/camera_info", pictures, LINK_INFO, &r->info);
    const bool is_image = lie == IMAGE || lie == IMAGE_MM || lie == IMAGE_8;
    r->image = -1;
    if (is_image) add(r, camera, "depth/image_raw", pictures, LINK_IMAGE, &r->image);
    if (!is_image) add(r, "", "depth/points", LINK_OUT, LINK_CLOUD, &r->cloud);
    assert_ok(om__link_write(r->link, r->tf, &tf));
    assert_ok(om_job_start(be_robot, r, &r->job));
}

static void end(Robot* r) {
    r->is_over = true;
    om_job_join(r->job);
    om__link_destroy(r->link);
    om_site_done(&r->site);
}

static bool is_pressed(void* ctx) {
    (void)ctx;
    return true;
}

// Goals of the whole way: more where the lie must be heard before the last one. No more than a topic holds (10) where
// all are counted.
static int ngoal(Lie lie) {
    const bool is_heard = lie == NAN_TURN || lie == TURNS || lie == STILL || lie == ERROR;
    return is_heard ? 40 : 10;
}

// Connect, home, move PSM1 by 40 mm and lie meanwhile: what the world says, and the goals that it sent.
static OmStatus drive(Robot* r, bool homes, int* nservo) {
    OmDdsWorldDef def = om_dds_world_default_def(&r->scene);
    OmWorld* world;
    OmObservation obs = {0};
    OmPose goal = r->arm[0].tip;
    goal.p.z += 0.04;
    def.dds = make_dds();
    def.site = &r->site;
    def.wait = 20;
    def.stale = r->lie == FROZEN || r->lie == SILENT ? 1 : 5;
    // A machine under load may hold the robot's thread for 0.1 s: no lie, but 20 mm of the way.
    const bool follows = r->lie != STILL && r->lie != APART;
    if (follows) def.max_jump = 0.05;
    assert_ok(om_world_create_dds(&def, &world));
    OmStatus status = homes ? om_world_reset(world) : OM_OK;
    const bool sees = r->lie == GROWS || r->lie == LATE || r->lie == OLD;
    if (status == OM_OK && sees)
        status = om_world_observe(world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs);
    if (status == OM_OK) status = om_world_move(world, 0, goal, 40e-3 / (ngoal(r->lie) * DT));
    if (r->lie == SILENT) pause_for(0.5);  // of these messages the last ones wait
    r->is_lying = true;
    if (r->lie == SILENT) pause_for(2);
    for (int k = 0; k < 120 && status == OM_OK; ++k) {
        if (r->lie == PERSON && k == 3) om_stop_set(is_pressed, NULL);
        status = om_world_advance(world, DT);
        if (status == OM_OK && r->lie == GROWS)
            status = om_world_observe(world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs);
    }
    om_observation_done(&obs);
    if (r->lie == PERSON) pause_for(10 * PERIOD);  // holds that are on their way
    om_world_destroy(world);
    pause_for(10 * PERIOD);  // goals that are on their way
    *nservo = r->nservo;
    return status;
}

static void expect(Lie lie, bool homes, OmStatus status, const char* words, int most) {
    Robot r;
    int nservo;
    begin(&r, lie);
    assert_status(drive(&r, homes, &nservo), status);
    if (words && !strstr(om_error_message(), words)) fail_msg("%s", om_error_message());
    assert_true(nservo <= most);
    end(&r);
}

static void an_honest_robot(void** unused) {
    (void)unused;
    Robot r;
    int nservo;
    begin(&r, NONE);
    assert_ok(drive(&r, true, &nservo));
    assert_int_equal(nservo, 10);  // 40 mm in steps of 4
    end(&r);
}

static void lies_stop_the_arms(void** unused) {
    (void)unused;
    expect(GROWS, true, OM_IO, "have become 128 x 96", 10);
    expect(NAN_TURN, true, OM_IO, "not finite", 39);
    expect(TURNS, true, OM_IO, "and 90 degrees", 39);
    expect(STILL, true, OM_IO, "from where it was sent", 21);
    expect(APART, true, OM_IO, "45 mm from where it was sent", 0);
    expect(ERROR, true, OM_IO, "hit the board", 39);
}

static void old_messages_are_none(void** unused) {
    (void)unused;
    expect(FROZEN, true, OM_IO, "measured_cp: nothing for", 10);
    expect(SILENT, true, OM_IO, "measured_cp: nothing for", 0);
}

// Poses that come out of order: the newest counts.
static void order_of_messages(void** unused) {
    (void)unused;
    Robot r;
    int nservo;
    begin(&r, MIXED);
    assert_ok(drive(&r, true, &nservo));
    assert_int_equal(nservo, 10);
    end(&r);
}

// A picture that was taken since the arms have held for it is new, however late it comes.
static void pictures_are_new(void** unused) {
    (void)unused;
    expect(LATE, true, OM_OK, NULL, 10);
    expect(OLD, true, OM_IO, "depth/points: no new picture within 1 s", 0);
}

// A depth camera without points: its image is read, in m or in mm, and there is no colour.
static void a_depth_image(void** unused) {
    (void)unused;
    for (Lie lie = IMAGE; lie <= IMAGE_8; ++lie) {
        Robot r;
        OmWorld* world;
        OmObservation obs = {0};
        begin(&r, lie);
        OmDdsWorldDef def = om_dds_world_default_def(&r.scene);
        def.dds = make_dds();
        def.wait = 20;
        def.stale = 5;
        if (lie == IMAGE_MM) {
            def.depth = "no space";
            assert_status(om_world_create_dds(&def, &world), OM_INVALID);
            def.arm[0] = OTHER_ARM;
            def.depth = OTHER_CAMERA "depth";
            def.endoscope = OTHER_CAMERA "endoscope";
        }
        const OmStatus status = om_world_create_dds(&def, &world);
        if (lie == IMAGE_8) {
            assert_status(status, OM_IO);
            assert_non_null(
                strstr(om_error_message(), "depth/image_raw: 64 x 48 pixels of \"8UC1\""));
            end(&r);
            continue;
        }
        assert_ok(status);
        assert_int_equal(om_world_sources(world), OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH);
        assert_ok(om_world_observe(world, OM_OBSERVE_DEPTH, &obs));
        assert_null(obs.rgbd.color.pixel);
        assert_near((double)obs.rgbd.depth[0], 0, 0);
        for (int i = 1; i < 64 * 48; ++i)
            assert_near((double)obs.rgbd.depth[i], 1e-3 * (100 + i), 1e-6);
        om_observation_done(&obs);
        om_world_destroy(world);
        end(&r);
    }
}

// Ctrl-C: both arms get a hold before the program ends.
static void a_person_stops_the_arms(void** unused) {
    (void)unused;
    Robot r;
    int nservo;
    begin(&r, PERSON);
    assert_status(drive(&r, true, &nservo), OM_CANCELLED);
    assert_true(om_stop_take());
    om_stop_set(NULL, NULL);
    assert_int_equal(r.nhold, 2);
    assert_true(nservo >= 3 && nservo <= 5);
    end(&r);
}

static void nothing_moves_before_it_is_homed(void** unused) {
    (void)unused;
    expect(NONE, false, OM_INVALID, "om_world_reset", 0);
    expect(FAULT, true, OM_INVALID, "clear_fault", 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_honest_robot),
        cmocka_unit_test(lies_stop_the_arms),
        cmocka_unit_test(old_messages_are_none),
        cmocka_unit_test(order_of_messages),
        cmocka_unit_test(pictures_are_new),
        cmocka_unit_test(a_depth_image),
        cmocka_unit_test(a_person_stops_the_arms),
        cmocka_unit_test(nothing_moves_before_it_is_homed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
