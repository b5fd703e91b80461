// shape_edge_table.c: a hash table with open addressing, at most half full.
#include "shape/shape_edge_table.h"

#include <limits.h>
#include <string.h>

void om__edge_table_done(OmEdgeTable* t) {
    om_free(t->end);
    om_free(t->slot);
    memset(t, 0, sizeof *t);
}

// The slot of an edge, or the free one where it belongs.
static int* find_slot(const OmEdgeTable* t, int lo, int hi) {
    const uint64_t h = ((uint64_t)(uint32_t)lo << 32 | (uint32_t)hi) * 0x9e3779b97f4a7c15u;
    const size_t last = (size_t)t->nslot - 1;
    for (size_t at = (size_t)(h >> 32) & last;; at = (at + 1) & last) {
        int* slot = &t->slot[at];
        if (*slot < 0 || (t->end[*slot][0] == lo && t->end[*slot][1] == hi)) return slot;
    }
}

int om__edge_find(const OmEdgeTable* t, int a, int b) {
    return t->nedge ? *find_slot(t, a < b ? a : b, a < b ? b : a) : -1;
}

static OmStatus grow(OmEdgeTable* t) {
    OM_CHECK(t->cap < INT_MAX / 8, OM_INVALID, "mesh: too many edges");
    const int cap = t->cap ? 2 * t->cap : 1024;
    int(*end)[2] = om_realloc(t->end, (size_t)t->cap, (size_t)cap, sizeof *end);
    if (!end) return OM_NO_MEMORY;
    t->end = end;
    int* slot = om_alloc(2 * (size_t)cap, sizeof *slot);
    if (!slot) return OM_NO_MEMORY;
    om_free(t->slot);
    t->slot = slot;
    t->cap = cap;
    t->nslot = 2 * cap;
    for (int i = 0; i < t->nslot; i++) slot[i] = -1;
    for (int i = 0; i < t->nedge; i++) *find_slot(t, end[i][0], end[i][1]) = i;
    return OM_OK;
}

OmStatus om__edge_add(OmEdgeTable* t, int a, int b) {
    if (t->nedge == t->cap) OM_TRY(grow(t));
    const int lo = a < b ? a : b, hi = a < b ? b : a;
    int* slot = find_slot(t, lo, hi);
    if (*slot >= 0) return OM_OK;
    t->end[t->nedge][0] = lo;
    t->end[t->nedge][1] = hi;
    *slot = t->nedge++;
    return OM_OK;
}
