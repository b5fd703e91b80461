// fuzz_shape_off.c: the reader of OFF surfaces.
#include "fuzz_shape.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_surface(data, size, ".off");
    return 0;
}
