/// omentum/nn_file.h: networks as files (floor 2): safetensors in and out, ONNX out.
///
/// A safetensors file is a JSON header (name, type, shape and place of every tensor, and pairs of texts: what the
/// network is, its units, the data it was trained on, how well it does) followed by the numbers, little-endian.
/// The reader trusts nothing: lengths, places that overlap or leave holes, names twice, and values that are not
/// finite are refused with a sentence. Files appear whole or not at all.
///
///     OmTextPair about[] = {{"units", "m"}, {"mean_error_mm", "0.048"}};
///     OmStatus s = om_net_save(net, param, about, 2, "phantom.safetensors");
///     if (s == OM_OK) s = om_net_load(net, "phantom.safetensors", param);
///     if (s == OM_OK) s = om_net_save_onnx(net, param, about, 2, "phantom.onnx");
#ifndef OMENTUM_NN_FILE_H
#define OMENTUM_NN_FILE_H

#include "omentum/base.h"
#include "omentum/nn.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- networks ---------------------------------------------------------------------------------------

typedef struct OmTextPair {  // a line of a file's metadata, UTF-8
    const char* key;
    const char* value;
} OmTextPair;

/// Write the parameters under the names of the net's table, with `meta` and two pairs of its own: "architecture", the
/// text of om_net_describe, and "network", om_net_hash in 16 hexadecimal digits. OM_INVALID if a value is not finite.
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_net_save(const OmNet* net, const float* param, const OmTextPair* meta, int nmeta,
                            const char* path);
/// Read parameters from a file that has exactly the tensors of the net's table, by name and shape, and, where it
/// says of which network it is, names this one. Otherwise OM_INVALID, with file, tensor and both shapes in the
/// message, and `param` is not to be used.
/// @return OM_OK; OM_INVALID (another network, or damaged: the message names the tensor); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_net_load(const OmNet* net, const char* path, float* param);
/// Append one line a layer.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_net_describe(const OmNet* net, OmText* text);

/// Write the network with these parameters as ONNX (opset 13, IR 7), as it predicts: dropout is left out, norms use
/// their statistics. The first dimension of input "input" and output "output" is free.
/// @return OM_OK; OM_INVALID (no layers, or more than 2 GiB); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_net_save_onnx(const OmNet* net, const float* param, const OmTextPair* meta,
                                 int nmeta, const char* path);

// ---- what a file says of itself ---------------------------------------------------------------------

#define OM_FACTS_MAX 24

typedef struct
    OmFacts {  // lines of metadata with strings of their own; zero-initialise, om_facts_done frees
    int n;
    OmTextPair pair[OM_FACTS_MAX];
} OmFacts;
/// Add a line.
/// @return OM_OK; OM_INVALID (OM_FACTS_MAX lines are there); OM_NO_MEMORY
OM_API OmStatus om_facts_add(OmFacts* facts, const char* key, const char* format, ...)
    OM_PRINTF(3, 4);
/// The value of a key, or null.
OM_API const char* om_facts_find(const OmFacts* facts, const char* key);
OM_API void om_facts_done(OmFacts* facts);

// ---- any safetensors file ---------------------------------------------------------------------------

#define OM_TENSOR_MAX_RANK 8
#define OM_TENSOR_MAX_HEADER (8u << 20)  // bytes of JSON that are read

/// Types by their name in a file, bytes a value, and whether values are read (the others are only skipped).
#define OM_TENSOR_TYPE_TABLE(X) \
    X(F64, 8, true)             \
    X(F32, 4, true)             \
    X(F16, 2, true)             \
    X(BF16, 2, true)            \
    X(I64, 8, false)            \
    X(U64, 8, false)            \
    X(I32, 4, false)            \
    X(U32, 4, false)            \
    X(I16, 2, false)            \
    X(U16, 2, false)            \
    X(I8, 1, false)             \
    X(U8, 1, false)             \
    X(BOOL, 1, false)           \
    X(F8_E4M3, 1, false)        \
    X(F8_E5M2, 1, false)

typedef enum OmTensorType {
#define OM_TENSOR_TYPE_ENUM(name, size, is_read) OM_TENSOR_##name,
    OM_TENSOR_TYPE_TABLE(OM_TENSOR_TYPE_ENUM)
#undef OM_TENSOR_TYPE_ENUM
        OM_TENSOR_NTYPE
} OmTensorType;

typedef struct OmTensor {  // of a file, or to be written; everything in it is borrowed
    const char* name;
    OmTensorType type;
    int rank;                         // 0 is a single value
    int64_t dim[OM_TENSOR_MAX_RANK];  // the last runs fastest
    // Written: float (OM_TENSOR_F32) or double (OM_TENSOR_F64). Read: little-endian bytes.
    const void* data;
} OmTensor;

/// Values of a tensor: the product of its shape.
OM_API int64_t om_tensor_count(const OmTensor* tensor);

/// Write tensors of OM_TENSOR_F32 and OM_TENSOR_F64, whole or not at all. OM_INVALID for another type, a value that
/// is not finite, a name given twice, or text that is not UTF-8.
/// @return OM_OK; OM_INVALID (names, shapes or metadata that a reader would refuse); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_tensor_file_save(const OmTensor* tensor, int ntensor, const OmTextPair* meta,
                                    int nmeta, const char* path);

/// A file in memory, checked. The caller destroys it.
typedef struct OmTensorFile OmTensorFile;
/// Read a file of tensors into memory.
/// @return OM_OK; OM_INVALID (not such a file, or damaged); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_tensor_file_load(const char* path, OmTensorFile** file);
OM_API void om_tensor_file_destroy(OmTensorFile* file);
OM_API int om_tensor_file_count(const OmTensorFile* file);
/// Tensor i in the order of the data; valid until the file is destroyed.
OM_API const OmTensor* om_tensor_file_get(const OmTensorFile* file, int i);
/// Sum of hashes of names and values, which does not depend on the order of the tensors. F32 and F64 only.
OM_API uint64_t om_tensor_checksum(const OmTensor* tensor, int ntensor);
/// Compare the line "checksum" of the metadata, om_tensor_checksum in 16 hexadecimal digits, with the tensors; a file
/// without this line passes.
/// @return OM_OK; OM_INVALID (damaged, or tensors of other types)
OM_API OmStatus om_tensor_file_check(const OmTensorFile* file, const char* path);
/// Read a whole number from lo to hi out of the metadata.
/// @return OM_OK; OM_INVALID (no such line, no number, outside)
OM_API OmStatus om_tensor_file_setting(const OmTensorFile* file, const char* path, const char* key,
                                       int lo, int hi, int* value);
/// Its number, or -1.
OM_API int om_tensor_file_find(const OmTensorFile* file, const char* name);
/// The text of a metadata key, or null; valid until the file is destroyed.
OM_API const char* om_tensor_file_meta(const OmTensorFile* file, const char* key);
/// The values of the tensor `name`, which must have this shape, from F64, F32, F16 or BF16. OM_INVALID, with the
/// shape found, if it has another, is not there, or holds a value that is not finite (as a float).
/// @return OM_OK; OM_INVALID (no such tensor, another shape or type, a value that is not finite)
OM_API OmStatus om_tensor_file_read(const OmTensorFile* file, const char* name, int rank,
                                    const int64_t* dim, float* value);
/// The same in double.
/// @return OM_OK; OM_INVALID (no such tensor, another shape or type, a value that is not finite)
OM_API OmStatus om_tensor_file_read_double(const OmTensorFile* file, const char* name, int rank,
                                           const int64_t* dim, double* value);

#ifdef __cplusplus
}
#endif
#endif
