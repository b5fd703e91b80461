// image_volume.c: the life of volumes, and turning stored voxels of any type into floats.
#include <limits.h>
#include <string.h>

#include "image/image_internal.h"

#define CHUNK 65536  // bytes converted at a time

OmStatus om_volume_init(OmVolume* volume, int nx, int ny, int nz) {
    memset(volume, 0, sizeof *volume);
    OM_CHECK(nx > 0 && ny > 0 && nz > 0, OM_INVALID, "a volume of %d x %d x %d voxels", nx, ny, nz);
    OM_CHECK((double)nx * ny * nz <= INT_MAX, OM_INVALID,
             "a volume of %d x %d x %d voxels is too large: at most %d in all", nx, ny, nz,
             INT_MAX);
    volume->value = om_calloc((size_t)nx * (size_t)ny * (size_t)nz, sizeof(float));
    if (!volume->value) return OM_NO_MEMORY;
    volume->dim[0] = nx;
    volume->dim[1] = ny;
    volume->dim[2] = nz;
    volume->axis = om_mat3_identity();
    return OM_OK;
}

void om_volume_done(OmVolume* volume) {
    if (!volume) return;
    om_free(volume->value);
    memset(volume, 0, sizeof *volume);
}

OmStatus om__volume_alloc(OmVolume* volume, const int64_t dim[3], uint64_t bytes_per_voxel,
                          uint64_t bound) {
    memset(volume, 0, sizeof *volume);
    uint64_t count = 1;
    for (int a = 0; a < 3; a++) {
        OM_CHECK(dim[a] > 0 && dim[a] <= INT_MAX, OM_INVALID,
                 "the header states %lld voxels along axis %d", (long long)dim[a], a);
        OM_CHECK(count <= INT_MAX / (uint64_t)dim[a], OM_INVALID,
                 "the header states more than %d voxels (%lld x %lld x %lld)", INT_MAX,
                 (long long)dim[0], (long long)dim[1], (long long)dim[2]);
        count *= (uint64_t)dim[a];
    }
    // at most 2^31 voxels of a few bytes: no overflow
    OM_CHECK(
        bytes_per_voxel == 0 || count <= bound / bytes_per_voxel, OM_INVALID,
        "the header states %lld x %lld x %lld voxels of %llu byte%s, the file can hold at most "
        "%llu bytes: it is cut short or its header is wrong",
        (long long)dim[0], (long long)dim[1], (long long)dim[2],
        (unsigned long long)bytes_per_voxel, bytes_per_voxel == 1 ? "" : "s",
        (unsigned long long)bound);
    // not cleared: every voxel is written, or the volume is dropped
    volume->value = om_alloc((size_t)count, sizeof(float));
    if (!volume->value) return OM_NO_MEMORY;
    for (int a = 0; a < 3; a++) volume->dim[a] = (int)dim[a];
    volume->axis = om_mat3_identity();
    return OM_OK;
}

// ---- conversion ---------------------------------------------------------------------------------

