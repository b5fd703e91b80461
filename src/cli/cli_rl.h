// cli_rl.h: shared by the verbs of omentum rl.
#ifndef OMENTUM_CLI_RL_H
#define OMENTUM_CLI_RL_H

#include "cli_common.h"
#include "omentum/rl.h"

#define OM_CLI_RL_TASK                                                                   \
    {"--task", "-t", "NAME", "task: cart-pole, reach, retract, ..; list prints them"}, { \
        "--set", "-s", "KEY=VALUE", "a setting of the task; may be repeated"             \
    }

// Create the task of --task with the settings of --set.
OmStatus om_cli_rl_task(const OmCliArgs* args, OmRlTask** task);
// Print the names of all tasks.
void om_cli_rl_list(void);

#endif
