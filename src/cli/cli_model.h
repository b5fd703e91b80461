// cli_model.h: shared by the files of omentum model.
#ifndef OMENTUM_CLI_MODEL_H
#define OMENTUM_CLI_MODEL_H

#include "cli_common.h"
#include "omentum/scene_model.h"

// Print the contents of the definition's input: its labels or segments. Returns the exit code.
int om_cli_model_list(const OmModelDef* def, bool is_quiet);
// Print the notes and warnings of a report, a line each.
void om_cli_model_notes(const OmModelReport* report);

#endif
