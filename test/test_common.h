// test_common.h: what every test includes first: cmocka and assertions that print both values.
#ifndef OMENTUM_TEST_COMMON_H
#define OMENTUM_TEST_COMMON_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmocka.h>

#include "omentum/base.h"
#include "omentum/vec.h"

#ifdef main
int main(void);  // each file's own, renamed to the file's name by om_test (cmake/OmTargets.cmake)
#endif
extern int test_argc;  // of the program (test_main.c): the file's name is test_argv[1]
extern char** test_argv;

#define SKIP_TEST_CODE 77  // what a test program returns when all its cases were skipped

// ---- skipped cases, and the limit on processor time ---------------------------------------------------------

static int test_nskip;

/// Leave this case as skipped, with its reason (a format). tools/check.sh lists every skipped case by name.
#define test_skip(...)             \
    do {                           \
        printf("skip: ");          \
        printf(__VA_ARGS__);       \
        printf("\n");              \
        fflush(stdout);            \
        ++test_nskip;              \
        _skip(__FILE__, __LINE__); \
    } while (0)
#undef skip
#define skip() test_skip("no reason is given")

static inline void test_out_of_time(int signal_number) {
    (void)signal_number;
    static const char text[] = "\nthe test took more processor time than OM_TEST_CPU_S allows\n";
    if (write(STDERR_FILENO, text, sizeof text - 1) >= 0) _exit(1);
    _exit(1);
}

// The hang limit is processor time, OM_TEST_CPU_S seconds of it: other work on the machine does not count.
static inline void test_limit_time(void) {
    const char* text = getenv("OM_TEST_CPU_S");
    long seconds = text ? strtol(text, NULL, 10) : 0;
    if (seconds <= 0) return;
    struct sigaction action = {.sa_handler = test_out_of_time};
    sigaction(SIGXCPU, &action, NULL);
    struct rlimit limit;
    if (getrlimit(RLIMIT_CPU, &limit) != 0) return;
    limit.rlim_cur = (rlim_t)seconds < limit.rlim_max ? (rlim_t)seconds : limit.rlim_max;
    setrlimit(RLIMIT_CPU, &limit);
}

// Is this the slow run of a file (NAME_all, OM_TEST_SLOW)? It has the sizes and repetitions of which a quick run has
// some.
static inline bool test_is_slow(void) { return getenv("OM_TEST_SLOW") != NULL; }

/// Repetitions or sizes: `quick` in a quick run, `slow` in the slow one.
static inline int test_count(int quick, int slow) { return test_is_slow() ? slow : quick; }

