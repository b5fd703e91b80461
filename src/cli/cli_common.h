// cli_common.h: shared by the verbs of the program: options, progress, Ctrl-C, exit codes.
#ifndef OMENTUM_CLI_COMMON_H
#define OMENTUM_CLI_COMMON_H

#include <stdio.h>

#include "omentum/base.h"

// Exit codes; scripts may rely on them.
#define OM_EXIT_OK 0  // done
#define OM_EXIT_FAILED \
    1                    // the work was done and its outcome is negative (ROI not exposed, no plan)
#define OM_EXIT_USAGE 2  // the command line is wrong
#define OM_EXIT_ERROR 3  // bad input, input or output failed, out of memory
#define OM_EXIT_STDOUT \
    4  // the work was done, files are complete; standard output could not be written
#define OM_EXIT_CANCELLED 130  // Ctrl-C, or SIGTERM or SIGHUP

// What stands in for a verb and an option that measured a factor on the twin's modulus.
#define OM_CLI_NO_MESH_FACTOR \
    "quadratic elements (`element: quadratic`) bend as the tissue does; delete `mesh_factor` from the scene"

// One option of a verb. A flag has no argument; a name may not appear twice in a table. Parser, help, man page and
// shell completion are all made from these tables. --help and --json are added to each.
typedef struct OmCliOption {
    const char* name;    // with its dashes: "--edge"; "-o" is found by its second name
    const char* alias;   // or null
    const char* arg;     // name of its argument, null for a flag
    const char* help;    // one sentence, without default and range
    const char* preset;  // the default in words, or null
    const char* unit;    // of a number, or null
    double min, max;     // range of a number; both 0: none
} OmCliOption;

// A key of the figures that --json prints; "point.*" stands for all keys that begin with "point.".
typedef struct OmCliKey {
    const char *name, *help;
} OmCliKey;

// The description of a verb. Groups of verbs (umesh) have neither run nor options.
typedef struct OmCliVerb {
    const char* name;  // the words after "omentum": "umesh predict"
    int (*run)(int argc, char** argv);
    const char *summary, *usage, *about, *example;
    const OmCliOption* option;
    int noption;
    const OmCliKey* key;
    int nkey;
    bool has_own_json;  // prints its object itself
} OmCliVerb;

typedef struct OmCliArgs {
    const OmCliOption* option;
    int noption;
    int argc;
    char** argv;
} OmCliArgs;

// Check every argument of argv[1..] against the table. Returns OM_INVALID with the nearest option in the
// message for an unknown one, or for a number outside of the table's range. Positional arguments are counted into
// npositional.
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
// The same, with the range of the table.
OmStatus om_cli_double(const OmCliArgs* args, const char* name, double* value);
OmStatus om_cli_int(const OmCliArgs* args, const char* name, int* value);

// ---- the table of verbs (cli_table.c) and pages made from it (cli_pages.c)

// The k-th verb or group, sorted by name; null after the last.
const OmCliVerb* om_cli_verb_at(int k);
// The verb or group whose words argv begins with, the longest; `nword` is their number. Null if there is none.
const OmCliVerb* om_cli_find_verb(int argc, char** argv, int* nword);
// The option by either name, of the verb or common to all; null if it has none.
const OmCliOption* om_cli_find_option(const OmCliOption* option, int noption, const char* word,
                                      size_t len);
// The k-th option of a verb, with the common options last; null after them.
const OmCliOption* om_cli_option_at(const OmCliVerb* verb, int k);
void om_cli_print_help(const OmCliVerb* verb);
void om_cli_print_man(void);
// "bash", "zsh" or "fish"; false for another shell.
bool om_cli_print_completion(const char* shell);

// ---- the result for programs, --json (cli_result.c). Without --json the calls do nothing.

// From now on standard output receives only the object; other output goes to standard error.
void om_cli_result_begin(const OmCliVerb* verb);
void om_cli_figure(const char* key, double value);
void om_cli_path(const char* path);      // a file or folder that was written
void om_cli_reason(const char* reason);  // the reason of the outcome
// Print the object; returns the exit code.
int om_cli_result_end(int exit_code);

// Call it before a verb: until the verb takes its listener, Ctrl-C, SIGTERM or SIGHUP end the program with a message.
void om_cli_watch_signals(void);
// A progress listener on stderr that stops the work after Ctrl-C, SIGTERM or SIGHUP. Quiet if `is_quiet`.
const OmProgress* om_cli_progress(bool is_quiet);
void om_cli_progress_done(void);
// For work whose finished parts are whole on disk at any moment: a second after the first signal the program ends, with
// this message and OM_EXIT_CANCELLED, if the work has not returned by then. `seconds` after this call it is as after a
// signal; 0: never. A constant text; null: from now on the work ends by itself.
void om_cli_set_end(const char* message, double seconds);
bool om_cli_is_interrupted(void);
// A second Ctrl-C calls this before it ends the program; only calls that a signal handler may make.
void om_cli_set_restore(void (*restore)(void));

