// cli_acting.h: reaches and pulls of `omentum retract` by a trained policy.
#ifndef OM_CLI_ACTING_H
#define OM_CLI_ACTING_H

#include "omentum/defras_loop.h"
#include "omentum/rl_policy.h"

typedef struct OmCliActing {
    OmRlPolicy* policy;
    OmRlActor* actor;
    OmVec3 corner;  // of the policy's box in this motion, m
    double side;    // of it, m
} OmCliActing;

// Load a policy of the task "approach".
OmStatus om_cli_acting_load(const char* path, OmCliActing* acting);
void om_cli_acting_done(OmCliActing* acting);
// The motion law; `acting` is borrowed.
OmMotionLaw om_cli_acting_law(OmCliActing* acting);

#endif
