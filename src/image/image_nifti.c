// image_nifti.c: NIfTI-1 and NIfTI-2, single files and pairs of .hdr and .img.
//
// Files may be hostile: each field is copied out of the bytes, checked, and only then used. The
// transform is the sform if its code is positive, else the qform, else the voxel sizes alone (then
// the log says that the orientation is a guess). Both forms give RAS in the file's unit.
//
// References: nifti1.h and nifti2.h (the layout of both headers), R. W. Cox (quaternions of qform).
#include <limits.h>
#include <string.h>

#include "image/image_internal.h"

#define HEADER1 348
#define HEADER2 540

typedef struct Header {  // the fields that are used, from either version
    bool is_swapped, is_pair;
    uint64_t size;  // of the header in the file
    int datatype, bitpix;
    int64_t dim[8];
    double pixdim[8];
    double vox_offset, slope, inter;
    int qform, sform, units;
    double quatern[3], qoffset[3], srow[12];
} Header;

// Copy a field of `size` bytes out of the header, in this machine's order.
static void get_bytes(const unsigned char* h, size_t adr, size_t size, bool is_swapped, void* out) {
    unsigned char* o = out;
    for (size_t i = 0; i < size; i++) o[i] = h[adr + (is_swapped ? size - 1 - i : i)];
}
static int get_i16(const unsigned char* h, size_t adr, bool is_swapped) {
    int16_t v;
    get_bytes(h, adr, sizeof v, is_swapped, &v);
    return v;
}
static int get_i32(const unsigned char* h, size_t adr, bool is_swapped) {
    int32_t v;
    get_bytes(h, adr, sizeof v, is_swapped, &v);
    return v;
}
static int64_t get_i64(const unsigned char* h, size_t adr, bool is_swapped) {
    int64_t v;
    get_bytes(h, adr, sizeof v, is_swapped, &v);
    return v;
}
static double get_f32(const unsigned char* h, size_t adr, bool is_swapped) {
    float v;
    get_bytes(h, adr, sizeof v, is_swapped, &v);
    return (double)v;
}
static double get_f64(const unsigned char* h, size_t adr, bool is_swapped) {
    double v;
    get_bytes(h, adr, sizeof v, is_swapped, &v);
    return v;
}

static OmStatus read_header1(const unsigned char* h, bool sw, Header* out) {
    OM_CHECK(memcmp(h + 344, "n+1", 4) == 0 || memcmp(h + 344, "ni1", 4) == 0, OM_INVALID,
             "no NIfTI mark in bytes 344 to 347 (an ANALYZE file? its orientation is unknown: "
             "convert it to NIfTI)");
    out->is_pair = h[345] == 'i';
    for (size_t i = 0; i < 8; i++) {
        out->dim[i] = get_i16(h, 40 + 2 * i, sw);
        out->pixdim[i] = get_f32(h, 76 + 4 * i, sw);
    }
    out->datatype = get_i16(h, 70, sw);
    out->bitpix = get_i16(h, 72, sw);
    out->vox_offset = get_f32(h, 108, sw);
    out->slope = get_f32(h, 112, sw);
    out->inter = get_f32(h, 116, sw);
    out->units = h[123];
    out->qform = get_i16(h, 252, sw);
    out->sform = get_i16(h, 254, sw);
    for (size_t i = 0; i < 3; i++) {
        out->quatern[i] = get_f32(h, 256 + 4 * i, sw);
        out->qoffset[i] = get_f32(h, 268 + 4 * i, sw);
    }
    for (size_t i = 0; i < 12; i++) out->srow[i] = get_f32(h, 280 + 4 * i, sw);
    return OM_OK;
}

