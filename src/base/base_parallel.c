// base_parallel.c: the threads of loops and teams; nothing but base_job.c makes others.
//
// Work is cut into blocks that do not depend on the worker count, so results that are reduced in block order have the
// same bytes with one worker or many.
//
// One pool of helper threads serves the process: at most one thread less than there are processors. A job is offered
// to idle helpers. A helper accepts an offer by an atomic exchange; the caller revokes offers that were not accepted
// in time by the same exchange. So no thread waits for a helper that the system does not run:
//   - a loop begins at once; helpers that arrive join it, and the caller waits only for helpers that hold a block;
//   - a team, whose members split work by rank, starts with the helpers that arrived within WINDOW.
// A waiting thread spins for a while, because a barrier of a CG iteration lasts microseconds and a futex costs more,
// and then sleeps on a futex. On a crowded machine (base_processor.c) it sleeps at once, teams are smaller, and a loop
// is offered to helpers only after LONG. None of this changes a result.
// Rejected: OpenMP, whose threads spin for 3 ms at the end of a region, and whose teams wait for every member.
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <linux/futex.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "base/base_processor.h"

#define CHUNK 500          // pauses between two reads of the load: some ten microseconds
#define MEMBER_CHUNKS 100  // spins of a team member before it sleeps: a millisecond
#define IDLE_CHUNKS 20     // spins of an idle helper before it sleeps
#define WINDOW 300e-6      // s in which members of a team must arrive
// s without teams after a team that no helper joined; doubled each time this repeats
#define ALONE_FOR 0.05
#define ALONE_FOR_MOST 1.0
#define LONG 2e-3  // s after which a loop is offered to helpers on a crowded machine
#define HAS_SLEEPER 0x80000000u

struct OmTeam {
    int size;
    atomic_int waiting;      // members at the barrier
    atomic_uint generation;  // counts completed barriers
    atomic_int nsleep;       // members that sleep until `generation` changes
};

typedef struct Loop {
    OmRangeFn fn;
    void* ctx;
    int n, grain;
    atomic_int next;  // the next block to hand out
} Loop;

// The work that is offered: a loop, or a function for a team.
typedef struct Job {
    Loop* loop;
    OmTeamFn fn;
    void* ctx;
    OmTeam team;
    atomic_int joined;
    atomic_uint start;     // of a team: its size, when it is known
    atomic_int nsleep;     // members that sleep until `start` changes
    atomic_uint finished;  // helpers that have finished, and HAS_SLEEPER
} Job;

typedef struct Helper {
    _Atomic(Job*) offer;   // null: idle
    atomic_uint sleeping;  // 1: the helper sleeps on this word
} Helper;

static Job taken;  // its address marks a helper that works
static Helper helper[OM_MAX_WORKER - 1];
static atomic_int nhelper, nrunning;  // threads of the pool and their callers that do not sleep
static pthread_mutex_t growing = PTHREAD_MUTEX_INITIALIZER;
static atomic_bool is_forced;
static _Atomic double alone_until, alone_for;  // om_clock_now, s
static _Thread_local bool is_inside;

// ---- number of workers ----------------------------------------------------------------------------------

void om_worker_force(bool is_on) { atomic_store(&is_forced, is_on); }

// A fixed number of workers, used without looking at the load.
static bool is_literal(int requested) { return requested > 0 && atomic_load(&is_forced); }

int om_worker_count(int requested) {
    int limit = om__processor_limit();
    if (!is_literal(requested) && (requested <= 0 || requested > limit)) requested = limit;
    return requested < OM_MAX_WORKER ? requested : OM_MAX_WORKER;
}

static int own_threads(void) { return 1 + atomic_load_explicit(&nrunning, memory_order_relaxed); }

int om_worker_free(int requested) {
    int size = om_worker_count(requested);
    if (size == 1 || is_literal(requested)) return size;
    int num = om__processor_free_now(own_threads());
    return num < size ? num : size;
}

bool om_worker_is_inside(void) { return is_inside; }

// The requested number, limited by the free processors.
static int team_size(int requested) {
    int size = om_worker_count(requested);
    if (size == 1 || is_literal(requested)) return size;
    int num = om__processor_free(own_threads());
    if (om_clock_now() < atomic_load_explicit(&alone_until, memory_order_relaxed)) num = 1;
    return num < size ? num : size;
}

