// fuzz_shape_cloud_ply.c: the reader of PLY files, as clouds.
#include "fuzz_cloud.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_cloud(data, size, ".ply");
    return 0;
}