static OmStatus read_header2(const unsigned char* h, bool sw, Header* out) {
    static const unsigned char mark[5] = {0, '\r', '\n', 032, '\n'};
    OM_CHECK((memcmp(h + 4, "n+2", 3) == 0 || memcmp(h + 4, "ni2", 3) == 0) &&
                 memcmp(h + 7, mark, 5) == 0,
             OM_INVALID, "no NIfTI-2 mark in bytes 4 to 11 (damaged by a text-mode transfer?)");
    out->is_pair = h[5] == 'i';
    out->datatype = get_i16(h, 12, sw);
    out->bitpix = get_i16(h, 14, sw);
    for (size_t i = 0; i < 8; i++) {
        out->dim[i] = get_i64(h, 16 + 8 * i, sw);
        out->pixdim[i] = get_f64(h, 104 + 8 * i, sw);
    }
    out->vox_offset = (double)get_i64(h, 168, sw);
    out->slope = get_f64(h, 176, sw);
    out->inter = get_f64(h, 184, sw);
    out->qform = get_i32(h, 344, sw);
    out->sform = get_i32(h, 348, sw);
    for (size_t i = 0; i < 3; i++) {
        out->quatern[i] = get_f64(h, 352 + 8 * i, sw);
        out->qoffset[i] = get_f64(h, 376 + 8 * i, sw);
    }
    for (size_t i = 0; i < 12; i++) out->srow[i] = get_f64(h, 400 + 8 * i, sw);
    out->units = get_i32(h, 500, sw);
    return OM_OK;
}

// The stated length of the header determines version and byte order.
static OmStatus read_header(OmSource* src, Header* out) {
    unsigned char h[HEADER2];
    memset(out, 0, sizeof *out);
    OM_TRY(om__source_read(src, h, HEADER1));
    for (int sw = 0; sw < 2; sw++) {
        out->is_swapped = sw != 0;
        int size = get_i32(h, 0, out->is_swapped);
        out->size = size > 0 ? (uint64_t)size : 0;
        if (size == HEADER1) return read_header1(h, out->is_swapped, out);
        if (size == HEADER2) {
            OM_TRY(om__source_read(src, h + HEADER1, HEADER2 - HEADER1));
            return read_header2(h, out->is_swapped, out);
        }
    }
    return om_error(OM_INVALID, "not a NIfTI file: its first field is neither 348 nor 540");
}

static OmStatus voxel_type(const Header* h, OmVoxelType* type) {
    static const struct {
        int code;
        OmVoxelType type;
    } table[] = {{2, OM_VOXEL_U8},    {4, OM_VOXEL_I16},   {8, OM_VOXEL_I32},
                 {16, OM_VOXEL_F32},  {64, OM_VOXEL_F64},  {256, OM_VOXEL_I8},
                 {512, OM_VOXEL_U16}, {768, OM_VOXEL_U32}, {1024, OM_VOXEL_I64},
                 {1280, OM_VOXEL_U64}};
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        if (table[i].code != h->datatype) continue;
        *type = table[i].type;
        OM_CHECK(h->bitpix == 0 || (size_t)h->bitpix == 8 * om_voxel_size(*type), OM_INVALID,
                 "fields datatype (%d) and bitpix (%d) disagree", h->datatype, h->bitpix);
        return OM_OK;
    }
    return om_error(OM_INVALID,
                    "field datatype: %d is not read (scalars of 8 to 64 bits are; colours and "
                    "complex numbers are not)",
                    h->datatype);
}

static OmStatus check_dims(const Header* h, int64_t dim[3], uint64_t* nentry) {
    OM_CHECK(h->dim[0] >= 1 && h->dim[0] <= 7, OM_INVALID, "field dim: %lld axes, 1 to 7 exist",
             (long long)h->dim[0]);
    for (int a = 0; a < 3; a++) dim[a] = a < h->dim[0] ? h->dim[a + 1] : 1;
    *nentry = 1;
    for (int a = 4; a <= h->dim[0]; a++) {
        OM_CHECK(h->dim[a] >= 1, OM_INVALID, "field dim: %lld entries along axis %d",
                 (long long)h->dim[a], a);
        OM_CHECK((uint64_t)h->dim[a] <= INT_MAX / *nentry, OM_INVALID,
                 "field dim: %lld entries along axis %d: more than %d volumes",
                 (long long)h->dim[a], a, INT_MAX);
        *nentry *= (uint64_t)h->dim[a];
    }
    return OM_OK;
}

