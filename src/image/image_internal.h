// image_internal.h: what the readers of volumes share.
#ifndef OMENTUM_IMAGE_INTERNAL_H
#define OMENTUM_IMAGE_INTERNAL_H

#include "omentum/image.h"

#define OM_VOLUME_FILE_MAX ((size_t)1 << 36)  // bytes of a file that is read whole
#define OM_GZIP_RATIO 1032                    // deflate never expands further than this

// ---- bytes, compressed or not (image_source.c) ------------------------------------------------

typedef struct OmSource {
    const unsigned char* data;  // borrowed
    size_t size, pos;           // of the data as stored
    void* stream;               // z_stream, null if the bytes are plain
} OmSource;

// Read [data, data + size), through inflate if `is_gzip` (gzip or zlib, several members).
OmStatus om__source_open(OmSource* src, const void* data, size_t size, bool is_gzip);
void om__source_done(OmSource* src);
// The next n bytes, all of them, or OM_INVALID (cut short, damaged).
OmStatus om__source_read(OmSource* src, void* out, size_t n);
OmStatus om__source_skip(OmSource* src, uint64_t n);
// No more bytes than this can follow.
uint64_t om__source_bound(const OmSource* src);
bool om__is_gzip(const void* data, size_t size);

// ---- voxels (image_volume.c) ------------------------------------------------------------------

typedef enum OmVoxelType {
    OM_VOXEL_U8,
    OM_VOXEL_I8,
    OM_VOXEL_U16,
    OM_VOXEL_I16,
    OM_VOXEL_U32,
    OM_VOXEL_I32,
    OM_VOXEL_U64,
    OM_VOXEL_I64,
    OM_VOXEL_F32,
    OM_VOXEL_F64,
} OmVoxelType;
size_t om__voxel_size(OmVoxelType type);

typedef struct OmVoxelLayout {  // how the wanted voxels lie in the file
    OmVoxelType type;
    bool is_swapped;      // byte order is not this machine's
    double slope, inter;  // value = slope * stored + inter
    uint64_t nbefore;     // values of axes faster than the skipped axis ...
    uint64_t nskip;  // ... and how many of its entries (all but the first) are skipped, 0: none
} OmVoxelLayout;

// Check `dim` (each positive, product at most INT_MAX) and that `bound` bytes can hold it, then
// allocate: a header that lies costs nothing.
OmStatus om__volume_alloc(OmVolume* volume, const int64_t dim[3], uint64_t bytes_per_voxel,
                          uint64_t bound);
// Fill the allocated volume from the source.
OmStatus om__volume_read_binary(OmVolume* volume, OmSource* src, const OmVoxelLayout* layout);
// Replace voxels that are not finite by zero and say so; check the axes.
OmStatus om__volume_finish(OmVolume* volume);
bool om__is_little_endian(void);

// ---- formats: parsing from memory; `path` is for detached data, null refuses it ----------------------

OmStatus om__nifti_parse(const void* data, size_t size, const char* path, OmVolume* volume);
OmStatus om__nrrd_parse(const void* data, size_t size, const char* path, OmVolume* volume);

#endif
