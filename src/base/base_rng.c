// base_rng.c: counter-based random numbers, Philox 4x32-10.
//
// J. Salmon, M. Moraes, R. Dror, D. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11. The
// generator is a keyed bijection of a 128-bit counter: seed is the key, the index of the stream is the
// upper half of the counter, the block number the lower half.
#include <math.h>

#include "base/base_multiversion.h"
#include "base/base_rng.h"
#include "omentum/base.h"
#include "omentum/vec.h"

static void philox_block(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]) {
    uint32_t c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3];
    uint32_t k0 = key[0], k1 = key[1];
    for (int round = 0; round < 10; ++round) {
        uint64_t p0 = (uint64_t)0xD2511F53u * c0;
        uint64_t p1 = (uint64_t)0xCD9E8D57u * c2;
        c0 = (uint32_t)(p1 >> 32) ^ c1 ^ k0;
        c2 = (uint32_t)(p0 >> 32) ^ c3 ^ k1;
        c1 = (uint32_t)p1;
        c3 = (uint32_t)p0;
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    out[0] = c0, out[1] = c1, out[2] = c2, out[3] = c3;
}

OmRng om_rng_init(uint64_t seed, uint64_t index) {
    OmRng rng = {.key = {(uint32_t)seed, (uint32_t)(seed >> 32)},
                 .counter = {0, 0, (uint32_t)index, (uint32_t)(index >> 32)},
                 .used = 4};
    return rng;
}

// The loops over lanes are inside of the rounds, so that the compiler puts the lanes side by side.
OM_MULTIVERSION void om__rng_block8(uint64_t seed, uint64_t index, uint32_t out[4][8]) {
    uint32_t c0[8] = {0}, c1[8] = {0}, c2[8], c3[8];
    uint32_t k0 = (uint32_t)seed, k1 = (uint32_t)(seed >> 32);
    for (int i = 0; i < 8; ++i) {
        c2[i] = (uint32_t)(index + (uint64_t)i);
        c3[i] = (uint32_t)((index + (uint64_t)i) >> 32);
    }
    for (int round = 0; round < 10; ++round) {
        for (int i = 0; i < 8; ++i) {
            uint64_t p0 = (uint64_t)0xD2511F53u * c0[i], p1 = (uint64_t)0xCD9E8D57u * c2[i];
            c0[i] = (uint32_t)(p1 >> 32) ^ c1[i] ^ k0;
            c2[i] = (uint32_t)(p0 >> 32) ^ c3[i] ^ k1;
            c1[i] = (uint32_t)p1;
            c3[i] = (uint32_t)p0;
        }
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    for (int i = 0; i < 8; ++i) {
        out[0][i] = c0[i], out[1][i] = c1[i], out[2][i] = c2[i], out[3][i] = c3[i];
    }
}

uint32_t om_rng_u32(OmRng* rng) {
    if (rng->used == 4) {
        philox_block(rng->counter, rng->key, rng->out);
        if (++rng->counter[0] == 0) ++rng->counter[1];
        rng->used = 0;
    }
    return rng->out[rng->used++];
}

uint32_t om_rng_below(OmRng* rng, uint32_t n) {
    OM_ASSERT(n > 0);
    // Reject the last, incomplete multiple of n: the probability is below one half per draw.
    uint32_t limit = UINT32_MAX - (UINT32_MAX - n + 1) % n;
    uint32_t u;
    do u = om_rng_u32(rng);
    while (u > limit);
    return u % n;
}

double om_rng_uniform(OmRng* rng) {
    uint64_t hi = om_rng_u32(rng) >> 5, lo = om_rng_u32(rng) >> 6;
    return (double)(hi << 26 | lo) * 0x1p-53;
}

double om_rng_range(OmRng* rng, double lo, double hi) {
    return lo + (hi - lo) * om_rng_uniform(rng);
}

double om_rng_normal(OmRng* rng) {
    double u = 1.0 - om_rng_uniform(rng);  // in (0, 1]: the logarithm is finite
    double v = om_rng_uniform(rng);
    return sqrt(-2.0 * log(u)) * cos(2.0 * OM_PI * v);
}
