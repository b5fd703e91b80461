// fuzz_shape_vtp.c: the reader of VTK's XML files of surfaces and clouds.
#include "fuzz_cloud.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_cloud(data, size, ".vtp");
    return 0;
}
