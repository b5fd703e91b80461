// image_internal.h: shared by the readers of volumes.
#ifndef OMENTUM_IMAGE_INTERNAL_H
#define OMENTUM_IMAGE_INTERNAL_H

#include "omentum/image.h"

#define OM_GZIP_RATIO 1032  // deflate never expands further than this

// ---- bytes, compressed or not (image_source.c) ------------------------------------------------

typedef struct OmSource {
    const unsigned char* data;  // stored bytes in memory: borrowed, or those of `window`
    size_t size, pos;           // of `data`
    uint64_t left, total;       // stored bytes after those in memory, and of the whole source
    FILE* file;                 // null: all bytes are in memory
    unsigned char* window;
    void* stream;  // z_stream, null if the bytes are plain
} OmSource;

void om__source_open_memory(OmSource* src, const void* data, size_t size);
// Open a file; only a window of it is ever in memory.
OmStatus om__source_open_file(OmSource* src, const char* path);
void om__source_done(OmSource* src);
// Treat the stored bytes from here on as gzip or zlib data, one member or several.
OmStatus om__source_inflate(OmSource* src);
// Do the bytes in memory begin with a gzip or zlib header? Call it before anything is read.
bool om__source_begins(const OmSource* src, const char* mark, size_t size);
// The next line of plain bytes without its '\n': its first `size` bytes go to `line` (no final
// zero), its length to *len.
OmStatus om__source_line(OmSource* src, char* line, size_t size, size_t* len, bool* is_end);
// Read exactly n bytes; OM_INVALID if the data are cut short or damaged.
OmStatus om__source_read(OmSource* src, void* out, size_t n);
OmStatus om__source_skip(OmSource* src, uint64_t n);
// Upper bound of the plain bytes that can follow.
uint64_t om__source_bound(const OmSource* src);
static inline bool om__source_is_gzip(const OmSource* src) {
    return om__source_begins(src, "\x1f\x8b", 2);
}

// ---- voxels (image_volume.c) ------------------------------------------------------------------

typedef struct OmVoxelLayout {  // layout of the wanted voxels in the file
    bool is_swapped;            // byte order differs from this machine's
    uint64_t nbefore;  // number of values along the axes that are faster than the non-spatial axis
    uint64_t nentry;   // entries of the non-spatial axis; 0 or 1: there is none
    uint64_t entry;    // the entry that is read
} OmVoxelLayout;

typedef struct OmVolumeTask {  // input and output of a parser; it owns nothing
    const char* path;    // of the file, to find detached data; null: detached data are refused
    int entry;           // which volume of a file of several; -1: such a file is refused
    uint64_t max_size;   // bytes that the voxels may take
    OmVolume* volume;    // receives the voxels; null: only the header is read
    OmVolumeInfo* info;  // receives the header's contents; the caller frees it, also on failure
} OmVolumeTask;

// Check `dim` (each positive, product at most INT_MAX), that the voxels need at most `max_size` bytes, and
// that `bound` bytes of the file, `per_voxel` each, can hold them. Allocate only then, so that a false header
// allocates nothing.
OmStatus om__volume_alloc(OmVolume* volume, const int64_t dim[3], OmVoxelType type,
                          uint64_t per_voxel, uint64_t bound, uint64_t max_size);
// Fill the allocated volume from the source.
OmStatus om__volume_read_binary(OmVolume* volume, OmSource* src, const OmVoxelLayout* layout);
// Check the axes and the values; the number of non-finite voxels is logged.
OmStatus om__volume_finish(OmVolume* volume);
bool om__is_little_endian(void);

// ---- formats ----------------------------------------------------------------------------------------

OmStatus om__nifti_parse(OmSource* src, const OmVolumeTask* task);
OmStatus om__nrrd_parse(OmSource* src, const OmVolumeTask* task);

// ---- names of segments (image_segment.c) --------------------------------------------------------------

// The segment `name` of a list, added (with layer and value -1) if it is new; at most OM_SEGMENT_MAX.
#define OM_SEGMENT_MAX 4096
OmStatus om__segment_at(OmVolumeInfo* info, int index, OmSegment** segment);
// Copy a name of any bytes: control characters become blanks, invalid UTF-8 becomes "?".
void om__segment_name(const char* str, size_t len, char out[OM_SEGMENT_NAME]);
// Read one "key:=value" of an NRRD header: the keys of 3D Slicer's segmentations are stored.
OmStatus om__segment_read_key(const char* line, size_t len, OmVolumeInfo* info);
// Fill in missing layers and values; OM_INVALID if a segment names a layer that the file does not have.
OmStatus om__segment_finish(OmVolumeInfo* info);
// Read labels of an XML table in an extension of a NIfTI header: <Label Key="5" ...>liver</Label>.
OmStatus om__segment_read_table(const char* text, size_t size, OmVolumeInfo* info);
// Choose the volume to read out of `nentry`, by the task.
OmStatus om__choose_entry(const OmVolumeTask* task, uint64_t nentry, OmVoxelLayout* layout);

#endif
