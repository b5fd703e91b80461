// test_world_log.c: what a controller saw and did is written, and played back byte for byte.
#include <signal.h>
#include <sys/wait.h>

#include "omentum/world_log.h"
#include "plain_world.h"
#include "test_alloc.h"
#include "world/world_log_file.h"

#define STEP 0.02  // s
enum { WIDTH = 12, HEIGHT = 9, NTICK = 40 };

// The plain world with a depth camera, an endoscope, kinematics and forces: every member of an observation is in use.
typedef struct PictureWorld {
    PlainWorld plain;
    OmPsm psm;
    int ntick;
    int bad_at;                  // this tick hands out a joint that is not finite; -1: never
    double raw[WIDTH * HEIGHT];  // the last depth before the log rounds it
} PictureWorld;

static OmCamera camera(void) {
    return (OmCamera){
        .pose_world_camera = {om_vec3(0.1, -0.2, 0.3), om_quat_axis_angle(om_vec3(0, 1, 0), 0.3)},
        .width = WIDTH,
        .height = HEIGHT,
        .fov = 0.8,
        .near_m = 0.01,
        .far_m = 2};
}

static OmStatus picture_advance(OmWorld* world, double dt) {
    ++((PictureWorld*)world)->ntick;
    return plain_advance(world, dt);
}

static void fill_color(OmPicture* p, OmRng* rng) {
    assert_ok(om_picture_init(p, WIDTH, HEIGHT, 3));
    for (int i = 0; i < 3 * WIDTH * HEIGHT; ++i) p->pixel[i] = (unsigned char)om_rng_u32(rng);
}

static void fill_depth(PictureWorld* w, OmDepthPicture* p, OmRng* rng) {
    p->depth = om_alloc(WIDTH * HEIGHT, sizeof *p->depth);
    for (int i = 0; i < WIDTH * HEIGHT; ++i)
        p->depth[i] = (float)(w->raw[i] = om_rng_range(rng, 0.05, 6.6));
    p->depth[20] = (float)(w->raw[20] = 6.58);  // beyond 65,535 counts
    p->depth[3] = NAN, p->depth[7] = INFINITY, p->depth[9] = 0, p->depth[11] = -1;
}

static OmStatus picture_observe(OmWorld* world, unsigned what, OmObservation* obs) {
    PictureWorld* w = (PictureWorld*)world;
    OmRng rng = om_rng_init(5, (uint64_t)w->ntick);
    plain_observe(world, what & OM_OBSERVE_VISIBILITY, obs);
    for (int a = 0; a < world->narm; ++a) {
        OmArmObservation* arm = &obs->arm[a];
        for (int j = 0; j < OM_PSM_NJOINT; ++j) arm->q[j] = om_rng_normal(&rng);
        arm->has_wrench = a == 1;
        arm->force = om_vec3(om_rng_normal(&rng), 1, -1);
        arm->torque = om_vec3(0, om_rng_normal(&rng), 0);
    }
    if (w->ntick == w->bad_at) obs->visibility = NAN;
    if (w->ntick == 4) obs->arm[0].tip.p.x = obs->arm[0].q[2] = NAN;  // not measured
    if (what & OM_OBSERVE_IMAGE) {
        obs->endoscope.camera = camera();
        fill_color(&obs->endoscope.color, &rng);
    }
    if (!(what & OM_OBSERVE_DEPTH)) return OM_OK;
    obs->rgbd.time = w->plain.time - 0.01;
    obs->rgbd.camera = camera();
    fill_depth(w, &obs->rgbd, &rng);
    if (what & OM_OBSERVE_COLOR) fill_color(&obs->rgbd.color, &rng);
    return OM_OK;
}

static void picture_world_init(PictureWorld* w) {
    static const OmWorldOps ops = {.destroy = plain_destroy,
                                   .move = plain_move,
                                   .set_jaw = plain_set_jaw,
                                   .stop = plain_stop,
                                   .advance = picture_advance,
                                   .observe = picture_observe};
    OmSite site = {.pose_world_task = om_pose_identity(), .half_size = om_vec3(0.06, 0.06, 0.0025)};
    memset(w, 0, sizeof *w);
    w->bad_at = -1;
    plain_world_init(&w->plain, &site, 2);
    w->psm = om_psm_default(OM_PROGRASP, (OmPose){om_vec3(0.1, 0, 0.2), om_quat_identity()});
    w->plain.head.ops = &ops;
    w->plain.head.sources |= OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR;
    w->plain.head.psm[1] = &w->psm;
}

// ---- a session --------------------------------------------------------------------------------------------

