// study_sha1.c: SHA-1 (FIPS 180-4, section 6.1).
#include "studies/study_sha1.h"

#include <string.h>

static uint32_t turn(uint32_t x, int n) { return x << n | x >> (32 - n); }

static void eat(uint32_t h[5], const unsigned char* block) {
    uint32_t w[80], a = h[0], b = h[1], c = h[2], d = h[3], e = h[4];
    for (int t = 0; t < 16; ++t)
        w[t] = (uint32_t)block[4 * t] << 24 | (uint32_t)block[4 * t + 1] << 16 |
               (uint32_t)block[4 * t + 2] << 8 | block[4 * t + 3];
    for (int t = 16; t < 80; ++t) w[t] = turn(w[t - 3] ^ w[t - 8] ^ w[t - 14] ^ w[t - 16], 1);
    for (int t = 0; t < 80; ++t) {
        uint32_t f, k;
        if (t < 20)
            f = (b & c) | (~b & d), k = 0x5a827999;
        else if (t < 40)
            f = b ^ c ^ d, k = 0x6ed9eba1;
        else if (t < 60)
            f = (b & c) | (b & d) | (c & d), k = 0x8f1bbcdc;
        else
            f = b ^ c ^ d, k = 0xca62c1d6;
        uint32_t next = turn(a, 5) + f + e + k + w[t];
        e = d, d = c, c = turn(b, 30), b = a, a = next;
    }
    h[0] += a, h[1] += b, h[2] += c, h[3] += d, h[4] += e;
}

void om__sha1_begin(StudySha1* s) {
    static const uint32_t start[5] = {0x67452301, 0xefcdab89, 0x98badcfe, 0x10325476, 0xc3d2e1f0};
    memset(s, 0, sizeof *s);
    memcpy(s->h, start, sizeof start);
}

void om__sha1_add(StudySha1* s, const void* data, size_t size) {
    const unsigned char* at = data;
    while (size > 0) {
        size_t used = s->size % 64, n = 64 - used < size ? 64 - used : size;
        memcpy(s->block + used, at, n);
        s->size += n, at += n, size -= n;
        if (s->size % 64 == 0) eat(s->h, s->block);
    }
}

void om__sha1_end(StudySha1* s, unsigned char digest[20]) {
    const uint64_t bits = 8 * s->size;
    unsigned char length[8];
    om__sha1_add(s, "\x80", 1);
    while (s->size % 64 != 56) om__sha1_add(s, "", 1);
    for (int k = 0; k < 8; ++k) length[k] = (unsigned char)(bits >> (56 - 8 * k));
    om__sha1_add(s, length, 8);
    for (int k = 0; k < 20; ++k) digest[k] = (unsigned char)(s->h[k / 4] >> (24 - 8 * (k % 4)));
}
