// fem_simd.h: four floats at a time, in the compiler's portable vector types.
#ifndef OMENTUM_FEM_SIMD_H
#define OMENTUM_FEM_SIMD_H

#include "fem/fem_internal.h"

typedef float V4 __attribute__((vector_size(16)));
typedef float V4u __attribute__((vector_size(16), aligned(4), may_alias));

OM__INLINE V4 load4(const float* p) { return (V4)(*(const V4u*)p); }
OM__INLINE void store4(float* p, V4 v) { *(V4u*)p = (V4u)v; }
OM__INLINE V4 splat(float f) {
    V4 v = {f, f, f, f};
    return v;
}

/// Four rows `from` floats apart to four columns `to` floats apart.
OM__INLINE void transpose4(const float* in, int from, float* out, int to) {
    V4 a = load4(in), b = load4(in + from), c = load4(in + 2 * from), d = load4(in + 3 * from);
    V4 ab = __builtin_shufflevector(a, b, 0, 4, 1, 5),
       cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    V4 AB = __builtin_shufflevector(a, b, 2, 6, 3, 7),
       CD = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    store4(out, __builtin_shufflevector(ab, cd, 0, 1, 4, 5));
    store4(out + to, __builtin_shufflevector(ab, cd, 2, 3, 6, 7));
    store4(out + 2 * to, __builtin_shufflevector(AB, CD, 0, 1, 4, 5));
    store4(out + 3 * to, __builtin_shufflevector(AB, CD, 2, 3, 6, 7));
}

#endif