// Everything that an observation says; padding does not count.
static uint64_t hash_observation(const OmObservation* o) {
    uint64_t h = om_hash(&o->time, sizeof o->time, OM_HASH_SEED);
    h = om_hash(&o->visibility, sizeof o->visibility, h);
    for (int a = 0; a < o->narm; ++a) {
        const OmArmObservation* m = &o->arm[a];
        unsigned char flag[2] = {m->is_moving, m->has_wrench};
        h = om_hash(&m->time, sizeof m->time, h);
        h = om_hash(&m->tip, sizeof m->tip, h);
        h = om_hash(m->q, sizeof m->q, h);
        h = om_hash((double[3]){m->jaw, m->jaw_speed, m->jaw_goal}, 3 * sizeof(double), h);
        h = om_hash(flag, sizeof flag, h);
        h = om_hash(&m->force, sizeof m->force, h);
        h = om_hash(&m->torque, sizeof m->torque, h);
    }
    h = om_hash(&o->endoscope.time, sizeof o->endoscope.time, h);
    h = om_hash(&o->endoscope.camera, sizeof o->endoscope.camera, h);
    h = om_hash(&o->rgbd.time, sizeof o->rgbd.time, h);
    h = om_hash(&o->rgbd.camera, sizeof o->rgbd.camera, h);
    const size_t n = WIDTH * HEIGHT;
    if (o->endoscope.color.pixel) h = om_hash(o->endoscope.color.pixel, 3 * n, h);
    if (o->rgbd.depth) h = om_hash(o->rgbd.depth, n * sizeof(float), h);
    if (o->rgbd.color.pixel) h = om_hash(o->rgbd.color.pixel, 3 * n, h);
    return h;
}

// Commands of a session at a tick, by the same rule in every run.
static OmStatus act(OmWorld* world, int tick, uint64_t* hash) {
    OmPose goal = {om_vec3(0.001 * tick, -0.05, 0.05), om_quat_identity()};
    OmPose far_away = {om_vec3(1, 0, 0), om_quat_identity()};
    if (tick == 2) OM_TRY(om_world_move(world, 0, goal, 0.1));
    if (tick == 5) OM_TRY(om_world_set_jaw(world, 1, 0.25));
    if (tick == 9) om_world_stop(world, 0);
    if (tick != 12) return OM_OK;
    OmStatus status = om_world_move(world, 1, far_away, 0.1);  // refused
    *hash = om_hash(om_error_message(), strlen(om_error_message()), *hash);
    return status == OM_INVALID && strstr(om_error_message(), "cannot reach") ? OM_OK : OM_IO;
}

// The hash of all answers after each tick.  (ntick)
static OmStatus run_session(OmWorld* world, int ntick, uint64_t* hash) {
    uint64_t h = OM_HASH_SEED;
    for (int tick = 0; tick < ntick; ++tick) {
        OM_TRY(act(world, tick, &h));
        OM_TRY(om_world_advance(world, STEP));
        OmObservation obs = {0};
        unsigned what = tick % 5 == 0 ? OM_OBSERVE_VISIBILITY : 0;
        if (tick % 7 == 0) what |= OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR;
        if (tick % 11 == 0) what |= OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH;
        OM_TRY(om_world_observe(world, what, &obs));
        h = hash[tick] = hash_observation(&obs) ^ (h << 1 | h >> 63);
        om_observation_done(&obs);
    }
    return OM_OK;
}

static const char* log_path(void) {
    static char path[64];
    if (!path[0]) snprintf(path, sizeof path, "/tmp/omentum-test-log-%ld", (long)getpid());
    return path;
}

// A log of a whole session; the hashes of its answers.
static void record(uint64_t hash[NTICK]) {
    PictureWorld w;
    OmWorld* world;
    remove(log_path());
    picture_world_init(&w);
    assert_ok(om_world_create_recorded(&w.plain.head, log_path(), &world));
    assert_ok(run_session(world, NTICK, hash));
    assert_ok(om_world_log_end(world));
    assert_ok(om_world_log_end(world));
    assert_int_equal(om_world_advance(world, STEP), OM_INVALID);
    om_world_destroy(world);
}

// ---- tests ------------------------------------------------------------------------------------------------

