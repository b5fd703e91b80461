// cli_rl.h: shared by the verbs of omentum rl.
#ifndef OMENTUM_CLI_RL_H
#define OMENTUM_CLI_RL_H

#include "cli_common.h"
#include "omentum/rl.h"

#define OM_CLI_RL_TASK                                                                   \
    {"--task", "-t", "NAME", "task: cart-pole, reach, retract, ..; list prints them"}, { \
        "--set", "-s", "KEY=VALUE", "a setting of the task; may be repeated"             \
    }

enum { OM_CLI_RL_OPTION = 48, OM_CLI_RL_SETTING = 32, OM_CLI_RL_TEXT = 256 };

// A command line that begins with the settings of a file. Later words are stronger.
typedef struct OmCliRlWords {
    char text[OM_CLI_RL_OPTION][OM_CLI_RL_TEXT];  // of each option in the file
    int nsetting;
    struct {
        char key[64], value[OM_CLI_RL_TEXT];
    } setting[OM_CLI_RL_SETTING];
    char word[OM_CLI_RL_OPTION + OM_CLI_RL_SETTING][2 * OM_CLI_RL_TEXT];
    char* argv[OM_CLI_RL_OPTION + OM_CLI_RL_SETTING + 256];
} OmCliRlWords;

// If --config FILE is given: put the options of the file before those of the command line, into args. The file is YAML:
// names of options without dashes, and `set`, a list of key and value.
OmStatus om_cli_rl_config(OmCliArgs* args, OmCliRlWords* words);
// Create the task of --task with the settings of --set.
OmStatus om_cli_rl_task(const OmCliArgs* args, OmRlTask** task);
// Print the names of all tasks.
void om_cli_rl_list(void);

#endif
