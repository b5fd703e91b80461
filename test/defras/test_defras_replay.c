// test_defras_replay.c: a run recorded, decided again from its observations, and compared.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test_alloc.h"

#include "loop_rig.h"

#include "omentum/defras_audit.h"
#include "omentum/defras_replay.h"
#include "omentum/world_log.h"
#include "world/world_log_file.h"

static char root[64];  // folder of all files of this test

static const char* path_of(const char* dir, const char* name) {
    static char path[4][256];
    static int turn;
    char* out = path[turn++ % 4];
    snprintf(out, sizeof path[0], "%s/%s%s%s", root, dir, name[0] ? "/" : "", name);
    return out;
}

// The truth is attached on the far half; the twin believes in no attachment.
static OmScene update_scene(void) {
    OmScene scene = object_scene();
    scene.believed.kind = OM_BELIEF_NONE;
    scene.update.is_enabled = true;
    scene.rgbd.width = 96, scene.rgbd.height = 72;
    scene.task.max_actions = 8;
    return scene;
}

static void record_run(const OmScene* scene, const char* dir) {
    OmRetractDef def = om_retract_default_def(scene);
    OmRetractResult result;
    def.out_dir = path_of(dir, "");
    def.frame_every = 0;
    def.nworker = 1;
    def.records_observations = true;
    om_path_remove(def.out_dir);
    assert_ok(om_retract_run(&def, NULL, &result));
    om_retract_result_done(&result);
}

static OmStatus replay_run(const char* dir, int nworker, OmReplayResult* result) {
    OmReplayDef def = om_replay_default_def(path_of(dir, ""));
    def.nworker = nworker;
    return om_retract_replay(&def, NULL, result);
}

static char* read_text(const char* path) {
    char* text;
    size_t size;
    assert_ok(om_file_read(path, 1 << 28, &text, &size));
    return text;
}

// ---- the same decisions -------------------------------------------------------------------------------------

static void test_the_same_decisions_from_the_observations(void** state) {
    (void)state;
    OmScene scene = update_scene();
    OmReplayResult r;
    record_run(&scene, "run");
    assert_false(om_path_exists(path_of("run-unfinished", "")));
    char* audit = read_text(path_of("run", "audit.jsonl"));
    assert_non_null(strstr(audit, "\"stage\": \"started\""));
    for (int nworker = 1; nworker <= 2; ++nworker) {
        OmReplayDef def = om_replay_default_def(path_of("run", ""));
        def.nworker = nworker;
        def.path = path_of("", "again.jsonl");
        assert_ok(om_retract_replay(&def, NULL, &r));
        if (!r.is_same) fail_msg("%s\n%s\n%s", r.reason, r.was, r.now);
        assert_int_equal(r.line, 0);
        assert_true(r.nline > 10 && r.ndecision >= 1 && r.time > 1);
        om_replay_result_done(&r);
        char* again = read_text(path_of("", "again.jsonl"));
        assert_string_equal(audit, again);
        om_free(again);
    }
    om_free(audit);
}

// The file of the run with a part of it changed. Needs the run of the first test.
static void write_changed(const char* name, const char* from, const char* to) {
    char* text = read_text(path_of("run", name));
    size_t at = 0;
    while (text[at] && strncmp(text + at, from, strlen(from)) != 0) ++at;
    assert_true(text[at] != '\0');
    OmText out = {0};
    assert_ok(om_text_append_raw(&out, text, at));
    assert_ok(om_text_append(&out, "%s%s", to, text + at + strlen(from)));
    assert_ok(om_file_write(path_of("changed", name), out.str, out.len));
    om_text_done(&out);
    om_free(text);
}

static void copy_file(const char* name) { write_changed(name, "", ""); }

// A log is no text. One tip of one observation moves by `shift` m: that of the look'th one.
static void copy_log(int look, double shift) {
    LogReader reader;
    LogWriter writer;
    LogCall call = {.kind = LOG_HEAD};
    int nlook = 0;
    om_path_remove(path_of("changed", "observations.log"));
    assert_ok(om__log_open(path_of("run", "observations.log"), &reader));
    assert_ok(om__log_begin(path_of("changed", "observations.log"), &reader.head, &writer));
    while (call.kind != LOG_END) {
        assert_ok(om__log_read(&reader, &call));
        if (call.kind == LOG_OBSERVE && nlook++ == look) call.observation.arm[0].tip.p.z += shift;
        if (call.kind != LOG_END) assert_ok(om__log_write(&writer, &call));
    }
    assert_ok(om__log_end(&writer));
    om__log_writer_done(&writer);
    om__log_close(&reader);
}

