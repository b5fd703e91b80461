// retract_rig.h: a task "retract" and a state of it, for its tests.
#ifndef OMENTUM_TEST_RL_RETRACT_RIG_H
#define OMENTUM_TEST_RL_RETRACT_RIG_H

#include "omentum/rl_retract.h"
#include "rl/rl_retract_internal.h"
#include "test_common.h"

static inline OmRlTask* make(const OmRlSetting* setting, int n) {
    OmRlTask* task;
    assert_ok(om_rl_task_create("retract", setting, n, &task));
    return task;
}

static inline OmRlRetractState* make_state(const OmRlTask* task) {
    void* state;
    assert_ok(task->ops->state_create(task, &state));
    return state;
}

#endif
