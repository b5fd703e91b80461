// image_internal.h: what the readers of volumes share.
#ifndef OMENTUM_IMAGE_INTERNAL_H
#define OMENTUM_IMAGE_INTERNAL_H

#include "omentum/image.h"

#define OM_GZIP_RATIO 1032  // deflate never expands further than this

// ---- bytes, compressed or not (image_source.c) ------------------------------------------------

typedef struct OmSource {
    const unsigned char* data;  // stored bytes at hand: borrowed, or those of `window`
    size_t size, pos;           // of `data`
    uint64_t left, total;       // stored bytes behind those at hand, and of all of the source
    FILE* file;                 // null: all is at hand
    unsigned char* window;
    void* stream;  // z_stream, null if the bytes are plain
} OmSource;

void om__source_open_memory(OmSource* src, const void* data, size_t size);
// Only a window of the file is ever in memory.
OmStatus om__source_open_file(OmSource* src, const char* path);
void om__source_done(OmSource* src);
// From here on the stored bytes are gzip or zlib data, one member or several.
OmStatus om__source_inflate(OmSource* src);
// Whether the bytes at hand begin so; to be called before anything is read.
bool om__source_begins(const OmSource* src, const char* mark, size_t size);
// The next line of plain bytes without its '\n': its first `size` bytes into line (not ended), its length into *len.
OmStatus om__source_line(OmSource* src, char* line, size_t size, size_t* len, bool* is_end);
// The next n bytes, all of them, or OM_INVALID (cut short, damaged).
OmStatus om__source_read(OmSource* src, void* out, size_t n);
OmStatus om__source_skip(OmSource* src, uint64_t n);
// No more bytes than this can follow.
uint64_t om__source_bound(const OmSource* src);
static inline bool om__source_is_gzip(const OmSource* src) {
    return om__source_begins(src, "\x1f\x8b", 2);
}

// ---- voxels (image_volume.c) ------------------------------------------------------------------

typedef struct OmVoxelLayout {  // how the wanted voxels lie in the file
    bool is_swapped;            // byte order is not this machine's
    uint64_t nbefore;           // values of axes faster than the axis that is not of space ...
    uint64_t nentry;            // ... its entries; 0 or 1: there is no such axis
    uint64_t entry;             // the one that is read
} OmVoxelLayout;

typedef struct OmVolumeTask {  // what a parser does; nothing in it is owned
    const char* path;          // for detached data; null refuses it
    int entry;                 // of a file of several volumes; -1: such a file is refused
    uint64_t max_size;         // bytes that the voxels may take
    OmVolume* volume;          // receives the voxels; null: the header alone is read
    OmVolumeInfo* info;  // receives what the header says; the caller frees it, also on failure
} OmVolumeTask;

// Check `dim` (each positive, product at most INT_MAX), that the voxels take at most `max_size` bytes and that
// `bound` bytes of the file, `per_voxel` each, can hold them; then allocate: a header that lies costs nothing.
OmStatus om__volume_alloc(OmVolume* volume, const int64_t dim[3], OmVoxelType type,
                          uint64_t per_voxel, uint64_t bound, uint64_t max_size);
// Fill the allocated volume from the source.
OmStatus om__volume_read_binary(OmVolume* volume, OmSource* src, const OmVoxelLayout* layout);
// Check the axes and the values; voxels that are not finite are counted in the log.
OmStatus om__volume_finish(OmVolume* volume);
bool om__is_little_endian(void);

// ---- formats ----------------------------------------------------------------------------------------

OmStatus om__nifti_parse(OmSource* src, const OmVolumeTask* task);
OmStatus om__nrrd_parse(OmSource* src, const OmVolumeTask* task);

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
