// cli_rl_demo.c: omentum rl demo.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_rl.h"
#include "omentum/dds.h"
#include "omentum/rl_trace.h"

static const OmCliOption option[] = {
    OM_CLI_RL_TASK,
    {"--output", "-o", "FILE", "demonstrations, HDF5 as robomimic has it"},
    {"--number", "-n", "N", "demonstrations of the expert", "35", NULL, 1, 100000},
    {"--from", NULL, "FILE",
     "in place of the expert: follow the tip of a recorded robot, CSV with the columns time (s), x, y, z (m) "
     "and jaw (rad), or a recording of omentum dvrk or rosbag2 (.mcap); may be repeated"},
    {"--begin", NULL, "S",
     "leave out what was recorded in the first S seconds; once for each --from, in their order",
     "0", "s", 0, 1e9},
    {"--end", NULL, "S", "the same, what was recorded after S seconds", "all", "s", 1e-3, 1e9},
    {"--arm", NULL, "NAME", "arm of a recording", "PSM1"},
    {"--frames", NULL, "FILE",
     "omentum register: where the frame \"task\" is in the frame of the recorded poses",
     "the same"},
    {"--least-score", NULL, "X", "refuse a recorded robot whose path has a lower score",
     "the task's target", NULL, -1e9, 1e9},
    {"--deviation", NULL, "X", "refuse a path that the task's tip misses by more", "2", "mm", 0.01,
     100},
    {"--seed", NULL, "N", "seed of the starts and the expert's noise", "1", NULL, 0, 2147483647},
    {"--quiet", "-q", NULL, "no progress"},
};

static const OmCliKey result_key[] = {
    {"demonstrations", "number of demonstrations"},
    {"steps", "of all demonstrations"},
    {"score", "mean score"},
    {"deviation_mm", "of recorded robots: largest distance between a table's path and the tip's"},
};

// ---- recorded robots ----------------------------------------------------------------------------------

static bool is_recording(const char* path) {
    const size_t n = strlen(path);
    return n > 5 && strcmp(path + n - 5, ".mcap") == 0;
}

// The pose of the task in the frame of the recording.
static OmStatus find_task(const OmCliArgs* args, OmPose* pose) {
    OmDdsFrame frame[OM_DDS_MAX_FRAME];
    const char* path = om_cli_get(args, "--frames");
    int n = 0;
    *pose = om_pose_identity();
    if (!path) return OM_OK;
    OM_TRY(om_dds_frames_load(path, frame, &n));
    for (int i = 0; i < n; ++i)
        if (strcmp(frame[i].name, "task") == 0) {
            *pose = frame[i].pose_world_frame;
            return OM_OK;
        }
    return om_error(OM_INVALID,
                    "%s has no frame \"task\": make it by omentum register --frame task", path);
}

// The rows of a recording, in the frame of the task.
static OmStatus load_motion(const OmCliArgs* args, const char* path, OmRlTrace* t) {
    const char* arm = om_cli_get(args, "--arm");
    OmDdsMotion m = {0};
    OmPose task;
    OmStatus status;
    *t = (OmRlTrace){0};
    OM_TRY_DONE(find_task(args, &task));
    const OmPose back = om_pose_inverse(task);
    if (!arm) arm = "PSM1";
    OM_TRY_DONE(om_dds_motion_load(path, arm, &m));
    snprintf(t->name, sizeof t->name, "%s", path);
    snprintf(t->topic, sizeof t->topic, "/%.100s/measured_cp", arm);
    OM_ALLOC_DONE(t->time, m.n);
    OM_ALLOC_DONE(t->tip, 3 * (size_t)m.n);
    OM_ALLOC_DONE(t->jaw, m.n);
    OM_ALLOC_DONE(t->line, m.n);
    t->n = m.n;
    t->has_jaw = m.has_jaw;
    for (int i = 0; i < m.n; ++i) {
        t->time[i] = m.time[i];
        om_store3(t->tip, i, om_pose_apply(back, m.tip[i].p));
        t->jaw[i] = m.jaw[i];
        t->line[i] = m.message[i];
    }
    if (m.n < 2) status = om_error(OM_INVALID, "%s: a path needs at least two poses", path);
done:
    om_dds_motion_done(&m);
    if (status < 0) om_rl_trace_done(t);
    return status;
}

// The k-th use of a number of the table of options, which om_cli_check has read; else `value`.
static double nth_number(const OmCliArgs* args, const char* name, int k, double value) {
    const char* text = om_cli_get_nth(args, name, k);
    return text ? strtod(text, NULL) : value;
}

