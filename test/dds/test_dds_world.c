// test_dds_world.c: a simulated field behind the topics, in lock-step, answers as the field itself, to the last bit;
// and what stops a world over DDS. Robot and world are two threads of this process.
#include <string.h>

#include "dds/dds_link.h"
#include "easy_scene.h"
#include "omentum/base_job.h"
#include "test_common.h"
#include "test_domain.h"

#define DT 0.02
#define BUSY 5.0  // s without a pose on a busy machine

typedef struct Served {  // a field behind topics
    OmScene scene;
    OmSite site;
    OmWorld* field;
    OmDdsRobot* robot;
    OmJob* job;
    double seconds;
} Served;

static OmDdsDef make_dds(void) {
    OmDdsDef def = om_dds_default_def();
    def.domain = test_domain();
    return def;
}

static OmStatus serve(void* ctx, const OmProgress* progress) {
    Served* s = ctx;
    return om_dds_robot_run(s->robot, s->seconds, progress);
}

static OmScene small_scene(void) {
    OmScene s = easy_scene();
    s.tissue.cells = om_vec3(4, 4, 1);
    s.tissue.world_cells = om_vec3(8, 8, 1);
    s.rgbd.width = 64, s.rgbd.height = 48;
    s.task.grasp_radius = 0.025;
    s.world.force_noise = 0.01;
    return s;
}

static void begin(Served* s, bool is_lock_step, double seconds) {
    unsetenv("CYCLONEDDS_URI");
    *s = (Served){.scene = small_scene(), .seconds = seconds};
    assert_ok(om_site_build(&s->scene, OM_SITE_WORLD, NULL, &s->site));
    assert_ok(om_world_create_simulated(&s->scene, &s->site, 1, &s->field));
    assert_true(om_world_reset(s->field) >= 0);
    OmDdsRobotDef def = om_dds_robot_default_def(s->field, &s->scene, &s->site);
    def.dds = make_dds();
    def.is_lock_step = is_lock_step;
    assert_ok(om_dds_robot_create(&def, &s->robot));
    assert_ok(om_job_start(serve, s, &s->job));
}

static void end(Served* s) {
    if (s->job) {
        om_job_cancel(s->job);
        om_job_join(s->job);
    }
    om_dds_robot_destroy(s->robot);
    om_world_destroy(s->field);
    om_site_done(&s->site);
}

static OmWorld* connect_world(Served* s, double stale) {
    OmDdsWorldDef def = om_dds_world_default_def(&s->scene);
    OmWorld* world;
    def.dds = make_dds();
    def.site = &s->site;
    def.stale = stale;
    assert_ok(om_world_create_dds(&def, &world));
    return world;
}

static void expect_same_arms(const OmObservation* a, const OmObservation* b) {
    assert_near(a->time, b->time, 0);
    assert_int_equal(a->narm, b->narm);
    for (int k = 0; k < a->narm; ++k) {
        const OmArmObservation *p = &a->arm[k], *q = &b->arm[k];
        assert_near(p->time, q->time, 0);
        assert_memory_equal(&p->tip, &q->tip, sizeof p->tip);
        assert_memory_equal(p->q, q->q, sizeof p->q);
        assert_near(p->jaw, q->jaw, 0);
        assert_near(p->jaw_goal, q->jaw_goal, 0);
        assert_near(p->jaw_speed, q->jaw_speed, 0);
        assert_true(p->is_moving == q->is_moving);
        assert_memory_equal(&p->force, &q->force, sizeof p->force);
    }
}

static void expect_same_pictures(const OmObservation* a, const OmObservation* b) {
    const int n = a->rgbd.camera.width * a->rgbd.camera.height;
    assert_int_equal(a->rgbd.camera.width, b->rgbd.camera.width);
    assert_memory_equal(a->rgbd.depth, b->rgbd.depth, (size_t)n * sizeof *a->rgbd.depth);
    assert_memory_equal(a->rgbd.color.pixel, b->rgbd.color.pixel, 3 * (size_t)n);
    assert_near(om_camera_lens(&a->rgbd.camera).fx, om_camera_lens(&b->rgbd.camera).fx, 0);
    assert_int_equal(a->endoscope.color.width, b->endoscope.color.width);
    assert_memory_equal(a->endoscope.color.pixel, b->endoscope.color.pixel,
                        3 * (size_t)a->endoscope.color.width * (size_t)a->endoscope.color.height);
    assert_near(a->endoscope.time, b->endoscope.time, 0);
}

