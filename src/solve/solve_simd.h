// solve_simd.h: one vertex in four lanes. A 3x3 block stored by columns is three overlapping loads; the
// fourth lane then holds rubbish from the next column, which is cleared before it is stored.
#ifndef OMENTUM_SOLVE_SIMD_H
#define OMENTUM_SOLVE_SIMD_H

#include <stddef.h>

typedef float V4 __attribute__((vector_size(16)));
typedef float V4u __attribute__((vector_size(16), aligned(4), may_alias));
typedef int I4 __attribute__((vector_size(16)));

static inline V4 load4(const float* p) { return (V4)(*(const V4u*)p); }
static inline void store4(float* p, V4 v) { *(V4u*)p = (V4u)v; }
static inline void store3(float* p, V4 v) {
    p[0] = v[0];
    p[1] = v[1];
    p[2] = v[2];
}
static inline V4 clear_last(V4 v) {
    const I4 mask = {-1, -1, -1, 0};
    return (V4)((I4)v & mask);
}
static inline V4 splat(float f) {
    V4 v = {f, f, f, f};
    return v;
}
static inline float sum4(V4 v) { return (v[0] + v[1]) + (v[2] + v[3]); }

// Column-major 3x3 block times vertex value, added to three independent sums.
static inline void add_block(const float* v, const float* x, V4* a0, V4* a1, V4* a2) {
    *a0 += load4(v) * splat(x[0]);
    *a1 += load4(v + 3) * splat(x[1]);
    *a2 += load4(v + 6) * splat(x[2]);
}

#endif
