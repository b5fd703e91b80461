// study_sha1.h: SHA-1, which names git's files and folders. Not for secrets.
#ifndef OMENTUM_STUDY_SHA1_H
#define OMENTUM_STUDY_SHA1_H

#include <stddef.h>
#include <stdint.h>

typedef struct StudySha1 {
    uint32_t h[5];
    uint64_t size;            // bytes so far
    unsigned char block[64];  // not hashed yet
} StudySha1;

void om__sha1_begin(StudySha1* s);
void om__sha1_add(StudySha1* s, const void* data, size_t size);
void om__sha1_end(StudySha1* s, unsigned char digest[20]);

#endif
