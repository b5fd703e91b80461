// fuzz_nn_safetensors.c: the reader of files of tensors, from memory.
#include <math.h>

#include "fuzz_common.h"
#include "nn/nn_file_internal.h"

// Values that are accepted are finite; a shape that is not the tensor's is refused.
static void read_tensor(const OmTensorFile* file, const OmTensor* t) {
    int64_t count = om_tensor_count(t);
    float* value = om_alloc((size_t)count, sizeof *value);
    double* precise = om_alloc((size_t)count, sizeof *precise);
    FUZZ_EXPECT(value != NULL && precise != NULL);
    if (om_tensor_file_read(file, t->name, t->rank, t->dim, value) == OM_OK)
        for (int64_t i = 0; i < count; ++i) FUZZ_EXPECT(isfinite(value[i]));
    if (om_tensor_file_read_double(file, t->name, t->rank, t->dim, precise) == OM_OK)
        for (int64_t i = 0; i < count; ++i) FUZZ_EXPECT(isfinite(precise[i]));
    if (t->rank > 0) {
        FUZZ_EXPECT(om_tensor_file_read(file, t->name, t->rank - 1, t->dim, value) == OM_INVALID);
        FUZZ_EXPECT(strstr(om_error_message(), "expected") != NULL);
    }
    om_free(value);
    om_free(precise);
}

// What can be read is written as floats, and comes back.
static void write_again(const OmTensorFile* file) {
    enum { MAX_TENSOR = 8, MAX_VALUE = 256 };
    static float value[MAX_TENSOR][MAX_VALUE];
    float back[MAX_VALUE];
    OmTensor tensor[MAX_TENSOR];
    int count = 0;
    for (int i = 0; i < om_tensor_file_count(file) && count < MAX_TENSOR; ++i) {
        const OmTensor* t = om_tensor_file_get(file, i);
        if (om_tensor_count(t) > MAX_VALUE) continue;
        if (om_tensor_file_read(file, t->name, t->rank, t->dim, value[count]) != OM_OK) continue;
        tensor[count] = *t;
        tensor[count].type = OM_TENSOR_F32;
        tensor[count].data = value[count];
        ++count;
    }
    const OmTextPair pair = {"units", om_tensor_file_meta(file, "units")};
    const char* path = fuzz_file((const uint8_t*)"", 0, ".safetensors");
    OmTensorFile* again;
    FUZZ_EXPECT(om_tensor_file_save(tensor, count, &pair, pair.value ? 1 : 0, path) == OM_OK);
    FUZZ_EXPECT(om_tensor_file_load(path, &again) == OM_OK);
    FUZZ_EXPECT(om_tensor_file_count(again) == count);
    for (int i = 0; i < count; ++i) {
        const OmTensor* t = &tensor[i];
        FUZZ_EXPECT(om_tensor_file_read(again, t->name, t->rank, t->dim, back) == OM_OK);
        FUZZ_EXPECT(memcmp(back, t->data, (size_t)om_tensor_count(t) * sizeof *back) == 0);
    }
    om_tensor_file_destroy(again);
    fuzz_file_done(path);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    OmTensorFile* file;
    char* bytes = om_alloc(size, 1);
    FUZZ_EXPECT(bytes != NULL);
    if (size) memcpy(bytes, data, size);
    OmStatus status = om__tensor_file_parse("fuzz", bytes, size, &file);
    FUZZ_EXPECT(status <= 0);
    if (status != OM_OK) {
        FUZZ_EXPECT(file == NULL && om_error_message()[0] != '\0');
        om_free(bytes);
        return 0;
    }
    // Tensors lie inside the file, one behind the other, and have names of their own.
    const char* end = NULL;
    for (int i = 0; i < om_tensor_file_count(file); ++i) {
        const OmTensor* t = om_tensor_file_get(file, i);
        const char* begin = t->data;
        FUZZ_EXPECT(om_tensor_file_find(file, t->name) == i);
        FUZZ_EXPECT(begin >= bytes && begin <= bytes + size);
        FUZZ_EXPECT(end == NULL || begin >= end);
        end = begin + om_tensor_count(t);  // a value has a byte at least
        FUZZ_EXPECT(end <= bytes + size);
        read_tensor(file, t);
    }
    write_again(file);
    om_tensor_file_destroy(file);
    return 0;
}
