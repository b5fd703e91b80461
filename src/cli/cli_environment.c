// cli_environment.c: sets how threads of libraries wait.
//
// libgomp (in oneDNN) and OpenBLAS read it from the environment when they are loaded, before main. By default their
// threads spin for 3 ms and 30 ms: on a machine that others use, threads then wait for each other for whole time
// slices. So the program restarts itself (exec, same process) with shorter times, unless the user has set them.
#include <stdlib.h>
#include <unistd.h>

#include "cli_common.h"

static const struct {
    const char *name, *value;
    const char* instead;  // if the user has set this one, the variable is not set
} setting[] = {
    {"GOMP_SPINCOUNT", "1000", "OMP_WAIT_POLICY"},  // some ten microseconds
    {"OPENBLAS_THREAD_TIMEOUT", "14", NULL},        // 2^14 clock cycles
};

void om_cli_set_environment(char** argv) {
    bool is_changed = false;
    for (size_t k = 0; k < sizeof setting / sizeof *setting; ++k) {
        if (getenv(setting[k].name) || (setting[k].instead && getenv(setting[k].instead))) continue;
        is_changed |= setenv(setting[k].name, setting[k].value, 0) == 0;
    }
    // If the program cannot be restarted, the libraries use their defaults.
    if (is_changed) (void)execv("/proc/self/exe", argv);
}