static void test_a_replay_gives_the_same_answers(void** state) {
    (void)state;
    uint64_t hash[NTICK], again[NTICK];
    OmWorld* world;
    OmWorldLogInfo info;
    record(hash);
    assert_ok(om_world_create_replayed(log_path(), &world));
    assert_int_equal(om_world_narm(world), 2);
    assert_int_equal(om_world_sources(world), 15);
    assert_null(om_world_psm(world, 0));
    OmPsm psm = om_psm_default(OM_PROGRASP, (OmPose){om_vec3(0.1, 0, 0.2), om_quat_identity()});
    assert_memory_equal(om_world_psm(world, 1), &psm, sizeof psm);
    assert_null(om_world_truth(world));
    assert_int_equal(om_world_state_size(world), 0);
    assert_ok(run_session(world, NTICK, again));
    assert_memory_equal(hash, again, sizeof hash);
    // the log is at its end
    assert_status(om_world_advance(world, STEP), OM_IO);
    assert_non_null(strstr(om_error_message(), "Log: end. Now: advance by 0.02 s"));
    om_world_destroy(world);
    assert_ok(om_world_log_check(log_path(), &info));
    assert_true(info.is_complete);
    assert_int_equal(info.nadvance, NTICK);
    assert_int_equal(info.nobserve, NTICK);
    // depth and colour at ticks 0, 7, .., 35; endoscope and depth at 0, 11, 22, 33, of which 0 has its depth already
    assert_int_equal(info.npicture, 2 * 6 + 2 * 4 - 1);
    assert_near(info.time, NTICK * STEP, 1e-12);
}

// A number of the instrument that the log leaves out would be noticed.
static void test_an_instrument_of_rows_is_kept(void** state) {
    (void)state;
    PictureWorld w;
    OmWorld* world;
    remove(log_path());
    picture_world_init(&w);
    w.psm.njoint = 5;
    w.psm.has_jaw = false;
    w.psm.jaw_min = w.psm.jaw_max = 0;
    w.psm.has_rows = true;
    for (int k = 0; k < 3; ++k) w.psm.row[k] = (OmPsmRow){0.1 + k, 0.2 + k, 0.3 + k, 0.4 + k};
    w.psm.pose_last_tip = (OmPose){om_vec3(1, 2, 3), om_quat_axis_angle(om_vec3(0, 0, 1), 1)};
    assert_ok(om_world_create_recorded(&w.plain.head, log_path(), &world));
    OmObservation obs = {0};
    assert_ok(om_world_observe(world, 0, &obs));
    om_observation_done(&obs);
    om_world_destroy(world);
    assert_ok(om_world_create_replayed(log_path(), &world));
    assert_memory_equal(om_world_psm(world, 1), &w.psm, sizeof w.psm);
    om_world_destroy(world);
}

static void test_depth_is_rounded_before_it_is_used(void** state) {
    (void)state;
    PictureWorld w;
    OmWorld* world;
    remove(log_path());
    picture_world_init(&w);
    assert_ok(om_world_create_recorded(&w.plain.head, log_path(), &world));
    OmObservation obs = {0};
    assert_ok(om_world_observe(world, OM_OBSERVE_DEPTH, &obs));
    for (int i = 0; i < WIDTH * HEIGHT; ++i) {
        double depth = (double)obs.rgbd.depth[i], count = depth / 1e-4;
        bool has_none = i == 3 || i == 7 || i == 9 || i == 11 || w.raw[i] >= 6.55355;
        // half a count, and the rounding of a float at 6 m
        assert_near(depth, has_none ? 0 : w.raw[i], 0.5e-4 + 1e-6);
        assert_near(count, round(count), 0.01);
    }
    om_observation_done(&obs);
    om_world_destroy(world);
}

static void expect_departure(OmStatus status, const char* part) {
    assert_int_equal(status, OM_IO);
    if (!strstr(om_error_message(), part)) fail_msg("%s: no \"%s\"", om_error_message(), part);
}

static void test_another_call_is_named(void** state) {
    (void)state;
    uint64_t hash[NTICK];
    OmWorld* world;
    record(hash);
    OmPose goal = {om_vec3(0.002, -0.05, 0.05), om_quat_identity()};
    for (int k = 0; k < 7; ++k) {
        assert_ok(om_world_create_replayed(log_path(), &world));
        assert_ok(run_session(world, 2, hash));
        OmPose near = goal;
        near.p.x = nextafter(goal.p.x, 1);
        OmObservation obs = {0};
        switch (k) {
        case 0: expect_departure(om_world_move(world, 1, goal, 0.1), "tick 2 (0.04 s)"); break;
        case 1: expect_departure(om_world_move(world, 0, near, 0.1), "Log: move arm 0"); break;
        case 2:
            expect_departure(om_world_move(world, 0, goal, 0.2), "at 0.1 m/s. Now: move");
            break;
        case 3:
            expect_departure(om_world_set_jaw(world, 0, OM_PI / 6),
                             "Now: jaw of arm 0 to 30 degrees");
            break;
        case 4: expect_departure(om_world_advance(world, STEP), "Now: advance by 0.02 s"); break;
        case 5:
            expect_departure(om_world_observe(world, OM_OBSERVE_DEPTH, &obs), "flags 0x4");
            break;
        case 6:  // a stop returns nothing: the next call does
            om_world_stop(world, 1);
            expect_departure(om_world_move(world, 0, goal, 0.1), "Now: stop arm 1");
            break;
        }
        // once it has departed, it stays so
        assert_status(om_world_move(world, 0, goal, 0.1), OM_IO);
        om_world_destroy(world);
    }
}

