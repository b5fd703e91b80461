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
    uint64_t nbefore;     // values of axes faster than the axis that is not of space ...
    uint64_t nentry;      // ... its entries; 0 or 1: there is no such axis
    uint64_t entry;       // the one that is read
} OmVoxelLayout;

typedef struct OmVolumeTask {  // what a parser does; nothing in it is owned
    const char* path;          // for detached data; null refuses it
    int entry;                 // of a file of several volumes; -1: such a file is refused
    OmVolume* volume;          // receives the voxels; null: the header alone is read
    OmVolumeInfo* info;  // receives what the header says; the caller frees it, also on failure
} OmVolumeTask;

// Check `dim` (each positive, product at most INT_MAX) and that `bound` bytes can hold it, then
// allocate: a header that lies costs nothing.
OmStatus om__volume_alloc(OmVolume* volume, const int64_t dim[3], uint64_t bytes_per_voxel,
                          uint64_t bound);
// Fill the allocated volume from the source.
OmStatus om__volume_read_binary(OmVolume* volume, OmSource* src, const OmVoxelLayout* layout);
// Replace voxels that are not finite by zero and say so; check the axes.
OmStatus om__volume_finish(OmVolume* volume);
bool om__is_little_endian(void);

// ---- formats: parsing from memory ---------------------------------------------------------------

OmStatus om__nifti_parse(const void* data, size_t size, const OmVolumeTask* task);
OmStatus om__nrrd_parse(const void* data, size_t size, const OmVolumeTask* task);

// ---- names of segments (image_segment.c) --------------------------------------------------------------

// The segment of a list, made (with layer and value -1) if it is not there; at most OM_SEGMENT_MAX.
#define OM_SEGMENT_MAX 4096
OmStatus om__segment_at(OmVolumeInfo* info, int index, OmSegment** segment);
// Copy a name of any bytes: control characters become blanks, what is no UTF-8 becomes "?".
void om__segment_name(const char* str, size_t len, char out[OM_SEGMENT_NAME]);
// One "key:=value" of an NRRD header: those of 3D Slicer's segmentations are kept.
OmStatus om__segment_read_key(const char* line, size_t len, OmVolumeInfo* info);
// What a file leaves out; a layer that it does not have is OM_INVALID.
OmStatus om__segment_finish(OmVolumeInfo* info);
// Labels of an XML table in an extension of a NIfTI header: <Label Key="5" ...>liver</Label>.
OmStatus om__segment_read_table(const char* text, size_t size, OmVolumeInfo* info);
// The volume to be read out of `nentry`, by the task.
OmStatus om__choose_entry(const OmVolumeTask* task, uint64_t nentry, OmVoxelLayout* layout);

#endif
