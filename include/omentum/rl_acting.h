/// omentum/rl_acting.h: motions of a real or simulated arm by a policy of the task "approach" (floor 7).
///
/// Such a policy has learnt motions in a cube of side 1. An acting gives each motion a box of the operating field:
/// of a reach 0.2 m or one and a half times its longest side, with the goal at 0.3 of its height, so that the policy
/// keeps 25 mm above the tissue until it is near the goal; of a pull four times its length. Each action moves the tip
/// by OM_RL_ACTING_STEP of the box. Within a step and a half of the goal the rest is straight.
///
///     OmRlActing* acting;
///     om_rl_acting_load("weights/approach.safetensors", &acting);
///     om_rl_acting_next(acting, true, true, tip, goal, &place);  // the first place of a reach
///     while (...) om_rl_acting_next(acting, true, false, tip, goal, &place);
#ifndef OMENTUM_RL_ACTING_H
#define OMENTUM_RL_ACTING_H

#include "omentum/base.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_RL_ACTING_STEP 0.02  // share of the box, as the task has it by default

typedef struct OmRlActing OmRlActing;

/// @return OM_OK; OM_IO; OM_INVALID (not a policy of the task "approach"); OM_NO_MEMORY
OM_API OmStatus om_rl_acting_load(const char* path, OmRlActing** acting);
OM_API void om_rl_acting_destroy(OmRlActing* acting);
/// The next place of the tip. Positions in m, z up.
/// @param is_reach  true: the tool is free, false: it pulls tissue
/// @param is_first  a new motion begins: its box is chosen
/// @param place     the goal itself: the rest of the way is straight
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_rl_acting_next(OmRlActing* acting, bool is_reach, bool is_first, OmVec3 tip,
                                  OmVec3 goal, OmVec3* place);
/// Side of the box of the present motion, m.
OM_API double om_rl_acting_side(const OmRlActing* acting);

#ifdef __cplusplus
}
#endif
#endif