// The field itself and the one behind topics, from the same start: reach, grasp, lift, let fall.
static void as_the_field(void** unused) {
    (void)unused;
    Served served;
    begin(&served, true, INFINITY);
    OmWorld *far = connect_world(&served, BUSY), *near;
    assert_ok(om_world_create_simulated(&served.scene, &served.site, 1, &near));
    assert_true(om_world_reset(near) >= 0);
    assert_ok(om_world_reset(far));
    assert_true(far->waits);
    OmWorld* const both[2] = {near, far};
    OmPose tip = om_world_place_tip(&served.site, 0);
    const OmPose top = om_pose_mul(served.site.pose_world_task,
                                   (OmPose){om_vec3(-0.02, -0.03, 0.006), om_quat_identity()});
    tip.p = top.p;
    const unsigned what = OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR;
    bool has_held = false;
    for (int tick = 0; tick < 90; ++tick) {
        OmObservation obs[2] = {{0}, {0}};
        for (int k = 0; k < 2; ++k) {
            OmPose up = tip;
            up.p.z += 0.03;
            if (tick == 0) assert_ok(om_world_move(both[k], 0, tip, 0.2));
            if (tick == 30) assert_ok(om_world_set_jaw(both[k], 0, 0));
            if (tick == 45) assert_ok(om_world_move(both[k], 0, up, 0.1));
            if (tick == 70) om_world_stop(both[k], 0);
            if (tick == 75) assert_ok(om_world_set_jaw(both[k], 0, 0.7));
            assert_ok(om_world_advance(both[k], DT));
            assert_ok(om_world_observe(both[k], tick % 15 == 0 ? what : 0, &obs[k]));
        }
        expect_same_arms(&obs[0], &obs[1]);
        if (tick % 15 == 0) expect_same_pictures(&obs[0], &obs[1]);
        has_held |= om_arm_is_holding(&obs[1].arm[0]);
        for (int k = 0; k < 2; ++k) om_observation_done(&obs[k]);
    }
    assert_true(has_held);  // otherwise the tissue was not tested
    // what the world itself refuses
    tip.p.z += 1;
    assert_status(om_world_move(far, 0, tip, 0.1), OM_INVALID);
    assert_status(om_world_move(far, 0, top, 0.3), OM_INVALID);  // too fast
    om_world_destroy(far);
    om_world_destroy(near);
    end(&served);
}

// A reader's next message; the test fails after 5 s without one.
static LinkMessage next(Link* link, int id) {
    const double end = om_clock_now() + 5;
    LinkMessage m = {0};
    bool is_there = false;
    while (!(is_there = om__link_take(link, id, &m)) && om_clock_now() < end)
        om__link_wait(link, 0.02);
    assert_true(is_there);
    return m;
}

// A tick that says how many commands it follows waits for them: here its command is sent after it.
static void a_tick_waits(void** unused) {
    (void)unused;
    Served s;
    Link* link;
    int tick, tock, home;
    begin(&s, true, INFINITY);
    const OmDdsDef dds = make_dds();
    assert_ok(om__link_create(&dds, &link));
    assert_ok(om__link_add(link, LINK_OUT, LINK_TICK, "omentum/tick", 5, &tick));
    assert_ok(om__link_add(link, LINK_IN, LINK_TOCK, "omentum/tock", 5, &tock));
    assert_ok(om__link_add(link, LINK_OUT, LINK_STAMPED, "PSM1/state_command", 1, &home));
    while (!om__link_count(link, tick) || !om__link_count(link, tock) ||
           !om__link_count(link, home))
        om__link_wait(link, 0.01);
    LinkMessage m = {.tick = {.client = 7, .number = 1}};
    assert_ok(om__link_write(link, tick, &m));
    assert_int_equal(next(link, tock).tick.number, 1);
    m.tick.number = 2, m.tick.ncommand = 1, m.tick.dt = DT;
    assert_ok(om__link_write(link, tick, &m));
    const double until = om_clock_now() + 0.15;
    while (om_clock_now() < until) om__link_wait(link, 0.05);
    assert_false(om__link_take(link, tock, &m));
    assert_ok(om__link_write(link, home, &(LinkMessage){.text = "home"}));
    m = next(link, tock);
    assert_int_equal(m.tick.number, 2);
    assert_near(m.time, DT, 1e-12);
    om__link_destroy(link);
    end(&s);
}