static void note_missed(double now) {
    double until = atomic_load(&alone_until), last = atomic_load(&alone_for);
    bool is_new = last == 0 || now > until + ALONE_FOR_MOST;
    double next = is_new ? ALONE_FOR : 2 * last;
    next = next < ALONE_FOR_MOST ? next : ALONE_FOR_MOST;
    atomic_store(&alone_for, next);
    atomic_store(&alone_until, now + next);
}

// ---- waiting --------------------------------------------------------------------------------------------

static inline void pause_briefly(void) {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

static void sleep_on(atomic_uint* word, unsigned value) {
    atomic_fetch_sub(&nrunning, 1);
    syscall(SYS_futex, word, FUTEX_WAIT_PRIVATE, value, NULL, NULL, 0);
    atomic_fetch_add(&nrunning, 1);
}

static void wake(atomic_uint* word, int num) {
    syscall(SYS_futex, word, FUTEX_WAKE_PRIVATE, num, NULL, NULL, 0);
}

// More of our threads run than there are processors for them. A forced number of workers may be more than the machine
// has: then no thread spins for long.
static bool is_crowded(void) {
    if (atomic_load_explicit(&is_forced, memory_order_relaxed)) return true;
    int own = atomic_load_explicit(&nrunning, memory_order_relaxed);
    return om__processor_free(own) < own;
}

// Spin while the word has the value; false if the value did not change.
static bool spin_while(atomic_uint* word, unsigned value, int nchunk) {
    const int nspin = atomic_load_explicit(&is_forced, memory_order_relaxed) ? CHUNK / 20 : CHUNK;
    for (int chunk = 0; chunk < nchunk; ++chunk) {
        for (int spin = 0; spin < nspin; ++spin) {
            if (atomic_load_explicit(word, memory_order_acquire) != value) return true;
            pause_briefly();
        }
        if (is_crowded()) return false;
    }
    return false;
}

// Wait until the word changes. The thread that changes it calls change_word with the same counter.
static void wait_while(atomic_uint* word, unsigned value, atomic_int* nsleep) {
    if (spin_while(word, value, MEMBER_CHUNKS)) return;
    atomic_fetch_add(nsleep, 1);
    while (atomic_load(word) == value) sleep_on(word, value);
    atomic_fetch_sub(nsleep, 1);
}

static void change_word(atomic_uint* word, unsigned value, atomic_int* nsleep) {
    atomic_store(word, value);
    if (atomic_load(nsleep) > 0) wake(word, OM_MAX_WORKER);
}

void om_team_barrier(OmTeam* team) {
    if (team->size == 1) return;
    unsigned generation = atomic_load_explicit(&team->generation, memory_order_acquire);
    if (atomic_fetch_add_explicit(&team->waiting, 1, memory_order_acq_rel) == team->size - 1) {
        atomic_store_explicit(&team->waiting, 0, memory_order_relaxed);
        change_word(&team->generation, generation + 1, &team->nsleep);
        return;
    }
    wait_while(&team->generation, generation, &team->nsleep);
}

// ---- helpers --------------------------------------------------------------------------------------------

static void run_blocks(Loop* loop) {
    int nblock = om_block_count(loop->n, loop->grain);
    for (;;) {
        int block = atomic_fetch_add_explicit(&loop->next, 1, memory_order_relaxed);
        if (block >= nblock) return;
        int begin = block * loop->grain;
        int end = loop->n - begin < loop->grain ? loop->n : begin + loop->grain;
        loop->fn(loop->ctx, begin, end, block);
    }
}

static void run_job(Job* job) {
    if (job->loop) {
        run_blocks(job->loop);
    } else {
        int rank = atomic_fetch_add(&job->joined, 1) + 1;
        wait_while(&job->start, 0, &job->nsleep);
        job->fn(job->ctx, &job->team, rank, job->team.size);
    }
    // The job may be freed as soon as this is counted; waking needs only its address.
    if (atomic_fetch_add(&job->finished, 1) & HAS_SLEEPER) wake(&job->finished, 1);
}

// Wait for an offer.
static Job* wait_for_offer(Helper* h) {
    for (int chunk = 0;; ++chunk) {
        for (int spin = 0; spin < CHUNK; ++spin) {
            Job* job = atomic_load_explicit(&h->offer, memory_order_acquire);
            if (job) return job;
            pause_briefly();
        }
        if (chunk < IDLE_CHUNKS && !is_crowded()) continue;
        atomic_store(&h->sleeping, 1);
        if (!atomic_load(&h->offer)) sleep_on(&h->sleeping, 1);
        atomic_store(&h->sleeping, 0);
        chunk = 0;
    }
}

static void* run_helper(void* arg) {
    Helper* h = arg;
    is_inside = true;
    atomic_fetch_add(&nrunning, 1);
    for (;;) {
        Job* job = wait_for_offer(h);
        if (!atomic_compare_exchange_strong(&h->offer, &job, &taken)) continue;
        run_job(job);
        atomic_store(&h->offer, NULL);
    }
    return NULL;
}

// A child of fork has only the caller's thread.
static void forget_helpers(void) {
    for (int i = 0; i < OM_MAX_WORKER - 1; ++i) {
        atomic_store(&helper[i].offer, NULL);
        atomic_store(&helper[i].sleeping, 0);
    }
    atomic_store(&nhelper, 0);
    atomic_store(&nrunning, 0);
    growing = (pthread_mutex_t)PTHREAD_MUTEX_INITIALIZER;
}

// Start threads until there are `wanted` or the system refuses more. True if one is new. Helper threads block all
// signals.
static bool grow_pool(int wanted) {
    static bool is_watched;
    if (atomic_load(&nhelper) >= wanted) return false;
    bool is_new = false;
    sigset_t all, old;
    pthread_attr_t attr;
    pthread_mutex_lock(&growing);
    if (!is_watched) is_watched = pthread_atfork(NULL, NULL, forget_helpers) == 0;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &old);
    pthread_attr_init(&attr);
    pthread_attr_setdetachstate(&attr, PTHREAD_CREATE_DETACHED);
    for (int n = atomic_load(&nhelper); n < wanted; ++n) {
        pthread_t thread;
        if (pthread_create(&thread, &attr, run_helper, &helper[n]) != 0) break;
        atomic_store(&nhelper, n + 1);
        is_new = true;
    }
    pthread_attr_destroy(&attr);
    pthread_sigmask(SIG_SETMASK, &old, NULL);
    pthread_mutex_unlock(&growing);
    return is_new;
}

