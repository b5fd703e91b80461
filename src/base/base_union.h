// base_union.h: disjoint sets of numbers, by their parents (union-find with path halving).
#ifndef OMENTUM_BASE_UNION_H
#define OMENTUM_BASE_UNION_H

/// The root of i; a root is its own parent.
static inline int om__find_root(int* parent, int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

#endif
