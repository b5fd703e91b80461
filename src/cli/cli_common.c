// cli_common.c: options, progress, Ctrl-C, exit codes.
#include "cli_common.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

// The option of a word, "--edge" or "--edge=4"; `value` is the text after the sign, or null.
static const OmCliOption* find_option(const OmCliArgs* args, const char* word, const char** value) {
    const char* equals = word[0] == '-' && word[1] == '-' ? strchr(word, '=') : NULL;
    if (value) *value = equals ? equals + 1 : NULL;
    return om_cli_find_option(args->option, args->noption, word,
                              equals ? (size_t)(equals - word) : strlen(word));
}

static bool is_option_word(const char* word) {
    // A negative number is an argument, not an option.
    return word[0] == '-' && word[1] != 0 && !(word[1] >= '0' && word[1] <= '9') && word[1] != '.';
}

static OmStatus refuse_option(const OmCliArgs* args, const char* word) {
    const char* name[66] = {"--help", "--json"};
    char typed[64];
    int n = 2;
    for (int k = 0; k < args->noption && n < 66; ++k) name[n++] = args->option[k].name;
    snprintf(typed, sizeof typed, "%.*s", (int)strcspn(word, "="), word);
    const char* nearest = om_nearest_word(typed, name, n);
    return nearest ? om_error(OM_INVALID, "unknown option %s; did you mean %s?", typed, nearest)
                   : om_error(OM_INVALID, "unknown option %s; --help lists them", typed);
}

static OmStatus parse_number(const char* name, const char* text, double min, double max,
                             double* value) {
    char* end;
    double v = strtod(text, &end);
    OM_CHECK(end != text && *end == 0 && isfinite(v), OM_INVALID,
             "option %s: \"%s\" is not a number", name, text);
    OM_CHECK(v >= min && v <= max, OM_INVALID, "option %s: %s is outside its range, %g to %g", name,
             text, min, max);
    *value = v;
    return OM_OK;
}

OmStatus om_cli_check(const OmCliArgs* args, int max_positional, int* npositional) {
    *npositional = 0;
    double number;
    for (int i = 1; i < args->argc; ++i) {
        const char* word = args->argv[i];
        if (!is_option_word(word)) {
            OM_CHECK(++*npositional <= max_positional, OM_INVALID,
                     "\"%s\" is one argument too many", word);
            continue;
        }
        const char* value;
        const OmCliOption* o = find_option(args, word, &value);
        if (!o) return refuse_option(args, word);
        OM_CHECK(o->arg || !value, OM_INVALID, "option %s takes no value, and %s is given", o->name,
                 word);
        if (!o->arg) continue;
        OM_CHECK(value || i + 1 < args->argc, OM_INVALID, "option %s needs %s", word, o->arg);
        if (!value) value = args->argv[++i];
        if (o->min != 0 || o->max != 0)
            OM_TRY(parse_number(o->name, value, o->min, o->max, &number));
    }
    return OM_OK;
}

// Walk the words as om_cli_check does, and return the n-th use of an option or positional argument.
static const char* walk(const OmCliArgs* args, const OmCliOption* wanted, int index) {
    int seen = 0;
    const char* last = NULL;
    for (int i = 1; i < args->argc; ++i) {
        const char* word = args->argv[i];
        const char* own = NULL;
        const OmCliOption* o = is_option_word(word) ? find_option(args, word, &own) : NULL;
        const char* value = !o                   ? word
                            : !o->arg            ? ""
                            : own                ? own
                            : i + 1 < args->argc ? args->argv[++i]
                                                 : NULL;
        if (o != wanted) continue;
        last = value;
        if (seen++ == index) return value;
    }
    return index < 0 ? last : NULL;
}

const char* om_cli_get(const OmCliArgs* args, const char* name) {
    return walk(args, find_option(args, name, NULL), -1);
}

const char* om_cli_get_nth(const OmCliArgs* args, const char* name, int k) {
    return walk(args, find_option(args, name, NULL), k);
}

const char* om_cli_positional(const OmCliArgs* args, int index) { return walk(args, NULL, index); }

OmStatus om_cli_get_double(const OmCliArgs* args, const char* name, double min, double max,
                           double* value) {
    const char* text = om_cli_get(args, name);
    return text ? parse_number(name, text, min, max, value) : OM_OK;
}

OmStatus om_cli_get_int(const OmCliArgs* args, const char* name, int min, int max, int* value) {
    double v = *value;
    OM_TRY(om_cli_get_double(args, name, min, max, &v));
    OM_CHECK(v == floor(v), OM_INVALID, "option %s: %g is not a whole number", name, v);
    *value = (int)v;
    return OM_OK;
}