// A robot by the wall clock, a world that drives it, and a link of somebody else.
static OmWorld* begin_real(Served* s, Link** other) {
    const OmDdsDef dds = make_dds();
    begin(s, false, INFINITY);
    OmWorld* world = connect_world(s, BUSY);
    assert_ok(om_world_reset(world));
    assert_false(world->waits);
    assert_ok(om_world_advance(world, DT));
    assert_ok(om__link_create(&dds, other));
    return world;
}

// Advance until the world stops, for 4 s at most.
static OmStatus drive(OmWorld* world) {
    OmStatus status = OM_OK;
    for (int k = 0; k < 200 && status == OM_OK; ++k) status = om_world_advance(world, DT);
    return status;
}

// A state that another client changes, and a robot that goes away, stop the world with a sentence that stays.
static void stops(void** unused) {
    (void)unused;
    Served s;
    Link* other;
    int id;
    OmWorld* world = begin_real(&s, &other);
    assert_ok(om__link_add(other, LINK_OUT, LINK_STAMPED, "PSM2/state_command", 1, &id));
    while (om__link_count(other, id) == 0) om__link_wait(other, 0.01);
    assert_ok(om__link_write(other, id, &(LinkMessage){.text = "pause"}));
    const OmStatus status = drive(world);
    assert_int_equal(status, OM_IO);
    assert_non_null(strstr(om_error_message(), "PSM2 is PAUSED"));
    assert_status(om_world_set_jaw(world, 0, 0), OM_IO);
    assert_non_null(strstr(om_error_message(), "PSM2 is PAUSED"));
    om_world_destroy(world);
    om__link_destroy(other);
    end(&s);
}

// A second source of an arm's pose lies: each lie stops the world. An old pose that comes late is no lie, and is not
// used.
static void lies(void** unused) {
    (void)unused;
    static const struct {
        double off, late;  // m; s
        const char* words;
    } lie[] = {{0.03, 0, "the measured pose jumped by"}, {NAN, 0, "not finite"}, {0.03, 5, NULL}};
    Served s;
    begin(&s, false, INFINITY);
    Link* other;
    int pose, read;
    const OmDdsDef dds = make_dds();
    assert_ok(om__link_create(&dds, &other));
    assert_ok(om__link_add(other, LINK_OUT, LINK_POSE, "PSM1/measured_cp", 5, &pose));
    assert_ok(om__link_add(other, LINK_IN, LINK_POSE, "PSM1/measured_cp", 1, &read));
    for (size_t k = 0; k < sizeof lie / sizeof *lie; ++k) {
        OmWorld* world = connect_world(&s, BUSY);
        assert_ok(om_world_reset(world));
        assert_ok(om_world_advance(world, DT));
        while (om__link_count(other, pose) < 2)
            om__link_wait(other, 0.01);  // itself, and the world
        LinkMessage m = next(other, read);
        m.pose.p.x += lie[k].off;
        m.time += lie[k].late > 0 ? -lie[k].late : 1e-3;
        assert_ok(om__link_write(other, pose, &m));
        OmStatus status = OM_OK;
        for (int i = 0; i < 10 && status == OM_OK; ++i) status = om_world_advance(world, DT);
        assert_int_equal(status, lie[k].words ? OM_IO : OM_OK);
        if (lie[k].words) assert_non_null(strstr(om_error_message(), lie[k].words));
        om_world_destroy(world);
    }
    om__link_destroy(other);
    end(&s);
}

// Another robot on the same domain: it is not known which one a command reaches.
static void two_robots(void** unused) {
    (void)unused;
    Served s;
    Link* other;
    int id;
    OmWorld* world = begin_real(&s, &other);
    assert_ok(
        om__link_add(other, LINK_OUT | LINK_LATCHED, LINK_STATE, "PSM2/operating_state", 1, &id));
    const OmStatus status = drive(world);
    assert_int_equal(status, OM_IO);
    assert_non_null(strstr(om_error_message(), "PSM2: 2 robots answer on domain"));
    om_world_destroy(world);
    om__link_destroy(other);
    end(&s);
}

