// cli_rl_play.c: omentum rl play: a person drives a task by keys.
//
// Keys are read from standard input. On a terminal each key is a step, or the keys that arrive until the next tick are
// one (--real-time). From a pipe each key is a step in both cases, so that the same input gives the same bytes.
#include "cli_rl_play.h"

#include <string.h>
#include <time.h>

#include "cli_rl.h"
#include "cli_terminal.h"

enum { MAX_COUNT = 100000 };

static const OmCliOption option[] = {
    OM_CLI_RL_TASK,
    {"--picture", "-p", "FILE",
     "FILE.png, replaced while you drive; FILE.html: a page that shows FILE.png in a browser"},
    {"--size", NULL, "N", "width and height of the picture", "480", "px", 16, 2048},
    {"--fps", NULL, "N", "pictures a second, at most", "10", NULL, 0.1, 100},
    {"--record", "-o", "FILE",
     "append each finished episode as a demonstration to FILE, HDF5 as omentum rl demo writes it"},
    {"--least-score", NULL, "X", "record only episodes of this score or more", "all", NULL, -1e9,
     1e9},
    {"--episodes", "-n", "N", "end after this many finished episodes", "no limit", NULL, 1, 100000},
    {"--start", NULL, "N", "begin each episode at this start of the evaluation", "drawn", NULL, 0,
     100000},
    {"--real-time", NULL, NULL, "steps follow the clock; without a key the tip stays"},
    {"--rate", NULL, "HZ", "steps a second with --real-time", "the task's", "1/s", 0.1, 1000},
    {"--seed", NULL, "N", "seed of the episodes", "1, plus the demonstrations that FILE has", NULL,
     0, 2147483647},
};

static const OmCliKey result_key[] = {
    {"episodes", "number of finished episodes"},
    {"steps", "of finished episodes"},
    {"score", "mean score of finished episodes"},
    {"recorded", "demonstrations that were appended"},
    {"rate", "steps a second that were reached, with --real-time"},
};

typedef struct Play {
    const OmRlTask* task;
    OmRlDrive* drive;
    OmCliKeys keys;
    OmCliPlayPicture picture;
    const char* record;  // file of demonstrations, or null
    OmRlDemos demos;
    bool has_least;
    double least;
    int start, max_episode;
    bool is_paced;
    double period, tick;  // s
    int action[OM_RL_MAX_ACTION];
    int count;          // typed before a key
    int held, nheld;    // a key that acts in steps to come
    bool is_commented;  // the rest of the line is a comment
    bool is_drawn;      // the picture shows the present state
    bool is_open;       // an episode is in progress
    bool is_done;
    int nfinished, nkept, nstep;
    double sum;   // of scores
    int ndriven;  // steps
} Play;

// ---- text for the person ------------------------------------------------------------------------------

static void print_key(int key) {
    static const char* const name[] = {"up", "down", "left", "right", "page up", "page down"};
    if (key >= OM_RL_KEY_UP)
        fprintf(stderr, "%s", name[key - OM_RL_KEY_UP]);
    else
        fprintf(stderr, "%c", key);
}

// Each choice once, with all its keys.
static void print_keys(const OmRlTask* task) {
    fprintf(stderr, "keys of task %s:\n", task->name);
    for (int i = 0; i < task->nkey; ++i) {
        const OmRlKey* k = &task->key[i];
        bool is_first = true;
        for (int j = 0; j < i; ++j)
            is_first &= task->key[j].component != k->component || task->key[j].choice != k->choice;
        if (!is_first) continue;
        fprintf(stderr, "  %s:", k->about);
        for (int j = i; j < task->nkey; ++j) {
            const OmRlKey* other = &task->key[j];
            if (other->component != k->component || other->choice != k->choice) continue;
            fprintf(stderr, j == i ? " " : ", ");
            print_key(other->key);
        }
        fprintf(stderr, "\n");
    }
    fprintf(stderr, "  space: a step without a key    20 and a key: 20 steps with it\n"
                    "  f: finish the episode here     r: drop it and begin the next\n"
                    "  ?: this text                   q: end\n");
}

// Return and infos of the episode.
static OmStatus print_state(Play* p, FILE* out) {
    double info[OM_RL_MAX_INFO] = {0};
    const OmRlDriveNow* now = om_rl_drive_now(p->drive);
    OM_TRY(om_rl_drive_info(p->drive, info, NULL));
    fprintf(out, "%d steps, return %.3f", now->nstep, now->sum);
    for (int k = 0; k < p->task->ninfo; ++k)
        fprintf(out, ", %s %.3g", p->task->info_name[k], info[k]);
    return OM_OK;
}