// Print the error message of this thread; returns OM_EXIT_USAGE.
int om_cli_usage(const char* verb);
// Print the error message of this thread and return the exit code that fits the status.
int om_cli_fail(const char* verb, OmStatus status);
// The same for work that the same command continues after a cancellation.
int om_cli_fail_kept(const char* verb, OmStatus status);

// The file beside the output folder `out` that keeps the trials of a plan before an operation, OmPreplanDef.trials:
// "out/plan.trials". Makes the folder that it is in.
OmStatus om_cli_trials_path(const char* out, char* path, size_t size);
// om_cli_fail for work that begins with such a plan: after a cancellation it names the file of the trials.
int om_cli_fail_trials(const char* verb, OmStatus status, const char* trials);

// Remove files that killed runs left beside the output file `path`; null: nothing.
void om_cli_clean_beside(const char* path);

// Is a YAML file a patient model, or a scene?
OmStatus om_cli_is_patient(const char* path, bool* is_patient);

// The command line as text, cut to its size.
void om_cli_command(const OmCliArgs* args, const char* verb, char* out, size_t size);

// Check that everything printed has arrived. Returns the exit code `code`, or OM_EXIT_STDOUT and a message if the
// work was done but standard output failed. This case has its own code because the files are complete.
int om_cli_check_output(int code);

// The inputs of a verb (null entries are skipped) must not lie in its output; null `output`: it writes nothing.
OmStatus om_cli_check_apart(const char* output, const char* const* input, int ninput);

// The argument of --weights, or weights/phantom.safetensors beside the program, if it is there.
OmStatus om_cli_weights_path(const OmCliArgs* args, char* out, size_t size);

// Call it first: it sets how threads of libraries wait. It may restart the program.
void om_cli_set_environment(char** argv);

// The verbs, and the table of each.
extern const OmCliVerb om_cli_verb_banet_eval, om_cli_verb_banet_generate, om_cli_verb_banet_train,
    om_cli_verb_calibrate, om_cli_verb_calibrate_force, om_cli_verb_demo, om_cli_verb_dvrk,
    om_cli_verb_layouts, om_cli_verb_register, om_cli_verb_replay, om_cli_verb_search,
    om_cli_verb_model, om_cli_verb_plan, om_cli_verb_preplan, om_cli_verb_retract,
    om_cli_verb_rl_demo, om_cli_verb_rl_eval, om_cli_verb_rl_play, om_cli_verb_rl_survey,
    om_cli_verb_rl_train, om_cli_verb_study_calibration, om_cli_verb_study_contact,
    om_cli_verb_study_correspondence, om_cli_verb_study_curve, om_cli_verb_study_learning,
    om_cli_verb_study_attachments, om_cli_verb_study_methods, om_cli_verb_study_retraction,
    om_cli_verb_study_sheet, om_cli_verb_study_trust, om_cli_verb_umesh_eval,
    om_cli_verb_umesh_generate, om_cli_verb_umesh_predict, om_cli_verb_umesh_train,
    om_cli_verb_update, om_cli_verb_view;
int om_cli_banet_eval(int argc, char** argv);
int om_cli_banet_generate(int argc, char** argv);
int om_cli_banet_train(int argc, char** argv);
int om_cli_calibrate(int argc, char** argv);
int om_cli_calibrate_force(int argc, char** argv);
int om_cli_layouts(int argc, char** argv);
int om_cli_replay(int argc, char** argv);
int om_cli_search(int argc, char** argv);
int om_cli_model(int argc, char** argv);
int om_cli_plan(int argc, char** argv);
int om_cli_preplan(int argc, char** argv);
int om_cli_retract(int argc, char** argv);
int om_cli_rl_demo(int argc, char** argv);
int om_cli_rl_eval(int argc, char** argv);
int om_cli_rl_play(int argc, char** argv);
int om_cli_rl_survey(int argc, char** argv);
int om_cli_rl_train(int argc, char** argv);
int om_cli_demo(int argc, char** argv);
int om_cli_study_contact(int argc, char** argv);
int om_cli_study_calibration(int argc, char** argv);
int om_cli_study_retraction(int argc, char** argv);
int om_cli_study_sheet(int argc, char** argv);
int om_cli_study_trust(int argc, char** argv);
int om_cli_study_correspondence(int argc, char** argv);
int om_cli_study_curve(int argc, char** argv);
int om_cli_study_attachments(int argc, char** argv);
int om_cli_study_learning(int argc, char** argv);
int om_cli_study_methods(int argc, char** argv);
int om_cli_umesh_generate(int argc, char** argv);
int om_cli_umesh_train(int argc, char** argv);
int om_cli_umesh_eval(int argc, char** argv);
int om_cli_umesh_predict(int argc, char** argv);
int om_cli_update(int argc, char** argv);

#endif
