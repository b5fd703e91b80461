// cli_study.c: what the command lines of the studies share.
#include "cli_study.h"

const OmProgress* om_cli_study_begin(const OmCliArgs* args) {
    double minutes = 0;
    (void)om_cli_double(args, "--minutes", &minutes);  // om_cli_check has read it
    om_cli_set_end("omentum study: cancelled; the same command continues from here\n",
                   60 * minutes);
    return om_cli_progress(om_cli_get(args, "--quiet") != NULL);
}