// Offers of one job: the helpers that have or had one.
typedef struct Offers {
    int num, index[OM_MAX_WORKER - 1];
    bool is_new;  // a helper thread was just created: it may arrive late
} Offers;

static void offer_job(Job* job, int wanted, Offers* offers) {
    offers->is_new = grow_pool(wanted);
    for (int i = 0, n = atomic_load(&nhelper); i < n && offers->num < wanted; ++i) {
        Job* idle = NULL;
        if (!atomic_compare_exchange_strong(&helper[i].offer, &idle, job)) continue;
        if (atomic_exchange(&helper[i].sleeping, 0)) wake(&helper[i].sleeping, 1);
        offers->index[offers->num++] = i;
    }
}

// Revoke offers that no helper accepted; returns the number of helpers that have the job.
static int revoke_offers(Job* job, const Offers* offers) {
    int num = 0;
    for (int k = 0; k < offers->num; ++k) {
        Job* mine = job;
        num += !atomic_compare_exchange_strong(&helper[offers->index[k]].offer, &mine, NULL);
    }
    return num;
}

static void wait_for_helpers(Job* job, int num) {
    if (num == 0) return;
    unsigned value = 0;
    while ((value = atomic_load(&job->finished)) < (unsigned)num)
        if (!spin_while(&job->finished, value, MEMBER_CHUNKS)) break;
    if (value >= (unsigned)num) return;
    value = atomic_fetch_or(&job->finished, HAS_SLEEPER) | HAS_SLEEPER;
    for (; (value & ~HAS_SLEEPER) < (unsigned)num; value = atomic_load(&job->finished))
        sleep_on(&job->finished, value);
}

// ---- teams ----------------------------------------------------------------------------------------------

