// cli_study.h: shared by the studies' command lines.
#ifndef OM_CLI_STUDY_H
#define OM_CLI_STUDY_H

#include "cli_common.h"
#include "studies/study_draw.h"

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

// Before any work, --seed, --draw and --draws of a study whose cases are drawn: the draw, and of a judged one the table
// for its result, whose path is written to `table`; `draws` is null otherwise. Without --seed the draw does not change.
OmStatus om_cli_study_draw(const OmCliArgs* args, OmStudyDraw* draw, char* table, size_t size,
                           const char** draws);

#endif
