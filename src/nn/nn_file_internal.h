// nn_file_internal.h: shared by the files that read and write networks.
#ifndef OMENTUM_NN_FILE_INTERNAL_H
#define OMENTUM_NN_FILE_INTERNAL_H

#include "omentum/nn_file.h"

/// om_tensor_file_load from memory. `bytes`, from om_alloc, belong to the file on success and stay the
/// caller's on failure. `name` is copied.
OmStatus om__tensor_file_parse(const char* name, char* bytes, size_t size, OmTensorFile** file);

/// "[16, 3, 3]" into out, cut short where it does not fit.
const char* om__tensor_shape_text(int rank, const int64_t* dim, char* out, size_t size);

#endif
