// fem_lanes.h: sixteen floats at a time, one element a lane.
//
// The compiler splits a vector of sixteen into vectors of the processor. Everything is inlined into the
// clones of one function (base_multiversion.h).
#ifndef OMENTUM_FEM_LANES_H
#define OMENTUM_FEM_LANES_H

#include <string.h>

#include "fem/fem_internal.h"

typedef float V16 __attribute__((vector_size(64)));
typedef int I16 __attribute__((vector_size(64)));

OM__INLINE V16 lanes_of(const float* p) {
    V16 v;
    memcpy(&v, p, sizeof v);
    return v;
}
OM__INLINE void lanes_store(float* p, V16 v) { memcpy(p, &v, sizeof v); }
OM__INLINE V16 all(float f) {
    V16 v = {f, f, f, f, f, f, f, f, f, f, f, f, f, f, f, f};
    return v;
}
OM__INLINE V16 where(I16 mask, V16 yes, V16 no) {
    return (V16)((mask & (I16)yes) | (~mask & (I16)no));
}
OM__INLINE V16 max16(V16 a, V16 b) { return where(a > b, a, b); }
OM__INLINE V16 abs16(V16 a) { return (V16)((I16)a & 0x7fffffff); }
/// 1 / sqrt(a) for a in [1e-37, 1e37]: a guess from the bits, three steps of Newton, 2e-7.
OM__INLINE V16 rsqrt16(V16 a) {
    V16 y = (V16)(0x5f3759df - ((I16)a >> 1)), half = a * 0.5F;
    y *= 1.5F - half * y * y;
    y *= 1.5F - half * y * y;
    y *= 1.5F - half * y * y;
    return y;
}
/// ln a for a > 0: a = 2^e m with m in [sqrt(1/2), sqrt(2)), then the series of atanh((m - 1) / (m + 1)), 1e-7.
OM__INLINE V16 log16(V16 a) {
    I16 bits = (I16)a - 0x3f3504f3;  // bits of sqrt(1/2)
    I16 exponent = bits >> 23;
    V16 m = (V16)((bits & 0x007fffff) + 0x3f3504f3);
    V16 e = __builtin_convertvector(exponent, V16);
    V16 t = (m - 1.0F) / (m + 1.0F), t2 = t * t;
    V16 series = all(0.22222222F) + t2 * 0.18181818F;
    series = 0.28571429F + t2 * series;
    series = 0.4F + t2 * series;
    series = 0.66666667F + t2 * series;
    series = 2.0F + t2 * series;
    return e * 0.69314718F + t * series;
}

#endif
