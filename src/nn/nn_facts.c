// nn_facts.c: lines of metadata, and the checks of a file of weights against its own metadata.
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "omentum/nn_file.h"

static char* copy_text(const char* text) {
    size_t size = strlen(text) + 1;
    char* copy = om_alloc(size, 1);
    if (copy) memcpy(copy, text, size);
    return copy;
}

OmStatus om_facts_add(OmFacts* facts, const char* key, const char* format, ...) {
    char value[1024];
    va_list arg;
    va_start(arg, format);
    vsnprintf(value, sizeof value, format, arg);
    va_end(arg);
    OM_CHECK(facts->n < OM_FACTS_MAX, OM_INVALID, "more than %d lines of metadata", OM_FACTS_MAX);
    char *k = copy_text(key), *v = copy_text(value);
    if (!k || !v) {
        om_free(k);
        om_free(v);
        return OM_NO_MEMORY;
    }
    facts->pair[facts->n++] = (OmTextPair){k, v};
    return OM_OK;
}

const char* om_facts_find(const OmFacts* facts, const char* key) {
    for (int i = 0; i < facts->n; ++i)
        if (strcmp(facts->pair[i].key, key) == 0) return facts->pair[i].value;
    return NULL;
}

void om_facts_done(OmFacts* facts) {
    for (int i = 0; i < facts->n; ++i) {
        om_free((void*)(uintptr_t)facts->pair[i].key);
        om_free((void*)(uintptr_t)facts->pair[i].value);
    }
    *facts = (OmFacts){0};
}

uint64_t om_tensor_checksum(const OmTensor* tensor, int ntensor) {
    uint64_t sum = 0;
    for (const OmTensor* t = tensor; t < tensor + ntensor; ++t) {
        size_t size = t->type == OM_TENSOR_F64 ? sizeof(double) : sizeof(float);
        uint64_t hash = om_hash(t->name, strlen(t->name), OM_HASH_SEED);
        sum += om_hash(t->data, (size_t)om_tensor_count(t) * size, hash);
    }
    return sum;
}

OmStatus om_tensor_file_check(const OmTensorFile* file, const char* path) {
    const char* expected = om_tensor_file_meta(file, "checksum");
    if (!expected) return OM_OK;
    uint64_t checksum = 0;
    for (int i = 0; i < om_tensor_file_count(file); ++i) {
        const OmTensor* t = om_tensor_file_get(file, i);
        OM_CHECK(t->type == OM_TENSOR_F64 || t->type == OM_TENSOR_F32, OM_INVALID,
                 "%s: tensor \"%.80s\" is neither F32 nor F64, and the file has a checksum", path,
                 t->name);
        checksum += om_tensor_checksum(t, 1);
    }
    char sum[24];
    snprintf(sum, sizeof sum, "%016llx", (unsigned long long)checksum);
    OM_CHECK(strcmp(sum, expected) == 0, OM_INVALID,
             "%s: the file is damaged: the checksum of its tensors is %s, not %.20s; copy it anew",
             path, sum, expected);
    return OM_OK;
}

OmStatus om_tensor_file_setting(const OmTensorFile* file, const char* path, const char* key, int lo,
                                int hi, int* value) {
    const char* text = om_tensor_file_meta(file, key);
    char* end;
    OM_CHECK(text, OM_INVALID, "%s: the metadata have no \"%s\"; was it written by omentum?", path,
             key);
    long v = strtol(text, &end, 10);
    OM_CHECK(*text && !*end && v >= lo && v <= hi, OM_INVALID, "%s: %s is \"%.20s\"; %d to %d",
             path, key, text, lo, hi);
    *value = (int)v;
    return OM_OK;
}
