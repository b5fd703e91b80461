// cli_supervise.h: a person at the terminal who watches a loop: lines of standard input are commands.
#ifndef OMENTUM_CLI_SUPERVISE_H
#define OMENTUM_CLI_SUPERVISE_H

#include "omentum/loop.h"

typedef struct OmCliPerson {  // zero at first
    bool reads;               // commands from standard input
    bool is_paced;            // time passes as on the wall
    bool has_begun, has_ended;
    double origin;                // s of the wall clock at the loop's time 0
    int nplan, naction, warning;  // the last ones printed
    OmLoopPhase phase;
    char line[128];
    int nline;
} OmCliPerson;

/// After each tick: what changed goes to standard error, lines that have arrived are commands. While the loop waits for
/// the person it reads until a command changes that; the end of the input aborts the loop then.
/// @return OM_OK; errors of om_loop_command
OmStatus om_cli_supervise(void* person, OmLoop* loop);

#endif