/// A case for the slow run only; the file has a quick case that fails where this one would.
#define cmocka_slow_test(f) \
    { "slow_" #f, f, NULL, NULL, NULL }

// Is this case run? OM_TEST_CASES=memory selects the cases of failing allocations.
static inline bool test_is_selected(const char* name) {
    const char* only = getenv("OM_TEST_CASES");
    if (only && strcmp(only, "memory") == 0) return strstr(name, "memory") || strstr(name, "alloc");
    return test_is_slow() || strncmp(name, "slow_", 5) != 0;
}

// As cmocka runs a group; the exit code is 77 if every case was skipped, and 1 if any failed or none ran.
static inline int test_run_group(const char* name, const struct CMUnitTest* tests, size_t num,
                                 CMFixtureFunction begin, CMFixtureFunction end) {
    test_limit_time();
    struct CMUnitTest* chosen = calloc(num, sizeof *chosen);
    size_t n = 0;
    for (size_t i = 0; chosen && i < num; ++i)
        if (test_is_selected(tests[i].name)) chosen[n++] = tests[i];
    if (n == 0) fprintf(stderr, "no case fits OM_TEST_CASES\n");
    // OM_TEST_PART=2/3: the second, fifth, eighth ... of them
    const char* part = getenv("OM_TEST_PART");
    size_t begin_at = 1, stride = 1, kept = 0;
    bool kept_none = false;  // of some: this part has none of the selected cases
    if (part && sscanf(part, "%zu/%zu", &begin_at, &stride) == 2 && begin_at >= 1 && stride >= 1) {
        for (size_t i = begin_at - 1; i < n; i += stride) chosen[kept++] = chosen[i];
        kept_none = n > 0 && kept == 0;
        n = kept;
    }
    int nfail = n > 0 ? _cmocka_run_group_tests(name, chosen, n, begin, end) : !kept_none;
    free(chosen);
    if (nfail != 0) return 1;
    return test_nskip > 0 && (size_t)test_nskip == n ? SKIP_TEST_CODE : 0;
}
#undef cmocka_run_group_tests
#define cmocka_run_group_tests(tests, begin, end) \
    test_run_group(#tests, tests, sizeof(tests) / sizeof((tests)[0]), begin, end)

// Teams of the size that a test names, on any machine: results must not depend on it.
__attribute__((constructor)) static inline void test_force_workers(void) { om_worker_force(true); }

// Tolerances are scaled by OM_TOL_SCALE; 0 shows every residual as a failure.
static inline double test_tol_scale(void) {
    const char* s = getenv("OM_TOL_SCALE");
    return s ? atof(s) : 1.0;
}

#define assert_ok(call)                                                                     \
    do {                                                                                    \
        OmStatus s_ = (call);                                                               \
        if (s_ != OM_OK) fail_msg("%s: status %d, %s", #call, (int)s_, om_error_message()); \
    } while (0)

#define assert_status(call, expected)                                                   \
    do {                                                                                \
        OmStatus s_ = (call);                                                           \
        if (s_ != (expected))                                                           \
            fail_msg("%s: status %d, expected %d, %s", #call, (int)s_, (int)(expected), \
                     om_error_message());                                               \
    } while (0)

/// |a - b| <= tol (1 + max(|a|, |b|) is not used: give an absolute tolerance with its reason)
#define assert_near(a, b, tol)                                                           \
    do {                                                                                 \
        double a_ = (a), b_ = (b), t_ = (tol)*test_tol_scale();                          \
        if (!(fabs(a_ - b_) <= t_))                                                      \
            fail_msg("%s = %.17g, %s = %.17g, |difference| %.3g > %.3g", #a, a_, #b, b_, \
                     fabs(a_ - b_), t_);                                                 \
    } while (0)

/// |a - b| <= tol max(|a|, |b|)
#define assert_near_rel(a, b, tol)                               \
    do {                                                         \
        double ra_ = (a), rb_ = (b);                             \
        assert_near(ra_, rb_, (tol)*fmax(fabs(ra_), fabs(rb_))); \
    } while (0)

#define assert_below(a, bound)                                                            \
    do {                                                                                  \
        double a_ = (a), b_ = (bound);                                                    \
        if (!(a_ < b_)) fail_msg("%s = %.9g is not below %s = %.9g", #a, a_, #bound, b_); \
    } while (0)

// ---- data that do not come with the checkout ----------------------------------------------------------------

// The data folder: OM_DATA, or ../shared/data. Null if there is neither. A folder that OM_DATA names, or a folder
// ../shared without data, is a mistake of the set-up: the test fails.
static inline const char* test_data_dir(void) {
    static char dir[512];
    const char* env = getenv("OM_DATA");
    snprintf(dir, sizeof dir, "%s", env ? env : "../shared/data");
    if (om_path_exists(dir)) return dir;
    if (env) fail_msg("OM_DATA names %s, which is not there", dir);
    if (om_path_exists("../shared")) fail_msg("../shared is there, but not %s", dir);
    return NULL;
}

/// Path of a file of the data folder, valid for four calls. Without a data folder the case is skipped; a folder
/// without this file fails the case: it would be skipped for ever.
static inline const char* test_data(const char* name) {
    static char path[4][1024];
    static int turn;
    const char* dir = test_data_dir();
    if (!dir) test_skip("no data folder (OM_DATA, ../shared/data) with %s", name);
    turn = (turn + 1) % 4;
    snprintf(path[turn], sizeof path[turn], "%s/%s", dir, name);
    if (!om_path_exists(path[turn])) fail_msg("%s is not in the data folder", path[turn]);
    return path[turn];
}

#endif
