// belief_decide.h: from belief and evidence to belief and decision. Pure functions: no world, no twin, no clock.
//
// 1. A frame of the monitor moves the warning state (om__warning_next; Alg. 5 with hysteresis):
//
//    | tissue in hand | action                 | state                                                            |
//    |----------------|------------------------|------------------------------------------------------------------|
//    | no             | any                    | 0                                                                |
//    | yes            | pull                   | the larger of the state by mu and that of a part of the tissue   |
//    | yes            | any other              | by mu                                                            |
//
// 2. The state tells how the arms move (om__warning_conduct):
//
//    | state | speed of held tissue | motion                                    | a person                          |
//    |-------|----------------------|-------------------------------------------|-----------------------------------|
//    | 0     | 1                    | continues                                 |                                   |
//    | 1     | 1/2                  | continues                                 |                                   |
//    | 2     | 1/2                  | stops                                     |                                   |
//    | 3     | 1/2                  | stops                                     | is called after STATE_3_TIME, once |
//
//    While the arms stand and an answer is awaited, the person is called after LEARN_LIMIT.
//
// 3. When an action has ended (om__belief_after), the first row that holds:
//
//    | step   | where                                                                                              |
//    |--------|----------------------------------------------------------------------------------------------------|
//    | LOOK   | held tissue was moved high enough; with a monitor that learns: it warned, and nothing answers yet  |
//    | LOOK   | with a monitor that learns: this was the last pull of a lift, and the ROI is hidden                |
//    | LEARN  | a warning stopped the motion, or a fold ended in state 2 or above                                  |
//    | LEARN  | an answer is under way, and the ROI is hidden                                                      |
//    | GO     | otherwise: verify that the ROI is exposed, or the next action                                      |
//
// 4. While the arms wait for what is learnt (om__belief_wait):
//
//    | wait    | where                                                                                             |
//    |---------|---------------------------------------------------------------------------------------------------|
//    | STAY    | state 3, not overruled: a person is called, or the state falls                                    |
//    | STAY    | for LEARN_LIMIT at most: the view of the ROI changes, an estimate runs, is adopted, or is measured |
//    | RELEASE | otherwise, in state 2 or above: nothing was learnt that helps                                     |
//    | GO      | otherwise                                                                                         |
#ifndef OMENTUM_BELIEF_DECIDE_H
#define OMENTUM_BELIEF_DECIDE_H

#include "omentum/act.h"
#include "omentum/belief_monitor.h"

#define STATE_3_TIME 1.0  // s of state 3 until a person is called: a fold tips over within 0.6 s
#define LEARN_LIMIT 8.0   // s, longest wait for an estimate and its adoption

typedef struct Warning {
    int state;            // 0 to 3: of Alg. 5, or of a part of the tissue
    int part_state;       // 0 to 2
    double part_rest;     // m, OmMonitorFrame.part before the present grasp
    bool has_dragged;     // held tissue was folded since it was grasped
    bool is_overruled;    // a person continues in state 3
    double state3_begin;  // s, since when it is 3
} Warning;

typedef struct FrameEvidence {
    double time;      // s of the operation
    double part;      // m, of OmMonitorFrame
    int state;        // of OmMonitorFrame
    bool holds;       // tissue is in hand
    OmPlanVerb verb;  // of the action
} FrameEvidence;

// The arms wait: a person is called, or the state falls.
static inline bool om__warning_is_stopped(const Warning* w) {
    return w->state == 3 && !w->is_overruled;
}

Warning om__warning_next(const OmSceneMonitor* settings, Warning was, const FrameEvidence* e);

typedef struct Conduct {
    double rate;          // fraction of the speed of motions that hold tissue
    bool stops;           // these motions
    bool calls_a_person;  //
} Conduct;
// @param may_wait  the arms stand, and a look is taken, an estimate runs, is adopted, or its effect is awaited
Conduct om__warning_conduct(Warning warning, double time, bool may_wait);

typedef enum AfterStep { AFTER_GO, AFTER_LOOK, AFTER_LEARN } AfterStep;

typedef struct AfterEvidence {  // when an action has ended
    OmPlanVerb verb;
    OmActionOutcome outcome;
    int state;    // of Warning
    int highest;  // state during the action that nothing has answered
    bool has_monitor, has_updater, has_estimator;
    bool is_seen;       // the ROI, to the wanted share
    bool is_lifted;     // held tissue, high enough for an acquisition
    bool is_answering;  // an estimate runs, or its effect is awaited
    bool is_due;        // an acquisition waits for its estimate
    bool has_dragged;   // the tissue was folded since it was grasped
    bool continues;     // the next action of the plan is a pull
} AfterEvidence;
// @param done  the step that has just ended; AFTER_GO: the action itself. Steps are in the order of the table.
AfterStep om__belief_after(const AfterEvidence* e, AfterStep done);

typedef enum WaitStep { WAIT_GO, WAIT_STAY, WAIT_RELEASE } WaitStep;

typedef struct WaitEvidence {
    int state;
    bool is_stopped;    // om__warning_is_stopped
    double waited;      // s
    bool is_changing;   // the view of the ROI
    bool is_answering;  // an estimate is due, runs, is adopted, or its effect is awaited
} WaitEvidence;
WaitStep om__belief_wait(const WaitEvidence* e);

#endif
