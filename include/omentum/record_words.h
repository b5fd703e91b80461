/// omentum/record_words.h: what the loop decides, in a surgeon's words (floor 10).
///
/// Each function appends one or two plain sentences to a text: why this point, why this stop, what changed in the
/// robot's model. They are for listeners of a loop, whose arguments they take; the audit and the report print them.
///
///     OmText t = {0};
///     om_words_plan(loop, situation, plan, &t);   // in OmLoopListener.on_plan
///     puts(t.str);  // "PSM1 grasps point (2,1), 21 mm from the region of interest and 48 mm from the nearest ..."
///     om_text_done(&t);
///
/// Points are the blocks of the grid, counted from 1; the first number grows away from the endoscope, the second from
/// PSM1 to PSM2.
#ifndef OMENTUM_RECORD_WORDS_H
#define OMENTUM_RECORD_WORDS_H

#include "omentum/loop.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Why this plan: its grasping point, its distances, and how many points were ruled out and for which reason.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_words_plan(const OmLoop* loop, const OmSituation* situation, const OmPlan* plan,
                              OmText* text);
/// How an action ended, and why it stopped.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_words_action(const OmLoop* loop, const OmRetractAction* action, OmText* text);
/// What an acquisition or an estimate changed in the robot's model: points that are attached now and were not.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_words_update(const OmLoop* loop, const OmUpdateEvent* event, OmText* text);
/// What the arms have learnt of the force: a factor on the model's forces (OmBeliefRecord.force_factor). Begins with a
/// blank.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_words_force(double factor, OmText* text);
/// What a person demanded.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_words_command(const OmLoop* loop, const OmLoopCommand* command, OmText* text);
/// What the camera found, and what the robot does in this warning state (Alg. 5).
/// @param was  the state before
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_words_warning(const OmLoop* loop, int was, const OmMonitorFrame* frame,
                                 OmText* text);
/// Why the robot waits for a person.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_words_hold(OmHold hold, const char* reason, OmText* text);
/// How the operation ended.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_words_end(const OmRetractResult* result, OmText* text);

#ifdef __cplusplus
}
#endif
#endif
