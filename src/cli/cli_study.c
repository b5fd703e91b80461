// cli_study.c: what the command lines of the studies share.
#include <string.h>

#include "cli_study.h"

const OmProgress* om_cli_study_begin(const OmCliArgs* args) {
    double minutes = 0;
    (void)om_cli_double(args, "--minutes", &minutes);  // om_cli_check has read it
    om_cli_set_end("omentum study: cancelled; the same command continues from here\n",
                   60 * minutes);
    return om_cli_progress(om_cli_get(args, "--quiet") != NULL);
}

OmStatus om_cli_study_draw(const OmCliArgs* args, OmStudyDraw* draw, char* table, size_t size,
                           const char** draws) {
    const char *word = om_cli_get(args, "--seed"), *file = om_cli_get(args, "--draws");
    const bool is_judged = word && strcmp(word, "development") != 0;
    char root[1024];
    int number = 1;
    *draws = NULL;
    OM_CHECK(
        is_judged || !(om_cli_get(args, "--draw") || file), OM_INVALID,
        "--draw and --draws are of cases that are drawn: give --seed here, a commit or a hash, too");
    OM_TRY(om_cli_int(args, "--draw", &number));
    if (!word) return OM_OK;
    if (!is_judged) return om_study_draw_read(word, number, NULL, draw);
    OM_TRY(om_study_draw_root(root, sizeof root));
    OM_TRY(om_study_draw_read(word, number, root, draw));
    OM_TRY(om_study_draw_table(file, root, table, size));
    *draws = table;
    return OM_OK;
}
