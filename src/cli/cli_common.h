// cli_common.h: what the verbs of the program share: options, progress, Ctrl-C, exit codes.
#ifndef OMENTUM_CLI_COMMON_H
#define OMENTUM_CLI_COMMON_H

#include "omentum/base.h"

// Exit codes: what a script may rely on.
#define OM_EXIT_OK 0  // done
#define OM_EXIT_FAILED \
    1                    // the work was done and its outcome is negative (ROI not exposed, no plan)
#define OM_EXIT_USAGE 2  // the command line is wrong
#define OM_EXIT_ERROR 3  // bad input, input or output failed, out of memory
#define OM_EXIT_STDOUT \
    4  // the work was done, files are complete; standard output could not be written
#define OM_EXIT_CANCELLED 130  // Ctrl-C, or SIGTERM or SIGHUP

// One option of a verb. A flag has no argument; the same name may not appear twice in a table.
typedef struct OmCliOption {
    const char* name;   // with its dashes: "--edge"; "-o" is found by its second name
    const char* alias;  // or null
    const char* arg;    // name of its argument for --help, null for a flag
    const char* help;
} OmCliOption;

typedef struct OmCliArgs {
    const OmCliOption* option;
    int noption;
    int argc;
    char** argv;
} OmCliArgs;

// Check every argument of argv[1..] against the table. Returns OM_INVALID with the nearest option in the
// message for an unknown one. Positional arguments are counted into npositional.
OmStatus om_cli_check(const OmCliArgs* args, int max_positional, int* npositional);
// The argument of the last use of an option; "" for a flag that is set; null if it is not given.
const char* om_cli_get(const OmCliArgs* args, const char* name);
// The k-th use of an option that may be repeated, or null.
const char* om_cli_get_nth(const OmCliArgs* args, const char* name, int k);
const char* om_cli_positional(const OmCliArgs* args, int index);
// Numbers with their range checked; `value` keeps its default if the option is not given.
OmStatus om_cli_get_double(const OmCliArgs* args, const char* name, double min, double max,
                           double* value);
OmStatus om_cli_get_int(const OmCliArgs* args, const char* name, int min, int max, int* value);
void om_cli_print_options(const OmCliArgs* args);

// A progress listener on stderr that stops the work after Ctrl-C, SIGTERM or SIGHUP. Quiet if `is_quiet`.
const OmProgress* om_cli_progress(bool is_quiet);
void om_cli_progress_done(void);
bool om_cli_is_interrupted(void);

// Print the error message of this thread and return the exit code that fits the status.
int om_cli_fail(const char* verb, OmStatus status);
// The same for work that the same command goes on with after it was cancelled.
int om_cli_fail_kept(const char* verb, OmStatus status);

// What was printed must have arrived: the exit code `code`, or OM_EXIT_STDOUT and a message if the work was done, and
// standard output failed. Files are complete all the same, so this has a code of its own.
int om_cli_check_output(int code);

// What a verb reads, null entries skipped, must lie apart from what it writes; null `output`: it writes nothing.
OmStatus om_cli_check_apart(const char* output, const char* const* input, int ninput);

// The folder of scenes and logic programs: beside the program in the build tree, or installed.
OmStatus om_cli_share_path(const char* name, char* out, size_t size);

// The argument of --weights, or weights/phantom.safetensors beside the program, if it is there.
OmStatus om_cli_weights_path(const OmCliArgs* args, char* out, size_t size);

// First of all: how threads of libraries wait. May start the program anew.
void om_cli_set_environment(char** argv);

// The verbs.
int om_cli_calibrate(int argc, char** argv);
int om_cli_model(int argc, char** argv);
int om_cli_plan(int argc, char** argv);
int om_cli_retract(int argc, char** argv);
int om_cli_demo(int argc, char** argv);
int om_cli_study(int argc, char** argv);
int om_cli_study_contact(int argc, char** argv);
int om_cli_study_calibration(int argc, char** argv);
int om_cli_study_sheet(int argc, char** argv);
int om_cli_study_methods(int argc, char** argv);
int om_cli_umesh(int argc, char** argv);
int om_cli_umesh_generate(int argc, char** argv);
int om_cli_umesh_train(int argc, char** argv);
int om_cli_umesh_eval(int argc, char** argv);
int om_cli_umesh_predict(int argc, char** argv);

#endif
