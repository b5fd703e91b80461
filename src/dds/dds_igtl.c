// dds_igtl.c: TRANSFORM and POLYDATA of OpenIGTLink (Tokuda et al. 2009), protocol version 1.
//
// A message is a head of 58 bytes (version 2, type 12, device 20, time stamp 8, size 8, CRC 8) and a body. The time
// stamp has seconds in its upper half and 2^-32 s in the lower one. TRANSFORM: three columns of the rotation, then the
// position, floats. POLYDATA: ten counts, points, then for each triangle "3" and its vertices.
#include "dds/dds_igtl.h"

#include <math.h>
#include <string.h>

enum { HEAD = 58, SIZE_AT = 42, CRC_AT = 50 };

static OmStatus add_number(OmText* out, uint64_t value, int nbyte) {
    char bytes[8];
    for (int i = 0; i < nbyte; ++i) bytes[i] = (char)(value >> (8 * (nbyte - 1 - i)) & 0xff);
    return om_text_append_raw(out, bytes, (size_t)nbyte);
}

static void put_number(char* at, uint64_t value) {
    for (int i = 0; i < 8; ++i) at[i] = (char)(value >> (8 * (7 - i)) & 0xff);
}

static OmStatus add_float(OmText* out, double value) {
    const float f = (float)value;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return add_number(out, bits, 4);
}

static OmStatus add_point_mm(OmText* out, OmVec3 p) {
    OM_TRY(add_float(out, 1e3 * p.x));
    OM_TRY(add_float(out, 1e3 * p.y));
    return add_float(out, 1e3 * p.z);
}

uint64_t om__igtl_crc(const char* data, size_t size) {
    uint64_t crc = 0;
    for (size_t i = 0; i < size; ++i) {
        crc ^= (uint64_t)(unsigned char)data[i] << 56;
        for (int k = 0; k < 8; ++k) crc = crc >> 63 ? crc << 1 ^ 0x42F0E1EBA9EA3693u : crc << 1;
    }
    return crc;
}

static OmStatus begin(const char* type, const char* name, double time, OmText* out) {
    char words[32] = {0};
    snprintf(words, 12, "%s", type);
    snprintf(words + 12, 20, "%s", name);
    const double sec = floor(time);
    OM_TRY(add_number(out, 1, 2));
    OM_TRY(om_text_append_raw(out, words, sizeof words));
    OM_TRY(add_number(out, (uint64_t)sec, 4));
    OM_TRY(add_number(out, (uint64_t)(4294967296.0 * (time - sec)), 4));
    OM_TRY(add_number(out, 0, 8));
    return add_number(out, 0, 8);
}

// Size and CRC of the body that follows the head at `from`.
static OmStatus end(OmText* out, size_t from) {
    char* head = out->str + from;
    const size_t size = out->len - from - HEAD;
    put_number(head + SIZE_AT, size);
    put_number(head + CRC_AT, om__igtl_crc(head + HEAD, size));
    return OM_OK;
}

OmStatus om__igtl_transform(const char* name, double time, OmPose pose, OmText* out) {
    const size_t from = out->len;
    const OmMat3 r = om_quat_to_mat3(pose.q);
    const OmVec3 column[3] = {r.cx, r.cy, r.cz};
    OM_TRY(begin("TRANSFORM", name, time, out));
    for (int i = 0; i < 3; ++i) {
        OM_TRY(add_float(out, column[i].x));
        OM_TRY(add_float(out, column[i].y));
        OM_TRY(add_float(out, column[i].z));
    }
    OM_TRY(add_point_mm(out, pose.p));
    return end(out, from);
}

OmStatus om__igtl_surface(const char* name, double time, const OmSurface* surface, const double* x,
                          const int* vert, OmText* out) {
    const size_t from = out->len;
    const uint32_t n = (uint32_t)surface->nvert, ntri = (uint32_t)surface->ntri;
    // points; vertices, lines, polygons, strips with their bytes; attributes
    const uint32_t count[10] = {n, 0, 0, 0, 0, ntri, 16 * ntri, 0, 0, 0};
    OM_TRY(begin("POLYDATA", name, time, out));
    for (int i = 0; i < 10; ++i) OM_TRY(add_number(out, count[i], 4));
    for (int i = 0; i < surface->nvert; ++i) OM_TRY(add_point_mm(out, om_load3(x, vert[i])));
    for (int t = 0; t < surface->ntri; ++t) {
        OM_TRY(add_number(out, 3, 4));
        for (int k = 0; k < 3; ++k)
            OM_TRY(add_number(out, (uint32_t)surface->tri_vert[3 * t + k], 4));
    }
    return end(out, from);
}
