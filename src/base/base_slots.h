// base_slots.h: a number of things that threads take in turn.
#ifndef OMENTUM_BASE_SLOTS_H
#define OMENTUM_BASE_SLOTS_H

#include "omentum/base.h"

typedef struct OmSlots OmSlots;

/// n free slots, 0 to n - 1.
OmStatus om__slots_create(int n, OmSlots** slots);
void om__slots_destroy(OmSlots* slots);
/// The lowest free slot; the thread sleeps until there is one. Then it belongs to the caller.
int om__slots_take(OmSlots* slots);
/// Give a taken slot back; a thread that waits gets it.
void om__slots_give(OmSlots* slots, int slot);

#endif
