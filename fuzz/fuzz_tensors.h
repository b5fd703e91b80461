// fuzz_tensors.h: readers of trained networks. The input bytes themselves, and then as changes to the file of a good
// network, eight bytes each: a byte of the header, or a value of a tensor.
#ifndef OMENTUM_FUZZ_TENSORS_H
#define OMENTUM_FUZZ_TENSORS_H

#include "fuzz_common.h"

#define FUZZ_CHANGE 8      // bytes of one
#define FUZZ_MAX_CHANGE 8  // of one input

typedef struct FuzzTensors {  // the file of a good network
    char* data;
    size_t size;
} FuzzTensors;

/// Read `path`, and remove it. The checksum would refuse all changes: its name becomes another one of the same length.
static inline void fuzz_tensors_take(const char* path, FuzzTensors* good) {
    FUZZ_EXPECT(om_file_read(path, 1 << 24, &good->data, &good->size) == OM_OK);
    fuzz_file_done(path);
    bool is_found = false;
    for (size_t i = 8; i + 8 < good->size && !is_found; ++i) {
        is_found = memcmp(good->data + i, "checksum", 8) == 0;
        if (is_found) good->data[i] = 'C';
    }
    FUZZ_EXPECT(is_found);
}

/// `load` the input, and the good file with the changes that the input stands for.
static inline void fuzz_tensors_run(const FuzzTensors* good, const uint8_t* data, size_t size,
                                    void (*load)(const uint8_t* data, size_t size)) {
    const size_t most = size / FUZZ_CHANGE, num = most < FUZZ_MAX_CHANGE ? most : FUZZ_MAX_CHANGE;
    load(data, size);
    if (fuzz_is_known(data, num, FUZZ_CHANGE)) return;
    uint8_t* file = malloc(good->size);
    FUZZ_EXPECT(file != NULL);
    memcpy(file, good->data, good->size);
    uint64_t header;
    memcpy(&header, good->data, sizeof header);
    for (size_t at = 0; at < num * FUZZ_CHANGE; at += FUZZ_CHANGE) {
        uint16_t place;
        float value;
        memcpy(&place, data + at + 1, sizeof place);
        memcpy(&value, data + at + 4, sizeof value);
        size_t body = 8 + (size_t)header, nvalue = (good->size - body) / sizeof value;
        if (data[at] % 2)
            file[8 + place % (size_t)header] = data[at + 3];
        else
            memcpy(file + body + place % nvalue * sizeof value, &value, sizeof value);
    }
    load(file, good->size);
    free(file);
}

#endif