static void test_a_difference_is_named(void** state) {
    (void)state;
    OmReplayResult r;
    assert_ok(om_path_make_dir(path_of("changed", "")));
    copy_file("scene.yaml");
    copy_log(-1, 0);
    // a decision of the run that is not the replay's: the second line is the first plan
    write_changed("audit.jsonl", "\"optimal\": true", "\"optimal\": false");
    assert_ok(replay_run("changed", 1, &r));
    assert_false(r.is_same);
    assert_int_equal(r.line, 2);
    assert_non_null(strstr(r.was, "\"optimal\": false"));
    assert_non_null(strstr(r.now, "\"optimal\": true"));
    assert_non_null(strstr(r.reason, "line 2"));
    om_replay_result_done(&r);
    // another scene, though nothing else of it changed: the head has its hash
    copy_file("audit.jsonl");
    write_changed("scene.yaml", "name: ", "name: x");
    assert_ok(replay_run("changed", 1, &r));
    assert_int_equal(r.line, 1);
    om_replay_result_done(&r);
    // one observation, moved by 0.1 mm while the arm holds tissue: the twin follows it
    copy_file("scene.yaml");
    OmWorldLogInfo info;
    assert_ok(om_world_log_check(path_of("run", "observations.log"), &info));
    copy_log(info.nobserve - info.nobserve / 8, 1e-4);
    assert_ok(replay_run("changed", 1, &r));
    assert_false(r.is_same);
    assert_true(r.line > 2);
    assert_non_null(strstr(r.was, "\"twin\": "));
    assert_string_not_equal(r.was, r.now);
    om_replay_result_done(&r);
}

static void test_folders_without_a_record_are_refused(void** state) {
    (void)state;
    OmReplayResult r;
    assert_status(replay_run("nowhere", 1, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "--record"));
    copy_log(-1, 0);
    write_changed("audit.jsonl", "{\"event\": \"head\"", "{\"event\": \"plan\"");
    assert_status(replay_run("changed", 1, &r), OM_INVALID);
    write_changed("audit.jsonl", "\"format\": 1", "\"format\": 2");
    assert_status(replay_run("changed", 1, &r), OM_INVALID);
    write_changed("audit.jsonl", "\"event\": \"begin\"", "\"hold\": \"late\"");
    assert_status(replay_run("changed", 1, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "real time"));
    assert_null(r.was);
}

// ---- commands of a person ---------------------------------------------------------------------------------------

static void command(OmLoop* loop, OmLoopCommandKind kind, int block, double value) {
    assert_ok(om_loop_command(loop, &(OmLoopCommand){kind, block, value}));
}

// A person slows down, pauses, forbids the point that is planned, resumes and demands a new plan.
static void disturb(OmLoop* loop) {
    const int tick = om_loop_ntick(loop);
    if (tick == 3) command(loop, OM_LOOP_SLOW, 0, 0.7);
    if (tick == 40) command(loop, OM_LOOP_PAUSE, 0, 0);
    if (tick == 60) command(loop, OM_LOOP_RESUME, 0, 0);
    if (tick == 70) command(loop, OM_LOOP_FORBID, om_loop_plan(loop)->grasp_block, 0);
    if (tick == 70) command(loop, OM_LOOP_SLOW, 0, 1);
    if (tick == 90) command(loop, OM_LOOP_REPLAN, 0, 0);
}

