// fuzz_shape_stl.c: the reader of STL surfaces.
#include "fuzz_shape.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_surface(data, size, ".stl");
    return 0;
}
