// Parallel loops: every index once, blocks independent of the worker count, barriers that hold.
// On a crowded machine teams are small; a quota of a container bounds the number of workers.
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/base_processor.h"
#include "test_common.h"

enum { N = 10007, GRAIN = 97 };

typedef struct Sum {
    double partial[(N + GRAIN - 1) / GRAIN];
    atomic_int visits[N];
} Sum;

static void add_block(void* ctx, int begin, int end, int block) {
    Sum* sum = ctx;
    double s = 0;
    for (int i = begin; i < end; ++i) {
        s += 1.0 / (1.0 + i);
        atomic_fetch_add(&sum->visits[i], 1);
    }
    sum->partial[block] = s;
}

static double run_sum(int nworker) {
    static Sum sum;
    memset(&sum, 0, sizeof sum);
    om_parallel_for(nworker, N, GRAIN, add_block, &sum);
    double total = 0;
    for (int b = 0; b < om_block_count(N, GRAIN); ++b) total += sum.partial[b];
    for (int i = 0; i < N; ++i) assert_int_equal(sum.visits[i], 1);
    return total;
}

static void same_bytes_for_any_worker_count(void** state) {
    (void)state;
    double one = run_sum(1);
    for (int w = 2; w <= 8; ++w) {
        double many = run_sum(w);
        assert_memory_equal(&one, &many, sizeof one);
    }
}

typedef struct Relay {
    atomic_int arrived;
    atomic_int errors;
    int size;
} Relay;

static void relay(void* ctx, OmTeam* team, int rank, int size) {
    Relay* r = ctx;
    for (int round = 1; round <= 200; ++round) {
        atomic_fetch_add(&r->arrived, 1);
        om_team_barrier(team);
        if (atomic_load(&r->arrived) != round * size) atomic_fetch_add(&r->errors, 1);
        om_team_barrier(team);
    }
    if (rank == 0) r->size = size;
}

static void barriers_hold(void** state) {
    (void)state;
    for (int w = 1; w <= 4; ++w) {
        Relay r = {0};
        om_parallel_team(w, relay, &r);
        assert_int_equal(r.errors, 0);
        assert_int_equal(r.size, w);
    }
}

static void count_block(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int i = begin; i < end; ++i) atomic_fetch_add(&((Sum*)ctx)->visits[i], 1);
}

static void nested(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int i = begin; i < end; ++i) om_parallel_for(2, 10, 1, count_block, ctx);
}

static void nested_and_empty_loops_work(void** state) {
    (void)state;
    static Sum sum;
    om_parallel_for(2, 0, 1, add_block, &sum);
    om_parallel_for(2, 4, 1, nested, &sum);
    for (int i = 0; i < 10; ++i) assert_int_equal(sum.visits[i], 4);
    assert_true(om_worker_count(0) >= 1);
    assert_int_equal(om_worker_count(1000), OM_MAX_WORKER);  // forced
}

// ---- processors -----------------------------------------------------------------------------------------

static void numbers_are_cut_to_the_processors(void** state) {
    (void)state;
    int limit = om__processor_limit();
    assert_in_range(limit, 1, sysconf(_SC_NPROCESSORS_ONLN));
    assert_int_equal(om_worker_count(0), limit < OM_MAX_WORKER ? limit : OM_MAX_WORKER);
    assert_int_equal(om_worker_count(7), 7);  // forced
    om_worker_force(false);
    assert_int_equal(om_worker_count(OM_MAX_WORKER), om_worker_count(0));
    assert_int_equal(om_worker_count(1), 1);
    assert_in_range(om_worker_free(0), 1, om_worker_count(0));
    om_worker_force(true);
    assert_int_equal(om_worker_free(7), 7);
}

static void put_file(const char* dir, const char* name, const char* text) {
    char path[512];
    assert_ok(om_path_join(dir, name, path, sizeof path));
    assert_ok(om_file_write(path, text, strlen(text)));
}

static void quotas_are_read_in_both_versions(void** state) {
    (void)state;
    char root[] = "/tmp/om_quota_XXXXXX", dir[512], self[512];
    assert_non_null(mkdtemp(root));
    snprintf(self, sizeof self, "%s/self", root);
    assert_int_equal(om__processor_quota(root, self), INT_MAX);
    // version 2: the group has no quota, its parent has one and a half processors
    snprintf(dir, sizeof dir, "%s/a", root);
    assert_int_equal(mkdir(dir, 0700), 0);
    put_file(dir, "cpu.max", "150000 100000\n");
    snprintf(dir, sizeof dir, "%s/a/b", root);
    assert_int_equal(mkdir(dir, 0700), 0);
    put_file(dir, "cpu.max", "max 100000\n");
    put_file(root, "self", "0::/a/b\n");
    assert_int_equal(om__processor_quota(root, self), 2);
    // version 1, in a container: the path of the host is not there, the root is the group
    snprintf(dir, sizeof dir, "%s/cpu", root);
    assert_int_equal(mkdir(dir, 0700), 0);
    put_file(dir, "cpu.cfs_quota_us", "300000\n");
    put_file(dir, "cpu.cfs_period_us", "100000\n");
    put_file(root, "self", "3:cpuset:/\n5:cpu,cpuacct:/docker/4711\n");
    assert_int_equal(om__processor_quota(root, self), 3);
    put_file(dir, "cpu.cfs_quota_us", "-1\n");
    assert_int_equal(om__processor_quota(root, self), INT_MAX);
    put_file(dir, "cpu.cfs_quota_us", "rubbish");
    assert_int_equal(om__processor_quota(root, self), INT_MAX);
    static const char* const name[] = {"cpu/cpu.cfs_quota_us",
                                       "cpu/cpu.cfs_period_us",
                                       "cpu",
                                       "a/b/cpu.max",
                                       "a/b",
                                       "a/cpu.max",
                                       "a",
                                       "self"};
    for (size_t k = 0; k < sizeof name / sizeof *name; ++k) {
        snprintf(dir, sizeof dir, "%s/%s", root, name[k]);
        assert_int_equal(remove(dir), 0);
    }
    assert_int_equal(rmdir(root), 0);
}

