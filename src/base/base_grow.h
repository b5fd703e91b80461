// base_grow.h: arrays that grow by doubling.
#ifndef OMENTUM_BASE_GROW_H
#define OMENTUM_BASE_GROW_H

#include "omentum/base.h"

/// A copy of `array`, which holds `num` elements, with room for twice *capacity of them, at least `first`; *capacity
/// is then the new room. Null with the message set, and nothing changed, where the number exceeds an int or memory
/// does not suffice.
void* om__array_grow(void* array, int num, int* capacity, int first, size_t size);

/// Room for one more element of a typed array; returns OM_NO_MEMORY from the calling function if there is none.
#define OM_GROW(array, num, capacity, first)                                                  \
    do {                                                                                      \
        if ((num) < (capacity)) break;                                                        \
        void* grown_ = om__array_grow((array), (num), &(capacity), (first), sizeof *(array)); \
        if (!grown_) return OM_NO_MEMORY;                                                     \
        (array) = grown_;                                                                     \
    } while (0)

#endif
