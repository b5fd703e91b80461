// cli_study.h: shared by the studies' command lines.
#ifndef OM_CLI_STUDY_H
#define OM_CLI_STUDY_H

#include "cli_common.h"

// The last rows of a study's table of options.
// clang-format off
#define OM_CLI_STUDY_OPTIONS \
    {"--minutes", NULL, "N", "end after N minutes; the same command continues", "no limit", NULL, 0.001, 10000}, \
    {"--workers", NULL, "N", "threads", "one per processor", NULL, 0, OM_MAX_WORKER}, \
    {"--quiet", "-q", NULL, "no progress"}
// clang-format on

// The progress of a study, which prints its estimate, and its end: Ctrl-C, SIGTERM, SIGHUP and --minutes end the study,
// and after a second more the program, whatever it computes then. Finished results are whole on disk at any moment.
const OmProgress* om_cli_study_begin(const OmCliArgs* args);

#endif
