// base_alloc.c: the one allocator, and arenas.
//
// Every block is 64-byte aligned, so that rows of matrices start on cache lines and vector loads are
// aligned. The counters are atomic: any thread may allocate and free blocks.
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "omentum/base.h"

#define ALIGNMENT 64

static void* default_alloc(void* ctx, size_t size, size_t align) {
    (void)ctx;
    // aligned_alloc requires a multiple of the alignment
    size_t rounded = (size + align - 1) / align * align;
    return rounded < size ? NULL : aligned_alloc(align, rounded);
}

static void default_free(void* ctx, void* ptr) {
    (void)ctx;
    free(ptr);
}

static OmAllocator allocator = {default_alloc, default_free, NULL};
static atomic_llong count_total;
static atomic_llong count_alive;

void om_allocator_set(const OmAllocator* a) {
    OmAllocator standard = {default_alloc, default_free, NULL};
    allocator = a ? *a : standard;
}

void* om_alloc(size_t count, size_t size) {
    if (size != 0 && count > (SIZE_MAX - ALIGNMENT) / size) {
        om_error(OM_NO_MEMORY, "out of memory: %zu items of %zu bytes do not fit the address space",
                 count, size);
        return NULL;
    }
    size_t bytes = count * size;
    void* ptr = allocator.alloc(allocator.ctx, bytes ? bytes : 1, ALIGNMENT);
    if (!ptr) {
        om_error(OM_NO_MEMORY, "out of memory: %zu bytes were refused", bytes);
        return NULL;
    }
    atomic_fetch_add(&count_total, 1);
    atomic_fetch_add(&count_alive, 1);
    return ptr;
}

void* om_calloc(size_t count, size_t size) {
    void* ptr = om_alloc(count, size);
    if (ptr) memset(ptr, 0, count * size);
    return ptr;
}

void* om_realloc(void* ptr, size_t old_count, size_t new_count, size_t size) {
    void* grown = om_alloc(new_count, size);
    if (!grown) return NULL;
    size_t kept = old_count < new_count ? old_count : new_count;
    if (ptr && kept) memcpy(grown, ptr, kept * size);
    om_free(ptr);
    return grown;
}

void om_free(void* ptr) {
    if (!ptr) return;
    atomic_fetch_sub(&count_alive, 1);
    allocator.free(allocator.ctx, ptr);
}

int64_t om_alloc_count(void) { return (int64_t)atomic_load(&count_total); }
int64_t om_alloc_alive(void) { return (int64_t)atomic_load(&count_alive); }

OmStatus om_arena_create(size_t size, OmArena* arena) {
    memset(arena, 0, sizeof *arena);
    arena->base = om_alloc(size, 1);
    if (!arena->base) return OM_NO_MEMORY;
    arena->size = size;
    return OM_OK;
}

void om_arena_destroy(OmArena* arena) {
    if (!arena) return;
    om_free(arena->base);
    memset(arena, 0, sizeof *arena);
}

void* om_arena_push(OmArena* arena, size_t count, size_t size) {
    if (size != 0 && count > (SIZE_MAX - ALIGNMENT) / size) {
        om_error(OM_NO_MEMORY, "arena: %zu items of %zu bytes overflow", count, size);
        return NULL;
    }
    size_t bytes = (count * size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    if (bytes > arena->size - arena->used) {
        om_error(OM_NO_MEMORY, "arena of %zu bytes is full: %zu used, %zu wanted", arena->size,
                 arena->used, bytes);
        return NULL;
    }
    void* ptr = arena->base + arena->used;
    arena->used += bytes;
    if (arena->used > arena->peak) arena->peak = arena->used;
    return ptr;
}
