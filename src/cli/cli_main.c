// cli_main.c: the omentum program: find the verb and call it.
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

#include "cli_common.h"
#include "cli_version.h"

static void print_help(FILE* out) {
    const OmCliVerb* v;
    fprintf(out, "omentum: patient-specific simulation of soft tissue for autonomous surgery\n\n"
                 "Usage: omentum VERB [options]\n\n");
    for (int k = 0; (v = om_cli_verb_at(k)); ++k)
        if (!strchr(v->name, ' ')) fprintf(out, "  %-16s %s\n", v->name, v->summary);
    fprintf(
        out,
        "\n  omentum help VERB          options and examples of a verb, as omentum VERB --help\n"
        "  omentum man                the man page\n"
        "  omentum completion SHELL   completion for bash, zsh or fish\n"
        "  omentum --version          the version, commit, processor, libraries\n\n"
        "Exit codes: 0 done; 1 done, with a negative outcome; 2 wrong command line; 3 bad input or "
        "failed output; 4 done and files written, but standard output failed; 130 cancelled\n");
}

static void print_warning(void* ctx, OmLogLevel level, const char* line) {
    (void)ctx;
    if (level >= OM_LOG_WARNING) fprintf(stderr, "warning: %s\n", line);
}

// Open /dev/null on closed standard descriptors, so that no output file gets one of these numbers and is printed into.
// Printing to a closed standard output fails; messages to a closed standard error go to the terminal, if there is one.
static void take_descriptors(void) {
    for (int fd = 0; fd <= STDERR_FILENO; ++fd) {
        if (fcntl(fd, F_GETFD) >= 0 || errno != EBADF) continue;
        int got = fd == STDERR_FILENO ? open("/dev/tty", O_WRONLY | O_NOCTTY) : -1;
        if (got < 0) got = open("/dev/null", fd == STDOUT_FILENO ? O_RDONLY : O_RDWR);
    }
}

// For an unknown verb, or a group without a verb: list the existing names.
static int refuse_verb(const OmCliVerb* group, const char* word) {
    const char* name[64];
    const OmCliVerb* v;
    size_t skip = group ? strlen(group->name) + 1 : 0;
    int n = 0;
    for (int k = 0; (v = om_cli_verb_at(k)) && n < 64; ++k) {
        bool is_member =
            group && strncmp(v->name, group->name, skip - 1) == 0 && v->name[skip - 1] == ' ';
        if (group ? is_member : !strchr(v->name, ' ')) name[n++] = v->name + skip;
    }
    const char* nearest = word ? om_nearest_word(word, name, n) : NULL;
    fprintf(stderr, "omentum%s%s: ", group ? " " : "", group ? group->name : "");
    if (word)
        fprintf(stderr, "unknown %s \"%s\"", group ? "name" : "verb", word);
    else
        fprintf(stderr, "no name is given");
    if (nearest) fprintf(stderr, "; did you mean \"%s\"?", nearest);
    fprintf(stderr, "; omentum help%s%s lists the names:", group ? " " : "",
            group ? group->name : "");
    for (int k = 0; k < n; ++k) fprintf(stderr, " %s", name[k]);
    fprintf(stderr, "\n");
    return OM_EXIT_USAGE;
}

static int show_help(int argc, char** argv) {
    int nword;
    const OmCliVerb* verb = om_cli_find_verb(argc, argv, &nword);
    if (argc == 0) {
        print_help(stdout);
        return OM_EXIT_OK;
    }
    if (!verb || nword < argc) return refuse_verb(verb && !verb->run ? verb : NULL, argv[nword]);
    om_cli_print_help(verb);
    return OM_EXIT_OK;
}

static int show_completion(int argc, char** argv) {
    if (argc == 1 && om_cli_print_completion(argv[0])) return OM_EXIT_OK;
    fprintf(stderr, "omentum completion: name one shell: bash, zsh or fish\n");
    return OM_EXIT_USAGE;
}

static int run_verb(const OmCliVerb* verb, int argc, char** argv) {
    OmCliArgs args = {verb->option, verb->noption, argc, argv};
    if (om_cli_get(&args, "--help")) {
        om_cli_print_help(verb);
        return OM_EXIT_OK;
    }
    bool is_json = om_cli_get(&args, "--json") != NULL;
    if (is_json && !verb->has_own_json) om_cli_result_begin(verb);
    om_cli_watch_signals();
    int code = verb->run(argc, argv);
    if (is_json && verb->has_own_json && code >= OM_EXIT_USAGE) om_cli_result_begin(verb);
    return om_cli_result_end(code);
}

int main(int argc, char** argv) {
    take_descriptors();
    om_cli_set_environment(argv);
    // a file above the size limit gives an error instead of ending the process
    signal(SIGXFSZ, SIG_IGN);
    signal(SIGPIPE, SIG_IGN);  // a reader that closes its pipe must not end the work
    om_log_set_sink(print_warning, NULL);
    if (argc < 2) {
        print_help(stderr);
        return OM_EXIT_USAGE;
    }
    const char* word = argv[1];
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
        print_help(stdout);
        return om_cli_check_output(OM_EXIT_OK);
    }
    if (strcmp(word, "--version") == 0) {
        om_cli_print_version();
        return om_cli_check_output(OM_EXIT_OK);
    }
    if (strcmp(word, "help") == 0) return om_cli_check_output(show_help(argc - 2, argv + 2));
    if (strcmp(word, "completion") == 0)
        return om_cli_check_output(show_completion(argc - 2, argv + 2));
    if (strcmp(word, "man") == 0) {
        om_cli_print_man();
        return om_cli_check_output(OM_EXIT_OK);
    }
    int nword;
    const OmCliVerb* verb = om_cli_find_verb(argc - 1, argv + 1, &nword);
    if (!verb && strcmp(word, "calibrate-mesh") == 0) {
        fprintf(stderr, "omentum: calibrate-mesh is gone: " OM_CLI_NO_MESH_FACTOR "\n");
        return OM_EXIT_USAGE;
    }
    if (!verb) return refuse_verb(NULL, word);
    if (verb->run) return om_cli_check_output(run_verb(verb, argc - nword, argv + nword));
    const char* next = argv[nword + 1];
    if (next && (strcmp(next, "--help") == 0 || strcmp(next, "-h") == 0)) {
        om_cli_print_help(verb);
        return om_cli_check_output(OM_EXIT_OK);
    }
    return refuse_verb(verb, next && *next != '-' ? next : NULL);
}
