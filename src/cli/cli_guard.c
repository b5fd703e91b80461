// cli_guard.c: work that cannot be interrupted runs in a child process, with limits on time and memory.
//
// clingo cannot be interrupted while it grounds: a program with infinitely many atoms, or a thousand million, would
// run until memory is full. The child is ended by its own alarm, by a limit on its address space, or by Ctrl-C; the
// parent prints the reason.
#include "cli_guard.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

// Bytes. Above this the program runs under a sanitizer, whose shadow memory exceeds any limit.
#define SANE_SPACE (64.0e9)

static volatile sig_atomic_t child_pid;

static void forward(int number) {
    if (child_pid > 0) kill((pid_t)child_pid, number);
}

// Bytes of address space in use, 0 if unknown.
static double address_space(void) {
    FILE* f = fopen("/proc/self/statm", "r");
    long page = 0;
    if (f && fscanf(f, "%ld", &page) != 1) page = 0;
    if (f) fclose(f);
    return (double)page * (double)sysconf(_SC_PAGESIZE);
}

static void limit_memory(double bytes) {
    double used = address_space();
    struct rlimit limit;
    if (bytes <= 0 || used <= 0 || used > SANE_SPACE || getrlimit(RLIMIT_AS, &limit) != 0) return;
    rlim_t wanted = (rlim_t)(used + bytes);
    if (limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur < wanted) return;
    limit.rlim_cur = wanted;
    (void)setrlimit(RLIMIT_AS, &limit);
}

void om_cli_guard_alarm(double seconds) {
    struct itimerval timer = {.it_value = {(time_t)seconds, 0}};
    timer.it_value.tv_usec = (suseconds_t)(1e6 * (seconds - (double)timer.it_value.tv_sec));
    if (timer.it_value.tv_sec == 0 && timer.it_value.tv_usec == 0) timer.it_value.tv_usec = 1;
    (void)setitimer(ITIMER_REAL, &timer, NULL);
}

int om_cli_guard_run(const OmCliGuard* guard) {
    struct sigaction old[2], pass = {.sa_handler = forward};
    const int number[2] = {SIGINT, SIGTERM};
    fflush(stdout);
    fflush(stderr);
    for (int i = 0; i < 2; ++i) sigaction(number[i], &pass, &old[i]);
    pid_t parent = getpid(), pid = fork();
    if (pid == 0) {
        for (int i = 0; i < 2; ++i) signal(number[i], SIG_DFL);
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) _exit(OM_EXIT_CANCELLED);
        limit_memory(guard->memory);
        _exit(om_cli_check_output(guard->run(guard->ctx)));
    }
    int state = 0;
    child_pid = pid;
    while (pid > 0 && waitpid(pid, &state, 0) < 0 && errno == EINTR) continue;
    child_pid = 0;
    for (int i = 0; i < 2; ++i) sigaction(number[i], &old[i], NULL);
    if (pid < 0) return guard->run(guard->ctx);  // no process can be made: run without limits
    if (WIFEXITED(state)) return WEXITSTATUS(state);
    int end = WTERMSIG(state);
    if (end == SIGINT || end == SIGTERM) {
        fprintf(stderr, "omentum %s: cancelled; nothing was written\n", guard->verb);
        return OM_EXIT_CANCELLED;
    }
    if (end == SIGALRM) {
        fprintf(stderr, "omentum %s: %s\n", guard->verb, guard->too_long);
        return OM_EXIT_FAILED;
    }
    fprintf(stderr, "omentum %s: %s (signal %d)\n", guard->verb, guard->died, end);
    return OM_EXIT_ERROR;
}
