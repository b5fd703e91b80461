// cli_rl.c: tasks of omentum rl from the command line.
#include "cli_rl.h"

#include <string.h>

enum { MAX_SETTING = 64, KEY = 64 };

OmStatus om_cli_rl_task(const OmCliArgs* args, OmRlTask** task) {
    OmRlSetting setting[MAX_SETTING];
    char key[MAX_SETTING][KEY];
    const char *word, *name = om_cli_get(args, "--task");
    int n = 0;
    *task = NULL;
    OM_CHECK(name, OM_INVALID, "name the task (-t NAME); -t list prints the names");
    for (; (word = om_cli_get_nth(args, "--set", n)) != NULL; ++n) {
        const char* equal = strchr(word, '=');
        OM_CHECK(n < MAX_SETTING, OM_INVALID, "more than %d settings", MAX_SETTING);
        OM_CHECK(equal && equal > word && equal - word < KEY, OM_INVALID,
                 "--set %s: write KEY=VALUE", word);
        snprintf(key[n], KEY, "%.*s", (int)(equal - word), word);
        setting[n] = (OmRlSetting){key[n], equal + 1};
    }
    return om_rl_task_create(name, setting, n, task);
}

void om_cli_rl_list(void) {
    const OmRlTaskKind* kind;
    for (int i = 0; (kind = om_rl_task_kind(i)) != NULL; ++i)
        printf("%-12s %s\n", kind->name, kind->about);
}