static void test_commands_of_a_person_are_given_again(void** state) {
    (void)state;
    Rig g;
    OmText text = {0};
    OmWorld* world;
    OmAudit* audit;
    OmLoop* loop;
    OmReplayResult r;
    rig_create(&g, object_scene());
    assert_ok(om_path_make_dir(path_of("person", "")));
    assert_ok(om_scene_print(&g.scene, false, &text));
    assert_ok(om_file_write(path_of("person", "scene.yaml"), text.str, text.len));
    assert_ok(om_world_create_recorded(g.world, path_of("person", "observations.log"), &world));
    OmAuditDef def = om_audit_default_def(g.planner);
    def.path = path_of("person", "audit.jsonl");
    def.scene_text = text.str;
    assert_ok(om_audit_create(&def, &audit));
    OmLoopListener listener = om_audit_listener(audit);
    OmLoopDef loop_def = om_loop_default_def(&g.scene.task, world, g.twin, g.planner);
    loop_def.listener = &listener;
    loop_def.nlistener = 1;
    loop_def.is_attended = true;
    assert_ok(om_loop_create(&loop_def, &loop));
    while (om_loop_phase(loop) != OM_LOOP_ENDED) {
        assert_ok(om_loop_tick(loop));
        if (om_loop_phase(loop) != OM_LOOP_ENDED) disturb(loop);
    }
    assert_ok(om_world_log_end(world));
    om_loop_destroy(loop);
    assert_non_null(strstr(om_audit_text(audit), "\"command\": \"plan\""));
    assert_ok(replay_run("person", 1, &r));
    if (!r.is_same) fail_msg("%s\n%s\n%s", r.reason, r.was, r.now);
    om_replay_result_done(&r);
    om_audit_destroy(audit);
    om_world_destroy(world);
    om_text_done(&text);
    rig_destroy(&g);
}

// ---- a killed run -----------------------------------------------------------------------------------------------

static bool kill_at(void* ctx, const char* stage, double done, double total) {
    (void)ctx, (void)total;
    if (strcmp(stage, "retracting") == 0 && done >= 2) kill(getpid(), SIGKILL);
    return true;
}

// A killed run leaves its audit and its observations; their decisions are the same up to the kill.
static void test_a_killed_run_can_be_replayed(void** state) {
    (void)state;
    OmReplayResult r;
    pid_t child = fork();
    if (child == 0) {
        OmScene scene = object_scene();
        OmRetractDef def = om_retract_default_def(&scene);
        OmRetractResult result;
        const OmProgress progress = {kill_at, NULL};
        def.out_dir = path_of("killed", "");
        def.nworker = 1;
        def.records_observations = true;
        om_retract_run(&def, &progress, &result);
        _exit(1);
    }
    int how;
    assert_true(waitpid(child, &how, 0) == child && WIFSIGNALED(how));
    assert_false(om_path_exists(path_of("killed", "")));
    char* audit = read_text(path_of("killed-unfinished", "audit.jsonl"));
    assert_string_equal(audit + strlen(audit) - 3, "\"}\n");  // a whole line
    om_free(audit);
    assert_ok(replay_run("killed-unfinished", 1, &r));
    assert_false(r.is_same);
    assert_int_equal(r.line, 0);
    assert_non_null(strstr(r.reason, "cut off at tick"));
    assert_true(r.nline >= 5);
    om_replay_result_done(&r);
    // a later run of the same name leaves the remains of the killed one
    OmScene scene = object_scene();
    record_run(&scene, "killed");
    assert_true(om_path_exists(path_of("killed-unfinished", "audit.jsonl")));
    assert_false(om_path_exists(path_of("killed-unfinished-2", "")));
}

// A run that cannot begin leaves nothing.
static void test_a_run_that_fails_at_once_leaves_nothing(void** state) {
    (void)state;
    OmScene scene = object_scene();
    OmRetractDef def = om_retract_default_def(&scene);
    OmRetractResult result;
    def.out_dir = path_of("failed", "");
    def.records_observations = true;
    scene.task.max_actions = 0;  // the loop refuses it
    assert_status(om_retract_run(&def, NULL, &result), OM_INVALID);
    assert_false(om_path_exists(path_of("failed", "")));
    assert_false(om_path_exists(path_of("failed-unfinished", "")));
}

static int begin(void** state) {
    (void)state;
    snprintf(root, sizeof root, "/tmp/omentum-test-replay-%ld", (long)getpid());
    return om_path_make_dir(root) == OM_OK ? 0 : 1;
}

static int finish(void** state) {
    (void)state;
    return om_path_remove(root) == OM_OK ? 0 : 1;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_same_decisions_from_the_observations),
        cmocka_unit_test(test_a_difference_is_named),
        cmocka_unit_test(test_folders_without_a_record_are_refused),
        cmocka_unit_test(test_commands_of_a_person_are_given_again),
        cmocka_unit_test(test_a_killed_run_can_be_replayed),
        cmocka_unit_test(test_a_run_that_fails_at_once_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, begin, finish);
}
