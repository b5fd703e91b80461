// fuzz_shape_obj.c: the reader of OBJ surfaces.
#include "fuzz_shape.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_surface(data, size, ".obj");
    return 0;
}
