// fuzz_shape_msh.c: the reader of Gmsh meshes.
#include "fuzz_shape.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_tet_mesh(data, size, ".msh");
    fuzz_tet10_mesh(data, size, ".msh");
    fuzz_surface(data, size, ".msh");
    return 0;
}
