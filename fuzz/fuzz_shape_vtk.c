// fuzz_shape_vtk.c: the reader of legacy VTK meshes.
#include "fuzz_shape.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz_tet_mesh(data, size, ".vtk");
    fuzz_tet10_mesh(data, size, ".vtk");
    fuzz_surface(data, size, ".vtk");
    return 0;
}