static OmStatus print_status(Play* p) {
    if (!p->keys.is_terminal) return OM_OK;
    fprintf(stderr, "\r\033[K");
    OM_TRY(print_state(p, stderr));
    if (p->count > 0) fprintf(stderr, "  %d", p->count);
    fflush(stderr);
    return OM_OK;
}

static void clear_status(const Play* p) {
    if (p->keys.is_terminal) fprintf(stderr, "\r\033[K");
}

// ---- episodes -----------------------------------------------------------------------------------------

static OmStatus begin_episode(Play* p) {
    memset(p->action, 0, sizeof p->action);
    p->nheld = p->count = 0;
    p->is_drawn = false;
    p->is_open = true;
    OM_TRY(om_rl_drive_reset(p->drive, p->start));
    return print_status(p);
}

// Append the episode and write the file, whole or not at all.
static OmStatus record(Play* p, double score) {
    if (!p->record) return OM_OK;
    if (p->has_least && !(score >= p->least)) {
        printf("; not recorded: its score is below %g", p->least);
        return OM_OK;
    }
    OM_TRY(om_rl_drive_keep(p->drive, &p->demos));
    OM_TRY(om_rl_demos_save(&p->demos, p->record));
    ++p->nkept;
    printf("; demonstration %d of %s", p->demos.ndemo, p->record);
    return OM_OK;
}

static OmStatus finish_episode(Play* p) {
    const OmRlDriveNow* now = om_rl_drive_now(p->drive);
    double info[OM_RL_MAX_INFO], score;
    if (now->nstep == 0) return OM_OK;
    clear_status(p);
    OM_TRY(om_cli_play_picture_draw(&p->picture, p->drive, true));
    OM_TRY(om_rl_drive_info(p->drive, info, &score));
    printf("episode %d, %s: ", p->nfinished + 1,
           now->is_terminated ? "ended"
           : now->is_over     ? "at its limit of steps"
                              : "finished");
    OM_TRY(print_state(p, stdout));
    OmStatus status = record(p, score);
    printf("\n");
    fflush(stdout);
    OM_TRY(status);
    p->is_open = false;
    ++p->nfinished;
    p->nstep += now->nstep;
    p->sum += score;
    p->is_done = p->max_episode > 0 && p->nfinished == p->max_episode;
    return p->is_done ? OM_OK : begin_episode(p);
}

static OmStatus leave_episode(Play* p) {
    clear_status(p);
    if (!p->is_open || om_rl_drive_now(p->drive)->nstep == 0) return OM_OK;
    OM_TRY(om_cli_play_picture_draw(&p->picture, p->drive, true));
    printf("episode %d, not finished: ", p->nfinished + 1);
    OM_TRY(print_state(p, stdout));
    printf(p->record ? "; not recorded (f finishes an episode)\n" : "\n");
    return OM_OK;
}

static OmStatus step(Play* p) {
    OM_TRY(om_rl_drive_step(p->drive, p->action));
    ++p->ndriven;
    p->is_drawn = false;
    if (om_rl_drive_now(p->drive)->is_over) return finish_episode(p);
    if (p->keys.is_terminal) OM_TRY(print_status(p));
    return om_cli_play_picture_draw(&p->picture, p->drive, false);
}

// ---- keys ---------------------------------------------------------------------------------------------

static OmStatus refuse_key(const Play* p, int key) {
    if (p->keys.is_terminal) {
        clear_status(p);
        fprintf(stderr, "task %s has no such key; ? prints the keys\n", p->task->name);
        return OM_OK;
    }
    char shown[8];
    snprintf(shown, sizeof shown, key > ' ' && key < 127 ? "%c" : "\\x%02x", (unsigned)key & 255);
    return om_error(OM_INVALID,
                    "standard input, key %d: task %s has no key \"%s\"; ? prints the keys",
                    p->keys.nread, p->task->name, shown);
}

// Keys that are no part of an action. @return OM_OK; `is_taken`: it was one
static OmStatus take_command(Play* p, int key, bool* is_taken) {
    *is_taken = true;
    if (p->is_commented || key == '#') {
        p->is_commented = !p->keys.is_terminal && key != '\n';
        return OM_OK;
    }
    if (key >= '0' && key <= '9') {
        if (p->count < MAX_COUNT) p->count = 10 * p->count + key - '0';
        return print_status(p);
    }
    switch (key) {
    case OM_CLI_KEY_NONE:
    case '\n':
    case '\r':
    case '\t': return OM_OK;
    case OM_CLI_KEY_END:
    case 'q': p->is_done = true; return OM_OK;
    case 'f': return finish_episode(p);
    case 'r':
        clear_status(p);
        if (om_rl_drive_now(p->drive)->nstep > 0)
            printf("episode %d was dropped\n", p->nfinished + 1);
        return begin_episode(p);
    case '?':
        clear_status(p);
        print_keys(p->task);
        return OM_OK;
    default: *is_taken = false; return OM_OK;
    }
}

