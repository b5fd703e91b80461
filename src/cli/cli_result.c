// cli_result.c: --json: one object on standard output, independent of the text that a verb prints for people.
//
//     {"program": "omentum", "version": "0.2.0", "verb": "model", "outcome": "done", "exit_code": 0,
//      "message": "", "figures": {"tetrahedra": 1234, ...}, "paths": ["out/liver"]}
//
// The outcome follows the exit code. The message is the error, or the reason of the outcome. Keys of figures are those
// of the verb's table.
#include <string.h>
#include <unistd.h>

#include "cli_common.h"

#define MOST_FIGURES 128
#define MOST_PATHS 16

static const OmCliVerb* verb;  // null without --json
static int output = -1;        // the caller's standard output
static char reason[1024], path[MOST_PATHS][1024];
static struct {
    char key[128];
    double value;
} figure[MOST_FIGURES];
static int nfigure, npath;

void om_cli_result_begin(const OmCliVerb* which) {
    fflush(stdout);
    output = dup(STDOUT_FILENO);
    if (output < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) return;
    verb = which;
}

static bool is_key(const char* name) {
    for (int k = 0; k < verb->nkey; ++k) {
        const char* key = verb->key[k].name;
        size_t n = strlen(key);
        if (strcmp(key, name) == 0) return true;
        if (n > 1 && key[n - 1] == '*' && strncmp(key, name, n - 1) == 0) return true;
    }
    return false;
}

void om_cli_figure(const char* key, double value) {
    if (!verb || !is_key(key) || nfigure == MOST_FIGURES) return;
    snprintf(figure[nfigure].key, sizeof figure[nfigure].key, "%s", key);
    figure[nfigure++].value = value;
}

void om_cli_path(const char* name) {
    if (verb && npath < MOST_PATHS) snprintf(path[npath++], sizeof path[0], "%s", name);
}

void om_cli_reason(const char* why) { snprintf(reason, sizeof reason, "%s", why); }

static const char* outcome_of(int exit_code) {
    switch (exit_code) {
    case OM_EXIT_OK: return "done";
    case OM_EXIT_FAILED: return "negative";
    case OM_EXIT_USAGE: return "wrong command line";
    case OM_EXIT_CANCELLED: return "cancelled";
    default: return "failed";
    }
}

static OmStatus write_result(int exit_code, OmText* text) {
    OmJson j = om_json_begin(text);
    om_json_open(&j, NULL, '{');
    om_json_string(&j, "program", "omentum");
    om_json_string(&j, "version", om_version());
    om_json_string(&j, "verb", verb->name);
    om_json_string(&j, "outcome", outcome_of(exit_code));
    om_json_integer(&j, "exit_code", exit_code);
    om_json_string(&j, "message", exit_code >= OM_EXIT_USAGE ? om_error_message() : reason);
    om_json_open(&j, "figures", '{');
    for (int k = 0; k < nfigure; ++k) om_json_number(&j, figure[k].key, figure[k].value);
    om_json_close(&j, '}');
    om_json_open(&j, "paths", '[');
    for (int k = 0; k < npath; ++k) om_json_string(&j, NULL, path[k]);
    om_json_close(&j, ']');
    om_json_close(&j, '}');
    return om_json_end(&j);
}

int om_cli_result_end(int exit_code) {
    if (!verb) return exit_code;
    OmText text = {0};
    fflush(stdout);
    (void)dup2(output, STDOUT_FILENO);
    close(output);
    if (write_result(exit_code, &text) == OM_OK) fputs(text.str, stdout);
    om_text_done(&text);
    verb = NULL;
    return exit_code;
}
