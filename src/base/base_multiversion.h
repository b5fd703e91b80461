// base_multiversion.h: OM_MULTIVERSION before a hot function compiles it for several x86-64 levels; the
// program chooses the best one for the processor at its start. The macro is empty where the compiler or
// a sanitizer does not support it.
#ifndef OMENTUM_BASE_MULTIVERSION_H
#define OMENTUM_BASE_MULTIVERSION_H

#if defined(__x86_64__) && defined(__linux__) && defined(__GNUC__) && !defined(__clang__) && \
    __GNUC__ >= 12 && !defined(OM_SANITIZED)
#define OM_MULTIVERSION \
    __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define OM_MULTIVERSION
#endif

// For functions called in the loops of such a function: they are inlined, since a call would run
// the base level.
#if defined(__GNUC__)
#define OM_INLINE static inline __attribute__((always_inline))
#else
#define OM_INLINE static inline
#endif

#endif