static void write_bytes(const char* data, size_t size) {
    FILE* file = fopen(log_path(), "wb");
    assert_non_null(file);
    assert_true(size == 0 || fwrite(data, 1, size, file) == size);
    fclose(file);
}

static void test_a_damaged_log_is_never_whole(void** state) {
    (void)state;
    uint64_t hash[NTICK];
    OmWorldLogInfo info;
    char* data;
    size_t size;
    record(hash);
    assert_ok(om_file_read(log_path(), 1 << 24, &data, &size));
    for (size_t cut = 0; cut < size; cut += 1 + cut / 60) {
        write_bytes(data, cut);
        OmStatus status = om_world_log_check(log_path(), &info);
        assert_true(status == OM_INVALID || (status == OM_OK && !info.is_complete));
    }
    for (size_t i = 0; i < size; i += 1 + i / 60) {
        data[i] ^= 4;
        write_bytes(data, size);
        OmStatus status = om_world_log_check(log_path(), &info);
        if (status == OM_OK && info.is_complete) fail_msg("byte %zu changed: not noticed", i);
        data[i] ^= 4;
    }
    om_free(data);
}

// Each record is good, but one of them is missing, or two have changed places.
static void test_a_log_without_a_record_is_damaged(void** state) {
    (void)state;
    uint64_t hash[NTICK];
    OmWorldLogInfo info;
    char* data;
    size_t size, at[4] = {20};  // behind the file's first line
    record(hash);
    assert_ok(om_file_read(log_path(), 1 << 24, &data, &size));
    for (int k = 0; k < 3; ++k) {
        LogRecordHead head;
        memcpy(&head, data + at[k], sizeof head);
        at[k + 1] = at[k] + sizeof head + head.size;
    }
    char* changed = malloc(size);
    const size_t n1 = at[2] - at[1], n2 = at[3] - at[2];
    memcpy(changed, data, at[1]);
    memcpy(changed + at[1], data + at[2], size - at[2]);
    write_bytes(changed, size - n1);
    assert_status(om_world_log_check(log_path(), &info), OM_INVALID);
    memcpy(changed, data, size);
    memcpy(changed + at[1], data + at[2], n2);
    memcpy(changed + at[1] + n2, data + at[1], n1);
    write_bytes(changed, size);
    assert_status(om_world_log_check(log_path(), &info), OM_INVALID);
    free(changed);
    om_free(data);
}

static void test_a_cut_log_is_played_up_to_the_cut(void** state) {
    (void)state;
    uint64_t hash[NTICK], again[NTICK] = {0};
    OmWorld* world;
    char* data;
    size_t size;
    record(hash);
    assert_ok(om_file_read(log_path(), 1 << 24, &data, &size));
    write_bytes(data, size / 2);
    om_free(data);
    OmWorldLogInfo info;
    assert_ok(om_world_log_check(log_path(), &info));
    assert_false(info.is_complete);
    assert_true(info.nobserve > 5 && info.nobserve < NTICK - 5);
    assert_ok(om_world_create_replayed(log_path(), &world));
    assert_status(run_session(world, NTICK, again), OM_IO);
    assert_non_null(strstr(om_error_message(), "cut off at tick"));
    assert_memory_equal(hash, again, (size_t)info.nobserve * sizeof *hash);
    assert_true(again[info.nobserve] == 0);
    om_world_destroy(world);
}

static void test_a_killed_run_leaves_its_observations(void** state) {
    (void)state;
    uint64_t hash[NTICK];
    OmWorldLogInfo info;
    remove(log_path());
    pid_t child = fork();
    if (child == 0) {
        PictureWorld w;
        OmWorld* world;
        picture_world_init(&w);
        OmPose goal = {om_vec3(0, 0, 0.05), om_quat_identity()};
        bool is_good = om_world_create_recorded(&w.plain.head, log_path(), &world) == OM_OK &&
                       run_session(world, 20, hash) == OM_OK &&
                       om_world_move(world, 0, goal, 0.1) == OM_OK;
        if (is_good) kill(getpid(), SIGKILL);
        _exit(1);
    }
    int how;
    assert_true(waitpid(child, &how, 0) == child && WIFSIGNALED(how));
    assert_ok(om_world_log_check(log_path(), &info));
    assert_int_equal(info.nobserve, 20);
    assert_false(info.is_complete);
}

