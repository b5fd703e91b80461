// solve_simd.h: one vertex in four lanes. A 3x3 block stored by columns is three overlapping loads; the
// fourth lane then holds a value of the next column, which is cleared before the result is stored.
#ifndef OMENTUM_SOLVE_SIMD_H
#define OMENTUM_SOLVE_SIMD_H

#include <stddef.h>

#include "base/base_simd.h"

static inline void store3(float* p, V4 v) {
    p[0] = v[0];
    p[1] = v[1];
    p[2] = v[2];
}
static inline V4 clear_last(V4 v) {
    const I4 mask = {-1, -1, -1, 0};
    return (V4)((I4)v & mask);
}
#define OM_SPREAD(v, lane) __builtin_shufflevector(v, v, lane, lane, lane, lane)
static inline float sum4(V4 v) { return (v[0] + v[1]) + (v[2] + v[3]); }

// A vertex value of a vector, which is 16-byte aligned.
static inline V4 vertex(const float* x, int i) { return *(const V4*)(x + 4 * (size_t)i); }

// Column-major 3x3 block times vertex value, added to three independent sums.
static inline void add_block(const float* v, V4 xv, V4 sum[3]) {
    sum[0] += load4(v) * OM_SPREAD(xv, 0);
    sum[1] += load4(v + 3) * OM_SPREAD(xv, 1);
    sum[2] += load4(v + 6) * OM_SPREAD(xv, 2);
}

// Sum of `num` blocks times the values of their vertices. Three blocks at a time: nine sums hide the
// latency of the multiply-adds (measured: 0.78 ns a block, 1.2 with three sums).
static inline V4 row_product(const float* v, const int* col, int num, const float* x) {
    V4 a[3] = {{0}}, b[3] = {{0}}, c[3] = {{0}};
    for (; num >= 3; num -= 3, v += 27, col += 3) {
        add_block(v, vertex(x, col[0]), a);
        add_block(v + 9, vertex(x, col[1]), b);
        add_block(v + 18, vertex(x, col[2]), c);
    }
    if (num > 0) add_block(v, vertex(x, col[0]), a);
    if (num > 1) add_block(v + 9, vertex(x, col[1]), b);
    return clear_last((a[0] + b[0] + c[0]) + (a[1] + b[1] + c[1]) + (a[2] + b[2] + c[2]));
}

static inline V4 block_product(const float* v, V4 xv) {
    V4 a[3] = {{0}};
    add_block(v, xv, a);
    return clear_last(a[0] + a[1] + a[2]);
}

#endif
