// cli_main.c: the omentum program: finds the verb and hands over.
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

#include "cli_common.h"

typedef struct Verb {
    const char* name;
    int (*run)(int argc, char** argv);
    const char* help;
} Verb;

static const Verb verb[] = {
    {"calibrate", om_cli_calibrate, "find a tissue's parameters from what was seen of it"},
    {"demo", om_cli_demo, "expose a tumour under a sheet of tissue; needs no file"},
    {"model", om_cli_model, "build a patient model from a CT, a label map or a mesh"},
    {"plan", om_cli_plan, "plan a retraction from a described situation, and say why"},
    {"retract", om_cli_retract,
     "run a scene: sense, plan, act until the ROI is seen; writes a report"},
    {"study", om_cli_study, "repeat an experiment of the thesis, with its tables and figures"},
    {"umesh", om_cli_umesh, "make data for a network that knows how an organ deforms"},
};
enum { NVERB = sizeof verb / sizeof *verb };

static void print_help(FILE* out) {
    fprintf(out, "omentum: patient-specific simulation of soft tissue for autonomous surgery\n\n"
                 "Usage: omentum VERB [options]\n\n");
    for (int i = 0; i < NVERB; ++i) fprintf(out, "  %-9s %s\n", verb[i].name, verb[i].help);
    fprintf(
        out,
        "\n  omentum VERB --help   options and examples of a verb\n"
        "  omentum --version     the version\n\n"
        "Exit codes: 0 done; 1 done, with a negative outcome; 2 wrong command line; 3 bad input or "
        "failed output; 4 done and files written, but standard output failed; 130 cancelled\n");
}

static void print_warning(void* ctx, OmLogLevel level, const char* line) {
    (void)ctx;
    if (level >= OM_LOG_WARNING) fprintf(stderr, "warning: %s\n", line);
}

// Closed descriptors are taken, so that no file of ours is opened as standard output and printed into. What is printed
// to a closed standard output fails; messages to a closed standard error go to the terminal, if there is one.
static void take_descriptors(void) {
    for (int fd = 0; fd <= STDERR_FILENO; ++fd) {
        if (fcntl(fd, F_GETFD) >= 0 || errno != EBADF) continue;
        int got = fd == STDERR_FILENO ? open("/dev/tty", O_WRONLY | O_NOCTTY) : -1;
        if (got < 0) got = open("/dev/null", fd == STDOUT_FILENO ? O_RDONLY : O_RDWR);
    }
}

int main(int argc, char** argv) {
    take_descriptors();
    om_cli_set_environment(argv);
    signal(SIGXFSZ, SIG_IGN);  // a file too large is an error to report, not a death
    signal(SIGPIPE, SIG_IGN);  // a reader that leaves is no reason to lose the work
    om_log_set_sink(print_warning, NULL);
    if (argc < 2) {
        print_help(stderr);
        return OM_EXIT_USAGE;
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 ||
        strcmp(argv[1], "help") == 0) {
        print_help(stdout);
        return om_cli_check_output(OM_EXIT_OK);
    }
    if (strcmp(argv[1], "--version") == 0) {
        printf("omentum %s\n", om_version());
        return om_cli_check_output(OM_EXIT_OK);
    }
    const char* name[NVERB];
    for (int i = 0; i < NVERB; ++i) {
        name[i] = verb[i].name;
        if (strcmp(argv[1], verb[i].name) == 0)
            return om_cli_check_output(verb[i].run(argc - 1, argv + 1));
    }
    const char* nearest = om_nearest_word(argv[1], name, NVERB);
    fprintf(stderr, "omentum: unknown verb \"%s\"%s%s%s; omentum --help lists them\n", argv[1],
            nearest ? "; did you mean \"" : "", nearest ? nearest : "", nearest ? "\"?" : "");
    return OM_EXIT_USAGE;
}
