// base_rng.h: first random numbers of eight streams at a time; private to the library.
#ifndef OMENTUM_BASE_RNG_H
#define OMENTUM_BASE_RNG_H

#include "omentum/base.h"

// out[k][i]: number k of om_rng_init(seed, index + i).
void om__rng_block8(uint64_t seed, uint64_t index, uint32_t out[4][8]);

#endif
