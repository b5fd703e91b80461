/// omentum/rl_trace.h: a recorded robot becomes demonstrations of a task (floor 7).
///
/// A trace is a table of tip positions that a robot recorded. Following it turns it into moves of a task.
///
///     OmRlTrace trace; OmRlFollow follow;
///     om_rl_trace_load("lift.csv", &trace);
///     om_rl_trace_follow(&trace, 0.002, drive, &follow);   // follow.deviation: m, at most 2 mm
///     om_rl_drive_keep(drive, &demos);
///     om_rl_trace_done(&trace);
#ifndef OMENTUM_RL_TRACE_H
#define OMENTUM_RL_TRACE_H

#include "omentum/rl_drive.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmRlTrace {  // om_rl_trace_done frees
    char name[256];         // of the file, for messages
    char topic[128];        // of a recording, for messages; empty: a table of lines
    int n;                  // rows
    bool has_jaw;           // the table has the column jaw
    double* time;           // s, grows                                            (n)
    double* tip;            // m, in the frame of the task                         (n x 3)
    double* jaw;            // opening angle, rad; 0 without the column            (n)
    int* line;              // of the file; of a recording: the message of the topic (n)
} OmRlTrace;

/// Read a table of tip positions, CSV: the first line names the columns time (s), x, y, z (m), and jaw (rad) if the
/// robot has a gripper. Other columns are not used; lines that begin with # are comments.
/// @return OM_OK; OM_INVALID (the message names file, line, field and remedy); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_rl_trace_load(const char* path, OmRlTrace* trace);
/// The same from memory; `name` stands for the file in messages.
/// @return OM_OK; OM_INVALID (the message names file, line, field and remedy); OM_NO_MEMORY
OM_API OmStatus om_rl_trace_parse(const char* data, size_t size, const char* name,
                                  OmRlTrace* trace);
OM_API void om_rl_trace_done(OmRlTrace* trace);
/// Keep the rows of a part of the time.
/// @param begin,end  s since the first row; rows at both are kept
/// @return OM_OK; OM_INVALID (fewer than two rows would be left; trace is unchanged)
OM_API OmStatus om_rl_trace_cut(OmRlTrace* trace, double begin, double end);

#define OM_RL_JAW_CLOSED 0.17453292519943295  // rad; a gripper that is open by less is closed

typedef struct OmRlFollow {  // what came of following a trace
    double deviation;    // m, largest distance between the path of the table and that of the tip
    double score;        // of the episode
    int nstep;           //
    bool is_terminated;  // the task ended the episode
} OmRlFollow;

/// Begin an episode with the tip at the first row and follow the path of the table by the task's moves, without its
/// pauses: a step goes to the place on the grid of moves that is nearest to the path. The gripper follows the jaw. At
/// the end the tip stays for up to 20 steps, until the task ends the episode. The drive then holds the episode.
/// @param max_deviation  m, > 0
/// @return OM_OK; OM_INVALID (a row outside the workspace, a path of too many steps, a deviation above the bound, no
///         column jaw for a gripper; the message names file and line); OM_UNAVAILABLE (a task without a tip);
///         OM_NO_MEMORY; an error of the task
OM_API OmStatus om_rl_trace_follow(const OmRlTrace* trace, double max_deviation, OmRlDrive* drive,
                                   OmRlFollow* follow);

#ifdef __cplusplus
}
#endif
#endif
