// cli_version.c: `omentum --version`: the version, and what a report of a fault needs.
//
// Libraries are those loaded, by the names of their files, which carry their versions: the program may have been built
// with others.
#include <ctype.h>
#include <stdio.h>
#include <string.h>
#ifdef __aarch64__
#include <sys/auxv.h>
#endif
#ifdef __GLIBC__
#include <gnu/libc-version.h>
#endif

#include "cli/om_commit.h"
#include "cli_version.h"
#include "omentum/base.h"

static void print_processor(void) {
    printf("processors %d:", om_worker_count(0));
#if defined(__x86_64__)
    static const char* const word[] = {"sse4.2", "avx2", "fma", "avx512f", "avx512vnni"};
    const bool has[] = {__builtin_cpu_supports("sse4.2") != 0, __builtin_cpu_supports("avx2") != 0,
                        __builtin_cpu_supports("fma") != 0, __builtin_cpu_supports("avx512f") != 0,
                        __builtin_cpu_supports("avx512vnni") != 0};
    printf(" x86_64");
    for (size_t k = 0; k < sizeof has / sizeof *has; ++k)
        if (has[k]) printf(" %s", word[k]);
#elif defined(__aarch64__)
    printf(" aarch64%s%s", getauxval(AT_HWCAP) & (1UL << 1) ? " asimd" : "",
           getauxval(AT_HWCAP) & (1UL << 22) ? " sve" : "");
#endif
    printf("\n");
}

// The libraries that omentum calls; those have others below them.
static const char* const used[] = {
    "cholmod", "umfpack", "superlu", "arpack", "openblas", "embree3",    "clingo", "hdf5", "dnnl",
    "png16",   "z",       "yaml",    "nlopt",  "jansson",  "websockets", "ddsc",   "gomp"};
enum { NUSED = sizeof used / sizeof *used, MOST = 32 };

// `base` is the name of a loaded file. If it is that of a library in `used`, keep the version: the numbers behind .so,
// or those before it (libopenblasp-r0.3.21.so).
static void keep_version(const char* base, char version[NUSED][MOST]) {
    for (size_t k = 0; k < NUSED; ++k) {
        const size_t n = strlen(used[k]);
        if (strncmp(base, "lib", 3) != 0 || strncmp(base + 3, used[k], n) != 0) continue;
        const char* end = strstr(base, ".so");
        const char* release = strstr(base + 3 + n, "-r");
        if ((n == 1 && isalpha((unsigned char)base[4])) || !end) continue;  // libzstd is not libz
        if (end[3] == '.')
            snprintf(version[k], MOST, "%s", end + 4);
        else if (release && release < end)
            snprintf(version[k], MOST, "%.*s", (int)(end - release - 2), release + 2);
        else
            snprintf(version[k], MOST, "without a version");
    }
}

// Six libraries a line, by the files in the list of what is mapped.
static void print_libraries(void) {
    char version[NUSED][MOST] = {{0}}, line[4096];
    FILE* file = fopen("/proc/self/maps", "r");
    while (file && fgets(line, sizeof line, file)) {
        line[strcspn(line, "\n")] = 0;
        const char* path = strchr(line, '/');
        if (path) keep_version(strrchr(path, '/') + 1, version);
    }
    if (file) fclose(file);
    int n = 0;
    for (size_t k = 0; k < NUSED; ++k) {
        if (!version[k][0]) continue;
        printf("%s%s %s",
               n == 0       ? "libraries "
               : n % 6 == 0 ? ",\n          "
                            : ", ",
               used[k], version[k]);
        n++;
    }
    printf("%s\n", n == 0 ? "libraries unknown" : "");
}

void om_cli_print_version(void) {
    printf("omentum %s\n", om_version());
#ifdef __clang__
    printf("commit %s, compiler %s", OM_COMMIT, __VERSION__);
#else
    printf("commit %s, compiler gcc %s", OM_COMMIT, __VERSION__);
#endif
#ifdef __GLIBC__
    printf(", C library %s", gnu_get_libc_version());
#endif
    printf("\n");
#ifdef OM_WITH_GPL
    printf("with parts under the GPL: CHOLMOD's supernodal factors, UMFPACK\n");
#else
    printf("without parts under the GPL: simplicial factors of CHOLMOD, SuperLU\n");
#endif
    print_processor();
    print_libraries();
}
