// base_simd.h: vectors of floats and doubles in the compiler's portable vector types.
//
// The compiler splits a vector into the widths of the processor. All functions are inlined into the clones of one
// function (base_multiversion.h), so a vector is never an argument of a call. The digits in a name are the lanes.
#ifndef OMENTUM_BASE_SIMD_H
#define OMENTUM_BASE_SIMD_H

#include <string.h>

#include "base/base_multiversion.h"

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi"  // the way vectors are returned does not matter: see above
#endif

typedef float V4 __attribute__((vector_size(16)));
typedef float V8 __attribute__((vector_size(32)));
typedef float V16 __attribute__((vector_size(64)));
typedef int I4 __attribute__((vector_size(16)));
typedef int I8 __attribute__((vector_size(32)));
typedef int I16 __attribute__((vector_size(64)));
typedef double D8 __attribute__((vector_size(64)));
typedef float V4u __attribute__((vector_size(16), aligned(4), may_alias));
typedef float V8u __attribute__((vector_size(32), aligned(4), may_alias));

// ---- four floats --------------------------------------------------------------------------------------

OM_INLINE V4 load4(const float* p) { return (V4)(*(const V4u*)p); }
OM_INLINE void store4(float* p, V4 v) { *(V4u*)p = (V4u)v; }
OM_INLINE V4 splat4(float f) { return (V4){f, f, f, f}; }

// ---- eight floats -------------------------------------------------------------------------------------

OM_INLINE V8 load8(const float* p) {
    V8 v;
    memcpy(&v, p, sizeof v);
    return v;
}
OM_INLINE void store8(float* p, V8 v) { memcpy(p, &v, sizeof v); }
OM_INLINE V8 splat8(float f) { return (V8){f, f, f, f, f, f, f, f}; }
OM_INLINE V8 select8(I8 mask, V8 yes, V8 no) { return (V8)((mask & (I8)yes) | (~mask & (I8)no)); }
OM_INLINE float sum8(V8 v) {
    return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
}
// ln x of normal positive x to 1e-7: x = 2^e m, m in sqrt(1/2) .. sqrt(2), and the series of atanh.
OM_INLINE V8 log8(V8 x) {
    I8 e = ((I8)x - 0x3f3504f3) >> 23;
    V8 m = (V8)((I8)x - (e << 23)), s = (m - 1) / (m + 1), s2 = s * s;
    V8 series = 1 + s2 * (0.33333333f + s2 * (0.2f + s2 * (0.14285714f + s2 * 0.11111111f)));
    return __builtin_convertvector(e, V8) * 0.69314718f + 2 * s * series;
}

// ---- eight doubles ------------------------------------------------------------------------------------

OM_INLINE D8 splat8d(double d) { return (D8){d, d, d, d, d, d, d, d}; }

// ---- sixteen floats -----------------------------------------------------------------------------------

OM_INLINE V16 load16(const float* p) {
    V16 v;
    memcpy(&v, p, sizeof v);
    return v;
}
OM_INLINE void store16(float* p, V16 v) { memcpy(p, &v, sizeof v); }
OM_INLINE V16 splat16(float f) { return (V16){f, f, f, f, f, f, f, f, f, f, f, f, f, f, f, f}; }
OM_INLINE V16 select16(I16 mask, V16 yes, V16 no) {
    return (V16)((mask & (I16)yes) | (~mask & (I16)no));
}
OM_INLINE V16 max16(V16 a, V16 b) { return select16(a > b, a, b); }
OM_INLINE V16 abs16(V16 a) { return (V16)((I16)a & 0x7fffffff); }
// 1 / sqrt(a) for a in [1e-37, 1e37] to 2e-7: a guess from the bits, then three steps of Newton.
OM_INLINE V16 rsqrt16(V16 a) {
    V16 y = (V16)(0x5f3759df - ((I16)a >> 1)), half = a * 0.5F;
    y *= 1.5F - half * y * y;
    y *= 1.5F - half * y * y;
    y *= 1.5F - half * y * y;
    return y;
}
// ln a for a > 0 to 1e-7: a = 2^e m with m in [sqrt(1/2), sqrt(2)), then the series of atanh((m - 1) / (m + 1)).
OM_INLINE V16 log16(V16 a) {
    I16 bits = (I16)a - 0x3f3504f3;  // bits of sqrt(1/2)
    I16 exponent = bits >> 23;
    V16 m = (V16)((bits & 0x007fffff) + 0x3f3504f3);
    V16 e = __builtin_convertvector(exponent, V16);
    V16 t = (m - 1.0F) / (m + 1.0F), t2 = t * t;
    V16 series = splat16(0.22222222F) + t2 * 0.18181818F;
    series = 0.28571429F + t2 * series;
    series = 0.4F + t2 * series;
    series = 0.66666667F + t2 * series;
    series = 2.0F + t2 * series;
    return e * 0.69314718F + t * series;
}

#endif
