// fuzz_shape_vtu.c: the reader of VTK XML meshes.
#include "fuzz_shape.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_tet_mesh(data, size, ".vtu");
    fuzz_tet10_mesh(data, size, ".vtu");
    fuzz_surface(data, size, ".vtu");
    return 0;
}