// Hold a key for the steps that were typed before it. @return OM_OK; OM_INVALID (a pipe with an unknown key)
static OmStatus hold_key(Play* p, int key) {
    int action[OM_RL_MAX_ACTION] = {0};
    bool is_known = key == ' ' || om_rl_task_press(p->task, key, action);
    p->nheld = is_known ? (p->count > 0 ? p->count : 1) : 0;
    p->held = key;
    p->count = 0;
    return is_known ? OM_OK : refuse_key(p, key);
}

// One step with the held key.
static OmStatus step_held(Play* p) {
    om_rl_task_rest(p->task, p->action);
    (void)om_rl_task_press(p->task, p->held, p->action);
    --p->nheld;
    return step(p);
}

// One key, and its steps. The picture is drawn when the person is waited for.
static OmStatus take_key(Play* p) {
    bool is_taken;
    if (!p->is_drawn && !om_cli_keys_waiting(&p->keys)) {
        OM_TRY(om_cli_play_picture_draw(&p->picture, p->drive, true));
        p->is_drawn = true;
    }
    int key = om_cli_keys_read(&p->keys, -1);
    OM_TRY(take_command(p, key, &is_taken));
    if (!is_taken) OM_TRY(hold_key(p, key));
    while (p->nheld > 0 && !p->is_done && !om_cli_is_interrupted()) OM_TRY(step_held(p));
    return OM_OK;
}

// ---- real time ----------------------------------------------------------------------------------------

// Wait for the next tick. Where a step took longer than its period, time is lost and not made up.
static void wait_tick(Play* p) {
    const double now = om_clock_now();
    if (p->tick > now) {
        const double left = p->tick - now;
        struct timespec t = {(time_t)left, (long)(1e9 * (left - (double)(time_t)left))};
        nanosleep(&t, NULL);
    }
    p->tick = (p->tick > now ? p->tick : now) + p->period;
}

// The keys that arrive until the tick are one action; the key of a count acts in each step.
static OmStatus take_tick(Play* p) {
    double left;
    bool is_taken;
    int episode = om_rl_drive_now(p->drive)->episode;
    om_rl_task_rest(p->task, p->action);
    while ((left = p->tick - om_clock_now()) > 0 && !p->is_done && !om_cli_is_interrupted()) {
        int key = om_cli_keys_read(&p->keys, left);
        OM_TRY(take_command(p, key, &is_taken));
        if (is_taken) continue;
        bool is_many = p->count > 1;
        int nheld = p->nheld, held = p->held;
        OM_TRY(hold_key(p, key));
        if (key != ' ') (void)om_rl_task_press(p->task, key, p->action);
        if (!is_many && p->nheld > 0) p->nheld = nheld, p->held = held;
    }
    wait_tick(p);
    if (p->is_done || om_cli_is_interrupted()) return OM_OK;
    if (om_rl_drive_now(p->drive)->episode != episode) return OM_OK;
    if (p->nheld > 0) {
        (void)om_rl_task_press(p->task, p->held, p->action);
        --p->nheld;
    }
    return step(p);
}

// From a pipe: a key a tick.
static OmStatus take_paced_key(Play* p) {
    bool is_taken;
    if (p->nheld == 0) {
        int key = om_cli_keys_read(&p->keys, -1);
        OM_TRY(take_command(p, key, &is_taken));
        if (is_taken) return OM_OK;
        OM_TRY(hold_key(p, key));
    }
    wait_tick(p);
    return step_held(p);
}

static OmStatus drive(Play* p) {
    OM_TRY(begin_episode(p));
    if (p->keys.is_terminal) fprintf(stderr, "? prints the keys, q ends\n");
    OM_TRY(om_cli_play_picture_draw(&p->picture, p->drive, true));
    p->is_drawn = true;
    p->tick = om_clock_now() + p->period;
    const double begin = om_clock_now();
    while (!p->is_done && !om_cli_is_interrupted()) {
        OM_TRY(!p->is_paced ? take_key(p) : p->keys.is_terminal ? take_tick(p) : take_paced_key(p));
    }
    const double time = om_clock_now() - begin;
    if (p->is_paced && time > 0) om_cli_figure("rate", p->ndriven / time);
    return om_cli_is_interrupted() ? om_error(OM_CANCELLED, "cancelled") : leave_episode(p);
}