// ---- the transform ----------------------------------------------------------------------------------

static double voxel_step(const Header* h, int a) {
    double step = fabs(h->pixdim[a + 1]);
    bool is_thin = a >= h->dim[0] || h->dim[a + 1] == 1;  // one slice: its thickness may be unset
    return is_thin && !(step > 0) ? 1 : step;
}

// Quaternion (b, c, d) of the header to axes; pixdim[0] < 0 turns the third axis.
static void qform_axes(const Header* h, OmMat3* axis) {
    double b = h->quatern[0], c = h->quatern[1], d = h->quatern[2];
    double rest = 1 - (b * b + c * c + d * d);
    double a = 0;
    if (rest < 1e-7) {  // a rotation by pi, up to rounding
        double len = sqrt(b * b + c * c + d * d);
        b /= len;  // len is about 1 or more here
        c /= len;
        d /= len;
    } else {
        a = sqrt(rest);
    }
    OmQuat q = {b, c, d, a};
    OmMat3 r = om_quat_to_mat3(q);
    double qfac = h->pixdim[0] < 0 ? -1 : 1;
    *axis = om_mat3_cols(om_scale(voxel_step(h, 0), r.cx), om_scale(voxel_step(h, 1), r.cy),
                         om_scale(qfac * voxel_step(h, 2), r.cz));
}

static OmMat3 sform_axes(const Header* h) {
    const double* s = h->srow;
    return om_mat3_cols(om_vec3(s[0], s[4], s[8]), om_vec3(s[1], s[5], s[9]),
                        om_vec3(s[2], s[6], s[10]));
}

static OmStatus set_transform(const Header* h, OmVolume* volume) {
    double unit;
    switch (h->units & 7) {
    case 1: unit = 1; break;
    case 3: unit = 1e-6; break;
    case 0:
        om_log(OM_LOG_INFO, "field xyzt_units is unset: millimetres are assumed");  // fallthrough
    case 2: unit = 1e-3; break;
    default: return om_error(OM_INVALID, "field xyzt_units: %d is no unit of length", h->units & 7);
    }
    OmMat3 axis;
    OmVec3 origin;
    if (h->sform > 0) {
        const double* s = h->srow;
        axis = sform_axes(h);
        origin = om_vec3(s[3], s[7], s[11]);
    } else if (h->qform > 0) {
        qform_axes(h, &axis);
        origin = om_vec3(h->qoffset[0], h->qoffset[1], h->qoffset[2]);
    } else {
        om_log(OM_LOG_WARNING,
               "neither qform nor sform is set: orientation and position are unknown, the voxel "
               "sizes alone are used");
        axis = om_mat3_diag(om_vec3(voxel_step(h, 0), voxel_step(h, 1), voxel_step(h, 2)));
        origin = om_vec3(0, 0, 0);
    }
    volume->grid.axis = om_mat3_scale(unit, axis);
    volume->grid.origin = om_scale(unit, origin);
    return OM_OK;
}

// ---- contradictions --------------------------------------------------------------------------------

#define CODE_ATLAS 3  // from this code on a form refers to an atlas, whose voxels may be scaled