// The k-th table or recording, without what --begin and --end leave out.
static OmStatus load_trace(const OmCliArgs* args, int k, OmRlTrace* trace) {
    const char* path = om_cli_get_nth(args, "--from", k);
    const double begin = nth_number(args, "--begin", k, 0);
    OM_TRY(is_recording(path) ? load_motion(args, path, trace) : om_rl_trace_load(path, trace));
    const OmStatus status =
        om_rl_trace_cut(trace, begin, nth_number(args, "--end", k, (double)INFINITY));
    if (status < 0) om_rl_trace_done(trace);
    return status;
}

// Append one table. The episode must have the score that is wanted.
static OmStatus follow(const OmRlTrace* trace, double deviation, double least, const OmRlTask* task,
                       OmRlDrive* drive, OmRlFollow* f, OmRlDemos* demos) {
    OmText text = {0};
    double info[OM_RL_MAX_INFO] = {0};
    OM_TRY(om_rl_trace_follow(trace, deviation, drive, f));
    printf("%s: %d steps, %s %.3f, at most %.2f mm from the path\n", trace->name, f->nstep,
           task->score_name ? task->score_name : "return", f->score, 1e3 * f->deviation);
    if (!(f->score < least)) return om_rl_drive_keep(drive, demos);
    OmStatus status = om_rl_drive_info(drive, info, NULL);
    for (int k = 0; k < task->ninfo && status >= 0; ++k)
        status = om_text_append(&text, "%s%s %.3g", k ? ", " : "", task->info_name[k], info[k]);
    if (status >= 0)
        status = om_error(
            OM_INVALID,
            "%s: the path does not solve task %s: its score is %.3f, below %g (%s); nothing "
            "was written. Check frame and units of the table, and with --begin and --end its part that is the "
            "task; --least-score takes it",
            trace->name, task->name, f->score, least, text.str ? text.str : "");
    om_text_done(&text);
    return status;
}

static OmStatus follow_all(const OmCliArgs* args, const OmRlTask* task, int seed,
                           OmRlDemos* demos) {
    double deviation = 2, least = isnan(task->target) ? -HUGE_VAL : task->target, most = 0;
    OmRlDrive* drive = NULL;
    OmRlTrace trace = {0};
    OmStatus status;
    OM_TRY_DONE(om_cli_double(args, "--deviation", &deviation));
    OM_TRY_DONE(om_cli_double(args, "--least-score", &least));
    OM_TRY_DONE(om_rl_drive_create(task, (uint64_t)seed, &drive));
    for (int k = 0; om_cli_get_nth(args, "--from", k); ++k) {
        OmRlFollow f;
        OM_TRY_DONE(om_progress_report(om_cli_progress(true), "tables", k, 0));
        OM_TRY_DONE(load_trace(args, k, &trace));
        OM_TRY_DONE(follow(&trace, 1e-3 * deviation, least, task, drive, &f, demos));
        om_rl_trace_done(&trace);
        most = fmax(most, f.deviation);
    }
    om_cli_figure("deviation_mm", 1e3 * most);
done:
    om_rl_trace_done(&trace);
    om_rl_drive_destroy(drive);
    return status;
}

// -------------------------------------------------------------------------------------------------------

// The first demonstrations of a recording that was stopped are in `part`, beside the file of the whole.
static OmStatus record_expert(const OmCliArgs* args, const OmRlTask* task, int seed,
                              const char* part, OmRlDemos* demos) {
    int number = 35;
    OM_TRY(om_cli_int(args, "--number", &number));
    if (om_path_exists(part)) OM_TRY(om_rl_demos_load(part, demos));
    const OmProgress* progress = om_cli_progress(om_cli_get(args, "--quiet") != NULL);
    OmStatus status = om_rl_demos_continue(task, number, (uint64_t)seed, progress, demos);
    om_cli_progress_done();
    if (status == OM_CANCELLED && demos->ndemo > 0) {
        OM_TRY(om_rl_demos_save(demos, part));
        om_cli_path(part);
        return om_error(OM_CANCELLED,
                        "cancelled; the first %d demonstrations are in %s, and the same command "
                        "continues from them",
                        demos->ndemo, part);
    }
    if (status == OM_INVALID && demos->ndemo > 0)
        return om_error_prefix(status, "%s (delete it to begin again)", part);
    return status;
}

// --begin and --end: none, or one for each table.
static OmStatus check_cuts(const OmCliArgs* args) {
    static const char* const name[] = {"--begin", "--end"};
    int n[2] = {0}, nfrom = 0;
    while (om_cli_get_nth(args, "--from", nfrom)) ++nfrom;
    for (int i = 0; i < 2; ++i) {
        while (om_cli_get_nth(args, name[i], n[i])) ++n[i];
        OM_CHECK(n[i] == 0 || n[i] == nfrom, OM_INVALID,
                 "%s is given %d times and --from %d times: give one for each, or none", name[i],
                 n[i], nfrom);
    }
    return OM_OK;
}