static void test_bad_values_and_files_are_refused(void** state) {
    (void)state;
    PictureWorld w;
    OmWorld* world;
    uint64_t hash[NTICK];
    remove(log_path());
    picture_world_init(&w);
    w.bad_at = 3;
    assert_ok(om_world_create_recorded(&w.plain.head, log_path(), &world));
    assert_status(run_session(world, NTICK, hash), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "not finite"));
    om_world_destroy(world);
    assert_status(om_world_create_recorded(&w.plain.head, log_path(), &world), OM_IO);
    assert_non_null(strstr(om_error_message(), "exists already"));
    assert_null(world);
    assert_status(om_world_create_recorded(&w.plain.head, "/nowhere/log", &world), OM_IO);
    assert_status(om_world_create_replayed("/nowhere/log", &world), OM_IO);
    write_bytes("omentum world log 2\n", 20);
    assert_status(om_world_create_replayed(log_path(), &world), OM_INVALID);
    assert_status(om_world_log_end(&w.plain.head), OM_INVALID);
}

static void test_a_full_disk_is_an_error(void** state) {
    (void)state;
    PictureWorld w;
    OmWorld* world;
    uint64_t hash[NTICK];
    struct rlimit was, limit;
    remove(log_path());
    picture_world_init(&w);
    assert_ok(om_world_create_recorded(&w.plain.head, log_path(), &world));
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &was), 0);
    limit = was;
    limit.rlim_cur = 4000;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    OmStatus status = run_session(world, NTICK, hash);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &was), 0);
    assert_int_equal(status, OM_IO);
    assert_non_null(strstr(om_error_message(), "cannot be written"));
    assert_status(om_world_advance(world, STEP), OM_IO);
    om_world_destroy(world);
}

// Record two ticks, and read them again. A plain world allocates nothing.
static OmStatus record_and_replay(void* ctx) {
    PictureWorld* w = ctx;
    OmWorld* world;
    remove(log_path());
    OmObservation obs = {0};
    OM_TRY(om_world_create_recorded(&w->plain.head, log_path(), &world));
    OmStatus status = om_world_advance(world, STEP);
    if (status >= 0) status = om_world_observe(world, OM_OBSERVE_VISIBILITY, &obs);
    if (status >= 0) status = om_world_log_end(world);
    om_world_destroy(world);
    OM_TRY(status);
    OM_TRY(om_world_create_replayed(log_path(), &world));
    status = om_world_advance(world, STEP);
    if (status >= 0) status = om_world_observe(world, OM_OBSERVE_VISIBILITY, &obs);
    om_world_destroy(world);
    return status;
}

static OmStatus replay_pictures(void* ctx) {
    OmWorld* world;
    uint64_t hash[2];
    (void)ctx;
    OM_TRY(om_world_create_replayed(log_path(), &world));
    OmStatus status = run_session(world, 2, hash);
    om_world_destroy(world);
    return status;
}

static void test_every_failing_allocation_returns(void** state) {
    (void)state;
    PictureWorld w;
    uint64_t hash[NTICK];
    picture_world_init(&w);
    assert_true(test_failing_allocations(record_and_replay, &w, 1) >= 4);
    record(hash);
    assert_true(test_failing_allocations(replay_pictures, NULL, 1) >= 6);
}

static int finish(void** state) {
    (void)state;
    remove(log_path());
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_replay_gives_the_same_answers),
        cmocka_unit_test(test_an_instrument_of_rows_is_kept),
        cmocka_unit_test(test_depth_is_rounded_before_it_is_used),
        cmocka_unit_test(test_another_call_is_named),
        cmocka_unit_test(test_a_damaged_log_is_never_whole),
        cmocka_unit_test(test_a_log_without_a_record_is_damaged),
        cmocka_unit_test(test_a_cut_log_is_played_up_to_the_cut),
        cmocka_unit_test(test_a_killed_run_leaves_its_observations),
        cmocka_unit_test(test_bad_values_and_files_are_refused),
        cmocka_unit_test(test_a_full_disk_is_an_error),
        cmocka_unit_test(test_every_failing_allocation_returns),
    };
    return cmocka_run_group_tests(tests, NULL, finish);
}