size_t om__voxel_size(OmVoxelType type) {
    static const unsigned char size[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return size[type];
}

bool om__is_little_endian(void) {
    const uint16_t one = 1;
    unsigned char first;
    memcpy(&first, &one, 1);
    return first == 1;
}

static void swap_bytes(unsigned char* bytes, size_t count, size_t size) {
    for (size_t i = 0; i < count; i++, bytes += size) {
        for (size_t a = 0, b = size - 1; a < b; a++, b--) {
            unsigned char t = bytes[a];
            bytes[a] = bytes[b];
            bytes[b] = t;
        }
    }
}

// Values beyond the range of float saturate to infinity, which om__volume_finish reports.
#define CONVERT(type)                                                              \
    do {                                                                           \
        for (size_t i = 0; i < count; i++) {                                       \
            type stored;                                                           \
            memcpy(&stored, bytes + i * sizeof stored, sizeof stored);             \
            double v = layout->slope * (double)stored + layout->inter;             \
            bool fits = v >= -(double)3.4028234e38f && v <= (double)3.4028234e38f; \
            out[i] = fits ? (float)v : HUGE_VALF;                                  \
        }                                                                          \
    } while (0)

static void convert(const OmVoxelLayout* layout, const unsigned char* bytes, size_t count,
                    float* out) {
    bool is_plain = layout->slope == 1 && layout->inter == 0;
    switch (layout->type) {
    case OM_VOXEL_U8:
        if (is_plain) {  // label maps, the common case: no doubles in between
            for (size_t i = 0; i < count; i++) out[i] = (float)bytes[i];
        } else {
            CONVERT(uint8_t);
        }
        break;
    case OM_VOXEL_I8: CONVERT(int8_t); break;
    case OM_VOXEL_U16: CONVERT(uint16_t); break;
    case OM_VOXEL_I16: CONVERT(int16_t); break;
    case OM_VOXEL_U32: CONVERT(uint32_t); break;
    case OM_VOXEL_I32: CONVERT(int32_t); break;
    case OM_VOXEL_U64: CONVERT(uint64_t); break;
    case OM_VOXEL_I64: CONVERT(int64_t); break;
    case OM_VOXEL_F32: CONVERT(float); break;
    case OM_VOXEL_F64: CONVERT(double); break;
    }
}

static OmStatus read_run(OmSource* src, const OmVoxelLayout* layout, size_t count, float* out) {
    unsigned char bytes[CHUNK];
    size_t size = om__voxel_size(layout->type);
    while (count > 0) {
        size_t n = count < CHUNK / size ? count : CHUNK / size;
        OM_TRY(om__source_read(src, bytes, n * size));
        if (layout->is_swapped && size > 1) swap_bytes(bytes, n, size);
        convert(layout, bytes, n, out);
        out += n;
        count -= n;
    }
    return OM_OK;
}

OmStatus om__volume_read_binary(OmVolume* volume, OmSource* src, const OmVoxelLayout* layout) {
    size_t count = (size_t)volume->dim[0] * (size_t)volume->dim[1] * (size_t)volume->dim[2];
    if (layout->nentry <= 1) return read_run(src, layout, count, volume->value);
    // one entry of an axis that is not of space (a component, a time) is taken, the others skipped
    uint64_t size = om__voxel_size(layout->type);
    OM_CHECK(layout->nentry <= UINT64_MAX / size / layout->nbefore, OM_INVALID,
             "the header states %llu volumes", (unsigned long long)layout->nentry);
    size_t run = (size_t)layout->nbefore;
    uint64_t nskip = layout->entry;
    for (size_t done = 0; done < count; done += run) {
        OM_TRY(om__source_skip(src, nskip * run * size));
        OM_TRY(read_run(src, layout, run, volume->value + done));
        nskip = layout->nentry - 1;
    }
    return OM_OK;
}

OmStatus om__volume_finish(OmVolume* volume) {
    const OmMat3* m = &volume->axis;
    OM_CHECK(om_is_finite3(m->cx) && om_is_finite3(m->cy) && om_is_finite3(m->cz) &&
                 om_is_finite3(volume->origin),
             OM_INVALID, "the axes or the origin in the header are not finite");
    double size = om_norm(m->cx) * om_norm(m->cy) * om_norm(m->cz);
    double det = fabs(om_mat3_det(*m));
    OM_CHECK(size > 0 && isfinite(size) && det > 1e-6 * size, OM_INVALID,
             "the axes in the header are singular: voxel of %g x %g x %g m and %g m3",
             om_norm(m->cx), om_norm(m->cy), om_norm(m->cz), det);
    size_t count = (size_t)volume->dim[0] * (size_t)volume->dim[1] * (size_t)volume->dim[2];
    size_t nbad = 0;
    for (size_t i = 0; i < count; i++) {
        if (isfinite(volume->value[i])) continue;
        volume->value[i] = 0;
        nbad++;
    }
    if (nbad) om_log(OM_LOG_WARNING, "%zu voxels were not finite and became 0", nbad);
    return OM_OK;
}

// ---- loading ------------------------------------------------------------------------------------

static OmStatus load_bytes(const char* ext, const char* data, size_t size,
                           const OmVolumeTask* task) {
    if (size >= 4 && memcmp(data, "NRRD", 4) == 0) return om__nrrd_parse(data, size, task);
    bool is_nifti = strcmp(ext, "nii") == 0 || strcmp(ext, "nii.gz") == 0 ||
                    strcmp(ext, "hdr") == 0 || strcmp(ext, "hdr.gz") == 0 ||
                    strcmp(ext, "img") == 0 || strcmp(ext, "img.gz") == 0;
    if (is_nifti) return om__nifti_parse(data, size, task);
    if (strcmp(ext, "nrrd") == 0 || strcmp(ext, "nhdr") == 0)
        return om__nrrd_parse(data, size, task);
    return om_error(OM_INVALID,
                    "\"%s\" is no extension of a volume: .nii, .nii.gz, .hdr, .nrrd and .nhdr are "
                    "read (DICOM series: convert them, for instance with dcm2niix)",
                    ext);
}

static OmStatus run_task(const OmVolumeTask* task) {
    char ext[16];
    char* data = NULL;
    size_t size = 0;
    if (task->volume) memset(task->volume, 0, sizeof *task->volume);
    memset(task->info, 0, sizeof *task->info);
    om_path_extension(task->path, ext, sizeof ext);
    // a name such as patient.1.nii has the extension "nii"; "seg.v2.gz" none that is known
    OM_TRY(om_file_read(task->path, OM_VOLUME_FILE_MAX, &data, &size));
    OmStatus status = load_bytes(ext, data, size, task);
    om_free(data);
    if (status >= 0) return status;
    if (task->volume) om_volume_done(task->volume);
    return om_error_prefix(status, "%s", task->path);
}

OmStatus om_volume_load_entry(const char* path, int entry, OmVolume* volume) {
    OmVolumeInfo info;
    memset(volume, 0, sizeof *volume);
    OM_CHECK(entry >= 0, OM_INVALID, "%s: volume %d: the volumes of a file count from 0", path,
             entry);
    const OmVolumeTask task = {path, entry, volume, &info};
    OmStatus status = run_task(&task);
    om_volume_info_done(&info);
    return status;
}

OmStatus om_volume_load(const char* path, OmVolume* volume) {
    OmVolumeInfo info;
    const OmVolumeTask task = {path, -1, volume, &info};
    OmStatus status = run_task(&task);
    om_volume_info_done(&info);
    return status;
}

OmStatus om_volume_load_info(const char* path, OmVolumeInfo* info) {
    const OmVolumeTask task = {path, 0, NULL, info};
    OmStatus status = run_task(&task);
    if (status < 0) om_volume_info_done(info);
    return status;
}

void om_volume_info_done(OmVolumeInfo* info) {
    if (!info) return;
    om_free(info->segment);
    memset(info, 0, sizeof *info);
}
