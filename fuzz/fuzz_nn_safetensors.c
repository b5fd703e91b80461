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
    (void)om_tensor_file_meta(file, "units");
    om_tensor_file_destroy(file);
    return 0;
}
