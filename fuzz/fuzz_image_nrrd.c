// fuzz_image_nrrd.c: the reader of NRRD volumes, from memory.
#include "fuzz_image.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    return fuzz_volume(om__nrrd_parse, data, size);
}
