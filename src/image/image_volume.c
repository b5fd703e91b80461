// image_volume.c: creation and destruction of volumes, their voxels in the file's type, and their values.
#include <limits.h>
#include <string.h>

#include "image/image_internal.h"

#define CHUNK 8192  // values converted at a time

OmStatus om_volume_init(OmVolume* volume, int nx, int ny, int nz) {
    memset(volume, 0, sizeof *volume);
    OM_CHECK(nx > 0 && ny > 0 && nz > 0, OM_INVALID, "a volume of %d x %d x %d voxels", nx, ny, nz);
    OM_CHECK((double)nx * ny * nz <= INT_MAX, OM_INVALID,
             "a volume of %d x %d x %d voxels is too large: at most %d in all", nx, ny, nz,
             INT_MAX);
    volume->voxel = om_calloc((size_t)nx * (size_t)ny * (size_t)nz, sizeof(float));
    if (!volume->voxel) return OM_NO_MEMORY;
    volume->type = OM_VOXEL_F32;
    volume->slope = 1;
    volume->grid.dim[0] = nx;
    volume->grid.dim[1] = ny;
    volume->grid.dim[2] = nz;
    volume->grid.axis = om_mat3_identity();
    return OM_OK;
}

void om_volume_done(OmVolume* volume) {
    if (!volume) return;
    om_free(volume->voxel);
    memset(volume, 0, sizeof *volume);
}

size_t om_volume_count(const OmVolume* volume) { return om_grid_count(volume->grid.dim); }

OmStatus om__volume_alloc(OmVolume* volume, const int64_t dim[3], OmVoxelType type,
                          uint64_t per_voxel, uint64_t bound, uint64_t max_size) {
    memset(volume, 0, sizeof *volume);
    uint64_t count = 1, size = om_voxel_size(type);
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
        per_voxel == 0 || count <= bound / per_voxel, OM_INVALID,
        "the header states %lld x %lld x %lld voxels of %llu byte%s, the file can hold at most "
        "%llu bytes: it is cut short or its header is wrong",
        (long long)dim[0], (long long)dim[1], (long long)dim[2], (unsigned long long)per_voxel,
        per_voxel == 1 ? "" : "s", (unsigned long long)bound);
    OM_CHECK(
        count * size <= max_size, OM_INVALID,
        "%lld x %lld x %lld voxels take %.3g GB, at most %.3g GB are read: crop the volume, or "
        "raise the limit (--max-volume, in a scene max_volume_gb)",
        (long long)dim[0], (long long)dim[1], (long long)dim[2], (double)(count * size) * 1e-9,
        (double)max_size * 1e-9);
    // not cleared: every voxel is written, or the volume is destroyed
    volume->voxel = om_alloc((size_t)count, (size_t)size);
    if (!volume->voxel) return OM_NO_MEMORY;
    volume->type = type;
    volume->slope = 1;
    for (int a = 0; a < 3; a++) volume->grid.dim[a] = (int)dim[a];
    volume->grid.axis = om_mat3_identity();
    return OM_OK;
}

// ---- values -------------------------------------------------------------------------------------

size_t om_voxel_size(OmVoxelType type) {
    static const unsigned char size[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return size[type];
}

#define CONVERT(ctype)                                                                 \
    do {                                                                               \
        const ctype* stored = (const ctype*)volume->voxel + first;                     \
        for (size_t i = 0; i < count; i++) out[i] = slope * (double)stored[i] + inter; \
    } while (0)

// Convert values; non-finite ones stay non-finite.
static void convert(const OmVolume* volume, size_t first, size_t count, double* out) {
    double slope = volume->slope, inter = volume->inter;
    switch (volume->type) {
    case OM_VOXEL_U8: CONVERT(uint8_t); break;
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

void om_volume_values(const OmVolume* volume, size_t first, size_t count, double* out) {
    convert(volume, first, count, out);
    if (volume->type != OM_VOXEL_F32 && volume->type != OM_VOXEL_F64) return;
    for (size_t i = 0; i < count; i++) out[i] = isfinite(out[i]) ? out[i] : 0;
}

double om_volume_value(const OmVolume* volume, size_t voxel) {
    double value;
    om_volume_values(volume, voxel, 1, &value);
    return value;
}

// ---- reading ------------------------------------------------------------------------------------

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

OmStatus om__volume_read_binary(OmVolume* volume, OmSource* src, const OmVoxelLayout* layout) {
    size_t count = om_volume_count(volume), size = om_voxel_size(volume->type);
    unsigned char* out = volume->voxel;
    if (layout->nentry <= 1) {
        OM_TRY(om__source_read(src, out, count * size));
    } else {  // one entry of the non-spatial axis (a component, a time) is read, the others skipped
        OM_CHECK(layout->nentry <= UINT64_MAX / size / layout->nbefore, OM_INVALID,
                 "the header states %llu volumes", (unsigned long long)layout->nentry);
        size_t run = (size_t)layout->nbefore;
        uint64_t nskip = layout->entry;
        for (size_t done = 0; done < count; done += run) {
            OM_TRY(om__source_skip(src, nskip * run * size));
            OM_TRY(om__source_read(src, out + done * size, run * size));
            nskip = layout->nentry - 1;
        }
    }
    if (layout->is_swapped && size > 1) swap_bytes(out, count, size);
    return OM_OK;
}

// Integers with finite scales have finite values; only voxels of float types are checked.
static OmStatus check_values(const OmVolume* volume) {
    if (volume->type != OM_VOXEL_F32 && volume->type != OM_VOXEL_F64) return OM_OK;
    size_t count = om_volume_count(volume), nbad = 0;
    double value[CHUNK];
    for (size_t first = 0; first < count; first += CHUNK) {
        size_t n = count - first < CHUNK ? count - first : CHUNK;
        convert(volume, first, n, value);
        for (size_t i = 0; i < n; i++) nbad += !isfinite(value[i]);
    }
    OM_CHECK(nbad < count, OM_INVALID, "none of the %zu voxels is a finite number", count);
    if (nbad) om_log(OM_LOG_WARNING, "%zu voxels were not finite and became 0", nbad);
    return OM_OK;
}

OmStatus om__volume_finish(OmVolume* volume) {
    const OmMat3* m = &volume->grid.axis;
    OM_CHECK(om_is_finite3(m->cx) && om_is_finite3(m->cy) && om_is_finite3(m->cz) &&
                 om_is_finite3(volume->grid.origin),
             OM_INVALID, "the axes or the origin in the header are not finite");
    double size = om_norm(m->cx) * om_norm(m->cy) * om_norm(m->cz);
    double det = fabs(om_mat3_det(*m));
    OM_CHECK(size > 0 && isfinite(size) && det > 1e-6 * size, OM_INVALID,
             "the axes in the header are singular: voxel of %g x %g x %g m and %g m3",
             om_norm(m->cx), om_norm(m->cy), om_norm(m->cz), det);
    return check_values(volume);
}

void om_volume_info_done(OmVolumeInfo* info) {
    if (!info) return;
    om_free(info->segment);
    memset(info, 0, sizeof *info);
}
