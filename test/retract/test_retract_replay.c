// test_retract_replay.c: a run recorded, decided again from its observations, and compared.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test_alloc.h"

#include "loop_rig.h"

#include "omentum/record_audit.h"
#include "omentum/retract_replay.h"
#include "omentum/world_log.h"
#include "retract/retract_belief.h"
#include "retract/retract_journal.h"
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
    for (int nworker = test_is_slow() ? 1 : 2; nworker <= 2; ++nworker) {
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

static void copy_site(const char* from, const char* to) {
    char *data, path[256];
    size_t size;
    snprintf(path, sizeof path, "%s", path_of(to, "belief.h5"));
    assert_ok(om_file_read(path_of(from, "belief.h5"), 1 << 28, &data, &size));
    assert_ok(om_file_write(path, data, size));
    om_free(data);
}

static void test_a_difference_is_named(void** state) {
    (void)state;
    OmReplayResult r;
    assert_ok(om_path_make_dir(path_of("changed", "")));
    copy_file("belief.yaml");
    copy_site("run", "changed");
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
    // one decision more in the run
    char* text = read_text(path_of("run", "audit.jsonl"));
    OmText more = {0};
    assert_ok(om_text_append(&more, "%s{\"event\": \"plan\"}\n", text));
    assert_ok(om_file_write(path_of("changed", "audit.jsonl"), more.str, more.len));
    assert_ok(replay_run("changed", 1, &r));
    assert_int_equal(r.line, r.nline);
    assert_string_equal(r.was, "{\"event\": \"plan\"}");
    assert_string_equal(r.now, "");
    om_replay_result_done(&r);
    om_text_done(&more);
    om_free(text);
    // another scene, though nothing else of it changed: the head has its hash
    copy_file("audit.jsonl");
    write_changed("belief.yaml", "name: ", "name: x");
    assert_ok(replay_run("changed", 1, &r));
    assert_int_equal(r.line, 1);
    om_replay_result_done(&r);
    // one observation, moved by 0.1 mm while the arm holds tissue: the twin follows it
    copy_file("belief.yaml");
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

// ---- files that were changed since ---------------------------------------------------------------------------

static OmStatus check_seal(void* ctx) {
    bool is_stated;
    return om__seal_check(ctx, &is_stated);
}

static OmStatus save_seal(void* ctx) { return om__seal_save(ctx); }

// The run of a scene names each file that differs from the record; without the record's hashes there is a note.
static void test_a_changed_file_is_named_and_memory(void** state) {
    (void)state;
    static const char* const name[] = {"scene.yaml", "belief.yaml", "program.lp", "plan.json"};
    OmReplayResult r;
    OmScene scene = object_scene();
    scene.task.max_actions = 2;
    record_run(&scene, "sealed");
    char dir[256], path[256], *text;
    snprintf(dir, sizeof dir, "%s", path_of("sealed", ""));
    for (int k = 0; k < 4; ++k) {
        snprintf(path, sizeof path, "%s", path_of("sealed", name[k]));
        // a program and a plan that the run did not have would decide otherwise, too
        OmText changed = {0};
        text = k < 2 ? read_text(path) : NULL;
        assert_ok(om_text_append(&changed, "%s ", k < 2 ? text : ""));
        assert_ok(om_file_write(path, changed.str, changed.len));
        assert_status(replay_run("sealed", 1, &r), OM_INVALID);
        assert_non_null(strstr(om_error_message(), name[k]));
        assert_non_null(strstr(om_error_message(), "changed since the run was recorded"));
        assert_non_null(strstr(om_error_message(), "omentum retract"));
        if (text)
            assert_ok(om_file_write(path, text, strlen(text)));
        else
            assert_int_equal(remove(path), 0);
        om_text_done(&changed);
        om_free(text);
    }
    // the hash in the file is that of the bytes
    char hash[64];
    text = read_text(path_of("sealed", "scene.yaml"));
    snprintf(hash, sizeof hash, "\"scene.yaml\": \"%016llx\"",
             (unsigned long long)om_hash(text, strlen(text), OM_HASH_SEED));
    om_free(text);
    text = read_text(path_of("sealed", "hashes.json"));
    assert_non_null(strstr(text, hash));
    om_free(text);
    assert_ok(replay_run("sealed", 1, &r));
    assert_true(r.is_same && !r.note[0]);
    om_replay_result_done(&r);
    assert_true(test_failing_allocations(check_seal, dir, 1) >= 3);
    assert_true(test_failing_allocations(save_seal, dir, 1) >= 3);
    assert_ok(check_seal(dir));
    // a record of an older version
    assert_int_equal(remove(path_of("sealed", "hashes.json")), 0);
    assert_ok(replay_run("sealed", 1, &r));
    assert_true(r.is_same);
    assert_non_null(strstr(r.note, "scene.yaml was changed since is not known"));
    om_replay_result_done(&r);
}

// ---- the belief -------------------------------------------------------------------------------------------------

// Two scenes with one belief and two truths: what is written of the belief is the same.
static void test_the_belief_holds_no_truth(void** state) {
    (void)state;
    OmScene a = update_scene(), b = a;
    b.seed = 77;
    b.attach.lo.x = 0.03;
    b.believed.kind = OM_BELIEF_BOX, b.believed.lo = om_vec3(1, 1, 1),
    b.believed.hi = b.believed.lo;
    b.roi.margin = 0.001;
    b.world.young_factor = 0.5, b.world.tool_noise = 0, b.world.law = OM_NEO_HOOKEAN;
    b.tissue.world_cells = om_vec3(12, 12, 1);
    OmText ta = {0}, tb = {0};
    assert_ok(om__scene_print_whole(&a, false, NULL, &ta));
    assert_ok(om__scene_print_whole(&b, false, NULL, &tb));
    assert_string_equal(ta.str, tb.str);
    om_text_done(&tb);
    b.task.max_height = 0.04;  // known to the robot
    assert_ok(om__scene_print_whole(&b, false, NULL, &tb));
    assert_string_not_equal(ta.str, tb.str);
    om_text_done(&ta);
    om_text_done(&tb);
    // data beside the record: the folder that holds both may be moved
    strcpy(b.data_root, "/usr");
    static const char* const out_dir[] = {"/usr/run", "/usr/lib/run", "/run", NULL};
    for (int k = 0; k < 4; ++k) {
        tb = (OmText){0};
        assert_ok(om__scene_print_whole(&b, false, out_dir[k], &tb));
        assert_int_equal(strstr(tb.str, "data_root: \"..\"") != NULL, k == 0);
        assert_int_equal(strstr(tb.str, "data_root: \"/usr\"") != NULL, k > 0);
        om_text_done(&tb);
    }
    // the complete scene is not read
    OmReplayResult r;
    record_run(&a, "blind");
    assert_int_equal(remove(path_of("blind", "scene.yaml")), 0);
    assert_ok(replay_run("blind", 1, &r));
    assert_true(r.is_same);
    om_replay_result_done(&r);
}

static void expect_same_array(const void* a, const void* b, size_t size) {
    assert_int_equal(a != NULL, b != NULL);
    if (a) assert_memory_equal(a, b, size);
}

static OmStatus load_site(void* ctx) {
    OmSite site;
    OM_TRY(om__belief_load(ctx, &site));
    om_site_done(&site);
    return OM_OK;
}

static void test_a_site_is_read_as_it_was_written_and_memory(void** state) {
    (void)state;
    OmScene scene = object_scene();
    OmSite a, b;
    char path[256];
    snprintf(path, sizeof path, "%s", path_of("", "site.h5"));
    scene.attach.foundation = 1e5;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &a));
    // an organ and a material, as a patient has them
    assert_ok(om_surface_init(&a.organ, 4, 2));
    for (int i = 0; i < 12; ++i) a.organ.x[i] = 0.1 * i;
    for (int i = 0; i < 6; ++i) a.organ.tri_vert[i] = i % 4;
    a.has_organ = true;
    a.organ_sdf.grid = (OmGrid){{2, 3, 2}, 0.01, om_vec3(1, 2, 3)};
    a.organ_sdf.d = om_calloc(12, sizeof *a.organ_sdf.d);
    a.organ_sdf.d[7] = -0.5F;
    a.nmaterial = 1;
    a.material[0] = (OmSiteMaterial){"fat", 1000, 0.4, 900};
    assert_ok(om__belief_save(&a, path));
    assert_ok(om__belief_load(path, &b));
    assert_memory_equal(a.organ.x, b.organ.x, 12 * sizeof(double));
    assert_memory_equal(a.organ.tri_vert, b.organ.tri_vert, 6 * sizeof(int));
    assert_memory_equal(&a.organ_sdf.grid, &b.organ_sdf.grid, sizeof a.organ_sdf.grid);
    assert_memory_equal(a.organ_sdf.d, b.organ_sdf.d, 12 * sizeof(float));
    assert_int_equal(b.nmaterial, 1);
    assert_memory_equal(&a.material[0], &b.material[0], sizeof a.material[0]);
    assert_int_equal(a.mesh.nvert, b.mesh.nvert);
    assert_int_equal(a.mesh.nset, b.mesh.nset);
    assert_memory_equal(a.mesh.x, b.mesh.x, 24 * (size_t)a.mesh.nvert);
    assert_memory_equal(a.mesh.tet_vert, b.mesh.tet_vert, 16 * (size_t)a.mesh.ntet);
    assert_memory_equal(a.mesh.tet_label, b.mesh.tet_label, 4 * (size_t)a.mesh.ntet);
    for (int i = 0; i < a.mesh.nset; ++i) {
        const OmMeshSet *p = &a.mesh.set[i], *q = &b.mesh.set[i];
        assert_string_equal(p->name, q->name);
        assert_int_equal(p->nvert, q->nvert);
        expect_same_array(p->vert, q->vert, 4 * (size_t)p->nvert);
    }
    const size_t nheld = (size_t)om_tet_mesh_find_set(&a.mesh, "attachment")->nvert;
    assert_true(nheld > 0 && a.attach_spring);
    expect_same_array(a.attach_area, b.attach_area, 8 * nheld);
    expect_same_array(a.attach_spring, b.attach_spring, 8 * nheld);
    expect_same_array(a.roi_x, b.roi_x, 24 * (size_t)a.nroi);
    expect_same_array(a.roi_n, b.roi_n, 24 * (size_t)a.nroi);
    assert_memory_equal(&a.pose_world_task, &b.pose_world_task, sizeof a.pose_world_task);
    assert_memory_equal(&a.pose_world_field, &b.pose_world_field, sizeof a.pose_world_field);
    assert_memory_equal(&a.half_size, &b.half_size, sizeof a.half_size);
    assert_memory_equal(&a.roi_center, &b.roi_center, sizeof a.roi_center);
    assert_memory_equal(&a.gravity, &b.gravity, sizeof a.gravity);
    const double na[] = {a.attach_stiffness, a.attach_foundation, a.young, a.density, a.poisson};
    const double nb[] = {b.attach_stiffness, b.attach_foundation, b.young, b.density, b.poisson};
    assert_memory_equal(na, nb, sizeof na);
    assert_int_equal(a.has_ground, b.has_ground);
    assert_int_equal(a.has_organ, b.has_organ);
    om_site_done(&b);
    assert_true(test_failing_allocations(load_site, path, 1) >= 8);
    // an index that no vertex has
    a.mesh.tet_vert[5] = a.mesh.nvert;
    assert_status(om__belief_save(&a, path), OM_INVALID);
    om_site_done(&a);
    const char* other = path_of("other.jsonl", "");
    const char lines[] = "{\"tick\": 1}\n{\"tick\": 2}\n";  // as an audit has them
    assert_ok(om_file_write(other, lines, sizeof lines - 1));
    assert_status(om__belief_load(other, &b), OM_INVALID);
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
    assert_ok(om__scene_print_whole(&g.scene, false, NULL, &text));
    assert_ok(om_file_write(path_of("person", "belief.yaml"), text.str, text.len));
    assert_ok(om__belief_save(&g.twin_site, path_of("person", "belief.h5")));
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
    // two parts: the second case of the first one needs the run of its first
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_same_decisions_from_the_observations),
        cmocka_unit_test(test_the_belief_holds_no_truth),
        cmocka_unit_test(test_a_difference_is_named),
        cmocka_unit_test(test_commands_of_a_person_are_given_again),
        cmocka_unit_test(test_folders_without_a_record_are_refused),
        cmocka_unit_test(test_a_killed_run_can_be_replayed),
        cmocka_unit_test(test_a_site_is_read_as_it_was_written_and_memory),
        cmocka_unit_test(test_a_changed_file_is_named_and_memory),
        cmocka_unit_test(test_a_run_that_fails_at_once_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, begin, finish);
}
