// test_alloc.h: an allocator that fails once, at every place in turn.
#ifndef OMENTUM_TEST_ALLOC_H
#define OMENTUM_TEST_ALLOC_H

#include "test_common.h"

static int test_alloc_countdown;
static int test_alloc_count;

static void* test_alloc_get(void* ctx, size_t size, size_t align) {
    (void)ctx;
    ++test_alloc_count;
    if (test_alloc_countdown-- == 0) return NULL;
    return aligned_alloc(align, (size + align - 1) / align * align);
}
static void test_alloc_free(void* ctx, void* ptr) {
    (void)ctx;
    free(ptr);
}

/// Run `work` with its first allocation failing, then its second, and so on by `stride`, until it succeeds;
/// each failure must be OM_NO_MEMORY and leave nothing behind. Returns how many failed.
static inline int test_failing_allocations(OmStatus (*work)(void* ctx), void* ctx, int stride) {
    const OmAllocator failing = {test_alloc_get, test_alloc_free, NULL};
    int64_t alive = om_alloc_alive();
    int nfail = 0;
    om_allocator_set(&failing);
    for (int at = 0;; at += stride, ++nfail) {
        test_alloc_countdown = at;
        OmStatus status = work(ctx);
        if (status >= 0) break;
        if (status != OM_NO_MEMORY || om_alloc_alive() != alive) {
            om_allocator_set(NULL);
            fail_msg("allocation %d failed: status %d (%s), %lld blocks leaked", at, (int)status,
                     om_error_message(), (long long)(om_alloc_alive() - alive));
        }
    }
    om_allocator_set(NULL);
    return nfail;
}

/// The stride of test_failing_allocations: `quick` in quick runs, 1 under OM_TEST_SLOW (om_test adds such a slow
/// test for each file that calls this function).
static inline int test_stride(int quick) { return getenv("OM_TEST_SLOW") ? 1 : quick; }

/// Allocations from now until test_count_end().
static inline void test_count_begin(void) {
    static const OmAllocator counting = {test_alloc_get, test_alloc_free, NULL};
    test_alloc_countdown = -1;
    test_alloc_count = 0;
    om_allocator_set(&counting);
}
static inline int test_count_end(void) {
    om_allocator_set(NULL);
    return test_alloc_count;
}

#endif
