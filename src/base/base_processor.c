// base_processor.c: number of processors that this process may use, and number of free ones.
//
// The limit is the affinity mask and the quota of control groups (containers). The load is the number of running
// threads in /proc/loadavg; both it and the processors online count the whole machine. Reading it takes some ten
// microseconds, so it is read every 20 ms. A load counts when two readings in a row show it: a short-lived thread
// of the system would end a team. Where the file is missing, all processors of the limit count as free.
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "base/base_processor.h"

#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define READ_EVERY 0.02  // s between two readings of the load
#define NREADING 3       // readings of om__processor_free_now
#define PAUSE_NS 2000000L

static pthread_once_t once = PTHREAD_ONCE_INIT;
static int limit = 1, nonline = 1;
static _Atomic double next_reading;
static atomic_int last_others, others;

// ---- limit ----------------------------------------------------------------------------------------------

// Read a whole small file as text, without the heap; "" if it cannot be read.
static void read_text(const char* path, char* text, size_t size) {
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    ssize_t n = fd >= 0 ? read(fd, text, size - 1) : 0;
    text[n > 0 ? n : 0] = 0;
    if (fd >= 0) close(fd);
}

static int rounded_up(double quota, double period) {
    if (!(quota > 0) || !(period > 0)) return INT_MAX;
    double n = quota / period;
    return n >= INT_MAX ? INT_MAX : (int)n + (n > (int)n);
}

// The quota of one group: version 2 has "max 100000" or "150000 100000", version 1 two files.
static int quota_of(const char* dir) {
    char path[1200], text[128], period[64], *end;
    snprintf(path, sizeof path, "%s/cpu.max", dir);
    read_text(path, text, sizeof text);
    if (text[0]) {
        double quota = strtod(text, &end);
        return end == text ? INT_MAX : rounded_up(quota, strtod(end, NULL));
    }
    snprintf(path, sizeof path, "%s/cpu.cfs_quota_us", dir);
    read_text(path, text, sizeof text);
    snprintf(path, sizeof path, "%s/cpu.cfs_period_us", dir);
    read_text(path, period, sizeof period);
    return rounded_up(strtod(text, NULL), strtod(period, NULL));
}

// The smallest quota of a group and its parent groups.
static int quota_upwards(const char* root, const char* group) {
    char dir[1024];
    int n = snprintf(dir, sizeof dir, "%s%s", root, group), min = INT_MAX;
    if (n < 0 || n >= (int)sizeof dir) return INT_MAX;
    while (strlen(dir) >= strlen(root)) {
        int quota = quota_of(dir);
        min = quota < min ? quota : min;
        char* slash = strrchr(dir, '/');
        if (!slash) break;
        *slash = 0;
    }
    return min;
}

static bool has_word(const char* list, const char* word) {
    size_t n = strlen(word);
    for (const char* at = strstr(list, word); at; at = strstr(at + 1, word))
        if ((at == list || at[-1] == ',') && (at[n] == 0 || at[n] == ',')) return true;
    return false;
}

int om__processor_quota(const char* root, const char* self) {
    char text[4096], base[600];
    int min = INT_MAX;
    read_text(self, text, sizeof text);
    char* rest = NULL;
    // lines "0::/path" (version 2) and "5:cpu,cpuacct:/path" (version 1)
    for (char* line = strtok_r(text, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
        char* list = strchr(line, ':');
        char* path = list ? strchr(list + 1, ':') : NULL;
        if (!path) continue;
        *path++ = 0;
        ++list;
        if (list[0] && !has_word(list, "cpu")) continue;
        snprintf(base, sizeof base, "%s%s", root, list[0] ? "/cpu" : "");
        if (strcmp(path, "/") == 0) path = "";
        int quota = quota_upwards(base, path);
        // In a container the path is the host's and the root is the group itself.
        if (path[0]) {
            int top = quota_upwards(base, "");
            quota = top < quota ? top : quota;
        }
        min = quota < min ? quota : min;
    }
    return min;
}

static void find_limit(void) {
    long n = sysconf(_SC_NPROCESSORS_ONLN);
    nonline = n > 0 ? (int)n : 1;
    limit = nonline;
    cpu_set_t set;
    if (sched_getaffinity(getpid(), sizeof set, &set) == 0 && CPU_COUNT(&set) > 0 &&
        CPU_COUNT(&set) < limit)
        limit = CPU_COUNT(&set);
    int quota = om__processor_quota("/sys/fs/cgroup", "/proc/self/cgroup");
    if (quota < limit) limit = quota;
    if (limit < 1) limit = 1;
}

int om__processor_limit(void) {
    pthread_once(&once, find_limit);
    return limit;
}

// ---- load -----------------------------------------------------------------------------------------------

int om__processor_running(const char* text) {
    // "0.20 0.18 0.12 1/80 11206": the fourth word is running threads / threads
    for (int k = 0; k < 3; ++k) {
        text = strchr(text, ' ');
        if (!text) return 0;
        ++text;
    }
    char* end;
    long n = strtol(text, &end, 10);
    return *end == '/' && n > 0 && n < INT_MAX ? (int)n : 0;
}

// Running threads of other processes.
static int read_others(int own) {
    char text[128];
    read_text("/proc/loadavg", text, sizeof text);
    int n = om__processor_running(text) - own;
    return n > 0 ? n : 0;
}

static int left_over(int busy) {
    int n = nonline - busy;
    n = n < limit ? n : limit;
    return n > 1 ? n : 1;
}

int om__processor_free(int own) {
    if (om__processor_limit() == 1) return 1;
    double now = om_clock_now(), due = atomic_load_explicit(&next_reading, memory_order_relaxed);
    if (now >= due && atomic_compare_exchange_strong(&next_reading, &due, now + READ_EVERY)) {
        int n = read_others(own), last = atomic_exchange(&last_others, n);
        atomic_store(&others, n < last ? n : last);
    }
    return left_over(atomic_load_explicit(&others, memory_order_relaxed));
}

int om__processor_free_now(int own) {
    if (om__processor_limit() == 1) return 1;
    int min = INT_MAX;
    for (int k = 0; k < NREADING && min > 0; ++k) {
        if (k > 0) nanosleep(&(struct timespec){0, PAUSE_NS}, NULL);
        int n = read_others(own);
        min = n < min ? n : min;
    }
    return left_over(min);
}
