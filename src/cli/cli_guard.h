// cli_guard.h: run work in a child process that can be ended.
#ifndef OM_CLI_GUARD_H
#define OM_CLI_GUARD_H

#include "cli_common.h"

typedef struct OmCliGuard {
    const char* verb;
    int (*run)(void* ctx);  // in the child; prints, returns an exit code
    void* ctx;
    // bytes of address space that the child may use in addition to the program's, 0: no limit
    double memory;
    const char* too_long;  // messages for an alarm, and for another signal that ends the child
    const char* died;
} OmCliGuard;

// Run the work in a child and return its exit code: OM_EXIT_FAILED after an alarm, OM_EXIT_CANCELLED after Ctrl-C,
// OM_EXIT_ERROR if another signal ended it. Call it before anything is printed and before there are threads.
int om_cli_guard_run(const OmCliGuard* guard);
// In the child: end it after this many seconds from now; replaces an earlier alarm.
void om_cli_guard_alarm(double seconds);

#endif
