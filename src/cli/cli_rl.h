// cli_rl.h: shared by the verbs of omentum rl.
#ifndef OMENTUM_CLI_RL_H
#define OMENTUM_CLI_RL_H

#include "cli_common.h"
#include "omentum/rl.h"
#include "omentum/rl_policy.h"

#define OM_CLI_RL_TASK                                                                   \
    {"--task", "-t", "NAME", "task: cart-pole, reach, retract, ..; list prints them"}, { \
        "--set", "-s", "KEY=VALUE", "a setting of the task; may be repeated"             \
    }

enum { OM_CLI_RL_OPTION = 48, OM_CLI_RL_SETTING = 32, OM_CLI_RL_TEXT = 256 };

typedef struct OmCliRlSetting {
    char key[64], value[OM_CLI_RL_TEXT];
} OmCliRlSetting;

// A command line that begins with the settings of a file. Later words are stronger.
typedef struct OmCliRlWords {
    char text[OM_CLI_RL_OPTION][OM_CLI_RL_TEXT];  // of each option in the file
    int nsetting, neval_setting;
    OmCliRlSetting setting[OM_CLI_RL_SETTING], eval_setting[OM_CLI_RL_SETTING];
    char word[OM_CLI_RL_OPTION + 2 * OM_CLI_RL_SETTING][2 * OM_CLI_RL_TEXT];
    char* argv[OM_CLI_RL_OPTION + 2 * OM_CLI_RL_SETTING + 256];
} OmCliRlWords;

// If --config FILE is given: put the options of the file before those of the command line, into args. The file is YAML:
// names of options without dashes, and `set` and `eval-set`, lists of key and value.
OmStatus om_cli_rl_config(OmCliArgs* args, OmCliRlWords* words);
// Create the task of --task with the settings of --set.
OmStatus om_cli_rl_task(const OmCliArgs* args, OmRlTask** task);
// The same for a policy of `file`: task and settings that are not given are the policy's. A line names settings that
// differ from its training, or says that it does not state them.
OmStatus om_cli_rl_policy_task(const OmCliArgs* args, const OmRlPolicy* policy, const char* file,
                               OmRlTask** task);
// The same as om_cli_rl_task with more settings of the option `more` behind them; *task is null if there are none.
OmStatus om_cli_rl_more(const OmCliArgs* args, const char* more, OmRlTask** task);
// Print the names of all tasks.
void om_cli_rl_list(void);

#endif
