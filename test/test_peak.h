// test_peak.h: the most bytes of the library's allocator that were alive at once.
#ifndef OMENTUM_TEST_PEAK_H
#define OMENTUM_TEST_PEAK_H

#include "test_common.h"

static size_t test_peak_alive, test_peak_most;

static inline void* test_peak_alloc(void* ctx, size_t size, size_t align) {
    (void)ctx;
    // the block's size stands in front of it
    size_t head = align < sizeof size ? sizeof size : align;
    char* block = aligned_alloc(align, (size + head + align - 1) / align * align);
    if (!block) return NULL;
    memcpy(block, &size, sizeof size);
    test_peak_alive += size;
    if (test_peak_alive > test_peak_most) test_peak_most = test_peak_alive;
    return block + head;
}

static inline void test_peak_free(void* ctx, void* ptr) {
    size_t size, head = 64;  // of base_alloc.c
    (void)ctx;
    memcpy(&size, (char*)ptr - head, sizeof size);
    test_peak_alive -= size;
    free((char*)ptr - head);
}

/// Count from now on; only one thread may allocate, and what is allocated between begin and end is freed there.
static inline void test_peak_begin(void) {
    static const OmAllocator counting = {test_peak_alloc, test_peak_free, NULL};
    test_peak_alive = test_peak_most = 0;
    om_allocator_set(&counting);
}
static inline size_t test_peak_end(void) {
    om_allocator_set(NULL);
    return test_peak_most;
}

#endif
