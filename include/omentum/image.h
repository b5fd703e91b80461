/// omentum/image.h: volumes (CT, MR, label maps) and pictures (floor 1).
///
/// Volumes are read from NIfTI and NRRD and written as NRRD, pictures are written as PNG.
#ifndef OMENTUM_IMAGE_H
#define OMENTUM_IMAGE_H

#include "omentum/base.h"
#include "omentum/math_grid.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmVoxelType {  // of the stored values
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
/// Bytes of one stored value.
OM_API size_t om_voxel_size(OmVoxelType type);

/// A scalar volume. Its grid is in RAS metres, for any convention and unit of the file. Voxels keep the type of the
/// file: a label map of bytes takes a byte a voxel. om_volume_value reads them.
typedef struct OmVolume {
    OmVoxelGrid grid;
    OmVoxelType type;  //
    void* voxel;  // values as stored, in this machine's order of bytes; of om_volume_init: float
    double slope, inter;  // value = slope * stored + inter
} OmVolume;

/// Bytes that the voxels of a volume may take if nothing else is said: a CT of 512 x 512 x 2048.
#define OM_VOLUME_MAX_SIZE ((uint64_t)1 << 30)

/// A volume of zeros of type OM_VOXEL_F32, unit axes; om_volume_done frees it.
/// @return OM_OK; OM_INVALID (a size below 1, or too large); OM_NO_MEMORY
OM_API OmStatus om_volume_init(OmVolume* volume, int nx, int ny, int nz);
OM_API void om_volume_done(OmVolume* volume);
/// Read NIfTI-1/2 (.nii, .nii.gz, .hdr/.img) or NRRD (.nrrd, .nhdr). OM_INVALID for a header that lies about sizes
/// or states an absurd scale, a singular axis matrix, a volume of more than OM_VOLUME_MAX_SIZE bytes, which is
/// refused from its header, and a file of several volumes: choose one by om_volume_load_entry. Memory: the
/// voxels, and a quarter of a MB.
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_volume_load(const char* path, OmVolume* volume);

#define OM_SEGMENT_NAME 128
typedef struct OmSegment {       // a named part of a label map
    char name[OM_SEGMENT_NAME];  // UTF-8 without control characters; "" if the file gives none
    char id[OM_SEGMENT_NAME];    // of a .seg.nrrd, the same; "" elsewhere
    int layer;                   // the entry of the file that holds its voxels, from 0
    int value;                   // of its voxels there
} OmSegment;

#define OM_VOLUME_NOTE 320
typedef struct OmVolumeInfo {  // header of a volume's file; om_volume_info_done frees
    int dim[3];
    int nentry;       // volumes in the file: times, components or layers; 1 of a plain volume
    bool has_layers;  // the volumes are layers of segments that may overlap (3D Slicer)
    double unit;      // of the lengths in the header, m; 0: not stated, millimetres are taken
    bool has_space;   // the header says how the voxels lie in the patient; false: taken as RAS
    // statements of the header that contradict each other; "" if none do
    char note[OM_VOLUME_NOTE];
    int nsegment;        //
    OmSegment* segment;  // names of .seg.nrrd (3D Slicer), or of a label table in NIfTI (nsegment)
} OmVolumeInfo;
/// Read the header of a file: sizes, number of volumes, names of segments.
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_volume_load_info(const char* path, OmVolumeInfo* info);
OM_API void om_volume_info_done(OmVolumeInfo* info);
/// Read one volume of a file of several: a time or component, or a layer of overlapping segments.
/// @param entry  from 0; in NIfTI the fourth axis counts fastest
/// @return OM_OK; OM_INVALID (no such volume, or the message names the field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_volume_load_entry(const char* path, int entry, OmVolume* volume);
/// The same with a limit of one's own.
/// @param entry     from 0; -1: the only volume, a file of several is OM_INVALID
/// @param max_size  bytes that the voxels may take in the type of the file
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_volume_load_within(const char* path, int entry, uint64_t max_size,
                                      OmVolume* volume);
