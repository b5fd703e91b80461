// base_grow.c: arrays that grow by doubling.
#include "base/base_grow.h"

#include <limits.h>

void* om__array_grow(void* array, int num, int* capacity, int first, size_t size) {
    if (*capacity > INT_MAX / 2) {
        om_error(OM_NO_MEMORY, "an array cannot have more than %d elements", *capacity);
        return NULL;
    }
    int more = 2 * *capacity > first ? 2 * *capacity : first;
    void* grown = om_realloc(array, (size_t)num, (size_t)more, size);
    if (grown) *capacity = more;
    return grown;
}