OmStatus om_cli_double(const OmCliArgs* args, const char* name, double* value) {
    const OmCliOption* o = find_option(args, name, NULL);
    return om_cli_get_double(args, name, o->min, o->max, value);
}

// The number of workers is limited to the processors; a note says so once.
static void note_workers(int wanted) {
    static bool is_said;
    int num = om_worker_count(wanted);
    if (is_said || wanted <= num) return;
    is_said = true;
    fprintf(stderr, "note: --workers %d: this process has %d processor%s, so %d worker%s\n", wanted,
            num, num == 1 ? "" : "s", num, num == 1 ? " is used" : "s are used");
}

OmStatus om_cli_int(const OmCliArgs* args, const char* name, int* value) {
    const OmCliOption* o = find_option(args, name, NULL);
    OM_TRY(om_cli_get_int(args, name, (int)o->min, (int)o->max, value));
    if (strcmp(o->name, "--workers") == 0) note_workers(*value);
    return OM_OK;
}

// ---- progress and Ctrl-C -----------------------------------------------------------------------------------

#define PATIENCE 0.5  // s

#define END_AFTER \
    1  // s from the first signal to the end of the program, if work may be ended at any moment

static volatile sig_atomic_t is_interrupted;
static const char* volatile end_message;
static void (*volatile restore_terminal)(void);
static OmProgressBar bar;
static bool is_bar_quiet;

// A second signal half a second or more after the first ends the program at once. Earlier ones count as the same:
// commands that stop a process group (timeout, a shell) may send the signal twice.
static void on_signal(int number) {
    static struct timespec first;
    struct timespec now = {0};
    (void)number;
    clock_gettime(CLOCK_MONOTONIC, &now);
    double since =
        (double)(now.tv_sec - first.tv_sec) + 1e-9 * (double)(now.tv_nsec - first.tv_nsec);
    if (is_interrupted && since > PATIENCE) {
        if (restore_terminal) restore_terminal();
        _exit(OM_EXIT_CANCELLED);
    }
    if (!is_interrupted) first = now;
    if (!is_interrupted && end_message) (void)alarm(END_AFTER);
    is_interrupted = 1;
}

// The time limit, or the end of the patience with work that does not return.
static void on_alarm(int number) {
    if (!is_interrupted) {
        on_signal(number);
        return;
    }
    if (restore_terminal) restore_terminal();
    const char* text = end_message;
    size_t length = 0;
    if (!text) return;
    while (text[length]) ++length;
    if (write(STDERR_FILENO, text, length) < 0) _exit(OM_EXIT_CANCELLED);
    _exit(OM_EXIT_CANCELLED);
}

void om_cli_set_end(const char* message, double seconds) {
    struct sigaction action = {.sa_handler = on_alarm};
    end_message = message;
    sigaction(SIGALRM, &action, NULL);
    struct itimerval timer = {.it_value = {(time_t)seconds, 0}};
    timer.it_value.tv_usec = (suseconds_t)(1e6 * (seconds - (double)timer.it_value.tv_sec));
    (void)setitimer(ITIMER_REAL, &timer, NULL);  // 0: no limit
}

static bool report_progress(void* ctx, const char* stage, double done, double total) {
    (void)ctx;
    if (total < 0) {  // a sentence
        om_progress_bar_done(&bar);
        if (!is_bar_quiet) fprintf(stderr, "%s\n", stage);
        return !is_interrupted;
    }
    if (!is_bar_quiet) om_progress_bar_draw(&bar, stage, done, total);
    return !is_interrupted;
}

static void set_handler(void (*handler)(int)) {
    struct sigaction action = {.sa_handler = handler}, hangup;
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    bool is_detached = sigaction(SIGHUP, NULL, &hangup) == 0 && hangup.sa_handler == SIG_IGN;
    // a program under nohup continues without its terminal
    if (!is_detached) sigaction(SIGHUP, &action, NULL);
}

// Work that has no progress yet, or never has any, is short and writes its files whole: the program ends at once.
static void on_early_signal(int number) {
    static const char text[] = "omentum: cancelled; no file is half written\n";
    (void)number;
    if (restore_terminal) restore_terminal();
    if (write(STDERR_FILENO, text, sizeof text - 1) < 0) _exit(OM_EXIT_CANCELLED);
    _exit(OM_EXIT_CANCELLED);
}

void om_cli_watch_signals(void) { set_handler(on_early_signal); }

const OmProgress* om_cli_progress(bool is_quiet) {
    static const OmProgress progress = {report_progress, NULL};
    is_bar_quiet = is_quiet;
    om_progress_bar_init(&bar, stderr);
    set_handler(on_signal);
    return &progress;
}

