// loop_notify.c: calls of the loop's listeners, in their order; an error of one ends the calls.
#include "loop/loop_state.h"

#define NOTIFY(loop, function, ...)                                             \
    do {                                                                        \
        for (int i_ = 0; i_ < (loop)->nlistener; ++i_) {                        \
            const OmLoopListener* l_ = &(loop)->listener[i_];                   \
            if (l_->function) OM_TRY(l_->function(l_->ctx, loop, __VA_ARGS__)); \
        }                                                                       \
    } while (0)

OmStatus om__loop_notify_begin(OmLoop* loop) {
    if (loop->has_begun) return OM_OK;
    loop->has_begun = true;
    for (int i = 0; i < loop->nlistener; ++i) {
        const OmLoopListener* l = &loop->listener[i];
        if (l->on_begin) OM_TRY(l->on_begin(l->ctx, loop));
    }
    return OM_OK;
}

OmStatus om__loop_notify_tick(const OmLoop* loop) {
    OmRetractSample now = om__loop_sample(loop);
    NOTIFY(loop, on_tick, &now);
    return OM_OK;
}

OmStatus om__loop_notify_plan(const OmLoop* loop) {
    NOTIFY(loop, on_plan, &loop->belief.situation, &loop->plan);
    return OM_OK;
}

OmStatus om__loop_notify_action_begin(const OmLoop* loop) {
    NOTIFY(loop, on_action_begin, &loop->plan.action[loop->action_index]);
    return OM_OK;
}

OmStatus om__loop_notify_action_end(const OmLoop* loop) {
    NOTIFY(loop, on_action_end, &loop->result.action[loop->result.naction - 1]);
    return OM_OK;
}

OmStatus om__loop_notify_update(const OmLoop* loop, const OmUpdateEvent* event) {
    NOTIFY(loop, on_update, event);
    return OM_OK;
}

OmStatus om__loop_notify_command(const OmLoop* loop, const OmLoopCommand* command) {
    NOTIFY(loop, on_command, command);
    return OM_OK;
}

OmStatus om__loop_notify_warning(const OmLoop* loop, int was) {
    NOTIFY(loop, on_warning, was, &loop->belief.frame);
    return OM_OK;
}

OmStatus om__loop_notify_hold(const OmLoop* loop, OmHold hold, const char* reason) {
    NOTIFY(loop, on_hold, hold, reason);
    return OM_OK;
}

OmStatus om__loop_notify_end(const OmLoop* loop) {
    NOTIFY(loop, on_end, &loop->result);
    return OM_OK;
}
