// fuzz_shape_csv.c: the reader of tables of points.
#include "fuzz_cloud.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_cloud(data, size, ".csv");
    return 0;
}
