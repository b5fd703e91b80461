// fuzz_image_nifti.c: the reader of NIfTI volumes, from memory.
#include "fuzz_image.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    return fuzz_volume(om__nifti_parse, data, size);
}
