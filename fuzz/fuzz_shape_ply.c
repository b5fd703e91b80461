// fuzz_shape_ply.c: the reader of PLY surfaces.
#include "fuzz_shape.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_surface(data, size, ".ply");
    return 0;
}