// Do the two forms mirror or turn the volume?
static void compare_forms(const Header* h, char* note, size_t size) {
    const char* from[] = {"left and right", "front and back", "up and down"};
    OmMat3 s = sform_axes(h), q;
    qform_axes(h, &q);
    const double det = om_mat3_det(s) * om_mat3_det(q);
    const OmVec3 axis[2][3] = {{s.cx, s.cy, s.cz}, {q.cx, q.cy, q.cz}};
    double cosine = 1;
    int worst = 0;
    for (int a = 0; a < 3; a++) {
        double len = om_norm(axis[0][a]) * om_norm(axis[1][a]);
        if (!(len > 0) || !isfinite(len)) return;  // the reader refuses it
        double c = om_dot(axis[0][a], axis[1][a]) / len;
        if (c < cosine) worst = a;
        cosine = fmin(cosine, c);
    }
    // a turn between two spaces may be meant, but no patient lies across an atlas
    const double limit = h->sform == h->qform ? cos(5 * OM_PI / 180) : cos(60 * OM_PI / 180);
    OmVec3 d = om_vec3(fabs(axis[0][worst].x), fabs(axis[0][worst].y), fabs(axis[0][worst].z));
    const int side = d.x >= d.y && d.x >= d.z ? 0 : d.y >= d.z ? 1 : 2;
    if (det < 0) {
        snprintf(
            note, size,
            "sform and qform of the header mirror each other (%s): the sform is used; check the side of "
            "the organ",
            from[side]);
    } else if (cosine < limit) {
        snprintf(
            note, size,
            "sform and qform of the header differ by a turn of %.0f degrees%s: the sform is used",
            acos(fmax(cosine, -1)) * 180 / OM_PI,
            s.cx.x * q.cx.x < 0 && cosine < -0.5 ? ", which may exchange left and right" : "");
    }
}

// Voxel sizes of the header against those of its sform.
static void compare_sizes(const Header* h, char* note, size_t size) {
    const OmMat3 s = sform_axes(h);
    const double len[3] = {om_norm(s.cx), om_norm(s.cy), om_norm(s.cz)};
    const double limit = h->sform >= CODE_ATLAS ? 1.3 : 1.01;
    bool is_off = false;
    for (int a = 0; a < 3; a++) {
        const double step = fabs(h->pixdim[a + 1]);
        if (!(step > 0) || !isfinite(step) || !(len[a] > 0)) continue;
        if (a >= h->dim[0] || h->dim[a + 1] == 1)
            continue;  // one slice: its thickness may be unset
        is_off = is_off || len[a] > limit * step || step > limit * len[a];
    }
    if (!is_off) return;
    snprintf(
        note, size,
        "pixdim of the header states voxels of %.4g x %.4g x %.4g, its sform of %.4g x %.4g x %.4g: the "
        "sform is used",
        fabs(h->pixdim[1]), fabs(h->pixdim[2]), fabs(h->pixdim[3]), len[0], len[1], len[2]);
}

static void find_contradictions(const Header* h, OmVolumeInfo* info) {
    if (h->sform <= 0) return;
    if (h->qform > 0) compare_forms(h, info->note, sizeof info->note);
    size_t n = strlen(info->note);
    if (n > 0 && n + 2 < sizeof info->note) {
        memcpy(info->note + n, "; ", 3);
        n += 2;
    }
    const size_t before = n;
    compare_sizes(h, info->note + n, sizeof info->note - n);
    if (n > 0 && !info->note[before]) info->note[before - 2] = 0;
    if (info->note[0]) om_log(OM_LOG_WARNING, "%s", info->note);
}

// ---- reading ------------------------------------------------------------------------------------------

// Scales of real images lie within these bounds; others are damage. So values stay finite for any stored number.
#define MIN_SLOPE 1e-30
#define MAX_SLOPE 1e12
#define MAX_INTER 1e12

static OmStatus set_scale(const Header* h, OmVolume* volume) {
    if (h->slope == 0 || isnan(h->slope) || isnan(h->inter))
        return OM_OK;  // no scaling, by the standard
    OM_CHECK(fabs(h->slope) >= MIN_SLOPE && fabs(h->slope) <= MAX_SLOPE, OM_INVALID,
             "field scl_slope: %g is no scale of intensities, %g to %g are read; set it to 1, and "
             "scl_inter to 0, for the stored values",
             h->slope, MIN_SLOPE, MAX_SLOPE);
    OM_CHECK(
        fabs(h->inter) <= MAX_INTER, OM_INVALID,
        "field scl_inter: %g is not an intensity (the limit is %g); set it to 0 for the stored "
        "values",
        h->inter, MAX_INTER);
    volume->slope = h->slope;
    volume->inter = h->inter;
    return OM_OK;
}