// Files are checked before the task is made, which may take a second.
static OmStatus check_files(const OmCliArgs* args, const char* part) {
    const char *path = om_cli_get(args, "--output"), *from;
    OM_TRY(om_file_check_ours(path, "omentum demonstrations"));
    OM_TRY(om_file_check_ours(part, "omentum demonstrations"));
    OM_TRY(check_cuts(args));
    int nrecording = 0;
    for (int k = 0; (from = om_cli_get_nth(args, "--from", k)) != NULL; ++k) {
        OmRlTrace trace;
        OM_TRY(om_path_check_apart(from, path));
        OM_TRY(load_trace(args, k, &trace));
        om_rl_trace_done(&trace);
        nrecording += is_recording(from);
    }
    const bool is_for_recording = om_cli_get(args, "--arm") || om_cli_get(args, "--frames");
    OM_CHECK(
        nrecording > 0 || !is_for_recording, OM_INVALID,
        "--arm and --frames are for recordings (--from FILE.mcap): tables are in the frame of the task");
    return OM_OK;
}

static OmStatus record(const OmCliArgs* args, const OmRlTask* task, const char* part) {
    const char* path = om_cli_get(args, "--output");
    OmRlDemos demos = {0};
    OmStatus status;
    int seed = 1;
    double sum = 0;
    om_cli_clean_beside(path);
    OM_TRY_DONE(om_cli_int(args, "--seed", &seed));
    if (om_cli_get(args, "--from")) {
        om_cli_set_end("omentum rl demo: cancelled; nothing was written\n", 0);
        OM_TRY_DONE(follow_all(args, task, seed, &demos));
        om_cli_set_end(NULL, 0);
    } else
        OM_TRY_DONE(record_expert(args, task, seed, part, &demos));
    OM_TRY_DONE(om_rl_demos_save(&demos, path));
    if (!om_cli_get(args, "--from")) (void)om_path_remove(part);
    for (int k = 0; k < demos.ndemo; ++k) sum += demos.score[k];
    om_cli_figure("demonstrations", demos.ndemo);
    om_cli_figure("steps", demos.nstep);
    om_cli_figure("score", sum / demos.ndemo);  // ndemo > 0
    om_cli_path(path);
    printf("%d demonstrations, %d steps, mean score %.3f: %s\n", demos.ndemo, demos.nstep,
           sum / demos.ndemo, path);
done:
    om_rl_demos_done(&demos);
    return status;
}

int om_cli_rl_demo(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional;
    char part[1024];
    OmRlTask* task = NULL;
    OmStatus status = om_cli_check(&args, 0, &npositional);
    if (status >= 0 && !om_cli_get(&args, "--output"))
        status = om_error(OM_INVALID, "give the file of demonstrations (-o FILE)");
    if (status >= 0 && om_cli_get(&args, "--from") && om_cli_get(&args, "--number"))
        status = om_error(
            OM_INVALID, "--number is of the expert; --from gives one demonstration for each table");
    if (status >= 0) {
        const char* path = om_cli_get(&args, "--output");
        status = snprintf(part, sizeof part, "%s.part", path) < (int)sizeof part
                     ? check_files(&args, part)
                     : om_error(OM_INVALID, "%s: the path is too long", path);
        if (status < 0) return om_cli_fail("rl demo", status);
        status = om_cli_rl_task(&args, &task);
    }
    if (status < 0) {
        om_rl_task_destroy(task);
        return om_cli_usage("rl demo");
    }
    status = record(&args, task, part);
    om_rl_task_destroy(task);
    if (status == OM_CANCELLED && !om_cli_get(&args, "--from") && om_path_exists(part)) {
        fprintf(stderr, "omentum rl demo: %s\n", om_error_message());
        return OM_EXIT_CANCELLED;
    }
    return status < 0 ? om_cli_fail("rl demo", status) : OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_rl_demo = {
    .name = "rl demo",
    .run = om_cli_rl_demo,
    .summary = "record demonstrations of a task by its scripted expert or from a recorded robot",
    .usage = "omentum rl demo -t TASK -o FILE [--from TABLE] [options]",
    .about =
        "The expert acts with the noise of a person, from drawn starts. With --from the tip follows the path\n"
        "of a recorded robot, given in the frame of the task (doc/rl.md), by the task's moves and without the\n"
        "pauses of the robot. FILE is HDF5 in the layout of robomimic; omentum rl train reads it for gail and\n"
        "clone. When it is stopped, FILE.part has the finished demonstrations of the expert, and the same command\n"
        "continues from them. A person makes demonstrations by omentum rl play --record FILE.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum rl demo -t reach -o out/demos.hdf5\n"
        "  omentum rl demo -t retract --from lift1.csv --from lift2.csv -o out/demos.hdf5\n"
        "  omentum rl demo -t retract --from run.mcap --frames task.json --begin 3.5 --end 9 -o out/demos.hdf5",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
