/// omentum/nn_store.h: files of samples for training (floor 2).
///
/// Named arrays and attributes in HDF5, behind a head of 512 bytes:
///
///     0     "KIND FORMAT\nsize N\nhash H\n", zeros
///     512   an HDF5 file of N bytes whose om_hash is H
///
/// HDF5 searches for its signature at 0, 512, 1024, .., so its tools open the file directly. The head detects every
/// truncated or damaged file. Equal contents give equal bytes.
///
///     om_store_begin("omentum umesh", 1, &w);
///     om_store_group(w, "sample");
///     om_store_array(w, "sample/u", OM_STORE_F32, (int[3]){num, nnode, 3}, 1, "m", u);
///     om_store_save(w, "samples_000000.h5");                                             // frees w
#ifndef OMENTUM_NN_STORE_H
#define OMENTUM_NN_STORE_H

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmStoreType {
    OM_STORE_U8,
    OM_STORE_I16,
    OM_STORE_I32,
    OM_STORE_U64,
    OM_STORE_F32,
    OM_STORE_F64,
    OM_NSTORE
} OmStoreType;

/// A member of a record: one array GROUP/NAME for all records of a file.
typedef struct OmStoreField {
    const char *name, *unit;
    size_t offset;  // of the member
    OmStoreType type;
    int n;  // values
} OmStoreField;

// ---- writing ----------------------------------------------------------------------------------------

typedef struct OmStoreWriter OmStoreWriter;

/// Begin a file in memory. HDF5 is not thread-safe: one thread of a process at a time uses writers and readers.
/// @param kind  what the file holds, at most 64 characters
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_store_begin(const char* kind, int format, OmStoreWriter** writer);
/// Make a group for arrays. The first failure of this and the following calls is returned by om_store_save.
OM_API void om_store_group(OmStoreWriter* writer, const char* name);
/// Attributes: a text, or n values (0: a scalar). "NAME" belongs to the file, "OBJECT@NAME" to a group or an array.
OM_API void om_store_text(OmStoreWriter* writer, const char* name, const char* value);
OM_API void om_store_value(OmStoreWriter* writer, const char* name, OmStoreType type, int n,
                           const void* value);
/// Add an array in chunks of `chunk` > 0 rows, compressed.
/// @param dim   1 to 3 extents > 0; 0 ends them
/// @param unit  attribute of the array; may be null
OM_API void om_store_array(OmStoreWriter* writer, const char* name, OmStoreType type,
                           const int dim[3], int chunk, const char* unit, const void* value);
/// Add the fields of `num` records, `size` bytes each.
OM_API void om_store_records(OmStoreWriter* writer, const char* group, const OmStoreField* field,
                             int nfield, const void* record, size_t size, int num);
/// Write the file, whole or not at all, and free the writer.
/// @return OM_OK; OM_IO, OM_NO_MEMORY
OM_API OmStatus om_store_save(OmStoreWriter* writer, const char* path);
/// Free a writer that is not saved.
OM_API void om_store_abort(OmStoreWriter* writer);

// ---- reading ----------------------------------------------------------------------------------------

typedef struct OmStoreReader OmStoreReader;

/// Open a file in memory after a check of its head.
/// @param data  borrowed until the reader is closed
/// @param kind  null: a file of another program, without head and hash; HDF5 alone detects damage
/// @param name  of the file, for messages; borrowed
/// @return OM_OK; OM_INVALID (another kind, truncated, damaged); OM_UNAVAILABLE (another format); OM_NO_MEMORY
OM_API OmStatus om_store_open(const char* data, size_t size, const char* kind, int format,
                              const char* name, OmStoreReader** reader);
OM_API void om_store_close(OmStoreReader* reader);
/// Read an attribute of n values; names as in om_store_value.
/// @return OM_OK; OM_INVALID (missing, or another number of values; F64: not finite)
OM_API OmStatus om_store_get_value(const OmStoreReader* reader, const char* name, OmStoreType type,
                                   int n, void* value);
/// Read an attribute of om_store_text; "" where there is none.
/// @return OM_OK; OM_INVALID (no text, or one that needs more than `size` bytes)
OM_API OmStatus om_store_get_text(const OmStoreReader* reader, const char* name, char* text,
                                  size_t size);
/// Extents of an array; 0 ends them.
/// @return OM_OK; OM_INVALID (missing, empty, or more than 3 extents)
OM_API OmStatus om_store_get_shape(const OmStoreReader* reader, const char* name, int dim[3]);
/// Check the shape of an array before memory is allocated for it.
/// @return OM_OK; OM_INVALID (missing, or another shape)
OM_API OmStatus om_store_check_array(const OmStoreReader* reader, const char* name,
                                     const int dim[3]);
/// Read an array of this shape.
/// @return OM_OK; OM_INVALID (missing, another shape, unreadable; F32, F64: a value is not finite)
OM_API OmStatus om_store_get_array(const OmStoreReader* reader, const char* name, OmStoreType type,
                                   const int dim[3], void* value);
/// Read the fields of `num` records; other members stay.
/// @return OM_OK; OM_INVALID (as om_store_get_array); OM_NO_MEMORY
OM_API OmStatus om_store_get_records(const OmStoreReader* reader, const char* group,
                                     const OmStoreField* field, int nfield, void* record,
                                     size_t size, int num);

// ---- folders of such files --------------------------------------------------------------------------

/// Path of the file whose first sample is `first`: DIR/samples_NNNNNN.h5.
/// @return OM_OK; OM_INVALID (longer than `size`)
OM_API OmStatus om_store_shard_path(const char* dir, int first, char* path, size_t size);
/// The lowest and the highest first sample of the files in `dir`; -1: there are none.
OM_API void om_store_shard_range(const char* dir, int* lowest, int* highest);

#ifdef __cplusplus
}
#endif
#endif