static void gone(void** unused) {
    (void)unused;
    Served s;
    OmWorld* world;
    begin(&s, false, INFINITY);
    Link* keeper;  // the domain stays when the robot goes
    const OmDdsDef dds = make_dds();
    assert_ok(om__link_create(&dds, &keeper));
    world = connect_world(&s, 1.0);
    assert_ok(om_world_reset(world));
    om_job_cancel(s.job);
    om_job_join(s.job);
    s.job = NULL;
    const OmStatus status = drive(world);
    assert_int_equal(status, OM_IO);
    assert_non_null(strstr(om_error_message(), "measured_cp: nothing for"));
    om_world_destroy(world);
    om__link_destroy(keeper);
    end(&s);
}

// The endoscope shows its pose and its states, and refuses to move; a jump of an arm is refused with a warning.
static void endoscope_and_warnings(void** unused) {
    (void)unused;
    Served s;
    Link* link;
    int pose, state, move, warning, arm_state, arm_home, arm_servo, arm_warning;
    begin(&s, false, INFINITY);
    const OmDdsDef dds = make_dds();
    assert_ok(om__link_create(&dds, &link));
    assert_ok(om__link_add(link, LINK_IN, LINK_POSE, "ECM/measured_cp", 1, &pose));
    const unsigned latched = LINK_IN | LINK_LATCHED;
    assert_ok(om__link_add(link, latched, LINK_STATE, "ECM/operating_state", 1, &state));
    assert_ok(om__link_add(link, LINK_OUT, LINK_POSE, "ECM/move_cp", 1, &move));
    assert_ok(om__link_add(link, LINK_IN, LINK_STRING, "ECM/warning", 1, &warning));
    assert_ok(om__link_add(link, LINK_IN, LINK_STATE, "PSM1/operating_state", 9, &arm_state));
    assert_ok(om__link_add(link, LINK_OUT, LINK_STAMPED, "PSM1/state_command", 1, &arm_home));
    assert_ok(om__link_add(link, LINK_OUT, LINK_POSE, "PSM1/servo_cp", 1, &arm_servo));
    assert_ok(om__link_add(link, LINK_IN, LINK_STRING, "PSM1/warning", 1, &arm_warning));
    const OmCamera camera = om_world_endoscope(&s.scene, &s.site);
    LinkMessage m = next(link, pose);
    assert_memory_equal(&m.pose, &camera.pose_world_camera, sizeof m.pose);
    assert_string_equal(next(link, state).state.name, "DISABLED");
    while (!om__link_count(link, move) || !om__link_count(link, warning) ||
           !om__link_count(link, arm_home) || !om__link_count(link, arm_servo) ||
           !om__link_count(link, arm_warning) || !om__link_count(link, arm_state))
        om__link_wait(link, 0.01);
    assert_ok(om__link_write(link, move, &m));
    assert_non_null(strstr(next(link, warning).text, "ECM/move_cp refused"));
    assert_ok(om__link_write(link, arm_servo, &m));
    assert_non_null(strstr(next(link, arm_warning).text, "the arm is DISABLED"));
    assert_ok(om__link_write(link, arm_home, &(LinkMessage){.text = "home"}));
    m = next(link, arm_state);
    assert_string_equal(m.state.name, "ENABLED");
    assert_true(m.state.is_homed && !m.state.is_busy);
    m = (LinkMessage){.pose = om_world_place_tip(&s.site, 0)};
    m.pose.p.z += 0.06;
    assert_ok(om__link_write(link, arm_servo, &m));
    assert_non_null(strstr(next(link, arm_warning).text, "mm from the setpoint"));
    om__link_destroy(link);
    end(&s);
}

// No robot: the sentence names a topic and remedies.
static void nobody_there(void** unused) {
    (void)unused;
    OmScene scene = small_scene();
    OmDdsWorldDef def = om_dds_world_default_def(&scene);
    OmWorld* world;
    def.dds = make_dds();
    def.wait = 0.2;
    assert_status(om_world_create_dds(&def, &world), OM_UNAVAILABLE);
    assert_non_null(strstr(om_error_message(), "PSM1/measured_cp"));
    assert_non_null(strstr(om_error_message(), "rmw_zenoh"));
    def.stale = 0;
    assert_status(om_world_create_dds(&def, &world), OM_INVALID);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(as_the_field), cmocka_unit_test(a_tick_waits),
        cmocka_unit_test(stops),        cmocka_unit_test(lies),
        cmocka_unit_test(two_robots),   cmocka_unit_test(gone),
        cmocka_unit_test(nobody_there), cmocka_unit_test(endoscope_and_warnings)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
