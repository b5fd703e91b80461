// Allocation, arenas, statuses and messages.
#include "test_common.h"

static void alloc_is_aligned_and_counted(void** state) {
    (void)state;
    int64_t alive = om_alloc_alive(), count = om_alloc_count();
    double* p = om_alloc(3, sizeof *p);
    char* q = om_calloc(100, 1);
    assert_non_null(p);
    assert_int_equal((uintptr_t)p % 64, 0);
    assert_int_equal((uintptr_t)q % 64, 0);
    for (int i = 0; i < 100; ++i) assert_int_equal(q[i], 0);
    assert_int_equal(om_alloc_alive() - alive, 2);
    om_free(p);
    om_free(q);
    om_free(NULL);
    assert_int_equal(om_alloc_alive(), alive);
    assert_int_equal(om_alloc_count() - count, 2);
}

static void overflowing_sizes_are_refused(void** state) {
    (void)state;
    assert_null(om_alloc(SIZE_MAX / 2, 3));
    assert_non_null(strstr(om_error_message(), "address space"));
    OmArena arena;
    assert_ok(om_arena_create(1024, &arena));
    assert_null(om_arena_push(&arena, SIZE_MAX / 2, 3));
    om_arena_destroy(&arena);
}

static void realloc_keeps_the_contents(void** state) {
    (void)state;
    int* p = om_alloc(4, sizeof *p);
    for (int i = 0; i < 4; ++i) p[i] = i;
    p = om_realloc(p, 4, 1000, sizeof *p);
    for (int i = 0; i < 4; ++i) assert_int_equal(p[i], i);
    om_free(p);
}

static void* refuse(void* ctx, size_t size, size_t align) {
    (void)ctx, (void)size, (void)align;
    return NULL;
}
static void ignore(void* ctx, void* ptr) { (void)ctx, (void)ptr; }

static void a_refusing_allocator_gives_null(void** state) {
    (void)state;
    OmAllocator none = {refuse, ignore, NULL};
    om_allocator_set(&none);
    void* p = om_alloc(1, 8);
    OmText text = {0};
    OmStatus status = om_text_append(&text, "x");
    om_allocator_set(NULL);
    assert_null(p);
    assert_int_equal(status, OM_NO_MEMORY);
}

static void arena_marks_and_releases(void** state) {
    (void)state;
    OmArena arena;
    assert_ok(om_arena_create(1024, &arena));
    size_t mark = om_arena_mark(&arena);
    void* a = om_arena_push(&arena, 10, 10);
    assert_non_null(a);
    assert_non_null(om_arena_push(&arena, 1, 800));
    assert_null(om_arena_push(&arena, 1, 200));
    om_arena_release(&arena, mark);
    assert_ptr_equal(om_arena_push(&arena, 1, 200), a);
    assert_int_equal(arena.peak, 128 + 832);
    om_arena_destroy(&arena);
}

static OmStatus fails_with(int value) {
    OM_CHECK(value > 0, OM_INVALID, "value %d must be positive", value);
    return OM_OK;
}
static OmStatus forwards(int value) {
    OM_TRY(fails_with(value));
    return OM_NOT_CONVERGED;
}

static void messages_travel_with_statuses(void** state) {
    (void)state;
    assert_int_equal(forwards(1), OM_NOT_CONVERGED);
    assert_int_equal(forwards(-3), OM_INVALID);
    assert_string_equal(om_error_message(), "value -3 must be positive");
    assert_int_equal(om_error_prefix(OM_INVALID, "%s:%d", "a.yaml", 7), OM_INVALID);
    assert_string_equal(om_error_message(), "a.yaml:7: value -3 must be positive");
    om_error(OM_IO, "again: %s", om_error_message());
    assert_string_equal(om_error_message(), "again: a.yaml:7: value -3 must be positive");
    assert_string_equal(om_status_text(OM_UNSAT), "no solution exists");
}

static void long_messages_are_cut(void** state) {
    (void)state;
    char big[3000];
    memset(big, 'x', sizeof big - 1);
    big[sizeof big - 1] = 0;
    om_error(OM_IO, "%s", big);
    om_error_prefix(OM_IO, "%s", big);
    assert_int_equal(strlen(om_error_message()), 1023);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(alloc_is_aligned_and_counted),
        cmocka_unit_test(overflowing_sizes_are_refused),
        cmocka_unit_test(realloc_keeps_the_contents),
        cmocka_unit_test(a_refusing_allocator_gives_null),
        cmocka_unit_test(arena_marks_and_releases),
        cmocka_unit_test(messages_travel_with_statuses),
        cmocka_unit_test(long_messages_are_cut),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