void om_cli_progress_done(void) {
    if (bar.out) om_progress_bar_done(&bar);
}

void om_cli_set_restore(void (*restore)(void)) { restore_terminal = restore; }

bool om_cli_is_interrupted(void) { return is_interrupted != 0; }

int om_cli_usage(const char* verb) {
    fprintf(stderr, "omentum %s: %s\n", verb, om_error_message());
    return OM_EXIT_USAGE;
}

int om_cli_fail(const char* verb, OmStatus status) {
    om_cli_progress_done();
    if (status == OM_CANCELLED) {
        bool is_kept = strstr(om_error_message(), "the record so far") != NULL;
        fprintf(stderr, "omentum %s: %s%s\n", verb, om_error_message(),
                is_kept ? "" : "; nothing was written");
        return OM_EXIT_CANCELLED;
    }
    const char* message = om_error_message();
    fprintf(stderr, "omentum %s: %s\n", verb, message[0] ? message : om_status_text(status));
    return OM_EXIT_ERROR;
}

void om_cli_clean_beside(const char* path) {
    char dir[1024];
    if (path && om_path_dir(path, dir, sizeof dir) == OM_OK) om_path_clean(dir, false);
}

// A patient model has the key "mesh" at the beginning of a line; a scene has no such key.
OmStatus om_cli_is_patient(const char* path, bool* is_patient) {
    char* text;
    size_t size;
    OM_TRY(om_file_read(path, (size_t)64 << 20, &text, &size));
    *is_patient = strncmp(text, "mesh:", 5) == 0 || strstr(text, "\nmesh:") != NULL;
    om_free(text);
    return OM_OK;
}

void om_cli_command(const OmCliArgs* args, const char* verb, char* out, size_t size) {
    int len = snprintf(out, size, "omentum %s", verb);
    for (int i = 1; i < args->argc && len >= 0 && (size_t)len < size; ++i)
        len += snprintf(out + len, size - (size_t)len, " %s", args->argv[i]);
}

int om_cli_check_output(int code) {
    bool is_lost = fflush(stdout) != 0;
    int error = errno;
    if ((!is_lost && !ferror(stdout)) || (code != OM_EXIT_OK && code != OM_EXIT_FAILED))
        return code;
    fprintf(stderr, "omentum: standard output: cannot write%s%s; output files are complete\n",
            is_lost ? ": " : "", is_lost ? strerror(error) : "");
    return OM_EXIT_STDOUT;
}

int om_cli_fail_kept(const char* verb, OmStatus status) {
    if (status != OM_CANCELLED) return om_cli_fail(verb, status);
    om_cli_progress_done();
    fprintf(stderr, "omentum %s: cancelled; the same command continues from here\n", verb);
    return OM_EXIT_CANCELLED;
}

OmStatus om_cli_trials_path(const char* out, char* path, size_t size) {
    char dir[1024];
    int n = (int)strlen(out);
    while (n > 1 && out[n - 1] == '/') --n;
    OM_CHECK(snprintf(path, size, "%.*s.trials", n, out) < (int)size, OM_INVALID,
             "%s: the path is too long", out);
    OM_TRY(om_path_dir(path, dir, sizeof dir));
    return om_path_make_dir(dir);
}

int om_cli_fail_trials(const char* verb, OmStatus status, const char* trials) {
    if (status != OM_CANCELLED || !om_path_exists(trials)) return om_cli_fail(verb, status);
    om_cli_progress_done();
    const bool has_record = strstr(om_error_message(), "the record so far") != NULL;
    fprintf(stderr,
            "omentum %s: %s; finished trials of the plan are kept in %s, and the same "
            "command continues from them\n",
            verb, has_record ? om_error_message() : "cancelled", trials);
    return OM_EXIT_CANCELLED;
}

OmStatus om_cli_check_apart(const char* output, const char* const* input, int ninput) {
    for (int i = 0; output && i < ninput; ++i)
        if (input[i]) OM_TRY(om_path_check_apart(input[i], output));
    return OM_OK;
}

OmStatus om_cli_weights_path(const OmCliArgs* args, char* out, size_t size) {
    const char* given = om_cli_get(args, "--weights");
    if (!given)
        OM_CHECK(
            om_path_share("weights/phantom.safetensors", out, size) >= 0, OM_IO,
            "no weights are given (-w FILE), and none of the phantom are installed: make them by omentum umesh "
            "generate -o DATA, then omentum umesh train -d DATA -o DIR");
    if (!given) return OM_OK;
    OM_CHECK(snprintf(out, size, "%s", given) < (int)size, OM_INVALID,
             "--weights: too long a path");
    return OM_OK;
}
