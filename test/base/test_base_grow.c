// test_base_grow.c: arrays double, keep their elements, and say where they cannot grow.
#include <limits.h>

#include "base/base_grow.h"
#include "test_alloc.h"

typedef struct List {
    int64_t* value;
    int num, capacity;
} List;

static OmStatus add(List* l, int64_t value) {
    OM_GROW(l->value, l->num, l->capacity, 3);
    l->value[l->num++] = value;
    return OM_OK;
}

static void doubles(void** state) {
    (void)state;
    List l = {0};
    const int capacity[13] = {3, 3, 3, 6, 6, 6, 12, 12, 12, 12, 12, 12, 24};
    for (int i = 0; i < 13; ++i) {
        assert_ok(add(&l, 100 - i));
        assert_int_equal(l.capacity, capacity[i]);
    }
    for (int i = 0; i < 13; ++i) assert_int_equal(l.value[i], 100 - i);
    om_free(l.value);
}

static void refuses_overflow(void** state) {
    (void)state;
    List l = {.num = INT_MAX / 2 + 1, .capacity = INT_MAX / 2 + 1};
    assert_status(add(&l, 1), OM_NO_MEMORY);
    assert_non_null(strstr(om_error_message(), "cannot have more than"));
    assert_int_equal(l.capacity, INT_MAX / 2 + 1);
    assert_null(l.value);
}

static OmStatus add_four(void* ctx) {
    (void)ctx;
    List l = {0};
    OmStatus status = OM_OK;
    for (int i = 0; i < 4 && status == OM_OK; ++i) status = add(&l, i);
    om_free(l.value);
    return status;
}

static void memory(void** state) {
    (void)state;
    assert_int_equal(test_failing_allocations(add_four, NULL, 1), 2);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(doubles), cmocka_unit_test(refuses_overflow), cmocka_unit_test(memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
