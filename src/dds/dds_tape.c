// dds_tape.c: messages wait in memory until a thread of its own writes them: a disk that is slow or stopped does not
// stop the arms.
//
//   arms, pictures --copy--> block -> block -> block --the thread takes all--> dds_mcap.c --> the disk
//
// `lock` is held to link blocks and to copy a small message, never while the disk is waited for, and passes priority
// on: a thread of low priority that holds it runs with that of the arms that wait. A large message is copied into a
// block of its own before the lock is taken. Blocks that were written are used again: in steady state nothing is
// allocated. What is more than TAPE_MOST behind ends the recording with an error: no message is left out silently.
#include "dds/dds_tape.h"

#include <pthread.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "omentum/base_job.h"

#define BLOCK_SIZE ((size_t)1 << 20)  // bytes
#define LARGE (BLOCK_SIZE / 16)       // of a message with a block of its own
#define PERIOD_MS 100                 // between two looks of the thread
#define MOST_SPARE 4                  // blocks

typedef struct Block {
    struct Block* next;
    size_t len, room;  // bytes
    unsigned char data[];
} Block;

typedef struct Entry {  // in front of the bytes of a message
    int channel;
    double time;
    size_t size;
} Entry;

struct Tape {
    char path[256];
    Mcap* mcap;  // under `file`
    pthread_mutex_t file, lock;
    pthread_cond_t wake;
    OmJob* job;
    // under `lock`
    Block *first, *last, *spare;
    int nspare;
    size_t waiting, most;  // bytes
    bool is_closing;
    OmStatus status;  // of the thread that writes
    char message[400];
    void (*before_write)(void* ctx);
    void* ctx;
};

// ---- blocks -------------------------------------------------------------------------------------------------------

static Block* make_block(size_t room) {
    Block* b = om_alloc(sizeof *b + room, 1);
    if (b) *b = (Block){.room = room};
    return b;
}

static void free_blocks(Block* b) {
    while (b) {
        Block* next = b->next;
        om_free(b);
        b = next;
    }
}

static void put(Block* b, const Entry* entry, const void* cdr) {
    memcpy(b->data + b->len, entry, sizeof *entry);
    if (entry->size > 0) memcpy(b->data + b->len + sizeof *entry, cdr, entry->size);
    b->len += sizeof *entry + entry->size;
}

static void link_block(Tape* t, Block* b) {
    b->next = NULL;
    if (t->last)
        t->last->next = b;
    else
        t->first = b;
    t->last = b;
}

// A block with room for `need` bytes, the last that waits.
static Block* find_room(Tape* t, size_t need) {
    if (t->last && t->last->room - t->last->len >= need) return t->last;
    Block* b = t->spare;
    if (b) {
        t->spare = b->next;
        --t->nspare;
        b->len = 0;
    } else
        b = make_block(BLOCK_SIZE);
    if (b) link_block(t, b);
    return b;
}

static void give_back(Tape* t, Block* b) {
    while (b) {
        Block* next = b->next;
        if (b->room == BLOCK_SIZE && t->nspare < MOST_SPARE) {
            b->next = t->spare;
            t->spare = b;
            ++t->nspare;
        } else
            om_free(b);
        b = next;
    }
}

// ---- the thread that writes ---------------------------------------------------------------------------------------

static OmStatus write_blocks(Mcap* mcap, const Block* b) {
    for (; b; b = b->next)
        for (size_t at = 0; at < b->len;) {
            Entry e;
            memcpy(&e, b->data + at, sizeof e);
            at += sizeof e;
            OM_TRY(om__mcap_write(mcap, e.channel, e.time, b->data + at, e.size));
            at += e.size;
        }
    return OM_OK;
}

// Wait for a period, a full block, or the end; then take all that waits. @return null: nothing waits, and it is the end
static Block* take_blocks(Tape* t) {
    Block* b = NULL;
    pthread_mutex_lock(&t->lock);
    while (!b && !(t->is_closing && !t->first)) {
        struct timespec until;
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_nsec += PERIOD_MS * 1000000;
        if (until.tv_nsec >= 1000000000) until.tv_nsec -= 1000000000, ++until.tv_sec;
        if (!t->is_closing && t->waiting < BLOCK_SIZE)
            pthread_cond_timedwait(&t->wake, &t->lock, &until);
        b = t->first;
        t->first = t->last = NULL;
    }
    pthread_mutex_unlock(&t->lock);
    return b;
}

