// cli_guard.h: a piece of work in a child process that can be ended.
#ifndef OM_CLI_GUARD_H
#define OM_CLI_GUARD_H

#include "cli_common.h"

typedef struct OmCliGuard {
    const char* verb;
    int (*run)(void* ctx);  // in the child; prints, returns an exit code
    void* ctx;
    double memory;         // bytes that the child may take beyond what the program has, 0: no limit
    const char* too_long;  // sentences for an alarm, and for any other signal that ends the child
    const char* died;
} OmCliGuard;

// Run the work in a child and return its exit code: OM_EXIT_FAILED after an alarm, OM_EXIT_CANCELLED after Ctrl-C,
// OM_EXIT_ERROR if another signal ended it. To be called before anything is printed and before there are threads.
int om_cli_guard_run(const OmCliGuard* guard);
// In the child: end it after so many seconds from now, which replaces an earlier alarm.
void om_cli_guard_alarm(double seconds);

#endif
