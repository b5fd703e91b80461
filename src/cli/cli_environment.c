// cli_environment.c: how threads of libraries wait.
//
// libgomp (in oneDNN) and OpenBLAS read it from the environment when they are loaded, before main. Their defaults spin
// for 3 ms and 30 ms: on a machine that others use, threads then wait for each other by slices of the scheduler. The
// program starts itself anew with shorter times, unless the user has chosen. The process stays the same.
#include <stdlib.h>
#include <unistd.h>

#include "cli_common.h"

static const struct {
    const char *name, *value;
    const char* instead;  // chosen by the user: then this one is left alone
} setting[] = {
    {"GOMP_SPINCOUNT", "1000", "OMP_WAIT_POLICY"},  // some ten microseconds
    {"OPENBLAS_THREAD_TIMEOUT", "14", NULL},        // 2^14 turns of the clock
};

void om_cli_set_environment(char** argv) {
    bool is_changed = false;
    for (size_t k = 0; k < sizeof setting / sizeof *setting; ++k) {
        if (getenv(setting[k].name) || (setting[k].instead && getenv(setting[k].instead))) continue;
        is_changed |= setenv(setting[k].name, setting[k].value, 0) == 0;
    }
    // Where the program cannot be started anew, it goes on with the libraries' defaults.
    if (is_changed) (void)execv("/proc/self/exe", argv);
}