static OmStatus read_voxels(const Header* h, OmSource* src, uint64_t offset,
                            const OmVolumeTask* task) {
    OmVoxelLayout layout = {.is_swapped = h->is_swapped};
    OmVoxelType type = OM_VOXEL_U8;
    OmVolume* volume = task->volume;
    int64_t dim[3];
    uint64_t nentry;
    OM_TRY(check_dims(h, dim, &nentry));
    OM_TRY(om__choose_entry(task, nentry, &layout));
    OM_TRY(voxel_type(h, &type));
    OM_CHECK(offset <= om__source_bound(src), OM_INVALID,
             "field vox_offset: %llu lies behind the end of the file", (unsigned long long)offset);
    OM_TRY(om__volume_alloc(volume, dim, type, om_voxel_size(type),
                            om__source_bound(src) - (src->stream ? 0 : offset), task->max_size));
    layout.nbefore = om_volume_count(volume);
    OM_TRY(set_scale(h, volume));
    OM_TRY(set_transform(h, volume));
    OM_TRY(om__source_skip(src, offset));
    OM_TRY(om__volume_read_binary(volume, src, &layout));
    return om__volume_finish(volume);
}

// name.hdr[.gz] <-> name.img[.gz]; the compressed or the plain file, whichever exists.
static OmStatus partner_path(const char* path, const char* ext, char* out, size_t size) {
    size_t len = strlen(path);
    if (len > 3 && strcmp(path + len - 3, ".gz") == 0) len -= 3;
    OM_CHECK(len > 4 && path[len - 4] == '.', OM_INVALID,
             "the voxels of this header must be in a file of the same name that ends in .img");
    for (int is_gz = 0; is_gz < 2; is_gz++) {
        int n = snprintf(out, size, "%.*s%s%s", (int)(len - 3), path, ext, is_gz ? ".gz" : "");
        OM_CHECK(n > 0 && (size_t)n < size, OM_INVALID, "path of %d letters: at most %zu", n,
                 size - 1);
        if (om_path_exists(out)) return OM_OK;
    }
    return om_error(OM_IO, "the other half of the pair, %.*s%s, is not there", (int)(len - 3), path,
                    ext);
}

static OmStatus read_pair(const Header* h, uint64_t offset, const OmVolumeTask* task) {
    OM_CHECK(task->path, OM_INVALID, "this header refers to voxels in another file");
    char img[1024];
    OmSource src;
    OM_TRY(partner_path(task->path, "img", img, sizeof img));
    OM_TRY(om__source_open_file(&src, img));
    OmStatus status = om__source_is_gzip(&src) ? om__source_inflate(&src) : OM_OK;
    if (status == OM_OK) status = read_voxels(h, &src, offset, task);
    om__source_done(&src);
    return status < 0 ? om_error_prefix(status, "%s", img) : status;
}

// ---- extensions -----------------------------------------------------------------------------------------

#define EXTENSION_MAX ((size_t)1 << 20)  // bytes that are searched for names of labels

// Read names of labels, which some programs store between the header and the voxels. `src` is at the end
// of the header; `*room`, the number of bytes before the voxels, is reduced by the bytes read. Damaged
// extensions are skipped: they only hold names.
static OmStatus read_extensions(const Header* h, OmSource* src, uint64_t* room,
                                OmVolumeInfo* info) {
    unsigned char flag[4];
    if (*room < sizeof flag + 8) return OM_OK;
    OM_TRY(om__source_read(src, flag, sizeof flag));
    *room -= sizeof flag;
    if (!flag[0]) return OM_OK;
    size_t size = *room < EXTENSION_MAX ? (size_t)*room : EXTENSION_MAX;
    if (size > om__source_bound(src)) return OM_OK;  // the reader of the voxels reports it
    unsigned char* bytes = om_alloc(size, 1);
    if (!bytes) return OM_NO_MEMORY;
    OmStatus status = om__source_read(src, bytes, size);
    *room -= size;
    for (size_t at = 0; status == OM_OK && at + 8 <= size;) {
        int length = get_i32(bytes, at, h->is_swapped);
        if (length < 8 || (size_t)length > size - at) break;
        status = om__segment_read_table((const char*)bytes + at + 8, (size_t)length - 8, info);
        at += (size_t)length;
    }
    om_free(bytes);
    return status;
}

