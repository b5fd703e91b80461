// retract_watch.h: a run for programs that watch by OpenIGTLink, as omentum dvrk --igtl.
#ifndef OMENTUM_RETRACT_WATCH_H
#define OMENTUM_RETRACT_WATCH_H

#include "omentum/loop.h"

typedef struct RunWatch RunWatch;

// The tissue is that of the world, or the twin of a world without a truth. All are borrowed.
OmStatus om__run_watch_create(int port, const OmScene* scene, OmWorld* world, OmBody* twin,
                              RunWatch** watch);
void om__run_watch_destroy(RunWatch* watch);
OmLoopListener om__run_watch_listener(RunWatch* watch);

#endif