static void loads_are_read(void** state) {
    (void)state;
    assert_int_equal(om__processor_running("0.20 0.18 0.12 13/80 11206\n"), 13);
    assert_int_equal(om__processor_running("0.20 0.18 0.12 13"), 0);
    assert_int_equal(om__processor_running("0.20 0.18"), 0);
    assert_int_equal(om__processor_running(""), 0);
}

static void count_size(void* ctx, OmTeam* team, int rank, int size) {
    om_team_barrier(team);
    if (rank == 0) ++((int*)ctx)[size];
}

// With a spinning process on every processor nearly all teams have one member; loops are whole all the same.
static void crowded_teams_have_one_member(void** state) {
    (void)state;
    pid_t spinner[OM_MAX_WORKER] = {0};
    int num = (int)sysconf(_SC_NPROCESSORS_ONLN), size[OM_MAX_WORKER + 1] = {0};
    if (num > OM_MAX_WORKER || access("/proc/loadavg", R_OK) != 0)
        test_skip("no /proc/loadavg, or %d processors", num);
    for (int k = 0; k < num; ++k) {
        spinner[k] = fork();
        if (spinner[k] == 0)
            for (alarm(60);;) continue;
    }
    om_worker_force(false);
    nanosleep(&(struct timespec){0, 200000000}, NULL);
    for (int k = 0; k < 100; ++k) {  // two readings of the load come first
        om_parallel_team(8, count_size, size);
        nanosleep(&(struct timespec){0, 5000000}, NULL);
        if (k == 19) memset(size, 0, sizeof size);
    }
    double one = run_sum(1), many = run_sum(8);
    om_worker_force(true);
    for (int k = 0; k < num; ++k) kill(spinner[k], SIGKILL);
    for (int k = 0; k < num; ++k) waitpid(spinner[k], NULL, 0);
    assert_memory_equal(&one, &many, sizeof one);
    assert_in_range(size[1], 70, 80);  // without the rule: none
}

#ifndef __SANITIZE_THREAD__  // it allows no threads in a child of a process with threads

// A child of fork has none of the threads: its loops start new ones.
static void children_of_fork_work(void** state) {
    (void)state;
    double one = run_sum(1), here = run_sum(4);
    pid_t pid = fork();
    if (pid == 0) {
        alarm(60);
        double many = run_sum(4);
        _exit(memcmp(&one, &many, sizeof one) == 0 && memcmp(&one, &here, sizeof one) == 0 ? 0 : 1);
    }
    int how;
    assert_int_equal(waitpid(pid, &how, 0), pid);
    assert_true(WIFEXITED(how));
    assert_int_equal(WEXITSTATUS(how), 0);
}

#endif

// Callers in several threads share the pool, also in the middle of another's job.
static void* sum_often(void* arg) {
    for (int k = 0; k < 50; ++k) {
        Relay r = {0};
        om_parallel_team(3, relay, &r);
        if (r.errors || r.size < 1 || r.size > 3) *(int*)arg = 1;
    }
    return NULL;
}

static void callers_share_the_pool(void** state) {
    (void)state;
    pthread_t thread[4];
    int is_wrong[4] = {0};
    for (int k = 0; k < 4; ++k)
        assert_int_equal(pthread_create(&thread[k], NULL, sum_often, &is_wrong[k]), 0);
    for (int k = 0; k < 4; ++k) pthread_join(thread[k], NULL);
    for (int k = 0; k < 4; ++k) assert_int_equal(is_wrong[k], 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bytes_for_any_worker_count),
        cmocka_unit_test(barriers_hold),
        cmocka_unit_test(nested_and_empty_loops_work),
        cmocka_unit_test(numbers_are_cut_to_the_processors),
        cmocka_unit_test(quotas_are_read_in_both_versions),
        cmocka_unit_test(loads_are_read),
        cmocka_unit_test(crowded_teams_have_one_member),
#ifndef __SANITIZE_THREAD__
        cmocka_unit_test(children_of_fork_work),
#endif
        cmocka_unit_test(callers_share_the_pool),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
