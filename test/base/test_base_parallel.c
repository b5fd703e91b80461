// Parallel loops: every index once, blocks independent of the worker count, barriers that hold.
#include <stdatomic.h>

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
    assert_int_equal(om_worker_count(1000), OM_MAX_WORKER);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bytes_for_any_worker_count),
        cmocka_unit_test(barriers_hold),
        cmocka_unit_test(nested_and_empty_loops_work),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
