// cli_start.c: checks that must run before the libraries start.
//
// OpenBLAS starts its threads when it is loaded, long before main. Where the address space is limited (ulimit -v, a
// batch system) a thread or its buffer of 32 MB may not fit: then OpenBLAS ends the program by a signal, or its threads
// wait for memory for ever. The number of threads can only be set by the environment. So a function of .preinit_array,
// which runs before any library's initialisation, restarts the program with one thread.
#include "cli_common.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define OM_HAS_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define OM_HAS_SANITIZER 1
#endif
#endif

#if defined(__linux__) && defined(__GNUC__) && !defined(OM_HAS_SANITIZER)

#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#define LEAST_SPACE ((rlim_t)192 << 20)  // bytes
#define BASE_SPACE ((rlim_t)512 << 20)   // bytes for the program and its libraries
// Bytes for one thread of OpenBLAS: its stack, its buffer, its heap.
#define THREAD_SPACE ((rlim_t)64 << 20)
enum { MAX_ENVIRONMENT = 4000 };

// libc has no environment yet: use only the arguments and system calls.
static void begin(int argc, char** argv, char** env) {
    static char one_thread[] = "OPENBLAS_NUM_THREADS=1";
    static char* extended[MAX_ENVIRONMENT + 2];
    struct rlimit limit;
    (void)argc;
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
    if (limit.rlim_cur < LEAST_SPACE) {  // a library would end the program by a signal
        static const char text[] =
            "omentum: the address space is limited to less than 192 MB, in which the libraries do not start: raise "
            "the limit (ulimit -v)\n";
        ssize_t written = write(STDERR_FILENO, text, sizeof text - 1);
        (void)written;
        _exit(OM_EXIT_ERROR);
    }
    long ncore = sysconf(_SC_NPROCESSORS_ONLN);
    if (limit.rlim_cur >= BASE_SPACE + (rlim_t)(ncore > 0 ? ncore : 1) * THREAD_SPACE) return;
    int n = 0;
    for (; env[n]; ++n) {
        if (n == MAX_ENVIRONMENT || strncmp(env[n], one_thread, strlen(one_thread) - 1) == 0)
            return;  // the user has set a number
        extended[n] = env[n];
    }
    extended[n] = one_thread;
    extended[n + 1] = NULL;
    (void)execve("/proc/self/exe", argv, extended);  // if it fails, the program continues unchanged
}

__attribute__((section(".preinit_array"), used)) static void (*const first)(int, char**,
                                                                            char**) = begin;

#else

// A program with a sanitizer cannot keep such a limit.
extern int om_cli_start_is_empty;
int om_cli_start_is_empty = 1;

#endif
