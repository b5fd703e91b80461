// cli_network.c: what the command lines of omentum banet and omentum umesh share.
#include "cli_network.h"

OmStatus om_cli_read_generate(const OmCliArgs* args, const OmCliGenerate* g) {
    const char* law = om_cli_get(args, "--law");
    int seed = (int)*g->seed;
    OM_TRY(om_cli_int(args, "--samples", g->nsample));
    OM_TRY(om_cli_int(args, "--seed", &seed));
    OM_TRY(om_cli_int(args, "--shard", g->shard));
    OM_TRY(om_cli_int(args, "--workers", g->nworker));
    *g->seed = (uint64_t)seed;
    return law ? om_law_find(law, g->law) : OM_OK;
}

OmStatus om_cli_read_train(const OmCliArgs* args, const char* verb, OmCliTrain* t) {
    int seed = (int)*t->seed;
    OM_TRY(om_cli_get_int(args, "--validation", 1, t->ndata, t->nvalid));
    OM_TRY(om_cli_int(args, "--epochs", t->nepoch));
    OM_TRY(om_cli_int(args, "--batch", t->batch));
    OM_TRY(om_cli_double(args, "--rate", t->rate));
    OM_TRY(om_cli_int(args, "--seed", &seed));
    OM_TRY(om_cli_int(args, "--workers", t->nworker));
    *t->seed = (uint64_t)seed;
    om_cli_command(args, verb, t->command, sizeof t->command);
    return OM_OK;
}

int om_cli_begin_train(const OmCliArgs* args, const char* room, int* nsample) {
    const char *data = om_cli_get(args, "--data"), *output = om_cli_get(args, "--output");
    int npositional;
    OmStatus status = om_cli_check(args, 0, &npositional);
    if (status >= 0) status = om_cli_int(args, "--samples", nsample);
    if (status >= 0 && !(data && output))
        status = om_error(
            OM_INVALID, "give the folder of samples (-d DATA) and the folder of weights (-o DIR)");
    if (status < 0) return om_cli_usage(room);
    status = om_cli_check_apart(output, &data, 1);
    return status < 0 ? om_cli_fail(room, status) : OM_EXIT_OK;
}

int om_cli_begin_eval(const OmCliArgs* args, const char* room, int* nsample, int* nworker) {
    int npositional;
    OmStatus status = om_cli_check(args, 0, &npositional);
    if (status >= 0) status = om_cli_int(args, "--samples", nsample);
    if (status >= 0) status = om_cli_int(args, "--workers", nworker);
    if (status >= 0 && !om_cli_get(args, "--data"))
        status = om_error(OM_INVALID, "give the samples (-d DATA); omentum %s generate makes them",
                          room);
    return status < 0 ? om_cli_usage(room) : OM_EXIT_OK;
}

OmStatus om_cli_eval_folder(const char* dir, const char* kind, bool is_done, OmFolder* folder) {
    if (!dir || folder->path[0]) return OM_OK;
    return is_done || om_path_exists(dir) ? om_folder_open(dir, kind, folder)
                                          : om_folder_check(dir, kind);
}
