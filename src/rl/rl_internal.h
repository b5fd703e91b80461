// rl_internal.h: what the files of room rl have in common.
#ifndef OM_RL_INTERNAL_H
#define OM_RL_INTERNAL_H

#include "omentum/rl.h"

// Kinds of tasks, each in its own file.
OmStatus om__rl_cart_pole_create(const OmRlSetting* setting, int nsetting, OmRlTask** task);
OmStatus om__rl_reach_create(const OmRlSetting* setting, int nsetting, OmRlTask** task);

// Read a setting as a number from lo to hi.
OmStatus om__rl_setting_number(const char* task, const OmRlSetting* setting, double lo, double hi,
                               double* value);
// The error of a key that the task does not have; `known` ends with null.
OmStatus om__rl_setting_unknown(const char* task, const OmRlSetting* setting,
                                const char* const* known);

#endif