/// Write NRRD (.nrrd), uncompressed, in RAS millimetres; values are rounded to whole numbers for U8 and I16.
/// @param type  OM_VOXEL_U8 (label maps), OM_VOXEL_I16 (CT), OM_VOXEL_F32
/// @return OM_OK; OM_INVALID (another type, a value that does not fit); OM_NO_MEMORY; OM_IO, the old file stays
OM_API OmStatus om_volume_save(const OmVolume* volume, OmVoxelType type, const char* path);
/// Number of voxels.
OM_API size_t om_volume_count(const OmVolume* volume);
/// Value of a voxel, slope and intercept applied; 0 if it is not finite.
OM_API double om_volume_value(const OmVolume* volume, size_t voxel);
/// The same for `count` voxels from `first` on.
OM_API void om_volume_values(const OmVolume* volume, size_t first, size_t count, double* out);

/// Does a path name a DICOM file, or a folder with one among its first entries?
OM_API bool om_dicom_is_there(const char* path);
typedef struct OmDicomSeries {  // om_dicom_done removes the folder
    char dir[256];              // temporary folder of what dcm2niix wrote
    char path[1100];            // of the volume in it
} OmDicomSeries;
/// A line of dcm2niix, in ASCII.
typedef void (*OmDicomSay)(void* ctx, const char* line);
/// Convert a DICOM series to NIfTI by the program dcm2niix, a package of its own on PATH. `path` is a folder with one
/// series, or one of its files. The temporary folder is made below $TMPDIR. `say` may be null.
/// @return OM_OK; OM_UNAVAILABLE (dcm2niix is not installed); OM_INVALID (no DICOM, a segmentation, several series,
///         dcm2niix failed: the message has the remedy); OM_IO; OM_NO_MEMORY
OM_API OmStatus om_dicom_convert(const char* path, OmDicomSay say, void* ctx,
                                 OmDicomSeries* series);
OM_API void om_dicom_done(OmDicomSeries* series);
/// The readers of volumes do not read DICOM. For a DICOM file or a folder that holds one the message is the command
/// that converts it.
/// @return OM_OK: no DICOM is there; OM_INVALID: it is DICOM
OM_API OmStatus om_volume_refuse_dicom(const char* path);

/// An 8-bit picture: row by row from the top, 1 (grey), 3 (RGB) or 4 (RGBA) channels.
typedef struct OmPicture {
    int width, height, nchannel;
    unsigned char* pixel;  // height x width x nchannel
} OmPicture;
/// A black picture; om_picture_done frees it.
/// @return OM_OK; OM_INVALID (size or number of channels out of range); OM_NO_MEMORY
OM_API OmStatus om_picture_init(OmPicture* picture, int width, int height, int nchannel);
OM_API void om_picture_done(OmPicture* picture);
/// The picture at a part of its size: means of factor x factor pixels; the rest of a row or column is left out.
/// @param factor  1 or more, not above either side
/// @return OM_OK; OM_INVALID (factor); OM_NO_MEMORY
OM_API OmStatus om_picture_shrink(const OmPicture* picture, int factor, OmPicture* small);
/// Encode as PNG into memory (append to `text`), or to a file (whole or not at all).
/// @return OM_OK; OM_INVALID (an empty picture); OM_NO_MEMORY
OM_API OmStatus om_picture_encode_png(const OmPicture* picture, OmText* text);
/// Encode n pictures of one size as an animated PNG (append to `text`): each is shown for `seconds`, again and again. A
/// program that does not know animations shows the first.
/// @param seconds  0.01 to 60
/// @return OM_OK; OM_INVALID (an empty picture, another size, no picture, a time out of range); OM_NO_MEMORY
OM_API OmStatus om_picture_encode_apng(const OmPicture* picture, int n, double seconds,
                                       OmText* text);
/// Write a PNG file.
/// @return OM_OK; OM_INVALID (an empty picture); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_picture_save_png(const OmPicture* picture, const char* path);
/// 16-bit grey PNG (depth images in mm).
/// @return OM_OK; OM_INVALID (an empty picture); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_picture_save_png16(const uint16_t* value, int width, int height,
                                      const char* path);
/// Read a PNG file as 8-bit RGB: grey and palettes are converted, transparency is dropped, 16 bits become 8. At most
/// 16,384 pixels a side.
/// @return OM_OK; OM_INVALID (not a PNG, or damaged); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_picture_load_png(const char* path, OmPicture* picture);
/// Read a 16-bit grey PNG (height x width), freed by om_free; one of another type is refused.
/// @return OM_OK; OM_INVALID (not a PNG, not 16-bit grey, or damaged); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_picture_load_png16(const char* path, uint16_t** value, int* width, int* height);

#ifdef __cplusplus
}
#endif
#endif
