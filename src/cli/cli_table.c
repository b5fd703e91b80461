// cli_table.c: all verbs and groups of verbs.
#include <string.h>

#include "cli_common.h"

static const OmCliVerb banet = {
    .name = "banet",
    .summary = "estimate where tissue is attached by a network: data, training, evaluation",
    .usage = "omentum banet STEP [options]",
    .about =
        "Finite elements pull random sheets of fat with random attachments, and a network is trained to\n"
        "find the attachments from the displacement of the visible part of the surface (thesis, chapter 4).",
};

static const OmCliVerb umesh = {
    .name = "umesh",
    .summary =
        "predict an organ's deformation by a network: data, training, prediction, evaluation",
    .usage = "omentum umesh STEP [options]",
    .about =
        "Finite elements compute samples of an organ's deformations, and a network is trained on them. It\n"
        "predicts the deformation under a probe in milliseconds and is evaluated on samples that it was not\n"
        "trained on. A prediction can be refined to equilibrium, and it reports whether its input is\n"
        "outside the range of the training. Networks are written as safetensors and ONNX.",
};

static const OmCliVerb rl = {
    .name = "rl",
    .summary = "learn a task by trial and from demonstrations: training, evaluation",
    .usage = "omentum rl STEP [options]",
    .about =
        "A policy learns a task in many simulated environments side by side: by rewards (PPO), by rewards and\n"
        "demonstrations (GAIL), or by demonstrations alone (thesis, chapter 5).",
};

static const OmCliVerb study = {
    .name = "study",
    .summary = "repeat an experiment of the thesis, with its tables and figures",
    .usage = "omentum study NAME -o DIR [options]",
    .about =
        "Each study writes a report and its figures as JSON and CSV. After an interruption the same command\n"
        "continues it.",
};

static const OmCliVerb* const table[] = {
    &banet,
    &om_cli_verb_banet_eval,
    &om_cli_verb_banet_generate,
    &om_cli_verb_banet_train,
    &om_cli_verb_calibrate,
    &om_cli_verb_calibrate_force,
    &om_cli_verb_demo,
    &om_cli_verb_dvrk,
    &om_cli_verb_layouts,
    &om_cli_verb_model,
    &om_cli_verb_plan,
    &om_cli_verb_preplan,
    &om_cli_verb_register,
    &om_cli_verb_replay,
    &om_cli_verb_retract,
    &rl,
    &om_cli_verb_rl_demo,
    &om_cli_verb_rl_eval,
    &om_cli_verb_rl_play,
    &om_cli_verb_rl_survey,
    &om_cli_verb_rl_train,
    &om_cli_verb_search,
    &study,
    &om_cli_verb_study_attachments,
    &om_cli_verb_study_calibration,
    &om_cli_verb_study_contact,
    &om_cli_verb_study_correspondence,
    &om_cli_verb_study_curve,
    &om_cli_verb_study_learning,
    &om_cli_verb_study_methods,
    &om_cli_verb_study_retraction,
    &om_cli_verb_study_sheet,
    &om_cli_verb_study_trust,
    &umesh,
    &om_cli_verb_umesh_eval,
    &om_cli_verb_umesh_generate,
    &om_cli_verb_umesh_predict,
    &om_cli_verb_umesh_train,
    &om_cli_verb_update,
    &om_cli_verb_view,
};
enum { NVERB = sizeof table / sizeof *table };

static const OmCliOption common[] = {
    {"--json", NULL, NULL,
     "print the result as one JSON object on standard output, text for people on standard error"},
    {"--help", "-h", NULL, "this text"},
};
enum { NCOMMON = sizeof common / sizeof *common };

const OmCliVerb* om_cli_verb_at(int k) { return k < NVERB ? table[k] : NULL; }

// The number of words of a verb's name that argv begins with; 0 if argv begins with another one.
static int count_words(const char* name, int argc, char** argv) {
    int n = 0;
    while (*name) {
        size_t len = strcspn(name, " ");
        if (n == argc || strlen(argv[n]) != len || strncmp(argv[n], name, len) != 0) return 0;
        name += len + (name[len] == ' ');
        ++n;
    }
    return n;
}

const OmCliVerb* om_cli_find_verb(int argc, char** argv, int* nword) {
    const OmCliVerb* found = NULL;
    *nword = 0;
    for (int k = 0; k < NVERB; ++k) {
        int n = count_words(table[k]->name, argc, argv);
        if (n > *nword) found = table[k], *nword = n;
    }
    return found;
}

static bool is_name(const char* name, const char* word, size_t len) {
    return name && strlen(name) == len && strncmp(name, word, len) == 0;
}

const OmCliOption* om_cli_find_option(const OmCliOption* option, int noption, const char* word,
                                      size_t len) {
    for (int i = 0; i < noption + NCOMMON; ++i) {
        const OmCliOption* o = i < noption ? &option[i] : &common[i - noption];
        if (is_name(o->name, word, len) || is_name(o->alias, word, len)) return o;
    }
    return NULL;
}

const OmCliOption* om_cli_option_at(const OmCliVerb* verb, int k) {
    int seen = 0;
    for (int i = 0; i < verb->noption + NCOMMON; ++i) {
        bool is_own = i < verb->noption;
        const OmCliOption* o = is_own ? &verb->option[i] : &common[i - verb->noption];
        bool is_first = om_cli_find_option(verb->option, verb->noption, o->name,
                                           strlen(o->name)) == o;  // plan has a --json of its own
        if (is_first && seen++ == k) return o;
    }
    return NULL;
}
