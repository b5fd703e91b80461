// cli_network.h: shared by generate, train and eval of omentum banet and omentum umesh.
#ifndef OM_CLI_NETWORK_H
#define OM_CLI_NETWORK_H

#include "cli_common.h"
#include "omentum/tissue_material.h"

// Rows of the tables of options.
// clang-format off
#define OM_CLI_GENERATE(number) \
    {"--output", "-o", "DIR", "folder of the data set; finished samples there are kept"}, \
    {"--samples", "-n", "N", "how many", number, NULL, 1, 10000000}, \
    {"--seed", NULL, "N", "sample i depends on seed and i only", "1", NULL, 0, 2147483647}, \
    {"--law", NULL, "NAME", "law of elasticity", "neo-hookean; the thesis's: st-venant-kirchhoff"}, \
    {"--workers", NULL, "N", "threads", "one per processor", NULL, 0, OM_MAX_WORKER}, \
    {"--quiet", "-q", NULL, "no progress"}
#define OM_CLI_TRAIN(room, epochs, batch, rate) \
    {"--data", "-d", "DIR", "samples of omentum " room " generate"}, \
    {"--output", "-o", "DIR", "weights, report, and the checkpoint from which training continues"}, \
    {"--validation", NULL, "N", "the last N of these are for validation", "a tenth"}, \
    {"--epochs", NULL, "N", "epochs", epochs, NULL, 1, 1000000}, \
    {"--batch", NULL, "N", "samples a step", batch, NULL, 1, 1024}, \
    {"--rate", NULL, "R", "peak learning rate", rate, NULL, 1e-8, 1}, \
    {"--seed", NULL, "N", "seed of the weights and the order of samples", "1", NULL, 0, 2147483647}, \
    {"--quiet", "-q", NULL, "no progress"}
#define OM_CLI_EVAL \
    {"--data", "-d", "DIR", "samples that were not used for training (another seed)"}, \
    {"--samples", NULL, "N", "number of samples, from the first", "all", NULL, 1, 100000000}, \
    {"--workers", NULL, "N", "threads", "one a processor", NULL, 0, OM_MAX_WORKER}
// clang-format on

// Fields of a definition, which keep their values where an option is not given.
typedef struct OmCliGenerate {
    int *nsample, *shard, *nworker;
    uint64_t* seed;
    OmLaw* law;
} OmCliGenerate;
OmStatus om_cli_read_generate(const OmCliArgs* args, const OmCliGenerate* g);

typedef struct OmCliTrain {
    int ndata;  // samples in the folder
    int *nvalid, *nepoch, *batch, *nworker;
    double* rate;
    uint64_t* seed;
    char command[512];  // out: the command line, for the metadata of the weights
} OmCliTrain;
OmStatus om_cli_read_train(const OmCliArgs* args, const char* verb, OmCliTrain* t);
// Check a command line of train, and that its folders are apart. Returns OM_EXIT_OK, or another code after a message.
int om_cli_begin_train(const OmCliArgs* args, const char* room, int* nsample);
// The same of eval.
int om_cli_begin_eval(const OmCliArgs* args, const char* room, int* nsample, int* nworker);
// The folder of an evaluation, null: none; call it before and after the work. An old folder may grow, a new one is made
// when there are results.
OmStatus om_cli_eval_folder(const char* dir, const char* kind, bool is_done, OmFolder* folder);

#endif
