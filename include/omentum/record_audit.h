/// omentum/record_audit.h: a listener of the loop that writes down what was decided, and from what (floor 10).
///
/// One line of JSON for each decision, complete in itself and flushed at once: a run that is killed leaves all lines up
/// to then. It has times of the operation and no times of the computer, so that a replay of the same observations
/// writes the same bytes. Nothing in it comes from the truth of a simulated world.
///
///     OmAuditDef def = om_audit_default_def(planner);
///     def.path = "run/audit.jsonl";
///     OmAudit* audit;
///     om_audit_create(&def, &audit);
///     OmLoopListener listener = om_audit_listener(audit);   // for OmLoopDef.listener
///     ...                                                   // tick the loop to its end
///     om_audit_destroy(audit);
///
/// Every line has "event", "tick" and "time_s", all but the first "words": a sentence of record_words.h.
///
/// | event   | what else                                                                                   |
/// |---------|---------------------------------------------------------------------------------------------|
/// | head    | program, hashes of the scene, the logic program, the network and the twin, the loop's rules |
/// | plan    | facts by their source, actions, costs, reasons from the logic program, hash of the twin,    |
/// |         | "name": om_audit_plan_name                                                                  |
/// | begin   | an action begins                                                                            |
/// | action  | it ended: outcome, visibility, force by the twin, hash of the twin                          |
/// | warning | the warning state (Alg. 5), the one before, and the discrepancy mu                          |
/// | update  | stage, reason, numbers of an acquisition or an estimate of the attachments                  |
/// | command | of a person, as om_loop_command_parse reads it; of consent "plan": the name of the plan     |
/// | hold    | why the robot waits for a person                                                            |
/// | end     | outcome, reason, visibility, force by the twin, hash of the twin                            |
///
/// Sources of facts: "camera", "joints" (measured tools), "twin" (its forces and attachments), "patient" (the model
/// before the operation), "trials" (points that were tried in the twin, by the plan before the operation or by looking
/// ahead), "memory" (what was tried in the operation), "person".
#ifndef OMENTUM_RECORD_AUDIT_H
#define OMENTUM_RECORD_AUDIT_H

#include "omentum/loop.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmAuditDef {
    OmCookie cookie;
    OmPlanner* planner;      // explains the plans, borrowed; null: without reasons
    const char* path;        // of a new file; null (default): the text is only kept in memory
    const char* scene_text;  // hashed, as the two below; default ""
    const char* program;     // text of the logic program; default the built-in one
    uint64_t network_hash;   // om_banet_net_hash; default 0: none
} OmAuditDef;

OM_API OmAuditDef om_audit_default_def(OmPlanner* planner);

typedef struct OmAudit OmAudit;
/// The file is made when the loop begins.
/// @return OM_OK; OM_INVALID (a field); OM_NO_MEMORY
OM_API OmStatus om_audit_create(const OmAuditDef* def, OmAudit** audit);
OM_API void om_audit_destroy(OmAudit* audit);
/// The functions fail with OM_IO where the file exists or cannot be written.
/// @return the functions of the audit; `ctx` is borrowed until it is destroyed
OM_API OmLoopListener om_audit_listener(OmAudit* audit);
#define OM_AUDIT_NAME 17  // bytes of a plan's name
/// Names the plan that the loop has now, for a person's consent: a hash of its number and its actions. A plan that was
/// made later has another name, also if its actions are the same.
OM_API void om_audit_plan_name(const OmLoop* loop, char name[OM_AUDIT_NAME]);
/// All lines so far; valid until the next one or until the audit is destroyed.
OM_API const char* om_audit_text(const OmAudit* audit);
/// The sentences so far, a line each with its time, but for actions that begin; valid as long.
OM_API const char* om_audit_story(const OmAudit* audit);

#ifdef __cplusplus
}
#endif
#endif
