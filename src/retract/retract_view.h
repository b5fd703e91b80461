// retract_view.h: a run as messages to the pages of a server.
#ifndef OMENTUM_RETRACT_VIEW_H
#define OMENTUM_RETRACT_VIEW_H

#include "omentum/loop.h"
#include "omentum/view_server.h"

typedef struct RunView RunView;

// All are borrowed. `shown`: the truth, or the twin of a world without one.
OmStatus om__run_view_create(OmViewServer* server, const OmScene* scene, OmWorld* world,
                             OmBody* twin, OmPlanner* planner, RunView** view);
void om__run_view_destroy(RunView* view);
// Listeners of the loop, in this order. @return 2
int om__run_view_listeners(RunView* view, OmLoopListener listener[2]);

#endif
