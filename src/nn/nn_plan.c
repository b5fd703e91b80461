// nn_plan.c: offsets for pieces of memory with known lives: largest first, each at the lowest offset that
// is free during its life (greedy by size; Pisarchyk & Lee 2020).
#include <stdlib.h>

#include "nn/nn_internal.h"

typedef struct Order {
    size_t bytes;
    int index;
} Order;

static int larger_first(const void* a, const void* b) {
    const Order *x = a, *y = b;
    if (x->bytes != y->bytes) return x->bytes < y->bytes ? 1 : -1;
    return x->index - y->index;
}

static bool live_together(const OmPiece* a, const OmPiece* b) {
    return a->begin <= b->end && b->begin <= a->end;
}

static size_t round_up(size_t bytes) { return (bytes + 63) / 64 * 64; }

OmStatus om__plan_pieces(int num, OmPiece* piece, size_t* size) {
    *size = 0;
    Order* order = om_alloc((size_t)num, sizeof *order);
    if (!order) return OM_NO_MEMORY;
    for (int i = 0; i < num; ++i) order[i] = (Order){piece[i].bytes, i};
    qsort(order, (size_t)num, sizeof *order, larger_first);
    for (int i = 0; i < num; ++i) {
        OmPiece* p = &piece[order[i].index];
        // Move past each overlapping piece until none overlaps: at most once past every one.
        size_t at = 0;
        bool is_free = false;
        while (!is_free) {
            is_free = true;
            for (int k = 0; k < i; ++k) {
                const OmPiece* q = &piece[order[k].index];
                size_t q_end = q->at + round_up(q->bytes);
                if (!live_together(p, q) || at >= q_end || at + round_up(p->bytes) <= q->at)
                    continue;
                at = q_end;
                is_free = false;
            }
        }
        p->at = at;
        if (at + round_up(p->bytes) > *size) *size = at + round_up(p->bytes);
    }
    om_free(order);
    return OM_OK;
}