// ---- the verb -----------------------------------------------------------------------------------------

// Demonstrations that the file already has.
static OmStatus open_record(Play* p) {
    if (!p->record) return OM_OK;
    OM_TRY(om_file_check_ours(p->record, "omentum demonstrations"));
    om_cli_clean_beside(p->record);
    if (p->picture.name) OM_TRY(om_path_check_apart(p->record, p->picture.png));
    if (!om_path_exists(p->record)) return OM_OK;
    OM_TRY(om_rl_demos_load(p->record, &p->demos));
    OmStatus status = om_rl_demos_check(&p->demos, p->task);
    return status < 0 ? om_error_prefix(status, "%s", p->record) : OM_OK;
}

static OmStatus read_options(const OmCliArgs* args, Play* p, double* fps) {
    p->picture.name = om_cli_get(args, "--picture");
    p->picture.size = 480;
    p->record = om_cli_get(args, "--record");
    p->is_paced = om_cli_get(args, "--real-time") != NULL;
    p->has_least = om_cli_get(args, "--least-score") != NULL;
    p->start = -1;
    OM_CHECK(p->is_paced || !om_cli_get(args, "--rate"), OM_INVALID, "--rate needs --real-time");
    OM_CHECK(p->record || !p->has_least, OM_INVALID, "--least-score needs --record");
    OM_TRY(om_cli_int(args, "--size", &p->picture.size));
    OM_TRY(om_cli_double(args, "--fps", fps));
    OM_TRY(om_cli_double(args, "--least-score", &p->least));
    OM_TRY(om_cli_int(args, "--episodes", &p->max_episode));
    return om_cli_int(args, "--start", &p->start);
}

static OmStatus play(const OmCliArgs* args, Play* p, double fps) {
    double rate = 1 / p->task->period;  // period > 0
    OmStatus status;
    OM_TRY_DONE(om_cli_double(args, "--rate", &rate));
    p->period = 1 / rate;
    p->picture.period = 1 / fps;
    OM_TRY_DONE(om_cli_play_picture_begin(&p->picture));
    OM_TRY_DONE(open_record(p));
    int seed = 1 + p->demos.ndemo;
    OM_TRY_DONE(om_cli_int(args, "--seed", &seed));
    OM_TRY_DONE(om_rl_drive_create(p->task, (uint64_t)seed, &p->drive));
    (void)om_cli_progress(true);
    om_cli_keys_begin(&p->keys);
    status = drive(p);
    om_cli_keys_end();
    om_cli_figure("episodes", p->nfinished);
    om_cli_figure("steps", p->nstep);
    if (p->nfinished > 0) om_cli_figure("score", p->sum / p->nfinished);
    om_cli_figure("recorded", p->nkept);
    if (p->nkept > 0) om_cli_path(p->record);
    if (p->picture.name && status >= 0) om_cli_path(p->picture.png);
done:
    om_rl_drive_destroy(p->drive);
    om_rl_demos_done(&p->demos);
    return status;
}

int om_cli_rl_play(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional;
    double fps = 10;
    OmRlTask* task = NULL;
    Play p = {0};
    OmStatus status = om_cli_check(&args, 0, &npositional);
    if (status >= 0) status = read_options(&args, &p, &fps);
    if (status >= 0) status = om_cli_rl_task(&args, &task);
    if (status < 0) return om_cli_usage("rl play");
    p.task = task;
    status = play(&args, &p, fps);
    om_rl_task_destroy(task);
    if (status == OM_CANCELLED) {
        fprintf(stderr, "omentum rl play: cancelled; %d finished episodes are recorded\n", p.nkept);
        return OM_EXIT_CANCELLED;
    }
    return status < 0 ? om_cli_fail("rl play", status) : OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_rl_play = {
    .name = "rl play",
    .run = om_cli_rl_play,
    .summary = "drive a task by keys, and record demonstrations",
    .usage = "omentum rl play -t TASK [-p FILE] [--record FILE] [options]",
    .about =
        "Keys of the terminal move the tools; ? prints the keys of the task, q ends. Each key is a step. With\n"
        "--real-time steps follow the clock. Open FILE.html of --picture in a browser to see the environment.\n"
        "Keys may also come from a pipe: each is a step, a number before a key repeats it, # begins a\n"
        "comment, and the end of the input ends the program. Finished episodes go to the file of\n"
        "demonstrations at once.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum rl play -t retract -p out/play.html --record out/demos.hdf5\n"
               "  omentum rl play -t cart-pole -p out/play.html --real-time\n"
               "  printf '60m 80o 30f' | omentum rl play -t retract --start 24 -p out/play.png",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
