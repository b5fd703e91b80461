// cli_view.h: what the page does with a scene, for omentum view.
#ifndef OM_CLI_VIEW_H
#define OM_CLI_VIEW_H

#include "cli_retract.h"
#include "omentum/view_server.h"

// A hand in the simulation: grasp, pull, press, pause, step, reset, material, until the user ends the program. `path`:
// the file of the scene, the mesh or the patient, which is read again when it changes.
OmStatus om_cli_view_free(OmCliRetract* s, OmViewServer* server, const char* path);
// Tissue without a scene: of a tetrahedral mesh or a patient model it makes a scene, and has_scene. `path` receives the
// file that is watched. Of other files, such as a scene's, nothing is changed.
OmStatus om_cli_view_load(const OmCliArgs* args, OmCliRetract* s, char* path, size_t size);
// A run of the loop, supervised by the page.
int om_cli_view_run(OmCliRetract* s, OmViewServer* server);
// Say a sentence on every page. `is_error`: what was asked is not done.
OmStatus om_cli_view_say(OmViewServer* server, const char* words, bool is_error);
// Sleep until the wall clock shows `origin` + `time`.
void om_cli_view_wait(double origin, double time);

#endif
