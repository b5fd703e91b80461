// base_parallel.c: the only file that knows about threads.
//
// OpenMP where it is compiled in, plain pthreads otherwise (the thread sanitizer does not understand
// libgomp). Work is cut into blocks that do not depend on the worker count, so results that are reduced
// in block order have the same bytes with one worker or many. A team's barrier spins for some thousand
// turns before it yields: the loops of a CG iteration last microseconds, and a futex costs more.
//
// On a crowded machine a team waits at every barrier for a member that is not being run: two workers on two
// busy processors were twenty times slower than one. A yield that takes as long as a slice of the scheduler
// tells; then "one per processor" means one for a while, which no result can show.
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <unistd.h>

#include "omentum/base.h"
#ifdef OM_WITH_OPENMP
#include <omp.h>
#endif

#define SPIN_LIMIT 4000       // some hundred microseconds
#define SLICE 0.5e-3          // s: a yield that long let somebody else run
#define CROWDED_FOR 0.25      // s that teams stay single, doubled while the crowd is still there
#define CROWDED_FOR_MOST 4.0  // s

struct OmTeam {
    int size;
    atomic_int waiting;     // members at the barrier
    atomic_int generation;  // counts completed barriers
};

int om_worker_count(int requested) {
    if (requested <= 0) {
        long n = sysconf(_SC_NPROCESSORS_ONLN);
        requested = n > 0 ? (int)n : 1;
    }
    return requested < OM_MAX_WORKER ? requested : OM_MAX_WORKER;
}

// ---- a crowded machine ----------------------------------------------------------------------------------

static _Atomic double crowded_until;  // om_clock_now at which teams are tried again
static _Atomic double crowded_for;    // s of the last retreat

static void note_crowd(double now) {
    double until = atomic_load_explicit(&crowded_until, memory_order_relaxed);
    double last = atomic_load_explicit(&crowded_for, memory_order_relaxed);
    if (now < until) return;
    bool is_new = now > until + CROWDED_FOR_MOST;
    double next = is_new || last == 0 ? CROWDED_FOR : 2 * last;
    next = next < CROWDED_FOR_MOST ? next : CROWDED_FOR_MOST;
    atomic_store_explicit(&crowded_for, next, memory_order_relaxed);
    atomic_store_explicit(&crowded_until, now + next, memory_order_relaxed);
}

// As asked for, but one where the count was left to us and the machine has no room.
static int team_size(int requested) {
    int size = om_worker_count(requested);
    if (requested > 0 || size == 1) return size;
    double until = atomic_load_explicit(&crowded_until, memory_order_relaxed);
    return until > 0 && om_clock_now() < until ? 1 : size;
}

static void yield(void) {
    double begin = om_clock_now();
    sched_yield();
    double end = om_clock_now();
    if (end - begin > SLICE) note_crowd(end);
}

// ---- barriers -------------------------------------------------------------------------------------------

static inline void pause_briefly(void) {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#endif
}

void om_team_barrier(OmTeam* team) {
    if (team->size == 1) return;
    int generation = atomic_load_explicit(&team->generation, memory_order_acquire);
    if (atomic_fetch_add_explicit(&team->waiting, 1, memory_order_acq_rel) == team->size - 1) {
        atomic_store_explicit(&team->waiting, 0, memory_order_relaxed);
        atomic_fetch_add_explicit(&team->generation, 1, memory_order_acq_rel);
        return;
    }
    for (int spin = 0; atomic_load_explicit(&team->generation, memory_order_acquire) == generation;
         ++spin) {
        if (spin < SPIN_LIMIT)
            pause_briefly();
        else
            yield();
    }
}

// ---- teams ------------------------------------------------------------------------------------------

#ifdef OM_WITH_OPENMP

void om_parallel_team(int nworker, OmTeamFn fn, void* ctx) {
    OmTeam team = {.size = team_size(nworker)};
    if (team.size == 1 || omp_in_parallel()) {  // no teams within teams
        team.size = 1;
        fn(ctx, &team, 0, 1);
        return;
    }
#pragma omp parallel num_threads(team.size)
    {
#pragma omp single
        team.size = omp_get_num_threads();  // may be fewer than asked for
        fn(ctx, &team, omp_get_thread_num(), team.size);
    }
}

#else

typedef struct Member {
    OmTeamFn fn;
    void* ctx;
    OmTeam* team;
    int rank;
} Member;

static _Thread_local bool is_in_team;

static void* run_member(void* arg) {
    Member* m = arg;
    is_in_team = true;
    m->fn(m->ctx, m->team, m->rank, m->team->size);
    is_in_team = false;
    return NULL;
}

// Threads that wait at a gate until the size of the team is known: creating one may fail.
typedef struct Gate {
    Member member;
    atomic_int* is_open;
} Gate;

static void* run_gated(void* arg) {
    Gate* gate = arg;
    while (!atomic_load(gate->is_open)) sched_yield();
    return run_member(&gate->member);
}

void om_parallel_team(int nworker, OmTeamFn fn, void* ctx) {
    int wanted = is_in_team ? 1 : team_size(nworker);
    OmTeam team = {.size = 1};
    pthread_t thread[OM_MAX_WORKER];
    Gate gate[OM_MAX_WORKER];
    atomic_int is_open = 0;
    for (int i = 1; i < wanted; ++i) {
        gate[i] = (Gate){{fn, ctx, &team, i}, &is_open};
        if (pthread_create(&thread[i], NULL, run_gated, &gate[i]) != 0) break;
        team.size = i + 1;
    }
    atomic_store(&is_open, 1);
    bool was_in_team = is_in_team;
    is_in_team = true;
    fn(ctx, &team, 0, team.size);
    is_in_team = was_in_team;
    for (int i = 1; i < team.size; ++i) pthread_join(thread[i], NULL);
}

#endif

// ---- loops --------------------------------------------------------------------------------------------

typedef struct Loop {
    OmRangeFn fn;
    void* ctx;
    int n, grain;
    atomic_int next;  // the next block to hand out
} Loop;

static void run_loop(void* ctx, OmTeam* team, int rank, int size) {
    (void)team, (void)rank, (void)size;
    Loop* loop = ctx;
    int nblock = om_block_count(loop->n, loop->grain);
    for (;;) {
        int block = atomic_fetch_add_explicit(&loop->next, 1, memory_order_relaxed);
        if (block >= nblock) return;
        int begin = block * loop->grain;
        int end = loop->n - begin < loop->grain ? loop->n : begin + loop->grain;
        loop->fn(loop->ctx, begin, end, block);
    }
}

void om_parallel_for(int nworker, int n, int grain, OmRangeFn fn, void* ctx) {
    if (n <= 0) return;
    if (grain < 1) grain = 1;
    Loop loop = {.fn = fn, .ctx = ctx, .n = n, .grain = grain};
    int worker = team_size(nworker), nblock = om_block_count(n, grain);
    om_parallel_team(worker < nblock ? worker : nblock, run_loop, &loop);
}