// After an error what comes is dropped; the next om__tape_write returns the error.
static OmStatus write_all(void* ctx, const OmProgress* progress) {
    Tape* t = ctx;
    OmStatus status = OM_OK;
    (void)progress;
    for (Block* b; (b = take_blocks(t)) != NULL;) {
        pthread_mutex_lock(&t->lock);
        void (*before)(void*) = t->before_write;
        void* before_ctx = t->ctx;
        pthread_mutex_unlock(&t->lock);
        if (before) before(before_ctx);
        size_t size = 0;
        for (const Block* k = b; k; k = k->next) size += k->len;
        pthread_mutex_lock(&t->file);
        if (status == OM_OK) status = write_blocks(t->mcap, b);
        pthread_mutex_unlock(&t->file);
        pthread_mutex_lock(&t->lock);
        if (status < 0 && t->status == OM_OK) {
            t->status = status;
            snprintf(t->message, sizeof t->message, "%s", om_error_message());
        }
        t->waiting -= size;
        give_back(t, b);
        pthread_mutex_unlock(&t->lock);
    }
    return OM_OK;
}

// ---- the others ---------------------------------------------------------------------------------------------------

static OmStatus append(Tape* t, const Entry* entry, const void* cdr, Block* own) {
    const size_t need = sizeof *entry + entry->size;
    if (t->status < 0) return om_error(t->status, "%s", t->message);
    OM_CHECK(t->waiting + need <= t->most, OM_IO,
             "%s: the disk is too slow: %zu MB wait for it; the recording ends", t->path,
             t->waiting >> 20);
    Block* b = own ? own : find_room(t, need);
    if (!b) return OM_NO_MEMORY;
    if (own)
        link_block(t, own);
    else
        put(b, entry, cdr);
    t->waiting += need;
    if (t->waiting >= BLOCK_SIZE) pthread_cond_signal(&t->wake);
    return OM_OK;
}

OmStatus om__tape_write(Tape* tape, int channel, double time, const void* cdr, size_t size) {
    const Entry entry = {channel, time, size};
    Block* own = NULL;
    if (size >= LARGE) {
        own = make_block(sizeof entry + size);
        if (!own) return OM_NO_MEMORY;
        put(own, &entry, cdr);
    }
    pthread_mutex_lock(&tape->lock);
    const OmStatus status = append(tape, &entry, cdr, own);
    pthread_mutex_unlock(&tape->lock);
    if (status < 0) om_free(own);
    return status;
}

OmStatus om__tape_add(Tape* tape, const McapTopic* topic, int* channel) {
    pthread_mutex_lock(&tape->file);
    const OmStatus status = om__mcap_add(tape->mcap, topic, channel);
    pthread_mutex_unlock(&tape->file);
    return status;
}

void om__tape_hinder(Tape* tape, size_t most, void (*fn)(void* ctx), void* ctx) {
    pthread_mutex_lock(&tape->lock);
    tape->most = most;
    tape->before_write = fn;
    tape->ctx = ctx;
    pthread_mutex_unlock(&tape->lock);
}

static void init_locks(Tape* t) {
    pthread_mutexattr_t inherit;
    pthread_condattr_t monotonic;
    pthread_mutexattr_init(&inherit);
    pthread_mutexattr_setprotocol(&inherit, PTHREAD_PRIO_INHERIT);
    pthread_mutex_init(&t->lock, &inherit);
    pthread_mutexattr_destroy(&inherit);
    pthread_mutex_init(&t->file, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&t->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
}

OmStatus om__tape_open(const char* path, Tape** tape) {
    *tape = NULL;
    Tape* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    snprintf(t->path, sizeof t->path, "%s", path);
    t->most = TAPE_MOST;
    init_locks(t);
    OmStatus status = om__mcap_open(path, &t->mcap);
    if (status == OM_OK) {
        status = om_job_start(write_all, t, &t->job);
        if (status < 0) unlink(path);
    }
    if (status < 0)
        (void)om__tape_close(t);
    else
        *tape = t;
    return status;
}

OmStatus om__tape_close(Tape* tape) {
    if (!tape) return OM_OK;
    pthread_mutex_lock(&tape->lock);
    tape->is_closing = true;
    pthread_cond_signal(&tape->wake);
    pthread_mutex_unlock(&tape->lock);
    (void)om_job_join(tape->job);
    OmStatus status = om__mcap_close(tape->mcap);
    if (tape->status < 0) status = om_error(tape->status, "%s", tape->message);
    free_blocks(tape->first);
    free_blocks(tape->spare);
    pthread_cond_destroy(&tape->wake);
    pthread_mutex_destroy(&tape->lock);
    pthread_mutex_destroy(&tape->file);
    om_free(tape);
    return status;
}