// Store the header's contents for the whole file.
static OmStatus fill_info(const Header* h, OmVolumeInfo* info) {
    int64_t dim[3];
    uint64_t nentry;
    OM_TRY(check_dims(h, dim, &nentry));
    for (int a = 0; a < 3; a++) {
        OM_CHECK(dim[a] >= 1 && dim[a] <= INT_MAX, OM_INVALID,
                 "the header states %lld voxels along axis %d", (long long)dim[a], a);
        info->dim[a] = (int)dim[a];
    }
    info->nentry = (int)nentry;
    static const double unit[8] = {0, 1, 1e-3,
                                   1e-6};  // others are refused where the volume is placed
    info->unit = unit[h->units & 7];
    info->has_space = h->sform > 0 || h->qform > 0;
    find_contradictions(h, info);
    return om__segment_finish(info);
}

// ---- the file -------------------------------------------------------------------------------------------

// Read the voxels after the header that was just read; `src` is at the end of that header.
static OmStatus read_body(const Header* h, OmSource* src, const OmVolumeTask* task) {
    OM_CHECK(h->vox_offset >= 0 && h->vox_offset < 1e15, OM_INVALID,
             "field vox_offset: %g is no position in a file", h->vox_offset);
    uint64_t offset = (uint64_t)h->vox_offset;
    uint64_t room = om__source_bound(src);
    if (h->is_pair) {  // all of the file is header
        if (!src->stream) OM_TRY(read_extensions(h, src, &room, task->info));
        OM_TRY(fill_info(h, task->info));
        return task->volume ? read_pair(h, offset, task) : OM_OK;
    }
    // unset: directly after the header and its extension flag
    if (offset == 0) offset = h->size + 4;
    OM_CHECK(offset >= h->size, OM_INVALID, "field vox_offset: %llu lies inside the header",
             (unsigned long long)offset);
    room = offset - h->size;
    OM_CHECK(room <= om__source_bound(src), OM_INVALID,
             "field vox_offset: %llu lies behind the end of the file", (unsigned long long)offset);
    OM_TRY(read_extensions(h, src, &room, task->info));
    OM_TRY(fill_info(h, task->info));
    return task->volume ? read_voxels(h, src, room, task) : OM_OK;
}

// Given the .img of a pair: continue with its .hdr.
static OmStatus parse_image_half(const OmVolumeTask* task) {
    char hdr[1024];
    OmSource src;
    OM_TRY(partner_path(task->path, "hdr", hdr, sizeof hdr));
    OM_TRY(om__source_open_file(&src, hdr));
    OmVolumeTask half = *task;
    half.path = hdr;
    OmStatus status = om__nifti_parse(&src, &half);
    om__source_done(&src);
    return status < 0 ? om_error_prefix(status, "%s", hdr) : status;
}

OmStatus om__nifti_parse(OmSource* src, const OmVolumeTask* task) {
    Header h;
    char ext[16] = "";
    if (task->path) om_path_extension(task->path, ext, sizeof ext);
    if (strncmp(ext, "img", 3) == 0) return parse_image_half(task);
    OM_CHECK(src->total > 0, OM_INVALID, "the file is empty");
    OmStatus status = om__source_is_gzip(src) ? om__source_inflate(src) : OM_OK;
    if (status == OM_OK) status = read_header(src, &h);
    if (status == OM_OK) status = read_body(&h, src, task);
    if (status < 0 && task->volume) om_volume_done(task->volume);
    return status;
}