// Wait for members within the window, or for all members.
static void gather(Job* job, const Offers* offers, bool must_come) {
    double begin = om_clock_now();
    for (int spin = 0; atomic_load(&job->joined) < offers->num; ++spin) {
        pause_briefly();
        if (must_come && spin > CHUNK) sched_yield();
        if (must_come || spin % 64 != 63 || om_clock_now() - begin < WINDOW) continue;
        if (!offers->is_new) note_missed(om_clock_now());
        return;
    }
}

void om_parallel_team(int nworker, OmTeamFn fn, void* ctx) {
    Job job = {.fn = fn, .ctx = ctx, .team = {.size = 1}};
    Offers offers = {0};
    int wanted = is_inside ? 1 : team_size(nworker);  // no teams within teams
    if (wanted > 1) offer_job(&job, wanted - 1, &offers);
    if (offers.num == 0) {
        fn(ctx, &job.team, 0, 1);
        return;
    }
    atomic_fetch_add(&nrunning, 1);
    gather(&job, &offers, is_literal(nworker));
    int num = revoke_offers(&job, &offers);
    job.team.size = 1 + num;
    change_word(&job.start, 1 + (unsigned)num, &job.nsleep);
    is_inside = num > 0;
    fn(ctx, &job.team, 0, job.team.size);
    is_inside = false;
    wait_for_helpers(&job, num);
    atomic_fetch_sub(&nrunning, 1);
}

// ---- loops ----------------------------------------------------------------------------------------------

// Run blocks one by one until the loop has lasted LONG; false if none are left.
static bool begin_alone(Loop* loop) {
    int nblock = om_block_count(loop->n, loop->grain);
    double begin = om_clock_now();
    for (; atomic_load(&loop->next) < nblock; atomic_fetch_add(&loop->next, 1)) {
        int block = atomic_load(&loop->next), at = block * loop->grain;
        if (om_clock_now() - begin > LONG) return true;
        loop->fn(loop->ctx, at, loop->n - at < loop->grain ? loop->n : at + loop->grain, block);
    }
    return false;
}

void om_parallel_for(int nworker, int n, int grain, OmRangeFn fn, void* ctx) {
    if (n <= 0) return;
    if (grain < 1) grain = 1;
    Loop loop = {.fn = fn, .ctx = ctx, .n = n, .grain = grain};
    int max = is_inside ? 1 : om_worker_count(nworker), nblock = om_block_count(n, grain);
    max = max < nblock ? max : nblock;
    if (max == 1) {
        run_blocks(&loop);
        return;
    }
    Job job = {.loop = &loop};
    Offers offers = {0};
    int wanted = team_size(nworker);
    wanted = wanted < max ? wanted : max;
    is_inside = true;
    atomic_fetch_add(&nrunning, 1);
    if (wanted > 1)
        offer_job(&job, wanted - 1, &offers);
    else if (begin_alone(&loop))
        offer_job(&job, max - 1, &offers);
    run_blocks(&loop);
    wait_for_helpers(&job, revoke_offers(&job, &offers));
    atomic_fetch_sub(&nrunning, 1);
    is_inside = false;
}

typedef struct Band {  // a run of blocks of a loop
    OmRangeFn fn;
    void* ctx;
    int begin, block;  // first item and its block
} Band;

static void run_band(void* ctx, int begin, int end, int block) {
    const Band* b = ctx;
    b->fn(b->ctx, b->begin + begin, b->begin + end, b->block + block);
}

// Bands grow until one takes about a quarter of the period between two polls or more.
OmStatus om_parallel_for_stop(int nworker, int n, int grain, OmRangeFn fn, void* ctx) {
    if (!om_stop_is_set()) {
        om_parallel_for(nworker, n, grain, fn, ctx);
        return OM_OK;
    }
    if (grain < 1) grain = 1;
    int64_t size = (int64_t)om_worker_count(nworker) * grain;
    for (int64_t begin = 0; begin < n;) {
        const double start = om_clock_now();
        const int num = (int)(size < n - begin ? size : n - begin);
        Band band = {fn, ctx, (int)begin, (int)(begin / grain)};
        OM_TRY(om_stop_poll());
        om_parallel_for(nworker, num, grain, run_band, &band);
        begin += num;
        if (om_clock_now() - start < OM_STOP_PERIOD / 4) size *= 2;
    }
    return OM_OK;
}
