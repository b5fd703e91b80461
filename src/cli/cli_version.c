// cli_version.c: `omentum --version`: the version, and what a report of a fault needs.
//
// Libraries are those loaded, by the names of their files, which carry their versions: the program may have been built
// with others.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __aarch64__
#include <sys/auxv.h>
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

static int compare(const void* a, const void* b) {
    return strcmp(*(char* const*)a, *(char* const*)b);
}

// Files of libraries in the list of what is mapped, without folders; each one once.
static void print_libraries(void) {
    enum { MOST = 256 };
    char* name[MOST];
    char line[4096];
    int n = 0;
    FILE* file = fopen("/proc/self/maps", "r");
    while (file && n < MOST && fgets(line, sizeof line, file)) {
        line[strcspn(line, "\n")] = 0;
        char* path = strchr(line, '/');
        char* base = path ? strrchr(path, '/') + 1 : NULL;
        if (!base || !strstr(base, ".so") || (n > 0 && strcmp(name[n - 1], base) == 0)) continue;
        name[n] = om_alloc(strlen(base) + 1, 1);
        if (!name[n]) break;
        strcpy(name[n++], base);
    }
    if (file) fclose(file);
    qsort(name, (size_t)n, sizeof *name, compare);
    printf("libraries");
    for (int k = 0; k < n; ++k)
        if (k == 0 || strcmp(name[k], name[k - 1]) != 0) printf(" %s", name[k]);
    printf("\n");
    for (int k = 0; k < n; ++k) om_free(name[k]);
}

void om_cli_print_version(void) {
    printf("omentum %s\n", om_version());
    printf("commit %s, compiler %s\n", OM_COMMIT, __VERSION__);
#ifdef OM_WITH_GPL
    printf("with parts under the GPL: CHOLMOD's supernodal factors, UMFPACK\n");
#else
    printf("without parts under the GPL: simplicial factors of CHOLMOD, SuperLU\n");
#endif
    print_processor();
    print_libraries();
}
