// cli_model.h: what the files of omentum model share.
#ifndef OMENTUM_CLI_MODEL_H
#define OMENTUM_CLI_MODEL_H

#include "cli_common.h"
#include "omentum/scene_model.h"

// Print what the input of the def holds: its labels or segments. Returns the exit code.
int om_cli_model_list(const OmModelDef* def, bool is_quiet);

#endif
